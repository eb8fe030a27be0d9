//! The export: load → label → sample → score → select → render → tables. The one place that composes the stages.
//!
//! An export is [begun](output::begin) or gone on with in OUT, its units of work are done ([`Job::label`], then
//! [`Job::render`]) and written down in the journal, and then [finished](finish::finish).

pub(crate) mod annotate;
mod area;
mod area_plan;
mod aside;
pub(crate) mod assets;
mod checked;
pub(crate) mod deal;
pub(crate) mod finish;
pub(crate) mod images;
pub(crate) mod inputs;
pub(crate) mod journal;
mod label_list;
pub(crate) mod listing;
pub(crate) mod location;
pub(crate) mod lock;
pub(crate) mod manifest;
mod merge;
pub(crate) mod modality;
pub(crate) mod output;
pub(crate) mod overlap;
pub(crate) mod pictures;
pub(crate) mod place;
pub(crate) mod plan;
pub(crate) mod points;
pub(crate) mod profiles;
pub(crate) mod records;
pub(crate) mod request;
mod shard;
pub(crate) mod statistics;
pub(crate) mod summary;
mod transfer;
pub(crate) mod views;
pub(crate) mod work;

pub(crate) use area::locate;
pub(crate) use merge::merge;
pub(crate) use shard::export_shard;

use crate::args::ExportOptions;
use crate::event::Stage as Step;
use crate::failure::{Failure, Outcome};
use crate::stop;
use area::{Common, Stage};
use area_plan::AreaPlan;
use finish::{Made, finish, missing_units};
use inputs::{AreaInput, Cameras, Inputs};
use journal::{Journal, Unit};
use manifest::Manifest;
use output::Begin;
use pictures::Pictures;
use plan::Plan;
use points::check_density;
use request::{Request, requested_areas};
use s3d_geom::NearestFaces;
use s3d_io::{Domain, Layout, MeshFile, SyncAhead};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use summary::Account;
use tracing::{debug, info, warn};
use views::{Candidate, select_requested};

/// What an export writes to.
pub(crate) struct Target<'a> {
    pub(crate) layout: Layout,
    /// Whether OUT may hold something already.
    pub(crate) overwrite: bool,
    /// Names in OUT that do not count as something.
    pub(crate) allowed: &'a [&'a str],
}

/// An export whose input is open and checked.
pub(crate) struct Job<'a> {
    pub(crate) inputs: Inputs,
    /// What decides the bytes.
    pub(crate) request: Request,
    options: &'a ExportOptions,
    /// The pictures of each area, if colours are taken from some.
    pictures: Vec<Option<Pictures>>,
    /// The mesh, if there is one area.
    single: Option<MeshFile>,
    /// Where labels and scores come from, if they were made before.
    plan: Option<&'a Plan>,
}

/// What is known after labelling: by area, unless all of it was done before.
pub(crate) struct Labelled<'j> {
    single: Option<Stage<'j>>,
    areas: Vec<Option<AreaPlan>>,
}

/// Which areas are labelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scope {
    /// Those of which something is still to be done.
    Unfinished,
    All,
}

/// Turns scenes into a data set; with a plan, labels and scores are taken from there.
pub(crate) fn export(
    scenes: &[PathBuf],
    target: &Target<'_>,
    options: &ExportOptions,
    plan: Option<&Plan>,
) -> Outcome<()> {
    let account = Account::new();
    let layout = &target.layout;
    output::check(layout, target.overwrite, target.allowed)?;
    let job = Job::open(scenes, layout, options, plan, &account)?;
    let manifest = job.manifest();
    let session = match output::begin(layout, target.overwrite, &job.request, &manifest, &account)? {
        Begin::NothingToDo => {
            info!("{}: the data set is complete; nothing to do", layout.root().display());
            return Ok(());
        }
        Begin::Session(session) => session,
    };
    let made = job.run(layout, &session.journal, &account).and_then(|disk| {
        let tables = account.stage(Step::Tables, None);
        let made = finish(layout, &job.request, manifest, &session.journal.finished(), Some(disk))?;
        tables.end();
        Ok(made)
    });
    let made = session.end(made)?;
    tell_made(account, layout, &job.request, &made);
    Ok(())
}

/// Tells what a complete data set holds.
fn tell_made(account: Account, layout: &Layout, request: &Request, made: &Made) {
    account.set_files(made.files, made.bytes);
    account.summarize(&layout.root().display().to_string(), request.areas.len(), made.locations, made.views);
}

impl<'a> Job<'a> {
    /// Opens the input of an export into `layout`, and refuses what cannot be exported. Nothing is written.
    pub(crate) fn open(
        scenes: &[PathBuf],
        layout: &Layout,
        options: &'a ExportOptions,
        plan: Option<&'a Plan>,
        account: &Account,
    ) -> Outcome<Self> {
        let loading = account.stage(Step::Load, None);
        debug!("{options:?}");
        let (place, lenient) = (options.place_cameras, options.lenient);
        let inputs = match plan {
            Some(plan) => Inputs::open_planned(scenes, place, lenient, plan.table()?)?,
            None => Inputs::open(scenes, place, lenient)?,
        };
        check_only(&inputs, &options.only)?;
        output::check_inputs(layout, &inputs)?;
        check_label_count(inputs.table.len() - 1)?;
        let mut pictures = Vec::new();
        for area in &inputs.areas {
            pictures.push(area_pictures(area, options)?);
        }
        // Every mesh is read before OUT is touched, so that a bad one costs nothing that was there. That of a single area is
        // kept from then on; several are read again where they are needed, so that they never share memory.
        let mut single: Option<MeshFile> = None;
        let mut companions = Vec::new();
        for area in &inputs.areas {
            stop::check()?;
            let file = area.read_mesh()?;
            area.tell_mesh(&file);
            check_density(&file.mesh, options.points_per_m2)?;
            companions.push(file.companions.clone());
            single = (inputs.areas.len() == 1).then_some(file);
        }
        let known = plan.map(Plan::request);
        let request = Request::new(options, requested_areas(&inputs.areas, &companions, known)?);
        if let Some(plan) = plan {
            plan.refuse_other(&request)?;
            plan.require_complete()?;
        }
        loading.end();
        stop::check()?;
        Ok(Self { inputs, request, options, pictures, single, plan })
    }

    /// The manifest that says that this export runs.
    pub(crate) fn manifest(&self) -> Manifest {
        Manifest::begin(&self.request, self.inputs.table.len())
    }

    /// Does all units that are not done yet. What it has written goes to the disk meanwhile, and on after it.
    fn run(&self, layout: &Layout, journal: &Journal, account: &Account) -> Outcome<SyncAhead> {
        let disk = SyncAhead::start(layout.root());
        self.write_assets(layout)?;
        let cache = layout.work_dir();
        let common = self.common(layout, journal, account, &cache, &|_| true);
        let labelled = self.label(common, Scope::Unfinished)?;
        let (candidates, _) = select_requested(&self.request, &journal.finished())?;
        let kept = candidates.iter().filter(|c| c.frame_num.is_some()).count();
        info!("selected {kept} of {} candidate views", candidates.len());
        self.render(common, &labelled, &candidates)?;
        disk.sync_now();
        Ok(disk)
    }

    /// Writes what is known before any unit is done: the label table, `assets`, `conventions.json`.
    pub(crate) fn write_assets(&self, layout: &Layout) -> Outcome<()> {
        let format = &self.options.format;
        let names = self.inputs.table.names();
        assets::write(layout, names, format.pad_labels.0, format.conventions())
    }

    fn common<'b>(
        &'b self,
        layout: &'b Layout,
        journal: &'b Journal,
        account: &'b Account,
        cache: &'b Path,
        is_ours: &'b (dyn Fn(&Unit) -> bool + Sync),
    ) -> Common<'b> {
        let (table, options) = (&self.inputs.table, self.options);
        Common { table, layout, options, journal, account, cache, is_ours }
    }

    /// Labels areas, those of which something is still to be done or all, and scores those of their locations that are not
    /// scored. The files of an area's labels are written if that unit is ours; if not, what it tells is known to the
    /// journal, but not written in it.
    fn label(&self, common: Common<'_>, scope: Scope) -> Outcome<Labelled<'_>> {
        let missing = missing_units(&self.request, &common.journal.finished());
        let is_needed = |area: u32| scope == Scope::All || missing.iter().any(|unit| unit.area() == area);
        let mut labelled = Labelled { single: None, areas: Vec::new() };
        for area in &self.inputs.areas {
            let plan = match self.plan {
                _ if !is_needed(area.number) => None,
                Some(plan) => Some(area::take_from_plan(area, plan, &common)?),
                None => Some(self.label_area(area, common, &mut labelled.single)?),
            };
            labelled.areas.push(plan);
        }
        let finished = common.journal.finished();
        let labels = self.request.areas.iter().filter_map(|a| finished.labels(a.area));
        only_known(labels.flat_map(|l| &l.locations).map(String::as_str), &self.options.only)?;
        Ok(labelled)
    }

    /// Labels an area, or takes it as it was labelled before, and scores what is ours and not scored. Its mesh, ready for
    /// rays, is kept in `single` if there is but one area.
    fn label_area<'j>(
        &'j self,
        area: &AreaInput,
        common: Common<'_>,
        single: &mut Option<Stage<'j>>,
    ) -> Outcome<AreaPlan> {
        let before = area::labelled_before(area.number, &common);
        if let Some(plan) = &before {
            area::know_labels(area, plan, &common);
        }
        let before = match before {
            Some(plan) if !area::is_unscored(&plan, &common) => return Ok(plan),
            before => before,
        };
        let is_labelled = before.is_some();
        let finish = |stage: &Stage<'_>, nearest: Option<NearestFaces<'_>>| {
            let plan = match (before, nearest) {
                (Some(plan), _) => plan,
                (None, Some(nearest)) => area::label_area(area, stage, nearest, common)?,
                (None, None) => area::label_area(area, stage, stage.nearest(), common)?,
            };
            area::score(&plan, stage, common)?;
            Ok(plan)
        };
        if let Some(file) = &self.single {
            let (stage, nearest) = Stage::prepare(file, !is_labelled);
            let plan = finish(&stage, nearest)?;
            *single = Some(stage);
            return Ok(plan);
        }
        let loading = common.account.stage(Step::Load, Some(area.number));
        let file = area.read_mesh()?;
        let (stage, nearest) = Stage::prepare(&file, !is_labelled);
        loading.end();
        finish(&stage, nearest)
    }

    /// The part of a plan that an area is: its labels and those scores that are ours.
    fn plan_area(
        &self,
        area: &AreaInput,
        layout: &Layout,
        journal: &Journal,
        account: &Account,
        is_ours: &(dyn Fn(&Unit) -> bool + Sync),
    ) -> Outcome<()> {
        let common = self.common(layout, journal, account, layout.root(), is_ours);
        self.label_area(area, common, &mut None).map(drop)
    }

    /// Renders the locations, and writes the meshes and points, that are ours and not done yet.
    fn render(&self, common: Common<'_>, labelled: &Labelled<'_>, candidates: &[Candidate]) -> Outcome<()> {
        let missing = missing_units(&self.request, &common.journal.finished());
        let Labelled { single, areas } = labelled;
        for ((area, plan), pictures) in self.inputs.areas.iter().zip(areas).zip(&self.pictures) {
            let todo: BTreeSet<&Unit> =
                missing.iter().filter(|unit| unit.area() == area.number && (common.is_ours)(unit)).collect();
            let Some(plan) = plan.as_ref().filter(|_| !todo.is_empty()) else { continue };
            let render = |stage: &Stage<'_>| {
                area::render_area(area, stage, plan, pictures.as_ref(), common, candidates, &todo)
            };
            match (single, &self.single) {
                (Some(stage), _) => render(stage)?,
                (None, Some(file)) => render(&Stage::for_rays(file))?,
                (None, None) => {
                    let loading = common.account.stage(Step::Load, Some(area.number));
                    let file = area.read_mesh()?;
                    let stage = Stage::for_rays(&file);
                    loading.end();
                    render(&stage)?;
                }
            }
        }
        Ok(())
    }
}

/// The pictures that an area's RGB images are made from, if they are.
fn area_pictures(area: &AreaInput, options: &ExportOptions) -> Outcome<Option<Pictures>> {
    if !options.modalities.contains(&Domain::Rgb) {
        return Ok(None);
    }
    let pictures = Pictures::open(area, |l| options.only.is_empty() || options.only.contains(&l.uuid))?;
    if let Some(pictures) = &pictures {
        pictures.warnings.iter().for_each(|w| warn!("{w}"));
        info!("colours from {}", pictures.summary());
    }
    Ok(pictures)
}

/// Refuses more labels than loaders of the data set can tell apart.
fn check_label_count(labels: usize) -> Outcome<()> {
    if labels <= s3d_io::MAX_LABELS_OF_LOADERS {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{labels} labels are more than {}: loaders of the data set take a label's index from G and B of a pixel alone, and a \
         pixel with an R for one without a label; export the areas in several data sets",
        s3d_io::MAX_LABELS_OF_LOADERS
    )))
}

/// Refuses a `--only` that names no location, as far as they are known before the areas are labelled.
fn check_only(inputs: &Inputs, only: &[String]) -> Outcome<()> {
    if inputs.areas.iter().any(|a| matches!(a.cameras, Cameras::Placed(_))) {
        return Ok(());
    }
    only_known(inputs.areas.iter().flat_map(|a| a.cameras.listed()).map(|l| l.uuid.as_str()), only)
}

fn only_known<'a>(uuids: impl Iterator<Item = &'a str>, only: &[String]) -> Outcome<()> {
    let known: BTreeSet<&str> = uuids.collect();
    match only.iter().find(|uuid| !known.contains(uuid.as_str())) {
        Some(uuid) => Err(Failure::Call(format!("--only {uuid}: no scan location has this uuid"))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_labels_than_sixteen_bits_are_refused() {
        assert!(check_label_count(65_535).is_ok());
        let e = check_label_count(65_536).unwrap_err();
        assert!(
            matches!(e, Failure::Input(_)) && e.to_string().starts_with("65536 labels are more than 65535")
        );
    }
}
