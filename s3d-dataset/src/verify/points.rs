//! Checks the sampled points. They are drawn again from the exported mesh, and every file of them must have
//! the bytes that an export writes: positions, colours, labels, boxes and voxels.

use super::Common;
use super::labels::Labels;
use super::mesh::LabelledMesh;
use super::report::{Report, Topic};
use super::same_bytes::SameBytes;
use crate::error::Result;
use crate::export::points::{Draw, Places, PointPlan, PointSink, draw_points};
use crate::record::manifest::Manifest;
use crate::record::tables::{NumberRecord, RoomRecord};
use glam::DVec3;
use s3d_geom::{Aabb, TriMesh};
use s3d_io::cloud::{
    LabelledPoint, LabelledPoints, MatWriter, PlyPointWriter, s3dis_coordinate, write_s3dis_points,
};
use s3d_io::dataset::{Layout, PointBox, read_point_boxes};
use s3d_io::fs::read_json;
use s3d_label::{Label, LabelId, LabelTable, Room};
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;
use std::path::{Path, PathBuf};

const POINTS: (Topic, &str) = (Topic::Points, "points and their faces");
const FORMS: (Topic, &str) = (Topic::Points, "files of points");

/// The number of points that are read at once.
const CHUNK: usize = 1 << 16;

/// The largest distance of a point from its face, relative to its coordinates: their rounding.
const ROUNDING: f64 = 1e-6;

/// Checks an area's points. A full check also reads the S3DIS tree and `pointcloud.mat`; otherwise only their
/// files must be there.
pub(crate) fn check(common: &Common<'_>, area: u32, mesh: &LabelledMesh, labels: &Labels) -> Result<()> {
    let Common { ctx, layout, manifest, full, report, .. } = *common;
    // A table that is out of order is reported with the labels.
    let table = labels.taxonomy.table_from_names(&labels.names).ok();
    let table = table.filter(|_| manifest.is_of_this_version() && mesh.all_in_table);
    let Some(table) = table else {
        check_faces(layout, area, manifest, mesh, labels, report);
        return Ok(());
    };

    let label_of_face: Vec<LabelId> = mesh.label_of_face.iter().map(|label| LabelId(*label)).collect();
    let plan = PointPlan {
        mesh: &mesh.file.mesh,
        label_of_face: &label_of_face,
        table: &table,
        places: places(layout, area, manifest, &table),
        points_per_m2: manifest.options.points_per_m2,
        seed: manifest.seed,
    };
    let entry = manifest.area(area);
    let mut drawn = DrawnAgain {
        layout,
        area,
        report,
        told: entry.map_or(0, |entry| entry.points),
        offset_m: entry
            .and_then(|entry| entry.offset_m)
            .map_or(DVec3::ZERO, DVec3::from_array),
        angles: angles(layout, area),
        full,
        ply: None,
        mat: None,
        room: None,
        files: BTreeSet::new(),
        boxes: Vec::new(),
    };
    draw_points(ctx, &plan, &mut drawn)?;
    drawn.finish(manifest.is_labelled());
    Ok(())
}

/// Reads the room of each label and its number there. Faulty entries are reported with the instances.
fn places(layout: &Layout, area: u32, manifest: &Manifest, table: &LabelTable) -> Places {
    if !manifest.is_labelled() {
        return Places::new();
    }
    let numbers: Vec<NumberRecord> = read_json(&layout.instance_numbers_json(area)).unwrap_or_default();
    let taxonomy = table.taxonomy();
    numbers
        .iter()
        .filter_map(|n| {
            let label = taxonomy.parse_name(&n.label).ok()??;
            Some((table.id_of(&label)?, (taxonomy.room(&n.room).ok()?, n.number_in_room)))
        })
        .collect()
}

/// Reads the directions of walls by room. A file that cannot be read is reported with the rooms.
fn angles(layout: &Layout, area: u32) -> BTreeMap<String, u32> {
    let rooms: Vec<RoomRecord> = read_json(&layout.rooms_json(area)).unwrap_or_default();
    rooms.into_iter().map(|r| (r.room, r.wall_direction_deg)).collect()
}

/// Compares points that are drawn again with the files of an area.
struct DrawnAgain<'a> {
    layout: &'a Layout,
    area: u32,
    report: &'a Report,
    /// The number of points that the manifest tells.
    told: u64,
    offset_m: DVec3,
    angles: BTreeMap<String, u32>,
    /// Whether the S3DIS tree and `pointcloud.mat` are read.
    full: bool,
    ply: Option<PlyPointWriter<SameBytes>>,
    mat: Option<MatWriter<SameBytes>>,
    /// The name of the room, and its file in the tree if that is read.
    room: Option<(String, Option<SameBytes>)>,
    /// The files that the tree has.
    files: BTreeSet<PathBuf>,
    boxes: Vec<PointBox>,
}

impl PointSink for DrawnAgain<'_> {
    fn begin(&mut self, count: u64) -> Result<()> {
        let told = self.told;
        self.report.check(count == told, POINTS, &self.layout.manifest(), || {
            format!("area {}: {told} points, and its mesh and density give {count}", self.area)
        });

        let path = self.layout.point_cloud(self.area);
        if let Some(file) = SameBytes::open(&path, Topic::Points, self.report) {
            self.ply = Some(PlyPointWriter::new_moved(file, &path, count, self.offset_m)?);
        }
        Ok(())
    }

    fn begin_room(&mut self, room: Room) -> Result<()> {
        let name = room.to_string();
        let path = self.folder(&name).join(format!("{name}.txt"));
        let file = self.file_of_tree(path);

        if self.full {
            if self.mat.is_none() {
                let path = self.layout.point_cloud_mat(self.area);
                self.mat = SameBytes::open(&path, Topic::Points, self.report)
                    .map(|file| MatWriter::new(file, &path, &format!("Area_{}", self.area)))
                    .transpose()?;
            }
            if let Some(mat) = &mut self.mat {
                mat.room(&name, self.angles.get(&name).copied().unwrap_or(0))?;
            }
        }
        self.room = Some((name, file));
        Ok(())
    }

    fn instance(&mut self, id: LabelId, label: &Label, number: u32, draw: &mut Draw<'_>) -> Result<()> {
        let Some((room, mut of_room)) = self.room.take() else { return self.others(id, draw) };
        let name = format!("{}_{number}", label.class);
        let path = self.folder(&room).join("Annotations").join(format!("{name}.txt"));
        let mut of_instance = self.file_of_tree(path);
        if let Some(mat) = &mut self.mat {
            mat.object(&name, &label.to_string())?;
        }

        let mut points = 0;
        let mut bbox = Aabb::EMPTY;
        let mut text = Vec::new();
        draw.each(|cloud| {
            points += cloud.len() as u64;
            bbox = bbox.union(Aabb::from_points(cloud.positions.iter().copied()));
            if let Some(ply) = &mut self.ply {
                ply.append(cloud, &vec![id.0; cloud.len()])?;
            }
            if let Some(mat) = &mut self.mat {
                mat.append(&cloud.positions, &cloud.colors)?;
            }

            if of_room.is_some() || of_instance.is_some() {
                text.clear();
                // Points of a mesh are finite, so memory takes their text.
                let _ = write_s3dis_points(&mut text, &cloud.positions, &cloud.colors);
                for file in [&mut of_room, &mut of_instance].into_iter().flatten() {
                    let _ = file.write_all(&text);
                }
            }
            Ok(())
        })?;

        if let Some(file) = of_instance {
            file.finish(FORMS, self.report);
        }
        self.room = Some((room, of_room));
        self.boxes.push(PointBox {
            label: label.to_string(),
            class: label.class.name().to_owned(),
            room: label.room.to_string(),
            points,
            bbox: bbox.to_array().map(s3dis_coordinate),
        });
        Ok(())
    }

    fn end_room(&mut self) -> Result<()> {
        if let Some((_, Some(file))) = self.room.take() {
            file.finish(FORMS, self.report);
        }
        Ok(())
    }

    fn others(&mut self, id: LabelId, draw: &mut Draw<'_>) -> Result<()> {
        draw.each(|cloud| {
            if let Some(ply) = &mut self.ply {
                ply.append(cloud, &vec![id.0; cloud.len()])?;
            }
            Ok(())
        })
    }
}

impl DrawnAgain<'_> {
    /// The folder of a room in the tree.
    fn folder(&self, room: &str) -> PathBuf {
        self.layout.s3dis_area_dir(self.area).join(room)
    }

    /// Notes that the tree has this file, and opens it if it is to be read.
    fn file_of_tree(&mut self, path: PathBuf) -> Option<SameBytes> {
        let file = if self.full {
            SameBytes::open(&path, Topic::Points, self.report)
        } else {
            self.report.check(path.is_file(), FORMS, &path, || "missing".to_owned());
            None
        };
        self.files.insert(path);
        file
    }

    fn finish(self, is_labelled: bool) {
        let report = self.report;
        if let Some(Ok(file)) = self.ply.map(PlyPointWriter::into_inner) {
            file.finish(FORMS, report);
        }
        if let Some(Ok(file)) = self.mat.map(MatWriter::into_inner) {
            file.finish(FORMS, report);
        }
        if !is_labelled {
            return;
        }

        for path in super::files::walk(&self.layout.s3dis_area_dir(self.area), report) {
            let is_list = path.to_string_lossy().ends_with("_alignmentAngle.txt");
            report.check(is_list || self.files.contains(&path), FORMS, &path, || {
                "the mesh has no points for it".to_owned()
            });
        }
        check_boxes(&self.layout.point_boxes_json(self.area), &self.boxes, report);
    }
}

/// Checks `pointcloud_boxes.json`. Earlier versions did not write it; a file that is listed and missing is
/// told elsewhere.
fn check_boxes(path: &Path, expected: &[PointBox], report: &Report) {
    if !path.exists() {
        return;
    }
    let Some(found) = report.read(Topic::Points, path, read_point_boxes) else { return };
    let differs = found.iter().zip(expected).find(|(found, expected)| found != expected);
    report.check(found.len() == expected.len() && differs.is_none(), FORMS, path, || match differs {
        Some((found, expected)) => format!("has {found:?}, where the points are {expected:?}"),
        None => format!("{} boxes, and {} instances have points", found.len(), expected.len()),
    });
}

/// Checks the points of a data set of another version, which may have drawn them differently: they lie on
/// their faces, and have the labels of their faces.
fn check_faces(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    mesh: &LabelledMesh,
    labels: &Labels,
    report: &Report,
) {
    let path = layout.point_cloud(area);
    let Some(mut points) = report.read(Topic::Points, &path, LabelledPoints::open) else { return };
    if let Some(manifest) = manifest.area(area) {
        report.check(points.count() == manifest.points, POINTS, &path, || {
            format!("{} points, and the manifest tells of {}", points.count(), manifest.points)
        });
    }

    let mut chunk = Vec::new();
    let mut faults = 0u64;
    let mut first = None;
    let mut at = 0u64;
    loop {
        match report.ok(Topic::Points, points.read(CHUNK, &mut chunk)) {
            Some(true) => {}
            Some(false) => break,
            None => return,
        }
        for (k, point) in chunk.iter().enumerate() {
            if let Err(why) = fits(point, mesh, labels) {
                faults += 1;
                first.get_or_insert((at + k as u64, why));
            }
        }
        at += chunk.len() as u64;
    }

    report.check(faults == 0, POINTS, &path, || {
        let (index, why) = first.unwrap_or_default();
        format!("{faults} of {at} points do not fit their faces, the first is point {index} (from 0): {why}")
    });
}

/// Checks a point against its face, and returns what is wrong with it.
fn fits(point: &LabelledPoint, mesh: &LabelledMesh, labels: &Labels) -> std::result::Result<(), String> {
    let Some(&label) = mesh.label_of_face.get(point.face as usize) else {
        return Err(format!("there is no face {}", point.face));
    };
    if label != point.label {
        let is = labels.name_of(point.label);
        let of = labels.name_of(label);
        return Err(format!("its label is {} ({is}), its face's {label} ({of})", point.label));
    }
    let distance = distance_m(&mesh.file.mesh, point);
    if distance.is_nan() || distance > ROUNDING * (1.0 + f64::from(point.position.abs().max_element())) {
        return Err(format!("it is {distance:.3} m from its face {}", point.face));
    }
    Ok(())
}

/// An upper bound on the distance of a point from its face, in m.
fn distance_m(mesh: &TriMesh, point: &LabelledPoint) -> f64 {
    let [a, b, c] = mesh.triangle(point.face).map(|p| p.as_dvec3());
    let p = point.position.as_dvec3();
    let normal = (b - a).cross(c - a);
    let edges = [(a, b), (b, c), (c, a)];
    let twice_area = normal.length();
    let height = ((p - a).dot(normal) / twice_area).abs();
    // The distance beyond each edge, in the plane of the face.
    let beyond = edges.map(|(from, to)| {
        let along = to - from;
        -along.cross(p - from).dot(normal) / (twice_area * along.length())
    });
    beyond.into_iter().fold(height, f64::max)
}
