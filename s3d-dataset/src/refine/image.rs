//! One image of a data set, refined.

use crate::error::Result;
use crate::record::data_set::DataSet;
use crate::survey::refined_labels::refined_images;
use s3d_geom::{Camera, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame};
use s3d_io::image::{Compression, Content, decode_rgb8, encode_gray8, encode_rgb8};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_render::{Caster, Hits, Scene};
use std::collections::BTreeMap;

/// The files that are added to an image.
pub(super) struct RefinedFiles {
    pub(super) index: Vec<u8>,
    pub(super) moved: Vec<u8>,
}

/// What a thread keeps from image to image.
pub(super) struct Memory<'s> {
    scene: &'s Scene<'s>,
    caster: Caster<'s, 's>,
    hits: Hits,
}

impl<'s> Memory<'s> {
    pub(super) fn new(scene: &'s Scene<'s>) -> Self {
        Self { scene, caster: Caster::new(scene), hits: Hits::default() }
    }
}

/// The labelled mesh of an area, and which of its images are photographs.
pub(super) struct AreaSurface {
    mesh: TriMesh,
    label_of_face: Vec<u32>,
    /// The names of the photographs.
    photographs: Vec<String>,
}

impl AreaSurface {
    /// Reads `semantic.obj`, whose faces are those of the images. Numbers its labels by the label table.
    pub(super) fn read(data: &DataSet, area: u32) -> Result<Self> {
        let path = data.layout.semantic_obj(area);
        data.files.checked(&path.with_extension("mtl"))?;
        let mesh = read_mesh(data.files.checked(&path)?, UpAxis::Y)?.mesh;
        let table = data.labels()?.map(|table| table.names()).unwrap_or_default();
        let number_of: BTreeMap<&str, u32> = table.iter().map(String::as_str).zip(0..).collect();

        let number = |name: &str| {
            let message = || format!("the material {name:?} is no label of semantic_labels.json");
            number_of
                .get(name)
                .copied()
                .ok_or_else(|| FileError::format(&path, message()))
        };
        let numbers: Vec<u32> = mesh
            .materials()
            .iter()
            .map(|material| number(&material.name))
            .collect::<Result<_, _>>()?;
        let label = |face: u32| mesh.material_of(face).map_or(0, |material| numbers[material as usize]);
        let label_of_face = (0..mesh.faces().len() as u32).map(label).collect();

        let photographs = data.photographs(area)?.into_iter().map(|p| p.camera_uuid).collect();
        Ok(Self { mesh, label_of_face, photographs })
    }

    pub(super) fn mesh(&self) -> &TriMesh {
        &self.mesh
    }

    /// Makes the files of an image.
    pub(super) fn refined(
        &self,
        data: &DataSet,
        image: &DatasetImage,
        compression: Compression,
        memory: &mut Memory<'_>,
    ) -> Result<RefinedFiles> {
        let path = image.path(&data.layout, Domain::Rgb);
        let colors = decode_rgb8(&data.files.read_bytes(&path)?, &path)?;
        let camera = self.camera(data, image, [colors.width(), colors.height()])?;

        memory.caster.cast_into(&camera, 1, &mut memory.hits);
        let refined = refined_images(memory.scene, &memory.hits, &camera, &colors, &self.label_of_face);
        Ok(RefinedFiles {
            index: encode_rgb8(&refined.index, Content::Labels, compression),
            moved: encode_gray8(&refined.moved),
        })
    }

    /// Returns the camera of an image, exact to the bit: by its matrix, since angles are rounded.
    fn camera(&self, data: &DataSet, image: &DatasetImage, size: [u32; 2]) -> Result<Camera> {
        let file = data.pose(image)?;
        // Refuses a pose and a size that make no camera.
        data.camera(image, &file, size)?;
        let pose = file.exact_pose();
        let [width, height] = size;

        if image.frame == Frame::Panorama {
            return Ok(Camera::equirectangular(pose, width));
        }
        if self.photographs.contains(&image.uuid) {
            let camera = Camera::from_k_rt(file.camera_k_matrix, pose.rt_matrix(), width, height);
            let path = image.path(&data.layout, Domain::Pose);
            let camera = camera.map_err(|e| FileError::format(&path, e.to_string()))?;
            return Ok(Camera { pose, ..camera });
        }
        let fov = file.field_of_view_rads;
        if !(fov > 0.0 && fov < std::f64::consts::PI) {
            let message = format!("field_of_view_rads {fov} is no angle of view");
            return Err(FileError::format(&image.path(&data.layout, Domain::Pose), message).into());
        }
        Ok(Camera::perspective(pose, fov, width, height))
    }
}
