//! The dense labelled point cloud: a PLY file, and, by room and instance, `pointcloud.mat` and the S3DIS tree
//! that loaders read. `pointcloud_boxes.json` lists the files of the tree with the boxes of their points.
//!
//! [`draw_points`] draws the points in the order of these files, and a [`PointSink`] takes them.

use crate::context::{Context, Progress};
use crate::error::Result;
use crate::survey::annotated::SurveyedRoom;
use crate::survey::labelled_area::LabelledArea;
use crate::survey::room_names::RoomNames;
use glam::DVec3;
use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_io::cloud::{MatWriter, PlyPointWriter, S3disAreaWriter, S3disRoomWriter};
use s3d_io::dataset::{Layout, PointBox, write_point_boxes};
use s3d_label::{Label, LabelId, LabelTable, Room};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Points drawn at a time. No more are in memory, however large the cloud is.
const CHUNK: u64 = 1 << 18;

/// The room of every label of an area, and the instance's number there.
pub(crate) type Places = BTreeMap<LabelId, (Room, u32)>;

/// What the points of an area are drawn from.
pub(crate) struct PointPlan<'a> {
    pub(crate) mesh: &'a TriMesh,
    pub(crate) label_of_face: &'a [LabelId],
    pub(crate) table: &'a LabelTable,
    /// The files of the tree are named by the numbers in the rooms.
    pub(crate) places: Places,
    pub(crate) points_per_m2: f64,
    pub(crate) seed: u64,
}

/// Where drawn points go, in the order of the calls.
pub(crate) trait PointSink {
    /// Begins a file of so many points in all.
    fn begin(&mut self, count: u64) -> Result<()>;
    /// Begins a room with points. Its instances follow.
    fn begin_room(&mut self, room: Room) -> Result<()>;
    /// Takes the points of an instance of the room, which has this number there.
    fn instance(&mut self, id: LabelId, label: &Label, number: u32, draw: &mut Draw<'_>) -> Result<()>;
    /// Ends a room.
    fn end_room(&mut self) -> Result<()>;
    /// Takes the points of faces without an instance.
    fn others(&mut self, id: LabelId, draw: &mut Draw<'_>) -> Result<()>;
}

/// Samples the labelled mesh, and hands out the points, grouped by room and instance. The points of
/// unlabelled faces come last. Returns the number of points.
pub(crate) fn draw_points(ctx: &Context, plan: &PointPlan<'_>, sink: &mut dyn PointSink) -> Result<u64> {
    let PointPlan { mesh, label_of_face, table, places, points_per_m2, seed } = plan;
    let mut faces: Vec<u32> = (0..mesh.faces().len() as u32).collect();
    faces.sort_by_cached_key(|face| {
        let label = label_of_face[*face as usize];
        (
            places
                .get(&label)
                .map_or((true, None), |(room, _)| (false, Some(*room))),
            label,
        )
    });
    let rooms: Vec<(Option<Room>, Vec<Run>)> = runs(&faces, label_of_face, places);

    let sampler = SurfaceSampler::over_faces(mesh, faces, Density::PerM2(*points_per_m2), *seed);
    let mut draw = Draw {
        progress: ctx.progress("sampling", "points", sampler.len()),
        sampler: &sampler,
        cloud: PointCloud::default(),
        left: 0..0,
    };
    sink.begin(sampler.len())?;

    for (room, runs) in rooms {
        // A room without points is not in the tree: loaders stop at a room without annotations.
        let points_of =
            |run: &Run| sampler.points_before(run.faces.start)..sampler.points_before(run.faces.end);
        let room = room.filter(|_| runs.iter().any(|run| !points_of(run).is_empty()));
        if let Some(room) = room {
            sink.begin_room(room)?;
        }

        for run in runs {
            draw.left = points_of(&run);
            match table.get(run.label) {
                Some(label) if room.is_some() && !draw.left.is_empty() => {
                    sink.instance(run.label, label, run.number_in_room, &mut draw)?;
                }
                _ => sink.others(run.label, &mut draw)?,
            }
        }

        if room.is_some() {
            sink.end_room()?;
        }
    }
    Ok(sampler.len())
}

/// Points that are drawn piece by piece.
pub(crate) struct Draw<'a> {
    progress: Progress<'a>,
    sampler: &'a SurfaceSampler<'a>,
    cloud: PointCloud,
    /// The points that are to be drawn next.
    left: Range<u64>,
}

impl Draw<'_> {
    /// Draws the points, and hands out each piece.
    pub(crate) fn each(&mut self, mut take: impl FnMut(&PointCloud) -> Result<()>) -> Result<()> {
        while !self.left.is_empty() {
            self.progress.context.check()?;
            let end = self.left.end.min(self.left.start + CHUNK);
            self.sampler.sample(self.left.start..end, &mut self.cloud);
            take(&self.cloud)?;
            self.progress.add(end - self.left.start);
            self.left.start = end;
        }
        Ok(())
    }
}

/// Consecutive faces of one label, as positions in the sampler's order.
struct Run {
    faces: Range<usize>,
    label: LabelId,
    number_in_room: u32,
}

/// The runs of ordered faces, by room; faces without a label have no room.
fn runs(faces: &[u32], label_of_face: &[LabelId], places: &Places) -> Vec<(Option<Room>, Vec<Run>)> {
    let mut rooms: Vec<(Option<Room>, Vec<Run>)> = Vec::new();
    let mut start = 0;
    for run in faces.chunk_by(|a, b| label_of_face[*a as usize] == label_of_face[*b as usize]) {
        let label = label_of_face[run[0] as usize];
        let (room, number_in_room) = places
            .get(&label)
            .map_or((None, 0), |(room, number)| (Some(*room), *number));
        let run = Run { faces: start..start + run.len(), label, number_in_room };
        start = run.faces.end;
        match rooms.last_mut() {
            Some((last, runs)) if *last == room => runs.push(run),
            _ => rooms.push((room, vec![run])),
        }
    }
    rooms
}

/// The places of an area's labels.
pub(crate) fn places(rooms: &[RoomNames], table: &LabelTable) -> Places {
    let mut places = Places::new();
    for room in rooms {
        for instance in &room.instances {
            if let Some(id) = table.id_of(&instance.label) {
                places.insert(id, (room.room, instance.number_in_room));
            }
        }
    }
    places
}

/// Samples the labelled mesh and writes all files of points. Without any label, only the PLY file is written.
/// Its header has `offset_m`, the mesh's offset. Returns the number of points.
pub(crate) fn write_points(
    ctx: &Context,
    layout: &Layout,
    mesh: &TriMesh,
    plan: &LabelledArea,
    table: &LabelTable,
    (points_per_m2, seed): (f64, u64),
    offset_m: DVec3,
) -> Result<u64> {
    let annotated = &plan.annotated;
    let places = places(&plan.names, table);
    let mut files =
        Files { layout, area: plan.area, offset_m, ply: None, by_room: None, rooms: &annotated.rooms };
    if !places.is_empty() {
        files.by_room = Some(ByRoom::create(layout, plan.area)?);
    }

    let plan =
        PointPlan { mesh, label_of_face: &annotated.label_of_face, table, places, points_per_m2, seed };
    let count = draw_points(ctx, &plan, &mut files)?;
    files.finish()?;
    Ok(count)
}

/// The files of an area's points.
struct Files<'a> {
    layout: &'a Layout,
    area: u32,
    offset_m: DVec3,
    /// The rooms with the directions of their walls.
    rooms: &'a [SurveyedRoom],
    /// All points. `None` before their number is known.
    ply: Option<PlyPointWriter>,
    /// The points of instances. `None` without labels.
    by_room: Option<ByRoom>,
}

/// The files with the points of instances.
struct ByRoom {
    tree: S3disAreaWriter,
    mat: MatWriter,
    /// The files of the room that is being written.
    room: Option<S3disRoomWriter>,
    /// The rooms with points.
    in_tree: BTreeSet<Room>,
    boxes: Vec<PointBox>,
}

impl ByRoom {
    fn create(layout: &Layout, area: u32) -> Result<Self> {
        Ok(Self {
            tree: S3disAreaWriter::create(&layout.s3dis_area_dir(area))?,
            mat: MatWriter::create(&layout.point_cloud_mat(area), &format!("Area_{area}"))?,
            room: None,
            in_tree: BTreeSet::new(),
            boxes: Vec::new(),
        })
    }
}

impl PointSink for Files<'_> {
    fn begin(&mut self, count: u64) -> Result<()> {
        let path = self.layout.point_cloud(self.area);
        self.ply = Some(PlyPointWriter::create_moved(&path, count, self.offset_m)?);
        Ok(())
    }

    fn begin_room(&mut self, room: Room) -> Result<()> {
        let Some(files) = &mut self.by_room else { return Ok(()) };
        let name = room.to_string();
        let surveyed = self.rooms.iter().find(|surveyed| surveyed.room == room);
        files.room = Some(files.tree.room(&name)?);
        files
            .mat
            .room(&name, surveyed.map_or(0, |surveyed| surveyed.wall_direction_deg))?;
        files.in_tree.insert(room);
        Ok(())
    }

    fn instance(&mut self, id: LabelId, label: &Label, number: u32, draw: &mut Draw<'_>) -> Result<()> {
        let Some(ByRoom { room: Some(room), mat, boxes, .. }) = &mut self.by_room else {
            return self.others(id, draw);
        };
        let class = label.class.name();
        let mut instance = room.instance(class, number)?;
        mat.object(&format!("{class}_{number}"), &label.to_string())?;
        draw.each(|cloud| {
            append(&mut self.ply, cloud, id)?;
            instance.append(&cloud.positions, &cloud.colors)?;
            Ok(mat.append(&cloud.positions, &cloud.colors)?)
        })?;

        let written = instance.finish()?;
        boxes.push(PointBox {
            label: label.to_string(),
            class: class.to_owned(),
            room: label.room.to_string(),
            points: written.points,
            bbox: written.bbox,
        });
        Ok(())
    }

    fn end_room(&mut self) -> Result<()> {
        if let Some(room) = self.by_room.as_mut().and_then(|files| files.room.take()) {
            room.finish()?;
        }
        Ok(())
    }

    fn others(&mut self, id: LabelId, draw: &mut Draw<'_>) -> Result<()> {
        draw.each(|cloud| append(&mut self.ply, cloud, id))
    }
}

/// Appends points of one label to the PLY file.
fn append(ply: &mut Option<PlyPointWriter>, cloud: &PointCloud, id: LabelId) -> Result<()> {
    if let Some(ply) = ply {
        ply.append(cloud, &vec![id.0; cloud.len()])?;
    }
    Ok(())
}

impl Files<'_> {
    fn finish(self) -> Result<()> {
        if let Some(ply) = self.ply {
            ply.finish()?;
        }
        if let Some(ByRoom { tree, mat, in_tree, boxes, .. }) = self.by_room {
            mat.finish()?;
            let rooms = self.rooms.iter().filter(|surveyed| in_tree.contains(&surveyed.room));
            let angles: Vec<(String, u32)> =
                rooms.map(|r| (r.room.to_string(), r.wall_direction_deg)).collect();
            tree.alignment(&angles)?;
            write_point_boxes(&self.layout.point_boxes_json(self.area), &boxes)?;
        }
        Ok(())
    }
}
