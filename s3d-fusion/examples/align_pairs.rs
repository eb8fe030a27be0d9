//! Writes pairs of parts of buildings, for `bench/align_peers.py`: `align_pairs OUT [copyroom/rgb.obj]`. With
//! two of these files, prints the transform as `s3d align` does: `align_pairs align A.ply B.ply`. So the
//! library is measured without a build of the whole command.
//!
//! Parts are cut by upright planes in any direction, moved by up to 42 m and turned by any angle, and each
//! vertex is off by 5 mm (one sigma and axis). Of each scene, eight pairs share 10 to 50 % of the second
//! part, and two share nothing: another part of the same building, and a part of another one.
#![allow(clippy::print_stdout)]

use s3d_fusion::{AlignOptions, SurfacePoints, align};
use s3d_geom::TriMesh;
use s3d_geom::glam::{DAffine3, DQuat, DVec3, Vec3, dvec3};
use s3d_synth::{Building, BuildingOptions};
use std::collections::HashMap;
use std::error::Error;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;
use std::{env, fs};

/// The pairs of a scene that overlap, and that do not.
const PAIRS: [usize; 2] = [8, 2];
const NOISE_M: f64 = 0.005;
/// Edges are cut until they are shorter, metres, so that a part has a border and its noise is of points.
const EDGE_M: f32 = 0.2;

/// Numbers by SplitMix64.
struct Dice(u64);

impl Dice {
    /// From 0 to 1.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Nearly normal.
    fn normal(&mut self) -> f64 {
        (0..6).map(|_| self.next() - 0.5).sum::<f64>() * 2f64.sqrt()
    }
}

/// Positions and faces.
type Fine = (Vec<Vec3>, Vec<[u32; 3]>);

/// Cuts faces until their edges are short. Faces that share an edge still share it.
fn fine(mesh: &TriMesh) -> Fine {
    let mut numbers = HashMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut stack: Vec<[Vec3; 3]> = (0..mesh.faces().len() as u32).map(|f| mesh.triangle(f)).collect();
    while let Some([a, b, c]) = stack.pop() {
        let lengths = [a.distance(b), b.distance(c), c.distance(a)];
        let longest = (0..3).fold(0, |best, i| if lengths[i] > lengths[best] { i } else { best });
        if lengths[longest] > EDGE_M {
            let [a, b, c] = [[a, b, c], [b, c, a], [c, a, b]][longest];
            let middle = (a + b) / 2.0;
            stack.extend([[a, middle, c], [middle, b, c]]);
            continue;
        }
        faces.push([a, b, c].map(|p| {
            *numbers.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
        }));
    }
    (positions, faces)
}

/// The place along `direction` below which a share of the area lies.
fn cut_at((positions, faces): &Fine, direction: Vec3, share: f64) -> f32 {
    let corners = |f: &[u32; 3]| f.map(|i| positions[i as usize]);
    let mut areas: Vec<(f32, f64)> = faces
        .iter()
        .map(|f| {
            let [a, b, c] = corners(f);
            ((a + b + c).dot(direction) / 3.0, f64::from((b - a).cross(c - a).length()))
        })
        .collect();
    areas.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = areas.iter().map(|(_, area)| area).sum();
    let mut below = 0.0;
    let found = areas.iter().find(|(_, area)| {
        below += area;
        below >= share * total
    });
    found.map_or(f32::INFINITY, |(at, _)| *at)
}

/// Writes the part of a scene whose faces are kept, moved and with noise, as PLY.
fn write_part(
    path: &Path,
    (positions, faces): &Fine,
    keep: impl Fn(Vec3) -> bool,
    pose: &DAffine3,
    dice: &mut Dice,
) -> Result<(), Box<dyn Error>> {
    let mut numbers = HashMap::new();
    let (mut points, mut corners, mut count) = (Vec::new(), Vec::new(), 0);
    for f in faces {
        let middle = f.iter().map(|i| positions[*i as usize]).sum::<Vec3>() / 3.0;
        if !keep(middle) {
            continue;
        }
        count += 1;
        corners.push(3);
        for i in f {
            let next = numbers.len() as u32;
            let number = *numbers.entry(*i).or_insert_with(|| {
                let off = dvec3(dice.normal(), dice.normal(), dice.normal()) * NOISE_M;
                let p = pose.transform_point3(positions[*i as usize].as_dvec3() + off).as_vec3();
                points.extend(p.to_array().iter().flat_map(|v| v.to_le_bytes()));
                next
            });
            corners.extend(number.to_le_bytes());
        }
    }
    let mut file = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {count}\nproperty list uchar uint vertex_indices\nend_header\n",
        numbers.len()
    )
    .into_bytes();
    file.extend(points);
    file.extend(corners);
    Ok(fs::write(path, file)?)
}

/// A mesh of Wavefront OBJ whose file has +Y up.
fn obj(path: &str) -> Result<TriMesh, Box<dyn Error>> {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for line in fs::read_to_string(path)?.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["v", x, y, z, ..] => positions.push(Vec3::new(x.parse()?, -z.parse::<f32>()?, y.parse()?)),
            ["f", a, b, c] => {
                let number = |word: &str| word.split('/').next().unwrap_or("").parse::<u32>();
                faces.push([number(a)? - 1, number(b)? - 1, number(c)? - 1]);
            }
            _ => (),
        }
    }
    Ok(TriMesh::from_faces(positions, faces)?)
}

/// A mesh that [`write_part`] wrote.
fn read_part(path: &str) -> Result<TriMesh, Box<dyn Error>> {
    let file = fs::read(path)?;
    let end = file.windows(11).position(|w| w == b"end_header\n").ok_or("no header")? + 11;
    let header = String::from_utf8_lossy(&file[..end]).into_owned();
    let count = |noun: &str| -> Result<usize, Box<dyn Error>> {
        let line = header
            .lines()
            .find_map(|line| line.strip_prefix(noun))
            .ok_or("no count")?;
        Ok(line.trim().parse()?)
    };
    let (vertices, faces) = (count("element vertex")?, count("element face")?);
    let (points, corners) = file[end..].split_at(12 * vertices);
    let word = |bytes: &[u8], at: usize| [0, 1, 2, 3].map(|i| bytes[at + i]);
    let float = |at: usize| f32::from_le_bytes(word(points, at));
    let positions = (0..vertices).map(|v| Vec3::new(float(12 * v), float(12 * v + 4), float(12 * v + 8)));
    let corner = |f: usize, k: usize| u32::from_le_bytes(word(corners, 13 * f + 1 + 4 * k));
    let faces = (0..faces).map(|f| [corner(f, 0), corner(f, 1), corner(f, 2)]).collect();
    Ok(TriMesh::from_faces(positions.collect(), faces)?)
}

/// Prints the transform of two files as TOML; an error if there is no single answer.
fn align_two(a: &str, b: &str) -> Result<(), Box<dyn Error>> {
    let [a, b] = [SurfacePoints::of_mesh(&read_part(a)?)?, SurfacePoints::of_mesh(&read_part(b)?)?];
    let aligned = align(&a, &b, &AlignOptions::default())?;
    if let Some(doubt) = aligned.doubt() {
        return Err(format!("{doubt:?}").into());
    }
    let found = &aligned.places[0].b_from_a;
    let rows = [0, 1, 2].map(|row| {
        let m = found.matrix3.row(row);
        format!("[{:?}, {:?}, {:?}, {:?}]", m.x, m.y, m.z, found.translation[row])
    });
    println!("transform = [{}, [0.0, 0.0, 0.0, 1.0]]", rows.join(", "));
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = env::args().collect();
    if let [_, word, a, b] = &args[..]
        && word == "align"
    {
        return align_two(a, b);
    }
    let out = Path::new(args.get(1).ok_or("give a folder")?);
    fs::create_dir_all(out)?;
    let built = |building: Building| -> Result<Fine, Box<dyn Error>> {
        Ok(fine(&Building { texture_scale: 0.05, ..building }.build()?.mesh))
    };
    let drawn = |rooms, seed| Building::generate(&BuildingOptions::drawn(rooms, seed));
    let mut scenes = vec![
        ("office", built(Building::demo())?),
        ("two_storeys", built(Building::two_storeys())?),
        ("six_rooms", built(drawn(6, 11)?)?),
        ("twelve_rooms", built(drawn(12, 5)?)?),
    ];
    if let Some(path) = args.get(2) {
        scenes.push(("copyroom", fine(&obj(path)?)));
    }

    let mut dice = Dice(2026);
    let mut table = String::from("name,overlap,m00,m01,m02,m03,m10,m11,m12,m13,m20,m21,m22,m23\n");
    for (at, (name, scene)) in scenes.iter().enumerate() {
        for number in 0..PAIRS[0] + PAIRS[1] {
            let shift = dvec3(dice.next() - 0.5, dice.next() - 0.5, 0.1 * (dice.next() - 0.5)) * 60.0;
            let pose = DAffine3::from_rotation_translation(DQuat::from_rotation_z(TAU * dice.next()), shift);
            let direction = DQuat::from_rotation_z(TAU * dice.next()) * DVec3::X;
            let direction = direction.as_vec3();
            // The shares of the scene that the parts have, so that the second one shares `overlap`.
            let (overlap, first) = (0.1 + 0.4 * dice.next(), 0.4 + 0.3 * dice.next());
            let (overlap, below, above, other) = match number.checked_sub(PAIRS[0]) {
                None => (overlap, first, 1.0 - (1.0 - first) / (1.0 - overlap), scene),
                Some(0) => (0.0, 0.45, 0.55, scene),
                Some(_) => (0.0, first, 1.0 - first, &scenes[(at + 1) % scenes.len()].1),
            };
            let (below, above) = (cut_at(scene, direction, below), cut_at(other, direction, above));

            let pair = format!("{name}_{number}");
            let file = |part: &str| out.join(format!("{pair}_{part}.ply"));
            write_part(&file("a"), scene, |p| p.dot(direction) < below, &pose, &mut dice)?;
            write_part(&file("b"), other, |p| p.dot(direction) > above, &DAffine3::IDENTITY, &mut dice)?;
            let truth = pose.inverse();
            write!(table, "{pair},{overlap:.4}")?;
            for row in 0..3 {
                let m = truth.matrix3.row(row);
                write!(table, ",{:?},{:?},{:?},{:?}", m.x, m.y, m.z, truth.translation[row])?;
            }
            table.push('\n');
        }
    }
    fs::write(out.join("pairs.csv"), table)?;
    println!("{} pairs in {}", scenes.len() * (PAIRS[0] + PAIRS[1]), out.display());
    Ok(())
}
