//! The page's own colours of classes, for pictures.
//!
//! The page chooses them in `web/src/palette.ts`, by the same steps. The words and numbers of both are in
//! `src/poster/palette.json`, and the colours that both must choose in `tests/palette.json`.

use serde::Deserialize;
use std::sync::LazyLock;

type Rgb = [u8; 3];
type Matrix = [[f64; 3]; 3];

/// The words and numbers that the page and the poster share.
#[derive(Deserialize)]
struct Rules {
    missing: Rgb,
    unlabelled: Rgb,
    building: Vec<Part>,
    calm: Calm,
    strong: Strong,
    lightness_step: f64,
    rounds: usize,
    many: usize,
    eyes: Vec<Matrix>,
}

/// A part of a building, by the last words of its classes' names.
#[derive(Deserialize)]
struct Part {
    words: Vec<String>,
    lightness: [f64; 2],
}

/// The choices for parts of a building.
#[derive(Deserialize)]
struct Calm {
    chroma: Vec<f64>,
    hue_step: u16,
}

/// The choices for things.
#[derive(Deserialize)]
struct Strong {
    chroma: Vec<f64>,
    hue_step: u16,
    lightness: [f64; 2],
}

static RULES: LazyLock<Rules> = LazyLock::new(|| {
    let text = include_str!("palette.json");
    serde_json::from_str(text).expect("the rules are a part of the program")
});

/// White D65.
const XYZ_FROM_RGB: Matrix = [
    [0.412_456_4 / 0.950_47, 0.357_576_1 / 0.950_47, 0.180_437_5 / 0.950_47],
    [0.212_672_9, 0.715_152_2, 0.072_175],
    [0.019_333_9 / 1.088_83, 0.119_192 / 1.088_83, 0.950_304_1 / 1.088_83],
];

/// Steps of a unit of CIELAB. Whole numbers of them are compared, which are the same on every machine.
const STEPS: f64 = 1024.0;

/// The difference from what has no colour yet.
const FAR: i64 = i64::MAX;

/// A colour that a class may have.
struct Candidate {
    color: Rgb,
    seen: Vec<[i64; 3]>,
}

/// Returns the colour of surface without a label.
pub(crate) fn unlabelled() -> Rgb {
    RULES.unlabelled
}

/// Returns the colours of classes with these names, a colour for each.
pub(crate) fn palette_of(names: &[impl AsRef<str>]) -> Vec<Rgb> {
    // The candidates for each part of a building, and for things.
    let Rules { calm, strong, .. } = &*RULES;
    let of_parts = RULES.building.iter();
    let mut groups: Vec<Vec<Candidate>> = of_parts
        .map(|part| candidates(part.lightness, &calm.chroma, calm.hue_step))
        .collect();
    let things = groups.len();
    groups.push(candidates(strong.lightness, &strong.chroma, strong.hue_step));
    let group_of: Vec<usize> = names
        .iter()
        .map(|name| part_of(name.as_ref()).unwrap_or(things))
        .collect();

    // The building first: it has fewer colours to choose from.
    let mut order: Vec<usize> = (0..names.len()).collect();
    order.sort_by_key(|i| group_of.get(*i) == Some(&things));

    // Chosen once, the colours are improved in further rounds, unless they are many.
    let rounds = if names.len() > RULES.many { 0 } else { RULES.rounds };
    let mut chosen = Chosen::new(&groups, names.len());
    for _ in 0..=rounds {
        for &name in &order {
            chosen.choose(name, group_of.get(name).copied().unwrap_or(things));
        }
    }
    chosen.colors
}

/// The colours of classes so far.
struct Chosen<'a> {
    groups: &'a [Vec<Candidate>],
    colors: Vec<Rgb>,
    /// By group and candidate: the differences from the colours so far, and then from what is no class.
    differences: Vec<Vec<Vec<i64>>>,
}

impl<'a> Chosen<'a> {
    fn new(groups: &'a [Vec<Candidate>], classes: usize) -> Self {
        let others = [RULES.missing, RULES.unlabelled].map(seen_by);
        let row = |candidate: &Candidate| {
            let from_others = others.iter().map(|other| difference(&candidate.seen, other));
            std::iter::repeat_n(FAR, classes).chain(from_others).collect()
        };
        let differences = groups.iter().map(|group| group.iter().map(row).collect());
        Self { groups, colors: vec![RULES.unlabelled; classes], differences: differences.collect() }
    }

    /// Gives a class the candidate that is the farthest from all other colours, the first of equals.
    fn choose(&mut self, class: usize, group: usize) {
        let others = |row: &[i64]| {
            let others = row.iter().enumerate().filter(|(i, _)| *i != class);
            others.map(|(_, difference)| *difference).min()
        };
        let (Some(candidates), Some(rows)) = (self.groups.get(group), self.differences.get(group)) else {
            return;
        };
        let from_last = candidates.iter().zip(rows).rev();
        let farthest = from_last.max_by_key(|(_, row)| others(row));
        let Some((best, _)) = farthest else { return };

        if let Some(color) = self.colors.get_mut(class) {
            *color = best.color;
        }
        let all = self.groups.iter().flatten().zip(self.differences.iter_mut().flatten());
        for (candidate, row) in all {
            if let Some(entry) = row.get_mut(class) {
                *entry = difference(&candidate.seen, &best.seen);
            }
        }
    }
}

/// Returns the part of a building that a class is, by the last word of its name. `None` for things.
fn part_of(name: &str) -> Option<usize> {
    let name = name.to_lowercase();
    let word = name.rsplit([' ', '_', '-']).next()?;
    let word = word.strip_suffix('s').unwrap_or(word);
    RULES
        .building
        .iter()
        .position(|part| part.words.iter().any(|of| of == word))
}

/// Returns colours in even steps of lightness and hue, as far as sRGB has them.
fn candidates([low, high]: [f64; 2], chromas: &[f64], hue_step: u16) -> Vec<Candidate> {
    let mut found = Vec::new();
    let mut lightness = low;
    while lightness <= high + 1e-9 {
        for chroma in chromas {
            for hue in (0..360).step_by(hue_step.into()) {
                let color = oklch(lightness, *chroma, f64::from(hue));
                if color.iter().all(|c| (1..255).contains(c)) {
                    found.push(Candidate { color, seen: seen_by(color) });
                }
            }
        }
        lightness += RULES.lightness_step;
    }
    found
}

/// Returns a colour of OKLCH (B. Ottosson, 2020), clipped to sRGB.
fn oklch(lightness: f64, chroma: f64, hue_deg: f64) -> Rgb {
    let hue = (hue_deg * std::f64::consts::PI) / 180.0;
    let [a, b] = [chroma * hue.cos(), chroma * hue.sin()];
    let cube = |root: f64| root * root * root;
    let l = cube(lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b);
    let m = cube(lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b);
    let s = cube(lightness - 0.089_484_177_5 * a - 1.291_485_548 * b);
    let linear = [
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701 * s,
    ];
    linear.map(|c| {
        let v = if c <= 0.003_130_8 {
            12.92 * c
        } else {
            1.055 * c.powf(1.0 / 2.4) - 0.055
        };
        (255.0 * v.clamp(0.0, 1.0)).round() as u8
    })
}

/// Returns a colour as four kinds of eyes see it: CIELAB, in steps.
fn seen_by(color: Rgb) -> Vec<[i64; 3]> {
    let linear = color.map(|byte| {
        let c = f64::from(byte) / 255.0;
        if c <= 0.04045 {
            c / 12.92
        } else {
            ((c + 0.055) / 1.055).powf(2.4)
        }
    });
    RULES.eyes.iter().map(|eyes| lab(times(eyes, linear))).collect()
}

/// Returns CIELAB of linear sRGB, in steps.
fn lab(linear: [f64; 3]) -> [i64; 3] {
    let clipped = linear.map(|c| c.clamp(0.0, 1.0));
    let [x, y, z] = times(&XYZ_FROM_RGB, clipped).map(|t| {
        if t > 216.0 / 24389.0 {
            t.cbrt()
        } else {
            24389.0 / 27.0 / 116.0 * t + 16.0 / 116.0
        }
    });
    let steps = |value: f64| (STEPS * value + 0.5).floor() as i64;
    [steps(116.0 * y - 16.0), steps(500.0 * (x - y)), steps(200.0 * (y - z))]
}

fn times(matrix: &Matrix, [x, y, z]: [f64; 3]) -> [f64; 3] {
    matrix.map(|[a, b, c]| a * x + b * y + c * z)
}

/// Returns the square of the least difference (CIE76) of two colours for any of these eyes, in steps.
fn difference(a: &[[i64; 3]], b: &[[i64; 3]]) -> i64 {
    let of_eyes = a.iter().zip(b).map(|(p, q)| {
        let of_axes = p.iter().zip(q).map(|(p, q)| (p - q) * (p - q));
        of_axes.sum()
    });
    of_eyes.min().unwrap_or(FAR)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Deserialize)]
    struct Golden {
        names: Vec<String>,
        colors: Vec<Rgb>,
    }

    #[test]
    fn colours_are_the_pages() {
        let golden = include_str!("../../tests/palette.json");
        let golden: Vec<Golden> = serde_json::from_str(golden).unwrap();
        assert!(golden.len() >= 4);
        for Golden { names, colors } in golden {
            assert_eq!(palette_of(&names), colors, "{names:?}");
        }
    }

    #[test]
    fn parts_of_a_building_are_known_by_their_last_words() {
        let is_part = |name| part_of(name).is_some();
        let parts = ["wall", "Walls", "glass wall", "kitchen_floor", "roof-Beam", "STAIRS"];
        let things = ["wallpaper", "walls of fame", "floor lamp", "", "s", "ceilingss", "<UNK>", "Wände"];
        assert!(parts.into_iter().all(is_part) && !things.into_iter().any(is_part));
        assert_eq!(part_of("ceiling"), part_of("flat roofs"));
        assert_ne!(part_of("ceiling"), part_of("wall"));
    }
}
