//! Whether the numbers of depth pictures are in the unit that they are taken for.

use crate::error::{Error, Result};
use crate::raw::depth::DepthPicture;
use s3d_geom::Raster;

/// A median depth above this is no building's, metres; nor is one below.
const FARTHEST_M: f64 = 100.0;
const NEAREST_M: f64 = 0.02;

/// The depth that is likely in a room, metres.
const LIKELY_M: f64 = 2.0;

/// The pictures that are looked at, evenly spaced, and the most of them if they are empty.
const LOOKED_AT: usize = 3;
const MOST_EMPTY: usize = 16;

/// The pixels of a picture that are looked at.
const PIXELS: usize = 40_000;

/// Reads a few of the pictures, and refuses depths that cannot be metres of a building.
///
/// # Errors
/// [`Error::Format`] with the scale that would fit, and if no pixel has a depth; the errors of
/// [`DepthPicture::read_depth`].
pub(super) fn check(pictures: &[DepthPicture]) -> Result<()> {
    let step = pictures.len().div_ceil(MOST_EMPTY).max(1);
    let mut with_depth = 0;
    let mut empty = 0;
    // The middle one first: recordings begin and end in odd places.
    let middle = pictures.len() / 2;
    let order = pictures.iter().skip(middle).chain(pictures.iter().take(middle));

    for picture in order.step_by(step) {
        match median(&picture.read_depth()?) {
            None => empty += 1,
            Some(median_m) => {
                check_median(picture, median_m)?;
                with_depth += 1;
            }
        }
        if with_depth == LOOKED_AT {
            return Ok(());
        }
    }

    if with_depth > 0 {
        return Ok(());
    }
    let path = pictures
        .first()
        .map_or(std::path::Path::new(""), |picture| picture.path());
    let message = format!(
        "nothing is measured in it, nor in the other {} depth pictures that were looked at: all pixels are 0",
        empty - 1
    );
    Err(Error::format(path, message))
}

fn check_median(picture: &DepthPicture, median_m: f64) -> Result<()> {
    if (NEAREST_M..=FARTHEST_M).contains(&median_m) {
        return Ok(());
    }

    let unit_m = picture.unit_m();
    let power = libm::round(libm::log10(LIKELY_M / median_m));
    let fits = unit_m * libm::pow(10.0, power);
    let message = format!(
        "half of its depths are beyond {median_m:.4} m, if a step of its numbers is {unit_m} m: no room is \
         so {}. With a unit of {} m, they are beyond {:.2} m",
        if median_m > FARTHEST_M { "large" } else { "small" },
        short(fits),
        median_m * fits / unit_m
    );
    Err(Error::format(picture.path(), message))
}

/// Writes a number with three digits.
fn short(number: f64) -> String {
    let digits = (2.0 - libm::floor(libm::log10(number))).clamp(0.0, 12.0) as usize;
    let text = format!("{number:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

/// Returns the median of the depths, metres. `None`: nothing is measured.
fn median(depth: &Raster<f32>) -> Option<f64> {
    let step = depth.len().div_ceil(PIXELS).max(1);
    let seen = depth.pixels().iter().step_by(step).copied().filter(|v| v.is_finite());
    let mut seen: Vec<f32> = seen.collect();
    if seen.is_empty() {
        // A few returns among many pixels still tell the unit.
        seen.extend(depth.pixels().iter().copied().filter(|v| v.is_finite()));
    }
    let middle = seen.len() / 2;
    if seen.is_empty() {
        return None;
    }
    let (_, median, _) = seen.select_nth_unstable_by(middle, f32::total_cmp);
    Some(f64::from(*median))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn medians_are_of_what_is_measured() {
        let depth = Raster::from_vec(5, 1, vec![f32::NAN, 3.0, 1.0, 2.0, f32::NAN]);
        assert_eq!(median(&depth), Some(2.0));
        assert_eq!(median(&Raster::filled(4, 4, f32::NAN)), None);
        // The only return lies between the pixels that are looked at.
        let mut sparse = Raster::filled(400, 400, f32::NAN);
        sparse.pixels_mut()[1] = 1.5;
        assert_eq!(median(&sparse), Some(1.5));
    }

    #[test]
    fn units_are_written_short() {
        for (number, text) in
            [(0.001, "0.001"), (0.00025, "0.00025"), (1.0, "1"), (2e-4, "0.0002"), (250.0, "250")]
        {
            assert_eq!(short(number), text);
        }
    }
}
