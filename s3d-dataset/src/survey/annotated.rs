//! What annotations tell of an area's mesh and rooms.

use crate::summary::{Surface, Unlabelled};
use s3d_geom::{Aabb, Footprint, TriMesh};
use s3d_label::{LabelId, Room, VoteReport, fill_labels};
use serde::{Deserialize, Serialize};

/// An annotated area.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Annotated {
    /// The label of each face of the mesh; [`LabelId::NULL`] where no point voted and nothing was filled. As
    /// data it has a file of its own.
    #[serde(skip)]
    pub(crate) label_of_face: Vec<LabelId>,
    /// The faces that were filled: they have a label without a vote. Ascending; in that file too.
    #[serde(skip)]
    pub(crate) filled: Vec<u32>,
    /// What has no label.
    pub(crate) unlabelled: Unlabelled,
    pub(crate) report: VoteReport,
    /// The rooms, in the order of their names.
    pub(crate) rooms: Vec<SurveyedRoom>,
    /// Annotated points.
    pub(crate) points: u64,
    #[serde(skip)]
    pub(crate) skipped: SkippedLines,
}

impl Annotated {
    /// Gives faces without a label that of the surface next to them, if it is asked for.
    pub(crate) fn fill(&mut self, mesh: &TriMesh, within_m: Option<f64>) {
        let null = |labels: &[LabelId]| {
            let mut sum = Surface::default();
            for (face, _) in (0u32..).zip(labels).filter(|(_, label)| label.is_null()) {
                sum += Surface { faces: 1, m2: mesh.area(face), pixels: None };
            }
            sum
        };
        let without_votes = null(&self.label_of_face);
        if let Some(within_m) = within_m {
            self.filled = fill_labels(mesh, &mut self.label_of_face, within_m);
        }
        self.unlabelled = Unlabelled { without_votes, without_label: null(&self.label_of_face) };
    }
}

/// What a lenient reading left out of the files of instances.
#[derive(Debug, Default)]
pub(crate) struct SkippedLines {
    pub(crate) lines: u64,
    pub(crate) empty_instances: u64,
    /// The first place.
    pub(crate) first: Option<String>,
}

impl SkippedLines {
    /// A sentence on it, if there is something.
    pub(crate) fn sentence(&self) -> Option<String> {
        let first = self.first.as_ref()?;
        Some(format!(
            "{} lines of annotations and {} instances without points left out, the first: {first}",
            self.lines, self.empty_instances
        ))
    }
}

/// What is known of a room from its points and faces.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct SurveyedRoom {
    pub(crate) room: Room,
    pub(crate) points: u64,
    pub(crate) footprint: Footprint,
    /// The box of its points.
    pub(crate) bbox: Aabb,
    /// The dominant horizontal direction of its walls, whole degrees in [0, 90).
    pub(crate) wall_direction_deg: u32,
}
