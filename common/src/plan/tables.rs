//! Transport tables of a fit: the size of their shards, and the widths that they span.

use crate::{
    brdf::{Model, lit_lobes, main_lobe},
    fit::{Integration, Method, Start, explore::span_of_lobes},
    render::spans::Spans,
};

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

/// The widths of stage one: the model's whole range, or the part of it without sharp lobes.
pub(super) fn stage_one_spans(model: &dyn Model, whole: bool) -> Spans {
    Spans::of_model(model, span_of_lobes(model, SHARP).filter(|_| !whole))
}

/// What the tables of several models span together.
pub(super) fn joined(spans: impl Iterator<Item = Spans>) -> Spans {
    spans.reduce(|joined, spans| joined.joined(&spans)).unwrap_or_default()
}

/// Whether stage one may begin without sharp lobes: the scan looks for the width over the whole table, and `--fix` and `--bounds` allow
/// others.
pub(super) fn may_begin_blurred(method: &Method) -> bool {
    // A range without wider lobes than these would always ask for the whole table.
    let useful = span_of_lobes(method.model, NEAR_SHARP).zip(widest(method));
    method.start == Start::Scan
        && method.integration == Integration::Tables
        && stage_one_spans(method.model, false) != Spans::whole(method.model)
        && useful.is_none_or(|((low, _), widest)| low < widest)
}

/// The largest width that the ranges of the parameters allow.
fn widest(method: &Method) -> Option<f64> {
    let (lower, upper) = method.ranges.bounds(method.model);
    main_lobe(method.model).map(|(_, width)| width.span_of(&lower, &upper).1)
}

/// Whether a table without sharp lobes may be too narrow for a candidate.
pub(super) fn is_nearly_sharp(model: &dyn Model, parameters: &[f64]) -> bool {
    let Some((main, _)) = main_lobe(model) else { return false };
    let lobes = model.lobes().iter().zip(lit_lobes(model, parameters));
    lobes.filter(|(basis, is_lit)| *is_lit && basis.lobe.name() == main.lobe.name()).any(|(basis, _)| {
        let alpha = basis.width_at(parameters).and_then(|width| basis.lobe.equivalent_alpha(width));
        alpha.is_some_and(|alpha| alpha < NEAR_SHARP)
    })
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
            let [whole, blurred] = [true, false].map(|whole| stage_one_spans(*model, whole).main(*model).unwrap());
            assert!(blurred.0 > whole.0 && blurred.1 <= whole.1, "{}", model.name());
            let (_, width) = main_lobe(*model).unwrap();
            let (lower, upper) = flat_bounds(model.parameters());
            let middle: Vec<f64> = lower.iter().zip(&upper).map(|(l, u)| 0.5 * (l + u)).collect();
            let with_width = |x: f64| {
                let mut parameters = middle.clone();
                parameters[width.entry] = (width.inverse)(x);
                parameters
            };
            let (low, high) = blurred;
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
