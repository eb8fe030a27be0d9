//! Building stones and fixtures: patches, bodies, rooms, and a mesh that is as untidy as a scan.
//!
//! Patches ([`quad`], [`grid`]) have texture coordinates from (0, 0) to (1, 1); those of bodies and rooms count metres,
//! so that a texture repeats once a metre. Corners at the same place are the same vertex wherever a body is closed.

use crate::{Material, MeshParts, NO_INDEX, Raster, Texture, TriMesh, Wrap};
use glam::{Vec2, Vec3, vec2, vec3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Two triangles over four `corners`, given counter-clockwise seen from the front, from the texture's bottom left.
pub fn quad(corners: [Vec3; 4]) -> MeshParts {
    MeshParts {
        positions: corners.to_vec(),
        faces: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        face_uvs: vec![[0, 1, 2], [0, 2, 3]],
        ..MeshParts::default()
    }
}

/// The parallelogram from `origin` along `u` and `v`, in `cells[0]` × `cells[1]` quads of two triangles; its front is
/// on the side of `u × v`. Row by row along `u`.
///
/// # Panics
/// If there is no cell.
pub fn grid(origin: Vec3, u: Vec3, v: Vec3, cells: [u32; 2]) -> MeshParts {
    let [nu, nv] = cells;
    assert!(nu > 0 && nv > 0, "a grid of {nu} × {nv} cells");
    let mut parts = MeshParts::default();
    for j in 0..=nv {
        for i in 0..=nu {
            let uv = vec2(i as f32 / nu as f32, j as f32 / nv as f32);
            parts.positions.push(origin + u * uv.x + v * uv.y);
            parts.uvs.push(uv);
        }
    }
    for j in 0..nv {
        for i in 0..nu {
            let a = j * (nu + 1) + i;
            let [b, c, d] = [a + 1, a + nu + 2, a + nu + 1];
            parts.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    parts.face_uvs = parts.faces.clone();
    parts
}

/// The closed box between two corners, its front outside. Eight vertices; side by side in the order x, y, z, the side
/// at `min` before the one at `max`.
///
/// # Panics
/// If `max` is not above `min` on each axis.
pub fn cuboid(min: Vec3, max: Vec3) -> MeshParts {
    let mut parts = shell(min, max, [1; 3], |_, _| true);
    parts.flip();
    parts
}

/// A closed upright cylinder, its front outside: `base` is the centre of its bottom, `sides` the number of its quads
/// around.
///
/// # Panics
/// If a length is not positive or there are fewer than three sides.
pub fn cylinder(base: Vec3, radius_m: f32, height_m: f32, sides: u32) -> MeshParts {
    assert!(
        radius_m > 0.0 && height_m > 0.0 && sides >= 3,
        "a cylinder of {radius_m} m × {height_m} m, {sides} sides"
    );
    let step_rad = std::f32::consts::TAU / sides as f32;
    let mut parts = MeshParts {
        positions: vec![base, base + Vec3::Z * height_m],
        uvs: vec![Vec2::splat(radius_m)],
        ..MeshParts::default()
    };
    // Per column: a vertex below, one above; coordinates of the lid's corner, then of the wall's lower and upper one.
    for i in 0..=sides {
        let spoke = Vec2::from_angle(i as f32 * step_rad) * radius_m;
        if i < sides {
            let foot = base + spoke.extend(0.0);
            parts.positions.extend([foot, foot + Vec3::Z * height_m]);
        }
        let along = i as f32 * step_rad * radius_m;
        parts.uvs.extend([spoke + radius_m, vec2(along, 0.0), vec2(along, height_m)]);
    }
    for i in 0..sides {
        let [a, b] = [i, (i + 1) % sides].map(|k| 2 + 2 * k);
        let [ta, tb] = [i, i + 1].map(|k| 1 + 3 * k);
        parts.faces.extend([[0, b, a], [1, a + 1, b + 1], [a, b, b + 1], [a, b + 1, a + 1]]);
        parts.face_uvs.extend([[0, tb, ta], [0, ta, tb], [ta + 1, tb + 1, tb + 2], [ta + 1, tb + 2, ta + 2]]);
    }
    parts
}

/// A closed, empty room from the origin to `size_m`, its fronts inside: eight vertices, twelve faces, materials
/// `floor`, `wall` and `ceiling` without textures. Every ray from inside hits it.
///
/// # Panics
/// If a size is not positive.
pub fn room(size_m: Vec3) -> TriMesh {
    checked(shell(Vec3::ZERO, size_m, [1; 3], |_, _| true))
}

/// A closed, textured room with furniture in its corners, from the origin to between (4.5, 4, 2.6) and (6, 5.5, 3)
/// metres; its middle is free from floor to ceiling. Same `seed`, same room.
pub fn furnished_room(seed: u64) -> TriMesh {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let size = vec3(rng.random_range(4.5..6.0), rng.random_range(4.0..5.5), rng.random_range(2.6..3.0));
    let mut parts = shell(Vec3::ZERO, size, (size / 0.25).as_uvec3().to_array(), |_, _| true);
    for (material, name) in ["floor", "wall", "ceiling"].into_iter().enumerate() {
        parts.materials[material].texture = Some(parts.textures.len() as u32);
        parts.textures.push(speckled(&mut rng, name));
    }
    for corner in [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.0, 1.0), vec2(1.0, 1.0)] {
        // The item's box, 5 to 20 cm off the walls.
        let extent = vec2(rng.random_range(0.8..1.3), rng.random_range(0.5..0.9));
        let gap = vec2(rng.random_range(0.05..0.2), rng.random_range(0.05..0.2));
        let low = gap + corner * (size.truncate() - extent - 2.0 * gap);
        let high = low + extent;
        let kind = rng.random_range(0..3);
        let mut item = match kind {
            0 => {
                let top = rng.random_range(0.68..0.76);
                let legs = [low, vec2(high.x - 0.05, low.y), high - 0.05, vec2(low.x, high.y - 0.05)];
                let legs = legs.map(|p| cuboid(p.extend(0.005), (p + 0.05).extend(top)));
                MeshParts::merge([cuboid(low.extend(top), high.extend(top + 0.03))].into_iter().chain(legs))
            }
            1 => cuboid(low.extend(0.005), high.extend(rng.random_range(0.8..1.9))),
            _ => cylinder(((low + high) * 0.5).extend(0.005), 0.5 * extent.y, rng.random_range(0.4..1.0), 24),
        };
        let name = ["table", "bookcase", "clutter"][kind];
        let color = std::array::from_fn(|_| rng.random_range(40..220));
        item.materials = vec![Material { name: name.into(), color, texture: (kind == 1).then_some(0) }];
        item.textures.extend((kind == 1).then(|| speckled(&mut rng, name)));
        item.face_materials = vec![0; item.faces.len()];
        parts.append(item);
    }
    checked(parts)
}

/// A mesh of exactly `faces` or `faces` − 1 triangles that looks like a scan: [`scan_like_rooms`], with 3 rooms and one
/// more for every 25,000 faces, 24 at most.
///
/// # Panics
/// If `faces` is below 2,000.
pub fn scan_like(faces: usize, seed: u64) -> TriMesh {
    scan_like_rooms((3 + faces / 25_000).min(24) as u32, faces, seed)
}

/// A mesh of exactly `faces` or `faces` − 1 triangles that looks like a scan: rooms behind each other along +Y, joined
/// by doorways, with furniture in them; jittered vertices, 4 % of faces split, half of them into slivers, and small
/// holes. From (0, 0, 0) on, 6 m wide; a point 1.5 m above (3, 2.5) stands free in the first room. Same `seed`, same
/// mesh.
///
/// # Panics
/// If there is no room, or fewer than 600 faces a room or 2,000 in all.
pub fn scan_like_rooms(rooms: u32, faces: usize, seed: u64) -> TriMesh {
    assert!(
        rooms > 0 && faces >= 2000.max(600 * rooms as usize),
        "a scan of {faces} faces and {rooms} rooms"
    );
    // As many faces as that on about 190 m² a room, then coarser until there is room for the splits.
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
    // Neighbours in the list are neighbours on the surface, so a run of faces is a strip that the scanner missed.
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
        // Weights of the new vertex; one of nearly nothing makes a sliver along the edge opposite to that corner.
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
            let across = if rng.random_bool(0.5) { 0.05 } else { size.x - 0.05 - extent.x };
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

/// Replaces `face` by three around the mean of its corners by `weights`; the last two go to the end of the list.
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

/// The surface of the box between two corners, its front inside, in `cells` quads along x, y and z. Vertices are
/// shared, also along the edges. Only the cells that `keep` wants by side (floor, ceiling, smallest x, largest x,
/// smallest y, largest y) and middle. Texture coordinates in metres, v upwards on walls; materials floor, wall, ceiling.
fn shell(min: Vec3, max: Vec3, cells: [u32; 3], keep: impl Fn(usize, Vec3) -> bool) -> MeshParts {
    assert!(
        min.cmplt(max).all() && cells.iter().all(|&n| n > 0),
        "a box from {min} to {max}, {cells:?} cells"
    );
    let coordinate = |axis: usize, i: u32| {
        // The ends exactly, so that a box touches what it should touch.
        let n = cells[axis];
        if i == n { max[axis] } else { min[axis] + (max[axis] - min[axis]) * (i as f32 / n as f32) }
    };
    let strides = [1, cells[0] as usize + 1, (cells[0] as usize + 1) * (cells[1] as usize + 1)];
    let mut vertex_of = vec![NO_INDEX; strides[2] * (cells[2] as usize + 1)];
    let mut parts = MeshParts {
        materials: [("floor", [150, 130, 110]), ("wall", [225, 222, 212]), ("ceiling", [240; 3])]
            .map(|(name, color)| Material { name: name.into(), color, texture: None })
            .to_vec(),
        ..MeshParts::default()
    };
    for side in 0..6 {
        let (axis, upper) = ([2, 0, 1][side / 2], side % 2 == 1);
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = if upper { cells[axis] } else { 0 };
        let base = parts.uvs.len() as u32;
        for k in 0..=cells[c] {
            for j in 0..=cells[b] {
                let (pb, pc) = (coordinate(b, j) - min[b], coordinate(c, k) - min[c]);
                parts.uvs.push(if axis == 1 { vec2(pc, pb) } else { vec2(pb, pc) });
            }
        }
        for k in 0..cells[c] {
            for j in 0..cells[b] {
                let point = |j: u32, k: u32| {
                    let mut lattice = [0; 3];
                    (lattice[axis], lattice[b], lattice[c]) = (at, j, k);
                    lattice
                };
                let place = |l: [u32; 3]| Vec3::from_array(std::array::from_fn(|a| coordinate(a, l[a])));
                if !keep(side, (place(point(j, k)) + place(point(j + 1, k + 1))) * 0.5) {
                    continue;
                }
                let corners = [(j, k), (j + 1, k), (j + 1, k + 1), (j, k + 1)];
                let mut v = corners.map(|(j, k)| {
                    let lattice = point(j, k);
                    let slot =
                        &mut vertex_of[(0..3).map(|a| lattice[a] as usize * strides[a]).sum::<usize>()];
                    if *slot == NO_INDEX {
                        *slot = parts.positions.len() as u32;
                        parts.positions.push(place(lattice));
                    }
                    *slot
                });
                let mut t = corners.map(|(j, k)| base + k * (cells[b] + 1) + j);
                if upper {
                    v.swap(1, 3);
                    t.swap(1, 3);
                }
                parts.faces.extend([[v[0], v[1], v[2]], [v[0], v[2], v[3]]]);
                parts.face_uvs.extend([[t[0], t[1], t[2]], [t[0], t[2], t[3]]]);
                parts.face_materials.extend([[0, 2, 1, 1, 1, 1][side]; 2]);
            }
        }
    }
    parts
}

/// A small texture of random grey-brown blocks that differ, so that a wrong coordinate shows.
fn speckled(rng: &mut ChaCha8Rng, name: &str) -> Texture {
    const SIZE: u32 = 64;
    let base: [i32; 3] = std::array::from_fn(|_| rng.random_range(90..200));
    let blocks: Vec<i32> = (0..64).map(|_| rng.random_range(-40..40)).collect();
    let pixels = (0..SIZE * SIZE).map(|i| {
        let block = blocks[(i / SIZE / 8 * 8 + i % SIZE / 8) as usize] + rng.random_range(-8..8);
        base.map(|channel| (channel + block) as u8)
    });
    let image = Raster::from_vec(SIZE, SIZE, pixels.collect());
    Texture { name: name.to_owned(), image, wrap: [Wrap::Repeat; 2] }
}

#[expect(clippy::expect_used, reason = "fixtures are made here, of finite corners and faces with an area")]
fn checked(parts: MeshParts) -> TriMesh {
    TriMesh::new(parts).expect("a fixture is a mesh")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, FaceColor};
    use glam::DVec3;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// The volume that the faces enclose, positive if their fronts are outside.
    fn volume(parts: &MeshParts) -> f64 {
        let p = |v: u32| parts.positions[v as usize].as_dvec3();
        parts.faces.iter().map(|&[a, b, c]| p(a).dot(p(b).cross(p(c))) / 6.0).sum()
    }

    /// How many edges are not run through once in each direction.
    fn open_edges(parts: &MeshParts) -> usize {
        let mut balance = BTreeMap::new();
        for &[a, b, c] in &parts.faces {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *balance.entry((from.min(to), from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
            }
        }
        balance.values().filter(|&&n| n != 0).count()
    }

    fn digest(mesh: &TriMesh) -> u64 {
        let bits = mesh.positions().iter().flat_map(|p| p.to_array()).map(|x| u64::from(x.to_bits()));
        let indices = mesh.faces().iter().flatten().map(|&v| u64::from(v));
        bits.chain(indices).fold(0xcbf2_9ce4_8422_2325, |h: u64, x| (h ^ x).wrapping_mul(0x0100_0000_01b3))
    }

    #[test]
    fn bodies_are_closed_and_turned_outwards() {
        let b = cuboid(vec3(1.0, 2.0, 3.0), vec3(2.0, 4.0, 6.0));
        assert_eq!((b.positions.len(), b.faces.len(), open_edges(&b)), (8, 12, 0));
        assert!((volume(&b) - 6.0).abs() < 1e-9);
        let c = cylinder(vec3(1.0, 1.0, 0.5), 0.5, 2.0, 64);
        assert_eq!(open_edges(&c), 0);
        assert!((volume(&c) - 0.5 * std::f64::consts::PI).abs() < 0.01);
        TriMesh::new(c).unwrap();
    }

    #[test]
    fn texture_coordinates_of_bodies_are_metres() {
        let c = TriMesh::new(cylinder(Vec3::ZERO, 0.4, 1.0, 24)).unwrap();
        for parts in [cuboid(Vec3::ZERO, vec3(1.0, 2.0, 3.0)), c.into_parts()] {
            for (f, t) in parts.faces.iter().zip(&parts.face_uvs) {
                for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                    let space = parts.positions[f[i] as usize].distance(parts.positions[f[j] as usize]);
                    let image = parts.uvs[t[i] as usize].distance(parts.uvs[t[j] as usize]);
                    // A chord is a little shorter than its arc.
                    assert!((space - image).abs() < 0.003, "{space} {image}");
                }
            }
        }
    }

    #[test]
    fn a_grid_faces_along_u_cross_v_and_its_texture_fits() {
        let g = grid(vec3(0.0, 0.0, 1.0), Vec3::X * 3.0, Vec3::Y * 2.0, [3, 4]);
        assert_eq!(*g.uvs.last().unwrap(), Vec2::ONE);
        let m = TriMesh::new(g).unwrap();
        assert_eq!(m.faces().len(), 24);
        assert!((0..24).all(|f| m.normal(f) == Vec3::Z));
        assert!((m.total_area() - 6.0).abs() < 1e-6);
        let q = quad([Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Z, Vec3::Z]);
        assert_eq!(TriMesh::new(q).unwrap().normal(1), -Vec3::Y);
    }

    #[test]
    fn a_room_is_closed_and_turned_inwards() {
        let r = room(vec3(4.0, 3.0, 2.5));
        assert_eq!((r.positions().len(), r.faces().len(), open_edges(r.parts())), (8, 12, 0));
        assert!((volume(r.parts()) + 30.0).abs() < 1e-9);
        assert_eq!(r.aabb().to_array(), [0.0, 0.0, 0.0, 4.0, 3.0, 2.5]);
        let upward = (0..12).filter(|&f| r.normal(f) == Vec3::Z).map(|f| r.material_of(f));
        assert_eq!(upward.collect::<Vec<_>>(), [Some(0), Some(0)]);
    }

    proptest! {
        #[test]
        fn furnished_rooms_are_closed_textured_and_free_in_the_middle(seed in any::<u64>()) {
            let m = furnished_room(seed);
            prop_assert_eq!(open_edges(m.parts()), 0);
            prop_assert_eq!(digest(&m), digest(&furnished_room(seed)));
            let textured = (0..m.faces().len() as u32).filter(|&f| matches!(m.color_of(f), FaceColor::Texture(..))).count();
            prop_assert!(textured * 2 > m.faces().len());
            let (middle, height) = (m.aabb().center(), m.aabb().max.z);
            for p in m.positions() {
                // Whatever is near the middle's vertical belongs to floor or ceiling.
                let near = p.truncate().distance(middle.truncate()) < 0.4;
                prop_assert!(!near || p.z == 0.0 || p.z == height, "{}", p);
            }
        }
    }

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
            let slivers =
                (0..m.faces().len() as u32).filter(|&f| m.area(f) < 0.01 * longest(f) * longest(f)).count();
            assert!(slivers * 100 > faces, "{slivers}");
            let free = DVec3::new(3.0, 2.5, 1.5);
            let nearest = m.positions().iter().map(|p| p.as_dvec3().distance(free)).fold(f64::MAX, f64::min);
            assert!(nearest > 1.0, "{nearest}");
        }
    }

    #[test]
    fn boxes_follow_their_corners() {
        let (low, high) = (vec3(10.1, 5.3, 0.7), vec3(11.7, 5.9, 1.3));
        assert_eq!(Aabb::from_points(cuboid(low, high).positions), Aabb { min: low, max: high });
    }

    #[test]
    #[should_panic(expected = "a box from")]
    fn a_box_without_extent_is_a_callers_mistake() {
        let _ = cuboid(Vec3::ZERO, Vec3::X);
    }
}
