//! ScanNet's annotations: a mesh, a segment for each of its vertices (`*.segs.json`), and objects as lists of
//! segments (`*.aggregation.json`). Source: ScanNet's README, "Data Organization".

use crate::cloud::ply::read::{color_of, open_vertices};
use crate::cloud::table::cloud::{Cloud, ColorRange};
use crate::cloud::table::measured::Measured;
use crate::cloud::table::records::Color;
use crate::cloud::table::rows::{Reading, Row, Tag, Value};
use crate::cloud::words::class_of_word;
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use crate::fs::quote::quote;
use crate::fs::source::Source;
use crate::mesh::ply::batch::PlyBatch;
use s3d_geom::glam::DVec3;
use s3d_label::Class;
use serde::Deserialize;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The three files of a scan.
#[derive(Debug)]
pub(crate) struct ScannetCloud {
    aggregation: PathBuf,
    segments: PathBuf,
    mesh: PathBuf,
}

/// A list of objects, as ScanNet, ScanNet++ and 3RScan write it.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SegmentGroups {
    segments_file: Option<String>,
    pub(crate) seg_groups: Vec<SegmentGroup>,
}

/// An object.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct SegmentGroup {
    object_id: Option<i64>,
    /// The same number. Some files have only one of the two.
    id: Option<i64>,
    /// The annotator's word for its class.
    pub(crate) label: String,
    pub(crate) segments: Vec<i64>,
}

impl SegmentGroup {
    /// Returns the number of the object, from 0.
    pub(crate) fn object(&self) -> Option<i64> {
        self.object_id.or(self.id).filter(|n| *n >= 0)
    }
}

/// The segment of each vertex.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Segments {
    pub(crate) seg_indices: Vec<i64>,
}

fn aggregations(dir: &Path) -> Option<Vec<PathBuf>> {
    let entries = std::fs::read_dir(dir).ok()?.filter_map(|e| Some(e.ok()?.path()));
    let mut found: Vec<PathBuf> = entries.filter(|p| name_of(p).ends_with(".aggregation.json")).collect();
    found.sort();
    Some(found)
}

fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

impl ScannetCloud {
    /// Finds the files of a scan by its folder or its `*.aggregation.json`.
    ///
    /// # Errors
    /// [`Error::Format`] if a file is missing, or the folder holds several scans.
    pub(crate) fn open(path: &Path) -> Result<Self> {
        let aggregation = if path.is_dir() {
            aggregation_in(path)?
        } else {
            path.to_owned()
        };
        let dir = aggregation.parent().unwrap_or(Path::new("")).to_owned();
        let document: SegmentGroups = read_json(&aggregation)?;

        // The file names its segments, as in "scannet.scene0000_00_vh_clean_2.0.010000.segs.json".
        let named = document.segments_file.as_deref().unwrap_or_default();
        let named = named.rsplit(['/', '\\']).next().unwrap_or_default();
        let candidates = [named, named.strip_prefix("scannet.").unwrap_or(named)];
        let stem = name_of(&aggregation).replace(".aggregation.json", "");
        let segments = candidates
            .iter()
            .map(|name| dir.join(name))
            .find(|p| p.is_file())
            .or_else(|| sole(&dir, |name| name.starts_with(&stem) && name.ends_with(".segs.json")))
            .ok_or_else(|| {
                let message = format!("the segments that it is about are not beside it: {named:?}");
                Error::format(&aggregation, message)
            })?;

        let segments_name = name_of(&segments);
        let mesh = longest(&dir, |name| {
            name.strip_suffix(".ply")
                .is_some_and(|stem| segments_name.starts_with(stem))
        })
        .ok_or_else(|| {
            let stem = segments_name.split(".").next().unwrap_or_default();
            Error::format(&segments, format!("the mesh that it is about is not beside it: {stem}.ply"))
        })?;
        Ok(Self { aggregation, segments, mesh })
    }
}

/// The `*.aggregation.json` of a folder.
fn aggregation_in(dir: &Path) -> Result<PathBuf> {
    let mut found = aggregations(dir).unwrap_or_default();
    // `X_vh_clean.aggregation.json` belongs to the finer mesh. ScanNet's own labels are on the coarser mesh,
    // so that one is taken if there are both.
    if found.len() > 1 {
        found.retain(|p| !name_of(p).ends_with("_vh_clean.aggregation.json"));
    }
    match &found[..] {
        [one] => Ok(one.clone()),
        _ => {
            let message = "holds several *.aggregation.json: name the one, or give each scan a folder";
            Err(Error::format(dir, message))
        }
    }
}

/// The only file with a name that fits. Returns `None` if there are several.
fn sole(dir: &Path, fits: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let mut all = std::fs::read_dir(dir)
        .ok()?
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| fits(&name_of(p)));
    let first = all.next()?;
    all.next().is_none().then_some(first)
}

/// The file with the longest name that fits.
fn longest(dir: &Path, fits: impl Fn(&str) -> bool) -> Option<PathBuf> {
    let all = std::fs::read_dir(dir)
        .ok()?
        .filter_map(|e| Some(e.ok()?.path()))
        .filter(|p| fits(&name_of(p)));
    all.max_by_key(|p| (name_of(p).len(), name_of(p)))
}

impl ScannetCloud {
    /// The index of the object that each segment belongs to.
    fn objects_of_segments(
        &self,
        aggregation: &SegmentGroups,
        reading: &mut Reading<'_>,
    ) -> Result<HashMap<i64, usize>> {
        let mut object_of: HashMap<i64, usize> = HashMap::new();
        let mut twice = 0;
        for (i, group) in aggregation.seg_groups.iter().enumerate() {
            if group.object().is_none() {
                let message = format!("has an object without a number from 0: {:?}", group.label);
                return Err(Error::format(&self.aggregation, message));
            }
            for segment in &group.segments {
                // The last object wins, as in ScanNet's own scripts.
                twice += usize::from(object_of.insert(*segment, i).is_some_and(|other| other != i));
            }
        }
        if twice > 0 {
            reading.notes.push(format!(
                "{}: {twice} segments belong to several objects; each is taken for the last one's",
                self.aggregation.display()
            ));
        }
        Ok(object_of)
    }
}

impl Cloud for ScannetCloud {
    fn path(&self) -> &Path {
        &self.aggregation
    }

    fn are_vertices(&self) -> bool {
        true
    }

    fn companions(&self) -> Vec<PathBuf> {
        vec![self.segments.clone(), self.mesh.clone()]
    }

    fn class_of(&self, tag: &Tag) -> Option<Class> {
        let Tag::Name(name) = tag else { return None };
        class_of_word(name)
    }

    fn read(&self, colors: ColorRange, reading: &mut Reading<'_>) -> Result<bool> {
        let aggregation: SegmentGroups = read_json(&self.aggregation)?;
        let segments = read_json::<Segments>(&self.segments)?.seg_indices;
        let object_of = self.objects_of_segments(&aggregation, reading)?;

        let (mut reader, element, _) = open_vertices(&Source::file(&self.mesh))?;
        if element.count != segments.len() as u64 {
            return Err(Error::format(
                &self.segments,
                format!(
                    "has segments for {} vertices, {} has {}: they do not belong together",
                    segments.len(),
                    self.mesh.display(),
                    element.count
                ),
            ));
        }

        let position = ["x", "y", "z"].map(|name| element.find_scalar(&[name]));
        let [Some(x), Some(y), Some(z)] = position else {
            return Err(Error::format(&self.mesh, "has no vertices with x, y and z"));
        };
        let rgb = match ["red", "green", "blue"].map(|name| element.find_scalar(&[name])) {
            [Some(r), Some(g), Some(b)] => Some([r, g, b]),
            _ => None,
        };
        reader.want([x, y, z].into_iter().chain(rgb.into_iter().flatten()));

        let mut batch = PlyBatch::default();
        while reader.read_batch(&mut batch)? {
            for row in 0..batch.len() {
                let vertex = batch.first_row() + row as u64;
                let segment = usize::try_from(vertex).ok().and_then(|vertex| segments.get(vertex));
                let object = segment.and_then(|segment| object_of.get(segment));
                let Some(group) = object.and_then(|object| aggregation.seg_groups.get(*object)) else {
                    continue;
                };

                let color = match color_of(&element, &batch, rgb, row, colors) {
                    Color::Rgb(rgb) => rgb,
                    Color::Wider => return Ok(false),
                    Color::Beyond(_) => {
                        reading.fault(reader.fail(&batch, row, "no colour"))?;
                        continue;
                    }
                };

                let point = Row {
                    position: DVec3::from_array(
                        [x, y, z].map(|p| batch.scalars(p).get(row).copied().unwrap_or(f64::NAN)),
                    ),
                    color,
                    class: Value::Name(group.label.trim()),
                    instance: group.object().map_or(Value::None, Value::Whole),
                    room: Value::None,
                    measured: Measured::default(),
                };
                reading.push(vertex + 1, &point)?;
            }
        }

        if object_of.is_empty() {
            let message =
                format!("has no object: nothing of {} is annotated", quote(name_of(&self.mesh).as_bytes()));
            return Err(Error::format(&self.aggregation, message));
        }
        Ok(true)
    }
}
