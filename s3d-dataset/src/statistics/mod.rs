//! The paper's tables of statistics, counted from a data set's files.

mod comparison;
mod latex;

use crate::context::Context;
use crate::error::Result;
use crate::options::ExportOptions;
use crate::record::data_set::DataSet;
use crate::record::tables::RoomRecord;
use s3d_io::Error as FileError;
use s3d_io::dataset::{Domain, Frame, ImageName, Layout, read_labels};
use s3d_io::fs::{open_file, read_json, write_bytes, write_json};
use s3d_label::{Class, ClassCounts, LabelTable, RoomType, Taxonomy};
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The largest part of a line that is read at once, bytes.
const LONGEST_PART: u64 = 1 << 16;

/// The tables, with an entry for each area.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Statistics {
    /// The areas, by number.
    pub areas: Vec<AreaStatistics>,
    /// The classes and room types that are counted.
    #[serde(skip)]
    pub taxonomy: Taxonomy,
    /// The images of the data set, if its options are known.
    #[serde(skip)]
    pub(crate) images: Option<ImageKinds>,
}

/// The images that a data set has.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ImageKinds {
    /// The side of views, in pixels.
    size: u32,
    domains: Vec<Domain>,
}

/// What an area holds.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct AreaStatistics {
    /// The number of the area.
    pub area: u32,
    /// The number of points in the sampled cloud.
    pub points: u64,
    /// The number of faces in the mesh.
    pub faces: u64,
    /// The number of perspective views. All modalities of a view count as one.
    pub regular_images: u64,
    /// The number of panoramas, counted the same way.
    pub panoramas: u64,
    /// The counts by label. `None` without labels.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub labels: Option<LabelStatistics>,
}

/// What an area holds, by label.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LabelStatistics {
    /// The floor of all rooms, in m².
    pub floor_m2: f64,
    /// Instances by class, rooms by type.
    #[serde(flatten)]
    pub tally: LabelTally,
    /// The same counts in S3DIS's classes and room types, for the paper's tables. `None` if the taxonomy is
    /// S3DIS's. Rooms without an S3DIS type are left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub as_s3dis: Option<LabelTally>,
}

/// Counts of instances and rooms.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct LabelTally {
    /// Instances by class.
    pub instances_per_class: BTreeMap<&'static str, u64>,
    /// Rooms by type.
    pub rooms_per_type: BTreeMap<&'static str, RoomTypeStatistics>,
}

/// The rooms of a type.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct RoomTypeStatistics {
    /// The number of rooms.
    pub rooms: u64,
    /// Their floor, in m².
    pub floor_m2: f64,
}

/// Counts what a data set in the folder `root` holds, from its files.
///
/// # Errors
/// [`Error::File`](crate::Error::File) if there is no complete data set, or a file cannot be read.
pub fn statistics(root: impl Into<PathBuf>) -> Result<Statistics> {
    let layout = &Layout::new(root.into());
    let data = DataSet::open_in(layout)?;
    let areas = &data.manifest.area_numbers;
    let folders: Vec<PathBuf> = areas.iter().map(|area| layout.area_dir(*area)).collect();

    // Images are counted but not read.
    data.files
        .require(&Context::default(), |path| folders.iter().any(|area| path.starts_with(area)))?;

    let counted = Statistics::count(layout, areas, data.taxonomy(), |path, whole| {
        if whole {
            data.files.checked(path)
        } else {
            data.files.sized(path)
        }
        .map(drop)
    })?;
    let ExportOptions { size, modalities, .. } = data.options();
    let images = Some(ImageKinds { size: *size, domains: modalities.clone() });
    Ok(Statistics { images, ..counted })
}

impl Statistics {
    /// Counts the files in the folders of these areas, with labels of a taxonomy or without. `check` may
    /// refuse a file before it is read; its flag says whether the whole file is read.
    pub(crate) fn count(
        layout: &Layout,
        areas: &[u32],
        taxonomy: Option<&Taxonomy>,
        check: impl Fn(&Path, bool) -> Result<(), FileError>,
    ) -> Result<Self> {
        let mut table = None;
        if let Some(taxonomy) = taxonomy {
            let path = layout.labels_json();
            check(&path, true)?;
            let read = taxonomy.table_from_names(&read_labels(&path)?);
            table = Some(read.map_err(|e| FileError::format(&path, e.to_string()))?);
        }

        let areas = areas
            .iter()
            .map(|n| AreaStatistics::count(layout, *n, table.as_ref(), &check));
        let taxonomy = taxonomy.cloned().unwrap_or_default();
        Ok(Self { areas: areas.collect::<Result<_>>()?, taxonomy, images: None })
    }

    /// Writes the tables as JSON and as Markdown.
    pub(crate) fn write(&self, layout: &Layout) -> Result<()> {
        write_json(&layout.statistics_json(), self)?;
        write_bytes(&layout.statistics_md(), self.to_markdown().as_bytes())?;
        Ok(())
    }

    /// Returns the tables as Markdown, with a column for each area and one for the total.
    pub fn to_markdown(&self) -> String {
        let mut text = String::from("# Statistics\n");
        let mut data: Vec<Row<'_>> = vec![
            ("points", &|a| a.points as f64),
            ("faces", &|a| a.faces as f64),
            ("regular images", &|a| a.regular_images as f64),
            ("panoramas", &|a| a.panoramas as f64),
        ];

        let is_labelled = self.areas.iter().any(|a| a.labels.is_some());
        if is_labelled {
            data.push(("floor, m²", &floor_m2));
        }

        self.table(&mut text, "Data", &data);
        if !is_labelled {
            text.push_str("\nThere are no labels.\n");
            return text;
        }

        let titles = ["Instances of each class", "Rooms of each type", "Floor of each room type, m²"];
        let own = (self.taxonomy.classes(), self.taxonomy.room_types());
        self.tally_tables(&mut text, titles, own, |labels| Some(&labels.tally));

        if !self.taxonomy.is_s3dis() {
            let titles = [
                "Instances by what they count as in S3DIS",
                "Rooms by what they count as in S3DIS",
                "Floor by what its room counts as in S3DIS, m²",
            ];
            let s3dis: (&[Class], &[RoomType]) = (&Class::S3DIS, &RoomType::S3DIS);
            self.tally_tables(&mut text, titles, s3dis, |labels| labels.as_s3dis.as_ref());
        }
        text
    }

    /// Writes the tables of instances, rooms and floor, with a row for each class or type.
    fn tally_tables(
        &self,
        text: &mut String,
        [instances, rooms, floor]: [&str; 3],
        (classes, types): (&[Class], &[RoomType]),
        tally: fn(&LabelStatistics) -> Option<&LabelTally>,
    ) {
        let of = move |a: &AreaStatistics, value: &dyn Fn(&LabelTally) -> f64| {
            a.labels.as_ref().and_then(tally).map_or(0.0, value)
        };

        let mut class_rows = Vec::new();
        for class in classes {
            let name = class.name();
            class_rows.push((name, move |a: &AreaStatistics| {
                of(a, &|tally| tally.instances_per_class[name] as f64)
            }));
        }
        self.table(text, instances, &rows_of(&class_rows));

        type Value = fn(&RoomTypeStatistics) -> f64;
        let values: [(&str, Value); 2] =
            [(rooms, |of_type| of_type.rooms as f64), (floor, |of_type| of_type.floor_m2)];
        for (title, value) in values {
            let mut type_rows = Vec::new();
            for room_type in types {
                let name = room_type.name();
                type_rows.push((name, move |a: &AreaStatistics| {
                    of(a, &|tally| value(&tally.rooms_per_type[name]))
                }));
            }
            self.table(text, title, &rows_of(&type_rows));
        }
    }

    fn table(&self, text: &mut String, title: &str, rows: &[Row<'_>]) {
        let _ = write!(text, "\n## {title}\n\n| |");
        self.areas.iter().for_each(|a| {
            let _ = write!(text, " area {} |", a.area);
        });
        let _ = writeln!(text, " total |\n|---|{}", "---:|".repeat(self.areas.len() + 1));

        for (name, value) in rows {
            let mut cells: Vec<f64> = self.areas.iter().map(value).collect();
            cells.push(cells.iter().sum());

            let digits =
                if cells.iter().copied().all(is_count) && !title.contains("m²") && !name.contains("m²") {
                    0
                } else {
                    1
                };

            let _ = write!(text, "| {name} |");
            for cell in cells {
                let _ = write!(text, " {cell:.digits$} |");
            }
            text.push('\n');
        }
    }
}

fn floor_m2(area: &AreaStatistics) -> f64 {
    area.labels.as_ref().map_or(0.0, |labels| labels.floor_m2)
}

fn is_count(cell: f64) -> bool {
    cell.fract() == 0.0
}

type Row<'a> = (&'a str, &'a dyn Fn(&AreaStatistics) -> f64);

fn rows_of<'a, F: Fn(&AreaStatistics) -> f64>(rows: &'a [(&'static str, F)]) -> Vec<Row<'a>> {
    rows.iter()
        .map(|(name, f)| (*name, f as &dyn Fn(&AreaStatistics) -> f64))
        .collect()
}

impl AreaStatistics {
    fn count(
        layout: &Layout,
        area: u32,
        table: Option<&LabelTable>,
        check: impl Fn(&Path, bool) -> Result<(), FileError>,
    ) -> Result<Self> {
        let labels = table
            .map(|table| LabelStatistics::count(layout, area, table, &check))
            .transpose()?;
        let mesh = if labels.is_some() {
            layout.semantic_obj(area)
        } else {
            layout.rgb_obj(area)
        };

        check(&layout.point_cloud(area), false)?;
        check(&mesh, true)?;
        Ok(Self {
            area,
            points: s3d_io::cloud::read_ply_point_count(&layout.point_cloud(area))?,
            faces: count_faces(&mesh)?,
            regular_images: count_images(layout, area, Frame::View(0))?,
            panoramas: count_images(layout, area, Frame::Panorama)?,
            labels,
        })
    }
}

impl LabelStatistics {
    fn count(
        layout: &Layout,
        area: u32,
        table: &LabelTable,
        check: impl Fn(&Path, bool) -> Result<(), FileError>,
    ) -> Result<Self> {
        check(&layout.rooms_json(area), true)?;
        let taxonomy = table.taxonomy();
        let classes = ClassCounts::from_table(table);

        let mut tally = LabelTally::of_none(taxonomy.classes(), taxonomy.room_types());
        let mut as_s3dis = LabelTally::of_none(&Class::S3DIS, &RoomType::S3DIS);
        for class in taxonomy.classes() {
            let count = classes.of(area, *class);
            *tally.instances_per_class.entry(class.name()).or_default() += count;
            *as_s3dis.instances_per_class.entry(class.s3dis().name()).or_default() += count;
        }

        let rooms: Vec<RoomRecord> = read_json(&layout.rooms_json(area))?;
        for record in &rooms {
            let room = taxonomy
                .room(&record.room)
                .map_err(|e| FileError::format(&layout.rooms_json(area), e.to_string()))?;
            tally.add_room(room.room_type, record.floor_m2);
            room.room_type
                .s3dis()
                .into_iter()
                .for_each(|t| as_s3dis.add_room(t, record.floor_m2));
        }

        let as_s3dis = Some(as_s3dis).filter(|_| !taxonomy.is_s3dis());
        Ok(Self { floor_m2: rooms.iter().map(|r| r.floor_m2).sum(), tally, as_s3dis })
    }
}

impl LabelTally {
    /// Returns zero for each class and type.
    fn of_none(classes: &[Class], types: &[RoomType]) -> Self {
        Self {
            instances_per_class: classes.iter().map(|class| (class.name(), 0)).collect(),
            rooms_per_type: types
                .iter()
                .map(|t| (t.name(), RoomTypeStatistics::default()))
                .collect(),
        }
    }

    fn add_room(&mut self, room_type: RoomType, floor_m2: f64) {
        let row = self.rooms_per_type.entry(room_type.name()).or_default();
        row.rooms += 1;
        row.floor_m2 += floor_m2;
    }
}

/// Returns the number of faces in an OBJ file.
fn count_faces(path: &Path) -> Result<u64> {
    let mut reader = BufReader::new(open_file(path)?);
    let mut part = Vec::new();
    let mut begins = true;
    let mut faces = 0;
    loop {
        part.clear();
        // A long line is read in parts.
        let read = reader.by_ref().take(LONGEST_PART).read_until(b'\n', &mut part);
        if read.map_err(|e| FileError::io(path, "read", e))? == 0 {
            return Ok(faces);
        }
        faces += u64::from(begins && part.starts_with(b"f "));
        begins = part.ends_with(b"\n");
    }
}

/// Returns the number of images of a kind: the largest of the modalities' numbers, since some modalities may
/// not have been asked for.
fn count_images(layout: &Layout, area: u32, frame: Frame) -> Result<u64> {
    let mut most = 0;
    for domain in Domain::ALL {
        let dir = layout.image_dir(area, frame, domain);
        match fs::read_dir(&dir) {
            Ok(entries) => {
                let names = entries.flatten().map(|entry| entry.file_name());
                let images = names.filter(|name| name.to_str().and_then(ImageName::parse).is_some());
                most = most.max(images.count() as u64);
            }
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            Err(e) => return Err(FileError::io(&dir, "read", e).into()),
        }
    }
    Ok(most)
}
