//! Colours of a view that are taken from pictures instead of the mesh.

use crate::export::modality::Channels;
use s3d_geom::{Camera, Raster};
use s3d_io::scene::UnseenColor;
use s3d_render::{CubeMap, Hits, TextureFilter, Unseen, picture_image_into};

/// Colours from pictures instead of the mesh.
#[derive(Clone, Copy)]
pub(crate) enum PictureColors<'a> {
    /// From a cube map of the scanner's pictures.
    Cube {
        cube: &'a CubeMap,
        /// What is shown where the cube map has no colour.
        unseen: UnseenColor,
    },
    /// The view of a photograph, as it is.
    Photograph(&'a Raster<[u8; 3]>),
}

impl PictureColors<'_> {
    /// Makes the RGB image of a view.
    pub(crate) fn image_into(
        &self,
        channels: &Channels<'_>,
        hits: &Hits,
        camera: &Camera,
        out: &mut Raster<[u8; 3]>,
    ) {
        let (cube, unseen) = match self {
            Self::Cube { cube, unseen: UnseenColor::Mesh } => {
                (cube, Unseen::Mesh(channels.scene, channels.textures))
            }
            Self::Cube { cube, unseen: UnseenColor::Nearby } => (cube, Unseen::Nearby),
            Self::Photograph(image) => {
                out.clone_from(image);
                return;
            }
        };

        picture_image_into(cube, unseen, hits, camera, &TextureFilter::default(), out);
    }
}
