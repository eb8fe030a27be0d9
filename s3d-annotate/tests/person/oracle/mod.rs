//! A simulated person: it knows what each face is, and labels with the gestures of the page alone.
//!
//! Each gesture is one stroke. The person always makes the one that puts the largest area right, within what
//! a hand can do:
//!
//! - A drag goes over at most [`MOST_PATCHES`] patches within [`REACH_M`] of the first. As on the page, it
//!   has one level of the tree for all of them. A new object takes faces of one instance or of none; Shift
//!   adds faces of any other.
//! - A box is a rectangle of four clicks around the largest side of a thing.
//! - A cut by colour has one of three tolerances.
//! - A brush is drawn over at most [`STROKE_M`] within [`REACH_M`] of its beginning, with one of three
//!   widths. It takes faces as a drag does.
//! - "More like it" labels all patches that the review proposes for a thing, with one stroke, and one more
//!   for each patch that has to be taken out first.
//! - The structure of a room is accepted with one stroke, as found by the crate itself. A proposal that is
//!   not one thing stays wrong until it is put right by strokes. Pieces of one thing are joined by strokes.

mod cuts;

use super::scenes::Known;
use super::sitting::Sitting;
use s3d_annotate::review::{Review, Surroundings};
use s3d_annotate::segments::{SegmentOptions, segment_faces};
use s3d_annotate::structure::find_structure;
use s3d_annotate::workbench::{Gesture, Patch, Proposal, Proposals, Selection, Workbench};
use s3d_geom::glam::Vec3;
use s3d_label::Taxonomy;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::sync::Arc;

/// A drag touches so many patches at most.
const MOST_PATCHES: usize = 12;

/// A drag goes no farther from its first patch, metres.
const REACH_M: f32 = 3.0;

/// The levels of the tree that the person tries: costs of nodes.
const LEVELS: [f32; 14] = [0.0, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.4, 2.0, 3.0, 4.5, 7.0];

/// Half the widths of brushes, metres.
const BRUSHES_M: [f32; 3] = [0.04, 0.1, 0.25];

/// The longest stroke of a brush, and the longest way between what it is drawn over, metres.
const STROKE_M: f32 = 6.0;
const HOP_M: f32 = 0.5;

/// The tolerances of cuts by colour.
const TOLERANCES: [f32; 3] = [0.03, 0.06, 0.12];

/// A box cuts within this of its plane, metres, as the workbench says.
const BOX_M: f32 = 0.15;

/// The edge of the cells in which faces are looked for, metres.
const CELL_M: f32 = 0.25;

fn cell(place: Vec3) -> [i32; 3] {
    (place / CELL_M).floor().as_ivec3().to_array()
}

/// A gesture that the person could make.
struct Idea {
    kind: &'static str,
    gesture: Gesture,
    /// The area that it would put right, m², less what it would spoil.
    gain_m2: f64,
    strokes: usize,
    /// The things of the instances that it makes, in their order; none for an instance that exists.
    makes: Vec<u32>,
}

impl Idea {
    fn gain_a_stroke(&self) -> f64 {
        self.gain_m2 / self.strokes as f64
    }
}

/// Area by segment, instance and thing.
type Shares = Vec<(u32, u32, u32, f64)>;

struct Person<'a> {
    scene: &'a Known,
    bench: Workbench,
    surroundings: Surroundings,
    areas: Vec<f64>,
    middles: Vec<Vec3>,
    total_m2: f64,
    /// The instance that stands for each thing, 0 for none.
    instance_of: Vec<u32>,
    /// The node of each segment at each level.
    cuts: Vec<Vec<u32>>,
    /// A place on each segment.
    segment_middles: Vec<Vec3>,
    /// The faces whose middles are in each cell of [`CELL_M`].
    cells: HashMap<[i32; 3], Vec<u32>>,
    sitting: Sitting,
}

/// Labels a scene until `share` of it is right, no more can be done, or `most` strokes are made.
pub(crate) fn label(scene: &Known, folder: &Path, share: f64, most: usize) -> Sitting {
    let mut person = Person::new(scene, folder);
    person.accept_structure();
    while person.right()[0] < share && person.sitting.right.len() <= most {
        let Some(idea) = person.best_idea() else { break };
        person.perform(idea);
    }
    person.sitting.purity_after = person.purity();
    person.sitting
}

impl<'a> Person<'a> {
    fn new(scene: &'a Known, folder: &Path) -> Self {
        let mesh = Arc::new(scene.mesh.clone());
        let segments = Arc::new(segment_faces(&mesh, &SegmentOptions::default()));
        let structure = find_structure(&mesh);
        let mut bench = Workbench::open(folder, Arc::clone(&mesh), Arc::clone(&segments), &Taxonomy::s3dis())
            .expect("a new folder");
        let surroundings = Surroundings::new(&mesh, &segments, Arc::clone(bench.face_index()));
        let surfaces = structure.surfaces.into_iter().map(|surface| Proposal {
            class: surface.class.to_owned(),
            faces: surface.faces,
            room: surface.room.map(|room| room as u32),
            source: "structure".to_owned(),
        });
        bench.propose(Proposals { surfaces: surfaces.collect(), rooms: structure.rooms });

        let faces = 0..mesh.faces().len() as u32;
        let areas: Vec<f64> = faces.clone().map(|face| mesh.area(face)).collect();
        let middles: Vec<Vec3> = faces
            .map(|face| mesh.triangle(face).iter().sum::<Vec3>() / 3.0)
            .collect();
        let known = |face: usize| scene.thing_of_face[face] != 0;
        let total_m2 = (0..areas.len())
            .filter(|face| known(*face))
            .map(|face| areas[face])
            .sum();

        let tree = &segments.tree;
        let mut segment_middles = vec![Vec3::ZERO; tree.leaf_count() as usize];
        for (face, segment) in segments.segment_of_face.iter().enumerate() {
            segment_middles[*segment as usize] = middles[face];
        }
        let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        for (face, middle) in (0u32..).zip(&middles) {
            cells.entry(cell(*middle)).or_default().push(face);
        }
        let mut person = Self {
            scene,
            bench,
            surroundings,
            areas,
            middles,
            total_m2,
            instance_of: vec![0; scene.classes.len()],
            cuts: LEVELS.iter().map(|cost| tree.nodes_at(*cost)).collect(),
            segment_middles,
            cells,
            sitting: Sitting {
                things: scene.things(),
                right: vec![0.0],
                either: vec![0.0],
                mixed: 0.0,
                kinds: BTreeMap::new(),
                purity_before: 0.0,
                purity_after: 0.0,
            },
        };
        person.sitting.purity_before = person.purity();
        let mixed_m2: f64 = scene.also.keys().map(|face| person.areas[*face as usize]).sum();
        person.sitting.mixed = mixed_m2 / total_m2;
        person
    }

    fn of_face(&self) -> &[u32] {
        self.bench.labels().state().instance_of_face()
    }

    fn is_right(&self, thing: u32, instance: u32) -> bool {
        thing != 0 && instance != 0 && self.instance_of[thing as usize] == instance
    }

    /// The share of the surface that has the right instance; and the share if a face that lies over a border
    /// is right with the instance of any of its things.
    fn right(&self) -> [f64; 2] {
        let (mut right_m2, mut either_m2) = (0.0, 0.0);
        for (face, (&thing, &instance)) in (0u32..).zip(self.scene.thing_of_face.iter().zip(self.of_face())) {
            let area_m2 = self.areas[face as usize];
            let also = self.scene.also.get(&face).filter(|_| thing != 0);
            if self.is_right(thing, instance) {
                right_m2 += area_m2;
                either_m2 += area_m2;
            } else if also.is_some_and(|also| also.iter().any(|other| self.is_right(*other, instance))) {
                either_m2 += area_m2;
            }
        }
        [right_m2, either_m2].map(|area_m2| area_m2 / self.total_m2)
    }

    fn shares(&self) -> Shares {
        let mut shares: HashMap<(u32, u32, u32), f64> = HashMap::new();
        let segments = &self.bench.segments().segment_of_face;
        for (face, &instance) in self.of_face().iter().enumerate() {
            let thing = self.scene.thing_of_face[face];
            *shares.entry((segments[face], instance, thing)).or_default() += self.areas[face];
        }
        let mut shares: Shares = shares.into_iter().map(|((s, i, t), area)| (s, i, t, area)).collect();
        shares.sort_by_key(|(s, i, t, _)| (*s, *i, *t));
        shares
    }

    /// The share of the known surface that is of the largest thing of its patch.
    fn purity(&self) -> f64 {
        let mut largest_m2 = 0.0;
        for patch in self.shares().chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let of_things = patch
                .iter()
                .filter(|(.., thing, _)| *thing != 0)
                .map(|(.., area)| *area);
            largest_m2 += of_things.fold(0f64, f64::max);
        }
        largest_m2 / self.total_m2
    }

    /// Accepts the proposals room by room.
    fn accept_structure(&mut self) {
        let proposals = self.bench.proposals();
        let mut of_room: BTreeMap<Option<u32>, Vec<u32>> = BTreeMap::new();
        for (number, surface) in (0u32..).zip(&proposals.surfaces) {
            of_room.entry(surface.room).or_default().push(number);
        }
        for (room, surfaces) in of_room {
            let gesture = Gesture::Accept { surfaces, rooms: Vec::from_iter(room) };
            self.perform(Idea { kind: "accept", gesture, gain_m2: 0.0, strokes: 1, makes: Vec::new() });
        }
    }

    fn perform(&mut self, idea: Idea) {
        let state = self.bench.labels().state();
        let first = state.next_instance();
        let revision = state.revision();
        let done = self.bench.perform(revision, &idea.gesture, None);
        done.unwrap_or_else(|e| panic!("{} does not fit: {e}: {:?}", idea.kind, idea.gesture));
        for (instance, thing) in (first..).zip(idea.makes) {
            self.instance_of[thing as usize] = instance;
        }
        if idea.kind == "accept" {
            self.meet(first);
        }
        let [right, either] = self.right();
        self.sitting.right.extend(vec![right; idea.strokes]);
        self.sitting.either.extend(vec![either; idea.strokes]);
        *self.sitting.kinds.entry(idea.kind).or_default() += idea.strokes;
    }

    /// New instances stand for the thing that they have most of, the one with most of it first.
    fn meet(&mut self, first: u32) {
        let mut shares: BTreeMap<(u32, u32), f64> = BTreeMap::new();
        for (face, &instance) in self.of_face().iter().enumerate().filter(|(_, i)| **i >= first) {
            *shares.entry((instance, self.scene.thing_of_face[face])).or_default() += self.areas[face];
        }
        let mut largest: Vec<(f64, u32, u32)> = Vec::new();
        let shares: Vec<((u32, u32), f64)> = shares.into_iter().collect();
        for of_instance in shares.chunk_by(|a, b| a.0.0 == b.0.0) {
            let known = of_instance.iter().filter(|((_, thing), _)| *thing != 0);
            largest.extend(
                known
                    .max_by(|a, b| a.1.total_cmp(&b.1))
                    .map(|((i, t), area)| (*area, *i, *t)),
            );
        }
        largest.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (_, instance, thing) in largest {
            if self.instance_of[thing as usize] == 0 {
                self.instance_of[thing as usize] = instance;
            }
        }
    }

    /// The idea with the largest gain a stroke; `None` if nothing is worth a stroke.
    fn best_idea(&self) -> Option<Idea> {
        let shares = self.shares();
        let mut ideas = Vec::from_iter(self.drag(&shares));
        let drag_m2 = ideas.iter().map(Idea::gain_a_stroke).fold(0.0, f64::max);
        ideas.extend(self.joins(&shares));

        // What is left of each thing, most first: only much of it is worth a look.
        let mut left_m2: BTreeMap<u32, f64> = BTreeMap::new();
        for (_, instance, thing, area) in &shares {
            if *thing != 0 && !self.is_right(*thing, *instance) {
                *left_m2.entry(*thing).or_default() += area;
            }
        }
        let mut left: Vec<(u32, f64)> = left_m2.into_iter().filter(|(_, m2)| *m2 > drag_m2).collect();
        left.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        for (thing, _) in left.into_iter().take(8) {
            ideas.extend(self.boxes(thing));
            ideas.extend(self.swaths(thing));
            ideas.extend(self.colors(thing));
        }
        ideas.extend(self.more_like());
        let best = ideas
            .into_iter()
            .max_by(|a, b| a.gain_a_stroke().total_cmp(&b.gain_a_stroke()))?;
        (best.gain_m2 > 1e-4).then_some(best)
    }

    /// The drag over patches that gains most, at the level that is best for its thing.
    fn drag(&self, shares: &Shares) -> Option<Idea> {
        // The drag of each thing: what it gains, and its nodes and instances.
        let mut best: BTreeMap<u32, (f64, Vec<(u32, u32)>)> = BTreeMap::new();
        for cut in &self.cuts {
            // What each patch of this level has: the area of each thing.
            let mut patches: BTreeMap<(u32, u32), Vec<(u32, f64)>> = BTreeMap::new();
            for (segment, instance, thing, area) in shares {
                patches
                    .entry((cut[*segment as usize], *instance))
                    .or_default()
                    .push((*thing, *area));
            }
            type Strokes = Vec<(f64, u32, u32)>;
            let mut drags: BTreeMap<(u32, Option<u32>), Strokes> = BTreeMap::new();
            for ((node, instance), has) in patches {
                let mut of_thing: BTreeMap<u32, f64> = BTreeMap::new();
                has.iter()
                    .for_each(|(thing, area)| *of_thing.entry(*thing).or_default() += area);
                let right_m2 = of_thing
                    .iter()
                    .find(|(thing, _)| self.is_right(**thing, instance))
                    .map_or(0.0, |x| *x.1);
                let all_m2: f64 = of_thing.values().sum();
                for (&thing, &area) in of_thing.iter().filter(|(thing, _)| **thing != 0) {
                    if self.is_right(thing, instance) {
                        continue;
                    }
                    // What is spoilt counts, and what is swallowed counts half.
                    let gain = area - right_m2 - 0.5 * (all_m2 - area - right_m2);
                    if gain > 0.0 {
                        let stays_on = (self.instance_of[thing as usize] == 0).then_some(instance);
                        let touched = drags.entry((thing, stays_on)).or_default();
                        touched.push((gain, node, instance));
                    }
                }
            }
            for ((thing, _), mut touched) in drags {
                touched.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
                let place = |node: u32| {
                    let segments = self.bench.segments().tree.segments_of(node);
                    self.segment_middles[segments[0] as usize]
                };
                let first = place(touched[0].1);
                touched.retain(|(_, node, _)| place(*node).distance(first) <= REACH_M);
                touched.truncate(MOST_PATCHES);
                let gain: f64 = touched.iter().map(|(gain, ..)| gain).sum();
                if best.get(&thing).is_none_or(|(before, _)| gain > *before) {
                    let nodes = touched.iter().map(|(_, node, instance)| (*node, *instance));
                    best.insert(thing, (gain, nodes.collect()));
                }
            }
        }
        // Only the best one needs its faces.
        let best = best
            .into_iter()
            .max_by(|a, b| a.1.0.total_cmp(&b.1.0).then(b.0.cmp(&a.0)));
        best.map(|(thing, (gain_m2, nodes))| {
            let patches = nodes.into_iter().map(|(node, instance)| self.patch_in(node, instance));
            let what = Selection { patches: patches.collect(), ..Selection::default() };
            self.paint("drag", thing, what, gain_m2)
        })
    }

    /// The patch of a node and an instance.
    fn patch_in(&self, node: u32, instance: u32) -> Patch {
        let segments = self.bench.segments();
        let of_face = self.of_face();
        let face = (0..of_face.len()).find(|face| {
            of_face[*face] == instance && segments.tree.has(node, segments.segment_of_face[*face])
        });
        Patch { face: face.expect("the patch has a face") as u32, node }
    }

    /// Labels a new thing, or adds to it.
    fn paint(&self, kind: &'static str, thing: u32, what: Selection, gain_m2: f64) -> Idea {
        let instance = self.instance_of[thing as usize];
        let class = self.scene.classes[thing as usize].clone();
        if instance == 0 {
            let gesture = Gesture::Label { what, class };
            return Idea { kind, gesture, gain_m2, strokes: 1, makes: vec![thing] };
        }
        Idea { kind, gesture: Gesture::Add { what, instance }, gain_m2, strokes: 1, makes: Vec::new() }
    }

    /// Joins of an instance that is a piece of a thing to the instance that stands for it.
    fn joins(&self, shares: &Shares) -> Vec<Idea> {
        let mut of_instance: BTreeMap<u32, BTreeMap<u32, f64>> = BTreeMap::new();
        for (_, instance, thing, area) in shares.iter().filter(|(_, instance, ..)| *instance != 0) {
            *of_instance.entry(*instance).or_default().entry(*thing).or_default() += area;
        }
        let mut ideas = Vec::new();
        for (instance, has) in of_instance {
            if self.instance_of.contains(&instance) {
                continue;
            }
            let most = has
                .iter()
                .filter(|(thing, _)| **thing != 0)
                .max_by(|a, b| a.1.total_cmp(b.1));
            if let Some((thing, area)) = most
                && self.instance_of[*thing as usize] != 0
            {
                let into = self.instance_of[*thing as usize];
                let gesture = Gesture::Join { into, instances: vec![instance] };
                let swallowed: f64 = has.values().sum::<f64>() - area;
                let gain_m2 = area - 0.5 * swallowed;
                ideas.push(Idea { kind: "join", gesture, gain_m2, strokes: 1, makes: Vec::new() });
            }
        }
        ideas
    }

    /// The faces of a thing that are not right.
    fn left_of(&self, thing: u32) -> Vec<u32> {
        let of_face = self.of_face();
        let is_left = |face: &u32| {
            self.scene.thing_of_face[*face as usize] == thing
                && !self.is_right(thing, of_face[*face as usize])
        };
        (0..of_face.len() as u32).filter(is_left).collect()
    }

    /// What some faces of one instance would gain if they were given to a thing.
    fn gain(&self, thing: u32, faces: impl Iterator<Item = u32>) -> f64 {
        let of_face = self.of_face();
        faces
            .map(|face| {
                let (is, instance) = (self.scene.thing_of_face[face as usize], of_face[face as usize]);
                let area = self.areas[face as usize];
                match () {
                    () if is == thing => area,
                    () if self.is_right(is, instance) => -area,
                    () => -0.5 * area,
                }
            })
            .sum()
    }

    /// "More like it" for a thing that is done.
    fn more_like(&self) -> Option<Idea> {
        let review = Review {
            mesh: self.bench.mesh(),
            segments: self.bench.segments(),
            surroundings: &self.surroundings,
            state: self.bench.labels().state(),
        };
        // The last thing of each class is asked for.
        let mut last: BTreeMap<&String, (u32, u32)> = BTreeMap::new();
        for (thing, &instance) in (0u32..).zip(&self.instance_of).filter(|(_, instance)| **instance != 0) {
            let of_class = last.entry(&self.scene.classes[thing as usize]).or_default();
            *of_class = (*of_class).max((instance, thing));
        }
        let mut best: Option<Idea> = None;
        for (class, (instance, _)) in last {
            let (mut kept, mut makes, mut gain_m2, mut wrong) = (Vec::new(), Vec::new(), 0.0, 0);
            for patch in review.similar_patches(instance) {
                let Ok(faces) = self.bench.patch(patch) else { continue };
                let mut of_thing: BTreeMap<u32, f64> = BTreeMap::new();
                for face in faces.iter() {
                    *of_thing.entry(self.scene.thing_of_face[face as usize]).or_default() +=
                        self.areas[face as usize];
                }
                let most = of_thing.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
                let Some((other, _)) = most else { continue };
                let gain = self.gain(other, faces.iter());
                let is_new = self.instance_of[other as usize] == 0 && !makes.contains(&other);
                if other != 0 && is_new && self.scene.classes[other as usize] == *class && gain > 0.0 {
                    kept.push(patch);
                    makes.push(other);
                    gain_m2 += gain;
                } else {
                    wrong += 1;
                }
            }
            let strokes = 1 + wrong;
            if kept.is_empty() {
                continue;
            }
            let gesture = Gesture::LabelEach { patches: kept, class: class.clone() };
            let idea = Idea { kind: "more like it", gesture, gain_m2, strokes, makes };
            if best
                .as_ref()
                .is_none_or(|best| idea.gain_a_stroke() > best.gain_a_stroke())
            {
                best = Some(idea);
            }
        }
        best
    }
}
