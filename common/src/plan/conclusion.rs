//! The end of a fit, once a model is chosen: how well the photo determines its parameters, and whether the matches that the photo does not
//! tell from it look the same under other lights.

use super::{
    contender::Contender,
    scene_tables::SceneTables,
    verify::{self, wrong},
};
use crate::{
    fit::{Judged, Methods, Neighbour, Tried, Uncertainty, scaled_distance},
    graph::{Blob, GraphEdit, NodeId, PlanError},
    light::FORMULA_LIGHTS,
    nodes::{self, RelightParameters, RelitWire, UncertaintyParameters, wire::read},
};

/// The chosen model, and what is still asked about it.
#[derive(Debug)]
pub(super) struct Conclusion {
    pub(super) tried: Vec<Tried>,
    /// Index of the chosen model.
    pub(super) chosen: usize,
    asked_ranges: NodeId,
    pub(super) uncertainty: Option<Uncertainty>,
    /// The node that renders them, if there are any, and the names of the neighbours.
    asked_neighbours: Option<(NodeId, Vec<String>)>,
    pub(super) neighbours: Vec<Neighbour>,
}

impl Conclusion {
    /// Adds the nodes about the chosen model.
    pub(super) fn new(
        (tried, chosen): (Vec<Tried>, usize),
        contenders: &[Contender],
        methods: &Methods,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<Self, PlanError> {
        let contender = &contenders[chosen];
        let (model, ranges) = (contender.method.model.name().to_owned(), contender.method.ranges.clone());
        let point = contender.best()?.0.to_vec();
        let parameters = UncertaintyParameters { model: model.clone(), ranges, point: point.clone() };
        let kind = (nodes::UNCERTAINTY, nodes::UNCERTAINTY);
        let asked_ranges = scene.add_judging(graph, kind, contender.spans_of_match(), &parameters)?;
        let mut names = Vec::new();
        let mut points = vec![(model.clone(), point.clone())];
        for (c, other) in contenders.iter().enumerate().filter(|(c, _)| *c != chosen) {
            if other.given_up.is_none() && tried[c].is_as_good() {
                names.push(methods.label(&other.method));
                points.push((other.method.model.name().to_owned(), other.best()?.0.to_vec()));
            }
        }
        if let Some(judged) = runner_up(contender, &point, tried[chosen].tolerance) {
            names.push(format!("gamma {}", judged.candidate.gamma));
            points.push((model, judged.candidate.parameters.clone()));
        }
        let asked_neighbours = if names.is_empty() {
            None
        } else {
            let kind = (nodes::RELIGHT, nodes::RELIGHT);
            let node = scene.add_on_view(graph, kind, Vec::new(), &RelightParameters { points })?;
            Some((node, names))
        };
        Ok(Self { tried, chosen, asked_ranges, uncertainty: None, asked_neighbours, neighbours: Vec::new() })
    }

    /// Takes an output; returns whether it was asked for here.
    pub(super) fn takes(&mut self, node: NodeId, output: &Blob, contenders: &[Contender]) -> Result<bool, PlanError> {
        if node == self.asked_ranges {
            let contender = &contenders[self.chosen];
            self.uncertainty = Some(verify::uncertainty(&contender.method, output, contender.best()?.0)?);
        } else if let Some((_, names)) = self.asked_neighbours.as_ref().filter(|(asked, _)| *asked == node) {
            self.neighbours = neighbours(names, output)?;
        } else {
            return Ok(false);
        }
        Ok(true)
    }

    /// Whether all that was asked is known.
    pub(super) fn is_complete(&self) -> bool {
        let expected = self.asked_neighbours.as_ref().map_or(0, |(_, names)| names.len());
        self.uncertainty.is_some() && self.neighbours.len() == expected
    }
}

/// Among the candidates that score as well as the match, the one that is farthest from it; `None` if they are the same.
fn runner_up<'a>(contender: &'a Contender, point: &[f64], tolerance: f64) -> Option<&'a Judged> {
    let method = &contender.method;
    let distance = |judged: &&Judged| scaled_distance(method.model, &judged.candidate.parameters, point).unwrap_or(0.0);
    let is_as_good =
        |judged: &&Judged| method.judge.pick(judged.cssim, judged.cssim_object) <= contender.score() + tolerance;
    let farthest = contender.judged.iter().filter(is_as_good).max_by(|a, b| distance(a).total_cmp(&distance(b)));
    farthest.filter(|judged| distance(judged) > SAME)
}

/// Distances of parameter vectors up to this share of their ranges are not worth a picture.
const SAME: f64 = 0.005;

fn neighbours(names: &[String], output: &Blob) -> Result<Vec<Neighbour>, PlanError> {
    let RelitWire(relit) =
        read("scores under other lights", output).map_err(|failure| wrong("scores under other lights", &failure))?;
    if relit.len() != names.len() || relit.iter().any(|scores| scores.len() != FORMULA_LIGHTS.len()) {
        let expected = format!("scores of {} matches under {} lights", names.len(), FORMULA_LIGHTS.len());
        return Err(wrong(expected, &format!("{relit:?}")));
    }
    relit.iter().flatten().try_for_each(|score| verify::check_score(*score))?;
    Ok(names.iter().zip(relit).map(|(name, cssim)| Neighbour { name: name.clone(), cssim }).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::nodes::wire::write;

    #[test]
    fn scores_under_other_lights_that_cannot_be_are_refused() {
        let names = ["ggx".to_owned(), "gamma 2".to_owned()];
        let of = |relit: Vec<Vec<f64>>| neighbours(&names, &Blob::new(write("scores", &RelitWire(relit)).unwrap()));
        let known = of(vec![vec![0.1, 0.2, 0.3], vec![0.0; 3]]).unwrap();
        assert_eq!((&*known[1].name, &known[0].cssim[..]), ("gamma 2", &[0.1, 0.2, 0.3][..]));
        for bad in [
            vec![vec![0.1; 3]],
            vec![vec![0.1; 3], vec![0.1; 2]],
            vec![vec![0.1; 3], vec![0.1, -0.1, 0.1]],
            vec![vec![f64::NAN; 3]; 2],
        ] {
            assert!(matches!(of(bad), Err(PlanError::WrongOutput { .. })));
        }
    }
}
