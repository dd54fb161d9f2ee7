//! Runs a planner with the given settings to its end; fits, batches and studies use it.

use crate::{
    exit::Exit,
    outputs::{ACCESS_FILE, OutFolder},
    settings::ClusterSettings,
};
use anyhow::Context;
use lookalike::{graph::Planner, nodes};
use lookalike_coordinator::{
    events::RunEvent,
    metrics::Metrics,
    runner::{self, RunnerOptions},
    state::RunSummary,
};
use std::sync::Arc;

/// The options of a run with these settings. Its access file goes to `out`; the seed decides which outputs are verified.
pub(crate) fn runner_options(cluster: &ClusterSettings, out: &OutFolder, seed: u64) -> RunnerOptions {
    let mut options = RunnerOptions::new(cluster.workers.count(), out.file(ACCESS_FILE));
    options.listen = cluster.listen_for_others();
    options.access = cluster.access.clone();
    options.advertise = cluster.advertise.as_ref().map(ToString::to_string);
    options.log.clone_from(&cluster.log);
    options.policy = cluster.policy;
    options.policy.verify_seed = seed;
    options
}

/// Runs a planner to its end. Its errors carry their exit code.
pub(crate) fn run_to_end<P: Planner>(
    mut options: RunnerOptions,
    planner: P,
    metrics: Option<&Metrics>,
    mut observer: impl FnMut(&RunEvent),
) -> anyhow::Result<(P, RunSummary)> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .context("cannot start the network runtime")?;
    if let Some(metrics) = metrics {
        options.pulse = Some(metrics.pulse());
        let _guard = runtime.enter();
        runtime.spawn(metrics.serve().context("cannot serve metrics")?);
    }
    let run = runner::run(options, planner, Arc::new(nodes::registry()), |event| {
        metrics.into_iter().for_each(|metrics| metrics.note(event));
        observer(event);
    });
    runtime.block_on(run).map_err(|error| {
        match error.exit_code() {
            2 => anyhow::Error::new(error).context(Exit::BadInput),
            // The heading is enough; the error would repeat it.
            130 => Exit::Interrupted.into(),
            _ => anyhow::Error::new(error).context(Exit::ClusterFailed),
        }
    })
}
