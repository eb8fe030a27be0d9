//! Labels of an image that end where the picture has an edge.
//!
//! Labels that are projected from a mesh end where its triangles end: in teeth where the mesh is coarse, and
//! beside an edge where texture and surface do not fit. The paper says of its own images that such
//! misalignment "can be easily addressed by fusing image content with the projected annotations using
//! graphical models". [`refine`] is one.
//!
//! # The model
//!
//! A conditional random field over the pixels near borders between labels. Three terms speak for a label:
//!
//! 1. **The projection.** The label of the mesh has an advantage. It is small at a border and grows with the
//!    distance from it, until nothing outweighs it. How wide it is small depends on the faces at the border:
//!    one and a half times their size in pixels, 3 to 24. Other pixels are firm.
//! 2. **The look.** Each label near a pixel has a model of its own there: its pixels in a window, weighed by
//!    their distance. The term is the logarithm of the mean similarity of these pixels to the pixel: in
//!    colour above all, and a little in depth and normal. A mean does not count pixels, so a thin leg is not
//!    outvoted by the floor around it. Where both sides look alike, both terms are equal. A small share of
//!    the logarithm of the count is added, which straightens such borders.
//! 3. **The neighbours.** The eight neighbours of a pixel speak for their own labels, by their similarity.
//!
//! The best labels are found as in mean field: all pixels are updated at the same time from what the last
//! round left, four times. A pixel is kept as its best label and how sure it is, which is what its vote
//! weighs in the models of its neighbours. A pixel that keeps its label with a wide lead is not asked again.
//! Most pixels that are not next to a border are such: of each square of two by two of them, one is asked
//! first, and the others only if it is not sure.
//!
//! # Sources
//!
//! Y. Boykov and M.-P. Jolly, "Interactive graph cuts", 2001 (looks and contrast in one energy); Y. Boykov,
//! O. Veksler and R. Zabih, "Fast approximate energy minimization via graph cuts", 2001; C. Rother, V.
//! Kolmogorov and A. Blake, "GrabCut", 2004 (looks and labels in turns); P. Krähenbühl and V. Koltun,
//! "Efficient inference in fully connected CRFs with Gaussian edge potentials", 2011 (kernels over colour and
//! place, mean field); J. Besag, "On the statistical analysis of dirty pictures", 1986. Models with one mean
//! a label instead of a sum are what differs from the dense field: with sums, thin things were lost.
//!
//! # Determinism
//!
//! All that decides is integers, from tables that are made with `libm`. The result is the same on every
//! machine and for any number of threads. [`refine`] runs on the calling thread.

mod band;
mod field;
mod kernel;
mod padded;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod tests;

use padded::Padded;

/// The label of a pixel that sees nothing.
pub const NO_LABEL: u32 = u32::MAX;

/// An image with projected labels: row by row, from the top left, all columns equally long.
#[derive(Clone, Copy, Debug)]
pub struct RefineInput<'a> {
    /// Pixels in a row.
    pub width: usize,
    /// Whether the first column is a neighbour of the last, as in a panorama.
    pub wraps: bool,
    /// Indices of labels. [`NO_LABEL`] where nothing is seen, and 0 for what has no label: both stay.
    pub labels: &'a [u32],
    /// sRGB. (0, 0, 0) is no picture, as outside of a photograph: the pixel keeps its label and has no vote.
    pub colors: &'a [[u8; 3]],
    /// Depths or distances, metres. They do not count where nothing is seen.
    pub depth_m: &'a [f32],
    /// Unit normals times 127, in axes that are the same for all pixels.
    pub normals: &'a [[i8; 3]],
    /// The size of the face that a pixel sees: the root of the pixels that it covers.
    pub face_px: &'a [u8],
}

/// The labels of an image after [`refine`].
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Refined {
    /// The label of each pixel: its own, or one that a pixel nearby had.
    pub labels: Vec<u32>,
    /// Whether a pixel has another label than before.
    pub is_moved: Vec<bool>,
}

/// Moves the borders between labels to the edges of the picture.
///
/// ```
/// use s3d_label::refine::{RefineInput, refine};
///
/// // A red and a blue half meet between the columns 11 and 12. The labels say column 9.
/// let (width, height) = (24, 24);
/// let columns = || (0..width * height).map(|pixel| pixel % width);
/// let color = |x| if x < 12 { [200, 40, 40] } else { [40, 40, 200] };
/// let colors: Vec<[u8; 3]> = columns().map(color).collect();
/// let labels: Vec<u32> = columns().map(|x| if x < 10 { 1 } else { 2 }).collect();
/// let refined = refine(&RefineInput {
///     width,
///     wraps: false,
///     labels: &labels,
///     colors: &colors,
///     depth_m: &vec![2.0; width * height],
///     normals: &vec![[0, 0, 127]; width * height],
///     face_px: &vec![6; width * height],
/// });
/// assert!(columns().zip(&refined.labels).all(|(x, label)| *label == if x < 12 { 1 } else { 2 }));
/// assert_eq!(refined.is_moved.iter().filter(|is_moved| **is_moved).count(), 2 * height);
/// ```
///
/// # Panics
/// If the columns are not equally long, or not whole rows.
pub fn refine(input: &RefineInput<'_>) -> Refined {
    let pixels = input.labels.len();
    assert!(
        [input.colors.len(), input.depth_m.len(), input.normals.len(), input.face_px.len()] == [pixels; 4],
        "all columns have an entry for each pixel"
    );
    assert!(pixels == 0 || input.width > 0 && pixels.is_multiple_of(input.width), "rows are whole");

    let image = Padded::new(input);
    let band = band::find(&image);
    let found = field::labels(&image, &band);

    // What was left out keeps its label.
    let mut labels = image.inner(&found);
    for (label, old) in labels.iter_mut().zip(input.labels) {
        *label = if *label == NO_LABEL { *old } else { *label };
    }
    let is_moved = labels.iter().zip(input.labels).map(|(new, old)| new != old).collect();
    Refined { labels, is_moved }
}
