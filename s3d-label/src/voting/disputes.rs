//! Surfaces whose labels are disputed.

use crate::{Class, FaceLabels, FaceVotes, LabelId, LabelTable};
use s3d_geom::glam::DVec3;
use s3d_geom::{Aabb, TriMesh, face_patches};
use std::collections::BTreeMap;

/// A face is disputed if its label has less than this share of the votes.
const CLEAR: f64 = 0.75;

/// Two classes that share the votes of faces.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct ClassDispute {
    /// The two classes, in the order of the taxonomy. Two instances of a class give the same class twice.
    pub classes: [Class; 2],
    /// The number of disputed faces.
    pub faces: u64,
    /// The area of these faces, in m².
    pub area_m2: f64,
}

/// Disputed faces with the same two labels that are connected by their corners.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct DisputedPatch {
    /// The two labels. The first won more of the surface.
    pub labels: [LabelId; 2],
    /// The number of faces.
    pub faces: u64,
    /// The area, in m².
    pub area_m2: f64,
    /// The centroid, in the frame of the mesh.
    pub center: DVec3,
    /// The box around the patch.
    pub bbox: Aabb,
}

/// The disputed surfaces of a mesh, by classes and by places.
///
/// ```
/// use s3d_geom::{TriMesh, glam::Vec3};
/// use s3d_label::{Disputes, FaceLabels, LabelId, LabelTable, Votes};
///
/// let mesh =
///     TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ONE], vec![[0, 1, 2], [1, 3, 2]])?;
/// let table = LabelTable::from_labels(["chair_1_office_1_1".parse()?, "wall_1_office_1_1".parse()?])?;
/// let mut votes = Votes::new(2);
/// for (face, label, times) in [(0, 1, 2), (0, 2, 1), (1, 2, 9)] {
///     (0..times).for_each(|_| votes.add(face, LabelId(label), 0.001));
/// }
/// let disputes = Disputes::of(&mesh, &FaceLabels::new(votes), &table);
/// assert_eq!((disputes.classes.len(), disputes.patches[0].labels), (1, [1, 2].map(LabelId)));
/// assert_eq!((disputes.patches[0].faces, disputes.patches[0].area_m2), (1, 0.5));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct Disputes {
    /// The pairs of classes, the largest area first.
    pub classes: Vec<ClassDispute>,
    /// The connected patches, the largest area first.
    pub patches: Vec<DisputedPatch>,
}

/// A disputed face.
struct Disputed {
    face: u32,
    winner: LabelId,
    /// The winner and the runner-up, the smaller first.
    pair: [LabelId; 2],
    area_m2: f64,
}

impl Disputes {
    /// Finds the faces whose label has less than three quarters of the votes. Faces without a vote do not
    /// count. Corners are the same if their coordinates are equal.
    ///
    /// # Panics
    /// If the labels belong to a mesh with more faces.
    pub fn of(mesh: &TriMesh, labels: &FaceLabels, table: &LabelTable) -> Self {
        Self::of_faces(mesh, labels.iter(), table)
    }

    /// Does the same from the results of all faces in order.
    ///
    /// # Panics
    /// Like [`Disputes::of`].
    pub fn of_faces(
        mesh: &TriMesh,
        votes: impl IntoIterator<Item = Option<FaceVotes>>,
        table: &LabelTable,
    ) -> Self {
        let faces = (0u32..).zip(votes);
        let disputed: Vec<Disputed> = faces
            .filter_map(|(face, votes)| {
                let votes = votes.filter(|votes| votes.share() < CLEAR)?;
                let pair = [votes.label.min(votes.runner_up), votes.label.max(votes.runner_up)];
                Some(Disputed { face, winner: votes.label, pair, area_m2: mesh.area(face) })
            })
            .collect();
        Self { classes: class_disputes(&disputed, table), patches: patches(mesh, &disputed) }
    }
}

fn class_disputes(disputed: &[Disputed], table: &LabelTable) -> Vec<ClassDispute> {
    let mut by_class: BTreeMap<[usize; 2], ClassDispute> = BTreeMap::new();
    for face in disputed {
        let [Some(a), Some(b)] = face.pair.map(|label| table.class_of(label)) else { continue };
        let classes = if a.index() <= b.index() { [a, b] } else { [b, a] };
        let entry = by_class.entry(classes.map(Class::index));
        let row = entry.or_insert(ClassDispute { classes, faces: 0, area_m2: 0.0 });
        row.faces += 1;
        row.area_m2 += face.area_m2;
    }
    let mut rows: Vec<ClassDispute> = by_class.into_values().collect();
    rows.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    rows
}

fn patches(mesh: &TriMesh, disputed: &[Disputed]) -> Vec<DisputedPatch> {
    let faces: Vec<(u32, [LabelId; 2])> = disputed.iter().map(|face| (face.face, face.pair)).collect();
    let members = |places: Vec<usize>| -> Vec<&Disputed> {
        places.into_iter().filter_map(|place| disputed.get(place)).collect()
    };
    let mut patches: Vec<DisputedPatch> = face_patches(mesh, &faces)
        .into_iter()
        .map(|places| patch(mesh, &members(places)))
        .collect();
    patches.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
    patches
}

fn patch(mesh: &TriMesh, faces: &[&Disputed]) -> DisputedPatch {
    let mut area_m2 = 0.0;
    let mut weighted = DVec3::ZERO;
    let mut bbox = Aabb::EMPTY;
    let mut won_m2: BTreeMap<LabelId, f64> = BTreeMap::new();
    for face in faces {
        let corners = mesh.triangle(face.face);
        area_m2 += face.area_m2;
        weighted += face.area_m2 * corners.map(|c| c.as_dvec3()).iter().sum::<DVec3>() / 3.0;
        bbox = bbox.union(Aabb::from_points(corners));
        *won_m2.entry(face.winner).or_default() += face.area_m2;
    }

    let [a, b] = faces.first().map_or([LabelId::NULL; 2], |face| face.pair);
    let won = |label| won_m2.get(&label).copied().unwrap_or(0.0);
    let labels = if won(a) >= won(b) { [a, b] } else { [b, a] };
    DisputedPatch { labels, faces: faces.len() as u64, area_m2, center: weighted / area_m2, bbox }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Votes;
    use s3d_geom::glam::{Vec3, dvec3, vec3};

    /// Returns a strip of squares of 1 m along x, two faces each. Squares do not share vertices.
    fn strip(squares: usize) -> TriMesh {
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        for i in 0..squares {
            let x = i as f32;
            let n = 4 * i as u32;
            positions.extend([vec3(x, 0., 0.), vec3(x + 1., 0., 0.), vec3(x + 1., 1., 0.), vec3(x, 1., 0.)]);
            faces.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
        }
        TriMesh::from_faces(positions, faces).unwrap()
    }

    #[test]
    fn patches_hang_together_by_place_and_labels() {
        let labels = ["chair_1_office_1_1", "chair_2_office_1_1", "wall_1_office_1_1"];
        let table = LabelTable::from_labels(labels.map(|l| l.parse().unwrap())).unwrap();
        let mesh = strip(8);
        let mut votes = Votes::new(16);
        let mut vote = |square: u32, label: u32, times: u32| {
            for _ in 0..times {
                votes.add(2 * square, LabelId(label), 0.0);
                votes.add(2 * square + 1, LabelId(label), 0.0);
            }
        };

        // Chair 1 and the wall dispute squares 0 to 2, of which the wall wins two, and square 6.
        for (square, chair, wall) in [(0, 3, 2), (1, 2, 3), (2, 2, 3), (6, 3, 2)] {
            vote(square, 1, chair);
            vote(square, 3, wall);
        }
        // Two chairs dispute square 3. Squares 4 and 7 are clear. Square 5 has no votes.
        vote(3, 1, 2);
        vote(3, 2, 2);
        vote(4, 3, 4);
        vote(4, 1, 1);
        vote(7, 3, 1);

        let disputes = Disputes::of(&mesh, &FaceLabels::new(votes), &table);
        let classes: Vec<_> = disputes
            .classes
            .iter()
            .map(|d| (d.classes, d.faces, d.area_m2))
            .collect();
        assert_eq!(classes, [([Class::WALL, Class::CHAIR], 8, 4.0), ([Class::CHAIR, Class::CHAIR], 2, 1.0)]);

        let patches: Vec<_> = disputes
            .patches
            .iter()
            .map(|p| (p.labels.map(|l| l.0), p.faces))
            .collect();
        assert_eq!(patches, [([3, 1], 6), ([1, 2], 2), ([1, 3], 2)]);
        let largest = &disputes.patches[0];
        assert!(largest.center.abs_diff_eq(dvec3(1.5, 0.5, 0.0), 1e-12) && largest.area_m2 == 3.0);
        assert_eq!(largest.bbox, Aabb { min: Vec3::ZERO, max: vec3(3.0, 1.0, 0.0) });
        assert_eq!(Disputes::of(&mesh, &FaceLabels::new(Votes::new(16)), &table), Disputes::default());
    }
}
