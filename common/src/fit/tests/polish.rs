//! Stage three never makes a match worse, on one table or over several.

use super::scene::{Bench, capture, method};
use crate::{
    brdf::flat_bounds,
    fit::{FullView, JudgedBy, Judges, Limits, MAX_EVALUATIONS, Ranges, polish, stage_two::Renderer},
    graph::{Blob, NodeSpec},
    metric::{Judge, JudgeOptions},
    nodes::wire::{PolishedWire, read, write},
    plan::FitPlanner,
    render::{
        knots::Knots,
        pyramid::LightPyramid,
        transport::{Accuracy, Pixel, TransportPlan},
    },
};
use std::{cell::Cell, ops::ControlFlow, sync::Arc};

const MATERIAL: [f64; 8] = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];

#[test]
fn polish_starts_from_the_best_and_never_ends_worse_on_its_table() {
    let capture = capture("ggx", &MATERIAL, 0.05);
    let (photo, coverage) = (capture.photo(), capture.scoring_coverage());
    let (width, height) = (photo.width(), photo.height());
    let places = (0..width * height).filter(|&i| coverage[i] > 0.0).map(|i| [i % width, i / width]);
    let pixels: Vec<Pixel> = places.map(|place| place.map(|x| u32::try_from(x).unwrap())).collect();
    let model = method("ggx").model;
    let plan = TransportPlan::of_model(model, Knots::covering(0.1, 0.4, 5.0), Accuracy::FULL);
    let pyramid = LightPyramid::new((**capture.environment()).clone());
    let table = [Arc::new(plan.integrate(capture.geometry(), &pyramid, &pixels))];
    let view = FullView { model, table: &table, pixels: &pixels, coverage: &coverage, stride: 1, width, height };
    // The pixels of a photo over black contain the coverage already.
    let scored: Vec<f32> = coverage.iter().map(|&c| if c > 0.0 { 1.0 } else { 0.0 }).collect();
    let judge = Judge::new(photo, &scored, 1.0, &JudgeOptions::default()).unwrap();
    let searching = Judge::single(photo, &scored, 1.0, &JudgeOptions::default()).unwrap();
    let judges = Judges { searching: &searching, reporting: &judge, by: JudgedBy::Image };
    let score = |point: &[f64]| judge.score(&view.render(point)).unwrap().cssim;
    let near = vec![0.28, 0.21, 0.1, 0.06, 0.05, 0.04, 1.05, 0.19];
    let far = vec![0.6, 0.1, 0.5, 0.3, 0.3, 0.3, 0.5, 0.38];
    assert!(score(&near) < score(&far));
    for starts in [vec![near.clone()], vec![far.clone(), near.clone()], vec![near.clone(), far]] {
        for limit in [3, 60] {
            let mut observe = |_: &crate::search::Progress<'_>| ControlFlow::Continue(());
            let found =
                polish(&view, judges, &starts, Limits::of_polish(&Ranges::default(), limit), &mut observe).unwrap();
            assert!(found.cssim <= score(&near) && found.evaluations <= limit, "{starts:?} {limit}: {found:?}");
            assert_eq!(found.cssim, score(&found.parameters));
        }
    }
}

/// Integrals that are kept from an earlier image, of the same widths or of others, change no bit.
#[test]
fn images_of_a_sequence_are_those_of_single_renderings() {
    let capture = capture("ggx", &MATERIAL, 0.05);
    let (width, height) = (capture.photo().width(), capture.photo().height());
    let coverage = capture.scoring_coverage();
    let places = (0..width * height).filter(|&i| coverage[i] > 0.0).map(|i| [i % width, i / width]);
    let pixels: Vec<Pixel> = places.map(|place| place.map(|x| u32::try_from(x).unwrap())).collect();
    let pyramid = LightPyramid::new((**capture.environment()).clone());
    // One width, and two.
    for name in ["ggx", "disney"] {
        let model = crate::brdf::model(name).unwrap();
        let plan = TransportPlan::of_model(model, Knots::covering(0.1, 0.4, 5.0), Accuracy::COARSE);
        let shards = pixels.chunks(pixels.len() / 2 + 1);
        let table: Vec<_> = shards.map(|shard| Arc::new(plan.integrate(capture.geometry(), &pyramid, shard))).collect();
        let view = FullView { model, table: &table, pixels: &pixels, coverage: &coverage, stride: 1, width, height };
        let renderer = Renderer::new(&view);
        let (lower, upper) = flat_bounds(model.parameters());
        let last = lower.len() - 1;
        // The entry that is moved, from the first point on: a weight, the first width of `disney`, the last width.
        for (entry, share) in [(0, 0.3), (0, 0.4), (last, 0.2), (6, 0.5), (0, 0.3), (last, 0.3), (last, 0.2), (0, 0.1)]
        {
            let mut point: Vec<f64> = lower.iter().zip(&upper).map(|(l, u)| l + 0.35 * (u - l)).collect();
            point[entry] = lower[entry] + share * (upper[entry] - lower[entry]);
            let image = view.render(&point);
            assert_eq!(renderer.render(&point), image);
            let mut exact = crate::render::table::Planes::default();
            for shard in &table {
                let mut planes = shard.planes();
                shard.radiance(model, &point, &mut planes);
                exact.iter_mut().zip(planes).for_each(|(all, plane)| all.extend(plane));
            }
            for (k, &[column, row]) in pixels.iter().enumerate() {
                let place = row as usize * width + column as usize;
                for (channel, exact) in exact.iter().enumerate() {
                    let exact = exact[k] * f64::from(coverage[place]);
                    let found = f64::from(image.pixels()[place][channel]);
                    assert!((found - exact).abs() < 3e-6 * exact.abs() + 1e-9, "{name} {point:?}: {found} {exact}");
                }
            }
        }
    }
}

/// The exponent of Blinn-Phong grows as the lobe gets narrower, so the lower edge of the table's span is the upper bound of the exponent.
#[test]
fn a_fit_and_its_polish_find_an_exponent_inside_the_span_of_their_table() {
    let material = [0.3, 0.2, 0.1, 0.5, 0.4, 0.3, 60.0];
    let planner = FitPlanner::new(capture("blinn-phong", &material, 0.0), method("blinn-phong"), 1.0).unwrap();
    let outcome = Bench::default().run(planner, |_| 0, |_, output| output).unwrap().into_outcome().unwrap();
    let (winner, polished) = (&outcome.judged[outcome.winner], outcome.polished.unwrap());
    for found in [&winner.candidate.parameters, &polished.parameters] {
        assert!((found[6] / 60.0 - 1.0).abs() < 0.05, "{winner:?} {polished:?}");
    }
    assert!(!polished.at_table_edge && polished.cssim <= winner.cssim, "{winner:?} {polished:?}");
}

#[test]
fn a_round_of_polish_that_ends_worse_than_the_winner_is_not_the_result() {
    let planner = FitPlanner::new(capture("ggx", &MATERIAL, 0.05), method("ggx"), 1.0).unwrap();
    let rounds = Cell::new(0);
    // The first round ends at the edge of its table with a worse score than its start, as a round on another table may.
    let astray = |spec: &NodeSpec, output: Blob| {
        if spec.kind != "polish" {
            return output;
        }
        rounds.set(rounds.get() + 1);
        if rounds.get() > 1 {
            return output;
        }
        let mut polished = read::<PolishedWire>("polish", &output).unwrap().polished(method("ggx").model).unwrap();
        (polished.parameters[0], polished.parameters[1], polished.evaluations) = (0.9, 0.9, MAX_EVALUATIONS - 40);
        polished.at_table_edge = true;
        Blob::new(write("polish", &PolishedWire::of(polished)).unwrap())
    };
    let outcome = Bench::default().run(planner, |_| 0, astray).unwrap().into_outcome().unwrap();
    assert!(rounds.get() > 1);
    let (winner, polished) = (outcome.judged[outcome.winner].cssim, outcome.polished.unwrap());
    // Another table changes a score by less than this; from the end of the first round, 40 evaluations would not lead back.
    assert!(polished.cssim < winner + 1e-3, "{winner} {polished:?}");
}
