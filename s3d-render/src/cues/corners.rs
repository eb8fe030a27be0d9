//! Keypoints of surfaces.

use super::plane::Plane;
use crate::hits::{Hits, NO_FACE};
use crate::scene::Scene;
use crate::shade::channels::{assert_size, fit};
use crate::shade::patch::FaceCache;
use glam::Vec3;
use s3d_geom::{Camera, Projection, Raster};
use s3d_simd::{dispatch, level};

/// The radius of the sphere around a point in which normals count, metres.
const RADIUS_M: f32 = 0.15;
/// The pixels along the side of a block that has one value.
const BLOCK: usize = 4;
/// The samples on each side of a block, along rows and columns.
const REACH: i32 = 2;

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
    // The pixels that a metre at a distance of a metre covers.
    let pixels_per_m = match camera.projection {
        Projection::Equirectangular => camera.width as f32 / std::f32::consts::TAU,
        _ => camera.k_matrix()[0][0].max(camera.k_matrix()[1][1]) as f32,
    };

    let samples = Samples::new(scene, hits, camera, pixels_per_m);
    let mut levels = vec![0u8; samples.columns];
    for (block_row, rows) in out.pixels_mut().chunks_mut(BLOCK * width.max(1)).enumerate() {
        dispatch!(level(), _simd => samples.row_levels(block_row, pixels_per_m, &mut levels));
        let (row, copies) = rows.split_at_mut(width);
        for (pixels, level) in row.chunks_mut(BLOCK).zip(&levels) {
            pixels.fill(*level);
        }
        copies
            .chunks_mut(width.max(1))
            .for_each(|copy| copy.copy_from_slice(row));
    }

    dispatch!(level(), _simd => {
        for (out, face) in out.pixels_mut().iter_mut().zip(hits.face.pixels()) {
            *out = if *face == NO_FACE { 0 } else { *out };
        }
    });
}

/// A sample for each block, by column: the point relative to the camera, the normal of its face, and its
/// depth, which is infinite where nothing is seen. Each row of points and normals has a margin on both sides:
/// samples of the other side of a panorama, and repeated ones elsewhere.
struct Samples {
    columns: usize,
    rows: usize,
    points: [Vec<f32>; 3],
    normals: [Vec<f32>; 3],
    depths: Vec<f32>,
    margin: usize,
    wraps: bool,
}

/// The blocks that are looked at together, at most. Sums are made for so many in any case.
const TOGETHER: usize = 16;
/// The samples of a margin, at most.
const MOST_MARGIN: i32 = 256;

/// What the samples around some blocks add up to.
struct Sums {
    /// The sums of n nᵀ: xx, yy, zz, xy, xz, yz.
    squares: [[f32; TOGETHER]; 6],
    counts: [f32; TOGETHER],
    /// Whether a normal differs from that of the middle.
    bends: [u32; TOGETHER],
}

impl Samples {
    fn new(scene: &Scene<'_>, hits: &Hits, camera: &Camera, pixels_per_m: f32) -> Self {
        let (width, height) = (hits.face.width(), hits.face.height());
        let block = BLOCK as u32;
        let (columns, rows) = (width.div_ceil(block), height.div_ceil(block));
        let rays = camera.rays();
        let eye = camera.pose.location;
        let mut normal_of_face = FaceCache::new();
        let wraps = camera.is_panorama();
        let (mut points, mut normals) = <([Vec<f32>; 3], [Vec<f32>; 3])>::default();
        let mut row_values: [Vec<f32>; 6] = Default::default();
        let middle = |block_at: u32, size: u32| (block_at * block + block / 2).min(size - 1);
        let mut depths = Vec::with_capacity(columns as usize * rows as usize);
        for y in (0..rows).map(|row| middle(row, height)) {
            let row = hits.depth.row(y);
            depths.extend((0..columns).map(|column| row[middle(column, width) as usize]));
        }
        let nearest = depths.iter().fold(f32::INFINITY, |a, b| a.min(*b));
        let margin = REACH.saturating_mul(step(nearest, pixels_per_m)).min(MOST_MARGIN);

        for y in (0..rows).map(|row| middle(row, height)) {
            for x in (0..columns).map(|column| middle(column, width)) {
                let (face, depth) = (hits.face.at(x, y), hits.depth.at(x, y));
                let (point, normal) = if face == NO_FACE {
                    (Vec3::ZERO, Vec3::ZERO)
                } else {
                    let ray = rays.at(x, y);
                    let normal =
                        *normal_of_face.get(face, || Plane::new(scene.mesh(), face, eye).normal.as_vec3());
                    let faces_away = normal.dot(ray.as_vec3()) > 0.0;
                    ((ray * f64::from(depth)).as_vec3(), if faces_away { -normal } else { normal })
                };
                let values = point.to_array().into_iter().chain(normal.to_array());
                row_values.iter_mut().zip(values).for_each(|(of, value)| of.push(value));
            }

            for (of, values) in points.iter_mut().chain(&mut normals).zip(&mut row_values) {
                let beyond = |column: i32| values[column_at(column, columns as usize, wraps)];
                of.extend((-margin..0).map(beyond));
                of.extend_from_slice(values);
                of.extend((columns as i32..columns as i32 + margin).map(beyond));
                values.clear();
            }
        }
        // The last blocks are looked at with some that are not there.
        let all = points.iter_mut().chain(&mut normals);
        all.for_each(|column| column.extend([0.0; TOGETHER]));
        Self {
            columns: columns as usize,
            rows: rows as usize,
            points,
            normals,
            depths,
            margin: margin as usize,
            wraps,
        }
    }

    /// Returns where the points and normals of a row begin, behind its margin. Rows beyond a border are the
    /// one at it.
    #[inline(always)]
    fn row(&self, row: i32) -> usize {
        let row = row.clamp(0, self.rows as i32 - 1) as usize;
        row * (self.columns + 2 * self.margin) + self.margin
    }

    /// Writes the level of each block of a row. Blocks next to each other whose samples are as far apart are
    /// looked at together, so that their samples lie next to each other, too.
    #[inline(always)]
    fn row_levels(&self, row: usize, pixels_per_m: f32, levels: &mut [u8]) {
        let start = row * self.columns;
        let mut column = 0;
        while column < self.columns {
            if self.depths[start + column] == f32::INFINITY {
                levels[column] = 0;
                column += 1;
                continue;
            }
            let apart = step(self.depths[start + column], pixels_per_m);
            // Beyond the margin, samples are not next to each other.
            let most = if (REACH * apart) as usize > self.margin {
                1
            } else {
                TOGETHER.min(self.columns - column)
            };
            let mut count = 1;
            while count < most && step(self.depths[start + column + count], pixels_per_m) == apart {
                count += 1;
            }
            self.levels(row, column, apart, &mut levels[column..column + count]);
            column += count;
        }
    }

    /// Writes the levels of blocks from a column on, whose samples are `step` blocks apart.
    #[inline(always)]
    fn levels(&self, row: usize, column: usize, step: i32, levels: &mut [u8]) {
        let row = row as i32;
        let middle = self.row(row) + column;
        let mut sums = Sums { squares: [[0.0; TOGETHER]; 6], counts: [0.0; TOGETHER], bends: [0; TOGETHER] };
        for dy in -REACH..=REACH {
            let start = self.row(row + dy * step);
            for dx in -REACH..=REACH {
                let away = column as i32 + dx * step;
                let is_in_margin = (REACH * step) as usize <= self.margin;
                let sample = if is_in_margin {
                    (start as i32 + away) as usize
                } else {
                    start + column_at(away, self.columns, self.wraps)
                };
                self.add(middle, sample, &mut sums);
            }
        }

        let [xx, yy, zz, xy, xz, yz] = &sums.squares;
        let mut found = [0u8; TOGETHER];
        for (i, level) in found.iter_mut().enumerate() {
            let count = sums.counts[i];
            let (xx, yy, zz) = (xx[i] / count, yy[i] / count, zz[i] / count);
            let (xy, xz, yz) = (xy[i] / count, xz[i] / count, yz[i] / count);
            let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
            let interest = (27.0 * determinant.max(0.0)).sqrt();
            let shown = (255.0 * interest + 0.5).min(255.0) as u8;
            *level = if sums.bends[i] == 0 { 0 } else { shown };
        }
        for ((level, found), depth) in levels
            .iter_mut()
            .zip(&found)
            .zip(&self.depths[row as usize * self.columns + column..])
        {
            *level = if *depth == f32::INFINITY { 0 } else { *found };
        }
    }

    /// Adds one sample for each block, from the one at `middle` on.
    #[inline(always)]
    fn add(&self, middle: usize, sample: usize, sums: &mut Sums) {
        let ([px, py, pz], [nx, ny, nz]) = (lanes(&self.points, sample), lanes(&self.normals, sample));
        let [own_x, own_y, own_z] = lanes(&self.points, middle);
        let [own_nx, own_ny, own_nz] = lanes(&self.normals, middle);
        let [xx, yy, zz, xy, xz, yz] = &mut sums.squares;
        for i in 0..TOGETHER {
            let (dx, dy, dz) = (px[i] - own_x[i], py[i] - own_y[i], pz[i] - own_z[i]);
            let is_near = dx * dx + dy * dy + dz * dz <= RADIUS_M * RADIUS_M;
            let weight = if is_near { 1.0 } else { 0.0 };
            let (x, y, z) = (nx[i] * weight, ny[i] * weight, nz[i] * weight);
            xx[i] += x * x;
            yy[i] += y * y;
            zz[i] += z * z;
            xy[i] += x * y;
            xz[i] += x * z;
            yz[i] += y * z;
            sums.counts[i] += weight;
            let differs = (nx[i] != own_nx[i]) | (ny[i] != own_ny[i]) | (nz[i] != own_nz[i]);
            sums.bends[i] |= u32::from(is_near & differs);
        }
    }
}

/// Returns how many blocks lie between the samples around a point.
#[inline(always)]
fn step(depth: f32, pixels_per_m: f32) -> i32 {
    let blocks = RADIUS_M * pixels_per_m / (depth * BLOCK as f32);
    ((blocks / REACH as f32 + 0.5) as i32).clamp(1, 1 << 20)
}

/// Returns a column that may be beyond a border: there it is the one at it, or one from the other side.
#[inline(always)]
fn column_at(column: i32, columns: usize, wraps: bool) -> usize {
    if wraps {
        column.rem_euclid(columns as i32) as usize
    } else {
        column.clamp(0, columns as i32 - 1) as usize
    }
}

/// Returns the values of each column from `at` on.
#[inline(always)]
fn lanes(columns: &[Vec<f32>; 3], at: usize) -> [&[f32; TOGETHER]; 3] {
    let none = &[0.0; TOGETHER];
    let [x, y, z] = columns;
    [
        x[at..].first_chunk().unwrap_or(none),
        y[at..].first_chunk().unwrap_or(none),
        z[at..].first_chunk().unwrap_or(none),
    ]
}
