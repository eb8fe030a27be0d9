//! Draws label images whose borders follow the picture: the inputs of `s3d_label::refine` from hits.

use s3d_geom::{Camera, NormalAxes, Raster};
use s3d_label::refine::{NO_LABEL, RefineInput, refine};
use s3d_render::{Hits, MISSING_INDEX, NO_FACE, Normals, Scene, face_size_image_into, normal_vectors};

/// What is drawn of an image.
pub(crate) struct RefinedImages {
    /// Label indices as colours, as `semantic` has them.
    pub(crate) index: Raster<[u8; 3]>,
    /// 255 where the label is not that of the mesh.
    pub(crate) moved: Raster<u8>,
}

/// Fuses the labels of the faces that an image sees with its colours. The result depends on the arguments
/// alone.
///
/// # Panics
/// If the hits or the colours are not of the camera's size, or a visible face has no label.
pub(crate) fn refined_images(
    scene: &Scene<'_>,
    hits: &Hits,
    camera: &Camera,
    colors: &Raster<[u8; 3]>,
    label_of_face: &[u32],
) -> RefinedImages {
    let label = |face: &u32| match *face {
        NO_FACE => NO_LABEL,
        face => label_of_face[face as usize],
    };
    let labels: Vec<u32> = hits.face.pixels().iter().map(label).collect();

    // The axes of the camera or of the world do not matter: only angles between normals count.
    let normals = normal_vectors(scene, hits, camera, Normals::Flat, NormalAxes::Paper);
    let normals = normals.map(|normal| normal.map(|part| (part * 127.0).round() as i8));
    let mut face_px = Raster::filled(0, 0, 0);
    face_size_image_into(scene, hits, camera, &mut face_px);

    let refined = refine(&RefineInput {
        width: camera.width as usize,
        wraps: camera.is_panorama(),
        labels: &labels,
        colors: colors.pixels(),
        depth_m: hits.depth.pixels(),
        normals: normals.pixels(),
        face_px: face_px.pixels(),
    });

    let index = |label: &u32| match *label {
        NO_LABEL => MISSING_INDEX,
        label => {
            let [_, r, g, b] = label.to_be_bytes();
            [r, g, b]
        }
    };
    let moved = |is_moved: &bool| if *is_moved { 255 } else { 0 };
    let (width, height) = (camera.width, camera.height);
    RefinedImages {
        index: Raster::from_vec(width, height, refined.labels.iter().map(index).collect()),
        moved: Raster::from_vec(width, height, refined.is_moved.iter().map(moved).collect()),
    }
}
