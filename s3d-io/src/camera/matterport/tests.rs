use super::*;
use crate::image::png::write_rgb8;
use glam::dvec3;
use std::fs;

const UUID: &str = "0c5a7d1e93b84f62a1d7e0f4b2683c95";

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }
    fn text(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, text).unwrap();
        path
    }
    fn picture(&self, name: &str, w: u32, h: u32) {
        let path = self.text(name, "");
        write_rgb8(
            &path,
            &Raster::filled(w, h, [9, 8, 7]),
            crate::image::png::Content::Photo,
            crate::image::compression::Compression::Fast,
        )
        .unwrap();
    }
    fn open(&self) -> PictureFolder {
        PictureFolder::open(self.0.path()).unwrap()
    }
}

/// A level camera that looks along +X: its right is −Y, its down −Z.
const ALONG_X: &str = "0 0 1 4.5\n-1 0 0 -2\n0 -1 0 1.5\n0 0 0 1\n";

#[test]
fn a_pose_in_the_files_axes_becomes_one_in_ours() {
    let folder = Folder::new();
    let pose = read_capture_pose(&folder.text("p.txt", ALONG_X)).unwrap();
    assert_eq!(pose.location, dvec3(4.5, -2.0, 1.5));
    assert_eq!((pose.forward(), pose.right(), pose.up()), (DVec3::X, -DVec3::Y, DVec3::Z));
    // As files round them.
    let rounded = "0.1736 -0.0002 0.9848 1\n-0.9848 -0.0001 0.1736 2\n 0.0001 -1.0000 -0.0002 3\n 0 0 0 1";
    let pose = read_capture_pose(&folder.text("p.txt", rounded)).unwrap();
    let m = pose.world_from_camera;
    assert!((m.transpose() * m).abs_diff_eq(DMat3::IDENTITY, 1e-14));
    assert!(pose.forward().abs_diff_eq(dvec3(0.9848, 0.1736, -0.0002), 1e-4));
}

#[test]
fn poses_that_are_none_are_refused() {
    let folder = Folder::new();
    for (text, words) in [
        ("", "line 1: 0 numbers; a 4×4"),
        ("1 0 0 0\n0 1 0 0\n0 0 1 0\n", "line 3: 12 numbers"),
        (&ALONG_X.replace("-2", "two"), "line 2: \"two\" is no"),
        (&ALONG_X.replace("-2", "inf"), "line 2: \"inf\""),
        (&ALONG_X.replace("0 0 0 1", "0 0 1 1"), "line 4: the last row is 0 0 1 1"),
        (&ALONG_X.replace("-1 0 0", "-2 0 0"), "no rotation"),
        (&ALONG_X.replace("0 -1 0", "0.1 -1 0"), "no rotation"),
        (&ALONG_X.replace("0 -1 0", "0 1 0"), "mirrors"),
        (&ALONG_X.replace("4.5", "4.5e9"), "metres?"),
    ] {
        let message = read_capture_pose(&folder.text("p.txt", text)).unwrap_err().to_string();
        assert!(message.contains(words) && message.contains("p.txt"), "{text}: {message}");
    }
    fs::write(folder.0.path().join("p.txt"), [0xff, 0xff]).unwrap();
    assert!(
        read_capture_pose(&folder.0.path().join("p.txt"))
            .unwrap_err()
            .to_string()
            .contains("no text")
    );
}

#[test]
fn intrinsics_are_checked() {
    let folder = Folder::new();
    let good = "1280 1024 1075.72 1075.66 636.877 515.013 0.1 -0.2 0.001 -0.002 0.03\n";
    let lens = read_intrinsics(&folder.text("i.txt", good)).unwrap();
    assert_eq!((lens.width(), lens.height(), lens.focal_px()), (1280, 1024, DVec2::new(1075.72, 1075.66)));
    // OpenCV's projectPoints of (0.4, −0.3, 1.1) with these numbers.
    assert!(
        lens.project(dvec3(0.4, -0.3, 1.1))
            .unwrap()
            .abs_diff_eq(DVec2::new(OPENCV[0], OPENCV[1]), 1e-9)
    );
    for (from, to, words) in [
        (" 0.03", "", "10 numbers"),
        ("1280", "1280.5", "a picture of 1280.5"),
        ("1280", "0", "a picture of 0"),
        ("1280", "-1280", "a picture of -1280"),
        ("1075.72", "0", "no lens: fx 0"),
        ("1075.72 1075.66", "107572 107566", "an angle of view of 0.68°"),
        ("0.001", "x", "line 1: \"x\""),
    ] {
        let message = read_intrinsics(&folder.text("i.txt", &good.replacen(from, to, 1)))
            .unwrap_err()
            .to_string();
        assert!(message.contains(words) && message.contains("i.txt"), "{to}: {message}");
    }
}

const OPENCV: [f64; 2] = [1031.6669137336373, 218.8259578271295];

#[test]
fn captures_are_found_wherever_they_lie_and_must_be_whole() {
    let folder = Folder::new();
    folder.picture(&format!("colors/{UUID}_i1_0.png"), 8, 6);
    folder.text(&format!("poses/{UUID}_pose_1_0.txt"), ALONG_X);
    let lens = folder.text(&format!("lenses/{UUID}_intrinsics_1.txt"), "8 6 5 5 4 3 0 0 0 0 0");

    let captures = folder.open().captures(UUID).unwrap();
    assert_eq!(captures.len(), 1);
    assert_eq!((captures[0].camera, captures[0].yaw), (1, 0));
    assert_eq!(captures[0].read().unwrap().at(3, 3), [9, 8, 7]);
    assert_eq!(folder.open().uuids(), [UUID]);
    assert_eq!(folder.open().captures(&"f".repeat(32)).unwrap(), []);

    let fails = |words: &str| {
        let message = folder.open().captures(UUID).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    };
    fs::write(&lens, "8 7 5 5 4 3 0 0 0 0 0").unwrap();
    fails("has 8 × 6 pixels, but the intrinsics of its camera are for 8 × 7");
    fs::remove_file(lens).unwrap();
    fails(&format!("has no intrinsics: {UUID}_intrinsics_1.txt"));
    folder.text(&format!("poses/{UUID}_pose_0_5.txt"), ALONG_X);
    fails(&format!("has no picture: {UUID}_i0_5.jpg"));
    folder.picture(&format!("{UUID}_i0_5.png"), 8, 6);
    fs::remove_file(folder.0.path().join(format!("poses/{UUID}_pose_0_5.txt"))).unwrap();
    fails(&format!("has no pose: {UUID}_pose_0_5.txt"));
    folder.text(&format!("poses/{UUID}_pose_0_5.txt"), ALONG_X);
    folder.text(&format!("{UUID}_intrinsics_0.txt"), "8 6 5 5 4 3 0 0 0 0 0");
    folder.text(&format!("{UUID}_i0_5.png"), "no picture");
    fails("_i0_5.png");
}

fn refused(f: &Folder) -> String {
    read_matterport_locations(f.0.path()).unwrap_err().to_string()
}

#[test]
fn locations_stand_at_the_level_cameras_mean() {
    let folder = Folder::new();

    assert!(refused(&folder).contains("has no captures"));
    let other = "ffffffffffffffffffffffffffffffff";
    folder.text(&format!("{other}_pose_1_1.txt"), ALONG_X);
    assert!(refused(&folder).contains(&format!("{other}_pose_1_0.txt")));
    folder.text(&format!("{other}_pose_1_0.txt"), "1 0 0 7\n0 0 1 8\n0 -1 0 9\n0 0 0 1");
    folder.text(&format!("{UUID}_pose_1_0.txt"), ALONG_X);
    for (yaw, x) in [(1, 4.6), (2, 4.7)] {
        folder.text(&format!("{UUID}_pose_1_{yaw}.txt"), &ALONG_X.replace("4.5", &x.to_string()));
    }
    folder.text(&format!("{UUID}_pose_0_0.txt"), &ALONG_X.replace("1.5", "9"));
    let locations = read_matterport_locations(folder.0.path()).unwrap();
    assert_eq!(locations.len(), 2);
    assert_eq!((locations[0].uuid.as_str(), locations[0].line), (UUID, 1));
    assert!(locations[0].pose.location.abs_diff_eq(dvec3(4.6, -2.0, 1.5), 1e-12));
    assert_eq!(locations[0].pose.forward(), DVec3::X);
    assert!(locations[1].pose.location.abs_diff_eq(dvec3(5.75, 3.0, 5.25), 1e-12));
    assert_eq!(locations[1].pose.forward(), DVec3::Y);
}

#[test]
fn sky_boxes_and_panoramas_are_found_or_named() {
    let folder = Folder::new();
    let missing = folder.open().panorama(UUID).unwrap_err();
    assert!(missing.contains(&format!("{UUID}.jpg")), "{missing}");
    let published = format!("camera_{UUID}_office_1_frame_equirectangular_domain_rgb.png");
    folder.picture(&format!("rgb/{published}"), 8, 4);
    folder.text(&format!("rgb/camera_{UUID}_office_1_frame_0_domain_rgb.png"), "");
    assert!(folder.open().panorama(UUID).unwrap().ends_with(published));
    folder.picture(&format!("{UUID}.png"), 8, 4);
    assert!(folder.open().panorama(UUID).unwrap().ends_with(format!("{UUID}.png")));
    assert_eq!(check_picture(&folder.open().panorama(UUID).unwrap()).unwrap(), (8, 4));
    for k in [0, 1, 3, 4] {
        folder.picture(&format!("{UUID}_skybox{k}_sami.png"), 4, 4);
    }
    let missing = folder.open().sky_box(UUID).unwrap_err();
    assert_eq!(missing, format!("{UUID}_skybox2_sami.jpg, {UUID}_skybox5_sami.jpg"));
    folder.picture(&format!("{UUID}_skybox2_sami.png"), 4, 4);
    folder.picture(&format!("{}_skybox5_SAMI.PNG", UUID.to_uppercase()), 4, 4);
    let paths = folder.open().sky_box(UUID).unwrap();
    assert!(paths[4].ends_with(format!("{UUID}_skybox4_sami.png")));
}
