//! The rows of a table of points, as every format's reader hands them on: a point each, with its class,
//! instance and room.

use crate::bounds::Bounds;
use crate::cloud::annotations::{AnnotationOptions, Skipped};
use crate::cloud::frame_gap::FrameWatch;
use crate::cloud::on_fault::OnFault;
use crate::cloud::table::measured::{Measured, ScanBlock, Told};
use crate::error::{Error, Result};
use s3d_geom::glam::{DVec3, Vec3};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The number of rows that are handed on at a time.
const BATCH: usize = 65_536;
/// The most different classes or rooms that a cloud may name. More of them mean that the column is wrong.
const MAX_TAGS: usize = 10_000;
/// Numbers below this are looked up without hashing.
const SMALL: usize = 4096;

/// Stands for an index into [`Tags`] if the file does not say.
pub(crate) const NO_TAG: u32 = u32::MAX;
/// Stands for an instance number if the file does not say. All negative numbers mean the same.
pub(crate) const NO_INSTANCE: i64 = -1;

/// What a file calls a class or a room: a number or a name.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Tag {
    Number(i64),
    Name(String),
}

impl Tag {
    /// Its key in a table that users write.
    pub(crate) fn key(&self) -> String {
        match self {
            Self::Number(n) => n.to_string(),
            Self::Name(name) => name.clone(),
        }
    }
}

/// The tags that occurred, each with an index, in the order of their first occurrence.
#[derive(Debug)]
pub(crate) struct Tags {
    list: Vec<Tag>,
    index: HashMap<Tag, u32>,
    /// The indices of small numbers, or [`NO_TAG`].
    small: Vec<u32>,
}

/// The classes and the rooms that the files of a cloud name.
#[derive(Debug)]
pub(crate) struct CloudTags {
    pub(crate) classes: Tags,
    pub(crate) rooms: Tags,
}

impl CloudTags {
    pub(crate) fn new() -> Self {
        Self { classes: Tags::new(), rooms: Tags::new() }
    }
}

impl Tags {
    pub(crate) fn new() -> Self {
        Self { list: Vec::new(), index: HashMap::new(), small: vec![NO_TAG; SMALL] }
    }

    /// The index of a number. Returns `None` if there are too many different tags.
    pub(crate) fn number(&mut self, number: i64) -> Option<u32> {
        let small = usize::try_from(number).ok();
        let known = small.and_then(|n| self.small.get(n));
        if let Some(index) = known.filter(|index| **index != NO_TAG) {
            return Some(*index);
        }
        let index = self.intern(Tag::Number(number))?;
        if let Some(known) = small.and_then(|n| self.small.get_mut(n)) {
            *known = index;
        }
        Some(index)
    }

    /// The index of a name. Returns `None` if there are too many different tags.
    pub(crate) fn name(&mut self, name: &str) -> Option<u32> {
        self.intern(Tag::Name(name.to_owned()))
    }

    fn intern(&mut self, tag: Tag) -> Option<u32> {
        if let Some(index) = self.index.get(&tag) {
            return Some(*index);
        }
        if self.list.len() >= MAX_TAGS {
            return None;
        }
        let index = self.list.len() as u32;
        self.list.push(tag.clone());
        self.index.insert(tag, index);
        Some(index)
    }

    pub(crate) fn get(&self, index: u32) -> Option<&Tag> {
        self.list.get(index as usize)
    }
}

/// Some rows, by column. Every column has an entry a row.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    /// World metres, less the offset.
    pub(crate) positions: Vec<Vec3>,
    pub(crate) colors: Vec<[u8; 3]>,
    /// Indices into the classes of [`CloudTags`].
    pub(crate) classes: Vec<u32>,
    /// [`NO_INSTANCE`] if unknown.
    pub(crate) instances: Vec<i64>,
    /// Indices into the rooms of [`CloudTags`], or [`NO_TAG`].
    pub(crate) rooms: Vec<u32>,
}

impl Rows {
    pub(crate) fn len(&self) -> usize {
        self.positions.len()
    }

    fn clear(&mut self) {
        self.positions.clear();
        self.colors.clear();
        self.classes.clear();
        self.instances.clear();
        self.rooms.clear();
    }
}

/// The class, instance or room of a row, as it stands in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Value<'a> {
    /// Nothing: there is no such column.
    None,
    Whole(i64),
    Float(f64),
    Name(&'a str),
}

impl Value<'_> {
    fn whole(self) -> std::result::Result<i64, String> {
        match self {
            Self::Whole(n) => Ok(n),
            // All whole numbers up to 2^53 are exact.
            Self::Float(v) if v.fract() == 0.0 && v.abs() < 9e15 => Ok(v as i64),
            Self::Float(v) => Err(format!("{v} is no whole number")),
            Self::Name(name) => Err(format!("{name:?} is no whole number")),
            Self::None => Err("nothing is no whole number".to_owned()),
        }
    }
}

/// One row as a reader found it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Row<'a> {
    /// World metres, Z-up, as the file has them.
    pub(crate) position: DVec3,
    pub(crate) color: [u8; 3],
    pub(crate) class: Value<'a>,
    pub(crate) instance: Value<'a>,
    pub(crate) room: Value<'a>,
    pub(crate) measured: Measured,
}

/// The function that takes a batch of rows.
pub(crate) type Sink<'a> = dyn FnMut(&Rows) -> Result<()> + 'a;

/// The function that takes a block of measurements, which it may change.
pub(crate) type BlockSink<'a> = dyn FnMut(&mut ScanBlock) -> Result<()> + 'a;

/// Who takes the rows.
enum Taker<'a> {
    /// Rows with their labels.
    Labels {
        /// The index of the room for rows that name none.
        room: u32,
        tags: &'a mut CloudTags,
        rows: Rows,
        sink: &'a mut Sink<'a>,
    },
    /// What a scanner measured.
    Measurements { block: ScanBlock, sink: &'a mut BlockSink<'a> },
}

/// Reads one file: takes rows, checks them and hands them on in batches.
pub(crate) struct Reading<'a> {
    path: PathBuf,
    on_fault: OnFault,
    offset_m: DVec3,
    watch: Option<FrameWatch>,
    taker: Taker<'a>,
    /// What the file tells of its points. Readers set it before the first row.
    pub(crate) told: Told,
    pub(crate) skipped: Skipped,
    /// The largest coordinate, in metres.
    pub(crate) farthest_m: f64,
    pub(crate) has_points: bool,
    /// Whether a point had an instance number.
    pub(crate) has_instances: bool,
    /// What the user should know about the file, a sentence each.
    pub(crate) notes: Vec<String>,
}

impl<'a> Reading<'a> {
    pub(crate) fn new(
        path: &Path,
        options: &AnnotationOptions,
        room: u32,
        tags: &'a mut CloudTags,
        sink: &'a mut Sink<'a>,
    ) -> Self {
        Self {
            path: path.to_owned(),
            on_fault: options.on_fault,
            offset_m: options.offset_m,
            watch: options.mesh_bounds.map(|mesh| FrameWatch::new(mesh, options.offset_m)),
            taker: Taker::Labels { room, tags, rows: Rows::default(), sink },
            told: Told::default(),
            skipped: Skipped::default(),
            farthest_m: 0.0,
            has_points: false,
            has_instances: false,
            notes: Vec::new(),
        }
    }

    /// Returns a reading whose blocks of measurements `sink` takes.
    #[cfg(feature = "raw")]
    pub(crate) fn of_measurements(path: &Path, on_fault: OnFault, sink: &'a mut BlockSink<'a>) -> Self {
        Self {
            path: path.to_owned(),
            on_fault,
            offset_m: DVec3::ZERO,
            watch: None,
            taker: Taker::Measurements { block: ScanBlock::default(), sink },
            told: Told::default(),
            skipped: Skipped::default(),
            farthest_m: 0.0,
            has_points: false,
            has_instances: false,
            notes: Vec::new(),
        }
    }

    /// Takes the record `number` (from 1).
    ///
    /// # Errors
    /// The errors of the sink; [`Error::Format`] with the record's number if it is no valid point, unless
    /// faults are skipped.
    pub(crate) fn push(&mut self, number: u64, row: &Row<'_>) -> Result<()> {
        self.push_at(row, |path, why| Error::format(path, format!("record {number}: {why}")))
    }

    /// Takes a line of text (from 1) like [`Reading::push`].
    pub(crate) fn push_line(&mut self, line: u64, row: &Row<'_>) -> Result<()> {
        self.push_at(row, |path, why| Error::line(path, line, why))
    }

    fn push_at(&mut self, row: &Row<'_>, error: impl Fn(&Path, String) -> Error) -> Result<()> {
        if let Err(why) = self.take(row) {
            return self.fault(error(&self.path, why));
        }
        let taken = match &self.taker {
            Taker::Labels { rows, .. } => rows.len(),
            Taker::Measurements { block, .. } => block.len(),
        };
        if taken >= BATCH { self.flush() } else { Ok(()) }
    }

    /// Counts a faulty row, or stops at it.
    pub(crate) fn fault(&mut self, error: Error) -> Result<()> {
        if self.on_fault == OnFault::Stop {
            return Err(error);
        }
        self.skipped.count += 1;
        self.skipped.first.get_or_insert(error);
        Ok(())
    }

    fn take(&mut self, row: &Row<'_>) -> std::result::Result<(), String> {
        if !row.position.is_finite() {
            let p = row.position;
            return Err(format!("the coordinates {} {} {} are not finite", p.x, p.y, p.z));
        }
        let position = row.position - self.offset_m;
        let farthest = position.abs().max_element();
        if farthest > f64::from(f32::MAX) {
            return Err(format!("a coordinate of {farthest:e} m is too large"));
        }

        let (room, tags, rows) = match &mut self.taker {
            Taker::Labels { room, tags, rows, .. } => (*room, tags, rows),
            Taker::Measurements { block, .. } => {
                self.has_points = true;
                measure(block, row, &self.told);
                return Ok(());
            }
        };
        let class = match row.class {
            Value::Name(name) => tags.classes.name(name),
            value => {
                let number = value.whole().map_err(|e| format!("class: {e}"))?;
                tags.classes.number(number)
            }
        };
        let class = class.ok_or_else(|| too_many("classes"))?;
        let instance = match row.instance {
            Value::None => NO_INSTANCE,
            value => value.whole().map_err(|e| format!("instance: {e}"))?.max(NO_INSTANCE),
        };
        let room = match row.room {
            Value::None => room,
            Value::Name(name) => tags.rooms.name(name).ok_or_else(|| too_many("rooms"))?,
            value => {
                let number = value.whole().map_err(|e| format!("room: {e}"))?;
                tags.rooms.number(number).ok_or_else(|| too_many("rooms"))?
            }
        };

        self.has_points = true;
        self.has_instances |= instance != NO_INSTANCE;
        self.farthest_m = self.farthest_m.max(farthest);
        if let Some(watch) = &mut self.watch {
            watch.see(row.position);
        }
        rows.positions.push(position.as_vec3());
        rows.colors.push(row.color);
        rows.classes.push(class);
        rows.instances.push(instance);
        rows.rooms.push(room);
        Ok(())
    }

    /// Takes the box of all points that the file's header states.
    #[cfg_attr(not(any(feature = "las", feature = "e57")), allow(dead_code))]
    pub(crate) fn claims(&mut self, bounds: Bounds) {
        if let Some(watch) = &mut self.watch {
            watch.header(bounds);
        }
    }

    /// Ends the file: hands on the last rows, and refuses points that all lie far from the mesh.
    pub(crate) fn end(&mut self) -> Result<()> {
        self.flush()?;
        self.watch.as_ref().map_or(Ok(()), |watch| watch.at_end(&self.path))
    }

    /// Hands on the rows so far.
    pub(crate) fn flush(&mut self) -> Result<()> {
        match &mut self.taker {
            Taker::Labels { rows, sink, .. } if rows.len() > 0 => {
                if let Some(watch) = &mut self.watch {
                    watch.after_block(&self.path)?;
                }
                sink(rows)?;
                rows.clear();
            }
            Taker::Measurements { block, sink } if !block.is_empty() => {
                sink(block)?;
                block.clear();
            }
            _ => {}
        }
        Ok(())
    }
}

/// Stands for a point beside the scanner's grid.
const NO_CELL: [u32; 2] = [u32::MAX; 2];

/// Adds a row to a block of measurements.
fn measure(block: &mut ScanBlock, row: &Row<'_>, told: &Told) {
    block.positions_m.push(row.position);
    if told.has_colors {
        block.colors.push(row.color);
    }
    if told.has_intensity {
        block.intensities.push(row.measured.intensity);
    }
    if told.has_times {
        block.times_s.push(row.measured.time_s);
    }
    if told.has_grid {
        block.cells.push(row.measured.cell.unwrap_or(NO_CELL));
    }
}

fn too_many(what: &str) -> String {
    format!("more than {MAX_TAGS} different {what}: is it the right column?")
}
