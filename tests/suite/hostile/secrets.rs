//! The secret and the key appear only in their files.

use super::{PROGRAM, run_at_the_gate};
use crate::program::{image, write_exr};
use lookalike_tests::gate::Gate;
use lookalike_tests::process::Process;
use std::path::Path;
use std::process::Command;

/// What must not appear: the secret, and a line of the key.
fn secrets(access: &Path) -> [String; 2] {
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(access).unwrap()).unwrap();
    let pem = std::fs::read_to_string(access.with_extension("key.pem")).unwrap();
    let key = pem.split("PRIVATE KEY-----").nth(1).unwrap().trim().lines().next().unwrap();
    assert!(key.len() >= 64, "{key}");
    [json["secret"].as_str().unwrap().to_owned(), key.to_owned()]
}

#[cfg(target_os = "linux")]
#[test]
fn process_list_shows_the_access_files_path_and_not_the_secret() {
    let gate = Gate::new();
    let cluster = run_at_the_gate(&gate);
    let waiting = gate.next();
    let secrets = secrets(&cluster.access_file());
    for what in ["cmdline", "environ"] {
        let shown = std::fs::read(format!("/proc/{}/{what}", waiting.process())).unwrap();
        let shown = String::from_utf8_lossy(&shown);
        assert!(what != "cmdline" || shown.contains("access.json"), "{shown}");
        assert!(secrets.iter().all(|secret| !shown.contains(secret.as_str())), "{what}");
    }
    waiting.release();
    assert!(cluster.finish().0.is_some());
}

#[test]
fn logs_at_level_trace_do_not_contain_secret_or_key() {
    let folder = tempfile::tempdir().unwrap();
    write_exr(
        &folder.path().join("photo.exr"),
        &image(24, 24, |x, y| {
            let lit = 0.2 + 0.01 * f32::from(u8::try_from(x + y).unwrap_or(0));
            [lit, lit, lit]
        }),
    );
    write_exr(&folder.path().join("map.exr"), &image(16, 8, |_, y| if y < 4 { [1.0; 3] } else { [0.2; 3] }));
    let fit = "fit photo.exr --env map.exr --out run --model ggx --gammas 1:2:1 --samples 32 --polish off --workers 1";
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    command.args(fit.split(' ')).current_dir(folder.path()).env("RUST_LOG", "trace");
    let output = Process::start(&mut command).output();
    let said = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert_eq!(output.status.code(), Some(0), "{said}");
    // Both the coordinator and the worker have logged.
    assert!(said.contains("lookalike_coordinator::rpc") && said.contains("lookalike_worker::session"), "{said}");
    let access = folder.path().join("run/access.json");
    assert!(secrets(&access).iter().all(|secret| !said.contains(secret.as_str())));
    let settings = std::fs::read_to_string(folder.path().join("run/fit.json")).unwrap();
    assert!(secrets(&access).iter().all(|secret| !settings.contains(secret.as_str())));
}

#[test]
fn coordinator_without_listen_is_reachable_only_on_loopback() {
    let folder = tempfile::tempdir().unwrap();
    let (gate, file) = (Gate::new(), folder.path().join("access.json"));
    let arguments = ["gates", "1", &gate.address().to_string(), "1"].map(str::to_owned);
    let coordinator = Process::start(Command::new(PROGRAM).args(arguments).arg(&file));
    let waiting = gate.next();
    let address = lookalike_tests::cluster::read_access(&file).address;
    assert!(address.starts_with("127.0.0.1:"), "{address}");
    waiting.release();
    assert_eq!(coordinator.output().status.code(), Some(0));
}
