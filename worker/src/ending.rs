//! How a process learns that it shall end: signals, and the leash on which a coordinator keeps its local workers.

use std::io;

use tokio_util::sync::CancellationToken;

/// A token that is cancelled when this process shall end: by SIGTERM or Ctrl-C, and with a leash by the end of stdin.
pub(crate) fn watch_for_the_end(leash: bool) -> io::Result<CancellationToken> {
    let token = CancellationToken::new();
    let on_signal = token.clone();
    let mut signals = EndSignals::listen()?;
    tokio::spawn(async move {
        signals.next().await;
        on_signal.cancel();
    });
    if leash {
        let on_end = token.clone();
        let watch = move || {
            // Nothing is ever written to this pipe; whatever ends it, even SIGKILL, the coordinator is gone.
            let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
            on_end.cancel();
        };
        std::thread::Builder::new().name("leash".into()).spawn(watch)?;
    }
    Ok(token)
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
