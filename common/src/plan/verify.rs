//! Checks of the outputs of nodes, which may have run on a worker. A shard of a transport table must have the requested shape and
//! finite values (only a second computation can tell whether the values are right). The cost of every candidate is computed again
//! here, on the table that its search read (design section 8). The cost is a pure function of the table and the parameters, so it
//! must be equal bit for bit; one evaluation costs a thousandth of a search. Scores and parameters must be within their ranges,
//! pictures finite.

use super::encode::other;
use crate::{
    brdf::{Model, lobe_terms},
    fit::{Candidate, Known, Method, Objective, Polished, Uncertainty},
    graph::{Blob, GraphEdit, Input, NodeFailure, NodeId, PlanError},
    metric::Blocks,
    nodes::{
        ExploredWire, UncertaintyWire, joined,
        wire::{PolishedWire, ScoresWire, TableWire, read},
    },
    render::{spans::LobeKnots, table::TransportTable},
};
use std::{
    collections::{BTreeMap, btree_map::Entry},
    fmt::Display,
};

/// Which table of a pixel subset: the number of the subset, and whether it has the sharp lobes.
pub(super) type SubsetTable = (usize, bool);

/// The decoded tables of pixel subsets.
#[derive(Debug, Default)]
pub(super) struct SubsetTables(BTreeMap<SubsetTable, TransportTable>);

impl SubsetTables {
    /// A table from its shards.
    pub(super) fn get(
        &mut self,
        which: SubsetTable,
        shards: &[Input],
        model: &dyn Model,
        graph: &GraphEdit<'_>,
    ) -> Result<&TransportTable, PlanError> {
        Ok(match self.0.entry(which) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(unknown) => unknown.insert(table_of(model, shards, graph)?),
        })
    }

    /// Drops a table.
    pub(super) fn forget(&mut self, which: SubsetTable) {
        self.0.remove(&which);
    }
}

fn table_of(model: &dyn Model, shards: &[Input], graph: &GraphEdit<'_>) -> Result<TransportTable, PlanError> {
    let shard = |shard: NodeId| {
        let blob = graph.output(shard);
        read::<TableWire>("transport table", blob.ok_or_else(missing)?).and_then(TableWire::table).map_err(other)
    };
    let shards = shards.iter().filter_map(Input::node).map(shard).collect::<Result<Vec<_>, _>>()?;
    joined(model, &shards.iter().collect::<Vec<_>>()).map_err(other)
}

/// A shard of a transport table, as it was requested.
#[derive(Debug, Clone)]
pub(super) struct Shard {
    /// Number of pixels.
    pub(super) pixels: usize,
    /// The lobes with their widths.
    pub(super) lobes: Vec<LobeKnots>,
}

/// Refuses a shard of a transport table that is not the one that was requested.
pub(super) fn check_shard(asked: &Shard, output: &Blob) -> Result<(), PlanError> {
    let table = read::<TableWire>("transport table", output)
        .and_then(TableWire::table)
        .map_err(|failure| wrong("a transport table", &failure))?;
    if table.pixels != asked.pixels {
        return Err(wrong(format!("{} pixels", asked.pixels), &table.pixels));
    }
    let names = |lobes: &mut dyn Iterator<Item = (&str, usize)>| {
        lobes.map(|(name, terms)| format!("{name} ({terms})")).collect::<Vec<_>>().join(", ")
    };
    let expected = names(&mut asked.lobes.iter().map(|asked| (asked.lobe.name(), lobe_terms(asked.lobe))));
    let found = names(&mut table.lobes.iter().map(|lobe| (&*lobe.lobe, lobe.terms)));
    if expected != found {
        return Err(wrong(format!("a transport table of the lobes (and terms) {expected}"), &found));
    }
    for (lobe, asked) in table.lobes.iter().zip(&asked.lobes) {
        if lobe.knots != asked.knots {
            return Err(wrong(format!("widths on {:?}", asked.knots), &format!("{:?}", lobe.knots)));
        }
    }
    match table.lobes.iter().flat_map(|lobe| &lobe.values).find(|value| !value.is_finite()) {
        Some(value) => Err(wrong("finite radiance", value)),
        None => Ok(()),
    }
}

/// The scores of `count` candidates: over the whole image, over the object.
pub(super) fn scores(output: &Blob, count: usize) -> Result<Vec<(f64, f64)>, PlanError> {
    let ScoresWire(scores) = read("scores", output).map_err(|failure| wrong("scores", &failure))?;
    if scores.len() != count {
        return Err(wrong(format!("{count} scores"), &scores.len()));
    }
    scores.iter().try_for_each(|(image, object)| check_score(*image).and_then(|()| check_score(*object)))?;
    Ok(scores)
}

/// The outcome of a search on the score with at most `most` evaluations.
pub(super) fn polished(model: &dyn Model, output: &Blob, most: usize) -> Result<Polished, PlanError> {
    checked(model, read("polish", output), most)
}

fn checked(model: &dyn Model, wire: Result<PolishedWire, NodeFailure>, most: usize) -> Result<Polished, PlanError> {
    let polished = wire.and_then(|wire| wire.polished(model));
    let polished = polished.map_err(|failure| wrong("parameters with their scores", &failure))?;
    check_score(polished.cssim)?;
    check_score(polished.cssim_object)?;
    if polished.evaluations > most {
        return Err(wrong(format!("at most {most} evaluations"), &polished.evaluations));
    }
    Ok(polished)
}

/// The outcome of an exploration with at most `most` evaluations, and the windows of its picture.
pub(super) fn explored(method: &Method, output: &Blob, most: usize) -> Result<(Polished, Blocks), PlanError> {
    let ExploredWire { found, blocks } = read("explore", output).map_err(|failure| wrong("a lobe", &failure))?;
    let count = blocks.len();
    let blocks = Blocks::from_parts(blocks).ok_or_else(|| wrong("the windows in blocks", &count))?;
    let found = checked(method.model, Ok(found), most)?;
    check_blocks(&blocks, method.judge.pick(found.cssim, found.cssim_object))?;
    Ok((found, blocks))
}

/// How well the photo determines the parameters `point`.
pub(super) fn uncertainty(method: &Method, output: &Blob, point: &[f64]) -> Result<Uncertainty, PlanError> {
    let wire: UncertaintyWire =
        read("uncertainty", output).map_err(|failure| wrong("ranges of parameters", &failure))?;
    let sent = format!("{wire:?}");
    let found = wire.uncertainty().ok_or_else(|| wrong("ranges of parameters", &sent))?;
    let (lower, upper) = method.ranges.bounds(method.model);
    let is_around = |(i, known): (usize, &Known)| {
        lower[i] <= known.low && known.low <= point[i] && point[i] <= known.high && known.high <= upper[i]
    };
    if found.entries.len() != point.len() || !found.entries.iter().enumerate().all(is_around) {
        return Err(wrong(format!("ranges around {point:?}"), &format!("{:?}", found.entries)));
    }
    Ok(found)
}

/// Refuses windows that do not have the score of their picture.
pub(super) fn check_blocks(blocks: &Blocks, score: f64) -> Result<(), PlanError> {
    // The sums are taken in another order.
    const EQUAL: f64 = 1e-6;
    let of_blocks = blocks.cssim();
    if (of_blocks - score).abs() <= EQUAL {
        Ok(())
    } else {
        Err(wrong(format!("windows of score {score}"), &of_blocks))
    }
}

/// Refuses parameters outside the ranges of the fit.
pub(super) fn check_ranges(method: &Method, parameters: &[f64]) -> Result<(), PlanError> {
    let is_inside = method.ranges.contain(method.model, parameters);
    if is_inside { Ok(()) } else { Err(wrong("parameters within their ranges", &format!("{parameters:?}"))) }
}

/// Refuses a score or a cost that is negative or not finite.
pub(super) fn check_score(score: f64) -> Result<(), PlanError> {
    if score.is_finite() && score >= 0.0 { Ok(()) } else { Err(wrong("a score at or above 0", &score)) }
}

/// The error for an output that its node cannot have.
pub(super) fn wrong(expected: impl Into<String>, found: &dyn Display) -> PlanError {
    PlanError::WrongOutput { expected: expected.into(), found: found.to_string() }
}

fn missing() -> PlanError {
    PlanError::new("the table of a finished search is missing: a bug in the plan, please report it")
}

/// Refuses a candidate whose cost differs from the cost at its parameters.
pub(super) fn check_cost(candidate: &Candidate, objective: &mut Objective<'_>) -> Result<(), PlanError> {
    let (claimed, recomputed) = (candidate.cost, objective.cost(&candidate.parameters));
    if claimed.to_bits() == recomputed.to_bits() {
        return Ok(());
    }
    Err(PlanError::NotVerified { what: format!("the cost of gamma {}", candidate.gamma), claimed, recomputed })
}
