//! Sample positions inside a pixel.
//!
//! A photo's pixel is a mean over its area. The transport tables compute that mean by Gauss-Legendre quadrature. Its order depends on
//! the turn of the normal over the pixel, in widths of the sharpest lobe.

use crate::math::sampling::PointStream;

/// A position inside a pixel, in [0, 1]^2, and its share of the mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Position {
    /// Horizontal offset.
    pub x: f64,
    /// Vertical offset.
    pub y: f64,
    /// Share of the mean; shares of one pixel sum to 1.
    pub weight: f64,
}

/// Positions for a pixel over which the normal turns by `spread_rad`, for lobes no sharper than `alpha`.
#[must_use]
pub fn positions(spread_rad: f64, alpha: f64) -> Vec<Position> {
    tensor(order(spread_rad, alpha))
}

/// Positions for a pixel that the silhouette cuts: the first `count` points of a low-discrepancy sequence at which `hit(x, y)` holds, so
/// that a barely covered pixel gets as many as one that is almost full. Empty if no point hits.
#[must_use]
pub fn on_object(count: usize, hit: impl Fn(f64, f64) -> bool) -> Vec<Position> {
    let stream = PointStream::new(SILHOUETTE_STREAM);
    let points = (0..SILHOUETTE_TRIES).map(|index| stream.point(index)).filter(|&[x, y, ..]| hit(x, y));
    let mut positions: Vec<Position> = points.take(count).map(|[x, y, ..]| Position { x, y, weight: 1.0 }).collect();
    let weight = 1.0 / positions.len() as f64;
    positions.iter_mut().for_each(|p| p.weight = weight);
    positions
}

/// Points of the pixel that are tried: enough to find an object that covers a 256th of the pixel.
const SILHOUETTE_TRIES: u32 = 1024;

/// The points are the same in every pixel, so that neighbours differ smoothly.
const SILHOUETTE_STREAM: u64 = 0;

/// Gauss-Legendre order per axis. With the turn over the pixel in lobe widths, `q`, the error of order `n` falls as `q^(2n)`;
/// the limits keep it below 2e-3 of the lobe's peak (see the test).
fn order(spread_rad: f64, alpha: f64) -> usize {
    let q = spread_rad / alpha;
    LIMITS.iter().position(|&limit| q < limit).map_or(RULES.len() - 1, |i| i)
}

const LIMITS: [f64; 5] = [0.08, 0.5, 1.0, 1.5, 2.0];

/// Gauss-Legendre rules on [0, 1]: (node, weight).
const RULES: [&[(f64, f64)]; 6] = [
    &[(0.5, 1.0)],
    &[(0.211_324_865_405_187_1, 0.5), (0.788_675_134_594_812_9, 0.5)],
    &[(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)],
    &[
        (0.069_431_844_202_973_7, 0.173_927_422_568_726_9),
        (0.330_009_478_207_571_9, 0.326_072_577_431_273_1),
        (0.669_990_521_792_428_1, 0.326_072_577_431_273_1),
        (0.930_568_155_797_026_3, 0.173_927_422_568_726_9),
    ],
    &[
        (0.046_910_077_030_668, 0.118_463_442_528_094_5),
        (0.230_765_344_947_158_5, 0.239_314_335_249_683_2),
        (0.5, 0.284_444_444_444_444_4),
        (0.769_234_655_052_841_5, 0.239_314_335_249_683_2),
        (0.953_089_922_969_332, 0.118_463_442_528_094_5),
    ],
    &[
        (0.025_446_043_828_620_7, 0.064_742_483_084_434_8),
        (0.129_234_407_200_302_8, 0.139_852_695_744_638_3),
        (0.297_077_424_311_301_4, 0.190_915_025_252_559_5),
        (0.5, 0.208_979_591_836_734_7),
        (0.702_922_575_688_698_6, 0.190_915_025_252_559_5),
        (0.870_765_592_799_697_2, 0.139_852_695_744_638_3),
        (0.974_553_956_171_379_3, 0.064_742_483_084_434_8),
    ],
];

fn tensor(order: usize) -> Vec<Position> {
    let rule = RULES[order];
    rule.iter().flat_map(|&(y, wy)| rule.iter().map(move |&(x, wx)| Position { x, y, weight: wx * wy })).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_rule_integrates_polynomials_of_its_degree() {
        for rule in RULES {
            for degree in 0..2 * rule.len() {
                let power = |x: f64| (0..degree).fold(1.0, |p, _| p * x);
                let sum: f64 = rule.iter().map(|&(x, w)| w * power(x)).sum();
                assert!((sum - 1.0 / (degree as f64 + 1.0)).abs() < 1e-14, "{} nodes, degree {degree}", rule.len());
            }
        }
    }

    /// The mean of a GGX peak over a pixel, for several places of the peak.
    #[test]
    fn the_mean_of_a_lobe_is_within_a_five_hundredth_of_its_peak() {
        const TOLERANCE: f64 = 2e-3;
        for q in [0.05, 0.079, 0.3, 0.49, 0.8, 0.99, 1.4, 1.49, 1.9, 2.5, 2.9] {
            let lobe = |x: f64| 1.0 / ((1.0 + x * x * q * q) * (1.0 + x * x * q * q));
            for centre in [0.0, 0.2, 0.5, 0.9] {
                let rule = RULES[order(q, 1.0)];
                let ours: f64 = rule.iter().map(|&(x, w)| w * lobe(x - centre)).sum();
                let n = 20_000;
                let exact: f64 = (0..n).map(|i| lobe((f64::from(i) + 0.5) / f64::from(n) - centre)).sum();
                assert!((ours - exact / f64::from(n)).abs() < TOLERANCE, "q {q} centre {centre}");
            }
        }
    }
}
