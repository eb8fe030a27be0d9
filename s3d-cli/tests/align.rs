//! `s3d align`: where a mesh or cloud lies in the frame of another one.

use crate::common;
use common::{s3d, s3d_fails, s3d_ok, text};
use s3d_dataset::{MeshAxes, read_mesh};
use s3d_geom::glam::{DAffine3, DMat4, DVec3, Vec3};
use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_io::cloud::read_point_sample;
use s3d_io::mesh::{MeshOrigin, MeshOut, write_ply_mesh};
use s3d_synth::scenes::furnished_room;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

/// Far from the origin, as in UTM.
const FAR_M: DVec3 = DVec3::new(500_000.0, 5_400_000.0, 300.0);

fn there() -> DAffine3 {
    DAffine3::from_translation(DVec3::new(12.0, -7.0, 1.0)) * DAffine3::from_rotation_z(2.1)
}

fn write(path: &Path, mesh: &TriMesh, motion: &DAffine3) {
    let move_one = |p: &Vec3| motion.transform_point3(p.as_dvec3()).as_vec3();
    let positions: Vec<Vec3> = mesh.positions().iter().map(move_one).collect();
    let out = MeshOut { positions: &positions, faces: mesh.faces(), ..MeshOut::default() };
    write_ply_mesh(path, &out).unwrap();
}

/// The matrix of an answer.
fn transform(answer: &str) -> DAffine3 {
    let line = answer
        .lines()
        .find_map(|line| line.strip_prefix("transform = "))
        .unwrap();
    let rows: Vec<Vec<f64>> = serde_json::from_str(line).unwrap();
    let numbers = rows.concat();
    DAffine3::from_mat4(DMat4::from_cols_slice(&numbers).transpose())
}

#[test]
fn a_moved_room_is_found_and_brought_back() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let room = furnished_room(9);
    write(&at("a.ply"), &room, &DAffine3::IDENTITY);
    write(&at("b.ply"), &room, &there());

    let [a, b, moved] = ["a.ply", "b.ply", "moved.ply"].map(at);
    let frame = ["--up-a", "z", "--up-b", "z", "--units-a", "m", "--units-b", "m"];
    let call = [&["align", text(&a), text(&b), "-o", text(&moved)], &frame[..]].concat();
    let output = s3d(&call);
    assert!(output.status.success(), "{output:?}");
    let answer = String::from_utf8(output.stdout).unwrap();
    assert!(transform(&answer).abs_diff_eq(there(), 0.003), "{answer}");
    assert!(answer.contains("is_certain = true"), "{answer}");

    let axes = MeshAxes { up: Some(s3d_io::mesh::UpAxis::Z), units: Some(s3d_io::mesh::LengthUnit::Metre) };
    let read = |path: &Path| {
        read_mesh(path, axes, MeshOrigin::OfFile, &Default::default())
            .unwrap()
            .mesh
    };
    for (p, q) in read(&moved).positions().iter().zip(read(&b).positions()) {
        assert!(p.distance(*q) < 0.005, "{p} {q}");
    }
    s3d_fails(&call, 2, &["moved.ply", "--overwrite"]);
}

#[test]
fn a_cloud_far_away_is_found() {
    let dir = tempfile::tempdir().unwrap();
    let room = furnished_room(9);
    let mesh = dir.path().join("room.ply");
    write(&mesh, &room, &DAffine3::IDENTITY);

    let sampler = SurfaceSampler::new(&room, Density::PerM2(600.0), 1);
    let mut cloud = PointCloud::default();
    sampler.sample(0..sampler.len(), &mut cloud);
    let mut lines = String::new();
    let far = DAffine3::from_translation(FAR_M) * there();
    for p in &cloud.positions {
        let p = far.transform_point3(p.as_dvec3());
        writeln!(lines, "{:.4} {:.4} {:.4}", p.x, p.y, p.z).unwrap();
    }
    let points = dir.path().join("room.xyz");
    fs::write(&points, lines).unwrap();

    let moved = dir.path().join("moved.ply");
    let frame = ["--up-b", "z", "--units-b", "m", "--nth", "1"];
    let call = |moved| [&["align", text(&points), text(&mesh), "-o", text(moved)], &frame[..]].concat();
    let output = s3d(&call(&moved));
    assert!(output.status.success(), "{output:?}");
    let found = transform(&String::from_utf8(output.stdout).unwrap());
    let back = found.transform_point3(far.transform_point3(DVec3::ONE));
    assert!(back.distance(DVec3::ONE) < 0.01, "{back}");

    // All its points are written in their order.
    let written = read_point_sample(&moved, usize::MAX).unwrap();
    assert_eq!(written.len(), cloud.len());
    for (p, q) in written.positions.iter().zip(&cloud.positions) {
        assert!(p.distance(*q) < 0.01, "{p} {q}");
    }
    s3d_fails(&call(&dir.path().join("moved.glb")), 2, &["moved.glb", "a cloud", ".ply"]);
}

#[test]
fn what_does_not_fit_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    write(&at("room.ply"), &furnished_room(9), &DAffine3::IDENTITY);
    let corners = vec![Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0];
    write(&at("floor.ply"), &TriMesh::from_faces(corners, vec![[0, 1, 2]]).unwrap(), &DAffine3::IDENTITY);
    fs::write(at("few.xyz"), "1 2 3\n4 5 6\nnan nan nan\n").unwrap();
    fs::write(at("notes.md"), "nothing").unwrap();

    let fails = |a: &str, b: &str, code, words: &[&str]| {
        let frame = ["--up-a", "z", "--up-b", "z", "--units-a", "m", "--units-b", "m"];
        let (a, b) = (at(a), at(b));
        s3d_fails(&[&["align", text(&a), text(&b)], &frame[..]].concat(), code, words);
    };
    fails("floor.ply", "floor.ply", 1, &["--nth"]);
    fails("gone.ply", "room.ply", 1, &["gone.ply"]);
    fails("room.ply", "few.xyz", 1, &["few.xyz"]);
    fails("notes.md", "room.ply", 1, &["notes.md"]);
    s3d_fails(&["align", text(&at("room.ply"))], 2, &["FILE"]);
    let (room, obj) = (at("room.ply"), at("moved.obj"));
    s3d_fails(&["align", text(&room), text(&room), "-o", text(&obj)], 2, &["moved.obj", ".ply or .glb"]);
    s3d_ok(&["align", text(&room), text(&room), "--up-a", "z", "--up-b", "z"]);
}
