//! Reads HDF5: objects by address, their members and data.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::file::{Dataset, Hdf5File, Layout};
use super::header::Header;
use super::{UNDEFINED, chunks, group};
use crate::error::Result;

/// An object, found by its address.
#[derive(Debug)]
pub(crate) struct Object {
    pub(crate) header: Header,
}

impl Hdf5File {
    /// The root group.
    pub(crate) fn root(&self) -> Result<Object> {
        self.object(self.root)
    }

    /// Reads the object at an address.
    pub(crate) fn object(&self, address: u64) -> Result<Object> {
        Ok(Object { header: Header::read(self, address)? })
    }

    /// The members of a group, by name. Returns `None` if the object is no group.
    pub(crate) fn members(&self, object: &Object) -> Result<Option<Vec<(String, u64)>>> {
        group::members(self, &object.header)
    }

    /// Reads all data of an array, as they are in the file: in C order, each element as its [`Kind`] says.
    pub(crate) fn data(&self, dataset: &Dataset) -> Result<Vec<u8>> {
        let element = dataset.kind.size() as u64;
        let bytes = dataset.dims.iter().try_fold(element, |n, d| n.checked_mul(*d));
        let bytes =
            bytes.ok_or_else(|| self.fault(format!("an array of {:?} is too large", dataset.dims)))?;
        if bytes == 0 {
            return Ok(Vec::new());
        }

        match &dataset.layout {
            Layout::Compact(data) if data.len() as u64 == bytes => Ok(data.clone()),
            Layout::Contiguous { address, size } if *size >= bytes && *address != UNDEFINED => {
                self.bytes(*address, bytes)
            }
            Layout::Chunked { tree, dims } => chunks::read(self, dataset, *tree, dims, bytes),
            Layout::Unsupported(why) => Err(self.unsupported(why)),
            Layout::Compact(_) | Layout::Contiguous { .. } => {
                Err(self.fault(format!("an array of {:?} has too few data", dataset.dims)))
            }
        }
    }
}
