//! A grid of normals on which integrals are computed and between which they are interpolated.
//!
//! If the direction to the camera follows from the normal ([`Viewpoint`]), so do all integrals of a surface point: they are functions
//! on the cap of visible normals, as smooth as the lobe, whatever the photo's size. The grid has rings around the cap's axis, equally
//! spaced up to its edge, and on each ring equally spaced nodes. Across the axis a ring continues on its opposite side.

use super::point::Point;
use crate::{
    math::{
        Vec3,
        arctangent::angle,
        cell,
        elementary::sin_cos,
        frame::Frame,
        hermite::{self, STENCIL},
    },
    scene::Viewpoint,
};
use std::f64::consts::{PI, TAU};

/// A grid on the cap of visible normals.
#[derive(Debug)]
pub(super) struct Grid {
    viewpoint: Viewpoint,
    frame: Frame,
    /// Angle between rings; the first ring is half of it from the axis, the last one on the edge of the cap.
    step: f64,
    rings: Vec<Ring>,
}

#[derive(Debug, Clone, Copy)]
struct Ring {
    /// Number of the ring's first node.
    first: usize,
    nodes: usize,
}

/// A node, and its weights for a value and for the estimate of the value's error.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Weighted {
    pub(super) node: usize,
    pub(super) value: f64,
    pub(super) error: f64,
}

/// The nodes that an interpolated value is made of.
pub(super) type Nodes = [Weighted; STENCIL * STENCIL];

impl Grid {
    /// A grid whose neighbouring nodes are at most `spacing_rad` apart.
    pub(super) fn new(viewpoint: Viewpoint, spacing_rad: f64) -> Self {
        let edge = viewpoint.reach_rad() * EDGE;
        let rings = cell((edge / spacing_rad + 0.5).ceil(), usize::MAX).max(STENCIL);
        let step = edge / (rings as f64 - 0.5);
        let mut first = 0;
        let rings = (0..rings).map(|ring| {
            let around = TAU * sin_cos((ring as f64 + 0.5) * step).0 / spacing_rad;
            let ring = Ring { first, nodes: cell(around.ceil(), usize::MAX).max(LEAST_NODES) };
            first += ring.nodes;
            ring
        });
        let rings = rings.collect();
        Self { viewpoint, frame: Frame::from_normal(viewpoint.axis()), step, rings }
    }

    /// Number of nodes.
    pub(super) fn nodes(&self) -> usize {
        self.rings.last().map_or(0, |ring| ring.first + ring.nodes)
    }

    /// The nodes around a normal. The error is estimated by the difference to interpolation from the inner 4 x 4 nodes.
    pub(super) fn stencil(&self, normal: Vec3) -> Nodes {
        let local = self.frame.to_local(normal);
        let from_axis = angle((local.x * local.x + local.y * local.y).sqrt(), local.z);
        let around = angle(local.y, local.x);
        // The rings of the opposite side come first: three of them, counted from the farthest one.
        let (position, count) = (from_axis / self.step - 0.5 + OPPOSITE as f64, self.rings.len() + OPPOSITE);
        let (first, values, checks) = hermite::checked(position, count);
        let mut nodes = [Weighted::default(); STENCIL * STENCIL];
        for (k, out) in nodes.chunks_exact_mut(STENCIL).enumerate() {
            let (ring, turned) = match (first + k).checked_sub(OPPOSITE) {
                Some(ring) => (ring, around),
                None => (OPPOSITE - 1 - (first + k), around + PI),
            };
            self.rings[ring].stencil(turned, [values[k], checks[k]], out);
        }
        nodes
    }

    /// Sorts nodes so that neighbours follow each other: by patches of [`PATCH`] rings and as far around.
    pub(super) fn patch(&self, node: usize) -> (usize, usize) {
        let ring = self.ring_of(node);
        let Ring { first, nodes } = self.rings[ring];
        let inner = self.rings[ring / PATCH * PATCH];
        let sectors = (inner.nodes / PATCH).max(1);
        (ring / PATCH, (node - first) * sectors / nodes)
    }

    /// The surface point of a node.
    pub(super) fn point(&self, node: usize) -> Option<Point> {
        let ring = self.ring_of(node);
        let Ring { first, nodes } = self.rings[ring];
        let (sin, cos) = sin_cos((ring as f64 + 0.5) * self.step);
        let (sin_around, cos_around) = sin_cos(TAU * (node - first) as f64 / nodes as f64);
        let normal = self.frame.to_world(Vec3::new(sin * cos_around, sin * sin_around, cos));
        Point::new(normal, self.viewpoint.view(normal))
    }

    fn ring_of(&self, node: usize) -> usize {
        self.rings.partition_point(|ring| ring.first <= node) - 1
    }
}

impl Ring {
    /// The nodes around an angle; their weights times those of the ring, for the value and for its check.
    fn stencil(self, around: f64, [value, check]: [f64; 2], out: &mut [Weighted]) {
        let position = (around + TAU) * (self.nodes as f64 / TAU);
        let left = position.floor();
        let first = cell(left, usize::MAX) + self.nodes - 2;
        let (values, checks) = (hermite::central(position - left), hermite::central_check(position - left));
        for (k, out) in out.iter_mut().enumerate() {
            let node = self.first + wrapped(first + k, self.nodes);
            let value = value * values[k];
            *out = Weighted { node, value, error: value - check * checks[k] };
        }
    }
}

/// `place` modulo `count`, for a place below four times the count: a division by a variable takes longer.
fn wrapped(place: usize, count: usize) -> usize {
    let twice = 2 * count;
    let place = if place >= twice { place - twice } else { place };
    if place >= count { place - count } else { place }
}

/// Rings of the opposite side that the stencil of a normal near the axis reads.
const OPPOSITE: usize = 3;

/// Nodes of the smallest ring: a function that is linear near the axis is interpolated to 1e-3 of its change over the ring.
const LEAST_NODES: usize = 12;

/// The last ring lies just inside the edge of the cap, where normals still face the camera.
const EDGE: f64 = 1.0 - 1e-6;

/// Rings of a patch whose nodes may share a cut.
const PATCH: usize = 4;

#[cfg(test)]
mod tests {
    use super::*;

    fn viewpoints() -> [Viewpoint; 2] {
        [Viewpoint::Distant(Vec3::Z), Viewpoint::OfSphere(Vec3::new(0.4, -0.8, 2.0))]
    }

    /// Normals spread over the cap, up to its edge.
    fn normals(viewpoint: Viewpoint) -> impl Iterator<Item = Vec3> {
        let frame = Frame::from_normal(viewpoint.axis());
        (0..500).map(move |k| {
            let (sin, cos) = sin_cos(viewpoint.reach_rad() * f64::from(k) / 500.0);
            let (y, x) = sin_cos(2.4 * f64::from(k));
            frame.to_world(Vec3::new(sin * x, sin * y, cos))
        })
    }

    #[test]
    fn places_wrap_around_the_ring() {
        for count in [1, 12, 13, 100] {
            assert!((0..4 * count).all(|place| wrapped(place, count) == place % count));
        }
    }

    #[test]
    fn nodes_are_visible_points_and_their_own_stencils() {
        for viewpoint in viewpoints() {
            let grid = Grid::new(viewpoint, 0.1);
            for node in 0..grid.nodes() {
                let point = grid.point(node).expect("a visible point");
                assert!((point.view - viewpoint.view(point.normal)).length() < 1e-15);
                let stencil = grid.stencil(point.normal);
                let rest = |w: &Weighted| if w.node == node { 1.0 - w.value } else { w.value.abs() };
                assert!(stencil.iter().map(rest).sum::<f64>() < 36.0 * 1e-9, "node {node}");
                assert!(stencil.iter().map(|w| w.error.abs()).sum::<f64>() < 36.0 * 1e-9, "node {node}");
            }
        }
    }

    /// A lobe around a fixed direction, also over the axis and up to the edge, and a kink across the cap.
    #[test]
    fn estimates_follow_the_error() {
        for viewpoint in viewpoints() {
            for spacing in [0.03, 0.06, 0.1] {
                let grid = Grid::new(viewpoint, spacing);
                for centre in
                    [Vec3::Z, Vec3::new(0.1, 0.1, 1.0), Vec3::X, Vec3::new(-1.0, 0.3, 0.5)].map(Vec3::normalize)
                {
                    let lobe = |normal: Vec3| {
                        let x2 = normal.cross(centre).length_squared() / 0.09;
                        1.0 / ((1.0 + x2) * (1.0 + x2))
                    };
                    let kink = |normal: Vec3| normal.dot(centre).max(0.0);
                    // Both interpolants miss a kink between the same nodes.
                    for (function, factor) in [(&lobe as &dyn Fn(Vec3) -> f64, 1.0), (&kink, 10.0)] {
                        let at = |node| function(grid.point(node).unwrap().normal);
                        let (mut errors, mut estimates) = (0.0, 0.0);
                        for normal in normals(viewpoint) {
                            let stencil = grid.stencil(normal);
                            let sum: f64 = stencil.iter().map(|w| w.value * at(w.node)).sum();
                            let estimate: f64 = stencil.iter().map(|w| w.error * at(w.node)).sum();
                            let error = (sum - function(normal)).abs();
                            errors += error;
                            estimates += estimate.abs();
                        }
                        assert!(errors < factor * estimates, "{viewpoint:?} {spacing}: {errors:.2e} {estimates:.2e}");
                    }
                }
            }
        }
    }

    /// A lobe around a fixed direction, as wide as 1 / .22 nodes: also over the axis and up to the edge.
    #[test]
    fn lobes_are_interpolated_to_three_thousandths_of_their_peak() {
        for viewpoint in viewpoints() {
            let grid = Grid::new(viewpoint, 0.22 * 0.3);
            for centre in [Vec3::Z, Vec3::new(0.1, 0.1, 1.0), Vec3::X, Vec3::new(-1.0, 0.3, 0.5)].map(Vec3::normalize) {
                let lobe = |normal: Vec3| {
                    let x2 = normal.cross(centre).length_squared() / 0.09;
                    1.0 / ((1.0 + x2) * (1.0 + x2))
                };
                for normal in normals(viewpoint) {
                    let value = |w: &Weighted| w.value * lobe(grid.point(w.node).unwrap().normal);
                    let sum: f64 = grid.stencil(normal).iter().map(value).sum();
                    assert!((sum - lobe(normal)).abs() < 3e-3, "{viewpoint:?} {normal}: {sum} {}", lobe(normal));
                }
            }
        }
    }

    #[test]
    fn nodes_of_a_patch_lie_together() {
        let grid = Grid::new(Viewpoint::Distant(Vec3::Z), 0.05);
        let mut patches = std::collections::BTreeMap::<_, Vec<Vec3>>::new();
        for node in 0..grid.nodes() {
            patches.entry(grid.patch(node)).or_default().push(grid.point(node).unwrap().normal);
        }
        let largest = patches.values().map(|normals| {
            let mean = normals.iter().sum::<Vec3>().normalize();
            normals.iter().map(|normal| (*normal - mean).length()).fold(0.0, f64::max)
        });
        // Half the diagonal of four by four nodes; sectors of the outer rings of a patch near the axis are wider.
        assert!(largest.fold(0.0, f64::max) < 0.3);
        assert!(patches.len() < grid.nodes() / 8);
    }
}
