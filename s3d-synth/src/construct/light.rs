//! The light that the scene's textures carry, as a scan's do: bright near windows and lamps, dark in corners
//! and under furniture. A rule of thumb, no simulation: it only has to look right.

use s3d_geom::{Aabb, glam::Vec3};

/// A small shining surface.
#[derive(Clone, Copy)]
pub(crate) struct Lamp {
    /// Its middle, building metres.
    pub(crate) center: Vec3,
    /// The direction in which it shines; a unit vector.
    pub(crate) normal: Vec3,
    /// Its area in m² times its brightness.
    pub(crate) power: f32,
}

/// The lamps of a room, and the bodies that block their light.
#[derive(Clone, Default)]
pub(crate) struct Light {
    /// Windows and lamps.
    pub(crate) lamps: Vec<Lamp>,
    /// The height of the room. The brightness of its ceiling depends on it.
    pub(crate) height_m: f32,
    blockers: Vec<Aabb>,
}

impl Light {
    pub(crate) fn new(lamps: Vec<Lamp>, height_m: f32) -> Self {
        Self { lamps, height_m, blockers: Vec::new() }
    }

    /// Adds a body that darkens what is near it.
    pub(crate) fn block(&mut self, body: Aabb) {
        self.blockers.push(body);
    }

    /// The brightness of a surface at `p` with the unit normal `n` if nothing is in between: about 1 in
    /// bright places.
    pub(crate) fn open(&self, p: Vec3, n: Vec3) -> f32 {
        // The floor throws light back to the ceiling, but not to the undersides of tables.
        let height = (p.z / self.height_m.max(0.1)).min(1.0);
        let ambient = if n.z < -0.5 {
            0.46 + 0.42 * height * height
        } else {
            0.74 + 0.04 * n.z
        };
        let lamps: f32 = self
            .lamps
            .iter()
            .map(|lamp| {
                let d = lamp.center - p;
                let square = d.length_squared() + 0.25;
                let cosines = n.dot(d).max(0.0) * (-lamp.normal.dot(d)).max(0.0) / square;
                lamp.power * cosines / (std::f32::consts::PI * square)
            })
            .sum();
        // Bright places brighten less than they should, as in a photograph.
        let sum = ambient + lamps;
        if sum < 0.9 {
            sum
        } else {
            0.9 + (sum - 0.9) / (1.0 + 2.0 * (sum - 0.9))
        }
    }

    /// The brightness of [`Light::open`], darkened by the bodies close by.
    pub(crate) fn at(&self, p: Vec3, n: Vec3) -> f32 {
        let axis = n.abs().max_position();
        let shade: f32 = self
            .blockers
            .iter()
            .map(|b| {
                // How far the body stands out of the surface: a picture shades less of its wall than a
                // cupboard.
                let out = (b.center() - p).dot(n) + 0.5 * b.size().dot(n.abs());
                if out <= 0.0 {
                    return 1.0;
                }
                let size = b.size();
                let area = size[(axis + 1) % 3] * size[(axis + 2) % 3];
                let near = (p.clamp(b.min, b.max) - p).length_squared();
                let reach = out * out / (out * out + near);
                1.0 - 0.45 * reach * area / (area + 16.0 * near + 1e-6)
            })
            .product();
        self.open(p, n) * shade.max(0.3)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::vec3;

    #[test]
    fn it_is_brighter_near_the_lamp_and_darker_near_a_box() {
        let lamp = Lamp { center: vec3(0.0, 0.0, 2.5), normal: -Vec3::Z, power: 2.0 };
        let mut light = Light::new(vec![lamp], 2.5);
        assert!(light.open(Vec3::ZERO, Vec3::Z) > light.open(vec3(3.0, 0.0, 0.0), Vec3::Z));
        assert_eq!(light.open(Vec3::ZERO, Vec3::Z), light.at(Vec3::ZERO, Vec3::Z));
        light.block(Aabb { min: vec3(0.1, -0.5, 0.0), max: vec3(1.0, 0.5, 1.0) });
        let [near, far] = [0.05, -2.0].map(|x| {
            let p = vec3(x, 0.0, 0.0);
            light.at(p, Vec3::Z) / light.open(p, Vec3::Z)
        });
        assert!(near < 0.7 && far > 0.97, "{near} {far}");
    }
}
