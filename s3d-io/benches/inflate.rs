//! What does our own inflater gain? It reads the streams of our PNG files, against fdeflate, libdeflate and
//! zlib-rs.
//!
//! ```sh
//! S3D_EXPORT=OUT cargo bench -p s3d-io --bench inflate
//! ```
//!
//! The images are six views of an export, spread evenly, or else images of a generated room. Each library
//! fills memory of a known size. Ours and fdeflate leave out the checksum, as the png crate does with
//! fdeflate.
#![allow(missing_docs)]

#[expect(dead_code, reason = "not all images of the room are PNG")]
mod room;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use flate2::FlushDecompress::Finish;
use s3d_deflate::Inflater;
use s3d_io::image::{Compression, Content, encode_gray16, encode_rgb8};
use std::hint::black_box;
use std::path::Path;

const VIEWS: usize = 6;

/// Returns the zlib stream of a PNG file, and the number of bytes that it inflates to.
fn stream(file: &[u8]) -> (Vec<u8>, usize) {
    let mut stream = Vec::new();
    let mut rest = &file[8..];
    let mut len = 0;
    while let Some((length, next)) = rest.split_first_chunk() {
        let (content, next) = next[4..].split_at(u32::from_be_bytes(*length) as usize);
        match &rest[4..8] {
            b"IHDR" => {
                let side = |at: usize| {
                    u32::from_be_bytes(*content[at..].first_chunk().expect("four bytes")) as usize
                };
                let pixel = if content[9] == 0 { 2 } else { 3 };
                len = side(4) * (1 + pixel * side(0));
            }
            b"IDAT" => stream.extend_from_slice(content),
            _ => {}
        }
        rest = &next[4..];
    }
    (stream, len)
}

/// Reads the files of some views of an export.
fn views(export: &Path, modality: &str) -> Vec<Vec<u8>> {
    let files = |folder: &Path| {
        let entries = std::fs::read_dir(folder).expect("a folder of an export");
        let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
        files.sort();
        files
    };
    let area = files(export)
        .into_iter()
        .find(|p| p.join("data/rgb").is_dir())
        .expect("an area of an export");

    let views = files(&area.join("data").join(modality));
    let n = VIEWS.min(views.len());
    let spread = (0..n).map(|i| &views[(2 * i + 1) * views.len() / (2 * n)]);
    spread
        .map(|view| std::fs::read(view).expect("an image of an export"))
        .collect()
}

fn inflate(c: &mut Criterion) {
    let export = std::env::var_os("S3D_EXPORT");
    let room = room::images();
    let rgb8 = |image, content| encode_rgb8(image, content, Compression::Balanced);
    let generated = [
        ("rgb", rgb8(&room.photo, Content::Photo)),
        ("depth", encode_gray16(&room.depth, Compression::Balanced)),
        ("normal", rgb8(&room.normals, Content::Normals)),
        ("semantic", rgb8(&room.labels, Content::Labels)),
    ];
    for (modality, file) in generated {
        let files = export
            .as_ref()
            .map_or_else(|| vec![file], |export| views(export.as_ref(), modality));

        let streams: Vec<_> = files.iter().map(|file| stream(file)).collect();
        let mut out = vec![0; streams.iter().map(|(_, len)| *len).max().unwrap_or(0)];

        let mut group = c.benchmark_group(format!("inflate/{modality}"));
        group.throughput(Throughput::Bytes(streams.iter().map(|(_, len)| *len as u64).sum()));

        let mut bench = |name: &str, one: &mut dyn FnMut(&[u8], &mut [u8])| {
            group.bench_function(name, |b| {
                b.iter(|| {
                    streams
                        .iter()
                        .for_each(|(stream, len)| one(stream, black_box(&mut out[..*len])))
                });
            });
        };

        let mut inflater = Inflater::default();
        bench("ours", &mut |stream, out| inflater.zlib_without_checksum(stream, out).expect("our stream"));
        bench("fdeflate", &mut |stream, out| {
            let mut decompressor = fdeflate::Decompressor::new();
            decompressor.ignore_adler32();
            decompressor.read(stream, out, 0, true).expect("our stream");
        });
        let mut libdeflate = libdeflater::Decompressor::new();
        bench("libdeflate", &mut |stream, out| {
            libdeflate.zlib_decompress(stream, out).expect("our stream");
        });
        let mut zlib_rs = flate2::Decompress::new(true);
        bench("zlib-rs", &mut |stream, out| {
            zlib_rs.reset(true);
            zlib_rs.decompress(stream, out, Finish).expect("our stream");
        });
        group.finish();
    }
}

criterion_group!(benches, inflate);
criterion_main!(benches);
