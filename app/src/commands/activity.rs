//! Lines on stderr that say what a slow command does, where there is no other display: one after 2 s, then one every 10 s.

use crate::progress::print_line;
use std::{
    sync::mpsc::{RecvTimeoutError, Sender, channel},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

/// The time before the first line.
const FIRST: Duration = Duration::from_secs(2);

/// The time between two lines.
const PAUSE: Duration = Duration::from_secs(10);

/// Lines about some work, until this is dropped.
#[derive(Debug)]
pub(super) struct Activity {
    /// Dropping it ends the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Activity {
    /// The work begins. `what` says what is done, as of now.
    pub(super) fn new(what: impl Fn() -> String + Send + 'static) -> Self {
        let (end, ended) = channel();
        let thread = thread::spawn(move || {
            let began = Instant::now();
            let mut pause = FIRST;
            while ended.recv_timeout(pause) == Err(RecvTimeoutError::Timeout) {
                print_line(&format!("{} ({} s)", what(), began.elapsed().as_secs()));
                pause = PAUSE;
            }
        });
        Self { end: Some(end), thread: Some(thread) }
    }
}

impl Drop for Activity {
    fn drop(&mut self) {
        self.end = None;
        // So that no line follows.
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;

    #[test]
    fn work_is_described_while_it_lasts() {
        let (said, heard) = channel();
        let activity = Activity::new(move || {
            let _ = said.send(());
            "waiting".to_owned()
        });
        assert_eq!(heard.recv(), Ok(()));
        drop(activity);
        assert!(heard.recv_timeout(2 * PAUSE).is_err());
    }
}
