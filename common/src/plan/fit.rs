//! The plan of one fit: its nodes, and the further nodes that their outputs lead to (design section 7).
//!
//! ```text
//! transport(subset) shards -> search(gamma) x 21 -> transport(full) shards -> select -> explore -> polish -> report
//! ```
//!
//! The graph depends on the inputs alone, never on the number of workers or the order in which nodes finish.

use super::{
    encode::{add, encode, index},
    limits::FitError,
    pictures::Pictures,
    pixels::{intensities, photo_at},
    polishing::Polishing,
    scene_tables::SceneTables,
    step::Step,
    tables::{
        LARGE_SHARD, LARGE_SUBSET, SUBSET_SHARD, is_nearly_sharp, may_begin_blurred, stage_one_knots, whole_span,
    },
    verify::{self, SubsetTables},
    work::Work,
};
use crate::{
    fit::{
        BestScore, Candidate, Judged, Method, Objective, Polished, needed_span,
        stage_one::objective_of,
        uncertainty::{Uncertainty, uncertainties},
        winner,
    },
    graph::{Blob, GraphEdit, Input, NodeId, NodeSpec, Placement, PlanError, Planner},
    image::Image,
    metric::ErrorMap,
    nodes::{
        self, ReportParameters, SearchParameters, SelectParameters,
        wire::{CandidateWire, SubsetWire, read},
    },
    render::{subset::PixelSubset, transport::Accuracy},
    scene::Capture,
};
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
    /// Renderings requested by [`FitPlanner::also_render`]: gamma and image (of the first subset).
    pub extra: Vec<(f64, Image)>,
}

/// The planner of one fit.
#[derive(Debug)]
pub struct FitPlanner {
    scene: SceneTables,
    subsets: Vec<PixelSubset>,
    extra_gammas: Vec<f64>,
    is_judged_on_whole_range: bool,
    /// Whether the tables of stage one have the sharp lobes too.
    has_sharp_lobes: bool,
    searches: BTreeMap<NodeId, usize>,
    /// One search of every subset: its inputs name the shards of the subset's table.
    search_of_subset: Vec<NodeId>,
    tables_of_subsets: SubsetTables,
    candidates: BTreeMap<usize, Candidate>,
    step: Step,
    pictures: Pictures,
    judged: Vec<Judged>,
    uncertainty: Vec<Uncertainty>,
    polishing: Polishing,
    best: Arc<BestScore>,
    outcome: Option<FitOutcome>,
}

impl FitPlanner {
    /// Plans a fit of a captured photo. `exposure` is that of the display transform before CSSIM.
    ///
    /// # Errors
    /// When a setting is out of range or the photo is black.
    pub fn new(capture: Arc<Capture>, method: Method, exposure: f64) -> Result<Self, FitError> {
        let scene = SceneTables::new(capture, method, exposure)?;
        let method = &scene.method;
        let candidates = intensities(&scene.capture);
        let draw = |index| {
            PixelSubset::draw(&candidates, method.samples, method.sampling, method.seed, index).ok_or(FitError::Black)
        };
        let subsets = (0..method.subsets).map(draw).collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            scene,
            subsets,
            extra_gammas: Vec::new(),
            is_judged_on_whole_range: false,
            has_sharp_lobes: false,
            searches: BTreeMap::new(),
            search_of_subset: Vec::new(),
            tables_of_subsets: SubsetTables::default(),
            candidates: BTreeMap::new(),
            step: Step::Searching,
            pictures: Pictures::default(),
            judged: Vec::new(),
            uncertainty: Vec::new(),
            polishing: Polishing::default(),
            best: Arc::default(),
            outcome: None,
        })
    }

    /// Also renders the candidates of these gammas; gammas that are not searched are left out.
    #[must_use]
    pub fn also_render(mut self, gammas: &[f64]) -> Self {
        self.extra_gammas = gammas.to_vec();
        self
    }

    /// Runs everything after stage one in the coordinator's own process (the default) or on workers.
    #[must_use]
    pub fn judging_on(mut self, placement: Placement) -> Self {
        self.scene.stage_two = placement;
        self
    }

    /// Takes the light of the capture from [`encode_light`](super::encode_light), so that fits under one light encode it once.
    #[must_use]
    pub fn with_encoded_light(mut self, light: Blob) -> Self {
        self.scene.light = Some(light);
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

    /// The best score so far, which can be read while the graph runs.
    #[must_use]
    pub fn best(&self) -> Arc<BestScore> {
        Arc::clone(&self.best)
    }

    /// Judges on the table over the model's whole range of widths instead of the candidates' range. For studies, whose many fits
    /// share that table.
    #[must_use]
    pub fn judging_on_whole_range(mut self) -> Self {
        self.is_judged_on_whole_range = true;
        self
    }

    /// The work of a node of this kind for this fit. Call this before [`Planner::completed`] receives the node.
    #[must_use]
    pub fn work_of(&self, node: NodeId, kind: &str) -> Work {
        let is_judged = !matches!(self.step, Step::Searching | Step::Selecting(_));
        self.searches.get(&node).map_or_else(|| Work::of_fit(kind, is_judged), |place| Work::Search(*place))
    }

    /// Adds stage one; `again` with the sharp lobes, after a first round without them.
    fn add_searches(&mut self, graph: &mut GraphEdit<'_>, again: bool) -> Result<(), PlanError> {
        let (direct, of_scene) = self.scene.direct_searches(graph)?;
        for (s, subset) in self.subsets.clone().into_iter().enumerate() {
            let list = add(graph, "list of pixels", &subset.pixels)?;
            let photo = photo_at(&self.scene.capture, &subset);
            let wire = SubsetWire { photo, pixels: subset.pixels.clone(), weights: subset.weights.clone() };
            let mut inputs = vec![Input::Blob(add(graph, "pixel subset", &wire)?)];
            let of = if self.subsets.len() == 1 { "of the subset".to_owned() } else { format!("of subset {s}") };
            let what = if again { format!("{of} with sharp lobes") } else { of };
            let (count, shard) =
                (subset.pixels.len(), if subset.pixels.len() > LARGE_SUBSET { LARGE_SHARD } else { SUBSET_SHARD });
            let knots = stage_one_knots(&self.scene.method, self.has_sharp_lobes);
            inputs.extend(self.scene.add_transport(
                graph,
                (nodes::TRANSPORT, &what),
                (list, count, shard),
                knots,
                Accuracy::SUBSET,
            )?);
            inputs.extend(of_scene.iter().copied());
            for (g, &gamma) in self.scene.method.gammas.iter().enumerate() {
                let (method, mean) = (&self.scene.method, self.scene.mean_radiance);
                let parameters = SearchParameters::of(method, (gamma, index(s)), mean, direct.clone());
                let of_subset = if self.subsets.len() == 1 { String::new() } else { format!(", subset {s}") };
                let node = graph.add_node(NodeSpec {
                    kind: nodes::SEARCH.to_owned(),
                    label: format!("search gamma {gamma}{of_subset}{}", if again { ", with sharp lobes" } else { "" })
                        .into(),
                    parameters: encode("parameters", &parameters)?,
                    inputs: inputs.clone(),
                    placement: Placement::Worker,
                    priority: 0,
                })?;
                self.searches.insert(node, s * self.scene.method.gammas.len() + g);
                if g == 0 {
                    self.search_of_subset.push(node);
                }
            }
        }
        Ok(())
    }

    /// The candidate in the output of a search. Its cost is computed again here and must be the same.
    fn checked_candidate(
        &mut self,
        place: usize,
        output: &Blob,
        graph: &GraphEdit<'_>,
    ) -> Result<Candidate, PlanError> {
        let candidate = read::<CandidateWire>("candidate", output)
            .and_then(|wire| wire.candidate(self.scene.method.model))
            .map_err(|failure| verify::wrong("a candidate", &failure))?;
        verify::check_ranges(&self.scene.method, &candidate.parameters)?;
        let gammas = &self.scene.method.gammas;
        let asked = (gammas[place % gammas.len()], index(place / gammas.len()));
        if (candidate.gamma, candidate.subset) != asked {
            let found = (candidate.gamma, candidate.subset);
            return Err(verify::wrong(format!("the candidate of gamma and subset {asked:?}"), &format!("{found:?}")));
        }
        let (s, gammas) = (place / gammas.len(), gammas.len());
        self.with_objective(&candidate, graph, |objective| verify::check_cost(&candidate, objective))??;
        // The table is not needed once no search of its subset is open.
        if !self.searches.values().any(|other| other / gammas == s) {
            self.tables_of_subsets.forget(s);
        }
        Ok(candidate)
    }

    /// The objective that the search of a candidate minimised.
    fn with_objective<T>(
        &mut self,
        candidate: &Candidate,
        graph: &GraphEdit<'_>,
        use_it: impl FnOnce(&mut Objective<'_>) -> T,
    ) -> Result<T, PlanError> {
        let s = candidate.subset as usize;
        let light = self.scene.distribution();
        let mut tables = std::mem::take(&mut self.tables_of_subsets);
        let (subset, search) = (&self.subsets[s], self.search_of_subset[s]);
        let table = tables.get(s, self.scene.method.model, search, graph);
        let photo = photo_at(&self.scene.capture, subset);
        let used = table.map(|table| {
            let mut objective =
                objective_of(&self.scene.method, candidate.gamma, table, subset, &photo, self.scene.mean_radiance);
            if let Some(direct) = self.scene.direct_pixels(light.as_deref(), &subset.pixels) {
                objective = objective.rendered_by(direct);
            }
            use_it(&mut objective)
        });
        self.tables_of_subsets = tables;
        used
    }

    /// Judges the candidates, or searches again on a table with the sharp lobes if a candidate came near them.
    fn searched(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let model = self.scene.method.model;
        if !self.has_sharp_lobes && self.candidates.values().any(|c| is_nearly_sharp(model, &c.parameters)) {
            self.has_sharp_lobes = true;
            self.candidates.clear();
            self.release_subset_tables(graph);
            return self.add_searches(graph, true);
        }
        let points = self.candidates.values().map(|c| &c.parameters[..]);
        let needed = needed_span(self.scene.method.model, points);
        self.scene.span = if self.is_judged_on_whole_range { whole_span(self.scene.method.model) } else { needed };
        let candidates = self.candidates.values().map(CandidateWire::of).collect();
        let node = self.scene.add_judging(graph, nodes::SELECT, self.scene.span, &SelectParameters { candidates })?;
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
        let Judged { candidate: winner, cssim, cssim_object } = self.winner_of_stage_two()?.clone();
        let (model, ranges) = (self.scene.method.model, self.scene.method.ranges.clone());
        self.uncertainty = self
            .with_objective(&winner, graph, |objective| uncertainties((model, &ranges), objective, &winner.parameters))?
            .map_err(|error| PlanError::Other(error.into()))?;
        self.tables_of_subsets.forget(winner.subset as usize);
        self.release_subset_tables(graph);
        self.best.set(self.scene.method.judge.pick(cssim, cssim_object));
        if !self.scene.method.polish {
            return self.add_report(graph);
        }
        self.step = self.polishing.explore(&winner.parameters, &mut self.scene, graph)?;
        Ok(())
    }

    fn index_of_winner(&self) -> Result<usize, PlanError> {
        winner(&self.judged, self.scene.method.judge).ok_or_else(|| PlanError::new("no candidate was judged"))
    }

    fn winner_of_stage_two(&self) -> Result<&Judged, PlanError> {
        Ok(&self.judged[self.index_of_winner()?])
    }

    fn explored(&mut self, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let won = self.winner_of_stage_two()?.candidate.parameters.clone();
        self.step = self.polishing.explored(output, won, &mut self.scene, graph)?;
        Ok(())
    }

    fn polished(&mut self, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let won = self.winner_of_stage_two()?.clone();
        self.step = self.polishing.polished(output, &won, &mut self.scene, graph)?;
        let judge = self.scene.method.judge;
        let best = judge.pick(won.cssim, won.cssim_object);
        let polished = self.polishing.outcome.as_ref().map_or(best, |p| judge.pick(p.cssim, p.cssim_object));
        self.best.set(polished.min(best));
        if self.step == Step::Reporting { self.add_report(graph) } else { Ok(()) }
    }

    /// Releases the tables of the pixel subsets, which only stage one reads.
    fn release_subset_tables(&mut self, graph: &mut GraphEdit<'_>) {
        for search in std::mem::take(&mut self.search_of_subset) {
            let inputs = graph.spec(search).map(|spec| spec.inputs.clone()).unwrap_or_default();
            inputs.iter().filter_map(Input::node).for_each(|shard| graph.release(shard));
        }
    }

    /// Adds the nodes that make the pictures: of the candidates on the table that they were judged on, and of the match on the table
    /// that it was polished on.
    fn add_report(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let won = self.winner_of_stage_two()?.candidate.parameters.clone();
        let last = self.polishing.outcome.as_ref().map_or(&won, |p| &p.parameters).clone();
        let extra = self.extra_candidates().into_iter().map(|j| j.candidate.parameters.clone());
        let candidates: Vec<Vec<f64>> = extra.chain([won]).collect();
        let judged_on = self.scene.judged_span();
        let jobs = if judged_on == self.scene.span {
            vec![(self.scene.span, [candidates, vec![last]].concat())]
        } else {
            vec![(judged_on, candidates), (self.scene.span, vec![last])]
        };
        for (span, parameters) in jobs {
            let count = parameters.len();
            let node = self.scene.add_judging(graph, nodes::REPORT, span, &ReportParameters { parameters })?;
            self.pictures.ask(node, count);
        }
        self.scene.release_tables_after(0, graph);
        self.step = Step::Reporting;
        Ok(())
    }

    /// The candidates to be rendered in addition to the match: those of the first subset.
    fn extra_candidates(&self) -> Vec<&Judged> {
        let wanted = |j: &&Judged| j.candidate.subset == 0 && self.extra_gammas.contains(&j.candidate.gamma);
        self.judged.iter().filter(wanted).collect()
    }

    fn reported(&mut self, node: NodeId, output: &Blob) -> Result<(), PlanError> {
        let size = (self.scene.capture.photo().width(), self.scene.capture.photo().height());
        let Some((mut images, error)) = self.pictures.made(node, output, size)? else { return Ok(()) };
        let missing = || PlanError::new("the report lacks an image");
        let matched = images.pop().ok_or_else(missing)?;
        let winner_image = images.pop().ok_or_else(missing)?;
        let gammas = self.extra_candidates().into_iter().map(|j| j.candidate.gamma);
        let extra = gammas.zip(images).collect();
        let (width, height) = (matched.width(), matched.height());
        let error_map = ErrorMap { width, height, error };
        self.outcome = Some(FitOutcome {
            judged: self.judged.clone(),
            winner: self.index_of_winner()?,
            uncertainty: self.uncertainty.clone(),
            polished: self.polishing.outcome.clone(),
            explored: self.polishing.explored_evaluations,
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
        self.scene.keep_light(graph)?;
        self.has_sharp_lobes = self.is_judged_on_whole_range || !may_begin_blurred(&self.scene.method);
        self.add_searches(graph, false)?;
        // This table depends on the scene alone, so idle workers can start it now.
        if self.scene.method.polish { self.polishing.add_coarse_table(&mut self.scene, graph) } else { Ok(()) }
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if self.scene.check_if_shard(node, output)? {
            return Ok(());
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

    /// The result of a search is verified here by computing its cost again. Of every other output only the shape is checked here, so
    /// a second run is useful.
    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        spec.kind != nodes::SEARCH
    }
}
