//! Scan and least squares find the material that a photo was rendered with.

use super::scene::{StageOne, method};
use crate::{
    brdf::{Channels, DEFAULT_MODEL, MODELS, Model},
    fit::{Candidate, Method, ScannedTable, SearchKind, Start, search_gamma},
};

/// Two materials in the inside of a model's box: the values of its colours in their order, the place of every scalar between its bounds,
/// and the width of the main lobe.
const KNOWN: [([[f64; 3]; 2], f64, f64); 2] =
    [([[0.3, 0.2, 0.1], [0.05, 0.05, 0.05]], 0.3, 0.15), ([[0.05, 0.1, 0.2], [0.6, 0.5, 0.3]], 0.7, 0.35)];

/// The flat parameter vector of one of [`KNOWN`].
fn known(model: &dyn Model, (colours, scalar, width): ([[f64; 3]; 2], f64, f64)) -> Vec<f64> {
    let mut colours = colours.into_iter();
    let mut flat: Vec<f64> = Vec::new();
    for p in model.parameters() {
        match p.channels {
            Channels::Rgb => flat.extend(colours.next().expect("a model has at most two colours")),
            Channels::Scalar => flat.push(p.lower + scalar * (p.upper - p.lower)),
        }
    }
    let main = model.lobes().iter().find_map(|basis| basis.width).expect("a model has a lobe with a width");
    flat[main.entry] = (main.inverse)(width);
    flat
}

fn search(method: &Method, scene: &StageOne, gamma: f64) -> Candidate {
    let scanned = ScannedTable::new(method, scene.table.clone(), &scene.subset, &scene.photo);
    search_gamma(method, gamma, &scanned, &scene.subset, &scene.photo, 0.5, None).unwrap()
}

#[test]
fn scan_and_least_squares_recover_the_material_of_a_photo() {
    for model in MODELS {
        let name = model.name();
        let method = method(name);
        let [first, second] = KNOWN.map(|material| known(*model, material));
        let scene = StageOne::new(name, &first);
        let other = scene.photographed(*model, &second);
        for ((scene, known), gamma) in
            [(&scene, &first), (&other, &second)].into_iter().flat_map(|case| [1.0, 2.2].map(|gamma| (case, gamma)))
        {
            let found = search(&method, scene, gamma);
            let worst = found.parameters.iter().zip(known).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // The photo is the table's own rendering in single precision: what is left is its rounding, 6e-8 of a value,
            // times how weakly the specular colour and f0 of Cook & Torrance are told apart.
            assert!(worst < 1e-3, "{name} at gamma {gamma}: {worst} {found:?}");
        }
    }
}

#[test]
fn a_start_counts_as_one_evaluation() {
    let name = DEFAULT_MODEL.name();
    let scene = StageOne::new(name, &known(DEFAULT_MODEL, KNOWN[0]));
    let paper = Method { search: SearchKind::Pattern, start: Start::Paper, ..method(name) };
    let counted = search(&paper, &scene, 1.0).evaluations;
    let mut calls = 0;
    let bounds = crate::fit::stage_one::search_bounds(paper.model, &paper.ranges, paper.search).unwrap();
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
