//! The files of a finished fit.

use crate::outputs::{FitRecord, OutFolder, Pictures, Timing, candidates_csv, parameters_json, write_pictures};
use anyhow::Context;
use lookalike::{fit::JudgedBy, image::metadata, plan::FitOutcome};

/// Writes all files of a finished fit. `fit.json` comes last, because it marks the fit as finished.
pub(crate) fn write_results(out: &OutFolder, record: &FitRecord<'_>, timing: &Timing) -> anyhow::Result<Pictures> {
    let (method, outcome, exposure) = (record.method(), record.outcome, record.display_exposure);
    let pictures = Pictures::new(record.capture, outcome, exposure);
    let parameters = parameters_json(method.model, final_parameters(outcome)).to_string();
    let about = [
        (metadata::SOFTWARE, "lookalike".to_owned()),
        (metadata::VERSION, env!("CARGO_PKG_VERSION").to_owned()),
        (metadata::CONVENTIONS, "linear Rec. 709; +Y up, camera on +Z; alpha is the microfacet width".to_owned()),
        (metadata::MODEL, method.model.name().to_owned()),
        (metadata::PARAMETERS, parameters),
        (metadata::DISPLAY_EXPOSURE, exposure.to_string()),
        (metadata::SEED, method.seed.to_string()),
    ];
    let about: Vec<(String, String)> = about.into_iter().map(|(k, v)| (k.to_owned(), v)).collect();
    write_pictures(out, &pictures, &about)?;
    out.write("candidates.csv", candidates_csv(method.model, &outcome.judged).as_bytes())?;
    let text = serde_json::to_string_pretty(&record.json(timing)).context("fit.json")? + "\n";
    out.write("fit.json", text.as_bytes())?;
    Ok(pictures)
}

/// The final parameters: those of polish if it ran, otherwise those of the winner of stage two.
pub(crate) fn final_parameters(outcome: &FitOutcome) -> &[f64] {
    let winner = &outcome.judged[outcome.winner].candidate.parameters;
    outcome.polished.as_ref().map_or(winner, |p| &p.parameters)
}

/// The scores of [`final_parameters`]: of the whole image, and of the object.
pub(crate) fn final_scores(outcome: &FitOutcome) -> (f64, f64) {
    let winner = &outcome.judged[outcome.winner];
    let polished = outcome.polished.as_ref().map(|p| (p.cssim, p.cssim_object));
    polished.unwrap_or((winner.cssim, winner.cssim_object))
}

/// The score that the fit selects and polishes by.
pub(crate) fn final_score(judge: JudgedBy, outcome: &FitOutcome) -> f64 {
    let (image, object) = final_scores(outcome);
    judge.pick(image, object)
}
