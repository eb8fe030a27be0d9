//! The dense labelled point cloud: a PLY file, and, by room and instance, `pointcloud.mat` and the S3DIS tree
//! that loaders read.

use crate::context::{Context, Progress};
use crate::error::Result;
use crate::survey::labelled_area::LabelledArea;
use glam::DVec3;
use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_io::cloud::{MatWriter, PlyPointWriter, S3disAreaWriter};
use s3d_io::dataset::Layout;
use s3d_label::{LabelId, LabelTable, Room};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Points drawn at a time. No more are in memory, however large the cloud is.
const CHUNK: u64 = 1 << 18;

/// The room of every label of an area, and the instance's number there.
type Places = BTreeMap<LabelId, (Room, u32)>;

/// Samples the labelled mesh and writes the points, grouped by room and instance. The points of unlabelled
/// faces come last, and only into the PLY file. Its header has `offset_m`, the mesh's offset. Without any
/// label, only the PLY file is written. Returns the number of points.
pub(crate) fn write_points(
    ctx: &Context,
    layout: &Layout,
    mesh: &TriMesh,
    plan: &LabelledArea,
    table: &LabelTable,
    (density, seed): (Density, u64),
    offset_m: DVec3,
) -> Result<u64> {
    let annotated = &plan.annotated;
    let place = places(plan, table);

    let mut faces: Vec<u32> = (0..mesh.faces().len() as u32).collect();
    faces.sort_by_cached_key(|face| {
        let label = annotated.label_of_face[*face as usize];
        (place.get(&label).map_or((true, None), |(room, _)| (false, Some(*room))), label)
    });
    let rooms: Vec<(Option<Room>, Vec<Run>)> = runs(&faces, &annotated.label_of_face, &place);

    let number = plan.area;
    let sampler = SurfaceSampler::over_faces(mesh, faces, density, seed);
    let mut sink = Sink {
        ply: PlyPointWriter::create_moved(&layout.point_cloud(number), sampler.len(), offset_m)?,
        progress: ctx.progress("sampling", "points", sampler.len()),
        sampler: &sampler,
        cloud: PointCloud::default(),
    };

    if place.is_empty() {
        sink.write(0..sampler.len(), LabelId::NULL, |_| Ok(()))?;
        sink.ply.finish()?;
        return Ok(sampler.len());
    }

    let tree = S3disAreaWriter::create(&layout.s3dis_area_dir(number))?;
    let mut mat = MatWriter::create(&layout.point_cloud_mat(number), &format!("Area_{number}"))?;
    let angle_of: BTreeMap<Room, u32> =
        annotated.rooms.iter().map(|r| (r.room, r.wall_direction_deg)).collect();

    let mut in_tree = BTreeSet::new();
    for (room, runs) in rooms {
        // A room without points is not in the tree: loaders stop at a room without annotations.
        let has_points = runs
            .iter()
            .any(|r| sampler.points_before(r.faces.start) < sampler.points_before(r.faces.end));
        let room = room.filter(|_| has_points);
        in_tree.extend(room);

        let mut files = room.map(|room| tree.room(&room.to_string())).transpose()?;
        if let Some(room) = room {
            mat.room(&room.to_string(), angle_of.get(&room).copied().unwrap_or(0))?;
        }

        for run in runs {
            let points = sampler.points_before(run.faces.start)..sampler.points_before(run.faces.end);
            match (&mut files, table.get(run.label)) {
                (Some(files), Some(label)) if !points.is_empty() => {
                    let class = label.class.name();
                    let number = run.number_in_room;
                    let mut instance = files.instance(class, number)?;
                    mat.object(&format!("{class}_{number}"), &label.to_string())?;
                    sink.write(points, run.label, |cloud| {
                        instance.append(&cloud.positions, &cloud.colors)?;
                        mat.append(&cloud.positions, &cloud.colors)
                    })?;
                    instance.finish()?;
                }
                _ => sink.write(points, run.label, |_| Ok(()))?,
            }
        }

        if let Some(files) = files {
            files.finish()?;
        }
    }

    sink.ply.finish()?;
    mat.finish()?;

    let surveyed = annotated.rooms.iter().filter(|r| in_tree.contains(&r.room));
    let angles: Vec<(String, u32)> = surveyed.map(|r| (r.room.to_string(), r.wall_direction_deg)).collect();
    tree.alignment(&angles)?;
    Ok(sampler.len())
}

/// The places of an area's labels. The files of the tree are named by the numbers in the rooms.
fn places(plan: &LabelledArea, table: &LabelTable) -> Places {
    let mut place = Places::new();
    for room in &plan.names {
        for instance in &room.instances {
            if let Some(id) = table.id_of(&instance.label) {
                place.insert(id, (room.room, instance.number_in_room));
            }
        }
    }
    place
}

/// Consecutive faces of one label, as positions in the sampler's order.
struct Run {
    faces: Range<usize>,
    label: LabelId,
    number_in_room: u32,
}

/// The runs of ordered faces, by room; faces without a label have no room.
fn runs(faces: &[u32], label_of_face: &[LabelId], place: &Places) -> Vec<(Option<Room>, Vec<Run>)> {
    let mut rooms: Vec<(Option<Room>, Vec<Run>)> = Vec::new();
    let mut start = 0;
    for run in faces.chunk_by(|a, b| label_of_face[*a as usize] == label_of_face[*b as usize]) {
        let label = label_of_face[run[0] as usize];
        let (room, number_in_room) = place
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

/// Where the points go: all into the PLY file, and each chunk to a second writer.
struct Sink<'a> {
    ply: PlyPointWriter,
    progress: Progress<'a>,
    sampler: &'a SurfaceSampler<'a>,
    cloud: PointCloud,
}

impl Sink<'_> {
    fn write(
        &mut self,
        points: Range<u64>,
        label: LabelId,
        mut also: impl FnMut(&PointCloud) -> s3d_io::Result<()>,
    ) -> Result<()> {
        let mut at = points.start;
        while at < points.end {
            self.progress.context.check()?;
            let end = points.end.min(at + CHUNK);
            self.sampler.sample(at..end, &mut self.cloud);
            self.ply.append(&self.cloud, &vec![label.0; self.cloud.len()])?;
            also(&self.cloud)?;
            self.progress.add(end - at);
            at = end;
        }
        Ok(())
    }
}
