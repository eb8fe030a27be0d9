//! Reads `pointcloud.mat`, as MATLAB saved the published files and as [`MatWriter`](crate::cloud::MatWriter)
//! writes them.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::annotations::Skipped;
use crate::cloud::mat::hdf5::file::{Dataset, Hdf5File, Kind};
use crate::cloud::mat::hdf5::read::Object;
use crate::cloud::on_fault::OnFault;
use crate::error::{Error, Result};
use crate::fs::source::Source;
use s3d_geom::PointCloud;
use s3d_geom::glam::DVec3;
use std::collections::BTreeMap;
use std::io::{Read, Seek};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The deepest nesting of cells in cells, and of references to references.
const MAX_DEPTH: usize = 8;
/// The most characters of a name.
const LONGEST_NAME: u64 = 4096;

/// The names in a `pointcloud.mat`, and where its points are.
///
/// The file is a MAT-file of version 7.3 with a variable `Area`, as [`MatWriter`](crate::cloud::MatWriter)
/// describes it. The variable may have another name if no other one has a field `Disjoint_Space`. An area
/// needs only `Disjoint_Space`, a room `name` and `object`, and an object `name` and `points`; there may be
/// other fields. Struct arrays may be cells of structs, names may be in cells, and numbers may be of any
/// class. `points` and `RGB_color` may be 3 × N instead of N × 3.
#[derive(Clone, Debug)]
pub struct MatArea {
    /// The area's name: "Area_1". `None` if the file has none.
    pub name: Option<String>,
    /// The rooms, in the order of the file.
    pub rooms: Vec<MatRoom>,
}

/// A room (the files call it a disjoint space).
#[derive(Clone, Debug)]
pub struct MatRoom {
    /// Its name: "office_1".
    pub name: String,
    /// The angle in degrees by which it is turned about Z to bring its walls parallel to the axes.
    pub alignment_deg: Option<f64>,
    /// Its objects, in the order of the file.
    pub objects: Vec<MatObject>,
}

/// An annotated object, whose points are in the file.
#[derive(Clone, Debug)]
pub struct MatObject {
    /// Its name: "chair_3".
    pub name: String,
    /// Its label: "chair_17_office_1_1". `None` if the file has none.
    pub global_name: Option<String>,
    /// The number of its points.
    pub len: u64,
    file: Arc<MatFile>,
    /// Address of the array of positions.
    points: u64,
    /// Address of the array of colours.
    colors: Option<u64>,
    /// Its name in messages: "office_1, chair_3".
    part: String,
}

#[derive(Debug)]
struct MatFile {
    path: PathBuf,
    hdf5: Hdf5File,
}

/// The fields of a struct: names, and addresses of objects.
type Fields = BTreeMap<String, u64>;

impl MatArea {
    /// Reads the names in a file, and where its points are.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Unsupported`] for forms of HDF5 that MATLAB does not write; [`Error::Format`]
    /// if the file is no MAT-file of version 7.3, is cut off or damaged, or lacks one of the structs or their
    /// fields, which the message names.
    pub fn open(path: &Path) -> Result<Self> {
        Self::read(&Source::file(path))
    }

    /// Reads like [`MatArea::open`], from a reader of the file's bytes. Errors call the file `name`.
    ///
    /// # Errors
    /// The errors of [`MatArea::open`].
    pub fn new(reader: impl Read + Seek + Send + 'static, name: &Path) -> Result<Self> {
        Self::read(&Source::reader(name, reader))
    }

    pub(crate) fn read(source: &Source) -> Result<Self> {
        let file = Arc::new(MatFile { path: source.name().to_owned(), hdf5: Hdf5File::open(source)? });
        let area = file.area()?;
        let name = area.get("name").map(|name| file.text(*name, "Area.name")).transpose()?;

        let mut rooms = Vec::new();
        let place = "Area.Disjoint_Space";
        for (i, fields) in (1..).zip(file.structs(field(&file, &area, "Disjoint_Space", "Area")?, place)?) {
            rooms.push(file.room(&fields, &format!("{place}({i})"))?);
        }
        Ok(Self { name, rooms })
    }
}

impl MatObject {
    /// Appends the object's [`MatObject::len`] points to `out`, in world metres, with a colour each (black if
    /// the file has none).
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the arrays are damaged, and for a coordinate that is not finite or
    /// a colour beyond 0 to 255, with the number of the point. After an error, `out` may hold the points
    /// before it.
    ///
    /// # Panics
    /// If `out` has points without colours or with faces.
    pub fn read(&self, out: &mut PointCloud) -> Result<()> {
        self.read_with(DVec3::ZERO, OnFault::Stop, out)?;
        Ok(())
    }

    /// Reads like [`MatObject::read`]. Subtracts `offset_m` before positions become `f32`, and skips invalid
    /// points or stops at them.
    pub(crate) fn read_with(
        &self,
        offset_m: DVec3,
        on_fault: OnFault,
        out: &mut PointCloud,
    ) -> Result<Skipped> {
        assert!(out.colors.len() == out.len() && out.faces.is_empty(), "a cloud of other columns");
        let mut skipped = Skipped::default();
        if self.len == 0 {
            return Ok(skipped);
        }

        let place = |what| format!("{}, {what}", self.part);
        let positions = self.file.triples(self.points, &place("points"))?;
        let colors = self
            .colors
            .map(|at| self.file.triples(at, &place("RGB_color")))
            .transpose()?;

        let n = positions.len();
        let counts = [Some(n), colors.as_ref().map(Triples::len)];
        if let Some(other) = counts.into_iter().flatten().find(|count| *count as u64 != self.len) {
            return Err(self.fault(format!(
                "{}: has {} points and {other} colours, or it changed while it was read",
                self.part, self.len
            )));
        }

        out.positions.reserve(n);
        out.colors.reserve(n);
        for i in 0..n {
            #[expect(clippy::arithmetic_side_effects, reason = "floating point")]
            let point = DVec3::from_array(positions.row(i)) - offset_m;
            let color = colors.as_ref().map_or([0.0; 3], |c| c.row(i));
            let position = point.as_vec3();
            if position.is_finite() && color.iter().all(|c| (0.0..=255.0).contains(c)) {
                out.positions.push(position);
                #[expect(clippy::cast_possible_truncation, reason = "checked above: 0 to 255")]
                out.colors.push(color.map(|c| c.round() as u8));
                continue;
            }

            let wrong = if position.is_finite() {
                format!("has the colour {color:?}, which is not from 0 to 255")
            } else {
                format!("lies at {point}, which is not finite")
            };
            let error = self.fault(format!("{}: point {} {wrong}", self.part, i.saturating_add(1)));
            if on_fault == OnFault::Stop {
                return Err(error);
            }
            skipped.count = skipped.count.saturating_add(1);
            skipped.first.get_or_insert(error);
        }
        Ok(skipped)
    }

    /// The path of the file.
    pub(crate) fn path(&self) -> &Path {
        &self.file.path
    }

    /// The object's name in messages: "office_1, chair_3".
    pub(crate) fn part(&self) -> &str {
        &self.part
    }

    fn fault(&self, message: String) -> Error {
        self.file.hdf5.fault(message)
    }
}

impl MatFile {
    /// Finds the struct of the area.
    fn area(&self) -> Result<Fields> {
        let variables = self.hdf5.members(&self.hdf5.root()?)?.unwrap_or_default();
        let mut found = None;
        for (name, address) in &variables {
            if name.starts_with('#') {
                continue;
            }
            let is_group = self.hdf5.members(&self.hdf5.object(*address)?)?;
            if is_group.is_some_and(|m| m.iter().any(|(name, _)| name == "Disjoint_Space")) {
                found = Some(*address);
                if name == "Area" {
                    break;
                }
            }
        }

        let Some(address) = found else {
            let names: Vec<&str> = variables.iter().map(|(name, _)| name.as_str()).take(8).collect();
            return Err(self.hdf5.fault(format!(
                "has no variable Area with a field Disjoint_Space, but {names:?}: is it the pointcloud.mat \
                 of an area?"
            )));
        };

        let mut areas = self.structs(address, "Area")?;
        let count = areas.len();
        match areas.pop().filter(|_| count == 1) {
            Some(area) => Ok(area),
            None => Err(self
                .hdf5
                .fault(format!("holds {count} areas: save each in a file of its own"))),
        }
    }

    fn room(self: &Arc<Self>, fields: &Fields, place: &str) -> Result<MatRoom> {
        let name = self.text(field(self, fields, "name", place)?, &format!("{place}.name"))?;
        let alignment_deg = match fields.get("AlignmentAngle") {
            Some(angle) => self.number(*angle)?,
            None => None,
        };

        let within = format!("{place}.object");
        let mut objects = Vec::new();
        for (i, object) in (1..).zip(self.structs(field(self, fields, "object", place)?, &within)?) {
            objects.push(self.object(&object, &name, &format!("{within}({i})"))?);
        }
        Ok(MatRoom { name, alignment_deg, objects })
    }

    fn object(self: &Arc<Self>, fields: &Fields, room: &str, place: &str) -> Result<MatObject> {
        let name = self.text(field(self, fields, "name", place)?, &format!("{place}.name"))?;
        let global_name = match fields.get("global_name") {
            Some(global) => Some(self.text(*global, &format!("{place}.global_name"))?),
            None => None,
        };

        let points = field(self, fields, "points", place)?;
        let object = self.hdf5.object(points)?;
        let len = match self.array(&object, &format!("{place}.points"))? {
            Some(array) => axes_of_triples(&array.dims).map(|(n, _)| n).ok_or_else(|| {
                self.hdf5
                    .fault(format!("{place}.points: is {}, and not N x 3", size(&array.dims)))
            })?,
            None => 0,
        };

        let colors = fields.get("RGB_color").copied();
        let part = format!("{room}, {name}");
        Ok(MatObject { name, global_name, len, file: self.clone(), points, colors, part })
    }

    /// The structs of a struct array, of a single struct or of cells of structs.
    fn structs(&self, address: u64, place: &str) -> Result<Vec<Fields>> {
        let mut found = Vec::new();
        // In a sound file, every struct and every cell has a header of its own.
        let mut left = self.hdf5.len() / 16;
        self.push_structs(address, place, MAX_DEPTH, &mut left, &mut found)?;
        Ok(found)
    }

    fn push_structs(
        &self,
        address: u64,
        place: &str,
        depth: usize,
        left: &mut u64,
        found: &mut Vec<Fields>,
    ) -> Result<()> {
        if depth == 0 || *left == 0 {
            return Err(self.hdf5.fault(format!(
                "{place}: refers to itself, or has more structs than the file has room for"
            )));
        }
        *left = left.saturating_sub(1);

        let object = self.hdf5.object(address)?;
        if object.header.is_set("MATLAB_empty") {
            return Ok(());
        }

        let Some(members) = self.hdf5.members(&object)? else {
            let Some(references) = self.references(&object)? else {
                return Err(self.hdf5.fault(format!("{place}: is no struct")));
            };
            let below = depth.saturating_sub(1);
            return references
                .into_iter()
                .try_for_each(|at| self.push_structs(at, place, below, left, found));
        };

        // In an array of structs, each field is a list of references with an entry for each struct.
        let mut columns = Vec::new();
        for (name, address) in &members {
            let member = self.hdf5.object(*address)?;
            let is_cell = member.header.text("MATLAB_class") == Some("cell");
            match self.references(&member)?.filter(|_| !is_cell) {
                Some(references) => columns.push((name, references)),
                None => {
                    found.push(members.into_iter().collect());
                    return Ok(());
                }
            }
        }

        let n = columns.first().map_or(0, |(_, references)| references.len());
        if let Some((name, other)) = columns.iter().find(|(_, references)| references.len() != n) {
            let message = format!("{place}: has {n} elements, but {} in its field {name}", other.len());
            return Err(self.hdf5.fault(message));
        }

        for i in 0..n {
            let fields = columns
                .iter()
                .filter_map(|(name, references)| Some(((*name).clone(), *references.get(i)?)));
            found.push(fields.collect());
        }
        Ok(())
    }

    /// The references of an array. Returns `None` if the object is something else.
    fn references(&self, object: &Object) -> Result<Option<Vec<u64>>> {
        match object.header.dataset() {
            Some(array) if array.kind == Kind::Reference => {
                let data = self.hdf5.data(&array)?;
                let addresses = data.chunks_exact(8).map(|address| bits(address, false));
                Ok(Some(addresses.collect()))
            }
            _ => Ok(None),
        }
    }

    /// Takes an object as an array. Returns `None` if the array is empty.
    fn array(&self, object: &Object, place: &str) -> Result<Option<Dataset>> {
        let Some(array) = object.header.dataset() else {
            return Err(self.hdf5.fault(format!("{place}: is no array")));
        };
        let is_empty = object.header.is_set("MATLAB_empty") || array.dims.contains(&0);
        Ok((!is_empty).then_some(array))
    }

    /// Reads the text of an array of characters, which may be in a cell.
    fn text(&self, address: u64, place: &str) -> Result<String> {
        let mut address = address;
        for _ in 0..MAX_DEPTH {
            let object = self.hdf5.object(address)?;
            if let Some(&[one]) = self.references(&object)?.as_deref() {
                address = one;
                continue;
            }

            let Some(array) = self.array(&object, place)? else { return Ok(String::new()) };
            let length = array.dims.iter().try_fold(1u64, |n, d| n.checked_mul(*d));
            let is_short =
                length.is_some_and(|n| n <= LONGEST_NAME) && array.kind.size() as u64 <= LONGEST_NAME;
            if !is_short {
                return Err(self
                    .hdf5
                    .fault(format!("{place}: is {}, too long for a name", size(&array.dims))));
            }
            let data = self.hdf5.data(&array)?;
            let Some(text) = characters(array.kind, data) else { break };
            return Ok(text.trim_matches(|c: char| c == '\0' || c.is_whitespace()).to_owned());
        }
        Err(self.hdf5.fault(format!("{place}: is no text")))
    }

    /// Reads the number of an array with one element. Returns `None` if the object is something else.
    fn number(&self, address: u64) -> Result<Option<f64>> {
        let object = self.hdf5.object(address)?;
        let Some(array) = object.header.dataset().filter(|a| a.dims.iter().all(|d| *d == 1)) else {
            return Ok(None);
        };
        if !matches!(array.kind, Kind::Integer { .. } | Kind::Float { .. }) {
            return Ok(None);
        }
        Ok(Some(number(array.kind, &self.hdf5.data(&array)?)))
    }

    /// Reads an array of rows of three numbers.
    fn triples(&self, address: u64, place: &str) -> Result<Triples> {
        let object = self.hdf5.object(address)?;
        let Some(array) = self.array(&object, place)? else {
            return Ok(Triples { data: Vec::new(), kind: Kind::Other { size: 1 }, n: 0, is_by_column: true });
        };
        if !matches!(array.kind, Kind::Integer { .. } | Kind::Float { .. }) {
            return Err(self.hdf5.fault(format!("{place}: does not hold real numbers")));
        }
        let axes = axes_of_triples(&array.dims).and_then(|(n, by)| Some((usize::try_from(n).ok()?, by)));
        let Some((n, is_by_column)) = axes else {
            return Err(self
                .hdf5
                .fault(format!("{place}: is {}, and not N x 3", size(&array.dims))));
        };

        let data = self.hdf5.data(&array)?;
        Ok(Triples { data, kind: array.kind, n, is_by_column })
    }
}

/// N rows of three numbers.
struct Triples {
    data: Vec<u8>,
    kind: Kind,
    n: usize,
    /// Whether all first numbers come before all second numbers and so on, as MATLAB stores N × 3.
    is_by_column: bool,
}

impl Triples {
    fn len(&self) -> usize {
        self.n
    }

    /// The numbers of a row. Missing numbers are NaN.
    fn row(&self, row: usize) -> [f64; 3] {
        let size = self.kind.size();
        let number = |column: usize| {
            let element = if self.is_by_column {
                column.checked_mul(self.n)?.checked_add(row)?
            } else {
                row.checked_mul(3)?.checked_add(column)?
            };
            let bytes = self.data.get(element.checked_mul(size)?..)?.get(..size)?;
            Some(number(self.kind, bytes))
        };
        [0, 1, 2].map(|column| number(column).unwrap_or(f64::NAN))
    }
}

/// The number of triples in an array with these extents (in HDF5's order), and whether they are stored by
/// column.
fn axes_of_triples(dims: &[u64]) -> Option<(u64, bool)> {
    match *dims {
        [3, n] => Some((n, true)),
        [n, 3] => Some((n, false)),
        _ => None,
    }
}

/// The extents of an array as MATLAB shows them.
fn size(dims: &[u64]) -> String {
    let dims: Vec<String> = dims.iter().rev().map(u64::to_string).collect();
    if dims.is_empty() {
        "a single value".to_owned()
    } else {
        dims.join(" x ")
    }
}

/// The address of a field that a struct must have.
fn field(file: &MatFile, fields: &Fields, name: &str, place: &str) -> Result<u64> {
    fields.get(name).copied().ok_or_else(|| {
        let there: Vec<&str> = fields.keys().map(String::as_str).take(12).collect();
        file.hdf5.fault(format!("{place}: has no field {name}, but {there:?}"))
    })
}

/// Decodes the text of an array of characters. Returns `None` if it is no text.
fn characters(kind: Kind, data: Vec<u8>) -> Option<String> {
    match kind {
        Kind::Integer { size: 1, .. } | Kind::Text { .. } => String::from_utf8(data).ok(),
        Kind::Integer { size: 2, big_endian, .. } => {
            let unit = if big_endian {
                u16::from_be_bytes
            } else {
                u16::from_le_bytes
            };
            let units: Vec<u16> = data.as_chunks().0.iter().map(|b| unit(*b)).collect();
            String::from_utf16(&units).ok()
        }
        Kind::Integer { size, big_endian, .. } if size > 0 => {
            let codes = data.chunks_exact(size).map(|b| bits(b, big_endian));
            codes
                .map(|code| u32::try_from(code).ok().and_then(char::from_u32))
                .collect()
        }
        _ => None,
    }
}

/// An element as a number, or NaN if it is none.
fn number(kind: Kind, bytes: &[u8]) -> f64 {
    match kind {
        Kind::Integer { signed: false, big_endian, .. } => bits(bytes, big_endian) as f64,
        Kind::Integer { big_endian, .. } => {
            let highest = if big_endian { bytes.first() } else { bytes.last() };
            let is_negative = highest.is_some_and(|b| b & 0x80 != 0);
            // A negative number has all higher bits set.
            let start = if is_negative { u64::MAX } else { 0 };
            bits_behind(start, bytes, big_endian).cast_signed() as f64
        }
        Kind::Float { big_endian, .. } => match <[u8; 4]>::try_from(bytes) {
            Ok(bytes) if big_endian => f64::from(f32::from_be_bytes(bytes)),
            Ok(bytes) => f64::from(f32::from_le_bytes(bytes)),
            Err(_) => f64::from_bits(bits(bytes, big_endian)),
        },
        _ => f64::NAN,
    }
}

/// The number in up to eight bytes.
fn bits(bytes: &[u8], big_endian: bool) -> u64 {
    bits_behind(0, bytes, big_endian)
}

/// Continues the number `start` with the bytes of another.
fn bits_behind(start: u64, bytes: &[u8], big_endian: bool) -> u64 {
    if big_endian {
        bytes.iter().fold(start, push_byte)
    } else {
        bytes.iter().rev().fold(start, push_byte)
    }
}

fn push_byte(number: u64, byte: &u8) -> u64 {
    number << 8 | u64::from(*byte)
}
