//! A room with desks, chairs and shelves, and a fine texture all over it.

use super::checked;
use s3d_geom::glam::{DVec3, Vec3, vec2, vec3};
use s3d_geom::{Material, MeshParts, Raster, Texture, TriMesh};

/// A place to stand in a [`classroom`].
pub const CLASSROOM_LOCATION: DVec3 = DVec3::new(4.03, 3.07, 1.5);

/// A furnished room of 8 × 6 × 3 m whose surfaces are noisy grids like a scan's, textured with a grain of 2
/// cm. It has about `faces` faces, and more if cells are larger than parts of the furniture: 1.35 times as
/// many for 20,000. Its texture repeats every 2 m and has 1024² texels. The room is the same every time.
///
/// # Panics
/// If `faces` is 0 or beyond 100 million.
pub fn classroom(faces: usize) -> TriMesh {
    // The surfaces below add up to 210 m²; two faces a cell.
    assert!((1..=100_000_000).contains(&faces), "a room of {faces} faces");
    let cell = (2.0 * 210.0 / faces as f32).sqrt();

    let mut b = Builder { cell, ..Builder::default() };
    b.inside_out(vec3(0.0, 0.0, 0.0), vec3(8.0, 6.0, 3.0));

    for k in 0..8 {
        let at = vec3(1.0 + (k % 4) as f32 * 1.7, if k < 4 { 1.2 } else { 4.4 }, 0.7);
        b.cuboid(at, at + vec3(1.4, 0.7, 0.04));
        for (x, y) in [(0.02, 0.02), (1.34, 0.02), (0.02, 0.64), (1.34, 0.64)] {
            let foot = vec3(at.x + x, at.y + y, 0.0);
            b.cuboid(foot, foot + vec3(0.04, 0.04, 0.7));
        }
        b.cuboid(at + vec3(0.3, 0.2, 0.04), at + vec3(0.7, 0.4, 0.4));
        let seat = vec3(at.x + 0.4, at.y - 0.5, 0.42);
        b.cuboid(seat, seat + vec3(0.45, 0.45, 0.06));
        b.cuboid(seat + vec3(0.0, 0.0, 0.06), seat + vec3(0.45, 0.05, 0.55));
    }

    for k in 0..5 {
        for shelf in 0..6 {
            let at = vec3(0.8 + k as f32 * 1.3, 5.6, 0.02 + shelf as f32 * 0.36);
            b.cuboid(at, at + vec3(0.9, 0.3, 0.02));
        }
    }
    b.finish()
}

#[derive(Default)]
struct Builder {
    cell: f32,
    parts: MeshParts,
}

impl Builder {
    fn grid(&mut self, origin: Vec3, u: Vec3, v: Vec3) {
        let nu = (u.length() / self.cell).ceil().max(1.0) as u32;
        let nv = (v.length() / self.cell).ceil().max(1.0) as u32;
        let normal = u.cross(v).normalize();
        let first = self.parts.positions.len() as u32;

        for j in 0..=nv {
            for i in 0..=nu {
                let s = i as f32 / nu as f32;
                let t = j as f32 / nv as f32;
                let p = origin + u * s + v * t;
                let inner = i > 0 && j > 0 && i < nu && j < nv;
                let noise = if inner {
                    noise(p) * 0.05 * self.cell.min(0.1)
                } else {
                    0.0
                };
                self.parts.positions.push(p + normal * noise);
                self.parts.uvs.push(vec2(s * u.length(), t * v.length()) * 0.5);
            }
        }

        for j in 0..nv {
            for i in 0..nu {
                let a = first + j * (nu + 1) + i;
                let b = a + 1;
                let c = a + nu + 2;
                let d = a + nu + 1;
                self.parts.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }

    fn cuboid(&mut self, min: Vec3, max: Vec3) {
        let x = Vec3::X * (max.x - min.x);
        let y = Vec3::Y * (max.y - min.y);
        let z = Vec3::Z * (max.z - min.z);
        for (origin, u, v) in
            [(min, y, x), (min, x, z), (min, z, y), (min + z, x, y), (min + y, z, x), (min + x, y, z)]
        {
            self.grid(origin, u, v);
        }
    }

    fn inside_out(&mut self, min: Vec3, max: Vec3) {
        let x = Vec3::X * (max.x - min.x);
        let y = Vec3::Y * (max.y - min.y);
        let z = Vec3::Z * (max.z - min.z);
        for (origin, u, v) in
            [(min, x, y), (min, z, x), (min, y, z), (min + z, y, x), (min + y, x, z), (min + x, z, y)]
        {
            self.grid(origin, u, v);
        }
    }

    fn finish(self) -> TriMesh {
        let mut parts = self.parts;
        parts.face_uvs = parts.faces.clone();
        parts.face_materials = vec![0; parts.faces.len()];
        let image = (0..1024u32 * 1024)
            .map(|k| {
                let x = k % 1024;
                let y = k / 1024;
                let grain = (noise(vec3(x as f32, y as f32, 0.5)) * 20.0) as i32;
                let tile = if (x / 64 + y / 64) % 2 == 0 { 150 } else { 90 };
                [(tile + grain) as u8, (tile + grain / 2) as u8, (200 - tile + grain) as u8]
            })
            .collect();
        let image = Raster::from_vec(1024, 1024, image);
        parts.textures = vec![Texture { name: "grain".into(), image, wrap: Default::default() }];
        parts.materials = vec![Material { name: "grain".into(), color: [128; 3], texture: Some(0) }];
        checked(parts)
    }
}

/// Between −1 and 1, from the bits of the point.
fn noise(p: Vec3) -> f32 {
    let mut h = p.x.to_bits().wrapping_mul(0x9E37_79B1) ^ p.y.to_bits().wrapping_mul(0x85EB_CA77);
    h = (h ^ p.z.to_bits()).wrapping_mul(0xC2B2_AE3D);
    h ^= h >> 15;
    h = h.wrapping_mul(0x27D4_EB2F);
    h ^= h >> 13;
    (h & 0xFFFF) as f32 / 32768.0 - 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stays_the_same_with_a_place_to_stand() {
        // Figures of benches are held against earlier ones: not a face more or less.
        for (asked, faces) in [(500, 1_700), (20_000, 27_056), (100_000, 116_644)] {
            let room = classroom(asked);
            assert_eq!(room.faces().len(), faces, "{asked}");
            assert!(
                !room
                    .positions()
                    .iter()
                    .any(|p| p.as_dvec3().distance(CLASSROOM_LOCATION) < 0.3)
            );
        }
    }
}
