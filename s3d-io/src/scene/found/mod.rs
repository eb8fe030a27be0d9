//! Scenes of known data sets, found by the files in their folder.
//!
//! A found scene is the text of a scene file, so that a person can write it down and change it. Each data set
//! is a function of [`SETS`] that looks for its own files. Sources: the READMEs of the data sets, named in
//! [`crate::formats`], "Data sets as they lie on the disk".

use crate::error::{Error, Result};
use crate::mesh::file::UpAxis;
use crate::mesh::read::MeshFormat;
use crate::scene::document::parse_scene;
use crate::scene::file::SceneFile;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

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

/// Looks for the files of a data set.
type Finder = fn(&Folder) -> Option<Parts>;

/// The data sets whose scenes are found, in the order of search: the surest names first.
const SETS: [(&str, Finder); 6] = [
    ("ScanNet++", scannetpp),
    ("Replica", replica),
    ("HM3D", hm3d),
    ("3RScan", rescan),
    ("ARKitScenes", arkit),
    ("ScanNet", scannet),
];

/// Returns the names of the data sets whose scenes [`find_scene`] finds.
pub fn found_sets() -> impl Iterator<Item = &'static str> {
    SETS.iter().map(|(set, _)| *set)
}

/// The parts of a scene: paths below its folder.
#[derive(Default)]
struct Parts {
    mesh: String,
    up: Option<UpAxis>,
    labels: Option<String>,
    frames: Option<String>,
    images: Option<String>,
    /// World from the frame of the list of photographs, if it is another one.
    turn: Option<&'static str>,
}

/// The world of ScanNet++'s mesh from the one of its `transforms.json`, where x and y are exchanged and z
/// points down. Source: scannetpp/scannetpp, common/utils/nerfstudio.py.
const SCANNETPP_TURN: &str = "[[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]";

fn scannetpp(dir: &Folder) -> Option<Parts> {
    let scans = ["scans/", ""]
        .into_iter()
        .find(|scans| dir.has(&format!("{scans}segments_anno.json")))?;
    let frames = [
        ("dslr/nerfstudio/transforms.json", "dslr/resized_images"),
        ("dslr/nerfstudio/transforms_undistorted.json", "dslr/resized_undistorted_images"),
        ("dslr/colmap", "dslr/resized_images"),
        ("iphone/colmap", "iphone/rgb"),
    ];
    let frames = frames
        .into_iter()
        .find(|(list, images)| dir.has(list) && dir.has(images));
    Some(Parts {
        mesh: dir.first(scans, |name| name.starts_with("mesh_aligned") && name.ends_with(".ply"))?,
        up: Some(UpAxis::Z),
        labels: Some(format!("{scans}segments_anno.json")),
        frames: frames.map(|(list, _)| list.to_owned()),
        images: frames.map(|(_, images)| images.to_owned()),
        turn: frames.and_then(|(list, _)| list.ends_with(".json").then_some(SCANNETPP_TURN)),
    })
}

fn replica(dir: &Folder) -> Option<Parts> {
    let habitat = ["habitat/", ""]
        .into_iter()
        .find(|place| dir.has(&format!("{place}info_semantic.json")))?;
    let mesh = format!("{habitat}mesh_semantic.ply");
    dir.has(&mesh).then(|| Parts {
        mesh,
        up: Some(UpAxis::Z),
        labels: Some(format!("{habitat}info_semantic.json")),
        ..Parts::default()
    })
}

/// The textured mesh is taken if there is one whose textures are read; `.basis.glb` has others.
fn hm3d(dir: &Folder) -> Option<Parts> {
    let labels = dir.first("", |name| name.ends_with(".semantic.txt"))?;
    let stem = labels.strip_suffix(".semantic.txt")?;
    let meshes = [format!("{stem}.glb"), format!("{stem}.semantic.glb")];
    let mesh = meshes.into_iter().find(|mesh| dir.has(mesh))?;
    Some(Parts { mesh, up: Some(UpAxis::Y), labels: Some(labels), ..Parts::default() })
}

fn rescan(dir: &Folder) -> Option<Parts> {
    let labels = dir
        .first("", |name| name == "semseg.v2.json")
        .filter(|_| dir.first("", |name| name.starts_with("labels.instances")).is_some());
    let mesh = dir.first("", |name| name.starts_with("mesh.refined") && name.ends_with(".obj"))?;
    let frames = Some("sequence".to_owned()).filter(|sequence| dir.has(sequence));
    Some(Parts { mesh, up: Some(UpAxis::Z), labels, frames, ..Parts::default() })
}

fn arkit(dir: &Folder) -> Option<Parts> {
    let trajectory = dir.first("", |name| name.ends_with(".traj"))?;
    let mesh = dir.first("", |name| name.ends_with(".ply"))?;
    let images = ["lowres_wide", "vga_wide", "wide"]
        .into_iter()
        .find(|images| dir.has(images));
    Some(Parts {
        mesh,
        up: Some(UpAxis::Z),
        labels: None,
        frames: images.map(|_| trajectory),
        images: images.map(str::to_owned),
        turn: None,
    })
}

fn scannet(dir: &Folder) -> Option<Parts> {
    let is_coarse =
        |name: &str| name.ends_with(".aggregation.json") && !name.ends_with("_vh_clean.aggregation.json");
    let labels = dir.first("", is_coarse)?;
    let mesh = dir
        .first("", |name| name.ends_with("_vh_clean_2.ply"))
        .or_else(|| dir.first("", |name| name.ends_with(".ply")))?;
    let frames = ["pose", "intrinsic", "color"]
        .iter()
        .all(|part| dir.has(part))
        .then(|| ".".to_owned());
    Some(Parts { mesh, up: Some(UpAxis::Z), labels: Some(labels), frames, ..Parts::default() })
}

impl Parts {
    fn to_toml(&self, set: &str, dir: &Folder) -> String {
        let mut text = format!("# A scene of {set}, found in its folder.\narea = 1\n[mesh]\n");
        if self.mesh.ends_with(".semantic.glb") {
            text.push_str("# Its colours are those of its labels: name a textured mesh for real ones.\n");
        }
        push_row(&mut text, "path", &self.mesh);
        if let Some(up) = self.up.filter(|_| !has_own_frame(&self.mesh)) {
            push_row(&mut text, "up", up.name());
        }

        if let Some(labels) = &self.labels {
            text.push_str("[annotations]\n");
            push_row(&mut text, "path", labels);
            // The data sets name no rooms of S3DIS's types, and many words that are none of its classes.
            push_row(&mut text, "room", dir.room());
            text.push_str("unknown_as_clutter = true\n");
        }
        if let Some(frames) = &self.frames {
            text.push_str("[frames]\n");
            push_row(&mut text, "path", frames);
            if let Some(images) = &self.images {
                push_row(&mut text, "images", images);
            }
            if let Some(turn) = self.turn {
                let _ = writeln!(text, "transform = {turn}    # the list has another world than the mesh");
            }
        }
        text
    }
}

/// Appends a key and its text.
fn push_row(text: &mut String, key: &str, value: &str) {
    let _ = writeln!(text, "{key} = {}", toml::Value::from(value));
}

/// Whether the format of a mesh says itself which axis points up.
fn has_own_frame(mesh: &str) -> bool {
    MeshFormat::of(Path::new(mesh)).is_some_and(|format| format.defines_frame)
}

/// The folder of a scene.
struct Folder {
    path: PathBuf,
}

impl Folder {
    fn new(path: &Path) -> Self {
        Self { path: path.to_owned() }
    }

    /// Whether there is a file or folder at a path below.
    fn has(&self, below: &str) -> bool {
        self.path.join(below).exists()
    }

    /// Returns the path of the first file, by name, in a folder below whose name fits.
    fn first(&self, below: &str, fits: impl Fn(&str) -> bool) -> Option<String> {
        let entries = std::fs::read_dir(self.path.join(below)).ok()?;
        let mut names: Vec<String> = entries
            .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
            .filter(|name| fits(name))
            .collect();
        names.sort();
        names.first().map(|name| format!("{below}{name}"))
    }

    /// Returns a room for a scene without names of rooms: of the type that the folder is named after.
    fn room(&self) -> &'static str {
        let path = self.path.canonicalize().unwrap_or_else(|_| self.path.clone());
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let types = [("office", "office_1"), ("conference", "conferenceRoom_1"), ("hall", "hallway_1")];
        types
            .iter()
            .find(|(word, _)| name.contains(word))
            .map_or("lounge_1", |(_, room)| room)
    }
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
                ][..],
                "ScanNet++",
                "mesh_aligned_0.05.ply",
                "segments_anno.json",
                "transforms.json",
            ),
            (
                &["mesh.ply", "habitat/mesh_semantic.ply", "habitat/info_semantic.json"],
                "Replica",
                "mesh_semantic.ply",
                "info_semantic.json",
                "",
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
                &["s_vh_clean.ply", "s_vh_clean_2.ply", "s.aggregation.json", "s_vh_clean.aggregation.json"],
                "ScanNet",
                "s_vh_clean_2.ply",
                "s.aggregation.json",
                "",
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
            let told = found.scene.frames.map_or_else(String::new, |frames| name(&frames.path));
            assert_eq!(told, frames, "{set}");
        }
        assert_eq!(found(&["scan.ply", "notes.txt"]), None);
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
