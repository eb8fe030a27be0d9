//! The parts of a scan of one area, as `scene.toml` names them.

use crate::cloud::annotations::AnnotationOptions;
use crate::mesh::file::{LengthUnit, UpAxis};
use crate::scene::cameras::CameraSource;
use crate::scene::frames::FrameSource;
use crate::scene::fuse::FuseSource;
use crate::scene::parts::PartSource;
use crate::scene::rgb::PictureSource;
use s3d_geom::glam::{DAffine3, DVec3};
use s3d_label::Taxonomy;
use serde::Deserialize;
use std::path::PathBuf;

/// The parts of a scan of one area. Paths are resolved: relative ones start at the folder of the file that
/// names them.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The `scene.toml` itself.
    pub path: PathBuf,
    /// The number of the area, from 1.
    pub area: u32,
    /// The folder of a published area, if mesh, labels and scan locations come from one. `mesh` and
    /// `annotations` are empty then. See [`PublishedArea`](crate::scene::PublishedArea).
    pub published: Option<PathBuf>,
    /// The transform from the published area's frame to the world: a rotation, a shift and a scale. It is
    /// meant for areas 5a and 5b, whose frames differ.
    pub world_from_published: DAffine3,
    /// The parts that the area is joined from. If there are some, they bring meshes, pictures, and labels
    /// unless `is_labelled`, and there is no `mesh`.
    pub parts: Vec<PartSource>,
    /// The files of the textured mesh, at least one. Several are joined in this order.
    pub mesh: Vec<PathBuf>,
    /// The raw scan that the mesh is fused from. `mesh` is then its [`FuseSource::mesh`], which need not
    /// exist.
    pub fuse: Option<FuseSource>,
    /// The axis of the mesh that points up. The default is +Y, which glTF defines and the published OBJ files
    /// use.
    pub up: UpAxis,
    /// The unit of the mesh's coordinates. `None`: the unit that the mesh's file says, or metres. Points and
    /// scan locations are always in metres.
    pub units: Option<LengthUnit>,
    /// Whether a glTF file may name files outside its folder: see
    /// [`MeshOptions::outside_files`](crate::mesh::MeshOptions::outside_files).
    pub outside_files: bool,
    /// The offset that is subtracted from the mesh's positions in `f64`, in the world's axes. `None`: nothing
    /// is subtracted, unless the mesh lies far from the origin
    /// ([`MeshOrigin::Near`](crate::mesh::MeshOrigin::Near)).
    pub mesh_offset_m: Option<DVec3>,
    /// The source of the mesh's colours.
    pub mesh_colors: MeshColors,
    /// The classes and the types of rooms. A published area brings its own.
    pub taxonomy: Taxonomy,
    /// The file that the taxonomy was read from, if it has one of its own.
    pub taxonomy_file: Option<PathBuf>,
    /// Whether there are labels. If not, `annotations` is empty. A published area brings its own.
    pub is_labelled: bool,
    /// The files and folders of the annotated points: see
    /// [`Annotations::open`](crate::cloud::Annotations::open). If empty, the labels that came with the mesh
    /// are used: see [`Annotations::of_mesh`](crate::cloud::Annotations::of_mesh).
    pub annotations: Vec<PathBuf>,
    /// How the annotations are read. The first fault is an error.
    pub annotation_options: AnnotationOptions,
    /// Whether the file gives the offset that is subtracted from the annotations. If not, the mesh's offset
    /// is used.
    pub annotations_have_offset: bool,
    /// The source of the scan locations; `None` if the file does not say.
    pub cameras: Option<CameraSource>,
    /// The scanner's pictures, if RGB images are made from them instead of the mesh's texture.
    pub pictures: Option<PictureSource>,
    /// The photographs with poses. Each of them becomes a view.
    pub frames: Option<FrameSource>,
}

/// The source of a mesh's colours.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum MeshColors {
    /// The mesh itself: its textures, or the colours of its vertices or materials.
    #[default]
    File,
    /// The annotated points. This is for a mesh without textures, and builds
    /// `s3d_geom::VertexColors`.
    Points,
}

impl SceneFile {
    /// Returns a scene that consists of meshes alone, without labels, as area 1. Its `path` is the first
    /// mesh.
    pub fn of_meshes(mesh: Vec<PathBuf>, up: UpAxis) -> Self {
        Self {
            path: mesh.first().cloned().unwrap_or_default(),
            area: 1,
            published: None,
            world_from_published: DAffine3::IDENTITY,
            parts: Vec::new(),
            mesh,
            fuse: None,
            up,
            units: None,
            outside_files: false,
            mesh_offset_m: None,
            mesh_colors: MeshColors::File,
            taxonomy: Taxonomy::s3dis(),
            taxonomy_file: None,
            is_labelled: false,
            annotations: Vec::new(),
            annotation_options: AnnotationOptions::default(),
            annotations_have_offset: false,
            cameras: None,
            pictures: None,
            frames: None,
        }
    }
}
