//! The part of HDF5 that MATLAB's v7.3 files are made of, to read and to write.
//!
//! MATLAB asks the HDF5 library for its oldest form, and so do h5py and the other writers of such files
//! unless told otherwise. That form is small: a superblock of version 0, object headers of version 1, groups
//! as symbol tables (a B-tree of nodes of names), data in one piece or in chunks under a B-tree, compressed
//! with zlib. [`write`] makes it; [`read`] takes it, and of the newer form what costs little: superblocks 2
//! and 3, object headers of version 2, links in the header. What else there is (dense groups, newer chunk
//! indices, other filters) is refused by name.
//!
//! The crates that read all of HDF5 have thirty to a hundred thousand lines and bring up to ten others along;
//! none writes a file of this form whose data do not fit into memory.
//!
//! Source: "HDF5 File Format Specification Version 3.0", The HDF Group.

mod chunks;
pub(crate) mod file;
mod group;
mod header;
mod message;
pub(crate) mod read;
pub(crate) mod write;

/// What every file begins with, behind its user block.
const SIGNATURE: [u8; 8] = *b"\x89HDF\r\n\x1a\n";

/// The address of nothing.
const UNDEFINED: u64 = u64::MAX;
