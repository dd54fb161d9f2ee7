//! Queues for messages to one worker, bounded in size even if the worker reads nothing.

use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::{Context, Poll, ready};
use std::time::Duration;

use lookalike::protocol::ToWorker;
use tokio::io::AsyncWrite;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::time::{Instant, Sleep, sleep};
use tokio_util::sync::CancellationToken;

use super::outgoing::Outgoing;

/// The size of a queued message without the data that it points to.
const MESSAGE_BYTES: usize = 128;

/// How many messages are written at a time.
const WRITTEN_TOGETHER: usize = 256;

/// The sending end of the queue. After it is dropped, the remaining messages are written, and the connection ends in order.
#[derive(Debug)]
pub(crate) struct Mailbox {
    queue: UnboundedSender<Outgoing>,
    state: Arc<State>,
}

/// The receiving end of the queue.
#[derive(Debug)]
pub(super) struct Postman {
    queue: UnboundedReceiver<Outgoing>,
    /// The size of the messages that were taken last and may not be written yet.
    taken_bytes: usize,
    state: Arc<State>,
}

#[derive(Debug)]
struct State {
    waiting_bytes: AtomicUsize,
    bound_bytes: usize,
    overflowing: CancellationToken,
    closed: CancellationToken,
}

/// Create a queue of at most this many bytes. Blobs count as references, because all queues share their bytes.
pub(super) fn mailbox(bound_bytes: usize) -> (Mailbox, Postman) {
    let (sender, receiver) = unbounded_channel();
    let (overflowing, closed) = (CancellationToken::new(), CancellationToken::new());
    let state = Arc::new(State { waiting_bytes: AtomicUsize::new(0), bound_bytes, overflowing, closed });
    (Mailbox { queue: sender, state: Arc::clone(&state) }, Postman { queue: receiver, taken_bytes: 0, state })
}

impl Mailbox {
    /// Queue a message. If it does not fit, the worker is too slow, and its connection ends.
    pub(crate) fn send(&self, outgoing: Outgoing) {
        let bytes = weight(&outgoing);
        if self.state.waiting_bytes.fetch_add(bytes, Ordering::Relaxed) + bytes > self.state.bound_bytes {
            self.state.overflowing.cancel();
            return;
        }
        // If the connection has ended, the message is dropped.
        let _ = self.queue.send(outgoing);
    }

    /// End the connection at once, without writing what is queued.
    pub(crate) fn close(&self) {
        self.state.closed.cancel();
    }
}

impl Postman {
    /// Take the next messages; `false` once the mailbox is dropped and empty. A call means that the messages of the previous one
    /// are written; until then they count.
    pub(super) async fn take(&mut self, together: &mut Vec<Outgoing>) -> bool {
        self.state.waiting_bytes.fetch_sub(std::mem::take(&mut self.taken_bytes), Ordering::Relaxed);
        let count = self.queue.recv_many(together, WRITTEN_TOGETHER).await;
        self.taken_bytes = together.iter().map(weight).sum();
        count > 0
    }

    /// Wait until a message did not fit.
    pub(super) fn overflowing(&self) -> impl Future<Output = ()> + use<> {
        self.state.overflowing.clone().cancelled_owned()
    }

    /// Wait until [`Mailbox::close`] is called.
    pub(super) fn closed(&self) -> impl Future<Output = ()> + use<> {
        self.state.closed.clone().cancelled_owned()
    }
}

fn weight(outgoing: &Outgoing) -> usize {
    MESSAGE_BYTES
        + match outgoing {
            Outgoing::Message(ToWorker::Assign(node)) => {
                node.parameters.len() + node.kind.len() + node.label.len() + node.inputs.len() * size_of::<[u8; 32]>()
            }
            Outgoing::Message(ToWorker::Stop { reason }) => reason.len(),
            Outgoing::Message(_) | Outgoing::Blob(_) | Outgoing::NoBlob => 0,
        }
}

/// A stream that fails with [`io::ErrorKind::TimedOut`] if the other side accepts no bytes for too long. Any accepted byte shows
/// that it is reading; a heartbeat only shows that it is writing.
#[derive(Debug)]
pub(super) struct Patient<W> {
    stream: W,
    patience: Duration,
    /// Runs while the other side accepts nothing.
    running_out: Option<Pin<Box<Sleep>>>,
}

impl<W> Patient<W> {
    pub(super) fn new(stream: W, patience: Duration) -> Self {
        Self { stream, patience, running_out: None }
    }

    fn wait<T>(&mut self, context: &mut Context<'_>, outcome: Poll<io::Result<T>>) -> Poll<io::Result<T>> {
        if outcome.is_ready() {
            self.running_out = None;
            return outcome;
        }
        let patience = self.patience;
        let running_out = self.running_out.get_or_insert_with(|| Box::pin(sleep(patience)));
        ready!(running_out.as_mut().poll(context));
        // Another poll after this error starts a new wait.
        running_out.as_mut().reset(Instant::now() + patience);
        Poll::Ready(Err(io::Error::new(io::ErrorKind::TimedOut, "the worker does not read")))
    }
}

impl<W: AsyncWrite + Unpin> AsyncWrite for Patient<W> {
    fn poll_write(self: Pin<&mut Self>, context: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let this = self.get_mut();
        let outcome = Pin::new(&mut this.stream).poll_write(context, bytes);
        this.wait(context, outcome)
    }

    fn poll_flush(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        let outcome = Pin::new(&mut this.stream).poll_flush(context);
        this.wait(context, outcome)
    }

    fn poll_shutdown(self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let this = self.get_mut();
        let outcome = Pin::new(&mut this.stream).poll_shutdown(context);
        this.wait(context, outcome)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::graph::Blob;
    use tokio::io::{AsyncReadExt, AsyncWriteExt, duplex};

    #[test]
    fn unread_mailbox_overflows_and_blobs_do_not_count() {
        let (mailbox, postman) = mailbox(10_000);
        let blob = Blob::new(vec![0; 1 << 20]);
        (0..50).for_each(|_| mailbox.send(Outgoing::Blob(blob.clone())));
        assert!(!postman.state.overflowing.is_cancelled());
        (0..50).for_each(|_| mailbox.send(Outgoing::Message(ToWorker::Stop { reason: "x".repeat(100) })));
        assert!(postman.state.overflowing.is_cancelled());
        assert!(postman.queue.len() < 100);
    }

    #[tokio::test(start_paused = true)]
    async fn stream_times_out_only_when_nothing_is_read_at_all() {
        let (near, mut far) = duplex(10);
        let mut near = Patient::new(near, Duration::from_secs(5));
        let writing = tokio::spawn(async move { near.write_all(&[7; 100]).await });
        let began = Instant::now();
        for _ in 0..5 {
            sleep(Duration::from_secs(4)).await;
            far.read_exact(&mut [0; 10]).await.unwrap();
        }
        let error = writing.await.unwrap().unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::TimedOut);
        assert_eq!(began.elapsed(), Duration::from_secs(25));
    }
}
