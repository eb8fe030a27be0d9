//! An index that finds the surfels in a box.

use crate::palette::Shade;
use crate::surfel::Surfel;
use glam::{DVec3, IVec3, Vec3, ivec3};
use s3d_geom::Aabb;

/// The number of cells in a metre: cells are 10 cm wide.
const CELLS_A_M: f32 = 10.0;

/// The surfels of a space, ordered by cell: z, then y, then x.
#[derive(Clone, Debug)]
pub struct Index {
    surfels: Vec<Surfel>,
    shades: Vec<Shade>,
    cells: IVec3,
    /// The start of each row of cells along x.
    rows: Vec<u32>,
    mean_color: Vec3,
}

impl Index {
    /// Orders surfels in the frame of a space, whose origin is their least corner.
    pub fn new(mut surfels: Vec<Surfel>) -> Self {
        surfels.sort_by(|a, b| {
            let [i, j] = [a, b].map(cell);
            let [p, q] = [a.position, b.position];
            let by_place = p.z.total_cmp(&q.z).then(p.y.total_cmp(&q.y)).then(p.x.total_cmp(&q.x));
            (i.z, i.y, i.x).cmp(&(j.z, j.y, j.x)).then(by_place)
        });

        let cells = surfels.iter().fold(IVec3::ZERO, |most, s| most.max(cell(s) + 1));
        let mut rows = vec![0u32; (cells.y * cells.z) as usize + 1];
        for s in &surfels {
            let c = cell(s);
            rows[(c.z * cells.y + c.y) as usize + 1] += 1;
        }
        for i in 1..rows.len() {
            rows[i] += rows[i - 1];
        }

        let sum = surfels.iter().map(|s| s.color.as_dvec3()).sum::<DVec3>();
        let mean_color = (sum / surfels.len().max(1) as f64).as_vec3();
        let shades = surfels.iter().map(|s| Shade::new(s.color, mean_color)).collect();
        Self { surfels, shades, cells, rows, mean_color }
    }

    /// The mean colour of all surfels; black if there are none.
    pub fn mean_color(&self) -> Vec3 {
        self.mean_color
    }

    /// All surfels.
    pub fn surfels(&self) -> &[Surfel] {
        &self.surfels
    }

    /// Returns the surfels whose positions are in a box, in their order.
    pub fn within<'a>(&'a self, b: &'a Aabb) -> impl Iterator<Item = &'a Surfel> + 'a {
        self.places_within(b).map(|i| &self.surfels[i])
    }

    /// Returns the same surfels as [`within`](Self::within), with the shades of their colours.
    pub fn shades_within<'a>(&'a self, b: &'a Aabb) -> impl Iterator<Item = (&'a Surfel, &'a Shade)> + 'a {
        self.places_within(b).map(|i| (&self.surfels[i], &self.shades[i]))
    }

    fn places_within<'a>(&'a self, b: &'a Aabb) -> impl Iterator<Item = usize> + 'a {
        let low = (b.min * CELLS_A_M).floor().as_ivec3().max(IVec3::ZERO);
        let high = (b.max * CELLS_A_M).floor().as_ivec3().min(self.cells - 1);
        let rows = (low.z..=high.z).flat_map(move |z| (low.y..=high.y).map(move |y| ivec3(0, y, z)));
        rows.flat_map(move |c| {
            let row = (c.z * self.cells.y + c.y) as usize;
            let [from, to] = [self.rows[row] as usize, self.rows[row + 1] as usize];
            let start = from + self.surfels[from..to].partition_point(|s| column_of(s) < low.x);
            (start..to).take_while(move |&i| column_of(&self.surfels[i]) <= high.x)
        })
        .filter(|&i| b.contains(self.surfels[i].position))
    }
}

fn column_of(s: &Surfel) -> i32 {
    (s.position.x * CELLS_A_M).floor() as i32
}

fn cell(s: &Surfel) -> IVec3 {
    (s.position * CELLS_A_M).floor().as_ivec3().max(IVec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec3;

    fn surfel(i: u32) -> Surfel {
        let r = |k: u32| (i.wrapping_mul(k) % 997) as f32 / 997.0;
        let position = vec3(3.0 * r(7919), 2.0 * r(104_729), r(1_299_709));
        let extent = Aabb { min: position, max: position };
        Surfel { position, extent, normal: Vec3::Z, curvature: 0.0, color: Vec3::ZERO, room: 0 }
    }

    #[test]
    fn a_box_has_the_surfels_that_a_search_finds() {
        let index = Index::new((0..2000).map(surfel).collect());
        for i in 0..50 {
            let min = surfel(i).position - 0.2;
            let b = Aabb { min, max: min + surfel(i + 77).position };
            let plain = index.surfels().iter().filter(|s| b.contains(s.position)).count();
            assert_eq!(index.within(&b).count(), plain, "{b:?}");
        }
        assert_eq!(
            Index::new(Vec::new())
                .within(&Aabb { min: Vec3::ZERO, max: Vec3::ONE })
                .count(),
            0
        );
    }
}
