//! Reads PNG files in memory line by line, in about half of the png crate's time for the files of this
//! workspace. Unusual and damaged files are left to that crate, which decides whether it can read them.
//!
//! The png crate reads a stream of unknown length, which costs it the time. Here one call inflates a whole
//! image ([`Inflater`]), and the filters of several lines are undone together (`s3d_deflate::png::unfilter`).

use super::decode::{MAX_DEFLATE, MAX_PIXELS, decode};
use crate::error::Result;
use png::{BitDepth, ColorType};
use s3d_deflate::Inflater;
use s3d_deflate::png::{is_filtered, unfilter};
use s3d_geom::Raster;
use std::io::Cursor;
use std::path::Path;

/// How many lines are unfiltered at a time. They stay in a first-level cache until they are used.
const BAND: usize = 8;

/// The first bytes of every PNG file.
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Reads PNG images one after the other, and reuses its memory.
///
/// ```
/// use s3d_geom::Raster;
/// use s3d_io::image::{Compression, PngReader, encode_gray16};
///
/// let depth = Raster::from_vec(2, 2, vec![1, 2, 3, 0x0405u16]);
/// let bytes = encode_gray16(&depth, Compression::Balanced);
/// let mut reader = PngReader::default();
/// let lines = reader.gray16(&bytes, "depth.png".as_ref())?;
/// assert_eq!((lines.width(), lines.height()), (2, 2));
/// assert!(lines.are_of(&depth));
/// assert_eq!(lines.into_raster(), depth);
/// # Ok::<(), s3d_io::Error>(())
/// ```
#[derive(Default)]
pub struct PngReader {
    stream: Vec<u8>,
    lines: Vec<u8>,
    inflater: Inflater,
}

/// The lines of an image. A pixel has `N` bytes.
pub struct PngLines<'a, const N: usize> {
    width: u32,
    height: u32,
    /// Filtered lines, each after the number of its filter, or plain samples.
    lines: &'a mut [u8],
    is_filtered: bool,
}

impl PngReader {
    /// Returns the lines of an 8-bit RGB image from the bytes of its file. Errors name the file by `name`.
    ///
    /// # Errors
    /// [`Error::Format`](crate::Error::Format) if it is no PNG file, damaged, or of another kind.
    pub fn rgb8(&mut self, bytes: &[u8], name: &Path) -> Result<PngLines<'_, 3>> {
        self.lines(bytes, name, ColorType::Rgb, BitDepth::Eight)
    }

    /// Reads like [`Self::rgb8`], a 16-bit gray image. The samples are big-endian.
    ///
    /// # Errors
    /// Like [`Self::rgb8`].
    pub fn gray16(&mut self, bytes: &[u8], name: &Path) -> Result<PngLines<'_, 2>> {
        self.lines(bytes, name, ColorType::Grayscale, BitDepth::Sixteen)
    }

    /// Reads like [`Self::rgb8`], an 8-bit gray image.
    ///
    /// # Errors
    /// Like [`Self::rgb8`].
    pub fn gray8(&mut self, bytes: &[u8], name: &Path) -> Result<PngLines<'_, 1>> {
        self.lines(bytes, name, ColorType::Grayscale, BitDepth::Eight)
    }

    fn lines<const N: usize>(
        &mut self,
        bytes: &[u8],
        name: &Path,
        color: ColorType,
        depth: BitDepth,
    ) -> Result<PngLines<'_, N>> {
        if let Some((width, height, len)) = self.inflate::<N>(bytes, [depth as u8, color as u8]) {
            let lines = self.lines.get_mut(..len).unwrap_or_default();
            return Ok(PngLines { width, height, lines, is_filtered: true });
        }
        let size = bytes.len() as u64;
        let (width, height, samples, _) = decode(Cursor::new(bytes), size, name, color, depth)?;
        self.lines = samples;
        Ok(PngLines { width, height, lines: &mut self.lines, is_filtered: false })
    }

    /// Inflates an image of this kind into `self.lines`. Returns its width and height, and how many bytes its
    /// filtered lines have. Returns `None` if anything about the file is unusual.
    fn inflate<const N: usize>(&mut self, bytes: &[u8], kind: [u8; 2]) -> Option<(u32, u32, usize)> {
        let mut chunks = Chunks(bytes.strip_prefix(SIGNATURE)?);
        let (name, header) = chunks.next()?;
        let (size, rest) = header.split_first_chunk::<8>()?;
        let [a, b, c, d, size @ ..] = *size;
        let width = u32::from_be_bytes([a, b, c, d]);
        let height = u32::from_be_bytes(size);
        // Compression and filters have one known method each, and there is no interlacing.
        let is_usual = name == *b"IHDR" && rest.strip_prefix(&kind)? == [0; 3];
        let pixels = u64::from(width) * u64::from(height);
        let needed = pixels * N as u64 + u64::from(height);
        if !is_usual || pixels == 0 || pixels > MAX_PIXELS || needed > MAX_DEFLATE * bytes.len() as u64 {
            return None;
        }

        // Most files have one chunk of pixels, which needs no copy.
        self.stream.clear();
        let (mut name, mut stream) = chunks.next()?;
        let first = stream;
        let mut count = 0;
        while name == *b"IDAT" {
            if count == 1 {
                self.stream.extend_from_slice(first);
            }
            if count > 0 {
                self.stream.extend_from_slice(stream);
            }
            count += 1;
            (name, stream) = chunks.next()?;
        }
        if name != *b"IEND" || !stream.is_empty() {
            return None;
        }

        let stream = if count == 1 { first } else { &self.stream };
        let len = usize::try_from(needed).ok()?;
        if self.lines.len() < len {
            // A new vector, since the old content need not be copied.
            self.lines = Vec::new();
            self.lines = vec![0; len];
        }
        let lines = self.lines.get_mut(..len)?;

        // Chunks have checksums of their own, so the png crate does not check this one either.
        self.inflater.zlib_without_checksum(stream, lines).ok()?;

        let line = N * width as usize;
        let filters_are_known = lines
            .chunks(line + 1)
            .all(|line| line.first().is_some_and(|filter| *filter <= 4));
        filters_are_known.then_some((width, height, len))
    }
}

impl<const N: usize> PngLines<'_, N> {
    /// Returns the width of the image in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the height of the image in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Calls `each` with every line, from the top.
    pub fn for_each(self, mut each: impl FnMut(&[[u8; N]])) {
        let line = N * self.width as usize;
        if !self.is_filtered {
            self.lines
                .chunks_exact(line.max(1))
                .for_each(|line| each(line.as_chunks().0));
            return;
        }

        let mut above: Option<&[u8]> = None;
        for band in self.lines.chunks_mut(BAND * (line + 1)) {
            // The lines and their filters were checked before.
            let is_done = unfilter(band, above, line, N);
            debug_assert!(is_done.is_ok(), "{is_done:?}");
            let band = &*band;
            let mut lines = band.chunks_exact(line + 1).filter_map(|line| line.get(1..));
            lines.clone().for_each(|line| each(line.as_chunks().0));
            above = lines.next_back();
        }
    }
}

impl PngLines<'_, 3> {
    /// Returns the whole image.
    pub fn into_raster(self) -> Raster<[u8; 3]> {
        let width = self.width;
        let height = self.height;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        self.for_each(|line| pixels.extend_from_slice(line));
        Raster::from_vec(width, height, pixels)
    }

    /// Returns whether the image is certainly `image`. The filters are not undone for this, which would take
    /// a few times as long. May return `false` for equal images that another program wrote.
    pub fn are_of(&self, image: &Raster<[u8; 3]>) -> bool {
        let fits = (self.width, self.height) == (image.width(), image.height());
        let top = vec![[0; 3]; image.width() as usize];
        let mut above = top.as_slice();
        let mut lines = self.lines.chunks_exact(3 * self.width as usize + 1).zip(image.rows());
        self.is_filtered
            && fits
            && lines.all(|(filtered, line)| {
                let above = std::mem::replace(&mut above, line);
                is_filtered(filtered, line.as_flattened(), above.as_flattened(), 3)
            })
    }
}

impl PngLines<'_, 1> {
    /// Returns the whole image.
    pub fn into_raster(self) -> Raster<u8> {
        let width = self.width;
        let height = self.height;
        let mut pixels = Vec::with_capacity(width as usize * height as usize);
        self.for_each(|line| pixels.extend_from_slice(line.as_flattened()));
        Raster::from_vec(width, height, pixels)
    }

    /// Compares like [`PngLines::<3>::are_of`].
    pub fn are_of(&self, image: &Raster<u8>) -> bool {
        let fits = (self.width, self.height) == (image.width(), image.height());
        let top = vec![0; image.width() as usize];
        let mut above = top.as_slice();
        let mut lines = self.lines.chunks_exact(self.width as usize + 1).zip(image.rows());
        self.is_filtered
            && fits
            && lines.all(|(filtered, line)| {
                let above = std::mem::replace(&mut above, line);
                is_filtered(filtered, line, above, 1)
            })
    }
}

impl PngLines<'_, 2> {
    /// Returns the whole image.
    pub fn into_raster(self) -> Raster<u16> {
        let width = self.width;
        let height = self.height;
        let mut samples = Vec::with_capacity(width as usize * height as usize);
        self.for_each(|line| samples.extend(line.iter().map(|sample| u16::from_be_bytes(*sample))));
        Raster::from_vec(width, height, samples)
    }

    /// Compares like [`PngLines::<3>::are_of`].
    pub fn are_of(&self, image: &Raster<u16>) -> bool {
        let fits = (self.width, self.height) == (image.width(), image.height());
        let mut line = vec![0; 2 * image.width() as usize];
        let mut above = line.clone();
        let mut lines = self.lines.chunks_exact(line.len() + 1).zip(image.rows());
        self.is_filtered
            && fits
            && lines.all(|(filtered, samples)| {
                std::mem::swap(&mut line, &mut above);
                let bytes = line.as_chunks_mut().0.iter_mut();
                bytes
                    .zip(samples)
                    .for_each(|(bytes, sample)| *bytes = sample.to_be_bytes());
                is_filtered(filtered, &line, &above, 2)
            })
    }
}

/// The chunks of a file, their names and contents, up to the first that is damaged or cut off.
struct Chunks<'a>(&'a [u8]);

impl<'a> Iterator for Chunks<'a> {
    type Item = ([u8; 4], &'a [u8]);

    fn next(&mut self) -> Option<Self::Item> {
        let (len, rest) = self.0.split_first_chunk()?;
        let (checked, rest) = rest.split_at_checked(4 + u32::from_be_bytes(*len) as usize)?;
        let (sum, rest) = rest.split_first_chunk()?;
        let (name, content) = checked.split_first_chunk()?;
        self.0 = rest;
        (crc32fast::hash(checked) == u32::from_be_bytes(*sum)).then_some((*name, content))
    }
}
