//! Scenes of known data sets, found by the files in their folder.
//!
//! A found scene is the text of a scene file, so that a person can write it down and change it. Each data set
//! is a function of [`sets::SETS`] that looks for its own files. Sources: the READMEs of the data sets, named
//! in [`crate::formats`], "Data sets as they lie on the disk".

mod folder;
mod parts;
mod sets;

use crate::error::{Error, Result};
use crate::scene::document::parse_scene;
use crate::scene::file::SceneFile;
use folder::Folder;
use sets::SETS;
use std::path::Path;

/// The name of a scene file in its folder.
const SCENE: &str = "scene.toml";

/// A scene that was found in a folder.
#[derive(Clone, Debug, PartialEq)]
pub struct FoundScene {
    /// The data set whose files they are: "Replica".
    pub set: &'static str,
    /// The scene file that says the same. Its paths start at the folder.
    pub toml: String,
    /// What it says. Its path is the one that a scene file in the folder would have.
    pub scene: SceneFile,
}

/// Finds the scene of a known data set in a folder. Returns `None` if the folder holds no such scene.
///
/// ```
/// use s3d_io::scene::find_scene;
///
/// # let folder = tempfile::tempdir().unwrap();
/// for file in ["mesh_semantic.ply", "info_semantic.json"] {
///     std::fs::write(folder.path().join(file), "")?;
/// }
/// let found = find_scene(folder.path())?.unwrap();
/// assert_eq!(found.set, "Replica");
/// assert!(found.toml.contains("path = \"mesh_semantic.ply\""));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::Io`] if the folder cannot be read.
pub fn find_scene(folder: &Path) -> Result<Option<FoundScene>> {
    std::fs::read_dir(folder).map_err(|e| Error::io(folder, "read the folder", e))?;
    let dir = Folder::new(folder);
    let Some((set, parts)) = SETS.iter().find_map(|(set, find)| Some((*set, find(&dir)?))) else {
        return Ok(None);
    };
    let toml = parts.to_toml(set, &dir);
    let scene = parse_scene(&toml, &folder.join(SCENE))?;
    Ok(Some(FoundScene { set, toml, scene }))
}

/// Returns the names of the data sets whose scenes [`find_scene`] finds.
pub fn found_sets() -> impl Iterator<Item = &'static str> {
    SETS.iter().map(|(set, _)| *set)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::read_posed_cameras;
    use s3d_geom::Pose;
    use s3d_geom::glam::DVec3;
    use std::fs;

    fn found(files: &[&str]) -> Option<FoundScene> {
        let dir = tempfile::tempdir().unwrap();
        for file in files {
            let path = dir.path().join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            if file.ends_with('/') {
                fs::create_dir_all(&path).unwrap();
            } else {
                fs::write(&path, "").unwrap();
            }
        }
        find_scene(dir.path()).unwrap()
    }

    #[test]
    fn data_sets_are_known_by_their_files() {
        let name = |path: &Path| path.file_name().unwrap().to_string_lossy().into_owned();
        for (files, set, mesh, labels, frames) in [
            (
                &[
                    "scans/mesh_aligned_0.05.ply",
                    "scans/segments_anno.json",
                    "scans/segments.json",
                    "dslr/nerfstudio/transforms.json",
                    "dslr/resized_images/",
                    "dslr/resized_anon_masks/",
                ][..],
                "ScanNet++",
                "mesh_aligned_0.05.ply",
                "segments_anno.json",
                "transforms.json",
            ),
            (
                &["mesh.ply", "habitat/mesh_semantic.ply", "habitat/info_semantic.json", "traj_w_c.txt"],
                "Replica",
                "mesh_semantic.ply",
                "info_semantic.json",
                "traj_w_c.txt",
            ),
            (
                &["00800-a.glb", "00800-a.semantic.glb", "00800-a.semantic.txt"],
                "HM3D",
                "00800-a.glb",
                "00800-a.semantic.txt",
                "",
            ),
            (
                &["a.basis.glb", "a.semantic.glb", "a.semantic.txt"],
                "HM3D",
                "a.semantic.glb",
                "a.semantic.txt",
                "",
            ),
            (
                &["mesh.refined.v2.obj", "semseg.v2.json", "labels.instances.annotated.v2.ply", "sequence/"],
                "3RScan",
                "mesh.refined.v2.obj",
                "semseg.v2.json",
                "sequence",
            ),
            (
                &["4_3dod_mesh.ply", "lowres_wide.traj", "lowres_wide/"],
                "ARKitScenes",
                "4_3dod_mesh.ply",
                "",
                "lowres_wide.traj",
            ),
            (
                &[
                    "s_vh_clean.ply",
                    "s_vh_clean_2.ply",
                    "s.aggregation.json",
                    "s_vh_clean.aggregation.json",
                    "s.sens",
                ],
                "ScanNet",
                "s_vh_clean_2.ply",
                "s.aggregation.json",
                "s.sens",
            ),
        ] {
            let found = found(files).unwrap_or_else(|| panic!("{set}"));
            assert_eq!((found.set, name(&found.scene.mesh[0])), (set, mesh.to_owned()));
            let told = found
                .scene
                .annotations
                .first()
                .map_or_else(String::new, |path| name(path));
            assert_eq!(told, labels, "{set}");
            let list = found.scene.frames.as_ref();
            let told = list.map_or_else(String::new, |frames| name(&frames.path));
            assert_eq!(told, frames, "{set}");
            let has_masks = list.is_some_and(|frames| frames.masks.is_some());
            assert_eq!(has_masks, set == "ScanNet++");
        }
        assert_eq!(found(&["scan.ply", "notes.txt"]), None);
        assert_eq!(found(&["matterport_mesh/", "house_segmentations/"]), None);
    }

    /// All folders of a house, as they are unpacked.
    const HOUSE: [&str; 9] = [
        "house_segmentations/h.house",
        "house_segmentations/h.ply",
        "matterport_mesh/0123/0123.obj",
        "matterport_color_images/",
        "matterport_camera_poses/",
        "matterport_camera_intrinsics/",
        "matterport_skybox_images/",
        "undistorted_camera_parameters/h.conf",
        "undistorted_color_images/",
    ];

    #[test]
    fn houses_of_matterport3d_are_found_whole_and_in_part() {
        let whole = found(&HOUSE).unwrap();
        let right = "# A scene of Matterport3D, found in its folder.\narea = 1\ntaxonomy = \"matterport40\"\n\
            [mesh]\npath = \"matterport_mesh/0123/0123.obj\"\nup = \"z\"\n\
            [annotations]\npath = \"house_segmentations/h.house\"\n\
            # The file tells rooms: this one is for what lies in none.\nroom = \"openspace_1\"\n\
            unknown_as_clutter = true\n\
            [cameras]\npath = \"matterport_camera_poses\"\n[rgb]\nsource = \"captures\"\npath = \".\"\n\
            [frames]\npath = \"undistorted_camera_parameters/h.conf\"\n\
            images = \"undistorted_color_images\"\n";
        assert_eq!((whole.set, whole.toml.as_str()), ("Matterport3D", right));
        assert!(whole.scene.pictures.is_some() && whole.scene.frames.is_some());
        assert_eq!(whole.scene.taxonomy.name(), "matterport40");

        let labels = found(&HOUSE[..2]).unwrap().toml;
        for row in [
            "[mesh]\npath = \"house_segmentations/h.ply\"",
            "[cameras]\npath = \"house_segmentations/h.house",
        ] {
            assert!(labels.contains(row) && !labels.contains("[rgb]"), "{labels}");
        }
        let bare = found(&HOUSE[2..3]).unwrap();
        assert!(!bare.scene.is_labelled && bare.scene.cameras.is_none(), "{}", bare.toml);
        assert!(!bare.toml.contains("taxonomy"), "{}", bare.toml);
    }

    /// A floor and a chair below and drawers above: triangles of the segments 7, 3 and 1000003.
    #[cfg(feature = "labels")]
    const CORNERS: [[f32; 3]; 9] = [
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [0.0, 4.0, 0.0],
        [1.0, 1.0, 0.4],
        [1.4, 1.0, 0.4],
        [1.0, 1.4, 0.4],
        [0.0, 0.0, 3.0],
        [4.0, 0.0, 3.0],
        [0.0, 4.0, 3.0],
    ];

    #[cfg(feature = "labels")]
    #[test]
    fn a_house_of_two_storeys_has_labels_locations_and_photographs() {
        use crate::camera::read_scan_locations;
        use crate::cloud::{AnnotatedMesh, Annotations};
        use crate::house::tests::{HOUSE as HOUSE_FILE, UUIDS};
        use crate::mesh::read_mesh;
        use crate::scene::CameraSource;
        use s3d_geom::PointCloud;
        use s3d_geom::glam::DVec2;

        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        let row = |[x, y, z]: [f32; 3]| format!("{x} {y} {z}\n");
        let rows: String = CORNERS.into_iter().map(row).collect();
        let faces = "3 0 1 2 7 0 4\n3 3 4 5 3 1 28\n3 6 7 8 1000003 2 111\n";
        let head = "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nproperty float y\n\
                    property float z\nelement face 3\nproperty list uchar int vertex_indices\n\
                    property int material_id\nproperty int segment_id\nproperty int category_id\n\
                    end_header\n";
        write("house_segmentations/h.ply", &format!("{head}{rows}{faces}"));
        write("house_segmentations/h.house", HOUSE_FILE);
        let vertices: String = CORNERS.into_iter().map(|corner| format!("v {}", row(corner))).collect();
        write("matterport_mesh/01/01.obj", &format!("{vertices}f 1 2 3\nf 7 8 9\nf 4 5 6\n"));
        let pose = "0 0 1 1\n-1 0 0 1\n0 -1 0 1.5\n0 0 0 1\n";
        write(&format!("matterport_camera_poses/{}_pose_1_0.txt", UUIDS[0]), pose);
        let list = "dataset matterport\nn_images 1\nintrinsics_matrix 500 0 640  0 500 511  0 0 1\n\
                    scan d.png a_i1_0.jpg 0 0 -1 1 -1 0 0 1 0 1 0 1.5 0 0 0 1\n";
        write("undistorted_camera_parameters/h.conf", list);
        fs::create_dir(dir.path().join("undistorted_color_images")).unwrap();

        let scene = find_scene(dir.path()).unwrap().unwrap().scene;
        let file = read_mesh(&scene.mesh[0], scene.up).unwrap();
        let outside_files = scene.outside_files;
        let mesh = AnnotatedMesh { file: &file, up: scene.up, units: scene.units, outside_files };
        let found = Annotations::open_for(&mesh, &scene.annotations, &scene.annotation_options).unwrap();
        let mut labels = Vec::new();
        for room in &found.rooms {
            for instance in &room.instances {
                let mut cloud = PointCloud::default();
                instance.read(&mut cloud).unwrap();
                cloud.faces.dedup();
                labels.push(format!("{} of {}: {:?}", instance.class, room.room, cloud.faces));
            }
        }
        labels.sort();
        let right =
            ["chair of bedroom_1: [2]", "chestOfDrawers of kitchen_1: [1]", "floor of bedroom_1: [0]"];
        assert_eq!(labels, right);

        let Some(CameraSource::Listed { path, world_from_file }) = scene.cameras else { panic!() };
        let of_captures = read_scan_locations(&path, &world_from_file).unwrap();
        let of_house = read_scan_locations(&scene.annotations[0], &world_from_file).unwrap();
        assert_eq!((of_captures.len(), of_house.len()), (1, 2));
        assert_eq!(of_captures[0].uuid, of_house[0].uuid);
        let [captured, told] = [&of_captures[0].pose, &of_house[0].pose];
        assert!(captured.world_from_camera.abs_diff_eq(told.world_from_camera, 1e-12), "{told:?}");

        // The photograph was taken by that camera, so what is before both is in its middle.
        let frames = scene.frames.unwrap();
        let list = read_posed_cameras(&frames.path, &frames.world_from_file).unwrap();
        let camera = list.cameras[0].camera(&Default::default()).unwrap();
        let (seen, _) = camera.project(captured.location + captured.forward() * 3.0).unwrap();
        assert!(seen.abs_diff_eq(DVec2::new(640.0, 512.0), 1e-9), "{seen}");
    }

    #[test]
    fn a_house_is_found_in_the_folder_that_its_archives_are_unpacked_in() {
        let dir = tempfile::tempdir().unwrap();
        let house = dir.path().join("h");
        for file in HOUSE {
            let path = house.join("h").join(file);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            if file.ends_with('/') {
                fs::create_dir_all(&path).unwrap();
            } else {
                fs::write(&path, "").unwrap();
            }
        }
        let found = find_scene(&house).unwrap().unwrap();
        assert!(found.toml.contains("path = \"h/matterport_mesh/0123/0123.obj\""), "{}", found.toml);
        assert!(found.toml.contains("source = \"captures\"\npath = \"h\""), "{}", found.toml);
    }

    #[test]
    fn the_mesh_of_a_sequence_lies_beside_its_folder() {
        let dir = tempfile::tempdir().unwrap();
        let room = dir.path().join("room0");
        fs::create_dir_all(room.join("results")).unwrap();
        fs::write(room.join("traj.txt"), "").unwrap();
        assert_eq!(find_scene(&room).unwrap(), None);
        fs::write(dir.path().join("room0_mesh.ply"), "").unwrap();
        let found = find_scene(&room).unwrap().unwrap();
        assert!(found.scene.mesh[0].ends_with("../room0_mesh.ply") && found.scene.annotations.is_empty());
        assert!(found.scene.frames.unwrap().path.ends_with("traj.txt"));
    }

    #[test]
    fn photographs_of_scannetpp_stand_in_the_world_of_the_mesh_and_bad_ones_are_left_out() {
        let dir = tempfile::tempdir().unwrap();
        let at = |path: &str| dir.path().join(path);
        for folder in ["scans", "dslr/nerfstudio", "dslr/resized_images"] {
            fs::create_dir_all(at(folder)).unwrap();
        }
        fs::write(at("scans/mesh_aligned_0.05.ply"), "").unwrap();
        fs::write(at("scans/segments_anno.json"), "").unwrap();
        // As ScanNet++ writes a camera at (1, 2, 3) with the axes of the world, OpenCV's.
        let rows = "[[0, -1, 0, 2], [1, 0, 0, 1], [0, 0, 1, -3], [0, 0, 0, 1]]";
        let frame = |more: &str| format!(r#"{{"file_path": "a.JPG", "transform_matrix": {rows}{more}}}"#);
        let text = format!(
            r#"{{"fl_x": 9, "fl_y": 9, "cx": 4, "cy": 4, "w": 8, "h": 8, "frames": [{}, {}]}}"#,
            frame(""),
            frame(r#", "is_bad": true"#)
        );
        fs::write(at("dslr/nerfstudio/transforms.json"), text).unwrap();

        let frames = find_scene(dir.path()).unwrap().unwrap().scene.frames.unwrap();
        let list = read_posed_cameras(&frames.path, &frames.world_from_file).unwrap();
        assert_eq!((list.cameras.len(), list.untracked), (1, 1));
        let pose = list.cameras[0].pose;
        assert_eq!(pose.location, DVec3::new(1.0, 2.0, 3.0));
        let same = Pose::from_opencv([
            [1.0, 0.0, 0.0, 1.0],
            [0.0, 1.0, 0.0, 2.0],
            [0.0, 0.0, 1.0, 3.0],
            [0.0, 0.0, 0.0, 1.0],
        ]);
        assert!(
            pose.world_from_camera
                .abs_diff_eq(same.unwrap().world_from_camera, 1e-12)
        );
    }

    #[test]
    fn names_with_quotes_are_written_so_that_they_come_back() {
        let found = found(&[r#"a "1"\b.semantic.txt"#, r#"a "1"\b.glb"#]).unwrap();
        assert!(found.scene.mesh[0].ends_with(r#"a "1"\b.glb"#), "{}", found.toml);
    }
}
