//! Each form of depth pictures, right and wrong, in files that the tests write.

use crate::image::{Compression, Content, encode_gray8, encode_gray16, write_rgb8};
use crate::raw::{DepthPictures, RawForm, RawOptions, RawScan};
use s3d_geom::glam::{DAffine3, DMat3, DVec3, dvec3};
use s3d_geom::{Lens, PhotoLens, Raster};
use std::fs;
use std::path::{Path, PathBuf};

/// A level camera at (4, 5, 1.5) that looks along +Y, as a matrix camera → world in OpenCV's axes.
const POSE: &str = "1 0 0 4\n0 0 1 5\n0 -1 0 1.5\n0 0 0 1\n";

/// Intrinsics for pictures of 8 × 6 pixels.
const K: &str = "10 0 4 0\n0 10 3 0\n0 0 1 0\n0 0 0 1\n";

/// A recording in a folder that is removed afterwards.
struct Scan(tempfile::TempDir);

impl Scan {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn at(&self, name: &str) -> PathBuf {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        path
    }

    fn text(&self, name: &str, text: &str) -> PathBuf {
        let path = self.at(name);
        fs::write(&path, text).unwrap();
        path
    }

    /// Writes a depth picture of 8 × 6 pixels: nothing in the first one, and this number in all others.
    fn depth(&self, name: &str, number: u16) {
        fs::write(self.at(name), encode_gray16(&depths(number), Compression::Fast)).unwrap();
    }

    /// Writes a picture of one colour, twice as large as the depth pictures.
    fn color(&self, name: &str) {
        let image = Raster::filled(16, 12, [200, 100, 50]);
        write_rgb8(&self.at(name), &image, Content::Photo, Compression::Fast).unwrap();
    }

    fn open_with(&self, options: &RawOptions) -> crate::Result<DepthPictures> {
        match RawScan::open(self.0.path(), options)? {
            RawScan::Pictures(pictures) => Ok(pictures),
            RawScan::Scans(_) => panic!("laser scans"),
        }
    }

    /// Opens the scan, and checks its form and the only picture: its place, and depths of two metres.
    fn is_read(&self, form: RawForm) -> DepthPictures {
        assert_eq!(RawScan::form_of(self.0.path()).unwrap(), Some(form));
        let found = self.open_with(&RawOptions::default()).unwrap();
        assert_eq!((found.form, found.pictures.len()), (form, 1));
        let picture = &found.pictures[0];
        assert!(picture.pose.location.abs_diff_eq(dvec3(4.0, 5.0, 1.5), 1e-6), "{}", picture.pose.location);
        assert!(picture.pose.forward().abs_diff_eq(DVec3::Y, 1e-6), "{}", picture.pose.forward());
        assert!(picture.pose.up().abs_diff_eq(DVec3::Z, 1e-6), "{}", picture.pose.up());

        let depth = picture.read_depth().unwrap();
        assert_eq!([depth.width(), depth.height()], picture.lens.size());
        let [first, rest @ ..] = depth.pixels() else { panic!() };
        assert!(first.is_nan() && rest.iter().all(|d| (d - 2.0).abs() < 1e-6), "{depth:?}");
        found
    }

    fn refused(&self) -> String {
        self.open_with(&RawOptions::default()).unwrap_err().to_string()
    }
}

fn depths(number: u16) -> Raster<u16> {
    let mut depth = Raster::filled(8, 6, number);
    depth.pixels_mut()[0] = 0;
    depth
}

/// The colours of the only picture: none in the first pixel, where nothing was measured, else the picture's.
fn has_colors(found: &DepthPictures) {
    let picture = &found.pictures[0];
    let colors = picture.read_colors(&picture.read_depth().unwrap()).unwrap().unwrap();
    let [first, rest @ ..] = colors.pixels() else { panic!() };
    assert_eq!(*first, None);
    assert!(rest.iter().all(|color| *color == Some([200, 100, 50])), "{colors:?}");
}

#[test]
fn registered_pictures_are_looked_up_as_others_are() {
    let scan = matterport();
    let image = Raster::from_vec(8, 6, (0..48).map(|i| [i, 5 * i, 255 - i]).collect());
    let path = scan.at(&format!("matterport_color_images/{UUID}_i1_0.png"));
    write_rgb8(&path, &image, Content::Photo, Compression::Fast).unwrap();
    let mut picture = scan.open_with(&RawOptions::default()).unwrap().pictures[0].clone();
    let depth = picture.read_depth().unwrap();

    let registered = picture.read_colors(&depth).unwrap().unwrap();
    picture.color.as_mut().unwrap().pose.location.x += 1e-9;
    let others = picture.read_colors(&depth).unwrap().unwrap();
    assert_eq!(registered.pixels(), others.pixels());
    assert_eq!(registered.pixels()[9], Some([9, 45, 246]));
}

fn focal(found: &DepthPictures) -> [f64; 4] {
    let lens = &found.pictures[0].lens;
    [lens.focal_px().x, lens.focal_px().y, lens.center_px().x, lens.center_px().y]
}

const UUID: &str = "0c5a7d1e93b84f62a1d7e0f4b2683c95";

/// Captures of a Matterport, in the folders of Matterport3D: one with a pose, and one without.
fn matterport() -> Scan {
    let scan = Scan::new();
    scan.text(&format!("matterport_camera_poses/{UUID}_pose_1_0.txt"), POSE);
    scan.text(&format!("matterport_camera_intrinsics/{UUID}_intrinsics_1.txt"), "8 6 10 11 4 3 0.1 0 0 0 0");
    scan.depth(&format!("matterport_depth_images/{UUID}_d1_0.png"), 8000);
    scan.depth(&format!("matterport_depth_images/{UUID}_d1_1.png"), 8000);
    let image = Raster::filled(8, 6, [200, 100, 50]);
    let path = scan.at(&format!("matterport_color_images/{UUID}_i1_0.png"));
    write_rgb8(&path, &image, Content::Photo, Compression::Fast).unwrap();
    scan
}

#[test]
fn captures_of_a_matterport_are_read() {
    let scan = matterport();
    let found = scan.is_read(RawForm::Matterport);
    assert_eq!((found.untracked, found.files.len()), (1, 2));
    assert!(
        found.warnings[0].contains("1 of 2 depth pictures have no pose, left out"),
        "{:?}",
        found.warnings
    );
    let PhotoLens::Straight(lens) = found.pictures[0].lens else { panic!() };
    let expected = Lens::new([8, 6], (10.0, 11.0).into(), (4.0, 3.0).into(), [0.1, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(Some(lens), expected);
    assert_eq!(found.pictures[0].name, format!("{UUID}_1_0"));
    has_colors(&found);

    fs::remove_file(scan.at(&format!("matterport_camera_intrinsics/{UUID}_intrinsics_1.txt"))).unwrap();
    let message = scan.refused();
    assert!(
        message.contains("d1_0.png: has no intrinsics:") && message.contains("intrinsics_1.txt is not there")
    );
}

#[test]
fn undistorted_pictures_are_read() {
    let scan = Scan::new();
    let gl = "1 0 0 4 0 0 -1 5 0 1 0 1.5 0 0 0 1";
    let list = format!(
        "dataset matterport\nn_images 1\ndepth_directory undistorted_depth_images\n\
         color_directory undistorted_color_images\nintrinsics_matrix 1000 0 640  0 1000 511  0 0 1\n\
         scan d.png c.jpg {gl}\n"
    );
    scan.text("undistorted_camera_parameters/house.conf", &list);
    let mut depth = Raster::filled(1280, 1024, 8000);
    depth.pixels_mut()[0] = 0;
    fs::write(scan.at("undistorted_depth_images/d.png"), encode_gray16(&depth, Compression::Fast)).unwrap();
    let found = scan.is_read(RawForm::MatterportUndistorted);
    assert_eq!(focal(&found), [1000.0, 1000.0, 640.0, 512.0]);
    let list = scan.at("undistorted_camera_parameters/house.conf");
    assert_eq!(RawScan::form_of(&list).unwrap(), Some(RawForm::MatterportUndistorted));
}

/// An exported scan of ScanNet with poses 0, 3 and 4. Pose 3 is unknown, and frame 4 has no depth.
fn scannet() -> Scan {
    let scan = Scan::new();
    scan.text("pose/0.txt", POSE);
    scan.text("pose/3.txt", &"-inf -inf -inf -inf\n".repeat(4));
    scan.text("pose/4.txt", POSE);
    scan.text("intrinsic/intrinsic_depth.txt", K);
    scan.text("intrinsic/intrinsic_color.txt", "20 0 8 0\n0 20 6 0\n0 0 1 0\n0 0 0 1\n");
    scan.depth("depth/0.png", 2000);
    scan.depth("depth/3.png", 2000);
    scan.color("color/0.png");
    scan
}

#[test]
fn exported_scans_of_scannet_are_read() {
    let scan = scannet();
    let found = scan.is_read(RawForm::ScanNet);
    assert_eq!((focal(&found), found.untracked), ([10.0, 10.0, 4.0, 3.0], 1));
    assert!(found.warnings[1].contains("1 poses have no depth picture"), "{:?}", found.warnings);
    has_colors(&found);

    // The colour camera's intrinsics are scaled.
    fs::remove_file(scan.at("intrinsic/intrinsic_depth.txt")).unwrap();
    assert_eq!(focal(&scan.is_read(RawForm::ScanNet)), [10.0, 10.0, 4.0, 3.0]);
    fs::remove_file(scan.at("intrinsic/intrinsic_color.txt")).unwrap();
    let message = scan.refused();
    let words = "0.png: the intrinsics of the depth camera are not known: give its focal lengths";
    assert!(message.contains(words) && message.contains("for pictures of 8 × 6"), "{message}");
}

#[test]
fn recordings_of_scannet_are_read() {
    let scan = Scan::new();
    let mut bytes = [4u32.to_le_bytes().to_vec(), 1u64.to_le_bytes().to_vec(), b"S".to_vec()].concat();
    let matrix = |text: &str| -> Vec<u8> {
        let numbers = text.split_ascii_whitespace();
        numbers.flat_map(|n| n.parse::<f32>().unwrap().to_le_bytes()).collect()
    };
    let identity = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    for text in [K, identity, K, identity] {
        bytes.extend(matrix(text));
    }
    bytes.extend([2i32.to_le_bytes(), 0i32.to_le_bytes()].concat());
    bytes.extend([8u32, 6, 8, 6].iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(4000f32.to_le_bytes());
    bytes.extend(2u64.to_le_bytes());
    let depth: Vec<u8> = depths(8000).pixels().iter().flat_map(|v| v.to_le_bytes()).collect();
    for pose in [POSE, &"-inf ".repeat(16)] {
        bytes.extend(matrix(pose));
        bytes.extend([0u64, 0, 0, depth.len() as u64].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(&depth);
    }
    fs::write(scan.at("scene.sens"), &bytes).unwrap();
    let found = scan.is_read(RawForm::Recording);
    assert_eq!((found.untracked, found.pictures[0].unit_m()), (1, 0.000_25));
    assert_eq!(RawScan::form_of(&scan.at("scene.sens")).unwrap(), Some(RawForm::Recording));

    fs::write(scan.at("scene.sens"), &bytes[..bytes.len() - 9]).unwrap();
    assert!(scan.refused().contains("frame 1: the file ends within it"));
}

#[test]
fn videos_of_arkitscenes_are_read_with_their_confidence() {
    let scan = Scan::new();
    scan.text("lowres_wide.traj", "7.000 1.5707963267948966 0 0 -4 1.5 -5\n");
    scan.text("lowres_wide_intrinsics/41_7.001.pincam", "8 6 10 10 4 3\n");
    scan.depth("lowres_depth/41_7.001.png", 2000);
    scan.depth("lowres_depth/41_9.000.png", 2000);
    let image = Raster::filled(8, 6, [200, 100, 50]);
    let path = scan.at("lowres_wide/41_7.001.png");
    write_rgb8(&path, &image, Content::Photo, Compression::Fast).unwrap();
    let sure = Raster::from_vec(8, 6, (0..48).map(|i| i % 3).collect());
    fs::write(scan.at("confidence/41_7.001.png"), encode_gray8(&sure)).unwrap();

    let found = scan.is_read(RawForm::ArkitScenes);
    assert_eq!((focal(&found), found.untracked), ([10.0, 10.0, 4.0, 3.0], 1));
    assert_eq!(found.pictures[0].read_confidence().unwrap(), Some(sure));
    has_colors(&found);
}

/// A sequence with one frame, whose depth is in a file of this kind.
fn sequence(depth: &str, info: Option<&str>) -> Scan {
    let scan = Scan::new();
    scan.text("sequence/frame-000007.pose.txt", POSE);
    if let Some(info) = info {
        scan.text("sequence/_info.txt", info);
    }
    let name = format!("sequence/frame-000007.depth.{depth}");
    if depth == "pgm" {
        let pixels = depths(2000)
            .pixels()
            .iter()
            .flat_map(|v| v.to_be_bytes())
            .collect::<Vec<u8>>();
        fs::write(scan.at(&name), [b"P5\n8 6\n65535\n".to_vec(), pixels].concat()).unwrap();
    } else {
        scan.depth(&name, 2000);
    }
    scan.color("sequence/frame-000007.color.png");
    scan
}

const INFO: &str = "m_colorWidth = 16\nm_colorHeight = 12\nm_depthWidth = 8\nm_depthHeight = 6\n\
                    m_depthShift = 1000\n\
                    m_calibrationColorIntrinsic = 20 0 8 0 0 20 6 0 0 0 1 0 0 0 0 1\n\
                    m_calibrationDepthIntrinsic = 11 0 4 0 0 10 3 0 0 0 1 0 0 0 0 1\n";

#[test]
fn sequences_of_3rscan_and_bundle_fusion_are_read() {
    for kind in ["pgm", "png"] {
        let scan = sequence(kind, Some(INFO));
        let found = scan.is_read(RawForm::Sequence);
        assert_eq!(focal(&found), [11.0, 10.0, 4.0, 3.0]);
        has_colors(&found);
    }

    let small = sequence("pgm", Some(&INFO.replace("m_depthWidth = 8", "m_depthWidth = 16")));
    let message = small.refused();
    let expected = "depth.pgm: has 8 × 6 pixels, and the intrinsics are for 16 × 6";
    assert!(message.contains(expected), "{message}");
    let wrong = sequence("pgm", Some(&INFO.replace("Shift = 1000", "Shift = 0")));
    assert!(wrong.refused().contains("_info.txt, line 5: `0` is no scale of depth"));
    let pose = sequence("pgm", Some(INFO));
    pose.text("sequence/frame-000007.pose.txt", "1 0 0 0\n0 0 -1 0\n0 1 0 0\n4 5 1.5 1\n");
    assert!(
        pose.refused()
            .contains("is 4 5 1.5 1, not 0 0 0 1: the matrix is transposed")
    );
    pose.text("sequence/frame-000007.pose.txt", &POSE.replace("1 0 0 4", "1.1 0 0 4"));
    assert!(pose.refused().contains("3×3 part is no rotation"));
    pose.text("sequence/frame-000007.pose.txt", &"-inf ".repeat(16));
    let message = pose.refused();
    assert!(message.contains("the poses of all its 1 depth pictures are unknown"), "{message}");
}

#[test]
fn scenes_of_7_scenes_are_read() {
    let scan = Scan::new();
    let mut depth = Raster::filled(640, 480, 2000u16);
    depth.pixels_mut()[0] = 65_535;
    for sequence in ["seq-01", "seq-02"] {
        scan.text(&format!("{sequence}/frame-000000.pose.txt"), POSE);
        let path = scan.at(&format!("{sequence}/frame-000000.depth.png"));
        fs::write(path, encode_gray16(&depth, Compression::Fast)).unwrap();
    }
    let found = scan.open_with(&RawOptions::default()).unwrap();
    assert_eq!((found.form, found.pictures.len()), (RawForm::SevenScenes, 2));
    assert_eq!(found.pictures[1].name, "seq-02/frame-000000");
    assert_eq!(focal(&found), [585.0, 585.0, 320.0, 240.0]);
    assert!(found.warnings[0].contains("585 px"), "{:?}", found.warnings);
    let read = found.pictures[0].read_depth().unwrap();
    assert!(read.at(0, 0).is_nan() && read.at(1, 0) == 2.0);

    // Another size is another camera.
    let other = sequence("png", None).refused();
    assert!(other.contains("the intrinsics of the depth camera are not known"), "{other}");
}

/// A sequence of TUM in a folder of this name.
fn tum(name: &str, size: [u32; 2]) -> (Scan, PathBuf) {
    let scan = Scan::new();
    let in_folder = |file: &str| format!("{name}/{file}");
    let half = 0.5f64.sqrt();
    let poses = format!("# poses\n100.00 4 5 1.5 {} 0 0 {half}\n100.10 9 9 9 0 0 0 1\n", -half);
    scan.text(&in_folder("groundtruth.txt"), &poses);
    scan.text(&in_folder("depth.txt"), "# depth maps\n100.005 depth/100.005.png\n101.0 depth/101.png\n");
    scan.text(&in_folder("rgb.txt"), "100.015 rgb/100.015.png\n");
    let mut depth = Raster::filled(size[0], size[1], 10_000u16);
    depth.pixels_mut()[0] = 0;
    let path = scan.at(&in_folder("depth/100.005.png"));
    fs::write(path, encode_gray16(&depth, Compression::Fast)).unwrap();
    let image = Raster::filled(size[0], size[1], [200, 100, 50]);
    let path = scan.at(&in_folder("rgb/100.015.png"));
    write_rgb8(&path, &image, Content::Photo, Compression::Fast).unwrap();
    let folder = scan.0.path().join(name);
    (scan, folder)
}

fn open(path: &Path, options: &RawOptions) -> crate::Result<DepthPictures> {
    match RawScan::open(path, options)? {
        RawScan::Pictures(pictures) => Ok(pictures),
        RawScan::Scans(_) => panic!("laser scans"),
    }
}

#[test]
fn sequences_of_tum_are_paired_by_time() {
    let (_scan, folder) = tum("rgbd_dataset_freiburg1_desk", [640, 480]);
    let found = open(&folder, &RawOptions::default()).unwrap();
    assert_eq!((found.form, found.pictures.len(), found.untracked), (RawForm::Tum, 1, 1));
    // The benchmark counts from the centre of the first pixel.
    assert_eq!(focal(&found), [525.0, 525.0, 320.0, 240.0]);
    assert!(found.pictures[0].pose.location.abs_diff_eq(dvec3(4.0, 5.0, 1.5), 1e-9));
    assert_eq!(found.pictures[0].read_depth().unwrap().at(3, 3), 2.0);
    has_colors(&found);
}

#[test]
fn a_list_of_tum_names_pictures_of_its_own_folder() {
    let (_scan, folder) = tum("freiburg1_desk", [640, 480]);
    for foreign in ["/etc/passwd", "../other/1.png", "depth/../../1.png"] {
        fs::write(folder.join("depth.txt"), format!("100.005 {foreign}\n")).unwrap();
        let message = open(&folder, &RawOptions::default()).unwrap_err().to_string();
        assert!(message.contains("depth.txt") && message.contains("is outside"), "{message}");
    }
}

#[test]
fn without_intrinsics_an_error_says_what_to_give() {
    use crate::camera::{Distortion, Optics};
    let (_scan, folder) = tum("desk", [8, 6]);
    let message = open(&folder, &RawOptions::default()).unwrap_err().to_string();
    let words = "100.005.png: the intrinsics of the depth camera are not known";
    assert!(message.contains(words) && message.contains("8 × 6"), "{message}");

    let depth_optics = Some(Optics::Pinhole {
        focal_px: (10.0, 10.0).into(),
        center_px: None,
        distortion: Distortion::None,
    });
    let given = RawOptions { depth_optics, ..RawOptions::default() };
    assert_eq!(focal(&open(&folder, &given).unwrap()), [10.0, 10.0, 4.0, 3.0]);

    fs::remove_file(folder.join("groundtruth.txt")).unwrap();
    let message = open(&folder, &given).unwrap_err().to_string();
    assert!(message.contains("has depth but no groundtruth.txt"), "{message}");
    fs::write(folder.join("groundtruth.txt"), "1 0 0 0 0 0 0 1\n").unwrap();
    let message = open(&folder, &given).unwrap_err().to_string();
    assert!(message.contains("poses of all its 2 depth pictures are unknown"), "{message}");
}

#[test]
fn keyframes_of_polycam_are_read() {
    let scan = Scan::new();
    // ARKit's world has +Y up: (4, 1.5, −5) is (4, 5, 1.5).
    let camera = r#"{"fx": 20, "fy": 20, "cx": 8, "cy": 6, "width": 16, "height": 12,
        "t_00": 1, "t_01": 0, "t_02": 0, "t_03": 4, "t_10": 0, "t_11": 1, "t_12": 0, "t_13": 1.5,
        "t_20": 0, "t_21": 0, "t_22": 1, "t_23": -5}"#;
    scan.text("keyframes/corrected_cameras/12.json", camera);
    scan.text("keyframes/corrected_cameras/13.json", camera);
    scan.color("keyframes/corrected_images/12.png");
    scan.depth("keyframes/depth/12.png", 2000);
    let shades = Raster::from_vec(8, 6, (0..48).map(|i| [0, 127, 255][i % 3]).collect());
    fs::write(scan.at("keyframes/confidence/12.png"), encode_gray8(&shades)).unwrap();

    let found = scan.is_read(RawForm::Polycam);
    assert_eq!(focal(&found), [10.0, 10.0, 4.0, 3.0]);
    assert!(found.warnings[0].contains("1 poses have no depth picture"), "{:?}", found.warnings);
    let sure = found.pictures[0].read_confidence().unwrap().unwrap();
    assert_eq!(sure.pixels()[..4], [0, 1, 2, 0]);
    has_colors(&found);
}

/// A list of nerfstudio with these keys, and one frame with depth in a file of this name.
fn transforms(scan: &Scan, keys: &str, depth: &str) {
    let matrix = "[[1,0,0,4],[0,0,-1,5],[0,1,0,1.5],[0,0,0,1]]";
    let frame =
        format!(r#"{{"file_path": "a.png", "transform_matrix": {matrix}, "depth_file_path": {depth}}}"#);
    let camera = r#""w": 16, "h": 12, "fl_x": 20, "fl_y": 20, "cx": 8, "cy": 6"#;
    scan.text("transforms.json", &format!(r#"{{{camera},{keys} "frames": [{frame}]}}"#));
}

#[test]
fn frames_of_nerfstudio_have_depth_of_every_kind() {
    let scan = Scan::new();
    scan.color("a.png");
    scan.depth("depth/a.png", 2000);
    transforms(&scan, "", r#""depth/a.png""#);
    let found = scan.is_read(RawForm::Nerfstudio);
    assert_eq!(focal(&found), [10.0, 10.0, 4.0, 3.0]);
    has_colors(&found);

    scan.depth("depth/a.png", 8000);
    transforms(&scan, r#""depth_unit_scale_factor": 0.00025,"#, r#""depth/a.png""#);
    scan.is_read(RawForm::Nerfstudio);
    transforms(&scan, r#""depth_unit_scale_factor": 0,"#, r#""depth/a.png""#);
    assert!(scan.refused().contains("depth_unit_scale_factor: 0 is no scale"));

    // Floats in metres.
    let metres = depths(2).map(f32::from);
    let unit = r#""depth_unit_scale_factor": 1,"#;
    #[cfg(feature = "npy")]
    {
        let mut npy = crate::cloud::NpyWriter::create(&scan.at("depth/a.npy"), "<f4", &[6, 8]).unwrap();
        let bytes: Vec<u8> = metres.pixels().iter().flat_map(|v| v.to_le_bytes()).collect();
        npy.put(&bytes).unwrap();
        npy.finish().unwrap();
        transforms(&scan, unit, r#""depth/a.npy""#);
        scan.is_read(RawForm::Nerfstudio);
    }
    #[cfg(feature = "exr")]
    {
        let image = metres.map(|depth| [depth, 0.0, 0.0]);
        crate::image::write_xyz_float(&scan.at("depth/a.exr"), &image, Compression::Fast).unwrap();
        transforms(&scan, unit, r#""depth/a.exr""#);
        scan.is_read(RawForm::Nerfstudio);
        let whole = fs::read(scan.at("depth/a.exr")).unwrap();
        fs::write(scan.at("depth/a.exr"), &whole[..whole.len() - 7]).unwrap();
        assert!(scan.refused().contains("a.exr: no readable OpenEXR file"));
    }

    // A list without depth is a list of photographs.
    transforms(&scan, "", "null");
    assert_eq!(RawScan::form_of(scan.0.path()).unwrap(), None);
    assert!(scan.refused().contains("is no raw scan: raw scans are depth pictures"));
}

#[test]
fn units_that_cannot_be_are_told_with_the_scale_that_fits() {
    let scan = scannet();
    // Tenths of a micrometre? No: metres were meant.
    scan.depth("depth/0.png", 2);
    let message = scan.refused();
    assert!(message.contains("0.png: half of its depths are beyond 0.0020 m"), "{message}");
    assert!(message.ends_with("With a unit of 1 m, they are beyond 2.00 m"), "{message}");
    let found = scan
        .open_with(&RawOptions { depth_unit_m: Some(1.0), ..RawOptions::default() })
        .unwrap();
    assert_eq!(found.pictures[0].read_depth().unwrap().at(1, 1), 2.0);

    let large = scan
        .open_with(&RawOptions { depth_unit_m: Some(1000.0), ..RawOptions::default() })
        .unwrap_err()
        .to_string();
    assert!(large.contains("no room is so large. With a unit of 1 m"), "{large}");

    scan.depth("depth/0.png", 0);
    assert!(scan.refused().contains("nothing is measured in it"));
}

#[test]
fn damaged_pictures_are_told() {
    let scan = scannet();
    let whole = fs::read(scan.at("depth/0.png")).unwrap();
    fs::write(scan.at("depth/0.png"), &whole[..whole.len() - 30]).unwrap();
    assert!(scan.refused().contains("depth/0.png: "));
    for (bytes, words) in [
        (&b""[..], "is empty"),
        (b"\xff\xd8\xff\xe0", "is a JPEG, which cannot hold depth"),
        (b"GIF89a", "is no depth picture that is read"),
    ] {
        fs::write(scan.at("depth/0.png"), bytes).unwrap();
        let message = scan.refused();
        assert!(message.contains(words) && message.contains("0.png"), "{message}");
    }
    // A picture of 8 bits is none of depth.
    fs::write(scan.at("depth/0.png"), encode_gray8(&Raster::filled(8, 6, 7))).unwrap();
    assert!(scan.refused().contains("16-bit"), "{}", scan.refused());
}

#[test]
fn a_world_is_turned_and_scaled_with_its_depths() {
    let scan = scannet();
    let world_from_file = DAffine3::from_mat3_translation(DMat3::from_diagonal(DVec3::splat(0.5)), DVec3::Z);
    let found = scan
        .open_with(&RawOptions { world_from_file, ..RawOptions::default() })
        .unwrap();
    assert_eq!(found.pictures[0].pose.location, dvec3(2.0, 2.5, 1.75));
    assert_eq!(found.pictures[0].read_depth().unwrap().at(1, 1), 1.0);

    // A world in which −y is up.
    let turn = DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let found = scan
        .open_with(&RawOptions { world_from_file: turn, ..RawOptions::default() })
        .unwrap();
    let warning = found.warnings.last().unwrap();
    assert!(warning.contains("the cameras' upper side points to −y on average"), "{warning}");
}
