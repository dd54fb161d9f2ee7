//! Lines on stderr that say what a slow command does, where there is no other display: one after 2 s, then one every 10 s.

use super::{FIRST, PAUSE, print_line};
use crate::settings::ProgressKind;
use std::{
    sync::{
        Arc,
        atomic::{AtomicUsize, Ordering},
        mpsc::{RecvTimeoutError, Sender, channel},
    },
    thread::{self, JoinHandle},
    time::Instant,
};

/// Lines about some work, until this is dropped.
#[derive(Debug)]
pub(crate) struct Activity {
    /// Dropping it ends the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Activity {
    /// The work begins. `what` says what is done, as of now.
    pub(crate) fn new(what: impl Fn() -> String + Send + 'static) -> Self {
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

    /// As [`Activity::new`], if progress of this kind is text.
    pub(crate) fn shown(kind: ProgressKind, what: impl Fn() -> String + Send + 'static) -> Option<Self> {
        match kind {
            ProgressKind::Auto | ProgressKind::Bar => Some(Self::new(what)),
            ProgressKind::Json | ProgressKind::None => None,
        }
    }

    /// Says how many of the files or fits have been read, which the caller counts.
    pub(crate) fn reading(kind: ProgressKind, total: String, read: &Arc<AtomicUsize>) -> Option<Self> {
        let read = Arc::clone(read);
        Self::shown(kind, move || format!("reading the inputs: {} of {total}", read.load(Ordering::Relaxed)))
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
