//! Reads the numbers of glTF accessors.
//!
//! The utilities of the gltf crate decode them. But they panic on indices that are out of range, counts of 0,
//! unknown types and sums that overflow (`claims_beyond_the_data_are_refused`), reserve memory for any count
//! without data (`sparse_changes_apply_with_and_without_data`) and accept sparse indices that do not grow
//! (`sparse_indices_grow`). So every range is checked here before they read it.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::Result;
use crate::mesh::gltf::document::GltfDocument;
use gltf::accessor::{DataType, Item, Iter};
use gltf::json::Index;
use gltf::json::accessor::{Accessor, sparse::Sparse};
use gltf::json::buffer::View;
use gltf::json::validation::Checked;
use s3d_geom::NO_INDEX;

/// The most elements of an accessor without data. An accessor of zeros and sparse changes can claim any
/// number. Lawful ones belong to morph targets, which are not read.
const MAX_WITHOUT_DATA: u64 = 1 << 20;

impl GltfDocument {
    /// Reads the elements of an accessor, `N` numbers each. Integers are scaled to 0…1 or −1…1 if the
    /// accessor says so. `who` is for messages: "mesh 0, primitive 1, POSITION".
    pub(crate) fn read_vectors<const N: usize>(
        &self,
        index: Index<Accessor>,
        who: &str,
    ) -> Result<Vec<[f32; N]>>
    where
        [i8; N]: Item,
        [u8; N]: Item,
        [i16; N]: Item,
        [u16; N]: Item,
        [u32; N]: Item,
        [f32; N]: Item,
    {
        let (accessor, width) = self.checked(index, who)?;
        if width != N {
            return Err(self.fail(format!("{who}: accessor {index} has {width} numbers an element, not {N}")));
        }
        if accessor.count() == 0 {
            return Ok(Vec::new());
        }

        let zeros = || vec![[0.0; N]; accessor.count()];
        macro_rules! vectors {
            ($type:ty, $largest:expr) => {{
                let largest: Option<f64> = $largest;
                #[expect(
                    clippy::cast_possible_truncation,
                    reason = "vectors are rounded to f32, which they mostly came as"
                )]
                let number = |v: $type| match largest {
                    // glTF 2.0, section 3.11.
                    Some(largest) if accessor.normalized() => (f64::from(v) / largest).max(-1.0) as f32,
                    _ => f64::from(v) as f32,
                };
                self.iter::<[$type; N]>(&accessor)
                    .map_or_else(zeros, |all| all.map(|e| e.map(number)).collect())
            }};
        }

        Ok(match accessor.data_type() {
            DataType::I8 => vectors!(i8, Some(127.0)),
            DataType::U8 => vectors!(u8, Some(255.0)),
            DataType::I16 => vectors!(i16, Some(32_767.0)),
            DataType::U16 => vectors!(u16, Some(65_535.0)),
            DataType::U32 => vectors!(u32, None),
            DataType::F32 => vectors!(f32, None),
        })
    }

    /// Reads colours. Elements have three numbers, or four of which the last is left out.
    pub(crate) fn read_colors(&self, index: Index<Accessor>, who: &str) -> Result<Vec<[f32; 3]>> {
        match self.checked(index, who)?.1 {
            3 => self.read_vectors(index, who),
            4 => Ok(self
                .read_vectors(index, who)?
                .into_iter()
                .map(|[r, g, b, _]| [r, g, b])
                .collect()),
            width => Err(self.fail(format!("{who}: accessor {index} has {width} numbers a colour"))),
        }
    }

    /// Reads vertex indices.
    pub(crate) fn read_indices(&self, index: Index<Accessor>, who: &str) -> Result<Vec<u32>> {
        let (accessor, width) = self.checked(index, who)?;
        if accessor.count() == 0 {
            return Ok(Vec::new());
        }
        let zeros = || vec![0; accessor.count()];
        match accessor.data_type() {
            DataType::U8 if width == 1 => Ok(self
                .iter(&accessor)
                .map_or_else(zeros, |all| all.map(u8::into).collect())),
            DataType::U16 if width == 1 => Ok(self
                .iter(&accessor)
                .map_or_else(zeros, |all| all.map(u16::into).collect())),
            DataType::U32 if width == 1 => Ok(self.iter(&accessor).map_or_else(zeros, Iterator::collect)),
            _ => Err(self.fail(format!("{who}: accessor {index} does not hold single unsigned integers"))),
        }
    }

    /// Reads ids, which numbers of any type may hold. Returns [`NO_INDEX`] for negative numbers, and for
    /// floats beyond 32 bits.
    pub(crate) fn read_ids(&self, index: Index<Accessor>, who: &str) -> Result<Vec<u32>> {
        let (accessor, width) = self.checked(index, who)?;
        if width != 1 {
            return Err(self.fail(format!("{who}: accessor {index} has {width} numbers an id")));
        }
        if accessor.count() == 0 {
            return Ok(Vec::new());
        }
        let zeros = || vec![0; accessor.count()];
        macro_rules! ids {
            ($type:ty, $id:expr) => {
                self.iter::<$type>(&accessor)
                    .map_or_else(zeros, |all| all.map($id).collect())
            };
        }

        Ok(match accessor.data_type() {
            DataType::I8 => ids!(i8, |id| u32::try_from(id).unwrap_or(NO_INDEX)),
            DataType::I16 => ids!(i16, |id| u32::try_from(id).unwrap_or(NO_INDEX)),
            DataType::U8 | DataType::U16 | DataType::U32 => self.read_indices(index, who)?,
            DataType::F32 => ids!(f32, id_of),
        })
    }

    /// Returns the elements of a checked accessor that is not empty. Returns `None` if it has no data, so
    /// that all its numbers are zeros.
    fn iter<'a, T: Item>(&'a self, accessor: &gltf::Accessor<'a>) -> Option<Iter<'a, T>> {
        Iter::new(accessor.clone(), |buffer| self.buffer(buffer.index()))
    }

    /// Checks that an accessor can be read. Returns it, and how many numbers an element has.
    fn checked(&self, index: Index<Accessor>, who: &str) -> Result<(gltf::Accessor<'_>, usize)> {
        let json = self.get(index, who, "accessor")?;
        let name = format!("{who}: accessor {index}");
        let (Checked::Valid(component), Checked::Valid(kind)) = (json.component_type, json.type_) else {
            return Err(self.fail(format!("{name} has an unknown type")));
        };
        let count = json.count.0;
        let width = kind.multiplicity();
        let size = width.saturating_mul(component.0.size());

        match json.buffer_view {
            Some(view) => {
                self.range(view, json.byte_offset.map_or(0, |o| o.0), count, size, &name)?;
            }
            None if count > MAX_WITHOUT_DATA => {
                return Err(self.fail(format!("{name} claims {count} elements without data")));
            }
            None => {}
        }

        // A sparse part without changes was removed by `GltfDocument::read`.
        if let Some(sparse) = &json.sparse {
            self.check_sparse(sparse, count, size, &name)?;
        }
        let missing = || self.fail(format!("{name} is not there"));
        Ok((self.json.accessors().nth(index.value()).ok_or_else(missing)?, width))
    }
    /// Checks the changes of a sparse accessor of `count` elements of `size` bytes.
    fn check_sparse(&self, sparse: &Sparse, count: u64, size: usize, name: &str) -> Result<()> {
        let Checked::Valid(component) = sparse.indices.component_type else {
            return Err(self.fail(format!("{name}: its sparse indices have an unknown type")));
        };
        let changes = sparse.count.0;
        let index_size = component.0.size();
        let indices = &sparse.indices;
        let (bytes, stride) =
            self.range(indices.buffer_view, indices.byte_offset.0, changes, index_size, name)?;

        let mut least = 0;
        for index in bytes
            .chunks(stride)
            .take(usize::try_from(changes).unwrap_or(usize::MAX))
        {
            let index = index
                .iter()
                .take(index_size)
                .rev()
                .fold(0u64, |n, b| n << 8 | u64::from(*b));
            if index >= count {
                return Err(self.fail(format!("{name}: sparse index {index} of {count} elements")));
            }
            if index < least {
                return Err(self.fail(format!("{name}: its sparse indices do not grow at {index}")));
            }
            least = index.saturating_add(1);
        }

        let values = &sparse.values;
        self.range(values.buffer_view, values.byte_offset.0, changes, size, name)?;
        Ok(())
    }

    /// Returns the bytes of a buffer view from `offset` on, which hold `count` elements of `size` bytes, and
    /// the distance from one element to the next.
    fn range(
        &self,
        view: Index<View>,
        offset: u64,
        count: u64,
        size: usize,
        name: &str,
    ) -> Result<(&[u8], usize)> {
        let bytes = self.view(view, name)?;
        let stride = self
            .get(view, name, "buffer view")?
            .byte_stride
            .map_or(0, |stride| stride.0);
        let stride = if stride == 0 { size } else { stride };

        let Some(before_last) = count.checked_sub(1) else { return Ok((&[], stride)) };
        let inside = || {
            let end = before_last
                .checked_mul(stride as u64)?
                .checked_add(offset)?
                .checked_add(size as u64)?;
            let bytes = bytes.get(usize::try_from(offset).ok()?..)?;
            (end <= offset.checked_add(bytes.len() as u64)? && stride >= size).then_some(bytes)
        };

        let bytes = inside().ok_or_else(|| {
            let length = bytes.len();
            self.fail(format!(
                "{name} takes {count} elements of {size} bytes, each {stride} after the last, \
                 from byte {offset}, but its buffer view has {length}"
            ))
        })?;
        Ok((bytes, stride))
    }
}

/// Returns the id that a float is. Floats are exact up to 2²⁴.
#[expect(clippy::cast_possible_truncation, reason = "the range is checked")]
fn id_of(number: f32) -> u32 {
    let rounded = number.round();
    if (0.0..NO_INDEX as f32).contains(&rounded) {
        rounded as u32
    } else {
        NO_INDEX
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use base64::Engine;
    use base64::engine::general_purpose::STANDARD;

    /// Makes a document with one buffer of the bytes 0, 1, 2 … 63 and one view over it. `view` is added to
    /// the JSON of the view.
    fn document(view: &str, accessor: &str) -> (tempfile::TempDir, GltfDocument) {
        let data = STANDARD.encode((0..64).collect::<Vec<u8>>());
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": 64,
            "uri": "data:;base64,{data}"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 64{view}}}], "accessors": [{accessor}]}}"#
        );
        open(&json)
    }

    fn open(json: &str) -> (tempfile::TempDir, GltfDocument) {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.gltf");
        std::fs::write(&path, json).unwrap();
        let document = GltfDocument::open(&path).unwrap();
        (dir, document)
    }

    fn vectors(view: &str, accessor: &str) -> std::result::Result<Vec<[f32; 2]>, String> {
        document(view, accessor)
            .1
            .read_vectors(Index::new(0), "who")
            .map_err(|e| e.to_string())
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
        let bytes = STANDARD.encode([0x80, 0x7f]);
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": 2,
            "uri": "data:;base64,{bytes}"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 2}}], "accessors": [{{"bufferView": 0,
            "componentType": 5120,
            "normalized": true, "type": "VEC2", "count": 1}}]}}"#
        );
        assert_eq!(open(&json).1.read_vectors(Index::new(0), "who").unwrap(), [[-1.0, 1.0]]);
    }

    #[test]
    fn sparse_changes_apply_with_and_without_data() {
        let sparse = r#""sparse": {"count": 2, "indices": {"bufferView": 0, "componentType": 5121},
            "values": {"bufferView": 0, "byteOffset": 10}}"#;
        let a = format!(r#"{{"componentType": 5121, "type": "VEC2", "count": 3, {sparse}}}"#);
        assert_eq!(vectors("", &a).unwrap(), [[10.0, 11.0], [12.0, 13.0], [0.0, 0.0]]);
        let a = format!(
            r#"{{"bufferView": 0, "byteOffset": 20, "componentType": 5121, "type": "VEC2", "count": 1,
            {sparse}}}"#
        );
        assert!(vectors("", &a).unwrap_err().contains("sparse index 1 of 1"));
        let a =
            format!(r#"{{"componentType": 5121, "type": "VEC2", "count": 18446744073709551615, {sparse}}}"#);
        assert!(vectors("", &a).unwrap_err().contains("without data"));
    }

    #[test]
    fn sparse_indices_grow() {
        // The bytes are 0, 1, 2…, so the 16-bit indices are 256, 770….
        let sparse = r#"{"componentType": 5121, "type": "VEC2", "count": 771, "sparse": {"count": 2,
        "indices": {"bufferView": 0,
            "componentType": 5123}, "values": {"bufferView": 0}}}"#;
        let changed = vectors("", sparse).unwrap();
        assert_eq!((changed[256], changed[770], changed.len()), ([0.0, 1.0], [2.0, 3.0], 771));

        let backwards = STANDARD.encode([1u8, 0]);
        let json = format!(
            r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": 2,
            "uri": "data:;base64,{backwards}"}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 2}}], "accessors": [{{"componentType": 5121,
            "type": "SCALAR",
            "count": 3, "sparse": {{"count": 2, "indices": {{"bufferView": 0, "componentType": 5121}},
            "values": {{"bufferView": 0}}}}}},
            {{"componentType": 5121, "type": "SCALAR", "count": 3, "sparse": {{"count": 0,
            "indices": {{"bufferView": 0,
            "componentType": 5121}}, "values": {{"bufferView": 0}}}}}}]}}"#
        );
        let (_dir, document) = open(&json);
        let message = document.read_indices(Index::new(0), "who").unwrap_err().to_string();
        assert!(message.contains("do not grow at 0"), "{message}");
        assert_eq!(document.read_indices(Index::new(1), "who").unwrap(), [0; 3]);
    }

    #[test]
    fn claims_beyond_the_data_are_refused() {
        for claim in ["18446744073709551615", "33", "9223372036854775808"] {
            let a =
                format!(r#"{{"bufferView": 0, "componentType": 5121, "type": "VEC2", "count": {claim}}}"#);
            assert!(vectors("", &a).unwrap_err().contains("who: accessor 0 takes"), "{claim}");
        }
        let a = r#"{"bufferView": 0, "byteOffset": 18446744073709551615, "componentType": 5121,
        "type": "VEC2", "count": 1}"#;
        assert!(vectors("", a).is_err());
        let a = r#"{"bufferView": 0, "componentType": 5121, "type": "VEC3", "count": 1}"#;
        assert!(vectors("", a).unwrap_err().contains("3 numbers an element, not 2"));
        let a = r#"{"bufferView": 0, "componentType": 1, "type": "VEC2", "count": 1}"#;
        assert!(vectors("", a).unwrap_err().contains("unknown type"));
        let a = r#"{"bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": 1}"#;
        let (_dir, document) = document("", a);
        assert!(
            document
                .read_indices(Index::new(0), "who")
                .unwrap_err()
                .to_string()
                .contains("unsigned")
        );
        let a = r#"{"bufferView": 0, "componentType": 5121, "type": "VEC2", "count": 0}"#;
        assert!(vectors("", a).unwrap().is_empty());
        let a = r#"{"bufferView": 7, "componentType": 5121, "type": "VEC2", "count": 1}"#;
        assert!(
            vectors("", a)
                .unwrap_err()
                .contains("buffer view 7, which is not there")
        );
    }
}
