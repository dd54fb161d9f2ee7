//! A study as a list of cells. A cell is computed as one part of the run, and may need other cells first.

use super::file::{Experiment, Study};
use anyhow::bail;
use lookalike::fit::{Compress, Method, SearchKind, Start};
use lookalike::render::subset::{SampleCount, Sampling};
use lookalike::{brdf, brdf::Model};
use lookalike_report::measured::Method as MethodName;
use std::collections::BTreeMap;

/// The number of a cell.
pub(super) type CellId = usize;

/// A material and a light, by number, and the width and height in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Scene {
    pub(super) material: usize,
    pub(super) light: usize,
    pub(super) size: u32,
}

/// A part of the run.
#[derive(Debug, Clone)]
pub(super) struct Cell {
    /// Its name, and that of its files.
    pub(super) name: String,
    pub(super) scene: Scene,
    pub(super) task: Task,
    /// The cells that must be complete before it can begin. The photo of its scene comes first.
    pub(super) needs: Vec<CellId>,
}

/// The task of a cell.
#[derive(Debug, Clone)]
pub(super) enum Task {
    /// The photo of its scene.
    Photo,
    /// The table of its light and size, which other cells share.
    Table,
    /// A fit.
    Fit(Box<FitTask>),
    /// Brute force from these starts.
    Brute { starts: Vec<(&'static str, Vec<f64>)>, direct: Option<u32> },
    /// Brute force at a lower resolution, from the paper's start.
    LowRes,
    /// The matches of other cells, scored and rendered in this scene.
    Appraise { of: Vec<(CellId, What)>, pictures: usize },
    /// All matches of other cells, and many points around the winner, scored by CSSIM and Eq. 1.
    Agreement { of: Vec<CellId> },
    /// The candidates of a fit, rendered by the direct integrator.
    Direct { of: CellId, candidate: usize, samples: u32 },
}

/// A match of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum What {
    /// The winner of stage two.
    Winner,
    /// The outcome of stage three.
    Polished,
    /// The candidate of gamma 1.
    L2,
    /// The best candidate of the gammas that are at least [`APART`] from the winner's.
    RunnerUp,
    /// The best point that brute force has found.
    Minimum,
}

/// A fit of a study.
#[derive(Debug, Clone)]
pub(super) struct FitTask {
    pub(super) name: MethodName,
    pub(super) method: Method,
    /// Whether candidates are judged on the shared table.
    pub(super) is_shared: bool,
    /// Whether radiance in Eq. 1 is clamped to what a display shows.
    pub(super) is_clamped: bool,
    /// The word for the match in the names of its pictures; `None` without pictures.
    pub(super) pictures: Option<&'static str>,
}

/// All cells. A cell comes after those that it needs.
pub(super) fn plan(study: &Study) -> anyhow::Result<Vec<Cell>> {
    let mut plan =
        Plan { study, model: brdf::model(&study.file.model)?, cells: Vec::new(), known: BTreeMap::new(), clash: None };
    plan.everything()?;
    if let Some(name) = plan.clash {
        bail!("two cells of the study would be called {name:?}: rename a material or a light");
    }
    Ok(plan.cells)
}

struct Plan<'a> {
    study: &'a Study,
    model: &'static dyn Model,
    cells: Vec<Cell>,
    known: BTreeMap<String, CellId>,
    /// A name that two different cells share.
    clash: Option<String>,
}

impl Plan<'_> {
    /// Adds all cells in the order in which their nodes should run: those that many others need come first.
    fn everything(&mut self) -> anyhow::Result<()> {
        let (all, probes) = ((0..self.study.materials.len()).collect::<Vec<_>>(), self.study.probes);
        let six = self.study.numbers(&self.study.file.six);
        let has = |experiment| self.study.has(experiment);
        let (has_held_out, has_agreement, has_direct) =
            (has(Experiment::HeldOut), has(Experiment::Agreement), has(Experiment::Direct));
        let needs_main =
            has(Experiment::Methods) || has(Experiment::Samples) || has_held_out || has_agreement || has_direct;
        let (methods, low, subsets, models) = (
            has(Experiment::Methods),
            has(Experiment::LowResolution),
            has(Experiment::Subsets),
            has(Experiment::Models),
        );
        if needs_main {
            for (light, material) in product(probes, &all) {
                let scene = self.scene(material, light);
                self.main(scene);
                if methods || has_agreement {
                    self.brute(scene);
                }
            }
        }
        if methods {
            for (light, material) in product(probes, &all) {
                self.other_methods(self.scene(material, light))?;
            }
            self.large();
        }
        if low {
            for (light, material) in product(probes, &six) {
                self.low_resolution(self.scene(material, light));
            }
        }
        self.sampled(&six)?;
        self.repeated();
        let repeat = self.study.light(&self.study.file.repeat_probe);
        for (light, material) in product(probes, &six) {
            let scene = self.scene(material, light);
            if subsets && Some(light) == repeat {
                let method = Method { subsets: SUBSETS, ..self.method() };
                self.fit(scene, MethodName::Subsets, method, |task| task);
            }
            if has_agreement {
                self.agreement(scene);
            }
        }
        if models {
            for (light, material) in product(probes, &all) {
                self.other_models(self.scene(material, light), Some(light) == repeat)?;
            }
        }
        if has_held_out {
            self.held_out(&all);
        }
        if has_direct {
            self.direct();
        }
        Ok(())
    }

    fn scene(&self, material: usize, light: usize) -> Scene {
        Scene { material, light, size: self.study.file.size }
    }

    fn method(&self) -> Method {
        Method { model: self.model, seed: self.study.file.seed, ..Method::default() }
    }

    /// The number of the cell of this name, which is added if it is new.
    fn cell(&mut self, name: String, scene: Scene, task: Task, needs: Vec<CellId>) -> CellId {
        if let Some(&known) = self.known.get(&name) {
            // Names consist of those of material and light, so "a" under "b-c" and "a-b" under "c" would share one.
            if self.cells[known].scene != scene && !matches!(task, Task::Table) {
                self.clash.get_or_insert(name);
            }
            return known;
        }
        self.known.insert(name.clone(), self.cells.len());
        self.cells.push(Cell { name, scene, task, needs });
        self.cells.len() - 1
    }

    fn name(&self, scene: Scene, what: &str) -> String {
        let (material, light) = (&self.study.materials[scene.material].0, &self.study.lights[scene.light].0);
        format!("{material}-{light}-{}-{what}", scene.size)
    }

    fn photo(&mut self, scene: Scene) -> CellId {
        self.cell(self.name(scene, "photo"), scene, Task::Photo, Vec::new())
    }

    /// The table of a light and a size. It is the same for every material.
    fn table(&mut self, scene: Scene) -> CellId {
        let photo = self.photo(scene);
        let name = format!("table-{}-{}", self.study.lights[scene.light].0, scene.size);
        self.cell(name, scene, Task::Table, vec![photo])
    }

    fn fit(&mut self, scene: Scene, name: MethodName, method: Method, with: impl FnOnce(FitTask) -> FitTask) -> CellId {
        let task = FitTask { name, method, is_shared: false, is_clamped: false, pictures: None };
        let task = with(task);
        let mut needs = vec![self.photo(scene)];
        if task.is_shared {
            needs.push(self.table(scene));
        }
        self.cell(self.name(scene, &task.label()), scene, Task::Fit(Box::new(task)), needs)
    }

    fn main(&mut self, scene: Scene) -> CellId {
        let method = self.method();
        self.fit(scene, MethodName::Ours, method, |task| FitTask { pictures: Some("ours"), ..task })
    }

    fn brute(&mut self, scene: Scene) -> CellId {
        let needs = vec![self.photo(scene), self.table(scene)];
        let task = Task::Brute { starts: starts(self.model), direct: None };
        self.cell(self.name(scene, "brute"), scene, task, needs)
    }

    /// The paper's method, and a fit with a single cost (logarithm).
    fn other_methods(&mut self, scene: Scene) -> anyhow::Result<()> {
        let paper = Method {
            model: brdf::PAPER_MODEL,
            search: SearchKind::Pattern,
            start: Start::Paper,
            compress: Compress::Clamp,
            polish: false,
            ..self.method()
        };
        self.fit(scene, MethodName::Paper, paper, |task| FitTask { pictures: Some("paper"), ..task });
        let log = Method { compress: Compress::Logarithm, gammas: vec![1.0], polish: false, ..self.method() };
        let with = |task| FitTask { pictures: Some("log"), is_shared: true, ..task };
        self.fit(scene, MethodName::Log, log, with);
        Ok(())
    }

    fn large(&mut self) {
        let size = self.study.file.large;
        for [material, light] in self.study.file.large_cells.clone() {
            let (Some(&material), Some(light)) = (self.study.numbers(&[material]).first(), self.study.light(&light))
            else {
                continue;
            };
            let scene = Scene { material, light, size };
            self.main(scene);
            self.brute(scene);
            self.low_resolution(scene);
            let few = Method { samples: SampleCount::Draws(32), polish: false, ..self.method() };
            self.fit(scene, MethodName::Ours, few, |task| FitTask { pictures: Some("samples32"), ..task });
        }
    }

    fn low_resolution(&mut self, scene: Scene) {
        for size in self.study.file.low_resolutions.clone().into_iter().filter(|&size| size < scene.size) {
            let small = Scene { size, ..scene };
            let needs = vec![self.photo(small), self.table(small)];
            let found = self.cell(self.name(small, "lowres"), small, Task::LowRes, needs);
            let needs = vec![self.photo(scene), self.table(scene), found];
            let task = Task::Appraise { of: vec![(found, What::Minimum)], pictures: 1 };
            self.cell(self.name(scene, &format!("lowres{size}")), scene, task, needs);
        }
    }

    /// Fits with different numbers of pixels, and different ways of drawing them.
    fn sampled(&mut self, six: &[usize]) -> anyhow::Result<()> {
        let (samples, sampling) = (self.study.has(Experiment::Samples), self.study.has(Experiment::Sampling));
        let repeated = self.study.numbers(&self.study.file.repeat_materials);
        for (light, material) in product(self.study.probes, six) {
            let scene = self.scene(material, light);
            if samples {
                for (draws, pictures) in [(32, "samples32"), (64, "samples64")] {
                    let samples = SampleCount::Draws(draws);
                    let method = Method { samples, polish: false, ..self.method() };
                    self.fit(scene, MethodName::Ours, method, |task| FitTask { pictures: Some(pictures), ..task });
                }
                let given = self.study.file.full_gammas.clone();
                let gammas = if given.is_empty() { Method::default().gammas } else { given };
                let method = Method { samples: SampleCount::Full, polish: false, gammas, ..self.method() };
                let with = |task| FitTask { pictures: Some("full"), is_shared: true, ..task };
                self.fit(scene, MethodName::Ours, method, with);
            }
            let mut fit = |samples, sampling| {
                let method = Method { samples, sampling, polish: false, ..self.method() };
                self.fit(scene, MethodName::Ours, method, |task| FitTask { is_shared: true, ..task })
            };
            if sampling && repeated.contains(&material) {
                for draws in [32, 64, 256] {
                    for sampling in [Sampling::Importance, Sampling::Stratified, Sampling::Uniform] {
                        fit(SampleCount::Draws(draws), sampling);
                    }
                }
            }
        }
        if self.study.has(Experiment::Gamma) {
            for (light, material) in product(self.study.probes, &six[..six.len().min(3)]) {
                let gammas = (31..=50).map(|tenth| f64::from(tenth) / 10.0).collect();
                let method = Method { gammas, polish: false, ..self.method() };
                let scene = self.scene(material, light);
                self.fit(scene, MethodName::Candidate, method, |task| FitTask { is_shared: true, ..task });
            }
        }
        Ok(())
    }

    /// The same fit with many seeds.
    fn repeated(&mut self) {
        let materials = self.study.numbers(&self.study.file.repeat_materials);
        let Some(light) = self.study.light(&self.study.file.repeat_probe) else { return };
        let (spread, clamped) = (self.study.has(Experiment::Spread), self.study.has(Experiment::Clamped));
        for material in materials {
            for seed in 0..u64::from(self.study.file.seeds) {
                let scene = self.scene(material, light);
                let method =
                    |draws| Method { samples: SampleCount::Draws(draws), seed, polish: false, ..self.method() };
                let [few, some, many] = [32, 64, 256].map(method);
                let shared = |task| FitTask { is_shared: true, ..task };
                if spread || clamped {
                    self.fit(scene, MethodName::Ours, few.clone(), shared);
                }
                if spread {
                    self.fit(scene, MethodName::Ours, some, shared);
                    self.fit(scene, MethodName::Ours, many, shared);
                }
                if clamped {
                    let with = |task| FitTask { is_shared: true, is_clamped: true, ..task };
                    self.fit(scene, MethodName::Ours, few, with);
                }
            }
        }
    }

    /// The same fit with other models: some in every scene, more in the scenes of the experiments that repeat.
    fn other_models(&mut self, scene: Scene, is_repeat_probe: bool) -> anyhow::Result<()> {
        let file = &self.study.file;
        let repeats = is_repeat_probe && self.study.numbers(&file.repeat_materials).contains(&scene.material);
        let more = if repeats { file.more_models.clone() } else { Vec::new() };
        for name in [file.models.clone(), more].concat() {
            let method = Method { model: brdf::model(&name)?, ..self.method() };
            self.fit(scene, MethodName::Ours, method, |task| task);
        }
        Ok(())
    }

    fn agreement(&mut self, scene: Scene) {
        let of = vec![self.main(scene), self.brute(scene)];
        let needs = [vec![self.photo(scene), self.table(scene)], of.clone()].concat();
        self.cell(self.name(scene, "agreement"), scene, Task::Agreement { of }, needs);
    }

    fn held_out(&mut self, all: &[usize]) {
        for (light, material) in product(self.study.probes, all) {
            let fitted = self.main(self.scene(material, light));
            for shown in (0..self.study.lights.len()).filter(|&shown| shown != light) {
                let scene = self.scene(material, shown);
                let of = [What::Polished, What::L2, What::Winner, What::RunnerUp].map(|what| (fitted, what)).to_vec();
                let needs = vec![self.photo(scene), self.table(scene), fitted];
                let name = self.name(scene, &format!("from-{}", self.study.lights[light].0));
                self.cell(name, scene, Task::Appraise { of, pictures: 2 }, needs);
            }
        }
    }

    /// The cost of an evaluation without tables, per light; and brute force without tables, on a small photo.
    fn direct(&mut self) {
        let size = self.study.file.size;
        let first = self.study.numbers(&self.study.file.six).first().copied().unwrap_or(0);
        let scenes: Vec<Scene> = (0..self.study.probes).map(|light| Scene { material: first, light, size }).collect();
        let samples = self.study.file.direct_samples;
        for scene in scenes {
            let of = self.main(scene);
            for candidate in 0..21 {
                let name = self.name(scene, &format!("direct-{candidate}"));
                let task = Task::Direct { of, candidate, samples };
                self.cell(name, scene, task, vec![of]);
            }
        }
        let size = self.study.file.direct_size;
        if size > 0 {
            let scene = Scene { material: first, light: 0, size };
            let photo = self.photo(scene);
            let starts: Vec<_> = starts(self.model).into_iter().take(1).collect();
            let task = Task::Brute { starts: starts.clone(), direct: Some(samples) };
            self.cell(self.name(scene, "brute-direct"), scene, task, vec![photo]);
            let table = self.table(scene);
            self.cell(self.name(scene, "brute"), scene, Task::Brute { starts, direct: None }, vec![photo, table]);
        }
    }
}

/// The number of subsets in the experiment on several subsets.
const SUBSETS: u32 = 4;

impl FitTask {
    /// Distinguishes it from the other fits of its scene.
    fn label(&self) -> String {
        let Method { model, samples, sampling, subsets, seed, polish, gammas, .. } = &self.method;
        let samples = match samples {
            SampleCount::Draws(draws) => draws.to_string(),
            SampleCount::Full => "full".to_owned(),
        };
        let name = self.name.name().replace('+', "-");
        let clamped = if self.is_clamped { "-clamped" } else { "" };
        let polish = if *polish { "-polish" } else { "" };
        let last = gammas.last().copied().unwrap_or(0.0);
        let sampling = format!("{sampling:?}").to_lowercase();
        format!("{name}-{}-{samples}-{sampling}-{subsets}-seed{seed}-to{last}{clamped}{polish}", model.name())
    }
}

/// Pairs of light and material, with the light in the outer loop: cells under one light share its tables.
fn product(lights: usize, materials: &[usize]) -> impl Iterator<Item = (usize, usize)> + use<> {
    let materials = materials.to_vec();
    (0..lights).flat_map(move |light| materials.clone().into_iter().map(move |material| (light, material)))
}

/// The starts of brute force: the paper's start, a plastic, and a metal.
fn starts(model: &dyn Model) -> Vec<(&'static str, Vec<f64>)> {
    let flat = |value: fn(&brdf::Parameter) -> f64| -> Vec<f64> {
        model.parameters().iter().flat_map(|p| std::iter::repeat_n(value(p), p.channels.count())).collect()
    };
    let usual = flat(|p| p.usual.unwrap_or(p.start));
    let mut starts = vec![("paper", flat(|p| p.start))];
    let offset = |name| brdf::offset_of(model.parameters(), name);
    let Some(width) = model.lobes().iter().find_map(|basis| basis.width) else { return starts };
    let (Some(kd), Some(specular)) = (offset("kd"), offset("f0").or_else(|| offset("ks"))) else { return starts };
    for (name, diffuse, reflectance, share) in [("plastic", 0.3, 0.04, 0.05_f64), ("metal", 0.05, 0.7, 0.1)] {
        let mut start = usual.clone();
        start[kd..kd + 3].fill(diffuse);
        let colours = if width.entry > specular + 1 { 3.min(width.entry - specular) } else { 1 };
        start[specular..specular + colours].fill(reflectance);
        let (lower, upper) = brdf::flat_bounds(model.parameters());
        start[width.entry] = (width.inverse)(share).clamp(lower[width.entry], upper[width.entry]);
        starts.push((name, start));
    }
    starts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::file::Study;
    use std::fs;

    fn study(more: &str) -> Study {
        let folder = tempfile::tempdir().unwrap();
        for name in ["gold.binary", "nickel.binary", "grace.hdr", "uffizi.hdr"] {
            fs::write(folder.path().join(name), b"").unwrap();
        }
        let path = folder.path().join("STUDY.toml");
        let base =
            "materials = ['*.binary']\nprobes = ['grace.hdr']\nheld-out = ['uffizi.hdr']\nmodels = ['cook-torrance']\n";
        fs::write(&path, format!("{base}{more}")).unwrap();
        Study::read(&path).unwrap()
    }

    #[test]
    fn cells_come_after_what_they_need_and_have_their_own_names() {
        let cells = plan(&study("large-cells = [['gold', 'grace']]\ndirect-size = 32\nseeds = 2")).unwrap();
        let mut names: Vec<&str> = cells.iter().map(|cell| &*cell.name).collect();
        for (number, cell) in cells.iter().enumerate() {
            assert!(cell.needs.iter().all(|&need| need < number), "{}: {:?}", cell.name, cell.needs);
        }
        names.sort_unstable();
        let count = names.len();
        names.dedup();
        assert_eq!(names.len(), count);
        assert!(names.contains(&"gold-grace-128-brute") && names.contains(&"gold-uffizi-128-from-grace"), "{names:?}");
        assert!(!names.contains(&"gold-uffizi-128-brute"));
    }

    #[test]
    fn an_experiment_alone_plans_what_it_needs_and_no_more() {
        let cells = plan(&study("experiments = ['samples']")).unwrap();
        let fits = cells.iter().filter(|cell| matches!(cell.task, Task::Fit(_))).count();
        // 256 pixels, 32, 64, and all pixels.
        assert_eq!(fits, 2 * 4);
        assert!(!cells.iter().any(|cell| matches!(cell.task, Task::Brute { .. } | Task::Appraise { .. })));
    }

    #[test]
    fn some_models_are_fitted_in_every_cell_and_more_where_experiments_repeat() {
        let text = "experiments = ['methods', 'models']\nmore-models = ['ward']\nrepeat-materials = ['nickel']";
        let cells = plan(&study(text)).unwrap();
        let of = |model: &str| {
            let fits = cells.iter().filter(|cell| match &cell.task {
                Task::Fit(task) => task.method.model.name() == model && task.name == MethodName::Ours,
                _ => false,
            });
            fits.map(|cell| cell.scene.material).collect::<Vec<usize>>()
        };
        assert_eq!((of("cook-torrance"), of("ward")), (vec![0, 1], vec![1]));
    }

    #[test]
    fn starts_are_inside_the_bounds_of_every_model() {
        for model in brdf::MODELS {
            let (lower, upper) = brdf::flat_bounds(model.parameters());
            for (name, start) in starts(*model) {
                assert_eq!(start.len(), lower.len());
                let inside = start.iter().zip(lower.iter().zip(&upper)).all(|(x, (l, u))| l <= x && x <= u);
                assert!(inside, "{} {name} {start:?}", model.name());
            }
        }
        assert_eq!(starts(brdf::DEFAULT_MODEL)[1].1, [0.3, 0.3, 0.3, 0.04, 0.04, 0.04, 1.0, 0.05]);
    }
}
