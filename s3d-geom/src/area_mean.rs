//! Images in another size, with the mean of what each new pixel covers.

use crate::Raster;

/// What a new pixel takes of a row or column: the first old pixel, and the weights from there on.
struct Share {
    first: usize,
    weights: Vec<f32>,
}

/// Shares `length` pixels from `start` on out among `count` new pixels.
fn shares(start: u32, length: u32, count: u32) -> Vec<Share> {
    let width = f64::from(length) / f64::from(count);
    let of = |i: u32| {
        let (begin, end) = (f64::from(i) * width, f64::from(i + 1) * width);
        let first = begin.floor();
        let last = end.ceil().min(f64::from(length));
        let covered = |pixel: u32| {
            let pixel = f64::from(pixel);
            ((end.min(pixel + 1.0) - begin.max(pixel)).max(0.0) / width) as f32
        };
        let weights = (first as u32..last as u32).map(covered).collect();
        Share { first: start as usize + first as usize, weights }
    };
    (0..count).map(of).collect()
}

/// Returns the window (x, y, width, height) of an image in another size (width, height). Each pixel is the
/// mean of the area that it covers, with parts of old pixels, so that a camera that is scaled with the image
/// fits exactly. Returns `None` if the window is not in the image, or a side is 0.
///
/// ```
/// use s3d_geom::{Raster, area_mean};
///
/// let image = Raster::from_vec(3, 1, vec![[0; 3], [30; 3], [90; 3]]);
/// let half = area_mean(&image, [0, 0, 3, 1], [2, 1]).expect("the window is in the image");
/// assert_eq!(half.pixels(), [[10; 3], [70; 3]]);
/// ```
pub fn area_mean(image: &Raster<[u8; 3]>, window: [u32; 4], size: [u32; 2]) -> Option<Raster<[u8; 3]>> {
    let [x, y, wide, high] = window;
    let is_inside = x.checked_add(wide)? <= image.width() && y.checked_add(high)? <= image.height();
    if !is_inside || [wide, high, size[0], size[1]].contains(&0) {
        return None;
    }

    let (columns, rows) = (shares(x, wide, size[0]), shares(y, high, size[1]));
    let mut means = Vec::with_capacity(size[0] as usize * size[1] as usize);
    let mut sums = vec![[0.0f32; 3]; size[0] as usize];
    for row in &rows {
        sums.fill([0.0; 3]);
        for (line, of_row) in image.rows().skip(row.first).zip(&row.weights) {
            for (sum, column) in sums.iter_mut().zip(&columns) {
                for (pixel, of_column) in line.iter().skip(column.first).zip(&column.weights) {
                    let weight = of_row * of_column;
                    for (sum, level) in sum.iter_mut().zip(pixel) {
                        *sum += weight * f32::from(*level);
                    }
                }
            }
        }
        means.extend(sums.iter().map(|sum| sum.map(|level| level.round() as u8)));
    }
    Some(Raster::from_vec(size[0], size[1], means))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_in_its_own_size_is_unchanged() {
        let image = Raster::from_vec(4, 3, (0..12).map(|i| [i, 2 * i, 255 - i]).collect());
        let part = area_mean(&image, [1, 1, 2, 2], [2, 2]).unwrap();
        assert_eq!(part.pixels(), [image.at(1, 1), image.at(2, 1), image.at(1, 2), image.at(2, 2)]);
        assert_eq!(area_mean(&image, [0, 0, 4, 3], [4, 3]).unwrap(), image);
        let one = area_mean(&image, [0, 0, 4, 3], [1, 1]).unwrap();
        assert_eq!(one.pixels(), [[6, 11, 250]]);
    }

    #[test]
    fn what_is_not_in_the_image_is_refused() {
        let image = Raster::from_vec(2, 2, vec![[0; 3]; 4]);
        for window in [[0, 0, 3, 1], [1, 0, 2, 1], [0, 0, 0, 1], [u32::MAX, 0, 2, 1]] {
            assert!(area_mean(&image, window, [1, 1]).is_none(), "{window:?}");
        }
        assert!(area_mean(&image, [0, 0, 2, 2], [1, 0]).is_none());
    }
}
