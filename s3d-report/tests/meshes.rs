//! The meshes of a report and the faces of its pictures are read back by `s3d_report::files` and compared
//! with the files of the data set.

use crate::common;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use common::{data_set, numbers, pair, value};
use flate2::read::ZlibDecoder;
use s3d_dataset::{Context, DataSet};
use s3d_geom::glam::{DVec3, dvec3};
use s3d_geom::{FaceColor, TriMesh};
use s3d_io::dataset::{Domain, Frame};
use s3d_io::image::{decode_rgb8, decode_xyz};
use s3d_label::LabelId;
use s3d_report::{ReportOptions, report};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::Read;
use std::path::Path;

const SMALL: ReportOptions = ReportOptions {
    pano_width: 64,
    thumbs: 24,
    mesh_faces: 1_000_000,
    verify: false,
    single: false,
    scores: Vec::new(),
    poster: None,
    overwrite: false,
};

/// Packed numbers of this many bytes each.
fn unpacked(value: &Value, bytes: usize) -> Vec<u32> {
    let stream = BASE64_STANDARD.decode(value.as_str().unwrap()).unwrap();
    let mut all = Vec::new();
    ZlibDecoder::new(&*stream).read_to_end(&mut all).unwrap();
    let number = |le: &[u8]| le.iter().rev().fold(0, |sum, byte| (sum << 8) | u32::from(*byte));
    all.chunks(bytes).map(number).collect()
}

/// A face of a report's mesh.
struct Face {
    corners: [DVec3; 3],
    uvs: Option<[[f64; 2]; 3]>,
    material: usize,
}

/// All faces of the mesh of area 1, by their indices in the data set.
fn faces(to: &Path, mesh: &Value) -> BTreeMap<u32, Face> {
    let mut faces = BTreeMap::new();
    for k in 0..mesh["files"].as_u64().unwrap() {
        let part = value(to, &format!("mesh_1_{k}"));
        let number = |list: &str, i: usize| part[list][i].as_f64().unwrap();
        let (position, index) = (unpacked(&part["position"], 2), unpacked(&part["index"], 4));
        let (face, material) = (unpacked(&part["face"], 4), unpacked(&part["material"], 2));
        let uv = (!part["uv"].is_null()).then(|| unpacked(&part["uv"], 2));
        assert_eq!(position.len() as u64, 3 * part["vertices"].as_u64().unwrap());
        assert!(face.len() <= 65_536 && face.len() as u64 == part["faces"].as_u64().unwrap());
        assert!(material.is_sorted(), "faces of a material lie together");
        for i in 0..face.len() {
            let corner = |c: usize| {
                let at = 3 * index[3 * i + c] as usize;
                let axis = |a: usize| number("origin", a) + number("step", a) * f64::from(position[at + a]);
                dvec3(axis(0), axis(1), axis(2))
            };
            let uv = |c: usize| {
                let axis = |a: usize| {
                    let step = f64::from(uv.as_ref().unwrap()[2 * (3 * i + c) + a]);
                    number("uv_origin", a) + number("uv_step", a) * step
                };
                [axis(0), axis(1)]
            };
            let uvs = (!part["uv"].is_null()).then(|| [0, 1, 2].map(uv));
            let found = Face { corners: [0, 1, 2].map(corner), uvs, material: material[i] as usize };
            assert!(faces.insert(face[i], found).is_none(), "face {} is there twice", face[i]);
        }
    }
    assert_eq!(faces.len() as u64, mesh["shown"].as_u64().unwrap());
    faces
}

/// The distance of a point from a triangle's plane, and from its box.
fn off(place: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let plane = (place - a).dot((b - a).cross(c - a).normalize()).abs();
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    plane.max((place - place.clamp(low, high)).abs().max_element())
}

fn world(mesh: &TriMesh, face: u32) -> [DVec3; 3] {
    mesh.triangle(face).map(|p| p.as_dvec3())
}

#[test]
fn faces_have_their_places_textures_and_votes_and_pictures_show_them() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let to = dir.path().join("report");
    let made = report(&out, &to, &SMALL, &Context::default()).unwrap();
    assert_eq!(made.faults, []);
    let data = DataSet::open(&out).unwrap();
    let (file, votes) = (data.mesh(1).unwrap().unwrap(), data.face_votes(1).unwrap().unwrap());
    let mesh = &file.mesh;
    let index = value(&to, "index");
    let entry = &index["meshes"][0];
    assert_eq!((entry["area"].as_u64(), entry["faces"].as_u64()), (Some(1), Some(mesh.faces().len() as u64)));
    assert!(entry["cell_m"].is_null());

    let shown = faces(&to, entry);
    assert!(shown.keys().copied().eq(0..mesh.faces().len() as u32));
    let textures = mesh.textures().len();
    let kept: Vec<Value> = (0..entry["texture_files"].as_u64().unwrap())
        .flat_map(|k| value(&to, &format!("textures_1_{k}")).as_array().unwrap().clone())
        .collect();
    assert_eq!(kept.len(), textures);
    let mut textured = 0;
    for (face, found) in &shown {
        for (p, q) in world(mesh, *face).iter().zip(found.corners) {
            assert!(p.distance(q) < 1e-3, "face {face}: {p} and {q}");
        }
        let material = &entry["materials"][found.material];
        match mesh.color_of(*face) {
            FaceColor::Texture(texture, _, uvs) => {
                assert_eq!(material["texture"].as_u64(), Some(u64::from(texture)));
                textured += 1;
                let found = found.uvs.unwrap();
                // Repeated textures: coordinates may differ by whole numbers, the same for all corners.
                for c in 0..3 {
                    for axis in 0..2 {
                        let apart = f64::from(uvs[c][axis]) - found[c][axis];
                        let first = f64::from(uvs[0][axis]) - found[0][axis];
                        assert!((apart - apart.round()).abs() < 1e-3, "face {face}: {apart}");
                        assert!((apart - first).abs() < 2e-3, "face {face}");
                    }
                }
            }
            _ => assert!(material["texture"].is_null()),
        }
    }
    assert!(textured > 100);

    let told = value(&to, "faces_1");
    let (label, margin) = (unpacked(&told["label"], 4), unpacked(&told["margin"], 1));
    assert_eq!((&label, unpacked(&told["runner_up"], 4)), (&votes.label, votes.runner_up.clone()));
    for face in 0..label.len() {
        let [first, second, all] =
            [votes.votes[face], votes.runner_up_votes[face], votes.total[face]].map(f64::from);
        match margin[face] {
            255 => assert_eq!(all, 0.0),
            margin => assert!((f64::from(margin) / 254.0 - (first - second) / all).abs() < 0.002),
        }
    }
    let table = data.labels().unwrap().unwrap();
    let chair = index["classes"]
        .as_array()
        .unwrap()
        .iter()
        .position(|c| c["name"] == "chair")
        .unwrap();
    let is_chair = |face: &u32| {
        table
            .class_of(LabelId(votes.label[*face as usize]))
            .is_some_and(|class| class.name() == "chair")
    };
    let chairs: Vec<u32> = (0..mesh.faces().len() as u32).filter(is_chair).collect();
    let m2: f64 = chairs.iter().map(|face| mesh.area(*face)).sum();
    let told = &index["surface_by_class"][chair];
    assert!(told["faces"] == chairs.len() as u64 && m2 > 1.0, "{told}");
    assert!((told["m2"].as_f64().unwrap() - m2).abs() < 1e-9 * m2, "{told}");
    let boxes = value(&to, "boxes_1");
    let instances = data.instances(1).unwrap();
    assert_eq!(boxes.as_array().unwrap().len(), instances.len());
    assert!(boxes[0]["label"] == instances[0].label_index && boxes[0]["box"][5] == instances[0].bbox[5]);

    // Each pixel's face has the pixel's label and contains its point.
    let views = index["views"].as_array().unwrap();
    let mut held = 0;
    for image in data.images(1) {
        let at = |domain| image.path(data.layout(), domain);
        let read = |domain| data.read(&at(domain)).unwrap();
        let own = decode_rgb8(&read(Domain::Semantic), &at(Domain::Semantic)).unwrap();
        let xyz = decode_xyz(&read(Domain::GlobalXyz), &at(Domain::GlobalXyz)).unwrap();
        let locations = index["locations"].as_array().unwrap();
        let place = locations.iter().position(|l| l["uuid"] == image.uuid).unwrap();
        let picture = match image.frame {
            Frame::Panorama => value(&to, &format!("pano_{place}")),
            Frame::View(frame) => {
                let named = |view: &&Value| view["location"] == place && view["frame"] == frame;
                let n = views.iter().find(named).unwrap()["picture"].as_u64().unwrap() as usize;
                value(&to, &format!("views_{}", n / 12))[n % 12].clone()
            }
        };
        let (of, size, face) = (pair(&picture["of"]), pair(&picture["size"]), numbers(&picture["face"]));
        for j in 0..size[1] {
            for i in 0..size[0] {
                let [x, y] = [(i, 0), (j, 1)].map(|(i, a)| (2 * i + 1) * of[a] / (2 * size[a]));
                let (pixel, face) = (own.at(x, y), face.at(i, j));
                assert_eq!(face == 0xff_ffff, pixel == [13; 3], "{x}, {y} of {}", image.stem());
                let Some(found) = shown.get(&face) else { continue };
                let [r, g, b] = pixel;
                assert_eq!(label[face as usize], u32::from_be_bytes([0, r, g, b]));
                let place = DVec3::from_array(xyz.at(x, y).map(f64::from));
                assert!(off(place, found.corners) < 0.02, "{place} and face {face}");
                held += 1;
            }
        }
    }
    assert!(held > 10_000, "{held}");
}

#[test]
fn the_spread_of_votes_is_that_of_the_faces() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let to = dir.path().join("report");
    report(&out, &to, &SMALL, &Context::default()).unwrap();
    let data = DataSet::open(&out).unwrap();
    let (file, votes) = (data.mesh(1).unwrap().unwrap(), data.face_votes(1).unwrap().unwrap());
    let faces = 0..file.mesh.faces().len();
    let holds = |told: &Value, is: &dyn Fn(usize) -> bool| {
        let found: Vec<usize> = faces.clone().filter(|face| is(*face)).collect();
        let m2: f64 = found.iter().map(|face| file.mesh.area(*face as u32)).sum();
        assert_eq!(told["faces"], found.len(), "{told}");
        assert!((told["m2"].as_f64().unwrap() - m2).abs() <= 1e-9 * m2, "{told}, not {m2}");
        found.len()
    };
    let spread = &value(&to, "index")["meshes"][0]["spread"];
    let mut sum = 0;
    for (k, told) in spread["votes"].as_array().unwrap().iter().enumerate() {
        let range = match k {
            0 => 0..=0,
            1 => 1..=1,
            k => (1 << (k - 2)) + 1..=1 << (k - 1),
        };
        sum += holds(told, &|face| range.contains(&votes.total[face]));
    }
    assert!(sum == faces.len() && spread["votes"].as_array().unwrap().len() > 4, "{spread}");
    let mut sum = 0;
    for (k, told) in spread["margin"].as_array().unwrap().iter().enumerate() {
        sum += holds(told, &|face| {
            let [first, second, all] =
                [votes.votes[face], votes.runner_up_votes[face], votes.total[face]].map(f64::from);
            let part = 10.0 * (first - second) / all;
            all > 0.0 && (part.floor() == k as f64 || part == 10.0 && k == 9)
        });
    }
    assert_eq!(sum, votes.total.iter().filter(|all| **all > 0).count());
    // More than one bin has faces, so that exchanged bins would be found.
    assert!(
        spread["margin"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|part| part["faces"] != 0)
            .count()
            > 2
    );
}

#[test]
fn a_large_mesh_is_simplified_and_its_faces_keep_their_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), true);
    let to = dir.path().join("report");
    let options = ReportOptions { mesh_faces: 1000, ..SMALL };
    report(&out, &to, &options, &Context::default()).unwrap();
    let data = DataSet::open(&out).unwrap();
    let file = data.mesh(1).unwrap().unwrap();
    let index = value(&to, "index");
    let entry = &index["meshes"][0];
    let shown = faces(&to, entry);
    let cell = entry["cell_m"].as_f64().unwrap();
    assert!((100..=1000).contains(&shown.len()) && cell > 0.01, "{} faces, {cell} m", shown.len());
    let far = cell * 3f64.sqrt() + 1e-3;
    for (face, found) in &shown {
        for (p, q) in world(&file.mesh, *face).iter().zip(found.corners) {
            assert!(p.distance(q) <= far, "face {face}: {p} and {q}, cells of {cell} m");
        }
    }
    // Tables by face index have an entry for every face.
    let told = value(&to, "faces_1");
    assert_eq!(unpacked(&told["label"], 4).len(), file.mesh.faces().len());
    assert!(value(&to, "pano_0")["face"].is_string());
}

#[test]
fn without_its_mesh_all_else_is_shown() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path(), false);
    let data = DataSet::open(&out).unwrap();
    let to = dir.path().join("whole");
    report(&out, &to, &SMALL, &Context::default()).unwrap();
    let entry = &value(&to, "index")["meshes"][0];
    assert!(entry["has_votes"] == false && entry["has_boxes"] == false && entry["spread"].is_null());
    assert!(!to.join("data/faces_1.js").exists() && !to.join("data/boxes_1.js").exists());

    std::fs::write(data.layout().rgb_obj(1), "f 1 2 3").unwrap();
    let to = dir.path().join("damaged");
    let made = report(&out, &to, &SMALL, &Context::default()).unwrap();
    assert_eq!(made.faults.len(), 1, "{:?}", made.faults);
    assert_eq!(made.faults[0].path, "area_1/3d/rgb.obj");
    assert!(value(&to, "index")["meshes"].as_array().unwrap().is_empty());
    let picture = value(&to, "pano_0");
    assert!(picture["face"].is_null() && picture["depth"].is_string());
}
