//! Splits a band of rows into spans of equal faces.
//!
//! Images are made from hits one band at a time. The hits of a band, and everything made from them, stay in
//! the cache from one modality to the next. The spans are found once for all modalities that depend on faces.

use crate::shade::face_table::{FaceTable, NewFace};
use crate::simd::shade_lanes::{LANES, ShadeLanes};
use s3d_geom::TriMesh;

/// The approximate number of pixels in a band.
const BAND: usize = 1 << 13;

/// The number of new faces that are prefetched while as many are prepared.
const PREFETCHED: usize = 4 * LANES;

/// Returns the number of rows in a band of an image of this width.
pub(crate) fn band_rows(width: usize) -> usize {
    (BAND / width.max(1)).max(1)
}

/// The spans of a band. No span reaches from one row to the next.
pub(crate) struct Spans {
    table: FaceTable,
    width: usize,
    /// The starts of the spans, ascending, relative to the band's first pixel. The end of the band follows.
    starts: Vec<u32>,
    /// The number of each span's face in the table.
    numbers: Vec<u32>,
    /// The faces that got their numbers in this band.
    new: Vec<NewFace>,
    /// See [`Spans::pieces`].
    pieces: Vec<Piece>,
}

/// A part of a span: [`LANES`] pixels or, at the end of the span, fewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// The first pixel.
    pub(crate) start: u32,
    /// The number of the face.
    pub(crate) number: u32,
}

impl Spans {
    /// Returns spans that belong to no band yet.
    pub(crate) fn new(width: usize) -> Self {
        Self {
            table: FaceTable::new(band_rows(width) * width),
            width,
            starts: Vec::new(),
            numbers: Vec::new(),
            new: Vec::new(),
            pieces: Vec::new(),
        }
    }

    /// Finds the spans of the next band. Returns whether the table has forgotten all earlier numbers: new
    /// ones begin with 1 again.
    #[inline(always)]
    pub(crate) fn find(&mut self, lanes: impl ShadeLanes, mesh: Option<&TriMesh>, faces: &[u32]) -> bool {
        self.starts.clear();
        for (row, faces) in faces.chunks(self.width.max(1)).enumerate() {
            add_starts(lanes, faces, row * self.width, &mut self.starts);
        }
        let forgotten = self
            .table
            .number(lanes, mesh, faces, &self.starts, &mut self.numbers, &mut self.new);
        self.starts.push(faces.len() as u32);
        self.cut();
        forgotten
    }

    /// Returns the pieces of all spans in order, followed by an entry that begins at the end of the band. No
    /// piece reaches from one row to the next.
    #[inline(always)]
    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Cuts the spans into pieces. The length of a loop over the pieces of one span is unpredictable: doing
    /// it here keeps the mispredictions out of the loops that do the work.
    #[inline(always)]
    fn cut(&mut self) {
        const PIECE: u32 = LANES as u32;
        let Self { starts, numbers, pieces, .. } = self;
        pieces.clear();

        for (span, &number) in starts.windows(2).zip(numbers.iter()) {
            let start = span[0];
            let end = span[1];
            let at = pieces.len();
            pieces.extend([start, start + PIECE].map(|start| Piece { start, number }));
            if end - start > 2 * PIECE {
                pieces.extend(
                    (start + 2 * PIECE..end)
                        .step_by(PIECE as usize)
                        .map(|start| Piece { start, number }),
                );
            } else {
                pieces.truncate(at + 1 + usize::from(end - start > PIECE));
            }
        }

        let end = starts.last().copied().unwrap_or(0);
        pieces.push(Piece { start: end, number: 0 });
    }

    /// Returns the number of groups of [`LANES`] faces to be prepared.
    pub(crate) fn new_groups(&self) -> usize {
        self.new.len().div_ceil(LANES)
    }

    /// Returns group `k` of the new faces, filled up with its last face, and the number of faces that count.
    /// Groups must be requested in order: the data of later faces in `mesh`, if given, is prefetched
    /// meanwhile, with colours if `COLORS`.
    #[inline(always)]
    pub(crate) fn new_group<const COLORS: bool>(
        &self,
        lanes: impl ShadeLanes,
        mesh: Option<&TriMesh>,
        k: usize,
    ) -> ([NewFace; LANES], usize) {
        let first = k * LANES;
        let new = &self.new[..];

        if let Some(mesh) = mesh
            && first.is_multiple_of(PREFETCHED)
        {
            let from = if first == 0 {
                0
            } else {
                (first + PREFETCHED).min(new.len())
            };
            NewFace::prefetch::<COLORS>(&new[from..(first + 2 * PREFETCHED).min(new.len())], lanes, mesh);
        }

        let count = (new.len() - first).min(LANES);
        (std::array::from_fn(|n| new[first + n.min(count - 1)]), count)
    }
}

/// Adds the start of each span of equal values in a row to `starts`. `from` is the row's first pixel.
#[inline(always)]
fn add_starts(lanes: impl ShadeLanes, values: &[u32], from: usize, starts: &mut Vec<u32>) {
    if values.is_empty() {
        return;
    }

    // A group of places is written whole, and the next group overwrites its end: no branch depends on the
    // values.
    let first = starts.len();
    starts.resize(first + values.len() + 4 * LANES, from as u32);

    let mut at = 1;
    let mut count = first + 1;
    while let Some(window) = values.get(at - 1..).and_then(<[u32]>::first_chunk::<{ 4 * LANES + 1 }>)
        && let Some(to) = starts
            .get_mut(count..)
            .and_then(<[u32]>::first_chunk_mut::<{ 4 * LANES }>)
    {
        let mut some = 0;
        for first in [0, 2 * LANES] {
            if let Some(part) = window[first..].first_chunk()
                && let Some(to) = to[some.min(first)..].first_chunk_mut()
            {
                some += lanes.changes(part, (from + at + first) as u32, to);
            }
        }
        count += some;
        at += 4 * LANES;
    }

    starts.truncate(count);
    starts.extend(
        (at..values.len())
            .filter(|&k| values[k] != values[k - 1])
            .map(|k| (from + k) as u32),
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::shade_lanes::Plain;
    use proptest::prelude::*;
    use s3d_synth::scenes::scan_like;

    proptest! {
        #[test]
        fn spans_cover_a_band_row_by_row(
            width in 1usize..90,
            bands in prop::collection::vec(prop::collection::vec((0u32..50, 1usize..40), 1..60), 1..4),
        ) {
            let mesh = scan_like(3_000, 1);
            let mut spans = Spans::new(width);
            let mut things = vec![crate::hits::NO_FACE];

            for band in bands {
                let pixels = band.iter().flat_map(|&(face, n)| std::iter::repeat_n(face, n));
                let mut faces: Vec<u32> = pixels.collect();
                faces.resize(faces.len().next_multiple_of(width), 7);

                if spans.find(Plain, Some(&mesh), &faces) {
                    things.truncate(1);
                }

                for k in 0..spans.new_groups() {
                    let (group, count) = spans.new_group::<true>(Plain, Some(&mesh), k);
                    for new in &group[..count] {
                        prop_assert_eq!(faces[new.at as usize], new.face);
                        things.push(new.face);
                    }
                }

                let mut next = 0;
                for (piece, after) in spans.pieces().iter().zip(&spans.pieces()[1..]) {
                    let start = piece.start as usize;
                    let end = after.start as usize;
                    prop_assert_eq!(start, next);
                    prop_assert!((1..=LANES).contains(&(end - start)) && start / width == (end - 1) / width);
                    prop_assert!(faces[start..end].iter().all(|&face| face == things[piece.number as usize]));
                    let cut = end - start < LANES && !end.is_multiple_of(width);
                    prop_assert!(!cut || faces[end - 1] != faces[end]);
                    next = end;
                }
                prop_assert_eq!(next, faces.len());
            }
        }
    }
}
