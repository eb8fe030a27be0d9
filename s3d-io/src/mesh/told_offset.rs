//! Offsets that photogrammetry programs put beside a mesh: they subtract the offset from the scan's
//! coordinates and write the mesh near the origin.
//!
//! - Pix4D writes `NAME_offset.xyz` or `offset.xyz`, with x, y and z, beside the mesh or in
//!   `../../1_initial/params`.
//! - OpenDroneMap writes `odm_georeferencing_model_geo.txt` or `coords.txt`, with a line for the coordinate
//!   system, then x and y, in `../odm_georeferencing` or beside the mesh. Its z is as it was.
//!
//! Sources: Pix4D's support, "How to visualize the 3D textured mesh with georeference"; OpenDroneMap/ODM,
//! opendm/georef.py and the readers of WebODM.

use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use s3d_geom::glam::DVec3;
use std::path::{Path, PathBuf};

/// The folders of Pix4D's file, from the mesh's.
const PIX4D: [&str; 2] = ["", "../../1_initial/params"];

/// The folders of OpenDroneMap's file, from the mesh's.
const ODM: [&str; 2] = ["", "../odm_georeferencing"];

/// The names of OpenDroneMap's file.
const ODM_NAMES: [&str; 2] = ["odm_georeferencing_model_geo.txt", "coords.txt"];

/// An offset that a file beside a mesh tells.
#[derive(Clone, Debug, PartialEq)]
pub struct ToldOffset {
    /// The file.
    pub file: PathBuf,
    /// What to add to the mesh's coordinates to get the scan's, metres, in the world's axes (Z-up).
    pub offset_m: DVec3,
}

impl ToldOffset {
    /// Finds the offset of the mesh at `path`. Returns `None` if no program put a file of that kind beside
    /// it, or if several of Pix4D's files lie there and none is named after the mesh.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for such a file that holds no offset.
    pub fn beside(path: &Path) -> Result<Option<Self>> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let pix4d = PIX4D.iter().find_map(|below| pix4d_file(&folder.join(below), path));
        if let Some(file) = pix4d {
            let numbers = numbers(&file)?;
            return match numbers[..] {
                [x, y, z] => Ok(Some(Self { file, offset_m: DVec3::new(x, y, z) })),
                _ => Err(Error::format(&file, format!("has {} numbers: an offset is x y z", numbers.len()))),
            };
        }

        let odm = ODM
            .iter()
            .flat_map(|below| ODM_NAMES.map(|name| folder.join(below).join(name)))
            .find(|file| file.is_file() && is_odm(file));
        let Some(file) = odm else { return Ok(None) };
        match numbers_of_line(&file, 2)?[..] {
            [x, y, ..] => Ok(Some(Self { file, offset_m: DVec3::new(x, y, 0.0) })),
            _ => Err(Error::line(&file, 2, "the line after the coordinate system is x y")),
        }
    }
}

/// Finds Pix4D's file in a folder: the one that is named after the mesh, or else the only one.
fn pix4d_file(folder: &Path, mesh: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
            name == "offset.xyz" || name.ends_with("_offset.xyz")
        })
        .collect();
    files.sort();

    let stem = mesh.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let is_of_mesh = |file: &&PathBuf| {
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.strip_suffix("_offset.xyz")
            .is_some_and(|project| stem.starts_with(project))
    };
    match files.as_slice() {
        [only] => Some(only.clone()),
        several => several.iter().find(is_of_mesh).cloned(),
    }
}

/// Returns whether a file begins as OpenDroneMap's do: with the name of a coordinate system. Files of other
/// programs are called `coords.txt` too.
fn is_odm(file: &Path) -> bool {
    let Ok(bytes) = read_file(file) else { return true };
    let text = String::from_utf8_lossy(&bytes);
    let first = text.lines().next().unwrap_or_default().to_uppercase();
    ["WGS84", "EPSG:", "+PROJ"].iter().any(|start| first.starts_with(start))
}

/// Returns all numbers of a file.
fn numbers(file: &Path) -> Result<Vec<f64>> {
    let bytes = read_file(file)?;
    let text = text_of(&bytes, file)?;
    let mut all = Vec::new();
    for (line, text) in (1u64..).zip(text.split(|&b| b == b'\n')) {
        all.extend(numbers_in(text, file, line)?);
    }
    Ok(all)
}

/// Returns the numbers of one line of a file, counted from 1.
fn numbers_of_line(file: &Path, line: usize) -> Result<Vec<f64>> {
    let bytes = read_file(file)?;
    let text = text_of(&bytes, file)?;
    let wanted = text.split(|&b| b == b'\n').nth(line - 1).unwrap_or_default();
    numbers_in(wanted, file, line as u64)
}

/// Returns the numbers in a line, between spaces, commas or semicolons.
fn numbers_in(text: &[u8], file: &Path, line: u64) -> Result<Vec<f64>> {
    let text = String::from_utf8_lossy(text);
    text.split([' ', '\t', ',', ';', '\r'])
        .filter(|word| !word.is_empty())
        .map(|word| {
            let number = word.parse().ok().filter(|number: &f64| number.is_finite());
            number.ok_or_else(|| Error::line(file, line, format!("{word:?} is no number of an offset")))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// Returns what is told beside `mesh`, in a folder with these files.
    fn told(mesh: &str, files: &[(&str, &str)]) -> Result<Option<(String, DVec3)>> {
        let dir = tempfile::tempdir().unwrap();
        let mesh = dir.path().join(mesh);
        fs::create_dir_all(mesh.parent().unwrap()).unwrap();
        for (name, text) in files {
            let path = dir.path().join(name);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        let name = |file: &Path| file.file_name().unwrap().to_string_lossy().into_owned();
        Ok(ToldOffset::beside(&mesh)?.map(|told| (name(&told.file), told.offset_m)))
    }

    #[test]
    fn offsets_are_found_where_programs_put_them() {
        let utm = DVec3::new(512_300.0, 5_412_345.0, 340.5);
        let text = "512300.0 5412345.0 340.5\n";
        for (mesh, file) in [
            ("house_simplified.obj", "house_offset.xyz"),
            ("mesh.obj", "offset.xyz"),
            ("2_densification/3d_mesh/a.obj", "1_initial/params/house_offset.xyz"),
        ] {
            let (name, offset_m) = told(mesh, &[(file, text)]).unwrap().unwrap();
            assert!(file.ends_with(&name) && offset_m == utm, "{mesh}");
        }
        let several = [("house_offset.xyz", "512300,5412345,340.5"), ("barn_offset.xyz", "1 2 3")];
        assert_eq!(told("house_mesh.obj", &several).unwrap().unwrap().1, utm);
        assert_eq!(told("other.obj", &several).unwrap(), None);

        let odm = "WGS84 UTM 16N\r\n512300 5412345\r\n";
        for file in ["odm_georeferencing/odm_georeferencing_model_geo.txt", "odm_texturing/coords.txt"] {
            let found = told("odm_texturing/odm_textured_model_geo.obj", &[(file, odm)]).unwrap();
            assert_eq!(found.unwrap().1, DVec3::new(512_300.0, 5_412_345.0, 0.0), "{file}");
        }
        assert_eq!(told("a.obj", &[("coords.txt", "1 2 3\n4 5 6\n")]).unwrap(), None);
        assert_eq!(told("a.obj", &[]).unwrap(), None);
    }

    #[test]
    fn faults_have_their_line() {
        let message = |file, text| told("a.obj", &[(file, text)]).unwrap_err().to_string();
        assert!(message("offset.xyz", "1 2\n").contains("offset.xyz: has 2 numbers: an offset is x y z"));
        assert!(message("offset.xyz", "1 2\nnan\n").contains("line 2: \"nan\" is no number of an offset"));
        assert!(message("coords.txt", "WGS84 UTM 16N\n").contains("line 2: the line after the coordinate"));
    }
}
