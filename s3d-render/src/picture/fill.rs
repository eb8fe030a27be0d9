//! Holes in an image, filled from their rims.

use s3d_geom::Raster;

/// Gives every pixel of `image` whose `seen` is 0 a colour from those around it: the nearer, the more.
/// Neighbours of holes can then be filtered without a rim. An image of which nothing is seen stays as it is.
pub(crate) fn fill_unseen(image: &mut Raster<[u8; 3]>, seen: &Raster<u8>) {
    let (w, h) = (image.width(), image.height());
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

/// Colours with weights 0 or 1; what has none takes it from the image at half the size, bilinearly.
fn filled(mut image: Raster<[f32; 4]>) -> Raster<[f32; 4]> {
    let (w, h) = (image.width(), image.height());
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

/// An image of w × h at half the size: means of what has a weight.
fn half_of(w: u32, h: u32, color: impl Fn(usize) -> [f32; 4]) -> Raster<[f32; 4]> {
    let (half_w, half_h) = (w.div_ceil(2), h.div_ceil(2));
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

/// What an image at half the size has at pixel (x, y) of the full one: three quarters of the pixel that
/// covers it, a quarter of the next one on its side, in either direction.
fn between(half: &Raster<[f32; 4]>, x: u32, y: u32) -> [f32; 4] {
    let next = |i: u32, n: u32| {
        if i % 2 == 1 {
            (i / 2 + 1).min(n - 1)
        } else {
            (i / 2).saturating_sub(1)
        }
    };
    let (x0, x1, y0, y1) = (x / 2, next(x, half.width()), y / 2, next(y, half.height()));
    let corners = [half.at(x0, y0), half.at(x1, y0), half.at(x0, y1), half.at(x1, y1)];
    let mut color = [0.0; 4];
    for (corner, weight) in corners.into_iter().zip([0.5625, 0.1875, 0.1875, 0.0625]) {
        (0..4).for_each(|k| color[k] += weight * corner[k]);
    }
    color
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_hole_takes_the_colours_of_its_rim() {
        // Left 10, right 110, a hole in between.
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

    proptest! {
        #[test]
        fn what_is_seen_stays_and_what_is_not_is_between(w in 1u32..20, h in 1u32..20, seed in any::<u64>()) {
            let bit = |k: u32| seed.rotate_left(k * 7) & 3 == 0;
            let seen = Raster::from_vec(w, h, (0..w * h).map(|k| u8::from(bit(k))).collect());
            let color = |k: u32| [if bit(k) { 100 + (k % 50) as u8 } else { 0 }; 3];
            let before = Raster::from_vec(w, h, (0..w * h).map(color).collect());
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
