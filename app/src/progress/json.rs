//! One JSON object per line on stderr, for programs. docs/progress.md is the contract.

use super::{
    Display, Ending,
    fits::{FitCount, FitEvent},
    print_line,
};
use lookalike::graph::split_label;
use lookalike_coordinator::events::{NodeName, RunEvent, Site};
use serde_json::{Value, json};
use std::time::Instant;

/// The version of the stream. Fields may be added to a version; the meaning of a field never changes.
const SCHEMA: &str = "lookalike.progress/1";

pub(super) struct JsonLines {
    began: Instant,
}

impl JsonLines {
    /// Writes the first line, which announces this number of fits.
    pub(super) fn new(fits: usize) -> Self {
        let lines = Self { began: Instant::now() };
        lines.print(json!({ "event": "start", "schema": SCHEMA, "version": env!("CARGO_PKG_VERSION"), "fits": fits }));
        lines
    }

    fn print(&self, mut object: Value) {
        let milliseconds = (self.began.elapsed().as_secs_f64() * 1000.0).round();
        object["time_s"] = json!(milliseconds / 1000.0);
        print_line(&object.to_string());
    }
}

impl Display for JsonLines {
    fn event(&mut self, event: &RunEvent) {
        if let Some(object) = of_run(event).or_else(|| of_node(event)) {
            self.print(object);
        }
    }

    fn fit(&mut self, event: &FitEvent, count: FitCount) {
        let mut object = of_fit(event);
        let FitCount { total, running, done, missed, failed } = count;
        object["fits"] = json!({
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

fn of_fit(event: &FitEvent) -> Value {
    match event {
        FitEvent::Started { number, name, .. } => json!({ "event": "fit-started", "fit": name, "number": number }),
        FitEvent::Finished { number, name, cssim, cssim_object, is_missed, seconds } => json!({
            "event": "fit-finished", "fit": name, "number": number, "cssim": cssim, "cssim_object": cssim_object,
            "missed": is_missed, "seconds": seconds,
        }),
        FitEvent::Failed { number, name, error } => {
            json!({ "event": "fit-failed", "fit": name, "number": number, "error": error })
        }
    }
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

fn of_node(event: &RunEvent) -> Option<Value> {
    Some(match event {
        RunEvent::NodeAdded { name } => node("node-added", name, json!({})),
        RunEvent::NodeStarted { name, site } => node("node-started", name, json!({ "worker": worker_of(*site) })),
        RunEvent::NodeProgress { node, permille } => {
            json!({ "event": "node-progress", "node": node.0, "permille": permille })
        }
        RunEvent::NodeFinished { name, site, bytes, elapsed } => {
            let rest = json!({ "worker": worker_of(*site), "bytes": bytes, "seconds": elapsed.as_secs_f64() });
            node("node-finished", name, rest)
        }
        RunEvent::NodeRecalled { name, bytes } => node("node-recalled", name, json!({ "bytes": bytes })),
        RunEvent::NodeSuspected { name, deaths } => node("node-suspected", name, json!({ "deaths": deaths })),
        RunEvent::NodeSpeculated { name, worker } => node("node-speculated", name, json!({ "worker": worker.0 })),
        RunEvent::NodeFailed { name, reason } if reason.is_cancellation() => node("node-cancelled", name, json!({})),
        RunEvent::NodeFailed { name, reason } => node("node-failed", name, json!({ "reason": reason.to_string() })),
        RunEvent::NodeRequeued { name, worker, crashes } => {
            node("node-requeued", name, json!({ "worker": worker.0, "crashes": crashes }))
        }
        _ => return None,
    })
}

/// An event of a node: number, kind, label, the fit of a batch, and the rest.
fn node(event: &str, name: &NodeName, rest: Value) -> Value {
    let (fit, label) = split_label(&name.label);
    let mut object = json!({ "event": event, "node": name.node.0, "kind": name.kind, "label": label });
    if let Some(fit) = fit {
        object["fit"] = json!(fit);
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
