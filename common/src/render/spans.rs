//! The lobes of a transport table with the widths that it spans. Tables belong to lobes: models with the same lobes share them.

use super::knots::Knots;
use crate::brdf::{Lobe, Model, main_lobe};

/// Knots per factor of two for all lobes but the main one of a model: the largest relative error of a coat's distribution is 7e-4 (tested
/// in [`knots`](super::knots)), and the coat's weight is at most a quarter.
pub(super) const OTHERS_PER_OCTAVE: f64 = 3.0;

/// A lobe of a table and its grid of widths; `None` for a lobe of fixed shape.
#[derive(Debug, Clone, Copy)]
pub struct LobeKnots {
    /// The lobe.
    pub lobe: &'static dyn Lobe,
    /// Its widths.
    pub knots: Option<Knots>,
}

/// The lobes of a table, each with its smallest and largest width.
#[derive(Debug, Clone, Default)]
pub struct Spans(Vec<LobeSpan>);

#[derive(Debug, Clone, Copy)]
struct LobeSpan {
    lobe: &'static dyn Lobe,
    /// `None` for a lobe of fixed shape.
    widths: Option<(f64, f64)>,
    /// Whether it is the main lobe of a model, of which a table may span a part.
    is_main: bool,
}

impl PartialEq for Spans {
    fn eq(&self, other: &Self) -> bool {
        let same = |(a, b): (&LobeSpan, &LobeSpan)| {
            a.lobe.name() == b.lobe.name() && a.widths == b.widths && a.is_main == b.is_main
        };
        self.0.len() == other.0.len() && self.0.iter().zip(&other.0).all(same)
    }
}

impl Spans {
    /// The lobes of a model: the main lobe with the widths from `main`, the others over their whole range, which is small.
    #[must_use]
    pub fn of_model(model: &dyn Model, main: Option<(f64, f64)>) -> Self {
        let of_main = main_lobe(model).map(|(basis, _)| basis.lobe.name());
        let mut spans = Self(Vec::new());
        for basis in model.lobes() {
            let is_main = of_main == Some(basis.lobe.name());
            let whole = basis.width.map(|width| width.span(model.parameters()));
            let widths = if is_main { main.or(whole) } else { whole };
            spans.add(LobeSpan { lobe: basis.lobe, widths, is_main });
        }
        spans
    }

    /// The lobes of a model over their whole ranges of widths.
    #[must_use]
    pub fn whole(model: &dyn Model) -> Self {
        Self::of_model(model, None)
    }

    /// The lobes of both, with the widths of both.
    #[must_use]
    pub fn joined(mut self, other: &Self) -> Self {
        other.0.iter().for_each(|span| self.add(*span));
        self
    }

    fn add(&mut self, span: LobeSpan) {
        let Some(known) = self.0.iter_mut().find(|known| known.lobe.name() == span.lobe.name()) else {
            return self.0.push(span);
        };
        known.is_main |= span.is_main;
        known.widths = match (known.widths, span.widths) {
            (Some(a), Some(b)) => Some((a.0.min(b.0), a.1.max(b.1))),
            (a, b) => a.or(b),
        };
    }

    /// Smallest and largest width of the main lobe of a model; `None` if it has none.
    #[must_use]
    pub fn main(&self, model: &dyn Model) -> Option<(f64, f64)> {
        let (basis, _) = main_lobe(model)?;
        self.0.iter().find(|span| span.lobe.name() == basis.lobe.name())?.widths
    }

    /// The grids of a table with at least `per_octave` knots per factor of two of a main lobe's width.
    #[must_use]
    pub fn knots(&self, per_octave: f64) -> Vec<LobeKnots> {
        let grid = |span: &LobeSpan| {
            let per_octave = if span.is_main { per_octave } else { OTHERS_PER_OCTAVE };
            let knots = span.widths.map(|(low, high)| Knots::covering(low, high, per_octave));
            LobeKnots { lobe: span.lobe, knots }
        };
        self.0.iter().map(grid).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Disney, Ggx, GgxHaze};

    #[test]
    fn models_with_the_same_lobes_have_the_same_tables() {
        assert_eq!(Spans::of_model(&Ggx, Some((0.1, 0.2))), Spans::of_model(&GgxHaze, Some((0.1, 0.2))));
        assert_ne!(Spans::of_model(&Ggx, Some((0.1, 0.2))), Spans::of_model(&Ggx, Some((0.1, 0.3))));
        assert_eq!(Spans::whole(&GgxHaze).main(&GgxHaze), Some((0.005, 1.0)));
    }

    #[test]
    fn joined_spans_hold_the_lobes_and_widths_of_both() {
        let narrow = Spans::of_model(&Ggx, Some((0.1, 0.2)));
        let both = narrow.clone().joined(&Spans::of_model(&CookTorrance, Some((0.3, 0.4))));
        let names: Vec<&str> = both.knots(5.0).iter().map(|grid| grid.lobe.name()).collect();
        assert_eq!(names, ["lambert", "ggx", "cook-torrance"]);
        let wider = both.joined(&Spans::of_model(&GgxHaze, Some((0.15, 0.6))));
        assert_eq!((wider.main(&Ggx), wider.main(&CookTorrance)), (Some((0.1, 0.6)), Some((0.3, 0.4))));
        assert_eq!(wider.main(&Disney), None);
    }

    #[test]
    fn only_the_main_lobe_has_a_part_of_its_widths_and_the_fine_grid() {
        let grids = Spans::of_model(&Disney, Some((0.1, 0.4))).knots(5.0);
        let widths: Vec<(f64, f64, usize)> = grids
            .iter()
            .filter_map(|grid| grid.knots.map(|knots| (knots.span().0, knots.span().1, knots.count())))
            .collect();
        let &[(low, high, count), (satin, glossy, coat)] = &widths[..] else { panic!("{widths:?}") };
        assert!((low - 0.1).abs() < 1e-12 && (high - 0.4).abs() < 1e-12 && count == 11);
        assert!((satin - 0.005).abs() < 1e-4 && (glossy - 0.1).abs() < 1e-12 && coat == 14, "{satin} {glossy} {coat}");
    }
}
