//! Scan and least squares find the material that a photo was rendered with.

use super::scene::{StageOne, method};
use crate::fit::{Candidate, Method, SearchKind, Start, search_gamma};

/// Materials in the inside of the models' boxes.
const KNOWN: [(&str, &[f64]); 13] = [
    ("ggx", &[0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 0.15]),
    ("ggx", &[0.05, 0.1, 0.2, 0.6, 0.5, 0.3, 0.35]),
    ("ggx-f90", &[0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 0.3, 0.15]),
    ("ggx-f90", &[0.05, 0.1, 0.2, 0.6, 0.5, 0.3, 0.7, 0.35]),
    ("cook-torrance", &[0.2, 0.3, 0.1, 0.5, 0.4, 0.6, 0.3, 0.2]),
    ("ward", &[0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 0.15]),
    ("ward", &[0.05, 0.1, 0.2, 0.6, 0.5, 0.3, 0.35]),
    ("blinn-phong", &[0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 90.0]),
    ("blinn-phong", &[0.05, 0.1, 0.2, 0.6, 0.5, 0.3, 15.0]),
    ("ashikhmin-shirley", &[0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 90.0]),
    ("ashikhmin-shirley", &[0.15, 0.1, 0.2, 0.6, 0.5, 0.3, 15.0]),
    ("disney", &[0.5, 0.2, 0.1, 0.3, 0.2, 0.6, 0.4, 0.3, 0.5, 0.7]),
    ("disney", &[0.7, 0.5, 0.3, 0.2, 0.8, 0.5, 0.5, 0.2, 0.8, 0.3]),
];

fn search(method: &Method, scene: &StageOne, gamma: f64) -> Candidate {
    search_gamma(method, gamma, &scene.table, &scene.subset, &scene.photo, 0.5, None).unwrap()
}

#[test]
fn scan_and_least_squares_recover_the_material_of_a_photo() {
    for (name, known) in KNOWN {
        let (method, scene) = (method(name), StageOne::new(name, known));
        for gamma in [1.0, 2.2] {
            let found = search(&method, &scene, gamma);
            let worst = found.parameters.iter().zip(known).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The photo is the table's own rendering in single precision: what is left is its rounding, 6e-8 of a value,
            // times how weakly the specular colour and f0 of Cook & Torrance are told apart.
            assert!(worst < 1e-3, "{name} at gamma {gamma}: {worst} {found:?}");
        }
    }
}

#[test]
fn a_start_counts_as_one_evaluation() {
    let (name, known) = KNOWN[0];
    let scene = StageOne::new(name, known);
    let paper = Method { search: SearchKind::Pattern, start: Start::Paper, ..method(name) };
    let counted = search(&paper, &scene, 1.0).evaluations;
    let mut calls = 0;
    let bounds = crate::fit::stage_one::search_bounds(paper.model, paper.search).unwrap();
    let mut objective =
        crate::fit::stage_one::objective_of(&paper, 1.0, &scene.table, &scene.subset, &scene.photo, 0.5);
    let cost = |x: &[f64]| {
        calls += 1;
        objective.cost(x)
    };
    let start = crate::fit::stage_one::paper_start(paper.model);
    let options = crate::search::pattern::PatternOptions::matlab(start.len());
    crate::search::pattern::minimise(cost, &start, &bounds, &options).unwrap();
    assert_eq!(counted, calls);
}
