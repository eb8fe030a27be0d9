//! Images that have one value all over a face, painted run by run.

use crate::lanes::{LANES, Lanes, STAMP};
use crate::runs::Runs;
use s3d_geom::TriMesh;

/// `N` such images of a view, painted band by band.
pub(crate) struct Stamps<V, const N: usize> {
    /// The colours of eight faces in each of the images.
    values: V,
    /// By a face's number, its colours, R in the lowest byte; 0 is for what is missing.
    colors: Vec<[u32; N]>,
}

impl<V: Fn(&[u32; LANES]) -> [[[u8; 3]; N]; LANES], const N: usize> Stamps<V, N> {
    pub(crate) fn new(missing: [[u8; 3]; N], values: V) -> Self {
        Self { values, colors: vec![missing.map(packed)] }
    }

    /// Forgets all faces.
    pub(crate) fn forget(&mut self) {
        self.colors.truncate(1);
    }

    /// Paints a band: `out` is its part of each image. What `values` look at in `mesh`, if given, is fetched from memory.
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
                let mut colors = [0; N];
                for (color, value) in colors.iter_mut().zip(value) {
                    *color = packed(*value);
                }
                self.colors.push(colors);
            }
        }
        for (start, end, number) in runs.all() {
            print(lanes, &mut out, start, end, &self.colors[number as usize]);
        }
    }
}

#[inline(always)]
fn packed([r, g, b]: [u8; 3]) -> u32 {
    u32::from_le_bytes([r, g, b, 0])
}

/// Gives the pixels from `start` to `end` of each image a colour, and perhaps some of those that follow.
#[inline(always)]
fn print<const N: usize>(
    lanes: impl Lanes,
    images: &mut [&mut [[u8; 3]]; N],
    start: usize,
    end: usize,
    colors: &[u32; N],
) {
    let mut at = start;
    while at < end {
        for (image, &color) in images.iter_mut().zip(colors) {
            let bytes = &mut image.as_flattened_mut()[3 * at..];
            match bytes.first_chunk_mut() {
                Some(to) => lanes.store_repeated(color, to),
                // At the image's end.
                None => {
                    let most = bytes.len().min(3 * (end - at));
                    let mut stamp = [0; STAMP];
                    lanes.store_repeated(color, &mut stamp);
                    bytes[..most].copy_from_slice(&stamp[..most]);
                }
            }
        }
        at += STAMP / 3;
    }
}
