//! Messages from the sockets to the reactor.

use lookalike::graph::WorkerId;
use lookalike::protocol::{Hello, LeaseName};
use tokio::sync::oneshot;
use tokio::time::Instant;

use super::mailbox::Mailbox;
use crate::events::RunEvent;
use crate::reactor::Event;

/// Messages from the sockets to the reactor.
#[derive(Debug)]
pub(crate) enum Inbound {
    /// A worker has said hello. Its outgoing messages go into the mailbox.
    Joined { worker: WorkerId, hello: Hello, mailbox: Mailbox },
    /// A worker announces an output for this lease. The answer `false` rejects it, because the lease was never given out.
    Ask { lease: LeaseName, answer: oneshot::Sender<bool> },
    /// An event for the reactor.
    Event(Event),
    /// An event with its time of arrival, which is used even if the event is processed later.
    Timed { arrived: Instant, event: Event },
    /// An event for the user only, which the reactor ignores.
    Tell(RunEvent),
}
