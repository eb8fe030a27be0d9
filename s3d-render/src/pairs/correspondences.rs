//! Places of a surface that two images show.

use super::{SLACK_M, shows};
use crate::hits::NO_FACE;
use crate::raster::visibility::cast;
use crate::ray::caster::Sight;
use crate::scene::Scene;
use glam::{DVec2, DVec3, dvec2};
use s3d_geom::Camera;

/// A place of a surface that two images show.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correspondence {
    /// Where it is in both images, pixels: x to the right, y down, and (0.5, 0.5) in the middle of the first
    /// pixel. In the first image it is the middle of a pixel.
    pub pixels: [DVec2; 2],
    /// The place, world metres.
    pub point: DVec3,
    /// Index of the face that it lies on.
    pub face: u32,
}

/// Returns up to `count` places that both cameras see from the same side of a face, with nothing in between,
/// by exact rays. They are middles of different pixels of the first image, spread over all that it shares
/// with the second one; fewer than `count` if it shares fewer. The same input gives the same places in the
/// same order.
pub fn correspondences(scene: &Scene<'_>, cameras: [&Camera; 2], count: usize) -> Vec<Correspondence> {
    let [here, there] = cameras;
    let hits = cast(scene, here);
    let rays = here.rays();
    let eye = there.pose.location;
    let mut sight = Sight::from(scene, eye);

    let mut found = Vec::new();
    for pixel in spread(u64::from(here.width) * u64::from(here.height)) {
        if found.len() >= count {
            break;
        }
        let (x, y) = ((pixel % u64::from(here.width)) as u32, (pixel / u64::from(here.width)) as u32);
        let face = hits.face.at(x, y);
        if face == NO_FACE {
            continue;
        }
        let ray = rays.at(x, y);
        let point = here.pose.location + ray * f64::from(hits.depth.at(x, y));
        let normal = scene.mesh().normal(face).as_dvec3();
        let is_same_side = normal.dot(ray) * normal.dot(point - eye) > 0.0;
        if !is_same_side || !shows(there, point) {
            continue;
        }
        // A camera sees its own points.
        if (eye == here.pose.location || sight.is_free(point, SLACK_M))
            && let Some((other, _)) = there.project(point)
        {
            let middle = dvec2(f64::from(x) + 0.5, f64::from(y) + 0.5);
            found.push(Correspondence { pixels: [middle, other], point, face });
        }
    }
    found
}

/// Returns the numbers below `count`, each once, so that the first of them are spread over all: multiples of
/// a Fibonacci number modulo the next one leave gaps of nearly equal length.
fn spread(count: u64) -> impl Iterator<Item = u64> {
    let (mut step, mut modulus) = (1_u64, 1_u64);
    while modulus < count {
        (step, modulus) = (modulus, step + modulus);
    }
    let numbers = (0..modulus).map(move |i| (u128::from(i) * u128::from(step) % u128::from(modulus)) as u64);
    numbers.filter(move |number| *number < count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_spread_and_none_is_left_out() {
        for count in [0, 1, 2, 12, 97, 640 * 480, 1080 * 1080] {
            let mut all: Vec<u64> = spread(count).collect();
            let some = &mut all[..(count / 10) as usize];
            some.sort_unstable();
            let widest = some.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap_or(0);
            assert!(widest < 30, "{count}: {widest}");
            all.sort_unstable();
            assert!(all.into_iter().eq(0..count));
        }
    }
}
