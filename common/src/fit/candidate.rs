//! Candidates of stage one; which of them are nearly equal, and which widths their full-resolution table must span.

use super::ranges::Ranges;
use crate::{
    brdf::{Model, Scale, Width, flat_bounds, lit_lobes, main_lobe},
    math::elementary::ln,
    search::Termination,
};

/// The outcome of one search.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The gamma of the search.
    pub gamma: f64,
    /// Which pixel subset, from 0.
    pub subset: u32,
    /// Flat parameter vector.
    pub parameters: Vec<f64>,
    /// The value of Eq. 1 at the parameters.
    pub cost: f64,
    /// Evaluations of Eq. 1, including the scan; a start counts once.
    pub evaluations: usize,
    /// Why the search ended.
    pub termination: Termination,
}

/// Candidates that differ in every parameter by at most this share of its range share one rendering. The range is that of the logarithm
/// for parameters that are searched by their logarithm.
pub const SAME: f64 = 1e-6;

/// For every candidate the index of the first one that is the same within [`SAME`]: near-equal candidates are judged once.
#[must_use]
pub fn distinct(model: &dyn Model, candidates: &[Candidate]) -> Vec<usize> {
    let (lower, upper) = flat_bounds(model.parameters());
    let scales = model.parameters().iter().flat_map(|p| std::iter::repeat_n(p.scale, p.channels.count()));
    let logarithmic: Vec<bool> = scales.map(|scale| scale == Scale::Logarithmic).collect();
    let near = |a: &[f64], b: &[f64]| {
        (0..a.len()).all(|i| {
            let [a, b, l, u] = [a[i], b[i], lower[i], upper[i]].map(|x| if logarithmic[i] { ln(x) } else { x });
            (a - b).abs() <= SAME * (u - l)
        })
    };
    let mut firsts: Vec<usize> = Vec::with_capacity(candidates.len());
    for (i, candidate) in candidates.iter().enumerate() {
        let same = (0..i).find(|&j| firsts[j] == j && near(&candidates[j].parameters, &candidate.parameters));
        firsts.push(same.unwrap_or(i));
    }
    firsts
}

/// Margin around the candidates' widths that full-resolution tables cover (design section 7).
const MARGIN: f64 = 1.25;

/// The span of widths of the main lobe that a full-resolution table needs for these parameter vectors: 25 % beyond the outermost widths,
/// within the model's bounds, and at least a ratio of 1.25^2.
///
/// Returns `None` for a model without widths.
#[must_use]
pub fn needed_span<'a>(
    model: &dyn Model,
    ranges: &Ranges,
    points: impl Iterator<Item = &'a [f64]>,
) -> Option<(f64, f64)> {
    let (lower, upper) = whole_span(model)?;
    let (low, high) = widths(model, ranges, points)?;
    let (low, high) = ((low / MARGIN).max(lower), (high * MARGIN).min(upper));
    // At a bound the margin lies on one side only.
    let (low, high) = (low.min(upper / (MARGIN * MARGIN)), high.max(lower * MARGIN * MARGIN));
    Some((low, high))
}

/// Smallest and largest width that the main lobe of a model can have, in any of its places.
pub(crate) fn whole_span(model: &dyn Model) -> Option<(f64, f64)> {
    let whole = main_places(model).map(|(_, width)| width.span(model.parameters()));
    whole.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

/// Smallest and largest width of the main lobe at these parameter vectors. If the model has the lobe twice, both count, the second one
/// unless it is dark.
pub(crate) fn widths<'a>(
    model: &dyn Model,
    ranges: &Ranges,
    points: impl Iterator<Item = &'a [f64]>,
) -> Option<(f64, f64)> {
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for point in points {
        let is_lit = lit_lobes(model, point);
        for (_, width) in main_places(model).filter(|(l, width)| is_lit[*l] || width.widened_by.is_none()) {
            low = low.min(width.at(point));
            high = high.max(width.at(point));
        }
    }
    // Polish moves the entry that widens a lobe to where the lobe is in the table, which it cannot if the entry has a range.
    let is_restricted = |width: &Width| width.widened_by.is_some_and(|t| ranges.restrict(model, t));
    for (_, width) in main_places(model).filter(|(_, width)| is_restricted(width)) {
        high = high.max(width.span(model.parameters()).1);
    }
    (low <= high).then_some((low, high))
}

/// The basis lobes with the function of the main lobe: their index and width.
fn main_places(model: &dyn Model) -> impl Iterator<Item = (usize, Width)> {
    let main = main_lobe(model).map(|(basis, _)| basis.lobe.name());
    let places = model.lobes().iter().enumerate().filter(move |(_, basis)| Some(basis.lobe.name()) == main);
    places.filter_map(|(l, basis)| Some((l, basis.width?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{BlinnPhong, Ggx, GgxHaze};

    fn candidate(alpha: f64) -> Candidate {
        let parameters = vec![0.1, 0.2, 0.3, 0.04, 0.04, 0.04, 1.0, alpha];
        let termination = Termination::GradientTolerance;
        Candidate { gamma: 1.0, subset: 0, parameters, cost: 1.0, evaluations: 1, termination }
    }

    #[test]
    fn near_equal_candidates_are_judged_once_and_compared_with_the_first() {
        let step = 0.9e-6;
        let candidates: Vec<Candidate> = (0..4).map(|i| candidate(0.2 + step * f64::from(i))).collect();
        assert_eq!(distinct(&Ggx, &candidates), [0, 0, 2, 2]);
    }

    #[test]
    fn the_span_has_its_margin_and_stays_inside_the_bounds() {
        let span = |alphas: &[f64]| {
            let points: Vec<Candidate> = alphas.iter().map(|&a| candidate(a)).collect();
            needed_span(&Ggx, &Ranges::default(), points.iter().map(|c| &c.parameters[..])).unwrap()
        };
        assert_eq!(span(&[0.1, 0.2]), (0.1 / 1.25, 0.2 * 1.25));
        assert_eq!(span(&[0.005]), (0.005, 0.005 * 1.25 * 1.25));
        assert_eq!(span(&[1.0]), (1.0 / (1.25 * 1.25), 1.0));
    }

    #[test]
    fn the_margin_is_a_ratio_of_widths_for_exponents_too() {
        let alpha = |n: f64| (2.0 / (n + 2.0)).sqrt();
        let point = |n: f64| vec![0.1, 0.2, 0.3, 0.04, 0.04, 0.04, n];
        let span =
            |points: &[Vec<f64>]| needed_span(&BlinnPhong, &Ranges::default(), points.iter().map(|p| &p[..])).unwrap();
        assert_eq!(span(&[point(40.0), point(400.0)]), (alpha(400.0) / 1.25, alpha(40.0) * 1.25));
        assert_eq!(span(&[point(1e5)]), (alpha(1e5), alpha(1e5) * 1.25 * 1.25));
        assert_eq!(span(&[point(1.0)]), (alpha(1.0) / (1.25 * 1.25), alpha(1.0)));
    }

    #[test]
    fn the_span_holds_both_widths_of_a_lobe_and_all_that_a_held_tail_may_have() {
        let point = [0.1, 0.2, 0.3, 0.04, 0.04, 0.04, 1.0, 0.04, 0.2, 0.5];
        let span = |ranges: &Ranges| needed_span(&GgxHaze, ranges, std::iter::once(&point[..])).unwrap();
        let (low, high) = span(&Ranges::default());
        assert!((low - 0.032).abs() < 1e-12 && (high - 0.25).abs() < 1e-12, "{low} {high}");
        let mut held = Ranges::default();
        held.hold(&GgxHaze, "t", &[0.5]).unwrap();
        assert_eq!(span(&held).1, 1.0);
    }

    #[test]
    fn exponents_are_compared_by_their_logarithm() {
        let with = |n: f64| Candidate { parameters: vec![0.1, 0.2, 0.3, 0.04, 0.04, 0.04, n], ..candidate(0.1) };
        assert_eq!(distinct(&BlinnPhong, &[with(5.0), with(5.05), with(9e4), with(9e4 + 0.1)]), [0, 1, 2, 2]);
    }
}
