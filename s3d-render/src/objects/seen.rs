//! The objects of an image.

use super::{NO_OBJECT, ObjectScenes, bounds};
use crate::hits::{Hits, NO_FACE};
use crate::pixel_box::PixelBox;
use crate::raster::visibility::Caster;
use crate::raster::window::Scratch;
use glam::{DVec2, dvec2};
use s3d_geom::{Camera, Projection, Raster, Rays};
use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::ops::Range;

/// Some pixels of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mask {
    /// The size of the image.
    pub size: [u32; 2],
    /// Stretches of pixels in the order of columns: pixel (x, y) has the number x · height + y. They are
    /// sorted, and between two of them is a pixel at least.
    pub stretches: Vec<Range<u64>>,
}

impl Mask {
    /// Returns the number of pixels.
    pub fn len(&self) -> u64 {
        self.stretches.iter().map(|stretch| stretch.end - stretch.start).sum()
    }

    /// Returns whether there is no pixel.
    pub fn is_empty(&self) -> bool {
        self.stretches.is_empty()
    }

    /// Appends pixels that lie behind all others.
    fn push(&mut self, pixels: Range<u64>) {
        match self.stretches.last_mut() {
            Some(last) if last.end == pixels.start => last.end = pixels.end,
            _ => self.stretches.push(pixels),
        }
    }
}

/// What an image shows of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct SeenObject {
    /// The object.
    pub object: u32,
    /// The number of its visible pixels, at least 1.
    pub visible_px: u64,
    /// The smallest rectangle of its visible pixels. In a panorama it may go on beyond the right border: then
    /// column x stands for column x − width of the image.
    pub visible_box: PixelBox,
    /// The distance between the camera and its nearest visible pixel, metres.
    pub nearest_m: f32,
    /// The median distance of its visible pixels, the lower one of two, metres.
    pub median_m: f32,
    /// The pixels that it would have if it stood alone: the amodal mask. All visible pixels are among them.
    pub mask: Mask,
    /// The smallest rectangle of those pixels, in a panorama as for `visible_box`.
    pub mask_box: PixelBox,
    /// The objects in front of it, and the number of its pixels that each hides; the most first.
    /// [`NO_OBJECT`] stands for surfaces that belong to none.
    pub hidden_by: Vec<(u32, u64)>,
    /// What a pinhole camera's image cuts off; `None` in a panorama.
    pub beyond: Option<Beyond>,
}

impl SeenObject {
    /// Returns the share of the object's pixels in the image that other objects hide, from 0 to below 1.
    pub fn occlusion(&self) -> f64 {
        1.0 - self.visible_px as f64 / self.mask.len() as f64
    }
}

/// How far an object goes on beyond the borders of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beyond {
    /// The least and the largest projection of its corners in pixels, within the image or not. `None` if it
    /// reaches to the side of the camera or behind it.
    pub bounds: Option<[DVec2; 2]>,
    /// The share of the object that lies outside of the image, from 0 to below 1. It is that of the samples
    /// of a grid over an image three times as wide and as high: what lies further out does not count.
    pub truncation: f64,
}

/// The most samples of the grid by which [`Beyond::truncation`] is measured.
const SAMPLES: f64 = 65_536.0;

/// Finds the objects in image after image, and keeps its memory between them. Each thread should hold one.
pub struct SeenObjects<'s, 'm> {
    scenes: &'s ObjectScenes<'m>,
    object_of_face: &'s [u32],
    /// The object that each pixel of the image shows.
    shown: Raster<u32>,
    /// The hits of an object that is drawn alone, and the memory of casting them.
    alone: Hits,
    scratch: Scratch,
}

impl<'s, 'm> SeenObjects<'s, 'm> {
    /// Returns a finder of objects. Face f of the mesh belongs to object `object_of_face[f]`.
    pub fn new(scenes: &'s ObjectScenes<'m>, object_of_face: &'s [u32]) -> Self {
        let shown = Raster::filled(0, 0, NO_OBJECT);
        Self { scenes, object_of_face, shown, alone: Hits::default(), scratch: Scratch::default() }
    }

    /// Returns the objects that an image shows, sorted. `hits` are those of `camera`, of every pixel.
    ///
    /// # Panics
    /// If `hits` are of another size, or of another mesh.
    pub fn find(&mut self, hits: &Hits, camera: &Camera) -> Vec<SeenObject> {
        let size = (camera.width, camera.height);
        assert_eq!((hits.face.width(), hits.face.height()), size, "hits of the camera");
        let object_of = |face: &u32| match *face {
            NO_FACE => NO_OBJECT,
            face => self.object_of_face[face as usize],
        };
        let mut shown = std::mem::replace(&mut self.shown, Raster::filled(0, 0, NO_OBJECT)).into_vec();
        shown.clear();
        shown.extend(hits.face.pixels().iter().map(object_of));
        self.shown = Raster::from_vec(size.0, size.1, shown);

        let visible = self.visible(hits, camera);
        visible
            .into_iter()
            .map(|(object, visible)| self.seen(object, visible, camera))
            .collect()
    }

    /// Gathers the visible pixels of each object.
    fn visible(&self, hits: &Hits, camera: &Camera) -> BTreeMap<u32, Visible> {
        let rays = camera.rays();
        let mut objects: BTreeMap<u32, Visible> = BTreeMap::new();
        for y in 0..camera.height {
            // Neighbours mostly show the same object.
            let mut x = 0;
            for same in self.shown.row(y).chunk_by(|a, b| a == b) {
                let end = x + same.len() as u32;
                if let Some(object) = same.first().filter(|object| **object != NO_OBJECT) {
                    objects.entry(*object).or_default().add(hits, &rays, x..end, y);
                }
                x = end;
            }
        }
        objects
    }

    /// Draws an object alone, and says what is seen of it.
    fn seen(&mut self, object: u32, mut visible: Visible, camera: &Camera) -> SeenObject {
        let mut mask = Mask { size: [camera.width, camera.height], stretches: Vec::new() };
        let mut columns = Columns::default();
        let mut hidden_by: BTreeMap<u32, u64> = BTreeMap::new();
        let mut beyond = None;

        if let Some(scene) = self.scenes.get(object) {
            let mut caster = Caster::reusing(scene, std::mem::take(&mut self.scratch));
            let mut parts = bounds::parts(camera, &scene.mesh().aabb());
            parts.sort_by_key(|part| part.x);
            for part in parts {
                caster.cast_part_into(camera, part, &mut self.alone);
                add_part(&self.alone, part, &mut mask, &mut columns);
                self.count_hiders(object, part, &mut hidden_by);
            }
            beyond = (!camera.is_panorama()).then(|| beyond_frame(&mut caster, camera, &mut self.alone));
            self.scratch = caster.into_scratch();
        }

        let mut hidden_by: Vec<(u32, u64)> = hidden_by.into_iter().collect();
        hidden_by.sort_by_key(|(object, pixels)| (Reverse(*pixels), *object));
        SeenObject {
            object,
            visible_px: visible.distances.len() as u64,
            visible_box: visible.columns.bounds(camera),
            nearest_m: visible.distances.iter().copied().fold(f32::INFINITY, f32::min),
            median_m: visible.median(),
            mask_box: columns.bounds(camera),
            mask,
            hidden_by,
            beyond,
        }
    }

    /// Counts what is shown where an object would be, in the part of the image that `alone` covers.
    fn count_hiders(&self, object: u32, part: PixelBox, hidden_by: &mut BTreeMap<u32, u64>) {
        for (row, y) in part.rows().enumerate() {
            let shown = &self.shown.row(y)[part.x as usize..];
            let pairs = shown.iter().zip(self.alone.face.row(row as u32));
            let mut hiders = pairs
                .filter(|(shown, face)| **face != NO_FACE && **shown != object)
                .peekable();
            // Neighbours mostly show the same object.
            while let Some((hider, _)) = hiders.next() {
                let mut pixels = 1;
                while hiders.next_if(|(other, _)| *other == hider).is_some() {
                    pixels += 1;
                }
                *hidden_by.entry(*hider).or_default() += pixels;
            }
        }
    }
}

/// How many columns are turned into a mask's order at once: a bit each.
const STRIPE: usize = u64::BITS as usize;

/// Appends the pixels of a part of the image in which something is hit. Masks are ordered by columns and hits
/// by rows, so a stripe of columns is turned at once.
fn add_part(hits: &Hits, part: PixelBox, mask: &mut Mask, columns: &mut Columns) {
    let height = u64::from(mask.size[1]);
    let mut stripe: Vec<u64> = Vec::with_capacity(part.height as usize);
    for first in (0..part.width as usize).step_by(STRIPE) {
        stripe.clear();
        let mut any = 0;
        for row in 0..part.height {
            let faces = hits.face.row(row).iter().skip(first).take(STRIPE);
            let bits = faces
                .enumerate()
                .fold(0, |bits, (k, face)| bits | u64::from(*face != NO_FACE) << k);
            stripe.push(bits);
            any |= bits;
        }

        for column in 0..STRIPE {
            if any >> column & 1 == 0 {
                continue;
            }
            let x = part.x + (first + column) as u32;
            let mut y = part.y;
            for same in stripe.chunk_by(|a, b| (a ^ b) >> column & 1 == 0) {
                let end = y + same.len() as u32;
                if same[0] >> column & 1 == 1 {
                    let start = u64::from(x) * height;
                    mask.push(start + u64::from(y)..start + u64::from(end));
                    columns.add(x..x + 1, y..end);
                }
                y = end;
            }
        }
    }
}

/// The visible pixels of an object.
#[derive(Default)]
struct Visible {
    /// The distance of each pixel, metres.
    distances: Vec<f32>,
    columns: Columns,
}

impl Visible {
    /// Adds pixels of a row.
    fn add(&mut self, hits: &Hits, rays: &Rays, columns: Range<u32>, y: u32) {
        self.columns.add(columns.clone(), y..y + 1);
        self.distances.extend(columns.map(|x| {
            let depth = f64::from(hits.depth.at(x, y));
            (depth * rays.at(x, y).length()) as f32
        }));
    }

    /// Returns the median distance.
    fn median(&mut self) -> f32 {
        let middle = self.distances.len().saturating_sub(1) / 2;
        match self.distances.get_mut(middle) {
            Some(_) => *self.distances.select_nth_unstable_by(middle, f32::total_cmp).1,
            None => f32::INFINITY,
        }
    }
}

/// The pixels of an object by column.
#[derive(Default)]
struct Columns {
    /// Whether a column has a pixel.
    is_used: Vec<bool>,
    /// The smallest rectangle of all pixels.
    bounds: Option<PixelBox>,
}

impl Columns {
    fn add(&mut self, columns: Range<u32>, rows: Range<u32>) {
        PixelBox::add(&mut self.bounds, &columns, &rows);
        let columns = columns.start as usize..columns.end as usize;
        if self.is_used.len() < columns.end {
            self.is_used.resize(columns.end, false);
        }
        self.is_used[columns].fill(true);
    }

    /// Returns the smallest rectangle. A panorama's leaves out its widest gap: it may go on beyond the right
    /// border.
    fn bounds(&self, camera: &Camera) -> PixelBox {
        let Some(bounds) = self.bounds else { return PixelBox::default() };
        if !camera.is_panorama() {
            return bounds;
        }

        let used: Vec<u32> = bounds.columns().filter(|x| self.is_used[*x as usize]).collect();
        // The gap around the border of the image is the first candidate.
        let around = camera.width - bounds.width;
        let gaps = used.array_windows().map(|[a, b]| (b - a - 1, *b));
        match gaps.rev().max_by_key(|(gap, _)| *gap) {
            Some((gap, first)) if gap > around => PixelBox { x: first, width: camera.width - gap, ..bounds },
            _ => bounds,
        }
    }
}

/// Measures how far an object goes on beyond the image of a pinhole camera.
fn beyond_frame(caster: &mut Caster<'_, '_>, camera: &Camera, alone: &mut Hits) -> Beyond {
    let mesh = caster.scene().mesh();
    let frame = dvec2(f64::from(camera.width), f64::from(camera.height));
    let corners = mesh.positions().iter().map(|corner| corner.as_dvec3());
    let bounds = bounds::projected(camera, corners);
    if let Some([low, high]) = bounds
        && low.min_element() >= 0.0
        && high.cmple(frame).all()
    {
        return Beyond { bounds, truncation: 0.0 };
    }

    // The part of the wide image that the object may cover, and a grid over it.
    let [low, high] = bounds.unwrap_or([-frame, 2.0 * frame]);
    let low = low.max(-frame);
    let size = high.min(2.0 * frame) - low;
    let step = (size.element_product() / SAMPLES).sqrt().max(1.0);
    let count = (size / step).ceil().max(DVec2::ONE);
    let grid = Camera {
        pose: camera.pose,
        projection: Projection::Pinhole {
            focal_px: camera.focal_px() / step,
            center_px: (camera.center_px() - low) / step,
        },
        width: count.x as u32,
        height: count.y as u32,
    };

    caster.cast_into(&grid, 1, alone);
    let mut all = 0u64;
    let mut inside = 0u64;
    for y in 0..grid.height {
        for x in 0..grid.width {
            if alone.face.at(x, y) == NO_FACE {
                continue;
            }
            let at = low + dvec2(f64::from(x) + 0.5, f64::from(y) + 0.5) * step;
            all += 1;
            inside += u64::from(at.min_element() >= 0.0 && at.cmplt(frame).all());
        }
    }
    // What is too small for the grid is in the image, since a pixel shows it.
    let truncation = if inside == 0 {
        0.0
    } else {
        1.0 - inside as f64 / all as f64
    };
    Beyond { bounds, truncation }
}
