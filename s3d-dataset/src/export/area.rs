//! One area of an export: labelled, scored, rendered, with its meshes and points.

use crate::error::Result;
use crate::event::UnitKind;
use crate::export::common::{Common, PreparedMesh};
use crate::export::images::objects::{InstanceFinder, instance_meshes};
use crate::export::images::photographs::{self, WrittenPhotograph};
use crate::export::images::{ImageJob, WrittenLocation, write_images};
use crate::export::input::area::AreaInput;
use crate::export::input::pictures::Pictures;
use crate::export::input::requested::name_of;
use crate::export::labels::label_area::label_files;
use crate::export::location::Surroundings;
use crate::export::modality::{Channels, classes_of_labels, palette};
use crate::export::points::write_points;
use crate::export::scoring::check_faces;
use crate::record::journal::{AssetsDone, Done, LocationDone, Unit, tally_of};
use crate::record::listing;
use crate::stage::Stage;
use crate::survey::annotated::Annotated;
use crate::survey::candidate::Candidate;
use crate::survey::labelled_area::LabelledArea;
use crate::survey::surface_boxes::boxes_of_faces;
use glam::DVec3;
use s3d_io::dataset::{Domain, SourceFaces};
use s3d_io::fs::create_dir;
use s3d_io::image::{Compression, Content, encode_rgb8};
use s3d_io::mesh::{MeshFile, TextureOut};
use s3d_label::LabelId;
use s3d_render::{MipMaps, face_curvatures};
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Instant;

/// Writes an area's meshes and points: everything but its images.
fn write_area_assets(
    area: &AreaInput,
    file: &MeshFile,
    plan: &LabelledArea,
    common: Common<'_>,
) -> Result<()> {
    let ctx = common.account.ctx;
    let Common { table, layout, options, journal, account, .. } = common;
    let number = area.number;
    let started = Instant::now();

    let meshes = account.stage(Stage::Meshes, Some(number));
    let mesh_dir = layout.mesh_dir(number);
    let label_of_face: Vec<u32> = plan.annotated.label_of_face.iter().map(|l| l.0).collect();
    write_colored_mesh(&mesh_dir, file, options.compression)?;
    if area.is_labelled {
        s3d_io::mesh::write_semantic_obj(&mesh_dir, &file.mesh, &label_of_face, &table.names())?;
        if options.semantic_glb {
            let path = layout.semantic_glb(number);
            s3d_io::mesh::write_labelled_glb(&path, &file.mesh, &label_of_face, table)?;
        }
    } else if options.semantic_glb {
        ctx.warn(format_args!("area {number} has no labels: there is no semantic.glb"));
    }
    if let Some(source) = source_faces(area, file) {
        s3d_io::dataset::write_source_faces(&layout.source_faces_npz(number), &source)?;
    }
    meshes.end();
    ctx.check()?;

    let sampling = account.stage(Stage::Points, Some(number));
    let offset_m = area.frame.offset().map_or(DVec3::ZERO, DVec3::from_array);
    let points =
        write_points(ctx, layout, &file.mesh, plan, table, (options.points_per_m2, options.seed), offset_m)?;

    // The files of the labels are another unit's.
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

/// Returns where each face of an area's mesh comes from. `None` for a mesh that no file holds.
fn source_faces(area: &AreaInput, file: &MeshFile) -> Option<SourceFaces> {
    if file.source_faces.is_empty() {
        return None;
    }
    let mut source = SourceFaces { face: file.source_faces.clone(), ..SourceFaces::default() };
    for (index, found) in file.sources.iter().enumerate() {
        source.files.push(name_of(&area.path, &found.path));
        source.file.resize(file.faces_of(index).end as usize, index as u32);
    }
    Some(source)
}

/// Writes the mesh with its textures. A texture that was used unchanged keeps the bytes of its file; any
/// other becomes a PNG.
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

/// Renders the locations and photographs of an area that `todo` holds. Writes the meshes and points of the
/// area at the same time if `todo` holds them.
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
    let Common { layout, options, journal, account, form, .. } = common;
    let LabelledArea { annotated, locations, location_rooms, .. } = plan;
    let PreparedMesh { file, scene } = prepared;
    let number = area.number;
    check_faces(plan, prepared)?;
    create_dir(&layout.mesh_dir(number))?;

    // What the images show of each face.
    let textures = MipMaps::new(&file.mesh);
    let label_of_face: Vec<u32> = annotated.label_of_face.iter().map(|l| l.0).collect();
    let pretty_of_face: Vec<[u8; 3]> = label_of_face.iter().map(|l| s3d_label::pretty_color(*l)).collect();
    let mut class_of_face = Vec::new();
    if options.modalities.contains(&Domain::SemanticClass) {
        let classes = classes_of_labels(common.table);
        class_of_face.extend(label_of_face.iter().map(|label| classes[*label as usize]));
    }
    let mut curvature_of_face = Vec::new();
    if options.modalities.contains(&Domain::PrincipalCurvature) {
        curvature_of_face = face_curvatures(&file.mesh);
    }
    let palette = palette(common.table.taxonomy());
    let instances = if options.modalities.contains(&Domain::Objects) {
        let meshes = instance_meshes(&file.mesh, &label_of_face);
        Some((meshes, boxes_of_faces(&file.mesh, &label_of_face)))
    } else {
        None
    };
    let label_of = |index| common.table.get(LabelId(index)).copied();
    let instances = instances
        .as_ref()
        .map(|(meshes, boxes)| InstanceFinder::new(meshes, &label_of_face, boxes, &label_of));
    let is_filled = filled_faces(annotated);

    // What is rendered.
    let chosen: Vec<bool> = locations
        .iter()
        .map(|l| todo.contains(&Unit::Location(number, l.uuid.clone())))
        .collect();
    let photographs = wanted_photographs(area, Surroundings { scene, annotated, table: common.table }, todo);

    // Each finished unit is written to the journal.
    let finish_location = |written: WrittenLocation| {
        let WrittenLocation { location, tally, files, started } = written;
        let uuid = &locations[location].uuid;
        journal.write(Done::Location(LocationDone { area: number, location: uuid.clone(), tally, files }))?;
        account.unit_finished(UnitKind::Location, number, Some(uuid), &tally, started);
        Ok(())
    };

    let finish_photograph = |written: WrittenPhotograph| {
        let WrittenPhotograph { done, started } = written;
        let uuid = done.record.camera_uuid.clone();
        let tally = done.tally;
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
            curvature_of_face: &curvature_of_face,
            palette: &palette,
            compression: options.compression,
            conventions: options.conventions(),
        },
        instances: instances.as_ref(),
        pictures,
        locations,
        rooms: location_rooms,
        is_filled: &is_filled,
        chosen: &chosen,
        photographs: &photographs,
        modalities: &options.modalities,
        is_bundled: form.is_bundled(),
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

/// Whether each face got its label by filling. Empty if no face did.
fn filled_faces(annotated: &Annotated) -> Vec<bool> {
    if annotated.filled.is_empty() {
        return Vec::new();
    }
    let mut is_filled = vec![false; annotated.label_of_face.len()];
    for face in &annotated.filled {
        is_filled[*face as usize] = true;
    }
    is_filled
}

/// The photographs of an area whose views `todo` holds, each with its room.
fn wanted_photographs<'a>(
    area: &'a AreaInput,
    surroundings: Surroundings<'_>,
    todo: &BTreeSet<&Unit>,
) -> Vec<photographs::Shot<'a>> {
    area.photographs
        .all
        .iter()
        .filter(|p| todo.contains(&Unit::Photograph(area.number, p.uuid.clone())))
        .map(|photograph| {
            let room = surroundings.room_of(photograph.camera.pose.location);
            photographs::Shot { photograph, room }
        })
        .collect()
}
