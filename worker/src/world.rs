//! The environment of a coordinator or a worker: network, heartbeat, threads, random bytes.
//!
//! The program runs in [`Real`]; tests run it in a world that simulates all of this. Time is not part of the trait: all waits use
//! `tokio::time`, whose clock belongs to the runtime, and the runtime of the tests simulates that too.

use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::sync::{Arc, mpsc};
use std::time::Duration;

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use tokio::io::{AsyncRead, AsyncWrite};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Notify;
use tracing::warn;

/// The environment of one process.
pub trait World: Clone + Send + Sync + 'static {
    /// A connection, like one of TCP.
    type Stream: AsyncRead + AsyncWrite + Unpin + Send + 'static;
    /// A listening socket.
    type Listener: Send + 'static;
    /// A running heartbeat; it stops when this is dropped.
    type Heart: Send;
    /// The threads that compute nodes.
    type Pool: Pool;

    /// Connect to `HOST:PORT`.
    fn connect(&self, address: &str) -> impl Future<Output = io::Result<Self::Stream>> + Send;

    /// Listen on an address; returns the bound address, which matters if the port was 0.
    fn listen(&self, address: SocketAddr) -> impl Future<Output = io::Result<(Self::Listener, SocketAddr)>> + Send;

    /// Wait for the next connection; returns the peer's address too. Cancel safe: no connection is lost if the future is dropped.
    fn accept(listener: &Self::Listener) -> impl Future<Output = io::Result<(Self::Stream, SocketAddr)>> + Send;

    /// Start to notify `heart` at an interval, even if all other threads are busy. Notifications that were not received are merged.
    fn start_heart(&self, interval: Duration, heart: Arc<Notify>) -> Self::Heart;

    /// Start threads that compute.
    ///
    /// # Errors
    /// If the system cannot start threads.
    fn start_pool(&self, threads: NonZeroUsize) -> Result<Self::Pool, ThreadPoolBuildError>;

    /// The global compute pool of the process.
    fn common_pool(&self) -> Self::Pool;

    /// Fill with unpredictable random bytes.
    ///
    /// # Errors
    /// If the system has no random bytes.
    fn fill_random(&self, bytes: &mut [u8]) -> io::Result<()>;

    /// The id of this process.
    fn process(&self) -> u32;

    /// The simulated time of a write to disk; `None` in the real world.
    fn disk_time(&self) -> Option<Duration>;
}

/// Threads that compute.
pub trait Pool: Send {
    /// Run a job after the earlier ones, when a thread is free. Its parallel iterators use the pool.
    fn spawn(&self, job: impl FnOnce() + Send + 'static);
}

/// The real environment.
#[derive(Clone, Copy, Debug, Default)]
pub struct Real;

impl World for Real {
    type Stream = TcpStream;
    type Listener = TcpListener;
    /// The heartbeat stops when this sender is dropped; `None` if its thread could not be started.
    type Heart = Option<mpsc::Sender<()>>;
    type Pool = Threads;

    async fn connect(&self, address: &str) -> io::Result<TcpStream> {
        let stream = TcpStream::connect(address).await?;
        stream.set_nodelay(true)?;
        Ok(stream)
    }

    async fn listen(&self, address: SocketAddr) -> io::Result<(TcpListener, SocketAddr)> {
        let listener = TcpListener::bind(address).await?;
        let bound = listener.local_addr()?;
        Ok((listener, bound))
    }

    async fn accept(listener: &TcpListener) -> io::Result<(TcpStream, SocketAddr)> {
        let (stream, peer) = listener.accept().await?;
        // If this fails, the stream has already ended, and the next read returns the error.
        let _ = stream.set_nodelay(true);
        Ok((stream, peer))
    }

    /// In a separate thread, because nodes may keep all other threads busy.
    fn start_heart(&self, interval: Duration, heart: Arc<Notify>) -> Self::Heart {
        let (keep, dropped) = mpsc::channel::<()>();
        let beat = move || {
            while dropped.recv_timeout(interval) == Err(mpsc::RecvTimeoutError::Timeout) {
                heart.notify_one();
            }
        };
        match std::thread::Builder::new().name("heartbeat".into()).spawn(beat) {
            Ok(_) => Some(keep),
            Err(error) => {
                warn!(%error, "cannot start the heartbeat: the coordinator will declare this worker lost");
                None
            }
        }
    }

    fn start_pool(&self, threads: NonZeroUsize) -> Result<Threads, ThreadPoolBuildError> {
        let name = |index| format!("compute-{index}");
        let pool = ThreadPoolBuilder::new().num_threads(threads.get()).thread_name(name).build()?;
        Ok(Threads(Some(pool)))
    }

    fn common_pool(&self) -> Threads {
        Threads(None)
    }

    fn fill_random(&self, bytes: &mut [u8]) -> io::Result<()> {
        getrandom::fill(bytes).map_err(io::Error::other)
    }

    fn process(&self) -> u32 {
        std::process::id()
    }

    fn disk_time(&self) -> Option<Duration> {
        None
    }
}

/// A rayon pool; `None` for the global one. Dropping it does not wait for running jobs, which end with the process.
#[derive(Debug)]
pub struct Threads(Option<ThreadPool>);

impl Pool for Threads {
    fn spawn(&self, job: impl FnOnce() + Send + 'static) {
        match &self.0 {
            Some(pool) => pool.spawn_fifo(job),
            None => rayon::spawn(job),
        }
    }
}
