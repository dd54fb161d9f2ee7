//! The cut through the light pyramid for one surface point: as few nodes as the lobes allow.
//!
//! Taking a node as a point at its energy centroid leaves a second-order error, `1/2 tr(H S)`, with `H` the Hessian of
//! `f cos` and `S` the energy's covariance over the node. A node is split while its error, bounded from above over
//! the node and over the widths of a [`Band`], exceeds the tolerance. Nothing is random: neighbouring pixels get neighbouring
//! cuts, and the error is smooth instead of noise.

use super::pyramid::{Cell, LightPyramid, Node, strongest};
use crate::{
    brdf::{Angles, Incident, Spread},
    math::{Vec3, widen},
};
use std::f64::consts::PI;

/// What the cut is refined for: a range of lobe widths, or the cosine lobe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Band {
    /// A lobe as wide as the hemisphere.
    Diffuse,
    /// Microfacet lobes of GGX alpha from `.0` to `.1`.
    Glossy(f64, f64),
}

/// A surface point: unit normal and direction to the viewer, world space.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Surface normal.
    pub normal: Vec3,
    /// Towards the viewer.
    pub view: Vec3,
    /// Their cosine, positive.
    pub cos_o: f64,
}

impl Point {
    /// A point seen from above the surface; `None` when the view is not above the horizon.
    #[must_use]
    pub fn new(normal: Vec3, view: Vec3) -> Option<Self> {
        let cos_o = normal.dot(view);
        (cos_o > 0.0).then_some(Self { normal, view, cos_o })
    }
}

/// Reusable storage for cuts.
#[derive(Debug, Default)]
pub struct Cut {
    stack: Vec<Cell>,
    /// The nodes of the last cut, as incident light.
    pub lights: Vec<Incident>,
}

impl Cut {
    /// Refines the pyramid for `point` until no node's error in radiance, for a lobe of unit weight, exceeds `tolerance`; for glossy
    /// lobes `tolerance` times `n.v`.
    ///
    /// The `F5` part of a lobe has a twentieth of its mean radiance and nearly all of it towards the rim, where `n.v` is small: with
    /// the same tolerance everywhere its relative error is twenty times that of the lobe. Half of that goes for a fifth
    /// more terms.
    pub fn refine(&mut self, pyramid: &LightPyramid, point: &Point, band: Band, tolerance: f64) {
        let tolerance = match band {
            Band::Diffuse => tolerance,
            Band::Glossy(..) => tolerance * point.cos_o.max(LEAST_COS_D),
        };
        self.lights.clear();
        self.stack.clear();
        self.stack.extend(pyramid.roots());
        while let Some(cell) = self.stack.pop() {
            let node = pyramid.node(cell);
            let centroid = widen(node.centroid);
            let angles = Angles::new(point.normal, centroid, point.view);
            if angles.cos_i < -f64::from(node.radius) || strongest(node.energy) == 0.0 {
                continue;
            }
            if error_bound(&node, &angles, band) > tolerance {
                let before = self.stack.len();
                self.stack.extend(pyramid.children(cell));
                if self.stack.len() > before {
                    continue;
                }
            }
            if angles.cos_i > 0.0 {
                self.lights.push(Incident {
                    angles,
                    energy: node.energy.map(f64::from),
                    spread: spread(&node, point, centroid, &angles),
                });
            }
        }
    }
}

/// The half vector turns by half of the light's step in the plane of reflection, by `1/(2 v.h)` of it across: at grazing view far more
/// across than along. How much of that lies along the half vector's offset from the normal follows from the share of the
/// offset that is across the plane.
fn spread(node: &Node, point: &Point, light: Vec3, angles: &Angles) -> Spread {
    let light2 = f64::from(node.spread2);
    let cos_d2 = (angles.cos_d * angles.cos_d).max(LEAST_COS_D * LEAST_COS_D);
    let across = light.cross(point.view);
    let offset = point.normal.dot(across);
    let square = across.length_squared() * angles.sin2_h;
    let share = if square > 0.0 { (offset * offset / square).min(1.0) } else { 0.5 };
    let radial = (cos_d2 * (1.0 - share) + share) / (1.0 + cos_d2);
    Spread { light2, half2: 0.125 * light2 * (1.0 + 1.0 / cos_d2), radial }
}

/// `v.h` below this is taken as this: light that comes from straight behind the surface turns the half vector without bound.
const LEAST_COS_D: f64 = 0.05;

fn error_bound(node: &Node, angles: &Angles, band: Band) -> f64 {
    let (energy, spread2) = (f64::from(strongest(node.energy)), f64::from(node.spread2));
    let horizon = angles.cos_i < f64::from(node.radius);
    match band {
        Band::Diffuse => {
            // The cosine has curvature cos; at the horizon it has a kink, a first-order error over the part that is cut off.
            let smooth = 0.5 * spread2 * angles.cos_i.abs();
            energy / PI * if horizon { KINK * spread2.sqrt() } else { smooth }
        }
        Band::Glossy(lower, upper) => {
            let (distribution, curvature) = peak_over(node, angles, lower, upper);
            // G n.l / (4 n.l n.v) is at most G1(v) / (4 n.v).
            let shading = |alpha: f64| {
                let a2 = alpha * alpha;
                0.5 / (angles.cos_o + (a2 + (1.0 - a2) * angles.cos_o * angles.cos_o).sqrt())
            };
            let mut error = spread2 * (curvature + distribution);
            if horizon {
                error += KINK * distribution * (spread2.sqrt() / lower).min(1.0);
            }
            energy * shading(lower) * error
        }
    }
}

/// Share of a node's size by which a kink at the horizon can shift its value.
const KINK: f64 = 0.1;

/// Upper bounds over the node and the band's widths of the distribution `D` and of its curvature along the sphere of light
/// directions (per square chord).
fn peak_over(node: &Node, angles: &Angles, lower: f64, upper: f64) -> (f64, f64) {
    // A step of light direction moves the half vector by at most this factor.
    let turn = 0.5 / angles.cos_d.max(LEAST_COS_D);
    let nearest = (angles.sin2_h.sqrt() - f64::from(node.radius) * turn).max(0.0);
    let t2 = if angles.cos_h > 0.0 { nearest * nearest } else { 1.0 };
    let d = |a2: f64| {
        let q = t2 + a2 * (1.0 - t2);
        (a2 / (PI * q * q), q)
    };
    // a^2/q^2 is largest at a = t, a^2/q^3 at a = t / sqrt(2).
    let (low2, high2) = (lower * lower, upper * upper);
    let (distribution, _) = d(t2.clamp(low2, high2));
    let (sharpest, q) = d((0.5 * t2).clamp(low2, high2));
    (distribution, 2.0 * turn * turn * sharpest / q)
}
