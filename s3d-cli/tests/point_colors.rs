//! `colors = "points"`: a mesh without texture takes the colours of the annotated points.

use crate::common;
use common::scan::{SMALL, Scan};
use common::{files, s3d, s3d_ok, text, write_scan};
use s3d_geom::{FaceColor, PointCloud, TriMesh};
use s3d_io::image::read_rgb8;
use s3d_io::mesh::{UpAxis, read_mesh};
use std::fs;
use std::path::{Path, PathBuf};

const POINTS: &str = "path = \"room.obj\"\ncolors = \"points\"";

/// The scan of a room whose mesh has no materials and 60 × 60 cells to a wall.
fn untextured() -> Scan {
    let scan = Scan::new();
    let obj = fs::read_to_string(scan.file("room.obj")).unwrap();
    let at = |line: &str| -> Vec<f32> { line.split(' ').skip(1).map(|word| word.parse().unwrap()).collect() };
    let corners: Vec<Vec<f32>> = obj.lines().filter(|line| line.starts_with("v ")).map(at).collect();
    let (mut fine, mut first) = (String::new(), 1);
    for quad in corners.chunks(4) {
        for (i, j) in (0..61).flat_map(|i| (0..61).map(move |j| (i, j))) {
            let (s, t) = (i as f32 / 60.0, j as f32 / 60.0);
            let k = |k: usize| quad[0][k] + s * (quad[1][k] - quad[0][k]) + t * (quad[3][k] - quad[0][k]);
            fine += &format!("v {} {} {}\n", k(0), k(1), k(2));
        }
        for (i, j) in (0..60).flat_map(|i| (0..60).map(move |j| (i, j))) {
            let a = first + 61 * i + j;
            fine += &format!("f {} {} {} {}\n", a, a + 61, a + 62, a + 1);
        }
        first += 61 * 61;
    }
    scan.write("room.obj", fine);
    scan
}

fn export(scene: &Path, out: &Path, more: &[&str]) -> String {
    s3d_ok(&[&["export", text(scene), "-o", text(out)], &SMALL[..], more].concat())
}

/// The mean difference between the colours of points and of the mesh around them.
fn difference(mesh: &TriMesh, cloud: &PointCloud) -> f64 {
    let nearest = s3d_geom::NearestFaces::new(mesh);
    let color = |p| match mesh.color_of(nearest.nearest(p).face) {
        FaceColor::Corners(corners) => {
            [0, 1, 2].map(|k| corners.iter().map(|c| f64::from(c[k])).sum::<f64>() / 3.0)
        }
        other => panic!("{other:?}"),
    };
    let off = |(p, c): (&_, &[u8; 3])| {
        color(*p)
            .iter()
            .zip(c)
            .map(|(a, b)| (a - f64::from(*b)).abs())
            .sum::<f64>()
            / 3.0
    };
    cloud.positions.iter().zip(&cloud.colors).map(off).sum::<f64>() / cloud.len() as f64
}

#[test]
fn a_mesh_without_texture_shows_the_colours_of_the_points() {
    let scan = untextured();
    let grey = s3d(&["export", text(&scan.scene), "-o", text(&scan.out())]);
    let said = String::from_utf8_lossy(&grey.stderr).into_owned();
    assert!(
        grey.status.code() == Some(1) && said.contains("write colors = \"points\" under [mesh]"),
        "{said}"
    );

    scan.replace("scene.toml", "path = \"room.obj\"", POINTS);
    let out = scan.out();
    let log = export(&scan.scene, &out, &[]);
    assert!(log.contains("the mesh takes its colours from 2800 points for 26047 vertices"), "{log}");
    assert!(s3d_ok(&["verify", text(&out), "--full"]).is_empty());

    // The mesh of the data set has these colours, and so has every image.
    let mesh = read_mesh(&out.join("area_1/3d/rgb.obj"), UpAxis::Y).unwrap().mesh;
    let points: Vec<PathBuf> = files(&scan.file("Area_1")).into_keys().collect();
    assert_eq!(points.len(), 7);
    for name in points {
        let mut cloud = PointCloud::default();
        let path = scan.file("Area_1").join(name);
        let mut reader = s3d_io::cloud::PointReader::open(&path).unwrap();
        while reader.read_chunk(1000, &mut cloud).unwrap() > 0 {}
        let off = difference(&mesh, &cloud);
        assert!(off < 6.0, "{}: {off}", path.display());
    }
    let panoramas = out.join("area_1/pano/rgb");
    for entry in fs::read_dir(panoramas).unwrap() {
        let image = read_rgb8(&entry.unwrap().path()).unwrap();
        let blue = image
            .pixels()
            .iter()
            .filter(|pixel| pixel[2].abs_diff(128) <= 1)
            .count();
        assert!(blue as f64 > 0.99 * image.len() as f64, "{blue} of {}", image.len());
        let reds: std::collections::BTreeSet<u8> = image.pixels().iter().map(|pixel| pixel[0] / 16).collect();
        assert!(reds.len() >= 10, "{reds:?}");
    }

    // A plan, shards and another number of threads make the same.
    let plan = scan.dir.path().join("plan");
    let planned = scan.dir.path().join("planned");
    s3d_ok(&["plan", text(&scan.scene), "-o", text(&plan), "--views", "3", "--size", "32"]);
    export(&scan.scene, &planned, &["--plan", text(&plan), "--threads", "1"]);
    assert!(files(&planned) == files(&out), "a planned export differs");
}

#[test]
fn several_areas_have_colours_of_their_own() {
    let scan = untextured();
    scan.replace("scene.toml", "path = \"room.obj\"", POINTS);
    let second = write_scan(&scan.dir.path().join("second"), 2);
    let out = scan.out();
    export(&scan.scene, &out, &[text(&second)]);
    let alone = scan.dir.path().join("alone");
    export(&scan.scene, &alone, &[]);
    for name in ["area_1/3d/rgb.obj", "area_1/3d/votes.json"] {
        assert!(fs::read(out.join(name)).unwrap() == fs::read(alone.join(name)).unwrap(), "{name} differs");
    }
}

#[test]
fn what_cannot_be_is_refused() {
    // A cloud without colours, points too far away, no cloud at all.
    let scan = untextured();
    scan.replace("scene.toml", "path = \"room.obj\"", POINTS);
    let scene = fs::read_to_string(&scan.scene).unwrap();
    scan.write("scene.toml", scene.replace("[annotations]\npath = \"Area_1\"", "[annotations]\nmesh = true"));
    scan.refused(&["scene.toml", "mesh.colors = \"points\" needs the path of a cloud under [annotations]"]);
    scan.write("scene.toml", scene.replace("\"points\"", "\"cloud\""));
    scan.refused(&["scene.toml, line 4", "unknown variant `cloud`, expected `file` or `points`"]);
    scan.write("scene.toml", &scene);
    for entry in fs::read_dir(scan.file("Area_1/office_1/Annotations")).unwrap() {
        let path = entry.unwrap().path();
        let colored = fs::read_to_string(&path).unwrap();
        let black = colored.lines().map(|line| {
            let words: Vec<&str> = line.split(' ').collect();
            format!("{} {} {} 0 0 0\n", words[0], words[1], words[2])
        });
        fs::write(&path, black.collect::<String>()).unwrap();
    }
    scan.refused(&["scene.toml", "the annotated points have no colours"]);
}
