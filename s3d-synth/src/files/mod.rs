//! A scene as files, as a scanner and an annotator would have left them.

mod depth_pictures;
mod laser_scans;
mod whole;

use crate::{AnnotatedScene, ScanError, ScanOptions};
use s3d_geom::glam::DQuat;
use s3d_io::cloud::S3disAreaWriter;
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::mesh::write_rgb_obj;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

const SCENE_FILE: &str = "scene.toml";

/// The first words of the demo's scene file, which tell it from a user's own.
const DEMO: &str = "# The built-in scene of s3d";

/// The first words of the scene files of [`BuildingOptions::area`](crate::BuildingOptions::area).
const AREA: &str = "# A generated area of s3d";

/// Whether `folder` holds a scan of the demo's building, and may be written again.
pub fn is_demo_scan(folder: &Path) -> bool {
    begins_with(folder, DEMO)
}

/// Whether `folder` holds a scan of a generated area, and may be written again.
pub fn is_area_scan(folder: &Path) -> bool {
    begins_with(folder, AREA)
}

fn begins_with(folder: &Path, words: &str) -> bool {
    std::fs::read_to_string(folder.join(SCENE_FILE)).is_ok_and(|text| text.starts_with(words))
}

impl AnnotatedScene {
    /// Writes a scan of the scene into `folder`, which is made if it is not there: the textured mesh
    /// (`rgb.obj`), the annotated points of [`AnnotatedScene::scan`] (an S3DIS tree, `Area_1`), the scan
    /// locations (`cameras.csv`), and `scene.toml`, which ties them together. Returns the path of
    /// `scene.toml`, which is written last.
    ///
    /// `go_on` is asked before each room of points. If it returns false, the files written so far stay.
    ///
    /// ```
    /// use s3d_synth::{Building, ScanError, ScanOptions};
    ///
    /// let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
    /// let options = ScanOptions { points_per_m2: 20.0, ..ScanOptions::default() };
    /// let folder = std::env::temp_dir().join(format!("s3d-synth-{}", std::process::id()));
    /// let scene_file = scene.write_scan(&folder, &options, || true)?;
    /// assert_eq!(scene_file, folder.join("scene.toml"));
    /// assert!(folder.join("Area_1/office_1/Annotations/table_2.txt").exists());
    ///
    /// let cancelled = scene.write_scan(&folder, &options, || false);
    /// assert!(matches!(cancelled, Err(ScanError::Cancelled)));
    /// # std::fs::remove_dir_all(folder)?;
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// [`ScanError`] if a file cannot be written, a number is out of its range, or `go_on` returns false.
    pub fn write_scan(
        &self,
        folder: &Path,
        options: &ScanOptions,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<PathBuf, ScanError> {
        let area = format!("Area_{}", options.area);
        create_dir(folder)?;
        write_rgb_obj(folder, &self.mesh, &[])?;
        self.write_annotations(&folder.join(&area), options, &mut go_on)?;
        write_bytes(&folder.join("cameras.csv"), camera_table(self).as_bytes())?;
        // The title becomes one line, whatever it holds.
        let title = self.title.replace(char::is_control, " ");
        let toml = format!(
            "# {title}.\narea = {number}\n\n\
             [mesh]\npath = \"rgb.obj\"\nup   = \"y\"\n\n\
             [annotations]\npath = \"{area}\"\n\n\
             [cameras]\npath = \"cameras.csv\"\n",
            number = options.area
        );
        let path = folder.join(SCENE_FILE);
        write_bytes(&path, toml.as_bytes())?;
        Ok(path)
    }

    fn write_annotations(
        &self,
        folder: &Path,
        options: &ScanOptions,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<(), ScanError> {
        let tree = S3disAreaWriter::create(folder)?;
        let mut angles = Vec::new();
        let mut scan = self.scan(options)?.peekable();

        while let Some((first, _)) = scan.peek() {
            if !go_on() {
                return Err(ScanError::Cancelled);
            }

            let room = self.instances[*first].room;
            let mut files = tree.room(&room.to_string())?;

            while let Some((index, cloud)) = scan.next_if(|(index, _)| self.instances[*index].room == room) {
                if cloud.is_empty() {
                    continue;
                }
                let instance = &self.instances[index];
                let mut file = files.instance(instance.class.name(), instance.number)?;
                file.append(&cloud.positions, &cloud.colors)?;
                file.finish()?;
            }

            files.finish()?;
            // Walls are parallel to the axes.
            angles.push((room.to_string(), 0));
        }

        tree.alignment(&angles)?;
        Ok(())
    }
}

/// `uuid,x,y,z,qx,qy,qz,qw` a line.
fn camera_table(scene: &AnnotatedScene) -> String {
    let mut text = String::new();
    for l in &scene.locations {
        let p = l.position;
        let q = DQuat::from_rotation_z(l.yaw_rad);
        let _ = writeln!(
            text,
            "{},{:.6},{:.6},{:.6},{:.9},{:.9},{:.9},{:.9}",
            l.uuid, p.x, p.y, p.z, q.x, q.y, q.z, q.w
        );
    }
    text
}
