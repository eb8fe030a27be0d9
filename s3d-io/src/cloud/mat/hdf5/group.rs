//! Reads the members of groups.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::file::{Cursor, Hdf5File};
use super::header::Header;
use super::message::until_zero;
use crate::error::Result;

/// The most levels of a B-tree. With two children a node, no file reaches more.
const MAX_LEVELS: u8 = 40;

/// The members of a group. In the old form of groups they come in the order of their names. Returns `None` if
/// the object is no group.
pub(super) fn members(file: &Hdf5File, header: &Header) -> Result<Option<Vec<(String, u64)>>> {
    if header.is_dense {
        return Err(file.unsupported("a group with its members in a heap (HDF5 1.8's newer form)"));
    }
    let Some((tree, heap)) = header.symbol_table else {
        return Ok(header.is_new_group.then(|| header.links.clone()));
    };

    let damaged = || file.fault("the list of a group's members is damaged");
    let names = heap_of_names(file, heap)?.ok_or_else(damaged)?;

    let mut found = Vec::new();
    // Nodes to be read, each with the level of its parent. Levels must fall, so there is an end.
    let mut nodes = vec![(tree, MAX_LEVELS)];
    // A node has at least 24 bytes, and in a sound file each is read once.
    let mut left = file.len() / 8;
    while let Some((address, below)) = nodes.pop() {
        left = left.checked_sub(1).ok_or_else(damaged)?;
        let head: [u8; 8] = file.array(address)?;
        let count = u64::from(u16::from_le_bytes([head[6], head[7]]));
        let behind = |bytes: u64| address.checked_add(bytes).ok_or_else(damaged);
        if head.starts_with(b"SNOD") {
            let entries = file.bytes(behind(8)?, count.saturating_mul(40))?;
            for entry in entries.chunks_exact(40) {
                let mut entry = Cursor::new(entry);
                let (Some(name), Some(object)) = (entry.number(8), entry.number(8)) else {
                    return Err(damaged());
                };
                let name = usize::try_from(name)
                    .ok()
                    .and_then(|at| names.get(at..))
                    .ok_or_else(damaged)?;
                found.push((String::from_utf8_lossy(until_zero(name)).into_owned(), object));
                left = left.checked_sub(1).ok_or_else(damaged)?;
            }
            continue;
        }

        let level = head[5];
        if !head.starts_with(b"TREE\0") || level >= below {
            return Err(damaged());
        }
        // A name, a child, a name, a child… and a last name.
        let body = file.bytes(behind(32)?, count.saturating_mul(16))?;
        let children: Vec<[u8; 8]> = body.as_chunks().0.iter().step_by(2).copied().collect();
        // The last child is pushed first, because nodes are taken from the end.
        nodes.extend(
            children
                .into_iter()
                .rev()
                .map(|child| (u64::from_le_bytes(child), level)),
        );
    }
    Ok(Some(found))
}

/// The names of a group's members, from its heap. Returns `None` if the heap is damaged.
fn heap_of_names(file: &Hdf5File, heap: u64) -> Result<Option<Vec<u8>>> {
    let head = file.bytes(heap, 32)?;
    let mut cursor = Cursor::new(&head);
    let is_heap = cursor.take(8).is_some_and(|m| m.starts_with(b"HEAP"));
    let (Some(size), Some(_free), Some(data)) = (cursor.number(8), cursor.number(8), cursor.number(8)) else {
        return Ok(None);
    };
    if !is_heap {
        return Ok(None);
    }
    file.bytes(data, size).map(Some)
}
