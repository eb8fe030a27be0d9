//! Meshes that the benches, examples and tests share: a generated room, and a plain reader of textured OBJ files.
#![allow(dead_code, unreachable_pub)]

use s3d_geom::glam::{DVec3, Vec3, dvec3, vec2, vec3};
use s3d_geom::{Camera, Material, MeshParts, NO_INDEX, Pose, Raster, Texture, TriMesh, scan_like};
use std::path::{Path, PathBuf};

/// A furnished room of 8 × 6 × 3 m whose surfaces are noisy grids like a scan's, textured with a grain of 2 cm; about
/// `faces` faces. The same every time.
pub fn furnished_room(faces: usize) -> TriMesh {
    // The surfaces below add up to 210 m²; two faces a cell.
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
        let (nu, nv) = (
            (u.length() / self.cell).ceil().max(1.0) as u32,
            (v.length() / self.cell).ceil().max(1.0) as u32,
        );
        let normal = u.cross(v).normalize();
        let first = self.parts.positions.len() as u32;
        for j in 0..=nv {
            for i in 0..=nu {
                let (s, t) = (i as f32 / nu as f32, j as f32 / nv as f32);
                let p = origin + u * s + v * t;
                let inner = i > 0 && j > 0 && i < nu && j < nv;
                let noise = if inner { noise(p) * 0.05 * self.cell.min(0.1) } else { 0.0 };
                self.parts.positions.push(p + normal * noise);
                self.parts.uvs.push(vec2(s * u.length(), t * v.length()) * 0.5);
            }
        }
        for j in 0..nv {
            for i in 0..nu {
                let a = first + j * (nu + 1) + i;
                let (b, c, d) = (a + 1, a + nu + 2, a + nu + 1);
                self.parts.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
    }

    fn cuboid(&mut self, min: Vec3, max: Vec3) {
        let (x, y, z) = (Vec3::X * (max.x - min.x), Vec3::Y * (max.y - min.y), Vec3::Z * (max.z - min.z));
        for (origin, u, v) in
            [(min, y, x), (min, x, z), (min, z, y), (min + z, x, y), (min + y, z, x), (min + x, y, z)]
        {
            self.grid(origin, u, v);
        }
    }

    fn inside_out(&mut self, min: Vec3, max: Vec3) {
        let (x, y, z) = (Vec3::X * (max.x - min.x), Vec3::Y * (max.y - min.y), Vec3::Z * (max.z - min.z));
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
                let (x, y) = (k % 1024, k / 1024);
                let grain = (noise(vec3(x as f32, y as f32, 0.5)) * 20.0) as i32;
                let tile = if (x / 64 + y / 64) % 2 == 0 { 150 } else { 90 };
                [(tile + grain) as u8, (tile + grain / 2) as u8, (200 - tile + grain) as u8]
            })
            .collect();
        let image = Raster::from_vec(1024, 1024, image);
        parts.textures = vec![Texture { name: "grain".into(), image, wrap: Default::default() }];
        parts.materials = vec![Material { name: "grain".into(), color: [128; 3], texture: Some(0) }];
        TriMesh::new(parts).expect("the generated room is a mesh")
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

/// Where one stands in [`furnished_room`].
pub fn room_location() -> DVec3 {
    dvec3(4.03, 3.07, 1.5)
}

/// Reads the v, vt and f lines of an OBJ file with Y up, and the picture `map_Kd` of the material file beside it.
pub fn read_obj(path: &Path) -> TriMesh {
    let text = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut parts = MeshParts::default();
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let tag = words.next();
        let words: Vec<&str> = words.collect();
        let number = |k: usize| words[k].parse::<f32>().expect("a number");
        match tag {
            Some("v") => parts.positions.push(vec3(number(0), -number(2), number(1))),
            Some("vt") => parts.uvs.push(vec2(number(0), number(1))),
            Some("f") => {
                let corner = |word: &str| {
                    let mut indices = word.split('/').map(|w| w.parse::<u32>().map_or(NO_INDEX, |i| i - 1));
                    (indices.next().unwrap_or(NO_INDEX), indices.next().unwrap_or(NO_INDEX))
                };
                for k in 1..words.len() - 1 {
                    let corners = [words[0], words[k], words[k + 1]].map(corner);
                    parts.faces.push(corners.map(|c| c.0));
                    parts.face_uvs.push(corners.map(|c| c.1));
                }
            }
            _ => {}
        }
    }
    let picture = std::fs::read_to_string(path.with_extension("mtl")).ok().and_then(|text| {
        let line = text.lines().find(|l| l.trim_start().starts_with("map_Kd"))?;
        Some(path.with_file_name(line.split_whitespace().nth(1)?))
    });
    if let Some(picture) = picture {
        let image = image::open(&picture).unwrap_or_else(|e| panic!("{}: {e}", picture.display())).to_rgb8();
        let (width, height) = image.dimensions();
        let image = Raster::from_vec(width, height, image.pixels().map(|p| p.0).collect());
        parts.textures = vec![Texture { name: "picture".into(), image, wrap: Default::default() }];
        parts.materials = vec![Material { name: "picture".into(), color: [128; 3], texture: Some(0) }];
        parts.face_materials = vec![0; parts.faces.len()];
    }
    TriMesh::new(parts).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The real scan beside the project, if it is there: its OBJ file and the place of its first scanner.
pub fn real_scan() -> Option<(PathBuf, DVec3)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scans/copyroom/rgb.obj");
    path.exists().then_some((path, dvec3(13.1, 9.65, 1.4)))
}

/// The scenes that images are made of to see how long that takes, and where one stands in them: `scan-like`, generated;
/// `copyroom`, the real scan beside the project; `office`, the OBJ file with Z up that `S3D_BENCH_OFFICE` names; and
/// `fine-textures`, with about three of their pixels for one of the image's: the filter has work to do. `None` if it is not
/// there.
pub fn shaded_scene(name: &str) -> Option<(TriMesh, DVec3)> {
    match name {
        "scan-like" => Some((scan_like(300_000, 1), dvec3(3.0, 2.5, 1.5))),
        "copyroom" => real_scan().map(|(path, location)| (read_obj(&path), location)),
        "office" => {
            let path = PathBuf::from(std::env::var_os("S3D_BENCH_OFFICE")?);
            Some((z_up(&read_obj(&path)), dvec3(4.03, 3.07, 1.5)))
        }
        "fine-textures" => Some((furnished_room(285_000), room_location())),
        _ => None,
    }
}

/// A mesh of [`read_obj`] whose file had Z up.
pub fn z_up(mesh: &TriMesh) -> TriMesh {
    let mut parts = mesh.clone().into_parts();
    parts.positions.iter_mut().for_each(|p| *p = vec3(p.x, p.z, -p.y));
    TriMesh::new(parts).expect("it was a mesh")
}

/// Views all around from one place: level, up and down.
pub fn views(location: DVec3, size: u32) -> Vec<Camera> {
    let level = Pose::level(location, 0.13);
    (0..9)
        .map(|k| {
            let (yaw, pitch) = ((k as f64) * 0.7, [0.0, 0.26, -0.26][k % 3]);
            Camera::perspective(level.turned(yaw, pitch), [75f64, 60.0, 40.0][k / 3].to_radians(), size, size)
        })
        .collect()
}
