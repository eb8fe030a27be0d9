//! Casts the pixels of a camera: the face that each one sees, and its depth.

use crate::hits::{Hits, NO_FACE};
use crate::pixel_box::PixelBox;
use crate::raster::panorama::Panorama;
use crate::raster::pinhole::Pinhole;
use crate::raster::window::{Scratch, VisibilityKernel, Window};
use crate::ray::caster::RayCaster;
use crate::scene::Scene;
use crate::simd::dispatch_on;
use s3d_geom::{Camera, Projection, Raster};
use s3d_simd::{ProvenLevel, level};
use std::f64::consts::TAU;

/// Casts image after image of a scene and keeps its memory between them. Each thread that renders should hold
/// one. Earlier images affect the time alone, not the result.
///
/// ```
/// use s3d_geom::{Camera, Pose, TriMesh, glam::{dvec3, vec3}};
/// use s3d_render::{Caster, Hits, Scene, coverage};
///
/// let corners = vec![vec3(-9.0, -9.0, 0.0), vec3(9.0, -9.0, 0.0), vec3(0.0, 9.0, 0.0)];
/// let floor = TriMesh::from_faces(corners, vec![[0, 1, 2]])?;
/// let scene = Scene::new(&floor);
/// let mut caster = Caster::new(&scene);
/// let mut hits = Hits::default();
/// let panorama = Camera::equirectangular(Pose::level(dvec3(0.0, 0.0, 1.5), 0.0), 256);
/// caster.cast_into(&panorama, 4, &mut hits); // every fourth pixel of every fourth row, to score it
/// assert_eq!((hits.face.width(), hits.face.height()), (64, 32));
/// assert!((0.3..0.5).contains(&coverage(&hits)));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub struct Caster<'s, 'm> {
    scene: &'s Scene<'m>,
    scratch: Scratch,
}

/// The most pixels of a window that is cast at once: they fit in the second-level cache and a part of the
/// third.
const WINDOW: usize = 1 << 17;

/// The most columns and rows of a window: their numbers fit in 16 bits.
const MAX_SIDE: usize = 1 << 14;

impl<'s, 'm> Caster<'s, 'm> {
    /// Returns a caster for a scene.
    pub fn new(scene: &'s Scene<'m>) -> Self {
        Self { scene, scratch: Scratch::default() }
    }

    /// Returns a caster for a scene that uses the memory of another one.
    pub(crate) fn reusing(scene: &'s Scene<'m>, scratch: Scratch) -> Self {
        Self { scene, scratch }
    }

    /// Returns the memory, for another scene.
    pub(crate) fn into_scratch(self) -> Scratch {
        self.scratch
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s Scene<'m> {
        self.scene
    }

    /// Casts the ray through the centre of every pixel; see [`crate::cast_ray`] for what counts as a hit.
    /// Runs on the calling thread alone.
    pub fn cast(&mut self, camera: &Camera) -> Hits {
        self.cast_strided(camera, 1)
    }

    /// Casts the rays of every `stride`th pixel of every `stride`th row; see [`cast_strided`].
    ///
    /// # Panics
    /// If `stride` is 0.
    pub fn cast_strided(&mut self, camera: &Camera, stride: u32) -> Hits {
        let mut hits = Hits::default();
        self.cast_into(camera, stride, &mut hits);
        hits
    }

    /// Casts like [`Self::cast_strided`], and overwrites `hits`. Repeated images of one size allocate no
    /// memory.
    ///
    /// # Panics
    /// If `stride` is 0.
    pub fn cast_into(&mut self, camera: &Camera, stride: u32, hits: &mut Hits) {
        let columns = samples(camera.width, stride);
        let rows = samples(camera.height, stride);
        let all = PixelBox { x: 0, y: 0, width: columns, height: rows };
        if is_coarse_panorama(camera, stride) && !all.is_empty() {
            *hits = cast_ray_by_ray(self.scene, camera, stride);
            return;
        }
        self.cast_samples(camera, stride, all, hits);
    }

    /// Casts the pixels of a part of the image, and overwrites `hits`, which get the size of the part. Each
    /// hit is the same as that of the whole image.
    ///
    /// # Panics
    /// If the part reaches beyond the image.
    pub fn cast_part_into(&mut self, camera: &Camera, part: PixelBox, hits: &mut Hits) {
        let fits = part.columns().end <= camera.width && part.rows().end <= camera.height;
        assert!(fits, "{part:?} of an image of {} × {}", camera.width, camera.height);
        if is_coarse_panorama(camera, 1) && !part.is_empty() {
            *hits = cast_part_ray_by_ray(self.scene, camera, part);
            return;
        }
        self.cast_samples(camera, 1, part, hits);
    }

    /// Casts the samples of a part, which is counted in samples.
    fn cast_samples(&mut self, camera: &Camera, stride: u32, part: PixelBox, hits: &mut Hits) {
        hits.resize(part.width, part.height);
        if part.is_empty() {
            return;
        }

        if !camera.pose.location.is_finite() {
            hits.face.pixels_mut().fill(NO_FACE);
            hits.depth.pixels_mut().fill(f32::INFINITY);
            return;
        }

        // The windows of a panorama are about square, so that few clusters lie in several windows, and each
        // window is far from the azimuth opposite to its middle. Views are no faster with squares than with
        // strips.
        let all_columns = samples(camera.width, stride) as usize;
        let across = if camera.is_panorama() {
            all_columns.div_ceil(WINDOW.isqrt()).max(4)
        } else {
            all_columns.div_ceil(MAX_SIDE)
        };
        let columns = part.width as usize;
        let rows = part.height as usize;
        let max_columns = all_columns.div_ceil(across).min(columns);
        // All windows have the same height but the last.
        let windows = (rows * max_columns).div_ceil(WINDOW);
        let max_rows = rows.div_ceil(windows).min(MAX_SIDE);

        let rays = &camera.rays();
        for row in (0..rows).step_by(max_rows) {
            for column in (0..columns).step_by(max_columns) {
                let width = max_columns.min(columns - column);
                let height = max_rows.min(rows - row);
                let first = row * columns + column;
                let [column, row] = [column + part.x as usize, row + part.y as usize];
                let window = Window { camera, rays, stride, column, row, width, height };
                let out = (&mut hits.face.pixels_mut()[first..], &mut hits.depth.pixels_mut()[first..]);
                cast_window(level(), self.scene, &window, &mut self.scratch, out, columns);
            }
        }
    }
}

/// Returns whether the samples of a camera are so far apart that they are cast ray by ray.
fn is_coarse_panorama(camera: &Camera, stride: u32) -> bool {
    let step_rad = TAU / f64::from(camera.width) * f64::from(stride);
    camera.is_panorama() && step_rad > Panorama::WIDEST_STEP_RAD && camera.pose.location.is_finite()
}

/// Casts a window with the instructions of `level`. `out` begins at the first pixel of the window; its rows
/// are `pitch` apart.
fn cast_window(
    level: ProvenLevel,
    scene: &Scene<'_>,
    window: &Window<'_>,
    scratch: &mut Scratch,
    out: (&mut [u32], &mut [f32]),
    pitch: usize,
) {
    match window.camera.projection {
        Projection::Perspective { .. } | Projection::Pinhole { .. } => {
            let raster = Pinhole::new(scene.mesh(), window);
            dispatch_on(level, VisibilityKernel { scene, raster, scratch, out, pitch });
        }
        Projection::Equirectangular => {
            let raster = Panorama::new(scene.mesh(), window);
            dispatch_on(level, VisibilityKernel { scene, raster, scratch, out, pitch });
        }
    }
}

/// Casts the ray through the centre of every pixel; see [`crate::cast_ray`] for what counts as a hit. Runs on
/// the calling thread alone. [`Caster`] keeps its memory for the next image.
pub fn cast(scene: &Scene<'_>, camera: &Camera) -> Hits {
    Caster::new(scene).cast(camera)
}

/// Casts the rays of every `stride`th pixel of every `stride`th row, from pixel (stride / 2, stride / 2) on:
/// enough to score a view. An axis of n pixels has (n − 1 − stride / 2) / stride + 1 of them (rounded
/// down), or none if stride / 2 ≥ n. A stride of 1 gives [`cast`].
///
/// # Panics
/// If `stride` is 0.
pub fn cast_strided(scene: &Scene<'_>, camera: &Camera, stride: u32) -> Hits {
    Caster::new(scene).cast_strided(camera, stride)
}

/// Casts like [`cast_strided`], one exact ray at a time. Tests and benches compare the fast way with this
/// reference.
///
/// # Panics
/// If `stride` is 0.
pub fn cast_ray_by_ray(scene: &Scene<'_>, camera: &Camera, stride: u32) -> Hits {
    cast_rays(scene, camera, &strided(camera.width, stride), &strided(camera.height, stride))
}

/// Casts the pixels of a part of an image, one exact ray at a time.
fn cast_part_ray_by_ray(scene: &Scene<'_>, camera: &Camera, part: PixelBox) -> Hits {
    cast_rays(scene, camera, &part.columns().collect::<Vec<_>>(), &part.rows().collect::<Vec<_>>())
}

/// Casts the rays through the centres of some columns and rows, one exact ray at a time.
fn cast_rays(scene: &Scene<'_>, camera: &Camera, columns: &[u32], rows: &[u32]) -> Hits {
    let mut caster = RayCaster::new(scene, camera.pose.location);
    let rays = camera.rays();

    let mut faces = Vec::new();
    let mut depths = Vec::new();
    for &j in rows {
        for &i in columns {
            let hit = caster.cast(rays.at(i, j));
            faces.push(hit.map_or(NO_FACE, |h| h.face));
            depths.push(hit.map_or(f32::INFINITY, |h| h.t as f32));
        }
    }

    let width = columns.len() as u32;
    let height = rows.len() as u32;
    Hits { face: Raster::from_vec(width, height, faces), depth: Raster::from_vec(width, height, depths) }
}

/// Returns the number of samples along `size` pixels.
fn samples(size: u32, stride: u32) -> u32 {
    assert!(stride > 0, "a stride of 0 pixels");
    if stride / 2 < size {
        (size - 1 - stride / 2) / stride + 1
    } else {
        0
    }
}

/// Returns the pixels of the samples along `size` pixels.
fn strided(size: u32, stride: u32) -> Vec<u32> {
    assert!(stride > 0, "a stride of 0 pixels");
    (stride / 2..size).step_by(stride as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec2};
    use s3d_geom::Pose;
    use s3d_synth::scenes::scan_like;

    #[test]
    fn registers_of_any_width_give_the_same_bits() {
        let mesh = scan_like(6000, 2);
        let scene = Scene::new(&mesh);
        let pose = Pose::level(DVec3::new(3.0, 2.5, 1.5), 0.3);
        let views = [
            Camera::perspective(pose.turned(0.0, -0.4), 1.4, 203, 131),
            Camera::perspective(pose.turned(2.0, 0.2), 0.7, 203, 131),
            Camera::pinhole(pose, dvec2(150.0, 90.0), dvec2(30.0, 150.0), 203, 131).unwrap(),
            Camera::equirectangular(pose, 400),
        ];

        for camera in &views {
            let width = (camera.width / 2) as usize;
            let height = camera.height as usize - 5;
            let window =
                Window { camera, rays: &camera.rays(), stride: 1, column: 60, row: 3, width, height };
            let images: Vec<_> = ProvenLevel::all()
                .into_iter()
                .map(|level| {
                    let mut faces = vec![7; width * height];
                    let mut depths = vec![7.0; width * height];
                    let out = (&mut faces[..], &mut depths[..]);
                    cast_window(level, &scene, &window, &mut Scratch::default(), out, width);
                    (faces, depths)
                })
                .collect();

            assert!(images.iter().all(|image| *image == images[0]));
            assert!(images[0].0.iter().any(|&face| face != NO_FACE));
        }
    }
}
