//! Opens annotations in files of any format.

use crate::bounds::Bounds;
use crate::cloud::annotations::{
    AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations, InstancePoints, PointBlocks, Skipped,
};
use crate::cloud::frame_gap::{FrameGap, refusal};
use crate::cloud::kind::{is_kitti, is_scannet, open_arrays, open_cloud, table};
#[cfg(feature = "labels")]
use crate::cloud::label_files::LabelFile;
#[cfg(feature = "labels")]
use crate::cloud::of_label_file::AnnotatedMesh;
use crate::cloud::on_fault::OnFault;
use crate::cloud::s3dis::points::PointReader;
use crate::cloud::s3dis::tree::{AnnotationTree, TreeOptions};
use crate::cloud::table::cloud::Cloud;
use crate::cloud::table::read::read_tables;
use crate::error::{Error, Result};
use crate::fs::source::Source;
use s3d_geom::glam::DVec3;
use s3d_geom::{Aabb, PointCloud};
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Annotations {
    /// Finds the annotated instances of an area in `paths`, and puts the rooms of all paths together.
    ///
    /// | path | annotations |
    /// |---|---|
    /// | a folder | the S3DIS tree of an area, see [`AnnotationTree`] |
    /// | `….mat` | `pointcloud.mat` of a published area, see [`MatArea`](crate::cloud::MatArea) |
    /// | a mesh; lists of HM3D, Replica, 3RScan, ScanNet++ | labels of faces: [`Annotations::open_for`] |
    /// | a folder with `labels.npz` | labels of faces: [`SavedLabels`](crate::cloud::SavedLabels) |
    /// | a folder with an `*.aggregation.json`, or that file | a scan of ScanNet: vertices of its mesh |
    /// | `.ply` | vertices with properties for class and instance; ASCII or binary |
    /// | `.npy` | a structured array, or rows and columns, see [`AnnotationOptions::columns`] |
    /// | `.npz` | one such array, or an array a column (`xyz`, `rgb`, `label`…), or a few |
    /// | `.las`, `.laz` | `classification`, and `point_source_id` as instance; extra dimensions by name |
    /// | `.e57` | several scans with their poses; attributes of extensions for classes and instances |
    /// | `.pcd` | PCL's fields, ASCII, binary or compressed; `rgb` and `rgba` may be packed |
    /// | `.asc`, `.xyz`, `.txt`, `.csv` | a point a line; the first line or the options name the columns |
    /// | `.pts`, `.ptx` | the same with a scanner's counts and poses; the options name the columns |
    /// | `.label`, `.bin` | SemanticKITTI: one beside the other, or in `labels/` and `velodyne/` |
    /// | a folder with `coord.npy`, or folders with it | Pointcept's arrays, an array a file |
    ///
    /// The first bytes of a file come before the ending of its name.
    ///
    /// The points of a tree are read when they are asked for, an instance at a time. All other files hold
    /// *clouds*: rows of points, each with its own class, instance and room. All clouds of an area are read
    /// as one, and grouped:
    ///
    /// - **class**: [`AnnotationOptions::classes`] gives the meaning of a number or a name. Names of the 13
    ///   classes mean themselves, and the usual words of ScanNet's annotators mean the nearest of the 13. The
    ///   numbers of a plain NPY array are S3DIS's (0 ceiling … 12 clutter) if neither columns nor classes
    ///   are named, and so are those of SemanticKITTI's files and Pointcept's arrays without classes. Classes
    ///   without a meaning are an error that lists them.
    /// - **instance**: points of one room and class with one number are one instance. Two classes of the file
    ///   that mean the same are kept apart, since many files number per class. Points without a number, or
    ///   with a negative one, are one instance a class and room. Instances are numbered per class and room
    ///   from 1 in the order of their numbers in the file.
    /// - **room**: the column of rooms says it (a name, or the number of a room of
    ///   [`AnnotationOptions::room`]'s type), or else [`AnnotationOptions::room`], or else the name of the
    ///   file (`office_3.ply`, `Area_1_office_3.npy`) or of the E57 scan.
    ///
    /// Colours become 8-bit. 16-bit numbers count as 8-bit ones if no number in the file is above 255. Floats
    /// count as 0 to 1 if no number in the file is above 1, and else as 0 to 255.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a path of another kind, for the faults that the format's reader
    /// finds, for a room that is in two sources, and if no room is found. With [`OnFault::Skip`] single
    /// names, lines and classes are left out instead, and [`Annotations::warnings`] reports them.
    ///
    /// # Panics
    /// If `paths` is empty.
    pub fn open(paths: &[PathBuf], options: &AnnotationOptions) -> Result<Self> {
        Self::open_each(
            paths,
            options,
            #[cfg(feature = "labels")]
            None,
        )
    }

    /// Reads like [`Annotations::open`], for a mesh. A file of labels of faces labels the faces of this mesh:
    /// one to one if its own mesh has the same faces in the same order, and else by surface. A face takes the
    /// label that most of its places, up to 5 cm apart, find on the nearest face within 10 cm.
    ///
    /// # Errors
    /// The errors of [`Annotations::open`]; [`Error::Format`] for a mesh of labels that lies elsewhere.
    ///
    /// # Panics
    /// If `paths` is empty.
    #[cfg(feature = "labels")]
    pub fn open_for(
        mesh: &AnnotatedMesh<'_>,
        paths: &[PathBuf],
        options: &AnnotationOptions,
    ) -> Result<Self> {
        Self::open_each(paths, options, Some(mesh))
    }

    fn open_each(
        paths: &[PathBuf],
        options: &AnnotationOptions,
        #[cfg(feature = "labels")] mesh: Option<&AnnotatedMesh<'_>>,
    ) -> Result<Self> {
        assert!(!paths.is_empty(), "no path of annotations");
        let taxonomy = options.taxonomy.clone();
        let mut all = Self { taxonomy, rooms: Vec::new(), warnings: Vec::new(), companions: Vec::new() };
        let mut clouds: Vec<Box<dyn Cloud + '_>> = Vec::new();

        for path in paths {
            #[cfg(feature = "labels")]
            // Columns of rooms are columns of points.
            if options.room_column.is_none()
                && let Some(file) = LabelFile::of(path)?
            {
                all.join(Self::of_label_file(&file, options, mesh)?)?;
                continue;
            }
            if path.is_dir() && !is_scannet(path) && !is_kitti(path) {
                let arrays = open_arrays(path, options)?;
                if !arrays.is_empty() {
                    clouds.extend(arrays);
                    continue;
                }
                all.join(Self::from_tree(path, options)?)?;
            } else if is_mat(path) {
                let area = Self::mat(Source::file(path), options)?;
                let gap = options
                    .mesh_bounds
                    .and_then(|mesh| area.frame_gap(options.offset_m, mesh));
                if let Some(gap) = gap {
                    return Err(refusal(path, &gap));
                }
                all.join(area)?;
            } else {
                clouds.push(open_cloud(path, options)?);
            }
        }

        if !clouds.is_empty() {
            let clouds: Vec<&dyn Cloud> = clouds.iter().map(|c| &**c).collect();
            all.join(read_tables(&clouds, options)?)?;
        }
        Ok(all)
    }

    /// Reads annotations like [`Annotations::open`], from the bytes of one file, which are read as often as
    /// necessary: a `.mat`, or a table of points in one file (`.ply`, `.npy`, `.npz`, `.las`, `.laz`, `.e57`,
    /// `.pcd`, text). The first bytes or the extension of `name` tell the format; errors call the file
    /// `name`.
    ///
    /// ```
    /// use s3d_io::cloud::{AnnotationOptions, Annotations};
    /// use std::{io::Cursor, path::Path};
    ///
    /// let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\n\
    ///            property float y\nproperty float z\n\
    ///            property uchar class\nend_header\n1 2 3 7\n";
    /// let classes = [("7".to_owned(), Some(s3d_label::Class::CHAIR))].into();
    /// let options = AnnotationOptions { classes, ..Default::default() };
    /// let area = Annotations::from_reader(Cursor::new(ply), Path::new("office_3.ply"), &options)?;
    /// assert_eq!(area.rooms[0].instances[0].class, s3d_label::Class::CHAIR);
    /// # Ok::<(), s3d_io::Error>(())
    /// ```
    ///
    /// # Errors
    /// The errors of [`Annotations::open`].
    pub fn from_reader(
        reader: impl Read + Seek + Send + 'static,
        name: &Path,
        options: &AnnotationOptions,
    ) -> Result<Self> {
        let source = Source::reader(name, reader);
        if is_mat(name) {
            return Self::mat(source, options);
        }
        read_tables(&[&*table(source, options.into())?], options)
    }

    #[cfg(feature = "mat")]
    fn mat(source: Source, options: &AnnotationOptions) -> Result<Self> {
        Self::from_mat(source, options)
    }

    #[cfg(not(feature = "mat"))]
    fn mat(source: Source, _: &AnnotationOptions) -> Result<Self> {
        Err(Error::not_built_in(source.name(), "mat"))
    }

    /// Returns the gap between the points and a mesh with these bounds, if the first points of the instances
    /// all lie far from it. `offset_m` is the offset that was subtracted from the points.
    pub fn frame_gap(&self, offset_m: DVec3, mesh: Aabb) -> Option<FrameGap> {
        let instances: Vec<&AnnotatedInstance> = self.rooms.iter().flat_map(|r| &r.instances).collect();
        let mut points = Bounds::EMPTY;
        for instance in sampled(&instances) {
            let mut cloud = PointCloud::default();
            // Points that cannot be read are reported when all points are read.
            if let Ok(mut blocks) = instance.open() {
                let _ = blocks.read_block(SAMPLED_POINTS, &mut cloud);
            }
            let [min, max] = bounds_of(&cloud, offset_m);
            points = points.union(Bounds { min, max });
        }
        FrameGap::between([points.min, points.max], offset_m, mesh)
    }

    /// Adds the rooms of another source.
    fn join(&mut self, other: Self) -> Result<()> {
        for room in other.rooms {
            match self.rooms.binary_search_by_key(&room.room, |r| r.room) {
                Ok(i) => {
                    let first = self.rooms.get(i).and_then(source_of).unwrap_or_default();
                    let second = source_of(&room).unwrap_or_default();
                    let path = room.instances.first().map_or(Path::new(""), AnnotatedInstance::path);
                    let message = format!("{} is in two sources, {first} and {second}", room.room);
                    return Err(Error::format(path, message));
                }
                Err(i) => self.rooms.insert(i, room),
            }
        }
        self.warnings.extend(other.warnings);
        self.companions.extend(other.companions);
        Ok(())
    }

    /// Opens the S3DIS tree of an area.
    fn from_tree(dir: &Path, options: &AnnotationOptions) -> Result<Self> {
        let columns = [&options.class_column, &options.instance_column, &options.room_column];
        if columns.iter().any(|c| c.is_some()) || options.room.is_some() {
            return Err(Error::format(
                dir,
                "is a folder: its rooms, classes and instances are named by its files; columns and a room \
                 are for clouds",
            ));
        }

        let on_fault = options.on_fault;
        let offset_m = options.offset_m;
        let spool_dir = options.spool_dir.clone().map(Arc::new);
        let tree = AnnotationTree::open_with(
            dir,
            &TreeOptions {
                taxonomy: options.taxonomy.clone(),
                on_fault,
                unknown_as_clutter: options.unknown_as_clutter,
                classes: options.classes.clone(),
            },
        )?;

        // A tree in another frame than the mesh is refused before its points are read.
        if let Some(mesh) = options.mesh_bounds {
            let files: Vec<&Path> = tree
                .rooms
                .iter()
                .flat_map(|r| &r.instances)
                .map(|i| i.path.as_path())
                .collect();
            refuse_far_tree(dir, &files, offset_m, mesh)?;
        }

        let rooms = tree.rooms.into_iter().map(|room| AnnotatedRoom {
            room: room.room,
            instances: room
                .instances
                .into_iter()
                .map(|file| {
                    let points =
                        TextPoints { path: file.path, on_fault, offset_m, spool_dir: spool_dir.clone() };
                    AnnotatedInstance::new(file.class, file.number, Arc::new(points))
                })
                .collect(),
        });
        let rooms = rooms.collect();
        Ok(Self {
            taxonomy: options.taxonomy.clone(),
            rooms,
            warnings: tree.warnings,
            companions: Vec::new(),
        })
    }
}

/// The source of a room's points, for messages.
fn source_of(room: &AnnotatedRoom) -> Option<String> {
    room.instances.first().map(AnnotatedInstance::source)
}

/// The number of a tree's files, or of instances, whose first points show the frame of all.
const SAMPLED: usize = 32;
/// The number of points that are read from each of them.
const SAMPLED_POINTS: usize = 256;

/// About [`SAMPLED`] elements of many, evenly spaced from the first.
fn sampled<T>(all: &[T]) -> impl Iterator<Item = &T> {
    all.iter().step_by(all.len().div_ceil(SAMPLED).max(1))
}

/// Refuses a tree if the first points of its files lie far from the mesh. Faults in the files are reported
/// when all points are read.
fn refuse_far_tree(dir: &Path, files: &[&Path], offset_m: DVec3, mesh: Aabb) -> Result<()> {
    let rough = sampled_bounds(files, offset_m);
    if FrameGap::between(rough, offset_m, mesh).is_none() {
        return Ok(());
    }
    // Relative to their own middle the points keep all digits.
    let near = ((rough[0] + rough[1]) * 0.5).round();
    match FrameGap::between(sampled_bounds(files, near), offset_m, mesh) {
        Some(gap) => Err(refusal(dir, &gap)),
        None => Ok(()),
    }
}

/// The smallest and the largest coordinates of the first points of some files, read with an offset.
fn sampled_bounds(files: &[&Path], offset_m: DVec3) -> [DVec3; 2] {
    let mut cloud = PointCloud::default();
    for file in sampled(files) {
        if let Ok(reader) = PointReader::open_with(file, OnFault::Skip) {
            let _ = reader.with_offset(offset_m).read_chunk(SAMPLED_POINTS, &mut cloud);
        }
    }
    bounds_of(&cloud, offset_m)
}

/// The smallest and the largest coordinates of points before an offset was subtracted from them.
fn bounds_of(cloud: &PointCloud, offset_m: DVec3) -> [DVec3; 2] {
    let bounds = Bounds::of(cloud.positions.iter().map(|p| p.as_dvec3() + offset_m));
    [bounds.min, bounds.max]
}

fn is_mat(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mat"))
}

/// A file of the S3DIS tree.
#[derive(Debug)]
struct TextPoints {
    path: PathBuf,
    on_fault: OnFault,
    offset_m: DVec3,
    /// See [`AnnotationOptions::spool_dir`].
    spool_dir: Option<Arc<PathBuf>>,
}

impl InstancePoints for TextPoints {
    fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        let mut reader = PointReader::open_with(&self.path, self.on_fault)?.with_offset(self.offset_m);
        while reader.read_chunk(usize::MAX, out)? > 0 {}
        Ok(reader.take_skipped())
    }

    fn path(&self) -> &Path {
        &self.path
    }

    fn part(&self) -> String {
        String::new()
    }

    fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        Ok(Box::new(PointReader::open_with(&self.path, self.on_fault)?.with_offset(self.offset_m)))
    }

    fn copy_to(&self) -> Option<PathBuf> {
        Some(
            self.spool_dir
                .as_ref()
                .map_or_else(std::env::temp_dir, |dir| (**dir).clone()),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{Vec3, vec3};
    use s3d_label::Class;
    use std::collections::BTreeMap;
    use std::fs;

    fn tree(files: &[(&str, &str)]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for (file, text) in files {
            let path = dir.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        dir
    }

    fn open(dirs: &[&tempfile::TempDir], options: &AnnotationOptions) -> Result<Annotations> {
        let paths: Vec<PathBuf> = dirs.iter().map(|d| d.path().to_owned()).collect();
        Annotations::open(&paths, options)
    }

    /// Each instance's name and number of points.
    fn contents(annotations: &Annotations) -> Vec<(String, usize)> {
        let mut all = Vec::new();
        for room in &annotations.rooms {
            for i in &room.instances {
                let mut cloud = PointCloud::default();
                i.read(&mut cloud).unwrap();
                all.push((format!("{} {}_{}", room.room, i.class, i.number), cloud.len()));
            }
        }
        all
    }

    #[test]
    fn trees_are_put_together() {
        let a = tree(&[("office_2/Annotations/wall_1.txt", "1 2 3 4 5 6\n")]);
        let b = tree(&[
            ("office_1/Annotations/wall_2.txt", "1 2 3 4 5 6\n7 8 9 10 11 12.0\n"),
            ("office_1/notes.md", ""),
        ]);
        let both = open(&[&a, &b], &AnnotationOptions::default()).unwrap();
        assert_eq!(contents(&both), [("office_1 wall_2".into(), 2), ("office_2 wall_1".into(), 1)]);

        let wall = &both.rooms[0].instances[0];
        assert!(wall.path().ends_with("office_1/Annotations/wall_2.txt"));
        assert_eq!(wall.source(), wall.path().display().to_string());

        let message = open(&[&a, &a], &AnnotationOptions::default()).unwrap_err().to_string();
        assert!(
            message.contains("office_2 is in two sources") && message.ends_with("Annotations/wall_1.txt"),
            "{message}"
        );
    }

    #[test]
    fn lines_that_are_skipped_are_counted_with_the_first_place() {
        let a = tree(&[("WC_1/Annotations/wall_1.txt", "1 2 3 4 5 6\n1 2 3\x10 4 5\nx\n1 1\x10 1 1 1 1\n")]);
        let strict = open(&[&a], &AnnotationOptions::default()).unwrap();
        let message = strict.rooms[0].instances[0]
            .read(&mut PointCloud::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains("wall_1.txt, line 2"), "{message}");

        let skip = AnnotationOptions { on_fault: OnFault::Skip, ..AnnotationOptions::default() };
        let lenient = open(&[&a], &skip).unwrap();
        let mut cloud = PointCloud::default();
        let skipped = lenient.rooms[0].instances[0].read(&mut cloud).unwrap();
        assert_eq!((cloud.len(), skipped.count, skipped.mended), (2, 2, 1));
        assert!(skipped.first_mended.unwrap().ends_with("wall_1.txt, line 4"));
        assert!(skipped.first.unwrap().to_string().contains("line 2"));
    }

    #[test]
    fn words_of_a_tree_can_be_given_a_class() {
        let a = tree(&[
            ("WC_1/Annotations/stairs_1.txt", "1 2 3 4 5 6\n"),
            ("WC_1/Annotations/floor_1.txt", "1 2 3 4 5 6\n"),
            ("WC_1/Annotations/person_1.txt", "1 2 3 4 5 6\n"),
        ]);
        let classes = [("stairs".to_owned(), Some(Class::FLOOR)), ("person".to_owned(), None)];
        let options = AnnotationOptions { classes: BTreeMap::from(classes), ..AnnotationOptions::default() };
        let found = open(&[&a], &options).unwrap();
        assert_eq!(contents(&found), [("WC_1 floor_1".into(), 1), ("WC_1 floor_2".into(), 1)]);
        assert!(found.rooms[0].instances[1].source().ends_with("stairs_1.txt"));
    }

    fn line(x: f64) -> String {
        format!("{} 5400002.75 301.5 4 5 6\n", 500_000.0 + x)
    }

    #[test]
    fn a_tree_in_another_frame_is_refused_with_the_offset_that_fits() {
        let a = tree(&[
            ("WC_1/Annotations/wall_1.txt", &(line(0.0) + &line(4.0))),
            ("WC_1/Annotations/wall_2.txt", "no point\n"),
        ]);
        let mesh = Aabb { min: Vec3::ZERO, max: vec3(4.0, 5.5, 3.0) };
        let near = AnnotationOptions { mesh_bounds: Some(mesh), ..AnnotationOptions::default() };
        let message = open(&[&a], &near).unwrap_err().to_string();
        let offset = "write offset_m = [500000.0, 5400000.0, 300.0] under [annotations]";
        assert!(message.contains(offset) && message.contains("5423096 m"), "{message}");

        let moved = AnnotationOptions { offset_m: DVec3::new(500_000.0, 5_400_000.0, 300.0), ..near };
        let found = open(&[&a], &moved).unwrap();
        let mut cloud = PointCloud::default();
        found.rooms[0].instances[0].read(&mut cloud).unwrap();
        assert_eq!(cloud.positions, [vec3(0.0, 2.75, 1.5), vec3(4.0, 2.75, 1.5)]);
        assert!(found.frame_gap(moved.offset_m, mesh).is_none());
    }

    #[test]
    fn options_of_clouds_are_refused_for_a_tree() {
        let a = tree(&[("WC_1/Annotations/wall_1.txt", "1 2 3 4 5 6\n")]);
        let with_class = AnnotationOptions { class_column: Some("label".into()), ..Default::default() };
        let message = open(&[&a], &with_class).unwrap_err().to_string();
        assert!(message.contains("are for clouds"), "{message}");
        let gone = Annotations::open(&[a.path().join("gone")], &AnnotationOptions::default());
        assert!(matches!(gone, Err(Error::Io { .. })));
    }
}
