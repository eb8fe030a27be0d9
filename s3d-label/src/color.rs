//! Colours that differ from one another, for looking at.

#![expect(clippy::indexing_slicing, reason = "places are taken modulo the length")]

/// The colour of label `label_index` in `semantic_pretty` images and in `semantic.mtl`: never black, mid grey
/// for the null label (index 0), and all different for any of the first 20,000 labels.
///
/// Hues follow one another by the golden angle, so that neighbours in the list differ most; value and
/// saturation alternate in steps. Integers only: the same colours everywhere.
pub fn pretty_color(label_index: u32) -> [u8; 3] {
    // Eleven and thirteen steps have no common divisor: 143 pairs, each of which sees a golden spiral of hues
    // again.
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
    let (sector, rest) = (hue >> 32, (hue & 0xffff_ffff) >> 16);
    let low = value * (255 - saturation) / 255;
    // From `low` to `value` along a sixth of the circle, or back.
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
        // Neither missing pixels' black nor the marks of missing pixels in other images.
        assert!(
            (0..200_000)
                .map(pretty_color)
                .all(|c| c.iter().copied().max() >= Some(128))
        );
        assert_eq!(pretty_color(0), [128; 3]);
    }

    #[test]
    fn neighbours_differ_clearly() {
        let distance = |a: [u8; 3], b: [u8; 3]| (0..3).map(|k| a[k].abs_diff(b[k])).max().unwrap();
        for i in 0..10_000 {
            for step in 1..8 {
                let (a, b) = (pretty_color(i), pretty_color(i + step));
                assert!(distance(a, b) >= 24, "{i} {a:?} and {} {b:?}", i + step);
            }
        }
    }
}
