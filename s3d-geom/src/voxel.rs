//! The box of an instance, split into 6 × 6 × 6 voxels.
//!
//! Source: `s3d_io::formats`, "What is written" (`Bbox`, `Voxels`, `Voxel_Occupancy` and `Points_per_Voxel`
//! of the data set).

use crate::Aabb;
use glam::Vec3;

/// A box split into [`VoxelGrid::SIDE`]³ equal voxels.
///
/// Voxel (ix, iy, iz), counted along the axes from `min` of the box, has the index `(ix * 6 + iy) * 6 + iz`.
/// A point between two voxels belongs to the upper one. A point on the upper face of the box belongs to the
/// last voxel. Along an axis without extent, there is only layer 0.
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

/// The seven planes that bound the six layers, for each of the three axes.
type Planes = [[f32; VoxelGrid::SIDE + 1]; 3];

impl VoxelGrid {
    /// The number of voxels along each axis.
    pub const SIDE: usize = 6;
    /// The number of all voxels.
    pub const CELLS: usize = Self::SIDE * Self::SIDE * Self::SIDE;

    /// Returns the index of the voxel that contains `point`. A point outside of the box belongs to the
    /// nearest voxel.
    pub fn cell_of(&self, point: Vec3) -> usize {
        cell_between(&self.planes(), point)
    }

    /// Writes the voxel of each of `points` into `out`, as [`VoxelGrid::cell_of`] returns it. The old content
    /// of `out` is replaced.
    pub fn cells_of(&self, points: &[Vec3], out: &mut Vec<u8>) {
        let planes = self.planes();
        out.clear();
        out.extend(points.iter().map(|&p| cell_between(&planes, p) as u8));
    }

    /// Returns the box of voxel `cell`. It contains, in `f32`, every point of the whole box for which
    /// [`VoxelGrid::cell_of`] returns `cell`.
    ///
    /// # Panics
    /// If `cell` is not below [`VoxelGrid::CELLS`].
    pub fn voxel_aabb(&self, cell: usize) -> Aabb {
        assert!(cell < Self::CELLS, "voxel {cell} of {}", Self::CELLS);
        let planes = self.planes();
        let layers = [cell / (Self::SIDE * Self::SIDE), cell / Self::SIDE % Self::SIDE, cell % Self::SIDE];
        // The planes of an axis without extent coincide. Its other layers are just as flat, and empty.
        Aabb {
            min: Vec3::from_array(std::array::from_fn(|axis| planes[axis][layers[axis]])),
            max: Vec3::from_array(std::array::from_fn(|axis| planes[axis][layers[axis] + 1])),
        }
    }

    /// Returns the planes between the layers. They decide for points and for the boxes of voxels, so the two
    /// cannot disagree by a rounding.
    fn planes(&self) -> Planes {
        let min = self.bbox.min.to_array();
        let max = self.bbox.max.to_array();
        std::array::from_fn(|axis| {
            let low = f64::from(min[axis]);
            let high = f64::from(max[axis]);
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

/// The points of an instance, sorted into the voxels of their tightest box.
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
    /// The voxels of the tightest box of the points.
    pub grid: VoxelGrid,
    /// [`VoxelGrid::CELLS`] + 1 places in `members`. The points of voxel `c` are
    /// `members[starts[c]..starts[c + 1]]`.
    pub starts: Vec<u32>,
    /// The indices of all points, grouped by voxel, ascending within a voxel.
    pub members: Vec<u32>,
}

impl Voxels {
    /// Sorts points, which must be finite, into the voxels of their box. Returns `None` if there is no point.
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

    /// Returns for each voxel whether it contains a point.
    pub fn occupancy(&self) -> [bool; VoxelGrid::CELLS] {
        std::array::from_fn(|cell| self.count(cell) > 0)
    }

    /// Returns the number of points in voxel `cell`.
    ///
    /// # Panics
    /// If `cell` is not below [`VoxelGrid::CELLS`].
    pub fn count(&self, cell: usize) -> usize {
        self.members_of(cell).len()
    }

    /// Returns the indices of the points in voxel `cell`, ascending.
    ///
    /// # Panics
    /// If `cell` is not below [`VoxelGrid::CELLS`].
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
                return Err("`starts` does not fit the number of voxels and points");
            }
            if members.iter().any(|point| *point as usize >= members.len()) {
                return Err("a voxel has a point that is not there");
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

    /// Makes boxes of ordinary size, far from the origin, and so thin that planes coincide.
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
