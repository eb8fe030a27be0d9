//! Rows of words, in which text files hold points: one point a line.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::cloud::ColorRange;
use crate::cloud::table::columns::Columns;
use crate::cloud::table::measured::{Measured, Told};
use crate::cloud::table::records::{Color, color};
use crate::cloud::table::rows::{Row, Value};
use crate::cloud::table::wanted::Wanted;
use crate::error::{Error, Result};
use crate::fs::quote::quote;
use crate::fs::text::double;
use s3d_geom::glam::dvec3;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};

/// The longest line.
const LONGEST_LINE: u64 = 1 << 16;
/// The places of a row: three coordinates, three colours, class, instance, room, intensity, time.
const PLACES: usize = 11;

/// The lines of a file, one at a time.
pub(crate) struct Lines<B> {
    path: PathBuf,
    file: B,
    line: Vec<u8>,
    number: u64,
    bytes: u64,
}

impl<B: BufRead> Lines<B> {
    pub(crate) fn new(path: &Path, file: B) -> Self {
        Self::resumed(path, file, 0)
    }

    /// Returns the lines of a file that is open behind this many of its lines.
    pub(crate) fn resumed(path: &Path, file: B, lines: u64) -> Self {
        Self { path: path.to_owned(), file, line: Vec::new(), number: lines, bytes: 0 }
    }

    /// Reads the next line, and returns it without white space around it. Returns `None` at the end.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a line of more than 64 KiB.
    pub(crate) fn next(&mut self) -> Result<Option<&[u8]>> {
        self.line.clear();
        let read = self
            .file
            .by_ref()
            .take(LONGEST_LINE)
            .read_until(b'\n', &mut self.line)
            .map_err(|e| Error::io(&self.path, "read", e))?;
        if read == 0 {
            return Ok(None);
        }

        self.number = self.number.saturating_add(1);
        self.bytes = self.bytes.saturating_add(read as u64);
        if read as u64 == LONGEST_LINE && self.line.last() != Some(&b'\n') {
            let message = format!("a line of more than {LONGEST_LINE} bytes holds no point");
            return Err(Error::line(&self.path, self.number, message));
        }
        Ok(Some(self.line.trim_ascii()))
    }

    /// Returns the number of the last line, from 1.
    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// Returns the last line.
    pub(crate) fn line(&self) -> &[u8] {
        self.line.trim_ascii()
    }

    /// Returns the bytes of all lines so far.
    pub(crate) fn bytes(&self) -> u64 {
        self.bytes
    }
}

/// What stands between two words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Separator {
    /// Any number of blanks.
    Blanks,
    /// One of this character.
    One(u8),
}

impl Separator {
    /// Finds what separates the words of a line.
    pub(crate) fn of(line: &[u8]) -> Self {
        [b';', b',']
            .into_iter()
            .find(|c| line.contains(c))
            .map_or(Self::Blanks, Self::One)
    }

    /// The words of a line. A separator at the end of the line adds an empty word.
    pub(crate) fn words(self, line: &[u8]) -> impl Iterator<Item = &[u8]> {
        let mut rest = Some(line);
        std::iter::from_fn(move || {
            let left = match self {
                Self::Blanks => rest.map(<[u8]>::trim_ascii_start).filter(|left| !left.is_empty())?,
                Self::One(_) => rest?,
            };
            let end = left.iter().position(|b| match self {
                Self::Blanks => b.is_ascii_whitespace(),
                Self::One(c) => *b == c,
            });
            let (word, behind) = end.and_then(|end| left.split_at_checked(end)).unwrap_or((left, b""));
            rest = end.and_then(|_| behind.get(1..));
            Some(word.trim_ascii())
        })
    }

    /// Returns the number that a word spells, finite or not. Between semicolons, it may have a decimal comma.
    pub(crate) fn number(self, word: &[u8]) -> Option<f64> {
        let plain = double(word);
        if plain.is_none() && self == Self::One(b';') {
            return std::str::from_utf8(word).ok()?.replace(',', ".").parse().ok();
        }
        plain
    }
}

/// The word without quotation marks around it.
pub(crate) fn unquoted(word: &[u8]) -> &[u8] {
    [b'"', b'\'']
        .iter()
        .find_map(|mark| word.strip_prefix(&[*mark])?.strip_suffix(&[*mark]))
        .unwrap_or(word)
}

/// How a text holds colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WordColor {
    None,
    /// Three columns; whether they are floats.
    Three([usize; 3], bool),
    /// One column with all channels, as PCL packs them.
    Packed(usize),
}

/// The layout of a text: where each thing is in a line.
#[derive(Debug)]
pub(crate) struct WordTable {
    /// The number of words in a line.
    width: usize,
    /// Each column that is read, and its place among the words of a row; ordered by column.
    wanted: Vec<(usize, usize)>,
    columns: Columns,
    color: WordColor,
    separator: Separator,
}

/// What a line turned out to be.
pub(crate) enum Parsed<'a> {
    Row(Row<'a>),
    /// A colour may be in a wider range.
    Wider,
    Fault(String),
}

impl WordTable {
    /// Chooses the columns among these names, one for each word of a line. `has_fraction` tells whether a
    /// column holds floats.
    ///
    /// # Errors
    /// The errors of [`Columns::choose`].
    pub(crate) fn new(
        path: &Path,
        names: &[String],
        separator: Separator,
        has_fraction: impl Fn(usize) -> bool,
        wanted: Wanted<'_>,
    ) -> Result<Self> {
        let columns = Columns::choose(path, names, wanted)?;
        let color = match columns.color {
            Some(channels) => WordColor::Three(channels, channels.into_iter().any(has_fraction)),
            None => names
                .iter()
                .position(|n| is_packed(n))
                .map_or(WordColor::None, WordColor::Packed),
        };
        let of_color = match color {
            WordColor::None => [None; 3],
            WordColor::Three(channels, _) => channels.map(Some),
            WordColor::Packed(column) => [Some(column), None, None],
        };

        let places = columns.position.into_iter().map(Some).chain(of_color).chain([
            columns.class,
            columns.instance,
            columns.room,
            columns.intensity,
            columns.time,
        ]);
        let mut wanted: Vec<(usize, usize)> = places.zip(0..).filter_map(|(c, at)| Some((c?, at))).collect();
        wanted.sort_unstable();
        Ok(Self { width: names.len(), wanted, columns, color, separator })
    }

    /// Returns what the table tells of its points.
    pub(crate) fn told(&self, points: Option<u64>) -> Told {
        Told {
            points,
            has_colors: self.color != WordColor::None,
            are_bytes: matches!(self.color, WordColor::Packed(_)),
            has_intensity: self.columns.intensity.is_some(),
            has_times: self.columns.time.is_some(),
            has_grid: false,
        }
    }

    /// Parses a line.
    pub(crate) fn parse<'l>(&self, line: &'l [u8], colors: ColorRange) -> Parsed<'l> {
        let mut row: [&[u8]; PLACES] = [b""; PLACES];
        let mut wanted = self.wanted.iter().peekable();
        let mut n = 0usize;
        let mut last: &[u8] = b"";
        for word in self.separator.words(line) {
            while let Some((_, place)) = wanted.next_if(|(column, _)| *column == n) {
                row.get_mut(*place).into_iter().for_each(|place| *place = word);
            }
            n = n.saturating_add(1);
            last = word;
        }

        // A separator at the end of a line is no column.
        let one_more = n == self.width.saturating_add(1) && last.is_empty();
        if n != self.width && !one_more {
            let why = format!("{n} columns where {} are due: {}", self.width, quote(line));
            return Parsed::Fault(why);
        }
        self.row(&row, colors).unwrap_or_else(Parsed::Fault)
    }

    fn row<'l>(
        &self,
        row: &[&'l [u8]; PLACES],
        colors: ColorRange,
    ) -> std::result::Result<Parsed<'l>, String> {
        let [x, y, z, r, g, b, class, instance, room, intensity, time] = *row;
        let coordinate = |word| {
            let value = self.separator.number(unquoted(word));
            value.ok_or_else(|| format!("the coordinate {} is no number", quote(word)))
        };
        let position = dvec3(coordinate(x)?, coordinate(y)?, coordinate(z)?);

        let rgb = match self.color {
            WordColor::None => [0; 3],
            WordColor::Packed(_) => packed_word(r).ok_or_else(|| no_color(r))?,
            WordColor::Three(_, is_float) => {
                let channel = |word| {
                    let value = self.separator.number(unquoted(word));
                    // A text of whole numbers has one scale for all of them.
                    let fits = value.filter(|v| is_float || v.fract() == 0.0);
                    fits.ok_or_else(|| no_color(word))
                };
                match color([channel(r)?, channel(g)?, channel(b)?], is_float, colors) {
                    Color::Rgb(rgb) => rgb,
                    Color::Wider => return Ok(Parsed::Wider),
                    Color::Beyond(i) => return Err(no_color([r, g, b].get(i).copied().unwrap_or_default())),
                }
            }
        };

        Ok(Parsed::Row(Row {
            position,
            color: rgb,
            class: self.columns.class.map_or(Ok(Value::None), |_| self.value(class))?,
            instance: self
                .columns
                .instance
                .map_or(Ok(Value::None), |_| self.value(instance))?,
            room: self.columns.room.map_or(Ok(Value::None), |_| self.value(room))?,
            measured: Measured {
                #[expect(clippy::cast_possible_truncation, reason = "intensities are coarse")]
                intensity: self
                    .separator
                    .number(unquoted(intensity))
                    .map_or(f32::NAN, |v| v as f32),
                time_s: self.separator.number(unquoted(time)).unwrap_or(f64::NAN),
                cell: None,
            },
        }))
    }

    /// The value of a word: a number, or else a name.
    fn value<'l>(&self, word: &'l [u8]) -> std::result::Result<Value<'l>, String> {
        let word = unquoted(word);
        let text = std::str::from_utf8(word).map_err(|_| format!("{} is no UTF-8", quote(word)))?;
        Ok(match text.parse() {
            Ok(whole) => Value::Whole(whole),
            Err(_) if text.is_empty() => Value::None,
            // "nan" and "inf" are no numbers of anything.
            Err(_) => self
                .separator
                .number(word)
                .filter(|v| v.is_finite())
                .map_or(Value::Name(text), Value::Float),
        })
    }
}

fn no_color(word: &[u8]) -> String {
    format!("{} is no colour", quote(word))
}

/// Whether a column of this name holds all channels of a colour in 32 bits.
pub(crate) fn is_packed(name: &str) -> bool {
    name.eq_ignore_ascii_case("rgb") || name.eq_ignore_ascii_case("rgba")
}

/// The channels of a packed colour: 0xAARRGGBB, as a whole number or as the float that has these bits.
///
/// PCL writes the number, whatever the header's type. Others write the float: tiny, huge or NaN for every
/// alpha that occurs. A float from 1 to 2²⁴ is the number itself, rounded by the writer.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "floats from 1 to 2^24 have their whole part in an integer of 32 bits, and others are rounded"
)]
fn packed_word(word: &[u8]) -> Option<[u8; 3]> {
    let text = std::str::from_utf8(word).ok()?;
    let bits = match text.parse::<i64>() {
        Ok(whole) => u32::try_from(whole)
            .ok()
            .or_else(|| i32::try_from(whole).ok().map(i32::cast_unsigned))?,
        Err(_) => match text.parse::<f64>().ok()? {
            v if (1.0..16_777_216.0).contains(&v) => v as u32,
            v => (v as f32).to_bits(),
        },
    };
    let [_, r, g, b] = bits.to_be_bytes();
    Some([r, g, b])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::annotations::AnnotationOptions;

    fn words(separator: Separator, line: &str) -> Vec<String> {
        let words = separator.words(line.as_bytes());
        words.map(|w| String::from_utf8_lossy(w).into_owned()).collect()
    }

    #[test]
    fn words_are_separated_as_the_line_says() {
        for (line, separator, expected) in [
            (" 1\t2  3 ", Separator::Blanks, vec!["1", "2", "3"]),
            ("1, 2,,3", Separator::One(b','), vec!["1", "2", "", "3"]),
            ("1,5; 2;", Separator::One(b';'), vec!["1,5", "2", ""]),
            ("", Separator::Blanks, vec![]),
        ] {
            assert_eq!(Separator::of(line.as_bytes()), separator, "{line}");
            assert_eq!(words(separator, line), expected, "{line}");
        }
        assert_eq!(Separator::One(b';').number(b"1,5"), Some(1.5));
        assert_eq!(Separator::Blanks.number(b"1,5"), None);
    }

    #[test]
    fn packed_colours_are_numbers_or_the_bits_of_floats() {
        for (word, rgb) in [
            ("7887420", [120, 90, 60]),
            ("4286077500", [120, 90, 60]),
            ("-8889796", [120, 90, 60]),
            ("7.88742e+06", [120, 90, 60]),
            ("0", [0, 0, 0]),
            ("nan", [192, 0, 0]),
        ] {
            assert_eq!(packed_word(word.as_bytes()), Some(rgb), "{word}");
        }
        let float = f32::from_bits(0x0078_5a3c).to_string();
        assert_eq!(packed_word(float.as_bytes()), Some([120, 90, 60]), "{float}");
        assert_eq!(packed_word(b"red"), None);
    }

    #[test]
    fn a_line_is_a_row_or_says_what_is_wrong() {
        let names = ["x", "y", "z", "r", "g", "b", "class", "instance"].map(str::to_owned);
        let options = AnnotationOptions::default();
        let comma = Separator::One(b',');
        let table = WordTable::new(Path::new("a.csv"), &names, comma, |_| false, (&options).into()).unwrap();
        let line = b"1,2.5,-3,4,5,6,\"chair\",2.000,";
        let Parsed::Row(row) = table.parse(line, ColorRange::Narrow) else { panic!("a row") };
        assert_eq!(row.position, dvec3(1.0, 2.5, -3.0));
        assert_eq!((row.color, row.class), ([4, 5, 6], Value::Name("chair")));
        assert_eq!(row.instance, Value::Float(2.0));

        for (line, words) in [
            ("1,2,3", "3 columns where 8 are due: `1,2,3`"),
            ("1,2,x,4,5,6,7,8", "the coordinate `x` is no number"),
            ("1,2,3,4,5,0.5,7,8", "`0.5` is no colour"),
            ("1,2,3,4,-5,6,7,8", "`-5` is no colour"),
        ] {
            let Parsed::Fault(why) = table.parse(line.as_bytes(), ColorRange::Narrow) else {
                panic!("{line}")
            };
            assert!(why.contains(words), "{why}");
        }
        assert!(matches!(table.parse(b"1,2,3,4,300,6,7,8", ColorRange::Narrow), Parsed::Wider));
    }
}
