//! From annotated points to labelled faces: votes, instances, floor outlines, wall directions.

use crate::context::Context;
use crate::error::{Error, InputError, Result};
use crate::export::input::area::AreaInput;
use crate::summary::Unlabelled;
use crate::survey::annotated::{Annotated, SkippedLines, SurveyedRoom};
use crate::survey::columns::Columns;
use crate::survey::strays::{InstanceStrays, STRAY_M, Strays};
use s3d_geom::glam::Vec3;
use s3d_geom::{Aabb, Footprint, FootprintBuilder, FootprintOptions, NearestFaces, PointCloud};
use s3d_io::Error as FileError;
use s3d_io::cloud::{AnnotatedInstance as InstancePoints, InstanceReader, PointPasses};
use s3d_label::{FaceLabels, Label, LabelId, LabelTable, Labeler, wall_directions_deg};
use std::borrow::Cow;

/// The points of a block. Three blocks are in memory: while some points are looked up, the next are read.
const BLOCK_POINTS: usize = 1 << 19;

/// One instance with its points, as [`annotate`] hands it out.
pub(crate) struct AnnotatedInstance<'a> {
    pub(crate) label: Label,
    pub(crate) id: LabelId,
    /// The box of its points.
    pub(crate) bbox: Aabb,
    /// Its points, at least one, for another pass over them.
    pub(crate) points: &'a mut dyn PointPasses,
}

/// Reads an area's annotated points, one instance at a time and block by block, and lets each point vote for
/// its nearest face. Calls `each` with every instance, its box and its points, in the order of rooms and of
/// numbers in the room. Fills faces without a vote that are nearer to labelled surface than `fill_m`, metres;
/// `None` fills none. Leaves out points that are farther from the mesh than `trim_m`, metres; `None` leaves
/// out none. Returns the labels and the votes behind them.
pub(crate) fn annotate(
    ctx: &Context,
    area: &AreaInput,
    nearest_faces: &NearestFaces<'_>,
    table: &LabelTable,
    [fill_m, trim_m]: [Option<f64>; 2],
    mut each: impl FnMut(AnnotatedInstance<'_>) -> Result<()> + Send,
) -> Result<(Annotated, FaceLabels)> {
    let mesh = nearest_faces.mesh();
    let mut labeler = Labeler::new(nearest_faces);
    labeler.watch_strays(trim_m.unwrap_or(STRAY_M) as f32, trim_m.is_none());
    let mut strays = Strays { left_out: trim_m.is_some(), instances: Vec::new() };
    let mut rooms = Rooms::default();
    let mut total = 0u64;
    let mut skipped = SkippedLines::default();
    let files = area.rooms.iter().map(|r| r.instances.len()).sum::<usize>();
    let progress = ctx.progress("labelling", "instances", files as u64);
    let mut reader = InstanceReader::new(BLOCK_POINTS);
    let mut following = area.rooms.iter().flat_map(|r| &r.instances).skip(1);

    for room in &area.rooms {
        let mut builder = FootprintBuilder::new(FootprintOptions::default());
        let mut points = 0u64;
        let mut room_bbox = Aabb::EMPTY;

        for instance in &room.instances {
            let id = table.id_of(&instance.label).unwrap_or(LabelId::NULL);
            let then = following.next().map(|instance| &instance.points);
            ctx.check()?;

            let mut bbox = Aabb::EMPTY;
            let mut is_handed_out = false;
            let mut far = InstanceStrays::new(instance.label, instance.points.source());
            let take = |block: &PointCloud, is_whole: bool| -> Result<()> {
                ctx.check()?;
                // The vote tells which points are to be left out.
                let positions = if trim_m.is_some() {
                    vote(&mut labeler, &instance.points, block, id)?;
                    far.take(&block.positions, &labeler.take_strays())
                } else {
                    Cow::Borrowed(&block.positions[..])
                };
                bbox = bbox.union(Aabb::from_points(positions.iter().copied()));
                let hand_out = || {
                    if !is_whole || positions.is_empty() {
                        return Ok(());
                    }
                    is_handed_out = true;
                    let points = &mut &positions[..];
                    each(AnnotatedInstance { label: instance.label, id, bbox, points })
                };
                let draw = || positions.iter().for_each(|p| builder.add(*p));
                if trim_m.is_some() {
                    return rayon::join(draw, hand_out).1;
                }

                // One thread counts votes; the others draw the floor's outline, and write.
                let (voted, ((), handed_out)) = rayon::join(
                    || vote(&mut labeler, &instance.points, block, id),
                    || rayon::join(draw, hand_out),
                );
                voted?;
                far.take(&block.positions, &labeler.take_strays());
                handed_out
            };

            let (mut passes, left_out) = rooms.draw_beside(|| reader.read(&instance.points, then, take))?;
            skipped.lines += left_out.count;
            if let Some(first) = left_out.first {
                skipped.first.get_or_insert(first.to_string());
            }
            skipped.mended += left_out.mended;
            if let Some(first) = left_out.first_mended {
                skipped.first_mended.get_or_insert(first);
            }
            progress.add(1);

            if passes.is_empty() {
                note_empty(&instance.points, area.lenient, &mut skipped)?;
                continue;
            }

            let mut passes = WithoutStrays { passes: &mut passes, strays: far.places() };
            if trim_m.is_none() {
                passes.strays = &[];
            }
            points += passes.len();
            room_bbox = room_bbox.union(bbox);
            if !is_handed_out && !passes.is_empty() {
                each(AnnotatedInstance { label: instance.label, id, bbox, points: &mut passes })?;
            }
            if far.enlarge() || trim_m.is_some() && !far.places().is_empty() {
                strays.instances.push(far.in_file(area.frame.offset()));
            }
        }
        total += points;

        // The outline and the direction of the walls follow later.
        let room = SurveyedRoom {
            room: room.room,
            points,
            footprint: Footprint::default(),
            bbox: room_bbox,
            wall_direction_deg: 0,
            columns: Columns::of(&builder),
        };
        rooms.push(room, builder);
    }

    if rooms.surveyed.is_empty() {
        return Err(Error::unfit(&area.path, "no room in it"));
    }

    let (labels, directions_deg, report) = rooms.draw_beside(|| {
        let labels = labeler.finish();
        let (directions_deg, report) =
            rayon::join(|| wall_directions_deg(mesh, table, labels.label_of_face()), || labels.report(table));
        (labels, directions_deg, report)
    });

    let mut rooms = rooms.surveyed;
    for room in &mut rooms {
        room.wall_direction_deg = directions_deg.get(&room.room).copied().unwrap_or(0);
    }

    let report = report.map_err(|e| InputError::Labels { why: e.to_string() })?;
    let mut annotated = Annotated {
        label_of_face: labels.label_of_face().to_vec(),
        filled: Vec::new(),
        unlabelled: Unlabelled::default(),
        report,
        rooms,
        points: total,
        skipped,
        strays,
    };
    annotated.fill(mesh, fill_m);
    Ok((annotated, labels))
}

/// Counts an instance without points if `lenient`, and refuses it otherwise.
fn note_empty(instance: &InstancePoints, lenient: bool, skipped: &mut SkippedLines) -> Result<()> {
    if !lenient {
        let message = "no point in it: remove the file, or annotate the instance";
        return Err(FileError::format(instance.path(), message).into());
    }
    skipped.empty_instances += 1;
    let source = instance.source();
    skipped.first.get_or_insert(format!("{source}: no point in it"));
    Ok(())
}

/// An area without annotations: no face has a label, and no room is known.
pub(crate) fn unannotated(nearest_faces: &NearestFaces<'_>, table: &LabelTable) -> Result<Annotated> {
    let labels = Labeler::new(nearest_faces).finish();
    let report = labels
        .report(table)
        .map_err(|e| InputError::Labels { why: e.to_string() })?;
    Ok(Annotated {
        label_of_face: labels.into_label_of_face(),
        filled: Vec::new(),
        unlabelled: Unlabelled::default(),
        report,
        rooms: Vec::new(),
        points: 0,
        skipped: SkippedLines::default(),
        strays: Strays::default(),
    })
}

/// Passes over points without strays, which come ascending.
struct WithoutStrays<'a> {
    passes: &'a mut dyn PointPasses,
    strays: &'a [u64],
}

impl PointPasses for WithoutStrays<'_> {
    fn len(&self) -> u64 {
        self.passes.len() - self.strays.len() as u64
    }

    fn in_memory(&self) -> Option<&[Vec3]> {
        self.passes.in_memory().filter(|_| self.strays.is_empty())
    }

    fn pass(&mut self, each: &mut dyn FnMut(&[Vec3]) -> s3d_io::Result<()>) -> s3d_io::Result<()> {
        if self.strays.is_empty() {
            return self.passes.pass(each);
        }
        let mut strays = self.strays.iter().peekable();
        let mut numbers = 0u64..;
        self.passes.pass(&mut |block| {
            let kept: Vec<Vec3> = block
                .iter()
                .zip(&mut numbers)
                .filter(|(_, number)| strays.next_if(|stray| *stray == number).is_none())
                .map(|(position, _)| *position)
                .collect();
            each(&kept)
        })
    }
}

/// The rooms so far. The last room's outline is drawn beside the work that follows.
#[derive(Default)]
struct Rooms {
    surveyed: Vec<SurveyedRoom>,
    /// The points of the last room, until its outline is drawn.
    undrawn: Option<FootprintBuilder>,
}

impl Rooms {
    fn push(&mut self, room: SurveyedRoom, points: FootprintBuilder) {
        self.draw_beside(|| ());
        self.surveyed.push(room);
        self.undrawn = Some(points);
    }

    /// Does `work`, and draws the last room's outline on another thread if it is not drawn yet.
    fn draw_beside<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> T {
        let undrawn = self.undrawn.take();
        let (done, outline) = rayon::join(work, || undrawn.map(|points| points.finish()));
        if let Some(outline) = outline
            && let Some(room) = self.surveyed.last_mut()
        {
            room.footprint = outline;
        }
        done
    }
}

/// Lets a block of an instance's points vote: for the faces that they belong to if the annotations tell them,
/// and otherwise for the nearest.
fn vote(labeler: &mut Labeler<'_>, instance: &InstancePoints, block: &PointCloud, id: LabelId) -> Result<()> {
    let voted = if instance.are_vertices() {
        labeler.add_vertices(&block.positions, id)
    } else if block.faces.len() == block.len() {
        labeler.add_points_on_faces(&block.faces, id)
    } else {
        labeler.add_points(&block.positions, id)
    };
    voted.map_err(|e| FileError::format(instance.path(), e.to_string()).into())
}

/// Returns a sentence on the instances that no face is labelled with, if there are any. They are in the label
/// table, but in no image and no sampled point.
pub(crate) fn hidden_instances(
    area: &AreaInput,
    label_of_face: &[LabelId],
    table: &LabelTable,
) -> Option<String> {
    let mut seen = vec![false; table.len()];
    label_of_face.iter().for_each(|label| seen[label.0 as usize] = true);
    let instances = area.rooms.iter().flat_map(|r| &r.instances);
    let mut hidden = instances.filter(|i| table.id_of(&i.label).is_none_or(|id| !seen[id.0 as usize]));
    let first = hidden.next()?;
    Some(format!(
        "{} annotated instances win no face of the mesh, the first {}: they are in no image and no sampled \
         point",
        1 + hidden.count(),
        first.points.source()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two blocks of three points.
    struct Blocks([[Vec3; 3]; 2]);

    impl PointPasses for Blocks {
        fn len(&self) -> u64 {
            6
        }

        fn in_memory(&self) -> Option<&[Vec3]> {
            None
        }

        fn pass(&mut self, each: &mut dyn FnMut(&[Vec3]) -> s3d_io::Result<()>) -> s3d_io::Result<()> {
            self.0.iter().try_for_each(|block| each(block))
        }
    }

    #[test]
    fn each_pass_leaves_the_strays_out() {
        let at = |x: u8| Vec3::X * f32::from(x);
        let mut blocks = Blocks([[0, 1, 2].map(at), [3, 4, 5].map(at)]);
        let mut kept = WithoutStrays { passes: &mut blocks, strays: &[0, 2, 4] };
        assert_eq!((kept.len(), kept.in_memory()), (3, None));
        for _ in 0..2 {
            let mut seen = Vec::new();
            kept.pass(&mut |block| {
                seen.extend_from_slice(block);
                Ok(())
            })
            .unwrap();
            assert_eq!(seen, [1, 3, 5].map(at));
        }
    }
}
