use super::decode::decode;
use super::{
    Content, PngReader, decode_rgb8, encode_gray8, encode_gray16, encode_rgb8, read_gray16, read_numbers8,
    read_rgb8,
};
use crate::error::Error;
use crate::fs::atomic::write_bytes;
use crate::image::compression::Compression;
use png::{BitDepth, ColorType};
use proptest::prelude::*;
use s3d_geom::Raster;
use std::io::Cursor;
use std::path::Path;

#[test]
fn masks_come_back() {
    let mask =
        Raster::from_vec(37, 11, (0..37 * 11).map(|i| if i % 37 < i / 20 { 255 } else { 0 }).collect());
    let image = image::load_from_memory(&encode_gray8(&mask)).unwrap();
    assert_eq!(image.color(), image::ColorType::L8);
    assert_eq!(image.into_luma8().as_raw(), mask.pixels());
}

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
        // Noise, or few colours, which repeat.
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
            (0..width * height)
                .map(|i| [(i % 251) as u8, (i / 7) as u8, 3])
                .collect(),
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
    // The image crate is the other reader.
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
    let width = 320;
    let height = 240;
    let mut byte = noise();
    // The horizontal position, the depth, and whether the pixel shows the floor.
    type Seen = (f32, f32, bool);
    let pixels: Vec<Seen> = (0..width * height)
        .map(|i| {
            let x = (i % width) as f32 / width as f32 - 0.5;
            let y = (i / width) as f32 / height as f32 - 0.5;
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
        // Triangles of noisy vertices, each with its own normal.
        normals: raster(&mut |&(x, depth, floor)| {
            let u = 9.0 * (x + 1.0);
            let v = 11.0 * depth + 3.0 * x;
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

/// Returns the file size that the png crate reaches, by the heuristic of libpng and with zlib's level 6.
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

fn sizes_of(encode: &dyn Fn(Compression) -> Vec<u8>) -> [usize; 3] {
    Compression::ALL.map(|c| encode(c).len())
}

#[test]
fn more_time_makes_smaller_files_about_as_small_as_libpngs() {
    let view = view();
    let w = view.rgb.width();
    let h = view.rgb.height();
    let images = [
        (&view.rgb, Content::Photo, 115),
        (&view.normals, Content::Normals, 112),
        (&view.labels, Content::Labels, 110),
    ];

    for (image, content, percent) in images {
        let [fast, balanced, small] = sizes_of(&|c| encode_rgb8(image, content, c));
        let peer = peer(w, h, ColorType::Rgb, BitDepth::Eight, image.pixels().as_flattened());
        let ordered = 102 * fast >= 100 * balanced && balanced >= small;
        assert!(ordered, "{content:?}: {fast}, {balanced}, {small}");
        assert!(100 * balanced <= percent * peer, "{content:?}: {balanced}, the peer {peer}");
        assert!(100 * small <= 102 * peer, "{content:?}: {small}, the peer {peer}");
    }

    let [fast, balanced, small] = sizes_of(&|c| encode_gray16(&view.depth, c));
    let bytes: Vec<u8> = view.depth.pixels().iter().flat_map(|v| v.to_be_bytes()).collect();
    let peer = peer(w, h, ColorType::Grayscale, BitDepth::Sixteen, &bytes);
    assert!(fast >= balanced && balanced >= small, "depth: {fast}, {balanced}, {small}");
    assert!(100 * balanced <= 110 * peer, "depth: {balanced}, the peer {peer}");
    assert!(small <= peer, "depth: {small}, the peer {peer}");
}

#[test]
fn numbers_of_few_bits_are_unpacked() {
    for (depth, packed, numbers) in [
        (BitDepth::One, vec![0b1011_0000, 0b1000_0000, 0b0000_0000, 0], vec![1, 0, 1, 1, 0, 0, 0, 0, 1]),
        (BitDepth::Four, [[0x12, 0xf4, 0, 0, 0x50], [0; 5]].concat(), vec![1, 2, 15, 4, 0, 0, 0, 0, 5]),
    ] {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, 9, 2);
        encoder.set_color(ColorType::Indexed);
        encoder.set_depth(depth);
        encoder.set_palette(vec![0; 6]);
        encoder.write_header().unwrap().write_image_data(&packed).unwrap();
        assert_eq!(in_file(&file, read_numbers8).unwrap().into_vec(), [&numbers[..], &[0; 9]].concat());
    }

    let gray = encode_gray16(&Raster::filled(2, 2, 5), Compression::Balanced);
    let e = in_file(&gray, read_numbers8).unwrap_err().to_string();
    assert!(e.ends_with("the image is 16-bit gray, not 8-bit gray or with a palette"), "{e}");
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
    // A header that claims more pixels than any memory holds.
    let mut huge = whole;
    huge[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    assert!(in_file(&huge, read_rgb8).is_err());
    let missing = read_rgb8(Path::new("/nowhere/image.png")).unwrap_err();
    assert!(matches!(missing, Error::Io { action: "read", .. }));
}

/// Decodes an image with the png crate, as a reference for our reader.
fn plain(bytes: &[u8]) -> Result<Raster<[u8; 3]>, String> {
    let size = bytes.len() as u64;
    let decoded = decode(Cursor::new(bytes), size, Path::new("a.png"), ColorType::Rgb, BitDepth::Eight);
    let (width, height, bytes, _) = decoded.map_err(|e| e.to_string())?;
    Ok(Raster::from_vec(width, height, bytes.as_chunks().0.to_vec()))
}

fn ours(bytes: &[u8]) -> Result<Raster<[u8; 3]>, String> {
    decode_rgb8(bytes, Path::new("a.png")).map_err(|e| e.to_string())
}

#[test]
fn cut_and_damaged_files_are_read_as_the_png_crate_does() {
    let mut byte = noise();
    let image = Raster::from_vec(13, 11, (0..143).map(|i| [i as u8, byte() % 4, 7]).collect());

    for content in CONTENTS {
        let whole = encode_rgb8(&image, content, Compression::Balanced);
        assert_eq!(ours(&whole).as_ref(), Ok(&image));
        for cut in 0..whole.len() {
            assert_eq!(ours(&whole[..cut]), plain(&whole[..cut]), "{content:?}, the first {cut} bytes");
        }
        for at in 0..whole.len() {
            for flip in [1, 0x80, 0xff] {
                let mut damaged = whole.clone();
                damaged[at] ^= flip;
                assert_eq!(ours(&damaged), plain(&damaged), "{content:?}, byte {at} and {flip}");
            }
        }
    }
}

/// Makes a file of these chunks, with right checksums.
fn file_of(chunks: &[([u8; 4], &[u8])]) -> Vec<u8> {
    let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
    for (name, content) in chunks {
        let checked = [name, *content].concat();
        file.extend((content.len() as u32).to_be_bytes());
        file.extend(&checked);
        file.extend(crc32fast::hash(&checked).to_be_bytes());
    }
    file
}

#[test]
fn files_of_other_programs_are_read() {
    let w = 21;
    let h = 40;
    let mut byte = noise();
    let image = Raster::from_vec(w, h, (0..w * h).map(|i| [(i / 3) as u8, byte() % 9, 250]).collect());
    let header = [&w.to_be_bytes()[..], &h.to_be_bytes(), &[8, 2, 0, 0, 0]].concat();

    // The png crate uses all filters. Its stream is split, with chunks between the pieces and bytes after
    // them.
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, w, h);
    encoder.set_color(ColorType::Rgb);
    encoder.set_filter(png::Filter::Adaptive);
    encoder
        .write_header()
        .unwrap()
        .write_image_data(image.pixels().as_flattened())
        .unwrap();
    assert_eq!(decode_rgb8(&file, Path::new("a.png")).unwrap(), image);

    let at = file.windows(4).position(|name| name == b"IDAT").unwrap();
    let len = u32::from_be_bytes(file[at - 4..at].try_into().unwrap()) as usize;
    let stream = &file[at + 4..at + 4 + len];
    let (first, second) = stream.split_at(len / 3);
    let [ihdr, idat, iend] = [*b"IHDR", *b"IDAT", *b"IEND"];
    let behind = [stream, &[1, 2, 3]].concat();

    for chunks in [
        vec![(ihdr, &header[..]), (idat, first), (idat, second), (iend, &[])],
        vec![(ihdr, &header), (*b"tEXt", b"k\0v"), (idat, stream), (iend, &[])],
        vec![(ihdr, &header), (idat, &[]), (idat, first), (idat, &[]), (idat, second), (iend, &[])],
        vec![(ihdr, &header), (idat, stream), (*b"tIME", &[7, 234, 1, 1, 1, 1, 1]), (iend, &[])],
        vec![(ihdr, &header), (idat, &behind), (iend, &[])],
        vec![(ihdr, &header), (idat, first), (iend, &[])],
    ] {
        let file = file_of(&chunks);
        let ours = decode_rgb8(&file, Path::new("a.png")).map_err(|e| e.to_string());
        assert_eq!(ours, plain(&file), "{}", chunks.len());
    }
}

#[test]
fn a_reader_forgets_what_it_read_before() {
    let mut reader = PngReader::default();
    let name = Path::new("a.png");
    let large = encode_rgb8(&Raster::filled(50, 50, [9; 3]), Content::Labels, Compression::Balanced);
    let gray = Raster::from_vec(3, 9, (0..27).map(|i| 1000 * i).collect());
    let small = encode_gray16(&gray, Compression::Balanced);
    for _ in 0..2 {
        let mut lines = 0;
        reader.rgb8(&large, name).unwrap().for_each(|line| {
            assert_eq!(line, [[9; 3]; 50]);
            lines += 1;
        });
        assert_eq!(lines, 50);

        let mut found = Vec::new();
        reader
            .gray16(&small, name)
            .unwrap()
            .for_each(|line| found.extend(line.iter().map(|v| u16::from_be_bytes(*v))));
        assert_eq!(found, gray.pixels());
        assert!(reader.rgb8(&small, name).is_err());
    }
}
