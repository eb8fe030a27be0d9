//! The export: load → label → sample → score → select → render → tables. The one place that composes the stages.

pub(crate) mod annotate;
pub(crate) mod images;
pub(crate) mod inputs;
pub(crate) mod location;
pub(crate) mod manifest;
pub(crate) mod modality;
pub(crate) mod output;
pub(crate) mod pictures;
pub(crate) mod points;
pub(crate) mod records;
pub(crate) mod statistics;
pub(crate) mod views;
pub(crate) mod work;

use crate::args::ExportOptions;
use crate::failure::{Failure, Outcome};
use annotate::{Annotated, annotate, hidden_instances, label_doubts};
use images::{ImageCount, ImageJob, write_images};
use inputs::{AreaInput, Inputs};
use location::{Outlook, room_of};
use manifest::{AreaEntry, Manifest, XyzLoss};
use modality::Look;
use pictures::Pictures;
use points::{check_density, write_points};
use s3d_geom::Density;
use s3d_io::{
    Compression, Content, Domain, InstanceRecord, InstanceWriter, Layout, MeshFile, TextureOut, create_dir,
    encode_rgb8,
};
use s3d_label::{LabelId, LabelTable, Room};
use s3d_render::{Normals, Pyramids, Scene};
use s3d_sample::folds;
use statistics::Statistics;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
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
    face_labels: Vec<LabelId>,
    /// The room of each location.
    location_rooms: Vec<Room>,
    entry: AreaEntry,
    /// Its mesh and textures: kept if it is the only area, else read again for the images.
    file: Option<MeshFile>,
}

/// Turns scenes into a data set.
pub(crate) fn export(scenes: &[PathBuf], target: &Target<'_>, options: &ExportOptions) -> Outcome<()> {
    let started = Instant::now();
    let layout = &target.layout;
    output::check(layout, target.overwrite, target.allowed)?;
    debug!("{options:?}");
    let inputs = Inputs::open(scenes)?;
    check_only(&inputs, &options.only)?;
    output::check_inputs(layout, &inputs)?;
    let areas = inputs.numbers();
    let mut pictures = Vec::new();
    for area in &inputs.areas {
        pictures.push(area_pictures(area, options)?);
    }
    // Every mesh is read before OUT is touched, so that a bad one costs nothing that was there.
    let mut files: Vec<Option<MeshFile>> = Vec::new();
    for area in &inputs.areas {
        let file = area.read_mesh()?;
        area.tell_mesh(&file);
        check_density(&file.mesh, options.points_per_m2)?;
        files.push((inputs.areas.len() == 1).then_some(file));
    }

    let previous = output::prepare(layout, &areas)?;
    let manifest = Manifest::begin(options, &areas, inputs.table.len());
    manifest.write(layout)?;
    create_dir(&layout.assets_dir())?;
    s3d_io::write_labels(&layout.labels_json(), &inputs.table.names())?;

    let mut labelled = Vec::new();
    let mut candidates = Vec::new();
    for (area, file) in inputs.areas.iter().zip(&mut files) {
        labelled.push(label_area(area, file.take(), &inputs.table, layout, options, &mut candidates)?);
    }
    select(&mut candidates, options.pool, options.keep_all, options.seed);
    let kept = candidates.iter().filter(|c| c.frame_num.is_some()).count();
    info!("selected {kept} of {} candidate views", candidates.len());

    let mut entries = Vec::new();
    let mut images = ImageCount::default();
    for ((area, labelled), pictures) in inputs.areas.iter().zip(labelled).zip(&pictures) {
        records::write_views(layout, area.scene.area, &candidates)?;
        let (entry, count) = render_area(area, labelled, pictures.as_ref(), layout, options, &candidates)?;
        images.panoramas += count.panoramas;
        images.views += count.views;
        entries.push(entry);
    }

    records::write_splits(layout, &folds(&areas))?;
    Statistics::count(layout, &areas)?.write(layout)?;
    manifest.complete(layout, entries)?;
    previous.discard()?;
    info!(
        "{}: {} panoramas and {} views of {} locations in {:.1} s",
        layout.root().display(),
        images.panoramas,
        images.views,
        inputs.areas.iter().map(|a| a.locations.len()).sum::<usize>(),
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

/// Refuses a `--only` that names no location.
fn check_only(inputs: &Inputs, only: &[String]) -> Outcome<()> {
    for uuid in only {
        if !inputs.areas.iter().flat_map(|a| &a.locations).any(|l| l.uuid == *uuid) {
            return Err(Failure::Call(format!("--only {uuid}: no scan location has this uuid")));
        }
    }
    Ok(())
}

/// Labels an area, writes everything of it but the images, and adds its scored candidates to `candidates`.
fn label_area(
    area: &AreaInput,
    file: Option<MeshFile>,
    table: &LabelTable,
    layout: &Layout,
    options: &ExportOptions,
    candidates: &mut Vec<Candidate>,
) -> Outcome<LabelledArea> {
    let number = area.scene.area;
    // A mesh that was kept is handed on; one of several areas is read anew for each stage, so that they never share memory.
    let keep = file.is_some();
    let file = match file {
        Some(file) => file,
        None => area.read_mesh()?,
    };
    let mesh = &file.mesh;
    let mesh_dir = layout.mesh_dir(number);
    create_dir(&mesh_dir)?;

    let started = Instant::now();
    let mut instances =
        InstanceWriter::create(&layout.instances_json(number), &layout.instances_npz(number))?;
    let annotated = annotate(area, mesh, table, |i| {
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
    if let Some(w) = hidden_instances(area, &annotated.face_labels, table) {
        warn!("{w}");
    }
    records::write_rooms(layout, number, &annotated)?;
    records::write_votes(layout, number, &annotated.report)?;
    records::write_instance_numbers(layout, area)?;

    let names = table.names();
    let per_face: Vec<u32> = annotated.face_labels.iter().map(|l| l.0).collect();
    write_colored_mesh(&mesh_dir, &file, options.compression)?;
    s3d_io::write_semantic_obj(&mesh_dir, mesh, &per_face, &names)?;
    let density = Density::PerM2(options.points_per_m2);
    let started = Instant::now();
    let points = write_points(layout, area, mesh, &annotated, table, density, options.seed)?;

    debug!("{points} points sampled ({:.1} s)", started.elapsed().as_secs_f64());

    let scene = Scene::new(mesh);
    let mut location_rooms = Vec::new();
    for location in &area.locations {
        Outlook::of(&scene, location).warnings(location).iter().for_each(|w| warn!("{w}"));
        location_rooms.push(room_of(&annotated.rooms, location.pose.location));
    }
    let scoring = Scoring {
        views: options.views,
        size: options.size,
        stride: options.entropy_stride,
        seed: options.seed,
    };
    let started = Instant::now();
    candidates.extend(score_area(number, &area.locations, &scene, &annotated.face_labels, table, scoring)?);
    debug!(
        "area {number}: {} candidates scored ({:.1} s)",
        candidates.len(),
        started.elapsed().as_secs_f64()
    );
    drop(scene);

    let entry = AreaEntry {
        area: number,
        faces: mesh.faces().len(),
        faces_left_out: mesh.report().zero_area_faces + file.repeated_faces,
        points,
        annotated_points: annotated.points,
        rooms: annotated.rooms.len(),
        locations: area.locations.len(),
        panoramas: 0,
        views: 0,
        xyz: XyzLoss::of(mesh.aabb()),
        rgb: area.scene.pictures.as_ref().map_or("texture", |p| p.kind.name()),
    };
    let file = keep.then_some(file);
    Ok(LabelledArea { face_labels: annotated.face_labels, location_rooms, entry, file })
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

/// Renders the images of an area.
fn render_area(
    area: &AreaInput,
    labelled: LabelledArea,
    pictures: Option<&Pictures>,
    layout: &Layout,
    options: &ExportOptions,
    candidates: &[Candidate],
) -> Outcome<(AreaEntry, ImageCount)> {
    let mesh = match labelled.file {
        Some(file) => file.mesh,
        None => area.read_mesh()?.mesh,
    };
    let scene = Scene::new(&mesh);
    let textures = Pyramids::new(&mesh);
    let label_per_face: Vec<u32> = labelled.face_labels.iter().map(|l| l.0).collect();
    let pretty_per_face: Vec<[u8; 3]> = label_per_face.iter().map(|l| s3d_io::pretty_color(*l)).collect();
    let chosen: Vec<bool> =
        area.locations.iter().map(|l| options.only.is_empty() || options.only.contains(&l.uuid)).collect();
    let job = ImageJob {
        layout,
        area: area.scene.area,
        look: Look {
            scene: &scene,
            textures: &textures,
            pictures: None,
            normals: if options.smooth_normals { Normals::Smooth } else { Normals::Flat },
            label_per_face: &label_per_face,
            pretty_per_face: &pretty_per_face,
            compression: options.compression,
        },
        pictures,
        locations: &area.locations,
        rooms: &labelled.location_rooms,
        chosen: &chosen,
        modalities: &options.modalities,
        size: options.size,
        pano_width: options.pano_width,
    };
    let started = Instant::now();
    let count = write_images(&job, candidates)?;
    debug!(
        "area {}: {} panoramas and {} views rendered ({:.1} s)",
        area.scene.area,
        count.panoramas,
        count.views,
        started.elapsed().as_secs_f64()
    );
    Ok((labelled.entry.with_images(count), count))
}
