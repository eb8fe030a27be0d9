//! What does our own deflate gain? It is compared with zlib-rs, libdeflate and fdeflate on the same images,
//! in files of about the same size.
//!
//! ```sh
//! s3d export scene.toml -o OUT --threads 1          # user time / locations = core-seconds a location
//! S3D_EXPORT=OUT cargo bench -p s3d-io --bench compressors
//! ```
//!
//! The images come from an export: `S3D_VIEWS` of its views (6), spread evenly, and one panorama. Without an
//! export they show a generated room. These combinations are all tried:
//!
//! - zlib-rs (through flate2), libdeflate (through libdeflater) and fdeflate, at some levels, on bytes that
//!   our own filters made, as none, up or Paeth: whole PNG files, written by the `png` crate;
//! - the `png` crate alone with its adaptive filter, over fdeflate and zlib-rs;
//! - the same libraries on the blocks of an OpenEXR file as ZIP prepares them (preparing costs all of them
//!   the same, and counts), and the `exr` crate alone.
//!
//! Ours is what an export calls. For each modality and library the bench prints
//!
//! - as small: the fastest way whose files are at most 5 % larger than ours, or else the fastest of those
//!   within 2 % of the smallest;
//! - as fast: the smallest way that takes at most 5 % more time than ours, or else the fastest;
//! - fastest: the fastest way, whatever the size.
//!
//! A time is the least processor time of some rounds in which all take turns, and a size is the ratio to
//! ours. `best` chooses among all libraries for each modality. A location has as many views as the export
//! kept for one on average, and a panorama.
#![allow(clippy::print_stdout, missing_docs)]

mod room;

use half::f16;
use libdeflater::{CompressionLvl, Compressor};
use s3d_deflate::exr::ZipBlock;
use s3d_deflate::png::{Filter, filter};
use s3d_deflate::{Deflater, Search};
use s3d_geom::Raster;
use s3d_io::image::{
    Compression, Content, encode_gray16, encode_rgb8, encode_xyz_half, read_gray16, read_rgb8, read_xyz,
};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::hint::black_box;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The largest ratio to ours that counts as equally small, or equally fast.
const LIKE_OURS: f64 = 1.05;
/// The number of lines in a block of OpenEXR's ZIP.
const BLOCK_LINES: usize = 16;
const MODALITIES: [&str; 6] = ["rgb", "depth", "normal", "semantic", "semantic_pretty", "global_xyz"];

enum Image {
    Colors(Raster<[u8; 3]>, Content),
    Depth(Raster<u16>),
    Coordinates(Raster<[f16; 3]>),
}

/// A way to make a file: library, level, filter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Way {
    library: Library,
    level: u8,
    filter: Filtering,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Library {
    ZlibRs,
    Libdeflate,
    Fdeflate,
    /// The `exr` crate's own ZIP, which is miniz_oxide at level 4.
    ExrCrate,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Filtering {
    None,
    Up,
    Paeth,
    /// By the `png` crate.
    Adaptive,
}

impl Way {
    fn name(self) -> String {
        let library = match self.library {
            Library::ZlibRs => format!("zlib-rs {}", self.level),
            Library::Libdeflate => format!("libdeflate {}", self.level),
            Library::Fdeflate => "fdeflate".to_owned(),
            Library::ExrCrate => "exr crate".to_owned(),
        };
        match self.filter {
            Filtering::None => library,
            Filtering::Up => format!("{library}, up"),
            Filtering::Paeth => format!("{library}, Paeth"),
            Filtering::Adaptive => format!("{library}, adaptive"),
        }
    }

    fn all_of(image: &Image) -> Vec<Self> {
        let levels = [
            (Library::Fdeflate, &[0][..]),
            (Library::ZlibRs, &[1, 2, 3, 4, 6]),
            (Library::Libdeflate, &[1, 2, 3, 4, 6]),
        ];
        let libraries = levels
            .iter()
            .flat_map(|(library, levels)| levels.iter().map(|level| (*library, *level)));
        let mut ways = Vec::new();

        for (library, level) in libraries {
            let filters = match image {
                Image::Coordinates(_) => &[Filtering::None][..],
                _ if library == Library::Libdeflate => &[Filtering::None, Filtering::Up, Filtering::Paeth],
                _ => &[Filtering::None, Filtering::Up, Filtering::Paeth, Filtering::Adaptive],
            };
            ways.extend(filters.iter().map(|&filter| Self { library, level, filter }));
        }

        if matches!(image, Image::Coordinates(_)) {
            ways.push(Self { library: Library::ExrCrate, level: 4, filter: Filtering::None });
        }
        ways
    }

    /// Compresses `data` to a zlib stream.
    fn zlib(self, data: &[u8]) -> Vec<u8> {
        match self.library {
            Library::ZlibRs => {
                let mut out = flate2::write::ZlibEncoder::new(
                    Vec::with_capacity(data.len() / 4 + 1024),
                    flate2::Compression::new(self.level.into()),
                );
                out.write_all(data).expect("memory takes any bytes");
                out.finish().expect("memory takes any bytes")
            }
            Library::Libdeflate => {
                let mut compressor = Compressor::new(
                    CompressionLvl::new(self.level.into()).expect("a level of the library's"),
                );
                let mut out = vec![0; compressor.zlib_compress_bound(data.len())];
                let len = compressor.zlib_compress(data, &mut out).expect("the bound is enough");
                out.truncate(len);
                out
            }
            Library::Fdeflate => fdeflate::compress_to_vec(data),
            Library::ExrCrate => unreachable!("it compresses whole files"),
        }
    }
}

/// Makes our file.
fn ours(image: &Image) -> Vec<u8> {
    match image {
        Image::Colors(pixels, content) => encode_rgb8(pixels, *content, Compression::Balanced),
        Image::Depth(pixels) => encode_gray16(pixels, Compression::Balanced),
        Image::Coordinates(pixels) => encode_xyz_half(pixels, Compression::Balanced),
    }
}

/// The samples of a PNG file.
struct Samples<'a> {
    width: u32,
    height: u32,
    format: Format,
    bytes: Cow<'a, [u8]>,
}

/// Returns the samples of an image that becomes a PNG file.
fn samples(image: &Image) -> Option<Samples<'_>> {
    match image {
        Image::Colors(pixels, _) => Some(Samples {
            width: pixels.width(),
            height: pixels.height(),
            format: (png::ColorType::Rgb, png::BitDepth::Eight, 3),
            bytes: pixels.pixels().as_flattened().into(),
        }),
        Image::Depth(pixels) => {
            let mut bytes = vec![0; 2 * pixels.len()];
            bytes
                .as_chunks_mut()
                .0
                .iter_mut()
                .zip(pixels.pixels())
                .for_each(|(pair, v)| *pair = v.to_be_bytes());
            let format = (png::ColorType::Grayscale, png::BitDepth::Sixteen, 2);
            Some(Samples { width: pixels.width(), height: pixels.height(), format, bytes: bytes.into() })
        }
        Image::Coordinates(_) => None,
    }
}

/// Returns the size of the file that a library makes.
fn theirs(image: &Image, way: Way) -> usize {
    if let Some(Samples { width, height, format, bytes }) = samples(image) {
        return black_box(png_file(width, height, format, &bytes, way)).len();
    }
    match image {
        Image::Coordinates(pixels) if way.library == Library::ExrCrate => exr_file(pixels),
        Image::Coordinates(pixels) => {
            let width = pixels.width() as usize;
            let mut block = ZipBlock::default();
            let blocks = pixels.pixels().chunks(BLOCK_LINES * width).map(|lines| {
                block.set(lines, width, f16::to_le_bytes).expect("whole lines");
                let data = block.differences();
                // There are eight bytes before each block and eight in the table. A block that does not
                // shrink is stored.
                16 + black_box(way.zlib(data)).len().min(data.len())
            });
            // The size of the header.
            313 + blocks.sum::<usize>()
        }
        _ => unreachable!("the others have samples"),
    }
}

type Format = (png::ColorType, png::BitDepth, usize);

fn png_file(width: u32, height: u32, (color, depth, pixel): Format, bytes: &[u8], way: Way) -> Vec<u8> {
    let mut file = Vec::with_capacity(bytes.len() / 4);
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let by = match way.filter {
        Filtering::None => Filter::None,
        Filtering::Up => Filter::Up,
        Filtering::Paeth => Filter::Paeth,
        Filtering::Adaptive => {
            encoder.set_filter(png::Filter::Adaptive);
            encoder.set_deflate_compression(match way.library {
                Library::Fdeflate => png::DeflateCompression::FdeflateUltraFast,
                _ => png::DeflateCompression::Level(way.level),
            });
            let written = encoder
                .write_header()
                .and_then(|mut writer| writer.write_image_data(bytes));
            written.expect("memory takes any bytes");
            return file;
        }
    };

    let compressed = way.zlib(&filter(bytes, width as usize * pixel, pixel, by).expect("whole lines"));
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_chunk(png::chunk::IDAT, &compressed)?;
        writer.finish()
    });
    written.expect("memory takes any bytes");
    file
}

fn exr_file(image: &Raster<[f16; 3]>) -> usize {
    use exr::prelude::*;
    let at = |p: Vec2<usize>| {
        let [r, g, b] = image.at(p.x() as u32, p.y() as u32);
        (r, g, b)
    };
    let encoding = Encoding {
        compression: exr::compression::Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (image.width() as usize, image.height() as usize);
    let layer = Layer::new(size, LayerAttributes::default(), encoding, SpecificChannels::rgb(at));
    let mut file = std::io::Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut file)
        .expect("memory takes any bytes");
    file.into_inner().len()
}

/// Returns the processor time of this thread in milliseconds.
#[cfg(target_os = "linux")]
fn now() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

#[cfg(not(target_os = "linux"))]
fn now() -> f64 {
    static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    START.elapsed().as_secs_f64() * 1e3
}

/// The least time, and the size.
#[derive(Clone, Copy, Debug)]
struct Cost {
    ms: f64,
    bytes: f64,
}

impl Cost {
    fn measure(&mut self, encode: impl FnOnce() -> usize) {
        let start = now();
        self.bytes = encode() as f64;
        self.ms = self.ms.min(now() - start);
    }
}

const UNKNOWN: Cost = Cost { ms: f64::INFINITY, bytes: 0.0 };

/// Returns the mean costs of our way and of all others, over some images of one modality.
fn measure(images: &[Image], rounds: usize) -> (Cost, BTreeMap<Way, Cost>) {
    let mut mean = (Cost { ms: 0.0, bytes: 0.0 }, BTreeMap::new());
    let n = images.len() as f64;
    let add = |sum: &mut Cost, cost: Cost| {
        sum.ms += cost.ms / n;
        sum.bytes += cost.bytes / n;
    };
    for image in images {
        let mut own = UNKNOWN;
        let mut others: BTreeMap<Way, Cost> =
            Way::all_of(image).into_iter().map(|way| (way, UNKNOWN)).collect();
        for _ in 0..rounds {
            for (i, (way, cost)) in others.iter_mut().enumerate() {
                if i % 4 == 0 {
                    own.measure(|| black_box(ours(image)).len());
                }
                cost.measure(|| theirs(image, *way));
            }
        }
        add(&mut mean.0, own);
        for (way, cost) in others {
            add(mean.1.entry(way).or_insert(Cost { ms: 0.0, bytes: 0.0 }), cost);
        }
    }
    mean
}

/// Chooses the ways that are as small as ours, as fast as ours, and the fastest; see the head of this file.
fn choices<'a>(
    own: Cost,
    ways: impl Iterator<Item = (&'a Way, &'a Cost)>,
) -> Option<[(Way, Cost); CHOICES.len()]> {
    let ways: Vec<(Way, Cost)> = ways.map(|(way, cost)| (*way, *cost)).collect();
    let by_time = |a: &&(Way, Cost), b: &&(Way, Cost)| a.1.ms.total_cmp(&b.1.ms);
    let by_size = |a: &&(Way, Cost), b: &&(Way, Cost)| a.1.bytes.total_cmp(&b.1.bytes);
    let smallest = ways.iter().min_by(by_size)?;
    let fastest = ways.iter().min_by(by_time)?;
    let small = (LIKE_OURS * own.bytes).max(1.02 * smallest.1.bytes);
    let small = ways.iter().filter(|(_, cost)| cost.bytes <= small).min_by(by_time)?;
    let fast = ways
        .iter()
        .filter(|(_, cost)| cost.ms <= LIKE_OURS * own.ms)
        .min_by(by_size)
        .unwrap_or(fastest);
    Some([*small, *fast, *fastest])
}

const CHOICES: [&str; 3] = ["as small", "as fast", "fastest"];

/// The sums over all modalities: our costs, and the costs of a library's choices.
#[derive(Clone, Copy)]
struct Total {
    own: Cost,
    theirs: [Cost; CHOICES.len()],
}

/// The last one takes the best library for each modality.
const LIBRARIES: [(&str, &[Library]); 5] = [
    ("zlib-rs", &[Library::ZlibRs]),
    ("libdeflate", &[Library::Libdeflate]),
    ("fdeflate", &[Library::Fdeflate]),
    ("exr crate", &[Library::ExrCrate]),
    ("best", &[Library::ZlibRs, Library::Libdeflate, Library::Fdeflate, Library::ExrCrate]),
];

fn report(title: &str, images: &[Vec<Image>], rounds: usize) -> [Total; LIBRARIES.len()] {
    println!("\n{title}\n");
    println!(
        "| modality | ours: ms, kB | library | {} |",
        CHOICES.map(|choice| format!("{choice}: ms (size)")).join(" | ")
    );
    println!("|---|---|---|---|---|---|");
    let zero = Cost { ms: 0.0, bytes: 0.0 };
    let mut totals = [Total { own: zero, theirs: [zero; CHOICES.len()] }; LIBRARIES.len()];
    let add = |sum: &mut Cost, cost: Cost| {
        sum.ms += cost.ms;
        sum.bytes += cost.bytes;
    };
    for (modality, images) in MODALITIES.iter().zip(images) {
        let (own, others) = measure(images, rounds);
        for ((name, libraries), total) in LIBRARIES.into_iter().zip(&mut totals) {
            let Some(chosen) =
                choices(own, others.iter().filter(|(way, _)| libraries.contains(&way.library)))
            else {
                continue;
            };
            add(&mut total.own, own);
            total
                .theirs
                .iter_mut()
                .zip(&chosen)
                .for_each(|(sum, (_, cost))| add(sum, *cost));
            let cell = |(way, cost): (Way, Cost)| {
                format!("{:.1} ({:.2}), {}", cost.ms, cost.bytes / own.bytes, way.name())
            };
            let chosen = chosen.map(cell).join(" | ");
            println!("| {modality} | {:.1}, {:.0} | {name} | {chosen} |", own.ms, own.bytes / 1e3);
        }
    }
    totals
}

/// Our fixed filters against the `png` crate's adaptive one: the time of the filter, and the size that our
/// deflate makes of it.
fn report_filters(images: &[Vec<Image>], rounds: usize) {
    println!("\n| filter | ours: ms, kB | adaptive, by the png crate: ms, kB by our deflate |");
    println!("|---|---|---|");
    let fast = Way { library: Library::Fdeflate, level: 0, filter: Filtering::Adaptive };
    for (modality, images) in MODALITIES.iter().zip(images) {
        let (mut fixed, mut adaptive) = (Cost { ms: 0.0, bytes: 0.0 }, Cost { ms: 0.0, bytes: 0.0 });
        let n = images.len() as f64;
        for image in images {
            let Some(Samples { width, height, format, bytes }) = samples(image) else { continue };
            let (_, _, pixel) = format;
            let line = width as usize * pixel;
            let (by, search) = match image {
                Image::Colors(_, Content::Photo) => (Filter::Paeth, Search::photo(1 + line)),
                Image::Colors(_, Content::Normals) => (Filter::None, Search::smooth(1 + line)),
                Image::Colors(_, Content::Labels) => (Filter::Up, Search::labels(1 + line)),
                _ => (Filter::Paeth, Search::depth(1 + line)),
            };
            let compress = |filtered: &[u8]| {
                let mut out = Vec::new();
                Deflater::new(search)
                    .expect("searches are in range")
                    .zlib(filtered, None, &mut out);
                out.len()
            };

            let filtered = filter(&bytes, line, pixel, by).expect("whole lines");
            let adapted = idat(&png_file(width, height, format, &bytes, fast));
            let adapted = fdeflate::decompress_to_vec(&adapted).expect("a zlib stream");

            let mut ours = UNKNOWN;
            let mut whole = UNKNOWN;
            let mut stream = UNKNOWN;
            for _ in 0..rounds {
                ours.measure(|| black_box(filter(&bytes, line, pixel, by)).map_or(0, |bytes| bytes.len()));
                // The crate filters and compresses in one go.
                whole.measure(|| black_box(png_file(width, height, format, &bytes, fast)).len());
                stream.measure(|| black_box(fast.zlib(&adapted)).len());
            }

            fixed.ms += ours.ms / n;
            fixed.bytes += compress(&filtered) as f64 / n;
            adaptive.ms += (whole.ms - stream.ms) / n;
            adaptive.bytes += compress(&adapted) as f64 / n;
        }
        if fixed.bytes > 0.0 {
            let (a, b) = (fixed.bytes / 1e3, adaptive.bytes / 1e3);
            println!("| {modality} | {:.1}, {a:.0} | {:.1}, {b:.0} ({:.2}) |", fixed.ms, adaptive.ms, b / a);
        }
    }
}

/// Returns the zlib stream of a PNG file.
fn idat(file: &[u8]) -> Vec<u8> {
    let mut stream = Vec::new();
    let mut rest = &file[8..];
    while let Some((length, next)) = rest.split_first_chunk() {
        let (content, next) = next[4..].split_at(u32::from_be_bytes(*length) as usize);
        if rest[4..8] == *b"IDAT" {
            stream.extend_from_slice(content);
        }
        rest = &next[4..];
    }
    stream
}

fn print_totals(title: &str, totals: &[Total; LIBRARIES.len()]) {
    println!(
        "\n| {title} | ours: ms, kB | {} |",
        CHOICES
            .map(|choice| format!("{choice}: ms (size), ours saves"))
            .join(" | ")
    );
    println!("|---|---|---|---|---|");
    let all = totals[LIBRARIES.len() - 1].own.bytes;
    // A library that makes only some modalities has no total.
    for ((name, _), Total { own, theirs }) in LIBRARIES.iter().zip(totals).filter(|(_, t)| t.own.bytes == all)
    {
        let cell = |cost: Cost| {
            format!("{:.0} ({:.2}), {:.0} ms", cost.ms, cost.bytes / own.bytes, cost.ms - own.ms)
        };
        println!("| {name} | {:.0}, {:.0} | {} |", own.ms, own.bytes / 1e3, theirs.map(cell).join(" | "));
    }
}

/// Returns the files of a folder, in order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    files
}

fn read(path: &Path, modality: &str) -> Image {
    let rgb = |content| Image::Colors(read_rgb8(path).expect("an image of an export"), content);
    match modality {
        "rgb" => rgb(Content::Photo),
        "depth" => Image::Depth(read_gray16(path).expect("an image of an export")),
        "normal" => rgb(Content::Normals),
        "global_xyz" => Image::Coordinates(
            read_xyz(path)
                .expect("an image of an export")
                .map(|p| p.map(f16::from_f32)),
        ),
        _ => rgb(Content::Labels),
    }
}

/// Reads `count` images of each modality, spread evenly over its folder. Also returns how many a modality
/// has.
fn spread(folder: &Path, count: usize) -> (Vec<Vec<Image>>, usize) {
    let mut n = 0;
    let images = MODALITIES.map(|modality| {
        let files = files(&folder.join(modality));
        n = files.len();
        let count = count.min(n);
        (0..count)
            .map(|i| read(&files[(2 * i + 1) * n / (2 * count)], modality))
            .collect()
    });
    (images.into(), n)
}

/// Returns the images of the generated room, one of each modality.
fn generated() -> Vec<Vec<Image>> {
    let room::Images { photo, depth, normals, labels, pretty, xyz } = room::images();
    let images = [
        Image::Colors(photo, Content::Photo),
        Image::Depth(depth),
        Image::Colors(normals, Content::Normals),
        Image::Colors(labels, Content::Labels),
        Image::Colors(pretty, Content::Labels),
        Image::Coordinates(xyz.map(|p| p.map(f16::from_f32))),
    ];
    images.into_iter().map(|image| vec![image]).collect()
}

fn number(variable: &str, default: usize) -> usize {
    std::env::var(variable)
        .ok()
        .and_then(|text| text.parse().ok())
        .unwrap_or(default)
}

fn main() {
    let rounds = number("S3D_ROUNDS", 3);
    let Some(export) = std::env::var_os("S3D_EXPORT").map(PathBuf::from) else {
        let images = generated();
        let totals = report("A view of a generated room", &images, rounds);
        print_totals("view", &totals);
        report_filters(&images, rounds);
        return;
    };

    let area = files(&export)
        .into_iter()
        .find(|p| p.join("data/rgb").is_dir())
        .expect("an area of an export");
    let (views, kept) = spread(&area.join("data"), number("S3D_VIEWS", 6));
    let (panoramas, locations) = spread(&area.join("pano"), 1);

    let images = views;
    let views = report(&format!("Views: {} of {kept}", images[0].len()), &images, rounds);
    print_totals("view", &views);
    report_filters(&images, rounds);
    let panoramas = report("Panorama", &panoramas, rounds.min(2));
    print_totals("panorama", &panoramas);

    let n = kept as f64 / locations as f64;
    let mut totals = views;
    for (total, panorama) in totals.iter_mut().zip(panoramas) {
        let join = |view: Cost, panorama: Cost| Cost {
            ms: n * view.ms + panorama.ms,
            bytes: n * view.bytes + panorama.bytes,
        };
        total.own = join(total.own, panorama.own);
        for (sum, panorama) in total.theirs.iter_mut().zip(panorama.theirs) {
            *sum = join(*sum, panorama);
        }
    }

    print_totals(&format!("location: {n:.1} views and a panorama"), &totals);
}
