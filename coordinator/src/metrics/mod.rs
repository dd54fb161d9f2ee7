//! `--metrics`: the counters of a run for Prometheus, over HTTP in its text format.
//!
//! The metrics are derived from the run's events and the states of its parts, so no other module depends on metrics, and no result
//! does. docs/batch.md lists their names, which are a contract.

mod book;
mod histogram;
mod http;
mod text;

use crate::{events::RunEvent, runner::Pulse};
use book::Book;
use std::{
    io,
    net::{SocketAddr, TcpListener},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

/// The metrics of a run, and the socket on which they are served. Clones share them.
#[derive(Debug, Clone)]
pub struct Metrics {
    book: Arc<Mutex<Book>>,
    listener: Arc<TcpListener>,
    address: SocketAddr,
    pulse: Arc<Pulse>,
}

/// The metric of the parts of a run by state, under the name by which users know the parts.
#[derive(Debug, Clone, Copy)]
pub struct PartsMetric {
    /// Its name.
    pub name: &'static str,
    /// Its line of help.
    pub help: &'static str,
}

/// A loop that has not completed a round for this long counts as hanging. The longest single step is that of a
/// planner that reads the inputs of one part.
const LONGEST_ROUND: Duration = Duration::from_secs(30);

impl Metrics {
    /// Bind the address. Requests wait until [`Metrics::serve`] answers them.
    ///
    /// # Errors
    /// If the address cannot be bound.
    pub fn listen(address: SocketAddr) -> io::Result<Self> {
        let listener = TcpListener::bind(address)?;
        listener.set_nonblocking(true)?;
        Ok(Self {
            book: Arc::new(Mutex::new(Book::new(Instant::now()))),
            address: listener.local_addr()?,
            listener: Arc::new(listener),
            pulse: Arc::default(),
        })
    }

    /// The address for a browser.
    pub fn url(&self) -> String {
        format!("http://{}/metrics", self.address)
    }

    /// Process an event.
    pub fn note(&self, event: &RunEvent) {
        self.with_book(|book| book.note(event, Instant::now()));
    }

    /// The pulse that the loop of the run must update.
    pub fn pulse(&self) -> Arc<Pulse> {
        Arc::clone(&self.pulse)
    }

    /// Set the number of parts in each state.
    pub fn set_parts(&self, metric: PartsMetric, states: &[(&'static str, usize)]) {
        self.with_book(|book| book.parts = Some((metric, states.to_vec())));
    }

    /// Answer requests while the future is polled. Must be called inside a tokio runtime.
    ///
    /// # Errors
    /// If the runtime cannot use the socket.
    pub fn serve(&self) -> io::Result<impl Future<Output = ()> + Send + use<>> {
        let listener = self.listener.try_clone().and_then(tokio::net::TcpListener::from_std)?;
        Ok(http::serve(listener, self.clone()))
    }

    fn with_book<T>(&self, use_it: impl FnOnce(&mut Book) -> T) -> T {
        // After a panic, at worst one value is slightly wrong.
        use_it(&mut self.book.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl http::Pages for Metrics {
    fn page(&self) -> String {
        self.with_book(|book| text::page(book, Instant::now()))
    }

    fn health(&self) -> Result<(), String> {
        health(self.pulse.age())
    }
}

/// Whether the loop is healthy, given the time since its last round; `None` if it has not started.
fn health(age: Option<Duration>) -> Result<(), String> {
    match age.filter(|age| *age > LONGEST_ROUND) {
        None => Ok(()),
        Some(age) => Err(format!("the event loop last ran {} s ago", age.as_secs())),
    }
}

#[cfg(test)]
mod tests;
