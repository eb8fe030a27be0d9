//! Rooms that overlap. This is nearly always a mistake: an instance in another room's folder, or a room given
//! twice.

use crate::survey::annotated::SurveyedRoom;
use s3d_geom::Aabb;

/// Overlaps are reported above this share of the smaller room's floor and of the lower room's height.
/// Neighbours share a wall.
const MUCH: f64 = 0.2;
/// Places along an axis at which two rooms are compared.
const STEPS: u32 = 32;

/// Returns a sentence for each pair of rooms of which one lies largely in the other.
pub(crate) fn overlap_doubts(rooms: &[SurveyedRoom]) -> Vec<String> {
    let mut doubts = Vec::new();
    for (i, a) in rooms.iter().enumerate() {
        for b in rooms.iter().skip(i + 1) {
            let (small, large) = if a.footprint.area_m2 <= b.footprint.area_m2 {
                (a, b)
            } else {
                (b, a)
            };

            let share = shared(small, large);
            if share > MUCH {
                doubts.push(format!(
                    "rooms {} and {} overlap: {:.0} % of the floor of {} is in {} too; a face there is of \
                     the room with the most points on it",
                    a.room,
                    b.room,
                    100.0 * share,
                    small.room,
                    large.room
                ));
            }
        }
    }
    doubts
}

/// The share of the floor of `small` that is in `large` too; 0 if one is above the other.
fn shared(small: &SurveyedRoom, large: &SurveyedRoom) -> f64 {
    let low = small.bbox.min.max(large.bbox.min);
    let high = small.bbox.max.min(large.bbox.max);
    let both = Aabb { min: low, max: high };
    let min = height(&small.bbox).min(height(&large.bbox));
    if low.x >= high.x || low.y >= high.y || height(&both) <= MUCH * min {
        return 0.0;
    }

    let mut of_small = 0u32;
    let mut of_both = 0u32;
    let low = small.bbox.min.as_dvec3();
    let high = small.bbox.max.as_dvec3();
    for i in 0..STEPS {
        for j in 0..STEPS {
            let x = place(i, low.x, high.x);
            let y = place(j, low.y, high.y);
            if small.footprint.contains(x, y) {
                of_small += 1;
                of_both += u32::from(large.footprint.contains(x, y));
            }
        }
    }

    f64::from(of_both) / f64::from(of_small.max(1))
}

/// The height of a box, metres.
fn height(room: &Aabb) -> f64 {
    f64::from(room.max.z) - f64::from(room.min.z)
}

/// The `k`th of the [`STEPS`] places between two coordinates.
fn place(k: u32, low: f64, high: f64) -> f64 {
    low + (high - low) * (f64::from(k) + 0.5) / f64::from(STEPS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Vec3, vec3};
    use s3d_geom::{FootprintBuilder, FootprintOptions};

    /// A room of `w` × `d` × 2.5 m with a corner at `at`.
    fn room(name: &str, at: Vec3, w: f32, d: f32) -> SurveyedRoom {
        let mut builder = FootprintBuilder::new(FootprintOptions::default());
        for i in 0..=60u8 {
            for j in 0..=60u8 {
                builder.add(at + vec3(w * f32::from(i) / 60.0, d * f32::from(j) / 60.0, 0.0));
            }
        }
        let bbox = Aabb { min: at, max: at + vec3(w, d, 2.5) };
        let room = name.parse().unwrap();
        let footprint = builder.finish();
        SurveyedRoom { room, points: 3721, footprint, bbox, wall_direction_deg: 0 }
    }

    /// Returns the doubts about an office of 6 × 4 m and another room.
    fn doubts(other: SurveyedRoom) -> Vec<String> {
        overlap_doubts(&[room("office_1", Vec3::ZERO, 6.0, 4.0), other])
    }

    #[test]
    fn rooms_in_one_another_are_told_and_neighbours_are_not() {
        // A wall in common, the floor above, far away.
        assert!(doubts(room("office_2", vec3(5.9, 0.0, 0.0), 3.0, 3.0)).is_empty());
        assert!(doubts(room("office_2", vec3(0.0, 0.0, 2.6), 6.0, 4.0)).is_empty());
        assert!(doubts(room("office_2", vec3(50.0, 0.0, 0.0), 6.0, 4.0)).is_empty());

        let found = doubts(room("lobby_2", vec3(3.0, 1.0, 0.1), 5.0, 2.0));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].contains("office_1 and lobby_2 overlap: 5") || found[0].contains("overlap: 6"),
            "{found:?}"
        );
        assert!(found[0].contains("% of the floor of lobby_2 is in office_1 too"), "{found:?}");

        let twice = doubts(room("office_7", Vec3::ZERO, 6.0, 4.0));
        assert!(twice[0].contains("overlap: 100 %"), "{twice:?}");
    }
}
