//! Many planners as one: the parts of a run, such as the fits of a batch, share a graph.
//!
//! - Parts begin one by one, in order, when the workers need more to do, so that hundreds of them need not be in memory.
//! - Nodes of earlier parts run first, so that early parts end early.
//! - A node that two parts ask for runs once; equal blobs are one blob anyway.
//! - A node that fails ends its part; the others go on. What only that part wanted is cancelled.
//! - A part ends when it waits for nothing any more, as a run does. What it held is released, and forgotten for good once what was made
//!   of it is safe.
//!
//! What a part makes of its outputs does not depend on the other parts: alone, it would get the same ones.

use std::collections::BTreeMap;

use thiserror::Error;

use super::{
    Blob, FailureReason, GraphEdit, NodeId, NodeSpec, PlanError, Planner,
    part_label::split_label,
    sharing::{PartId, Sharing},
};

/// A part that can begin.
#[derive(Debug)]
pub struct Part<P> {
    /// Its number, which no other part has: parts of lower numbers go first.
    pub number: u32,
    /// Its name, which goes before the labels of its nodes. Without ": "; at most [`MAX_PART_NAME_BYTES`](super::MAX_PART_NAME_BYTES).
    pub name: String,
    /// What plans its nodes.
    pub planner: P,
    /// It holds its nodes until the run ends, for the parts that ask for the same, even when it waits for nothing any more; it never counts as
    /// completed.
    pub stays: bool,
}

/// The answer to "what is next?".
#[derive(Debug)]
pub enum Next<P> {
    /// This part.
    Part(Box<Part<P>>),
    /// There are more, but the next one is not ready to begin: whoever runs the graph is to be told when it is, with
    /// [`Planner::look_again`].
    NotYet,
    /// No more parts.
    End,
}

/// Why a part gave up.
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
    /// Its planner cannot go on.
    #[error(transparent)]
    Plan(PlanError),
}

/// Where the parts of a run come from, and where they go.
pub trait Parts {
    /// What plans a part.
    type Planner: Planner;

    /// The next part in order. With `wait`, there is nothing else to do: [`Next::NotYet`] is no answer then.
    ///
    /// # Errors
    /// What ends the run.
    fn next(&mut self, wait: bool) -> Result<Next<Self::Planner>, PlanError>;

    /// Whether another part should begin, beside `active` ones with `ready` nodes that workers may run or are running.
    fn wants_more(&self, active: usize, ready: usize) -> bool;

    /// A part has ended well.
    ///
    /// # Errors
    /// What ends the run.
    fn completed(&mut self, part: Part<Self::Planner>) -> Result<(), PlanError>;

    /// A part has given up.
    ///
    /// # Errors
    /// What ends the run.
    fn failed(&mut self, part: Part<Self::Planner>, failure: PartFailure) -> Result<(), PlanError>;

    /// The parts that have become safe since the last call: they have ended well, and never have to be run again, whatever happens to
    /// this run. What only they needed is forgotten for good.
    fn newly_safe(&mut self) -> Vec<u32> {
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

    /// What the parts came from.
    pub fn into_parts(self) -> S {
        self.parts
    }

    /// Forget what nobody will need again, and let parts begin as long as there is too little to do.
    fn go_on(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        for number in self.parts.newly_safe() {
            self.sharing.settle(number, graph.graph());
        }
        self.begin_parts(graph)
    }

    fn begin_parts(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
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
                    self.tell_late(graph)?;
                }
                Next::NotYet if is_idle => {
                    return Err(PlanError::new("a part was waited for and did not come: a mistake in the plan"));
                }
                Next::NotYet => return Ok(()),
                Next::End => self.is_exhausted = true,
            }
        }
        Ok(())
    }

    /// Let a planner do something, and see what has become of its part.
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
            // A worker has lied or is broken: whatever else it sent is worth no more.
            Err(error @ (PlanError::NotVerified { .. } | PlanError::WrongOutput { .. })) => Err(error),
            Err(error) => self.give_up(number, PartFailure::Plan(error), graph),
        }
    }

    /// Take a part out of the run, with all that it holds.
    fn end(&mut self, number: PartId, graph: &mut GraphEdit<'_>) -> Option<Part<S::Planner>> {
        self.sharing.release_all(number, graph.graph());
        self.active.remove(&number)
    }

    fn give_up(&mut self, number: PartId, failure: PartFailure, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.end(number, graph).map_or(Ok(()), |part| self.parts.failed(part, failure))
    }

    fn tell(
        &mut self,
        number: PartId,
        node: NodeId,
        output: &Blob,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        self.sharing.told(number, node);
        self.advance(number, graph, |planner, graph| planner.completed(node, output, graph))
    }

    /// Tell planners of nodes that were complete before they asked for them.
    fn tell_late(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        while let Some((number, node)) = self.sharing.next_late() {
            // It is there: the part holds it.
            if let Some(output) = graph.output(node).cloned() {
                self.tell(number, node, &output, graph)?;
            }
        }
        Ok(())
    }
}

impl<S: Parts> Planner for Many<S> {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.go_on(graph)
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        for number in self.sharing.end(node) {
            self.tell(number, node, output, graph)?;
        }
        self.tell_late(graph)?;
        self.go_on(graph)
    }

    fn failed(&mut self, node: NodeId, reason: &FailureReason, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let (kind, label) = graph.spec(node).map(|spec| (spec.kind.clone(), spec.label.clone())).unwrap_or_default();
        for number in self.sharing.end(node) {
            let (kind, label) = (kind.clone(), split_label(&label).1.to_owned());
            self.give_up(number, PartFailure::Node { kind, label, reason: reason.clone() }, graph)?;
        }
        self.go_on(graph)
    }

    /// The next part may be there, or one has become safe.
    fn look_again(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.go_on(graph)
    }

    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        self.active.get(&spec.priority).is_none_or(|part| part.planner.is_verified_by_repetition(spec))
    }
}

#[cfg(test)]
mod tests;
