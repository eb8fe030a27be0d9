//! Masks of photographs and views as proposals.

use s3d_annotate::proposals::{Proposal, Target, read_proposals};
use s3d_dataset::{BareScene, Context};
use s3d_geom::glam::{DVec2, DVec3, Vec3, dvec2, dvec3, vec3};
use s3d_geom::primitives::{cuboid, grid};
use s3d_geom::{Camera, Lens, PhotoLens, Pose, Raster, TriMesh};
use s3d_io::dataset::{Frame, PoseFile, image_stem};
use s3d_io::image::{Compression, Content, encode_gray8, encode_gray16, write_rgb8};
use s3d_label::Taxonomy;
use s3d_render::{Scene, cast, cast_ray};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// The number of floor faces; 12 of each of two chests follow.
const FLOOR: u32 = 800;

/// A floor of 4 × 4 m with two chests on it.
fn room() -> TriMesh {
    let mut parts = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [20, 20]);
    parts.append(cuboid(vec3(0.9, 1.5, 0.0), vec3(1.5, 2.1, 0.7)));
    parts.append(cuboid(vec3(2.3, 1.5, 0.0), vec3(2.9, 2.1, 0.7)));
    TriMesh::new(parts).unwrap()
}

fn lens() -> PhotoLens {
    let bent = [-0.2, 0.05, 0.001, -0.001, 0.0];
    PhotoLens::Straight(Lens::new([240, 180], dvec2(150.0, 151.0), dvec2(123.0, 88.0), bent).unwrap())
}

/// Cameras that see both chests, the left one alone, and both again.
fn poses() -> [Pose; 3] {
    let look = |x: f64, y: f64, to: f64| {
        Pose::look_at(dvec3(x, y, 1.7), dvec3(to, 1.8, 0.2), dvec3(0.05, 0.0, 1.0)).unwrap()
    };
    [look(1.9, -1.2, 1.9), look(0.2, 3.3, 0.9), look(1.9, 4.6, 1.9)]
}

/// A scene of the room and three photographs, in a folder.
struct Studio {
    dir: tempfile::TempDir,
}

impl Studio {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let mesh = room();
        let mut obj = String::new();
        for p in mesh.positions() {
            writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap();
        }
        for face in mesh.faces() {
            let [a, b, c] = face.map(|v| v + 1);
            writeln!(obj, "f {a} {b} {c}").unwrap();
        }
        let at = |name: &str| dir.path().join(name);
        fs::write(at("room.obj"), obj).unwrap();

        fs::create_dir(at("photos")).unwrap();
        fs::create_dir(at("masks")).unwrap();
        let mut frames = Vec::new();
        for (name, pose) in ["a", "b", "c"].iter().zip(poses()) {
            let file = format!("photos/{name}.png");
            let black = Raster::filled(240, 180, [9; 3]);
            write_rgb8(&at(&file), &black, Content::Photo, Compression::Fast).unwrap();
            let m = pose.world_from_camera.transpose();
            let rows: Vec<String> = [m.x_axis, m.y_axis, m.z_axis]
                .iter()
                .zip(pose.location.to_array())
                .map(|(row, t)| format!("[{}, {}, {}, {t}]", row.x, row.y, row.z))
                .collect();
            let rows = rows.join(", ");
            frames
                .push(format!("{{\"file_path\": \"{file}\", \"transform_matrix\": [{rows}, [0, 0, 0, 1]]}}"));
        }
        let cameras = format!(
            "{{\"w\": 240, \"h\": 180, \"fl_x\": 150, \"fl_y\": 151, \"cx\": 123, \"cy\": 88, \"k1\": -0.2, \
             \"k2\": 0.05, \"p1\": 0.001, \"p2\": -0.001, \"frames\": [{}]}}",
            frames.join(", ")
        );
        fs::write(at("transforms.json"), cameras).unwrap();
        let scene = "area = 1\n[mesh]\npath = \"room.obj\"\nup = \"z\"\nunits = \"m\"\n\
                     [frames]\npath = \"transforms.json\"\n";
        fs::write(at("scene.toml"), scene).unwrap();
        Self { dir }
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    /// Writes the image of a photograph, 8 bits, by rays through the lens: `scale` smaller.
    fn photograph(&self, number: usize, scale: u32, number_of: impl Fn(u32) -> u8) {
        let mesh = room();
        let scene = Scene::new(&mesh);
        let (lens, pose) = (lens(), poses()[number]);
        let [w, h] = lens.size().map(|side| side / scale);
        let pixel = |k: u32| {
            let center = (dvec2(f64::from(k % w), f64::from(k / w)) + 0.5) * f64::from(scale);
            let ray = lens.direction(center).map(|d| world(&pose, d));
            let hit = ray.and_then(|ray| cast_ray(&scene, pose.location, ray));
            hit.map_or(255, |hit| number_of(hit.face))
        };
        let image = Raster::from_vec(w, h, (0..w * h).map(pixel).collect());
        let name = ["a.png", "b.png", "c.png"][number];
        fs::write(self.at("masks").join(name), encode_gray8(&image)).unwrap();
    }

    fn read(&self) -> Result<Vec<Proposal>, String> {
        let ctx = Context::default();
        let scene = BareScene::open(self.at("scene.toml"), &ctx).unwrap();
        assert_eq!(scene.mesh().faces().len(), room().faces().len());
        read_proposals(&self.at("masks"), &Target::from(&scene), &ctx).map_err(|e| e.to_string())
    }
}

fn world(pose: &Pose, d: DVec3) -> DVec3 {
    pose.right() * d.x - pose.up() * d.y + pose.forward() * d.z
}

/// 0: floor, 1: the left chest, 2: the right one.
fn part(face: u32) -> usize {
    match face {
        0..FLOOR => 0,
        _ => 1 + usize::from(face >= FLOOR + 12),
    }
}

/// The classes of proposals, each with the number of its faces of floor, left and right chest. A face of the
/// floor that shows a pixel or two beside a chest may count as the chest: up to two are left out.
fn parts(found: &[Proposal]) -> Vec<(&str, [usize; 3])> {
    let count = |proposal: &Proposal| {
        let mut counts = [0; 3];
        proposal.faces.iter().for_each(|face| counts[part(face)] += 1);
        counts[0] = if counts[0] > 2 { counts[0] } else { 0 };
        counts
    };
    let parts = found.iter().map(|p| (&p.class[..], count(p)));
    parts.filter(|(_, counts)| *counts != [0; 3]).collect()
}

#[test]
fn pixels_of_photographs_vote_through_the_lens() {
    let studio = Studio::new();
    for scale in [1, 2] {
        (0..3).for_each(|k| studio.photograph(k, scale, |face| [1, 7, 7][part(face)]));
        let found = studio.read().unwrap();
        // Hidden are the bottoms of the chests, a side of one, and the floor below and outside of pictures.
        let [("floor", [floor, 0, 0]), ("table", [0, 10, 0]), ("table", [0, 0, 8])] = parts(&found)[..]
        else {
            panic!("{:?}", parts(&found))
        };
        assert!((500..800).contains(&floor), "{floor}");
        assert_eq!(found[0].source, "masks");
    }
}

#[test]
fn instances_of_several_photographs_are_joined() {
    let studio = Studio::new();
    let list = |name: &str, text: &str| fs::write(studio.at("masks").join(name), text).unwrap();
    studio.photograph(0, 1, |face| [0, 3, 4][part(face)]);
    list("a.json", r#"{"3": "table", "4": "table"}"#);
    studio.photograph(1, 1, |face| [0, 9, 255][part(face)]);
    list("b.csv", "id,name\n9,table\n");
    studio.photograph(2, 1, |face| [0, 1, 2][part(face)]);
    list("c.json", r#"["", "table", "table"]"#);
    let two = [("table", [0, 10, 0]), ("table", [0, 0, 8])];
    let found = studio.read().unwrap();
    assert_eq!(parts(&found), two);
    assert_eq!(found[1].source, "masks, instance 2");

    // A mask over both does not make one of what another image shows as two.
    studio.photograph(2, 1, |face| [0, 1, 1][part(face)]);
    let found = studio.read().unwrap();
    assert_eq!(found.len(), 2, "{:?}", parts(&found));
    // Another class is another instance, where it has more pixels.
    studio.photograph(2, 1, |face| [0, 1, 2][part(face)]);
    list("c.json", r#"["", "table", "sofa"]"#);
    let classes: Vec<String> = studio.read().unwrap().into_iter().map(|p| p.class).collect();
    assert_eq!(classes, ["table", "table", "sofa"]);
}

#[test]
fn a_mask_joins_the_halves_that_others_saw() {
    let studio = Studio::new();
    let half = |face: u32, low: u8, high: u8| match face {
        0..FLOOR if room().triangle(face)[0].y < 2.0 => low,
        0..FLOOR => high,
        _ => 255,
    };
    let list = |name: &str| fs::write(studio.at("masks").join(name), r#"{"5": "floor"}"#).unwrap();
    ["a.json", "b.json", "c.json"].into_iter().for_each(list);
    studio.photograph(0, 2, |face| half(face, 5, 255));
    studio.photograph(1, 2, |face| half(face, 255, 5));
    fs::write(studio.at("masks/c.json"), "{}").unwrap();
    studio.photograph(2, 2, |_| 255);
    assert_eq!(studio.read().unwrap().len(), 2);

    list("c.json");
    studio.photograph(2, 2, |face| half(face, 5, 5));
    let found = studio.read().unwrap();
    let [("floor", [floor, 0, 0])] = parts(&found)[..] else { panic!("{:?}", parts(&found)) };
    assert!(floor > 500, "{floor}");
}

#[test]
fn ranges_of_numbers_are_instances_too() {
    let studio = Studio::new();
    studio.photograph(0, 1, |face| [1, 71, 72][part(face)]);
    studio.photograph(2, 1, |face| [1, 77, 70][part(face)]);
    let names = studio.at("masks").join("classes.json");
    fs::write(&names, r#"{"1": "floor", "70-79": "chair"}"#).unwrap();
    let found = studio.read().unwrap();
    let [("floor", [_, 0, 0]), ("chair", [0, 8, 0]), ("chair", [0, 0, 8])] = parts(&found)[..] else {
        panic!("{:?}", parts(&found))
    };
    fs::remove_file(&names).unwrap();
    fs::write(studio.at("masks").join("classes.csv"), "number,class\n1,floor\n70-79,\"\"\n").unwrap();
    assert_eq!(studio.read().unwrap()[0].class, "floor");
}

#[test]
fn views_of_a_data_set_have_their_pose_files() {
    let mesh = room();
    let scene = Scene::new(&mesh);
    let dir = tempfile::tempdir().unwrap();
    let [poses_dir, masks, rgb] = ["pose", "prediction", "rgb"].map(|name| dir.path().join(name));
    [&poses_dir, &masks, &rgb]
        .into_iter()
        .for_each(|dir| fs::create_dir(dir).unwrap());
    let pose = poses()[0];
    let view = Camera::perspective(pose, 1.2, 200, 200);
    let panorama = Camera::equirectangular(Pose::level(dvec3(1.9, 1.8, 1.6), 0.4), 256);
    let offset = dvec3(400_000.0, 5_000_000.0, 90.0);
    for (frame, camera) in [(Frame::View(0), &view), (Frame::Panorama, &panorama)] {
        let stem = image_stem("0123456789abcdef0123456789abcdef", "office_1", frame);
        let mut file =
            PoseFile::new(camera, &camera.pose, "0123456789abcdef0123456789abcdef", "office_1_1", frame);
        file.world_offset_m = Some((offset + DVec3::X).to_array());
        file.camera_location[0] -= 1.0;
        file.write(&poses_dir.join(format!("{stem}_domain_pose.json"))).unwrap();
        if frame == Frame::View(0) {
            let black = Raster::filled(200, 200, [0; 3]);
            let path = rgb.join(format!("{stem}_domain_rgb.png"));
            write_rgb8(&path, &black, Content::Photo, Compression::Fast).unwrap();
        }
        // Half as large as the view.
        let small = match frame {
            Frame::View(_) => Camera::perspective(pose, 1.2, 100, 100),
            Frame::Panorama => *camera,
        };
        let numbers = cast(&scene, &small).face.map(|face| match face {
            u32::MAX => 65_535,
            face => [1u16, 7, 8][part(face)],
        });
        let image = encode_gray16(&numbers, Compression::Fast);
        fs::write(masks.join(format!("{stem}_domain_prediction.png")), image).unwrap();
    }

    let taxonomy = Taxonomy::s3dis();
    let target = Target { offset_m: offset, ..Target::new(&mesh, &taxonomy) };
    let found = read_proposals(&masks, &target, &Context::default()).unwrap();
    let [("floor", [floor, 0, 0]), ("table", [0, _, 0]), ("chair", [0, 0, _])] = parts(&found)[..] else {
        panic!("{:?}", parts(&found))
    };
    assert!(floor > 500, "{floor}");
}

#[test]
fn faults_of_masks_are_told() {
    let studio = Studio::new();
    let masks = studio.at("masks");
    let path = masks.join("a.png");
    let told = |words: &[&str]| {
        let why = studio.read().unwrap_err();
        assert!(words.iter().all(|word| why.contains(word)), "{why}");
    };
    fs::write(&path, encode_gray8(&Raster::filled(240, 90, 1))).unwrap();
    told(&["a.png", "240 × 90", "240 × 180"]);
    fs::write(&path, encode_gray8(&Raster::filled(240, 180, 77))).unwrap();
    told(&["a.png", "class 77", "classes.json"]);
    let photo = Raster::filled(240, 180, [1; 3]);
    write_rgb8(&path, &photo, Content::Photo, Compression::Fast).unwrap();
    told(&["a.png", "8-bit RGB", "16-bit gray"]);
    fs::write(&path, encode_gray8(&Raster::filled(240, 180, 255))).unwrap();
    told(&["masks", "no class for any face"]);
    fs::write(masks.join("classes.csv"), "1;floor\n").unwrap();
    told(&["classes.csv", "5,chair"]);
    fs::remove_file(masks.join("classes.csv")).unwrap();

    // Images without a camera do not vote; a folder of such images is an error.
    studio.photograph(0, 1, |face| [1, 7, 7][part(face)]);
    fs::copy(&path, masks.join("other.png")).unwrap();
    assert!(studio.read().unwrap().len() >= 3);
    fs::remove_file(&path).unwrap();
    told(&["other.png", "[frames]", "pose"]);
}

/// The middle of the picture looks forward: what the tests rely on.
#[test]
fn a_photograph_shows_where_it_looks() {
    let studio = Studio::new();
    let scene = BareScene::open(studio.at("scene.toml"), &Context::default()).unwrap();
    let all: Vec<_> = scene.photographs().collect();
    assert_eq!(all.iter().map(|p| p.size()).collect::<Vec<_>>(), [[240, 180]; 3]);
    let place = all[1].place(poses()[1].forward() * 3.0).unwrap();
    assert!((place - dvec2(123.0 / 240.0, 88.0 / 180.0)).length() < 1e-9, "{place}");
    assert_eq!(all[1].place(-poses()[1].forward()), None::<DVec2>);
    let places = all[0].named_in(Path::new("masks"));
    assert!(places.contains(&Path::new("masks").join("a.png")), "{places:?}");
}
