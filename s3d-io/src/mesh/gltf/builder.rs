//! Joins the primitives of a glTF scene into one mesh.

use crate::error::{Error, Result};
use crate::fs::quote::{count, quote};
use crate::mesh::file::UpAxis;
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::extensions::way_out;
use crate::mesh::gltf::features::{FaceFeatures, FeatureObjects, Features, Triangles};
use crate::mesh::gltf::material::{GltfLooks, default_linear, srgb_from_linear};
use crate::mesh::gltf::scene::Instance;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index};
use s3d_geom::glam::{DMat3, DVec3, Vec2, Vec3};
use s3d_geom::{MeshParts, NO_INDEX};
use std::collections::HashMap;

/// The most vertices and face corners that are placed: 30 GB of them. A file can place a mesh any number of
/// times.
const MAX_ELEMENTS: u64 = if cfg!(fuzzing) { 1 << 20 } else { 1 << 30 };

/// Collects the columns of a mesh.
pub(crate) struct Builder<'a> {
    document: &'a GltfDocument,
    looks: &'a GltfLooks,
    up: UpAxis,
    /// The offset that is subtracted from positions, in the file's unit, in the world's axes.
    offset: DVec3,
    /// Whether the mesh has vertex colours.
    colored: bool,
    parts: MeshParts,
    /// The first index of the texture coordinates of an accessor, after they are mapped for a material.
    uv_starts: HashMap<(usize, usize), u32>,
    /// The node that is the object of each face.
    node_of_face: Vec<u32>,
    features: FaceFeatures<'a>,
    notes: Notes,
}

/// Counts of anything left out or ignored.
#[derive(Default)]
struct Notes {
    no_triangles: usize,
    left_over_corners: usize,
    no_uvs: usize,
    colors_over_textures: usize,
    skinned: usize,
    morphed: usize,
}

/// The columns that primitives of one instance can share: the first index of each, by accessor.
#[derive(Default)]
struct Shared {
    /// By position accessor, colour accessor and, in a mesh with colours, material.
    vertices: HashMap<[Option<usize>; 3], u32>,
    normals: HashMap<usize, u32>,
}

impl<'a> Builder<'a> {
    /// Checks that all instances together are not too large.
    pub(crate) fn new(
        document: &'a GltfDocument,
        looks: &'a GltfLooks,
        features: &'a Features<'a>,
        up: UpAxis,
        instances: &[Instance],
        offset: DVec3,
    ) -> Result<Self> {
        let mut colored = false;
        let mut elements = 0u64;

        for instance in instances {
            let mesh = document.get(instance.mesh, "a node", "mesh")?;
            for p in &mesh.primitives {
                let positions = p.attributes.get(&Checked::Valid(Semantic::Positions));
                for accessor in p.indices.iter().chain(positions) {
                    let count = document.root().get(*accessor).map_or(0, |a| a.count.0);
                    elements = elements.saturating_add(count);
                }
            }
            if elements > MAX_ELEMENTS {
                return Err(document.fail(format!(
                    "places {} meshes of more than {MAX_ELEMENTS} vertices and corners together: cut the \
                     scene in parts",
                    instances.len()
                )));
            }

            colored |= mesh
                .primitives
                .iter()
                .any(|p| color_accessor(p).is_some() && !is_textured(p, looks));
        }

        Ok(Self {
            document,
            looks,
            up,
            offset,
            colored,
            parts: MeshParts::default(),
            uv_starts: HashMap::new(),
            node_of_face: Vec::new(),
            features: FaceFeatures::new(features),
            notes: Notes::default(),
        })
    }

    /// Returns the vertices so far, in the world's axes.
    pub(crate) fn positions(&self) -> &[Vec3] {
        &self.parts.positions
    }

    /// Returns for each face so far the node that is its object.
    pub(crate) fn node_of_face(&self) -> &[u32] {
        &self.node_of_face
    }

    /// Returns the features of the faces so far that are objects. Adds what is no label to `warnings`.
    pub(crate) fn features(&self, warnings: &mut Vec<String>) -> FeatureObjects {
        self.features.objects(warnings)
    }

    /// Returns the positions of all face corners so far.
    pub(crate) fn corners(&self) -> impl Iterator<Item = DVec3> {
        self.parts
            .faces
            .iter()
            .flatten()
            .filter_map(|&v| self.parts.positions.get(v as usize).map(|p| p.as_dvec3()))
    }

    /// Adds the triangles of an instance.
    pub(crate) fn add(&mut self, instance: &Instance) -> Result<()> {
        let mesh = self.document.get(instance.mesh, "a node", "mesh")?;
        let name = mesh
            .name
            .as_ref()
            .map_or_else(String::new, |n| format!(" {}", quote(n.as_bytes())));
        let mut shared = Shared::default();
        self.notes.skinned += usize::from(instance.skinned);
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let who = format!("mesh {}{name}, primitive {p}", instance.mesh);
            self.notes.morphed += usize::from(primitive.targets.as_ref().is_some_and(|t| !t.is_empty()));
            self.add_primitive(instance, (p, primitive), &who, &mut shared)?;
        }
        self.node_of_face.resize(self.parts.faces.len(), instance.object);
        Ok(())
    }

    /// Adds the triangles of a primitive, which comes with its number in the mesh.
    fn add_primitive(
        &mut self,
        instance: &Instance,
        (number, p): (usize, &Primitive),
        who: &str,
        shared: &mut Shared,
    ) -> Result<()> {
        let Checked::Valid(mode) = p.mode else {
            return Err(self.document.fail(format!("{who} has an unknown mode")));
        };
        let positions = p.attributes.get(&Checked::Valid(Semantic::Positions));
        let (Some(&positions), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) = (positions, mode)
        else {
            self.notes.no_triangles += 1;
            return Ok(());
        };

        self.refuse_missing_data(p, positions, who, "vertices")?;
        if let Some(indices) = p.indices {
            self.refuse_missing_data(p, indices, who, "faces")?;
        }
        let vertices: Vec<[f32; 3]> = self.document.read_vectors(positions, &format!("{who}, POSITION"))?;

        let corners = match p.indices {
            Some(indices) => self.document.read_indices(indices, &format!("{who}, indices"))?,
            None => (0..vertices.len() as u32).collect(),
        };
        if let Some(index) = corners.iter().find(|&&i| i as usize >= vertices.len()) {
            return Err(self
                .document
                .fail(format!("{who}: index {index}, but there are {} vertices", vertices.len())));
        }

        let mut triangles = triangles_of(&corners, mode);
        if mode == Mode::Triangles {
            self.notes.left_over_corners += corners.len() % 3;
        }
        if instance.world_from_node.determinant() < 0.0 {
            triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        let start = self.vertex_start(instance, p, positions, &vertices, who, shared)?;
        let moved = self.parts.positions.get(start as usize..).unwrap_or_default();
        let is_finite = |v: u32| moved.get(v as usize).is_some_and(|p| p.is_finite());
        if let Some(&bad) = corners.iter().find(|&&v| !is_finite(v)) {
            let position = vertices.get(bad as usize).map_or(Vec3::NAN, |v| Vec3::from_array(*v));
            return Err(self
                .document
                .fail(format!("{who}: vertex {bad} is not finite: {position}")));
        }

        let of_primitive = Triangles {
            mesh: instance.mesh.value(),
            number,
            primitive: p,
            vertices: vertices.len(),
            corners: &triangles,
        };
        self.features.add(&of_primitive, who);

        let uv_start = self.uv_start(p, vertices.len(), who)?;
        let normal_start = self.normal_start(instance, p, vertices.len(), who, shared)?;
        let material = p.material.map_or(NO_INDEX, |m| m.value() as u32);

        for t in triangles {
            self.parts.faces.push(t.map(|v| start + v));
            self.parts.face_uvs.push(shifted(t, uv_start));
            self.parts.face_normals.push(shifted(t, normal_start));
            self.parts.face_materials.push(material);
        }
        Ok(())
    }

    /// Refuses positions and indices without data. Such an accessor is lawful and its numbers are zeros, but
    /// here it means that an extension holds them.
    fn refuse_missing_data(
        &self,
        p: &Primitive,
        index: Index<Accessor>,
        who: &str,
        what: &str,
    ) -> Result<()> {
        let accessor = self.document.get(index, who, "accessor")?;
        if accessor.buffer_view.is_some() || accessor.sparse.is_some() {
            return Ok(());
        }
        let extension = p.extensions.iter().flat_map(|e| e.others.keys()).next();
        Err(self.document.fail(match extension {
            Some(name) => {
                let way_out = way_out(name);
                format!("{who}: its {what} are in the extension {name}, which is not read; {way_out}")
            }
            None => format!("{who}: accessor {index} of its {what} has no data"),
        }))
    }

    /// Returns the index of the primitive's first vertex in the mesh. Adds the vertices if no earlier
    /// primitive has them.
    fn vertex_start(
        &mut self,
        instance: &Instance,
        p: &Primitive,
        positions: Index<Accessor>,
        vertices: &[[f32; 3]],
        who: &str,
        shared: &mut Shared,
    ) -> Result<u32> {
        let material = p.material.map(|m| m.value());
        let colors = color_accessor(p);
        let over_texture = is_textured(p, self.looks);
        let key = [Some(positions.value()), colors.map(|c| c.value()), material.filter(|_| self.colored)];
        if let Some(&start) = shared.vertices.get(&key) {
            return Ok(start);
        }

        let start = self.next_start(self.parts.positions.len(), vertices.len())?;
        let matrix = instance.world_from_node;
        self.parts.positions.extend(vertices.iter().map(|&v| {
            let moved = matrix.transform_point3(Vec3::from_array(v).as_dvec3());
            (self.up.exact_world_from_file(moved) - self.offset).as_vec3()
        }));

        let base = match material {
            Some(m) => self.looks.linear_colors.get(m).copied(),
            None => Some(default_linear()),
        };
        let base = base.ok_or_else(|| no_material(self.document, who))?;

        let multiplied = match colors {
            Some(accessor) => {
                self.same_count(accessor, vertices.len(), who, "COLOR_0")?;
                let colors = self.document.read_colors(accessor, &format!("{who}, COLOR_0"))?;
                if over_texture && colors.iter().flatten().any(|&c| c < 0.999) {
                    self.notes.colors_over_textures += 1;
                }
                // Without a material, vertex colours stand alone.
                let base = if material.is_some() { base } else { [1.0; 3] };
                colors
                    .into_iter()
                    .map(|c| [c[0] * base[0], c[1] * base[1], c[2] * base[2]])
                    .collect()
            }
            None => vec![base; vertices.len()],
        };

        if self.colored {
            self.parts
                .colors
                .extend(multiplied.into_iter().map(|c: [f32; 3]| c.map(srgb_from_linear)));
        }
        shared.vertices.insert(key, start);
        Ok(start)
    }

    /// Returns the index of the primitive's first texture coordinate, if its material has a texture and the
    /// primitive has coordinates for it.
    fn uv_start(&mut self, p: &Primitive, vertices: usize, who: &str) -> Result<Option<u32>> {
        let Some(material) = p.material.map(|m| m.value()).filter(|_| is_textured(p, self.looks)) else {
            return Ok(None);
        };
        let mapping = self
            .looks
            .mappings
            .get(material)
            .copied()
            .ok_or_else(|| no_material(self.document, who))?;
        let Some(&accessor) = p.attributes.get(&Checked::Valid(Semantic::TexCoords(mapping.set))) else {
            self.notes.no_uvs += 1;
            return Ok(None);
        };

        let what = format!("TEXCOORD_{}", mapping.set);
        self.same_count(accessor, vertices, who, &what)?;
        if let Some(&start) = self.uv_starts.get(&(accessor.value(), material)) {
            return Ok(Some(start));
        }

        let uvs: Vec<[f32; 2]> = self.document.read_vectors(accessor, &format!("{who}, {what}"))?;
        let start = self.next_start(self.parts.uvs.len(), uvs.len())?;
        self.parts
            .uvs
            .extend(uvs.into_iter().map(|uv| mapping.apply(Vec2::from_array(uv))));
        self.uv_starts.insert((accessor.value(), material), start);
        Ok(Some(start))
    }

    /// Returns the index of the primitive's first normal, if it has normals.
    fn normal_start(
        &mut self,
        instance: &Instance,
        p: &Primitive,
        vertices: usize,
        who: &str,
        shared: &mut Shared,
    ) -> Result<Option<u32>> {
        let Some(&accessor) = p.attributes.get(&Checked::Valid(Semantic::Normals)) else { return Ok(None) };
        self.same_count(accessor, vertices, who, "NORMAL")?;
        if let Some(&start) = shared.normals.get(&accessor.value()) {
            return Ok(Some(start));
        }

        let normals: Vec<[f32; 3]> = self.document.read_vectors(accessor, &format!("{who}, NORMAL"))?;
        let start = self.next_start(self.parts.normals.len(), normals.len())?;
        // Normals turn with the inverse transpose. The matrix of cofactors is a multiple of it, and exists
        // for flat scales too.
        let m = DMat3::from_mat4(instance.world_from_node);
        let [x, y, z] = [m.x_axis, m.y_axis, m.z_axis];
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * m.determinant().signum();

        self.parts.normals.extend(normals.into_iter().map(|n| {
            let turned = cofactors * Vec3::from_array(n).as_dvec3();
            // A normal without length becomes NaN, which the check of the mesh removes.
            self.up.world_from_file((turned / turned.length()).as_vec3())
        }));
        shared.normals.insert(accessor.value(), start);
        Ok(Some(start))
    }

    /// Checks that an accessor has one element for each vertex.
    fn same_count(&self, accessor: Index<Accessor>, vertices: usize, who: &str, what: &str) -> Result<()> {
        let n = self.document.get(accessor, who, "accessor")?.count.0;
        if n == vertices as u64 {
            return Ok(());
        }
        Err(self
            .document
            .fail(format!("{who}: {n} elements of {what} for {vertices} vertices")))
    }

    /// Returns the index of the next element, if `more` of them fit.
    fn next_start(&self, length: usize, more: usize) -> Result<u32> {
        match u32::try_from(length + more) {
            Ok(end) if end < NO_INDEX => Ok(length as u32),
            _ => Err(self
                .document
                .fail("has more vertices than 32 bits count; cut the scan into parts")),
        }
    }

    /// Returns the columns, without materials and textures. Adds what was left out to `warnings`.
    pub(crate) fn finish(self, warnings: &mut Vec<String>) -> MeshParts {
        let Self { mut parts, notes, .. } = self;
        let has_materials = parts.face_materials.iter().any(|&m| m != NO_INDEX);
        if !has_materials {
            parts.face_materials.clear();
        }
        for column in [&mut parts.face_uvs, &mut parts.face_normals] {
            if column.iter().all(|c| *c == [NO_INDEX; 3]) {
                column.clear();
            }
        }

        for (n, what, then) in [
            (notes.no_triangles, "primitive", "without triangles left out (points, lines or no positions)"),
            (notes.left_over_corners, "corner", "too many for whole triangles left out"),
            (
                notes.no_uvs,
                "primitive",
                "without the coordinates of its texture drawn in the material's colour",
            ),
            (
                notes.colors_over_textures,
                "primitive",
                "with colours of vertices over a texture: only the texture counts",
            ),
            (notes.skinned, "skinned mesh", "taken as modelled: joints move nothing"),
            (notes.morphed, "primitive", "with morph targets taken as modelled"),
        ] {
            if n > 0 {
                warnings.push(format!("{} {then}", count(n, what)));
            }
        }

        parts
    }
}

/// Adds `start` to the corners of a triangle. Returns [`NO_INDEX`] for each if there is no start.
fn shifted(triangle: [u32; 3], start: Option<u32>) -> [u32; 3] {
    start.map_or([NO_INDEX; 3], |start| triangle.map(|v| start + v))
}

fn color_accessor(p: &Primitive) -> Option<Index<Accessor>> {
    p.attributes.get(&Checked::Valid(Semantic::Colors(0))).copied()
}

fn is_textured(p: &Primitive, looks: &GltfLooks) -> bool {
    p.material
        .and_then(|m| looks.materials.get(m.value()))
        .is_some_and(|m| m.texture.is_some())
}

/// Every material that a primitive names was looked up before. This error is for another caller of the
/// builder.
fn no_material(document: &GltfDocument, who: &str) -> Error {
    document.fail(format!("{who} has a material that is not there"))
}

/// Returns the triangles of `corners`. Source: glTF 2.0, section 3.7.2.1.
fn triangles_of(corners: &[u32], mode: Mode) -> Vec<[u32; 3]> {
    match mode {
        Mode::Triangles => corners.as_chunks::<3>().0.to_vec(),
        Mode::TriangleStrip => corners
            .array_windows()
            .enumerate()
            .map(|(i, &[a, b, c])| if i % 2 == 0 { [a, b, c] } else { [a, c, b] })
            .collect(),
        Mode::TriangleFan => {
            let Some((&hub, rim)) = corners.split_first() else { return Vec::new() };
            rim.array_windows().map(|&[a, b]| [a, b, hub]).collect()
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strips_and_fans() {
        assert_eq!(triangles_of(&[0, 1, 2, 3, 4], Mode::TriangleStrip), [[0, 1, 2], [1, 3, 2], [2, 3, 4]]);
        assert_eq!(triangles_of(&[0, 1, 2, 3], Mode::TriangleFan), [[1, 2, 0], [2, 3, 0]]);
        assert_eq!(triangles_of(&[0, 1, 2, 3], Mode::Triangles), [[0, 1, 2]]);
        for mode in [Mode::TriangleStrip, Mode::TriangleFan, Mode::Triangles] {
            assert!(triangles_of(&[0, 1], mode).is_empty() && triangles_of(&[], mode).is_empty());
        }
    }
}
