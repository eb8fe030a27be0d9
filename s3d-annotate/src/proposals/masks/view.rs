//! An image of numbers, and the camera that sees what it shows.

use s3d_dataset::BarePhotograph;
use s3d_geom::glam::DVec3;
use s3d_geom::{Camera, Raster};
use s3d_io::Error as FileError;
use s3d_io::camera::check_picture;
use s3d_io::dataset::{Frame, read_pose};
use s3d_io::image::{read_gray16, read_numbers8};
use std::path::{Path, PathBuf};

type Result<T> = std::result::Result<T, FileError>;

/// Cameras cast at most so many columns: a face that is smaller than their pixels has few votes.
const MOST_COLUMNS: u32 = 2048;

/// An image of numbers, and where its camera is found.
pub(super) struct Mask<'t> {
    path: PathBuf,
    source: Source<'t>,
}

enum Source<'t> {
    Photograph(BarePhotograph<'t>),
    /// The pose file of a view of a data set, and its colours, if they are there.
    Pose(PathBuf, Option<PathBuf>),
}

/// What an image sees.
pub(super) struct View<'t> {
    /// The camera to cast: without the distortion of a lens, and upright if it is a panorama.
    pub(super) camera: Camera,
    /// The photograph whose pixels the image has; `None` if it has those of the camera.
    photograph: Option<BarePhotograph<'t>>,
    /// Width and height of the image.
    size: [u32; 2],
}

impl View<'_> {
    /// Returns the pixel of the image that shows what a pixel of the camera sees.
    pub(super) fn pixel(&self, i: u32, j: u32) -> Option<[u32; 2]> {
        let [x, y] = [i, j].map(|k| f64::from(k) + 0.5);
        let place = match self.photograph {
            Some(photograph) => photograph.place(self.camera.direction(x, y))?.to_array(),
            None => [x / f64::from(self.camera.width), y / f64::from(self.camera.height)],
        };
        let [[x, width], [y, height]] =
            [[place[0], f64::from(self.size[0])], [place[1], f64::from(self.size[1])]];
        Some([[x, width], [y, height]].map(|[share, count]| (share * count).clamp(0.0, count - 1.0) as u32))
    }
}

impl<'t> Mask<'t> {
    /// The image of a photograph.
    pub(super) fn of_photograph(path: PathBuf, photograph: BarePhotograph<'t>) -> Self {
        Self { path, source: Source::Photograph(photograph) }
    }

    /// The image of a view whose pose file lies in the folder `pose` beside its own, as in a data set.
    pub(super) fn of_pose_file(path: &Path) -> Option<Self> {
        let (stem, _) = path.file_name()?.to_str()?.split_once("_domain_")?;
        let beside = path.parent()?.parent()?;
        let pose = beside.join("pose").join(format!("{stem}_domain_pose.json"));
        let colors = beside.join("rgb").join(format!("{stem}_domain_rgb.png"));
        let colors = colors.is_file().then_some(colors);
        pose.is_file()
            .then(|| Self { path: path.to_owned(), source: Source::Pose(pose, colors) })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns what the image sees if it has this size, in a world from whose coordinates `offset_m` was
    /// subtracted.
    ///
    /// # Errors
    /// [`FileError`] for an image of another shape than its photograph or view, and for pose files that
    /// cannot be read.
    pub(super) fn view(&self, size: [u32; 2], offset_m: DVec3) -> Result<View<'t>> {
        let fault = |e: s3d_geom::CameraError| FileError::format(&self.path, e.to_string());
        let width = size[0].min(MOST_COLUMNS);
        match &self.source {
            Source::Photograph(photograph) => {
                self.check_shape(size, photograph.size(), "its photograph")?;
                let camera = photograph.camera(width).map_err(fault)?;
                Ok(View { camera, photograph: Some(*photograph), size })
            }
            Source::Pose(path, colors) => {
                let pose_file = read_pose(path)?;
                let full = colors
                    .as_deref()
                    .map_or(Ok(size), |path| check_picture(path).map(Into::into))?;
                self.check_shape(size, full, "its view")?;
                let mut pose = pose_file.pose();
                pose.location += DVec3::from_array(pose_file.world_offset_m.unwrap_or_default()) - offset_m;
                let camera = if pose_file.frame_num == Frame::Panorama {
                    self.check_shape(size, [2, 1], "a panorama")?;
                    Camera::equirectangular(pose, (width - width % 2).max(2))
                } else {
                    let height = (f64::from(full[1]) * f64::from(width) / f64::from(full[0]))
                        .round()
                        .max(1.0);
                    let scale = [f64::from(width) / f64::from(full[0]), height / f64::from(full[1])];
                    let [mut across, mut down, last] = pose_file.camera_k_matrix;
                    across.iter_mut().for_each(|k| *k *= scale[0]);
                    down.iter_mut().for_each(|k| *k *= scale[1]);
                    Camera::from_k_rt([across, down, last], pose.rt_matrix(), width, height as u32)
                        .map_err(fault)?
                };
                Ok(View { camera, photograph: None, size })
            }
        }
    }

    /// Refuses an image of another shape than a picture. Its size may be another one.
    fn check_shape(&self, found: [u32; 2], of: [u32; 2], what: &str) -> Result<()> {
        let [[w, h], [width, height]] = [found, of].map(|size| size.map(u64::from));
        if (w * height).abs_diff(h * width) <= width.max(height).max(w).max(h) {
            return Ok(());
        }
        let message =
            format!("has {w} × {h} pixels, and {what} has {width} × {height}: it needs the same shape");
        Err(FileError::format(&self.path, message))
    }
}

/// Reads an image whose pixels are numbers.
///
/// # Errors
/// [`FileError`] for files that are no such image.
pub(super) fn numbers_of(path: &Path) -> Result<Raster<u32>> {
    if let Ok(image) = read_gray16(path) {
        return Ok(image.map(u32::from));
    }
    // What this one refuses is told; it does not know of 16 bits.
    match read_numbers8(path) {
        Ok(image) => Ok(image.map(u32::from)),
        Err(FileError::Format { path, message, .. }) => {
            Err(FileError::format(&path, format!("{message}, nor 16-bit gray")))
        }
        Err(e) => Err(e),
    }
}
