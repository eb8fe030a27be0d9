//! A mesh that is as untidy as a scan.

use super::checked;
use super::shell::{shell, speckled};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::{MeshParts, TriMesh};

/// A mesh of exactly `faces` or `faces` − 1 triangles that looks like a scan: [`scan_like_rooms`], with 3
/// rooms and one more for every 25,000 faces, 24 at most.
///
/// # Panics
/// If `faces` is below 2,000.
pub fn scan_like(faces: usize, seed: u64) -> TriMesh {
    scan_like_rooms((3 + faces / 25_000).min(24) as u32, faces, seed)
}

/// A mesh of exactly `faces` or `faces` − 1 triangles that looks like a scan: rooms behind each other along
/// +Y, joined by doorways, with furniture in them; jittered vertices, 4 % of faces split, half of them into
/// slivers, and small holes. From (0, 0, 0) on, 6 m wide; a point 1.5 m above (3, 2.5) stands free in the
/// first room. The same `seed` gives the same mesh.
///
/// # Panics
/// If there is no room, or fewer than 600 faces a room or 2,000 in all.
pub fn scan_like_rooms(rooms: u32, faces: usize, seed: u64) -> TriMesh {
    assert!(
        rooms > 0 && faces >= 2000.max(600 * rooms as usize),
        "a scan of {faces} faces and {rooms} rooms"
    );

    // Cells for this many faces on about 190 m² a room, then larger ones until there is room for the splits.
    let mut cell = (2.0 * 190.0 * rooms as f32 / faces as f32).sqrt();
    let mut parts = loop {
        let parts = tidy_scan(rooms, cell, &mut ChaCha8Rng::seed_from_u64(seed));
        if parts.faces.len() * 100 <= faces * 92 {
            break parts;
        }
        cell *= 1.02;
    };

    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x5ca9);
    let amplitude = (0.2 * cell).min(0.02);
    for p in &mut parts.positions {
        *p += vec3(jitter(&mut rng, amplitude), jitter(&mut rng, amplitude), jitter(&mut rng, amplitude));
    }

    // Neighbours in the list are neighbours on the surface, so a run of faces is a strip that a scanner would
    // have missed.
    let mut missed = vec![false; parts.faces.len()];
    for _ in 0..faces / 2000 {
        let start = rng.random_range(0..parts.faces.len() - 8);
        missed[start..start + 8].fill(true);
    }

    for column in [&mut parts.faces, &mut parts.face_uvs] {
        let mut at = missed.iter();
        column.retain(|_| at.next() != Some(&true));
    }
    let mut at = missed.iter();
    parts.face_materials.retain(|_| at.next() != Some(&true));

    while parts.faces.len() + 2 <= faces {
        let face = rng.random_range(0..parts.faces.len());
        // Weights of the new vertex; one of nearly nothing makes a sliver along the edge opposite to that
        // corner.
        let mut weights = [1.0, rng.random_range(0.5..2.0), rng.random_range(0.5..2.0)];
        if rng.random_bool(0.5) {
            weights[rng.random_range(0..3)] = rng.random_range(1e-4..1e-2);
        }
        split(&mut parts, face, weights);
    }

    checked(parts)
}

/// The rooms of [`scan_like`] before they are spoilt, in cells of about `cell` metres.
fn tidy_scan(rooms: u32, cell: f32, rng: &mut ChaCha8Rng) -> MeshParts {
    let cells = |size: Vec3| (size / cell).ceil().max(Vec3::ONE).as_uvec3().to_array();
    let mut parts = MeshParts::default();
    let mut y = 0.0;
    for room in 0..rooms {
        let low = vec3(0.0, y, 0.0);
        let size = vec3(6.0, rng.random_range(4.8..5.6), rng.random_range(2.6..3.0));

        // Doorways in the walls at small and large y.
        let open = [None, None, None, None, Some(room > 0), Some(room + 1 < rooms)];
        let walls = shell(low, low + size, cells(size), |side, center| {
            side < 2 || open[side] != Some(true) || (center.x - 3.0).abs() > 0.5 || center.z > 2.1
        });
        parts.append(walls);

        for _ in 0..8 {
            // Along the walls at small and large x, so that the way from door to door is free.
            let extent =
                vec3(rng.random_range(0.3..1.2), rng.random_range(0.3..1.0), rng.random_range(0.2..2.0));
            let along = rng.random_range(0.05..size.y - extent.y - 0.05);
            let across = if rng.random_bool(0.5) {
                0.05
            } else {
                size.x - 0.05 - extent.x
            };

            let foot = low + vec3(across, along, 0.01);
            let mut item = shell(foot, foot + extent, cells(extent), |_, _| true);
            item.flip();

            if rng.random_bool(0.4) {
                // Rounded off: the box blown to the ellipsoid that touches its sides.
                let middle = foot + 0.5 * extent;
                for p in &mut item.positions {
                    *p = middle + ((*p - middle) / extent).normalize() * 0.5 * extent;
                }
            }
            parts.append(item);
        }

        y += size.y + 0.1;
    }

    // One set of materials for all.
    parts.face_materials.iter_mut().for_each(|m| *m %= 3);
    parts.materials.truncate(3);

    for material in &mut parts.materials {
        material.texture = Some(parts.textures.len() as u32);
        parts.textures.push(speckled(rng, &material.name));
    }
    parts
}

fn jitter(rng: &mut ChaCha8Rng, amplitude: f32) -> f32 {
    rng.random_range(-amplitude..amplitude)
}

/// Replaces `face` by three around the mean of its corners by `weights`; the last two go to the end of the
/// list.
fn split(parts: &mut MeshParts, face: usize, weights: [f32; 3]) {
    let sum: f32 = weights.iter().sum();
    let [wa, wb, wc] = weights.map(|w| w / sum);
    let [a, b, c] = parts.faces[face];
    let [pa, pb, pc] = [a, b, c].map(|v| parts.positions[v as usize]);
    let p = parts.positions.len() as u32;
    parts.positions.push(pa * wa + pb * wb + pc * wc);
    parts.faces[face] = [a, b, p];
    parts.faces.extend([[b, c, p], [c, a, p]]);
    let [a, b, c] = parts.face_uvs[face];
    let [ta, tb, tc] = [a, b, c].map(|i| parts.uvs[i as usize]);
    let p = parts.uvs.len() as u32;
    parts.uvs.push(ta * wa + tb * wb + tc * wc);
    parts.face_uvs[face] = [a, b, p];
    parts.face_uvs.extend([[b, c, p], [c, a, p]]);
    let material = parts.face_materials[face];
    parts.face_materials.extend([material; 2]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::shell::tests::{digest, open_edges};
    use s3d_geom::glam::DVec3;

    #[test]
    fn a_scan_has_its_size_slivers_and_holes() {
        for (faces, seed) in [(2000, 1), (5000, 2), (30_000, 3)] {
            let m = scan_like(faces, seed);
            assert!(m.faces().len() == faces || m.faces().len() + 1 == faces, "{}", m.faces().len());
            assert_eq!(digest(&m), digest(&scan_like(faces, seed)));
            assert_ne!(digest(&m), digest(&scan_like(faces, seed + 1)));
            assert!(open_edges(m.parts()) > 0);
            let longest = |f: u32| {
                let [a, b, c] = m.triangle(f);
                f64::from(a.distance(b).max(b.distance(c)).max(c.distance(a)))
            };
            let slivers = (0..m.faces().len() as u32)
                .filter(|&f| m.area(f) < 0.01 * longest(f) * longest(f))
                .count();
            assert!(slivers * 100 > faces, "{slivers}");
            let free = DVec3::new(3.0, 2.5, 1.5);
            let nearest = m
                .positions()
                .iter()
                .map(|p| p.as_dvec3().distance(free))
                .fold(f64::MAX, f64::min);
            assert!(nearest > 1.0, "{nearest}");
        }
    }
}
