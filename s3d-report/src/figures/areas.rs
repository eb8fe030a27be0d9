//! Meshes from above.

use super::sheet::{Align, INK, Picture, Point, SIZE, Sheet, WIDTH};
use super::{Book, Drawn};
use crate::error::Result;
use crate::faults::Faults;
use crate::index::RoomEntry;
use crate::poster::{Drawing, camera_of, class_colors, drawing, rooms_of, section};
use s3d_geom::glam::DVec3;
use s3d_geom::{Camera, Raster, TriMesh};
use std::collections::BTreeSet;

pub(super) const GAP: f32 = 6.0;
/// The pixels that a mesh is drawn in, before what is white around it is cut off, at 300 an inch.
const PIXELS: [u32; 2] = [1600, 1000];
/// White around a mesh, pixels.
const MARGIN: u32 = 8;
pub(super) const WHITE: [u8; 3] = [255; 3];

/// A mesh seen from above, below its ceilings.
pub(super) struct Above {
    camera: Camera,
    /// The pixels of the whole picture.
    size: [u32; 2],
    /// Its columns and rows that are not white: the first ones and their number.
    part: [[u32; 2]; 2],
}

impl Above {
    /// Returns the view, and the mesh in its own colours and in those of the faces' classes.
    pub(super) fn new(
        book: &Book<'_>,
        mesh: &TriMesh,
        rooms: &[RoomEntry],
        classes: Option<&[[u8; 3]]>,
    ) -> (Self, Picture, Option<Picture>) {
        let high = section(mesh, &rooms.iter().collect::<Vec<_>>());
        let size = PIXELS.map(|side| (side * book.dpi).div_ceil(300));
        let Drawing { own, classes } = drawing(mesh, classes, high, size, WHITE);

        let [width, height] = size;
        let ([mut x0, mut x1], [mut y0, mut y1]) = ([width, 0], [height, 0]);
        for (y, row) in (0..).zip(own.rows()) {
            for (x, _) in (0..).zip(row).filter(|(_, pixel)| **pixel != WHITE) {
                (x0, x1) = (x0.min(x), x1.max(x));
                (y0, y1) = (y0.min(y), y1.max(y));
            }
        }
        let [x0, y0] = [x0, y0].map(|k| k.saturating_sub(MARGIN));
        let part = if x1 > x0 && y1 > y0 {
            [[x0, y0], [width.min(x1 + MARGIN) - x0, height.min(y1 + MARGIN) - y0]]
        } else {
            [[0, 0], size]
        };
        let view = Self { camera: camera_of(mesh, high, size), size, part };
        let cut = |drawn: &Raster<[u8; 3]>| Picture { pixels: view.cut(drawn), is_photo: true };
        let pictures = (cut(&own), classes.as_ref().map(cut));
        (view, pictures.0, pictures.1)
    }

    /// Its height for each unit of its width.
    pub(super) fn aspect(&self) -> f32 {
        let [_, [w, h]] = self.part;
        h as f32 / w as f32
    }

    fn cut(&self, drawn: &Raster<[u8; 3]>) -> Raster<[u8; 3]> {
        let [[x0, y0], [w, h]] = self.part;
        let rows = drawn.rows().skip(y0 as usize).take(h as usize);
        let pixels = rows.flat_map(|row| row.iter().skip(x0 as usize).take(w as usize).copied());
        Raster::from_vec(w, h, pixels.collect())
    }

    /// Returns where points of the world are on a picture of this width that begins at a place.
    pub(super) fn project(&self, [left, top]: Point, width: f32) -> impl Fn(DVec3) -> Option<Point> + use<> {
        let camera = self.camera;
        let [[x0, y0], [w, _]] = self.part;
        let pixel = f64::from(self.size[0]) / f64::from(camera.width);
        let scale = f64::from(width) / f64::from(w);
        move |point| {
            let (at, _) = camera.project(point)?;
            let x = (at.x * pixel - f64::from(x0)) * scale;
            let y = (at.y * pixel - f64::from(y0)) * scale;
            Some([left + x as f32, top + y as f32])
        }
    }
}

/// Draws the mesh of an area from above, below its ceilings: in its colours, and in those of its classes.
pub(super) fn area(book: &Book<'_>, area: u32) -> Result<Option<Drawn>> {
    let Some(file) = book.data.mesh(area)? else { return Ok(None) };
    let mut faults = Faults::default();
    let rooms = rooms_of(book.data, area, &mut faults)?;
    let classes = class_colors(book.data, area, &mut faults)?;
    let (above, own, semantic) = Above::new(book, &file.mesh, &rooms, classes.as_deref());

    let legend = Legend::of(book, classes.iter().flatten().copied());
    let width = 0.5 * (WIDTH - GAP);
    let height = width * above.aspect();
    let mut sheet = Sheet::new(height + 1.6 * SIZE + legend.height());
    let pictures = [(Some(own), "textured mesh"), (semantic, "semantic mesh")];
    let shown = pictures
        .into_iter()
        .filter_map(|(picture, words)| Some((picture?, words)));
    for (i, (picture, words)) in shown.enumerate() {
        let x = i as f32 * (width + GAP);
        sheet.picture([x, 0.0], [width, height], picture);
        sheet.words([x + 0.5 * width, height + 1.2 * SIZE], Align::Middle, INK, words);
    }
    legend.draw(&mut sheet, height + 1.6 * SIZE);
    let caption =
        format!("Area {area} from above, opened below the ceilings of the storey with the most rooms.");
    Ok(Some(Drawn { name: format!("area_{area}"), caption, sheet }))
}

/// Classes and their colours, in lines.
pub(super) struct Legend {
    lines: Vec<Vec<(f32, &'static str, [u8; 3])>>,
}

impl Legend {
    /// Makes the legend of the classes that have one of these colours.
    pub(super) fn of(book: &Book<'_>, colors: impl Iterator<Item = [u8; 3]>) -> Self {
        let there: BTreeSet<[u8; 3]> = colors.collect();
        let font = Sheet::new(1.0);
        let (mut x, mut lines) = (0.0, Vec::<Vec<_>>::new());
        for (name, color) in book
            .images
            .classes()
            .into_iter()
            .filter(|(_, color)| there.contains(color))
        {
            // A box, a gap, the name, and room up to the next one.
            let length = font.length(name) + 3.0 * SIZE;
            match lines.last_mut().filter(|_| x + length <= WIDTH) {
                Some(line) => line.push((x, name, color)),
                None => {
                    x = 0.0;
                    lines.push(vec![(x, name, color)]);
                }
            }
            x += length;
        }
        Self { lines }
    }

    pub(super) fn height(&self) -> f32 {
        self.lines.len() as f32 * 1.6 * SIZE
    }

    /// Draws the legend below a height.
    pub(super) fn draw(&self, sheet: &mut Sheet, top: f32) {
        for (i, line) in self.lines.iter().enumerate() {
            let y = top + (i as f32 * 1.6 + 1.2) * SIZE;
            for (x, name, color) in line {
                sheet.fill([*x, y - 0.8 * SIZE], [SIZE, SIZE], *color);
                sheet.words([x + 1.5 * SIZE, y], Align::Left, INK, name);
            }
        }
    }
}
