//! The dominant direction of the walls of a room.

use glam::Vec3;

/// A face is a wall if |z| of its unit normal is smaller.
const STEEPEST: f32 = 0.3;

/// Returns the dominant horizontal direction of the walls among faces, in degrees in [0, 90) from +X towards
/// +Y. Returns `None` if no face is nearly vertical.
///
/// Each face is given by its unit normal and area. A room turned about Z by the direction has its walls
/// parallel to the axes. Walls that meet at a right angle count as one direction. The direction is the mean
/// by area around the peak of a histogram, which keeps clutter out. Faces whose normal is not finite or whose
/// area is not positive are left out. Source: `s3d_io::formats`, "What is written" (the alignment angle).
///
/// ```
/// use s3d_geom::{dominant_wall_direction_deg, glam::Vec3};
///
/// // Two walls that meet at a right angle, and a floor.
/// let (sin, cos) = 20f32.to_radians().sin_cos();
/// let walls = [(Vec3::new(cos, sin, 0.0), 8.0), (Vec3::new(-sin, cos, 0.0), 6.0), (Vec3::Z, 12.0)];
/// let direction_deg = dominant_wall_direction_deg(walls.into_iter()).unwrap();
/// assert!((direction_deg - 20.0).abs() < 1e-4);
/// assert_eq!(dominant_wall_direction_deg([(Vec3::Z, 12.0)].into_iter()), None);
/// ```
pub fn dominant_wall_direction_deg(walls: impl Iterator<Item = (Vec3, f64)>) -> Option<f64> {
    let walls: Vec<(f64, f64)> = walls
        .filter(|(n, area)| n.is_finite() && n.z.abs() < STEEPEST && area.is_finite() && *area > 0.0)
        .filter(|(n, _)| n.x != 0.0 || n.y != 0.0)
        .map(|(n, area)| (libm::atan2(n.y.into(), n.x.into()).to_degrees().rem_euclid(90.0), area))
        .collect();
    if walls.is_empty() {
        return None;
    }

    let mut area_at = [0.0; 90];
    for &(angle, area) in &walls {
        area_at[angle as usize % 90] += area;
    }

    // The noise of a wall spreads over a few degrees, so the peak is over the sum of five.
    let area_around = |degree: usize| (88..93).map(|off| area_at[(degree + off) % 90]).sum::<f64>();
    let peak = (1..90).fold(0, |best, d| if area_around(d) > area_around(best) { d } else { best });

    let mut direction = peak as f64 + 0.5;
    for reach in [4.0, 3.0, 3.0] {
        let mut moment = 0.0;
        let mut total = 0.0;
        for &(angle, area) in &walls {
            let off = (angle - direction + 45.0).rem_euclid(90.0) - 45.0;
            if off.abs() <= reach {
                moment += off * area;
                total += area;
            }
        }
        if total > 0.0 {
            direction += moment / total;
        }
    }

    // The remainder of a tiny negative number rounds to 90.
    let direction = direction.rem_euclid(90.0);
    Some(if direction < 90.0 { direction } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn wall(angle_deg: f64, area: f64) -> (Vec3, f64) {
        let (s, c) = libm::sincos(angle_deg.to_radians());
        (vec3(c as f32, s as f32, 0.0), area)
    }

    /// Returns a pseudo-random number in [−1, 1).
    fn noise(i: u32) -> f64 {
        f64::from(i.wrapping_mul(2_654_435_761) >> 8) / f64::from(1u32 << 23) - 1.0
    }

    /// Returns the difference of two directions, modulo 90.
    fn apart(a: f64, b: f64) -> f64 {
        ((a - b + 45.0).rem_euclid(90.0) - 45.0).abs()
    }

    #[test]
    fn no_wall_no_direction() {
        assert_eq!(dominant_wall_direction_deg(std::iter::empty()), None);
        let floor_and_slope = [(Vec3::Z, 20.0), (vec3(0.8, 0.0, 0.6), 5.0)];
        assert_eq!(dominant_wall_direction_deg(floor_and_slope.into_iter()), None);
        let odd = [(Vec3::NAN, 1.0), (Vec3::X, f64::NAN), (Vec3::X, 0.0), (Vec3::X, -1.0), (Vec3::ZERO, 1.0)];
        assert_eq!(dominant_wall_direction_deg(odd.into_iter()), None);
    }

    #[test]
    fn opposite_and_perpendicular_walls_are_one_direction() {
        let room = [30.0, 120.0, 210.0, 300.0].map(|a| wall(a, 10.0));
        assert!(apart(dominant_wall_direction_deg(room.into_iter()).unwrap(), 30.0) < 1e-4);
        let square = [Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y].map(|n| (n, 1.0));
        assert_eq!(dominant_wall_direction_deg(square.into_iter()), Some(0.0));
    }

    #[test]
    fn noise_and_clutter_do_not_move_it() {
        for truth in [0.0, 0.4, 12.7, 45.0, 60.2, 89.6] {
            let walls = (0..2000).map(|i| wall(truth + 90.0 * f64::from(i % 4) + 1.5 * noise(i), 0.01));
            // Clutter of the same area in every direction, and a cabinet at an angle.
            let clutter = (0..2000).map(|i| wall(180.0 * noise(i + 5000), 0.01));
            let cabinet = [wall(truth + 20.0, 5.0)];
            let angle = dominant_wall_direction_deg(walls.chain(clutter).chain(cabinet)).unwrap();
            assert!(apart(angle, truth) < 0.15, "{angle} for {truth}");
            assert!((0.0..90.0).contains(&angle));
        }
    }

    #[test]
    fn directions_on_both_sides_of_the_right_angle_are_neighbours() {
        let angle = dominant_wall_direction_deg([wall(89.6, 1.0), wall(0.4, 1.0)].into_iter()).unwrap();
        assert!(apart(angle, 0.0) < 1e-4 && (0.0..90.0).contains(&angle), "{angle}");
        let angle = dominant_wall_direction_deg([wall(89.6, 3.0), wall(0.4, 1.0)].into_iter()).unwrap();
        assert!((angle - 89.8).abs() < 1e-4, "{angle}");
    }

    #[test]
    fn the_larger_walls_win() {
        let walls = [wall(10.0, 2.0), wall(10.0, 2.0), wall(55.0, 3.0)];
        assert!(apart(dominant_wall_direction_deg(walls.into_iter()).unwrap(), 10.0) < 1e-4);
    }

    proptest! {
        #[test]
        fn turning_a_room_turns_its_direction(turn in -360.0..360.0f64, tilt in -0.29..0.29f32) {
            let room = [0.0, 90.0, 180.0].map(|a| {
                let (n, area) = wall(a + turn, 4.0);
                (n * (1.0 - tilt * tilt).sqrt() + Vec3::Z * tilt, area)
            });
            let angle = dominant_wall_direction_deg(room.into_iter()).unwrap();
            prop_assert!((0.0..90.0).contains(&angle));
            prop_assert!(apart(angle, turn) < 1e-4, "{} for {}", angle, turn);
        }
    }
}
