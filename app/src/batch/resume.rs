//! Examines an earlier run of a batch: whether it is the same batch, and which fits are complete.

use super::{check::Checked, row::Scores};
use crate::{
    fit::version,
    outputs::{MARK, OutFolder},
    run::{journal_failed, missing},
    settings::BatchFit,
};
use lookalike::brdf::{self, Channels, Model};
use lookalike_coordinator::journal::{self, JOURNAL_FILE, RunIdentity};
use serde_json::Value;
use std::fs;

/// The identity of a batch of these fits. Their order does not matter.
pub(super) fn identity(fits: &[BatchFit], checks: &[Checked]) -> RunIdentity {
    fits.iter().zip(checks).fold(version(), |identity, (fit, checked)| {
        let parts = checked.identity.iter();
        parts.fold(identity, |identity, (name, value)| identity.with(format!("{}: {name}", fit.name), value.as_str()))
    })
}

/// The state of an earlier run of a batch.
#[derive(Debug)]
pub(super) struct Earlier {
    /// Whether there is nothing left to do.
    pub(super) is_finished: bool,
    /// For each fit whose files are all there as the run wrote them, its scores and its seconds.
    pub(super) complete: Vec<Option<(Scores, f64)>>,
    /// A remark for the user.
    pub(super) remark: Option<String>,
}

/// The state of the run in a folder, if it is resumed. Only files that its journal lists count as its results.
///
/// # Errors
/// If that run has other inputs or settings, or a result was changed.
pub(super) fn earlier(
    out: &OutFolder,
    out_name: &str,
    run: &RunIdentity,
    fits: &[BatchFit],
) -> anyhow::Result<Earlier> {
    let path = out.file(JOURNAL_FILE);
    if !path.exists() {
        return Ok(Earlier { is_finished: false, complete: vec![None; fits.len()], remark: None });
    }
    let written = journal::written(&path, run).map_err(journal_failed)?;
    let (mut complete, mut gone) = (Vec::new(), Vec::new());
    for fit in fits {
        let Some(files) = written.outputs.get(&fit.name) else {
            complete.push(None);
            continue;
        };
        let paths: Vec<_> = files.iter().map(|(name, hash)| (format!("{}/{name}", fit.name), hash.clone())).collect();
        let missing = missing(out, out_name, &paths)?;
        complete.push(if missing.is_empty() { complete_fit(out, fit, files) } else { None });
        gone.extend(missing);
    }
    let is_finished = written.is_finished && complete.iter().all(Option::is_some);
    let remark = if is_finished {
        Some(format!("the run in {out_name} is finished, and its results are as it wrote them"))
    } else {
        (!gone.is_empty()).then(|| format!("of the run in {out_name}, {} is missing: fitting again", gone.join(", ")))
    };
    Ok(Earlier { is_finished, complete, remark })
}

/// The scores and the seconds of a fit whose files are there.
fn complete_fit(out: &OutFolder, fit: &BatchFit, files: &[(String, String)]) -> Option<(Scores, f64)> {
    let json: Value = serde_json::from_slice(&fs::read(out.file(&fit.name).join(MARK)).ok()?).ok()?;
    let (stage_two, polished) = (&json["stage_two"], &json["polished"]);
    let last = if polished.is_null() { stage_two } else { polished };
    let (cssim, cssim_object) = (last["cssim"].as_f64()?, last["cssim_object"].as_f64()?);
    let judge = fit.methods.common().judge;
    let judged = judge.pick(cssim, cssim_object);
    let model = brdf::model(json["model"].as_str()?).ok()?;
    let scores = Scores {
        cssim,
        cssim_object,
        judge,
        model,
        gamma: stage_two["gamma"].as_f64()?,
        parameters: flat(model, &last["parameters"])?,
        is_polished: !polished.is_null(),
        is_missed: fit.max_cssim.is_some_and(|limit| judged > limit),
        files: files.to_vec(),
    };
    Some((scores, json["timing"]["seconds"]["total"].as_f64()?))
}

/// The flat parameter vector from parameters by name.
fn flat(model: &dyn Model, parameters: &Value) -> Option<Vec<f64>> {
    let mut flat = Vec::new();
    for parameter in model.parameters() {
        let value = &parameters[parameter.name];
        match parameter.channels {
            Channels::Scalar => flat.push(value.as_f64()?),
            Channels::Rgb => {
                let channels = value.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<_>>>()?;
                flat.extend((channels.len() == 3).then_some(channels)?);
            }
        }
    }
    Some(flat)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outputs::parameters_json;

    #[test]
    fn parameters_come_back_from_their_names() {
        let model = brdf::model("cook-torrance").unwrap();
        let vector: Vec<f64> = (1..=8).map(f64::from).collect();
        let mut json = parameters_json(model, &vector);
        assert_eq!(flat(model, &json), Some(vector));
        json["m"] = Value::Null;
        assert_eq!(flat(model, &json), None);
    }
}
