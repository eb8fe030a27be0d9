//! Marc Lehmann's LZF, in which PCL compresses points. Source: `lzf_d.c` of liblzf 3.6.
//!
//! A control byte below 32 says how many bytes follow as they are. Any other begins a reference to bytes that
//! came before, at most 8,192 bytes back; so no more than these need to be kept.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use std::io::{BufRead, Error, ErrorKind, Read, Result};

/// The farthest that a reference reaches back.
const WINDOW: usize = 1 << 13;

/// Unpacks a stream.
pub(super) struct Lzf<B> {
    file: B,
    /// The last bytes, in a ring. `next` is the place of the next one.
    window: Box<[u8; WINDOW]>,
    next: usize,
    /// The number of bytes so far, up to the size of the window.
    behind: usize,
    run: Run,
}

/// What is unpacked at the moment, and how many bytes of it are left.
#[derive(Clone, Copy)]
enum Run {
    Literal(usize),
    Reference { from: usize, left: usize },
}

impl<B: BufRead> Lzf<B> {
    pub(super) fn new(file: B) -> Self {
        Self { file, window: Box::new([0; WINDOW]), next: 0, behind: 0, run: Run::Literal(0) }
    }

    /// The next byte of the file. Returns `None` at its end.
    fn byte(&mut self) -> Result<Option<u8>> {
        let byte = loop {
            match self.file.fill_buf() {
                Ok(buffer) => break buffer.first().copied(),
                Err(e) if e.kind() == ErrorKind::Interrupted => {}
                Err(e) => return Err(e),
            }
        };
        self.file.consume(usize::from(byte.is_some()));
        Ok(byte)
    }

    fn due(&mut self) -> Result<u8> {
        self.byte()?.ok_or_else(|| damaged("ends within a run"))
    }

    /// Begins the next run. Returns `false` at the end of the file.
    fn begin(&mut self) -> Result<bool> {
        let Some(control) = self.byte()?.map(usize::from) else { return Ok(false) };
        if control < 32 {
            self.run = Run::Literal(control.saturating_add(1));
            return Ok(true);
        }

        let mut length = control >> 5;
        if length == 7 {
            length = length.saturating_add(usize::from(self.due()?));
        }
        let back = ((control & 31) << 8 | usize::from(self.due()?)).saturating_add(1);
        if back > self.behind {
            return Err(damaged("refers to bytes before the first"));
        }
        let from = self.next.wrapping_sub(back) % WINDOW;
        self.run = Run::Reference { from, left: length.saturating_add(2) };
        Ok(true)
    }
}

fn damaged(why: &str) -> Error {
    Error::new(ErrorKind::InvalidData, format!("the compressed data {why}"))
}

impl<B: BufRead> Read for Lzf<B> {
    fn read(&mut self, out: &mut [u8]) -> Result<usize> {
        let mut n = 0usize;
        for place in out {
            let byte = loop {
                match &mut self.run {
                    Run::Literal(0) | Run::Reference { left: 0, .. } => {
                        if !self.begin()? {
                            return Ok(n);
                        }
                    }
                    Run::Literal(left) => {
                        *left = left.saturating_sub(1);
                        break self.due()?;
                    }
                    Run::Reference { from, left } => {
                        let byte = self.window.get(*from).copied().unwrap_or_default();
                        *from = from.wrapping_add(1) % WINDOW;
                        *left = left.saturating_sub(1);
                        break byte;
                    }
                }
            };
            self.window.get_mut(self.next).into_iter().for_each(|kept| *kept = byte);
            self.next = self.next.wrapping_add(1) % WINDOW;
            self.behind = self.behind.saturating_add(1).min(WINDOW);
            *place = byte;
            n = n.saturating_add(1);
        }
        Ok(n)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Packs bytes as they are, or as references to the byte or the bytes before where these repeat.
    fn packed(bytes: &[u8], references: bool) -> Vec<u8> {
        let mut out = Vec::new();
        let mut at = 0;
        while at < bytes.len() {
            let best = (1..=at.min(WINDOW)).map(|back| {
                let same = bytes[at..].iter().zip(&bytes[at - back..]).take(264);
                (same.take_while(|(a, b)| a == b).count(), back)
            });
            match best
                .max_by_key(|(length, _)| *length)
                .filter(|(length, _)| references && *length > 2)
            {
                Some((length, back)) => {
                    let far = (back - 1) as u16;
                    let high = (far >> 8) as u8;
                    match length - 2 {
                        short @ ..7 => out.push((short as u8) << 5 | high),
                        long => out.extend([7 << 5 | high, (long - 7) as u8]),
                    }
                    out.push(far as u8);
                    at += length;
                }
                None => {
                    out.extend([0, bytes[at]]);
                    at += 1;
                }
            }
        }
        out
    }

    fn unpacked(bytes: &[u8]) -> Result<Vec<u8>> {
        let mut out = Vec::new();
        Lzf::new(bytes).read_to_end(&mut out)?;
        Ok(out)
    }

    proptest! {
        #[test]
        fn what_is_packed_is_unpacked(
            bytes in prop::collection::vec(0u8..3, 0..2000),
            references in any::<bool>(),
        ) {
            prop_assert_eq!(unpacked(&packed(&bytes, references)).unwrap(), bytes);
        }

        #[test]
        fn any_bytes_end(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            let _ = unpacked(&bytes);
        }
    }

    #[test]
    fn references_reach_over_the_whole_window() {
        let mut bytes: Vec<u8> = (0..WINDOW as u32).map(|i| (i * i / 7) as u8).collect();
        bytes.extend_from_within(..600);
        let mut packed: Vec<u8> = bytes[..WINDOW].iter().flat_map(|b| [0, *b]).collect();
        packed.extend([0xff, 255, 0xff, 0xff, 255, 0xff, 0xff, 63, 0xff]);
        assert_eq!(unpacked(&packed).unwrap(), bytes);
    }

    #[test]
    fn damaged_data_is_an_error() {
        for bytes in [&[0x20, 0][..], &[0, 1, 0x20, 5], &[4, 1, 2], &[0, 1, 0xe0]] {
            assert_eq!(unpacked(bytes).unwrap_err().kind(), ErrorKind::InvalidData, "{bytes:?}");
        }
    }
}
