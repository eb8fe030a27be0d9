//! Pictures on walls and screens. Each can be read only one way round, so that a mirrored or upside-down
//! texture shows at once.

use super::noise::{fractal, hash, mix, smooth, tint};
use super::textures::{image, to_bytes};
use s3d_geom::{
    Raster,
    glam::{Vec2, vec2},
};

type Color = [f32; 3];

/// A picture that is drawn on; x to the right and y down, pixels.
struct Canvas {
    width: u32,
    pixels: Vec<Color>,
}

impl Canvas {
    fn new(width: u32, height: u32, color: impl Fn(f32, f32) -> Color) -> Self {
        Self {
            width,
            pixels: (0..width * height)
                .map(|i| color((i % width) as f32, (i / width) as f32))
                .collect(),
        }
    }

    /// Blends `color` over each pixel, by the share that `cover` gives.
    fn cover(&mut self, color: Color, cover: impl Fn(Vec2) -> f32) {
        for (i, pixel) in self.pixels.iter_mut().enumerate() {
            let at = vec2((i as u32 % self.width) as f32, (i as u32 / self.width) as f32);
            *pixel = mix(*pixel, color, cover(at));
        }
    }

    fn rect(&mut self, low: [f32; 2], high: [f32; 2], color: Color) {
        self.cover(color, |p| {
            let is_inside = p.x >= low[0] && p.x < high[0] && p.y >= low[1] && p.y < high[1];
            if is_inside { 1.0 } else { 0.0 }
        });
    }

    fn disc(&mut self, center: [f32; 2], radius: f32, color: Color) {
        self.cover(color, |p| (radius + 0.5 - p.distance(Vec2::from_array(center))).clamp(0.0, 1.0));
    }

    /// A pen's line through `points`, each scaled by `scale` and moved by `origin`.
    fn line(&mut self, points: &[[f32; 2]], origin: [f32; 2], scale: f32, width: f32, color: Color) {
        let points: Vec<Vec2> = points
            .iter()
            .map(|&p| Vec2::from_array(origin) + Vec2::from_array(p) * scale)
            .collect();
        self.cover(color, |p| {
            let distance = points.windows(2).map(|ab| {
                let along = ab[1] - ab[0];
                let t = ((p - ab[0]).dot(along) / along.length_squared().max(1e-9)).clamp(0.0, 1.0);
                p.distance(ab[0] + along * t)
            });
            (0.5 * width + 0.5 - distance.fold(f32::MAX, f32::min)).clamp(0.0, 1.0)
        });
    }

    fn finish(self) -> Raster<[u8; 3]> {
        let height = self.pixels.len() as u32 / self.width;
        Raster::from_vec(self.width, height, self.pixels.into_iter().map(to_bytes).collect())
    }
}

// Letters in a box of one unit, y down.
const S: &[[f32; 2]] = &[
    [0.55, 0.46],
    [0.42, 0.36],
    [0.2, 0.36],
    [0.08, 0.46],
    [0.12, 0.6],
    [0.46, 0.72],
    [0.52, 0.86],
    [0.4, 0.98],
    [0.18, 0.98],
    [0.05, 0.88],
];
const THREE: &[[f32; 2]] = &[
    [0.05, 0.02],
    [0.56, 0.0],
    [0.26, 0.38],
    [0.52, 0.5],
    [0.58, 0.74],
    [0.42, 0.97],
    [0.16, 0.99],
    [0.02, 0.86],
];
const D: &[[f32; 2]] = &[
    [0.56, 0.0],
    [0.54, 0.98],
    [0.53, 0.82],
    [0.34, 0.99],
    [0.12, 0.94],
    [0.04, 0.72],
    [0.14, 0.46],
    [0.36, 0.38],
    [0.54, 0.54],
];
const ARROW: &[[f32; 2]] = &[[0.5, 1.0], [0.5, 0.0], [0.22, 0.3], [0.5, 0.0], [0.78, 0.3]];

const INK: Color = [38.0, 46.0, 70.0];
const RED: Color = [202.0, 48.0, 42.0];
const BLUE: Color = [36.0, 88.0, 190.0];
const GREEN: Color = [38.0, 138.0, 72.0];

fn board_white(x: f32, y: f32) -> Color {
    // Traces of wiped-away writing.
    tint([246.0, 248.0, 250.0], -10.0 * fractal(x / 90.0 + y / 150.0, y / 40.0, 64, 41))
}

/// The name in red, an arrow to the right of it, a sketch of a room with a camera in it, and notes.
pub(crate) fn whiteboard() -> Raster<[u8; 3]> {
    let mut c = Canvas::new(512, 280, board_white);
    for (letter, x) in [(S, 40.0), (THREE, 100.0), (D, 158.0)] {
        c.line(letter, [x, 34.0], 76.0, 7.0, RED);
    }

    c.line(&[[36.0, 126.0], [208.0, 120.0]], [0.0, 0.0], 1.0, 4.0, RED);
    c.line(
        &[[230.0, 84.0], [300.0, 78.0], [282.0, 66.0], [300.0, 78.0], [284.0, 94.0]],
        [0.0; 2],
        1.0,
        4.0,
        INK,
    );

    // The room in perspective, and rays into it.
    let near = [[330., 30.], [480., 24.], [484., 130.], [332., 134.], [330., 30.]];
    let far = [366., 56.];
    c.line(&near, [0.0; 2], 1.0, 3.0, BLUE);
    c.line(&[far, [444., 54.], [446., 106.], [366., 108.], far], [0.0; 2], 1.0, 3.0, BLUE);
    for (a, b) in [(near[0], far), (near[1], [444., 54.]), (near[2], [446., 106.]), (near[3], [366., 108.])] {
        c.line(&[a, b], [0.0; 2], 1.0, 3.0, BLUE);
    }
    c.disc([404.0, 84.0], 6.0, RED);
    for end in [[436., 62.], [440., 96.], [378., 100.]] {
        c.line(&[[404.0, 84.0], end], [0.0; 2], 1.0, 2.0, RED);
    }

    // Handwriting: a dot and a wavering line an item.
    for (row, length) in [150.0, 118.0, 164.0, 92.0].into_iter().enumerate() {
        let y = 162.0 + 26.0 * row as f32;
        c.disc([48.0, y], 4.0, GREEN);
        let wave: Vec<[f32; 2]> = (0..(length / 5.0) as u32)
            .map(|i| [64.0 + 5.0 * i as f32, y - 6.0 + 12.0 * hash(i, row as u32, 13)])
            .collect();
        c.line(&wave, [0.0; 2], 1.0, 2.5, INK);
    }

    // A rising curve over its axes.
    c.line(&[[300., 160.], [300., 256.], [478., 256.]], [0.0; 2], 1.0, 3.0, INK);
    c.line(
        &[[304., 246.], [350., 236.], [392., 204.], [430., 184.], [474., 172.]],
        [0.0; 2],
        1.0,
        4.0,
        GREEN,
    );
    c.finish()
}

/// A second board: a floor plan and its arrow to the north.
pub(crate) fn plan() -> Raster<[u8; 3]> {
    let mut c = Canvas::new(400, 240, board_white);
    c.line(&[[40., 40.], [280., 40.], [280., 200.], [40., 200.], [40., 40.]], [0.0; 2], 1.0, 4.0, INK);
    c.line(&[[40., 130.], [110., 130.]], [0.0; 2], 1.0, 4.0, INK);
    c.line(&[[150., 130.], [280., 130.]], [0.0; 2], 1.0, 4.0, INK);
    c.line(&[[180., 130.], [180., 40.]], [0.0; 2], 1.0, 4.0, INK);
    c.line(&[[110., 130.], [136., 100.]], [0.0; 2], 1.0, 3.0, RED);
    c.disc([100.0, 84.0], 7.0, RED);
    c.disc([232.0, 90.0], 7.0, BLUE);
    c.disc([150.0, 168.0], 7.0, GREEN);
    c.line(ARROW, [310.0, 50.0], 70.0, 5.0, RED);
    for (row, length) in [60.0, 44.0, 56.0].into_iter().enumerate() {
        let y = 160.0 + 18.0 * row as f32;
        c.line(&[[312.0, y], [312.0 + length, y - 2.0]], [0.0; 2], 1.0, 3.0, INK);
    }
    c.finish()
}

/// A board of this colour with chalk on it: the name, a line below it, and a triangle with its height.
pub(crate) fn chalkboard(ground: Color) -> Raster<[u8; 3]> {
    const CHALK: Color = [232.0, 232.0, 222.0];
    let wiped = |x: f32, y: f32| 26.0 * (fractal(x / 110.0, y / 50.0, 64, 47) - 0.4);
    let mut c = Canvas::new(400, 220, |x, y| tint(ground, wiped(x, y)));
    for (letter, x) in [(S, 36.0), (THREE, 92.0), (D, 146.0)] {
        c.line(letter, [x, 30.0], 70.0, 6.0, CHALK);
    }
    c.line(&[[34.0, 112.0], [196.0, 106.0]], [0.0; 2], 1.0, 4.0, CHALK);
    let corners = [[240.0, 180.0], [372.0, 180.0], [300.0, 60.0], [240.0, 180.0]];
    c.line(&corners, [0.0; 2], 1.0, 4.0, [240.0, 216.0, 120.0]);
    c.line(&[corners[2], [300.0, 180.0]], [0.0; 2], 1.0, 3.0, CHALK);
    for (row, length) in [140.0, 110.0].into_iter().enumerate() {
        let y = 140.0 + 28.0 * row as f32;
        let wave: Vec<[f32; 2]> = (0..(length / 6.0) as u32)
            .map(|i| [40.0 + 6.0 * i as f32, y - 7.0 + 14.0 * hash(i, row as u32, 48)])
            .collect();
        c.line(&wave, [0.0; 2], 1.0, 3.0, CHALK);
    }
    c.finish()
}

/// A cork board with sheets of paper and notes.
pub(crate) fn cork() -> Raster<[u8; 3]> {
    let mut c = Canvas::new(420, 270, |x, y| {
        let grain = 46.0 * (hash(x as u32 / 2, y as u32 / 2, 19) - 0.5);
        tint([188.0, 146.0, 98.0], grain + 24.0 * (fractal(x / 30.0, y / 30.0, 64, 20) - 0.5))
    });

    let sheets = [
        ([24., 22.], [74., 104.], [250.0, 249.0, 244.0]),
        ([122., 34.], [82., 60.], [250.0, 249.0, 244.0]),
        ([230., 20.], [64., 90.], [236.0, 242.0, 250.0]),
        ([330., 28.], [52., 52.], [250.0, 226.0, 112.0]),
        ([322., 104.], [52., 52.], [250.0, 168.0, 150.0]),
        ([134., 120.], [74., 106.], [250.0, 249.0, 244.0]),
        ([36., 156.], [62., 62.], [168.0, 222.0, 172.0]),
        ([236., 134.], [66., 94.], [252.0, 250.0, 246.0]),
    ];

    for (k, ([x, y], [w, h], color)) in sheets.into_iter().enumerate() {
        c.rect([x + 3.0, y + 3.0], [x + w + 3.0, y + h + 3.0], [140.0, 104.0, 68.0]);
        c.rect([x, y], [x + w, y + h], color);

        // Ragged lines of text, flush left, under a short heading.
        c.rect([x + 8.0, y + 12.0], [x + 0.6 * w, y + 17.0], INK);
        for row in 0..((h - 34.0) / 8.0) as u32 {
            let length = (w - 16.0) * (0.55 + 0.45 * hash(row, k as u32, 21));
            let top = y + 26.0 + 8.0 * row as f32;
            c.rect([x + 8.0, top], [x + 8.0 + length, top + 2.5], [140.0, 142.0, 150.0]);
        }
        c.disc([x + 0.5 * w, y + 5.0], 4.0, if k % 2 == 0 { RED } else { BLUE });
    }

    c.finish()
}

/// A poster with an arrow upwards, a bar on its left and lines of text below.
pub(crate) fn poster() -> Raster<[u8; 3]> {
    let mut c = Canvas::new(200, 280, |_, y| mix([244.0, 196.0, 84.0], [232.0, 112.0, 70.0], y / 280.0));
    c.rect([0.0, 0.0], [22.0, 280.0], [40.0, 62.0, 96.0]);
    c.disc([112.0, 110.0], 66.0, [250.0, 240.0, 214.0]);
    c.line(ARROW, [62.0, 62.0], 96.0, 14.0, [40.0, 62.0, 96.0]);
    for (row, length) in [136.0, 96.0, 118.0].into_iter().enumerate() {
        let y = 206.0 + 20.0 * row as f32;
        c.rect([38.0, y], [38.0 + length, y + 8.0], [40.0, 62.0, 96.0]);
    }
    c.finish()
}

/// Mountains over a lake: soft noise as in a photograph.
pub(crate) fn landscape() -> Raster<[u8; 3]> {
    image(384, 256, |x, y| {
        let sky = mix([120.0, 164.0, 212.0], [248.0, 214.0, 176.0], smooth(y / 130.0));
        let clouds = smooth((fractal(x / 90.0, y / 36.0, 64, 31) - 0.5) * 4.0);

        let mut color = mix(sky, [252.0, 244.0, 234.0], 0.7 * clouds * (1.0 - y / 160.0).max(0.0));
        for (k, (base, rise, tone)) in [
            (118.0, 78.0, [132.0, 146.0, 172.0]),
            (146.0, 62.0, [86.0, 106.0, 122.0]),
            (168.0, 40.0, [52.0, 76.0, 66.0]),
        ]
        .into_iter()
        .enumerate()
        {
            let ridge = base - rise * (fractal(x / 110.0 + 7.0 * k as f32, 0.3, 64, 33 + k as u32) - 0.25);
            let rock = 34.0 * (fractal(x / 14.0, y / 14.0, 64, 36) - 0.5);
            let snow = if k == 0 && y < ridge + 16.0 + 0.5 * rock {
                70.0
            } else {
                0.0
            };
            color = mix(color, tint(tone, rock + snow), smooth((y - ridge) / 2.0 + 0.5));
        }

        if y > 172.0 {
            let ripple = fractal(x / 60.0, y / 4.0, 64, 39);
            let water = mix([70.0, 104.0, 134.0], [206.0, 190.0, 170.0], smooth((ripple - 0.35) * 2.0));
            color = mix(water, [34.0, 52.0, 62.0], smooth((y - 190.0) / 90.0));
        }

        tint(color, 10.0 * (hash(x as u32, y as u32, 40) - 0.5))
    })
}

/// The view through a window: sky, clouds, and roofs that rise to the right.
pub(crate) fn sky() -> Raster<[u8; 3]> {
    image(320, 256, |x, y| {
        let blue = mix([112.0, 168.0, 232.0], [206.0, 228.0, 248.0], smooth(y / 200.0));
        let cloud = smooth((fractal(x / 80.0, y / 34.0, 64, 61) - 0.48) * 4.5);
        let mut color = mix(blue, [252.0, 253.0, 255.0], 0.85 * cloud);
        let trees = 214.0 - 12.0 * fractal(x / 22.0, 0.7, 64, 63);
        let house = 176.0 + 44.0 * hash(x as u32 / 40, 3, 64) - 0.08 * x;
        if y > house {
            let window = (x as u32 % 10) > 5 && (y as u32 % 14) > 8;
            let wall = mix([176.0, 160.0, 150.0], [204.0, 196.0, 186.0], hash(x as u32 / 40, 9, 65));
            color = if window { [120.0, 146.0, 172.0] } else { wall };
        }
        if y > trees {
            color = tint([92.0, 134.0, 84.0], 44.0 * (fractal(x / 9.0, y / 9.0, 64, 66) - 0.5));
        }
        color
    })
}

/// A text editor: a bar on the left, coloured lines.
pub(crate) fn editor() -> Raster<[u8; 3]> {
    let mut c = Canvas::new(240, 150, |_, _| [34.0, 38.0, 50.0]);
    c.rect([0.0, 0.0], [240.0, 9.0], [70.0, 78.0, 98.0]);
    c.rect([0.0, 9.0], [34.0, 150.0], [46.0, 52.0, 68.0]);
    let inks = [[126.0, 190.0, 236.0], [224.0, 224.0, 224.0], [238.0, 176.0, 104.0], [136.0, 206.0, 142.0]];
    for row in 0..16u32 {
        let y = 16.0 + 8.0 * row as f32;
        let mut x = 44.0 + 10.0 * (hash(row / 2, 1, 71) * 4.0).floor();
        for word in 0..2 + row % 4 {
            let length = 10.0 + 26.0 * hash(row, word, 72);
            c.rect([x, y], [x + length, y + 3.0], inks[((row + word) % 4) as usize]);
            x += length + 5.0;
        }
    }
    c.finish()
}

/// A slide: bars that grow to the right.
pub(crate) fn chart() -> Raster<[u8; 3]> {
    let mut c = Canvas::new(320, 180, |_, y| mix([24.0, 40.0, 74.0], [38.0, 62.0, 106.0], y / 180.0));
    c.rect([20.0, 16.0], [170.0, 28.0], [240.0, 244.0, 250.0]);
    c.rect([20.0, 34.0], [120.0, 40.0], [150.0, 172.0, 210.0]);
    for bar in 0..7u32 {
        let x = 28.0 + 38.0 * bar as f32;
        let height = 22.0 + 12.0 * bar as f32 + 10.0 * hash(bar, 0, 73);
        let color = if bar == 6 {
            [246.0, 178.0, 70.0]
        } else {
            [110.0, 178.0, 232.0]
        };
        c.rect([x, 164.0 - height], [x + 24.0, 164.0], color);
    }
    c.line(&[[20.0, 164.0], [304.0, 164.0]], [0.0; 2], 1.0, 2.0, [220.0, 228.0, 240.0]);
    c.finish()
}

/// Rows of keys, the long one in the lowest row.
pub(crate) fn keyboard() -> Raster<[u8; 3]> {
    image(180, 60, |x, y| {
        let row = (y / 12.0) as u32;
        let shift = [0.0, 3.0, 5.0, 8.0, 2.0][row as usize % 5];
        let space = row == 4 && (50.0..112.0).contains(&x);
        let gap = y.rem_euclid(12.0) < 2.0 || (!space && (x + shift).rem_euclid(12.0) < 2.0);
        let outside = !(3.0..177.0).contains(&x) || !(1.0..58.0).contains(&y);
        if gap || outside {
            [50.0, 52.0, 58.0]
        } else {
            [96.0, 100.0, 108.0]
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_tell_left_from_right_and_top_from_bottom() {
        for picture in
            [whiteboard(), plan(), cork(), poster(), landscape(), sky(), editor(), chart(), keyboard()]
                .into_iter()
                .chain([chalkboard([44.0, 88.0, 68.0])])
        {
            let w = picture.width();
            let h = picture.height();
            let differs = |other: &dyn Fn(u32, u32) -> (u32, u32)| {
                let all = (0..h).flat_map(|y| (0..w).map(move |x| (x, y)));
                all.filter(|&(x, y)| {
                    let a = other(x, y);
                    let b = picture.at(x, y);
                    picture.at(a.0, a.1).iter().zip(b).any(|(p, q)| p.abs_diff(q) > 24)
                })
                .count()
                    * 50
                    > (w * h) as usize
            };
            assert!(differs(&|x, y| (w - 1 - x, y)), "mirrored");
            assert!(differs(&|x, y| (x, h - 1 - y)), "upside down");
            assert!(differs(&|x, y| (w - 1 - x, h - 1 - y)), "turned");
        }
    }
}
