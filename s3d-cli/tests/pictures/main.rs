//! RGB from the scanner's pictures, there and back. Our own renderer takes pictures in the built-in scene: a
//! sky box, a panorama, and 18 captures through a lens that distorts. They must give the same images as the
//! mesh.

mod e57;

use crate::common;
use common::{UUID_A, UUID_B, files, s3d_fails, s3d_ok, text, write_scan};
use glam::{DVec2, DVec3, dvec2};
use s3d_geom::{Camera, Lens, Pose, Raster, TriMesh};
use s3d_io::camera::read_cameras;
use s3d_io::image::{Compression, Content, read_gray16, read_rgb8, write_rgb8};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_render::{MipMaps, Scene, cast, rgb_image};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

fn write(path: &Path, image: &Raster<[u8; 3]>) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    write_rgb8(path, image, Content::Photo, Compression::Fast).unwrap();
}

/// A photographer in a mesh.
struct Studio<'m> {
    scene: Scene<'m>,
    mip_maps: MipMaps,
}

impl<'m> Studio<'m> {
    fn new(mesh: &'m TriMesh) -> Self {
        Self { scene: Scene::new(mesh), mip_maps: MipMaps::new(mesh) }
    }

    fn take(&self, camera: &Camera) -> Raster<[u8; 3]> {
        rgb_image(&self.scene, &self.mip_maps, &cast(&self.scene, camera), camera)
    }

    /// The six faces of a sky box, as `s3d_io::formats` defines them. The camera looks up and down from
    /// `heading`.
    fn sky_box(&self, pose: &Pose, heading: f64, size: u32) -> Vec<Raster<[u8; 3]>> {
        let turns = [
            (heading, FRAC_PI_2),
            (-FRAC_PI_2, 0.0),
            (2.0 * FRAC_PI_2, 0.0),
            (FRAC_PI_2, 0.0),
            (0.0, 0.0),
            (heading, -FRAC_PI_2),
        ];
        turns
            .map(|(yaw, pitch)| {
                self.take(&Camera::perspective(pose.turned(yaw, pitch), FRAC_PI_2, size, size))
            })
            .into()
    }

    /// A picture through a lens: an undistorted one of more pixels, bent.
    fn capture(&self, pose: Pose, lens: &Lens) -> Raster<[u8; 3]> {
        let reach = 1.02 * lens.reach();
        let width = 2 * (reach * lens.focal_px().x).ceil() as u32;
        let straight = Camera::perspective(pose, 2.0 * reach.atan(), 2 * width, 2 * width);
        let image = self.take(&straight);
        let focal = straight.focal_px().x;
        let at = |p: DVec2| -> [f64; 3] {
            let d = lens.direction(p).expect("the lens sees all of its picture");
            let q = dvec2(d.x, d.y) * focal + f64::from(width) - 0.5;
            let (x, y) = (q.x as u32, q.y as u32);
            let (fx, fy) = (q.x.fract(), q.y.fract());
            let [a, b, c, e] =
                [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)].map(|(x, y)| image.at(x, y).map(f64::from));
            std::array::from_fn(|k| {
                (a[k] * (1.0 - fx) + b[k] * fx) * (1.0 - fy) + (c[k] * (1.0 - fx) + e[k] * fx) * fy
            })
        };
        let (w, h) = (lens.width(), lens.height());
        let pixel = |i: u32| {
            let p = dvec2(f64::from(i % w) + 0.5, f64::from(i / w) + 0.5);
            // Four samples: the undistorted picture has twice the pixels.
            let samples = [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)]
                .map(|(x, y)| at(p + dvec2(x, y)));
            std::array::from_fn(|k| (samples.iter().map(|s| s[k]).sum::<f64>() / 4.0).round() as u8)
        };
        Raster::from_vec(w, h, (0..w * h).map(pixel).collect())
    }
}

/// Three lenses that differ, bent as much as real ones.
fn lenses() -> [(Lens, String); 3] {
    [0.0, 1.0, 2.0].map(|k| {
        let (size, f) = ([640u32, 512u32], [472.0 + k, 471.0]);
        let (c, d) =
            ([318.4 + 3.0 * k, 258.1 - 2.0 * k], [0.12 - 0.05 * k, -0.11, 0.0011, -0.0009 * k, 0.02]);
        let mut line = format!("{} {}", size[0], size[1]);
        f.iter().chain(&c).chain(&d).for_each(|v| write!(line, " {v}").unwrap());
        let lens = Lens::new(size, DVec2::from(f), DVec2::from(c), d).unwrap();
        (lens, line)
    })
}

/// The captures of a scanner at `pose`: three cameras on an arm, each a little beside the centre, at six
/// stops.
fn write_captures(studio: &Studio<'_>, uuid: &str, pose: &Pose, dir: &Path) {
    fs::create_dir_all(dir).unwrap();
    for (camera, (lens, line)) in lenses().iter().enumerate() {
        fs::write(dir.join(format!("{uuid}_intrinsics_{camera}.txt")), line).unwrap();
        for stop in 0..6 {
            let turned = pose.turned(-f64::from(stop) * FRAC_PI_3, [0.85, 0.0, -0.85][camera]);
            let arm = pose.turned(-f64::from(stop) * FRAC_PI_3, 0.0).forward();
            let location = pose.location + 0.04 * arm + DVec3::Z * [0.05, 0.0, -0.05][camera];
            let own = Pose { location, ..turned };
            write(&dir.join(format!("{uuid}_i{camera}_{stop}.png")), &studio.capture(own, lens));
            // Camera → world in OpenCV's axes: x right, y down, z forward.
            let (x, y, z) = (own.right(), -own.up(), own.forward());
            let mut matrix = String::new();
            for k in 0..3 {
                let _ = writeln!(matrix, "{:.9} {:.9} {:.9} {:.9}", x[k], y[k], z[k], location[k]);
            }
            matrix += "0 0 0 1\n";
            fs::write(dir.join(format!("{uuid}_pose_{camera}_{stop}.txt")), matrix).unwrap();
        }
    }
}

/// Whether a pixel or one beside it is at an edge of the depth, a step or a crease. The reciprocal of the
/// depth is linear along a plane. An edge is a second difference of at least 3 steps of the depth's
/// quantisation plus a five hundredth.
fn is_near_edge(depth: &Raster<u16>, x: u32, y: u32) -> bool {
    let bends = |x: u32, y: u32| {
        let at = |x: u32, y: u32| 1.0 / f64::from(depth.at(x, y));
        let (here, bound) = (at(x, y), 3.0 / f64::from(depth.at(x, y)) + 0.002);
        let bent = |a: f64, b: f64| (a + b - 2.0 * here).abs() > bound * here;
        bent(at(x - 1, y), at(x + 1, y)) || bent(at(x, y - 1), at(x, y + 1))
    };
    (y - 1..=y + 1).any(|y| (x - 1..=x + 1).any(|x| bends(x, y)))
}

/// The lowest peak signal-to-noise ratio, in dB, of the images of a kind against the images of the same name
/// in another data set, over all pixels that are not near an edge of the depth; and the number of images.
fn worst_psnr(ours: &Path, reference: &Path, kind: &str) -> (f64, usize) {
    let folder = |out: &Path, what: &str| out.join("area_1").join(kind).join(what);
    let (mut worst, mut count) = (f64::INFINITY, 0);
    for entry in fs::read_dir(folder(reference, "rgb")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let a = read_rgb8(&folder(ours, "rgb").join(&name)).unwrap();
        let b = read_rgb8(&folder(reference, "rgb").join(&name)).unwrap();
        let depth = folder(reference, "depth").join(name.replace("_domain_rgb", "_domain_depth"));
        let depth = read_gray16(&depth).unwrap();
        let (w, h) = (depth.width(), depth.height());
        let (mut squares, mut pixels) = (0.0, 0u64);
        for (x, y) in (2..h - 2).flat_map(|y| (2..w - 2).map(move |x| (x, y))) {
            let (a, b) = (a.at(x, y), b.at(x, y));
            assert_eq!(a == [0; 3], b == [0; 3], "{name}: black is for missing pixels, and only for them");
            if !is_near_edge(&depth, x, y) {
                pixels += 1;
                squares += (0..3).map(|k| (f64::from(a[k]) - f64::from(b[k])).powi(2)).sum::<f64>();
            }
        }
        assert!(2 * pixels > u64::from(w * h), "{name}: too little left to compare");
        worst = f64::min(worst, 10.0 * (255.0 * 255.0 * 3.0 * pixels as f64 / squares.max(1e-9)).log10());
        count += 1;
    }
    (worst, count)
}

/// A location of the built-in scene from which all of it can be seen.
const UUID: &str = "0c5a7d1e93b84f62a1d7e0f4b2683c95";

fn export(scan: &Path, rgb: &str) -> PathBuf {
    let name: String = rgb.chars().filter(char::is_ascii_alphanumeric).take(40).collect();
    let scene = fs::read_to_string(scan.join("scene.toml")).unwrap();
    let path = scan.join(format!("{name}.toml"));
    fs::write(
        &path,
        if rgb.starts_with("rgb") {
            format!("{rgb}\n{scene}")
        } else {
            format!("{scene}{rgb}\n")
        },
    )
    .unwrap();
    let out = scan.with_file_name(name);
    let mut args =
        vec!["export", text(&path), "-o", text(&out), "--only", UUID, "--keep-all", "--views", "6"];
    args.extend([
        "--size",
        "256",
        "--pano-width",
        "512",
        "--points-per-m2",
        "50",
        "--modalities",
        "rgb,depth",
    ]);
    s3d_ok(&args);
    out
}

/// The pixel of a spoilt picture.
type Pixel = fn(&Raster<[u8; 3]>, u32, u32) -> [u8; 3];

#[test]
fn pictures_of_the_scene_give_its_images() {
    // Kept after the test, for a look.
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join("pictures");
    let _ = fs::remove_dir_all(&dir);
    let demo = ["--views", "0", "--size", "16", "--pano-width", "32", "--points-per-m2", "50"];
    s3d_ok(&[&["demo", "-o", text(&dir)][..], &demo].concat());
    let scan = dir.join("scan");
    let locations = read_cameras(&scan.join("cameras.csv")).unwrap();
    let pose = locations.iter().find(|l| l.uuid == UUID).unwrap().pose;
    let mesh = read_mesh(&scan.join("rgb.obj"), UpAxis::Y).unwrap().mesh;
    let studio = Studio::new(&mesh);

    let faces = studio.sky_box(&pose, 0.0, 768);
    let name = |k: usize| format!("{UUID}_skybox{k}_sami.png");
    faces
        .iter()
        .enumerate()
        .for_each(|(k, face)| write(&scan.join("skybox").join(name(k)), face));
    // In Matterport's form up and down border on the right face.
    let matterport = studio.sky_box(&pose, -FRAC_PI_2, 768);
    matterport
        .iter()
        .enumerate()
        .for_each(|(k, face)| write(&scan.join("matterport").join(name(k)), face));
    let panorama = studio.take(&Camera::equirectangular(pose, 3072));
    write(&scan.join("panorama").join(format!("{UUID}.png")), &panorama);
    write_captures(&studio, UUID, &pose, &scan.join("captures"));

    let direct = export(&scan, "rgb = \"texture\"");
    for rgb in [
        "rgb = \"skybox\"",
        "[rgb]\nsource = \"skybox\"\npath = \"matterport\"",
        "rgb = \"panorama\"",
        "rgb = \"captures\"",
    ] {
        let out = export(&scan, rgb);
        for (kind, images) in [("data", 6), ("pano", 1)] {
            let (psnr, count) = worst_psnr(&out, &direct, kind);
            assert!(psnr > 35.0, "{rgb}: {psnr:.1} dB in {kind}");
            assert_eq!(count, images);
        }
        // Only the colours come from pictures.
        assert_eq!(files(&out.join("area_1/pano/depth")), files(&direct.join("area_1/pano/depth")));
    }

    // A mirrored or turned face differs by far.
    let spoil = |k: usize, pixel: Pixel| {
        let image =
            Raster::from_vec(768, 768, (0..768 * 768).map(|i| pixel(&faces[k], i % 768, i / 768)).collect());
        write(&scan.join("skybox").join(name(k)), &image);
        let (psnr, _) = worst_psnr(&export(&scan, "rgb = \"skybox\""), &direct, "pano");
        write(&scan.join("skybox").join(name(k)), &faces[k]);
        fs::remove_dir_all(dir.join("rgbskybox")).unwrap();
        psnr
    };
    fs::remove_dir_all(dir.join("rgbskybox")).unwrap();
    let mirrored = spoil(2, |face, x, y| face.at(767 - x, y));
    let turned = spoil(3, |face, x, y| face.at(y, 767 - x));
    assert!(mirrored < 28.0 && turned < 28.0, "{mirrored:.1} dB mirrored, {turned:.1} dB turned");
}

/// The small scan with this `rgb` in its scene file.
fn small_scan(dir: &Path, rgb: &str) -> PathBuf {
    let scene = write_scan(&dir.join("scan"), 1);
    let toml = fs::read_to_string(&scene).unwrap();
    fs::write(&scene, format!("{rgb}\n{toml}")).unwrap();
    scene
}

const SMALL: [&str; 10] =
    ["--size", "32", "--pano-width", "64", "--views", "3", "--points-per-m2", "50", "--modalities", "rgb"];

#[test]
fn what_is_missing_is_named_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let scene = small_scan(dir.path(), "rgb = \"panorama\"");
    let (folder, out) = (dir.path().join("scan/panorama"), dir.path().join("out"));
    let args = |extra: &[&'static str]| {
        let mut args =
            vec!["export".to_owned(), text(&scene).to_owned(), "-o".to_owned(), text(&out).to_owned()];
        args.extend(SMALL.iter().chain(extra).map(|s| (*s).to_owned()));
        args
    };
    let fails = |extra: &[&'static str], parts: &[&str]| {
        let args = args(extra);
        s3d_fails(&args.iter().map(String::as_str).collect::<Vec<_>>(), 1, parts);
        assert!(!out.exists(), "something was written");
    };
    fails(&[], &["scene.toml", "rgb.path = \"panorama\"", "should be a folder"]);
    fs::create_dir(&folder).unwrap();
    let (a, b) = (format!("{UUID_A}.jpg"), format!("{UUID_B}.jpg"));
    fails(&[], &["2 of 2 locations", "rgb = \"panorama\"", &a, &b]);
    write(&folder.join(format!("{UUID_A}.png")), &Raster::filled(64, 32, [40, 50, 60]));
    fails(&[], &["1 of 2 locations", &b]);
    fails(&["--only", UUID_B], &["1 of 2 locations", &b]);
    write(&folder.join(format!("{UUID_B}.png")), &Raster::filled(64, 48, [40, 50, 60]));
    fails(&[], &[&format!("{UUID_B}.png"), "64 × 48", "twice as wide as high"]);
    // The pictures of the other location are not needed.
    let ok = args(&["--only", UUID_A]);
    s3d_ok(&ok.iter().map(String::as_str).collect::<Vec<_>>());
    let pano = files(&out.join("area_1/pano/rgb"));
    assert_eq!(pano.len(), 1);
    let image = read_rgb8(&out.join("area_1/pano/rgb").join(pano.keys().next().unwrap())).unwrap();
    assert!(
        image.pixels().iter().all(|p| *p == [40, 50, 60]),
        "the room is closed, and the picture of one colour"
    );
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    assert!(manifest.contains("\"rgb\": \"panorama\""), "{manifest}");
}

#[test]
fn the_same_pictures_give_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let scene = small_scan(dir.path(), "rgb = \"captures\"");
    let mesh = read_mesh(&dir.path().join("scan/room.obj"), UpAxis::Y).unwrap().mesh;
    let studio = Studio::new(&mesh);
    for location in read_cameras(&dir.path().join("scan/cameras.csv")).unwrap() {
        write_captures(&studio, &location.uuid, &location.pose, &dir.path().join("scan/captures"));
    }
    let run = |threads: &str| {
        let out = dir.path().join(threads);
        let args = ["export", text(&scene), "-o", text(&out), "--threads", threads];
        s3d_ok(&[&args[..], &SMALL].concat());
        files(&out)
    };
    let one = run("1");
    assert!(
        one.keys()
            .filter(|p| p.ends_with("rgb") || p.to_string_lossy().contains("/rgb/"))
            .count()
            >= 6
    );
    assert!(one == run("3"), "threads change the images");
    // Without one capture there is a hole, which is reported.
    fs::remove_file(dir.path().join(format!("scan/captures/{UUID_A}_i0_3.png"))).unwrap();
    let out = dir.path().join("out");
    let args = [&["export", text(&scene), "-o", text(&out)][..], &SMALL].concat();
    s3d_fails(&args, 1, &[&format!("{UUID_A}_pose_0_3.txt"), "has no picture"]);
    fs::remove_file(dir.path().join(format!("scan/captures/{UUID_A}_pose_0_3.txt"))).unwrap();
    let log = s3d_ok(&args);
    assert!(log.contains("has 17 captures of 18"), "{log}");
    let info = common::s3d(&["info", text(&scene)]);
    let report = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(report.contains("captures of 2 locations") && report.contains("17 captures of 18"), "{report}");
}
