//! `--display-exposure`: computes or reads the factor that the flag means.

use super::file::read_with;
use crate::settings::DisplayExposure;
use anyhow::{Context, bail};
use lookalike::{
    image::{Format, Image, decode, metadata},
    metric::auto_exposure,
};
use serde_json::Value;
use std::path::Path;

/// The factor of the display transform. An automatic exposure is computed from the pixels of `reference` whose `coverage` (one value per
/// pixel) is 1. If the reference is clipped at a level, that level becomes white: a match is not clipped, and above it both must look the same.
///
/// # Errors
/// If there is no light to expose for, or the file that holds the factor cannot be used.
pub fn resolve_display_exposure(
    asked: &DisplayExposure,
    reference: &Image,
    coverage: &[f32],
    clipped_at: Option<f32>,
) -> anyhow::Result<f64> {
    match asked {
        DisplayExposure::Auto => {
            let auto = auto_exposure(reference, coverage).context("--display-exposure auto")?;
            let white = clipped_at.map_or(0.0, |level| 1.0 / f64::from(level));
            Ok(auto.max(white.min(MOST_RAISED * auto)))
        }
        DisplayExposure::Value(value) => Ok(*value),
        DisplayExposure::From(path) => load_display_exposure(path),
    }
}

/// By how much a clipped level may raise the exposure: above it most of the photo would be white.
const MOST_RAISED: f64 = 4.0;

/// The factor that an earlier run used, from its `fit.json` or the metadata of one of its images.
///
/// # Errors
/// If the file cannot be read, is neither a `fit.json` nor an image, or holds no such number.
pub fn load_display_exposure(path: &Path) -> anyhow::Result<f64> {
    read_with(path, "source of the display exposure", |name, bytes| {
        if Format::sniff(bytes).is_some() { of_image(name, bytes) } else { of_json(bytes) }
    })
}

fn of_image(name: &str, bytes: &[u8]) -> anyhow::Result<f64> {
    let decoded = decode(name, bytes)?;
    let entry = decoded.metadata.iter().find(|(key, _)| key == metadata::DISPLAY_EXPOSURE);
    let Some((_, text)) = entry else {
        bail!(
            "expected {} in the image's metadata, found none; use an image that lookalike wrote, its fit.json, or a number",
            metadata::DISPLAY_EXPOSURE
        );
    };
    text.parse().ok().and_then(factor).with_context(|| format!("expected an exposure above 0, found `{text}`"))
}

fn of_json(bytes: &[u8]) -> anyhow::Result<f64> {
    let json: Value = serde_json::from_slice(bytes).context("expected a fit.json or an image of an earlier run")?;
    let field = &json["display_exposure"];
    field
        .as_f64()
        .and_then(factor)
        .with_context(|| format!("expected a \"display_exposure\" above 0, found {field}; use the fit.json of a run"))
}

fn factor(value: f64) -> Option<f64> {
    (value > 0.0 && value.is_finite()).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipped_level_becomes_white_by_a_factor_of_four_at_most() {
        let grey = Image::from_pixels(4, 1, vec![[0.9; 3]; 4]);
        let auto = |clipped_at| resolve_display_exposure(&DisplayExposure::Auto, &grey, &[1.0; 4], clipped_at).unwrap();
        let near = |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
        near(auto(None), 1.0);
        near(auto(Some(2.0)), 1.0);
        near(auto(Some(0.5)), 2.0);
        near(auto(Some(0.01)), 4.0);
        let asked = resolve_display_exposure(&DisplayExposure::Value(0.3), &grey, &[1.0; 4], Some(0.5)).unwrap();
        near(asked, 0.3);
    }
}
