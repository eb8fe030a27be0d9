//! The rooms and instances of parts: what lies in two parts is one, and names stay unique.

mod extent;

use crate::error::{Error, InputError, Result};
use crate::export::input::area::{InstanceInput, RoomInput};
use crate::export::input::numbering::{named, number};
use extent::{InstanceExtent, RoomExtent};
use glam::DAffine3;
use s3d_geom::moved_point;
use s3d_io::cloud::{AnnotatedInstance, AnnotatedRoom, Annotations, InstanceReader, PlacedInstance};
use s3d_label::{Class, Label, Room, Taxonomy};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;

/// Rooms of one name are one if at least this share of the smaller one's floor plan lies in the other.
const SAME_NAME: f64 = 0.05;
/// Rooms of different names are one only if they mostly lie in each other.
const OTHER_NAME: f64 = 0.5;
/// Instances of one class and number are one if this share of the smaller one lies on the other.
const SAME_NUMBER: f64 = 0.05;
/// Instances of one class and different numbers.
const OTHER_NUMBER: f64 = 0.3;

/// The number of points that are read at a time.
const BLOCK_POINTS: usize = 1 << 18;

/// The rooms of a part.
pub(super) struct PartRooms {
    pub(super) path: PathBuf,
    pub(super) rooms: Vec<RoomInput>,
    pub(super) scene_from_part: DAffine3,
    /// See [`PlacedInstance::face_of_face`].
    pub(super) face_of_face: Arc<[u32]>,
}

/// The rooms of all parts.
pub(super) struct JoinedRooms {
    pub(super) rooms: Vec<RoomInput>,
    /// For each part the rooms that have other names now.
    pub(super) new_rooms: Vec<BTreeMap<Room, Room>>,
    /// Which rooms are one, and which have got another name, a sentence each.
    pub(super) notes: Vec<String>,
}

/// A room of the parts so far.
struct Joined {
    room: Room,
    extent: RoomExtent,
    instances: Vec<JoinedInstance>,
}

struct JoinedInstance {
    label: Label,
    number_in_room: u32,
    extent: InstanceExtent,
    parts: Vec<PlacedInstance>,
}

/// Joins the rooms of parts of the area `area`. If the parts are of one published area, names decide, and
/// stay. Otherwise places decide.
pub(super) fn join_rooms(area: u32, parts: Vec<PartRooms>, keep_names: bool) -> Result<JoinedRooms> {
    let mut joined: Vec<Joined> = Vec::new();
    let mut new_rooms = Vec::new();
    let mut notes = Vec::new();
    let has_one = parts.iter().filter(|part| !part.rooms.is_empty()).count() < 2;
    for part in parts {
        let path = part.path.display().to_string();
        let rooms = opened(part, keep_names || has_one)?;
        let mut renamed = BTreeMap::new();
        let partner = partners(&rooms, &joined, |room, other| room.likeness(other, keep_names));
        let before: BTreeSet<Room> = joined.iter().map(|room| room.room).collect();
        let mut taken = before.clone();
        let alone = rooms.iter().zip(&partner).filter(|(_, partner)| partner.is_none());
        taken.extend(alone.map(|(room, _)| room.room));

        for (mut room, partner) in rooms.into_iter().zip(partner) {
            let name = room.room;
            match partner {
                Some(at) => {
                    let other: &mut Joined = &mut joined[at];
                    let known = if other.room == name {
                        "is also in the parts before it".to_owned()
                    } else {
                        format!("is {} of the parts before it", other.room)
                    };
                    notes.push(format!("{path}: {name} {known}"));
                    renamed.insert(name, other.room);
                    other.take(room, keep_names);
                }
                None => {
                    if before.contains(&name) {
                        room.room = free_name(name, &taken);
                        taken.insert(room.room);
                        notes.push(format!("{path}: {name} is another room than before, now {}", room.room));
                        renamed.insert(name, room.room);
                    }
                    joined.push(room);
                }
            }
        }
        new_rooms.push(renamed);
    }
    Ok(JoinedRooms { rooms: labelled(area, joined, keep_names)?, new_rooms, notes })
}

/// The first name of the same type of room that is not taken.
fn free_name(name: Room, taken: &BTreeSet<Room>) -> Room {
    let mut numbers = (1..).map(|number| Room { number, ..name });
    numbers.find(|room| !taken.contains(room)).unwrap_or(name)
}

/// Opens the rooms of a part. Their points are read unless extents are not asked for.
fn opened(part: PartRooms, without_extents: bool) -> Result<Vec<Joined>> {
    let PartRooms { rooms, scene_from_part, face_of_face, .. } = part;
    let mut joined = Vec::new();
    for RoomInput { room, instances } in rooms {
        let mut extent = RoomExtent::default();
        let mut of_room = Vec::new();
        for InstanceInput { label, number_in_room, points } in instances {
            let mut of_instance = InstanceExtent::default();
            if !without_extents {
                InstanceReader::new(BLOCK_POINTS).read(&points, None, |block, _| {
                    for point in &block.positions {
                        let point = moved_point(&scene_from_part, *point);
                        extent.add(point);
                        of_instance.add(point);
                    }
                    Ok::<(), Error>(())
                })?;
            }
            let face_of_face = Arc::clone(&face_of_face);
            let placed = PlacedInstance { instance: points, scene_from_part, face_of_face };
            of_room.push(JoinedInstance { label, number_in_room, extent: of_instance, parts: vec![placed] });
        }
        extent.finish();
        joined.push(Joined { room, extent, instances: of_room });
    }
    Ok(joined)
}

/// For each of `new` the one of `old` that it is, each at most once: the likest pairs first.
fn partners<T>(new: &[T], old: &[T], likeness: impl Fn(&T, &T) -> Option<[f64; 2]>) -> Vec<Option<usize>> {
    let mut pairs = Vec::new();
    for (i, a) in new.iter().enumerate() {
        for (j, b) in old.iter().enumerate() {
            pairs.extend(likeness(a, b).map(|likeness| (likeness, i, j)));
        }
    }
    pairs.sort_by(|a, b| b.0[0].total_cmp(&a.0[0]).then(b.0[1].total_cmp(&a.0[1])));

    let mut partner = vec![None; new.len()];
    let mut is_taken = vec![false; old.len()];
    for (_, i, j) in pairs {
        if partner[i].is_none() && !is_taken[j] {
            partner[i] = Some(j);
            is_taken[j] = true;
        }
    }
    partner
}

impl Joined {
    /// How like it is to a room of earlier parts; `None` if it is another one.
    fn likeness(&self, other: &Self, by_name: bool) -> Option<[f64; 2]> {
        let is_namesake = self.room == other.room;
        if by_name {
            return is_namesake.then_some([1.0; 2]);
        }
        let share = self.extent.share_in(&other.extent);
        let least = if is_namesake { SAME_NAME } else { OTHER_NAME };
        (share >= least).then_some([share, f64::from(u8::from(is_namesake))])
    }

    /// Adds what another part shows of the same room.
    fn take(&mut self, part: Self, by_name: bool) {
        self.extent.join(part.extent);
        let partner = partners(&part.instances, &self.instances, |a, b| a.likeness(b, by_name));
        let mut taken: BTreeSet<(Class, u32)> = BTreeSet::new();
        taken.extend(self.instances.iter().map(JoinedInstance::key));
        for (mut instance, partner) in part.instances.into_iter().zip(partner) {
            if let Some(at) = partner {
                let other = &mut self.instances[at];
                other.extent.join(instance.extent);
                other.parts.append(&mut instance.parts);
                continue;
            }
            while !taken.insert(instance.key()) {
                instance.number_in_room += 1;
            }
            self.instances.push(instance);
        }
    }
}

impl JoinedInstance {
    fn key(&self) -> (Class, u32) {
        (self.label.class, self.number_in_room)
    }

    /// How like it is to an instance of the same room in earlier parts; `None` if it is another one.
    fn likeness(&self, other: &Self, by_name: bool) -> Option<[f64; 2]> {
        if by_name {
            return (self.label == other.label).then_some([1.0; 2]);
        }
        if self.label.class != other.label.class {
            return None;
        }
        let [near, on] = self.extent.shares_on(&other.extent);
        let least = if self.number_in_room == other.number_in_room {
            SAME_NUMBER
        } else {
            OTHER_NUMBER
        };
        (near >= least).then_some([on, near])
    }
}

/// Gives instances their labels: those that they have, or numbered by area.
fn labelled(area: u32, joined: Vec<Joined>, keep_names: bool) -> Result<Vec<RoomInput>> {
    let mut labels: BTreeMap<(Room, Class, u32), Label> = BTreeMap::new();
    let mut rooms = Vec::new();
    for Joined { room, instances: of_room, .. } in joined {
        let mut instances = Vec::new();
        for JoinedInstance { label, number_in_room, parts, .. } in of_room {
            labels.insert((room, label.class, number_in_room), Label { area, ..label });
            instances.push(AnnotatedInstance::joined(label.class, number_in_room, parts));
        }
        rooms.push(AnnotatedRoom { room, instances });
    }

    let (warnings, companions) = (Vec::new(), Vec::new());
    let annotations = Annotations { taxonomy: Taxonomy::default(), rooms, warnings, companions };
    if keep_names {
        return Ok(named(annotations, &labels));
    }
    number(area, annotations).map_err(|e| InputError::Labels { why: e.to_string() }.into())
}
