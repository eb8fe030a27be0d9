//! The spans of equal faces in a band of rows.
//!
//! Images are made from hits a band at a time: its hits, and what is made of them, stay in the cache from one
//! modality to the next, and its spans are found once for all that have something to do with faces.

use crate::shade::face_table::{FaceTable, NewFace};
use crate::simd::shade_lanes::{LANES, ShadeLanes};
use s3d_geom::TriMesh;

/// Pixels of a band, about.
const BAND: usize = 1 << 13;

/// New faces that are fetched from memory while as many are prepared.
const PREFETCHED: usize = 4 * LANES;

/// How many rows make a band of an image so wide.
pub(crate) fn band_rows(width: usize) -> usize {
    (BAND / width.max(1)).max(1)
}

/// The spans of a band. None reaches from row to row.
pub(crate) struct Spans {
    table: FaceTable,
    width: usize,
    /// Where spans start, ascending, from the band's first pixel on; and the band's end.
    starts: Vec<u32>,
    /// By span: its face's number in the table.
    numbers: Vec<u32>,
    /// The faces that got their number in this band.
    new: Vec<NewFace>,
    /// See [`Spans::pieces`].
    pieces: Vec<Piece>,
}

/// Part of a span, of [`LANES`] pixels or, at the span's end, fewer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    /// Its first pixel.
    pub(crate) start: u32,
    /// Its face's number.
    pub(crate) number: u32,
}

impl Spans {
    /// Of no band yet.
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

    /// Finds the spans of the next band. Whether faces have forgotten their numbers, which then begin with 1
    /// again.
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

    /// All spans in pieces, one after another, and one more that begins where the last one ends. None reaches
    /// from row to row.
    #[inline(always)]
    pub(crate) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// Cuts the spans. A loop for each piece of a span ends when nobody can foretell: here it is out of the
    /// way of those that have much to do.
    #[inline(always)]
    fn cut(&mut self) {
        const PIECE: u32 = LANES as u32;
        let Self { starts, numbers, pieces, .. } = self;
        pieces.clear();
        for (span, &number) in starts.windows(2).zip(numbers.iter()) {
            let (start, end) = (span[0], span[1]);
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

    /// How many groups of [`LANES`] faces have to be prepared.
    pub(crate) fn new_groups(&self) -> usize {
        self.new.len().div_ceil(LANES)
    }

    /// A group of new faces, filled up with its last face, and how many of it count. To be asked for one
    /// after another: what `mesh`, if any, has of those to come is fetched meanwhile, colours included if
    /// that is asked.
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

/// Adds to `starts` where each span of equal values of a row starts, `from` being the row's first pixel.
#[inline(always)]
fn add_starts(lanes: impl ShadeLanes, values: &[u32], from: usize, starts: &mut Vec<u32>) {
    if values.is_empty() {
        return;
    }
    // A group of places is written whole, and its end over by the next: no branch that depends on the values.
    let first = starts.len();
    starts.resize(first + values.len() + 4 * LANES, from as u32);
    let (mut at, mut count) = (1, first + 1);
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
                    let (start, end) = (piece.start as usize, after.start as usize);
                    prop_assert_eq!(start, next);
                    prop_assert!((1..=LANES).contains(&(end - start)) && start / width == (end - 1) / width);
                    prop_assert!(faces[start..end].iter().all(|&face| face == things[piece.number as usize]));
                    let cut = end - start < LANES && end % width != 0;
                    prop_assert!(!cut || faces[end - 1] != faces[end]);
                    next = end;
                }
                prop_assert_eq!(next, faces.len());
            }
        }
    }
}
