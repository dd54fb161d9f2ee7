//! Messages to a worker.

use lookalike::graph::Blob;
use lookalike::protocol::ToWorker;

/// A message to a worker.
#[derive(Debug)]
pub(crate) enum Outgoing {
    Message(ToWorker),
    Blob(Blob),
    /// The requested blob does not exist.
    NoBlob,
}
