//! Detects points and a mesh in different frames: they lie too far apart to belong together.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use s3d_geom::Aabb;
use s3d_geom::glam::DVec3;
use std::fmt;
use std::path::Path;

/// Points no farther from the mesh than this, or than the mesh's own size, may share its frame: they may show
/// a part of the building that was not meshed, for instance.
const SAME_FRAME_M: f64 = 100.0;

/// Parts of one scan are never farther apart than this or ten times the mesh's size, whichever is larger. If
/// the first points are, the frames differ, whatever follows.
const OTHER_FRAME_M: f64 = 10_000.0;

/// The gap between points and a mesh, and the offset that would close it. Its `Display` is a sentence.
///
/// ```
/// use s3d_geom::{Aabb, glam::{DVec3, Vec3, dvec3}};
/// use s3d_io::cloud::FrameGap;
///
/// let mesh = Aabb { min: Vec3::ZERO, max: Vec3::new(8.0, 6.0, 3.0) };
/// let utm = dvec3(500_000.0, 5_400_000.0, 300.0);
/// let points = [utm, utm + dvec3(8.0, 6.0, 3.0)];
/// let gap = FrameGap::between(points, DVec3::ZERO, mesh).unwrap();
/// assert_eq!(gap.offset_m, utm);
/// assert!(FrameGap::between(points, utm, mesh).is_none());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FrameGap {
    /// The smallest and the largest coordinates of the points, after the offset known so far was subtracted.
    pub points: [DVec3; 2],
    /// The smallest and the largest coordinates of the mesh.
    pub mesh: [DVec3; 2],
    /// The distance between the two boxes, metres.
    pub distance_m: f64,
    /// The offset to subtract from the points as their file has them. It is as round as the boxes allow.
    pub offset_m: DVec3,
}

impl FrameGap {
    /// Measures the gap between `mesh` and points between two corners, from which `offset_m` is subtracted.
    /// Returns `None` for gaps that one scan may have: up to 100 m, or up to the mesh's own size.
    pub fn between(points: [DVec3; 2], offset_m: DVec3, mesh: Aabb) -> Option<Self> {
        let [min, max] = points;
        Self::of(Bounds { min, max }, offset_m, mesh.into(), SAME_FRAME_M, 1.0)
    }

    fn of(points: Bounds, offset: DVec3, mesh: Bounds, gap_m: f64, sizes: f64) -> Option<Self> {
        let moved = points.minus(offset);
        let distance_m = moved.distance_m(&mesh);
        let is_far =
            moved.is_some() && mesh.is_some() && distance_m > gap_m.max(sizes * mesh.size().length());
        is_far.then(|| Self {
            points: [moved.min, moved.max],
            mesh: [mesh.min, mesh.max],
            distance_m,
            offset_m: fitting_offset(points, mesh),
        })
    }

    /// The offset as it is written in a scene file.
    pub fn offset_in_toml(&self) -> String {
        format!("offset_m = {}", list(self.offset_m))
    }
}

impl fmt::Display for FrameGap {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [points_min, points_max] = self.points.map(corner_text);
        let [mesh_min, mesh_max] = self.mesh.map(corner_text);
        write!(
            f,
            "{:.0} m from the mesh: they are between {points_min} and {points_max}, the mesh between \
             {mesh_min} and {mesh_max}",
            self.distance_m
        )
    }
}

/// A corner of a box, for messages.
fn corner_text(p: DVec3) -> String {
    format!("({:.2}, {:.2}, {:.2})", p.x, p.y, p.z)
}

/// Formats a vector as a TOML array.
fn list(v: DVec3) -> String {
    let [x, y, z] = v.to_array().map(|v| format!("{v:?}"));
    format!("[{x}, {y}, {z}]")
}

/// Returns the offset from the middle of the mesh to the middle of the points, rounded. Offsets are round
/// numbers as a rule: each axis gets the roundest one that leaves neither box farther beyond the other than
/// their sizes already make it.
fn fitting_offset(points: Bounds, mesh: Bounds) -> DVec3 {
    let exact = points.center() - mesh.center();
    let slack = (points.size() - mesh.size()).abs() * 0.5 + 0.05;
    DVec3::from_array(std::array::from_fn(|axis| {
        let exact = exact[axis];
        let slack = slack[axis];
        let steps = [1e6, 1e5, 1e4, 1e3, 1e2, 1e1, 1.0];
        let found = steps
            .into_iter()
            .map(|step| (exact / step).round() * step)
            .find(|rounded| (rounded - exact).abs() <= slack);
        // Adding 0 turns −0 into 0.
        found.unwrap_or((exact * 1e3).round() / 1e3) + 0.0
    }))
}

/// Watches the points of a cloud while they are read, for points in another frame than the mesh.
#[derive(Debug)]
pub(crate) struct FrameWatch {
    mesh: Bounds,
    offset: DVec3,
    /// The box that the file's header gives for its points.
    header: Option<Bounds>,
    seen: Bounds,
    /// Whether the first points have been looked at.
    begun: bool,
}

impl FrameWatch {
    pub(crate) fn new(mesh: Aabb, offset: DVec3) -> Self {
        Self { mesh: mesh.into(), offset, header: None, seen: Bounds::EMPTY, begun: false }
    }

    /// Takes the header's box of all points. It counts only if the first points agree with it.
    pub(crate) fn header(&mut self, bounds: Bounds) {
        self.header = Some(bounds).filter(Bounds::is_some);
    }

    #[inline]
    pub(crate) fn see(&mut self, position: DVec3) {
        self.seen = self.seen.with(position);
    }

    /// Checks the points seen after the first block of `path`; later calls do nothing.
    ///
    /// # Errors
    /// [`Error::Format`] if they show that the file has another frame than the mesh.
    pub(crate) fn after_block(&mut self, path: &Path) -> Result<()> {
        if std::mem::replace(&mut self.begun, true) {
            return Ok(());
        }
        if self.gap(self.seen, SAME_FRAME_M, 1.0).is_none() {
            return Ok(());
        }

        let of_all = self.header.and_then(|header| self.gap(header, SAME_FRAME_M, 1.0));
        match of_all.or_else(|| self.gap(self.seen, OTHER_FRAME_M, 10.0)) {
            Some(gap) => Err(refusal(path, &gap)),
            None => Ok(()),
        }
    }

    /// Checks all points of `path`.
    ///
    /// # Errors
    /// [`Error::Format`] if they all lie far from the mesh.
    pub(crate) fn at_end(&self, path: &Path) -> Result<()> {
        match self.gap(self.seen, SAME_FRAME_M, 1.0) {
            Some(gap) => Err(refusal(path, &gap)),
            None => Ok(()),
        }
    }

    fn gap(&self, points: Bounds, gap_m: f64, sizes: f64) -> Option<FrameGap> {
        FrameGap::of(points, self.offset, self.mesh, gap_m, sizes)
    }
}

/// The error for annotated points in another frame.
pub(crate) fn refusal(path: &Path, gap: &FrameGap) -> Error {
    let offset = gap.offset_in_toml();
    let message = format!(
        "its points lie {gap}, in metres, Z-up. Points and mesh need one frame: if they are of one scan, \
         write {offset} under [annotations] in the scene file; it is subtracted from the points"
    );
    Error::format(path, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{Vec3, dvec3, vec3};

    const UTM: DVec3 = dvec3(512_300.0, 5_412_345.0, 340.0);

    fn room() -> Aabb {
        Aabb { min: vec3(-3.0, 0.0, 0.0), max: vec3(9.0, 10.0, 3.0) }
    }

    fn offset(points: [DVec3; 2]) -> DVec3 {
        FrameGap::between(points, DVec3::ZERO, room()).unwrap().offset_m
    }

    #[test]
    fn the_offset_is_as_round_as_the_boxes_allow() {
        let [low, high] = [room().min, room().max].map(|p| p.as_dvec3());
        assert_eq!(offset([low + UTM, high + UTM]), UTM);
        // With noise; and with a part of the room, which may lie anywhere in it.
        assert_eq!(offset([low + UTM + 0.01, high + UTM - 0.02]), UTM);
        let part = offset([low + UTM, low + UTM + dvec3(4.0, 4.0, 3.0)]);
        assert_eq!(part, dvec3(512_300.0, 5_412_340.0, 340.0));
        // No round numbers.
        let odd = dvec3(512_345.678, 5_400_000.0, 0.0);
        assert!((offset([low + odd, high + odd]) - odd).abs().max_element() < 1e-6);
        // The mesh is far from the origin.
        let mesh = Aabb { min: room().min + vec3(5e5, 0.0, 0.0), max: room().max + vec3(5e5, 0.0, 0.0) };
        let gap = FrameGap::between([low, high], DVec3::ZERO, mesh).unwrap();
        assert_eq!(gap.offset_m, dvec3(-500_000.0, 0.0, 0.0));
    }

    #[test]
    fn the_sentence_has_both_boxes_and_a_line_to_paste() {
        let [low, high] = [room().min, room().max].map(|p| p.as_dvec3());
        let gap = FrameGap::between([low + UTM, high + UTM], DVec3::ZERO, room()).unwrap();
        let message = refusal(Path::new("a.las"), &gap).to_string();
        for words in [
            "a.las: its points lie 5436525 m from the mesh",
            "between (512297.00, 5412345.00, 340.00) and (512309.00, 5412355.00, 343.00)",
            "the mesh between (-3.00, 0.00, 0.00) and (9.00, 10.00, 3.00)",
            "offset_m = [512300.0, 5412345.0, 340.0] under [annotations]",
        ] {
            assert!(message.contains(words), "{message}");
        }
    }

    fn gap_of_box(low: DVec3, high: DVec3) -> Option<FrameGap> {
        FrameGap::between([low, high], DVec3::ZERO, room())
    }

    #[test]
    fn neighbours_and_parts_of_the_scan_are_no_gap() {
        assert!(gap_of_box(dvec3(100.0, 0.0, 0.0), dvec3(120.0, 9.0, 3.0)).is_none());
        assert!(gap_of_box(dvec3(1.0, 1.0, 1.0), UTM).is_none());
        assert!(gap_of_box(dvec3(110.0, 0.0, 0.0), dvec3(120.0, 9.0, 3.0)).is_some());
        assert!(gap_of_box(DVec3::INFINITY, DVec3::NEG_INFINITY).is_none());
        assert!(FrameGap::between([UTM, UTM], DVec3::ZERO, Aabb::EMPTY).is_none());
        let large = Aabb { min: Vec3::ZERO, max: Vec3::splat(2000.0) };
        assert!(FrameGap::between([dvec3(4000.0, 0.0, 0.0); 2], DVec3::ZERO, large).is_none());
    }

    #[test]
    fn the_first_points_tell_where_nothing_else_can_follow() {
        /// Whether the first points are refused, and whether the whole file is.
        fn refused(first: DVec3, header: Option<Bounds>) -> (bool, bool) {
            let mut watch = FrameWatch::new(room(), DVec3::ZERO);
            header.into_iter().for_each(|header| watch.header(header));
            watch.see(first);
            watch.see(first + 1.0);
            (watch.after_block(Path::new("a.las")).is_err(), watch.at_end(Path::new("a.las")).is_err())
        }

        let other = dvec3(900.0, 0.0, 0.0);
        assert_eq!(refused(DVec3::ONE, None), (false, false));
        assert_eq!(refused(UTM, None), (true, true));
        // Nearer points may follow, unless the header says otherwise.
        assert_eq!(refused(other, None), (false, true));
        assert_eq!(refused(other, Some(Bounds { min: other, max: other + 9.0 })), (true, true));
        assert_eq!(refused(other, Some(Bounds { min: DVec3::ZERO, max: other + 9.0 })), (false, true));
        // A wrong header does not count.
        assert_eq!(refused(DVec3::ONE, Some(Bounds { min: UTM, max: UTM })), (false, false));
        assert_eq!(refused(UTM, Some(Bounds { min: DVec3::ZERO, max: DVec3::ONE })), (true, true));
    }
}
