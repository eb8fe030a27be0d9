//! A page of pictures, lines and words, which is written as PDF and as PNG alike.

use super::font::Font;
use s3d_geom::Raster;

/// Black that is calm on white paper.
pub(super) const INK: [u8; 3] = [34, 34, 34];
/// Lines and words that stand back.
pub(super) const GREY: [u8; 3] = [120, 120, 120];
/// The width of a page of two columns, points.
pub(super) const WIDTH: f32 = 504.0;
/// The size of words, points.
pub(super) const SIZE: f32 = 8.0;
/// An inch, points.
pub(super) const INCH: f32 = 72.0;

/// A place on a page: points of 1/72 inch, from the upper left corner to the right and down.
pub(super) type Point = [f32; 2];

/// A page.
pub(super) struct Sheet {
    pub(super) size: Point,
    /// From the lowest to the uppermost.
    pub(super) items: Vec<Item>,
    font: Font,
}

/// A thing on a page.
pub(super) enum Item {
    /// A picture, with the place of its upper left corner and its size.
    Picture { at: Point, size: Point, picture: Picture },
    /// A filled shape.
    Fill { path: Vec<Step>, color: [u8; 3] },
    /// A line.
    Line { path: Vec<Step>, stroke: Stroke },
}

/// The pixels of a picture.
#[derive(Clone)]
pub(super) struct Picture {
    pub(super) pixels: Raster<[u8; 3]>,
    /// A photograph, whose pixels may change a little, and no labels.
    pub(super) is_photo: bool,
}

/// A step of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// The first point of a piece.
    Move(Point),
    Line(Point),
    /// Two control points and the end.
    Cubic(Point, Point, Point),
    /// Back to the first point of the piece.
    Close,
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stroke {
    pub(super) color: [u8; 3],
    /// Points.
    pub(super) width: f32,
    /// The lengths of dashes and of the gaps between them, points; `None` for a whole line.
    pub(super) dashes: Option<[f32; 2]>,
}

impl Stroke {
    /// A whole line.
    pub(super) fn new(color: [u8; 3], width: f32) -> Self {
        Self { color, width, dashes: None }
    }
}

/// Where words stand from their place.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Align {
    Left,
    Middle,
    Right,
}

impl Sheet {
    /// Makes a white page of this height, points.
    pub(super) fn new(height: f32) -> Self {
        Self { size: [WIDTH, height], items: Vec::new(), font: Font::new() }
    }

    /// Draws a picture.
    pub(super) fn picture(&mut self, at: Point, size: Point, picture: Picture) {
        self.items.push(Item::Picture { at, size, picture });
    }

    /// Draws a line through points.
    pub(super) fn line(&mut self, points: &[Point], stroke: Stroke) {
        self.items.push(Item::Line { path: path_of(points), stroke });
    }

    /// Draws the edges of a box.
    pub(super) fn frame(&mut self, at: Point, size: Point, stroke: Stroke) {
        let mut path = path_of(&corners(at, size));
        path.push(Step::Close);
        self.items.push(Item::Line { path, stroke });
    }

    /// Fills a box.
    pub(super) fn fill(&mut self, at: Point, size: Point, color: [u8; 3]) {
        let mut path = path_of(&corners(at, size));
        path.push(Step::Close);
        self.items.push(Item::Fill { path, color });
    }

    /// Writes words. `at` is on their base line.
    pub(super) fn words(&mut self, at: Point, align: Align, color: [u8; 3], words: &str) {
        let width = self.font.width(words, SIZE);
        let [x, y] = at;
        let start = match align {
            Align::Left => x,
            Align::Middle => x - 0.5 * width,
            Align::Right => x - width,
        };
        let path = self.font.path(words, SIZE, [start, y]);
        self.items.push(Item::Fill { path, color });
    }

    /// The length of words, points.
    pub(super) fn length(&self, words: &str) -> f32 {
        self.font.width(words, SIZE)
    }
}

fn corners([x, y]: Point, [w, h]: Point) -> [Point; 4] {
    [[x, y], [x + w, y], [x + w, y + h], [x, y + h]]
}

fn path_of(points: &[Point]) -> Vec<Step> {
    let step = |(i, point): (usize, &Point)| if i == 0 { Step::Move(*point) } else { Step::Line(*point) };
    points.iter().enumerate().map(step).collect()
}
