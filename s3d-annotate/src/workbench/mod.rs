//! A mesh on the workbench: its segments, its labels, and the gestures that a person labels it with.
//!
//! A person points at patches, draws cuts, accepts proposals. A [`Gesture`] says so, and a [`Workbench`]
//! makes the [`Action`] of it that the log keeps. The page of `s3d label` and the tests'
//! simulated person use the same calls.
//!
//! ```
//! use s3d_annotate::segments::{SegmentOptions, segment_faces};
//! use s3d_annotate::workbench::{Gesture, Patch, Selection, Workbench};
//! use s3d_geom::{TriMesh, glam::vec3, primitives::cuboid};
//! use s3d_label::Taxonomy;
//!
//! # let folder = tempfile::tempdir()?;
//! # let folder = folder.path().join("scan.labels");
//! let mesh = TriMesh::new(cuboid(vec3(0.0, 0.0, 0.0), vec3(1.0, 2.0, 0.5)))?;
//! let segments = segment_faces(&mesh, &SegmentOptions::default());
//! let root = segments.tree.node_count() - 1;
//! let mut bench = Workbench::open(&folder, mesh.into(), segments, &Taxonomy::s3dis())?;
//!
//! // All of the box is one thing: the patch at face 0 in the tree's root.
//! let what = Selection { patches: vec![Patch { face: 0, node: root }], ..Selection::default() };
//! let change = bench.perform(0, &Gesture::Label { what, class: "bookcase".into() }, None)?;
//! assert_eq!((change.revision, change.faces[0].1.len()), (1, 12));
//! bench.perform(1, &Gesture::Undo, None)?;
//! assert_eq!(bench.labels().state().unlabelled().0, 12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod gesture;
mod knife;

pub use gesture::{Gesture, Knife, Patch, Selection};

use crate::labelling::{Action, Error, FaceRuns, Fault, LabelFolder, Room, State};
use crate::segments::{FaceIndex, Lists, Segments, borders_of};
use s3d_geom::TriMesh;
use s3d_label::Taxonomy;
use std::collections::{BTreeMap, HashSet};
use std::path::Path;
use std::sync::Arc;

/// A mesh with its segments and its labels, open for work.
#[derive(Debug)]
pub struct Workbench {
    mesh: Arc<TriMesh>,
    segments: Arc<Segments>,
    index: Arc<FaceIndex>,
    /// The faces with which each face shares an edge.
    neighbours: Lists,
    labels: LabelFolder,
    proposals: Proposals,
}

/// What is proposed to the person. Nothing of it is a label before it is accepted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Proposals {
    /// Instances.
    pub surfaces: Vec<Proposal>,
    /// Rooms.
    pub rooms: Vec<Room>,
}

/// A proposed instance.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    /// Its class.
    pub class: String,
    /// Its faces.
    pub faces: FaceRuns,
    /// The proposed room that it belongs to, by its place in [`Proposals::rooms`], if that is known.
    pub room: Option<u32>,
    /// Where it comes from, in words, such as `structure` or the name of a file.
    pub source: String,
}

/// What a gesture has changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Change {
    /// The revision of the labels after it.
    pub revision: u64,
    /// The faces whose instance is another one now, by this instance; 0 for none.
    pub faces: Vec<(u32, FaceRuns)>,
}

impl Workbench {
    /// Opens the labels of a mesh, or begins them: see [`LabelFolder::open`]. `segments` are those of the
    /// mesh.
    ///
    /// # Errors
    /// The errors of [`LabelFolder::open`].
    ///
    /// # Panics
    /// If the segments are of a mesh with another number of faces.
    pub fn open(
        folder: &Path,
        mesh: Arc<TriMesh>,
        segments: impl Into<Arc<Segments>>,
        taxonomy: &Taxonomy,
    ) -> Result<Self, Error> {
        let segments = segments.into();
        let index = Arc::new(FaceIndex::new(&mesh, &segments));
        let labels = LabelFolder::open(folder, &mesh, taxonomy)?;
        let borders = borders_of(&mesh);
        let both = borders.iter().flat_map(|&[a, b]| [(a, b), (b, a)]);
        let neighbours = Lists::of(mesh.faces().len(), both);
        Ok(Self { mesh, segments, index, neighbours, labels, proposals: Proposals::default() })
    }

    /// Returns the mesh.
    pub fn mesh(&self) -> &Arc<TriMesh> {
        &self.mesh
    }

    /// Returns its segments.
    pub fn segments(&self) -> &Arc<Segments> {
        &self.segments
    }

    /// Returns the colours of its faces, and the faces of its segments.
    pub fn face_index(&self) -> &Arc<FaceIndex> {
        &self.index
    }

    /// Returns its labels.
    pub fn labels(&self) -> &LabelFolder {
        &self.labels
    }

    /// Returns what is proposed.
    pub fn proposals(&self) -> &Proposals {
        &self.proposals
    }

    /// Says what is proposed. Numbers in a [`Gesture::Accept`] are about these from now on.
    pub fn propose(&mut self, proposals: Proposals) {
        self.proposals = proposals;
    }

    /// Returns the faces of a patch.
    ///
    /// # Errors
    /// [`Fault::NoSuchPatch`] if the face is not in the node, or one of them does not exist.
    pub fn patch(&self, patch: Patch) -> Result<FaceRuns, Fault> {
        let Patch { face, node } = patch;
        let tree = &self.segments.tree;
        let segment = self.segments.segment_of_face.get(face as usize);
        if !segment.is_some_and(|segment| tree.has(node, *segment)) {
            return Err(Fault::NoSuchPatch { face, node });
        }

        let instance_of = self.labels.state().instance_of_face();
        let own = instance_of[face as usize];
        let faces = self.index.faces_of_node(tree, node);
        Ok(faces.filter(|face| instance_of[*face as usize] == own).collect())
    }

    /// Returns the faces that a [`Gesture::Cut`] would take. Nothing is changed.
    ///
    /// # Errors
    /// [`Fault`]s for a patch that does not exist and a knife without a plane.
    pub fn cut(&self, at: Patch, by: &Knife) -> Result<FaceRuns, Fault> {
        let patch = self.patch(at)?;
        knife::cut_out(&self.mesh, &self.index, &self.neighbours, &patch, at.face, by)
    }

    /// Does what a gesture says, and returns what has changed. By then, it is on the disk. `revision` and
    /// `at_ms` are those of [`LabelFolder::add`].
    ///
    /// # Errors
    /// The errors of [`LabelFolder::add`], and [`Fault`]s for patches, cuts and proposals that do not fit.
    /// Nothing is changed then.
    pub fn perform(&mut self, revision: u64, gesture: &Gesture, at_ms: Option<u64>) -> Result<Change, Error> {
        let before = self.labels.state().instance_of_face().to_vec();
        let revision = match gesture {
            Gesture::Undo => self.labels.undo(revision, at_ms)?,
            Gesture::Redo => self.labels.redo(revision, at_ms)?,
            gesture => {
                // A patch of old labels would be another one.
                self.labels.check_revision(revision)?;
                let action = self.action(gesture)?;
                self.labels.add(revision, action, at_ms)?
            }
        };
        Ok(Change { revision, faces: changed(&before, self.labels.state().instance_of_face()) })
    }

    /// Returns the action that a gesture means now.
    fn action(&self, gesture: &Gesture) -> Result<Action, Fault> {
        let state = self.labels.state();
        let next = state.next_instance();
        Ok(match gesture {
            Gesture::Label { what, class } => {
                Action::Paint { faces: self.selected(what)?, instance: next, class: Some(class.clone()) }
            }
            Gesture::LabelEach { patches, class } => {
                let patches = patches.iter().map(|patch| self.patch(*patch));
                let patches = patches.collect::<Result<Vec<FaceRuns>, Fault>>()?;
                let mut several = Several::of(state);
                patches.iter().for_each(|faces| several.paint(faces.iter(), class));
                several.action()
            }
            Gesture::Add { what, instance } => {
                Action::Paint { faces: self.selected(what)?, instance: *instance, class: None }
            }
            Gesture::Erase { what } => Action::Erase { faces: self.selected(what)? },
            Gesture::Cut { at, by, class } => {
                let faces = self.cut(*at, by)?;
                match class {
                    Some(class) => Action::Paint { faces, instance: next, class: Some(class.clone()) },
                    None => {
                        let instance = state.instance_of_face()[at.face as usize];
                        Action::Cut { instance, faces, new: next }
                    }
                }
            }
            Gesture::Join { into, instances } => Action::Join { into: *into, instances: instances.clone() },
            Gesture::Class { instance, class } => Action::Class { instance: *instance, class: class.clone() },
            Gesture::Accept { surfaces, rooms } => self.accepted(surfaces, rooms)?,
            Gesture::Room { room, is } => {
                Action::Room { room: room.unwrap_or(state.next_room()), is: is.clone() }
            }
            Gesture::SplitRoom { room, line } => {
                Action::SplitRoom { room: *room, new: state.next_room(), line: *line }
            }
            Gesture::JoinRooms { into, rooms } => Action::JoinRooms { into: *into, rooms: rooms.clone() },
            Gesture::RemoveRoom { room } => Action::RemoveRoom { room: *room },
            Gesture::Undo => Action::Undo { of: state.next_undo().unwrap_or_default() },
            Gesture::Redo => Action::Redo { of: state.next_redo().unwrap_or_default() },
        })
    }

    fn selected(&self, what: &Selection) -> Result<FaceRuns, Fault> {
        let mut faces: Vec<u32> = Vec::new();
        for patch in &what.patches {
            faces.extend(self.patch(*patch)?.iter());
        }
        let count = self.mesh.faces().len() as u32;
        if what.faces.end() > count {
            return Err(Fault::NoSuchFace { face: what.faces.end() - 1, count });
        }
        faces.extend(what.faces.iter());
        Ok(faces.into_iter().collect())
    }

    fn accepted(&self, surfaces: &[u32], rooms: &[u32]) -> Result<Action, Fault> {
        let Proposals { surfaces: proposed, rooms: proposed_rooms } = &self.proposals;
        let none =
            |number: &u32, count: usize| Fault::NoSuchProposal { number: *number, count: count as u32 };

        let state = self.labels.state();
        let mut several = Several::of(state);
        for number in surfaces {
            let surface = proposed.get(*number as usize);
            let surface = surface.ok_or_else(|| none(number, proposed.len()))?;
            let bare = surface
                .faces
                .iter()
                .filter(|face| state.instance_of_face().get(*face as usize) == Some(&0));
            several.paint(bare, &surface.class);
        }
        for number in rooms {
            let room = proposed_rooms.get(*number as usize);
            several.room(room.ok_or_else(|| none(number, proposed_rooms.len()))?);
        }
        Ok(several.action())
    }
}

/// New instances and rooms, which are made as one action.
struct Several {
    actions: Vec<Action>,
    taken: HashSet<u32>,
    next_instance: u32,
    next_room: u32,
}

impl Several {
    fn of(state: &State) -> Self {
        Self {
            actions: Vec::new(),
            taken: HashSet::new(),
            next_instance: state.next_instance(),
            next_room: state.next_room(),
        }
    }

    /// Adds an instance of those faces that none before has, if there is one.
    fn paint(&mut self, faces: impl Iterator<Item = u32>, class: &str) {
        let faces: FaceRuns = faces.filter(|face| self.taken.insert(*face)).collect();
        if !faces.is_empty() {
            let instance = self.next_instance;
            self.next_instance = instance.saturating_add(1);
            self.actions
                .push(Action::Paint { faces, instance, class: Some(class.to_owned()) });
        }
    }

    fn room(&mut self, is: &Room) {
        let room = self.next_room;
        self.next_room = room.saturating_add(1);
        self.actions.push(Action::Room { room, is: is.clone() });
    }

    fn action(self) -> Action {
        Action::All { actions: self.actions }
    }
}

/// The faces whose number differs, by their new number.
fn changed(before: &[u32], after: &[u32]) -> Vec<(u32, FaceRuns)> {
    let mut faces: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (face, (old, new)) in (0..).zip(before.iter().zip(after)) {
        if old != new {
            faces.entry(*new).or_default().push(face);
        }
    }
    faces
        .into_iter()
        .map(|(instance, faces)| (instance, faces.into_iter().collect()))
        .collect()
}
