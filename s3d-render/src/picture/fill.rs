//! Holes in an image, filled from their rims.

use s3d_geom::Raster;

/// Gives every pixel of `image` whose `seen` is 0 a colour from those around it: the nearer, the more.
/// Neighbours of holes can then be filtered without a rim. An image of which nothing is seen stays as it is.
pub(crate) fn fill_unseen(image: &mut Raster<[u8; 3]>, seen: &Raster<u8>) {
    let colors = image.pixels().iter().zip(seen.pixels());
    let full: Vec<[f32; 4]> = colors
        .map(
            |(c, &s)| if s > 0 { [f32::from(c[0]), f32::from(c[1]), f32::from(c[2]), 1.0] } else { [0.0; 4] },
        )
        .collect();
    let filled = filled(Raster::from_vec(image.width(), image.height(), full));
    for ((pixel, color), &seen) in image.pixels_mut().iter_mut().zip(filled.pixels()).zip(seen.pixels()) {
        if seen == 0 && color[3] > 0.0 {
            *pixel = std::array::from_fn(|k| (color[k] + 0.5) as u8);
        }
    }
}

/// Colours with weights 0 or 1; what has none takes it from the image at half the size, bilinearly.
fn filled(mut image: Raster<[f32; 4]>) -> Raster<[f32; 4]> {
    let (w, h) = (image.width(), image.height());
    if (w <= 1 && h <= 1) || image.pixels().iter().all(|c| c[3] > 0.0) {
        return image;
    }
    let (half_w, half_h) = (w.div_ceil(2), h.div_ceil(2));
    let mut half = Raster::filled(half_w, half_h, [0.0f32; 4]);
    for (y, row) in image.rows().enumerate() {
        for (x, color) in row.iter().enumerate() {
            let sum = &mut half.pixels_mut()[(y / 2) * half_w as usize + x / 2];
            (0..4).for_each(|k| sum[k] += color[k]);
        }
    }
    for color in half.pixels_mut() {
        if color[3] > 0.0 {
            *color = color.map(|c| c / color[3]);
        }
    }
    let half = filled(half);
    for y in 0..h {
        for x in 0..w {
            let at = y as usize * w as usize + x as usize;
            if image.pixels()[at][3] > 0.0 {
                continue;
            }
            // Three quarters of the pixel that covers it, a quarter of the next one on its side, in either
            // direction.
            let next =
                |i: u32, n: u32| if i % 2 == 1 { (i / 2 + 1).min(n - 1) } else { (i / 2).saturating_sub(1) };
            let (x0, x1, y0, y1) = (x / 2, next(x, half_w), y / 2, next(y, half_h));
            let corners = [half.at(x0, y0), half.at(x1, y0), half.at(x0, y1), half.at(x1, y1)];
            let mut color = [0.0; 4];
            for (corner, weight) in corners.into_iter().zip([0.5625, 0.1875, 0.1875, 0.0625]) {
                (0..4).for_each(|k| color[k] += weight * corner[k]);
            }
            image.pixels_mut()[at] = color;
        }
    }
    image
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
            (0..64).map(|k| if (4..12).contains(&(k % 16)) { 0 } else { 255 }).collect(),
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
