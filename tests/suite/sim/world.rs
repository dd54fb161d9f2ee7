//! The world of a simulated process: turmoil's network, heartbeat and threads as tasks, random numbers from a seed.

use std::cell::RefCell;
use std::future::Future;
use std::io;
use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::sync::{Arc, Mutex};
use std::time::Duration;

use lookalike_worker::world::{Pool, World};
use rayon::ThreadPoolBuildError;
use tokio::sync::Notify;
use tokio::task::JoinHandle;
use tokio::time::sleep;
use turmoil::net::{TcpListener, TcpStream};

use super::chance::Chance;
use super::stage::{Place, Stage};
use super::wire::Wire;

thread_local! {
    /// The world of the process whose node executes at the moment.
    static RUNNING: RefCell<Option<SimWorld>> = const { RefCell::new(None) };
}

/// Mark the process that executes the calling node as about to be killed.
pub(super) fn kill_this_host() {
    RUNNING.with_borrow(|world| world.iter().for_each(|world| world.0.stage.mark_dying(world.0.place)));
}

/// The world of one process.
#[derive(Clone, Debug)]
pub(super) struct SimWorld(Arc<Process>);

#[derive(Debug)]
struct Process {
    stage: Arc<Stage>,
    place: Place,
    number: u32,
    chance: Mutex<Chance>,
    /// The shortest and the longest time that most nodes take, in milliseconds.
    node_ms: (u64, u64),
    disk_time: Duration,
}

impl SimWorld {
    /// The world of a process in this place. Process ids are unique in a run.
    pub(super) fn new(stage: Arc<Stage>, place: Place, number: u32) -> Self {
        let mut chance = Chance::new(stage.seed, u64::from(number) + (1 << 32));
        let node_ms = stage.node_ms;
        let disk_time = if chance.happens(0.1) { chance.time(500, 2000) } else { chance.time(0, 30) };
        Self(Arc::new(Process { stage, place, number, chance: Mutex::new(chance), node_ms, disk_time }))
    }

    /// How long a node takes. A few take much longer than most.
    fn node_time(&self) -> Duration {
        let mut chance = self.0.chance.lock().expect("a chance");
        let (least, most) = self.0.node_ms;
        let factor = if chance.happens(0.03) { 10 } else { 1 };
        chance.time(least, most) * factor * self.0.stage.slowness(self.0.place)
    }
}

impl World for SimWorld {
    type Stream = Wire;
    type Listener = Port;
    type Heart = Task;
    type Pool = Threads;

    async fn connect(&self, address: &str) -> io::Result<Wire> {
        let stream = Wire::new(TcpStream::connect(address).await?);
        self.0.stage.laid(self.0.place, self.0.place, stream.control());
        Ok(stream)
    }

    async fn listen(&self, address: SocketAddr) -> io::Result<(Port, SocketAddr)> {
        let listener = TcpListener::bind(address).await?;
        let bound = listener.local_addr()?;
        Ok((Port { listener, stage: Arc::clone(&self.0.stage) }, bound))
    }

    async fn accept(port: &Port) -> io::Result<(Wire, SocketAddr)> {
        let (stream, peer) = port.listener.accept().await?;
        let stream = Wire::new(stream);
        port.stage.laid(Place::of(peer), Place::Coordinator, stream.control());
        Ok((stream, peer))
    }

    fn start_heart(&self, interval: Duration, heart: Arc<Notify>) -> Task {
        let world = self.clone();
        Task::spawn(async move {
            loop {
                sleep(interval).await;
                if !world.0.stage.is_stuck(world.0.place) {
                    heart.notify_one();
                }
            }
        })
    }

    fn start_pool(&self, threads: NonZeroUsize) -> Result<Threads, ThreadPoolBuildError> {
        Ok(Threads { world: self.clone(), threads: threads.get(), running: Arc::default() })
    }

    fn common_pool(&self) -> Threads {
        Threads { world: self.clone(), threads: usize::MAX, running: Arc::default() }
    }

    fn fill_random(&self, bytes: &mut [u8]) -> io::Result<()> {
        let mut chance = self.0.chance.lock().expect("a chance");
        bytes.iter_mut().for_each(|byte| *byte = chance.word().to_le_bytes()[0]);
        Ok(())
    }

    fn process(&self) -> u32 {
        self.0.number
    }

    fn disk_time(&self) -> Option<Duration> {
        Some(self.0.disk_time)
    }
}

/// Where the coordinator listens.
pub(super) struct Port {
    listener: TcpListener,
    stage: Arc<Stage>,
}

/// Jobs as tasks: each waits for its simulated duration and is then run at once.
#[derive(Debug)]
pub(super) struct Threads {
    world: SimWorld,
    threads: usize,
    running: Arc<Mutex<usize>>,
}

impl Pool for Threads {
    fn spawn(&self, job: impl FnOnce() + Send + 'static) {
        let (world, running) = (self.world.clone(), Arc::clone(&self.running));
        *running.lock().expect("a number") += 1;
        if *running.lock().expect("a number") > self.threads {
            world.0.stage.wrong(format!("{:?} computes more nodes at a time than it has threads", world.0.place));
        }
        tokio::spawn(async move {
            sleep(world.node_time()).await;
            while world.0.stage.is_stuck(world.0.place) {
                sleep(Duration::from_millis(100)).await;
            }
            RUNNING.replace(Some(world));
            job();
            RUNNING.replace(None);
            *running.lock().expect("a number") -= 1;
        });
    }
}

/// A task that ends when this is dropped.
#[derive(Debug)]
pub(super) struct Task(JoinHandle<()>);

impl Task {
    fn spawn(task: impl Future<Output = ()> + Send + 'static) -> Self {
        Self(tokio::spawn(task))
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        self.0.abort();
    }
}
