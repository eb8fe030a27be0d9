//! Boxes with axes of their own.

mod rectangle;

use crate::{Aabb, TriMesh};
use glam::{DMat3, DVec2, DVec3, Vec3, dvec2, dvec3};
use rectangle::Rectangle;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// A box with axes of its own.
///
/// ```
/// use s3d_geom::{OrientedBox, glam::{Quat, dvec3, vec3}};
///
/// // A table top, 1.6 m × 0.8 m × 0.04 m, turned by 30° about the vertical.
/// let turn = Quat::from_rotation_z(30f32.to_radians());
/// let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| {
///     let corner = vec3((k & 1) as f32 * 1.6, (k >> 1 & 1) as f32 * 0.8, (k >> 2) as f32 * 0.04);
///     turn * corner
/// });
/// let upright = OrientedBox::upright(&corners).expect("there are points");
/// assert!(upright.size.abs_diff_eq(dvec3(1.6, 0.8, 0.04), 1e-5));
/// assert!((upright.yaw_deg() - 30.0).abs() < 1e-3);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrientedBox {
    /// The centre, world metres.
    pub center: DVec3,
    /// The unit axes as columns, right-handed.
    pub axes: DMat3,
    /// The lengths along the axes, metres; 0 for what is flat.
    pub size: DVec3,
}

/// Directions that are tried as the axis of a smallest box, beside those that the caller names.
const TRIED: usize = 96;

/// How many of the tried directions are refined.
const REFINED: usize = 8;

/// The first step of the refinement, and the smallest one; each is a third of the one before.
const STEPS_RAD: [f64; 2] = [0.1, 1e-5];

/// The directions in which outermost points are sought. Orientations are compared by these points alone; the
/// box that is returned holds all points.
const OUTERMOST: usize = 96;

impl OrientedBox {
    /// Returns the box of the least volume among those that stand upright: their third axis is +Z. The first
    /// axis is the longer horizontal one, and points into the half plane x > 0 (or along +Y). Returns `None`
    /// without a point.
    pub fn upright(points: &[Vec3]) -> Option<Self> {
        let bounds = Aabb::from_points(points.iter().copied());
        if bounds.is_empty() {
            return None;
        }

        let plan = points.iter().map(|p| dvec2(f64::from(p.x), f64::from(p.y)));
        let rectangle = Rectangle::smallest(plan.collect())?;
        let mut along = rectangle.along;
        if rectangle.size.x < rectangle.size.y {
            along = along.perp();
        }
        // Zero is added, for it turns −0 into 0.
        along = if along.x < 0.0 || (along.x == 0.0 && along.y < 0.0) {
            -along
        } else {
            along
        } + 0.0;

        let along = along.extend(0.0);
        let axes = DMat3::from_cols(along, DVec3::Z.cross(along), DVec3::Z);
        Some(Self::around(points, axes))
    }

    /// Returns a box of small volume in any orientation: the third axis is the shortest, the first the
    /// longest. Of boxes without volume it takes one of small area. Returns `None` without a point.
    ///
    /// Directions over the half sphere are tried as an axis, and the directions `likely` (of any length),
    /// such as the normals of large faces. About each of them the other axes are exact, since the rectangle
    /// of the least area has a side along the convex hull. The best are then turned in smaller and smaller
    /// steps until none of them helps. The box is never larger than the upright one.
    pub fn smallest(points: &[Vec3], likely: &[DVec3]) -> Option<Self> {
        let first = points.first()?.as_dvec3();
        let outermost = outermost(points, first);
        let trial = Trial::new(&outermost);

        let mut tried: Vec<(f64, DVec3)> = half_sphere(TRIED)
            .chain([DVec3::X, DVec3::Y, DVec3::Z])
            .chain(likely.iter().filter_map(|axis| axis.try_normalize()))
            .map(|axis| (trial.cost(axis), axis))
            .collect();
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));

        // All points decide between the refined boxes, and the upright one.
        let refined = tried.into_iter().take(REFINED).map(|best| trial.refine(best));
        let boxes = refined.map(|(_, normal)| Self::around(points, trial.axes(normal)));
        let smallest = boxes
            .chain(Self::upright(points))
            .min_by(|a, b| trial.cost_of(a.size).total_cmp(&trial.cost_of(b.size)));
        Some(smallest?.with_sorted_axes())
    }

    /// Returns the box with the given unit axes around points, of which there is at least one.
    fn around(points: &[Vec3], axes: DMat3) -> Self {
        let to_box = axes.transpose();
        let mut low = DVec3::INFINITY;
        let mut high = DVec3::NEG_INFINITY;
        for point in points {
            let inside = to_box * point.as_dvec3();
            low = low.min(inside);
            high = high.max(inside);
        }
        Self { center: axes * ((low + high) / 2.0), axes, size: high - low }
    }

    /// Returns the same box with its longest axis first. The first two axes point into the half space in
    /// which their largest component is positive.
    fn with_sorted_axes(self) -> Self {
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| self.size[*b].total_cmp(&self.size[*a]));

        let forward = |axis: DVec3| {
            let parts = axis.to_array();
            let largest = parts.into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
            if largest.is_some_and(|part| part < 0.0) {
                -axis
            } else {
                axis
            }
        };
        let first = forward(self.axes.col(order[0]));
        let second = forward(self.axes.col(order[1]));
        Self {
            axes: DMat3::from_cols(first, second, first.cross(second)),
            size: dvec3(self.size[order[0]], self.size[order[1]], self.size[order[2]]),
            ..self
        }
    }

    /// Returns the corners. Bit k of a corner's number says on which side of the centre along axis k it lies:
    /// corner 0 is the least along all axes, corner 1 is at the other end of the first axis.
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|corner| {
            let side = |axis: usize| if corner >> axis & 1 == 1 { 0.5 } else { -0.5 };
            self.center + self.axes * (self.size * dvec3(side(0), side(1), side(2)))
        })
    }

    /// Returns the volume, m³.
    pub fn volume(&self) -> f64 {
        self.size.element_product()
    }

    /// Returns the direction of the first axis on the plan in degrees, counter-clockwise from +X: (−90, 90]
    /// for an upright box.
    pub fn yaw_deg(&self) -> f64 {
        let along = self.axes.x_axis;
        libm::atan2(along.y, along.x).to_degrees()
    }
}

/// Returns the directions in which the most area of some faces looks, the most first: at most `count` unit
/// vectors. Faces whose normals, with either sign, round to the same sixteenths count together.
///
/// # Panics
/// If the mesh does not have one of `faces`.
pub fn main_normals(mesh: &TriMesh, faces: &[u32], count: usize) -> Vec<DVec3> {
    let mut sums: BTreeMap<[i32; 3], DVec3> = BTreeMap::new();
    for face in faces {
        let [a, b, c] = mesh.triangle(*face).map(Vec3::as_dvec3);
        let across = (b - a).cross(c - a);
        let Some(normal) = across.try_normalize() else { continue };
        let mut cell = (normal * 16.0).round().to_array().map(|part| part as i32);
        let mut area = across;
        if cell < [0; 3] {
            cell = cell.map(|part| -part);
            area = -across;
        }
        *sums.entry(cell).or_default() += area;
    }

    let mut sums: Vec<DVec3> = sums.into_values().collect();
    sums.sort_by(|a, b| b.length_squared().total_cmp(&a.length_squared()));
    sums.truncate(count);
    sums.into_iter().filter_map(DVec3::try_normalize).collect()
}

/// Returns directions that cover the half sphere z > 0 evenly: a spiral of golden angles.
fn half_sphere(count: usize) -> impl Iterator<Item = DVec3> {
    let golden_rad = PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |k| {
        let z = 1.0 - (k as f64 + 0.5) / count as f64;
        let across = (1.0 - z * z).sqrt();
        let (sin, cos) = libm::sincos(golden_rad * k as f64);
        dvec3(across * cos, across * sin, z)
    })
}

/// Returns the outermost points along evenly spread directions, as offsets from `origin`.
fn outermost(points: &[Vec3], origin: DVec3) -> Vec<DVec3> {
    let offsets: Vec<DVec3> = points.iter().map(|p| p.as_dvec3() - origin).collect();
    if offsets.len() <= OUTERMOST {
        return offsets;
    }

    let mut chosen = Vec::new();
    for direction in half_sphere(OUTERMOST) {
        let mut ends = [(f64::INFINITY, 0), (f64::NEG_INFINITY, 0)];
        for (place, offset) in offsets.iter().enumerate() {
            let along = offset.dot(direction);
            if along < ends[0].0 {
                ends[0] = (along, place);
            }
            if along > ends[1].0 {
                ends[1] = (along, place);
            }
        }
        chosen.extend(ends.map(|(_, place)| place));
    }
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|place| offsets[place]).collect()
}

/// Compares orientations of a box around a few points.
struct Trial<'a> {
    points: &'a [DVec3],
    /// Is added to each length, so that of two boxes without volume the one of less area costs less.
    thickness: f64,
}

impl<'a> Trial<'a> {
    fn new(points: &'a [DVec3]) -> Self {
        let low = points.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = points.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        Self { points, thickness: 1e-5 * (high - low).length() }
    }

    /// Returns what the best box with an axis along `normal`, a unit vector, costs.
    fn cost(&self, normal: DVec3) -> f64 {
        let (rectangle, height) = self.measure(normal);
        self.cost_of(rectangle.size.extend(height))
    }

    /// Returns what a box of this size costs.
    fn cost_of(&self, size: DVec3) -> f64 {
        (size + self.thickness).element_product()
    }

    /// Returns the axes of the best box with an axis along `normal`.
    fn axes(&self, normal: DVec3) -> DMat3 {
        let (x, y) = normal.any_orthonormal_pair();
        let along = self.measure(normal).0.along;
        let first = (x * along.x + y * along.y).normalize();
        DMat3::from_cols(first, normal.cross(first), normal)
    }

    /// Returns the smallest rectangle of the points in the plane across `normal`, and their height along it.
    fn measure(&self, normal: DVec3) -> (Rectangle, f64) {
        let (x, y) = normal.any_orthonormal_pair();
        let flat: Vec<DVec2> = self.points.iter().map(|p| dvec2(p.dot(x), p.dot(y))).collect();
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        for point in self.points {
            let along = point.dot(normal);
            low = low.min(along);
            high = high.max(along);
        }
        (Rectangle::smallest(flat).unwrap_or_default(), high - low)
    }

    /// Lowers the cost of an axis, and of the other two axes of its box in turn, until nothing helps.
    fn refine(&self, mut best: (f64, DVec3)) -> (f64, DVec3) {
        loop {
            best = self.turn(best);
            let axes = self.axes(best.1);
            let others = [axes.x_axis, axes.y_axis].map(|axis| (self.cost(axis), axis));
            match others.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                // A gain in the last bits is none.
                Some(better) if better.0 < best.0 * (1.0 - 1e-9) => best = better,
                _ => return best,
            }
        }
    }

    /// Turns an axis in smaller and smaller steps while that lowers the cost.
    fn turn(&self, (mut cost, mut normal): (f64, DVec3)) -> (f64, DVec3) {
        let [mut step_rad, smallest_rad] = STEPS_RAD;
        while step_rad > smallest_rad {
            let (x, y) = normal.any_orthonormal_pair();
            let turned = [x, -x, y, -y]
                .map(|side| (normal + side * step_rad).normalize())
                .map(|axis| (self.cost(axis), axis));
            match turned.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(better) if better.0 < cost => (cost, normal) = better,
                _ => step_rad /= 3.0,
            }
        }
        (cost, normal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, EulerRot};
    use proptest::prelude::*;

    /// Points on all sides of a box of `size` that is turned, its corners among them.
    fn turned(size: DVec3, turn: DQuat) -> Vec<Vec3> {
        let grid = (0..7 * 7 * 7).map(|k| dvec3((k % 7) as f64, (k / 7 % 7) as f64, (k / 49) as f64) / 6.0);
        grid.map(|at| (dvec3(3.0, -2.0, 1.0) + turn * ((at - 0.5) * size)).as_vec3())
            .collect()
    }

    proptest! {
        #[test]
        fn a_turned_box_is_found(
            size in prop::array::uniform3(0.05f64..3.0),
            angles in prop::array::uniform3(-PI..PI),
        ) {
            let turn = DQuat::from_euler(EulerRot::ZYX, angles[0], angles[1], angles[2]);
            let points = turned(DVec3::from_array(size), turn);
            let found = OrientedBox::smallest(&points, &[turn * DVec3::Y]).unwrap();
            let mut sorted = size;
            sorted.sort_by(|a, b| b.total_cmp(a));
            prop_assert!(found.size.abs_diff_eq(DVec3::from_array(sorted), 1e-3), "{:?}", found.size);
            prop_assert!(found.center.abs_diff_eq(dvec3(3.0, -2.0, 1.0), 1e-3));
        }

        #[test]
        fn without_a_hint_the_volume_is_nearly_the_least(
            size in prop::array::uniform3(0.2f64..2.0),
            angles in prop::array::uniform3(-PI..PI),
        ) {
            let turn = DQuat::from_euler(EulerRot::ZYX, angles[0], angles[1], angles[2]);
            let found = OrientedBox::smallest(&turned(DVec3::from_array(size), turn), &[]).unwrap();
            let least: f64 = size.iter().product();
            prop_assert!(found.volume() < least * 1.001, "{} for {least}", found.volume());
        }

        #[test]
        fn boxes_hold_their_points_and_are_no_larger_than_straight_ones(
            points in prop::collection::vec(prop::array::uniform3(-5f32..5.0), 1..40),
        ) {
            let points: Vec<Vec3> = points.into_iter().map(Vec3::from_array).collect();
            let straight = Aabb::from_points(points.iter().copied()).size().as_dvec3().element_product();
            let upright = OrientedBox::upright(&points).unwrap();
            let free = OrientedBox::smallest(&points, &[]).unwrap();
            prop_assert!(upright.volume() <= straight * 1.000_001 + 1e-9);
            let thick = |of: &OrientedBox| (of.size + 1e-3).element_product();
            prop_assert!(thick(&free) <= thick(&upright) * 1.01, "{free:?} {upright:?}");

            for found in [upright, free] {
                prop_assert!((found.axes.determinant() - 1.0).abs() < 1e-9);
                for point in &points {
                    let inside = found.axes.transpose() * (point.as_dvec3() - found.center);
                    prop_assert!((inside.abs() - found.size / 2.0).max_element() < 1e-6);
                }
            }
            prop_assert!(free.size.x >= free.size.y && free.size.y >= free.size.z);
        }
    }

    #[test]
    fn flat_things_get_the_smallest_area() {
        // A board of 2 m × 1 m in a slanting plane.
        let turn = DQuat::from_euler(EulerRot::ZYX, 0.4, 0.7, 0.2);
        let board = turned(dvec3(2.0, 1.0, 0.0), turn);
        let found = OrientedBox::smallest(&board, &[]).unwrap();
        assert!(found.size.abs_diff_eq(dvec3(2.0, 1.0, 0.0), 1e-3), "{:?}", found.size);
        assert!(found.axes.z_axis.dot(turn * DVec3::Z).abs() > 1.0 - 1e-6);
    }

    #[test]
    fn a_wall_on_the_plan_is_a_line() {
        let turn = DQuat::from_rotation_z(2.0);
        let wall = turned(dvec3(4.0, 0.0, 2.5), turn);
        let found = OrientedBox::upright(&wall).unwrap();
        assert!(found.size.abs_diff_eq(dvec3(4.0, 0.0, 2.5), 1e-4), "{:?}", found.size);
        assert!((found.yaw_deg() - (2f64.to_degrees() - 180.0)).abs() < 1e-3, "{}", found.yaw_deg());
    }

    #[test]
    fn corners_are_numbered_by_bits() {
        let points = [Vec3::ZERO, Vec3::new(3.0, 2.0, 1.0)];
        let found =
            OrientedBox { center: dvec3(1.5, 1.0, 0.5), axes: DMat3::IDENTITY, size: dvec3(3.0, 2.0, 1.0) };
        let corners = found.corners();
        assert_eq!((corners[0], corners[7]), (points[0].as_dvec3(), points[1].as_dvec3()));
        assert_eq!((corners[1], corners[4]), (dvec3(3.0, 0.0, 0.0), dvec3(0.0, 0.0, 1.0)));
    }

    #[test]
    fn few_points_have_boxes_and_none_has_not() {
        assert_eq!(OrientedBox::upright(&[]), None);
        assert_eq!(OrientedBox::smallest(&[], &[]), None);
        let single = OrientedBox::smallest(&[Vec3::ONE], &[]).unwrap();
        assert!(single.center.abs_diff_eq(DVec3::ONE, 1e-9) && single.size == DVec3::ZERO, "{single:?}");
        let pair = OrientedBox::smallest(&[Vec3::ZERO, Vec3::new(0.0, 3.0, 4.0)], &[]).unwrap();
        assert!(pair.size.abs_diff_eq(dvec3(5.0, 0.0, 0.0), 1e-3), "{:?}", pair.size);
    }
}
