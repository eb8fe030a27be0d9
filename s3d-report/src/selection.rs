//! Why candidate views were kept or dropped, as far as their entropy tells.

use s3d_io::dataset::ViewRecord;
use s3d_sample::{Pool, Selection};
use serde::Serialize;
use std::collections::BTreeMap;

/// Why a view is in the data set, or is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Reason {
    /// Every candidate is kept.
    All,
    /// Its entropy is among the highest of its pool.
    Highest,
    /// It was drawn from the middle of its pool.
    Drawn,
    /// It was in the middle of its pool, and not drawn.
    NotDrawn,
    /// Its entropy is among the lowest of its pool.
    Lowest,
}

/// The place of a view in its pool.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct PoolPlace {
    pub(crate) reason: Reason,
    /// Its rank, from 1 for the highest entropy.
    pub(crate) rank: usize,
    /// The number of members of the pool.
    pub(crate) pool: usize,
}

/// Returns the places of candidates, in their order. `views` has the area of each.
pub(crate) fn places(views: &[(u32, &ViewRecord)], pool: Pool, keep_all: bool) -> Vec<PoolPlace> {
    let mut pools: BTreeMap<(u32, &str), Vec<usize>> = BTreeMap::new();
    for (i, (area, view)) in views.iter().enumerate() {
        let key = match pool {
            Pool::Dataset => (0, ""),
            Pool::Area => (*area, ""),
            Pool::Location => (*area, view.camera_uuid.as_str()),
        };
        pools.entry(key).or_default().push(i);
    }

    let selection = Selection::default();
    let mut ranked: Vec<(usize, PoolPlace)> = Vec::with_capacity(views.len());
    for members in pools.into_values() {
        let mut members: Vec<(usize, u32, &ViewRecord)> = members
            .into_iter()
            .filter_map(|i| views.get(i).map(|(area, view)| (i, *area, *view)))
            .collect();
        // The first name wins a tie, like in the selection.
        members.sort_by_cached_key(|(_, area, v)| (*area, v.camera_uuid.clone(), v.candidate));
        members.sort_by(|a, b| b.2.entropy.total_cmp(&a.2.entropy));

        let n = members.len();
        let certain = selection.certain(n);
        let dropped = selection.discarded(n);
        for (at, (i, _, view)) in members.into_iter().enumerate() {
            let reason = match view.frame_num {
                Some(_) if keep_all => Reason::All,
                Some(_) if at < certain => Reason::Highest,
                Some(_) => Reason::Drawn,
                None if at + dropped >= n => Reason::Lowest,
                None => Reason::NotDrawn,
            };
            ranked.push((i, PoolPlace { reason, rank: at + 1, pool: n }));
        }
    }
    ranked.sort_by_key(|(i, _)| *i);
    ranked.into_iter().map(|(_, place)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_sample::{PoolItem, select_pooled};

    #[test]
    fn reasons_agree_with_the_selection() {
        let mut views: Vec<(u32, ViewRecord)> = Vec::new();
        for candidate in 0..60 {
            for (area, uuid) in [(1, "b"), (2, "a")] {
                let entropy = f64::from((candidate * 7 + area) % 11) / 8.0;
                let view = ViewRecord {
                    camera_uuid: uuid.into(),
                    candidate,
                    yaw_rad: 0.0,
                    pitch_rad: 0.0,
                    fov_rad: 1.0,
                    entropy,
                    frame_num: None,
                };
                views.push((area, view));
            }
        }
        for pool in [Pool::Dataset, Pool::Area, Pool::Location] {
            let items: Vec<_> = views
                .iter()
                .map(|(area, view)| (*area, view.camera_uuid.clone(), view.candidate, view.entropy))
                .collect();
            let items: Vec<PoolItem<'_>> = items
                .iter()
                .map(|(area, location, view, score)| PoolItem {
                    area: *area,
                    location,
                    view: *view,
                    score: *score,
                })
                .collect();
            let stays = select_pooled(&items, pool, &Selection::default(), 7);
            for ((_, view), stays) in views.iter_mut().zip(stays) {
                view.frame_num = stays.then_some(0);
            }
            let listed: Vec<(u32, &ViewRecord)> = views.iter().map(|(area, view)| (*area, view)).collect();
            let places = places(&listed, pool, false);
            let count = |reason| places.iter().filter(|place| place.reason == reason).count();
            let pools = if pool == Pool::Dataset { 1 } else { 2 };
            let size = 120 / pools;
            assert!(places.iter().all(|place| place.pool == size));
            assert_eq!(count(Reason::Highest), 72, "{pool}");
            assert_eq!(count(Reason::Lowest), 18, "{pool}");
            assert_eq!(count(Reason::Drawn) + count(Reason::NotDrawn), 30, "{pool}");
        }
    }
}
