//! Reads tables of points: every instance of an area in one table, or in a few. Rows are grouped by room,
//! class and instance, whatever the format.
//!
//! A first pass over the files counts the points by room, class and instance. Then the meaning of the tags
//! and the number of instances are known. As long as the points fit into memory, the first pass keeps them,
//! and they are sorted there. Otherwise the files are read a second time, and every point goes to its place
//! in a temporary file.

use crate::cloud::annotations::{AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations};
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::gathered::{Gathered, default_room};
use crate::cloud::table::meaning::{Meaning, first_path};
use crate::cloud::table::points::TablePoints;
use crate::cloud::table::rows::{CloudTags, NO_TAG, Reading, Rows, Sink};
use crate::cloud::table::store::{PointStore, SpoolWriter};
use crate::error::{Error, Result};
use s3d_geom::glam::Vec3;
use std::path::Path;
use std::sync::Arc;

/// Reads several tables as one cloud.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] for the faults that a reader finds, and for classes and rooms without a
/// meaning.
pub(crate) fn read_tables(clouds: &[&dyn Cloud], options: &AnnotationOptions) -> Result<Annotations> {
    let mut colors = vec![ColorRange::Narrow; clouds.len()];
    // Each turn settles the colours of at least one file.
    let (gathered, tags, mut warnings) = loop {
        let mut gathered = Gathered::default();
        let mut tags = CloudTags::new();
        let mut warnings = Vec::new();
        let wide = gathered.read(clouds, &colors, options, &mut tags, &mut warnings)?;
        match wide.and_then(|file| colors.get_mut(file)) {
            Some(range) => *range = range.wider(),
            None => break (gathered, tags, warnings),
        }
    };
    if gathered.points == 0 {
        return Err(no_point(first_path(clouds), &warnings));
    }

    let meaning = Meaning::new(clouds, options, &gathered.groups, &tags, &mut warnings)?;
    let counts: Vec<u64> = meaning.instances.iter().map(|i| i.points).collect();
    let store = if gathered.has_all_points() {
        in_memory(&gathered, &meaning, &counts)
    } else {
        spooled(clouds, &colors, options, &gathered, &meaning, &counts, tags)?
    };

    let rooms = rooms_of(clouds, meaning, &Arc::new(store));
    let companions = clouds.iter().flat_map(|cloud| cloud.companions()).collect();
    Ok(Annotations { taxonomy: options.taxonomy.clone(), rooms, warnings, companions })
}

/// The error for a cloud without a point. It repeats the first warning, which says what is wrong with the
/// first record.
fn no_point(path: &Path, warnings: &[String]) -> Error {
    let prefix = format!("{}: ", path.display());
    let why = warnings
        .first()
        .map_or_else(String::new, |why| format!(": {}", why.replace(&prefix, "")));
    Error::format(path, format!("holds no point that can be used{why}"))
}

/// The instances by room. Their points lie in `store` in the same order.
fn rooms_of(clouds: &[&dyn Cloud], meaning: Meaning, store: &Arc<PointStore>) -> Vec<AnnotatedRoom> {
    let mut rooms: Vec<AnnotatedRoom> = Vec::new();
    let mut start = 0;
    for instance in meaning.instances {
        #[expect(clippy::indexing_slicing, reason = "the meaning names these files by their places")]
        let cloud = clouds[instance.file];
        let points = TablePoints {
            store: Arc::clone(store),
            start,
            count: instance.points,
            path: cloud.path().to_owned(),
            are_vertices: cloud.are_vertices(),
            part: instance.part,
        };
        start += instance.points;

        let points = AnnotatedInstance::new(instance.class, instance.number, Arc::new(points));
        match rooms.last_mut().filter(|r| r.room == instance.room) {
            Some(room) => room.instances.push(points),
            None => rooms.push(AnnotatedRoom { room: instance.room, instances: vec![points] }),
        }
    }
    rooms
}

/// Sorts the points by instance. Within an instance they keep the order of the files.
#[expect(
    clippy::indexing_slicing,
    reason = "points were gathered in columns of one length, and counted by instance"
)]
fn in_memory(gathered: &Gathered, meaning: &Meaning, counts: &[u64]) -> PointStore {
    let mut next: Vec<usize> = counts
        .iter()
        .scan(0, |end, n| {
            let start = *end;
            *end += *n as usize;
            Some(start)
        })
        .collect();
    let total = counts.iter().sum::<u64>() as usize;
    let mut positions = vec![Vec3::ZERO; total];
    let mut colors = vec![[0; 3]; total];

    for (i, group) in gathered.group_of.iter().enumerate() {
        if let Some(instance) = meaning.instance_of[*group as usize] {
            let at = &mut next[instance];
            positions[*at] = gathered.positions[i];
            colors[*at] = gathered.colors[i];
            *at += 1;
        }
    }
    PointStore::Memory { positions, colors }
}

/// Reads every file a second time, and puts every point in its place in a temporary file.
fn spooled(
    clouds: &[&dyn Cloud],
    colors: &[ColorRange],
    options: &AnnotationOptions,
    gathered: &Gathered,
    meaning: &Meaning,
    counts: &[u64],
    mut tags: CloudTags,
) -> Result<PointStore> {
    let mut writer = SpoolWriter::create(options.spool_dir.as_deref(), counts)?;
    for (cloud, colors) in clouds.iter().zip(colors) {
        let path = cloud.path();
        let mut sink = |rows: &Rows| spool(rows, gathered, meaning, &mut writer, path);
        let room = default_room(*cloud, options, &mut tags);
        let sink: &mut Sink<'_> = &mut sink;
        let mut reading = Reading::new(path, options, room, &mut tags, sink);
        if !cloud.read(*colors, &mut reading)? {
            return Err(changed(path));
        }
        reading.flush()?;
    }
    writer.finish()?.ok_or_else(|| changed(first_path(clouds)))
}

/// Puts rows in their places in the file. Rows that the first pass did not see are an error.
fn spool(
    rows: &Rows,
    gathered: &Gathered,
    meaning: &Meaning,
    writer: &mut SpoolWriter,
    path: &Path,
) -> Result<()> {
    let tags = rows.rooms.iter().zip(&rows.classes).zip(&rows.instances);
    let points = rows.positions.iter().zip(&rows.colors);
    // Rows of one group often follow one another.
    let mut last = (NO_TAG, NO_TAG, 0);
    let mut known = None;
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
}

fn changed(path: &Path) -> Error {
    Error::format(path, "changed while it was read")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::on_fault::OnFault;
    use crate::cloud::table::gathered::MAX_GROUPS;
    use crate::cloud::table::measured::Measured;
    use crate::cloud::table::rows::{Row, Value};
    use proptest::prelude::*;
    use s3d_geom::PointCloud;
    use s3d_geom::glam::DVec3;
    use s3d_label::{Class, Room};
    use std::collections::BTreeMap;
    use std::path::PathBuf;

    /// A row: class, instance, room (0: none). Its place in the list is its x coordinate and its colour.
    type TestRow = (i64, i64, i64);

    /// A cloud of rows in memory.
    struct TestCloud {
        path: PathBuf,
        rows: Vec<TestRow>,
        /// The first row with a colour beyond the narrow range.
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
                    measured: Measured::default(),
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
        read_tables(&clouds, options)
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
            // Points without a number are one instance, before the numbered ones.
            ("office_7 wall_1", vec![4.0, 5.0]),
            ("office_7 wall_2", vec![3.0]),
            ("office_7 wall_3", vec![0.0, 8.0]),
            // Two classes of the file are kept apart, though both mean chairs.
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

        // The user's room comes before a file's name; and the same number in two files is one instance.
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
                    measured: Measured::default(),
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

        let strict = read_tables(&[&Bad], &options()).unwrap_err().to_string();
        assert_eq!(strict, "bad.npy: record 2: the coordinates 0 NaN 0 are not finite");
        let lenient = AnnotationOptions { on_fault: OnFault::Skip, ..options() };
        let found = read_tables(&[&Bad], &lenient).unwrap();
        assert_eq!(names(&found), [("office_7 wall_1".to_owned(), vec![0.0])]);
        assert!(
            found.warnings[0].starts_with("bad.npy: 5 records left out; bad.npy: record 2: "),
            "{:?}",
            found.warnings
        );
    }

    fn refused(rows: &[TestRow], options: &AnnotationOptions) -> String {
        read(&[TestCloud::new("a.las", rows)], options).unwrap_err().to_string()
    }

    #[test]
    fn nothing_is_left_out_until_nothing_is_left() {
        let lenient = AnnotationOptions { on_fault: OnFault::Skip, ..options() };

        // A column of something else, such as intensities: no number in it is a class.
        let said = refused(&[(77, 1, 0), (78, 1, 0), (78, 1, 0)], &lenient);
        assert!(said.contains("\"77\" (1 points), \"78\" (2 points)"), "{said}");
        assert!(said.contains("class = \"label\""), "{said}");
        let some = read(&[TestCloud::new("a.las", &[(77, 1, 0), (1, 1, 0)])], &lenient).unwrap();
        assert!(some.warnings[0].contains("1 points of unknown classes left out"), "{:?}", some.warnings);

        // Room numbers without a type of room.
        let said = refused(&[(1, 1, 4)], &AnnotationOptions { room: None, ..lenient.clone() });
        assert!(said.contains("unknown rooms: \"4\""), "{said}");

        // No record is a valid point.
        struct Halves;
        impl Cloud for Halves {
            fn path(&self) -> &Path {
                Path::new("a.las")
            }
            fn read(&self, _: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
                let row = Row {
                    position: DVec3::ZERO,
                    color: [0; 3],
                    class: Value::Float(0.5),
                    instance: Value::None,
                    room: Value::None,
                    measured: Measured::default(),
                };
                reading.push(1, &row)?;
                Ok(true)
            }
        }

        let said = read_tables(&[&Halves], &lenient).unwrap_err().to_string();
        let expected = "a.las: holds no point that can be used: 1 records left out; record 1: class: 0.5 is \
                        no whole number";
        assert_eq!(said, expected);
        assert!(refused(&[], &lenient).contains("a.las: holds no point that can be used"));
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

    /// Plain reference: appends every point to the list of its key.
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
                let file_class = if *instance < 0 { -1 } else { *class };
                lists
                    .entry((room, meant, (*instance).max(-1), file_class))
                    .or_default()
                    .push(i as f32);
            }
        }

        let mut numbers: BTreeMap<(Room, Class), u32> = BTreeMap::new();
        lists
            .into_iter()
            .map(|((room, class, ..), x)| {
                let number = numbers.entry((room, class)).or_default();
                *number += 1;
                (format!("{room} {class}_{number}"), x)
            })
            .collect()
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
