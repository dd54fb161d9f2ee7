//! How well the photo determines each parameter of a candidate.
//!
//! A candidate minimises Eq. 1, a weighted sum of squares whose residuals are the noise of the photo and what the model cannot
//! express. Its weights say how pixels were drawn, not how precise they are, so `s^2 (J^T W J)^-1` would be wrong, and the
//! standard errors come from the sandwich ([`Sandwich`]): `A^-1 B A^-1` with `A = sum_p w_p J_p^T J_p` and
//! `B = sum_p (w_p J_p^T r_p)(w_p J_p^T r_p)^T`, `J_p` the derivatives of the three compressed channels of pixel p by the
//! parameters at the candidate's gamma, `r_p` their residuals. The channels of a pixel err together; pixels are independent draws.
//! (A pixel that was drawn twice counts as one of twice the weight, which is a little too cautious.)
//!
//! Parameters at a bound are held there while the others are judged. Whether the bound means anything is asked for each of them by
//! itself: where the data would not hold it in place if it were free, it is not determined either. (The width of a highlight that is
//! not there drifts to an end of its range.) What this is not: an error by light
//! or geometry that is not what it is said to be.

use super::{method::SearchKind, objective::Objective, stage_one::search_bounds};
use crate::{
    brdf::Model,
    search::{NormalEquations, Sandwich, SearchError, least_squares::LeastSquaresProblem},
};

/// What the photo says of one entry of the flat parameter vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Uncertainty {
    /// The parameter is known to this standard error, in its own unit.
    StandardError(f64),
    /// The parameter is at its lower or upper bound, and the photo holds it there.
    AtBound,
    /// Much of the parameter's range matches the photo as well.
    Undetermined,
}

/// A parameter counts as undetermined when its standard error is beyond this share of its range (of the range's logarithm for
/// widths): the values within two standard errors are then half of all that the model allows.
pub const LARGEST_SHARE: f64 = 0.125;

/// Nearer to a bound than this share of the range is at the bound: a pattern search ends within its last mesh of it.
const AT_BOUND: f64 = 1e-5;

/// The uncertainty of every entry of the flat vector `point`, a minimum of `objective`.
///
/// # Errors
/// When the model's bounds make no box.
pub(super) fn uncertainties(
    model: &dyn Model,
    objective: &mut Objective<'_>,
    point: &[f64],
) -> Result<Vec<Uncertainty>, SearchError> {
    let bounds = search_bounds(model, SearchKind::LeastSquares)?;
    let is_inside = |i: usize| {
        let t = bounds.to_scaled(i, point[i]);
        (AT_BOUND..=1.0 - AT_BOUND).contains(&t)
    };
    let inside: Vec<bool> = (0..point.len()).map(is_inside).collect();
    // One for the parameters inside, and one for each at its bound: what if it alone were free as well?
    let mut freed = vec![inside.clone()];
    for i in (0..point.len()).filter(|&i| !inside[i]) {
        freed.push((0..point.len()).map(|j| inside[j] || j == i).collect());
    }
    let errors = standard_errors(objective, point, &freed);
    let mut of_bounds = errors[1..].iter();
    let judged = (0..point.len()).map(|i| {
        let errors = if inside[i] { Some(&errors[0]) } else { of_bounds.next() };
        let error = errors.map_or(f64::INFINITY, |errors| errors[i]);
        let share = error / bounds.scaled_derivative(i, point[i]);
        match share <= LARGEST_SHARE {
            true if inside[i] => Uncertainty::StandardError(error),
            true => Uncertainty::AtBound,
            // Also where the share is not a number.
            false => Uncertainty::Undetermined,
        }
    });
    Ok(judged.collect())
}

/// The standard errors of all parameters for each set of free ones; 0 where not free.
fn standard_errors(objective: &mut Objective<'_>, point: &[f64], freed: &[Vec<bool>]) -> Vec<Vec<f64>> {
    let mut normal = NormalEquations::new(point.len());
    objective.linearise(point, &mut normal);
    let mut sandwiches: Vec<Sandwich> = freed.iter().map(|free| Sandwich::new(&normal, free)).collect();
    let mut pixel = 0;
    objective.rows(point, &mut |p, row, residual| {
        if p != pixel {
            sandwiches.iter_mut().for_each(Sandwich::close_group);
            pixel = p;
        }
        sandwiches.iter_mut().for_each(|sandwich| sandwich.add_row(row, residual));
    });
    sandwiches.iter_mut().for_each(Sandwich::close_group);
    let spread = |(sandwich, free): (&Sandwich, &Vec<bool>)| {
        let mut variances = sandwich.variances().into_iter();
        let error = |&free: &bool| if free { variances.next().map_or(f64::INFINITY, f64::sqrt) } else { 0.0 };
        free.iter().map(error).collect()
    };
    sandwiches.iter().zip(freed).map(spread).collect()
}
