//! The `.house` file of Matterport3D: the regions of a house, its panoramas and pictures, and the objects
//! that the segments of its mesh belong to.
//!
//! A line is a record, and its first letter says of what kind. Records name earlier ones by their place among
//! the records of their kind, from 0. Sources: niessner/Matterport, data_organization.md
//! ("house_segmentations") and code/gaps/apps/mpview/mp.cpp (`ReadAsciiFile`).

mod fields;
#[cfg(test)]
pub(crate) mod tests;

use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use crate::fs::quote::quote;
use fields::Fields;
use s3d_geom::Pose;
use s3d_geom::glam::DVec3;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// The ending of the files.
pub(crate) const ENDING: &str = "house";

/// The camera of the scanner that looks level.
const LEVEL: i64 = 1;

/// How far the last row of a matrix may be off.
const LAST_ROW_ERROR: f64 = 1e-3;

/// What is read of a house.
#[derive(Debug, Default)]
pub(crate) struct House {
    pub(crate) regions: Vec<Region>,
    pub(crate) panoramas: Vec<Panorama>,
    pub(crate) categories: Vec<Category>,
    pub(crate) objects: Vec<Object>,
    /// For each segment, by its number in `material_id` of the mesh, its place among the objects, if it
    /// belongs to one.
    pub(crate) segments: HashMap<i64, Option<usize>>,
}

/// A room, or a part of the house that is like one.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Region {
    /// The letter of its kind, and its number among the regions of this letter, from 1: `b_2`.
    pub(crate) room: String,
}

/// A place where the scanner stood.
#[derive(Debug)]
pub(crate) struct Panorama {
    /// The uuid, or another name.
    pub(crate) name: String,
    /// The place of the first picture: in the data set, of the camera that looks up.
    pub(crate) place: DVec3,
    /// The poses of the level camera, each with its stop.
    pub(crate) level: Vec<(i64, Pose)>,
    /// Whether pictures of any camera belong to it.
    pub(crate) has_pictures: bool,
    /// Its line, from 1.
    pub(crate) line: u64,
}

/// A class of objects.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Category {
    /// Its number in `category_mapping.tsv`, as `category_id` of meshes has it.
    pub(crate) mapping: i64,
    /// The word of mpcat40, or else of the annotators.
    pub(crate) word: Option<String>,
}

/// An object.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Object {
    /// Its place among the regions.
    pub(crate) region: Option<usize>,
    /// Its place among the categories.
    pub(crate) category: Option<usize>,
}

impl House {
    /// Reads a file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`], with the line for a record that is damaged, out of its place, there
    /// twice, or names one that is not there, and for a number of records that is not as the head says;
    /// [`Error::Unsupported`] for another version.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        Self::parse(&read_file(path)?, path)
    }

    /// Reads like [`House::read`], from the file's bytes. Errors call the file `path`.
    pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Self> {
        let text = text_of(bytes, path)?;
        let mut lines = (1..).zip(text.split(|byte| *byte == b'\n'));
        check_version(lines.next().map_or(&[][..], |(_, first)| first), path)?;

        let mut reader = Reader::default();
        for (line, written) in lines {
            let fields = Fields::of(written);
            if !fields.is_empty() {
                reader
                    .add(&fields, line)
                    .map_err(|message| Error::line(path, line, message))?;
            }
        }
        reader.finish(path)
    }
}

/// Returns whether a path has the ending of these files.
pub(crate) fn is_house(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case(ENDING))
}

/// Refuses a first line other than `ASCII 1.1`.
fn check_version(first: &[u8], path: &Path) -> Result<()> {
    let fields = Fields::of(first);
    match (fields.word(0, ""), fields.word(1, "")) {
        (Ok("ASCII"), Ok("1.1")) => Ok(()),
        (Ok("ASCII"), Ok(version)) => {
            let version = quote(version.as_bytes());
            let message = format!("is a house of version {version}; 1.1, which has objects, is read");
            Err(Error::unsupported(path, message))
        }
        _ => {
            let shown = quote(first.trim_ascii());
            Err(Error::line(path, 1, format!("{shown}: a house of Matterport3D begins with ASCII 1.1")))
        }
    }
}

/// A kind of records, in the order of the numbers in the head.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Image,
    Panorama,
    Vertex,
    Surface,
    Segment,
    Object,
    Category,
    Region,
    Portal,
    Level,
}

/// The kinds with their letters and nouns. The number says how many fields mean something: zeros that may be
/// ignored follow.
const KINDS: [(Kind, &str, &str, usize); 10] = [
    (Kind::Image, "I", "image", 36),
    (Kind::Panorama, "P", "panorama", 8),
    (Kind::Vertex, "V", "vertex", 10),
    (Kind::Surface, "S", "surface", 17),
    (Kind::Segment, "E", "segment", 14),
    (Kind::Object, "O", "object", 16),
    (Kind::Category, "C", "category", 6),
    (Kind::Region, "R", "region", 16),
    (Kind::Portal, "P", "portal", 11),
    (Kind::Level, "L", "level", 13),
];

impl Kind {
    /// Returns the noun and the number of fields that mean something.
    fn details(self) -> (&'static str, usize) {
        let found = KINDS.iter().find(|(kind, ..)| *kind == self);
        found.map_or(("record", 0), |(_, _, noun, fields)| (noun, *fields))
    }
}

/// The first line after the version, with the numbers of records.
struct Head {
    counts: [usize; 10],
    line: u64,
}

/// What a house holds so far.
#[derive(Default)]
struct Reader {
    house: House,
    head: Option<Head>,
    counts: [usize; 10],
    /// How many regions have a letter.
    letters: HashMap<char, u32>,
    /// The names of panoramas, in lower case.
    names: HashSet<String>,
    /// The panorama, camera and stop of each picture.
    pictures: HashSet<(Option<usize>, i64, i64)>,
}

/// A result whose error is a sentence about a line.
type Outcome<T> = std::result::Result<T, String>;

impl Reader {
    fn add(&mut self, fields: &Fields<'_>, line: u64) -> Outcome<()> {
        let letter = fields.word(0, "letter")?;
        if letter == "H" {
            return self.add_head(fields, line);
        }
        let Some(head) = &self.head else { return Err("stands before the line H".into()) };

        // Portals and panoramas have one letter. Portals come first, and the head tells their number.
        let portals = count_of(&head.counts, Kind::Portal);
        let of_letter = KINDS.iter().find(|(kind, of_kind, ..)| match kind {
            Kind::Panorama if self.count(Kind::Portal) < portals => false,
            _ => *of_kind == letter,
        });
        let Some((kind, ..)) = of_letter else {
            return Err(format!("{}: no record has this letter", quote(letter.as_bytes())));
        };
        self.add_record(*kind, fields, line)?;
        if let Some(count) = self.counts.get_mut(*kind as usize) {
            *count += 1;
        }
        Ok(())
    }

    fn add_head(&mut self, fields: &Fields<'_>, line: u64) -> Outcome<()> {
        if let Some(head) = &self.head {
            return Err(format!("is a second line H: the first is line {}", head.line));
        }
        let mut counts = [0; 10];
        for ((count, place), (_, _, noun, _)) in counts.iter_mut().zip(3..).zip(KINDS) {
            let number = fields.whole(place, noun)?;
            *count = usize::try_from(number).map_err(|_| format!("{number} is no number of records"))?;
        }
        self.head = Some(Head { counts, line });
        Ok(())
    }

    fn add_record(&mut self, kind: Kind, fields: &Fields<'_>, line: u64) -> Outcome<()> {
        let (noun, needed) = kind.details();
        if fields.len() < needed {
            return Err(format!("has {} fields, and a record of this kind ({noun}) {needed}", fields.len()));
        }
        let place = fields.whole(if kind == Kind::Panorama { 2 } else { 1 }, noun)?;
        let count = self.count(kind);
        if usize::try_from(place) != Ok(count) {
            return Err(format!("is {noun} {place}, and {count} is expected: a line is missing or moved"));
        }

        match kind {
            Kind::Region => self.add_region(fields)?,
            Kind::Panorama => self.add_panorama(fields, line)?,
            Kind::Image => self.add_image(fields)?,
            Kind::Category => self.add_category(fields)?,
            Kind::Object => {
                let region = self.reference(fields, 2, Kind::Region)?;
                let category = self.reference(fields, 3, Kind::Category)?;
                self.house.objects.push(Object { region, category });
            }
            Kind::Segment => self.add_segment(fields)?,
            Kind::Vertex | Kind::Surface | Kind::Portal | Kind::Level => {}
        }
        Ok(())
    }

    fn add_region(&mut self, fields: &Fields<'_>) -> Outcome<()> {
        self.reference(fields, 2, Kind::Level)?;
        let label = fields.word(5, "label")?;
        let mut letters = label.chars();
        let (Some(letter), None) = (letters.next(), letters.next()) else {
            return Err(format!("{}: the label of a region is one letter", quote(label.as_bytes())));
        };
        // A region without a kind is a room of the kind that is not clear.
        let letter = if letter == '-' { 'z' } else { letter };
        let number = self.letters.entry(letter).or_insert(0u32);
        *number += 1;
        let room = format!("{letter}_{number}");
        self.house.regions.push(Region { room });
        Ok(())
    }

    fn add_panorama(&mut self, fields: &Fields<'_>, line: u64) -> Outcome<()> {
        let name = fields.word(1, "name")?.to_owned();
        if !self.names.insert(name.to_ascii_lowercase()) {
            return Err(format!("there are two panoramas {}", quote(name.as_bytes())));
        }
        self.reference(fields, 3, Kind::Region)?;
        let place = DVec3::from_array(fields.numbers(5)?);
        let panorama = Panorama { name, place, level: Vec::new(), has_pictures: false, line };
        self.house.panoramas.push(panorama);
        Ok(())
    }

    fn add_image(&mut self, fields: &Fields<'_>) -> Outcome<()> {
        let panorama = self.reference(fields, 2, Kind::Panorama)?;
        let camera = fields.whole(4, "camera")?;
        let stop = fields.whole(5, "stop")?;
        if panorama.is_some() && !self.pictures.insert((panorama, camera, stop)) {
            return Err(format!("there are two pictures of camera {camera} at stop {stop} of its panorama"));
        }

        let pose = pose_of(fields.numbers(6)?)?;
        let panorama = panorama.and_then(|place| self.house.panoramas.get_mut(place));
        if let Some(panorama) = panorama {
            panorama.has_pictures = true;
            if camera == LEVEL {
                panorama.level.push((stop, pose));
            }
        }
        Ok(())
    }

    fn add_category(&mut self, fields: &Fields<'_>) -> Outcome<()> {
        let mapping = fields.whole(2, "category of category_mapping.tsv")?;
        let of_annotators = fields.word(3, "name")?;
        let of_mpcat40 = fields.word(5, "name")?;
        // Names have # in place of blanks, and - stands for no name.
        let word = [of_mpcat40, of_annotators].into_iter().find(|word| *word != "-");
        let word = word.map(|word| word.replace('#', " "));
        self.house.categories.push(Category { mapping, word });
        Ok(())
    }

    fn add_segment(&mut self, fields: &Fields<'_>) -> Outcome<()> {
        let object = self.reference(fields, 2, Kind::Object)?;
        let number = fields.whole(3, "segment")?;
        match self.house.segments.insert(number, object) {
            Some(before) if before != object => {
                Err(format!("the segment {number} belongs to another object on an earlier line"))
            }
            _ => Ok(()),
        }
    }

    fn count(&self, kind: Kind) -> usize {
        count_of(&self.counts, kind)
    }

    /// Returns the record of `kind` that a field names, or `None` for -1. It must stand on an earlier line.
    fn reference(&self, fields: &Fields<'_>, field: usize, kind: Kind) -> Outcome<Option<usize>> {
        let (noun, _) = kind.details();
        let number = fields.whole(field, noun)?;
        if number == -1 {
            return Ok(None);
        }
        let count = self.count(kind);
        usize::try_from(number)
            .ok()
            .filter(|place| *place < count)
            .map(Some)
            .ok_or_else(|| format!("names {noun} {number}: {count} stand before it, from 0"))
    }

    /// Compares the numbers of records with the head.
    fn finish(self, path: &Path) -> Result<House> {
        let Some(head) = self.head else { return Err(Error::format(path, "has no line H")) };
        for (kind, _, noun, _) in KINDS {
            let told = count_of(&head.counts, kind);
            let found = count_of(&self.counts, kind);
            if told != found {
                let message = format!("tells of {told} records of the kind {noun}, and there are {found}");
                return Err(Error::line(path, head.line, message));
            }
        }
        Ok(self.house)
    }
}

fn count_of(counts: &[usize; 10], kind: Kind) -> usize {
    counts.get(kind as usize).copied().unwrap_or(0)
}

/// Returns the pose of a picture from its matrix world → camera, 4 × 4, in OpenGL's axes (x right, y up, z
/// backwards).
fn pose_of(matrix: [f64; 16]) -> Outcome<Pose> {
    let [a, b, c, d, e, f, g, h, i, j, k, l, last @ ..] = matrix;
    let off = last
        .iter()
        .zip([0.0, 0.0, 0.0, 1.0])
        .map(|(found, right)| (found - right).abs());
    if off.fold(0.0, f64::max) > LAST_ROW_ERROR {
        return Err(format!("the last row of the extrinsics is {last:?}, not 0 0 0 1"));
    }
    // OpenCV's axes y and z point the other way.
    let rows = [[a, b, c, d], [-e, -f, -g, -h], [-i, -j, -k, -l]];
    Pose::from_rt(rows).map_err(|e| format!("the extrinsics: {e}"))
}
