use std::io::Cursor;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType as Colour, ImageEncoder};

use crate::image::{Encoding, Format, Image, ImageError, decode, metadata, png, srgb};
use crate::math::to_f32;

pub(super) fn png_of(data: &[u8], width: u32, height: u32, colour: Colour) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    PngEncoder::new(&mut bytes).write_image(data, width, height, colour).unwrap();
    bytes.into_inner()
}

pub(super) fn jpeg_of(data: &[u8], width: u32, height: u32, colour: Colour) -> Vec<u8> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 95).write_image(data, width, height, colour).unwrap();
    bytes
}

/// `bytes` with a chunk after the header chunk.
fn with_chunk(bytes: &[u8], kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    with_chunk_at(bytes, 33, kind, data)
}

fn with_chunk_at(bytes: &[u8], at: usize, kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [&kind[..], data].concat();
    let mut crc = u32::MAX;
    for byte in &body {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg());
        }
    }
    let length = u32::try_from(data.len()).unwrap().to_be_bytes();
    [&bytes[..at], &length, &body, &(!crc).to_be_bytes(), &bytes[at..]].concat()
}

fn linear(code: u8) -> f32 {
    to_f32(srgb::to_linear(f64::from(code) / 255.0))
}

#[test]
fn eight_bit_colours_are_decoded_from_srgb() {
    let decoded = decode("a.png", &png_of(&[0, 128, 254, 255, 1, 2], 2, 1, Colour::Rgb8)).unwrap();
    assert_eq!(decoded.image.pixels(), [[0.0, linear(128), linear(254)], [1.0, linear(1), linear(2)]]);
    assert!((linear(128) - 0.215_86).abs() < 1e-5);
    assert_eq!((decoded.format, decoded.encoding), (Format::Png, Encoding::Srgb));
    assert_eq!(decoded.clipped.unwrap(), [false, true]);
    assert_eq!((decoded.alpha, decoded.warnings.len()), (None, 0));
}

#[test]
fn grey_alpha_and_sixteen_bits_are_decoded() {
    let decoded = decode("a.png", &png_of(&[128, 51], 1, 1, Colour::La8)).unwrap();
    assert_eq!((decoded.image.pixel(0, 0), decoded.alpha.clone().unwrap()), ([linear(128); 3], vec![0.2]));
    assert!(!decoded.is_premultiplied());
    let codes: Vec<u8> = [0x8080u16, 65535, 65534, 0].iter().flat_map(|code| code.to_ne_bytes()).collect();
    let decoded = decode("a.png", &png_of(&codes, 1, 1, Colour::Rgba16)).unwrap();
    assert_eq!(decoded.image.pixel(0, 0)[..2], [linear(128), 1.0]);
    assert_eq!((decoded.clipped.unwrap(), decoded.alpha.unwrap()), (vec![true], vec![0.0]));
}

#[test]
fn a_palette_of_four_bits_with_transparency_is_decoded() {
    // 3 x 1 pixels of indices 0, 1, 2; entry 1 is transparent. The scan line is filter 0, then 0x01 0x20, uncompressed.
    let header = [0, 0, 0, 3, 0, 0, 0, 1, 4, 3, 0, 0, 0];
    let zlib = [0x78, 0x01, 1, 3, 0, 0xfc, 0xff, 0, 0x01, 0x20, 0x00, 0x25, 0x00, 0x22];
    let empty = [b"\x89PNG\r\n\x1a\n".as_slice(), &[0; 25]].concat();
    let chunk = |kind: &[u8; 4], data: &[u8]| with_chunk(&empty, kind, data)[33..].to_vec();
    let bytes = [
        b"\x89PNG\r\n\x1a\n".to_vec(),
        chunk(b"IHDR", &header),
        chunk(b"PLTE", &[255, 0, 0, 0, 128, 0, 0, 0, 64]),
        chunk(b"tRNS", &[255, 0]),
        chunk(b"IDAT", &zlib),
        chunk(b"IEND", &[]),
    ]
    .concat();
    let decoded = decode("a.png", &bytes).unwrap();
    assert_eq!(decoded.image.pixels(), [[1.0, 0.0, 0.0], [0.0, linear(128), 0.0], [0.0, 0.0, linear(64)]]);
    assert_eq!(decoded.alpha.unwrap(), [1.0, 0.0, 1.0]);
}

#[test]
fn declarations_of_other_colours_are_warnings() {
    let plain = png_of(&[10; 3], 1, 1, Colour::Rgb8);
    let warnings = |bytes: &[u8]| decode("a.png", bytes).unwrap().warnings;
    let gamma = |value: u32| with_chunk(&plain, b"gAMA", &value.to_be_bytes());
    assert!(warnings(&gamma(45455)).is_empty());
    assert!(warnings(&gamma(100_000))[0].contains("gAMA"));
    assert!(warnings(&with_chunk(&gamma(100_000), b"sRGB", &[0])).is_empty(), "sRGB outweighs gAMA");
    assert!(warnings(&with_chunk(&plain, b"cICP", &[9, 16, 0, 1]))[0].contains("cICP"));
    let wide: Vec<u8> =
        [31270u32, 32900, 70800, 29200, 17000, 79700, 13100, 4600].iter().flat_map(|n| n.to_be_bytes()).collect();
    assert!(warnings(&with_chunk(&plain, b"cHRM", &wide))[0].contains("cHRM"));
}

#[test]
fn exif_orientation_is_applied_with_a_warning() {
    // Orientation 6: to be rotated clockwise. Exif: big-endian TIFF with one entry.
    let exif = [b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0".as_slice()].concat();
    let rotated = with_chunk(&png_of(&[0, 10, 20, 30, 40, 50], 3, 2, Colour::L8), b"eXIf", &exif);
    let decoded = decode("a.png", &rotated).unwrap();
    assert_eq!((decoded.image.width(), decoded.image.height()), (2, 3));
    assert_eq!(decoded.image.pixel(0, 0)[0], linear(30));
    assert_eq!(decoded.warnings.len(), 1);
    let photo = jpeg_of(&[100; 3 * 16 * 8], 16, 8, Colour::Rgb8);
    let app1 = [&[0xff, 0xe1, 0, 34][..], b"Exif\0\0", &exif].concat();
    let rotated = [&photo[..2], &app1, &photo[2..]].concat();
    let image = decode("a.jpg", &rotated).unwrap().image;
    assert_eq!((image.width(), image.height()), (8, 16));
}

#[test]
fn jpeg_colours_and_greys_are_decoded_from_srgb() {
    let pixels: Vec<u8> = [200, 100, 50].repeat(16 * 16);
    let decoded = decode("a.jpg", &jpeg_of(&pixels, 16, 16, Colour::Rgb8)).unwrap();
    let [r, g, b] = decoded.image.pixel(8, 8);
    // Quality 95 quantises flat colours in steps of two codes.
    assert!(
        linear(197) < r && r < linear(203) && linear(97) < g && g < linear(103) && linear(46) < b && b < linear(54)
    );
    assert_eq!((decoded.format, decoded.encoding), (Format::Jpeg, Encoding::Srgb));
    assert!(decoded.clipped.unwrap().iter().all(|clipped| !clipped));
    let white = decode("a.jpg", &jpeg_of(&[255; 64], 8, 8, Colour::L8)).unwrap();
    assert!(white.clipped.unwrap().iter().all(|&clipped| clipped));
}

#[test]
fn print_colours_and_truncated_photos_are_refused() {
    let mut bytes = jpeg_of(&[100; 64], 8, 8, Colour::L8);
    let frame = bytes.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    bytes[frame + 9] = 4;
    assert!(decode("a.jpg", &bytes).unwrap_err().to_string().contains("print colours"));
    let bytes = jpeg_of(&[100; 64], 8, 8, Colour::L8);
    let error = decode("a.jpg", &bytes[..bytes.len() - 2]).unwrap_err();
    assert!(matches!(&error, ImageError::Malformed { detail, .. } if detail.contains("end-of-image")), "{error}");
}

#[test]
fn written_codes_are_the_nearest_and_metadata_is_read_back() {
    let middle = srgb::to_linear(100.5 / 255.0);
    let values = [[middle * 0.999, middle * 1.001, 0.5], [2.0, -1.0, f64::INFINITY]];
    let image = Image::from_pixels(2, 1, values.map(|pixel| pixel.map(to_f32)).to_vec());
    let notes: Vec<(String, String)> = [
        (metadata::SOFTWARE, "lookalike"),
        (metadata::DISPLAY_EXPOSURE, "1.7"),
        (metadata::CONVENTIONS, "\u{e9}\u{2264}"),
    ]
    .map(|(key, value)| (key.to_owned(), value.to_owned()))
    .to_vec();
    let bytes = png::write(&image, &notes).unwrap();
    assert_eq!(bytes, png::write(&image, &notes).unwrap());
    let decoded = decode("match.png", &bytes).unwrap();
    assert_eq!(decoded.image.pixels(), [[linear(100), linear(101), linear(188)], [1.0, 0.0, 1.0]]);
    assert_eq!((decoded.metadata, decoded.warnings.len()), (notes, 0));
}

#[test]
fn content_that_png_cannot_represent_is_refused() {
    let nan = Image::from_pixels(2, 1, vec![[0.0; 3], [0.0, f32::NAN, 0.0]]);
    assert!(png::write(&nan, &[]).unwrap_err().to_string().contains("column 1, row 0"));
    let with_text = |key: &str, value: &str| png::write(&Image::new(1, 1), &[(key.to_owned(), value.to_owned())]);
    for (key, value) in [("", "x"), (" key", "x"), ("\u{e9}", "x"), (&"k".repeat(80), "x"), ("key", "a\0b")] {
        assert!(with_text(key, value).is_err(), "{key:?} {value:?}");
    }
    assert!(with_text("key", "").is_ok());
    assert!(png::write(&Image::new(0, 1), &[]).is_err());
}

#[test]
fn text_after_the_pixels_is_read_and_compressed_text_is_not() {
    let plain = png_of(&[10; 3], 1, 1, Colour::Rgb8);
    let end = plain.len() - 12;
    let bytes = with_chunk_at(&plain, end, b"tEXt", b"Comment\0after the pixels");
    let bytes = with_chunk_at(&bytes, end, b"iTXt", b"note\0\x01\0\0\0not a zlib stream");
    let text = ("comments".to_owned(), "after the pixels".to_owned());
    assert_eq!(decode("a.png", &bytes).unwrap().metadata, [text]);
}
