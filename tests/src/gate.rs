//! The test's end of `gate` nodes.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::os::fd::AsFd;
use std::thread::JoinHandle;

use nix::errno::Errno;
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};

use crate::PATIENCE;

/// A listener at which `gate` nodes wait.
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
    /// A gate at which no node waits.
    ///
    /// # Panics
    /// When the system has no free port.
    #[must_use]
    pub fn new() -> Self {
        Self::at(Ipv4Addr::LOCALHOST.into())
    }

    /// A gate at another address of this machine, which workers in a namespace can reach.
    ///
    /// # Panics
    /// When the address is not this machine's.
    #[must_use]
    pub fn at(address: IpAddr) -> Self {
        Self { listener: TcpListener::bind((address, 0)).expect("a free port") }
    }

    /// The address to give to `gate` nodes as parameters.
    ///
    /// # Panics
    /// When the system does not know its own socket.
    #[must_use]
    pub fn address(&self) -> SocketAddr {
        self.listener.local_addr().expect("the address of a bound socket")
    }

    /// Whether no `gate` node waits to be returned by [`Self::next`].
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
    /// A process may be killed after it has connected and before it has sent its id. Its connection is skipped: the node is re-queued and
    /// another process executes it.
    ///
    /// # Panics
    /// When none comes in time.
    #[must_use]
    pub fn next(&self) -> Waiting {
        loop {
            let mut stream = self.accept();
            let mut process = [0; 4];
            match stream.read_exact(&mut process) {
                Ok(()) => return Waiting { stream, process: u32::from_le_bytes(process) },
                Err(error) => assert!(is_end(&error), "no process id at the gate: {error}"),
            }
        }
    }

    /// The next connection.
    fn accept(&self) -> TcpStream {
        let timeout = PollTimeout::try_from(PATIENCE).expect("less than a month");
        loop {
            let mut listener = [PollFd::new(self.listener.as_fd(), PollFlags::POLLIN)];
            match poll(&mut listener, timeout) {
                Ok(0) => panic!("no node has come to the gate in {PATIENCE:?}"),
                Ok(_) => {
                    let (stream, _) = self.listener.accept().expect("a connection");
                    stream.set_read_timeout(Some(PATIENCE)).expect("a socket of ours");
                    return stream;
                }
                Err(Errno::EINTR) => {}
                Err(error) => panic!("cannot wait at the gate: {error}"),
            }
        }
    }
}

/// Whether a read or write failed because the process at the other end has closed the connection or was killed.
#[must_use]
pub fn is_end(error: &io::Error) -> bool {
    let ends = [ErrorKind::UnexpectedEof, ErrorKind::ConnectionReset, ErrorKind::BrokenPipe];
    ends.contains(&error.kind())
}

/// A thread that decides about each node that waits at the gate.
#[derive(Debug)]
pub struct Keeper {
    address: SocketAddr,
    thread: JoinHandle<()>,
}

/// Sent to the gate by [`Keeper::stop`] in place of a process id.
const LEAVE: u32 = 0;

impl Gate {
    /// Start a thread that calls `decide` for every node that arrives.
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
    /// Stop the thread; nodes that arrive later wait.
    ///
    /// # Panics
    /// With the keeper's own panic, if it has panicked.
    pub fn stop(self) {
        // The connection fails if the thread has panicked: its panic is the one to report.
        let _ = TcpStream::connect(self.address).and_then(|mut stream| stream.write_all(&LEAVE.to_le_bytes()));
        if let Err(panic) = self.thread.join() {
            std::panic::resume_unwind(panic);
        }
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

    /// Let the node finish. If its process has ended, the node is re-queued and another process executes it.
    ///
    /// # Panics
    /// When the socket fails for another reason.
    pub fn release(mut self) {
        if let Err(error) = self.stream.write_all(&[1]) {
            assert!(is_end(&error), "cannot release a node: {error}");
        }
    }

    /// Wait until the process has ended, which closes the stream.
    ///
    /// # Panics
    /// When it does not end in time.
    pub fn wait_for_death(mut self) {
        // An end of file or a reset, depending on how it was killed.
        match self.stream.read(&mut [0]) {
            Ok(count) => assert_eq!(count, 0, "a node at the gate has nothing more to send"),
            Err(error) => assert!(is_end(&error), "the process has not ended: {error}"),
        }
    }
}
