//! `scene.toml`: one area's mesh, annotations and scan locations.

use crate::mesh_file::UpAxis;
use crate::rgb_source::{PictureSource, RgbEntry};
use crate::texture_file::read_file;
use crate::{Error, Result};
use serde::Deserialize;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};

/// The parts of a scan of one area. Paths are resolved: relative ones start at the folder of the file that names them.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneFile {
    /// The `scene.toml` itself.
    pub path: PathBuf,
    /// The number of the area, from 1.
    pub area: u32,
    /// The textured mesh.
    pub mesh: PathBuf,
    /// Which axis of the mesh points up. Not said, it is +Y: by glTF's definition, and as in the published OBJ files.
    pub up: UpAxis,
    /// The area's folder of the S3DIS tree: ROOM/Annotations/CLASS_N.txt.
    pub annotations: PathBuf,
    /// The table of scan locations.
    pub cameras: PathBuf,
    /// The scanner's pictures, if RGB images are made from them and not from the mesh's texture.
    pub pictures: Option<PictureSource>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Document {
    area: NonZeroU32,
    mesh: MeshTable,
    annotations: PathTable,
    cameras: PathTable,
    rgb: Option<RgbEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MeshTable {
    path: PathBuf,
    up: Option<UpAxis>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathTable {
    path: PathBuf,
}

/// Reads a `scene.toml`:
///
/// ```toml
/// area = 1
/// [mesh]
/// path = "rgb.obj"
/// up   = "y"          # or "z"; "y" if it is left out
/// [annotations]
/// path = "Area_1"
/// [cameras]
/// path = "cameras.csv"
/// [rgb]               # or, before the first table, rgb = "texture"; that, if it is left out
/// source = "captures" # or "texture", "skybox", "panorama"
/// path = "raw"        # the pictures' folder; named after the source if it is left out
/// ```
///
/// Further keys of `[rgb]` are those of [`crate::PictureOptions`].
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line for a key that is missing or unknown and for a wrong value; without
/// one if a file or folder that it names is not there.
pub fn read_scene(path: &Path) -> Result<SceneFile> {
    let text = String::from_utf8(read_file(path)?).map_err(|_| Error::format(path, "is no text in UTF-8"))?;
    let document: Document = toml::from_str(&text).map_err(|e| {
        let message = e.message().replace('\n', "; ");
        match e.span() {
            // An error at the very start is about the file as a whole: a table that is missing.
            Some(span) if span.end > 0 => {
                let line = text[..span.start.min(text.len())].matches('\n').count() + 1;
                Error::line(path, line as u64, message)
            }
            _ => Error::format(path, message),
        }
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let existing = |key: &str, written: &Path, is_folder: bool| {
        let full = folder.join(written);
        let (what, fits) = if is_folder { ("folder", full.is_dir()) } else { ("file", full.is_file()) };
        if fits {
            return Ok(full);
        }
        let state = if full.exists() { "is no" } else { "is not there; it should be a" };
        Err(Error::format(path, format!("{key} = {written:?}: {} {state} {what}", full.display())))
    };
    let mut pictures = None;
    if let Some(entry) = document.rgb {
        pictures = entry.pictures().map_err(|message| Error::format(path, message))?;
    }
    if let Some(source) = &mut pictures {
        source.path = existing("rgb.path", &source.path, true)?;
    }
    Ok(SceneFile {
        path: path.to_owned(),
        area: document.area.get(),
        up: document.mesh.up.unwrap_or(UpAxis::Y),
        mesh: existing("mesh.path", &document.mesh.path, false)?,
        annotations: existing("annotations.path", &document.annotations.path, true)?,
        cameras: existing("cameras.path", &document.cameras.path, false)?,
        pictures,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PictureKind, PictureOptions, UnseenColor};
    use std::fs;

    const GOOD: &str = "area = 2\n[mesh]\npath = \"a.obj\"\nup = \"z\"\n[annotations]\npath = \"Area_2\"\n[cameras]\npath = \"c.csv\"\n";

    fn read(text: &str) -> Result<SceneFile> {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("a.obj"), "").unwrap();
        fs::write(dir.path().join("c.csv"), "").unwrap();
        fs::create_dir(dir.path().join("Area_2")).unwrap();
        fs::create_dir(dir.path().join("skybox")).unwrap();
        fs::create_dir(dir.path().join("raw")).unwrap();
        let path = dir.path().join("scene.toml");
        fs::write(&path, text).unwrap();
        let scene = read_scene(&path)?;
        assert_eq!(scene.mesh, dir.path().join("a.obj"));
        assert_eq!(scene.annotations, dir.path().join("Area_2"));
        assert_eq!(scene.cameras, dir.path().join("c.csv"));
        Ok(scene)
    }

    #[test]
    fn paths_are_resolved_and_up_is_y_unless_said() {
        let scene = read(GOOD).unwrap();
        assert_eq!((scene.area, scene.up), (2, UpAxis::Z));
        assert_eq!(read(&GOOD.replace("up = \"z\"\n", "")).unwrap().up, UpAxis::Y);
    }

    #[test]
    fn colours_come_from_the_texture_or_from_pictures() {
        let pictures = |rgb: &str| {
            let plain = rgb.starts_with("rgb");
            let text = if plain { format!("{rgb}\n{GOOD}") } else { format!("{GOOD}{rgb}\n") };
            let mut pictures = read(&text).unwrap().pictures;
            if let Some(source) = &mut pictures {
                source.path = source.path.file_name().unwrap().into();
            }
            pictures
        };
        let source = |kind, path: &str, options| Some(PictureSource { kind, path: path.into(), options });
        let options = PictureOptions::default();
        for texture in ["", "rgb = \"texture\"", "[rgb]\nsource = \"texture\""] {
            assert_eq!(pictures(texture), None);
        }
        assert_eq!(pictures("rgb = \"skybox\""), source(PictureKind::SkyBox, "skybox", options.clone()));
        let captures = pictures("[rgb]\nsource = \"captures\"\npath = \"raw\"\nparallax = false\nsize = 512");
        let small = PictureOptions { parallax: false, size: Some(512), ..options.clone() };
        assert_eq!(captures, source(PictureKind::Captures, "raw", small));
        let panorama =
            pictures("[rgb]\nsource = \"panorama\"\npath = \"raw\"\nyaw_deg = 90\nunseen = \"nearby\"");
        let turned = PictureOptions { yaw_deg: 90.0, unseen: UnseenColor::Nearby, ..options };
        assert_eq!(panorama, source(PictureKind::Panorama, "raw", turned));
        for (rgb, words) in [
            ("rgb = \"textures\"", "line 1: unknown variant `textures`, expected one of `texture`, `skybox`"),
            ("rgb = 3", "line 1: invalid type: integer `3`, expected \"texture\""),
            ("rgb = \"captures\"", "captures is not there; it should be a folder"),
            ("[rgb]\npath = \"raw\"", "missing field `source`"),
            ("[rgb]\nsource = \"skybox\"\nfolder = \"raw\"", "unknown field `folder`"),
            ("[rgb]\nsource = \"skybox\"\npath = \"gone\"", "rgb.path = \"gone\""),
            ("[rgb]\nsource = \"skybox\"\nyaw_deg = 1", "rgb.yaw_deg belongs to source = \"panorama\""),
            ("[rgb]\nsource = \"skybox\"\nsize = 16", "rgb.size = 16"),
            ("[rgb]\nsource = \"texture\"\npath = \"raw\"", "has no path"),
            ("[rgb]\nsource = \"panorama\"\npath = \"raw\"\nyaw_deg = nan", "rgb.yaw_deg = NaN"),
        ] {
            let text =
                if rgb.starts_with("rgb") { format!("{rgb}\n{GOOD}") } else { format!("{GOOD}{rgb}\n") };
            let message = read(&text).unwrap_err().to_string();
            assert!(message.contains(words), "{rgb}: {message}");
        }
    }

    #[test]
    fn every_fault_is_named() {
        for (from, to, words) in [
            ("area = 2", "area = 0", "line 1: "),
            ("area = 2", "area = \"2\"", "line 1: invalid type"),
            ("area = 2", "", "missing field `area`"),
            ("up = \"z\"", "up = \"x\"", "line 4: unknown variant `x`, expected `y` or `z`"),
            ("up = \"z\"", "upp = \"z\"", "line 4: unknown field `upp`, expected `path` or `up`"),
            ("area = 2", "area = 2\nareas = 3", "line 2: unknown field `areas`"),
            ("path = \"c.csv\"", "", "line 7: missing field `path`"),
            ("[cameras]", "[cameras", "line 7"),
            ("a.obj", "b.obj", "mesh.path = \"b.obj\""),
            ("a.obj", "Area_2", "is no file"),
            ("Area_2", "Area_9", "annotations.path = \"Area_9\""),
            ("Area_2", "c.csv", "is no folder"),
            ("c.csv", "gone.csv", "cameras.path = \"gone.csv\""),
        ] {
            let message = read(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("scene.toml"), "{to}: {message}");
        }
        assert!(matches!(read_scene(Path::new("gone.toml")), Err(Error::Io { .. })));
    }
}
