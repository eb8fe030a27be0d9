//! Distances on the grid of the plan.

use super::scan::Grid;

/// Returns the distance of each cell to the nearest one for which `is_goal`, in cells; infinite without one.
///
/// The squares of distances are lower envelopes of parabolas, along rows and then along columns
/// (Felzenszwalb and Huttenlocher, "Distance transforms of sampled functions", 2012).
pub(super) fn distances(grid: &Grid, is_goal: impl Fn(usize) -> bool) -> Vec<f32> {
    let mut squares: Vec<f64> = (0..grid.cells())
        .map(|cell| if is_goal(cell) { 0.0 } else { f64::INFINITY })
        .collect();
    let longest = grid.width.max(grid.height);
    let mut line = Vec::with_capacity(longest);
    let mut envelope = Vec::with_capacity(longest);

    for y in 0..grid.height {
        let row = &mut squares[y * grid.width..(y + 1) * grid.width];
        line.clear();
        line.extend_from_slice(row);
        lower_envelope(&line, &mut envelope, |x, square| row[x] = square);
    }
    for x in 0..grid.width {
        line.clear();
        line.extend((0..grid.height).map(|y| squares[y * grid.width + x]));
        lower_envelope(&line, &mut envelope, |y, square| squares[y * grid.width + x] = square);
    }
    squares.into_iter().map(|square| square.sqrt() as f32).collect()
}

/// Calls `put` with each place of a line and the smallest of `line[k] + (place - k)²` over all k.
fn lower_envelope(line: &[f64], envelope: &mut Vec<(usize, f64)>, mut put: impl FnMut(usize, f64)) {
    // The parabolas of the envelope: where each has its vertex, and from where on it is the lowest.
    envelope.clear();
    for (k, &height) in line.iter().enumerate() {
        if height == f64::INFINITY {
            continue;
        }
        let from = loop {
            let Some(&(last, from)) = envelope.last() else { break f64::NEG_INFINITY };
            let (a, b) = (last as f64, k as f64);
            let meet = ((height + b * b) - (line[last] + a * a)) / (2.0 * (b - a));
            if meet > from {
                break meet;
            }
            envelope.pop();
        };
        envelope.push((k, from));
    }

    let mut lowest = 0;
    for place in 0..line.len() {
        while envelope.get(lowest + 1).is_some_and(|(_, from)| *from < place as f64) {
            lowest += 1;
        }
        let square = envelope.get(lowest).map_or(f64::INFINITY, |&(k, _)| {
            let apart = place as f64 - k as f64;
            line[k] + apart * apart
        });
        put(place, square);
    }
}

/// Gives the label of a labelled cell (not 0) to the unlabelled cells around it, up to `steps` cells away. Of
/// several, the nearest; then the smallest.
pub(super) fn spread(grid: &Grid, labels: &mut [u32], steps: usize) {
    let mut ring: Vec<usize> = (0..grid.cells()).filter(|cell| labels[*cell] != 0).collect();
    for _ in 0..steps {
        let mut found: Vec<(usize, u32)> = Vec::new();
        for &cell in &ring {
            found.extend(
                grid.beside(cell)
                    .filter(|next| labels[*next] == 0)
                    .map(|next| (next, labels[cell])),
            );
        }
        found.sort_unstable();
        found.dedup_by_key(|(cell, _)| *cell);
        ring.clear();
        for (cell, label) in found {
            labels[cell] = label;
            ring.push(cell);
        }
    }
}
