//! The account of a running export: the time it takes, and what it makes.

use crate::context::Context;
use crate::event::{Event, UnitKind};
use crate::stage::Stage;
use crate::summary::{Summary, UnitTally, Unlabelled, ViewTally};
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// The account of a running export. Any thread can time stages and count units in it, and observers hear of
/// both.
pub(crate) struct Account<'c> {
    pub(crate) ctx: &'c Context,
    warnings_before: u64,
    started: Instant,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    stage_seconds: BTreeMap<Stage, f64>,
    tally: UnitTally,
}

impl<'c> Account<'c> {
    /// Opens the account at the start of an export.
    pub(crate) fn new(ctx: &'c Context) -> Self {
        Self { ctx, warnings_before: ctx.warnings(), started: Instant::now(), state: Mutex::default() }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a stage, of one area or of all areas together.
    pub(crate) fn stage(&self, stage: Stage, area: Option<u32>) -> StageTimer<'_> {
        self.ctx.tell(&Event::StageStarted { stage, area });
        StageTimer { account: self, stage, area, started: Instant::now() }
    }

    /// Counts a unit of work that is on the disk.
    pub(crate) fn unit_finished(
        &self,
        unit: UnitKind,
        area: u32,
        location: Option<&str>,
        tally: &UnitTally,
        started: Instant,
    ) {
        self.state().tally += *tally;
        let seconds = thousandths(started.elapsed().as_secs_f64());
        self.ctx
            .tell(&Event::UnitFinished { unit, area, location, tally, seconds });
    }

    /// Counts units of an earlier run, which were checked and are kept.
    pub(crate) fn units_taken(&self, units: u64, tally: &UnitTally, started: Instant) {
        self.state().tally += *tally;
        let seconds = thousandths(started.elapsed().as_secs_f64());
        self.ctx.tell(&Event::UnitsTaken { units, tally, seconds });
    }

    /// Sets the count of all files of the complete data set, with those that belong to no unit.
    pub(crate) fn set_files(&self, files: u64, bytes: u64) {
        let mut state = self.state();
        state.tally = UnitTally { files, bytes, ..state.tally };
    }

    /// Closes the account of a complete export, and reports its summary.
    pub(crate) fn summarize(
        self,
        output: &str,
        areas: usize,
        locations: usize,
        candidate_views: ViewTally,
        unlabelled: Option<Unlabelled>,
    ) -> Summary {
        let State { stage_seconds, tally } = self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        let summary = Summary {
            output: output.to_owned(),
            areas: areas as u64,
            locations: locations as u64,
            tally,
            candidate_views,
            unlabelled,
            warnings: self.ctx.warnings() - self.warnings_before,
            stage_seconds: stage_seconds
                .into_iter()
                .map(|(stage, s)| (stage, thousandths(s)))
                .collect(),
            seconds: thousandths(self.started.elapsed().as_secs_f64()),
        };

        self.ctx.tell(&Event::Summary(&summary));
        summary
    }
}

/// A stage in progress. A stage dropped without [`StageTimer::end`] has failed, and is not reported.
#[must_use = "a stage is counted when it ends"]
pub(crate) struct StageTimer<'a> {
    account: &'a Account<'a>,
    stage: Stage,
    area: Option<u32>,
    started: Instant,
}

impl StageTimer<'_> {
    /// Ends the stage.
    pub(crate) fn end(self) {
        let Self { account, stage, area, started } = self;
        let seconds = started.elapsed().as_secs_f64();
        *account.state().stage_seconds.entry(stage).or_default() += seconds;
        account
            .ctx
            .tell(&Event::StageFinished { stage, area, seconds: thousandths(seconds) });
    }
}

/// Rounds seconds to thousandths for reports.
fn thousandths(seconds: f64) -> f64 {
    (1000.0 * seconds).round() / 1000.0
}
