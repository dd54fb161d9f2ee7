//! The environment map.

use super::file::{InputFile, cannot_use, read_with};
use crate::settings::EnvironmentSettings;
use anyhow::{Context, bail};
use lookalike::{
    image::{Decoded, Encoding, Image, decode},
    light::{Environment, Mapping, to_lat_long},
    scene::plateau,
};
use std::sync::Arc;

/// An environment map with its origin.
#[derive(Debug, Clone)]
pub struct LoadedEnvironment {
    /// The light as a lat-long map, rotated by the angle of the settings.
    pub environment: Arc<Environment>,
    /// The layout of the file, given or recognised.
    pub mapping: Mapping,
    /// The file, with the hash of its pixels before any conversion of layout or rotation.
    pub source: InputFile,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// Reads the environment map: OpenEXR, Radiance HDR or PFM, in the given layout, or the one that its shape implies.
///
/// # Errors
/// If the file cannot be read or decoded, holds display values (PNG, JPEG, integer TIFF), has an unknown layout or a texel that is negative or
/// not finite, or contains no light.
pub fn load_environment(settings: &EnvironmentSettings) -> anyhow::Result<LoadedEnvironment> {
    let path = &settings.path;
    let decoded = read_with(path, ROLE, |name, bytes| radiance(decode(name, bytes)?))?;
    let source = InputFile::of_image(path, &decoded.image);
    let (width, height) = (decoded.image.width(), decoded.image.height());
    let mapping = match settings.mapping {
        Some(mapping) => Ok(mapping),
        None => Mapping::recognise(width, height),
    };
    let mapping = mapping.with_context(|| cannot_use(path, ROLE))?;
    let clipped = cut_off(&decoded.image);
    let environment = to_lat_long(decoded.image, mapping).with_context(|| cannot_use(path, ROLE))?;
    let environment = Arc::new(environment.rotated(settings.rotation_deg));
    let warnings = decoded.warnings.iter().chain(&clipped).map(|text| format!("{}: {text}", path.display())).collect();
    Ok(LoadedEnvironment { environment, mapping, source, warnings })
}

/// A warning if the brightest texels were cut off, in all channels at one level.
fn cut_off(map: &Image) -> Option<String> {
    let level = plateau(map.pixels().iter().map(|texel| texel[0]))?;
    let count = map.pixels().iter().filter(|texel| **texel == [level; 3]).count();
    let is_common = [1, 2].iter().all(|&c| plateau(map.pixels().iter().map(|texel| texel[c])) == Some(level));
    is_common.then(|| {
        format!(
            "{count} texels have the same largest value {level} in all channels: if lamps or the sun were cut off there, highlights \
             are too strong for this light, and a map of full range is needed"
        )
    })
}

/// Refuses display values.
fn radiance(decoded: Decoded) -> anyhow::Result<Decoded> {
    if decoded.encoding == Encoding::Srgb {
        bail!(
            "expected radiance (OpenEXR, Radiance HDR or PFM), found display values ({}): they end at white, so a lamp or \
             the sun in them is clipped to the brightness of a white wall and no highlight could be explained; use the HDR \
             file that the image was made from, or, if nothing in the scene was brighter than white, convert the image \
             to linear OpenEXR",
            decoded.format
        );
    }
    Ok(decoded)
}

const ROLE: &str = "environment map";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_that_ends_at_one_level_in_all_channels_gives_a_warning() {
        let map = |level: f32, tint: [f32; 3]| {
            let light = |k: usize| 0.01 * k as f32;
            Image::from_pixels(32, 16, (0..512).map(|k| tint.map(|x| (x * light(k)).min(level))).collect())
        };
        let warning = cut_off(&map(4.0, [1.0, 1.2, 0.9])).unwrap();
        assert!(warning.contains("67 texels have the same largest value 4 in all channels"), "{warning}");
        assert_eq!(cut_off(&map(100.0, [1.0, 1.2, 0.9])), None);
        assert_eq!(cut_off(&map(4.0, [1.0, 1.2, 0.1])), None, "one channel is below it");
    }
}
