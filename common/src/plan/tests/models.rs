//! A fit of several models.

use crate::{
    fit::{
        Methods, Ranges,
        tests::scene::{Bench, capture_of, method},
    },
    graph::{Blob, GraphEdit, NodeId, PlanError, Planner},
    nodes,
    plan::{FitOutcome, FitPlanner},
    scene::{Capture, Circle},
};
use std::{collections::BTreeMap, sync::Arc};

/// A photo that is large enough to tell its noise.
fn capture(model: &str, parameters: &[f64], noise: f64) -> Arc<Capture> {
    capture_of(model, parameters, noise, (64, 64), Circle::inscribed(64, 64))
}

fn auto() -> Methods {
    Methods::new(method("ggx"), Methods::auto(&Ranges::default()).unwrap())
}

/// A planner that counts its nodes by kind.
struct Counting {
    inner: FitPlanner,
    nodes: BTreeMap<String, usize>,
}

impl Planner for Counting {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.inner.start(graph)
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        *self.nodes.entry(graph.spec(node).unwrap().kind.clone()).or_default() += 1;
        self.inner.completed(node, output, graph)
    }
}

fn fitted(
    photo: &Arc<Capture>,
    methods: impl Into<Methods>,
    pick: impl FnMut(usize) -> usize,
) -> (FitOutcome, BTreeMap<String, usize>) {
    let inner = FitPlanner::new(Arc::clone(photo), methods, 1.0).unwrap();
    let planner = Counting { inner, nodes: BTreeMap::new() };
    let Counting { inner, nodes } = Bench::default().run(planner, pick, |_, output| output).unwrap();
    (inner.into_outcome().unwrap(), nodes)
}

/// A dielectric that obeys Fresnel, with noise.
const PLASTIC: [f64; 8] = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];

#[test]
fn photo_of_the_simple_model_chooses_it_and_the_models_share_their_tables() {
    let photo = capture("ggx", &PLASTIC, 0.02);
    let (outcome, nodes) = fitted(&photo, auto(), |_| 0);
    assert_eq!((outcome.tried.len(), outcome.chosen), (3, 0), "{:?}", outcome.tried);
    let simple = auto().get(0).clone();
    let (alone, of_one) = fitted(&photo, simple, |_| 0);
    // Stage one does not depend on what the model is compared with.
    let candidates = |outcome: &FitOutcome| outcome.judged.iter().map(|j| j.candidate.clone()).collect::<Vec<_>>();
    assert_eq!(candidates(&outcome), candidates(&alone));
    for kind in [nodes::TRANSPORT, nodes::TRANSPORT_COARSE] {
        assert_eq!(nodes[kind], of_one[kind], "{kind}");
    }
    assert_eq!(nodes[nodes::SEARCH], 3 * of_one[nodes::SEARCH]);
    let (noise, (floor, _)) = outcome.noise.unwrap();
    // Uniform noise of 2 % has a standard deviation of 1.2 %.
    assert!((0.009..0.016).contains(&noise) && floor > 0.0, "{noise} {floor}");
}

#[test]
fn model_without_a_chance_ends_on_the_coarse_picture() {
    let weak = [0.05, 0.05, 0.05, 0.3, 0.25, 0.2, 0.1, 0.15];
    let (outcome, nodes) = fitted(&capture("ggx", &weak, 0.002), auto(), |_| 0);
    let given_up: Vec<bool> = outcome.tried.iter().map(|tried| tried.is_coarse).collect();
    assert!(given_up[0] && !given_up[1], "{:?}", outcome.tried);
    assert_eq!(outcome.chosen, 1, "{:?}", outcome.tried);
    let go_on = given_up.iter().filter(|given_up| !**given_up).count();
    assert_eq!((nodes[nodes::SCOUT], nodes[nodes::EXPLORE], nodes[nodes::SELECT]), (3, 3, go_on));
    let (first, second) = (outcome.tried[0].above_best, outcome.tried[1].above_best);
    assert!(first.0 > 3.0 * first.1 && second.0 <= outcome.tried[1].tolerance);
}

#[test]
fn haze_is_found_where_there_is_haze() {
    let hazy = [0.05, 0.05, 0.05, 0.6, 0.5, 0.4, 1.0, 0.06, 0.4, 0.6];
    let (outcome, _) = fitted(&capture("ggx-haze", &hazy, 0.002), auto(), |_| 0);
    assert_eq!(outcome.chosen, 2, "{:?}", outcome.tried);
    let found = &outcome.tried[2].parameters;
    assert!(
        (found[7] / 0.06 - 1.0).abs() < 0.1 && (found[8] - 0.4).abs() < 0.05 && (found[9] - 0.6).abs() < 0.05,
        "{found:?}"
    );
}

#[test]
fn the_choice_does_not_depend_on_the_order_in_which_nodes_finish() {
    let photo = capture("ggx", &PLASTIC, 0.02);
    let outcome = |pick: fn(usize) -> usize| format!("{:?}", fitted(&photo, auto(), pick).0);
    let in_order = outcome(|_| 0);
    assert_eq!(in_order, outcome(|ready| ready - 1));
    assert_eq!(in_order, outcome(|ready| ready / 2));
}
