//! Places for connections that have not proved the secret (strangers). A new one always gets a place.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio_util::sync::CancellationToken;

/// The connections that have not proved the secret yet, in order of arrival.
#[derive(Clone, Debug)]
pub(super) struct Strangers {
    places: usize,
    present: Arc<Mutex<VecDeque<Arc<CancellationToken>>>>,
}

/// A stranger's place. Dropping this frees it.
#[derive(Debug)]
pub(super) struct Place {
    strangers: Strangers,
    token: Arc<CancellationToken>,
}

impl Strangers {
    /// This many places; at least one.
    pub(super) fn new(places: usize) -> Self {
        Self { places: places.max(1), present: Arc::default() }
    }

    /// Take a place. If none is free, the oldest stranger loses its place.
    pub(super) fn enter(&self) -> Place {
        let token = Arc::new(CancellationToken::new());
        let mut present = self.present();
        while present.len() >= self.places {
            present.pop_front().into_iter().for_each(|longest| longest.cancel());
        }
        present.push_back(Arc::clone(&token));
        drop(present);
        Place { strangers: self.clone(), token }
    }

    fn present(&self) -> MutexGuard<'_, VecDeque<Arc<CancellationToken>>> {
        self.present.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Place {
    /// Wait until a newer stranger takes the place.
    pub(super) async fn is_needed(&self) {
        self.token.cancelled().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.strangers.present().retain(|token| !Arc::ptr_eq(token, &self.token));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_has_been_here_longest_makes_room() {
        let strangers = Strangers::new(2);
        let places = [strangers.enter(), strangers.enter(), strangers.enter()];
        assert_eq!(places.each_ref().map(|place| place.token.is_cancelled()), [true, false, false]);
        let [first, second, third] = places;
        drop(second);
        let fourth = strangers.enter();
        assert!(!third.token.is_cancelled() && !fourth.token.is_cancelled());
        drop((first, third, fourth));
        assert!(strangers.present().is_empty());
    }
}
