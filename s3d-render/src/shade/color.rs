//! The RGB image.
//!
//! Faces that a band of rows is the first to show are prepared eight at a time. Then each row is coloured in two passes. The
//! first walks its runs of equal faces: [`crate::shade::anchor`] gives the texture coordinates of eight pixels at a time and their
//! change from pixel to pixel, hence each pixel's footprint. The second walks the row regardless of runs and fetches the
//! textures, again eight pixels at a time ([`crate::shade::filter`]). What a pixel gets depends on no other pixel but through
//! the anchor, whose rounding it takes over.

use crate::hits::Hits;
use crate::scene::Scene;
use crate::shade::anchor::{Anchor, Attributes, Batch, Grid};
use crate::shade::channels::{assert_size, fit, paint};
use crate::shade::face_table::New;
use crate::shade::filter::{Footprints, Sizes};
use crate::shade::mip_maps::{Pyramids, TextureFilter};
use crate::shade::patch::{FaceCache, Patch};
use crate::shade::pixel_color::PixelByPixel;
use crate::shade::prefetch::Ahead;
use crate::shade::spans::{Runs, band_rows};
use crate::shade::wrap_mode::Fold;
use crate::simd::lanes::{self, LANES, LaneWork, Lanes};
use glam::DVec3;
use s3d_geom::{Camera, FaceColor, Raster};
use std::ops::Range;

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
    let mut out = Raster::filled(hits.face.width(), hits.face.height(), [0; 3]);
    rgb_image_into(scene, pyramids, hits, camera, filter, &mut out);
    out
}

/// As [`rgb_image_with`], into an image that is used again.
///
/// # Panics
/// As [`rgb_image`].
pub fn rgb_image_into(
    scene: &Scene<'_>,
    pyramids: &Pyramids,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
    out: &mut Raster<[u8; 3]>,
) {
    assert_size(hits, camera);
    fit(out, &hits.face, [0; 3]);
    lanes::run(Rgb { scene, pyramids, hits, camera, filter, out });
}

struct Rgb<'a> {
    scene: &'a Scene<'a>,
    pyramids: &'a Pyramids,
    hits: &'a Hits,
    camera: &'a Camera,
    filter: &'a TextureFilter,
    out: &'a mut Raster<[u8; 3]>,
}

impl LaneWork for Rgb<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self, lanes: impl Lanes) {
        let Self { scene, pyramids, hits, camera, filter, out } = self;
        let grid = Grid::new(camera);
        let mut painter = Painter::new(lanes, scene, pyramids, camera, filter);
        let width = hits.face.width() as usize;
        let (mut runs, band) = (Runs::new(width), (band_rows(width) * width).max(1));
        let parts = hits.face.pixels().chunks(band).zip(out.pixels_mut().chunks_mut(band));
        for (k, (faces, out)) in parts.enumerate() {
            if runs.find(lanes, Some(scene.mesh()), faces) {
                painter.forget();
            }
            if grid.is_turn() {
                painter.band::<true>(&grid, &runs, k * band_rows(width), faces, out, &Ahead::default());
            } else {
                painter.band::<false>(&grid, &runs, k * band_rows(width), faces, out, &Ahead::default());
            }
        }
    }
}

/// Where a face has its colour from.
#[derive(Clone, Copy)]
enum Look {
    /// A tag.
    Texture(u32),
    Corners,
    Flat([u8; 3]),
    /// From [`PixelByPixel`] alone.
    Singly,
}

/// The attributes of a face's colour: what they are, their values at its corners, and how they repeat.
type Colored = (Look, [[f64; 3]; 3], [Fold; 3]);

#[inline(always)]
fn colored(scene: &Scene<'_>, sizes: &[Sizes<'_>], face: u32) -> Colored {
    let folds = [Fold::NOT; 3];
    match scene.mesh().color_of(face) {
        FaceColor::Texture(index, texture, uvs) => {
            let sizes = &sizes[index as usize];
            let [w, h] = [texture.image.width(), texture.image.height()].map(f64::from);
            // In pixels of the full size, to the right and downwards.
            let x = uvs.map(|uv| f64::from(uv.x) * w);
            let y = uvs.map(|uv| (1.0 - f64::from(uv.y)) * h);
            let look = if sizes.is_usable() { Look::Texture(index) } else { Look::Singly };
            (look, [x, y, [0.0; 3]], sizes.folds())
        }
        FaceColor::Corners(colors) => {
            let channel = |k: usize| colors.map(|c| f64::from(c[k]));
            (Look::Corners, [channel(0), channel(1), channel(2)], folds)
        }
        FaceColor::Flat([0, 0, 0]) => (Look::Flat([1; 3]), [[0.0; 3]; 3], folds),
        FaceColor::Flat(color) => (Look::Flat(color), [[0.0; 3]; 3], folds),
    }
}

/// A face, prepared.
struct Prepared {
    look: Look,
    anchor: Anchor,
}

impl Prepared {
    /// What is missing is black.
    fn missing() -> Self {
        Self { look: Look::Flat([0; 3]), anchor: Anchor::default() }
    }
}

/// A row between its two passes. Values are stored eight at a time, beyond the end of their run: the next run's go over
/// them.
struct Row {
    width: usize,
    footprints: Footprints,
    /// By pixel: a texture, perhaps with [`NARROW`]; or [`DONE`].
    tags: Vec<u32>,
}

/// The colour stands already.
const DONE: u32 = u32::MAX;
/// Footprints are nowhere wider than a pixel of the texture.
const NARROW: u32 = 1 << 31;

impl Row {
    fn new(width: usize) -> Self {
        let padded = width + 2 * LANES;
        Self { width, footprints: Footprints::new(padded), tags: vec![DONE; padded] }
    }
}

/// Colours a view band by band.
pub(crate) struct Painter<'a, L> {
    lanes: L,
    scene: &'a Scene<'a>,
    /// By texture.
    sizes: Vec<Sizes<'a>>,
    origin: DVec3,
    max_taps: u32,
    batch: Batch,
    /// By the face's number in the [`Runs`].
    prepared: Vec<Prepared>,
    /// Of faces that need one anchor after another.
    large: FaceCache<Attributes>,
    singly: PixelByPixel<'a>,
    row: Row,
}

impl<'a, L: Lanes> Painter<'a, L> {
    pub(crate) fn new(
        lanes: L,
        scene: &'a Scene<'a>,
        pyramids: &'a Pyramids,
        camera: &'a Camera,
        filter: &'a TextureFilter,
    ) -> Self {
        Self {
            lanes,
            scene,
            sizes: scene.mesh().textures().iter().enumerate().map(|(k, t)| pyramids.sizes(k, t)).collect(),
            origin: camera.pose.location,
            max_taps: filter.max_taps,
            batch: Batch::new(),
            prepared: vec![Prepared::missing()],
            large: FaceCache::new(),
            singly: PixelByPixel::new(scene, pyramids, camera, filter),
            row: Row::new(camera.width as usize),
        }
    }

    /// Forgets all faces.
    pub(crate) fn forget(&mut self) {
        self.prepared.truncate(1);
    }

    /// Colours the band from row `first_row` on, which sees `faces`.
    #[inline(always)]
    pub(crate) fn band<const TURN: bool>(
        &mut self,
        grid: &Grid,
        runs: &Runs,
        first_row: usize,
        faces: &[u32],
        out: &mut [[u8; 3]],
        ahead: &Ahead<'_>,
    ) {
        let width = self.row.width;
        for k in 0..runs.new_groups() {
            let (group, count) = runs.new_group::<true>(self.lanes, Some(self.scene.mesh()), k);
            self.prepare::<TURN>(grid, first_row, &group, count);
        }
        let (mut j, mut from) = (0, 0);
        for pieces in runs.pieces().windows(2) {
            let (start, end) = (pieces[0].start as usize, pieces[1].start as usize);
            if start == from + width {
                self.fetch(&mut out[from..start], from, ahead);
                (j, from) = (j + 1, start);
            }
            let row = &mut out[from..from + width];
            let columns = start - from..end - from;
            self.lay_out::<TURN>(grid, faces[start], pieces[0].number, first_row + j, columns, row);
        }
        self.fetch(&mut out[from..], from, ahead);
    }

    /// Prepares the first `count` of some faces that the band from row `first_row` on is the first to show.
    #[inline(always)]
    fn prepare<const TURN: bool>(
        &mut self,
        grid: &Grid,
        first_row: usize,
        faces: &[New; LANES],
        count: usize,
    ) {
        let mut looks = [Look::Singly; LANES];
        for (k, &New { face, at }) in faces.iter().enumerate() {
            let (look, values, folds) = colored(self.scene, &self.sizes, face);
            looks[k] = look;
            let at = (at as usize % self.row.width, first_row + at as usize / self.row.width);
            self.batch.put(k, self.scene.mesh().triangle(face), values, folds, grid, at);
        }
        let (anchors, fastest) = self.batch.anchors::<TURN>(self.origin);
        for k in 0..count {
            let look = match looks[k] {
                // A footprint is wide where the sum is above 1.
                Look::Texture(texture) if fastest[k] < 0.999 => Look::Texture(texture | NARROW),
                look => look,
            };
            self.prepared.push(Prepared { look, anchor: anchors[k] });
        }
    }

    /// Anchors a face once more, at pixel (i, j).
    #[inline(never)]
    fn anchor_again<const TURN: bool>(
        &mut self,
        grid: &Grid,
        face: u32,
        number: u32,
        i: usize,
        j: usize,
    ) -> bool {
        let Self { scene, sizes, origin, large, prepared, .. } = self;
        let Prepared { look, anchor } = &mut prepared[number as usize];
        let folds = match look {
            Look::Texture(tag) => sizes[(*tag & !NARROW) as usize].folds(),
            Look::Corners => [Fold::NOT; 3],
            Look::Flat(_) | Look::Singly => return false,
        };
        let attributes = large.get(face, || {
            let (_, values, _) = colored(scene, sizes, face);
            Attributes::new(&Patch::new(scene.mesh(), face, *origin), values)
        });
        anchor.set::<TURN>(attributes, folds, grid, i, j)
    }

    /// The first pass over the pixels `start` to `end` of row `j`, [`LANES`] at most, which all see `face`.
    #[inline(always)]
    fn lay_out<const TURN: bool>(
        &mut self,
        grid: &Grid,
        face: u32,
        number: u32,
        j: usize,
        Range { start, end }: Range<usize>,
        out: &mut [[u8; 3]],
    ) {
        let lanes = self.lanes;
        let Prepared { look, anchor } = &self.prepared[number as usize];
        let look = *look;
        if let Look::Flat(color) = look {
            self.row.tags[start..end].fill(DONE);
            return paint(out, start, end, color);
        }
        let mut anchor = anchor;
        if !anchor.reaches(start, j) {
            if !self.anchor_again::<TURN>(grid, face, number, start, j) {
                self.row.tags[start..end].fill(DONE);
                for (i, color) in (start..).zip(&mut out[start..end]) {
                    *color = self.singly.color(face, i, j);
                }
                return;
            }
            anchor = &self.prepared[number as usize].anchor;
        }
        let line = anchor.line::<TURN>(grid, j);
        let row = &mut self.row;
        let mut doubtful;
        if let Look::Texture(tag) = look {
            let seen = line.at::<TURN, 2, L>(lanes, start);
            doubtful = seen.doubtful;
            row.footprints.store(lanes, start, &seen, tag & NARROW != 0);
            if let Some(tags) = row.tags[start..].first_chunk_mut() {
                *tags = [tag; LANES];
            }
        } else {
            let seen = line.at::<TURN, 3, L>(lanes, start);
            doubtful = seen.doubtful;
            let mut channels = [[0; LANES]; 3];
            for (value, channel) in seen.values.into_iter().zip(&mut channels) {
                lanes.store_int(lanes.add(value, lanes.splat(0.5)), channel);
            }
            for (k, i) in (start..end).enumerate() {
                row.tags[i] = DONE;
                let color = channels.map(|c| c[k] as u8);
                out[i] = if color == [0; 3] { [1; 3] } else { color };
            }
        }
        doubtful &= (1 << (end - start)) - 1;
        while doubtful != 0 {
            let at = start + doubtful.trailing_zeros() as usize;
            row.tags[at] = DONE;
            out[at] = self.singly.color(face, at, j);
            doubtful &= doubtful - 1;
        }
    }

    /// The second pass.
    #[inline(always)]
    fn fetch(&mut self, out: &mut [[u8; 3]], from: usize, ahead: &Ahead<'_>) {
        let width = out.len();
        let Self { lanes, sizes, row, max_taps, .. } = self;
        row.tags[width..].fill(DONE);
        for i in (0..width).step_by(LANES) {
            if i.is_multiple_of(Ahead::PIXELS) {
                ahead.expect(*lanes, from + i);
            }
            let Some(tags) = row.tags[i..].first_chunk::<LANES>() else { return };
            // Mostly one texture, once; the others' pixels are left alone.
            let mut left = !lanes.equal(tags, DONE) & 0xFF;
            while left != 0 {
                let texture = tags[left.trailing_zeros() as usize % LANES] & !NARROW;
                let narrow = lanes.equal(tags, texture | NARROW);
                let maybe = if narrow == 0xFF { 0 } else { lanes.equal(tags, texture) };
                let these = narrow | maybe;
                let pixels = (these, maybe);
                let colors = sizes[texture as usize].colors(*lanes, &row.footprints, i, pixels, *max_taps);
                let to = out[i..].as_flattened_mut().first_chunk_mut();
                if let (0xFF, Some(to)) = (these, to) {
                    lanes.store_pixels(&colors, to);
                    break;
                }
                put_some(&colors, these, &mut out[i..]);
                left &= !these;
            }
        }
    }
}

/// Those of eight colours that are among `these`. Not inlined: that would take registers from the loop that rarely calls it.
#[cold]
#[inline(never)]
fn put_some(colors: &[u32; LANES], these: u32, to: &mut [[u8; 3]]) {
    for (k, (color, to)) in colors.iter().zip(to).enumerate() {
        if these >> k & 1 == 1 {
            let [r, g, b, _] = color.to_le_bytes();
            *to = [r, g, b];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::lanes::Plain;
    use s3d_geom::{Pose, scan_like};

    #[test]
    fn every_set_of_instructions_gives_the_same_bytes() {
        let mesh = scan_like(6_000, 3);
        let (scene, pyramids) = (Scene::new(&mesh), Pyramids::new(&mesh));
        let pose = Pose::level(glam::dvec3(3.0, 2.5, 1.5), 0.3);
        for camera in [
            Camera::perspective(pose.turned(0.3, -0.4), 1.2, 301, 203),
            // Textures that are far too fine for the image.
            Camera::perspective(pose, 1.6, 33, 21),
            Camera::equirectangular(pose, 256),
        ] {
            let hits = crate::cast(&scene, &camera);
            let filter = TextureFilter::default();
            let fast = rgb_image_with(&scene, &pyramids, &hits, &camera, &filter);
            let mut plain = Raster::filled(camera.width, camera.height, [0; 3]);
            let work = Rgb {
                scene: &scene,
                pyramids: &pyramids,
                hits: &hits,
                camera: &camera,
                filter: &filter,
                out: &mut plain,
            };
            work.run(Plain);
            assert_eq!(fast, plain);
        }
    }
}
