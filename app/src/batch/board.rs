//! The state of every fit of a batch. Any thread may report a change; the board passes it on to the display, the metrics and
//! the summaries.

use super::{
    row::{Row, STATES, Scores, State},
    summary::{self, Summary},
};
use crate::{
    exit::Exit,
    outputs::{OutFolder, Timing},
    progress::{Display, Ending, PartCount, PartEvent, PartScores},
    run::{Clock, FITS},
    settings::BatchFit,
};
use lookalike::fit::BestScore;
use lookalike_coordinator::{events::RunEvent, journal::PartLedger, metrics::Metrics};
use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Instant,
};
use tracing::warn;

/// The state of every fit.
pub(super) struct Board {
    inner: Mutex<Inner>,
    out: OutFolder,
    /// Held while the summaries are written, so that an older one never replaces a newer one.
    writing: Mutex<()>,
}

/// The receivers of changes.
pub(super) struct Watchers {
    pub(super) display: Box<dyn Display>,
    pub(super) metrics: Option<Metrics>,
    /// The journal.
    pub(super) ledger: PartLedger,
}

struct Inner {
    rows: Vec<Row>,
    /// The clocks of running fits.
    clocks: BTreeMap<u32, FitClock>,
    watchers: Watchers,
    workers_joined: usize,
    /// The state of the run: `running`, `finished` or `stopped`.
    state: &'static str,
    /// Whether a failed fit has ended the run.
    is_stopped: bool,
    began: Instant,
}

/// The cost of a fit so far.
#[derive(Debug)]
struct FitClock {
    clock: Clock,
    input_seconds: f64,
    attempts: u64,
    requeued: u64,
}

impl Board {
    /// A board whose fits are waiting or complete; complete ones have scores and seconds. Writes the first summaries.
    pub(super) fn new(
        fits: &[BatchFit],
        complete: Vec<Option<(Scores, f64)>>,
        watchers: Watchers,
        out: OutFolder,
    ) -> anyhow::Result<Self> {
        let row = |(fit, complete): (&BatchFit, Option<(Scores, f64)>)| {
            let (scores, seconds) = complete.unzip();
            Row {
                name: fit.name.clone(),
                photo: fit.capture.photo.to_string_lossy().into_owned(),
                env: fit.capture.environment.path.to_string_lossy().into_owned(),
                models: fit.methods.clone(),
                state: scores.map_or(State::Waiting, State::Done),
                seconds,
            }
        };
        let inner = Inner {
            rows: fits.iter().zip(complete).map(row).collect(),
            clocks: BTreeMap::new(),
            watchers,
            workers_joined: 0,
            state: "running",
            is_stopped: false,
            began: Instant::now(),
        };
        (0..).zip(&inner.rows).for_each(|(number, row)| inner.watchers.ledger.tell(row.journal_row(number)));
        inner.show_metrics();
        let board = Self { inner: Mutex::new(inner), out, writing: Mutex::new(()) };
        board.write_summaries()?;
        Ok(board)
    }

    /// Processes an event of the run.
    pub(super) fn note(&self, event: &RunEvent) {
        let mut inner = self.lock();
        inner.workers_joined += usize::from(matches!(event, RunEvent::WorkerJoined { .. }));
        if let Some(clock) = inner.clock_of(event) {
            clock.clock.note(event);
            clock.attempts += u64::from(matches!(event, RunEvent::NodeStarted { .. }));
            clock.requeued += u64::from(matches!(event, RunEvent::NodeRequeued { .. }));
        }
        inner.watchers.display.event(event);
    }

    /// A fit begins: its inputs are loaded, which took this many seconds.
    pub(super) fn started(&self, number: u32, best: Arc<BestScore>, input_seconds: f64) {
        let mut inner = self.lock();
        let clock = FitClock { clock: Clock::start(), input_seconds, attempts: 0, requeued: 0 };
        inner.clocks.insert(number, clock);
        inner.set(number, State::Running);
        let name = inner.name(number);
        inner.show(number, &PartEvent::Started { number, name, best });
    }

    /// The nodes of a fit have ended. Returns the time they took and the attempts.
    pub(super) fn computed(&self, number: u32) -> Timing {
        let mut inner = self.lock();
        let workers = inner.workers_joined;
        let Some(clock) = inner.clocks.get_mut(&number) else { return Timing::default() };
        clock.clock.end();
        let mut seconds = vec![("inputs", clock.input_seconds)];
        seconds.extend(clock.clock.stages());
        seconds.push(("total", clock.input_seconds + clock.clock.total()));
        let (attempts, requeued) = (clock.attempts, clock.requeued);
        Timing { seconds, workers, attempts, requeued, ..Timing::default() }
    }

    /// The results of a fit are written.
    pub(super) fn finished(self: &Arc<Self>, number: u32, scores: Scores) {
        let mut inner = self.lock();
        let Scores { cssim, cssim_object, judge, is_missed, .. } = scores;
        inner.set(number, State::Done(scores));
        let name = inner.name(number);
        let seconds = inner.end(number);
        let scores = Some(PartScores { cssim, cssim_object, judge, is_missed, seconds });
        let event = PartEvent::Finished { number, name, scores };
        inner.show(number, &event);
        drop(inner);
        self.write_summaries_soon();
    }

    /// A fit has failed.
    pub(super) fn failed(self: &Arc<Self>, number: u32, error: &str) {
        let mut inner = self.lock();
        inner.set(number, State::Failed(error.to_owned()));
        let name = inner.name(number);
        inner.end(number);
        inner.show(number, &PartEvent::Failed { number, name, error: error.to_owned() });
        drop(inner);
        self.write_summaries_soon();
    }

    /// Whether a fit has failed. If so, notes that the run ends because of it.
    pub(super) fn stop_if_failed(&self) -> bool {
        let mut inner = self.lock();
        inner.is_stopped |= inner.count().failed > 0;
        inner.is_stopped
    }

    /// Whether the run was ended because a fit had failed.
    pub(super) fn was_stopped_by_a_fit(&self) -> bool {
        self.lock().is_stopped
    }

    /// The problem to report at the end, if fits are left without results.
    pub(super) fn problem(&self) -> Option<String> {
        let PartCount { total, done, .. } = self.lock().count();
        match (total, total - done) {
            (_, 0) => None,
            (1, _) => Some("the fit failed".to_owned()),
            (_, failed) => Some(format!("{failed} of {total} fits failed")),
        }
    }

    /// Writes the last summaries. No fit may change any more.
    ///
    /// # Errors
    /// If they cannot be written.
    pub(super) fn close(&self) -> anyhow::Result<()> {
        let mut inner = self.lock();
        for row in &mut inner.rows {
            if matches!(row.state, State::Waiting | State::Running) {
                row.state = State::Stopped;
            }
        }
        inner.show_metrics();
        let is_whole = inner.rows.iter().all(|row| !matches!(row.state, State::Stopped));
        inner.state = if is_whole { "finished" } else { "stopped" };
        drop(inner);
        self.write_summaries()
    }

    /// Reports the end of the run, after everything is written.
    pub(super) fn end(&self, ending: Ending<'_>) {
        self.lock().watchers.display.finish(ending);
    }

    /// The table to print at the end.
    pub(super) fn table(&self) -> String {
        self.summary().table()
    }

    /// The exit code for the states of the fits.
    pub(super) fn exit(&self) -> Exit {
        exit(&self.lock().count())
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        // Each change is complete before any call that could panic.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn summary(&self) -> Summary {
        let inner = self.lock();
        let (rows, count, state) = (inner.rows.clone(), inner.count(), inner.state);
        Summary { rows, count, state, seconds: inner.began.elapsed().as_secs_f64() }
    }

    /// Writes the summaries on another thread, so that the caller does not wait for the disk.
    fn write_summaries_soon(self: &Arc<Self>) {
        let board = Arc::clone(self);
        rayon::spawn(move || {
            if let Err(error) = board.write_summaries() {
                warn!("{error:#}");
            }
        });
    }

    /// Writes the summaries as of now. A late call, after the end of the run, writes the last ones again.
    fn write_summaries(&self) -> anyhow::Result<()> {
        let _writing = self.writing.lock().unwrap_or_else(PoisonError::into_inner);
        summary::write(&self.summary(), &self.out)
    }
}

impl Inner {
    fn name(&self, number: u32) -> String {
        self.rows.get(number as usize).map(|row| row.name.clone()).unwrap_or_default()
    }

    fn set(&mut self, number: u32, state: State) {
        if let Some(row) = self.rows.get_mut(number as usize) {
            row.state = state;
        }
    }

    /// Stops the clock of a fit. Returns its seconds.
    fn end(&mut self, number: u32) -> f64 {
        let clock = self.clocks.remove(&number);
        let seconds = clock.map(|clock| clock.input_seconds + clock.clock.total());
        if let Some(row) = self.rows.get_mut(number as usize) {
            row.seconds = seconds;
        }
        seconds.unwrap_or(0.0)
    }

    /// The clock of the fit that a node's event belongs to.
    fn clock_of(&mut self, event: &RunEvent) -> Option<&mut FitClock> {
        let name = match event {
            RunEvent::NodeStarted { name, .. }
            | RunEvent::NodeFinished { name, .. }
            | RunEvent::NodeRequeued { name, .. } => name,
            _ => return None,
        };
        self.clocks.get_mut(&name.part)
    }

    fn count(&self) -> PartCount {
        let mut count = PartCount { total: self.rows.len(), ..PartCount::default() };
        for row in &self.rows {
            match &row.state {
                State::Running => count.running += 1,
                State::Done(scores) => {
                    count.done += 1;
                    count.missed += usize::from(scores.is_missed);
                }
                State::Failed(_) => count.failed += 1,
                State::Waiting | State::Stopped => {}
            }
        }
        count
    }

    /// Reports a change of a fit to the journal, the metrics and the display.
    fn show(&mut self, number: u32, event: &PartEvent) {
        if let Some(row) = self.rows.get(number as usize) {
            self.watchers.ledger.tell(row.journal_row(number));
        }
        self.show_metrics();
        let count = self.count();
        self.watchers.display.part(event, count);
    }

    fn show_metrics(&self) {
        if let Some(metrics) = &self.watchers.metrics {
            let of = |state: &str| self.rows.iter().filter(|row| row.state.name() == state).count();
            metrics.set_parts(FITS, &STATES.map(|state| (state, of(state))));
        }
    }
}

/// The exit code of a batch: a failed fit takes precedence over one that missed its score.
fn exit(count: &PartCount) -> Exit {
    if count.failed > 0 {
        Exit::SomeFitsFailed
    } else if count.missed > 0 {
        Exit::MissedMaxCssim
    } else {
        Exit::Done
    }
}

impl std::fmt::Debug for Board {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Board").field("rows", &self.lock().rows.len()).finish_non_exhaustive()
    }
}
