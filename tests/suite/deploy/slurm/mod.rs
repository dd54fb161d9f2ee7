//! The job script on a real Slurm: several nodes, one of them cut off with all its processes in the middle of a run, then the
//! coordinator's own. Whatever dies, the results are those of one process, bit for bit.

mod cluster;

use crate::fit::scene::{fit, folder, without_timing};
use cluster::Cluster;
use lookalike_tests::process::Process;
use std::path::Path;

const FLAGS: &str = "--samples 128 --seed 5";

fn line(out: &str) -> String {
    format!("fit photo.exr --env map.exr --out {out} --progress json {FLAGS}")
}

fn assert_same(folder: &Path, out: &str) {
    assert_eq!(without_timing(&folder.join("local")), without_timing(&folder.join(out)), "{out}");
}

#[test]
fn run_survives_its_nodes_one_after_the_other() {
    let Some(mut cluster) = Cluster::start(3) else { return };
    let folder = folder();
    fit(folder.path(), "local", &format!("{FLAGS} --workers 1 --progress none")).done();
    let cpus = format!("--cpus-per-task={}", cluster::CPUS);
    let ended = ["the coordinator ended with status 0"];

    // A node with a worker.
    let mut job = cluster.submit(folder.path(), &["--nodes=3", &cpus], &line("worker"));
    job.log.wait_for(&["node-started", "transport"]);
    job.log.wait_for(&["worker-joined", "\"worker\":3"]);
    cluster.cut("node3");
    job.log.wait_for(&["worker-left"]);
    job.log.wait_for(&ended);
    assert_same(folder.path(), "worker");

    // The coordinator's node: the worker that is left gives the job back, and it goes on with the nodes that are left.
    cluster.start_node(2);
    let mut controller = cluster.controller_log();
    let mut job = cluster.submit(folder.path(), &["--nodes=2", &cpus], &line("coordinator"));
    job.log.wait_for(&["coordinator on node1"]);
    job.log.wait_for(&["node-started", "transport in full"]);
    cluster.cut("node1");
    controller.wait_for(&[&format!("Requeuing JobId={}", job.number)]);
    // Slurm lets a job that was given back wait for two minutes.
    let now = [format!("jobid={}", job.number), "starttime=now".to_owned()];
    let update = Process::start(cluster.command("scontrol").arg("update").args(now)).output();
    assert!(update.status.success(), "{}", String::from_utf8_lossy(&update.stderr));
    job.log.wait_for(&["restart 1", "coordinator on node"]);
    job.log.wait_for(&ended);
    assert_eq!(job.log.count("coordinator on node1"), 1);
    assert_same(folder.path(), "coordinator");
}
