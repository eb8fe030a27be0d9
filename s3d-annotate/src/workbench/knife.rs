//! Which faces of a patch a knife cuts out.

use super::gesture::Knife;
use crate::labelling::{FaceRuns, Fault};
use crate::segments::{FaceIndex, Lists};
use s3d_geom::TriMesh;
use s3d_geom::glam::{Vec2, Vec3};
use std::collections::HashSet;

/// A box cuts through the surface so far on both sides, metres.
const DEPTH_M: f32 = 0.15;

/// The sine of the angle between two lines that make no plane.
const THIN: f32 = 1e-4;

/// Returns the faces of a patch that are cut out. `face` is the one that the pointer is on. `neighbours` has
/// the faces with which each face shares an edge.
///
/// # Errors
/// [`Fault::CutShape`] if the points of the knife make no plane.
pub(super) fn cut_out(
    mesh: &TriMesh,
    index: &FaceIndex,
    neighbours: &Lists,
    patch: &FaceRuns,
    face: u32,
    knife: &Knife,
) -> Result<FaceRuns, Fault> {
    let middle = |face: u32| mesh.triangle(face).iter().sum::<Vec3>() / 3.0;
    let among = |keep: &dyn Fn(u32) -> bool| patch.iter().filter(|face| keep(*face)).collect::<FaceRuns>();

    match knife {
        Knife::Line { eye, from, to } => {
            let [one, other] = [*from - *eye, *to - *eye];
            let normal = one.cross(other);
            let is_plane = normal.length() > THIN * one.length() * other.length();
            if !is_plane || !normal.is_finite() {
                return Err(Fault::CutShape);
            }
            Ok(among(&|face| normal.dot(middle(face) - *eye) > 0.0))
        }
        Knife::Box { corners } => {
            let frame = Frame::of(corners).ok_or(Fault::CutShape)?;
            let outline = corners.map(|corner| frame.project(corner).0);
            Ok(among(&|face| {
                let (at, height_m) = frame.project(middle(face));
                height_m.abs() <= DEPTH_M && is_inside(&outline, at)
            }))
        }
        Knife::Color { tolerance } => Ok(of_color(index, neighbours, patch, face, *tolerance)),
        Knife::Faces(faces) => Ok(among(&|face| faces.contains(face))),
    }
}

/// The plane of a quadrilateral, with two axes in it.
struct Frame {
    middle: Vec3,
    axes: [Vec3; 2],
    normal: Vec3,
}

impl Frame {
    /// Returns `None` if the corners lie on a line, or are not finite.
    fn of(corners: &[Vec3; 4]) -> Option<Self> {
        let [a, b, c, d] = *corners;
        // The cross product of the diagonals is twice the area of the quadrilateral, also of a bent one.
        let [one, other] = [c - a, d - b];
        let normal = one.cross(other);
        if normal.length() <= THIN * one.length() * other.length() {
            return None;
        }
        let normal = normal.try_normalize()?;
        let across = (one - normal * normal.dot(one)).try_normalize()?;
        let middle = (a + b + c + d) / 4.0;
        middle
            .is_finite()
            .then(|| Self { middle, axes: [across, normal.cross(across)], normal })
    }

    /// Returns a point's place in the plane, and its height above it.
    fn project(&self, point: Vec3) -> (Vec2, f32) {
        let off = point - self.middle;
        (Vec2::from(self.axes.map(|axis| axis.dot(off))), self.normal.dot(off))
    }
}

/// Whether a point is in a polygon: a ray from it crosses the outline an odd number of times.
fn is_inside(outline: &[Vec2], at: Vec2) -> bool {
    let ends = outline.iter().zip(outline.iter().cycle().skip(1));
    let crossings = ends.filter(|(a, b)| {
        let spans = (a.y > at.y) != (b.y > at.y);
        spans && at.x < a.x + (b.x - a.x) * (at.y - a.y) / (b.y - a.y)
    });
    crossings.count() % 2 == 1
}

/// The faces of a patch that hang together with `face` and have about its colour.
fn of_color(index: &FaceIndex, neighbours: &Lists, patch: &FaceRuns, face: u32, tolerance: f32) -> FaceRuns {
    let wanted = index.color(face);
    let is_like = |other: u32| patch.contains(other) && index.color(other).distance(wanted) <= tolerance;

    let mut found: Vec<u32> = Vec::from_iter(is_like(face).then_some(face));
    let mut is_seen: HashSet<u32> = found.iter().copied().collect();
    let mut next = 0;
    while let Some(&from) = found.get(next) {
        next += 1;
        let around = neighbours.list(from).iter().copied();
        found.extend(around.filter(|other| is_like(*other) && is_seen.insert(*other)));
    }
    found.into_iter().collect()
}
