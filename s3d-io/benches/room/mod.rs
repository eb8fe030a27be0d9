//! Images of a furnished room, made from a fixed seed: uneven walls as a scan has them, seen at an angle, a
//! texture with noise, and a few dozen instances.

use s3d_geom::Raster;
use s3d_geom::glam::{Vec3, vec3};
use s3d_io::image::pretty_color;

/// Width and height of the images, in pixels.
pub(crate) const SIZE: u32 = 1080;

/// What a pixel of the room shows.
#[derive(Clone, Copy)]
struct Seen {
    xyz: Vec3,
    depth: f32,
    normal: Vec3,
    instance: u32,
}

/// Returns the noise of a pixel, −1 to 1, from a hash.
pub(crate) fn noise(x: u32, y: u32) -> f32 {
    let mut h = x.wrapping_mul(0x9e37_79b1) ^ y.wrapping_mul(0x85eb_ca77);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    ((h ^ (h >> 15)) >> 8) as f32 / (1 << 23) as f32 - 1.0
}

/// Returns the unevenness of a surface: its height in metres over a triangle of a grid of 4 cm, and the
/// slopes along both axes of the grid.
fn uneven(u: f32, v: f32) -> (f32, [f32; 2]) {
    let (u, v) = (u / 0.04, v / 0.04);
    let (i, j) = (u.floor(), v.floor());
    let corner = |di: u32, dj: u32| 0.004 * noise(i as i32 as u32 + di, j as i32 as u32 + dj + 0x5000);
    let (s, t) = (u - i, v - j);
    let (ds, dt) = if s > t {
        (corner(1, 0) - corner(0, 0), corner(1, 1) - corner(1, 0))
    } else {
        (corner(1, 1) - corner(0, 1), corner(0, 1) - corner(0, 0))
    };
    (corner(0, 0) + s * ds + t * dt, [ds / 0.04, dt / 0.04])
}

/// Renders a box-shaped room of 6 × 5 × 3 m, with balls on the floor and boards on the walls, seen from
/// inside.
fn room() -> Raster<Seen> {
    let eye = vec3(3.1, 0.7, 1.5);
    let corner = vec3(6.0, 5.0, 3.0);
    let balls: Vec<(Vec3, f32)> = (0..24)
        .map(|i| (vec3(0.5 + 0.24 * i as f32, 2.0 + (i * 7 % 12) as f32 * 0.25, 0.3), 0.3))
        .collect();
    let pixel = |x: u32, y: u32| {
        let (a, b) = ((x as f32 + 0.5) / SIZE as f32 - 0.5, (y as f32 + 0.5) / SIZE as f32 - 0.5);
        let d = vec3(1.3 * a + 0.2, 1.0 - 0.2 * a, -1.3 * b - 0.1);

        let mut t = f32::INFINITY;
        let (mut normal, mut instance) = (Vec3::Z, 0);

        for axis in 0..3 {
            for (side, wall) in [(0.0, 1), (corner[axis], 2)] {
                let s = (side - eye[axis]) / d[axis];
                if s > 0.0 && s < t && (d[axis] > 0.0) == (wall == 2) {
                    (t, instance) = (s, 2 * axis as u32 + wall);
                    normal = Vec3::AXES[axis] * if wall == 1 { 1.0 } else { -1.0 };
                }
            }
        }

        let at = eye + d * t;
        let axis = normal.abs().max_position();
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        let (height, slope) = uneven(at[a], at[b]);
        // To first order, the ray hits the surface earlier by this much.
        t -= height / normal.dot(-d);
        normal[a] -= slope[0];
        normal[b] -= slope[1];
        normal = normal.normalize();

        if instance >= 3 && at.z > 0.8 && at.z < 2.0 {
            instance = 100 + (at.x * 1.5) as u32;
        }

        for (i, &(center, radius)) in balls.iter().enumerate() {
            let (o, dd) = (eye - center, d.length_squared());
            let h = o.dot(d);
            let q = h * h - dd * (o.length_squared() - radius * radius);
            if q > 0.0 {
                let s = (-h - q.sqrt()) / dd;
                if s > 0.0 && s < t {
                    (t, instance) = (s, 300 + i as u32);
                    normal = (eye + d * s - center) / radius;
                }
            }
        }
        Seen { xyz: eye + d * t, depth: t, normal, instance }
    };
    Raster::from_vec(SIZE, SIZE, (0..SIZE * SIZE).map(|i| pixel(i % SIZE, i / SIZE)).collect())
}

/// The room's images, pixel for pixel.
pub(crate) struct Images {
    pub(crate) photo: Raster<[u8; 3]>,
    /// In 1/512 of a metre.
    pub(crate) depth: Raster<u16>,
    pub(crate) normals: Raster<[u8; 3]>,
    /// The numbers of instances.
    pub(crate) labels: Raster<[u8; 3]>,
    /// A colour for each instance.
    pub(crate) pretty: Raster<[u8; 3]>,
    /// World coordinates in metres.
    pub(crate) xyz: Raster<[f32; 3]>,
}

/// Makes the images of the room.
pub(crate) fn images() -> Images {
    let room = room();
    let mut i = 0;
    let photo = room.map(|p| {
        let (x, y) = (i % SIZE, i / SIZE);
        i += 1;
        let light =
            90.0 + 60.0 * p.normal.z + 25.0 * p.depth + 4.0 * noise(x, y) + 12.0 * noise(x / 9, y / 7);
        [1.0, 0.9, 0.75].map(|k| (light * k).clamp(1.0, 255.0) as u8)
    });
    Images {
        photo,
        depth: room.map(|p| (p.depth * 512.0 + 0.5) as u16),
        normals: room.map(|p| p.normal.to_array().map(|n| (127.5 + 127.5 * n + 0.5) as u8)),
        labels: room.map(|p| [0, (p.instance >> 8) as u8, p.instance as u8]),
        pretty: room.map(|p| pretty_color(p.instance)),
        xyz: room.map(|p| p.xyz.to_array()),
    }
}
