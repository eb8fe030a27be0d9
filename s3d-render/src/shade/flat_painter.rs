//! Images that have one value all over a face, painted span by span.

use crate::shade::spans::Spans;
use crate::simd::shade_lanes::{COLOR_BLOCK, LANES, ShadeLanes};
use s3d_geom::TriMesh;

/// `N` such images of a view, painted band by band.
pub(crate) struct FlatPainter<V, const N: usize> {
    /// The colours of eight faces in each of the images.
    values: V,
    /// By a face's number, its colours, R in the lowest byte; 0 is for what is missing.
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

    /// Paints a band: `out` is its part of each image. What `values` look at in `mesh`, if given, is fetched
    /// from memory.
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
            let (start, end) = (pieces[0].start as usize, pieces[1].start as usize);
            fill(lanes, &mut out, start, end, &self.colors[pieces[0].number as usize]);
        }
    }
}

#[inline(always)]
fn packed([r, g, b]: [u8; 3]) -> u32 {
    u32::from_le_bytes([r, g, b, 0])
}

/// Gives the pixels from `start` to `end` of each image a colour, and perhaps some of those that follow: no
/// more pixels than a block has.
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
            // At the image's end.
            None => {
                let mut block = [0; COLOR_BLOCK];
                lanes.store_repeated(color, &mut block);
                let most = 3 * (end - start);
                bytes[..most].copy_from_slice(&block[..most]);
            }
        }
    }
}
