//! Checks images one after another: their files against each other, and against the mesh.

pub(crate) mod diagnosis;
mod image_check;
mod image_files;
mod objects;
pub(crate) mod picture_colors;
pub(crate) mod pixels;
pub(crate) mod rays;
mod shade;

use crate::export::images::objects::InstanceFinder;
use crate::export::modality::{Channels, ImageBuffers};
use crate::record::manifest::Manifest;
use crate::verify::files::Files;
use crate::verify::images::picture_colors::ViewColors;
use crate::verify::images::pixels::Difference;
use crate::verify::labels::Labels;
use crate::verify::mesh::LabelledMesh;
use crate::verify::photographs::Photographs;
use crate::verify::report::Report;
use crate::verify::views::Views;
use s3d_geom::Camera;
use s3d_io::dataset::{Domain, Layout};
use s3d_io::image::PngReader;
use s3d_render::{Caster, Hits, SeenObjects};
use std::sync::Mutex;
use std::sync::atomic::AtomicU64;

/// The exported mesh and its tables, which the images of an area are compared with.
pub(crate) struct Reference<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) manifest: &'a Manifest,
    pub(crate) labels: &'a Labels,
    pub(crate) mesh: &'a LabelledMesh,
    pub(crate) channels: Channels<'a>,
    /// Whether RGB comes from the mesh.
    pub(crate) rgb_from_mesh: bool,
    /// Finds the objects of images, if the data set has them.
    pub(crate) instances: Option<&'a InstanceFinder<'a>>,
    pub(crate) report: &'a Report,
}

/// The inputs and shared results of the checks of an area's images.
pub(crate) struct ImageCheck<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) manifest: &'a Manifest,
    pub(crate) labels: Option<&'a Labels>,
    pub(crate) views: &'a Views,
    pub(crate) photographs: &'a Photographs,
    pub(crate) files: &'a Files,
    /// `None` if the meshes cannot be used.
    pub(crate) reference: Option<&'a Reference<'a>>,
    pub(crate) report: &'a Report,
    pub(crate) domains: &'a [Domain],
    /// Files that differ from the mesh, kept for a second look.
    pub(crate) mismatches: &'a Mutex<Vec<Mismatch>>,
    /// The colours of views that come from pictures.
    pub(crate) view_colors: &'a Mutex<Vec<ViewColors>>,
    /// The cameras that could be read, each with the index of its image.
    pub(crate) cameras: &'a Mutex<Vec<(usize, Camera)>>,
    /// Pixels of the label images without votes and without a label.
    pub(crate) unlabelled: &'a UnlabelledPixels,
}

/// Counts over the label images of an area, from all threads.
#[derive(Default)]
pub(crate) struct UnlabelledPixels {
    /// Images whose rays were cast.
    pub(crate) images: AtomicU64,
    pub(crate) without_votes: AtomicU64,
    pub(crate) without_label: AtomicU64,
}

/// A file that differs from the mesh.
pub(crate) struct Mismatch {
    /// The index of its image in the list.
    pub(crate) image: usize,
    pub(crate) domain: Domain,
    pub(crate) difference: Difference,
    pub(crate) camera: Camera,
}

/// Buffers that a thread keeps from image to image.
pub(crate) struct Scratch<'s> {
    caster: Option<Caster<'s, 's>>,
    hits: Hits,
    buffers: ImageBuffers,
    reader: PngReader,
    /// Finds objects, if the data set has them.
    objects: Option<SeenObjects<'s, 's>>,
}

impl<'s> Scratch<'s> {
    pub(crate) fn new(reference: Option<&'s Reference<'s>>) -> Self {
        Self {
            caster: reference.map(|s| Caster::new(s.channels.scene)),
            hits: Hits::default(),
            buffers: ImageBuffers::default(),
            reader: PngReader::default(),
            objects: reference.and_then(|s| s.instances).map(InstanceFinder::memory),
        }
    }
}
