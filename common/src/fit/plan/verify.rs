//! Trust in the searches of workers: the cost of every candidate is computed again, here, on the table that its search read
//! (design section 8). The cost is a pure function of the table and the parameters, so it has to be the same to the bit; one
//! evaluation costs a thousandth of a search.

use super::other;
use crate::{
    brdf::Model,
    fit::{
        Candidate, Objective,
        nodes::joined,
        wire::{TableWire, read},
    },
    graph::{GraphEdit, Input, NodeId, PlanError},
    render::table::TransportTable,
};
use std::collections::{BTreeMap, btree_map::Entry};

/// The decoded tables of pixel subsets, by the number of the subset.
#[derive(Debug, Default)]
pub(super) struct SubsetTables(BTreeMap<usize, TransportTable>);

impl SubsetTables {
    /// The table of subset `s`, which the node `search` reads: its inputs but the first are the shards.
    pub(super) fn get(
        &mut self,
        s: usize,
        model: &dyn Model,
        search: NodeId,
        graph: &GraphEdit<'_>,
    ) -> Result<&TransportTable, PlanError> {
        Ok(match self.0.entry(s) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(unknown) => unknown.insert(table_of(model, search, graph)?),
        })
    }

    /// Lets the table of subset `s` go.
    pub(super) fn forget(&mut self, s: usize) {
        self.0.remove(&s);
    }
}

fn table_of(model: &dyn Model, search: NodeId, graph: &GraphEdit<'_>) -> Result<TransportTable, PlanError> {
    let inputs = &graph.spec(search).ok_or_else(missing)?.inputs;
    let shard = |input: &Input| {
        let blob = match *input {
            Input::Blob(hash) => graph.blob(hash),
            Input::OutputOf(node) => graph.output(node),
        };
        read::<TableWire>("transport table", blob.ok_or_else(missing)?).and_then(TableWire::table).map_err(other)
    };
    let shards = inputs.iter().skip(1).map(shard).collect::<Result<Vec<_>, _>>()?;
    joined(model, &shards.iter().collect::<Vec<_>>()).map_err(other)
}

fn missing() -> PlanError {
    PlanError::new("a search has finished whose table is not there: a mistake in the plan, please report it")
}

/// Refuses a candidate whose cost is not the one that its parameters have.
pub(super) fn check_cost(candidate: &Candidate, objective: &mut Objective<'_>) -> Result<(), PlanError> {
    let (claimed, recomputed) = (candidate.cost, objective.cost(&candidate.parameters));
    if claimed.to_bits() == recomputed.to_bits() {
        return Ok(());
    }
    Err(PlanError::NotVerified { what: format!("the cost of gamma {}", candidate.gamma), claimed, recomputed })
}
