//! Writes meshes as GLB files: binary glTF 2.0, Y-up as glTF has it. x, y, z become x, z, −y. Source: glTF
//! 2.0, "Binary glTF Layout".

#![expect(clippy::indexing_slicing, reason = "a writer: keys of JSON objects are its own")]

use super::gltf::linear_from_srgb;
use super::write::{MeshOut, check};
use crate::error::Result;
use crate::fs::write_whole;
use s3d_geom::glam::Vec3;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::Path;

/// What a view of the binary part is for.
const VERTICES: Option<u32> = Some(34962);
const INDICES: Option<u32> = Some(34963);

/// Types of numbers.
const U16: u32 = 5123;
const U32: u32 = 5125;
pub(super) const F32: u32 = 5126;

/// Writes a mesh as a GLB file. Colours become light, 16 bits a channel. glTF has no columns of faces, so
/// those are left out. The file appears whole or not at all. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io), also for a column that has not one entry per vertex or face, and for a
/// mesh of more than 4 GiB, which the format cannot hold.
pub fn write_glb_mesh(path: &Path, mesh: &MeshOut<'_>) -> Result<u64> {
    write_whole(path, |w| {
        check(mesh)?;
        let mut glb = Glb::default();
        let positions = glb.positions(mesh.positions);
        let mut attributes = json!({ "POSITION": positions });
        if !mesh.colors.is_empty() {
            attributes["COLOR_0"] = json!(glb.colors(mesh.colors));
        }
        let indices = glb.indices(mesh.faces.as_flattened());
        let primitive = json!({ "attributes": attributes, "indices": indices, "material": 0 });
        let rest = json!({ "materials": [{ "pbrMetallicRoughness": plain() }] });
        glb.write(w, &[primitive], mesh.comments, rest)
    })
}

/// How light is reflected: by the colour alone.
pub(super) fn plain() -> Value {
    json!({ "metallicFactor": 0.0, "roughnessFactor": 1.0 })
}

/// A file that is being made.
#[derive(Default)]
pub(super) struct Glb {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Glb {
    /// Adds what `fill` writes to the binary part. Returns the number of the view.
    pub(super) fn view(&mut self, target: Option<u32>, fill: impl FnOnce(&mut Vec<u8>)) -> usize {
        let begin = self.bytes.len();
        fill(&mut self.bytes);
        let mut view = json!({ "buffer": 0, "byteOffset": begin, "byteLength": self.bytes.len() - begin });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Adds bytes at a multiple of 8, as tables of features need them. Returns the number of the view.
    pub(super) fn aligned_view(&mut self, bytes: impl Iterator<Item = u8>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        self.view(None, |all| all.extend(bytes))
    }

    /// Adds a column of vertices. Returns its number.
    pub(super) fn column<const N: usize>(
        &mut self,
        [component, count]: [u32; 2],
        kind: &str,
        bytes: impl Iterator<Item = [u8; N]>,
    ) -> usize {
        let view = self.view(VERTICES, |all| bytes.for_each(|entry| all.extend(entry)));
        self.accessors
            .push(json!({ "bufferView": view, "componentType": component, "count": count, "type": kind }));
        self.accessors.len() - 1
    }

    /// Adds positions in the world's frame.
    pub(super) fn positions(&mut self, positions: &[Vec3]) -> usize {
        let points = || positions.iter().map(|p| Vec3::new(p.x, p.z, -p.y));
        let bytes = points().flat_map(|p| p.to_array()).map(f32::to_le_bytes);
        let number = self.column([F32, positions.len() as u32], "VEC3", bytes);
        if let Some(accessor) = self.accessors.last_mut() {
            accessor["min"] = json!(points().fold(Vec3::INFINITY, Vec3::min).to_array());
            accessor["max"] = json!(points().fold(Vec3::NEG_INFINITY, Vec3::max).to_array());
        }
        number
    }

    /// Adds sRGB colours of vertices as light.
    pub(super) fn colors(&mut self, colors: &[[u8; 3]]) -> usize {
        let light = |byte: u8| (f64::from(linear_from_srgb(byte)) * 65535.0).round() as u16;
        let lights = colors
            .iter()
            .flat_map(|[r, g, b]| [light(*r), light(*g), light(*b), u16::MAX]);
        let number = self.column([U16, colors.len() as u32], "VEC4", lights.map(u16::to_le_bytes));
        if let Some(accessor) = self.accessors.last_mut() {
            accessor["normalized"] = json!(true);
        }
        number
    }

    /// Adds the vertices of faces.
    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes = indices.iter().flat_map(|index| index.to_le_bytes());
        let view = self.view(INDICES, |all| all.extend(bytes));
        self.accessors.push(json!({
            "bufferView": view, "componentType": U32, "count": indices.len(), "type": "SCALAR"
        }));
        self.accessors.len() - 1
    }

    /// Writes the file: one node with one mesh. `rest` has the materials, and what they need.
    pub(super) fn write(
        self,
        w: &mut dyn Write,
        primitives: &[Value],
        comments: &[String],
        rest: Value,
    ) -> io::Result<()> {
        let mut document = rest;
        document["asset"] =
            json!({ "version": "2.0", "generator": "s3d", "extras": { "comments": comments } });
        document["scene"] = json!(0);
        document["scenes"] = json!([{ "nodes": [0] }]);
        document["nodes"] = json!([{ "mesh": 0 }]);
        document["meshes"] = json!([{ "primitives": primitives }]);
        document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        document["bufferViews"] = Value::Array(self.views);
        document["accessors"] = Value::Array(self.accessors);
        let mut text = document.to_string();
        text.push_str(&" ".repeat(text.len().next_multiple_of(4) - text.len()));

        let too_large = |_| io::Error::new(io::ErrorKind::InvalidInput, "larger than 4 GiB: write a PLY");
        let sizes = [text.len(), self.bytes.len(), 12 + 8 + text.len() + 8 + self.bytes.len()];
        let [json_bytes, bin_bytes, all] = sizes.map(|n| u32::try_from(n).map_err(too_large));
        w.write_all(b"glTF")?;
        for number in [2, all?, json_bytes?] {
            w.write_all(&number.to_le_bytes())?;
        }
        w.write_all(b"JSON")?;
        w.write_all(text.as_bytes())?;
        w.write_all(&bin_bytes?.to_le_bytes())?;
        w.write_all(b"BIN\0")?;
        w.write_all(&self.bytes)
    }
}
