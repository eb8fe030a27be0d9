//! Writes `pointcloud.mat`: an area's points by room and object. Source: [`crate::formats`], "What is
//! written", and the README of the published data set.

#![expect(clippy::indexing_slicing, reason = "a writer: it reads only places in the file that it assigned")]

use crate::cloud::mat::hdf5::write::{Attribute, Hdf5Writer, Kind};
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use s3d_geom::glam::Vec3;
use s3d_geom::{VoxelGrid, Voxels};
use s3d_label::pretty_color;
use std::io::{Seek, Write};
use std::path::Path;

/// The fields of the structs, in the order in which MATLAB shows them.
const AREA_FIELDS: [&str; 2] = ["name", "Disjoint_Space"];
const ROOM_FIELDS: [&str; 4] = ["name", "AlignmentAngle", "color", "object"];
const OBJECT_FIELDS: [&str; 8] =
    ["name", "points", "RGB_color", "global_name", "Bbox", "Voxels", "Voxel_Occupancy", "Points_per_Voxel"];

/// The block before the HDF5 data of a MAT-file: text up to byte 116, version and byte order. MATLAB also
/// writes the time; here it is the same in every file.
fn user_block() -> [u8; 512] {
    let mut block = [0; 512];
    block[..116].fill(b' ');
    let text = b"MATLAB 7.3 MAT-file, Platform: s3d, Created on: Thu Jan 01 00:00:00 1970 HDF5 schema 1.00 .";
    block[..text.len()].copy_from_slice(text);
    block[124..128].copy_from_slice(b"\0\x02IM");
    block
}

/// Writes the `pointcloud.mat` of an area: a MAT-file of version 7.3 (HDF5) that MATLAB, h5py and others
/// read.
///
/// It holds one variable, `Area`, of nested structs. The sizes below are MATLAB's. HDF5, and so h5py, has the
/// axes in reverse: `points` is 3 × N there.
///
/// | field | class, size | |
/// |---|---|---|
/// | `Area.name` | char | "Area_1" |
/// | `Area.Disjoint_Space` | struct, 1 × rooms | the rooms, in the order in which they were written |
/// | `….name` | char | "office_1" |
/// | `….AlignmentAngle` | double, 1 × 1 | whole degrees, as in the S3DIS tree's file of angles |
/// | `….color` | double, 1 × 3 | R G B from 0 to 1, another for each room |
/// | `….object` | struct, 1 × objects | |
/// | `….object.name` | char | "chair_3": numbered per class and room, as files of the S3DIS tree |
/// | `….object.points` | single, N × 3 | x y z, metres |
/// | `….object.RGB_color` | uint8, N × 3 | 0 to 255 |
/// | `….object.global_name` | char | its label: "chair_17_office_1_1" |
/// | `….object.Bbox` | single, 1 × 6 | smallest x y z, largest x y z of `points` |
/// | `….object.Voxels` | single, 216 × 6 | the boxes of its voxels, as in `instances.json`: z fastest |
/// | `….object.Voxel_Occupancy` | uint8, 216 × 1 | 1 where a voxel holds a point |
/// | `….object.Points_per_Voxel` | cell, 216 × 1 | rows of `points` in each: uint32, n × 1, from 1 |
///
/// Box and voxels are computed from `points`. A room without objects and an object without points are left
/// out. As in MATLAB's own files, a struct array of one element holds the fields themselves, and a longer one
/// holds references to them.
///
/// Memory holds the points of one object, and 60 bytes for each written array. The file appears whole or not
/// at all, and the same input gives the same bytes.
///
/// ```
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("pointcloud.mat");
/// use s3d_geom::glam::Vec3;
///
/// let mut mat = s3d_io::cloud::MatWriter::create(&path, "Area_1")?;
/// mat.room("office_1", 45)?;
/// mat.object("chair_3", "chair_17_office_1_1")?;
/// mat.append(&[Vec3::ZERO, Vec3::ONE], &[[255, 0, 0]; 2])?;
/// mat.finish()?;
///
/// let area = s3d_io::cloud::MatArea::open(&path)?;
/// assert_eq!(area.rooms[0].objects[0].name, "chair_3");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MatWriter<W = AtomicFile> {
    hdf5: Hdf5Writer<W>,
    name: String,
    /// Objects that are known only by reference. They get names in the group `#refs#`.
    referenced: Vec<u64>,
    /// The contents of every empty voxel, once it is written.
    empty: Option<u64>,
    room_fields: Attribute,
    object_fields: Attribute,
    /// The fields of the rooms that are finished.
    rooms: Vec<[u64; 4]>,
    /// The room that is being written, with the fields of its objects.
    room: Option<(String, u32, Vec<[u64; 8]>)>,
    /// The two names of the object that is being written.
    object: Option<(String, String)>,
    positions: Vec<Vec3>,
    colors: Vec<[u8; 3]>,
}

impl MatWriter {
    /// Creates the file of an area called `name`: "Area_1".
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(path: &Path, name: &str) -> Result<Self> {
        Self::new(AtomicFile::create(path)?, path, name)
    }

    /// Ends the area, gives the file its name, and returns its size in bytes.
    ///
    /// # Errors
    /// The errors of [`MatWriter::into_inner`]. After an error there is no file.
    pub fn finish(self) -> Result<u64> {
        self.into_inner()?.commit()
    }
}

impl<W: Write + Seek> MatWriter<W> {
    /// Starts an area called `name` ("Area_1") in `file`, which must be empty. Errors call it `file_name`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn new(file: W, file_name: &Path, name: &str) -> Result<Self> {
        let mut hdf5 = Hdf5Writer::new(file, file_name, &user_block())?;
        let room_fields = hdf5.words("MATLAB_fields", &ROOM_FIELDS)?;
        let object_fields = hdf5.words("MATLAB_fields", &OBJECT_FIELDS)?;
        Ok(Self {
            hdf5,
            name: name.to_owned(),
            referenced: Vec::new(),
            empty: None,
            room_fields,
            object_fields,
            rooms: Vec::new(),
            room: None,
            object: None,
            positions: Vec::new(),
            colors: Vec::new(),
        })
    }

    /// Starts a room with its name ("office_1") and its alignment angle in whole degrees.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for the object before it, as in [`MatWriter::append`].
    pub fn room(&mut self, name: &str, alignment_deg: u32) -> Result<()> {
        self.finish_room()?;
        self.room = Some((name.to_owned(), alignment_deg, Vec::new()));
        Ok(())
    }

    /// Starts an object of the room with its name ("chair_3") and its label.
    ///
    /// # Errors
    /// The errors of [`MatWriter::room`].
    ///
    /// # Panics
    /// If no room was started.
    pub fn object(&mut self, name: &str, global_name: &str) -> Result<()> {
        assert!(self.room.is_some(), "the object {name} has no room");
        self.finish_object()?;
        self.object = Some((name.to_owned(), global_name.to_owned()));
        Ok(())
    }

    /// Appends points to the object.
    ///
    /// # Errors
    /// [`Error::Format`] for a coordinate that is not finite, and for more than 4,294,967,295 points in one
    /// object.
    ///
    /// # Panics
    /// If no object was started, or if there are not as many colours as positions.
    #[expect(clippy::panic, reason = "a caller's mistake: see Panics")]
    pub fn append(&mut self, positions: &[Vec3], colors: &[[u8; 3]]) -> Result<()> {
        let Some((name, _)) = &self.object else { panic!("points of no object") };
        assert_eq!(positions.len(), colors.len(), "{} points need as many colours", positions.len());
        if let Some(p) = positions.iter().find(|p| !p.is_finite()) {
            return Err(Error::format(
                self.hdf5.name(),
                format!("a point of {name} at {p} cannot be written"),
            ));
        }
        if u32::try_from(self.positions.len() + positions.len()).is_err() {
            let message = format!("{name} has more points than can be numbered; fewer points a m² help");
            return Err(Error::format(self.hdf5.name(), message));
        }
        self.positions.extend_from_slice(positions);
        self.colors.extend_from_slice(colors);
        Ok(())
    }

    /// Ends the area, and returns the complete file.
    ///
    /// # Errors
    /// The errors of [`MatWriter::room`].
    pub fn into_inner(mut self) -> Result<W> {
        self.finish_room()?;

        let fields = self.hdf5.words("MATLAB_fields", &AREA_FIELDS)?;
        let name = self.name.clone();
        let name = self.text(&name)?;
        let rooms = std::mem::take(&mut self.rooms);
        let room_fields = self.room_fields.clone();
        let rooms = self.structs(ROOM_FIELDS, &rooms, room_fields)?;
        let members = AREA_FIELDS.map(str::to_owned).into_iter().zip([name, rooms]);
        let area = self.hdf5.group(members, &[class("struct"), fields])?;

        let mut root = vec![("Area".to_owned(), area)];
        if !self.referenced.is_empty() {
            let referenced = self
                .referenced
                .iter()
                .enumerate()
                .map(|(i, address)| (letters(i), *address));
            root.push(("#refs#".to_owned(), self.hdf5.group(referenced, &[])?));
        }
        self.hdf5.finish(root)
    }

    fn finish_room(&mut self) -> Result<()> {
        self.finish_object()?;
        let Some((name, angle, objects)) = self.room.take() else { return Ok(()) };
        if objects.is_empty() {
            return Ok(());
        }
        let color = pretty_color(self.rooms.len() as u32 + 1).map(|c| f64::from(c) / 255.0);
        let name = self.text(&name)?;
        let angle = [f64::from(angle).to_le_bytes()];
        let angle = self
            .hdf5
            .dataset(Kind::F64, &[1, 1], &[class("double")], angle.into_iter())?;
        let color = color.into_iter().map(f64::to_le_bytes);
        let color = self.hdf5.dataset(Kind::F64, &[3, 1], &[class("double")], color)?;
        let objects = self.structs(OBJECT_FIELDS, &objects, self.object_fields.clone())?;
        self.rooms.push([name, angle, color, objects]);
        Ok(())
    }

    #[expect(clippy::expect_used, reason = "an object is only started in a room")]
    fn finish_object(&mut self) -> Result<()> {
        let Some((name, global_name)) = self.object.take() else { return Ok(()) };
        let positions = std::mem::take(&mut self.positions);
        let colors = std::mem::take(&mut self.colors);
        let Some(voxels) = Voxels::from_points(&positions) else { return Ok(()) };

        let name = self.text(&name)?;
        let global_name = self.text(&global_name)?;

        let n = positions.len() as u64;
        let points = (0..3).flat_map(|axis| positions.iter().map(move |p| p[axis].to_le_bytes()));
        let points = self.hdf5.dataset(Kind::F32, &[3, n], &[class("single")], points)?;
        let rgb = (0..3).flat_map(|channel: usize| colors.iter().map(move |c| [c[channel]]));
        let rgb = self.hdf5.dataset(Kind::Unsigned(1), &[3, n], &[class("uint8")], rgb)?;
        let [bbox, boxes, occupied, members] = self.voxels(&voxels)?;

        // The two lists keep their memory for the next object.
        self.positions = positions;
        self.colors = colors;
        self.positions.clear();
        self.colors.clear();

        let fields = [name, points, rgb, global_name, bbox, boxes, occupied, members];
        let (_, _, objects) = self.room.as_mut().expect("an object has a room");
        objects.push(fields);
        Ok(())
    }

    /// Writes an object's box, the boxes of its voxels, their occupancy and their points.
    fn voxels(&mut self, voxels: &Voxels) -> Result<[u64; 4]> {
        let single = [class("single")];
        let bbox = voxels.grid.bbox.to_array().into_iter().map(f32::to_le_bytes);
        let bbox = self.hdf5.dataset(Kind::F32, &[6, 1], &single, bbox)?;

        let boxes: Vec<[f32; 6]> = (0..VoxelGrid::CELLS)
            .map(|cell| voxels.grid.voxel_aabb(cell).to_array())
            .collect();
        let cells = VoxelGrid::CELLS as u64;
        let boxes = (0..6).flat_map(|i: usize| boxes.iter().map(move |b| b[i].to_le_bytes()));
        let boxes = self.hdf5.dataset(Kind::F32, &[6, cells], &single, boxes)?;

        let occupied = voxels.occupancy().map(|o| [u8::from(o)]).into_iter();
        let occupied = self
            .hdf5
            .dataset(Kind::Unsigned(1), &[1, cells], &[class("uint8")], occupied)?;
        let members = self.members(voxels)?;
        Ok([bbox, boxes, occupied, members])
    }

    /// Writes the cell array of each voxel's points.
    fn members(&mut self, voxels: &Voxels) -> Result<u64> {
        let mut cells = [[0; 8]; VoxelGrid::CELLS];
        for (cell, slot) in cells.iter_mut().enumerate() {
            let members = voxels.members_of(cell);
            let address = if members.is_empty() {
                self.empty_voxel()?
            } else {
                let rows = members.iter().map(|m| (m + 1).to_le_bytes());
                let dims = [1, members.len() as u64];
                let rows = self.hdf5.dataset(Kind::Unsigned(4), &dims, &[class("uint32")], rows)?;
                self.referenced.push(rows);
                rows
            };
            *slot = address.to_le_bytes();
        }

        let dims = [1, VoxelGrid::CELLS as u64];
        self.hdf5
            .dataset(Kind::Reference, &dims, &[class("cell")], cells.into_iter())
    }

    /// The contents of an empty voxel, which are written once.
    fn empty_voxel(&mut self) -> Result<u64> {
        if let Some(empty) = self.empty {
            return Ok(empty);
        }
        // MATLAB stores an array without elements as its size.
        let attributes = [class("uint32"), Attribute::flag("MATLAB_empty")];
        let size = [0u64; 2].map(u64::to_le_bytes).into_iter();
        let empty = self.hdf5.dataset(Kind::Unsigned(8), &[2], &attributes, size)?;
        self.referenced.push(empty);
        self.empty = Some(empty);
        Ok(empty)
    }

    /// Writes an array of structs, 1 × `values`.
    fn structs<const N: usize>(
        &mut self,
        names: [&str; N],
        values: &[[u64; N]],
        fields: Attribute,
    ) -> Result<u64> {
        let mut members = names.map(|name| (name.to_owned(), 0));

        match values {
            [] => {
                let size = [0u64; 2].map(u64::to_le_bytes).into_iter();
                let attributes = [class("struct"), Attribute::flag("MATLAB_empty"), fields];
                return self.hdf5.dataset(Kind::Unsigned(8), &[2], &attributes, size);
            }
            [one] => members
                .iter_mut()
                .zip(one)
                .for_each(|(member, address)| member.1 = *address),
            _ => {
                for (i, (_, member)) in members.iter_mut().enumerate() {
                    self.referenced.extend(values.iter().map(|v| v[i]));
                    let addresses = values.iter().map(|v| v[i].to_le_bytes());
                    *member =
                        self.hdf5
                            .dataset(Kind::Reference, &[values.len() as u64, 1], &[], addresses)?;
                }
            }
        }
        self.hdf5.group(members, &[class("struct"), fields])
    }

    fn text(&mut self, text: &str) -> Result<u64> {
        let units: Vec<[u8; 2]> = text.encode_utf16().map(u16::to_le_bytes).collect();
        let attributes = [class("char"), Attribute::number("MATLAB_int_decode", 2)];
        self.hdf5
            .dataset(Kind::Unsigned(2), &[units.len() as u64, 1], &attributes, units.into_iter())
    }
}

fn class(name: &str) -> Attribute {
    Attribute::text("MATLAB_class", name)
}

/// The name that MATLAB gives to object `i` of many: a, b … z, aa, ba…
fn letters(mut i: usize) -> String {
    let mut name = String::new();
    loop {
        name.push(char::from(b'a' + (i % 26) as u8));
        if i < 26 {
            return name;
        }
        i = i / 26 - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_many_are_all_different() {
        assert_eq!([0, 25, 26, 27, 701, 702].map(letters), ["a", "z", "aa", "ba", "zz", "aaa"]);
        let all: std::collections::BTreeSet<String> = (0..20_000).map(letters).collect();
        assert_eq!(all.len(), 20_000);
    }
}
