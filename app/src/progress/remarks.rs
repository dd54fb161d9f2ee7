//! Lines about unexpected events of a run.

use super::Shape;
use crate::outputs::counted;
use lookalike_coordinator::events::RunEvent;
use std::path::PathBuf;

/// What remarks need to know of the run.
pub(super) struct Remarks {
    pub(super) shape: Shape,
    /// The access file for its workers.
    pub(super) access: PathBuf,
}

impl Remarks {
    /// A line about an unexpected event; `None` for all other events.
    pub(super) fn line(&self, event: &RunEvent) -> Option<String> {
        let access = self.access.display();
        match event {
            RunEvent::Resumed { results, .. } => {
                Some(format!("resuming the run: its journal holds {}", counted(*results, "result")))
            }
            RunEvent::Listening { address, local_workers: 0 } => Some(format!(
                "listening for workers, which connect to {address}; start one with `lookalike worker --access {access}`"
            )),
            RunEvent::WaitingForWorkers { waited, limit } => Some(format!(
                "waiting for workers: {} s of at most {} s; start one with `lookalike worker --access {access}`",
                waited.as_secs(),
                limit.as_secs()
            )),
            RunEvent::LocalWorkerEnded { process, status, restart_after } => {
                let next = restart_after.map_or("it is not restarted", |_| "starting another one");
                Some(format!("warning: local worker {process} ended ({status}); {next}"))
            }
            RunEvent::WorkerDraining { worker } => {
                Some(format!("{worker} was asked to end: it finishes its nodes and gets no more"))
            }
            RunEvent::NodeSuspected { name, deaths } => Some(format!(
                "warning: {} died while computing {}: it runs alone from now on",
                counted(*deaths, "worker"),
                name.label
            )),
            RunEvent::AnswersDiffer { name, first, second, error } => Some(format!(
                "warning: {} has an output and an error ({error}), one from {first} and one from {second}: one of these machines computes \
             wrongly",
                name.label
            )),
            RunEvent::NodeSpeculated { name, worker } => {
                Some(format!("{} is slow: {worker} computes it too, and the first result counts", name.label))
            }
            RunEvent::NodeRequeued { name, .. } => Some(format!("retrying {} on another worker", name.label)),
            RunEvent::NodeFailed { reason, .. } if reason.is_cancellation() => None,
            // Reported as a failed part.
            RunEvent::NodeFailed { .. } if self.shape != Shape::OneFit => None,
            RunEvent::NodeFailed { name, reason } => Some(format!("error: {} failed: {reason}", name.label)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn journal_with_one_result_is_not_plural() {
        let remarks = Remarks { shape: Shape::OneFit, access: PathBuf::new() };
        let line = remarks.line(&RunEvent::Resumed { epoch: 2, results: 1 }).unwrap();
        assert_eq!(line, "resuming the run: its journal holds 1 result");
    }

    #[test]
    fn advice_names_the_access_file_of_the_run() {
        let remarks = Remarks { shape: Shape::OneFit, access: "keys/cluster.json".into() };
        let (waited, limit) = (Duration::from_secs(10), Duration::from_secs(60));
        for event in [
            RunEvent::Listening { address: "a:4100".to_owned(), local_workers: 0 },
            RunEvent::WaitingForWorkers { waited, limit },
        ] {
            let line = remarks.line(&event).unwrap();
            assert!(line.ends_with("start one with `lookalike worker --access keys/cluster.json`"), "{line}");
        }
    }
}
