//! One JSON object per line on stderr, for programs. docs/progress.md is the contract.

use super::{
    Display, Ending,
    parts::{PartCount, PartEvent, Shape},
    print_line,
};
use lookalike::graph::Label;
use lookalike_coordinator::events::{NodeName, RunEvent, Site};
use serde_json::{Value, json};
use std::time::Instant;

/// The version of the stream. Fields may be added to a version; the meaning of a field never changes.
const SCHEMA: &str = "lookalike.progress/1";

pub(super) struct JsonLines {
    shape: Shape,
    began: Instant,
}

impl JsonLines {
    /// Writes the first line, which announces the number of fits or cells.
    pub(super) fn new(shape: Shape) -> Self {
        let lines = Self { shape, began: Instant::now() };
        let total = if let Shape::Many { total, .. } = shape { total } else { 1 };
        let mut start = json!({ "event": "start", "schema": SCHEMA, "version": env!("CARGO_PKG_VERSION") });
        start[format!("{}s", lines.noun())] = json!(total);
        lines.print(start);
        lines
    }

    /// The word for a part.
    fn noun(&self) -> &'static str {
        if let Shape::Many { noun, .. } = self.shape { noun } else { "fit" }
    }

    fn print(&self, mut object: Value) {
        let milliseconds = (self.began.elapsed().as_secs_f64() * 1000.0).round();
        object["time_s"] = json!(milliseconds / 1000.0);
        print_line(&object.to_string());
    }
}

impl Display for JsonLines {
    fn event(&mut self, event: &RunEvent) {
        if let Some(object) = of_run(event).or_else(|| of_node(self.noun(), event)) {
            self.print(object);
        }
    }

    fn part(&mut self, event: &PartEvent, count: PartCount) {
        let Shape::Many { noun, .. } = self.shape else { return };
        let mut object = of_part(noun, event);
        let PartCount { total, running, done, missed, failed } = count;
        object[format!("{noun}s")] = json!({
            "total": total, "running": running, "done": done, "missed": missed, "failed": failed,
        });
        self.print(object);
    }

    fn say(&mut self, text: &str) {
        self.print(json!({ "event": "message", "text": text }));
    }

    fn finish(&mut self, ending: Ending<'_>) {
        self.print(match ending {
            Ending::Finished => json!({ "event": "finished" }),
            Ending::Stopped(reason) => json!({ "event": "stopped", "reason": reason }),
            Ending::Failed(error) => json!({ "event": "failed", "error": error }),
        });
    }
}

fn of_part(noun: &str, event: &PartEvent) -> Value {
    let names = match noun {
        "cell" => ["cell-started", "cell-finished", "cell-failed"],
        _ => ["fit-started", "fit-finished", "fit-failed"],
    };
    let (event_name, number, name) = match event {
        PartEvent::Started { number, name, .. } => (names[0], number, name),
        PartEvent::Finished { number, name, .. } => (names[1], number, name),
        PartEvent::Failed { number, name, .. } => (names[2], number, name),
    };
    let mut object = json!({ "event": event_name, "number": number });
    object[noun] = json!(name);
    match event {
        PartEvent::Finished { scores: Some(scores), .. } => {
            object["cssim"] = json!(scores.cssim);
            object["cssim_object"] = json!(scores.cssim_object);
            object["missed"] = json!(scores.is_missed);
            object["seconds"] = json!(scores.seconds);
        }
        PartEvent::Failed { error, .. } => object["error"] = json!(error),
        PartEvent::Started { .. } | PartEvent::Finished { scores: None, .. } => {}
    }
    object
}

fn of_run(event: &RunEvent) -> Option<Value> {
    Some(match event {
        RunEvent::Listening { address, .. } => json!({ "event": "listening", "address": address }),
        RunEvent::Resumed { epoch, results } => json!({ "event": "resumed", "epoch": epoch, "results": results }),
        RunEvent::LocalWorkerStarted { process } => json!({ "event": "local-worker-started", "process": process }),
        RunEvent::WorkerJoined { worker, threads, process } => {
            json!({ "event": "worker-joined", "worker": worker.0, "threads": threads, "process": process })
        }
        RunEvent::WorkerDraining { worker } => json!({ "event": "worker-draining", "worker": worker.0 }),
        RunEvent::WorkerLeft { worker, departure } => {
            let detail = departure.to_string();
            json!({ "event": "worker-left", "worker": worker.0, "why": departure.word(), "detail": detail })
        }
        RunEvent::LocalWorkerEnded { process, status, restart_after } => json!({
            "event": "local-worker-ended", "process": process, "status": status, "restarts": restart_after.is_some(),
        }),
        RunEvent::WaitingForWorkers { waited, limit } => json!({
            "event": "waiting-for-workers", "waited_s": waited.as_secs_f64(), "limit_s": limit.as_secs_f64(),
        }),
        _ => return None,
    })
}

fn of_node(noun: &str, event: &RunEvent) -> Option<Value> {
    Some(match event {
        RunEvent::NodeAdded { name } => node(noun, "node-added", name, json!({})),
        RunEvent::NodeStarted { name, site } => node(noun, "node-started", name, json!({ "worker": worker_of(*site) })),
        RunEvent::NodeProgress { node, permille } => {
            json!({ "event": "node-progress", "node": node.0, "permille": permille })
        }
        RunEvent::NodeFinished { name, site, bytes, elapsed } => {
            let rest = json!({ "worker": worker_of(*site), "bytes": bytes, "seconds": elapsed.as_secs_f64() });
            node(noun, "node-finished", name, rest)
        }
        RunEvent::NodeRecalled { name, bytes } => node(noun, "node-recalled", name, json!({ "bytes": bytes })),
        RunEvent::NodeSuspected { name, deaths } => node(noun, "node-suspected", name, json!({ "deaths": deaths })),
        RunEvent::NodeSpeculated { name, worker } => node(noun, "node-speculated", name, json!({ "worker": worker.0 })),
        RunEvent::NodeFailed { name, reason } if reason.is_cancellation() => {
            node(noun, "node-cancelled", name, json!({}))
        }
        RunEvent::NodeFailed { name, reason } => {
            node(noun, "node-failed", name, json!({ "reason": reason.to_string() }))
        }
        RunEvent::NodeRequeued { name, worker, crashes } => {
            node(noun, "node-requeued", name, json!({ "worker": worker.0, "crashes": crashes }))
        }
        _ => return None,
    })
}

/// An event of a node: number, kind, label, the fit of a batch or the cell of a study, and the rest.
fn node(noun: &str, event: &str, name: &NodeName, rest: Value) -> Value {
    let Label { part, name: label } = &name.label;
    let mut object = json!({ "event": event, "node": name.node.0, "kind": name.kind, "label": label });
    if let Some(part) = part {
        object[noun] = json!(part);
    }
    if let (Some(object), Value::Object(rest)) = (object.as_object_mut(), rest) {
        object.extend(rest);
    }
    object
}

/// The number of the worker; `None` for the coordinator itself.
fn worker_of(site: Site) -> Option<u64> {
    match site {
        Site::Worker(worker) => Some(worker.0),
        Site::Coordinator => None,
    }
}
