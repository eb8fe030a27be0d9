//! Reads the points of the S3DIS tree: `x y z r g b` a line.
//!
//! Own code: the csv crate splits at one separator, but these files have runs of any blanks
//! (`forms_of_a_line`). The csv crate also holds a line of any length
//! (`an_endless_line_is_refused_without_holding_it`).

use crate::cloud::annotations::{PointBlocks, Skipped};
use crate::cloud::on_fault::OnFault;
use crate::error::{Error, Result};
use crate::fs::encoding::Utf8Reader;
use crate::fs::open::open_file;
use crate::fs::quote::quote;
use crate::fs::text::{number, words};
use memchr::{memchr, memrchr};
use rayon::prelude::*;
use s3d_geom::PointCloud;
use s3d_geom::glam::{DVec3, Vec3, vec3};
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// The bytes that are read at a time.
const BLOCK: usize = 1 << 20;
/// The longest line that may hold a point.
const LONGEST_LINE: usize = 1 << 16;
/// The shortest line of a point: `0 0 0 0 0 0` and its end.
const SHORTEST_LINE: usize = 12;
/// The bytes that one thread parses at a time.
const PIECE: usize = 1 << 16;

/// Reads the points of a file piece by piece, so that files of any size need little memory.
///
/// A line is `x y z r g b`, separated by any ASCII white space: metres in the Z-up world, as the nearest
/// `f32`, and a colour of whole numbers from 0 to 255, which may be written `41.000000`. Empty lines do not
/// count. The published Area_5/office_19 has a control character within a number: a line that is no point is
/// read without its control characters, and counted ([`PointReader::mended`]).
///
/// ```
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("chair_1.txt");
/// # std::fs::write(&path, "1 2 3 4 5 6\n7 8 9 10.000 11 12\n")?;
/// let mut reader = s3d_io::cloud::PointReader::open(&path)?;
/// let mut piece = s3d_geom::PointCloud::default();
/// let mut points = 0;
/// while reader.read_chunk(1_000_000, &mut piece)? > 0 {
///     points += piece.len();
///     piece.clear();
/// }
/// assert_eq!(points, 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct PointReader<R = File> {
    path: PathBuf,
    file: Utf8Reader<R>,
    on_fault: OnFault,
    offset_m: DVec3,
    /// Bytes that were read; `block[start..end]` is not parsed yet.
    block: Vec<u8>,
    start: usize,
    end: usize,
    at_end: bool,
    line: u64,
    skipped: u64,
    first_skipped: Option<Error>,
    mended: u64,
    /// The line that was mended first.
    first_mended: Option<u64>,
}

impl PointReader {
    /// Opens a file of points. An invalid line will be an error.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_with(path, OnFault::Stop)
    }

    /// Opens a file of points, with a choice of what to do about invalid lines.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a folder or a device.
    pub fn open_with(path: &Path, on_fault: OnFault) -> Result<Self> {
        Ok(Self::new(open_file(path)?, path, on_fault))
    }
}

impl<R: Read> PointReader<R> {
    /// Reads the points of `reader`, with a choice of what to do about invalid lines. Errors call the file
    /// `name`.
    pub fn new(reader: R, name: &Path, on_fault: OnFault) -> Self {
        Self {
            path: name.to_owned(),
            file: Utf8Reader::new(reader),
            on_fault,
            offset_m: DVec3::ZERO,
            block: vec![0; BLOCK],
            start: 0,
            end: 0,
            at_end: false,
            line: 0,
            skipped: 0,
            first_skipped: None,
            mended: 0,
            first_mended: None,
        }
    }

    /// Subtracts `offset_m` from the points in `f64`, before their coordinates are rounded.
    #[must_use]
    pub fn with_offset(mut self, offset_m: DVec3) -> Self {
        self.offset_m = offset_m;
        self
    }

    /// The number of lines left out so far; 0 unless opened with [`OnFault::Skip`].
    pub fn skipped(&self) -> u64 {
        self.skipped
    }

    /// The fault of the first line that was left out, with the line's number.
    pub fn first_skipped(&self) -> Option<&Error> {
        self.first_skipped.as_ref()
    }

    /// The number of lines so far that are points only without their control characters.
    pub fn mended(&self) -> u64 {
        self.mended
    }

    /// What was left out and mended so far. The fault of the first line left out is moved out.
    pub(crate) fn take_skipped(&mut self) -> Skipped {
        let line = |line| format!("{}, line {line}", self.path.display());
        Skipped {
            count: self.skipped,
            first: self.first_skipped.take(),
            mended: self.mended,
            first_mended: self.first_mended.map(line),
        }
    }

    /// Appends the next points to `out`, up to `max_points` of them, and returns their number: 0 at the end
    /// of the file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] with the number and the text of a line that is no point, or has a
    /// coordinate that is not finite or a colour beyond 0 to 255. `out` holds the points before that line.
    ///
    /// # Panics
    /// If `max_points` is 0, or `out` has points without colours or with faces.
    pub fn read_chunk(&mut self, max_points: usize, out: &mut PointCloud) -> Result<usize> {
        assert!(max_points > 0, "a chunk of no points");
        assert!(out.colors.len() == out.len() && out.faces.is_empty(), "a cloud of other columns");

        let mut n = self.read_pieces(max_points, out);
        while n < max_points {
            let unread = self.block.get(self.start..self.end).unwrap_or_default();
            let end = memchr(b'\n', unread);
            let (line, used) = match end.and_then(|length| unread.split_at_checked(length)) {
                Some((line, _)) => (line, line.len() + 1),
                None if !self.at_end && unread.len() <= LONGEST_LINE => {
                    self.refill()?;
                    n += self.read_pieces(max_points - n, out);
                    continue;
                }
                None if unread.is_empty() => break,
                None => (unread, unread.len()),
            };

            self.line += 1;
            let parsed = parse_point(line, self.offset_m).or_else(|why| {
                let mended = without_controls(line).and_then(|line| parse_point(&line, self.offset_m).ok());
                self.mended += u64::from(mended.is_some());
                self.first_mended = self.first_mended.or(mended.map(|_| self.line));
                mended.ok_or(why)
            });
            match parsed {
                Ok(Some((position, color))) => {
                    out.positions.push(position);
                    out.colors.push(color);
                    n += 1;
                }
                Ok(None) => {}
                Err(why) => {
                    let error =
                        Error::line(&self.path, self.line, format!("{why}: {}", quote(line.trim_ascii())));
                    if self.on_fault == OnFault::Stop {
                        return Err(error);
                    }
                    self.skipped += 1;
                    self.first_skipped.get_or_insert(error);
                }
            }
            self.start += used;
        }
        Ok(n)
    }

    /// Appends the points of all whole lines in the block, on all threads, and returns their number. Does
    /// nothing if a line is invalid, or if there may be more than `max_points` points.
    fn read_pieces(&mut self, max_points: usize, out: &mut PointCloud) -> usize {
        let unread = self.block.get(self.start..self.end).unwrap_or_default();
        let Some((lines, _)) = memrchr(b'\n', unread).and_then(|last| unread.split_at_checked(last + 1))
        else {
            return 0;
        };
        if lines.len() / SHORTEST_LINE >= max_points {
            return 0;
        }

        let pieces: Vec<&[u8]> = pieces(lines).collect();
        let offset_m = self.offset_m;
        let read = pieces.par_iter().map(|piece| points_of(piece, offset_m));
        let read: Option<Vec<(PointCloud, u64)>> = read.collect();
        let Some(read) = read else { return 0 };

        self.start += lines.len();
        let before = out.len();
        for (points, lines) in read {
            out.positions.extend_from_slice(&points.positions);
            out.colors.extend_from_slice(&points.colors);
            self.line += lines;
        }
        out.len() - before
    }

    /// Moves the bytes that are not parsed yet to the front, and fills the rest of the block.
    fn refill(&mut self) -> Result<()> {
        self.block.copy_within(self.start..self.end, 0);
        self.end -= self.start;
        self.start = 0;
        loop {
            match self.file.read(self.block.get_mut(self.end..).unwrap_or_default()) {
                Ok(0) => self.at_end = true,
                Ok(n) => self.end += n,
                Err(e) if e.kind() == ErrorKind::Interrupted => continue,
                Err(e) => return Err(Error::io(&self.path, "read", e)),
            }
            return Ok(());
        }
    }
}

impl PointBlocks for PointReader {
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool> {
        Ok(self.read_chunk(points, out)? == points)
    }

    fn skipped(&mut self) -> Skipped {
        self.take_skipped()
    }
}

/// Appends all points of a file to `out`; see [`PointReader`] for its format.
///
/// # Errors
/// The errors of [`PointReader::open`] and [`PointReader::read_chunk`].
///
/// # Panics
/// If `out` has points without colours or with faces.
pub fn read_points(path: &Path, out: &mut PointCloud) -> Result<()> {
    let mut reader = PointReader::open(path)?;
    while reader.read_chunk(usize::MAX, out)? > 0 {}
    Ok(())
}

/// Cuts whole lines into pieces of whole lines.
fn pieces(mut lines: &[u8]) -> impl Iterator<Item = &[u8]> {
    std::iter::from_fn(move || {
        let end = lines
            .get(PIECE..)
            .and_then(|rest| memchr(b'\n', rest))
            .map_or(lines.len(), |at| PIECE + at + 1);
        let (piece, rest) = lines.split_at_checked(end)?;
        lines = rest;
        (!piece.is_empty()).then_some(piece)
    })
}

/// Parses whole lines. Returns their points and the number of lines, or `None` if a line is invalid.
fn points_of(mut lines: &[u8], offset_m: DVec3) -> Option<(PointCloud, u64)> {
    let mut points = PointCloud::default();
    let mut n = 0;
    while let Some((line, rest)) = memchr(b'\n', lines).and_then(|end| lines.split_at_checked(end)) {
        lines = rest.get(1..)?;
        n += 1;
        if let Some((position, color)) = parse_point(line, offset_m).ok()? {
            points.positions.push(position);
            points.colors.push(color);
        }
    }
    Some((points, n))
}

/// Returns a line without the control characters that do not separate words, if it has any.
fn without_controls(line: &[u8]) -> Option<Vec<u8>> {
    let is_control = |b: &u8| b.is_ascii_control() && !matches!(b, b'\t' | b'\n' | b'\r');
    let kept: Vec<u8> = line.iter().copied().filter(|b| !is_control(b)).collect();
    (kept.len() < line.len()).then_some(kept)
}

/// Parses a line, and subtracts an offset from its point. Returns `None` for an empty line.
fn parse_point(line: &[u8], offset_m: DVec3) -> std::result::Result<Option<(Vec3, [u8; 3])>, String> {
    let mut words = words(line);
    let mut fields: [&[u8]; 6] = [b""; 6];
    let mut n = 0;
    for (field, word) in fields.iter_mut().zip(words.by_ref()) {
        *field = word;
        n += 1;
    }
    if n == 0 {
        return Ok(None);
    }
    if n < 6 || words.next().is_some() {
        let n = n + usize::from(n == 6);
        let than = if n > 6 { "more than " } else { "" };
        return Err(format!("not a point `x y z r g b`: {than}{} fields", n.min(6)));
    }

    let [x, y, z, r, g, b] = fields;
    let position = vec3(
        parse_coordinate(x, offset_m.x)?,
        parse_coordinate(y, offset_m.y)?,
        parse_coordinate(z, offset_m.z)?,
    );
    Ok(Some((position, [parse_color(r)?, parse_color(g)?, parse_color(b)?])))
}

fn parse_coordinate(word: &[u8], offset_m: f64) -> std::result::Result<f32, String> {
    let value = if offset_m == 0.0 {
        number(word)
    } else {
        less(word, offset_m)
    };
    match value {
        Some(v) if v.is_finite() => Ok(v),
        Some(_) => Err(format!("the coordinate {} is not finite", quote(word))),
        None => Err(format!("the coordinate {} is no number", quote(word))),
    }
}

fn parse_color(word: &[u8]) -> std::result::Result<u8, String> {
    parse_byte(word).ok_or_else(|| format!("the colour {} is not from 0 to 255", quote(word)))
}

/// Parses a number, and subtracts an offset from it.
fn less(word: &[u8], offset_m: f64) -> Option<f32> {
    let value: f64 = std::str::from_utf8(word).ok()?.parse().ok()?;
    Some((value - offset_m) as f32)
}

/// Parses a whole number from 0 to 255, or rounds a float within that range.
fn parse_byte(word: &[u8]) -> Option<u8> {
    if word.len() <= 3 && word.iter().all(u8::is_ascii_digit) {
        return u8::try_from(word.iter().fold(0u16, |n, d| n * 10 + u16::from(d - b'0'))).ok();
    }
    let value: f32 = std::str::from_utf8(word).ok()?.parse().ok()?;
    (0.0..=255.0).contains(&value).then(|| value.round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::fs;

    fn read(text: &[u8]) -> Result<PointCloud> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("wall_1.txt");
        fs::write(&path, text).unwrap();
        let mut cloud = PointCloud::default();
        read_points(&path, &mut cloud)?;
        Ok(cloud)
    }

    #[test]
    fn forms_of_a_line() {
        let cloud =
            read(b"\xef\xbb\xbf1 2 3 4 5 6\r\n\n \t\n -1.5e0\t+2 .25  41.000000 0.4 255 \n7 8 9 10 11 12")
                .unwrap();
        assert_eq!(cloud.positions, [vec3(1.0, 2.0, 3.0), vec3(-1.5, 2.0, 0.25), vec3(7.0, 8.0, 9.0)]);
        assert_eq!(cloud.colors, [[4, 5, 6], [41, 0, 255], [10, 11, 12]]);
        assert!(read(b"").unwrap().is_empty());
        for bytes in crate::fs::encoding::tests::encoded(&"1 2 3 4 5 6\n".repeat(100_000)) {
            assert_eq!(read(&bytes).unwrap().len(), 100_000);
        }
    }

    #[test]
    fn an_offset_is_subtracted_before_coordinates_are_rounded() {
        let text = b"500000.125 5400000.0625 300.5 1 2 3\n499999.875 -1 inf 1 2 3\n";
        let offset = DVec3::new(500_000.0, 5_400_000.0, 300.0);
        let reader = PointReader::new(&text[..], Path::new("a.txt"), OnFault::Skip).with_offset(offset);
        let mut cloud = PointCloud::default();
        let mut reader = reader;
        while reader.read_chunk(usize::MAX, &mut cloud).unwrap() > 0 {}
        assert_eq!(cloud.positions, [vec3(0.125, 0.0625, 0.5)]);
        assert!(
            reader
                .first_skipped()
                .unwrap()
                .to_string()
                .contains("`inf` is not finite")
        );
    }

    #[test]
    fn every_fault_has_its_line() {
        for (text, words) in [
            (&b"1 2 3 4 5"[..], "line 3: not a point `x y z r g b`: 5 fields: `1 2 3 4 5`"),
            (b"1 2 3 4 5 6 7", "more than 6 fields"),
            (b"1 2 3\x10 4 5", "line 3: not a point `x y z r g b`: 5 fields"),
            (b"1 2 \x10x 4 5 6", "the coordinate `\u{fffd}x` is no number"),
            (b"1 nan 3 4 5 6", "`nan` is not finite"),
            (b"1 2 1e39 4 5 6", "`1e39` is not finite"),
            (b"1 2 3 256 5 6", "the colour `256` is not from 0 to 255"),
            (b"1 2 3 -1 5 6", "the colour `-1`"),
            (b"1 2 3 4 255.5 6", "the colour `255.5`"),
            (b"1 2 3 4 NaN 6", "the colour `NaN`"),
            (b"x y z r g b", "line 3: the coordinate `x`"),
        ] {
            let message = read(&[b"0 0 0 0 0 0\n\n", text, b"\n"].concat())
                .unwrap_err()
                .to_string();
            assert!(message.contains(words) && message.contains("wall_1.txt, line 3"), "{message}");
        }
    }

    #[test]
    fn bad_lines_can_be_skipped() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        fs::write(&path, "0 0 0 0 0 0\nx\n1 1 1 1 1 1\ny\n").unwrap();
        let mut reader = PointReader::open_with(&path, OnFault::Skip).unwrap();
        let mut cloud = PointCloud::default();
        assert_eq!(reader.read_chunk(100, &mut cloud).unwrap(), 2);
        assert_eq!(reader.skipped(), 2);
        assert!(reader.first_skipped().unwrap().to_string().contains("line 2"));
        assert_eq!(reader.read_chunk(100, &mut cloud).unwrap(), 0);
    }

    #[test]
    fn control_characters_within_numbers_are_taken_out_and_counted() {
        let text = "0 0 0 0 0 0\n1 2 3 103.0\x10000 5 6\r\n1\x7f2 0 0 0 0 0\n\0\n7 8 9 1 2 3\n";
        let mut reader = PointReader::new(text.as_bytes(), Path::new("a.txt"), OnFault::Stop);
        let mut cloud = PointCloud::default();
        while reader.read_chunk(100, &mut cloud).unwrap() > 0 {}
        assert_eq!(cloud.positions[1..3], [vec3(1.0, 2.0, 3.0), vec3(12.0, 0.0, 0.0)]);
        assert_eq!((cloud.colors[1], cloud.len()), ([103, 5, 6], 4));
        assert_eq!((reader.mended(), reader.skipped()), (3, 0));
        assert_eq!(reader.take_skipped().first_mended.unwrap(), "a.txt, line 2");
    }

    #[test]
    fn chunks_are_as_large_as_asked_for() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        // Two blocks and more, so that lines lie across their borders.
        let n = 3 * BLOCK / 30;
        let text: String = (0..n)
            .map(|i| format!("{i}.125 -{i}.5 1.000 1 2 {}\n\n", i % 256))
            .collect();
        assert!(text.len() > 2 * BLOCK);
        fs::write(&path, &text).unwrap();
        let mut reader = PointReader::open(&path).unwrap();
        let mut all = PointCloud::default();
        let mut piece = PointCloud::default();
        loop {
            piece.clear();
            let read = reader.read_chunk(1000, &mut piece).unwrap();
            assert_eq!(read, piece.len());
            assert!(read == 1000 || all.len() + read == n);
            all.positions.extend(&piece.positions);
            all.colors.extend(&piece.colors);
            if read == 0 {
                break;
            }
        }

        let mut whole = PointCloud::default();
        read_points(&path, &mut whole).unwrap();
        assert_eq!(all, whole);
        assert_eq!(whole.positions[n - 1], vec3((n - 1) as f32 + 0.125, -((n - 1) as f32) - 0.5, 1.0));
    }

    #[test]
    fn a_fault_among_many_lines_has_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        let n = 5 * BLOCK / 20;
        // In the first piece, in a middle one, and in a later block.
        for bad in [3, 2 * PIECE / 20, n - 7] {
            let line = |i| {
                if i == bad {
                    "x\n".to_owned()
                } else {
                    format!("{i}.5 0 1 2 3 4\n\n")
                }
            };
            fs::write(&path, (0..n).map(line).collect::<String>()).unwrap();
            // Each line but the bad one is followed by an empty one.
            let words = format!("line {}: not a point", 2 * bad + 1);

            let mut cloud = PointCloud::default();
            let message = read_points(&path, &mut cloud).unwrap_err().to_string();
            assert!(message.contains(&words), "{message}");
            assert_eq!(cloud.len(), bad);

            let mut reader = PointReader::open_with(&path, OnFault::Skip).unwrap();
            cloud.clear();
            while reader.read_chunk(usize::MAX, &mut cloud).unwrap() > 0 {}
            assert_eq!((cloud.len(), reader.skipped()), (n - 1, 1));
            assert!(reader.first_skipped().unwrap().to_string().contains(&words));

            let x = (0..n).filter(|i| *i != bad).map(|i| i as f32 + 0.5);
            assert!(cloud.positions.iter().map(|p| p.x).eq(x));
        }
    }

    #[test]
    fn an_endless_line_is_refused_without_holding_it() {
        let message = read(&vec![b'1'; 3 * BLOCK]).unwrap_err().to_string();
        assert!(message.contains("line 1: not a point") && message.len() < 300, "{message}");
    }

    proptest! {
        #[test]
        fn what_is_written_is_read(
            points in proptest::collection::vec((any::<[f32; 3]>(), any::<[u8; 3]>()), 0..50),
        ) {
            let finite: Vec<_> =
                points.into_iter().filter(|(p, _)| p.iter().all(|v| v.is_finite())).collect();
            let text: String = finite
                .iter()
                .map(|(p, c)| format!("{:?} {:?} {:e} {} {} {}\n", p[0], p[1], p[2], c[0], c[1], c[2]))
                .collect();
            let cloud = read(text.as_bytes()).unwrap();
            prop_assert_eq!(cloud.len(), finite.len());
            for ((position, color), (p, c)) in cloud.positions.iter().zip(&cloud.colors).zip(&finite) {
                prop_assert_eq!(position.to_array(), *p);
                prop_assert_eq!(color, c);
            }
        }

        #[test]
        fn any_bytes_give_points_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
            let _ = read(&bytes);
        }
    }
}
