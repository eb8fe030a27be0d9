//! The direction in which a panorama is looked at first: the one that shows the most.

use std::collections::BTreeMap;

/// The columns and rows of a panorama that are looked at.
const COLUMNS: usize = 120;
const ROWS: usize = 7;

/// A look is so wide and high, in degrees, and its middle is a little above the horizon.
const WIDE_DEG: f64 = 84.0;
const HIGH_DEG: f64 = 46.0;
const ABOVE: f64 = 0.42;

/// The number of looks that are compared.
const LOOKS: usize = 24;

/// The weights of the median distance, and of the distance of what is near, beside the entropy.
const MEDIAN: f64 = 0.5;
const NEAR: f64 = 0.4;

/// Straight ahead is chosen if it is worth this share of the best look.
const ALMOST: f64 = 0.97;

/// A pixel of a panorama. What is not known or not seen is `None`.
#[derive(Clone, Copy)]
pub(crate) struct Sample {
    pub(crate) depth_m: Option<f64>,
    pub(crate) class: Option<usize>,
}

/// Returns the direction that shows the most classes and depth, in degrees to the right of the centre column.
/// `at` returns a pixel by its place, in shares of the width and the height.
pub(crate) fn first_look(at: impl Fn(f64, f64) -> Sample) -> f64 {
    let column = |i: usize| {
        let u = (i as f64 + 0.5) / COLUMNS as f64;
        let at = &at;
        (0..ROWS).map(move |j| at(u, 0.5 + HIGH_DEG / 180.0 * ((j as f64 + 0.5) / ROWS as f64 - ABOVE)))
    };
    let columns: Vec<Vec<Sample>> = (0..COLUMNS).map(|i| column(i).collect()).collect();

    let half = (WIDE_DEG / 360.0 * COLUMNS as f64 / 2.0).round() as usize;
    let worths = (0..LOOKS).map(|look| {
        let first = look * COLUMNS / LOOKS + COLUMNS - half;
        let shown = columns.iter().cycle().skip(first % COLUMNS).take(2 * half + 1);
        worth(&shown.flatten().copied().collect::<Vec<_>>())
    });
    let worths: Vec<f64> = worths.collect();
    let best = worths.iter().copied().fold(0.0, f64::max);
    let ahead = worths.get(LOOKS / 2).copied().unwrap_or_default();
    match worths.iter().position(|worth| *worth == best) {
        Some(look) if ahead < ALMOST * best => look as f64 * 360.0 / LOOKS as f64 - 180.0,
        _ => 0.0,
    }
}

/// Returns how much some pixels show.
fn worth(pixels: &[Sample]) -> f64 {
    let mut depths: Vec<f64> = pixels.iter().filter_map(|pixel| pixel.depth_m).collect();
    depths.sort_by(f64::total_cmp);
    let [Some(near), Some(median)] = [depths.len() / 10, depths.len() / 2].map(|i| depths.get(i)) else {
        return 0.0;
    };

    let mut counts: BTreeMap<usize, f64> = BTreeMap::new();
    for class in pixels.iter().filter_map(|pixel| pixel.class) {
        *counts.entry(class).or_default() += 1.0;
    }
    let all: f64 = counts.values().sum();
    let entropy: f64 = counts.values().map(|count| -(count / all) * (count / all).ln()).sum();

    let seen = depths.len() as f64 / pixels.len() as f64;
    seen * (entropy + MEDIAN * median.ln_1p() + NEAR * near.ln_1p())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_look_goes_where_most_is_seen() {
        // Many classes at the right, a quarter turn from the middle.
        let right = first_look(|u, v| Sample {
            depth_m: Some(2.0),
            class: Some(if (0.65..0.85).contains(&u) {
                (40.0 * (u + v)) as usize
            } else {
                1
            }),
        });
        assert!((right - 90.0).abs() <= 15.0, "{right}");
        // Depth alone, behind.
        let behind = first_look(|u, _| Sample {
            depth_m: (!(0.2..0.6).contains(&u)).then_some(if (0.2..0.8).contains(&u) { 1.0 } else { 5.0 }),
            class: None,
        });
        assert!(behind.abs() >= 150.0, "{behind}");
    }

    #[test]
    fn straight_ahead_is_kept_if_nothing_is_better() {
        assert_eq!(first_look(|_, _| Sample { depth_m: Some(2.0), class: Some(1) }), 0.0);
        assert_eq!(first_look(|_, _| Sample { depth_m: None, class: None }), 0.0);
    }
}
