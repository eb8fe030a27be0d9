//! The numbers of glTF accessors, every range checked before it is read.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::Result;
use crate::mesh::gltf::document::GltfDocument;
use gltf::json::Index;
use gltf::json::accessor::{Accessor, ComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::validation::Checked;

/// The most elements of an accessor that has no data: one made of zeros and sparse changes can claim any number. Those
/// that are lawful are of morph targets, which are not read.
const MAX_WITHOUT_DATA: u64 = 1 << 20;

/// The elements of an accessor, each of `width` numbers. `f64` holds every component type exactly.
struct Numbers {
    width: usize,
    component: ComponentType,
    values: Vec<f64>,
}

impl GltfDocument {
    /// The elements of an accessor of `N` numbers each; integers are scaled to 0…1 or −1…1 where the accessor says so.
    /// `who` is for messages: "mesh 0, primitive 1, POSITION".
    pub(crate) fn read_vectors<const N: usize>(
        &self,
        index: Index<Accessor>,
        who: &str,
    ) -> Result<Vec<[f32; N]>> {
        let numbers = self.numbers(index, who)?;
        if numbers.width != N {
            return Err(self
                .fail(format!("{who}: accessor {index} has {} numbers an element, not {N}", numbers.width)));
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "vectors are rounded to f32, which they mostly came as"
        )]
        Ok(numbers.values.as_chunks::<N>().0.iter().map(|e| e.map(|v| v as f32)).collect())
    }

    /// Colours: elements of three numbers, or of four, the last of which is left out.
    pub(crate) fn read_colors(&self, index: Index<Accessor>, who: &str) -> Result<Vec<[f32; 3]>> {
        let numbers = self.numbers(index, who)?;
        #[expect(clippy::cast_possible_truncation, reason = "colours are rounded to f32")]
        let color = |[r, g, b]: [f64; 3]| [r as f32, g as f32, b as f32];
        match numbers.width {
            3 => Ok(numbers.values.as_chunks().0.iter().map(|rgb| color(*rgb)).collect()),
            4 => Ok(numbers.values.as_chunks().0.iter().map(|&[r, g, b, _]| color([r, g, b])).collect()),
            width => Err(self.fail(format!("{who}: accessor {index} has {width} numbers a colour"))),
        }
    }

    /// Indices of vertices.
    pub(crate) fn read_indices(&self, index: Index<Accessor>, who: &str) -> Result<Vec<u32>> {
        let numbers = self.numbers(index, who)?;
        let whole = matches!(numbers.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        if numbers.width != 1 || !whole {
            return Err(self.fail(format!("{who}: accessor {index} does not hold single unsigned integers")));
        }
        #[expect(clippy::cast_possible_truncation, reason = "each was an integer of at most 32 bits")]
        Ok(numbers.values.into_iter().map(|v| v as u32).collect())
    }

    fn numbers(&self, index: Index<Accessor>, who: &str) -> Result<Numbers> {
        let accessor = self.get(index, who, "accessor")?;
        let name = format!("{who}: accessor {index}");
        let (Checked::Valid(component), Checked::Valid(kind)) = (accessor.component_type, accessor.type_)
        else {
            return Err(self.fail(format!("{name} has an unknown type")));
        };
        let (component, width) = (component.0, width_of(kind));
        let mut values = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.map_or(0, |o| o.0);
                self.elements(view, offset, accessor.count.0, width, component, true, &name)?
            }
            None => {
                let count = Some(accessor.count.0).filter(|n| *n <= MAX_WITHOUT_DATA);
                let numbers = count
                    .and_then(|n| usize::try_from(n).ok())
                    .and_then(|n| n.checked_mul(width))
                    .ok_or_else(|| {
                        self.fail(format!("{name} claims {} elements without data", accessor.count.0))
                    })?;
                vec![0.0; numbers]
            }
        };
        if let Some(sparse) = &accessor.sparse {
            let Checked::Valid(index_type) = sparse.indices.component_type else {
                return Err(self.fail(format!("{name}: its sparse indices have an unknown type")));
            };
            let (at, n) = (&sparse.indices, sparse.count.0);
            let places = self.elements(at.buffer_view, at.byte_offset.0, n, 1, index_type.0, false, &name)?;
            let at = &sparse.values;
            let changes =
                self.elements(at.buffer_view, at.byte_offset.0, n, width, component, false, &name)?;
            for (&place, change) in places.iter().zip(changes.chunks_exact(width)) {
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "a whole number; what is too large is not there"
                )]
                let start = (place as usize).saturating_mul(width);
                match values.get_mut(start..).and_then(|v| v.get_mut(..width)) {
                    Some(element) => element.copy_from_slice(change),
                    None => {
                        let count = accessor.count.0;
                        return Err(self.fail(format!("{name}: sparse index {place} of {count} elements")));
                    }
                }
            }
        }
        if accessor.normalized {
            values.iter_mut().for_each(|v| *v = normalized(*v, component));
        }
        Ok(Numbers { width, component, values })
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "an accessor and its two sparse parts differ in all of them"
    )]
    fn elements(
        &self,
        view: Index<View>,
        offset: u64,
        count: u64,
        width: usize,
        component: ComponentType,
        strided: bool,
        name: &str,
    ) -> Result<Vec<f64>> {
        let bytes = self.view(view, name)?;
        let size = width.saturating_mul(component.size());
        let stride = match self.get(view, name, "buffer view")?.byte_stride {
            Some(stride) if strided && stride.0 > 0 => stride.0 as u64,
            _ => size as u64,
        };
        let Some(before_last) = count.checked_sub(1) else { return Ok(Vec::new()) };
        let inside = || {
            let end = before_last.checked_mul(stride)?.checked_add(offset)?.checked_add(size as u64)?;
            let is_inside = end <= bytes.len() as u64 && stride >= size as u64;
            let [offset, stride, count] = [offset, stride, count].map(|n| usize::try_from(n).ok());
            Some((bytes.get(offset?..)?, stride?, count?)).filter(|_| is_inside)
        };
        let Some((bytes, stride, count)) = inside() else {
            let length = bytes.len();
            return Err(self.fail(format!(
                "{name} takes {count} elements of {size} bytes, each {stride} after the last, from byte {offset}, but its buffer view has {length}"
            )));
        };
        let elements = bytes.chunks(stride).take(count).filter_map(|element| element.get(..size));
        let mut values = Vec::with_capacity(count.saturating_mul(width));
        macro_rules! numbers {
            ($type:ty) => {
                for element in elements {
                    let numbers = element.as_chunks().0.iter();
                    values.extend(numbers.map(|b| f64::from(<$type>::from_le_bytes(*b))));
                }
            };
        }
        match component {
            ComponentType::I8 => numbers!(i8),
            ComponentType::U8 => numbers!(u8),
            ComponentType::I16 => numbers!(i16),
            ComponentType::U16 => numbers!(u16),
            ComponentType::U32 => numbers!(u32),
            ComponentType::F32 => numbers!(f32),
        }
        Ok(values)
    }
}

fn width_of(kind: Type) -> usize {
    match kind {
        Type::Scalar => 1,
        Type::Vec2 => 2,
        Type::Vec3 => 3,
        Type::Vec4 | Type::Mat2 => 4,
        Type::Mat3 => 9,
        Type::Mat4 => 16,
    }
}

/// glTF 2.0, section 3.11.
fn normalized(v: f64, component: ComponentType) -> f64 {
    match component {
        ComponentType::I8 => (v / 127.0).max(-1.0),
        ComponentType::U8 => v / 255.0,
        ComponentType::I16 => (v / 32_767.0).max(-1.0),
        ComponentType::U16 => v / 65_535.0,
        ComponentType::U32 | ComponentType::F32 => v,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use base64::engine::general_purpose::STANDARD;

    /// A document of one buffer of the bytes 0, 1, 2 … 63 and one view over it, `view` added to the view's JSON.
    fn document(view: &str, accessor: &str) -> (tempfile::TempDir, GltfDocument) {
        let data = STANDARD.encode((0..64).collect::<Vec<u8>>());
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": 64, "uri": "data:;base64,{data}"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 64{view}}}], "accessors": [{accessor}]}}"#
        );
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.gltf");
        std::fs::write(&path, json).unwrap();
        let document = GltfDocument::open(&path).unwrap();
        (dir, document)
    }

    fn vectors(view: &str, accessor: &str) -> std::result::Result<Vec<[f32; 2]>, String> {
        document(view, accessor).1.read_vectors(Index::new(0), "who").map_err(|e| e.to_string())
    }

    #[test]
    fn strides_and_offsets() {
        let a = r#"{"bufferView": 0, "byteOffset": 1, "componentType": 5121, "type": "VEC2", "count": 2}"#;
        assert_eq!(vectors("", a).unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
        assert_eq!(vectors(r#", "byteStride": 4"#, a).unwrap(), [[1.0, 2.0], [5.0, 6.0]]);
    }

    #[test]
    fn the_last_element_may_end_with_the_buffer() {
        let a = r#"{"bufferView": 0, "byteOffset": 62, "componentType": 5121, "type": "VEC2", "count": 1}"#;
        assert_eq!(vectors(r#", "byteStride": 8"#, a).unwrap(), [[62.0, 63.0]]);
        let a = r#"{"bufferView": 0, "byteOffset": 62, "componentType": 5121, "type": "VEC2", "count": 2}"#;
        assert!(vectors("", a).unwrap_err().contains("its buffer view has 64"));
    }

    #[test]
    fn integers_are_scaled_where_the_accessor_says_so() {
        let a = r#"{"bufferView": 0, "componentType": 5121, "normalized": true, "type": "VEC2", "count": 1}"#;
        assert_eq!(vectors("", a).unwrap(), [[0.0, 1.0 / 255.0]]);
        let a = r#"{"bufferView": 0, "componentType": 5122, "type": "VEC2", "count": 1}"#;
        assert_eq!(vectors("", a).unwrap(), [[256.0, 770.0]]);
        assert_eq!(normalized(-128.0, ComponentType::I8), -1.0);
    }

    #[test]
    fn sparse_changes_apply_with_and_without_data() {
        let sparse = r#""sparse": {"count": 2, "indices": {"bufferView": 0, "componentType": 5121},
            "values": {"bufferView": 0, "byteOffset": 10}}"#;
        let a = format!(r#"{{"componentType": 5121, "type": "VEC2", "count": 3, {sparse}}}"#);
        assert_eq!(vectors("", &a).unwrap(), [[10.0, 11.0], [12.0, 13.0], [0.0, 0.0]]);
        let a = format!(
            r#"{{"bufferView": 0, "byteOffset": 20, "componentType": 5121, "type": "VEC2", "count": 1, {sparse}}}"#
        );
        assert!(vectors("", &a).unwrap_err().contains("sparse index 1 of 1"));
        let a =
            format!(r#"{{"componentType": 5121, "type": "VEC2", "count": 18446744073709551615, {sparse}}}"#);
        assert!(vectors("", &a).unwrap_err().contains("without data"));
    }

    #[test]
    fn claims_beyond_the_data_are_refused() {
        for claim in ["18446744073709551615", "33", "9223372036854775808"] {
            let a =
                format!(r#"{{"bufferView": 0, "componentType": 5121, "type": "VEC2", "count": {claim}}}"#);
            assert!(vectors("", &a).unwrap_err().contains("who: accessor 0 takes"), "{claim}");
        }
        let a = r#"{"bufferView": 0, "byteOffset": 18446744073709551615, "componentType": 5121, "type": "VEC2", "count": 1}"#;
        assert!(vectors("", a).is_err());
        let a = r#"{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 1}"#;
        assert!(vectors("", a).unwrap_err().contains("3 numbers an element, not 2"));
        let a = r#"{"bufferView": 0, "componentType": 1, "type": "VEC2", "count": 1}"#;
        assert!(vectors("", a).unwrap_err().contains("unknown type"));
        let a = r#"{"bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": 1}"#;
        let (_dir, document) = document("", a);
        assert!(document.read_indices(Index::new(0), "who").unwrap_err().to_string().contains("unsigned"));
    }
}
