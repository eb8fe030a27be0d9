//! Meshes with colours of vertices and numbers of faces, as binary PLY and as GLB.

use crate::error::Result;
use crate::fs::write_whole;
use s3d_geom::glam::Vec3;
use std::io;
use std::path::Path;

/// A mesh to be written: columns in world metres, Z-up.
#[derive(Clone, Copy, Debug, Default)]
pub struct MeshOut<'a> {
    /// The positions of the vertices.
    pub positions: &'a [Vec3],
    /// Three indices into `positions` per face.
    pub faces: &'a [[u32; 3]],
    /// The colours of the vertices, sRGB: none, or one per vertex.
    pub colors: &'a [[u8; 3]],
    /// Further columns of the faces.
    pub columns: &'a [FaceColumn<'a>],
    /// What a person who opens the file should know, a line each. Other characters than ASCII become `?`.
    pub comments: &'a [String],
}

/// A number of each face.
#[derive(Clone, Copy, Debug)]
pub struct FaceColumn<'a> {
    /// The name of the column.
    pub name: &'a str,
    /// One number per face.
    pub values: &'a [i32],
}

/// The mistakes of a caller, as an error of writing.
fn check(mesh: &MeshOut<'_>) -> io::Result<()> {
    let colors = mesh.colors.len();
    if colors != 0 && colors != mesh.positions.len() {
        let message = format!("{colors} colours for {} vertices", mesh.positions.len());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    match mesh
        .columns
        .iter()
        .find(|column| column.values.len() != mesh.faces.len())
    {
        None => Ok(()),
        Some(FaceColumn { name, values }) => {
            let message = format!("{} values of {name} for {} faces", values.len(), mesh.faces.len());
            Err(io::Error::new(io::ErrorKind::InvalidInput, message))
        }
    }
}

/// Writes a mesh as a binary little-endian PLY file, Z-up. The file appears whole or not at all. Returns its
/// size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io), also for a column that has not one entry per vertex or face.
#[cfg(feature = "ply")]
pub fn write_ply_mesh(path: &Path, mesh: &MeshOut<'_>) -> Result<u64> {
    write_whole(path, |w| {
        check(mesh)?;
        write_ply_header(w, mesh)?;

        let mut colors = mesh.colors.iter();
        for position in mesh.positions {
            for coordinate in position.to_array() {
                w.write_all(&coordinate.to_le_bytes())?;
            }
            colors.next().map_or(Ok(()), |color| w.write_all(color))?;
        }
        let mut columns: Vec<_> = mesh.columns.iter().map(|column| column.values.iter()).collect();
        for face in mesh.faces {
            w.write_all(&[3])?;
            face.iter().try_for_each(|corner| w.write_all(&corner.to_le_bytes()))?;
            let mut numbers = columns.iter_mut().filter_map(Iterator::next);
            numbers.try_for_each(|number| w.write_all(&number.to_le_bytes()))?;
        }
        Ok(())
    })
}

#[cfg(feature = "ply")]
fn write_ply_header(w: &mut dyn io::Write, mesh: &MeshOut<'_>) -> io::Result<()> {
    writeln!(w, "ply\nformat binary_little_endian 1.0")?;
    for comment in mesh.comments {
        let line: String = comment
            .chars()
            .map(|c| if matches!(c, ' '..='~') { c } else { '?' })
            .collect();
        writeln!(w, "comment {line}")?;
    }

    writeln!(w, "element vertex {}", mesh.positions.len())?;
    ["x", "y", "z"]
        .iter()
        .try_for_each(|name| writeln!(w, "property float {name}"))?;
    if !mesh.colors.is_empty() {
        let names = ["red", "green", "blue"];
        names.iter().try_for_each(|name| writeln!(w, "property uchar {name}"))?;
    }

    writeln!(w, "element face {}\nproperty list uchar int vertex_indices", mesh.faces.len())?;
    mesh.columns
        .iter()
        .try_for_each(|column| writeln!(w, "property int {}", column.name))?;
    writeln!(w, "end_header")
}

/// Writes a mesh as a GLB file, Y-up as glTF has it: x, y, z become x, z, −y. Colours become light, 16 bits a
/// channel. glTF has no columns of faces, so those are left out. The file appears whole or not at all.
/// Returns its size in bytes. Source: glTF 2.0, "Binary glTF Layout".
///
/// # Errors
/// [`Error::Io`](crate::Error::Io), also for a column that has not one entry per vertex or face, and for a
/// mesh of more than 4 GiB, which the format cannot hold.
#[cfg(feature = "gltf")]
pub fn write_glb_mesh(path: &Path, mesh: &MeshOut<'_>) -> Result<u64> {
    write_whole(path, |w| {
        check(mesh)?;
        let (json, bytes) = glb_json(mesh);
        let padded = json.len().next_multiple_of(4);
        let too_large = |_| io::Error::new(io::ErrorKind::InvalidInput, "larger than 4 GiB: write a PLY");
        let [json_bytes, bin_bytes, all] =
            [padded, bytes, 12 + 8 + padded + 8 + bytes].map(|n| u32::try_from(n).map_err(too_large));

        w.write_all(b"glTF")?;
        for number in [2, all?, json_bytes?] {
            w.write_all(&number.to_le_bytes())?;
        }
        w.write_all(b"JSON")?;
        w.write_all(json.as_bytes())?;
        w.write_all(" ".repeat(padded - json.len()).as_bytes())?;
        w.write_all(&bin_bytes?.to_le_bytes())?;
        w.write_all(b"BIN\0")?;

        for position in mesh.positions {
            for coordinate in y_up(*position).to_array() {
                w.write_all(&coordinate.to_le_bytes())?;
            }
        }
        for color in mesh.colors {
            for light in [light_of(color[0]), light_of(color[1]), light_of(color[2]), u16::MAX] {
                w.write_all(&light.to_le_bytes())?;
            }
        }
        let mut corners = mesh.faces.iter().flatten();
        corners.try_for_each(|corner| w.write_all(&corner.to_le_bytes()))
    })
}

/// The JSON of a GLB file, and the size of its binary part.
#[cfg(feature = "gltf")]
fn glb_json(mesh: &MeshOut<'_>) -> (String, usize) {
    let [vertices, corners] = [mesh.positions.len(), mesh.faces.len() * 3];
    let [positions, colors] = [vertices * 12, mesh.colors.len() * 8];
    let bytes = positions + colors + corners * 4;
    let points = || mesh.positions.iter().map(|p| y_up(*p));
    let min = points().fold(Vec3::INFINITY, Vec3::min).to_array();
    let max = points().fold(Vec3::NEG_INFINITY, Vec3::max).to_array();

    let attributes = if mesh.colors.is_empty() {
        serde_json::json!({ "POSITION": 0 })
    } else {
        serde_json::json!({ "POSITION": 0, "COLOR_0": 1 })
    };
    let mut views = vec![serde_json::json!({ "buffer": 0, "byteLength": positions, "target": 34962 })];
    let mut accessors = vec![serde_json::json!({
        "bufferView": 0, "componentType": 5126, "count": vertices, "type": "VEC3", "min": min, "max": max
    })];
    if !mesh.colors.is_empty() {
        accessors.push(serde_json::json!({
            "bufferView": 1, "componentType": 5123, "normalized": true, "count": vertices, "type": "VEC4"
        }));
        views.push(serde_json::json!({
            "buffer": 0, "byteOffset": positions, "byteLength": colors, "target": 34962
        }));
    }
    let indices = accessors.len();
    accessors.push(serde_json::json!({
        "bufferView": views.len(), "componentType": 5125, "count": corners, "type": "SCALAR"
    }));
    views.push(serde_json::json!({
        "buffer": 0, "byteOffset": positions + colors, "byteLength": corners * 4, "target": 34963
    }));

    let document = serde_json::json!({
        "asset": { "version": "2.0", "generator": "s3d", "extras": { "comments": mesh.comments } },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": attributes, "indices": indices, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 } }],
        "buffers": [{ "byteLength": bytes }],
        "bufferViews": views,
        "accessors": accessors,
    });
    (document.to_string(), bytes)
}

/// Turns a position from Z-up to Y-up.
#[cfg(feature = "gltf")]
fn y_up(p: Vec3) -> Vec3 {
    Vec3::new(p.x, p.z, -p.y)
}

/// Decodes an sRGB byte to light in 16 bits.
#[cfg(feature = "gltf")]
fn light_of(byte: u8) -> u16 {
    (f64::from(crate::mesh::gltf::linear_from_srgb(byte)) * 65535.0).round() as u16
}

#[cfg(all(test, feature = "gltf", feature = "ply"))]
mod tests {
    use super::*;
    use crate::mesh::{UpAxis, read_mesh};

    const POSITIONS: [Vec3; 4] =
        [Vec3::ZERO, Vec3::new(2.0, 0.0, 0.5), Vec3::new(0.0, 3.0, 0.0), Vec3::new(-1.0, 0.0, 4.0)];
    const FACES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
    const COLORS: [[u8; 3]; 4] = [[0, 1, 2], [3, 127, 128], [254, 255, 9], [10, 11, 12]];

    #[test]
    fn meshes_come_back_as_they_were() {
        let dir = tempfile::tempdir().unwrap();
        let closed = [FaceColumn { name: "closed", values: &[0, 1] }];
        let comments = ["made of a scan in Zürich".to_owned()];
        let mesh = MeshOut {
            positions: &POSITIONS,
            faces: &FACES,
            colors: &COLORS,
            columns: &closed,
            comments: &comments,
        };

        let [ply, glb] = ["m.ply", "m.glb"].map(|name| dir.path().join(name));
        assert_eq!(write_ply_mesh(&ply, &mesh).unwrap(), std::fs::metadata(&ply).unwrap().len());
        assert_eq!(write_glb_mesh(&glb, &mesh).unwrap(), std::fs::metadata(&glb).unwrap().len());
        for (path, up) in [(ply, UpAxis::Z), (glb, UpAxis::Y)] {
            let read = read_mesh(&path, up).unwrap();
            assert_eq!(read.warnings, [""; 0]);
            let read = read.mesh.into_parts();
            assert_eq!((&read.positions[..], &read.faces[..]), (&POSITIONS[..], &FACES[..]), "{up:?}");
            assert_eq!(read.colors, COLORS, "{up:?}");
        }
    }

    #[test]
    fn columns_of_another_length_are_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("m.ply");
        let plain = MeshOut { positions: &POSITIONS, faces: &FACES, ..MeshOut::default() };
        let column = [FaceColumn { name: "closed", values: &[1] }];
        for (mesh, words) in [
            (MeshOut { colors: &COLORS[..2], ..plain }, "2 colours for 4 vertices"),
            (MeshOut { columns: &column, ..plain }, "1 values of closed for 2 faces"),
        ] {
            let message = write_ply_mesh(&path, &mesh).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
            assert!(!path.exists());
        }
        write_ply_mesh(&path, &plain).unwrap();
    }
}
