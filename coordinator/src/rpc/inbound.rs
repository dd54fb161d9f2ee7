//! What comes from the sockets.

use lookalike::graph::WorkerId;
use lookalike::protocol::{Hello, LeaseName};
use tokio::sync::oneshot;
use tokio::time::Instant;

use super::mailbox::Mailbox;
use crate::events::RunEvent;
use crate::reactor::Event;

/// What comes from the sockets.
#[derive(Debug)]
pub(crate) enum Inbound {
    /// A worker has said hello. What is put into the mailbox goes to it.
    Joined { worker: WorkerId, hello: Hello, mailbox: Mailbox },
    /// A worker announces an output for this lease: may it come? A lease that was never given out is answered with `false`.
    Ask { lease: LeaseName, answer: oneshot::Sender<bool> },
    /// Something happened.
    Event(Event),
    /// Something happened at this time, which matters, though it may be looked at later.
    Timed { arrived: Instant, event: Event },
    /// Something to tell the user that the reactor does not care about.
    Tell(RunEvent),
}
