//! The channels of a file that may hold a coverage mask, and the choice among them.

use super::Plane;
use super::decoded::Decoded;
use super::error::ImageError;
use super::ldr::Codes;
use super::source::Source;

/// The channels of a file that may hold a mask.
#[derive(Debug)]
pub(super) struct Channels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) alpha: Option<Vec<f32>>,
    pub(super) colours: Vec<[f32; 3]>,
}

impl Channels {
    pub(super) fn from_decoded(decoded: Decoded) -> Self {
        let (width, height) = (decoded.image.width(), decoded.image.height());
        Self { width, height, alpha: decoded.alpha, colours: decoded.image.pixels().to_vec() }
    }

    pub(super) fn from_codes(codes: &Codes) -> Self {
        let colour = |pixel: &[u16]| [0, 1, 2].map(|channel| codes.fraction(pixel[channel % codes.colours]));
        let alpha = codes.has_alpha.then(|| codes.pixels().map(|pixel| codes.fraction(pixel[codes.colours])).collect());
        Self { width: codes.width, height: codes.height, alpha, colours: codes.pixels().map(colour).collect() }
    }

    /// Alpha unless it is 1 everywhere (then it does not mark an object), else the colours, which must be equal.
    pub(super) fn into_plane(self, source: &Source<'_>) -> Result<Plane<f32>, ImageError> {
        let place = |at: usize| (at % self.width, at / self.width);
        let alpha = self.alpha.filter(|alpha| alpha.iter().any(|&value| value != 1.0));
        let values = match alpha {
            Some(alpha) => alpha,
            None => {
                let coloured = |&[r, g, b]: &[f32; 3]| r.to_bits() != g.to_bits() || g.to_bits() != b.to_bits();
                if let Some(at) = self.colours.iter().position(coloured) {
                    let (column, row) = place(at);
                    return Err(ImageError::ColouredMask { name: source.name.to_owned(), column, row });
                }
                self.colours.iter().map(|colour| colour[0]).collect()
            }
        };
        if let Some(at) = values.iter().position(|value| !(0.0..=1.0).contains(value)) {
            let (column, row) = place(at);
            return Err(ImageError::Coverage { name: source.name.to_owned(), column, row, value: values[at] });
        }
        Ok(Plane::from_values(self.width, self.height, values))
    }
}
