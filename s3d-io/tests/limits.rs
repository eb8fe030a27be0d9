//! Headers that claim more than their files can hold, each in an otherwise sound file, are refused at once
//! with an error that says so.

use s3d_geom::Raster;
use s3d_io::Result;
use s3d_io::cloud::*;
use s3d_io::image::*;
use s3d_io::mesh::*;
use std::fs;
use std::path::{Path, PathBuf};

fn fixture(name: &str) -> Vec<u8> {
    fs::read(
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("tests/fixtures/clouds")
            .join(name),
    )
    .unwrap()
}

fn file(dir: &tempfile::TempDir, name: &str, bytes: &[u8]) -> PathBuf {
    let path = dir.path().join(name);
    fs::write(&path, bytes).unwrap();
    path
}

fn says<T>(result: Result<T>, words: &str) {
    let message = result.err().expect("it is refused").to_string();
    assert!(message.contains(words), "{words:?} is not in {message}");
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

#[test]
fn sizes_of_images_are_held_against_their_files() {
    let dir = tempfile::tempdir().unwrap();
    let claim = |mut png: Vec<u8>, side: u32| {
        png[16..20].copy_from_slice(&side.to_be_bytes());
        png[20..24].copy_from_slice(&side.to_be_bytes());
        let crc = crc32(&png[12..29]);
        png[29..33].copy_from_slice(&crc.to_be_bytes());
        png
    };

    let rgb = encode_rgb8(&Raster::filled(8, 8, [1, 2, 3]), Content::Photo, Compression::Fast);
    let gray = encode_gray16(&Raster::filled(8, 8, 7), Compression::Fast);
    let rgb = file(&dir, "rgb.png", &claim(rgb, 20_000));
    says(read_rgb8(&rgb), "rgb.png: claims 20000 × 20000 pixels in");
    says(
        read_gray16(&file(&dir, "gray.png", &claim(gray.clone(), 20_000))),
        "claims 20000 × 20000 pixels in",
    );
    says(read_gray16(&file(&dir, "gray.png", &claim(gray, 40_000))), "are more than 1073741824");

    let mut exr = encode_xyz_float(&Raster::filled(4, 4, [1.0; 3]), Compression::Fast);
    for window in [&b"dataWindow\0box2i\0"[..], b"displayWindow\0box2i\0"] {
        let at = exr.windows(window.len()).position(|w| w == window).unwrap() + window.len() + 4;
        exr[at + 8..at + 12].copy_from_slice(&19_999u32.to_le_bytes());
        exr[at + 12..at + 16].copy_from_slice(&19_999u32.to_le_bytes());
    }
    says(read_xyz(&file(&dir, "xyz.exr", &exr)), "xyz.exr: claims 20000 × 20000 pixels in");
}

#[test]
fn points_of_clouds_are_held_against_their_files() {
    let dir = tempfile::tempdir().unwrap();
    let open = |path: PathBuf| Annotations::open(&[path], &AnnotationOptions::default());
    for (name, at, width) in
        [("1_4_format_7.laz", 247, 8), ("1_4_format_7.las", 247, 8), ("1_2_format_2.laz", 107, 4)]
    {
        let mut las = fixture(name);
        las[at..at + width].copy_from_slice(&2_000_000_000u64.to_le_bytes()[..width]);
        says(open(file(&dir, name, &las)), "claims 2000000000 points of");
    }
}

#[test]
fn meshes_that_are_placed_without_end_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let gltf = |nodes: usize, accessor: &str| {
        let children: Vec<String> = (0..nodes).map(|n| n.to_string()).collect();
        format!(
            "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[{}]}}],\"nodes\":[{}],\
             \"meshes\":[{{\"primitives\":\
             [{{\"attributes\":{{\"POSITION\":0}}}}]}}],\"accessors\":[{accessor}],\
             \"bufferViews\":[{{\"buffer\":0,\
             \"byteLength\":36}}],\"buffers\":[{{\"byteLength\":36,\"uri\":\"data:;base64,{}\"}}]}}",
            children.join(","),
            vec!["{\"mesh\":0}"; nodes].join(","),
            "A".repeat(48)
        )
    };
    let read = |text: &str| read_mesh(&file(&dir, "m.gltf", text.as_bytes()), UpAxis::Y);

    let large = "{\"bufferView\":0,\"componentType\":5126,\"count\":11000000,\"type\":\"VEC3\"}";
    says(read(&gltf(100, large)), "places 100 meshes of more than 1073741824 vertices");
    says(read(&gltf(2, large)), "11000000 elements of 12 bytes");

    let zeros = "{\"componentType\":5126,\"count\":1048577,\"type\":\"MAT4\",\"sparse\":{\"count\":1,\
                 \"indices\":{\
                 \"bufferView\":0,\"componentType\":5125},\"values\":{\"bufferView\":0}}}";
    says(read(&gltf(1, zeros)), "claims 1048577 elements without data");
}
