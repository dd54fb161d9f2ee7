//! Builds transport tables: the basis integrals of a model's lobes for a list of pixels, by adaptive quadrature over the light
//! pyramid.

use super::{
    cut::{Band, Cut},
    footprint::{self, Position},
    grid::Grid,
    knots::{self, Knots},
    point::Point,
    pyramid::LightPyramid,
    table::{LobeTable, TransportTable},
};
use crate::{
    brdf::{Lobe, Model, lobe_terms},
    math::{Vec3, cell, to_f32},
    scene::Geometry,
};
use rayon::prelude::*;
use std::ops::Range;

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
    pub const SUBSET: Self = Self { tolerance: 1e-3, footprint: 2.0 };
    /// Full-resolution tables of stage two and polish.
    pub const FULL: Self = Self { tolerance: 5e-3, footprint: 3.0 };
    /// Tables of the coarse picture, on which stage three finds the lobe to start from.
    pub const COARSE: Self = Self { tolerance: 3e-2, footprint: 10.0 };

    /// Positions in a pixel that the silhouette cuts.
    fn silhouette(&self) -> usize {
        cell((MOST_POSITIONS as f64 / self.footprint).ceil(), MOST_POSITIONS + 1).max(1)
    }
}

/// Positions in a pixel that the silhouette cuts, at a footprint of 1.
const MOST_POSITIONS: usize = 32;

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

/// A surface point of a pixel or of a grid's node, with its share of the mean.
#[derive(Debug, Clone, Copy)]
struct Seen {
    /// Index of the pixel or node in its list.
    place: usize,
    point: Point,
    share: f64,
}

/// A lobe at the widths of one band.
#[derive(Debug, Clone, Copy)]
struct Part<'a> {
    lobe: &'a dyn Lobe,
    band: Band,
    widths: &'a [f64],
}

impl Part<'_> {
    /// Number of its basis integrals at one point: `term x channel x width`.
    fn integrals(&self) -> usize {
        lobe_terms(self.lobe) * 3 * self.widths.len()
    }
}

/// Integrals of one part, `place x term x channel x width`.
type Integrals = Vec<f64>;

impl TransportPlan {
    /// Integrates the table of a list of pixels. A pixel without surface gets zeros.
    ///
    /// Consecutive pixels of one tile share cuts where possible, so a list in [`tile_order`] is fastest.
    #[must_use]
    pub fn integrate(&self, geometry: &Geometry, pyramid: &LightPyramid, pixels: &[Pixel]) -> TransportTable {
        let view = View { accuracy: self.accuracy, geometry, pyramid, pixels };
        let knots = knots::of_lobes(self.model, self.knots);
        let lobes = self.model.lobes().iter().zip(knots).map(|(basis, knots)| view.lobe(basis.lobe, knots));
        TransportTable { pixels: pixels.len(), lobes: lobes.collect() }
    }
}

/// What a table is integrated for.
#[derive(Debug, Clone, Copy)]
struct View<'a> {
    accuracy: Accuracy,
    geometry: &'a Geometry,
    pyramid: &'a LightPyramid,
    pixels: &'a [Pixel],
}

impl View<'_> {
    fn lobe(&self, lobe: &dyn Lobe, knots: Option<Knots>) -> LobeTable {
        let widths = knots.map_or_else(|| vec![0.0], |knots| knots.widths());
        let (terms, pixels) = (lobe_terms(lobe), self.pixels.len());
        let mut values = vec![0.0; widths.len() * terms * 3 * pixels];
        let mut keep = |range: Range<usize>, integrals: Integrals| {
            // From `pixel -> row x width` to `width x row x pixel`, a row being a channel of a term.
            for (pixel, integrals) in integrals.chunks_exact(terms * 3 * range.len()).enumerate() {
                for (row, of_widths) in integrals.chunks_exact(range.len()).enumerate() {
                    for (slice, &value) in range.clone().zip(of_widths) {
                        values[(slice * terms * 3 + row) * pixels + pixel] = to_f32(value);
                    }
                }
            }
        };
        let mut rest: Vec<Range<usize>> = Vec::new();
        for (band, range) in bands(lobe, &widths, GRID_RATIO) {
            match (self.on_grid(Part { lobe, band, widths: &widths[range.clone()] }), rest.last_mut()) {
                (Some(integrals), _) => keep(range, integrals),
                (None, Some(last)) if last.end == range.start => last.end = range.end,
                (None, _) => rest.push(range),
            }
        }
        for whole in rest {
            for (band, range) in bands(lobe, &widths[whole.clone()], BAND_RATIO) {
                let range = whole.start + range.start..whole.start + range.end;
                keep(range.clone(), self.at_pixels(Part { lobe, band, widths: &widths[range] }));
            }
        }
        LobeTable { knots, terms, values }
    }

    /// The integrals of every pixel, each computed at the pixel's own positions.
    fn at_pixels(&self, part: Part<'_>) -> Integrals {
        let tiles: Vec<&[Pixel]> = self.pixels.chunk_by(|a, b| tile_of(*a) == tile_of(*b)).collect();
        let of_tile = |cut: &mut Cut<'_>, tile: &&[Pixel]| {
            let points: Vec<Seen> = tile
                .iter()
                .enumerate()
                .flat_map(|(i, &pixel)| self.points(i, pixel, part, self.accuracy.silhouette()))
                .collect();
            self.at_points(part, &points, tile.len(), cut)
        };
        tiles.par_iter().map_init(|| Cut::new(self.pyramid), of_tile).flatten_iter().collect()
    }

    /// Sums of integrals over `points` for each of `places`.
    fn at_points(&self, part: Part<'_>, points: &[Seen], places: usize, cut: &mut Cut<'_>) -> Integrals {
        let Part { lobe, band, widths } = part;
        let tolerance = self.accuracy.tolerance / lobe.care();
        let mut sums = vec![0.0; places * part.integrals()];
        for group in groups(points, band.sharpest() * REACH) {
            let (centre, reach) = around(group);
            cut.refine(&centre, reach, band, tolerance);
            for seen in group {
                let sums = &mut sums[seen.place * part.integrals()..][..part.integrals()];
                lobe.accumulate(cut.lights(&seen.point, seen.share), seen.point.cos_o, widths, sums);
            }
        }
        sums
    }

    /// Surface points of a pixel.
    fn points(
        &self,
        place: usize,
        [column, row]: Pixel,
        Part { lobe, band, .. }: Part<'_>,
        silhouette: usize,
    ) -> Vec<Seen> {
        let surface = |x: f64, y: f64| self.geometry.point(f64::from(column) + x, f64::from(row) + y);
        let at = |p: &Position| {
            let surface = surface(p.x, p.y)?;
            Some(Seen { place, point: Point::new(surface.normal, surface.view)?, share: p.weight })
        };
        let seen = |positions: &[Position]| positions.iter().filter_map(at).collect::<Vec<_>>();
        let (c, r) = (column as usize, row as usize);
        let mut points = if self.geometry.coverage(c, r) < 1.0 {
            seen(&footprint::on_object(silhouette, |x, y| surface(x, y).is_some()))
        } else {
            let spread = self.geometry.normal_spread(c, r) / self.accuracy.footprint;
            let cos_o = surface(0.5, 0.5).map_or(1.0, |surface| surface.normal.dot(surface.view));
            seen(&footprint::positions(spread, lobe.footprint(band.sharpest(), cos_o)))
        };
        let total: f64 = points.iter().map(|seen| seen.share).sum();
        points.iter_mut().for_each(|seen| seen.share /= total);
        points
    }

    /// The integrals of every pixel, interpolated on a grid of normals; `None` if they do not follow from the normal, if the lobe changes
    /// too fast near the rim, or if the grid would need about as many integrals as the pixels.
    fn on_grid(&self, part: Part<'_>) -> Option<Integrals> {
        let viewpoint = self.geometry.viewpoint()?;
        let width = part.band.sharpest();
        if part.lobe.footprint(width, 0.0) < width {
            return None;
        }
        let points: Vec<Vec<Seen>> =
            self.pixels.par_iter().map(|&pixel| self.points(0, pixel, part, MOST_POSITIONS)).collect();
        let positions: usize = points.iter().map(Vec::len).sum();
        let spacing = width * spacing(part.band);
        let rings = viewpoint.reach_rad() / spacing;
        if rings * rings > SPARSEST * positions as f64 {
            return None;
        }
        let grid = Grid::new(viewpoint, spacing);
        let mut place_of = vec![usize::MAX; grid.nodes()];
        points
            .iter()
            .flatten()
            .flat_map(|seen| grid.stencil(seen.point.normal))
            .for_each(|(node, _)| place_of[node] = 0);
        let mut nodes: Vec<usize> = (0..grid.nodes()).filter(|&node| place_of[node] == 0).collect();
        if nodes.len() as f64 > WORTH * positions as f64 {
            return None;
        }
        nodes.sort_by_key(|&node| grid.patch(node));
        nodes.iter().enumerate().for_each(|(place, &node)| place_of[node] = place);
        let patches: Vec<&[usize]> = nodes.chunk_by(|&a, &b| grid.patch(a) == grid.patch(b)).collect();
        let of_patch = |cut: &mut Cut<'_>, patch: &&[usize]| {
            let seen = |(place, &node): (usize, &usize)| Some(Seen { place, point: grid.point(node)?, share: 1.0 });
            let points: Vec<Seen> = patch.iter().enumerate().filter_map(seen).collect();
            self.at_points(part, &points, patch.len(), cut)
        };
        let values: Integrals =
            patches.par_iter().map_init(|| Cut::new(self.pyramid), of_patch).flatten_iter().collect();
        let of_pixel = |points: &Vec<Seen>| {
            let mut sums = vec![0.0; part.integrals()];
            for seen in points {
                for (node, weight) in grid.stencil(seen.point.normal) {
                    let values = &values[place_of[node] * sums.len()..][..sums.len()];
                    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += seen.share * weight * value);
                }
            }
            sums
        };
        Some(points.par_iter().flat_map_iter(of_pixel).collect())
    }
}

/// Ratio of largest to smallest alpha that share one grid of normals.
const GRID_RATIO: f64 = 2.0;

/// Distance of a grid's nodes, in widths of the sharpest lobe: under light from one direction, the error is at most 3e-3 of the peak of
/// a GGX lobe (tested in `grid.rs`).
const SPACING: f64 = 0.22;

/// The same for a lobe as wide as the hemisphere, which has a kink where a light crosses the horizon.
const DIFFUSE_SPACING: f64 = 0.04;

fn spacing(band: Band) -> f64 {
    match band {
        Band::Diffuse(_) => DIFFUSE_SPACING,
        Band::Glossy(..) => SPACING,
    }
}

/// A grid whose rings, squared, are more than this for each position is not made: most of its nodes would be of no use.
const SPARSEST: f64 = 6.0;

/// Most nodes of a grid for each position that they replace: a node costs as much as a position, and interpolation a little.
const WORTH: f64 = 0.8;

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
fn bands(lobe: &dyn Lobe, widths: &[f64], ratio: f64) -> Vec<(Band, Range<usize>)> {
    let Some(alphas) = widths.iter().map(|&w| lobe.equivalent_alpha(w)).collect::<Option<Vec<f64>>>() else {
        return vec![(Band::Diffuse(lobe.bend()), 0..widths.len())];
    };
    // As many bands as `ratio` requires, with equal numbers of knots.
    let span = alphas.iter().fold(0.0_f64, |m, &a| m.max(a)) / alphas.iter().fold(f64::INFINITY, |m, &a| m.min(a));
    let count = (crate::math::elementary::ln(span) / crate::math::elementary::ln(ratio)).ceil().max(1.0);
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
