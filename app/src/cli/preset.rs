//! `--preset`: named bundles of flags.

use crate::settings::Preset;
use lookalike::{
    brdf::PAPER_MODEL,
    fit::{Compress, Start},
};
use std::ffi::OsString;

/// The flags of a preset. They precede all others, so that a flag given explicitly wins.
pub(crate) fn flags(preset: Preset) -> Vec<OsString> {
    match preset {
        Preset::Paper => {
            let model = format!("--model={}", PAPER_MODEL.name()).into();
            std::iter::once(model).chain(PAPER.iter().map(Into::into)).collect()
        }
    }
}

/// Where the searches of a preset start; without one they start from a scan.
pub(crate) fn start(preset: Option<Preset>) -> Start {
    match preset {
        Some(Preset::Paper) => Start::Paper,
        None => Start::default(),
    }
}

/// What compression does near zero under a preset.
pub(crate) fn compress(preset: Option<Preset>) -> Compress {
    match preset {
        Some(Preset::Paper) => Compress::Clamp,
        None => Compress::default(),
    }
}

/// \[BP20b\] section 3 except the model, with one pixel subset; the start is that of design section 10.
const PAPER: [&str; 7] = [
    "--gammas=1:3:0.1",
    "--samples=256",
    "--sampling=importance",
    "--subsets=1",
    "--search=pattern",
    "--polish=off",
    "--judge=image",
];
