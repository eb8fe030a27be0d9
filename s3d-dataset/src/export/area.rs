//! One area of an export: labelled, scored, rendered, with its meshes and points.

use crate::account::Account;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::event::UnitKind;
use crate::export::images::{ImageJob, WrittenLocation, write_images};
use crate::export::input::AreaInput;
use crate::export::input::pictures::Pictures;
use crate::export::labels::annotate::{annotate, hidden_instances, unannotated};
use crate::export::labels::overlap::overlap_doubts;
use crate::export::location::{Located, locate, room_of};
use crate::export::modality::{Channels, classes_of_labels, palette};
use crate::export::photographs::{self, WrittenPhotograph, judge_sight};
use crate::export::points::write_points;
use crate::export::shard::plan::Plan;
use crate::export::views::{Kinds, Scoring, score_area};
use crate::options::ExportOptions;
use crate::record::journal::{
    AssetsDone, Done, Journal, LabelsDone, LocationDone, ScoresDone, Unit, tally_of,
};
use crate::record::listing;
use crate::record::manifest::{AreaEntry, XyzLoss};
use crate::record::tables;
use crate::stage::Stage;
use crate::summary::Unlabelled;
use crate::survey::annotated::Annotated;
use crate::survey::candidate::Candidate;
use crate::survey::labelled_area::LabelledArea;
use crate::survey::outlook::look_around;
use crate::useful::{Finding, judge, label_findings, mesh_findings, outlook_findings, size_findings};
use s3d_geom::{Density, NearestFaces, TriMesh};
use s3d_io::camera::ScanLocation;
use s3d_io::dataset::{Domain, FileRecord, InstanceRecord, InstanceWriter, Layout};
use s3d_io::fs::create_dir;
use s3d_io::image::{Compression, Content, encode_rgb8};
use s3d_io::mesh::{MeshFile, TextureOut};
use s3d_label::{Disputes, LabelTable};
use s3d_render::{MipMaps, Scene};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What all areas share.
#[derive(Clone, Copy)]
pub(crate) struct Common<'a> {
    pub(crate) table: &'a LabelTable,
    pub(crate) layout: &'a Layout,
    pub(crate) options: &'a ExportOptions,
    pub(crate) journal: &'a Journal,
    pub(crate) account: &'a Account<'a>,
    /// Where labelled areas are kept, a folder each.
    pub(crate) cache: &'a Path,
    /// Which units this process writes.
    pub(crate) is_ours: &'a (dyn Fn(&Unit) -> bool + Sync),
}

impl Common<'_> {
    /// The folder of a labelled area.
    fn cache_of(&self, area: u32) -> PathBuf {
        self.cache.join(format!("area_{area}"))
    }
}

/// With more faces than this, what is only needed while two hierarchies are built, 200 bytes a face each,
/// should not be in memory twice.
const LARGE_MESH: usize = 2_000_000;

/// A mesh that is ready for rays.
pub(crate) struct PreparedMesh<'m> {
    file: &'m MeshFile,
    scene: Scene<'m>,
}

impl<'m> PreparedMesh<'m> {
    /// Prepares the mesh, and its nearest faces (at the same time, unless it is large), which are needed for
    /// its labels only.
    pub(crate) fn new(file: &'m MeshFile) -> (Self, NearestFaces<'m>) {
        let (scene, nearest) = match file.mesh.faces().len() {
            0..=LARGE_MESH => rayon::join(|| Scene::new(&file.mesh), || NearestFaces::new(&file.mesh)),
            _ => (Scene::new(&file.mesh), NearestFaces::new(&file.mesh)),
        };
        (Self { file, scene }, nearest)
    }

    /// Prepares the mesh, with its nearest faces if they are needed.
    pub(crate) fn prepare(file: &'m MeshFile, with_nearest: bool) -> (Self, Option<NearestFaces<'m>>) {
        if !with_nearest {
            return (Self::for_rays(file), None);
        }
        let (prepared, nearest) = Self::new(file);
        (prepared, Some(nearest))
    }

    /// The mesh's nearest faces.
    pub(crate) fn nearest(&self) -> NearestFaces<'m> {
        NearestFaces::new(&self.file.mesh)
    }

    /// Prepares the mesh for rays alone.
    pub(crate) fn for_rays(file: &'m MeshFile) -> Self {
        Self { file, scene: Scene::new(&file.mesh) }
    }
}

/// The files of an area's labels, if it has some.
fn label_files(layout: &Layout, area: u32) -> [PathBuf; 6] {
    [
        layout.instances_json(area),
        layout.instances_npz(area),
        layout.rooms_json(area),
        layout.votes_json(area),
        layout.votes_npz(area),
        layout.instance_numbers_json(area),
    ]
}

/// An area that was labelled before, if it can be taken as it is: not where the files of its labels are still
/// to be written.
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

/// Labels an area, keeps what is known then, and writes the files of its labels, if that is ours and was not
/// done before.
pub(crate) fn label_area(
    area: &AreaInput,
    prepared: &PreparedMesh<'_>,
    nearest: NearestFaces<'_>,
    common: Common<'_>,
) -> Result<LabelledArea> {
    let Common { table, layout, options, journal, account, is_ours, .. } = common;
    let ctx = &account.ctx.noting();
    let number = area.number;
    let PreparedMesh { file, scene } = prepared;

    let labelling = account.stage(Stage::Label, Some(number));
    let started = Instant::now();
    let unit = Unit::Labels(number);
    let writes = !journal.finished().has(&unit) && is_ours(&unit);
    let paths = label_files(layout, number);
    let [json, npz, ..] = &paths;
    let mut instances = None;
    if writes {
        create_dir(&layout.mesh_dir(number))?;
        if area.is_labelled {
            instances = Some(InstanceWriter::create(json, npz)?);
        }
    }
    let annotated = if area.is_labelled {
        let (annotated, votes) = annotate(ctx, area, &nearest, table, options.fill, |i| {
            let Some(instances) = &mut instances else { return Ok(()) };
            let record = InstanceRecord {
                label: &i.label.to_string(),
                label_index: i.id.0,
                class: i.label.class.name(),
                room: &i.label.room.to_string(),
                bbox: i.bbox,
            };
            Ok(instances.push(&record, i.points)?)
        })?;
        if writes {
            let disputes = Disputes::of(&file.mesh, &votes, table);
            tables::write_votes(layout, number, &annotated, &disputes, table)?;
            tables::write_face_votes(layout, number, &annotated.label_of_face, &votes)?;
        }
        annotated
    } else {
        unannotated(&nearest, table)?
    };
    if area.is_labelled {
        tell_labels(ctx, &annotated, started);
        label_doubts(area, &annotated, table).iter().for_each(|w| ctx.warn(w));
        let mut findings = label_findings(&file.mesh, &annotated, table);
        findings.extend(area.count_findings(&annotated.rooms));
        judge(ctx, &findings, &options.allow)?;
    }
    let Located { locations, rooms: location_rooms, surface_seen } =
        locate(ctx, area, scene, &nearest, &annotated, table, options.seed)?;
    drop(nearest);
    let outlooks = look_around(ctx, scene, &locations)?;
    // Photographs need no locations beside them.
    if !outlooks.is_empty() {
        judge(ctx, &outlook_findings(&outlooks), &options.allow)?;
    }
    judge_sight(ctx, &area.photographs, scene, &options.allow)?;
    for (outlook, location) in outlooks.iter().zip(&locations) {
        ctx.warn_each(outlook.warnings(location));
    }
    // Others were told when the area was opened, which every call does.
    let mut warnings: Vec<String> = area.doubts(file).cloned().collect();
    warnings.extend(mesh_doubts(area, &file.mesh, options)?.iter().map(Finding::text));
    warnings.extend(ctx.take_notes());
    let plan = LabelledArea {
        area: number,
        annotated,
        names: area.room_names(),
        locations,
        location_rooms,
        surface_seen,
        mesh_box: file.mesh.aabb(),
        mesh_area_m2: file.mesh.total_area(),
        faces_left_out: file.mesh.report().zero_area_faces + file.repeated_faces,
        warnings: warnings
            .iter()
            .map(|w| area.with_short_names(w, &file.companions))
            .collect(),
    };
    let write = || -> Result<()> {
        plan.write(&common.cache_of(number))?;
        if !writes {
            return Ok(());
        }
        let mut files = Vec::new();
        if let Some(instances) = instances {
            instances.finish()?;
            tables::write_rooms(layout, number, &plan.annotated)?;
            tables::write_instance_numbers(layout, number, &plan.names)?;
            files = listing::records(ctx, layout, &paths)?;
        }
        let tally = tally_of(&files);
        journal.write(Done::Labels(labels_done(area, &plan, options, files)))?;
        account.unit_finished(UnitKind::Labels, number, None, &tally, started);
        Ok(())
    };
    write()?;
    know_labels(area, &plan, &common);
    labelling.end();
    Ok(plan)
}

/// What looks wrong about an area's mesh alone.
pub(crate) fn mesh_doubts(area: &AreaInput, mesh: &TriMesh, options: &ExportOptions) -> Result<Vec<Finding>> {
    let makes_rgb = area.pictures.is_none() && options.modalities.contains(&Domain::Rgb);
    let mut findings = mesh_findings(mesh, makes_rgb);
    findings.extend(size_findings(mesh, options.points_per_m2)?);
    Ok(findings)
}

/// What was odd in the annotations, a sentence each.
pub(crate) fn label_doubts(area: &AreaInput, annotated: &Annotated, table: &LabelTable) -> Vec<String> {
    let mut doubts: Vec<String> = annotated.skipped.sentence().into_iter().collect();
    doubts.extend(hidden_instances(area, &annotated.label_of_face, table));
    doubts.extend(overlap_doubts(&annotated.rooms));
    doubts
}

/// Tells the journal of an area's labels, if it does not know of them: their files are another's work.
pub(crate) fn know_labels(area: &AreaInput, plan: &LabelledArea, common: &Common<'_>) {
    if !common.journal.finished().has(&Unit::Labels(area.number)) {
        common
            .journal
            .know(Done::Labels(labels_done(area, plan, common.options, Vec::new())));
    }
}

/// Takes an area's labels and scores from a plan: their files if they are ours, and the scores that are.
pub(crate) fn take_from_plan(area: &AreaInput, from: &Plan, common: &Common<'_>) -> Result<LabelledArea> {
    let Common { layout, options, journal, account, is_ours, .. } = *common;
    let started = Instant::now();
    let number = area.number;
    let plan = from.area(number)?;
    let unit = Unit::Labels(number);
    if !journal.finished().has(&unit) && is_ours(&unit) {
        let files = from.bring_labels(number, layout)?;
        let tally = tally_of(&files);
        journal.write(Done::Labels(labels_done(area, &plan, options, files)))?;
        account.unit_finished(UnitKind::Labels, number, None, &tally, started);
    }
    know_labels(area, &plan, common);
    for location in &plan.locations {
        let unit = Unit::Scores(number, location.uuid.clone());
        if journal.finished().has(&unit) {
            continue;
        }
        let scores = from.scores(number, &location.uuid)?;
        if is_ours(&unit) {
            journal.write(scores)?
        } else {
            journal.know(scores)
        }
    }
    Ok(plan)
}

fn labels_done(
    area: &AreaInput,
    plan: &LabelledArea,
    options: &ExportOptions,
    files: Vec<FileRecord>,
) -> LabelsDone {
    let locations = plan.locations.iter().map(|l| l.uuid.clone()).collect();
    let photographs = area.photographs.all.iter().map(|p| p.uuid.clone()).collect();
    LabelsDone { entry: Box::new(area_entry(area, plan, options)), locations, photographs, files }
}

/// The locations of an area whose candidates are ours to score and are not scored yet.
fn unscored<'p>(plan: &'p LabelledArea, common: &Common<'_>) -> Vec<&'p ScanLocation> {
    let unit = |l: &ScanLocation| Unit::Scores(plan.area, l.uuid.clone());
    let mut todo: Vec<&ScanLocation> = {
        let finished = common.journal.finished();
        plan.locations.iter().filter(|l| !finished.has(&unit(l))).collect()
    };
    // Whose they are may depend on the journal itself, which must not be held then.
    todo.retain(|l| (common.is_ours)(&unit(l)));
    todo
}

/// Whether something of an area is still to be scored.
pub(crate) fn is_unscored(plan: &LabelledArea, common: &Common<'_>) -> bool {
    !unscored(plan, common).is_empty()
}

/// Scores the candidates of those locations of an area that are ours and not scored yet.
pub(crate) fn score(plan: &LabelledArea, prepared: &PreparedMesh<'_>, common: Common<'_>) -> Result<()> {
    let ctx = common.account.ctx;
    let Common { table, options, journal, account, .. } = common;
    let number = plan.area;
    check_faces(plan, prepared)?;
    let missing = unscored(plan, &common);
    if missing.is_empty() {
        return Ok(());
    }
    let step = account.stage(Stage::Score, Some(number));
    let scoring = Scoring {
        area: number,
        views: options.views,
        size: options.size,
        stride: options.entropy_stride,
        seed: options.seed,
    };
    let kinds = Kinds::of(table, &plan.annotated.label_of_face, &prepared.file.mesh);
    score_area(ctx, &missing, &prepared.scene, &kinds, scoring, |uuid, entropies| {
        journal.write(Done::Scores(ScoresDone { area: number, location: uuid.to_owned(), entropies }))
    })?;
    step.end();
    ctx.debug(format_args!("area {number}: {} of {} locations scored", missing.len(), plan.locations.len()));
    Ok(())
}

/// Refuses labels of another mesh.
fn check_faces(plan: &LabelledArea, prepared: &PreparedMesh<'_>) -> Result<()> {
    let (labels, faces) = (plan.annotated.label_of_face.len(), prepared.file.mesh.faces().len());
    if labels == faces {
        return Ok(());
    }
    Err(Error::Input(format!("area {}: {labels} faces are labelled, and the mesh has {faces}", plan.area)))
}

/// What the manifest tells of an area that is labelled.
fn area_entry(area: &AreaInput, plan: &LabelledArea, options: &ExportOptions) -> AreaEntry {
    AreaEntry {
        area: area.number,
        faces: plan.annotated.label_of_face.len(),
        faces_left_out: plan.faces_left_out,
        points: 0,
        annotated_points: plan.annotated.points,
        unlabelled: area.is_labelled.then_some(plan.annotated.unlabelled),
        rooms: plan.annotated.rooms.len(),
        locations: plan.locations.len(),
        panoramas: 0,
        views: 0,
        frames: area.photographs.all.len() as u64,
        xyz: XyzLoss::of(plan.mesh_box, options.xyz),
        rgb: area.pictures.as_ref().map_or("texture", |p| p.kind.name()).to_owned(),
        place_cameras: area.cameras.distance_m(),
        see: area.cameras.share(),
        surface_seen: plan.surface_seen,
        offset_m: area.frame.offset(),
        warnings: plan.warnings.clone(),
        inputs: Vec::new(),
    }
}

/// Writes an area's meshes and points, all but its images.
fn write_area_assets(
    area: &AreaInput,
    file: &MeshFile,
    plan: &LabelledArea,
    common: Common<'_>,
) -> Result<()> {
    let ctx = common.account.ctx;
    let Common { table, layout, options, journal, account, .. } = common;
    let (number, started) = (area.number, Instant::now());
    let meshes = account.stage(Stage::Meshes, Some(number));
    let mesh_dir = layout.mesh_dir(number);
    let label_of_face: Vec<u32> = plan.annotated.label_of_face.iter().map(|l| l.0).collect();
    write_colored_mesh(&mesh_dir, file, options.compression)?;
    if area.is_labelled {
        s3d_io::mesh::write_semantic_obj(&mesh_dir, &file.mesh, &label_of_face, &table.names())?;
    }
    meshes.end();
    ctx.check()?;
    let sampling = account.stage(Stage::Points, Some(number));
    let density = Density::PerM2(options.points_per_m2);
    let points = write_points(ctx, layout, &file.mesh, plan, table, (density, options.seed), file.offset_m)?;
    let mut paths = listing::walk(&mesh_dir)?;
    let labels = label_files(layout, number);
    paths.retain(|path| !labels.contains(path));
    paths.extend(listing::walk(&layout.s3dis_area_dir(number))?);
    let files = listing::records(ctx, layout, &paths)?;
    let tally = tally_of(&files);
    journal.write(Done::Assets(AssetsDone { area: number, points, files }))?;
    sampling.end();
    account.unit_finished(UnitKind::Assets, number, None, &tally, started);
    Ok(())
}

/// Writes the mesh with its textures: their files as they were found, where they were used as they are.
fn write_colored_mesh(dir: &Path, file: &MeshFile, compression: Compression) -> Result<()> {
    let files: Vec<(String, Cow<'_, [u8]>)> = file
        .mesh
        .textures()
        .iter()
        .zip(&file.texture_files)
        .map(|(texture, found)| {
            let stem = Path::new(&texture.name)
                .file_stem()
                .unwrap_or_default()
                .to_string_lossy();
            match found {
                Some(f) => (format!("{stem}.{}", f.extension), Cow::Borrowed(&f.bytes[..])),
                None => {
                    let png = encode_rgb8(&texture.image, Content::Photo, compression);
                    (format!("{stem}.png"), Cow::Owned(png))
                }
            }
        })
        .collect();
    let textures: Vec<TextureOut<'_>> =
        files.iter().map(|(name, bytes)| TextureOut { name, bytes }).collect();
    s3d_io::mesh::write_rgb_obj(dir, &file.mesh, &textures)?;
    Ok(())
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

/// Renders those locations of an area that are to be done, and beside them writes its meshes and points if
/// they are.
pub(crate) fn render_area(
    area: &AreaInput,
    prepared: &PreparedMesh<'_>,
    plan: &LabelledArea,
    pictures: Option<&Pictures>,
    common: Common<'_>,
    candidates: &[Candidate],
    todo: &BTreeSet<&Unit>,
) -> Result<()> {
    let ctx = common.account.ctx;
    let Common { layout, options, journal, account, .. } = common;
    let LabelledArea { annotated, locations, location_rooms, .. } = plan;
    let PreparedMesh { file, scene } = prepared;
    let number = area.number;
    check_faces(plan, prepared)?;
    create_dir(&layout.mesh_dir(number))?;
    let textures = MipMaps::new(&file.mesh);
    let label_of_face: Vec<u32> = annotated.label_of_face.iter().map(|l| l.0).collect();
    let pretty_of_face: Vec<[u8; 3]> = label_of_face.iter().map(|l| s3d_label::pretty_color(*l)).collect();
    let mut class_of_face = Vec::new();
    if options.modalities.contains(&Domain::SemanticClass) {
        let classes = classes_of_labels(common.table);
        class_of_face.extend(label_of_face.iter().map(|label| classes[*label as usize]));
    }
    let palette = palette(common.table.taxonomy());
    let mut is_filled = Vec::new();
    if !annotated.filled.is_empty() {
        is_filled.resize(label_of_face.len(), false);
        annotated
            .filled
            .iter()
            .for_each(|face| is_filled[*face as usize] = true);
    }
    let chosen: Vec<bool> = locations
        .iter()
        .map(|l| todo.contains(&Unit::Location(number, l.uuid.clone())))
        .collect();
    let finish_location = |written: WrittenLocation| {
        let WrittenLocation { location, tally, files, started } = written;
        let uuid = &locations[location].uuid;
        journal.write(Done::Location(LocationDone { area: number, location: uuid.clone(), tally, files }))?;
        account.unit_finished(UnitKind::Location, number, Some(uuid), &tally, started);
        Ok(())
    };
    let is_asked = |uuid: &str| todo.contains(&Unit::Photograph(number, uuid.to_owned()));
    let photographs: Vec<photographs::Shot<'_>> = area
        .photographs
        .all
        .iter()
        .filter(|p| is_asked(&p.uuid))
        .map(|photograph| {
            let room = room_of(&annotated.rooms, photograph.camera.pose.location);
            photographs::Shot { photograph, room }
        })
        .collect();
    let finish_photograph = |written: WrittenPhotograph| {
        let WrittenPhotograph { done, started } = written;
        let (uuid, tally) = (done.record.camera_uuid.clone(), done.tally);
        journal.write(Done::Photograph(done))?;
        account.unit_finished(UnitKind::Photograph, number, Some(&uuid), &tally, started);
        Ok(())
    };
    let job = ImageJob {
        layout,
        area: number,
        channels: Channels {
            scene,
            textures: &textures,
            pictures: None,
            normals: options.normals,
            rgb_samples: options.rgb_samples,
            label_of_face: &label_of_face,
            pretty_of_face: &pretty_of_face,
            class_of_face: &class_of_face,
            palette: &palette,
            compression: options.compression,
            conventions: options.conventions(),
        },
        pictures,
        locations,
        rooms: location_rooms,
        is_filled: &is_filled,
        chosen: &chosen,
        photographs: &photographs,
        modalities: &options.modalities,
        size: options.size,
        pano_width: options.pano_width,
        offset_m: area.frame.offset(),
        each: &finish_location,
        each_photograph: &finish_photograph,
    };
    let rendering = account.stage(Stage::Render, Some(number));
    let assets = || write_area_assets(area, file, plan, common);
    let writes_assets = todo.contains(&Unit::Assets(number));
    write_images(ctx, &job, candidates, if writes_assets { Some(&assets) } else { None })?;
    rendering.end();
    Ok(())
}
