//! From annotated points to labelled faces: votes, instances, floor outlines, wall directions.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::export::inputs::AreaInput;
use glam::Vec3;
use s3d_geom::{
    Aabb, Footprint, FootprintBuilder, FootprintOptions, Nearest, NearestFaces, PointCloud, TriMesh,
    dominant_wall_direction_deg,
};
use s3d_io::Error as FileError;
use s3d_io::cloud::{InstanceReader, PointPasses};
use s3d_label::{Class, Label, LabelId, LabelTable, Room, VoteReport, Votes};
use std::collections::BTreeMap;

/// Points that are in memory, three times: while some are looked up, those that follow are read.
const BLOCK_POINTS: usize = 1 << 19;

/// A share of points far from every face above which it is told.
const MANY_FAR: f64 = 0.05;

/// A share of labelled faces below which it is told.
const FEW_LABELLED: f64 = 0.5;

/// An annotated area.
#[derive(Debug)]
pub(crate) struct Annotated {
    /// The label of each face of the mesh; [`LabelId::NULL`] where no point voted.
    pub(crate) face_labels: Vec<LabelId>,
    pub(crate) report: VoteReport,
    /// The rooms, in the order of their names.
    pub(crate) rooms: Vec<SurveyedRoom>,
    /// Annotated points.
    pub(crate) points: u64,
    pub(crate) skipped: SkippedLines,
}

/// What a lenient reading left out of the files of instances.
#[derive(Debug, Default)]
pub(crate) struct SkippedLines {
    lines: u64,
    empty_instances: u64,
    /// The first place.
    first: Option<String>,
}

impl SkippedLines {
    /// A sentence on it, if there is something.
    pub(crate) fn sentence(&self) -> Option<String> {
        let first = self.first.as_ref()?;
        Some(format!(
            "{} lines of annotations and {} instances without points left out, the first: {first}",
            self.lines, self.empty_instances
        ))
    }
}

/// What is known of a room from its points and faces.
#[derive(Debug)]
pub(crate) struct SurveyedRoom {
    pub(crate) room: Room,
    pub(crate) points: u64,
    pub(crate) footprint: Footprint,
    /// The box of its points.
    pub(crate) bbox: Aabb,
    /// The dominant horizontal direction of its walls, whole degrees in [0, 90).
    pub(crate) wall_direction_deg: u32,
}

/// One instance with its points, as [`annotate`] hands it out.
pub(crate) struct AnnotatedInstance<'a> {
    pub(crate) label: Label,
    pub(crate) id: LabelId,
    /// The box of its points.
    pub(crate) bbox: Aabb,
    /// Its points, at least one, to be gone through again.
    pub(crate) points: &'a mut dyn PointPasses,
}

/// Reads an area's annotated points, one instance at a time and block by block, and lets each vote for its nearest face.
/// `each` gets every instance with its box and points, in the order of rooms and of numbers in the room.
pub(crate) fn annotate(
    ctx: &Context,
    area: &AreaInput,
    nearest_faces: &NearestFaces<'_>,
    table: &LabelTable,
    mut each: impl FnMut(AnnotatedInstance<'_>) -> Result<()> + Send,
) -> Result<Annotated> {
    let mesh = nearest_faces.mesh();
    let mut votes = Votes::new(mesh.faces().len());
    let mut rooms = Vec::new();
    // The last room's points: its outline is drawn beside what follows.
    let mut undrawn: Option<FootprintBuilder> = None;
    let mut total = 0u64;
    let mut skipped = SkippedLines::default();
    let lenient = area.lenient;
    let mut corners: Option<Corners> = None;
    let files = area.rooms.iter().map(|r| r.instances.len()).sum::<usize>();
    let progress = ctx.progress("labelling", "instances", files as u64);
    let mut reader = InstanceReader::new(BLOCK_POINTS);
    let mut nearest: Vec<Nearest> = Vec::new();
    let mut following = area.rooms.iter().flat_map(|r| &r.instances).skip(1);
    for room in &area.rooms {
        let mut builder = FootprintBuilder::new(FootprintOptions::default());
        let (mut points, mut room_bbox) = (0u64, Aabb::EMPTY);
        for instance in &room.instances {
            let id = table.id_of(&instance.label).unwrap_or(LabelId::NULL);
            let then = following.next().map(|instance| &instance.points);
            ctx.check()?;
            let (mut bbox, mut is_handed_out) = (Aabb::EMPTY, false);
            let vote_for_all = |block: &PointCloud, is_whole: bool| -> Result<()> {
                ctx.check()?;
                bbox = bbox.union(Aabb::from_points(block.positions.iter().copied()));
                let vote = || {
                    if instance.points.are_vertices() {
                        let corners = corners.get_or_insert_with(|| Corners::new(mesh));
                        corners.vote(&block.positions, id, &mut votes, nearest_faces, &mut nearest);
                        Ok(())
                    } else if has_faces(block) {
                        vote_for_faces(block, id, &mut votes)
                            .map_err(|m| FileError::format(instance.points.path(), m))
                    } else {
                        nearest_faces.nearest_many(&block.positions, &mut nearest);
                        nearest.iter().for_each(|n| votes.add(n.face, id, n.distance_m));
                        Ok(())
                    }
                };
                // Votes are counted by one thread; the others draw the floor's outline, and write.
                let outline = || block.positions.iter().for_each(|p| builder.add(*p));
                let hand_out = || {
                    if !is_whole {
                        return Ok(());
                    }
                    is_handed_out = true;
                    let points = &mut &block.positions[..];
                    each(AnnotatedInstance { label: instance.label, id, bbox, points })
                };
                let (voted, ((), handed_out)) = rayon::join(vote, || rayon::join(outline, hand_out));
                voted?;
                handed_out
            };
            let before = undrawn.take();
            let (read, outline) = rayon::join(
                || reader.read(&instance.points, then, vote_for_all),
                || before.map(|b| b.finish()),
            );
            set_outline(&mut rooms, outline);
            let (mut passes, left_out) = read?;
            skipped.lines += left_out.count;
            if let Some(first) = left_out.first {
                skipped.first.get_or_insert(first.to_string());
            }
            progress.add(1);
            if passes.is_empty() {
                let source = instance.points.source();
                if lenient {
                    skipped.empty_instances += 1;
                    skipped.first.get_or_insert(format!("{source}: no point in it"));
                    continue;
                }
                let message = "no point in it: remove the file, or annotate the instance";
                return Err(FileError::format(instance.points.path(), message).into());
            }
            points += passes.len();
            room_bbox = room_bbox.union(bbox);
            if !is_handed_out {
                each(AnnotatedInstance { label: instance.label, id, bbox, points: &mut passes })?;
            }
        }
        total += points;
        // Of a room before one without an instance.
        set_outline(&mut rooms, undrawn.take().map(|b| b.finish()));
        rooms.push(SurveyedRoom {
            room: room.room,
            points,
            footprint: Footprint::default(),
            bbox: room_bbox,
            wall_direction_deg: 0,
        });
        undrawn = Some(builder);
    }
    if rooms.is_empty() {
        return Err(Error::Input(format!("{}: no room in it", area.path.display())));
    }
    let label = || {
        let face_labels = votes.label_of_face();
        let upright = || upright_faces(mesh, table, &face_labels);
        let (upright, report) = rayon::join(upright, || VoteReport::new(&votes, table));
        (face_labels, upright, report)
    };
    let ((face_labels, mut upright, report), outline) = rayon::join(label, || undrawn.map(|b| b.finish()));
    set_outline(&mut rooms, outline);
    for room in &mut rooms {
        room.wall_direction_deg = upright.remove(&room.room).map_or(0, |faces| faces.direction_deg());
    }
    let report = report.map_err(|e| Error::Input(e.to_string()))?;
    Ok(Annotated { face_labels, report, rooms, points: total, skipped })
}

/// Gives the last room its outline, if that is drawn now.
fn set_outline(rooms: &mut [SurveyedRoom], outline: Option<Footprint>) {
    if let (Some(room), Some(outline)) = (rooms.last_mut(), outline) {
        room.footprint = outline;
    }
}

/// Whether it is known which face each point belongs to.
fn has_faces(block: &PointCloud) -> bool {
    block.faces.len() == block.len()
}

/// Lets each point vote for the face that it belongs to, or says which face there is not.
fn vote_for_faces(block: &PointCloud, id: LabelId, votes: &mut Votes) -> Result<(), String> {
    for face in &block.faces {
        if *face as usize >= votes.face_count() {
            return Err(format!("a point is of face {face}; the mesh has {}", votes.face_count()));
        }
        votes.add(*face, id, 0.0);
    }
    Ok(())
}

/// What looks wrong between mesh and annotations, as a sentence each.
pub(crate) fn label_doubts(report: &VoteReport) -> Vec<String> {
    let mut doubts = Vec::new();
    let far = report.total.far_points as f64 / report.total.points.max(1) as f64;
    if far > MANY_FAR {
        doubts.push(format!(
            "{:.0} % of the annotated points are farther than 5 cm from every face: do mesh and annotations share a \
             frame? see `up` in the scene file",
            100.0 * far
        ));
    }
    let labelled = report.total.faces as f64 / report.face_count.max(1) as f64;
    if labelled < FEW_LABELLED {
        doubts.push(format!(
            "only {:.0} % of the faces get a label: the others are written as {}",
            100.0 * labelled,
            s3d_label::NULL_NAME
        ));
    }
    doubts
}

/// A sentence on the instances that no face is labelled with, if there are some: they are in the label table, but in no
/// image and no sampled point.
pub(crate) fn hidden_instances(
    area: &AreaInput,
    face_labels: &[LabelId],
    table: &LabelTable,
) -> Option<String> {
    let mut seen = vec![false; table.len()];
    face_labels.iter().for_each(|label| seen[label.0 as usize] = true);
    let instances = area.rooms.iter().flat_map(|r| &r.instances);
    let mut hidden = instances.filter(|i| table.id_of(&i.label).is_none_or(|id| !seen[id.0 as usize]));
    let first = hidden.next()?;
    Some(format!(
        "{} annotated instances win no face of the mesh, the first {}: they are in no image and no sampled point",
        1 + hidden.count(),
        first.points.source()
    ))
}

/// The faces around each place where the mesh has a corner, for annotations that are its own vertices: such a point is
/// equally near to all of them, and the nearest face by index alone would leave every other face without a vote.
struct Corners {
    /// The bits of a corner's place, and a face; sorted.
    faces: Vec<([u32; 3], u32)>,
}

impl Corners {
    fn new(mesh: &TriMesh) -> Self {
        let mut faces: Vec<([u32; 3], u32)> = Vec::with_capacity(3 * mesh.faces().len());
        for (face, corners) in (0u32..).zip(mesh.faces()) {
            faces.extend(corners.iter().map(|v| (Self::key(mesh.positions()[*v as usize]), face)));
        }
        faces.sort_unstable();
        faces.dedup();
        Self { faces }
    }

    /// The place to the bit, whatever the sign of a zero.
    fn key(position: Vec3) -> [u32; 3] {
        (position + 0.0).to_array().map(f32::to_bits)
    }

    /// The faces that have a corner there.
    fn around(&self, position: Vec3) -> impl Iterator<Item = u32> {
        let key = Self::key(position);
        let start = self.faces.partition_point(|(k, _)| *k < key);
        self.faces[start..].iter().take_while(move |(k, _)| *k == key).map(|(_, face)| *face)
    }

    /// Lets each point vote for all faces around it, or for the nearest if it is no corner of the mesh.
    fn vote(
        &self,
        positions: &[Vec3],
        id: LabelId,
        votes: &mut Votes,
        nearest_faces: &NearestFaces<'_>,
        nearest: &mut Vec<Nearest>,
    ) {
        let mut others = Vec::new();
        for position in positions {
            let mut is_corner = false;
            for face in self.around(*position) {
                votes.add(face, id, 0.0);
                is_corner = true;
            }
            if !is_corner {
                others.push(*position);
            }
        }
        nearest_faces.nearest_many(&others, nearest);
        for n in nearest.iter() {
            votes.add(n.face, id, n.distance_m);
        }
    }
}

/// The faces of a room that tell how its walls run: normals and areas.
#[derive(Default)]
struct UprightFaces {
    walls: Vec<(Vec3, f64)>,
    others: Vec<(Vec3, f64)>,
}

impl UprightFaces {
    /// The dominant direction of the walls, or of all faces if no wall is annotated; 0 if none stands upright.
    fn direction_deg(self) -> u32 {
        let of = |faces: Vec<(Vec3, f64)>| dominant_wall_direction_deg(faces.into_iter());
        of(self.walls).or_else(|| of(self.others)).map_or(0, |deg| deg.round() as u32 % 90)
    }
}

/// The normals and areas of each room's faces.
fn upright_faces(
    mesh: &TriMesh,
    table: &LabelTable,
    face_labels: &[LabelId],
) -> BTreeMap<Room, UprightFaces> {
    let mut rooms: BTreeMap<Room, UprightFaces> = BTreeMap::new();
    for (face, label) in (0u32..).zip(face_labels) {
        if let Some(label) = table.get(*label) {
            let room = rooms.entry(label.room).or_default();
            let faces = if label.class == Class::Wall { &mut room.walls } else { &mut room.others };
            faces.push((mesh.normal(face), mesh.area(face)));
        }
    }
    rooms
}
