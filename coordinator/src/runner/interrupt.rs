//! Ctrl-C and SIGTERM. During a run, the first signal stops the run in order. A second signal, or one outside a run, ends the
//! process at once, which is the default behaviour. (It must be implemented here, because a process cannot stop handling a signal
//! once it has started to.)

use std::io;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError, mpsc};

use lookalike_worker::ending::EndSignals;
use tokio_util::sync::CancellationToken;

/// The exit code of an interrupted process.
const INTERRUPTED: i32 = 130;

/// The runs to stop at the next signal.
static RUNS: Mutex<Vec<CancellationToken>> = Mutex::new(Vec::new());

/// Whether signals are being handled, or why not.
static LISTENING: OnceLock<Result<(), String>> = OnceLock::new();

/// The registration of a run for signals. Dropping it ends the registration.
#[derive(Debug)]
pub(crate) struct Interrupt {
    token: CancellationToken,
}

impl Interrupt {
    /// Register: the next signal cancels [`token`](Self::token).
    pub(crate) fn watch() -> io::Result<Self> {
        LISTENING.get_or_init(|| listen().map_err(|error| error.to_string())).clone().map_err(io::Error::other)?;
        let token = CancellationToken::new();
        runs().push(token.clone());
        Ok(Self { token })
    }

    /// The token that a signal cancels.
    pub(crate) fn token(&self) -> CancellationToken {
        self.token.clone()
    }
}

impl Drop for Interrupt {
    fn drop(&mut self) {
        self.token.cancel();
        runs().retain(|token| !token.is_cancelled());
    }
}

fn runs() -> MutexGuard<'static, Vec<CancellationToken>> {
    RUNS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Handle signals in a thread with its own runtime, which outlives the runtime of any run.
fn listen() -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let (told, listening) = mpsc::channel();
    let watch = move || {
        runtime.block_on(async {
            let mut signals = match EndSignals::listen() {
                Ok(signals) => signals,
                Err(error) => return told.send(Err(error)).unwrap_or(()),
            };
            // The receiver waits for this message, so sending cannot fail.
            let _ = told.send(Ok(()));
            loop {
                signals.next().await;
                let stopped: Vec<_> = runs().drain(..).collect();
                if stopped.is_empty() {
                    std::process::exit(INTERRUPTED);
                }
                stopped.iter().for_each(CancellationToken::cancel);
            }
        });
    };
    std::thread::Builder::new().name("signals".into()).spawn(watch)?;
    listening.recv().map_err(io::Error::other)?
}
