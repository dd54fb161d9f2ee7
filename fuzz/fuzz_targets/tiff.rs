//! TIFF files.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lookalike::image::{Limits, Source};

fuzz_target!(|bytes: &[u8]| {
    let source = Source::new("fuzz", bytes).with_limits(Limits { max_side: 1 << 11, max_pixels: 1 << 18 });
    let _ = (source.decode(), source.mask(), source.normals());
});
