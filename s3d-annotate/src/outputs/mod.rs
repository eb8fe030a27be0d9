//! What a labelling becomes for other programs: a mesh with labels, a scan of ScanNet or ScanNet++, or points
//! as in S3DIS.
//!
//! [`LabelFolder::write_labels`] writes what `s3d` itself reads; this module writes the rest.
//! [`write_output`] makes one file or folder, which appears whole or not at all.
//!
//! | [`OutputFormat`] | beside `scan.labels` | labels |
//! |---|---|---|
//! | `ply` | `scan_labelled.ply` | class, instance and room of each face |
//! | `scannet` | `scan_scannet/` | objects as groups of segments of the vertices |
//! | `scannetpp` | `scan_scannetpp/scans/` | objects as groups of vertices, with boxes |
//! | `s3dis` | `scan_s3dis/Area_1/` | points on the surface, a file an instance, by room |
//!
//! # ply
//!
//! A binary mesh, which MeshLab, Open3D, trimesh and `s3d` read. Vertices have `x y z` (float, metres, Z-up)
//! and, if the mesh has colours or textures, `red green blue`. Faces have `vertex_indices` and three numbers:
//! `class`, `instance` and `room`, −1 for none. Comments of the header tell their names, as in
//! `comment class 8 chair`. Classes have the numbers of the taxonomy, which are 0 to 12 for S3DIS.
//! Instances and rooms have their permanent numbers.
//!
//! # scannet
//!
//! `NAME_vh_clean_2.ply` (the mesh), `NAME_vh_clean_2.0.010000.segs.json` (`segIndices`: a segment for each
//! vertex) and `NAME.aggregation.json` (`segGroups`: objects as lists of segments). A segment that several
//! instances share is cut along them, so that each object is a union of segments. A vertex belongs to the
//! segment with the largest area around it. Objects are numbered from 0, in the order of the permanent
//! numbers of the instances.
//!
//! # scannetpp
//!
//! `mesh_aligned_0.05.ply`, `segments.json` and `segments_anno.json` in `scans/`. Every vertex is a segment
//! of its own, since the toolkit reads the segments of a group as vertices; a vertex belongs to the instance
//! with the largest area around it. Objects are numbered from 1: 0 is the toolkit's number for none. `obb` is
//! the box along the axes.
//!
//! Both formats of ScanNet have no rooms. An instance that has no vertex, which is smaller than its
//! neighbours at each of them, is left out with a warning.
//!
//! # s3dis
//!
//! `Area_1/office_1/Annotations/chair_1.txt` and so on: see
//! [`S3disAreaWriter`](s3d_io::cloud::S3disAreaWriter). The points are drawn evenly from the surface, as
//! `s3d sample` draws them, at least one an instance. Instances are numbered per class and room; one that
//! reaches into several rooms has a file in each. The tree has no place for surface without a label, and for
//! rooms without a type: such surface is left out, with a warning of its area.
//!
//! Folders also have `about.json`, which names the program, the mesh, the revision of the labels, and the
//! objects.

mod ply;
mod s3dis;
mod scannet;
mod scannetpp;
mod vertices;

use crate::labelling::LabelFolder;
use crate::segments::Segments;
use s3d_dataset::error::InputError;
#[cfg(feature = "clap")]
use s3d_dataset::options::words;
use s3d_dataset::store::{FolderKind, NewFolder, check_apart};
use s3d_dataset::{Context, Result};
use s3d_geom::TriMesh;
use s3d_geom::glam::DVec3;
use s3d_io::cloud::mesh_checksum;
use s3d_io::fs::{Checksum, portable_file_name, write_json};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The number of what has no label.
const NONE: u32 = 0;

/// The folders that [`write_output`] makes.
const KIND: FolderKind = FolderKind {
    about: "about.json",
    generator: "s3d label",
    noun: "output of labels",
    action: "use as the folder of the output",
};

/// A format that labels are written in: see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum OutputFormat {
    /// A mesh with labels of its faces.
    Ply,
    /// A scan of ScanNet.
    #[cfg_attr(feature = "clap", value(name = "scannet"))]
    ScanNet,
    /// A scan of ScanNet++.
    #[cfg_attr(feature = "clap", value(name = "scannetpp"))]
    ScanNetPp,
    /// Points on the surface, as in S3DIS.
    S3dis,
}

impl OutputFormat {
    /// All formats.
    pub const ALL: [Self; 4] = [Self::Ply, Self::ScanNet, Self::ScanNetPp, Self::S3dis];

    /// Returns its word: `ply`, `scannet`, `scannetpp` or `s3dis`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Ply => "ply",
            Self::ScanNet => "scannet",
            Self::ScanNetPp => "scannetpp",
            Self::S3dis => "s3dis",
        }
    }

    /// Returns the usual place of an output, which is beside the folder of labels.
    ///
    /// ```
    /// use s3d_annotate::outputs::OutputFormat;
    /// use std::path::Path;
    ///
    /// let folder = Path::new("scans/hall.labels");
    /// assert_eq!(OutputFormat::Ply.usual_place(folder), Path::new("scans/hall_labelled.ply"));
    /// assert_eq!(OutputFormat::S3dis.usual_place(folder), Path::new("scans/hall_s3dis"));
    /// ```
    pub fn usual_place(self, labels: &Path) -> PathBuf {
        let mut name = scene_of(labels).into_owned();
        match self {
            Self::Ply => name.push_str("_labelled.ply"),
            _ => name = format!("{name}_{self}"),
        }
        labels.with_file_name(name)
    }
}

impl fmt::Display for OutputFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// A word is no format that labels are written in.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{word:?} is no format of labels: take ply, scannet, scannetpp or s3dis")]
pub struct UnknownFormat {
    /// The word.
    pub word: String,
}

impl FromStr for OutputFormat {
    type Err = UnknownFormat;

    fn from_str(word: &str) -> Result<Self, UnknownFormat> {
        let found = Self::ALL.into_iter().find(|format| format.name() == word);
        found.ok_or_else(|| UnknownFormat { word: word.to_owned() })
    }
}

/// How labels are written. With the feature `clap` it is a group of arguments of a command line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct OutputOptions {
    /// The points of a square metre in the format s3dis. 2,500 are about 2 cm apart.
    #[cfg_attr(feature = "clap", arg(long = "density", value_name = "POINTS_PER_M2",
        default_value_t = 2500.0, value_parser = words::positive))]
    pub points_per_m2: f64,
    /// The seed of these points.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub seed: u64,
    /// What was subtracted from the scan's own coordinates, metres. The PLY files tell it in a comment;
    /// coordinates stay those of the mesh.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub offset_m: DVec3,
    /// Replace an earlier output.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
}

impl Default for OutputOptions {
    fn default() -> Self {
        Self { points_per_m2: 2500.0, seed: 0, offset_m: DVec3::ZERO, overwrite: false }
    }
}

/// Writes labels for other programs, as `to`: a file for [`OutputFormat::Ply`], or else a folder. Returns
/// `to`. [`OutputFormat::usual_place`] is its usual name.
///
/// The same labels give the same bytes. Only ScanNet's format needs the segments.
///
/// # Errors
/// [`Error::Input`](s3d_dataset::Error::Input) if `mesh` is not the mesh of the labels, nothing is labelled,
/// `to` lies in the folder of labels, or, for S3DIS, nothing is in a room with a type.
/// [`Error::Usage`](s3d_dataset::Error::Usage) if `to` exists and is not to be replaced, or is a folder of
/// something else, and for too many points. [`Error::File`](s3d_dataset::Error::File);
/// [`Error::Cancelled`](s3d_dataset::Error::Cancelled).
pub fn write_output(
    format: OutputFormat,
    labels: &LabelFolder,
    mesh: &TriMesh,
    segments: &Segments,
    to: &Path,
    options: &OutputOptions,
    ctx: &Context,
) -> Result<PathBuf> {
    let labelled = Labelled::new(labels, mesh, *options)?;
    check_apart(to, labels.path()).map_err(|_| {
        let why = "an output does not lie in the folder of labels, nor the folder of labels in it: name \
                   another place";
        InputError::Unfit { path: to.to_owned(), why: why.to_owned() }
    })?;
    if format == OutputFormat::Ply {
        labelled.write_ply(to, ctx)?;
        return Ok(to.to_owned());
    }

    let folder = NewFolder::begin(ctx, to, labels.path(), KIND, options.overwrite)?;
    let objects = match format {
        OutputFormat::ScanNet => labelled.write_scannet(folder.path(), segments, ctx)?,
        OutputFormat::ScanNetPp => labelled.write_scannetpp(folder.path(), ctx)?,
        OutputFormat::Ply | OutputFormat::S3dis => labelled.write_s3dis(folder.path(), ctx)?,
    };
    let about = About {
        generator: KIND.generator,
        version: env!("CARGO_PKG_VERSION"),
        format,
        scene: &labelled.scene,
        mesh: labels.mesh(),
        revision: labels.state().revision(),
        offset_m: options.offset_m.to_array(),
        objects,
    };
    write_json(&folder.path().join(KIND.about), &about)?;
    folder.finish()?;
    Ok(to.to_owned())
}

/// What `about.json` holds.
#[derive(Serialize)]
struct About<'a> {
    generator: &'static str,
    version: &'static str,
    format: OutputFormat,
    scene: &'a str,
    mesh: Checksum,
    revision: u64,
    /// What was subtracted from the scan's own coordinates.
    offset_m: [f64; 3],
    objects: Vec<Object>,
}

/// An object of an output.
#[derive(Serialize)]
struct Object {
    /// The number or the file that the output has for it.
    #[serde(rename = "is")]
    place: Place,
    /// The permanent number of its instance.
    instance: u32,
    /// The name of its instance, such as `chair_3`.
    name: String,
}

/// The number or the file of an object.
#[derive(Serialize)]
#[serde(untagged)]
enum Place {
    Number(usize),
    File(String),
}

/// Labels with their mesh, as all formats need them.
struct Labelled<'a> {
    labels: &'a LabelFolder,
    mesh: &'a TriMesh,
    /// The instance of each face.
    instance_of_face: &'a [u32],
    /// The instances that have a face, with their names such as `chair_3`.
    names: BTreeMap<u32, String>,
    /// The name of the scene, which starts the names of files.
    scene: String,
    options: OutputOptions,
}

impl<'a> Labelled<'a> {
    /// Checks that the labels are of the mesh, and that there are any.
    fn new(labels: &'a LabelFolder, mesh: &'a TriMesh, options: OutputOptions) -> Result<Self> {
        let state = labels.state();
        let unfit = |why: String| InputError::Unfit { path: labels.path().to_owned(), why };
        let [labelled, faces] = [state.face_count() as usize, mesh.faces().len()];
        if labelled != faces || mesh_checksum(mesh) != labels.mesh() {
            let why = format!(
                "the labels are about another mesh, of {labelled} faces; this one has {faces}: open the mesh \
                 that was labelled"
            );
            return Err(unfit(why).into());
        }

        let names = state.instance_names();
        if names.is_empty() {
            let why = "no face has a label, so there is nothing to write: label some surface first";
            return Err(unfit(why.to_owned()).into());
        }
        Ok(Self {
            labels,
            mesh,
            instance_of_face: state.instance_of_face(),
            names,
            scene: portable_file_name(&scene_of(labels.path())),
            options,
        })
    }

    /// Returns the class of an instance.
    fn class(&self, instance: u32) -> &'a str {
        self.labels.state().instances().get(&instance).map_or("", |class| class)
    }

    fn name(&self, instance: u32) -> String {
        self.names.get(&instance).cloned().unwrap_or_default()
    }
}

/// Returns the name of the scene of a folder of labels: without `.labels`.
fn scene_of(labels: &Path) -> std::borrow::Cow<'_, str> {
    let name = labels
        .file_name()
        .filter(|_| labels.extension().is_some_and(|e| e == "labels"));
    let stem = name.and_then(|_| labels.file_stem()).or(labels.file_name());
    stem.map_or("scan".into(), |stem| stem.to_string_lossy())
}
