//! Checks whether a data set would be useful: what looks wrong in a scene, and what stops an export of it.
//!
//! Each [`Finding`] belongs to a [`Condition`]. Beyond a limit it stops an export unless the caller allows
//! the condition; within the limit it is a warning. `info` and `export` have the same findings.

mod estimate;
mod headroom;

pub use estimate::Estimate;
pub(crate) use estimate::{PLY_POINT_BYTES, check_points, check_space, size_findings, space_findings};
pub(crate) use headroom::Headroom;
pub use headroom::Storey;

use crate::condition::Condition;
use crate::context::Context;
use crate::error::{InputError, Result};
use crate::record::manifest::half_step;
use crate::survey::annotated::{Annotated, SurveyedRoom};
use crate::survey::outlook::{LOW_COVERAGE, Outlook};
use s3d_geom::{Aabb, TriMesh};
use s3d_label::{Class, LabelId, LabelTable, VoteReport};

/// Something that looks wrong.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Finding {
    condition: Condition,
    /// Whether the data set would be useless.
    stops: bool,
    /// A sentence for the user.
    text: String,
}

impl Finding {
    fn new(condition: Condition, stops: bool, text: String) -> Self {
        Self { condition, stops, text }
    }

    /// Returns the sentence.
    pub(crate) fn text(&self) -> String {
        self.text.clone()
    }

    /// Returns the sentence of `info`.
    pub(crate) fn sentence(&self) -> String {
        let Self { condition, stops, text } = self;
        if *stops {
            format!("{text}; an export stops here unless {condition} is allowed")
        } else {
            text.clone()
        }
    }
}

/// Warns about the findings, unless one of them stops the export and is not allowed.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) with all findings that stop it.
pub(crate) fn judge(ctx: &Context, findings: &[Finding], allowed: &[Condition]) -> Result<()> {
    judge_of(("the data set", "export it"), ctx, findings, allowed)
}

/// Judges like [`judge`], but for something other than a data set: `what` it is, and the `action` on it.
pub(crate) fn judge_of(
    (what, action): (&'static str, &'static str),
    ctx: &Context,
    findings: &[Finding],
    allowed: &[Condition],
) -> Result<()> {
    let (stopping, others): (Vec<&Finding>, Vec<&Finding>) = findings
        .iter()
        .partition(|f| f.stops && !allowed.contains(&f.condition));
    others.iter().for_each(|f| ctx.warn(&f.text));

    if stopping.is_empty() {
        return Ok(());
    }

    let mut conditions: Vec<Condition> = stopping.iter().map(|f| f.condition).collect();
    conditions.sort_unstable();
    conditions.dedup();

    Err(InputError::Useless {
        what,
        action,
        reasons: stopping.iter().map(|f| f.text.clone()).collect(),
        conditions,
    }
    .into())
}

/// Returns whether a finding would stop an export that allows nothing.
pub(crate) fn stops_any(findings: &[Finding]) -> bool {
    findings.iter().any(|f| f.stops)
}

/// Returns a share as a whole percentage.
fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Returns what looks wrong about the place, size and colours of a mesh. `makes_rgb` says whether the mesh
/// colours the images.
pub(crate) fn mesh_findings(mesh: &TriMesh, makes_rgb: bool) -> Vec<Finding> {
    /// The largest number that a half float can hold.
    const LARGEST_HALF_M: f32 = 65_504.0;
    const UNITS: &str = "the option units of a mesh, or units = \"cm\" under [mesh], says another unit";

    let mut findings = Vec::new();
    let bbox = mesh.aabb();
    let length = bbox.size().max_element();
    let farthest = bbox.min.abs().max(bbox.max.abs()).max_element();

    if length > 1000.0 {
        let text = format!("the mesh is {length:.0} m long: is it in metres? ({UNITS})");
        findings.push(Finding::new(Condition::Scale, length > 3000.0, text));
    }
    if length < 0.5 {
        let text = format!("the mesh is only {:.1} cm long: is it in metres? ({UNITS})", 100.0 * length);
        findings.push(Finding::new(Condition::Scale, length < 0.1, text));
    }

    let moving = "give [mesh] offset_m, or move mesh, points and cameras nearer to it";
    if farthest > LARGEST_HALF_M {
        let text = format!(
            "the mesh lies {farthest:.0} m from the origin: half floats of world coordinates end at 65504; \
             {moving}"
        );
        findings.push(Finding::new(Condition::Scale, false, text));
    } else if farthest > 1000.0 {
        let text = format!(
            "the mesh lies {farthest:.0} m from the origin: half floats of world coordinates step by {} m \
             there; {moving}",
            half_step(farthest)
        );
        findings.push(Finding::new(Condition::Scale, false, text));
    }

    if makes_rgb && !has_colors(mesh) {
        let text = "the mesh has no texture and no colours, so that its RGB images would be flat: leave rgb \
                    out of the modalities, name the scanner's pictures, or write colors = \"points\" under \
                    [mesh] if annotated points have colours";
        findings.push(Finding::new(Condition::Colour, true, text.to_owned()));
    }

    findings
}

/// Returns whether a mesh has more than one colour.
fn has_colors(mesh: &TriMesh) -> bool {
    if !mesh.textures().is_empty() || !mesh.parts().colors.is_empty() {
        return true;
    }
    let mut colors = (0..mesh.faces().len() as u32)
        .map(|f| mesh.material_of(f).map(|m| mesh.materials()[m as usize].color));
    let first = colors.next();
    colors.any(|color| Some(color) != first)
}

/// Returns what looks wrong between mesh and annotations.
pub(crate) fn label_findings(mesh: &TriMesh, annotated: &Annotated, table: &LabelTable) -> Vec<Finding> {
    let mut findings = vote_findings(&annotated.report);
    findings.extend(level_finding(mesh, &annotated.label_of_face, table));
    findings.extend(room_findings(&annotated.rooms));
    findings
}

fn vote_findings(report: &VoteReport) -> Vec<Finding> {
    let mut findings = Vec::new();
    let far = report.total.far_points as f64 / report.total.points.max(1) as f64;
    if far > 0.05 {
        let text = format!(
            "{} of the annotated points are farther than 5 cm from every face: do mesh and annotations share \
             a frame? see `up` in the scene file, or let `s3d align` find where one lies in the other",
            percent(far)
        );
        findings.push(Finding::new(Condition::Frame, far > 0.5, text));
    }
    let labelled = report.total.faces as f64 / report.face_count.max(1) as f64;
    if labelled < 0.5 {
        let text = format!(
            "only {} of the faces get a label: the others are written as {}",
            percent(labelled),
            s3d_label::NULL_NAME
        );
        findings.push(Finding::new(Condition::Labels, labelled < 0.05, text));
    }
    findings
}

/// Checks that floors and ceilings are level, as they are if the right axis points up.
fn level_finding(mesh: &TriMesh, label_of_face: &[LabelId], table: &LabelTable) -> Option<Finding> {
    /// The cosine of 30°.
    const LEVEL: f32 = 0.866;

    let mut level_m2 = 0.0;
    let mut all_m2 = 0.0;
    for (face, label) in (0u32..).zip(label_of_face) {
        let class = table.get(*label).map(|label| label.class.s3dis());
        if matches!(class, Some(Class::FLOOR | Class::CEILING)) {
            let area_m2 = mesh.area(face);
            all_m2 += area_m2;
            if mesh.normal(face).z.abs() > LEVEL {
                level_m2 += area_m2;
            }
        }
    }

    let share = level_m2 / all_m2;
    // Without floors and ceilings the share is NaN, which is not less than anything.
    (share < 0.5).then(|| {
        let text = format!(
            "only {} of the floors and ceilings are level: does another axis point up? see `up` in the scene \
             file",
            percent(share)
        );
        Finding::new(Condition::Up, share < 0.25, text)
    })
}

fn room_findings(rooms: &[SurveyedRoom]) -> Vec<Finding> {
    let mut findings = Vec::new();
    if let Some(height_m) = median(rooms, |room| f64::from(room.bbox.size().z))
        && height_m > 5.0
    {
        let text = format!("rooms are {height_m:.1} m high: are points and mesh in metres, not in feet?");
        findings.push(Finding::new(Condition::Scale, height_m > 8.0, text));
    }
    if let Some(floor_m2) = median(rooms, |room| room.footprint.area_m2)
        && floor_m2 > 2000.0
    {
        let text = format!("rooms have {floor_m2:.0} m² of floor: are points and mesh in metres?");
        findings.push(Finding::new(Condition::Scale, floor_m2 > 10_000.0, text));
    }
    findings
}

/// Returns what looks wrong about the number of scan locations. `count` may be the number that would be
/// placed.
pub(crate) fn count_findings(count: f64, rooms: &[SurveyedRoom]) -> Vec<Finding> {
    let floor_m2: f64 = rooms.iter().map(|r| r.footprint.area_m2).sum();
    let per_m2 = count / floor_m2.max(1.0);
    if count <= 100.0 || per_m2 <= 1.0 {
        return Vec::new();
    }
    let text = format!(
        "{count:.0} scan locations on {floor_m2:.0} m² of floor are many: the published data set has one on \
         4 m²"
    );
    vec![Finding::new(Condition::Locations, count > 1000.0 && per_m2 > 4.0, text)]
}

/// Returns what looks wrong about the views of a camera list, if `blind` of them see nothing of the mesh.
pub(crate) fn poses_findings(
    blind: u64,
    views: u64,
    cameras: &Aabb,
    mesh: &Aabb,
    hint: &str,
) -> Vec<Finding> {
    if blind == 0 {
        return Vec::new();
    }

    let [a, b, c, d] = [cameras.min, cameras.max, mesh.min, mesh.max];
    let boxes = format!("cameras stand between {a} and {b}, the mesh lies between {c} and {d} (Z-up metres)");
    let text = if blind == views {
        format!("no camera sees anything: {boxes}. Do they share a frame and a unit? See {hint}")
    } else {
        format!("{blind} of {views} cameras see nothing of the mesh; {boxes}")
    };
    vec![Finding::new(Condition::Coverage, blind == views, text)]
}

/// Returns what looks wrong about the view of all scan locations together.
pub(crate) fn outlook_findings(outlooks: &[Outlook]) -> Vec<Finding> {
    let mut findings = Vec::new();
    let count = outlooks.len().max(1) as f64;
    let coverage = outlooks.iter().map(|o| o.coverage).sum::<f64>() / count;
    let back_sides = outlooks.iter().map(|o| o.coverage * o.back_sides).sum::<f64>() / count / coverage;

    if coverage < LOW_COVERAGE {
        let text = format!(
            "scan locations see the mesh in {} of all directions: are they in its frame, and inside?",
            percent(coverage)
        );
        findings.push(Finding::new(Condition::Coverage, true, text));
    }
    if back_sides > 0.5 {
        let text = format!(
            "{} of what scan locations see are back sides: the faces are wound the other way, or the \
             locations stand in walls",
            percent(back_sides)
        );
        findings.push(Finding::new(Condition::InsideOut, back_sides > 0.75, text));
    }
    findings
}

/// The median of a value over the rooms that have points.
fn median(rooms: &[SurveyedRoom], of: impl Fn(&SurveyedRoom) -> f64) -> Option<f64> {
    let mut values: Vec<f64> = rooms.iter().filter(|room| room.points > 0).map(of).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
