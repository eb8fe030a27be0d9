//! The parts of the scenes: boxes of cells, and textures of blocks.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::{Vec3, vec2};
use s3d_geom::{Material, MeshParts, NO_INDEX, Raster, Texture, Wrap};

/// The surface of the box between two corners, its front inside, in `cells` quads along x, y and z. Vertices
/// are shared, also along the edges. `keep` chooses cells by their side (floor, ceiling, smallest x, largest
/// x, smallest y, largest y) and middle. Texture coordinates in metres, v upwards on walls; materials floor,
/// wall, ceiling.
pub(super) fn shell(min: Vec3, max: Vec3, cells: [u32; 3], keep: impl Fn(usize, Vec3) -> bool) -> MeshParts {
    assert!(
        min.cmplt(max).all() && cells.iter().all(|&n| n > 0),
        "a box from {min} to {max}, {cells:?} cells"
    );

    let coordinate = |axis: usize, i: u32| {
        // The ends are exact, so that boxes side by side touch.
        let n = cells[axis];
        if i == n {
            max[axis]
        } else {
            min[axis] + (max[axis] - min[axis]) * (i as f32 / n as f32)
        }
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
        let axis = [2, 0, 1][side / 2];
        let upper = side % 2 == 1;
        let b = (axis + 1) % 3;
        let c = (axis + 2) % 3;
        let at = if upper { cells[axis] } else { 0 };
        let base = parts.uvs.len() as u32;

        for k in 0..=cells[c] {
            for j in 0..=cells[b] {
                let pb = coordinate(b, j) - min[b];
                let pc = coordinate(c, k) - min[c];
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
pub(super) fn speckled(rng: &mut ChaCha8Rng, name: &str) -> Texture {
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use s3d_geom::TriMesh;
    use s3d_geom::glam::vec3;
    use std::collections::BTreeMap;

    /// How many edges are not run through once in each direction.
    pub(in crate::scenes) fn open_edges(parts: &MeshParts) -> usize {
        let mut balance = BTreeMap::new();
        for &[a, b, c] in &parts.faces {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *balance.entry((from.min(to), from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
            }
        }
        balance.values().filter(|&&n| n != 0).count()
    }

    pub(in crate::scenes) fn digest(mesh: &TriMesh) -> u64 {
        let bits = mesh
            .positions()
            .iter()
            .flat_map(|p| p.to_array())
            .map(|x| u64::from(x.to_bits()));
        let indices = mesh.faces().iter().flatten().map(|&v| u64::from(v));
        bits.chain(indices)
            .fold(0xcbf2_9ce4_8422_2325, |h: u64, x| (h ^ x).wrapping_mul(0x0100_0000_01b3))
    }

    #[test]
    fn a_shell_is_closed_and_looks_inwards() {
        let parts = shell(Vec3::ZERO, vec3(4.0, 3.0, 2.5), [4, 3, 2], |_, _| true);
        assert_eq!(open_edges(&parts), 0);
        let room = TriMesh::new(parts).unwrap();
        assert_eq!((room.faces().len(), room.aabb().to_array()), (104, [0.0, 0.0, 0.0, 4.0, 3.0, 2.5]));
        let upward = (0..104)
            .filter(|&f| room.normal(f) == Vec3::Z)
            .map(|f| room.material_of(f));
        assert_eq!(upward.collect::<Vec<_>>(), [Some(0); 24]);
    }
}
