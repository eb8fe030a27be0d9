//! Checks the sampled points: they lie on their faces, have the labels of their faces, and are the same in
//! every form.

use super::labels::Labels;
use super::mesh::LabelledMesh;
use super::report::{Report, Topic};
use crate::record::manifest::Manifest;
use s3d_geom::{PointCloud, TriMesh};
use s3d_io::cloud::{LabelledPoint, LabelledPoints, MatArea, MatObject, PointReader};
use s3d_io::dataset::Layout;
use s3d_io::fs::read_json;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const POINTS: (Topic, &str) = (Topic::Points, "points and their faces");
const FORMS: (Topic, &str) = (Topic::Points, "points in several forms");

/// The number of points that are read at once.
const CHUNK: usize = 1 << 16;

/// The largest distance of a point from its face, relative to its coordinates: their rounding.
const ROUNDING: f64 = 1e-6;

/// Checks an area's points. With `full` also checks the S3DIS tree and `pointcloud.mat`.
pub(crate) fn check(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    mesh: &LabelledMesh,
    labels: &Labels,
    full: bool,
    report: &Report,
) {
    let path = layout.point_cloud(area);
    let Some(mut points) = report.read(Topic::Points, &path, LabelledPoints::open) else { return };
    if let Some(manifest) = manifest.area(area) {
        report.check(points.count() == manifest.points, POINTS, &path, || {
            format!("{} points, and the manifest tells of {}", points.count(), manifest.points)
        });
    }

    let mut forms = full.then(|| Forms::open(layout, area, labels, report));
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
        if let Some(forms) = &mut forms {
            chunk
                .chunk_by(|a, b| a.label == b.label)
                .for_each(|run| forms.meet(run));
        }
    }

    report.check(faults == 0, POINTS, &path, || {
        let (index, why) = first.unwrap_or_default();
        format!("{faults} of {at} points do not fit their faces, the first is point {index} (from 0): {why}")
    });
    if let Some(forms) = forms {
        forms.finish();
    }
}

/// Checks a point against its face, and returns what is wrong with it.
fn fits(point: &LabelledPoint, mesh: &LabelledMesh, labels: &Labels) -> Result<(), String> {
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

#[derive(Deserialize)]
struct Number {
    room: String,
    class: String,
    number_in_room: u32,
    label: String,
}

/// The other files with the labelled points, read in step with the cloud.
struct Forms<'a> {
    layout: &'a Layout,
    area: u32,
    labels: &'a Labels,
    report: &'a Report,
    /// The room and file in the tree, by label.
    places: BTreeMap<String, (String, String)>,
    objects: BTreeMap<String, MatObject>,
    label: u32,
    instance: Option<Reader>,
    room: Option<(String, Reader)>,
    object: PointCloud,
    object_at: usize,
    met: BTreeSet<PathBuf>,
}

struct Reader {
    path: PathBuf,
    points: PointReader,
    /// Whether a difference was reported. One report a file is enough.
    is_reported: bool,
}

impl<'a> Forms<'a> {
    fn open(layout: &'a Layout, area: u32, labels: &'a Labels, report: &'a Report) -> Self {
        let numbers: Vec<Number> = report
            .read(Topic::Points, &layout.instance_numbers_json(area), read_json)
            .unwrap_or_default();
        let places = numbers
            .iter()
            .map(|n| {
                let file = format!("{}_{}.txt", n.class, n.number_in_room);
                (n.label.clone(), (n.room.clone(), file))
            })
            .collect();

        let mat = report.read(Topic::Points, &layout.point_cloud_mat(area), MatArea::open);
        let objects = mat.into_iter().flat_map(|m| m.rooms).flat_map(|r| r.objects);
        let objects = objects
            .map(|o| (o.global_name.clone().unwrap_or_else(|| o.name.clone()), o))
            .collect();

        Self {
            layout,
            area,
            labels,
            report,
            places,
            objects,
            label: 0,
            instance: None,
            room: None,
            object: PointCloud::default(),
            object_at: 0,
            met: BTreeSet::new(),
        }
    }

    /// Compares the next points of the cloud, all of one label.
    fn meet(&mut self, run: &[LabelledPoint]) {
        let label = run[0].label;
        if label == 0 {
            return;
        }
        if label != self.label {
            self.begin(label);
        }

        for reader in [self.instance.as_mut(), self.room.as_mut().map(|(_, r)| r)]
            .into_iter()
            .flatten()
        {
            reader.compare(run, self.report);
        }

        let end = self.object_at + run.len();
        let same = self.object.positions.get(self.object_at..end).is_some_and(|positions| {
            let colors = &self.object.colors[self.object_at..end];
            run.iter()
                .zip(positions.iter().zip(colors))
                .all(|(p, (q, c))| near(p, *q, *c))
        });

        self.report
            .check(same, FORMS, &self.layout.point_cloud_mat(self.area), || {
                format!("the points of {} are not those of pointcloud.ply", self.labels.name_of(label))
            });
        self.object_at = end;
    }

    /// Opens the files of the next label.
    fn begin(&mut self, label: u32) {
        self.end();
        self.label = label;
        let name = self.labels.name_of(label);
        if let Some((room, file)) = self.places.get(name) {
            let folder = self.layout.s3dis_area_dir(self.area).join(room);
            self.instance = Reader::open(folder.join("Annotations").join(file), self.report);
            if self.room.as_ref().is_none_or(|(open, _)| open != room) {
                if let Some((_, reader)) = self.room.take() {
                    reader.end(self.report);
                }
                let reader = Reader::open(folder.join(format!("{room}.txt")), self.report);
                self.room = reader.map(|reader| (room.clone(), reader));
            }
        }

        self.met.extend(self.instance.as_ref().map(|r| r.path.clone()));
        self.met.extend(self.room.as_ref().map(|(_, r)| r.path.clone()));
        if let Some(object) = self.objects.get(name) {
            let _ = self.report.ok(Topic::Points, object.read(&mut self.object));
        }
    }

    /// Closes the files of a label, and checks that they have no more points.
    fn end(&mut self) {
        if let Some(reader) = self.instance.take() {
            reader.end(self.report);
        }
        let left = self.object.len() == self.object_at;
        self.report
            .check(left, FORMS, &self.layout.point_cloud_mat(self.area), || {
                let name = self.labels.name_of(self.label);
                format!("{} has {} points, and {} in pointcloud.ply", name, self.object.len(), self.object_at)
            });
        self.object.clear();
        self.object_at = 0;
    }

    /// Closes all files, and checks that the tree has no other files.
    fn finish(mut self) {
        self.end();
        if let Some((_, reader)) = self.room.take() {
            reader.end(self.report);
        }
        for path in super::files::walk(&self.layout.s3dis_area_dir(self.area), self.report) {
            let is_list = path.to_string_lossy().ends_with("_alignmentAngle.txt");
            self.report
                .check(is_list || self.met.contains(&path), FORMS, &path, || {
                    "its points are not in pointcloud.ply".to_owned()
                });
        }
    }
}

/// Whether a point equals one in another form. Text has three decimal places.
fn near(p: &LabelledPoint, q: glam::Vec3, color: [u8; 3]) -> bool {
    let far = 5.1e-4 + 1e-6 * p.position.abs().max_element();
    p.position.abs_diff_eq(q, far) && p.color == color
}

impl Reader {
    fn open(path: PathBuf, report: &Report) -> Option<Self> {
        let points = report.read(Topic::Points, &path, PointReader::open)?;
        Some(Self { path, points, is_reported: false })
    }

    /// Compares the next points of the file with the cloud's.
    fn compare(&mut self, run: &[LabelledPoint], report: &Report) {
        if self.is_reported {
            return;
        }

        let mut cloud = PointCloud::default();
        let fault = loop {
            let at = cloud.len();
            match self.points.read_chunk(run.len() - at, &mut cloud) {
                Ok(0) => break Some(format!("ends {} points too early", run.len() - at)),
                Ok(_) if cloud.len() < run.len() => {}
                Ok(_) => {
                    let mut pairs = run.iter().zip(cloud.positions.iter().zip(&cloud.colors));
                    let same = pairs.all(|(p, (q, c))| near(p, *q, *c));
                    break (!same).then(|| "its points are not those of pointcloud.ply".to_owned());
                }
                Err(e) => {
                    report.unreadable(Topic::Points, &e);
                    self.is_reported = true;
                    return;
                }
            }
        };

        self.is_reported = fault.is_some();
        let path: &Path = &self.path;
        report.check(fault.is_none(), FORMS, path, || fault.unwrap_or_default());
    }

    /// Checks that the file has no more points.
    fn end(mut self, report: &Report) {
        let mut cloud = PointCloud::default();
        let more = !self.is_reported && self.points.read_chunk(1, &mut cloud).is_ok_and(|n| n > 0);
        report.check(!more, FORMS, &self.path, || "has more points than pointcloud.ply".to_owned());
    }
}
