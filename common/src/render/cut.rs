//! The cut through the light pyramid for one surface point: the fewest nodes that keep the error below the tolerance.
//!
//! Taking a node as a point at its energy centroid leaves a second-order error, `1/2 tr(H S)`, with `H` the Hessian of `f cos` and `S`
//! the energy's covariance over the node. A node is split while that error, bounded from above over the node and over the widths of
//! a [`Band`], exceeds the tolerance. Most of the remaining error is then corrected in `render/blur.rs`. Nothing is random: neighbouring
//! pixels get similar cuts, so the error varies smoothly instead of as noise.

use super::{
    blur::{LEAST_COS_D, NodeLists, splat},
    moments::{NUMBERS, Quad},
    point::Point,
    pyramid::{Cell, LightPyramid},
};
use crate::{
    brdf::{BLOCK, Lights, Tail},
    math::{
        Rgb, Vec3,
        elementary::ln,
        lanes::{Lanes, Lanes3, Single, Vector, dot},
        simd::dispatch,
        to_f32, widen,
    },
};
use pulp::{Simd, WithSimd};
use std::f64::consts::{FRAC_1_PI, PI};

/// The lobes that a cut is refined for: a range of lobe widths, or the cosine lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Band {
    /// A lobe as wide as the hemisphere, with its [bend](crate::brdf::Lobe::bend).
    Diffuse(f64),
    /// Microfacet lobes of GGX alpha from `.0` to `.1`, and how fast their distribution falls.
    Glossy(f64, f64, Tail),
}

impl Band {
    /// The width of the sharpest lobe; 1 for the cosine.
    #[must_use]
    pub fn sharpest(self) -> f64 {
        match self {
            Self::Diffuse(_) => 1.0,
            Self::Glossy(lower, ..) => lower,
        }
    }
}

/// Cuts through one pyramid, one at a time; storage is used again.
#[derive(Debug)]
pub struct Cut<'a> {
    pyramid: &'a LightPyramid,
    open: Vec<Cell>,
    split: Vec<Cell>,
    /// Places of the candidates that become nodes of the cut.
    kept: Vec<usize>,
    candidates: Candidates,
    recent: Recent,
    nodes: NodeLists,
    /// Number of nodes without those that pad the lists.
    count: usize,
    lights: Lights,
}

impl<'a> Cut<'a> {
    /// No cut yet.
    #[must_use]
    pub fn new(pyramid: &'a LightPyramid) -> Self {
        Self {
            pyramid,
            open: Vec::new(),
            split: Vec::new(),
            kept: Vec::new(),
            candidates: Candidates::default(),
            recent: Recent(vec![None; RECENT]),
            nodes: NodeLists::default(),
            count: 0,
            lights: Lights::default(),
        }
    }

    /// Refines the pyramid until no node's error, for a lobe of unit weight, exceeds `tolerance` in units of the light's mean radiance. For glossy
    /// lobes the tolerance is multiplied by `n.v`, and by a factor below 1 for lobes wider than 0.1, above 1 for sharper ones. The bound
    /// holds at every surface point whose normal and view lie within `reach` of those of `point` (the sum of both chords of the unit
    /// sphere); `point.cos_o` must be the lowest of all these points.
    pub fn refine(&mut self, point: &Point, reach: f64, band: Band, tolerance: f64) {
        let bound = Bound::new(point, reach, band);
        // The `F5` part of a lobe has a twentieth of the lobe's mean radiance, nearly all of it near the rim, where n.v is small: with
        // the same tolerance everywhere, its relative error would be twenty times that of the lobe.
        let tolerance = tolerance * self.pyramid.mean_radiance();
        let tolerance = match band {
            Band::Diffuse(_) => tolerance,
            Band::Glossy(sharpest, ..) => tolerance * point.cos_o.max(LEAST_COS_D) * leniency(sharpest),
        };
        let tolerance = to_f32(tolerance);
        let Lists(mut nodes) = Lists::of(&mut self.lights, &mut self.nodes);
        nodes.iter_mut().for_each(|list| list.clear());
        self.open.clear();
        self.open.extend(self.pyramid.roots());
        while !self.open.is_empty() {
            self.candidates.resize(4 * self.open.len());
            let mut lists = self.candidates.numbers.each_mut().map(|list| list.as_chunks_mut::<4>().0);
            for (place, &cell) in self.open.iter().enumerate() {
                let quad = self.pyramid.stored(cell).unwrap_or_else(|| self.recent.parts(self.pyramid, cell));
                lists.iter_mut().zip(&quad.0).for_each(|(list, numbers)| list[place] = *numbers);
            }
            self.candidates.find_errors(&bound);
            self.split.clear();
            self.kept.clear();
            for (quad, (cell, errors)) in self.open.iter().zip(self.candidates.errors.as_chunks::<4>().0).enumerate() {
                for (k, (&error, part)) in errors.iter().zip(cell.parts()).enumerate() {
                    if error > tolerance && part.splits() {
                        self.split.push(part);
                    } else if error != NO_LIGHT {
                        self.kept.push(4 * quad + k);
                    }
                }
            }
            for (list, numbers) in nodes.iter_mut().zip(&self.candidates.numbers) {
                list.extend(self.kept.iter().map(|&place| numbers[place]));
            }
            std::mem::swap(&mut self.open, &mut self.split);
        }
        self.count = nodes[0].len();
        for list in nodes {
            list.resize(self.count.next_multiple_of(BLOCK), 0.0);
        }
    }

    /// The nodes of the cut as light that falls on a surface point.
    pub fn lights(&mut self, point: &Point) -> &Lights {
        self.nodes.seen_from(point, &mut self.lights);
        &self.lights
    }

    /// The nodes of the cut: direction of the energy's centroid (world, unit length up to rounding) and energy. For reflectances that
    /// are not basis lobes.
    pub fn directions(&self) -> impl Iterator<Item = (Vec3, Rgb)> + '_ {
        let ([x, y, z], [red, green, blue]) = (&self.nodes.centroid, &self.lights.energy);
        (0..self.count).map(|k| (widen([x[k], y[k], z[k]]), widen([red[k], green[k], blue[k]])))
    }
}

/// The lists of every number of the nodes of a cut.
struct Lists<'a>([&'a mut Vec<f32>; NUMBERS]);

impl<'a> Lists<'a> {
    fn of(lights: &'a mut Lights, nodes: &'a mut NodeLists) -> Self {
        let [red, green, blue] = &mut lights.energy;
        let NodeLists { centroid: [x, y, z], covariance: [a, b, c], radius } = nodes;
        Self([red, green, blue, x, y, z, a, b, c, radius])
    }
}

/// Parts of the cells no coarser than a texel that were looked at last. They are computed on demand, and neighbouring points look at the
/// same ones. By their [`Cell::slot`].
#[derive(Debug)]
struct Recent(Vec<Option<(Cell, Quad)>>);

impl Recent {
    /// The light of the parts of a cell.
    #[inline]
    fn parts(&mut self, pyramid: &LightPyramid, cell: Cell) -> &Quad {
        let slot = &mut self.0[cell.slot(RECENT)];
        if slot.as_ref().is_none_or(|(found, _)| *found != cell) {
            *slot = Some((cell, pyramid.sub_texels(cell)));
        }
        // Never inserts: it was set above, which the borrow checker does not see.
        &slot.get_or_insert_with(|| (cell, Quad::default())).1
    }
}

/// Number of cells that are kept, in 360 kB.
const RECENT: usize = 2048;

/// Nodes that may be split, one list for each of their numbers, padded to whole registers.
#[derive(Debug, Default)]
struct Candidates {
    numbers: [Vec<f32>; NUMBERS],
    /// The largest error of each node taken as a point, or [`NO_LIGHT`].
    errors: Vec<f32>,
}

impl Candidates {
    fn resize(&mut self, count: usize) {
        let count = count.next_multiple_of(BLOCK);
        self.numbers.iter_mut().for_each(|list| list.resize(count, 0.0));
        self.errors.resize(count, 0.0);
    }

    fn find_errors(&mut self, bound: &Bound<'_>) {
        dispatch(Errors { candidates: self, bound });
    }
}

/// In place of the error of a node from which no light arrives.
const NO_LIGHT: f32 = -1.0;

struct Errors<'a, 'b> {
    candidates: &'a mut Candidates,
    bound: &'a Bound<'b>,
}

impl WithSimd for Errors<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let vector = Single(simd);
        let numbers = self.candidates.numbers.each_ref().map(|list| S::as_simd_f32s(list).0);
        let [red, green, blue, x, y, z, a, _, c, radius] = numbers;
        for (k, error) in S::as_mut_simd_f32s(&mut self.candidates.errors).0.iter_mut().enumerate() {
            let centroid = [Lanes::new(vector, x[k]), Lanes::new(vector, y[k]), Lanes::new(vector, z[k])];
            let energy = Lanes::new(vector, simd.max_f32s(simd.max_f32s(red[k], green[k]), blue[k]));
            let spread2 = Lanes::new(vector, a[k]) + Lanes::new(vector, c[k]);
            *error = self.bound.error(vector, centroid, energy, spread2, Lanes::new(vector, radius[k])).value;
        }
    }
}

/// Bounds the error of taking a node as a point, for a band and the surface points around a given one.
struct Bound<'a> {
    point: &'a Point,
    reach: f64,
    band: Band,
    /// Bound of `G n.l / (4 n.l n.v)`, which is at most `G1(v) / (4 n.v)`; `1/pi` for the cosine lobe.
    shading: f64,
    /// Squares of the band's widths.
    squares: [f64; 2],
    /// For a distribution of long tail: its peak times the square of the width, at the largest width.
    long_peak: f64,
    lower: f64,
}

impl<'a> Bound<'a> {
    fn new(point: &'a Point, reach: f64, band: Band) -> Self {
        let (lower, upper) = match band {
            Band::Diffuse(_) => (1.0, 1.0),
            Band::Glossy(lower, upper, _) => (lower, upper),
        };
        let a2 = lower * lower;
        let shading = match band {
            Band::Diffuse(_) => 1.0 / PI,
            Band::Glossy(..) => 0.5 / (point.cos_o + (a2 + (1.0 - a2) * point.cos_o * point.cos_o).sqrt()),
        };
        let long_peak = match band {
            Band::Glossy(_, upper, Tail::Long) => (1.0 - upper * upper) / (-2.0 * PI * ln(upper)),
            _ => 0.0,
        };
        Self { point, reach, band, shading, squares: [a2, upper * upper], long_peak, lower }
    }

    #[inline(always)]
    fn error<V: Vector>(
        &self,
        vector: V,
        centroid: Lanes3<V>,
        energy: Lanes<V>,
        spread2: Lanes<V>,
        radius: Lanes<V>,
    ) -> Lanes<V> {
        let zero = Lanes::splat(vector, 0.0);
        let cos_i = dot(splat(vector, self.point.normal), centroid);
        let margin = radius + self.reach;
        let error = match self.band {
            // The cosine has curvature cos; at the horizon it has a kink, a first-order error over the part that is cut off.
            Band::Diffuse(bend) => {
                let magnitude = cos_i.if_less(zero, zero - cos_i, cos_i);
                cos_i.if_less(margin, spread2.sqrt() * KINK, spread2 * (magnitude + bend) * 0.5) * DIFFUSE_CARE
            }
            Band::Glossy(.., tail) => {
                let (distribution, curvature) = self.peak_over(vector, centroid, radius, tail);
                let kink = (spread2.sqrt() * (1.0 / self.lower)).min(Lanes::splat(vector, 1.0)) * KINK;
                let kink = cos_i.if_less(margin, kink, zero);
                spread2 * (curvature + distribution * SLOW_FACTORS) + kink * distribution
            }
        };
        let no_light = Lanes::splat(vector, f64::from(NO_LIGHT));
        let error = zero.if_less(energy, error * energy * self.shading, no_light);
        cos_i.if_less(zero - margin, no_light, error)
    }

    /// Upper bounds over the node and the band's widths of the distribution `D` and of its curvature along the sphere of light
    /// directions (per square chord).
    #[inline(always)]
    fn peak_over<V: Vector>(
        &self,
        vector: V,
        centroid: Lanes3<V>,
        radius: Lanes<V>,
        tail: Tail,
    ) -> (Lanes<V>, Lanes<V>) {
        let (zero, one) = (Lanes::splat(vector, 0.0), Lanes::splat(vector, 1.0));
        let view = splat(vector, self.point.view);
        let half = [centroid[0] + view[0], centroid[1] + view[1], centroid[2] + view[2]];
        let inverse = dot(half, half).positive().inverse();
        // A step of light direction moves the half vector by at most 1 / (2 v.h) of it.
        let turn = inverse.sqrt().min(Lanes::splat(vector, 10.0));
        let along = dot(splat(vector, self.point.normal), half);
        let sin2 = (one - along * along * inverse).max(0.0);
        // A half vector below the surface counts as one in the surface; the node may still contain the mirror direction.
        let sin = zero.if_less(along, sin2.sqrt(), one);
        let nearest = (sin - radius * turn - Lanes::splat(vector, self.reach)).max(0.0);
        let t2 = nearest * nearest;
        let [low2, high2] = self.squares;
        if tail == Tail::Long {
            // `k / d` with a factor `k` that grows slowly with the width and a divisor `d` that grows with it.
            let inverse = (t2 + (one - t2) * low2).inverse();
            let distribution = inverse * self.long_peak;
            return (distribution, turn * turn * distribution * inverse * 2.0);
        }
        // a^2/q^2 is largest at a = t, a^2/q^3 at a = t / sqrt(2).
        let high2 = Lanes::splat(vector, high2);
        let (distribution, _) = ggx(t2, t2.max(low2).min(high2));
        let (sharpest, inverse) = ggx(t2, (t2 * 0.5).max(low2).min(high2));
        (distribution, turn * turn * sharpest * inverse * 2.0)
    }
}

/// The distribution of GGX of squared width `a2` at the squared sine `t2` of the half vector's angle, and the inverse of the root of its divisor.
#[inline(always)]
fn ggx<V: Vector>(t2: Lanes<V>, a2: Lanes<V>) -> (Lanes<V>, Lanes<V>) {
    let inverse = (t2 + a2 * (Lanes::splat_like(t2, 1.0) - t2)).inverse();
    (a2 * inverse * inverse * FRAC_1_PI, inverse)
}

/// The cosine lobe needs few nodes, so their errors average out less: it gets a tighter tolerance.
const DIFFUSE_CARE: f64 = 6.0;

/// Curvature, in units of the distribution, of its factors: Fresnel's term, masking-shadowing, the cosine. Wide lobes are not smoother
/// than these factors.
const SLOW_FACTORS: f64 = 4.0;

/// Factor on the tolerance for bands whose sharpest lobe has this width. For lobes wider than [`EVEN`], the second-order terms correct only
/// about half of the error, because the factors of the distribution vary as much as the distribution, and such lobes need few nodes. A
/// sharp lobe needs many nodes, whose errors average out.
fn leniency(sharpest: f64) -> f64 {
    let wide = EVEN / sharpest;
    if wide < 1.0 { wide } else { wide.sqrt() }
}

/// Width at which the tolerance is that of the caller.
const EVEN: f64 = 0.1;

/// Share of a node's size by which a kink at the horizon can shift its value.
const KINK: f64 = 0.1;
