//! A sphere of 24 x 24 pixels in a small room, photographed without noise, and a run of a planner in any order.

use crate::{
    brdf::{Model, model},
    fit::{FullView, Method, Ranges, candidate::widths},
    graph::{
        Blob, BlobHash, Change, DecodedCache, FailureReason, Graph, GraphEdit, NodeId, NodeSpec, PlanError, Planner,
        RunContext,
    },
    image::Image,
    light::Environment,
    math::to_f32,
    nodes,
    render::{
        knots::{Knots, PER_OCTAVE},
        pyramid::LightPyramid,
        subset::{PixelSubset, SampleCount},
        table::TransportTable,
        transport::{Accuracy, Pixel, TransportPlan},
    },
    scene::{Camera, Capture, CaptureInput, Circle, Geometry},
};
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex},
};

const SIZE: usize = 24;

/// Dim walls with two windows, 16 x 8 texels.
pub(crate) fn room() -> Environment {
    let texel = |k: usize| match (k / 16, k % 16) {
        (2..=3, 2..=3) => [4.0, 5.0, 7.0],
        (3, 12) => [12.0, 10.0, 8.0],
        (row, column) => [0.10, 0.08, 0.06].map(|wall: f32| wall * (1.0 + 0.04 * (row + column) as f32)),
    };
    Environment::new(Image::from_pixels(16, 8, (0..128).map(texel).collect())).unwrap()
}

/// A photo of a material in the room: its rendering, each pixel multiplied by 1 + `noise` times a number in \[-1, 1\].
pub(crate) fn capture(name: &str, parameters: &[f64], noise: f64) -> Arc<Capture> {
    capture_of(name, parameters, noise, (SIZE, SIZE), Circle::inscribed(SIZE, SIZE))
}

/// As [`capture`], of a photo of other columns and rows with the sphere in this circle.
pub(crate) fn capture_of(
    name: &str,
    parameters: &[f64],
    noise: f64,
    (columns, rows): (usize, usize),
    circle: Circle,
) -> Arc<Capture> {
    let geometry = Geometry::sphere(columns, rows, circle, Camera::Orthographic).unwrap();
    let model: &'static dyn Model = model(name).unwrap();
    let places = (0..columns * rows).map(|i| [i % columns, i / columns]);
    let coverage: Vec<f32> = places.clone().map(|[c, r]| geometry.coverage(c, r)).collect();
    let pixels: Vec<Pixel> = places.map(|place| place.map(|x| u32::try_from(x).unwrap())).collect();
    let (low, high) = widths(model, &Ranges::default(), std::iter::once(parameters)).unwrap();
    let knots = Knots::covering(low / 1.3, high * 1.3, PER_OCTAVE);
    // Finer than any table of a fit.
    let accuracy = Accuracy { tolerance: 5e-4, footprint: 1.0 };
    let plan = TransportPlan::of_model(model, knots, accuracy);
    let table = plan.integrate(&geometry, &LightPyramid::new(room()), &pixels);
    let (width, height) = (columns, rows);
    let view =
        FullView { model, table: &[Arc::new(table)], pixels: &pixels, coverage: &coverage, stride: 1, width, height };
    let mut photo = view.render(parameters);
    for (i, pixel) in photo.pixels_mut().iter_mut().enumerate() {
        for (c, value) in pixel.iter_mut().enumerate() {
            let key = crate::math::sampling::key(&[i as u64, c as u64]);
            *value *= to_f32(1.0 + noise * (2.0 * crate::math::sampling::uniform(key) - 1.0));
        }
    }
    let input = CaptureInput { photo, clipped: None, mask: None, geometry, environment: Arc::new(room()) };
    Arc::new(Capture::new(input).unwrap())
}

/// The input of a search: every seventh pixel inside the sphere, its table over the model's whole range of widths, and the
/// values that a material has there, read from this very table.
#[derive(Debug)]
pub(super) struct StageOne {
    pub(super) table: TransportTable,
    pub(super) subset: PixelSubset,
    pub(super) photo: Vec<[f32; 3]>,
}

impl StageOne {
    pub(super) fn new(name: &str, parameters: &[f64]) -> Self {
        let geometry = Geometry::sphere(SIZE, SIZE, Circle::inscribed(SIZE, SIZE), Camera::Orthographic).unwrap();
        let model: &'static dyn Model = model(name).unwrap();
        let places = (0..SIZE * SIZE).map(|i| [i % SIZE, i / SIZE]).filter(|[c, r]| geometry.coverage(*c, *r) >= 1.0);
        let pixels: Vec<Pixel> = places.step_by(7).map(|place| place.map(|x| u32::try_from(x).unwrap())).collect();
        let width = model.lobes().iter().find_map(|basis| basis.width).unwrap();
        let (lower, upper) = width.span(model.parameters());
        let knots = Knots::covering(lower, upper, PER_OCTAVE);
        let plan = TransportPlan::of_model(model, knots, Accuracy::FULL);
        let table = plan.integrate(&geometry, &LightPyramid::new(room()), &pixels);
        let subset = PixelSubset { weights: vec![1.0; pixels.len()], pixels };
        Self { table, subset, photo: Vec::new() }.photographed(model, parameters)
    }

    /// The same pixels with another material.
    pub(super) fn photographed(&self, model: &dyn Model, parameters: &[f64]) -> Self {
        let mut planes = self.table.planes();
        self.table.radiance(model, parameters, &mut planes);
        let photo = (0..self.table.pixels).map(|p| [0, 1, 2].map(|c| to_f32(planes[c][p]))).collect();
        Self { table: self.table.clone(), subset: self.subset.clone(), photo }
    }
}

/// Three gammas, 48 pixels.
pub(crate) fn method(name: &str) -> Method {
    let gammas = vec![1.0, 2.0, 3.0];
    Method { model: model(name).unwrap(), gammas, samples: SampleCount::Draws(48), ..Method::default() }
}

/// The outputs of nodes. A node is a pure function, so the tests of this process share them.
static KNOWN: Mutex<BTreeMap<Key, Blob>> = Mutex::new(BTreeMap::new());

/// Kind, parameters and inputs of a node.
type Key = (String, Vec<u8>, Vec<BlobHash>);

/// Runs graphs one node at a time.
pub(crate) struct Bench {
    context: RunContext,
}

impl Default for Bench {
    fn default() -> Self {
        Self { context: RunContext::new(Arc::new(DecodedCache::new(1 << 26))) }
    }
}

impl Bench {
    /// Runs a planner to its end. `pick` chooses among the given number of ready nodes; `change` may alter an output before the planner
    /// receives it.
    pub(crate) fn run<P: Planner>(
        &self,
        mut planner: P,
        mut pick: impl FnMut(usize) -> usize,
        change: impl Fn(&NodeSpec, Blob) -> Blob,
    ) -> Result<P, PlanError> {
        let mut graph = Graph::new();
        let mut ready: Vec<NodeId> = Vec::new();
        planner.start(&mut GraphEdit::new(&mut graph))?;
        loop {
            while let Some(changed) = graph.next_change() {
                match changed {
                    Change::Added(_) | Change::Forgotten(_) => {}
                    Change::Ready(node) => ready.push(node),
                    Change::Completed(node) => {
                        let output = graph.output(node).cloned().unwrap();
                        planner.completed(node, &output, &mut GraphEdit::new(&mut graph))?;
                    }
                    Change::Failed(node) => {
                        let reason = FailureReason::Crashed { crashes: 1 };
                        planner.failed(node, &reason, &mut GraphEdit::new(&mut graph))?;
                    }
                }
            }
            if ready.is_empty() {
                return Ok(planner);
            }
            let node = ready.remove(pick(ready.len()));
            let spec = graph.spec(node).cloned().unwrap();
            let output = self.output(&spec, &graph.input_blobs(node).unwrap());
            graph.complete(node, change(&spec, output));
        }
    }

    fn output(&self, spec: &NodeSpec, inputs: &[Blob]) -> Blob {
        let key = (spec.kind.clone(), spec.parameters.clone(), inputs.iter().map(Blob::hash).collect());
        if let Some(known) = KNOWN.lock().unwrap().get(&key) {
            return known.clone();
        }
        // Not under the lock, so that other tests continue.
        let output = nodes::registry().run(&spec.kind, &spec.parameters, inputs, &self.context).unwrap();
        KNOWN.lock().unwrap().entry(key).or_insert(output).clone()
    }
}
