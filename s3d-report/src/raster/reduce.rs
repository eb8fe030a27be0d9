//! Reduces images: means of colours, and nearest pixels of everything else.

use s3d_geom::Raster;
use s3d_simd::dispatch;
use std::ops::Add;

/// Returns the size of an image that is reduced to `width` pixels across. No image is enlarged.
pub(crate) fn reduced_size([w, h]: [u32; 2], width: u32) -> [u32; 2] {
    let width = width.clamp(1, w.max(1));
    let height = (u64::from(h) * u64::from(width) + u64::from(w) / 2) / u64::from(w.max(1));
    [width, u32::try_from(height).unwrap_or(u32::MAX).max(1)]
}

/// Returns the size at which the page shows an image: about `width` pixels across. The size of every second,
/// third or n-th pixel is chosen if it differs by at most an eighth: then only these pixels need rays, and
/// means are of whole pixels.
pub(crate) fn shown_size(size: [u32; 2], width: u32) -> [u32; 2] {
    let width = width.max(1);
    let stride = ((size[0] + width / 2) / width).max(1);
    let even = size[0] / stride;
    let is_even = size.iter().all(|side| side % stride == 0);
    reduced_size(
        size,
        if is_even && 8 * even.abs_diff(width) <= width {
            even
        } else {
            width
        },
    )
}

/// Returns the pixel of an axis of `from` pixels that holds the centre of pixel `i` of `to`. [`crate::files`]
/// states this rule, since the page computes rays by it.
pub(crate) fn source_pixel(i: u32, from: u32, to: u32) -> u32 {
    ((2 * u64::from(i) + 1) * u64::from(from) / (2 * u64::from(to))) as u32
}

/// Takes the nearest pixels of an image that comes line by line.
pub(crate) struct Nearest<T> {
    size: [u32; 2],
    columns: Vec<usize>,
    /// The next line.
    y: u32,
    /// The height of the image.
    height: u32,
    pixels: Vec<T>,
}

impl<T: Copy> Nearest<T> {
    /// Begins an image of `width` × `height` pixels, to be reduced to `size`.
    pub(crate) fn new([width, height]: [u32; 2], size: [u32; 2]) -> Self {
        let columns = (0..size[0]).map(|i| source_pixel(i, width, size[0]) as usize).collect();
        Self { size, columns, y: 0, height, pixels: Vec::with_capacity(size[0] as usize * size[1] as usize) }
    }

    /// Takes the next line. `value` converts its pixels.
    pub(crate) fn line<P: Copy>(&mut self, line: &[P], value: impl Fn(P) -> T) {
        let next = (self.pixels.len() / self.columns.len().max(1)) as u32;
        if next < self.size[1] && self.y == source_pixel(next, self.height, self.size[1]) {
            self.pixels.extend(
                self.columns
                    .iter()
                    .filter_map(|x| line.get(*x))
                    .map(|pixel| value(*pixel)),
            );
        }
        self.y += 1;
    }

    pub(crate) fn finish(self) -> Raster<T> {
        Raster::from_vec(self.size[0], self.size[1], self.pixels)
    }
}

/// Reduces an image to its nearest pixels.
pub(crate) fn nearest<T: Copy>(image: &Raster<T>, size: [u32; 2]) -> Raster<T> {
    let mut nearest = Nearest::new([image.width(), image.height()], size);
    image.rows().for_each(|line| nearest.line(line, |pixel| pixel));
    nearest.finish()
}

/// The most lines whose sums fit into 16 bits, and whose number fits into 8.
const LINES: u32 = 255;

/// The mean of fewer pixels than this is a multiplication.
const FEW: u32 = 4096;

/// Computes means of an image that comes line by line. A pixel is the mean of the pixels that it covers,
/// without `missing` ones; it is `missing` if there are no others.
///
/// Lines are added up first, then columns, so that most of the work is done 16 bytes at a time.
pub(crate) struct Mean {
    from: [u32; 2],
    size: [u32; 2],
    missing: Option<[u8; 3]>,
    /// The number of columns that each pixel covers.
    widths: Vec<u32>,
    /// The number of lines that were taken.
    y: u32,
    /// The number of lines in `columns`.
    lines: u32,
    /// The sums of these lines, by channel of a column.
    columns: Vec<u16>,
    /// For each byte of a line, the number of these lines in which the bytes of a missing pixel begin there,
    /// even across pixels.
    missing_at: Vec<u8>,
    /// Whether `missing_at` has any.
    some_missing: bool,
    /// The sums of the channels of the next pixels, and the numbers of pixels in them.
    sums: Vec<[u32; 4]>,
    divisor: Divisor,
    /// n, if each pixel is the mean of 2ⁿ × 2ⁿ pixels, and their sum fits into 16 bits.
    halvings: Option<u32>,
    /// `columns` and `missing_at` while they are halved. Their values behind the last whole pixel are unused.
    halved: Vec<u16>,
    halved_missing: Vec<u8>,
    means: Vec<u8>,
    pixels: Vec<[u8; 3]>,
    all_missing: u64,
}

/// Returns the first source pixel of pixel `i` of an axis.
fn edge(i: u32, from: u32, to: u32) -> u32 {
    (u64::from(i) * u64::from(from) / u64::from(to.max(1))) as u32
}

/// Adds a line to sums of lines.
#[inline(always)]
fn add_line(sums: &mut [u16], line: &[u8]) {
    for (sum, v) in sums.iter_mut().zip(line) {
        *sum += u16::from(*v);
    }
}

/// Whether the three bytes of a pixel follow each other in a line, even across pixels.
#[inline(always)]
fn is_in(line: &[u8], [r, g, b]: [u8; 3]) -> bool {
    let second = line.get(1..).unwrap_or_default();
    let third = line.get(2..).unwrap_or_default();
    let mut any = 0;
    for ((x, y), z) in line.iter().zip(second).zip(third) {
        any |= u8::from(*x == r) & u8::from(*y == g) & u8::from(*z == b);
    }
    any != 0
}

/// Adds one to the counts of the bytes where [`is_in`] finds a pixel.
#[inline(always)]
fn count_at(counts: &mut [u8], line: &[u8], [r, g, b]: [u8; 3]) {
    let second = line.get(1..).unwrap_or_default();
    let third = line.get(2..).unwrap_or_default();
    for (((count, x), y), z) in counts.iter_mut().zip(line).zip(second).zip(third) {
        *count += u8::from(*x == r) & u8::from(*y == g) & u8::from(*z == b);
    }
}

/// Adds each number to the number `step` places before it.
#[inline(always)]
fn add_next<T: Copy + Add<Output = T>>(sums: &[T], step: usize, to: &mut [T]) {
    for ((to, a), b) in to.iter_mut().zip(sums).zip(sums.get(step..).unwrap_or_default()) {
        *to = *a + *b;
    }
}

/// Divides sums by a power of two, and rounds.
#[inline(always)]
fn divide(sums: &[u16], shift: u32, to: &mut [u8]) {
    for (to, sum) in to.iter_mut().zip(sums) {
        *to = ((sum + (1 << shift >> 1)) >> shift) as u8;
    }
}

/// Divides by numbers of pixels. Small numbers take a multiplication.
struct Divisor {
    /// 2³² divided by each number, rounded up.
    inverse: Vec<u64>,
}

impl Divisor {
    /// Prepares to divide by at most this number.
    fn new(most: u64) -> Self {
        Self {
            inverse: (0..=most.min(u64::from(FEW - 1)))
                .map(|n| (1 << 32) / n.max(1) + 1)
                .collect(),
        }
    }

    /// Returns the mean of `n` pixels from the sums of their channels; `None` for no pixels.
    #[inline]
    fn mean(&self, [r, g, b, n]: [u32; 4]) -> Option<[u8; 3]> {
        match (n, self.inverse.get(n as usize)) {
            (0, _) => None,
            // This is exact, since the product of sum and number is below 2³².
            (n, Some(inverse)) => Some([r, g, b].map(|sum| ((u64::from(sum + n / 2) * inverse) >> 32) as u8)),
            (n, None) => Some([r, g, b].map(|sum| ((sum + n / 2) / n) as u8)),
        }
    }
}

impl Mean {
    /// Begins an image of `from` pixels, to be reduced to `size`.
    pub(crate) fn new(from: [u32; 2], size: [u32; 2], missing: Option<[u8; 3]>) -> Self {
        let [[width, height], [w, h]] = [from, size];
        let most = u64::from(width.div_ceil(w.max(1))) * u64::from(height.div_ceil(h.max(1)));
        Self {
            from,
            size,
            missing,
            widths: (0..w).map(|i| edge(i + 1, width, w) - edge(i, width, w)).collect(),
            y: 0,
            lines: 0,
            columns: vec![0; 3 * width as usize],
            missing_at: vec![0; 3 * width as usize],
            some_missing: false,
            sums: vec![[0; 4]; w as usize],
            divisor: Divisor::new(most),
            halvings: [2, 4, 8]
                .into_iter()
                .find_map(|side| (width == side * w && height == side * h).then_some(side.trailing_zeros())),
            halved: vec![0; 3 * width as usize],
            halved_missing: vec![0; 3 * width as usize],
            means: vec![0; 3 * width as usize],
            pixels: Vec::with_capacity(w as usize * h as usize),
            all_missing: 0,
        }
    }

    /// Takes the next line.
    pub(crate) fn line(&mut self, line: &[[u8; 3]]) {
        self.y += 1;
        if self.size == self.from {
            self.pixels.extend_from_slice(line);
            self.all_missing += line.iter().filter(|pixel| Some(**pixel) == self.missing).count() as u64;
            return;
        }

        self.lines += 1;
        let bytes = line.as_flattened();
        let level = s3d_simd::level().without_avx512();
        dispatch!(level, _simd => add_line(&mut self.columns, bytes));
        if let Some(missing) = self.missing
            && dispatch!(level, _simd => is_in(bytes, missing))
        {
            self.some_missing = true;
            dispatch!(level, _simd => count_at(&mut self.missing_at, bytes, missing));
        }

        let next = (self.pixels.len() / self.size[0].max(1) as usize) as u32 + 1;
        let is_last = self.y == edge(next, self.from[1], self.size[1]);
        if let Some(halvings) = self.halvings
            && is_last
        {
            return self.halve_columns(halvings);
        }
        if is_last || self.lines == LINES {
            self.add_columns();
        }
        if is_last {
            self.pixels.extend(
                self.sums
                    .iter()
                    .map(|sums| self.divisor.mean(*sums).or(self.missing).unwrap_or_default()),
            );
            self.sums.fill([0; 4]);
        }
    }

    /// Makes a line of pixels that are means of 2ⁿ × 2ⁿ pixels.
    fn halve_columns(&mut self, halvings: u32) {
        let level = s3d_simd::level().without_avx512();
        for n in 0..halvings {
            dispatch!(level, _simd => add_next(&self.columns, 3 << n, &mut self.halved));
            std::mem::swap(&mut self.columns, &mut self.halved);
        }
        dispatch!(level, _simd => divide(&self.columns, 2 * halvings, &mut self.means));

        let begin = self.pixels.len();
        let step = 3 << halvings;
        self.pixels.extend(
            self.means
                .chunks_exact(step)
                .map(|bytes| bytes.first_chunk().copied().unwrap_or_default()),
        );

        // Pixels that cover missing ones are made again, without these.
        if let Some(missing) = self.missing
            && self.some_missing
        {
            for n in 0..halvings {
                dispatch!(level, _simd => add_next(&self.missing_at, 3 << n, &mut self.halved_missing));
                std::mem::swap(&mut self.missing_at, &mut self.halved_missing);
            }
            let sums = self.columns.chunks_exact(step).zip(self.missing_at.chunks_exact(step));
            let made = self.pixels.get_mut(begin..).unwrap_or_default();
            for (pixel, (sums, gone)) in made.iter_mut().zip(sums) {
                if let ([r, g, b, ..], [gone, ..]) = (sums, gone)
                    && *gone > 0
                {
                    let gone = u32::from(*gone);
                    let all = 1 << (2 * halvings);
                    let [dr, dg, db] = missing.map(|channel| gone * u32::from(channel));
                    let [r, g, b] = [*r, *g, *b].map(u32::from);
                    let seen = self.divisor.mean([r - dr, g - dg, b - db, all - gone]);
                    *pixel = seen.unwrap_or(missing);
                    self.all_missing += u64::from(gone);
                }
            }
            self.missing_at.fill(0);
            self.some_missing = false;
        }
        self.columns.fill(0);
        self.lines = 0;
    }

    /// Adds up the columns that each pixel covers.
    fn add_columns(&mut self) {
        let mut columns = self.columns.as_chunks::<3>().0;
        for ([r, g, b, n], width) in self.sums.iter_mut().zip(&self.widths) {
            let (these, others) = columns.split_at(*width as usize);
            columns = others;
            for [dr, dg, db] in these {
                *r += u32::from(*dr);
                *g += u32::from(*dg);
                *b += u32::from(*db);
            }
            *n += self.lines * width;
        }

        if let Some(missing) = self.missing
            && self.some_missing
        {
            let mut missing_at = self.missing_at.as_chunks::<3>().0;
            for ([r, g, b, n], width) in self.sums.iter_mut().zip(&self.widths) {
                let (these, others) = missing_at.split_at(*width as usize);
                missing_at = others;
                let gone: u32 = these.iter().map(|[count, ..]| u32::from(*count)).sum();
                let [dr, dg, db] = missing.map(|channel| gone * u32::from(channel));
                *r -= dr;
                *g -= dg;
                *b -= db;
                *n -= gone;
                self.all_missing += u64::from(gone);
            }
            self.missing_at.fill(0);
        }

        self.columns.fill(0);
        self.lines = 0;
        self.some_missing = false;
    }

    /// Returns the number of missing pixels.
    pub(crate) fn missing(&self) -> u64 {
        self.all_missing
    }

    pub(crate) fn finish(self) -> Raster<[u8; 3]> {
        Raster::from_vec(self.size[0], self.size[1], self.pixels)
    }
}

/// Reduces an image to means: see [`Mean`]. No image is enlarged.
pub(crate) fn mean(image: &Raster<[u8; 3]>, size: [u32; 2], missing: Option<[u8; 3]>) -> Raster<[u8; 3]> {
    let mut mean = Mean::new([image.width(), image.height()], size, missing);
    image.rows().for_each(|line| mean.line(line));
    mean.finish()
}

/// Packs a number of up to 24 bits into a pixel, with the highest bits in red.
pub(crate) fn pack(value: u32) -> [u8; 3] {
    let [_, r, g, b] = value.to_be_bytes();
    [r, g, b]
}

/// Returns the number in a pixel: the inverse of [`pack`].
pub(crate) fn unpack([r, g, b]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, r, g, b])
}

/// Every so many lines of an image are compared with its reduction.
const COMPARED: usize = 4;

/// Returns the mean squared difference of an image from its reduction, by channels of pixels that are not
/// `missing`. It is 0 if there are none.
pub(crate) fn squared_loss(image: &Raster<[u8; 3]>, reduced: &Raster<[u8; 3]>, missing: [u8; 3]) -> f64 {
    let [width, height] = [image.width(), image.height()];
    let columns: Vec<usize> = (0..width).map(|x| edge(x, reduced.width(), width) as usize).collect();
    let mut sum = 0;
    let mut seen = 0;
    for (y, line) in (0..height).zip(image.rows()).step_by(COMPARED) {
        let of_reduced = reduced.row(edge(y, reduced.height(), height));
        for (pixel, x) in line.iter().zip(&columns).filter(|(pixel, _)| **pixel != missing) {
            let of_reduced = of_reduced.get(*x).unwrap_or(pixel);
            let squared = |(a, b): (&u8, &u8)| u64::from(a.abs_diff(*b)).pow(2);
            sum += pixel.iter().zip(of_reduced).map(squared).sum::<u64>();
            seen += pixel.len();
        }
    }
    sum as f64 / f64::max(seen as f64, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shown_sizes_are_even_parts_where_one_is_near() {
        assert_eq!(shown_size([1080, 1080], 256), [270, 270]);
        assert_eq!(shown_size([1080, 1080], 512), [540, 540]);
        assert_eq!(shown_size([4096, 2048], 2048), [2048, 1024]);
        assert_eq!(shown_size([640, 480], 256), [256, 192], "320 are too many");
        assert_eq!(shown_size([4000, 1], 256), [256, 1], "a line is not divided");
        assert_eq!(shown_size([100, 100], 256), [100, 100]);
    }

    #[test]
    fn sizes_keep_the_shape_and_do_not_grow() {
        assert_eq!(reduced_size([4096, 2048], 2048), [2048, 1024]);
        assert_eq!(reduced_size([640, 480], 256), [256, 192]);
        assert_eq!(reduced_size([100, 3], 2048), [100, 3]);
        assert_eq!(reduced_size([4000, 1], 256), [256, 1]);
    }

    fn source_pixels(from: u32, to: u32) -> Vec<u32> {
        (0..to).map(|i| source_pixel(i, from, to)).collect::<Vec<_>>()
    }

    #[test]
    fn nearest_pixels_hold_the_centres() {
        assert_eq!(source_pixels(4, 2), [1, 3]);
        assert_eq!(source_pixels(3, 3), [0, 1, 2]);
        assert_eq!(source_pixels(5, 3), [0, 2, 4]);
        assert_eq!(source_pixel(2047, u32::MAX, 2048), 4_293_918_719);
        let image = Raster::from_vec(4, 2, vec![1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(nearest(&image, [2, 1]).into_vec(), [6, 8]);
    }

    #[test]
    fn missing_pixels_have_no_share_in_a_mean() {
        let [a, b, n] = [[10, 20, 30], [21, 40, 60], [0; 3]];
        let image = Raster::from_vec(4, 2, vec![a, b, n, n, n, a, n, n]);
        assert_eq!(mean(&image, [2, 1], Some(n)).into_vec(), [[14, 27, 40], n]);
        // Each pixel counts once.
        let image = Raster::from_vec(3, 1, vec![a, b, b]);
        assert_eq!(mean(&image, [2, 1], None).into_vec(), [a, b]);
        assert_eq!(mean(&image, [3, 1], Some(n)).into_vec(), image.into_vec());
    }

    /// Computes the same means pixel by pixel.
    fn plain_mean(image: &Raster<[u8; 3]>, [w, h]: [u32; 2], missing: Option<[u8; 3]>) -> Raster<[u8; 3]> {
        let width = image.width();
        let height = image.height();
        let pixel = |i, j| {
            let columns = edge(i, width, w)..edge(i + 1, width, w);
            let rows = edge(j, height, h)..edge(j + 1, height, h);
            let inside = rows.flat_map(|y| columns.clone().map(move |x| image.at(x, y)));
            let seen: Vec<[u8; 3]> = inside.filter(|pixel| Some(*pixel) != missing).collect();
            let n = seen.len() as u32;
            let sum = |c: usize| seen.iter().map(|pixel| u32::from(pixel[c])).sum::<u32>();
            if n == 0 {
                missing.unwrap()
            } else {
                [0, 1, 2].map(|c| ((sum(c) + n / 2) / n) as u8)
            }
        };
        Raster::from_vec(w, h, (0..h).flat_map(|j| (0..w).map(move |i| pixel(i, j))).collect())
    }

    #[test]
    fn means_agree_with_plain_ones() {
        let mut state = 1u32;
        let mut byte = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        for ([w, h], size) in [
            ([40, 30], [20, 15]),
            ([40, 30], [17, 13]),
            ([40, 20], [10, 5]),
            ([48, 32], [6, 4]),
            ([48, 32], [3, 2]),
            ([9, 4], [1, 1]),
            // More than 256 lines, and more than 4,096 pixels, in one.
            ([7, 1100], [3, 2]),
            ([300, 260], [2, 3]),
            ([12, 5], [12, 5]),
        ] {
            for few in [256, 2, 1] {
                let pixels = (0..w * h).map(|_| [byte(), byte(), byte()].map(|v| (u32::from(v) % few) as u8));
                let mut image = Raster::from_vec(w, h, pixels.collect());
                // A part of it is missing.
                image
                    .pixels_mut()
                    .iter_mut()
                    .step_by(5)
                    .for_each(|pixel| *pixel = [255; 3]);
                for missing in [None, Some([0; 3]), Some([255; 3]), Some([1, 0, 1])] {
                    let mut lines = Mean::new([w, h], size, missing);
                    image.rows().for_each(|line| lines.line(line));
                    let count = image.pixels().iter().filter(|pixel| Some(**pixel) == missing).count();
                    assert_eq!(lines.missing(), count as u64, "{w} × {h}, {few}, {missing:?}");
                    let expected = plain_mean(&image, size, missing);
                    assert_eq!(lines.finish(), expected, "{w} × {h}, {few}, {missing:?}");
                }
            }
        }
    }

    #[test]
    fn the_loss_of_a_reduction_is_by_seen_pixels() {
        let [black, gray] = [[0; 3], [10; 3]];
        let lines = [[black, gray, [12; 3], gray], [gray; 4]].concat();
        let image = Raster::from_vec(4, 2, lines);
        let half = mean(&image, [2, 1], Some(black));
        assert_eq!(half.pixels(), [gray, [11; 3]]);
        // The first line: the black pixel is missing, and the others are 0, 1 and 1 off.
        assert!((squared_loss(&image, &half, black) - 2.0 / 3.0).abs() < 1e-12);
        assert_eq!(squared_loss(&image, &image, black), 0.0);
        assert_eq!(squared_loss(&Raster::from_vec(1, 1, vec![black]), &half, black), 0.0);
    }

    #[test]
    fn numbers_are_packed_from_red_to_blue() {
        assert_eq!(pack(0x0102_0304), [2, 3, 4]);
        assert_eq!(unpack([2, 3, 4]), 0x0002_0304);
        assert_eq!(pack(65_535), [0, 255, 255]);
    }
}
