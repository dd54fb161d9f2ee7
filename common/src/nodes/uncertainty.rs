//! `uncertainty`: how well the photo determines the parameters of the match.

use super::view::Scene;
use crate::{
    fit::{self, Known, Ranges, Standing},
    graph::{Blob, NodeFailure, NodeType, RunContext},
    nodes::wire::{check_parameters, read, write},
};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct UncertaintyParameters {
    pub(crate) model: String,
    pub(crate) ranges: Ranges,
    pub(crate) point: Vec<f64>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct UncertaintyWire {
    /// For every entry of the flat parameter vector the smallest and the largest value, and the number of its standing.
    pub(crate) entries: Vec<(f64, f64, u8)>,
    pub(crate) trades: Vec<(u32, u32)>,
}

/// The standings in the order of their numbers.
const STANDINGS: [Standing; 4] = [Standing::Determined, Standing::AtBound, Standing::Undetermined, Standing::Held];

impl UncertaintyWire {
    fn of(found: &fit::Uncertainty) -> Self {
        let number = |of: Standing| match of {
            Standing::Determined => 0,
            Standing::AtBound => 1,
            Standing::Undetermined => 2,
            Standing::Held => 3,
        };
        let index = |i: usize| u32::try_from(i).unwrap_or(u32::MAX);
        let entries = found.entries.iter().map(|known| (known.low, known.high, number(known.standing)));
        let trades = found.trades.iter().map(|&(a, b)| (index(a), index(b)));
        Self { entries: entries.collect(), trades: trades.collect() }
    }

    /// What was found; `None` if the numbers cannot be that.
    pub(crate) fn uncertainty(self) -> Option<fit::Uncertainty> {
        let known = |(low, high, number): (f64, f64, u8)| {
            let standing = *STANDINGS.get(usize::from(number))?;
            (low <= high && (high - low).is_finite()).then_some(Known { low, high, standing })
        };
        let entries = self.entries.into_iter().map(known).collect::<Option<Vec<_>>>()?;
        let mut trades: Vec<(usize, usize)> = Vec::new();
        for (a, b) in self.trades {
            let pair = (a as usize, b as usize);
            if pair.0 >= pair.1 || pair.1 >= entries.len() || trades.contains(&pair) {
                return None;
            }
            trades.push(pair);
        }
        Some(fit::Uncertainty { entries, trades })
    }
}

#[derive(Debug)]
pub(super) struct Uncertainty;

impl NodeType for Uncertainty {
    fn kind(&self) -> &'static str {
        super::UNCERTAINTY
    }

    fn run(&self, parameters: &[u8], inputs: &[Blob], context: &RunContext) -> Result<Vec<u8>, NodeFailure> {
        let UncertaintyParameters { model, ranges, point } = read("parameters of uncertainty", parameters)?;
        let scene = Scene::read(&model, inputs, context)?;
        ranges.check(scene.model).map_err(|error| NodeFailure::new(error.to_string()))?;
        check_parameters("point", scene.model, &point)?;
        let searching = scene.view.searching()?;
        let (judges, is_cancelled) = (scene.view.judges(&searching), || context.is_cancelled());
        let found = fit::uncertainty::uncertainty(&scene.full(), judges, (&ranges, &point), &is_cancelled);
        // A cancelled search has no result.
        context.check()?;
        let found = found.map_err(|error| NodeFailure::new(format!("uncertainty: {error}")))?;
        write("uncertainty", &UncertaintyWire::of(&found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_worker_sends_is_ranges_and_distinct_pairs() {
        let wire = |low: f64, high: f64, number: u8, trades: &[(u32, u32)]| UncertaintyWire {
            entries: vec![(low, high, number); 3],
            trades: trades.to_vec(),
        };
        let sent = wire(0.1, 0.2, 2, &[(0, 2), (1, 2)]).uncertainty().unwrap();
        assert_eq!(UncertaintyWire::of(&sent).uncertainty(), Some(sent));
        for bad in [
            wire(0.2, 0.1, 0, &[]),
            wire(0.1, f64::NAN, 0, &[]),
            wire(0.1, f64::INFINITY, 0, &[]),
            wire(0.1, 0.2, 4, &[]),
            wire(0.1, 0.2, 0, &[(1, 3)]),
            wire(0.1, 0.2, 0, &[(1, 1)]),
            wire(0.1, 0.2, 0, &[(0, 1), (0, 1)]),
        ] {
            assert_eq!(bad.uncertainty(), None);
        }
    }
}
