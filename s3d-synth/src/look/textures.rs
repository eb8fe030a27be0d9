//! The images on furniture: patterns that repeat, and pictures (see `pictures`).

use super::noise::{fractal, hash, mix, smooth, tint, value};
use super::pictures;
use s3d_geom::Raster;
use std::sync::OnceLock;

/// An image that several surfaces may wear: a pattern that repeats, or a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Pattern {
    /// Oak, cut lengthwise; repeats.
    Oak,
    /// Walnut, cut lengthwise; repeats.
    Walnut,
    /// Woven, blue; repeats.
    BlueFabric,
    /// Woven, grey; repeats.
    GreyFabric,
    /// Woven, rust; repeats.
    RustFabric,
    /// Cardboard with a strip of tape; repeats.
    Cardboard,
    /// A row of spines; repeats.
    Books,
    /// Concrete; repeats.
    Concrete,
    /// A door leaf.
    Door,
    /// A rug with a border.
    Rug,
    /// The view through a window.
    Sky,
    /// A whiteboard that was written on.
    Whiteboard,
    /// A floor plan on a whiteboard.
    Plan,
    /// A cork board with notes.
    Cork,
    /// A poster.
    Poster,
    /// Mountains over a lake.
    Landscape,
    /// A screen with lines of code.
    Editor,
    /// A screen with a chart.
    Chart,
    /// The keys of a keyboard.
    Keyboard,
    /// A green board with chalk on it.
    GreenBoard,
    /// A black board with chalk on it.
    BlackBoard,
}

impl Pattern {
    /// A name for materials and texture files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Pattern::Oak => "oak",
            Pattern::Walnut => "walnut",
            Pattern::BlueFabric => "blue_fabric",
            Pattern::GreyFabric => "grey_fabric",
            Pattern::RustFabric => "rust_fabric",
            Pattern::Cardboard => "cardboard",
            Pattern::Books => "books",
            Pattern::Concrete => "concrete",
            Pattern::Door => "door",
            Pattern::Rug => "rug",
            Pattern::Sky => "sky",
            Pattern::Whiteboard => "whiteboard",
            Pattern::Plan => "plan",
            Pattern::Cork => "cork",
            Pattern::Poster => "poster",
            Pattern::Landscape => "landscape",
            Pattern::Editor => "editor",
            Pattern::Chart => "chart",
            Pattern::Keyboard => "keyboard",
            Pattern::GreenBoard => "green_board",
            Pattern::BlackBoard => "black_board",
        }
    }

    /// The size after which it repeats, metres.
    pub(crate) fn tile_m(self) -> [f32; 2] {
        match self {
            Pattern::Oak | Pattern::Walnut => [1.0, 0.5],
            Pattern::Books => [1.0, 0.3],
            Pattern::BlueFabric | Pattern::GreyFabric | Pattern::RustFabric => [0.5; 2],
            Pattern::Cardboard => [0.4; 2],
            _ => [1.0; 2],
        }
    }

    /// The image, drawn once in a process: drawing takes most of the time of a small building.
    pub(crate) fn image(self) -> &'static Raster<[u8; 3]> {
        static IMAGES: [OnceLock<Raster<[u8; 3]>>; Pattern::BlackBoard as usize + 1] =
            [const { OnceLock::new() }; Pattern::BlackBoard as usize + 1];
        IMAGES[self as usize].get_or_init(|| self.draw())
    }

    fn draw(self) -> Raster<[u8; 3]> {
        match self {
            Pattern::Oak => wood(&Wood::OAK),
            Pattern::Walnut => wood(&Wood::WALNUT),
            Pattern::BlueFabric => fabric([62.0, 96.0, 146.0]),
            Pattern::GreyFabric => fabric([112.0, 116.0, 122.0]),
            Pattern::RustFabric => fabric([186.0, 92.0, 58.0]),
            Pattern::Cardboard => cardboard(),
            Pattern::Books => books(),
            Pattern::Concrete => image(256, 256, |x, y| {
                let spots = if value(x / 5.0, y / 5.0, 51, 8) > 0.86 {
                    -16.0
                } else {
                    0.0
                };
                tint([186.0, 184.0, 178.0], 26.0 * (fractal(x / 64.0, y / 64.0, 4, 7) - 0.5) + spots)
            }),
            Pattern::Door => door(),
            Pattern::Rug => rug(),
            Pattern::Sky => pictures::sky(),
            Pattern::Whiteboard => pictures::whiteboard(),
            Pattern::Plan => pictures::plan(),
            Pattern::Cork => pictures::cork(),
            Pattern::Poster => pictures::poster(),
            Pattern::Landscape => pictures::landscape(),
            Pattern::Editor => pictures::editor(),
            Pattern::Chart => pictures::chart(),
            Pattern::Keyboard => pictures::keyboard(),
            Pattern::GreenBoard => pictures::chalkboard([44.0, 88.0, 68.0]),
            Pattern::BlackBoard => pictures::chalkboard([46.0, 48.0, 52.0]),
        }
    }
}

/// An image from the colour of each pixel, 0 to 255, x to the right and y down.
pub(crate) fn image(width: u32, height: u32, color: impl Fn(f32, f32) -> [f32; 3]) -> Raster<[u8; 3]> {
    let pixels = (0..width * height).map(|i| to_bytes(color((i % width) as f32, (i / width) as f32)));
    Raster::from_vec(width, height, pixels.collect())
}

pub(crate) fn to_bytes(color: [f32; 3]) -> [u8; 3] {
    color.map(|c| (c + 0.5).clamp(1.0, 255.0) as u8)
}

/// `image` made brighter or darker.
pub(crate) fn scaled(image: &Raster<[u8; 3]>, factor: f32) -> Raster<[u8; 3]> {
    image.map(|pixel| to_bytes(pixel.map(|c| f32::from(c) * factor)))
}

/// The colours of a wood.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wood {
    /// Between its rings: red, green and blue, 0 to 255.
    pub light: [f32; 3],
    /// On its rings: red, green and blue, 0 to 255.
    pub dark: [f32; 3],
}

impl Wood {
    /// Oak.
    pub const OAK: Self = Self { light: [214.0, 178.0, 130.0], dark: [178.0, 136.0, 88.0] };
    /// Walnut.
    pub const WALNUT: Self = Self { light: [142.0, 98.0, 66.0], dark: [92.0, 60.0, 40.0] };

    /// The colour at `along` and `across` the grain, metres; repeats after 1 m along and 0.5 m across.
    pub(crate) fn at(&self, along: f32, across: f32, seed: u32) -> [f32; 3] {
        // Rings cut lengthwise: waves across the grain, bent by slow noise along it.
        let slow = value(along * 4.0, across * 8.0, 4, seed);
        let bend = 4.0 * slow + 1.2 * fractal(along * 8.0, across * 16.0, 8, seed + 3);
        let wave = (across * 50.0 + bend).rem_euclid(1.0);
        let ring = smooth(wave / 0.75) * (1.0 - smooth((wave - 0.75) / 0.25));
        let fibre = value(along * 16.0, across * 384.0, 16, seed + 1);
        let color = mix(self.light, self.dark, 0.55 * ring + 0.25 * fibre);
        tint(color, 10.0 * (value(along * 4.0, across * 8.0, 4, seed + 2) - 0.5))
    }
}

fn wood(wood: &Wood) -> Raster<[u8; 3]> {
    image(256, 128, |x, y| wood.at(x / 256.0, y / 256.0, 11))
}

fn fabric(color: [f32; 3]) -> Raster<[u8; 3]> {
    image(128, 128, |x, y| {
        let weave = if (x as u32 / 2 + y as u32 / 2).is_multiple_of(2) {
            7.0
        } else {
            -7.0
        };
        let fleck = 14.0 * (hash(x as u32, y as u32, 5) - 0.5);
        tint(color, weave + fleck + 18.0 * (fractal(x / 32.0, y / 32.0, 4, 9) - 0.5))
    })
}

fn cardboard() -> Raster<[u8; 3]> {
    image(128, 128, |x, y| {
        // A strip of tape along the middle, flutes under the paper.
        let tape = (y - 64.0).abs() < 8.0;
        let flute = if (x as u32 % 6) < 2 { -5.0 } else { 2.0 };
        let base = if tape {
            [206.0, 178.0, 128.0]
        } else {
            [184.0, 144.0, 98.0]
        };
        tint(base, flute + 10.0 * (fractal(x / 32.0, y / 32.0, 4, 3) - 0.5))
    })
}

/// A row of spines, 1 m × 0.3 m, with lettering bands near their upper ends.
fn books() -> Raster<[u8; 3]> {
    const COVERS: [[f32; 3]; 8] = [
        [150.0, 46.0, 44.0],
        [44.0, 74.0, 122.0],
        [222.0, 212.0, 186.0],
        [52.0, 100.0, 74.0],
        [210.0, 150.0, 58.0],
        [70.0, 62.0, 66.0],
        [120.0, 140.0, 164.0],
        [236.0, 234.0, 228.0],
    ];

    let mut spines = Vec::new();
    let mut left = 0;
    let mut k = 0;
    while left < 512 {
        let width = 11 + (hash(k, 1, 77) * 16.0) as u32;
        let right = if 512 - left < width + 11 { 512 } else { left + width };
        spines.push((left, right, k));
        (left, k) = (right, k + 1);
    }

    image(512, 160, |x, y| {
        let book = spines.iter().find(|(_, right, _)| (x as u32) < *right);
        let &(left, right, k) = book.unwrap_or(&spines[0]);
        let across = (x - left as f32 + 0.5) / (right - left) as f32;
        let cover = COVERS[(hash(k, 2, 77) * 8.0) as usize];

        // Round backs are brighter in their middle, and a gap of shadow parts the books.
        let off = (2.0 * across - 1.0) * (2.0 * across - 1.0);
        let round = 1.0 - 0.5 * off * off;

        let band_top = 18.0 + 24.0 * hash(k, 3, 77);
        let in_band = y > band_top && y < band_top + 9.0;
        let in_title = y > band_top + 16.0
            && y < band_top + 16.0 + 60.0 * hash(k, 4, 77)
            && (across - 0.5).abs() < 0.16
            && hash(0, y as u32 / 4, k) > 0.25;

        let ink = if cover[0] > 190.0 {
            [70.0, 60.0, 60.0]
        } else {
            [236.0, 222.0, 170.0]
        };
        let color = if in_band || in_title { ink } else { cover };
        tint(color.map(|c| c * round), 8.0 * (hash(x as u32, y as u32, 6) - 0.5))
    })
}

/// A door leaf 0.9 m × 2.1 m: veneer with two panels and a metal plate at the foot.
fn door() -> Raster<[u8; 3]> {
    image(180, 420, |x, y| {
        let color =
            Wood { light: [196.0, 148.0, 102.0], dark: [160.0, 112.0, 72.0] }.at(y / 256.0, x / 256.0, 23);
        let inside = |top: f32, bottom: f32| {
            let d = (x - 28.0).min(152.0 - x).min(y - top).min(bottom - y);
            if d < 0.0 {
                0.0
            } else if d < 5.0 {
                -34.0
            } else {
                -8.0
            }
        };
        if y > 380.0 && y < 412.0 && (8.0..172.0).contains(&x) {
            tint([170.0, 172.0, 174.0], 8.0 * (hash(0, y as u32, 4) - 0.5))
        } else {
            tint(color, inside(30.0, 190.0) + inside(220.0, 366.0))
        }
    })
}

/// A rug of 2.5 m × 2.1 m with a border and a diamond off its middle.
fn rug() -> Raster<[u8; 3]> {
    image(250, 210, |x, y| {
        let edge = x.min(249.0 - x).min(y).min(209.0 - y);
        let diamond = (x - 95.0).abs() / 60.0 + (y - 105.0).abs() / 62.0;
        let color = match edge {
            e if e < 5.0 => [226.0, 212.0, 184.0],
            e if e < 14.0 => [150.0, 62.0, 48.0],
            e if e < 18.0 => [226.0, 212.0, 184.0],
            _ if diamond < 0.55 => [214.0, 164.0, 86.0],
            _ if diamond < 1.0 => [226.0, 212.0, 184.0],
            _ if (x + 2.0 * y).rem_euclid(42.0) < 6.0 => [70.0, 92.0, 118.0],
            _ => [48.0, 66.0, 92.0],
        };
        tint(color, 26.0 * (hash(x as u32, y as u32, 8) - 0.5))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(a: [u8; 3], b: [u8; 3]) -> i32 {
        i32::from(a[0].abs_diff(b[0]))
    }

    #[test]
    fn tiles_meet_at_their_edges() {
        for pattern in [Pattern::Oak, Pattern::Concrete, Pattern::BlueFabric] {
            let image = pattern.image();
            let w = image.width();
            let h = image.height();
            let inner: i32 = (0..h).map(|y| step(image.at(w / 2 - 1, y), image.at(w / 2, y))).sum();
            let seam: i32 = (0..h).map(|y| step(image.at(w - 1, y), image.at(0, y))).sum();
            assert!(seam < 2 * inner + 2 * h as i32, "{pattern:?}: {seam} across the seam, {inner} within");
        }
    }

    #[test]
    fn a_seen_pixel_is_never_black() {
        let black = Raster::filled(2, 2, [0; 3]);
        assert_eq!(scaled(&black, 1.0).at(0, 0), [1; 3]);
        assert_eq!(scaled(&Raster::filled(1, 1, [200; 3]), 2.0).at(0, 0), [255; 3]);
    }
}
