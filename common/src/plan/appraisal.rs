//! The scores of a given parameter vector in a survey, and the check of a worker's output that holds them.

use super::verify::{check_score, wrong};
use crate::{
    graph::{Blob, PlanError},
    nodes::{AppraisedWire, wire::read},
};

/// The scores of a parameter vector.
#[derive(Debug, Clone, PartialEq)]
pub struct Appraisal {
    /// CSSIM over the whole image.
    pub cssim: f64,
    /// CSSIM over windows centred on the object.
    pub cssim_object: f64,
    /// Eq. 1 over all pixels that the object covers completely, for each gamma.
    pub costs: Vec<f64>,
}

/// The appraisals in an output, one per point, each with one cost per gamma.
pub(super) fn appraisals(output: &Blob, points: usize, gammas: usize) -> Result<Vec<Appraisal>, PlanError> {
    let AppraisedWire(appraised) = read("appraisals", output).map_err(|failure| wrong("appraisals", &failure))?;
    if appraised.len() != points {
        return Err(wrong(format!("{points} appraisals"), &appraised.len()));
    }
    let checked = |(cssim, cssim_object, costs): (f64, f64, Vec<f64>)| {
        check_score(cssim)?;
        check_score(cssim_object)?;
        if costs.len() != gammas {
            return Err(wrong(format!("{gammas} costs"), &costs.len()));
        }
        costs.iter().try_for_each(|cost| check_score(*cost))?;
        Ok(Appraisal { cssim, cssim_object, costs })
    };
    appraised.into_iter().map(checked).collect()
}
