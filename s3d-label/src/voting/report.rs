//! Statistics of the votes of a scan for the faces of its mesh.

use crate::{Class, FaceVotes, LabelTable, Room, VoteError, Votes};
use std::collections::BTreeMap;

/// A row of a [`VoteReport`]: the votes of one room, one class, or all.
///
/// A point belongs to the room and class of its own label. A face belongs to the room and class of the
/// winner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VoteRow {
    /// The number of points that voted.
    pub points: u64,
    /// The number of these points that are farther than [`VoteOptions::far_m`](crate::VoteOptions::far_m)
    /// from every face.
    pub far_points: u64,
    /// The number of faces with at least one vote.
    pub faces: u64,
    /// The number of votes for these faces, for any label.
    pub face_votes: u64,
    /// The number of faces with votes for more than one label. It includes the faces of the next two columns.
    pub contested: u64,
    /// The number of faces whose winner has less than ¾ of the votes.
    pub contested_below_three_quarters: u64,
    /// The number of faces whose winner has less than ½ of the votes.
    pub contested_below_half: u64,
}

impl VoteRow {
    /// Returns the mean number of votes per face with a vote; 0 if there is none.
    pub fn mean_votes_per_face(&self) -> f64 {
        if self.faces == 0 {
            0.0
        } else {
            self.face_votes as f64 / self.faces as f64
        }
    }

    /// Adds the result of a face to the counts of faces.
    pub fn add_face(&mut self, face: &FaceVotes) {
        self.faces += 1;
        self.face_votes += face.total;

        // With u128, shares are compared without rounding, and no product overflows.
        let winner = u128::from(face.votes);
        let votes = u128::from(face.total);
        self.contested += u64::from(winner < votes);
        self.contested_below_three_quarters += u64::from(4 * winner < 3 * votes);
        self.contested_below_half += u64::from(2 * winner < votes);
    }
}

/// A summary of [`Votes`], by room and by class.
///
/// ```
/// use s3d_label::{Class, LabelId, LabelTable, VoteReport, Votes};
///
/// let table = LabelTable::from_labels(["chair_1_office_1_1".parse()?, "wall_1_office_1_1".parse()?])?;
/// let mut votes = Votes::new(2);
/// votes.add(0, LabelId(2), 0.01);
/// votes.add(0, LabelId(2), 0.07);
/// votes.add(0, LabelId(1), 0.0);
/// let report = VoteReport::new(&votes, &table)?;
/// assert_eq!((report.total.points, report.total.far_points, report.faces_without_vote), (3, 1, 1));
/// // The wall wins the face, with less than three quarters of the votes.
/// let walls = report.classes[Class::WALL.index()].1;
/// assert_eq!((walls.faces, walls.face_votes, walls.contested_below_three_quarters), (1, 3, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct VoteReport {
    /// The distance beyond which a point is far, in metres.
    pub far_m: f32,
    /// The number of faces of the mesh.
    pub face_count: u64,
    /// The number of faces without a vote. They have no label, so they belong to no room and no class.
    pub faces_without_vote: u64,
    /// The number of points without a label, which did not vote.
    pub unlabeled_points: u64,
    /// All rooms together.
    pub total: VoteRow,
    /// All rooms of the table with their areas, sorted by area and room.
    pub rooms: Vec<(u32, Room, VoteRow)>,
    /// All classes, each at its [`Class::index`].
    #[cfg_attr(feature = "serde", serde(deserialize_with = "as_data::classes"))]
    pub classes: Vec<(Class, VoteRow)>,
}

impl VoteReport {
    /// Sums up `votes` for labels of `table`.
    ///
    /// # Errors
    /// [`VoteError::NoSuchLabel`] if there are votes for a label that is not in the table.
    #[expect(clippy::indexing_slicing, reason = "there is a row for each class")]
    pub fn new(votes: &Votes, table: &LabelTable) -> Result<Self, VoteError> {
        let no_such_label = |label| VoteError::NoSuchLabel { label, labels: table.len() };
        let largest = votes.largest_label();
        if largest.index() >= table.len() {
            return Err(no_such_label(largest));
        }

        let mut total = VoteRow::default();
        let mut rooms: BTreeMap<(u32, Room), VoteRow> = BTreeMap::new();
        let mut classes: Vec<(Class, VoteRow)> = table
            .taxonomy()
            .classes()
            .iter()
            .map(|class| (*class, VoteRow::default()))
            .collect();

        for (id, label) in table.iter() {
            let tally = votes.points_of(id);
            let room = rooms.entry((label.area, label.room)).or_default();
            for row in [&mut total, room, &mut classes[label.class.index()].1] {
                row.points += tally.points;
                row.far_points += tally.far;
            }
        }

        let mut faces_without_vote = 0;
        for face in 0..votes.face_count() as u32 {
            let Some(of_face) = votes.of_face(face) else {
                faces_without_vote += 1;
                continue;
            };
            let label = table.get(of_face.label).ok_or_else(|| no_such_label(of_face.label))?;
            let room = rooms.entry((label.area, label.room)).or_default();
            for row in [&mut total, room, &mut classes[label.class.index()].1] {
                row.add_face(&of_face);
            }
        }

        Ok(Self {
            far_m: votes.options().far_m,
            face_count: votes.face_count() as u64,
            faces_without_vote,
            unlabeled_points: votes.unlabeled_points(),
            total,
            rooms: rooms.into_iter().map(|((area, room), row)| (area, room, row)).collect(),
            classes,
        })
    }
}

#[cfg(feature = "serde")]
mod as_data {
    use super::{Class, VoteRow};
    use serde::{Deserialize, Deserializer, de::Error};

    pub(super) fn classes<'de, D: Deserializer<'de>>(
        deserializer: D,
    ) -> Result<Vec<(Class, VoteRow)>, D::Error> {
        let rows = Vec::<(Class, VoteRow)>::deserialize(deserializer)?;
        if rows
            .iter()
            .map(|(class, _)| class)
            .eq(crate::serde_names::taxonomy().classes())
        {
            Ok(rows)
        } else {
            Err(D::Error::custom("the classes of a report are not in their order"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LabelId;
    use proptest::prelude::*;

    fn table() -> LabelTable {
        // Label 1 is a chair of office_2, 2 a chair of office_1, 3 a table of office_1, 4 a wall of WC_1 in
        // area 2.
        let names = ["chair_1_office_2_1", "chair_2_office_1_1", "table_1_office_1_1", "wall_1_WC_1_2"];
        LabelTable::from_labels(names.map(|name| name.parse().unwrap())).unwrap()
    }

    #[test]
    fn rows_hold_what_was_added() {
        let mut votes = Votes::new(7);
        let mut add = |face, label, count, distance_m| {
            for _ in 0..count {
                votes.add(face, LabelId(label), distance_m);
            }
        };
        add(0, 3, 4, 0.01); // all agree
        add(1, 3, 3, 0.01); // exactly three quarters
        add(1, 1, 1, 0.06);
        add(2, 3, 2, 0.01); // exactly half, and the chair has the smaller index
        add(2, 1, 2, 0.01);
        add(3, 1, 2, 0.01); // two fifths
        add(3, 2, 2, 0.01);
        add(3, 3, 1, 0.01);
        add(4, 2, 5, 0.01); // five sevenths
        add(4, 3, 2, 0.2);
        add(5, 0, 9, 0.01); // no label, no vote
        let report = VoteReport::new(&votes, &table()).unwrap();

        assert_eq!((report.face_count, report.faces_without_vote, report.unlabeled_points), (7, 2, 9));
        let total = VoteRow {
            points: 24,
            far_points: 3,
            faces: 5,
            face_votes: 24,
            contested: 4,
            contested_below_three_quarters: 3,
            contested_below_half: 1,
        };
        assert_eq!(report.total, total);
        assert_eq!(report.total.mean_votes_per_face(), 4.8);
        assert_eq!(
            report
                .rooms
                .iter()
                .map(|(area, room, _)| format!("{area} {room}"))
                .collect::<Vec<_>>(),
            ["1 office_1", "1 office_2", "2 WC_1"]
        );

        // Faces 0, 1 (table) and 4 (chair) belong to office_1. The points of its two labels voted for any
        // face.
        let office_1 = VoteRow {
            points: 19,
            far_points: 2,
            faces: 3,
            face_votes: 15,
            contested: 2,
            contested_below_three_quarters: 1,
            contested_below_half: 0,
        };
        assert_eq!(report.rooms[0].2, office_1);
        assert_eq!(report.rooms[2].2, VoteRow::default());
        assert_eq!(report.rooms[2].2.mean_votes_per_face(), 0.0);
        let (class, chairs) = report.classes[Class::CHAIR.index()];
        assert_eq!((class, chairs.points, chairs.far_points, chairs.faces), (Class::CHAIR, 12, 1, 3));
    }

    #[test]
    fn a_vote_for_a_label_outside_the_table_is_refused() {
        let mut votes = Votes::new(1);
        votes.add(0, LabelId(5), 0.0);
        let refused = VoteReport::new(&votes, &table()).unwrap_err();
        assert_eq!(refused.to_string(), "label 5 of a table of 5");
    }

    fn columns(r: &VoteRow) -> [u64; 7] {
        [
            r.points,
            r.far_points,
            r.faces,
            r.face_votes,
            r.contested,
            r.contested_below_three_quarters,
            r.contested_below_half,
        ]
    }

    proptest! {
        #[test]
        fn rooms_and_classes_sum_to_the_total(
            points in prop::collection::vec((0u32..20, 0u32..5, 0f32..0.1), 0..300),
        ) {
            let mut votes = Votes::new(20);
            for &(face, label, distance_m) in &points {
                votes.add(face, LabelId(label), distance_m);
            }
            let report = VoteReport::new(&votes, &table()).unwrap();
            let sum = |rows: Vec<VoteRow>| {
                rows.iter().map(columns).fold([0; 7], |a, b| std::array::from_fn(|i| a[i] + b[i]))
            };
            let total = columns(&report.total);
            prop_assert_eq!(sum(report.rooms.iter().map(|r| r.2).collect()), total);
            prop_assert_eq!(sum(report.classes.iter().map(|r| r.1).collect()), total);
            prop_assert_eq!(report.total.points, report.total.face_votes);
            prop_assert_eq!(report.total.points + report.unlabeled_points, points.len() as u64);
            prop_assert_eq!(report.total.faces + report.faces_without_vote, 20);
            prop_assert!(report.total.contested_below_half <= report.total.contested_below_three_quarters);
            prop_assert!(report.total.contested_below_three_quarters <= report.total.contested);
        }
    }
}
