//! Studies of one photo on the full-resolution table over the model's whole range of widths: brute force from several starts, and the
//! scores of given parameter vectors.
//!
//! ```text
//! transport(full, all widths) shards -> brute-force x starts, appraise -> report
//! ```
//! The table depends on the scene and the model alone, so that all surveys under one light share it.

use super::{FitError, FitPlanner, add, limits, pictures::Pictures, tables::whole_span, verify};
use crate::{
    brdf::flat_len,
    fit::{Integration, Method, Polished},
    graph::{Blob, GraphEdit, Input, NodeId, NodeSpec, Placement, PlanError, Planner},
    image::Image,
    nodes::{
        self, AppraiseParameters, BruteForceParameters, DirectWire, ReportParameters,
        wire::{ImageWire, read},
    },
    plan::Grid,
    scene::Capture,
};
use std::{collections::BTreeMap, sync::Arc};

/// What a survey is to find out. Empty, it integrates the table and nothing else.
#[derive(Debug, Clone, Default)]
pub struct SurveyRequest {
    /// Brute force starts from each of these flat parameter vectors.
    pub starts: Vec<Vec<f64>>,
    /// Most evaluations from each start; `None` leaves the limit to the search.
    pub max_evaluations: Option<u32>,
    /// Brute force renders by the direct integrator, with so many samples per pixel, and there is no table.
    pub direct: Option<u32>,
    /// Flat parameter vectors to be appraised.
    pub points: Vec<Vec<f64>>,
    /// The gammas of Eq. 1 for which they are.
    pub gammas: Vec<f64>,
    /// How many of them, from the first, are to be rendered.
    pub pictures: usize,
}

/// What is known of a point.
#[derive(Debug, Clone, PartialEq)]
pub struct Appraisal {
    /// CSSIM over the whole image.
    pub cssim: f64,
    /// CSSIM over windows centred on the object.
    pub cssim_object: f64,
    /// Eq. 1 over all pixels that the object covers wholly, for each gamma.
    pub costs: Vec<f64>,
}

/// What a survey has found out.
#[derive(Debug, Clone, Default)]
pub struct SurveyOutcome {
    /// Where brute force ended, from each start.
    pub minima: Vec<Polished>,
    /// One per point.
    pub appraisals: Vec<Appraisal>,
    /// Renderings of the first points, then of the best minimum, if there is one: linear Rec. 709, over black.
    pub images: Vec<Image>,
}

/// The planner of a survey.
#[derive(Debug)]
pub struct SurveyPlanner {
    /// Plans tables and views.
    base: FitPlanner,
    request: SurveyRequest,
    searches: BTreeMap<NodeId, usize>,
    minima: BTreeMap<usize, Polished>,
    appraise: Option<NodeId>,
    appraisals: Vec<Appraisal>,
    pictures: Pictures,
    outcome: Option<SurveyOutcome>,
}

impl SurveyPlanner {
    /// Plans a survey of a captured photo. Of the method, model, judge and seed count; `exposure` is that of the display transform.
    ///
    /// # Errors
    /// As [`FitPlanner::new`].
    pub fn new(capture: Arc<Capture>, method: Method, exposure: f64, request: SurveyRequest) -> Result<Self, FitError> {
        let method = Method { integration: Integration::Tables, ..method };
        limits::check_points(method.model, request.starts.iter().chain(&request.points))?;
        Ok(Self {
            base: FitPlanner::new(capture, method, exposure)?.judging_on(Placement::Worker),
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
        self.base = self.base.with_encoded_light(light);
        self
    }

    /// What was found out, once the graph has run.
    #[must_use]
    pub fn into_outcome(self) -> Option<SurveyOutcome> {
        self.outcome
    }

    fn add_brute_force(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        for (s, start) in self.request.starts.clone().into_iter().enumerate() {
            let max_evaluations = self.request.max_evaluations.unwrap_or(0);
            let (direct, inputs) = match self.request.direct {
                None => (None, self.base.inputs_on_full_table(graph, self.base.span)?),
                Some(samples) => {
                    let (direct, inputs) = self.direct_scene(samples, graph)?;
                    (Some(direct), inputs)
                }
            };
            let label = format!("{} from start {s}", nodes::BRUTE_FORCE);
            let parameters = BruteForceParameters { start, max_evaluations, direct };
            let node = self.base.add_on_view(graph, (nodes::BRUTE_FORCE, &label), inputs, &parameters)?;
            self.searches.insert(node, s);
        }
        Ok(())
    }

    /// The view and what the direct integrator needs.
    fn direct_scene(&mut self, samples: u32, graph: &mut GraphEdit<'_>) -> Result<(DirectWire, Vec<Input>), PlanError> {
        let view = self.base.view_wire(Grid::FULL, self.base.pixels.clone());
        let mut inputs = vec![Input::Blob(add(graph, "view", &view)?)];
        let (geometry, environment) = (self.base.capture.geometry(), self.base.environment);
        inputs.push(Input::Blob(environment.ok_or_else(|| PlanError::new("the environment was not added"))?));
        let normals = geometry.normal_map();
        if let Some(map) = normals {
            inputs.push(Input::Blob(add(graph, "normal map", &ImageWire::of(&map.to_image()))?));
        }
        let has_normals = normals.is_some();
        Ok((DirectWire { geometry: geometry.spec(), has_normals, samples, seed: self.base.method.seed }, inputs))
    }

    /// All searches and appraisals have come: the pictures, if any.
    fn finish(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if !self.searches.is_empty() || self.appraise.is_some() {
            return Ok(());
        }
        let shown = self.request.points.iter().take(self.request.pictures).cloned();
        let score = |p: &&Polished| self.base.method.judge.pick(p.cssim, p.cssim_object);
        let best = self.minima.values().min_by(|a, b| score(a).total_cmp(&score(b)));
        let parameters: Vec<Vec<f64>> = shown.chain(best.map(|best| best.parameters.clone())).collect();
        if parameters.is_empty() || self.request.direct.is_some() {
            return self.end(Vec::new());
        }
        let count = parameters.len();
        let node = self.base.add_judging(graph, nodes::REPORT, self.base.span, &ReportParameters { parameters })?;
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
        self.base.keep_light(graph)?;
        self.base.span = whole_span(self.base.method.model);
        if self.request.direct.is_none() {
            self.base.full_table(graph, self.base.span)?;
        }
        self.add_brute_force(graph)?;
        if !self.request.points.is_empty() {
            let SurveyRequest { points, gammas, .. } = &self.request;
            let (points, gammas) = (points.clone(), gammas.clone());
            let parameters = AppraiseParameters { points, gammas, mean_radiance: self.base.mean_radiance };
            self.appraise = Some(self.base.add_judging(graph, nodes::APPRAISE, self.base.span, &parameters)?);
        }
        Ok(())
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if let Some(shard) = self.base.shards.remove(&node) {
            verify::check_shard(self.base.method.model, shard, output)?;
            let is_all = self.base.shards.is_empty() && self.request.starts.is_empty() && self.appraise.is_none();
            return if is_all { self.end(Vec::new()) } else { Ok(()) };
        }
        if let Some(start) = self.searches.remove(&node) {
            // MATLAB's limit; a request may have set a lower one.
            let most = 2000 * flat_len(self.base.method.model.parameters());
            self.minima.insert(start, verify::polished(self.base.method.model, output, most)?);
            return self.finish(graph);
        }
        if self.appraise == Some(node) {
            self.appraise = None;
            let SurveyRequest { points, gammas, .. } = &self.request;
            self.appraisals = verify::appraisals(output, points.len(), gammas.len())?;
            return self.finish(graph);
        }
        if self.pictures.is_of(node) {
            let photo = self.base.capture.photo();
            let made = self.pictures.made(node, output, (photo.width(), photo.height()))?;
            return made.map_or(Ok(()), |(images, _)| self.end(images));
        }
        Ok(())
    }

    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        self.base.is_verified_by_repetition(spec)
    }
}

/// What a photo of a study shows.
#[derive(Debug, Clone)]
pub enum Subject {
    /// A measured material: its file in MERL's format.
    Measured(Blob),
    /// A model's name and flat parameters.
    Model(String, Vec<f64>),
}

/// The planner of one rendering by the direct integrator.
#[derive(Debug)]
pub struct PhotoPlanner {
    light: Blob,
    subject: Subject,
    geometry: crate::scene::GeometrySpec,
    samples: u32,
    seed: u64,
    photo: Option<(Image, Option<f64>)>,
}

impl PhotoPlanner {
    /// Plans a rendering of a sphere under an [encoded light](super::encode_light), with so many samples per pixel.
    #[must_use]
    pub fn new(light: Blob, subject: Subject, geometry: crate::scene::GeometrySpec, samples: u32, seed: u64) -> Self {
        Self { light, subject, geometry, samples, seed, photo: None }
    }

    /// The image, linear Rec. 709 over black, and the standard error of a typical pixel relative to its own luminance.
    #[must_use]
    pub fn into_photo(self) -> Option<(Image, Option<f64>)> {
        self.photo
    }
}

impl Planner for PhotoPlanner {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let mut inputs = vec![Input::Blob(graph.keep(self.light.clone())?)];
        let (material, what) = match &self.subject {
            Subject::Measured(file) => {
                inputs.push(Input::Blob(graph.keep(file.clone())?));
                (None, "a measured material".to_owned())
            }
            Subject::Model(model, flat) => (Some((model.clone(), flat.clone())), model.clone()),
        };
        let (samples, seed, geometry) = (self.samples, self.seed, self.geometry);
        let parameters = nodes::RenderParameters { geometry, samples, seed, material };
        graph.add_node(NodeSpec {
            kind: nodes::RENDER.to_owned(),
            label: format!("render {what}"),
            parameters: super::encode("parameters", &parameters)?,
            inputs,
            placement: Placement::Worker,
            priority: 0,
        })?;
        Ok(())
    }

    fn completed(&mut self, _node: NodeId, output: &Blob, _graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let wrong = |failure: &dyn std::fmt::Display| verify::wrong("a rendering", failure);
        let rendered: nodes::RenderedWire = read("rendering", output).map_err(|failure| wrong(&failure))?;
        let image = rendered.image.image().map_err(|failure| wrong(&failure))?;
        let expected = (self.geometry.width as usize, self.geometry.height as usize);
        let found = (image.width(), image.height());
        if expected != found {
            return Err(wrong(&format!("{found:?} instead of {expected:?} pixels")));
        }
        if let Some(value) = image.pixels().iter().flatten().find(|value| !value.is_finite()) {
            return Err(wrong(value));
        }
        self.photo = Some((image, rendered.noise));
        Ok(())
    }
}
