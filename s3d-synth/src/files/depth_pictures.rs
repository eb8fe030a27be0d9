//! Depth pictures as raw scans of Matterport, the TUM RGB-D benchmark and ScanNet have them.

use crate::building::ScanLocation;
use crate::device::{DepthCamera, DepthPicture, ScanTarget, turntable_poses};
use crate::{RangeError, ScanError};
use jpeg_encoder::{ColorType, Encoder};
use s3d_geom::glam::{DMat3, DQuat};
use s3d_geom::{Lens, Pose, Raster};
use s3d_io::Error as FileError;
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{Compression, Content, write_gray16, write_rgb8};
use std::fmt::Write as _;
use std::path::Path;

/// The units of depth in files, metres.
const MATTERPORT_UNIT_M: f64 = 0.00025;
const TUM_UNIT_M: f64 = 0.0002;
const SCANNET_UNIT_M: f64 = 0.001;

/// The quality of JPEG files.
const QUALITY: u8 = 92;

/// Pictures a second of a hand-held camera.
const RATE_HZ: f64 = 30.0;

impl ScanTarget<'_> {
    /// Writes the raw captures of a Matterport at some locations, 18 pictures each
    /// ([`turntable_poses`]), in the folders of Matterport3D:
    ///
    /// | file | holds |
    /// |---|---|
    /// | `matterport_depth_images/{uuid}_d{camera}_{yaw}.png` | depth along the axis, 0.25 mm, 0 for none |
    /// | `matterport_color_images/{uuid}_i{camera}_{yaw}.jpg` | colours |
    /// | `matterport_camera_poses/{uuid}_pose_{camera}_{yaw}.txt` | camera → world, OpenCV's axes |
    /// | `matterport_camera_intrinsics/{uuid}_intrinsics_{camera}.txt` | size, lens, distortion |
    ///
    /// The picture k of location i has the number 18 i + k. `go_on` is asked before each location. If it
    /// returns false, the files written so far stay.
    ///
    /// # Errors
    /// [`ScanError`] if a file cannot be written, a number is out of its range, or `go_on` returns false.
    pub fn write_matterport(
        &self,
        folder: &Path,
        locations: &[ScanLocation],
        camera: &DepthCamera,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<(), ScanError> {
        let camera = &DepthCamera { unit_m: MATTERPORT_UNIT_M, ..camera.clone() };
        let [depths, colors, poses, lenses] =
            ["depth_images", "color_images", "camera_poses", "camera_intrinsics"]
                .map(|name| folder.join(format!("matterport_{name}")));
        for folder in [&depths, &colors, &poses, &lenses] {
            create_dir(folder)?;
        }

        let mut number = 0;
        for location in locations {
            if !go_on() {
                return Err(ScanError::Cancelled);
            }
            let uuid = &location.uuid;
            for stop in turntable_poses(location) {
                let picture = self.depth_picture(&stop.pose, camera, number)?;
                number += 1;
                let of = format!("{}_{}", stop.camera, stop.yaw);
                write_depth(&depths.join(format!("{uuid}_d{of}.png")), &picture.depth, MATTERPORT_UNIT_M)?;
                write_jpeg(&colors.join(format!("{uuid}_i{of}.jpg")), &picture.colors)?;
                write_bytes(&poses.join(format!("{uuid}_pose_{of}.txt")), matrix(&stop.pose).as_bytes())?;
                if stop.yaw == 0 {
                    let path = lenses.join(format!("{uuid}_intrinsics_{}.txt", stop.camera));
                    write_bytes(&path, intrinsics(&camera.lens).as_bytes())?;
                }
            }
        }
        Ok(())
    }

    /// Writes pictures of a hand-held camera as a sequence of the TUM RGB-D benchmark: `rgb/` and `depth/`
    /// (PNG, 5,000 units a metre, 0 for none), the lists `rgb.txt` and `depth.txt`, and `groundtruth.txt`.
    /// There are 30 pictures a second, and both pictures of a pose have the same time. Files of the
    /// benchmark do not say which lens they were taken with: the default one of [`DepthCamera`] has the
    /// focal length and the middle that its page recommends. Picture k has the number k. `go_on` is asked
    /// before each.
    ///
    /// # Errors
    /// Like [`ScanTarget::write_matterport`].
    pub fn write_tum(
        &self,
        folder: &Path,
        poses: &[Pose],
        camera: &DepthCamera,
        go_on: impl FnMut() -> bool,
    ) -> Result<(), ScanError> {
        ["rgb", "depth"]
            .iter()
            .try_for_each(|name| create_dir(&folder.join(name)))?;
        let mut lists =
            ["# color images\n", "# depth maps\n", "# ground truth trajectory\n"].map(str::to_owned);
        lists[..2]
            .iter_mut()
            .for_each(|list| list.push_str("# timestamp filename\n"));
        lists[2].push_str("# timestamp tx ty tz qx qy qz qw\n");

        self.for_each_pose(poses, camera, TUM_UNIT_M, go_on, |number, picture| {
            let time = format!("{:.6}", number as f64 / RATE_HZ);
            let [color, depth] = ["rgb", "depth"].map(|kind| format!("{kind}/{time}.png"));
            write_rgb8(&folder.join(&color), &picture.colors, Content::Photo, Compression::Fast)?;
            write_depth(&folder.join(&depth), &picture.depth, TUM_UNIT_M)?;

            let p = picture.pose.location;
            let q = DQuat::from_mat3(&axes(&picture.pose));
            let _ = writeln!(lists[0], "{time} {color}");
            let _ = writeln!(lists[1], "{time} {depth}");
            let _ = write!(lists[2], "{time} {:.6} {:.6} {:.6} ", p.x, p.y, p.z);
            let _ = writeln!(lists[2], "{:.8} {:.8} {:.8} {:.8}", q.x, q.y, q.z, q.w);
            Ok(())
        })?;

        for (name, list) in ["rgb.txt", "depth.txt", "groundtruth.txt"].iter().zip(lists) {
            write_bytes(&folder.join(name), list.as_bytes())?;
        }
        Ok(())
    }

    /// Writes pictures of a hand-held camera as ScanNet's tools export a scan: `color/0.jpg` …,
    /// `depth/0.png` … (millimetres, 0 for none), `pose/0.txt` … (camera → world, OpenCV's axes) and
    /// `intrinsic/`. Picture k has the number k. `go_on` is asked before each.
    ///
    /// # Errors
    /// Like [`ScanTarget::write_matterport`].
    pub fn write_scannet(
        &self,
        folder: &Path,
        poses: &[Pose],
        camera: &DepthCamera,
        go_on: impl FnMut() -> bool,
    ) -> Result<(), ScanError> {
        let [color, depth, pose, intrinsic] =
            ["color", "depth", "pose", "intrinsic"].map(|name| folder.join(name));
        for folder in [&color, &depth, &pose, &intrinsic] {
            create_dir(folder)?;
        }

        let (f, c) = (camera.lens.focal_px(), camera.lens.center_px());
        let lens = format!("{} 0 {} 0\n0 {} {} 0\n0 0 1 0\n0 0 0 1\n", f.x, c.x, f.y, c.y);
        let same = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n";
        for of in ["color", "depth"] {
            write_bytes(&intrinsic.join(format!("intrinsic_{of}.txt")), lens.as_bytes())?;
            write_bytes(&intrinsic.join(format!("extrinsic_{of}.txt")), same.as_bytes())?;
        }

        self.for_each_pose(poses, camera, SCANNET_UNIT_M, go_on, |number, picture| {
            write_jpeg(&color.join(format!("{number}.jpg")), &picture.colors)?;
            write_depth(&depth.join(format!("{number}.png")), &picture.depth, SCANNET_UNIT_M)?;
            write_bytes(&pose.join(format!("{number}.txt")), matrix(&picture.pose).as_bytes())?;
            Ok(())
        })
    }

    /// Takes the pictures of a path one after the other.
    fn for_each_pose(
        &self,
        poses: &[Pose],
        camera: &DepthCamera,
        unit_m: f64,
        mut go_on: impl FnMut() -> bool,
        mut write: impl FnMut(u64, &DepthPicture) -> Result<(), ScanError>,
    ) -> Result<(), ScanError> {
        let camera = &DepthCamera { unit_m, ..camera.clone() };
        for (number, pose) in (0..).zip(poses) {
            if !go_on() {
                return Err(ScanError::Cancelled);
            }
            write(number, &self.depth_picture(pose, camera, number)?)?;
        }
        Ok(())
    }
}

/// Returns the rotation from OpenCV's axes of a camera to the world.
fn axes(pose: &Pose) -> DMat3 {
    pose.opencv_from_world().transpose()
}

/// Returns the matrix camera → world in OpenCV's axes, row by row.
fn matrix(pose: &Pose) -> String {
    let rotation = axes(pose);
    let mut text = String::new();
    for row in 0..3 {
        let r = rotation.row(row);
        let _ = writeln!(text, "{:.9} {:.9} {:.9} {:.6}", r.x, r.y, r.z, pose.location[row]);
    }
    text.push_str("0 0 0 1\n");
    text
}

/// Returns `width height fx fy cx cy k1 k2 p1 p2 k3`.
fn intrinsics(lens: &Lens) -> String {
    let (f, c, [k1, k2, p1, p2, k3]) = (lens.focal_px(), lens.center_px(), lens.distortion());
    let (width, height) = (lens.width(), lens.height());
    format!("{width} {height} {} {} {} {} {k1} {k2} {p1} {p2} {k3}\n", f.x, f.y, c.x, c.y)
}

/// Writes depths in whole units. Those that 16 bits do not hold become 0 as the missing ones.
fn write_depth(path: &Path, depth: &Raster<f32>, unit_m: f64) -> Result<(), ScanError> {
    let units = depth.map(|metres| {
        let units = (f64::from(metres) / unit_m).round();
        if units <= f64::from(u16::MAX) { units as u16 } else { 0 }
    });
    write_gray16(path, &units, Compression::Fast)?;
    Ok(())
}

fn write_jpeg(path: &Path, image: &Raster<[u8; 3]>) -> Result<(), ScanError> {
    write_bytes(path, &jpeg(path, image)?)?;
    Ok(())
}

/// Returns a picture as a JPEG file. The error names the file `path`.
pub(super) fn jpeg(path: &Path, image: &Raster<[u8; 3]>) -> Result<Vec<u8>, ScanError> {
    let side = |side: u32| {
        RangeError::check(side, [1.0, 65_535.0], || "the side of a picture in pixels".to_owned())?;
        Ok::<_, RangeError>(side as u16)
    };
    let mut bytes = Vec::new();
    Encoder::new(&mut bytes, QUALITY)
        .encode(image.pixels().as_flattened(), side(image.width())?, side(image.height())?, ColorType::Rgb)
        .map_err(|e| FileError::io(path, "write", std::io::Error::other(e)))?;
    Ok(bytes)
}
