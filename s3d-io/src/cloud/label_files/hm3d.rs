//! HM3D's labels: a mesh whose texture has a flat colour for each object (`….semantic.glb`), and a list of
//! the objects (`….semantic.txt`). Source: facebookresearch/habitat-sim,
//! src/esp/scene/HM3DSemanticScene.cpp.

use crate::cloud::label_files::{folder_of, head_of, name_of};
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::fs::quote::count;
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use crate::mesh::labels::{LabelledObject, LabelledRoom, MeshLabels};
use crate::mesh::read::read_mesh_with;
use s3d_geom::glam::Vec2;
use s3d_geom::{FaceColor, NO_INDEX, Texture, TriMesh};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The first line of a list.
const HEAD: &[u8] = b"HM3D Semantic Annotations";

/// Where a face is looked at: its middle, and places near its corners and the middles of its edges.
const PLACES: [[f32; 3]; 7] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0],
    [0.8, 0.1, 0.1],
    [0.1, 0.8, 0.1],
    [0.1, 0.1, 0.8],
    [0.45, 0.45, 0.1],
    [0.1, 0.45, 0.45],
    [0.45, 0.1, 0.45],
];

/// An object of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Entry {
    number: i64,
    color: [u8; 3],
    name: String,
    /// From 0.
    region: Option<i64>,
}

/// Returns whether a file is a list of objects.
pub(super) fn is_list(path: &Path) -> bool {
    head_of(path).trim_ascii_start().starts_with(HEAD)
}

/// Returns the list that belongs to a coloured mesh, if it lies beside it.
pub(super) fn list_beside(mesh: &Path) -> Option<PathBuf> {
    let name = mesh.file_name()?.to_str()?;
    let stem = name.strip_suffix(".semantic.glb")?;
    let list = folder_of(mesh).join(format!("{stem}.semantic.txt"));
    is_list(&list).then_some(list)
}

/// Reads the coloured mesh that a list is about.
///
/// # Errors
/// [`Error::Format`] if the mesh is not beside the list, and the errors of [`named`].
pub(super) fn read(list: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let name = name_of(list);
    let stem = name.strip_suffix(".txt").unwrap_or(&name);
    let stem = stem.strip_suffix(".semantic").unwrap_or(stem);
    let wanted = format!("{stem}.semantic.glb");
    let found = super::files_of(&folder_of(list))
        .into_iter()
        .find(|path| name_of(path) == wanted);
    let mesh = found.ok_or_else(|| {
        Error::format(list, format!("the coloured mesh that it is about is not beside it: {wanted}"))
    })?;

    let mut file = read_mesh_with(&mesh, up, options)?;
    let mut warnings = std::mem::take(&mut file.warnings);
    file.labels = Some(named(&file.mesh, list, &mut warnings)?);
    file.warnings = warnings;
    Ok(file)
}

/// Gives each face of a coloured mesh the object of its colour. A face has the colour that most of its places
/// have exactly, at the nearest pixel of its texture. Faces without a colour of the list stay unlabelled.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line for a list that is damaged, and if no face has a colour of
/// the list.
pub(super) fn named(mesh: &TriMesh, list: &Path, warnings: &mut Vec<String>) -> Result<MeshLabels> {
    let bytes = read_file(list)?;
    let text = text_of(&bytes, list)?;
    let entries = entries(&String::from_utf8_lossy(&text), list)?;
    let by_color: HashMap<[u8; 3], u32> = (0..).zip(&entries).map(|(i, e)| (e.color, i)).collect();

    let faces: Vec<u32> = (0..mesh.faces().len() as u32)
        .map(|face| object_of(mesh, face, &by_color))
        .collect();
    let unlabelled = faces.iter().filter(|object| **object == NO_INDEX).count();
    if unlabelled == faces.len() {
        return Err(Error::format(list, "no face of its mesh has a colour of this list"));
    }
    if unlabelled > 0 {
        let n = count(unlabelled, "face");
        warnings.push(format!("{n} without a label: their colours are not in {}", list.display()));
    }

    let objects = entries
        .into_iter()
        .map(|entry| LabelledObject {
            class: entry.name,
            instance: entry.number,
            room: entry
                .region
                .map(|region| LabelledRoom { number: region.saturating_add(1), name: None }),
        })
        .collect();
    Ok(MeshLabels::Objects { objects, faces, are_names: false })
}

/// Returns the object whose colour most places of a face have, or [`NO_INDEX`].
fn object_of(mesh: &TriMesh, face: u32, by_color: &HashMap<[u8; 3], u32>) -> u32 {
    let mut votes: Vec<u32> = match mesh.color_of(face) {
        FaceColor::Texture(_, texture, corners) => PLACES
            .iter()
            .filter_map(|[a, b, c]| {
                let [p, q, r] = corners;
                by_color
                    .get(&nearest_pixel(texture, p * *a + q * *b + r * *c)?)
                    .copied()
            })
            .collect(),
        FaceColor::Corners(colors) => {
            colors.iter().filter_map(|color| by_color.get(color).copied()).collect()
        }
        FaceColor::Flat(color) => by_color.get(&color).copied().into_iter().collect(),
    };
    votes.sort_unstable();
    let groups = votes.chunk_by(|a, b| a == b);
    // Of groups of one size, the smallest object wins.
    let most = groups.max_by_key(|group| (group.len(), std::cmp::Reverse(group.first().copied())));
    most.and_then(|group| group.first().copied()).unwrap_or(NO_INDEX)
}

/// Returns the pixel of a texture that a texture coordinate lies in.
fn nearest_pixel(texture: &Texture, uv: Vec2) -> Option<[u8; 3]> {
    let image = &texture.image;
    let size = [image.width(), image.height()];
    let [wrap_u, wrap_v] = texture.wrap;
    let column = wrap_u.index((uv.x * size[0] as f32).floor() as i64, size[0]);
    // Texture coordinates count upwards, rows of pixels downwards.
    let from_bottom = wrap_v.index((uv.y * size[1] as f32).floor() as i64, size[1]);
    let row = size[1].checked_sub(1 + from_bottom)?;
    let at = row as usize * size[0] as usize + column as usize;
    image.pixels().get(at).copied()
}

/// Reads the lines of a list: `id,HEX,"name",region`. A name may hold commas.
fn entries(text: &str, path: &Path) -> Result<Vec<Entry>> {
    let mut entries = Vec::new();
    for (line, written) in (1..).zip(text.lines()) {
        let written = written.trim();
        if line == 1 || written.is_empty() {
            continue;
        }
        let entry = entry(written).ok_or_else(|| {
            Error::line(path, line, "is not as in 1,39EB3C,\"floor\",0: number, colour, name, region")
        })?;
        entries.push(entry);
    }
    if entries.is_empty() {
        return Err(Error::format(path, "lists no object"));
    }
    Ok(entries)
}

fn entry(line: &str) -> Option<Entry> {
    let (number, rest) = line.split_once(',')?;
    let (hex, rest) = rest.split_once(',')?;
    let (name, region) = rest.rsplit_once(',')?;

    let hex = hex.trim().trim_start_matches('#');
    let packed = u32::from_str_radix(hex, 16).ok().filter(|_| hex.len() == 6)?;
    let [_, r, g, b] = packed.to_be_bytes();
    let name = name.trim();
    let name = name.strip_prefix('"').and_then(|n| n.strip_suffix('"')).unwrap_or(name);
    let region: i64 = region.trim().parse().ok()?;
    Some(Entry {
        number: number.trim().parse().ok()?,
        color: [r, g, b],
        name: name.replace("\"\"", "\""),
        region: Some(region).filter(|region| *region >= 0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_may_hold_commas_and_quotes() {
        let text =
            "HM3D Semantic Annotations\r\n1,39EB3C,\"floor\",0\r\n\r\n27,0A0b0C,\"sign, \"\"exit\"\"\",-1\n";
        let found = entries(text, Path::new("a.txt")).unwrap();
        let floor = Entry { number: 1, color: [0x39, 0xeb, 0x3c], name: "floor".into(), region: Some(0) };
        let sign = Entry { number: 27, color: [10, 11, 12], name: "sign, \"exit\"".into(), region: None };
        assert_eq!(found, [floor, sign]);
        for line in ["1,39EB3C,floor", "x,39EB3C,\"floor\",0", "1,39EB,\"floor\",0", "1,39EB3C,\"floor\",a"] {
            let message = entries(&format!("HM3D\n{line}\n"), Path::new("a.txt"))
                .unwrap_err()
                .to_string();
            assert!(message.contains("a.txt, line 2"), "{message}");
        }
        assert!(entries("HM3D\n", Path::new("a.txt")).is_err());
    }
}
