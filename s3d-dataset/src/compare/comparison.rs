//! The differences between two data sets, as data.

use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::AddAssign;

/// Stands for the class of surface without a label. No class has this name.
pub(crate) const UNLABELLED: &str = "<UNK>";

/// Stands for the class of a pixel that sees nothing.
pub(crate) const NOTHING: &str = "<nothing>";

/// The differences between two data sets, A and B, as [`compare`](crate::compare()) returns them.
///
/// Displayed, it is the text that `s3d compare` prints; serialized, it is the JSON that `--json` writes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// Whether both hold the same data; see [`Comparison::is_equal`].
    pub equal: bool,
    /// Whether every file of both was read and compared with its checksum. Otherwise the sizes of all files
    /// were compared, and the checksums of the files that were read.
    pub full: bool,
    /// The first data set.
    pub a: ComparedSet,
    /// The second data set.
    pub b: ComparedSet,
    /// Values in the manifests, other than the input, that say the data sets were made differently.
    pub settings: Vec<SettingChange>,
    /// Files and folders of the input that differ.
    pub inputs: Vec<InputChange>,
    /// The files, by kind.
    pub files: Vec<FileKindChanges>,
    /// The changed labels of the meshes, by area.
    pub areas: Vec<AreaChanges>,
    /// The labels; `None` if neither data set has any.
    pub labels: Option<LabelChanges>,
    /// Kept candidate views, photographs and scan locations.
    pub views: ViewChanges,
    /// The images, by modality.
    pub modalities: Vec<ModalityChanges>,
    /// Images whose pixels differ, by modality. Within a modality, the largest share of differing pixels
    /// comes first.
    pub images: Vec<ImageChange>,
    /// The cameras of images that are in both data sets.
    pub poses: PoseChanges,
    /// What was not compared, or only together with something else, a sentence each.
    pub notes: Vec<String>,
    /// Files that could not be compared: they are missing, damaged, or do not hold what they should.
    pub unread: Vec<UnreadFile>,
}

impl Comparison {
    /// Whether both hold the same data: the same files with the same bytes, all present. Manifests say how
    /// the data sets were made; their differences are listed but do not count.
    pub fn is_equal(&self) -> bool {
        self.equal
    }
}

/// One of the two data sets.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ComparedSet {
    /// Its folder, as the call named it.
    pub folder: String,
    /// The version of s3d that made it.
    pub version: String,
    /// Its seed.
    pub seed: u64,
    /// The number of files, without `manifest.json` and `files.csv`.
    pub files: u64,
    /// The size of these files in bytes.
    pub bytes: u64,
    /// The numbers of its areas.
    pub areas: Vec<u32>,
    /// The taxonomy of its labels; `None` without labels.
    pub taxonomy: Option<String>,
}

/// One of the two data sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The first.
    A,
    /// The second.
    B,
}

/// A value that differs between the manifests.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SettingChange {
    /// Its key in the manifest: `seed`, `options.size`, `area 1: see`.
    pub name: String,
    /// The value in A; null if A has none.
    pub a: Value,
    /// The value in B; null if B has none.
    pub b: Value,
}

/// A file or folder of the input that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct InputChange {
    /// The area that reads it.
    pub area: u32,
    /// The path relative to the folder of the scene. The path of a folder ends with `/`.
    pub path: String,
    /// The checksum in A; `None` if it is not there.
    pub a: Option<String>,
    /// The checksum in B; `None` if it is not there.
    pub b: Option<String>,
}

/// The number of files of a kind that differ.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct FileKindChanges {
    /// A folder of an area (`data/rgb`, `3d`), or a folder or a file of the data set.
    pub kind: String,
    /// Files with the same bytes.
    pub same: u64,
    /// Files with other bytes.
    pub changed: u64,
    /// Files that only A has.
    pub only_a: u64,
    /// Files that only B has.
    pub only_b: u64,
    /// The first twenty files that are not the same, by path.
    pub first: Vec<String>,
}

/// An amount of surface, and the pixels of panoramas and views that show it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LabelCounts {
    /// Faces of the mesh.
    pub faces: u64,
    /// Their area, square metres.
    pub m2: f64,
    /// Pixels.
    pub pixels: u64,
}

impl AddAssign for LabelCounts {
    fn add_assign(&mut self, other: Self) {
        self.faces += other.faces;
        self.m2 += other.m2;
        self.pixels += other.pixels;
    }
}

/// Whether two meshes are the same apart from their labels and colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Geometry {
    /// Each face has the same corners.
    Same,
    /// The corners differ, so faces are compared by place: with the nearest surface of the other mesh.
    Other,
    /// A mesh could not be read.
    Unread,
    /// Only one data set has the area.
    OneSided,
    /// The meshes were not compared, because one or both have no labels.
    Unlabelled,
}

/// The differences between the meshes of an area.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AreaChanges {
    /// The number of the area.
    pub area: u32,
    /// Faces of A's mesh.
    pub faces_a: Option<u64>,
    /// Faces of B's mesh.
    pub faces_b: Option<u64>,
    /// Whether both meshes are the same.
    pub geometry: Geometry,
    /// The number of A's faces that belong to another instance or class in B.
    pub faces_changed: u64,
    /// Their area, square metres.
    pub m2_changed: f64,
    /// The surface of A at whose place B has no surface, square metres. Its labels are not compared.
    pub m2_only_a: f64,
    /// The surface of B at whose place A has no surface, square metres.
    pub m2_only_b: f64,
    /// A's faces that changed, by number. Not in the JSON.
    #[serde(skip)]
    pub faces: Vec<FaceChange>,
    /// The largest patches of such faces; patches with another class come first. Not in the JSON.
    #[serde(skip)]
    pub patches: Vec<ChangedPatch>,
}

/// A face of A that belongs to another instance or class in B.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FaceChange {
    /// Its index in `semantic.obj`, from 0.
    pub face: u32,
    /// The index of its label in A's `semantic_labels.json`.
    pub a: u32,
    /// The index of its label in B's `semantic_labels.json`.
    pub b: u32,
}

/// Faces with the same label in A and the same other label in B, connected by their corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ChangedPatch {
    /// The index of their label in A's `semantic_labels.json`.
    pub a: u32,
    /// The index of their label in B's `semantic_labels.json`.
    pub b: u32,
    /// The number of faces.
    pub faces: u64,
    /// Their area, square metres.
    pub m2: f64,
    /// The centre of the face that is nearest to the centre of the patch's area; world, metres.
    pub center: [f64; 3],
}

/// The differences between the labels.
///
/// Instances are matched by the surface that they share, whatever their names. So a face or pixel changed if
/// it belongs to another instance, or to the same instance of another class.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LabelChanges {
    /// The number of labels in A.
    pub a: u64,
    /// The number of labels in B.
    pub b: u64,
    /// Labels of B without a partner in A.
    pub added: Vec<String>,
    /// Labels of A without a partner in B.
    pub gone: Vec<String>,
    /// Instances that only got another number.
    pub renumbered: Vec<RenamedInstance>,
    /// Instances that only got the name of another room.
    pub other_room: Vec<RenamedInstance>,
    /// Surface and pixels that changed.
    pub changed: LabelCounts,
    /// Surface and pixels with a label of another class.
    pub class_changed: LabelCounts,
    /// What changed by class in A and in B, the largest surface first. `<UNK>` stands for no label,
    /// `<nothing>` for pixels that see nothing. Two equal classes stand for another instance of the class.
    pub matrix: Vec<ClassPair>,
    /// What became of the instances that changed. The largest surface with another class comes first.
    pub instances: Vec<InstanceChange>,
    /// For each of B's labels, by index, the index of its partner in A. Not in the JSON.
    #[serde(skip)]
    pub partners_of_b: Vec<Option<u32>>,
}

/// Surface and pixels with labels of one class in A and of another in B.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ClassPair {
    /// The class in A.
    pub a: &'static str,
    /// The class in B.
    pub b: &'static str,
    /// The amount of surface and pixels.
    #[serde(flatten)]
    pub counts: LabelCounts,
}

/// An instance with the same class in A and in B under another name.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RenamedInstance {
    /// Its label in A.
    pub a: String,
    /// Its label in B.
    pub b: String,
    /// The surface and pixels with both labels.
    #[serde(flatten)]
    pub counts: LabelCounts,
}

/// What became of an instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum InstanceChangeKind {
    /// It has another class.
    Class,
    /// It lost or gained surface or pixels.
    Extent,
    /// It became several.
    Split,
    /// Several became one.
    Merged,
    /// Several became several others.
    Regrouped,
    /// It is in A alone.
    Vanished,
    /// It is in B alone.
    Appeared,
}

/// An instance that changed, or several that share most of their surface: what they lost and gained.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct InstanceChange {
    /// What became of it.
    pub kind: InstanceChangeKind,
    /// Its labels in A, the largest surface first.
    pub a: Vec<String>,
    /// Its labels in B, the largest surface first.
    pub b: Vec<String>,
    /// Its surface in A, square metres; `None` if it is in B alone, or if meshes were not compared.
    pub m2_a: Option<f64>,
    /// Its surface in B, square metres; `None` if it is in A alone, or if meshes were not compared.
    pub m2_b: Option<f64>,
    /// What belongs to it in A, and to something else in B.
    pub lost: LabelCounts,
    /// What belongs to something else in A, and to it in B.
    pub gained: LabelCounts,
    /// What belongs to it in both, and changed its class or its part of the group.
    pub relabelled: LabelCounts,
    /// The part of these three that has another class.
    pub class_changed: LabelCounts,
}

/// A candidate view.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[non_exhaustive]
pub struct ViewName {
    /// Its area.
    pub area: u32,
    /// Its scan location.
    pub uuid: String,
    /// Its number among the location's candidate views.
    pub candidate: u32,
}

/// A scan location, or the camera of a photograph.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[non_exhaustive]
pub struct LocationName {
    /// Its area.
    pub area: u32,
    /// Its uuid.
    pub uuid: String,
}

/// The views that were kept. A view is identified by its location and its number among the location's
/// candidates.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ViewChanges {
    /// The number of views that A keeps.
    pub kept_a: u64,
    /// The number of views that B keeps.
    pub kept_b: u64,
    /// Views that A alone keeps.
    pub lost: Vec<ViewName>,
    /// Views that B alone keeps.
    pub gained: Vec<ViewName>,
    /// Views that both keep, at other angles.
    pub redrawn: Vec<ViewName>,
    /// Scan locations that A alone has.
    pub locations_lost: Vec<LocationName>,
    /// Scan locations that B alone has.
    pub locations_gained: Vec<LocationName>,
    /// Photographs that A alone has.
    pub photographs_lost: Vec<LocationName>,
    /// Photographs that B alone has.
    pub photographs_gained: Vec<LocationName>,
}

/// The differences between the images of a modality.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ModalityChanges {
    /// The modality's folder: `rgb`, `depth`.
    pub modality: &'static str,
    /// Images with the same bytes.
    pub same: u64,
    /// Images with the same pixels in other bytes.
    pub same_pixels: u64,
    /// Images of labels or classes whose pixels have other numbers, names or colours for the same.
    pub renumbered: u64,
    /// Images with other pixels.
    pub changed: u64,
    /// Images with other cameras and other bytes, whose pixels were not compared.
    pub other_pose: u64,
    /// Images with another size, unit or axes, whose pixels were not compared.
    pub other_form: u64,
    /// Images that could not be compared.
    pub unread: u64,
    /// Images that only A has.
    pub only_a: u64,
    /// Images that only B has.
    pub only_b: u64,
    /// The pixels of the images that changed.
    #[serde(flatten)]
    pub pixels: PixelChanges,
}

/// The differences between the pixels of images.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PixelChanges {
    /// The number of pixels of these images.
    pub pixels: u64,
    /// The number of pixels that differ. For labels, those that belong to another instance or class.
    pub pixels_changed: u64,
    /// For colours, the peak signal-to-noise ratio in decibels. `None` if there is no difference.
    pub psnr_db: Option<f64>,
    /// The mean difference over the pixels that see something in both. For normals it is the angle between
    /// them, degrees; for depth and world coordinates the distance, metres.
    pub mean: Option<f64>,
    /// The largest of these differences.
    pub largest: Option<f64>,
}

/// An image whose pixels differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ImageChange {
    /// The folder of its modality.
    pub modality: &'static str,
    /// Its area.
    pub area: u32,
    /// Its file in A, relative to the data set's folder.
    pub a: String,
    /// Its file in B, relative to the data set's folder.
    pub b: String,
    /// The differences between their pixels.
    #[serde(flatten)]
    pub pixels: PixelChanges,
    /// For labels, the pixels that differ by class in A and in B, at most 256 pairs. The most frequent pair
    /// comes first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<ClassPixels>,
}

/// Pixels with labels of one class in A and of another in B, named as in [`LabelChanges::matrix`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ClassPixels {
    /// The class in A.
    pub a: &'static str,
    /// The class in B.
    pub b: &'static str,
    /// The number of pixels.
    pub pixels: u64,
}

/// The differences between the poses of images that are in both data sets, without views at other angles.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PoseChanges {
    /// Poses with the same bytes.
    pub same: u64,
    /// Poses with other bytes and the same camera.
    pub same_camera: u64,
    /// Poses of other cameras. The farthest comes first.
    pub moved: Vec<PoseChange>,
    /// The largest distance between two locations, metres.
    pub largest_m: f64,
    /// The largest angle between two rotations, degrees.
    pub largest_degrees: f64,
    /// The largest difference in K between images of one size, pixels.
    pub largest_k_px: f64,
}

/// The cameras of an image.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PoseChange {
    /// Its file in A, relative to the data set's folder.
    pub a: String,
    /// Its file in B, relative to the data set's folder.
    pub b: String,
    /// The distance between both locations, metres.
    pub m: f64,
    /// The angle between both rotations, degrees.
    pub degrees: f64,
    /// The largest difference in K, pixels; `None` if the images differ in size.
    pub k_px: Option<f64>,
}

/// A file that could not be compared.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[non_exhaustive]
pub struct UnreadFile {
    /// The data set that the file belongs to.
    pub side: Side,
    /// The path relative to the data set's folder, with `/`.
    pub path: String,
    /// What is wrong with it.
    pub message: String,
}

/// Counts by pairs of labels: the label in A, then the label in B, by their numbers in
/// [`super::names::Names`].
pub(crate) type LabelPairs = BTreeMap<(u32, u32), LabelCounts>;
