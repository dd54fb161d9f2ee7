//! Requests to end a process: signals, and, for local workers, the leash: a pipe on stdin that closes when the coordinator ends.

use std::io::{self, Read};

use tokio_util::sync::CancellationToken;

/// Requests to end this process.
#[derive(Clone, Debug, Default)]
pub struct Wishes {
    /// Cancelled by the first SIGTERM or Ctrl-C: finish running nodes, then end.
    pub drain: CancellationToken,
    /// Cancelled by the second one, and by the end of the leash: end at once.
    pub end: CancellationToken,
}

/// Watch for requests to end: signals and, if the process is leashed, the end of stdin, which means that its coordinator has ended or
/// was killed.
pub(crate) fn watch_for_the_end(is_leashed: bool) -> io::Result<Wishes> {
    let wishes = Wishes::default();
    let Wishes { drain, end } = wishes.clone();
    let mut signals = EndSignals::listen()?;
    tokio::spawn(async move {
        signals.next().await;
        drain.cancel();
        signals.next().await;
        end.cancel();
    });
    if is_leashed {
        let end = wishes.end.clone();
        let watch = move || {
            // A byte, the end of the stream and an error all have the same meaning.
            let _ = io::stdin().lock().read(&mut [0]);
            end.cancel();
        };
        std::thread::Builder::new().name("leash".into()).spawn(watch)?;
    }
    Ok(wishes)
}

/// The signals that ask a process to end: SIGTERM, and SIGINT, which is Ctrl-C.
#[derive(Debug)]
pub struct EndSignals {
    #[cfg(unix)]
    signals: [tokio::signal::unix::Signal; 2],
}

impl EndSignals {
    /// Replace the default handling, which ends the process. Needs a tokio runtime with I/O.
    ///
    /// # Errors
    /// If the system refuses.
    pub fn listen() -> io::Result<Self> {
        #[cfg(unix)]
        {
            use tokio::signal::unix::{SignalKind, signal};
            Ok(Self { signals: [signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?] })
        }
        #[cfg(not(unix))]
        Ok(Self {})
    }

    /// Wait for the next of them.
    pub async fn next(&mut self) {
        #[cfg(unix)]
        {
            let [interrupt, terminate] = &mut self.signals;
            tokio::select! { _ = interrupt.recv() => {}, _ = terminate.recv() => {} }
        }
        #[cfg(not(unix))]
        if tokio::signal::ctrl_c().await.is_err() {
            // There is no Ctrl-C on this system, so no signal will ever arrive.
            std::future::pending::<()>().await;
        }
    }
}
