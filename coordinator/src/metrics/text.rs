//! The page: the text exposition format of Prometheus, version 0.0.4.
//!
//! Each family has a line of help, a line of type, and its samples. Label values are quoted, with `\`, `"` and line feeds
//! escaped. A histogram has cumulative buckets, a sum and a count.

use super::{
    PartsMetric,
    book::{Book, State},
    histogram::{BOUNDS, Histogram},
};
use std::{fmt::Write as _, time::Instant};

/// The media type of the page.
pub(super) const MEDIA_TYPE: &str = "text/plain; version=0.0.4; charset=utf-8";

/// The page at a given time.
pub(super) fn page(book: &Book, now: Instant) -> String {
    let mut page = Page::default();
    page.family("lookalike_build_info", "gauge", "The version that runs; always 1.");
    page.sample("lookalike_build_info", &[("version", env!("CARGO_PKG_VERSION"))], 1.0);
    page.single("lookalike_run_seconds", "gauge", "Time since the run began.", (now - book.began).as_secs_f64());
    nodes(&mut page, book);
    workers(&mut page, book);
    if let Some((PartsMetric { name, help }, states)) = &book.parts {
        page.family(name, "gauge", help);
        for (state, count) in states {
            page.sample(name, &[("state", state)], *count as f64);
        }
    }
    page.text
}

fn nodes(page: &mut Page, book: &Book) {
    page.family("lookalike_nodes", "gauge", "Nodes of the job graph by kind and state.");
    for (kind, of_kind) in &book.kinds {
        for state in State::ALL {
            let count = of_kind.nodes.get(&state).copied().unwrap_or(0);
            page.sample("lookalike_nodes", &[("kind", kind), ("state", state.name())], count as f64);
        }
    }
    page.family("lookalike_node_seconds", "histogram", "Time from the start of a node to the arrival of its output.");
    for (kind, of_kind) in &book.kinds {
        page.histogram("lookalike_node_seconds", Some(("kind", kind)), &of_kind.seconds);
    }
    page.family(
        "lookalike_node_queue_seconds",
        "histogram",
        "Time from the moment when a node's inputs are complete to its start.",
    );
    page.histogram("lookalike_node_queue_seconds", None, &book.queue_seconds);
    for (name, help, value) in [
        (
            "lookalike_node_attempts_total",
            "Times that a node was given to a worker or run by the coordinator.",
            book.attempts,
        ),
        (
            "lookalike_nodes_requeued_total",
            "Times that a node went back to the queue because its worker left.",
            book.requeued,
        ),
        (
            "lookalike_nodes_recalled_total",
            "Nodes whose output an earlier coordinator of this run had acknowledged.",
            book.recalled,
        ),
        (
            "lookalike_nodes_speculated_total",
            "Nodes that were given to a second worker because the first one was slow.",
            book.speculated,
        ),
        (
            "lookalike_nodes_suspected_total",
            "Times that a node was quarantined because workers had died while they executed it.",
            book.suspected,
        ),
        (
            "lookalike_duplicate_results_total",
            "Outputs that arrived a second time, bit for bit the same.",
            book.duplicates,
        ),
    ] {
        page.single(name, "counter", help, value as f64);
    }
}

fn workers(page: &mut Page, book: &Book) {
    page.single("lookalike_workers", "gauge", "Workers that are connected.", book.workers() as f64);
    page.single("lookalike_worker_threads", "gauge", "Nodes that these workers run at a time.", book.threads() as f64);
    page.single(
        "lookalike_leases",
        "gauge",
        "Nodes that a worker holds or the coordinator runs.",
        book.leases() as f64,
    );
    page.single("lookalike_workers_joined_total", "counter", "Workers that have joined.", book.joined as f64);
    page.family("lookalike_workers_left_total", "counter", "Workers that have left, by reason.");
    for (reason, count) in &book.left {
        page.sample("lookalike_workers_left_total", &[("reason", reason)], *count as f64);
    }
    for (name, help, value) in [
        ("lookalike_blobs_sent_total", "Blobs sent to workers.", book.blobs_sent),
        ("lookalike_blob_bytes_sent_total", "Bytes of blobs sent to workers.", book.blob_bytes_sent),
        (
            "lookalike_output_bytes_received_total",
            "Bytes of outputs received from workers.",
            book.output_bytes_received,
        ),
    ] {
        page.single(name, "counter", help, value as f64);
    }
}

#[derive(Default)]
struct Page {
    text: String,
}

impl Page {
    /// Begin a family; its samples must follow.
    fn family(&mut self, name: &str, kind: &str, help: &str) {
        let _ = writeln!(self.text, "# HELP {name} {help}\n# TYPE {name} {kind}");
    }

    /// Write a family with one sample and no labels.
    fn single(&mut self, name: &str, kind: &str, help: &str, value: f64) {
        self.family(name, kind, help);
        self.sample(name, &[], value);
    }

    fn sample(&mut self, name: &str, labels: &[(&str, &str)], value: f64) {
        let pairs: Vec<String> = labels.iter().map(|(key, text)| format!("{key}=\"{}\"", escaped(text))).collect();
        let labels = if pairs.is_empty() { String::new() } else { format!("{{{}}}", pairs.join(",")) };
        let _ = writeln!(self.text, "{name}{labels} {value}");
    }

    fn histogram(&mut self, name: &str, label: Option<(&str, &str)>, histogram: &Histogram) {
        let counts = histogram.cumulative();
        let bounds = BOUNDS.iter().map(f64::to_string).chain(["+Inf".to_owned()]);
        for (bound, count) in bounds.zip(counts) {
            let labels: Vec<_> = label.into_iter().chain([("le", bound.as_str())]).collect();
            self.sample(&format!("{name}_bucket"), &labels, count as f64);
        }
        let labels: Vec<_> = label.into_iter().collect();
        self.sample(&format!("{name}_sum"), &labels, histogram.sum_seconds());
        self.sample(&format!("{name}_count"), &labels, counts[BOUNDS.len()] as f64);
    }
}

/// Escape a label value.
pub(super) fn escaped(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n")
}
