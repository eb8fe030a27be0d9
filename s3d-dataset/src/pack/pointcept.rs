//! `s3d pack --to pointcept`: the rooms as Pointcept's own preprocessing of S3DIS leaves them, a folder of
//! NPY arrays each.
//!
//! Source: `Pointcept/Pointcept` at d74c646, `pointcept/datasets/preprocessing/s3dis/preprocess_s3dis.py` and
//! `pointcept/datasets/defaults.py`.

use super::destination::Destination;
use super::source::Source;
use crate::context::Context;
use crate::error::{InputError, Result};
use crate::parallel::for_each_in_order;
use crate::profile;
use crate::profile::room::{count_and_min, for_each_piece};
use s3d_geom::NearestFaces;
use s3d_geom::glam::Vec3;
use s3d_io::Error as FileError;
use s3d_io::cloud::{AnnotationTree, InstanceFile, NpyWriter, RoomFiles, TreeOptions, s3dis_coordinate};
use s3d_io::fs::create_dir;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Writes a folder for each room. Returns notes on how to use them.
pub(super) fn pack(ctx: &Context, source: &Source, destination: &Destination) -> Result<Vec<String>> {
    let areas = pack_areas(ctx, source, destination, &|_| Ok(()))?;
    let splits: Vec<String> = areas.keys().map(|area| format!("Area_{area}")).collect();
    Ok(vec![
        format!(
            "S3DISDataset(data_root=FOLDER, split=SPLIT) of Pointcept has the splits {}",
            splits.join(", ")
        ),
        "coord is in the world's frame, metres; segment is the place of the class in the taxonomy, from 0"
            .to_owned(),
    ])
}

/// A room that was written.
pub(super) struct WrittenRoom<'a> {
    pub(super) area: u32,
    pub(super) name: String,
    /// Its points, in the order of its arrays.
    pub(super) points: &'a [Vec3],
}

/// Writes a folder for each room, and hands the room to `then`. Returns the rooms of each area that has some.
pub(super) fn pack_areas(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
    then: &(dyn Fn(&WrittenRoom<'_>) -> Result<()> + Sync),
) -> Result<BTreeMap<u32, Vec<String>>> {
    let data = &source.data;
    if !data.manifest.is_labelled() {
        let dataset = data.layout.root().to_owned();
        return Err(InputError::WithoutLabels { dataset, needs: "Pointcept's rooms need" }.into());
    }

    let tree = profile::Source { ctx, layout: &data.layout, files: &data.files, taxonomy: &data.taxonomy };
    let mut areas = BTreeMap::new();
    for &area in &source.areas {
        let rooms = rooms_of(source, area)?;
        if rooms.is_empty() {
            ctx.warn(format_args!("area {area} has no room with points: it is left out"));
            continue;
        }

        let Some(file) = data.mesh(area)? else {
            let message = "there is no mesh: finish the export";
            return Err(FileError::format(&data.layout.rgb_obj(area), message).into());
        };
        let faces = NearestFaces::new(&file.mesh);
        let progress = ctx.progress("packing", "rooms", rooms.len() as u64);
        for_each_in_order(
            ctx,
            &rooms,
            || (),
            |(), room| {
                let name = room.room.to_string();
                let folder = destination.path().join(format!("Area_{area}")).join(&name);
                let points = write_room(&tree, &faces, room, &folder)?;
                then(&WrittenRoom { area, name, points: &points })?;
                progress.add(1);
                Ok(())
            },
        )?;
        areas.insert(area, rooms.iter().map(|room| room.room.to_string()).collect());
    }

    if areas.is_empty() {
        let what = "rooms with points".to_owned();
        return Err(InputError::NothingToPack { dataset: data.layout.root().to_owned(), what }.into());
    }
    Ok(areas)
}

/// Returns the rooms of an area that have points. Instances are in the order of their files' names, which is
/// the order of Pointcept's numbers.
fn rooms_of(source: &Source, area: u32) -> Result<Vec<RoomFiles>> {
    let folder = source.data.layout.s3dis_area_dir(area);
    let is_instance = |path: &PathBuf| path.parent().is_some_and(|parent| parent.ends_with("Annotations"));
    if !source.data.files.below(&folder).iter().any(is_instance) {
        return Ok(Vec::new());
    }
    let options = TreeOptions { taxonomy: source.data.taxonomy.clone(), ..TreeOptions::default() };
    let mut rooms = AnnotationTree::open_with(&folder, &options)?.rooms;
    for room in &mut rooms {
        room.instances
            .sort_by(|a, b| a.path.file_name().cmp(&b.path.file_name()));
    }
    Ok(rooms)
}

/// Writes the arrays of a room: N × 3 coordinates (`<f4`, metres), colours (`|u1`) and normals (`<f4`, those
/// of the nearest faces), N × 1 classes and instances (`<i2`). Returns the coordinates.
fn write_room(
    tree: &profile::Source<'_>,
    faces: &NearestFaces<'_>,
    room: &RoomFiles,
    folder: &Path,
) -> Result<Vec<Vec3>> {
    let counts = room
        .instances
        .iter()
        .map(|instance| Ok(count_and_min(tree, &instance.path)?.0));
    let total = counts.sum::<Result<u64>>()?;
    create_dir(folder)?;
    let array =
        |name: &str, kind: &str, columns: u64| NpyWriter::create(&folder.join(name), kind, &[total, columns]);
    let mut coordinates = array("coord.npy", "<f4", 3)?;
    let mut colors = array("color.npy", "|u1", 3)?;
    let mut normals = array("normal.npy", "<f4", 3)?;
    let mut segments = array("segment.npy", "<i2", 1)?;
    let mut instances = array("instance.npy", "<i2", 1)?;

    let mut all = Vec::with_capacity(total as usize);
    let mut nearest = Vec::new();
    for (number, instance) in room.instances.iter().enumerate() {
        let class = short(instance.class.index(), instance)?;
        let number = short(number, instance)?;
        for_each_piece(tree, &instance.path, |piece| {
            let points: Vec<Vec3> = piece
                .positions
                .iter()
                .map(|p| Vec3::from_array(p.to_array().map(|c| s3dis_coordinate(c) as f32)))
                .collect();
            faces.nearest_many(&points, &mut nearest);
            let of_faces: Vec<Vec3> = nearest.iter().map(|found| faces.mesh().normal(found.face)).collect();

            coordinates.put(&bytes_of(&points))?;
            colors.put(piece.colors.as_flattened())?;
            normals.put(&bytes_of(&of_faces))?;
            segments.put(&class.to_le_bytes().repeat(points.len()))?;
            all.extend(&points);
            Ok(instances.put(&number.to_le_bytes().repeat(points.len()))?)
        })?;
    }

    for array in [coordinates, colors, normals, segments, instances] {
        array.finish()?;
    }
    Ok(all)
}

/// Returns a number as the arrays have it.
fn short(number: usize, instance: &InstanceFile) -> Result<i16, FileError> {
    let beyond = |_| {
        let message = format!("is number {number} of its room, and Pointcept's arrays end at {}", i16::MAX);
        FileError::format(&instance.path, message)
    };
    i16::try_from(number).map_err(beyond)
}

fn bytes_of(vectors: &[Vec3]) -> Vec<u8> {
    vectors
        .iter()
        .flat_map(|vector| vector.to_array())
        .flat_map(f32::to_le_bytes)
        .collect()
}
