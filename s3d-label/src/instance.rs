//! Summaries of annotated instances.

use crate::{Class, LabelId, LabelTable, Room};
use glam::Vec3;
use s3d_geom::Aabb;

/// A summary of an annotated instance, without its points.
///
/// ```
/// use s3d_geom::glam::{Vec3, vec3};
/// use s3d_label::{Class, InstanceSummary, LabelId, LabelTable};
///
/// let table = LabelTable::from_labels(["sofa_1_lounge_2_4".parse()?])?;
/// let sofa = InstanceSummary::from_points(&table, LabelId(1), [Vec3::ZERO, vec3(2.0, 0.9, 0.8)]).unwrap();
/// assert_eq!((sofa.class, sofa.points, sofa.bbox), (Class::SOFA, 2, [0.0, 0.0, 0.0, 2.0, 0.9, 0.8]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct InstanceSummary {
    /// The index in the label table.
    pub label: LabelId,
    /// The room of the instance.
    pub room: Room,
    /// The class of the instance.
    pub class: Class,
    /// The number of points, at least 1.
    pub points: u64,
    /// The tightest axis-aligned box around the points, in world metres: `[xmin, ymin, zmin, xmax, ymax,
    /// zmax]`.
    pub bbox: [f32; 6],
}

impl InstanceSummary {
    /// Summarises `points` (world metres) with the label at `id`. Returns `None` if there is no point.
    ///
    /// # Panics
    /// If the table has no label at `id`.
    pub fn from_points(
        table: &LabelTable,
        id: LabelId,
        points: impl IntoIterator<Item = Vec3>,
    ) -> Option<Self> {
        #[expect(clippy::panic, reason = "a caller's mistake: see Panics")]
        let label = table
            .get(id)
            .unwrap_or_else(|| panic!("label {id} of a table of {}", table.len()));

        let mut count = 0;
        let bbox = Aabb::from_points(points.into_iter().inspect(|_| count += 1));
        (count > 0).then(|| Self {
            label: id,
            room: label.room,
            class: label.class,
            points: count,
            bbox: bbox.to_array(),
        })
    }

    /// Joins two summaries of points of the same instance, for a scan that comes in pieces.
    ///
    /// # Panics
    /// If `other` is another instance.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        assert_eq!(self.label, other.label, "two different instances");
        let [a, b, c, d, e, f] = self.bbox;
        let [x, y, z, u, v, w] = other.bbox;
        let bbox = [a.min(x), b.min(y), c.min(z), d.max(u), e.max(v), f.max(w)];
        Self { points: self.points + other.points, bbox, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    fn table() -> LabelTable {
        let names = ["chair_1_office_2_1", "wall_1_WC_1_2"];
        LabelTable::from_labels(names.map(|name| name.parse().unwrap())).unwrap()
    }

    #[test]
    fn a_summary_knows_its_label() {
        let points = [vec3(1.0, 5.0, -1.0), vec3(0.0, 7.0, 2.0)];
        let summary = InstanceSummary::from_points(&table(), LabelId(2), points).unwrap();
        assert_eq!(summary.class, Class::WALL);
        assert_eq!(summary.room, "WC_1".parse().unwrap());
        assert_eq!((summary.points, summary.bbox), (2, [0.0, 5.0, -1.0, 1.0, 7.0, 2.0]));
        assert_eq!(InstanceSummary::from_points(&table(), LabelId(1), []), None);
    }

    #[test]
    #[should_panic(expected = "label 0 of a table of 3")]
    fn the_null_label_has_no_instance() {
        let _ = InstanceSummary::from_points(&table(), LabelId::NULL, [Vec3::ZERO]);
    }

    proptest! {
        #[test]
        fn pieces_sum_to_the_whole(
            points in prop::collection::vec((-9f32..9.0, -9f32..9.0, -9f32..9.0), 2..50),
            cut in 1usize..49,
        ) {
            let points: Vec<Vec3> = points.into_iter().map(Vec3::from).collect();
            let table = table();
            let of =
                |p: &[Vec3]| InstanceSummary::from_points(&table, LabelId(1), p.iter().copied()).unwrap();
            let (front, back) = points.split_at(cut.min(points.len() - 1));
            prop_assert_eq!(of(front).union(of(back)), of(&points));
        }
    }
}
