//! What an earlier run of a batch has left: the same batch or another one, and which fits are complete.

use super::{check::Checked, results::Scores};
use crate::{
    fitting::version,
    journal::RunIdentity,
    outputs::{FIT_FILES, OutFolder},
    settings::{BatchFit, Judge},
};
use anyhow::bail;
use lookalike::brdf::{self, Channels, Model};
use serde_json::Value;
use std::{fs, path::Path};

/// Refuses a folder that holds a batch which is not to be gone on with.
pub(super) fn refuse_old(out: &Path) -> anyhow::Result<()> {
    let old = out.join(super::summary::JSON);
    if old.exists() {
        bail!(
            "{} says that a batch was run there already: go on with it with --resume, choose another --out, or remove it first",
            old.display()
        );
    }
    Ok(())
}

/// What the run of these fits is a run of. Their order does not matter.
pub(super) fn identity(fits: &[BatchFit], checks: &[Checked]) -> RunIdentity {
    fits.iter().zip(checks).fold(version(), |identity, (fit, checked)| {
        let parts = checked.identity.iter();
        parts.fold(identity, |identity, (name, value)| identity.with(format!("{}: {name}", fit.name), value.as_str()))
    })
}

/// The scores of a fit whose files are all there, with its seconds. The run there has to be one of this batch.
pub(super) fn complete(out: &OutFolder, fit: &BatchFit) -> Option<(Scores, f64)> {
    let folder = out.file(&fit.name);
    if !FIT_FILES.iter().all(|name| folder.join(name).is_file()) {
        return None;
    }
    let json: Value = serde_json::from_slice(&fs::read(folder.join("fit.json")).ok()?).ok()?;
    let (stage_two, polished) = (&json["stage_two"], &json["polished"]);
    let last = if polished.is_null() { stage_two } else { polished };
    let (cssim, cssim_object) = (last["cssim"].as_f64()?, last["cssim_object"].as_f64()?);
    let judged = match fit.method.judge {
        Judge::Image => cssim,
        Judge::Object => cssim_object,
    };
    let model = brdf::model(fit.method.model.as_str()).ok()?;
    let scores = Scores {
        cssim,
        cssim_object,
        gamma: stage_two["gamma"].as_f64()?,
        parameters: flat(model, &last["parameters"])?,
        is_polished: !polished.is_null(),
        is_missed: fit.max_cssim.is_some_and(|limit| judged > limit),
    };
    Some((scores, json["timing"]["seconds"]["total"].as_f64()?))
}

/// The flat vector of parameters by name.
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
