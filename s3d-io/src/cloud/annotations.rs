//! Annotated points of any source: rooms, their instances, and the points of one instance at a time.

use crate::cloud::s3dis::tree::OnFault;
use crate::error::{Error, Result};
use s3d_geom::glam::DVec3;
use s3d_geom::{Aabb, PointCloud};
use s3d_label::{Class, Room, Taxonomy};
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How annotated points are read, whatever the file.
#[derive(Clone, Debug, PartialEq)]
pub struct AnnotationOptions {
    /// Which classes and types of rooms there are, what they are called, and what numbers mean.
    pub taxonomy: Taxonomy,
    /// What to do at a name, a line or a record that is not as it should be, and at a class that is none.
    pub on_fault: OnFault,
    /// Whether a class that is unknown, and not in [`AnnotationOptions::classes`], is taken for clutter:
    /// [`Taxonomy::clutter`], if there is such a class.
    pub unknown_as_clutter: bool,
    /// Which class a name or number in the files means; `None`: points of it are left out, as if they were
    /// not annotated. Names are compared to the letter, numbers as decimals: `"2"`.
    pub classes: BTreeMap<String, Option<Class>>,
    /// The room of points whose file names none. With a column of room *numbers*, the type of these rooms.
    pub room: Option<Room>,
    /// The name of the column of classes; `None`: what the format calls it.
    pub class_column: Option<String>,
    /// The name of the column of instance numbers; `None`: what the format calls it, or none.
    pub instance_column: Option<String>,
    /// The name of the column of rooms; `None`: there is none.
    pub room_column: Option<String>,
    /// The names of the columns of a file that has none (a plain NPY array), from the first; empty: `x y z r
    /// g b class` and, if there is one more, `instance`.
    pub columns: Vec<String>,
    /// What is subtracted from coordinates in `f64` before they are rounded to `f32`: metres. For
    /// georeferenced clouds.
    pub offset_m: DVec3,
    /// The box of the mesh that they belong to, world metres: points that all lie far from it
    /// ([`FrameGap`](crate::cloud::FrameGap)) are refused, as soon as that is known. `None`: anywhere.
    pub mesh_bounds: Option<Aabb>,
    /// A cloud with more points than this waits in a temporary file to be read by instance, and not in memory
    /// (15 bytes a point).
    pub points_in_memory: u64,
    /// The folder for such a file; `None`: the system's.
    pub spool_dir: Option<PathBuf>,
}

impl Default for AnnotationOptions {
    /// Faults stop, classes are S3DIS's by name, and 20 million points (300 MB) fit in memory.
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
    /// Which taxonomy the classes and rooms are of.
    pub taxonomy: Taxonomy,
    /// The rooms, by type and number, each once. At least one.
    pub rooms: Vec<AnnotatedRoom>,
    /// What was left out or taken for something else: a sentence each, for the user.
    pub warnings: Vec<String>,
}

/// A room and what stands in it.
#[derive(Clone, Debug)]
pub struct AnnotatedRoom {
    /// Which room it is.
    pub room: Room,
    /// Its instances, by class and number, each once. At least one.
    pub instances: Vec<AnnotatedInstance>,
}

/// An annotated instance, whose points wait where they are until they are read.
#[derive(Clone, Debug)]
pub struct AnnotatedInstance {
    /// What it is.
    pub class: Class,
    /// Its number among the room's instances of its class, from 1.
    pub number: u32,
    points: Arc<dyn InstancePoints>,
}

/// What was left out while points were read with [`OnFault::Skip`].
#[derive(Debug, Default)]
pub struct Skipped {
    /// How many lines or records.
    pub count: u64,
    /// What was wrong with the first of them, with its place.
    pub first: Option<Error>,
}

/// Where the points of one instance are.
pub(crate) trait InstancePoints: Debug + Send + Sync {
    /// Appends the instance's points to `out`: positions, a colour for each (black if the file has none), and
    /// faces if they are known.
    fn read(&self, out: &mut PointCloud) -> Result<Skipped>;

    /// The file that holds them.
    fn path(&self) -> &Path;

    /// Which instance of that file they are, for messages; empty if it holds no other.
    fn part(&self) -> String;

    /// Whether they are the vertices of a mesh.
    fn are_vertices(&self) -> bool {
        false
    }

    /// The same points, to be read block by block.
    fn open(&self) -> Result<Box<dyn PointBlocks + '_>>;

    /// The folder for a copy of the points, if reading them a second time would take longer than reading
    /// that.
    fn copy_to(&self) -> Option<PathBuf> {
        None
    }
}

/// The points of an instance as their source reads them.
pub(crate) trait PointBlocks: Send {
    /// Appends the next points to `out`: about as many as asked for, or fewer if there are no more. `false`:
    /// these were the last.
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool>;

    /// What was left out so far.
    fn skipped(&mut self) -> Skipped;
}

impl AnnotatedInstance {
    pub(crate) fn new(class: Class, number: u32, points: Arc<dyn InstancePoints>) -> Self {
        Self { class, number, points }
    }

    /// Appends the instance's points to `out`: world metres, Z-up, a colour for each (black if the file has
    /// none). [`PointCloud::faces`] comes to have an entry a point if it is known already which face each
    /// point belongs to. Points of a file, and the order of points, are the same each time.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the line for a point that is none, unless it is to be skipped.
    /// `out` may then hold the points before it.
    ///
    /// # Panics
    /// If `out` has points without colours, or with faces where these points have none.
    pub fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        self.points.read(out)
    }

    pub(crate) fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        self.points.open()
    }

    pub(crate) fn copy_to(&self) -> Option<PathBuf> {
        self.points.copy_to()
    }

    /// Whether its points are the vertices of a mesh. Where that is the scene's own, a vertex is equally near
    /// to all faces around it, and should vote for each of them.
    pub fn are_vertices(&self) -> bool {
        self.points.are_vertices()
    }

    /// The file that its points are in.
    pub fn path(&self) -> &Path {
        self.points.path()
    }

    /// Where its points are, for messages: the file, and which instance in it if it holds several.
    pub fn source(&self) -> String {
        let (path, part) = (self.path().display(), self.points.part());
        if part.is_empty() {
            path.to_string()
        } else {
            format!("{path}, {part}")
        }
    }
}
