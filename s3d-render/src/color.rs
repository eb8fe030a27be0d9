//! The RGB image.

use crate::channels::assert_size;
use crate::patch::{FaceCache, Patch, UvPatch};
use crate::texture::{Pyramid, Pyramids, TextureFilter};
use crate::wide::{self, Work};
use crate::{Hits, NO_FACE, Scene};
use glam::DVec3;
use s3d_geom::{Camera, FaceColor, Projection, Raster, Rays};

/// The colours that the pixels see: textures filtered over each pixel's footprint, corners' colours interpolated,
/// materials flat. Black is for what is missing alone: a dark pixel that is seen is at least (1, 1, 1).
///
/// Near the seam of a texture atlas the footprint takes in what lies beside the seam, as with any mipmap.
///
/// # Panics
/// If the hits are not of the camera's size, or `pyramids` are another mesh's.
pub fn rgb_image(scene: &Scene<'_>, pyramids: &Pyramids, hits: &Hits, camera: &Camera) -> Raster<[u8; 3]> {
    rgb_image_with(scene, pyramids, hits, camera, &TextureFilter::default())
}

/// As [`rgb_image`], with a filter of choice.
///
/// # Panics
/// As [`rgb_image`].
pub fn rgb_image_with(
    scene: &Scene<'_>,
    pyramids: &Pyramids,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
) -> Raster<[u8; 3]> {
    wide::run(Rgb { scene, pyramids, hits, camera, filter })
}

struct Rgb<'a> {
    scene: &'a Scene<'a>,
    pyramids: &'a Pyramids,
    hits: &'a Hits,
    camera: &'a Camera,
    filter: &'a TextureFilter,
}

impl Work for Rgb<'_> {
    type Output = Raster<[u8; 3]>;

    #[inline(always)]
    fn run(self) -> Raster<[u8; 3]> {
        let Self { scene, pyramids, hits, camera, filter } = self;
        assert_size(hits, camera);
        let (steps, rays) = (Steps::new(camera), camera.rays());
        let mut paints = FaceCache::new();
        let mut out = Vec::with_capacity(hits.face.len());
        for (j, faces) in hits.face.rows().enumerate() {
            for (i, &face) in faces.iter().enumerate() {
                if face == NO_FACE {
                    out.push([0; 3]);
                    continue;
                }
                let paint = paints.get(face, || Paint::new(scene, pyramids, face, camera.pose.location));
                let d = rays.at(i as u32, j as u32);
                out.push(seen_color(paint.at(d, j, &steps, filter)));
            }
        }
        Raster::from_vec(hits.face.width(), hits.face.height(), out)
    }
}

/// Rounded to 8 bits, and never black.
#[inline(always)]
fn seen_color(color: [f32; 3]) -> [u8; 3] {
    match color.map(|channel| (channel + 0.5) as u8) {
        [0, 0, 0] => [1, 1, 1],
        rgb => rgb,
    }
}

/// How a face is coloured, prepared for the origin.
enum Paint<'a> {
    Texture(Pyramid<'a>, UvPatch),
    Corners(Patch, [[u8; 3]; 3]),
    Flat([u8; 3]),
}

impl<'a> Paint<'a> {
    fn new(scene: &Scene<'a>, pyramids: &'a Pyramids, face: u32, origin: DVec3) -> Self {
        let patch = || Patch::new(scene.mesh(), face, origin);
        match scene.mesh().color_of(face) {
            FaceColor::Texture(index, texture, uvs) => {
                Self::Texture(pyramids.pyramid(index, texture), UvPatch::new(&patch(), uvs))
            }
            FaceColor::Corners(corners) => Self::Corners(patch(), corners),
            FaceColor::Flat(color) => Self::Flat(color),
        }
    }

    /// The colour that the ray along `d`, in row `j` of the image, sees: 0 to 255 a channel.
    #[inline(always)]
    fn at(&self, d: DVec3, j: usize, steps: &Steps, filter: &TextureFilter) -> [f32; 3] {
        match self {
            Self::Texture(pyramid, uv) => {
                let (x, y) = steps.at(d, j);
                let (uv, x, y) = uv.at(d, x, y);
                pyramid.sample(uv, x, y, filter)
            }
            Self::Corners(patch, corners) => {
                let weights = patch.weights(d).map(|w| w as f32);
                std::array::from_fn(|k| (0..3).map(|i| f32::from(corners[i][k]) * weights[i]).sum())
            }
            Self::Flat(color) => color.map(f32::from),
        }
    }
}

/// What a pixel to the right and a pixel down add to a direction.
enum Steps {
    Same(DVec3, DVec3),
    /// Radians a pixel: a panorama's pixels are squares on the sphere's map.
    Turn {
        rad_per_pixel: f64,
        rows: Vec<(f64, f64)>,
    },
}

impl Steps {
    fn new(camera: &Camera) -> Self {
        match camera.rays() {
            Rays::Perspective { x_step, y_step, .. } => Self::Same(x_step, y_step),
            Rays::Equirectangular { rows, .. } => {
                debug_assert_eq!(camera.projection, Projection::Equirectangular);
                let rad_per_pixel = std::f64::consts::TAU / f64::from(camera.width);
                Self::Turn { rad_per_pixel, rows: rows.into_iter().map(Into::into).collect() }
            }
        }
    }

    /// The derivatives of the direction `d`, in row `j`, by column and row.
    #[inline(always)]
    fn at(&self, d: DVec3, j: usize) -> (DVec3, DVec3) {
        match self {
            Self::Same(x, y) => (*x, *y),
            Self::Turn { rad_per_pixel, rows } => {
                // Azimuth falls to the right and latitude falls downwards. d = (cos lat · a, sin lat), |a| = 1; rows
                // are never at a pole, so cos lat > 0.
                let (cos, sin) = rows[j];
                let x = DVec3::new(d.y, -d.x, 0.0) * *rad_per_pixel;
                let up = sin / cos;
                let y = DVec3::new(d.x * up, d.y * up, -cos) * *rad_per_pixel;
                (x, y)
            }
        }
    }
}
