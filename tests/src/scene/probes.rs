//! The real light probes that development uses; they are not part of the project.
//!
//! They are read from the folder that the environment variable `LOOKALIKE_DATA` names, else from `../shared/data` beside the workspace. A
//! test that finds none prints so and passes.

use lookalike::{
    image::decode,
    light::{Environment, Mapping, to_lat_long},
};
use std::path::PathBuf;

/// A light probe: file name under `probes/`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Probe(pub &'static str);

/// Grace Cathedral (Debevec 1998): dark, with small bright windows and lamps.
pub const GRACE: Probe = Probe("grace_cross.hdr");
/// Eucalyptus Grove (Debevec 1998): a bright overcast sky through trees.
pub const RNL: Probe = Probe("rnl_cross.hdr");
/// Uffizi Gallery (Debevec 1998): a strip of sky between walls.
pub const UFFIZI: Probe = Probe("uffizi.hdr");
/// A photo studio (Poly Haven, CC0): black with soft boxes.
pub const STUDIO: Probe = Probe("studio_small_05_1k.hdr");
/// Outdoors with the sun itself, six texels wide at 6e4 (Poly Haven, CC0).
pub const NOON_GRASS: Probe = Probe("noon_grass_1k.hdr");

/// All of them.
pub const ALL: [Probe; 5] = [GRACE, RNL, UFFIZI, STUDIO, NOON_GRASS];

impl Probe {
    /// The map, or `None` with a message on stderr when the file does not exist.
    ///
    /// # Panics
    /// When the file exists and cannot be read.
    #[must_use]
    pub fn load(self) -> Option<Environment> {
        let path = folder().join("probes").join(self.0);
        let Ok(bytes) = std::fs::read(&path) else {
            eprintln!("skipped: no {} (set LOOKALIKE_DATA to the folder that holds probes/)", path.display());
            return None;
        };
        let image = decode(self.0, &bytes).unwrap_or_else(|e| panic!("{}: {e}", path.display())).image;
        let mapping = Mapping::recognise(image.width(), image.height()).expect("probes are lat-long maps or crosses");
        Some(to_lat_long(image, mapping).unwrap_or_else(|e| panic!("{}: {e}", path.display())))
    }
}

fn folder() -> PathBuf {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/data");
    std::env::var_os("LOOKALIKE_DATA").map_or_else(|| beside.into(), PathBuf::from)
}
