//! Makes pairs of parts of buildings, and aligns them.
use s3d_fusion::{AlignOptions, SurfacePoints, align};
use s3d_geom::TriMesh;
use s3d_geom::glam::{DAffine3, DQuat, DVec3, Vec3, dvec3};
use s3d_synth::{Building, BuildingOptions};
use std::collections::HashMap;
use std::time::Instant;

struct Dice(u64);
impl Dice {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((x ^ (x >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    fn normal(&mut self) -> f64 {
        (0..6).map(|_| self.next() - 0.5).sum::<f64>() * 2f64.sqrt()
    }
}

type Soup = (Vec<Vec3>, Vec<[u32; 3]>);

fn fine(mesh: &TriMesh, edge: f32) -> Soup {
    let mut at = HashMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    let mut stack: Vec<[Vec3; 3]> = (0..mesh.faces().len() as u32).map(|f| mesh.triangle(f)).collect();
    while let Some([a, b, c]) = stack.pop() {
        let lengths = [a.distance(b), b.distance(c), c.distance(a)];
        let longest = (0..3).max_by(|&i, &j| lengths[i].total_cmp(&lengths[j])).unwrap();
        if lengths[longest] > edge {
            let [a, b, c] = [[a, b, c], [b, c, a], [c, a, b]][longest];
            let m = (a + b) / 2.0;
            stack.extend([[a, m, c], [m, b, c]]);
            continue;
        }
        faces.push([a, b, c].map(|p| {
            *at.entry(p.to_array().map(f32::to_bits)).or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
        }));
    }
    (positions, faces)
}

fn part(soup: &Soup, keep: impl Fn(Vec3) -> bool, pose: &DAffine3, noise: f64, dice: &mut Dice) -> TriMesh {
    let (positions, faces) = soup;
    let faces: Vec<[u32; 3]> = faces
        .iter()
        .copied()
        .filter(|f| keep(f.iter().map(|i| positions[*i as usize]).sum::<Vec3>() / 3.0))
        .collect();
    let mut new = vec![u32::MAX; positions.len()];
    let mut out = Vec::new();
    let faces = faces
        .iter()
        .map(|f| {
            f.map(|i| {
                let i = i as usize;
                if new[i] == u32::MAX {
                    new[i] = out.len() as u32;
                    let off = dvec3(dice.normal(), dice.normal(), dice.normal()) * noise;
                    out.push(pose.transform_point3(positions[i].as_dvec3() + off).as_vec3());
                }
                new[i]
            })
        })
        .collect();
    TriMesh::from_faces(out, faces).unwrap()
}

fn copyroom() -> Option<TriMesh> {
    let text = std::fs::read_to_string("/work/shared/scans/copyroom/rgb.obj").ok()?;
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first() {
            Some(&"v") => {
                let v: Vec<f32> = words[1..4].iter().map(|w| w.parse().unwrap()).collect();
                positions.push(Vec3::new(v[0], -v[2], v[1]));
            }
            Some(&"f") => {
                let f: Vec<u32> = words[1..4]
                    .iter()
                    .map(|w| w.split('/').next().unwrap().parse::<u32>().unwrap() - 1)
                    .collect();
                faces.push([f[0], f[1], f[2]]);
            }
            _ => (),
        }
    }
    TriMesh::from_faces(positions, faces).ok()
}

fn main() {
    let built = |b: Building| Building { texture_scale: 0.05, ..b }.build().unwrap().mesh;
    let drawn = |n, seed| {
        built(
            Building::generate(&BuildingOptions { texture_scale: 0.05, ..BuildingOptions::drawn(n, seed) })
                .unwrap(),
        )
    };
    let mut scenes: Vec<(&str, Soup)> = vec![
        ("office", fine(&built(Building::demo()), 0.2)),
        ("storeys", fine(&built(Building::two_storeys()), 0.2)),
        ("drawn6", fine(&drawn(6, 11), 0.2)),
        ("drawn12", fine(&drawn(12, 5), 0.2)),
    ];
    if let Some(mesh) = copyroom() {
        scenes.push(("copyroom", fine(&mesh, 0.2)));
    }
    let per: usize = std::env::args().nth(1).map_or(4, |n| n.parse().unwrap());
    let only = std::env::args().nth(2).unwrap_or_default();
    let mut dice = Dice(7);
    // Right pairs, then wrong ones.
    for wrong in [false, true] {
        for (s, (name, soup)) in scenes.iter().enumerate() {
            for k in 0..per {
                let yaw = dice.next() * 6.28318;
                let shift =
                    dvec3(60.0 * (dice.next() - 0.5), 60.0 * (dice.next() - 0.5), 6.0 * (dice.next() - 0.5));
                let pose = DAffine3::from_rotation_translation(DQuat::from_rotation_z(yaw), shift);
                let angle = dice.next() * 6.28318;
                let d = Vec3::new(angle.cos() as f32, angle.sin() as f32, 0.0);
                let overlap = 0.1 + 0.4 * dice.next();
                let fa = 0.4 + 0.3 * dice.next();
                let seed = (s * 1000 + k) as u64 + if wrong { 77_000 } else { 0 };
                if !only.is_empty() && !format!("{name}{k}{}", if wrong { "w" } else { "" }).contains(&only) {
                    continue;
                }
                let sorted = |soup: &Soup| {
                    let mut v: Vec<(f32, f32)> = soup
                        .1
                        .iter()
                        .map(|f| {
                            let p = f.map(|i| soup.0[i as usize]);
                            ((p[0] + p[1] + p[2]).dot(d) / 3.0, (p[1] - p[0]).cross(p[2] - p[0]).length())
                        })
                        .collect();
                    v.sort_by(|a, b| a.0.total_cmp(&b.0));
                    let total: f32 = v.iter().map(|v| v.1).sum();
                    move |share: f64| {
                        let mut sum = 0.0;
                        v.iter()
                            .find(|v| {
                                sum += v.1;
                                sum >= share as f32 * total
                            })
                            .map_or(f32::MAX, |v| v.0)
                    }
                };
                let other = if wrong && k % 2 == 0 {
                    &scenes[(s + 1) % scenes.len()].1
                } else {
                    soup
                };
                let (of_a, of_b) = (sorted(soup), sorted(other));
                let (ta, tb) = if wrong {
                    (of_a(fa.min(0.45)), of_b(0.55))
                } else {
                    (of_a(fa), of_b(1.0 - (1.0 - fa) / (1.0 - overlap)))
                };
                let mut noise = Dice(seed);
                let a = part(soup, |p| p.dot(d) < ta, &pose, 0.005, &mut noise);
                let b = part(other, |p| p.dot(d) > tb, &DAffine3::IDENTITY, 0.005, &mut noise);
                let center = pose.inverse().transform_point3(a.aabb().center().as_dvec3());
                let start = Instant::now();
                let [a, b] = [&a, &b].map(|m| SurfacePoints::of_mesh(m).unwrap());
                let sampled = start.elapsed().as_secs_f64();
                let found = align(&a, &b, &AlignOptions::default());
                let all = start.elapsed().as_secs_f64();
                let label = format!("{name}{k}{}", if wrong { "w" } else { "" });
                match found {
                    Err(e) => println!("{label:12} o={overlap:.2} {all:.1}s refused: {e}"),
                    Ok(found) => {
                        let doubt = match found.doubt() {
                            None => "CERTAIN".to_owned(),
                            Some(d) => format!("{d:.2?}"),
                        };
                        let found = found.places;
                        let best = &found[0];
                        let truth = pose.inverse();
                        let off = best.b_from_a * truth.inverse();
                        let middle = truth.transform_point3(pose.transform_point3(DVec3::ZERO));
                        let _ = middle;
                        let c: DVec3 = center;
                        let mm = off.transform_point3(c).distance(c) * 1e3;
                        let deg = DQuat::from_mat3(&off.matrix3).to_scaled_axis().length().to_degrees();
                        let good = if mm < 5.0 && deg < 0.05 {
                            "GOOD"
                        } else if mm < 50.0 && deg < 1.0 {
                            "NEAR"
                        } else {
                            "BAD"
                        };
                        let second = found.get(1).map_or(0.0, |s| s.evidence_m2 / best.evidence_m2);
                        println!(
                            "{label:12} o={overlap:.2} {sampled:.1}/{all:.1}s {doubt} {good} {mm:.1}mm {deg:.3}° ev={:.1} contra={:.3} second={second:.2} ov={:.2?} med={:.1}mm rms={:.1}mm open={}",
                            best.evidence_m2,
                            best.contradiction,
                            best.overlap,
                            best.median_m * 1e3,
                            best.rms_m * 1e3,
                            best.open.len()
                        );
                    }
                }
            }
        }
    }
}
