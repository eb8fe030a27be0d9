//! Writes HDF5 from front to back: each object once, its data before its header, and groups after their
//! members.

#![expect(clippy::indexing_slicing, reason = "a writer: it reads only places in the file that it assigned")]

use super::{SIGNATURE, UNDEFINED};
use crate::error::{Error, Result};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// The bytes of the superblock (version 0) with the root group's entry.
const SUPERBLOCK: usize = 96;
/// Half of the most names in a symbol table's node, and half of the most children of a B-tree's node. These
/// are the HDF5 library's defaults, which the superblock states.
const LEAF_K: u16 = 4;
const INTERNAL_K: u16 = 16;
/// The bytes that are collected before they are written to the file.
const BLOCK: usize = 1 << 16;
/// The smallest global heap that the library reads.
const SMALLEST_HEAP: usize = 4096;

/// The type of an element. All types are little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// Unsigned integers of this many bytes.
    Unsigned(u32),
    /// A signed integer of four bytes.
    I32,
    F32,
    F64,
    /// The address of an object.
    Reference,
    /// Text of this many bytes.
    Text(u32),
    /// Words of any length: their bytes, and their place in the global heap.
    Words,
}

impl Kind {
    /// The datatype message (version 1).
    fn message(self) -> Vec<u8> {
        match self {
            Self::Unsigned(size) => integer_type(size, 0),
            Self::I32 => integer_type(4, 8),
            Self::F32 => float_type(4, [23, 8], 23, 127),
            Self::F64 => float_type(8, [52, 11], 52, 1023),
            Self::Reference => type_head(7, [0; 3], 8),
            Self::Text(size) => type_head(3, [0; 3], size),
            Self::Words => [type_head(9, [0; 3], 16), Self::Text(1).message()].concat(),
        }
    }
}

/// The start of a datatype message.
fn type_head(class: u8, bits: [u8; 3], size: u32) -> Vec<u8> {
    let mut m = vec![0x10 | class, bits[0], bits[1], bits[2]];
    m.extend(size.to_le_bytes());
    m
}

fn integer_type(size: u32, signed: u8) -> Vec<u8> {
    let mut m = type_head(0, [signed, 0, 0], size);
    m.extend(0u16.to_le_bytes());
    m.extend((8 * size as u16).to_le_bytes());
    m
}

/// A float type; `exponent` has the place and the number of the exponent's bits.
fn float_type(size: u32, exponent: [u8; 2], mantissa: u8, bias: u32) -> Vec<u8> {
    let mut m = type_head(1, [0x20, 8 * size as u8 - 1, 0], size);
    m.extend(0u16.to_le_bytes());
    m.extend((8 * size as u16).to_le_bytes());
    m.extend([exponent[0], exponent[1], 0, mantissa]);
    m.extend(bias.to_le_bytes());
    m
}

/// An attribute of an object.
#[derive(Clone, Debug)]
pub(crate) struct Attribute {
    name: &'static str,
    kind: Kind,
    /// The number of elements. `None`: a scalar.
    count: Option<u64>,
    value: Vec<u8>,
}

impl Attribute {
    /// An attribute that is a word.
    pub(crate) fn text(name: &'static str, word: &str) -> Self {
        Self { name, kind: Kind::Text(word.len() as u32), count: None, value: word.into() }
    }

    /// An attribute that is a number.
    pub(crate) fn number(name: &'static str, number: i32) -> Self {
        Self { name, kind: Kind::I32, count: None, value: number.to_le_bytes().into() }
    }

    /// An attribute that is a flag, which is set.
    pub(crate) fn flag(name: &'static str) -> Self {
        Self { name, kind: Kind::Unsigned(1), count: None, value: vec![1] }
    }

    fn message(&self) -> Vec<u8> {
        let kind = self.kind.message();
        let space = dataspace(self.count.as_slice());
        let mut m = vec![1, 0];
        for length in [self.name.len() + 1, kind.len(), space.len()] {
            m.extend((length as u16).to_le_bytes());
        }
        m.extend(self.name.bytes().chain([0]));
        for part in [&kind, &space, &self.value] {
            m.resize(m.len().next_multiple_of(8), 0);
            m.extend(part);
        }
        m
    }
}

/// Writes a file. Groups and references know an object by the address of its header, which the methods
/// return.
#[derive(Debug)]
pub(crate) struct Hdf5Writer<W> {
    file: W,
    name: PathBuf,
    /// The bytes written so far behind the user block.
    at: u64,
    user_block: u64,
}

impl<W: Write + Seek> Hdf5Writer<W> {
    /// Starts the file with `user_block`: 512 bytes, or twice as many, or twice again…
    pub(crate) fn new(mut file: W, name: &Path, user_block: &[u8]) -> Result<Self> {
        let written = file
            .write_all(user_block)
            .and_then(|()| file.write_all(&[0; SUPERBLOCK]));
        written.map_err(|e| Error::io(name, "write", e))?;
        let name = name.to_owned();
        Ok(Self { file, name, at: SUPERBLOCK as u64, user_block: user_block.len() as u64 })
    }

    /// The path of the file, for messages.
    pub(crate) fn name(&self) -> &Path {
        &self.name
    }

    /// Writes an array with the extents `dims`, the slowest first. Each element has `N` bytes.
    ///
    /// # Panics
    /// If there are not as many elements as `dims` say, or if the type `kind` has another size.
    pub(crate) fn dataset<const N: usize>(
        &mut self,
        kind: Kind,
        dims: &[u64],
        attributes: &[Attribute],
        elements: impl Iterator<Item = [u8; N]>,
    ) -> Result<u64> {
        let kind = kind.message();
        assert_eq!(u32::from_le_bytes([kind[4], kind[5], kind[6], kind[7]]) as usize, N, "bytes an element");

        let data = self.at;
        let mut block = Vec::with_capacity(BLOCK + N);
        for element in elements {
            block.extend(element);
            if block.len() >= BLOCK {
                self.put(&block)?;
                block.clear();
            }
        }
        self.put(&block)?;
        let bytes = self.at - data;
        assert_eq!(bytes, dims.iter().product::<u64>() * N as u64, "bytes of an array of {dims:?}");
        self.align()?;

        let mut layout = vec![3, 1];
        layout.extend((if bytes == 0 { UNDEFINED } else { data }).to_le_bytes());
        layout.extend(bytes.to_le_bytes());
        let mut messages = vec![
            (0x01, dataspace(dims)),
            (0x03, kind),
            // The fill value: allocated late, and written only if set; the library's default.
            (0x05, vec![2, 2, 2, 1, 0, 0, 0, 0]),
            (0x08, layout),
        ];
        messages.extend(attributes.iter().map(|a| (0x0c, a.message())));
        self.header(&messages)
    }

    /// Writes a list of words for an attribute, which any number of objects may have.
    pub(crate) fn words(&mut self, name: &'static str, words: &[&str]) -> Result<Attribute> {
        let mut heap = b"GCOL\x01\0\0\0".to_vec();
        let objects: usize = words.iter().map(|w| 16 + w.len().next_multiple_of(8)).sum();
        let size = (16 + objects + 16).max(SMALLEST_HEAP);
        heap.extend((size as u64).to_le_bytes());

        let mut value = Vec::new();
        for (index, word) in (1u16..).zip(words) {
            heap.extend(index.to_le_bytes());
            heap.extend([0; 6]);
            heap.extend((word.len() as u64).to_le_bytes());
            heap.extend(word.bytes());
            heap.resize(heap.len().next_multiple_of(8), 0);
            value.extend((word.len() as u32).to_le_bytes());
            value.extend(self.at.to_le_bytes());
            value.extend(u32::from(index).to_le_bytes());
        }

        // Object 0 is the free space.
        heap.extend([0; 8]);
        heap.extend(((size - heap.len() + 8) as u64).to_le_bytes());
        heap.resize(size, 0);
        self.put(&heap)?;
        Ok(Attribute { name, kind: Kind::Words, count: Some(words.len() as u64), value })
    }

    /// Writes a group of objects, each with its name.
    ///
    /// # Panics
    /// If two names are equal, or one is empty.
    pub(crate) fn group(
        &mut self,
        members: impl IntoIterator<Item = (String, u64)>,
        attributes: &[Attribute],
    ) -> Result<u64> {
        let (tree, heap) = self.symbol_table(members.into_iter().collect())?;
        let mut messages = vec![(0x11, [tree.to_le_bytes(), heap.to_le_bytes()].concat())];
        messages.extend(attributes.iter().map(|a| (0x0c, a.message())));
        self.header(&messages)
    }

    /// Writes the root group and the superblock, and returns the complete file.
    ///
    /// # Panics
    /// If two names are equal, or one is empty.
    pub(crate) fn finish(mut self, members: impl IntoIterator<Item = (String, u64)>) -> Result<W> {
        let root = self.group(members, &[])?;
        let mut block = SIGNATURE.to_vec();
        block.extend([0, 0, 0, 0, 0, 8, 8, 0]);
        block.extend([LEAF_K, INTERNAL_K].iter().flat_map(|k| k.to_le_bytes()));
        block.extend([0; 4]);
        for address in [self.user_block, UNDEFINED, self.user_block + self.at, UNDEFINED] {
            block.extend(address.to_le_bytes());
        }
        block.extend(entry(0, root));
        debug_assert_eq!(block.len(), SUPERBLOCK);

        let placed = self
            .file
            .seek(SeekFrom::Start(self.user_block))
            .and_then(|_| self.file.write_all(&block));
        placed
            .and_then(|()| self.file.flush())
            .map_err(|e| Error::io(&self.name, "write", e))?;
        Ok(self.file)
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.file
            .write_all(bytes)
            .map_err(|e| Error::io(&self.name, "write", e))?;
        self.at += bytes.len() as u64;
        Ok(())
    }

    fn align(&mut self) -> Result<()> {
        let gap = (self.at.next_multiple_of(8) - self.at) as usize;
        self.put(&[0; 8][..gap])
    }

    /// Writes an object header (version 1) and returns its address.
    fn header(&mut self, messages: &[(u16, Vec<u8>)]) -> Result<u64> {
        let mut body = Vec::new();
        for (kind, message) in messages {
            let size = message.len().next_multiple_of(8);
            body.extend(kind.to_le_bytes());
            body.extend((size as u16).to_le_bytes());
            body.extend([0; 4]);
            body.extend(message);
            body.resize(body.len() + size - message.len(), 0);
        }
        let address = self.at;
        self.put(&[1, 0])?;
        self.put(&(messages.len() as u16).to_le_bytes())?;
        self.put(&1u32.to_le_bytes())?;
        self.put(&(body.len() as u32).to_le_bytes())?;
        self.put(&[0; 4])?;
        self.put(&body)?;
        Ok(address)
    }

    /// Writes the names and nodes of a group. Returns the addresses of its B-tree and of its heap.
    fn symbol_table(&mut self, mut members: Vec<(String, u64)>) -> Result<(u64, u64)> {
        members.sort_unstable();
        assert!(members.windows(2).all(|w| w[0].0 != w[1].0), "two objects of one name");

        // The empty name comes first: it is the key below all others.
        let mut names = vec![0u8; 8];
        let mut nodes: Vec<(u64, u64)> = Vec::new();
        for node in members.chunks(2 * usize::from(LEAF_K)) {
            let mut bytes = b"SNOD\x01\0".to_vec();
            bytes.extend((node.len() as u16).to_le_bytes());
            let mut last = 0;
            for (name, address) in node {
                assert!(!name.is_empty(), "an object without a name");
                last = names.len() as u64;
                names.extend(name.bytes().chain([0]));
                names.resize(names.len().next_multiple_of(8), 0);
                bytes.extend(entry(last, *address));
            }
            bytes.resize(8 + 2 * usize::from(LEAF_K) * 40, 0);
            nodes.push((last, self.at));
            self.put(&bytes)?;
        }

        let tree = self.tree(nodes)?;
        let heap = self.at;
        self.put(b"HEAP\0\0\0\0")?;
        // The size of the names, no free space, and their address, which is behind this.
        for number in [names.len() as u64, 1, heap + 32] {
            self.put(&number.to_le_bytes())?;
        }
        self.put(&names)?;
        Ok((tree, heap))
    }

    /// Writes a B-tree over nodes, each with the place of its last name in the heap and its address. Returns
    /// the address of the tree's root.
    fn tree(&mut self, mut nodes: Vec<(u64, u64)>) -> Result<u64> {
        let fan = 2 * usize::from(INTERNAL_K);
        let size = 24 + 8 * (2 * fan + 1);
        let mut level = 0u8;
        loop {
            let count = nodes.len().div_ceil(fan).max(1);
            let first = self.at;
            let mut parents = Vec::with_capacity(count);
            let mut key = 0u64;
            for i in 0..count {
                let children = &nodes[i * fan..nodes.len().min((i + 1) * fan)];
                let sibling =
                    |there: bool, at: usize| if there { first + (at * size) as u64 } else { UNDEFINED };

                let mut bytes = b"TREE\0".to_vec();
                bytes.push(level);
                bytes.extend((children.len() as u16).to_le_bytes());
                bytes.extend(sibling(i > 0, i.wrapping_sub(1)).to_le_bytes());
                bytes.extend(sibling(i + 1 < count, i + 1).to_le_bytes());
                bytes.extend(key.to_le_bytes());
                for (last, address) in children {
                    bytes.extend(address.to_le_bytes());
                    bytes.extend(last.to_le_bytes());
                    key = *last;
                }
                bytes.resize(size, 0);
                parents.push((key, self.at));
                self.put(&bytes)?;
            }

            if let [(_, root)] = parents[..] {
                return Ok(root);
            }
            nodes = parents;
            level += 1;
        }
    }
}

/// The dataspace message (version 1).
fn dataspace(dims: &[u64]) -> Vec<u8> {
    let mut m = vec![1, dims.len() as u8, 0, 0, 0, 0, 0, 0];
    m.extend(dims.iter().flat_map(|d| d.to_le_bytes()));
    m
}

/// An entry of a symbol table: the place of the name, the address of the object, and nothing cached.
fn entry(name: u64, address: u64) -> [u8; 40] {
    let mut entry = [0; 40];
    entry[..8].copy_from_slice(&name.to_le_bytes());
    entry[8..16].copy_from_slice(&address.to_le_bytes());
    entry
}
