//! Notes for the user on a result.

use lookalike::{
    brdf::{Model, flat_bounds, flat_names, main_lobe},
    fit::{Known, Method, Ranges, Standing, Uncertainty, gamma_range},
    plan::FitOutcome,
};

/// Notes on the result: without polish, its gamma is the first or the last one; polish left the lobe of stage two; parameters are at their bounds
/// or not determined; it reflects more light than it receives.
pub(crate) fn notes(method: &Method, outcome: &FitOutcome) -> Vec<String> {
    let winner = &outcome.judged[outcome.winner].candidate;
    let last = outcome.polished.as_ref().map_or(&winner.parameters, |p| &p.parameters);
    let mut notes = Vec::new();
    // With polish a wider range does not pay (docs/method.md).
    if let Some((low, high)) = gamma_range(&method.gammas).filter(|(low, high)| low < high && !method.polish) {
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
    let entries = &outcome.uncertainty.entries;
    let known = |i: usize| {
        let standing = entries.get(i).map(|known| known.standing);
        !matches!(standing, Some(Standing::Undetermined | Standing::Held))
    };
    notes.extend(jumped(method.model, &winner.parameters, last, entries));
    notes.extend(at_bounds(method.model, &method.ranges, last, known));
    notes.extend(method.model.remark(last, &known));
    notes.extend(undetermined(method.model, entries));
    notes.extend(trade(method.model, &outcome.uncertainty));
    notes.extend(bright(method.model, last));
    notes
}

fn at_bounds(
    model: &dyn Model,
    ranges: &Ranges,
    parameters: &[f64],
    is_determined: impl Fn(usize) -> bool,
) -> Option<String> {
    let (lower, upper) = ranges.bounds(model);
    let (least, most) = flat_bounds(model.parameters());
    let names = flat_names(model.parameters());
    // A parameter at the lower bound of the model is a valid result (no diffuse part, a dielectric), except for a width. At the upper bound
    // it is limited by the model, unless that bound stands for a kind of surface. At a bound of `--bounds` it is limited by that.
    let is_width = |i: usize| model.lobes().iter().any(|b| b.width.is_some_and(|width| width.entry == i));
    let is_kind: Vec<bool> =
        model.parameters().iter().flat_map(|p| std::iter::repeat_n(p.upper_is_kind, p.channels.count())).collect();
    let limited = |&i: &usize| {
        let is_kind = is_kind[i] && upper[i] == most[i];
        (parameters[i] == upper[i] && !is_kind) || (parameters[i] == lower[i] && (is_width(i) || lower[i] > least[i]))
    };
    let limited: Vec<String> = (0..parameters.len())
        .filter(limited)
        .filter(|&i| is_determined(i))
        .map(|i| format!("{} = {}", names[i], parameters[i]))
        .collect();
    let list = limited.join(", ");
    (!limited.is_empty()).then(|| format!("at the end of the range: {list}; a value beyond it may match better"))
}

/// The lobes of two widths look different if their ratio is above this.
const OTHER_LOBE: f64 = 1.25;

/// Polish may end at another lobe than that of stage two, which the cost of stage one did not find.
fn jumped(model: &dyn Model, won: &[f64], last: &[f64], entries: &[Known]) -> Option<String> {
    let (_, width) = main_lobe(model)?;
    let ratio = width.at(last) / width.at(won);
    let (name, before, after) =
        (flat_names(model.parameters()).swap_remove(width.entry), won[width.entry], last[width.entry]);
    let is_outside = entries.get(width.entry).is_some_and(|known| !(known.low..=known.high).contains(&before));
    (is_outside && !(1.0 / OTHER_LOBE..=OTHER_LOBE).contains(&ratio)).then(|| {
        format!(
            "polish found another lobe than stage two: {name} {before:.3} became {after:.3}. The material may have \
             both, or the light may be blurred; look at match.png before you trust either"
        )
    })
}

/// Parameters of which one can make up for another, strongest first, by name.
fn trade(model: &dyn Model, uncertainty: &Uncertainty) -> Option<String> {
    let names = flat_names(model.parameters());
    let of = |i: usize| names[i].split('.').next().unwrap_or_default();
    let mut pairs: Vec<String> = Vec::new();
    for &(a, b) in uncertainty.trades.iter().filter(|(a, b)| of(*a) != of(*b)) {
        let pair = format!("{} and {}", of(a), of(b));
        if !pairs.contains(&pair) {
            pairs.push(pair);
        }
    }
    let list = pairs.join(", ");
    (!list.is_empty()).then(|| {
        format!("within their ranges these make up for each other: {list}; hold one of them with --fix if you know it")
    })
}

/// The parameters that the photo does not determine: values from much of their range match it equally well.
fn undetermined(model: &dyn Model, known: &[Known]) -> Option<String> {
    let names = flat_names(model.parameters());
    let mut list = Vec::new();
    let mut first = 0;
    for parameter in model.parameters() {
        let entries = first..first + parameter.channels.count();
        let open: Vec<usize> = entries.clone().filter(|&i| known[i].standing == Standing::Undetermined).collect();
        if open.len() == entries.len() {
            list.push(parameter.name.to_owned());
        } else {
            list.extend(open.into_iter().map(|i| names[i].clone()));
        }
        first = entries.end;
    }
    let list = list.join(", ");
    (!list.is_empty()).then(|| {
        format!("the photo does not determine {list}: other values look the same, so do not read them as a measurement")
    })
}

/// A fit may reflect more light than it receives, because its colours are not limited.
fn bright(model: &dyn Model, parameters: &[f64]) -> Option<String> {
    let sum = model.diffuse_albedo(parameters) + model.normal_incidence_specular(parameters);
    let most = (0..3).map(|c| sum[c]).fold(0.0, f64::max);
    (most > 1.0).then(|| {
        format!("diffuse and specular reflectance add up to {most:.2} in a channel: more light than is received; check the exposure of photo and map")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use lookalike::brdf::{CookTorrance, Disney, Ggx};

    const KNOWN: Known = Known { low: 0.1, high: 0.2, standing: Standing::Determined };

    #[test]
    fn parameters_that_are_not_determined_are_named_in_one_note() {
        let mut uncertainty = [KNOWN; 8];
        uncertainty[3].standing = Standing::AtBound;
        assert_eq!(undetermined(&CookTorrance, &uncertainty), None);
        for open in [1, 3, 4, 5, 7] {
            uncertainty[open].standing = Standing::Undetermined;
        }
        let note = undetermined(&CookTorrance, &uncertainty).unwrap();
        assert!(note.starts_with("the photo does not determine kd.g, ks, m: other values look the same"), "{note}");
    }

    #[test]
    fn parameters_that_trade_are_named_once() {
        let of =
            |trades: &[(usize, usize)]| trade(&Ggx, &Uncertainty { entries: vec![KNOWN; 8], trades: trades.to_vec() });
        let note = of(&[(3, 6), (4, 6), (0, 3), (0, 1)]).unwrap();
        assert!(note.contains("f0 and f90, kd and f0;"), "{note}");
        assert_eq!(of(&[(0, 1)]), None, "channels of one colour");
    }

    #[test]
    fn another_lobe_than_that_of_stage_two_is_said() {
        let with = |alpha: f64| [0.3, 0.3, 0.3, 0.04, 0.04, 0.04, 1.0, alpha];
        let entries = |low, high| [[KNOWN; 7].to_vec(), vec![Known { low, high, ..KNOWN }]].concat();
        let note = jumped(&Ggx, &with(0.32), &with(0.057), &entries(0.05, 0.06)).unwrap();
        assert!(note.contains("alpha 0.320 became 0.057"), "{note}");
        assert_eq!(jumped(&Ggx, &with(0.062), &with(0.057), &entries(0.05, 0.06)), None, "nearly the same");
        assert_eq!(jumped(&Ggx, &with(0.32), &with(0.2), &entries(0.1, 0.4)), None, "within the range");
    }

    #[test]
    fn undetermined_parameter_at_its_bound_is_not_called_a_limit_of_the_model() {
        let parameters = [0.3, 0.3, 0.3, 0.0, 0.0, 0.0, 0.5, 1.0];
        let note =
            |is_determined: fn(usize) -> bool| at_bounds(&CookTorrance, &Ranges::default(), &parameters, is_determined);
        assert!(note(|_| true).is_some_and(|note| note.contains("m = 1")));
        assert_eq!(note(|i| i != 7), None);
    }

    #[test]
    fn metal_is_a_valid_result_and_a_full_coat_or_the_end_of_a_given_range_is_a_limit() {
        let mut ranges = Ranges::default();
        ranges.narrow(&Ggx, "alpha", 0.01, 0.2).unwrap();
        let ggx =
            |f0: f64, ranges: &Ranges| at_bounds(&Ggx, ranges, &[0.3, 0.3, 0.3, f0, 0.1, 0.1, 1.0, 0.2], |_| true);
        assert_eq!(ggx(1.0, &Ranges::default()), None);
        assert!(ggx(2.0, &Ranges::default()).is_some_and(|note| note.contains("f0.r = 2;")));
        assert!(ggx(0.1, &ranges).is_some_and(|note| note.contains("alpha = 0.2;")));
        ranges.narrow(&Ggx, "kd", 0.3, 0.5).unwrap();
        assert!(
            ggx(0.1, &ranges).is_some_and(|note| note.contains("kd.r = 0.3, kd.g = 0.3, kd.b = 0.3, alpha = 0.2;"))
        );
        // The order is base colour, subsurface, metallic, specular, roughness, sheen, clear coat, clear-coat gloss.
        let disney = |coat: f64| {
            at_bounds(&Disney, &Ranges::default(), &[0.5, 0.5, 0.5, 1.0, 1.0, 0.5, 0.5, 0.0, coat, 0.5], |_| true)
        };
        assert_eq!(disney(0.5), None);
        assert!(disney(1.0).is_some_and(|note| note.contains("clearcoat = 1;") && !note.contains("metallic")));
    }
}
