//! OpenEXR files: as an image, a mask and normals.
#![no_main]

use libfuzzer_sys::fuzz_target;
use lookalike::image::{Limits, Source};

fuzz_target!(
    init: {
        // The reader catches panics of the `exr` crate's decompressors. libFuzzer's hook would end the process before that.
        let stop = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            let is_caught = panic.location().is_some_and(|at| at.file().contains("/exr-") && at.file().contains("/src/compression/"));
            if !is_caught {
                stop(panic);
            }
        }));
    },
    |bytes: &[u8]| {
        let source = Source::new("fuzz", bytes).with_limits(Limits { max_side: 1 << 11, max_pixels: 1 << 18 });
        let _ = (source.decode(), source.mask(), source.normals());
    }
);
