//! Faults of a simulated run, and their repairs.

use std::sync::Weak;
use std::time::Duration;

use lookalike_worker::ending::Wishes;

use super::chance::Chance;
use super::stage::Place;
use super::wire::WireControl;

/// Something done to the run at its time.
#[derive(Clone, Debug)]
pub(super) enum Event {
    /// A new fault, chosen at random when it happens.
    Fault,
    /// The link to a worker works again.
    MendLink(usize, Link),
    /// An end of a connection fails.
    Reset(Weak<WireControl>),
    /// A process starts in a place that has none.
    Start(Place),
    /// A stuck worker continues.
    Unstick(usize),
    /// A slow worker computes as fast as the others again.
    Hurry(usize),
    /// A worker that was asked to end is asked a second time.
    Insist(Wishes),
}

/// A fault of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Link {
    /// Everything on it waits, nothing is lost.
    Held,
    /// Everything on it is lost, both ways.
    Cut,
    /// What goes to the worker is lost.
    CutDown,
    /// What comes from the worker is lost.
    CutUp,
    /// Everything on it takes long.
    Slow,
}

/// A kind of fault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    Link(Link),
    /// The connections end, as when a firewall ends them: each end notices at its own time.
    ResetConnections,
    /// A worker's process is killed.
    KillWorker,
    /// A worker's machine vanishes without closing its connections.
    PowerOff,
    /// A worker is asked to end.
    Drain,
    /// A worker computes and sends nothing for a while.
    Stick,
    /// A worker computes slowly.
    SlowDown,
    /// The coordinator's process is killed; another one resumes the run.
    KillCoordinator,
    /// The same, and some workers are killed with it: the next coordinator starts with fewer of them, and more join later.
    KillAll,
}

impl Fault {
    const ALL: [Self; 13] = [
        Self::Link(Link::Held),
        Self::Link(Link::Cut),
        Self::Link(Link::CutDown),
        Self::Link(Link::CutUp),
        Self::Link(Link::Slow),
        Self::ResetConnections,
        Self::KillWorker,
        Self::PowerOff,
        Self::Drain,
        Self::Stick,
        Self::SlowDown,
        Self::KillCoordinator,
        Self::KillAll,
    ];

    /// A random kind of fault.
    pub(super) fn draw(chance: &mut Chance) -> Self {
        chance.of(&Self::ALL)
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Link(Link::Held) => "link held",
            Self::Link(Link::Cut) => "link cut",
            Self::Link(Link::CutDown) => "link cut downwards",
            Self::Link(Link::CutUp) => "link cut upwards",
            Self::Link(Link::Slow) => "link slow",
            Self::ResetConnections => "connections reset",
            Self::KillWorker => "worker killed",
            Self::PowerOff => "worker's machine off",
            Self::Drain => "worker drained",
            Self::Stick => "worker stuck",
            Self::SlowDown => "worker slow",
            Self::KillCoordinator => "coordinator killed",
            Self::KillAll => "coordinator and workers killed",
        }
    }

    /// How long it lasts.
    pub(super) fn time(self, chance: &mut Chance) -> Duration {
        match self {
            Self::KillCoordinator | Self::KillAll | Self::KillWorker => chance.time(10, 4000),
            _ => chance.time(50, 9000),
        }
    }
}
