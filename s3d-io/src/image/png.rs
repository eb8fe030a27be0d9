//! PNG images: 8-bit colour, 8 bits with a palette, 8-bit and 16-bit gray.

use crate::error::{Error, Result};
use crate::fs::atomic::write_bytes;
use crate::fs::open::open_file;
use crate::image::compression::Compression;
use png::{BitDepth, ColorType};
use s3d_deflate::png::{Filter, filter};
use s3d_deflate::{Deflater, Search};
use s3d_geom::Raster;
use std::fs::File;
use std::io::{BufRead, BufReader, Cursor, Seek};
use std::path::Path;

/// Images with more pixels than this are not read: 16 times a panorama of the data set's double size.
const MAX_PIXELS: u64 = 1 << 30;

/// What deflate can make of a byte at most.
const MAX_DEFLATE: u64 = 1032;

/// What an 8-bit image shows, which decides how it compresses best. The pixels come back the same whatever is
/// said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Texture and noise.
    Photo,
    /// Surface normals: constant on planes, smooth elsewhere.
    Normals,
    /// Constant in pieces: label indices, a colour per instance.
    Labels,
}

/// An image as the bytes of an 8-bit RGB PNG file.
///
/// # Panics
/// If it has no pixel.
pub fn encode_rgb8(image: &Raster<[u8; 3]>, content: Content, compression: Compression) -> Vec<u8> {
    // A line of samples after the filter's number.
    let line = 1 + 3 * image.width() as usize;
    let (photo, small) = (Search::photo(line), Search::thorough(line, 3));
    let plans: &[(Filter, Search)] = match (content, compression) {
        (Content::Photo, Compression::Fast) => &[(Filter::Paeth, Search { nice: 16, patience: 3, ..photo })],
        (Content::Photo, Compression::Balanced) => &[(Filter::Paeth, photo)],
        (Content::Photo, Compression::Small) => &[(Filter::Paeth, small)],
        (Content::Normals, Compression::Fast | Compression::Balanced) => {
            &[(Filter::None, Search::smooth(line))]
        }
        // Large patches repeat best as they are, small ones as differences.
        (Content::Normals, Compression::Small) => {
            &[(Filter::Paeth, small), (Filter::None, small), (Filter::None, Search::smooth(line))]
        }
        (Content::Labels, Compression::Fast) => &[(Filter::Up, Search::patches(line))],
        (Content::Labels, Compression::Balanced) => &[(Filter::Up, Search::labels(line))],
        (Content::Labels, Compression::Small) => &[(Filter::Up, small), (Filter::Paeth, small)],
    };
    let format = Format { color: ColorType::Rgb, depth: BitDepth::Eight, pixel: 3, palette: &[] };
    encode(image.width(), image.height(), format, image.pixels().as_flattened(), plans)
}

/// An image as the bytes of an 8-bit gray PNG file, set for images that are constant in pieces, such as
/// masks.
///
/// # Panics
/// If it has no pixel.
pub fn encode_gray8(image: &Raster<u8>) -> Vec<u8> {
    let search = Search::patches(1 + image.width() as usize);
    let format = Format { color: ColorType::Grayscale, depth: BitDepth::Eight, pixel: 1, palette: &[] };
    encode(image.width(), image.height(), format, image.pixels(), &[(Filter::Up, search)])
}

/// An image of places in a palette as the bytes of an 8-bit PNG file with it.
///
/// # Panics
/// If it has no pixel, or the palette no colour or more than 256.
pub fn encode_palette8(image: &Raster<u8>, palette: &[[u8; 3]], compression: Compression) -> Vec<u8> {
    assert!((1..=256).contains(&palette.len()), "a palette of {} colours", palette.len());
    let line = 1 + image.width() as usize;
    let small = Search::thorough(line, 1);
    let plans: &[(Filter, Search)] = match compression {
        Compression::Fast => &[(Filter::Up, Search::patches(line))],
        Compression::Balanced => &[(Filter::Up, Search::labels(line))],
        Compression::Small => &[(Filter::Up, small), (Filter::None, small)],
    };
    let palette = palette.as_flattened();
    let format = Format { color: ColorType::Indexed, depth: BitDepth::Eight, pixel: 1, palette };
    encode(image.width(), image.height(), format, image.pixels(), plans)
}

/// An image as the bytes of a 16-bit gray PNG file, set for smooth images such as depth.
///
/// # Panics
/// If it has no pixel.
pub fn encode_gray16(image: &Raster<u16>, compression: Compression) -> Vec<u8> {
    let mut bytes = vec![0; 2 * image.len()];
    bytes.as_chunks_mut().0.iter_mut().zip(image.pixels()).for_each(|(pair, v)| *pair = v.to_be_bytes());
    let line = 1 + 2 * image.width() as usize;
    let balanced = Search::depth(line);
    let small = Search { hash_bytes: 6, ..Search::thorough(line, 2) };
    let plans: &[(Filter, Search)] = match compression {
        Compression::Fast | Compression::Balanced => &[(Filter::Paeth, balanced)],
        Compression::Small => &[(Filter::Paeth, small), (Filter::Paeth, balanced)],
    };
    let format = Format { color: ColorType::Grayscale, depth: BitDepth::Sixteen, pixel: 2, palette: &[] };
    encode(image.width(), image.height(), format, &bytes, plans)
}

struct Format<'a> {
    color: ColorType,
    depth: BitDepth,
    /// Bytes a pixel.
    pixel: usize,
    /// Colours of a palette, three bytes each; empty if there is none.
    palette: &'a [u8],
}

/// Lines of which it is tried out how they compress best, and from how many they are.
const SAMPLE: (usize, usize) = (32, 128);
/// Up to so many lines, it is tried out on all.
const FEW_LINES: usize = 512;

/// The file, made by the plan that does best on a sample of the lines.
#[expect(
    clippy::indexing_slicing,
    clippy::expect_used,
    reason = "a writer, into memory: bands are cut by their own lengths, and there is a plan"
)]
fn encode(width: u32, height: u32, format: Format<'_>, bytes: &[u8], plans: &[(Filter, Search)]) -> Vec<u8> {
    assert!(!bytes.is_empty(), "a PNG image needs pixels: {width} × {height}");
    let line = width as usize * format.pixel;
    let compress = |bytes: &[u8], (by, search): (Filter, Search)| {
        let mut out = Vec::with_capacity(bytes.len() / 4 + 1024);
        let filtered = filter(bytes, line, format.pixel, by).expect("whole lines");
        Deflater::new(search).expect("searches are in range").zlib(&filtered, None, &mut out);
        out
    };
    let plan = if let [plan] = plans {
        *plan
    } else {
        let of = if bytes.len() <= FEW_LINES * line { SAMPLE.0 } else { SAMPLE.1 };
        let bands = bytes.chunks(of * line).map(|band| &band[..band.len().min(SAMPLE.0 * line)]);
        let sample = bands.collect::<Vec<_>>().concat();
        *plans.iter().min_by_key(|plan| compress(&sample, **plan).len()).expect("there is a plan")
    };
    let compressed = compress(bytes, plan);

    let mut file = Vec::with_capacity(compressed.len() + 128);
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(format.color);
    encoder.set_depth(format.depth);
    if !format.palette.is_empty() {
        encoder.set_palette(format.palette);
    }
    let written = encoder.write_header().and_then(|mut writer| {
        // A chunk's length has 31 bits.
        compressed.chunks(1 << 30).try_for_each(|piece| writer.write_chunk(png::chunk::IDAT, piece))?;
        writer.finish()
    });
    written.expect("memory takes any bytes");
    file
}

/// Writes an image as an 8-bit RGB PNG file, whole or not at all, and returns its size in bytes; see
/// [`encode_rgb8`].
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If it has no pixel.
pub fn write_rgb8(
    path: &Path,
    image: &Raster<[u8; 3]>,
    content: Content,
    compression: Compression,
) -> Result<u64> {
    write_bytes(path, &encode_rgb8(image, content, compression))
}

/// Writes an image as a 16-bit gray PNG file, whole or not at all, and returns its size in bytes; see
/// [`encode_gray16`].
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If it has no pixel.
pub fn write_gray16(path: &Path, image: &Raster<u16>, compression: Compression) -> Result<u64> {
    write_bytes(path, &encode_gray16(image, compression))
}

/// Reads an 8-bit RGB PNG file, and nothing else: its channels may be numbers, which must not be converted.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no PNG file, damaged, or of another kind.
pub fn read_rgb8(path: &Path) -> Result<Raster<[u8; 3]>> {
    let (file, size) = open(path)?;
    rgb8(file, size, path)
}

/// As [`read_rgb8`], from the file's bytes; errors call it `name`.
///
/// # Errors
/// As [`read_rgb8`].
pub fn decode_rgb8(bytes: &[u8], name: &Path) -> Result<Raster<[u8; 3]>> {
    rgb8(Cursor::new(bytes), bytes.len() as u64, name)
}

fn rgb8(file: impl BufRead + Seek, size: u64, path: &Path) -> Result<Raster<[u8; 3]>> {
    let (width, height, bytes, _) = decode(file, size, path, ColorType::Rgb, BitDepth::Eight)?;
    Ok(Raster::from_vec(width, height, bytes.as_chunks().0.to_vec()))
}

/// Reads an 8-bit PNG file with a palette, and nothing else: the places in the palette, and its colours.
///
/// ```
/// use s3d_geom::Raster;
/// use s3d_io::image::{Compression, encode_palette8, read_palette8};
///
/// let file = tempfile::NamedTempFile::new()?;
/// let (image, palette) = (Raster::from_vec(2, 1, vec![1, 0]), [[0, 0, 0], [255, 128, 0]]);
/// std::fs::write(file.path(), encode_palette8(&image, &palette, Compression::Balanced))?;
/// assert_eq!(read_palette8(file.path())?, (image, palette.to_vec()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`read_rgb8`].
pub fn read_palette8(path: &Path) -> Result<(Raster<u8>, Vec<[u8; 3]>)> {
    let (file, size) = open(path)?;
    let (width, height, bytes, palette) = decode(file, size, path, ColorType::Indexed, BitDepth::Eight)?;
    Ok((Raster::from_vec(width, height, bytes), palette.as_chunks().0.to_vec()))
}

/// Reads a 16-bit gray PNG file, and nothing else: its values are numbers, which must not be converted.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is no PNG file, damaged, or of another kind.
pub fn read_gray16(path: &Path) -> Result<Raster<u16>> {
    let (file, size) = open(path)?;
    gray16(file, size, path)
}

/// As [`read_gray16`], from the file's bytes; errors call it `name`.
///
/// ```
/// use s3d_geom::Raster;
/// use s3d_io::image::{Compression, decode_gray16, encode_gray16};
///
/// let depth = Raster::filled(4, 4, 1024u16);
/// let bytes = encode_gray16(&depth, Compression::Balanced);
/// assert_eq!(decode_gray16(&bytes, "depth.png".as_ref())?, depth);
/// # Ok::<(), s3d_io::Error>(())
/// ```
///
/// # Errors
/// As [`read_gray16`].
pub fn decode_gray16(bytes: &[u8], name: &Path) -> Result<Raster<u16>> {
    gray16(Cursor::new(bytes), bytes.len() as u64, name)
}

fn gray16(file: impl BufRead + Seek, size: u64, path: &Path) -> Result<Raster<u16>> {
    let (width, height, bytes, _) = decode(file, size, path, ColorType::Grayscale, BitDepth::Sixteen)?;
    let values = bytes.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect();
    Ok(Raster::from_vec(width, height, values))
}

/// A file, and how many bytes it has.
fn open(path: &Path) -> Result<(BufReader<File>, u64)> {
    let file = open_file(path)?;
    let size = file.metadata().map_err(|e| Error::io(path, "read", e))?.len();
    Ok((BufReader::new(file), size))
}

/// Width, height, samples and palette of a file of `size` bytes.
fn decode(
    file: impl BufRead + Seek,
    size: u64,
    path: &Path,
    color: ColorType,
    depth: BitDepth,
) -> Result<(u32, u32, Vec<u8>, Vec<u8>)> {
    let failed = |e| match e {
        png::DecodingError::IoError(e) if e.kind() != std::io::ErrorKind::UnexpectedEof => {
            Error::io(path, "read", e)
        }
        png::DecodingError::IoError(_) => Error::format(path, "the PNG file ends too early"),
        e => Error::format(path, format!("no readable PNG file: {e}")),
    };
    let mut reader = png::Decoder::new(file).read_info().map_err(failed)?;
    let info = reader.info();
    let (width, height) = (info.width, info.height);
    let palette = info.palette.as_deref().unwrap_or_default().to_vec();
    if (info.color_type, info.bit_depth) != (color, depth) {
        let (found, wanted) = (describe(info.color_type, info.bit_depth), describe(color, depth));
        return Err(Error::format(path, format!("the image is {found}, not {wanted}")));
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(Error::unsupported(
            path,
            format!("{width} × {height} pixels are more than {MAX_PIXELS}"),
        ));
    }
    let needed = u64::from(width) * u64::from(height) * info.bytes_per_pixel() as u64;
    if needed > size.saturating_mul(MAX_DEFLATE) {
        return Err(Error::format(path, format!("claims {width} × {height} pixels in {size} bytes")));
    }
    let mut bytes = vec![0; needed as usize];
    reader.next_frame(&mut bytes).map_err(failed)?;
    Ok((width, height, bytes, palette))
}

fn describe(color: ColorType, depth: BitDepth) -> String {
    let color = match color {
        ColorType::Grayscale => "gray",
        ColorType::Rgb => "RGB",
        ColorType::Indexed => "with a palette",
        ColorType::GrayscaleAlpha => "gray with alpha",
        ColorType::Rgba => "RGB with alpha",
    };
    format!("{}-bit {color}", depth as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn masks_come_back() {
        let mask =
            Raster::from_vec(37, 11, (0..37 * 11).map(|i| if i % 37 < i / 20 { 255 } else { 0 }).collect());
        let image = image::load_from_memory(&encode_gray8(&mask)).unwrap();
        assert_eq!(image.color(), image::ColorType::L8);
        assert_eq!(image.into_luma8().as_raw(), mask.pixels());
    }

    use proptest::prelude::*;

    fn in_file<T>(bytes: &[u8], read: impl FnOnce(&Path) -> T) -> T {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("image.png");
        write_bytes(&path, bytes).unwrap();
        read(&path)
    }

    const CONTENTS: [Content; 3] = [Content::Photo, Content::Normals, Content::Labels];

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn pixels_come_back((w, h, data) in (1u32..40, 1u32..40).prop_flat_map(|(w, h)| {
            // Noise, or few colours, in which there are repetitions.
            let color = prop_oneof![any::<[u8; 3]>(), proptest::array::uniform3(0u8..2)];
            (Just(w), Just(h), proptest::collection::vec(color, (w * h) as usize))
        })) {
            let image = Raster::from_vec(w, h, data);
            let gray = image.map(|[a, b, _]| u16::from_be_bytes([a, b]));
            for compression in Compression::ALL {
                for content in CONTENTS {
                    let bytes = encode_rgb8(&image, content, compression);
                    prop_assert_eq!(&in_file(&bytes, read_rgb8).unwrap(), &image);
                }
                prop_assert_eq!(&in_file(&encode_gray16(&gray, compression), read_gray16).unwrap(), &gray);
            }
        }
    }

    #[test]
    fn lines_longer_than_a_repetition_reaches_come_back() {
        for (width, height) in [(40_000, 3), (1, 70_000)] {
            let image = Raster::from_vec(
                width,
                height,
                (0..width * height).map(|i| [(i % 251) as u8, (i / 7) as u8, 3]).collect(),
            );
            let gray = image.map(|[a, b, _]| u16::from_be_bytes([b, a]));
            for compression in Compression::ALL {
                for content in CONTENTS {
                    let bytes = encode_rgb8(&image, content, compression);
                    assert_eq!(in_file(&bytes, read_rgb8).unwrap(), image, "{content:?}, {compression}");
                }
                assert_eq!(
                    in_file(&encode_gray16(&gray, compression), read_gray16).unwrap(),
                    gray,
                    "{compression}"
                );
            }
        }
    }

    #[test]
    fn sixteen_bits_are_big_endian_in_the_file() {
        // The `image` crate is the other reader.
        for compression in Compression::ALL {
            let image = Raster::from_vec(3, 1, vec![1, 0x1234, u16::MAX]);
            let other = image::load_from_memory(&encode_gray16(&image, compression)).unwrap();
            assert_eq!(other.as_luma16().unwrap().as_raw(), image.pixels());
            let image = Raster::from_vec(2, 1, vec![[1, 2, 3], [250, 251, 252]]);
            let other = image::load_from_memory(&encode_rgb8(&image, Content::Photo, compression)).unwrap();
            assert_eq!(other.as_rgb8().unwrap().as_raw(), &[1, 2, 3, 250, 251, 252]);
        }
    }

    fn noise() -> impl FnMut() -> u8 {
        let mut state = 1u32;
        move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        }
    }

    #[test]
    fn noise_is_stored() {
        let mut byte = noise();
        let image = Raster::from_vec(300, 200, (0..60_000).map(|_| [byte(), byte(), byte()]).collect());
        let gray = image.map(|[a, b, _]| u16::from_be_bytes([a, b]));
        for compression in Compression::ALL {
            for content in CONTENTS {
                let bytes = encode_rgb8(&image, content, compression);
                assert!(bytes.len() < 300 * 200 * 3 + 1000, "{content:?}, {compression}: {}", bytes.len());
                assert_eq!(in_file(&bytes, read_rgb8).unwrap(), image);
            }
            let bytes = encode_gray16(&gray, compression);
            assert!(bytes.len() < 300 * 200 * 2 + 1000, "{compression}: {}", bytes.len());
        }
    }

    /// A wall and a floor under a lamp, with a noisy texture: colours, depth, normals and labels.
    struct View {
        rgb: Raster<[u8; 3]>,
        depth: Raster<u16>,
        normals: Raster<[u8; 3]>,
        labels: Raster<[u8; 3]>,
    }

    fn view() -> View {
        let (width, height) = (320, 240);
        let mut byte = noise();
        // Across, depth, whether it is the floor.
        type Seen = (f32, f32, bool);
        let pixels: Vec<Seen> = (0..width * height)
            .map(|i| {
                let (x, y) =
                    ((i % width) as f32 / width as f32 - 0.5, (i / width) as f32 / height as f32 - 0.5);
                let floor = y > 0.1 + 0.1 * x;
                (x, if floor { 0.3 / y.max(0.01) } else { 2.0 + 0.7 * x }, floor)
            })
            .collect();
        let raster = |of: &mut dyn FnMut(&Seen) -> [u8; 3]| {
            Raster::from_vec(width, height, pixels.iter().map(of).collect())
        };
        View {
            rgb: raster(&mut |&(x, depth, _)| {
                let light = 120.0 - 60.0 * x * x + 30.0 * depth;
                [1.0, 0.9, 0.8].map(|k| ((k * light) as u8).saturating_add(byte() % 8))
            }),
            depth: Raster::from_vec(width, height, pixels.iter().map(|p| (512.0 * p.1) as u16).collect()),
            // Triangles of noisy vertices: each its own normal.
            normals: raster(&mut |&(x, depth, floor)| {
                let (u, v) = (9.0 * (x + 1.0), 11.0 * depth + 3.0 * x);
                let upper = u32::from(u.fract() > v.fract());
                let face = (u as u32 * 7919 + v as u32 * 104_729 + upper).wrapping_mul(0x9e37_79b1);
                let tilt = [face >> 28, face >> 20 & 15, face >> 12 & 3].map(|t| t as u8);
                let facing = if floor { [128, 10, 128] } else { [128, 128, 250] };
                [facing[0] + tilt[0], facing[1] + tilt[1], facing[2] + tilt[2]]
            }),
            labels: raster(&mut |&(x, depth, floor)| {
                [0, u8::from(floor), ((3.0 * depth + 2.0 * x) as u8).min(9)]
            }),
        }
    }

    /// What the `png` crate makes of it, by the heuristic of libpng and with zlib's level 6.
    fn peer(width: u32, height: u32, color: ColorType, depth: BitDepth, bytes: &[u8]) -> usize {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.set_filter(png::Filter::Adaptive);
        encoder.set_deflate_compression(png::DeflateCompression::Level(6));
        encoder.write_header().unwrap().write_image_data(bytes).unwrap();
        file.len()
    }

    #[test]
    fn more_time_makes_smaller_files_about_as_small_as_libpngs() {
        let view = view();
        let (w, h) = (view.rgb.width(), view.rgb.height());
        let images = [
            (&view.rgb, Content::Photo, 115),
            (&view.normals, Content::Normals, 112),
            (&view.labels, Content::Labels, 110),
        ];
        let sizes = |encode: &dyn Fn(Compression) -> Vec<u8>| Compression::ALL.map(|c| encode(c).len());
        for (image, content, percent) in images {
            let [fast, balanced, small] = sizes(&|c| encode_rgb8(image, content, c));
            let peer = peer(w, h, ColorType::Rgb, BitDepth::Eight, image.pixels().as_flattened());
            let ordered = 102 * fast >= 100 * balanced && balanced >= small;
            assert!(ordered, "{content:?}: {fast}, {balanced}, {small}");
            assert!(100 * balanced <= percent * peer, "{content:?}: {balanced}, the peer {peer}");
            assert!(100 * small <= 102 * peer, "{content:?}: {small}, the peer {peer}");
        }
        let [fast, balanced, small] = sizes(&|c| encode_gray16(&view.depth, c));
        let bytes: Vec<u8> = view.depth.pixels().iter().flat_map(|v| v.to_be_bytes()).collect();
        let peer = peer(w, h, ColorType::Grayscale, BitDepth::Sixteen, &bytes);
        assert!(fast >= balanced && balanced >= small, "depth: {fast}, {balanced}, {small}");
        assert!(100 * balanced <= 110 * peer, "depth: {balanced}, the peer {peer}");
        assert!(small <= peer, "depth: {small}, the peer {peer}");
    }

    #[test]
    fn other_kinds_are_refused_by_name() {
        let gray = encode_gray16(&Raster::filled(2, 2, 5), Compression::Balanced);
        let e = in_file(&gray, read_rgb8).unwrap_err().to_string();
        assert!(e.ends_with("image.png: the image is 16-bit gray, not 8-bit RGB"), "{e}");
        let rgb = encode_rgb8(&Raster::filled(2, 2, [5; 3]), Content::Labels, Compression::Balanced);
        let e = in_file(&rgb, read_gray16).unwrap_err().to_string();
        assert!(e.ends_with("the image is 8-bit RGB, not 16-bit gray"), "{e}");
    }

    #[test]
    fn broken_files_are_format_errors() {
        let whole = encode_rgb8(&Raster::filled(9, 9, [1, 2, 3]), Content::Photo, Compression::Balanced);
        for cut in [0, 5, 20, 40, whole.len() - 20] {
            let e = in_file(&whole[..cut], read_rgb8).unwrap_err();
            assert!(matches!(e, Error::Format { .. }), "{cut}: {e}");
        }
        let mut damaged = whole.clone();
        damaged[50] ^= 0x55;
        assert!(matches!(in_file(&damaged, read_rgb8), Err(Error::Format { .. })));
        // A header that promises more than anybody has.
        let mut huge = whole;
        huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
        assert!(in_file(&huge, read_rgb8).is_err());
        let missing = read_rgb8(Path::new("/nowhere/image.png")).unwrap_err();
        assert!(matches!(missing, Error::Io { action: "read", .. }));
    }
}
