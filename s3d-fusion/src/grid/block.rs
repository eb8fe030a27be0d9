//! A block of voxels: 6 bytes each, and 3 more with colours.

use super::VOXELS;

/// The voxels of a block as columns. Voxel (i, j, k) is at (k·8 + j)·8 + i.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// The mean signed distance as a share of the truncation, ±32767. [`PASSED`] in voxels of no weight that
    /// a ray passed.
    distance: [i16; VOXELS],
    /// The sum of weights: the upper half of a 32-bit float. Observations of the same weight count up to the
    /// 256th, and later ones replace older ones.
    weight: [u16; VOXELS],
    /// How many images saw the voxel at or behind a surface, less those that saw through it.
    votes: [i16; VOXELS],
    /// Mean colours; [`NO_COLOR`] where there is none.
    colors: Option<Box<[[u8; 3]; VOXELS]>>,
}

/// The distance of a voxel that was seen far before surfaces alone.
const PASSED: i16 = i16::MAX;
/// The colour of voxels without one.
pub(crate) const NO_COLOR: [u8; 3] = [0; 3];

impl Default for Block {
    fn default() -> Self {
        Self { distance: [0; VOXELS], weight: [0; VOXELS], votes: [0; VOXELS], colors: None }
    }
}

/// What is known of a voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Voxel {
    /// Nothing.
    Unknown,
    /// Rays passed it far before they hit something.
    Passed,
    /// Its signed distance as a share of the truncation.
    Distance(f32),
}

impl Block {
    /// Returns what is known of a voxel. `free` is how many images saw through the whole block.
    pub(crate) fn voxel(&self, i: usize, free: u16) -> Voxel {
        if self.weight[i] == 0 {
            return if free > 0 || self.distance[i] == PASSED {
                Voxel::Passed
            } else {
                Voxel::Unknown
            };
        }
        // As many saw through it as saw it. What is behind a surface was seen at least once.
        let is_carved = self.distance[i] < 0 && i32::from(self.votes[i]) <= i32::from(free);
        if is_carved {
            Voxel::Unknown
        } else {
            Voxel::Distance(f32::from(self.distance[i]) / 32767.0)
        }
    }

    /// Returns the colour of a voxel, if it has one.
    pub(crate) fn color(&self, i: usize) -> Option<[u8; 3]> {
        self.colors.as_ref().map(|c| c[i]).filter(|c| *c != NO_COLOR)
    }

    /// Notes that a ray passed a voxel. `is_far`: far before all that it hit. `counts`: certainly, also
    /// beside the ray.
    #[inline(always)]
    pub(crate) fn pass(&mut self, i: usize, is_far: bool, counts: bool) {
        if is_far && self.weight[i] == 0 {
            self.distance[i] = PASSED;
        }
        if counts {
            self.votes[i] = self.votes[i].saturating_sub(1);
        }
    }

    /// Adds a distance, as a share of the truncation, to the mean of a voxel. `is_at`: the voxel is at the
    /// surface or behind it. Returns the share that the distance has in the mean.
    #[inline(always)]
    pub(crate) fn observe(&mut self, i: usize, distance: f32, weight: f32, is_at: bool) -> f32 {
        let old = f32::from_bits(u32::from(self.weight[i]) << 16);
        let sum = old + weight;
        let share = weight / sum;
        let mean = if old > 0.0 { f32::from(self.distance[i]) } else { 0.0 };
        let mean = mean + (distance * 32767.0 - mean) * share;
        // Rounded to the nearest number, without a call.
        self.distance[i] = ((mean.clamp(-32766.0, 32766.0) + 32768.5) as i32 - 32768) as i16;
        // Rounded to the nearest half.
        self.weight[i] = ((sum.to_bits() + 0x8000) >> 16) as u16;
        self.votes[i] = self.votes[i].saturating_add(i16::from(is_at));
        share
    }

    /// Moves the colour of a voxel by a share towards another one. `chance`, from 0 to 1, decides how parts
    /// of a level are rounded, so that small shares add up.
    #[inline(always)]
    pub(crate) fn mix_color(&mut self, i: usize, color: [u8; 3], share: f32, chance: f32) {
        let colors = self.colors.get_or_insert_with(|| Box::new([NO_COLOR; VOXELS]));
        let old = colors[i];
        let mixed = if old == NO_COLOR {
            color
        } else {
            [0, 1, 2].map(|k| {
                let (from, to) = (f32::from(old[k]), f32::from(color[k]));
                (from + (to - from) * share + chance) as u8
            })
        };
        colors[i] = if mixed == NO_COLOR { [0, 0, 1] } else { mixed };
    }

    /// Returns the number of bytes that the block takes.
    pub(crate) fn bytes(&self) -> usize {
        size_of::<Self>() + self.colors.as_ref().map_or(0, |c| size_of_val(&**c))
    }
}
