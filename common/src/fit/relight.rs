//! Whether matches that the photo does not tell apart look the same under other lights.
//!
//! The match and its neighbours (other models that are as good, other candidates of nearly the same score) are rendered on a small sphere under
//! three lights made by formula, and each neighbour is scored against the match.

use super::{needed_span, ranges::Ranges, stage_two::FullView, verdict::Verdict};
use crate::{
    brdf::Model,
    light::FORMULA_LIGHTS,
    metric::{Judge, JudgeOptions, MetricError, auto_exposure},
    render::{
        pyramid::LightPyramid,
        spans::Spans,
        transport::{Accuracy, Pixel, TransportPlan},
    },
    scene::{Camera, Circle, Geometry, SceneError},
};
use std::sync::{Arc, LazyLock};

/// A match that the photo does not tell from the reported one.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbour {
    /// What it is: a model, or a gamma.
    pub name: String,
    /// Its CSSIM against the match, over the object, under each of the lights.
    pub cssim: Vec<f64>,
}

/// How much the neighbours differ from the match where they differ most; `None` without neighbours.
#[must_use]
pub fn spread(neighbours: &[Neighbour]) -> Option<Verdict> {
    let all = neighbours.iter().flat_map(|neighbour| neighbour.cssim.iter().copied());
    all.reduce(f64::max).map(|most| Verdict::of(most, 0.0))
}

/// A model with its flat parameter vector.
pub(crate) type Point = (&'static dyn Model, Vec<f64>);

/// Width and height of the picture.
const SIZE: usize = 48;

/// Knots per factor of two of width.
const PER_OCTAVE: f64 = 3.0;

/// About one position per pixel. Both pictures of a comparison are seen at the same positions, so that what lies between them does not matter.
const ACCURACY: Accuracy = Accuracy { footprint: 40.0, ..Accuracy::COARSE };

/// Why a match cannot be looked at under another light.
#[derive(Debug, thiserror::Error)]
pub(crate) enum RelightError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Metric(#[from] MetricError),
}

/// CSSIM of each point after the first against the first, under each of [`FORMULA_LIGHTS`].
pub(crate) fn relit(points: &[Point]) -> Result<Vec<Vec<f64>>, RelightError> {
    let geometry = Geometry::sphere(SIZE, SIZE, Circle::inscribed(SIZE, SIZE), Camera::Orthographic)?;
    // They are the same for every fit.
    static PYRAMIDS: LazyLock<Vec<LightPyramid>> =
        LazyLock::new(|| FORMULA_LIGHTS.iter().map(|light| LightPyramid::new(light.environment())).collect());
    let by_light: Vec<Vec<f64>> =
        PYRAMIDS.iter().map(|pyramid| under(points, &geometry, pyramid)).collect::<Result<_, _>>()?;
    Ok((0..points.len().saturating_sub(1)).map(|n| by_light.iter().map(|scores| scores[n]).collect()).collect())
}

/// As [`relit`], under one light. All points share a table, so its errors are common to them.
fn under(points: &[Point], geometry: &Geometry, pyramid: &LightPyramid) -> Result<Vec<f64>, RelightError> {
    let size = u32::try_from(SIZE).unwrap_or(u32::MAX);
    let all = (0..size).flat_map(|row| (0..size).map(move |column| [column, row]));
    let share = |[column, row]: Pixel| geometry.coverage(column as usize, row as usize);
    let coverage: Vec<f32> = all.clone().map(share).collect();
    let pixels: Vec<Pixel> = all.filter(|pixel| share(*pixel) > 0.0).collect();
    let spans = points.iter().map(|(model, point)| {
        Spans::of_model(*model, needed_span(*model, &Ranges::default(), std::iter::once(&point[..])))
    });
    let spans = spans.reduce(|joined, spans| joined.joined(&spans)).unwrap_or_default();
    let plan = TransportPlan { lobes: spans.knots(PER_OCTAVE), accuracy: ACCURACY };
    let table = [Arc::new(plan.integrate(geometry, pyramid, &pixels))];
    let render = |(model, point): &Point| {
        let view = FullView {
            model: *model,
            table: &table,
            pixels: &pixels,
            coverage: &coverage,
            stride: 1,
            width: SIZE,
            height: SIZE,
        };
        view.render(point)
    };
    let Some((matched, others)) = points.split_first() else { return Ok(Vec::new()) };
    let matched = render(matched);
    let scored: Vec<f32> = coverage.iter().map(|&share| if share > 0.0 { 1.0 } else { 0.0 }).collect();
    // A black match has none.
    let exposure = auto_exposure(&matched, &coverage).unwrap_or(1.0);
    let judge = Judge::new(&matched, &scored, exposure, &JudgeOptions::default())?;
    let scores = others.iter().map(|other| Ok(judge.score(&render(other))?.cssim_object));
    scores.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Ggx, GgxHaze};

    #[test]
    fn other_widths_and_colours_show_and_equal_materials_do_not() {
        let ggx = |alpha: f64, f0: f64| vec![0.2, 0.1, 0.05, f0, f0, f0, 1.0, alpha];
        let haze = [&ggx(0.1, 0.05)[..], &[0.0, 0.5]].concat();
        let points: [Point; 4] =
            [(&Ggx, ggx(0.1, 0.05)), (&GgxHaze, haze), (&Ggx, ggx(0.2, 0.05)), (&Ggx, ggx(0.1, 0.5))];
        let relit = relit(&points).unwrap();
        assert_eq!((relit.len(), relit[0].len()), (3, 3));
        assert!(relit[0].iter().all(|&x| x < 1e-6), "no haze: {relit:?}");
        assert!(relit[1].iter().chain(&relit[2]).all(|&x| x > 0.01), "{relit:?}");
        let neighbours = |of: &[f64]| [Neighbour { name: "ggx".to_owned(), cssim: of.to_vec() }];
        assert_eq!(spread(&neighbours(&relit[0])), Some(Verdict::Indistinguishable));
        assert_eq!(spread(&[]), None);
        assert!(spread(&neighbours(&relit[2])).unwrap() > Verdict::Indistinguishable);
    }
}
