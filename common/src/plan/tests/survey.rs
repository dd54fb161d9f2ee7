//! Surveys and photos of studies: their outcomes, and the outputs of workers that they refuse.

use crate::{
    brdf::Material,
    fit::{
        Method,
        tests::scene::{Bench, capture, method, room},
    },
    graph::{Blob, Execution, NodeSpec, PlanError, Planner, run_in_process},
    light::LightDistribution,
    nodes,
    plan::{FitError, PhotoPlanner, Subject, SurveyOutcome, SurveyPlanner, SurveyRequest, encode_light},
    render::image::Shot,
    scene::{Camera, Circle, Geometry},
};
use std::sync::Arc;

const MATERIAL: [f64; 8] = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];
const START: [f64; 8] = [0.3, 0.3, 0.3, 0.04, 0.04, 0.04, 1.0, 0.3];

fn planner(request: SurveyRequest) -> Result<SurveyPlanner, FitError> {
    SurveyPlanner::new(capture("ggx", &MATERIAL, 0.0), Method { ..method("ggx") }, 1.0, request)
}

fn survey(request: SurveyRequest) -> SurveyOutcome {
    let planner = planner(request).unwrap();
    Bench::default().run(planner, |_| 0, |_, output| output).unwrap().into_outcome().unwrap()
}

#[test]
fn brute_force_comes_near_the_material_and_its_score_is_that_of_its_point() {
    let found =
        survey(SurveyRequest { starts: vec![START.to_vec()], max_evaluations: Some(3000), ..Default::default() });
    let minimum = &found.minima[0];
    assert!(minimum.evaluations <= 3000 && minimum.cssim < 0.05, "{minimum:?}");
    let points = vec![MATERIAL.to_vec(), minimum.parameters.clone(), START.to_vec()];
    let gammas = vec![1.0, 2.0];
    let appraised = survey(SurveyRequest { points, gammas, pictures: 2, ..Default::default() });
    let [truth, again, start] = &appraised.appraisals[..] else { panic!("{appraised:?}") };
    assert_eq!((again.cssim, again.cssim_object), (minimum.cssim, minimum.cssim_object));
    assert!(truth.cssim < again.cssim && again.cssim < 0.5 * start.cssim, "{appraised:?}");
    assert!(truth.costs.iter().zip(&start.costs).all(|(true_cost, cost)| true_cost < cost));
    assert_eq!((appraised.images.len(), found.images.len()), (2, 1));
    assert_eq!(appraised.images[1], found.images[0]);
}

#[test]
fn without_tables_brute_force_reaches_the_same_score() {
    let starts = vec![MATERIAL.to_vec()];
    let by = |direct| SurveyRequest { starts: starts.clone(), max_evaluations: Some(20), direct, ..Default::default() };
    let (tables, direct) = (survey(by(None)), survey(by(Some(64))));
    assert!((tables.minima[0].cssim - direct.minima[0].cssim).abs() < 0.02, "{tables:?} {direct:?}");
    assert!(direct.images.is_empty());
}

#[test]
fn points_outside_the_model_are_refused_before_any_work() {
    let outside = vec![0.3, 0.3, 0.3, 0.3, 0.3, 1.3, 0.3];
    let request = SurveyRequest { points: vec![outside], ..Default::default() };
    assert!(planner(request).unwrap_err().to_string().contains("do not fit ggx"));
    let short = SurveyRequest { starts: vec![vec![0.3; 3]], ..Default::default() };
    assert!(planner(short).is_err());
}

/// The planner's error when `change` has altered the outputs; `None` if it accepts them.
fn told_wrong(planner: impl Planner, change: impl Fn(&NodeSpec, Blob) -> Blob) -> Option<PlanError> {
    Bench::default().run(planner, |ready| ready - 1, change).err()
}

#[test]
fn appraisals_of_another_number_or_without_costs_are_refused() {
    let request = || SurveyRequest { points: vec![START.to_vec()], gammas: vec![1.0, 2.0], ..Default::default() };
    let instead = |costs: Vec<f64>, score: f64| {
        let wrong = Blob::new(crate::protocol::encode(&vec![(score, 0.1, costs)]).unwrap());
        told_wrong(
            planner(request()).unwrap(),
            move |spec, output| {
                if spec.kind == "appraise" { wrong.clone() } else { output }
            },
        )
    };
    assert!(instead(vec![1.0, 2.0], 0.1).is_none());
    for (costs, score) in [(vec![], 0.1), (vec![1.0], 0.1), (vec![1.0, f64::NAN], 0.1), (vec![1.0, 2.0], f64::NAN)] {
        let error = instead(costs.clone(), score);
        assert!(matches!(error, Some(PlanError::WrongOutput { .. })), "{costs:?} {score}: {error:?}");
    }
}

#[test]
fn a_photo_is_the_rendering_of_the_direct_integrator_and_one_of_another_size_is_refused() {
    let geometry = Geometry::sphere(16, 16, Circle::inscribed(16, 16), Camera::Orthographic).unwrap();
    let light = encode_light(&room()).unwrap();
    let subject = || Subject::Model("ggx".to_owned(), MATERIAL.to_vec());
    let planner = || PhotoPlanner::new(light.clone(), subject(), geometry.spec(), 16, 3);
    let run = run_in_process(planner(), &nodes::registry(), Execution::Sequential).unwrap();
    let (photo, noise) = run.into_photo().unwrap();
    let material = Material::new(method("ggx").model, MATERIAL.to_vec()).unwrap();
    let distribution = LightDistribution::new(Arc::new(room()));
    let shot = Shot { geometry: &geometry, light: &distribution, reflectance: &material, samples: 16, seed: 3 };
    assert_eq!(photo, shot.render(|| ()).image);
    assert!(noise.is_some());
    let other = Geometry::sphere(12, 12, Circle::inscribed(12, 12), Camera::Orthographic).unwrap();
    let small = PhotoPlanner::new(light.clone(), subject(), other.spec(), 4, 3);
    let mut outputs = Vec::new();
    let kept = std::cell::RefCell::new(&mut outputs);
    assert!(
        told_wrong(small, |_, output| {
            kept.borrow_mut().push(output.clone());
            output
        })
        .is_none()
    );
    let wrong = outputs.pop().unwrap();
    let error = told_wrong(planner(), |_, _| wrong.clone());
    assert!(matches!(error, Some(PlanError::WrongOutput { .. })), "{error:?}");
}
