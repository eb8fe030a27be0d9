//! Reads detections: lists of boxes, or a file of mmdetection3d for each room.

use super::Bbox;
use super::truth::{Classes, Room};
use crate::error::Result;
use crate::folder::entries;
use crate::task::Task;
use s3d_dataset::s3d_io::Error as FileError;
use s3d_dataset::s3d_io::fs::read_json;
use s3d_dataset::s3d_label::Class;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error as _, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// The detections of all rooms.
pub(super) struct Predictions {
    /// For each room the score, the class and the box (world frame, metres) of its detections, in the order
    /// of the file.
    pub(super) of_rooms: Vec<Vec<(f64, Class, Bbox)>>,
    pub(super) notes: Vec<String>,
}

/// The content of a file of detections: an array or an object.
enum Content {
    List(Vec<BoxEntry>),
    Sample(Sample),
}

/// A box of a list. Other keys, such as an angle, are refused.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct BoxEntry {
    area: u32,
    room: String,
    class: String,
    score: f64,
    min: Option<[f64; 3]>,
    max: Option<[f64; 3]>,
    center: Option<[f64; 3]>,
    size: Option<[f64; 3]>,
}

/// A file that an inferencer of mmdetection3d writes for a room.
#[derive(Deserialize)]
struct Sample {
    labels_3d: Vec<usize>,
    scores_3d: Vec<f64>,
    /// The middle of the lower face, the size, and perhaps an angle.
    bboxes_3d: Vec<Vec<f64>>,
    box_type_3d: Option<String>,
}

const FORMS: &str = "detections are a JSON file with a list of boxes, a folder of such files, or a folder \
                     with mmdetection3d's Area_N_ROOM.json of every room";

impl Predictions {
    pub(super) fn read(task: &Task<'_>, classes: &Classes, rooms: &[Room]) -> Result<Self> {
        let places = rooms
            .iter()
            .enumerate()
            .map(|(i, room)| ((room.area, room.name.as_str()), i))
            .collect();
        let mut reader = Reader {
            task,
            classes,
            rooms,
            places,
            of_rooms: vec![Vec::new(); rooms.len()],
            other_areas: 0,
            other_classes: 0,
            samples: BTreeMap::new(),
        };

        let (files, others) = files(task.predictions)?;

        let mut list = None;
        for path in &files {
            task.ctx.check()?;
            match read_content(path)? {
                Content::List(entries) => {
                    list = Some(path);
                    entries
                        .into_iter()
                        .enumerate()
                        .try_for_each(|(i, entry)| reader.entry(path, i, entry))?;
                }
                Content::Sample(sample) => reader.sample(path, sample)?,
            }
        }
        reader.finish(list, &others)
    }
}

/// Returns the JSON files of predictions, and the names of the other entries of their folder.
fn files(path: &Path) -> Result<(Vec<PathBuf>, Vec<String>)> {
    if path.is_file() {
        return Ok((vec![path.to_owned()], Vec::new()));
    }
    let (mut found, mut others) = json_and_others(path)?;

    // Inferencers write into this folder below the one that they are given.
    let below = path.join("preds");
    if found.is_empty() && below.is_dir() {
        let (more, beside) = json_and_others(&below)?;
        others.retain(|other| *other != below);
        others.extend(beside);
        found = more;
    }

    if found.is_empty() {
        let pickle = others
            .iter()
            .find(|p| p.extension().is_some_and(|e| e == "pkl" || e == "pickle"));
        let fault = match pickle {
            Some(pickle) => FileError::format(
                pickle,
                format!(
                    "pickles are not read: s3d_eval::protocols has the lines that make JSON of them; {FORMS}"
                ),
            ),
            None => FileError::format(path, format!("has no JSON file: {FORMS}")),
        };
        return Err(fault.into());
    }
    let names = others
        .iter()
        .map(|p| p.strip_prefix(path).unwrap_or(p).display().to_string())
        .collect();
    Ok((found, names))
}

/// Returns the JSON files in a folder, and its other entries.
fn json_and_others(dir: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>)> {
    Ok(entries(dir)?
        .into_iter()
        .partition(|p| p.extension().is_some_and(|e| e == "json") && p.is_file()))
}

fn read_content(path: &Path) -> Result<Content> {
    read_json(path).map_err(|error| match error {
        FileError::Format { path, place, message } => {
            FileError::Format { path, place, message: format!("{message}; {FORMS}") }.into()
        }
        error => error.into(),
    })
}

impl<'de> Deserialize<'de> for Content {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(ContentVisitor)
    }
}

struct ContentVisitor;

impl<'de> Visitor<'de> for ContentVisitor {
    type Value = Content;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a list of boxes or the boxes of a room")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Content, A::Error> {
        let mut entries = Vec::new();
        let of_box = |count: usize, e| A::Error::custom(format_args!("box {}: {e}", count + 1));
        while let Some(entry) = seq.next_element().map_err(|e| of_box(entries.len(), e))? {
            entries.push(entry);
        }
        Ok(Content::List(entries))
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Content, A::Error> {
        Sample::deserialize(MapAccessDeserializer::new(map)).map(Content::Sample)
    }
}

/// Returns the error for a box of a file, whose index counts from 0.
fn fault(path: &Path, index: usize, message: &str) -> FileError {
    FileError::format(path, format!("box {}: {message}", index + 1))
}

struct Reader<'a> {
    task: &'a Task<'a>,
    classes: &'a Classes,
    rooms: &'a [Room],
    places: BTreeMap<(u32, &'a str), usize>,
    of_rooms: Vec<Vec<(f64, Class, Bbox)>>,
    /// The number of boxes in areas that are not tested.
    other_areas: u64,
    /// The number of boxes of classes that are not evaluated.
    other_classes: u64,
    /// The rooms that have a file of their own.
    samples: BTreeMap<usize, PathBuf>,
}

impl Reader<'_> {
    /// Returns the index of a room; `None` if its area is not tested.
    fn place(&self, area: u32, room: &str) -> Result<Option<usize>, String> {
        if let Some(place) = self.places.get(&(area, room)) {
            return Ok(Some(*place));
        }
        if self.task.folds.iter().any(|fold| fold.areas.contains(&area)) {
            return Err(format!("the data set has no room {room:?} with annotations in area {area}"));
        }
        if !self.task.data.areas().contains(&area) {
            return Err(format!("the data set has no area {area}"));
        }
        Ok(None)
    }

    /// Adds a box of a list.
    fn entry(&mut self, path: &Path, index: usize, entry: BoxEntry) -> Result<()> {
        let wrong = |message: &str| fault(path, index, message);
        let Some(place) = self.place(entry.area, &entry.room).map_err(|e| wrong(&e))? else {
            self.other_areas += 1;
            return Ok(());
        };
        let class = self.classes.named(&entry.class).map_err(|e| wrong(&e))?;

        let (min, max) = match (entry.min, entry.max, entry.center, entry.size) {
            (Some(min), Some(max), None, None) => (min, max),
            (None, None, Some(center), Some(size)) => {
                let end = |sign: f64| std::array::from_fn(|k| center[k] + sign * size[k] / 2.0);
                (end(-1.0), end(1.0))
            }
            _ => return Err(wrong("a box has min and max, or center and size, each x y z in metres").into()),
        };
        if (0..3).any(|k| min[k] > max[k]) {
            return Err(wrong(&format!("it ends before it begins: {min:?} to {max:?}")).into());
        }
        self.add(place, entry.score, class, [min[0], min[1], min[2], max[0], max[1], max[2]]);
        Ok(())
    }

    fn add(&mut self, place: usize, score: f64, class: Class, bbox: Bbox) {
        if self.classes.list.contains(&class) {
            self.of_rooms[place].push((score, class, bbox));
        } else {
            self.other_classes += 1;
        }
    }

    /// Adds the boxes of a room. They are in the frame of the room, whose points have least coordinates of 0.
    fn sample(&mut self, path: &Path, sample: Sample) -> Result<()> {
        let file = |message: String| FileError::format(path, message);
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let name = stem.strip_prefix("Area_").and_then(|rest| rest.split_once('_'));
        let Some((area, room)) = name.and_then(|(area, room)| Some((area.parse().ok()?, room))) else {
            let message = "a room's file is called Area_N_ROOM.json, as Area_5_office_1.json";
            return Err(file(message.to_owned()).into());
        };
        if let Some(kind) = sample.box_type_3d.filter(|kind| kind != "Depth") {
            let message = format!("box_type_3d is {kind:?}: only boxes of type \"Depth\" have z upwards");
            return Err(file(message).into());
        }

        let counts = [sample.labels_3d.len(), sample.scores_3d.len(), sample.bboxes_3d.len()];
        if counts != [counts[0]; 3] {
            let message = format!("has {counts:?} labels_3d, scores_3d, bboxes_3d: as many of each");
            return Err(file(message).into());
        }
        let Some(place) = self.place(area, room).map_err(file)? else {
            self.other_areas += counts[0] as u64;
            return Ok(());
        };

        self.samples.insert(place, path.to_owned());
        let Some(corner) = self.rooms[place].corner else {
            let message = "the data set does not tell the least corner of this room's points, in whose frame \
                           the boxes are: it has none, or was made by an earlier version";
            return Err(file(message.to_owned()).into());
        };
        let rows = sample.labels_3d.into_iter().zip(sample.scores_3d).zip(sample.bboxes_3d);
        for (i, ((label, score), row)) in rows.enumerate() {
            let Some(class) = self.classes.list.get(label).copied() else {
                let message = format!(
                    "label {label}, but there are {} classes: labels count {}; name the classes of the \
                     training, in its order",
                    self.classes.list.len(),
                    self.classes.names()
                );
                return Err(fault(path, i, &message).into());
            };
            let bbox = box_of_row(&row, corner).map_err(|message| fault(path, i, &message))?;
            self.add(place, score, class, bbox);
        }
        Ok(())
    }

    /// Checks that a file of each room was read, if rooms have files, and makes the notes.
    fn finish(self, list: Option<&PathBuf>, others: &[String]) -> Result<Predictions> {
        if let Some(sample) = self.samples.values().next() {
            self.check_samples(sample, list)?;
        }

        let mut notes = Vec::new();
        if self.other_areas > 0 {
            notes.push(format!("{} detections are of areas that are not tested.", self.other_areas));
        }
        if self.other_classes > 0 {
            notes.push(format!("{} detections are of classes that are not evaluated.", self.other_classes));
        }
        if !others.is_empty() {
            let names = others.iter().take(5).map(String::as_str).collect::<Vec<_>>().join(", ");
            notes.push(format!("{} other files were passed over, as {names}.", others.len()));
        }
        Ok(Predictions { of_rooms: self.of_rooms, notes })
    }

    /// Refuses a list beside files of rooms, and rooms without a file. `sample` is one of the files.
    fn check_samples(&self, sample: &Path, list: Option<&PathBuf>) -> Result<()> {
        if let Some(list) = list {
            let message = "is a list of boxes, and other files are mmdetection3d's: leave those of one kind";
            return Err(FileError::format(list, message).into());
        }
        let missing: Vec<String> = (self.rooms.iter().enumerate())
            .filter(|(i, room)| room.corner.is_some() && !self.samples.contains_key(i))
            .map(|(_, room)| format!("Area_{}_{}.json", room.area, room.name))
            .collect();
        let Some(first) = missing.first() else { return Ok(()) };
        let message = format!(
            "missing, as are {} of {} rooms: a room in which nothing was found has a file with empty lists",
            missing.len(),
            self.rooms.len()
        );
        Err(FileError::format(&sample.with_file_name(first), message).into())
    }
}

/// Returns the box of a row of `bboxes_3d` in the world. `corner` has the least coordinates of the room's
/// points.
fn box_of_row(row: &[f64], corner: [f64; 3]) -> Result<Bbox, String> {
    let (x, y, z, size) = match *row {
        [x, y, z, dx, dy, dz] | [x, y, z, dx, dy, dz, 0.0] => (x, y, z, [dx, dy, dz]),
        [_, _, _, _, _, _, _] => {
            return Err("it is turned: only boxes along the axes are evaluated".to_owned());
        }
        _ => return Err(format!("has {} numbers instead of 7", row.len())),
    };
    if size.iter().any(|v| *v < 0.0) {
        return Err(format!("its size is negative: {size:?}"));
    }
    let [a, b, c] = [x - size[0] / 2.0 + corner[0], y - size[1] / 2.0 + corner[1], z + corner[2]];
    Ok([a, b, c, a + size[0], b + size[1], c + size[2]])
}
