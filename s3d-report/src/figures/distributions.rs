//! The angles of views against the paper's distributions.

use super::sheet::{Align, GREY, INK, SIZE, Sheet, Stroke, WIDTH};
use super::{Book, Drawn};
use s3d_io::dataset::ViewRecord;
use std::f64::consts::PI;

const GAP: f32 = 18.0;
const HEIGHT: f32 = 100.0;
/// The words beside and below a diagram.
const LEFT: f32 = 26.0;
const BELOW: f32 = 3.2 * SIZE;
/// All candidates, and those that were kept.
const ALL: [u8; 3] = [205, 205, 205];
const KEPT: [u8; 3] = [90, 125, 165];
const BINS: usize = 24;

/// A distribution.
struct Panel {
    words: &'static str,
    /// Degrees.
    range: [f64; 2],
    ticks: [f64; 3],
    angle_rad: fn(&ViewRecord) -> f64,
    /// The paper's density, by degree.
    density: fn(f64) -> f64,
}

fn gaussian(x: f64, mean: f64, deviation: f64) -> f64 {
    let z = (x - mean) / deviation;
    libm::exp(-0.5 * z * z) / (deviation * (2.0 * PI).sqrt())
}

const PANELS: [Panel; 3] = [
    Panel {
        words: "yaw",
        range: [-180.0, 180.0],
        ticks: [-180.0, 0.0, 180.0],
        angle_rad: |view| {
            let turn = view.yaw_rad.rem_euclid(2.0 * PI);
            if turn < PI { turn } else { turn - 2.0 * PI }
        },
        density: |_| 1.0 / 360.0,
    },
    Panel {
        words: "pitch",
        range: [-60.0, 60.0],
        ticks: [-45.0, 0.0, 45.0],
        angle_rad: |view| view.pitch_rad,
        density: |x| gaussian(x, 0.0, 15.0),
    },
    Panel {
        words: "field of view",
        range: [10.0, 75.0],
        ticks: [15.0, 45.0, 75.0],
        angle_rad: |view| view.fov_rad,
        density: |x| 2.0 * gaussian(x, 75.0, 30.0),
    },
];

/// Draws the distributions of all candidates and of the views that were kept, with the paper's curves.
pub(super) fn distributions(book: &Book<'_>) -> Option<Drawn> {
    let candidates = &book.candidates;
    if candidates.is_empty() {
        return None;
    }
    let width = (WIDTH - GAP * (PANELS.len() - 1) as f32) / PANELS.len() as f32;
    let mut sheet = Sheet::new(HEIGHT + BELOW + 1.6 * SIZE);
    for (i, panel) in PANELS.iter().enumerate() {
        panel.draw(&mut sheet, i as f32 * (width + GAP), width, candidates);
    }

    let kept = candidates.iter().filter(|view| view.frame_num.is_some()).count();
    let y = HEIGHT + BELOW + SIZE;
    let mut x = LEFT;
    for (color, words) in [(ALL, format!("{} candidates", candidates.len())), (KEPT, format!("{kept} kept"))]
    {
        sheet.fill([x, y - 0.8 * SIZE], [SIZE, SIZE], color);
        sheet.words([x + 1.5 * SIZE, y], Align::Left, INK, &words);
        x += sheet.length(&words) + 4.0 * SIZE;
    }
    sheet.line(&[[x, y - 0.4 * SIZE], [x + 1.2 * SIZE, y - 0.4 * SIZE]], Stroke::new(INK, 1.0));
    sheet.words([x + 1.8 * SIZE, y], Align::Left, INK, "the paper's distribution");

    let caption =
        "How yaw, pitch and field of view of the candidates and of the kept views are distributed, \
                   with the distributions that they are drawn from."
            .into();
    Some(Drawn { name: "distributions".into(), caption, sheet })
}

impl Panel {
    fn draw(&self, sheet: &mut Sheet, left: f32, width: f32, views: &[ViewRecord]) {
        let [low, high] = self.range;
        let step = (high - low) / BINS as f64;
        let mut counts = [[0_u64; 2]; BINS];
        for view in views {
            let bin = (((self.angle_rad)(view).to_degrees() - low) / step).floor();
            // What lies outside is counted at the end.
            let bin = bin.clamp(0.0, (BINS - 1) as f64) as usize;
            if let Some([all, kept]) = counts.get_mut(bin) {
                *all += 1;
                *kept += u64::from(view.frame_num.is_some());
            }
        }

        // Shares of the candidates, so that what was dropped is seen.
        let share = |n: u64| n as f64 / views.len() as f64;
        let expected = |degrees: f64| (self.density)(degrees) * step;
        let middles = || (0..BINS).map(|bin| low + (bin as f64 + 0.5) * step);
        let largest = counts.iter().map(|[all, _]| share(*all)).chain(middles().map(expected));
        let top = 1.1 * largest.fold(0.0, f64::max);
        let (x0, width) = (left + LEFT, width - LEFT);
        let x_of = |degrees: f64| x0 + ((degrees - low) / (high - low)) as f32 * width;
        let y_of = |share: f64| HEIGHT * (1.0 - (share / top) as f32);

        let bar = width / BINS as f32;
        for (bin, [all, kept]) in counts.iter().enumerate() {
            let x = x0 + bin as f32 * bar;
            for (n, color) in [(*all, ALL), (*kept, KEPT)] {
                let y = y_of(share(n));
                sheet.fill([x + 0.3, y], [bar - 0.6, HEIGHT - y], color);
            }
        }
        let steps = (0..=4 * BINS).map(|i| low + i as f64 * step / 4.0);
        let known = steps.filter(|degrees| expected(*degrees) > 0.0);
        let curve: Vec<_> = known.map(|degrees| [x_of(degrees), y_of(expected(degrees))]).collect();
        sheet.line(&curve, Stroke::new(INK, 1.0));

        sheet.line(&[[x0, HEIGHT], [x0 + width, HEIGHT]], Stroke::new(GREY, 0.5));
        for tick in self.ticks {
            let x = x_of(tick);
            sheet.line(&[[x, HEIGHT], [x, HEIGHT + 2.5]], Stroke::new(GREY, 0.5));
            let words = format!("{}°", tick).replace('-', "−");
            let align = if tick <= low {
                Align::Left
            } else if tick >= high {
                Align::Right
            } else {
                Align::Middle
            };
            sheet.words([x, HEIGHT + 1.4 * SIZE], align, INK, &words);
        }
        sheet.words([x0 + 0.5 * width, HEIGHT + 2.6 * SIZE], Align::Middle, INK, self.words);
        for part in [0.5, 1.0] {
            let at = top / 1.1 * part;
            sheet.line(&[[x0 - 2.5, y_of(at)], [x0, y_of(at)]], Stroke::new(GREY, 0.5));
            let words = format!("{:.1} %", at * 100.0);
            sheet.words([x0 - 4.0, y_of(at) + 0.35 * SIZE], Align::Right, INK, &words);
        }
    }
}
