//! Photographs with poses: found, each with its lens and the camera of its view, before anything is written.

use crate::error::{Error, Result};
use crate::export::input::masks::{check_mask_size, find_masks};
use glam::{DAffine3, DVec3};
use rayon::prelude::*;
use s3d_geom::{Camera, CameraError, PhotoLens, Pose, Raster};
use s3d_io::Error as FileError;
use s3d_io::camera::{
    IntrinsicsError, PictureFile, PosedCamera, PosedCameras, ScanLocation, check_picture,
    read_photograph_cameras, uuid_from_name,
};
use s3d_io::dataset::Frame;
use s3d_io::scene::FrameSource;
use s3d_render::{level_panorama, undistort};
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

/// How many missing photographs a message names.
const MAX_NAMED: usize = 20;

/// The endings that a name in a list may lack.
const ENDINGS: [&str; 6] = ["jpg", "png", "jpeg", "JPG", "PNG", "JPEG"];

/// The frame of a photograph's view, the only view of its camera.
const VIEW: Frame = Frame::View(0);

/// An area's photographs.
#[derive(Default)]
pub(crate) struct Photographs {
    /// In the order of their lists.
    pub(crate) all: Vec<Photograph>,
    /// What the log says of them, a sentence each.
    pub(crate) notes: Vec<String>,
    /// What was odd about them, a sentence each.
    pub(crate) warnings: Vec<String>,
    /// The lists that they come from, each with its files. A list may be a folder that holds much else.
    lists: Vec<(PathBuf, Vec<PathBuf>)>,
}

/// A photograph and its view.
#[derive(Clone, Debug)]
pub(crate) struct Photograph {
    /// What the list calls it.
    pub(crate) name: String,
    /// The uuid of its view's camera.
    pub(crate) uuid: String,
    pub(crate) picture: PictureFile,
    /// Hides parts of the picture.
    pub(crate) mask: Option<PathBuf>,
    pub(crate) taken: Taken,
    /// The camera of its view: a pinhole, or a panorama.
    pub(crate) camera: Camera,
}

/// How a photograph was taken.
#[derive(Clone, Debug)]
pub(crate) enum Taken {
    /// Through a lens, in the photograph's own pixels.
    Lens(PhotoLens),
    /// As a panorama, which may be tilted.
    Panorama {
        /// Width and height of the photograph.
        size: [u32; 2],
        pose: Pose,
    },
}

impl Taken {
    /// Finds out how `posed` was taken. The photograph has `size` pixels.
    fn of(posed: &PosedCamera, offset_m: DVec3, size: [u32; 2]) -> Result<Self, IntrinsicsError> {
        if !posed.is_panorama() {
            return posed.photo_lens(size).map(Self::Lens);
        }

        let [width, height] = size;
        if width.abs_diff(height.saturating_mul(2)) > 1 || width < 2 {
            return Err(IntrinsicsError::PanoramaSize { width, height });
        }
        let mut pose = posed.pose;
        pose.location -= offset_m;
        Ok(Self::Panorama { size, pose })
    }

    /// The width and height of the photograph.
    pub(crate) fn size(&self) -> [u32; 2] {
        match self {
            Self::Lens(lens) => lens.size(),
            Self::Panorama { size, .. } => *size,
        }
    }

    /// The frame of the photograph's image.
    pub(crate) fn frame(&self) -> Frame {
        match self {
            Self::Lens(_) => VIEW,
            Self::Panorama { .. } => Frame::Panorama,
        }
    }

    /// A camera of about this width for the photograph's image. Panoramas are level, and their width is even.
    pub(crate) fn camera(&self, pose: Pose, width: u32) -> Result<Camera, CameraError> {
        match self {
            Self::Lens(lens) => lens.pinhole(pose, width),
            Self::Panorama { .. } => Ok(Camera::equirectangular(pose.leveled(), (width - width % 2).max(2))),
        }
    }

    /// The colours of the photograph as `camera` sees them.
    pub(super) fn colors(&self, photo: &Raster<[u8; 3]>, camera: &Camera) -> Raster<[u8; 3]> {
        match self {
            Self::Lens(lens) => undistort(photo, lens, camera),
            Self::Panorama { pose, .. } => level_panorama(photo, pose, camera),
        }
    }
}

impl Photographs {
    /// Finds the photographs that a scene of this area names. `offset_m` is subtracted from their places.
    ///
    /// # Errors
    /// If photographs are missing, with all of them; for the first whose camera or size is not as it should
    /// be.
    pub(crate) fn open(source: &FrameSource, area: u32, offset_m: DVec3) -> Result<Self> {
        let PosedCameras { cameras, untracked, files } =
            read_photograph_cameras(&source.path, source.images.as_deref(), &source.world_from_file)?;
        let listed = cameras.len();
        let list = &source.path;

        let mut notes = Vec::new();
        if untracked > 0 {
            notes.push(format!(
                "{}: {untracked} of {} photographs are left out: the list does not know their poses",
                list.display(),
                listed + untracked
            ));
        }

        let chosen = choose(cameras, source);
        notes.push(format!("{}: {} of {listed} photographs are taken", list.display(), chosen.len()));

        let mut names = HashSet::new();
        if let Some(twice) = chosen.iter().find(|camera| !names.insert(camera.name.as_str())) {
            return Err(camera_error(
                list,
                twice,
                "is listed twice: each photograph needs a name of its own".into(),
            ));
        }

        let pictures = find(source, &chosen)?;
        let mut warnings = Vec::new();
        let masks = find_masks(source, &chosen, &mut warnings);
        // The first fault in the order of the list is reported, whichever thread finds its own first.
        let opened: Vec<Result<_>> = chosen
            .par_iter()
            .zip(pictures)
            .zip(masks)
            .map(|((posed, picture), mask)| open_one(source, area, offset_m, posed, picture, mask))
            .collect();
        let found: Vec<(Photograph, u8)> = opened.into_iter().collect::<Result<_>>()?;

        let masked = found.iter().filter(|(photograph, _)| photograph.mask.is_some()).count();
        if masked > 0 {
            notes.push(format!("{}: {masked} photographs have masks", list.display()));
        }
        let turned = found.iter().filter(|(_, turn)| *turn != 1).count();
        if let Some((first, turn)) = found.iter().find(|(_, turn)| *turn != 1) {
            warnings.push(format!(
                "{turned} photographs ask to be turned when they are shown ({}: EXIF orientation {turn}): \
                 they are taken as \
                 they are stored, which is what the sizes of their cameras fit",
                first.picture
            ));
        }

        let all = found.into_iter().map(|(photograph, _)| photograph).collect();
        Ok(Self { all, notes, warnings, lists: vec![(list.clone(), files)] })
    }

    /// Adds the photographs of another part of the area `area`, moved to the world of the scene. A name that
    /// is taken gets the number of the part in front.
    pub(super) fn append(&mut self, part: Self, scene_from_part: &DAffine3, area: u32, number: usize) {
        let names: HashSet<String> = self.all.iter().map(|photograph| photograph.name.clone()).collect();
        for mut photograph in part.all {
            if names.contains(&photograph.name) {
                photograph.name = format!("part_{number}/{}", photograph.name);
            }
            photograph.uuid = uuid_of(area, &photograph.name);
            photograph.move_by(scene_from_part);
            self.all.push(photograph);
        }
        self.notes.extend(part.notes);
        self.warnings.extend(part.warnings);
        self.lists.extend(part.lists);
    }

    /// Where they were taken, as a list of locations.
    pub(crate) fn locations(&self) -> Vec<ScanLocation> {
        self.all
            .iter()
            .map(|p| ScanLocation { uuid: p.uuid.clone(), pose: p.camera.pose, line: 0 })
            .collect()
    }

    /// All files that are read for the photographs. A picture that is a part of a file is a part of the list.
    pub(crate) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        let pictures = self
            .all
            .iter()
            .filter(|photograph| photograph.picture.part.is_none())
            .map(|photograph| &photograph.picture.path);
        let masks = self.all.iter().filter_map(|photograph| photograph.mask.as_ref());
        let of_lists = self.lists.iter().flat_map(|(_, files)| files);
        of_lists.chain(pictures).chain(masks)
    }

    /// The same files by folder. A file of the list belongs to the list, whether that is a folder or a file;
    /// any other file belongs to its own folder.
    pub(crate) fn by_folder(&self) -> BTreeMap<PathBuf, Vec<PathBuf>> {
        let mut folders: BTreeMap<PathBuf, Vec<PathBuf>> = BTreeMap::new();
        for file in self.files() {
            let list = self.lists.iter().find(|(list, _)| file.starts_with(list));
            let folder = list.map_or(file.parent().unwrap_or(Path::new("")), |(list, _)| list);
            folders.entry(folder.to_owned()).or_default().push(file.clone());
        }
        folders
    }
}

impl Photograph {
    fn move_by(&mut self, by: &DAffine3) {
        let pose = &mut self.camera.pose;
        *pose = match &mut self.taken {
            Taken::Lens(_) => pose.moved(by),
            Taken::Panorama { pose, .. } => {
                *pose = pose.moved(by);
                pose.leveled()
            }
        };
    }
}

/// The uuid of the view of an area's photograph.
fn uuid_of(area: u32, name: &str) -> String {
    uuid_from_name(&format!("area_{area}/{name}"))
}

/// Takes one photograph of every `source.every`, and of these at most `source.max`, evenly spread.
fn choose(cameras: Vec<PosedCamera>, source: &FrameSource) -> Vec<PosedCamera> {
    let mut chosen: Vec<PosedCamera> = cameras.into_iter().step_by(source.every.get() as usize).collect();
    let count = chosen.len();
    let most = source.max.map_or(usize::MAX, |max| max.get() as usize);
    if count > most {
        let mut kept = vec![false; count];
        (0..most).for_each(|i| kept[i * count / most] = true);
        let mut kept = kept.into_iter();
        chosen.retain(|_| kept.next().unwrap_or(false));
    }
    chosen
}

/// An error about a camera of a list.
pub(crate) fn camera_error(list: &Path, camera: &PosedCamera, message: String) -> Error {
    let message = format!("{:?}: {message}", camera.name);
    match camera.line {
        0 => FileError::format(list, message),
        line => FileError::line(list, line, message),
    }
    .into()
}

/// Finds the file of each photograph.
fn find(source: &FrameSource, cameras: &[PosedCamera]) -> Result<Vec<PictureFile>> {
    let mut found = Vec::new();
    let mut missing = Vec::new();

    for camera in cameras {
        let candidates: Vec<PathBuf> = match (&source.images, &camera.picture) {
            (Some(folder), picture) => {
                let name = Path::new(&camera.name);
                let of_picture = picture.as_ref().and_then(|picture| picture.path.file_name());
                let last = of_picture.or(name.file_name()).unwrap_or_default();
                vec![folder.join(name), folder.join(last)]
            }
            (None, Some(picture)) if picture.part.is_some() => {
                found.push(picture.clone());
                continue;
            }
            (None, Some(picture)) => vec![picture.path.clone()],
            (None, None) => Vec::new(),
        };

        if candidates.is_empty() && source.images.is_none() {
            let message =
                "no photograph was found for it: say which folder they are in: images = \"…\" in [frames]";
            return Err(camera_error(&source.path, camera, message.into()));
        }

        match candidates.iter().find_map(|path| with_ending(path)) {
            Some(path) => found.push(path.into()),
            None => missing.push(
                candidates
                    .first()
                    .map_or_else(String::new, |path| path.display().to_string()),
            ),
        }
    }

    if missing.is_empty() {
        return Ok(found);
    }

    let count = missing.len();
    let more = count.saturating_sub(MAX_NAMED);
    missing.truncate(MAX_NAMED);
    let mut names = missing.join(", ");
    if more > 0 {
        names += &format!(" and {more} more");
    }

    let message = format!(
        "{count} of {} photographs are not there: {names}; images = \"…\" under [frames] names another \
         folder",
        cameras.len()
    );
    Err(FileError::format(&source.path, message).into())
}

/// Finds the file of this name, which may lack its ending.
fn with_ending(path: &Path) -> Option<PathBuf> {
    let mut names = vec![path.to_owned()];
    for ending in ENDINGS {
        let mut name = path.as_os_str().to_owned();
        name.push(".");
        name.push(ending);
        names.push(PathBuf::from(name));
    }
    names.into_iter().find(|path| path.is_file())
}

/// Opens a photograph, and makes the camera of its view. Returns its EXIF orientation too.
fn open_one(
    source: &FrameSource,
    area: u32,
    offset_m: DVec3,
    posed: &PosedCamera,
    picture: PictureFile,
    mask: Option<PathBuf>,
) -> Result<(Photograph, u8)> {
    let (width, height) = picture.check()?;
    let turn = picture.turn()?;
    if let Some(mask) = &mask {
        let (mask_width, mask_height) = check_picture(mask)?;
        check_mask_size(mask, [mask_width, mask_height], [width, height])?;
    }

    let taken = Taken::of(posed, offset_m, [width, height]).map_err(|e| match e {
        IntrinsicsError::NoOptics => camera_error(
            &source.path,
            posed,
            format!(
                "{e}: photographs need fl_x or camera_angle_x in a transforms.json, a COLMAP model's \
                     cameras, ScanNet's \
                     intrinsic/intrinsic_color.txt, or fx or fov in a table"
            ),
        ),
        // Orientations from 5 lay a picture on its side.
        IntrinsicsError::OtherSize { told, .. } if turn >= 5 && posed.photo_lens([height, width]).is_ok() => {
            let message = format!(
                "is stored with {width} × {height} pixels, to be turned when it is shown (EXIF orientation \
                 {turn}), and its \
                 camera is for {} × {}: store it upright, as `mogrify -auto-orient` does",
                told[0], told[1]
            );
            FileError::format(&picture.path, message).into()
        }
        IntrinsicsError::OtherSize { .. } | IntrinsicsError::PanoramaSize { .. } => {
            FileError::format(&picture.path, e.to_string()).into()
        }
        _ => camera_error(&source.path, posed, e.to_string()),
    })?;

    let mut pose = posed.pose;
    pose.location -= offset_m;
    let camera = taken
        .camera(pose, source.width.unwrap_or(width))
        .map_err(|e| camera_error(&source.path, posed, e.to_string()))?;

    let name = posed.name.clone();
    let uuid = uuid_of(area, &name);
    Ok((Photograph { name, uuid, picture, mask, taken, camera }, turn))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::Pose;
    use std::num::NonZeroU32;

    fn source(every: u32, max: Option<u32>) -> FrameSource {
        FrameSource {
            path: PathBuf::from("list"),
            images: None,
            masks: None,
            world_from_file: DAffine3::IDENTITY,
            every: NonZeroU32::new(every).unwrap(),
            max: max.and_then(NonZeroU32::new),
            width: None,
        }
    }

    /// Returns the chosen ones of ten cameras, which are named 0 to 9.
    fn chosen(every: u32, max: Option<u32>) -> Vec<String> {
        let pose = Pose::level(DVec3::ZERO, 0.0);
        let cameras = (0..10).map(|i| PosedCamera::new(i.to_string(), pose));
        choose(cameras.collect(), &source(every, max))
            .into_iter()
            .map(|c| c.name)
            .collect()
    }

    #[test]
    fn photographs_are_chosen_evenly() {
        assert_eq!(chosen(1, None).len(), 10);
        assert_eq!(chosen(4, None), ["0", "4", "8"]);
        assert_eq!(chosen(1, Some(3)), ["0", "3", "6"]);
        assert_eq!(chosen(2, Some(2)), ["0", "4"]);
        assert_eq!(chosen(5, Some(7)), ["0", "5"]);
    }
}
