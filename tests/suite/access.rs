//! An access file created before its run, with the real program: created, used by a fit, and used by a worker that has a copy without the
//! key.

use crate::program::{image, lookalike, write_exr};
use lookalike_tests::process::{Process, stderr};
use std::{fs, net::TcpListener, path::Path, process::Command};
use tempfile::TempDir;

const FIT: &str = "fit photo.exr --env map.exr --out run --model ggx --gammas 1:2:1 --samples 32 --polish off";

/// A folder with a photo of a sphere on black, and a map.
fn scene() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let level = |x: usize, y: usize| 0.2 + 0.01 * f32::from(u8::try_from(x + y).unwrap());
    let on_sphere = |x: usize, y: usize| (2 * x).abs_diff(23).pow(2) + (2 * y).abs_diff(23).pow(2) < 24 * 24;
    let photo = image(24, 24, |x, y| if on_sphere(x, y) { [level(x, y); 3] } else { [0.0; 3] });
    write_exr(&folder.path().join("photo.exr"), &photo);
    write_exr(&folder.path().join("map.exr"), &image(16, 8, |_, y| if y < 4 { [1.0; 3] } else { [0.2; 3] }));
    folder
}

fn start(folder: &Path, arguments: &str) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    Process::start(command.args(arguments.split(' ')).current_dir(folder).env_remove("RUST_LOG"))
}

#[test]
fn fit_uses_an_access_file_and_its_worker_a_copy_without_the_key() {
    let (folder, elsewhere) = (scene(), tempfile::tempdir().unwrap());
    // A port that was free a moment ago.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    lookalike(folder.path(), &format!("access new --address {address} -o cluster.json")).done();
    fs::copy(folder.path().join("cluster.json"), elsewhere.path().join("copy.json")).unwrap();
    let worker = start(elsewhere.path(), "worker --access copy.json --threads 1");
    let fit = start(folder.path(), &format!("{FIT} --workers 0 --access cluster.json"));
    for output in [fit.output(), worker.output()] {
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    // A copy in the run's folder would be one more file to keep secret.
    assert!(!folder.path().join("run/access.json").exists());
    assert!(folder.path().join("run/fit.json").exists());
}

#[test]
fn fit_listens_on_another_interface_only_when_told_to() {
    let folder = scene();
    lookalike(folder.path(), "access new --address node7:4100 -o cluster.json").done();
    let answer = lookalike(folder.path(), &format!("{FIT} --workers 0 --access cluster.json"));
    answer.refused(&["workers with this access file connect to node7:4100", "--listen IP:PORT"]);
}

#[test]
fn fit_refuses_an_access_file_without_its_key() {
    let folder = scene();
    lookalike(folder.path(), "access new --address 127.0.0.1:4100 -o cluster.json").done();
    fs::remove_file(folder.path().join("cluster.key.pem")).unwrap();
    let answer = lookalike(folder.path(), &format!("{FIT} --access cluster.json"));
    answer.refused(&["cannot read the coordinator's key cluster.key.pem", "lookalike access new"]);
}
