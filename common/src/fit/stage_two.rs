//! Stage two: render the candidates at full resolution, score each against the photo with CSSIM, keep the lowest.

use super::{
    candidate::{Candidate, distinct},
    method::JudgedBy,
};
use crate::{
    brdf::{Model, term_count},
    image::Image,
    math::Rgb,
    metric::{Judge, MetricError, Score},
    render::{table::TransportTable, transport::Pixel},
};
use rayon::prelude::*;
use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Renders full images from parameters.
#[derive(Debug)]
pub struct FullView<'a> {
    /// The model.
    pub model: &'static dyn Model,
    /// Shards of the full-resolution table of `pixels`, in order.
    pub table: &'a [Arc<TransportTable>],
    /// The pixels that see the object.
    pub pixels: &'a [Pixel],
    /// The share of each pixel of the image that the object covers, `height x width`.
    pub coverage: &'a [f32],
    /// The image has the middle pixel of every square of `stride` x `stride` pixels of the scene; 1 for all pixels.
    pub stride: u32,
    /// Columns of the image.
    pub width: usize,
    /// Rows of the image.
    pub height: usize,
}

impl FullView<'_> {
    /// The image of a flat parameter vector over black, as a photo shows it: mean radiance over the covered part of each pixel
    /// times its coverage.
    #[must_use]
    pub fn render(&self, parameters: &[f64]) -> Image {
        self.image(&self.terms(parameters), parameters)
    }

    /// The basis integrals of every shard at the widths of a parameter vector.
    fn terms(&self, parameters: &[f64]) -> Terms {
        self.table.par_iter().map(|shard| shard.terms_single(self.model, parameters)).collect()
    }

    fn image(&self, terms: &Terms, parameters: &[f64]) -> Image {
        let mut weights = vec![Rgb::ZERO; term_count(self.model)];
        self.model.weights(parameters, &mut weights);
        let shards: Vec<[Vec<f32>; 3]> =
            self.table.par_iter().zip(terms).map(|(shard, terms)| shard.radiance_single(terms, &weights)).collect();
        let mut image = Image::new(self.width, self.height);
        let out = image.pixels_mut();
        let mut pixels = self.pixels.iter();
        for [red, green, blue] in &shards {
            for (((r, g), b), &[column, row]) in red.iter().zip(green).zip(blue).zip(&mut pixels) {
                let place = (row / self.stride) as usize * self.width + (column / self.stride) as usize;
                out[place] = [r, g, b].map(|x| x * self.coverage[place]);
            }
        }
        image
    }

    /// Smallest and largest width of the model's main lobe in the table.
    pub(crate) fn span(&self) -> Option<(f64, f64)> {
        self.table.first()?.span(self.model)
    }
}

/// Basis integrals at some widths: of every shard, `term x channel x pixel`.
type Terms = Vec<Vec<f32>>;

/// Renders a sequence of images of one view, of which many have the same widths. It keeps the integrals at the widths used last. The images
/// are those of [`FullView::render`].
#[derive(Debug)]
pub(super) struct Renderer<'a> {
    view: &'a FullView<'a>,
    kept: Mutex<VecDeque<(Widths, Arc<Terms>)>>,
}

/// The width of every lobe.
type Widths = Vec<Option<f64>>;

impl<'a> Renderer<'a> {
    pub(super) fn new(view: &'a FullView<'a>) -> Self {
        Self { view, kept: Mutex::default() }
    }

    pub(super) fn render(&self, parameters: &[f64]) -> Image {
        let widths: Widths = self.view.model.lobes().iter().map(|basis| basis.width_at(parameters)).collect();
        let terms = self.known(&widths).unwrap_or_else(|| Arc::new(self.view.terms(parameters)));
        self.keep(widths, Arc::clone(&terms));
        self.view.image(&terms, parameters)
    }

    fn known(&self, widths: &Widths) -> Option<Arc<Terms>> {
        let kept = self.lock();
        kept.iter().find(|(kept, _)| kept == widths).map(|(_, terms)| Arc::clone(terms))
    }

    /// Keeps integrals as those used last. A gradient needs those of the incumbent and, for each width, those of a step.
    fn keep(&self, widths: Widths, terms: Arc<Terms>) {
        let most = 1 + widths.iter().flatten().count();
        let mut kept = self.lock();
        kept.retain(|(known, _)| *known != widths);
        kept.push_back((widths, terms));
        if kept.len() > most {
            kept.pop_front();
        }
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<(Widths, Arc<Terms>)>> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A candidate with its scores.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The candidate.
    pub candidate: Candidate,
    /// CSSIM over the whole image.
    pub cssim: f64,
    /// CSSIM over windows centred on the object.
    pub cssim_object: f64,
}

impl JudgedBy {
    /// The score that counts.
    #[must_use]
    pub fn pick(self, cssim: f64, cssim_object: f64) -> f64 {
        match self {
            Self::Image => cssim,
            Self::Object => cssim_object,
        }
    }
}

/// Renders and scores every candidate; near-equal ones share a score. `each` is called once per finished candidate, in any order and
/// from any thread.
///
/// # Errors
/// When a rendering cannot be scored (not finite).
pub fn judge_candidates(
    view: &FullView<'_>,
    judge: &Judge,
    candidates: &[Candidate],
    each: impl Fn() + Sync,
) -> Result<Vec<Judged>, MetricError> {
    let firsts = distinct(view.model, candidates);
    let scores: Vec<Option<Score>> = candidates
        .par_iter()
        .enumerate()
        .map(|(i, candidate)| {
            let first = firsts[i] == i;
            let score = first.then(|| judge.score(&view.render(&candidate.parameters))).transpose();
            each();
            score
        })
        .collect::<Result<_, _>>()?;
    let judged = candidates.iter().zip(&firsts).filter_map(|(candidate, &first)| {
        let score = scores[first].as_ref()?;
        Some(Judged { candidate: candidate.clone(), cssim: score.cssim, cssim_object: score.cssim_object })
    });
    Ok(judged.collect())
}

/// Index of the winner: lowest score, ties to the lower gamma, then to the lower subset.
#[must_use]
pub fn winner(judged: &[Judged], by: JudgedBy) -> Option<usize> {
    let score = |j: &Judged| by.pick(j.cssim, j.cssim_object);
    let better = |a: &Judged, b: &Judged| {
        let order = score(a).total_cmp(&score(b));
        order.then(a.candidate.gamma.total_cmp(&b.candidate.gamma)).then(a.candidate.subset.cmp(&b.candidate.subset))
    };
    (0..judged.len()).min_by(|&a, &b| better(&judged[a], &judged[b]))
}
