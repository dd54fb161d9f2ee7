//! What a survey finds out about a given point, as the output of a worker that is checked.

use super::verify::{check_score, wrong};
use crate::{
    graph::{Blob, PlanError},
    nodes::{AppraisedWire, wire::read},
};

/// What is known of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Appraisal {
    /// CSSIM over the whole image.
    pub cssim: f64,
    /// CSSIM over windows centred on the object.
    pub cssim_object: f64,
    /// Eq. 1 over all pixels that the object covers wholly, for each gamma.
    pub costs: Vec<f64>,
}

/// The appraisals of so many points, for so many gammas.
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
