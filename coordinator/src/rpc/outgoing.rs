//! What goes to a worker.

use lookalike::graph::Blob;
use lookalike::protocol::ToWorker;

/// What goes to a worker.
#[derive(Debug)]
pub(crate) enum Outgoing {
    Message(ToWorker),
    Blob(Blob),
    /// Nothing, for a blob that was asked for.
    NoBlob,
}
