//! MERL tables. A valid table has 35 MB, so the fuzzer's bytes replace a part of one that is built once.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lookalike::{brdf::merl::MerlTable, math::Vec3};
use std::sync::LazyLock;

static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| {
    let mut bytes: Vec<u8> = [90_i32, 90, 180].iter().flat_map(|n| n.to_le_bytes()).collect();
    bytes.resize(12 + 3 * 8 * 90 * 90 * 180, 0);
    bytes
});

fuzz_target!(|bytes: &[u8]| {
    // As a whole file, for the header and the length.
    let _ = MerlTable::read("fuzz", bytes);
    // As the last values of each plane.
    let mut whole = WHOLE.clone();
    let plane = (whole.len() - 12) / 3;
    for channel in 1..=3 {
        let end = 12 + channel * plane;
        let count = bytes.len().min(plane) / 8 * 8;
        whole[end - count..end].copy_from_slice(&bytes[..count]);
    }
    if let Ok(table) = MerlTable::read("fuzz", &whole) {
        let grazing = Vec3::new(0.999, 0.0, 0.044_710).normalize();
        for wo in [Vec3::Z, grazing, Vec3::new(0.0, -0.6, 0.8)] {
            let value = table.eval(grazing, wo);
            assert!(value.is_finite() && value.min_element() >= 0.0, "{value}");
        }
    }
});
