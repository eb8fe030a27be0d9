//! Keypoints of surfaces.

use super::plane::Plane;
use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, fit};
use crate::shade::patch::FaceCache;
use glam::Vec3;
use s3d_geom::{Camera, Projection, Raster};

/// The radius of the sphere around a point in which normals count, metres.
const RADIUS_M: f32 = 0.15;
/// The pixels along the side of a block that has one value.
const BLOCK: usize = 4;
/// The samples on each side of a block, along rows and columns.
const REACH: i32 = 2;
/// The samples along a side.
const SIDE: usize = 2 * REACH as usize + 1;

/// Writes how much a surface is a corner into an existing image: 255 · √(27 det C), rounded. C is the mean
/// of n nᵀ over the unit normals n of the surface that is seen within 0.15 m of the pixel's point. Its
/// determinant is 0 on planes and at straight edges, and 1/27 where normals point in all directions alike. 0
/// where nothing is seen.
///
/// 5 × 5 samples of the image are spread over the sphere, at least four pixels apart. A block of 4 × 4
/// pixels has one value, of the pixel at its middle.
///
/// The measure is Noble's ("Finding Corners", Image and Vision Computing 6(2), 1988) of normals, as in
/// `HarrisKeypoint3D` of the Point Cloud Library. The radius is half the support size for rooms of the
/// annotator of Omnidata, which takes the interest of NARF. That depends on borders of the image of depth,
/// which the occlusion edges of this crate have on their own.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn corner_image_into(scene: &Scene<'_>, hits: &Hits, camera: &Camera, out: &mut Raster<u8>) {
    assert_size(hits, camera);
    fit(out, &hits.face, 0);
    let width = hits.face.width() as usize;
    let samples = Samples::new(scene, hits, camera);
    // The pixels that a metre at a distance of a metre covers.
    let pixels_per_m = match camera.projection {
        Projection::Equirectangular => camera.width as f32 / std::f32::consts::TAU,
        _ => camera.k_matrix()[0][0].max(camera.k_matrix()[1][1]) as f32,
    };

    for (block_row, rows) in out.pixels_mut().chunks_mut(BLOCK * width.max(1)).enumerate() {
        let (row, copies) = rows.split_at_mut(width);
        for (column, pixels) in row.chunks_mut(BLOCK).enumerate() {
            let interest = samples.interest(column as i32, block_row as i32, pixels_per_m);
            pixels.fill((255.0 * interest + 0.5).min(255.0) as u8);
        }
        copies
            .chunks_mut(width.max(1))
            .for_each(|copy| copy.copy_from_slice(row));
    }

    for (out, face) in out.pixels_mut().iter_mut().zip(hits.face.pixels()) {
        *out = if *face == NO_FACE { 0 } else { *out };
    }
}

/// A sample: a point relative to the camera, and the normal of its face. The depth of a sample that sees
/// nothing is infinite.
#[derive(Clone, Copy)]
struct Sample {
    point: Vec3,
    normal: Vec3,
    depth: f32,
}

/// A sample for each block.
struct Samples {
    columns: i32,
    rows: i32,
    samples: Vec<Sample>,
    wraps: bool,
}

impl Samples {
    fn new(scene: &Scene<'_>, hits: &Hits, camera: &Camera) -> Self {
        let (width, height) = (hits.face.width(), hits.face.height());
        let block = BLOCK as u32;
        let (columns, rows) = (width.div_ceil(block), height.div_ceil(block));
        let rays = camera.rays();
        let eye = camera.pose.location;
        let mut normals = FaceCache::new();
        let mut samples = Vec::with_capacity(columns as usize * rows as usize);
        for row in 0..rows {
            let y = (row * block + block / 2).min(height - 1);
            for column in 0..columns {
                let x = (column * block + block / 2).min(width - 1);
                let (face, depth) = (hits.face.at(x, y), hits.depth.at(x, y));
                samples.push(if face == NO_FACE {
                    Sample { point: Vec3::ZERO, normal: Vec3::ZERO, depth: f32::INFINITY }
                } else {
                    let ray = rays.at(x, y);
                    let normal = *normals.get(face, || Plane::new(scene.mesh(), face, eye).normal.as_vec3());
                    let normal = if normal.dot(ray.as_vec3()) > 0.0 {
                        -normal
                    } else {
                        normal
                    };
                    Sample { point: (ray * f64::from(depth)).as_vec3(), normal, depth }
                });
            }
        }
        Self { columns: columns as i32, rows: rows as i32, samples, wraps: camera.is_panorama() }
    }

    /// Returns the column of a sample. Columns beyond a border are the one at it.
    fn column(&self, column: i32) -> usize {
        if self.wraps {
            column.rem_euclid(self.columns) as usize
        } else {
            column.clamp(0, self.columns - 1) as usize
        }
    }

    /// Returns the first sample of a row, likewise.
    fn row(&self, row: i32) -> usize {
        (row.clamp(0, self.rows - 1) * self.columns) as usize
    }

    /// Returns how much the surface at a block is a corner, 0 to 1.
    fn interest(&self, column: i32, row: i32, pixels_per_m: f32) -> f32 {
        let middle = self.samples[self.row(row) + self.column(column)];
        if middle.depth == f32::INFINITY {
            return 0.0;
        }
        let blocks = RADIUS_M * pixels_per_m / (middle.depth * BLOCK as f32);
        let step = ((blocks / REACH as f32 + 0.5) as i32).max(1);

        let columns: [usize; SIDE] = std::array::from_fn(|n| self.column(column + (n as i32 - REACH) * step));

        // The sum of n nᵀ: xx, yy, zz, xy, xz, yz.
        let mut sums = [0f32; 6];
        let mut count = 0f32;
        let mut is_plane = true;
        for dy in -REACH..=REACH {
            let start = self.row(row + dy * step);
            for column in columns {
                let sample = &self.samples[start + column];
                if (sample.point - middle.point).length_squared() > RADIUS_M * RADIUS_M {
                    continue;
                }
                let Vec3 { x, y, z } = sample.normal;
                is_plane &= sample.normal == middle.normal;
                let [xx, yy, zz, xy, xz, yz] = &mut sums;
                (*xx, *yy, *zz) = (*xx + x * x, *yy + y * y, *zz + z * z);
                (*xy, *xz, *yz) = (*xy + x * y, *xz + x * z, *yz + y * z);
                count += 1.0;
            }
        }
        if is_plane {
            return 0.0;
        }

        let [xx, yy, zz, xy, xz, yz] = sums.map(|sum| sum / count);
        let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
        (27.0 * determinant.max(0.0)).sqrt()
    }
}
