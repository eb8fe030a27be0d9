//! Cameras with poses, from any supported list.

use crate::camera::locations::{has_transforms, is_colmap_images};
use crate::camera::other_kind::refuse_other_kind;
use crate::camera::posed::PosedCamera;
use crate::camera::programs::sens::Recording;
use crate::camera::programs::{
    arkit, colmap, matrices, metashape, nerfstudio, polycam, reality_capture, scannet, sens, sequence, tum,
    undistorted,
};
use crate::camera::{located, table};
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::{open_file, read_file};
use s3d_geom::glam::DAffine3;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The supported forms, for messages.
const FORMS: &str = "cameras are a transforms.json, a COLMAP model (cameras and images, .txt or .bin), \
                     Metashape's cameras.xml, a recording of ScanNet (.sens), a folder of ScanNet's \
                     poses (pose/0.txt), of 3RScan's (frame-000000.pose.txt) or of Polycam's keyframes, \
                     Matterport3D's undistorted cameras (.conf), a trajectory of ARKitScenes \
                     (lowres_wide.traj), of matrices (16 numbers a line) or of lines `timestamp tx ty tz qx \
                     qy qz qw`, or a CSV table";

/// The cameras of a list.
#[derive(Clone, Debug, PartialEq)]
pub struct PosedCameras {
    /// The cameras in the list's order; at least one.
    pub cameras: Vec<PosedCamera>,
    /// The number of pictures that were left out, because the list has no pose for them, or says that it is
    /// not known.
    pub untracked: usize,
    /// The files that were read.
    pub files: Vec<PathBuf>,
}

/// A list as it was read.
struct ReadList {
    cameras: Vec<PosedCamera>,
    untracked: usize,
    files: Vec<PathBuf>,
    /// The file or folder that messages name.
    named: PathBuf,
}

/// Reads the cameras of `path`, a file or a folder. The name and the first line tell which form it has:
///
/// - `transforms.json`, any other `.json`, or a folder that holds one: the frames of nerfstudio and related
///   programs, in the world before their `applied_transform`;
/// - `images.txt`, `images.bin`, or a folder that holds one, itself or in `0`, `sparse` or `sparse/0`: a
///   COLMAP model, with the list of `cameras` beside it;
/// - `scene0000_00.sens`, or a folder that holds one such file: a [recording](Recording) of ScanNet, whose
///   pictures are parts of the file;
/// - a folder with ScanNet's `pose/0.txt`, or that folder itself; `intrinsic/intrinsic_color.txt` and the
///   first picture in `color` give the optics and the size;
/// - a folder with 3RScan's `sequence/frame-000000.pose.txt`, or that folder itself; `_info.txt` gives the
///   optics and the size;
/// - a folder with Polycam's `keyframes`, or that folder itself: the corrected cameras, if there are some;
/// - `lowres_wide.traj` of ARKitScenes, or any other file of lines with seven numbers, or a folder that holds
///   `lowres_wide.traj`: the pictures beside it, whose names have their times, each with its `.pincam`;
/// - `traj.txt`, or any other file of lines with 16 numbers, or a folder that holds `traj.txt`: camera →
///   world in OpenCV's axes, a line for each of the pictures in `results/frame000000.jpg` or
///   `rgb/rgb_0.png`, in their order, with Replica's `cam_params.json`;
/// - a file of commands such as `intrinsics_matrix`, or a folder with one such `.conf` file: the undistorted
///   photographs of Matterport3D;
/// - an XML file, or a folder that holds `cameras.xml`: the cameras of a Metashape chunk, whose sensors may
///   be panoramas;
/// - a table that begins as RealityCapture's does: `#name,x,y,alt,heading,pitch,roll,f`, with pictures beside
///   it;
/// - any other file whose first line has a comma: a table of scan locations (see
///   [`read_cameras`](crate::camera::read_cameras)), which may also have `width,height` and `fov` or
///   `fx,fy,cx,cy`;
/// - any other file: a trajectory of TUM's benchmark.
///
/// `world_from_file` is the transform from the file's frame to the world (metres, Z-up): a rotation, a shift
/// and a scale. Size and optics of a camera may be unknown: [`PosedCamera::camera`] tells.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the place; [`Error::Unsupported`] for a folder that holds none of
/// these, and for a file of another kind, which the message names.
pub fn read_posed_cameras(path: &Path, world_from_file: &DAffine3) -> Result<PosedCameras> {
    read_photograph_cameras(path, None, world_from_file)
}

/// Reads like [`read_posed_cameras`]. `images` is the folder of the pictures, if it is known: a trajectory of
/// ARKitScenes gives each of them its pose.
///
/// # Errors
/// Like [`read_posed_cameras`].
pub fn read_photograph_cameras(
    path: &Path,
    images: Option<&Path>,
    world_from_file: &DAffine3,
) -> Result<PosedCameras> {
    let ReadList { mut cameras, untracked, files, named: file } = read(path, images)?;
    cameras
        .iter_mut()
        .for_each(|camera| camera.pose = camera.pose.moved(world_from_file));

    cameras
        .iter()
        .try_for_each(|camera| located::check_place(&file, camera))?;
    if cameras.is_empty() {
        let but = if untracked > 0 {
            format!(" but {untracked} whose poses are not known")
        } else {
            String::new()
        };
        return Err(Error::format(&file, format!("lists no camera{but}: {FORMS}")));
    }
    Ok(PosedCameras { cameras, untracked, files })
}

/// Reads the cameras of a list in its own frame.
fn read(path: &Path, images: Option<&Path>) -> Result<ReadList> {
    if path.is_dir() {
        return read_folder(path, images);
    }

    if crate::house::is_house(path) {
        let message = "tells where panoramas are, not what lenses photographs have: give the file in \
                       undistorted_camera_parameters";
        return Err(Error::unsupported(path, message));
    }
    let mut files = vec![path.to_owned()];
    let cameras = if is_colmap_images(path) {
        let (cameras, intrinsics) = colmap::read_posed(path)?;
        files.push(intrinsics);
        cameras
    } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("json")) {
        let (cameras, untracked) = nerfstudio::read_posed(path)?;
        return Ok(ReadList { untracked, ..ReadList::of_files(cameras, files) });
    } else if is_recording(path)? {
        return read_recording(path);
    } else {
        let bytes = read_file(path)?;
        if reality_capture::is_table(&bytes) {
            let cameras = reality_capture::read(path, &bytes, images)?;
            return Ok(ReadList::of_files(cameras, files));
        }
        refuse_other_kind(path, &bytes)?;
        let text = text_of(&bytes, path)?;
        if metashape::is_xml(&text) {
            return read_xml(path, &bytes);
        }
        let mut lines = text.split(|&b| b == b'\n').map(<[u8]>::trim_ascii);
        let first = lines
            .find(|line| !line.is_empty() && !line.starts_with(b"#"))
            .unwrap_or_default();
        if arkit::is_trajectory(first) {
            let (cameras, untracked, files) = arkit::read(path, &text, images)?;
            return Ok(ReadList { untracked, ..ReadList::of_files(cameras, files) });
        }
        if matrices::is_matrix(first) {
            let (cameras, untracked, files) = matrices::read(path, &text, images)?;
            return Ok(ReadList { untracked, ..ReadList::of_files(cameras, files) });
        }
        if undistorted::is_list(first) {
            undistorted::read(path, &text)?
        } else if first.contains(&b',') {
            table::read_rows(path, &bytes)?
        } else {
            tum::read(path, &text)?
        }
    };

    Ok(ReadList::of_files(cameras, files))
}

/// Returns whether a file is a recording of ScanNet, by its first bytes.
fn is_recording(path: &Path) -> Result<bool> {
    let mut start = Vec::new();
    open_file(path)?
        .take(12)
        .read_to_end(&mut start)
        .map_err(|e| Error::io(path, "read", e))?;
    Ok(sens::is_recording(&start))
}

/// Reads the cameras of a recording.
fn read_recording(path: &Path) -> Result<ReadList> {
    let (cameras, untracked) = Recording::open(path)?.cameras();
    Ok(ReadList { untracked, ..ReadList::of_files(cameras, vec![path.to_owned()]) })
}

/// Reads the cameras of a Metashape chunk.
fn read_xml(path: &Path, bytes: &[u8]) -> Result<ReadList> {
    let (cameras, untracked) = metashape::read(path, bytes)?;
    Ok(ReadList { untracked, ..ReadList::of_files(cameras, vec![path.to_owned()]) })
}

fn read_folder(path: &Path, images: Option<&Path>) -> Result<ReadList> {
    if let Some(images) = colmap::find(path) {
        let (cameras, intrinsics) = colmap::read_posed(&images)?;
        return Ok(ReadList::of_files(cameras, vec![images, intrinsics]));
    }
    if let Some(transforms) = has_transforms(path) {
        let (cameras, untracked) = nerfstudio::read_posed(&transforms)?;
        return Ok(ReadList { untracked, ..ReadList::of_files(cameras, vec![transforms]) });
    }
    if let Some((scan, files)) = scannet::find(path)? {
        let (cameras, untracked, files) = scannet::read(&scan, files)?;
        return Ok(ReadList { cameras, untracked, files, named: path.to_owned() });
    }
    if let Some(files) = sequence::find(path)? {
        let (cameras, untracked, files) = sequence::read(files)?;
        return Ok(ReadList { cameras, untracked, files, named: path.to_owned() });
    }
    if let Some(trajectory) = arkit::find(path).or_else(|| matrices::find(path)) {
        return read(&trajectory, images);
    }
    if let Some(recording) = sens::find(path) {
        return read(&recording, images);
    }
    let xml = path.join("cameras.xml");
    if xml.is_file() {
        return read(&xml, images);
    }
    if let Some((files, images)) = polycam::find(path)? {
        let (cameras, files) = polycam::read(files, &images)?;
        return Ok(ReadList { cameras, untracked: 0, files, named: path.to_owned() });
    }
    if let Some(list) = undistorted::find(path) {
        return read(&list, images);
    }
    Err(Error::unsupported(path, format!("holds no list of cameras: {FORMS}")))
}

impl ReadList {
    /// Returns the list that was read from `files`. Messages name the first.
    fn of_files(cameras: Vec<PosedCamera>, files: Vec<PathBuf>) -> Self {
        let named = files.first().cloned().unwrap_or_default();
        Self { cameras, untracked: 0, files, named }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DMat3, DVec3, dvec3};
    use std::fs;

    #[test]
    fn the_form_is_found_by_its_shape() {
        let dir = tempfile::tempdir().unwrap();
        let at = |p: &str| dir.path().join(p);
        for folder in ["colmap/sparse/0", "scan/pose", "ns", "empty", "3rscan/sequence", "arkit", "metashape"]
        {
            fs::create_dir_all(at(folder)).unwrap();
        }
        // Each looks along +Y from (1, 2, 3).
        fs::write(at("colmap/sparse/0/images.txt"), "1 0.5 0.5 0 0 -1 3 -2 1 a.jpg\n").unwrap();
        fs::write(
            at("colmap/sparse/0/images.txt"),
            format!("1 {0} {0} 0 0 -1 3 -2 1 a.jpg\n", 0.5f64.sqrt()),
        )
        .unwrap();
        fs::write(at("colmap/sparse/0/cameras.txt"), "1 PINHOLE 64 48 50 51 32 24\n").unwrap();
        fs::write(at("scan/pose/0.txt"), "1 0 0 1\n0 0 1 2\n0 -1 0 3\n0 0 0 1\n").unwrap();
        fs::write(at("scan/pose/1.txt"), "-inf -inf -inf -inf\n".repeat(4)).unwrap();
        let frame = r#"{"file_path": "a.jpg", "transform_matrix": [[1,0,0,1],[0,0,-1,2],[0,1,0,3]]}"#;
        fs::write(at("ns/transforms.json"), format!("{{\"frames\": [{frame}]}}")).unwrap();
        let half = 0.5f64.sqrt();
        fs::write(at("trajectory.txt"), format!("# time\n0.5 1 2 3 {} 0 0 {half}\n", -half)).unwrap();
        fs::write(at("table.txt"), "\n# a table\nname,x,y,z,yaw\nfirst,1,2,3,0\n").unwrap();
        fs::write(at("plain.csv"), "first,1,2,3,0,0,0,1\n").unwrap();
        let pose = "1 0 0 1\n0 0 1 2\n0 -1 0 3\n0 0 0 1\n";
        fs::write(at("3rscan/sequence/frame-000007.pose.txt"), pose).unwrap();
        fs::write(at("arkit/lowres_wide.traj"), "0.5 1.5707963267948966 0 0 -1 3 -2\n").unwrap();
        fs::write(at("trajectory.dat"), "# seven numbers\n0.5 1.5707963267948966 0 0 -1 3 -2\n").unwrap();
        let sensor = "<sensor id=\"0\" type=\"spherical\"><resolution width=\"8\" height=\"4\"/></sensor>";
        let camera =
            format!("<camera sensor_id=\"0\" label=\"a.jpg\"><transform>{pose}</transform></camera>");
        let chunk = format!("<chunk><sensors>{sensor}</sensors><cameras>{camera}</cameras></chunk>");
        fs::write(at("metashape/cameras.xml"), format!("<document>{chunk}</document>")).unwrap();

        let read = |p: &str| read_posed_cameras(&at(p), &DAffine3::IDENTITY).unwrap();
        for (path, name) in [
            ("colmap", "a.jpg"),
            ("colmap/sparse/0/images.txt", "a.jpg"),
            ("scan", "0"),
            ("ns", "a.jpg"),
            ("ns/transforms.json", "a.jpg"),
            ("trajectory.txt", "0.5"),
            ("table.txt", "first"),
            ("plain.csv", "first"),
            ("3rscan", "frame-000007"),
            ("arkit", "0.5"),
            ("trajectory.dat", "0.5"),
            ("metashape", "a.jpg"),
            ("metashape/cameras.xml", "a.jpg"),
        ] {
            let found = read(path);
            assert_eq!((found.cameras.len(), found.untracked), (1, usize::from(path == "scan")), "{path}");
            let camera = &found.cameras[0];
            assert_eq!(camera.name, name, "{path}");
            assert!(camera.pose.location.abs_diff_eq(dvec3(1.0, 2.0, 3.0), 1e-12), "{path}: {camera:?}");
            assert!(camera.pose.forward().abs_diff_eq(DVec3::Y, 1e-12), "{path}: {camera:?}");
            assert!(camera.pose.up().abs_diff_eq(DVec3::Z, 1e-12), "{path}: {camera:?}");
        }

        let message = |p: &str| read_posed_cameras(&at(p), &DAffine3::IDENTITY).unwrap_err().to_string();
        assert!(message("empty").contains("holds no list of cameras: cameras are a transforms.json"));
        fs::write(at("scan/pose/0.txt"), "-inf -inf -inf -inf\n".repeat(4)).unwrap();
        assert!(message("scan").contains("lists no camera but 2 whose poses are not known"));
        fs::write(at("cloud.csv"), b"ASTM-E57\x01\0\0\0").unwrap();
        assert!(
            message("cloud.csv").contains("cloud.csv: is a cloud of points (E57), not a list of cameras")
        );
        fs::write(at("far.csv"), "name,x,y,z,yaw\nfirst,1e6,2,3,0\n").unwrap();
        let scaled = DAffine3::from_mat3(DMat3::from_diagonal(DVec3::splat(100.0)));
        let far = read_posed_cameras(&at("far.csv"), &scaled).unwrap_err().to_string();
        assert!(far.contains("line 2: `first`: [100000000, 200, 300] is more than"), "{far}");
    }
}
