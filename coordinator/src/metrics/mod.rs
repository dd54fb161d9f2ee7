//! `--metrics`: the counters of a run for Prometheus, over HTTP in its text format.
//!
//! The counts come from the events of the run and from the states of the fits, so that no other module knows of metrics. They are for
//! people: none of them reaches a result. docs/batch.md lists their names, which are a contract.

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

/// The metrics of a run, and where they are served. Clones are the same metrics.
#[derive(Debug, Clone)]
pub struct Metrics {
    book: Arc<Mutex<Book>>,
    listener: Arc<TcpListener>,
    address: SocketAddr,
    pulse: Arc<Pulse>,
}

/// A loop that has not turned for this long hangs: the longest single step reads one photo and its light.
const LONGEST_ROUND: Duration = Duration::from_secs(30);

impl Metrics {
    /// Takes the address; requests wait until [`Metrics::serve`] answers them.
    ///
    /// # Errors
    /// If it cannot be listened on.
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

    /// What to type into a browser.
    pub fn url(&self) -> String {
        format!("http://{}/metrics", self.address)
    }

    /// Takes note of what happened.
    pub fn note(&self, event: &RunEvent) {
        self.with_book(|book| book.note(event, Instant::now()));
    }

    /// What the loop of the run has to show its rounds to.
    pub fn pulse(&self) -> Arc<Pulse> {
        Arc::clone(&self.pulse)
    }

    /// How many fits there are in each state.
    pub fn set_fits(&self, fits: &[(&'static str, usize)]) {
        self.with_book(|book| book.set_fits(fits));
    }

    /// Answers requests for as long as it is polled. To be called inside a tokio runtime.
    ///
    /// # Errors
    /// If the runtime refuses the socket.
    pub fn serve(&self) -> io::Result<impl Future<Output = ()> + Send + use<>> {
        let listener = self.listener.try_clone().and_then(tokio::net::TcpListener::from_std)?;
        Ok(http::serve(listener, self.clone()))
    }

    fn with_book<T>(&self, use_it: impl FnOnce(&mut Book) -> T) -> T {
        // A panic cannot leave the numbers half changed in a way that matters.
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

/// Whether a loop is well that went round so long ago, if it has begun.
fn health(age: Option<Duration>) -> Result<(), String> {
    match age.filter(|age| *age > LONGEST_ROUND) {
        None => Ok(()),
        Some(age) => Err(format!("the loop that hands out work went round {} s ago", age.as_secs())),
    }
}

#[cfg(test)]
mod tests;
