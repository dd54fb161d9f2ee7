//! `lookalike compare`: how different two images look.

mod coverage;
mod report;

use super::output::{check_writable, write_file};
use crate::{
    exit::Exit,
    inputs::{LoadedPhoto, load_image, load_mask, resolve_display_exposure, show_warnings},
    progress::Activity,
    settings::CompareSettings,
    wrap::wrap,
};
use anyhow::{Context, bail};
use coverage::Coverage;
use lookalike::{
    image::{Encoding, metadata as keys, png},
    metric::{ErrorMap, MetricError},
};
use report::Report;
use std::{path::Path, process::ExitCode};

/// Measures the difference of two images.
pub(crate) fn run(settings: CompareSettings) -> anyhow::Result<ExitCode> {
    if let Some(path) = &settings.map {
        check_map(path, &settings.files())?;
    }
    let files = format!("{} and {}", settings.image.display(), settings.reference.display());
    let activity = Activity::new({
        let files = files.clone();
        move || format!("reading {files}")
    });
    let reference = load_image(&settings.reference, "reference")?;
    let image = load_image(&settings.image, "image")?;
    check_sizes(&settings, &reference, &image)?;
    let mask = settings.mask.as_deref().map(load_mask).transpose()?;
    let coverage = Coverage::choose(mask.as_ref(), &reference, &image)?;
    let exposure = resolve_display_exposure(&settings.display_exposure, &reference.image, &coverage.exposed, None)?;
    let mut warnings = [&reference.warnings[..], &image.warnings].concat();
    warnings.extend(mixed_encodings(&reference, &image, exposure));
    show_warnings(&warnings);
    drop(activity);

    let how = (&coverage.judged[..], exposure);
    let _activity = Activity::new(move || format!("comparing {files}"));
    let measured = settings.metric.difference(&reference.image, &image.image, how, settings.map.is_some());
    let difference = measured.with_context(|| format!("cannot compare {} and {}", name(&reference), name(&image)))?;
    if let (Some(path), Some(map)) = (&settings.map, &difference.map) {
        write_map(path, map, &settings)?;
    }
    let report = Report {
        settings: &settings,
        reference: &reference,
        image: &image,
        mask: mask.as_ref(),
        coverage: &coverage,
        exposure,
        difference: &difference,
    };
    report.print()?;
    Ok(Exit::Done.into())
}

fn check_sizes(settings: &CompareSettings, reference: &LoadedPhoto, image: &LoadedPhoto) -> anyhow::Result<()> {
    let size = |photo: &LoadedPhoto| (photo.image.width(), photo.image.height());
    let (expected, found) = (size(reference), size(image));
    if expected == found {
        return Ok(());
    }
    let pair = format!("cannot compare {} and {}", settings.reference.display(), settings.image.display());
    Err(MetricError::SizeMismatch { expected, found }).context(pair)
}

/// A warning if display values are likely to be compared with radiance by mistake: they are decoded to linear light, and the
/// exposure applies to them as to radiance.
fn mixed_encodings(reference: &LoadedPhoto, image: &LoadedPhoto, exposure: f64) -> Option<String> {
    let is_display = |photo: &LoadedPhoto| photo.encoding == Encoding::Srgb;
    let made_at = |photo: &LoadedPhoto| {
        let entry = photo.metadata.iter().find(|(key, _)| key == keys::DISPLAY_EXPOSURE);
        entry.map_or_else(String::new, |(_, value)| format!(" (made at exposure {value})"))
    };
    let mixed = |display: &LoadedPhoto, linear: &LoadedPhoto| {
        format!(
            "{} holds display values{}, {} radiance: the display values are decoded and both are exposed by {exposure}; compare \
             two files of one kind unless that is meant",
            name(display),
            made_at(display),
            name(linear)
        )
    };
    match (is_display(reference), is_display(image)) {
        (true, false) => Some(mixed(reference, image)),
        (false, true) => Some(mixed(image, reference)),
        (true, true) if exposure != 1.0 => Some(format!(
            "both images hold display values: they are decoded and then exposed by {exposure}, on top of the exposure they \
             were made at"
        )),
        _ => None,
    }
}

fn name(photo: &LoadedPhoto) -> String {
    photo.source.path.display().to_string()
}

fn check_map(path: &Path, inputs: &[&Path]) -> anyhow::Result<()> {
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("png")) {
        bail!("cannot write {}: a map of differences is a PNG; expected a name that ends in .png", path.display());
    }
    check_writable(path, inputs)
}

/// The map as a picture, with its scale in words.
fn write_map(path: &Path, map: &ErrorMap, settings: &CompareSettings) -> anyhow::Result<()> {
    let full_scale = full_scale(map);
    let legend = format!("black: no difference; pale yellow: an error of {full_scale} or more; grey border: no window");
    let entry = |key: &str, value: String| (key.to_owned(), value);
    let subject = format!("{} against {}; {legend}", settings.image.display(), settings.reference.display());
    let version = concat!("lookalike ", env!("CARGO_PKG_VERSION")).to_owned();
    let metadata = [entry(keys::SOFTWARE, version), entry(keys::COMMENTS, subject)];
    write_file(path, &png::write(&map.picture(full_scale), &metadata)?)?;
    eprintln!("{}", wrap(&format!("wrote {} ({legend})", path.display())));
    Ok(())
}

/// The smallest of 0.1, 0.2, 0.5, 1 and 2 that no window exceeds; 2 if all are exceeded. A difference below 0.1 is invisible, so a
/// smaller scale would exaggerate noise.
fn full_scale(map: &ErrorMap) -> f64 {
    let largest = map.error.iter().copied().fold(0.0, f64::max);
    [0.1, 0.2, 0.5, 1.0].into_iter().find(|&scale| largest <= scale).unwrap_or(2.0)
}
