//! Masks of photographs: what they hide is black in the photograph's view.

use crate::error::Result;
use crate::export::input::photographs::Photograph;
use s3d_geom::{Camera, Raster};
use s3d_io::Error as FileError;
use s3d_io::camera::{PosedCamera, read_picture};
use s3d_io::scene::FrameSource;
use std::path::{Component, Path, PathBuf};

/// A photograph's pixels, and those of its mask: [`SHOWN`], or black.
pub(crate) struct MaskedPicture {
    photo: Raster<[u8; 3]>,
    mask: Option<Raster<[u8; 3]>>,
}

/// The pixel of a mask that hides nothing.
const SHOWN: [u8; 3] = [255; 3];

/// Reads a mask. Each pixel becomes [`SHOWN`] or black, because programs write masks of 1, of 255, and as
/// JPEG.
fn read_mask(path: &Path, size: [u32; 2]) -> Result<Raster<[u8; 3]>> {
    let mut mask = read_picture(path)?;
    check_mask_size(path, [mask.width(), mask.height()], size)?;
    let brightest = mask.pixels().iter().map(|pixel| pixel[0]).max().unwrap_or(0);
    let least = if brightest == 1 { 1 } else { 128 };
    for pixel in mask.pixels_mut() {
        *pixel = if pixel[0] >= least { SHOWN } else { [0; 3] };
    }
    Ok(mask)
}

/// Refuses a mask of another size than its photograph.
pub(super) fn check_mask_size(path: &Path, found: [u32; 2], size: [u32; 2]) -> Result<()> {
    if found == size {
        return Ok(());
    }
    let [width, height] = found;
    let message = format!(
        "masks a picture of {width} × {height} pixels, and the photograph has {} × {}",
        size[0], size[1]
    );
    Err(FileError::format(path, message).into())
}

impl Photograph {
    /// Reads the picture. What its mask hides is black, as is all that the picture does not show.
    ///
    /// # Errors
    /// If a file cannot be read, or has another size than when the export began.
    pub(crate) fn read(&self) -> Result<MaskedPicture> {
        let photo = self.picture.read()?;
        let size = self.taken.size();
        if [photo.width(), photo.height()] != size {
            let message = "has another size than when the export began";
            return Err(FileError::format(&self.picture.path, message).into());
        }

        let mask = self.mask.as_ref().map(|path| read_mask(path, size)).transpose()?;
        Ok(MaskedPicture { photo, mask })
    }

    /// The colours of its picture as `camera` sees them.
    pub(crate) fn colors(&self, picture: &MaskedPicture, camera: &Camera) -> Raster<[u8; 3]> {
        let mut colors = self.taken.colors(&picture.photo, camera);
        let Some(mask) = &picture.mask else { return colors };
        let shown = self.taken.colors(mask, camera);
        for (color, shown) in colors.pixels_mut().iter_mut().zip(shown.pixels()) {
            if *shown != SHOWN {
                *color = [0; 3];
            }
        }
        colors
    }
}

/// Finds the mask of each photograph: in the folder of masks, or where the list says. Photographs without one
/// are shown whole, and a warning counts them if others have one, or should.
pub(super) fn find_masks(
    source: &FrameSource,
    cameras: &[PosedCamera],
    warnings: &mut Vec<String>,
) -> Vec<Option<PathBuf>> {
    let mut missing = Vec::new();
    let masks: Vec<Option<PathBuf>> = cameras
        .iter()
        .map(|camera| {
            let expected = match (&source.masks, &camera.mask) {
                (Some(folder), named) => {
                    let picture = camera.picture.as_ref().map(|picture| picture.path.as_path());
                    named_like(folder, &camera.name, picture, named.as_deref())
                }
                (None, Some(path)) => vec![path.clone()],
                (None, None) => return None,
            };
            let found = expected.iter().find(|path| path.is_file()).cloned();
            if found.is_none() {
                missing.extend(expected.into_iter().next());
            }
            found
        })
        .collect();

    if let Some(first) = missing.first() {
        warnings.push(format!(
            "{}: {} of {} photographs have no mask and are shown whole: {} is not there; masks = \"…\" \
             under [frames] names the folder",
            source.path.display(),
            missing.len(),
            cameras.len(),
            first.display()
        ));
    }
    masks
}

/// Returns the places of a photograph's mask in a folder: by its own name, or by the photograph's name with
/// its ending exchanged or kept. No name leads out of the folder, or a photograph would be its own mask.
pub(crate) fn named_like(
    folder: &Path,
    name: &str,
    picture: Option<&Path>,
    named: Option<&Path>,
) -> Vec<PathBuf> {
    let parts = Path::new(name).components();
    let name: PathBuf = parts.filter(|part| matches!(part, Component::Normal(_))).collect();
    let photo = picture.unwrap_or(&name);
    let mut names: Vec<PathBuf> = named.and_then(Path::file_name).map(PathBuf::from).into_iter().collect();
    for photo in [name.as_path(), Path::new(photo.file_name().unwrap_or_default())] {
        let mut longer = photo.as_os_str().to_owned();
        longer.push(".png");
        names.extend([photo.with_extension("png"), longer.into(), photo.to_owned()]);
    }
    names.into_iter().map(|name| folder.join(name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the places of the mask of a photograph that the list calls so.
    fn places(name: &str, named: Option<&str>) -> Vec<String> {
        let picture = PathBuf::from("scan").join(name);
        let found = named_like(Path::new("masks"), name, Some(&picture), named.map(Path::new));
        found
            .iter()
            .map(|path| path.to_string_lossy().replace('\\', "/"))
            .collect()
    }

    #[test]
    fn no_name_leads_out_of_the_folder_of_masks() {
        assert_eq!(places("a.jpg", None)[..3], ["masks/a.png", "masks/a.jpg.png", "masks/a.jpg"]);
        assert_eq!(places("hall/a.jpg", None)[0], "masks/hall/a.png");
        assert_eq!(places("a.jpg", Some("x/m.png"))[0], "masks/m.png");
        for name in ["../images/a.png", "/data/images/a.png", "./../a.png"] {
            let all = places(name, Some("/data/images/a.png"));
            assert!(
                all.iter()
                    .all(|path| path.starts_with("masks/") && !path.contains("..")),
                "{all:?}"
            );
            assert!(all.contains(&"masks/a.png".to_owned()), "{all:?}");
        }
    }
}
