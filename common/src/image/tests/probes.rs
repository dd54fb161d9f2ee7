//! The published maxima of real light probes, if the probes are available.

use std::path::PathBuf;

use crate::image::decode;

#[test]
fn real_probes_have_their_published_maxima() {
    let beside = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data"));
    let data = std::env::var_os("LOOKALIKE_DATA").map_or(beside, PathBuf::from);
    if !data.join("probes").is_dir() {
        println!("skipped: no probes in {}; set LOOKALIKE_DATA", data.display());
        return;
    }
    for (name, size, maximum) in [
        ("grace_cross.hdr", (768, 1024), Some((2352.0, 0.5))),
        ("rnl_cross.hdr", (768, 1024), None),
        ("uffizi.hdr", (1200, 600), Some((15.9, 0.05))),
        ("studio_small_05_1k.hdr", (1024, 512), None),
        ("noon_grass_1k.hdr", (1024, 512), Some((6e4, 5e3))),
    ] {
        let bytes = std::fs::read(data.join("probes").join(name)).unwrap();
        let decoded = decode(name, &bytes).unwrap();
        let image = decoded.image;
        assert_eq!(((image.width(), image.height()), decoded.warnings), (size, vec![]), "{name}");
        let largest = image.pixels().iter().flatten().copied().fold(0.0, f32::max);
        println!("{name}: {largest}");
        assert!(image.pixels().iter().flatten().all(|value| value.is_finite()));
        if let Some((maximum, tolerance)) = maximum {
            assert!((f64::from(largest) - maximum).abs() <= tolerance, "{name}: {largest}");
        }
    }
}
