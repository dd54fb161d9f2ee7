//! How a process learns that it shall end: signals, and the leash on which a coordinator keeps its local workers.

use std::io::{self, Read};

use tokio_util::sync::CancellationToken;
use tracing::info;

/// The wishes that this process shall end.
#[derive(Clone, Debug, Default)]
pub struct Wishes {
    /// Cancelled by the first SIGTERM or Ctrl-C: finish what is begun, then end.
    pub drain: CancellationToken,
    /// Cancelled by the second, and as the leash says: end at once.
    pub end: CancellationToken,
}

/// What the end of stdin means to a worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leash {
    /// Nothing.
    None,
    /// The coordinator is gone, in order or not: end.
    Tight,
    /// If a byte came before it, the run is over: end. Without one the coordinator was killed, and another one may come.
    Loose,
}

/// From now on, what asks this process to end is a wish.
pub(crate) fn watch_for_the_end(leash: Leash) -> io::Result<Wishes> {
    let wishes = Wishes::default();
    let Wishes { drain, end } = wishes.clone();
    let mut signals = EndSignals::listen()?;
    tokio::spawn(async move {
        signals.next().await;
        drain.cancel();
        signals.next().await;
        end.cancel();
    });
    if leash != Leash::None {
        let end = wishes.end.clone();
        let watch = move || {
            if is_the_end(leash, io::stdin().lock()) {
                end.cancel();
            } else {
                info!("the coordinator was killed; waiting for another one");
            }
        };
        std::thread::Builder::new().name("leash".into()).spawn(watch)?;
    }
    Ok(wishes)
}

/// Wait for the coordinator's end of the leash. Whether this process shall end.
fn is_the_end(leash: Leash, mut stdin: impl Read) -> bool {
    let is_over = matches!(stdin.read(&mut [0]), Ok(1..));
    is_over || leash == Leash::Tight
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loose_leash_survives_only_a_coordinator_that_was_killed() {
        for (leash, killed) in [(Leash::Tight, true), (Leash::Loose, false)] {
            assert!(is_the_end(leash, &b"."[..]), "{leash:?}");
            assert_eq!(is_the_end(leash, &b""[..]), killed, "{leash:?}");
        }
    }
}
