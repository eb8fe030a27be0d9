//! Splits the faces of a mesh into blocks that lie together.

use glam::Vec3;
use s3d_geom::TriMesh;

/// The most faces of a block: the data of one block fits in the caches.
const MAX_FACES: usize = 1 << 14;

/// A face and the middle of its bounding box.
#[derive(Clone, Copy)]
struct Placed {
    middle: Vec3,
    face: u32,
}

/// Returns all faces of a mesh, in blocks.
pub(crate) fn blocks(mesh: &TriMesh) -> Vec<Vec<u32>> {
    let count = mesh.faces().len();
    if count <= MAX_FACES {
        return vec![(0..count as u32).collect()];
    }

    let mut placed: Vec<Placed> = (0..count as u32)
        .map(|face| {
            let [a, b, c] = mesh.triangle(face);
            Placed { middle: a.min(b).min(c).midpoint(a.max(b).max(c)), face }
        })
        .collect();
    split(&mut placed, MAX_FACES)
}

/// Halves the longest side of the box around all middles, until few enough faces are left.
fn split(placed: &mut [Placed], max_faces: usize) -> Vec<Vec<u32>> {
    if placed.len() <= max_faces {
        return vec![placed.iter().map(|p| p.face).collect()];
    }

    let (min, max) = placed
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), p| (min.min(p.middle), max.max(p.middle)));
    let axis = (max - min).max_position();
    let half = min.midpoint(max)[axis];
    let mut middle = partition(placed, |p| p.middle[axis] < half);
    // If nearly all faces are on one side, their number is halved instead, so that no scan needs many rounds.
    if middle.min(placed.len() - middle) <= placed.len() / 16 {
        middle = placed.len() / 2;
        placed.select_nth_unstable_by(middle, |a, b| {
            a.middle[axis].total_cmp(&b.middle[axis]).then(a.face.cmp(&b.face))
        });
    }

    let (left, right) = placed.split_at_mut(middle);
    let (mut blocks, mut rest) = rayon::join(|| split(left, max_faces), || split(right, max_faces));
    blocks.append(&mut rest);
    blocks
}

/// Moves the elements for which `first` holds to the front, and returns their number.
fn partition(placed: &mut [Placed], first: impl Fn(&Placed) -> bool) -> usize {
    let mut end = 0;
    for k in 0..placed.len() {
        let is_first = first(&placed[k]);
        placed.swap(end, k);
        end += usize::from(is_first);
    }
    end
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(face: u32, middle: Vec3) -> Placed {
        Placed { middle, face }
    }

    #[test]
    fn every_face_is_in_one_block_even_where_all_lie_at_one_place() {
        for place in
            [|k: u32| Vec3::splat((k * k % 97) as f32), |_| Vec3::ONE, |k| Vec3::X * (k as f32).exp()]
        {
            let mut placed: Vec<Placed> = (0..80).map(|k| at(k, place(k))).collect();
            let blocks = split(&mut placed, 7);
            assert!(blocks.iter().all(|block| (1..=7).contains(&block.len())), "{blocks:?}");
            let mut faces = blocks.concat();
            faces.sort_unstable();
            assert_eq!(faces, Vec::from_iter(0..80));
        }
    }

    #[test]
    fn blocks_are_halves_of_space() {
        let mut placed: Vec<Placed> = (0..40).map(|k| at(k, Vec3::Y * (k * 7 % 40) as f32)).collect();
        let blocks = split(&mut placed, 10);
        assert_eq!(blocks.len(), 4);
        for (k, block) in blocks.iter().enumerate() {
            assert!(block.iter().all(|face| (face * 7 % 40) as usize / 10 == k), "{blocks:?}");
        }
    }
}
