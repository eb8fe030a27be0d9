//! What was found, as TOML.

use glam::{DAffine3, DVec3};
use s3d_fusion::{Aligned, Alignment, Doubt};
use std::fmt::Write;
use std::num::NonZeroUsize;

/// Where a mesh or cloud lies in the frame of another one.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct AlignReport {
    /// The places that were found, the best first. Matrices are from the frame of the first file to the frame
    /// of the second, both in metres, Z-up.
    pub aligned: Aligned,
    /// Which of the places the caller chose, from 1.
    pub nth: usize,
    /// Why there is no answer, in a sentence; `None` if there is one, or the caller chose a place.
    pub doubt: Option<String>,
}

impl AlignReport {
    pub(super) fn new(aligned: Aligned, nth: Option<NonZeroUsize>) -> Self {
        let doubt = aligned
            .doubt()
            .filter(|_| nth.is_none())
            .map(|doubt| sentence(&aligned, doubt));
        Self { aligned, nth: nth.map_or(1, NonZeroUsize::get), doubt }
    }

    /// Returns the place that was chosen.
    pub fn place(&self) -> Option<&Alignment> {
        self.nth.checked_sub(1).and_then(|at| self.aligned.places.get(at))
    }

    /// Returns the report as TOML: `transform` is written as scene files take it.
    pub fn toml(&self) -> String {
        let mut text =
            String::from("# From the frame of the first file to the frame of the second: metres, Z-up.\n");
        if let Some(place) = self.place() {
            text += &table(place);
        }
        let is_certain = self.aligned.doubt().is_none() && self.nth == 1;
        let _ = writeln!(text, "is_certain = {is_certain}");
        for open in self.place().into_iter().flat_map(|place| &place.open) {
            for (_, motion) in &open.motions {
                let _ = writeln!(
                    text,
                    "\n# Nothing fixes this motion.\n[[open]]\ntranslation = {}\nrotation = {}",
                    numbers(motion.translation),
                    numbers(motion.rotation)
                );
            }
        }
        let best = self.aligned.places.first().map_or(1.0, |best| best.evidence_m2);
        for (at, place) in self.aligned.places.iter().enumerate() {
            if at + 1 == self.nth {
                continue;
            }
            let share = place.evidence_m2 / best;
            let _ = writeln!(text, "\n[[others]]\nnth = {}\nevidence_share = {share:.3}", at + 1);
            text += &table(place);
        }
        text
    }
}

/// The keys of a place.
fn table(place: &Alignment) -> String {
    let Alignment { overlap, against, .. } = place;
    let mut text = format!("transform = {}\n", rows(&place.b_from_a));
    if place.scale != 1.0 {
        let _ = writeln!(text, "scale = {:?}", place.scale);
    }
    let _ = write!(
        text,
        "overlap = [{:.4}, {:.4}]\nagainst = [{:.4}, {:.4}]\ncontradiction = {:.4}\nmedian_m = {:.5}\n\
         rms_m = {:.5}\nevidence_m2 = {:.2}\n",
        overlap[0],
        overlap[1],
        against[0],
        against[1],
        place.contradiction,
        place.median_m,
        place.rms_m,
        place.evidence_m2
    );
    text
}

/// A 4 × 4 matrix by rows.
pub(crate) fn rows(m: &DAffine3) -> String {
    let [x, y, z] = m.matrix3.to_cols_array_2d();
    let t = m.translation.to_array();
    // Adding 0 turns −0 into 0.
    let row = |i: usize| format!("[{:?}, {:?}, {:?}, {:?}]", x[i] + 0.0, y[i] + 0.0, z[i] + 0.0, t[i] + 0.0);
    format!("[{}, {}, {}, [0.0, 0.0, 0.0, 1.0]]", row(0), row(1), row(2))
}

fn numbers(v: DVec3) -> String {
    let [x, y, z] = v.to_array().map(|v| (v * 1e4).round() / 1e4 + 0.0);
    format!("[{x:?}, {y:?}, {z:?}]")
}

fn sentence(aligned: &Aligned, doubt: Doubt) -> String {
    match doubt {
        Doubt::Rival { share } => format!(
            "there are several answers: another place has {:.0} % of the evidence of the best; look at both, \
             and choose with",
            100.0 * share
        ),
        _ => {
            let count = aligned.places.first().map_or(0, |place| place.open.len());
            let motions = if count == 1 { "a motion" } else { "several motions" };
            format!(
                "nothing fixes {motions} of the first (`open` in the answer), as along a bare corridor: give \
                 parts that have more in common, or take the place as it is with"
            )
        }
    }
}
