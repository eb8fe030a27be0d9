//! The RGB image, one pixel at a time in `f64`. It is the reference for the fast way, and replaces it for
//! pixels whose `f32` values are not accurate enough.

use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::assert_size;
use crate::shade::mip_maps::{MipMap, MipMaps, TextureFilter};
use crate::shade::patch::{FaceCache, Patch, UvPatch};
use glam::DVec3;
use s3d_geom::{Camera, FaceColor, Projection, Raster, Rays};

/// Makes the image of [`crate::rgb_image_with`] one pixel at a time. Tests and benches compare the fast way
/// with this reference. Channels differ by at most 1, where rounding decides. Only in the few pixels whose
/// footprint is close to the next number of samples may they differ by more.
///
/// # Panics
/// As for [`crate::rgb_image`].
pub fn rgb_image_pixel_by_pixel(
    scene: &Scene<'_>,
    mip_maps: &MipMaps,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
) -> Raster<[u8; 3]> {
    assert_size(hits, camera);
    let mut pixels = PixelByPixel::new(scene, mip_maps, camera, filter);
    let mut out = Vec::with_capacity(hits.face.len());
    for (j, faces) in hits.face.rows().enumerate() {
        out.extend(faces.iter().enumerate().map(|(i, &face)| match face {
            NO_FACE => [0; 3],
            face => pixels.color(face, i, j),
        }));
    }
    Raster::from_vec(hits.face.width(), hits.face.height(), out)
}

/// Returns the colour that the ray of `camera` along `direction` sees on `face`, which it must hit. It is for
/// places between pixels, and for rays of no image. `direction` has the length of [`Camera::direction`]. At
/// the centre of a pixel, the channels are the same as in [`rgb_image_pixel_by_pixel`].
///
/// # Panics
/// If there is no face `face`, or `mip_maps` are another mesh's.
pub fn rgb_of_ray(
    scene: &Scene<'_>,
    mip_maps: &MipMaps,
    camera: &Camera,
    direction: DVec3,
    face: u32,
    filter: &TextureFilter,
) -> [u8; 3] {
    let steps = match camera.projection {
        Projection::Perspective { .. } | Projection::Pinhole { .. } => {
            let f = camera.focal_px();
            RayDifferentials::Same(camera.pose.right() / f.x, -camera.pose.up() / f.y)
        }
        Projection::Equirectangular => RayDifferentials::Turn {
            rad_per_pixel: std::f64::consts::TAU / f64::from(camera.width),
            rows: vec![(direction.truncate().length(), direction.z)],
        },
    };
    let paint = FacePaint::new(scene, mip_maps, face, camera.pose.location);
    seen_color(paint.at(direction, 0, &steps, filter))
}

/// Colours the pixels of an image one by one.
pub(crate) struct PixelByPixel<'a> {
    scene: &'a Scene<'a>,
    mip_maps: &'a MipMaps,
    filter: &'a TextureFilter,
    origin: DVec3,
    rays: Rays,
    steps: RayDifferentials,
    /// Created for the first pixel.
    paints: Option<FaceCache<FacePaint<'a>>>,
}

impl<'a> PixelByPixel<'a> {
    pub(crate) fn new(
        scene: &'a Scene<'a>,
        mip_maps: &'a MipMaps,
        camera: &Camera,
        filter: &'a TextureFilter,
    ) -> Self {
        let steps = RayDifferentials::new(camera);
        let rays = camera.rays();
        Self { scene, mip_maps, filter, origin: camera.pose.location, rays, steps, paints: None }
    }

    /// Returns the colour of pixel (i, j), which sees `face`.
    pub(crate) fn color(&mut self, face: u32, i: usize, j: usize) -> [u8; 3] {
        self.along(face, self.rays.at(i as u32, j as u32), j)
    }

    /// Returns the colour of `face` along `direction`, a ray in row j that hits it.
    pub(crate) fn along(&mut self, face: u32, direction: DVec3, j: usize) -> [u8; 3] {
        let Self { scene, mip_maps, origin, .. } = *self;
        let paints = self.paints.get_or_insert_with(FaceCache::new);
        let paint = paints.get(face, || FacePaint::new(scene, mip_maps, face, origin));
        seen_color(paint.at(direction, j, &self.steps, self.filter))
    }
}

/// Rounds a colour to 8 bits. The result is never black.
pub(crate) fn seen_color(color: [f32; 3]) -> [u8; 3] {
    match color.map(|channel| (channel + 0.5) as u8) {
        [0, 0, 0] => [1, 1, 1],
        rgb => rgb,
    }
}

/// The colour of a face, prepared for the origin.
enum FacePaint<'a> {
    Texture(MipMap<'a>, UvPatch),
    Corners(Patch, [[u8; 3]; 3]),
    Flat([u8; 3]),
}

impl<'a> FacePaint<'a> {
    fn new(scene: &Scene<'a>, mip_maps: &'a MipMaps, face: u32, origin: DVec3) -> Self {
        let patch = || Patch::new(scene.mesh(), face, origin);
        match scene.mesh().color_of(face) {
            FaceColor::Texture(index, texture, uvs) => {
                Self::Texture(mip_maps.mip_map(index, texture), UvPatch::new(&patch(), uvs))
            }
            FaceColor::Corners(corners) => Self::Corners(patch(), corners),
            FaceColor::Flat(color) => Self::Flat(color),
        }
    }

    /// Returns the colour that the ray along `d`, in row `j` of the image, sees: 0 to 255 a channel.
    #[inline(always)]
    fn at(&self, d: DVec3, j: usize, steps: &RayDifferentials, filter: &TextureFilter) -> [f32; 3] {
        match self {
            Self::Texture(mip_map, uv) => {
                let (x, y) = steps.at(d, j);
                let (uv, x, y) = uv.at(d, x, y);
                mip_map.sample(uv, x, y, filter)
            }
            Self::Corners(patch, corners) => {
                let weights = patch.weights(d).map(|w| w as f32);
                std::array::from_fn(|k| (0..3).map(|i| f32::from(corners[i][k]) * weights[i]).sum())
            }
            Self::Flat(color) => color.map(f32::from),
        }
    }
}

/// The change of a direction from a pixel to the next one on the right, and to the next one below.
enum RayDifferentials {
    Same(DVec3, DVec3),
    /// The angle from pixel to pixel, in radians: a panorama's pixels are squares in the map of longitude and
    /// latitude.
    Turn {
        rad_per_pixel: f64,
        rows: Vec<(f64, f64)>,
    },
}

impl RayDifferentials {
    fn new(camera: &Camera) -> Self {
        match camera.rays() {
            Rays::Perspective { x_step, y_step, .. } => Self::Same(x_step, y_step),
            Rays::Equirectangular { rows, .. } => {
                debug_assert!(camera.is_panorama());
                let rad_per_pixel = std::f64::consts::TAU / f64::from(camera.width);
                Self::Turn { rad_per_pixel, rows: rows.into_iter().map(Into::into).collect() }
            }
        }
    }

    /// Returns the derivatives of the direction `d`, in row `j`, by column and by row.
    #[inline(always)]
    fn at(&self, d: DVec3, j: usize) -> (DVec3, DVec3) {
        match self {
            Self::Same(x, y) => (*x, *y),
            Self::Turn { rad_per_pixel, rows } => {
                // Azimuth falls to the right, and latitude falls downwards. d = (cos lat · a, sin lat) with
                // |a| = 1. No row is at a pole, so cos lat > 0.
                let (cos, sin) = rows[j];
                let x = DVec3::new(d.y, -d.x, 0.0) * *rad_per_pixel;
                let up = sin / cos;
                let y = DVec3::new(d.x * up, d.y * up, -cos) * *rad_per_pixel;
                (x, y)
            }
        }
    }
}
