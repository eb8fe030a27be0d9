//! Writes a scan of any size: a building of rooms with furniture, its annotated points, textures and scan locations, to
//! see what an export of it takes. Everything is streamed, so that a cloud larger than the memory can be made, and the
//! same arguments give the same bytes.
//!
//! `cargo run --release -p s3d-cli --example large_scene -- FOLDER [--faces N] [--materials N] [--labels N] [--points N]
//! [--cameras N] [--texture PX] [--form ply|npy|s3dis]`; `docs/reliability/curves.py` makes and exports a row of them.
//!
//! Of several rooms the first is a hall with half of all surfaces: its floor holds about a tenth of the points.
#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use s3d_geom::Raster;
use s3d_geom::glam::{Vec3, vec3};
use s3d_io::image::{Compression, Content, encode_rgb8};
use std::error::Error;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

type Done = Result<(), Box<dyn Error>>;

/// Classes by their number in the files.
const CLASSES: [&str; 6] = ["floor", "ceiling", "wall", "table", "chair", "clutter"];
const FLOOR: usize = 0;
const CEILING: usize = 1;
const WALL: usize = 2;
/// Labels of a room of the usual size.
const LABELS_A_ROOM: usize = 50;
/// How often a scanner comes by: in each sweep of a room every surface gets a share of its points.
const SWEEPS: u64 = 256;
/// How far points lie off their surface, metres.
const NOISE_M: f32 = 0.005;

fn main() -> Done {
    let options = Options::parse(std::env::args().skip(1))?;
    let building = Building::new(&options);
    fs::create_dir_all(&options.folder)?;
    let faces = building.write_mesh(&options)?;
    match options.form {
        Form::S3dis => building.write_tree(&options)?,
        Form::Ply | Form::Npy => building.write_cloud(&options)?,
    }
    building.write_cameras(&options)?;
    building.write_scene(&options)?;
    println!(
        "{}: {faces} faces, {} materials, {} labels in {} rooms, {} points, {} scan locations, {:.0} m²",
        options.folder.display(),
        options.materials,
        building.instances.len(),
        building.rooms.len(),
        options.points,
        options.cameras,
        building.area
    );
    Ok(())
}

/// In which form the points are written.
#[derive(Clone, Copy, PartialEq)]
enum Form {
    Ply,
    Npy,
    S3dis,
}

struct Options {
    folder: PathBuf,
    faces: u64,
    materials: u64,
    labels: usize,
    points: u64,
    cameras: usize,
    texture: u32,
    form: Form,
}

impl Options {
    fn parse(mut args: impl Iterator<Item = String>) -> Result<Self, Box<dyn Error>> {
        let folder =
            args.next().filter(|f| !f.starts_with('-')).ok_or("usage: large_scene FOLDER [--points N] …")?;
        let mut options = Self {
            folder: folder.into(),
            faces: 100_000,
            materials: 20,
            labels: 500,
            points: 1_000_000,
            cameras: 3,
            texture: 64,
            form: Form::Ply,
        };
        while let Some(key) = args.next() {
            let value = args.next().ok_or_else(|| format!("{key} wants a value"))?;
            match &*key {
                "--faces" => options.faces = value.parse()?,
                "--materials" => options.materials = value.parse()?,
                "--labels" => options.labels = value.parse()?,
                "--points" => options.points = value.parse()?,
                "--cameras" => options.cameras = value.parse()?,
                "--texture" => options.texture = value.parse()?,
                "--form" => {
                    options.form = match &*value {
                        "ply" => Form::Ply,
                        "npy" => Form::Npy,
                        "s3dis" => Form::S3dis,
                        other => return Err(format!("{other}: a form is ply, npy or s3dis").into()),
                    }
                }
                other => return Err(format!("{other} is no option").into()),
            }
        }
        Ok(options)
    }
}

/// A parallelogram with its front to `u` × `v`.
struct Surface {
    origin: Vec3,
    u: Vec3,
    v: Vec3,
}

/// An annotated thing.
struct Instance {
    class: usize,
    /// Among its room's of its class, from 1.
    number: u32,
    /// Its surfaces.
    surfaces: std::ops::Range<usize>,
}

struct Room {
    origin: Vec3,
    size: Vec3,
    instances: std::ops::Range<usize>,
}

struct Building {
    rooms: Vec<Room>,
    instances: Vec<Instance>,
    surfaces: Vec<Surface>,
    /// Of all surfaces before each, and of all: m².
    areas: Vec<f64>,
    area: f64,
}

impl Building {
    fn new(options: &Options) -> Self {
        let rooms = (options.labels / LABELS_A_ROOM).max(1);
        let mut building = Self {
            rooms: Vec::new(),
            instances: Vec::new(),
            surfaces: Vec::new(),
            areas: Vec::new(),
            area: 0.0,
        };
        let columns = (rooms as f64).sqrt().ceil() as usize;
        for room in 0..rooms {
            let is_hall = room == 0 && rooms > 1;
            // A hall as large as all other rooms together.
            let scale = if is_hall { ((rooms - 1) as f32).sqrt() } else { 1.0 };
            let size = vec3(8.0 * scale, 6.0 * scale, if is_hall { 3.0 * scale.sqrt() } else { 3.0 });
            let origin = if is_hall {
                vec3(-size.x - 0.5, 0.0, 0.0)
            } else {
                vec3((room % columns) as f32 * 8.2, (room / columns) as f32 * 6.2, 0.0)
            };
            let labels = options.labels * (room + 1) / rooms - options.labels * room / rooms;
            building.add_room(origin, size, labels);
        }
        for s in &building.surfaces {
            building.areas.push(building.area);
            building.area += f64::from(s.u.cross(s.v).length());
        }
        building.areas.push(building.area);
        building
    }

    fn add_room(&mut self, o: Vec3, size: Vec3, labels: usize) {
        let first = self.instances.len();
        let (x, y, z) = (Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z);
        self.add(FLOOR, 1, &[(o, x, y)]);
        self.add(CEILING, 1, &[(o + z, y, x)]);
        for (number, (origin, u, v)) in (1..).zip([(o, z, x), (o + y, x, z), (o, y, z), (o + x, z, y)]) {
            self.add(WALL, number, &[(origin, u, v)]);
        }
        // Things stand on a grid, each in the middle of its cell.
        let things = labels.saturating_sub(6);
        let side = (things as f32).sqrt().ceil().max(1.0);
        for thing in 0..things {
            let (i, j) = ((thing as f32 % side).floor(), (thing as f32 / side).floor());
            let cell = vec3(size.x / side, size.y / side, 0.0);
            let at = o + vec3((i + 0.25) * cell.x, (j + 0.25) * cell.y, 0.0);
            let (u, v) = (Vec3::X * (cell.x / 2.0), Vec3::Y * (cell.y / 2.0));
            let h = Vec3::Z * (0.4 + 0.8 * unit(hash(thing as u64)));
            let class = WALL + 1 + thing % 3;
            let sides = [(at + h, u, v), (at, u, h), (at + u, v, h), (at + u + v, -u, h), (at + v, -v, h)];
            self.add(class, thing as u32 / 3 + 1, &sides);
        }
        self.rooms.push(Room { origin: o, size, instances: first..self.instances.len() });
    }

    fn add(&mut self, class: usize, number: u32, surfaces: &[(Vec3, Vec3, Vec3)]) {
        let first = self.surfaces.len();
        self.surfaces.extend(surfaces.iter().map(|&(origin, u, v)| Surface { origin, u, v }));
        self.instances.push(Instance { class, number, surfaces: first..self.surfaces.len() });
    }

    /// The rows and columns of squares that a surface is cut into so that all have `faces` triangles together.
    fn squares(&self, surface: &Surface, faces: u64) -> [u64; 2] {
        let edge = (2.0 * self.area / faces as f64).sqrt();
        [surface.u, surface.v].map(|side| ((f64::from(side.length()) / edge).round() as u64).max(1))
    }

    /// Writes OBJ, MTL and textures, and returns the number of faces.
    fn write_mesh(&self, options: &Options) -> Result<u64, Box<dyn Error>> {
        let cut: Vec<[u64; 2]> = self.surfaces.iter().map(|s| self.squares(s, options.faces)).collect();
        let total: u64 = cut.iter().map(|[n, m]| n * m).sum();
        let mut obj = BufWriter::with_capacity(1 << 20, File::create(options.folder.join("building.obj"))?);
        writeln!(obj, "mtllib building.mtl")?;
        let (mut first, mut square, mut material) = (1, 0, u64::MAX);
        for (surface, [n, m]) in self.surfaces.iter().zip(&cut) {
            let normal = surface.u.cross(surface.v).normalize();
            for i in 0..=*n {
                for j in 0..=*m {
                    let (s, t) = (i as f32 / *n as f32, j as f32 / *m as f32);
                    // Inner corners lie off the plane, as in a scan.
                    let is_inner = i > 0 && i < *n && j > 0 && j < *m;
                    let off = if is_inner { 0.01 * (unit(hash(first + i * (m + 1) + j)) - 0.5) } else { 0.0 };
                    let p = surface.origin + surface.u * s + surface.v * t + normal * off;
                    writeln!(obj, "v {:.4} {:.4} {:.4}\nvt {s:.5} {t:.5}", p.x, p.y, p.z)?;
                }
            }
            for i in 0..*n {
                for j in 0..*m {
                    let this = square * options.materials / total;
                    if this != material {
                        material = this;
                        writeln!(obj, "usemtl m{material}")?;
                    }
                    square += 1;
                    let a = first + i * (m + 1) + j;
                    let (b, c, d) = (a + m + 1, a + m + 2, a + 1);
                    writeln!(obj, "f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}")?;
                }
            }
            first += (n + 1) * (m + 1);
        }
        obj.flush()?;
        let mut mtl = String::new();
        for m in 0..options.materials {
            let _ = writeln!(mtl, "newmtl m{m}\nKd 1 1 1\nmap_Kd m{m}.png");
            let px = options.texture;
            let color = |at: u32| {
                let [r, g, b, ..] =
                    hash((m << 32) | u64::from(at % px / 8) << 16 | u64::from(at / px / 8)).to_le_bytes();
                [r, g, b]
            };
            let image = Raster::from_vec(px, px, (0..px * px).map(color).collect());
            fs::write(
                options.folder.join(format!("m{m}.png")),
                encode_rgb8(&image, Content::Photo, Compression::Fast),
            )?;
        }
        fs::write(options.folder.join("building.mtl"), mtl)?;
        Ok(2 * total)
    }

    /// How many points come before a share of a surface.
    fn points_before(&self, surface: usize, share: f64, points: u64) -> u64 {
        let area = self.areas[surface] + share * (self.areas[surface + 1] - self.areas[surface]);
        (points as f64 * (area / self.area)) as u64
    }

    fn point(&self, surface: &Surface, number: u64) -> (Vec3, [u8; 3]) {
        let bits = hash(number);
        // Steps of the plastic number fill a square evenly.
        let (s, t) = (fraction(number, 0xc13f_a9a9_02a6_328f), fraction(number, 0x91e1_0da5_c79e_7b1c));
        let normal = surface.u.cross(surface.v).normalize();
        let position =
            surface.origin + surface.u * s + surface.v * t + normal * (NOISE_M * (2.0 * unit(bits) - 1.0));
        let [r, g, b, ..] = bits.to_le_bytes();
        (position, [r, g, b])
    }

    /// One file of all points, sweep after sweep of a room, so that instances are mixed.
    fn write_cloud(&self, options: &Options) -> Done {
        let (name, header) = match options.form {
            Form::Npy => ("cloud.npy", npy_header(options.points)),
            _ => ("cloud.ply", ply_header(options.points)),
        };
        let mut file = BufWriter::with_capacity(1 << 20, File::create(options.folder.join(name))?);
        file.write_all(&header)?;
        for (room, Room { instances, .. }) in self.rooms.iter().enumerate() {
            for sweep in 0..SWEEPS {
                for instance in &self.instances[instances.clone()] {
                    for s in instance.surfaces.clone() {
                        let at = |k: u64| self.points_before(s, k as f64 / SWEEPS as f64, options.points);
                        for number in at(sweep)..at(sweep + 1) {
                            let (p, color) = self.point(&self.surfaces[s], number);
                            let mut record = [0; 20];
                            record[..4].copy_from_slice(&p.x.to_le_bytes());
                            record[4..8].copy_from_slice(&p.y.to_le_bytes());
                            record[8..12].copy_from_slice(&p.z.to_le_bytes());
                            record[12..15].copy_from_slice(&color);
                            record[15] = instance.class as u8;
                            record[16..18].copy_from_slice(&(instance.number as u16).to_le_bytes());
                            record[18..].copy_from_slice(&(room as u16 + 1).to_le_bytes());
                            file.write_all(&record)?;
                        }
                    }
                }
            }
        }
        Ok(file.flush()?)
    }

    /// A text file an instance, in the folder of its room.
    fn write_tree(&self, options: &Options) -> Done {
        for (room, Room { instances, .. }) in self.rooms.iter().enumerate() {
            let folder = options.folder.join(format!("Area_1/office_{}/Annotations", room + 1));
            fs::create_dir_all(&folder)?;
            for instance in &self.instances[instances.clone()] {
                let name = format!("{}_{}.txt", CLASSES[instance.class], instance.number);
                let mut file = BufWriter::with_capacity(1 << 18, File::create(folder.join(name))?);
                for s in instance.surfaces.clone() {
                    for number in
                        self.points_before(s, 0.0, options.points)..self.points_before(s, 1.0, options.points)
                    {
                        let (p, [r, g, b]) = self.point(&self.surfaces[s], number);
                        writeln!(file, "{:.3} {:.3} {:.3} {r} {g} {b}", p.x, p.y, p.z)?;
                    }
                }
                file.flush()?;
            }
        }
        Ok(())
    }

    /// Scan locations above the furniture, room by room in turn.
    fn write_cameras(&self, options: &Options) -> Done {
        let mut file = BufWriter::new(File::create(options.folder.join("cameras.csv"))?);
        for i in 0..options.cameras {
            let room = &self.rooms[i % self.rooms.len()];
            let k = (i / self.rooms.len()) as u64 + 1;
            let (s, t) = (fraction(k, 0xc13f_a9a9_02a6_328f), fraction(k, 0x91e1_0da5_c79e_7b1c));
            let p = room.origin + vec3(0.1 + 0.8 * s, 0.1 + 0.8 * t, 0.0) * room.size + Vec3::Z * 1.6;
            let uuid = format!("{:016x}{:016x}", hash(i as u64), hash(!(i as u64)));
            writeln!(file, "{uuid},{:.4},{:.4},{:.4},0,0,0,1", p.x, p.y, p.z)?;
        }
        Ok(file.flush()?)
    }

    fn write_scene(&self, options: &Options) -> Done {
        let mut text = "area = 1\n[mesh]\npath = \"building.obj\"\nup = \"z\"\n[cameras]\npath = \"cameras.csv\"\n[annotations]\n".to_owned();
        match options.form {
            Form::S3dis => text += "path = \"Area_1\"\n",
            form => {
                let path: &Path = Path::new(if form == Form::Npy { "cloud.npy" } else { "cloud.ply" });
                let _ = writeln!(
                    text,
                    "path = \"{}\"\nroom = \"office_1\"\nrooms = \"room\"\n[annotations.classes]",
                    path.display()
                );
                for (number, class) in CLASSES.iter().enumerate() {
                    let _ = writeln!(text, "{number} = \"{class}\"");
                }
            }
        }
        Ok(fs::write(options.folder.join("scene.toml"), text)?)
    }
}

fn ply_header(points: u64) -> Vec<u8> {
    format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {points}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar class\nproperty ushort instance\n\
         property ushort room\nend_header\n"
    )
    .into_bytes()
}

fn npy_header(points: u64) -> Vec<u8> {
    let columns =
        [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "|u1"), ("green", "|u1"), ("blue", "|u1")];
    let labels = [("class", "|u1"), ("instance", "<u2"), ("room", "<u2")];
    let fields: Vec<String> =
        columns.iter().chain(&labels).map(|(name, kind)| format!("('{name}', '{kind}')")).collect();
    let mut text =
        format!("{{'descr': [{}], 'fortran_order': False, 'shape': ({points},), }}", fields.join(", "));
    // The header ends in a line feed, and what follows starts at a multiple of 64.
    while (10 + text.len() + 1) % 64 != 0 {
        text.push(' ');
    }
    text.push('\n');
    [b"\x93NUMPY\x01\x00", &(text.len() as u16).to_le_bytes()[..], text.as_bytes()].concat()
}

/// SplitMix64's finish: bits without a pattern.
fn hash(n: u64) -> u64 {
    let n = n.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let n = (n ^ (n >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let n = (n ^ (n >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    n ^ (n >> 31)
}

/// From 0 to below 1.
fn unit(bits: u64) -> f32 {
    (bits >> 40) as f32 / (1u32 << 24) as f32
}

/// The fraction of `number` steps of `step` 2⁻⁶⁴.
fn fraction(number: u64, step: u64) -> f32 {
    unit(number.wrapping_mul(step))
}
