//! The fits as parts of the run: the supply takes them from the loader, and passes those that have ended to the writers of results.

use super::{
    backlog::Load,
    board::Board,
    check::Checked,
    lights::Lights,
    loader::{Loaded, Loader, Shelf},
    prepare::Prepared,
    results::{Fitted, Inputs, Writers, Written},
    window::Window,
};
use crate::{
    outputs::OutFolder,
    settings::{BatchFit, StageTwo},
};
use lookalike::{
    graph::{Next, Part, PartFailure, Parts, PlanError},
    plan::FitPlanner,
};
use std::{collections::BTreeMap, sync::Arc};
use tokio::sync::Notify;

/// The parameters of a [`Supply`].
#[derive(Debug)]
pub(super) struct SupplyOptions {
    pub(super) fits: Arc<[BatchFit]>,
    /// The numbers of the fits that have no results yet, in order.
    pub(super) open: Arc<[u32]>,
    /// One result per fit.
    pub(super) checks: Arc<[Checked]>,
    pub(super) lights: Arc<Lights>,
    pub(super) board: Arc<Board>,
    pub(super) window: Window,
    pub(super) stage_two: StageTwo,
    pub(super) is_fail_fast: bool,
    pub(super) out: OutFolder,
    pub(super) out_name: String,
    /// Notified whenever there may be another fit to begin.
    pub(super) wake: Arc<Notify>,
}

/// The fits of a batch as the parts of its run.
#[derive(Debug)]
pub(super) struct Supply {
    options: SupplyOptions,
    loader: Loader,
    /// How many fits the loader has delivered.
    taken: usize,
    active: BTreeMap<u32, Active>,
    writers: Writers,
}

/// Data of a running fit that its results will need.
#[derive(Debug)]
struct Active {
    inputs: Inputs,
    pixels: usize,
}

impl Supply {
    /// The supply, and a handle that waits until all results are written. The supply must be dropped before that wait.
    pub(super) fn new(options: SupplyOptions) -> anyhow::Result<(Self, Written)> {
        let loader = Loader::start(Shelf {
            fits: Arc::clone(&options.fits),
            open: Arc::clone(&options.open),
            checks: Arc::clone(&options.checks),
            lights: Arc::clone(&options.lights),
            stage_two: options.stage_two,
            wake: Arc::clone(&options.wake),
        })?;
        let (writers, written) = Writers::new(
            Arc::clone(&options.board),
            options.out.clone(),
            options.out_name.clone(),
            Arc::clone(&options.wake),
        );
        Ok((Self { options, loader, taken: 0, active: BTreeMap::new(), writers }, written))
    }

    /// The part of a loaded fit; `None` if its inputs have become unusable.
    fn begin(&mut self, (number, loaded): Loaded) -> Result<Option<Part<FitPlanner>>, PlanError> {
        self.taken += 1;
        let fit = &self.options.fits[number as usize];
        let prepared = match loaded {
            Ok(prepared) => *prepared,
            Err(error) => {
                self.give_up(number, &format!("{error:#}"))?;
                return Ok(None);
            }
        };
        let pixels = prepared.pixels();
        let Prepared { capture, methods, exposure, inputs, planner, seconds, .. } = prepared;
        self.options.board.started(number, planner.best(), seconds);
        let inputs = Inputs { capture, methods, exposure, inputs, max_cssim: fit.max_cssim };
        self.active.insert(number, Active { inputs, pixels });
        Ok(Some(Part { number, name: fit.name.clone(), planner, stays: false }))
    }

    /// Whether the next fit should begin beside those that are in memory.
    fn has_room(&self, there: Load, ready: usize) -> bool {
        let next = self.options.open.get(self.taken).and_then(|next| self.options.checks.get(*next as usize));
        next.is_none_or(|next| self.options.window.has_room(there, ready, next.pixels))
    }

    fn give_up(&mut self, number: u32, error: &str) -> Result<(), PlanError> {
        self.options.board.failed(number, error);
        self.check_failures()
    }

    /// With `--fail-fast`, the error that ends the run once any fit has failed.
    fn check_failures(&self) -> Result<(), PlanError> {
        if self.options.is_fail_fast && self.options.board.stop_if_failed() {
            return Err(PlanError::new("a fit failed, and --fail-fast ends the batch then"));
        }
        Ok(())
    }
}

impl Parts for Supply {
    type Planner = FitPlanner;

    fn next(&mut self, wait: bool) -> Result<Next<FitPlanner>, PlanError> {
        loop {
            if wait {
                // No other fit is running, but fits that are being written take memory.
                self.writers.backlog().wait_until(|load| self.has_room(load, 0));
            }
            self.check_failures()?;
            let loaded = if wait { self.loader.wait().ok_or(true) } else { self.loader.look() };
            match loaded {
                Ok(loaded) => {
                    if let Some(part) = self.begin(loaded)? {
                        return Ok(Next::Part(Box::new(part)));
                    }
                }
                Err(true) if self.taken < self.options.open.len() => {
                    return Err(PlanError::new("the thread that reads inputs ended too early; please report this"));
                }
                Err(true) => return Ok(Next::End),
                Err(false) => return Ok(Next::NotYet),
            }
        }
    }

    fn wants_more(&self, active: usize, ready: usize) -> bool {
        let pixels = self.active.values().map(|active| active.pixels).sum();
        self.has_room(Load { fits: active, pixels } + self.writers.backlog().load(), ready)
    }

    fn completed(&mut self, part: Part<FitPlanner>) -> Result<(), PlanError> {
        let Some(active) = self.active.remove(&part.number) else { return Ok(()) };
        match part.planner.into_outcome() {
            Some(outcome) => {
                let timing = self.options.board.computed(part.number);
                let fitted = Fitted { number: part.number, name: part.name, inputs: active.inputs, outcome, timing };
                self.writers.write(fitted);
                self.check_failures()
            }
            None => self.give_up(part.number, "its nodes ended without a result: please report this"),
        }
    }

    fn failed(&mut self, part: Part<FitPlanner>, failure: PartFailure) -> Result<(), PlanError> {
        self.active.remove(&part.number);
        self.give_up(part.number, &failure.to_string())
    }

    fn newly_safe(&mut self, is_last: bool) -> Vec<u32> {
        if is_last {
            self.writers.backlog().wait_until(|load| load.fits == 0);
        }
        self.writers.newly_safe()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        batch::{board::Watchers, window::Demand},
        outputs::{Claim, ClaimedFolder},
        progress::{Shape, display},
        settings::{OldFiles, ProgressKind},
    };
    use lookalike_coordinator::journal::PartLedger;
    use serde_json::Value;
    use std::path::PathBuf;

    /// A supply whose next fit has this many pixels, for one worker of one thread.
    fn supply(out: &OutFolder, pixels: usize) -> Supply {
        let watchers = Watchers {
            display: display(ProgressKind::None, Shape::OneFit, PathBuf::new()),
            metrics: None,
            ledger: PartLedger::default(),
        };
        let board = Arc::new(Board::new(&[], Vec::new(), watchers, out.clone()).unwrap());
        let options = SupplyOptions {
            fits: Arc::new([]),
            open: Arc::new([]),
            checks: Arc::new([Checked { inputs: Value::Null, pixels, identity: Vec::new() }]),
            lights: Arc::default(),
            board,
            window: Window::new(Arc::new(Demand::expecting(1)), StageTwo::Workers),
            stage_two: StageTwo::Workers,
            is_fail_fast: false,
            out: out.clone(),
            out_name: String::new(),
            wake: Arc::default(),
        };
        let (mut supply, _) = Supply::new(options).unwrap();
        supply.options.open = Arc::new([0]);
        supply
    }

    #[test]
    fn fits_being_written_occupy_the_backlog() {
        let folder = tempfile::tempdir().unwrap();
        let supply = {
            let claim = Claim::of_fit(folder.path(), OldFiles::Refuse);
            supply(&ClaimedFolder::take(&claim).unwrap().begin().unwrap(), 1 << 20)
        };
        assert!(supply.wants_more(1, 0));
        let one = supply.writers.backlog().add(1);
        assert!(!supply.wants_more(1, 0), "one under way and one being written are two for one thread");
        assert!(supply.wants_more(0, 0));
        drop(one);
        assert!(supply.wants_more(1, 0));
        let large = supply.writers.backlog().add(2 << 20);
        assert!(!supply.wants_more(0, 0), "more than memory holds");
        drop(large);
        assert!(supply.wants_more(0, 0));
    }
}
