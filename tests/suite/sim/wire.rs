//! Connections that can be reset. turmoil does not resend what a partition has dropped, so existing streams must end, as TCP ends a
//! stream without an answer. Each end notices at its own time.

use std::io;
use std::pin::Pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::task::{Context, Poll, Waker};

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use turmoil::net::TcpStream;

/// One end of a connection.
#[derive(Debug)]
pub(super) struct Wire {
    stream: TcpStream,
    control: Arc<WireControl>,
}

/// What the simulation can do to an end of a connection.
#[derive(Debug, Default)]
pub(super) struct WireControl(Mutex<State>);

#[derive(Debug, Default)]
struct State {
    is_reset: bool,
    /// The process is about to be killed: writing waits.
    is_mute: bool,
    /// The wakers of reading and of writing.
    wakers: [Option<Waker>; 2],
}

impl Wire {
    pub(super) fn new(stream: TcpStream) -> Self {
        Self { stream, control: Arc::default() }
    }

    pub(super) fn control(&self) -> Weak<WireControl> {
        Arc::downgrade(&self.control)
    }
}

impl WireControl {
    /// From now on reading and writing fail.
    pub(super) fn reset(&self) {
        let mut state = self.state();
        state.is_reset = true;
        let wakers = std::mem::take(&mut state.wakers);
        drop(state);
        wakers.into_iter().flatten().for_each(Waker::wake);
    }

    /// From now on writing waits.
    pub(super) fn mute(&self) {
        self.state().is_mute = true;
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// An error if the end was reset; `None`, after storing the waker, if it has to wait.
    fn check(&self, way: usize, context: &Context<'_>) -> io::Result<Option<()>> {
        let mut state = self.state();
        if state.is_reset {
            return Err(io::ErrorKind::ConnectionReset.into());
        }
        state.wakers[way] = Some(context.waker().clone());
        Ok((way == READING || !state.is_mute).then_some(()))
    }
}

const READING: usize = 0;
const WRITING: usize = 1;

impl AsyncRead for Wire {
    fn poll_read(mut self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.control.check(READING, context)?;
        Pin::new(&mut self.stream).poll_read(context, bytes)
    }
}

impl AsyncWrite for Wire {
    fn poll_write(mut self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        match self.control.check(WRITING, context)? {
            Some(()) => Pin::new(&mut self.stream).poll_write(context, bytes),
            None => Poll::Pending,
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self.control.check(WRITING, context)? {
            Some(()) => Pin::new(&mut self.stream).poll_flush(context),
            None => Poll::Pending,
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        match self.control.check(WRITING, context)? {
            Some(()) => Pin::new(&mut self.stream).poll_shutdown(context),
            None => Poll::Pending,
        }
    }
}
