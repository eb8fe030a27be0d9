//! Annotated points of any source: rooms, their instances, and the points of each instance.

mod joined;
mod of_faces;
mod of_memory;

use crate::cloud::on_fault::OnFault;
use crate::error::{Error, Result};
use s3d_geom::glam::DVec3;
use s3d_geom::{Aabb, PointCloud};
use s3d_label::{Class, Room, Taxonomy};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use joined::PlacedInstance;
#[cfg(feature = "labels")]
pub(crate) use of_faces::push_middles;
pub use of_memory::AnnotatedPoints;

/// How annotated points are read, whatever the file.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotationOptions {
    /// The classes and types of rooms, their names, and the meaning of class numbers.
    pub taxonomy: Taxonomy,
    /// What to do about a faulty name, line or record, and about an unknown class.
    pub on_fault: OnFault,
    /// Whether unknown classes that are not in [`AnnotationOptions::classes`] count as clutter, if the
    /// taxonomy has such a class ([`Taxonomy::clutter`]).
    pub unknown_as_clutter: bool,
    /// The class that a name or number in the files stands for. `None`: its points are left out, as if they
    /// were not annotated. Names are case-sensitive; numbers are written as decimals: `"2"`.
    pub classes: BTreeMap<String, Option<Class>>,
    /// The room of points whose file names none. If a column holds room *numbers*, the type of these rooms.
    pub room: Option<Room>,
    /// The name of the column of classes. `None`: one of the usual names.
    pub class_column: Option<String>,
    /// The name of the column of instance numbers. `None`: one of the usual names, if there is such a column.
    pub instance_column: Option<String>,
    /// The name of the column of rooms. `None`: there is no such column.
    pub room_column: Option<String>,
    /// The names of the columns, in order, for a file that does not name them: a plain NPY array or a text.
    /// In a text, they come before the file's own names. Empty: a plain array has `x y z r g b class` and, if
    /// there is one more column, `instance`; a text must name its columns.
    pub columns: Vec<String>,
    /// The offset that is subtracted from coordinates in `f64`, before they are rounded to `f32`: metres.
    /// For georeferenced clouds.
    pub offset_m: DVec3,
    /// The box of the mesh that the points belong to, in world metres. A file whose points all lie far from
    /// it ([`FrameGap`](crate::cloud::FrameGap)) is refused as soon as that is known. `None`: no check.
    pub mesh_bounds: Option<Aabb>,
    /// The most points of a cloud that are sorted by instance in memory (15 bytes a point). A larger cloud is
    /// sorted in a temporary file.
    pub points_in_memory: u64,
    /// The folder for this temporary file. `None`: the system's folder for temporary files.
    pub spool_dir: Option<PathBuf>,
}

impl Default for AnnotationOptions {
    /// Stops at faults, takes S3DIS's classes by name, and keeps up to 20 million points (300 MB) in memory.
    fn default() -> Self {
        Self {
            taxonomy: Taxonomy::s3dis(),
            on_fault: OnFault::Stop,
            unknown_as_clutter: false,
            classes: BTreeMap::new(),
            room: None,
            class_column: None,
            instance_column: None,
            room_column: None,
            columns: Vec::new(),
            offset_m: DVec3::ZERO,
            mesh_bounds: None,
            points_in_memory: 20_000_000,
            spool_dir: None,
        }
    }
}

/// The annotated instances of an area, by room.
#[derive(Clone, Debug)]
pub struct Annotations {
    /// The taxonomy of the classes and rooms.
    pub taxonomy: Taxonomy,
    /// The rooms, by type and number, each once. At least one.
    pub rooms: Vec<AnnotatedRoom>,
    /// What was left out or reinterpreted: a sentence each, for the user.
    pub warnings: Vec<String>,
    /// The files that were read beside those that were named, such as the mesh of a list of objects.
    pub companions: Vec<PathBuf>,
}

/// A room and its instances.
#[derive(Clone, Debug)]
pub struct AnnotatedRoom {
    /// The room.
    pub room: Room,
    /// Its instances, by class and number, each once. At least one.
    pub instances: Vec<AnnotatedInstance>,
}

/// An annotated instance. Its points stay at their source until they are read.
#[derive(Clone, Debug)]
pub struct AnnotatedInstance {
    /// Its class.
    pub class: Class,
    /// Its number among the room's instances of the same class, from 1.
    pub number: u32,
    points: Arc<dyn InstancePoints>,
}

/// The lines or records left out while points were read with [`OnFault::Skip`], and those that were mended.
#[derive(Debug, Default)]
pub struct Skipped {
    /// The number of lines or records left out.
    pub count: u64,
    /// The fault of the first of them, and its place.
    pub first: Option<Error>,
    /// The number of lines with control characters within numbers, which were read without them.
    pub mended: u64,
    /// The place of the first of these: its file and line.
    pub first_mended: Option<String>,
}

/// The source of one instance's points.
pub(crate) trait InstancePoints: Debug + Send + Sync {
    /// Appends the instance's points to `out`: positions, a colour each (black if the file has none), and the
    /// face of each point if it is known.
    fn read(&self, out: &mut PointCloud) -> Result<Skipped>;

    /// The file that holds the points.
    fn path(&self) -> &Path;

    /// The instance's name within the file, for messages. Empty if the file holds no other instance.
    fn part(&self) -> String;

    /// Whether the points are the vertices of a mesh.
    fn are_vertices(&self) -> bool {
        false
    }

    /// Opens the same points, to be read block by block.
    fn open(&self) -> Result<Box<dyn PointBlocks + '_>>;

    /// The folder for a copy of the points, if a copy would be faster to read a second time than the source.
    fn copy_to(&self) -> Option<PathBuf> {
        None
    }
}

/// The points of an instance, in blocks as their source reads them.
pub(crate) trait PointBlocks: Send {
    /// Appends about `points` more points to `out`, or the rest if fewer are left. Returns `false` after the
    /// last block.
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool>;

    /// The lines or records left out so far.
    fn skipped(&mut self) -> Skipped;
}

impl AnnotatedInstance {
    pub(crate) fn new(class: Class, number: u32, points: Arc<dyn InstancePoints>) -> Self {
        Self { class, number, points }
    }

    /// Appends the instance's points to `out`: world metres, Z-up, a colour each (black if the file has
    /// none). If the source knows the face of each point, [`PointCloud::faces`] gets an entry a point. Every
    /// call gives the same points in the same order.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the line or record of an invalid point, unless such points are
    /// skipped. After an error, `out` may hold the points read so far.
    ///
    /// # Panics
    /// If `out` has points without colours, or with faces although these points have none.
    pub fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        self.points.read(out)
    }

    pub(crate) fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        self.points.open()
    }

    pub(crate) fn copy_to(&self) -> Option<PathBuf> {
        self.points.copy_to()
    }

    /// Whether its points are the vertices of a mesh. In the scene's own mesh, a vertex is equally near to
    /// all faces around it, and should vote for each of them.
    pub fn are_vertices(&self) -> bool {
        self.points.are_vertices()
    }

    /// The file that holds its points.
    pub fn path(&self) -> &Path {
        self.points.path()
    }

    /// The source of its points, for messages: the file, and the instance's name in it if it holds several.
    pub fn source(&self) -> String {
        let path = self.path().display();
        let part = self.points.part();
        if part.is_empty() {
            path.to_string()
        } else {
            format!("{path}, {part}")
        }
    }
}
