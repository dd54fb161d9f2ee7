//! Builds transport tables: the basis integrals of a model's lobes for a list of pixels, by adaptive quadrature over the light
//! pyramid.

mod interpolated;
mod points;
mod view;

pub use self::view::{Accuracy, Pixel};

use self::{
    interpolated::Interpolator,
    view::{Integrals, Slice, View},
};
use super::{
    cut::Band,
    footprint::Part,
    knots::Knots,
    pyramid::LightPyramid,
    spans::{LobeKnots, Spans},
    table::{LobeTable, TransportTable},
};
use crate::{
    brdf::{Lobe, Model, lobe_terms, main_lobe},
    math::{cell, elementary::ln, to_f32},
    scene::Geometry,
};
use rayon::prelude::*;
use std::ops::Range;

/// The contents of a table.
#[derive(Debug, Clone)]
pub struct TransportPlan {
    /// Its lobes, with their widths.
    pub lobes: Vec<LobeKnots>,
    /// How finely the integrals are computed.
    pub accuracy: Accuracy,
}

/// Ratio of largest to smallest alpha that share one cut and one grid of normals.
const BAND_RATIO: f64 = 2.0;

impl TransportPlan {
    /// The lobes of a model: the main lobe with this grid of widths, the others with all their widths.
    #[must_use]
    pub fn of_model(model: &dyn Model, main: Knots, accuracy: Accuracy) -> Self {
        let mut lobes = Spans::of_model(model, Some(main.span())).knots(1.0);
        let of_main = main_lobe(model).map(|(basis, _)| basis.lobe.name());
        lobes.iter_mut().filter(|l| Some(l.lobe.name()) == of_main).for_each(|l| l.knots = Some(main));
        Self { lobes, accuracy }
    }

    /// Integrates the table of a list of pixels. A pixel without surface gets zeros.
    ///
    /// Consecutive pixels of one tile share cuts where possible, so a list in [`tile_order`] is fastest.
    #[must_use]
    pub fn integrate(&self, geometry: &Geometry, pyramid: &LightPyramid, pixels: &[Pixel]) -> TransportTable {
        let view = View { accuracy: self.accuracy, geometry, pyramid, pixels };
        let lobes = self.lobes.iter().map(|LobeKnots { lobe, knots }| view.lobe(*lobe, *knots));
        TransportTable { pixels: pixels.len(), lobes: lobes.collect() }
    }
}

impl View<'_> {
    fn lobe(&self, lobe: &dyn Lobe, knots: Option<Knots>) -> LobeTable {
        let widths = knots.map_or_else(|| vec![0.0], |knots| knots.widths());
        let (terms, pixels) = (lobe_terms(lobe), self.pixels.len());
        let mut values = vec![0.0; widths.len() * terms * 3 * pixels];
        for (band, range) in bands(lobe, &widths) {
            let integrals = self.integrals(Slice { lobe, band, widths: &widths[range.clone()] });
            // From `pixel -> row x width` to `width x row x pixel`, a row being a channel of a term.
            for (pixel, integrals) in integrals.chunks_exact(terms * 3 * range.len()).enumerate() {
                for (row, of_widths) in integrals.chunks_exact(range.len()).enumerate() {
                    for (slice, &value) in range.clone().zip(of_widths) {
                        values[(slice * terms * 3 + row) * pixels + pixel] = to_f32(value);
                    }
                }
            }
        }
        LobeTable { lobe: lobe.name().to_owned(), knots, terms, values }
    }

    /// The integrals of every pixel: interpolated on the coarsest grid of normals that is fine enough there, else computed at the pixel.
    fn integrals(&self, slice: Slice<'_>) -> Integrals {
        let count = slice.integrals();
        let parts: Vec<Vec<Part>> = self.pixels.par_iter().map(|&pixel| self.parts(pixel, slice)).collect();
        let mut integrals = vec![0.0; self.pixels.len() * count];
        let mut rest: Vec<usize> = (0..self.pixels.len()).collect();
        if let Some(mut interpolator) = Interpolator::new(self, slice) {
            while let Some(found) = interpolator.next(&parts, &rest) {
                rest = found
                    .into_iter()
                    .zip(&rest)
                    .filter_map(|(found, &pixel)| match found {
                        Some(found) => {
                            integrals[pixel * count..][..count].copy_from_slice(&found);
                            None
                        }
                        None => Some(pixel),
                    })
                    .collect();
            }
        }
        let found = self.at_pixels(slice, &parts, &rest);
        for (pixel, found) in rest.into_iter().zip(found.chunks_exact(count)) {
            integrals[pixel * count..][..count].copy_from_slice(found);
        }
        integrals
    }
}

/// Sorts pixels so that neighbours follow each other at every scale: along a Z-order curve (Morton 1966).
#[must_use]
pub fn tile_order([column, row]: Pixel) -> u64 {
    spread_bits(row) << 1 | spread_bits(column)
}

/// The bits of a number, each followed by a zero.
fn spread_bits(number: u32) -> u64 {
    let step = |bits: u64, shift: u32, mask: u64| (bits | bits << shift) & mask;
    let bits = step(u64::from(number), 16, 0x0000_ffff_0000_ffff);
    let bits = step(step(bits, 8, 0x00ff_00ff_00ff_00ff), 4, 0x0f0f_0f0f_0f0f_0f0f);
    step(step(bits, 2, 0x3333_3333_3333_3333), 1, 0x5555_5555_5555_5555)
}

/// Splits ascending widths into ranges that share a cut.
fn bands(lobe: &dyn Lobe, widths: &[f64]) -> Vec<(Band, Range<usize>)> {
    let Some(alphas) = widths.iter().map(|&w| lobe.equivalent_alpha(w)).collect::<Option<Vec<f64>>>() else {
        return vec![(Band::Diffuse(lobe.bend()), 0..widths.len())];
    };
    // As many bands as [`BAND_RATIO`] requires, with equal numbers of knots.
    let span = alphas.iter().fold(0.0_f64, |m, &a| m.max(a)) / alphas.iter().fold(f64::INFINITY, |m, &a| m.min(a));
    let count = (ln(span) / ln(BAND_RATIO)).ceil().max(1.0);
    let count = cell(count, alphas.len() + 1);
    (0..count)
        .map(|b| {
            let range = b * alphas.len() / count..(b + 1) * alphas.len() / count;
            let (first, last) = (alphas[range.start], alphas[range.end - 1]);
            (Band::Glossy(first.min(last), first.max(last), lobe.tail()), range)
        })
        .collect()
}

#[cfg(test)]
mod tests;
