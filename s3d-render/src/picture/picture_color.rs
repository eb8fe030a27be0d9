//! Makes the RGB image from pictures: where the mesh is seen, the colours of a cube map.
//!
//! As in [`crate::shade::color`], eight pixels are handled together, and [`crate::shade::filter`] filters
//! their footprints. A face of the cube is a texture whose coordinates are ratios of linear functions of the
//! ray's direction. These directions have unit length or unit depth, so that `f32` suffices without an
//! anchor: in a face of 4,096 pixels, the error is less than a 500th of a pixel.

use crate::hits::{Hits, NO_FACE};
use crate::picture::cube_map::{AXES, CubeMap, FaceAxes};
use crate::scene::Scene;
use crate::shade::anchor::Interpolated;
use crate::shade::channels::{assert_size, fit};
use crate::shade::color::rgb_of_faces_into;
use crate::shade::filter::{Footprints, MipLevels};
use crate::shade::mip_maps::{MipMaps, TextureFilter};
use crate::simd::shade_lanes::{LANES, ShadeLanes, eight};
use crate::simd::{Kernel, Simd, dispatch};
use glam::{DMat3, DVec2, DVec3};
use s3d_geom::{Camera, Raster, Rays};
use s3d_simd::level;
use std::f64::consts::{PI, TAU};

/// The colour of a pixel that sees the mesh where no picture shows it.
#[derive(Clone, Copy, Debug)]
pub enum Unseen<'a> {
    /// The mesh's own colour.
    Mesh(&'a Scene<'a>, &'a MipMaps),
    /// The colours of the pictures around the hole, blurred into it.
    Nearby,
}

/// Returns the colours of the pixels that see the mesh, from pictures. A pixel is black if and only if it
/// sees no mesh: a dark pixel is at least (1, 1, 1). The camera must stand where the cube map was made, or
/// parallax shows.
///
/// # Panics
/// If the hits are not of the camera's size, or `mip_maps` are another mesh's.
pub fn picture_image(
    cube: &CubeMap,
    unseen: Unseen<'_>,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
) -> Raster<[u8; 3]> {
    let mut out = Raster::filled(hits.face.width(), hits.face.height(), [0; 3]);
    picture_image_into(cube, unseen, hits, camera, filter, &mut out);
    out
}

/// Writes the image of [`picture_image`] into an existing image.
///
/// # Panics
/// As for [`picture_image`].
pub fn picture_image_into(
    cube: &CubeMap,
    unseen: Unseen<'_>,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
    out: &mut Raster<[u8; 3]>,
) {
    assert_size(hits, camera);
    fit(out, &hits.face, [0; 3]);

    let Unseen::Mesh(scene, mip_maps) = unseen else {
        dispatch(PictureKernel { cube, hits, camera, filter, out, shown: None });
        return;
    };

    if !cube.has_holes() {
        dispatch(PictureKernel { cube, hits, camera, filter, out, shown: None });
        return;
    }

    let mut shown = Raster::filled(out.width(), out.height(), 255u8);
    dispatch(PictureKernel { cube, hits, camera, filter, out, shown: Some(&mut shown) });
    if shown.pixels().iter().all(|&s| s == 255) {
        return;
    }

    // Colour the mesh where it shows through the holes.
    let mut face = hits.face.clone();
    for (face, _) in face
        .pixels_mut()
        .iter_mut()
        .zip(shown.pixels())
        .filter(|(_, shown)| **shown == 255)
    {
        *face = NO_FACE;
    }

    let mut mesh = Raster::filled(0, 0, [0; 3]);
    rgb_of_faces_into(level(), scene, mip_maps, &face, camera, filter, &mut mesh);
    for ((pixel, &mesh), &shown) in out.pixels_mut().iter_mut().zip(mesh.pixels()).zip(shown.pixels()) {
        if shown < 255 {
            *pixel = mixed(*pixel, mesh, shown);
        }
    }
}

/// Mixes `shown` 255ths of `picture` with the rest of `mesh`. The result is not black unless both are.
fn mixed(picture: [u8; 3], mesh: [u8; 3], shown: u8) -> [u8; 3] {
    let shown = u32::from(shown);
    let color: [u8; 3] = std::array::from_fn(|k| {
        ((u32::from(picture[k]) * shown + u32::from(mesh[k]) * (255 - shown) + 127) / 255) as u8
    });
    if color == [0; 3] && (picture, mesh) != ([0; 3], [0; 3]) {
        [1; 3]
    } else {
        color
    }
}

struct PictureKernel<'a> {
    cube: &'a CubeMap,
    hits: &'a Hits,
    camera: &'a Camera,
    filter: &'a TextureFilter,
    out: &'a mut Raster<[u8; 3]>,
    /// How much of each pixel a picture shows, if that is wanted.
    shown: Option<&'a mut Raster<u8>>,
}

impl Kernel for PictureKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let lanes = simd.shade();
        let grid = CubeRays::new(self.cube, self.camera);
        if grid.is_panorama {
            self.image::<true>(lanes, &grid);
        } else {
            self.image::<false>(lanes, &grid);
        }
    }
}

/// The directions of an image's pixels in the cube's frame, as a part by column and a part by row. In a
/// panorama, the column's part is multiplied by a factor of the row first; then the row's part is added.
struct CubeRays {
    /// By axis and column, with room for two more groups.
    columns: [Vec<f32>; 3],
    /// The change of `columns` from column to column.
    slopes: [Vec<f32>; 3],
    rows: Vec<RowFactors>,
    /// Whether the image is a panorama.
    is_panorama: bool,
}

#[derive(Clone, Copy)]
struct RowFactors {
    /// The factor of the columns and the vector that is added; the factor is 1 in a perspective view.
    scale: f32,
    add: [f32; 3],
    /// The same for the change from row to row.
    slope_scale: f32,
    slope_add: [f32; 3],
}

fn narrow(v: DVec3) -> [f32; 3] {
    v.to_array().map(|c| c as f32)
}

impl CubeRays {
    fn new(cube: &CubeMap, camera: &Camera) -> Self {
        let turn = cube.frame_from_world();
        let size = [camera.width, camera.height];
        match camera.rays() {
            Rays::Perspective { x_step, y_step, origin } => {
                Self::of_view(size, turn * x_step, turn * y_step, turn * origin)
            }
            Rays::Equirectangular { columns, rows } => Self::of_panorama(size, turn, &columns, &rows),
        }
    }

    /// Returns the directions of a perspective view, from the steps and the origin in the cube's frame.
    fn of_view([width, height]: [u32; 2], x_step: DVec3, y_step: DVec3, origin: DVec3) -> Self {
        Self {
            columns: by_axis(width, |i| x_step * (f64::from(i) + 0.5)),
            slopes: by_axis(width, |_| x_step),
            rows: (0..height)
                .map(|j| RowFactors {
                    scale: 1.0,
                    add: narrow(origin + y_step * (f64::from(j) + 0.5)),
                    slope_scale: 0.0,
                    slope_add: narrow(y_step),
                })
                .collect(),
            is_panorama: false,
        }
    }

    /// Returns the directions of a panorama, from the unit vectors of its columns and rows in the world.
    fn of_panorama([width, height]: [u32; 2], turn: DMat3, columns: &[DVec2], rows: &[DVec2]) -> Self {
        let up = turn * DVec3::Z;
        let right = TAU / f64::from(width);
        let down = PI / f64::from(height);

        // Longitude grows to the right and azimuth to the left; latitude falls.
        Self {
            columns: by_axis(width, |i| turn * columns[i as usize].extend(0.0)),
            slopes: by_axis(width, |i| {
                let c = columns[i as usize];
                turn * DVec3::new(c.y, -c.x, 0.0) * right
            }),
            rows: (0..height)
                .map(|j| {
                    let r = rows[j as usize];
                    RowFactors {
                        scale: r.x as f32,
                        add: narrow(up * r.y),
                        slope_scale: (r.y * down) as f32,
                        slope_add: narrow(up * (-r.x * down)),
                    }
                })
                .collect(),
            is_panorama: true,
        }
    }
}

/// Returns the vectors of some columns by axis. The last column is repeated beyond the end, so that the
/// padding has a direction, too.
fn by_axis(columns: u32, vector: impl Fn(u32) -> DVec3) -> [Vec<f32>; 3] {
    let all: Vec<[f32; 3]> = (0..columns).map(|i| narrow(vector(i))).collect();
    std::array::from_fn(|k| {
        let last = all.last().map_or(0.0, |c| c[k]);
        all.iter()
            .map(|c| c[k])
            .chain(std::iter::repeat_n(last, 2 * LANES))
            .collect()
    })
}

impl PictureKernel<'_> {
    #[inline(always)]
    fn image<const PANORAMA: bool>(self, l: impl ShadeLanes, grid: &CubeRays) {
        let Self { cube, hits, filter, out, mut shown, .. } = self;
        let width = hits.face.width() as usize;
        let levels = cube.levels();
        let mut painter = PicturePainter {
            lanes: l,
            cube,
            levels: &levels,
            max_taps: filter.max_taps,
            place: cube.pixels_of_place(),
            footprints: Footprints::new(2 * LANES),
            colors: vec![[0; 3]; width + 2 * LANES],
            shown: vec![255; width + 2 * LANES],
            wants_shown: shown.is_some(),
        };

        for (j, faces) in hits.face.rows().enumerate() {
            painter.shown.fill(255);
            painter.row::<PANORAMA>(grid, j, faces);
            let from = j * width;
            let to = &mut out.pixels_mut()[from..from + width];
            to.copy_from_slice(&painter.colors[..width]);
            if let Some(shown) = &mut shown {
                shown.pixels_mut()[from..from + width].copy_from_slice(&painter.shown[..width]);
            }
            if faces.contains(&NO_FACE) {
                for (pixel, _) in to.iter_mut().zip(faces).filter(|(_, face)| **face == NO_FACE) {
                    *pixel = [0; 3];
                }
            }
        }
    }
}

/// Splits a direction of the cube's frame along a face's right, down and forward.
#[inline(always)]
fn on_face<L: ShadeLanes>(l: L, face: usize, v: &[L::F; 3]) -> [L::F; 3] {
    let FaceAxes { right, down, forward } = AXES[face];
    let mut out = *v;
    for (to, (axis, sign)) in out.iter_mut().zip([right, down, forward]) {
        *to = if sign < 0 {
            l.sub(l.splat(0.0), v[axis])
        } else {
            v[axis]
        };
    }
    out
}

struct PicturePainter<'a, L> {
    lanes: L,
    cube: &'a CubeMap,
    levels: &'a [MipLevels<'a>; 6],
    max_taps: u32,
    /// The offset and the factor from places on a face's plane to pixels: the offset is added first.
    place: (f64, f64),
    /// The footprints of one group.
    footprints: Footprints,
    colors: Vec<[u8; 3]>,
    shown: Vec<u8>,
    wants_shown: bool,
}

impl<L: ShadeLanes> PicturePainter<'_, L> {
    /// Colours a row.
    #[inline(always)]
    fn row<const PANORAMA: bool>(&mut self, grid: &CubeRays, j: usize, faces: &[u32]) {
        let l = self.lanes;
        let row = grid.rows[j];
        let (scale, slope_scale) = (l.splat(row.scale), l.splat(row.slope_scale));

        for i in (0..faces.len()).step_by(LANES) {
            let group = &faces[i..faces.len().min(i + LANES)];
            if group.iter().all(|&face| face == NO_FACE) {
                continue;
            }

            let mut direction = [l.splat(0.0); 3];
            let (mut along, mut down) = (direction, direction);
            for k in 0..3 {
                let column = eight(l, &grid.columns[k], i);
                let slope = eight(l, &grid.slopes[k], i);
                let (add, slope_add) = (l.splat(row.add[k]), l.splat(row.slope_add[k]));
                if PANORAMA {
                    direction[k] = l.add(l.mul(column, scale), add);
                    along[k] = l.mul(slope, scale);
                    down[k] = l.add(l.mul(column, slope_scale), slope_add);
                } else {
                    direction[k] = l.add(column, add);
                    along[k] = slope;
                    down[k] = slope_add;
                }
            }
            self.group(i, group.len(), &direction, &along, &down);
        }
    }

    /// Colours the pixels from `i` on. The first `some` of them are in the image.
    #[inline(always)]
    fn group(&mut self, i: usize, some: usize, direction: &[L::F; 3], along: &[L::F; 3], down: &[L::F; 3]) {
        let l = self.lanes;
        let zero = l.splat(0.0);
        let [mut x, mut y, mut z] = *direction;
        for c in [&mut x, &mut y, &mut z] {
            *c = l.max(*c, l.sub(zero, *c));
        }
        // The earlier axis wins a tie, as in `face_of`.
        let is_x = !(l.greater(y, x) | l.greater(z, x)) & 0xFF;
        let is_y = !is_x & !l.greater(z, y) & 0xFF;
        let is_z = !is_x & !is_y & 0xFF;

        let mut left = 0xFFu32;
        while left != 0 {
            let lane = 1 << left.trailing_zeros();
            let (axis, whole) = if is_x & lane != 0 {
                (0, is_x)
            } else if is_y & lane != 0 {
                (1, is_y)
            } else {
                (2, is_z)
            };

            let negative = l.greater(zero, direction[axis]);
            let (face, these) = if negative & lane != 0 {
                ([3, 0, 2][axis], whole & negative)
            } else {
                ([1, 5, 4][axis], whole & !negative)
            };
            let on_face = [on_face(l, face, direction), on_face(l, face, along), on_face(l, face, down)];
            self.face(face, i, some, these, &on_face);
            left &= !these;
        }
    }

    /// Colours the pixels of a group that are in `these`; all of them look through one face. `directions` and
    /// their changes to the next column and row are in the face's axes.
    #[inline(always)]
    fn face(&mut self, face: usize, i: usize, some: usize, these: u32, directions: &[[L::F; 3]; 3]) {
        let l = self.lanes;
        let [[right, down, forward], along, below] = *directions;
        let inverse = l.div(l.splat(1.0), forward);
        let place = [l.mul(right, inverse), l.mul(down, inverse)];
        let (offset, scale) = (l.splat(self.place.0 as f32), l.splat(self.place.1 as f32));
        let per_step = l.mul(inverse, scale);

        // (u / m)' = (u' − u / m · m') / m
        let (mut values, mut x, mut y) = (place, place, place);
        for k in 0..2 {
            values[k] = l.mul(l.add(place[k], offset), scale);
            x[k] = l.mul(l.sub(along[k], l.mul(place[k], along[2])), per_step);
            y[k] = l.mul(l.sub(below[k], l.mul(place[k], below[2])), per_step);
        }

        let seen = Interpolated { values, x, y, doubtful: 0 };
        let levels = &self.levels[face];
        self.footprints.store(l, 0, &seen, false);
        let colors = levels.colors(l, &self.footprints, 0, (these, these), self.max_taps);

        let to = self.colors[i..].as_flattened_mut().first_chunk_mut();
        if let (0xFF, Some(to)) = (these, to) {
            l.store_pixels(&colors, to);
        } else {
            for (k, color) in colors.iter().enumerate() {
                if these >> k & 1 == 1 {
                    let [r, g, b, _] = color.to_le_bytes();
                    self.colors[i + k] = [r, g, b];
                }
            }
        }

        if self.wants_shown && self.cube.has_holes_in(face) {
            let [mut x, mut y] = [[0.0; LANES]; 2];
            l.store(values[0], &mut x);
            l.store(values[1], &mut y);
            for k in 0..some {
                if these >> k & 1 == 1 {
                    self.shown[i + k] = self.cube.seen_at(face, x[k], y[k]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::visibility::cast;
    use crate::shade::color::rgb_image;
    use crate::simd::dispatch_on;
    use glam::dvec3;
    use s3d_geom::{Pose, TriMesh};
    use s3d_simd::ProvenLevel;
    use s3d_synth::scenes::furnished_room;

    fn pose() -> Pose {
        Pose::from_scanner(
            dvec3(2.2, 2.0, 1.4),
            glam::DQuat::from_rotation_z(0.7) * glam::DQuat::from_rotation_x(0.02),
        )
    }

    /// Returns a cube map of noise; if `hole`, with a hole below.
    fn noise(hole: bool) -> CubeMap {
        CubeMap::build(pose(), 256, |face, x, y, d| {
            let mut h = (face as u32 * 7919 + x * 104_729 + y * 1_299_709).wrapping_mul(0x9E37_79B1);
            h ^= h >> 15;
            let rough = h.wrapping_mul(0x85EB_CA77).to_le_bytes().map(f32::from);
            (!hole || d.y < 0.6 * d.length()).then_some([rough[0], rough[1] * 0.2, 0.0])
        })
    }

    fn cameras() -> [Camera; 6] {
        [
            Camera::perspective(pose().turned(0.3, -0.4), 1.2, 301, 203),
            Camera::perspective(pose().turned(2.0, -0.6), 0.2, 67, 65),
            // Much smaller than the cube map.
            Camera::perspective(pose().turned(-0.8, 0.2), 2.4, 37, 31),
            Camera::pinhole(pose(), glam::dvec2(90.0, 140.0), glam::dvec2(-9.0, 71.5), 130, 99).unwrap(),
            Camera::equirectangular(pose(), 256),
            Camera::equirectangular(pose(), 2048),
        ]
    }

    /// Returns a room without its ceiling.
    fn open_room() -> TriMesh {
        let mut parts = furnished_room(3).into_parts();
        let is_low = parts.positions.iter().map(|p| p.z <= 2.4).collect::<Vec<_>>();
        let keep: Vec<bool> = parts
            .faces
            .iter()
            .map(|f| f.iter().any(|&v| is_low[v as usize]))
            .collect();
        let mut next = keep.iter();
        parts.faces.retain(|_| *next.next().unwrap());
        for faces in [&mut parts.face_uvs, &mut parts.face_normals] {
            let mut next = keep.iter();
            faces.retain(|_| *next.next().unwrap());
        }
        let mut next = keep.iter();
        parts.face_materials.retain(|_| *next.next().unwrap());
        TriMesh::new(parts).unwrap()
    }

    #[test]
    fn pixels_are_samples_of_the_cube_map_where_there_is_mesh() {
        let mesh = open_room();
        let scene = Scene::new(&mesh);
        let cube = noise(false);
        let filter = TextureFilter::default();
        for camera in cameras() {
            let hits = cast(&scene, &camera);
            let image = picture_image(&cube, Unseen::Nearby, &hits, &camera, &filter);
            let mut far = 0;
            let mut seen = 0;
            for (x, y) in (0..camera.width * camera.height).map(|k| (k % camera.width, k / camera.width)) {
                let fx = f64::from(x) + 0.5;
                let fy = f64::from(y) + 0.5;
                let pixel = image.at(x, y);
                if hits.face.at(x, y) == NO_FACE {
                    assert_eq!(pixel, [0; 3]);
                    continue;
                }

                let around = |dx: f64, dy: f64| camera.direction(fx + dx, fy + dy);
                let (along, down) =
                    (around(0.5, 0.0) - around(-0.5, 0.0), around(0.0, 0.5) - around(0.0, -0.5));
                let (color, _) = cube.sample(around(0.0, 0.0), along, down, &filter);
                assert_ne!(pixel, [0; 3]);
                seen += 1;
                far += usize::from((0..3).any(|k| (f32::from(pixel[k]) - color[k]).abs() > 1.6));
            }
            // Pixels differ where rounding decides how many samples there are, or to which face a pixel at a
            // seam belongs.
            assert!(seen > 500 && far * 200 <= seen, "{far} of {seen} in {camera:?}");
        }
    }

    fn pixels_of_rows(from: u32, to: u32) -> std::ops::Range<usize> {
        from as usize * 256..to as usize * 256
    }

    #[test]
    fn holes_show_the_mesh_or_what_is_around() {
        let mesh = furnished_room(3);
        let scene = Scene::new(&mesh);
        let mip_maps = MipMaps::new(&mesh);
        let camera = Camera::equirectangular(pose(), 256);
        let hits = cast(&scene, &camera);
        let filter = TextureFilter::default();
        let cube = noise(true);
        let mesh_image = rgb_image(&scene, &mip_maps, &hits, &camera);
        let nearby = picture_image(&cube, Unseen::Nearby, &hits, &camera, &filter);
        let image = picture_image(&cube, Unseen::Mesh(&scene, &mip_maps), &hits, &camera, &filter);
        assert_eq!(image.pixels()[pixels_of_rows(0, 80)], nearby.pixels()[pixels_of_rows(0, 80)]);
        assert_eq!(image.pixels()[pixels_of_rows(105, 128)], mesh_image.pixels()[pixels_of_rows(105, 128)]);
        assert!(
            nearby.pixels()[pixels_of_rows(105, 128)]
                .iter()
                .all(|p| p[2] <= 1 && p[0] > 20),
            "filled from the noise"
        );
    }

    #[test]
    fn every_level_of_instructions_gives_the_same_bytes() {
        let mesh = open_room();
        let scene = Scene::new(&mesh);
        let cube = noise(true);
        let filter = TextureFilter::default();
        for camera in cameras() {
            let hits = cast(&scene, &camera);
            let images = ProvenLevel::all().into_iter().map(|level| {
                let mut out = Raster::filled(camera.width, camera.height, [0; 3]);
                let mut shown = Raster::filled(camera.width, camera.height, 0);
                let cube = &cube;
                let hits = &hits;
                let filter = &filter;
                let shown_out = Some(&mut shown);
                let kernel =
                    PictureKernel { cube, hits, camera: &camera, filter, out: &mut out, shown: shown_out };
                dispatch_on(level, kernel);
                (out, shown)
            });
            let images: Vec<_> = images.collect();
            assert!(images.iter().all(|image| *image == images[0]));
        }
    }
}
