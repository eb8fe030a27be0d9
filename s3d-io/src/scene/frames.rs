//! The table `[frames]` of a `scene.toml`.

use crate::error::Result;
use crate::mesh::file::UpAxis;
use crate::scene::cameras::similarity;
use crate::scene::folder::SceneFolder;
use s3d_geom::glam::DAffine3;
use serde::Deserialize;
use std::num::NonZeroU32;
use std::path::PathBuf;

/// A list of photographs with poses. Each photograph becomes a view.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSource {
    /// The list. It is read by [`read_posed_cameras`](crate::camera::read_posed_cameras).
    pub path: PathBuf,
    /// The folder of the pictures that the list names. `None`: where the form of the list expects them.
    pub images: Option<PathBuf>,
    /// The folder of the masks: for each picture one of the same name, or with another ending. `None`: the
    /// masks that the list names, if there are some.
    pub masks: Option<PathBuf>,
    /// The transform from the list's frame to the world (metres, Z-up): a rotation, a shift and a scale.
    pub world_from_file: DAffine3,
    /// The step through the list: 1 takes every photograph, 2 every second, starting with the first.
    pub every: NonZeroU32,
    /// The largest number of photographs. If there are more after `every`, some are taken, evenly spread.
    pub max: Option<NonZeroU32>,
    /// The width of the views in pixels. `None`: the width of the photographs. The height follows.
    pub width: Option<u32>,
}

/// The widths that views of photographs may have, pixels.
const WIDTHS: std::ops::RangeInclusive<u32> = 8..=16_384;

/// The table as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FramesTable {
    path: PathBuf,
    images: Option<PathBuf>,
    masks: Option<PathBuf>,
    up: Option<UpAxis>,
    transform: Option<[[f64; 4]; 4]>,
    every: Option<NonZeroU32>,
    max: Option<NonZeroU32>,
    width: Option<u32>,
}

impl FramesTable {
    /// Returns the source that the table describes. Its files are looked up in `folder`.
    ///
    /// # Errors
    /// [`Error::Format`](crate::Error::Format) for the scene file if a file does not exist or a value is
    /// wrong.
    pub(crate) fn source(self, folder: SceneFolder<'_>) -> Result<FrameSource> {
        let Self { path, images, masks, up, transform, every, max, width } = self;
        let fault = |message: String| folder.fault(format!("[frames]: {message}"));
        if let Some(width) = width.filter(|width| !WIDTHS.contains(width)) {
            let least = WIDTHS.start();
            let most = WIDTHS.end();
            return Err(fault(format!("width = {width}: must be from {least} to {most} pixels")));
        }

        let given = transform.map_or(Ok(DAffine3::IDENTITY), similarity).map_err(fault)?;
        let world_from_file = given * DAffine3::from_mat3(up.unwrap_or(UpAxis::Z).rotation());
        let path = folder.any("frames.path", &path)?;
        let images = images
            .map(|images| folder.folder("frames.images", &images))
            .transpose()?;
        let masks = masks.map(|masks| folder.folder("frames.masks", &masks)).transpose()?;
        let every = every.unwrap_or(NonZeroU32::MIN);
        Ok(FrameSource { path, images, masks, world_from_file, every, max, width })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse_scene;
    use s3d_geom::glam::DVec3;
    use std::fs;

    fn frames(table: &str) -> Result<FrameSource> {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a.obj"), "").unwrap();
        fs::write(dir.path().join("c.csv"), "").unwrap();
        ["raw", "photos"]
            .iter()
            .for_each(|name| fs::create_dir(dir.path().join(name)).unwrap());
        let text = format!("area = 2\n[mesh]\npath = \"a.obj\"\n[frames]\n{table}");
        parse_scene(&text, &dir.path().join("scene.toml")).map(|scene| scene.frames.unwrap())
    }

    #[test]
    fn photographs_are_listed_beside_the_mesh() {
        let plain = frames("path = \"c.csv\"\n").unwrap();
        assert!(plain.path.ends_with("c.csv") && plain.images.is_none() && plain.max.is_none());
        assert_eq!((plain.every.get(), plain.width, plain.world_from_file), (1, None, DAffine3::IDENTITY));
        let keys = "path = \"raw\"\nimages = \"photos\"\nmasks = \"raw\"\nup = \"y\"\nevery = 7\nmax = 3\n\
                    width = 640\n";
        let all = frames(keys).unwrap();
        assert!(all.images.unwrap().ends_with("photos") && all.masks.unwrap().ends_with("raw"));
        assert_eq!((all.every.get(), all.max.unwrap().get(), all.width), (7, 3, Some(640)));
        assert_eq!(all.world_from_file.transform_vector3(DVec3::Y), DVec3::Z);

        for (table, words) in [
            ("path = \"gone\"", "frames.path = \"gone\""),
            ("every = 2", "missing field `path`"),
            ("path = \"raw\"\nimages = \"c.csv\"", "frames.images = \"c.csv\""),
            ("path = \"raw\"\nevery = 0", "line 6: invalid value"),
            ("path = \"raw\"\nwidth = 4", "[frames]: width = 4: must be from 8"),
            ("path = \"raw\"\nfov = 4", "unknown field `fov`"),
        ] {
            let message = frames(table).unwrap_err().to_string();
            assert!(message.contains(words), "{table}: {message}");
        }
    }
}
