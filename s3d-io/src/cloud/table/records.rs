//! Records of fixed size, in which binary PLY, NPY and LAS hold points: fields at fixed places.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::table::cloud::ColorRange;
use crate::cloud::table::columns::Columns;
use crate::cloud::table::measured::{Measured, Told};
use crate::cloud::table::rows::{Reading, Row, Value};
use crate::cloud::table::wanted::Wanted;
use crate::error::{Error, Result};
use s3d_geom::glam::dvec3;
use std::cell::Cell;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Bytes that are read at a time.
const BLOCK: usize = 1 << 20;
/// The longest record.
const LONGEST_RECORD: usize = 1 << 16;

/// How a number, or a text, is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F16,
    F32,
    F64,
    /// One byte a character, ended by a zero byte if shorter.
    Bytes(usize),
    /// Four bytes a character, ended by a zero if shorter.
    Utf32(usize),
}

impl Kind {
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
            Self::Bytes(n) => n,
            Self::Utf32(n) => n.saturating_mul(4),
        }
    }

    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    pub(crate) fn is_text(self) -> bool {
        matches!(self, Self::Bytes(_) | Self::Utf32(_))
    }
}

/// A field of a record.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    pub(crate) name: String,
    /// Where it starts in the record, in bytes.
    pub(crate) at: usize,
    pub(crate) kind: Kind,
    pub(crate) big_endian: bool,
}

/// A number as a field holds it.
enum Number {
    Whole(i64),
    Float(f64),
}

impl Field {
    /// The record from this field on. Returns `None` if the record ends before.
    fn start<'r>(&self, record: &'r [u8]) -> Option<&'r [u8]> {
        record.get(self.at..)
    }

    /// The field's number. Returns `None` if it is a text, or reaches beyond the record.
    fn number(&self, record: &[u8]) -> Option<Number> {
        macro_rules! number {
            ($t:ty, $form:path, $to:ty) => {{
                let bytes = *self.start(record)?.first_chunk()?;
                let v = if self.big_endian {
                    <$t>::from_be_bytes(bytes)
                } else {
                    <$t>::from_le_bytes(bytes)
                };
                $form(<$to>::from(v))
            }};
        }

        Some(match self.kind {
            Kind::I8 => number!(i8, Number::Whole, i64),
            Kind::U8 => number!(u8, Number::Whole, i64),
            Kind::I16 => number!(i16, Number::Whole, i64),
            Kind::U16 => number!(u16, Number::Whole, i64),
            Kind::I32 => number!(i32, Number::Whole, i64),
            Kind::U32 => number!(u32, Number::Whole, i64),
            Kind::I64 => number!(i64, Number::Whole, i64),
            Kind::U64 => {
                let bytes = *self.start(record)?.first_chunk()?;
                let v = if self.big_endian {
                    u64::from_be_bytes(bytes)
                } else {
                    u64::from_le_bytes(bytes)
                };
                // A larger number has no meaning here; as a float it will be refused.
                i64::try_from(v).map_or(Number::Float(v as f64), Number::Whole)
            }
            Kind::F16 => number!(half::f16, Number::Float, f64),
            Kind::F32 => number!(f32, Number::Float, f64),
            Kind::F64 => number!(f64, Number::Float, f64),
            Kind::Bytes(_) | Kind::Utf32(_) => return None,
        })
    }

    /// The field's number. Returns NaN if it is a text, or reaches beyond the record.
    pub(crate) fn float(&self, record: &[u8]) -> f64 {
        match self.number(record) {
            Some(Number::Whole(n)) => n as f64,
            Some(Number::Float(v)) => v,
            None => f64::NAN,
        }
    }

    /// The field's value. A text is put into `text`.
    pub(crate) fn value<'a>(&self, record: &[u8], text: &'a mut String) -> Value<'a> {
        text.clear();
        let written = self.start(record).and_then(|r| r.get(..self.kind.size()));

        match self.kind {
            Kind::Bytes(_) => {
                let bytes = written.and_then(|w| w.split(|b| *b == 0).next());
                text.push_str(String::from_utf8_lossy(bytes.unwrap_or_default()).trim());
                Value::Name(text)
            }
            Kind::Utf32(_) => {
                for c in written.unwrap_or_default().as_chunks::<4>().0 {
                    let code = if self.big_endian {
                        u32::from_be_bytes(*c)
                    } else {
                        u32::from_le_bytes(*c)
                    };
                    if code == 0 {
                        break;
                    }
                    text.push(char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER));
                }
                Value::Name(text)
            }
            _ => match self.number(record) {
                Some(Number::Whole(n)) => Value::Whole(n),
                Some(Number::Float(v)) => Value::Float(v),
                None => Value::None,
            },
        }
    }
}

/// The result of reading a colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Color {
    Rgb([u8; 3]),
    /// It is beyond the range, and may be in a wider one.
    Wider,
    /// This channel is beyond every range.
    Beyond(usize),
}

/// Turns three numbers into 8 bits each. Of 16 bits it takes the upper 8: programs make 16 bits by a factor
/// of 256, as the specification of LAS has it, or of 257.
pub(crate) fn color(channels: [f64; 3], is_float: bool, range: ColorRange) -> Color {
    // The largest number of the range, and the way from numbers to 8 bits.
    let (most, to_byte): (f64, fn(f64) -> f64) = match (is_float, range) {
        (false, ColorRange::Narrow) | (true, ColorRange::Wide) => (255.0, f64::round),
        (true, ColorRange::Narrow) => (1.0, |v| (v * 255.0).round()),
        (false, _) | (true, ColorRange::Widest) => (65_535.0, |v| (v / 256.0).floor()),
    };

    let is_16_bit = most > 255.0;
    let fits = |v: &f64| (0.0..=most).contains(v) && !(is_16_bit && v.fract() != 0.0);
    if let Some(i) = channels.iter().position(|v| !fits(v)) {
        let is_wider = |v: &f64| *v > most && (range == ColorRange::Narrow || v.fract() == 0.0);
        let may_be_wider = !is_16_bit && channels.get(i).is_some_and(is_wider);
        return if may_be_wider { Color::Wider } else { Color::Beyond(i) };
    }
    #[expect(clippy::cast_possible_truncation, reason = "0 to 255: larger numbers were returned above")]
    Color::Rgb(channels.map(|v| to_byte(v) as u8))
}

/// The layout of a table: its fields, and the columns chosen among them.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) fields: Vec<Field>,
    pub(crate) columns: Columns,
    /// Bytes of a record.
    pub(crate) stride: usize,
    /// The number of points left out because a coordinate is NaN. `None`: such a point is a fault.
    pub(crate) holes: Option<Cell<u64>>,
    /// The number that stands for no instance, beside negative ones.
    pub(crate) no_instance: Option<i64>,
}

/// A piece of every record, from a source of its own.
pub(crate) struct Part<R> {
    /// The source, for messages.
    pub(crate) path: PathBuf,
    pub(crate) source: R,
    /// Where the piece starts in the record, and its bytes.
    pub(crate) at: usize,
    pub(crate) stride: usize,
}

impl Table {
    /// # Errors
    /// [`Error::Format`] if columns are missing, a coordinate or colour is a text, records are too long, or a
    /// field reaches beyond them.
    pub(crate) fn new(path: &Path, fields: Vec<Field>, stride: usize, wanted: Wanted<'_>) -> Result<Self> {
        let names: Vec<String> = fields.iter().map(|f| f.name.clone()).collect();
        let columns = Columns::choose(path, &names, wanted)?;

        let measured = [columns.intensity, columns.time].into_iter().flatten();
        let numbers = columns.position.into_iter().chain(columns.color.into_iter().flatten());
        let numbers = numbers.chain(measured);
        if let Some(text) = numbers.filter_map(|i| fields.get(i)).find(|f| f.kind.is_text()) {
            return Err(Error::format(path, format!("the column {} holds texts, not numbers", text.name)));
        }

        if stride == 0 || stride > LONGEST_RECORD {
            return Err(Error::format(path, format!("records of {stride} bytes cannot hold points")));
        }

        let is_inside = |f: &Field| f.at.checked_add(f.kind.size()).is_some_and(|end| end <= stride);
        if let Some(field) = fields.iter().find(|f| !is_inside(f)) {
            let message = format!("the column {} reaches beyond the {stride} bytes of a record", field.name);
            return Err(Error::format(path, message));
        }
        Ok(Self { fields, columns, stride, holes: None, no_instance: None })
    }

    /// Hands on the record with this `number` (from 1). Returns `false` if its colour is beyond the narrow
    /// range.
    #[expect(clippy::indexing_slicing, reason = "the columns were chosen among these fields")]
    pub(crate) fn push(
        &self,
        number: u64,
        record: &[u8],
        colors: ColorRange,
        texts: &mut [String; 3],
        path: &Path,
        reading: &mut Reading<'_>,
    ) -> Result<bool> {
        let columns = &self.columns;
        let [x, y, z] = columns.position.map(|i| self.fields[i].float(record));
        if let Some(holes) = &self.holes
            && dvec3(x, y, z).is_nan()
        {
            holes.set(holes.get().saturating_add(1));
            return Ok(true);
        }

        let mut rgb = [0; 3];
        if let Some(channels) = columns.color {
            let first = &self.fields[channels[0]];
            match color(channels.map(|i| self.fields[i].float(record)), first.kind.is_float(), colors) {
                Color::Rgb(found) => rgb = found,
                Color::Wider => return Ok(false),
                Color::Beyond(i) => {
                    let field = &self.fields[channels[i]];
                    let value = field.float(record);
                    let why = format!("record {number}: {value} is no colour ({})", field.name);
                    reading.fault(Error::format(path, why))?;
                    return Ok(true);
                }
            }
        }

        let [class, instance, room] = texts;
        let instance = columns
            .instance
            .map_or(Value::None, |i| self.fields[i].value(record, instance));
        let is_none = matches!((instance, self.no_instance), (Value::Whole(n), Some(none)) if n == none);
        let row = Row {
            position: dvec3(x, y, z),
            color: rgb,
            class: columns
                .class
                .map_or(Value::None, |i| self.fields[i].value(record, class)),
            instance: if is_none { Value::None } else { instance },
            room: columns.room.map_or(Value::None, |i| self.fields[i].value(record, room)),
            measured: self.measured(record),
        };
        reading.push(number, &row)?;
        Ok(true)
    }

    /// Returns what the scanner told of a point.
    fn measured(&self, record: &[u8]) -> Measured {
        let number = |column: Option<usize>| Some(self.fields.get(column?)?.float(record));
        Measured {
            #[expect(clippy::cast_possible_truncation, reason = "intensities are coarse")]
            intensity: number(self.columns.intensity).map_or(f32::NAN, |v| v as f32),
            time_s: number(self.columns.time).unwrap_or(f64::NAN),
            cell: None,
        }
    }

    /// Returns what the table tells of its points.
    fn told(&self, points: u64) -> Told {
        let color = self.columns.color.map(|[first, ..]| first);
        Told {
            points: Some(points),
            has_colors: color.is_some(),
            are_bytes: color
                .and_then(|i| self.fields.get(i))
                .is_some_and(|field| field.kind == Kind::U8),
            has_intensity: self.columns.intensity.is_some(),
            has_times: self.columns.time.is_some(),
            has_grid: false,
        }
    }

    /// Hands on `count` records. Returns `false` if a colour is beyond the narrow range.
    ///
    /// # Errors
    /// [`Error::Format`] if there are fewer records, and the errors of [`Table::push`].
    pub(crate) fn read(
        &self,
        path: &Path,
        mut source: impl Read,
        count: u64,
        colors: ColorRange,
        reading: &mut Reading<'_>,
    ) -> Result<bool> {
        reading.told = self.told(count);
        let mut texts = Default::default();
        let mut done = 0;
        let mut block = Vec::new();
        while let Some(n) = rows_of_block(count, done, self.stride) {
            block.resize(n.saturating_mul(self.stride), 0);
            fill(path, &mut source, &mut block, done, count, self.stride)?;
            for (record, number) in block.chunks_exact(self.stride).zip(done.saturating_add(1)..) {
                if !self.push(number, record, colors, &mut texts, path, reading)? {
                    return Ok(false);
                }
            }
            done = done.saturating_add(n as u64);
        }
        Ok(true)
    }
}

impl Table {
    /// Hands on `count` records that are put together from pieces. Bytes of a record that no piece fills are
    /// zero. Returns `false` if a colour is beyond the narrow range.
    ///
    /// # Errors
    /// [`Error::Format`] if a source holds fewer pieces, and the errors of [`Table::push`].
    pub(crate) fn read_parts<R: Read>(
        &self,
        path: &Path,
        parts: &mut [Part<R>],
        count: u64,
        colors: ColorRange,
        reading: &mut Reading<'_>,
    ) -> Result<bool> {
        reading.told = self.told(count);
        // Records have up to 64 KiB, so a block has a few MiB at most.
        let mut done = 0;
        let mut block = Vec::new();
        let mut column = Vec::new();
        let mut texts = Default::default();
        while let Some(n) = rows_of_block(count, done, self.stride) {
            block.resize(n.saturating_mul(self.stride), 0);
            for Part { path, source, at, stride } in &mut *parts {
                column.resize(n.saturating_mul(*stride), 0);
                fill(path, source, &mut column, done, count, *stride)?;
                let pieces = column.chunks_exact((*stride).max(1));
                for (record, piece) in block.chunks_exact_mut(self.stride).zip(pieces) {
                    let place = record.get_mut(*at..).and_then(|r| r.get_mut(..piece.len()));
                    place.into_iter().for_each(|place| place.copy_from_slice(piece));
                }
            }

            for (record, number) in block.chunks_exact(self.stride).zip(done.saturating_add(1)..) {
                if !self.push(number, record, colors, &mut texts, path, reading)? {
                    return Ok(false);
                }
            }
            done = done.saturating_add(n as u64);
        }
        Ok(true)
    }
}

/// The number of records of `stride` bytes to read at once after `done` of `count`: as many as fit into a
/// block, and at least one. Returns `None` at the end.
pub(crate) fn rows_of_block(count: u64, done: u64, stride: usize) -> Option<usize> {
    let most = BLOCK.checked_div(stride)?.max(1);
    match count.checked_sub(done)? {
        0 => None,
        left => Some(usize::try_from(left).map_or(most, |left| left.min(most))),
    }
}

/// Fills a block with the records after the first `done`.
pub(crate) fn fill(
    path: &Path,
    source: &mut impl Read,
    block: &mut [u8],
    done: u64,
    count: u64,
    stride: usize,
) -> Result<()> {
    let size = block.len();
    let mut rest = block;

    while !rest.is_empty() {
        match source.read(rest) {
            Ok(0) => {
                let whole = size.saturating_sub(rest.len()).checked_div(stride).unwrap_or(0);
                let record = done.saturating_add(whole as u64).saturating_add(1);
                let message = format!("ends in record {record} of {count}: the file is cut short");
                return Err(Error::format(path, message));
            }
            // A reader may claim more bytes than there was room for; the block is full then.
            Ok(n) => rest = rest.get_mut(n..).unwrap_or_default(),
            Err(e) if e.kind() == ErrorKind::Interrupted => {}
            Err(e) if e.kind() == ErrorKind::InvalidData || e.kind() == ErrorKind::InvalidInput => {
                return Err(Error::format(path, format!("cannot be unpacked: {e}")));
            }
            Err(e) => return Err(Error::io(path, "read", e)),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::annotations::AnnotationOptions;

    fn field(kind: Kind, big_endian: bool) -> Field {
        Field { name: "a".to_owned(), at: 1, kind, big_endian }
    }

    #[test]
    fn numbers_and_texts_of_every_kind() {
        let record = [0, 0xfe, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f];
        let mut text = String::new();
        for (kind, big_endian, value) in [
            (Kind::I8, false, Value::Whole(-2)),
            (Kind::U8, false, Value::Whole(254)),
            (Kind::I16, false, Value::Whole(-2)),
            (Kind::U16, true, Value::Whole(0xfeff)),
            (Kind::I32, true, Value::Whole(-0x0100_0001)),
            (Kind::U32, false, Value::Whole(0xffff_fffe)),
            (Kind::I64, false, Value::Whole(i64::MAX - 1)),
            (Kind::U64, true, Value::Float(0xfeff_ffff_ffff_ff7fu64 as f64)),
        ] {
            assert_eq!(field(kind, big_endian).value(&record, &mut text), value, "{kind:?}");
        }

        let one = [0, 0, 0x3c];
        assert_eq!(field(Kind::F16, false).float(&one), 1.0);
        assert_eq!(field(Kind::F32, true).float(&[0, 0x3f, 0x80, 0, 0]), 1.0);
        assert_eq!(field(Kind::F64, true).float(&[0, 0x3f, 0xf0, 0, 0, 0, 0, 0, 0]), 1.0);

        assert_eq!(field(Kind::Bytes(4), false).value(b"-wall", &mut text), Value::Name("wall"));
        assert_eq!(field(Kind::Bytes(4), false).value(b"-wa\0x", &mut text), Value::Name("wa"));
        let utf32 = [0, 0, 0, 0, b'w', 0, 0, 0, 0xfc, 0, 0, 0, 0];
        assert_eq!(field(Kind::Utf32(3), true).value(&utf32, &mut text), Value::Name("wü"));
    }

    #[test]
    fn a_field_beyond_its_record_is_no_number() {
        let mut text = String::new();
        for kind in [Kind::U8, Kind::I64, Kind::F32, Kind::Bytes(3), Kind::Utf32(2)] {
            let far = Field { at: usize::MAX, ..field(kind, false) };
            assert!(far.float(&[1; 4]).is_nan(), "{kind:?}");
            let nothing = if kind.is_text() { Value::Name("") } else { Value::None };
            assert_eq!(far.value(&[1; 4], &mut text), nothing, "{kind:?}");
        }
        assert!(field(Kind::Bytes(1), false).float(b"-5").is_nan());
    }

    #[test]
    fn a_table_whose_fields_reach_beyond_its_records_is_refused() {
        let names = ["x", "y", "z", "class"];
        let fields = (0..).zip(names).map(|(i, name)| Field {
            name: name.to_owned(),
            at: 4 * i,
            kind: Kind::F32,
            big_endian: false,
        });
        let table = |stride| {
            Table::new(
                Path::new("a.npy"),
                fields.clone().collect(),
                stride,
                (&AnnotationOptions::default()).into(),
            )
        };
        assert_eq!(table(16).unwrap().stride, 16);
        let message = table(15).unwrap_err().to_string();
        assert!(message.contains("the column class reaches beyond the 15 bytes of a record"), "{message}");
    }

    #[test]
    fn a_block_is_no_larger_for_what_a_header_claims() {
        assert_eq!(rows_of_block(u64::MAX, 0, LONGEST_RECORD), Some(16));
        assert_eq!(rows_of_block(u64::MAX, 7, 16), Some(BLOCK / 16));
        assert_eq!(rows_of_block(u64::MAX, 7, 3 * BLOCK), Some(1));
        assert_eq!(rows_of_block(12, 7, 16), Some(5));
        assert_eq!((rows_of_block(7, 7, 16), rows_of_block(6, 7, 16)), (None, None));
    }

    #[test]
    fn colours_of_every_range() {
        use ColorRange::{Narrow, Wide, Widest};
        for (channels, is_float, range, expected) in [
            ([0.0, 128.0, 255.0], false, Narrow, Color::Rgb([0, 128, 255])),
            ([0.0, 128.0, 256.0], false, Narrow, Color::Wider),
            ([0.0, 200.0 * 256.0, 255.0 * 256.0], false, Wide, Color::Rgb([0, 200, 255])),
            ([0.0, 200.0 * 257.0, 65_535.0], false, Wide, Color::Rgb([0, 200, 255])),
            ([0.0, 65_536.0, 0.0], false, Wide, Color::Beyond(1)),
            ([-1.0, 0.0, 0.0], false, Narrow, Color::Beyond(0)),
            ([0.0, 0.5, 1.0], true, Narrow, Color::Rgb([0, 128, 255])),
            ([0.0, 0.5, 1.5], true, Narrow, Color::Wider),
            ([0.0, 41.0, 254.6], true, Wide, Color::Rgb([0, 41, 255])),
            ([0.0, 41.0, 256.0], true, Wide, Color::Wider),
            ([0.0, 41.0, 255.5], true, Wide, Color::Beyond(2)),
            ([0.0, 41_728.0, 65_280.0], true, Widest, Color::Rgb([0, 163, 255])),
            ([0.0, 41_728.5, 65_536.0], true, Widest, Color::Beyond(1)),
            ([0.0, 0.0, f64::NAN], true, Narrow, Color::Beyond(2)),
        ] {
            assert_eq!(color(channels, is_float, range), expected, "{channels:?}");
        }
    }
}
