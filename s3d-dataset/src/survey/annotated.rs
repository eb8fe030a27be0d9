//! The result of annotations for an area's mesh and rooms.

use crate::summary::{Surface, Unlabelled};
use crate::survey::columns::Columns;
use crate::survey::strays::Strays;
use s3d_geom::{Aabb, Footprint, TriMesh};
use s3d_label::{LabelId, Room, VoteReport, fill_labels};
use serde::{Deserialize, Serialize};

/// An annotated area.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Annotated {
    /// The label of each face of the mesh. [`LabelId::NULL`] where no point voted and nothing was filled.
    /// Stored in a file of its own.
    #[serde(skip)]
    pub(crate) label_of_face: Vec<LabelId>,
    /// The filled faces, which have a label without a vote, in ascending order. Stored in the same file.
    #[serde(skip)]
    pub(crate) filled: Vec<u32>,
    /// The surface without votes, and without a label.
    pub(crate) unlabelled: Unlabelled,
    pub(crate) report: VoteReport,
    /// The rooms, in the order of their names.
    pub(crate) rooms: Vec<SurveyedRoom>,
    /// The number of annotated points.
    pub(crate) points: u64,
    #[serde(skip)]
    pub(crate) skipped: SkippedLines,
    #[serde(skip)]
    pub(crate) strays: Strays,
}

impl Annotated {
    /// Gives unlabelled faces the label of the surface next to them, if a distance is given.
    pub(crate) fn fill(&mut self, mesh: &TriMesh, within_m: Option<f64>) {
        let without_votes = unlabelled_surface(mesh, &self.label_of_face);
        if let Some(within_m) = within_m {
            self.filled = fill_labels(mesh, &mut self.label_of_face, within_m);
        }
        let without_label = unlabelled_surface(mesh, &self.label_of_face);
        self.unlabelled = Unlabelled { without_votes, without_label };
    }
}

/// Returns the faces with the null label, as a number and an area.
fn unlabelled_surface(mesh: &TriMesh, labels: &[LabelId]) -> Surface {
    let mut sum = Surface::default();
    for (face, _) in (0u32..).zip(labels).filter(|(_, label)| label.is_null()) {
        sum += Surface { faces: 1, m2: mesh.area(face), pixels: None };
    }
    sum
}

/// What lenient reading left out of instance files, and what was mended in them.
#[derive(Debug, Default)]
pub(crate) struct SkippedLines {
    pub(crate) lines: u64,
    pub(crate) empty_instances: u64,
    /// The first place where something was left out.
    pub(crate) first: Option<String>,
    /// The number of lines with control characters within numbers.
    pub(crate) mended: u64,
    /// The place of the first of them.
    pub(crate) first_mended: Option<String>,
}

impl SkippedLines {
    /// Returns a sentence on what was left out, and one on what was mended.
    pub(crate) fn sentences(&self) -> Vec<String> {
        let left_out = self.first.as_ref().map(|first| {
            format!(
                "{} lines of annotations and {} instances without points left out, the first: {first}",
                self.lines, self.empty_instances
            )
        });
        let mended = self.first_mended.as_ref().map(|first| {
            format!(
                "{} lines of annotations have control characters within numbers, and are read without \
                 them, the first: {first}",
                self.mended
            )
        });
        left_out.into_iter().chain(mended).collect()
    }
}

/// What the points and faces of a room tell about it.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SurveyedRoom {
    pub(crate) room: Room,
    pub(crate) points: u64,
    pub(crate) footprint: Footprint,
    /// The bounding box of its points.
    pub(crate) bbox: Aabb,
    /// The dominant horizontal direction of its walls, whole degrees in [0, 90).
    pub(crate) wall_direction_deg: u32,
    /// The heights of its points, place by place. Not stored.
    #[serde(skip)]
    pub(crate) columns: Columns,
}
