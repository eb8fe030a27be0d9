//! OpenEXR images of world coordinates.
//!
//! The `exr` crate writes the header and the table of blocks. Blocks are prepared and compressed here, since its own way
//! takes three times as long: same format (ZIP, 16 lines a block), same size.

use crate::{Error, Result, write_bytes};
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock};
use exr::block::writer::ChunksWriter;
use exr::compression::Compression;
use exr::meta::BlockDescription;
use exr::meta::attribute::{ChannelDescription, LineOrder, SampleType};
use exr::meta::header::{Header, LayerAttributes};
use flate2::{Compress, FlushCompress, Status};
use half::f16;
use s3d_geom::Raster;
use std::io::Cursor;
use std::path::Path;

/// Lines in a block of the compression "ZIP". It is the format's number.
const BLOCK_LINES: u32 = 16;

/// zlib's level: 4 takes no longer than OpenEXR does and makes files of the same size.
const LEVEL: u32 = 4;

/// Images with more pixels than this are not read.
const MAX_PIXELS: usize = 1 << 30;

/// World coordinates as the bytes of an OpenEXR file of half floats: channels R G B = X Y Z in metres, (0, 0, 0) where
/// there is nothing; scan lines from the top, ZIP. Source: formats.md, "Images".
///
/// # Panics
/// If the image has no pixel.
pub fn encode_xyz_half(image: &Raster<[f16; 3]>) -> Vec<u8> {
    encode(image, SampleType::F16, f16::to_le_bytes)
}

/// As [`encode_xyz_half`], but of 32-bit floats: exact, and some twenty times as large on surfaces that halves turn into
/// steps.
///
/// # Panics
/// If the image has no pixel.
pub fn encode_xyz_float(image: &Raster<[f32; 3]>) -> Vec<u8> {
    encode(image, SampleType::F32, f32::to_le_bytes)
}

/// Writes an OpenEXR file of half floats, whole or not at all, and returns its size in bytes; see [`encode_xyz_half`].
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If the image has no pixel.
pub fn write_xyz_half(path: &Path, image: &Raster<[f16; 3]>) -> Result<u64> {
    write_bytes(path, &encode_xyz_half(image))
}

/// Writes an OpenEXR file of 32-bit floats, whole or not at all, and returns its size in bytes; see
/// [`encode_xyz_float`].
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If the image has no pixel.
pub fn write_xyz_float(path: &Path, image: &Raster<[f32; 3]>) -> Result<u64> {
    write_bytes(path, &encode_xyz_float(image))
}

fn encode<T: Copy, const N: usize>(
    image: &Raster<[T; 3]>,
    sample_type: SampleType,
    to_le_bytes: impl Fn(T) -> [u8; N],
) -> Vec<u8> {
    assert!(!image.is_empty(), "an OpenEXR image needs pixels: {} × {}", image.width(), image.height());
    let size = (image.width() as usize, image.height() as usize);
    // Channels are stored in the order of their names.
    let channels = ["B", "G", "R"].map(|name| ChannelDescription::named(name, sample_type));
    let header = Header::new("".into(), size, channels.into_iter().collect())
        .with_attributes(LayerAttributes::default())
        .with_encoding(Compression::ZIP16, BlockDescription::ScanLines, LineOrder::Increasing);

    let mut file = Cursor::new(Vec::with_capacity(image.len() * 2));
    let written =
        exr::block::writer::write_chunks_with(&mut file, [header].into_iter().collect(), true, |_, out| {
            let mut block = Block::new(image.width() as usize * BLOCK_LINES as usize * 3 * N);
            for (index, y) in (0..image.height()).step_by(BLOCK_LINES as usize).enumerate() {
                let rows = y..(y + BLOCK_LINES).min(image.height());
                let compressed_pixels_le = block.compress(rows.map(|y| image.row(y)), &to_le_bytes);
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

/// Buffers for one block of lines, reused for all of an image.
struct Block {
    /// The samples of the block as the format has them without compression: line by line, channel by channel.
    samples: Vec<u8>,
    /// The bytes at even places, then those at odd places, each but the first as a difference.
    prepared: Vec<u8>,
    zlib: Compress,
}

impl Block {
    fn new(bytes: usize) -> Self {
        Self {
            samples: Vec::with_capacity(bytes),
            prepared: vec![0; bytes],
            zlib: Compress::new(flate2::Compression::new(LEVEL), true),
        }
    }

    /// The contents of the block of `rows` (R G B), compressed unless that makes it longer.
    fn compress<'a, T: Copy + 'a, const N: usize>(
        &mut self,
        rows: impl Iterator<Item = &'a [[T; 3]]>,
        to_le_bytes: impl Fn(T) -> [u8; N],
    ) -> Vec<u8> {
        self.samples.clear();
        for row in rows {
            for channel in [2, 1, 0] {
                self.samples.extend(row.iter().flat_map(|pixel| to_le_bytes(pixel[channel])));
            }
        }
        let n = self.samples.len();
        let prepared = &mut self.prepared[..n];
        let (even, odd) = prepared.split_at_mut(n.div_ceil(2));
        for ((pair, even), odd) in self.samples.as_chunks::<2>().0.iter().zip(even).zip(odd) {
            [*even, *odd] = *pair;
        }
        // Backwards, so that each byte still has its neighbour to be subtracted; 128 stands for no difference.
        let mut last = prepared[n - 1];
        for i in (1..n).rev() {
            let before = prepared[i - 1];
            prepared[i] = last.wrapping_sub(before).wrapping_add(128);
            last = before;
        }

        // Room for one byte less than the samples have: a block that is not shorter is stored as it is.
        let mut compressed = Vec::with_capacity(n - 1);
        self.zlib.reset();
        match self.zlib.compress_vec(prepared, &mut compressed, FlushCompress::Finish) {
            Ok(Status::StreamEnd) => compressed,
            _ => self.samples.clone(),
        }
    }
}

/// Reads world coordinates from an OpenEXR file: the channels R G B of any sample type and compression.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no OpenEXR file, damaged, or has no channels R G B.
pub fn read_xyz(path: &Path) -> Result<Raster<[f32; 3]>> {
    let bytes = std::fs::read(path).map_err(|e| Error::io(path, "read", e))?;
    let failed =
        |e: exr::error::Error| Error::format(path, format!("no readable OpenEXR file of R G B: {e}"));
    let too_large = |width: usize, height: usize| {
        Error::unsupported(path, format!("{width} × {height} pixels are more than {MAX_PIXELS}"))
    };
    let meta = exr::meta::MetaData::read_from_buffered(bytes.as_slice(), false).map_err(failed)?;
    for header in &meta.headers {
        let (width, height) = (header.layer_size.x(), header.layer_size.y());
        if width.checked_mul(height).is_none_or(|n| n > MAX_PIXELS) {
            return Err(too_large(width, height));
        }
    }
    use exr::prelude::{ReadChannels, ReadLayers, Vec2};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: Vec2<usize>, _| Raster::filled(size.x() as u32, size.y() as u32, [0f32; 3]),
            |image, at, (r, g, b): (f32, f32, f32)| {
                let index = at.y() * image.width() as usize + at.x();
                image.pixels_mut()[index] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(failed)?;
    Ok(image.layer_data.channel_data.pixels)
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

    /// The plain way: the crate's own writer.
    fn reference_half(image: &Raster<[f16; 3]>) -> Vec<u8> {
        use exr::prelude::*;
        let at = |p: Vec2<usize>| {
            let [r, g, b] = image.at(p.x() as u32, p.y() as u32);
            (r, g, b)
        };
        let encoding = Encoding {
            compression: Compression::ZIP16,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let size = (image.width() as usize, image.height() as usize);
        let layer = Layer::new(size, LayerAttributes::default(), encoding, SpecificChannels::rgb(at));
        let mut file = Cursor::new(Vec::new());
        Image::from_layer(layer).write().non_parallel().to_buffered(&mut file).unwrap();
        file.into_inner()
    }

    /// A floor and a wall, in metres.
    fn room(width: u32, height: u32) -> Raster<[f32; 3]> {
        let pixel = |i: u32| {
            let (x, y) = ((i % width) as f32 / width as f32, (i / width) as f32 / height as f32);
            if y < 0.5 { [4.0 * x - 2.0, 3.0, 2.8 - 3.0 * y] } else { [x / y, 1.5 / y, 0.0] }
        };
        Raster::from_vec(width, height, (0..width * height).map(pixel).collect())
    }

    #[test]
    fn halves_and_floats_come_back_exactly() {
        for (w, h) in [(1, 1), (3, 16), (5, 17), (64, 40), (31, 33)] {
            let floats = room(w, h);
            assert_eq!(in_file(&encode_xyz_float(&floats), read_xyz).unwrap(), floats);
            let halves = floats.map(|p| p.map(f16::from_f32));
            let read = in_file(&encode_xyz_half(&halves), read_xyz).unwrap();
            assert_eq!(read, halves.map(|p| p.map(f16::to_f32)));
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Noise does not compress: such blocks are stored as they are.
        #[test]
        fn any_values_come_back((w, h, data) in (1u32..40, 1u32..40).prop_flat_map(|(w, h)| {
            (Just(w), Just(h), proptest::collection::vec(any::<[u16; 3]>(), (w * h) as usize))
        })) {
            let number = |bits| Some(f16::from_bits(bits)).filter(|v| !v.is_nan()).unwrap_or(f16::ONE);
            let image = Raster::from_vec(w, h, data.into_iter().map(|p| p.map(number)).collect());
            let read = in_file(&encode_xyz_half(&image), read_xyz).unwrap();
            prop_assert_eq!(read, image.map(|p| p.map(f16::to_f32)));
        }
    }

    #[test]
    fn the_header_is_what_the_plain_writer_makes() {
        let image = room(100, 50).map(|p| p.map(f16::from_f32));
        let (ours, plain) = (encode_xyz_half(&image), reference_half(&image));
        let header = |bytes: &[u8]| {
            let meta = exr::meta::MetaData::read_from_buffered(bytes, true).unwrap();
            let [header] = meta.headers.as_slice() else { panic!("one layer") };
            header.clone()
        };
        let (a, b) = (header(&ours), header(&plain));
        assert_eq!(a.channels, b.channels);
        assert_eq!(a.channels.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>(), ["B", "G", "R"]);
        assert_eq!((a.compression, a.line_order, a.blocks), (b.compression, b.line_order, b.blocks));
        assert_eq!((a.layer_size, a.chunk_count), (b.layer_size, b.chunk_count));
        assert_eq!(a.shared_attributes.display_window, b.shared_attributes.display_window);
        assert_eq!(in_file(&plain, read_xyz).unwrap(), in_file(&ours, read_xyz).unwrap());
        assert!(
            ours.len() * 10 < plain.len() * 11,
            "{} bytes, the plain writer makes {}",
            ours.len(),
            plain.len()
        );
    }

    #[test]
    fn broken_files_are_format_errors() {
        let whole = encode_xyz_half(&room(20, 20).map(|p| p.map(f16::from_f32)));
        for bytes in [&b"not an image"[..], b"", &whole[..30], &whole[..whole.len() / 2]] {
            let e = in_file(bytes, read_xyz).unwrap_err();
            assert!(matches!(e, Error::Format { .. }), "{e}");
        }
        assert!(matches!(read_xyz(Path::new("/nowhere/a.exr")), Err(Error::Io { action: "read", .. })));
    }
}
