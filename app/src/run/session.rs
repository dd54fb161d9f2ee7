//! A run on the job graph in a folder of results: what a fit, a batch and a study have in common.

use super::{failure::journal_failed, names::NAMES, resume::missing};
use crate::{
    exit::Exit,
    outputs::{ACCESS_FILE, OutFolder},
    settings::ClusterSettings,
};
use anyhow::Context;
use lookalike::{graph::Planner, nodes};
use lookalike_coordinator::{
    events::RunEvent,
    journal::{self, Finished, JOURNAL_FILE, JournalOptions, PartLedger, RunIdentity, Score},
    metrics::Metrics,
    runner::{self, RunnerOptions},
    state::RunSummary,
};
use std::{path::PathBuf, sync::Arc};

/// The access file for the workers of a run: the given one, or the one that the run creates in its folder.
pub(crate) fn access_file(cluster: &ClusterSettings, out: &OutFolder) -> PathBuf {
    cluster.access.clone().unwrap_or_else(|| out.file(ACCESS_FILE))
}

/// A run in a folder of results, whose lock is held.
pub(crate) struct Session<'a> {
    pub(crate) cluster: &'a ClusterSettings,
    pub(crate) out: &'a OutFolder,
    /// The folder as the user wrote it.
    pub(crate) out_name: &'a str,
    /// The inputs and settings that may not change when the run is resumed.
    pub(crate) identity: RunIdentity,
    /// Resume the run in the folder, if there is one.
    pub(crate) resume: bool,
    /// Decides which outputs are verified.
    pub(crate) seed: u64,
    pub(crate) metrics: Option<&'a Metrics>,
    /// The best score so far, for the status of the run.
    pub(crate) score: Option<Score>,
    /// The parts of a run of many.
    pub(crate) parts: PartLedger,
}

impl Session<'_> {
    fn journal(&self) -> PathBuf {
        self.out.file(JOURNAL_FILE)
    }

    /// The outputs of an earlier run in the folder, if it is finished.
    ///
    /// # Errors
    /// If that run has other inputs or settings.
    pub(crate) fn finished(&self) -> anyhow::Result<Option<Finished>> {
        let path = self.journal();
        if path.exists() { journal::finished(&path, &self.identity).map_err(journal_failed) } else { Ok(None) }
    }

    /// Whether nothing is left to do: an earlier run is finished, and its results are as it wrote them.
    ///
    /// # Errors
    /// If that run has other inputs or settings, or a result was changed.
    pub(crate) fn is_finished(&self, mut say: impl FnMut(&str)) -> anyhow::Result<bool> {
        let Some(finished) = self.finished()? else { return Ok(false) };
        let (out, missing) = (self.out_name, missing(self.out, self.out_name, &finished.outputs)?);
        if missing.is_empty() {
            say(&format!("the run in {out} is finished, and its results are as it wrote them"));
        } else {
            say(&format!("the run in {out} is finished, but {} is missing: fitting again", missing.join(", ")));
        }
        Ok(missing.is_empty())
    }

    /// The options of the run with these settings.
    pub(crate) fn options(&self) -> RunnerOptions {
        let mut options = RunnerOptions::new(self.cluster.workers.count(), self.out.file(ACCESS_FILE));
        options.listen = self.cluster.listen_for_others();
        options.access = self.cluster.access.clone();
        options.advertise = self.cluster.advertise.as_ref().map(ToString::to_string);
        options.log.clone_from(&self.cluster.log);
        options.policy = self.cluster.policy;
        options.policy.verify_seed = self.seed;
        options.journal = Some(JournalOptions {
            path: self.journal(),
            identity: self.identity.clone(),
            resume: self.resume,
            score: self.score.clone(),
            parts: self.parts.clone(),
            names: NAMES,
        });
        options
    }

    /// Runs a planner to its end. Its errors carry their exit code.
    pub(crate) fn run<P: Planner>(
        &self,
        mut options: RunnerOptions,
        planner: P,
        mut observer: impl FnMut(&RunEvent),
    ) -> anyhow::Result<(P, RunSummary)> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .enable_all()
            .build()
            .context("cannot start the network runtime")?;
        if let Some(metrics) = self.metrics {
            options.pulse = Some(metrics.pulse());
            let _guard = runtime.enter();
            runtime.spawn(metrics.serve().context("cannot serve metrics")?);
        }
        let run = runner::run(options, planner, Arc::new(nodes::registry()), |event| {
            self.metrics.into_iter().for_each(|metrics| metrics.note(event));
            observer(event);
        });
        runtime.block_on(run).map_err(|error| {
            match error.exit_code() {
                2 => anyhow::Error::new(error).context(Exit::BadInput),
                // The heading is enough; the error would repeat it.
                130 => Exit::Interrupted.into(),
                _ => anyhow::Error::new(error).context(Exit::RunFailed),
            }
        })
    }

    /// Records in the journal how the parts of the run ended, and the problem if all have ended and some failed.
    pub(crate) fn settle(&self, problem: Option<&str>) -> anyhow::Result<()> {
        journal::settle(&self.journal(), NAMES, &self.parts, problem).map_err(journal_failed)
    }

    /// Records in the journal that the run is finished and has written these files.
    pub(crate) fn finish(&self, outputs: Vec<(String, String)>) -> anyhow::Result<()> {
        journal::finish(&self.journal(), NAMES, &Finished { outputs }).map_err(journal_failed)
    }
}
