//! The score of a view: how evenly its pixels are spread over the semantic classes.

/// Returns the Shannon entropy of a histogram of classes, in nats.
///
/// The entropy is 0 if one class has all pixels, and the logarithm of the number of classes if all have the
/// same number of pixels. Pixels without a class are not in the histogram. The entropy of an empty histogram
/// is 0. Source: `s3d_io::formats`, "Views".
///
/// ```
/// // As many pixels of wall as of floor.
/// let mut histogram = [0; 13];
/// histogram[1] = 500;
/// histogram[2] = 500;
/// assert_eq!(s3d_sample::entropy(&histogram), 2f64.ln());
/// ```
pub fn entropy(histogram: &[u64]) -> f64 {
    let total: u128 = histogram.iter().map(|&n| u128::from(n)).sum();
    let sum = histogram.iter().filter(|&&n| n > 0).fold(0.0, |sum, &n| {
        let share = n as f64 / total as f64;
        sum - share * libm::log(share)
    });
    // Rounding may leave the range. Adding 0 turns −0 into 0.
    sum.clamp(0.0, libm::log(histogram.len().max(1) as f64)) + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn known_values() {
        assert_eq!(entropy(&[0; 13]).to_bits(), 0f64.to_bits());
        let mut one = [0; 13];
        one[7] = u64::MAX;
        assert_eq!(entropy(&one).to_bits(), 0f64.to_bits());
        assert_eq!(entropy(&[u64::MAX; 13]), libm::log(13.0));
        assert_eq!((entropy(&[]), entropy(&[5]), entropy(&[3, 3])), (0.0, 0.0, libm::log(2.0)));
        let mut some = [0; 13];
        some[0] = 1;
        some[5] = 2;
        some[12] = 1;
        assert!((entropy(&some) - 1.5 * 2f64.ln()).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn within_its_bounds_and_blind_to_scale(
            histogram in prop::array::uniform13(prop_oneof![Just(0u64), 0u64..5_000_000]),
            scale in 1u64..1000,
        ) {
            let e = entropy(&histogram);
            prop_assert!((0.0..=libm::log(13.0)).contains(&e));
            prop_assert!((entropy(&histogram.map(|n| n * scale)) - e).abs() < 1e-12);
            let mut reversed = histogram;
            reversed.reverse();
            prop_assert!((entropy(&reversed) - e).abs() < 1e-12);
        }

        #[test]
        fn agrees_with_the_other_form(histogram in prop::array::uniform13(0u64..5_000_000)) {
            // ln N − Σ n ln n / N
            let total: u64 = histogram.iter().sum();
            prop_assume!(total > 0);
            let n = total as f64;
            let sum: f64 =
                histogram.iter().filter(|&&k| k > 0).map(|&k| k as f64 * libm::log(k as f64)).sum();
            prop_assert!((entropy(&histogram) - (libm::log(n) - sum / n)).abs() < 1e-12);
        }
    }
}
