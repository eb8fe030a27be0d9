//! Reads arrays in chunks: a B-tree of pieces, which may be shuffled and deflated.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::UNDEFINED;
use super::file::{Cursor, Dataset, Filter, Hdf5File};
use crate::error::{Error, Result};

/// The most bytes that deflate makes of one.
const MAX_DEFLATE: u64 = 1032;
/// The most levels of a B-tree.
const MAX_LEVELS: u8 = 40;

/// A piece of an array.
struct Chunk {
    /// Its first element's index along each axis.
    offset: Vec<u64>,
    /// Where it is stored, and the number of bytes there.
    address: u64,
    stored: u32,
    /// A bit for each filter that was not applied.
    skipped: u32,
}

/// Reads all `bytes` of an array. Its chunks have the extents `chunk` and are under the B-tree at `tree`.
pub(super) fn read(
    file: &Hdf5File,
    dataset: &Dataset,
    tree: u64,
    chunk: &[u64],
    bytes: u64,
) -> Result<Vec<u8>> {
    let damaged = || damaged(file, dataset, chunk);
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
    check_chunks(file, dataset, chunk, chunk_bytes, &chunks)?;

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

/// The error for an array that cannot be right.
fn damaged(file: &Hdf5File, dataset: &Dataset, chunk: &[u64]) -> Error {
    file.fault(format!("an array of {:?} in chunks of {chunk:?} is damaged", dataset.dims))
}

/// Checks, before anything is allocated, that the chunks can fill the array.
fn check_chunks(
    file: &Hdf5File,
    dataset: &Dataset,
    chunk: &[u64],
    chunk_bytes: u64,
    chunks: &[Chunk],
) -> Result<()> {
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

    // Chunks share no bytes, so the array is no larger than what the whole file could inflate to.
    let stored: u64 = chunks.iter().map(|c| u64::from(c.stored)).sum();
    if stored > file.len() {
        return Err(damaged(file, dataset, chunk));
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
        return Err(damaged(file, dataset, chunk));
    }
    Ok(())
}

/// Lists the chunks under a B-tree.
fn list(file: &Hdf5File, tree: u64, axes: usize) -> Result<Vec<Chunk>> {
    let damaged = || file.fault("the list of an array's chunks is damaged");
    // A key has the chunk's bytes, its filters, and an offset along each axis and within the element. A node
    // has one key more than children.
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
        let level = head[5];
        let count = u16::from_le_bytes([head[6], head[7]]);
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
            let chunk = parse_chunk(entry, axes).ok_or_else(damaged)?;
            if level == 0 {
                chunks.push(chunk);
            } else {
                nodes.push((chunk.address, level));
            }
        }
    }
    Ok(chunks)
}

/// Parses a key of a B-tree and the address behind it.
fn parse_chunk(entry: &[u8], axes: usize) -> Option<Chunk> {
    let mut entry = Cursor::new(entry);
    let stored = u32::from_le_bytes(entry.array()?);
    let skipped = u32::from_le_bytes(entry.array()?);
    let offset = (0..axes).map(|_| entry.number(8)).collect::<Option<Vec<u64>>>()?;
    entry.number(8)?;
    Some(Chunk { offset, stored, skipped, address: entry.number(8)? })
}

/// Restores a chunk's bytes: undoes the filters from the last to the first.
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
            // The checksum is not verified. Deflated data have one of their own.
            Filter::Fletcher32 => data.truncate(data.len().checked_sub(4)?),
            // Four bytes more than the chunk, for a checksum.
            Filter::Deflate => {
                data = fdeflate::decompress_to_vec_bounded(&data, size.checked_add(4)?).ok()?;
            }
            Filter::Shuffle => {
                // All first bytes of the elements come first, then all second ones, and so on. Bytes of no
                // whole element are at the end.
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

/// Copies a chunk to its place in the array. Elements beyond the array are filling and are dropped. Returns
/// `None` if the chunk or the array is smaller than its extents say.
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
    // The number of the chunk's elements inside the array, along each axis.
    let inside = extents
        .iter()
        .zip(dims)
        .zip(offset)
        .map(|((extent, d), o)| Some(*extent.min(&d.checked_sub(*o)?)))
        .collect::<Option<Vec<u64>>>()?;
    // Elements along the last axis are contiguous.
    let run = usize::try_from(inside.last().copied().unwrap_or(1))
        .ok()?
        .checked_mul(element)?;
    let mut at = vec![0u64; dims.len()];
    let first = vec![0; dims.len()];

    loop {
        let to = byte_index(&at, offset, dims, element)?;
        let from = byte_index(&at, &first, extents, element)?;
        let row = chunk.get(from..)?.get(..run)?;
        data.get_mut(to..)?.get_mut(..run)?.copy_from_slice(row);

        // The next row: counts up all axes but the last, each of which starts again at its end.
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

/// The byte of the element at `start + at` in an array of these extents.
fn byte_index(at: &[u64], start: &[u64], dims: &[u64], element: usize) -> Option<usize> {
    let mut axes = at.iter().zip(start).zip(dims);
    let index = axes.try_fold(0u64, |n, ((a, s), d)| n.checked_mul(*d)?.checked_add(*a)?.checked_add(*s))?;
    usize::try_from(index).ok()?.checked_mul(element)
}
