//! The work of an export: units of labels, scores, images and assets. Units that are done already are
//! skipped.

use crate::account::Account;
use crate::context::Context;
use crate::error::{InputError, Result, UsageError};
use crate::export::area;
use crate::export::common::{Common, Form, PreparedMesh};
use crate::export::finish::finish;
use crate::export::input::Inputs;
use crate::export::input::area::AreaInput;
use crate::export::input::cameras::Cameras;
use crate::export::input::memory::SceneSource;
use crate::export::input::pictures::Pictures;
use crate::export::input::requested::requested_areas;
use crate::export::input::stamps::Stamps;
use crate::export::labels::label_area::{self, mesh_doubts};
use crate::export::plan::Plan;
use crate::export::run::{Run, Target};
use crate::export::scoring;
use crate::export::views::select_requested;
use crate::options::ExportOptions;
use crate::record::assets;
use crate::record::journal::{Finished, Journal, Unit};
use crate::record::manifest::Manifest;
use crate::record::request::Request;
use crate::record::unfinished::missing_units;
use crate::stage::Stage;
use crate::store::lock::Sharing;
use crate::store::state::OutputState;
use crate::summary::Summary;
use crate::survey::candidate::Candidate;
use crate::survey::labelled_area::LabelledArea;
use crate::useful::{Estimate, judge, space_findings};
use s3d_geom::NearestFaces;
use s3d_io::dataset::{Domain, Layout};
use s3d_io::fs::SyncAhead;
use s3d_io::mesh::MeshFile;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

/// An export whose input is open and checked.
pub(crate) struct Job<'a> {
    pub(crate) inputs: Inputs,
    /// Everything that decides the bytes of the data set.
    pub(crate) request: Request,
    options: ExportOptions,
    /// The pictures that each area's colours are taken from, if there are any.
    pictures: Vec<Option<Pictures>>,
    /// The mesh, if there is only one area.
    single: Option<Arc<MeshFile>>,
    /// How large the data set becomes.
    estimate: Estimate,
    /// The plan that labels and scores are taken from, if there is one.
    pub(crate) plan: Option<&'a Plan>,
    /// The input files as they were when they were looked at first.
    stamps: Stamps,
    form: Form,
}

/// What is known after labelling. An area is `None` if all its units were done before.
pub(crate) struct Labelled<'j> {
    single: Option<PreparedMesh<'j>>,
    pub(crate) areas: Vec<Option<LabelledArea>>,
}

/// Which areas are labelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scope {
    /// The areas with units still to do.
    Unfinished,
    All,
}

/// Turns scenes into a data set. With a plan, labels and scores are taken from it. Returns `None` if the data
/// set is there already.
pub(crate) fn export(
    ctx: &Context,
    scenes: &[SceneSource],
    target: &Target<'_>,
    options: &ExportOptions,
    plan: Option<&Plan>,
) -> Result<Option<Summary>> {
    let run = Run::new(ctx, target);
    let layout = run.layout();
    let state = run.look()?;
    let job = Job::open(scenes, layout, &state, options, plan, &run.account)?;
    if !state.is_begun() {
        job.judge_space(ctx, layout, 1.0)?;
    }

    let manifest = job.manifest();
    let Some(session) = run.begin(&state, &job.request, &manifest, Sharing::Alone)? else {
        return Ok(None);
    };

    // Written files are synced to the disk while others are made.
    let disk = SyncAhead::start(layout.root());
    let made = job.run(layout, &session.journal, &run.account).and_then(|()| {
        disk.sync_now();
        let tables = run.account.stage(Stage::Tables, None);
        let made = finish(ctx, layout, &job.request, manifest, &session.journal.finished(), Some(disk))?;
        tables.end();
        Ok(made)
    });
    let made = session.end(ctx, made)?;
    Ok(Some(run.finish(&job.request, &made)))
}

impl<'a> Job<'a> {
    /// Opens the input of an export into `layout`, and refuses what cannot be exported. Nothing is written.
    pub(crate) fn open(
        scenes: &[SceneSource],
        layout: &Layout,
        state: &OutputState,
        options: &ExportOptions,
        plan: Option<&'a Plan>,
        account: &Account<'_>,
    ) -> Result<Self> {
        let ctx = account.ctx;
        let loading = account.stage(Stage::Load, None);
        ctx.debug(format_args!("{options:?}"));
        let placing = options.placing();
        let lenient = options.lenient;

        // A raw scan becomes a scene first.
        let scenes = scenes.iter().map(|scene| scene.clone().fused(ctx));
        let scenes = &scenes.collect::<Result<Vec<SceneSource>>>()?;
        let inputs = match plan {
            Some(plan) => Inputs::open_planned(scenes, placing, lenient, plan.table()?)?,
            None => Inputs::open(scenes, placing, lenient)?,
        };

        let mut stamps = Stamps::default();
        stamps.look(inputs.areas.iter().flat_map(|area| &area.files))?;

        let options = if inputs.are_labelled() {
            options.clone()
        } else {
            options.without_labels()?
        };
        let options = &options;

        check_only(&inputs, &options.only)?;
        let input_files = inputs.areas.iter().flat_map(|area| &area.files);
        state.check_inputs(layout, inputs.numbers(), input_files)?;
        check_label_count(inputs.table.len() - 1)?;

        let mut pictures = Vec::new();
        for area in &inputs.areas {
            pictures.push(area_pictures(ctx, area, options)?);
        }

        // Every mesh is read before OUT is touched, so that a bad one destroys nothing that was there. The
        // mesh of a single area stays in memory; several are read again where they are needed.
        let mut single: Option<Arc<MeshFile>> = None;
        let mut companions = Vec::new();
        let mut estimate = Estimate::default();
        for area in &inputs.areas {
            ctx.check()?;
            let file = area.read_mesh()?;
            area.tell_mesh(ctx, &file);
            judge(ctx, &mesh_doubts(area, &file.mesh, options)?, &options.allow)?;
            estimate = estimate.add(area.estimate(&file.mesh, options));
            companions.push(file.companions.clone());
            single = (inputs.areas.len() == 1).then_some(file);
        }

        let known = plan.map(Plan::request);
        let requested = requested_areas(ctx, &inputs.areas, &companions, known, &mut stamps)?;
        let request = Request::new(options, requested);
        if let Some(plan) = plan {
            plan.refuse_other(&request)?;
            plan.require_complete()?;
        }

        loading.end();
        ctx.check()?;
        ctx.debug(format_args!("the data set will have {estimate}"));
        Ok(Self {
            estimate,
            inputs,
            request,
            options: options.clone(),
            pictures,
            single,
            plan,
            stamps,
            form: Form::DataSet,
        })
    }

    /// Returns the manifest of an export under way.
    pub(crate) fn manifest(&self) -> Manifest {
        Manifest::begin(&self.request, &self.inputs.table)
    }

    /// Returns the known units that are not done yet.
    fn missing(&self, finished: &Finished) -> Vec<Unit> {
        let mut missing = missing_units(&self.request, finished);
        missing.retain(|unit| self.form.has(unit));
        missing
    }

    /// Does all units that are not done yet.
    pub(crate) fn run(&self, layout: &Layout, journal: &Journal, account: &Account<'_>) -> Result<()> {
        let ctx = account.ctx;
        self.write_assets(layout)?;

        let cache = layout.work_dir();
        let common = self.common(layout, journal, account, &cache, &|_| true);
        let labelled = self.label(common, Scope::Unfinished)?;

        let (candidates, _) = select_requested(&self.request, &journal.finished())?;
        let kept = candidates.iter().filter(|c| c.frame_num.is_some()).count();
        ctx.info(format_args!("selected {kept} of {} candidate views", candidates.len()));

        self.render(common, &labelled, &candidates)
    }

    /// Returns the job whose images go into bundles.
    pub(crate) fn bundled(self, with_meshes: bool) -> Self {
        Self { form: Form::Bundles { with_meshes }, ..self }
    }

    /// Weighs whether the disk below `layout` has room for `copies` of what is written.
    pub(crate) fn judge_space(&self, ctx: &Context, layout: &Layout, copies: f64) -> Result<()> {
        let bytes = copies * self.estimate.bytes;
        judge(ctx, &space_findings(bytes, layout.root()), &self.options.allow)
    }

    /// Writes what is known before any unit is done: the label table, `assets`, `conventions.json`.
    pub(crate) fn write_assets(&self, layout: &Layout) -> Result<()> {
        let options = &self.options;
        assets::write(
            layout,
            &self.inputs.table,
            &options.modalities,
            options.pad_labels.0,
            options.conventions(),
            &self.request.world_offsets(),
        )
    }

    pub(crate) fn common<'b>(
        &'b self,
        layout: &'b Layout,
        journal: &'b Journal,
        account: &'b Account<'b>,
        cache: &'b Path,
        is_ours: &'b (dyn Fn(&Unit) -> bool + Sync),
    ) -> Common<'b> {
        let table = &self.inputs.table;
        let options = &self.options;
        let Self { stamps, form, .. } = self;
        Common { table, layout, options, journal, account, cache, is_ours, stamps, form: *form }
    }

    /// Labels the areas of `scope`, and scores their unscored locations. The label files of an area are
    /// written if that unit is ours. Otherwise the journal knows the unit, but does not write it down.
    pub(crate) fn label(&self, common: Common<'_>, scope: Scope) -> Result<Labelled<'_>> {
        let missing = self.missing(&common.journal.finished());
        let mut labelled = Labelled { single: None, areas: Vec::new() };
        for area in &self.inputs.areas {
            let is_needed = scope == Scope::All || missing.iter().any(|unit| unit.area() == area.number);
            let plan = match self.plan {
                _ if !is_needed => None,
                Some(plan) => Some(label_area::take_from_plan(area, plan, &common)?),
                None => Some(self.label_area(area, common, &mut labelled.single)?),
            };
            labelled.areas.push(plan);
        }

        let finished = common.journal.finished();
        let labels = self.request.areas.iter().filter_map(|a| finished.labels(a.area));
        let uuids = labels.flat_map(|l| l.locations.iter().chain(&l.photographs));
        only_known(uuids.map(String::as_str), &self.options.only)?;

        Ok(labelled)
    }

    /// Labels an area, or takes the labels of an earlier run, and scores the locations that are ours and
    /// unscored. If there is only one area, its mesh, ready for rays, is kept in `single`.
    fn label_area<'j>(
        &'j self,
        area: &AreaInput,
        common: Common<'_>,
        single: &mut Option<PreparedMesh<'j>>,
    ) -> Result<LabelledArea> {
        let before = label_area::labelled_before(area.number, &common);
        if let Some(plan) = &before {
            label_area::know_labels(area, plan, &common);
        }

        let before = match before {
            Some(plan) if !scoring::is_unscored(&plan, &common) => return Ok(plan),
            before => before,
        };

        let is_labelled = before.is_some();
        let finish = |prepared: &PreparedMesh<'_>, nearest: Option<NearestFaces<'_>>| {
            let plan = match (before, nearest) {
                (Some(plan), _) => plan,
                (None, Some(nearest)) => label_area::label_area(area, prepared, nearest, common)?,
                (None, None) => label_area::label_area(area, prepared, prepared.nearest(), common)?,
            };
            scoring::score(&plan, prepared, common)?;
            Ok(plan)
        };

        if let Some(file) = &self.single {
            let (prepared, nearest) = PreparedMesh::prepare(file, !is_labelled);
            let plan = finish(&prepared, nearest)?;
            *single = Some(prepared);
            return Ok(plan);
        }

        let loading = common.account.stage(Stage::Load, Some(area.number));
        let file = area.read_mesh()?;
        let (prepared, nearest) = PreparedMesh::prepare(&file, !is_labelled);
        loading.end();
        finish(&prepared, nearest)
    }

    /// Makes an area's part of a plan: its labels and the scores that are ours.
    pub(crate) fn plan_area(
        &self,
        area: &AreaInput,
        layout: &Layout,
        journal: &Journal,
        account: &Account<'_>,
        is_ours: &(dyn Fn(&Unit) -> bool + Sync),
    ) -> Result<()> {
        let common = self.common(layout, journal, account, layout.root(), is_ours);
        self.label_area(area, common, &mut None).map(drop)
    }

    /// Renders the locations, and writes the meshes and points, that are ours and not done yet.
    pub(crate) fn render(
        &self,
        common: Common<'_>,
        labelled: &Labelled<'_>,
        candidates: &[Candidate],
    ) -> Result<()> {
        let missing = self.missing(&common.journal.finished());
        let Labelled { single, areas } = labelled;

        for ((area, plan), pictures) in self.inputs.areas.iter().zip(areas).zip(&self.pictures) {
            let todo: BTreeSet<&Unit> = missing
                .iter()
                .filter(|unit| unit.area() == area.number && (common.is_ours)(unit))
                .collect();
            let Some(plan) = plan.as_ref().filter(|_| !todo.is_empty()) else { continue };

            let render = |prepared: &PreparedMesh<'_>| {
                area::render_area(area, prepared, plan, pictures.as_ref(), common, candidates, &todo)
            };

            match (single, &self.single) {
                (Some(prepared), _) => render(prepared)?,
                (None, Some(file)) => render(&PreparedMesh::for_rays(file))?,
                (None, None) => {
                    let loading = common.account.stage(Stage::Load, Some(area.number));
                    let file = area.read_mesh()?;
                    let prepared = PreparedMesh::for_rays(&file);
                    loading.end();
                    render(&prepared)?;
                }
            }
            self.stamps.check()?;
        }

        Ok(())
    }
}

/// Opens the pictures that an area's RGB images are made from. Returns `None` if there are none, or no RGB
/// images are asked for.
fn area_pictures(ctx: &Context, area: &AreaInput, options: &ExportOptions) -> Result<Option<Pictures>> {
    if !options.modalities.contains(&Domain::Rgb) {
        return Ok(None);
    }
    let pictures = Pictures::open(area, |l| options.only.is_empty() || options.only.contains(&l.uuid))?;
    if let Some(pictures) = &pictures {
        pictures.warnings.iter().for_each(|w| ctx.warn(w));
        ctx.info(format_args!("colours from {}", pictures.summary()));
    }
    Ok(pictures)
}

/// Refuses more labels than loaders of the data set can tell apart.
fn check_label_count(labels: usize) -> Result<()> {
    let most = s3d_io::dataset::MAX_LABELS_OF_LOADERS;
    if labels <= most {
        return Ok(());
    }
    Err(InputError::TooManyLabels { labels, most }.into())
}

/// Refuses a `--only` that names an unknown location. If locations are placed, nothing is refused here: they
/// are known only after labelling.
fn check_only(inputs: &Inputs, only: &[String]) -> Result<()> {
    if inputs.areas.iter().any(|a| matches!(a.cameras, Cameras::Placed(_))) {
        return Ok(());
    }
    let locations = inputs
        .areas
        .iter()
        .flat_map(|a| a.cameras.listed())
        .map(|l| l.uuid.as_str());
    let photographs = inputs
        .areas
        .iter()
        .flat_map(|a| &a.photographs.all)
        .map(|p| p.uuid.as_str());
    only_known(locations.chain(photographs), only)
}

fn only_known<'a>(uuids: impl Iterator<Item = &'a str>, only: &[String]) -> Result<()> {
    let known: BTreeSet<&str> = uuids.collect();
    match only.iter().find(|uuid| !known.contains(uuid.as_str())) {
        Some(uuid) => {
            let value = uuid.clone();
            let why = "no scan location has this uuid".to_owned();
            Err(UsageError::InvalidValue { option: "only", value, why }.into())
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn more_labels_than_sixteen_bits_are_refused() {
        assert!(check_label_count(65_535).is_ok());
        let e = check_label_count(65_536).unwrap_err();
        assert!(
            matches!(e, Error::Input(InputError::TooManyLabels { .. }))
                && e.to_string().starts_with("65536 labels are more than 65535")
        );
    }
}
