//! `fit.json`, the result of a fit for programs (design section 10).
//!
//! Without its `timing` block it is bit-identical from run to run: everything that depends on the run rather than on the inputs
//! is in that block.

use super::conventions;
use lookalike::{
    brdf::{Channels, Model, flat_names},
    fit::{Judged, Known, Method, Methods, Neighbour, Standing, Tried, Uncertainty, Verdict, spread},
    light::FORMULA_LIGHTS,
    plan::FitOutcome,
    scene::Capture,
};
use serde_json::{Map, Value, json};

/// The schema of the document.
const SCHEMA: &str = "lookalike.fit/1";

/// The data for the document.
#[derive(Debug)]
pub(crate) struct FitRecord<'a> {
    pub(crate) methods: &'a Methods,
    pub(crate) capture: &'a Capture,
    /// The inputs of the fit.
    pub(crate) inputs: &'a Value,
    pub(crate) outcome: &'a FitOutcome,
    pub(crate) display_exposure: f64,
    /// Notes for the user on the result.
    pub(crate) notes: &'a [String],
}

/// The part that depends on the run.
#[derive(Debug, Clone, Default)]
pub(crate) struct Timing {
    /// Wall-clock seconds, by stage.
    pub(crate) seconds: Vec<(&'static str, f64)>,
    /// CPU seconds, by process.
    pub(crate) cpu_seconds: Vec<(&'static str, f64)>,
    pub(crate) workers: usize,
    pub(crate) out: String,
    pub(crate) attempts: u64,
    pub(crate) requeued: u64,
}

impl FitRecord<'_> {
    /// The method with the model that was chosen.
    pub(crate) fn method(&self) -> &Method {
        self.methods.get(self.outcome.chosen)
    }

    /// How good the match is, in words.
    pub(crate) fn verdict(&self) -> Verdict {
        let FitOutcome { judged, winner, polished, noise, .. } = self.outcome;
        let object = polished.as_ref().map_or(judged[*winner].cssim_object, |p| p.cssim_object);
        Verdict::of(object, noise.map_or(0.0, |(_, (_, floor))| floor))
    }

    /// The document.
    pub(crate) fn json(&self, timing: &Timing) -> Value {
        let model = self.method().model;
        let score = |cssim: f64, object: f64| json!({ "cssim": cssim, "cssim_object": object });
        let candidate = |j: &Judged| {
            let c = &j.candidate;
            let mut entry = json!({ "gamma": c.gamma, "subset": c.subset, "cost": c.cost });
            merge(&mut entry, score(j.cssim, j.cssim_object));
            let rest = json!({ "evaluations": c.evaluations, "termination": c.termination.name() });
            merge(&mut entry, rest);
            merge(&mut entry, json!({ "parameters": parameters_json(model, &c.parameters) }));
            entry
        };
        // In the order of gammas, then of subsets.
        let mut order: Vec<&Judged> = self.outcome.judged.iter().collect();
        order.sort_by(|a, b| a.candidate.gamma.total_cmp(&b.candidate.gamma));
        let winner = &self.outcome.judged[self.outcome.winner];
        let mut stage_two = json!({ "gamma": winner.candidate.gamma, "subset": winner.candidate.subset });
        merge(&mut stage_two, score(winner.cssim, winner.cssim_object));
        merge(&mut stage_two, json!({ "parameters": parameters_json(model, &winner.candidate.parameters) }));
        let polished = self.outcome.polished.as_ref().map(|p| {
            let mut entry = score(p.cssim, p.cssim_object);
            merge(&mut entry, json!({ "parameters": parameters_json(model, &p.parameters) }));
            let explored = self.outcome.explored;
            let rest =
                json!({ "evaluations": p.evaluations, "explored": explored, "termination": p.termination.name() });
            merge(&mut entry, rest);
            entry
        });
        let counts = self.capture.counts();
        let software = json!({ "name": "lookalike", "version": env!("CARGO_PKG_VERSION") });
        let mut document = json!({ "schema": SCHEMA, "software": software });
        let settings = self.method().settings().into_iter().filter_map(|setting| setting.field);
        merge(&mut document, settings.map(|(name, value)| (name.to_owned(), value)).collect());
        let rest = json!({
            "display_exposure": self.display_exposure,
            "inputs": self.inputs,
            "geometry": self.capture.geometry().spec(),
            "pixels": {
                "usable": counts.usable,
                "outside": counts.outside,
                "masked": counts.masked,
                "silhouette": counts.silhouette,
                "clipped": counts.clipped,
                "not_finite": counts.not_finite,
            },
            "conventions": conventions(),
            "exposure_gain": [1.0, 1.0, 1.0],
            "candidates": order.into_iter().map(candidate).collect::<Vec<_>>(),
            "models": self.models_json(),
            "noise": self.outcome.noise.map(|(noise, _)| noise),
            "noise_floor": self.outcome.noise.map(|(_, (image, object))| self.method().judge.pick(image, object)),
            "verdict": self.verdict().to_string(),
            "stage_two": stage_two,
            "polished": polished,
            "uncertainty": uncertainty_json(model, &self.outcome.uncertainty),
            "relighting": relighting_json(&self.outcome.neighbours),
            "notes": self.notes,
            "timing": timing.json(),
        });
        merge(&mut document, rest);
        document
    }

    /// Every model that was tried, in order, and why it was chosen or not.
    fn models_json(&self) -> Vec<Value> {
        let tried = self.methods.iter().zip(&self.outcome.tried).enumerate();
        tried
            .map(|(i, (method, tried))| {
                json!({
                    "model": method.model.name(),
                    "fixed": method.ranges.held(),
                    "gamma": tried.gamma,
                    "cssim": tried.cssim,
                    "cssim_object": tried.cssim_object,
                    "coarse": tried.is_coarse,
                    "above_best": {
                        "difference": tried.above_best.0,
                        "standard_error": tried.above_best.1,
                        "tolerance": tried.tolerance,
                    },
                    "chosen": i == self.outcome.chosen,
                    "why": why(tried, i, self.outcome.chosen),
                    "parameters": parameters_json(method.model, &tried.parameters),
                })
            })
            .collect()
    }
}

/// Why a model was chosen or not, in words.
pub(crate) fn why(tried: &Tried, index: usize, chosen: usize) -> String {
    let (difference, error) = tried.above_best;
    match (index == chosen, tried.is_as_good()) {
        _ if tried.is_coarse => {
            format!("given up on a coarse picture: above the best there by {difference:.4} +- {error:.4}")
        }
        (true, _) if index == 0 && difference == 0.0 => "the best match".to_owned(),
        (true, _) if difference == 0.0 => "the best match; no simpler model is as good".to_owned(),
        (true, _) => {
            let tolerance = tried.tolerance;
            format!("the simplest that is as good as the best: above it by {difference:.4}, within {tolerance:.4}")
        }
        (false, true) => "as good, but not simpler".to_owned(),
        (false, false) => format!("above the best by {difference:.4} +- {error:.4}"),
    }
}

impl Timing {
    fn json(&self) -> Value {
        let object = |pairs: &[(&'static str, f64)]| {
            let rounded = |x: f64| (x * 1000.0).round() / 1000.0;
            pairs.iter().map(|(name, x)| ((*name).to_owned(), json!(rounded(*x)))).collect::<Map<String, Value>>()
        };
        json!({
            "seconds": object(&self.seconds),
            "cpu_seconds": object(&self.cpu_seconds),
            "workers": self.workers,
            "attempts": self.attempts,
            "requeued": self.requeued,
            // Not `args()`, which panics on arguments that are not UTF-8.
            "command_line": std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect::<Vec<_>>(),
            "out": self.out,
            "os": std::env::consts::OS,
            "architecture": std::env::consts::ARCH,
        })
    }
}

/// A flat parameter vector by name: a colour as three numbers, a scalar as one.
pub(crate) fn parameters_json(model: &dyn Model, parameters: &[f64]) -> Value {
    by_name(model, &parameters.iter().map(|value| json!(value)).collect::<Vec<_>>())
}

/// One value per entry of the flat parameter vector, by name.
fn by_name(model: &dyn Model, entries: &[Value]) -> Value {
    let mut object = Map::new();
    let mut first = 0;
    for parameter in model.parameters() {
        let count = parameter.channels.count();
        let values = &entries[first..first + count];
        let value = match parameter.channels {
            Channels::Scalar => values[0].clone(),
            Channels::Rgb => json!(values),
        };
        object.insert(parameter.name.to_owned(), value);
        first += count;
    }
    Value::Object(object)
}

/// How well the photo determines each reported parameter: the 95 % range, whether the value is `determined`, `at-bound`, `undetermined`, or
/// `held` by the settings, and the pairs of which one can make up for the other.
fn uncertainty_json(model: &dyn Model, uncertainty: &Uncertainty) -> Value {
    let of =
        |field: &dyn Fn(&Known) -> Value| by_name(model, &uncertainty.entries.iter().map(field).collect::<Vec<_>>());
    let state = |known: &Known| match known.standing {
        Standing::Determined => json!("determined"),
        Standing::AtBound => json!("at-bound"),
        Standing::Undetermined => json!("undetermined"),
        Standing::Held => json!("held"),
    };
    let names = flat_names(model.parameters());
    let trades: Vec<[&String; 2]> = uncertainty.trades.iter().map(|&(a, b)| [&names[a], &names[b]]).collect();
    json!({ "low": of(&|known| json!(known.low)), "high": of(&|known| json!(known.high)), "state": of(&state), "trades": trades })
}

/// The neighbours of the match under other lights.
fn relighting_json(neighbours: &[Neighbour]) -> Value {
    let of = |neighbour: &Neighbour| {
        let by_light =
            FORMULA_LIGHTS.iter().zip(&neighbour.cssim).map(|(light, score)| (light.name.to_owned(), json!(score)));
        json!({ "match": neighbour.name, "cssim_object": Value::Object(by_light.collect()) })
    };
    let spread = spread(neighbours).map(|spread| spread.to_string());
    json!({ "spread": spread, "neighbours": neighbours.iter().map(of).collect::<Vec<_>>() })
}

fn merge(into: &mut Value, from: Value) {
    if let (Value::Object(into), Value::Object(from)) = (into, from) {
        into.extend(from);
    }
}
