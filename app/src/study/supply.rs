//! The cells as parts of the run. A cell begins when the cells that it needs are complete and the workers have little to do. At
//! its end its record and its images are written.

use super::{
    cells::{Cell, CellId, Scene, Task, What},
    inputs::{Inputs, geometry},
    planner::{CellPlanner, Outcome},
    record::{self, Content, Match, Record},
};
use crate::progress::{PartCount, PartEvent};
use anyhow::{Context, anyhow};
use lookalike::{
    brdf,
    fit::{Compress, Method},
    graph::{Next, Part, PartFailure, Parts, Placement, PlanError},
    image::Image,
    math::sampling::{key, uniform},
    metric::auto_exposure,
    plan::{FitPlanner, PhotoPlanner, Subject, SurveyPlanner, SurveyRequest},
    scene::{Capture, CaptureInput},
};
use lookalike_report::measured::APART;
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

/// The state of the cells, for the display and for the end of the run.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// The number of cells in each state, without tables, which do not end before the run.
    pub(super) count: PartCount,
    /// Events that the display has not seen yet, each with the count after it.
    pub(super) news: Vec<(PartEvent, PartCount)>,
    /// The cells that failed, each with its error.
    pub(super) failed: Vec<String>,
}

impl Tally {
    fn note(&mut self, event: PartEvent) {
        self.news.push((event, self.count));
    }
}

/// The cells of a study as the parts of its run.
#[derive(Debug)]
pub(super) struct Supply {
    inputs: Arc<Inputs>,
    state: Vec<State>,
    records: BTreeMap<CellId, Record>,
    captures: BTreeMap<Scene, (Arc<Capture>, f64)>,
    /// Running cells, without those that last until the run ends.
    active: usize,
    safe: Vec<u32>,
    tally: Arc<Mutex<Tally>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    Waiting,
    Active,
    Complete,
    Failed,
}

/// The most cells that run at a time: enough to share the tables that several of them need.
const MOST_ACTIVE: usize = 48;

impl Supply {
    /// A supply of the cells that have no record yet.
    pub(super) fn new(inputs: Arc<Inputs>, tally: Arc<Mutex<Tally>>) -> anyhow::Result<Self> {
        let mut supply = Self {
            state: vec![State::Waiting; inputs.cells.len()],
            records: BTreeMap::new(),
            captures: BTreeMap::new(),
            active: 0,
            safe: Vec::new(),
            tally,
            inputs,
        };
        let inputs = Arc::clone(&supply.inputs);
        for (id, cell) in inputs.cells.iter().enumerate() {
            let Some(record) = record::read(&inputs.out, &cell.name)? else { continue };
            if let Task::Photo = cell.task {
                let Some(photo) = record::read_image(&inputs.out, &cell.name)? else { continue };
                supply.keep_photo(cell.scene, photo)?;
            }
            supply.records.insert(id, record);
            supply.state[id] = State::Complete;
        }
        supply.settle_tables();
        let ending = || inputs.cells.iter().enumerate().filter(|(_, cell)| !matches!(cell.task, Task::Table));
        let done = ending().filter(|(id, _)| supply.records.contains_key(id)).count();
        supply.tell(|tally| tally.count = PartCount { total: ending().count(), done, ..PartCount::default() });
        Ok(supply)
    }

    /// Whether there is nothing to compute.
    pub(super) fn is_complete(&self) -> bool {
        self.state.iter().all(|state| *state == State::Complete)
    }

    fn tell(&self, change: impl FnOnce(&mut Tally)) {
        change(&mut self.tally.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Marks tables as complete that no open cell needs, so that they are not computed again.
    fn settle_tables(&mut self) {
        let inputs = Arc::clone(&self.inputs);
        for (id, cell) in inputs.cells.iter().enumerate() {
            let is_needed =
                |other: usize| self.state[other] == State::Waiting && inputs.cells[other].needs.contains(&id);
            if matches!(cell.task, Task::Table) && !(0..inputs.cells.len()).any(is_needed) {
                self.state[id] = State::Complete;
            }
        }
    }

    fn keep_photo(&mut self, scene: Scene, photo: Image) -> anyhow::Result<()> {
        let light = &self.inputs.lights[scene.light];
        let environment = Arc::clone(&light.environment);
        let input = CaptureInput { photo, clipped: None, mask: None, geometry: geometry(scene.size)?, environment };
        let capture = Arc::new(Capture::new(input)?);
        let exposure = auto_exposure(capture.photo(), &capture.scoring_coverage())?;
        self.captures.insert(scene, (capture, exposure));
        Ok(())
    }

    /// The first cell that can begin.
    fn ready(&mut self) -> Option<CellId> {
        let inputs = Arc::clone(&self.inputs);
        for (id, cell) in inputs.cells.iter().enumerate() {
            if self.state[id] != State::Waiting {
                continue;
            }
            if let Some(&failed) = cell.needs.iter().find(|&&need| self.state[need] == State::Failed) {
                let needed = inputs.cells[failed].name.clone();
                self.give_up(id, &format!("it needs {needed}, which failed"));
                continue;
            }
            let is_there = |need: &CellId| match inputs.cells[*need].task {
                // A table runs until the run ends.
                Task::Table => self.state[*need] != State::Waiting,
                _ => self.state[*need] == State::Complete,
            };
            if cell.needs.iter().all(is_there) {
                return Some(id);
            }
        }
        None
    }

    fn give_up(&mut self, id: CellId, error: &str) {
        let was_active = std::mem::replace(&mut self.state[id], State::Failed) == State::Active;
        let cell = &self.inputs.cells[id];
        let (number, name, error) = (number(id), cell.name.clone(), error.to_owned());
        self.tell(|tally| {
            tally.failed.push(format!("{name}: {error}"));
            // The cells that need a table fail by name.
            if !matches!(cell.task, Task::Table) {
                tally.count.failed += 1;
                tally.count.running -= usize::from(was_active);
                tally.note(PartEvent::Failed { number, name, error });
            }
        });
    }

    fn planner(&self, id: CellId) -> anyhow::Result<CellPlanner> {
        let (inputs, cell) = (&*self.inputs, &self.inputs.cells[id]);
        let file = &inputs.study.file;
        let light = &inputs.lights[cell.scene.light];
        let photo = |subject, samples| {
            let spec = geometry(cell.scene.size)?.spec();
            let encoded = light.encoded.clone();
            Ok(CellPlanner::photo(PhotoPlanner::new(encoded, subject, spec, samples, file.seed)))
        };
        let survey = |request| {
            let (capture, exposure) = self.capture(cell.scene)?;
            let method = Method { model: brdf::model(&file.model)?, seed: file.seed, ..Method::default() };
            let planner = SurveyPlanner::new(capture, method, exposure, request)?;
            Ok(CellPlanner::survey(planner.with_encoded_light(light.encoded.clone())))
        };
        match &cell.task {
            Task::Photo => photo(Subject::Measured(inputs.materials[cell.scene.material].clone()), file.photo_samples),
            Task::Direct { of, candidate, samples } => {
                let Some(Content::Fit { candidates, .. }) = self.content(*of) else { return Err(missing(cell)) };
                let point = candidates.get(*candidate).or(candidates.last()).ok_or_else(|| missing(cell))?;
                photo(Subject::Model(file.model.clone(), point.parameters.clone()), *samples)
            }
            Task::Table => survey(SurveyRequest::default()),
            Task::Fit(task) => {
                let (capture, exposure) = self.capture(cell.scene)?;
                let mut method = task.method.clone();
                if task.is_clamped {
                    method.compress = Compress::ClampTo { white: 1.0 / exposure };
                }
                let planner = FitPlanner::new(capture, method, exposure)?.judging_on(Placement::Worker);
                let planner = planner.also_render(&[1.0, 3.0]).with_encoded_light(light.encoded.clone());
                Ok(CellPlanner::fit(if task.is_shared { planner.judging_on_whole_range() } else { planner }))
            }
            Task::Brute { starts, direct } => {
                let starts = starts.iter().map(|(_, start)| start.clone()).collect();
                survey(SurveyRequest { starts, direct: *direct, ..SurveyRequest::default() })
            }
            Task::LowRes => {
                let model = brdf::model(&file.model)?.parameters();
                let start = model.iter().flat_map(|p| std::iter::repeat_n(p.start, p.channels.count())).collect();
                survey(SurveyRequest { starts: vec![start], ..SurveyRequest::default() })
            }
            Task::Appraise { pictures, .. } => {
                let (points, pictures) = (self.points(cell)?, *pictures);
                survey(SurveyRequest { points, pictures, gammas: vec![1.0], ..SurveyRequest::default() })
            }
            Task::Agreement { .. } => {
                let gammas = Method::default().gammas;
                survey(SurveyRequest { points: self.points(cell)?, gammas, ..SurveyRequest::default() })
            }
        }
    }

    fn capture(&self, scene: Scene) -> anyhow::Result<(Arc<Capture>, f64)> {
        self.captures.get(&scene).cloned().context("a cell began before its photo was there: please report this")
    }

    fn content(&self, id: CellId) -> Option<&Content> {
        self.records.get(&id).map(|record| &record.content)
    }

    /// The parameter vectors that a cell appraises.
    fn points(&self, cell: &Cell) -> anyhow::Result<Vec<Vec<f64>>> {
        match &cell.task {
            Task::Appraise { of, .. } => {
                of.iter().map(|(id, what)| self.found(*id, *what).ok_or_else(|| missing(cell))).collect()
            }
            Task::Agreement { of } => {
                let mut points: Vec<Vec<f64>> = Vec::new();
                for content in of.iter().filter_map(|id| self.content(*id)) {
                    match content {
                        Content::Fit { candidates, polished, .. } => {
                            points.extend(candidates.iter().chain(polished).map(|found| found.parameters.clone()));
                        }
                        Content::Survey { minima, .. } => points.extend(minima.iter().map(|m| m.parameters.clone())),
                        Content::Photo { .. } | Content::Table => {}
                    }
                }
                let polished = of.first().and_then(|id| self.found(*id, What::Polished));
                points.extend(around(&polished.ok_or_else(|| missing(cell))?, &self.inputs.study.file.model)?);
                Ok(points)
            }
            _ => Ok(Vec::new()),
        }
    }

    fn found(&self, id: CellId, what: What) -> Option<Vec<f64>> {
        let content = self.content(id)?;
        let found = match (content, what) {
            (Content::Fit { candidates, winner, .. }, What::Winner) => candidates.get(*winner)?,
            (Content::Fit { polished, .. }, What::Polished) => polished.as_ref()?,
            (Content::Fit { candidates, .. }, What::L2) => candidates.iter().find(|c| c.gamma == Some(1.0))?,
            (Content::Fit { candidates, winner, .. }, What::RunnerUp) => {
                let won = candidates.get(*winner)?.gamma?;
                let far = |found: &&Match| found.gamma.is_some_and(|gamma| (gamma - won).abs() >= APART);
                candidates.iter().filter(far).min_by(|a, b| a.cssim.total_cmp(&b.cssim))?
            }
            (Content::Survey { .. }, What::Minimum) => content.minimum()?,
            _ => return None,
        };
        Some(found.parameters.clone())
    }

    /// Writes what a cell has computed.
    fn keep(&mut self, id: CellId, planner: CellPlanner) -> anyhow::Result<()> {
        let inputs = Arc::clone(&self.inputs);
        let cell = &inputs.cells[id];
        let (work, outcome) = planner.into_outcome();
        let outcome = outcome.context("its nodes ended without a result: please report this")?;
        super::pictures::write(&inputs, cell, &outcome, |scene| self.captures.get(&scene).map_or(1.0, |c| c.1))?;
        let record = Record {
            work: work.into_iter().map(|(label, work)| (label, work.into())).collect(),
            content: Content::of(&outcome, self.points(cell)?),
        };
        if let (Task::Photo, Outcome::Photo(image, _)) = (&cell.task, outcome) {
            record::write_image(&inputs.out, &cell.name, &image)?;
            self.keep_photo(cell.scene, image)?;
        }
        record::write(&inputs.out, &cell.name, &record)?;
        self.records.insert(id, record);
        Ok(())
    }
}

impl Parts for Supply {
    type Planner = CellPlanner;

    fn next(&mut self, _wait: bool) -> Result<Next<CellPlanner>, PlanError> {
        while let Some(id) = self.ready() {
            match self.planner(id) {
                Ok(planner) => {
                    self.state[id] = State::Active;
                    let stays = matches!(self.inputs.cells[id].task, Task::Table);
                    self.active += usize::from(!stays);
                    let (number, name) = (number(id), self.inputs.cells[id].name.clone());
                    if !stays {
                        let started = PartEvent::Started { number, name: name.clone(), best: planner.best() };
                        self.tell(|tally| {
                            tally.count.running += 1;
                            tally.note(started);
                        });
                    }
                    return Ok(Next::Part(Box::new(Part { number, name, planner, stays })));
                }
                Err(error) => self.give_up(id, &format!("{error:#}")),
            }
        }
        let is_over = !self.state.contains(&State::Waiting);
        Ok(if is_over { Next::End } else { Next::NotYet })
    }

    fn wants_more(&self, _active: usize, ready: usize) -> bool {
        ready < 2 * self.inputs.workers + 2 && self.active < MOST_ACTIVE
    }

    fn completed(&mut self, part: Part<CellPlanner>) -> Result<(), PlanError> {
        let id = part.number as usize;
        self.active -= 1;
        match self.keep(id, part.planner) {
            Ok(()) => {
                self.state[id] = State::Complete;
                self.safe.push(part.number);
                self.tell(|tally| {
                    tally.count.running -= 1;
                    tally.count.done += 1;
                    tally.note(PartEvent::Finished { number: part.number, name: part.name, scores: None });
                });
            }
            Err(error) => self.give_up(id, &format!("{error:#}")),
        }
        Ok(())
    }

    fn failed(&mut self, part: Part<CellPlanner>, failure: PartFailure) -> Result<(), PlanError> {
        let id = part.number as usize;
        self.active -= usize::from(!part.stays);
        self.give_up(id, &failure.to_string());
        Ok(())
    }

    fn newly_safe(&mut self, _is_last: bool) -> Vec<u32> {
        std::mem::take(&mut self.safe)
    }
}

/// Points around a match: each parameter is moved by up to a fifth of its range, decreasing from point to point.
fn around(point: &[f64], model: &str) -> anyhow::Result<Vec<Vec<f64>>> {
    const COUNT: u64 = 40;
    let (lower, upper) = brdf::flat_bounds(brdf::model(model)?.parameters());
    let moved = |n: u64| {
        let reach = 0.2 * (1.0 - n as f64 / COUNT as f64);
        let one = |i: usize| {
            let turn = 2.0 * uniform(key(&[n, i as u64])) - 1.0;
            (point[i] + turn * reach * (upper[i] - lower[i])).clamp(lower[i], upper[i])
        };
        (0..point.len()).map(one).collect()
    };
    Ok((0..COUNT).map(moved).collect())
}

fn number(id: CellId) -> u32 {
    u32::try_from(id).unwrap_or(u32::MAX)
}

fn missing(cell: &Cell) -> anyhow::Error {
    anyhow!("{}: a cell that it needs has no such match; please report this", cell.name)
}
