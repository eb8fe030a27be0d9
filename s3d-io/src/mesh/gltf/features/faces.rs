//! Collects the features that the faces of a glTF file belong to.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::fs::quote::count;
use crate::mesh::gltf::extensions::DRACO;
use crate::mesh::gltf::features::{Features, SentenceResult, no_labels};
use crate::mesh::gltf::packed::unpack::whole;
use crate::mesh::gltf::words::{MESH_FEATURES, METADATA, index_of, sets_of};
use gltf::json::Index;
use gltf::json::accessor::Accessor;
use gltf::json::mesh::Primitive;
use s3d_geom::NO_INDEX;
use serde_json::Value;
use std::collections::{BTreeMap, HashMap};

/// The most bytes of all words together. Any number of features can share the bytes of one word.
const MAX_WORDS: usize = if cfg!(fuzzing) { 1 << 24 } else { 1 << 30 };

/// A feature that a face belongs to.
#[derive(Debug)]
pub(crate) struct Feature {
    /// The word for its class.
    pub(crate) class: String,
    /// The word for its room, if a property tells it.
    pub(crate) room: Option<String>,
    /// The number of its object, if a property tells it.
    pub(crate) instance: Option<i64>,
    /// Its number among the features of all tables that tell classes: its id, if there is one table.
    pub(crate) number: i64,
}

/// The features of a mesh that are objects.
#[derive(Debug, Default)]
pub(crate) struct FeatureObjects {
    pub(crate) features: Vec<Feature>,
    /// For each face its index into `features`, or [`NO_INDEX`]. Empty if no face has a feature.
    pub(crate) faces: Vec<u32>,
    /// One more than the largest [`Feature::number`] that there can be.
    pub(crate) numbers: i64,
}

/// Collects the features of faces.
pub(crate) struct FaceFeatures<'a> {
    from: &'a Features<'a>,
    /// The table and the row of each feature, in the order of faces.
    rows: Vec<(u32, u32)>,
    index: HashMap<(u32, u32), u32>,
    /// For each face its index into `rows`, or [`NO_INDEX`]. Empty if no table tells classes.
    faces: Vec<u32>,
    /// The first fault. A file with a fault has no features.
    fault: Option<String>,
    /// How many primitives have features in textures alone.
    textured: usize,
    /// How many vertices have features that are not in their table.
    outside: usize,
}

/// A primitive, and the triangles that are made of it.
pub(crate) struct Triangles<'a> {
    pub(crate) mesh: usize,
    /// The number of the primitive in its mesh.
    pub(crate) number: usize,
    pub(crate) primitive: &'a Primitive,
    pub(crate) vertices: usize,
    pub(crate) corners: &'a [[u32; 3]],
}

impl<'a> FaceFeatures<'a> {
    pub(crate) fn new(from: &'a Features<'a>) -> Self {
        Self {
            from,
            rows: Vec::new(),
            index: HashMap::new(),
            faces: Vec::new(),
            fault: None,
            textured: 0,
            outside: 0,
        }
    }

    /// Adds the triangles of a primitive. `who` is for messages: "mesh 0, primitive 1".
    pub(crate) fn add(&mut self, triangles: &Triangles<'_>, who: &str) {
        if self.from.tables.is_empty() || self.fault.is_some() {
            return;
        }
        let length = self.faces.len().saturating_add(triangles.corners.len());
        if let Err(why) = self.add_features(triangles) {
            self.fault = Some(format!("{who}, {MESH_FEATURES} {why}"));
        }
        self.faces.resize(length, NO_INDEX);
    }

    /// Adds a feature for each triangle, or none for all of them.
    ///
    /// # Errors
    /// The feature ids are damaged. The error is a sentence that follows the name of the extension.
    fn add_features(&mut self, triangles: &Triangles<'_>) -> SentenceResult<()> {
        let tables = &self.from.tables;
        let sets = sets_of(triangles.primitive).into_iter().flatten();
        let mut sets = sets
            .filter_map(|set| {
                let i = index_of(set.get("propertyTable")?)?;
                Some((i, tables.get(&i)?, set))
            })
            .peekable();
        let has_classes = sets.peek().is_some();
        let set = sets.find(|(_, _, set)| set.get("attribute").is_some() || set.get("texture").is_none());
        let Some((i, table, set)) = set else {
            self.textured = self.textured.saturating_add(usize::from(has_classes));
            return Ok(());
        };

        // The null feature is none. Nor is a feature that is not in its table.
        let mut rows = self.from.ids(set, triangles)?;
        let null = set.get("nullFeatureId").and_then(whole);
        for row in &mut rows {
            let is_null = null == Some(*row as usize);
            let is_inside = (*row as usize) < table.rows;
            self.outside = self.outside.saturating_add(usize::from(!is_null && !is_inside));
            if is_null || !is_inside {
                *row = NO_INDEX;
            }
        }

        for corners in triangles.corners {
            let [a, b, c] = corners.map(|v| rows.get(v as usize).copied().unwrap_or(NO_INDEX));
            let row = if b == c { b } else { a };
            let face = if row == NO_INDEX {
                NO_INDEX
            } else {
                self.feature((i, row))
            };
            self.faces.push(face);
        }
        Ok(())
    }

    /// Returns the index of a feature. Adds it if it is new.
    fn feature(&mut self, row: (u32, u32)) -> u32 {
        *self.index.entry(row).or_insert_with(|| {
            let index = u32::try_from(self.rows.len()).unwrap_or(NO_INDEX);
            self.rows.push(row);
            index
        })
    }

    /// Returns the objects of faces. Adds what is no label to `warnings`.
    pub(crate) fn objects(&self, warnings: &mut Vec<String>) -> FeatureObjects {
        if self.textured > 0 {
            let n = count(self.textured, "primitive");
            warnings
                .push(format!("{n} with features in textures alone, which are not read ({MESH_FEATURES})"));
        }
        if self.outside > 0 {
            let n = count(self.outside, "vertex");
            warnings.push(format!("{n} of features that are not in their property table ({MESH_FEATURES})"));
        }

        let objects = match &self.fault {
            Some(why) => Err(why.clone()),
            None => self.checked_objects(),
        };
        objects.unwrap_or_else(|why| {
            warnings.push(no_labels(&why));
            FeatureObjects::default()
        })
    }

    /// Returns the objects of faces.
    ///
    /// # Errors
    /// A class is damaged.
    fn checked_objects(&self) -> SentenceResult<FeatureObjects> {
        // Tables count on, so that no two features have one number.
        let mut numbers = 0i64;
        let mut starts = BTreeMap::new();
        for (&i, table) in &self.from.tables {
            starts.insert(i, numbers);
            numbers = numbers.saturating_add(i64::try_from(table.rows).unwrap_or(i64::MAX));
        }

        let mut features = Vec::new();
        let mut places = Vec::new();
        let mut left = MAX_WORDS;
        for &(i, row) in &self.rows {
            let table = self.from.tables.get(&i);
            let class = table.map(|table| table.class(row as usize)).transpose()?.flatten();
            let (Some(table), Some(class)) = (table, class) else {
                places.push(NO_INDEX);
                continue;
            };
            let room = table.room(row as usize)?;
            let bytes = class.len().saturating_add(room.map_or(0, str::len));
            left = left.checked_sub(bytes).ok_or_else(|| {
                format!("the words for their classes have more than {MAX_WORDS} bytes ({METADATA})")
            })?;
            places.push(u32::try_from(features.len()).unwrap_or(NO_INDEX));
            let start = starts.get(&i).copied().unwrap_or_default();
            features.push(Feature {
                class: class.to_owned(),
                room: room.map(str::to_owned),
                instance: table.instance(row as usize),
                number: start.saturating_add(row.into()),
            });
        }

        let faces = self.faces.iter();
        let faces = faces
            .map(|&f| places.get(f as usize).copied().unwrap_or(NO_INDEX))
            .collect();
        Ok(FeatureObjects { features, faces, numbers })
    }
}

impl Features<'_> {
    /// Returns the feature id of each vertex, or [`NO_INDEX`] if it is no number from 0.
    ///
    /// # Errors
    /// The error is a sentence that follows the name of the extension.
    fn ids(&self, set: &Value, triangles: &Triangles<'_>) -> SentenceResult<Vec<u32>> {
        let Some(attribute) = set.get("attribute") else {
            return Ok((0..=NO_INDEX).take(triangles.vertices).collect());
        };
        let name = whole(attribute).map(|n| format!("_FEATURE_ID_{n}"));
        let name = name.ok_or_else(|| format!("names {attribute} as an attribute"))?;
        let key = (triangles.mesh, triangles.number, name);
        let index = self.document.feature_attributes().0.get(&key);
        let (_, _, name) = key;
        let index: Index<Accessor> = index
            .map(|index| Index::new(*index))
            .ok_or_else(|| format!("names {name}, which the primitive does not have"))?;

        let accessor = self.document.get(index, &name, "accessor").map_err(|e| e.to_string())?;
        if accessor.buffer_view.is_none() && accessor.sparse.is_none() {
            let extensions = triangles.primitive.extensions.as_ref();
            let is_packed = extensions.is_some_and(|e| e.others.contains_key(DRACO));
            return Err(match is_packed {
                true => format!("has {name} in {DRACO} alone, of which no feature ids are read"),
                false => format!("has no data for {name}"),
            });
        }
        if accessor.count.0 != triangles.vertices as u64 {
            return Err(format!("has {} of {name} for {} vertices", accessor.count.0, triangles.vertices));
        }

        self.document
            .read_ids(index, &name)
            .map_err(|e| format!("is damaged: {e}"))
    }
}
