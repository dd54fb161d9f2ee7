//! What a coordinator or a worker needs of the world around it, and cannot compute: a network, a heart, threads, chance.
//!
//! The program lives in one world, [`Real`]; tests put it into one where all of this, and time, is simulated. Time is not part of
//! it: whatever waits does so with `tokio::time`, whose clock the runtime has.

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

/// The world as one process sees it.
pub trait World: Clone + Send + Sync + 'static {
    /// A connection, as TCP makes them.
    type Stream: AsyncRead + AsyncWrite + Unpin + Send + 'static;
    /// Where connections come in.
    type Listener: Send + 'static;
    /// Beats until it is dropped.
    type Heart: Send;
    /// Where nodes are computed.
    type Pool: Pool;

    /// Connect to `HOST:PORT`.
    fn connect(&self, address: &str) -> impl Future<Output = io::Result<Self::Stream>> + Send;

    /// Listen on an address; the one that was got, if any port was asked for.
    fn listen(&self, address: SocketAddr) -> impl Future<Output = io::Result<(Self::Listener, SocketAddr)>> + Send;

    /// Wait for the next connection, and say where it comes from. Nothing is lost when the future is dropped.
    fn accept(listener: &Self::Listener) -> impl Future<Output = io::Result<(Self::Stream, SocketAddr)>> + Send;

    /// Beat from now on, however busy everything else is. Beats that nobody has taken yet are one.
    fn start_heart(&self, interval: Duration, heart: Arc<Notify>) -> Self::Heart;

    /// Start threads that compute.
    ///
    /// # Errors
    /// When the system gives none.
    fn start_pool(&self, threads: NonZeroUsize) -> Result<Self::Pool, ThreadPoolBuildError>;

    /// The threads that every process has to compute on.
    fn common_pool(&self) -> Self::Pool;

    /// Fill with bytes that nobody can foresee.
    ///
    /// # Errors
    /// When the system gives none.
    fn fill_random(&self, bytes: &mut [u8]) -> io::Result<()>;

    /// The number of this process.
    fn process(&self) -> u32;

    /// How long it takes until something is on the disk, in a world that decides it; `None`: as long as it takes.
    fn disk_time(&self) -> Option<Duration>;
}

/// Threads that compute.
pub trait Pool: Send {
    /// Run a job after those before, when a thread is free. Its parallel iterators use the pool.
    fn spawn(&self, job: impl FnOnce() + Send + 'static);
}

/// The world as it is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Real;

impl World for Real {
    type Stream = TcpStream;
    type Listener = TcpListener;
    /// Beats as long as the other end is there; `None` if no thread could be started.
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
        // A stream for which this fails has ended already: whoever reads it will notice.
        let _ = stream.set_nodelay(true);
        Ok((stream, peer))
    }

    /// In a thread of its own: nodes may keep every other thread busy.
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
                warn!(%error, "cannot start the heartbeat: the coordinator will take this worker for lost");
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

/// A rayon pool; without one of its own, that of the process. Dropped, it does not wait for running jobs: they end with the process.
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
