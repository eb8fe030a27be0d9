//! Meshes with colours of vertices and numbers of faces, as binary PLY.

#[cfg(feature = "ply")]
use crate::error::Result;
#[cfg(feature = "ply")]
use crate::fs::write_whole;
use s3d_geom::glam::Vec3;
use std::io;
#[cfg(feature = "ply")]
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
pub(super) fn check(mesh: &MeshOut<'_>) -> io::Result<()> {
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

        let mut row = Vec::new();
        let mut colors = mesh.colors.iter();
        for position in mesh.positions {
            row.clear();
            row.extend(position.to_array().into_iter().flat_map(f32::to_le_bytes));
            row.extend(colors.next().into_iter().flatten());
            w.write_all(&row)?;
        }
        let mut columns: Vec<_> = mesh.columns.iter().map(|column| column.values.iter()).collect();
        for face in mesh.faces {
            row.clear();
            row.push(3);
            row.extend(face.iter().flat_map(|corner| corner.to_le_bytes()));
            let numbers = columns.iter_mut().filter_map(Iterator::next);
            row.extend(numbers.flat_map(|number| number.to_le_bytes()));
            w.write_all(&row)?;
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

#[cfg(all(test, feature = "gltf", feature = "ply"))]
mod tests {
    use super::*;
    use crate::mesh::glb::write_glb_mesh;
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
