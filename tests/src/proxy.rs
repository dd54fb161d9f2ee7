//! A proxy between a worker and its coordinator, controlled by a test: it counts, holds back and drops bytes and breaks connections.
//!
//! All traffic is encrypted, so the proxy sees and affects only bytes and connections, as a real network does.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

use crate::PATIENCE;

/// The most bytes that are recorded.
const RECORD_BYTES: usize = 64 << 10;

/// A direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// From the worker to the coordinator.
    Up,
    /// From the coordinator to the worker.
    Down,
}

/// A proxy that several workers may use one after the other.
#[derive(Debug)]
pub struct Proxy {
    address: SocketAddr,
    wire: Arc<Wire>,
}

#[derive(Debug, Default)]
struct Wire {
    state: Mutex<State>,
    changed: Condvar,
}

/// Bytes that have passed and may pass, since the last connection began.
#[derive(Debug, Default)]
struct State {
    passed: [u64; 2],
    allowed: [Option<u64>; 2],
    /// Directions in which bytes wait to be allowed.
    stopped: [bool; 2],
    connections: u64,
    /// The first bytes that the worker sent.
    record: Vec<u8>,
    /// Both ends of each connection.
    streams: Vec<TcpStream>,
    is_over: bool,
}

impl Proxy {
    /// A proxy for this coordinator.
    ///
    /// # Panics
    /// When the system has no free port.
    #[must_use]
    pub fn to(coordinator: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("the address of a bound socket");
        let wire = Arc::new(Wire::default());
        let (accepting, coordinator) = (Arc::clone(&wire), coordinator.to_owned());
        thread::spawn(move || accepting.serve(&listener, &coordinator));
        Self { address, wire }
    }

    /// The address for the worker's `--address`.
    #[must_use]
    pub fn address(&self) -> String {
        self.address.to_string()
    }

    /// Let at most this many bytes through in this direction, counted from the start of each connection; `None`: all. The end of a stream
    /// waits behind the bytes that wait.
    pub fn allow(&self, way: Way, bytes: Option<u64>) {
        let mut state = self.wire.lock();
        state.allowed[way as usize] = bytes;
        // A thread that still has to wait sets this again.
        state.stopped[way as usize] = false;
        drop(state);
        self.wire.changed.notify_all();
    }

    /// Let nothing through in either direction, without ending the connections. Undone by [`heal`](Self::heal).
    pub fn silence(&self) {
        let mut state = self.wire.lock();
        state.allowed = [Some(0), Some(0)];
        state.stopped = [false, false];
    }

    /// Let everything through again.
    pub fn heal(&self) {
        self.wire.lock().allowed = [None, None];
        self.wire.changed.notify_all();
    }

    /// Wait until bytes are held back in this direction, and return how many have passed.
    ///
    /// # Panics
    /// When none arrive in time.
    #[must_use]
    pub fn wait_for_stop(&self, way: Way) -> u64 {
        self.wire.wait_while(|state| !state.stopped[way as usize]).passed[way as usize]
    }

    /// How many bytes have passed in this direction since the last connection began.
    #[must_use]
    pub fn passed(&self, way: Way) -> u64 {
        self.wire.lock().passed[way as usize]
    }

    /// The first bytes that the last worker sent, as seen on the network: 64 KiB at most.
    #[must_use]
    pub fn record(&self) -> Vec<u8> {
        self.wire.lock().record.clone()
    }

    /// Break all connections, and let everything through on the next ones.
    pub fn renew(&self) {
        let mut state = self.wire.lock();
        state.cut();
        state.allowed = [None, None];
        drop(state);
        self.wire.changed.notify_all();
    }

    /// Break all connections; bytes held back are lost. New connections are accepted.
    pub fn cut(&self) {
        self.wire.lock().cut();
        self.wire.changed.notify_all();
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        let mut state = self.wire.lock();
        state.is_over = true;
        state.cut();
        drop(state);
        self.wire.changed.notify_all();
        // Wakes the thread that accepts.
        let _ = TcpStream::connect(self.address);
    }
}

impl State {
    fn cut(&mut self) {
        // An error means that the connection is broken already.
        self.streams.drain(..).for_each(|stream| _ = stream.shutdown(Shutdown::Both));
    }
}

impl Wire {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn wait_while(&self, condition: impl FnMut(&mut State) -> bool) -> MutexGuard<'_, State> {
        let waited = self.changed.wait_timeout_while(self.lock(), PATIENCE, condition);
        let (state, timeout) = waited.unwrap_or_else(PoisonError::into_inner);
        assert!(!timeout.timed_out(), "nothing comes on the wire: {state:?}");
        state
    }

    fn serve(self: &Arc<Self>, listener: &TcpListener, coordinator: &str) {
        for below in listener.incoming() {
            let Ok(below) = below else { continue };
            let mut state = self.lock();
            if state.is_over {
                return;
            }
            // There is no coordinator at the moment: the worker sees its connection closed.
            let Ok(above) = TcpStream::connect(coordinator) else { continue };
            state.passed = [0, 0];
            state.stopped = [false, false];
            state.record.clear();
            state.connections += 1;
            let number = state.connections;
            for (way, from, to) in [(Way::Up, &below, &above), (Way::Down, &above, &below)] {
                let (Ok(from), Ok(to)) = (from.try_clone(), to.try_clone()) else { continue };
                let wire = Arc::clone(self);
                thread::spawn(move || wire.carry(way, number, from, &to));
            }
            state.streams.extend([below, above]);
            drop(state);
            self.changed.notify_all();
        }
    }

    /// Copy bytes in one direction until the end of the stream.
    fn carry(&self, way: Way, number: u64, mut from: TcpStream, mut to: &TcpStream) {
        let mut buffer = [0; 4096];
        loop {
            let count = match from.read(&mut buffer) {
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(_) => 0,
            };
            let mut rest = &buffer[..count];
            loop {
                let Some(now) = self.take(way, number, rest) else { return };
                let (passing, waiting) = rest.split_at(now);
                if to.write_all(passing).is_err() {
                    return;
                }
                rest = waiting;
                if rest.is_empty() {
                    break;
                }
            }
            if count == 0 {
                // The other direction stays open.
                let _ = to.shutdown(Shutdown::Write);
                return;
            }
        }
    }

    /// How many of these bytes may pass now. Waits until at least one may, and for the end of a stream until everything may. `None` when
    /// the connection is broken.
    fn take(&self, way: Way, number: u64, bytes: &[u8]) -> Option<usize> {
        let (is_up, way) = (way == Way::Up, way as usize);
        let mut state = self.lock();
        loop {
            if state.is_over || state.streams.is_empty() || state.connections != number {
                return None;
            }
            let room = state.allowed[way].map_or(u64::MAX, |allowed| allowed.saturating_sub(state.passed[way]));
            if room > 0 {
                let now = bytes.len().min(usize::try_from(room).unwrap_or(usize::MAX));
                let recorded = RECORD_BYTES.saturating_sub(state.record.len()).min(now);
                if is_up {
                    state.record.extend_from_slice(&bytes[..recorded]);
                }
                state.passed[way] += now as u64;
                state.stopped[way] = false;
                return Some(now);
            }
            state.stopped[way] = true;
            self.changed.notify_all();
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}
