//! All paths and names of the data set. Source: [`crate::formats`], "What is written".
//!
//! The usual loaders find the other files of an image by replacing `rgb` in the **whole path** by another
//! domain's name. They find its room and scan location by splitting its name at `_`. So below the root `rgb`
//! occurs in a path only for the domain (except for the meshes, `3d/rgb.obj` and its materials, which have
//! their published names), and no part of a name contains an underscore.

use crate::dataset::domain::Domain;
#[cfg(feature = "json")]
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};
use std::fmt;
use std::path::{Path, PathBuf};

/// The number of an image among the images of a scan location, or the panorama. It is `frame_…` in a file's
/// name and `frame_num` in a pose file (a number, or the word).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Frame {
    /// A perspective view, counted from 0.
    View(u32),
    /// The panorama: "equirectangular".
    Panorama,
}

const PANORAMA: &str = "equirectangular";

impl Frame {
    /// Returns the folder of an area that holds such images: "data" or "pano".
    pub fn folder(self) -> &'static str {
        match self {
            Self::View(_) => "data",
            Self::Panorama => "pano",
        }
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::View(number) => write!(f, "{number}"),
            Self::Panorama => f.write_str(PANORAMA),
        }
    }
}

#[cfg(feature = "json")]
impl Serialize for Frame {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::View(number) => serializer.serialize_u32(*number),
            Self::Panorama => serializer.serialize_str(PANORAMA),
        }
    }
}

#[cfg(feature = "json")]
impl<'de> Deserialize<'de> for Frame {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor;
        impl de::Visitor<'_> for Visitor {
            type Value = Frame;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a frame number or {PANORAMA:?}")
            }
            fn visit_u64<E: de::Error>(self, number: u64) -> Result<Frame, E> {
                let small = u32::try_from(number);
                small
                    .map(Frame::View)
                    .map_err(|_| E::invalid_value(de::Unexpected::Unsigned(number), &self))
            }
            fn visit_str<E: de::Error>(self, word: &str) -> Result<Frame, E> {
                parse_frame(word).ok_or_else(|| E::invalid_value(de::Unexpected::Str(word), &self))
            }
        }
        deserializer.deserialize_any(Visitor)
    }
}

fn parse_frame(word: &str) -> Option<Frame> {
    if word == PANORAMA {
        return Some(Frame::Panorama);
    }
    let digits = word.bytes().all(|b| b.is_ascii_digit()) && (word == "0" || !word.starts_with('0'));
    if digits {
        word.parse().ok().map(Frame::View)
    } else {
        None
    }
}

/// Returns whether `uuid` can stand in file names: 1 to 64 ASCII letters, digits and hyphens, without "rgb".
pub fn is_valid_uuid(uuid: &str) -> bool {
    (1..=64).contains(&uuid.len())
        && uuid.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'-')
        && !uuid.to_ascii_lowercase().contains("rgb")
}

/// Returns whether `room` can stand in file names: letters, an underscore and a number, as in "office_3".
pub fn is_valid_room(room: &str) -> bool {
    room.split_once('_').is_some_and(|(kind, number)| {
        let letters = !kind.is_empty() && kind.bytes().all(|b| b.is_ascii_alphabetic());
        letters && !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit())
    }) && !room.to_ascii_lowercase().contains("rgb")
}

/// Returns the name of an image without its domain: `camera_{uuid}_{roomType}_{roomNum}_frame_{frame}`.
///
/// # Panics
/// If not [`is_valid_uuid`] or not [`is_valid_room`]. Callers that read them from a file check them first.
pub fn image_stem(uuid: &str, room: &str, frame: Frame) -> String {
    assert!(is_valid_uuid(uuid), "{uuid:?} cannot stand in a file's name as a scan location");
    assert!(is_valid_room(room), "{room:?} cannot stand in a file's name as a room");
    format!("camera_{uuid}_{room}_frame_{frame}")
}

/// The parts of an image's file name.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ImageName {
    /// The scan location.
    pub uuid: String,
    /// Type and number of the room: "office_3".
    pub room: String,
    /// The number of the image among the location's images, or the panorama.
    pub frame: Frame,
    /// What the file shows.
    pub domain: Domain,
}

impl ImageName {
    /// Parses a file name (without folders). Returns `None` if it is not the name of an image or pose of the
    /// data set.
    pub fn parse(file_name: &str) -> Option<Self> {
        let (stem, domain) = file_name.split_once("_domain_")?;
        let domain = Domain::ALL.into_iter().find(|d| {
            domain.strip_prefix(d.suffix()).and_then(|rest| rest.strip_prefix('.')) == Some(d.extension())
        })?;
        let (place, frame) = stem.strip_prefix("camera_")?.split_once("_frame_")?;
        let (uuid, room) = place.split_once('_')?;
        let frame = parse_frame(frame)?;
        (is_valid_uuid(uuid) && is_valid_room(room)).then(|| Self {
            uuid: uuid.to_owned(),
            room: room.to_owned(),
            frame,
            domain,
        })
    }

    /// Returns the name without the domain. It is the same for all domains of an image.
    ///
    /// # Panics
    /// Like [`image_stem`].
    pub fn stem(&self) -> String {
        image_stem(&self.uuid, &self.room, self.frame)
    }
}

impl fmt::Display for ImageName {
    /// Writes the file name.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { uuid, room, frame, domain } = self;
        write!(f, "camera_{uuid}_{room}_frame_{frame}_domain_{}.{}", domain.suffix(), domain.extension())
    }
}

/// The loaders for which a data set may have a [profile](Layout::profile_dir).
pub const PROFILES: [&str; 4] = ["mmdet3d", "open3d-ml", "pointcept", "pointnet"];

/// The places of all files of a data set. It only makes paths: it neither reads nor creates anything.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layout {
    root: PathBuf,
}

impl Layout {
    /// Returns the layout of a data set in the folder `root`.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    /// Returns the data set's folder.
    pub fn root(&self) -> &Path {
        &self.root
    }

    /// Returns whether "rgb" occurs in the root itself. Loaders that replace it in whole paths then find
    /// nothing, which is worth a warning.
    pub fn root_misleads_loaders(&self) -> bool {
        self.root.to_string_lossy().contains("rgb")
    }

    /// Returns the entries of the folder of a data set with these areas: the folders of the areas and of
    /// their S3DIS trees, and the tables; the manifest last. Any other entry does not belong to the data set.
    pub fn entries(&self, areas: &[u32]) -> Vec<PathBuf> {
        let mut entries: Vec<PathBuf> = areas
            .iter()
            .flat_map(|a| [self.area_dir(*a), self.s3dis_area_dir(*a)])
            .collect();
        entries.extend([self.labels_json(), self.taxonomy_json(), self.utils_py()]);
        entries.extend([self.class_legend_csv(), self.class_legend_png()]);
        entries.extend([self.pose_schema(), self.manifest_schema()]);
        entries.extend([self.splits(), self.list_of_all()]);
        for fold in 1..=3 {
            entries.extend([true, false].map(|train| self.list_of_fold(fold, train)));
        }
        entries.extend(PROFILES.map(|name| self.profile_dir(name)));
        entries.extend([self.statistics_md(), self.statistics_json(), self.conventions(), self.file_list()]);
        entries.push(self.manifest());
        entries
    }

    /// Returns the folders that hold nothing but [entries](Self::entries). They can be removed when they are
    /// empty.
    pub fn shared_dirs(&self) -> Vec<PathBuf> {
        vec![self.s3dis_dir(), self.schema_dir(), self.assets_dir(), self.lists_dir(), self.profiles_dir()]
    }

    /// `area_1`
    pub fn area_dir(&self, area: u32) -> PathBuf {
        self.root.join(format!("area_{area}"))
    }

    /// `area_1/3d`: meshes, the point cloud, instances.
    pub fn mesh_dir(&self, area: u32) -> PathBuf {
        self.area_dir(area).join("3d")
    }

    /// `area_1/bundles`: images until they are packed, a bundle for each scan location and photograph. No
    /// complete data set has it.
    pub fn bundles_dir(&self, area: u32) -> PathBuf {
        self.area_dir(area).join("bundles")
    }

    /// `area_1/data/rgb` or `area_1/pano/rgb`: the folder of a domain's images.
    pub fn image_dir(&self, area: u32, frame: Frame, domain: Domain) -> PathBuf {
        self.area_dir(area).join(frame.folder()).join(domain.folder())
    }

    /// Returns the file of one domain of one image. `uuid` is the scan location, `room` is written as in
    /// "office_3".
    ///
    /// # Panics
    /// Like [`image_stem`].
    pub fn image_path(&self, area: u32, uuid: &str, room: &str, frame: Frame, domain: Domain) -> PathBuf {
        let stem = image_stem(uuid, room, frame);
        let name = format!("{stem}_domain_{}.{}", domain.suffix(), domain.extension());
        self.image_dir(area, frame, domain).join(name)
    }

    /// `area_1/3d/rgb.obj`
    pub fn rgb_obj(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("rgb.obj")
    }

    /// `area_1/3d/semantic.obj`
    pub fn semantic_obj(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("semantic.obj")
    }

    /// `area_1/3d/semantic.glb`: the textured mesh with the labels of its faces as features, on request.
    pub fn semantic_glb(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("semantic.glb")
    }

    /// `area_1/3d/pointcloud.ply`: all points of the area, labelled.
    pub fn point_cloud(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("pointcloud.ply")
    }

    /// `area_1/3d/pointcloud.mat`: the labelled points by room and object, for MATLAB.
    pub fn point_cloud_mat(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("pointcloud.mat")
    }

    /// `area_1/3d/pointcloud_boxes.json`: the box of each instance's points in the cloud.
    pub fn point_boxes_json(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("pointcloud_boxes.json")
    }

    /// `area_1/3d/instances.json`: box and voxels of each instance.
    pub fn instances_json(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("instances.json")
    }

    /// `area_1/3d/instances.npz`: the same with the points of each voxel, for numpy.
    pub fn instances_npz(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("instances.npz")
    }

    /// `area_1/3d/votes.npz`: the votes for each face, for numpy.
    pub fn votes_npz(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("votes.npz")
    }

    /// `area_1/3d/source_faces.npz`: the file and the number in it of each face, for numpy.
    pub fn source_faces_npz(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("source_faces.npz")
    }

    /// `area_1/3d/rooms.json`: floor outline, m² and wall direction of each room.
    pub fn rooms_json(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("rooms.json")
    }

    /// `area_1/3d/votes.json`: the report on the votes of points for faces.
    pub fn votes_json(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("votes.json")
    }

    /// `area_1/3d/instance_numbers.json`: the label of each instance of the annotation tree.
    pub fn instance_numbers_json(&self, area: u32) -> PathBuf {
        self.mesh_dir(area).join("instance_numbers.json")
    }

    /// `area_1/views.json`: every candidate view, its entropy, and whether it was kept.
    pub fn views_json(&self, area: u32) -> PathBuf {
        self.area_dir(area).join("views.json")
    }

    /// `area_1/pairs.npz`: the images that see the same surface, if `s3d pairs` was called.
    pub fn pairs_npz(&self, area: u32) -> PathBuf {
        self.area_dir(area).join("pairs.npz")
    }

    /// `area_1/frames.json`: every photograph that became a view.
    pub fn frames_json(&self, area: u32) -> PathBuf {
        self.area_dir(area).join("frames.json")
    }

    /// `s3dis`: the S3DIS tree.
    pub fn s3dis_dir(&self) -> PathBuf {
        self.root.join("s3dis")
    }

    /// `s3dis/Area_1`
    pub fn s3dis_area_dir(&self, area: u32) -> PathBuf {
        self.s3dis_dir().join(format!("Area_{area}"))
    }

    /// `assets`
    pub fn assets_dir(&self) -> PathBuf {
        self.root.join("assets")
    }

    /// `assets/semantic_labels.json`
    pub fn labels_json(&self) -> PathBuf {
        self.assets_dir().join("semantic_labels.json")
    }

    /// `assets/taxonomy.json`: the classes, if they are not S3DIS's.
    pub fn taxonomy_json(&self) -> PathBuf {
        self.assets_dir().join("taxonomy.json")
    }

    /// `assets/class_legend.csv`: the meaning of the numbers and colours of `semantic_class` images.
    pub fn class_legend_csv(&self) -> PathBuf {
        self.assets_dir().join("class_legend.csv")
    }

    /// `assets/class_legend.png`: the same legend to look at.
    pub fn class_legend_png(&self) -> PathBuf {
        self.assets_dir().join("class_legend.png")
    }

    /// `assets/utils.py`: functions that read every file.
    pub fn utils_py(&self) -> PathBuf {
        self.assets_dir().join("utils.py")
    }

    /// `assets/schema`
    pub fn schema_dir(&self) -> PathBuf {
        self.assets_dir().join("schema")
    }

    /// `assets/schema/pose.schema.json`: the JSON Schema of pose files.
    pub fn pose_schema(&self) -> PathBuf {
        self.schema_dir().join("pose.schema.json")
    }

    /// `assets/schema/manifest.schema.json`: the JSON Schema of the manifest.
    pub fn manifest_schema(&self) -> PathBuf {
        self.schema_dir().join("manifest.schema.json")
    }

    /// `conventions.json`: the meaning of the numbers, for programs.
    pub fn conventions(&self) -> PathBuf {
        self.root.join("conventions.json")
    }

    /// `splits`: lists of panoramas.
    pub fn lists_dir(&self) -> PathBuf {
        self.root.join("splits")
    }

    /// `splits/fold_1_train.txt` or `splits/fold_1_test.txt`: the panoramas of one side of a fold.
    pub fn list_of_fold(&self, fold: u32, train: bool) -> PathBuf {
        self.lists_dir()
            .join(format!("fold_{fold}_{}.txt", if train { "train" } else { "test" }))
    }

    /// `splits/all.txt`: all panoramas.
    pub fn list_of_all(&self) -> PathBuf {
        self.lists_dir().join("all.txt")
    }

    /// `profiles`: a folder for each loader with the files that it needs.
    pub fn profiles_dir(&self) -> PathBuf {
        self.root.join("profiles")
    }

    /// `profiles/pointnet`: the files that the loader of this name needs.
    pub fn profile_dir(&self, name: &str) -> PathBuf {
        self.profiles_dir().join(name)
    }

    /// `splits.json`: the areas to train on and the areas to test on.
    pub fn splits(&self) -> PathBuf {
        self.root.join("splits.json")
    }

    /// `manifest.json`: what was made, from what, and with which options.
    pub fn manifest(&self) -> PathBuf {
        self.root.join("manifest.json")
    }

    /// `files.csv`: all other files except the manifest, with their sizes and checksums.
    pub fn file_list(&self) -> PathBuf {
        self.root.join("files.csv")
    }

    /// `.s3d`: the state of an unfinished export. It is no [entry](Self::entries) of a data set, and is
    /// removed when the data set is complete.
    pub fn work_dir(&self) -> PathBuf {
        self.root.join(".s3d")
    }

    /// `.s3d/lock`: the process that holds its lock exports into the folder.
    pub fn lock(&self) -> PathBuf {
        self.work_dir().join("lock")
    }

    /// `.s3d/request.json`: what is exported, from what, and with which options.
    pub fn request(&self) -> PathBuf {
        self.work_dir().join("request.json")
    }

    /// `.s3d/failed`: exists if the export ended with an error that another try would not fix.
    pub fn failed(&self) -> PathBuf {
        self.work_dir().join("failed")
    }

    /// `.s3d/journal`: the work that is done, with a file for each process.
    pub fn journal_dir(&self) -> PathBuf {
        self.work_dir().join("journal")
    }

    /// `statistics.md`: counts, for people.
    pub fn statistics_md(&self) -> PathBuf {
        self.root.join("statistics.md")
    }

    /// `statistics.json`: counts, for programs.
    pub fn statistics_json(&self) -> PathBuf {
        self.root.join("statistics.json")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UUID: &str = "5c2959c3089c4ac5a7c5c913cc0df78d";

    #[test]
    fn a_published_name() {
        let path = Layout::new("root").image_path(3, UUID, "office_5", Frame::View(41), Domain::Normal);
        let name = format!("camera_{UUID}_office_5_frame_41_domain_normals.png");
        assert_eq!(path, Path::new("root/area_3/data/normal").join(&name));
        // The words that loaders take from it.
        let fields: Vec<&str> = name.split('_').collect();
        assert_eq!((fields[1], fields[2], fields[3]), (UUID, "office", "5"));

        let pano = Layout::new("root").image_path(3, UUID, "office_5", Frame::Panorama, Domain::GlobalXyz);
        let name = format!("camera_{UUID}_office_5_frame_equirectangular_domain_global_xyz.exr");
        assert_eq!(pano, Path::new("root/area_3/pano/global_xyz").join(name));
    }

    #[test]
    fn names_come_back() {
        for domain in Domain::ALL {
            for frame in [Frame::View(0), Frame::View(71), Frame::View(u32::MAX), Frame::Panorama] {
                let name = ImageName { uuid: UUID.into(), room: "copyRoom_12".into(), frame, domain };
                assert_eq!(ImageName::parse(&name.to_string()), Some(name.clone()));
                let path = Layout::new("r").image_path(1, &name.uuid, &name.room, frame, domain);
                assert_eq!(path.file_name().unwrap().to_str().unwrap(), name.to_string());
                assert!(name.to_string().starts_with(&name.stem()));
            }
            assert_eq!(domain.to_string().parse(), Ok(domain));
        }
        let e = "normals".parse::<Domain>().unwrap_err();
        assert!(e.to_string().contains("\"normals\"") && e.to_string().contains("global_xyz"));
    }

    #[test]
    fn other_names_are_refused() {
        for name in [
            "camera_a_office_3_frame_1_domain_normal.png",
            "camera_a_office_3_frame_1_domain_rgb.jpg",
            "camera_a_office_3_frame_01_domain_rgb.png",
            "camera_a_office_3_frame_+1_domain_rgb.png",
            "camera_a_office_3_frame_4294967296_domain_rgb.png",
            "camera_a_office_frame_1_domain_rgb.png",
            "camera__office_3_frame_1_domain_rgb.png",
            "camera_a_b_office_3_frame_1_domain_rgb.png",
            "camera_../a_office_3_frame_1_domain_rgb.png",
            "pose_a_office_3_frame_1_domain_rgb.png",
            "rgb.png",
            "",
        ] {
            assert_eq!(ImageName::parse(name), None, "{name}");
        }
        assert!(!is_valid_uuid("a_b") && !is_valid_uuid("aRgb1") && is_valid_uuid("5c29-59c3"));
        assert!(is_valid_uuid(&"5".repeat(64)) && !is_valid_uuid(&"5".repeat(65)));
        assert!(
            ["", "..", "a/b", "a\\b", "a\0", "/", "ä"]
                .iter()
                .all(|uuid| !is_valid_uuid(uuid))
        );
        assert!(!is_valid_room("office") && !is_valid_room("open_space_1") && is_valid_room("WC_1"));
    }

    /// A loader replaces `rgb` by another domain in the whole path, or by nothing to find the folder of the
    /// modality.
    #[test]
    fn rgb_stands_in_a_path_only_for_the_domain() {
        let layout = Layout::new("root");
        for frame in [Frame::View(3), Frame::Panorama] {
            let path = |domain| {
                let path = layout.image_path(1, UUID, "hallway_2", frame, domain);
                path.to_str().unwrap().to_owned()
            };
            let rgb = path(Domain::Rgb);
            assert_eq!(rgb.matches("rgb").count(), 2);
            for other in Domain::ALL.into_iter().filter(|&d| d != Domain::Rgb) {
                assert!(!path(other).contains("rgb"));
                let swapped = rgb
                    .replace("rgb", other.folder())
                    .replace(".png", &format!(".{}", other.extension()));
                let expected = path(other).replace(
                    &format!("_domain_{}.", other.suffix()),
                    &format!("_domain_{}.", other.folder()),
                );
                assert_eq!(swapped, expected);
            }
        }
        for path in [
            layout.area_dir(1),
            layout.mesh_dir(1),
            layout.semantic_obj(1),
            layout.semantic_glb(1),
            layout.point_cloud(1),
            layout.point_cloud_mat(1),
            layout.point_boxes_json(1),
            layout.instances_json(1),
            layout.instances_npz(1),
            layout.votes_npz(1),
            layout.source_faces_npz(1),
            layout.s3dis_area_dir(1),
            layout.labels_json(),
            layout.splits(),
            layout.list_of_all(),
            layout.list_of_fold(3, true),
            layout.profile_dir(PROFILES[0]),
            layout.conventions(),
            layout.utils_py(),
            layout.pose_schema(),
            layout.manifest_schema(),
            layout.manifest(),
            layout.file_list(),
            layout.request(),
            layout.journal_dir(),
            layout.statistics_md(),
            layout.statistics_json(),
        ] {
            assert!(!path.to_str().unwrap().contains("rgb"), "{}", path.display());
        }
        assert!(layout.rgb_obj(1).ends_with("3d/rgb.obj"));
        assert!(!layout.root_misleads_loaders() && Layout::new("/data/rgbd").root_misleads_loaders());
    }

    #[test]
    fn frames_are_numbers_or_the_word_in_json() {
        for (frame, json) in [(Frame::View(7), "7"), (Frame::Panorama, "\"equirectangular\"")] {
            assert_eq!(serde_json::to_string(&frame).unwrap(), json);
            assert_eq!(serde_json::from_str::<Frame>(json).unwrap(), frame);
        }
        assert_eq!(serde_json::from_str::<Frame>("\"12\"").unwrap(), Frame::View(12));
        let e = serde_json::from_str::<Frame>("-1").unwrap_err().to_string();
        assert!(e.contains("a frame number or \"equirectangular\""), "{e}");
    }
}
