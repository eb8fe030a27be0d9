//! Sets of faces as runs of neighbouring numbers.

use serde::de::{Deserialize, Deserializer, Error};
use serde::ser::{Serialize, Serializer};
use std::ops::Range;

/// A set of faces of a mesh: runs of neighbouring numbers, ascending, with gaps between them.
///
/// As data it is a list of numbers in pairs: how many faces are left out after the last run, and how many
/// belong to the next. A wall of 100,000 neighbouring faces is two numbers, and a face that stands alone
/// takes two small ones. Lists with a last gap alone, an empty run or a face beyond `u32` are refused.
///
/// ```
/// use s3d_annotate::labelling::FaceRuns;
///
/// let faces: FaceRuns = [5, 3, 4, 9, 3].into_iter().collect();
/// assert_eq!((faces.len(), faces.end()), (4, 10));
/// assert!(faces.contains(9) && !faces.contains(6));
/// assert_eq!(faces.iter().collect::<Vec<_>>(), [3, 4, 5, 9]);
/// assert_eq!(serde_json::to_string(&faces)?, "[3,3,3,1]");
/// assert_eq!(serde_json::from_str::<FaceRuns>("[3,3,3,1]")?, faces);
/// assert!(serde_json::from_str::<FaceRuns>("[3,0]").is_err());
/// # Ok::<(), serde_json::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FaceRuns {
    runs: Vec<Range<u32>>,
}

impl FaceRuns {
    /// Returns the faces of a range.
    pub fn of_range(range: Range<u32>) -> Self {
        Self { runs: Vec::from_iter((!range.is_empty()).then_some(range)) }
    }

    /// Returns whether the set has no face.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// Returns the number of faces.
    pub fn len(&self) -> u32 {
        self.runs.iter().map(|run| run.end - run.start).sum()
    }

    /// Returns the face behind the last one, or 0 without faces.
    pub fn end(&self) -> u32 {
        self.runs.last().map_or(0, |run| run.end)
    }

    /// Returns whether a face is in the set.
    pub fn contains(&self, face: u32) -> bool {
        let run = self.runs.partition_point(|run| run.end <= face);
        self.runs.get(run).is_some_and(|run| run.start <= face)
    }

    /// Returns the runs, ascending.
    pub fn runs(&self) -> &[Range<u32>] {
        &self.runs
    }

    /// Iterates over the faces, ascending.
    pub fn iter(&self) -> impl Iterator<Item = u32> {
        self.runs.iter().cloned().flatten()
    }

    /// Adds a face that is not below the last one.
    pub(super) fn push(&mut self, face: u32) {
        match self.runs.last_mut() {
            Some(run) if run.end > face => {}
            Some(run) if run.end == face => run.end += 1,
            _ => self.runs.push(face..face + 1),
        }
    }
}

impl FromIterator<u32> for FaceRuns {
    /// Takes faces in any order, each any number of times.
    ///
    /// # Panics
    /// If a face is `u32::MAX`, which no mesh has.
    fn from_iter<T: IntoIterator<Item = u32>>(faces: T) -> Self {
        let mut faces: Vec<u32> = faces.into_iter().collect();
        assert!(!faces.contains(&u32::MAX), "no mesh has face {}", u32::MAX);
        faces.sort_unstable();

        let mut runs = Self::default();
        faces.into_iter().for_each(|face| runs.push(face));
        runs
    }
}

impl Serialize for FaceRuns {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut before = 0;
        serializer.collect_seq(self.runs.iter().flat_map(|run| {
            let gap = run.start - before;
            before = run.end;
            [gap, run.end - run.start]
        }))
    }
}

impl<'de> Deserialize<'de> for FaceRuns {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<u32>::deserialize(deserializer)?;
        let (pairs, rest) = numbers.as_chunks::<2>();
        if !rest.is_empty() {
            return Err(D::Error::custom("faces are pairs of numbers: a gap and a run"));
        }

        let mut runs = Vec::with_capacity(pairs.len());
        let mut before = 0u32;
        for (place, &[gap, length]) in pairs.iter().enumerate() {
            if length == 0 || (gap == 0 && place > 0) {
                return Err(D::Error::custom("faces have an empty run, or no gap between two runs"));
            }
            let run = before
                .checked_add(gap)
                .and_then(|start| Some(start..start.checked_add(length)?));
            let run = run.ok_or_else(|| D::Error::custom("faces have numbers beyond 32 bits"))?;
            before = run.end;
            runs.push(run);
        }
        Ok(Self { runs })
    }
}
