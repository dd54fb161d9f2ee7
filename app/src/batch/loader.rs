//! A thread that reads the inputs of the fits in order, a little ahead of their turn.

use super::{check::Checked, lights::Lights, prepare::Prepared};
use crate::settings::{BatchFit, StageTwo};
use anyhow::{Context, bail};
use std::{
    sync::{
        Arc,
        mpsc::{Receiver, RecvError, SyncSender, TryRecvError, sync_channel},
    },
    thread,
};
use tokio::sync::Notify;

/// How many loaded fits wait in memory, beside the one that is being read.
const AHEAD: usize = 1;

/// A loaded fit: its number, and its inputs or the error.
pub(super) type Loaded = (u32, anyhow::Result<Box<Prepared>>);

/// The receiving end. The thread ends when this is dropped or all fits are read.
#[derive(Debug)]
pub(super) struct Loader {
    loaded: Receiver<Loaded>,
}

/// The data of the thread.
#[derive(Debug)]
pub(super) struct Shelf {
    pub(super) fits: Arc<[BatchFit]>,
    /// The numbers of the fits to read, in order.
    pub(super) open: Arc<[u32]>,
    pub(super) checks: Arc<[Checked]>,
    pub(super) lights: Arc<Lights>,
    pub(super) stage_two: StageTwo,
    /// Notified whenever a fit is loaded.
    pub(super) wake: Arc<Notify>,
}

impl Loader {
    /// Starts the thread.
    pub(super) fn start(shelf: Shelf) -> anyhow::Result<Self> {
        let (sender, loaded) = sync_channel(AHEAD);
        let read = move || read_all(&shelf, &sender);
        thread::Builder::new().name("loader".into()).spawn(read).context("cannot start a thread")?;
        Ok(Self { loaded })
    }

    /// Waits for the next fit; `None` after the last one.
    pub(super) fn wait(&self) -> Option<Loaded> {
        self.loaded.recv().map_err(|RecvError| ()).ok()
    }

    /// The next fit, if it is loaded. `Err(true)` after the last one.
    pub(super) fn look(&self) -> Result<Loaded, bool> {
        self.loaded.try_recv().map_err(|error| error == TryRecvError::Disconnected)
    }
}

fn read_all(shelf: &Shelf, sender: &SyncSender<Loaded>) {
    for &number in shelf.open.iter() {
        let (fit, checked) = (&shelf.fits[number as usize], &shelf.checks[number as usize]);
        let prepared = Prepared::new(fit, &shelf.lights, shelf.stage_two);
        let unchanged = prepared.and_then(|prepared| {
            same(&checked.inputs, &prepared.inputs)?;
            same_settings(&checked.identity, &prepared.identity()?)?;
            Ok(Box::new(prepared))
        });
        if sender.send((number, unchanged)).is_err() {
            // The receiver was dropped.
            return;
        }
        shelf.wake.notify_one();
    }
}

/// Refuses inputs that changed while the batch ran: it would be unclear to which version the results belong.
fn same(before: &serde_json::Value, now: &serde_json::Value) -> anyhow::Result<()> {
    let roles = now.as_object().into_iter().flatten();
    for (role, file) in roles {
        if before[role]["blake3"] != file["blake3"] {
            let path = file["path"].as_str().unwrap_or_default();
            bail!("the {role} {path} was changed since the batch began; run this fit again");
        }
    }
    Ok(())
}

/// Refuses settings that changed while the batch ran, such as an exposure that is read from another file.
fn same_settings(before: &[(&str, String)], now: &[(&str, String)]) -> anyhow::Result<()> {
    match before.iter().zip(now).find(|(before, now)| before != now) {
        None => Ok(()),
        Some(((name, before), (_, now))) => {
            bail!("{name} was {before} when the batch began and is {now} now: a file was changed; run this fit again")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn inputs_that_were_changed_are_named() {
        let before =
            json!({ "photo": { "path": "a.exr", "blake3": "1" }, "environment": { "path": "m.hdr", "blake3": "2" } });
        assert!(same(&before, &before).is_ok());
        let mut now = before.clone();
        now["environment"]["blake3"] = json!("3");
        let message = same(&before, &now).unwrap_err().to_string();
        assert!(message.starts_with("the environment m.hdr was changed since the batch began"), "{message}");
    }

    #[test]
    fn settings_that_files_have_changed_are_named_with_both_values() {
        let of = |exposure: &str| [("--seed", "0".to_owned()), ("--display-exposure", exposure.to_owned())];
        assert!(same_settings(&of("1.5"), &of("1.5")).is_ok());
        let message = same_settings(&of("1.5"), &of("3")).unwrap_err().to_string();
        assert!(message.starts_with("--display-exposure was 1.5 when the batch began and is 3 now"), "{message}");
    }
}
