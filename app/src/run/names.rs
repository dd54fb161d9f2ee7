//! The names of fits and scores in what the engine shows of a run: `status --json`, the journal and the metrics. Programs read them
//! (docs/journal.md, docs/batch.md).

use lookalike_coordinator::{journal::Names, metrics::PartsMetric};

/// The names in the status of a run and in its journal.
pub(crate) const NAMES: Names = Names { parts: "fits", score: "cssim", best_score: "best_cssim" };

/// The metric that counts fits.
pub(crate) const FITS: PartsMetric = PartsMetric { name: "lookalike_fits", help: "Fits of the batch by state." };

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike_coordinator::journal::status::Status;

    /// A status in which fits and scores have the names that programs read, in the order of the documents.
    const STATUS: &str = r#"{
  "schema": "lookalike.status/1",
  "state": "running",
  "error": null,
  "run": "5f0c",
  "epoch": 2,
  "process": 4711,
  "host": "node7",
  "started_at": "2026-11-22T09:20:11.123Z",
  "updated_at": "2026-11-22T09:21:11.456Z",
  "finished_at": null,
  "elapsed_s": 58.2,
  "nodes": {
    "total": 1,
    "waiting": 0,
    "ready": 0,
    "running": 0,
    "completed": 1,
    "recalled": 0,
    "failed": 0
  },
  "kinds": [],
  "workers": [],
  "attempts": 49,
  "requeued": 1,
  "best_cssim": 0.0372,
  "failures": [],
  "fits": [
    {
      "name": "gold-garden-ggx",
      "state": "done",
      "cssim": 0.0372,
      "seconds": 8.1,
      "error": null
    }
  ]
}
"#;

    #[test]
    fn status_names_fits_and_their_scores_as_programs_read_them() {
        let status = Status::from_json(STATUS.as_bytes(), NAMES).unwrap();
        assert_eq!((status.best_score, status.parts.len(), status.parts[0].score), (Some(0.0372), 1, Some(0.0372)));
        assert_eq!(status.to_json(NAMES).unwrap(), STATUS);
    }
}
