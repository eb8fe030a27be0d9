//! A block of voxels: 6 bytes each, and 3 more with colours.

use super::{SIDE, VOXELS};
use crate::lanes::{LANES, Lanes, floor, pick};

/// The voxels of a block as columns. Voxel (i, j, k) is at (k·8 + j)·8 + i.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// The mean signed distance as a share of the truncation, ±32767. [`PASSED`] in voxels of no weight that
    /// a ray passed.
    distance: [i16; VOXELS],
    /// The sum of weights: the upper half of a 32-bit float. Observations of the same weight count up to the
    /// 256th, and later ones replace older ones. The bit of the sign is [`AT`].
    weight: [u16; VOXELS],
    /// How many images saw the voxel at or behind a surface, less those that saw through it.
    votes: [i16; VOXELS],
    /// Mean colours; [`NO_COLOR`] where there is none.
    colors: Option<Box<[[u8; 3]; VOXELS]>>,
}

/// The distance of a voxel that was seen far before surfaces alone.
const PASSED: i16 = i16::MAX;
/// Part of the weight of voxels that were seen at a surface: one of their distances was near 0.
const AT: u16 = 0x8000;
/// The colour of voxels without one.
pub(crate) const NO_COLOR: [u8; 3] = [0; 3];

/// What an image says of voxels side by side. Answers are 1 or 0.
#[derive(Default)]
pub(crate) struct Row {
    /// The signed distance as a share of the truncation.
    pub(crate) distance: Lanes,
    /// 0 where no distance was observed.
    pub(crate) weight: Lanes,
    /// Whether a ray passed far before all that it hit.
    pub(crate) is_far: Lanes,
    /// Whether a ray passed certainly, also beside the ray.
    pub(crate) is_through: Lanes,
}

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
    /// Its signed distance as a share of the truncation, and whether it was seen at a surface.
    Distance { distance: f32, is_at: bool },
}

/// What is known of the voxels of a row, a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RowStates {
    /// Rays passed the voxel, or it has a distance.
    pub(crate) known: u16,
    /// It has a distance, and is behind the surface.
    pub(crate) behind: u16,
    /// It has a distance, and is before the surface.
    pub(crate) before: u16,
    /// It has a distance, and was seen at a surface.
    pub(crate) at: u16,
}

impl RowStates {
    /// Returns the states of voxels of which the same is known, `all` as bits, and writes the distance of the
    /// first ones. That of voxels that rays passed alone is `passed`.
    pub(crate) fn same(voxel: Voxel, all: u16, passed: f32, values: &mut [f32]) -> Self {
        let (value, known) = match voxel {
            Voxel::Unknown => (passed, 0),
            Voxel::Passed => (passed, all),
            Voxel::Distance { distance, .. } => (distance, all),
        };
        values[..all.count_ones() as usize].fill(value);
        let Voxel::Distance { distance, is_at } = voxel else { return Self { known, ..Self::default() } };
        let if_so = |is_so: bool| if is_so { all } else { 0 };
        Self { known, behind: if_so(distance < 0.0), before: if_so(distance >= 0.0), at: if_so(is_at) }
    }

    /// Adds the states of voxels from place `first` of the row on.
    pub(crate) fn add(&mut self, other: Self, first: usize) {
        self.known |= other.known << first;
        self.behind |= other.behind << first;
        self.before |= other.before << first;
        self.at |= other.at << first;
    }
}

impl Block {
    /// The bytes of a block with colours.
    pub(crate) const MOST_BYTES: usize = size_of::<Self>() + size_of::<[[u8; 3]; VOXELS]>();

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
            let distance = f32::from(self.distance[i]) / 32767.0;
            Voxel::Distance { distance, is_at: self.weight[i] & AT != 0 }
        }
    }

    /// Does for the eight voxels of a row what [`Block::voxel`] does for one, and writes their distances.
    /// That of voxels that rays passed alone is `passed`; it is any number where nothing is known.
    #[inline]
    pub(crate) fn row(&self, first: usize, free: u16, passed: f32, values: &mut [f32]) -> RowStates {
        let mut states = RowStates::default();
        for (lane, value) in values[..SIDE as usize].iter_mut().enumerate() {
            let i = first + lane;
            let (distance, has_distance) = (self.distance[i], self.weight[i] != 0);
            let is_passed = !has_distance & ((free > 0) | (distance == PASSED));
            let is_carved = (distance < 0) & (i32::from(self.votes[i]) <= i32::from(free));
            let is_seen = has_distance & !is_carved;
            states.known |= u16::from(is_passed | is_seen) << lane;
            states.behind |= u16::from(is_seen & (distance < 0)) << lane;
            states.before |= u16::from(is_seen & (distance >= 0)) << lane;
            states.at |= u16::from(is_seen & (self.weight[i] & AT != 0)) << lane;
            *value = if is_seen { f32::from(distance) / 32767.0 } else { passed };
        }
        states
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

    /// Adds a distance, as a share of the truncation, to the mean of a voxel. If it is within
    /// `near` of 0, the voxel is at the surface. Returns the share that the distance has in the mean.
    #[inline(always)]
    pub(crate) fn observe(&mut self, i: usize, distance: f32, weight: f32, near: f32) -> f32 {
        let old = f32::from_bits(u32::from(self.weight[i] & !AT) << 16);
        let sum = old + weight;
        let share = weight / sum;
        let mean = if old > 0.0 { f32::from(self.distance[i]) } else { 0.0 };
        let mean = mean + (distance * 32767.0 - mean) * share;
        self.distance[i] = floor(mean.clamp(-32766.0, 32766.0) + 0.5) as i16;
        // Rounded to the nearest half.
        let at = self.weight[i] & AT | u16::from(distance.abs() < near) << 15;
        self.weight[i] = ((sum.to_bits() + 0x8000) >> 16) as u16 | at;
        self.votes[i] = self.votes[i].saturating_add(i16::from(distance < near));
        share
    }

    /// Does for voxels from `first` on what [`Block::pass`] and then [`Block::observe`] do for one.
    /// Returns the shares that the distances have in the means.
    #[inline(always)]
    pub(crate) fn observe_row(&mut self, first: usize, row: &Row, near: f32) -> Lanes {
        let place = first..first + LANES;
        let [distances, votes] = [&mut self.distance, &mut self.votes].map(|c| &mut c[place.clone()]);
        let weights = &mut self.weight[place];
        let (mut old, mut distance, mut vote) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            old[lane] = f32::from_bits(u32::from(weights[lane] & !AT) << 16);
            distance[lane] = f32::from(distances[lane]);
            vote[lane] = f32::from(votes[lane]);
        }

        let (mut shares, mut sums) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let weight = row.weight[lane];
            let is_new = f32::from(old[lane] == 0.0);
            let sum = old[lane] + weight;
            let share = weight / (sum + f32::from(sum == 0.0));
            let mean = distance[lane] - is_new * distance[lane];
            let mean = mean + (row.distance[lane] * 32767.0 - mean) * share;
            let unseen = is_new * row.is_far[lane] * (f32::from(PASSED) - distance[lane]);
            let mean = mean.clamp(-32766.0, 32766.0);
            distance[lane] = pick(weight > 0.0, mean, distance[lane] + unseen);
            (shares[lane], sums[lane]) = (share, sum);
        }
        for lane in 0..LANES {
            distances[lane] = floor(distance[lane] + 0.5) as i16;
            let is_seen = row.weight[lane] > 0.0;
            let at = weights[lane] & AT | u16::from(is_seen & (row.distance[lane].abs() < near)) << 15;
            weights[lane] = ((sums[lane].to_bits() + 0x8000) >> 16) as u16 | at;
            let vote = (vote[lane] - row.is_through[lane]).max(i16::MIN.into());
            let is_behind = f32::from(is_seen & (row.distance[lane] < near));
            votes[lane] = floor((vote + is_behind).min(i16::MAX.into())) as i16;
        }
        shares
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn voxels_side_by_side_are_single_voxels() {
        let mut state = 7_u32;
        let mut below = |most: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % most
        };
        let (mut rows, mut single) = (Block::default(), Block::default());
        for _ in 0..20_000 {
            let first = 8 * below(3) as usize;
            let mut row = Row::default();
            let mut expected = [0.0; LANES];
            for (lane, expected) in expected.iter_mut().enumerate() {
                let i = first + lane;
                let (is_far, is_through) = (below(5) == 0, below(5) == 0);
                row.is_far[lane] = f32::from(is_far);
                row.is_through[lane] = f32::from(is_through);
                if is_far || is_through {
                    single.pass(i, is_far, is_through);
                }
                if below(3) > 0 {
                    row.distance[lane] = below(4001) as f32 / 2000.0 - 1.0;
                    row.weight[lane] = (1 + below(1000)) as f32 / 300.0;
                    *expected = single.observe(i, row.distance[lane], row.weight[lane], 0.1);
                }
            }
            assert_eq!(rows.observe_row(first, &row, 0.1), expected);
        }
        assert_eq!((rows.distance, rows.weight, rows.votes), (single.distance, single.weight, single.votes));

        for (first, free) in [0, 8, 16]
            .into_iter()
            .flat_map(|first| [0, 1, 5].map(|free| (first, free)))
        {
            let mut values = [0.0; SIDE as usize];
            let states = rows.row(first, free, 0.25, &mut values);
            let mut expected = RowStates::default();
            for (lane, value) in values.into_iter().enumerate() {
                let mut plain = [value];
                let voxel = rows.voxel(first + lane, free);
                expected.add(RowStates::same(voxel, 1, 0.25, &mut plain), lane);
                assert_eq!(plain, [value], "voxel {lane} of {first}, seen through {free} times");
            }
            assert_eq!(states, expected);
        }
        assert!(rows.distance.contains(&PASSED) || rows.weight[0] > 0);
    }
}
