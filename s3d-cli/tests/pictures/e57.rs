//! RGB from the images of an E57 file. The pictures are painted pixel by pixel with the equations of the
//! standard, in a room whose six sides have different colours.

use super::write;
use crate::common::{files, s3d, s3d_fails, s3d_ok, text};
use e57::{
    E57Writer, ImageFormat, PinholeImageProperties, Quaternion, Record, SphericalImageProperties, Transform,
    Translation,
};
use glam::{DAffine3, DQuat, DVec3, dvec3};
use s3d_geom::{Camera, Raster};
use s3d_io::camera::{ScanLocation, read_scan_locations};
use s3d_io::image::read_rgb8;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fs;
use std::path::{Path, PathBuf};

/// The scan with six pinholes, and the scan with a sphere.
const GUIDS: [&str; 2] = ["{8EB9955B-866B-4B5F-74AB-B1071416C628}", "{508160BA-5D80-A2E3-6560-9578A09BAB8B}"];

/// The sides of the room in metres, and its colours: at −x, +x, −y, +y, below and above.
const ROOM: DVec3 = DVec3::new(4.0, 3.0, 2.5);
const COLORS: [[u8; 3]; 6] =
    [[200, 20, 20], [20, 200, 20], [20, 20, 200], [200, 200, 20], [20, 200, 200], [200, 20, 200]];

/// A side of the room that a ray meets, and how far from an edge of it, metres.
struct Seen {
    side: usize,
    from_edge_m: f64,
}

fn seen(from: DVec3, direction: DVec3) -> Seen {
    let far = |k: usize| if direction[k] < 0.0 { -from[k] } else { ROOM[k] - from[k] } / direction[k];
    let axis = (0..3).min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap();
    let at = from + direction * far(axis);
    let others = (0..3).filter(|k| *k != axis);
    let from_edge_m = others.map(|k| at[k].min(ROOM[k] - at[k])).fold(f64::INFINITY, f64::min);
    Seen { side: 2 * axis + usize::from(direction[axis] > 0.0), from_edge_m }
}

/// Where an image was taken, and how its frame is turned.
#[derive(Clone, Copy)]
struct Frame {
    place: DVec3,
    turn: DQuat,
}

impl Frame {
    fn transform(self) -> Transform {
        let (q, t) = (self.turn, self.place);
        Transform {
            rotation: Quaternion { w: q.w, x: q.x, y: q.y, z: q.z },
            translation: Translation { x: t.x, y: t.y, z: t.z },
        }
    }

    /// The picture in which each pixel shows the room along its direction in the frame.
    fn paint(self, w: u32, h: u32, direction: impl Fn(f64, f64) -> DVec3) -> Raster<[u8; 3]> {
        let pixels = (0..w * h).map(|i| {
            let own = direction(f64::from(i % w) + 0.5, f64::from(i / w) + 0.5);
            COLORS[seen(self.place, self.turn * own).side]
        });
        Raster::from_vec(w, h, pixels.collect())
    }
}

/// A face of a cube, 90° wide. A point (x, y, z) in front (z < 0) has the pixel
/// c − (x / z) f / w, c + (y / z) f / h.
fn face(frame: Frame) -> (Raster<[u8; 3]>, PinholeImageProperties) {
    let image = frame.paint(96, 96, |u, v| dvec3((u - 48.0) / 48.0, -(v - 48.0) / 48.0, -1.0));
    let numbers = PinholeImageProperties {
        width: 96,
        height: 96,
        focal_length: 0.024,
        pixel_width: 0.0005,
        pixel_height: 0.0005,
        principal_x: 48.0,
        principal_y: 48.0,
    };
    (image, numbers)
}

/// A sphere: a direction has the pixel width / 2 − azimuth / w, height / 2 − elevation / h.
fn sphere(frame: Frame) -> (Raster<[u8; 3]>, SphericalImageProperties) {
    let pixel = TAU / 384.0;
    let image = frame.paint(384, 192, |u, v| {
        let (azimuth, elevation) = ((192.0 - u) * pixel, (96.0 - v) * pixel);
        dvec3(elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin())
    });
    let numbers =
        SphericalImageProperties { width: 384, height: 192, pixel_width: pixel, pixel_height: pixel };
    (image, numbers)
}

/// What is wrong with the file of a test.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// The rotation of the sphere is inverted.
    Turned,
    /// The sphere is somewhere else, and names no scan.
    Lost,
    /// The sphere's picture is cut.
    Cut,
}

fn png(dir: &Path, image: &Raster<[u8; 3]>) -> Vec<u8> {
    let path = dir.join("picture.png");
    write(&path, image);
    let bytes = fs::read(&path).unwrap();
    fs::remove_file(&path).unwrap();
    bytes
}

/// Writes the scans and their images. Scans are turned about the vertical; images about all axes, and they
/// stand some centimetres beside.
fn write_e57(dir: &Path, fault: Fault) {
    let mut writer = E57Writer::from_file(dir.join("scan.e57"), "{0}").unwrap();
    let places = [dvec3(1.7, 1.3, 1.4), dvec3(2.9, 1.9, 1.2)];
    for ((guid, place), yaw) in GUIDS.iter().zip(places).zip([0.4, -2.0]) {
        let prototype = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
        let mut scan = writer.add_pointcloud(guid, prototype).unwrap();
        scan.set_transform(Some(Frame { place, turn: DQuat::from_rotation_z(yaw) }.transform()));
        scan.finalize().unwrap();
    }

    let rig = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(0.2) * DQuat::from_rotation_y(-0.3);
    let about_y = [0.0, FRAC_PI_2, PI, -FRAC_PI_2].map(DQuat::from_rotation_y);
    let about_x = [FRAC_PI_2, -FRAC_PI_2].map(DQuat::from_rotation_x);
    for (k, turn) in about_y.into_iter().chain(about_x).enumerate() {
        let frame = Frame { place: places[0] + dvec3(0.02, -0.03, 0.04), turn: rig * turn };
        let (picture, numbers) = face(frame);
        let mut image = writer.add_image(&format!("face {k}")).unwrap();
        image.set_pointcloud_guid(GUIDS[0]);
        image.set_transform(frame.transform());
        let bytes = png(dir, &picture);
        image
            .add_pinhole(ImageFormat::Png, &mut bytes.as_slice(), numbers, None)
            .unwrap();
        image.finalize().unwrap();
    }

    let turn = DQuat::from_rotation_z(2.1) * DQuat::from_rotation_y(0.4) * DQuat::from_rotation_x(-0.6);
    let frame = Frame { place: places[1] + dvec3(-0.1, 0.05, 0.12), turn };
    let (picture, numbers) = sphere(frame);
    let mut image = writer.add_image("sphere").unwrap();
    let told = match fault {
        Fault::Turned => Frame { turn: turn.inverse(), ..frame },
        Fault::Lost => Frame { place: frame.place + DVec3::X, ..frame },
        Fault::None | Fault::Cut => frame,
    };
    image.set_transform(told.transform());
    let mut bytes = png(dir, &picture);
    if fault == Fault::Cut {
        bytes.truncate(bytes.len() / 2);
    }
    image
        .add_spherical(ImageFormat::Png, &mut bytes.as_slice(), numbers, None)
        .unwrap();
    image.finalize().unwrap();
    writer.finalize().unwrap();
}

/// Writes a grey room and its scene. The file is Y-up.
fn write_room(dir: &Path) -> PathBuf {
    fs::create_dir_all(dir).unwrap();
    let mut obj = String::new();
    for k in 0..8 {
        let corner = [k & 1, k >> 1 & 1, k >> 2].map(f64::from);
        let at = ROOM * DVec3::from(corner);
        obj += &format!("v {} {} {}\n", at.x, at.z, -at.y);
    }
    // Counter-clockwise as seen from inside.
    for quad in ["1 3 7 5", "2 6 8 4", "1 5 6 2", "3 4 8 7", "1 2 4 3", "5 7 8 6"] {
        obj += &format!("f {quad}\n");
    }
    fs::write(dir.join("room.obj"), obj).unwrap();
    let scene = dir.join("scene.toml");
    let toml = "rgb = \"e57\"\narea = 1\n[mesh]\npath = \"room.obj\"\n[cameras]\npath = \"scan.e57\"\n";
    fs::write(&scene, toml).unwrap();
    scene
}

fn export(scene: &Path, out: &Path, threads: &str) {
    let mut args = vec!["export", text(scene), "-o", text(out), "--threads", threads, "--keep-all"];
    args.extend(["--size", "96", "--pano-width", "256", "--views", "2", "--points-per-m2", "50"]);
    args.extend(["--modalities", "rgb,depth"]);
    s3d_ok(&args);
}

/// The share of a location's panorama that has the colour of the side which is there. Pixels within 15 cm of
/// an edge do not count.
fn right_share(out: &Path, location: &ScanLocation) -> f64 {
    let folder = out.join("area_1/pano/rgb");
    let names = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let path = names
        .into_iter()
        .find(|path| path.to_string_lossy().contains(&location.uuid))
        .unwrap();
    let image = read_rgb8(&path).unwrap();
    let rays = Camera::equirectangular(location.pose, image.width()).rays();
    let (mut right, mut all) = (0u32, 0u32);
    for (x, y) in (0..image.height()).flat_map(|y| (0..image.width()).map(move |x| (x, y))) {
        let seen = seen(location.pose.location, rays.at(x, y));
        if seen.from_edge_m > 0.15 {
            let expected = COLORS[seen.side];
            let is_near = image.at(x, y).iter().zip(expected).all(|(a, b)| a.abs_diff(b) < 12);
            all += 1;
            right += u32::from(is_near);
        }
    }
    f64::from(right) / f64::from(all)
}

#[test]
fn images_of_an_e57_file_give_each_side_its_colour() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    let scene = write_room(&scan);
    write_e57(&scan, Fault::None);
    let locations = read_scan_locations(&scan.join("scan.e57"), &DAffine3::IDENTITY).unwrap();

    let out = dir.path().join("out");
    export(&scene, &out, "1");
    for location in &locations {
        let share = right_share(&out, location);
        assert!(share > 0.999, "{}: {share}", location.uuid);
    }
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    assert!(manifest.contains("\"rgb\": \"e57\"") && manifest.matches("scan.e57").count() == 1, "{manifest}");
    let three = dir.path().join("three");
    export(&scene, &three, "3");
    assert!(files(&out) == files(&three), "threads change the images");
    s3d_ok(&["verify", text(&out)]);

    let info = s3d(&["info", text(&scene)]);
    let report = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(report.contains("images of 2 locations in"), "{report}");

    // The test sees a wrong turn.
    write_e57(&scan, Fault::Turned);
    let turned = dir.path().join("turned");
    export(&scene, &turned, "2");
    let share = right_share(&turned, &locations[1]);
    assert!(share < 0.5, "{share}");
}

#[test]
fn e57_images_that_are_missing_or_damaged_are_told_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    let scene = write_room(&scan);
    let out = dir.path().join("out");
    let fails = |fault: Fault, parts: &[&str]| {
        write_e57(&scan, fault);
        s3d_fails(&["export", text(&scene), "-o", text(&out), "--modalities", "rgb"], 1, parts);
        assert!(!out.exists(), "something was written");
    };
    let uuid = "508160ba5d80a2e365609578a09bab8b";
    fails(
        Fault::Lost,
        &["1 of 2 locations are missing", "rgb = \"e57\"", uuid, "image 6 `sphere` is not of"],
    );
    fails(Fault::Cut, &["scan.e57: image 6 `sphere`", "export the file again"]);

    // The other location has its pictures.
    write_e57(&scan, Fault::Lost);
    let only = "8eb9955b866b4b5f74abb1071416c628";
    let args = ["export", text(&scene), "-o", text(&out), "--only", only, "--modalities", "rgb"];
    let small = ["--size", "32", "--pano-width", "64", "--views", "1", "--points-per-m2", "50"];
    let log = s3d_ok(&[&args[..], &small].concat());
    assert!(log.contains("image 6 `sphere` is not of a scan location"), "{log}");
}
