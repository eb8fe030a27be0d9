//! The filter of OpenEXR's ZIP for a block of scan lines. It separates the bytes of the samples: the bytes at
//! even places come before the bytes at odd places. Then it replaces each byte by the difference from the
//! byte before. Source: OpenEXR's file layout, "ZIP compression".
//!
//! It runs in wide registers, in one pass over the three channels. With the `exr` crate alone, a file takes
//! several times as long (bench `compressors`).

use crate::Error;
use crate::simd::{Compare, Kernel, dispatch};

/// A block of scan lines of three channels, filtered for OpenEXR's ZIP. Its buffers are reused from block to
/// block.
///
/// ```
/// use s3d_deflate::exr::ZipBlock;
/// use s3d_deflate::{Deflater, Search};
///
/// // 16 lines of 100 pixels: 32-bit floats of three channels.
/// let pixels: Vec<[f32; 3]> = (0..1600).map(|i| [1.0, 2.0, (i / 100) as f32]).collect();
/// let mut block = ZipBlock::default();
/// block.set(&pixels, 100, f32::to_le_bytes)?;
/// // Even and odd bytes are apart, so a line repeats after half its bytes.
/// let mut deflater = Deflater::new(Search::floats(100 * 3 * 4 / 2, 4))?;
/// let mut stream = Vec::new();
/// deflater.zlib(block.differences(), Some(block.differences().len() / 2), &mut stream);
/// assert!(stream.len() < 19_200 / 50, "{}", stream.len());
/// // A block that does not shrink is stored unfiltered: B, G and R of a line, one after the other.
/// assert_eq!(block.stored().take(4).collect::<Vec<u8>>(), 0f32.to_le_bytes());
/// // A reader inflates the differences and gets the pixels back.
/// let differences = block.differences().to_vec();
/// block.differences_mut(differences.len()).copy_from_slice(&differences);
/// let mut read = vec![[0.0; 3]; 1600];
/// block.get(&mut read, 100, f32::from_le_bytes)?;
/// assert_eq!(read, pixels);
/// # Ok::<(), s3d_deflate::Error>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct ZipBlock {
    /// One line, channel by channel.
    line: Vec<u8>,
    /// The bytes of the samples, line by line and channel by channel: first the bytes at even places, then
    /// the bytes at odd places.
    separated: Vec<u8>,
    /// `separated`, with each byte but the first as the difference from the byte before.
    differences: Vec<u8>,
}

impl ZipBlock {
    /// Filters the lines of a block: rows of `width` pixels with the channels R, G, B and samples of `N`
    /// bytes. Channels are stored in the order of their names: B, G, R.
    ///
    /// # Errors
    /// [`Error::PartialLine`] if there are no pixels or they are not whole rows; [`Error::Setting`] if `N` is
    /// odd or 0.
    pub fn set<T: Copy, const N: usize>(
        &mut self,
        pixels: &[[T; 3]],
        width: usize,
        to_le_bytes: impl Fn(T) -> [u8; N],
    ) -> Result<(), Error> {
        let bytes = bytes_of::<N>(pixels.len(), width)?;
        self.line.resize(3 * N * width, 0);
        self.separated.resize(bytes, 0);
        self.differences.resize(bytes, 0);
        let Self { line, separated, differences } = self;
        dispatch(Prepare { pixels, width, to_le_bytes, line, separated, differences });
        Ok(())
    }

    /// Restores the pixels of the block from the differences in [`Self::differences_mut`]. It is the reverse
    /// of [`Self::set`].
    ///
    /// # Errors
    /// The errors of [`Self::set`]; [`Error::PartialLine`] also if the number of differences is not the
    /// number of bytes of all samples.
    pub fn get<T: Copy, const N: usize>(
        &mut self,
        pixels: &mut [[T; 3]],
        width: usize,
        from_le_bytes: impl Fn([u8; N]) -> T,
    ) -> Result<(), Error> {
        let bytes = bytes_of::<N>(pixels.len(), width)?;
        if bytes != self.differences.len() {
            return Err(Error::PartialLine { len: self.differences.len(), line: bytes });
        }
        self.line.resize(3 * N * width, 0);
        self.separated.resize(bytes, 0);
        let Self { line, separated, differences } = self;
        dispatch(Restore { pixels, width, from_le_bytes, line, separated, differences });
        Ok(())
    }

    /// Returns the buffer for the differences of a block whose samples have `bytes` bytes in all.
    pub fn differences_mut(&mut self, bytes: usize) -> &mut [u8] {
        self.differences.resize(bytes, 0);
        &mut self.differences
    }

    /// Returns the bytes to compress. The even bytes of samples are in the first half, the odd bytes in the
    /// second.
    pub fn differences(&self) -> &[u8] {
        &self.differences
    }

    /// Returns the bytes to store if compression does not make them shorter: the bytes of the samples, line
    /// by line and channel by channel.
    pub fn stored(&self) -> impl Iterator<Item = u8> {
        let (even, odd) = self.separated.split_at(self.separated.len() / 2);
        even.iter().zip(odd).flat_map(|(even, odd)| [*even, *odd])
    }
}

/// Returns the number of bytes of the samples of whole rows of `width` pixels.
fn bytes_of<const N: usize>(pixels: usize, width: usize) -> Result<usize, Error> {
    if width == 0 || pixels == 0 || !pixels.is_multiple_of(width) {
        return Err(Error::PartialLine { len: pixels, line: width });
    }
    if N == 0 || !N.is_multiple_of(2) {
        return Err(Error::Setting { setting: "bytes of a sample", value: N, min: 2, max: 4 });
    }
    Ok(3 * N * pixels)
}

/// Separates the bytes of samples, and takes their differences.
struct Prepare<'a, T, F> {
    pixels: &'a [[T; 3]],
    width: usize,
    to_le_bytes: F,
    line: &'a mut [u8],
    separated: &'a mut [u8],
    differences: &'a mut [u8],
}

impl<T: Copy, const N: usize, F: Fn(T) -> [u8; N]> Kernel for Prepare<'_, T, F> {
    type Output = ();
    const GAINS_FROM_AVX512: bool = false;

    #[inline(always)]
    fn run<C: Compare>(self, _: C) {
        let Self { pixels, width, to_le_bytes, line, separated, differences } = self;
        let half = 3 * N / 2 * width;
        let (even, odd) = separated.split_at_mut(separated.len() / 2);
        let lines = even.chunks_exact_mut(half).zip(odd.chunks_exact_mut(half));
        for (row, (even, odd)) in pixels.chunks_exact(width).zip(lines) {
            // First separate the three channels, then even and odd bytes. Each step is simple enough for wide
            // registers.
            let (blue, rest) = line.as_chunks_mut::<N>().0.split_at_mut(width);
            let (green, red) = rest.split_at_mut(width);
            for (((pixel, b), g), r) in row.iter().zip(blue).zip(green).zip(red) {
                *r = to_le_bytes(pixel[0]);
                *g = to_le_bytes(pixel[1]);
                *b = to_le_bytes(pixel[2]);
            }
            for ((even, odd), pair) in even.iter_mut().zip(odd).zip(line.as_chunks::<2>().0) {
                [*even, *odd] = *pair;
            }
        }

        differences[0] = separated[0];
        for ((difference, byte), before) in differences[1..].iter_mut().zip(&separated[1..]).zip(&*separated)
        {
            // 128 stands for no difference.
            *difference = byte.wrapping_sub(*before).wrapping_add(128);
        }
    }
}

/// Adds up differences, and joins the bytes of samples.
struct Restore<'a, T, F, const N: usize> {
    pixels: &'a mut [[T; 3]],
    width: usize,
    from_le_bytes: F,
    line: &'a mut [u8],
    separated: &'a mut [u8],
    differences: &'a [u8],
}

impl<T: Copy, const N: usize, F: Fn([u8; N]) -> T> Kernel for Restore<'_, T, F, N> {
    type Output = ();
    const GAINS_FROM_AVX512: bool = false;

    #[inline(always)]
    fn run<C: Compare>(self, _: C) {
        let Self { pixels, width, from_le_bytes, line, separated, differences } = self;
        add_up(differences, separated);

        let half = 3 * N / 2 * width;
        let (even, odd) = separated.split_at(separated.len() / 2);
        let lines = even.chunks_exact(half).zip(odd.chunks_exact(half));
        for (row, (even, odd)) in pixels.chunks_exact_mut(width).zip(lines) {
            for ((even, odd), pair) in even.iter().zip(odd).zip(line.as_chunks_mut::<2>().0) {
                *pair = [*even, *odd];
            }
            let (blue, rest) = line.as_chunks::<N>().0.split_at(width);
            let (green, red) = rest.split_at(width);
            for (((pixel, b), g), r) in row.iter_mut().zip(blue).zip(green).zip(red) {
                *pixel = [from_le_bytes(*r), from_le_bytes(*g), from_le_bytes(*b)];
            }
        }
    }
}

/// Adds up differences, where 128 stands for none. It takes eight bytes at once: the bytes at even places and
/// the bytes at odd places are four numbers of 16 bits each, which a multiplication adds up.
#[inline(always)]
fn add_up(differences: &[u8], sums: &mut [u8]) {
    const LOW: u64 = 0x00ff_00ff_00ff_00ff;
    const ONES: u64 = 0x0001_0001_0001_0001;

    let mut before = 128u64;
    let (eights, rest) = differences.as_chunks::<8>();
    let (out, out_rest) = sums.as_chunks_mut::<8>();
    for (eight, out) in eights.iter().zip(out) {
        let bytes = u64::from_le_bytes(*eight) ^ 0x8080_8080_8080_8080;
        let even = (bytes & LOW).wrapping_mul(ONES);
        let odd = (bytes >> 8 & LOW).wrapping_mul(ONES);
        // The sum so far is added last, so one eight waits for the other for a single addition only.
        let all = (before & 0xff) * ONES;
        let at_even = even.wrapping_add(odd << 16).wrapping_add(all);
        let at_odd = even.wrapping_add(odd).wrapping_add(all);
        *out = (at_even & LOW | (at_odd & LOW) << 8).to_le_bytes();
        before += even.wrapping_add(odd) >> 48;
    }

    let mut sum = before as u8;
    for (difference, out) in rest.iter().zip(out_rest) {
        sum = sum.wrapping_add(*difference).wrapping_sub(128);
        *out = sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pixels_come_back(
            (width, lines) in (1usize..40, 1usize..17),
            seed in proptest::collection::vec(any::<[u16; 3]>(), 1..50),
        ) {
            let pixels: Vec<[u16; 3]> = seed.iter().copied().cycle().take(width * lines).collect();
            let mut block = ZipBlock::default();
            block.set(&pixels, width, u16::to_le_bytes).unwrap();
            let differences = block.differences().to_vec();
            let mut reader = ZipBlock::default();
            reader.differences_mut(differences.len()).copy_from_slice(&differences);
            let mut read = vec![[0; 3]; pixels.len()];
            reader.get(&mut read, width, u16::from_le_bytes).unwrap();
            prop_assert_eq!(read, pixels);

            // The plain reference adds up one by one.
            let mut sum = 128u8;
            let plain: Vec<u8> = differences
                .iter()
                .map(|d| {
                    sum = sum.wrapping_add(*d).wrapping_sub(128);
                    sum
                })
                .collect();
            prop_assert_eq!(reader.separated, plain);
        }
    }

    #[test]
    fn bytes_are_apart_by_channel_and_place() {
        // Two lines of two pixels with samples of two bytes.
        let pixels = [[0x0102u16, 0x0304, 0x0506], [0x0708, 0x090a, 0x0b0c], [1, 2, 3], [4, 5, 6]];
        let mut block = ZipBlock::default();
        // The content of an earlier, larger block does not matter.
        block.set(&[[9u16; 3]; 40], 20, u16::to_le_bytes).unwrap();
        block.set(&pixels, 2, u16::to_le_bytes).unwrap();
        let stored: Vec<u8> = block.stored().collect();
        let lines: [[u16; 6]; 2] = [[0x0506, 0x0b0c, 0x0304, 0x090a, 0x0102, 0x0708], [3, 6, 2, 5, 1, 4]];
        let expected: Vec<u8> = lines.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
        assert_eq!(stored, expected);

        // Even places come first. The differences add up as a reader does it.
        let apart: Vec<u8> = [0, 1]
            .iter()
            .flat_map(|i| expected.iter().skip(*i).step_by(2))
            .copied()
            .collect();
        let mut sum = block.differences()[0];
        let mut read = vec![sum];
        for difference in &block.differences()[1..] {
            sum = sum.wrapping_add(*difference).wrapping_sub(128);
            read.push(sum);
        }
        assert_eq!(read, apart);
    }

    #[test]
    fn parts_of_rows_are_errors() {
        let mut block = ZipBlock::default();
        let error = block.set(&[[0u16; 3]; 5], 2, u16::to_le_bytes).unwrap_err();
        assert_eq!(error, Error::PartialLine { len: 5, line: 2 });
        assert!(block.set(&[[0u16; 3]; 4], 0, u16::to_le_bytes).is_err());
        assert!(block.set::<u16, 2>(&[], 2, u16::to_le_bytes).is_err());
        assert!(block.set(&[[0u8; 3]; 4], 2, u8::to_le_bytes).is_err());
        block.differences_mut(23);
        let error = block.get(&mut [[0u16; 3]; 4], 2, u16::from_le_bytes).unwrap_err();
        assert_eq!(error, Error::PartialLine { len: 23, line: 24 });
        assert!(block.get(&mut [[0u16; 3]; 4], 3, u16::from_le_bytes).is_err());
    }
}
