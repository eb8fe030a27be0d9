//! Writes the statements of OBJ and MTL files.

#![expect(clippy::indexing_slicing, reason = "a writer: a face has three corners")]

use crate::mesh::obj::mtl::{WRAP_COMMENT, wrap_name};
use s3d_geom::glam::{Vec2, Vec3};
use s3d_geom::{TriMesh, Wrap};
use std::io::{self, Write};

/// The folder of the textures, beside `rgb.obj`.
pub(super) const TEXTURE_FOLDER: &str = "rgb_textures";

/// The comment at the head of a mesh.
pub(super) const Y_UP: &str = "# Y-up: x y z here are x z -y of the world (metres, Z up)";

/// Writes the vertices, with their colours if there are any.
pub(super) fn write_positions(w: &mut dyn Write, mesh: &TriMesh) -> io::Result<()> {
    let colors = &mesh.parts().colors;
    for (i, &position) in mesh.positions().iter().enumerate() {
        write_vector(w, "v", position)?;
        if let Some(color) = colors.get(i) {
            let [r, g, b] = color.map(unit);
            write!(w, " {r} {g} {b}")?;
        }
        w.write_all(b"\n")?;
    }
    Ok(())
}

/// Writes a vector of the world, turned Y-up, without the line end.
pub(super) fn write_vector(w: &mut dyn Write, key: &str, v: Vec3) -> io::Result<()> {
    let v = if v.is_finite() { v } else { Vec3::ZERO };
    // `{}` of an f32 is the shortest text that is read as the same f32.
    write!(w, "{key} {} {} {}", v.x, v.z, -v.y)
}

/// Writes a texture coordinate.
pub(super) fn write_uv(w: &mut dyn Write, uv: Vec2) -> io::Result<()> {
    let [u, v] = if uv.is_finite() { uv } else { Vec2::ZERO }.to_array();
    writeln!(w, "vt {u} {v}")
}

/// Writes a face: its vertices, texture coordinates and normals.
pub(super) fn write_face(
    w: &mut dyn Write,
    corners: &[u32; 3],
    uvs: Option<[u32; 3]>,
    normals: Option<[u32; 3]>,
) -> io::Result<()> {
    w.write_all(b"f")?;
    for k in 0..3 {
        // OBJ counts from 1. 64 bits hold one more than the largest index.
        let [v, uv, n] =
            [Some(corners[k]), uvs.map(|c| c[k]), normals.map(|c| c[k])].map(|i| i.map(|i| u64::from(i) + 1));
        match (v, uv, n) {
            (Some(v), None, None) => write!(w, " {v}")?,
            (Some(v), Some(uv), None) => write!(w, " {v}/{uv}")?,
            (Some(v), None, Some(n)) => write!(w, " {v}//{n}")?,
            (Some(v), Some(uv), Some(n)) => write!(w, " {v}/{uv}/{n}")?,
            (None, ..) => {}
        }
    }
    w.write_all(b"\n")
}

/// The texture of a material.
pub(super) struct MapOut<'a> {
    pub(super) file: &'a str,
    /// Whether it has the option `-clamp on`.
    pub(super) clamped: bool,
    pub(super) wrap: [Wrap; 2],
}

/// Writes a material. A comment tells our own reader how the texture repeats, if the option does not.
pub(super) fn write_material(
    w: &mut dyn Write,
    name: &str,
    color: [u8; 3],
    texture: Option<MapOut<'_>>,
) -> io::Result<()> {
    let [r, g, b] = color.map(unit);
    writeln!(w, "newmtl {name}\nKd {r} {g} {b}\nillum 1")?;
    if let Some(MapOut { file, clamped, wrap }) = texture {
        let said = if clamped { Wrap::Clamp } else { Wrap::Repeat };
        if wrap != [said; 2] {
            writeln!(w, "{WRAP_COMMENT} {} {}", wrap_name(wrap[0]), wrap_name(wrap[1]))?;
        }
        writeln!(w, "map_Kd {}{TEXTURE_FOLDER}/{file}", if clamped { "-clamp on " } else { "" })?;
    }
    w.write_all(b"\n")
}

fn unit(channel: u8) -> f32 {
    f32::from(channel) / 255.0
}
