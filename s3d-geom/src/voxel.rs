//! The box of an instance, split in 6 × 6 × 6 voxels.
//!
//! Source: formats.md, "What is written" (the data set's `Bbox`, `Voxels`, `Voxel_Occupancy`,
//! `Points_per_Voxel`).

use crate::Aabb;
use glam::Vec3;

/// A box split in [`VoxelGrid::SIDE`]³ equal voxels.
///
/// Voxel (ix, iy, iz), counted along the axes from the box's `min`, has the index `(ix * 6 + iy) * 6 + iz`. A
/// point between two voxels belongs to the upper one, a point on the upper face of the box to the last voxel;
/// along an axis without extent there is one layer, index 0.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "as_data::VoxelGrid")
)]
pub struct VoxelGrid {
    /// The box, world metres; not empty.
    pub bbox: Aabb,
}

/// The seven planes that bound the six layers of an axis, for the three axes.
type Planes = [[f32; VoxelGrid::SIDE + 1]; 3];

impl VoxelGrid {
    /// Voxels along each axis.
    pub const SIDE: usize = 6;
    /// Voxels in all.
    pub const CELLS: usize = Self::SIDE * Self::SIDE * Self::SIDE;

    /// Index of the voxel that holds `point`. A point outside of the box belongs to the nearest voxel of the
    /// surface.
    pub fn cell_of(&self, point: Vec3) -> usize {
        cell_between(&self.planes(), point)
    }

    /// The voxel of each of `points`, as [`VoxelGrid::cell_of`] gives it, into `out`, whose content they
    /// replace.
    pub fn cells_of(&self, points: &[Vec3], out: &mut Vec<u8>) {
        let planes = self.planes();
        out.clear();
        out.extend(points.iter().map(|&p| cell_between(&planes, p) as u8));
    }

    /// The box of voxel `cell`. It contains, in `f32`, every point of the box that [`VoxelGrid::cell_of`]
    /// puts there.
    ///
    /// # Panics
    /// If `cell` is not below [`VoxelGrid::CELLS`].
    pub fn voxel_aabb(&self, cell: usize) -> Aabb {
        assert!(cell < Self::CELLS, "voxel {cell} of {}", Self::CELLS);
        let planes = self.planes();
        let layers = [cell / (Self::SIDE * Self::SIDE), cell / Self::SIDE % Self::SIDE, cell % Self::SIDE];
        // A flat axis has one layer, and its planes coincide: the other layers are as flat and hold nothing.
        Aabb {
            min: Vec3::from_array(std::array::from_fn(|axis| planes[axis][layers[axis]])),
            max: Vec3::from_array(std::array::from_fn(|axis| planes[axis][layers[axis] + 1])),
        }
    }

    /// One set of planes decides for points and for voxel boxes, so that the two cannot disagree by a
    /// rounding.
    fn planes(&self) -> Planes {
        let (min, max) = (self.bbox.min.to_array(), self.bbox.max.to_array());
        std::array::from_fn(|axis| {
            let (low, high) = (f64::from(min[axis]), f64::from(max[axis]));
            let mut planes: [f32; Self::SIDE + 1] =
                std::array::from_fn(|k| (low + (high - low) * (k as f64 / Self::SIDE as f64)) as f32);
            planes[Self::SIDE] = max[axis];
            planes
        })
    }
}

fn cell_between(planes: &Planes, point: Vec3) -> usize {
    let layer = |axis: usize| {
        let p = &planes[axis];
        if p[0] == p[VoxelGrid::SIDE] {
            return 0;
        }
        p[1..VoxelGrid::SIDE]
            .iter()
            .map(|&plane| usize::from(point[axis] >= plane))
            .sum::<usize>()
    };
    (layer(0) * VoxelGrid::SIDE + layer(1)) * VoxelGrid::SIDE + layer(2)
}

/// The points of an instance by voxel of their tightest box.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "as_data::Voxels")
)]
///
/// ```
/// use s3d_geom::{VoxelGrid, Voxels, glam::{Vec3, vec3}};
///
/// let voxels = Voxels::from_points(&[Vec3::ZERO, vec3(0.1, 0.1, 0.1), Vec3::splat(6.0)]).unwrap();
/// assert_eq!((voxels.members_of(0), voxels.count(VoxelGrid::CELLS - 1)), (&[0, 1][..], 1));
/// assert_eq!(voxels.occupancy().iter().filter(|&&occupied| occupied).count(), 2);
/// assert_eq!(voxels.grid.voxel_aabb(0).size(), Vec3::ONE);
/// ```
pub struct Voxels {
    /// The tightest box of the points, and its voxels.
    pub grid: VoxelGrid,
    /// The points of voxel `c` are `members[starts[c]..starts[c + 1]]`; [`VoxelGrid::CELLS`] + 1 numbers.
    pub starts: Vec<u32>,
    /// Indices of the points, grouped by voxel, ascending within each; as many as there are points.
    pub members: Vec<u32>,
}

impl Voxels {
    /// Sorts points, which must be finite, into the voxels of their box. `None` if there is no point.
    ///
    /// # Panics
    /// If there are more than `u32::MAX` points.
    pub fn from_points(points: &[Vec3]) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        assert!(u32::try_from(points.len()).is_ok(), "{} points in one instance", points.len());
        let grid = VoxelGrid { bbox: Aabb::from_points(points.iter().copied()) };
        let mut cells = Vec::with_capacity(points.len());
        grid.cells_of(points, &mut cells);

        let mut starts = vec![0u32; VoxelGrid::CELLS + 1];
        for &cell in &cells {
            starts[usize::from(cell) + 1] += 1;
        }
        for c in 0..VoxelGrid::CELLS {
            starts[c + 1] += starts[c];
        }
        let mut next = starts.clone();
        let mut members = vec![0u32; points.len()];
        for (point, &cell) in cells.iter().enumerate() {
            let slot = &mut next[usize::from(cell)];
            members[*slot as usize] = point as u32;
            *slot += 1;
        }
        Some(Self { grid, starts, members })
    }

    /// Which voxels hold a point.
    pub fn occupancy(&self) -> [bool; VoxelGrid::CELLS] {
        std::array::from_fn(|cell| self.count(cell) > 0)
    }

    /// How many points voxel `cell` holds.
    ///
    /// # Panics
    /// If `cell` is not below [`VoxelGrid::CELLS`]; so does [`Voxels::members_of`].
    pub fn count(&self, cell: usize) -> usize {
        self.members_of(cell).len()
    }

    /// Indices of the points in voxel `cell`, ascending.
    pub fn members_of(&self, cell: usize) -> &[u32] {
        &self.members[self.starts[cell] as usize..self.starts[cell + 1] as usize]
    }
}

#[cfg(feature = "serde")]
mod as_data {
    use crate::Aabb;

    /// A grid before it is checked.
    #[derive(serde::Deserialize)]
    pub(super) struct VoxelGrid {
        bbox: Aabb,
    }

    impl TryFrom<VoxelGrid> for super::VoxelGrid {
        type Error = &'static str;

        fn try_from(VoxelGrid { bbox }: VoxelGrid) -> Result<Self, &'static str> {
            if bbox.is_empty() {
                Err("voxels of an empty box")
            } else {
                Ok(Self { bbox })
            }
        }
    }

    /// Voxels before they are checked.
    #[derive(serde::Deserialize)]
    pub(super) struct Voxels {
        grid: super::VoxelGrid,
        starts: Vec<u32>,
        members: Vec<u32>,
    }

    impl TryFrom<Voxels> for super::Voxels {
        type Error = &'static str;

        fn try_from(Voxels { grid, starts, members }: Voxels) -> Result<Self, &'static str> {
            let is_whole = starts.len() == super::VoxelGrid::CELLS + 1
                && starts.first() == Some(&0)
                && starts.last().is_some_and(|end| *end as usize == members.len())
                && starts.is_sorted();
            if !is_whole {
                return Err("where voxels start does not fit their number and their points");
            }
            if members.iter().any(|point| *point as usize >= members.len()) {
                return Err("a point of a voxel that is not there");
            }
            Ok(Self { grid, starts, members })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;
    use proptest::prelude::*;

    const UNIT: VoxelGrid = VoxelGrid { bbox: Aabb { min: Vec3::ZERO, max: Vec3::splat(6.0) } };

    #[test]
    fn cells_count_x_slowest() {
        assert_eq!(UNIT.cell_of(vec3(0.5, 0.5, 0.5)), 0);
        assert_eq!(UNIT.cell_of(vec3(0.5, 0.5, 1.5)), 1);
        assert_eq!(UNIT.cell_of(vec3(0.5, 1.5, 0.5)), 6);
        assert_eq!(UNIT.cell_of(vec3(1.5, 0.5, 0.5)), 36);
        assert_eq!(UNIT.cell_of(vec3(2.5, 3.5, 4.5)), 2 * 36 + 3 * 6 + 4);
        assert_eq!(UNIT.voxel_aabb(2 * 36 + 3 * 6 + 4).to_array(), [2.0, 3.0, 4.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn the_upper_face_belongs_to_the_last_voxel_and_inner_faces_to_the_upper() {
        assert_eq!(UNIT.cell_of(Vec3::splat(6.0)), 215);
        assert_eq!(UNIT.cell_of(vec3(6.0, 0.0, 0.0)), 5 * 36);
        assert_eq!(UNIT.cell_of(vec3(0.0, 0.0, 2.0)), 2);
    }

    #[test]
    fn points_outside_go_to_the_nearest_voxel() {
        assert_eq!(UNIT.cell_of(vec3(-1.0, 9.0, 2.5)), 5 * 6 + 2);
    }

    #[test]
    fn a_flat_box_has_one_layer() {
        let wall: Vec<Vec3> = (0..60).map(|i| vec3(2.5, i as f32 * 0.1, (i % 7) as f32)).collect();
        let v = Voxels::from_points(&wall).unwrap();
        assert!((36..VoxelGrid::CELLS).all(|c| v.count(c) == 0));
        assert_eq!((0..36).map(|c| v.count(c)).sum::<usize>(), 60);
        assert_eq!(v.grid.voxel_aabb(0).size().x, 0.0);
    }

    #[test]
    fn one_point_and_none() {
        let v = Voxels::from_points(&[Vec3::ONE; 3]).unwrap();
        assert_eq!(v.members_of(0), [0, 1, 2]);
        assert_eq!(v.occupancy().iter().filter(|&&o| o).count(), 1);
        assert_eq!(Voxels::from_points(&[]), None);
    }

    #[test]
    #[should_panic(expected = "voxel 216")]
    fn a_voxel_that_is_not_there() {
        let _ = UNIT.voxel_aabb(216);
    }

    /// Boxes of ordinary size, far from the origin, and so thin that planes coincide.
    fn points() -> impl Strategy<Value = Vec<Vec3>> {
        let coordinate = prop_oneof![-5.0..5.0f32, 1000.0..1000.0006f32, Just(3.0f32), -1e30..1e30f32];
        let axis = move || prop::collection::vec(coordinate.clone(), 1..200);
        (axis(), axis(), axis()).prop_map(|(x, y, z)| {
            x.iter()
                .zip(&y)
                .zip(&z)
                .map(|((&x, &y), &z)| vec3(x, y, z))
                .collect::<Vec<_>>()
        })
    }

    proptest! {
        #[test]
        fn every_member_is_inside_its_voxel_and_all_are_there_once(points in points()) {
            let v = Voxels::from_points(&points).unwrap();
            prop_assert_eq!(v.starts[VoxelGrid::CELLS] as usize, points.len());
            let mut seen = vec![false; points.len()];
            for cell in 0..VoxelGrid::CELLS {
                prop_assert!(v.members_of(cell).is_sorted());
                prop_assert_eq!(v.occupancy()[cell], v.count(cell) > 0);
                for &m in v.members_of(cell) {
                    let p = points[m as usize];
                    prop_assert!(
                        v.grid.voxel_aabb(cell).contains(p), "{} in {:?}", p, v.grid.voxel_aabb(cell)
                    );
                    prop_assert_eq!(v.grid.cell_of(p), cell);
                    prop_assert!(!std::mem::replace(&mut seen[m as usize], true));
                }
            }
            prop_assert!(seen.iter().all(|&s| s));
        }

        #[test]
        fn voxels_tile_the_box(points in points()) {
            let grid = Voxels::from_points(&points).unwrap().grid;
            let all = (0..VoxelGrid::CELLS).fold(Aabb::EMPTY, |b, c| b.union(grid.voxel_aabb(c)));
            prop_assert_eq!(all, grid.bbox);
        }
    }
}
