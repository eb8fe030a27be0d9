//! The boundary scores of DAVIS, for the classes of an image.

/// How far a boundary may be from its place, as a share of the image's diagonal.
const TOLERANCE: f64 = 0.008;

/// Returns F, precision and recall of the boundaries of each class that truth or prediction has, each from 0
/// to 1, by class. `None` is no class; where the truth is `None`, the prediction must be, too.
///
/// A pixel is on the boundary of a class if it has the class and one of its neighbours at the right, below,
/// and below at the right has not, or the other way round. A predicted one is right if the truth has one at
/// most ⌈0.008 · diagonal⌉ pixels away, and a true one is found in the same way. If only one side has
/// boundaries, F is 0; if neither has, it is 1.
///
/// Source: DAVIS 2017, `davis2017/metrics.py`, `f_measure`, for the mask of each class.
///
/// # Panics
/// If the slices have not `width · height` pixels.
pub fn class_outlines(
    truth: &[Option<u8>],
    prediction: &[Option<u8>],
    [width, height]: [u32; 2],
) -> Vec<(u8, [f64; 3])> {
    let [width, height] = [width, height].map(|side| side as usize);
    assert!([truth.len(), prediction.len()] == [width * height; 2], "a class a pixel");
    let diagonal = ((width * width + height * height) as f64).sqrt();
    let disk = Disk::new([width, height], (TOLERANCE * diagonal).ceil() as usize);

    let sides = [truth, prediction].map(|classes| Outlines::of(classes, width));
    let mut near = vec![false; width * height];
    let mut scores = Vec::new();
    for class in 0..=u8::MAX {
        let at = usize::from(class);
        if !sides.iter().any(|side| side.is_there[at]) {
            continue;
        }
        let [truth, predicted] = [&sides[0].pixels[at], &sides[1].pixels[at]];
        let mut share = |part: &[u32], of: &[u32]| {
            disk.dilate(of, &mut near);
            part.iter().filter(|at| near[**at as usize]).count() as f64 / part.len() as f64
        };
        let [precision, recall] = match [truth.is_empty(), predicted.is_empty()] {
            [true, true] => [1.0, 1.0],
            [true, false] => [0.0, 1.0],
            [false, true] => [1.0, 0.0],
            [false, false] => [share(predicted, truth), share(truth, predicted)],
        };
        let sum = precision + recall;
        let f = if sum > 0.0 { 2.0 * precision * recall / sum } else { 0.0 };
        scores.push((class, [f, precision, recall]));
    }
    scores
}

/// The boundaries of an image, by class.
struct Outlines {
    pixels: Vec<Vec<u32>>,
    /// Whether a pixel has the class.
    is_there: [bool; 256],
}

impl Outlines {
    fn of(classes: &[Option<u8>], width: usize) -> Self {
        let mut found = Self { pixels: vec![Vec::new(); 256], is_there: [false; 256] };
        for (at, class) in classes.iter().enumerate() {
            if let Some(class) = class {
                found.is_there[usize::from(*class)] = true;
            }
            let right = (at % width + 1 < width).then_some(1);
            let below = (at + width < classes.len()).then_some(width);
            let diagonal = right.zip(below).map(|(right, below)| right + below);
            let others = [right, below, diagonal].map(|step| step.map_or(*class, |step| classes[at + step]));
            for (before, other) in others.iter().enumerate().filter(|(_, other)| *other != class) {
                found.add(*class, at);
                if !others[..before].contains(other) {
                    found.add(*other, at);
                }
            }
        }
        found
    }

    /// Puts a pixel on the boundary of a class, once.
    fn add(&mut self, class: Option<u8>, at: usize) {
        let Some(class) = class else { return };
        let pixels = &mut self.pixels[usize::from(class)];
        if pixels.last() != Some(&(at as u32)) {
            pixels.push(at as u32);
        }
    }
}

/// The pixels of an image within a distance.
struct Disk {
    size: [usize; 2],
    radius: usize,
    /// How far it reaches to either side, in the row of its middle and in those below.
    reaches: Vec<usize>,
}

impl Disk {
    fn new(size: [usize; 2], radius: usize) -> Self {
        let reaches = (0..=radius).map(|row| (radius * radius - row * row).isqrt()).collect();
        Self { size, radius, reaches }
    }

    /// Sets the pixels that are near one of `pixels`, and clears the others.
    fn dilate(&self, pixels: &[u32], near: &mut [bool]) {
        near.fill(false);
        let [width, height] = self.size;
        for at in pixels {
            let [x, y] = [*at as usize % width, *at as usize / width];
            for row in y.saturating_sub(self.radius)..(y + self.radius + 1).min(height) {
                let reach = self.reaches[row.abs_diff(y)];
                let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
                near[row * width + columns.start..row * width + columns.end].fill(true);
            }
        }
    }
}
