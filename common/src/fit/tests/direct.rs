//! Stage one by the direct integrator.

use super::scene::{StageOne, capture, method, room};
use crate::{
    fit::{DirectPixels, Integration, Method, MethodError, Objective, SearchKind, tests::scene::Bench},
    graph::{Blob, NodeSpec, PlanError},
    light::LightDistribution,
    metric::cost::Compression,
    plan::{FitError, FitPlanner},
};
use std::{cell::RefCell, sync::Arc};

const GGX: [f64; 8] = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];

#[test]
fn the_direct_cost_agrees_with_that_of_the_table() {
    let scene = StageOne::new("ggx", &GGX);
    let capture = capture("ggx", &GGX, 0.0);
    let light = LightDistribution::new(Arc::new(room()));
    let (pixels, samples) = (&scene.subset.pixels[..], 1 << 14);
    let direct = DirectPixels { geometry: capture.geometry(), light: &light, pixels, samples, seed: 3 };
    let model = crate::brdf::model("ggx").unwrap();
    // Darker, duller, and wider than the photo's material.
    let elsewhere = [0.2, 0.2, 0.2, 0.08, 0.03, 0.05, 1.0, 0.3];
    for gamma in [1.0, 2.4] {
        let objective =
            || Objective::new(model, &scene.table, &scene.subset, &scene.photo, Compression::new(gamma, 0.5));
        let (by_table, rendered) = (objective().cost(&elsewhere), objective().rendered_by(direct).cost(&elsewhere));
        assert!((by_table - rendered).abs() < 0.02 * by_table, "gamma {gamma}: {by_table}, {rendered}");
        assert_ne!(by_table.to_bits(), rendered.to_bits());
        // The same samples every time; the cost is finite everywhere except at parameters that are not numbers.
        assert_eq!(objective().rendered_by(direct).cost(&elsewhere).to_bits(), rendered.to_bits());
        assert!(objective().rendered_by(direct).cost(&[f64::NAN; 8]).is_nan());
    }
}

#[test]
fn evaluations_that_would_block_the_coordinator_are_refused() {
    let fit = |draws, samples| {
        let mut method = method("ggx");
        method.search = SearchKind::Pattern;
        method.samples = crate::render::subset::SampleCount::Draws(draws);
        method.integration = Integration::Direct { samples };
        FitPlanner::new(capture("ggx", &GGX, 0.0), method, 1.0)
    };
    assert!(fit(256, 4096).is_ok());
    assert!(matches!(fit(256, 4097), Err(FitError::DirectTooLarge { pixels: 256, samples: 4097 })));
}

#[test]
fn results_of_direct_searches_are_checked_by_the_direct_integrator() {
    let mut method = method("ggx");
    method.integration = Integration::Direct { samples: 8 };
    assert_eq!(method.check(), Err(MethodError::NoDerivatives));
    method.search = SearchKind::Pattern;
    method.polish = false;
    method.gammas = vec![2.0];
    method.samples = crate::render::subset::SampleCount::Draws(6);
    let planner = |samples| {
        let method = Method { integration: Integration::Direct { samples }, ..method.clone() };
        FitPlanner::new(capture("ggx", &GGX, 0.0), method, 1.0).unwrap()
    };
    let bench = Bench::default();
    let claim = RefCell::new(None);
    let keep = |spec: &NodeSpec, output: Blob| {
        if spec.kind == "search" {
            claim.replace(Some(output.clone()));
        }
        output
    };
    let outcome = bench.run(planner(8), |_| 0, keep).unwrap().into_outcome().unwrap();
    assert!(outcome.judged[0].candidate.cost.is_finite());
    // Nine samples give another cost.
    let wrong = |spec: &NodeSpec, output: Blob| {
        if spec.kind == "search" { claim.borrow().clone().unwrap() } else { output }
    };
    let refused = bench.run(planner(9), |_| 0, wrong);
    assert!(matches!(refused, Err(PlanError::NotVerified { .. })), "{refused:?}");
}
