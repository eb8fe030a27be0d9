//! What the page shows before it has read the index, which is large for a large data set.

use crate::index::{FORM, Index, RoomEntry, rounded};
use serde::Serialize;

/// The floors of a storey lie within this height, in metres.
const STOREY_M: f64 = 1.8;

/// A ring of an outline has at most so many corners here.
const MOST_CORNERS: usize = 64;

/// `data/first.js`.
#[derive(Serialize)]
pub(crate) struct First<'a> {
    form: u32,
    name: &'a str,
    parts: Parts,
    /// Rings of the rooms of a storey of the first area: x and y in the world, in metres.
    outline: Vec<Vec<[f64; 2]>>,
}

/// The parts of a report that are not empty. Each has a tab.
#[derive(Serialize)]
struct Parts {
    meshes: bool,
    panoramas: bool,
    views: bool,
    plan: bool,
    against: bool,
    scores: bool,
}

impl<'a> First<'a> {
    pub(crate) fn of(index: &'a Index) -> Self {
        let has_photographs = index.views.iter().any(|view| view.position.is_some());
        let parts = Parts {
            meshes: !index.meshes.is_empty(),
            panoramas: index.locations.iter().any(|location| location.pano),
            views: !index.views.is_empty(),
            plan: !index.rooms.is_empty() || !index.locations.is_empty() || has_photographs,
            against: index.against.is_some(),
            scores: index.scores > 0,
        };
        let area = index.meshes.first().map(|mesh| mesh.area);
        let area = area.or_else(|| index.rooms.first().map(|room| room.area));
        let rooms: Vec<&RoomEntry> = index.rooms.iter().filter(|room| Some(room.area) == area).collect();
        let outline = storey(&rooms)
            .into_iter()
            .flat_map(|room| &room.outline)
            .map(|ring| coarse(ring));
        Self { form: FORM, name: &index.data_set.name, parts, outline: outline.collect() }
    }
}

/// Returns the rooms of the storey with the most rooms, the lowest of equals.
fn storey<'a>(rooms: &[&'a RoomEntry]) -> Vec<&'a RoomEntry> {
    let height = |room: &RoomEntry| room.floor.or(room.heights.map(|[low, _]| low)).unwrap_or_default();
    let on = |floor: f64| {
        let is_on = move |room: &&&RoomEntry| (floor..=floor + STOREY_M).contains(&height(room));
        rooms.iter().filter(is_on).copied().collect::<Vec<_>>()
    };
    let mut floors: Vec<f64> = rooms.iter().map(|room| height(room)).collect();
    floors.sort_by(f64::total_cmp);
    let storeys = floors.into_iter().rev().map(on);
    storeys.max_by_key(Vec::len).unwrap_or_default()
}

/// Returns a ring with fewer corners, to the centimetre.
fn coarse(ring: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let step = ring.len().div_ceil(MOST_CORNERS).max(1);
    ring.iter()
        .step_by(step)
        .map(|corner| corner.map(|c| rounded(c, 2)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn room(name: &str, floor: f64) -> RoomEntry {
        let ring = (0..200).map(|i| [f64::from(i), 0.123_4]).collect();
        let (floor, heights) = (Some(floor), None);
        RoomEntry { area: 1, name: name.into(), floor_m2: 1.0, floor, heights, outline: vec![ring] }
    }

    #[test]
    fn the_fullest_storey_is_outlined() {
        let rooms = [room("hall", 0.0), room("a", 3.0), room("b", 3.4), room("attic", 6.1)];
        let all: Vec<&RoomEntry> = rooms.iter().collect();
        let names = |rooms: Vec<&RoomEntry>| rooms.iter().map(|room| room.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(storey(&all)), ["a", "b"]);
        assert_eq!(names(storey(&[&rooms[3], &rooms[0]])), ["hall"]);
        assert!(storey(&[]).is_empty());
        let ring = coarse(&rooms[0].outline[0]);
        assert!(ring.len() <= MOST_CORNERS && ring[1] == [4.0, 0.12], "{ring:?}");
    }
}
