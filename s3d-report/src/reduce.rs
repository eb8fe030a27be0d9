//! Smaller images: means of colours, and nearest pixels of what is no colour.

use s3d_geom::Raster;

/// The size of an image that is reduced to `width` pixels across, and never enlarged.
pub(crate) fn reduced_size([w, h]: [u32; 2], width: u32) -> [u32; 2] {
    let width = width.clamp(1, w.max(1));
    let height = (u64::from(h) * u64::from(width) + u64::from(w) / 2) / u64::from(w.max(1));
    [width, u32::try_from(height).unwrap_or(u32::MAX).max(1)]
}

/// The pixel of an axis of `from` pixels that pixel `i` of `to` shows: the one in which its centre lies.
/// `docs/report.md` states it, since the page computes rays by it.
pub(crate) fn source_pixel(i: u32, from: u32, to: u32) -> u32 {
    ((2 * u64::from(i) + 1) * u64::from(from) / (2 * u64::from(to))) as u32
}

/// The nearest pixels.
pub(crate) fn nearest<T: Copy>(image: &Raster<T>, [w, h]: [u32; 2]) -> Raster<T> {
    let columns: Vec<u32> = (0..w).map(|i| source_pixel(i, image.width(), w)).collect();
    let rows = (0..h).map(|j| source_pixel(j, image.height(), h));
    let pixels = rows.flat_map(|y| columns.iter().map(move |x| image.at(*x, y))).collect();
    Raster::from_vec(w, h, pixels)
}

/// The mean of the pixels that lie in a pixel, of those that are not `missing`; `missing` where there are
/// none. No image is enlarged.
pub(crate) fn mean(image: &Raster<[u8; 3]>, [w, h]: [u32; 2], missing: Option<[u8; 3]>) -> Raster<[u8; 3]> {
    if [w, h] == [image.width(), image.height()] {
        return image.clone();
    }
    let edge = |i: u32, from: u32, to: u32| (u64::from(i) * u64::from(from) / u64::from(to)) as u32;
    let widths: Vec<usize> =
        (0..w).map(|i| (edge(i + 1, image.width(), w) - edge(i, image.width(), w)) as usize).collect();
    let mut pixels = Vec::with_capacity(w as usize * h as usize);
    // Sums of the three channels, and how many pixels.
    let mut sums = vec![[0u32; 4]; w as usize];
    for j in 0..h {
        sums.fill([0; 4]);
        for y in edge(j, image.height(), h)..edge(j + 1, image.height(), h) {
            let mut rest = image.row(y);
            for (sum, width) in sums.iter_mut().zip(&widths) {
                let (these, others) = rest.split_at(*width);
                rest = others;
                for pixel in these {
                    let counts = u32::from(Some(*pixel) != missing);
                    let [r, g, b] = pixel.map(|v| u32::from(v) * counts);
                    let [sr, sg, sb, n] = *sum;
                    *sum = [sr + r, sg + g, sb + b, n + counts];
                }
            }
        }
        pixels.extend(sums.iter().map(|[r, g, b, n]| match n {
            0 => missing.unwrap_or_default(),
            n => [r, g, b].map(|sum| ((sum + n / 2) / n) as u8),
        }));
    }
    Raster::from_vec(w, h, pixels)
}

/// A number of up to 24 bits as a pixel, the highest bits in red.
pub(crate) fn pack(value: u32) -> [u8; 3] {
    let [_, r, g, b] = value.to_be_bytes();
    [r, g, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_keep_the_shape_and_do_not_grow() {
        assert_eq!(reduced_size([4096, 2048], 2048), [2048, 1024]);
        assert_eq!(reduced_size([640, 480], 256), [256, 192]);
        assert_eq!(reduced_size([100, 3], 2048), [100, 3]);
        assert_eq!(reduced_size([4000, 1], 256), [256, 1]);
    }

    #[test]
    fn nearest_pixels_are_those_of_the_centres() {
        let of = |from, to| (0..to).map(|i| source_pixel(i, from, to)).collect::<Vec<_>>();
        assert_eq!(of(4, 2), [1, 3]);
        assert_eq!(of(3, 3), [0, 1, 2]);
        assert_eq!(of(5, 3), [0, 2, 4]);
        assert_eq!(source_pixel(2047, u32::MAX, 2048), 4_293_918_719);
        let image = Raster::from_vec(4, 2, vec![1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(nearest(&image, [2, 1]).into_vec(), [6, 8]);
    }

    #[test]
    fn missing_pixels_have_no_share_in_a_mean() {
        let [a, b, n] = [[10, 20, 30], [21, 40, 60], [0; 3]];
        let image = Raster::from_vec(4, 2, vec![a, b, n, n, n, a, n, n]);
        assert_eq!(mean(&image, [2, 1], Some(n)).into_vec(), [[14, 27, 40], n]);
        // Each pixel lies in one.
        let image = Raster::from_vec(3, 1, vec![a, b, b]);
        assert_eq!(mean(&image, [2, 1], None).into_vec(), [a, b]);
        assert_eq!(mean(&image, [3, 1], Some(n)).into_vec(), image.into_vec());
    }

    #[test]
    fn numbers_are_packed_from_red_to_blue() {
        assert_eq!(pack(0x0102_0304), [2, 3, 4]);
        assert_eq!(pack(65_535), [0, 255, 255]);
    }
}
