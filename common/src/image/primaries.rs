//! Conversion of colours to Rec. 709: RGB to CIE XYZ by the file's chromaticities, chromatic adaptation of the white
//! point by Bradford's matrix, XYZ to Rec. 709 (Lindbloom, *RGB/XYZ Matrices* and *Chromatic Adaptation*; ICC.1:2022
//! annex E). The file's white, (1, 1, 1), becomes (1, 1, 1).

use crate::math::{Mat3, Vec3, narrow, widen};

/// CIE 1931 chromaticities (x, y) of red, green, blue and white.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Primaries {
    pub(super) red: [f64; 2],
    pub(super) green: [f64; 2],
    pub(super) blue: [f64; 2],
    pub(super) white: [f64; 2],
}

impl Primaries {
    /// ITU-R BT.709 and sRGB, white D65.
    pub(super) const REC_709: Self =
        Self { red: [0.64, 0.33], green: [0.30, 0.60], blue: [0.15, 0.06], white: [0.3127, 0.3290] };

    /// From eight numbers in the order x, y of red, green, blue, white.
    pub(super) fn from_array(v: [f64; 8]) -> Self {
        Self { red: [v[0], v[1]], green: [v[2], v[3]], blue: [v[4], v[5]], white: [v[6], v[7]] }
    }

    /// The matrix from linear colours of these primaries to Rec. 709; `Ok(None)` if they are those of Rec. 709.
    ///
    /// # Errors
    /// If the chromaticities span no triangle, or the white lies on an edge of the triangle.
    pub(super) fn to_rec709(self) -> Result<Option<Mat3>, NotPrimaries> {
        if self.is_rec709() {
            return Ok(None);
        }
        let ours = self.to_xyz().ok_or(NotPrimaries)?;
        let rec709 = Self::REC_709.to_xyz().ok_or(NotPrimaries)?;
        let matrix = rec709.inverse() * adapted(self.white) * ours;
        if matrix.is_finite() { Ok(Some(matrix)) } else { Err(NotPrimaries) }
    }

    fn is_rec709(self) -> bool {
        let corners = |p: Self| [p.red, p.green, p.blue, p.white];
        let differ = |(a, b): (f64, f64)| (a - b).abs() > TOLERANCE;
        let (ours, rec709) = (corners(self), corners(Self::REC_709));
        !ours.into_iter().flatten().zip(rec709.into_iter().flatten()).any(differ)
            && ours.into_iter().flatten().all(f64::is_finite)
    }

    /// Columns are the XYZ of full red, green and blue, scaled so that their sum is the white of luminance 1.
    fn to_xyz(self) -> Option<Mat3> {
        let columns = Mat3::from_cols(xyz(self.red), xyz(self.green), xyz(self.blue));
        let scale = columns.inverse() * xyz(self.white);
        let matrix = columns * Mat3::from_diagonal(scale);
        let determinant = matrix.determinant();
        (matrix.is_finite() && determinant.is_finite() && determinant.abs() > 1e-6).then_some(matrix)
    }
}

/// The matrix from XYZ, whose white is `white` with luminance 1, to Rec. 709.
pub(super) fn xyz_to_rec709(white: [f64; 2]) -> Mat3 {
    let rec709 = Primaries::REC_709.to_xyz().unwrap_or(Mat3::IDENTITY);
    rec709.inverse() * adapted(white)
}

/// The chromaticity of XYZ = (1, 1, 1).
pub(super) const EQUAL_ENERGY: [f64; 2] = [1.0 / 3.0, 1.0 / 3.0];

/// XYZ under another white, as it looks under D65.
fn adapted(white: [f64; 2]) -> Mat3 {
    let (from, to) = (BRADFORD * xyz(white), BRADFORD * xyz(Primaries::REC_709.white));
    BRADFORD.inverse() * Mat3::from_diagonal(to / from) * BRADFORD
}

/// The chromaticities are not those of primaries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NotPrimaries;

/// Applies a colour matrix to every pixel, in double precision.
pub(super) fn convert(pixels: &mut [[f32; 3]], matrix: Mat3) {
    for pixel in pixels {
        *pixel = narrow(matrix * widen(*pixel));
    }
}

/// XYZ of luminance 1 at a chromaticity.
fn xyz([x, y]: [f64; 2]) -> Vec3 {
    Vec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Bradford's cone response matrix (Lindbloom), by columns.
const BRADFORD: Mat3 = Mat3::from_cols(
    Vec3::new(0.8951, -0.7502, 0.0389),
    Vec3::new(0.2664, 1.7135, -0.0685),
    Vec3::new(-0.1614, 0.0367, 1.0296),
);

/// Files have chromaticities of three or four digits; sRGB's white is 0.3127 or 0.31271, 0.3290 or 0.32902.
const TOLERANCE: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rec_709_needs_no_conversion() {
        assert_eq!(Primaries::REC_709.to_rec709(), Ok(None));
        let near = Primaries { white: [0.31271, 0.32902], ..Primaries::REC_709 };
        assert_eq!(near.to_rec709(), Ok(None));
    }

    #[test]
    fn rec_2020_red_has_the_published_rec_709_coordinates() {
        // ITU-R BT.2087-0, the inverse of its equation (2): BT.2020 red in BT.709.
        let wide = Primaries { red: [0.708, 0.292], green: [0.170, 0.797], blue: [0.131, 0.046], ..Primaries::REC_709 };
        let matrix = wide.to_rec709().unwrap().unwrap();
        assert!((matrix * Vec3::X).abs_diff_eq(Vec3::new(1.6605, -0.1246, -0.0182), 1e-4));
        assert!((matrix * Vec3::ONE).abs_diff_eq(Vec3::ONE, 1e-12));
    }

    #[test]
    fn white_stays_white_across_white_points() {
        // ACES 2065-1 primaries, white near D60.
        let aces = Primaries::from_array([0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767]);
        let matrix = aces.to_rec709().unwrap().unwrap();
        assert!((matrix * Vec3::ONE).abs_diff_eq(Vec3::ONE, 1e-12));
        // The Academy's own AP0 to Rec. 709 matrix (Bradford), first column.
        assert!((matrix * Vec3::X).abs_diff_eq(Vec3::new(2.5217, -0.2765, -0.0154), 2e-3));
    }

    #[test]
    fn degenerate_primaries_are_refused() {
        let point = Primaries { red: [0.3, 0.3], green: [0.3, 0.3], blue: [0.3, 0.3], white: [0.3, 0.3] };
        assert_eq!(point.to_rec709(), Err(NotPrimaries));
        assert_eq!(Primaries::from_array([f64::NAN; 8]).to_rec709(), Err(NotPrimaries));
        assert_eq!(Primaries::from_array([0.0; 8]).to_rec709(), Err(NotPrimaries));
    }
}
