//! Recovery of known parameters: photos of known materials, with noise, fitted through the tables.

#[cfg(feature = "slow")]
mod probes;
mod targets;

use lookalike::{
    brdf::{Channels, Material, Model, flat_names, offset_of},
    fit::{Candidate, Method, ScannedTable, SearchKind, Start, search_gamma},
    metric::cost::Compression,
    render::{
        knots::{Knots, PER_OCTAVE},
        table::TransportTable,
        transport::{Accuracy, TransportPlan},
    },
    scene::Camera,
};
use lookalike_tests::scene::{
    Scene,
    photograph::{Exposure, Photograph},
    prediction::Prediction,
    synthetic,
};
use targets::{METAL, NEAR_MIRROR, PLASTIC, Target};

const GAMMAS: [f64; 3] = [1.0, 2.2, 3.0];

/// Noise of 0.2 % of mean radiance; 256 draws.
const EXPOSURE: Exposure = Exposure { noise: 2e-3, draws: 256, seed: 20 };

/// A photo with its transport table.
struct Session {
    model: &'static dyn Model,
    truth: Vec<f64>,
    photo: Photograph,
    table: TransportTable,
}

impl Session {
    fn new(scene: &Scene, model: &'static dyn Model, truth: Vec<f64>, exposure: Exposure) -> Self {
        let material = Material::new(model, truth.clone()).unwrap();
        let photo = Photograph::take(scene, &material, exposure);
        let knots = Knots::covering(0.005, 1.0, PER_OCTAVE);
        let plan = TransportPlan::of_model(model, knots, Accuracy::SUBSET);
        let table = plan.integrate(&scene.geometry, &scene.pyramid, &photo.subset.pixels);
        Self { model, truth, photo, table }
    }

    fn search(&self, gamma: f64, search: SearchKind, start: Start) -> Candidate {
        let method = Method { model: self.model, search, start, ..Method::default() };
        let Photograph { subset, pixels, mean_radiance, .. } = &self.photo;
        let scanned = ScannedTable::new(&method, self.table.clone(), subset, pixels);
        search_gamma(&method, gamma, &scanned, subset, pixels, *mean_radiance, None).unwrap()
    }

    fn prediction(&self, gamma: f64) -> Prediction {
        let compression = Compression::new(gamma, self.photo.mean_radiance);
        Prediction::new(self.model, &self.truth, &self.table, &self.photo, &compression)
    }

    /// Quantities that must be recovered: name, truth, found, predicted standard deviation.
    fn quantities(&self, found: &[f64], prediction: &Prediction) -> Vec<Quantity> {
        let at = |name: &str| offset_of(self.model.parameters(), name);
        let names = flat_names(self.model.parameters());
        let mut list: Vec<Quantity> = (0..found.len())
            .map(|i| Quantity {
                name: names[i].clone(),
                truth: self.truth[i],
                found: found[i],
                deviation: prediction.deviation(&[(i, 1.0)]),
            })
            .collect();
        if let (Some(ks), Some(f0)) = (at("ks"), at("f0")) {
            let product = |p: &[f64], c: usize| p[ks + c] * p[f0];
            list.extend((0..3).map(|c| Quantity {
                name: format!("ks f0.{}", ["r", "g", "b"][c]),
                truth: product(&self.truth, c),
                found: product(found, c),
                deviation: prediction.deviation(&[(ks + c, self.truth[f0]), (f0, self.truth[ks + c])]),
            }));
        }
        list
    }
}

/// A parameter, or a product of two.
#[derive(Debug)]
struct Quantity {
    name: String,
    truth: f64,
    found: f64,
    deviation: f64,
}

impl Quantity {
    /// The largest error that counts as recovered (issue point 4).
    fn tolerance(&self, model: &dyn Model) -> f64 {
        let has_scalar_f0 = model.parameters().iter().any(|p| p.name == "f0" && p.channels == Channels::Scalar);
        let three = 3.0 * self.deviation;
        match self.name.split('.').next().unwrap_or_default() {
            "alpha" | "m" => 0.02 * self.truth,
            "kd" => (0.01 * self.truth).max(0.003),
            "ks" | "f0" if has_scalar_f0 => three,
            _ => (0.01 * self.truth).max(three),
        }
    }
}

/// Photographs a target, fits it for each gamma, prints the results, and returns the quantities that were not recovered.
fn unrecovered(scene: &Scene, place: &str, target: &Target, exposure: Exposure) -> Vec<String> {
    let mut failures = Vec::new();
    for (model, truth) in target.parameters() {
        let session = Session::new(scene, model, truth, exposure);
        for gamma in GAMMAS {
            let candidate = session.search(gamma, SearchKind::LeastSquares, Start::Scan);
            let prediction = session.prediction(gamma);
            let mut line = format!("{place}, {} {}, gamma {gamma}:", model.name(), target.name);
            for quantity in session.quantities(&candidate.parameters, &prediction) {
                let Quantity { name, truth, found, deviation } = &quantity;
                let error = found - truth;
                line += &format!(" {name} {found:.4} ({error:+.1e}, sd {deviation:.0e})");
                if error.abs() > quantity.tolerance(model) {
                    failures.push(format!("{place}, {} {}, gamma {gamma}: {quantity:?}", model.name(), target.name));
                }
            }
            println!("{line}");
        }
    }
    failures
}

#[test]
fn metal_and_plastic_are_recovered_in_a_room() {
    let scene = Scene::sphere(64, Camera::Orthographic, synthetic::room_at_dusk(64)).unwrap();
    let failures: Vec<String> =
        [METAL, PLASTIC].iter().flat_map(|target| unrecovered(&scene, "room", target, EXPOSURE)).collect();
    assert!(failures.is_empty(), "{failures:#?}");
}

/// The paper's search from the paper's start stops where least squares still improves.
#[test]
fn least_squares_reaches_at_most_the_cost_of_pattern_search() {
    let scene = Scene::sphere(64, Camera::Orthographic, synthetic::room_at_dusk(32)).unwrap();
    for (model, truth) in NEAR_MIRROR.parameters() {
        let session = Session::new(&scene, model, truth, EXPOSURE);
        let ours = session.search(1.0, SearchKind::LeastSquares, Start::Scan);
        let paper = session.search(1.0, SearchKind::Pattern, Start::Paper);
        println!("{}: {:.3e} against {:.3e}", model.name(), ours.cost, paper.cost);
        assert!(ours.cost <= paper.cost * (1.0 + 1e-6) && ours.evaluations < paper.evaluations);
    }
}
