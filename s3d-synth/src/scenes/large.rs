//! The files of a scan of any size.

use crate::{RangeError, ScanError};
use s3d_geom::Raster;
use s3d_geom::glam::{Vec3, vec3};
use s3d_io::Error;
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{Compression, Content, encode_rgb8};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Classes by their number in the files.
const CLASSES: [&str; 6] = ["floor", "ceiling", "wall", "table", "chair", "clutter"];
const FLOOR: usize = 0;
const CEILING: usize = 1;
const WALL: usize = 2;
/// Labels of a room of the usual size.
const LABELS_A_ROOM: usize = 50;
/// The number of sweeps of a room. Every surface gets a share of its points in each.
const SWEEPS: u64 = 256;
/// How far points lie off their surface, metres.
const NOISE_M: f32 = 0.005;

/// The files of a scan of any size, to see what an export of it takes: a building of rooms with simple
/// furniture, annotated points, textures and scan locations. If there are several rooms, the first is a hall
/// with half of all surfaces, and its floor holds about a tenth of the points. Everything is streamed, so
/// that a cloud larger than the memory can be made. The same numbers give the same bytes.
///
/// ```
/// use s3d_synth::scenes::LargeScan;
///
/// let folder = std::env::temp_dir().join(format!("s3d-large-{}", std::process::id()));
/// let scan = LargeScan { faces: 5_000, points: 2_000, labels: 120, ..LargeScan::default() };
/// let written = scan.write(&folder)?;
/// assert_eq!((written.rooms, written.labels), (2, 120));
/// assert!(written.faces.abs_diff(5_000) < 1_000 && folder.join("scene.toml").exists());
/// # std::fs::remove_dir_all(folder)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LargeScan {
    /// About the number of faces of the mesh: 1 to 10⁹.
    pub faces: u64,
    /// The number of materials, each with a texture: 1 to a million.
    pub materials: u64,
    /// The number of annotated things: 6 to a million. A room of the usual size has 50.
    pub labels: usize,
    /// The number of points: up to 10¹².
    pub points: u64,
    /// The number of scan locations.
    pub cameras: usize,
    /// Width and height of a texture in pixels: 8 to 16,384.
    pub texture_px: u32,
    /// The file format of the points.
    pub format: PointFormat,
}

/// The file format of the points of a [`LargeScan`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PointFormat {
    /// One PLY file.
    Ply,
    /// One structured array of NumPy.
    Npy,
    /// An S3DIS tree of text files.
    S3dis,
}

/// The outcome of [`LargeScan::write`].
#[derive(Clone, Debug, PartialEq)]
pub struct LargeScanSummary {
    /// The scene file.
    pub scene: PathBuf,
    /// Faces of the mesh.
    pub faces: u64,
    /// Annotated things.
    pub labels: usize,
    /// Rooms.
    pub rooms: usize,
    /// The area of all surfaces.
    pub area_m2: f64,
}

impl Default for LargeScan {
    fn default() -> Self {
        Self {
            faces: 100_000,
            materials: 20,
            labels: 500,
            points: 1_000_000,
            cameras: 3,
            texture_px: 64,
            format: PointFormat::Ply,
        }
    }
}

impl LargeScan {
    /// Writes `building.obj` with its materials and textures, the points, `cameras.csv`, and `scene.toml`,
    /// which ties them together, into `folder`, which is made if it is not there.
    ///
    /// # Errors
    /// [`ScanError::Range`] for a number that is out of its range, [`ScanError::File`] if a file cannot be
    /// written.
    pub fn write(&self, folder: &Path) -> Result<LargeScanSummary, ScanError> {
        check_number(self.faces as f64, 1.0, 1e9, "faces")?;
        check_number(self.materials as f64, 1.0, 1e6, "materials")?;
        check_number(self.labels as f64, 6.0, 1e6, "labels")?;
        check_number(self.points as f64, 0.0, 1e12, "points")?;
        check_number(f64::from(self.texture_px), 8.0, 16_384.0, "pixels along a texture")?;

        create_dir(folder)?;
        let rooms = Rooms::new(self);
        let faces = rooms.write_mesh(self, folder)?;
        match self.format {
            PointFormat::S3dis => rooms.write_tree(self, folder)?,
            PointFormat::Ply | PointFormat::Npy => rooms.write_cloud(self, folder)?,
        }

        rooms.write_cameras(self, folder)?;
        let scene = folder.join("scene.toml");
        write_bytes(&scene, scene_file(self.format).as_bytes())?;

        Ok(LargeScanSummary {
            scene,
            faces,
            labels: rooms.things.len(),
            rooms: rooms.rooms.len(),
            area_m2: rooms.area,
        })
    }
}

fn check_number(value: f64, min: f64, max: f64, what: &str) -> Result<(), RangeError> {
    RangeError::check(value, [min, max], || format!("the number of {what}"))
}

/// Writes one file piece by piece.
fn write_file(
    path: &Path,
    buffer: usize,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    let written = File::create(path).and_then(|file| {
        let mut file = BufWriter::with_capacity(buffer, file);
        write(&mut file)?;
        file.flush()
    });
    written.map_err(|e| Error::io(path, "write", e))
}

/// A parallelogram with its front to `u` × `v`.
struct Surface {
    origin: Vec3,
    u: Vec3,
    v: Vec3,
}

/// An annotated thing.
struct Thing {
    class: usize,
    /// Counts the things of its class in its room, from 1.
    number: u32,
    /// Its surfaces.
    surfaces: std::ops::Range<usize>,
}

struct RoomBox {
    origin: Vec3,
    size: Vec3,
    things: std::ops::Range<usize>,
}

struct Rooms {
    rooms: Vec<RoomBox>,
    things: Vec<Thing>,
    surfaces: Vec<Surface>,
    /// The area of all surfaces before each one, and of all surfaces at the end, m².
    areas: Vec<f64>,
    area: f64,
}

impl Rooms {
    fn new(options: &LargeScan) -> Self {
        let rooms = (options.labels / LABELS_A_ROOM).max(1);
        let mut all = Self {
            rooms: Vec::new(),
            things: Vec::new(),
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
            all.add_room(origin, size, labels);
        }

        for s in &all.surfaces {
            all.areas.push(all.area);
            all.area += f64::from(s.u.cross(s.v).length());
        }
        all.areas.push(all.area);
        all
    }

    fn add_room(&mut self, o: Vec3, size: Vec3, labels: usize) {
        let first = self.things.len();
        let x = Vec3::X * size.x;
        let y = Vec3::Y * size.y;
        let z = Vec3::Z * size.z;

        self.add(FLOOR, 1, &[(o, x, y)]);
        self.add(CEILING, 1, &[(o + z, y, x)]);
        for (number, (origin, u, v)) in (1..).zip([(o, z, x), (o + y, x, z), (o, y, z), (o + x, z, y)]) {
            self.add(WALL, number, &[(origin, u, v)]);
        }

        // Things stand on a grid, each in the middle of its cell.
        let things = labels.saturating_sub(6);
        let side = (things as f32).sqrt().ceil().max(1.0);
        for thing in 0..things {
            let i = (thing as f32 % side).floor();
            let j = (thing as f32 / side).floor();
            let cell = vec3(size.x / side, size.y / side, 0.0);
            let at = o + vec3((i + 0.25) * cell.x, (j + 0.25) * cell.y, 0.0);
            let u = Vec3::X * (cell.x / 2.0);
            let v = Vec3::Y * (cell.y / 2.0);
            let h = Vec3::Z * (0.4 + 0.8 * unit(hash(thing as u64)));

            let class = WALL + 1 + thing % 3;
            let sides = [(at + h, u, v), (at, u, h), (at + u, v, h), (at + u + v, -u, h), (at + v, -v, h)];
            self.add(class, thing as u32 / 3 + 1, &sides);
        }

        self.rooms
            .push(RoomBox { origin: o, size, things: first..self.things.len() });
    }

    fn add(&mut self, class: usize, number: u32, surfaces: &[(Vec3, Vec3, Vec3)]) {
        let first = self.surfaces.len();
        self.surfaces
            .extend(surfaces.iter().map(|&(origin, u, v)| Surface { origin, u, v }));
        self.things
            .push(Thing { class, number, surfaces: first..self.surfaces.len() });
    }

    /// The rows and columns of squares that a surface is cut into so that all have `faces` triangles
    /// together.
    fn squares(&self, surface: &Surface, faces: u64) -> [u64; 2] {
        let edge = (2.0 * self.area / faces as f64).sqrt();
        [surface.u, surface.v].map(|side| ((f64::from(side.length()) / edge).round() as u64).max(1))
    }

    /// Writes OBJ, MTL and textures, and returns the number of faces.
    fn write_mesh(&self, options: &LargeScan, folder: &Path) -> Result<u64, Error> {
        let cut: Vec<[u64; 2]> = self.surfaces.iter().map(|s| self.squares(s, options.faces)).collect();
        let total: u64 = cut.iter().map(|[n, m]| n * m).sum();
        write_file(&folder.join("building.obj"), 1 << 20, |obj| self.write_obj(options, &cut, total, obj))?;

        let mut mtl = String::new();
        for m in 0..options.materials {
            let _ = writeln!(mtl, "newmtl m{m}\nKd 1 1 1\nmap_Kd m{m}.png");
            let px = options.texture_px;

            let pixels = (0..px * px).map(|at| {
                let place = (m << 32) | u64::from(at % px / 8) << 16 | u64::from(at / px / 8);
                let [r, g, b, ..] = hash(place).to_le_bytes();
                [r, g, b]
            });
            let image = Raster::from_vec(px, px, pixels.collect());
            write_bytes(
                &folder.join(format!("m{m}.png")),
                &encode_rgb8(&image, Content::Photo, Compression::Fast),
            )?;
        }
        write_bytes(&folder.join("building.mtl"), mtl.as_bytes())?;
        Ok(2 * total)
    }

    fn write_obj(
        &self,
        options: &LargeScan,
        cut: &[[u64; 2]],
        total: u64,
        obj: &mut impl Write,
    ) -> io::Result<()> {
        writeln!(obj, "mtllib building.mtl")?;

        let mut first = 1;
        let mut square = 0;
        let mut material = u64::MAX;

        for (surface, [n, m]) in self.surfaces.iter().zip(cut) {
            let normal = surface.u.cross(surface.v).normalize();

            for i in 0..=*n {
                for j in 0..=*m {
                    let s = i as f32 / *n as f32;
                    let t = j as f32 / *m as f32;
                    // Inner corners lie off the plane, as in a scan.
                    let is_inner = i > 0 && i < *n && j > 0 && j < *m;
                    let off = if is_inner {
                        0.01 * (unit(hash(first + i * (m + 1) + j)) - 0.5)
                    } else {
                        0.0
                    };
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
                    let b = a + m + 1;
                    let c = a + m + 2;
                    let d = a + 1;
                    writeln!(obj, "f {a}/{a} {b}/{b} {c}/{c}\nf {a}/{a} {c}/{c} {d}/{d}")?;
                }
            }

            first += (n + 1) * (m + 1);
        }
        Ok(())
    }

    /// The number of points before a share of a surface.
    fn points_before(&self, surface: usize, share: f64, points: u64) -> u64 {
        let area = self.areas[surface] + share * (self.areas[surface + 1] - self.areas[surface]);
        (points as f64 * (area / self.area)) as u64
    }

    fn point(&self, surface: &Surface, number: u64) -> (Vec3, [u8; 3]) {
        let bits = hash(number);
        // Steps of the plastic number fill a square evenly.
        let s = fraction(number, 0xc13f_a9a9_02a6_328f);
        let t = fraction(number, 0x91e1_0da5_c79e_7b1c);
        let normal = surface.u.cross(surface.v).normalize();
        let position =
            surface.origin + surface.u * s + surface.v * t + normal * (NOISE_M * (2.0 * unit(bits) - 1.0));
        let [r, g, b, ..] = bits.to_le_bytes();
        (position, [r, g, b])
    }

    /// One file of all points, sweep after sweep of a room, so that things are mixed.
    fn write_cloud(&self, options: &LargeScan, folder: &Path) -> Result<(), Error> {
        let (name, header) = match options.format {
            PointFormat::Npy => ("cloud.npy", npy_header(options.points)),
            _ => ("cloud.ply", ply_header(options.points)),
        };

        write_file(&folder.join(name), 1 << 20, |file| {
            file.write_all(&header)?;
            for (room, RoomBox { things, .. }) in self.rooms.iter().enumerate() {
                for sweep in 0..SWEEPS {
                    for thing in &self.things[things.clone()] {
                        for s in thing.surfaces.clone() {
                            let at = |k: u64| self.points_before(s, k as f64 / SWEEPS as f64, options.points);
                            for number in at(sweep)..at(sweep + 1) {
                                let (p, color) = self.point(&self.surfaces[s], number);
                                let mut record = [0; 20];
                                record[..4].copy_from_slice(&p.x.to_le_bytes());
                                record[4..8].copy_from_slice(&p.y.to_le_bytes());
                                record[8..12].copy_from_slice(&p.z.to_le_bytes());
                                record[12..15].copy_from_slice(&color);
                                record[15] = thing.class as u8;
                                record[16..18].copy_from_slice(&(thing.number as u16).to_le_bytes());
                                record[18..].copy_from_slice(&(room as u16 + 1).to_le_bytes());
                                file.write_all(&record)?;
                            }
                        }
                    }
                }
            }
            Ok(())
        })
    }

    /// A text file an instance, in the folder of its room.
    fn write_tree(&self, options: &LargeScan, folder: &Path) -> Result<(), Error> {
        for (room, RoomBox { things, .. }) in self.rooms.iter().enumerate() {
            let folder = folder.join(format!("Area_1/office_{}/Annotations", room + 1));
            create_dir(&folder)?;
            for thing in &self.things[things.clone()] {
                let name = format!("{}_{}.txt", CLASSES[thing.class], thing.number);
                write_file(&folder.join(name), 1 << 18, |file| {
                    for s in thing.surfaces.clone() {
                        for number in self.points_before(s, 0.0, options.points)
                            ..self.points_before(s, 1.0, options.points)
                        {
                            let (p, [r, g, b]) = self.point(&self.surfaces[s], number);
                            writeln!(file, "{:.3} {:.3} {:.3} {r} {g} {b}", p.x, p.y, p.z)?;
                        }
                    }
                    Ok(())
                })?;
            }
        }
        Ok(())
    }

    /// Scan locations above the furniture, room by room in turn.
    fn write_cameras(&self, options: &LargeScan, folder: &Path) -> Result<(), Error> {
        let mut text = String::new();
        for i in 0..options.cameras {
            let room = &self.rooms[i % self.rooms.len()];
            let k = (i / self.rooms.len()) as u64 + 1;
            let s = fraction(k, 0xc13f_a9a9_02a6_328f);
            let t = fraction(k, 0x91e1_0da5_c79e_7b1c);
            let p = room.origin + vec3(0.1 + 0.8 * s, 0.1 + 0.8 * t, 0.0) * room.size + Vec3::Z * 1.6;
            let uuid = format!("{:016x}{:016x}", hash(i as u64), hash(!(i as u64)));
            let _ = writeln!(text, "{uuid},{:.4},{:.4},{:.4},0,0,0,1", p.x, p.y, p.z);
        }
        write_bytes(&folder.join("cameras.csv"), text.as_bytes())?;
        Ok(())
    }
}

/// What ties mesh, points and locations together.
fn scene_file(format: PointFormat) -> String {
    let mut text = "area = 1\n[mesh]\npath = \"building.obj\"\nup = \"z\"\n[cameras]\n\
                    path = \"cameras.csv\"\n[annotations]\n"
        .to_owned();
    let cloud = match format {
        PointFormat::S3dis => return text + "path = \"Area_1\"\n",
        PointFormat::Npy => "cloud.npy",
        PointFormat::Ply => "cloud.ply",
    };
    let _ =
        writeln!(text, "path = \"{cloud}\"\nroom = \"office_1\"\nrooms = \"room\"\n[annotations.classes]");
    for (number, class) in CLASSES.iter().enumerate() {
        let _ = writeln!(text, "{number} = \"{class}\"");
    }
    text
}

fn ply_header(points: u64) -> Vec<u8> {
    format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {points}\nproperty float x\nproperty float y\n\
         property float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar class\n\
         property ushort instance\n\
         property ushort room\nend_header\n"
    )
    .into_bytes()
}

fn npy_header(points: u64) -> Vec<u8> {
    let columns =
        [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("red", "|u1"), ("green", "|u1"), ("blue", "|u1")];
    let labels = [("class", "|u1"), ("instance", "<u2"), ("room", "<u2")];
    let fields: Vec<String> = columns
        .iter()
        .chain(&labels)
        .map(|(name, kind)| format!("('{name}', '{kind}')"))
        .collect();
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
