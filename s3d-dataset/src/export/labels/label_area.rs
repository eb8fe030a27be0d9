//! The labels of an area: made from its annotations, taken from an earlier run, or taken from a plan.

use crate::condition::Condition;
use crate::context::Context;
use crate::error::Result;
use crate::event::UnitKind;
use crate::export::common::{Common, PreparedMesh};
use crate::export::images::photographs::judge_sight;
use crate::export::input::area::AreaInput;
use crate::export::labels::annotate::{AnnotatedInstance, hidden_instances};
use crate::export::labels::overlap::overlap_doubts;
use crate::export::labels::survey::{Locating, Survey, SurveyOptions, Surveyor, survey};
use crate::export::plan::Plan;
use crate::options::ExportOptions;
use crate::record::journal::{Done, LabelsDone, Unit, tally_of};
use crate::record::listing;
use crate::record::manifest::{AreaEntry, XyzLoss};
use crate::record::tables;
use crate::stage::Stage;
use crate::summary::Unlabelled;
use crate::survey::annotated::Annotated;
use crate::survey::labelled_area::LabelledArea;
use crate::survey::surface_boxes::boxes_of_faces;
use crate::useful::{Finding, judge, mesh_findings, size_findings};
use s3d_geom::{NearestFaces, TriMesh};
use s3d_io::dataset::{Domain, FileRecord, InstanceRecord, InstanceWriter, Layout, SurfaceBoxes};
use s3d_io::fs::create_dir;
use s3d_io::mesh::MeshFile;
use s3d_label::{Disputes, FaceLabels, LabelTable};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;

/// Returns the labels that an earlier run kept for this area. Returns `None` if there are none, if they
/// cannot be read, or if the label files still have to be written.
pub(crate) fn labelled_before(area: u32, common: &Common<'_>) -> Option<LabelledArea> {
    let ctx = common.account.ctx;
    let unit = Unit::Labels(area);
    let folder = common.cache_of(area);
    let writes = (common.is_ours)(&unit) && !common.journal.finished().has(&unit);
    if writes || !LabelledArea::is_in(&folder) {
        return None;
    }
    match common.table.taxonomy().reading(|| LabelledArea::read(&folder, area)) {
        Ok(plan) => Some(plan),
        Err(e) => {
            ctx.warn(format_args!("{e}; the area is labelled again"));
            None
        }
    }
}

/// Labels an area, keeps the result for later runs, and writes the label files if they are ours and not there
/// yet.
pub(crate) fn label_area(
    area: &AreaInput,
    prepared: &PreparedMesh<'_>,
    nearest: NearestFaces<'_>,
    common: Common<'_>,
) -> Result<LabelledArea> {
    let Common { table, options, account, .. } = common;
    let ctx = &account.ctx.noting();
    let started = Instant::now();
    let labelling = account.stage(Stage::Label, Some(area.number));

    // Labels and locations.
    let mut files = LabelFiles::begin(area, &prepared.file.mesh, &common)?;
    let survey_options =
        SurveyOptions { table, fill_m: options.fill, trim_m: options.trim_strays, seed: options.seed };
    let mut surveyor =
        ExportSurveyor { ctx, area, table, allow: &options.allow, started, files: files.as_mut() };
    let survey = survey(ctx, area, &prepared.scene, nearest, survey_options, &mut surveyor)?;
    judge_sight(ctx, &area.photographs, &prepared.scene, &options.allow)?;
    for (outlook, location) in survey.outlooks.iter().zip(&survey.located.locations) {
        ctx.warn_each(outlook.warnings(location));
    }

    // What was read is what the request names. The result is kept before the journal mentions it.
    common.stamps.check()?;
    let labelled = labelled_area(ctx, area, prepared.file, survey, options)?;
    labelled.write(&common.cache_of(area.number))?;
    if let Some(files) = files {
        let written = files.finish(ctx, &labelled)?;
        finish_labels(area, &labelled, &common, written, started)?;
    }
    know_labels(area, &labelled, &common);
    labelling.end();
    Ok(labelled)
}

/// Takes an area's labels and scores from a plan. Label files and scores that are ours are written; the
/// journal only knows the others.
pub(crate) fn take_from_plan(area: &AreaInput, from: &Plan, common: &Common<'_>) -> Result<LabelledArea> {
    let Common { layout, journal, is_ours, .. } = *common;
    let started = Instant::now();
    let number = area.number;
    let labelled = from.area(number)?;

    if writes_labels(number, common) {
        let files = from.bring_labels(number, layout)?;
        finish_labels(area, &labelled, common, files, started)?;
    }
    know_labels(area, &labelled, common);

    for location in &labelled.locations {
        let unit = Unit::Scores(number, location.uuid.clone());
        if journal.finished().has(&unit) {
            continue;
        }
        let scores = from.scores(number, &location.uuid)?;
        if is_ours(&unit) {
            journal.write(scores)?;
        } else {
            journal.know(scores);
        }
    }
    Ok(labelled)
}

/// Tells the journal of an area's labels, if it does not know them. Another process writes their files.
pub(crate) fn know_labels(area: &AreaInput, labelled: &LabelledArea, common: &Common<'_>) {
    if !common.journal.finished().has(&Unit::Labels(area.number)) {
        common
            .journal
            .know(Done::Labels(labels_done(area, labelled, common.options, Vec::new())));
    }
}

/// Returns what looks wrong about an area's mesh alone.
pub(crate) fn mesh_doubts(area: &AreaInput, mesh: &TriMesh, options: &ExportOptions) -> Result<Vec<Finding>> {
    let makes_rgb = area.shows_mesh_colors() && options.modalities.contains(&Domain::Rgb);
    let mut findings = mesh_findings(mesh, makes_rgb);
    findings.extend(size_findings(mesh, options.points_per_m2)?);
    Ok(findings)
}

/// Returns a sentence for each oddity of the annotations.
pub(crate) fn label_doubts(area: &AreaInput, annotated: &Annotated, table: &LabelTable) -> Vec<String> {
    let mut doubts = annotated.skipped.sentences();
    doubts.extend(annotated.strays.sentences());
    doubts.extend(hidden_instances(area, &annotated.label_of_face, table));
    doubts.extend(overlap_doubts(&annotated.rooms));
    doubts
}

/// Whether this process is to write the files of an area's labels.
fn writes_labels(area: u32, common: &Common<'_>) -> bool {
    let unit = Unit::Labels(area);
    !common.journal.finished().has(&unit) && (common.is_ours)(&unit)
}

/// Writes to the journal that an area's labels are done, with the records of their files.
fn finish_labels(
    area: &AreaInput,
    labelled: &LabelledArea,
    common: &Common<'_>,
    files: Vec<FileRecord>,
    started: Instant,
) -> Result<()> {
    let tally = tally_of(&files);
    common
        .journal
        .write(Done::Labels(labels_done(area, labelled, common.options, files)))?;
    common
        .account
        .unit_finished(UnitKind::Labels, area.number, None, &tally, started);
    Ok(())
}

/// What an export does with the results of a survey: it writes the label files, and stops at findings that
/// make the data set useless.
struct ExportSurveyor<'a, 'f> {
    ctx: &'a Context,
    area: &'a AreaInput,
    table: &'a LabelTable,
    /// The conditions that the data set need not meet.
    allow: &'a [Condition],
    started: Instant,
    /// The label files, if they are to be written.
    files: Option<&'f mut LabelFiles<'a>>,
}

impl Surveyor for ExportSurveyor<'_, '_> {
    fn instance(&mut self, instance: AnnotatedInstance<'_>) -> Result<()> {
        self.files.as_mut().map_or(Ok(()), |files| files.push(instance))
    }

    fn labels(&mut self, annotated: &Annotated, votes: &FaceLabels) -> Result<()> {
        if let Some(files) = &mut self.files {
            files.write_votes(annotated, votes)?;
        }
        tell_labels(self.ctx, annotated, self.started);
        self.ctx.warn_each(label_doubts(self.area, annotated, self.table));
        Ok(())
    }

    fn label_findings(&mut self, mut labels: Vec<Finding>, locations: Vec<Finding>) -> Result<Locating> {
        labels.extend(locations);
        judge(self.ctx, &labels, self.allow)?;
        Ok(Locating::Wanted)
    }

    fn outlook_findings(&mut self, findings: Vec<Finding>) -> Result<()> {
        judge(self.ctx, &findings, self.allow)
    }
}

/// The label files of an area while they are written.
struct LabelFiles<'a> {
    layout: &'a Layout,
    area: u32,
    mesh: &'a TriMesh,
    table: &'a LabelTable,
    /// `instances.json` and `instances.npz`; `None` for an area without labels.
    instances: Option<InstanceWriter>,
}

impl<'a> LabelFiles<'a> {
    /// Begins the files. Returns `None` if they are not ours to write, or are there already.
    fn begin(area: &AreaInput, mesh: &'a TriMesh, common: &Common<'a>) -> Result<Option<Self>> {
        let Common { layout, table, .. } = *common;
        let number = area.number;
        if !writes_labels(number, common) {
            return Ok(None);
        }

        create_dir(&layout.mesh_dir(number))?;
        let instances = if area.is_labelled {
            let json = layout.instances_json(number);
            let npz = layout.instances_npz(number);
            Some(InstanceWriter::create(&json, &npz)?)
        } else {
            None
        };
        Ok(Some(Self { layout, area: number, mesh, table, instances }))
    }

    fn push(&mut self, instance: AnnotatedInstance<'_>) -> Result<()> {
        let Some(instances) = &mut self.instances else { return Ok(()) };
        let AnnotatedInstance { label, id, bbox, points } = instance;
        let record = InstanceRecord {
            label: &label.to_string(),
            label_index: id.0,
            class: label.class.name(),
            room: &label.room.to_string(),
            bbox,
        };
        Ok(instances.push(&record, points)?)
    }

    fn write_votes(&mut self, annotated: &Annotated, votes: &FaceLabels) -> Result<()> {
        let Self { layout, area, mesh, table, .. } = *self;
        if let Some(instances) = &mut self.instances {
            instances.set_surfaces(&surfaces(mesh, annotated));
        }
        let disputes = Disputes::of(mesh, votes, table);
        tables::write_votes(layout, area, annotated, &disputes, table)?;
        tables::write_face_votes(layout, area, &annotated.label_of_face, votes)
    }

    /// Writes the remaining files. Returns the records of all files: none for an area without labels.
    fn finish(self, ctx: &Context, labelled: &LabelledArea) -> Result<Vec<FileRecord>> {
        let Self { layout, area, instances, .. } = self;
        let Some(instances) = instances else { return Ok(Vec::new()) };

        instances.finish()?;
        tables::write_rooms(layout, area, &labelled.annotated)?;
        tables::write_instance_numbers(layout, area, &labelled.names)?;
        listing::records(ctx, layout, &label_files(layout, area))
    }
}

/// Returns the boxes of the faces of each label, as they are written.
fn surfaces(mesh: &TriMesh, annotated: &Annotated) -> BTreeMap<u32, SurfaceBoxes> {
    let label_of_face: Vec<u32> = annotated.label_of_face.iter().map(|label| label.0).collect();
    boxes_of_faces(mesh, &label_of_face)
        .into_iter()
        .map(|(label, boxes)| (label, SurfaceBoxes::new(boxes.bbox, &boxes.upright, &boxes.oriented)))
        .collect()
}

/// The label files of an area, if it has labels.
pub(crate) fn label_files(layout: &Layout, area: u32) -> [PathBuf; 6] {
    [
        layout.instances_json(area),
        layout.instances_npz(area),
        layout.rooms_json(area),
        layout.votes_json(area),
        layout.votes_npz(area),
        layout.instance_numbers_json(area),
    ]
}

/// Gathers all that is known of a surveyed area. `ctx` has noted the warnings of the survey.
fn labelled_area(
    ctx: &Context,
    area: &AreaInput,
    file: &MeshFile,
    survey: Survey,
    options: &ExportOptions,
) -> Result<LabelledArea> {
    let mesh = &file.mesh;

    // Every call logs the warnings of the area and its mesh when it opens the area, so they are not in the
    // notes.
    let mut warnings: Vec<String> = area.doubts(file).cloned().collect();
    warnings.extend(mesh_doubts(area, mesh, options)?.iter().map(Finding::text));
    warnings.extend(ctx.take_notes());

    Ok(LabelledArea {
        area: area.number,
        annotated: survey.annotated,
        names: area.room_names(),
        locations: survey.located.locations,
        location_rooms: survey.located.rooms,
        surface_seen: survey.located.surface_seen,
        mesh_box: mesh.aabb(),
        mesh_area_m2: mesh.total_area(),
        faces_left_out: mesh.report().zero_area_faces + file.repeated_faces,
        warnings: warnings
            .iter()
            .map(|w| area.with_short_names(w, &file.companions))
            .collect(),
    })
}

fn labels_done(
    area: &AreaInput,
    labelled: &LabelledArea,
    options: &ExportOptions,
    files: Vec<FileRecord>,
) -> LabelsDone {
    let locations = labelled.locations.iter().map(|l| l.uuid.clone()).collect();
    let photographs = area.photographs.all.iter().map(|p| p.uuid.clone()).collect();
    LabelsDone { entry: Box::new(area_entry(area, labelled, options)), locations, photographs, files }
}

/// The manifest's entry of a labelled area.
fn area_entry(area: &AreaInput, labelled: &LabelledArea, options: &ExportOptions) -> AreaEntry {
    AreaEntry {
        area: area.number,
        faces: labelled.annotated.label_of_face.len(),
        faces_left_out: labelled.faces_left_out,
        points: 0,
        annotated_points: labelled.annotated.points,
        unlabelled: area.is_labelled.then_some(labelled.annotated.unlabelled),
        rooms: labelled.annotated.rooms.len(),
        locations: labelled.locations.len(),
        panoramas: 0,
        views: 0,
        frames: area.photographs.all.len() as u64,
        xyz: XyzLoss::of(labelled.mesh_box, options.xyz),
        rgb: area.rgb_source().to_owned(),
        place_cameras: area.cameras.distance_m(),
        see: area.cameras.share(),
        surface_seen: labelled.surface_seen,
        offset_m: area.frame.offset(),
        warnings: labelled.warnings.clone(),
        inputs: Vec::new(),
    }
}

fn tell_labels(ctx: &Context, annotated: &Annotated, started: Instant) {
    let total = &annotated.report.total;
    let faces = annotated.label_of_face.len();
    ctx.info(format_args!(
        "{} annotated points labelled {} of {faces} faces ({:.1} s)",
        annotated.points,
        total.faces,
        started.elapsed().as_secs_f64()
    ));

    let Unlabelled { without_votes, without_label } = annotated.unlabelled;
    if !annotated.filled.is_empty() {
        ctx.info(format_args!(
            "{} faces without a vote filled: {:.1} m² without a label instead of {:.1}",
            annotated.filled.len(),
            without_label.m2,
            without_votes.m2
        ));
    }

    for (_, room, row) in &annotated.report.rooms {
        ctx.debug(format_args!(
            "{room}: {} points, {} faces, {} of them contested",
            row.points, row.faces, row.contested
        ));
    }
}
