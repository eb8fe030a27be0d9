//! A face as a function of the ray's direction: where a ray arrives on it, and how fast that changes from ray
//! to ray.

use crate::hits::NO_FACE;
use glam::{DVec2, DVec3, Vec2};
use s3d_geom::TriMesh;

/// A face seen from an origin. The ray along d arrives at the mean of the corners with the weights w(k)·d /
/// Σ w(k)·d. These are ratios of linear functions of d, so every attribute and its change from pixel to
/// pixel have a closed form.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// The normals of the planes through the origin and the edge opposite to each corner.
    weights: [DVec3; 3],
    /// Their sum: it is parallel to the face's normal by its winding, and its length is twice the face's
    /// area.
    denominator: DVec3,
}

impl Patch {
    pub(crate) fn new(mesh: &TriMesh, face: u32, origin: DVec3) -> Self {
        Self::of(mesh.triangle(face).map(|p| p.as_dvec3()), origin)
    }

    /// Computes the functions from the corners in the world.
    #[inline(always)]
    pub(crate) fn of(world: [DVec3; 3], origin: DVec3) -> Self {
        let [a, b, c] = [world[0] - origin, world[1] - origin, world[2] - origin];
        // Summing the weights would lose the normal of a sliver.
        let denominator = (world[1] - world[0]).cross(world[2] - world[0]);
        Self { weights: [b.cross(c), c.cross(a), a.cross(b)], denominator }
    }

    /// Returns the functions w(k) of the three corners.
    pub(crate) fn weights_of_corners(&self) -> [DVec3; 3] {
        self.weights
    }

    /// Returns the denominator, which replaces the sum of the weights.
    pub(crate) fn denominator(&self) -> DVec3 {
        self.denominator
    }

    /// Returns the face's unit normal on the side that the origin sees, and whether that is the back of the
    /// face.
    #[inline]
    pub(crate) fn normal_towards(&self, d: DVec3) -> (DVec3, bool) {
        let away = self.denominator.dot(d) > 0.0;
        let normal = self.denominator.normalize();
        (if away { -normal } else { normal }, away)
    }

    /// Returns the weights of the corners where the ray along `d` arrives. They add up to 1, and none is
    /// negative.
    #[inline(always)]
    pub(crate) fn weights(&self, d: DVec3) -> [f64; 3] {
        let sign = if self.denominator.dot(d) < 0.0 { -1.0 } else { 1.0 };
        let w = self.weights.map(|w| (sign * w.dot(d)).max(0.0));
        let sum = w[0] + w[1] + w[2];
        if sum > 0.0 { w.map(|w| w / sum) } else { [1.0 / 3.0; 3] }
    }
}

/// Texture coordinates over a face: uv(d) = (u·d, v·d) / (denominator·d).
#[derive(Clone, Copy, Debug)]
pub(crate) struct UvPatch {
    u: DVec3,
    v: DVec3,
    denominator: DVec3,
    /// The bounding box of the coordinates: values that rounding throws outside are clamped.
    min: DVec2,
    max: DVec2,
}

impl UvPatch {
    pub(crate) fn new(patch: &Patch, uvs: [Vec2; 3]) -> Self {
        let uvs = uvs.map(|uv| uv.as_dvec2());
        let mix = |k: usize| (0..3).map(|i| patch.weights[i] * uvs[i][k]).sum::<DVec3>();
        Self {
            u: mix(0),
            v: mix(1),
            denominator: patch.denominator,
            min: uvs[0].min(uvs[1]).min(uvs[2]),
            max: uvs[0].max(uvs[1]).max(uvs[2]),
        }
    }

    /// Returns the coordinates where the ray along `d` arrives, and their changes if the direction changes by
    /// `dx` and by `dy`, to first order.
    #[inline(always)]
    pub(crate) fn at(&self, d: DVec3, dx: DVec3, dy: DVec3) -> (DVec2, DVec2, DVec2) {
        let scale = self.denominator.dot(d).recip();
        let uv = DVec2::new(self.u.dot(d), self.v.dot(d)) * scale;
        let step =
            |s: DVec3| (DVec2::new(self.u.dot(s), self.v.dot(s)) - uv * self.denominator.dot(s)) * scale;
        let x = step(dx);
        let y = step(dy);
        // `max` and `min` also bring NaN, from a face seen exactly edge-on, into the box.
        (uv.max(self.min).min(self.max), x, y)
    }
}

/// Values that are prepared once a face and kept until another face takes their place. The pixels of a face
/// lie together, in one row after another.
pub(crate) struct FaceCache<T> {
    /// The face at each place, and the index of its value. The place follows from the index of the face.
    places: Vec<(u32, u32)>,
    values: Vec<T>,
}

impl<T> FaceCache<T> {
    /// The number of places: far more than the faces across a panorama, and a power of two.
    const SIZE: usize = 8192;

    pub(crate) fn new() -> Self {
        Self { places: vec![(NO_FACE, u32::MAX); Self::SIZE], values: Vec::new() }
    }

    /// Returns the value of a face; `make` prepares it if it is not there.
    #[inline(always)]
    pub(crate) fn get(&mut self, face: u32, make: impl FnOnce() -> T) -> &mut T {
        let (of, at) = &mut self.places[face as usize % Self::SIZE];
        if *of != face {
            *of = face;
            match self.values.get_mut(*at as usize) {
                Some(value) => *value = make(),
                None => {
                    *at = self.values.len() as u32;
                    self.values.push(make());
                }
            }
        }
        &mut self.values[*at as usize]
    }
}
