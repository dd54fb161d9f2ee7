//! The outcome of a fit does not depend on the order of outputs, and wrong outputs are refused.

use crate::{
    fit::{
        Candidate,
        tests::scene::{Bench, capture, method},
    },
    graph::{Blob, GraphEdit, NodeId, NodeSpec, PlanError, Planner},
    math::{cell, sampling},
    nodes::{
        self,
        wire::{CandidateWire, TableWire, read, write},
    },
    plan::{FitPlanner, Work},
    render::{knots::Knots, table::TransportTable},
    scene::Capture,
};
use std::sync::{Arc, OnceLock};

/// A GGX material within the model's range.
const MATERIAL: [f64; 8] = [0.3, 0.2, 0.1, 0.05, 0.05, 0.05, 1.0, 0.2];

/// A photo of the material, taken once for all tests.
fn photo() -> Arc<Capture> {
    static PHOTO: OnceLock<Arc<Capture>> = OnceLock::new();
    Arc::clone(PHOTO.get_or_init(|| capture("ggx", &MATERIAL, 0.02)))
}

fn planner(subsets: u32) -> FitPlanner {
    let method = crate::fit::Method { subsets, ..method("ggx") };
    FitPlanner::new(photo(), method, 1.0).unwrap().also_render(&[1.0])
}

fn first(_: usize) -> usize {
    0
}

fn unchanged(_: &NodeSpec, output: Blob) -> Blob {
    output
}

/// Changes the candidate of gamma 2.
fn with_candidate(change: impl Fn(&mut Candidate)) -> impl Fn(&NodeSpec, Blob) -> Blob {
    move |spec, output| {
        if spec.label.name != "search gamma 2" {
            return output;
        }
        let model = method("ggx").model;
        let mut candidate = read::<CandidateWire>("candidate", &output).unwrap().candidate(model).unwrap();
        change(&mut candidate);
        Blob::new(write("candidate", &CandidateWire::of(&candidate)).unwrap())
    }
}

/// A table without sharp lobes finds a sharp material only as well as its narrowest lobe. The second round finds it as a table of all widths
/// does from the beginning, bit for bit, for every subset and in any order of outputs.
#[test]
fn sharp_material_is_searched_again_with_sharp_lobes() {
    let mirror = capture("ggx", &[0.02, 0.02, 0.02, 0.9, 0.8, 0.7, 1.0, 0.012], 0.0);
    for (subsets, order) in [(1, first as fn(usize) -> usize), (2, |open| open - 1)] {
        let planner = || {
            let method = crate::fit::Method { subsets, polish: false, ..method("ggx") };
            FitPlanner::new(Arc::clone(&mirror), method, 1.0).unwrap()
        };
        let candidates = |planner: FitPlanner| -> Vec<Candidate> {
            let outcome = Bench::default().run(planner, order, unchanged).unwrap().into_outcome().unwrap();
            outcome.judged.into_iter().map(|judged| judged.candidate).collect()
        };
        let found = candidates(planner());
        assert_eq!(found, candidates(planner().judging_on_whole_range()), "{subsets} subsets");
        assert!(found.iter().all(|c| (c.parameters[7] / 0.012 - 1.0).abs() < 0.1), "{found:?}");
    }
}

fn refusal(change: impl Fn(&mut Candidate)) -> Option<(String, f64, f64)> {
    match Bench::default().run(planner(1), first, with_candidate(change)) {
        Err(PlanError::NotVerified { what, claimed, recomputed }) => Some((what, claimed, recomputed)),
        Err(other) => panic!("{other}"),
        Ok(_) => None,
    }
}

#[test]
fn a_search_result_whose_cost_is_off_by_one_unit_in_the_last_place_is_refused() {
    let (what, claimed, recomputed) = refusal(|c| c.cost = f64::from_bits(c.cost.to_bits() + 1)).unwrap();
    assert_eq!(what, "the cost of gamma 2");
    assert_eq!(claimed.to_bits(), recomputed.to_bits() + 1);
}

#[test]
fn a_search_result_with_other_parameters_and_the_old_cost_is_refused() {
    let (_, claimed, recomputed) = refusal(|c| c.parameters[0] += 1e-3).unwrap();
    assert!(recomputed > claimed, "a minimum was claimed: {claimed} {recomputed}");
    assert_eq!(refusal(|_| {}), None);
}

#[test]
fn candidate_outside_the_ranges_of_the_fit_is_refused() {
    let mut method = method("ggx");
    method.ranges.hold(method.model, "f90", &[1.0]).unwrap();
    let planner = FitPlanner::new(photo(), method, 1.0).unwrap();
    let error = Bench::default().run(planner, first, with_candidate(|c| c.parameters[6] = 0.9)).err().unwrap();
    assert!(error.to_string().contains("parameters within their ranges"), "{error}");
}

/// The planner's error when the first shard of the subset's table is changed.
fn refused_shard(change: impl Fn(&mut TransportTable)) -> String {
    let changed = |spec: &NodeSpec, output: Blob| {
        if spec.kind != nodes::TRANSPORT {
            return output;
        }
        let mut table = read::<TableWire>("transport table", &output).unwrap().table().unwrap();
        change(&mut table);
        Blob::new(write("transport table", &TableWire::of(table)).unwrap())
    };
    match Bench::default().run(planner(1), first, changed) {
        Err(error @ PlanError::WrongOutput { .. }) => error.to_string(),
        other => panic!("{:?}", other.map(|_| ())),
    }
}

#[test]
fn a_table_other_than_the_requested_one_is_refused() {
    let said = refused_shard(|table| {
        table.pixels -= 1;
        for lobe in &mut table.lobes {
            lobe.values.truncate(lobe.slices() * lobe.terms * 3 * table.pixels);
        }
    });
    assert!(said.contains("pixels, found"), "{said}");
    let said = refused_shard(|table| table.lobes[0].values[0] = f32::NAN);
    assert!(said.contains("finite radiance, found NaN"), "{said}");
    let said = refused_shard(|table| table.lobes[1].knots = Some(Knots::covering(0.01, 1.0, 6.9)));
    assert!(said.contains("found"), "{said}");
}

#[test]
fn the_outcome_does_not_depend_on_the_order_in_which_nodes_finish() {
    let bench = Bench::default();
    let outcome = |pick: &mut dyn FnMut(usize) -> usize| {
        let outcome = bench.run(planner(2), pick, unchanged).unwrap().into_outcome().unwrap();
        format!("{outcome:?}")
    };
    let in_order = outcome(&mut |_| 0);
    assert_eq!(in_order, outcome(&mut |ready| ready - 1));
    for seed in 0..6 {
        let mut draw = 0;
        let mut random = |ready: usize| {
            draw += 1;
            cell(sampling::uniform(sampling::key(&[seed, draw])) * ready as f64, ready)
        };
        assert_eq!(in_order, outcome(&mut random), "order {seed}");
    }
}

/// A planner that notes what its nodes compute, by kind.
struct Noting {
    inner: FitPlanner,
    seen: Vec<(String, Work)>,
}

impl Planner for Noting {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        self.inner.start(graph)
    }

    fn completed(&mut self, node: NodeId, output: &Blob, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        let kind = graph.spec(node).unwrap().kind.clone();
        self.seen.push((kind.clone(), self.inner.work_of(node, &kind)));
        self.inner.completed(node, output, graph)
    }
}

#[test]
fn every_node_of_a_fit_is_work_of_its_stage() {
    let run = Bench::default().run(Noting { inner: planner(2), seen: Vec::new() }, first, unchanged).unwrap();
    let of = |kind: &str| run.seen.iter().filter(|(of, _)| of == kind).map(|(_, work)| *work).collect::<Vec<_>>();
    assert!(of(nodes::TRANSPORT).iter().all(|work| *work == Work::Table) && !of(nodes::TRANSPORT).is_empty());
    let mut places: Vec<usize> = Vec::new();
    for work in of(nodes::SEARCH) {
        let Work::Search(place) = work else { panic!("{work:?}") };
        places.push(place);
    }
    places.sort_unstable();
    let outcome = run.inner.into_outcome().unwrap();
    assert_eq!(places, (0..outcome.judged.len()).collect::<Vec<_>>());
    assert_eq!(of(nodes::SELECT), [Work::StageTwo]);
    assert!(of(nodes::POLISH).iter().all(|work| *work == Work::StageThree) && !of(nodes::POLISH).is_empty());
    let coarse = of(nodes::TRANSPORT_COARSE);
    assert!(coarse.iter().all(|work| *work == Work::StageThree) && !coarse.is_empty());
    // The table that the candidates are judged on comes before that of polish.
    let full = of(nodes::TRANSPORT_FULL);
    assert_eq!(full.first(), Some(&Work::StageTwo));
    assert!(full.is_sorted_by_key(|work| *work == Work::StageThree), "{full:?}");
    assert!(of(nodes::REPORT).iter().all(|work| *work == Work::Pictures));
    assert_eq!(of(nodes::UNCERTAINTY), [Work::Pictures]);
}

/// The planner's error when these entries are the ranges of the parameters.
fn refused_ranges(entries: Vec<(f64, f64, u8)>) -> String {
    let output = Blob::new(write("ranges", &(entries, Vec::<(u32, u32)>::new())).unwrap());
    let changed = |spec: &NodeSpec, made: Blob| if spec.kind == nodes::UNCERTAINTY { output.clone() } else { made };
    match Bench::default().run(planner(1), first, changed) {
        Err(error @ PlanError::WrongOutput { .. }) => error.to_string(),
        other => panic!("{:?}", other.map(|_| ())),
    }
}

#[test]
fn ranges_that_cannot_be_those_of_the_match_are_refused() {
    // Too few; not around its values; beyond the bounds.
    for entries in [vec![(0.0, 1.0, 0); 3], vec![(0.001, 0.0011, 0); 8], vec![(0.0, 100.0, 0); 8]] {
        let said = refused_ranges(entries);
        assert!(said.contains("ranges around"), "{said}");
    }
    let said = refused_ranges(vec![(0.0, 1.0, 9); 8]);
    assert!(said.contains("ranges of parameters") && said.contains('9'), "{said}");
}
