//! Text files in UTF-8 and UTF-16, told apart by their byte order marks.
//!
//! Spreadsheets save tables in UTF-16, and the Windows shell writes UTF-16 when a command's output is sent to
//! a file. The readers of this crate know UTF-8 only, so text is converted for them. Bytes without a mark
//! stay as they are.

use crate::error::Error;
use std::borrow::Cow;
use std::io::{ErrorKind, Read, Result};
use std::path::Path;

/// The size of a block that is decoded at once, bytes.
const BLOCK: usize = 1 << 16;

/// The byte order marks.
const UTF8: &[u8] = b"\xef\xbb\xbf";
const UTF16_LE: &[u8] = b"\xff\xfe";
const UTF16_BE: &[u8] = b"\xfe\xff";

/// Turns two bytes into a code unit of UTF-16.
type Unit = fn([u8; 2]) -> u16;

/// Returns how the code units of a text are read, and the length of its byte order mark. `None` means that
/// the bytes stay as they are.
fn encoding_of(start: &[u8]) -> (Option<Unit>, usize) {
    if start.starts_with(UTF8) {
        (None, UTF8.len())
    } else if start.starts_with(UTF16_LE) {
        (Some(u16::from_le_bytes), UTF16_LE.len())
    } else if start.starts_with(UTF16_BE) {
        (Some(u16::from_be_bytes), UTF16_BE.len())
    } else {
        (None, 0)
    }
}

/// Returns the bytes of a text file in UTF-8, without a byte order mark. Invalid UTF-16 becomes U+FFFD, which
/// no number and no name has.
pub(crate) fn utf8(bytes: &[u8]) -> Cow<'_, [u8]> {
    let (unit, mark) = encoding_of(bytes);
    let rest = bytes.get(mark..).unwrap_or_default();
    let Some(unit) = unit else { return Cow::Borrowed(rest) };

    let mut text = String::with_capacity(rest.len() / 2);
    let (pairs, odd) = rest.as_chunks::<2>();
    let chars = char::decode_utf16(pairs.iter().map(|pair| unit(*pair)));
    text.extend(chars.map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)));
    if !odd.is_empty() {
        text.push(char::REPLACEMENT_CHARACTER);
    }
    Cow::Owned(text.into_bytes())
}

/// Converts like [`utf8`]. Errors name the file `path`.
///
/// # Errors
/// [`Error::Format`] if there are zero bytes near the start: then it is not text.
pub(crate) fn text_of<'a>(bytes: &'a [u8], path: &Path) -> crate::error::Result<Cow<'a, [u8]>> {
    let text = utf8(bytes);
    if text.iter().take(4096).any(|b| *b == 0) {
        let message = "is no text: it holds zero bytes. If it is text in UTF-16, save it with a byte order \
                       mark, or in UTF-8";
        return Err(Error::format(path, message));
    }
    Ok(text)
}

/// Converts like [`utf8`]. Takes the bytes, so that UTF-8 is not copied.
pub(crate) fn into_utf8(mut bytes: Vec<u8>) -> Vec<u8> {
    match encoding_of(&bytes) {
        (None, 0) => bytes,
        (None, mark) => {
            bytes.drain(..mark);
            bytes
        }
        (Some(_), _) => utf8(&bytes).into_owned(),
    }
}

/// Reads a text file block by block, converted as by [`utf8`].
#[derive(Debug)]
pub(crate) struct Utf8Reader<R> {
    file: R,
    /// `None` until the first bytes are read.
    encoding: Option<Option<Unit>>,
    /// The decoded bytes. `ready[next..]` are not yet handed on.
    ready: Vec<u8>,
    next: usize,
    /// The start of a UTF-16 character whose rest is not yet read.
    waiting: Vec<u8>,
}

impl<R: Read> Utf8Reader<R> {
    pub(crate) fn new(file: R) -> Self {
        Self { file, encoding: None, ready: Vec::new(), next: 0, waiting: Vec::new() }
    }

    /// Finds the encoding from the first bytes.
    fn begin(&mut self) -> Result<()> {
        let mut start = Vec::new();
        self.file.by_ref().take(UTF8.len() as u64).read_to_end(&mut start)?;
        let (unit, mark) = encoding_of(&start);
        start.drain(..mark);
        self.encoding = Some(unit);
        if unit.is_some() {
            self.waiting = start;
        } else {
            self.ready = start;
        }
        Ok(())
    }

    /// Decodes the next bytes of a file in UTF-16. Leaves `ready` empty only at the end of the file.
    fn decode(&mut self, unit: Unit) -> Result<()> {
        self.next = 0;
        self.ready.clear();

        while self.ready.is_empty() {
            let before = self.waiting.len();
            self.waiting.resize(before + BLOCK, 0);
            let read = loop {
                match self.file.read(self.waiting.get_mut(before..).unwrap_or_default()) {
                    Err(e) if e.kind() == ErrorKind::Interrupted => {}
                    other => break other,
                }
            };
            self.waiting.truncate(before + *read.as_ref().unwrap_or(&0));
            let at_end = read? == 0;

            // A character of two code units may be cut: its first half waits for the second. So does half a
            // code unit.
            let mut whole = self.waiting.len() & !1;
            let last = whole
                .checked_sub(2)
                .and_then(|at| self.waiting.get(at..)?.first_chunk());
            if !at_end && last.is_some_and(|pair| (0xd800..0xdc00).contains(&unit(*pair))) {
                whole -= 2;
            }

            let (pairs, _) = self.waiting.get(..whole).unwrap_or_default().as_chunks::<2>();
            for c in char::decode_utf16(pairs.iter().map(|pair| unit(*pair))) {
                let c = c.unwrap_or(char::REPLACEMENT_CHARACTER);
                self.ready.extend_from_slice(c.encode_utf8(&mut [0; 4]).as_bytes());
            }

            self.waiting.drain(..whole);
            if at_end {
                if !self.waiting.is_empty() {
                    self.waiting.clear();
                    self.ready.extend_from_slice("\u{fffd}".as_bytes());
                }
                break;
            }
        }
        Ok(())
    }
}

impl<R: Read> Read for Utf8Reader<R> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        if self.encoding.is_none() {
            self.begin()?;
        }
        if self.next >= self.ready.len() {
            match self.encoding.flatten() {
                None => return self.file.read(out),
                Some(unit) => self.decode(unit)?,
            }
        }
        let mut ready = self.ready.get(self.next..).unwrap_or_default();
        let n = ready.read(out)?;
        self.next += n;
        Ok(n)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Returns `text` as the files of all four encodings hold it.
    pub(crate) fn encoded(text: &str) -> [Vec<u8>; 4] {
        let utf16 = |unit: fn(u16) -> [u8; 2]| -> Vec<u8> {
            [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(unit).collect()
        };
        let marked = [UTF8, text.as_bytes()].concat();
        [text.into(), marked, utf16(u16::to_le_bytes), utf16(u16::to_be_bytes)]
    }

    /// Hands on only a few bytes at a time.
    struct Slowly<'a>(&'a [u8], usize);

    impl Read for Slowly<'_> {
        fn read(&mut self, out: &mut [u8]) -> Result<usize> {
            let n = out.len().min(self.1);
            self.0.read(&mut out[..n])
        }
    }

    fn read_all(bytes: &[u8], at_once: usize) -> Vec<u8> {
        let mut all = Vec::new();
        Utf8Reader::new(Slowly(bytes, at_once)).read_to_end(&mut all).unwrap();
        all
    }

    proptest! {
        #[test]
        fn every_encoding_is_one_text(text in "[a-z0-9 \
                                               \n\u{e4}\u{20ac}\u{1f600}]{0,40}", at_once in 1usize..9) {
            for bytes in encoded(&text) {
                prop_assert_eq!(utf8(&bytes), text.as_bytes());
                prop_assert_eq!(into_utf8(bytes.clone()), text.as_bytes());
                prop_assert_eq!(read_all(&bytes, at_once), text.as_bytes());
            }
        }

        #[test]
        fn any_bytes_are_read_alike(bytes: Vec<u8>, mark in 0usize..3, at_once in 1usize..9) {
            let bytes = [[UTF8, UTF16_LE, UTF16_BE][mark], &bytes].concat();
            prop_assert_eq!(read_all(&bytes, at_once), utf8(&bytes).into_owned());
        }
    }

    #[test]
    fn what_is_longer_than_a_block_is_whole() {
        let text = "0.25 -7 \u{1f600}\n".repeat(20_000);
        for bytes in encoded(&text) {
            assert!(read_all(&bytes, usize::MAX) == text.as_bytes());
        }
    }

    #[test]
    fn what_is_no_text_is_told() {
        assert_eq!(*text_of(b"\xfe\xff\0a", Path::new("a.csv")).unwrap(), *b"a");
        for bytes in [&b"a\0b\0"[..], b"\xff\xfea\0\0\0"] {
            let message = text_of(bytes, Path::new("a.csv")).unwrap_err().to_string();
            assert!(message.contains("a.csv: is no text") && message.contains("UTF-16"), "{message}");
        }
    }

    #[test]
    fn half_a_character_is_none() {
        assert_eq!(*utf8(b"\xff\xfe1\0\x3d\xd8"), *"1\u{fffd}".as_bytes());
        assert_eq!(*utf8(b"\xff\xfe1\0\x32"), *"1\u{fffd}".as_bytes());
    }
}
