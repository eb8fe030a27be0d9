//! Arrays in chunks: a B-tree of pieces, each perhaps shuffled and deflated.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::UNDEFINED;
use super::file::{Cursor, Dataset, Filter, Hdf5File};
use crate::error::Result;

/// What deflate can make of a byte at most.
const MAX_DEFLATE: u64 = 1032;
/// Levels of a B-tree.
const MAX_LEVELS: u8 = 40;

/// A piece of an array.
struct Chunk {
    /// Where it begins, in elements along each axis.
    offset: Vec<u64>,
    /// Where it is stored, and its bytes there.
    address: u64,
    stored: u32,
    /// A bit for each filter that was left out.
    skipped: u32,
}

/// All `bytes` of an array whose chunks of extents `chunk` are under the B-tree at `tree`.
pub(super) fn read(
    file: &Hdf5File,
    dataset: &Dataset,
    tree: u64,
    chunk: &[u64],
    bytes: u64,
) -> Result<Vec<u8>> {
    let damaged = || file.fault(format!("an array of {:?} in chunks of {chunk:?} is damaged", dataset.dims));
    let element = dataset.kind.size();
    let chunk_bytes = chunk
        .iter()
        .try_fold(element as u64, |n, d| n.checked_mul(*d))
        .ok_or_else(damaged)?;
    if chunk.len() != dataset.dims.len() || chunk_bytes == 0 {
        return Err(damaged());
    }
    for filter in &dataset.filters {
        if let Filter::Other(id) = filter {
            return Err(file.unsupported(&format!("an array compressed with filter {id}")));
        }
    }
    let chunks = list(file, tree, chunk.len())?;
    // Before anything is allocated: the chunks must be able to fill the array.
    let needed = dataset
        .dims
        .iter()
        .zip(chunk)
        .try_fold(1u64, |n, (d, c)| n.checked_mul(d.div_ceil(*c)));
    if needed.is_none_or(|n| n > chunks.len() as u64) {
        return Err(file.fault(format!(
            "an array of {:?} has only {} of its chunks",
            dataset.dims,
            chunks.len()
        )));
    }
    // Chunks share no bytes. Thus the array is not larger than the whole file could be deflated from.
    let stored: u64 = chunks.iter().map(|c| u64::from(c.stored)).sum();
    if stored > file.len() {
        return Err(damaged());
    }
    let most = if dataset.filters.contains(&Filter::Deflate) {
        MAX_DEFLATE
    } else {
        1
    };
    if chunks
        .iter()
        .any(|c| chunk_bytes > most.saturating_mul(u64::from(c.stored)).saturating_add(64))
    {
        return Err(damaged());
    }
    let size = usize::try_from(bytes)
        .ok()
        .filter(|_| bytes <= chunk_bytes.saturating_mul(chunks.len() as u64));
    let mut data = vec![0; size.ok_or_else(damaged)?];
    for piece in &chunks {
        let stored = file.bytes(piece.address, u64::from(piece.stored))?;
        let size = usize::try_from(chunk_bytes).ok();
        size.and_then(|size| unfilter(stored, piece.skipped, &dataset.filters, element, size))
            .and_then(|unpacked| place(&mut data, &dataset.dims, &unpacked, chunk, &piece.offset, element))
            .ok_or_else(damaged)?;
    }
    Ok(data)
}

/// The chunks under a B-tree.
fn list(file: &Hdf5File, tree: u64, axes: usize) -> Result<Vec<Chunk>> {
    let damaged = || file.fault("the list of an array's chunks is damaged");
    // A key: bytes and filters, an offset along each axis and in the element. A node has one more than
    // children.
    let key_bytes = axes.checked_add(2).and_then(|n| n.checked_mul(8)).ok_or_else(damaged)?;
    let entry_bytes = key_bytes.checked_add(8).ok_or_else(damaged)?;
    let mut chunks = Vec::new();
    let mut nodes = if tree == UNDEFINED {
        Vec::new()
    } else {
        vec![(tree, MAX_LEVELS)]
    };
    let mut left = file.len() / 8;
    while let Some((address, below)) = nodes.pop() {
        let head: [u8; 24] = file.array(address)?;
        let (level, count) = (head[5], u16::from_le_bytes([head[6], head[7]]));
        left = left
            .checked_sub(1)
            .and_then(|n| n.checked_sub(count.into()))
            .ok_or_else(damaged)?;
        if !head.starts_with(b"TREE\x01") || level >= below {
            return Err(damaged());
        }
        let body_bytes = (entry_bytes as u64).checked_mul(count.into()).ok_or_else(damaged)?;
        let body = file.bytes(address.checked_add(24).ok_or_else(damaged)?, body_bytes)?;
        for entry in body.chunks_exact(entry_bytes) {
            let mut entry = Cursor::new(entry);
            let mut parse = || {
                let (stored, skipped) =
                    (u32::from_le_bytes(entry.array()?), u32::from_le_bytes(entry.array()?));
                let offset = (0..axes).map(|_| entry.number(8)).collect::<Option<Vec<u64>>>()?;
                entry.number(8)?;
                Some(Chunk { offset, stored, skipped, address: entry.number(8)? })
            };
            let chunk = parse().ok_or_else(damaged)?;
            if level == 0 {
                chunks.push(chunk);
            } else {
                nodes.push((chunk.address, level));
            }
        }
    }
    Ok(chunks)
}

/// A chunk's bytes as they were before the filters, which are undone from the last to the first.
fn unfilter(
    mut data: Vec<u8>,
    skipped: u32,
    filters: &[Filter],
    element: usize,
    size: usize,
) -> Option<Vec<u8>> {
    for (i, filter) in filters.iter().enumerate().rev() {
        if skipped >> i.min(31) & 1 != 0 {
            continue;
        }
        match filter {
            // Its checksum is left to zlib's, or to nobody.
            Filter::Fletcher32 => data.truncate(data.len().checked_sub(4)?),
            // A little more than the chunk: there may be a checksum.
            Filter::Deflate => {
                data = fdeflate::decompress_to_vec_bounded(&data, size.checked_add(4)?).ok()?;
            }
            Filter::Shuffle => {
                // All first bytes of the elements, then all second ones…; what is no whole element is behind.
                let n = data.len().checked_div(element)?;
                let mut whole = data.clone();
                for (byte, plane) in data.chunks_exact(n.max(1)).take(element).enumerate() {
                    let places = whole.iter_mut().skip(byte).step_by(element);
                    places.zip(plane).for_each(|(place, v)| *place = *v);
                }
                data = whole;
            }
            Filter::Other(_) => return None,
        }
    }
    (data.len() == size).then_some(data)
}

/// Copies a chunk to its place; what lies beyond the array is filling. `None` if the chunk or the array is
/// smaller than its extents say.
fn place(
    data: &mut [u8],
    dims: &[u64],
    chunk: &[u8],
    extents: &[u64],
    offset: &[u64],
    element: usize,
) -> Option<()> {
    if offset.iter().zip(dims).any(|(o, d)| o >= d) {
        return Some(());
    }
    // How many of the chunk's elements are in the array, along each axis.
    let within = |((e, d), o): ((&u64, &u64), &u64)| Some(*e.min(&d.checked_sub(*o)?));
    let inside = extents
        .iter()
        .zip(dims)
        .zip(offset)
        .map(within)
        .collect::<Option<Vec<u64>>>()?;
    // Elements of the last axis lie in a row.
    let run = usize::try_from(inside.last().copied().unwrap_or(1))
        .ok()?
        .checked_mul(element)?;
    let (mut at, first) = (vec![0u64; dims.len()], vec![0; dims.len()]);
    loop {
        let index = |start: &[u64], dims: &[u64]| {
            let mut axes = at.iter().zip(start).zip(dims);
            let index =
                axes.try_fold(0u64, |n, ((a, s), d)| n.checked_mul(*d)?.checked_add(*a)?.checked_add(*s))?;
            usize::try_from(index).ok()?.checked_mul(element)
        };
        let (to, from) = (index(offset, dims)?, index(&first, extents)?);
        let row = chunk.get(from..)?.get(..run)?;
        data.get_mut(to..)?.get_mut(..run)?.copy_from_slice(row);
        // The next row: all axes but the last count up, and begin again at their ends.
        let mut axes = at.iter_mut().zip(&inside);
        axes.next_back();
        let counted = axes.rev().any(|(at, inside)| {
            let next = at.checked_add(1).filter(|next| next < inside);
            *at = next.unwrap_or(0);
            next.is_some()
        });
        if !counted {
            return Some(());
        }
    }
}
