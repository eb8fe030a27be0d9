//! An area of a data set, as the detector reads it.

use crate::error::{Error, Result};
use crate::surfel::{Part, Surfel, surfels_of_parts};
use glam::Vec3;
use rayon::prelude::*;
use s3d_dataset::{Context, DataSet};
use s3d_geom::{Aabb, PointCloud};
use s3d_io::Error as FileError;
use s3d_io::cloud::{AnnotationTree, OnFault, PointReader, TreeOptions};
use s3d_label::Class;
use std::io::Cursor;
use std::path::Path;

/// The classes to detect, in the order of the paper's table: seven structural, five movable.
pub const CLASSES: [Class; 12] = [
    Class::CEILING,
    Class::FLOOR,
    Class::WALL,
    Class::BEAM,
    Class::COLUMN,
    Class::WINDOW,
    Class::DOOR,
    Class::TABLE,
    Class::CHAIR,
    Class::SOFA,
    Class::BOOKCASE,
    Class::BOARD,
];

/// How many of [`CLASSES`] are structural.
pub const STRUCTURAL: usize = 7;

/// An annotated element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element {
    /// The index of its class in [`CLASSES`].
    pub class: usize,
    /// The index of its room in [`Area::rooms`].
    pub room: u32,
    /// Its box, in metres.
    pub bbox: Aabb,
}

/// The thinned points of an area and its annotated elements, in the world frame: metres, Z up.
#[derive(Clone, Debug)]
pub struct Area {
    /// Its number.
    pub number: u32,
    /// Its points, thinned. The rooms of the annotation have no part in it.
    pub surfels: Vec<Surfel>,
    /// The names of its rooms.
    pub rooms: Vec<String>,
    /// Its elements of one of [`CLASSES`].
    pub elements: Vec<Element>,
}

impl Area {
    /// Reads `s3dis/Area_k/ROOM/ROOM.txt` of every room, which has no labels, and the boxes in
    /// `area_k/3d/instances.json`. A class of another taxonomy becomes the class of S3DIS that it counts as.
    ///
    /// # Errors
    /// [`Error::Unlabelled`] if the data set has no labels. [`Error::UnknownArea`] if it lacks this area.
    /// [`Error::Dataset`] if a file is missing, damaged or not in the data set's list, or if the call is
    /// cancelled.
    pub fn read(data: &DataSet, number: u32, ctx: &Context) -> Result<Self> {
        let root = || data.layout().root().to_owned();
        let Some(taxonomy) = data.taxonomy() else {
            return Err(Error::Unlabelled { root: root() });
        };
        if !data.areas().contains(&number) {
            return Err(Error::UnknownArea { root: root(), area: number, areas: data.areas().to_vec() });
        }

        let options = TreeOptions { taxonomy: taxonomy.clone(), ..TreeOptions::default() };
        let tree = AnnotationTree::open_with(&data.layout().s3dis_area_dir(number), &options)?;
        let progress = ctx.progress("reading", "rooms", tree.rooms.len() as u64);
        let rooms = tree.rooms.par_iter().enumerate().map(|(index, room)| {
            ctx.check()?;
            let name = room.room.to_string();
            let points = read_points(data, &room.path.join(format!("{name}.txt")))?;
            progress.add(1);
            Ok((name, Part::of(&points, index as u32)))
        });
        let (mut rooms, parts): (Vec<String>, Vec<Part>) =
            rooms.collect::<Result<Vec<_>>>()?.into_iter().unzip();

        let mut elements = Vec::new();
        let path = data.layout().instances_json(number);
        for entry in data.instances(number)? {
            let class = taxonomy
                .class(&entry.class)
                .map_err(|e| FileError::format(&path, e.to_string()))?;
            let Some(class) = CLASSES.iter().position(|c| *c == class.s3dis()) else { continue };

            let [x0, y0, z0, x1, y1, z1] = entry.bbox;
            let bbox = Aabb { min: Vec3::new(x0, y0, z0), max: Vec3::new(x1, y1, z1) };
            // The tree leaves out rooms without points.
            let room = rooms.iter().position(|r| *r == entry.room).unwrap_or_else(|| {
                rooms.push(entry.room.clone());
                rooms.len() - 1
            });
            elements.push(Element { class, room: room as u32, bbox });
        }
        Ok(Self { number, surfels: surfels_of_parts(parts), rooms, elements })
    }
}

fn read_points(data: &DataSet, path: &Path) -> Result<PointCloud> {
    let mut reader = PointReader::new(Cursor::new(data.read(path)?), path, OnFault::Stop);
    let mut cloud = PointCloud::default();
    while reader.read_chunk(1 << 18, &mut cloud)? > 0 {}
    Ok(cloud)
}
