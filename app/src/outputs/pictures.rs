//! The pictures of a fit: `match.exr`, `match.png`, `reference.png`, `difference.png`.

use super::OutFolder;
use anyhow::Context;
use lookalike::{
    image::{Image, metadata, openexr, png},
    math::to_f32,
    plan::FitOutcome,
    scene::Capture,
};

/// Images ready to be written, linear Rec. 709, over black.
#[derive(Debug)]
pub(crate) struct Pictures {
    /// The photo, black where it is not scored.
    pub(crate) reference: Image,
    /// The match, linear.
    pub(crate) matched: Image,
    /// The error of the match in false colours.
    pub(crate) difference: Image,
    /// The error that the brightest false colour stands for.
    pub(crate) difference_scale: f64,
    coverage: Vec<f32>,
    exposure: f64,
}

impl Pictures {
    pub(crate) fn new(capture: &Capture, outcome: &FitOutcome, exposure: f64) -> Self {
        let coverage = capture.scoring_coverage();
        let mut errors: Vec<f64> = outcome.error_map.error.clone();
        let difference_scale = full_scale(&mut errors);
        Self {
            reference: scored(capture.photo(), &coverage),
            matched: outcome.matched.clone(),
            difference: outcome.error_map.picture(difference_scale),
            difference_scale,
            coverage,
            exposure,
        }
    }

    /// A linear image times the display exposure; the PNG writer clips and encodes it.
    pub(crate) fn displayed(&self, image: &Image) -> Image {
        exposed(image, self.exposure)
    }
}

/// Writes the four pictures.
pub(crate) fn write_pictures(
    folder: &OutFolder,
    pictures: &Pictures,
    about: &[(String, String)],
) -> anyhow::Result<()> {
    let exr = openexr::write(&pictures.matched, Some(&pictures.coverage), about).context("match.exr")?;
    folder.write("match.exr", &exr)?;
    let png = |name: &str, image: &Image, extra: Option<(&str, String)>| {
        let mut keys = about.to_vec();
        keys.extend(extra.map(|(k, v)| (k.to_owned(), v)));
        folder.write(name, &png::write(image, &keys).with_context(|| name.to_owned())?)
    };
    png("match.png", &pictures.displayed(&pictures.matched), None)?;
    png("reference.png", &pictures.displayed(&pictures.reference), None)?;
    let scale =
        format!("black 0, pale yellow {} and above: 1 - product of the five features", pictures.difference_scale);
    png("difference.png", &pictures.difference, Some((metadata::COMMENTS, scale)))
}

/// The smallest of a few round numbers that 99 % of the errors on the object do not exceed.
fn full_scale(errors: &mut Vec<f64>) -> f64 {
    errors.retain(|e| *e > 0.0);
    errors.sort_by(f64::total_cmp);
    let high = errors.get(errors.len() * 99 / 100).copied().unwrap_or(0.0);
    [0.02, 0.05, 0.1, 0.2, 0.5].into_iter().find(|&scale| high <= scale).unwrap_or(1.0)
}

/// The photo, black where it is not scored.
fn scored(photo: &Image, coverage: &[f32]) -> Image {
    let pixels = photo.pixels().iter().zip(coverage);
    let pixels = pixels.map(|(p, &c)| if c > 0.0 { *p } else { [0.0; 3] }).collect();
    Image::from_pixels(photo.width(), photo.height(), pixels)
}

fn exposed(image: &Image, exposure: f64) -> Image {
    let pixels = image.pixels().iter().map(|p| p.map(|x| to_f32(f64::from(x) * exposure))).collect();
    Image::from_pixels(image.width(), image.height(), pixels)
}
