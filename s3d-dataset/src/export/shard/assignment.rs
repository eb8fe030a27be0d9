//! Which shard does what: units of work assigned by their cost, the same way in every process.

use crate::error::Result;
use crate::record::checked::{read_checked, write_checked};
use crate::record::journal::Unit;
use crate::record::listing::walk;
use s3d_geom::Camera;
use s3d_io::dataset::Layout;
use s3d_io::fs::create_dir;
use serde::{Deserialize, Serialize};
use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// One of several processes among which the units of an export are shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// The shard's number, from 1.
    pub(crate) number: u32,
    /// How many shards there are.
    pub(crate) of: u32,
}

/// More shards than this are taken for a typing error.
const MAX_SHARDS: u32 = 1_000_000;

impl Shard {
    /// The one process that does everything.
    pub(crate) const ALL: Self = Self { number: 1, of: 1 };

    /// Whether this shard does the thing at a position, if all things cost alike.
    pub(crate) fn takes(self, position: usize) -> bool {
        position % self.of as usize == self.number as usize - 1
    }

    /// The shard's part in the area at `position` of `areas`, if it has one. Shards are spread over the
    /// areas, so that each opens as few as possible. Where there are fewer shards than areas, areas are
    /// spread over the shards.
    pub(crate) fn within(self, position: usize, areas: usize) -> Option<Self> {
        let index = self.number as usize - 1;
        let of = self.of as usize;
        if of <= areas {
            return self.takes(position).then_some(Self::ALL);
        }
        // Shards `position`, `position + areas`, ... serve the area.
        let group = (of - position).div_ceil(areas);
        let part = Self { number: (index / areas) as u32 + 1, of: group as u32 };
        (index % areas == position).then_some(part)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/').map(|(i, n)| (i.trim().parse(), n.trim().parse()));
        match numbers {
            Some((Ok(number), Ok(of))) if 1 <= number && number <= of && of <= MAX_SHARDS => {
                Ok(Self { number, of })
            }
            Some((Ok(0), Ok(_))) => Err("shards count from 1, as in 1/4 to 4/4".to_owned()),
            _ => Err(format!("must be i/N with i from 1 to N, as in 2/4, and N at most {MAX_SHARDS}")),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// Deals units with these costs among `shards` shards: the dearest first, each to the shard with the least so
/// far. The lowest number wins a tie. Returns the number of each unit's shard, from 1.
///
/// No shard gets more than 4/3 of the largest load of the best assignment (Graham, "Bounds on multiprocessing
/// timing anomalies", 1969, whose bound is 4/3 − 1/3N). The result depends only on the arguments.
///
/// # Panics
/// If `shards` is 0.
pub(crate) fn assign_by_cost(costs: &[u64], shards: u32) -> Vec<u32> {
    assert!(shards > 0, "units need a shard");

    let mut order: Vec<usize> = (0..costs.len()).collect();
    // The sort is stable, so that equal costs stay in the order of the units.
    order.sort_by_key(|i| Reverse(costs[*i]));

    // Shards beyond the number of units stay empty: the heap holds no more than are needed.
    let needed = shards.min(u32::try_from(costs.len()).unwrap_or(u32::MAX));
    let mut least: BinaryHeap<Reverse<(u128, u32)>> = (1..=needed).map(|n| Reverse((0, n))).collect();

    let mut assigned = vec![0; costs.len()];
    for i in order {
        if let Some(mut top) = least.peek_mut() {
            // Every unit costs something: otherwise one shard might get all units that cost nothing.
            top.0.0 += u128::from(costs[i].max(1));
            assigned[i] = top.0.1;
        }
    }
    assigned
}

/// The time of a pixel, in nanoseconds of one core: it is cast, shaded in every modality, compressed and
/// written, in views as in panoramas. The times were measured on the built-in scene on a machine of 2026, and
/// rounded. Only their ratios matter.
const NS_PER_PIXEL: u64 = 55;
/// The time of a face, which is written to two OBJ files.
const NS_PER_FACE: u64 = 1_000;
/// The time of a point, which is drawn, and written to a PLY file, a text file and two arrays.
const NS_PER_POINT: u64 = 110;

/// The cost of a scan location: its panorama and its kept views.
pub(crate) fn location_cost(pano_width: u32, size: u32, kept_views: u64) -> u64 {
    let panorama = u64::from(pano_width) * u64::from(pano_width / 2);
    let view = u64::from(size) * u64::from(size);
    let views = NS_PER_PIXEL.saturating_mul(view).saturating_mul(kept_views);
    NS_PER_PIXEL.saturating_mul(panorama).saturating_add(views)
}

/// The cost of a photograph's view. The photograph is also read and undistorted.
pub(crate) fn photograph_cost(camera: &Camera) -> u64 {
    2 * NS_PER_PIXEL * u64::from(camera.width) * u64::from(camera.height)
}

/// The cost of an area's meshes and points.
pub(crate) fn assets_cost(faces: u64, points: u64) -> u64 {
    NS_PER_FACE
        .saturating_mul(faces)
        .saturating_add(NS_PER_POINT.saturating_mul(points))
}

/// Which shard does which units, for one number of shards. It is kept in the folder in which they work, so
/// that a merge can tell which shards to run again, and a shard that is run again knows its units at once.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Assignment {
    shards: u32,
    /// Each unit, with the number of its shard.
    units: Vec<(Unit, u32)>,
}

impl Assignment {
    /// Deals units, each with its cost.
    pub(crate) fn new(units: Vec<(Unit, u64)>, shards: u32) -> Self {
        let costs: Vec<u64> = units.iter().map(|(_, cost)| *cost).collect();
        let assigned = assign_by_cost(&costs, shards);
        Self { shards, units: units.into_iter().map(|(unit, _)| unit).zip(assigned).collect() }
    }

    /// Gives a unit whose cost does not count to a shard.
    pub(crate) fn assign(&mut self, unit: Unit, number: u32) {
        self.units.push((unit, number));
    }

    /// How many shards there are.
    pub(crate) fn shards(&self) -> u32 {
        self.shards
    }

    /// The units of a shard.
    pub(crate) fn own(&self, number: u32) -> BTreeSet<Unit> {
        self.units
            .iter()
            .filter(|(_, of)| *of == number)
            .map(|(unit, _)| unit.clone())
            .collect()
    }

    /// The numbers of the shards that have any of these units, ascending.
    pub(crate) fn shards_of(&self, units: &[Unit]) -> BTreeSet<u32> {
        let wanted: BTreeSet<&Unit> = units.iter().collect();
        self.units
            .iter()
            .filter(|(unit, _)| wanted.contains(unit))
            .map(|(_, number)| *number)
            .collect()
    }

    /// Writes the assignment into the folder of an unfinished export.
    pub(crate) fn write(&self, layout: &Layout) -> Result<()> {
        create_dir(&Self::folder(layout))?;
        write_checked(&Self::path(layout, self.shards), self)
    }

    /// Reads the assignment among so many shards. Returns `None` if it was not written, or is damaged.
    pub(crate) fn read(layout: &Layout, shards: u32) -> Option<Self> {
        read_checked(&Self::path(layout, shards)).ok()
    }

    /// Reads the assignments among any number of shards.
    pub(crate) fn read_all(layout: &Layout) -> Result<Vec<Self>> {
        let files = walk(&Self::folder(layout))?;
        Ok(files.iter().filter_map(|path| read_checked(path).ok()).collect())
    }

    fn folder(layout: &Layout) -> PathBuf {
        layout.work_dir().join("assignments")
    }

    fn path(layout: &Layout, shards: u32) -> PathBuf {
        Self::folder(layout).join(format!("{shards}.jsonl"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn loads(costs: &[u64], assigned: &[u32], shards: u32) -> Vec<u64> {
        let mut loads = vec![0; shards as usize];
        costs
            .iter()
            .zip(assigned)
            .for_each(|(cost, shard)| loads[*shard as usize - 1] += cost);
        loads
    }

    proptest! {
        #[test]
        fn every_unit_goes_to_exactly_one_shard(
            costs in prop::collection::vec(prop_oneof![0u64..10, 1u64..1_000_000, Just(u64::MAX)], 0..80),
            shards in 1u32..100,
        ) {
            let mut owners = vec![0; costs.len()];
            let units: Vec<(Unit, u64)> =
                costs.iter().enumerate().map(|(i, cost)| (Unit::Scores(1, i.to_string()), *cost)).collect();
            let all: Vec<Unit> = units.iter().map(|(unit, _)| unit.clone()).collect();
            for number in 1..=shards {
                // Each shard finds its units by itself.
                let assignment = Assignment::new(units.clone(), shards);
                for unit in assignment.own(number) {
                    owners[all.iter().position(|u| *u == unit).unwrap()] += 1;
                    prop_assert_eq!(assignment.shards_of(&[unit]), [number].into());
                }
            }
            prop_assert!(owners.iter().all(|n| *n == 1));
        }

        #[test]
        fn every_location_of_every_area_goes_to_exactly_one_shard(
            counts in prop::collection::vec(0usize..20, 1..8),
            shards in 1u32..30,
        ) {
            let mut owners: Vec<Vec<u32>> = counts.iter().map(|n| vec![0; *n]).collect();
            let mut opened = vec![0; counts.len()];
            for number in 1..=shards {
                for (position, owners) in owners.iter_mut().enumerate() {
                    let part = (Shard { number, of: shards }).within(position, counts.len());
                    let Some(part) = part else { continue };
                    opened[position] += 1;
                    prop_assert!(part.number >= 1 && part.number <= part.of);
                    owners.iter_mut().enumerate().filter(|(i, _)| part.takes(*i)).for_each(|(_, n)| *n += 1);
                }
            }
            prop_assert!(owners.iter().flatten().all(|n| *n == 1));
            let most = (shards as usize).div_ceil(counts.len());
            prop_assert!(opened.iter().all(|n| (1..=most).contains(n)));
        }

        #[test]
        fn no_shard_gets_more_than_the_bound(
            costs in prop::collection::vec(1u64..1_000, 1..80),
            shards in 1u32..20,
        ) {
            let assigned = assign_by_cost(&costs, shards);
            let fullest = *loads(&costs, &assigned, shards).iter().max().unwrap();
            // Even the best assignment cannot go below the mean or the dearest unit. The bound of any list
            // scheduling follows from these.
            let sum = costs.iter().sum::<u64>();
            let dearest = *costs.iter().max().unwrap();
            let n = u64::from(shards);
            prop_assert!(n * fullest <= sum + (n - 1) * dearest);
        }

        #[test]
        fn against_the_best_assignment(costs in prop::collection::vec(1u64..50, 1..9), shards in 1u32..4) {
            let fullest = *loads(&costs, &assign_by_cost(&costs, shards), shards).iter().max().unwrap();
            let all = u64::from(shards).pow(costs.len() as u32);
            let best = (0..all)
                .map(|code| {
                    let mut code = code;
                    let assigned: Vec<u32> = costs.iter().map(|_| {
                        let shard = (code % u64::from(shards)) as u32 + 1;
                        code /= u64::from(shards);
                        shard
                    }).collect();
                    loads(&costs, &assigned, shards).into_iter().max().unwrap()
                })
                .min()
                .unwrap();
            let n = u64::from(shards);
            prop_assert!(3 * n * fullest <= (4 * n - 1) * best, "{fullest} against {best}");
        }

        #[test]
        fn a_shards_name_goes_both_ways(number in 1u32..1000, more in 0u32..1000) {
            let shard = Shard { number, of: number + more };
            prop_assert_eq!(shard.to_string().parse(), Ok(shard));
        }
    }

    #[test]
    fn an_assignment_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let layout = Layout::new(dir.path());
        let units = vec![(Unit::Assets(3), 5), (Unit::Location(3, "a".into()), 9), (Unit::Labels(3), 1)];
        Assignment::new(units.clone(), 2).write(&layout).unwrap();
        Assignment::new(units, 40).write(&layout).unwrap();
        let back = Assignment::read(&layout, 2).unwrap();
        assert_eq!(
            (back.own(1), back.own(2)),
            ([Unit::Location(3, "a".into())].into(), [Unit::Labels(3), Unit::Assets(3)].into())
        );
        assert_eq!(Assignment::read_all(&layout).unwrap().len(), 2);
        assert!(Assignment::read(&layout, 3).is_none());
    }

    #[test]
    fn units_that_cost_nothing_are_spread_too() {
        assert_eq!(assign_by_cost(&[0; 6], 3), [1, 2, 3, 1, 2, 3]);
        assert_eq!(assign_by_cost(&[5, 1, 1, 1, 1, 1], 2), [1, 2, 2, 2, 2, 2]);
        assert_eq!(assign_by_cost(&[], 1_000_000), [0u32; 0]);
        assert_eq!(assign_by_cost(&[3, 4], 1_000_000), [2, 1]);
    }

    #[test]
    fn only_i_of_n_is_a_shard() {
        for bad in ["", "1", "/", "1/", "0/4", "5/4", "-1/4", "1/0", "a/b", "1/2/3", "1/99999999"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
        assert_eq!(" 2/ 4".parse(), Ok(Shard { number: 2, of: 4 }));
        assert!("0/4".parse::<Shard>().unwrap_err().contains("from 1"));
    }

    #[test]
    fn dearer_work_costs_more() {
        assert!(location_cost(4096, 1080, 1) < location_cost(4096, 1080, 2));
        assert_eq!(location_cost(u32::MAX, u32::MAX, u64::MAX), u64::MAX);
        assert_eq!(assets_cost(u64::MAX, 1), u64::MAX);
    }
}
