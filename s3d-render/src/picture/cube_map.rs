//! Cube maps: the pictures all around a place. [`CubeMap`] documents the order and the directions of the
//! faces.
//!
//! A face is stored with a border of a 32nd of its width on every side, which shows the same as its
//! neighbours there. So a face can be filtered like any texture, in every reduction down to a face of 32
//! pixels, and no seam shows.

use crate::picture::fill::fill_unseen;
use crate::shade::filter::MipLevels;
use crate::shade::mip_maps::{MipMap, TextureFilter, halved};
use glam::{DMat3, DVec2, DVec3, dvec2};
use rayon::prelude::*;
use s3d_geom::{Pose, Raster, Texture, Wrap};

/// The ratio of a face's width to its border.
const BORDERS: u32 = 32;

/// The width of the widest face.
const MAX_SIZE: u32 = 8192;

/// The axes of a face in the cube's frame, which is the original camera's in OpenCV's axes: x right, y down,
/// z forward.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FaceAxes {
    /// Each is an axis of the frame, and its sign.
    pub(crate) right: (usize, i8),
    pub(crate) down: (usize, i8),
    pub(crate) forward: (usize, i8),
}

/// The axes by number of the face.
pub(crate) const AXES: [FaceAxes; 6] = [
    FaceAxes { right: (0, 1), down: (2, 1), forward: (1, -1) },
    FaceAxes { right: (2, -1), down: (1, 1), forward: (0, 1) },
    FaceAxes { right: (0, -1), down: (1, 1), forward: (2, -1) },
    FaceAxes { right: (2, 1), down: (1, 1), forward: (0, -1) },
    FaceAxes { right: (0, 1), down: (1, 1), forward: (2, 1) },
    FaceAxes { right: (0, 1), down: (2, -1), forward: (1, 1) },
];

/// Returns an axis with its sign as a vector.
fn axis((axis, sign): (usize, i8)) -> DVec3 {
    let mut v = DVec3::ZERO;
    v[axis] = f64::from(sign);
    v
}

/// Returns the face that a direction in the cube's frame goes through. The earlier axis wins a tie.
#[inline]
pub(crate) fn face_of(d: DVec3) -> usize {
    let a = d.abs();
    if a.x >= a.y && a.x >= a.z {
        if d.x < 0.0 { 3 } else { 1 }
    } else if a.y >= a.z {
        if d.y < 0.0 { 0 } else { 5 }
    } else if d.z < 0.0 {
        2
    } else {
        4
    }
}

/// Returns the place of a direction in the cube's frame on a face's plane: −1 to 1 to the right and
/// downwards within the face.
#[inline]
pub(crate) fn place_on(face: usize, d: DVec3) -> DVec2 {
    let along = |(axis, sign): (usize, i8)| d[axis] * f64::from(sign);
    let FaceAxes { right, down, forward } = AXES[face];
    dvec2(along(right), along(down)) / along(forward)
}

/// The picture all around a place, in six faces of 90° each.
///
/// The faces have the order and the names of the scanner's sky boxes (`s3d_io::formats`, "The scanner's
/// pictures"): 0 up, 1 right, 2 back, 3 left, 4 front, 5 down, relative to the location's original camera
/// E(original). That camera sees faces 1 to 4 when it turns on the spot. It sees faces 0 and 5 when it looks
/// straight up or down from the front: the lower edge of *up* and the upper edge of *down* meet *front*.
/// Every face is seen from inside, its first row at its top.
///
/// ```
/// use s3d_geom::{Pose, Raster, glam::DVec3};
/// use s3d_render::{CubeMap, SkyBoxTurn, TextureFilter};
///
/// // Six pictures of one colour each.
/// let pictures: Vec<Raster<[u8; 3]>> = (1..=6).map(|k| Raster::filled(64, 64, [40 * k; 3])).collect();
/// let pose = Pose::level(DVec3::ZERO, 0.0); // looks along +Y
/// let cube = CubeMap::from_sky_box(std::array::from_fn(|k| &pictures[k]), SkyBoxTurn::Front, &pose, None);
/// assert_eq!((cube.size(), cube.coverage()), (64, 1.0));
///
/// let colour = |direction: DVec3| {
///     let none = DVec3::splat(1e-9); // a footprint of no size
///     cube.sample(direction, none, none, &TextureFilter::default()).0[0].round()
/// };
/// assert_eq!([DVec3::Z, DVec3::X, -DVec3::Y].map(colour), [40.0, 80.0, 120.0]); // up, right, back
/// assert_eq!([-DVec3::X, DVec3::Y, -DVec3::Z].map(colour), [160.0, 200.0, 240.0]); // left, front, down
/// ```
#[derive(Clone, Debug)]
pub struct CubeMap {
    pose: Pose,
    size: u32,
    border: u32,
    /// The faces with their borders.
    faces: Vec<Texture>,
    reductions: Vec<Vec<Raster<[u8; 3]>>>,
    /// The seen parts of each face with its border; `None` if pictures show all of it.
    seen: Vec<Option<Seen>>,
}

/// The parts of a face that pictures show.
#[derive(Clone, Debug)]
struct Seen {
    /// 255 for a pixel that a picture shows, else 0.
    mask: Raster<u8>,
    /// Whether pictures show all of a block of [`BLOCK`] pixels squared and of the pixels around it. In most
    /// of a face, this is the only question.
    whole: Raster<bool>,
}

/// The width of a block of [`Seen`].
const BLOCK: u32 = 16;

impl Seen {
    fn new(mask: Raster<u8>) -> Self {
        let blocks = mask.width().div_ceil(BLOCK);
        let around = |block: u32| {
            (block * BLOCK).saturating_sub(1) as usize..((block + 1) * BLOCK + 1).min(mask.width()) as usize
        };
        let mut whole = Vec::with_capacity((blocks * blocks) as usize);
        for rows in (0..blocks).map(around) {
            for columns in (0..blocks).map(around) {
                whole.push(
                    rows.clone()
                        .all(|y| mask.row(y as u32)[columns.clone()].iter().all(|&seen| seen == 255)),
                );
            }
        }
        let whole = Raster::from_vec(blocks, blocks, whole);
        Self { mask, whole }
    }
}

/// A pixel of a cube map in the making: a colour of 0 to 255 a channel, or nothing.
pub(crate) type Texel = Option<[f32; 3]>;

/// The most rows of a [`Band`].
pub(crate) const BAND: u32 = 32;

/// Some rows of a face with its border, while a cube map is made.
pub(crate) struct Band<'a> {
    pub(crate) face: usize,
    pub(crate) first_row: u32,
    /// The width of a row in pixels.
    pub(crate) width: usize,
    /// The colours, row after row.
    pub(crate) colors: &'a mut [[u8; 3]],
    /// 255 where a picture shows the pixel, else 0.
    pub(crate) seen: &'a mut [u8],
}

impl Band<'_> {
    /// Iterates over the rows: their colours, and which pixels are seen.
    pub(crate) fn rows(&mut self) -> impl Iterator<Item = (&mut [[u8; 3]], &mut [u8])> {
        self.colors.chunks_mut(self.width).zip(self.seen.chunks_mut(self.width))
    }
}

/// Returns the width of a face of `size` pixels with its border.
pub(crate) fn stored_width(size: u32) -> u32 {
    size + 2 * (size / BORDERS)
}

impl CubeMap {
    /// Returns the smallest possible size of a face that is at least `wanted`: a multiple of 32, at most
    /// 8,192.
    pub fn fitting_size(wanted: f64) -> u32 {
        let parts = (wanted / f64::from(BORDERS)).clamp(1.0, f64::from(MAX_SIZE / BORDERS));
        libm::ceil(parts - 1e-9) as u32 * BORDERS
    }

    /// Makes a cube map around `pose` (E(original)) with faces of `size` pixels. `texel` returns each pixel
    /// from the face, the column and row in the face with its border, and the direction in the cube's frame.
    /// Runs on all threads of the current rayon pool.
    pub(crate) fn build(
        pose: Pose,
        size: u32,
        texel: impl Fn(usize, u32, u32, DVec3) -> Texel + Sync,
    ) -> Self {
        Self::build_bands(pose, size, |mut band| {
            let face = band.face;
            let first_row = band.first_row;
            for (y, (row, seen)) in (first_row..).zip(band.rows()) {
                for (x, (pixel, seen)) in (0..).zip(row.iter_mut().zip(seen)) {
                    if let Some(color) = texel(face, x, y, direction_of(face, size, x, y)) {
                        *pixel = color.map(|c| (c + 0.5) as u8);
                        *seen = 255;
                    }
                }
            }
        })
    }

    /// Makes a cube map around `pose` (E(original)) with faces of `size` pixels, in bands of [`BAND`] rows.
    /// `paint` gets each band black and unseen. Runs on all threads of the current rayon pool.
    pub(crate) fn build_bands(pose: Pose, size: u32, paint: impl Fn(Band<'_>) + Sync) -> Self {
        let size = Self::fitting_size(f64::from(size));
        let border = size / BORDERS;
        let width = stored_width(size);

        let mut faces = Vec::with_capacity(6);
        let mut seen = Vec::with_capacity(6);
        for face in 0..6 {
            let mut colors = Raster::filled(width, width, [0u8; 3]);
            let mut mask = Raster::filled(width, width, 0u8);
            let band = width as usize * BAND as usize;
            let bands = colors
                .pixels_mut()
                .par_chunks_mut(band)
                .zip(mask.pixels_mut().par_chunks_mut(band));
            bands.enumerate().for_each(|(k, (colors, seen))| {
                let first_row = k as u32 * BAND;
                paint(Band { face, first_row, width: width as usize, colors, seen });
            });
            faces.push(colors);
            seen.push(mask.pixels().iter().any(|&m| m != 255).then(|| Seen::new(mask)));
        }

        // Holes are filled before the faces are reduced.
        faces.par_iter_mut().zip(&seen).for_each(|(face, seen)| {
            if let Some(seen) = seen {
                fill_unseen(face, &seen.mask);
            }
        });

        let reductions = faces
            .iter()
            .map(|face| std::iter::successors(halved(face), halved).collect())
            .collect();
        let faces = faces
            .into_iter()
            .map(|image| Texture { name: String::new(), image, wrap: [Wrap::Clamp; 2] })
            .collect();
        Self { pose, size, border, faces, reductions, seen }
    }

    /// Iterates over every pixel of a map with faces of `size`: its face, its column and row there, and its
    /// direction in the cube's frame.
    pub(crate) fn directions(size: u32) -> impl Iterator<Item = (usize, u32, u32, DVec3)> {
        let width = stored_width(size);
        let all = (0..6).flat_map(move |face| (0..width * width).map(move |k| (face, k % width, k / width)));
        all.map(move |(face, x, y)| (face, x, y, direction_of(face, size, x, y)))
    }

    /// Returns the pose of the camera that the map is relative to.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// Returns the width and height of a face in pixels.
    pub fn size(&self) -> u32 {
        self.size
    }

    /// Returns the size in memory, in bytes.
    pub fn bytes(&self) -> usize {
        let colors = self
            .faces
            .iter()
            .map(|f| &f.image)
            .chain(self.reductions.iter().flatten());
        let seen = self
            .seen
            .iter()
            .flatten()
            .map(|seen| seen.mask.len() + seen.whole.len())
            .sum::<usize>();
        3 * colors.map(Raster::len).sum::<usize>() + seen
    }

    /// Returns the share of the pixels that pictures show, borders included: 1 if there is no hole.
    pub fn coverage(&self) -> f64 {
        let all = self.faces.iter().map(|face| face.image.len()).sum::<usize>();
        let masks = self.seen.iter().flatten().flat_map(|seen| seen.mask.pixels());
        let holes = masks.filter(|&&m| m == 0).count();
        (all - holes) as f64 / all as f64
    }

    /// Returns a face without its border, like a picture of a sky box.
    ///
    /// # Panics
    /// If `face` is not 0 to 5.
    pub fn face(&self, face: usize) -> Raster<[u8; 3]> {
        let from = self.border;
        let to = self.border + self.size;
        let image = &self.faces[face].image;
        let rows = (from..to).flat_map(|y| &image.row(y)[from as usize..to as usize]);
        Raster::from_vec(self.size, self.size, rows.copied().collect())
    }

    /// Iterates over the pixels of all faces with their borders, and whether a picture shows them: 0 or 255.
    #[cfg(test)]
    pub(crate) fn texels(&self) -> impl Iterator<Item = ([u8; 3], u8)> {
        self.faces.iter().enumerate().flat_map(move |(face, texture)| {
            let seen = move |k| self.seen[face].as_ref().map_or(255, |seen| seen.mask.pixels()[k]);
            texture
                .image
                .pixels()
                .iter()
                .enumerate()
                .map(move |(k, color)| (*color, seen(k)))
        })
    }

    /// Returns the turn from the world to the cube's frame.
    pub(crate) fn frame_from_world(&self) -> DMat3 {
        self.pose.opencv_from_world()
    }

    /// Returns the stored faces at all their levels, for the fast filter.
    pub(crate) fn levels(&self) -> [MipLevels<'_>; 6] {
        std::array::from_fn(|face| MipLevels::new(&self.faces[face], &self.reductions[face]))
    }

    /// Returns the offset and the factor that turn a place on a face's plane into pixels of the stored face:
    /// the offset is added first.
    pub(crate) fn pixels_of_place(&self) -> (f64, f64) {
        let half = 0.5 * f64::from(self.size);
        ((f64::from(self.border) + half) / half, half)
    }

    /// Tells whether there are holes.
    pub(crate) fn has_holes(&self) -> bool {
        self.seen.iter().any(Option::is_some)
    }

    /// Tells whether there are holes in a face or its border.
    pub(crate) fn has_holes_in(&self, face: usize) -> bool {
        self.seen[face].is_some()
    }

    /// Returns how much of a place of a stored face, in pixels, a picture shows: 0 to 255, bilinear.
    #[inline]
    pub(crate) fn seen_at(&self, face: usize, x: f32, y: f32) -> u8 {
        let Some(Seen { mask, whole }) = &self.seen[face] else { return 255 };
        // A place in or beside a block without holes.
        if whole.at(block_of(x, whole.width()), block_of(y, whole.width())) {
            return 255;
        }

        let last = mask.width() as i32 - 1;
        // `x` and `y` are at least −½, or NaN, which a cast brings to 0.
        let x = x - 0.5;
        let y = y - 0.5;
        let xf = x.floor();
        let yf = y.floor();
        let px = ((x - xf) * 256.0) as u32;
        let py = ((y - yf) * 256.0) as u32;
        let x0 = column_of(xf as i32, last);
        let x1 = column_of((xf as i32).saturating_add(1), last);
        let y0 = column_of(yf as i32, last);
        let y1 = column_of((yf as i32).saturating_add(1), last);
        let at = |x, y| u32::from(mask.at(x, y));
        let upper = at(x0, y0) * (256 - px) + at(x1, y0) * px;
        let lower = at(x0, y1) * (256 - px) + at(x1, y1) * px;
        ((upper * (256 - py) + lower * py) >> 16) as u8
    }

    /// Returns the colour in a direction of the world, 0 to 255 a channel, and how much of it a picture
    /// shows, 0 to 255. The footprint has the sides `x` and `y`: the changes of the direction to the next
    /// pixels. [`crate::picture_image`] does the same faster.
    pub fn sample(&self, direction: DVec3, x: DVec3, y: DVec3, filter: &TextureFilter) -> ([f32; 3], u8) {
        let turn = self.frame_from_world();
        let d = turn * direction;
        let face = face_of(d);
        let at = place_on(face, d);
        let forward = axis(AXES[face].forward);

        // (u / m)' = (u' − u / m · m') / m
        let depth = d.dot(forward);
        let slope = |v: DVec3| {
            let v = turn * v;
            let right = v.dot(axis(AXES[face].right));
            let down = v.dot(axis(AXES[face].down));
            (dvec2(right, down) - at * v.dot(forward)) / depth
        };

        let (offset, scale) = self.pixels_of_place();
        let width = f64::from(self.faces[face].image.width());
        let flip = dvec2(1.0, -1.0);
        let pixel = (at + offset) * scale;
        let uv = dvec2(pixel.x / width, 1.0 - pixel.y / width);
        let mip_map = MipMap::new(&self.faces[face], &self.reductions[face]);
        let per_pixel = scale / width * flip;
        let color = mip_map.sample(uv, slope(x) * per_pixel, slope(y) * per_pixel, filter);
        (color, self.seen_at(face, pixel.x as f32, pixel.y as f32))
    }
}

/// Returns the row or column of the block at a place.
fn block_of(place: f32, blocks: u32) -> u32 {
    (place as u32 / BLOCK).min(blocks - 1)
}

fn column_of(i: i32, last: i32) -> u32 {
    i.clamp(0, last) as u32
}

/// Returns the position of the centre of column or row `i` of a face with its border on the face's plane:
/// −1 to 1 within the face.
pub(crate) fn place_of(size: u32, i: u32) -> f64 {
    (f64::from(i) + 0.5 - f64::from(size / BORDERS)) / (0.5 * f64::from(size)) - 1.0
}

/// Returns a face's right, down and forward in the cube's frame.
pub(crate) fn axes_of(face: usize) -> [DVec3; 3] {
    let FaceAxes { right, down, forward } = AXES[face];
    [right, down, forward].map(axis)
}

/// Returns the direction of the centre of a pixel of a face with its border, in the cube's frame and with a
/// depth of 1 on the face.
pub(crate) fn direction_of(face: usize, size: u32, x: u32, y: u32) -> DVec3 {
    let [right, down, forward] = axes_of(face);
    right * place_of(size, x) + down * place_of(size, y) + forward
}

/// Returns the cameras at `pose` that see the faces with their borders, pixel for pixel.
pub(crate) fn face_cameras(pose: &Pose, size: u32) -> [s3d_geom::Camera; 6] {
    let width = stored_width(size);
    let fov = 2.0 * libm::atan(f64::from(width) / f64::from(size));
    let world_from_frame = pose.opencv_from_world().transpose();
    std::array::from_fn(|face| {
        let [right, down, forward] = axes_of(face).map(|axis| world_from_frame * axis);
        let world_from_camera = DMat3::from_cols(right, -down, -forward);
        s3d_geom::Camera::perspective(Pose { location: pose.location, world_from_camera }, fov, width, width)
    })
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use glam::{DQuat, dvec3};
    use proptest::prelude::*;

    /// Returns a colour for each direction of the world, smooth and different everywhere.
    pub(crate) fn color_of(direction: DVec3) -> [f32; 3] {
        let d = direction.normalize();
        [d.x, d.y, d.z].map(|c| (127.5 + 100.0 * c) as f32)
    }

    pub(crate) fn pose() -> Pose {
        Pose::from_scanner(dvec3(1.0, 2.0, 1.5), DQuat::from_rotation_z(0.8) * DQuat::from_rotation_x(0.03))
    }

    pub(crate) fn close(a: [f32; 3], b: [f32; 3], bound: f32) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() <= bound)
    }

    fn smooth(size: u32) -> CubeMap {
        let world = pose().opencv_from_world().transpose();
        CubeMap::build(pose(), size, |_, _, _, d| Some(color_of(world * d)))
    }

    proptest! {
        /// Seams are included: the second direction has two or three components that are nearly equal.
        #[test]
        fn every_direction_has_its_colour(
            d in prop::array::uniform3(-1.0..1.0f64), tilt in -0.01..0.01f64, far in any::<bool>(),
        ) {
            static CUBE: std::sync::LazyLock<CubeMap> = std::sync::LazyLock::new(|| smooth(256));
            let cube = &*CUBE;
            let mut d = DVec3::from(d);
            prop_assume!(d.length() > 0.1);
            if far {
                let seam = dvec3(1.0f64.copysign(d.x), (1.0 + tilt).copysign(d.y), d.z);
                d = cube.frame_from_world().transpose() * seam;
            }
            let tiny = DVec3::splat(1e-9);
            let (color, seen) = cube.sample(d, tiny, tiny, &TextureFilter::default());
            prop_assert!(close(color, color_of(d), 1.0) && seen == 255, "{color:?} {:?}", color_of(d));
            // A footprint of eight pixels.
            let (x, y) = d.normalize().any_orthonormal_pair();
            let x = x * d.length() * (8.0 / 128.0);
            let y = y * d.length() * (8.0 / 128.0);
            let (color, _) = cube.sample(d, x, y, &TextureFilter::default());
            prop_assert!(close(color, color_of(d), 2.0), "{color:?} {:?}", color_of(d));
        }
    }

    fn seen_value(x: f64, y: f64) -> f64 {
        let [x, y] = [x, y].map(|v| v.clamp(0.0, 101.0) as u32);
        if is_hole(x, y) { 0.0 } else { 255.0 }
    }

    fn plain_seen(x: f64, y: f64) -> f64 {
        let x = x - 0.5;
        let y = y - 0.5;
        let fx = x - x.floor();
        let fy = y - y.floor();
        let row = |y| seen_value(x.floor(), y) * (1.0 - fx) + seen_value(x.floor() + 1.0, y) * fx;
        row(y.floor()) * (1.0 - fy) + row(y.floor() + 1.0) * fy
    }

    /// There are few holes, one of them at a corner.
    fn is_hole(x: u32, y: u32) -> bool {
        (x / 3, y / 5) == (30, 7) || (x, y) == (0, 0) || (x, y) == (48, 63)
    }

    #[test]
    fn whole_blocks_change_nothing_that_is_seen() {
        let cube =
            CubeMap::build(pose(), 96, |face, x, y, _| (face != 2 || !is_hole(x, y)).then_some([9.0; 3]));
        let mut part = 0;
        for k in 0..400 * 400 {
            let x = f64::from(k % 400) * 0.255;
            let y = f64::from(k / 400) * 0.255;
            let seen = cube.seen_at(2, x as f32, y as f32);
            let expected = plain_seen(x, y);
            assert!((f64::from(seen) - expected).abs() <= 3.0, "({x}, {y}): {seen}, {expected}");
            part += u32::from(seen < 255);
            assert_eq!(cube.seen_at(1, x as f32, y as f32), 255);
        }
        assert!((300..3000).contains(&part), "{part}");
    }

    #[test]
    fn faces_are_what_the_turned_camera_sees() {
        use std::f64::consts::FRAC_PI_2;
        let cube = smooth(64);
        let turns = [
            (0.0, FRAC_PI_2),
            (-FRAC_PI_2, 0.0),
            (2.0 * FRAC_PI_2, 0.0),
            (FRAC_PI_2, 0.0),
            (0.0, 0.0),
            (0.0, -FRAC_PI_2),
        ];
        for (face, (yaw, pitch)) in turns.into_iter().enumerate() {
            let camera = s3d_geom::Camera::perspective(pose().turned(yaw, pitch), FRAC_PI_2, 64, 64);
            let image = cube.face(face);
            let rays = camera.rays();
            for (x, y) in (0..64 * 64).map(|k| (k % 64, k / 64)) {
                let color = image.at(x, y).map(f32::from);
                assert!(close(color, color_of(rays.at(x, y)), 0.51), "face {face} at ({x}, {y})");
            }
        }
        assert_eq!((cube.size(), cube.coverage(), cube.pose()), (64, 1.0, &pose()));
        assert_eq!(cube.face(0).width(), 64);
    }

    #[test]
    fn face_cameras_see_the_stored_pixels() {
        for (face, camera) in face_cameras(&pose(), 96).iter().enumerate() {
            assert_eq!(camera.width, 96 + 6);
            let turn = pose().opencv_from_world();
            for (x, y) in [(0, 0), (3, 98), (50, 51), (101, 7)] {
                let expected = direction_of(face, 96, x, y);
                assert!((turn * camera.rays().at(x, y)).abs_diff_eq(expected, 1e-12), "{face} {x} {y}");
            }
        }
    }

    #[test]
    fn sizes_are_multiples_that_fit() {
        assert_eq!([0.0, 32.0, 32.5, 1024.0, 1e9].map(CubeMap::fitting_size), [32, 32, 64, 1024, 8192]);
    }

    #[test]
    fn holes_are_told_and_filled() {
        let world = pose().opencv_from_world().transpose();
        // Nothing is seen below 45°.
        let below = |d: DVec3| (world * d).normalize().z < -std::f64::consts::FRAC_1_SQRT_2;
        let cube = CubeMap::build(pose(), 64, |_, _, _, d| (!below(d)).then(|| color_of(world * d)));
        let tiny = DVec3::splat(1e-9);
        let sample = |d: DVec3| cube.sample(d, tiny, tiny, &TextureFilter::default());
        assert_eq!(sample(dvec3(1.0, 0.0, -0.9)).1, 255);
        let (color, seen) = sample(dvec3(0.3, 0.0, -1.0));
        assert!(seen == 0 && color[2] > 20.0, "{color:?}");
        assert!((0.8..0.9).contains(&cube.coverage()), "{}", cube.coverage());
        // The rim is partly seen.
        assert!((0..100).any(|k| (1..255).contains(&sample(dvec3(1.0, 0.0, -0.9 - 0.002 * f64::from(k))).1)));
    }
}
