//! The storeys of an area and their ceilings, found as the page finds them ([`crate::files`], "Storeys").

use crate::index::{LocationEntry, RoomEntry};
use s3d_geom::TriMesh;

/// The floors of a storey lie within this height, metres.
const SPAN_M: f64 = 1.8;

/// The assumed height of a camera above a floor that no room has, metres.
const CAMERA_M: f64 = 1.5;

/// What is this much below a floor, or less, is on it, metres.
const SLACK_M: f64 = 0.15;

/// What is higher above the floor of its room belongs to a storey above, metres.
const HEADROOM_M: f64 = 3.0;

/// A ceiling is at least this high above its floor, and may be this much higher than the floor above it,
/// metres.
const CEILING_M: f64 = 1.9;
const CEILING_SLACK_M: f64 = 0.2;

/// A storey is cut this much below its ceilings, metres.
const BELOW_CEILING_M: f64 = 0.1;

/// Without ceilings a storey is cut this high above its highest floor. With ceilings it is cut no lower than
/// this above that floor. Metres.
const OPEN_M: f64 = 2.2;
const LEAST_M: f64 = 0.4;

/// What lies this much below the floors of a storey belongs to it as well, metres.
const BELOW_FLOOR_M: f64 = 0.25;

/// The share of the ceilings that may lie lower than the height that counts as theirs, and of the floors.
const LOW_CEILINGS: f64 = 0.1;
const LOW_FLOORS: f64 = 0.02;

/// The storeys of an area.
pub(crate) struct Storeys {
    /// The lowest and the highest floor of each storey, from below; at least one.
    pub(crate) floors: Vec<[f64; 2]>,
    rooms: Vec<(String, f64)>,
}

/// Returns the height of a room's floor.
pub(crate) fn floor_of(room: &RoomEntry) -> Option<f64> {
    room.floor.or_else(|| room.heights.map(|[low, _]| low))
}

impl Storeys {
    pub(crate) fn new(rooms: &[&RoomEntry], locations: &[&LocationEntry]) -> Self {
        let rooms: Vec<(String, f64)> = rooms
            .iter()
            .filter_map(|room| Some((room.name.clone(), floor_of(room)?)))
            .collect();
        let mut storeys = Self { floors: Vec::new(), rooms };

        // A camera tells of a floor that no room has.
        let mut floors: Vec<(f64, bool)> = storeys.rooms.iter().map(|(_, z)| (*z, true)).collect();
        floors.extend(locations.iter().filter_map(|location| {
            let [.., z] = location.position?;
            (!storeys.is_in(z, &location.room)).then_some((z - CAMERA_M, false))
        }));
        floors.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut groups: Vec<Vec<(f64, bool)>> = Vec::new();
        for floor in floors {
            match groups.last_mut() {
                Some(group) if group.first().is_some_and(|first| floor.0 - first.0 <= SPAN_M) => {
                    group.push(floor);
                }
                _ => groups.push(vec![floor]),
            }
        }

        storeys.floors = groups
            .iter()
            .map(|group| {
                let hears_of_rooms = group.iter().any(|(_, is_known)| *is_known);
                let heights = group.iter().filter(|(_, is_known)| *is_known || !hears_of_rooms);
                heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (z, _)| {
                    [low.min(*z), high.max(*z)]
                })
            })
            .collect();
        if storeys.floors.is_empty() {
            storeys.floors.push([0.0; 2]);
        }
        storeys
    }

    /// Returns the storey with the most rooms, the lowest of equals.
    pub(crate) fn fullest(&self) -> usize {
        let rooms = |storey: usize| self.rooms.iter().filter(|(_, z)| self.of_height(*z) == storey).count();
        (0..self.floors.len())
            .rev()
            .max_by_key(|storey| rooms(*storey))
            .unwrap_or(0)
    }

    /// Returns the storey of a point in a room, whose name may be empty.
    pub(crate) fn of(&self, z: f64, room: &str) -> usize {
        self.of_height(self.floor_around(z, room).unwrap_or(z))
    }

    /// Returns the storey of a height between a floor and its ceiling.
    pub(crate) fn of_height(&self, z: f64) -> usize {
        let above = self.floors.iter().rposition(|[low, _]| z >= low - SLACK_M);
        above.unwrap_or(0)
    }

    fn is_in(&self, z: f64, room: &str) -> bool {
        self.floor_around(z, room).is_some()
    }

    /// Returns the floor of a room, if a point at the height `z` may be in it.
    fn floor_around(&self, z: f64, room: &str) -> Option<f64> {
        let (_, floor) = self.rooms.iter().find(|(name, _)| name == room)?;
        (floor - SLACK_M..floor + HEADROOM_M).contains(&z).then_some(*floor)
    }

    /// Returns the heights between which a storey is seen from above: below its ceilings, and above the
    /// storeys below.
    pub(crate) fn slab(&self, storey: usize, levels: &Levels) -> [f64; 2] {
        if self.floors.len() < 2 {
            let ceiling = levels
                .floor()
                .and_then(|floor| levels.below_ceilings(floor, f64::INFINITY));
            return [f64::NEG_INFINITY, ceiling.unwrap_or(f64::INFINITY)];
        }
        let [lowest, highest] = self.floors.get(storey).copied().unwrap_or_default();
        let next = self.floors.get(storey + 1).map(|[low, _]| *low);
        let high = match (levels.below_ceilings(lowest, next.unwrap_or(f64::INFINITY)), next) {
            (Some(ceiling), _) => ceiling.max(highest + LEAST_M),
            (None, Some(next)) => (highest + OPEN_M).min(next - BELOW_FLOOR_M),
            (None, None) => f64::INFINITY,
        };
        [
            if storey == 0 {
                f64::NEG_INFINITY
            } else {
                lowest - BELOW_FLOOR_M
            },
            high,
        ]
    }
}

/// The heights of level faces and their surface, m², from the lowest.
#[derive(Default)]
pub(crate) struct Levels {
    up: Vec<(f32, f64)>,
    down: Vec<(f32, f64)>,
}

impl Levels {
    pub(crate) fn of(mesh: &TriMesh) -> Self {
        let mut levels = Self::default();
        for face in 0..mesh.faces().len() as u32 {
            let steep = mesh.normal(face).z;
            let of = if steep > 0.9 {
                &mut levels.up
            } else if steep < -0.9 {
                &mut levels.down
            } else {
                continue;
            };
            of.push((mesh.triangle(face).iter().map(|corner| corner.z).sum::<f32>() / 3.0, mesh.area(face)));
        }
        for list in [&mut levels.up, &mut levels.down] {
            list.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        levels
    }

    /// Returns the height of the lowest floor.
    fn floor(&self) -> Option<f64> {
        level_of(&self.up, LOW_FLOORS)
    }

    /// Returns a height just below the ceilings over a floor, and below the next floor above.
    fn below_ceilings(&self, floor: f64, above: f64) -> Option<f64> {
        let first = self.down.partition_point(|(z, _)| f64::from(*z) <= floor + CEILING_M);
        let end = self
            .down
            .partition_point(|(z, _)| f64::from(*z) < above + CEILING_SLACK_M);
        let ceilings = self.down.get(first..end).unwrap_or_default();
        Some(level_of(ceilings, LOW_CEILINGS)? - BELOW_CEILING_M)
    }
}

/// Returns the height below which this share of the surface lies.
fn level_of(levels: &[(f32, f64)], share: f64) -> Option<f64> {
    let all: f64 = levels.iter().map(|(_, m2)| m2).sum();
    let mut below = 0.0;
    let found = levels.iter().find(|(_, m2)| {
        below += m2;
        below >= share * all
    });
    found.map(|(z, _)| f64::from(*z))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    pub(crate) fn room(name: &str, floor: f64) -> RoomEntry {
        RoomEntry {
            area: 1,
            name: name.into(),
            floor_m2: 9.0,
            floor: Some(floor),
            heights: None,
            outline: Vec::new(),
        }
    }

    fn stand(room: &str, z: f64) -> LocationEntry {
        LocationEntry { room: room.into(), position: Some([0.0, 0.0, z]), ..LocationEntry::default() }
    }

    /// Level faces of 4 × 4 m, by height and whether they face upwards.
    pub(crate) fn slabs(heights: &[(f32, bool)]) -> TriMesh {
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        for (z, up) in heights {
            let first = positions.len() as u32;
            positions.extend([[0., 0.], [4., 0.], [4., 4.], [0., 4.]].map(|[x, y]| vec3(x, y, *z)));
            let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
            faces.extend(if *up {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, c, b], [a, d, c]]
            });
        }
        TriMesh::from_faces(positions, faces).unwrap()
    }

    #[test]
    fn floors_within_a_span_are_one_storey() {
        let rooms = [room("a", 0.0), room("b", 1.2), room("c", 3.0)];
        // A stairwell, whose room is on the ground floor, and a location in no room.
        let stands = [stand("a", 4.6), stand("", 7.5), stand("b", 2.7)];
        let storeys = Storeys::new(&rooms.each_ref(), &stands.each_ref());
        assert_eq!(storeys.floors, [[0.0, 1.2], [3.0, 3.0], [6.0, 6.0]]);
        let found = [(1.5, "a"), (2.9, "b"), (4.6, "a"), (4.6, ""), (9.0, "c")];
        assert_eq!(found.map(|(z, room)| storeys.of(z, room)), [0, 0, 1, 1, 2]);
    }

    #[test]
    fn a_storey_is_cut_below_its_ceiling_and_above_the_one_below() {
        let house = slabs(&[(0.0, true), (2.5, false), (2.8, true), (5.2, false)]);
        let levels = Levels::of(&house);
        let rooms = [room("a", 0.0), room("b", 2.8)];
        let storeys = Storeys::new(&rooms.each_ref(), &[]);
        let rounded = |[low, high]: [f64; 2]| [low, (high * 1e4).round() / 1e4];
        assert_eq!(rounded(storeys.slab(0, &levels)), [f64::NEG_INFINITY, 2.4]);
        assert_eq!(rounded(storeys.slab(1, &levels)), [2.8 - BELOW_FLOOR_M, 5.1]);
        // Without rooms the lowest floor counts, and without ceilings nothing is cut.
        let one = Storeys::new(&[], &[]);
        assert_eq!(rounded(one.slab(0, &levels)), [f64::NEG_INFINITY, 2.4]);
        assert_eq!(one.slab(0, &Levels::of(&slabs(&[(1.0, true)]))), [f64::NEG_INFINITY, f64::INFINITY]);
    }
}
