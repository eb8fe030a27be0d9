//! What the steps of an export hand to one another: what all areas share, and a mesh that is ready for rays.

use crate::account::Account;
use crate::export::input::stamps::Stamps;
use crate::options::ExportOptions;
use crate::record::journal::{Journal, Unit};
use s3d_geom::NearestFaces;
use s3d_io::dataset::Layout;
use s3d_io::mesh::MeshFile;
use s3d_label::LabelTable;
use s3d_render::Scene;
use std::path::{Path, PathBuf};

/// The form in which an export writes its images, and whether it writes the rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// A data set: a file for each image, with meshes and points.
    DataSet,
    /// What a package is made from: a bundle for each scan location and photograph. Meshes and points only if
    /// the package needs them.
    Bundles { with_meshes: bool },
}

impl Form {
    /// Whether images lie in bundles.
    pub(crate) fn is_bundled(self) -> bool {
        self != Self::DataSet
    }

    /// Whether a unit is part of it.
    pub(crate) fn has(self, unit: &Unit) -> bool {
        self != Self::Bundles { with_meshes: false } || !matches!(unit, Unit::Assets(_))
    }
}

/// What all areas share.
#[derive(Clone, Copy)]
pub(crate) struct Common<'a> {
    pub(crate) table: &'a LabelTable,
    pub(crate) layout: &'a Layout,
    pub(crate) options: &'a ExportOptions,
    pub(crate) journal: &'a Journal,
    pub(crate) account: &'a Account<'a>,
    /// Holds a folder for each labelled area.
    pub(crate) cache: &'a Path,
    /// Which units this process writes.
    pub(crate) is_ours: &'a (dyn Fn(&Unit) -> bool + Sync),
    /// The input files as they were when they were looked at first.
    pub(crate) stamps: &'a Stamps,
    pub(crate) form: Form,
}

impl Common<'_> {
    /// The folder of a labelled area.
    pub(crate) fn cache_of(&self, area: u32) -> PathBuf {
        self.cache.join(format!("area_{area}"))
    }
}

/// The two hierarchies of a mesh with more faces than this are built one after the other: the temporary
/// memory of a build, 200 bytes a face, should not be taken twice.
const LARGE_MESH: usize = 2_000_000;

/// A mesh that is ready for rays.
pub(crate) struct PreparedMesh<'m> {
    pub(crate) file: &'m MeshFile,
    pub(crate) scene: Scene<'m>,
}

impl<'m> PreparedMesh<'m> {
    /// Prepares the mesh for rays and for nearest faces, at the same time unless it is large. Only labelling
    /// needs the nearest faces.
    pub(crate) fn new(file: &'m MeshFile) -> (Self, NearestFaces<'m>) {
        let (scene, nearest) = match file.mesh.faces().len() {
            0..=LARGE_MESH => rayon::join(|| Scene::new(&file.mesh), || NearestFaces::new(&file.mesh)),
            _ => (Scene::new(&file.mesh), NearestFaces::new(&file.mesh)),
        };
        (Self { file, scene }, nearest)
    }

    /// Prepares the mesh, with its nearest faces if they are needed.
    pub(crate) fn prepare(file: &'m MeshFile, with_nearest: bool) -> (Self, Option<NearestFaces<'m>>) {
        if !with_nearest {
            return (Self::for_rays(file), None);
        }
        let (prepared, nearest) = Self::new(file);
        (prepared, Some(nearest))
    }

    /// The mesh's nearest faces.
    pub(crate) fn nearest(&self) -> NearestFaces<'m> {
        NearestFaces::new(&self.file.mesh)
    }

    /// Prepares the mesh for rays only.
    pub(crate) fn for_rays(file: &'m MeshFile) -> Self {
        Self { file, scene: Scene::new(&file.mesh) }
    }
}
