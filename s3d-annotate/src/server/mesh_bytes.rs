//! The mesh as the page takes it: rows of little-endian numbers.

use s3d_geom::glam::DVec3;
use s3d_geom::{FaceColor, NO_INDEX, TriMesh};
use std::collections::BTreeMap;

/// A colour, and a texture if there is one.
pub(super) type Material = ([u8; 3], Option<u32>);

/// Coordinates are relative to this, so that 32 bits are enough.
pub(super) fn origin(mesh: &TriMesh) -> DVec3 {
    mesh.aabb().center().as_dvec3()
}

/// Three numbers a vertex.
pub(super) fn positions(mesh: &TriMesh) -> Vec<u8> {
    let origin = origin(mesh);
    let numbers = mesh
        .positions()
        .iter()
        .flat_map(|position| (position.as_dvec3() - origin).as_vec3().to_array());
    numbers.flat_map(f32::to_le_bytes).collect()
}

/// Three vertices a face.
pub(super) fn faces(mesh: &TriMesh) -> Vec<u8> {
    mesh.faces()
        .as_flattened()
        .iter()
        .copied()
        .flat_map(u32::to_le_bytes)
        .collect()
}

/// Three bytes a vertex; empty without colours of vertices.
pub(super) fn colors(mesh: &TriMesh) -> Vec<u8> {
    mesh.parts().colors.as_flattened().to_vec()
}

/// Two numbers a corner; zeros for a face without a texture. Empty without textures.
pub(super) fn uvs(mesh: &TriMesh) -> Vec<u8> {
    if mesh.textures().is_empty() {
        return Vec::new();
    }
    let parts = mesh.parts();
    let corners = (0..mesh.faces().len()).flat_map(|face| {
        let uvs = parts.face_uvs.get(face).filter(|uvs| **uvs != [NO_INDEX; 3]);
        uvs.map_or([[0.0; 2]; 3], |uvs| uvs.map(|uv| parts.uvs[uv as usize].to_array()))
    });
    corners.flatten().flat_map(f32::to_le_bytes).collect()
}

/// Returns the kinds of faces, and the kind of each, as a number of 16 bits.
pub(super) fn materials(mesh: &TriMesh) -> (Vec<Material>, Vec<u8>) {
    let mut numbers: BTreeMap<Material, u16> = BTreeMap::new();
    let mut all: Vec<Material> = Vec::new();
    let mut of_face = Vec::with_capacity(2 * mesh.faces().len());
    for face in 0..mesh.faces().len() as u32 {
        let material = match mesh.color_of(face) {
            FaceColor::Texture(texture, ..) => ([255; 3], Some(texture)),
            FaceColor::Corners(_) => ([255; 3], None),
            FaceColor::Flat(color) => (color, None),
        };
        // More than 65,535 kinds are shown with the colour of the last one.
        let number = *numbers.entry(material).or_insert_with(|| {
            if all.len() < usize::from(u16::MAX) {
                all.push(material);
            }
            all.len() as u16 - 1
        });
        of_face.extend(number.to_le_bytes());
    }
    (all, of_face)
}
