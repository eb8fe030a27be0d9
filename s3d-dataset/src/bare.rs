//! A scene whose labels are still to be made: its mesh, its places, its panoramas.

use crate::context::Context;
use crate::error::Result;
use crate::export::SceneSource;
use crate::export::input::Inputs;
use crate::export::input::area::AreaInput;
use crate::export::input::cameras::Cameras;
use crate::export::input::masks::named_like;
use crate::export::input::photographs::{Photograph, Taken};
use crate::place::{PlaceOptions, place_cameras};
use glam::{DVec2, DVec3, dvec2};
use s3d_geom::{Camera, CameraError, Pose, Raster, TriMesh};
use s3d_io::camera::ScanLocation;
use s3d_io::mesh::{LengthUnit, UpAxis};
use s3d_label::Taxonomy;
use s3d_render::Scene;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A scene without its labels, with the mesh as an export of the scene has it: the same faces, in the same
/// order and frame. Its annotations are not read, and need not exist.
pub struct BareScene {
    area: AreaInput,
    mesh: Arc<TriMesh>,
    mesh_files: Vec<PathBuf>,
}

impl fmt::Debug for BareScene {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("BareScene")
            .field("path", &self.area.path)
            .finish_non_exhaustive()
    }
}

/// A panorama that was photographed, with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct BarePanorama {
    /// What its list calls it.
    pub name: String,
    /// Where it was taken, world metres.
    pub location: DVec3,
}

/// A photograph of a scene, with its place and its lens.
#[derive(Clone, Copy, Debug)]
pub struct BarePhotograph<'s>(&'s Photograph);

impl BarePhotograph<'_> {
    /// Returns what its list calls it.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Returns its width and height in pixels.
    pub fn size(&self) -> [u32; 2] {
        self.0.taken.size()
    }

    /// Returns the camera that takes it without the distortion of its lens, or upright if it is a panorama.
    /// The image is about `width` pixels wide.
    ///
    /// # Errors
    /// Those of [`Camera::pinhole`].
    pub fn camera(&self, width: u32) -> std::result::Result<Camera, CameraError> {
        self.0.taken.camera(self.0.camera.pose, width)
    }

    /// Returns where it shows a direction in the world, of any length: shares of its width and height, 0 to
    /// 1, from the top left. `None` if it does not show it.
    pub fn place(&self, direction: DVec3) -> Option<DVec2> {
        let place = match &self.0.taken {
            Taken::Lens(lens) => {
                let [width, height] = lens.size();
                let pixel = lens.pixel(self.0.camera.pose.opencv_from_world() * direction)?;
                pixel / dvec2(f64::from(width), f64::from(height))
            }
            Taken::Panorama { pose, .. } => {
                let v = pose.opencv_from_world() * direction;
                let turn = libm::atan2(v.x, v.z) / std::f64::consts::TAU;
                dvec2(turn, libm::atan2(v.y, libm::hypot(v.x, v.z)) / std::f64::consts::PI) + 0.5
            }
        };
        Some(place)
    }

    /// Returns the files in `folder` that may be an image of its pixels, such as a mask: those of its name,
    /// with the ending kept, exchanged for `.png`, or followed by it.
    pub fn named_in(&self, folder: &Path) -> Vec<PathBuf> {
        named_like(folder, &self.0.name, Some(&self.0.picture.path), None)
    }
}

impl BareScene {
    /// Opens a scene file, a folder of a known set, or a mesh. What is odd goes to `ctx` as warnings.
    ///
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) or [`Error::File`](crate::Error::File) if the scene cannot be
    /// exported.
    pub fn open(scene: impl Into<SceneSource>, ctx: &Context) -> Result<Self> {
        let mut area = Inputs::open_bare(scene.into().fused(ctx)?)?;
        let file = area.take_mesh()?;
        area.tell_mesh(ctx, &file);
        let mesh_files = file.sources.into_iter().map(|source| source.path).collect();
        Ok(Self { area, mesh: Arc::new(file.mesh), mesh_files })
    }

    /// Returns the mesh.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// Returns what was named: a scene file, a folder, or a mesh.
    pub fn path(&self) -> &Path {
        &self.area.path
    }

    /// Returns the classes and types of rooms that labels may have.
    pub fn taxonomy(&self) -> &Taxonomy {
        &self.area.taxonomy
    }

    /// Returns the files that the mesh is read from.
    pub fn mesh_files(&self) -> &[PathBuf] {
        &self.mesh_files
    }

    /// Returns the axis of the mesh files that points up, and their unit if it was said or guessed; `None`
    /// for a mesh that is not read from files of meshes.
    pub fn mesh_axes(&self) -> Option<(UpAxis, Option<LengthUnit>)> {
        self.area.mesh_axes()
    }

    /// Returns what was subtracted from the scan's own coordinates, metres.
    pub fn offset_m(&self) -> DVec3 {
        self.area.frame.offset_m
    }

    /// Returns where the images of an export are taken: the listed locations, or else where its photographs
    /// were taken, or else the places that an export chooses.
    ///
    /// # Errors
    /// Those of [`place_cameras`].
    pub fn locations(&self, ctx: &Context) -> Result<Vec<ScanLocation>> {
        match &self.area.cameras {
            Cameras::Listed(locations, _) if locations.is_empty() => Ok(self.area.photographs.locations()),
            Cameras::Listed(locations, _) => Ok(locations.clone()),
            Cameras::Placed(_) => {
                let options = PlaceOptions { see: None, apart_m: None, seed: 0 };
                place_cameras(&Scene::new(self.mesh()), &options, ctx)
            }
        }
    }

    /// Returns the photographs with poses that the scene lists, in the order of the list.
    pub fn photographs(&self) -> impl Iterator<Item = BarePhotograph<'_>> {
        self.area.photographs.all.iter().map(BarePhotograph)
    }

    /// Returns the photographs that are panoramas. Their order is that of [`BareScene::panorama`].
    pub fn panoramas(&self) -> Vec<BarePanorama> {
        let of = |photograph: &Photograph| BarePanorama {
            name: photograph.name.clone(),
            location: photograph.camera.pose.location,
        };
        self.photographed().map(of).collect()
    }

    /// Reads a panorama, level and facing +Y in its middle, of at most this width; `None` if there is none
    /// with this number.
    ///
    /// # Errors
    /// [`Error::File`](crate::Error::File) if the photograph cannot be read.
    pub fn panorama(&self, number: usize, width: u32) -> Result<Option<Raster<[u8; 3]>>> {
        let Some(photograph) = self.photographed().nth(number) else { return Ok(None) };
        let photo = photograph.read()?;
        let pose = Pose::level(photograph.camera.pose.location, 0.0);
        let width = width.min(photograph.taken.size()[0]).max(2);
        Ok(Some(photograph.colors(&photo, &Camera::equirectangular(pose, width - width % 2))))
    }

    fn photographed(&self) -> impl Iterator<Item = &Photograph> {
        let all = self.area.photographs.all.iter();
        all.filter(|photograph| matches!(photograph.taken, Taken::Panorama { .. }))
    }
}
