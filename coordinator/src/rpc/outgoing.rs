//! Messages to a worker.

use lookalike::graph::Blob;
use lookalike::protocol::ToWorker;

/// A message to a worker.
#[derive(Debug)]
pub(crate) enum Outgoing {
    Message(ToWorker),
    Blob(Blob),
    /// The requested blob is not sent, because no lease of the worker reads it any more.
    NoBlob,
}
