//! What a user should know about a result beyond its numbers.

use lookalike::{
    brdf::{Model, Role, flat_bounds, flat_names},
    fit::{FitOutcome, Method, gamma_range},
};

/// Notes on the winner: at an end of the gammas, parameters at their bounds, reflecting more than it receives.
pub(crate) fn notes(method: &Method, outcome: &FitOutcome) -> Vec<String> {
    let winner = &outcome.judged[outcome.winner].candidate;
    let last = outcome.polished.as_ref().map_or(&winner.parameters, |p| &p.parameters);
    let mut notes = Vec::new();
    if let Some((low, high)) = gamma_range(&method.gammas).filter(|(low, high)| low < high) {
        if winner.gamma == high {
            notes.push(format!(
                "the winning gamma {high} is the largest that was tried: a wider range may match better, \
                 such as --gammas {low}:{}:0.1",
                2.0 * high
            ));
        } else if winner.gamma == low && low > 0.2 {
            notes.push(format!(
                "the winning gamma {low} is the smallest that was tried: a wider range may match better, \
                 such as --gammas {}:{high}:0.1",
                low / 2.0
            ));
        }
    }
    notes.extend(at_bounds(method.model, last));
    notes.extend(bright(method.model, last));
    notes
}

fn at_bounds(model: &dyn Model, parameters: &[f64]) -> Option<String> {
    let (lower, upper) = flat_bounds(model.parameters());
    let names = flat_names(model.parameters());
    // A colour of zero is an answer (no diffuse part); an upper bound or a width at its end is a limit of the model.
    let is_width = |i: usize| model.lobes().iter().any(|b| b.width == Some(i));
    let limited = |&i: &usize| parameters[i] == upper[i] || (is_width(i) && parameters[i] == lower[i]);
    let limited: Vec<String> =
        (0..parameters.len()).filter(limited).map(|i| format!("{} = {}", names[i], parameters[i])).collect();
    let list = limited.join(", ");
    (!limited.is_empty()).then(|| format!("at the limit of the model's range: {list}; the photo asks for more"))
}

/// Colours are free, so a fit may reflect more light than it receives.
fn bright(model: &dyn Model, parameters: &[f64]) -> Option<String> {
    let specular = model.normal_incidence_specular(parameters);
    let mut first = 0;
    for parameter in model.parameters() {
        if parameter.role == Role::Linear && parameter.name == "kd" {
            let most = (0..3).map(|c| parameters[first + c] + specular[c]).fold(0.0, f64::max);
            return (most > 1.0).then(|| {
                format!("diffuse and specular reflectance add up to {most:.2} in a channel: more light than is received; check the exposure of photo and map")
            });
        }
        first += parameter.channels.count();
    }
    None
}
