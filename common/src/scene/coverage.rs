//! The fraction of a pixel that an object covers.

use crate::math::to_f32;

/// The fraction of the pixel (column, row) where `hit(x, y)` holds, by 256 Hammersley points. They have one point in
/// each cell of a 16 x 16 grid and one in each of 256 rows and columns, which resolves edges of any direction.
///
/// A pixel is full if and only if its centre and its corners hit. So `hit` must hold between points where it holds: the
/// object is convex (a sphere) or interpolated between pixel centres (a normal map). If a corner misses, the result is
/// at most 255/256.
pub(super) fn pixel_coverage(column: usize, row: usize, hit: impl Fn(f64, f64) -> bool) -> f32 {
    let (x, y) = (column as f64, row as f64);
    if hit(x + 0.5, y + 0.5) && hit(x, y) && hit(x + 1.0, y) && hit(x, y + 1.0) && hit(x + 1.0, y + 1.0) {
        return 1.0;
    }
    let count = (0..=u8::MAX).filter(|&k| hit(x + unit(k), y + unit(k.reverse_bits()))).count();
    // Exact, because f32 holds every integer up to 256.
    to_f32(count.min(255) as f64 / 256.0)
}

/// The middle of part `k` of 256 equal parts of \[0, 1\].
fn unit(k: u8) -> f64 {
    (f64::from(k) + 0.5) / 256.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_planes_and_disks_have_their_areas() {
        assert_eq!(pixel_coverage(3, 2, |_, _| true), 1.0);
        assert_eq!(pixel_coverage(3, 2, |_, _| false), 0.0);
        assert_eq!(pixel_coverage(3, 2, |x, _| x < 3.25), 0.25);
        assert!((pixel_coverage(3, 2, |x, y| x - 3.0 < y - 2.0) - 0.5).abs() < 0.05);
        assert_eq!(pixel_coverage(3, 2, |_, y| y < 2.0 + 77.0 / 256.0), 77.0 / 256.0);
        // Only a corner misses, and no point lies there.
        assert_eq!(pixel_coverage(0, 0, |x, y| x + y > 0.01), 255.0 / 256.0);
        let disk = |x: f64, y: f64| (x - 4.0) * (x - 4.0) + (y - 4.0) * (y - 4.0) < 9.0;
        let area: f32 = (0..64).map(|k| pixel_coverage(k % 8, k / 8, disk)).sum();
        assert!((area - 9.0 * std::f32::consts::PI).abs() < 0.1, "{area}");
    }
}
