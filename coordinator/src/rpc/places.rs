//! Places for unauthenticated connections: those that have not proved the secret. A new one always gets a place.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio_util::sync::CancellationToken;

/// The connections that have not proved the secret yet, in order of arrival.
#[derive(Clone, Debug)]
pub(super) struct Places {
    limit: usize,
    present: Arc<Mutex<VecDeque<Arc<CancellationToken>>>>,
}

/// The place of one connection. Dropping this frees it.
#[derive(Debug)]
pub(super) struct Place {
    all: Places,
    token: Arc<CancellationToken>,
}

impl Places {
    /// This many places; at least one.
    pub(super) fn new(limit: usize) -> Self {
        Self { limit: limit.max(1), present: Arc::default() }
    }

    /// Take a place. If none is free, the oldest connection loses its place.
    pub(super) fn enter(&self) -> Place {
        let token = Arc::new(CancellationToken::new());
        let mut present = self.present();
        while present.len() >= self.limit {
            present.pop_front().into_iter().for_each(|oldest| oldest.cancel());
        }
        present.push_back(Arc::clone(&token));
        drop(present);
        Place { all: self.clone(), token }
    }

    fn present(&self) -> MutexGuard<'_, VecDeque<Arc<CancellationToken>>> {
        self.present.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Place {
    /// Wait until a newer connection takes the place.
    pub(super) async fn is_needed(&self) {
        self.token.cancelled().await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.all.present().retain(|token| !Arc::ptr_eq(token, &self.token));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_connection_takes_the_place_of_the_oldest() {
        let all = Places::new(2);
        let places = [all.enter(), all.enter(), all.enter()];
        assert_eq!(places.each_ref().map(|place| place.token.is_cancelled()), [true, false, false]);
        let [first, second, third] = places;
        drop(second);
        let fourth = all.enter();
        assert!(!third.token.is_cancelled() && !fourth.token.is_cancelled());
        drop((first, third, fourth));
        assert!(all.present().is_empty());
    }
}
