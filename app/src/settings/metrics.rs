//! `--metrics`: where metrics are served.

use anyhow::bail;
use std::{
    fmt,
    net::{Ipv4Addr, SocketAddr},
    str::FromStr,
};

/// An address to serve metrics on. Everyone who can connect to it can read them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MetricsAddress(pub SocketAddr);

impl FromStr for MetricsAddress {
    type Err = anyhow::Error;

    /// `IP:PORT`, or a port of the loopback interface as `PORT` or `:PORT`.
    fn from_str(text: &str) -> anyhow::Result<Self> {
        if let Ok(address) = text.parse() {
            return Ok(Self(address));
        }
        match text.strip_prefix(':').unwrap_or(text).parse() {
            Ok(port) => Ok(Self((Ipv4Addr::LOCALHOST, port).into())),
            Err(_) => bail!("expected IP:PORT, or PORT for the loopback interface; an IPv6 address needs brackets"),
        }
    }
}

impl fmt::Display for MetricsAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metrics_are_served_on_the_loopback_interface_unless_another_is_named() {
        let address = |text: &str| text.parse::<MetricsAddress>().map(|address| address.to_string()).ok();
        assert_eq!(address("9100").as_deref(), Some("127.0.0.1:9100"));
        assert_eq!(address(":0").as_deref(), Some("127.0.0.1:0"));
        assert_eq!(address("0.0.0.0:9100").as_deref(), Some("0.0.0.0:9100"));
        assert_eq!(address("[::1]:9100").as_deref(), Some("[::1]:9100"));
        for text in ["", "host", "localhost:9100", "70000", "::1:9100x"] {
            assert_eq!(address(text), None, "{text}");
        }
    }
}
