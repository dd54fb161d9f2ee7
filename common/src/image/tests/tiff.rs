use crate::image::{Encoding, Format, decode, decode_mask};
use std::io::Cursor;
use tiff::encoder::{
    TiffEncoder,
    colortype::{ColorType, Gray8, RGB8, RGB32Float, RGB64Float, RGBA16},
};

fn tiff<C: ColorType>(width: u32, height: u32, samples: &[C::Inner]) -> Vec<u8>
where
    [C::Inner]: tiff::encoder::TiffValue,
{
    let mut bytes = Cursor::new(Vec::new());
    TiffEncoder::new(&mut bytes).unwrap().write_image::<C>(width, height, samples).unwrap();
    bytes.into_inner()
}

/// A colour image of half floats, which the encoder does not write.
pub(super) fn half(width: u16, height: u16, samples: &[u16]) -> Vec<u8> {
    half_with((width, height), samples, (274, 1))
}

/// As [`half`], with this short tag.
fn half_with((width, height): (u16, u16), samples: &[u16], (tag, value): (u16, u32)) -> Vec<u8> {
    let mut bytes = b"II*\0\x08\0\0\0".to_vec();
    let (short, long) = (3_u16, 4_u16);
    let data = 8 + 2 + 10 * 12 + 4;
    let size = u32::try_from(2 * samples.len()).unwrap();
    // Three bit depths and three formats follow the pixels.
    let (depths, formats) = (data + size, data + size + 6);
    let entries = [
        (256, short, 1, u32::from(width)),
        (257, short, 1, u32::from(height)),
        (258, short, 3, depths),
        (259, short, 1, 1),
        (262, short, 1, 2),
        (273, long, 1, data),
        (tag, short, 1, value),
        (277, short, 1, 3),
        (279, long, 1, size),
        (339, short, 3, formats),
    ];
    bytes.extend(10_u16.to_le_bytes());
    for (tag, kind, count, value) in entries {
        bytes.extend(u16::to_le_bytes(tag));
        bytes.extend(kind.to_le_bytes());
        bytes.extend(u32::to_le_bytes(count));
        bytes.extend(u32::to_le_bytes(value));
    }
    bytes.extend([0; 4]);
    bytes.extend(samples.iter().flat_map(|half| half.to_le_bytes()));
    bytes.extend([16_u16, 16, 16, 3, 3, 3].iter().flat_map(|number| number.to_le_bytes()));
    bytes
}

#[test]
fn floats_and_halves_are_radiance() {
    let decoded = decode("a.tif", &tiff::<RGB32Float>(2, 1, &[0.25, 1.0, 70000.0, 0.0, -1.0, f32::NAN])).unwrap();
    assert_eq!((decoded.format, decoded.encoding, decoded.clipped), (Format::Tiff, Encoding::Linear, None));
    assert_eq!(decoded.image.pixel(0, 0), [0.25, 1.0, 70000.0]);
    assert!(decoded.image.pixel(1, 0)[2].is_nan());
    let decoded = decode("a.tif", &half(1, 2, &[0x3c00, 0x4000, 0x3800, 0x7bff, 0, 0x3c00])).unwrap();
    assert_eq!(decoded.image.pixels(), [[1.0, 2.0, 0.5], [65504.0, 0.0, 1.0]]);
}

#[test]
fn integers_are_decoded_from_srgb() {
    let decoded = decode("a.tif", &tiff::<RGB8>(1, 2, &[0, 128, 255, 1, 2, 3])).unwrap();
    assert_eq!(decoded.encoding, Encoding::Srgb);
    assert!((decoded.image.pixel(0, 0)[1] - 0.215_86).abs() < 1e-5);
    assert_eq!(decoded.clipped.unwrap(), [true, false]);
    let decoded = decode("a.tif", &tiff::<RGBA16>(1, 1, &[0, 0, 65535, 13107])).unwrap();
    assert!(!decoded.is_premultiplied());
    assert_eq!((decoded.image.pixel(0, 0), decoded.alpha.unwrap()), ([0.0, 0.0, 1.0], vec![0.2]));
    assert_eq!(decode_mask("m.tif", &tiff::<Gray8>(2, 1, &[0, 51])).unwrap().values(), [0.0, 0.2]);
}

#[test]
fn other_channels_are_refused_by_name() {
    let error = |bytes: &[u8]| decode("a.tif", bytes).unwrap_err().to_string();
    let associated = half_with((1, 1), &[0; 3], (338, 1));
    assert!(error(&associated).contains("multiplied by alpha"), "{}", error(&associated));
    let doubles = tiff::<RGB64Float>(1, 1, &[0.0; 3]);
    assert!(error(&doubles).contains("64 bits per channel"), "{}", error(&doubles));
}

#[test]
fn raw_files_and_turned_images_are_refused() {
    let error = |bytes: &[u8]| decode("a.tif", bytes).unwrap_err().to_string();
    let turned = half_with((1, 1), &[0; 3], (274, 6));
    assert!(error(&turned).contains("not stored upright"), "{}", error(&turned));
    // Canon's raw files have this mark; those of others begin with a preview (tag 254).
    let mut raw = half(1, 1, &[0; 3]);
    raw.splice(8..8, *b"CR\x02\0\0\0\0\0");
    raw[4] = 16;
    assert!(error(&raw).contains("raw image"), "{}", error(&raw));
    let preview = half_with((1, 1), &[0; 3], (254, 1));
    assert!(error(&preview).contains("raw image"), "{}", error(&preview));
}
