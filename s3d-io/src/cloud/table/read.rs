//! Flat clouds: every instance of an area in one table of points, or in a few. Rows are grouped by room,
//! class and instance, whatever the format.
//!
//! The files are read once and their points counted by what they say of themselves. Then it is known what the
//! tags mean and how many instances there are. As long as the points fit, they were kept on the way and are
//! put in order; else the files are read a second time, and every point goes to its place in a temporary
//! file.

use crate::cloud::annotations::{
    AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations, InstancePoints, PointBlocks, Skipped,
};
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::meaning::{Group, Meaning};
use crate::cloud::table::rows::{NO_TAG, Reading, Rows, Sink, Tags};
use crate::cloud::table::store::{FlatStore, SpoolWriter};
use crate::error::{Error, Result};
use s3d_geom::PointCloud;
use s3d_geom::glam::Vec3;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The most instances that a cloud may tell of: beyond, the column is another one.
const MAX_GROUPS: usize = 1_000_000;
/// Farther from the origin than this, metres as `f32` step by a millimetre.
const FAR_M: f64 = 10_000.0;

/// The points that are found and what they say, before it is known what that means.
#[derive(Default)]
struct Gathered {
    groups: Vec<Group>,
    index: HashMap<(u32, u32, i64), u32>,
    points: u64,
    /// The points as they came, with the index of their group; empty if there are too many.
    positions: Vec<Vec3>,
    colors: Vec<[u8; 3]>,
    group_of: Vec<u32>,
}

/// Reads flat clouds as one.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] for what a reader finds wrong, and for classes and rooms without a
/// meaning.
pub(crate) fn read_flat(clouds: &[&dyn Cloud], options: &AnnotationOptions) -> Result<Annotations> {
    let mut colors = vec![ColorRange::Narrow; clouds.len()];
    // Each turn settles the colours of one file at least.
    let (gathered, classes, rooms, mut warnings) = loop {
        let (mut classes, mut rooms) = (Tags::new(), Tags::new());
        let mut gathered = Gathered::default();
        let mut warnings = Vec::new();
        let wide =
            gather(clouds, &colors, options, &mut gathered, (&mut classes, &mut rooms), &mut warnings)?;
        match wide.and_then(|file| colors.get_mut(file)) {
            Some(range) => *range = ColorRange::Wide,
            None => break (gathered, classes, rooms, warnings),
        }
    };
    if gathered.points == 0 {
        // What is wrong with the first record says why there is none.
        let path = clouds.first().map_or(Path::new(""), |cloud| cloud.path());
        let of = format!("{}: ", path.display());
        let why = warnings
            .first()
            .map_or_else(String::new, |why| format!(": {}", why.replace(&of, "")));
        return Err(Error::format(path, format!("holds no point that can be used{why}")));
    }
    let meaning = Meaning::new(clouds, options, &gathered.groups, &classes, &rooms, &mut warnings)?;
    let counts: Vec<u64> = meaning.instances.iter().map(|i| i.points).collect();
    let store = if gathered.group_of.len() as u64 == gathered.points {
        in_memory(&gathered, &meaning, &counts)
    } else {
        spooled(clouds, &colors, options, &gathered, &meaning, &counts, (classes, rooms))?
    };
    let store = Arc::new(store);
    let mut found: Vec<AnnotatedRoom> = Vec::new();
    let mut start = 0;
    for instance in meaning.instances {
        #[expect(clippy::indexing_slicing, reason = "the meaning names these files by their places")]
        let cloud = clouds[instance.file];
        let points = FlatPoints {
            store: Arc::clone(&store),
            start,
            count: instance.points,
            path: cloud.path().to_owned(),
            are_vertices: cloud.are_vertices(),
            part: instance.part,
        };
        start += instance.points;
        let points = AnnotatedInstance::new(instance.class, instance.number, Arc::new(points));
        match found.last_mut().filter(|r| r.room == instance.room) {
            Some(room) => room.instances.push(points),
            None => found.push(AnnotatedRoom { room: instance.room, instances: vec![points] }),
        }
    }
    Ok(Annotations { taxonomy: options.taxonomy.clone(), rooms: found, warnings })
}

/// Reads every file once. `Some`: that file's colours are wide.
fn gather(
    clouds: &[&dyn Cloud],
    colors: &[ColorRange],
    options: &AnnotationOptions,
    gathered: &mut Gathered,
    (classes, rooms): (&mut Tags, &mut Tags),
    warnings: &mut Vec<String>,
) -> Result<Option<usize>> {
    for ((file, cloud), colors) in clouds.iter().enumerate().zip(colors) {
        let path = cloud.path();
        let mut sink = |rows: &Rows| gathered.add(file, path, rows, options.points_in_memory);
        let room = default_room(*cloud, options, rooms);
        let mut reading = Reading::new(path, options, room, (classes, rooms), &mut sink);
        if !cloud.read(*colors, &mut reading)? {
            return Ok(Some(file));
        }
        reading.end()?;
        let (skipped, farthest_m) = (std::mem::take(&mut reading.skipped), reading.farthest_m);
        warnings.append(&mut reading.notes);
        if let Some(first) = skipped.first {
            warnings.push(format!("{}: {} records left out; {first}", path.display(), skipped.count));
        }
        if farthest_m > FAR_M {
            warnings.push(format!(
                "{}: coordinates up to {farthest_m:.0} m from the origin are rounded by up to {:.1} mm; give \
                 an offset (`offset_m`) that brings them near to it, the mesh's",
                path.display(),
                1e3 * farthest_m * f64::from(f32::EPSILON)
            ));
        }
    }
    Ok(None)
}

fn default_room(cloud: &dyn Cloud, options: &AnnotationOptions, rooms: &mut Tags) -> u32 {
    let room = options.room.or_else(|| cloud.room(&options.taxonomy));
    room.and_then(|r| rooms.name(&r.to_string())).unwrap_or(NO_TAG)
}

impl Gathered {
    fn add(&mut self, file: usize, path: &Path, rows: &Rows, in_memory: u64) -> Result<()> {
        let kept = self.group_of.len() as u64 == self.points;
        self.points += rows.len() as u64;
        let keep = kept && self.points <= in_memory;
        if keep {
            self.positions.extend_from_slice(&rows.positions);
            self.colors.extend_from_slice(&rows.colors);
        } else if kept {
            (self.positions, self.colors, self.group_of) = Default::default();
        }
        let mut last = ((NO_TAG, NO_TAG, 0), 0);
        for ((room, class), instance) in rows.rooms.iter().zip(&rows.classes).zip(&rows.instances) {
            let key = (*room, *class, *instance);
            if key != last.0 {
                let next = self.groups.len() as u32;
                let index = *self.index.entry(key).or_insert(next);
                if index == next {
                    self.groups.push(Group {
                        room: *room,
                        class: *class,
                        instance: *instance,
                        file,
                        points: 0,
                    });
                    if self.groups.len() > MAX_GROUPS {
                        let message =
                            format!("tells of more than {MAX_GROUPS} instances: is it the right column?");
                        return Err(Error::format(path, message));
                    }
                }
                last = (key, index);
            }
            #[expect(clippy::indexing_slicing, reason = "each index in the map is that of a group")]
            let group = &mut self.groups[last.1 as usize];
            group.points += 1;
            if keep {
                self.group_of.push(last.1);
            }
        }
        Ok(())
    }
}

/// Puts the points in order: within an instance, that of the files.
#[expect(
    clippy::indexing_slicing,
    reason = "points were gathered in columns of one length, and counted by instance"
)]
fn in_memory(gathered: &Gathered, meaning: &Meaning, counts: &[u64]) -> FlatStore {
    let mut next: Vec<usize> = counts
        .iter()
        .scan(0, |end, n| {
            let start = *end;
            *end += *n as usize;
            Some(start)
        })
        .collect();
    let total = counts.iter().sum::<u64>() as usize;
    let (mut positions, mut colors) = (vec![Vec3::ZERO; total], vec![[0; 3]; total]);
    for (i, group) in gathered.group_of.iter().enumerate() {
        if let Some(instance) = meaning.instance_of[*group as usize] {
            let at = &mut next[instance];
            positions[*at] = gathered.positions[i];
            colors[*at] = gathered.colors[i];
            *at += 1;
        }
    }
    FlatStore::Memory { positions, colors }
}

/// Reads every file a second time, and every point to its place in a temporary file.
fn spooled(
    clouds: &[&dyn Cloud],
    colors: &[ColorRange],
    options: &AnnotationOptions,
    gathered: &Gathered,
    meaning: &Meaning,
    counts: &[u64],
    (mut classes, mut rooms): (Tags, Tags),
) -> Result<FlatStore> {
    let mut writer = SpoolWriter::create(options.spool_dir.as_deref(), counts)?;
    for (cloud, colors) in clouds.iter().zip(colors) {
        let path = cloud.path();
        let mut sink = |rows: &Rows| {
            let tags = rows.rooms.iter().zip(&rows.classes).zip(&rows.instances);
            let points = rows.positions.iter().zip(&rows.colors);
            let (mut last, mut known) = ((NO_TAG, NO_TAG, 0), None);
            for (((room, class), instance), (position, color)) in tags.zip(points) {
                let key = (*room, *class, *instance);
                if key != last || known.is_none() {
                    let group = gathered.index.get(&key);
                    known = group.and_then(|g| meaning.instance_of.get(*g as usize)).copied();
                    last = key;
                }
                let fits = match known {
                    Some(Some(instance)) => writer.push(instance, *position, *color)?,
                    Some(None) => true,
                    None => false,
                };
                if !fits {
                    return Err(changed(path));
                }
            }
            Ok(())
        };
        let room = default_room(*cloud, options, &mut rooms);
        let sink: &mut Sink<'_> = &mut sink;
        let mut reading = Reading::new(path, options, room, (&mut classes, &mut rooms), sink);
        if !cloud.read(*colors, &mut reading)? {
            return Err(changed(path));
        }
        reading.flush()?;
    }
    let first = clouds.first().map_or(Path::new(""), |cloud| cloud.path());
    writer.finish()?.ok_or_else(|| changed(first))
}

fn changed(path: &Path) -> Error {
    Error::format(path, "changed while it was read")
}

/// An instance of a flat cloud.
#[derive(Debug)]
struct FlatPoints {
    store: Arc<FlatStore>,
    start: u64,
    count: u64,
    path: PathBuf,
    part: String,
    are_vertices: bool,
}

impl InstancePoints for FlatPoints {
    fn read(&self, out: &mut PointCloud) -> Result<Skipped> {
        self.store.read(self.start, self.count, out)?;
        Ok(Skipped::default())
    }

    fn path(&self) -> &Path {
        &self.path
    }

    fn part(&self) -> String {
        self.part.clone()
    }

    fn are_vertices(&self) -> bool {
        self.are_vertices
    }

    fn open(&self) -> Result<Box<dyn PointBlocks + '_>> {
        Ok(Box::new(FlatBlocks { points: self, done: 0 }))
    }
}

/// The points of an instance of a flat cloud, block by block.
struct FlatBlocks<'a> {
    points: &'a FlatPoints,
    done: u64,
}

impl PointBlocks for FlatBlocks<'_> {
    fn read_block(&mut self, points: usize, out: &mut PointCloud) -> Result<bool> {
        let FlatPoints { store, start, count, .. } = self.points;
        let n = (points as u64).min(count - self.done);
        store.read(start + self.done, n, out)?;
        self.done += n;
        Ok(self.done < *count)
    }

    fn skipped(&mut self) -> Skipped {
        Skipped::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::s3dis::tree::OnFault;
    use crate::cloud::table::rows::{Row, Value};
    use proptest::prelude::*;
    use s3d_geom::glam::DVec3;
    use s3d_label::{Class, Room};
    use std::collections::BTreeMap;

    /// A row: class, instance, room (0: none). Its place in the list is its x coordinate and its colour.
    type TestRow = (i64, i64, i64);

    /// Rows in place of a file.
    struct TestCloud {
        path: PathBuf,
        rows: Vec<TestRow>,
        /// The first row whose colour is beyond the narrow range.
        wide_from: usize,
    }

    impl TestCloud {
        fn new(name: &str, rows: &[TestRow]) -> Self {
            Self { path: PathBuf::from(name), rows: rows.to_vec(), wide_from: usize::MAX }
        }
    }

    impl Cloud for TestCloud {
        fn path(&self) -> &Path {
            &self.path
        }

        fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
            for (i, (class, instance, room)) in self.rows.iter().enumerate() {
                if i >= self.wide_from && colors == ColorRange::Narrow {
                    return Ok(false);
                }
                let scale = if colors == ColorRange::Wide { 2 } else { 1 };
                let row = Row {
                    position: DVec3::new(i as f64, 0.0, 0.0),
                    color: [(i % 100) as u8 * scale; 3],
                    class: Value::Whole(*class),
                    instance: Value::Float(*instance as f64),
                    room: if *room == 0 { Value::None } else { Value::Whole(*room) },
                };
                reading.push(i as u64 + 1, &row)?;
            }
            Ok(true)
        }
    }

    fn options() -> AnnotationOptions {
        let classes =
            [("0", None), ("1", Some(Class::WALL)), ("2", Some(Class::CHAIR)), ("3", Some(Class::CHAIR))];
        AnnotationOptions {
            room: Some("office_7".parse().unwrap()),
            classes: classes.into_iter().map(|(k, c)| (k.to_owned(), c)).collect(),
            ..AnnotationOptions::default()
        }
    }

    fn read(clouds: &[TestCloud], options: &AnnotationOptions) -> Result<Annotations> {
        let clouds: Vec<&dyn Cloud> = clouds.iter().map(|c| c as &dyn Cloud).collect();
        read_flat(&clouds, options)
    }

    /// Every instance's name, and the x coordinates and colours of its points.
    fn contents(annotations: &Annotations) -> Vec<(String, Vec<f32>, Vec<u8>)> {
        let mut all = Vec::new();
        for room in &annotations.rooms {
            for i in &room.instances {
                let mut cloud = PointCloud::default();
                i.read(&mut cloud).unwrap();
                let x = cloud.positions.iter().map(|p| p.x).collect();
                let name = format!("{} {}_{}", room.room, i.class, i.number);
                all.push((name, x, cloud.colors.iter().map(|c| c[0]).collect()));
            }
        }
        all
    }

    fn names(annotations: &Annotations) -> Vec<(String, Vec<f32>)> {
        contents(annotations)
            .into_iter()
            .map(|(name, x, _)| (name, x))
            .collect()
    }

    #[test]
    fn rows_are_grouped_and_numbered() {
        let cloud = TestCloud::new(
            "a.las",
            &[
                (1, 40, 0),
                (2, 9, 0),
                (3, 9, 0),
                (1, 7, 0),
                (1, -1, 0),
                (1, -5, 0),
                (0, 3, 0),
                (2, 9, 2),
                (1, 40, 0),
            ],
        );
        let found = read(&[cloud], &options()).unwrap();
        let expected = [
            ("office_2 chair_1", vec![7.0]),
            // Without a number: one instance, before the numbered.
            ("office_7 wall_1", vec![4.0, 5.0]),
            ("office_7 wall_2", vec![3.0]),
            ("office_7 wall_3", vec![0.0, 8.0]),
            // Two of the file's classes are kept apart, though both are chairs.
            ("office_7 chair_1", vec![1.0]),
            ("office_7 chair_2", vec![2.0]),
        ];
        assert_eq!(names(&found), expected.map(|(name, x)| (name.to_owned(), x)));
        let sources: Vec<String> = found.rooms[1].instances.iter().map(AnnotatedInstance::source).collect();
        assert_eq!(sources[0], "a.las, the wall of office_7");
        assert_eq!(sources[4], "a.las, instance 9 of class 3 in office_7");
    }

    #[test]
    fn files_are_one_cloud_and_may_name_their_rooms() {
        let a = TestCloud::new("x/Area_12_WC_1.npy", &[(1, 1, 0), (2, 1, 0)]);
        let b = TestCloud::new("office_2.ply", &[(1, 1, 0)]);
        let c = TestCloud::new("rest.ply", &[(1, 1, 0)]);
        let unnamed = AnnotationOptions { room: None, ..options() };
        let found = read(&[a, b], &unnamed).unwrap();
        let expected = ["office_2 wall_1", "WC_1 wall_1", "WC_1 chair_1"];
        assert_eq!(names(&found).into_iter().map(|n| n.0).collect::<Vec<_>>(), expected);
        let message = read(&[c], &unnamed).unwrap_err().to_string();
        assert!(message.contains("rest.ply: 1 points are in no room"), "{message}");
        // What is said goes before a file's name; and the same number in two files is the same instance.
        let twice = [TestCloud::new("office_2.ply", &[(1, 1, 0)]), TestCloud::new("b.ply", &[(1, 1, 0)])];
        assert_eq!(
            names(&read(&twice, &options()).unwrap()),
            [("office_7 wall_1".to_owned(), vec![0.0, 0.0])]
        );
    }

    #[test]
    fn a_wide_colour_reads_the_file_again_from_the_start() {
        let mut wide = TestCloud::new("a.las", &[(1, 1, 0); 5]);
        wide.wide_from = 3;
        let narrow = TestCloud::new("b.las", &[(1, 2, 0); 3]);
        let found = read(&[narrow, wide], &options()).unwrap();
        let colors: Vec<Vec<u8>> = contents(&found).into_iter().map(|c| c.2).collect();
        assert_eq!(colors, [vec![0, 2, 4, 6, 8], vec![0, 1, 2]]);
    }

    #[test]
    fn rows_that_are_none_stop_or_are_counted() {
        struct Bad;
        impl Cloud for Bad {
            fn path(&self) -> &Path {
                Path::new("bad.npy")
            }
            fn read(&self, _: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
                let good = Row {
                    position: DVec3::ZERO,
                    color: [0; 3],
                    class: Value::Whole(1),
                    instance: Value::None,
                    room: Value::None,
                };
                reading.push(1, &good)?;
                reading.push(2, &Row { position: DVec3::new(0.0, f64::NAN, 0.0), ..good })?;
                reading.push(3, &Row { class: Value::Float(1.5), ..good })?;
                reading.push_line(9, &Row { instance: Value::Name("x"), ..good })?;
                reading.push(5, &Row { position: DVec3::splat(1e60), ..good })?;
                reading.push(6, &Row { class: Value::Float(f64::INFINITY), ..good })?;
                Ok(true)
            }
        }
        let strict = read_flat(&[&Bad], &options()).unwrap_err().to_string();
        assert_eq!(strict, "bad.npy: record 2: the coordinates 0 NaN 0 are not finite");
        let lenient = AnnotationOptions { on_fault: OnFault::Skip, ..options() };
        let found = read_flat(&[&Bad], &lenient).unwrap();
        assert_eq!(names(&found), [("office_7 wall_1".to_owned(), vec![0.0])]);
        assert!(
            found.warnings[0].starts_with("bad.npy: 5 records left out; bad.npy: record 2: "),
            "{:?}",
            found.warnings
        );
    }

    #[test]
    fn nothing_is_left_out_until_nothing_is_left() {
        let lenient = AnnotationOptions { on_fault: OnFault::Skip, ..options() };
        let message = |rows: &[TestRow], options: &AnnotationOptions| {
            read(&[TestCloud::new("a.las", rows)], options).unwrap_err().to_string()
        };
        // A column of intensities, say: no number in it is a class.
        let said = message(&[(77, 1, 0), (78, 1, 0), (78, 1, 0)], &lenient);
        assert!(said.contains("\"77\" (1 points), \"78\" (2 points)"), "{said}");
        assert!(said.contains("class = \"label\""), "{said}");
        let some = read(&[TestCloud::new("a.las", &[(77, 1, 0), (1, 1, 0)])], &lenient).unwrap();
        assert!(some.warnings[0].contains("1 points left out, whose class is none"), "{:?}", some.warnings);
        // Numbers of rooms, and nothing says of which type.
        let said = message(&[(1, 1, 4)], &AnnotationOptions { room: None, ..lenient.clone() });
        assert!(said.contains("rooms that are none: \"4\""), "{said}");
        // Not one record is a point.
        struct Halves;
        impl Cloud for Halves {
            fn path(&self) -> &Path {
                Path::new("a.las")
            }
            fn read(&self, _: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
                let (position, color) = (DVec3::ZERO, [0; 3]);
                let (class, instance, room) = (Value::Float(0.5), Value::None, Value::None);
                reading.push(1, &Row { position, color, class, instance, room })?;
                Ok(true)
            }
        }
        let said = read_flat(&[&Halves], &lenient).unwrap_err().to_string();
        let expected = "a.las: holds no point that can be used: 1 records left out; record 1: class: 0.5 is \
                        no whole number";
        assert_eq!(said, expected);
        assert!(message(&[], &lenient).contains("a.las: holds no point that can be used"));
    }

    #[test]
    fn a_column_of_something_else_is_noticed() {
        let rows: Vec<TestRow> = (0..10_001).map(|i| (i, 0, 0)).collect();
        let message = read(&[TestCloud::new("a.las", &rows)], &options())
            .unwrap_err()
            .to_string();
        assert!(message.contains("more than 10000 different classes"), "{message}");
        let message = read(&[TestCloud::new("a.las", &[(0, 0, 0)])], &options())
            .unwrap_err()
            .to_string();
        assert!(message.contains("no annotated point"), "{message}");
    }

    #[test]
    fn a_column_of_other_numbers_is_no_column_of_instances() {
        let rows: Vec<TestRow> = (0..=MAX_GROUPS as i64).map(|i| (1, i, 0)).collect();
        let enough = TestCloud::new("a.las", &rows[1..]);
        assert_eq!(read(&[enough], &options()).unwrap().rooms[0].instances.len(), MAX_GROUPS);
        let message = read(&[TestCloud::new("a.las", &rows)], &options())
            .unwrap_err()
            .to_string();
        assert!(message.contains("a.las: tells of more than 1000000 instances"), "{message}");
    }

    /// The plain version: every point to the list of its key.
    fn reference(clouds: &[Vec<TestRow>]) -> Vec<(String, Vec<f32>)> {
        let mut lists: BTreeMap<(Room, Class, i64, i64), Vec<f32>> = BTreeMap::new();
        for rows in clouds {
            for (i, (class, instance, room)) in rows.iter().enumerate() {
                let number = if *room == 0 { 7 } else { *room as u32 };
                let room = Room { number, room_type: s3d_label::RoomType::OFFICE };
                let Some(meant) =
                    [None, Some(Class::WALL), Some(Class::CHAIR), Some(Class::CHAIR)][*class as usize]
                else {
                    continue;
                };
                let of = if *instance < 0 { -1 } else { *class };
                lists
                    .entry((room, meant, (*instance).max(-1), of))
                    .or_default()
                    .push(i as f32);
            }
        }
        let mut numbers: BTreeMap<(Room, Class), u32> = BTreeMap::new();
        let name = |((room, class, ..), x): ((Room, Class, i64, i64), Vec<f32>)| {
            let number = numbers.entry((room, class)).or_default();
            *number += 1;
            (format!("{room} {class}_{number}"), x)
        };
        lists.into_iter().map(name).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn memory_and_temporary_file_give_what_the_plain_version_gives(
            clouds in prop::collection::vec(
                prop::collection::vec((0i64..4, -2i64..5, 0i64..3), 0..200),
                1..4,
            ),
            in_memory in 0u64..300,
        ) {
            let files: Vec<TestCloud> = clouds.iter().map(|rows| TestCloud::new("a.las", rows)).collect();
            let spooled = AnnotationOptions { points_in_memory: in_memory, ..options() };
            match (read(&files, &options()), read(&files, &spooled)) {
                (Ok(memory), Ok(file)) => {
                    prop_assert_eq!(names(&memory), reference(&clouds));
                    prop_assert_eq!(contents(&memory), contents(&file));
                }
                (Err(memory), Err(file)) => {
                    prop_assert!(reference(&clouds).is_empty());
                    prop_assert_eq!(memory.to_string(), file.to_string());
                }
                other => prop_assert!(false, "{:?}", other),
            }
        }
    }
}
