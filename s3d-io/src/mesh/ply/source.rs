//! Reads the bytes of a PLY file ahead, and decodes the numbers in them.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::mesh::ply::header::PlyType;
use std::io::Read;

/// The longest word of an ASCII file, in bytes.
const MAX_WORD: usize = 4096;
/// How many bytes are read at once.
pub(crate) const BUFFER: usize = 1 << 18;

pub(crate) type Outcome = std::result::Result<(), Fault>;

/// The fault of a row. The reader knows where the row is.
#[derive(Debug)]
pub(crate) enum Fault {
    Io(std::io::Error),
    /// The file ends before the row does.
    End,
    Line(u64, String),
    Row(String),
}

impl From<std::io::Error> for Fault {
    fn from(e: std::io::Error) -> Self {
        Self::Io(e)
    }
}

/// A file, with the bytes that were read ahead.
pub(crate) struct Source<'r> {
    file: Box<dyn Read + 'r>,
    buffer: Vec<u8>,
    /// The range of the buffer that is not yet taken.
    pub(crate) start: usize,
    pub(crate) end: usize,
}

impl<'r> Source<'r> {
    pub(crate) fn new(file: impl Read + 'r) -> Self {
        Self { file: Box::new(file), buffer: vec![0; BUFFER], start: 0, end: 0 }
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        self.buffer.get(self.start..self.end).unwrap_or_default()
    }

    /// Reads until there are `n` bytes. Returns `false` if the file ends before.
    pub(crate) fn need(&mut self, n: usize) -> std::io::Result<bool> {
        let there = self.bytes().len();
        if there >= n {
            return Ok(true);
        }

        self.buffer.copy_within(self.start..self.end, 0);
        self.start = 0;
        self.end = there;
        if self.buffer.len() < n {
            self.buffer.resize(n, 0);
        }

        while self.end < n {
            match self.file.read(self.buffer.get_mut(self.end..).unwrap_or_default()) {
                Ok(0) => return Ok(false),
                Ok(read) => self.end = self.end.saturating_add(read),
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        }
        Ok(true)
    }

    /// Takes the next `n` bytes.
    #[inline]
    pub(crate) fn take(&mut self, n: usize) -> std::result::Result<&[u8], Fault> {
        if self.bytes().len() < n && !self.need(n)? {
            return Err(Fault::End);
        }
        let taken = self
            .buffer
            .get(self.start..)
            .and_then(|bytes| bytes.get(..n))
            .ok_or(Fault::End)?;
        self.start = self.start.saturating_add(n);
        Ok(taken)
    }

    /// Skips the next `n` bytes, which are in the buffer.
    pub(crate) fn pass(&mut self, n: usize) {
        self.start = self.start.saturating_add(n).min(self.end);
    }

    /// Skips the next `n` bytes, in the buffer or not.
    pub(crate) fn skip(&mut self, mut n: u64) -> Outcome {
        while n > 0 {
            let step = usize::try_from(n).map_or(BUFFER, |n| n.min(BUFFER));
            self.take(step)?;
            n = n.saturating_sub(step as u64);
        }
        Ok(())
    }

    /// Takes the next word. Counts the line ends before it into `line`.
    pub(crate) fn word(&mut self, line_end: u8, line: &mut u64) -> std::result::Result<&[u8], Fault> {
        loop {
            let bytes = self.bytes();
            let space = bytes.iter().take_while(|b| b.is_ascii_whitespace());
            let mut spaces = 0usize;
            let mut ends = 0u64;

            for byte in space {
                spaces = spaces.saturating_add(1);
                ends = ends.saturating_add((*byte == line_end).into());
            }

            let found = spaces < bytes.len();
            *line = line.saturating_add(ends);
            self.pass(spaces);
            if found {
                break;
            }
            if !self.need(1)? {
                return Err(Fault::End);
            }
        }

        // A word may continue beyond the bytes that were read ahead.
        let mut length = 0usize;
        loop {
            let bytes = self.bytes();
            let unseen = bytes.get(length..).unwrap_or_default();
            if let Some(more) = unseen.iter().position(u8::is_ascii_whitespace) {
                length = length.saturating_add(more);
                break;
            }
            length = bytes.len();
            if length > MAX_WORD {
                return Err(Fault::Line(*line, format!("a word of more than {MAX_WORD} characters")));
            }
            if !self.need(length.saturating_add(1))? {
                break;
            }
        }
        self.take(length)
    }
}

/// Appends a number of each row of `stride` bytes, `offset` bytes into the row.
pub(crate) fn column_of(
    bytes: &[u8],
    stride: usize,
    offset: usize,
    kind: PlyType,
    big: bool,
    out: &mut Vec<f64>,
) {
    macro_rules! rows {
        ($type:ty) => {{
            // A row that ends before the number counts as NaN.
            let rows = bytes.chunks_exact(stride).map(|row| row.get(offset..)?.first_chunk());
            if big {
                out.extend(rows.map(|b| b.map_or(f64::NAN, |b| f64::from(<$type>::from_be_bytes(*b)))));
            } else {
                out.extend(rows.map(|b| b.map_or(f64::NAN, |b| f64::from(<$type>::from_le_bytes(*b)))));
            }
        }};
    }
    match kind {
        PlyType::I8 => rows!(i8),
        PlyType::U8 => rows!(u8),
        PlyType::I16 => rows!(i16),
        PlyType::U16 => rows!(u16),
        PlyType::I32 => rows!(i32),
        PlyType::U32 => rows!(u32),
        PlyType::F32 => rows!(f32),
        PlyType::F64 => rows!(f64),
    }
}

/// Appends the numbers that stand one after the other.
#[inline]
pub(crate) fn decode(bytes: &[u8], kind: PlyType, big: bool, out: &mut Vec<f64>) {
    column_of(bytes, kind.size(), 0, kind, big, out);
}

/// A single number.
#[inline]
pub(crate) fn number(b: &[u8], kind: PlyType, big: bool) -> f64 {
    macro_rules! one {
        ($type:ty) => {{
            let bytes = b.first_chunk().copied().unwrap_or_default();
            f64::from(if big {
                <$type>::from_be_bytes(bytes)
            } else {
                <$type>::from_le_bytes(bytes)
            })
        }};
    }
    match kind {
        PlyType::I8 => one!(i8),
        PlyType::U8 => one!(u8),
        PlyType::I16 => one!(i16),
        PlyType::U16 => one!(u16),
        PlyType::I32 => one!(i32),
        PlyType::U32 => one!(u32),
        PlyType::F32 => one!(f32),
        PlyType::F64 => one!(f64),
    }
}

/// The powers of ten that `f64` holds exactly.
const POWERS: [f64; 19] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18];

/// Parses a number, rounded once as by `str::parse`. Spellings of NaN from C are known too.
pub(crate) fn parse_f64(word: &[u8]) -> Option<f64> {
    let negative = word.first() == Some(&b'-');
    let written = word.strip_prefix(b"-").unwrap_or(word);
    if let Some(value) = plain_f64(written) {
        return Some(if negative { -value } else { value });
    }
    let text = std::str::from_utf8(word).ok()?;
    text.parse()
        .ok()
        .or_else(|| written.to_ascii_lowercase().starts_with(b"nan(").then_some(f64::NAN))
}

/// Parses a plain decimal fraction whose digits `f64` holds exactly, as nearly all are. The quotient of two
/// exact numbers is rounded once.
#[inline]
fn plain_f64(written: &[u8]) -> Option<f64> {
    if written.len() > 19 {
        return None;
    }
    let mut digits = 0u64;
    let mut point = written.len();
    for (at, &byte) in written.iter().enumerate() {
        match byte {
            // 19 digits fit into 64 bits.
            b'0'..=b'9' => digits = digits.wrapping_mul(10).wrapping_add(u64::from(byte & 15)),
            b'.' if point == written.len() => point = at,
            _ => return None,
        }
    }
    // A point alone is no number, nor is an empty word.
    if written.len() == usize::from(point < written.len()) || digits >= 1 << 53 {
        return None;
    }

    let decimals = written.len().saturating_sub(point).saturating_sub(1);
    POWERS.get(decimals).map(|power| digits as f64 / power)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn words_are_read_as_the_standard_library_does(value: f64, decimals in 0usize..20) {
            for text in [value.to_string(), format!("{:.decimals$}", value % 1e6), format!("{value:e}")] {
                let expected: Option<f64> = text.parse().ok();
                let found = parse_f64(text.as_bytes());
            prop_assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{}", text);
            }
        }

        #[test]
        fn words_of_any_kind_are_read_or_refused_as_the_standard_library_does(text in "[-+.0-9eE]{0,12}") {
            prop_assert_eq!(parse_f64(text.as_bytes()), text.parse().ok());
        }
    }
}
