//! Transport tables of a fit: the size of their shards, and the widths that they span.

use crate::{
    brdf::{Model, lobe_terms, term_count},
    fit::{Integration, Method, Start, explore::span_of_lobes},
    math::Rgb,
    render::knots::{Knots, PER_OCTAVE},
};

/// Smallest and largest width of a table.
pub(super) type Span = Option<(f64, f64)>;

/// Pixels per shard of a subset's table: small enough to spread over several workers.
pub(super) const SUBSET_SHARD: usize = 32;

/// Above this number of pixels, a subset's table has shards of [`LARGE_SHARD`].
pub(super) const LARGE_SUBSET: usize = 4096;

/// Pixels per shard of a large subset's table.
pub(super) const LARGE_SHARD: usize = 2048;

/// Pixels per shard of the full-resolution table: large enough that few nodes of a grid of normals serve the pixels of two shards.
pub(super) const FULL_SHARD: usize = 4096;

/// Pixels per shard of the coarse picture's table: small enough to spread over several workers.
pub(super) const COARSE_SHARD: usize = 2048;

/// Knots per factor of two of width in full-resolution tables (design section 7: at least 5).
pub(super) const FULL_PER_OCTAVE: f64 = 5.0;

/// The sharpest main lobe of the first table of stage one, as a width of GGX. Lobes that are narrower than a pixel's reflection need most of the
/// time of a table over the whole range, and few materials have them.
const SHARP: f64 = 0.02;

/// A candidate whose lobe is narrower than this asks for a table over the whole range.
const NEAR_SHARP: f64 = 1.5 * SHARP;

/// The grid of widths of stage one: the model's whole range, or the part of it without sharp lobes.
pub(super) fn stage_one_knots(method: &Method, whole: bool) -> Knots {
    let blurred = span_of_lobes(method.model, SHARP).filter(|_| !whole);
    let (low, high) = blurred.or(whole_span(method.model)).unwrap_or((0.5, 1.0));
    Knots::covering(low, high, PER_OCTAVE)
}

/// Whether stage one may begin without sharp lobes: the scan looks for the width over the whole table, and `--fix` and `--bounds` allow
/// others.
pub(super) fn may_begin_blurred(method: &Method) -> bool {
    // A range without wider lobes than these would always ask for the whole table.
    let useful = span_of_lobes(method.model, NEAR_SHARP).zip(widest(method));
    method.start == Start::Scan
        && method.integration == Integration::Tables
        && span_of_lobes(method.model, SHARP) != whole_span(method.model)
        && useful.is_none_or(|((low, _), widest)| low < widest)
}

/// The largest width that the ranges of the parameters allow.
fn widest(method: &Method) -> Option<f64> {
    let width = method.model.lobes().iter().find_map(|basis| basis.width)?;
    let (lower, upper) = method.ranges.bounds(method.model);
    // A width may grow or fall with its parameter.
    Some(width.at(&lower).max(width.at(&upper)))
}

/// Whether a table without sharp lobes may be too narrow for a candidate.
pub(super) fn is_nearly_sharp(model: &dyn Model, parameters: &[f64]) -> bool {
    let Some(place) = model.lobes().iter().position(|basis| basis.width.is_some()) else { return false };
    let (before, main) = (&model.lobes()[..place], &model.lobes()[place]);
    let mut weights = vec![Rgb::ZERO; term_count(model)];
    model.weights(parameters, &mut weights);
    let first: usize = before.iter().map(|basis| lobe_terms(basis.lobe)).sum();
    // The width of a dark lobe means nothing.
    let is_lit = weights[first..first + lobe_terms(main.lobe)].iter().any(|weight| *weight != Rgb::ZERO);
    let alpha = main.width_at(parameters).and_then(|width| main.lobe.equivalent_alpha(width));
    is_lit && alpha.is_some_and(|alpha| alpha < NEAR_SHARP)
}

/// The model's whole range of widths; `None` for a model without widths.
pub(super) fn whole_span(model: &dyn Model) -> Span {
    let width = model.lobes().iter().find_map(|b| b.width)?;
    Some(width.span(model.parameters()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Ggx, MODELS, flat_bounds};

    #[test]
    fn every_model_begins_without_sharp_lobes_and_asks_for_them_near_the_edge() {
        for model in MODELS {
            let method = Method { model: *model, ..Method::default() };
            assert!(may_begin_blurred(&method), "{}", model.name());
            let [whole, blurred] = [true, false].map(|whole| stage_one_knots(&method, whole));
            assert!(blurred.count() < whole.count(), "{}", model.name());
            let width = model.lobes().iter().find_map(|basis| basis.width).unwrap();
            let (_, upper) = flat_bounds(model.parameters());
            let with_width = |x: f64| {
                let mut parameters = upper.clone();
                parameters[width.entry] = (width.inverse)(x);
                parameters
            };
            let (low, high) = blurred.span();
            assert!(is_nearly_sharp(*model, &with_width(low)), "{}", model.name());
            assert!(!is_nearly_sharp(*model, &with_width(0.9 * high)), "{}", model.name());
        }
        let paper = Method { start: Start::Paper, ..Method::default() };
        assert!(!may_begin_blurred(&paper));
    }

    #[test]
    fn table_has_the_widths_that_are_held() {
        for (model, name, sharp, wide) in [("ggx", "alpha", 0.025, 0.05), ("blinn-phong", "n", 20_000.0, 100.0)] {
            let begins_blurred = |value: f64| {
                let mut method = Method { model: crate::brdf::model(model).unwrap(), ..Method::default() };
                method.ranges.hold(method.model, name, &[value]).unwrap();
                may_begin_blurred(&method)
            };
            assert!(!begins_blurred(sharp) && begins_blurred(wide), "{model}");
        }
    }

    #[test]
    fn dark_lobe_does_not_ask_for_sharp_widths() {
        let model = crate::brdf::model("ward").unwrap();
        let parameters: Vec<f64> = model
            .parameters()
            .iter()
            .flat_map(|p| std::iter::repeat_n(if p.name == "kd" { 0.5 } else { p.lower }, p.channels.count()))
            .collect();
        assert!(!is_nearly_sharp(model, &parameters), "{parameters:?}");
        assert!(is_nearly_sharp(&Ggx, &[0.5, 0.5, 0.5, 0.04, 0.04, 0.04, 1.0, 0.01]));
    }
}
