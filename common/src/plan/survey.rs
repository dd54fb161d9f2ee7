//! The plan of a survey: brute force from several starts, and the scores of given parameter vectors, for one photo, on the
//! full-resolution table over the model's whole range of widths.
//!
//! ```text
//! transport(full, all widths) shards -> brute-force x starts, appraise -> report
//! ```
//! The table depends on the scene and the model alone, so all surveys under one light share it.

use super::{
    appraisal::{Appraisal, appraisals},
    limits::{self, FitError},
    pictures::Pictures,
    scene_tables::SceneTables,
    verify,
    work::Work,
};
use crate::{
    brdf::flat_len,
    fit::{Integration, Method, Polished},
    graph::{Blob, GraphEdit, Input, NodeId, Placement, PlanError, Planner},
    image::Image,
    nodes::{self, AppraiseParameters, BruteForceParameters, DirectWire, ReportParameters},
    render::spans::Spans,
    scene::Capture,
};
use std::{collections::BTreeMap, sync::Arc};

/// The request of a survey. An empty request only integrates the table.
#[derive(Debug, Clone, Default)]
pub struct SurveyRequest {
    /// Brute force starts from each of these flat parameter vectors.
    pub starts: Vec<Vec<f64>>,
    /// Most evaluations from each start; `None` leaves the limit to the search.
    pub max_evaluations: Option<u32>,
    /// With a number of samples per pixel, brute force renders by the direct integrator and there is no table.
    pub direct: Option<u32>,
    /// Flat parameter vectors to be scored.
    pub points: Vec<Vec<f64>>,
    /// Gammas at which Eq. 1 is evaluated at every point.
    pub gammas: Vec<f64>,
    /// How many of the points, from the first on, are rendered too.
    pub pictures: usize,
}

/// The outcome of a survey.
#[derive(Debug, Clone, Default)]
pub struct SurveyOutcome {
    /// Where brute force ended, from each start.
    pub minima: Vec<Polished>,
    /// One per point.
    pub appraisals: Vec<Appraisal>,
    /// Renderings of the first points, then of the best minimum if there is one; linear Rec. 709, over black.
    pub images: Vec<Image>,
}

/// The planner of a survey.
#[derive(Debug)]
pub struct SurveyPlanner {
    scene: SceneTables,
    /// What its table spans.
    spans: Spans,
    request: SurveyRequest,
    searches: BTreeMap<NodeId, usize>,
    minima: BTreeMap<usize, Polished>,
    appraise: Option<NodeId>,
    appraisals: Vec<Appraisal>,
    pictures: Pictures,
    outcome: Option<SurveyOutcome>,
}

impl SurveyPlanner {
    /// Plans a survey of a captured photo. Only model, judge and seed of the method are used; `exposure` is that of the display
    /// transform.
    ///
    /// # Errors
    /// As [`FitPlanner::new`](super::FitPlanner::new).
    pub fn new(capture: Arc<Capture>, method: Method, exposure: f64, request: SurveyRequest) -> Result<Self, FitError> {
        let method = Method { integration: Integration::Tables, ..method };
        limits::check_points(method.model, request.starts.iter().chain(&request.points))?;
        let spans = Spans::whole(method.model);
        let mut scene = SceneTables::new(capture, method, exposure)?;
        scene.stage_two = Placement::Worker;
        Ok(Self {
            scene,
            spans,
            request,
            searches: BTreeMap::new(),
            minima: BTreeMap::new(),
            appraise: None,
            appraisals: Vec::new(),
            pictures: Pictures::default(),
            outcome: None,
        })
    }

    /// Takes the light of the capture from [`encode_light`](super::encode_light).
    #[must_use]
    pub fn with_encoded_light(mut self, light: Blob) -> Self {
        self.scene.light = Some(light);
        self
    }

    /// The outcome, once the graph has run.
    #[must_use]
    pub fn into_outcome(self) -> Option<SurveyOutcome> {
        self.outcome
    }

    /// The work of a node of this kind for this survey. Call this before [`Planner::completed`] receives the node.
    #[must_use]
    pub fn work_of(&self, node: NodeId, kind: &str) -> Work {
        self.searches.get(&node).map_or_else(|| Work::of_survey(kind), |start| Work::Search(*start))
    }

    fn model(&self) -> String {
        self.scene.method.model.name().to_owned()
    }

    fn add_brute_force(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        for (s, start) in self.request.starts.clone().into_iter().enumerate() {
            let max_evaluations = self.request.max_evaluations.unwrap_or(0);
            let (direct, inputs) = match self.request.direct {
                None => (None, self.scene.inputs_on_full_table(graph, &self.spans)?),
                Some(samples) => {
                    let (direct, inputs) = self.direct_scene(samples, graph)?;
                    (Some(direct), inputs)
                }
            };
            let label = format!("{} from start {s}", nodes::BRUTE_FORCE);
            let parameters = BruteForceParameters { model: self.model(), start, max_evaluations, direct };
            let node = self.scene.add_on_view(graph, (nodes::BRUTE_FORCE, &label), inputs, &parameters)?;
            self.searches.insert(node, s);
        }
        Ok(())
    }

    /// How brute force renders by the direct integrator, and its inputs: the view, the environment, the normal map if there is one.
    fn direct_scene(&mut self, samples: u32, graph: &mut GraphEdit<'_>) -> Result<(DirectWire, Vec<Input>), PlanError> {
        let mut inputs = vec![self.scene.full_view(graph)?];
        let (direct, of_scene) = self.scene.direct_scene(samples, graph)?;
        inputs.extend(of_scene);
        Ok((direct, inputs))
    }

    /// Adds the pictures once all searches and appraisals are done.
    fn finish(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if !self.searches.is_empty() || self.appraise.is_some() {
            return Ok(());
        }
        let shown = self.request.points.iter().take(self.request.pictures).cloned();
        let score = |p: &&Polished| self.scene.method.judge.pick(p.cssim, p.cssim_object);
        let best = self.minima.values().min_by(|a, b| score(a).total_cmp(&score(b)));
        let parameters: Vec<Vec<f64>> = shown.chain(best.map(|best| best.parameters.clone())).collect();
        if parameters.is_empty() || self.request.direct.is_some() {
            return self.end(Vec::new());
        }
        let count = parameters.len();
        let parameters = ReportParameters { model: self.model(), parameters, noise: None };
        let node = self.scene.add_judging(graph, (nodes::REPORT, nodes::REPORT), &self.spans, &parameters)?;
        self.pictures.ask(node, count);
        Ok(())
    }

    fn end(&mut self, images: Vec<Image>) -> Result<(), PlanError> {
        let minima = std::mem::take(&mut self.minima).into_values().collect();
        self.outcome = Some(SurveyOutcome { minima, appraisals: std::mem::take(&mut self.appraisals), images });
        Ok(())
    }
}

impl Planner for SurveyPlanner {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.scene.keep_light(graph)?;
        if self.request.direct.is_none() {
            self.scene.full_table(graph, &self.spans)?;
        }
        self.add_brute_force(graph)?;
        if !self.request.points.is_empty() {
            let SurveyRequest { points, gammas, .. } = &self.request;
            let (points, gammas) = (points.clone(), gammas.clone());
            let parameters =
                AppraiseParameters { model: self.model(), points, gammas, mean_radiance: self.scene.mean_radiance };
            let kind = (nodes::APPRAISE, nodes::APPRAISE);
            self.appraise = Some(self.scene.add_judging(graph, kind, &self.spans, &parameters)?);
        }
        Ok(())
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if self.scene.check_if_shard(node, output)? {
            let is_all = self.scene.are_complete() && self.request.starts.is_empty() && self.appraise.is_none();
            return if is_all { self.end(Vec::new()) } else { Ok(()) };
        }
        if let Some(start) = self.searches.remove(&node) {
            // MATLAB's limit; the request may have a lower one.
            let most = 2000 * flat_len(self.scene.method.model.parameters());
            self.minima.insert(start, verify::polished(self.scene.method.model, output, most)?);
            return self.finish(graph);
        }
        if self.appraise == Some(node) {
            self.appraise = None;
            let SurveyRequest { points, gammas, .. } = &self.request;
            self.appraisals = appraisals(output, points.len(), gammas.len())?;
            return self.finish(graph);
        }
        if self.pictures.is_of(node) {
            let photo = self.scene.capture.photo();
            let made = self.pictures.made(node, output, (photo.width(), photo.height()))?;
            return made.map_or(Ok(()), |made| self.end(made.images));
        }
        Ok(())
    }
}
