//! Scans in other forms than one OBJ and annotations of S3DIS: published areas, labels inside the mesh,
//! several files.

use crate::common;
use common::{files, s3d_fails, s3d_ok, text, write_scan};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const SMALL: [&str; 6] = ["--size", "48", "--pano-width", "96", "--points-per-m2", "200"];

const SIX: [&str; 2] = ["--views", "6"];

fn export(input: &Path, out: &Path, extra: &[&str]) {
    let mut args = vec!["export", text(input), "-o", text(out)];
    args.extend(SMALL);
    args.extend(extra);
    s3d_ok(&args);
}

fn images(out: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = files(&out.join("area_3/data"));
    all.extend(files(&out.join("area_3/pano")));
    all
}

#[test]
fn an_export_is_exported_again_as_published_areas_are() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 3);
    let (first, second, more) =
        (dir.path().join("first"), dir.path().join("second"), dir.path().join("more"));
    export(&scene, &first, &SIX);
    export(&first.join("area_3"), &second, &SIX);
    let (a, b) = (images(&first), images(&second));
    assert!(a.len() > 40 && a.keys().eq(b.keys()));
    for (path, bytes) in &a {
        // Poses go through Euler angles once more, which rounds them.
        if path.extension().is_some_and(|e| e == "json") {
            let pose = |bytes: &[u8]| {
                serde_json::from_slice::<s3d_io::dataset::PoseFile>(bytes)
                    .unwrap()
                    .pose()
            };
            let (a, b) = (pose(bytes), pose(&b[path]));
            assert!(a.location.abs_diff_eq(b.location, 1e-9), "{}", path.display());
            assert!(a.world_from_camera.abs_diff_eq(b.world_from_camera, 1e-9), "{}", path.display());
        } else {
            assert!(bytes == &b[path], "{} differs", path.display());
        }
    }
    for name in ["assets/semantic_labels.json", "area_3/3d/semantic.obj", "area_3/3d/rgb.obj"] {
        assert!(fs::read(first.join(name)).unwrap() == fs::read(second.join(name)).unwrap(), "{name}");
    }
    // More views of the same area.
    export(&first.join("area_3"), &more, &["--views", "12", "--keep-all", "--seed", "5"]);
    assert!(images(&more).len() > images(&first).len());
    // The area is moved, has another number, and gets locations of its own.
    let toml = dir.path().join("moved.toml");
    let table = format!(
        "area = 5\n[published]\npath = {:?}\ntransform = [[0,-1,0,7],[1,0,0,0],[0,0,1,0],[0,0,0,1]]\n",
        text(&first.join("area_3"))
    );
    fs::write(&toml, &table).unwrap();
    let moved = dir.path().join("moved");
    export(&toml, &moved, &["--views", "0"]);
    let labels = fs::read_to_string(moved.join("assets/semantic_labels.json")).unwrap();
    assert!(labels.contains("table_1_office_1_5") && !labels.contains("office_1_3"));
    let pose = |out: &Path, area: u32| {
        let folder = out.join(format!("area_{area}/pano/pose"));
        let (name, _) = files(&folder).into_iter().next().unwrap();
        s3d_io::dataset::read_pose(&folder.join(name)).unwrap().pose().location
    };
    let (a, b) = (pose(&first, 3), pose(&moved, 5));
    assert!((b.x - (7.0 - a.y)).abs() < 1e-9 && (b.y - a.x).abs() < 1e-9, "{a} {b}");
    // A turn by 90° about +Z changes no distance, so the depth of panoramas stays the same.
    let depth =
        |out: &Path, area: u32| files(&out.join(format!("area_{area}/pano/depth"))).into_values().next();
    let (a, b) = (depth(&first, 3).unwrap(), depth(&moved, 5).unwrap());
    assert_eq!(a.len() / 64, b.len() / 64);
    fs::remove_file(first.join("area_3/3d/semantic.obj")).unwrap();
    s3d_fails(
        &["export", text(&first.join("area_3")), "-o", text(&dir.path().join("x"))],
        1,
        &["area_3", "semantic.obj"],
    );
}

/// Writes the mesh of the scan as PLY files with a class and an object for each face, `parts` in number.
fn write_ply(scan: &Path, parts: usize) -> Vec<PathBuf> {
    let obj = fs::read_to_string(scan.join("room.obj")).unwrap();
    let vertices: Vec<&str> = obj.lines().filter_map(|l| l.strip_prefix("v ")).collect();
    let mut material = "";
    let mut quads: Vec<(usize, &str)> = Vec::new();
    for line in obj.lines() {
        if let Some(name) = line.strip_prefix("usemtl ") {
            material = name;
        }
        if line.starts_with("f ") {
            quads.push((4 * quads.len(), material));
        }
    }
    let class = |name: &str| {
        ["floor", "ceiling", "wall", "table"]
            .iter()
            .position(|n| *n == name)
            .unwrap()
    };
    quads
        .chunks(quads.len().div_ceil(parts))
        .enumerate()
        .map(|(part, quads)| {
            let mut ply = format!(
                "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
                 property float z\n\
                 element face {}\nproperty list uchar int vertex_indices\nproperty int label\n\
                 property int instance\nend_header\n",
                4 * quads.len(),
                quads.len()
            );
            for (first, _) in quads {
                ply += &vertices[*first..first + 4].join("\n");
                ply += "\n";
            }
            for (i, (first, name)) in quads.iter().enumerate() {
                let c = 4 * i;
                ply += &format!("4 {c} {} {} {} {} {}\n", c + 1, c + 2, c + 3, class(name), first / 4);
            }
            let path = scan.join(format!("part_{part}.ply"));
            fs::write(&path, ply).unwrap();
            path
        })
        .collect()
}

#[test]
fn labels_of_the_mesh_give_what_the_tree_gives() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    let tree = write_scan(&scan, 3);
    let expected = dir.path().join("expected");
    export(&tree, &expected, &SIX);
    for parts in [1, 3] {
        let names: Vec<String> = write_ply(&scan, parts)
            .iter()
            .map(|p| format!("{:?}", text(p)))
            .collect();
        let toml = scan.join(format!("ply_{parts}.toml"));
        let table = format!(
            "area = 3\n[mesh]\npaths = [{}]\n[annotations]\nmesh = true\nroom = \"office_1\"\n\
             [annotations.classes]\n\
             0 = \"floor\"\n1 = \"ceiling\"\n2 = \"wall\"\n3 = \"table\"\n[cameras]\n\
             path = \"cameras.csv\"\n",
            names.join(", ")
        );
        fs::write(&toml, &table).unwrap();
        let out = dir.path().join(format!("out_{parts}"));
        export(&toml, &out, &[&SIX[..], &["--allow", "colour"]].concat());
        let labels = |out: &Path| fs::read(out.join("assets/semantic_labels.json")).unwrap();
        assert!(labels(&expected) == labels(&out));
        for domain in ["semantic", "depth", "normal", "global_xyz"] {
            let of = |out: &Path| files(&out.join("area_3/data").join(domain));
            assert!(of(&expected) == of(&out), "{domain}");
        }
        // The message names a class without a meaning.
        fs::write(&toml, table.replace("3 = \"table\"\n", "")).unwrap();
        s3d_fails(&["export", text(&toml), "-o", text(&dir.path().join("x"))], 1, &["part_", "3"]);
    }
}

#[test]
fn columns_of_a_cloud_are_not_looked_for_in_the_mesh() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    write_scan(&scan, 3);
    write_ply(&scan, 1);
    let mut cloud = String::from(
        "ply\nformat ascii 1.0\nelement vertex 400\nproperty float x\nproperty float y\nproperty float z\n\
         property int what\nend_header\n",
    );
    for i in 0..400 {
        cloud += &format!("{} {} 0 5\n", 0.2 * f64::from(i % 20), 0.15 * f64::from(i / 20));
    }
    fs::write(scan.join("cloud.ply"), cloud).unwrap();
    let toml = scan.join("cloud.toml");
    let table = "area = 3\n[mesh]\npath = \"part_0.ply\"\n[annotations]\npath = \"cloud.ply\"\n\
                 class = \"what\"\nroom = \"office_1\"\n\
                 classes = { 5 = \"floor\" }\n[cameras]\npath = \"cameras.csv\"\n";
    fs::write(&toml, table).unwrap();
    let out = dir.path().join("out");
    export(&toml, &out, &["--views", "0", "--allow", "colour,labels"]);
    assert!(
        fs::read_to_string(out.join("area_3/3d/semantic.obj"))
            .unwrap()
            .contains("usemtl floor_1_office_1_3")
    );
}

#[test]
fn pictures_need_the_locations_where_they_were_taken() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 3);
    let toml = fs::read_to_string(&scene).unwrap();
    fs::create_dir(dir.path().join("scan/skybox")).unwrap();
    fs::write(&scene, format!("rgb = \"skybox\"\n{toml}")).unwrap();
    let out = dir.path().join("out");
    s3d_fails(
        &["export", text(&scene), "-o", text(&out), "--place-cameras", "2"],
        1,
        &["scene.toml", "skybox", "placed"],
    );
    assert!(!out.exists());
}

#[test]
fn vertices_of_a_scannet_scan_vote_for_all_faces_around_them() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    write_scan(&scan, 3);
    let mesh = write_ply(&scan, 1).remove(0);
    let folder = scan.join("scene0000_00");
    fs::create_dir(&folder).unwrap();
    let ply = folder.join("scene0000_00_vh_clean_2.ply");
    fs::rename(mesh, &ply).unwrap();
    // One segment for each quad. Objects have the annotators' names; each wall is an object.
    let names = ["floor", "ceiling", "wall", "wall", "wall", "wall", "table"];
    let segments: Vec<String> = (0..4 * names.len()).map(|v| (v / 4).to_string()).collect();
    let segs = format!("{{\"sceneId\": \"scene0000_00\", \"segIndices\": [{}]}}", segments.join(", "));
    fs::write(folder.join("scene0000_00_vh_clean_2.0.010000.segs.json"), segs).unwrap();
    let groups: Vec<String> = names
        .iter()
        .enumerate()
        .map(|(i, name)| {
            format!("{{\"id\": {i}, \"objectId\": {i}, \"segments\": [{i}], \"label\": \"{name}\"}}")
        })
        .collect();
    let aggregation =
        format!("{{\"sceneId\": \"scannet.scene0000_00\", \"segGroups\": [{}]}}", groups.join(", "));
    fs::write(folder.join("scene0000_00.aggregation.json"), aggregation).unwrap();
    let toml = scan.join("scannet.toml");
    let table = "area = 3\n[mesh]\npath = \"scene0000_00/scene0000_00_vh_clean_2.ply\"\nup = \"z\"\n\
                 [annotations]\n\
                 path = \"scene0000_00\"\nroom = \"office_1\"\n[cameras]\npath = \"cameras.csv\"\n";
    fs::write(&toml, table).unwrap();
    let out = dir.path().join("out");
    export(&toml, &out, &["--views", "0", "--allow", "colour,coverage,inside-out,up"]);
    let semantic = fs::read_to_string(out.join("area_3/3d/semantic.obj")).unwrap();
    let (mut material, mut of_faces) = (String::new(), Vec::new());
    for line in semantic.lines() {
        if let Some(name) = line.strip_prefix("usemtl ") {
            material = name.split('_').next().unwrap().to_owned();
        }
        if line.starts_with("f ") {
            of_faces.push(material.clone());
        }
    }
    let expected: Vec<&str> = names.iter().flat_map(|name| [*name; 2]).collect();
    of_faces.sort();
    let mut sorted = expected.clone();
    sorted.sort_unstable();
    assert_eq!(of_faces, sorted);
    assert!(semantic.contains("usemtl wall_4_office_1_3"));
}
