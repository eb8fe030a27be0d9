//! Reads and writes the part of HDF5 that MATLAB's v7.3 files are made of.
//!
//! MATLAB asks the HDF5 library for its oldest form, and so do h5py and other writers of such files unless
//! told otherwise. That form is small: a superblock of version 0, object headers of version 1, groups as
//! symbol tables (a B-tree of nodes of names), and data in one piece or in chunks under a B-tree, compressed
//! with zlib. [`write`] writes this form. [`read`] reads it, and the parts of the newer form that cost
//! little: superblocks 2 and 3, object headers of version 2, links in the header. Everything else (dense
//! groups, newer chunk indices, other filters) is refused by name.
//!
//! The crates that read all of HDF5 have thirty to a hundred thousand lines and up to ten dependencies. None
//! of them writes a file of this form whose data do not fit into memory.
//!
//! Source: "HDF5 File Format Specification Version 3.0", The HDF Group.

mod chunks;
pub(crate) mod file;
mod group;
mod header;
mod message;
pub(crate) mod read;
pub(crate) mod write;

/// The first bytes of every file, behind its user block.
const SIGNATURE: [u8; 8] = *b"\x89HDF\r\n\x1a\n";

/// The undefined address.
const UNDEFINED: u64 = u64::MAX;
