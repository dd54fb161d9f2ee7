//! The start of stage three: on a coarse picture, or from the winner if a coarse picture would not show the object.

use super::scene::{Bench, capture_of, method};
use crate::{
    fit::{
        Method,
        explore::{MAX_EXPLORATIONS, most_evaluations},
    },
    graph::{Blob, NodeSpec},
    nodes::{
        ExploredWire,
        wire::{PolishedWire, read, write},
    },
    plan::{FitOutcome, FitPlanner},
    scene::Circle,
};
use std::cell::RefCell;

const MATERIAL: [f64; 8] = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];

fn quick() -> Method {
    Method { gammas: vec![2.0], ..method("ggx") }
}

/// The outcome of a fit of a sphere in a photo, and the kinds of its nodes in order.
fn fit(size: (usize, usize), circle: Circle, change: impl Fn(&NodeSpec, Blob) -> Blob) -> (FitOutcome, Vec<String>) {
    let photo = capture_of("ggx", &MATERIAL, 0.05, size, circle);
    let planner = FitPlanner::new(photo, quick(), 1.0).unwrap();
    let kinds = RefCell::new(Vec::new());
    let noted = |spec: &NodeSpec, output: Blob| {
        kinds.borrow_mut().push(spec.kind.clone());
        change(spec, output)
    };
    let outcome = Bench::default().run(planner, |_| 0, noted).unwrap().into_outcome().unwrap();
    (outcome, kinds.into_inner())
}

#[test]
fn a_large_object_is_explored_on_every_second_pixel_and_polish_ends_no_worse_than_the_winner() {
    let circle = Circle { x: 100.5, y: 98.0, radius: 96.8 };
    let (outcome, kinds) = fit((201, 196), circle, |_, output| output);
    let most = most_evaluations(4, MAX_EXPLORATIONS);
    assert!(kinds.contains(&"explore".to_owned()) && (50..=most).contains(&outcome.explored), "{}", outcome.explored);
    let (winner, polished) = (outcome.judged[outcome.winner].cssim, outcome.polished.unwrap());
    assert!(polished.cssim <= winner, "{winner} {polished:?}");
}

#[test]
fn polish_starts_from_the_winner_if_a_coarse_picture_would_not_show_the_object() {
    // Too few pixels; and at the edge, where no window of the metric is centred on it.
    for circle in [Circle { x: 30.0, y: 30.0, radius: 6.0 }, Circle { x: 3.0, y: 40.0, radius: 15.0 }] {
        let (outcome, kinds) = fit((60, 60), circle, |_, output| output);
        let is_seen = kinds.contains(&"explore".to_owned());
        assert_eq!(is_seen, outcome.explored > 0);
        let (winner, polished) = (outcome.judged[outcome.winner].cssim, outcome.polished.unwrap());
        assert!(polished.cssim <= winner, "{winner} {polished:?}");
        if circle.radius < 10.0 {
            assert!(!is_seen, "{kinds:?}");
        }
    }
}

#[test]
fn polish_returns_to_the_winner_if_the_explored_lobe_ends_worse() {
    let model = method("ggx").model;
    let rounds = RefCell::new(Vec::new());
    // The output of `explore` is a lobe far from the winner's, and polish from there ends worse than the winner.
    let astray = |spec: &NodeSpec, output: Blob| {
        let changed = |change: &dyn Fn(&mut crate::fit::Polished)| {
            let mut polished = read::<PolishedWire>("polish", &output).unwrap().polished(model).unwrap();
            change(&mut polished);
            Blob::new(write("polish", &PolishedWire::of(polished)).unwrap())
        };
        match spec.kind.as_str() {
            "explore" => {
                let ExploredWire { found, blocks } = read("explore", &output).unwrap();
                let mut found = found.polished(model).unwrap();
                found.parameters = vec![0.0, 0.0, 0.0, 0.9, 0.9, 0.9, 1.0, 0.06];
                let found = PolishedWire::of(found);
                Blob::new(write("explore", &ExploredWire { found, blocks }).unwrap())
            }
            "polish" => {
                rounds.borrow_mut().push(spec.inputs.clone());
                if rounds.borrow().len() > 1 {
                    return output;
                }
                changed(&|polished| (polished.cssim, polished.at_table_edge) = (0.9, false))
            }
            _ => output,
        }
    };
    let (outcome, kinds) = fit((24, 24), Circle::inscribed(24, 24), astray);
    let (winner, polished) = (outcome.judged[outcome.winner].cssim, outcome.polished.unwrap());
    assert_eq!(rounds.borrow().len(), 2, "{kinds:?}");
    assert_ne!(rounds.borrow()[0], rounds.borrow()[1], "the second round is on the table of stage two");
    assert!(polished.cssim <= winner, "{winner} {polished:?}");
}
