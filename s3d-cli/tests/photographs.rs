//! Photographs with poses, there and back: pictures that our own renderer took in the built-in scene, ray by ray
//! through lenses that bend, become views that lie on those of the mesh.

mod common;

use common::{files, s3d_fails, s3d_ok, text};
use glam::{DMat2, DVec2, DVec3, dvec2, dvec3};
use s3d_geom::{Camera, FisheyeLens, Lens, PhotoLens, Pose, Raster, TriMesh};
use s3d_io::dataset::{Layout, PhotographRecord, dataset_images, read_photographs, read_pose};
use s3d_io::image::{Compression, Content, read_gray16, read_rgb8, write_rgb8};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_render::{MipMaps, Scene, TextureFilter, cast, cast_ray, depth_image, rgb_image, rgb_of_ray};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const SIZE: [u32; 2] = [320, 240];
const FOCAL: DVec2 = dvec2(210.0, 212.0);
const CENTER: DVec2 = dvec2(163.25, 117.5);

/// Barrel distortion, as of a wide phone lens.
const RADIAL: [f64; 5] = [-0.21, 0.06, 0.0015, -0.0011, 0.004];
const ANGULAR: [f64; 4] = [0.03, -0.012, 0.004, -0.0006];

fn radial() -> PhotoLens {
    PhotoLens::Straight(Lens::new(SIZE, FOCAL, CENTER, RADIAL).unwrap())
}

fn fisheye() -> PhotoLens {
    PhotoLens::Fisheye(FisheyeLens::new(SIZE, FOCAL, CENTER, ANGULAR).unwrap())
}

/// Where photographs are taken: in rooms with much in them, tilted and rolled.
fn poses() -> [Pose; 4] {
    let rolled = |at: DVec3, target: DVec3, up: DVec3| Pose::look_at(at, target, up).unwrap();
    let scan = demo();
    let locations = s3d_io::camera::read_cameras(&scan.join("cameras.csv")).unwrap();
    std::array::from_fn(|i| {
        let at = locations[i % locations.len()].pose.location + dvec3(0.1, -0.05, 0.1);
        let (sin, cos) = (1.3 * i as f64).sin_cos();
        rolled(at, at + dvec3(cos, sin, -0.25), dvec3(0.1, 0.05, 1.0))
    })
}

/// The scan of the built-in scene, made once.
fn demo() -> &'static Path {
    static DEMO: OnceLock<PathBuf> = OnceLock::new();
    DEMO.get_or_init(|| {
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("photographs");
        let _ = fs::remove_dir_all(&dir);
        let small = ["--views", "0", "--size", "16", "--pano-width", "32", "--points-per-m2", "20"];
        s3d_ok(&[&["demo", "-o", text(&dir)][..], &small].concat());
        dir.join("scan")
    })
}

fn mesh() -> &'static TriMesh {
    static MESH: OnceLock<TriMesh> = OnceLock::new();
    MESH.get_or_init(|| read_mesh(&demo().join("rgb.obj"), UpAxis::Y).unwrap().mesh)
}

/// What a camera behind a lens sees, four rays a pixel.
fn take(pose: &Pose, lens: &PhotoLens) -> Raster<[u8; 3]> {
    let (scene, mip_maps) = (Scene::new(mesh()), MipMaps::new(mesh()));
    let [w, h] = lens.size();
    // How large a pixel is, for textures.
    let camera = Camera::pinhole(*pose, lens.focal_px() * 2.0, DVec2::ZERO, w, h).unwrap();
    let color = |place: DVec2| -> DVec3 {
        let Some(d) = lens.direction(place) else { return DVec3::ZERO };
        let direction = pose.right() * d.x - pose.up() * d.y + pose.forward() * d.z;
        let direction = direction / direction.dot(pose.forward()).max(0.1);
        let Some(hit) = cast_ray(&scene, pose.location, direction) else { return DVec3::ZERO };
        let rgb = rgb_of_ray(&scene, &mip_maps, &camera, direction, hit.face, &TextureFilter::default());
        DVec3::from_array(rgb.map(f64::from))
    };
    let pixel = |i: u32| {
        let corner = dvec2(f64::from(i % w), f64::from(i / w));
        let samples = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let sum: DVec3 = samples.iter().map(|(x, y)| color(corner + dvec2(*x, *y))).sum();
        (sum / 4.0).to_array().map(|v| v.round() as u8)
    };
    Raster::from_vec(w, h, (0..w * h).map(pixel).collect())
}

fn write(path: &Path, image: &Raster<[u8; 3]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    write_rgb8(path, image, Content::Photo, Compression::Fast).unwrap();
}

/// Camera → world, 4 × 4: in OpenGL's axes for `s` = 1, in OpenCV's for −1.
fn rows(pose: &Pose, s: f64) -> [[f64; 4]; 4] {
    let (m, p) = (pose.world_from_camera, pose.location);
    let row = |k: usize| [m.x_axis[k], s * m.y_axis[k], s * m.z_axis[k], p[k]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// The frames of nerfstudio's list, `images/0.png` …, of the first lens.
fn transforms(poses: &[Pose]) -> Value {
    let [k1, k2, p1, p2, k3] = RADIAL;
    let frame = |(i, pose): (usize, &Pose)| json!({"file_path": format!("images/{i}.png"), "transform_matrix": rows(pose, 1.0)});
    json!({
        "camera_model": "OPENCV", "w": SIZE[0], "h": SIZE[1], "fl_x": FOCAL.x, "fl_y": FOCAL.y,
        "cx": CENTER.x, "cy": CENTER.y, "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3,
        "frames": poses.iter().enumerate().map(frame).collect::<Vec<_>>(),
    })
}

/// A folder with a scene of the demo's mesh, whose `[frames]` has these keys, beside the rest of `scene`.
struct Project {
    dir: tempfile::TempDir,
}

impl Project {
    fn new(rest: &str) -> Self {
        let project = Self { dir: tempfile::tempdir().unwrap() };
        let mesh = text(&demo().join("rgb.obj")).to_owned();
        project.write("scene.toml", &format!("area = 1\n[mesh]\npath = {mesh:?}\n{rest}"));
        project
    }

    /// With the photographs of the first lens, and their list.
    fn with_photographs(rest: &str) -> Self {
        static TAKEN: OnceLock<Vec<Raster<[u8; 3]>>> = OnceLock::new();
        let project = Self::new(rest);
        let taken = TAKEN.get_or_init(|| poses().iter().map(|pose| take(pose, &radial())).collect());
        taken.iter().enumerate().for_each(|(i, image)| write(&project.at(&format!("images/{i}.png")), image));
        project.write("transforms.json", &transforms(&poses()).to_string());
        project
    }

    fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn write(&self, name: &str, content: &str) {
        let path = self.at(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    fn args<'a>(&'a self, scene: &'a Path, out: &'a Path) -> Vec<&'a str> {
        let small = ["--points-per-m2", "20", "--size", "32", "--pano-width", "64", "--views", "4"];
        [&["export", text(scene), "-o", text(out)][..], &small].concat()
    }

    /// Exports into the folder `name`, and checks what is there.
    fn export(&self, name: &str, more: &[&str]) -> (PathBuf, String) {
        let (scene, out) = (self.at("scene.toml"), self.at(name));
        let log = s3d_ok(&[&self.args(&scene, &out)[..], more].concat());
        s3d_ok(&["verify", text(&out)]);
        (out, log)
    }

    fn fails(&self, parts: &[&str]) {
        let (scene, out) = (self.at("scene.toml"), self.at("out"));
        s3d_fails(&self.args(&scene, &out), 1, parts);
        assert!(!out.exists(), "something was written");
    }
}

const LISTED: &str = "[frames]\npath = \"transforms.json\"\n";

fn photographs(out: &Path) -> Vec<PhotographRecord> {
    read_photographs(&Layout::new(out).frames_json(1)).unwrap()
}

/// How far two pictures of the same are displaced against each other, by squares of 32 pixels: what Lucas and
/// Kanade's equations say, of squares in which they have an answer. `is_known` of both.
fn displacements(a: &Raster<[u8; 3]>, b: &Raster<[u8; 3]>) -> Vec<f64> {
    const SQUARE: u32 = 32;
    let grey =
        |r: &Raster<[u8; 3]>, x: u32, y: u32| r.at(x, y).iter().map(|v| f64::from(*v)).sum::<f64>() / 3.0;
    let mut found = Vec::new();
    for (top, left) in (0..a.height() / SQUARE).flat_map(|j| (0..a.width() / SQUARE).map(move |i| (j, i))) {
        let (mut normal, mut right) = (DMat2::ZERO, DVec2::ZERO);
        let mut all_known = true;
        for (x, y) in (1..SQUARE - 1).flat_map(|y| (1..SQUARE - 1).map(move |x| (x, y))) {
            let (x, y) = (left * SQUARE + x, top * SQUARE + y);
            all_known &= a.at(x, y) != [0; 3] && b.at(x, y) != [0; 3];
            let slope = |r: &Raster<[u8; 3]>| {
                dvec2(grey(r, x + 1, y) - grey(r, x - 1, y), grey(r, x, y + 1) - grey(r, x, y - 1)) / 2.0
            };
            let g = (slope(a) + slope(b)) / 2.0;
            normal += DMat2::from_cols(g * g.x, g * g.y);
            right += g * (grey(a, x, y) - grey(b, x, y));
        }
        // The smaller eigenvalue: how well the worse direction is known.
        let (trace, det) = (normal.x_axis.x + normal.y_axis.y, normal.determinant());
        let least = 0.5 * (trace - (trace * trace - 4.0 * det).max(0.0).sqrt());
        if all_known && least > 15_000.0 {
            found.push((normal.inverse() * right).length());
        }
    }
    found
}

/// What a camera sees, four samples a pixel: as many as the photographs have.
fn smooth(scene: &Scene<'_>, mip_maps: &MipMaps, camera: &Camera) -> Raster<[u8; 3]> {
    let (f, c) = (2.0 * camera.focal_px(), 2.0 * camera.center_px());
    let large = Camera::pinhole(camera.pose, f, c, 2 * camera.width, 2 * camera.height).unwrap();
    let image = rgb_image(scene, mip_maps, &cast(scene, &large), &large);
    let pixel = |i: u32| {
        let (x, y) = (2 * (i % camera.width), 2 * (i / camera.width));
        let four =
            [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| image.at(x, y).map(u32::from));
        std::array::from_fn(|k| (four.iter().map(|p| p[k]).sum::<u32>() / 4) as u8)
    };
    let all = 0..camera.width * camera.height;
    Raster::from_vec(camera.width, camera.height, all.map(pixel).collect())
}

/// Each view of a photograph against the mesh as its own pose file has the camera; returns all displacements.
fn registered(out: &Path) -> Vec<f64> {
    let layout = Layout::new(out);
    let (scene, mip_maps) = (Scene::new(mesh()), MipMaps::new(mesh()));
    let mut all = Vec::new();
    for image in dataset_images(&layout, 1).unwrap() {
        let path = |domain: &str| image.path(&layout, domain.parse().unwrap());
        let (photo, pose) = (read_rgb8(&path("rgb")).unwrap(), read_pose(&path("pose")).unwrap());
        let (w, h) = (photo.width(), photo.height());
        let camera = Camera::from_k_rt(pose.camera_k_matrix, pose.camera_rt_matrix, w, h).unwrap();
        let hits = cast(&scene, &camera);
        let (depth, expected) = (read_gray16(&path("depth")).unwrap(), depth_image(&hits));
        let off = depth.pixels().iter().zip(expected.pixels()).filter(|(a, b)| a.abs_diff(**b) > 1);
        // A pose from its matrix is off in the last digits: at silhouettes that shows.
        assert!(off.count() * 1000 < depth.len());
        all.extend(displacements(&photo, &smooth(&scene, &mip_maps, &camera)));
    }
    all.sort_by(f64::total_cmp);
    all
}

#[test]
fn photographs_through_a_lens_that_bends_lie_on_the_mesh() {
    let project = Project::with_photographs(LISTED);
    let (out, log) = project.export("out", &[]);
    let records = photographs(&out);
    assert_eq!(records.len(), 4, "{log}");
    for (i, record) in records.iter().enumerate() {
        assert_eq!(record.name, format!("images/{i}.png"));
        assert_eq!((record.width, record.height, record.room.as_str()), (SIZE[0], SIZE[1], "unknown_1"));
        let (agreement, chance) = (record.agreement.unwrap(), record.chance.unwrap());
        assert!(agreement > 0.6 && agreement > chance + 0.3, "{record:?}");
        assert!(record.seen > 0.9 && record.masked < 0.2, "{record:?}");
    }
    let off = registered(&out);
    assert!(off.len() > 40, "{off:?}");
    assert!(off[off.len() / 2] < 0.1 && off[off.len() - 1] < 0.3, "{off:?}");

    // No locations are placed beside photographs, unless they are asked for.
    let manifest: Value = serde_json::from_slice(&fs::read(out.join("manifest.json")).unwrap()).unwrap();
    let area = &manifest["areas"][0];
    assert_eq!([&area["frames"], &area["views"], &area["panoramas"], &area["locations"]], [4, 4, 0, 0]);
    let (both, _) = project.export("both", &["--place-cameras", "6"]);
    let manifest: Value = serde_json::from_slice(&fs::read(both.join("manifest.json")).unwrap()).unwrap();
    let area = &manifest["areas"][0];
    assert!(area["frames"] == 4 && area["panoramas"].as_u64() > Some(1) && area["views"].as_u64() > Some(6));
    // The views of photographs are the same.
    for record in &records {
        let of = |out: &Path| -> Vec<Vec<u8>> {
            let all = files(&out.join("area_1/data"));
            all.into_iter()
                .filter(|(p, _)| p.to_string_lossy().contains(&record.camera_uuid))
                .map(|f| f.1)
                .collect()
        };
        assert!(of(&out).len() == 5 && of(&out) == of(&both));
    }

    // A principal point that is a pixel off is found by the same measure.
    let mut wrong = transforms(&poses());
    wrong["cx"] = json!(CENTER.x + 1.0);
    project.write("transforms.json", &wrong.to_string());
    let (out, _) = project.export("wrong", &["--modalities", "rgb,depth,pose"]);
    let off = registered(&out);
    assert!((0.8..2.0).contains(&off[off.len() / 2]), "{off:?}");
}

/// The same through a fisheye lens, from COLMAP's list, in a smaller size, beside labels and locations.
#[test]
fn a_fisheyes_photographs_of_a_colmap_model_become_smaller_views() {
    let scan = demo();
    let tree = text(&scan.join("Area_1")).to_owned();
    let list = text(&scan.join("cameras.csv")).to_owned();
    let rest = format!(
        "[annotations]\npath = {tree:?}\n[cameras]\npath = {list:?}\n\
         [frames]\npath = \"model\"\nimages = \"photos\"\nwidth = 240\nevery = 2\n"
    );
    let project = Project::new(&rest);
    let ([f, g], [x, y], [k1, k2, k3, k4]) = (FOCAL.to_array(), CENTER.to_array(), ANGULAR);
    let camera = format!("3 OPENCV_FISHEYE {} {} {f} {g} {x} {y} {k1} {k2} {k3} {k4}\n", SIZE[0], SIZE[1]);
    project.write("model/sparse/0/cameras.txt", &camera);
    let mut images = String::new();
    for (i, pose) in poses().iter().enumerate() {
        let m = pose.opencv_from_world();
        let (q, t) = (glam::DQuat::from_mat3(&m), -(m * pose.location));
        images +=
            &format!("{} {} {} {} {} {} {} {} 3 hall/{i}.jpg\n\n", i + 1, q.w, q.x, q.y, q.z, t.x, t.y, t.z);
        if i % 2 == 0 {
            // A name may lack its ending, or its folder.
            write(
                &project.at(&format!("photos/{}{i}.jpg", if i == 0 { "hall/" } else { "" })),
                &take(pose, &fisheye()),
            );
        }
    }
    project.write("model/sparse/0/images.txt", &images);
    let (out, _) = project.export("out", &[]);
    let records = photographs(&out);
    let names: Vec<&str> = records.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["hall/0.jpg", "hall/2.jpg"]);
    for record in &records {
        assert_eq!((record.width, record.height), (240, 180));
        assert!(record.agreement.unwrap() > record.chance.unwrap() + 0.3, "{record:?}");
        assert!(!record.room.starts_with("unknown"), "{record:?}");
    }
    // Views of the mesh have another size and no list of photographs: those alone are compared.
    let layout = Layout::new(&out);
    let all = dataset_images(&layout, 1).unwrap();
    assert!(all.len() > 10 && all.iter().all(|image| image.domains.len() == 7));
    for image in all.iter().filter(|image| !records.iter().any(|r| r.camera_uuid == image.uuid)) {
        fs::remove_file(image.path(&layout, s3d_io::dataset::Domain::Pose)).unwrap();
        image.domains.iter().for_each(|domain| drop(fs::remove_file(image.path(&layout, *domain))));
    }
    let off = registered(&out);
    assert!(off.len() > 10 && off[off.len() / 2] < 0.1 && off[off.len() - 1] < 0.3, "{off:?}");
}

/// A pose that is off, or a matrix that is transposed, shows in the report and is warned of.
#[test]
fn poses_that_do_not_fit_show_in_their_agreement() {
    let project = Project::with_photographs(LISTED);
    let agreements = |poses: &[Pose], name: &str| {
        project.write("transforms.json", &transforms(poses).to_string());
        let (out, log) = project.export(name, &["--modalities", "rgb,pose", "--allow", "coverage"]);
        let records = photographs(&out);
        (records.iter().map(|r| r.agreement.unwrap_or(0.0)).collect::<Vec<_>>(), log)
    };
    let good = poses();
    let (of_good, log) = agreements(&good, "good");
    assert!(!log.contains("by chance"), "{log}");
    let turned = good.map(|pose| pose.turned(5f64.to_radians(), 0.0));
    let tilted = good.map(|pose| pose.turned(0.0, 5f64.to_radians()));
    let transposed = good.map(|pose| Pose { world_from_camera: pose.world_from_camera.transpose(), ..pose });
    for (wrong, name) in [(turned, "turned"), (tilted, "tilted"), (transposed, "transposed")] {
        let (of_wrong, log) = agreements(&wrong, name);
        for (good, wrong) in of_good.iter().zip(&of_wrong) {
            assert!(*good > wrong + 0.25, "{name}: {of_good:?} {of_wrong:?}");
        }
        if name == "transposed" {
            assert!(log.contains("photographs and mesh agree no more than by chance"), "{log}");
        }
    }
    let mut one = good;
    one[2] = transposed[2];
    let (_, log) = agreements(&one, "one");
    assert!(log.contains("1 of 4 photographs agree with the mesh no more than by chance"), "{log}");
    assert!(log.contains("images/2.png ("), "{log}");
}

/// The same bytes for any number of threads, in shards, with a plan, and after a stop.
#[test]
fn threads_shards_and_plans_change_no_byte() {
    let project = Project::with_photographs(&format!("[cameras]\nplace = 6.0\n{LISTED}"));
    let (one, _) = project.export("one", &["--threads", "1"]);
    let expected = files(&one);
    assert!(expected.contains_key(Path::new("area_1/frames.json")));
    let (three, _) = project.export("three", &["--threads", "3"]);
    assert!(files(&three) == expected, "threads change something");
    let (scene, shared, plan) = (project.at("scene.toml"), project.at("shared"), project.at("plan"));
    let small = ["--size", "32", "--views", "4"];
    s3d_ok(&[&["plan", text(&scene), "-o", text(&plan)][..], &small].concat());
    for number in ["1/3", "2/3", "3/3"] {
        let more = ["--shard", number, "--plan", text(&plan)];
        s3d_ok(&[&project.args(&scene, &shared)[..], &more].concat());
    }
    s3d_ok(&["merge", text(&shared), "-o", text(&shared)]);
    assert!(files(&shared) == expected, "shards change something");
    // A photograph that is another is another input.
    write(&project.at("images/1.png"), &Raster::filled(SIZE[0], SIZE[1], [90, 80, 70]));
    let args = project.args(&scene, &one);
    s3d_fails(&args, 2, &["images/: other bytes"]);
}

#[test]
fn what_is_wrong_with_photographs_is_said_before_anything_is_written() {
    let project = Project::with_photographs(LISTED);
    let good = transforms(&poses());
    let with = |change: &dyn Fn(&mut Value)| {
        let mut list = good.clone();
        change(&mut list);
        project.write("transforms.json", &list.to_string());
    };
    with(&|list| list["frames"][1]["file_path"] = json!("images/gone.png"));
    project.fails(&["transforms.json", "1 of 4 photographs are not there", "images/gone.png", "[frames]"]);
    with(&|list| list["w"] = json!(400));
    project.fails(&["images/0.png", "320 × 240 pixels", "its camera is for 400 × 240"]);
    with(&|list| {
        ["fl_x", "fl_y"].iter().for_each(|key| drop(list.as_object_mut().unwrap().remove(*key)));
    });
    project.fails(&[
        "images/0.png",
        "neither its focal lengths nor its angle of view are known",
        "camera_angle_x",
    ]);
    with(&|list| list["frames"][2] = list["frames"][0].clone());
    project.fails(&["\"images/0.png\": is listed twice"]);
    with(&|list| list["frames"][0]["transform_matrix"][0][3] = json!(4e5));
    // One may be far off; all of them have another frame.
    with(&|list| (0..4).for_each(|i| list["frames"][i]["transform_matrix"][0][3] = json!(4e5)));
    project.fails(&["lie", "[[1, 0, 0, "]);
    with(&|list| (0..4).for_each(|i| list["frames"][i]["transform_matrix"][2][3] = json!(60.0)));
    with(&|list| list["cx"] = json!(1000.0));
    project.fails(&["the principal point (1000, 117.5) lies outside of the photograph of 320 × 240"]);
    with(&|_| ());
    fs::write(project.at("images/3.png"), b"none").unwrap();
    project.fails(&["images/3.png", "no picture that can be read"]);
}

/// ScanNet's folders: poses that are not known are left out and counted, and names have no endings.
#[test]
fn a_scannet_folder_is_taken_with_the_poses_that_it_knows() {
    let project = Project::new("[frames]\npath = \"scan\"\nmax = 2\n");
    let pinhole = PhotoLens::Straight(Lens::new(SIZE, FOCAL, CENTER, [0.0; 5]).unwrap());
    let k = [[FOCAL.x, 0.0, CENTER.x], [0.0, FOCAL.y, CENTER.y], [0.0, 0.0, 1.0]];
    let lines = |rows: &[&[f64]]| -> String {
        rows.iter().map(|row| row.iter().map(f64::to_string).collect::<Vec<_>>().join(" ") + "\n").collect()
    };
    project.write("scan/intrinsic/intrinsic_color.txt", &lines(&[&k[0], &k[1], &k[2]]));
    for (i, pose) in poses().iter().take(3).enumerate() {
        let rows = rows(pose, -1.0);
        project.write(&format!("scan/pose/{i}.txt"), &lines(&[&rows[0], &rows[1], &rows[2], &rows[3]]));
        write(&project.at(&format!("scan/color/{i}.png")), &take(pose, &pinhole));
    }
    project.write("scan/pose/7.txt", &"-inf -inf -inf -inf\n".repeat(4));
    let (out, log) = project.export("out", &[]);
    assert!(
        log.contains("1 of 4 photographs are left out") && log.contains("2 of 3 photographs are taken"),
        "{log}"
    );
    let names: Vec<String> = photographs(&out).into_iter().map(|r| r.name).collect();
    assert_eq!(names, ["0", "1"]);
    // A pinhole's photograph is its view, pixel by pixel.
    let (view, photo) =
        (read_rgb8(&first_of(&out, "0")).unwrap(), read_rgb8(&project.at("scan/color/0.png")).unwrap());
    assert!(view.pixels().iter().zip(photo.pixels()).all(|(a, b)| *a == b.map(|v| v.max(1))));
    assert!(photographs(&out).iter().all(|r| r.masked == 0.0 && r.agreement.unwrap() > 0.6));
}

/// The colours of the view of the photograph of this name.
fn first_of(out: &Path, name: &str) -> PathBuf {
    let uuid = photographs(out).into_iter().find(|r| r.name == name).unwrap().camera_uuid;
    let folder = out.join("area_1/data/rgb");
    let names = files(&folder).into_keys();
    folder.join(names.into_iter().find(|p| p.to_string_lossy().contains(&uuid)).unwrap())
}

/// Polycam's folders: optimized cameras, Y-up, with what takes them to the mesh's frame.
#[test]
fn a_polycam_capture_lies_on_its_mesh() {
    let project = Project::new("[frames]\npath = \"capture\"\nmax = 1\n");
    let pinhole = PhotoLens::Straight(Lens::new(SIZE, FOCAL, CENTER, [0.0; 5]).unwrap());
    let pose = poses()[1];
    write(&project.at("capture/keyframes/corrected_images/77.png"), &take(&pose, &pinhole));
    // Z-up (x, y, z) is Y-up (x, z, −y); the capture's frame lies 5 m beside the mesh's.
    let rows = rows(&pose, 1.0);
    let y_up = [rows[0], rows[2], rows[1].map(|v| -v)];
    let mut camera =
        json!({"fx": FOCAL.x, "fy": FOCAL.y, "cx": CENTER.x, "cy": CENTER.y, "width": 320, "height": 240});
    for (i, j) in (0..3).flat_map(|i| (0..4).map(move |j| (i, j))) {
        camera[format!("t_{i}{j}")] = json!(y_up[i][j] - if (i, j) == (0, 3) { 5.0 } else { 0.0 });
    }
    project.write("capture/keyframes/corrected_cameras/77.json", &camera.to_string());
    let aligned = json!({"alignmentTransform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]});
    project.write("capture/mesh_info.json", &aligned.to_string());
    let (out, _) = project.export("out", &[]);
    let records = photographs(&out);
    assert_eq!((records.len(), records[0].name.as_str()), (1, "77"));
    assert!(records[0].agreement.unwrap() > 0.6, "{records:?}");
}

/// Packages have the photographs with their own cameras; where a view lies outside of its photograph they say so.
#[test]
fn packages_know_photographs_and_their_masks() {
    let project = Project::with_photographs(&format!("[cameras]\nplace = 6.0\n{LISTED}"));
    // Pincushion distortion: the view reaches beyond the photograph.
    let mut list = transforms(&poses());
    (list["k1"], list["k2"]) = (json!(0.3), json!(0.0));
    project.write("transforms.json", &list.to_string());
    let (out, _) = project.export("out", &[]);
    let records = photographs(&out);
    assert!(records.iter().all(|r| r.masked > 0.02), "{records:?}");
    let pack = |kind: &str| {
        let place = project.at(kind);
        s3d_ok(&["pack", text(&out), "--to", kind, "-o", text(&place), "--images", "views"]);
        place
    };
    let nerfstudio = pack("nerfstudio").join("area_1");
    let packed: Value =
        serde_json::from_slice(&fs::read(nerfstudio.join("transforms.json")).unwrap()).unwrap();
    let frames = packed["frames"].as_array().unwrap();
    let mut own = 0;
    for frame in frames {
        let mask = nerfstudio.join(frame["mask_path"].as_str().unwrap());
        // The kind of its pixels: gray.
        assert_eq!(fs::read(&mask).unwrap()[24..26], [8, 0]);
        let mask = s3d_io::camera::read_picture(&mask).unwrap();
        let zeros = mask.pixels().iter().filter(|p| **p == [0; 3]).count();
        let path = frame["file_path"].as_str().unwrap();
        match records.iter().find(|r| path.contains(&r.camera_uuid)) {
            Some(record) => {
                own += 1;
                let share = zeros as f64 / f64::from(record.width * record.height);
                assert!((share - record.masked).abs() < 1e-6);
                assert_eq!([&frame["fl_x"], &frame["fl_y"]], [FOCAL.x, FOCAL.y]);
                assert_eq!(
                    [&frame["cx"], &frame["cy"], &frame["w"]],
                    [&json!(CENTER.x), &json!(CENTER.y), &json!(320)]
                );
            }
            None => assert_eq!(zeros, 0),
        }
    }
    assert!(own == 4 && frames.len() > 8, "{own} of {}", frames.len());
    let cameras = fs::read_to_string(pack("colmap").join("area_1/sparse/0/cameras.txt")).unwrap();
    assert_eq!(cameras.matches("PINHOLE 320 240 210 212 163.25 117.5").count(), 4, "{cameras}");
    pack("webdataset");
    let table = project.at("images.parquet");
    s3d_ok(&["pack", text(&out), "--to", "parquet", "-o", text(&table)]);
    let bytes = fs::read(&table).unwrap();
    assert!(bytes.windows(14).any(|w| w == b"images/3.png\0\0" || w.starts_with(b"images/3.png")));
    // Coordinates that are made again are those of the photographs' own cameras, but for steps of depth.
    let layout = Layout::new(&out);
    let all = dataset_images(&layout, 1).unwrap();
    let of_photographs = all.iter().filter(|image| records.iter().any(|r| r.camera_uuid == image.uuid));
    let paths: Vec<PathBuf> =
        of_photographs.map(|i| i.path(&layout, s3d_io::dataset::Domain::GlobalXyz)).collect();
    let world = || paths.iter().map(|path| s3d_io::image::read_xyz(path).unwrap()).collect::<Vec<_>>();
    let before = world();
    s3d_ok(&["xyz", text(&out), "--type", "half", "--overwrite"]);
    s3d_ok(&["verify", text(&out)]);
    for (a, b) in before.iter().zip(world()) {
        let off = a
            .pixels()
            .iter()
            .zip(b.pixels())
            .map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max));
        assert!(off.fold(0.0, f32::max) < 0.03);
    }
    assert_eq!(before.len(), 4);
    // Exported anew, its photographs are no scan locations.
    let again = project.at("again");
    let small = [
        "--points-per-m2",
        "20",
        "--size",
        "32",
        "--pano-width",
        "64",
        "--views",
        "2",
        "--modalities",
        "pose",
    ];
    s3d_ok(&[&["export", text(&out.join("area_1")), "-o", text(&again)][..], &small].concat());
    let poses = files(&again.join("area_1/pano/pose"));
    assert!(!poses.is_empty());
    assert!(poses.keys().all(|p| records.iter().all(|r| !p.to_string_lossy().contains(&r.camera_uuid))));
}

/// Colours with more samples at edges differ there alone; everything else is the same, and verify knows.
#[test]
fn samples_at_edges_change_colours_alone() {
    let project = Project::new("[cameras]\nplace = 6.0\n");
    let export = |name: &str, more: &[&str]| {
        let all = [&["--modalities", "rgb,depth,normal,pose"][..], more].concat();
        files(&project.export(name, &all).0)
    };
    let one = export("one", &[]);
    assert!(export("same", &["--rgb-samples", "1"]) == one, "one sample is the default");
    let four = export("four", &["--rgb-samples", "4"]);
    let differs = |path: &PathBuf| one[path] != four[path];
    let is_rgb = |path: &Path| path.components().any(|part| part.as_os_str() == "rgb");
    let images: Vec<&PathBuf> =
        one.keys().filter(|p| p.starts_with("area_1/data") || p.starts_with("area_1/pano")).collect();
    let is_panorama = |path: &Path| is_rgb(path) && path.starts_with("area_1/pano");
    assert!(images.iter().filter(|p| is_panorama(p)).all(|p| differs(p)), "every panorama has edges");
    assert!(images.iter().filter(|p| !is_rgb(p)).all(|p| !differs(p)));
    assert!(String::from_utf8_lossy(&four[Path::new("manifest.json")]).contains("\"rgb_samples\": 4"));
    assert!(!String::from_utf8_lossy(&one[Path::new("manifest.json")]).contains("rgb_samples"));
    let scene = project.at("scene.toml");
    s3d_fails(&["export", text(&scene), "--rgb-samples", "0"], 2, &["--rgb-samples"]);
}
