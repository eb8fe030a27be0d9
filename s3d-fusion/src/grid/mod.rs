//! A sparse grid of blocks of 8 × 8 × 8 voxels, in chunks of 4 × 4 × 4 blocks.
//!
//! A chunk is the directory of its blocks, and counts the images that saw through a block, whether it exists
//! or not. So what was empty before somebody walked in is known.

pub(crate) mod block;

use block::Block;
use rayon::prelude::*;
use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

/// Voxels along the side of a block.
pub(crate) const SIDE: i32 = 8;
/// Voxels of a block.
pub(crate) const VOXELS: usize = 512;
/// Blocks along the side of a chunk.
pub(crate) const CHUNK: i32 = 4;
/// No block.
pub(crate) const NONE: u32 = u32::MAX;
/// Blocks farther from the origin than this many are refused.
pub(crate) const FARTHEST: i32 = 1 << 16;

/// The place of a block or chunk, counted from the origin of the world.
pub(crate) type Place = [i32; 3];

/// A directory of 4 × 4 × 4 blocks.
#[derive(Clone, Debug)]
pub(crate) struct Chunk {
    /// How many images saw through each block.
    pub(crate) free: [u16; 64],
    /// The index of each block, or [`NONE`].
    pub(crate) blocks: [u32; 64],
}

/// The blocks that exist.
#[derive(Debug, Default)]
pub(crate) struct Grid {
    pub(crate) chunks: Vec<Chunk>,
    index: HashMap<u64, u32, BuildHasherDefault<Mix>>,
    // A longer list copies pointers, not blocks.
    #[allow(clippy::vec_box)]
    pub(crate) blocks: Vec<Box<Block>>,
    pub(crate) places: Vec<Place>,
}

impl Grid {
    /// Returns the index of a chunk, which is made if it does not exist.
    pub(crate) fn chunk_at(&mut self, place: Place) -> usize {
        let next = self.chunks.len() as u32;
        let at = *self.index.entry(key(place)).or_insert(next);
        if at == next {
            self.chunks.push(Chunk { free: [0; 64], blocks: [NONE; 64] });
        }
        at as usize
    }

    /// Returns a chunk, if it exists.
    pub(crate) fn chunk(&self, place: Place) -> Option<&Chunk> {
        self.index.get(&key(place)).and_then(|i| self.chunks.get(*i as usize))
    }

    /// Makes the blocks that do not exist yet. Their memory is cleared on all threads.
    pub(crate) fn make_blocks(&mut self, places: impl Iterator<Item = Place>) {
        for place in places {
            let chunk = self.chunk_at(chunk_of(place));
            let slot = &mut self.chunks[chunk].blocks[slot_of(place)];
            if *slot == NONE {
                *slot = self.places.len() as u32;
                self.places.push(place);
            }
        }
        let new = self.blocks.len()..self.places.len();
        self.blocks.par_extend(new.into_par_iter().map(|_| Box::default()));
    }

    /// Returns the index of a block, if it exists.
    pub(crate) fn index_of(&self, place: Place) -> Option<u32> {
        let chunk = self.chunk(chunk_of(place))?;
        Some(chunk.blocks[slot_of(place)]).filter(|block| *block != NONE)
    }

    /// Returns a block and how many images saw through all of it, if it exists.
    pub(crate) fn block(&self, place: Place) -> Option<(&Block, u16)> {
        let chunk = self.chunk(chunk_of(place))?;
        let slot = slot_of(place);
        Some((self.blocks.get(chunk.blocks[slot] as usize)?, chunk.free[slot]))
    }

    /// Returns how many images saw through all of a block.
    pub(crate) fn free(&self, place: Place) -> u16 {
        self.chunk(chunk_of(place))
            .map_or(0, |chunk| chunk.free[slot_of(place)])
    }

    /// Returns the number of bytes of blocks and their directory.
    pub(crate) fn bytes(&self) -> u64 {
        let blocks: usize = self.blocks.par_iter().map(|block| block.bytes()).sum();
        blocks as u64 + self.directory_bytes()
    }

    /// Returns the number of bytes if all blocks had colours. The blocks are not looked at.
    pub(crate) fn most_bytes(&self) -> u64 {
        (self.blocks.len() * Block::MOST_BYTES) as u64 + self.directory_bytes()
    }

    fn directory_bytes(&self) -> u64 {
        let blocks = self.blocks.len() * size_of::<(Box<Block>, Place)>();
        let chunks = self.chunks.len() * (size_of::<Chunk>() + size_of::<(u64, u32)>());
        (blocks + chunks) as u64
    }
}

/// Returns the chunk of a block.
pub(crate) fn chunk_of(block: Place) -> Place {
    block.map(|k| k.div_euclid(CHUNK))
}

/// Returns where a block is in its chunk.
pub(crate) fn slot_of(block: Place) -> usize {
    let [x, y, z] = block.map(|k| k.rem_euclid(CHUNK) as usize);
    (z * CHUNK as usize + y) * CHUNK as usize + x
}

/// Returns the block at a slot of a chunk.
pub(crate) fn block_in(chunk: Place, slot: usize) -> Place {
    let slot = slot as i32;
    let within = [slot % CHUNK, slot / CHUNK % CHUNK, slot / (CHUNK * CHUNK)];
    [0, 1, 2].map(|k| chunk[k] * CHUNK + within[k])
}

/// Returns a place as one number: 21 bits an axis.
pub(crate) fn key(place: Place) -> u64 {
    let [x, y, z] = place.map(|k| u64::from((k + FARTHEST) as u32));
    z << 42 | y << 21 | x
}

/// Returns the place of a [`key`].
pub(crate) fn place_of(key: u64) -> Place {
    [0, 21, 42].map(|shift| (key >> shift & 0x1f_ffff) as i32 - FARTHEST)
}

/// Hashes a single number. The map is never walked through, so the hash changes no result.
#[derive(Default)]
pub(crate) struct Mix(u64);

impl Hasher for Mix {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.write_u64(u64::from(*byte));
        }
    }

    fn write_u64(&mut self, number: u64) {
        let mixed = (self.0 ^ number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = mixed ^ mixed >> 29;
    }
}
