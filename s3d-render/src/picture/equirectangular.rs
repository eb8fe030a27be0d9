//! Makes cube maps from equirectangular photographs, eight pixels of a row at a time.
//!
//! Longitudes and latitudes are arc tangents in `f32` with an error below 5e-7: less than a 1000th of a pixel
//! in a photograph of 8,192 columns. Near the poles, where a pixel sees many columns, pixels are made one by
//! one in `f64` by [`Photograph::color`].

use crate::picture::cube_map::{Band, CubeMap, axes_of, direction_of, place_of, stored_width};
use crate::picture::cube_sources::SourceMipMap;
use crate::shade::anchor::Interpolated;
use crate::shade::filter::{Footprints, MipLevels};
use crate::shade::mip_maps::TextureFilter;
use crate::simd::shade_lanes::{LANES, ShadeLanes, eight, packed};
use crate::simd::{Kernel, Simd, dispatch_on};
use glam::{DMat3, DVec3, dvec2};
use s3d_geom::{Pose, Raster, Wrap};
use s3d_simd::{ProvenLevel, level};
use std::f64::consts::{PI, TAU};

/// Near the poles a pixel sees many columns of a photograph and few rows, so it takes as many samples as keep
/// the rows apart.
pub(crate) const AT_POLES: TextureFilter = TextureFilter { max_taps: 256 };

/// The most columns that a pixel may see if eight pixels are made together. More samples would darken them,
/// since the weights of the fast filter are rounded down.
const FEW_COLUMNS: u32 = 16;

impl CubeMap {
    /// Makes a cube map from an equirectangular photograph. Its columns are longitudes that grow to the
    /// right, its rows are latitudes from +90° at the top to −90°, and it is upright in the world (+Z
    /// up). Its centre column looks along the forward axis of `pose` projected to the horizon, turned by
    /// `yaw_rad` to the left; The panoramas of `s3d_io::formats` have 0. The faces have `size` pixels, or as
    /// many as keep the detail of the photograph.
    ///
    /// # Panics
    /// If the photograph has no pixels.
    pub fn from_equirectangular(
        photo: &Raster<[u8; 3]>,
        yaw_rad: f64,
        pose: &Pose,
        size: Option<u32>,
    ) -> Self {
        let (sin, cos) = libm::sincos(pose.azimuth_rad() + yaw_rad);
        let heading = DMat3::from_cols_array(&[cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0]);
        Self::from_sphere(photo.clone(), heading, pose, size)
    }

    /// Makes a cube map around `pose` from a photograph of all directions. `photo_from_world` turns the
    /// world into the axes of the photograph: its centre column looks along +X, and its first row along +Z.
    /// The photograph is taken to be from the place of `pose`.
    pub(crate) fn from_sphere(
        photo: Raster<[u8; 3]>,
        photo_from_world: DMat3,
        pose: &Pose,
        size: Option<u32>,
    ) -> Self {
        assert!(!photo.is_empty(), "a photograph has pixels");
        let size = Self::fitting_size(size.map_or(f64::from(photo.width()) * (1.25 / PI), f64::from));
        let photo = Photograph::new(photo, photo_from_world, pose, size);
        let levels = photo.mip_map.levels();
        if levels.is_usable() {
            photo.in_lanes(&levels, level())
        } else {
            photo.pixel_by_pixel()
        }
    }
}

/// A photograph that becomes a cube map.
struct Photograph {
    mip_map: SourceMipMap,
    /// The numbers of columns and rows.
    size: [f64; 2],
    pose: Pose,
    /// Turns the cube's frame into the axes of the photograph: its centre column looks along +X, and +Z is
    /// up.
    turn: DMat3,
    /// The size of the cube's faces.
    face_size: u32,
}

impl Photograph {
    fn new(photo: Raster<[u8; 3]>, photo_from_world: DMat3, pose: &Pose, face_size: u32) -> Self {
        Self {
            size: [f64::from(photo.width()), f64::from(photo.height())],
            mip_map: SourceMipMap::new(photo, [Wrap::Repeat, Wrap::Clamp]),
            pose: *pose,
            turn: photo_from_world * pose.opencv_from_world().transpose(),
            face_size,
        }
    }

    /// Returns the colour over a pixel in a direction of the cube's frame; the direction has a depth of 1 on
    /// its face.
    fn color(&self, d: DVec3) -> [f32; 3] {
        // A pixel at the depth 1 and the distance r is seen under the angle 2/size · 1/r, in one direction
        // even 1/r².
        let angle = 2.0 / f64::from(self.face_size);
        let v = self.turn * d;
        let [w, h] = self.size;
        let flat = libm::hypot(v.x, v.y);
        let place = dvec2(0.5 - libm::atan2(v.y, v.x) / TAU, 0.5 - libm::atan2(v.z, flat) / PI);
        // A circle of latitude shortens towards the pole, so that a pixel sees many columns there.
        let around = (angle / flat).min(TAU) / TAU * w;
        let along = angle / d.length() / PI * h;
        self.mip_map
            .sample(place * dvec2(w, h), dvec2(around, 0.0), dvec2(0.0, along), &AT_POLES)
    }

    /// Makes the cube map one pixel after another: for photographs that are too large for the numbers of the
    /// lanes, and as the reference in tests.
    fn pixel_by_pixel(&self) -> CubeMap {
        CubeMap::build(self.pose, self.face_size, |_, _, _, d| Some(self.color(d)))
    }

    fn in_lanes(&self, levels: &MipLevels<'_>, level: ProvenLevel) -> CubeMap {
        let width = stored_width(self.face_size);
        let places: Vec<f32> = (0..width + LANES as u32)
            .map(|i| place_of(self.face_size, i) as f32)
            .collect();
        CubeMap::build_bands(self.pose, self.face_size, |band| {
            dispatch_on(level, PhotographKernel { photo: self, levels, places: &places, band });
        })
    }
}

struct PhotographKernel<'a> {
    photo: &'a Photograph,
    levels: &'a MipLevels<'a>,
    /// The position of each column on a face's plane, and eight more.
    places: &'a [f32],
    band: Band<'a>,
}

impl Kernel for PhotographKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let l = simd.shade();
        let Self { photo, levels, places, mut band } = self;
        let face = band.face;
        let first_row = band.first_row;
        let size = photo.face_size;

        let [right, down, forward] = axes_of(face);
        let three = |v: DVec3| [l.splat(v.x as f32), l.splat(v.y as f32), l.splat(v.z as f32)];
        let per_column = three(photo.turn * right);

        let [w, h] = photo.size;
        let (columns, rows) = (l.splat(w as f32), l.splat(h as f32));
        let (per_turn, per_half) = (l.splat((w / TAU) as f32), l.splat((h / PI) as f32));
        let angle = 2.0 / f64::from(size);
        let around_per_angle = l.splat((w * angle / TAU) as f32);
        let along_per_angle = l.splat((h * angle / PI) as f32);
        let (zero, half, one) = (l.splat(0.0), l.splat(0.5), l.splat(1.0));
        let mut footprints = Footprints::new(2 * LANES);

        for (y, (row, seen)) in (first_row..).zip(band.rows()) {
            seen.fill(255);
            let place = place_of(size, y);
            let start = three(photo.turn * (forward + down * place));
            let rest = l.splat((1.0 + place * place) as f32);

            for i in (0..row.len()).step_by(LANES) {
                let place = eight(l, places, i);
                let mut v = [zero; 3];
                for k in 0..3 {
                    v[k] = l.add(l.mul(per_column[k], place), start[k]);
                }

                let flat = l.sqrt(l.add(l.mul(v[0], v[0]), l.mul(v[1], v[1])));
                let around = l.div(around_per_angle, flat);
                if l.greater(l.splat(FEW_COLUMNS as f32), around) != 0xFF {
                    for (x, pixel) in (i as u32..).zip(row[i..].iter_mut().take(LANES)) {
                        let color = photo.color(direction_of(face, size, x, y));
                        *pixel = color.map(|c| (c + 0.5) as u8);
                    }
                    continue;
                }

                let distance = l.sqrt(l.add(l.mul(place, place), rest));
                let along = l.div(along_per_angle, distance);
                let longitude = l.mul(atan2(l, v[1], v[0]), per_turn);
                let latitude = l.mul(atan2(l, v[2], flat), per_half);
                let values = [l.sub(l.mul(half, columns), longitude), l.sub(l.mul(half, rows), latitude)];
                let seen = Interpolated { values, x: [around, zero], y: [zero, along], doubtful: 0 };

                footprints.store(l, 0, &seen, false);
                // All of these pixels may have wide footprints; `wide` tells which do.
                let wide = l.greater(l.max(around, along), one);
                let sum = levels.sums(l, &footprints, 0, (0xFF, wide), FEW_COLUMNS);
                let packed = packed(l, l.channels(sum));
                if let Some(to) = row[i..].as_flattened_mut().first_chunk_mut() {
                    l.store_pixels(&packed, to);
                } else {
                    for (pixel, color) in row[i..].iter_mut().zip(packed) {
                        let [r, g, b, _] = color.to_le_bytes();
                        *pixel = [r, g, b];
                    }
                }
            }
        }
    }
}

/// Returns the angle of (x, y) from the first axis, −π to π, with an error below 5e-7; 0 for (0, 0).
#[inline(always)]
fn atan2<L: ShadeLanes>(l: L, y: L::F, x: L::F) -> L::F {
    let zero = l.splat(0.0);
    let (wide, high) = (l.max(x, l.sub(zero, x)), l.max(y, l.sub(zero, y)));
    let a = l.div(l.min(wide, high), l.max(l.max(wide, high), l.splat(f32::MIN_POSITIVE)));
    let (aa, mut p) = (l.mul(a, a), zero);
    for coefficient in s3d_geom::ARCTANGENT {
        p = l.add(l.mul(p, aa), l.splat(coefficient));
    }
    let angle = l.mul(p, a);
    let angle = l.select_by_sign(l.sub(wide, high), l.sub(l.splat(0.5 * PI as f32), angle), angle);
    let angle = l.select_by_sign(x, l.sub(l.splat(PI as f32), angle), angle);
    l.select_by_sign(y, l.sub(zero, angle), angle)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::cube_map::tests::pose;
    use crate::simd::shade_lanes::Plain;
    use proptest::prelude::*;

    /// Returns noise, turned, as two photographs; in the second case pixels of the cube see several rows.
    fn photographs() -> [Photograph; 2] {
        let pixels = (0..700 * 350).map(|k: u32| {
            let mut h = k.wrapping_mul(0x9E37_79B1);
            h ^= h >> 15;
            let [r, g, b, _] = h.wrapping_mul(0x85EB_CA77).to_le_bytes();
            [r, g / 4, b / 2 + 100]
        });
        let photo = Raster::from_vec(700, 350, pixels.collect());
        let turn = DMat3::from_rotation_z(-0.7) * DMat3::from_rotation_y(0.1);
        [288, 96].map(|size| Photograph::new(photo.clone(), turn, &pose(), size))
    }

    #[test]
    fn eight_pixels_at_a_time_give_what_single_ones_do() {
        for photo in photographs() {
            let cube = photo.in_lanes(&photo.mip_map.levels(), level());
            let plain = photo.pixel_by_pixel();
            let far = cube.texels().zip(plain.texels()).filter(|((color, seen), (plain, _))| {
                assert_eq!(*seen, 255);
                (0..3).any(|k| color[k].abs_diff(plain[k]) > 1)
            });
            // Pixels differ where rounding decides how many samples there are.
            let far = far.count();
            let all = cube.texels().count();
            assert!(far * 1_000 <= all, "{far} of {all}");
        }
    }

    #[test]
    fn every_level_of_instructions_gives_the_same_bytes() {
        for photo in photographs() {
            let levels = photo.mip_map.levels();
            let cubes = ProvenLevel::all()
                .into_iter()
                .map(|level| photo.in_lanes(&levels, level));
            let texels: Vec<Vec<_>> = cubes.map(|cube| cube.texels().collect()).collect();
            assert!(texels.iter().all(|t| *t == texels[0]));
        }
    }

    proptest! {
        #[test]
        fn arc_tangents_are_right(
            x in -2.0..2.0f32, y in -2.0..2.0f32, small in prop::array::uniform2(0..30),
        ) {
            let x = x * 0.5f32.powi(small[0]);
            let y = y * 0.5f32.powi(small[1]);
            for (x, y) in [(x, y), (x, x), (x, 0.0), (0.0, y)] {
                let got = atan2(Plain, [y; LANES], [x; LANES])[0];
                let expected = libm::atan2(f64::from(y), f64::from(x));
                prop_assert!((f64::from(got) - expected).abs() < 5e-7, "{x} {y}: {got} {expected}");
            }
        }
    }
}
