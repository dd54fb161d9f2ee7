//! The test's end of `gate` nodes.

use std::io::{ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::thread::JoinHandle;

/// Where `gate` nodes wait.
#[derive(Debug)]
pub struct Gate {
    listener: TcpListener,
}

/// A `gate` node in execution.
#[derive(Debug)]
pub struct Waiting {
    stream: TcpStream,
    process: u32,
}

impl Gate {
    /// A gate that nobody waits at.
    ///
    /// # Panics
    /// When the system has no free port.
    #[must_use]
    pub fn new() -> Self {
        Self::at(Ipv4Addr::LOCALHOST.into())
    }

    /// A gate at another address of this machine, which workers elsewhere reach.
    ///
    /// # Panics
    /// When the address is not this machine's.
    #[must_use]
    pub fn at(address: IpAddr) -> Self {
        Self { listener: TcpListener::bind((address, 0)).expect("a free port") }
    }

    /// The parameters of `gate` nodes.
    ///
    /// # Panics
    /// When the system does not know its own socket.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.listener.local_addr().expect("the address of a bound socket")
    }

    /// Whether no `gate` node is executing that was not met yet.
    ///
    /// # Panics
    /// When the system does not know its own socket.
    #[must_use]
    pub fn is_deserted(&self) -> bool {
        self.listener.set_nonblocking(true).expect("a socket of ours");
        let nobody = self.listener.accept().is_err_and(|error| error.kind() == ErrorKind::WouldBlock);
        self.listener.set_nonblocking(false).expect("a socket of ours");
        nobody
    }

    /// Wait until the next `gate` node executes.
    ///
    /// # Panics
    /// When it does not say which process it is in.
    #[must_use]
    pub fn next(&self) -> Waiting {
        let (mut stream, _) = self.listener.accept().expect("a node at the gate");
        let mut process = [0; 4];
        stream.read_exact(&mut process).expect("the process id of the node");
        Waiting { stream, process: u32::from_le_bytes(process) }
    }
}

/// Somebody who stands at the gate until told to go.
#[derive(Debug)]
pub struct Keeper {
    address: SocketAddr,
    thread: JoinHandle<()>,
}

/// What a keeper's own process says instead of a process id.
const LEAVE: u32 = 0;

impl Gate {
    /// Let somebody decide about every node that comes, in a thread of its own.
    #[must_use]
    pub fn keep(self, mut decide: impl FnMut(Waiting) + Send + 'static) -> Keeper {
        let address = self.address();
        let keep = move || {
            let arrivals = std::iter::from_fn(|| Some(self.next()).filter(|waiting| waiting.process != LEAVE));
            arrivals.for_each(&mut decide);
        };
        Keeper { address, thread: std::thread::spawn(keep) }
    }
}

impl Keeper {
    /// Let nobody pass any more.
    ///
    /// # Panics
    /// When the keeper has panicked.
    pub fn stop(self) {
        let mut stream = TcpStream::connect(self.address).expect("a keeper");
        stream.write_all(&LEAVE.to_le_bytes()).expect("a keeper");
        self.thread.join().expect("a keeper that does not panic");
    }
}

impl Default for Gate {
    fn default() -> Self {
        Self::new()
    }
}

impl Waiting {
    /// The process that executes the node.
    #[must_use]
    pub fn process(&self) -> u32 {
        self.process
    }

    /// Let the node finish.
    ///
    /// # Panics
    /// When its process is gone.
    pub fn release(mut self) {
        self.stream.write_all(&[1]).expect("a node that waits");
    }

    /// Wait until the process is gone: only its end closes the stream.
    pub fn wait_for_death(mut self) {
        // An end or a reset, depending on how it died.
        let _ = self.stream.read(&mut [0]);
    }
}
