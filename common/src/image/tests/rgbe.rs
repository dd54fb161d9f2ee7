use crate::image::{Encoding, Format, ImageError, decode};

/// A picture of plain pixels, without run-length encoding.
pub(super) fn picture(header: &str, resolution: &str, pixels: &[[u8; 4]]) -> Vec<u8> {
    let header = format!("#?RADIANCE\n{header}FORMAT=32-bit_rle_rgbe\n\n{resolution}\n");
    [header.as_bytes(), pixels.as_flattened()].concat()
}

const TWO: [[u8; 4]; 2] = [[128, 64, 32, 129], [1, 2, 3, 137]];

#[test]
fn mantissas_and_exponents_are_exact() {
    let decoded = decode("a.hdr", &picture("", "-Y 1 +X 3", &[TWO[0], TWO[1], [9, 9, 9, 0]])).unwrap();
    assert_eq!(decoded.image.pixels(), [[1.0, 0.5, 0.25], [2.0, 4.0, 6.0], [0.0; 3]]);
    assert_eq!((decoded.format, decoded.encoding), (Format::RadianceHdr, Encoding::Linear));
    let extremes = decode("a.hdr", &picture("", "-Y 1 +X 2", &[[255, 0, 0, 255], [1, 0, 0, 1]])).unwrap();
    assert_eq!(extremes.image.pixel(0, 0)[0], 255.0 * 2.0f32.powi(119));
    assert_eq!(extremes.image.pixel(1, 0)[0], 2.0f32.powi(-100) * 2.0f32.powi(-35));
}

#[test]
fn pixels_are_divided_by_the_product_of_all_exposures() {
    let header = "# made by hand = here\nEXPOSURE=2\nEXPOSURE=  4.0 \nCOLORCORR=1 0.5 2\nVIEW=-vtv\n";
    let decoded = decode("a.hdr", &picture(header, "-Y 1 +X 2", &TWO)).unwrap();
    assert_eq!(decoded.image.pixel(0, 0), [1.0 / 8.0, 0.5 / 4.0, 0.25 / 16.0]);
    assert!(decoded.metadata.contains(&("VIEW".to_owned(), "-vtv".to_owned())));
    for bad in
        ["EXPOSURE=-1\n", "EXPOSURE=x\n", "EXPOSURE=inf\n", "COLORCORR=1 1\n", "EXPOSURE=1e-200\nEXPOSURE=1e-200\n"]
    {
        assert!(
            matches!(decode("a.hdr", &picture(bad, "-Y 1 +X 2", &TWO)), Err(ImageError::Malformed { .. })),
            "{bad}"
        );
    }
}

#[test]
fn primaries_are_converted_unless_unknown() {
    let rec_709 = "PRIMARIES=0.640 0.330 0.300 0.600 0.150 0.060 0.3127 0.3290\n";
    for same in ["PRIMARIES=0 0 0 0 0 0 0 0\n", rec_709] {
        let decoded = decode("a.hdr", &picture(same, "-Y 1 +X 2", &TWO)).unwrap();
        assert_eq!((decoded.image.pixel(0, 0), decoded.warnings.len()), ([1.0, 0.5, 0.25], 0));
    }
    let radiance = "PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n";
    let decoded = decode("a.hdr", &picture(radiance, "-Y 1 +X 1", &[[128, 128, 128, 129]])).unwrap();
    assert!(decoded.image.pixel(0, 0).iter().all(|value| (value - 1.0).abs() < 1e-6));
    assert_eq!(decoded.warnings.len(), 1);
    assert!(decode("a.hdr", &picture("PRIMARIES=1 2 3\n", "-Y 1 +X 2", &TWO)).is_err());
}

#[test]
fn run_lengths_of_both_styles_are_read() {
    // New style, 10 pixels: red as a run, green as copied bytes, blue and exponent as runs.
    let mut new = b"#?RGBE\n\n-Y 1 +X 10\n\x02\x02\x00\x0a".to_vec();
    new.extend([138, 128, 10, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 138, 0, 138, 129]);
    let decoded = decode("a.hdr", &new).unwrap();
    assert_eq!(decoded.image.pixel(9, 0), [1.0, 9.0 / 128.0, 0.0]);
    // Old style: one pixel, repeated 3 + 1 * 256 times.
    let old = picture("", "-Y 1 +X 260", &[[128, 0, 0, 129], [1, 1, 1, 3], [1, 1, 1, 1]]);
    assert!(decode("a.hdr", &old).unwrap().image.pixels().iter().all(|pixel| *pixel == [1.0, 0.0, 0.0]));
    let overrun = picture("", "-Y 1 +X 259", &[[128, 0, 0, 129], [1, 1, 1, 3], [1, 1, 1, 1]]);
    assert!(decode("a.hdr", &overrun).is_err());
    assert!(decode("a.hdr", &picture("", "-Y 1 +X 9", &[[1, 1, 1, 9]])).is_err());
}

#[test]
fn all_orientations_come_out_upright() {
    // Stored 1 2 3 / 4 5 6 in red.
    let pixels: Vec<[u8; 4]> = (1..=6).map(|n| [n, 0, 0, 136]).collect();
    for (resolution, upright) in [
        ("-Y 2 +X 3", [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]),
        ("-Y 2 -X 3", [3.0, 2.0, 1.0, 6.0, 5.0, 4.0]),
        ("+Y 2 +X 3", [4.0, 5.0, 6.0, 1.0, 2.0, 3.0]),
        ("+Y 2 -X 3", [6.0, 5.0, 4.0, 3.0, 2.0, 1.0]),
        ("+X 2 -Y 3", [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]),
        ("-X 2 -Y 3", [4.0, 1.0, 5.0, 2.0, 6.0, 3.0]),
        ("+X 2 +Y 3", [3.0, 6.0, 2.0, 5.0, 1.0, 4.0]),
        ("-X 2 +Y 3", [6.0, 3.0, 5.0, 2.0, 4.0, 1.0]),
    ] {
        let image = decode("a.hdr", &picture("", resolution, &pixels)).unwrap().image;
        let red: Vec<f32> = image.pixels().iter().map(|pixel| pixel[0]).collect();
        assert_eq!(red, upright, "{resolution}");
    }
}

#[test]
fn other_pixel_formats_and_broken_headers_are_refused() {
    let other = b"#?RADIANCE\nFORMAT=32-bit_rle_luve\n\n-Y 1 +X 1\n\0\0\0\0";
    assert!(decode("a.hdr", other).unwrap_err().to_string().contains("32-bit_rle_luve"));
    let wide = decode("a.hdr", &picture("PIXASPECT=2\n", "-Y 1 +X 2", &TWO)).unwrap_err().to_string();
    assert!(wide.contains("not square") && wide.contains("0.5"), "{wide}");
    assert!(decode("a.hdr", &picture("PIXASPECT=1.0\n", "-Y 1 +X 2", &TWO)).is_ok());
    for resolution in ["-Y 1", "-Y 1 +Y 1", "Y 1 X 1", "-Y -1 +X 1", "-Y 0 +X 1", "1 1"] {
        assert!(decode("a.hdr", &picture("", resolution, &TWO)).is_err(), "{resolution}");
    }
}

/// FreeImage and GIMP write both lines.
#[test]
fn exposure_of_zero_is_ignored_with_a_warning() {
    let decoded = decode("a.hdr", &picture("EXPOSURE=0\nGAMMA=1\n", "-Y 1 +X 2", &TWO)).unwrap();
    assert_eq!((decoded.image.pixel(0, 0), decoded.warnings.len()), ([1.0, 0.5, 0.25], 1));
    assert!(decoded.warnings[0].contains("EXPOSURE=0"), "{:?}", decoded.warnings);
}

/// White, and full red of Rec. 709, which is (.4384, .2228, .0173) adapted to the white of equal energy (Lindbloom, *Chromatic Adaptation*).
#[test]
fn pixels_in_xyz_are_converted() {
    let xyze = b"#?RADIANCE\nPRIMARIES=.64 .33 .29 .6 .15 .06 .333 .333\nFORMAT=32-bit_rle_xyze\n\n-Y 1 +X 2\n";
    let decoded = decode("a.hdr", &[&xyze[..], &[128, 128, 128, 129, 112, 57, 4, 128]].concat()).unwrap();
    assert!(decoded.image.pixel(0, 0).iter().all(|value| (value - 1.0).abs() < 1e-6));
    let [r, g, b] = decoded.image.pixel(1, 0);
    assert!((r - 1.0).abs() < 0.005 && g.abs() < 0.005 && b.abs() < 0.005, "{r} {g} {b}");
    assert!(decoded.warnings.len() == 1 && decoded.warnings[0].contains("XYZ"), "{:?}", decoded.warnings);
}
