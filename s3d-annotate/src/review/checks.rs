//! What looks wrong.

use super::Review;
use super::cells::{Cell, column};
use super::pieces::{Piece, pieces};
use super::viewpoint::{numbers, view_of};
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Pieces below this are crumbs, m².
const LEAST_PIECE_M2: f64 = 0.01;

/// Unlabelled patches below this are crumbs, m².
const LEAST_OPEN_M2: f64 = 0.05;

/// So much of a floor lies over something before it is a mistake, m².
const LEAST_ABOVE_M2: f64 = 0.05;

/// A floor is so far above what is under it before that counts, metres. Below lies its own noise.
const ABOVE_M: f32 = 0.15;

/// Nobody could stand between a floor and a floor less than this above it, metres.
const STOREY_M: f32 = 1.9;

/// Surface is level with at least this much of its normal along z.
const LEVEL: f32 = 0.7;

/// An instance is in two rooms if the second has at least so much of it, m² and as a share.
const LEAST_IN_ROOM_M2: f64 = 0.03;
const LEAST_IN_ROOM: f64 = 0.1;

/// Words in the names of classes that may be in pieces: furniture hides and divides them.
const DIVIDED: [&str; 4] = ["ceiling", "floor", "wall", "beam"];

/// Words in the names of classes that lie between rooms.
const BETWEEN: [&str; 8] = ["wall", "door", "window", "column", "pillar", "beam", "opening", "curtain"];

/// Words in the names of classes that lie under the floor of the next storey.
const UNDER_A_STOREY: [&str; 7] = ["ceiling", "beam", "wall", "door", "window", "column", "pillar"];

/// Something that looks wrong.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    /// What kind of mistake it may be.
    pub kind: CheckKind,
    /// A sentence.
    pub text: String,
    /// Where it is: a place on the surface, world metres.
    pub at: [f64; 3],
    /// A place from which it is seen, world metres.
    pub from: [f64; 3],
    /// The instance that it is about, if it is about one.
    pub instance: Option<u32>,
}

/// A kind of mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum CheckKind {
    /// An instance is in pieces more than about 5 cm apart.
    TwoPieces,
    /// A floor lies above a piece of furniture, or above another floor where nobody could stand between them.
    FloorAbove,
    /// An instance is in two rooms.
    TwoRooms,
    /// A room has no type.
    NoType,
    /// Patches have no label.
    Unlabelled,
}

/// A check without a viewpoint, and the faces that it is about.
type Finding = (CheckKind, String, Option<u32>, Vec<u32>);

impl Review<'_> {
    /// Returns what looks wrong, kind by kind, by instance in each.
    ///
    /// - An instance in pieces of at least 0.01 m² that are more than about 5 cm apart. Floors, ceilings,
    ///   walls and beams may be: furniture divides what a scanner sees of them.
    /// - At least 0.05 m² of a floor with something labelled under it, 0.15 to 1.9 m lower: the top of a
    ///   table. Under the floor of an upper storey comes a ceiling, a beam or a wall first.
    /// - An instance with at least 0.03 m² and a tenth of itself in a second room. Walls, doors, windows,
    ///   columns, beams and curtains may lie between rooms.
    /// - A room that holds labels and has no type: an export leaves them out.
    /// - Segments with more than 0.05 m² without a label; neighbours make one check.
    pub fn checks(&self) -> Vec<Check> {
        let mut faces_of: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (face, &instance) in (0u32..).zip(self.state.instance_of_face()) {
            faces_of.entry(instance).or_default().push(face);
        }
        faces_of.remove(&0);

        let mut findings = self.in_pieces(&faces_of);
        findings.extend(self.floors_above());
        if !self.state.rooms().is_empty() {
            let room_of_face = self.state.room_of_face(self.mesh);
            findings.extend(self.in_two_rooms(&faces_of, &room_of_face));
            findings.extend(self.without_type(&room_of_face));
        }
        findings.extend(self.unlabelled());
        findings
            .into_par_iter()
            .map(|(kind, text, instance, faces)| {
                let view = view_of(self.mesh, self.surroundings, &faces);
                Check { kind, text, at: numbers(view.at), from: numbers(view.from), instance }
            })
            .collect()
    }

    /// The name of an instance, such as `chair_3`.
    fn names(&self) -> impl Fn(u32) -> String {
        let names = self.state.instance_names();
        move |instance| names.get(&instance).cloned().unwrap_or_default()
    }

    fn is_one_of(&self, instance: u32, words: &[&str]) -> bool {
        let class = self.state.instances().get(&instance).map(|class| class.to_lowercase());
        class.is_some_and(|class| words.iter().any(|word| class.contains(word)))
    }

    fn in_pieces(&self, faces_of: &BTreeMap<u32, Vec<u32>>) -> Vec<Finding> {
        let name = self.names();
        let instances: Vec<(&u32, &Vec<u32>)> = faces_of
            .iter()
            .filter(|(instance, _)| !self.is_one_of(**instance, &DIVIDED))
            .collect();
        let found: Vec<Option<(u32, Vec<Piece>)>> = instances
            .into_par_iter()
            .map(|(instance, faces)| {
                let mut pieces = pieces(self.mesh, &self.surroundings.cells, faces);
                pieces.retain(|piece| piece.area_m2 >= LEAST_PIECE_M2);
                (pieces.len() > 1).then_some((*instance, pieces))
            })
            .collect();
        let texts = found.into_iter().flatten().map(|(instance, pieces)| {
            let [first, second] = [0, 1].map(|i| pieces.get(i).map_or(0.0, |piece| piece.area_m2));
            let count = pieces.len();
            let name = name(instance);
            let text = format!(
                "{name} is in {count} pieces that do not touch, the largest of {first:.2} and {second:.2} m²"
            );
            let smaller = pieces.into_iter().nth(1).map_or_else(Vec::new, |piece| piece.faces);
            (CheckKind::TwoPieces, text, Some(instance), smaller)
        });
        texts.collect()
    }

    fn floors_above(&self) -> Vec<Finding> {
        let cells = &self.surroundings.cells;
        let of_face = self.state.instance_of_face();
        let is_floor = |instance: u32| {
            self.state
                .instances()
                .get(&instance)
                .is_some_and(|class| class == "floor")
        };
        let floors: BTreeMap<u32, bool> = self
            .state
            .instances()
            .keys()
            .map(|instance| (*instance, is_floor(*instance)))
            .collect();
        let is_under_a_storey: BTreeMap<u32, bool> = (self.state.instances().keys())
            .map(|instance| (*instance, self.is_one_of(*instance, &UNDER_A_STOREY)))
            .collect();

        // What is labelled in each column, from below.
        let labelled = (0u32..).zip(of_face).filter(|(_, instance)| **instance != 0);
        let mut all: Vec<(Cell, u32, u32)> = labelled
            .flat_map(|(face, instance)| cells.of(face).iter().map(move |cell| (*cell, *instance, face)))
            .collect();
        all.par_sort_unstable();

        let gap = (ABOVE_M / cells.edge_m).ceil() as u64;
        let reach = (STOREY_M / cells.edge_m) as u64;
        let mut above: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for column_of in all.chunk_by(|a, b| column(a.0).0 == column(b.0).0) {
            for (i, &(cell, instance, face)) in column_of.iter().enumerate() {
                let is_floor = floors.get(&instance).is_some_and(|is| *is);
                if !is_floor || self.mesh.normal(face).z.abs() < LEVEL {
                    continue;
                }
                let height = |cell: Cell| column(cell).1;
                let under = column_of[..i]
                    .iter()
                    .rev()
                    .find(|under| height(under.0) + gap <= height(cell));
                let Some(&(under, other, _)) = under else { continue };
                let is_near = height(under) + reach >= height(cell);
                if is_near && !is_under_a_storey.get(&other).is_some_and(|is| *is) {
                    above.entry(instance).or_default().push(face);
                }
            }
        }

        let name = self.names();
        let mut findings = Vec::new();
        for (instance, mut faces) in above {
            faces.sort_unstable();
            faces.dedup();
            for piece in pieces(self.mesh, cells, &faces) {
                if piece.area_m2 >= LEAST_ABOVE_M2 {
                    let (name, area_m2) = (name(instance), piece.area_m2);
                    let text =
                        format!("{area_m2:.2} m² of {name} lie above something else, like a table top");
                    findings.push((CheckKind::FloorAbove, text, Some(instance), piece.faces));
                }
            }
        }
        findings
    }

    fn without_type(&self, room_of_face: &[u32]) -> Vec<Finding> {
        let rooms = self.state.rooms().iter().filter(|(_, room)| room.kind.is_none());
        let mut faces_in: BTreeMap<u32, Vec<u32>> = rooms.map(|(room, _)| (*room, Vec::new())).collect();
        let labelled = self.state.instance_of_face().iter().zip(room_of_face);
        for (face, (_, room)) in (0u32..).zip(labelled).filter(|(_, (instance, _))| **instance != 0) {
            if let Some(faces) = faces_in.get_mut(room) {
                faces.push(face);
            }
        }

        let with_labels = faces_in.into_iter().filter(|(_, faces)| !faces.is_empty());
        let findings = with_labels.map(|(room, faces)| {
            let text = format!("room {room} has no type: an export leaves its labels out");
            (CheckKind::NoType, text, None, faces)
        });
        findings.collect()
    }

    fn in_two_rooms(&self, faces_of: &BTreeMap<u32, Vec<u32>>, room_of_face: &[u32]) -> Vec<Finding> {
        let room_names = self.state.room_names();
        let room_name = |room: u32| room_names.get(&room).cloned().unwrap_or_else(|| format!("room {room}"));
        let name = self.names();

        let mut findings = Vec::new();
        for (&instance, faces) in faces_of
            .iter()
            .filter(|(instance, _)| !self.is_one_of(**instance, &BETWEEN))
        {
            let mut in_room: BTreeMap<u32, Piece> = BTreeMap::new();
            for &face in faces {
                let empty = || Piece { faces: Vec::new(), area_m2: 0.0 };
                let piece = in_room.entry(room_of_face[face as usize]).or_insert_with(empty);
                piece.faces.push(face);
                piece.area_m2 += self.mesh.area(face);
            }
            in_room.remove(&0);
            let mut rooms: Vec<(u32, Piece)> = in_room.into_iter().collect();
            rooms.sort_by(|a, b| b.1.area_m2.total_cmp(&a.1.area_m2));

            let all_m2: f64 = rooms.iter().map(|(_, piece)| piece.area_m2).sum();
            let least_m2 = LEAST_IN_ROOM_M2.max(LEAST_IN_ROOM * all_m2);
            let second = rooms
                .iter()
                .position(|(_, piece)| piece.area_m2 < least_m2)
                .unwrap_or(rooms.len());
            rooms.truncate(second);
            let mut rooms = rooms.into_iter();
            if let (Some((first, _)), Some((second, piece))) = (rooms.next(), rooms.next()) {
                let [first, second] = [first, second].map(room_name);
                let (name, area_m2) = (name(instance), piece.area_m2);
                let text = format!("{name} is in {first}, and {area_m2:.2} m² of it in {second}");
                findings.push((CheckKind::TwoRooms, text, Some(instance), piece.faces));
            }
        }
        findings
    }

    fn unlabelled(&self) -> Vec<Finding> {
        let open_m2 = self.open_areas();
        let of_face = self.state.instance_of_face();
        let mut faces: Vec<u32> = (0..self.segments.tree.leaf_count())
            .filter(|segment| open_m2[*segment as usize] > LEAST_OPEN_M2)
            .flat_map(|segment| self.surroundings.open_faces(self.segments, segment, of_face))
            .collect();
        faces.sort_unstable();

        let found = pieces(self.mesh, &self.surroundings.cells, &faces)
            .into_iter()
            .map(|piece| {
                // The place is on the largest patch.
                let mut patches: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
                for face in piece.faces {
                    patches
                        .entry(self.segments.segment_of_face[face as usize])
                        .or_default()
                        .push(face);
                }
                let count = patches.len();
                let area_m2 = piece.area_m2;
                let text = match count {
                    1 => format!("{area_m2:.2} m² have no label"),
                    _ => format!("{area_m2:.2} m² have no label, in {count} patches side by side"),
                };
                let largest = patches.into_iter().max_by(|a, b| {
                    open_m2[a.0 as usize]
                        .total_cmp(&open_m2[b.0 as usize])
                        .then(b.0.cmp(&a.0))
                });
                (CheckKind::Unlabelled, text, None, largest.map_or_else(Vec::new, |(_, faces)| faces))
            });
        found.collect()
    }
}
