//! Fills the holes of an image from their rims.

use s3d_geom::Raster;

/// Gives every pixel of `image` whose `seen` is 0 a colour from the pixels around it; nearer pixels count
/// more. Neighbours of holes can then be filtered without a visible rim. An image of which nothing is seen
/// stays as it is.
pub(crate) fn fill_unseen(image: &mut Raster<[u8; 3]>, seen: &Raster<u8>) {
    let w = image.width();
    let h = image.height();
    let half = filled(half_of(w, h, |at| match seen.pixels()[at] {
        0 => [0.0; 4],
        _ => {
            let [r, g, b] = image.pixels()[at].map(f32::from);
            [r, g, b, 1.0]
        }
    }));

    for y in 0..h {
        for x in 0..w {
            let at = y as usize * w as usize + x as usize;
            if seen.pixels()[at] == 0 {
                let color = between(&half, x, y);
                if color[3] > 0.0 {
                    image.pixels_mut()[at] = std::array::from_fn(|k| (color[k] + 0.5) as u8);
                }
            }
        }
    }
}

/// Fills an image of colours with the weights 0 or 1: a pixel without weight takes the colour of the image at
/// half the size, bilinearly.
fn filled(mut image: Raster<[f32; 4]>) -> Raster<[f32; 4]> {
    let w = image.width();
    let h = image.height();
    if (w <= 1 && h <= 1) || image.pixels().iter().all(|c| c[3] > 0.0) {
        return image;
    }
    let half = filled(half_of(w, h, |at| image.pixels()[at]));
    for y in 0..h {
        for x in 0..w {
            let at = y as usize * w as usize + x as usize;
            if image.pixels()[at][3] == 0.0 {
                image.pixels_mut()[at] = between(&half, x, y);
            }
        }
    }
    image
}

/// Halves an image of w × h: each pixel is the mean of the pixels with a weight.
fn half_of(w: u32, h: u32, color: impl Fn(usize) -> [f32; 4]) -> Raster<[f32; 4]> {
    let half_w = w.div_ceil(2);
    let half_h = h.div_ceil(2);
    let mut half = Vec::with_capacity(half_w as usize * half_h as usize);
    for y in 0..half_h {
        for x in 0..half_w {
            let mut sum = [0.0f32; 4];
            for y in 2 * y..h.min(2 * y + 2) {
                for x in 2 * x..w.min(2 * x + 2) {
                    let color = color(y as usize * w as usize + x as usize);
                    (0..4).for_each(|k| sum[k] += color[k]);
                }
            }
            half.push(if sum[3] > 0.0 { sum.map(|c| c / sum[3]) } else { sum });
        }
    }
    Raster::from_vec(half_w, half_h, half)
}

/// Returns the colour of an image at half the size for pixel (x, y) of the full one. In either direction, the
/// pixel that covers it counts three quarters, and the next one on its side a quarter.
fn between(half: &Raster<[f32; 4]>, x: u32, y: u32) -> [f32; 4] {
    let x0 = x / 2;
    let x1 = next_half(x, half.width());
    let y0 = y / 2;
    let y1 = next_half(y, half.height());
    let corners = [half.at(x0, y0), half.at(x1, y0), half.at(x0, y1), half.at(x1, y1)];
    let mut color = [0.0; 4];
    for (corner, weight) in corners.into_iter().zip([0.5625, 0.1875, 0.1875, 0.0625]) {
        (0..4).for_each(|k| color[k] += weight * corner[k]);
    }
    color
}

/// Returns the pixel of a half-size row of `n` pixels that is next to pixel `i` of the full row.
fn next_half(i: u32, n: u32) -> u32 {
    if i % 2 == 1 {
        (i / 2 + 1).min(n - 1)
    } else {
        (i / 2).saturating_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_hole_takes_the_colours_of_its_rim() {
        // 10 on the left, 110 on the right, a hole in between.
        let seen = Raster::from_vec(
            16,
            4,
            (0..64)
                .map(|k| if (4..12).contains(&(k % 16)) { 0 } else { 255 })
                .collect(),
        );
        let mut image =
            Raster::from_vec(16, 4, (0..64).map(|k| if k % 16 < 8 { [10; 3] } else { [110; 3] }).collect());
        image
            .pixels_mut()
            .iter_mut()
            .zip(seen.pixels())
            .filter(|(_, s)| **s == 0)
            .for_each(|(p, _)| *p = [0; 3]);
        fill_unseen(&mut image, &seen);
        let row: Vec<u8> = image.row(1).iter().map(|p| p[0]).collect();
        assert!(row.is_sorted() && row[3] == 10 && row[12] == 110, "{row:?}");
        assert!(row[4] < 45 && row[11] > 75, "{row:?}");
    }

    fn is_seen(k: u32, seed: u64) -> bool {
        seed.rotate_left(k * 7) & 3 == 0
    }

    proptest! {
        #[test]
        fn what_is_seen_stays_and_what_is_not_is_between(w in 1u32..20, h in 1u32..20, seed in any::<u64>()) {
            let seen = Raster::from_vec(w, h, (0..w * h).map(|k| u8::from(is_seen(k, seed))).collect());
            let colors = (0..w * h).map(|k| [if is_seen(k, seed) { 100 + (k % 50) as u8 } else { 0 }; 3]);
            let before = Raster::from_vec(w, h, colors.collect());
            let mut after = before.clone();
            fill_unseen(&mut after, &seen);
            for ((a, b), s) in after.pixels().iter().zip(before.pixels()).zip(seen.pixels()) {
                if *s > 0 {
                    prop_assert_eq!(a, b);
                } else if seen.pixels().contains(&1) {
                    prop_assert!((100..150).contains(&a[0]), "{:?}", a);
                }
            }
        }
    }
}
