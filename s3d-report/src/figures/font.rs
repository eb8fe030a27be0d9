//! Words as outlines, so that a figure looks the same everywhere and needs no font.

use super::sheet::{Point, Step};
use ttf_parser::{Face, OutlineBuilder};

/// The font of figures: Ubuntu Light.
pub(super) struct Font {
    face: Face<'static>,
}

impl Font {
    pub(super) fn new() -> Self {
        let face = Face::parse(epaint_default_fonts::UBUNTU_LIGHT, 0);
        Self { face: face.expect("the font is a part of the program") }
    }

    fn scale(&self, size: f32) -> f32 {
        size / f32::from(self.face.units_per_em())
    }

    /// Returns the length of words at a size, points.
    pub(super) fn width(&self, words: &str, size: f32) -> f32 {
        words.chars().map(|c| self.advance(c)).sum::<f32>() * self.scale(size)
    }

    fn advance(&self, c: char) -> f32 {
        let glyph = self.face.glyph_index(c);
        f32::from(
            glyph
                .and_then(|glyph| self.face.glyph_hor_advance(glyph))
                .unwrap_or_default(),
        )
    }

    /// Returns the outlines of words whose base line begins at a point. Characters that the font does not
    /// have are left out.
    pub(super) fn path(&self, words: &str, size: f32, [x, y]: Point) -> Vec<Step> {
        let mut outline = Outline { scale: self.scale(size), start: [x, y], last: [x, y], path: Vec::new() };
        for c in words.chars() {
            if let Some(glyph) = self.face.glyph_index(c) {
                self.face.outline_glyph(glyph, &mut outline);
            }
            let [start, _] = &mut outline.start;
            *start += self.advance(c) * outline.scale;
        }
        outline.path
    }
}

/// Gathers outlines. Fonts have +y upwards.
struct Outline {
    scale: f32,
    /// Where the glyph's origin is.
    start: Point,
    last: Point,
    path: Vec<Step>,
}

impl Outline {
    fn at(&mut self, x: f32, y: f32) -> Point {
        let [left, base] = self.start;
        [left + x * self.scale, base - y * self.scale]
    }
}

impl OutlineBuilder for Outline {
    fn move_to(&mut self, x: f32, y: f32) {
        self.last = self.at(x, y);
        self.path.push(Step::Move(self.last));
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.last = self.at(x, y);
        self.path.push(Step::Line(self.last));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        // A curve of the second degree as one of the third.
        let (from, control, end) = (self.last, self.at(x1, y1), self.at(x, y));
        let towards = |[ax, ay]: Point| {
            let [cx, cy] = control;
            [ax + (cx - ax) * 2.0 / 3.0, ay + (cy - ay) * 2.0 / 3.0]
        };
        self.path.push(Step::Cubic(towards(from), towards(end), end));
        self.last = end;
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (first, second) = (self.at(x1, y1), self.at(x2, y2));
        self.last = self.at(x, y);
        self.path.push(Step::Cubic(first, second, self.last));
    }

    fn close(&mut self) {
        self.path.push(Step::Close);
    }
}
