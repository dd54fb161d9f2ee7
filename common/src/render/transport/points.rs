//! Integrals computed at surface points.

use super::view::{Integrals, Pixel, Slice, View};
use crate::{
    math::Vec3,
    render::{
        cut::Cut,
        footprint::Part,
        point::{Point, Turn},
    },
    scene::SurfacePoint,
};
use rayon::prelude::*;

/// Neighbouring pixels within squares of this side may share a cut.
const TILE: u32 = 4;

/// Points share a cut if their half vectors differ by at most this share of the sharpest lobe's width.
const REACH: f64 = 1.0;

/// A surface point of a pixel or of a grid's node, with its share of the mean.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Index of the pixel or node in its list.
    pub(super) place: usize,
    pub(super) point: Point,
    pub(super) share: f64,
}

impl View<'_> {
    /// The integrals of the pixels of these numbers, each computed at the middles of its parts.
    pub(super) fn at_pixels(&self, slice: Slice<'_>, parts: &[Vec<Part>], numbers: &[usize]) -> Integrals {
        let tile_of = |&number: &usize| self.pixels[number].map(|x| x / TILE);
        let tiles: Vec<&[usize]> = numbers.chunk_by(|a, b| tile_of(a) == tile_of(b)).collect();
        let of_tile = |cut: &mut Cut<'_>, tile: &&[usize]| {
            let seen = |(place, &number): (usize, &usize)| self.points(place, self.pixels[number], &parts[number]);
            let points: Vec<Seen> = tile.iter().enumerate().flat_map(seen).collect();
            self.at_points(slice, &points, tile.len(), cut)
        };
        tiles.par_iter().map_init(|| Cut::new(self.pyramid), of_tile).flatten_iter().collect()
    }

    /// Sums of integrals over `points` for each of `places`.
    pub(super) fn at_points(&self, slice: Slice<'_>, points: &[Seen], places: usize, cut: &mut Cut<'_>) -> Integrals {
        let Slice { lobe, band, widths } = slice;
        let tolerance = self.accuracy.tolerance / lobe.care();
        let mut sums = vec![0.0; places * slice.integrals()];
        for group in groups(points, band.sharpest() * REACH) {
            let (centre, reach) = around(group);
            cut.refine(&centre, reach, band, tolerance);
            for seen in group {
                let sums = &mut sums[seen.place * slice.integrals()..][..slice.integrals()];
                lobe.accumulate(cut.lights(&seen.point), seen.point.cos_o, seen.share, widths, sums);
            }
        }
        sums
    }

    /// The surface points in the middles of a pixel's parts.
    fn points(&self, place: usize, pixel: Pixel, parts: &[Part]) -> Vec<Seen> {
        let point = |part: &Part| {
            let surface = |dx: f64, dy: f64| self.surface(pixel, [part.middle[0] + dx, part.middle[1] + dy]);
            let middle = surface(0.0, 0.0)?;
            let [x, y] = part.sides.map(|side| 0.5 * side);
            let point = Point::new(middle.normal, middle.view)?;
            let turns = [(x, 0.0), (0.0, y)].map(|(dx, dy)| surface(dx, dy).zip(surface(-dx, -dy)));
            // The deviation of a uniform distribution is its length over the root of 12.
            let of = |f: fn(&SurfacePoint) -> Vec3| {
                turns.map(|ends| ends.map_or(Vec3::ZERO, |(a, b)| (f(&a) - f(&b)) / f64::sqrt(12.0)))
            };
            let turn = Turn { normal: of(|surface| surface.normal), view: of(|surface| surface.view) };
            Some(Seen { place, point: Point { turn, ..point }, share: part.share })
        };
        let mut points: Vec<Seen> = parts.iter().filter_map(point).collect();
        let total: f64 = points.iter().map(|seen| seen.share).sum();
        points.iter_mut().for_each(|seen| seen.share /= total);
        points
    }
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
    (Point { normal, view, cos_o, turn: Turn::default() }, reach)
}
