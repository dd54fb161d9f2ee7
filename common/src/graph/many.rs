//! Many planners as one: the parts of a run, such as the fits of a batch, share a graph.
//!
//! - Parts start one by one, in order, when the workers need more nodes, so that hundreds of parts need not be in memory at once.
//! - Nodes of earlier parts run first, so that early parts end early.
//! - A node that two parts add runs once. Equal blobs are one blob in any case.
//! - A failed node ends its parts; the other parts continue. Nodes that only the ended parts need are cancelled.
//! - A part ends when it waits for no node, as a run does. Then everything it holds is released, and its outputs are forgotten once its
//!   result is safe.
//!
//! The result of a part does not depend on the other parts: run alone, it would get the same outputs.

use std::collections::BTreeMap;

use thiserror::Error;

use super::{
    Blob, FailureReason, GraphEdit, NodeId, NodeSpec, PlanError, Planner,
    sharing::{PartId, Sharing},
};

/// A part that can start.
#[derive(Debug)]
pub struct Part<P> {
    /// Its unique number: nodes of lower numbers run first.
    pub number: u32,
    /// Its name, for the labels of its nodes; at most
    /// [`MAX_PART_NAME_BYTES`](super::MAX_PART_NAME_BYTES).
    pub name: String,
    /// The planner of its nodes.
    pub planner: P,
    /// Whether it holds its nodes until the run ends, so that other parts that add equal nodes share them, even when it waits for no node.
    /// Such a part never completes.
    pub stays: bool,
}

/// The answer of [`Parts::next`].
#[derive(Debug)]
pub enum Next<P> {
    /// The next part.
    Part(Box<Part<P>>),
    /// The next part is not ready to start. [`Planner::look_again`] must be called when it is.
    NotYet,
    /// No more parts.
    End,
}

/// Why a part failed.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PartFailure {
    /// One of its nodes failed.
    #[error("{kind} {label:?} failed: {reason}")]
    Node {
        /// The kind of the node.
        kind: String,
        /// Its label, without the name of the part.
        label: String,
        /// Why it failed.
        reason: FailureReason,
    },
    /// Its planner returned an error.
    #[error(transparent)]
    Plan(PlanError),
}

/// The source of the parts of a run, and the receiver of their results.
pub trait Parts {
    /// The planner of a part.
    type Planner: Planner;

    /// The next part in order. With `wait`, no part is active: the call must block until the next part is ready, and must not return
    /// [`Next::NotYet`].
    ///
    /// # Errors
    /// An error ends the run.
    fn next(&mut self, wait: bool) -> Result<Next<Self::Planner>, PlanError>;

    /// Whether another part should start, given the number of `active` parts and of nodes that are `ready` for workers or running on them.
    fn wants_more(&self, active: usize, ready: usize) -> bool;

    /// A part has completed.
    ///
    /// # Errors
    /// An error ends the run.
    fn completed(&mut self, part: Part<Self::Planner>) -> Result<(), PlanError>;

    /// A part has failed.
    ///
    /// # Errors
    /// An error ends the run.
    fn failed(&mut self, part: Part<Self::Planner>, failure: PartFailure) -> Result<(), PlanError>;

    /// The parts that have become safe since the last call: they have completed and will not run again, even if this run is resumed. The
    /// outputs that only they needed are forgotten. With `is_last`, all parts but those that stay have ended: the call must block until
    /// it is known of each completed part whether it is safe.
    fn newly_safe(&mut self, is_last: bool) -> Vec<u32> {
        let _ = is_last;
        Vec::new()
    }
}

/// The planner of all parts.
#[derive(Debug)]
pub struct Many<S: Parts> {
    parts: S,
    active: BTreeMap<PartId, Part<S::Planner>>,
    sharing: Sharing,
    is_exhausted: bool,
}

impl<S: Parts> Many<S> {
    /// A planner of these parts.
    pub fn new(parts: S) -> Self {
        Self { parts, active: BTreeMap::new(), sharing: Sharing::default(), is_exhausted: false }
    }

    /// The source of the parts.
    pub fn into_parts(self) -> S {
        self.parts
    }

    /// Forget outputs that will not be needed again, and start parts while the workers need more nodes.
    fn start_more(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.settle(false, graph);
        self.start_parts(graph)?;
        if self.is_exhausted && self.active.values().all(|part| part.stays) {
            self.settle(true, graph);
        }
        Ok(())
    }

    fn settle(&mut self, is_last: bool, graph: &mut GraphEdit<'_>) {
        for number in self.parts.newly_safe(is_last) {
            self.sharing.settle(number, graph.graph());
        }
    }

    fn start_parts(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        while !self.is_exhausted {
            let is_idle = self.active.is_empty();
            if !is_idle && !self.parts.wants_more(self.active.len(), graph.ready_for_workers()) {
                return Ok(());
            }
            match self.parts.next(is_idle)? {
                Next::Part(part) => {
                    let number = part.number;
                    self.active.insert(number, *part);
                    self.advance(number, graph, |planner, graph| planner.start(graph))?;
                    self.notify_late(graph)?;
                }
                Next::NotYet if is_idle => {
                    return Err(PlanError::new(
                        "the next part is not ready after waiting for it: a bug in the plan, please report it",
                    ));
                }
                Next::NotYet => return Ok(()),
                Next::End => self.is_exhausted = true,
            }
        }
        Ok(())
    }

    /// Call a planner, then end its part if it waits for no node or has failed.
    fn advance(
        &mut self,
        number: PartId,
        graph: &mut GraphEdit<'_>,
        step: impl FnOnce(&mut S::Planner, &mut GraphEdit<'_>) -> Result<(), PlanError>,
    ) -> Result<(), PlanError> {
        let Some(part) = self.active.get_mut(&number) else { return Ok(()) };
        match step(&mut part.planner, &mut graph.on_behalf(self.sharing.part(number, &part.name))) {
            Ok(()) if self.sharing.is_idle(number) && !part.stays => {
                self.end(number, graph).map_or(Ok(()), |part| self.parts.completed(part))
            }
            Ok(()) => Ok(()),
            // A worker is faulty, so all its other results are suspect: this ends the run.
            Err(error @ (PlanError::NotVerified { .. } | PlanError::WrongOutput { .. })) => Err(error),
            Err(error) => self.fail_part(number, PartFailure::Plan(error), graph),
        }
    }

    /// Remove a part from the run and release everything that it holds.
    fn end(&mut self, number: PartId, graph: &mut GraphEdit<'_>) -> Option<Part<S::Planner>> {
        self.sharing.release_all(number, graph.graph());
        self.active.remove(&number)
    }

    fn fail_part(&mut self, number: PartId, failure: PartFailure, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.end(number, graph).map_or(Ok(()), |part| self.parts.failed(part, failure))
    }

    fn notify(
        &mut self,
        number: PartId,
        node: NodeId,
        output: &Blob,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        self.sharing.notified(number, node);
        self.advance(number, graph, |planner, graph| planner.completed(node, output, graph))
    }

    /// Notify planners of nodes that had completed before they added them.
    fn notify_late(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        while let Some((number, node)) = self.sharing.next_late() {
            // The output is available, because the part holds the node.
            if let Some(output) = graph.output(node).cloned() {
                self.notify(number, node, &output, graph)?;
            }
        }
        Ok(())
    }
}

impl<S: Parts> Planner for Many<S> {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.start_more(graph)
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        for number in self.sharing.end(node) {
            self.notify(number, node, output, graph)?;
        }
        self.notify_late(graph)?;
        self.start_more(graph)
    }

    fn failed(&mut self, node: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let (kind, label) = graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.clone())).unwrap_or_default();
        for number in self.sharing.end(node) {
            let failure = PartFailure::Node { kind: kind.clone(), label: label.name.clone(), reason: reason.clone() };
            self.fail_part(number, failure, graph)?;
        }
        self.start_more(graph)
    }

    /// The next part may be ready, or a part may have become safe.
    fn look_again(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.start_more(graph)
    }

    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        self.active.get(&spec.priority).is_none_or(|part| part.planner.is_verified_by_repetition(spec))
    }
}

#[cfg(test)]
mod tests;
