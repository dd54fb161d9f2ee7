//! The planner of a cell. It records what each node of the cell computes, from which the cell's cost is added up.

use lookalike::{
    fit::BestScore,
    graph::{Blob, GraphEdit, NodeId, NodeSpec, PlanError, Planner},
    image::Image,
    plan::{FitOutcome, FitPlanner, PhotoPlanner, SurveyOutcome, SurveyPlanner, Work},
};
use std::{collections::BTreeMap, sync::Arc};

/// The planner of a cell.
#[derive(Debug)]
pub(super) struct CellPlanner {
    inner: Inner,
    /// By label.
    work: BTreeMap<String, Work>,
}

#[derive(Debug)]
enum Inner {
    Photo(Box<PhotoPlanner>),
    Fit(Box<FitPlanner>),
    Survey(Box<SurveyPlanner>),
}

/// The outcome of a cell.
#[derive(Debug)]
pub(super) enum Outcome {
    /// The image, and the standard error of a typical pixel.
    Photo(Image, Option<f64>),
    Fit(Box<FitOutcome>),
    Survey(Box<SurveyOutcome>),
}

impl CellPlanner {
    pub(super) fn photo(planner: PhotoPlanner) -> Self {
        Self { inner: Inner::Photo(Box::new(planner)), work: BTreeMap::new() }
    }

    pub(super) fn fit(planner: FitPlanner) -> Self {
        Self { inner: Inner::Fit(Box::new(planner)), work: BTreeMap::new() }
    }

    pub(super) fn survey(planner: SurveyPlanner) -> Self {
        Self { inner: Inner::Survey(Box::new(planner)), work: BTreeMap::new() }
    }

    /// The work of its nodes, by label, and its outcome if all of them are complete.
    pub(super) fn into_outcome(self) -> (BTreeMap<String, Work>, Option<Outcome>) {
        let outcome = match self.inner {
            Inner::Photo(planner) => planner.into_photo().map(|(image, noise)| Outcome::Photo(image, noise)),
            Inner::Fit(planner) => planner.into_outcome().map(|outcome| Outcome::Fit(Box::new(outcome))),
            Inner::Survey(planner) => planner.into_outcome().map(|outcome| Outcome::Survey(Box::new(outcome))),
        };
        (self.work, outcome)
    }

    /// The best score of its fit so far.
    pub(super) fn best(&self) -> Arc<BestScore> {
        if let Inner::Fit(planner) = &self.inner { planner.best() } else { Arc::default() }
    }

    fn inner(&mut self) -> &mut dyn Planner {
        match &mut self.inner {
            Inner::Photo(planner) => &mut **planner,
            Inner::Fit(planner) => &mut **planner,
            Inner::Survey(planner) => &mut **planner,
        }
    }
}

impl Planner for CellPlanner {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.inner().start(graph)
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        if let Some(spec) = graph.spec(node) {
            let work = match &self.inner {
                Inner::Photo(_) => Work::Other,
                Inner::Fit(planner) => planner.work_of(node, &spec.kind),
                Inner::Survey(planner) => planner.work_of(node, &spec.kind),
            };
            self.work.insert(spec.label.to_string(), work);
        }
        self.inner().completed(node, output, graph)
    }

    fn is_verified_by_repetition(&self, spec: &NodeSpec) -> bool {
        match &self.inner {
            Inner::Photo(planner) => planner.is_verified_by_repetition(spec),
            Inner::Fit(planner) => planner.is_verified_by_repetition(spec),
            Inner::Survey(planner) => planner.is_verified_by_repetition(spec),
        }
    }
}
