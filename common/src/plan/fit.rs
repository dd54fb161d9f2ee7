//! The plan of one fit: its nodes, and the further nodes that their outputs lead to (design section 7).
//!
//! ```text
//! transport(subset) shards -> search(gamma) x 21 -> transport(full) shards -> select -> explore -> polish -> report -> uncertainty
//! ```
//!
//! With several models everything but the tables is done for each of them, and the choice is made at the end.
//!
//! The outcome depends on the inputs alone, never on the number of workers or the order in which nodes finish.

use super::{
    coarse::Coarse,
    conclusion::Conclusion,
    contender::Contender,
    encode::{add, encode, index},
    limits::FitError,
    pictures::Made,
    pixels::{intensities, photo_at},
    scene_tables::SceneTables,
    step::Step,
    tables::{LARGE_SHARD, LARGE_SUBSET, SUBSET_SHARD, is_nearly_sharp, joined, may_begin_blurred, stage_one_spans},
    verify::{self, SubsetTable, SubsetTables},
    work::Work,
};
use crate::{
    fit::{
        BestScore, Candidate, Judged, Methods, Neighbour, Objective, Polished, Tried, Uncertainty, chosen, compare,
        explore::{can_follow, explored_span},
        is_hopeless, needed_span,
        stage_one::objective_of,
    },
    graph::{Blob, GraphEdit, Input, NodeId, NodeSpec, Placement, PlanError, Planner},
    image::Image,
    metric::{ErrorMap, relative_noise},
    nodes::{
        self, SearchParameters,
        wire::{CandidateWire, SubsetWire, read},
    },
    render::{knots::PER_OCTAVE, spans::Spans, subset::PixelSubset, transport::Accuracy},
    scene::Capture,
};
use std::{collections::BTreeMap, sync::Arc};

/// The outcome of a fit.
#[derive(Debug, Clone)]
pub struct FitOutcome {
    /// Every model that was tried, in order.
    pub tried: Vec<Tried>,
    /// Index of the model that the rest is about.
    pub chosen: usize,
    /// The relative noise of the photo, and what noise like that costs the match: CSSIM over the image, and over the object; `None` if the
    /// photo is too small to tell.
    pub noise: Option<(f64, (f64, f64))>,
    /// Every candidate with its scores: by subset, then by gamma.
    pub judged: Vec<Judged>,
    /// Index of the winner of stage two.
    pub winner: usize,
    /// How well the photo determines the final parameters.
    pub uncertainty: Uncertainty,
    /// The matches that the photo does not tell from it, under other lights.
    pub neighbours: Vec<Neighbour>,
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
    methods: Methods,
    contenders: Vec<Contender>,
    subsets: Vec<PixelSubset>,
    shown_gammas: Vec<f64>,
    /// The relative noise of the photo.
    noise: Option<f64>,
    is_judged_on_whole_range: bool,
    /// The open searches: the number of the model, and the place of the candidate among those of the model.
    searches: BTreeMap<NodeId, (usize, usize)>,
    /// The shards of the tables of stage one.
    subset_tables: BTreeMap<SubsetTable, Vec<Input>>,
    tables_of_subsets: SubsetTables,
    coarse: Option<Coarse>,
    best: Arc<BestScore>,
    /// Once a model is chosen.
    conclusion: Option<Conclusion>,
    outcome: Option<FitOutcome>,
}

impl FitPlanner {
    /// Plans a fit of a captured photo. `exposure` is that of the display transform before CSSIM.
    ///
    /// # Errors
    /// When a setting is out of range or the photo is black.
    pub fn new(capture: Arc<Capture>, methods: impl Into<Methods>, exposure: f64) -> Result<Self, FitError> {
        let methods = methods.into();
        methods.check()?;
        let scene = SceneTables::new(capture, methods.common().clone(), exposure)?;
        let method = &scene.method;
        let candidates = intensities(&scene.capture);
        let draw = |index| {
            PixelSubset::draw(&candidates, method.samples, method.sampling, method.seed, index).ok_or(FitError::Black)
        };
        let subsets = (0..method.subsets).map(draw).collect::<Result<Vec<_>, _>>()?;
        let mut is_usable = vec![false; scene.capture.photo().pixels().len()];
        scene.capture.usable().for_each(|i| is_usable[i] = true);
        let noise = relative_noise(scene.capture.photo(), &is_usable);
        let is_alone = methods.iter().len() == 1;
        let label = |method| if is_alone { String::new() } else { format!(" of {}", methods.label(method)) };
        let contenders = methods.iter().map(|method| Contender::new(method.clone(), label(method))).collect();
        Ok(Self {
            scene,
            contenders,
            methods,
            subsets,
            shown_gammas: Vec::new(),
            noise,
            is_judged_on_whole_range: false,
            searches: BTreeMap::new(),
            subset_tables: BTreeMap::new(),
            tables_of_subsets: SubsetTables::default(),
            coarse: None,
            best: Arc::default(),
            conclusion: None,
            outcome: None,
        })
    }

    /// Also renders the candidates of these gammas; gammas that are not searched are left out.
    #[must_use]
    pub fn also_render(mut self, gammas: &[f64]) -> Self {
        self.shown_gammas = gammas.to_vec();
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
        let is_judged = !self.contenders.iter().any(|c| matches!(c.step, Step::Searching | Step::Selecting(_)));
        self.searches.get(&node).map_or_else(|| Work::of_fit(kind, is_judged), |(_, place)| Work::Search(*place))
    }

    /// Adds stage one of the models whose tables have the sharp lobes or do not; `again` after a first round without them.
    fn add_searches(&mut self, graph: &mut GraphEdit<'_>, is_sharp: bool, again: bool) -> Result<(), PlanError> {
        let asked = |c: &Contender| c.is_sharp == is_sharp && c.candidates.is_empty();
        if !self.contenders.iter().any(asked) {
            return Ok(());
        }
        // The lobes of models that have searched on such a table too: it replaces theirs.
        let models = self.contenders.iter().filter(|c| c.is_sharp == is_sharp).map(|c| c.method.model);
        let lobes = joined(models.map(|model| stage_one_spans(model, is_sharp))).knots(PER_OCTAVE);
        let (direct, of_scene) = self.scene.direct_searches(graph)?;
        let gammas = self.scene.method.gammas.clone();
        let is_alone = self.subsets.len() == 1;
        let sharp = if again { " with sharp lobes" } else { "" };
        for (s, subset) in self.subsets.clone().into_iter().enumerate() {
            let list = add(graph, "list of pixels", &subset.pixels)?;
            let photo = photo_at(&self.scene.capture, &subset);
            let wire = SubsetWire { photo, pixels: subset.pixels.clone(), weights: subset.weights.clone() };
            let of_subset = if is_alone { String::new() } else { format!(" {s}") };
            let what = format!("of {}subset{of_subset}{sharp}", if is_alone { "the " } else { "" });
            let count = subset.pixels.len();
            let shard = if count > LARGE_SUBSET { LARGE_SHARD } else { SUBSET_SHARD };
            let list = (list, count, shard);
            let table =
                self.scene.add_transport(graph, (nodes::TRANSPORT, &what), list, lobes.clone(), Accuracy::SUBSET)?;
            let inputs = [&[Input::Blob(add(graph, "pixel subset", &wire)?)], &table[..], &of_scene[..]].concat();
            let replaced = self.subset_tables.insert((s, is_sharp), table.clone()).unwrap_or_default();
            replaced
                .iter()
                .filter(|shard| !table.contains(shard))
                .filter_map(Input::node)
                .for_each(|s| graph.release(s));
            self.tables_of_subsets.forget((s, is_sharp));
            for (c, contender) in self.contenders.iter().enumerate().filter(|(_, contender)| asked(contender)) {
                let of_subset = if is_alone { String::new() } else { format!(", subset {s}") };
                let sharp = if again { ", with sharp lobes" } else { "" };
                for (g, &gamma) in gammas.iter().enumerate() {
                    let mean = self.scene.mean_radiance;
                    let parameters = SearchParameters::of(&contender.method, (gamma, index(s)), mean, direct.clone());
                    let node = graph.add_node(NodeSpec {
                        kind: nodes::SEARCH.to_owned(),
                        label: format!("search gamma {gamma}{}{of_subset}{sharp}", contender.label).into(),
                        parameters: encode("parameters", &parameters)?,
                        inputs: inputs.clone(),
                        placement: Placement::Worker,
                        priority: 0,
                    })?;
                    self.searches.insert(node, (c, s * gammas.len() + g));
                }
            }
        }
        Ok(())
    }

    /// The candidate in the output of a search of model `c`. Its cost is computed again here and must be the same.
    fn checked_candidate(
        &mut self,
        (c, place): (usize, usize),
        output: &Blob,
        graph: &GraphEdit<'_>,
    ) -> Result<Candidate, PlanError> {
        let contender = &self.contenders[c];
        let candidate = read::<CandidateWire>("candidate", output)
            .and_then(|wire| wire.candidate(contender.method.model))
            .map_err(|failure| verify::wrong("a candidate", &failure))?;
        let gammas = &self.scene.method.gammas;
        let s = place / gammas.len();
        contender.check(&candidate, (gammas[place % gammas.len()], index(s)))?;
        let gammas = gammas.len();
        self.with_objective(c, &candidate, graph, |objective| verify::check_cost(&candidate, objective))??;
        // The table is not needed once no search on it is open.
        let is_sharp = self.contenders[c].is_sharp;
        let reads =
            |&(other, place): &(usize, usize)| self.contenders[other].is_sharp == is_sharp && place / gammas == s;
        if !self.searches.values().any(reads) {
            self.tables_of_subsets.forget((s, is_sharp));
        }
        Ok(candidate)
    }

    /// The objective that the search of a candidate of model `c` minimised.
    fn with_objective<T>(
        &mut self,
        c: usize,
        candidate: &Candidate,
        graph: &GraphEdit<'_>,
        use_it: impl FnOnce(&mut Objective<'_>) -> T,
    ) -> Result<T, PlanError> {
        let s = candidate.subset as usize;
        let light = self.scene.distribution();
        let mut tables = std::mem::take(&mut self.tables_of_subsets);
        let (subset, Contender { method, is_sharp, .. }) = (&self.subsets[s], &self.contenders[c]);
        let shards = self.subset_tables.get(&(s, *is_sharp)).map_or(&[][..], |shards| shards);
        let table = tables.get((s, *is_sharp), shards, method.model, graph);
        let photo = photo_at(&self.scene.capture, subset);
        let used = table.map(|table| {
            let mut objective = objective_of(method, candidate.gamma, table, subset, &photo, self.scene.mean_radiance);
            if let Some(direct) = self.scene.direct_pixels(light.as_deref(), &subset.pixels) {
                objective = objective.rendered_by(direct);
            }
            use_it(&mut objective)
        });
        self.tables_of_subsets = tables;
        used
    }

    /// Judges the candidates, or searches again, on a table with the sharp lobes, for the models with a candidate that came near them.
    fn searched(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let near = |c: &&mut Contender| !c.is_sharp && c.points().any(|point| is_nearly_sharp(c.method.model, point));
        for contender in self.contenders.iter_mut().filter(near) {
            contender.is_sharp = true;
            contender.candidates.clear();
        }
        self.add_searches(graph, true, true)?;
        self.release_subset_tables(graph);
        if !self.searches.is_empty() {
            return Ok(());
        }
        let leader = self.leader();
        match &self.coarse {
            Some(coarse) if self.contenders.len() > 1 => {
                for (c, contender) in self.contenders.iter_mut().enumerate() {
                    contender.follows = leader.is_some_and(|leader| leader != c);
                    contender.scout(coarse, &self.scene, graph)?;
                }
                Ok(())
            }
            _ => self.select(graph),
        }
    }

    /// The model that explores before the others: the richest whose parameters all of them have; `None` if there is none.
    fn leader(&self) -> Option<usize> {
        let models = || self.contenders.iter().map(|contender| contender.method.model);
        models().collect::<Vec<_>>().into_iter().rposition(|leader| models().all(|model| can_follow(model, leader)))
    }

    /// Lets the models explore that wait for the lobe of the leader, once it is known.
    fn follow(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let Some((leader, coarse)) = self.leader().map(|leader| &self.contenders[leader]).zip(self.coarse.as_ref())
        else {
            return Ok(());
        };
        let Some(found) = leader.polishing.explored.as_ref() else { return Ok(()) };
        let (model, found) = (leader.method.model, found.parameters.clone());
        let ready = self.contenders.iter_mut().filter(|contender| contender.step == Step::Following);
        for contender in ready {
            contender.follow((model, &found), coarse, &self.scene, graph)?;
        }
        Ok(())
    }

    /// Gives up the models that match the coarse picture far worse than the best one; the others go on at full resolution.
    fn scouted(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let scouted: Option<Vec<_>> = self.contenders.iter().map(|contender| contender.on_coarse(self.noise)).collect();
        let judge = self.scene.method.judge;
        let compared = compare(scouted.ok_or_else(|| PlanError::new("a model was not explored"))?, judge);
        for (contender, tried) in self.contenders.iter_mut().zip(compared) {
            contender.given_up = is_hopeless(&tried, judge).then_some(tried);
        }
        self.release_coarse(graph);
        self.select(graph)
    }

    /// Judges the candidates at full resolution.
    fn select(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let needed = |contender: &Contender| {
            let (model, ranges) = (contender.method.model, &contender.method.ranges);
            match self.is_judged_on_whole_range {
                true => Spans::whole(model),
                false => Spans::of_model(model, needed_span(model, ranges, contender.points())),
            }
        };
        let spans = joined(self.contenders.iter().filter(|c| c.given_up.is_none()).map(needed));
        let mut open = self.contenders.iter_mut().filter(|contender| contender.given_up.is_none());
        open.try_for_each(|contender| contender.select(&spans, &mut self.scene, graph))
    }

    fn release_coarse(&mut self, graph: &mut GraphEdit<'_>) {
        if let Some(coarse) = self.coarse.take() {
            coarse.release(graph);
        }
    }

    /// Takes the scores of the candidates of model `c`.
    fn selected(&mut self, c: usize, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.contenders[c].judged(output)?;
        self.contenders[c].polish(self.coarse.as_ref(), &mut self.scene, graph)?;
        self.moved_on(c, graph)
    }

    /// Goes on with all models once the last one has explored, adds the pictures of model `c` if it has come to an end, and releases what no
    /// model needs any more.
    fn moved_on(&mut self, c: usize, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if self.contenders.iter().all(|contender| contender.step == Step::Waiting) {
            return self.scouted(graph);
        }
        self.follow(graph)?;
        let best = self.contenders.iter().map(Contender::score).fold(f64::INFINITY, f64::min);
        if best.is_finite() {
            self.best.set(best);
        }
        if self.contenders[c].step == Step::Reporting {
            self.contenders[c].report(&self.shown_gammas, self.noise, &mut self.scene, graph)?;
        }
        let is_exploring = |c: &Contender| {
            matches!(c.step, Step::Scouting(_) | Step::Following | Step::Selecting(_) | Step::Exploring(_))
        };
        if !self.contenders.iter().any(is_exploring) {
            self.release_coarse(graph);
        }
        let open = self.contenders.iter().filter(|c| c.given_up.is_none());
        let needed: Vec<&Spans> = open.flat_map(Contender::spans).collect();
        self.scene.release_tables_but(&needed, graph);
        Ok(())
    }

    /// Releases the tables of the pixel subsets that no open search reads.
    fn release_subset_tables(&mut self, graph: &mut GraphEdit<'_>) {
        let (searches, contenders) = (&self.searches, &self.contenders);
        self.subset_tables.retain(|(_, is_sharp), shards| {
            let is_read = searches.values().any(|(c, _)| contenders[*c].is_sharp == *is_sharp);
            if !is_read {
                shards.iter().filter_map(Input::node).for_each(|shard| graph.release(shard));
            }
            is_read
        });
    }

    /// Takes the pictures of model `c`; when all models have theirs, chooses one of them.
    fn reported(
        &mut self,
        (c, node): (usize, NodeId),
        output: &Blob,
        graph: &mut GraphEdit<'_>,
    ) -> Result<(), PlanError> {
        let (width, height) = (self.scene.capture.photo().width(), self.scene.capture.photo().height());
        let contender = &mut self.contenders[c];
        contender.made = contender.pictures.made(node, output, (width, height))?;
        if self.contenders.iter().any(|contender| contender.given_up.is_none() && contender.made.is_none()) {
            return Ok(());
        }
        let missing = || PlanError::new("the report lacks an image");
        let judge = self.scene.method.judge;
        let tried = |contender: &Contender| {
            let (parameters, cssim, cssim_object) = contender.best()?;
            let made = contender.made.as_ref().ok_or_else(missing)?;
            verify::check_blocks(&made.blocks, contender.score())?;
            if made.noise_floor.is_some() != self.noise.is_some() {
                return Err(verify::wrong("what noise costs, if it is known", &format!("{:?}", made.noise_floor)));
            }
            let floor = made.noise_floor.map_or(0.0, |(image, object)| judge.pick(image, object));
            let gamma = contender.winner()?.candidate.gamma;
            Ok((Tried::new(Some(gamma), parameters.to_vec(), cssim, cssim_object), made.blocks.clone(), floor))
        };
        let open = self.contenders.iter().filter(|contender| contender.given_up.is_none());
        let matched = open.map(tried).collect::<Result<Vec<_>, PlanError>>()?;
        let mut compared = compare(matched, judge).into_iter();
        let tried: Vec<Tried> =
            self.contenders.iter().filter_map(|c| c.given_up.clone().or_else(|| compared.next())).collect();
        let chosen = chosen(&tried).ok_or_else(|| PlanError::new("no model was chosen"))?;
        let contender = &self.contenders[chosen];
        // A simpler model may be chosen than the one of the best score.
        self.best.set(contender.score());
        let (contenders, methods) = (&self.contenders, &self.methods);
        self.conclusion = Some(Conclusion::new((tried, chosen), contenders, methods, &mut self.scene, graph)?);
        self.scene.release_tables_but(&[self.contenders[chosen].spans_of_match()], graph);
        Ok(())
    }

    /// Ends the fit.
    fn conclude(&mut self, conclusion: Conclusion) -> Result<(), PlanError> {
        let missing = || PlanError::new("the report lacks an image");
        let Conclusion { tried, chosen, uncertainty, neighbours, .. } = conclusion;
        let contender = self.contenders.swap_remove(chosen);
        let (width, height) = (self.scene.capture.photo().width(), self.scene.capture.photo().height());
        let winner = contender.index_of_winner()?;
        let gammas: Vec<f64> = contender.shown(&self.shown_gammas).into_iter().map(|j| j.candidate.gamma).collect();
        let Made { mut images, error, noise_floor, .. } = contender.made.ok_or_else(missing)?;
        let matched = images.pop().ok_or_else(missing)?;
        let winner_image = images.pop().ok_or_else(missing)?;
        self.outcome = Some(FitOutcome {
            tried,
            chosen,
            noise: self.noise.zip(noise_floor),
            judged: contender.judged,
            winner,
            uncertainty: uncertainty.unwrap_or_default(),
            neighbours,
            polished: contender.polishing.outcome,
            explored: contender.polishing.explored.map_or(0, |found| found.evaluations),
            winner_image,
            matched,
            error_map: ErrorMap { width, height, error },
            extra: gammas.into_iter().zip(images).collect(),
        });
        Ok(())
    }
}

impl Planner for FitPlanner {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.scene.keep_light(graph)?;
        for contender in &mut self.contenders {
            contender.is_sharp = self.is_judged_on_whole_range || !may_begin_blurred(&contender.method);
        }
        self.add_searches(graph, false, false)?;
        self.add_searches(graph, true, false)?;
        // This table depends on the scene alone, so idle workers can start it now.
        let spans = self
            .methods
            .iter()
            .filter_map(|method| Some(Spans::of_model(method.model, Some(explored_span(method.model)?))));
        if self.scene.method.polish && spans.clone().count() == self.contenders.len() {
            self.coarse = Coarse::add(&mut self.scene, &joined(spans), graph)?;
        }
        Ok(())
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if self.scene.check_if_shard(node, output)? {
            return Ok(());
        }
        if let Some((c, place)) = self.searches.remove(&node) {
            let candidate = self.checked_candidate((c, place), output, graph)?;
            self.contenders[c].candidates.insert(place, candidate);
            return if self.searches.is_empty() { self.searched(graph) } else { Ok(()) };
        }
        if let Some(conclusion) = &mut self.conclusion
            && conclusion.takes(node, output, &self.contenders)?
        {
            return match self.conclusion.take_if(|conclusion| conclusion.is_complete()) {
                Some(conclusion) => self.conclude(conclusion),
                None => Ok(()),
            };
        }
        for c in 0..self.contenders.len() {
            if self.contenders[c].step == Step::Selecting(node) {
                return self.selected(c, output, graph);
            }
            if self.contenders[c].takes(node, output, self.coarse.as_ref(), &mut self.scene, graph)? {
                return self.moved_on(c, graph);
            }
            if self.contenders[c].pictures.is_of(node) {
                return self.reported((c, node), output, graph);
            }
        }
        Ok(())
    }

    /// The result of a search is verified here by computing its cost again. Of every other output only the shape is checked here, so
    /// a second run is useful.
    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        spec.kind != nodes::SEARCH
    }
}
