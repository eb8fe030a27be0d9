//! Images that have one value all over a face, painted run by run.

use crate::lanes::{LANES, Lanes};
use crate::runs::Runs;
use s3d_geom::TriMesh;

/// `N` such images of a view, painted band by band.
pub(crate) struct Stamps<V, const N: usize> {
    /// The colours of eight faces in each of the images.
    values: V,
    /// By a face's number; 0 is for what is missing.
    stamps: Vec<[Stamp; N]>,
}

/// A colour again and again, ten times and more.
type Stamp = [u8; 32];

impl<V: Fn(&[u32; LANES]) -> [[[u8; 3]; N]; LANES], const N: usize> Stamps<V, N> {
    pub(crate) fn new(missing: [[u8; 3]; N], values: V) -> Self {
        Self { values, stamps: vec![missing.map(stamp)] }
    }

    /// Forgets all faces.
    pub(crate) fn forget(&mut self) {
        self.stamps.truncate(1);
    }

    /// Paints a band: `out` is its part of each image. `values` look at `mesh`, if at any.
    #[inline(always)]
    pub(crate) fn band(
        &mut self,
        lanes: impl Lanes,
        mesh: Option<&TriMesh>,
        runs: &Runs,
        mut out: [&mut [[u8; 3]]; N],
    ) {
        for k in 0..runs.new_groups() {
            let (group, count) = runs.new_group::<false>(lanes, mesh, k);
            let values = (self.values)(&group.map(|new| new.face));
            for value in &values[..count] {
                let mut of = [[0; 32]; N];
                for (stamp, color) in of.iter_mut().zip(value) {
                    *stamp = self::stamp(*color);
                }
                self.stamps.push(of);
            }
        }
        for (start, end, number) in runs.all() {
            print(&mut out, start, end, &self.stamps[number as usize]);
        }
    }
}

#[inline(always)]
fn stamp([r, g, b]: [u8; 3]) -> Stamp {
    let mut stamp = [r; 32];
    for k in 0..32 / 3 {
        (stamp[3 * k + 1], stamp[3 * k + 2]) = (g, b);
    }
    stamp[31] = g;
    stamp
}

/// Gives the pixels from `start` to `end` of each image a colour, and perhaps some of those that follow.
#[inline(always)]
fn print<const N: usize>(images: &mut [&mut [[u8; 3]]; N], start: usize, end: usize, stamps: &[Stamp; N]) {
    let mut at = start;
    while at < end {
        for (image, stamp) in images.iter_mut().zip(stamps) {
            let bytes = &mut image.as_flattened_mut()[3 * at..];
            match bytes.first_chunk_mut() {
                Some(to) => *to = *stamp,
                // At the image's end.
                None => {
                    let most = bytes.len().min(3 * (end - at));
                    bytes[..most].copy_from_slice(&stamp[..most]);
                }
            }
        }
        at += size_of::<Stamp>() / 3;
    }
}
