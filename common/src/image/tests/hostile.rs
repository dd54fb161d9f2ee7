//! Truncated, altered, random and oversized files must give an error, without a panic or a large allocation.

use image::ExtendedColorType as Colour;
use proptest::prelude::*;

use super::{ldr, pfm, rgbe, tiff};
use crate::image::{Image, ImageError, Limits, Source, decode, openexr};

fn samples() -> Vec<(&'static str, Vec<u8>)> {
    let small = Image::from_pixels(2, 3, vec![[0.5, 1.0, 2.0]; 6]);
    let codes: Vec<u8> = (0..16 * 16 * 3).map(|n: usize| u8::try_from(n % 251).unwrap()).collect();
    vec![
        ("a.exr", openexr::write(&small, Some(&[1.0; 6]), &[("note".to_owned(), "x".to_owned())]).unwrap()),
        (
            "a.hdr",
            rgbe::picture("EXPOSURE=2\n", "-Y 1 +X 10", &[[2, 2, 0, 10], [138, 128, 138, 0], [138, 0, 138, 129]]),
        ),
        ("flat.hdr", rgbe::picture("", "-Y 2 +X 2", &[[128, 64, 32, 129]; 4])),
        ("a.pfm", pfm::map("PF\n2 2\n-1.0\n", &[1.0; 12], true)),
        ("a.png", ldr::png_of(&codes, 16, 16, Colour::Rgb8)),
        ("a.tif", tiff::half(2, 2, &[0x3c00; 12])),
        ("a.jpg", ldr::jpeg_of(&codes, 16, 16, Colour::Rgb8)),
    ]
}

fn small_limits() -> Limits {
    Limits { max_side: 1 << 10, max_pixels: 1 << 16 }
}

fn read_all(bytes: &[u8]) {
    let source = Source::new("any", bytes).with_limits(small_limits());
    let _ = (source.decode(), source.mask(), source.normals());
}

#[test]
fn a_file_truncated_anywhere_is_an_error() {
    for (name, bytes) in samples() {
        assert!(decode(name, &bytes).is_ok(), "{name}: {:?}", decode(name, &bytes));
        for length in 0..bytes.len() {
            let result = decode(name, &bytes[..length]);
            assert!(result.is_err(), "{name} truncated to {length} of {} bytes: {result:?}", bytes.len());
        }
    }
    for fixture in [
        &include_bytes!("../fixtures/dwaa.exr")[..],
        include_bytes!("../fixtures/dwab.exr"),
        include_bytes!("../fixtures/piz.exr"),
        include_bytes!("../fixtures/b44a.exr"),
        include_bytes!("../fixtures/tiled.exr"),
        include_bytes!("../fixtures/multipart.exr"),
    ] {
        for length in 0..fixture.len() {
            assert!(decode("fixture.exr", &fixture[..length]).is_err(), "{length}");
        }
    }
}

#[test]
fn sizes_beyond_the_limits_are_refused_before_allocation() {
    let mut png = ldr::png_of(&[0; 3], 1, 1, Colour::Rgb8);
    png[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    let mut jpeg = ldr::jpeg_of(&[0; 64], 8, 8, Colour::L8);
    let frame = jpeg.windows(2).position(|w| w == [0xff, 0xc0]).unwrap();
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0xff; 4]);
    let mut exr = openexr::write(&Image::new(1, 1), None, &[]).unwrap();
    let window = exr.windows(10).position(|w| w == b"dataWindow").unwrap() + 11 + 6 + 4 + 8;
    exr[window..window + 8].copy_from_slice(&[0xff, 0xff, 0xff, 0x3f, 0xff, 0xff, 0xff, 0x3f]);
    for (name, bytes) in [
        ("a.png", png),
        ("a.jpg", jpeg),
        ("a.exr", exr),
        ("a.pfm", pfm::map("PF\n4000000000 4000000000\n-1\n", &[], true)),
        ("a.hdr", rgbe::picture("", "-Y 32769 +X 1", &[])),
        ("b.hdr", rgbe::picture("", "-Y 32768 +X 8193", &[])),
        ("c.hdr", rgbe::picture("", "-Y 18446744073709551615 +X 18446744073709551615", &[])),
    ] {
        let error = decode(name, &bytes).unwrap_err();
        assert!(matches!(error, ImageError::TooLarge { .. }), "{name}: {error}");
    }
}

#[test]
fn unknown_files_are_described() {
    for (bytes, words) in [
        (&b""[..], "an empty file"),
        (b"BM\0\0", "BMP"),
        (b"RIFF\0\0\0\0WEBP", "WebP"),
        (b"PF4\n1 1\n", "PF4"),
        (b"P6\n1 1\n", "Netpbm"),
        (b"hello", "68 65 6c 6c 6f"),
    ] {
        let error = decode("photo.xyz", bytes).unwrap_err().to_string();
        assert!(error.contains(words) && error.starts_with("photo.xyz: expected OpenEXR"), "{error}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes_after_a_magic_number_never_panic(
        magic in prop::sample::select(vec![
            &b"\x76\x2f\x31\x01\x02\0\0\0"[..], b"#?RADIANCE\n", b"#?RGBE\n\n-Y 4 +X 9\n", b"PF\n", b"Pf\n3 3\n-1\n",
            b"\x89PNG\r\n\x1a\n\0\0\0\x0dIHDR", b"\xff\xd8\xff", b"",
        ]),
        tail in prop::collection::vec(any::<u8>(), 0..400),
    ) {
        read_all(&[magic, &tail].concat());
    }

    #[test]
    fn altered_files_never_panic(
        index in 0..6usize,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6),
    ) {
        let (_, mut bytes) = samples().swap_remove(index);
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        read_all(&bytes);
    }
}

#[test]
fn files_that_are_not_images_are_named() {
    for (bytes, what) in [
        (&b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n"[..], "pointer of Git LFS"),
        (b"\n<!DOCTYPE html>\n<html>", "an HTML page"),
        (b"<HTML><HEAD>", "an HTML page"),
        (b"\x1f\x8b\x08\0", "a gzip file"),
        (b"tensor_file\0\x01\0", "a tensor file"),
        (b"PK\x03\x04", "a zip archive"),
        (b"../.git/annex/objects/aa", "pointer of git-annex"),
        (b"8BPS\0\x01", "a Photoshop document"),
        (b"II\x2b\0\x08\0", "BigTIFF"),
    ] {
        let error = decode("probe.hdr", bytes).unwrap_err().to_string();
        assert!(error.starts_with("probe.hdr: expected") && error.contains(what), "{error}");
    }
}
