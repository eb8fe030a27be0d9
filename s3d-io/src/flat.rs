//! Flat clouds: every instance of an area in one table of points, or in a few. Rows are grouped by room, class and
//! instance, whatever the format.
//!
//! The files are read once and their points counted by what they say of themselves. Then it is known what the tags mean
//! and how many instances there are. As long as the points fit, they were kept on the way and are put in order; else the
//! files are read a second time, and every point goes to its place in a temporary file.

use crate::annotations::{
    AnnotatedInstance, AnnotatedRoom, AnnotationOptions, Annotations, InstancePoints, Skipped,
};
use crate::flat_meaning::{Group, Meaning};
use crate::flat_rows::{NO_TAG, Reading, Rows, Sink, Tags};
use crate::flat_store::{FlatStore, SpoolWriter};
use crate::{Error, Result};
use s3d_geom::PointCloud;
use s3d_geom::glam::Vec3;
use s3d_label::{Class, Room};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The most instances that a cloud may tell of: beyond, the column is another one.
const MAX_GROUPS: usize = 1_000_000;
/// Farther from the origin than this, metres as `f32` step by a millimetre.
const FAR_M: f64 = 10_000.0;

/// What a format's colours are taken for. Where a format leaves it open, the narrow range is tried first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ColorRange {
    /// 16-bit numbers up to 255, or floats from 0 to 1.
    #[default]
    Narrow,
    /// 16-bit numbers up to 65,535, or floats from 0 to 255.
    Wide,
}

/// A file of rows that can be read several times.
pub(crate) trait Cloud {
    fn path(&self) -> &Path;

    /// The room that the file itself names, by its own name for instance.
    fn room(&self) -> Option<Room> {
        room_of_name(self.path())
    }

    /// The class that a tag means in this kind of file, where the user says nothing.
    fn class_of(&self, _tag: &crate::flat_rows::Tag) -> Option<Class> {
        None
    }

    /// Whether its points are the vertices of a mesh; known once it is read.
    fn are_vertices(&self) -> bool {
        false
    }

    /// Reads all rows. `false`: colours go beyond the narrow range, and the rows must be read again with the wide one.
    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool>;
}

/// The room that a file is named after: `office_3.ply`, `Area_1_office_3.npy`.
fn room_of_name(path: &Path) -> Option<Room> {
    let stem = path.file_stem()?.to_str()?;
    let name = match stem.strip_prefix("Area_").and_then(|rest| rest.split_once('_')) {
        Some((area, name)) if area.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => stem,
    };
    name.parse().ok()
}

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
/// [`Error::Io`]; [`Error::Format`] for what a reader finds wrong, and for classes and rooms without a meaning.
pub(crate) fn read_flat(clouds: &[&dyn Cloud], options: &AnnotationOptions) -> Result<Annotations> {
    let mut colors = vec![ColorRange::Narrow; clouds.len()];
    // Each turn settles the colours of one file at least.
    let (gathered, classes, rooms, mut warnings) = loop {
        let (mut classes, mut rooms) = (Tags::new(), Tags::new());
        let mut gathered = Gathered::default();
        let mut warnings = Vec::new();
        let wide =
            gather(clouds, &colors, options, &mut gathered, (&mut classes, &mut rooms), &mut warnings)?;
        match wide {
            Some(file) => colors[file] = ColorRange::Wide,
            None => break (gathered, classes, rooms, warnings),
        }
    };
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
        let points = FlatPoints {
            store: Arc::clone(&store),
            start,
            count: instance.points,
            path: clouds[instance.file].path().to_owned(),
            are_vertices: clouds[instance.file].are_vertices(),
            part: instance.part,
        };
        start += instance.points;
        if found.last().is_none_or(|r| r.room != instance.room) {
            found.push(AnnotatedRoom { room: instance.room, instances: Vec::new() });
        }
        let room = found.last_mut().expect("a room was pushed");
        room.instances.push(AnnotatedInstance::new(instance.class, instance.number, Arc::new(points)));
    }
    Ok(Annotations { rooms: found, warnings })
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
    for (file, cloud) in clouds.iter().enumerate() {
        let path = cloud.path();
        let mut sink = |rows: &Rows| gathered.add(file, path, rows, options.points_in_memory);
        let room = default_room(*cloud, options, rooms);
        let mut reading = Reading::new(path, options, room, (classes, rooms), &mut sink);
        if !cloud.read(colors[file], &mut reading)? {
            return Ok(Some(file));
        }
        reading.flush()?;
        let (skipped, farthest_m) = (std::mem::take(&mut reading.skipped), reading.farthest_m);
        warnings.append(&mut reading.notes);
        if let Some(first) = skipped.first {
            warnings.push(format!("{}: {} records left out; {first}", path.display(), skipped.count));
        }
        if farthest_m > FAR_M {
            warnings.push(format!(
                "{}: coordinates up to {farthest_m:.0} m from the origin are rounded by up to {:.1} mm; give an offset \
                 (`offset_m`) that brings them near to it, the mesh's",
                path.display(),
                1e3 * farthest_m * f64::from(f32::EPSILON)
            ));
        }
    }
    Ok(None)
}

fn default_room(cloud: &dyn Cloud, options: &AnnotationOptions, rooms: &mut Tags) -> u32 {
    let room = options.room.or_else(|| cloud.room());
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
            self.groups[last.1 as usize].points += 1;
            if keep {
                self.group_of.push(last.1);
            }
        }
        Ok(())
    }
}

/// Puts the points in order: within an instance, that of the files.
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
    for (file, cloud) in clouds.iter().enumerate() {
        let path = cloud.path();
        let mut sink = |rows: &Rows| {
            for i in 0..rows.len() {
                let key = (rows.rooms[i], rows.classes[i], rows.instances[i]);
                let known = gathered.index.get(&key).map(|g| meaning.instance_of[*g as usize]);
                let fits = match known {
                    Some(Some(instance)) => writer.push(instance, rows.positions[i], rows.colors[i])?,
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
        if !cloud.read(colors[file], &mut reading)? {
            return Err(changed(path));
        }
        reading.flush()?;
    }
    writer.finish()?.ok_or_else(|| changed(clouds[0].path()))
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
}
