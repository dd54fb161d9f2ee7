//! Batches on a real Slurm with several nodes. A node is killed with all its processes during a run: first one with a worker, then the
//! coordinator's. The results are those of this machine alone, bit for bit.

mod cluster;

use crate::{
    fit::scene::{folder, without_timing},
    program::lookalike,
};
use cluster::Cluster;
use lookalike_tests::process::Process;
use std::{fmt::Write as _, fs, path::Path};
use tempfile::TempDir;

/// How many fits the batch has.
const FITS: usize = 12;

/// A folder with a scene, a batch of it under light from all sides, and its results by this machine alone.
fn batch() -> TempDir {
    let folder = folder();
    let mut manifest = "[defaults]\nsamples = 128\nseed = 5\n".to_owned();
    for fit in 0..FITS {
        let (model, rotation) = (["ggx", "cook-torrance"][fit % 2], 15 * fit);
        let place = "photo = \"photo.exr\"\nenv = \"map.exr\"";
        write!(manifest, "[[fit]]\nname = \"fit-{fit}\"\n{place}\nmodel = \"{model}\"\nenv-rotation = {rotation}\n")
            .unwrap();
    }
    fs::write(folder.path().join("all.toml"), manifest).unwrap();
    lookalike(folder.path(), "batch all.toml --out local --progress none").done();
    folder
}

fn assert_same(folder: &Path, out: &str) {
    for fit in 0..FITS {
        let of = |out: &str| folder.join(out).join(format!("fit-{fit}"));
        assert_eq!(without_timing(&of("local")), without_timing(&of(out)), "{out}, fit {fit}");
    }
}

#[test]
fn batches_survive_killed_nodes() {
    let Some(mut cluster) = Cluster::start(3) else { return };
    let folder = batch();
    let cpus = format!("--cpus-per-task={}", cluster::CPUS);
    let ended = ["the coordinator ended with status 0"];

    // Kill a node with a worker.
    let line = "batch all.toml --out worker --progress json";
    let mut job = cluster.submit(folder.path(), &["--nodes=3", &cpus], line);
    job.log.wait_for(&["worker-joined", "\"worker\":3"]);
    job.log.wait_for(&["node-started", "transport"]);
    cluster.cut("node3");
    job.log.wait_for(&["worker-left"]);
    job.log.wait_for(&ended);
    assert_same(folder.path(), "worker");

    // Kill the coordinator's node: the remaining worker requeues the job, which continues on the remaining nodes.
    cluster.start_node(2);
    let mut controller = cluster.controller_log();
    let line = "batch all.toml --out coordinator --progress json --slurm -- --nodes=2";
    let mut job = cluster.submit_with_the_program(folder.path(), &format!("{line} {cpus}"), "coordinator");
    job.log.wait_for(&["coordinator on node1"]);
    job.log.wait_for(&["node-finished", "select"]);
    cluster.cut("node1");
    controller.wait_for(&[&format!("Requeuing JobId={}", job.number)]);
    // Slurm delays the start of a requeued job by two minutes.
    let now = [format!("jobid={}", job.number), "starttime=now".to_owned()];
    let update = Process::start(cluster.command("scontrol").arg("update").args(now)).output();
    assert!(update.status.success(), "{}", String::from_utf8_lossy(&update.stderr));
    job.log.wait_for(&["restart 1", "coordinator on node"]);
    job.log.wait_for(&["\"event\":\"resumed\""]);
    job.log.wait_for(&ended);
    assert_eq!(job.log.count("coordinator on node1"), 1);
    assert_same(folder.path(), "coordinator");
}
