//! Warps from the unit square to directions, with their densities per solid angle.
//!
//! Local frame: the normal is +Z. Sources: Shirley & Chiu 1997 (concentric disk); Heitz, *Sampling the GGX Distribution
//! of Visible Normals* (JCGT 7(4), 2018); Dupuy & Benyoub, *Sampling Visible GGX Normals with Spherical Caps* (2023).

use super::{Vec3, elementary::sin_cos};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Concentric map of the unit square to the unit disk.
#[must_use]
pub fn concentric_disk(u: [f64; 2]) -> [f64; 2] {
    let (x, y) = (2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0);
    if x == 0.0 && y == 0.0 {
        return [0.0, 0.0];
    }
    let (r, phi) = if x.abs() > y.abs() { (x, FRAC_PI_4 * (y / x)) } else { (y, FRAC_PI_2 - FRAC_PI_4 * (x / y)) };
    let (s, c) = sin_cos(phi);
    [r * c, r * s]
}

/// Cosine-weighted hemisphere; density `cos / pi`.
#[must_use]
pub fn cosine_hemisphere(u: [f64; 2]) -> Vec3 {
    let [x, y] = concentric_disk(u);
    Vec3::new(x, y, (1.0 - x * x - y * y).max(0.0).sqrt())
}

/// Density per solid angle of [`cosine_hemisphere`].
#[must_use]
pub fn cosine_hemisphere_pdf(cos_theta: f64) -> f64 {
    cos_theta.max(0.0) / PI
}

/// A GGX microfacet normal visible from `wo_local` (`wo_local.z > 0`), isotropic width `alpha`.
#[must_use]
pub fn ggx_visible_normal(wo_local: Vec3, alpha: f64, u: [f64; 2]) -> Vec3 {
    let stretched = Vec3::new(alpha * wo_local.x, alpha * wo_local.y, wo_local.z).normalize();
    let (s, c) = sin_cos(TAU * u[0]);
    let z = (1.0 - u[1]) * (1.0 + stretched.z) - stretched.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let h = Vec3::new(r * c, r * s, z) + stretched;
    Vec3::new(alpha * h.x, alpha * h.y, h.z.max(0.0)).normalize()
}

/// Density per solid angle of the *reflected direction* when its half vector comes from [`ggx_visible_normal`]:
/// `G1(wo) D(h) / (4 cos_theta_o)`.
#[must_use]
pub fn ggx_reflection_pdf(cos_theta_o: f64, cos_theta_h: f64, alpha: f64) -> f64 {
    if cos_theta_o <= 0.0 || cos_theta_h <= 0.0 {
        return 0.0;
    }
    let a2 = alpha * alpha;
    let sin2 = (1.0 - cos_theta_h * cos_theta_h).max(0.0);
    let d = sin2 + a2 * cos_theta_h * cos_theta_h;
    let ndf = a2 / (PI * d * d);
    // G1 / (4 cos) = 1 / (2 (cos + sqrt(a2 + (1 - a2) cos^2)))
    ndf / (2.0 * (cos_theta_o + (a2 + (1.0 - a2) * cos_theta_o * cos_theta_o).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Integrates the density over the sphere of directions by a midpoint rule in (cos, phi).
    #[test]
    fn ggx_reflection_density_integrates_to_one_over_the_sphere() {
        for (alpha, cos_o) in [(0.2, 0.9), (0.5, 0.6), (1.0, 0.95), (0.3, 0.2)] {
            let wo = Vec3::new((1.0_f64 - cos_o * cos_o).sqrt(), 0.0, cos_o);
            let (n, m) = (2000, 2000);
            let mut sum = 0.0;
            for i in 0..n {
                let z = -1.0 + 2.0 * (f64::from(i) + 0.5) / f64::from(n);
                let r = (1.0 - z * z).sqrt();
                for j in 0..m {
                    let (s, c) = sin_cos(TAU * (f64::from(j) + 0.5) / f64::from(m));
                    let h = (wo + Vec3::new(r * c, r * s, z)).normalize();
                    sum += ggx_reflection_pdf(cos_o, h.z, alpha);
                }
            }
            let total = sum * 4.0 * PI / f64::from(n * m);
            // Over the whole sphere: a half vector of the upper hemisphere may reflect the direction below the horizon.
            assert!((total - 1.0).abs() < 2e-3, "alpha {alpha} cos {cos_o}: {total}");
        }
    }

    #[test]
    fn visible_normals_follow_their_density() {
        // Mean cosine of sampled half vectors against a quadrature of the same density.
        let (alpha, wo) = (0.4, Vec3::new(0.8, 0.0, 0.6));
        let n = 400;
        let mut sampled = 0.0;
        for i in 0..n {
            for j in 0..n {
                let u = [(f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n)];
                sampled += ggx_visible_normal(wo, alpha, u).z;
            }
        }
        sampled /= f64::from(n * n);
        let mut expected = 0.0;
        let m = 2000;
        for i in 0..m {
            let z = (f64::from(i) + 0.5) / f64::from(m);
            let r = (1.0 - z * z).sqrt();
            for j in 0..m {
                let (s, c) = sin_cos(TAU * (f64::from(j) + 0.5) / f64::from(m));
                let h = Vec3::new(r * c, r * s, z);
                // density of h = pdf(reflected) * 4 (wo.h)
                expected += z * ggx_reflection_pdf(wo.z, h.z, alpha) * 4.0 * wo.dot(h).max(0.0);
            }
        }
        expected *= TAU / f64::from(m * m);
        assert!((sampled - expected).abs() < 1e-3, "{sampled} {expected}");
    }
}
