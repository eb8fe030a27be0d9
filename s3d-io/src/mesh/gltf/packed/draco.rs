//! Unpacks primitives that Draco compressed. Source: the extension KHR_draco_mesh_compression.
//!
//! draco-core is a port of Google's decoder to Rust without unsafe code. Its limits hold the counts of a
//! stream against what the file may unpack to.

use crate::error::Result;
use crate::fs::quote::quote;
use crate::guarded::guarded;
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::extensions::DRACO;
use crate::mesh::gltf::packed::unpack::{Room, push_buffer};
use crate::mesh::gltf::words::index_of;
use draco_core::decode_limits::DecodeLimits;
use draco_core::decoder_buffer::DecoderBuffer;
use draco_core::mesh_decoder::MeshDecoder;
use draco_core::{DataType, Mesh, PointAttribute};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Index, Root};
use std::collections::HashSet;

/// The error is a sentence that follows the name of the extension.
type SentenceResult<T> = std::result::Result<T, String>;

/// A column of a primitive in plain form.
struct Column {
    /// `None` for the indices.
    semantic: Option<Semantic>,
    kind: Type,
    component: ComponentType,
    count: usize,
    bytes: Vec<u8>,
}

impl GltfDocument {
    /// Replaces the primitives whose only form is Draco's, in the meshes that nodes have.
    pub(crate) fn unpack_draco(&mut self, room: &mut Room) -> Result<()> {
        let root = self.root();
        let placed: HashSet<usize> = root.nodes.iter().filter_map(|n| Some(n.mesh?.value())).collect();

        let mut unpacked = Vec::new();
        for (m, mesh) in root.meshes.iter().enumerate().filter(|(m, _)| placed.contains(m)) {
            for (p, primitive) in mesh.primitives.iter().enumerate() {
                if !needs_unpacking(root, primitive) {
                    continue;
                }
                let name = mesh.name.as_ref();
                let name = name.map_or_else(String::new, |n| format!(" {}", quote(n.as_bytes())));
                let who = format!("mesh {m}{name}, primitive {p}: its extension {DRACO}");
                let columns = self.unpacked_primitive(primitive, &who, room)?;
                unpacked.push((m, p, columns));
            }
        }

        if !unpacked.is_empty() {
            self.edit(|root, buffers| {
                for (m, p, columns) in unpacked {
                    for column in columns {
                        replace_column(root, buffers, m, p, column);
                    }
                }
            });
        }
        Ok(())
    }

    /// Returns the columns that are read of a primitive.
    fn unpacked_primitive(&self, primitive: &Primitive, who: &str, room: &mut Room) -> Result<Vec<Column>> {
        let fail = |why: String| self.fail(format!("{who} {why}"));
        let extension = primitive.extensions.as_ref().and_then(|e| e.others.get(DRACO));
        let view = extension.and_then(|e| index_of(e.get("bufferView")?));
        let view = view.ok_or_else(|| fail("names no buffer view".into()))?;
        let mesh = decode(self.view(Index::new(view), who)?, room).map_err(fail)?;

        let corners = mesh.num_faces().saturating_mul(3);
        room.take((corners as u64).saturating_mul(4)).map_err(fail)?;
        self.check_count(primitive.indices, corners, "corners", who)?;
        let indices = mesh.faces().iter().flatten().map(|point| point.0);
        let mut columns = vec![Column {
            semantic: None,
            kind: Type::Scalar,
            component: ComponentType::U32,
            count: corners,
            bytes: indices.flat_map(u32::to_le_bytes).collect(),
        }];

        let ids = extension.and_then(|e| e.get("attributes"));
        for (name, &index) in &primitive.attributes {
            let Checked::Valid(semantic) = name else { continue };
            let is_read = matches!(
                semantic,
                Semantic::Positions | Semantic::Normals | Semantic::TexCoords(_) | Semantic::Colors(0)
            );
            let name = name.to_string();
            let Some(id) = ids.and_then(|ids| ids.get(&name)).filter(|_| is_read) else { continue };

            let attribute = index_of(id).and_then(|id| mesh.attribute_by_unique_id(id));
            let attribute = attribute.ok_or_else(|| fail(format!("has no attribute {id} for {name}")))?;
            self.check_count(Some(index), mesh.num_points(), &name, who)?;
            let accessor = self.get(index, who, "accessor")?;
            let column = column(semantic.clone(), accessor, attribute, mesh.num_points(), room);
            columns.push(column.map_err(|why| fail(format!("{why} ({name})")))?);
        }

        if !columns
            .iter()
            .any(|column| column.semantic == Some(Semantic::Positions))
        {
            return Err(fail("has no attribute for POSITION".into()));
        }
        Ok(columns)
    }

    /// Checks that an accessor has as many elements as Draco has.
    fn check_count(&self, index: Option<Index<Accessor>>, count: usize, what: &str, who: &str) -> Result<()> {
        let accessor = index.and_then(|index| self.root().get(index));
        match accessor.map(|accessor| accessor.count.0) {
            Some(claim) if claim != count as u64 => {
                Err(self.fail(format!("{who} has {count} elements of {what}, but the accessor has {claim}")))
            }
            _ => Ok(()),
        }
    }
}

/// Decodes a mesh.
fn decode(data: &[u8], room: &Room) -> SentenceResult<Mesh> {
    let limits = DecodeLimits::default()
        .with_max_points(room.0 / 4)
        .with_max_faces(room.0 / 12)
        .with_max_decoded_bytes(room.0);
    let mut mesh = Mesh::new();
    let mut buffer = DecoderBuffer::new(data).with_limits(limits);
    guarded(|| MeshDecoder::new().decode(&mut buffer, &mut mesh))
        .ok_or("is damaged")?
        .map_err(|e| format!("is damaged: {e}"))?;
    Ok(mesh)
}

/// Returns whether a primitive has triangles that only Draco has. Where a plain form is beside it, that is
/// read.
fn needs_unpacking(root: &Root, primitive: &Primitive) -> bool {
    let extension = primitive.extensions.as_ref().and_then(|e| e.others.get(DRACO));
    let Some(extension) = extension else { return false };
    if primitive.mode != Checked::Valid(Mode::Triangles) {
        return false;
    }

    let packed = extension.get("attributes");
    let attributes = primitive.attributes.iter().filter_map(|(name, index)| {
        let is_packed = packed.is_some_and(|all| all.get(name.to_string()).is_some());
        let is_position = *name == Checked::Valid(Semantic::Positions);
        (is_packed || is_position).then_some(index)
    });
    attributes.chain(&primitive.indices).any(|index| {
        let accessor = root.get(*index);
        accessor.is_some_and(|accessor| accessor.buffer_view.is_none() && accessor.sparse.is_none())
    })
}

/// Returns an attribute as floats. Integers are scaled as the accessor says.
fn column(
    semantic: Semantic,
    accessor: &Accessor,
    attribute: &PointAttribute,
    points: usize,
    room: &mut Room,
) -> SentenceResult<Column> {
    let width = usize::from(attribute.num_components());
    let kind = match width {
        2 => Type::Vec2,
        3 => Type::Vec3,
        4 => Type::Vec4,
        _ => return Err(format!("has {width} numbers a vertex")),
    };
    room.take((points as u64).saturating_mul(4 * width as u64))?;
    let largest = match accessor.component_type {
        Checked::Valid(GenericComponentType(ComponentType::F32)) if attribute.normalized() => {
            largest_of(attribute.data_type())
        }
        Checked::Valid(GenericComponentType(component)) if accessor.normalized => match component {
            ComponentType::I8 => Some(127.0),
            ComponentType::U8 => Some(255.0),
            ComponentType::I16 => Some(32767.0),
            ComponentType::U16 => Some(65535.0),
            ComponentType::U32 | ComponentType::F32 => None,
        },
        _ => None,
    };

    let numbers = guarded(|| attribute.read_f32s(points, width)).ok_or("is damaged")?;
    let scaled = numbers
        .into_iter()
        .map(|v| largest.map_or(v, |largest| (v / largest).max(-1.0)));
    let bytes = scaled.flat_map(f32::to_le_bytes).collect();
    Ok(Column { semantic: Some(semantic), kind, component: ComponentType::F32, count: points, bytes })
}

/// Returns what stands for 1 in a normalized attribute.
fn largest_of(kind: DataType) -> Option<f32> {
    match kind {
        DataType::Int8 => Some(127.0),
        DataType::Uint8 => Some(255.0),
        DataType::Int16 => Some(32767.0),
        DataType::Uint16 => Some(65535.0),
        DataType::Int32 => Some(i32::MAX as f32),
        DataType::Uint32 => Some(u32::MAX as f32),
        _ => None,
    }
}

/// Adds a column to the file, and lets a primitive use it.
fn replace_column(root: &mut Root, buffers: &mut Vec<Vec<u8>>, m: usize, p: usize, column: Column) {
    let buffer = push_buffer(root, column.bytes.len());
    let view = Index::new(root.buffer_views.len() as u32);
    root.buffer_views.push(View {
        buffer,
        byte_length: USize64::from(column.bytes.len()),
        byte_offset: None,
        byte_stride: None,
        name: None,
        target: None,
        extensions: None,
        extras: Default::default(),
    });
    buffers.push(column.bytes);

    let index = Index::new(root.accessors.len() as u32);
    root.accessors.push(Accessor {
        buffer_view: Some(view),
        byte_offset: None,
        count: USize64::from(column.count),
        component_type: Checked::Valid(GenericComponentType(column.component)),
        extensions: None,
        extras: Default::default(),
        type_: Checked::Valid(column.kind),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
    });

    let Some(primitive) = root.meshes.get_mut(m).and_then(|mesh| mesh.primitives.get_mut(p)) else { return };
    match column.semantic {
        Some(semantic) => {
            primitive.attributes.insert(Checked::Valid(semantic), index);
        }
        None => primitive.indices = Some(index),
    }
}
