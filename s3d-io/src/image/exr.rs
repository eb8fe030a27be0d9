//! Reads and writes OpenEXR images of world coordinates.
//!
//! The exr crate writes the header and the table of blocks. s3d-deflate prepares and compresses the blocks
//! (its README has the figures). The format is the same (ZIP, 16 lines a block), and files are no larger than
//! the crate's (`more_time_makes_smaller_files_no_larger_than_the_plain_writers`).

use crate::error::{Error, Result};
use crate::fs::atomic::write_bytes;
use crate::fs::open::read_file;
use crate::guarded::guarded;
use crate::image::compression::Compression;
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::writer::ChunksWriter;
use exr::compression::Compression as Method;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, LineOrder, SampleType};
use exr::meta::header::{Header, LayerAttributes};
use half::f16;
use s3d_deflate::exr::ZipBlock;
use s3d_deflate::{Deflater, Inflater, Search};
use s3d_geom::Raster;
use std::io::Cursor;
use std::path::Path;

/// The number of lines in a block of the compression "ZIP", by the format.
const BLOCK_LINES: u32 = 16;

/// The most pixels of an image that is read: 16 times a panorama of the data set's double size.
const MAX_PIXELS: usize = 1 << 30;
/// The most pixels that a byte of a file can hold. Deflate, the densest compression of the format, shrinks at
/// most 1,032 times, and a pixel has at least three samples of two bytes.
const MAX_PIXELS_PER_BYTE: usize = 1032 / 6;

/// Encodes world coordinates as an OpenEXR file of half floats. The channels R G B are X Y Z in metres, (0,
/// 0, 0) where nothing was seen. Scan lines run from the top; the compression is ZIP. Source:
/// [`crate::formats`], "What is written".
///
/// # Panics
/// If the image has no pixel.
pub fn encode_xyz_half(image: &Raster<[f16; 3]>, compression: Compression) -> Vec<u8> {
    encode(image, SampleType::F16, f16::to_le_bytes, compression)
}

/// Encodes like [`encode_xyz_half`], as 32-bit floats. They are exact, but the file is some twenty times as
/// large on surfaces that half floats turn into steps.
///
/// # Panics
/// If the image has no pixel.
pub fn encode_xyz_float(image: &Raster<[f32; 3]>, compression: Compression) -> Vec<u8> {
    encode(image, SampleType::F32, f32::to_le_bytes, compression)
}

/// Writes an OpenEXR file of half floats, whole or not at all, and returns its size in bytes. See
/// [`encode_xyz_half`].
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If the image has no pixel.
pub fn write_xyz_half(path: &Path, image: &Raster<[f16; 3]>, compression: Compression) -> Result<u64> {
    write_bytes(path, &encode_xyz_half(image, compression))
}

/// Writes an OpenEXR file of 32-bit floats, whole or not at all, and returns its size in bytes. See
/// [`encode_xyz_float`].
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If the image has no pixel.
pub fn write_xyz_float(path: &Path, image: &Raster<[f32; 3]>, compression: Compression) -> Result<u64> {
    write_bytes(path, &encode_xyz_float(image, compression))
}

#[expect(clippy::expect_used, reason = "a writer, into memory")]
fn encode<T: Copy, const N: usize>(
    image: &Raster<[T; 3]>,
    sample_type: SampleType,
    to_le_bytes: impl Fn(T) -> [u8; N],
    compression: Compression,
) -> Vec<u8> {
    assert!(!image.is_empty(), "an OpenEXR image needs pixels: {} × {}", image.width(), image.height());
    let size = (image.width() as usize, image.height() as usize);

    // The format stores channels in the order of their names.
    let channels = ["B", "G", "R"].map(|name| ChannelDescription::named(name, sample_type));
    let header = Header::new("".into(), size, channels.into_iter().collect())
        .with_attributes(LayerAttributes::default())
        .with_encoding(Method::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing);

    let mut file = Cursor::new(Vec::with_capacity(image.len() * 2));
    let written =
        exr::block::writer::write_chunks_with(&mut file, [header].into_iter().collect(), true, |_, out| {
            let mut block = BlockCompressor::new(image.width() as usize, N, compression);
            let width = image.width() as usize;
            for (index, pixels) in image.pixels().chunks(width * BLOCK_LINES as usize).enumerate() {
                let y = index as u32 * BLOCK_LINES;
                let compressed_pixels_le = block.compress(pixels, width, &to_le_bytes);
                let line = CompressedScanLineBlock { y_coordinate: y as i32, compressed_pixels_le };
                out.write_chunk(
                    index,
                    Chunk { layer_index: 0, compressed_block: CompressedBlock::ScanLine(line) },
                )?;
            }
            Ok(())
        });
    written.expect("memory takes any bytes, and the blocks are those of the header");
    file.into_inner()
}

/// Compresses one block of lines after the other.
struct BlockCompressor {
    block: ZipBlock,
    compressed: Vec<u8>,
    deflater: Deflater,
}

impl BlockCompressor {
    /// Prepares for lines of `width` pixels with three samples of `sample` bytes.
    #[expect(clippy::expect_used, reason = "a writer: the settings are those of a constructor")]
    fn new(width: usize, sample: usize, compression: Compression) -> Self {
        // The bytes of a block are split into even and odd ones, so a line repeats after half its bytes.
        let line = 3 * sample * width / 2;
        let search = match compression {
            Compression::Fast | Compression::Balanced => Search::floats(line, sample),
            Compression::Small => Search::thorough(line, sample / 2),
        };
        let deflater = Deflater::new(search).expect("searches are in range");
        Self { block: ZipBlock::default(), compressed: Vec::new(), deflater }
    }

    /// Returns the content of a block: whole rows of `width` pixels (R G B), compressed unless that makes it
    /// longer.
    #[expect(clippy::expect_used, reason = "a writer: an image consists of whole rows")]
    fn compress<T: Copy, const N: usize>(
        &mut self,
        pixels: &[[T; 3]],
        width: usize,
        to_le_bytes: impl Fn(T) -> [u8; N],
    ) -> Vec<u8> {
        self.block
            .set(pixels, width, to_le_bytes)
            .expect("whole rows of samples of two or four bytes");
        let bytes = self.block.differences();
        self.compressed.clear();
        self.deflater.zlib(bytes, Some(bytes.len() / 2), &mut self.compressed);
        if self.compressed.len() < bytes.len() {
            self.compressed.clone()
        } else {
            self.block.stored().collect()
        }
    }
}

/// Reads world coordinates from an OpenEXR file: the channels R G B of any sample type and compression.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no OpenEXR file, damaged, or has no channels R G B.
pub fn read_xyz(path: &Path) -> Result<Raster<[f32; 3]>> {
    decode_xyz(&read_file(path)?, path)
}

/// Decodes like [`read_xyz`], from the file's bytes. Errors name the file by `name`.
///
/// # Errors
/// Like [`read_xyz`].
pub fn decode_xyz(bytes: &[u8], name: &Path) -> Result<Raster<[f32; 3]>> {
    let path = name;
    let meta = exr::meta::MetaData::read_from_buffered(bytes, false).map_err(|e| unreadable(path, &e))?;
    for header in &meta.headers {
        let [width, height] = [header.layer_size.x(), header.layer_size.y()];
        if width.checked_mul(height).is_none_or(|n| n > MAX_PIXELS) {
            let message = format!("{width} × {height} pixels are more than {MAX_PIXELS}");
            return Err(Error::unsupported(path, message));
        }
        if is_too_short(header, bytes) {
            let message = format!("claims {width} × {height} pixels in {} bytes", bytes.len());
            return Err(Error::format(path, message));
        }
    }

    if let Some(halves) = decode_xyz_half(bytes) {
        return Ok(halves.map(|point| point.map(f16::to_f32)));
    }
    decode_any(bytes, path)
}

fn unreadable(path: &Path, error: &exr::error::Error) -> Error {
    Error::format(path, format!("no readable OpenEXR file of R G B: {error}"))
}

/// Decodes any file that the exr crate reads. Its header was checked.
fn decode_any(bytes: &[u8], path: &Path) -> Result<Raster<[f32; 3]>> {
    use exr::prelude::{ReadChannels, ReadLayers, Vec2};

    let image = guarded(|| {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .rgb_channels(
                |size: Vec2<usize>, _| {
                    // The header was checked, so the sides fit.
                    let [width, height] = [size.x(), size.y()].map(|side| u32::try_from(side).unwrap_or(0));
                    Raster::filled(width, height, [0f32; 3])
                },
                |image, at, (r, g, b): (f32, f32, f32)| {
                    let line = (image.width() as usize).checked_mul(at.y());
                    let index = line.and_then(|line| line.checked_add(at.x()));
                    if let Some(pixel) = index.and_then(|index| image.pixels_mut().get_mut(index)) {
                        *pixel = [r, g, b];
                    }
                },
            )
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(bytes))
    })
    .ok_or_else(|| Error::format(path, "no readable OpenEXR file of R G B: its blocks are damaged"))?
    .map_err(|e| unreadable(path, &e))?;
    Ok(image.layer_data.channel_data.pixels)
}

/// Returns whether a file claims more pixels than its bytes can hold.
fn is_too_short(header: &Header, bytes: &[u8]) -> bool {
    let pixels = header.layer_size.x().checked_mul(header.layer_size.y());
    pixels.is_none_or(|pixels| pixels > MAX_PIXELS.min(bytes.len().saturating_mul(MAX_PIXELS_PER_BYTE)))
}

/// Returns the number of bits of the floats in an OpenEXR file: 16 or 32. Returns `None` if the file is
/// something else, or its channels have other types or different ones.
pub fn xyz_bits(bytes: &[u8]) -> Option<u8> {
    let meta = exr::meta::MetaData::read_from_buffered(bytes, false).ok()?;
    let mut types = meta
        .headers
        .iter()
        .flat_map(|header| &header.channels.list)
        .map(|channel| channel.sample_type);
    let first = types.next()?;
    if types.any(|other| other != first) {
        return None;
    }
    match first {
        SampleType::F16 => Some(16),
        SampleType::F32 => Some(32),
        SampleType::U32 => None,
    }
}

/// Decodes world coordinates in half floats from a file as [`encode_xyz_half`] makes it. This takes a
/// fraction of the time that [`decode_xyz`] takes for other files. Returns `None` if the file is of another
/// kind or damaged; [`decode_xyz`] reads those, or tells what is wrong.
///
/// ```
/// use s3d_geom::Raster;
/// use s3d_io::image::{Compression, decode_xyz_half, encode_xyz_half};
///
/// let points = Raster::filled(8, 40, [1.0, 2.0, 3.0].map(half::f16::from_f32));
/// let bytes = encode_xyz_half(&points, Compression::Balanced);
/// assert_eq!(decode_xyz_half(&bytes), Some(points));
/// assert_eq!(decode_xyz_half(&bytes[..bytes.len() - 1]), None);
/// ```
pub fn decode_xyz_half(bytes: &[u8]) -> Option<Raster<[f16; 3]>> {
    guarded(|| decode_blocks(bytes)).flatten()
}

fn decode_blocks(bytes: &[u8]) -> Option<Raster<[f16; 3]>> {
    let reader = exr::block::read(Cursor::new(bytes), false).ok()?;

    let [header] = reader.headers() else { return None };
    if !is_usual(header) || is_too_short(header, bytes) {
        return None;
    }

    let [width, height] = [header.layer_size.x(), header.layer_size.y()];
    let mut image = Raster::filled(u32::try_from(width).ok()?, u32::try_from(height).ok()?, [f16::ZERO; 3]);
    let mut chunks = reader.all_chunks(false).ok()?;
    let mut block = ZipBlock::default();
    let mut inflater = Inflater::default();
    for (index, pixels) in image.pixels_mut().chunks_mut(width * BLOCK_LINES as usize).enumerate() {
        let CompressedBlock::ScanLine(lines) = chunks.next()?.ok()?.compressed_block else { return None };
        if lines.y_coordinate != i32::try_from(index).ok()?.checked_mul(BLOCK_LINES as i32)? {
            return None;
        }

        let bytes = &lines.compressed_pixels_le;
        let len = 3 * size_of::<f16>() * pixels.len();
        if bytes.len() == len {
            // The block is stored uncompressed, line by line and channel by channel.
            for (row, line) in pixels.chunks_mut(width).zip(bytes.chunks(6 * width)) {
                let (blue, rest) = line.as_chunks::<2>().0.split_at(width);
                let (green, red) = rest.split_at(width);
                for (((pixel, b), g), r) in row.iter_mut().zip(blue).zip(green).zip(red) {
                    *pixel = [*r, *g, *b].map(f16::from_le_bytes);
                }
            }
            continue;
        }

        let differences = block.differences_mut(len);
        inflater.zlib(bytes, differences).ok()?;
        block.get(pixels, width, f16::from_le_bytes).ok()?;
    }
    chunks.next().is_none().then_some(image)
}
/// Returns whether a header is like the one that [`encode_xyz_half`] writes.
fn is_usual(header: &Header) -> bool {
    let channels = &header.channels.list;
    channels.len() == 3
        && channels
            .iter()
            .zip(["B", "G", "R"])
            .all(|(channel, name)| is_half(channel, name))
        && header.compression == Method::ZIP16
        && header.blocks == BlockDescription::ScanLines
        && header.own_attributes.layer_position == exr::math::Vec2(0, 0)
        && !header.deep
}

fn is_half(channel: &ChannelDescription, name: &str) -> bool {
    channel.name == *name
        && channel.sample_type == SampleType::F16
        && channel.sampling.x() == 1
        && channel.sampling.y() == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn in_file<T>(bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("image.exr");
        write_bytes(&path, bytes).unwrap();
        read(&path)
    }

    /// Encodes with the exr crate's own writer.
    fn reference_half(image: &Raster<[f16; 3]>) -> Vec<u8> {
        use exr::prelude::*;
        let encoding = Encoding {
            compression: Method::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let size = (image.width() as usize, image.height() as usize);
        let layer = Layer::new(
            size,
            LayerAttributes::default(),
            encoding,
            SpecificChannels::rgb(|p: Vec2<usize>| {
                let [r, g, b] = image.at(p.x() as u32, p.y() as u32);
                (r, g, b)
            }),
        );
        let mut file = Cursor::new(Vec::new());
        Image::from_layer(layer)
            .write()
            .non_parallel()
            .to_buffered(&mut file)
            .unwrap();
        file.into_inner()
    }

    /// Makes a floor and a wall, in metres.
    fn room(width: u32, height: u32) -> Raster<[f32; 3]> {
        let pixels = (0..width * height).map(|i| {
            let x = (i % width) as f32 / width as f32;
            let y = (i / width) as f32 / height as f32;
            if y < 0.5 {
                [4.0 * x - 2.0, 3.0, 2.8 - 3.0 * y]
            } else {
                [x / y, 1.5 / y, 0.0]
            }
        });
        Raster::from_vec(width, height, pixels.collect())
    }

    #[test]
    fn halves_and_floats_come_back_exactly() {
        for (w, h) in [(1, 1), (3, 16), (5, 17), (64, 40), (31, 33), (9000, 18)] {
            let floats = room(w, h);
            let halves = floats.map(|p| p.map(f16::from_f32));
            for compression in Compression::ALL {
                assert_eq!(in_file(&encode_xyz_float(&floats, compression), read_xyz).unwrap(), floats);
                let bytes = encode_xyz_half(&halves, compression);
                let read = in_file(&bytes, read_xyz).unwrap();
                assert_eq!(read, halves.map(|p| p.map(f16::to_f32)));
                // Our reader and the exr crate's agree.
                assert_eq!(decode_any(&bytes, Path::new("a.exr")).unwrap(), read);
                assert_eq!(decode_xyz_half(&bytes), Some(halves.clone()), "{w} × {h}");
                assert_eq!(decode_xyz_half(&encode_xyz_float(&floats, compression)), None);
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Noise does not compress, so its blocks are stored.
        #[test]
        fn any_values_come_back((w, h, data) in (1u32..40, 1u32..40).prop_flat_map(|(w, h)| {
            (Just(w), Just(h), proptest::collection::vec(any::<[u16; 3]>(), (w * h) as usize))
        })) {
            let numbers = data.into_iter().map(|p| p.map(f16::from_bits));
            let numbers = numbers.map(|p| p.map(|v| if v.is_nan() { f16::ONE } else { v }));
            let image = Raster::from_vec(w, h, numbers.collect());
            for compression in Compression::ALL {
                let bytes = encode_xyz_half(&image, compression);
                let expected = image.map(|p| p.map(f16::to_f32));
                prop_assert_eq!(&decode_any(&bytes, Path::new("a.exr")).unwrap(), &expected);
                prop_assert_eq!(in_file(&bytes, read_xyz).unwrap(), expected);
                prop_assert_eq!(decode_xyz_half(&bytes), Some(image.clone()));
            }
        }
    }

    fn header(bytes: &[u8]) -> exr::meta::header::Header {
        let meta = exr::meta::MetaData::read_from_buffered(bytes, true).unwrap();
        let [header] = meta.headers.as_slice() else { panic!("one layer") };
        header.clone()
    }

    #[test]
    fn the_header_is_what_the_plain_writer_makes() {
        let image = room(100, 50).map(|p| p.map(f16::from_f32));
        let ours = encode_xyz_half(&image, Compression::Balanced);
        let plain = reference_half(&image);
        let a = header(&ours);
        let b = header(&plain);
        assert_eq!(a.channels, b.channels);
        assert_eq!(a.channels.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>(), ["B", "G", "R"]);
        assert_eq!((a.compression, a.line_order, a.blocks), (b.compression, b.line_order, b.blocks));
        assert_eq!((a.layer_size, a.chunk_count), (b.layer_size, b.chunk_count));
        assert_eq!(a.shared_attributes.display_window, b.shared_attributes.display_window);
        assert_eq!(in_file(&plain, read_xyz).unwrap(), in_file(&ours, read_xyz).unwrap());
        assert_eq!(decode_xyz_half(&plain), Some(image));
    }

    #[test]
    fn more_time_makes_smaller_files_no_larger_than_the_plain_writers() {
        let image = room(700, 300).map(|p| p.map(f16::from_f32));
        let [fast, balanced, small] = Compression::ALL.map(|c| encode_xyz_half(&image, c).len());
        let plain = reference_half(&image).len();
        assert!(fast >= balanced && balanced >= small, "{fast}, {balanced}, {small}");
        assert!(balanced <= plain, "{balanced}, the plain writer makes {plain}");
    }

    #[test]
    fn broken_files_are_format_errors() {
        let whole = encode_xyz_half(&room(20, 20).map(|p| p.map(f16::from_f32)), Compression::Balanced);
        for bytes in [&b"not an image"[..], b"", &whole[..30], &whole[..whole.len() / 2]] {
            let e = in_file(bytes, read_xyz).unwrap_err();
            assert!(matches!(e, Error::Format { .. }), "{e}");
            assert_eq!(decode_xyz_half(bytes), None);
        }
        assert!(matches!(read_xyz(Path::new("/nowhere/a.exr")), Err(Error::Io { action: "read", .. })));
    }
}
