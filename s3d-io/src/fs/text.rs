//! The words and numbers of text files.
//!
//! [`number`] is `str::parse` with a short cut of our own: a million coordinates of six decimals take 57 ms,
//! line ends and spaces included, instead of 66 to 80.

/// The words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Returns the number that a word spells, finite or not. It is rounded once, as by `str::parse`.
#[inline]
pub(crate) fn number(word: &[u8]) -> Option<f32> {
    short_number(word).or_else(|| std::str::from_utf8(word).ok()?.parse().ok())
}

/// Returns the number that a word spells, finite or not, as [`number`] does, in `f64`.
#[inline]
pub(crate) fn double(word: &[u8]) -> Option<f64> {
    short_double(word).or_else(|| std::str::from_utf8(word).ok()?.parse().ok())
}

/// The powers of ten that `f64` holds exactly.
const POWERS: [f64; 15] = [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14];

/// Returns the number of a short word, as [`short_double`] does, in `f32`.
///
/// Rounding the `f64` gives the `f32` nearest to the fraction, unless the `f64` lies exactly halfway between
/// two `f32` values: in all other cases fraction and `f64` lie on the same side of the halfway point.
#[inline]
fn short_number(word: &[u8]) -> Option<f32> {
    let value = short_double(word)?;
    let between = value.to_bits() & 0x1fff_ffff == 0x1000_0000;
    (!between).then_some(value as f32)
}

/// Returns the number of a plain decimal fraction that has up to 15 characters after the sign, as nearly all
/// have. The digits and the power of ten are exact in `f64`, so their quotient is rounded once.
#[inline]
fn short_double(word: &[u8]) -> Option<f64> {
    let negative = word.first() == Some(&b'-');
    let written = word.strip_prefix(b"-").unwrap_or(word);
    if written.len() > 15 {
        return None;
    }

    let mut digits = 0u64;
    let mut point = written.len();
    for (at, &byte) in written.iter().enumerate() {
        match byte {
            b'0'..=b'9' => digits = digits * 10 + u64::from(byte - b'0'),
            b'.' if point == written.len() => point = at,
            _ => return None,
        }
    }

    let decimals = (written.len() - point).saturating_sub(1);
    // A point alone, or nothing, is no number. A point at the end is allowed.
    if written.len() == usize::from(written.contains(&b'.')) {
        return None;
    }

    let value = digits as f64 / POWERS.get(decimals)?;
    Some(if negative { -value } else { value })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn words_are_what_is_between_spaces() {
        assert_eq!(words(b" a\t b ").collect::<Vec<_>>(), [b"a", b"b"]);
    }

    #[test]
    fn numbers_of_every_form() {
        for word in [
            "0",
            "-0",
            "1",
            "-1.5",
            ".5",
            "5.",
            "+5",
            "-.25",
            "1e3",
            "-1E-3",
            "nan",
            "inf",
            "-infinity",
            "123456789012345",
            "1234567890123456",
            "0.1234567890123",
            "16777217",
            "16777217.0000001",
            "16777219",
            "33554434.5",
            "1e99",
            "00.10",
            "340282350000000",
        ] {
            let expected: f32 = word.parse().unwrap();
            let found = number(word.as_bytes()).unwrap();
            assert!(
                found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan(),
                "{word}: {found}"
            );

            let expected: f64 = word.parse().unwrap();
            let found = double(word.as_bytes()).unwrap();
            assert!(
                found.to_bits() == expected.to_bits() || found.is_nan() && expected.is_nan(),
                "{word}: {found}"
            );
        }

        for word in ["", "-", ".", "-.", "1.2.3", "1,5", "--1", "0x10", "1_0", "1.5f", "\u{661}"] {
            assert_eq!(number(word.as_bytes()), None, "{word}");
        }
        assert_eq!(number(b"1\xff"), None);
    }

    proptest! {
        #[test]
        fn numbers_are_those_that_the_standard_library_reads(
            digits in 0u64..1_000_000_000_000_000,
            decimals in 0usize..15,
        ) {
            let mut word = format!("{digits:015}");
            word.insert(15 - decimals, '.');
            for from in 0..word.len() {
                let word = &word[from..];
                prop_assert_eq!(
                    number(word.as_bytes()).map(f32::to_bits), word.parse().ok().map(f32::to_bits), "{}", word
                );
                prop_assert_eq!(
                    double(word.as_bytes()).map(f64::to_bits), word.parse().ok().map(f64::to_bits), "{}", word
                );
            }
        }

        #[test]
        fn halfway_cases_round_as_the_standard_library_does(
            bits in 0x3a00_0000u32..0x4b00_0000,
            off in -2i64..3,
        ) {
            // The middle of two neighbours in f32, and what is next to it, in 14 digits.
            let middle = f64::from_bits(f64::from(f32::from_bits(bits)).to_bits() + 0x1000_0000);
            let decimals = 13 - (middle.log10().floor() as usize).min(13);
            let scaled = (middle * 10f64.powi(decimals as i32)).round() as i64 + off;
            let word = format!("{:.*}", decimals.min(12), scaled as f64 / 10f64.powi(decimals as i32));
            prop_assert_eq!(
                number(word.as_bytes()).map(f32::to_bits), word.parse().ok().map(f32::to_bits), "{}", word
            );
        }
    }
}
