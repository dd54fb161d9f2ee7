//! From linear Rec. 709 to the working space: XYZ, CIELAB, LAB2000HL.
//!
//! The constants are those of the authors' program (Getreuer's `colorspace.m` as shipped with CID). XYZ to RGB is the
//! rounded sRGB matrix. RGB to XYZ is its numerical inverse, which differs from the standard's forward matrix by 1e-4.
//! The white is D65 for 2 degrees, (0.950456, 1, 1.088754).

use std::sync::LazyLock;

use crate::math::real::Real;
use glam::{DMat3, DVec3};

use super::lab2000hl::{Lab2000hl, lightness_row};
use super::row_math::RowMath;

/// A 3 x 3 matrix by rows.
pub(super) type Matrix<R = f64> = [[R; 3]; 3];

/// Channels of a row of the working space.
pub(super) const LIGHTNESS: usize = 0;
/// a00.
pub(super) const A: usize = 1;
/// b00.
pub(super) const B: usize = 2;
/// sqrt(a00^2 + b00^2).
pub(super) const CHROMA: usize = 3;

/// Linear Rec. 709 to XYZ.
pub(super) static RGB_TO_XYZ: LazyLock<Matrix> = LazyLock::new(|| inverse(&XYZ_TO_RGB));

/// Divides XYZ by the white.
pub(super) const WHITEN: Matrix = [[1.0 / 0.950_456, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0 / 1.088_754]];

const XYZ_TO_RGB: Matrix = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]];

/// CIELAB's f is linear below this value.
const LAB_THRESHOLD: f64 = 0.008_856;

/// CIELAB of a linear Rec. 709 colour whose white is (1, 1, 1).
#[cfg(test)]
pub(super) fn lab_from_linear(rgb: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = apply(&product(&WHITEN, &RGB_TO_XYZ), rgb);
    lab(x, y, z)
}

/// Linear Rec. 709 of a CIELAB colour. Components are below 0 or above 1 outside the gamut.
#[must_use]
pub fn linear_from_lab([l, a, b]: [f64; 3]) -> [f64; 3] {
    let fy = (l + 16.0) / 116.0;
    let expand = |f: f64| {
        let line = (f - 4.0 / 29.0) * (108.0 / 841.0);
        if line < LAB_THRESHOLD { line } else { f * f * f }
    };
    apply(&product(&XYZ_TO_RGB, &inverse(&WHITEN)), [fy + a / 500.0, fy, fy - b / 200.0].map(expand))
}

/// Fills a row of the working space from rows of XYZ relative to the white.
#[inline(always)]
pub(super) fn working_row<R: RowMath>(space: &Lab2000hl, xyz: [&[R]; 3], working: [&mut [R]; 4]) {
    let [l, a, b, chroma] = working;
    let n = l.len();
    let (a, b, chroma) = (&mut a[..n], &mut b[..n], &mut chroma[..n]);
    let (x, y, z) = (&xyz[0][..n], &xyz[1][..n], &xyz[2][..n]);
    for i in 0..n {
        [l[i], a[i], b[i]] = lab(x[i], y[i], z[i]);
    }
    lightness_row(l);
    space.chroma_row(a, b);
    for i in 0..n {
        chroma[i] = (a[i] * a[i] + b[i] * b[i]).sqrt();
    }
}

/// Multiplies each colour of three rows by a matrix, in place.
#[inline(always)]
pub(super) fn transform_row<R: Real>(matrix: &Matrix<R>, rows: [&mut [R]; 3]) {
    let [r, g, b] = rows;
    let n = r.len();
    let (g, b) = (&mut g[..n], &mut b[..n]);
    for i in 0..n {
        [r[i], g[i], b[i]] = apply(matrix, [r[i], g[i], b[i]]);
    }
}

#[inline(always)]
fn lab<R: RowMath>(x: R, y: R, z: R) -> [R; 3] {
    let (fx, fy, fz) = (compress(x), compress(y), compress(z));
    [R::of(116.0) * fy - R::of(16.0), R::of(500.0) * (fx - fy), R::of(200.0) * (fy - fz)]
}

/// CIELAB's f: a cube root, linear below the threshold. Values may be negative after a filter.
#[inline(always)]
fn compress<R: RowMath>(t: R) -> R {
    let root = t.max(R::of(LAB_THRESHOLD)).cube_root();
    let line = t * R::of(841.0 / 108.0) + R::of(4.0 / 29.0);
    if t < R::of(LAB_THRESHOLD) { line } else { root }
}

/// The matrix times a column vector.
#[inline(always)]
pub(super) fn apply<R: Real>(m: &Matrix<R>, v: [R; 3]) -> [R; 3] {
    [
        m[0][0] * v[0] + m[0][1] * v[1] + m[0][2] * v[2],
        m[1][0] * v[0] + m[1][1] * v[1] + m[1][2] * v[2],
        m[2][0] * v[0] + m[2][1] * v[1] + m[2][2] * v[2],
    ]
}

/// The matrix product a b, which applies `b` first.
pub(super) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j]))
}

/// The inverse of a regular matrix.
pub(super) fn inverse(m: &Matrix) -> Matrix {
    let [r0, r1, r2] = m.map(DVec3::from_array);
    let inverse = DMat3::from_cols(r0, r1, r2).inverse(); // of the transpose
    [inverse.x_axis, inverse.y_axis, inverse.z_axis].map(|row| row.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_times_its_inverse_is_the_identity() {
        let identity = product(&inverse(&XYZ_TO_RGB), &XYZ_TO_RGB);
        for (i, row) in identity.iter().enumerate() {
            for (j, x) in row.iter().enumerate() {
                assert!((x - f64::from(u8::from(i == j))).abs() < 1e-15, "{identity:?}");
            }
        }
    }

    #[test]
    fn cielab_and_back_is_the_identity() {
        for rgb in [[0.0; 3], [1.0; 3], [0.002, 0.001, 0.003], [0.9, 0.02, 0.4], [0.0, 0.0, 1.0]] {
            let back = linear_from_lab(lab_from_linear(rgb));
            assert!(rgb.iter().zip(back).all(|(x, y)| (x - y).abs() < 1e-12), "{rgb:?} {back:?}");
        }
    }

    #[test]
    fn cielab_is_continuous_at_its_threshold_and_linear_below_zero() {
        assert!((compress(LAB_THRESHOLD) - compress(LAB_THRESHOLD - 1e-12)).abs() < 1e-5);
        assert!((compress(-0.1_f64) + 0.1 * 841.0 / 108.0 - 4.0 / 29.0).abs() < 1e-15);
    }
}
