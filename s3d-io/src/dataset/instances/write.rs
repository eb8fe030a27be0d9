//! Boxes and voxels of an area's instances: `instances.json` to read, `instances.npz` for numpy.
//!
//! They hold what the published `pointcloud.mat` holds beside the points. Each instance has its tightest box,
//! split into 6 × 6 × 6 equal voxels, and each voxel its occupancy and its points. Voxel (ix, iy, iz),
//! counted from the box's smallest corner, has the index (ix · 6 + iy) · 6 + iz. Source:
//! [`crate::formats`], "What is written".

use crate::cloud::npy::npz::{NpzWriter, bytes};
use crate::cloud::passes::PointPasses;
use crate::dataset::instances::members::VoxelMembers;
use crate::dataset::instances::surface::SurfaceBoxes;
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use crate::fs::json::read_json;
use s3d_geom::{Aabb, VoxelGrid, Voxels};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The number of voxels of an instance.
const CELLS: usize = VoxelGrid::CELLS;

/// An instance without its points, as [`InstanceWriter::push`] takes it.
#[derive(Clone, Copy, Debug)]
pub struct InstanceRecord<'a> {
    /// The label: "chair_3_office_5_1".
    pub label: &'a str,
    /// The index of the label in `semantic_labels.json`.
    pub label_index: u32,
    /// The class: "chair".
    pub class: &'a str,
    /// Type and number of the room: "office_5".
    pub room: &'a str,
    /// The tightest box of the instance's points, world metres.
    pub bbox: Aabb,
}

/// An instance of `instances.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InstanceEntry {
    /// The label: "chair_3_office_5_1".
    pub label: String,
    /// The index of the label in `semantic_labels.json`.
    pub label_index: u32,
    /// The class: "chair".
    pub class: String,
    /// Type and number of the room: "office_5".
    pub room: String,
    /// The number of points.
    pub points: u64,
    /// The tightest box of the points: `[xmin, ymin, zmin, xmax, ymax, zmax]`, world metres.
    pub bbox: [f32; 6],
    /// 216 numbers: 1 if the voxel holds a point, else 0.
    pub voxel_occupancy: Vec<u8>,
    /// 216 numbers of points.
    pub points_per_voxel: Vec<u32>,
    /// The boxes of the faces that carry the label. `None`, and no key in the file, if no face does, or the
    /// file was written before version 0.2.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub surface: Option<SurfaceBoxes>,
}

/// Writes `instances.json` and `instances.npz` of an area, instance by instance, each whole or not at all.
///
/// The archive holds these arrays, for n instances with N points in total:
///
/// | name | type, shape | |
/// |---|---|---|
/// | `labels` | text, n | "chair_3_office_5_1" |
/// | `label_index` | u32, n | index into `semantic_labels.json` |
/// | `bbox` | f32, n × 6 | smallest x y z, largest x y z, metres |
/// | `voxel_occupancy` | u8, n × 6 × 6 × 6 | 1 if the voxel \[ix, iy, iz\] holds a point |
/// | `points_per_voxel` | u32, n × 6 × 6 × 6 | the number of points |
/// | `point_start` | u64, n + 1 | instance i has the points `point_index[point_start[i]:point_start[i+1]]` |
/// | `point_index` | u32, N | points by voxel, numbered from 0 as in the instance's file of the S3DIS tree |
///
/// Memory: about 1.3 kilobytes for each instance, however many points it has. Point indices wait in a
/// nameless temporary file.
#[derive(Debug)]
pub struct InstanceWriter<J = AtomicFile, N = AtomicFile> {
    json: J,
    npz: N,
    /// The path of `npz`, for messages.
    name: PathBuf,
    entries: Vec<InstanceEntry>,
    point_index: BufWriter<File>,
}

impl InstanceWriter {
    /// Starts the two files. Their folders must exist.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(json: &Path, npz: &Path) -> Result<Self> {
        let folder = npz
            .parent()
            .filter(|p| !p.as_os_str().is_empty())
            .unwrap_or(Path::new("."));
        let spool = tempfile::tempfile_in(folder).map_err(|e| Error::io(npz, "write", e))?;
        Ok(Self::new(AtomicFile::create(json)?, AtomicFile::create(npz)?, npz, spool))
    }

    /// Gives both files their final names, and returns the sum of their sizes in bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(self) -> Result<u64> {
        let (json, npz) = self.into_inner()?;
        Ok(npz.commit()? + json.commit()?)
    }
}

impl<J: Write, N: Write + Seek> InstanceWriter<J, N> {
    /// Starts the two files in writers of the caller. `name` stands for `npz` in messages. Indices of points
    /// wait in `spool`, an empty file that is open for reading and writing.
    pub fn new(json: J, npz: N, name: &Path, spool: File) -> Self {
        let point_index = BufWriter::with_capacity(1 << 18, spool);
        Self { json, npz, name: name.to_owned(), entries: Vec::new(), point_index }
    }

    /// Appends an instance. Its points are in the order of its file in the S3DIS tree. Points that are not in
    /// memory are read twice, once to count them by voxel and once to write their indices, which takes 14 MB.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for more points than `u32` can number; errors of reading the points.
    ///
    /// # Panics
    /// If the instance has no point, or the box of points in memory is not `instance.bbox`.
    pub fn push(&mut self, instance: &InstanceRecord<'_>, points: &mut dyn PointPasses) -> Result<()> {
        let label = instance.label;
        assert!(!points.is_empty(), "{label} has no point");
        if u32::try_from(points.len()).is_err() {
            let message = format!(
                "{label} has {} points; point_index can number {} of an instance: annotate it in parts",
                points.len(),
                u32::MAX
            );
            return Err(Error::format(&self.name, message));
        }

        let grid = VoxelGrid { bbox: instance.bbox };
        let points_per_voxel = match points.in_memory().and_then(Voxels::from_points) {
            Some(voxels) => {
                assert_eq!(voxels.grid, grid, "the box of {label} is not the box of its points");
                self.put(&voxels.members)?;
                voxels.starts.array_windows().map(|[start, end]| end - start).collect()
            }
            None => self.put_in_passes(grid, points)?,
        };

        self.entries.push(InstanceEntry {
            label: label.to_owned(),
            label_index: instance.label_index,
            class: instance.class.to_owned(),
            room: instance.room.to_owned(),
            points: points.len(),
            bbox: instance.bbox.to_array(),
            voxel_occupancy: points_per_voxel.iter().map(|&n| u8::from(n > 0)).collect(),
            points_per_voxel,
            surface: None,
        });
        Ok(())
    }

    /// Says which boxes the faces of each label have, by label index. Labels of no instance are left out.
    pub fn set_surfaces(&mut self, surfaces: &BTreeMap<u32, SurfaceBoxes>) {
        for entry in &mut self.entries {
            entry.surface = surfaces.get(&entry.label_index).copied();
        }
    }

    /// Appends indices of points.
    fn put(&mut self, members: &[u32]) -> Result<()> {
        members
            .iter()
            .try_for_each(|m| self.point_index.write_all(&m.to_le_bytes()))
            .map_err(|e| Error::io(&self.name, "write", e))
    }

    /// Appends the indices of points that are not in memory. Returns the number of points in each voxel.
    fn put_in_passes(&mut self, grid: VoxelGrid, points: &mut dyn PointPasses) -> Result<Vec<u32>> {
        let failed = |e| Error::io(&self.name, "write", e);
        let mut counts = vec![0u32; CELLS];

        let mut cells = Vec::new();
        points.pass(&mut |block| {
            grid.cells_of(block, &mut cells);
            for cell in &cells {
                if let Some(count) = counts.get_mut(usize::from(*cell)) {
                    *count += 1;
                }
            }
            Ok(())
        })?;

        self.point_index.flush().map_err(failed)?;
        let mut members = VoxelMembers::new(self.point_index.get_mut(), &counts).map_err(failed)?;
        points.pass(&mut |block| {
            grid.cells_of(block, &mut cells);
            members.add(&cells).map_err(failed)
        })?;
        members.finish().map_err(failed)?;
        Ok(counts)
    }

    /// Completes both files and hands their writers back: `instances.json`, `instances.npz`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn into_inner(self) -> Result<(J, N)> {
        let Self { mut json, npz, name, entries, point_index } = self;
        let io = |e| Error::io(&name, "write", e);
        let mut spool = point_index.into_inner().map_err(|e| io(e.into_error()))?;
        spool.seek(SeekFrom::Start(0)).map_err(io)?;
        let npz = write_arrays(npz, &entries, spool).map_err(io)?;
        write_entries(&mut json, &entries).map_err(io)?;
        Ok((json, npz))
    }
}

/// Writes one instance a line.
fn write_entries(w: &mut impl Write, entries: &[InstanceEntry]) -> io::Result<()> {
    w.write_all(b"{\"instances\":[")?;
    for (i, entry) in entries.iter().enumerate() {
        w.write_all(if i == 0 { b"\n" } else { b",\n" })?;
        serde_json::to_writer(&mut *w, entry)?;
    }
    w.write_all(b"\n]}\n")
}

/// Reads `instances.json`.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is something else, or an instance does not have 216 voxels.
pub fn read_instances(path: &Path) -> Result<Vec<InstanceEntry>> {
    #[derive(Deserialize)]
    struct Instances {
        instances: Vec<InstanceEntry>,
    }
    let Instances { instances } = read_json(path)?;
    for instance in &instances {
        if instance.voxel_occupancy.len() != CELLS || instance.points_per_voxel.len() != CELLS {
            return Err(Error::format(path, format!("{} has not {CELLS} voxels", instance.label)));
        }
    }
    Ok(instances)
}

fn write_arrays<N: Write + Seek>(file: N, entries: &[InstanceEntry], spool: File) -> io::Result<N> {
    let mut archive = NpzWriter::new(file);
    let n = entries.len() as u64;

    // Text of a fixed width, UTF-32, padded with zeros. It is numpy's own form, and needs no pickle.
    let width = entries
        .iter()
        .map(|e| e.label.chars().count())
        .max()
        .unwrap_or(0)
        .max(1);
    let labels = entries.iter().flat_map(|e| padded_units(&e.label, width));
    archive.array("labels", &format!("<U{width}"), &[n], bytes(labels, u32::to_le_bytes))?;

    let indices = entries.iter().map(|e| e.label_index);
    archive.array("label_index", "<u4", &[n], bytes(indices, u32::to_le_bytes))?;
    let boxes = entries.iter().flat_map(|e| e.bbox);
    archive.array("bbox", "<f4", &[n, 6], bytes(boxes, f32::to_le_bytes))?;
    let occupancy = entries.iter().flat_map(|e| e.voxel_occupancy.iter().copied());
    archive.array("voxel_occupancy", "|u1", &[n, 6, 6, 6], occupancy.collect::<Vec<_>>().as_slice())?;
    let counts = entries.iter().flat_map(|e| e.points_per_voxel.iter().copied());
    archive.array("points_per_voxel", "<u4", &[n, 6, 6, 6], bytes(counts, u32::to_le_bytes))?;

    let starts = point_starts(entries);
    let total = starts.last().copied().unwrap_or(0);
    archive.array("point_start", "<u8", &[n + 1], bytes(starts.into_iter(), u64::to_le_bytes))?;
    archive.stream(
        "point_index",
        "<u4",
        &[total],
        4 * total,
        &mut BufReader::with_capacity(1 << 18, spool),
    )?;
    archive.finish()
}

/// Returns a text as `width` units of UTF-32, padded with zeros.
pub(crate) fn padded_units(text: &str, width: usize) -> Vec<u32> {
    let mut units: Vec<u32> = text.chars().map(u32::from).collect();
    units.resize(width, 0);
    units
}

/// Returns the place of each instance's first point among all points, and at the end the number of all
/// points.
fn point_starts(entries: &[InstanceEntry]) -> Vec<u64> {
    let ends = entries.iter().scan(0, |sum, e| {
        *sum += e.points;
        Some(*sum)
    });
    std::iter::once(0).chain(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{Vec3, vec3};
    use std::io::Read;

    const CHAIR: Aabb = Aabb { min: vec3(0.1, -2.0, 0.0), max: vec3(1.5, -1.25, 0.9) };
    const WALL: Aabb = Aabb { min: Vec3::splat(5.0), max: Vec3::splat(5.0) };

    /// Returns points of the chair in the voxels 215, 0, 215, 0 and (0, 1, 1).
    fn chair_points() -> [Vec3; 5] {
        let size = CHAIR.size();
        [
            CHAIR.max,
            CHAIR.min,
            CHAIR.max - 0.1 * size,
            CHAIR.min + 0.1 * size,
            CHAIR.min + size * vec3(0.1, 0.2, 0.2),
        ]
    }

    fn record(label: &str) -> InstanceRecord<'_> {
        match label {
            "chair_3_office_5_1" => {
                InstanceRecord { label, label_index: 9, class: "chair", room: "office_5", bbox: CHAIR }
            }
            _ => InstanceRecord { label, label_index: 40, class: "wall", room: "WC_2", bbox: WALL },
        }
    }

    /// Points that pretend to be on a disk: they come two by two.
    struct OnDisk<'a>(&'a [Vec3]);

    impl PointPasses for OnDisk<'_> {
        fn len(&self) -> u64 {
            self.0.len() as u64
        }

        fn in_memory(&self) -> Option<&[Vec3]> {
            None
        }

        fn pass(&mut self, each: &mut dyn FnMut(&[Vec3]) -> Result<()>) -> Result<()> {
            self.0.chunks(2).try_for_each(each)
        }
    }

    fn size_of(path: &Path) -> u64 {
        std::fs::metadata(path).unwrap().len()
    }

    fn write(dir: &Path) -> Vec<InstanceEntry> {
        let json = dir.join("instances.json");
        let npz = dir.join("instances.npz");
        let mut writer = InstanceWriter::create(&json, &npz).unwrap();
        writer
            .push(&record("chair_3_office_5_1"), &mut &chair_points()[..])
            .unwrap();
        writer.push(&record("wall_1_WC_2_1"), &mut &[WALL.min][..]).unwrap();
        let bytes = writer.finish().unwrap();

        assert_eq!(bytes, size_of(&json) + size_of(&npz));
        assert_eq!(std::fs::read_dir(dir).unwrap().count(), 2);
        read_instances(&json).unwrap()
    }

    #[test]
    fn the_list_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let entries = write(dir.path());
        assert_eq!(entries.len(), 2);
        let chair = &entries[0];
        assert_eq!((chair.label.as_str(), chair.label_index, chair.points), ("chair_3_office_5_1", 9, 5));
        assert_eq!((chair.class.as_str(), chair.room.as_str()), ("chair", "office_5"));
        assert_eq!(chair.bbox, [0.1, -2.0, 0.0, 1.5, -1.25, 0.9]);
        let counts = &chair.points_per_voxel;
        assert_eq!((counts[0], counts[7], counts[215], counts.iter().sum::<u32>()), (2, 1, 2, 5));
        assert!(
            counts
                .iter()
                .zip(&chair.voxel_occupancy)
                .all(|(&n, &o)| o == u8::from(n > 0))
        );
    }

    #[test]
    fn other_writers_get_the_same_bytes() {
        let dir = tempfile::tempdir().unwrap();
        write(dir.path());
        let archive = io::Cursor::new(Vec::new());
        let spool = tempfile::tempfile().unwrap();
        let mut writer = InstanceWriter::new(Vec::new(), archive, Path::new("instances.npz"), spool);
        writer
            .push(&record("chair_3_office_5_1"), &mut OnDisk(&chair_points()))
            .unwrap();
        writer.push(&record("wall_1_WC_2_1"), &mut &[WALL.min][..]).unwrap();
        let (json, npz) = writer.into_inner().unwrap();
        assert!(json == std::fs::read(dir.path().join("instances.json")).unwrap());
        assert!(npz.into_inner() == std::fs::read(dir.path().join("instances.npz")).unwrap());
    }

    /// Reads the archive with npyz, which knows numpy's types.
    #[test]
    fn the_arrays_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let entries = write(dir.path());
        let file = File::open(dir.path().join("instances.npz")).unwrap();
        let mut zip = zip::ZipArchive::new(file).unwrap();
        let mut array = |name: &str| {
            let mut bytes = Vec::new();
            zip.by_name(&format!("{name}.npy"))
                .unwrap()
                .read_to_end(&mut bytes)
                .unwrap();
            bytes
        };
        fn read<T: npyz::Deserialize>(bytes: &[u8]) -> (Vec<u64>, Vec<T>) {
            let npy = npyz::NpyFile::new(bytes).unwrap();
            (npy.shape().to_vec(), npy.into_vec().unwrap())
        }

        assert_eq!(
            read::<String>(&array("labels")),
            (vec![2], entries.iter().map(|e| e.label.clone()).collect())
        );
        assert_eq!(read::<u32>(&array("label_index")), (vec![2], vec![9, 40]));
        assert_eq!(read::<f32>(&array("bbox")), (vec![2, 6], entries.iter().flat_map(|e| e.bbox).collect()));

        let occupancy = entries.iter().flat_map(|e| e.voxel_occupancy.clone()).collect();
        assert_eq!(read::<u8>(&array("voxel_occupancy")), (vec![2, 6, 6, 6], occupancy));
        let counts = entries.iter().flat_map(|e| e.points_per_voxel.clone()).collect();
        assert_eq!(read::<u32>(&array("points_per_voxel")), (vec![2, 6, 6, 6], counts));
        assert_eq!(read::<u64>(&array("point_start")), (vec![3], vec![0, 5, 6]));
        assert_eq!(read::<u32>(&array("point_index")), (vec![6], vec![1, 3, 4, 0, 2, 0]));
    }

    #[test]
    fn an_area_without_instances_and_the_same_bytes_twice() {
        let dir = tempfile::tempdir().unwrap();
        let json = dir.path().join("i.json");
        let npz = dir.path().join("i.npz");
        InstanceWriter::create(&json, &npz).unwrap().finish().unwrap();
        assert_eq!(read_instances(&json).unwrap(), []);

        let others = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        for other in &others {
            write(other.path());
        }
        for name in ["instances.json", "instances.npz"] {
            let [a, b] = others.each_ref().map(|d| std::fs::read(d.path().join(name)).unwrap());
            assert_eq!(a, b);
        }
    }

    #[test]
    fn points_on_the_disk_give_the_same_bytes() {
        let points: Vec<Vec3> = (0..70_000)
            .map(|i| vec3((i % 251) as f32, (i % 13) as f32, (i / 9000) as f32))
            .collect();
        let bbox = Aabb::from_points(points.iter().copied());
        let written = |on_disk: bool| {
            let dir = tempfile::tempdir().unwrap();
            let json = dir.path().join("i.json");
            let npz = dir.path().join("i.npz");
            let mut writer = InstanceWriter::create(&json, &npz).unwrap();
            for label in ["chair_3_office_5_1", "wall_1_WC_2_1"] {
                let record = InstanceRecord { bbox, ..record(label) };
                if on_disk {
                    writer.push(&record, &mut OnDisk(&points)).unwrap();
                } else {
                    writer.push(&record, &mut &points[..]).unwrap();
                }
            }
            writer
                .push(&record("chair_3_office_5_1"), &mut &chair_points()[..])
                .unwrap();
            writer.finish().unwrap();
            [json, npz].map(|path| std::fs::read(path).unwrap())
        };
        assert!(written(true) == written(false));
    }

    /// Claims to have as many points as asked for. None of them is ever read.
    struct Claimed(u64);

    impl PointPasses for Claimed {
        fn len(&self) -> u64 {
            self.0
        }

        fn in_memory(&self) -> Option<&[Vec3]> {
            None
        }

        fn pass(&mut self, _each: &mut dyn FnMut(&[Vec3]) -> Result<()>) -> Result<()> {
            panic!("the points are read")
        }
    }

    #[test]
    fn more_points_than_indices_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let mut writer =
            InstanceWriter::create(&dir.path().join("i.json"), &dir.path().join("i.npz")).unwrap();
        let message = writer
            .push(&record("wall_1_WC_2_1"), &mut Claimed(1 << 32))
            .unwrap_err()
            .to_string();
        assert!(message.contains("wall_1_WC_2_1 has 4294967296 points"), "{message}");
        assert!(message.contains("i.npz") && message.ends_with("annotate it in parts"), "{message}");
    }

    fn entry(points: u64) -> InstanceEntry {
        InstanceEntry {
            label: "wall_1_WC_2_1".to_owned(),
            label_index: 1,
            class: "wall".to_owned(),
            room: "WC_2".to_owned(),
            points,
            bbox: [0.0; 6],
            voxel_occupancy: vec![0; CELLS],
            points_per_voxel: vec![0; CELLS],
            surface: None,
        }
    }

    #[test]
    fn totals_go_beyond_32_bits() {
        let entries = [entry(u64::from(u32::MAX)), entry(7)];
        assert_eq!(point_starts(&entries), [0, u64::from(u32::MAX), (1 << 32) + 6]);
    }

    #[test]
    #[should_panic(expected = "wall_1_WC_2_1 has no point")]
    fn an_instance_without_points_is_a_callers_mistake() {
        let dir = tempfile::tempdir().unwrap();
        let mut writer =
            InstanceWriter::create(&dir.path().join("i.json"), &dir.path().join("i.npz")).unwrap();
        let _ = writer.push(&record("wall_1_WC_2_1"), &mut &[][..]);
    }
}
