use crate::image::{Image, ImageError, decode, pfm};

/// A file of `samples`, bottom row first.
pub(super) fn map(header: &str, samples: &[f32], little_endian: bool) -> Vec<u8> {
    let raster = samples.iter().flat_map(|x| if little_endian { x.to_le_bytes() } else { x.to_be_bytes() });
    header.bytes().chain(raster).collect()
}

#[test]
fn colour_and_grey_of_both_byte_orders_are_read_bottom_up() {
    let colour = [1.0, 2.0, 3.0, 4.0, 5.0, -6.0];
    for (header, little) in [("PF\n1 2\n-1.0\n", true), ("PF\n1 2\n1.0\n", false), ("PF 1 2\t+1 ", false)] {
        let decoded = decode("a.pfm", &map(header, &colour, little)).unwrap();
        assert_eq!(decoded.image.pixels(), [[4.0, 5.0, -6.0], [1.0, 2.0, 3.0]]);
        assert!(decoded.warnings.is_empty());
    }
    let decoded = decode("a.pfm", &map("Pf\n2 1\n-1\n", &[f32::INFINITY, f32::NAN], true)).unwrap();
    assert_eq!(decoded.image.pixel(0, 0), [f32::INFINITY; 3]);
    assert!(decoded.image.pixel(1, 0)[2].is_nan());
}

#[test]
fn the_scale_is_applied_with_a_warning() {
    let decoded = decode("a.pfm", &map("Pf\n1 1\n-2.5\n", &[2.0], true)).unwrap();
    assert_eq!((decoded.image.pixel(0, 0), decoded.warnings.len()), ([5.0; 3], 1));
}

#[test]
fn headers_with_carriage_returns_are_read() {
    // The lowest byte of the first sample is a line feed, which must not be taken for the end of the header.
    let sample = f32::from_le_bytes([b'\n', 0, 0x80, 0x3f]);
    for header in ["Pf\r\n1 1\r\n-1.0\r\n", "Pf\r1 1\r-1.0\r"] {
        let decoded = decode("a.pfm", &map(header, &[sample], true)).unwrap();
        assert_eq!(decoded.image.pixel(0, 0), [sample; 3], "{header:?}");
    }
}

#[test]
fn broken_headers_are_refused() {
    for header in ["PF\n1 1\n", "PF\n1 1\n0\n", "PF\n1 1\nnan\n", "PF\n0 1\n-1\n", "PF\n-1 1\n-1\n", "PF\n1 x\n-1\n"] {
        let result = decode("a.pfm", &map(header, &[1.0; 3], true));
        assert!(matches!(result, Err(ImageError::Malformed { .. })), "{header:?}: {result:?}");
    }
    let error = decode("a.pfm", &map("PF\n2 2\n-1\n", &[1.0; 3], true)).unwrap_err().to_string();
    assert!(error.contains("expected 48 bytes of samples, found 12"), "{error}");
}

#[test]
fn written_maps_are_read_back_bit_for_bit() {
    let image = Image::from_pixels(2, 3, (0..6).map(|i| [i as f32 / 7.0, -1e-30, f32::INFINITY]).collect());
    assert_eq!(decode("a.pfm", &pfm::write(&image).unwrap()).unwrap().image, image);
    assert!(pfm::write(&Image::new(0, 3)).unwrap_err().to_string().contains("at least one pixel, found 0 x 3"));
}
