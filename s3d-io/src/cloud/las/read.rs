//! Annotated points of LAS and LAZ files, 1.0 to 1.4. Source: "LAS Specification 1.4 - R15", ASPRS.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::bounds::Bounds;
use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::las::bounded::{BoundedClaims, Mended};
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::columns::{CLASSES, INSTANCES};
use crate::cloud::table::records::{Color, Field, Kind, color};
use crate::cloud::table::rows::{Reading, Row, Value};
use crate::error::{Error, Result};
use crate::fs::source::{Bytes, Source};
use crate::guarded::guarded;
use las::point::Format;
use s3d_geom::glam::dvec3;
use std::io::{BufReader, ErrorKind, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::Path;
use std::sync::atomic::Ordering::Relaxed;

/// Points that are unpacked at a time, at most, and their bytes.
const BATCH: u64 = 65_536;
const BATCH_BYTES: u64 = 1 << 23;
/// The most points that a byte of a compressed file stands for: a hundred times what the flattest scans come
/// to. Layers that say nothing take no bytes, so any number could be claimed.
const MAX_POINTS_PER_BYTE: u64 = 1024;
/// Numbers of points and bytes in a chunk of compressed points that are believed whatever the file's size.
const PLAUSIBLE: u32 = 1 << 24;
/// The bit of a point that was deleted: "withheld".
const WITHHELD: u8 = 0b100;

/// Where the header counts its records, and where its extended ones.
const VLRS_AT: u64 = 100;
const EVLRS_AT: u64 = 243;

/// Numbers of the header that are wrong, and what is right: a place and a number each.
type Mends = Vec<(u64, u32)>;

/// A `.las` or `.laz` file.
pub(crate) struct LasCloud<'a> {
    source: Source,
    options: &'a AnnotationOptions,
}

/// What a dimension of a point is.
#[derive(Clone, Debug)]
enum Dimension {
    /// Bits of a byte that other flags share.
    Classification { at: usize, mask: u8 },
    /// A number of its own, times a scale, plus an offset.
    Plain { field: Field, scale: f64, offset: f64 },
}

impl Dimension {
    fn classification(format: &Format) -> Self {
        let (at, mask) = if format.is_extended { (16, 0xff) } else { (15, 0x1f) };
        Self::Classification { at, mask }
    }

    fn plain(name: &str, at: usize, kind: Kind) -> (String, Self) {
        let field = Field { name: name.to_owned(), at, kind, big_endian: false };
        (name.to_owned(), Self::Plain { field, scale: 1.0, offset: 0.0 })
    }

    fn value(&self, record: &[u8]) -> Value<'static> {
        match self {
            Self::Classification { at, mask } => record
                .get(*at)
                .map_or(Value::None, |byte| Value::Whole(i64::from(byte & mask))),
            Self::Plain { field, scale, offset } => {
                let mut text = String::new();
                match field.value(record, &mut text) {
                    Value::Whole(n) if (*scale, *offset) == (1.0, 0.0) => Value::Whole(n),
                    Value::Whole(n) => Value::Float(n as f64 * scale + offset),
                    Value::Float(v) => Value::Float(v * scale + offset),
                    Value::Name(_) | Value::None => Value::None,
                }
            }
        }
    }
}

impl<'a> LasCloud<'a> {
    pub(crate) fn new(source: Source, options: &'a AnnotationOptions) -> Self {
        Self { source, options }
    }

    /// Looks at what the header claims before anything believes it. Records that are not there are told in
    /// `notes`: they hold coordinate systems and names of dimensions, and the points can be read without.
    fn preflight(&self, notes: &mut Vec<String>) -> Result<Mends> {
        let path = self.source.name();
        let (file, size) = self.source.open()?;
        let mut source = BufReader::new(file);
        let mut head = Vec::new();
        source
            .by_ref()
            .take(375)
            .read_to_end(&mut head)
            .map_err(|e| Error::io(path, "read", e))?;
        let (header, header_1_4) = (head.first_chunk::<227>(), head.first_chunk::<375>());
        let Some(header) = header.filter(|h| h.starts_with(b"LASF")) else {
            return Err(Error::format(path, "is no LAS file: it does not begin with LASF and a header"));
        };
        let header_1_4 = header_1_4.filter(|h| h[25] >= 4);
        let offset = u64::from(number_at(header, 96).map_or(0, u32::from_le_bytes));
        let length = u64::from(number_at(header, 105).map_or(0, u16::from_le_bytes));
        let is_compressed = header[104] & 0x80 != 0;
        let points = u64::from(number_at(header, 107).map_or(0, u32::from_le_bytes));
        let points_1_4 = header_1_4.and_then(|h| number_at(h, 247)).map_or(0, u64::from_le_bytes);
        let points = points.max(points_1_4);
        let cut = |what: &str| Err(Error::format(path, format!("claims {what}: the file is cut short")));
        let end = points.checked_mul(length).and_then(|n| n.checked_add(offset));
        let is_bomb = is_compressed && points > size.saturating_mul(MAX_POINTS_PER_BYTE);
        if offset > size || is_bomb || end.is_none_or(|end| !is_compressed && end > size) {
            return cut(&format!("{points} points of {length} bytes in a file of {size} bytes"));
        }
        let mut mends = Mends::new();
        let claimed = number_at(header, 100).map_or(0, u32::from_le_bytes);
        let start = u64::from(number_at(header, 94).map_or(0, u16::from_le_bytes));
        let there = records(&mut source, start..offset, claimed).map_err(|e| Error::io(path, "read", e))?;
        if there < claimed {
            notes.push(format!(
                "{}: its header counts {claimed} records before the points, and {there} are there; those are \
                 read",
                path.display()
            ));
            mends.push((VLRS_AT, there));
        }
        // The 1.4 header's extended records, whose lengths are numbers of 64 bits.
        if let Some(header) = header_1_4
            && number_at(header, 243).map_or(0, u32::from_le_bytes) > 0
        {
            let start = number_at(header, 235).map_or(0, u64::from_le_bytes);
            let mut record = [0; 60];
            let read = source
                .seek(SeekFrom::Start(start))
                .and_then(|_| source.read_exact(&mut record));
            let length = number_at(&record, 20).map_or(0, u64::from_le_bytes);
            let is_inside = start
                .checked_add(60)
                .and_then(|n| n.checked_add(length))
                .is_some_and(|n| n <= size);
            let is_behind = is_compressed || end.is_some_and(|end| end <= start);
            if start > 0 && (read.is_err() || !is_inside || !is_behind) {
                notes.push(format!(
                    "{}: its header tells of extended records at byte {start}, where none are; it is read \
                     without them",
                    path.display()
                ));
                mends.push((EVLRS_AT, 0));
            }
        }
        if is_compressed {
            let number = |source: &mut BufReader<Bytes>, at: u64| -> std::io::Result<u64> {
                let mut bytes = [0; 8];
                source.seek(SeekFrom::Start(at))?;
                source.read_exact(&mut bytes)?;
                Ok(u64::from_le_bytes(bytes))
            };
            let mut table = number(&mut source, offset);
            if table.as_ref().is_ok_and(|t| t.cast_signed() <= offset.cast_signed()) {
                // A writer that could not go back puts it at the end.
                table = number(&mut source, size.saturating_sub(8));
            }
            // A chunk has a byte at least.
            match table.and_then(|at| number(&mut source, at)) {
                Ok(entry) if entry >> 32 <= size => {}
                _ => return cut("a table of chunks that is not there"),
            }
        }
        Ok(mends)
    }

    /// The dimensions that can hold classes, instances or rooms, by their usual names.
    fn dimensions(&self, header: &las::Header) -> Vec<(String, Dimension)> {
        let format = header.point_format();
        let source_at = if format.is_extended { 20 } else { 18 };
        let mut all = vec![
            ("classification".to_owned(), Dimension::classification(format)),
            Dimension::plain("user_data", 17, Kind::U8),
            Dimension::plain("point_source_id", source_at, Kind::U16),
            Dimension::plain("intensity", 12, Kind::U16),
        ];
        let mut at = usize::from(format.len().saturating_sub(format.extra_bytes));
        let end = usize::from(format.len());
        for vlr in header
            .all_vlrs()
            .filter(|v| v.user_id.starts_with("LASF_Spec") && v.record_id == 4)
        {
            for extra in vlr.data.as_chunks::<192>().0 {
                let name = extra[4..36].split(|b| *b == 0).next().unwrap_or_default();
                let name = String::from_utf8_lossy(name).into_owned();
                let double = |at: usize| number_at(extra, at).map_or(f64::NAN, f64::from_le_bytes);
                // 11 to 20 are pairs of the first ten, 21 to 30 triples, no longer used; 0 is a number of
                // bytes that only its writer knows.
                let (data_type, options) = (extra[2], extra[3]);
                let kind = match data_type % 10 {
                    1 => Kind::U8,
                    2 => Kind::I8,
                    3 => Kind::U16,
                    4 => Kind::I16,
                    5 => Kind::U32,
                    6 => Kind::I32,
                    7 => Kind::U64,
                    8 => Kind::I64,
                    9 => Kind::F32,
                    _ => Kind::F64,
                };
                let (is_single, bytes) = match data_type {
                    0 => (false, usize::from(options)),
                    1..=10 => (true, kind.size()),
                    11..=20 => (false, kind.size().saturating_mul(2)),
                    21..=30 => (false, kind.size().saturating_mul(3)),
                    _ => break,
                };
                let behind = at.saturating_add(bytes);
                if behind > end {
                    break;
                }
                if is_single {
                    let scale = if options & 8 != 0 { double(112) } else { 1.0 };
                    let offset = if options & 16 != 0 { double(136) } else { 0.0 };
                    let field = Field { name: name.clone(), at, kind, big_endian: false };
                    all.push((name, Dimension::Plain { field, scale, offset }));
                }
                at = behind;
            }
        }
        all
    }

    fn named(
        &self,
        all: &[(String, Dimension)],
        key: &str,
        asked: Option<&String>,
        usual: &[&str],
    ) -> Result<Option<Dimension>> {
        let Some(name) = asked else {
            let found = usual
                .iter()
                .find_map(|u| all.iter().find(|(n, _)| n.eq_ignore_ascii_case(u)));
            return Ok(found.map(|(_, d)| d.clone()));
        };
        match all.iter().find(|(n, _)| n == name) {
            Some((_, dimension)) => Ok(Some(dimension.clone())),
            None => {
                let names: Vec<&str> = all.iter().map(|(n, _)| n.as_str()).collect();
                Err(Error::format(
                    self.source.name(),
                    format!("has no dimension {name:?} ({key} in [annotations]); it has {}", names.join(" ")),
                ))
            }
        }
    }

    fn error(&self, done: u64, error: &las::Error) -> Error {
        let path = self.source.name();
        let io = match error {
            las::Error::Io(e) => Some(e),
            _ => None,
        };
        match io {
            Some(e) if e.kind() == ErrorKind::UnexpectedEof => {
                Error::format(path, format!("ends after point {done}: the file is cut short"))
            }
            _ => Error::format(path, format!("cannot be read after point {done}: {error}")),
        }
    }
}

/// How many records lie whole in a range of bytes, one after the other, `claimed` at most.
fn records(source: &mut BufReader<Bytes>, place: Range<u64>, claimed: u32) -> std::io::Result<u32> {
    let mut at = place.start;
    let mut head = [0; 54];
    for n in 0..claimed {
        if at.saturating_add(54) > place.end {
            return Ok(n);
        }
        source.seek(SeekFrom::Start(at))?;
        source.read_exact(&mut head)?;
        let length = number_at(&head, 20).map_or(0, u16::from_le_bytes);
        at = at.saturating_add(54).saturating_add(u64::from(length));
        if at > place.end {
            return Ok(n);
        }
    }
    Ok(claimed)
}

/// The bytes of a number `at` bytes into a record.
fn number_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

/// Where a record of this format has its colour, three numbers of 16 bits.
fn color_at(format: &Format) -> Option<[usize; 3]> {
    let at = match (format.is_extended, format.has_gps_time) {
        (true, _) => [30, 32, 34],
        (false, true) => [28, 30, 32],
        (false, false) => [20, 22, 24],
    };
    format.has_color.then_some(at)
}

impl Cloud for LasCloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let mends = self.preflight(&mut reading.notes)?;
        let (file, size) = self.source.open()?;
        let file = Mended::new(file, &mends);
        let (file, most) = BoundedClaims::new(BufReader::with_capacity(1 << 18, file));
        let damaged = || Error::format(path, "its compressed points are damaged");
        let reader = guarded(|| las::Reader::new(file)).ok_or_else(damaged)?;
        let mut reader = reader.map_err(|e| self.error(0, &e))?;
        let header = reader.header().clone();
        let format = *header.point_format();
        if format.is_extended {
            // Compressed points of these formats are layers, each with its size before it. Others are
            // streams, of which four bytes may be any number.
            most.store(u32::try_from(size).unwrap_or(u32::MAX).max(PLAUSIBLE), Relaxed);
        }
        let all = self.dimensions(&header);
        let o = self.options;
        // Extra dimensions made for labels come before the standard's.
        let class = self.named(&all, "class", o.class_column.as_ref(), &CLASSES)?;
        let class = class.unwrap_or_else(|| Dimension::classification(&format));
        let usual: Vec<&str> = INSTANCES.into_iter().chain(["point_source_id"]).collect();
        let instance = self.named(&all, "instance", o.instance_column.as_ref(), &usual)?;
        let room = self.named(&all, "rooms", o.room_column.as_ref(), &[])?;
        let field = |name: &str, at, kind| Field { name: name.to_owned(), at, kind, big_endian: false };
        let channels = color_at(&format).map(|at| at.map(|at| field("colour", at, Kind::U16)));
        let [x, y, z] = [0, 4, 8].map(|at| field("coordinate", at, Kind::I32));
        let t = header.transforms();
        let [min, max] = [header.bounds().min, header.bounds().max].map(|p| dvec3(p.x, p.y, p.z));
        reading.claims(Bounds { min, max });
        let count = header.number_of_points();
        let mut data = las::PointDataBuilder::new().for_header(&header).build();
        let at_once = BATCH_BYTES
            .checked_div(u64::from(format.len()))
            .unwrap_or(1)
            .clamp(1, BATCH);
        let (mut done, mut withheld) = (0u64, 0u64);
        while let Some(left) = count.checked_sub(done).filter(|left| *left > 0) {
            let n = at_once.min(left);
            let read = guarded(|| reader.fill_points(n, &mut data)).ok_or_else(damaged)?;
            if read.map_err(|e| self.error(done, &e))? == 0 {
                return Err(Error::format(
                    path,
                    format!("ends after point {done} of {count}: it is cut short"),
                ));
            }
            for record in data.raw_bytes().chunks_exact(data.record_len()) {
                done = done.saturating_add(1);
                let flags = record
                    .get(15)
                    .map_or(0, |f| if format.is_extended { *f } else { f >> 5 });
                if flags & WITHHELD != 0 {
                    withheld = withheld.saturating_add(1);
                    continue;
                }
                let mut found = [0; 3];
                if let Some([r, g, b]) = &channels {
                    match color([r, g, b].map(|f| f.float(record)), false, colors) {
                        Color::Rgb(rgb) => found = rgb,
                        _ => return Ok(false),
                    }
                }
                let position = dvec3(
                    x.float(record) * t.x.scale + t.x.offset,
                    y.float(record) * t.y.scale + t.y.offset,
                    z.float(record) * t.z.scale + t.z.offset,
                );
                let row = Row {
                    position,
                    color: found,
                    class: class.value(record),
                    instance: instance.as_ref().map_or(Value::None, |d| d.value(record)),
                    room: room.as_ref().map_or(Value::None, |d| d.value(record)),
                };
                reading.push(done, &row)?;
            }
        }
        if withheld > 0 {
            reading
                .notes
                .push(format!("{}: {withheld} points are withheld (deleted), left out", path.display()));
        }
        Ok(true)
    }
}
