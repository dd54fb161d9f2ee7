//! The identity of an image by its content. Images are hashed after decoding, so that a photo has the same hash in
//! every file format, with every compression and with any metadata.

use super::Image;

/// BLAKE3 of the decoded pixels: a fixed prefix, width and height as little-endian `u64`, then every pixel's red, green
/// and blue as little-endian `f32` bits (NaN payloads and the sign of zero included), row-major, top left first.
#[must_use]
pub fn content_hash(image: &Image) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    hasher.update(PREFIX);
    hasher.update(&(image.width() as u64).to_le_bytes());
    hasher.update(&(image.height() as u64).to_le_bytes());
    let mut bytes = Vec::with_capacity(BATCH * 12);
    for pixels in image.pixels().chunks(BATCH) {
        bytes.clear();
        bytes.extend(pixels.iter().flatten().flat_map(|value| value.to_le_bytes()));
        hasher.update(&bytes);
    }
    hasher.finalize()
}

/// Makes the hash differ from those of other kinds of content. A change of the layout changes the number.
const PREFIX: &[u8] = b"lookalike image 1\n";

/// Pixels per update: 48 kB, which fit into the cache.
const BATCH: usize = 4096;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hash_depends_on_shape_and_every_bit() {
        let image = Image::from_pixels(2, 1, vec![[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
        let turned = Image::from_pixels(1, 2, image.pixels().to_vec());
        let mut negative = image.clone();
        negative.pixels_mut()[0][0] = -0.0;
        assert_eq!(content_hash(&image), content_hash(&image.clone()));
        assert_ne!(content_hash(&image), content_hash(&turned));
        assert_ne!(content_hash(&image), content_hash(&negative));
    }

    #[test]
    fn hash_layout_is_locked() {
        let image = Image::from_pixels(2, 1, vec![[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
        let mut flat = b"lookalike image 1\n\x02\0\0\0\0\0\0\0\x01\0\0\0\0\0\0\0".to_vec();
        for value in [0.0f32, 1.0, 2.0, 3.0, 4.0, 5.0] {
            flat.extend(value.to_bits().to_le_bytes());
        }
        assert_eq!(content_hash(&image), blake3::hash(&flat));
    }
}
