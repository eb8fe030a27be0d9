//! The labels of a mesh at one moment: what the events so far add up to.

use super::column::{Column, NONE, Stretch, sums_of};
use super::event::{Action, EVENT_VERSION, Event, Room};
use super::face_runs::FaceRuns;
use super::fault::Fault;
use super::plan::split;
use s3d_geom::TriMesh;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The largest number of an instance or a room: `labels.npz` has numbers of 32 bits with a sign.
pub const MAX_NUMBER: u32 = i32::MAX as u32;

/// The labels of a mesh: the instance of each face, the class of each instance, the rooms, and what an undo
/// needs.
///
/// It is the fold of a log of [`Event`]s. Any list of events gives a state or a [`Fault`], on every machine
/// the same. The class of a face is the class of its instance.
///
/// An event tells what is done and not what was before. What was before follows from the events before it;
/// written into the log it would only be long and could contradict them. The state keeps it for every action
/// in effect, as runs of faces, so each may be taken back, however many there are, in the time that it took.
#[derive(Clone, Debug)]
pub struct State {
    pub(super) instances: Column,
    pub(super) painted_rooms: Column,
    /// The class of each instance.
    pub(super) classes: BTreeMap<u32, String>,
    pub(super) rooms: BTreeMap<u32, Room>,
    pub(super) next_instance: u32,
    pub(super) next_room: u32,
    revision: u64,
    /// The actions in effect.
    done: Vec<Step>,
    /// The actions that were taken back and may come again, with the numbers of their events. The last one is
    /// the next.
    undone: Vec<(u64, Action)>,
}

/// An action in effect, and what was before it.
#[derive(Clone, Debug)]
struct Step {
    /// The number of its event.
    number: u64,
    action: Action,
    before: Before,
}

/// What an action changed, as it was before.
#[derive(Clone, Debug, Default)]
struct Before {
    instances: Vec<Stretch>,
    painted_rooms: Vec<Stretch>,
    classes: Vec<(u32, Option<String>)>,
    rooms: Vec<(u32, Option<Room>)>,
}

/// What is labelled.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// The number of instances that have a face.
    pub instances: u32,
    /// The number of their faces.
    pub faces: u32,
    /// The area of these faces, m².
    pub area_m2: f64,
}

impl State {
    /// Starts without labels. `areas_m2` has the area of each face, m².
    pub fn new(areas_m2: impl IntoIterator<Item = f64>) -> Self {
        let sums = Arc::new(sums_of(areas_m2.into_iter()));
        Self {
            instances: Column::new(Arc::clone(&sums)),
            painted_rooms: Column::new(sums),
            classes: BTreeMap::new(),
            rooms: BTreeMap::new(),
            next_instance: 1,
            next_room: 1,
            revision: 0,
            done: Vec::new(),
            undone: Vec::new(),
        }
    }

    /// Starts without labels for the faces of a mesh.
    pub fn of_mesh(mesh: &TriMesh) -> Self {
        Self::new((0..mesh.faces().len() as u32).map(|face| mesh.area(face)))
    }

    /// Returns the number of the last event, or 0 without events.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns the number of faces of the mesh.
    pub fn face_count(&self) -> u32 {
        self.instances.of_face().len() as u32
    }

    /// Returns the instance of each face; 0 for a face without one.
    pub fn instance_of_face(&self) -> &[u32] {
        self.instances.of_face()
    }

    /// Returns the room that each face was painted for; 0 for a face that the outlines of rooms decide.
    /// [`State::room_of_face`] puts both together.
    pub fn painted_room_of_face(&self) -> &[u32] {
        self.painted_rooms.of_face()
    }

    /// Returns the instances by number, with their classes. An instance may have no face.
    pub fn instances(&self) -> &BTreeMap<u32, String> {
        &self.classes
    }

    /// Returns the rooms by number.
    pub fn rooms(&self) -> &BTreeMap<u32, Room> {
        &self.rooms
    }

    /// Returns the faces of an instance; none if there is no such instance.
    pub fn faces_of(&self, instance: u32) -> FaceRuns {
        if instance == NONE {
            return FaceRuns::default();
        }
        self.instances.faces_of(instance)
    }

    /// Returns the number of faces of an instance, and their area, m².
    pub fn size_of(&self, instance: u32) -> (u32, f64) {
        if instance == NONE {
            return (0, 0.0);
        }
        self.instances.tally(instance)
    }

    /// Returns the instances, faces and m² of each class that has a face.
    pub fn classes(&self) -> BTreeMap<&str, Tally> {
        let mut classes: BTreeMap<&str, Tally> = BTreeMap::new();
        for (&instance, class) in &self.classes {
            let (faces, area_m2) = self.instances.tally(instance);
            if faces > 0 {
                let tally = classes.entry(class).or_default();
                tally.instances += 1;
                tally.faces += faces;
                tally.area_m2 += area_m2;
            }
        }
        classes
    }

    /// Returns the number of faces without an instance, and their area, m².
    pub fn unlabelled(&self) -> (u32, f64) {
        self.instances.tally(NONE)
    }

    /// Returns the number for the next new instance.
    pub fn next_instance(&self) -> u32 {
        self.next_instance
    }

    /// Returns the number for the next new room.
    pub fn next_room(&self) -> u32 {
        self.next_room
    }

    /// Returns the event that an undo takes back, if there is one.
    pub fn next_undo(&self) -> Option<u64> {
        self.done.last().map(|step| step.number)
    }

    /// Returns the event that a redo brings back, if there is one.
    pub fn next_redo(&self) -> Option<u64> {
        self.undone.last().map(|(number, _)| *number)
    }

    /// Applies the event that follows the last one.
    ///
    /// # Errors
    /// A [`Fault`] if it does not fit. Nothing is changed then.
    pub fn apply(&mut self, event: Event) -> Result<(), Fault> {
        let Event { version, number, action, .. } = event;
        if version == 0 || version > EVENT_VERSION {
            return Err(Fault::Version { version });
        }
        if self.revision.checked_add(1) != Some(number) {
            return Err(Fault::Number { number, revision: self.revision });
        }
        self.check(&action)?;

        self.revision = number;
        match action {
            Action::Undo { .. } => {
                if let Some(step) = self.done.pop() {
                    self.restore(step.before);
                    self.undone.push((step.number, step.action));
                }
            }
            Action::Redo { .. } => {
                if let Some((number, action)) = self.undone.pop() {
                    self.perform(number, action);
                }
            }
            action => {
                self.undone.clear();
                self.perform(number, action);
            }
        }
        Ok(())
    }

    /// Does what an action says, which was checked, and notes what was before.
    fn perform(&mut self, number: u64, action: Action) {
        let mut before = Before::default();
        self.change(&action, &mut before);
        self.done.push(Step { number, action, before });
    }

    fn change(&mut self, action: &Action, before: &mut Before) {
        match action {
            Action::Paint { faces, instance, class } => {
                if let Some(class) = class {
                    self.set_class(*instance, Some(class.clone()), before);
                }
                self.instances.set(faces, *instance, &mut before.instances);
            }
            Action::Erase { faces } => self.instances.set(faces, NONE, &mut before.instances),
            Action::Join { into, instances } => {
                for instance in instances {
                    let faces = self.instances.faces_of(*instance);
                    self.instances.set(&faces, *into, &mut before.instances);
                    self.set_class(*instance, None, before);
                }
            }
            Action::Cut { instance, faces, new } => {
                let class = self.classes.get(instance).cloned();
                self.set_class(*new, class, before);
                let faces = self.instances.among(faces, *instance);
                self.instances.set(&faces, *new, &mut before.instances);
            }
            Action::Class { instance, class } => {
                self.set_class(*instance, Some(class.clone()), before);
            }
            Action::Room { room, is } => self.set_room(*room, Some(is.clone()), before),
            Action::SplitRoom { room, new, line } => {
                if let Some(Ok([left, right])) = self.rooms.get(room).map(|is| split(is, *line)) {
                    self.set_room(*room, Some(left), before);
                    self.set_room(*new, Some(right), before);
                }
            }
            Action::JoinRooms { into, rooms } => {
                for room in rooms {
                    self.move_painted(*room, *into, before);
                    let parts = self.rooms.get(room).map(|is| is.parts.clone());
                    self.set_room(*room, None, before);
                    if let Some(mut all) = self.rooms.get(into).cloned() {
                        all.parts.extend(parts.unwrap_or_default());
                        self.set_room(*into, Some(all), before);
                    }
                }
            }
            Action::RemoveRoom { room } => {
                self.move_painted(*room, NONE, before);
                self.set_room(*room, None, before);
            }
            Action::PaintRoom { faces, room } => {
                self.painted_rooms
                    .set(faces, room.unwrap_or(NONE), &mut before.painted_rooms);
            }
            Action::All { actions } => actions.iter().for_each(|action| self.change(action, before)),
            // They are no actions that are done or taken back.
            Action::Undo { .. } | Action::Redo { .. } => {}
        }
    }

    fn move_painted(&mut self, room: u32, to: u32, before: &mut Before) {
        let faces = self.painted_rooms.faces_of(room);
        self.painted_rooms.set(&faces, to, &mut before.painted_rooms);
    }

    fn set_class(&mut self, instance: u32, class: Option<String>, before: &mut Before) {
        self.next_instance = self.next_instance.max(instance.saturating_add(1));
        before.classes.push((instance, put(&mut self.classes, instance, class)));
    }

    fn set_room(&mut self, room: u32, is: Option<Room>, before: &mut Before) {
        self.next_room = self.next_room.max(room.saturating_add(1));
        before.rooms.push((room, put(&mut self.rooms, room, is)));
    }

    /// Takes an action back. What it changed last comes first.
    fn restore(&mut self, before: Before) {
        self.instances.restore(&before.instances);
        self.painted_rooms.restore(&before.painted_rooms);
        for (instance, class) in before.classes.into_iter().rev() {
            put(&mut self.classes, instance, class);
        }
        for (room, is) in before.rooms.into_iter().rev() {
            put(&mut self.rooms, room, is);
        }
    }
}

/// Puts a value, or nothing, under a key, and returns what was there.
fn put<T>(map: &mut BTreeMap<u32, T>, key: u32, value: Option<T>) -> Option<T> {
    match value {
        Some(value) => map.insert(key, value),
        None => map.remove(&key),
    }
}
