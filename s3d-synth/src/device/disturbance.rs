//! What spoils real scans: mirrors, and people who walk through them.

use crate::RangeError;
use s3d_geom::glam::Vec3;
use std::ops::Range;

/// What devices meet that does not belong to the scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Disturbances {
    /// Mirrors. Devices measure what they show, behind them: a ghost of the room.
    pub mirrors: Vec<Mirror>,
    /// A person who walks while some scans or pictures are taken.
    pub walker: Option<Walker>,
}

/// A plane mirror: a parallelogram that reflects on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mirror {
    /// Its middle, world metres.
    pub middle: Vec3,
    /// From its middle to the middles of its right and its upper edge, at a right angle, world metres.
    pub half: [Vec3; 2],
}

/// A person, as two upright cylinders: a body and a head.
#[derive(Clone, Debug, PartialEq)]
pub struct Walker {
    /// The numbers of the scans or pictures in which the person is there.
    pub numbers: Range<u64>,
    /// Where the feet are when the first of these begins, world metres.
    pub from: Vec3,
    /// Where they are when the last one ends.
    pub to: Vec3,
    /// The height of the person: 0.5 to 2.5.
    pub height_m: f32,
}

/// The colour of a person's clothes.
pub(super) const CLOTHES: [f32; 3] = [104.0, 92.0, 120.0];

/// Radius and upper end of the cylinders of a person, in shares of the height.
const PARTS: [(f32, [f32; 2]); 2] = [(0.14, [0.0, 0.83]), (0.06, [0.83, 1.0])];

impl Disturbances {
    pub(super) fn check(&self) -> Result<(), RangeError> {
        let Some(walker) = &self.walker else { return Ok(()) };
        RangeError::check(walker.height_m, [0.5, 2.5], || "the height of a person".to_owned())
    }

    /// Returns what is there during one scan or picture.
    pub(super) fn during(&self, number: u64) -> Self {
        let walker = self.walker.as_ref().filter(|w| w.numbers.contains(&number));
        let walker = walker.map(|w| {
            let done = |n: u64| (n - w.numbers.start) as f32 / (w.numbers.end - w.numbers.start) as f32;
            let at = |n| w.from.lerp(w.to, done(n));
            Walker { from: at(number), to: at(number + 1), ..w.clone() }
        });
        Self { mirrors: self.mirrors.clone(), walker }
    }

    /// Returns how far away the first mirror along a ray is, before `end`, and its unit normal.
    pub(super) fn mirror(&self, origin: Vec3, direction: Vec3, mut end: f32) -> Option<(f32, Vec3)> {
        let mut first = None;
        for Mirror { middle, half } in &self.mirrors {
            let normal = half[0].cross(half[1]).normalize_or_zero();
            let t = (*middle - origin).dot(normal) / direction.dot(normal);
            let place = origin + direction * t - *middle;
            let is_within = half.iter().all(|h| place.dot(*h).abs() <= h.length_squared());
            // A ray that comes from the mirror does not meet it again.
            if t > 1e-4 && t < end && is_within {
                end = t;
                first = Some((t, normal));
            }
        }
        first
    }

    /// Returns how far away a person is along a ray, before `end`, and the unit normal there. `time` is the
    /// share of the scan that is done.
    pub(super) fn walker(&self, origin: Vec3, direction: Vec3, end: f32, time: f32) -> Option<(f32, Vec3)> {
        let walker = self.walker.as_ref()?;
        let feet = walker.from.lerp(walker.to, time);
        let hits = PARTS.iter().filter_map(|&(radius, [low, high])| {
            let [low, high] = [low, high].map(|share| feet.z + share * walker.height_m);
            cylinder(origin - feet.with_z(0.0), direction, radius * walker.height_m, [low, high])
        });
        hits.filter(|(t, _)| *t < end).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Returns where a ray enters an upright cylinder about the z axis, and the normal there.
fn cylinder(origin: Vec3, direction: Vec3, radius: f32, [low, high]: [f32; 2]) -> Option<(f32, Vec3)> {
    let o = origin.truncate();
    let d = direction.truncate();
    let a = d.length_squared();
    let b = o.dot(d);
    let root = b * b - a * (o.length_squared() - radius * radius);

    let side = (root > 0.0).then(|| (-b - root.sqrt()) / a);
    let side = side.map(|t| (t, (origin + direction * t).with_z(0.0) / radius));
    let side = side.filter(|(t, _)| (low..=high).contains(&(origin.z + direction.z * t)));

    let top = (high - origin.z) / direction.z;
    let top = (direction.z < 0.0).then_some((top, Vec3::Z));
    let top = top.filter(|(t, _)| (o + d * *t).length_squared() <= radius * radius);

    let hits = side.into_iter().chain(top).filter(|(t, _)| *t > 0.0);
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    #[test]
    fn a_person_is_met_at_the_side_and_from_above() {
        let at = vec3(4.0, 1.0, 0.5);
        let walker = Walker { numbers: 3..4, from: at - Vec3::Y, to: at + Vec3::Y, height_m: 2.0 };
        let person = Disturbances { walker: Some(walker), ..Disturbances::default() };
        assert!(person.during(3) == person && person.during(4) == Disturbances::default());

        // Half-way, the body of radius 0.28 is at (4, 1).
        let (t, n) = person.walker(vec3(0.0, 1.0, 1.5), Vec3::X, 9.0, 0.5).unwrap();
        assert!((t - 3.72).abs() < 1e-5 && n.abs_diff_eq(Vec3::NEG_X, 1e-5));
        assert_eq!(person.walker(vec3(0.0, 1.0, 1.5), Vec3::X, 9.0, 0.0), None);
        assert_eq!(person.walker(vec3(0.0, 1.0, 1.5), Vec3::X, 3.0, 0.5), None);
        // The head's top is 2 m above the feet.
        let (t, n) = person.walker(vec3(4.0, 1.0, 4.0), Vec3::NEG_Z, 9.0, 0.5).unwrap();
        assert!((t - 1.5).abs() < 1e-5 && n == Vec3::Z);
        assert_eq!(person.walker(vec3(0.0, 1.0, 2.6), Vec3::X, 9.0, 0.5), None);
    }

    #[test]
    fn a_mirror_ends_at_its_edges() {
        let half = [vec3(0.0, 0.5, 0.0), vec3(0.0, 0.0, 0.8)];
        let mirror =
            Disturbances { mirrors: vec![Mirror { middle: vec3(2.0, 0.0, 1.0), half }], walker: None };
        let meets = |y, z| mirror.mirror(vec3(0.0, y, z), Vec3::X, 9.0).is_some();
        assert!(meets(0.45, 1.0) && meets(-0.45, 1.75));
        assert!(!meets(0.55, 1.0) && !meets(0.0, 1.85));
        assert_eq!(mirror.mirror(Vec3::Z, Vec3::X, 1.9), None);
    }
}
