//! The lines of OBJ and MTL files.

use std::borrow::Cow;

/// The statements of a file with the line, from 1, on which each starts: without surrounding space, a line that ends in
/// a backslash joined with the next, a mark of UTF-8 at the start skipped. Lines end in LF, CR LF or, in a file without
/// any LF, CR. Empty lines and comments stay.
pub(crate) fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (u64, Cow<'_, [u8]>)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let end = if bytes.contains(&b'\n') { b'\n' } else { b'\r' };
    let mut lines = (1..).zip(bytes.split(move |&b| b == end).map(<[u8]>::trim_ascii));
    std::iter::from_fn(move || {
        let (number, line) = lines.next()?;
        if !line.ends_with(b"\\") || line.starts_with(b"#") {
            return Some((number, Cow::Borrowed(line)));
        }
        let mut joined = line[..line.len() - 1].to_vec();
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

/// The words of a line.
pub(crate) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// `line` up to the sign that starts a comment.
pub(crate) fn without_comment(line: &[u8]) -> &[u8] {
    line.iter().position(|&b| b == b'#').map_or(line, |at| &line[..at])
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
        assert_eq!(words(b" a\t b ").collect::<Vec<_>>(), [b"a", b"b"]);
        assert_eq!(text(b"W\xe4nde"), "Wände");
        assert_eq!(without_comment(b"f 1 2 3 # x"), b"f 1 2 3 ");
    }
}
