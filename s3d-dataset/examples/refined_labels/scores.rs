//! How near labels of images are to the true ones.

use s3d_label::refine::NO_LABEL;
use std::collections::BTreeMap;

/// The distances of the boundary F-scores, pixels.
pub(crate) const DISTANCES_PX: [u8; 3] = [1, 2, 4];

/// What is within this distance of a true border is near, pixels. The trimap of the IoU is the same.
pub(crate) const NEAR_PX: u8 = 8;

/// Things are thin where they are nowhere wider than this, pixels.
const THIN_PX: u8 = 9;

/// Colours on both sides of a plain border differ by fewer levels than this in every channel.
const PLAIN_LEVELS: i64 = 12;

/// The width of the square whose means tell whether a border is plain, pixels.
const PLAIN_PX: usize = 9;

/// Farther away than any distance that counts.
const FAR_PX: u8 = 32;

/// Counts of some pixels, and of those of them that are wrong.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Wrong {
    pub(crate) wrong: u64,
    pub(crate) all: u64,
}

impl Wrong {
    fn add(&mut self, is_wrong: bool) {
        self.wrong += u64::from(is_wrong);
        self.all += 1;
    }

    pub(crate) fn percent(self) -> f64 {
        100.0 * self.wrong as f64 / self.all.max(1) as f64
    }
}

/// Pixels of a class: where labels and truth agree, and where one of them has it.
type Classes = BTreeMap<u32, [u64; 2]>;

/// Counts over images. Pixels whose truth or whose projected label is not known do not count.
#[derive(Clone, Debug, Default)]
pub(crate) struct Scores {
    /// For each distance: found border pixels near a true border, all found, true ones near a found one, all
    /// true.
    borders: [[u64; 4]; 3],
    /// Near true borders.
    pub(crate) near: Wrong,
    /// On thin things.
    pub(crate) thin: Wrong,
    /// Near true borders between colours that hardly differ.
    pub(crate) plain: Wrong,
    pub(crate) classes: Classes,
    pub(crate) trimap: Classes,
}

impl Scores {
    /// Adds an image. `class_of` returns the class of a label; `None` for what has none.
    pub(crate) fn add(
        &mut self,
        width: usize,
        labels: &[u32],
        truth: &[u32],
        colors: &[[u8; 3]],
        class_of: &dyn Fn(u32) -> Option<u32>,
    ) {
        let found = borders(width, labels);
        let real = borders(width, truth);
        let [to_found, to_real] = [&found, &real].map(|marked| distances(width, marked));
        for (counts, limit) in self.borders.iter_mut().zip(DISTANCES_PX) {
            for i in 0..labels.len() {
                counts[0] += u64::from(found[i] && to_real[i] <= limit);
                counts[1] += u64::from(found[i]);
                counts[2] += u64::from(real[i] && to_found[i] <= limit);
                counts[3] += u64::from(real[i]);
            }
        }

        let thin = thin(width, truth, &to_real);
        let to_plain = distances(width, &plain(width, truth, colors, &real));
        for i in 0..labels.len() {
            let (Some(class), Some(true_class)) = (class_of(labels[i]), class_of(truth[i])) else { continue };
            let is_wrong = labels[i] != truth[i];
            let is_near = to_real[i] <= NEAR_PX;
            for (counts, counts_here) in [
                (&mut self.near, is_near),
                (&mut self.thin, thin[i]),
                (&mut self.plain, to_plain[i] <= NEAR_PX),
            ] {
                if counts_here {
                    counts.add(is_wrong);
                }
            }
            count_classes(&mut self.classes, class, true_class);
            if is_near {
                count_classes(&mut self.trimap, class, true_class);
            }
        }
    }

    /// Returns the boundary F-scores: the harmonic means of the shares of found and of true borders.
    pub(crate) fn f_scores(&self) -> [f64; 3] {
        self.borders.map(|counts| {
            let [right, found, seen, real] = counts.map(|count| count as f64);
            2.0 * right * seen / (right * real + seen * found)
        })
    }

    /// Returns the smallest gain of IoU of any class over the scores before, percent.
    pub(crate) fn worst_gain(&self, before: &Self) -> f64 {
        let gain = |(class, counts): (&u32, &[u64; 2])| {
            100.0 * (iou(self.classes.get(class).unwrap_or(&[0, 1])) - iou(counts))
        };
        before.classes.iter().map(gain).fold(f64::INFINITY, f64::min)
    }
}

fn count_classes(classes: &mut Classes, class: u32, true_class: u32) {
    if class == true_class {
        let [both, either] = classes.entry(class).or_default();
        (*both, *either) = (*both + 1, *either + 1);
    } else {
        classes.entry(class).or_default()[1] += 1;
        classes.entry(true_class).or_default()[1] += 1;
    }
}

fn iou([both, either]: &[u64; 2]) -> f64 {
    *both as f64 / *either as f64
}

/// Returns the mean IoU of the classes that occur.
pub(crate) fn mean_iou(classes: &Classes) -> f64 {
    classes.values().map(iou).sum::<f64>() / classes.len().max(1) as f64
}

/// Returns the pixels whose right or lower neighbour has another label. What is not known has no border.
fn borders(width: usize, labels: &[u32]) -> Vec<bool> {
    let differs = |a: u32, b: Option<&u32>| b.is_some_and(|b| a != *b && a != NO_LABEL && *b != NO_LABEL);
    let at = |i: usize| {
        let right = if (i + 1).is_multiple_of(width) {
            None
        } else {
            labels.get(i + 1)
        };
        differs(labels[i], right) || differs(labels[i], labels.get(i + width))
    };
    (0..labels.len()).map(at).collect()
}

/// Returns the chessboard distance of each pixel from the nearest marked one, at most [`FAR_PX`].
fn distances(width: usize, marked: &[bool]) -> Vec<u8> {
    let mut found: Vec<u8> = marked.iter().map(|marked| if *marked { 0 } else { FAR_PX }).collect();
    let len = found.len();
    let mut nearer = |i: usize, others: [Option<usize>; 4]| {
        let nearest = others.into_iter().flatten().filter_map(|other| found.get(other)).min();
        if let Some(nearest) = nearest {
            found[i] = found[i].min(nearest + 1);
        }
    };
    let sides = |i: usize| [!i.is_multiple_of(width), i % width + 1 < width];
    for i in 0..len {
        let [left, right] = sides(i);
        let above = i.checked_sub(width);
        let before = above.filter(|_| left).map(|above| above - 1);
        nearer(i, [i.checked_sub(1).filter(|_| left), above, before, above.filter(|_| right).map(|a| a + 1)]);
    }
    for i in (0..len).rev() {
        let [left, right] = sides(i);
        let below = Some(i + width);
        let diagonals = [below.filter(|_| left).map(|b| b - 1), below.filter(|_| right).map(|b| b + 1)];
        nearer(i, [Some(i + 1).filter(|_| right), below, diagonals[0], diagonals[1]]);
    }
    found
}

/// Returns the pixels of thin things: no pixel of their label within reach is half as far from a border as
/// [`THIN_PX`].
fn thin(width: usize, truth: &[u32], to_border: &[u8]) -> Vec<bool> {
    let half = usize::from(THIN_PX / 2);
    let height = truth.len() / width;
    let is_thin = |i: usize| {
        if usize::from(to_border[i]) > half {
            return false;
        }
        let (x, y) = (i % width, i / width);
        let columns = x.saturating_sub(half + 2)..(x + half + 3).min(width);
        let mut rows = y.saturating_sub(half + 2)..(y + half + 3).min(height);
        rows.all(|v| {
            let mut row = columns.clone().map(|u| v * width + u);
            row.all(|j| truth[j] != truth[i] || usize::from(to_border[j]) < half)
        })
    };
    (0..truth.len()).map(is_thin).collect()
}

/// Returns the border pixels whose two sides have almost the same mean colour nearby.
fn plain(width: usize, truth: &[u32], colors: &[[u8; 3]], real: &[bool]) -> Vec<bool> {
    let half = PLAIN_PX / 2;
    let height = truth.len() / width;
    let is_plain = |i: usize| {
        let (x, y) = (i % width, i / width);
        if !real[i] || x < half || y < half || x + half >= width || y + half >= height {
            return false;
        }
        let other = if truth[i + 1] == truth[i] {
            truth[i + width]
        } else {
            truth[i + 1]
        };
        let mut sums = [([0i64; 3], 0i64); 2];
        for v in y - half..=y + half {
            for j in v * width + x - half..=v * width + x + half {
                let side = [truth[i], other].iter().position(|label| *label == truth[j]);
                let Some((sum, count)) = side.map(|side| &mut sums[side]) else { continue };
                sum.iter_mut()
                    .zip(colors[j])
                    .for_each(|(sum, color)| *sum += i64::from(color));
                *count += 1;
            }
        }
        let means = sums.map(|(sum, count)| sum.map(|sum| sum / count.max(1)));
        (0..3).all(|k| means[0][k].abs_diff(means[1][k]) < PLAIN_LEVELS as u64)
    };
    (0..truth.len()).map(is_plain).collect()
}
