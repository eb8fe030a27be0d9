//! Gray pictures of up to 16 bits in the binary form of PGM, which 3RScan has for depth. Source: Netpbm,
//! "pgm", form P5: words of a header, one white space, then rows from the top, two bytes a pixel if the
//! largest value is above 255, the higher byte first.

use crate::error::{Error, Result};
use s3d_geom::Raster;
use std::path::Path;

/// The first bytes of a file.
const MAGIC: &[u8] = b"P5";

/// The longest header that is looked through, bytes. Comments may stand in it.
pub(super) const LONGEST_HEADER: usize = 1 << 12;

/// What the header tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) size: [u32; 2],
    /// Whether a pixel has two bytes.
    is_wide: bool,
    /// Where the pixels begin.
    start: usize,
}

/// Returns whether the first bytes of a file are those of a PGM file.
pub(super) fn is_pgm(start: &[u8]) -> bool {
    start.starts_with(MAGIC) && start.get(2).is_some_and(|b| b.is_ascii_whitespace() || *b == b'#')
}

/// Reads the header. `bytes` are the first bytes of the file.
pub(super) fn header(bytes: &[u8], path: &Path) -> Result<Header> {
    let fault = |message: String| Error::format(path, message);
    let mut at = MAGIC.len();
    let mut numbers = [0u32; 3];
    for number in &mut numbers {
        let (value, end) = number_at(bytes, at).ok_or_else(|| {
            fault("is no PGM picture: width, height and the largest value are due in its header".into())
        })?;
        *number = value;
        at = end;
    }

    let [width, height, most] = numbers;
    let are_sides = [width, height].iter().all(|side| (1..=65_535).contains(side));
    if !are_sides || !(1..=65_535).contains(&most) {
        return Err(fault(format!("claims {width} × {height} pixels with values up to {most}")));
    }
    // One white space follows the last word.
    Ok(Header { size: [width, height], is_wide: most > 255, start: at + 1 })
}

/// Reads a picture from its bytes.
pub(super) fn decode(bytes: &[u8], path: &Path) -> Result<Raster<u16>> {
    let Header { size: [width, height], is_wide, start } = header(bytes, path)?;
    let count = width as usize * height as usize;
    let stored = bytes.get(start..).unwrap_or_default();
    let due = if is_wide { 2 * count } else { count };
    let Some(stored) = stored.get(..due) else {
        let message = format!(
            "has {} bytes of pixels, and {width} × {height} need {due}: it is cut short",
            stored.len()
        );
        return Err(Error::format(path, message));
    };

    let values = if is_wide {
        stored
            .as_chunks()
            .0
            .iter()
            .map(|pair| u16::from_be_bytes(*pair))
            .collect()
    } else {
        stored.iter().copied().map(u16::from).collect()
    };
    Ok(Raster::from_vec(width, height, values))
}

/// Returns the whole number that follows the blanks and comments at a place, and where it ends.
fn number_at(bytes: &[u8], mut at: usize) -> Option<(u32, usize)> {
    loop {
        match bytes.get(at)? {
            b'#' => at += bytes.get(at..)?.iter().position(|b| *b == b'\n')?,
            b if b.is_ascii_whitespace() => at += 1,
            _ => break,
        }
    }
    let digits = bytes.get(at..)?.iter().take_while(|b| b.is_ascii_digit()).count();
    let word = std::str::from_utf8(bytes.get(at..at + digits)?).ok()?;
    Some((word.parse().ok()?, at + digits))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_widths_are_read() {
        let path = Path::new("a.pgm");
        let wide = [&b"P5 # a comment\n2 1\n65535\n"[..], &[0x01, 0x02, 0xff, 0xff]].concat();
        assert!(is_pgm(&wide));
        assert_eq!(decode(&wide, path).unwrap().pixels(), [0x0102, 0xffff]);
        let narrow = [&b"P5\n1 2\n255\n"[..], &[7, 9]].concat();
        assert_eq!(decode(&narrow, path).unwrap().pixels(), [7, 9]);
    }

    #[test]
    fn what_is_cut_or_claims_too_much_is_refused() {
        let path = Path::new("a.pgm");
        for (bytes, words) in [
            (&b"P5\n2 2\n65535\n\0\0\0"[..], "has 3 bytes of pixels, and 2 × 2 need 8"),
            (b"P5\n2 2\n65535", "has 0 bytes of pixels"),
            (b"P5\n2 x", "is no PGM picture"),
            (b"P5\n# only a comment", "is no PGM picture"),
            (b"P5\n0 2\n255\n", "claims 0 × 2 pixels"),
            (b"P5\n99999999 99999999\n255\n", "claims 99999999"),
            (b"P5\n2 2\n70000\n", "values up to 70000"),
        ] {
            let message = decode(bytes, path).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
        assert!(!is_pgm(b"P56"));
    }
}
