//! Raw scans as files: what readers of this workspace and of others find in them.

use e57::{CartesianCoordinate, E57Reader};
use s3d_geom::glam::{DAffine3, DVec3};
use s3d_geom::{CaptureLens, Pose};
use s3d_io::camera::{E57Pictures, PictureFolder, read_matterport_locations, read_posed_cameras};
use s3d_io::image::read_gray16;
use s3d_synth::device::{DepthCamera, LaserScanner, ScanTarget, turntable_poses};
use s3d_synth::{AnnotatedScene, Building, ScanError};
use std::fs;
use std::sync::LazyLock;

static SCENE: LazyLock<AnnotatedScene> =
    LazyLock::new(|| Building { texture_scale: 0.05, ..Building::demo() }.build().unwrap());

fn assert_same(a: &Pose, b: &Pose) {
    assert!(a.location.abs_diff_eq(b.location, 1e-5), "{a:?} {b:?}");
    assert!(a.world_from_camera.abs_diff_eq(b.world_from_camera, 1e-6), "{a:?} {b:?}");
}

#[test]
fn matterport_captures_are_read_back() {
    let scene = &*SCENE;
    let target = ScanTarget::new(scene);
    let folder = tempfile::tempdir().unwrap();
    let camera = DepthCamera::turntable().scaled(0.04);
    let locations = &scene.locations[1..2];
    target
        .write_matterport(folder.path(), locations, &camera, || true)
        .unwrap();

    let pictures = PictureFolder::open(folder.path()).unwrap();
    assert_eq!(pictures.uuids(), [locations[0].uuid.clone()]);
    let captures = pictures.captures(&locations[0].uuid).unwrap();
    assert_eq!(captures.len(), 18);
    for ((capture, stop), number) in captures.iter().zip(turntable_poses(&locations[0])).zip(0..) {
        assert_eq!((capture.camera, capture.yaw), (stop.camera, stop.yaw));
        assert_same(&capture.pose, &stop.pose);
        assert_eq!(capture.lens, camera.lens);
        capture.read().unwrap();

        let name = format!("matterport_depth_images/{}_d{}_{}.png", locations[0].uuid, stop.camera, stop.yaw);
        let units = read_gray16(&folder.path().join(name)).unwrap();
        let measured = target.depth_picture(&stop.pose, &camera, number).unwrap().depth;
        for (units, depth) in units.pixels().iter().zip(measured.pixels()) {
            let depth = if depth.is_nan() { 0.0 } else { *depth };
            assert!((f32::from(*units) * 0.00025 - depth).abs() < 2e-6, "{units} {depth}");
        }
    }

    let found = read_matterport_locations(folder.path()).unwrap();
    assert!(found[0].pose.location.abs_diff_eq(locations[0].position, 1e-5));
}

#[test]
fn sequences_have_the_poses_that_they_were_taken_from() {
    let scene = &*SCENE;
    let target = ScanTarget::new(scene);
    let poses = target.hand_held_poses(&scene.locations[0], 4);
    let camera = DepthCamera::default().scaled(0.1);
    let measured = target.depth_picture(&poses[3], &DepthCamera { unit_m: 0.001, ..camera.clone() }, 3);
    let measured = measured.unwrap().depth;

    let tum = tempfile::tempdir().unwrap();
    target.write_tum(tum.path(), &poses, &camera, || true).unwrap();
    let read = read_posed_cameras(&tum.path().join("groundtruth.txt"), &DAffine3::IDENTITY).unwrap();
    assert_eq!((read.cameras.len(), read.cameras[3].name.as_str()), (4, "0.100000"));
    read.cameras
        .iter()
        .zip(&poses)
        .for_each(|(camera, pose)| assert_same(&camera.pose, pose));
    let list = fs::read_to_string(tum.path().join("depth.txt")).unwrap();
    assert!(list.ends_with("0.100000 depth/0.100000.png\n"));
    assert!(tum.path().join("rgb/0.100000.png").exists());

    let scannet = tempfile::tempdir().unwrap();
    target.write_scannet(scannet.path(), &poses, &camera, || true).unwrap();
    let read = read_posed_cameras(scannet.path(), &DAffine3::IDENTITY).unwrap();
    assert_eq!((read.cameras.len(), read.cameras[0].size), (4, Some([64, 48])));
    read.cameras
        .iter()
        .zip(&poses)
        .for_each(|(camera, pose)| assert_same(&camera.pose, pose));

    // The same picture in both, in units of 0.2 mm and 1 mm.
    let [fine, coarse] = [(&tum, "depth/0.100000.png"), (&scannet, "depth/3.png")]
        .map(|(folder, name)| read_gray16(&folder.path().join(name)).unwrap());
    let millimetres = |depth: f32| {
        if depth.is_nan() {
            0
        } else {
            (depth * 1000.0).round() as u16
        }
    };
    assert!(
        coarse
            .pixels()
            .iter()
            .zip(measured.pixels())
            .all(|(c, m)| *c == millimetres(*m))
    );
    assert!(
        fine.pixels()
            .iter()
            .zip(coarse.pixels())
            .all(|(f, c)| f.abs_diff(5 * c) <= 3)
    );
    assert!(coarse.pixels().iter().filter(|c| **c > 0).count() > 1000);
}

fn scanner() -> LaserScanner {
    LaserScanner { columns: 60, rows: 25, ..LaserScanner::default() }
}

#[test]
fn an_e57_has_grids_poses_and_panoramas() {
    let scene = &*SCENE;
    let target = ScanTarget::new(scene);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.e57");
    let locations = &scene.locations[..2];
    target.write_e57(&path, locations, &scanner(), 64, || true).unwrap();

    let mut reader = E57Reader::from_file(&path).unwrap();
    let clouds = reader.pointclouds();
    assert_eq!(clouds.len(), 2);
    for (number, (cloud, location)) in (0..).zip(clouds.iter().zip(locations)) {
        let scan = target.laser_scan(location, &scanner(), number).unwrap();
        assert!(cloud.has_row_column() && cloud.has_color() && cloud.has_intensity());
        let mut points = 0;
        for point in reader.pointcloud_simple(cloud).unwrap() {
            let point = point.unwrap();
            let expected = scan.world_point(point.column as u32, point.row as u32);
            match point.cartesian {
                // The reader applies the pose.
                CartesianCoordinate::Valid { x, y, z } => {
                    assert!(DVec3::new(x, y, z).abs_diff_eq(expected.unwrap(), 1e-5));
                    points += 1;
                }
                _ => assert_eq!(expected, None),
            }
        }
        assert!(points > 700, "{points}");
    }

    let pictures = E57Pictures::open(&path, &DAffine3::IDENTITY).unwrap();
    let shots = pictures.read(&[1]).unwrap();
    assert_eq!(shots.len(), 1);
    let CaptureLens::Spherical(lens) = shots[0].lens else { panic!("{:?}", shots[0].lens) };
    assert!(lens.is_whole());
    // The middle looks along the heading.
    let heading = Pose::level(locations[1].position, locations[1].yaw_rad);
    assert_same(&shots[0].pose, &heading);
    // Nothing is left beside it.
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_ptx_has_its_grid_column_by_column() {
    let scene = &*SCENE;
    let target = ScanTarget::new(scene);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scan.ptx");
    let location = &scene.locations[2];
    target
        .write_ptx(&path, &scene.locations[2..3], &scanner(), || true)
        .unwrap();

    let text = fs::read_to_string(&path).unwrap();
    let lines: Vec<Vec<f64>> = text
        .lines()
        .map(|line| line.split(' ').map(|word| word.parse().unwrap()).collect())
        .collect();
    assert_eq!((&lines[0], &lines[1], lines.len()), (&vec![60.0], &vec![25.0], 10 + 60 * 25));
    assert!(DVec3::from_slice(&lines[2]).abs_diff_eq(location.position, 1e-5));

    let scan = target.laser_scan(location, &scanner(), 0).unwrap();
    let [x, y, z, place] = [6, 7, 8, 9].map(|k: usize| DVec3::from_slice(&lines[k]));
    let mut empty = 0;
    for (k, line) in (0..).zip(&lines[10..]) {
        let (column, row) = (k / 25, 24 - k % 25);
        let Some(point) = scan.world_point(column, row) else {
            assert_eq!(line[..3], [0.0; 3]);
            empty += 1;
            continue;
        };
        let read = x * line[0] + y * line[1] + z * line[2] + place;
        assert!(read.abs_diff_eq(point, 5e-5));
        assert_eq!(line[4..], scan.colors.at(column, row).map(f64::from));
    }
    assert!((10..700).contains(&empty), "{empty}");
}

#[test]
fn a_cancelled_scan_leaves_no_file() {
    let scene = &*SCENE;
    let target = ScanTarget::new(scene);
    let folder = tempfile::tempdir().unwrap();
    let mut asked = 0;
    let mut once = || {
        asked += 1;
        asked < 2
    };
    let path = folder.path().join("scan.e57");
    let cancelled = target.write_e57(&path, &scene.locations, &scanner(), 0, &mut once);
    assert!(matches!(cancelled, Err(ScanError::Cancelled)));
    let cancelled = target.write_ptx(&folder.path().join("scan.ptx"), &scene.locations, &scanner(), || false);
    assert!(matches!(cancelled, Err(ScanError::Cancelled)));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);

    let lost = target.write_e57(&folder.path().join("no/scan.e57"), &scene.locations, &scanner(), 0, || true);
    assert!(lost.unwrap_err().to_string().contains("scan.e57: cannot write"));
}
