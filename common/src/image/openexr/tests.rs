//! Files written by the `exr` crate, by the reference implementation (`fixtures/make.py`) and by this crate.

use exr::math::RoundingMode;
use exr::prelude::*;

use crate::image::{Format, Image as Picture, ImageError, content_hash, decode, decode_mask, decode_normals, metadata};

macro_rules! fixture {
    ($name:literal) => {
        include_bytes!(concat!("../fixtures/", $name))
    };
}

const SIZE: (usize, usize) = (40, 36);

/// The content of every fixture, see `fixtures/make.py`.
fn expected(column: usize, row: usize) -> [f32; 3] {
    [(column + 1) as f32 / 10.0, (row + 1) as f32 / 36.0, 0.25]
}

fn half(plane: impl Fn(usize, usize) -> f32) -> FlatSamples {
    let (width, height) = SIZE;
    FlatSamples::F16((0..width * height).map(|at| f16::from_f32(plane(at % width, at / width))).collect())
}

fn rgb() -> Vec<(&'static str, FlatSamples)> {
    ["R", "G", "B"].into_iter().zip(0..3).map(|(name, i)| (name, half(move |x, y| expected(x, y)[i]))).collect()
}

struct Written {
    channels: Vec<(&'static str, FlatSamples)>,
    encoding: Encoding,
    chromaticities: Option<attribute::Chromaticities>,
}

impl Written {
    fn new(channels: Vec<(&'static str, FlatSamples)>, compression: Compression) -> Self {
        let encoding = Encoding { compression, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
        Self { channels, encoding, chromaticities: None }
    }

    fn bytes(self) -> Vec<u8> {
        let channels = self.channels.into_iter().map(|(n, s)| AnyChannel::new(n, s)).collect();
        let layer = Layer::new(SIZE, LayerAttributes::default(), self.encoding, AnyChannels::sort(channels));
        let mut image = Image::from_layer(layer);
        image.attributes.chromaticities = self.chromaticities;
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    }
}

/// Largest difference from the fixtures' content.
fn deviation(image: &Picture) -> f32 {
    assert_eq!((image.width(), image.height()), SIZE);
    let pixels = image.pixels().iter().enumerate();
    let differences = pixels.flat_map(|(at, found)| {
        let expected = expected(at % SIZE.0, at / SIZE.0);
        [0, 1, 2].map(|i| (found[i] - expected[i]).abs())
    });
    differences.fold(0.0, f32::max)
}

/// Half floats up to 4 are within 2^-10 of the exact value.
const HALF: f32 = 1.0 / 1024.0;

#[test]
fn every_compression_of_the_crate_is_read() {
    use Compression::*;
    for (compression, tolerance) in [
        (Uncompressed, HALF),
        (RLE, HALF),
        (ZIP1, HALF),
        (ZIP16, HALF),
        (PIZ, HALF),
        (PXR24, HALF),
        // 14 bytes for 16 pixels leave six bits for differences within a block.
        (B44, 0.05),
        (B44A, 0.05),
    ] {
        let decoded = decode("photo.exr", &Written::new(rgb(), compression).bytes()).unwrap();
        assert!(deviation(&decoded.image) <= tolerance, "{compression:?}: {}", deviation(&decoded.image));
        assert_eq!((decoded.format, decoded.warnings.len(), decoded.alpha), (Format::OpenExr, 0, None));
    }
}

#[test]
fn files_of_the_reference_implementation_are_read() {
    for (name, bytes, tolerance) in [
        ("dwaa", &fixture!("dwaa.exr")[..], 0.02),
        ("dwab", fixture!("dwab.exr"), 0.02),
        ("piz", fixture!("piz.exr"), HALF),
        ("b44a", fixture!("b44a.exr"), 0.05),
        ("tiled", fixture!("tiled.exr"), HALF),
        ("multipart", fixture!("multipart.exr"), HALF),
    ] {
        let decoded = decode(name, bytes).unwrap();
        assert!(deviation(&decoded.image) <= tolerance, "{name}: {}", deviation(&decoded.image));
    }
}

#[test]
fn an_unsupported_compression_is_named_with_advice() {
    for (bytes, name) in [(&fixture!("htj2k32.exr")[..], "HTJ2K32"), (fixture!("zstd.exr"), "ZSTD")] {
        let error = decode("photo.exr", bytes).unwrap_err().to_string();
        assert!(
            error.contains(name) && error.contains("--compression zip") && error.starts_with("photo.exr"),
            "{error}"
        );
    }
    let mut bytes = Written::new(rgb(), Compression::RLE).bytes();
    let start = bytes.windows(12).position(|w| w == b"compression\0").unwrap();
    for (number, name) in [(10, "HTJ2K256"), (12, "LJ2K"), (200, "number 200")] {
        bytes[start + 12 + 12 + 4] = number;
        assert!(decode("photo.exr", &bytes).unwrap_err().to_string().contains(name));
    }
}

#[test]
fn the_data_window_is_placed_in_the_display_window() {
    // Data x -4..=35, y 2..=37; display x 0..=47, y 0..=31.
    let decoded = decode("windows.exr", fixture!("windows.exr")).unwrap();
    let image = &decoded.image;
    assert_eq!((image.width(), image.height()), (48, 32));
    assert_eq!(decoded.warnings.len(), 2, "{:?}", decoded.warnings);
    for (column, row) in [(0, 0), (36, 2), (47, 31), (10, 1)] {
        assert_eq!(image.pixel(column, row), [0.0; 3], "{column} {row}");
    }
    for (column, row) in [(0, 2), (35, 31), (17, 9)] {
        let (found, expected) = (image.pixel(column, row), expected(column + 4, row - 2));
        assert!((0..3).all(|i| (found[i] - expected[i]).abs() <= HALF), "{column} {row}: {found:?}");
    }
}

#[test]
fn the_largest_of_several_levels_is_read() {
    let tiles = Blocks::Tiles(Vec2(16, 16));
    let level = |size: Vec2<usize>, value: f32| FlatSamples::F32(vec![value; size.area()]);
    let sizes = [Vec2(40, 36), Vec2(20, 18), Vec2(10, 9), Vec2(5, 4), Vec2(2, 2), Vec2(1, 1)];
    let channels = ["B", "G", "R"]
        .into_iter()
        .map(|name| AnyChannel {
            name: name.into(),
            sample_data: Levels::Mip {
                rounding_mode: RoundingMode::Down,
                level_data: sizes.iter().zip(1..).map(|(&size, n)| level(size, n as f32)).collect(),
            },
            quantize_linearly: false,
            sampling: Vec2(1, 1),
        })
        .collect();
    let encoding = Encoding { compression: Compression::ZIP16, blocks: tiles, line_order: LineOrder::Increasing };
    let layer = Layer::new(SIZE, LayerAttributes::default(), encoding, AnyChannels::sort(channels));
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer).write().to_buffered(&mut bytes).unwrap();
    let decoded = decode("mip.exr", bytes.get_ref()).unwrap();
    assert!(decoded.image.pixels().iter().all(|pixel| *pixel == [1.0; 3]));
}

#[test]
fn grey_alpha_and_integers_are_read() {
    let (width, height) = SIZE;
    let counts = FlatSamples::U32((0..width * height).map(|at| u32::try_from(at).unwrap()).collect());
    let channels = vec![("Y", counts), ("A", half(|x, _| if x < 10 { 0.5 } else { 1.0 }))];
    let bytes = Written::new(channels, Compression::ZIP16).bytes();
    let decoded = decode("grey.exr", &bytes).unwrap();
    assert_eq!(decoded.image.pixel(3, 2), [83.0; 3]);
    assert_eq!(decoded.alpha.as_ref().unwrap()[9..11], [0.5, 1.0]);
    assert!(decoded.is_premultiplied());
    assert_eq!(decode_mask("grey.exr", &bytes).unwrap().value(9, 0), 0.5);
}

#[test]
fn other_chromaticities_are_converted_with_a_warning() {
    let rec_2020 = attribute::Chromaticities {
        red: Vec2(0.708, 0.292),
        green: Vec2(0.170, 0.797),
        blue: Vec2(0.131, 0.046),
        white: Vec2(0.3127, 0.3290),
    };
    let constant = |value: f32| FlatSamples::F32(vec![value; SIZE.0 * SIZE.1]);
    let channels = vec![("R", constant(2.0)), ("G", constant(0.0)), ("B", constant(0.0))];
    let mut file = Written::new(channels.clone(), Compression::ZIP16);
    file.chromaticities = Some(rec_2020);
    let decoded = decode("wide.exr", &file.bytes()).unwrap();
    let [r, g, b] = decoded.image.pixel(0, 0);
    assert!((r - 3.3210).abs() < 1e-3 && (g + 0.2492).abs() < 1e-3 && (b + 0.0364).abs() < 1e-3, "{r} {g} {b}");
    assert_eq!(decoded.warnings.len(), 1);
    let mut file = Written::new(channels, Compression::ZIP16);
    file.chromaticities = Some(attribute::Chromaticities { white: Vec2(0.3, 0.0), ..rec_2020 });
    assert!(matches!(decode("wide.exr", &file.bytes()), Err(ImageError::Malformed { .. })));
}

#[test]
fn missing_channels_and_blocks_are_errors() {
    let bytes = Written::new(vec![("Z", half(|_, _| 1.0)), ("u", half(|_, _| 1.0))], Compression::ZIP16).bytes();
    let error = decode("depth.exr", &bytes).unwrap_err();
    assert_eq!(
        error.to_string(),
        "depth.exr: expected channels R, G and B, or Y, found channels Z, u; export the file with these channels"
    );
    // Two entries of the offset table point at the same block.
    let mut bytes = Written::new(rgb(), Compression::ZIP16).bytes();
    let first = bytes.windows(8).position(|w| {
        let at = u64::from_le_bytes(w.try_into().unwrap());
        at > 200 && at < 1000
    });
    let table = first.unwrap();
    bytes.copy_within(table..table + 8, table + 8);
    assert!(matches!(decode("photo.exr", &bytes), Err(ImageError::Malformed { .. })));
}

/// Found by fuzzing: with overflow checks, the decompressor of the `exr` crate panics on differences below zero.
#[test]
fn a_broken_b44_block_never_panics() {
    let mut bytes = fixture!("b44a.exr").to_vec();
    let start = bytes.len() - 1500;
    bytes[start..].fill(0);
    if let Ok(decoded) = decode("photo.exr", &bytes) {
        assert_eq!((decoded.image.width(), decoded.image.height()), SIZE);
    }
}

/// Found by fuzzing: the `exr` crate allocates the sizes in the counters of a DWA block.
#[test]
fn a_dwa_block_with_too_large_counters_is_an_error() {
    let whole = fixture!("dwab.exr");
    let mut found = 0;
    // The block is the last of the file and starts with version 2; the other counters follow.
    let start = whole.windows(8).rposition(|w| w == 2u64.to_le_bytes()).unwrap();
    for counter in [1, 6, 7, 8, 9] {
        let mut bytes = whole.to_vec();
        bytes[start + counter * 8..][..8].copy_from_slice(&(1u64 << 40).to_le_bytes());
        found += usize::from(matches!(decode("photo.exr", &bytes), Err(ImageError::Malformed { .. })));
    }
    assert_eq!(found, 5);
}

#[test]
fn deep_data_are_refused() {
    let mut bytes = Written::new(rgb(), Compression::RLE).bytes();
    bytes[5] |= 0x08;
    assert!(decode("deep.exr", &bytes).unwrap_err().to_string().contains("deep data"));
}

#[test]
fn normals_are_read_from_xyz() {
    let channels = vec![
        ("N.X", half(|x, _| if x == 0 { 0.0 } else { 0.6 })),
        ("N.Y", half(|_, _| 0.0)),
        ("N.Z", half(|x, _| if x == 0 { 0.0 } else { 0.8 })),
    ];
    let normals = decode_normals("n.exr", &Written::new(channels, Compression::ZIP16).bytes()).unwrap();
    assert_eq!(normals.value(0, 5).length(), 0.0);
    assert!((normals.value(1, 5).length() - 1.0).abs() < 1e-15);
}

/// An image with small, large, negative and infinite values.
fn results() -> Picture {
    let mut image = Picture::new(5, 3);
    for (at, pixel) in image.pixels_mut().iter_mut().enumerate() {
        *pixel = [at as f32 * 0.1, -1e-30, 65504.0 * 1e9];
    }
    image.pixels_mut()[7] = [f32::INFINITY, f32::NEG_INFINITY, -0.0];
    image
}

fn notes() -> Vec<(String, String)> {
    let notes = [
        (metadata::SOFTWARE, "lookalike"),
        (metadata::CONVENTIONS, "+Y up; 1 \u{2264} 2"),
        (metadata::DISPLAY_EXPOSURE, "1.7"),
        (metadata::MODEL, "ggx"),
        (metadata::COMMENTS, ""),
    ];
    notes.into_iter().map(|(key, value)| (key.to_owned(), value.to_owned())).collect()
}

#[test]
fn written_files_are_read_bit_for_bit() {
    let image = results();
    let coverage: Vec<f32> = (0..15).map(|at| at as f32 / 14.0).collect();
    let bytes = super::write(&image, Some(&coverage), &notes()).unwrap();
    let decoded = decode("match.exr", &bytes).unwrap();
    assert_eq!(content_hash(&decoded.image), content_hash(&image));
    assert_eq!(decoded.alpha.unwrap(), coverage);
    assert_eq!(decoded.warnings, Vec::<String>::new());
    for note in notes() {
        assert!(decoded.metadata.contains(&note), "{note:?} in {:?}", decoded.metadata);
    }
    let nan = Picture::from_pixels(1, 1, vec![[f32::NAN, 1.0, 2.0]]);
    let read = decode("nan.exr", &super::write(&nan, None, &[]).unwrap()).unwrap();
    assert_eq!(content_hash(&read.image), content_hash(&nan));
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    let bytes = super::write(&results(), None, &notes()).unwrap();
    let mut reversed = notes();
    reversed.reverse();
    // Every hash map has its own order; without sorting, eight files would agree by chance once in 6^7.
    for _ in 0..8 {
        assert_eq!(super::write(&results(), None, &reversed).unwrap(), bytes);
    }
}

#[test]
fn content_that_openexr_cannot_represent_is_refused() {
    let image = results();
    let note = |key: &str| vec![(key.to_owned(), "x".to_owned())];
    for notes in [note(""), note(&"k".repeat(32)), note("compression"), [note("a"), note("a")].concat()] {
        assert!(matches!(super::write(&image, None, &notes), Err(ImageError::Unwritable { .. })), "{notes:?}");
    }
    assert!(super::write(&image, Some(&[1.0]), &[]).is_err());
    assert!(super::write(&Picture::new(0, 0), None, &[]).is_err());
}

#[test]
fn pixels_that_are_not_square_are_refused() {
    let layer = |aspect: f32| {
        let channels = rgb().into_iter().map(|(name, samples)| AnyChannel::new(name, samples)).collect();
        let encoding = Encoding::UNCOMPRESSED;
        let mut image =
            Image::from_layer(Layer::new(SIZE, LayerAttributes::default(), encoding, AnyChannels::sort(channels)));
        image.attributes.pixel_aspect = aspect;
        let mut bytes = std::io::Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        decode("a.exr", &bytes.into_inner())
    };
    let error = layer(2.0).unwrap_err();
    assert!(matches!(error, ImageError::Unsupported { .. }) && error.to_string().contains("not square"), "{error}");
    assert!(layer(1.001).is_ok());
}
