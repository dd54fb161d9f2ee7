//! The light of a pyramid node at a surface point: angles at the node's centroid, and a correction for its spread.
//!
//! Let `x` be the light's offset from the centroid `c` in the tangent plane there, of mean 0 and covariance `S`, and `L = 2 v.h`. To
//! second order the half vector `h = (l + v)/|l + v|`, `l = c + x - c |x|^2/2`, moves along a unit vector `r` across it by
//!
//! `r.x/L - (r.c)|x|^2/(2L) - (r.x)(h.x)/L^2`,
//!
//! and, with `r sin(th) = n - (n.h) h =: q` and `p` the step of the half vector, `u = 1 - (n.h)^2` changes by
//!
//! `-2 (n.h) q.p - (q.p)^2 + (n.h)^2 |p|^2`.
//!
//! The means of both follow from three quadratic forms of `S`.

use super::{point::Point, pyramid::Node};
use crate::{
    brdf::{Angles, Spread},
    math::{Vec3, frame::Frame, widen},
};

/// Lower limit of `v.h`: as light approaches the direction opposite to the view, a small step of it turns the half vector without
/// bound.
pub(super) const LEAST_COS_D: f64 = 0.05;

/// The angles of a node's light at a surface point, and the effect of its spread on them; `None` if all of it is below the horizon.
#[inline]
pub(super) fn seen_from(node: &Node, point: &Point) -> Option<(Angles, Spread)> {
    let centroid = widen(node.centroid);
    let cos_i = point.normal.dot(centroid);
    let radius = f64::from(node.radius);
    if cos_i <= -radius {
        return None;
    }
    let tangents = Frame::from_normal(centroid);
    let [a, b, c] = node.covariance.map(f64::from);
    let flat = |w: Vec3| (w.dot(tangents.tangent), w.dot(tangents.bitangent));
    let form = |(x, y): (f64, f64), (z, w): (f64, f64)| a * x * z + b * (x * w + y * z) + c * y * w;

    let mut angles = Angles::new(point.normal, centroid, point.view);
    let (normal, view) = (flat(point.normal), flat(point.view));
    let light2 = a + c;
    if cos_i < radius {
        angles.cos_i = above_horizon(cos_i, form(normal, normal), radius);
        if angles.cos_i <= 0.0 {
            return None;
        }
    }
    // The mean of the node's directions is shorter than 1 by exactly half their mean square chord from the centroid.
    angles.cos_i *= 1.0 - 0.5 * light2;
    // `h` and `q` in the tangent plane, in which the centroid has no component. Light opposite to the view has no half vector.
    let length = 2.0 * angles.cos_d.max(1e-9);
    let half = (view.0 / length, view.1 / length);
    let offset = (normal.0 - angles.cos_h * half.0, normal.1 - angles.cos_h * half.1);
    let scale = 0.5 / angles.cos_d.max(LEAST_COS_D);
    let scale2 = scale * scale;
    let along2 = form(offset, offset) * scale2;
    let step2 = (light2 - form(half, half)) * scale2;
    let bend = 0.5 * (cos_i - angles.cos_h * angles.cos_d) * light2 * scale + form(offset, half) * scale2;
    let cos2 = 1.0 - angles.sin2_h;
    let du = 2.0 * angles.cos_h * bend + cos2 * step2 - along2;
    Some((angles, Spread { du, du2: 4.0 * cos2 * along2 }))
}

/// Mean of `max(0, n.l)` over light of mean cosine `cos_i` and variance `variance`. The cosine is taken as uniformly distributed, no
/// farther than `radius` from its mean. Every lobe vanishes linearly at the horizon; without this mean, a node that crosses the horizon
/// would count fully or not at all.
fn above_horizon(cos_i: f64, variance: f64, radius: f64) -> f64 {
    // Rounding may make a variance of 0 negative.
    let reach = (3.0 * variance.max(0.0)).sqrt().min(radius);
    if cos_i >= reach {
        cos_i
    } else if cos_i <= -reach {
        0.0
    } else {
        (cos_i + reach) * (cos_i + reach) / (4.0 * reach)
    }
}

#[cfg(test)]
mod tests;
