//! How well the photo determines each parameter of a candidate.
//!
//! A candidate minimises Eq. 1, a weighted sum of squares whose residuals are the noise of the photo and the error of the model. Its
//! weights are those of the sampling, not of the precision of pixels, so `s^2 (J^T W J)^-1` would be wrong. The standard errors come
//! from the sandwich estimator ([`Sandwich`]): `A^-1 B A^-1` with `A = sum_p w_p J_p^T J_p` and
//! `B = sum_p (w_p J_p^T r_p)(w_p J_p^T r_p)^T`, `J_p` the derivatives of the three compressed channels of pixel p with
//! respect to the parameters at the candidate's gamma, `r_p` their residuals. The errors of a pixel's channels are correlated; pixels are
//! independent draws. (A pixel that was drawn twice counts as one of twice the weight, which makes the errors slightly too large.)
//!
//! Parameters at a bound are held there while the others are judged. Each of them is then freed alone: if its standard error is too
//! large, it is undetermined, not at its bound. (Without a highlight, the width of the highlight drifts to an end of its range.)
//!
//! Derivatives at one point do not show that a parameter has an effect only if another one is not zero, such as the Fresnel reflectance
//! of a highlight whose strength may be zero within its error. So the test is repeated with each parameter moved by two standard errors
//! either way: a parameter that is undetermined at any of these points is undetermined.
//!
//! Not included: errors of the light and of the geometry.

use super::{method::SearchKind, objective::Objective, ranges::Ranges, stage_one::search_bounds};
use crate::{
    brdf::Model,
    search::{NormalEquations, Sandwich, SearchError, least_squares::LeastSquaresProblem},
};

/// How well the photo determines one entry of the flat parameter vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Uncertainty {
    /// The photo determines the parameter with this standard error, in the parameter's unit.
    StandardError(f64),
    /// The parameter is at its lower or upper bound, and would stay near it if it were free.
    AtBound,
    /// A large part of the parameter's range matches the photo equally well.
    Undetermined,
    /// The fit holds the parameter.
    Held,
}

impl Uncertainty {
    /// The standard error, if the parameter has one.
    fn standard_error(self) -> Option<f64> {
        match self {
            Self::StandardError(error) => Some(error),
            Self::AtBound | Self::Undetermined | Self::Held => None,
        }
    }
}

/// Distance from the minimum at which the test is repeated, in standard errors.
const REACH: f64 = 2.0;

/// A parameter counts as undetermined if its standard error is above this share of its range in the model (of the logarithmic range for widths): the
/// values within two standard errors are then half of the range.
pub const LARGEST_SHARE: f64 = 0.125;

/// A parameter nearer to a bound than this share of the range counts as at the bound: a pattern search ends within its last mesh size
/// of it.
const AT_BOUND: f64 = 1e-5;

/// The uncertainty of every entry of the flat vector `point`, a minimum of `objective`.
///
/// # Errors
/// If the model's bounds are not a valid box.
pub(crate) fn uncertainties(
    (model, ranges): (&dyn Model, &Ranges),
    objective: &mut Objective<'_>,
    point: &[f64],
) -> Result<Vec<Uncertainty>, SearchError> {
    let bounds = search_bounds(model, ranges, SearchKind::LeastSquares)?;
    // A narrower range of the search makes no value less certain.
    let of_model = search_bounds(model, &Ranges::default(), SearchKind::LeastSquares)?;
    let is_inside = |i: usize| {
        let t = bounds.to_scaled(i, point[i]);
        (AT_BOUND..=1.0 - AT_BOUND).contains(&t)
    };
    let inside: Vec<bool> = (0..point.len()).map(is_inside).collect();
    let is_held = |i: usize| bounds.lower()[i] == bounds.upper()[i];
    // One set of free parameters for those inside, and one more for each parameter at its bound, with that parameter free as well.
    let mut freed = vec![inside.clone()];
    for i in (0..point.len()).filter(|&i| !inside[i] && !is_held(i)) {
        freed.push((0..point.len()).map(|j| inside[j] || j == i).collect());
    }
    let residuals = residuals(objective, point);
    let mut judged_at = |place: &[f64]| {
        let errors = standard_errors(objective, place, &residuals, &freed);
        let mut of_bounds = errors[1..].iter();
        let judge = |i: usize| {
            if is_held(i) {
                return Uncertainty::Held;
            }
            let errors = if inside[i] { Some(&errors[0]) } else { of_bounds.next() };
            let error = errors.map_or(f64::INFINITY, |errors| errors[i]);
            let share = error / of_model.scaled_derivative(i, place[i]);
            match share <= LARGEST_SHARE {
                true if inside[i] => Uncertainty::StandardError(error),
                true => Uncertainty::AtBound,
                // Also if the share is not a number.
                false => Uncertainty::Undetermined,
            }
        };
        (0..place.len()).map(judge).collect::<Vec<_>>()
    };
    let here = judged_at(point);
    let mut judged = here.clone();
    for (i, error) in here.iter().enumerate().filter_map(|(i, u)| Some((i, u.standard_error()?))) {
        for reach in [-REACH, REACH] {
            let mut place = point.to_vec();
            place[i] += reach * error;
            bounds.clamp(&mut place);
            let there = judged_at(&place);
            let lost = (0..point.len()).filter(|&j| j != i && there[j] == Uncertainty::Undetermined);
            lost.for_each(|j| judged[j] = Uncertainty::Undetermined);
        }
    }
    Ok(judged)
}

/// The residuals of all rows.
fn residuals(objective: &mut Objective<'_>, point: &[f64]) -> Vec<f64> {
    let mut residuals = Vec::new();
    objective.rows(point, &mut |_, _, residual| residuals.push(residual));
    residuals
}

/// The standard errors of all parameters for each set of free ones (0 for the others), from the derivatives at `place` and the residuals
/// at the minimum.
fn standard_errors(
    objective: &mut Objective<'_>,
    place: &[f64],
    residuals: &[f64],
    freed: &[Vec<bool>],
) -> Vec<Vec<f64>> {
    let mut normal = NormalEquations::new(place.len());
    objective.linearise(place, &mut normal);
    let mut sandwiches: Vec<Sandwich> = freed.iter().map(|free| Sandwich::new(&normal, free)).collect();
    let mut pixel = 0;
    let mut residuals = residuals.iter();
    objective.rows(place, &mut |p, row, _| {
        if p != pixel {
            sandwiches.iter_mut().for_each(Sandwich::close_group);
            pixel = p;
        }
        // The rows come in the same order at every place.
        let residual = residuals.next().copied().unwrap_or(f64::NAN);
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
