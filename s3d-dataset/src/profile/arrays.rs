//! PointNet and mmdetection3d: the points of a room in numpy arrays.
//!
//! **PointNet** (`sem_seg/indoor3d_util.py`, and the many projects that copied it) turns each room of the
//! tree into `stanford_indoor3d/Area_1_office_3.npy`: float64, N × 7, with rows `x y z r g b label`. The
//! room is moved so that its smallest coordinates are 0. The label is the class: ceiling 0, floor 1, wall 2,
//! beam 3, column 4, window 5, door 6, table 7, chair 8, sofa 9, bookcase 10, board 11, clutter 12. The lists
//! in `meta/` name the rooms. `anno_paths.txt` and `all_data_label.txt` replace the loader's own, which name
//! the 272 published rooms.
//!
//! **mmdetection3d** (`data/s3dis/indoor3d_util.py`) turns each room, in `s3dis_data/`, into
//! `Area_1_office_3_point.npy` (float32, N × 6, moved in the same way), `…_sem_label.npy` (int64, N, the
//! same classes) and `…_ins_label.npy` (int64, N, instances from 1, 0 for none). Its `create_data.py s3dis`
//! then lists the rooms by the folders of `Stanford3dDataset_v1.2_Aligned_Version/Area_{1..6}`, and all six
//! must exist. They are made here, with an empty folder for each room, since the points are in the arrays.
//! The loader numbers instances in the order in which the system lists files; here it is the order of their
//! names.
//!
//! Colours are the tree's, from 0 to 255.

use super::room::{TreeRoom, count_and_min, for_each_piece};
use super::{AREAS_OF_LOADERS, Source, for_each_room, write_lines};
use crate::error::Result;
use s3d_io::cloud::{NpyWriter, s3dis_coordinate};
use s3d_io::fs::create_dir;
use std::path::Path;

/// Returns the number of points of each instance of a room, and the smallest coordinates of all.
fn survey(source: &Source<'_>, room: &TreeRoom) -> Result<(Vec<u64>, [f64; 3])> {
    let mut counts = Vec::new();
    let mut min = [f64::INFINITY; 3];
    for instance in &room.instances {
        let (count, corner) = count_and_min(source, &instance.path)?;
        counts.push(count);
        min = std::array::from_fn(|k| min[k].min(corner[k]));
    }
    Ok((counts, min))
}

/// Writes the arrays and lists of PointNet.
pub(super) fn write_pointnet(source: &Source<'_>, dir: &Path, rooms: &[TreeRoom]) -> Result<()> {
    let arrays = dir.join("stanford_indoor3d");
    let meta = dir.join("meta");

    create_dir(&arrays)?;
    create_dir(&meta)?;

    write_lines(&meta.join("anno_paths.txt"), rooms.iter().map(TreeRoom::annotations))?;
    write_lines(&meta.join("all_data_label.txt"), rooms.iter().map(|r| format!("{}.npy", r.stem())))?;

    for_each_room(source.ctx, rooms, |room| {
        let (counts, min) = survey(source, room)?;
        let path = arrays.join(format!("{}.npy", room.stem()));
        let mut array = NpyWriter::create(&path, "<f8", &[counts.iter().sum(), 7])?;
        let mut bytes = Vec::new();

        for instance in &room.instances {
            let class = instance.class.index() as f64;
            for_each_piece(source, &instance.path, |piece| {
                bytes.clear();
                for (p, color) in piece.positions.iter().zip(&piece.colors) {
                    let place = std::array::from_fn::<f64, 3, _>(|k| s3dis_coordinate(p[k]) - min[k]);
                    let row = place.into_iter().chain(color.map(f64::from)).chain([class]);
                    bytes.extend(row.flat_map(f64::to_le_bytes));
                }
                Ok(array.put(&bytes)?)
            })?;
        }

        array.finish()?;
        Ok(())
    })
}

/// Writes the arrays, lists and folders of mmdetection3d.
pub(super) fn write_mmdet3d(source: &Source<'_>, dir: &Path, rooms: &[TreeRoom]) -> Result<()> {
    let arrays = dir.join("s3dis_data");
    let meta = dir.join("meta_data");
    let tree = dir.join("Stanford3dDataset_v1.2_Aligned_Version");
    create_dir(&arrays)?;
    create_dir(&meta)?;

    for area in AREAS_OF_LOADERS {
        create_dir(&tree.join(format!("Area_{area}")))?;
    }
    for room in rooms {
        create_dir(&tree.join(format!("Area_{}", room.area)).join(&room.name))?;
    }

    write_lines(&meta.join("anno_paths.txt"), rooms.iter().map(TreeRoom::annotations))?;

    for_each_room(source.ctx, rooms, |room| {
        let (counts, min) = survey(source, room)?;
        let total = counts.iter().sum();
        let path = |kind: &str| arrays.join(format!("{}_{kind}.npy", room.stem()));
        let mut points = NpyWriter::create(&path("point"), "<f4", &[total, 6])?;
        let mut classes = NpyWriter::create(&path("sem_label"), "<i8", &[total])?;
        let mut numbers = NpyWriter::create(&path("ins_label"), "<i8", &[total])?;

        let mut bytes = Vec::new();
        for (number, instance) in (1i64..).zip(&room.instances) {
            let class = instance.class.index() as i64;
            for_each_piece(source, &instance.path, |piece| {
                bytes.clear();
                for (p, color) in piece.positions.iter().zip(&piece.colors) {
                    let place =
                        std::array::from_fn::<f32, 3, _>(|k| (s3dis_coordinate(p[k]) - min[k]) as f32);
                    bytes.extend(place.into_iter().chain(color.map(f32::from)).flat_map(f32::to_le_bytes));
                }
                points.put(&bytes)?;
                classes.put(&class.to_le_bytes().repeat(piece.len()))?;
                Ok(numbers.put(&number.to_le_bytes().repeat(piece.len()))?)
            })?;
        }

        points.finish()?;
        classes.finish()?;
        numbers.finish()?;
        Ok(())
    })
}
