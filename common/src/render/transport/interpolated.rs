//! Integrals interpolated between normals, where that is accurate.
//!
//! Grids of normals become finer, each twice as fine as the last. A pixel takes its integrals from the first grid on which the
//! estimated error of every one of them is below a share of the tolerance. Nothing is assumed about the lobe, the light or the camera: near the
//! reflection of a lamp, on the line where a lamp sets or at the rim the error is larger, and a finer grid or the pixel itself serves.

use super::{
    points::Seen,
    view::{Accuracy, Integrals, Slice, View},
};
use crate::{
    brdf::{Split, lobe_terms},
    math::{Vec3, simd::dispatch},
    render::{
        cut::Cut,
        footprint::Part,
        grid::{Grid, Nodes},
    },
    scene::Viewpoint,
};
use rayon::prelude::*;

/// Distance between the nodes of the first grid, in widths of the sharpest lobe.
const FIRST_SPACING: f64 = 0.35;

/// The same in radians, at the tolerance of full-resolution tables: where a lamp sets, a wide lobe has a kink, which both interpolants miss
/// alike. The error falls faster than the spacing.
const WIDEST_SPACING_RAD: f64 = 0.08;

/// Most nodes of a grid for each part of the pixels that it serves: if the estimates reject all of them, little is lost.
const WORTH: f64 = 0.5;

/// A grid whose rings, squared, are more than this for each position is not made: most of its nodes would be of no use.
const SPARSEST: f64 = 6.0;

/// From closer by, a camera sees a cap so small that its normals are lost in rounding.
const LEAST_REACH_RAD: f64 = 1e-3;

/// Largest estimated error, in units of the tolerance: errors of interpolation are not as independent as those of nodes.
const CARE: f64 = 0.2;

/// The `F5` part of a lobe has about a twentieth of the lobe's mean radiance, and is seen beside a reflectance of some hundredths.
const FRESNEL_SHARE: f64 = 0.1;

/// The grids for one slice, from coarse to fine.
pub(super) struct Interpolator<'a> {
    view: &'a View<'a>,
    slice: Slice<'a>,
    viewpoint: Viewpoint,
    spacing: f64,
    /// Largest error of each integral.
    limits: Vec<f64>,
}

/// A normal of a pixel, with its share of the mean.
type Position = (Vec3, f64);

impl<'a> Interpolator<'a> {
    /// `None` if integrals do not follow from the normal.
    pub(super) fn new(view: &'a View<'a>, slice: Slice<'a>) -> Option<Self> {
        let viewpoint = view.geometry.viewpoint().filter(|viewpoint| viewpoint.reach_rad() > LEAST_REACH_RAD)?;
        let tolerance = view.accuracy.tolerance / slice.lobe.care();
        let limit = CARE * tolerance * view.pyramid.mean_radiance();
        let of_term = |term: usize| if slice.lobe.split() == Split::Schlick && term == 1 { FRESNEL_SHARE } else { 1.0 };
        let limits = (0..slice.integrals()).map(|k| limit * of_term(k / (slice.integrals() / lobe_terms(slice.lobe))));
        let widest = WIDEST_SPACING_RAD * (tolerance / Accuracy::FULL.tolerance).sqrt();
        let spacing = widest.min(FIRST_SPACING * slice.band.sharpest());
        Some(Self { view, slice, viewpoint, spacing, limits: limits.collect() })
    }

    /// Integrals of the pixels of these numbers on the next grid, `None` for a pixel where it is too coarse; `None` altogether if the next
    /// grid would have more than half as many nodes as the pixels have parts.
    pub(super) fn next(&mut self, parts: &[Vec<Part>], numbers: &[usize]) -> Option<Vec<Option<Integrals>>> {
        let most: usize = numbers.iter().map(|&number| 4 * parts[number].len()).sum();
        let rings = self.viewpoint.reach_rad() / self.spacing;
        if rings * rings > SPARSEST * most as f64 {
            return None;
        }
        let grid = Grid::new(self.viewpoint, self.spacing);
        let pixels: Vec<Vec<Position>> =
            numbers.par_iter().map(|&number| self.positions(number, &parts[number])).collect();
        let mut is_used = vec![false; grid.nodes()];
        for (normal, _) in pixels.iter().flatten() {
            grid.stencil(*normal).iter().for_each(|w| is_used[w.node] = true);
        }
        let mut nodes: Vec<usize> = (0..grid.nodes()).filter(|&node| is_used[node]).collect();
        let points: usize = numbers.iter().map(|&number| parts[number].len()).sum();
        if nodes.len() as f64 > WORTH * points as f64 {
            return None;
        }
        let values = self.at_nodes(&grid, &mut nodes);
        // Interpolation may go below every value: a lobe that is nowhere negative stays so.
        let count = self.slice.integrals();
        let mut lowest = vec![0.0_f64; count];
        for row in values.chunks_exact(count) {
            lowest.iter_mut().zip(row).for_each(|(lowest, value)| *lowest = lowest.min(*value));
        }
        let mut place_of = vec![0; grid.nodes()];
        nodes.iter().enumerate().for_each(|(place, &node)| place_of[node] = place);
        self.spacing *= 0.5;
        let stencil = |normal: Vec3| {
            let mut nodes = grid.stencil(normal);
            nodes.iter_mut().for_each(|w| w.node = place_of[w.node]);
            nodes
        };
        Some(pixels.par_iter().map(|positions| self.interpolate(positions, stencil, &values, &lowest)).collect())
    }

    /// The normals of a pixel.
    fn positions(&self, number: usize, parts: &[Part]) -> Vec<Position> {
        let pixel = self.view.pixels[number];
        let normal = |at: [f64; 2]| self.view.surface(pixel, at).map(|surface| surface.normal);
        let mut positions: Vec<Position> = Vec::with_capacity(parts.len());
        for part in parts {
            let within = part.positions();
            let share = part.share / within.len() as f64;
            positions.extend(within.into_iter().filter_map(normal).map(|normal| (normal, share)));
        }
        let total: f64 = positions.iter().map(|(_, share)| share).sum();
        positions.iter_mut().for_each(|(_, share)| *share /= total);
        positions
    }

    /// The integrals at nodes, which are sorted so that neighbours share cuts.
    fn at_nodes(&self, grid: &Grid, nodes: &mut [usize]) -> Integrals {
        nodes.sort_by_cached_key(|&node| grid.patch(node));
        let patches: Vec<&[usize]> = nodes.chunk_by(|&a, &b| grid.patch(a) == grid.patch(b)).collect();
        let of_patch = |cut: &mut Cut<'_>, patch: &&[usize]| {
            let seen = |(place, &node): (usize, &usize)| Some(Seen { place, point: grid.point(node)?, share: 1.0 });
            let points: Vec<Seen> = patch.iter().enumerate().filter_map(seen).collect();
            self.view.at_points(self.slice, &points, patch.len(), cut)
        };
        patches.par_iter().map_init(|| Cut::new(self.view.pyramid), of_patch).flatten_iter().collect()
    }

    /// The integrals of a pixel; `None` if one of them may have too large an error.
    fn interpolate(
        &self,
        positions: &[Position],
        stencil: impl Fn(Vec3) -> Nodes,
        values: &[f64],
        lowest: &[f64],
    ) -> Option<Integrals> {
        let count = self.slice.integrals();
        let mut sums = vec![0.0; count];
        let mut errors = vec![0.0; count];
        for &(normal, share) in positions {
            let nodes = stencil(normal);
            dispatch(Add { nodes: &nodes, share, values, sums: &mut sums, errors: &mut errors });
        }
        sums.iter_mut().zip(lowest).for_each(|(sum, lowest)| *sum = sum.max(*lowest));
        errors.iter().zip(&self.limits).all(|(error, limit)| error.abs() <= *limit).then_some(sums)
    }
}

/// Adds weighted rows of values.
struct Add<'a> {
    nodes: &'a Nodes,
    share: f64,
    values: &'a [f64],
    sums: &'a mut [f64],
    errors: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let count = self.sums.len();
        for weighted in self.nodes {
            let row = &self.values[weighted.node * count..][..count];
            let (value, error) = (self.share * weighted.value, self.share * weighted.error);
            for ((sum, of_error), x) in self.sums.iter_mut().zip(self.errors.iter_mut()).zip(row) {
                *sum += value * x;
                *of_error += error * x;
            }
        }
    }
}
