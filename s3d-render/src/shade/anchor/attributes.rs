//! Attributes of a face, as functions of a ray's direction.

use crate::shade::patch::Patch;
use glam::DVec3;

/// Up to three attributes of a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attributes {
    /// α of each attribute.
    pub(crate) numerator: [DVec3; 3],
    /// ω.
    pub(crate) denominator: DVec3,
    /// The bounds of each attribute: values that rounding throws outside are clamped.
    pub(crate) bounds: [(f64, f64); 3],
}

impl Attributes {
    /// Interpolates the values at the face's corners; `values[k]` belong to attribute k.
    #[inline(always)]
    pub(crate) fn new(patch: &Patch, values: [[f64; 3]; 3]) -> Self {
        let [p, q, r] = patch.weights_of_corners();
        let (mut numerator, mut bounds) = ([DVec3::ZERO; 3], [(0.0, 0.0); 3]);
        for (k, [a, b, c]) in values.into_iter().enumerate() {
            numerator[k] = p * a + q * b + r * c;
            bounds[k] = (min(min(a, b), c), max(max(a, b), c));
        }
        Self { numerator, denominator: patch.denominator(), bounds }
    }

    /// Returns the bound that [`AnchorBatch::anchors`](crate::shade::anchor::AnchorBatch::anchors) describes.
    ///
    /// Let a₀ = a(e), and 1/w = z(d) / z(e), where z is the distance of the face along a ray. An attribute
    /// changes by (m − (a − a₀) ω / ω·e) · step / w, where m = (α − a₀ω) / ω·e; and z is
    /// greatest at a corner.
    #[inline(always)]
    pub(super) fn fastest(&self, world: [DVec3; 3], origin: DVec3, e: DVec3, steps: [DVec3; 2]) -> f64 {
        let scale = self.denominator.dot(e).recip();
        let here = self.denominator.dot(world[0] - origin) * scale;

        let mut far = 0.0;
        for corner in world {
            far = max(far, (corner - origin).length_squared());
        }
        // The length of a ray's direction is at least 1, so z of a corner is no more than its distance.

        let mut sum = 0.0;
        for k in 0..2 {
            let (low, high) = self.bounds[k];
            let value = min(max(self.numerator[k].dot(e) * scale, low), high);
            for step in steps {
                let a = self.numerator[k].dot(step) * scale;
                let w = self.denominator.dot(step) * scale;
                let most = (a - w * value).abs() + (high - low) * w.abs();
                sum += most * most;
            }
        }
        sum * far / (here * here) * 1.001
    }
}

#[inline(always)]
pub(super) fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(super) fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_point_of_a_face_changes_faster_than_its_bound(
            corners in prop::array::uniform3((-3.0..3.0f64, -3.0..3.0f64, 0.05..9.0f64)),
            values in prop::array::uniform3(prop::array::uniform3(-900.0..900.0f64)),
            (p, q) in (0.0..1.0f64, 0.0..1.0f64), (r, t) in (0.0..1.0f64, 0.0..1.0f64),
        ) {
            // The rays are (x, y, 1) from a place. The anchor and the pixel are anywhere on the face.
            let origin = DVec3::new(0.5, -0.25, 2.0);
            let world = corners.map(|(x, y, z)| DVec3::new(x * z, y * z, z) + origin);
            let attributes = Attributes::new(&Patch::of(world, origin), values);
            let ray = |p: f64, q: f64| {
                let at = world[0] * (1.0 - p) + world[1] * (p * (1.0 - q)) + world[2] * (p * q) - origin;
                at / at.z
            };
            let steps = [DVec3::new(0.01, 0.0, 0.0), DVec3::new(0.0, 0.01, 0.0)];
            let fastest = attributes.fastest(world, origin, ray(p, q), steps);

            let d = ray(r, t);
            let mut sum = 0.0;
            let scale = attributes.denominator.dot(d).recip();
            for numerator in &attributes.numerator[..2] {
                for step in steps {
                    let below = attributes.denominator.dot(step);
                    let change = numerator.dot(step) - numerator.dot(d) * scale * below;
                    sum += (change * scale) * (change * scale);
                }
            }
            prop_assert!(sum <= fastest * (1.0 + 1e-6) || !fastest.is_finite(), "{sum} {fastest}");
        }
    }
}
