//! Colours that are easy to tell apart.

#![expect(clippy::indexing_slicing, reason = "places are taken modulo the length")]

/// Returns the colour of label `label_index` in `semantic_pretty` images and in `semantic.mtl`. The null
/// label (index 0) is mid grey, no colour is black, and the first 20,000 labels have different colours.
///
/// Hues follow one another by the golden angle, so that neighbours in the list differ most. Value and
/// saturation change in steps. The arithmetic is in integers, so colours are the same on every processor.
pub fn pretty_color(label_index: u32) -> [u8; 3] {
    // 11 and 13 have no common divisor, so there are 143 pairs of value and saturation. Each pair has a
    // golden spiral of hues of its own.
    const VALUES: [u32; 11] = [255, 195, 225, 165, 245, 185, 215, 155, 235, 175, 205];
    const SATURATIONS: [u32; 13] = [220, 160, 250, 190, 130, 230, 170, 200, 140, 240, 180, 150, 210];
    /// 2³² divided by the golden ratio: the golden angle, if the full circle is 2³².
    const GOLDEN: u32 = 2_654_435_769;

    if label_index == 0 {
        return [128; 3];
    }

    let value = VALUES[label_index as usize % VALUES.len()];
    let saturation = SATURATIONS[label_index as usize % SATURATIONS.len()];
    let hue = u64::from(label_index.wrapping_mul(GOLDEN)) * 6;
    let sector = hue >> 32;
    let rest = (hue & 0xffff_ffff) >> 16;

    // Along a sixth of the circle, a channel rises from `low` to `value` or falls back.
    let low = value * (255 - saturation) / 255;
    let rising = low + ((u64::from(value - low) * rest) >> 16) as u32;
    let falling = value - (rising - low);
    let [r, g, b] = match sector {
        0 => [value, rising, low],
        1 => [falling, value, low],
        2 => [low, value, rising],
        3 => [low, falling, value],
        4 => [rising, low, value],
        _ => [value, low, falling],
    };
    [r as u8, g as u8, b as u8]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn colours_are_unique_and_never_black() {
        let colors: HashSet<[u8; 3]> = (0..20_000).map(pretty_color).collect();
        assert_eq!(colors.len(), 20_000);
        // No colour is the black of missing pixels, or another mark of missing pixels.
        assert!(
            (0..200_000)
                .map(pretty_color)
                .all(|c| c.iter().copied().max() >= Some(128))
        );
        assert_eq!(pretty_color(0), [128; 3]);
    }

    fn distance(a: [u8; 3], b: [u8; 3]) -> u8 {
        (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap()
    }

    #[test]
    fn neighbours_differ_clearly() {
        for i in 0..10_000 {
            for step in 1..8 {
                let a = pretty_color(i);
                let b = pretty_color(i + step);
                assert!(distance(a, b) >= 24, "{i} {a:?} and {} {b:?}", i + step);
            }
        }
    }
}
