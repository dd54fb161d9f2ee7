//! The check before any work: reads the inputs of every fit and reports all problems at once.

use super::{lights::Lights, prepare::Prepared};
use crate::{
    outputs::counted,
    problems::Problems,
    progress::Activity,
    settings::{BatchFit, BatchSettings},
};
use rayon::prelude::*;
use serde_json::Value;
use std::sync::{
    Arc,
    atomic::{AtomicUsize, Ordering},
};

/// The result of the check of a fit.
#[derive(Debug, Clone)]
pub(super) struct Checked {
    /// The `inputs` of its `fit.json`, with the hashes of their contents.
    pub(super) inputs: Value,
    /// Pixels of its photo.
    pub(super) pixels: usize,
    /// The inputs and settings that may not change when the batch is resumed, by name.
    pub(super) identity: Vec<(&'static str, String)>,
}

/// The results of the check of all fits, and the warnings for the user.
#[derive(Debug)]
pub(super) struct AllChecked {
    pub(super) fits: Vec<Checked>,
    pub(super) warnings: Vec<String>,
}

/// Reads the inputs of every fit, a few at a time, and frees them again.
///
/// # Errors
/// All problems, each with the names of the fits that have it.
pub(super) fn check(settings: &BatchSettings, lights: &Lights) -> anyhow::Result<AllChecked> {
    let checked = |fit| -> anyhow::Result<(Checked, Vec<String>)> {
        let prepared = Prepared::new(fit, lights, settings.stage_two)?;
        let (pixels, identity) = (prepared.pixels(), prepared.identity()?);
        Ok((Checked { inputs: prepared.inputs, pixels, identity }, prepared.warnings))
    };
    let read = Arc::new(AtomicUsize::new(0));
    let activity = Activity::reading(settings.progress, counted(settings.fits.len(), "fit"), &read);
    let of_fit = |fit| {
        let checked = checked(fit);
        read.fetch_add(1, Ordering::Relaxed);
        checked
    };
    let found: Vec<_> = settings.fits.par_iter().map(of_fit).collect();
    drop(activity);
    let (mut fits, mut warnings, mut problems) = (Vec::new(), Vec::new(), Vec::<(String, Vec<&BatchFit>)>::new());
    for (fit, found) in settings.fits.iter().zip(found) {
        match found {
            Ok((checked, of_fit)) => {
                fits.push(checked);
                // Fits with one photo or one light share its warnings.
                for warning in of_fit {
                    if !warnings.contains(&warning) {
                        warnings.push(warning);
                    }
                }
            }
            Err(error) => {
                let text = format!("{error:#}");
                match problems.iter_mut().find(|(known, _)| *known == text) {
                    Some((_, concerned)) => concerned.push(fit),
                    None => problems.push((text, vec![fit])),
                }
            }
        }
    }
    let manifest = settings.manifest.display().to_string();
    let lines = problems.iter().map(|(text, fits)| line(&manifest, text, fits)).collect();
    Problems::check(lines, &manifest)?;
    Ok(AllChecked { fits, warnings })
}

/// A problem with the fits that have it; the first is named.
fn line(manifest: &str, text: &str, fits: &[&BatchFit]) -> String {
    let Some(first) = fits.first() else { return text.to_owned() };
    let others = match fits.len() - 1 {
        0 => String::new(),
        1 => " and one other".to_owned(),
        more => format!(" and {more} others"),
    };
    format!("{manifest}:{}: {}{others}: {text}", first.line, first.name)
}
