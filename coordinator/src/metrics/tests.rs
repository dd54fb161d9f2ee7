//! The page after some events, and the server's answers.

use super::{
    PartsMetric,
    book::Book,
    health,
    http::{Pages, response},
    text::{escaped, page},
};
use crate::events::{Departure, NodeName, RunEvent, Site};
use lookalike::graph::{FailureReason, NodeFailure, NodeId, WorkerId};
use std::time::{Duration, Instant};

fn name(node: u64, kind: &str) -> NodeName {
    NodeName { node: NodeId(node), kind: kind.to_owned(), label: format!("{kind} {node}").into(), part: 0 }
}

/// The value of a sample, which must occur once.
#[track_caller]
fn value(page: &str, sample: &str) -> f64 {
    let found: Vec<&str> = page.lines().filter_map(|line| line.strip_prefix(sample)?.strip_prefix(' ')).collect();
    assert_eq!(found.len(), 1, "{sample} in:\n{page}");
    found[0].parse().unwrap()
}

fn run() -> String {
    let began = Instant::now();
    let mut book = Book::new(began);
    let at = |seconds: f64| began + Duration::from_secs_f64(seconds);
    let (worker, site) = (WorkerId(1), Site::Worker(WorkerId(1)));
    book.note(&RunEvent::WorkerJoined { worker, threads: 2, process: 7 }, at(0.0));
    for node in 0..4 {
        book.note(&RunEvent::NodeAdded { name: name(node, "search") }, at(0.0));
    }
    for node in 0..3 {
        book.note(&RunEvent::NodeReady { node: NodeId(node) }, at(1.0));
    }
    for node in 0..2 {
        book.note(&RunEvent::NodeAssigned { node: NodeId(node), worker }, at(1.5));
    }
    book.note(&RunEvent::NodeStarted { name: name(0, "search"), site }, at(3.0));
    book.note(&RunEvent::BlobSent { worker, bytes: 1000 }, at(3.0));
    let finished =
        RunEvent::NodeFinished { name: name(0, "search"), site, bytes: 50, elapsed: Duration::from_millis(30) };
    book.note(&finished, at(3.1));
    let crash = FailureReason::Crashed { crashes: 3 };
    book.note(&RunEvent::NodeFailed { name: name(2, "search"), reason: crash }, at(4.0));
    let cancelled = FailureReason::Node(NodeFailure::Cancelled);
    book.note(&RunEvent::NodeFailed { name: name(3, "search"), reason: cancelled }, at(4.0));
    book.note(&RunEvent::NodeRequeued { name: name(1, "search"), worker, crashes: 0 }, at(5.0));
    book.note(&RunEvent::WorkerLeft { worker, departure: Departure::Lost }, at(5.0));
    let metric = PartsMetric { name: "lookalike_parts", help: "Parts by state." };
    book.parts = Some((metric, vec![("running", 2), ("failed", 1)]));
    page(&book, at(9.0))
}

#[test]
fn node_counts_follow_the_events() {
    let page = run();
    let nodes = |state: &str| value(&page, &format!("lookalike_nodes{{kind=\"search\",state=\"{state}\"}}"));
    let states = ["waiting", "ready", "leased", "running", "completed", "failed", "cancelled"];
    assert_eq!(states.map(nodes), [0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    for (sample, expected) in [
        ("lookalike_run_seconds", 9.0),
        ("lookalike_workers", 0.0),
        ("lookalike_workers_joined_total", 1.0),
        ("lookalike_workers_left_total{reason=\"lost\"}", 1.0),
        ("lookalike_leases", 0.0),
        ("lookalike_node_attempts_total", 2.0),
        ("lookalike_nodes_requeued_total", 1.0),
        ("lookalike_blob_bytes_sent_total", 1000.0),
        ("lookalike_output_bytes_received_total", 50.0),
        ("lookalike_parts{state=\"running\"}", 2.0),
        ("lookalike_node_queue_seconds_sum", 2.0),
        ("lookalike_node_queue_seconds_bucket{le=\"1\"}", 0.0),
        ("lookalike_node_queue_seconds_bucket{le=\"2.5\"}", 1.0),
        ("lookalike_node_seconds_bucket{kind=\"search\",le=\"0.025\"}", 0.0),
        ("lookalike_node_seconds_bucket{kind=\"search\",le=\"0.05\"}", 1.0),
        ("lookalike_node_seconds_bucket{kind=\"search\",le=\"+Inf\"}", 1.0),
        ("lookalike_node_seconds_count{kind=\"search\"}", 1.0),
    ] {
        assert_eq!(value(&page, sample), expected, "{sample}");
    }
}

#[test]
fn speculated_node_counts_as_running_once() {
    let began = Instant::now();
    let mut book = Book::new(began);
    book.note(&RunEvent::NodeAdded { name: name(0, "search") }, began);
    book.note(&RunEvent::NodeReady { node: NodeId(0) }, began);
    let assigned = |worker| RunEvent::NodeAssigned { node: NodeId(0), worker: WorkerId(worker) };
    book.note(&assigned(1), began);
    book.note(&RunEvent::NodeStarted { name: name(0, "search"), site: Site::Worker(WorkerId(1)) }, began);
    book.note(&assigned(2), began);
    let page = page(&book, began);
    let nodes = |state: &str| value(&page, &format!("lookalike_nodes{{kind=\"search\",state=\"{state}\"}}"));
    assert_eq!((nodes("leased"), nodes("running"), value(&page, "lookalike_node_attempts_total")), (0.0, 1.0, 2.0));
}

#[test]
fn every_sample_belongs_to_a_declared_family_and_names_follow_the_conventions() {
    let page = run();
    let mut family = (String::new(), String::new());
    for line in page.lines() {
        if let Some(rest) = line.strip_prefix("# TYPE ") {
            let (name, kind) = rest.split_once(' ').unwrap();
            assert!(name.starts_with("lookalike_") && (kind == "counter") == name.ends_with("_total"), "{line}");
            family = (name.to_owned(), kind.to_owned());
        } else if !line.starts_with("# HELP ") {
            let name = line.split(['{', ' ']).next().unwrap();
            let suffix = name.strip_prefix(&family.0).unwrap_or_else(|| panic!("{line} after {family:?}"));
            let allowed: &[&str] = if family.1 == "histogram" { &["_bucket", "_sum", "_count"] } else { &[""] };
            assert!(allowed.contains(&suffix), "{line}");
        }
    }
    assert!(page.ends_with('\n'));
    assert_eq!(escaped("a\\b\"c\nd"), "a\\\\b\\\"c\\nd");
}

/// A run whose loop completed its last round this many seconds ago.
struct Round(Option<u64>);

impl Pages for Round {
    fn page(&self) -> String {
        "x 1\n".to_owned()
    }

    fn health(&self) -> Result<(), String> {
        health(self.0.map(Duration::from_secs))
    }
}

#[test]
fn health_is_that_of_the_event_loop() {
    let answer = |age: Option<u64>| String::from_utf8(response(b"GET /healthz HTTP/1.1\r\n\r\n", &Round(age))).unwrap();
    for well in [None, Some(0), Some(30)] {
        assert!(answer(well).starts_with("HTTP/1.1 200 OK\r\n"), "{well:?}");
    }
    let hangs = answer(Some(31));
    assert!(hangs.starts_with("HTTP/1.1 503 Service Unavailable\r\n"), "{hangs}");
    assert!(hangs.ends_with("\r\n\r\nthe event loop last ran 31 s ago\n"), "{hangs}");
}

#[test]
fn requests_get_the_page_or_its_path() {
    let answer = |head: &str| String::from_utf8(response(head.as_bytes(), &Round(None))).unwrap();
    let page = answer("GET /metrics?a=b HTTP/1.1\r\nHost: h\r\n\r\n");
    assert!(page.starts_with("HTTP/1.1 200 OK\r\nContent-Type: text/plain; version=0.0.4"), "{page}");
    assert!(page.contains("\r\nContent-Length: 4\r\n") && page.ends_with("\r\n\r\nx 1\n"), "{page}");
    let head = answer("HEAD /metrics HTTP/1.0\r\n\r\n");
    assert!(head.contains("Content-Length: 4\r\n") && head.ends_with("\r\n\r\n"), "{head}");
    assert!(answer("GET / HTTP/1.1\r\n\r\n").contains("404 Not Found"));
    assert!(answer("POST /metrics HTTP/1.1\r\n\r\n").contains("405 Method Not Allowed\r\n"));
    for nonsense in ["", "GET", "GET /metrics SMTP", "\u{16}\u{3}\u{1}"] {
        assert!(answer(nonsense).starts_with("HTTP/1.1 400 "), "{nonsense:?}");
    }
}
