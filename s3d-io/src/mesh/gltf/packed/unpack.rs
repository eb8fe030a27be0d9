//! Replaces the compressed parts of a glTF file with plain ones, so that all other readers meet plain data.

use crate::error::Result;
use crate::fs::quote::quote;
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::extensions::MESHOPT;
use crate::mesh::gltf::packed::filters;
use crate::mesh::gltf::packed::meshopt;
use gltf::json::buffer::{Buffer, View};
use gltf::json::validation::USize64;
use gltf::json::{Index, Root};
use serde_json::Value;

/// The most bytes of an unpacked byte: as much as deflate can do, and a little more than meshopt can.
const MOST_BYTES_OF_A_BYTE: u64 = 1032;
/// Bytes that even the smallest file may unpack to. A flat floor of any number of triangles is small.
const LEAST_ROOM: u64 = 1 << 24;

/// How many bytes the compressed parts of a file may still unpack to.
pub(crate) struct Room(pub(crate) u64);

impl Room {
    /// Takes bytes, or returns the end of a sentence.
    pub(crate) fn take(&mut self, bytes: u64) -> std::result::Result<(), String> {
        let left = self.0.checked_sub(bytes);
        let why =
            || format!("would unpack to {bytes} bytes, and {} are left for a file of this size", self.0);
        self.0 = left.ok_or_else(why)?;
        Ok(())
    }
}

impl GltfDocument {
    /// Replaces buffer views that meshopt compressed, and primitives that Draco did.
    ///
    /// # Errors
    /// A primitive of a mesh in the scene cannot be unpacked. A view that cannot is an error when it is read.
    pub(crate) fn unpack(&mut self) -> Result<()> {
        let packed = (0..).map_while(|b| self.buffer(b)).map(|b| b.len() as u64).sum::<u64>();
        let mut room = Room(packed.saturating_mul(MOST_BYTES_OF_A_BYTE).saturating_add(LEAST_ROOM));

        let views = self.unpacked_views(&mut room);
        if !views.is_empty() {
            self.edit(|root, buffers| {
                for (view, bytes) in views {
                    buffers.push(bytes);
                    let length = buffers.last().map_or(0, Vec::len);
                    let buffer = push_buffer(root, length);
                    if let Some(view) = root.buffer_views.get_mut(view) {
                        view.buffer = buffer;
                        view.byte_offset = None;
                        view.byte_length = USize64::from(length);
                    }
                }
            });
        }

        #[cfg(feature = "draco")]
        self.unpack_draco(&mut room)?;
        Ok(())
    }

    /// Returns the bytes of each view that meshopt compressed. Keeps the faults of the others.
    fn unpacked_views(&mut self, room: &mut Room) -> Vec<(usize, Vec<u8>)> {
        let mut unpacked = Vec::new();
        let mut faults = Vec::new();
        for (index, view) in self.root().buffer_views.iter().enumerate() {
            let Some((name, packed)) = packing(view) else { continue };
            match self.unpacked_view(packed, room) {
                Ok(bytes) => unpacked.push((index, bytes)),
                Err(why) => faults.push((index, format!("{why} ({name})"))),
            }
        }
        self.view_faults.extend(faults);
        unpacked
    }

    /// Unpacks a view.
    ///
    /// # Errors
    /// The error is a sentence that follows the name of the view.
    fn unpacked_view(&self, packed: &Value, room: &mut Room) -> std::result::Result<Vec<u8>, String> {
        let number = |key: &str| whole(packed.get(key)?);
        let needed = |key: &str| number(key).ok_or_else(|| format!("has no {key}"));
        let word = |key: &str| packed.get(key).and_then(Value::as_str);
        let buffer = needed("buffer")?;
        let length = needed("byteLength")?;
        let stride = needed("byteStride")?;
        let count = needed("count")?;

        let start = number("byteOffset").unwrap_or(0);
        let bytes = self.buffer(buffer).unwrap_or_default();
        let data = bytes
            .get(start..)
            .and_then(|bytes| bytes.get(..length))
            .ok_or_else(|| {
                let has = bytes.len();
                format!("takes {length} bytes from {start}, but buffer {buffer} has {has}")
            })?;
        room.take((count as u64).saturating_mul(stride as u64))?;

        let mode = word("mode").unwrap_or_default();
        let filter = word("filter").unwrap_or("NONE");
        let unknown = || {
            let [mode, filter] = [mode, filter].map(|word| quote(word.as_bytes()));
            format!(
                "has {stride} bytes an element in the mode {mode} with the filter {filter}, which cannot be"
            )
        };
        let indices = match (mode, filter, stride) {
            ("TRIANGLES", "NONE", 2 | 4) => meshopt::triangles(data, count),
            ("INDICES", "NONE", 2 | 4) => meshopt::indices(data, count),
            ("ATTRIBUTES", "OCTAHEDRAL" | "COLOR", 4 | 8)
            | ("ATTRIBUTES", "QUATERNION", 8)
            | ("ATTRIBUTES", "NONE" | "EXPONENTIAL", 4..=meshopt::MAX_STRIDE)
                if stride.is_multiple_of(4) =>
            {
                let attributes = meshopt::attributes(data, count, stride);
                return attributes
                    .map(|bytes| filtered(bytes, filter, stride))
                    .ok_or_else(damaged);
            }
            _ => return Err(unknown()),
        };

        let indices = indices.ok_or_else(damaged)?;
        Ok(if stride == 2 {
            indices
                .into_iter()
                .flat_map(|index| (index as u16).to_le_bytes())
                .collect()
        } else {
            indices.into_iter().flat_map(u32::to_le_bytes).collect()
        })
    }
}

fn damaged() -> String {
    "is compressed, and its data are damaged".into()
}

fn filtered(mut bytes: Vec<u8>, filter: &str, stride: usize) -> Vec<u8> {
    match filter {
        "OCTAHEDRAL" => filters::octahedral(&mut bytes, stride),
        "QUATERNION" => filters::quaternions(&mut bytes),
        "EXPONENTIAL" => filters::exponential(&mut bytes),
        "COLOR" => filters::colors(&mut bytes, stride),
        _ => {}
    }
    bytes
}

/// Returns how meshopt compressed a view, with the name of the extension.
fn packing(view: &View) -> Option<(&'static str, &Value)> {
    let extensions = &view.extensions.as_ref()?.others;
    MESHOPT.into_iter().find_map(|name| Some((name, extensions.get(name)?)))
}

/// Reads a whole number, even if the JSON writes it as a decimal fraction.
pub(crate) fn whole(value: &Value) -> Option<usize> {
    let float = || value.as_f64().filter(|v| v.fract() == 0.0 && (0.0..9e15).contains(v));
    let number = value.as_u64().or_else(|| float().map(|v| v as u64))?;
    usize::try_from(number).ok()
}

/// Adds a buffer to the JSON.
pub(crate) fn push_buffer(root: &mut Root, length: usize) -> Index<Buffer> {
    let index = Index::new(root.buffers.len() as u32);
    root.buffers.push(Buffer {
        byte_length: USize64::from(length),
        name: None,
        uri: None,
        extensions: None,
        extras: Default::default(),
    });
    index
}
