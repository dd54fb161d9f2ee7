//! The plan of one fit: which nodes there are and what follows from their outputs (design section 7).
//!
//! ```text
//! transport(subset) shards -> search(gamma) x 21 -> transport(full) shards -> select -> explore -> polish -> report
//! ```
//!
//! The graph depends on the inputs alone, never on the number of workers or the order in which nodes finish.

mod direct;
mod limits;
mod pictures;
mod pixels;
mod polishing;
mod survey;
mod tables;
mod verify;

pub use limits::FitError;
pub use survey::{Appraisal, PhotoPlanner, Subject, SurveyOutcome, SurveyPlanner, SurveyRequest};

use self::{
    limits::check_sizes,
    pictures::Pictures,
    pixels::{Grid, covered_pixels, intensities, photo_at},
    polishing::Polishing,
    tables::{FULL_SHARD, SUBSET_SHARD, release_tables, stage_one_knots, whole_span},
    verify::{Shard, SubsetTables},
};
use crate::{
    fit::{
        BestScore, Candidate, Judged, JudgedBy, Method, Objective, Polished, SearchKind, Start, needed_span,
        stage_one::objective_of,
        uncertainty::{Uncertainty, uncertainties},
        winner,
    },
    graph::{Blob, BlobHash, GraphEdit, Input, NodeFailure, NodeId, NodeSpec, Placement, PlanError, Planner},
    image::Image,
    light::{Environment, LightDistribution},
    metric::ErrorMap,
    nodes::{
        self, CompressWire, ReportParameters, SearchParameters, SelectParameters, ViewWire,
        wire::{CandidateWire, EnvironmentWire, ImageWire, SubsetWire, read, write},
    },
    render::{
        subset::PixelSubset,
        transport::{Accuracy, Pixel},
    },
    scene::Capture,
};
use serde::Serialize;
use std::{collections::BTreeMap, sync::Arc};

/// The outcome of a fit.
#[derive(Debug, Clone)]
pub struct FitOutcome {
    /// Every candidate with its scores: by subset, then by gamma.
    pub judged: Vec<Judged>,
    /// Index of the winner of stage two.
    pub winner: usize,
    /// How well the photo determines each entry of the winner's flat parameter vector, at its gamma and on its subset.
    pub uncertainty: Vec<Uncertainty>,
    /// The outcome of stage three, when it ran.
    pub polished: Option<Polished>,
    /// Evaluations of CSSIM on the coarse picture before stage three; 0 when it did not run.
    pub explored: usize,
    /// The rendering of the winner of stage two, as [`Self::matched`].
    pub winner_image: Image,
    /// The rendering of the final parameters at full resolution, linear Rec. 709, over black.
    pub matched: Image,
    /// The error of the match, per window.
    pub error_map: ErrorMap,
    /// Renderings asked for by [`FitPlanner::also_render`]: gamma and image (of the first subset).
    pub extra: Vec<(f64, Image)>,
}

/// The planner of one fit.
#[derive(Debug)]
pub struct FitPlanner {
    capture: Arc<Capture>,
    method: Method,
    exposure: f64,
    mean_radiance: f64,
    subsets: Vec<PixelSubset>,
    pixels: Vec<Pixel>,
    extra_gammas: Vec<f64>,
    /// Where candidates are judged, polish runs and pictures are made.
    stage_two: Placement,
    is_judged_on_whole_range: bool,
    /// The encoded light, if somebody else has encoded it.
    light: Option<Blob>,
    environment: Option<BlobHash>,
    /// The light for the direct integrator, once something was checked by it.
    distribution: Option<Arc<LightDistribution>>,
    view: Option<BlobHash>,
    searches: BTreeMap<NodeId, usize>,
    /// The parts of tables that have not come yet.
    shards: BTreeMap<NodeId, Shard>,
    /// A search of every subset: it names the subset's table.
    search_of_subset: Vec<NodeId>,
    tables_of_subsets: SubsetTables,
    candidates: BTreeMap<usize, Candidate>,
    step: Step,
    /// Widths that the table of the next judging node spans; `None` for a model without widths.
    span: Span,
    /// Full-resolution tables by their span: none is integrated twice.
    tables: Vec<(Span, Vec<Input>)>,
    pictures: Pictures,
    judged: Vec<Judged>,
    uncertainty: Vec<Uncertainty>,
    polishing: Polishing,
    explored_evaluations: usize,
    polished: Option<Polished>,
    best: Arc<BestScore>,
    outcome: Option<FitOutcome>,
}

/// Smallest and largest width of a table.
type Span = Option<(f64, f64)>;

/// The node whose output decides what comes next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Searching,
    Selecting(NodeId),
    Exploring(NodeId),
    Polishing(NodeId),
    Reporting,
}

impl FitPlanner {
    /// Plans a fit of a captured photo. `exposure` is that of the display transform before CSSIM.
    ///
    /// # Errors
    /// When a setting is out of range or the photo is black.
    pub fn new(capture: Arc<Capture>, method: Method, exposure: f64) -> Result<Self, FitError> {
        method.check()?;
        check_sizes(&capture, &method)?;
        let candidates = intensities(&capture);
        let mean_radiance = candidates.iter().map(|c| c.intensity).sum::<f64>() / candidates.len() as f64;
        if mean_radiance.is_nan() || mean_radiance <= 0.0 {
            return Err(FitError::Black);
        }
        let draw = |index| {
            PixelSubset::draw(&candidates, method.samples, method.sampling, method.seed, index).ok_or(FitError::Black)
        };
        let subsets = (0..method.subsets).map(draw).collect::<Result<Vec<_>, _>>()?;
        let pixels = covered_pixels(&capture);
        Ok(Self {
            capture,
            method,
            exposure,
            mean_radiance,
            subsets,
            pixels,
            extra_gammas: Vec::new(),
            stage_two: Placement::Coordinator,
            is_judged_on_whole_range: false,
            light: None,
            environment: None,
            distribution: None,
            view: None,
            shards: BTreeMap::new(),
            searches: BTreeMap::new(),
            search_of_subset: Vec::new(),
            tables_of_subsets: SubsetTables::default(),
            candidates: BTreeMap::new(),
            step: Step::Searching,
            span: None,
            tables: Vec::new(),
            pictures: Pictures::default(),
            judged: Vec::new(),
            uncertainty: Vec::new(),
            polishing: Polishing::default(),
            explored_evaluations: 0,
            polished: None,
            best: Arc::default(),
            outcome: None,
        })
    }

    /// Also renders the candidates of these gammas, for pictures; gammas that are not searched are left out.
    #[must_use]
    pub fn also_render(mut self, gammas: &[f64]) -> Self {
        self.extra_gammas = gammas.to_vec();
        self
    }

    /// Runs what follows stage one there: in the coordinator's own process, as it does unless told otherwise, or on workers.
    #[must_use]
    pub fn judging_on(mut self, placement: Placement) -> Self {
        self.stage_two = placement;
        self
    }

    /// Takes the light of the capture from [`encode_light`], so that fits under one light encode it once.
    #[must_use]
    pub fn with_encoded_light(mut self, light: Blob) -> Self {
        self.light = Some(light);
        self
    }

    /// The pixel subsets of stage one.
    #[must_use]
    pub fn subsets(&self) -> &[PixelSubset] {
        &self.subsets
    }

    /// The outcome, once the graph has run.
    #[must_use]
    pub fn into_outcome(self) -> Option<FitOutcome> {
        self.outcome
    }

    /// Where the best score so far can be watched while the graph runs.
    #[must_use]
    pub fn best(&self) -> Arc<BestScore> {
        Arc::clone(&self.best)
    }

    /// Judges on the table over the model's whole range of widths instead of the candidates': studies, whose many fits share it.
    #[must_use]
    pub fn judging_on_whole_range(mut self) -> Self {
        self.is_judged_on_whole_range = true;
        self
    }

    fn keep_light(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let light = self.light.take().map_or_else(|| encode_light(self.capture.environment()), Ok)?;
        self.environment = Some(graph.keep(light)?);
        Ok(())
    }

    fn add_searches(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let model = self.method.model;
        let (direct, of_scene) = self.direct_searches(graph)?;
        for (s, subset) in self.subsets.clone().into_iter().enumerate() {
            let list = add(graph, "list of pixels", &subset.pixels)?;
            let photo = photo_at(&self.capture, &subset);
            let wire = SubsetWire { photo, pixels: subset.pixels.clone(), weights: subset.weights.clone() };
            let mut inputs = vec![Input::Blob(add(graph, "pixel subset", &wire)?)];
            let what = if self.subsets.len() == 1 { "of the subset".to_owned() } else { format!("of subset {s}") };
            let (count, shard) =
                (subset.pixels.len(), if subset.pixels.len() > 4096 { FULL_SHARD } else { SUBSET_SHARD });
            let knots = stage_one_knots(&self.method);
            inputs.extend(self.add_transport(
                graph,
                (nodes::TRANSPORT, &what),
                (list, count, shard),
                knots,
                Accuracy::SUBSET,
            )?);
            inputs.extend(of_scene.iter().copied());
            for (g, &gamma) in self.method.gammas.iter().enumerate() {
                let parameters = SearchParameters {
                    model: model.name().to_owned(),
                    gamma,
                    subset: index(s),
                    mean_radiance: self.mean_radiance,
                    pattern: self.method.search == SearchKind::Pattern,
                    paper_start: self.method.start == Start::Paper,
                    compress: CompressWire::of(self.method.compress),
                    direct: direct.clone(),
                };
                let of_subset = if self.subsets.len() == 1 { String::new() } else { format!(", subset {s}") };
                let node = graph.add_node(NodeSpec {
                    kind: nodes::SEARCH.to_owned(),
                    label: format!("search gamma {gamma}{of_subset}"),
                    parameters: encode("parameters", &parameters)?,
                    inputs: inputs.clone(),
                    placement: Placement::Worker,
                    priority: 0,
                })?;
                self.searches.insert(node, s * self.method.gammas.len() + g);
                if g == 0 {
                    self.search_of_subset.push(node);
                }
            }
        }
        Ok(())
    }

    /// A node of `kind` on the full-resolution table over a span.
    fn add_judging<T: Serialize>(
        &mut self,
        graph: &mut GraphEdit<'_>,
        kind: &str,
        span: Span,
        parameters: &T,
    ) -> Result<NodeId, PlanError> {
        let inputs = self.inputs_on_full_table(graph, span)?;
        self.add_on_view(graph, (kind, kind), inputs, parameters)
    }

    /// The view and the full-resolution table over a span.
    fn inputs_on_full_table(&mut self, graph: &mut GraphEdit<'_>, span: Span) -> Result<Vec<Input>, PlanError> {
        let view = match self.view {
            Some(view) => view,
            None => add(graph, "view", &self.view_wire(Grid::FULL, self.pixels.clone()))?,
        };
        self.view = Some(view);
        let mut inputs = vec![Input::Blob(view)];
        inputs.extend(self.full_table(graph, span)?);
        Ok(inputs)
    }

    /// A node of a kind, with a label, on a view and its table.
    fn add_on_view<T: Serialize>(
        &self,
        graph: &mut GraphEdit<'_>,
        (kind, label): (&str, &str),
        inputs: Vec<Input>,
        parameters: &T,
    ) -> Result<NodeId, PlanError> {
        graph.add_node(NodeSpec {
            kind: kind.to_owned(),
            label: label.to_owned(),
            parameters: encode("parameters", parameters)?,
            inputs,
            placement: self.stage_two,
            priority: 0,
        })
    }

    /// The photo as a grid of its pixels shows it; `pixels` are those of the table.
    fn view_wire(&self, grid: Grid, pixels: Vec<Pixel>) -> ViewWire {
        let photo = self.capture.photo();
        ViewWire {
            model: self.method.model.name().to_owned(),
            photo: ImageWire::of(&grid.image(photo)),
            coverage: grid.values(&self.capture.scoring_coverage(), photo.width()),
            exposure: self.exposure,
            judge_object: self.method.judge == JudgedBy::Object,
            stride: grid.stride(),
            pixels,
        }
    }

    /// The candidate that a search on a worker claims to have found, once its cost is what this process finds for it.
    fn checked_candidate(
        &mut self,
        place: usize,
        output: &Blob,
        graph: &GraphEdit<'_>,
    ) -> Result<Candidate, PlanError> {
        let candidate = read::<CandidateWire>("candidate", output)
            .and_then(|wire| wire.candidate(self.method.model))
            .map_err(|failure| verify::wrong("a candidate", &failure))?;
        let gammas = &self.method.gammas;
        let asked = (gammas[place % gammas.len()], index(place / gammas.len()));
        if (candidate.gamma, candidate.subset) != asked {
            let found = (candidate.gamma, candidate.subset);
            return Err(verify::wrong(format!("the candidate of gamma and subset {asked:?}"), &format!("{found:?}")));
        }
        let (s, gammas) = (place / gammas.len(), gammas.len());
        self.with_objective(&candidate, graph, |objective| verify::check_cost(&candidate, objective))??;
        // The table has done its duty when no search of its subset is left.
        if !self.searches.values().any(|other| other / gammas == s) {
            self.tables_of_subsets.forget(s);
        }
        Ok(candidate)
    }

    /// What the search of a candidate minimised.
    fn with_objective<T>(
        &mut self,
        candidate: &Candidate,
        graph: &GraphEdit<'_>,
        use_it: impl FnOnce(&mut Objective<'_>) -> T,
    ) -> Result<T, PlanError> {
        let s = candidate.subset as usize;
        let light = self.distribution();
        let mut tables = std::mem::take(&mut self.tables_of_subsets);
        let (subset, search) = (&self.subsets[s], self.search_of_subset[s]);
        let table = tables.get(s, self.method.model, search, graph);
        let photo = photo_at(&self.capture, subset);
        let used = table.map(|table| {
            let mut objective = objective_of(&self.method, candidate.gamma, table, subset, &photo, self.mean_radiance);
            if let Some(direct) = self.direct_pixels(light.as_deref(), &subset.pixels) {
                objective = objective.rendered_by(direct);
            }
            use_it(&mut objective)
        });
        self.tables_of_subsets = tables;
        used
    }

    fn searched(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let points = self.candidates.values().map(|c| &c.parameters[..]);
        let needed = needed_span(self.method.model, points);
        self.span = if self.is_judged_on_whole_range { whole_span(self.method.model) } else { needed };
        let candidates = self.candidates.values().map(CandidateWire::of).collect();
        let node = self.add_judging(graph, nodes::SELECT, self.span, &SelectParameters { candidates })?;
        self.step = Step::Selecting(node);
        Ok(())
    }

    fn selected(&mut self, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let scores = verify::scores(output, self.candidates.len())?;
        let candidates = std::mem::take(&mut self.candidates).into_values();
        self.judged = candidates
            .zip(scores)
            .map(|(candidate, (cssim, cssim_object))| Judged { candidate, cssim, cssim_object })
            .collect();
        let best = winner(&self.judged, self.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))?;
        let winner = self.judged[best].candidate.clone();
        let model = self.method.model;
        self.uncertainty = self
            .with_objective(&winner, graph, |objective| uncertainties(model, objective, &winner.parameters))?
            .map_err(|error| PlanError::Other(error.into()))?;
        self.tables_of_subsets.forget(winner.subset as usize);
        self.release_subset_tables(graph);
        self.best.set(self.score_of_winner(best));
        if self.method.polish { self.add_exploration(&winner.parameters, graph) } else { self.add_report(graph) }
    }

    fn score_of_winner(&self, winner: usize) -> f64 {
        self.method.judge.pick(self.judged[winner].cssim, self.judged[winner].cssim_object)
    }

    /// The pictures: of the candidates on the table that they were judged on, of the match on the table that it was polished on.
    fn add_report(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let best = winner(&self.judged, self.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))?;
        let won = self.judged[best].candidate.parameters.clone();
        let last = self.polished.as_ref().map_or(&won, |p| &p.parameters).clone();
        let extra = self.extra_candidates().into_iter().map(|j| j.candidate.parameters.clone());
        let candidates: Vec<Vec<f64>> = extra.chain([won]).collect();
        let judged_on = self.tables.first().map_or(self.span, |(span, _)| *span);
        let jobs = if judged_on == self.span {
            vec![(self.span, [candidates, vec![last]].concat())]
        } else {
            vec![(judged_on, candidates), (self.span, vec![last])]
        };
        for (span, parameters) in jobs {
            let count = parameters.len();
            let node = self.add_judging(graph, nodes::REPORT, span, &ReportParameters { parameters })?;
            self.pictures.ask(node, count);
        }
        release_tables(std::mem::take(&mut self.tables), graph);
        self.step = Step::Reporting;
        Ok(())
    }

    /// The candidates to be rendered beside the match: those of the first subset.
    fn extra_candidates(&self) -> Vec<&Judged> {
        let wanted = |j: &&Judged| j.candidate.subset == 0 && self.extra_gammas.contains(&j.candidate.gamma);
        self.judged.iter().filter(wanted).collect()
    }

    fn reported(&mut self, node: NodeId, output: &Blob) -> Result<(), PlanError> {
        let size = (self.capture.photo().width(), self.capture.photo().height());
        let Some((mut images, error)) = self.pictures.made(node, output, size)? else { return Ok(()) };
        let missing = || PlanError::new("the report lacks an image");
        let matched = images.pop().ok_or_else(missing)?;
        let winner_image = images.pop().ok_or_else(missing)?;
        let gammas = self.extra_candidates().into_iter().map(|j| j.candidate.gamma);
        let extra = gammas.zip(images).collect();
        let (width, height) = (matched.width(), matched.height());
        let error_map = ErrorMap { width, height, error };
        let best = winner(&self.judged, self.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))?;
        self.outcome = Some(FitOutcome {
            judged: self.judged.clone(),
            winner: best,
            uncertainty: self.uncertainty.clone(),
            polished: self.polished.clone(),
            explored: self.explored_evaluations,
            winner_image,
            matched,
            error_map,
            extra,
        });
        Ok(())
    }
}

impl Planner for FitPlanner {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.keep_light(graph)?;
        self.add_searches(graph)?;
        // Nothing but the scene decides this table: workers that are idle can begin with it.
        if self.method.polish { self.add_coarse_table(graph) } else { Ok(()) }
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if let Some(shard) = self.shards.remove(&node) {
            return verify::check_shard(self.method.model, shard, output);
        }
        if let Some(place) = self.searches.remove(&node) {
            let candidate = self.checked_candidate(place, output, graph)?;
            self.candidates.insert(place, candidate);
            return if self.searches.is_empty() { self.searched(graph) } else { Ok(()) };
        }
        match self.step {
            Step::Selecting(select) if select == node => self.selected(output, graph),
            Step::Exploring(explore) if explore == node => self.explored(output, graph),
            Step::Polishing(polish) if polish == node => self.polished(output, graph),
            Step::Reporting if self.pictures.is_of(node) => self.reported(node, output),
            _ => Ok(()),
        }
    }

    /// What a search claims is computed again here; of everything else only the shape can be seen.
    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        spec.kind != nodes::SEARCH
    }
}

/// A map as the nodes of a fit read it, for [`FitPlanner::with_encoded_light`].
///
/// # Errors
/// When it does not fit into a blob.
pub fn encode_light(environment: &Environment) -> Result<Blob, PlanError> {
    Ok(Blob::new(encode("environment", &EnvironmentWire::of(environment))?))
}

fn add<T: Serialize>(graph: &mut GraphEdit<'_>, what: &str, value: &T) -> Result<BlobHash, PlanError> {
    graph.add_blob(encode(what, value)?)
}

fn encode<T: Serialize>(what: &str, value: &T) -> Result<Vec<u8>, PlanError> {
    write(what, value).map_err(other)
}

fn other(failure: NodeFailure) -> PlanError {
    PlanError::new(failure.to_string())
}

fn index(value: usize) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests;
