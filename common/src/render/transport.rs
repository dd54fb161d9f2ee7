//! Builds transport tables: the basis integrals of a model's lobes for a list of pixels, by adaptive quadrature over the light
//! pyramid.

use super::{
    cut::{Band, Cut},
    footprint::{self, Position},
    knots::{self, Knots},
    point::Point,
    pyramid::LightPyramid,
    table::{LobeTable, TransportTable},
};
use crate::{
    brdf::{Lobe, Model, lobe_terms},
    math::{Vec3, to_f32},
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
    /// Factor on the turn of the normal over a pixel up to which a given number of positions is used; 1 keeps the error below 2e-3 of the
    /// lobe's peak.
    pub footprint: f64,
}

impl Accuracy {
    /// Tables of stage one.
    pub const SUBSET: Self = Self { tolerance: 5e-4, footprint: 1.0 };
    /// Full-resolution tables of stage two and polish.
    pub const FULL: Self = Self { tolerance: 3e-3, footprint: 3.0 };
    /// Tables of the coarse picture, on which stage three finds the lobe to start from.
    pub const COARSE: Self = Self { tolerance: 1e-2, footprint: 10.0 };
}

/// The contents of a table: the lobes of `model`, at the widths of `knots`.
#[derive(Debug, Clone, Copy)]
pub struct TransportPlan {
    /// The model whose lobes are integrated.
    pub model: &'static dyn Model,
    /// The grid of widths of the model's main lobe, its first that has one; others have [grids of their own](knots::of_lobes).
    pub knots: Knots,
    /// How finely the integrals are computed.
    pub accuracy: Accuracy,
}

/// Ratio of largest to smallest alpha that share one cut.
const BAND_RATIO: f64 = 4.0;

/// Neighbouring pixels within squares of this side may share a cut.
const TILE: u32 = 4;

/// Points share a cut if their half vectors differ by at most this share of the sharpest lobe's width.
const REACH: f64 = 1.0;

/// A surface point of a pixel with its share of the pixel's mean.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Index of the pixel in its tile.
    pixel: usize,
    point: Point,
    share: f64,
}

/// Sums of one pixel, per lobe `term x channel x knot`.
type Sums = Vec<Vec<f64>>;

impl TransportPlan {
    /// Integrates the table of a list of pixels. A pixel without surface gets zeros.
    ///
    /// Consecutive pixels of one tile share cuts where possible, so a list in [`tile_order`] is fastest.
    #[must_use]
    pub fn integrate(&self, geometry: &Geometry, pyramid: &LightPyramid, pixels: &[Pixel]) -> TransportTable {
        let tiles: Vec<&[Pixel]> = pixels.chunk_by(|a, b| tile_of(*a) == tile_of(*b)).collect();
        let columns: Vec<Sums> = tiles
            .par_iter()
            .map_init(Cut::default, |cut, tile| self.tile(geometry, pyramid, tile, cut))
            .flatten_iter()
            .collect();
        let knots = knots::of_lobes(self.model, self.knots);
        let lobes = self.model.lobes().iter().zip(knots).enumerate().map(|(l, (basis, knots))| {
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

    fn tile(&self, geometry: &Geometry, pyramid: &LightPyramid, pixels: &[Pixel], cut: &mut Cut) -> Vec<Sums> {
        let mut sums: Vec<Sums> = vec![Vec::new(); pixels.len()];
        for (basis, knots) in self.model.lobes().iter().zip(knots::of_lobes(self.model, self.knots)) {
            let widths = knots.map_or_else(|| vec![0.0], |knots| knots.widths());
            let rows = lobe_terms(basis.lobe) * 3;
            sums.iter_mut().for_each(|pixel| pixel.push(vec![0.0; rows * widths.len()]));
            for (band, range) in bands(basis.lobe, &widths) {
                let integrals = self.band(geometry, pyramid, pixels, basis.lobe, (band, &widths[range.clone()]), cut);
                for (pixel, integrals) in sums.iter_mut().zip(integrals) {
                    let Some(out) = pixel.last_mut() else { continue };
                    for (row, part) in integrals.chunks_exact(range.len()).enumerate() {
                        out[row * widths.len() + range.start..][..range.len()].copy_from_slice(part);
                    }
                }
            }
        }
        sums
    }

    /// Integrals of one lobe over the widths of one band, per pixel `term x channel x width`.
    fn band(
        &self,
        geometry: &Geometry,
        pyramid: &LightPyramid,
        pixels: &[Pixel],
        lobe: &dyn Lobe,
        (band, widths): (Band, &[f64]),
        cut: &mut Cut,
    ) -> Vec<Vec<f64>> {
        let tolerance = self.accuracy.tolerance * pyramid.mean_radiance() / lobe.care();
        let mut sums = vec![vec![0.0; lobe_terms(lobe) * 3 * widths.len()]; pixels.len()];
        let points: Vec<Seen> =
            pixels.iter().enumerate().flat_map(|(i, &pixel)| self.points(geometry, i, pixel, (lobe, band))).collect();
        for group in groups(&points, band.sharpest() * REACH) {
            let (centre, reach) = around(group);
            cut.refine(pyramid, &centre, reach, band, tolerance);
            for seen in group {
                lobe.accumulate(cut.lights(&seen.point, seen.share), seen.point.cos_o, widths, &mut sums[seen.pixel]);
            }
        }
        sums
    }

    /// Surface points of a pixel.
    fn points(
        &self,
        geometry: &Geometry,
        pixel: usize,
        [column, row]: Pixel,
        (lobe, band): (&dyn Lobe, Band),
    ) -> Vec<Seen> {
        let at = |p: &Position| {
            let surface = geometry.point(f64::from(column) + p.x, f64::from(row) + p.y)?;
            Some(Seen { pixel, point: Point::new(surface.normal, surface.view)?, share: p.weight })
        };
        let seen = |positions: &[Position]| positions.iter().filter_map(at).collect::<Vec<_>>();
        let (c, r) = (column as usize, row as usize);
        let mut points = if geometry.coverage(c, r) < 1.0 {
            let hit = |x: f64, y: f64| geometry.point(f64::from(column) + x, f64::from(row) + y).is_some();
            seen(&footprint::on_object(hit))
        } else {
            let spread = geometry.normal_spread(c, r) / self.accuracy.footprint;
            let centre = geometry.point(f64::from(column) + 0.5, f64::from(row) + 0.5);
            let cos_o = centre.map_or(1.0, |surface| surface.normal.dot(surface.view));
            seen(&footprint::positions(spread, lobe.footprint(band.sharpest(), cos_o)))
        };
        let total: f64 = points.iter().map(|seen| seen.share).sum();
        points.iter_mut().for_each(|seen| seen.share /= total);
        points
    }
}

/// Sorts pixels so that neighbours may share cuts: by tiles, inside a tile by quarters.
#[must_use]
pub fn tile_order([column, row]: Pixel) -> [u32; 6] {
    let half = TILE / 2;
    [row / TILE, column / TILE, row / half, column / half, row, column]
}

fn tile_of([column, row]: Pixel) -> Pixel {
    [column / TILE, row / TILE]
}

/// Groups of points that may share a cut: the points are halved until each group is within `reach` or a single point.
fn groups(points: &[Seen], reach: f64) -> Vec<&[Seen]> {
    if points.is_empty() {
        return Vec::new();
    }
    if points.len() == 1 || around(points).1 <= reach {
        return vec![points];
    }
    let (first, second) = points.split_at(points.len() / 2);
    [groups(first, reach), groups(second, reach)].concat()
}

/// The mean of a group of points, and a bound on how far the half vector of a light direction turns from it to any of them.
fn around(group: &[Seen]) -> (Point, f64) {
    if let [only] = group {
        return (only.point, 0.0);
    }
    let mean = |f: fn(&Point) -> Vec3| group.iter().map(|seen| f(&seen.point)).sum::<Vec3>().normalize_or_zero();
    let (normal, view) = (mean(|p| p.normal), mean(|p| p.view));
    // The lowest `cos_o` bounds the masking of all points.
    let cos_o = group.iter().map(|seen| seen.point.cos_o).fold(f64::INFINITY, f64::min);
    let distance = |p: &Point| (p.normal - normal).length() + (p.view - view).length();
    let reach = group.iter().map(|seen| distance(&seen.point)).fold(0.0, f64::max);
    (Point { normal, view, cos_o }, reach)
}

/// Splits ascending widths into ranges that share a cut.
fn bands(lobe: &dyn Lobe, widths: &[f64]) -> Vec<(Band, std::ops::Range<usize>)> {
    let Some(alphas) = widths.iter().map(|&w| lobe.equivalent_alpha(w)).collect::<Option<Vec<f64>>>() else {
        return vec![(Band::Diffuse(lobe.bend()), 0..widths.len())];
    };
    // As many bands as `BAND_RATIO` requires, with equal numbers of knots.
    let span = alphas.iter().fold(0.0_f64, |m, &a| m.max(a)) / alphas.iter().fold(f64::INFINITY, |m, &a| m.min(a));
    let count = (crate::math::elementary::ln(span) / crate::math::elementary::ln(BAND_RATIO)).ceil().max(1.0);
    let count = crate::math::cell(count, alphas.len() + 1);
    (0..count)
        .map(|b| {
            let range = b * alphas.len() / count..(b + 1) * alphas.len() / count;
            let (first, last) = (alphas[range.start], alphas[range.end - 1]);
            (Band::Glossy(first.min(last), first.max(last), lobe.tail()), range)
        })
        .collect()
}
