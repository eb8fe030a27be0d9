//! Writes COLMAP models: cameras, images and points, for reconstruction and Gaussian splatting.
//!
//! COLMAP shares our conventions: metres; world → camera with the axes x right, y down, z forward; the
//! centre of the first pixel at (½, ½).

#![expect(clippy::indexing_slicing, reason = "a writer: its tables are its own")]

use crate::error::Result;
use crate::fs::atomic::{create_dir, write_whole};
use s3d_geom::PointCloud;
use s3d_geom::glam::{DMat3, DQuat, DVec3};
use std::io::{self, Write};
use std::path::Path;

/// An image of a model, with its own pinhole camera.
#[derive(Clone, Debug, PartialEq)]
pub struct ColmapImage {
    /// Its file, relative to COLMAP's folder of images. The name may not hold white space.
    pub name: String,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The matrix of focal lengths and principal point in pixels, row by row, as in a pose file.
    pub k: [[f64; 3]; 3],
    /// World → camera, 3 × 4, as in a pose file.
    pub rt: [[f64; 4]; 3],
}

impl ColmapImage {
    /// Returns world → camera as a quaternion (w, x, y, z) of length 1 with w ≥ 0, and a translation.
    pub fn pose(&self) -> ([f64; 4], [f64; 3]) {
        let row = |i: usize| DVec3::new(self.rt[i][0], self.rt[i][1], self.rt[i][2]);
        let camera_from_world = DMat3::from_cols(row(0), row(1), row(2)).transpose();
        let q = DQuat::from_mat3(&camera_from_world).normalize();
        let q = if q.w < 0.0 { -q } else { q };
        // Adding 0 turns −0 into 0.
        ([q.w, q.x, q.y, q.z].map(|v| v + 0.0), [0, 1, 2].map(|i| self.rt[i][3] + 0.0))
    }

    /// Returns fx, fy, cx, cy.
    fn intrinsics(&self) -> [f64; 4] {
        [self.k[0][0], self.k[1][1], self.k[0][2], self.k[1][2]]
    }
}

/// A model: a file each of cameras, images and points, as text or binary. Images and their cameras have the
/// numbers 1, 2, … in order, and so have points. Points have no tracks and the error 0.
///
/// ```
/// use s3d_geom::PointCloud;
/// use s3d_geom::glam::vec3;
/// use s3d_io::package::ColmapModel;
///
/// let points = PointCloud { positions: vec![vec3(1.5, 0.0, -2.0)], ..PointCloud::default() };
/// let mut text = Vec::new();
/// ColmapModel::new(&[], &points).points_text(&mut text)?;
/// assert!(text.ends_with(b"1 1.5 0 -2 0 0 0 0\n"));
/// # std::io::Result::Ok(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ColmapModel<'a> {
    images: &'a [ColmapImage],
    points: &'a PointCloud,
}

impl<'a> ColmapModel<'a> {
    /// Makes a model of these images and points.
    ///
    /// # Panics
    /// If `points` has colours but not one for each point, or if a name holds white space.
    pub fn new(images: &'a [ColmapImage], points: &'a PointCloud) -> Self {
        let count = points.len();
        let colors = points.colors.len();
        assert!(colors == 0 || colors == count, "{colors} colours for {count} points");
        for image in images {
            let bad = image.name.is_empty() || image.name.contains(|c: char| c.is_whitespace() || c == '\0');
            assert!(!bad, "{:?} cannot stand in a COLMAP model", image.name);
        }
        Self { images, points }
    }

    /// Writes `cameras.txt`, `images.txt` and `points3D.txt` into the folder `dir`, which is created if it
    /// does not exist.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write_text(&self, dir: &Path) -> Result<()> {
        create_dir(dir)?;
        write_whole(&dir.join("cameras.txt"), |out| self.cameras_text(out))?;
        write_whole(&dir.join("images.txt"), |out| self.images_text(out))?;
        write_whole(&dir.join("points3D.txt"), |out| self.points_text(out))?;
        Ok(())
    }

    /// Writes the model in COLMAP's binary form: `cameras.bin`, `images.bin` and `points3D.bin`.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn write_binary(&self, dir: &Path) -> Result<()> {
        create_dir(dir)?;
        write_whole(&dir.join("cameras.bin"), |out| self.cameras_binary(out))?;
        write_whole(&dir.join("images.bin"), |out| self.images_binary(out))?;
        write_whole(&dir.join("points3D.bin"), |out| self.points_binary(out))?;
        Ok(())
    }

    /// Writes the content of `cameras.txt`.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn cameras_text(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy")?;
        for (i, image) in self.images.iter().enumerate() {
            let [fx, fy, cx, cy] = image.intrinsics();
            writeln!(out, "{} PINHOLE {} {} {fx} {fy} {cx} {cy}", i + 1, image.width, image.height)?;
        }
        Ok(())
    }

    /// Writes the content of `images.txt`.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn images_text(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, and an empty line: no 2D points")?;
        for (i, image) in self.images.iter().enumerate() {
            let ([qw, qx, qy, qz], [tx, ty, tz]) = image.pose();
            let id = i + 1;
            writeln!(out, "{id} {qw} {qx} {qy} {qz} {tx} {ty} {tz} {id} {}\n", image.name)?;
        }
        Ok(())
    }

    /// Writes the content of `points3D.txt`.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn points_text(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "# POINT3D_ID X Y Z R G B ERROR")?;
        for (i, p) in self.points.positions.iter().enumerate() {
            let [r, g, b] = color(self.points, i);
            writeln!(out, "{} {} {} {} {r} {g} {b} 0", i + 1, p.x + 0.0, p.y + 0.0, p.z + 0.0)?;
        }
        Ok(())
    }

    /// Writes the content of `cameras.bin`.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn cameras_binary(&self, out: &mut dyn Write) -> io::Result<()> {
        /// COLMAP's number of the camera model PINHOLE.
        const PINHOLE: i32 = 1;
        out.write_all(&(self.images.len() as u64).to_le_bytes())?;
        for (i, image) in self.images.iter().enumerate() {
            out.write_all(&(i as u32 + 1).to_le_bytes())?;
            out.write_all(&PINHOLE.to_le_bytes())?;
            out.write_all(&u64::from(image.width).to_le_bytes())?;
            out.write_all(&u64::from(image.height).to_le_bytes())?;
            put_f64(out, &image.intrinsics())?;
        }
        Ok(())
    }

    /// Writes the content of `images.bin`.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn images_binary(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&(self.images.len() as u64).to_le_bytes())?;
        for (i, image) in self.images.iter().enumerate() {
            let (rotation, translation) = image.pose();
            let id = (i as u32 + 1).to_le_bytes();
            out.write_all(&id)?;
            put_f64(out, &rotation)?;
            put_f64(out, &translation)?;
            out.write_all(&id)?;
            out.write_all(image.name.as_bytes())?;
            // The end of the name, and no 2D points.
            out.write_all(&[0; 1 + 8])?;
        }
        Ok(())
    }

    /// Writes the content of `points3D.bin`.
    ///
    /// # Errors
    /// Returns the errors of `out`.
    pub fn points_binary(&self, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(&(self.points.len() as u64).to_le_bytes())?;
        for (i, p) in self.points.positions.iter().enumerate() {
            out.write_all(&(i as u64 + 1).to_le_bytes())?;
            put_f64(out, &p.as_dvec3().to_array())?;
            out.write_all(&color(self.points, i))?;
            // Error 0, and a track of length 0.
            out.write_all(&[0; 8 + 8])?;
        }
        Ok(())
    }
}

fn color(points: &PointCloud, i: usize) -> [u8; 3] {
    points.colors.get(i).copied().unwrap_or([0; 3])
}

fn put_f64(out: &mut dyn Write, values: &[f64]) -> io::Result<()> {
    values.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_geom::glam::{dvec3, vec3};
    use s3d_geom::{Camera, Pose};

    fn image(camera: &Camera, name: &str) -> ColmapImage {
        ColmapImage {
            name: name.into(),
            width: camera.width,
            height: camera.height,
            k: camera.k_matrix(),
            rt: camera.pose.rt_matrix(),
        }
    }

    fn cameras() -> Vec<Camera> {
        (0..40)
            .map(|i| {
                let scanner = DQuat::from_rotation_z(0.37 * f64::from(i)) * DQuat::from_rotation_x(0.02);
                let pose = Pose::from_scanner(dvec3(2.0, -1.0 - f64::from(i), 1.5), scanner)
                    .turned(0.9 * f64::from(i), 0.1 * f64::from(i % 7) - 0.3);
                Camera::perspective(pose, 0.5 + 0.01 * f64::from(i), 108, 96)
            })
            .collect()
    }

    fn points() -> PointCloud {
        PointCloud {
            positions: vec![vec3(1.5, -2.25, 0.1), vec3(-0.0, 1e-7, 12.0)],
            colors: vec![[1, 2, 3], [255, 0, 9]],
            faces: Vec::new(),
        }
    }

    /// Projects a point by COLMAP's formula.
    fn project(q: [f64; 4], t: [f64; 3], [fx, fy, cx, cy]: [f64; 4], point: DVec3) -> (f64, f64, f64) {
        let p = DQuat::from_xyzw(q[1], q[2], q[3], q[0]) * point + DVec3::from_array(t);
        (fx * p.x / p.z + cx, fy * p.y / p.z + cy, p.z)
    }

    proptest! {
        #[test]
        fn points_fall_on_the_pixels_of_our_camera(
            k in 0usize..40,
            x in -3.0..3.0f64,
            y in -3.0..3.0f64,
            z in 0.1..9.0f64,
        ) {
            let camera = cameras()[k];
            let point = camera.pose.location
                + camera.pose.right() * x + camera.pose.up() * y + camera.pose.forward() * z;
            let image = image(&camera, "a");
            let (q, t) = image.pose();
            let (u, v, depth) = project(q, t, image.intrinsics(), point);
            let (ours, our_depth) = camera.project(point).unwrap();
            prop_assert!(
                (u - ours.x).abs() < 1e-8 && (v - ours.y).abs() < 1e-8 && (depth - our_depth).abs() < 1e-10
            );
            prop_assert!(q[0] >= 0.0);
        }
    }

    fn u32_at(b: &[u8], at: usize) -> u32 {
        u32::from_le_bytes(b[at..at + 4].try_into().unwrap())
    }

    fn f64_at(b: &[u8], at: usize) -> f64 {
        f64::from_le_bytes(b[at..at + 8].try_into().unwrap())
    }

    #[test]
    fn text_and_binary_hold_the_same() {
        let dir = tempfile::tempdir().unwrap();
        let images: Vec<ColmapImage> = cameras()
            .iter()
            .enumerate()
            .map(|(i, c)| image(c, &format!("camera_{i}.png")))
            .collect();
        let points = points();
        let model = ColmapModel::new(&images, &points);
        model.write_text(dir.path()).unwrap();
        model.write_binary(dir.path()).unwrap();

        let lines = |name: &str| -> Vec<Vec<String>> {
            let text = std::fs::read_to_string(dir.path().join(name)).unwrap();
            let lines = text.lines().filter(|l| !l.starts_with('#'));
            lines
                .map(|l| l.split_whitespace().map(str::to_owned).collect())
                .collect()
        };
        let bytes = |name: &str| std::fs::read(dir.path().join(name)).unwrap();

        let text = lines("cameras.txt");
        let binary = bytes("cameras.bin");
        assert_eq!((text.len(), u32_at(&binary, 0), binary.len()), (40, 40, 8 + 40 * 56));
        for (i, line) in text.iter().enumerate() {
            let at = 8 + i * 56;
            assert_eq!(&line[..4], &[(i + 1).to_string(), "PINHOLE".into(), "108".into(), "96".into()]);
            assert_eq!(
                (u32_at(&binary, at), u32_at(&binary, at + 4), u32_at(&binary, at + 8)),
                (i as u32 + 1, 1, 108)
            );
            for k in 0..4 {
                assert_eq!(line[4 + k].parse(), Ok(f64_at(&binary, at + 24 + 8 * k)));
            }
        }

        let text = lines("images.txt");
        let binary = bytes("images.bin");
        assert_eq!(text.len(), 80);
        let mut at = 8;
        for (i, pair) in text.chunks(2).enumerate() {
            let [line, empty] = pair else { panic!("two lines an image") };
            assert!(empty.is_empty());
            assert_eq!((line[0].parse(), line[8].parse()), (Ok(i + 1), Ok(i + 1)));
            for k in 0..7 {
                assert_eq!(line[1 + k].parse(), Ok(f64_at(&binary, at + 4 + 8 * k)));
            }
            at += 4 + 7 * 8 + 4;
            let end = at + images[i].name.len();
            assert_eq!((&binary[at..end], line[9].as_bytes()), (images[i].name.as_bytes(), &binary[at..end]));
            assert_eq!(binary[end..end + 9], [0; 9]);
            at = end + 9;
        }
        assert_eq!(at, binary.len());

        let text = lines("points3D.txt");
        let binary = bytes("points3D.bin");
        assert_eq!(text[0], ["1", "1.5", "-2.25", "0.1", "1", "2", "3", "0"]);
        assert_eq!(text[1][1..4], ["0", "0.0000001", "12"]);
        assert_eq!((text.len(), binary.len()), (2, 8 + 2 * (8 + 24 + 3 + 8 + 8)));
        assert_eq!((f64_at(&binary, 16), binary[40..43].to_vec()), (1.5, vec![1, 2, 3]));
    }

    #[test]
    #[should_panic(expected = "cannot stand in a COLMAP model")]
    fn a_name_with_a_space_is_a_mistake() {
        ColmapModel::new(&[image(&cameras()[0], "a b.png")], &points());
    }
}
