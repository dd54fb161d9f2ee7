//! Progress of a batch: the event stream, the metrics, and the order in which fits end.

use super::{QUICK, folder};
use lookalike_tests::{
    PATIENCE,
    process::{Process, signal},
};
use serde_json::Value;
use std::{
    fs,
    io::{Read, Write},
    net::TcpStream,
    process::{Command, Output},
};
use tempfile::TempDir;

fn command(folder: &TempDir, flags: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = format!("batch batch.toml --out out --progress json {flags}");
    command.args(line.split_whitespace()).current_dir(folder.path()).env_remove("RUST_LOG");
    command
}

fn start(folder: &TempDir, flags: &str) -> Process {
    Process::start(&mut command(folder, flags))
}

fn is(event: &Value, name: &str) -> bool {
    event["event"] == name
}

#[test]
fn fits_end_in_about_their_order_and_events_report_it() {
    let photos = "'photo.exr', 'red.exr', 'tiny.exr'";
    let sets = ["a", "b", "c", "d"]
        .map(|name| format!("[[set]]\nname = '{name}'\nphotos = [{photos}]\nseed = {}\n", name.as_bytes()[0]));
    let folder = folder(&format!("[defaults]\nenv = 'map.exr'\n{QUICK}{}", sets.concat()));
    let out = folder.path().join("out");
    let mut partial = None;
    let mut command = command(&folder, "--workers 1");
    // The number of threads limits how many fits wait to be judged.
    let process = Process::start(command.env("RAYON_NUM_THREADS", "2"));
    let (output, events) = process.watch_stderr(|events| {
        // Results of a fit are written while the batch runs.
        let event = &events[events.len() - 1];
        if partial.is_none() && is(event, "fit-finished") {
            let name = event["fit"].as_str().unwrap();
            partial = Some(out.join(name).join("fit.json").exists() && out.join("summary.csv").exists());
        }
    });
    let Output { status, stderr: _, stdout: _ } = output;
    assert_eq!((status.code(), partial), (Some(4), Some(true)), "{events:?}");
    let first = &events[0];
    assert_eq!(
        (&first["event"], &first["schema"], &first["fits"]),
        (&"start".into(), &"lookalike.progress/1".into(), &12.into())
    );
    assert!(events.iter().all(|event| event["time_s"].is_number()), "{events:?}");
    let place =
        |name: &str, fit: &str| events.iter().position(|event| is(event, name) && event["fit"] == fit).expect(fit);
    assert!(place("fit-finished", "a-photo-map-ggx") < place("fit-started", "d-photo-map-ggx"));
    let ends: Vec<&Value> =
        events.iter().filter(|event| is(event, "fit-finished") || is(event, "fit-failed")).collect();
    assert_eq!(ends.len(), 12);
    for (count, event) in (1..).zip(&ends) {
        let fits = &event["fits"];
        assert_eq!(fits["done"].as_u64().unwrap() + fits["failed"].as_u64().unwrap(), count, "{event}");
    }
    // Fits end in about their order: at most four places from their own, because only a few run at a time.
    for (place, event) in (0..).zip(&ends) {
        let number = event["number"].as_i64().unwrap();
        assert!((number - place).abs() <= 4, "{event} as the {place}th");
    }
    let named = |event: &&Value| {
        is(event, "node-finished") && event["fit"] == "a-red-map-ggx" && event["label"] == "search gamma 1.5"
    };
    assert_eq!(events.iter().filter(named).count(), 1, "{events:?}");
    assert!(is(events.last().unwrap(), "finished"));
}

/// The page served at an address.
fn scrape(address: &str) -> String {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.write_all(b"GET /metrics HTTP/1.1\r\nHost: localhost\r\n\r\n").unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    let (head, page) = answer.split_once("\r\n\r\n").unwrap();
    assert!(head.starts_with("HTTP/1.1 200 OK\r\n"), "{head}");
    page.to_owned()
}

#[test]
fn metrics_report_fits_that_wait_for_workers() {
    let models = "models = ['ggx', 'cook-torrance']";
    let folder =
        folder(&format!("photos = ['photo.exr', 'red.exr']\nenvironments = 'map.exr'\n{models}\n[defaults]\n{QUICK}"));
    let process = start(&folder, "--workers 0 --metrics 0");
    let coordinator = process.id();
    let (mut address, mut page) = (None, None);
    let (output, events) = process.watch_stderr(|events| {
        let event = &events[events.len() - 1];
        if let Some(text) = event["text"].as_str().and_then(|text| text.strip_prefix("metrics at http://")) {
            address = text.strip_suffix("/metrics").map(str::to_owned);
        }
        // The second fit starts as soon as it is read, although no node finishes here, because one ready node is not enough for a worker.
        let started = events.iter().filter(|event| is(event, "fit-started")).count();
        let is_planned = events.iter().any(|event| is(event, "node-added") && event["kind"] == "search");
        if page.is_none() && started == 2 && is_planned {
            page = Some(scrape(address.as_deref().expect("an address")));
            signal(coordinator, "INT");
        }
    });
    assert_eq!(output.status.code(), Some(130), "{events:?}");
    let page = page.unwrap();
    for sample in [
        "lookalike_workers 0",
        "lookalike_fits{state=\"done\"} 0",
        "lookalike_nodes{kind=\"search\",state=\"completed\"} 0",
    ] {
        assert!(page.lines().any(|line| line == sample), "{sample} in:\n{page}");
    }
    let fits = |state: &str| {
        let sample = format!("lookalike_fits{{state=\"{state}\"}} ");
        page.lines().find_map(|line| line.strip_prefix(&sample)?.parse::<u32>().ok()).expect(state)
    };
    assert_eq!((fits("running"), fits("waiting")), (2, 2), "{page}");
    let text = fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    assert!(text.contains("\"state\": \"stopped\"") && !text.contains("\"state\": \"running\""), "{text}");
}

#[test]
fn batch_continues_when_its_progress_is_no_longer_read() {
    let folder = folder(&format!("photos = 'photo.exr'\nenvironments = 'map.exr'\n[defaults]\n{QUICK}"));
    let mut process = start(&folder, "--workers 1");
    let found = process.stderr_until(|event| is(event, "worker-joined").then_some(()));
    assert!(found.is_some());
    assert_eq!(process.output().status.code(), Some(0));
    assert!(folder.path().join("out/photo-map-ggx/fit.json").exists());
}

#[test]
fn slow_reading_of_inputs_is_shown() {
    let folder = folder("photos = 'pipe.exr'\nenvironments = 'map.exr'\n");
    fs::write(folder.path().join("study.toml"), "materials = ['pipe.exr']\nprobes = ['map.exr']\n").unwrap();
    // Reading it does not end, because nothing is written to it.
    assert!(Command::new("mkfifo").arg(folder.path().join("pipe.exr")).status().unwrap().success());
    for (line, total) in [
        ("batch batch.toml", "1 fit"),
        ("batch batch.toml --slurm", "1 fit"),
        ("study study.toml", "2 files"),
        ("study study.toml --slurm", "2 files"),
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
        let mut process =
            Process::start(command.args(line.split(' ')).args(["--out", "out"]).current_dir(folder.path()));
        let told = process.follow_stderr(std::io::sink()).recv_timeout(PATIENCE).expect(line);
        let expected = format!("reading the inputs: 0 of {total} (");
        assert!(told.as_str().is_some_and(|told| told.starts_with(&expected)), "{line}: {told}");
        process.kill();
    }
}

#[test]
fn metrics_that_cannot_be_served_are_refused_before_any_work() {
    let folder = folder("photos = 'photo.exr'\nenvironments = 'map.exr'\n");
    let answer = super::batch(&folder, "out", "--metrics 192.0.2.1:9100");
    answer.refused(&["cannot serve metrics on 192.0.2.1:9100"]);
    super::batch(&folder, "out", "--metrics host:9100").refused(&["--metrics", "PORT for the loopback interface"]);
}
