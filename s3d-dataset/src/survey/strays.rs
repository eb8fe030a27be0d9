//! Annotated points that are far from every face of the mesh.

use s3d_geom::Aabb;
use s3d_geom::glam::{DVec3, Vec3};
use s3d_label::{Label, Stray};
use std::borrow::Cow;

/// The distance beyond which a point is a stray if no other is asked for, in metres. Points in front of a
/// mesh's holes, such as windows, are nearer.
pub(crate) const STRAY_M: f64 = 1.0;

/// The most instances that get a sentence.
const TOLD: usize = 5;

/// The strays of an area.
#[derive(Debug, Default)]
pub(crate) struct Strays {
    /// Whether they were left out.
    pub(crate) left_out: bool,
    /// The instances that have strays which count: all, if they were left out, and otherwise those whose box
    /// is larger for them.
    pub(crate) instances: Vec<InstanceStrays>,
}

impl Strays {
    /// Returns a sentence for each of the first instances, and one for the others.
    pub(crate) fn sentences(&self) -> Vec<String> {
        let first = self.instances.iter().take(TOLD);
        let mut told: Vec<String> = first.map(|instance| instance.sentence(self.left_out)).collect();
        if self.instances.len() > TOLD {
            let others = self.instances.len() - TOLD;
            told.push(format!("{others} further instances have points that far from the mesh"));
        }
        told
    }
}

/// The strays of an instance, found block by block.
#[derive(Debug)]
pub(crate) struct InstanceStrays {
    /// Its label, and the source of its points.
    name: [String; 2],
    /// The number of its points.
    points: u64,
    /// Which of its points are strays, from 0, ascending.
    places: Vec<u64>,
    farthest_m: f32,
    /// The first stray, in the coordinates of its file.
    first: DVec3,
    /// The box of all points, and of those that are not strays.
    boxes: [Aabb; 2],
}

impl InstanceStrays {
    pub(crate) fn new(label: Label, source: String) -> Self {
        Self {
            name: [label.to_string(), source],
            points: 0,
            places: Vec::new(),
            farthest_m: 0.0,
            first: DVec3::ZERO,
            boxes: [Aabb::EMPTY; 2],
        }
    }

    /// Takes the next points and those of them that are strays. Returns the others.
    pub(crate) fn take<'a>(&mut self, positions: &'a [Vec3], strays: &[Stray]) -> Cow<'a, [Vec3]> {
        for stray in strays {
            if let Some(at) = positions.get(stray.point).filter(|_| self.places.is_empty()) {
                self.first = at.as_dvec3();
            }
            self.places.push(self.points + stray.point as u64);
            self.farthest_m = self.farthest_m.max(stray.distance_m);
        }
        self.points += positions.len() as u64;

        let mut strays = strays.iter().peekable();
        let kept = match strays.peek() {
            None => Cow::Borrowed(positions),
            Some(_) => positions
                .iter()
                .enumerate()
                .filter(|(at, _)| strays.next_if(|stray| stray.point == *at).is_none())
                .map(|(_, position)| *position)
                .collect(),
        };
        for (of, points) in self.boxes.iter_mut().zip([positions, &kept]) {
            *of = of.union(Aabb::from_points(points.iter().copied()));
        }
        kept
    }

    /// Which of its points are strays, from 0, ascending.
    pub(crate) fn places(&self) -> &[u64] {
        &self.places
    }

    /// Whether its box is larger for its strays.
    pub(crate) fn enlarge(&self) -> bool {
        let [whole, near] = &self.boxes;
        !self.places.is_empty() && whole != near
    }

    /// The same, with an offset that was subtracted from the coordinates of the file.
    pub(crate) fn in_file(self, offset_m: Option<[f64; 3]>) -> Self {
        Self { first: self.first + DVec3::from(offset_m.unwrap_or_default()), ..self }
    }

    fn sentence(&self, left_out: bool) -> String {
        let [label, source] = &self.name;
        let count = self.places.len();
        let [are, them] = if count == 1 {
            ["is", "it"]
        } else {
            ["are up to", "them"]
        };
        let which = if count == 1 {
            "it is number"
        } else {
            "the first is number"
        };
        let number = self.places.first().map_or(0, |place| place + 1);
        let DVec3 { x, y, z } = self.first;
        let seen = format!(
            "{label}: {count} of {} annotated points {are} {:.1} m from the mesh ({which} {number} of \
             {source}, at {x:.2}, {y:.2}, {z:.2})",
            self.points, self.farthest_m
        );
        if left_out {
            return format!("{seen}, and left out");
        }

        let [whole, near] = self.boxes.map(|of| of.size().max_element());
        let of_box = if self.boxes[1].is_empty() {
            String::new()
        } else {
            format!(", so that its box is {whole:.1} m long instead of {near:.1}")
        };
        format!("{seen}{of_box}: remove {them}, or leave {them} out (the option `trim_strays`)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    #[test]
    fn strays_are_found_block_by_block() {
        let label: Label = "chair_1_office_1_1".parse().unwrap();
        let mut found = InstanceStrays::new(label, "chair_1.txt".to_owned());
        let near = [Vec3::ZERO, vec3(0.5, 0.5, 0.25)];
        assert!(matches!(found.take(&near, &[]), Cow::Borrowed(all) if all == near));
        assert!(!found.enlarge());
        let block = [vec3(100.0, 0.0, 0.0), Vec3::ONE, vec3(0.0, 900.0, 0.0)];
        let strays = [(0, 99.0), (2, 899.0)].map(|(point, distance_m)| Stray { point, distance_m });
        assert_eq!(*found.take(&block, &strays), [Vec3::ONE]);
        assert_eq!(found.places(), [2, 4]);
        assert!(found.enlarge());

        let mut strays = Strays { left_out: false, instances: vec![found.in_file(Some([1.0, 2.0, 3.0]))] };
        let told = "chair_1_office_1_1: 2 of 5 annotated points are up to 899.0 m from the mesh (the first \
                    is number 3 of chair_1.txt, at 101.00, 2.00, 3.00)";
        let [sentence] = &strays.sentences()[..] else { panic!() };
        assert_eq!(
            *sentence,
            format!(
                "{told}, so that its box is 900.0 m long instead of 1.0: remove them, or leave them out \
                     (the option `trim_strays`)"
            )
        );
        strays.left_out = true;
        assert_eq!(strays.sentences(), [format!("{told}, and left out")]);
    }

    #[test]
    fn few_instances_are_told_and_the_others_counted() {
        let stray = |number| {
            let label = format!("chair_{number}_office_1_1").parse().unwrap();
            let mut found = InstanceStrays::new(label, "chairs.txt".to_owned());
            found.take(&[Vec3::ONE], &[Stray { point: 0, distance_m: 7.0 }]);
            assert!(found.enlarge());
            found
        };
        let strays = Strays { left_out: false, instances: (1..=7).map(stray).collect() };
        let told = strays.sentences();
        assert_eq!(told.len(), TOLD + 1);
        assert!(
            told[0].contains("1 of 1 annotated points is 7.0 m from the mesh (it is number 1"),
            "{told:?}"
        );
        assert!(
            told[0].ends_with("1.00): remove it, or leave it out (the option `trim_strays`)"),
            "{told:?}"
        );
        assert!(told[TOLD].starts_with("2 further instances"), "{told:?}");
    }
}
