//! How alike two things are: by size, shape, place above the floor, and colour.

use s3d_geom::TriMesh;
use s3d_geom::glam::{DVec3, Vec3};

/// The weights of the numbers of a [`Descriptor`]: what differs by 1 / weight counts as 1.
///
/// The numbers are: the area and the three extents, as logarithms; the heights of the lowest and the highest
/// point above the floor, metres; how level the surface is, and how much of it looks up rather than down;
/// lightness and the two axes of colour in Oklab.
const WEIGHTS: [f64; 11] = [3.0, 5.0, 4.0, 4.0, 4.0, 3.0, 6.0, 2.0, 5.0, 15.0, 15.0];

/// An extent is taken to be this much larger, metres, so that thin things do not differ by their noise.
const NOISE_M: f64 = 0.02;

/// Sums over some surface. Those of two surfaces add up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sums {
    pub(super) area_m2: f64,
    /// Places times area, from an origin near the mesh.
    first: DVec3,
    /// xx, yy, zz and xy times area.
    second: [f64; 4],
    color: DVec3,
    /// The amount of z in the normals times area, and the same with its sign.
    level: f64,
    upward: f64,
    low: Vec3,
    high: Vec3,
}

/// What a thing is like.
#[derive(Clone, Copy, Debug)]
pub(super) struct Descriptor([f64; 11]);

impl Default for Sums {
    fn default() -> Self {
        Self {
            area_m2: 0.0,
            first: DVec3::ZERO,
            second: [0.0; 4],
            color: DVec3::ZERO,
            level: 0.0,
            upward: 0.0,
            low: Vec3::INFINITY,
            high: Vec3::NEG_INFINITY,
        }
    }
}

impl Sums {
    /// Returns the sums of a face. `color` is its colour in Oklab. Sums that are added need one `origin`.
    pub(super) fn of_face(mesh: &TriMesh, face: u32, color: Vec3, origin: Vec3) -> Self {
        let corners = mesh.triangle(face);
        let [a, b, c] = corners.map(|corner| (corner - origin).as_dvec3());
        let area_m2 = mesh.area(face);
        let sum = a + b + c;
        // The integral of a product over a triangle.
        let product =
            |i: usize, j: usize| area_m2 / 12.0 * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + sum[i] * sum[j]);
        let up = f64::from(mesh.normal(face).z);
        Self {
            area_m2,
            first: sum * (area_m2 / 3.0),
            second: [product(0, 0), product(1, 1), product(2, 2), product(0, 1)],
            color: color.as_dvec3() * area_m2,
            level: up.abs() * area_m2,
            upward: up * area_m2,
            low: corners[0].min(corners[1]).min(corners[2]),
            high: corners[0].max(corners[1]).max(corners[2]),
        }
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.area_m2 += other.area_m2;
        self.first += other.first;
        for (sum, more) in self.second.iter_mut().zip(other.second) {
            *sum += more;
        }
        self.color += other.color;
        self.level += other.level;
        self.upward += other.upward;
        self.low = self.low.min(other.low);
        self.high = self.high.max(other.high);
    }

    /// The lowest point, world metres.
    pub(super) fn bottom_m(&self) -> f32 {
        self.low.z
    }

    /// Returns what a thing of this surface is like. `floor_m` is the height of the floor under it.
    pub(super) fn descriptor(&self, floor_m: f32) -> Descriptor {
        let mean = self.first / self.area_m2;
        let [xx, yy, zz, xy] = self.second.map(|sum| sum / self.area_m2);
        let (xx, yy, zz, xy) =
            (xx - mean.x * mean.x, yy - mean.y * mean.y, zz - mean.z * mean.z, xy - mean.x * mean.y);
        // The variances along the two axes on the plan, whichever way the thing is turned.
        let apart = (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        let extents = [0.5 * (xx + yy) + apart, 0.5 * (xx + yy) - apart, zz];
        let [long, wide, tall] = extents.map(|variance| libm::log(variance.max(0.0).sqrt() + NOISE_M));
        let color = self.color / self.area_m2;
        let above_m = |z: f32| f64::from(z - floor_m);
        Descriptor([
            libm::log(self.area_m2),
            long,
            wide,
            tall,
            above_m(self.low.z),
            above_m(self.high.z),
            self.level / self.area_m2,
            self.upward / self.area_m2,
            color.x,
            color.y,
            color.z,
        ])
    }
}

impl Descriptor {
    /// Returns how much two things differ: 0 for equal ones, and mostly below 3 for two of a kind.
    pub(super) fn difference(&self, other: &Self) -> f64 {
        let squares = self.0.iter().zip(other.0).zip(WEIGHTS).map(|((a, b), weight)| {
            let difference = weight * (a - b);
            difference * difference
        });
        squares.sum::<f64>().sqrt()
    }
}
