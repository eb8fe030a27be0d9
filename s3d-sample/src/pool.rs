//! Selection of views by name, within the data set, an area or a location.

use crate::stream::stream;
use crate::{Selection, select};
use rand::Rng;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// The views that compete with each other. Source: `s3d_io::formats`, "Views".
///
/// ```
/// use s3d_sample::Pool;
///
/// assert_eq!("area".parse(), Ok(Pool::Area));
/// assert_eq!(Pool::default().to_string(), "dataset");
/// assert!("building".parse::<Pool>().is_err());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Pool {
    /// All views of the data set. The paper did this, by its counts.
    #[default]
    Dataset,
    /// The views of an area.
    Area,
    /// The views of a scan location.
    Location,
}

/// A word that is not the name of a pool.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("{word:?} is no pool; the pools are dataset area location")]
pub struct UnknownPool {
    /// The word.
    pub word: String,
}

impl Pool {
    /// The area and location that name the pool of `item`; 0 and empty if the pool spans several.
    fn key<'a>(self, item: &PoolItem<'a>) -> (u32, &'a str) {
        match self {
            Self::Dataset => (0, ""),
            Self::Area => (item.area, ""),
            Self::Location => (item.area, item.location),
        }
    }
}

impl fmt::Display for Pool {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Dataset => "dataset",
            Self::Area => "area",
            Self::Location => "location",
        })
    }
}

impl FromStr for Pool {
    type Err = UnknownPool;

    fn from_str(word: &str) -> Result<Self, UnknownPool> {
        match word {
            "dataset" => Ok(Self::Dataset),
            "area" => Ok(Self::Area),
            "location" => Ok(Self::Location),
            _ => Err(UnknownPool { word: word.to_owned() }),
        }
    }
}

/// A scored view and the place where it was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoolItem<'a> {
    /// The area.
    pub area: u32,
    /// The uuid of the scan location's camera.
    pub location: &'a str,
    /// The number of the view among the location's candidates.
    pub view: u32,
    /// The score, such as an [`entropy`](crate::entropy); finite and not negative.
    pub score: f64,
}

impl PoolItem<'_> {
    fn name(&self) -> (u32, &str, u32) {
        (self.area, self.location, self.view)
    }
}

/// Selects views pool by pool. Returns for each of `items` whether it stays.
///
/// Within a pool, [`select`] gets the views sorted by area, location (as UTF-8 bytes) and view. Its seed
/// comes from a random stream of the pool, whose key is `seed`, the area (0 for the data set) and the
/// location (empty except for [`Pool::Location`]). Whether a view stays therefore depends on `seed` and the
/// members of its pool. It does not depend on other pools or the order of `items`.
///
/// # Panics
/// If a view is there twice, or if [`select`] panics.
#[expect(clippy::panic, reason = "a caller's mistake: see Panics")]
pub fn select_pooled(items: &[PoolItem<'_>], pool: Pool, options: &Selection, seed: u64) -> Vec<bool> {
    let mut order: Vec<usize> = (0..items.len()).collect();
    order.sort_unstable_by(|&a, &b| items[a].name().cmp(&items[b].name()));

    if let Some(pair) = order
        .windows(2)
        .find(|pair| items[pair[0]].name() == items[pair[1]].name())
    {
        let (area, location, view) = items[pair[0]].name();
        panic!("view {view} of location {location} in area {area} is there twice");
    }

    let mut stays = vec![false; items.len()];
    for members in order.chunk_by(|&a, &b| pool.key(&items[a]) == pool.key(&items[b])) {
        let (area, location) = pool.key(&items[members[0]]);
        let pool_seed = stream(*b"pool", seed, location, area).next_u64();

        let scores: Vec<f64> = members.iter().map(|&i| items[i].score).collect();
        for (&i, stay) in members.iter().zip(select(&scores, options, pool_seed)) {
            stays[i] = stay;
        }
    }

    stays
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const LOCATIONS: [&str; 5] = ["a", "b", "c", "d", "e"];

    /// Returns two areas with the same location names, 72 views per location.
    fn items() -> Vec<PoolItem<'static>> {
        let mut items = Vec::new();
        for area in 1..=2 {
            for (l, location) in LOCATIONS.into_iter().enumerate() {
                for view in 0..72 {
                    let score = f64::from((view * 31 + area * 17 + l as u32 * 5) % 72) / 30.0;
                    items.push(PoolItem { area, location, view, score });
                }
            }
        }
        items
    }

    #[test]
    fn pools_go_both_ways() {
        for pool in [Pool::Dataset, Pool::Area, Pool::Location] {
            assert_eq!(pool.to_string().parse(), Ok(pool));
        }
        let message = "room".parse::<Pool>().unwrap_err().to_string();
        assert_eq!(message, "\"room\" is no pool; the pools are dataset area location");
    }

    #[test]
    fn each_pool_keeps_its_share() {
        let items = items();
        let options = Selection::default();
        let kept = |pool, range: std::ops::Range<usize>| {
            select_pooled(&items, pool, &options, 1)[range]
                .iter()
                .filter(|&&s| s)
                .count()
        };
        assert_eq!(kept(Pool::Dataset, 0..720), 522);
        assert_eq!((kept(Pool::Area, 0..360), kept(Pool::Area, 360..720)), (261, 261));
        for l in 0..10 {
            assert_eq!(kept(Pool::Location, l * 72..(l + 1) * 72), 52);
        }
    }

    #[test]
    fn pools_of_equal_scores_draw_differently() {
        let items: Vec<PoolItem<'_>> = items().into_iter().map(|i| PoolItem { score: 1.0, ..i }).collect();
        let stays = select_pooled(&items, Pool::Location, &Selection::default(), 1);
        let mut pools: Vec<&[bool]> = stays.chunks(72).collect();
        pools.sort_unstable();
        pools.dedup();
        assert_eq!(pools.len(), 10);
    }

    #[test]
    #[should_panic(expected = "view 3 of location a in area 1 is there twice")]
    fn a_view_twice_is_a_callers_mistake() {
        let mut items = items();
        items.push(items[3]);
        select_pooled(&items, Pool::Location, &Selection::default(), 1);
    }

    proptest! {
        #[test]
        fn neither_order_nor_other_pools_matter(
            turn in 0usize..720, reverse: bool, seed: u64,
            pool in prop::sample::select(vec![Pool::Dataset, Pool::Area, Pool::Location]),
        ) {
            let items = items();
            let options = Selection::default();
            let stays = select_pooled(&items, pool, &options, seed);

            let mut order: Vec<usize> = (0..items.len()).collect();
            order.rotate_left(turn);
            if reverse {
                order.reverse();
            }
            let moved: Vec<PoolItem<'_>> = order.iter().map(|&i| items[i]).collect();
            let found = select_pooled(&moved, pool, &options, seed);
            prop_assert!(order.iter().zip(&found).all(|(&i, &stay)| stays[i] == stay));

            let alone = match pool {
                Pool::Dataset => 0..720,
                Pool::Area => 360..720,
                Pool::Location => 432..504,
            };
            prop_assert_eq!(select_pooled(&items[alone.clone()], pool, &options, seed), &stays[alone]);
        }
    }
}
