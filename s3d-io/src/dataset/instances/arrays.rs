//! Reads `instances.npz` back.

use crate::cloud::npy::npz::{NpzReader, check_header, damaged, numbers};
use crate::error::{Error, Result};
use crate::fs::open::open_file;
use std::io::{Read, Seek};
use std::path::Path;

/// The arrays of `instances.npz`. [`InstanceWriter`](crate::dataset::InstanceWriter) gives their shapes.
#[derive(Clone, Debug, PartialEq)]
pub struct InstanceArrays {
    /// The label of each instance.
    pub labels: Vec<String>,
    /// The index of the instance's label in `semantic_labels.json`.
    pub label_index: Vec<u32>,
    /// The box of the instance: smallest x y z, largest x y z, world metres.
    pub bbox: Vec<[f32; 6]>,
    /// 216 numbers for each instance: 1 if the voxel holds a point, else 0.
    pub voxel_occupancy: Vec<u8>,
    /// 216 numbers for each instance.
    pub points_per_voxel: Vec<u32>,
    /// One number more than instances. The points of instance i are
    /// `point_index[point_start[i]..point_start[i + 1]]`.
    pub point_start: Vec<u64>,
}

/// Reads the arrays that [`InstanceWriter`](crate::dataset::InstanceWriter) wrote, a few kilobytes for each
/// instance. The members of voxels are left out; [`read_instance_members`] reads them.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is not such an archive, is damaged, or an array has another type or
/// shape.
pub fn read_instance_arrays(path: &Path) -> Result<InstanceArrays> {
    read_instance_arrays_from(open_file(path)?, path)
}

/// Reads like [`read_instance_arrays`], from a reader of the archive. Errors call the file `name`.
///
/// # Errors
/// Like [`read_instance_arrays`].
pub fn read_instance_arrays_from(reader: impl Read + Seek, name: &Path) -> Result<InstanceArrays> {
    let path = name;
    let mut archive = NpzReader::new(reader, path)?;
    let index = archive.whole("label_index", |_| "<u4".into(), |bytes| vec![bytes as u64 / 4])?;
    let instances = index.len() / 4;
    let count = instances as u64;
    let width = |bytes: usize| (bytes / 4).checked_div(instances).unwrap_or(1).max(1);
    let names = archive.whole("labels", |bytes| format!("<U{}", width(bytes)), |_| vec![count])?;

    let mut array = |name: &str, kind: &str, shape: &[u64], size: u64| -> Result<Vec<u8>> {
        let bytes = archive.whole(name, |_| kind.into(), |_| shape.to_vec())?;
        if bytes.len() as u64 == size * shape.iter().product::<u64>() {
            return Ok(bytes);
        }
        Err(Error::format(
            path,
            format!("the array {name:?} has {} bytes for the shape {shape:?}", bytes.len()),
        ))
    };
    let bbox = array("bbox", "<f4", &[count, 6], 4)?;
    let voxel_occupancy = array("voxel_occupancy", "|u1", &[count, 6, 6, 6], 1)?;
    let points_per_voxel = array("points_per_voxel", "<u4", &[count, 6, 6, 6], 4)?;
    let point_start = array("point_start", "<u8", &[count + 1], 8)?;

    let units = numbers(&names, u32::from_le_bytes);
    let labels: Vec<String> = units.chunks_exact(width(names.len())).map(text_of_units).collect();
    if labels.len() != instances {
        return Err(Error::format(path, format!("{} labels for {instances} instances", labels.len())));
    }
    Ok(InstanceArrays {
        labels,
        label_index: numbers(&index, u32::from_le_bytes),
        bbox: numbers(&bbox, f32::from_le_bytes).as_chunks().0.to_vec(),
        voxel_occupancy,
        points_per_voxel: numbers(&points_per_voxel, u32::from_le_bytes),
        point_start: numbers(&point_start, u64::from_le_bytes),
    })
}

/// Returns the text of a fixed width, UTF-32, that ends at a zero.
pub(crate) fn text_of_units(units: &[u32]) -> String {
    units
        .iter()
        .take_while(|u| **u != 0)
        .map(|u| char::from_u32(*u).unwrap_or('\u{fffd}'))
        .collect()
}

/// Hands the points of each instance to `each`, voxel after voxel, one instance at a time. `point_start` is
/// the array of that name in the archive.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is not such an archive, is damaged, or does not have as many points
/// as `point_start` says.
pub fn read_instance_members(
    path: &Path,
    point_start: &[u64],
    each: impl FnMut(usize, &[u32]),
) -> Result<()> {
    read_instance_members_from(open_file(path)?, path, point_start, each)
}

/// Reads like [`read_instance_members`], from a reader of the archive. Errors call the file `name`.
///
/// # Errors
/// Like [`read_instance_members`].
pub fn read_instance_members_from(
    reader: impl Read + Seek,
    name: &Path,
    point_start: &[u64],
    mut each: impl FnMut(usize, &[u32]),
) -> Result<()> {
    let path = name;
    let mut archive = NpzReader::new(reader, path)?;
    let name = "point_index";
    let total = point_start.last().copied().unwrap_or(0);
    if !point_start.is_sorted() || point_start.first() != Some(&0) {
        return Err(Error::format(path, "point_start does not divide point_index among the instances"));
    }

    let (header, mut values) = archive.array(name)?;
    check_header(path, name, &header, "<u4", &[total])?;

    let mut bytes = Vec::new();
    let mut members = Vec::new();
    for (i, [start, end]) in point_start.array_windows().enumerate() {
        // `point_start` ascends.
        let size = (end - start).saturating_mul(4);
        bytes.clear();
        // Memory grows as bytes arrive, whatever the file claims.
        values
            .by_ref()
            .take(size)
            .read_to_end(&mut bytes)
            .map_err(|e| damaged(path, name, e))?;
        if bytes.len() as u64 != size {
            return Err(Error::format(path, format!("the array {name:?} ends too early")));
        }

        members.clear();
        members.extend(bytes.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)));
        each(i, &members);
    }

    // The checksum is compared at the array's end.
    match values.read(&mut [0; 1]) {
        Ok(0) => Ok(()),
        Ok(_) => Err(Error::format(path, format!("the array {name:?} goes on behind its {total} points"))),
        Err(e) => Err(damaged(path, name, e)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::instances::write::{InstanceRecord, InstanceWriter, read_instances};
    use s3d_geom::Aabb;
    use s3d_geom::glam::vec3;

    #[test]
    fn the_arrays_come_back_and_damage_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let json = dir.path().join("i.json");
        let npz = dir.path().join("i.npz");
        InstanceWriter::create(&json, &npz).unwrap().finish().unwrap();
        let empty = read_instance_arrays(&npz).unwrap();
        assert_eq!((empty.labels.len(), &empty.point_start[..]), (0, &[0][..]));

        let mut writer = InstanceWriter::create(&json, &npz).unwrap();
        let bbox = Aabb { min: vec3(0.1, -2.0, 0.0), max: vec3(1.5, -1.25, 0.9) };
        // The first voxel and the last.
        let points = [bbox.max, bbox.min, bbox.max - 0.1 * bbox.size()];
        for label in ["chair_3_office_5_1", "wall_1_WC_2_1"] {
            let record = InstanceRecord { label, label_index: 7, class: "chair", room: "office_5", bbox };
            writer.push(&record, &mut &points[..]).unwrap();
        }
        writer.finish().unwrap();

        let arrays = read_instance_arrays(&npz).unwrap();
        let entries = read_instances(&json).unwrap();
        assert_eq!(arrays.labels, ["chair_3_office_5_1", "wall_1_WC_2_1"]);
        assert_eq!((&arrays.label_index[..], &arrays.point_start[..]), (&[7, 7][..], &[0, 3, 6][..]));

        let mut members = Vec::new();
        read_instance_members(&npz, &arrays.point_start, |i, of| members.push((i, of.to_vec()))).unwrap();
        assert_eq!(members, [(0, vec![1, 0, 2]), (1, vec![1, 0, 2])]);
        for (starts, words) in [(&[0, 3, 7][..], "shape [7]"), (&[1, 6][..], "does not divide")] {
            let e = read_instance_members(&npz, starts, |_, _| ()).unwrap_err().to_string();
            assert!(e.contains(words), "{e}");
        }

        assert_eq!(arrays.bbox[1], entries[1].bbox);
        assert!(
            arrays
                .points_per_voxel
                .iter()
                .eq(entries.iter().flat_map(|e| &e.points_per_voxel))
        );
        assert!(
            arrays
                .voxel_occupancy
                .iter()
                .eq(entries.iter().flat_map(|e| &e.voxel_occupancy))
        );

        let good = std::fs::read(&npz).unwrap();
        let at = good.windows(4).position(|w| w == 0.9f32.to_le_bytes()).unwrap();
        let mut bad = good.clone();
        bad[at] ^= 1;
        std::fs::write(&npz, bad).unwrap();
        let e = read_instance_arrays(&npz).unwrap_err().to_string();
        assert!(e.contains("i.npz") && e.contains("\"bbox\" is damaged"), "{e}");
        std::fs::write(&npz, &good[..good.len() / 2]).unwrap();
        assert!(
            read_instance_arrays(&npz)
                .unwrap_err()
                .to_string()
                .contains("no readable archive")
        );
    }
}
