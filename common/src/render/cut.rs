//! The cut through the light pyramid for one surface point: the fewest nodes that keep the error below the tolerance.
//!
//! Taking a node as a point at its energy centroid leaves a second-order error, `1/2 tr(H S)`, with `H` the Hessian of `f cos` and `S`
//! the energy's covariance over the node. A node is split while that error, bounded from above over the node and over the widths of
//! a [`Band`], exceeds the tolerance. Most of the remaining error is then corrected in `render/blur.rs`. Nothing is random: neighbouring
//! pixels get similar cuts, so the error varies smoothly instead of as noise.

use super::{
    blur::{LEAST_COS_D, NodeLists, SeenLists},
    point::Point,
    pyramid::{Cell, LightPyramid, Node, strongest},
};
use crate::{
    brdf::{Angles, Incident, Spread, Tail},
    math::{Rgb, Vec3, elementary::ln, widen},
};
use std::f64::consts::PI;

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
    stack: Vec<Cell>,
    nodes: Vec<Node>,
    recent: Recent,
    lists: NodeLists,
    seen: SeenLists,
    lights: Vec<Incident>,
}

impl<'a> Cut<'a> {
    /// No cut yet.
    #[must_use]
    pub fn new(pyramid: &'a LightPyramid) -> Self {
        Self {
            pyramid,
            stack: Vec::new(),
            nodes: Vec::new(),
            recent: Recent(vec![None; RECENT]),
            lists: NodeLists::default(),
            seen: SeenLists::default(),
            lights: Vec::new(),
        }
    }

    /// Refines the pyramid until no node's error, for a lobe of unit weight, exceeds `tolerance` in units of the light's mean radiance (for
    /// glossy lobes times `n.v`, and less for wide ones). The bound holds at every surface point whose normal and view lie within `reach`
    /// of those of `point` (the sum of both chords of the unit sphere); `point.cos_o` must be the lowest of all these points.
    pub fn refine(&mut self, point: &Point, reach: f64, band: Band, tolerance: f64) {
        let bound = Bound::new(point, reach, band);
        // The `F5` part of a lobe has a twentieth of the lobe's mean radiance, nearly all of it near the rim, where n.v is small: with
        // the same tolerance everywhere, its relative error would be twenty times that of the lobe.
        let tolerance = tolerance * self.pyramid.mean_radiance();
        let tolerance = match band {
            Band::Diffuse(_) => tolerance,
            Band::Glossy(sharpest, ..) => tolerance * point.cos_o.max(LEAST_COS_D) * (EVEN / sharpest).min(1.0),
        };
        self.nodes.clear();
        self.stack.clear();
        self.stack.extend(self.pyramid.roots());
        while let Some(cell) = self.stack.pop() {
            let node = self.recent.node(self.pyramid, cell);
            let centroid = widen(node.centroid);
            let cos_i = point.normal.dot(centroid);
            if cos_i < -(f64::from(node.radius) + reach) || strongest(node.energy) == 0.0 {
                continue;
            }
            if bound.error(&node, centroid, cos_i) > tolerance {
                let before = self.stack.len();
                self.stack.extend(self.pyramid.children(cell));
                if self.stack.len() > before {
                    continue;
                }
            }
            self.nodes.push(node);
        }
        self.lists.set(&self.nodes);
    }

    /// The nodes of the cut as light that falls on a surface point, their energies times `share`.
    pub fn lights(&mut self, point: &Point, share: f64) -> &[Incident] {
        self.lists.seen_from(point, &mut self.seen);
        let SeenLists { cos_i, cos_h, sin2_h, cos_d, du, du2 } = &self.seen;
        self.lights.clear();
        for (k, node) in self.nodes.iter().enumerate().filter(|&(k, _)| cos_i[k] > 0.0) {
            self.lights.push(Incident {
                angles: Angles {
                    cos_i: cos_i[k],
                    cos_o: point.cos_o,
                    cos_h: cos_h[k],
                    sin2_h: sin2_h[k],
                    cos_d: cos_d[k],
                },
                energy: node.energy.map(|e| f64::from(e) * share),
                spread: Spread { du: du[k], du2: du2[k] },
            });
        }
        &self.lights
    }

    /// The nodes of the cut: direction of the energy's centroid (world, unit length up to rounding) and energy. For reflectances that
    /// are not basis lobes.
    pub fn directions(&self) -> impl Iterator<Item = (Vec3, Rgb)> + '_ {
        self.nodes.iter().map(|node| (widen(node.centroid), widen(node.energy)))
    }
}

/// Cells finer than a texel that were looked at last. They are computed on demand, and neighbouring points look at the same ones.
/// By their [`Cell::slot`].
#[derive(Debug)]
struct Recent(Vec<Option<(Cell, Node)>>);

impl Recent {
    /// The light of a cell.
    #[inline]
    fn node(&mut self, pyramid: &LightPyramid, cell: Cell) -> Node {
        if cell.is_at_least_a_texel() {
            return pyramid.node(cell);
        }
        let slot = &mut self.0[cell.slot(RECENT)];
        match slot {
            Some((found, node)) if *found == cell => *node,
            _ => slot.insert((cell, pyramid.node(cell))).1,
        }
    }
}

/// Number of cells that are kept: they fit into the second-level cache.
const RECENT: usize = 4096;

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

    #[inline]
    fn error(&self, node: &Node, centroid: Vec3, cos_i: f64) -> f64 {
        let (energy, spread2) = (f64::from(strongest(node.energy)), node.spread2());
        let horizon = cos_i < f64::from(node.radius) + self.reach;
        let error = match self.band {
            // The cosine has curvature cos; at the horizon it has a kink, a first-order error over the part that is cut off.
            Band::Diffuse(_) if horizon => DIFFUSE_CARE * KINK * spread2.sqrt(),
            Band::Diffuse(bend) => DIFFUSE_CARE * 0.5 * spread2 * (cos_i.abs() + bend),
            Band::Glossy(.., tail) => {
                let (distribution, curvature) = self.peak_over(node, centroid, tail);
                let kink = if horizon { KINK * (spread2.sqrt() / self.lower).min(1.0) } else { 0.0 };
                spread2 * (curvature + SLOW_FACTORS * distribution) + kink * distribution
            }
        };
        energy * self.shading * error
    }

    /// Upper bounds over the node and the band's widths of the distribution `D` and of its curvature along the sphere of light
    /// directions (per square chord).
    #[inline]
    fn peak_over(&self, node: &Node, centroid: Vec3, tail: Tail) -> (f64, f64) {
        let half = centroid + self.point.view;
        let inverse = 1.0 / half.length_squared().max(f64::MIN_POSITIVE);
        // A step of light direction moves the half vector by at most 1 / (2 v.h) of it.
        let turn = inverse.sqrt().min(10.0);
        let along = self.point.normal.dot(half);
        let sin2 = (1.0 - along * along * inverse).max(0.0);
        // A half vector below the surface counts as one in the surface; the node may still contain the mirror direction.
        let sin = if along > 0.0 { sin2.sqrt() } else { 1.0 };
        let nearest = (sin - f64::from(node.radius) * turn - self.reach).max(0.0);
        let t2 = nearest * nearest;
        let [low2, high2] = self.squares;
        if tail == Tail::Long {
            // `k / d` with a factor `k` that grows slowly with the width and a divisor `d` that grows with it.
            let d = t2 + low2 * (1.0 - t2);
            return (self.long_peak / d, 2.0 * turn * turn * self.long_peak / (d * d));
        }
        let d = |a2: f64| {
            let q = t2 + a2 * (1.0 - t2);
            (a2 / (PI * q * q), q)
        };
        // a^2/q^2 is largest at a = t, a^2/q^3 at a = t / sqrt(2).
        let (distribution, _) = d(t2.clamp(low2, high2));
        let (sharpest, q) = d((0.5 * t2).clamp(low2, high2));
        (distribution, 2.0 * turn * turn * sharpest / q)
    }
}

/// The cosine lobe needs few nodes, so their errors average out less: it gets a tighter tolerance.
const DIFFUSE_CARE: f64 = 6.0;

/// Curvature, in units of the distribution, of its factors: Fresnel's term, masking-shadowing, the cosine. Wide lobes are not smoother
/// than these factors.
const SLOW_FACTORS: f64 = 4.0;

/// For lobes wider than this, the second-order terms correct only about half of the error, because the factors of the distribution vary
/// as much as the distribution. Such lobes need few nodes and get a tighter tolerance.
const EVEN: f64 = 0.1;

/// Share of a node's size by which a kink at the horizon can shift its value.
const KINK: f64 = 0.1;
