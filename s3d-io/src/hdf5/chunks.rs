//! Arrays in chunks: a B-tree of pieces, each perhaps shuffled and deflated.

use super::UNDEFINED;
use super::read::{Cursor, Dataset, Filter, Hdf5File};
use crate::Result;

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
    let chunk_bytes = chunk.iter().try_fold(element as u64, |n, d| n.checked_mul(*d)).ok_or_else(damaged)?;
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
    let needed = dataset.dims.iter().zip(chunk).try_fold(1u64, |n, (d, c)| n.checked_mul(d.div_ceil(*c)));
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
    let most = if dataset.filters.contains(&Filter::Deflate) { MAX_DEFLATE } else { 1 };
    if chunks.iter().any(|c| chunk_bytes > most.saturating_mul(u64::from(c.stored)).saturating_add(64)) {
        return Err(damaged());
    }
    let size =
        usize::try_from(bytes).ok().filter(|_| bytes <= chunk_bytes.saturating_mul(chunks.len() as u64));
    let mut data = vec![0; size.ok_or_else(damaged)?];
    for piece in &chunks {
        let stored = file.bytes(piece.address, u64::from(piece.stored))?;
        let piece_data = unfilter(stored, piece.skipped, &dataset.filters, element, chunk_bytes as usize)
            .ok_or_else(damaged)?;
        place(&mut data, &dataset.dims, &piece_data, chunk, &piece.offset, element);
    }
    Ok(data)
}

/// The chunks under a B-tree.
fn list(file: &Hdf5File, tree: u64, axes: usize) -> Result<Vec<Chunk>> {
    let damaged = || file.fault("the list of an array's chunks is damaged");
    let (key, mut chunks) = (8 + 8 * (axes + 1), Vec::new());
    let mut nodes = if tree == UNDEFINED { Vec::new() } else { vec![(tree, MAX_LEVELS)] };
    let mut left = file.len() / 8;
    while let Some((address, below)) = nodes.pop() {
        let head = file.bytes(address, 24)?;
        let (level, count) = (head[5], usize::from(u16::from_le_bytes([head[6], head[7]])));
        left = left.checked_sub(1 + count as u64).ok_or_else(damaged)?;
        if !head.starts_with(b"TREE\x01") || level >= below {
            return Err(damaged());
        }
        let body = file.bytes(address + 24, ((key + 8) * count) as u64)?;
        for entry in body.chunks_exact(key + 8) {
            let mut entry = Cursor::new(entry);
            let mut parse = || {
                let (stored, skipped) = (entry.number(4)? as u32, entry.number(4)? as u32);
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
            Filter::Deflate => data = fdeflate::decompress_to_vec_bounded(&data, size + 4).ok()?,
            Filter::Shuffle => {
                let n = data.len() / element;
                let mut whole = data.clone();
                for (byte, plane) in data[..n * element].chunks_exact(n.max(1)).enumerate() {
                    plane.iter().enumerate().for_each(|(i, v)| whole[i * element + byte] = *v);
                }
                data = whole;
            }
            Filter::Other(_) => return None,
        }
    }
    (data.len() == size).then_some(data)
}

/// Copies a chunk to its place; what lies beyond the array is filling.
fn place(data: &mut [u8], dims: &[u64], chunk: &[u8], extents: &[u64], offset: &[u64], element: usize) {
    if offset.iter().zip(dims).any(|(o, d)| o >= d) {
        return;
    }
    let Some(last) = dims.len().checked_sub(1) else { return data.copy_from_slice(&chunk[..data.len()]) };
    // How many of the chunk's elements are in the array, along each axis.
    let inside: Vec<u64> = (0..dims.len()).map(|axis| extents[axis].min(dims[axis] - offset[axis])).collect();
    let run = inside[last] as usize * element;
    let mut at = vec![0u64; dims.len()];
    loop {
        let index = |start: &[u64], dims: &[u64]| {
            at.iter().zip(start).zip(dims).fold(0u64, |n, ((a, s), d)| n * d + a + s) as usize * element
        };
        let (to, from) = (index(offset, dims), index(&vec![0; dims.len()], extents));
        data[to..to + run].copy_from_slice(&chunk[from..from + run]);
        // The next row: all axes but the last count up.
        let Some(axis) = (0..last).rev().find(|&axis| at[axis] + 1 < inside[axis]) else { return };
        at[axis] += 1;
        at[axis + 1..].fill(0);
    }
}
