//! The test's end of `gate` nodes.

use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};

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
        Self { listener: TcpListener::bind("127.0.0.1:0").expect("a free port") }
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
