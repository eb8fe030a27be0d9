//! Whether an action fits a state.

use super::column::NONE;
use super::event::{Action, Room};
use super::face_runs::FaceRuns;
use super::fault::Fault;
use super::plan::{is_shape, split};
use super::state::{MAX_NUMBER, State};

impl State {
    /// Tells whether an action fits this state.
    ///
    /// # Errors
    /// A [`Fault`] if it does not.
    pub fn check(&self, action: &Action) -> Result<(), Fault> {
        match action {
            Action::Paint { faces, instance, class } => {
                self.check_faces(faces)?;
                match class {
                    Some(_) => self.check_new_instance(*instance),
                    None => {
                        self.check_instance(*instance)?;
                        let is_same = self.instances.all_have(faces, *instance);
                        nothing_if(is_same, "all these faces belong to the instance")
                    }
                }
            }
            Action::Erase { faces } => {
                self.check_faces(faces)?;
                nothing_if(self.instances.all_have(faces, NONE), "none of these faces has a label")
            }
            Action::Join { into, instances } => {
                self.check_instance(*into)?;
                nothing_if(instances.is_empty(), "no instance is to be joined")?;
                nothing_if(instances.contains(into), "an instance cannot be joined to itself")?;
                instances.iter().try_for_each(|instance| self.check_instance(*instance))
            }
            Action::Cut { instance, faces, new } => {
                self.check_faces(faces)?;
                self.check_instance(*instance)?;
                self.check_new_instance(*new)?;
                let cut = self.instances.among(faces, *instance).len();
                nothing_if(cut == 0, "none of these faces belongs to the instance")?;
                let (all, _) = self.instances.tally(*instance);
                nothing_if(cut == all, "these are all faces of the instance")
            }
            Action::Class { instance, class } => {
                self.check_instance(*instance)?;
                let is_same = self.classes.get(instance) == Some(class);
                nothing_if(is_same, "the instance has this class")
            }
            Action::Room { room, is } => {
                if !self.rooms.contains_key(room) {
                    self.check_new_room(*room)?;
                }
                if !is.parts.iter().all(is_shape) {
                    return Err(Fault::RoomShape);
                }
                nothing_if(self.rooms.get(room) == Some(is), "the room is like this")
            }
            Action::SplitRoom { room, new, line } => {
                self.check_new_room(*new)?;
                split(self.room(*room)?, *line).map(drop)
            }
            Action::JoinRooms { into, rooms } => {
                self.room(*into)?;
                nothing_if(rooms.is_empty(), "no room is to be joined")?;
                nothing_if(rooms.contains(into), "a room cannot be joined to itself")?;
                rooms.iter().try_for_each(|room| self.room(*room).map(drop))
            }
            Action::RemoveRoom { room } => self.room(*room).map(drop),
            Action::PaintRoom { faces, room } => {
                self.check_faces(faces)?;
                room.iter().try_for_each(|room| self.room(*room).map(drop))?;
                let is_same = self.painted_rooms.all_have(faces, room.unwrap_or(NONE));
                nothing_if(is_same, "all these faces are painted so")
            }
            Action::All { actions } => self.check_all(actions),
            Action::Undo { of } => its_turn(*of, self.next_undo(), "taken back"),
            Action::Redo { of } => its_turn(*of, self.next_redo(), "brought back"),
        }
    }

    /// Several actions make new things alone, whose numbers ascend: none depends on one before.
    fn check_all(&self, actions: &[Action]) -> Result<(), Fault> {
        nothing_if(actions.is_empty(), "no action is named")?;
        let [mut next_instance, mut next_room] = [self.next_instance, self.next_room];
        for action in actions {
            match action {
                Action::Paint { faces, instance, class: Some(_) } => {
                    self.check_faces(faces)?;
                    next_instance = following(*instance, next_instance)
                        .ok_or(Fault::InstanceNumber { number: *instance, next: next_instance })?;
                }
                Action::Room { room, is } if !self.rooms.contains_key(room) => {
                    if !is.parts.iter().all(is_shape) {
                        return Err(Fault::RoomShape);
                    }
                    next_room = following(*room, next_room)
                        .ok_or(Fault::RoomNumber { number: *room, next: next_room })?;
                }
                _ => return Err(Fault::NotNew),
            }
        }
        Ok(())
    }

    fn check_faces(&self, faces: &FaceRuns) -> Result<(), Fault> {
        nothing_if(faces.is_empty(), "there is no face")?;
        let count = self.face_count();
        match faces.end() {
            end if end > count => Err(Fault::NoSuchFace { face: end - 1, count }),
            _ => Ok(()),
        }
    }

    fn check_instance(&self, number: u32) -> Result<(), Fault> {
        let is_there = self.classes.contains_key(&number);
        if is_there {
            Ok(())
        } else {
            Err(Fault::UnknownInstance { number })
        }
    }

    fn check_new_instance(&self, number: u32) -> Result<(), Fault> {
        let next = self.next_instance;
        following(number, next)
            .map(drop)
            .ok_or(Fault::InstanceNumber { number, next })
    }

    fn room(&self, number: u32) -> Result<&Room, Fault> {
        self.rooms.get(&number).ok_or(Fault::UnknownRoom { number })
    }

    fn check_new_room(&self, number: u32) -> Result<(), Fault> {
        let next = self.next_room;
        following(number, next)
            .map(drop)
            .ok_or(Fault::RoomNumber { number, next })
    }
}

/// Returns the number after a new one, or `None` if the new one is below the `next` or too large.
fn following(number: u32, next: u32) -> Option<u32> {
    (next..=MAX_NUMBER).contains(&number).then(|| number + 1)
}

fn nothing_if(is_so: bool, why: &'static str) -> Result<(), Fault> {
    if is_so { Err(Fault::Nothing { why }) } else { Ok(()) }
}

fn its_turn(of: u64, turn: Option<u64>, what: &'static str) -> Result<(), Fault> {
    if turn == Some(of) {
        Ok(())
    } else {
        Err(Fault::NotItsTurn { of, what, turn })
    }
}
