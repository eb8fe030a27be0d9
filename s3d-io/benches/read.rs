//! How fast are scans read, in bytes of their files a second? OBJ with its texture, glTF, PLY in all
//! encodings with and without labels (in faces a second too), and points of the S3DIS tree.
//!
//! The inputs are made here with fixed seeds, so that figures can be compared between machines.
//! `S3D_BENCH_MESH=rgb.obj` adds a real mesh. Files lie in a temporary folder, in the cache of the system.
#![allow(missing_docs, reason = "criterion's macros")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use image::{ImageBuffer, Rgb};
use s3d_geom::PointCloud;
use s3d_io::cloud::{PointReader, read_points};
use s3d_io::mesh::{UpAxis, read_mesh};
use std::fmt::Write;
use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};

/// A generator of numbers from 0 to 1 with a fixed sequence.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Writes a bumpy floor of `n` × `n` squares of two triangles each, with one JPEG texture of 1024².
fn write_obj(dir: &Path, n: usize) -> PathBuf {
    let mut random = Numbers(7);
    let image = ImageBuffer::from_fn(1024, 1024, |x, y| {
        Rgb([(x ^ y) as u8, (x / 4) as u8, (random.next() * 40.0) as u8])
    });
    image.save(dir.join("floor.jpg")).unwrap();
    fs::write(dir.join("floor.mtl"), "newmtl floor\nKd 1 1 1\nmap_Kd floor.jpg\n").unwrap();

    let mut obj = String::from("mtllib floor.mtl\nusemtl floor\n");
    for i in 0..=n {
        for j in 0..=n {
            let x = i as f64 * 0.02;
            let z = j as f64 * 0.02;
            writeln!(obj, "v {x:.6} {:.6} {z:.6}", random.next() * 0.01).unwrap();
            writeln!(obj, "vt {:.6} {:.6}", i as f64 / n as f64, j as f64 / n as f64).unwrap();
        }
    }

    for i in 0..n {
        for j in 0..n {
            let a = i * (n + 1) + j + 1;
            let (b, c, d) = (a + 1, a + n + 1, a + n + 2);
            writeln!(obj, "f {a}/{a} {b}/{b} {d}/{d}\nf {a}/{a} {d}/{d} {c}/{c}").unwrap();
        }
    }
    let path = dir.join(format!("floor_{n}.obj"));
    fs::write(&path, obj).unwrap();
    path
}

/// Writes the same floor as a `.glb` without a texture.
fn write_glb(dir: &Path, n: usize) -> PathBuf {
    let mut random = Numbers(7);
    let mut bin = Vec::new();
    for i in 0..=n {
        for j in 0..=n {
            for v in [i as f32 * 0.02, random.next() as f32 * 0.01, j as f32 * 0.02] {
                bin.extend(v.to_le_bytes());
            }
        }
    }
    let vertices = (n + 1) * (n + 1);
    let positions = bin.len();
    for i in 0..n {
        for j in 0..n {
            let a = (i * (n + 1) + j) as u32;
            let (b, c, d) = (a + 1, a + n as u32 + 1, a + n as u32 + 2);
            bin.extend([a, b, d, a, d, c].iter().flat_map(|v| v.to_le_bytes()));
        }
    }

    let count = 6 * n * n;
    let indices = bin.len() - positions;
    let mut json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": {}}}], "bufferViews": [
        {{"buffer": 0, "byteLength": {positions}}},
        {{"buffer": 0, "byteOffset": {positions}, "byteLength": {indices}}}],
        "accessors": [{{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": {vertices}}},
        {{"bufferView": 1, "componentType": 5125, "type": "SCALAR", "count": {count}}}],
        "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
        "nodes": [{{"mesh": 0}}]}}"#,
        bin.len()
    );
    while json.len() % 4 != 0 {
        json.push(' ');
    }

    let mut glb = b"glTF".to_vec();
    for word in [2, (28 + json.len() + bin.len()) as u32, json.len() as u32] {
        glb.extend(word.to_le_bytes());
    }
    glb.extend(b"JSON");
    glb.extend(json.bytes());
    glb.extend((bin.len() as u32).to_le_bytes());
    glb.extend(b"BIN\0");
    glb.extend(bin);
    let path = dir.join(format!("floor_{n}.glb"));
    fs::write(&path, glb).unwrap();
    path
}

/// Writes the same floor as a `.ply` with colours. `encoding` is its name in the header; with `labels`, each
/// face has a class and an object.
fn write_ply(dir: &Path, n: usize, encoding: &str, labels: bool) -> PathBuf {
    let mut random = Numbers(7);
    let columns = if labels {
        "property int category_id\nproperty int object_id\n"
    } else {
        ""
    };
    let mut file = format!(
        "ply\nformat {encoding} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {}\n\
         property list uchar int vertex_indices\n{columns}end_header\n",
        (n + 1) * (n + 1),
        2 * n * n
    )
    .into_bytes();

    let bytes = |bytes: [u8; 4]| match encoding {
        "binary_big_endian" => [bytes[3], bytes[2], bytes[1], bytes[0]],
        _ => bytes,
    };
    let ascii = encoding == "ascii";

    for i in 0..=n {
        for j in 0..=n {
            let position = [i as f32 * 0.02, random.next() as f32 * 0.01, j as f32 * 0.02];
            let color = [i as u8, j as u8, 128];
            if ascii {
                let ([x, y, z], [r, g, b]) = (position, color);
                file.extend(format!("{x:.6} {y:.6} {z:.6} {r} {g} {b}\n").bytes());
            } else {
                file.extend(position.iter().flat_map(|v| bytes(v.to_le_bytes())));
                file.extend(color);
            }
        }
    }

    for i in 0..n {
        for j in 0..n {
            let a = (i * (n + 1) + j) as u32;
            let (b, c, d) = (a + 1, a + n as u32 + 1, a + n as u32 + 2);
            for [p, q, r] in [[a, b, d], [a, d, c]] {
                let label: &[u32] = if labels { &[i as u32 % 40, j as u32] } else { &[] };
                if ascii {
                    let label: String = label.iter().map(|l| format!(" {l}")).collect();
                    file.extend(format!("3 {p} {q} {r}{label}\n").bytes());
                } else {
                    file.push(3);
                    file.extend([&[p, q, r], label].concat().iter().flat_map(|v| bytes(v.to_le_bytes())));
                }
            }
        }
    }

    let path = dir.join(format!("floor_{n}_{encoding}{}.ply", if labels { "_labels" } else { "" }));
    fs::write(&path, file).unwrap();
    path
}

/// Writes `n` points as the published tree has them.
fn write_points(dir: &Path, n: usize) -> PathBuf {
    let mut random = Numbers(7);
    let mut text = String::new();
    for _ in 0..n {
        let [x, y, z, r, g, b] = std::array::from_fn(|i| random.next() * if i < 3 { 20.0 } else { 255.0 });
        writeln!(text, "{x:.3} {y:.3} {z:.3} {r:.0} {g:.0} {b:.0}").unwrap();
    }
    let path = dir.join(format!("wall_{n}.txt"));
    fs::write(&path, text).unwrap();
    path
}

fn size(path: &Path) -> Throughput {
    Throughput::Bytes(fs::metadata(path).unwrap().len())
}

fn meshes(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let mut group = c.benchmark_group("read_mesh");
    group.sample_size(10);
    let mut paths = Vec::new();
    for n in [100, 400] {
        paths.extend([write_obj(dir.path(), n), write_glb(dir.path(), n)]);
    }
    paths.extend(std::env::var_os("S3D_BENCH_MESH").map(PathBuf::from));
    for path in paths {
        group.throughput(size(&path));
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        group.bench_function(name, |b| b.iter(|| read_mesh(black_box(&path), UpAxis::Y).unwrap()));
    }
}

fn ply(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let mut group = c.benchmark_group("read_ply_mesh");
    group.sample_size(10);
    let n = 400;
    for encoding in ["binary_little_endian", "binary_big_endian", "ascii"] {
        for labels in [false, true] {
            let path = write_ply(dir.path(), n, encoding, labels);
            let name = format!("{encoding}{}", if labels { "_labels" } else { "" });
            for (unit, throughput) in
                [("bytes", size(&path)), ("faces", Throughput::Elements(2 * (n * n) as u64))]
            {
                group.throughput(throughput);
                group.bench_function(format!("{name}/{unit}"), |b| {
                    b.iter(|| read_mesh(black_box(&path), UpAxis::Y).unwrap());
                });
            }
        }
    }
}

fn points(c: &mut Criterion) {
    let dir = tempfile::tempdir().unwrap();
    let mut group = c.benchmark_group("points");
    for n in [10_000, 1_000_000] {
        let path = write_points(dir.path(), n);
        group.throughput(size(&path));
        let mut cloud = PointCloud::default();
        group.bench_function(format!("read_points/{n}"), |b| {
            b.iter(|| {
                cloud.clear();
                read_points(black_box(&path), &mut cloud).unwrap();
            });
        });
        group.bench_function(format!("chunks_of_65536/{n}"), |b| {
            b.iter(|| {
                let mut reader = PointReader::open(black_box(&path)).unwrap();
                cloud.clear();
                while reader.read_chunk(65_536, &mut cloud).unwrap() > 0 {
                    cloud.clear();
                }
            });
        });
    }
}

criterion_group!(benches, meshes, ply, points);
criterion_main!(benches);
