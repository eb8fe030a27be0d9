//! A number for each face: which instance it belongs to, or for which room it was painted.

use super::face_runs::FaceRuns;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// The number of faces that belong to nothing.
pub(super) const NONE: u32 = 0;

/// Square micrometres in a square metre.
const UM2_PER_M2: f64 = 1e12;

/// The faces that an action gave to something else, and the number that they had before.
pub(super) type Stretch = (Range<u32>, u32);

/// A number for each face, with the faces and the area of each number.
#[derive(Clone, Debug)]
pub(super) struct Column {
    of_face: Vec<u32>,
    tallies: HashMap<u32, Tally>,
    /// The area of the faces before each face, and of all: square micrometres, modulo 2⁶⁴. Whole numbers
    /// make sums exact, so an undo leads back to the same sum.
    area_before: Arc<Vec<u64>>,
}

/// What belongs to a number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Tally {
    faces: u32,
    area_um2: u64,
    /// All its faces are in this range.
    span: Range<u32>,
}

/// Returns the area before each face: see [`Column`].
pub(super) fn sums_of(areas_m2: impl Iterator<Item = f64>) -> Vec<u64> {
    let mut sum = 0u64;
    let mut sums = vec![0];
    sums.extend(areas_m2.map(|area| {
        // The conversion saturates, and a NaN is 0.
        sum = sum.wrapping_add((area * UM2_PER_M2 + 0.5) as u64);
        sum
    }));
    sums
}

impl Column {
    /// Starts with faces that belong to nothing.
    pub(super) fn new(area_before: Arc<Vec<u64>>) -> Self {
        let faces = area_before.len().saturating_sub(1) as u32;
        let all = Tally { faces, area_um2: area_before.last().copied().unwrap_or(0), span: 0..faces };
        Self { of_face: vec![NONE; faces as usize], tallies: HashMap::from([(NONE, all)]), area_before }
    }

    /// Returns the number of each face.
    pub(super) fn of_face(&self) -> &[u32] {
        &self.of_face
    }

    /// Returns the faces and the area, m², that have a number.
    pub(super) fn tally(&self, number: u32) -> (u32, f64) {
        self.tallies
            .get(&number)
            .map_or((0, 0.0), |tally| (tally.faces, tally.area_um2 as f64 / UM2_PER_M2))
    }

    /// Returns the faces that have a number.
    pub(super) fn faces_of(&self, number: u32) -> FaceRuns {
        let span = self.tallies.get(&number).map_or(0..0, |tally| tally.span.clone());
        let mut faces = FaceRuns::default();
        for (face, &of) in span.clone().zip(self.part(&span)) {
            if of == number {
                faces.push(face);
            }
        }
        faces
    }

    /// Returns those of some faces that have a number.
    pub(super) fn among(&self, faces: &FaceRuns, number: u32) -> FaceRuns {
        let mut found = FaceRuns::default();
        for run in faces.runs() {
            for (face, &of) in run.clone().zip(self.part(run)) {
                if of == number {
                    found.push(face);
                }
            }
        }
        found
    }

    /// Returns whether all of some faces have a number.
    pub(super) fn all_have(&self, faces: &FaceRuns, number: u32) -> bool {
        faces
            .runs()
            .iter()
            .all(|run| self.part(run).iter().all(|&of| of == number))
    }

    /// Gives faces a number, and notes in `before` what those had that had another one.
    pub(super) fn set(&mut self, faces: &FaceRuns, number: u32, before: &mut Vec<Stretch>) {
        for run in faces.runs() {
            let first = before.len();
            let mut start = run.start;
            for same in self.part(run).chunk_by(|a, b| a == b) {
                let end = start + same.len() as u32;
                if let Some(&had) = same.first()
                    && had != number
                {
                    before.push((start..end, had));
                }
                start = end;
            }
            for (stretch, had) in before.iter().skip(first) {
                self.hand_over(stretch, *had, number);
            }
        }
    }

    /// Gives faces back what they had before. What was noted last comes first: a face may have changed twice.
    pub(super) fn restore(&mut self, before: &[Stretch]) {
        for (stretch, had) in before.iter().rev() {
            if let Some(&has) = self.of_face.get(stretch.start as usize) {
                self.hand_over(stretch, has, *had);
            }
        }
    }

    /// Gives neighbouring faces that all have one number another one.
    fn hand_over(&mut self, stretch: &Range<u32>, from: u32, to: u32) {
        let [start, end] = [stretch.start, stretch.end].map(|face| face as usize);
        let Some(part) = self.of_face.get_mut(start..end) else { return };
        part.fill(to);

        let before = |face: usize| self.area_before.get(face).copied().unwrap_or(0);
        let area = before(end).wrapping_sub(before(start));
        let faces = stretch.end - stretch.start;

        let loser = self.tallies.entry(from).or_default();
        loser.faces = loser.faces.saturating_sub(faces);
        loser.area_um2 = loser.area_um2.wrapping_sub(area);
        if loser.faces == 0 {
            self.tallies.remove(&from);
        }

        let winner = self.tallies.entry(to).or_default();
        winner.span = match winner.faces {
            0 => stretch.clone(),
            _ => winner.span.start.min(stretch.start)..winner.span.end.max(stretch.end),
        };
        winner.faces += faces;
        winner.area_um2 = winner.area_um2.wrapping_add(area);
    }

    /// The numbers of neighbouring faces; none if the mesh does not have them all.
    fn part(&self, run: &Range<u32>) -> &[u32] {
        self.of_face
            .get(run.start as usize..run.end as usize)
            .unwrap_or_default()
    }
}
