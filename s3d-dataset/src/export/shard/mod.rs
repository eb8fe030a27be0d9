//! A shard: one of several processes, on any machines, that share the work of an export. Each finds out by
//! itself which part is its own, and does it.

pub(crate) mod assignment;
pub(crate) mod make_plan;
pub(crate) mod merge;

use crate::account::Account;
use crate::context::Context;
use crate::error::Result;
use crate::export::input::memory::SceneSource;
use crate::export::job::{Job, Labelled, Scope};
use crate::export::plan::Plan;
use crate::export::run::{Run, Target};
use crate::export::shard::assignment::{Assignment, Shard, assets_cost, location_cost, photograph_cost};
use crate::export::views::select_requested;
use crate::options::ExportOptions;
use crate::record::journal::{Done, Journal, Unit};
use crate::record::label_list::LabelList;
use crate::record::unfinished::is_chosen;
use crate::store::lock::Sharing;
use crate::summary::{Summary, UnitTally, ViewTally};
use crate::survey::candidate::Candidate;
use s3d_io::dataset::Layout;
use s3d_io::fs::Checksum;
use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

/// Does a shard's part of an export into OUT, which other shards may share. OUT is no data set until it is
/// merged. Returns `None` if there is nothing to do.
pub(crate) fn export_shard(
    ctx: &Context,
    scenes: &[SceneSource],
    target: &Target<'_>,
    options: &ExportOptions,
    shard: Shard,
    plan: Option<&Plan>,
) -> Result<Option<Summary>> {
    let run = Run::new(ctx, target);
    let layout = run.layout();
    let root = layout.root().display();
    let state = run.look()?;
    let job = Job::open(scenes, layout, &state, options, plan, &run.account)?;
    let Some(session) = run.begin(&state, &job.request, &job.manifest(), Sharing::Shards)? else {
        return Ok(None);
    };

    let Some(views) = job.run_shard(layout, &session.journal, &run.account, shard)? else {
        ctx.info(format_args!("{root}: shard {shard} was done before; nothing to do"));
        return Ok(None);
    };

    let locations = session.journal.finished().count_locations(&job.request.numbers());
    drop(session);
    ctx.info(format_args!("{root}: shard {shard} is done; when all are, `s3d merge` makes the data set"));
    Ok(Some(run.summarize(&job.request, locations, views, None)))
}

impl Job<'_> {
    /// Does the units of a shard that are not done yet. Returns what became of the candidate views of the
    /// whole export; `None` if all units of the shard were done before.
    fn run_shard(
        &self,
        layout: &Layout,
        journal: &Journal,
        account: &Account<'_>,
        shard: Shard,
    ) -> Result<Option<ViewTally>> {
        let ctx = account.ctx;
        // A shard that is run again knows its units before anything is labelled.
        if let Some(assignment) = Assignment::read(layout, shard.of) {
            let own = assignment.own(shard.number);
            journal.check(ctx, layout, |unit| own.contains(unit))?;
            let finished = journal.finished();
            if own.iter().all(|unit| finished.has(unit)) {
                return Ok(None);
            }
        }

        let cache = layout.work_dir();
        LabelList::of(&self.inputs.table).write(&LabelList::path(layout))?;
        let positions: BTreeMap<u32, usize> = self.request.numbers().into_iter().zip(0..).collect();
        // With a plan, every shard writes down its share of the scores, for the merge. Without one, every
        // shard has made all scores.
        let is_ours = |unit: &Unit| match unit {
            Unit::Labels(area) => positions.get(area).is_some_and(|position| shard.takes(*position)),
            Unit::Scores(_, uuid) => self.plan.is_none() || keeper(uuid, shard.of) == shard.number,
            Unit::Location(..) | Unit::Photograph(..) | Unit::Assets(_) => false,
        };

        journal.check(ctx, layout, |unit| matches!(unit, Unit::Labels(_)) && is_ours(unit))?;
        let labelled = self.label(self.common(layout, journal, account, &cache, &is_ours), Scope::All)?;
        let (candidates, views) = select_requested(&self.request, &journal.finished())?;
        let assignment = self.assignment(&labelled, &candidates, shard.of);
        assignment.write(layout)?;

        let own = assignment.own(shard.number);
        take_own(layout, journal, account, &own)?;

        let is_ours = |unit: &Unit| own.contains(unit);
        self.render(self.common(layout, journal, account, &cache, &is_ours), &labelled, &candidates)?;
        Ok(Some(views))
    }

    /// Assigns all units to so many shards, in the same way in each of them.
    fn assignment(&self, labelled: &Labelled<'_>, candidates: &[Candidate], shards: u32) -> Assignment {
        let options = &self.request.options;
        let mut kept: BTreeMap<(u32, &str), u64> = BTreeMap::new();
        for c in candidates.iter().filter(|c| c.frame_num.is_some()) {
            *kept.entry((c.area, c.camera_uuid.as_str())).or_default() += 1;
        }

        let plans = || labelled.areas.iter().flatten();
        let mut units = Vec::new();

        for plan in plans() {
            let points = (plan.mesh_area_m2 * options.points_per_m2) as u64;
            let faces = plan.annotated.label_of_face.len() as u64;
            units.push((Unit::Assets(plan.area), assets_cost(faces, points)));

            for location in plan.locations.iter().filter(|l| is_chosen(&self.request, &l.uuid)) {
                let views = kept.get(&(plan.area, location.uuid.as_str())).copied().unwrap_or(0);
                let cost = location_cost(options.pano_width, options.size, views);
                units.push((Unit::Location(plan.area, location.uuid.clone()), cost));
            }
        }

        for area in &self.inputs.areas {
            for photograph in area
                .photographs
                .all
                .iter()
                .filter(|p| is_chosen(&self.request, &p.uuid))
            {
                let cost = photograph_cost(&photograph.camera);
                units.push((Unit::Photograph(area.number, photograph.uuid.clone()), cost));
            }
        }

        let mut assignment = Assignment::new(units, shards);
        for (position, plan) in plans().enumerate() {
            assignment.assign(Unit::Labels(plan.area), (position % shards as usize) as u32 + 1);
            for location in &plan.locations {
                assignment
                    .assign(Unit::Scores(plan.area, location.uuid.clone()), keeper(&location.uuid, shards));
            }
        }
        assignment
    }
}

/// The number of the shard that keeps the scores of a location.
fn keeper(uuid: &str, shards: u32) -> u32 {
    (Checksum::of(uuid.as_bytes()).0 % u128::from(shards)) as u32 + 1
}

/// Checks the units of this shard that an earlier run, or another shard, has done, and takes them as they
/// are.
fn take_own(layout: &Layout, journal: &Journal, account: &Account<'_>, own: &BTreeSet<Unit>) -> Result<()> {
    let ctx = account.ctx;
    let started = Instant::now();
    let is_own = |unit: &Unit| own.contains(unit) && !matches!(unit, Unit::Scores(..));
    journal.check(ctx, layout, is_own)?;
    let finished = journal.finished();
    let taken: Vec<&Done> = finished.iter().filter(|done| is_own(&done.unit())).collect();
    let tally: UnitTally = taken.iter().map(|done| done.tally()).sum();
    if !taken.is_empty() {
        account.units_taken(taken.len() as u64, &tally, started);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_are_kept_by_every_shard_alike() {
        let mut kept = [0; 7];
        for i in 0..700u32 {
            kept[keeper(&format!("{i:032x}"), 7) as usize - 1] += 1;
        }
        assert!(kept.iter().all(|n| (50..150).contains(n)), "{kept:?}");
        assert_eq!(keeper("a", 1), 1);
    }
}
