//! Hits to the bytes of an image file, one function for every modality.

use s3d_geom::Camera;
use s3d_io::{Content, Domain, encode_gray16, encode_rgb8, encode_xyz_half};
use s3d_render::{
    Hits, Normals, Pyramids, Scene, color_per_face_image, depth_image, index_image, normal_image, rgb_image,
    xyz_image_half,
};

/// What images of a mesh are made from.
pub(crate) struct Look<'a> {
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) textures: &'a Pyramids,
    pub(crate) normals: Normals,
    /// The label index of each face; may be empty if no semantic image is asked for.
    pub(crate) label_per_face: &'a [u32],
    /// The colour of each face in pretty images; may be empty likewise.
    pub(crate) pretty_per_face: &'a [[u8; 3]],
}

/// A domain that is an image: all but the pose.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Image {
    Rgb,
    Depth,
    Normal,
    Semantic,
    SemanticPretty,
    GlobalXyz,
}

impl Image {
    /// The image that a domain is.
    pub(crate) fn of(domain: Domain) -> Option<Self> {
        Some(match domain {
            Domain::Rgb => Self::Rgb,
            Domain::Depth => Self::Depth,
            Domain::Normal => Self::Normal,
            Domain::Semantic => Self::Semantic,
            Domain::SemanticPretty => Self::SemanticPretty,
            Domain::GlobalXyz => Self::GlobalXyz,
            Domain::Pose => return None,
        })
    }
}

impl Look<'_> {
    /// The file of one image of a view, from the view's hits.
    pub(crate) fn encode(&self, image: Image, hits: &Hits, camera: &Camera) -> Vec<u8> {
        match image {
            Image::Rgb => encode_rgb8(&rgb_image(self.scene, self.textures, hits, camera), Content::Photo),
            Image::Depth => encode_gray16(&depth_image(hits)),
            Image::Normal => {
                encode_rgb8(&normal_image(self.scene, hits, camera, self.normals), Content::Normals)
            }
            Image::Semantic => encode_rgb8(&index_image(hits, self.label_per_face), Content::Labels),
            Image::SemanticPretty => {
                encode_rgb8(&color_per_face_image(hits, self.pretty_per_face), Content::Labels)
            }
            Image::GlobalXyz => encode_xyz_half(&xyz_image_half(hits, camera)),
        }
    }
}
