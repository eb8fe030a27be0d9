//! The lines of OBJ and MTL files.

use crate::error::Result;
use crate::fs::encoding::into_utf8;
use crate::fs::open::read_file;
use memchr::memchr;
use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

/// A statement of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Line<'a> {
    /// The number, from 1, of the line on which it starts.
    pub(crate) number: u64,
    /// The bytes of its lines, their ends included.
    pub(crate) place: Range<usize>,
    /// What it says, without surrounding space; borrowed if it is on one line.
    pub(crate) text: Cow<'a, [u8]>,
}

impl Line<'_> {
    /// The word with which it starts, and what follows.
    #[inline]
    pub(crate) fn keyword(&self) -> (&[u8], &[u8]) {
        let end = self
            .text
            .iter()
            .position(u8::is_ascii_whitespace)
            .unwrap_or(self.text.len());
        self.text.split_at_checked(end).unwrap_or_default()
    }
}

/// The statements of a file whose lines end in LF or CR LF: a line that ends in a backslash is joined with
/// the next, a mark of UTF-8 at the start skipped. Empty lines and comments stay.
pub(crate) fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    let physical = std::iter::from_fn(move || {
        // Behind the last line end is a line too, if only an empty one.
        let rest = bytes.get(start..)?;
        let length = memchr(b'\n', rest).unwrap_or(rest.len());
        let line = rest.get(..length).unwrap_or_default();
        let place = start..bytes.len().min(start + length + 1);
        start += length + 1;
        Some((place, line.trim_ascii()))
    });
    let mut lines = (1..).zip(physical);
    std::iter::from_fn(move || {
        let (number, (mut place, line)) = lines.next()?;
        let Some(continued) = line.strip_suffix(b"\\").filter(|line| !line.starts_with(b"#")) else {
            return Some(Line { number, place, text: Cow::Borrowed(line) });
        };
        let mut joined = continued.to_vec();
        for (_, (next_place, next)) in lines.by_ref() {
            place.end = next_place.end;
            joined.push(b' ');
            joined.extend_from_slice(next.strip_suffix(b"\\").unwrap_or(next));
            if !next.ends_with(b"\\") {
                break;
            }
        }
        Some(Line { number, place, text: Cow::Owned(joined.trim_ascii().to_vec()) })
    })
}

/// The content of a text file, in UTF-8 if its mark says what it is; if its lines end in CR alone, they end
/// in LF now.
pub(crate) fn read_text(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = into_utf8(read_file(path)?);
    end_lines_in_lf(&mut bytes);
    Ok(bytes)
}

/// Lines that end in CR alone end in LF then.
pub(crate) fn end_lines_in_lf(bytes: &mut [u8]) {
    if memchr(b'\n', bytes).is_none() {
        bytes
            .iter_mut()
            .filter(|byte| **byte == b'\r')
            .for_each(|byte| *byte = b'\n');
    }
}

/// What is behind the word that starts a line.
#[inline]
pub(crate) fn after<'a>(line: &'a [u8], word: &[u8]) -> &'a [u8] {
    line.get(word.len()..).unwrap_or_default()
}

/// Takes the next word off the front of a line; the sign that starts a comment ends the line.
#[inline]
pub(crate) fn next_word<'a>(rest: &mut &'a [u8]) -> Option<&'a [u8]> {
    let start = rest.iter().position(|b| !b.is_ascii_whitespace())?;
    let line = rest.get(start..)?;
    let end = line
        .iter()
        .position(|&b| b.is_ascii_whitespace() || b == b'#')
        .unwrap_or(line.len());
    let (word, after) = line.split_at_checked(end)?;
    *rest = if after.first() == Some(&b'#') { &[] } else { after };
    (!word.is_empty()).then_some(word)
}

/// `line` up to the sign that starts a comment.
pub(crate) fn without_comment(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default()
}

/// A name in UTF-8 or, if it is not that, in Latin-1, so that different bytes stay different names.
pub(crate) fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(utf8) => utf8.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// The finite number that a word spells.
pub(crate) fn parse_f32(word: &[u8]) -> Option<f32> {
    std::str::from_utf8(word)
        .ok()?
        .parse()
        .ok()
        .filter(|v: &f32| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<(u64, String)> {
        let mut bytes = bytes.to_vec();
        end_lines_in_lf(&mut bytes);
        logical_lines(&bytes)
            .map(|line| (line.number, text(&line.text)))
            .collect()
    }

    #[test]
    fn lines_are_counted_as_editors_do() {
        let line = |n, s: &str| (n, s.to_owned());
        assert_eq!(all(b"\xef\xbb\xbfa\r\n b \n"), [line(1, "a"), line(2, "b"), line(3, "")]);
        assert_eq!(all(b"a\rb"), [line(1, "a"), line(2, "b")]);
        assert_eq!(
            all(b"f 1 \\\n2 \\\r\n3\nv\n# art \\\nv"),
            [line(1, "f 1  2  3"), line(4, "v"), line(5, "# art \\"), line(6, "v")]
        );
        assert_eq!(all(b"f \\"), [line(1, "f")]);
        assert_eq!(text(b"W\xe4nde"), "Wände");
        assert_eq!(without_comment(b"f 1 2 3 # x"), b"f 1 2 3 ");
    }

    #[test]
    fn words_end_with_the_line_or_a_comment() {
        let mut rest: &[u8] = b" v\t1 2#3 4";
        let all: Vec<&[u8]> = std::iter::from_fn(|| next_word(&mut rest)).collect();
        assert_eq!(all, [&b"v"[..], b"1", b"2"]);
        assert_eq!(next_word(&mut &b"# 1"[..]), None);
        assert_eq!(next_word(&mut &b"  "[..]), None);
    }
}
