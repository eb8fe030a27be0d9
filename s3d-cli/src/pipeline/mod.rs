//! The export: load → label → sample → score → select → render → tables. The one place that composes the stages.

pub(crate) mod annotate;
mod assets;
pub(crate) mod images;
pub(crate) mod inputs;
pub(crate) mod location;
pub(crate) mod manifest;
pub(crate) mod modality;
pub(crate) mod output;
pub(crate) mod pictures;
pub(crate) mod place;
pub(crate) mod points;
pub(crate) mod profiles;
pub(crate) mod records;
pub(crate) mod statistics;
pub(crate) mod views;
pub(crate) mod work;

use crate::args::ExportOptions;
use crate::failure::{Failure, Outcome};
use annotate::{Annotated, annotate, hidden_instances, label_doubts};
use images::{ImageCount, ImageJob, write_images};
use inputs::{AreaInput, Cameras, Inputs};
use location::{Outlook, room_of};
use manifest::{AreaEntry, Manifest, XyzLoss};
use modality::Look;
use pictures::Pictures;
use place::{Ground, Located, Placement, place_locations};
use points::{check_density, write_points};
use s3d_geom::{Density, NearestFaces};
use s3d_io::{
    Compression, Content, Domain, InstanceRecord, InstanceWriter, Layout, MeshFile, ScanLocation, TextureOut,
    create_dir, encode_rgb8,
};
use s3d_label::{LabelTable, Room};
use s3d_render::{Normals, Pyramids, Scene};
use s3d_sample::folds;
use statistics::Statistics;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;
use tracing::{debug, info, warn};
use views::{Candidate, Scoring, score_area, select};

/// What an export writes to.
pub(crate) struct Target<'a> {
    pub(crate) layout: Layout,
    /// Whether OUT may hold something already.
    pub(crate) overwrite: bool,
    /// Names in OUT that do not count as something.
    pub(crate) allowed: &'a [&'a str],
}

/// An area between its labelling and its rendering.
struct LabelledArea {
    annotated: Annotated,
    locations: Vec<ScanLocation>,
    /// The room of each location.
    location_rooms: Vec<Room>,
    entry: AreaEntry,
}

/// What all areas share.
#[derive(Clone, Copy)]
struct Common<'a> {
    table: &'a LabelTable,
    layout: &'a Layout,
    options: &'a ExportOptions,
}

/// A mesh that is ready for rays.
struct Stage<'m> {
    file: &'m MeshFile,
    scene: Scene<'m>,
}

impl<'m> Stage<'m> {
    /// Prepares the mesh, and at the same time its nearest faces, which are needed for its labels only.
    fn new(file: &'m MeshFile) -> (Self, NearestFaces<'m>) {
        let (scene, nearest) = rayon::join(|| Scene::new(&file.mesh), || NearestFaces::new(&file.mesh));
        (Self { file, scene }, nearest)
    }

    /// Prepares the mesh for rays alone.
    fn for_rays(file: &'m MeshFile) -> Self {
        Self { file, scene: Scene::new(&file.mesh) }
    }
}

/// Turns scenes into a data set.
pub(crate) fn export(scenes: &[PathBuf], target: &Target<'_>, options: &ExportOptions) -> Outcome<()> {
    let started = Instant::now();
    let layout = &target.layout;
    output::check(layout, target.overwrite, target.allowed)?;
    debug!("{options:?}");
    let inputs = Inputs::open(scenes, options.place_cameras, options.lenient)?;
    check_only(&inputs, &options.only)?;
    output::check_inputs(layout, &inputs)?;
    let areas = inputs.numbers();
    check_label_count(inputs.table.len() - 1)?;
    let mut pictures = Vec::new();
    for area in &inputs.areas {
        pictures.push(area_pictures(area, options)?);
    }
    // Every mesh is read before OUT is touched, so that a bad one costs nothing that was there. That of a single area is
    // kept from then on; several are read again where they are needed, so that they never share memory.
    let mut single: Option<MeshFile> = None;
    for area in &inputs.areas {
        let file = area.read_mesh()?;
        area.tell_mesh(&file);
        check_density(&file.mesh, options.points_per_m2)?;
        single = (inputs.areas.len() == 1).then_some(file);
    }
    let (single, mut nearest) = single.as_ref().map(Stage::new).unzip();

    let previous = output::prepare(layout, &areas)?;
    let manifest = Manifest::begin(options, &areas, inputs.table.len());
    manifest.write(layout)?;
    create_dir(&layout.assets_dir())?;
    let mut names = inputs.table.names();
    s3d_io::pad_labels(&mut names, options.format.pad_labels.0);
    s3d_io::write_labels(&layout.labels_json(), &names)?;
    assets::write(layout, options.format.conventions())?;

    let common = Common { table: &inputs.table, layout, options };
    let mut labelled = Vec::new();
    let mut candidates = Vec::new();
    for area in &inputs.areas {
        let mut label = |stage: &Stage<'_>, nearest: NearestFaces<'_>| {
            label_area(area, stage, nearest, common, &mut candidates)
        };
        labelled.push(match (&single, nearest.take()) {
            (Some(stage), Some(nearest)) => label(stage, nearest)?,
            _ => {
                let file = area.read_mesh()?;
                let (stage, nearest) = Stage::new(&file);
                label(&stage, nearest)?
            }
        });
    }
    check_only_placed(&labelled, &options.only)?;
    let locations: usize = labelled.iter().map(|l| l.locations.len()).sum();
    select(&mut candidates, options.pool, options.keep_all, options.seed);
    let kept = candidates.iter().filter(|c| c.frame_num.is_some()).count();
    info!("selected {kept} of {} candidate views", candidates.len());

    let mut entries = Vec::new();
    let mut images = ImageCount::default();
    for ((area, labelled), pictures) in inputs.areas.iter().zip(labelled).zip(&pictures) {
        records::write_views(layout, area.number, &candidates)?;
        let render = |stage: &Stage<'_>| {
            let pictures = pictures.as_ref();
            render_area(area, stage, labelled, pictures, common, &candidates)
        };
        let (entry, count) = match &single {
            Some(stage) => render(stage)?,
            None => render(&Stage::for_rays(&area.read_mesh()?))?,
        };
        images.panoramas += count.panoramas;
        images.views += count.views;
        entries.push(entry);
    }

    let folds = folds(&areas);
    records::write_splits(layout, &folds)?;
    records::write_lists(layout, &areas, &folds)?;
    profiles::write(layout, &areas, &options.format.profiles)?;
    Statistics::count(layout, &areas)?.write(layout)?;
    manifest.complete(layout, entries)?;
    previous.discard()?;
    info!(
        "{}: {} panoramas and {} views of {} locations in {:.1} s",
        layout.root().display(),
        images.panoramas,
        images.views,
        locations,
        started.elapsed().as_secs_f64()
    );
    Ok(())
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
    only_known(inputs.areas.iter().flat_map(|a| a.cameras.listed()), only)
}

/// The same for all locations.
fn check_only_placed(areas: &[LabelledArea], only: &[String]) -> Outcome<()> {
    only_known(areas.iter().flat_map(|a| &a.locations), only)
}

fn only_known<'a>(locations: impl Iterator<Item = &'a ScanLocation>, only: &[String]) -> Outcome<()> {
    let known: BTreeSet<&str> = locations.map(|l| l.uuid.as_str()).collect();
    match only.iter().find(|uuid| !known.contains(uuid.as_str())) {
        Some(uuid) => Err(Failure::Call(format!("--only {uuid}: no scan location has this uuid"))),
        None => Ok(()),
    }
}

/// An area's scan locations, each with its room: those that are listed, or some that are placed.
pub(crate) fn locate(
    area: &AreaInput,
    scene: &Scene<'_>,
    nearest: &NearestFaces<'_>,
    annotated: &Annotated,
    table: &LabelTable,
    seed: u64,
) -> Outcome<Located> {
    match &area.cameras {
        Cameras::Listed(locations, rooms) => {
            let is_known = |room: &Room| annotated.rooms.iter().any(|r| r.room == *room);
            let room = |l: &ScanLocation, told: Option<Room>| {
                told.filter(is_known).unwrap_or_else(|| room_of(&annotated.rooms, l.pose.location))
            };
            Ok(locations.iter().zip(rooms).map(|(l, told)| (l.clone(), room(l, *told))).collect())
        }
        Cameras::Placed(distance_m) => {
            let ground = Ground {
                area: area.number,
                scene,
                nearest,
                face_labels: &annotated.face_labels,
                table,
                rooms: &annotated.rooms,
            };
            let (placed, warnings) = place_locations(&ground, Placement { distance_m: *distance_m, seed })?;
            warnings.iter().for_each(|w| warn!("{w}"));
            info!("area {}: {} scan locations placed", area.number, placed.len());
            Ok(placed)
        }
    }
}

/// Labels an area, writes what is known of it then, and adds its scored candidates to `candidates`.
fn label_area(
    area: &AreaInput,
    stage: &Stage<'_>,
    nearest: NearestFaces<'_>,
    Common { table, layout, options }: Common<'_>,
    candidates: &mut Vec<Candidate>,
) -> Outcome<LabelledArea> {
    let number = area.number;
    let Stage { file, scene } = stage;
    let mesh = &file.mesh;
    create_dir(&layout.mesh_dir(number))?;

    let started = Instant::now();
    let mut instances =
        InstanceWriter::create(&layout.instances_json(number), &layout.instances_npz(number))?;
    let annotated = annotate(area, &nearest, table, |i| {
        instances.push(&InstanceRecord {
            label: &i.label.to_string(),
            label_index: i.id.0,
            class: i.label.class.name(),
            room: &i.label.room.to_string(),
            bbox: i.voxels.grid.bbox.to_array(),
            starts: &i.voxels.starts,
            members: &i.voxels.members,
        })?;
        Ok(())
    })?;
    instances.finish()?;
    tell_labels(&annotated, started);
    if let Some(w) = annotated.skipped.sentence() {
        warn!("{w}");
    }
    if let Some(w) = hidden_instances(area, &annotated.face_labels, table) {
        warn!("{w}");
    }
    records::write_rooms(layout, number, &annotated)?;
    records::write_votes(layout, number, &annotated.report)?;
    records::write_instance_numbers(layout, area)?;

    let located = locate(area, scene, &nearest, &annotated, table, options.seed)?;
    drop(nearest);
    let (locations, location_rooms): (Vec<ScanLocation>, Vec<Room>) = located.into_iter().unzip();
    for location in &locations {
        Outlook::of(scene, location).warnings(location).iter().for_each(|w| warn!("{w}"));
    }
    let scoring = Scoring {
        views: options.views,
        size: options.size,
        stride: options.entropy_stride,
        seed: options.seed,
    };
    let started = Instant::now();
    candidates.extend(score_area(number, &locations, scene, &annotated.face_labels, table, scoring)?);
    debug!(
        "area {number}: {} candidates scored ({:.1} s)",
        candidates.len(),
        started.elapsed().as_secs_f64()
    );

    let entry = AreaEntry {
        area: number,
        faces: mesh.faces().len(),
        faces_left_out: mesh.report().zero_area_faces + file.repeated_faces,
        points: 0,
        annotated_points: annotated.points,
        rooms: annotated.rooms.len(),
        locations: locations.len(),
        panoramas: 0,
        views: 0,
        xyz: XyzLoss::of(mesh.aabb(), options.format.xyz),
        rgb: area.pictures.as_ref().map_or("texture", |p| p.kind.name()).to_owned(),
        place_cameras: match area.cameras {
            Cameras::Placed(distance_m) => Some(distance_m),
            Cameras::Listed(..) => None,
        },
    };
    Ok(LabelledArea { annotated, locations, location_rooms, entry })
}

/// Writes an area's meshes and points, all but its images. Returns how many points there are.
fn write_area(
    area: &AreaInput,
    file: &MeshFile,
    annotated: &Annotated,
    Common { table, layout, options }: Common<'_>,
) -> Outcome<u64> {
    let mesh_dir = layout.mesh_dir(area.number);
    let per_face: Vec<u32> = annotated.face_labels.iter().map(|l| l.0).collect();
    write_colored_mesh(&mesh_dir, file, options.compression)?;
    s3d_io::write_semantic_obj(&mesh_dir, &file.mesh, &per_face, &table.names())?;
    let density = Density::PerM2(options.points_per_m2);
    let started = Instant::now();
    let points = write_points(layout, area, &file.mesh, annotated, table, density, options.seed)?;
    debug!("{points} points sampled ({:.1} s)", started.elapsed().as_secs_f64());
    Ok(points)
}

/// Writes the mesh with its textures: their files as they were found, where they were used as they are.
fn write_colored_mesh(dir: &Path, file: &MeshFile, compression: Compression) -> Outcome<()> {
    let files: Vec<(String, Cow<'_, [u8]>)> = file
        .mesh
        .textures()
        .iter()
        .zip(&file.texture_files)
        .map(|(texture, found)| {
            let stem = Path::new(&texture.name).file_stem().unwrap_or_default().to_string_lossy();
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
    s3d_io::write_rgb_obj(dir, &file.mesh, &textures)?;
    Ok(())
}

fn tell_labels(annotated: &Annotated, started: Instant) {
    let total = &annotated.report.total;
    let faces = annotated.face_labels.len();
    info!(
        "{} annotated points labelled {} of {faces} faces ({:.1} s)",
        annotated.points,
        total.faces,
        started.elapsed().as_secs_f64()
    );
    for (_, room, row) in &annotated.report.rooms {
        debug!("{room}: {} points, {} faces, {} of them contested", row.points, row.faces, row.contested);
    }
    label_doubts(&annotated.report).iter().for_each(|w| warn!("{w}"));
}

/// Renders the images of an area, and beside them writes its meshes and points.
fn render_area(
    area: &AreaInput,
    stage: &Stage<'_>,
    labelled: LabelledArea,
    pictures: Option<&Pictures>,
    common: Common<'_>,
    candidates: &[Candidate],
) -> Outcome<(AreaEntry, ImageCount)> {
    let Common { layout, options, .. } = common;
    let LabelledArea { annotated, locations, location_rooms, mut entry } = labelled;
    let Stage { file, scene } = stage;
    let textures = Pyramids::new(&file.mesh);
    let label_per_face: Vec<u32> = annotated.face_labels.iter().map(|l| l.0).collect();
    let pretty_per_face: Vec<[u8; 3]> = label_per_face.iter().map(|l| s3d_io::pretty_color(*l)).collect();
    let chosen: Vec<bool> =
        locations.iter().map(|l| options.only.is_empty() || options.only.contains(&l.uuid)).collect();
    let job = ImageJob {
        layout,
        area: area.number,
        look: Look {
            scene,
            textures: &textures,
            pictures: None,
            normals: if options.smooth_normals { Normals::Smooth } else { Normals::Flat },
            label_per_face: &label_per_face,
            pretty_per_face: &pretty_per_face,
            compression: options.compression,
            conventions: options.format.conventions(),
        },
        pictures,
        locations: &locations,
        rooms: &location_rooms,
        chosen: &chosen,
        modalities: &options.modalities,
        size: options.size,
        pano_width: options.pano_width,
    };
    let started = Instant::now();
    let points = OnceLock::new();
    let count = write_images(&job, candidates, &|| {
        let _ = points.set(write_area(area, file, &annotated, common)?);
        Ok(())
    })?;
    debug!(
        "area {}: {} panoramas and {} views rendered ({:.1} s)",
        area.number,
        count.panoramas,
        count.views,
        started.elapsed().as_secs_f64()
    );
    entry.points = points.into_inner().unwrap_or_default();
    Ok((entry.with_images(count), count))
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
