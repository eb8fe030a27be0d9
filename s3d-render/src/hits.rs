//! The face and the depth that each pixel of an image sees.

use s3d_geom::Raster;

/// Stands for "no face": the pixel's ray hits nothing.
pub const NO_FACE: u32 = u32::MAX;

/// The face and the depth that each pixel of an image sees. All images of a view are made from the same hits,
/// so they agree pixel for pixel.
///
/// ```
/// use s3d_geom::{Camera, Pose, TriMesh, glam::{dvec3, vec3}};
/// use s3d_render::{NO_FACE, Scene, cast};
///
/// // A triangle 2 m ahead of a camera that looks along +Y.
/// let corners = vec![vec3(-1.0, 2.0, 0.5), vec3(1.0, 2.0, 0.5), vec3(0.0, 2.0, 2.5)];
/// let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2]])?;
/// let camera = Camera::perspective(Pose::level(dvec3(0.0, 0.0, 1.5), 0.0), 75f64.to_radians(), 540, 540);
/// let hits = cast(&Scene::new(&mesh), &camera);
/// assert_eq!((hits.face.at(270, 270), hits.depth.at(270, 270)), (0, 2.0));
/// assert_eq!((hits.face.at(0, 0), hits.depth.at(0, 0)), (NO_FACE, f32::INFINITY));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Hits {
    /// The face that each pixel's ray hits first; [`NO_FACE`] where it hits nothing.
    pub face: Raster<u32>,
    /// The depth of each pixel in metres: the multiple of the ray's direction that
    /// [`Camera::rays`](s3d_geom::Camera::rays) gives. That is z along the optical axis in a perspective
    /// view, and the distance in a panorama. Infinite where nothing is hit.
    pub depth: Raster<f32>,
}

impl Default for Hits {
    /// Returns hits without pixels.
    fn default() -> Self {
        Self { face: Raster::from_vec(0, 0, Vec::new()), depth: Raster::from_vec(0, 0, Vec::new()) }
    }
}

impl Hits {
    /// Makes room for an image. The values of the pixels are unspecified afterwards.
    pub(crate) fn resize(&mut self, width: u32, height: u32) {
        if (self.face.width(), self.face.height()) == (width, height) {
            return;
        }

        let n = width as usize * height as usize;
        let Hits { face, depth } = std::mem::take(self);
        let mut faces = face.into_vec();
        let mut depths = depth.into_vec();
        // A panorama's memory is too much for a view to keep.
        if faces.capacity() > 4 * n {
            (faces, depths) = (Vec::new(), Vec::new());
        }

        faces.resize(n, NO_FACE);
        depths.resize(n, f32::INFINITY);
        *self = Self {
            face: Raster::from_vec(width, height, faces),
            depth: Raster::from_vec(width, height, depths),
        };
    }
}
