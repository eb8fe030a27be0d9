//! Distances to the nearest border.

use crate::shade::channels::fit;
use s3d_geom::Raster;

/// The units of a distance to a border in a pixel's width.
pub const BORDER_UNITS: f64 = 64.0;
/// The distance to a border of a pixel that sees nothing.
pub const MISSING_DISTANCE: u16 = 65_535;
/// Stands for a column without a border.
const NONE: i64 = i64::MAX;

/// Writes the Euclidean distance of each pixel to the nearest pixel of `borders` that is not 0 into an
/// existing image, in 64ths of a pixel, rounded. The largest is 65,534 (1,024 pixels), also for an image
/// without borders. `wraps` says that the first column is a neighbour of the last.
///
/// The distances are exact. Source: Felzenszwalb and Huttenlocher, "Distance Transforms of Sampled
/// Functions", Theory of Computing 8, 2012.
pub fn border_distance_image_into(borders: &Raster<u8>, wraps: bool, out: &mut Raster<u16>) {
    fit(out, borders, 0);
    let width = borders.width() as usize;
    let height = borders.height() as usize;
    let squares = column_distances(borders);

    // A line of a panorama goes on for half a turn on either side.
    let margin = if wraps { width / 2 } else { 0 };
    let mut line = vec![NONE; width + 2 * margin];
    let mut envelope = Envelope::default();
    for (row, out) in out.pixels_mut().chunks_exact_mut(width.max(1)).enumerate().take(height) {
        let squares = &squares[row * width..(row + 1) * width];
        for (at, to) in line.iter_mut().enumerate() {
            *to = squares[(at + width - margin) % width];
        }
        envelope.build(&line);
        envelope.read(margin, out);
    }
}

/// Returns the squared distance of each pixel to the nearest border in its column.
fn column_distances(borders: &Raster<u8>) -> Vec<i64> {
    let width = borders.width() as usize;
    let mut nearest = vec![NONE; borders.len()];
    let mut since = vec![NONE; width];
    let mut pass = |row: usize| {
        for (column, since) in since.iter_mut().enumerate() {
            let at = row * width + column;
            if borders.pixels()[at] != 0 {
                *since = 0;
            } else if *since != NONE {
                *since += 1;
            }
            nearest[at] = nearest[at].min(*since);
        }
    };
    let height = borders.height() as usize;
    (0..height).for_each(&mut pass);
    // What was found downwards is too far upwards, and does no harm.
    (0..height).rev().for_each(&mut pass);
    nearest.iter().map(|d| if *d == NONE { NONE } else { d * d }).collect()
}

/// The lower envelope of the parabolas (x − v)² + f(v) of a line.
#[derive(Default)]
struct Envelope {
    /// The place and the value of each parabola of the envelope, from the left.
    parabolas: Vec<(i64, i64)>,
    /// The first place at which each is below the one before it.
    starts: Vec<i64>,
}

impl Envelope {
    fn build(&mut self, line: &[i64]) {
        self.parabolas.clear();
        self.starts.clear();
        for (at, value) in (0i64..).zip(line) {
            if *value == NONE {
                continue;
            }
            let mut start = i64::MIN;
            while let (Some(&(other, lowest)), Some(&since)) = (self.parabolas.last(), self.starts.last()) {
                // From here on, the new parabola is lower.
                start = ((at * at + value) - (other * other + lowest)).div_euclid(2 * (at - other)) + 1;
                if start > since {
                    break;
                }
                self.parabolas.pop();
                self.starts.pop();
                start = i64::MIN;
            }
            self.parabolas.push((at, *value));
            self.starts.push(start);
        }
    }

    /// Writes the distances of the places from `first` on.
    fn read(&self, first: usize, out: &mut [u16]) {
        if self.parabolas.is_empty() {
            return out.fill(MISSING_DISTANCE - 1);
        }
        let mut of = 0;
        for (x, out) in (first as i64..).zip(out) {
            while self.starts.get(of + 1).is_some_and(|start| *start <= x) {
                of += 1;
            }
            let (place, value) = self.parabolas[of];
            let distance = (((x - place) * (x - place) + value) as f64).sqrt();
            *out = (distance * BORDER_UNITS + 0.5).min(f64::from(MISSING_DISTANCE - 1)) as u16;
        }
    }
}
