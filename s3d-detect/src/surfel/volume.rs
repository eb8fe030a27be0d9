//! Summed volumes: they give the number of occupied cells in any box of a grid from the eight corners of the
//! box. Crow (1984) has them in two dimensions.

use crate::surfel::Surfel;
use glam::{IVec3, Vec3, ivec3};

/// The width of a cell, which is the step of sliding windows, in metres.
pub const STEP_M: f32 = 0.1;

/// The width of the empty border around a space, in cells: windows may reach out, and look beside themselves.
pub const PAD: i32 = 5;

/// The number of directions of surfaces: across x, across y, level.
pub const DIRECTIONS: usize = 3;

/// A grid around a space, with a summed volume of occupied cells for each direction of surfaces.
#[derive(Clone, Debug)]
pub struct Volumes {
    /// The number of cells of the space along each axis, without [`PAD`].
    pub cells: IVec3,
    /// The number of corners along each axis.
    corners: IVec3,
    /// Corner (x, y, z) is at index `(z·corners.y + y)·corners.x + x`. Counts up to 2²⁴ are exact.
    sums: [Vec<f32>; DIRECTIONS],
}

/// Returns the axis that the normal of a surfel is nearest to. The last axis wins a tie.
pub fn direction(s: &Surfel) -> usize {
    let n = s.normal.abs();
    (0..3).fold(0, |best, axis| if n[axis] >= n[best] { axis } else { best })
}

impl Volumes {
    /// Counts the surfels of a space of this extent, which begins at the origin.
    pub fn new(surfels: &[Surfel], extent: Vec3) -> Self {
        let cells = (extent / STEP_M).ceil().as_ivec3().max(IVec3::ONE);
        let corners = cells + 2 * PAD + 1;
        let len = corners.as_usizevec3().element_product();
        let mut sums = [(); DIRECTIONS].map(|()| vec![0.0; len]);

        let index = |c: IVec3| ((c.z * corners.y + c.y) * corners.x + c.x) as usize;
        for s in surfels {
            let cell = (s.position / STEP_M).floor().as_ivec3().clamp(IVec3::ZERO, cells - 1);
            // The far corner of the cell, since a sum ends at its corner.
            sums[direction(s)][index(cell + PAD + 1)] = 1.0;
        }
        for sums in &mut sums {
            for step in [1, corners.x as usize, (corners.x * corners.y) as usize] {
                accumulate(sums, step, corners);
            }
        }
        Self { cells, corners, sums }
    }

    /// Returns the number of cells between the corners `from` and `to` that hold surfaces of a direction.
    /// Corners are counted from the origin of the space. A corner outside the grid is moved to its border.
    pub fn count(&self, direction: usize, from: IVec3, to: IVec3) -> f32 {
        let at = |c: IVec3| {
            let c = (c + PAD).clamp(IVec3::ZERO, self.corners - 1);
            self.sums[direction][((c.z * self.corners.y + c.y) * self.corners.x + c.x) as usize]
        };
        let mut count = 0.0;
        for corner in 0..8u32 {
            let pick = |axis: usize| if corner >> axis & 1 == 1 { to[axis] } else { from[axis] };
            let sign = if corner.count_ones() % 2 == 1 { 1.0 } else { -1.0 };
            count += sign * at(ivec3(pick(0), pick(1), pick(2)));
        }
        count
    }

    /// Returns the sums at `count` corners from (`x`, `y`, `z`) on along x, numbered as in
    /// [`Volumes::count`]. All must be in the grid.
    pub(crate) fn run(&self, direction: usize, [x, y, z]: [i32; 3], count: usize) -> &[f32] {
        let start = (((z + PAD) * self.corners.y + y + PAD) * self.corners.x + x + PAD) as usize;
        &self.sums[direction][start..start + count]
    }

    /// Whether a corner, counted from the origin of the space, is in the grid.
    pub(crate) fn holds(&self, corner: IVec3) -> bool {
        let c = corner + PAD;
        c.cmpge(IVec3::ZERO).all() && c.cmplt(self.corners).all()
    }
}

/// Adds to each value the value one step before it, along the axis of this step.
fn accumulate(sums: &mut [f32], step: usize, corners: IVec3) {
    let length = if step == 1 {
        corners.x as usize
    } else if step == corners.x as usize {
        corners.y as usize
    } else {
        corners.z as usize
    };
    for i in step..sums.len() {
        if !(i / step).is_multiple_of(length) {
            sums[i] += sums[i - step];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use s3d_geom::Aabb;

    #[test]
    fn sums_give_the_same_counts_as_counting() {
        let surfels: Vec<Surfel> = (0..400u32)
            .map(|i| {
                let r = |k: u32| (i.wrapping_mul(k) % 997) as f32 / 997.0;
                let position = vec3(2.3 * r(7919), 1.1 * r(104_729), 0.7 * r(1_299_709));
                let normal = [Vec3::X, Vec3::Y, Vec3::Z][i as usize % 3];
                let extent = Aabb { min: position, max: position };
                Surfel { position, extent, normal, curvature: 0.0, color: Vec3::ZERO, room: 0 }
            })
            .collect();
        let volumes = Volumes::new(&surfels, vec3(2.3, 1.1, 0.7));
        assert_eq!(volumes.cells, ivec3(23, 11, 7));

        for i in 0..200 {
            let from = ivec3(i % 20 - 2, i % 7 - 1, i % 5 - 2);
            let to = from + ivec3(1 + i % 9, 1 + i % 4, 1 + i % 6);
            for axis in 0..3 {
                let mut cells: Vec<[i32; 3]> = surfels
                    .iter()
                    .filter(|s| direction(s) == axis)
                    .map(|s| (s.position / STEP_M).floor().as_ivec3())
                    .filter(|c| c.cmpge(from).all() && c.cmplt(to).all())
                    .map(|c| c.to_array())
                    .collect();
                cells.sort_unstable();
                cells.dedup();
                assert_eq!(volumes.count(axis, from, to), cells.len() as f32, "{from} {to}");
            }
        }
    }
}
