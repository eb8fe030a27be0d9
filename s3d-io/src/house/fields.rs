//! The fields of a line.

use crate::fs::quote::quote;

/// More fields than any record has.
const MOST: usize = 64;

/// The words of a line, separated by blanks. Errors are sentences about the line.
pub(super) struct Fields<'a>(Vec<&'a [u8]>);

impl<'a> Fields<'a> {
    pub(super) fn of(line: &'a [u8]) -> Self {
        let words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        Self(words.take(MOST).collect())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns the word at `place`, from 0. Messages call it `what`.
    pub(super) fn word(&self, place: usize, what: &str) -> Result<&'a str, String> {
        let word = self
            .0
            .get(place)
            .ok_or_else(|| format!("field {place}, the {what}, is missing"))?;
        std::str::from_utf8(word).map_err(|_| format!("{} is no text", quote(word)))
    }

    /// Returns the whole number at `place`. Messages call it `what`.
    pub(super) fn whole(&self, place: usize, what: &str) -> Result<i64, String> {
        let word = self.word(place, what)?;
        let number = word.parse().ok();
        number.ok_or_else(|| {
            format!("field {place}, the {what}, is {}, which is no whole number", quote(word.as_bytes()))
        })
    }

    /// Returns the numbers from `place` on.
    pub(super) fn numbers<const N: usize>(&self, place: usize) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        for (number, place) in numbers.iter_mut().zip(place..) {
            let word = self.word(place, "number")?;
            let parsed = word.parse().ok().filter(|number: &f64| number.is_finite());
            *number = parsed
                .ok_or_else(|| format!("field {place} is {}, which is no number", quote(word.as_bytes())))?;
        }
        Ok(numbers)
    }
}
