//! The lines of OBJ and MTL files.

pub(crate) use crate::fs::text::{number, words};
use memchr::memchr;
use std::borrow::Cow;

/// The statements of a file with the line, from 1, on which each starts: without surrounding space, a line that ends in
/// a backslash joined with the next, a mark of UTF-8 at the start skipped. Lines end in LF, CR LF or, in a file without
/// any LF, CR. Empty lines and comments stay.
pub(crate) fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (u64, Cow<'_, [u8]>)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let end = if memchr(b'\n', bytes).is_some() { b'\n' } else { b'\r' };
    let mut lines = (1..).zip(split(bytes, end).map(<[u8]>::trim_ascii));
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        let Some(continued) = line.strip_suffix(b"\\").filter(|line| !line.starts_with(b"#")) else {
            return Some((number, Cow::Borrowed(line)));
        };
        let mut joined = continued.to_vec();
        for (_, next) in lines.by_ref() {
            joined.push(b' ');
            joined.extend_from_slice(next.strip_suffix(b"\\").unwrap_or(next));
            if !next.ends_with(b"\\") {
                break;
            }
        }
        Some((number, Cow::Owned(joined.trim_ascii().to_vec())))
    })
}

/// What is between the `end`s.
fn split(bytes: &[u8], end: u8) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(bytes);
    std::iter::from_fn(move || {
        let bytes = rest?;
        let Some((line, after)) = memchr(end, bytes).and_then(|at| bytes.split_at_checked(at)) else {
            return rest.take();
        };
        rest = after.get(1..);
        Some(line)
    })
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
    let end = line.iter().position(|&b| b.is_ascii_whitespace() || b == b'#').unwrap_or(line.len());
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
    std::str::from_utf8(word).ok()?.parse().ok().filter(|v: &f32| v.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Vec<(u64, String)> {
        logical_lines(bytes).map(|(n, l)| (n, text(&l))).collect()
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
