//! Reads annotated points of LAS and LAZ files.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use super::bounded::{BoundedClaims, Mended};
use super::claims::check_claims;
use super::dimensions::{Dimension, dimensions, find_dimension};
use crate::bounds::Bounds;
use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::columns::{CLASSES, INSTANCES};
use crate::cloud::table::measured::{Measured, Told};
use crate::cloud::table::records::{Color, Field, Kind, color};
use crate::cloud::table::rows::{Reading, Row, Value};
use crate::cloud::table::wanted::Wanted;
use crate::error::{Error, Result};
use crate::fs::source::Source;
use crate::guarded::guarded;
use las::point::Format;
use s3d_geom::glam::{DVec3, dvec3};
use std::io::{BufReader, ErrorKind};
use std::path::Path;
use std::sync::atomic::Ordering::Relaxed;

/// The most points that are unpacked at a time, and the most bytes.
const BATCH: u64 = 65_536;
const BATCH_BYTES: u64 = 1 << 23;
/// Numbers of points and bytes in a compressed chunk that are believed, however small the file is.
const PLAUSIBLE: u32 = 1 << 24;
/// The bit of a deleted point ("withheld").
const WITHHELD: u8 = 0b100;

/// A `.las` or `.laz` file.
pub(crate) struct LasCloud<'a> {
    source: Source,
    wanted: Wanted<'a>,
}

/// The fields of a point's record.
struct Fields {
    is_extended: bool,
    position: [Field; 3],
    transforms: las::Vector<las::Transform>,
    /// `None`: the points have no colours.
    color: Option<[Field; 3]>,
    /// `None` if no annotations are wanted.
    class: Option<Dimension>,
    instance: Option<Dimension>,
    room: Option<Dimension>,
    intensity: Field,
    /// `None`: the points have no times.
    time: Option<Field>,
}

impl Fields {
    fn choose(path: &Path, header: &las::Header, wanted: Wanted<'_>) -> Result<Self> {
        let format = header.point_format();
        let [mut class, mut instance, mut room] = [const { None }; 3];
        if let Some(options) = wanted.annotations() {
            [class, instance, room] = labels(path, header, options)?;
        }
        let time_at = if format.is_extended { 22 } else { 20 };
        Ok(Self {
            is_extended: format.is_extended,
            position: [0, 4, 8].map(|at| field("coordinate", at, Kind::I32)),
            transforms: *header.transforms(),
            color: color_at(format).map(|at| at.map(|at| field("colour", at, Kind::U16))),
            class,
            instance,
            room,
            intensity: field("intensity", 12, Kind::U16),
            time: format.has_gps_time.then(|| field("time", time_at, Kind::F64)),
        })
    }

    fn is_withheld(&self, record: &[u8]) -> bool {
        let flags = record.get(15).map_or(0, |f| if self.is_extended { *f } else { f >> 5 });
        flags & WITHHELD != 0
    }

    fn position(&self, record: &[u8]) -> DVec3 {
        let [x, y, z] = &self.position;
        let transforms = &self.transforms;
        dvec3(
            x.float(record) * transforms.x.scale + transforms.x.offset,
            y.float(record) * transforms.y.scale + transforms.y.offset,
            z.float(record) * transforms.z.scale + transforms.z.offset,
        )
    }

    fn measured(&self, record: &[u8]) -> Measured {
        Measured {
            #[expect(clippy::cast_possible_truncation, reason = "16 bits are exact")]
            intensity: self.intensity.float(record) as f32,
            time_s: self.time.as_ref().map_or(f64::NAN, |time| time.float(record)),
            cell: None,
        }
    }

    /// The colour of a point, black if it has none. Returns `None` if it is beyond the range.
    fn color(&self, record: &[u8], range: ColorRange) -> Option<[u8; 3]> {
        let Some([r, g, b]) = &self.color else { return Some([0; 3]) };
        match color([r, g, b].map(|f| f.float(record)), false, range) {
            Color::Rgb(rgb) => Some(rgb),
            Color::Wider | Color::Beyond(_) => None,
        }
    }
}

/// Returns the dimensions of classes, instances and rooms.
fn labels(path: &Path, header: &las::Header, options: &AnnotationOptions) -> Result<[Option<Dimension>; 3]> {
    let all = dimensions(header);
    // Extra dimensions made for labels come before the standard's.
    let class = find_dimension(path, &all, "class", options.class_column.as_ref(), &CLASSES)?;
    let usual: Vec<&str> = INSTANCES.into_iter().chain(["point_source_id"]).collect();
    let instance = find_dimension(path, &all, "instance", options.instance_column.as_ref(), &usual)?;
    let room = find_dimension(path, &all, "rooms", options.room_column.as_ref(), &[])?;
    let class = class.unwrap_or_else(|| Dimension::classification(header.point_format()));
    Ok([Some(class), instance, room])
}

fn field(name: &str, at: usize, kind: Kind) -> Field {
    Field { name: name.to_owned(), at, kind, big_endian: false }
}

/// Where a record of this format has its colour: three 16-bit numbers.
fn color_at(format: &Format) -> Option<[usize; 3]> {
    let at = match (format.is_extended, format.has_gps_time) {
        (true, _) => [30, 32, 34],
        (false, true) => [28, 30, 32],
        (false, false) => [20, 22, 24],
    };
    format.has_color.then_some(at)
}

impl<'a> LasCloud<'a> {
    pub(crate) fn new(source: Source, wanted: Wanted<'a>) -> Self {
        Self { source, wanted }
    }

    fn error(&self, done: u64, error: &las::Error) -> Error {
        let message = match error {
            las::Error::Io(e) if e.kind() == ErrorKind::UnexpectedEof => {
                format!("ends after point {done}: the file is cut short")
            }
            _ => format!("cannot be read after point {done}: {error}"),
        };
        Error::format(self.source.name(), message)
    }

    fn damaged(&self) -> Error {
        Error::format(self.source.name(), "its compressed points are damaged")
    }

    /// Opens the file in the decoder, with the claims of its header checked or mended.
    fn open(&self, notes: &mut Vec<String>) -> Result<las::Reader> {
        let mends = check_claims(&self.source, notes)?;
        let (file, size) = self.source.open()?;
        let file = Mended::new(file, &mends);
        let (file, most) = BoundedClaims::new(BufReader::with_capacity(1 << 18, file));

        let reader = guarded(|| las::Reader::new(file)).ok_or_else(|| self.damaged())?;
        let reader = reader.map_err(|e| self.error(0, &e))?;
        if reader.header().point_format().is_extended {
            // Compressed points of these formats are layers, each with its size before it. The other formats
            // are streams, in which four bytes may be any number.
            most.store(u32::try_from(size).unwrap_or(u32::MAX).max(PLAUSIBLE), Relaxed);
        }
        Ok(reader)
    }
}

impl Cloud for LasCloud<'_> {
    fn path(&self) -> &Path {
        self.source.name()
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let path = self.source.name();
        let mut reader = self.open(&mut reading.notes)?;
        let header = reader.header().clone();
        let fields = Fields::choose(path, &header, self.wanted)?;
        let [min, max] = [header.bounds().min, header.bounds().max].map(|p| dvec3(p.x, p.y, p.z));
        reading.claims(Bounds { min, max });

        let count = header.number_of_points();
        reading.told = Told {
            points: Some(count),
            has_colors: fields.color.is_some(),
            are_bytes: false,
            has_intensity: true,
            has_times: fields.time.is_some(),
            has_grid: false,
        };
        let mut data = las::PointDataBuilder::new().for_header(&header).build();
        let at_once = BATCH_BYTES
            .checked_div(u64::from(header.point_format().len()))
            .unwrap_or(1)
            .clamp(1, BATCH);
        let mut done = 0u64;
        let mut withheld = 0u64;
        let mut cut = 0u64;
        while let Some(left) = count.checked_sub(done).filter(|left| *left > 0) {
            let n = at_once.min(left);
            let read = guarded(|| reader.fill_points(n, &mut data)).ok_or_else(|| self.damaged())?;
            if read.map_err(|e| self.error(done, &e))? == 0 {
                let message = format!("ends after point {done} of {count}: it is cut short");
                return Err(Error::format(path, message));
            }

            for record in data.raw_bytes().chunks_exact(data.record_len()) {
                done = done.saturating_add(1);
                if fields.is_withheld(record) {
                    withheld = withheld.saturating_add(1);
                    continue;
                }
                let is_cut = fields.class.as_ref().is_some_and(|class| class.is_cut(record));
                cut = cut.saturating_add(u64::from(is_cut));
                let Some(color) = fields.color(record, colors) else { return Ok(false) };
                let row = Row {
                    position: fields.position(record),
                    color,
                    class: fields.class.as_ref().map_or(Value::None, |d| d.value(record)),
                    instance: fields.instance.as_ref().map_or(Value::None, |d| d.value(record)),
                    room: fields.room.as_ref().map_or(Value::None, |d| d.value(record)),
                    measured: fields.measured(record),
                };
                reading.push(done, &row)?;
            }
        }

        let shown = path.display();
        if withheld > 0 {
            reading
                .notes
                .push(format!("{shown}: {withheld} points are withheld (deleted), left out"));
        }
        // Whoever gives 31 a meaning knows of it.
        let is_known =
            |wanted: Wanted<'_>| wanted.annotations().is_some_and(|o| o.classes.contains_key("31"));
        if cut > 0 && !is_known(self.wanted) {
            reading.notes.push(format!(
                "{shown}: {cut} points have the class 31, the largest in this point format: larger classes \
                 may have been cut to it. Save as LAS 1.4 with a point format of 6 to 10, or classes as an \
                 extra dimension"
            ));
        }
        Ok(true)
    }
}
