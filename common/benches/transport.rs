//! Eq. 1 by transport tables against the direct integrator, on one sphere of 256 x 256 pixels in a synthetic room.
//!
//! `cargo bench -p lookalike --bench transport` times the parts of a table, the table and the polish of a full image, and stage one, then prints
//! two ratios from the same run:
//! - one evaluation of Eq. 1 over 256 pixels by tables, against the direct integrator at 256 samples per pixel and at the
//!   sample count where its noise falls to 0.2 % of mean radiance, which is the accuracy of the tables;
//! - stage one (21 searches and the table they need), against one direct rendering of the full image for every evaluation
//!   that the searches made.

use std::{hint::black_box, ops::ControlFlow, sync::Arc, time::Instant};

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use lookalike::{
    brdf::{Ggx, LinearModel, Material, Tail},
    fit::{
        Candidate, FullView, JudgedBy, Judges, Limits, Method, Objective, Ranges, ScannedTable, polish, search_gamma,
    },
    image::Image,
    light::{Environment, LightDistribution},
    math::{Rgb, Vec3, luminance, narrow, to_f32},
    metric::{Judge, JudgeOptions, cost::Compression},
    render::{
        cut::{Band, Cut},
        integrator::Integrator,
        knots::{Knots, PER_OCTAVE},
        point::Point,
        pyramid::LightPyramid,
        subset::{self, PixelSubset, SampleCount, Sampling},
        table::TransportTable,
        transport::{Accuracy, Pixel, TransportPlan, tile_order},
    },
    scene::{Camera, Circle, Geometry},
};
use rayon::prelude::*;

const SIZE: u32 = 256;
/// A reddish plastic: kd, f0, alpha.
const TRUTH: [f64; 8] = [0.4, 0.15, 0.08, 0.05, 0.05, 0.05, 1.0, 0.1];

/// A dim room with texture and four windows, 512 x 256.
fn room() -> Environment {
    let texel = |k: usize| {
        let (v, u) = (((k / 512) as f64 + 0.5) / 256.0, ((k % 512) as f64 + 0.5) / 512.0);
        let windows = [(0.05, 0.30, 5.0), (0.30, 0.25, 6.0), (0.62, 0.35, 18.0), (0.85, 0.55, 2.0)];
        let lit =
            windows.iter().find(|(left, top, _)| (0.0..0.05).contains(&(u - left)) && (0.0..0.15).contains(&(v - top)));
        let radiance = lit.map_or(0.1 + 0.03 * (37.0 * u).sin() * (23.0 * v).cos(), |(.., radiance)| *radiance);
        [to_f32(radiance), to_f32(0.9 * radiance), to_f32(0.8 * radiance)]
    };
    Environment::new(Image::from_pixels(512, 256, (0..512 * 256).map(texel).collect()))
        .expect("the room is a valid map")
}

struct Study {
    geometry: Geometry,
    light: LightDistribution,
    pyramid: LightPyramid,
    material: Material,
    interior: Vec<Pixel>,
    subset: PixelSubset,
    photo: Vec<[f32; 3]>,
    mean_radiance: f64,
}

impl Study {
    fn new() -> Self {
        let environment = room();
        let size = SIZE as usize;
        let geometry = Geometry::sphere(size, size, Circle::inscribed(size, size), Camera::Orthographic)
            .expect("an inscribed sphere is valid");
        let light = LightDistribution::new(Arc::new(environment.clone()));
        let material = Material::new(&Ggx, TRUTH.to_vec()).expect("the parameters are in bounds");
        let all = (0..SIZE * SIZE).map(|k| [k % SIZE, k / SIZE]);
        let interior: Vec<Pixel> = all.filter(|p| geometry.coverage(p[0] as usize, p[1] as usize) >= 1.0).collect();
        let sketch = Integrator { geometry: &geometry, light: &light, samples: 64, seed: 1 };
        let radiance: Vec<Rgb> = interior.par_iter().map(|&p| sketch.pixel(p, &material)).collect();
        let mean_radiance = radiance.iter().map(|r| luminance(*r)).sum::<f64>() / radiance.len() as f64;
        let candidates: Vec<subset::Candidate> = interior
            .iter()
            .zip(&radiance)
            .map(|(&pixel, r)| subset::Candidate { pixel, intensity: luminance(*r) })
            .collect();
        let subset = PixelSubset::draw(&candidates, SampleCount::Draws(256), Sampling::Importance, 0, 0)
            .expect("the room is not black");
        let fine = Integrator { samples: 1 << 14, ..sketch };
        let photo = subset.pixels.par_iter().map(|&p| narrow(fine.pixel(p, &material))).collect();
        let pyramid = LightPyramid::new(environment);
        Self { photo, geometry, light, pyramid, material, interior, subset, mean_radiance }
    }

    fn integrator(&self, samples: u32, seed: u64) -> Integrator<'_> {
        Integrator { geometry: &self.geometry, light: &self.light, samples, seed }
    }

    /// Renders pixels with the direct integrator, on all cores like the tables.
    fn direct(&self, pixels: &[Pixel], samples: u32, seed: u64) -> Vec<Rgb> {
        pixels.par_iter().map(|&p| self.integrator(samples, seed).pixel(p, &self.material)).collect()
    }

    fn table(&self) -> TransportTable {
        let knots = Knots::covering(0.005, 1.0, PER_OCTAVE);
        let plan = TransportPlan::of_model(&Ggx, knots, Accuracy::SUBSET);
        plan.integrate(&self.geometry, &self.pyramid, &self.subset.pixels)
    }

    fn objective<'a>(&'a self, table: &'a TransportTable) -> Objective<'a> {
        Objective::new(&Ggx, table, &self.subset, &self.photo, Compression::new(2.2, self.mean_radiance))
    }

    /// Root mean square noise of one rendering of pixels spread over the object, as a share of mean radiance.
    fn noise(&self, samples: u32) -> f64 {
        const RUNS: u32 = 8;
        let pixels: Vec<Pixel> = self.interior.iter().step_by(self.interior.len() / 256).copied().collect();
        let runs: Vec<Vec<Rgb>> = (0..RUNS).map(|seed| self.direct(&pixels, samples, u64::from(seed) + 10)).collect();
        let n = f64::from(RUNS);
        let variance = |p: usize| {
            let mean = runs.iter().map(|run| run[p]).sum::<Rgb>() / n;
            runs.iter().map(|run| (run[p] - mean).length_squared() / 3.0).sum::<f64>() / (n - 1.0)
        };
        ((0..pixels.len()).map(variance).sum::<f64>() / pixels.len() as f64).sqrt() / self.mean_radiance
    }

    fn stage_one(&self, table: &TransportTable) -> Vec<Candidate> {
        let method = Method::default();
        let scanned = ScannedTable::new(&method, table.clone(), &self.subset, &self.photo);
        let search =
            |gamma: &f64| search_gamma(&method, *gamma, &scanned, &self.subset, &self.photo, self.mean_radiance, None);
        method.gammas.par_iter().map(|gamma| search(gamma).expect("the searches succeed")).collect()
    }
}

/// Seconds of the fastest of a few runs.
fn seconds(runs: u32, mut f: impl FnMut()) -> f64 {
    let once = |_| {
        let start = Instant::now();
        f();
        start.elapsed().as_secs_f64()
    };
    (0..runs).map(once).fold(f64::INFINITY, f64::min)
}

/// The parts of a table: pyramid, one cut, its lights at one point, the lobe at the widths of a band.
fn parts(criterion: &mut Criterion, study: &Study) {
    let mut group = criterion.benchmark_group("parts");
    group.sample_size(20);
    group.bench_function("pyramid of a map of 512 x 256", |b| {
        b.iter_batched(room, LightPyramid::new, BatchSize::LargeInput)
    });
    let normal = Vec3::new(0.3, 0.2, 0.933).normalize();
    let point = Point::new(normal, Vec3::Z).expect("the point faces the camera");
    let (band, widths) = (Band::Glossy(0.01, 0.02, Tail::Short), Knots::covering(0.01, 0.02, PER_OCTAVE).widths());
    let mut cut = Cut::new(&study.pyramid);
    cut.refine(&point, 0.0, band, Accuracy::SUBSET.tolerance);
    let lights = cut.lights(&point).clone();
    group.throughput(Throughput::Elements(lights.len() as u64));
    group.bench_function("one cut", |b| {
        b.iter(|| cut.refine(black_box(&point), 0.0, band, Accuracy::SUBSET.tolerance));
    });
    group.bench_function("one pass over its lights", |b| b.iter(|| cut.lights(black_box(&point)).len()));
    let lobe = Ggx::LOBES[1].lobe;
    let mut sums = vec![0.0; 6 * widths.len()];
    group.bench_function("ggx at the 7 widths of a band", |b| {
        b.iter(|| lobe.accumulate(black_box(&lights), point.cos_o, 1.0, &widths, &mut sums));
    });
    group.finish();
}

/// A table of the full image around the true width, and polish on it from a wrong start.
fn full_image(criterion: &mut Criterion, study: &Study) {
    let size = SIZE as usize;
    let coverage: Vec<f32> = (0..size * size).map(|k| study.geometry.coverage(k % size, k / size)).collect();
    let mut pixels: Vec<Pixel> = (0..SIZE * SIZE).map(|k| [k % SIZE, k / SIZE]).collect();
    pixels.retain(|p| coverage[(p[1] * SIZE + p[0]) as usize] > 0.0);
    pixels.sort_by_key(|&pixel| tile_order(pixel));
    let plan = TransportPlan::of_model(&Ggx, Knots::covering(0.07, 0.14, 5.0), Accuracy::FULL);
    let integrate = || plan.integrate(&study.geometry, &study.pyramid, &pixels);
    let table = [Arc::new(integrate())];
    let view = FullView {
        model: &Ggx,
        table: &table,
        pixels: &pixels,
        coverage: &coverage,
        stride: 1,
        width: size,
        height: size,
    };
    let photo = view.render(&TRUTH);
    let options = JudgeOptions::default();
    let judge = Judge::new(&photo, &coverage, 1.0, &options).expect("the picture shows the object");
    let searching = Judge::single(&photo, &coverage, 1.0, &options).expect("the picture shows the object");
    let judges = Judges { searching: &searching, reporting: &judge, by: JudgedBy::Image };
    let mut start = TRUTH;
    start[..3].fill(0.3);
    start[7] = 0.08;
    let ranges = Ranges::default();
    let mut group = criterion.benchmark_group("full image");
    group.sample_size(10);
    group.bench_function("table of 256 x 256 pixels", |b| b.iter(integrate));
    group.bench_function("polish, at most 100 evaluations", |b| {
        let starts = [start.to_vec()];
        b.iter(|| polish(&view, judges, &starts, Limits::of_polish(&ranges, 100), &mut |_| ControlFlow::Continue(())));
    });
    group.finish();
}

fn kernels(criterion: &mut Criterion) {
    let study = Study::new();
    parts(criterion, &study);
    full_image(criterion, &study);
    let table = study.table();
    let mut objective = study.objective(&table);
    criterion.bench_function("Eq. 1 over 256 pixels by tables", |b| b.iter(|| objective.cost(black_box(&TRUTH))));
    let mut group = criterion.benchmark_group("slow");
    group.sample_size(10).measurement_time(std::time::Duration::from_secs(5));
    group.bench_function("table of 256 pixels", |b| b.iter(|| study.table()));
    group.bench_function("stage one, 21 searches", |b| b.iter(|| study.stage_one(&table)));
    group.bench_function("256 pixels directly, 256 samples", |b| b.iter(|| study.direct(&study.subset.pixels, 256, 1)));
    group.finish();
    ratios(&study);
}

#[allow(clippy::print_stdout, reason = "a bench reports on stdout")]
fn ratios(study: &Study) {
    let pixels = &study.subset.pixels;
    let table = study.table();
    let mut objective = study.objective(&table);
    let by_table = seconds(200, || {
        black_box(objective.cost(black_box(&TRUTH)));
    });
    // On one core, because one evaluation by tables runs on one core.
    let one_core = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a pool of one thread starts");
    let direct = |samples: u32| seconds(2, || drop(black_box(one_core.install(|| study.direct(pixels, samples, 1)))));
    let reached = (8..=17).map(|log| 1u32 << log).find(|&samples| study.noise(samples) < 2e-3);
    println!("one evaluation of Eq. 1 over {} pixels by tables: {:.1} us", pixels.len(), 1e6 * by_table);
    println!("  direct, 256 samples, noise {:.2} %: {:.0} x", 100.0 * study.noise(256), direct(256) / by_table);
    match reached {
        Some(samples) => println!("  direct, {samples} samples, noise 0.2 %: {:.0} x", direct(samples) / by_table),
        None => println!("  direct: 131072 samples do not reach 0.2 %"),
    }
    let mut candidates = Vec::new();
    let ours = seconds(3, || candidates = study.stage_one(&study.table()));
    let evaluations: usize = candidates.iter().map(|c| c.evaluations).sum();
    let rendering = seconds(1, || drop(black_box(study.direct(&study.interior, 256, 1))));
    println!("stage one with its table: {ours:.2} s for {evaluations} evaluations in 21 searches");
    println!("  one direct rendering, {} pixels, 256 samples: {rendering:.2} s", study.interior.len());
    println!("  as many direct renderings as evaluations: {:.0} x", evaluations as f64 * rendering / ours);
}

criterion_group!(benches, kernels);
criterion_main!(benches);
