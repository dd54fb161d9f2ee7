//! Limits on what connections may cost the coordinator.

use std::time::Duration;

use lookalike::protocol::MAX_FRAME_BYTES;

/// Bounds on what connections may cost. A stranger is a connection that has not proved the secret and said hello yet; a worker
/// is one that has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// How many strangers there may be at a time, 1 or more (default 256). Each costs at most about 150 kB: the 64 KiB that a TLS
    /// handshake message may have, and what the sockets buffer. When one more comes, the one that has been there longest has to
    /// go: workers are strangers for milliseconds, so whoever holds places without using them does not keep workers out.
    pub strangers: usize,
    /// How long a stranger may take from its connection to its hello, the TLS handshake included (default 10 s).
    pub stranger_time: Duration,
    /// How many connections there may be at a time, strangers and workers (default 4096); further ones are closed at once.
    pub connections: usize,
    /// The longest frame a worker may send, in bytes, checked before anything is allocated (default, and at most,
    /// [`MAX_FRAME_BYTES`]: 2 MiB).
    pub frame_bytes: usize,
    /// How many blobs a worker may have asked for without having taken them (default 65536: sixteen leases of the 4096 inputs that a
    /// node may have; those of a fit have dozens). What waits are references; a blob's bytes are in memory once.
    pub pending_blobs: usize,
    /// How many bytes of messages may wait for a worker to read them (default 64 MiB); with more it is thrown out as too slow. Its
    /// leases are given out such that one that reads never comes near.
    pub queued_bytes: usize,
    /// How long a worker may take to close its end after the coordinator's last word (default 2 s).
    pub farewell_time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            strangers: 256,
            stranger_time: Duration::from_secs(10),
            connections: 4096,
            frame_bytes: MAX_FRAME_BYTES,
            pending_blobs: 1 << 16,
            queued_bytes: 64 << 20,
            farewell_time: Duration::from_secs(2),
        }
    }
}
