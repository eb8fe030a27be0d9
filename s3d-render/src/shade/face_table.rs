//! Numbers the faces that an image shows, row after row, so that the prepared data of a face is found again.
//!
//! The spans of a block of rows get their numbers first, and new faces are listed. Many new faces are then
//! prepared at a time, which takes a fraction of the time that single faces take.

use crate::hits::NO_FACE;
use crate::simd::shade_lanes::ShadeLanes;
use s3d_geom::TriMesh;

/// Numbers faces 1, 2, 3… as they come; [`NO_FACE`] has the number 0. To bound its memory, the table
/// sometimes forgets all numbers but 0. The pixels of a face lie together, in one row after another.
pub(crate) struct FaceTable {
    /// The face at each place and its number. The place follows from the index of the face.
    places: Vec<(u32, u32)>,
    count: usize,
    max_count: usize,
}

/// A face without a number so far.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NewFace {
    pub(crate) face: u32,
    /// The first pixel that sees it.
    pub(crate) at: u32,
}

impl FaceTable {
    /// Far more than the faces across a panorama, and a power of two.
    const PLACES: usize = 8192;

    /// Returns a table for blocks of at most `longest` pixels.
    pub(crate) fn new(longest: usize) -> Self {
        Self { places: vec![(NO_FACE, 0); Self::PLACES], count: 1, max_count: Self::PLACES + longest }
    }

    /// Looks up the faces of a block's spans, which begin at `starts`. Writes their numbers to `numbers`, and
    /// the faces that had none, in the order of their new numbers, to `new`. Returns whether all earlier
    /// numbers are forgotten. The indices of new faces in `mesh`, if given, are prefetched.
    #[inline(always)]
    pub(crate) fn number(
        &mut self,
        lanes: impl ShadeLanes,
        mesh: Option<&TriMesh>,
        faces: &[u32],
        starts: &[u32],
        numbers: &mut Vec<u32>,
        new: &mut Vec<NewFace>,
    ) -> bool {
        let forget = self.count + starts.len() > self.max_count;
        if forget {
            self.count = 1;
            self.places.fill((NO_FACE, 0));
        }

        numbers.clear();
        new.clear();
        // Loops instead of closures, which would not be compiled for the instructions of the lanes.
        for &at in starts {
            let face = faces[at as usize];
            let place = &mut self.places[face as usize % Self::PLACES];
            let mut number = place.1;
            if place.0 != face {
                number = 0;
                if face != NO_FACE {
                    number = self.count as u32;
                    *place = (face, number);
                    self.count += 1;
                    new.push(NewFace { face, at });
                    if let Some(mesh) = mesh {
                        prefetch_face(lanes, mesh, face as usize);
                    }
                }
            }
            numbers.push(number);
        }
        forget
    }
}

impl NewFace {
    /// Prefetches the parts of a mesh that the preparation of these faces reads and that
    /// [`FaceTable::number`] has not prefetched. Prefetching many at once is many times as fast.
    #[inline(always)]
    pub(crate) fn prefetch<const COLORS: bool>(new: &[Self], lanes: impl ShadeLanes, mesh: &TriMesh) {
        let p = mesh.parts();
        for &Self { face, .. } in new {
            for vertex in p.faces[face as usize] {
                lanes.prefetch(&p.positions[vertex as usize]);
            }
            if COLORS && let Some(corners) = p.face_uvs.get(face as usize) {
                for &corner in corners {
                    if let Some(uv) = p.uvs.get(corner as usize) {
                        lanes.prefetch(uv);
                    }
                }
            }
        }
    }
}

/// Prefetches the indices that lead to a face's corners.
#[inline(always)]
fn prefetch_face(lanes: impl ShadeLanes, mesh: &TriMesh, face: usize) {
    let p = mesh.parts();
    if let Some(corners) = p.faces.get(face) {
        lanes.prefetch(corners);
    }
    if let (Some(uvs), Some(material)) = (p.face_uvs.get(face), p.face_materials.get(face)) {
        lanes.prefetch(uvs);
        lanes.prefetch(material);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::shade_lanes::Plain;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_number_stands_for_one_face(
            blocks in prop::collection::vec(prop::collection::vec(0u32..40_000, 1..60), 1..40),
            step in prop::sample::select(vec![1u32, 8192, 77]),
        ) {
            let mut table = FaceTable::new(60);
            table.count = table.max_count - 150; // It forgets soon.
            let mut things = vec![NO_FACE; table.count];
            let mut numbers = Vec::new();
            let mut new = Vec::new();
            for block in blocks {
                let faces: Vec<u32> =
                    block.iter().map(|f| if f % 9 == 0 { NO_FACE } else { (f % 300) * step }).collect();
                let starts: Vec<u32> = (0..faces.len() as u32).collect();
                if table.number(Plain, None, &faces, &starts, &mut numbers, &mut new) {
                    things.truncate(1);
                }
                things.extend(new.iter().map(|new| {
                    assert_eq!(faces[new.at as usize], new.face);
                    new.face
                }));
                prop_assert!(things.len() <= table.max_count);
                for (face, number) in faces.iter().zip(&numbers) {
                    prop_assert_eq!(things[*number as usize], *face);
                }
            }
        }
    }
}
