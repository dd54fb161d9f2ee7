//! One of the models that a fit compares, after stage one: its candidates, the winner among them, and stage three.

use super::{
    coarse::Coarse,
    pictures::{Made, Pictures},
    polishing::Polishing,
    scene_tables::SceneTables,
    step::Step,
    verify::{self, wrong},
};
use crate::{
    brdf::Model,
    fit::{COST_OF_NOISE, Candidate, Judged, Match, Method, Tried, winner},
    graph::{Blob, GraphEdit, NodeId, PlanError},
    metric::Blocks,
    nodes::{self, ReportParameters, SelectParameters, wire::CandidateWire},
    render::spans::Spans,
};
use std::collections::BTreeMap;

/// The state of one model.
#[derive(Debug)]
pub(super) struct Contender {
    pub(super) method: Method,
    /// What tells it from the others, for labels: empty for a single model.
    pub(super) label: String,
    /// Whether its tables of stage one have the sharp lobes too.
    pub(super) is_sharp: bool,
    /// The candidates of stage one that have arrived, by their place among the searches.
    pub(super) candidates: BTreeMap<usize, Candidate>,
    pub(super) judged: Vec<Judged>,
    pub(super) polishing: Polishing,
    pub(super) step: Step,
    /// Whether another model explores first.
    pub(super) follows: bool,
    /// The best candidate on the coarse picture.
    scouted: Vec<f64>,
    /// The windows of the match on the coarse picture.
    explored: Option<Blocks>,
    pub(super) pictures: Pictures,
    /// Its match of the coarse picture, if that is so much worse than the best that it was given up.
    pub(super) given_up: Option<Tried>,
    /// Its pictures, at the end.
    pub(super) made: Option<Made>,
}

impl Contender {
    pub(super) fn new(method: Method, label: String) -> Self {
        let polishing = Polishing::new(&method, &label);
        Self {
            method,
            label,
            is_sharp: false,
            candidates: BTreeMap::new(),
            judged: Vec::new(),
            polishing,
            step: Step::Searching,
            follows: false,
            scouted: Vec::new(),
            explored: None,
            pictures: Pictures::default(),
            given_up: None,
            made: None,
        }
    }

    /// Judges the candidates on the coarse picture, to find out there how well the model can match.
    pub(super) fn scout(
        &mut self,
        coarse: &Coarse,
        scene: &SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        let label = format!("{}{}", nodes::SCOUT, self.label);
        let parameters = self.candidates_wire();
        let node = scene.add_on_view(graph, (nodes::SCOUT, &label), coarse.inputs(), &parameters)?;
        self.step = Step::Scouting(node);
        Ok(())
    }

    /// Judges the candidates on the table that spans `spans`.
    pub(super) fn select(
        &mut self,
        spans: &Spans,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        self.polishing.judge_on(spans);
        let label = format!("{}{}", nodes::SELECT, self.label);
        let parameters = self.candidates_wire();
        self.step = Step::Selecting(scene.add_judging(graph, (nodes::SELECT, &label), spans, &parameters)?);
        Ok(())
    }

    /// The parameters of the candidates of stage one.
    pub(super) fn points(&self) -> impl Iterator<Item = &[f64]> {
        self.candidates.values().map(|candidate| &candidate.parameters[..])
    }

    fn candidates_wire(&self) -> SelectParameters {
        let candidates = self.candidates.values().map(CandidateWire::of).collect();
        SelectParameters { model: self.method.model.name().to_owned(), candidates }
    }

    /// Takes the scores of the candidates.
    pub(super) fn judged(&mut self, output: &Blob) -> Result<(), PlanError> {
        self.judged = self.with_scores(output)?;
        self.candidates.clear();
        Ok(())
    }

    fn with_scores(&self, output: &Blob) -> Result<Vec<Judged>, PlanError> {
        let scores = verify::scores(output, self.candidates.len())?;
        let judged = self.candidates.values().zip(scores);
        Ok(judged
            .map(|(candidate, (cssim, cssim_object))| Judged { candidate: candidate.clone(), cssim, cssim_object })
            .collect())
    }

    /// Begins stage three, if it is asked for.
    pub(super) fn polish(
        &mut self,
        coarse: Option<&Coarse>,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        let won = self.winner()?.candidate.parameters.clone();
        let is_explored = self.polishing.explored.is_some();
        self.step = match coarse.filter(|_| !is_explored) {
            _ if !self.method.polish => Step::Reporting,
            Some(coarse) => self.polishing.explore(&won, None, coarse, scene, graph)?,
            None => self.polishing.polish(won, scene, graph)?,
        };
        Ok(())
    }

    /// Takes the output of a node on the coarse picture or of stage three; returns whether the node is one.
    pub(super) fn takes(
        &mut self,
        node: NodeId,
        output: &Blob,
        coarse: Option<&Coarse>,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<bool, PlanError> {
        match (self.step, coarse) {
            (Step::Scouting(scout), Some(coarse)) if scout == node => {
                let judged = self.with_scores(output)?;
                let won =
                    winner(&judged, self.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))?;
                self.scouted = judged[won].candidate.parameters.clone();
                self.step = match self.follows {
                    true => Step::Following,
                    false => self.polishing.explore(&self.scouted, None, coarse, scene, graph)?,
                };
            }
            (Step::Exploring(explore), _) if explore == node => {
                self.explored = Some(self.polishing.explored(output)?);
                self.step = match self.judged.is_empty() {
                    true => Step::Waiting,
                    false => {
                        let won = self.winner()?.candidate.parameters.clone();
                        self.polishing.polish(won, scene, graph)?
                    }
                };
            }
            (Step::Polishing(polish), _) if polish == node => {
                let won = self.winner()?.clone();
                self.step = self.polishing.polished(output, &won, scene, graph)?;
            }
            _ => return Ok(false),
        }
        Ok(true)
    }

    /// Explores from the lobe that another model found, once both are ready.
    pub(super) fn follow(
        &mut self,
        other: (&dyn Model, &[f64]),
        coarse: &Coarse,
        scene: &SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        self.step = self.polishing.explore(&self.scouted, Some(other), coarse, scene, graph)?;
        Ok(())
    }

    /// How well the model matches the coarse picture of a photo with this relative noise.
    pub(super) fn on_coarse(&self, noise: Option<f64>) -> Option<Match> {
        let (found, blocks) = (self.polishing.explored.as_ref()?, self.explored.as_ref()?);
        let floor = noise.map_or(0.0, |noise| COST_OF_NOISE * noise * noise);
        let (parameters, cssim, cssim_object) = (found.parameters.clone(), found.cssim, found.cssim_object);
        Some((Tried { is_coarse: true, ..Tried::new(None, parameters, cssim, cssim_object) }, blocks.clone(), floor))
    }

    pub(super) fn index_of_winner(&self) -> Result<usize, PlanError> {
        winner(&self.judged, self.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))
    }

    /// The winner of stage two.
    pub(super) fn winner(&self) -> Result<&Judged, PlanError> {
        Ok(&self.judged[self.index_of_winner()?])
    }

    /// What the tables span that it still needs: at the end that on which it was matched.
    pub(super) fn spans(&self) -> Vec<&Spans> {
        let judged_on = (self.step != Step::Reporting).then_some(self.polishing.judged_on());
        judged_on.into_iter().chain([self.polishing.spans()]).collect()
    }

    /// The parameters of the match so far, CSSIM over the whole image and over the object.
    pub(super) fn best(&self) -> Result<(&[f64], f64, f64), PlanError> {
        Ok(match &self.polishing.outcome {
            Some(polished) => (&polished.parameters, polished.cssim, polished.cssim_object),
            None => {
                let won = self.winner()?;
                (&won.candidate.parameters, won.cssim, won.cssim_object)
            }
        })
    }

    /// The score of the match so far that counts, infinite before stage two.
    pub(super) fn score(&self) -> f64 {
        self.best().map_or(f64::INFINITY, |(_, cssim, object)| self.method.judge.pick(cssim, object))
    }

    /// Adds the nodes that make the pictures: of the candidates of these gammas and the winner on the table that they were judged on, and of
    /// the match on the table that it was polished on.
    pub(super) fn report(
        &mut self,
        gammas: &[f64],
        noise: Option<f64>,
        scene: &mut SceneTables,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        let won = self.winner()?.candidate.parameters.clone();
        let last = self.best()?.0.to_vec();
        let shown = self.shown(gammas).into_iter().map(|j| j.candidate.parameters.clone());
        let candidates: Vec<Vec<f64>> = shown.chain([won]).collect();
        let (judged_on, spans) = (self.polishing.judged_on().clone(), self.polishing.spans().clone());
        let jobs = if judged_on == spans {
            vec![(spans, [candidates, vec![last]].concat())]
        } else {
            vec![(judged_on, candidates), (spans, vec![last])]
        };
        let last = jobs.len() - 1;
        for (j, (spans, parameters)) in jobs.into_iter().enumerate() {
            let count = parameters.len();
            // Of the match alone.
            let noise = noise.filter(|_| j == last);
            let parameters = ReportParameters { model: self.method.model.name().to_owned(), parameters, noise };
            let label = format!("{}{}", nodes::REPORT, self.label);
            let node = scene.add_judging(graph, (nodes::REPORT, &label), &spans, &parameters)?;
            self.pictures.ask(node, count);
        }
        Ok(())
    }

    /// What the table spans on which it was matched.
    pub(super) fn spans_of_match(&self) -> &Spans {
        self.polishing.spans()
    }

    /// The candidates of these gammas, of the first subset.
    pub(super) fn shown(&self, gammas: &[f64]) -> Vec<&Judged> {
        let is_shown = |j: &&Judged| j.candidate.subset == 0 && gammas.contains(&j.candidate.gamma);
        self.judged.iter().filter(is_shown).collect()
    }

    /// Refuses parameters of a candidate outside the ranges, and a candidate of another gamma or subset than asked for.
    pub(super) fn check(&self, candidate: &Candidate, asked: (f64, u32)) -> Result<(), PlanError> {
        verify::check_ranges(&self.method, &candidate.parameters)?;
        let found = (candidate.gamma, candidate.subset);
        match found == asked {
            true => Ok(()),
            false => Err(wrong(format!("the candidate of gamma and subset {asked:?}"), &format!("{found:?}"))),
        }
    }
}
