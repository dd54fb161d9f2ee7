//! Limits on what connections may cost the coordinator.

use std::time::Duration;

use lookalike::protocol::MAX_FRAME_BYTES;

/// The pause after the system fails to accept a connection, for example when file descriptors run out.
pub(crate) const ACCEPT_PAUSE: Duration = Duration::from_millis(100);

/// Bounds on what connections may cost. A connection is unauthenticated until it has proved the secret and sent its hello; from then
/// on it belongs to a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// How many unauthenticated connections there may be at a time, 1 or more. Each costs at most about 150 kB: the
    /// 64 KiB that a TLS handshake message may have, and the buffers of its socket. If there is one more, the oldest is closed. A
    /// worker authenticates within milliseconds, so idle connections do not keep workers out.
    pub unauthenticated: usize,
    /// How long a connection may take until its hello, the TLS handshake included.
    pub handshake_time: Duration,
    /// How many connections there may be at a time, authenticated or not; further ones are closed at once.
    pub connections: usize,
    /// The longest frame a worker may send, in bytes, checked before anything is allocated; at most
    /// [`MAX_FRAME_BYTES`].
    pub frame_bytes: usize,
    /// How many blobs a worker may have requested but not yet received. The queue holds references; a blob's bytes are in memory once.
    pub pending_blobs: usize,
    /// How many bytes of messages may be queued for a worker; with more it is disconnected as too slow. The number of
    /// its leases is limited such that a worker that reads stays far below.
    pub queued_bytes: usize,
    /// How long a worker may take to close its end after the coordinator's last message.
    pub farewell_time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            unauthenticated: 256,
            handshake_time: Duration::from_secs(10),
            connections: 4096,
            frame_bytes: MAX_FRAME_BYTES,
            // Sixteen leases of nodes with the most inputs.
            pending_blobs: 1 << 16,
            queued_bytes: 64 << 20,
            farewell_time: Duration::from_secs(2),
        }
    }
}
