//! Numbers for the faces that an image shows, row after row, so that what is prepared for a face is found
//! again.
//!
//! A row's (or a block's) spans of pixels get their numbers first, and the faces that are new are listed:
//! these can be prepared many at a time, which takes a fraction of what it takes one by one.

use crate::hits::NO_FACE;
use crate::simd::shade_lanes::ShadeLanes;
use s3d_geom::TriMesh;

/// Numbers faces 1, 2, 3… as they come, [`NO_FACE`] is 0, and forgets all but that now and then: its memory
/// is bounded. The pixels of a face lie together, in one row after another.
pub(crate) struct FaceTable {
    /// By place, which a face's index gives: the face and its number.
    places: Vec<(u32, u32)>,
    count: usize,
    max_count: usize,
}

/// A face that is new.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NewFace {
    pub(crate) face: u32,
    /// The first pixel that sees it.
    pub(crate) at: u32,
}

impl FaceTable {
    /// Far more than the faces across a panorama, a power of two.
    const PLACES: usize = 8192;

    /// For blocks of no more than `longest` pixels.
    pub(crate) fn new(longest: usize) -> Self {
        Self { places: vec![(NO_FACE, 0); Self::PLACES], count: 1, max_count: Self::PLACES + longest }
    }

    /// Looks up the faces of a block's spans, which begin at `starts`: in `numbers` their numbers, in `new`
    /// those that had none and get the next ones. Whether all earlier numbers are forgotten. What `mesh`, if
    /// any, has of new faces themselves is fetched from memory.
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
        // Loops and no closures: those would not be compiled for the lanes' instructions.
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
    /// Fetches what of a mesh is read to prepare these faces, besides what [`FaceTable::number`] has fetched:
    /// all at once, it comes many times as fast.
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

/// Fetches what leads to a face's corners.
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
            table.count = table.max_count - 150; // Forgets soon.
            let (mut things, mut numbers, mut new) = (vec![NO_FACE; table.count], Vec::new(), Vec::new());
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
