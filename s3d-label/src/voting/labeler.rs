//! Labels the faces of a mesh from labelled points.

use super::corners::Corners;
use crate::{FaceLabels, LabelId, MAX_LABELS, VoteOptions, Votes};
use s3d_geom::glam::Vec3;
use s3d_geom::{Nearest, NearestFaces, TriMesh};
use thiserror::Error;

/// The number of points whose nearest faces are in memory at once. They take 20 MB.
const CHUNK_POINTS: usize = 1 << 20;

/// The reason why points cannot vote.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum VoteError {
    /// A point is NaN or infinite, so it has no nearest face.
    #[error("point {point} is not finite: {position}")]
    NonFinite {
        /// The index of the point in the block, from 0.
        point: usize,
        /// The position of the point, in world metres.
        position: Vec3,
    },
    /// A point belongs to a face that is not in the mesh.
    #[error("a point is of face {face}; the mesh has {face_count}")]
    NoSuchFace {
        /// The index of the face, from 0.
        face: u32,
        /// The number of faces of the mesh.
        face_count: usize,
    },
    /// There is not one label per point.
    #[error("{labels} labels for {points} points")]
    Length {
        /// The number of points.
        points: usize,
        /// The number of labels.
        labels: usize,
    },
    /// A label is not in the table, or larger than any table can have ([`MAX_LABELS`]).
    #[error("label {label} of a table of {labels}")]
    NoSuchLabel {
        /// The label.
        label: LabelId,
        /// The number of labels, with the null label.
        labels: usize,
    },
}

/// Labels the faces of a mesh by votes of labelled points, block by block.
///
/// Each point votes for its nearest face, and a face takes the label with the most votes. Blocks have any
/// size and come in any order, and the points of an instance may be in any number of blocks. The result is
/// the same, for any number of threads. If a block is refused, none of its points votes. Points with the
/// label [`LabelId::NULL`] do not vote and are only counted.
///
/// Only the vote of a point is kept, so a scan of any size needs little memory: see [`Votes`], and 20 bytes
/// for each point of a block, at most 20 MB. Nearest faces are looked up on all threads of the current rayon
/// pool. Votes are counted on the calling thread. Source: `s3d_io::formats`, "What is written": voting.
///
/// ```
/// use s3d_geom::{NearestFaces, TriMesh, glam::{Vec3, vec3}};
/// use s3d_label::{LabelId, Labeler};
///
/// // Two triangles of a unit square, and two blocks of points around the first.
/// let corners = vec![Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y];
/// let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2], [0, 2, 3]])?;
/// let nearest_faces = NearestFaces::new(&mesh);
/// let floor = LabelId(2);
/// let chair = LabelId(1);
/// let mut labeler = Labeler::new(&nearest_faces);
/// labeler.add_points(&[vec3(0.8, 0.2, 0.01), vec3(0.9, 0.5, 0.03)], floor)?;
/// labeler.add_points(&[vec3(0.7, 0.1, 0.2)], chair)?;
/// let labels = labeler.finish();
///
/// assert_eq!(labels.label_of_face(), [floor, LabelId::NULL]);
/// let face = labels.votes_of(0).unwrap();
/// assert_eq!((face.votes, face.runner_up, face.margin()), (2, chair, 1));
/// assert!((face.mean_m - 0.08).abs() < 1e-6 && face.farthest_m == 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone)]
pub struct Labeler<'m> {
    nearest_faces: &'m NearestFaces<'m>,
    votes: Votes,
    /// Made when the first vertices are added.
    corners: Option<Corners>,
    /// The nearest faces of a chunk of points; kept for its memory.
    nearest: Vec<Nearest>,
    /// The vertices of a chunk that are not at a corner; kept for its memory.
    others: Vec<Vec3>,
    /// Where these vertices are in their block; kept for its memory.
    places: Vec<usize>,
    watch: Watch,
}

/// A point that is far from every face of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stray {
    /// Its index in its block.
    pub point: usize,
    /// Its distance to the nearest face, metres.
    pub distance_m: f32,
}

/// What is noted of points that are far from the mesh.
#[derive(Clone, Debug)]
struct Watch {
    beyond_m: f32,
    /// Whether these points vote.
    vote: bool,
    found: Vec<Stray>,
}

impl Watch {
    /// Notes a point if it is far, and returns whether it votes.
    fn lets_vote(&mut self, point: usize, distance_m: f32) -> bool {
        let is_stray = distance_m > self.beyond_m;
        if is_stray {
            self.found.push(Stray { point, distance_m });
        }
        self.vote || !is_stray
    }
}

impl<'m> Labeler<'m> {
    /// Starts without votes, for the mesh of `nearest_faces`.
    pub fn new(nearest_faces: &'m NearestFaces<'m>) -> Self {
        Self::with_options(nearest_faces, VoteOptions::default())
    }

    /// Starts without votes, for the mesh of `nearest_faces`, with these options.
    ///
    /// # Panics
    /// If `far_m` is NaN.
    pub fn with_options(nearest_faces: &'m NearestFaces<'m>, options: VoteOptions) -> Self {
        let votes = Votes::with_options(nearest_faces.mesh().faces().len(), options);
        Self {
            nearest_faces,
            votes,
            corners: None,
            nearest: Vec::new(),
            others: Vec::new(),
            places: Vec::new(),
            watch: Watch { beyond_m: f32::INFINITY, vote: true, found: Vec::new() },
        }
    }

    /// Notes from now on which points of [`add_points`](Self::add_points) and
    /// [`add_vertices`](Self::add_vertices) are farther than `beyond_m` metres from every face. They vote
    /// only if `vote`, and otherwise count nowhere. [`take_strays`](Self::take_strays) returns them.
    ///
    /// ```
    /// use s3d_geom::{NearestFaces, TriMesh, glam::{Vec3, vec3}};
    /// use s3d_label::{LabelId, Labeler};
    ///
    /// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
    /// let nearest_faces = NearestFaces::new(&mesh);
    /// let mut labeler = Labeler::new(&nearest_faces);
    /// labeler.watch_strays(1.0, false);
    /// labeler.add_points(&[Vec3::ZERO, vec3(0.0, 0.0, 40.0)], LabelId(1))?;
    /// let strays = labeler.take_strays();
    /// assert_eq!((strays.len(), strays[0].point, strays[0].distance_m), (1, 1, 40.0));
    /// assert_eq!(labeler.finish().votes_of(0).unwrap().votes, 1);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn watch_strays(&mut self, beyond_m: f32, vote: bool) {
        self.watch = Watch { beyond_m, vote, found: Vec::new() };
    }

    /// Returns the points far from the mesh that were added since the last call, in their order.
    pub fn take_strays(&mut self) -> Vec<Stray> {
        std::mem::take(&mut self.watch.found)
    }

    /// Adds points (world metres) with the same label, such as the points of an instance. Each votes for its
    /// nearest face.
    ///
    /// # Errors
    /// [`VoteError::NonFinite`] and [`VoteError::NoSuchLabel`].
    pub fn add_points(&mut self, points: &[Vec3], label: LabelId) -> Result<(), VoteError> {
        check_points(points)?;
        check_label(label)?;
        for (start, points) in (0..).step_by(CHUNK_POINTS).zip(points.chunks(CHUNK_POINTS)) {
            self.nearest_faces.nearest_many(points, &mut self.nearest);
            for (point, n) in (start..).zip(&self.nearest) {
                if self.watch.lets_vote(point, n.distance_m) {
                    self.votes.add(n.face, label, n.distance_m);
                }
            }
        }
        Ok(())
    }

    /// Adds points (world metres) with a label each. Each votes for its nearest face.
    ///
    /// # Errors
    /// [`VoteError::Length`], [`VoteError::NonFinite`] and [`VoteError::NoSuchLabel`].
    pub fn add_labelled_points(
        &mut self,
        points: &[Vec3],
        label_of_point: &[LabelId],
    ) -> Result<(), VoteError> {
        if points.len() != label_of_point.len() {
            return Err(VoteError::Length { points: points.len(), labels: label_of_point.len() });
        }
        check_points(points)?;
        label_of_point.iter().try_for_each(|label| check_label(*label))?;
        for (points, labels) in points.chunks(CHUNK_POINTS).zip(label_of_point.chunks(CHUNK_POINTS)) {
            self.nearest_faces.nearest_many(points, &mut self.nearest);
            for (nearest, label) in self.nearest.iter().zip(labels) {
                self.votes.add(nearest.face, *label, nearest.distance_m);
            }
        }
        Ok(())
    }

    /// Adds annotated vertices of the mesh itself (world metres), with the same label. Each votes for every
    /// face that has a corner at exactly that place. All these faces are equally near; a vote for the
    /// smallest index alone would leave the others without one. A point that is not at a corner votes for its
    /// nearest face.
    ///
    /// # Errors
    /// [`VoteError::NonFinite`] and [`VoteError::NoSuchLabel`].
    pub fn add_vertices(&mut self, vertices: &[Vec3], label: LabelId) -> Result<(), VoteError> {
        check_points(vertices)?;
        check_label(label)?;

        let corners = self
            .corners
            .get_or_insert_with(|| Corners::new(self.nearest_faces.mesh()));
        for (start, vertices) in (0..).step_by(CHUNK_POINTS).zip(vertices.chunks(CHUNK_POINTS)) {
            self.others.clear();
            self.places.clear();
            for (place, vertex) in (start..).zip(vertices) {
                let mut is_corner = false;
                for face in corners.faces_at(*vertex) {
                    self.votes.add(face, label, 0.0);
                    is_corner = true;
                }
                if !is_corner {
                    self.others.push(*vertex);
                    self.places.push(place);
                }
            }

            self.nearest_faces.nearest_many(&self.others, &mut self.nearest);
            for (place, n) in self.places.iter().zip(&self.nearest) {
                if self.watch.lets_vote(*place, n.distance_m) {
                    self.votes.add(n.face, label, n.distance_m);
                }
            }
        }
        Ok(())
    }

    /// Adds points with the same label whose faces are known, such as the labels of the mesh itself. Each
    /// votes for its face, at a distance of 0.
    ///
    /// # Errors
    /// [`VoteError::NoSuchFace`] and [`VoteError::NoSuchLabel`].
    pub fn add_points_on_faces(&mut self, face_of_point: &[u32], label: LabelId) -> Result<(), VoteError> {
        check_label(label)?;
        let face_count = self.votes.face_count();
        if let Some(&face) = face_of_point.iter().find(|face| **face as usize >= face_count) {
            return Err(VoteError::NoSuchFace { face, face_count });
        }
        face_of_point.iter().for_each(|face| self.votes.add(*face, label, 0.0));
        Ok(())
    }

    /// Returns the votes so far.
    pub fn votes(&self) -> &Votes {
        &self.votes
    }

    /// Returns the labels of all faces, from the votes so far.
    pub fn finish(self) -> FaceLabels {
        FaceLabels::new(self.votes)
    }
}

/// Labels the faces of `mesh` by the votes of `points` (world metres), which have a label each.
///
/// # Errors
/// [`VoteError::Length`], [`VoteError::NonFinite`] and [`VoteError::NoSuchLabel`].
///
/// ```
/// use s3d_geom::{TriMesh, glam::{Vec3, vec3}};
/// use s3d_label::{LabelId, vote};
///
/// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let points = [vec3(0.1, 0.1, 0.02), vec3(0.2, 0.3, -0.01), vec3(0.3, 0.3, 0.0)];
/// let labels = vote(&mesh, &points, &[7, 7, 4].map(LabelId))?;
/// assert_eq!(labels.label_of_face(), [LabelId(7)]);
/// assert_eq!(labels.votes_of(0).unwrap().margin(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn vote(mesh: &TriMesh, points: &[Vec3], label_of_point: &[LabelId]) -> Result<FaceLabels, VoteError> {
    let nearest_faces = NearestFaces::new(mesh);
    let mut labeler = Labeler::new(&nearest_faces);
    labeler.add_labelled_points(points, label_of_point)?;
    Ok(labeler.finish())
}

fn check_points(points: &[Vec3]) -> Result<(), VoteError> {
    match points.iter().position(|p| !p.is_finite()) {
        Some(point) => {
            let position = points.get(point).copied().unwrap_or_default();
            Err(VoteError::NonFinite { point, position })
        }
        None => Ok(()),
    }
}

/// Refuses a label that no table can have. It would take memory for all labels before it.
fn check_label(label: LabelId) -> Result<(), VoteError> {
    if label.index() < MAX_LABELS {
        Ok(())
    } else {
        Err(VoteError::NoSuchLabel { label, labels: MAX_LABELS })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FaceVotes;
    use proptest::prelude::*;
    use s3d_geom::glam::vec3;
    use s3d_geom::nearest_brute_force;
    use std::collections::BTreeMap;

    fn place((x, y, z): (i8, i8, i8)) -> Vec3 {
        vec3(f32::from(x), f32::from(y), f32::from(z))
    }

    fn any_corner() -> impl Strategy<Value = (i8, i8, i8)> {
        (0..4i8, 0..4i8, 0..3i8)
    }

    /// Makes triangles on a coarse lattice, so that they share corners and edges, and points are equally near
    /// to several faces.
    fn any_mesh() -> impl Strategy<Value = TriMesh> {
        prop::collection::vec([any_corner(), any_corner(), any_corner()], 1..25).prop_filter_map(
            "no area",
            |triangles| {
                let positions: Vec<Vec3> = triangles.into_iter().flatten().map(place).collect();
                let faces = (0..positions.len() as u32 / 3)
                    .map(|f| [3 * f, 3 * f + 1, 3 * f + 2])
                    .collect();
                TriMesh::from_faces(positions, faces).ok()
            },
        )
    }

    /// Makes points, some of them on the lattice, with a label each.
    fn any_points() -> impl Strategy<Value = Vec<(Vec3, LabelId)>> {
        let any = (-1.0..5.0f32, -1.0..5.0f32, -1.0..4.0f32).prop_map(Vec3::from);
        let lattice = (0..5i8, 0..5i8, 0..4i8).prop_map(|(x, y, z)| vec3(x.into(), y.into(), z.into()));
        prop::collection::vec((prop_oneof![any, lattice], (0..5u32).prop_map(LabelId)), 0..80)
    }

    /// The plain reference: measures all faces for each point, and reads all points for each face.
    fn recount(mesh: &TriMesh, points: &[(Vec3, LabelId)]) -> Vec<Option<FaceVotes>> {
        let voters: Vec<(LabelId, u32, f32)> = points
            .iter()
            .filter(|(_, label)| !label.is_null())
            .map(|(point, label)| (*label, nearest_brute_force(mesh, *point)))
            .map(|(label, nearest)| (label, nearest.face, nearest.distance_m))
            .collect();

        let of_face = |face: u32| {
            let here: Vec<_> = voters.iter().filter(|(_, f, _)| *f == face).collect();
            let mut counts: BTreeMap<LabelId, u64> = BTreeMap::new();
            here.iter()
                .for_each(|(label, ..)| *counts.entry(*label).or_default() += 1);
            let mut ranking: Vec<(LabelId, u64)> = counts.into_iter().collect();
            // The sort is stable: labels with equally many votes stay in order.
            ranking.sort_by_key(|(_, votes)| std::cmp::Reverse(*votes));

            let (label, votes) = *ranking.first()?;
            let (runner_up, runner_up_votes) = ranking.get(1).copied().unwrap_or_default();
            let sum_m: f64 = here.iter().map(|(.., distance_m)| f64::from(*distance_m)).sum();
            Some(FaceVotes {
                label,
                votes,
                runner_up,
                runner_up_votes,
                total: here.len() as u64,
                farthest_m: here.iter().map(|(.., distance_m)| *distance_m).fold(0.0, f32::max),
                mean_m: (sum_m / here.len() as f64) as f32,
            })
        };
        (0..mesh.faces().len() as u32).map(of_face).collect()
    }

    fn votes_of_faces(labels: &FaceLabels) -> Vec<Option<FaceVotes>> {
        (0..labels.len() as u32).map(|face| labels.votes_of(face)).collect()
    }

    fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(work)
    }

    fn mean_m(of_face: &Option<FaceVotes>) -> f32 {
        of_face.map_or(0.0, |f| f.mean_m)
    }

    fn rounded(of_face: &Option<FaceVotes>) -> Option<FaceVotes> {
        of_face.map(|f| FaceVotes { mean_m: 0.0, ..f })
    }

    proptest! {
        #[test]
        fn labels_are_those_of_a_recount(mesh in any_mesh(), points in any_points()) {
            let (positions, labels): (Vec<Vec3>, Vec<LabelId>) = points.iter().copied().unzip();
            let found = vote(&mesh, &positions, &labels).unwrap();
            let expected = recount(&mesh, &points);
            prop_assert_eq!(
                votes_of_faces(&found).iter().map(rounded).collect::<Vec<_>>(),
                expected.iter().map(rounded).collect::<Vec<_>>()
            );
            for (found, expected) in votes_of_faces(&found).iter().zip(&expected) {
                prop_assert!((mean_m(found) - mean_m(expected)).abs() < 1e-6);
            }
            let of_face = expected.iter().map(|f| f.map_or(LabelId::NULL, |f| f.label));
            prop_assert_eq!(found.label_of_face(), of_face.collect::<Vec<_>>());
            let null = labels.iter().filter(|label| label.is_null()).count() as u64;
            prop_assert_eq!(found.votes().unlabeled_points(), null);
        }

        #[test]
        fn blocks_their_order_and_threads_do_not_matter(
            mesh in any_mesh(),
            points in any_points(),
            cuts in prop::collection::vec(0usize..80, 0..6),
            threads in 1usize..5,
        ) {
            let (positions, labels): (Vec<Vec3>, Vec<LabelId>) = points.iter().copied().unzip();
            let whole = vote(&mesh, &positions, &labels).unwrap();
            let nearest_faces = NearestFaces::new(&mesh);
            let mut cuts: Vec<usize> = cuts.into_iter().map(|cut| cut.min(points.len())).collect();
            cuts.extend([0, points.len()]);
            cuts.sort_unstable();

            let mut labeler = Labeler::new(&nearest_faces);
            let in_pieces = on_threads(threads, || {
                // Blocks come from the last to the first. Every other block comes label by label.
                for (i, cut) in cuts.windows(2).rev().enumerate() {
                    let block = cut[0]..cut[1];
                    if i % 2 == 0 {
                        labeler.add_labelled_points(&positions[block.clone()], &labels[block]).unwrap();
                        continue;
                    }
                    for label in (0..5).map(LabelId) {
                        let of_label = points[block.clone()].iter().filter(|(_, l)| *l == label);
                        labeler.add_points(&of_label.map(|(p, _)| *p).collect::<Vec<_>>(), label).unwrap();
                    }
                }
                labeler.finish()
            });

            prop_assert_eq!(in_pieces.label_of_face(), whole.label_of_face());
            prop_assert_eq!(votes_of_faces(&in_pieces), votes_of_faces(&whole));
            for label in (0..5).map(LabelId) {
                prop_assert_eq!(in_pieces.votes().points_of(label), whole.votes().points_of(label));
            }
            prop_assert_eq!(in_pieces.votes().unlabeled_points(), whole.votes().unlabeled_points());
        }

        #[test]
        fn vertices_vote_for_all_faces_around_them(mesh in any_mesh(), points in any_points()) {
            let nearest_faces = NearestFaces::new(&mesh);
            let mut labeler = Labeler::new(&nearest_faces);
            for (point, label) in &points {
                labeler.add_vertices(&[*point], *label).unwrap();
            }
            let mut expected = Votes::new(mesh.faces().len());
            for (point, label) in &points {
                let faces = 0..mesh.faces().len() as u32;
                let around: Vec<u32> = faces.filter(|face| mesh.triangle(*face).contains(point)).collect();
                around.iter().for_each(|face| expected.add(*face, *label, 0.0));
                if around.is_empty() {
                    let nearest = nearest_brute_force(&mesh, *point);
                    expected.add(nearest.face, *label, nearest.distance_m);
                }
            }
            for face in 0..mesh.faces().len() as u32 {
                prop_assert_eq!(labeler.votes().votes_of(face), expected.votes_of(face));
                prop_assert_eq!(labeler.votes().of_face(face), expected.of_face(face));
            }
        }
    }

    #[test]
    fn points_on_faces_vote_for_these() {
        let mesh = TriMesh::from_faces(
            vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z],
            vec![[0, 1, 2], [0, 1, 3], [0, 2, 3]],
        )
        .unwrap();
        let nearest_faces = NearestFaces::new(&mesh);
        let mut labeler = Labeler::new(&nearest_faces);
        labeler.add_points_on_faces(&[0, 2, 2], LabelId(5)).unwrap();
        labeler.add_points_on_faces(&[2], LabelId(3)).unwrap();
        let labels = labeler.finish();
        assert_eq!(labels.label_of_face(), [5, 0, 5].map(LabelId));
        let face = labels.votes_of(2).unwrap();
        assert_eq!((face.runner_up, face.margin(), face.farthest_m), (LabelId(3), 1, 0.0));
    }

    #[test]
    fn a_block_that_is_refused_has_not_voted() {
        let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let nearest_faces = NearestFaces::new(&mesh);
        let mut labeler = Labeler::new(&nearest_faces);
        let good = Vec3::ONE;
        let bad = vec3(0.0, f32::NAN, 0.0);

        for refused in
            [labeler.add_points(&[good, bad], LabelId(1)), labeler.add_vertices(&[good, bad], LabelId(1))]
        {
            assert!(matches!(refused, Err(VoteError::NonFinite { point: 1, .. })), "{refused:?}");
        }
        assert_eq!(
            labeler.add_labelled_points(&[good, good], &[LabelId(1)]),
            Err(VoteError::Length { points: 2, labels: 1 })
        );

        let huge = LabelId(u32::MAX);
        let no_label = Err(VoteError::NoSuchLabel { label: huge, labels: MAX_LABELS });
        assert_eq!(labeler.add_points(&[good], huge), no_label);
        assert_eq!(labeler.add_vertices(&[good], huge), no_label);
        assert_eq!(labeler.add_points_on_faces(&[0], huge), no_label);
        assert_eq!(labeler.add_labelled_points(&[good, good], &[LabelId(1), huge]), no_label);
        assert_eq!(
            labeler.add_points_on_faces(&[0, 1], LabelId(1)),
            Err(VoteError::NoSuchFace { face: 1, face_count: 1 })
        );
        assert_eq!(labeler.votes().of_face(0), None);
        assert_eq!(labeler.finish().label_of_face(), [LabelId::NULL]);
    }
}
