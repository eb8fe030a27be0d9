//! The data sets whose scenes are found: each looks for its own files.

use crate::mesh::file::UpAxis;
use crate::scene::found::folder::Folder;
use crate::scene::found::parts::Parts;

/// Looks for the files of a data set.
type Finder = fn(&Folder) -> Option<Parts>;

/// The data sets whose scenes are found, in the order of search: the surest names first.
pub(super) const SETS: [(&str, Finder); 7] = [
    ("ScanNet++", scannetpp),
    ("Matterport3D", matterport),
    ("Replica", replica),
    ("HM3D", hm3d),
    ("3RScan", rescan),
    ("ARKitScenes", arkit),
    ("ScanNet", scannet),
];

/// The world of ScanNet++'s mesh from the one of its `transforms.json`, where x and y are exchanged and z
/// points down. Source: scannetpp/scannetpp, common/utils/nerfstudio.py.
const SCANNETPP_TURN: &str = "[[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]";

fn scannetpp(dir: &Folder) -> Option<Parts> {
    let scans = ["scans/", ""]
        .into_iter()
        .find(|scans| dir.has(&format!("{scans}segments_anno.json")))?;
    let frames = [
        ["dslr/nerfstudio/transforms.json", "dslr/resized_images", "dslr/resized_anon_masks"],
        [
            "dslr/nerfstudio/transforms_undistorted.json",
            "dslr/resized_undistorted_images",
            "dslr/resized_undistorted_masks",
        ],
        ["dslr/colmap", "dslr/resized_images", "dslr/resized_anon_masks"],
        ["iphone/colmap", "iphone/rgb", "iphone/rgb_masks"],
    ];
    let frames = frames
        .into_iter()
        .find(|[list, images, _]| dir.has(list) && dir.has(images));
    Some(Parts {
        mesh: dir.first(scans, |name| name.starts_with("mesh_aligned") && name.ends_with(".ply"))?,
        up: Some(UpAxis::Z),
        labels: Some(format!("{scans}segments_anno.json")),
        frames: frames.map(|[list, ..]| list.to_owned()),
        images: frames.map(|[_, images, _]| images.to_owned()),
        masks: frames
            .map(|[.., masks]| masks.to_owned())
            .filter(|masks| dir.has(masks)),
        turn: frames.and_then(|[list, ..]| list.ends_with(".json").then_some(SCANNETPP_TURN)),
        ..Parts::default()
    })
}

/// A house lies in the folder, or in one of the same name in it: the archives of a house are unpacked so.
fn matterport(dir: &Folder) -> Option<Parts> {
    let places = [String::new(), format!("{}/", dir.name())];
    places.iter().find_map(|place| house(dir, place))
}

/// Finds the parts of a house in a folder below. Meshes, poses and regions are in one world, Z-up: mpview
/// shows them together as they are. Sky boxes are not taken: their front is not the heading of any camera.
fn house(dir: &Folder, place: &str) -> Option<Parts> {
    let at = |below: &str| format!("{place}{below}");
    let segmentations = at("house_segmentations/");
    let house = dir.first(&segmentations, |name| name.ends_with(".house"));
    let labelled = dir.first(&segmentations, |name| name.ends_with(".ply"));
    let textured = dir
        .folders(&at("matterport_mesh/"))
        .iter()
        .find_map(|folder| dir.first(&format!("{folder}/"), |name| name.ends_with(".obj")));
    let has_labels = |house: &&String| {
        house
            .strip_suffix(".house")
            .is_some_and(|stem| dir.has(&format!("{stem}.ply")))
    };
    let labels = house.as_ref().filter(has_labels).cloned();

    let [colors, poses, intrinsics] =
        ["color_images", "camera_poses", "camera_intrinsics"].map(|part| at(&format!("matterport_{part}")));
    let has_poses = dir.has(&poses);
    let has_captures = has_poses && dir.has(&colors) && dir.has(&intrinsics);
    let images = Some(at("undistorted_color_images")).filter(|images| dir.has(images));
    let list = dir.first(&at("undistorted_camera_parameters/"), |name| name.ends_with(".conf"));
    let (frames, images) = list.zip(images).unzip();

    Some(Parts {
        mesh: textured.or(labelled)?,
        up: Some(UpAxis::Z),
        taxonomy: labels.as_ref().map(|_| "matterport40"),
        // No region has this type.
        nowhere: labels.as_ref().map(|_| "openspace_1"),
        labels,
        cameras: if has_poses { Some(poses) } else { house },
        captures: has_captures.then(|| place.strip_suffix('/').unwrap_or(".").to_owned()),
        frames,
        images,
        ..Parts::default()
    })
}

fn replica(dir: &Folder) -> Option<Parts> {
    labelled_replica(dir).or_else(|| replica_sequence(dir))
}

fn labelled_replica(dir: &Folder) -> Option<Parts> {
    let habitat = ["habitat/", ""]
        .into_iter()
        .find(|place| dir.has(&format!("{place}info_semantic.json")))?;
    let mesh = format!("{habitat}mesh_semantic.ply");
    dir.has(&mesh).then(|| Parts {
        mesh,
        up: Some(UpAxis::Z),
        labels: Some(format!("{habitat}info_semantic.json")),
        frames: trajectory(dir),
        ..Parts::default()
    })
}

/// A sequence of NICE-SLAM: the mesh lies beside the folder, and is named after it.
fn replica_sequence(dir: &Folder) -> Option<Parts> {
    let frames = trajectory(dir).filter(|_| dir.has("results"))?;
    let name = dir.name();
    let meshes = [format!("../{name}_mesh.ply"), format!("{name}_mesh.ply")];
    let mesh = meshes.into_iter().find(|mesh| dir.has(mesh))?;
    Some(Parts { mesh, up: Some(UpAxis::Z), frames: Some(frames), ..Parts::default() })
}

/// Returns the trajectory of a sequence of Replica.
fn trajectory(dir: &Folder) -> Option<String> {
    let names = ["traj.txt", "traj_w_c.txt"];
    let name = names.into_iter().find(|name| dir.has(name))?;
    Some(name.to_owned())
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
        frames: images.map(|_| trajectory),
        images: images.map(str::to_owned),
        ..Parts::default()
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
        .then(|| ".".to_owned())
        .or_else(|| dir.first("", |name| name.ends_with(".sens")));
    Some(Parts { mesh, up: Some(UpAxis::Z), labels: Some(labels), frames, ..Parts::default() })
}
