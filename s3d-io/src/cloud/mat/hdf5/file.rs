//! An HDF5 file, the types of its arrays, and the numbers in its bytes.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::{SIGNATURE, UNDEFINED};
use crate::error::{Error, Result};
use crate::fs::source::{Bytes, Source};
use std::io::{Read, Seek, SeekFrom};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

/// The type of an array's elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    /// An integer of `size` bytes, 1 to 8.
    Integer { size: usize, signed: bool, big_endian: bool },
    /// A float of 4 or 8 bytes.
    Float { size: usize, big_endian: bool },
    /// The address of an object.
    Reference,
    /// Text of `size` bytes.
    Text { size: usize },
    /// Anything else, of `size` bytes.
    Other { size: usize },
}

impl Kind {
    /// Bytes of an element.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::Integer { size, .. } | Self::Float { size, .. } => size,
            Self::Reference => 8,
            Self::Text { size } | Self::Other { size } => size,
        }
    }
}

/// An array as its header describes it.
#[derive(Clone, Debug)]
pub(crate) struct Dataset {
    pub(crate) kind: Kind,
    /// Its extents, the slowest first; empty for a scalar.
    pub(crate) dims: Vec<u64>,
    pub(crate) layout: Layout,
    pub(crate) filters: Vec<Filter>,
}

/// The place of an array's data.
#[derive(Clone, Debug)]
pub(crate) enum Layout {
    /// In the header.
    Compact(Vec<u8>),
    /// In one piece.
    Contiguous { address: u64, size: u64 },
    /// In pieces of these extents, under a B-tree.
    Chunked { tree: u64, dims: Vec<u64> },
    /// In a form that is not read. The text names it.
    Unsupported(&'static str),
}

/// A filter that was applied to the bytes of a chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Filter {
    Deflate,
    Shuffle,
    Fletcher32,
    /// A filter that is not supported, with its number.
    Other(u16),
}

/// An open file. Reading it allocates at most a small multiple of its size, whatever its bytes are.
#[derive(Debug)]
pub(crate) struct Hdf5File {
    path: PathBuf,
    file: Mutex<Bytes>,
    /// The bytes of the file.
    file_len: u64,
    /// The bytes before address 0; fewer than the file has.
    user_block: u64,
    /// Address of the root group.
    pub(super) root: u64,
}

impl Hdf5File {
    /// Opens a file.
    pub(crate) fn open(source: &Source) -> Result<Self> {
        let (file, file_len) = source.open()?;
        let mut this = Self {
            path: source.name().to_owned(),
            file: Mutex::new(file),
            file_len,
            user_block: 0,
            root: UNDEFINED,
        };

        let mut at = 0u64;
        while this.array(at).map_or(true, |b| b != SIGNATURE) {
            at = at.saturating_mul(2).max(512);
            if at >= this.file_len {
                return Err(this.fault(this.not_hdf5()));
            }
        }

        this.user_block = at;
        this.root = this.superblock()?;
        Ok(this)
    }

    /// Why the file is not read, as a message.
    fn not_hdf5(&self) -> &'static str {
        match self.bytes(0, 20) {
            Ok(head) if head.starts_with(b"MATLAB 5.0") => {
                "is a MAT-file of version 5, without HDF5: save it in MATLAB with save(…, '-v7.3')"
            }
            Ok(head) if head.starts_with(b"version https://git-") => {
                "is a pointer of Git LFS and not the file itself: fetch it with `git lfs pull`"
            }
            _ => "is no HDF5 file, which a MAT-file of version 7.3 is: is the download complete?",
        }
    }

    /// Reads the superblock, and returns the address of the root group.
    fn superblock(&self) -> Result<u64> {
        let [version] = self.array(8)?;
        // Version 1 has four more bytes than version 0 before its addresses.
        let (sizes, root, end) = match version {
            0 => (13, 64, 40),
            1 => (13, 68, 44),
            2 | 3 => (9, 36, 28),
            _ => return Err(self.fault(format!("has a superblock of version {version}; 0 to 3 are read"))),
        };
        if self.array(sizes)? != [8, 8] {
            return Err(self.fault("has addresses of another size than eight bytes, which are not read"));
        }
        let end = self.number(end)?;
        if end > self.file_len {
            let is = self.file_len;
            return Err(self.fault(format!("is cut off: it has {is} of {end} bytes; fetch it again")));
        }
        self.number(root)
    }

    /// Reads `len` bytes at an address.
    pub(crate) fn bytes(&self, address: u64, len: u64) -> Result<Vec<u8>> {
        let (start, size) = self.piece(address, len)?;
        let mut bytes = vec![0; size];
        self.fill(start, &mut bytes)?;
        Ok(bytes)
    }

    /// Reads the `N` bytes at an address.
    pub(crate) fn array<const N: usize>(&self, address: u64) -> Result<[u8; N]> {
        let (start, _) = self.piece(address, N as u64)?;
        let mut bytes = [0; N];
        self.fill(start, &mut bytes)?;
        Ok(bytes)
    }

    /// The place in the file of `len` bytes at an address, and their number. An error if the file ends
    /// before.
    fn piece(&self, address: u64, len: u64) -> Result<(u64, usize)> {
        let start = self.user_block.checked_add(address);
        let inside = start.filter(|s| s.checked_add(len).is_some_and(|end| end <= self.file_len));
        inside.zip(usize::try_from(len).ok()).ok_or_else(|| {
            self.fault(format!(
                "points to {len} bytes at {address}, beyond its end: it is damaged, or its download is not \
                 complete"
            ))
        })
    }

    fn fill(&self, start: u64, bytes: &mut [u8]) -> Result<()> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(start))
            .and_then(|_| file.read_exact(bytes))
            .map_err(|e| Error::io(&self.path, "read", e))
    }

    /// Reads up to `len` bytes at an address; fewer at the end of the file.
    pub(crate) fn some_bytes(&self, address: u64, len: u64) -> Result<Vec<u8>> {
        self.bytes(address, len.min(self.len().saturating_sub(address)))
    }

    fn number(&self, address: u64) -> Result<u64> {
        self.array(address).map(u64::from_le_bytes)
    }

    /// The number of bytes behind the user block.
    pub(crate) fn len(&self) -> u64 {
        self.file_len.saturating_sub(self.user_block)
    }

    /// An error about the file.
    pub(crate) fn fault(&self, message: impl Into<String>) -> Error {
        Error::format(&self.path, message)
    }

    /// An error about a form that is not read, with a way to avoid it.
    pub(crate) fn unsupported(&self, what: &str) -> Error {
        let way = "save it with MATLAB's save(…, '-v7.3') or with h5py's default libver";
        Error::unsupported(&self.path, format!("{what}, which is not read: {way}"))
    }
}

/// A reader of little-endian numbers in bytes that came from the file.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    /// The next `n` bytes. Returns `None` if there are not so many.
    pub(crate) fn take(&mut self, n: usize) -> Option<&'a [u8]> {
        let (head, rest) = self.bytes.split_at_checked(n)?;
        self.bytes = rest;
        Some(head)
    }

    /// The next number of `n` bytes, at most 8.
    pub(crate) fn number(&mut self, n: usize) -> Option<u64> {
        Some(self.take(n)?.iter().rev().fold(0, |n, b| n << 8 | u64::from(*b)))
    }

    /// The next number of `n` bytes, at most 8, as a size in memory.
    pub(crate) fn size(&mut self, n: usize) -> Option<usize> {
        usize::try_from(self.number(n)?).ok()
    }

    /// The next `N` bytes.
    pub(crate) fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, rest) = self.bytes.split_first_chunk()?;
        self.bytes = rest;
        Some(*head)
    }

    pub(crate) fn byte(&mut self) -> Option<u8> {
        let [byte] = self.array()?;
        Some(byte)
    }

    pub(crate) fn rest(self) -> &'a [u8] {
        self.bytes
    }
}
