//! Splits OBJ and MTL files into lines and words.

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
    /// The number of its first line, from 1.
    pub(crate) number: u64,
    /// The range of its bytes in the file, line ends included.
    pub(crate) place: Range<usize>,
    /// Its text without surrounding space. Borrowed if it is on one line.
    pub(crate) text: Cow<'a, [u8]>,
}

impl Line<'_> {
    /// Splits off the first word.
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

/// Returns the statements of a file whose lines end in LF or CR LF. A line that ends in a backslash is joined
/// with the next, and a UTF-8 byte order mark is skipped. Empty lines and comments stay.
pub(crate) fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    // Each line as it stands: its range, and its text.
    let physical = std::iter::from_fn(move || {
        // After the last line end comes one more line, which may be empty.
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

/// Reads a text file as UTF-8, converted if its byte order mark says so. Lines that end in CR alone end in LF
/// afterwards.
pub(crate) fn read_text(path: &Path) -> Result<Vec<u8>> {
    let mut bytes = into_utf8(read_file(path)?);
    end_lines_in_lf(&mut bytes);
    Ok(bytes)
}

/// Changes the ends of lines from CR to LF, in a file without any LF.
pub(crate) fn end_lines_in_lf(bytes: &mut [u8]) {
    if memchr(b'\n', bytes).is_none() {
        bytes
            .iter_mut()
            .filter(|byte| **byte == b'\r')
            .for_each(|byte| *byte = b'\n');
    }
}

/// Returns what follows the word that starts a line.
#[inline]
pub(crate) fn after<'a>(line: &'a [u8], word: &[u8]) -> &'a [u8] {
    line.get(word.len()..).unwrap_or_default()
}

/// Takes the next word off the front of a line. `#` starts a comment, which ends the line.
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

/// Returns the line up to a comment.
pub(crate) fn without_comment(line: &[u8]) -> &[u8] {
    line.split(|&b| b == b'#').next().unwrap_or_default()
}

/// Decodes a name as UTF-8, or else as Latin-1, so that different bytes stay different names.
pub(crate) fn text(bytes: &[u8]) -> String {
    match std::str::from_utf8(bytes) {
        Ok(utf8) => utf8.to_owned(),
        Err(_) => bytes.iter().map(|&b| char::from(b)).collect(),
    }
}

/// Parses a finite number.
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

    fn line(n: u64, s: &str) -> (u64, String) {
        (n, s.to_owned())
    }

    #[test]
    fn lines_are_counted_as_editors_do() {
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
