//! How a process learns that it shall end: signals, and the leash on which a coordinator keeps its local workers.

use std::io;

use tokio_util::sync::CancellationToken;

/// The wishes that this process shall end.
#[derive(Clone, Debug, Default)]
pub(crate) struct Wishes {
    /// Cancelled by the first SIGTERM or Ctrl-C: finish what is begun, then end.
    pub(crate) drain: CancellationToken,
    /// Cancelled by the second, and with a leash by the end of stdin: end at once.
    pub(crate) end: CancellationToken,
}

/// From now on, what asks this process to end is a wish.
pub(crate) fn watch_for_the_end(leash: bool) -> io::Result<Wishes> {
    let wishes = Wishes::default();
    let Wishes { drain, end } = wishes.clone();
    let mut signals = EndSignals::listen()?;
    tokio::spawn(async move {
        signals.next().await;
        drain.cancel();
        signals.next().await;
        end.cancel();
    });
    if leash {
        let end = wishes.end.clone();
        let watch = move || {
            // Nothing is ever written to this pipe; whatever ends it, even SIGKILL, the coordinator is gone.
            let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
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
    /// From now on the signals do not end the process by themselves any more. Needs a tokio runtime with I/O.
    ///
    /// # Errors
    /// When the system does not let us.
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
            // There is no Ctrl-C here, so nobody can ask.
            std::future::pending::<()>().await;
        }
    }
}
