//! Opens the socket on which the metrics of a run are served.

use crate::{exit::Exit, settings::MetricsAddress};
use anyhow::Context;
use lookalike_coordinator::metrics::Metrics;

/// Listens on the address of `--metrics`, if there is one.
///
/// # Errors
/// If the address cannot be listened on; the exit code is that of bad input.
pub(crate) fn listen(address: Option<MetricsAddress>) -> anyhow::Result<Option<Metrics>> {
    let Some(address) = address else { return Ok(None) };
    let cannot = || {
        format!(
            "cannot serve metrics on {address}; check that the address belongs to this machine and that the port is free"
        )
    };
    Metrics::listen(address.0).map(Some).with_context(cannot).context(Exit::BadInput)
}
