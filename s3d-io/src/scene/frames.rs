//! The table `[frames]` of a `scene.toml`.

use crate::error::{Error, Result};
use crate::mesh::file::UpAxis;
use crate::scene::cameras::similarity;
use s3d_geom::glam::DAffine3;
use serde::Deserialize;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// Photographs with poses, each of which becomes a view.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameSource {
    /// The list of them: see [`read_posed_cameras`](crate::camera::read_posed_cameras).
    pub path: PathBuf,
    /// The folder that the names in the list are in, if not where the list's form has it.
    pub images: Option<PathBuf>,
    /// Takes the list's frame to the world's (metres, Z-up): turns, shifts and scales.
    pub world_from_file: DAffine3,
    /// Every which photograph of the list is taken; the first is.
    pub every: NonZeroU32,
    /// How many of those at most, evenly spread.
    pub max: Option<NonZeroU32>,
    /// Width of the views in pixels; that of the photographs if `None`. Their height follows.
    pub width: Option<u32>,
}

/// The widths that views of photographs may have.
const WIDTHS: std::ops::RangeInclusive<u32> = 8..=16_384;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FramesTable {
    path: PathBuf,
    images: Option<PathBuf>,
    up: Option<UpAxis>,
    transform: Option<[[f64; 4]; 4]>,
    every: Option<NonZeroU32>,
    max: Option<NonZeroU32>,
    width: Option<u32>,
}

/// Finds what a key of the scene file names, which should be of a kind.
type Find<'f> = &'f dyn Fn(&str, &Path, &str, fn(&Path) -> bool) -> Result<PathBuf>;

impl FramesTable {
    /// What it asks for, its files found; an error about the scene file if that cannot be.
    pub(crate) fn source(self, found: Find<'_>, fault: &dyn Fn(String) -> Error) -> Result<FrameSource> {
        let fault = |message: String| fault(format!("[frames]: {message}"));
        let Self { path, images, up, transform, every, max, width } = self;
        if let Some(width) = width.filter(|width| !WIDTHS.contains(width)) {
            let (least, most) = (WIDTHS.start(), WIDTHS.end());
            return Err(fault(format!("width = {width}: must be from {least} to {most} pixels")));
        }
        let given = transform.map_or(Ok(DAffine3::IDENTITY), similarity).map_err(fault)?;
        let path = found("frames.path", &path, "", Path::exists)?;
        let find_images = |images: PathBuf| found("frames.images", &images, "folder", Path::is_dir);
        let images = images.map(find_images).transpose()?;
        let world_from_file = given * DAffine3::from_mat3(up.unwrap_or(UpAxis::Z).rotation());
        Ok(FrameSource { path, images, world_from_file, every: every.unwrap_or(NonZeroU32::MIN), max, width })
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
        let keys = "path = \"raw\"\nimages = \"photos\"\nup = \"y\"\nevery = 7\nmax = 3\nwidth = 640\n";
        let all = frames(keys).unwrap();
        assert!(all.images.unwrap().ends_with("photos"));
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
