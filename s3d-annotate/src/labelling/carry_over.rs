//! Carries labels over to another mesh of the same place.

use super::column::NONE;
use super::event::Action;
use super::face_runs::FaceRuns;
use super::state::State;
use s3d_geom::glam::Vec3;
use s3d_geom::{Density, NO_INDEX, Nearest, NearestFaces, PointCloud, SurfaceSampler, TriMesh};
use s3d_label::{FaceLabels, LabelId, Votes};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Surfaces that are farther apart than this are not the same, metres.
const SAME_SURFACE_M: f32 = 0.1;

/// The samples of the old surface: at least as many for a square metre, and for a face of the new mesh, but
/// no more in all.
const SAMPLES_PER_M2: f64 = 2500.0;
const SAMPLES_PER_FACE: f64 = 4.0;
const MOST_SAMPLES: f64 = 3e7;

/// Samples that are drawn at once.
const BLOCK: u64 = 1 << 20;

/// A face is disputed if its label has a smaller share of its votes.
const CLEAR_SHARE: f64 = 2.0 / 3.0;

/// Labels of another mesh, as actions for its new log.
#[derive(Clone, Debug, PartialEq)]
pub struct CarriedOver {
    /// The actions: first the rooms, then an instance each, then the faces that were painted for rooms.
    /// Numbers are those of the old labels.
    pub actions: Vec<Action>,
    /// What became of the labels.
    pub report: CarryOverReport,
}

/// What became of labels that were carried over. Areas are of the new mesh, m².
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CarryOverReport {
    /// The faces that have a label.
    pub carried_m2: f64,
    /// The faces that have none: the old surface has none there, or is farther than 10 cm.
    pub unlabelled_m2: f64,
    /// Those among all faces whose label, or lack of one, has less than two thirds of the votes.
    pub disputed_m2: f64,
    /// These faces.
    pub disputed: FaceRuns,
    /// The instances that had faces and have none any more.
    pub lost: Vec<u32>,
}

/// Carries the labels of the mesh `from` over to the mesh `to`, which shows the same place in the same frame.
///
/// Samples of the old surface vote for the nearest new face, if it is within 10 cm; without a label, they
/// vote for none. A face takes what most of its votes say; of several, what the first old face of them has.
/// A face without votes, which is small, takes the label of the old face nearest to its middle, within 10 cm.
/// The same input gives the same result.
///
/// # Panics
/// If `state` is not of the mesh `from`.
pub fn carry_over(from: &TriMesh, state: &State, to: &TriMesh) -> CarriedOver {
    let labels = Labels::of(from, state);
    let votes = votes_for(from, &labels, to);
    let mut found = votes.label_of_face().to_vec();
    fill(from, &labels, to, &mut found);

    let mut report = CarryOverReport::default();
    let mut instances: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    let mut painted: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (face, label) in (0..).zip(&found) {
        let (instance, room) = labels.meaning(*label);
        let area_m2 = to.area(face);
        if instance == NONE {
            report.unlabelled_m2 += area_m2;
        } else {
            instances.entry(instance).or_default().push(face);
            report.carried_m2 += area_m2;
        }
        if room != NONE {
            painted.entry(room).or_default().push(face);
        }
        if votes.votes_of(face).is_some_and(|face| face.share() < CLEAR_SHARE) {
            report.disputed.push(face);
            report.disputed_m2 += area_m2;
        }
    }
    let had: BTreeSet<u32> = state
        .instance_of_face()
        .iter()
        .copied()
        .filter(|n| *n != NONE)
        .collect();
    report.lost = had
        .into_iter()
        .filter(|number| !instances.contains_key(number))
        .collect();

    let rooms = state.rooms().iter();
    let mut actions: Vec<Action> = rooms.map(|(&room, is)| Action::Room { room, is: is.clone() }).collect();
    actions.extend(instances.into_iter().map(|(instance, faces)| {
        let class = state.instances().get(&instance).cloned();
        Action::Paint { faces: faces.into_iter().collect(), instance, class }
    }));
    actions.extend(painted.into_iter().map(|(room, faces)| {
        let faces = faces.into_iter().collect();
        Action::PaintRoom { faces, room: Some(room) }
    }));
    CarriedOver { actions, report }
}

/// The labels of the old faces: what each label means, and the label of each face, from 1.
struct Labels {
    meanings: Vec<(u32, u32)>,
    of_face: Vec<LabelId>,
}

impl Labels {
    fn of(mesh: &TriMesh, state: &State) -> Self {
        assert_eq!(mesh.faces().len(), state.face_count() as usize, "labels of another mesh");
        let mut meanings = vec![(NONE, NONE)];
        let mut known: HashMap<(u32, u32), u32> = HashMap::new();
        let pairs = state.instance_of_face().iter().zip(state.painted_room_of_face());
        let of_face = pairs.map(|(&instance, &room)| {
            let label = known.entry((instance, room)).or_insert_with(|| {
                meanings.push((instance, room));
                meanings.len() as u32 - 1
            });
            LabelId(*label)
        });
        let of_face = of_face.collect();
        Self { meanings, of_face }
    }

    /// Returns the instance and the painted room that a label means.
    fn meaning(&self, label: LabelId) -> (u32, u32) {
        self.meanings.get(label.0 as usize).copied().unwrap_or_default()
    }

    fn of_face(&self, face: u32) -> LabelId {
        self.of_face.get(face as usize).copied().unwrap_or_default()
    }
}

/// Lets samples of the old surface vote for the new faces.
fn votes_for(from: &TriMesh, labels: &Labels, to: &TriMesh) -> FaceLabels {
    let wanted = (from.total_area() * SAMPLES_PER_M2).max(to.faces().len() as f64 * SAMPLES_PER_FACE);
    let sampler = SurfaceSampler::new(from, Density::Total(wanted.min(MOST_SAMPLES) as u64), 0);
    let nearest_faces = NearestFaces::new(to);
    let mut votes = Votes::new(to.faces().len());
    let mut cloud = PointCloud::default();
    let mut nearest: Vec<Nearest> = Vec::new();

    let mut start = 0;
    while start < sampler.len() {
        let end = sampler.len().min(start + BLOCK);
        sampler.sample(start..end, &mut cloud);
        nearest_faces.nearest_many(&cloud.positions, &mut nearest);
        for (place, &face) in nearest.iter().zip(&cloud.faces) {
            if place.face != NO_INDEX && place.distance_m <= SAME_SURFACE_M {
                votes.add(place.face, labels.of_face(face), place.distance_m);
            }
        }
        start = end;
    }
    FaceLabels::new(votes)
}

/// Gives new faces without votes the label of the nearest old face.
fn fill(from: &TriMesh, labels: &Labels, to: &TriMesh, found: &mut [LabelId]) {
    let without: Vec<u32> = (0..)
        .zip(found.iter())
        .filter(|(_, label)| label.is_null())
        .map(|(f, _)| f)
        .collect();
    let middles: Vec<Vec3> = without
        .iter()
        .map(|face| to.triangle(*face).into_iter().sum::<Vec3>() / 3.0)
        .collect();
    let mut nearest: Vec<Nearest> = Vec::new();
    NearestFaces::new(from).nearest_many(&middles, &mut nearest);
    for (face, place) in without.into_iter().zip(&nearest) {
        if place.face != NO_INDEX
            && place.distance_m <= SAME_SURFACE_M
            && let Some(label) = found.get_mut(face as usize)
        {
            *label = labels.of_face(place.face);
        }
    }
}
