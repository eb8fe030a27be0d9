//! The outline of a mask as lines between corners of pixels.

use std::ops::Range;

/// A corner of pixels: column and row, from 0 to the width and to the height of the image.
pub(super) type Corner = [u32; 2];

/// Whether a part of an outline is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The pixel inside of it shows the instance.
    Seen,
    /// The pixel inside of it shows something else, which is in front.
    Hidden,
    /// It is the border of the image, which cuts the instance off.
    Cut,
}

/// A part of a ring. The next part begins where it ends.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Part {
    pub(super) kind: Kind,
    pub(super) corners: Vec<Corner>,
}

/// Rings with fewer sides of pixels are left out, unless there is none with more.
const FEWEST_SIDES: usize = 12;

/// Steps to the right, down, to the left and up.
const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// The pixels to the right and to the left of each step, from the corner where it begins. The pixel to the
/// right of an outline is in the mask, the pixel to the left is not.
const INSIDE: [[i64; 2]; 4] = [[0, 0], [-1, 0], [-1, -1], [0, -1]];
const OUTSIDE: [[i64; 2]; 4] = [[0, -1], [0, 0], [-1, 0], [-1, -1]];

fn moved([x, y]: [i64; 2], [dx, dy]: [i64; 2]) -> [i64; 2] {
    [x + dx, y + dy]
}

/// A side of a pixel: the corner where it begins, and its direction, an index of [`STEPS`].
type Side = ([i64; 2], usize);

/// The mask of an instance, in a box of the image around it.
struct Mask {
    size: [i64; 2],
    /// The first column and row of the box.
    origin: [i64; 2],
    rows: usize,
    /// Column by column.
    pixels: Vec<bool>,
}

/// Cuts stretches of pixels, counted column by column, at the ends of columns: the column of each piece, and
/// its rows.
fn pieces(stretches: &[Range<u64>], height: u64) -> impl Iterator<Item = (u64, Range<u64>)> {
    stretches.iter().flat_map(move |stretch| {
        let columns = stretch.start / height..stretch.end.div_ceil(height);
        columns.map(move |column| {
            let row = |n: u64| n.saturating_sub(column * height).min(height);
            (column, row(stretch.start)..row(stretch.end))
        })
    })
}

impl Mask {
    /// Takes the numbers of the pixels, counted column by column.
    fn new([width, height]: [u32; 2], stretches: &[Range<u64>]) -> Self {
        let rows_of_image = u64::from(height.max(1));
        let pieces = || pieces(stretches, rows_of_image);
        let first = pieces().next().map_or(0, |(column, _)| column);
        let end = pieces().last().map_or(0, |(column, _)| column + 1);
        let top = pieces().map(|(_, rows)| rows.start).min().unwrap_or(0);
        let bottom = pieces().map(|(_, rows)| rows.end).max().unwrap_or(0);
        let rows = bottom.saturating_sub(top) as usize;

        let mut pixels = vec![false; end.saturating_sub(first) as usize * rows];
        for (column, of_column) in pieces() {
            let [from, to] = [of_column.start, of_column.end].map(|row| {
                let before = column.saturating_sub(first) as usize * rows;
                before + row.saturating_sub(top) as usize
            });
            pixels.get_mut(from..to).unwrap_or_default().fill(true);
        }
        Self { size: [width.into(), height.into()], origin: [first as i64, top as i64], rows, pixels }
    }

    /// Whether a pixel is in the image.
    fn is_of_image(&self, [x, y]: [i64; 2]) -> bool {
        (0..self.size[0]).contains(&x) && (0..self.size[1]).contains(&y)
    }

    /// Returns the directions in which an outline leaves each corner of the box, a bit each.
    fn sides(&self) -> Vec<u8> {
        let (nothing, rows) = (vec![false; self.rows], self.rows.max(1));
        let columns = self.pixels.chunks(rows).chain([nothing.as_slice()]);
        let height = self.rows + 1;
        let mut open = vec![0u8; (self.pixels.len() / rows + 1) * height];
        let mut leave = |x: usize, y: usize, direction: usize| {
            open.get_mut(x * height + y)
                .into_iter()
                .for_each(|bits| *bits |= 1 << direction);
        };

        let mut left = nothing.as_slice();
        for (x, column) in columns.enumerate() {
            // Above and below pixels.
            let mut above = false;
            for (y, here) in column.iter().chain([&false]).copied().enumerate() {
                match (above, here) {
                    (false, true) => leave(x, y, 0),
                    (true, false) => leave(x + 1, y, 2),
                    _ => {}
                }
                above = here;
            }
            // Between this column and the one before.
            if column != left {
                for (y, (before, here)) in left.iter().zip(column).enumerate() {
                    match (before, here) {
                        (true, false) => leave(x, y, 1),
                        (false, true) => leave(x, y + 1, 3),
                        _ => {}
                    }
                }
            }
            left = column;
        }
        open
    }

    /// Returns the rings around the mask, each in its order. Pixels that share only a corner are apart.
    fn rings(&self) -> Vec<Vec<Side>> {
        let mut open = self.sides();
        let [left, top] = self.origin;
        let height = self.rows as i64 + 1;
        let place = |[x, y]: [i64; 2]| usize::try_from((x - left) * height + y - top).unwrap_or(usize::MAX);
        let starts: Vec<[i64; 2]> = (0..)
            .zip(&open)
            .filter(|(_, bits)| **bits & 1 != 0)
            .map(|(place, _): (i64, _)| [left + place / height, top + place % height])
            .collect();

        // Each ring has a step to the right: the top of its highest pixels.
        let mut rings = Vec::new();
        for start in starts {
            if open.get(place(start)).is_none_or(|bits| bits & 1 == 0) {
                continue;
            }
            let (mut at, mut direction) = (start, 0);
            let mut ring = Vec::new();
            loop {
                ring.push((at, direction));
                at = moved(at, STEPS.get(direction).copied().unwrap_or_default());

                // The way that turns to the right most stays at the same pixel.
                let bits = open.get(place(at)).copied().unwrap_or(0);
                let turns = [1, 0, 3].map(|turn| (direction + turn) % 4);
                let Some(next) = turns.into_iter().find(|turn| bits & (1 << turn) != 0) else { break };
                if let Some(bits) = open.get_mut(place(at)) {
                    *bits &= !(1 << next);
                }
                if (at, next) == (start, 0) {
                    break;
                }
                direction = next;
            }
            rings.push(ring);
        }
        rings
    }

    /// Returns the kind of a side.
    fn kind(&self, (corner, direction): Side, is_seen: &impl Fn(u32, u32) -> bool) -> Kind {
        let pixel = |beside: [[i64; 2]; 4]| {
            let [x, y] = moved(corner, beside.get(direction).copied().unwrap_or_default());
            [x, y]
        };
        let [x, y] = pixel(INSIDE).map(|c| u32::try_from(c).unwrap_or(0));
        match self.is_of_image(pixel(OUTSIDE)) {
            false => Kind::Cut,
            true if is_seen(x, y) => Kind::Seen,
            true => Kind::Hidden,
        }
    }
}

/// Returns the rings around a mask, cut into parts of one kind. The mask is the numbers of the pixels of an
/// image of this width and height, counted column by column. `is_seen` tells whether a pixel of the mask
/// shows the instance. Lines differ from the sides of the pixels by `tolerance` pixels at most.
pub(super) fn outline(
    size: [u32; 2],
    stretches: &[Range<u64>],
    tolerance: f64,
    is_seen: impl Fn(u32, u32) -> bool,
) -> Vec<Vec<Part>> {
    let mask = Mask::new(size, stretches);
    let mut rings = mask.rings();
    let longest = rings.iter().map(Vec::len).max().unwrap_or(0);
    rings.retain(|ring| ring.len() >= FEWEST_SIDES.min(longest));

    let of_ring = |ring: &Vec<Side>| {
        let kinds: Vec<Kind> = ring.iter().map(|side| mask.kind(*side, &is_seen)).collect();
        // A ring begins where its kind changes, if it does.
        let before = kinds.iter().cycle().skip(kinds.len().saturating_sub(1));
        let start = kinds.iter().zip(before).position(|(kind, before)| kind != before);
        let start = start.unwrap_or(0);

        let mut parts: Vec<Part> = Vec::new();
        for i in 0..ring.len() {
            let at = (start + i) % ring.len();
            let (Some(&(corner, direction)), Some(&kind)) = (ring.get(at), kinds.get(at)) else { continue };
            let end = moved(corner, STEPS.get(direction).copied().unwrap_or_default());
            let [corner, end] = [corner, end].map(|c| c.map(|c| u32::try_from(c).unwrap_or(0)));
            match parts.last_mut() {
                Some(part) if part.kind == kind => part.corners.push(end),
                _ => parts.push(Part { kind, corners: vec![corner, end] }),
            }
        }
        for part in &mut parts {
            part.corners = simplified(&part.corners, tolerance);
        }
        parts
    };
    rings.iter().map(of_ring).collect()
}

/// Returns a line with fewer corners, which is at most `tolerance` away from them (Ramer, 1972; Douglas and
/// Peucker, 1973). Its ends stay.
fn simplified(line: &[Corner], tolerance: f64) -> Vec<Corner> {
    let mut stays = vec![false; line.len()];
    for end in [0, line.len().saturating_sub(1)] {
        stays.get_mut(end).into_iter().for_each(|stays| *stays = true);
    }

    let mut pieces = vec![(0, line.len().saturating_sub(1))];
    while let Some((from, to)) = pieces.pop() {
        let (Some(&a), Some(&b)) = (line.get(from), line.get(to)) else { continue };
        let between = line.get(from + 1..to).unwrap_or_default();
        let mut farthest = (tolerance, None);
        for (i, corner) in between.iter().enumerate() {
            let away = distance(*corner, a, b);
            if away > farthest.0 {
                farthest = (away, Some(from + 1 + i));
            }
        }
        if let (_, Some(corner)) = farthest {
            stays.get_mut(corner).into_iter().for_each(|stays| *stays = true);
            pieces.extend([(from, corner), (corner, to)]);
        }
    }
    let kept = line.iter().zip(stays).filter(|(_, stays)| *stays);
    kept.map(|(corner, _)| *corner).collect()
}

/// Returns the distance of a corner from the line between two others.
fn distance(corner: Corner, a: Corner, b: Corner) -> f64 {
    let [[x, y], [ax, ay], [bx, by]] = [corner, a, b].map(|c| c.map(f64::from));
    let (dx, dy) = (bx - ax, by - ay);
    let length2 = dx * dx + dy * dy;
    let along = if length2 > 0.0 {
        (((x - ax) * dx + (y - ay) * dy) / length2).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let (ex, ey) = (ax + along * dx - x, ay + along * dy - y);
    (ex * ex + ey * ey).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of the pixels of a drawing, column by column.
    fn stretches(rows: &[&str]) -> ([u32; 2], Vec<Range<u64>>) {
        let (width, height) = (rows[0].len(), rows.len());
        let is = |n: u64| rows[n as usize % height].as_bytes()[n as usize / height] == b'#';
        let pixels = (0..(width * height) as u64).filter(|n| is(*n));
        ([width as u32, height as u32], pixels.map(|n| n..n + 1).collect())
    }

    /// Twice the area within closed rings, holes less.
    fn area(rings: &[Vec<Part>]) -> i64 {
        let corners =
            |ring: &Vec<Part>| ring.iter().flat_map(|part| part.corners.clone()).collect::<Vec<_>>();
        let twice = |ring: Vec<Corner>| {
            let next = ring.iter().cycle().skip(1);
            let cross = ring.iter().zip(next).map(|(a, b)| {
                let [ax, ay, bx, by] = [a[0], a[1], b[0], b[1]].map(i64::from);
                ax * by - bx * ay
            });
            cross.sum::<i64>()
        };
        rings.iter().map(corners).map(twice).sum()
    }

    #[test]
    fn a_box_has_four_corners_and_tells_what_is_hidden_and_cut() {
        let (size, mask) = stretches(&["......", ".#####", ".#####", ".#####", "......"]);
        let rings = outline(size, &mask, 0.0, |x, _| x < 3);
        let [ring] = rings.as_slice() else { panic!("{rings:?}") };
        let told: Vec<(Kind, &[Corner])> = ring.iter().map(|part| (part.kind, &*part.corners)).collect();
        let expected: [(Kind, &[Corner]); 4] = [
            (Kind::Hidden, &[[3, 1], [6, 1]]),
            (Kind::Cut, &[[6, 1], [6, 4]]),
            (Kind::Hidden, &[[6, 4], [3, 4]]),
            (Kind::Seen, &[[3, 4], [1, 4], [1, 1], [3, 1]]),
        ];
        assert_eq!(told, expected);
    }

    #[test]
    fn rings_go_around_all_pixels_and_holes() {
        let rows = ["####....", "#..##...", "#..#.###", "####.#.#", ".....###", "##.....#", "##......"];
        let (size, mask) = stretches(&rows);
        let rings = outline(size, &mask, 0.0, |_, _| true);
        let pixels = rows.concat().matches('#').count() as i64;
        // The small holes are left out, and so is the square below.
        assert_eq!(area(&rings), 2 * (pixels + 4 + 1 - 4), "{rings:?}");
        let (size, mask) = stretches(&["######", "#....#", "#....#", "#....#", "######"]);
        assert_eq!(area(&outline(size, &mask, 0.0, |_, _| true)), 2 * 18);
        assert!(outline([4, 4], &[], 1.0, |_, _| true).is_empty());

        // Something small is shown if there is nothing larger.
        let (size, mask) = stretches(&["...", ".#.", "..#"]);
        let rings = outline(size, &mask, 0.0, |_, _| true);
        assert_eq!((rings.len(), area(&rings)), (2, 4));
    }

    #[test]
    fn stairs_become_a_line() {
        let rows: Vec<String> = (0..40).map(|y| "#".repeat(y + 1) + &".".repeat(41 - y)).collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let (size, mask) = stretches(&rows);
        let rings = outline(size, &mask, 0.75, |_, _| true);
        let corners: usize = rings.iter().flatten().map(|part| part.corners.len()).sum();
        assert!(rings.len() == 1 && corners < 12, "{rings:?}");
    }
}
