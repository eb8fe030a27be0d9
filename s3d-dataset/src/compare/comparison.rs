//! What differs between two data sets, as data.

use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::ops::AddAssign;

/// What stands for the class of surface without a label; no class has such a name.
pub(crate) const UNLABELLED: &str = "<UNK>";

/// What stands for the class of a pixel that sees nothing.
pub(crate) const NOTHING: &str = "<nothing>";

/// What differs between two data sets, A and B: what [`compare`](crate::compare()) returns.
///
/// Displayed, it is the text that `s3d compare` prints; serialized, the JSON that `--json` writes.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    /// Whether both hold the same data; see [`Comparison::is_equal`].
    pub equal: bool,
    /// Whether every file of both was read and held against its checksum. Otherwise the sizes of all were,
    /// and the checksums of those that were read.
    pub full: bool,
    /// The first.
    pub a: ComparedSet,
    /// The second.
    pub b: ComparedSet,
    /// What the manifests tell differently of how the data sets were made, but for the input.
    pub settings: Vec<SettingChange>,
    /// Files and folders of the input that differ.
    pub inputs: Vec<InputChange>,
    /// The files, by kind.
    pub files: Vec<FileKindChanges>,
    /// The meshes, by area; what differs of their labels.
    pub areas: Vec<AreaChanges>,
    /// The labels; `None` if neither has some.
    pub labels: Option<LabelChanges>,
    /// Candidate views that were kept, photographs and scan locations.
    pub views: ViewChanges,
    /// The images, by modality.
    pub modalities: Vec<ModalityChanges>,
    /// Images whose pixels differ: by modality those with the largest share of such pixels first.
    pub images: Vec<ImageChange>,
    /// The cameras of images that are in both.
    pub poses: PoseChanges,
    /// What was not compared, or otherwise than by itself, a sentence each.
    pub notes: Vec<String>,
    /// What could not be compared: files that are missing, damaged, or do not hold what they should.
    pub unread: Vec<UnreadFile>,
}

impl Comparison {
    /// Whether both hold the same data: the same files with the same bytes, all of which are there. Manifests
    /// tell how they were made; what differs there is listed, and decides nothing.
    pub fn is_equal(&self) -> bool {
        self.equal
    }
}

/// One of the two.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ComparedSet {
    /// Its folder, as the call named it.
    pub folder: String,
    /// The version of s3d that made it.
    pub version: String,
    /// Its seed.
    pub seed: u64,
    /// Files but `manifest.json` and `files.csv`.
    pub files: u64,
    /// Their bytes.
    pub bytes: u64,
    /// The numbers of its areas.
    pub areas: Vec<u32>,
    /// The taxonomy of its labels; `None` if it has none.
    pub taxonomy: Option<String>,
}

/// Which of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Side {
    /// The first.
    A,
    /// The second.
    B,
}

/// A value of the manifests that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct SettingChange {
    /// Its key in the manifest: `seed`, `options.size`, `area 1: see`.
    pub name: String,
    /// Null if it is not there.
    pub a: Value,
    /// Likewise.
    pub b: Value,
}

/// A file or folder of the input that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct InputChange {
    /// The area that it is the input of.
    pub area: u32,
    /// From the folder of the scene; that of a folder ends with `/`.
    pub path: String,
    /// Its checksum; `None` if it is not there.
    pub a: Option<String>,
    /// Likewise.
    pub b: Option<String>,
}

/// How many files of a kind differ.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct FileKindChanges {
    /// The folder of an area that they are in (`data/rgb`, `3d`), a folder or a file of the data set.
    pub kind: String,
    /// Those with the same bytes.
    pub same: u64,
    /// Those with other bytes.
    pub changed: u64,
    /// Those that only A has.
    pub only_a: u64,
    /// Those that only B has.
    pub only_b: u64,
    /// The first twenty of those that are not the same, by path.
    pub first: Vec<String>,
}

/// So much surface, and so many pixels of panoramas and views that show it.
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

/// Whether two meshes are the same, but for their labels and colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Geometry {
    /// Each face has the same corners.
    Same,
    /// They differ: their faces cannot be compared.
    Other,
    /// A mesh could not be read.
    Unread,
    /// Only one has the area.
    OneSided,
    /// The meshes were not needed: one or both have no labels.
    Unlabelled,
}

/// What differs between the meshes of an area.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AreaChanges {
    /// Its number.
    pub area: u32,
    /// Faces of A's mesh.
    pub faces_a: Option<u64>,
    /// Faces of B's mesh.
    pub faces_b: Option<u64>,
    /// Whether they are the same.
    pub geometry: Geometry,
    /// Faces with another label.
    pub faces_changed: u64,
    /// Their area, square metres.
    pub m2_changed: f64,
    /// Which they are, by number. Not in the JSON.
    #[serde(skip)]
    pub faces: Vec<FaceChange>,
    /// Where they lie: the largest patches, those of another class first. Not in the JSON.
    #[serde(skip)]
    pub patches: Vec<ChangedPatch>,
}

/// A face with another label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct FaceChange {
    /// Its place in `semantic.obj`, from 0.
    pub face: u32,
    /// Its label's index in A's `semantic_labels.json`.
    pub a: u32,
    /// The same in B's.
    pub b: u32,
}

/// Faces that changed from one label to another and hang together by their corners.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ChangedPatch {
    /// The index of their label in A's `semantic_labels.json`.
    pub a: u32,
    /// The same in B's.
    pub b: u32,
    /// How many they are.
    pub faces: u64,
    /// Their area, square metres.
    pub m2: f64,
    /// The centre of the face that is nearest to the centre of their area; world, metres.
    pub center: [f64; 3],
}

/// What differs between the labels. They are compared by their names; their indices may be others.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LabelChanges {
    /// How many A has.
    pub a: u64,
    /// How many B has.
    pub b: u64,
    /// Those that only B has.
    pub added: Vec<String>,
    /// Those that only A has.
    pub gone: Vec<String>,
    /// What has another label, of the same class or of another.
    pub changed: LabelCounts,
    /// What has a label of another class.
    pub class_changed: LabelCounts,
    /// What has another label, by class in A and in B, the largest surface first: `<UNK>` stands for no
    /// label, `<nothing>` for pixels that see nothing. Two equal classes stand for another instance of it.
    pub matrix: Vec<ClassPair>,
    /// The fifty instances that changed most: first those with the largest surface of another class.
    pub instances: Vec<InstanceChange>,
}

/// What has labels of one class in A, and of one in B.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ClassPair {
    /// The class in A.
    pub a: &'static str,
    /// The class in B.
    pub b: &'static str,
    /// How much of it.
    #[serde(flatten)]
    pub counts: LabelCounts,
}

/// What an instance lost and gained.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct InstanceChange {
    /// Its label.
    pub name: String,
    /// What has it in A alone.
    pub lost: LabelCounts,
    /// What has it in B alone.
    pub gained: LabelCounts,
    /// What of both is of another class on the other side.
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
    /// Which of the location's candidate views it is.
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

/// Which views were kept. A view is what its location and its number among the location's candidates name.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ViewChanges {
    /// How many A keeps.
    pub kept_a: u64,
    /// How many B keeps.
    pub kept_b: u64,
    /// Those that A keeps alone.
    pub lost: Vec<ViewName>,
    /// Those that B keeps alone.
    pub gained: Vec<ViewName>,
    /// Those that both keep, at other angles.
    pub redrawn: Vec<ViewName>,
    /// Scan locations that A has alone.
    pub locations_lost: Vec<LocationName>,
    /// Scan locations that B has alone.
    pub locations_gained: Vec<LocationName>,
    /// Photographs that A has alone.
    pub photographs_lost: Vec<LocationName>,
    /// Photographs that B has alone.
    pub photographs_gained: Vec<LocationName>,
}

/// What differs between the images of a modality.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct ModalityChanges {
    /// Its folder: `rgb`, `depth`.
    pub modality: &'static str,
    /// Images with the same bytes.
    pub same: u64,
    /// Images with the same pixels in other bytes.
    pub same_pixels: u64,
    /// Images with other pixels.
    pub changed: u64,
    /// Images of other cameras, with other bytes: their pixels were not compared.
    pub other_pose: u64,
    /// Images of another size, in other units or axes: their pixels were not compared.
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

/// How the pixels of images differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PixelChanges {
    /// All pixels of these images.
    pub pixels: u64,
    /// Those that differ.
    pub pixels_changed: u64,
    /// Of colours: the peak signal-to-noise ratio, decibels. `None` if there is no difference.
    pub psnr_db: Option<f64>,
    /// Of normals the angle between them, degrees; of depth and world coordinates the distance, metres: the
    /// mean over the pixels that see something in both.
    pub mean: Option<f64>,
    /// The largest of them.
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
    /// Its file in A, from the data set's folder.
    pub a: String,
    /// Its file in B.
    pub b: String,
    /// How they differ.
    #[serde(flatten)]
    pub pixels: PixelChanges,
    /// Of labels: the pixels that differ by class in A and in B, the most first; at most 256 pairs.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<ClassPixels>,
}

/// Pixels with labels of one class in A, and of one in B, named as in [`LabelChanges::matrix`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[non_exhaustive]
pub struct ClassPixels {
    /// The class in A.
    pub a: &'static str,
    /// The class in B.
    pub b: &'static str,
    /// How many they are.
    pub pixels: u64,
}

/// What differs between the poses of images that are in both, but for views at other angles.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct PoseChanges {
    /// Poses with the same bytes.
    pub same: u64,
    /// Poses with other bytes and the same camera.
    pub same_camera: u64,
    /// Poses of other cameras: the farthest first.
    pub moved: Vec<PoseChange>,
    /// The largest difference of places, metres.
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
    /// Its file in A, from the data set's folder.
    pub a: String,
    /// Its file in B.
    pub b: String,
    /// The distance between both, metres.
    pub m: f64,
    /// The angle between both rotations, degrees.
    pub degrees: f64,
    /// The largest difference in K, pixels; `None` if the images have other sizes.
    pub k_px: Option<f64>,
}

/// A file that could not be compared.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[non_exhaustive]
pub struct UnreadFile {
    /// Whose file it is.
    pub side: Side,
    /// From the data set's folder, with `/`.
    pub path: String,
    /// What is wrong with it.
    pub message: String,
}

/// Counts by pairs of labels, as A and B name them together; see [`super::names::Names`].
pub(crate) type LabelPairs = BTreeMap<(u32, u32), LabelCounts>;
