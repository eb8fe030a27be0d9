//! The planes of faces, the lengths of rays, and rounding.

use glam::DVec3;
use s3d_geom::{Camera, Rays, TriMesh};

/// The plane of a face: the points p with normal · (p − eye) = offset.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    /// The unit normal by the winding of the face.
    pub(super) normal: DVec3,
    /// The signed distance from the eye to the plane along the normal, metres.
    pub(super) offset: f64,
}

impl Plane {
    pub(super) fn new(mesh: &TriMesh, face: u32, eye: DVec3) -> Self {
        let [a, b, c] = mesh.triangle(face).map(|corner| corner.as_dvec3());
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Self { normal, offset: normal.dot(a - eye) }
    }

    /// Returns the depth at which the ray along `direction` meets the plane. `None` if it does not.
    pub(super) fn depth(&self, direction: DVec3) -> Option<f64> {
        let depth = self.offset / self.normal.dot(direction);
        (depth > 0.0 && depth.is_finite()).then_some(depth)
    }

    /// Returns the cosine of the angle between the normal and a ray, without its sign.
    pub(super) fn cosine(&self, direction: DVec3) -> f64 {
        self.normal.dot(direction).abs() / direction.length()
    }
}

/// The lengths of an image's rays. The squared length of a ray of a view is a polynomial of its row.
pub(super) enum RayLengths {
    Views { constant: Vec<f64>, linear: Vec<f64>, square: f64 },
    Panorama,
}

impl RayLengths {
    pub(super) fn new(camera: &Camera) -> Self {
        match camera.rays() {
            Rays::Perspective { x_step, y_step, origin } => {
                let columns = (0..camera.width).map(|i| origin + x_step * (f64::from(i) + 0.5));
                let columns: Vec<DVec3> = columns.collect();
                Self::Views {
                    constant: columns.iter().map(|column| column.length_squared()).collect(),
                    linear: columns.iter().map(|column| 2.0 * column.dot(y_step)).collect(),
                    square: y_step.length_squared(),
                }
            }
            Rays::Equirectangular { .. } => Self::Panorama,
        }
    }

    /// Writes the lengths of a row.
    #[inline(always)]
    pub(super) fn row(&self, row: usize, out: &mut [f64]) {
        match self {
            Self::Views { constant, linear, square } => {
                let t = row as f64 + 0.5;
                let terms = constant.iter().zip(linear);
                for (out, (constant, linear)) in out.iter_mut().zip(terms) {
                    *out = (constant + t * (linear + t * square)).sqrt();
                }
            }
            Self::Panorama => out.fill(1.0),
        }
    }
}

/// Rounds a number from 0 down, to `most` at most. Unlike a cast, it is the same few instructions in every
/// register.
#[inline(always)]
pub(super) fn rounded_down(number: f64, most: f64) -> u32 {
    /// 2⁵²: a sum with it has no room for a fraction, so the processor rounds to the nearest number.
    const SHIFT: f64 = 4_503_599_627_370_496.0;
    let number = if number < most { number } else { most };
    let shifted = number + SHIFT;
    shifted.to_bits() as u32 - u32::from(shifted - SHIFT > number)
}
