//! Watching a batch: the stream of progress, the metrics, fits that end early.

use super::{QUICK, folder};
use lookalike_tests::process::{Process, signal};
use serde_json::Value;
use std::{
    fs,
    io::{Read, Write},
    net::TcpStream,
    process::{Command, Output},
    time::{Duration, Instant},
};
use tempfile::TempDir;

fn start(folder: &TempDir, flags: &str) -> Process {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lookalike-under-test"));
    let line = format!("batch batch.toml --out out --progress json {flags}");
    Process::start(command.args(line.split_whitespace()).current_dir(folder.path()).env_remove("RUST_LOG"))
}

fn is(event: &Value, name: &str) -> bool {
    event["event"] == name
}

#[test]
fn early_fits_end_early_and_the_stream_says_so() {
    let photos = "'photo.exr', 'red.exr', 'tiny.exr'";
    let sets = ["a", "b", "c", "d"]
        .map(|name| format!("[[set]]\nname = '{name}'\nphotos = [{photos}]\nseed = {}\n", name.as_bytes()[0]));
    let folder = folder(&format!("[defaults]\nenv = 'map.exr'\npolish = false\n{QUICK}{}", sets.concat()));
    let out = folder.path().join("out");
    let mut partial = None;
    let (output, events) = start(&folder, "--workers 1").watch_stderr(|events| {
        // Results are there while the batch goes on.
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
    // Early ones end early: nobody ends more than the few that are under way at a time before its turn.
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

/// The page that an address serves.
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
fn metrics_tell_what_waits_for_workers() {
    // With one node at first, two fits give a worker enough to do.
    let models = "models = ['ggx', 'cook-torrance']";
    let folder =
        folder(&format!("photos = ['photo.exr', 'red.exr']\nenvironments = 'map.exr'\n{models}\n[defaults]\n{QUICK}"));
    let process = start(&folder, "--workers 0 --metrics 0");
    let coordinator = process.id();
    let samples = [
        "lookalike_workers 0",
        "lookalike_fits{state=\"waiting\"} 2",
        "lookalike_fits{state=\"running\"} 2",
        "lookalike_fits{state=\"done\"} 0",
    ];
    let has = |page: &str, sample: &str| page.lines().any(|line| line == sample);
    let (mut address, mut page) = (None, None);
    let (output, events) = process.watch_stderr(|events| {
        let event = &events[events.len() - 1];
        if let Some(text) = event["text"].as_str().and_then(|text| text.strip_prefix("metrics at http://")) {
            address = text.strip_suffix("/metrics").map(str::to_owned);
        }
        // The other fit is about to begin.
        if page.is_none() && is(event, "node-added") {
            let address = address.as_deref().expect("an address");
            let patience = Instant::now() + Duration::from_secs(60);
            let mut last = scrape(address);
            while !samples.iter().all(|sample| has(&last, sample)) && Instant::now() < patience {
                last = scrape(address);
            }
            page = Some(last);
            signal(coordinator, "INT");
        }
    });
    assert_eq!(output.status.code(), Some(130), "{events:?}");
    let page = page.unwrap();
    for sample in samples {
        assert!(has(&page, sample), "{sample} in:\n{page}");
    }
    let text = fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    assert!(text.contains("\"state\": \"stopped\"") && !text.contains("\"state\": \"running\""), "{text}");
}

#[test]
fn metrics_that_cannot_be_served_are_refused_before_any_work() {
    let folder = folder("photos = 'photo.exr'\nenvironments = 'map.exr'\n");
    let answer = super::batch(&folder, "out", "--metrics 192.0.2.1:9100");
    answer.refused(&["cannot serve metrics on 192.0.2.1:9100"]);
    super::batch(&folder, "out", "--metrics host:9100").refused(&["--metrics", "PORT for the loopback interface"]);
}
