//! Builds transport tables: the basis integrals of a model's lobes for a list of pixels, by adaptive quadrature over the light
//! pyramid.

use super::{
    cut::{Band, Cut, Point},
    footprint::{self, Position},
    knots::Knots,
    pyramid::LightPyramid,
    table::{LobeTable, TransportTable},
};
use crate::{
    brdf::{Lobe, Model, lobe_terms},
    math::to_f32,
    scene::Geometry,
};
use rayon::prelude::*;

/// A pixel: column and row.
pub type Pixel = [u32; 2];

/// How finely tables are integrated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Accuracy {
    /// Largest error of one node of a cut, in units of the map's mean radiance, for a lobe of unit weight.
    pub tolerance: f64,
}

impl Accuracy {
    /// Tables of stage one.
    pub const SUBSET: Self = Self { tolerance: 1e-5 };
    /// Full-resolution tables of stage two and polish.
    pub const FULL: Self = Self { tolerance: 4e-5 };
}

/// What a table is to hold: lobes of `model`, widths on `knots`.
#[derive(Debug, Clone, Copy)]
pub struct TransportPlan {
    /// The model whose lobes are integrated.
    pub model: &'static dyn Model,
    /// The grid of widths, for every lobe that has one.
    pub knots: Knots,
    /// How finely.
    pub accuracy: Accuracy,
}

/// Ratio of largest to smallest alpha that share one cut.
const BAND_RATIO: f64 = 4.0;

impl TransportPlan {
    /// Integrates the table of some pixels. A pixel that sees no surface gets zeros.
    #[must_use]
    pub fn integrate(&self, geometry: &Geometry, pyramid: &LightPyramid, pixels: &[Pixel]) -> TransportTable {
        let columns: Vec<Vec<Vec<f64>>> = pixels
            .par_iter()
            .map_init(Cut::default, |cut, &pixel| self.pixel(geometry, pyramid, pixel, cut))
            .collect();
        let lobes = self.model.lobes().iter().enumerate().map(|(l, basis)| {
            let knots = basis.width.map(|_| self.knots);
            let terms = lobe_terms(basis.lobe);
            // From `pixel -> term x channel x knot` to `knot x term x channel x pixel`.
            let slices = knots.map_or(1, |k| k.count());
            let mut values = Vec::with_capacity(slices * terms * 3 * pixels.len());
            for slice in 0..slices {
                for row in 0..terms * 3 {
                    values.extend(columns.iter().map(|sums| to_f32(sums[l][row * slices + slice])));
                }
            }
            LobeTable { knots, terms, values }
        });
        TransportTable { pixels: pixels.len(), lobes: lobes.collect() }
    }

    /// Sums of one pixel, per lobe `term x channel x knot`.
    fn pixel(&self, geometry: &Geometry, pyramid: &LightPyramid, pixel: Pixel, cut: &mut Cut) -> Vec<Vec<f64>> {
        self.model
            .lobes()
            .iter()
            .map(|basis| {
                let widths = if basis.width.is_some() { self.knots.widths() } else { vec![0.0] };
                let mut sums = vec![0.0; lobe_terms(basis.lobe) * 3 * widths.len()];
                for (band, range) in bands(basis.lobe, &widths) {
                    let integrals = self.band(geometry, pyramid, pixel, basis.lobe, band, &widths[range.clone()], cut);
                    let count = range.len();
                    for (row, part) in integrals.chunks_exact(count).enumerate() {
                        sums[row * widths.len() + range.start..][..count].copy_from_slice(part);
                    }
                }
                sums
            })
            .collect()
    }

    #[allow(clippy::too_many_arguments, reason = "the inner loop of `pixel`, named for the profiler")]
    fn band(
        &self,
        geometry: &Geometry,
        pyramid: &LightPyramid,
        pixel: Pixel,
        lobe: &dyn Lobe,
        band: Band,
        widths: &[f64],
        cut: &mut Cut,
    ) -> Vec<f64> {
        let tolerance = self.accuracy.tolerance * pyramid.mean_radiance();
        let mut sums = vec![0.0; lobe_terms(lobe) * 3 * widths.len()];
        let (points, total) = points(geometry, pixel, band);
        for (point, weight) in points {
            cut.refine(pyramid, &point, band, tolerance);
            for light in &mut cut.lights {
                light.energy = light.energy.map(|e| e * weight / total);
            }
            lobe.accumulate(&cut.lights, point.cos_o, widths, &mut sums);
        }
        sums
    }
}

/// Surface points of a pixel with their weights, and the sum of these.
fn points(geometry: &Geometry, [column, row]: Pixel, band: Band) -> (Vec<(Point, f64)>, f64) {
    let sharpest = match band {
        Band::Diffuse => 1.0,
        Band::Glossy(lower, _) => lower,
    };
    let at = |p: &Position| {
        let surface = geometry.point(f64::from(column) + p.x, f64::from(row) + p.y)?;
        Some((Point::new(surface.normal, surface.view)?, p.weight))
    };
    let (c, r) = (column as usize, row as usize);
    let positions = if geometry.coverage(c, r) < 1.0 {
        footprint::on_object(|x, y| geometry.point(f64::from(column) + x, f64::from(row) + y).is_some())
    } else {
        footprint::positions(geometry.normal_spread(c, r), sharpest)
    };
    let points: Vec<(Point, f64)> = positions.iter().filter_map(at).collect();
    let total = points.iter().map(|(_, w)| w).sum();
    (points, total)
}

/// Splits ascending widths into runs that share a cut.
fn bands(lobe: &dyn Lobe, widths: &[f64]) -> Vec<(Band, std::ops::Range<usize>)> {
    let Some(alphas) = widths.iter().map(|&w| lobe.equivalent_alpha(w)).collect::<Option<Vec<f64>>>() else {
        return vec![(Band::Diffuse, 0..widths.len())];
    };
    // Equal numbers of knots per band, as many bands as the ratio asks for.
    let span = alphas.iter().fold(0.0_f64, |m, &a| m.max(a)) / alphas.iter().fold(f64::INFINITY, |m, &a| m.min(a));
    let count = (crate::math::elementary::ln(span) / crate::math::elementary::ln(BAND_RATIO)).ceil().max(1.0);
    let count = crate::math::cell(count, alphas.len() + 1);
    (0..count)
        .map(|b| {
            let range = b * alphas.len() / count..(b + 1) * alphas.len() / count;
            let (first, last) = (alphas[range.start], alphas[range.end - 1]);
            (Band::Glossy(first.min(last), first.max(last)), range)
        })
        .collect()
}
