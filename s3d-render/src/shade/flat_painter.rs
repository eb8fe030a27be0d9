//! Paints images that have one value all over a face, span by span.

use crate::shade::spans::Spans;
use crate::simd::shade_lanes::{COLOR_BLOCK, LANES, ShadeLanes};
use s3d_geom::TriMesh;

/// Paints `N` such images of a view, band by band.
pub(crate) struct FlatPainter<V, const N: usize> {
    /// Returns the colours of eight faces in each of the images.
    values: V,
    /// The colours of each face by its number, with R in the lowest byte. Number 0 stands for missing pixels.
    colors: Vec<[u32; N]>,
}

impl<V: Fn(&[u32; LANES]) -> [[[u8; 3]; N]; LANES], const N: usize> FlatPainter<V, N> {
    pub(crate) fn new(missing: [[u8; 3]; N], values: V) -> Self {
        Self { values, colors: vec![missing.map(packed)] }
    }

    /// Forgets all faces.
    pub(crate) fn forget(&mut self) {
        self.colors.truncate(1);
    }

    /// Paints a band: `out` is its part of each image. The data that `values` reads from `mesh`, if given, is
    /// prefetched.
    #[inline(always)]
    pub(crate) fn band(
        &mut self,
        lanes: impl ShadeLanes,
        mesh: Option<&TriMesh>,
        spans: &Spans,
        mut out: [&mut [[u8; 3]]; N],
    ) {
        for k in 0..spans.new_groups() {
            let (group, count) = spans.new_group::<false>(lanes, mesh, k);
            let values = (self.values)(&group.map(|new| new.face));
            for value in &values[..count] {
                let mut colors = [0; N];
                for (color, value) in colors.iter_mut().zip(value) {
                    *color = packed(*value);
                }
                self.colors.push(colors);
            }
        }
        for pieces in spans.pieces().windows(2) {
            let start = pieces[0].start as usize;
            let end = pieces[1].start as usize;
            fill(lanes, &mut out, start, end, &self.colors[pieces[0].number as usize]);
        }
    }
}

#[inline(always)]
fn packed([r, g, b]: [u8; 3]) -> u32 {
    u32::from_le_bytes([r, g, b, 0])
}

/// Gives the pixels from `start` to `end` of each image a colour; there may be no more of them than in a
/// block. Pixels after `end` may be overwritten.
#[inline(always)]
fn fill<const N: usize>(
    lanes: impl ShadeLanes,
    images: &mut [&mut [[u8; 3]]; N],
    start: usize,
    end: usize,
    colors: &[u32; N],
) {
    for (image, &color) in images.iter_mut().zip(colors) {
        let bytes = &mut image.as_flattened_mut()[3 * start..];
        match bytes.first_chunk_mut() {
            Some(to) => lanes.store_repeated(color, to),
            // Near the end of the image.
            None => {
                let mut block = [0; COLOR_BLOCK];
                lanes.store_repeated(color, &mut block);
                let most = 3 * (end - start);
                bytes[..most].copy_from_slice(&block[..most]);
            }
        }
    }
}
