//! How far a transport table is from the direct integrator.

use super::{
    Scene, covered,
    reference::{Effort, Reference, SplitLobe, rgb, rounded},
};
use lookalike::{
    brdf::{Model, flat_bounds, lobe_terms, term_count},
    math::{Rgb, cell},
    render::{
        knots::Knots,
        spans::LobeKnots,
        table::TransportTable,
        transport::{Accuracy, Pixel, TransportPlan},
    },
    scene::{Circle, Geometry},
};
use serde_json::{Map, Value, json};

/// Deviations of one term of one lobe at one width. All are shares of the mean radiance of that term over the whole object, with two
/// exceptions, because no surface shows these terms alone. The `F5` part is relative to a dielectric with F0 = 0.04 and no diffuse part.
/// A lobe that adjusts another one ([`Expected::adjusts`](lookalike::brdf::Expected::adjusts)) is relative to their sum.
#[derive(Debug, Clone, Copy)]
pub struct Agreement {
    /// Lobe of the model.
    pub lobe: usize,
    /// Channel of the light, and for a lobe that splits also its part: `1 - F5`, `F5`, the whole lobe.
    pub channel: usize,
    /// Width; 0 for a lobe of fixed shape.
    pub width: f64,
    /// Root mean square over the pixels.
    pub rms: f64,
    /// 99th percentile over the pixels of the absolute deviation.
    pub percentile99: f64,
    /// Mean over the pixels.
    pub bias: f64,
    /// Root mean square over the pixels of the reference's standard error.
    pub standard_error: f64,
}

impl std::fmt::Display for Agreement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { lobe, channel, width, rms, percentile99, bias, standard_error } = self;
        write!(
            f,
            "lobe {lobe} channel {channel} width {width:.4}: rms {:.4} %, 99th percentile {:.4} %, bias {:+.4} %, reference's \
             standard error {:.4} %",
            100.0 * rms,
            100.0 * percentile99,
            100.0 * bias,
            100.0 * standard_error
        )
    }
}

/// References of every lobe of a model at some widths.
#[derive(Debug)]
pub struct References {
    model: &'static dyn Model,
    pixels: Vec<Pixel>,
    entries: Vec<Entry>,
}

/// The reference of one lobe at one width.
#[derive(Debug)]
struct Entry {
    lobe: usize,
    width: f64,
    reference: Reference,
    /// Mean radiance over the object of the parts in the reference's channels.
    level: Rgb,
}

impl References {
    /// Integrates every lobe whose name passes `keep`. The main lobe is integrated at each of `widths`, which are mid-knots of `knots`;
    /// any other lobe that has a width, at the nearest mid-knots of its own grid.
    #[must_use]
    pub fn new(
        scene: &Scene,
        model: &'static dyn Model,
        pixels: &[Pixel],
        (knots, widths): (Knots, &[f64]),
        effort: Effort,
        keep: impl Fn(&str) -> bool,
    ) -> Self {
        let coarse = coarse_table(scene, model);
        let mut entries = Vec::new();
        for LobeKnots { lobe: of_table, knots } in TransportPlan::of_model(model, knots, Accuracy::SUBSET).lobes {
            let place = model.lobes().iter().position(|basis| basis.lobe.name() == of_table.name());
            let Some(lobe) = place.filter(|_| keep(of_table.name())) else { continue };
            let basis = model.lobes()[lobe];
            let mut widths = knots.map_or_else(|| vec![0.0], |grid| mid_knots(&grid, widths));
            widths.dedup();
            for (w, &width) in widths.iter().enumerate() {
                let split = SplitLobe { lobe: basis.lobe, width };
                let [rest, fresnel, whole] = [0, 1, 2].map(|c| mean(&part(model, &coarse, lobe, width, c)));
                let darkest = if lobe_terms(basis.lobe) == 1 { fresnel } else { DIELECTRIC_F0 * rest + fresnel };
                let adjusted = basis.lobe.expected().adjusts.map_or(0.0, |adjusted| {
                    let adjusted = model.lobes().iter().position(|other| other.lobe.name() == adjusted);
                    mean(&part(model, &coarse, adjusted.expect("a lobe adjusts one of its model"), 0.0, 0))
                });
                let level = Rgb::new(rest, darkest, whole) + Rgb::splat(adjusted);
                let seed = 1_000 + 100 * lobe as u64 + w as u64;
                let effort = Effort { level, ..effort };
                entries.push(Entry {
                    lobe,
                    width,
                    reference: Reference::new(scene, pixels, &split, effort, seed),
                    level,
                });
            }
        }
        Self { model, pixels: pixels.to_vec(), entries }
    }

    /// The model of these lobes.
    #[must_use]
    pub fn model(&self) -> &'static dyn Model {
        self.model
    }

    /// The references in stored form, by lobe.
    #[must_use]
    pub fn to_json(&self) -> Map<String, Value> {
        let mut lobes = Map::new();
        for Entry { lobe, width, reference, level } in &self.entries {
            let name = self.model.lobes()[*lobe].lobe.name();
            let entries = lobes.entry(name).or_insert_with(|| json!([])).as_array_mut().expect("a list");
            entries.push(json!({ "width": width, "level": rounded(*level, 6), "reference": reference.to_json() }));
        }
        lobes
    }

    /// The stored references of every lobe whose name passes `keep`.
    ///
    /// # Panics
    /// When such a lobe has no stored reference.
    #[must_use]
    pub fn from_json(model: &'static dyn Model, pixels: &[Pixel], stored: &Value, keep: impl Fn(&str) -> bool) -> Self {
        let mut entries = Vec::new();
        for (lobe, basis) in model.lobes().iter().enumerate().filter(|(_, basis)| keep(basis.lobe.name())) {
            let name = basis.lobe.name();
            let of_lobe = stored[name].as_array().unwrap_or_else(|| panic!("no stored reference of the lobe {name:?}"));
            entries.extend(of_lobe.iter().map(|entry| Entry {
                lobe,
                width: entry["width"].as_f64().expect("a width"),
                reference: Reference::from_json(&entry["reference"]),
                level: rgb(&entry["level"]),
            }));
        }
        Self { model, pixels: pixels.to_vec(), entries }
    }

    /// Integrates a table of `accuracy` on `knots` and compares every term with its reference.
    #[must_use]
    pub fn compare(&self, scene: &Scene, knots: Knots, accuracy: Accuracy) -> Vec<Agreement> {
        let plan = TransportPlan::of_model(self.model, knots, accuracy);
        let table = plan.integrate(&scene.geometry, &scene.pyramid, &self.pixels);
        self.entries.iter().flat_map(|entry| (0..3).map(|channel| self.summary(&table, entry, channel))).collect()
    }

    fn summary(&self, table: &TransportTable, entry: &Entry, channel: usize) -> Agreement {
        let values = part(self.model, table, entry.lobe, entry.width, channel);
        let level = entry.level[channel];
        let deviation: Vec<f64> =
            values.iter().zip(&entry.reference.radiance).map(|(value, r)| (value - r[channel]) / level).collect();
        let mut sizes: Vec<f64> = deviation.iter().map(|d| d.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        Agreement {
            lobe: entry.lobe,
            channel,
            width: entry.width,
            rms: mean(&deviation.iter().map(|d| d * d).collect::<Vec<f64>>()).sqrt(),
            percentile99: sizes[cell(0.99 * sizes.len() as f64, sizes.len())],
            bias: mean(&deviation),
            standard_error: entry.reference.standard_error[channel] / level,
        }
    }
}

/// One channel of a [`SplitLobe`] reference by a table: the same part of the lobe under the same channel of the light.
fn part(model: &dyn Model, table: &TransportTable, lobe: usize, width: f64, channel: usize) -> Vec<f64> {
    let lobes = model.lobes();
    let first: usize = lobes[..lobe].iter().map(|b| lobe_terms(b.lobe)).sum();
    let mut planes = vec![table.planes(); term_count(model)];
    // Terms depend only on the widths.
    let (mut parameters, _) = flat_bounds(model.parameters());
    if let Some(of) = lobes[lobe].width {
        parameters[of.entry] = (of.inverse)(width);
    }
    table.terms(model, &parameters, false, &mut planes);
    let terms = match (lobe_terms(lobes[lobe].lobe), channel) {
        (1, _) => first..first + 1,
        (_, 0 | 1) => first + channel..first + channel + 1,
        _ => first..first + 2,
    };
    (0..table.pixels).map(|p| terms.clone().map(|t| planes[t][channel][p]).sum()).collect()
}

/// A table of the whole object for mean radiances: a sphere in few pixels, any other shape at full size.
fn coarse_table(scene: &Scene, model: &'static dyn Model) -> TransportTable {
    let accuracy = Accuracy { tolerance: 1e-4, footprint: 1.0 };
    let plan = TransportPlan::of_model(model, Knots::covering(0.005, 1.0, 4.0), accuracy);
    if scene.geometry.circle().is_none() {
        return plan.integrate(&scene.geometry, &scene.pyramid, &scene.interior());
    }
    let circle = Circle::inscribed(COARSE, COARSE);
    let small = Geometry::sphere(COARSE, COARSE, circle, scene.geometry.camera()).expect("a coarse sphere is valid");
    plan.integrate(&small, &scene.pyramid, &covered(&small, |coverage| coverage >= 0.5))
}

/// Reflectance at normal incidence of the darkest common surface.
const DIELECTRIC_F0: f64 = 0.04;

/// Pixels per side of the coarse object; mean radiances are accurate to 1 %.
const COARSE: usize = 32;

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The widths half-way (in their logarithm) between neighbouring knots, where interpolation is worst; one for each of the widths
/// requested.
#[must_use]
pub fn mid_knots(knots: &Knots, near: &[f64]) -> Vec<f64> {
    let widths = knots.widths();
    let between: Vec<f64> = widths.windows(2).map(|w| (w[0] * w[1]).sqrt()).collect();
    let distance = |a: f64, b: f64| (a.ln() - b.ln()).abs();
    let nearest = |w: f64| between.iter().copied().min_by(|a, b| distance(*a, w).total_cmp(&distance(*b, w)));
    near.iter().filter_map(|&w| nearest(w)).collect()
}
