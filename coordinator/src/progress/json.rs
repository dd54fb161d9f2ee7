//! One JSON object per line on stderr, for programs: `{"event": "node-finished", ...}`.

use super::Display;
use crate::comm::{RunEvent, Site};
use serde_json::{Value, json};

pub(super) struct JsonLines;

impl Display for JsonLines {
    fn event(&mut self, event: &RunEvent) {
        if let Some(object) = object(event) {
            eprintln!("{object}");
        }
    }

    fn say(&mut self, text: &str) {
        eprintln!("{}", json!({ "event": "message", "text": text }));
    }

    fn finish(&mut self, outcome: Result<(), &str>) {
        let last = match outcome {
            Ok(()) => json!({ "event": "finished" }),
            Err(error) => json!({ "event": "failed", "error": error }),
        };
        eprintln!("{last}");
    }
}

fn object(event: &RunEvent) -> Option<Value> {
    Some(match event {
        RunEvent::Listening { address } => json!({ "event": "listening", "address": address }),
        RunEvent::Resumed { epoch, results } => json!({ "event": "resumed", "epoch": epoch, "results": results }),
        RunEvent::LocalWorkerStarted { process } => json!({ "event": "local-worker-started", "process": process }),
        RunEvent::NodeRecalled { name, bytes } => json!({
            "event": "node-recalled", "node": name.node.0, "kind": name.kind, "label": name.label, "bytes": bytes,
        }),
        RunEvent::WorkerJoined { worker, threads, process } => {
            json!({ "event": "worker-joined", "worker": worker.0, "threads": threads, "process": process })
        }
        RunEvent::WorkerLeft { worker, departure } => {
            json!({ "event": "worker-left", "worker": worker.0, "why": format!("{departure:?}") })
        }
        RunEvent::LocalWorkerEnded { process, status, restart_after } => json!({
            "event": "local-worker-ended", "process": process, "status": status, "restarts": restart_after.is_some(),
        }),
        RunEvent::WaitingForWorkers { waited, limit } => json!({
            "event": "waiting-for-workers", "waited_s": waited.as_secs_f64(), "limit_s": limit.as_secs_f64(),
        }),
        RunEvent::NodeAdded { name } => {
            json!({ "event": "node-added", "node": name.node.0, "kind": name.kind, "label": name.label })
        }
        RunEvent::NodeStarted { name, site } => {
            let (node, worker) = (name.node.0, worker_of(*site));
            json!({ "event": "node-started", "node": node, "kind": name.kind, "label": name.label, "worker": worker })
        }
        RunEvent::NodeProgress { node, permille } => {
            json!({ "event": "node-progress", "node": node.0, "permille": permille })
        }
        RunEvent::NodeFinished { name, site, bytes, elapsed } => json!({
            "event": "node-finished", "node": name.node.0, "kind": name.kind, "label": name.label,
            "worker": worker_of(*site), "bytes": bytes, "seconds": elapsed.as_secs_f64(),
        }),
        RunEvent::NodeFailed { name, reason } => json!({
            "event": "node-failed", "node": name.node.0, "kind": name.kind, "label": name.label,
            "reason": reason.to_string(),
        }),
        RunEvent::WorkerDraining { worker } => json!({ "event": "worker-draining", "worker": worker.0 }),
        RunEvent::NodeSuspected { name, deaths } => {
            json!({ "event": "node-suspected", "node": name.node.0, "label": name.label, "deaths": deaths })
        }
        RunEvent::NodeSpeculated { name, worker } => {
            json!({ "event": "node-speculated", "node": name.node.0, "label": name.label, "worker": worker.0 })
        }
        RunEvent::NodeRequeued { name, worker, crashes } => json!({
            "event": "node-requeued", "node": name.node.0, "label": name.label, "worker": worker.0, "crashes": crashes,
        }),
        _ => return None,
    })
}

/// The number of the worker; none for the coordinator itself.
fn worker_of(site: Site) -> Option<u64> {
    match site {
        Site::Worker(worker) => Some(worker.0),
        Site::Coordinator => None,
    }
}
