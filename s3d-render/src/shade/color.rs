//! Makes the RGB image.
//!
//! Faces that first appear in a band of rows are prepared eight at a time. Each row is then coloured in two
//! passes. The first pass walks the spans of equal faces: [`crate::shade::anchor`] gives the texture
//! coordinates of eight pixels at a time and their change from pixel to pixel, which is each pixel's
//! footprint. The second pass walks the row regardless of spans and fetches the textures, again eight pixels
//! at a time ([`crate::shade::filter`]). A pixel depends on other pixels only through the rounding of their
//! common anchor.

use crate::hits::Hits;
use crate::scene::Scene;
use crate::shade::anchor::attributes::Attributes;
use crate::shade::anchor::ray_grid::RayGrid;
use crate::shade::anchor::{Anchor, AnchorBatch};
use crate::shade::channels::{assert_size, fit, paint};
use crate::shade::face_table::NewFace;
use crate::shade::filter::{Footprints, MipLevels};
use crate::shade::mip_maps::{MipMaps, TextureFilter};
use crate::shade::patch::{FaceCache, Patch};
use crate::shade::pixel_color::PixelByPixel;
use crate::shade::prefetch::Prefetch;
use crate::shade::spans::Spans;
use crate::shade::texel_wrap::TexelWrap;
use crate::shade::view::{Modalities, Shading, ViewImages, ViewKernel};
use crate::simd::dispatch_on;
use crate::simd::shade_lanes::{LANES, ShadeLanes};
use glam::DVec3;
use s3d_geom::{Camera, FaceColor, NormalAxes, Raster};
use s3d_simd::{ProvenLevel, level};
use std::ops::Range;

/// Returns the colours that the pixels see. Textures are filtered over each pixel's footprint, colours of
/// corners are interpolated, and materials are flat. Black marks missing pixels alone: a visible dark pixel
/// is at least (1, 1, 1).
///
/// Near the seam of a texture atlas the footprint includes texels beyond the seam, as with any mip map.
///
/// # Panics
/// If the hits are not of the camera's size, or `mip_maps` are another mesh's.
pub fn rgb_image(scene: &Scene<'_>, mip_maps: &MipMaps, hits: &Hits, camera: &Camera) -> Raster<[u8; 3]> {
    rgb_image_with(scene, mip_maps, hits, camera, &TextureFilter::default())
}

/// Returns the image of [`rgb_image`] for a given filter.
///
/// # Panics
/// As for [`rgb_image`].
pub fn rgb_image_with(
    scene: &Scene<'_>,
    mip_maps: &MipMaps,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
) -> Raster<[u8; 3]> {
    let mut out = Raster::filled(hits.face.width(), hits.face.height(), [0; 3]);
    rgb_image_into(scene, mip_maps, hits, camera, filter, &mut out);
    out
}

/// Writes the image of [`rgb_image_with`] into an existing image.
///
/// # Panics
/// As for [`rgb_image`].
pub fn rgb_image_into(
    scene: &Scene<'_>,
    mip_maps: &MipMaps,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
    out: &mut Raster<[u8; 3]>,
) {
    assert_size(hits, camera);
    rgb_of_faces_into(level(), scene, mip_maps, &hits.face, camera, filter, out);
}

/// Writes the image of [`rgb_image_into`] from the faces of hits, with the instructions of `level`.
pub(crate) fn rgb_of_faces_into(
    level: ProvenLevel,
    scene: &Scene<'_>,
    mip_maps: &MipMaps,
    faces: &Raster<u32>,
    camera: &Camera,
    filter: &TextureFilter,
    out: &mut Raster<[u8; 3]>,
) {
    fit(out, faces, [0; 3]);
    let &filter = filter;
    let shading = Shading {
        scene,
        mip_maps,
        filter,
        normal_axes: NormalAxes::default(),
        index_of_face: &[],
        color_of_face: &[],
    };
    let mut images = ViewImages::default();
    std::mem::swap(&mut images.rgb, out);
    let wanted = Modalities { rgb: true, ..Modalities::default() };
    let depths = &Raster::filled(0, 0, 0.0);
    dispatch_on(level, ViewKernel { shading: &shading, faces, depths, camera, wanted, out: &mut images });
    std::mem::swap(&mut images.rgb, out);
}

/// Where the colour of a face comes from.
#[derive(Clone, Copy)]
enum ColorSource {
    /// A texture; the value is its tag: see [`RowBuffer`].
    Texture(u32),
    Corners,
    Flat([u8; 3]),
    /// The face is coloured by [`PixelByPixel`] alone.
    PerPixel,
}

/// The colour of a face as attributes: their source, their values at the corners, and how they repeat.
type FaceColors = (ColorSource, [[f64; 3]; 3], [TexelWrap; 3]);

/// Returns the colour of a face as attributes.
#[inline(always)]
fn colored(scene: &Scene<'_>, levels: &[MipLevels<'_>], face: u32) -> FaceColors {
    let wraps = [TexelWrap::NONE; 3];
    match scene.mesh().color_of(face) {
        FaceColor::Texture(index, texture, uvs) => {
            let levels = &levels[index as usize];
            let [w, h] = [texture.image.width(), texture.image.height()].map(f64::from);
            // In pixels of the full size, to the right and downwards.
            let x = uvs.map(|uv| f64::from(uv.x) * w);
            let y = uvs.map(|uv| (1.0 - f64::from(uv.y)) * h);
            let source = if levels.is_usable() {
                ColorSource::Texture(index)
            } else {
                ColorSource::PerPixel
            };
            (source, [x, y, [0.0; 3]], levels.wraps())
        }
        FaceColor::Corners(colors) => {
            let channel = |k: usize| colors.map(|c| f64::from(c[k]));
            (ColorSource::Corners, [channel(0), channel(1), channel(2)], wraps)
        }
        FaceColor::Flat([0, 0, 0]) => (ColorSource::Flat([1; 3]), [[0.0; 3]; 3], wraps),
        FaceColor::Flat(color) => (ColorSource::Flat(color), [[0.0; 3]; 3], wraps),
    }
}

/// A prepared face.
struct Prepared {
    source: ColorSource,
    anchor: Anchor,
}

impl Prepared {
    /// Returns the entry of missing pixels, which are black.
    fn missing() -> Self {
        Self { source: ColorSource::Flat([0; 3]), anchor: Anchor::default() }
    }
}

/// A row between its two passes. Values are stored eight at a time, beyond the end of their span; the values
/// of the next span overwrite them.
struct RowBuffer {
    width: usize,
    footprints: Footprints,
    /// The tag of each pixel: a texture, perhaps with the bit [`NARROW`], or [`DONE`].
    tags: Vec<u32>,
}

/// The tag of a pixel whose colour is final.
const DONE: u32 = u32::MAX;
/// The bit of a tag whose footprints are nowhere wider than a pixel of the texture.
const NARROW: u32 = 1 << 31;

impl RowBuffer {
    fn new(width: usize) -> Self {
        let padded = width + 2 * LANES;
        Self { width, footprints: Footprints::new(padded), tags: vec![DONE; padded] }
    }
}

/// Colours a view band by band.
pub(crate) struct RgbPainter<'a, L> {
    lanes: L,
    scene: &'a Scene<'a>,
    /// The levels of each texture.
    levels: Vec<MipLevels<'a>>,
    origin: DVec3,
    max_taps: u32,
    batch: AnchorBatch,
    /// The prepared faces, by their numbers in the [`Spans`].
    prepared: Vec<Prepared>,
    /// The attributes of faces that need several anchors.
    large: FaceCache<Attributes>,
    per_pixel: PixelByPixel<'a>,
    row: RowBuffer,
}

impl<'a, L: ShadeLanes> RgbPainter<'a, L> {
    pub(crate) fn new(
        lanes: L,
        scene: &'a Scene<'a>,
        mip_maps: &'a MipMaps,
        camera: &'a Camera,
        filter: &'a TextureFilter,
    ) -> Self {
        Self {
            lanes,
            scene,
            levels: scene
                .mesh()
                .textures()
                .iter()
                .enumerate()
                .map(|(k, t)| mip_maps.levels(k, t))
                .collect(),
            origin: camera.pose.location,
            max_taps: filter.max_taps,
            batch: AnchorBatch::new(),
            prepared: vec![Prepared::missing()],
            large: FaceCache::new(),
            per_pixel: PixelByPixel::new(scene, mip_maps, camera, filter),
            row: RowBuffer::new(camera.width as usize),
        }
    }

    /// Forgets all faces.
    pub(crate) fn forget(&mut self) {
        self.prepared.truncate(1);
    }

    /// Colours the band from row `first_row` on. Its pixels see `faces`.
    #[inline(always)]
    pub(crate) fn band<const PANORAMA: bool>(
        &mut self,
        grid: &RayGrid,
        spans: &Spans,
        first_row: usize,
        faces: &[u32],
        out: &mut [[u8; 3]],
        prefetch: &Prefetch<'_>,
    ) {
        let width = self.row.width;

        for k in 0..spans.new_groups() {
            let (group, count) = spans.new_group::<true>(self.lanes, Some(self.scene.mesh()), k);
            self.prepare::<PANORAMA>(grid, first_row, &group, count);
        }

        let mut pieces = spans.pieces().windows(2).peekable();
        for (j, row) in out.chunks_mut(width.max(1)).enumerate() {
            let from = j * width;
            while let Some(&[piece, next]) =
                pieces.next_if(|pieces| (pieces[0].start as usize) < from + width)
            {
                let start = piece.start as usize;
                let end = next.start as usize;
                let columns = start - from..end - from;
                self.lay_out::<PANORAMA>(grid, faces[start], piece.number, first_row + j, columns, row);
            }
            self.fetch(row, from, prefetch);
        }
    }

    /// Prepares the first `count` of some faces that first appear in the band from row `first_row` on.
    #[inline(always)]
    fn prepare<const PANORAMA: bool>(
        &mut self,
        grid: &RayGrid,
        first_row: usize,
        faces: &[NewFace; LANES],
        count: usize,
    ) {
        let mut sources = [ColorSource::PerPixel; LANES];
        for (k, &NewFace { face, at }) in faces.iter().enumerate() {
            let (source, values, wraps) = colored(self.scene, &self.levels, face);
            sources[k] = source;
            let at = (at as usize % self.row.width, first_row + at as usize / self.row.width);
            self.batch
                .put(k, self.scene.mesh().triangle(face), values, wraps, grid, at);
        }

        let (anchors, fastest) = self.batch.anchors::<PANORAMA>(self.origin);
        for k in 0..count {
            let source = match sources[k] {
                // A footprint is wide if the sum is above 1.
                ColorSource::Texture(texture) if fastest[k] < 0.999 => ColorSource::Texture(texture | NARROW),
                source => source,
            };
            self.prepared.push(Prepared { source, anchor: anchors[k] });
        }
    }

    /// Anchors a face again, at pixel (i, j). Returns `false` if that fails, or if the face needs no anchor.
    #[inline(never)]
    fn anchor_again<const PANORAMA: bool>(
        &mut self,
        grid: &RayGrid,
        face: u32,
        number: u32,
        i: usize,
        j: usize,
    ) -> bool {
        let Self { scene, levels, origin, large, prepared, .. } = self;
        let Prepared { source, anchor } = &mut prepared[number as usize];
        let wraps = match source {
            ColorSource::Texture(tag) => levels[(*tag & !NARROW) as usize].wraps(),
            ColorSource::Corners => [TexelWrap::NONE; 3],
            ColorSource::Flat(_) | ColorSource::PerPixel => return false,
        };
        let attributes = large.get(face, || {
            let (_, values, _) = colored(scene, levels, face);
            Attributes::new(&Patch::new(scene.mesh(), face, *origin), values)
        });
        anchor.set::<PANORAMA>(attributes, wraps, grid, i, j)
    }

    /// The first pass over the pixels `start` to `end` of row `j`, at most [`LANES`], which all see `face`.
    #[inline(always)]
    fn lay_out<const PANORAMA: bool>(
        &mut self,
        grid: &RayGrid,
        face: u32,
        number: u32,
        j: usize,
        Range { start, end }: Range<usize>,
        out: &mut [[u8; 3]],
    ) {
        let lanes = self.lanes;
        let Prepared { source, anchor } = &self.prepared[number as usize];
        let source = *source;
        if let ColorSource::Flat(color) = source {
            self.row.tags[start..end].fill(DONE);
            return paint(out, start, end, color);
        }

        let mut anchor = anchor;
        if !anchor.reaches(start, j) {
            if !self.anchor_again::<PANORAMA>(grid, face, number, start, j) {
                self.row.tags[start..end].fill(DONE);
                for (i, color) in (start..).zip(&mut out[start..end]) {
                    *color = self.per_pixel.color(face, i, j);
                }
                return;
            }
            anchor = &self.prepared[number as usize].anchor;
        }

        let line = anchor.line::<PANORAMA>(grid, j);
        let row = &mut self.row;
        let mut doubtful;

        if let ColorSource::Texture(tag) = source {
            let seen = line.at::<PANORAMA, 2, L>(lanes, start);
            doubtful = seen.doubtful;
            row.footprints.store(lanes, start, &seen, tag & NARROW != 0);
            if let Some(tags) = row.tags[start..].first_chunk_mut() {
                *tags = [tag; LANES];
            }
        } else {
            let seen = line.at::<PANORAMA, 3, L>(lanes, start);
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

        // Pixels in doubt are coloured one by one.
        doubtful &= (1 << (end - start)) - 1;
        while doubtful != 0 {
            let at = start + doubtful.trailing_zeros() as usize;
            row.tags[at] = DONE;
            out[at] = self.per_pixel.color(face, at, j);
            doubtful &= doubtful - 1;
        }
    }

    /// The second pass: fetches the textures of a row.
    #[inline(always)]
    fn fetch(&mut self, out: &mut [[u8; 3]], from: usize, prefetch: &Prefetch<'_>) {
        let width = out.len();
        let Self { lanes, levels, row, max_taps, .. } = self;
        row.tags[width..].fill(DONE);
        for i in (0..width).step_by(LANES) {
            if i.is_multiple_of(Prefetch::PIXELS) {
                prefetch.fetch(*lanes, from + i);
            }
            let Some(tags) = row.tags[i..].first_chunk::<LANES>() else { return };

            // There is mostly one texture. The tags of other pixels wait for the next round.
            let mut left = !lanes.equal(tags, DONE) & 0xFF;
            while left != 0 {
                let texture = tags[left.trailing_zeros() as usize % LANES] & !NARROW;
                let narrow = lanes.equal(tags, texture | NARROW);
                let maybe = if narrow == 0xFF { 0 } else { lanes.equal(tags, texture) };
                let these = narrow | maybe;
                let pixels = (these, maybe);
                let colors = levels[texture as usize].colors(*lanes, &row.footprints, i, pixels, *max_taps);

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

/// Stores the colours whose bits are set in `these`. It is not inlined: that would take registers from the
/// loop, which rarely calls it.
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
    use s3d_geom::Pose;
    use s3d_synth::scenes::scan_like;

    #[test]
    fn every_level_of_instructions_gives_the_same_bytes() {
        let mesh = scan_like(6_000, 3);
        let scene = Scene::new(&mesh);
        let mip_maps = MipMaps::new(&mesh);
        let pose = Pose::level(glam::dvec3(3.0, 2.5, 1.5), 0.3);
        for camera in [
            Camera::perspective(pose.turned(0.3, -0.4), 1.2, 301, 203),
            // Textures that are much too fine for the image.
            Camera::perspective(pose, 1.6, 33, 21),
            Camera::pinhole(pose, glam::dvec2(150.0, 210.0), glam::dvec2(12.5, 190.0), 203, 301).unwrap(),
            Camera::equirectangular(pose, 256),
        ] {
            let hits = crate::raster::visibility::cast(&scene, &camera);
            let filter = TextureFilter::default();
            let images = ProvenLevel::all().into_iter().map(|level| {
                let mut out = Raster::filled(camera.width, camera.height, [0; 3]);
                rgb_of_faces_into(level, &scene, &mip_maps, &hits.face, &camera, &filter, &mut out);
                out
            });
            let images: Vec<_> = images.collect();
            assert!(images.iter().all(|image| *image == images[0]));
        }
    }
}
