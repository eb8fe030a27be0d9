//! Normals of points that rays hit.

use crate::grid::{Mix, Place};
use rayon::prelude::*;
use s3d_geom::glam::{DMat3, DVec3, Vec3};
use std::collections::HashMap;
use std::hash::BuildHasherDefault;

/// The normals of small cubes of points. Points that were seen from different sides are kept apart, so that
/// both sides of a thin board have a normal.
pub(super) struct Normals {
    cube_m: f64,
    normals: HashMap<u64, DVec3, BuildHasherDefault<Mix>>,
}

/// The side of a cube in cells. Points of 3 × 3 × 3 cubes make a normal.
const CUBE_CELLS: f64 = 1.5;
/// The fewest points of a normal.
const LEAST_POINTS: f64 = 6.0;
/// Points are not on a plane if they lie farther from it than this share of their extent.
const MOST_ROUND: f64 = 0.3;

/// Count, sum and products of the points of a cube, about its middle.
#[derive(Clone, Copy, Default)]
struct Moments {
    count: f64,
    sum: DVec3,
    /// xx, yy, zz and xy, yz, zx.
    squares: DVec3,
    products: DVec3,
}

impl Normals {
    pub(super) fn of(origins: &[Vec3], points: &[Vec3], rays: &[usize], cell_m: f64) -> Self {
        let cube_m = CUBE_CELLS * cell_m;
        let keyed = |i: &usize| {
            let point = points[*i].as_dvec3();
            (key(cube_of(point, cube_m), side_of(point - origins[*i].as_dvec3())), *i)
        };
        let mut order: Vec<(u64, usize)> = rays.par_iter().map(keyed).collect();
        order.par_sort_unstable();

        let mut cubes: HashMap<u64, Moments, BuildHasherDefault<Mix>> = HashMap::default();
        let groups: Vec<&[(u64, usize)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
        for group in &groups {
            let (cube, _) = place_of(group[0].0);
            let middle = middle_of(cube, cube_m);
            let mut moments = Moments::default();
            group
                .iter()
                .for_each(|(_, i)| moments.add(points[*i].as_dvec3() - middle));
            cubes.insert(group[0].0, moments);
        }

        let normal = |group: &&[(u64, usize)]| {
            let (cube, side) = place_of(group[0].0);
            let mut all = Moments::default();
            for k in 0..27 {
                let step = [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1];
                let beside = [0, 1, 2].map(|k| cube[k] + step[k]);
                if let Some(moments) = cubes.get(&key(beside, side)) {
                    all.join(moments, DVec3::from_array(step.map(f64::from)) * cube_m);
                }
            }
            all.normal().map(|normal| (group[0].0, normal))
        };
        let normals: Vec<(u64, DVec3)> = groups.par_iter().filter_map(normal).collect();
        Self { cube_m, normals: normals.into_iter().collect() }
    }

    /// Returns the normal of a point, towards where its ray came from. Without enough points around, it is
    /// the ray.
    pub(super) fn at(&self, point: DVec3, along: DVec3) -> DVec3 {
        let normal = self.normals.get(&key(cube_of(point, self.cube_m), side_of(along)));
        let normal = normal.copied().unwrap_or(-along);
        let normal = if normal.dot(along) > 0.0 { -normal } else { normal };
        // A plane along the ray says nothing of its distance.
        if -normal.dot(along) < 0.05 { -along } else { normal }
    }
}

impl Moments {
    fn add(&mut self, p: DVec3) {
        self.count += 1.0;
        self.sum += p;
        self.squares += p * p;
        self.products += p * DVec3::new(p.y, p.z, p.x);
    }

    /// Adds moments about a point that is `off` away.
    fn join(&mut self, other: &Self, off: DVec3) {
        let turned = |v: DVec3| DVec3::new(v.y, v.z, v.x);
        self.count += other.count;
        self.sum += other.sum + off * other.count;
        self.squares += other.squares + 2.0 * off * other.sum + off * off * other.count;
        self.products += other.products
            + off * turned(other.sum)
            + turned(off) * other.sum
            + off * turned(off) * other.count;
    }

    /// Returns the direction in which the points extend least, if they lie on a plane.
    fn normal(&self) -> Option<DVec3> {
        if self.count < LEAST_POINTS {
            return None;
        }
        let mean = self.sum / self.count;
        let squares = self.squares / self.count - mean * mean;
        let products = self.products / self.count - mean * DVec3::new(mean.y, mean.z, mean.x);
        let [xy, yz, zx] = products.to_array();
        let spread = DMat3::from_cols_array(&[squares.x, xy, zx, xy, squares.y, yz, zx, yz, squares.z]);

        // Inverse iteration finds the smallest extent, and the trace tells the others.
        let trace = squares.element_sum();
        let inverse = (spread + DMat3::from_diagonal(DVec3::splat(1e-6 * trace))).inverse();
        let mut normal = DVec3::new(0.48, 0.6, 0.64);
        for _ in 0..12 {
            normal = (inverse * normal).try_normalize()?;
        }
        let least = normal.dot(spread * normal);
        // The middle extent: the determinant is the product of all three.
        let across = normal.any_orthonormal_vector();
        let other = normal.cross(across);
        let [a, b, c] = [across.dot(spread * across), across.dot(spread * other), other.dot(spread * other)];
        let middle = 0.5 * (a + c) - (0.25 * (a - c) * (a - c) + b * b).sqrt();
        (middle > 0.0 && least.max(0.0) < MOST_ROUND * MOST_ROUND * middle).then_some(normal)
    }
}

/// Returns which side of a cube a direction leads through, 0 to 5.
fn side_of(direction: DVec3) -> u64 {
    let size = direction.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    2 * axis + u64::from(direction[axis as usize] < 0.0)
}

fn cube_of(point: DVec3, cube_m: f64) -> Place {
    (point / cube_m).floor().as_ivec3().to_array()
}

fn middle_of(cube: Place, cube_m: f64) -> DVec3 {
    (DVec3::from_array(cube.map(f64::from)) + 0.5) * cube_m
}

/// Returns a cube and a side as one number: 20 bits an axis, and 3.
fn key(cube: Place, side: u64) -> u64 {
    let [x, y, z] = cube.map(|k| (k + (1 << 19)) as u64);
    ((z << 20 | y) << 20 | x) << 3 | side
}

fn place_of(key: u64) -> (Place, u64) {
    let axis = |shift: u32| (key >> shift & 0xf_ffff) as i32 - (1 << 19);
    ([axis(3), axis(23), axis(43)], key & 7)
}
