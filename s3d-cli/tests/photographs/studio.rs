//! Takes photographs in the built-in scene, makes projects of them, and measures how far views are displaced.

use crate::common::{s3d_fails, s3d_ok, text};
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

pub(crate) const SIZE: [u32; 2] = [320, 240];
pub(crate) const FOCAL: DVec2 = dvec2(210.0, 212.0);
pub(crate) const CENTER: DVec2 = dvec2(163.25, 117.5);

/// Barrel distortion like a wide phone lens.
pub(crate) const RADIAL: [f64; 5] = [-0.21, 0.06, 0.0015, -0.0011, 0.004];
pub(crate) const ANGULAR: [f64; 4] = [0.03, -0.012, 0.004, -0.0006];

pub(crate) fn radial() -> PhotoLens {
    PhotoLens::Straight(Lens::new(SIZE, FOCAL, CENTER, RADIAL).unwrap())
}

pub(crate) fn fisheye() -> PhotoLens {
    PhotoLens::Fisheye(FisheyeLens::new(SIZE, FOCAL, CENTER, ANGULAR).unwrap())
}

/// Photographs are taken in rooms with many objects, tilted and rolled.
pub(crate) fn poses() -> [Pose; 4] {
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
pub(crate) fn demo() -> &'static Path {
    static DEMO: OnceLock<PathBuf> = OnceLock::new();
    DEMO.get_or_init(|| {
        let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("photographs");
        let _ = fs::remove_dir_all(&dir);
        let small = ["--views", "0", "--size", "16", "--pano-width", "32", "--points-per-m2", "20"];
        s3d_ok(&[&["demo", "-o", text(&dir)][..], &small].concat());
        dir.join("scan")
    })
}

pub(crate) fn mesh() -> &'static TriMesh {
    static MESH: OnceLock<TriMesh> = OnceLock::new();
    MESH.get_or_init(|| read_mesh(&demo().join("rgb.obj"), UpAxis::Y).unwrap().mesh)
}

/// The picture of a camera behind a lens, four rays a pixel.
pub(crate) fn take(pose: &Pose, lens: &PhotoLens) -> Raster<[u8; 3]> {
    let (scene, mip_maps) = (Scene::new(mesh()), MipMaps::new(mesh()));
    let [w, h] = lens.size();
    // Gives the size of a pixel, for textures.
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

pub(crate) fn write(path: &Path, image: &Raster<[u8; 3]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    write_rgb8(path, image, Content::Photo, Compression::Fast).unwrap();
}

/// The 4 × 4 matrix from camera to world, in OpenGL's axes for `s` = 1 and OpenCV's for −1.
pub(crate) fn rows(pose: &Pose, s: f64) -> [[f64; 4]; 4] {
    let (m, p) = (pose.world_from_camera, pose.location);
    let row = |k: usize| [m.x_axis[k], s * m.y_axis[k], s * m.z_axis[k], p[k]];
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
}

/// The frames of nerfstudio's list, `images/0.png` …, of the first lens.
pub(crate) fn transforms(poses: &[Pose]) -> Value {
    let [k1, k2, p1, p2, k3] = RADIAL;
    let frame = |(i, pose): (usize, &Pose)| {
        let name = format!("images/{i}.png");
        json!({"file_path": name, "transform_matrix": rows(pose, 1.0)})
    };
    json!({
        "camera_model": "OPENCV", "w": SIZE[0], "h": SIZE[1], "fl_x": FOCAL.x, "fl_y": FOCAL.y,
        "cx": CENTER.x, "cy": CENTER.y, "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": k3,
        "frames": poses.iter().enumerate().map(frame).collect::<Vec<_>>(),
    })
}

/// A folder whose scene file has the mesh of the demo, and further tables.
pub(crate) struct Project {
    pub(crate) dir: tempfile::TempDir,
}

impl Project {
    pub(crate) fn new(rest: &str) -> Self {
        let project = Self { dir: tempfile::tempdir().unwrap() };
        let mesh = text(&demo().join("rgb.obj")).to_owned();
        project.write("scene.toml", &format!("area = 1\n[mesh]\npath = {mesh:?}\n{rest}"));
        project
    }

    /// A project with the photographs of the first lens, and their list.
    pub(crate) fn with_photographs(rest: &str) -> Self {
        static TAKEN: OnceLock<Vec<Raster<[u8; 3]>>> = OnceLock::new();
        let project = Self::new(rest);
        let taken = TAKEN.get_or_init(|| poses().iter().map(|pose| take(pose, &radial())).collect());
        taken
            .iter()
            .enumerate()
            .for_each(|(i, image)| write(&project.at(&format!("images/{i}.png")), image));
        project.write("transforms.json", &transforms(&poses()).to_string());
        project
    }

    pub(crate) fn at(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: &str) {
        let path = self.at(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, content).unwrap();
    }

    pub(crate) fn args<'a>(&'a self, scene: &'a Path, out: &'a Path) -> Vec<&'a str> {
        let small = ["--points-per-m2", "20", "--size", "32", "--pano-width", "64", "--views", "4"];
        [&["export", text(scene), "-o", text(out)][..], &small].concat()
    }

    /// Exports into the folder `name`, which `verify` must accept.
    pub(crate) fn export(&self, name: &str, more: &[&str]) -> (PathBuf, String) {
        let (scene, out) = (self.at("scene.toml"), self.at(name));
        let log = s3d_ok(&[&self.args(&scene, &out)[..], more].concat());
        s3d_ok(&["verify", text(&out)]);
        (out, log)
    }

    pub(crate) fn fails(&self, parts: &[&str]) {
        let (scene, out) = (self.at("scene.toml"), self.at("out"));
        s3d_fails(&self.args(&scene, &out), 1, parts);
        assert!(!out.exists(), "something was written");
    }
}

pub(crate) const LISTED: &str = "[frames]\npath = \"transforms.json\"\n";

pub(crate) fn photographs(out: &Path) -> Vec<PhotographRecord> {
    read_photographs(&Layout::new(out).frames_json(1)).unwrap()
}

/// The displacements of one picture against another of the same view, in pixels, for squares of 32 pixels.
/// They solve the equations of Lucas and Kanade; squares without a reliable solution are left out. `is_known`
/// holds for both.
pub(crate) fn displacements(a: &Raster<[u8; 3]>, b: &Raster<[u8; 3]>) -> Vec<f64> {
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
        // The smaller eigenvalue: how well the worse direction is determined.
        let (trace, det) = (normal.x_axis.x + normal.y_axis.y, normal.determinant());
        let least = 0.5 * (trace - (trace * trace - 4.0 * det).max(0.0).sqrt());
        if all_known && least > 15_000.0 {
            found.push((normal.inverse() * right).length());
        }
    }
    found
}

/// The image of a camera at four samples a pixel, as many as the photographs have.
pub(crate) fn smooth(scene: &Scene<'_>, mip_maps: &MipMaps, camera: &Camera) -> Raster<[u8; 3]> {
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

/// Compares each view of a photograph with the mesh, seen by the camera of the view's pose file. Returns all
/// displacements.
pub(crate) fn registered(out: &Path) -> Vec<f64> {
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
        let off = depth
            .pixels()
            .iter()
            .zip(expected.pixels())
            .filter(|(a, b)| a.abs_diff(**b) > 1);
        // A pose read from its matrix differs in the last digits, which shows at silhouettes.
        assert!(off.count() * 1000 < depth.len());
        all.extend(displacements(&photo, &smooth(&scene, &mip_maps, &camera)));
    }
    all.sort_by(f64::total_cmp);
    all
}
