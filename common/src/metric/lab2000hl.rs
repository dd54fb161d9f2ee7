//! LAB2000HL, the hue-linear working space in which Euclidean distances approximate CIEDE2000.
//!
//! Source: Lissner & Urban, *Toward a Unified Color Space for Perception-Based Image Processing* (IEEE TIP 21(3),
//! 2012). Lightness is L00(L) = integral of 1/S_L from 0 to L, S_L = 1 + 0.015 (l-50)^2 / sqrt(20 + (l-50)^2)
//! (CIEDE2000). The authors publish (a, b) only as a table of unknown licence, so this program ships the fit `fit00`.
//! With C, h the CIELAB chroma and hue,
//!
//! C00 = ln(1 + 0.045 C) / 0.045 * r(C, h), h00 = h + d(C, h), r and d = sum over j < 4, m <= 6 of (C/128)^j {cos,
//! sin}(m h).
//!
//! The 2 x 52 coefficients were fitted by least squares to the authors' 257 x 257 table for this project (RMS 0.49
//! units). Scores are within 0.007 of those with the table. [`Lab2000hl::from_table`] reads the table, for comparisons.

use std::sync::{Arc, LazyLock};

use super::MetricError;
use super::row_math::RowMath;
use crate::math::{cell, real::Real};

/// The map from CIELAB to LAB2000HL.
#[derive(Debug, Clone, Default)]
pub struct Lab2000hl {
    table: Option<Arc<[[f64; 2]]>>,
}

impl Lab2000hl {
    /// The fitted map `fit00`, the default.
    #[must_use]
    pub fn fit00() -> Self {
        Self::default()
    }

    /// The map by bilinear interpolation in a table of (a00, b00) on the grid a, b = -128, -127, ..., 128.
    ///
    /// `bytes`: `257 x 257 x 2` little-endian `f64`, row b + 128, column a + 128. CIELAB values outside are clipped.
    ///
    /// # Errors
    /// [`MetricError::Table`] if the length is wrong or a value is not finite.
    pub fn from_table(bytes: &[u8]) -> Result<Self, MetricError> {
        let expected = GRID * GRID * 16;
        let error = |not_finite| MetricError::Table { expected, found: bytes.len(), not_finite };
        if bytes.len() != expected {
            return Err(error(None));
        }
        let (values, _) = bytes.as_chunks::<8>();
        let values: Vec<f64> = values.iter().map(|&b| f64::from_le_bytes(b)).collect();
        if let Some(index) = values.iter().position(|v| !v.is_finite()) {
            return Err(error(Some(index)));
        }
        Ok(Self { table: Some(values.chunks_exact(2).map(|ab| [ab[0], ab[1]]).collect()) })
    }

    /// LAB2000HL (L00, a00, b00) of a CIELAB colour (L, a, b); L is clipped to [0, 100].
    #[must_use]
    pub fn convert(&self, lab: [f64; 3]) -> [f64; 3] {
        let [mut l, mut a, mut b] = lab.map(|x| [x]);
        lightness_row(&mut l);
        self.chroma_row(&mut a, &mut b);
        [l[0], a[0], b[0]]
    }

    /// Replaces rows of CIELAB a and b by a00 and b00.
    #[inline(always)]
    pub(super) fn chroma_row<R: RowMath>(&self, a: &mut [R], b: &mut [R]) {
        let b = &mut b[..a.len()];
        if let Some(table) = &self.table {
            for i in 0..a.len() {
                let (a00, b00) = bilinear(table, a[i].widen(), b[i].widen());
                (a[i], b[i]) = (R::of(a00), R::of(b00));
            }
        } else {
            let (ratio, offset) = (of(&RATIO), of(&HUE_OFFSET));
            for i in 0..a.len() {
                (a[i], b[i]) = fit00(&ratio, &offset, a[i], b[i]);
            }
        }
    }
}

/// Replaces a row of CIELAB L by L00. It is not vectorised, because it looks values up in a table.
#[inline(always)]
pub(super) fn lightness_row<R: Real>(l: &mut [R]) {
    let table = &LIGHTNESS[..];
    for l in l {
        let x = l.widen().clamp(0.0, 100.0) * LIGHTNESS_STEPS_PER_UNIT;
        let i = cell(x, LIGHTNESS_STEPS);
        let fraction = x - i as f64;
        *l = R::of(table[i] + fraction * (table[i + 1] - table[i]));
    }
}

/// The cumulative midpoint sum with steps of 1e-3 that reproduces the authors' lightness table to 1.6e-10.
static LIGHTNESS: LazyLock<Box<[f64]>> = LazyLock::new(|| {
    let mut sum = 0.0;
    let steps = (0..LIGHTNESS_STEPS).map(|i| {
        let d = (i as f64 + 0.5) * 1e-3 - 50.0;
        sum += 1e-3 / (1.0 + 0.015 * d * d / (20.0 + d * d).sqrt());
        sum
    });
    std::iter::once(0.0).chain(steps).collect()
});
const LIGHTNESS_STEPS: usize = 100_000;
const LIGHTNESS_STEPS_PER_UNIT: f64 = 1000.0;

/// (a00, b00) of CIELAB (a, b). The hue angle is not computed: cos h and sin h are a/C and b/C, those of its multiples
/// follow by Chebyshev's recurrence, and only the small offset d needs a sine and a cosine.
#[inline(always)]
fn fit00<R: RowMath>(ratios: &Coefficients<R>, offsets: &Coefficients<R>, a: R, b: R) -> (R, R) {
    let chroma = (a * a + b * b).sqrt();
    // The smallest normal number of the lower precision, so that the inverse is finite in both.
    let inverse = R::ONE / chroma.max(R::of(f64::from(f32::MIN_POSITIVE)));
    let (cos_h, sin_h) = (a * inverse, b * inverse);
    let c = chroma * R::of(1.0 / 128.0);
    let (mut ratio, mut offset) = (cubic(ratios, 0, c), cubic(offsets, 0, c));
    let (mut cos_previous, mut sin_previous) = (R::ONE, R::ZERO);
    let twice = R::of(2.0) * cos_h;
    let (mut cos_m, mut sin_m) = (cos_h, sin_h);
    for m in 0..6 {
        ratio += cubic(ratios, 2 * m + 1, c) * cos_m + cubic(ratios, 2 * m + 2, c) * sin_m;
        offset += cubic(offsets, 2 * m + 1, c) * cos_m + cubic(offsets, 2 * m + 2, c) * sin_m;
        let next = (twice * cos_m - cos_previous, twice * sin_m - sin_previous);
        (cos_previous, sin_previous) = (cos_m, sin_m);
        (cos_m, sin_m) = next;
    }
    let chroma00 = (R::of(0.045) * chroma).ln_one_plus() * R::of(1.0 / 0.045) * ratio;
    let (sin_d, cos_d) = offset.sine_cosine();
    (chroma00 * (cos_h * cos_d - sin_h * sin_d), chroma00 * (sin_h * cos_d + cos_h * sin_d))
}

/// Four rows as [`RATIO`].
type Coefficients<R> = [[R; 13]; 4];

#[inline(always)]
fn of<R: Real>(coefficients: &Coefficients<f64>) -> Coefficients<R> {
    coefficients.map(|row| row.map(R::of))
}

/// The polynomial in `c` whose coefficients are column `term`.
#[inline(always)]
fn cubic<R: Real>(rows: &Coefficients<R>, term: usize, c: R) -> R {
    rows[0][term] + c * (rows[1][term] + c * (rows[2][term] + c * rows[3][term]))
}

#[inline(always)]
fn bilinear(table: &[[f64; 2]], a: f64, b: f64) -> (f64, f64) {
    let position = |x: f64| {
        let x = x.clamp(-128.0, 128.0) + 128.0;
        let i = cell(x, GRID - 1);
        (i, x - i as f64)
    };
    let ((ia, fa), (ib, fb)) = (position(a), position(b));
    let corner = ib * GRID + ia;
    let channel = |k: usize| {
        (1.0 - fb) * ((1.0 - fa) * table[corner][k] + fa * table[corner + 1][k])
            + fb * ((1.0 - fa) * table[corner + GRID][k] + fa * table[corner + GRID + 1][k])
    };
    (channel(0), channel(1))
}

/// Points of the table along each axis.
const GRID: usize = 257;

/// Chroma ratio: row j holds the coefficients of (C/128)^j times 1, cos h, sin h, cos 2h, sin 2h, ..., sin 6h.
const RATIO: [[f64; 13]; 4] = [
    [
        1.1734204, 0.0145422, 0.0083922, 0.0955007, 0.0010367, 0.0033926, -0.0149022, 0.015315, -0.0103044, 0.0135969,
        0.0041732, -0.00092, -0.0099975,
    ],
    [
        -0.4316437, 0.1355966, 0.0280723, -0.3465757, 0.1297378, 0.2113029, 0.0790653, -0.1929031, -0.0201094,
        -0.1484806, -0.0317102, 0.0256285, 0.1236383,
    ],
    [
        0.4939551, -0.4229115, 0.0375244, 0.6037197, -0.1072728, -0.3373492, -0.0843799, 0.4241756, -0.0464335,
        0.1956162, 0.075492, -0.0890752, -0.2005537,
    ],
    [
        -0.1685728, 0.2760477, -0.0491288, -0.3720204, 0.0282279, 0.1655559, 0.0257643, -0.2366598, 0.0696378,
        -0.0693952, -0.0605178, 0.0493933, 0.0890185,
    ],
];
/// Hue offset in radians, laid out as [`RATIO`].
const HUE_OFFSET: [[f64; 13]; 4] = [
    [
        -0.0123766, -0.0212097, -0.0338822, 0.0148458, 0.012134, -0.0235563, -0.0050309, 0.0023761, -0.0108501,
        -0.0354622, 0.0112944, -0.0066142, -0.0017589,
    ],
    [
        0.1968817, 0.2400058, 0.1988796, -0.2576113, -0.0000985, 0.2740374, 0.0352461, 0.0177246, 0.0286951, 0.3291944,
        -0.0160901, 0.0870116, -0.1151405,
    ],
    [
        -0.5336189, -0.6485418, 0.3640845, 0.7072889, -0.0519216, -0.3893703, -0.3220801, -0.2091679, -0.1260601,
        -0.8011632, 0.049237, -0.1275075, 0.467352,
    ],
    [
        0.2907416, 0.3428174, -0.3553611, -0.4268299, 0.0163125, 0.2438392, 0.1827031, 0.2083873, 0.059476, 0.4698807,
        -0.0820898, -0.0177519, -0.341992,
    ],
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lightness_is_the_integral_of_the_ciede2000_weight() {
        let l00 = |l: f64| Lab2000hl::fit00().convert([l, 0.0, 0.0])[0];
        // End value of the authors' table, from its accompanying reference.
        assert!((l00(100.0) - 75.153_186_418).abs() < 1e-9 && l00(0.0) == 0.0);
        assert_eq!((l00(-3.0), l00(120.0)), (l00(0.0), l00(100.0)));
        let slope = (l00(50.0 + 1e-3) - l00(50.0 - 1e-3)) / 2e-3;
        assert!((slope - 1.0).abs() < 1e-6, "S_L(50) = 1, slope {slope}");
    }

    #[test]
    fn the_fit_is_the_documented_sum_of_harmonics() {
        for i in -40..=40 {
            for j in -40..=40 {
                let (a, b) = (f64::from(i) * 3.3, f64::from(j) * 3.3 + 0.1);
                let (c, h) = (libm::hypot(a, b), libm::atan2(b, a));
                let sum = |rows: &[[f64; 13]; 4]| -> f64 {
                    (0..4)
                        .flat_map(|j| (0..13usize).map(move |k| (j, k)))
                        .map(|(j, k)| {
                            let angle = f64::from(u32::try_from(k.div_ceil(2)).unwrap()) * h;
                            let harmonic = if k % 2 == 1 || k == 0 { libm::cos(angle) } else { libm::sin(angle) };
                            rows[j][k] * (c / 128.0).powi(i32::try_from(j).unwrap()) * harmonic
                        })
                        .sum()
                };
                let (c00, h00) = (libm::log1p(0.045 * c) / 0.045 * sum(&RATIO), h + sum(&HUE_OFFSET));
                let (a00, b00) = fit00(&RATIO, &HUE_OFFSET, a, b);
                let error = libm::hypot(a00 - c00 * libm::cos(h00), b00 - c00 * libm::sin(h00));
                assert!(error < 1e-11, "{a} {b}: {error:e}");
            }
        }
        assert_eq!(fit00(&RATIO, &HUE_OFFSET, 0.0, 0.0), (0.0, 0.0));
    }

    #[test]
    fn a_table_is_interpolated_and_clipped() {
        let mut bytes = Vec::new();
        for row in 0..257 {
            for column in 0..257 {
                let (a, b) = (f64::from(column) - 128.0, f64::from(row) - 128.0);
                bytes.extend([2.0 * a + 1.0, a - 3.0 * b].map(f64::to_le_bytes).concat());
            }
        }
        let space = Lab2000hl::from_table(&bytes).unwrap();
        let at = |a, b| space.convert([50.0, a, b]);
        assert_eq!(at(-10.25, 3.5)[1..], [-19.5, -20.75]);
        assert_eq!(at(500.0, -500.0)[1..], [257.0, 512.0]);
        assert_eq!(at(128.0, 128.0)[1..], [257.0, -256.0]);
    }

    #[test]
    fn an_invalid_table_is_refused() {
        let message = Lab2000hl::from_table(&[0; 24]).unwrap_err().to_string();
        assert!(message.contains("(1056784 bytes), found 24"), "{message}");
        let mut bytes = vec![0; 257 * 257 * 16];
        bytes[80..88].copy_from_slice(&f64::NAN.to_le_bytes());
        let message = Lab2000hl::from_table(&bytes).unwrap_err().to_string();
        assert!(message.contains("value 10 not finite"), "{message}");
    }
}
