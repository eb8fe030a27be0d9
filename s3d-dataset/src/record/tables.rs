//! The tables beside the images: rooms, votes, instance numbers, views, splits. Each is a JSON file whose
//! keys explain themselves.

use crate::context::Context;
use crate::error::Result;
use crate::summary::Unlabelled;
use crate::survey::annotated::Annotated;
use crate::survey::candidate::Candidate;
use crate::survey::room_names::RoomNames;
use glam::DVec2;
use s3d_io::Error as FileError;
use s3d_io::dataset::{Domain, FaceVoteColumns, Frame, ImageName, Layout, Split};
use s3d_io::fs::{create_dir, write_json};
use s3d_label::{Class, Disputes, FaceLabels, LabelId, LabelTable, VoteReport, VoteRow};
use s3d_sample::Fold;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs;

/// A room of `rooms.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RoomRecord {
    /// A name such as `office_3`.
    pub(crate) room: String,
    /// The number of annotated points.
    pub(crate) points: u64,
    pub(crate) floor_m2: f64,
    /// The dominant horizontal direction of the walls, whole degrees in [0, 90).
    pub(crate) wall_direction_deg: u32,
    /// The floor outline as polygons. Each has a ring around it (counter-clockwise) and rings around its
    /// holes (clockwise), in world x and y, metres.
    pub(crate) outline: Vec<OutlineRecord>,
}

/// One polygon of an outline.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct OutlineRecord {
    pub(crate) outer: Vec<[f64; 2]>,
    pub(crate) holes: Vec<Vec<[f64; 2]>>,
}

/// Writes `area_N/3d/rooms.json`.
pub(crate) fn write_rooms(layout: &Layout, area: u32, annotated: &Annotated) -> Result<()> {
    let rooms: Vec<RoomRecord> = annotated
        .rooms
        .iter()
        .map(|r| RoomRecord {
            room: r.room.to_string(),
            points: r.points,
            floor_m2: r.footprint.area_m2,
            wall_direction_deg: r.wall_direction_deg,
            outline: r
                .footprint
                .polygons
                .iter()
                .map(|p| OutlineRecord {
                    outer: coordinates(&p.outer),
                    holes: p.holes.iter().map(|hole| coordinates(hole)).collect(),
                })
                .collect(),
        })
        .collect();

    write_json(&layout.rooms_json(area), &rooms)?;
    Ok(())
}

fn coordinates(points: &[DVec2]) -> Vec<[f64; 2]> {
    points.iter().map(|p| p.to_array()).collect()
}

#[derive(Serialize)]
struct VoteRecord {
    points: u64,
    points_farther_than_5_cm: u64,
    faces_voted: u64,
    votes_per_voted_face: f64,
    faces_contested: u64,
    faces_won_with_less_than_three_quarters: u64,
    faces_won_with_less_than_half: u64,
}

impl From<&VoteRow> for VoteRecord {
    fn from(row: &VoteRow) -> Self {
        Self {
            points: row.points,
            points_farther_than_5_cm: row.far_points,
            faces_voted: row.faces,
            votes_per_voted_face: row.mean_votes_per_face(),
            faces_contested: row.contested,
            faces_won_with_less_than_three_quarters: row.contested_below_three_quarters,
            faces_won_with_less_than_half: row.contested_below_half,
        }
    }
}

/// The largest number of disputed patches that are listed.
const MOST_PATCHES: usize = 50;

/// Writes `area_N/3d/votes.json`: the report on the voting, in total, by room and by class, and the disputes.
pub(crate) fn write_votes(
    layout: &Layout,
    area: u32,
    annotated: &Annotated,
    disputes: &Disputes,
    table: &LabelTable,
) -> Result<()> {
    let votes = VotesRecord::new(area, &annotated.report, &annotated.unlabelled, disputes, table);
    write_json(&layout.votes_json(area), &votes)?;
    Ok(())
}

/// The content of `votes.json`.
#[derive(Serialize)]
pub(crate) struct VotesRecord {
    faces: u64,
    faces_without_votes: u64,
    m2_without_votes: f64,
    faces_without_label: u64,
    m2_without_label: f64,
    total: VoteRecord,
    rooms: Vec<NamedVotes>,
    classes: Vec<NamedVotes>,
    disputing_classes: Vec<DisputeRecord>,
    disputed_patches: Vec<PatchRecord>,
}

#[derive(Serialize)]
struct NamedVotes {
    name: String,
    #[serde(flatten)]
    row: VoteRecord,
}

#[derive(Serialize)]
struct DisputeRecord {
    classes: [&'static str; 2],
    faces: u64,
    m2: f64,
}

#[derive(Serialize)]
struct PatchRecord {
    labels: [String; 2],
    faces: u64,
    m2: f64,
    center: [f64; 3],
    bbox: [f32; 6],
}

impl VotesRecord {
    /// Returns the content for an area. Rooms of other areas are left out.
    pub(crate) fn new(
        area: u32,
        report: &VoteReport,
        unlabelled: &Unlabelled,
        disputes: &Disputes,
        table: &LabelTable,
    ) -> Self {
        let rooms = report.rooms.iter().filter(|(of, ..)| *of == area);
        let patches = disputes.patches.iter().take(MOST_PATCHES);
        Self {
            faces: report.face_count,
            faces_without_votes: report.faces_without_vote,
            m2_without_votes: unlabelled.without_votes.m2,
            faces_without_label: unlabelled.without_label.faces,
            m2_without_label: unlabelled.without_label.m2,
            total: (&report.total).into(),
            rooms: rooms
                .map(|(_, r, row)| NamedVotes { name: r.to_string(), row: row.into() })
                .collect(),
            classes: report
                .classes
                .iter()
                .map(|(c, row)| NamedVotes { name: c.to_string(), row: row.into() })
                .collect(),
            disputing_classes: disputes
                .classes
                .iter()
                .map(|d| DisputeRecord { classes: d.classes.map(Class::name), faces: d.faces, m2: d.area_m2 })
                .collect(),
            disputed_patches: patches
                .map(|p| PatchRecord {
                    labels: p.labels.map(|label| table.name_of(label)),
                    faces: p.faces,
                    m2: p.area_m2,
                    center: p.center.to_array(),
                    bbox: p.bbox.to_array(),
                })
                .collect(),
        }
    }
}

/// Writes `area_N/3d/votes.npz`: the label of each face, and the votes for it.
pub(crate) fn write_face_votes(
    layout: &Layout,
    area: u32,
    label_of_face: &[LabelId],
    votes: &FaceLabels,
) -> Result<()> {
    let mut columns =
        FaceVoteColumns { label: label_of_face.iter().map(|l| l.0).collect(), ..Default::default() };
    for face in votes.iter() {
        let [won, total, runner_up, runner_up_votes] = face.as_ref().map_or([0; 4], |v| {
            [
                saturating_u32(v.votes),
                saturating_u32(v.total),
                v.runner_up.0,
                saturating_u32(v.runner_up_votes),
            ]
        });
        columns.votes.push(won);
        columns.total.push(total);
        columns.runner_up.push(runner_up);
        columns.runner_up_votes.push(runner_up_votes);
        columns.farthest_m.push(face.map_or(0.0, |v| v.farthest_m));
    }
    s3d_io::dataset::write_face_votes(&layout.votes_npz(area), &columns)?;
    Ok(())
}

fn saturating_u32(votes: u64) -> u32 {
    u32::try_from(votes).unwrap_or(u32::MAX)
}

/// Writes `area_N/3d/instance_numbers.json`: the label in the area of each instance of the annotation tree,
/// where numbers run by room.
pub(crate) fn write_instance_numbers(layout: &Layout, area: u32, rooms: &[RoomNames]) -> Result<()> {
    let numbers: Vec<NumberRecord> = rooms
        .iter()
        .flat_map(|r| &r.instances)
        .map(|i| NumberRecord {
            room: i.label.room.to_string(),
            class: i.label.class.name().to_owned(),
            number_in_room: i.number_in_room,
            label: i.label.to_string(),
        })
        .collect();
    write_json(&layout.instance_numbers_json(area), &numbers)?;
    Ok(())
}

/// An instance of `instance_numbers.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct NumberRecord {
    pub(crate) room: String,
    pub(crate) class: String,
    /// The number in the room, among the instances of the class. It names the file in the S3DIS tree.
    pub(crate) number_in_room: u32,
    pub(crate) label: String,
}

/// Writes `area_N/views.json`: every candidate view with its draw and its entropy, and the frame numbers of
/// the kept ones.
pub(crate) fn write_views(layout: &Layout, area: u32, candidates: &[Candidate]) -> Result<()> {
    let of_area: Vec<&Candidate> = candidates.iter().filter(|c| c.area == area).collect();
    write_json(&layout.views_json(area), &of_area)?;
    Ok(())
}

/// Writes `splits.json`: the folds that the present areas allow.
pub(crate) fn write_splits(layout: &Layout, folds: &[Fold]) -> Result<()> {
    let splits: Vec<Split> = folds
        .iter()
        .map(|f| Split { fold: f.number, train_areas: f.train.clone(), test_areas: f.test.clone() })
        .collect();
    s3d_io::dataset::write_splits(&layout.splits(), &splits)?;
    Ok(())
}

/// Writes the lists of panoramas that depth loaders read: one for all areas, and one for each side of each
/// fold. Writes none without panoramas that have both colour and depth.
pub(crate) fn write_lists(ctx: &Context, layout: &Layout, areas: &[u32], folds: &[Fold]) -> Result<()> {
    let mut pairs = Vec::new();
    for area in areas {
        let colors = panoramas(layout, *area, Domain::Rgb)?;
        let depths = panoramas(layout, *area, Domain::Depth)?;
        let both = colors.intersection(&depths).map(|name| (*area, name.clone()));
        pairs.extend(both.collect::<Vec<_>>());
    }
    if pairs.is_empty() {
        return Ok(());
    }

    create_dir(&layout.lists_dir())?;

    s3d_io::dataset::write_image_list(&layout.list_of_all(), &listed(&pairs, areas))?;
    for fold in folds {
        for (train, areas) in [(true, &fold.train), (false, &fold.test)] {
            s3d_io::dataset::write_image_list(
                &layout.list_of_fold(fold.number, train),
                &listed(&pairs, areas),
            )?;
        }
    }

    if folds.is_empty() {
        ctx.info(format_args!(
            "these areas leave every fold without its training or its test areas: splits/ lists all \
             panoramas only"
        ));
    }
    Ok(())
}

/// Returns the paths of the colour and depth images of these areas.
fn listed(pairs: &[(u32, ImageName)], areas: &[u32]) -> Vec<(String, String)> {
    pairs
        .iter()
        .filter(|(area, _)| areas.contains(area))
        .map(|(area, name)| {
            (path_in_list(*area, name, Domain::Rgb), path_in_list(*area, name, Domain::Depth))
        })
        .collect()
}

/// Returns the path of a panorama in a domain, as lists give it: below the data set's folder.
fn path_in_list(area: u32, name: &ImageName, domain: Domain) -> String {
    let name = ImageName { domain, ..name.clone() };
    format!("area_{area}/{}/{}/{name}", name.frame.folder(), domain.folder())
}

/// Returns the names of an area's panoramas in a domain. All names say the domain RGB, so that they compare
/// between domains.
fn panoramas(layout: &Layout, area: u32, domain: Domain) -> Result<BTreeSet<ImageName>> {
    let dir = layout.image_dir(area, Frame::Panorama, domain);
    let entries = match fs::read_dir(&dir) {
        Ok(entries) => entries,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeSet::new()),
        Err(e) => return Err(FileError::io(&dir, "read", e).into()),
    };
    let mut names = BTreeSet::new();
    for entry in entries {
        let entry = entry.map_err(|e| FileError::io(&dir, "read", e))?;
        if let Some(name) = entry.file_name().to_str().and_then(ImageName::parse) {
            names.insert(ImageName { domain: Domain::Rgb, ..name });
        }
    }
    Ok(names)
}
