//! Fits whose nodes have ended but whose results are not written yet, and therefore still in memory.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// The number and the size of some fits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Load {
    pub(super) fits: usize,
    /// The total number of pixels of their photos.
    pub(super) pixels: usize,
}

impl std::ops::Add for Load {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { fits: self.fits + other.fits, pixels: self.pixels + other.pixels }
    }
}

/// The fits that are being written. Clones share one backlog.
#[derive(Debug, Clone, Default)]
pub(super) struct Backlog(Arc<(Mutex<Load>, Condvar)>);

impl Backlog {
    /// Adds a fit with this many pixels, until the returned entry is dropped.
    pub(super) fn add(&self, pixels: usize) -> Entry {
        let mut load = self.lock();
        *load = *load + Load { fits: 1, pixels };
        Entry { backlog: self.clone(), pixels }
    }

    /// The fits that are being written.
    pub(super) fn load(&self) -> Load {
        *self.lock()
    }

    /// Waits until `is_little` accepts the remaining load, or until the backlog is empty.
    pub(super) fn wait_until(&self, is_little: impl Fn(Load) -> bool) {
        let is_much = |load: &mut Load| load.fits > 0 && !is_little(*load);
        drop(self.0.1.wait_while(self.lock(), is_much));
    }

    fn lock(&self) -> MutexGuard<'_, Load> {
        // The two numbers are always set together, so a panic leaves them consistent.
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A fit that is being written.
#[derive(Debug)]
pub(super) struct Entry {
    backlog: Backlog,
    pixels: usize,
}

impl Drop for Entry {
    fn drop(&mut self) {
        let mut load = self.backlog.lock();
        *load = Load { fits: load.fits - 1, pixels: load.pixels - self.pixels };
        drop(load);
        self.backlog.0.1.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_thread_continues_when_enough_fits_are_written() {
        let backlog = Backlog::default();
        let entries: Vec<Entry> = [100, 20, 3].map(|pixels| backlog.add(pixels)).into();
        assert_eq!(backlog.load(), Load { fits: 3, pixels: 123 });
        backlog.wait_until(|load| load.fits <= 3);
        let left = std::thread::scope(|scope| {
            let waiter = scope.spawn(|| {
                backlog.wait_until(|load| load.pixels < 10);
                backlog.load()
            });
            let last = entries.into_iter().rev().take(1).collect::<Vec<_>>();
            let left = waiter.join().unwrap();
            drop(last);
            left
        });
        assert_eq!(left, Load { fits: 1, pixels: 3 });
        // No load is accepted, so this waits until the backlog is empty.
        backlog.wait_until(|_| false);
    }
}
