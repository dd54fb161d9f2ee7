//! A disk with simulated latency: see [`World::disk_time`](lookalike_worker::world::World::disk_time).
//!
//! The journal's thread writes as usual, but the caller blocks until it has written, and the write is reported after the disk's
//! time. So nothing depends on when the thread runs.

use std::collections::VecDeque;
use std::sync::mpsc::{Sender, sync_channel};
use std::time::Duration;

use tokio::time::{Instant, sleep_until};

use super::writer::Command;

/// Writes that have not been reported yet.
#[derive(Debug)]
pub(super) struct Disk {
    time: Duration,
    due: VecDeque<Instant>,
}

impl Disk {
    pub(super) fn new(time: Duration) -> Self {
        Self { time, due: VecDeque::new() }
    }

    /// Block until the thread has executed the command that was sent to it.
    pub(super) fn wait(&mut self, commands: &Sender<Command>) {
        let (sender, done) = sync_channel(1);
        if commands.send(Command::Wait(sender)).is_ok() {
            let _ = done.recv();
        }
        self.due.push_back(Instant::now() + self.time);
    }

    /// Wait until the earliest write may be reported.
    pub(super) async fn told(&mut self) {
        if let Some(due) = self.due.front() {
            sleep_until(*due).await;
            self.due.pop_front();
        }
    }
}
