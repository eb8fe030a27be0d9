//! Checks the tables beside the images: rooms, folds, lists, statistics, conventions.

use super::labels::Labels;
use super::report::{OfFile, Report, Topic};
use super::votes::box_of;
use crate::context::Context;
use crate::error::Result;
use crate::options::profile::Profile;
use crate::parallel::for_each_in_order;
use crate::record::assets;
use crate::record::manifest::Manifest;
use crate::record::tables::RoomRecord;
use crate::statistics::Statistics;
use crate::survey::rooms_around::RoomsAround;
use crate::verify::images::Reference;
use s3d_geom::{Aabb, Camera};
use s3d_io::dataset::{
    DatasetImage, Domain, Frame, InstanceEntry, Layout, read_conventions, read_splits, read_world_offsets,
};
use s3d_io::fs::{read_file, read_json};
use s3d_sample::folds;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

const CONVENTIONS: (Topic, &str) = (Topic::Tables, "conventions, assets and profiles");
const ROOMS: (Topic, &str) = (Topic::Tables, "rooms");
const SPLITS: (Topic, &str) = (Topic::Tables, "folds and lists");
const STATISTICS: (Topic, &str) = (Topic::Tables, "statistics");

/// The most differences between two documents that are listed.
const MOST_DIFFERENCES: usize = 5;

/// Checks `conventions.json` against the options, profiles against the manifest, and the files that are the
/// same in every data set of this version.
pub(crate) fn conventions(layout: &Layout, manifest: &Manifest, report: &Report) {
    let path = layout.conventions();
    if let Some(found) = report.read(Topic::Tables, &path, read_conventions) {
        let contradiction = manifest.contradiction_of(found);
        report.check(contradiction.is_none(), CONVENTIONS, &path, || contradiction.unwrap_or_default());
    }

    if let Some(found) = report.read(Topic::Tables, &path, read_world_offsets) {
        let told = manifest.request().world_offsets();
        report.check(found == told, CONVENTIONS, &path, || {
            format!("world.offset_m is {found:?}; the manifest tells of {told:?}")
        });
    }

    for profile in Profile::ALL {
        let dir = layout.profile_dir(profile.name());
        match (dir.is_dir(), manifest.options.profiles.contains(&profile)) {
            (false, true) => {
                report.fault(
                    CONVENTIONS.0,
                    CONVENTIONS.1,
                    &dir,
                    "missing: the manifest tells of this profile",
                );
            }
            (true, false) => {
                report.fault(
                    CONVENTIONS.0,
                    CONVENTIONS.1,
                    &dir,
                    "the manifest does not tell of this profile",
                );
            }
            _ => report.checked(1),
        }
    }

    if !manifest.is_of_this_version() {
        report.note(format!(
            "written by s3d {}: draws, selection and assets were not compared with those of this version",
            manifest.version
        ));
        return;
    }

    let told = manifest.conventions().to_text(&manifest.request().world_offsets());
    if let (Some(found), Ok(expected)) =
        (report.read(Topic::Tables, &path, read_json::<Value>), serde_json::from_str::<Value>(&told))
    {
        let mut differences = Vec::new();
        differ(&found, &expected, "", &mut differences);
        report.check(differences.is_empty(), CONVENTIONS, &path, || {
            format!("not the conventions of this data set: {}", first_of(&differences))
        });
    }

    for (path, text) in assets::texts(layout) {
        if let Some(found) = report.read(Topic::Tables, &path, read_file) {
            report.check(found == text.as_bytes(), CONVENTIONS, &path, || {
                "is not what s3d writes there".to_owned()
            });
        }
    }
}

fn read_text(path: &Path) -> s3d_io::Result<String> {
    String::from_utf8(read_file(path)?).map_err(|_| s3d_io::Error::format(path, "is no text in UTF-8"))
}

/// Checks `rooms.json` of an area against its instances, and the angles in its S3DIS tree.
pub(crate) fn rooms(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    labels: Option<&Labels>,
    instances: Option<&[InstanceEntry]>,
    report: &Report,
) {
    let path = layout.rooms_json(area);
    let Some(rooms) = report.read(Topic::Tables, &path, read_json::<Vec<RoomRecord>>) else { return };

    let checks = report.of(ROOMS, &path);
    if let Some(manifest) = manifest.area(area) {
        checks.check(rooms.len() == manifest.rooms, || {
            format!("{} rooms, and the manifest tells of {}", rooms.len(), manifest.rooms)
        });
    }

    let mut names = BTreeSet::new();
    for r in &rooms {
        let is_room = labels.is_none_or(|labels| labels.taxonomy.room(&r.room).is_ok());
        checks.check(is_room, || format!("{:?} is no room", r.room));
        checks.check(names.insert(&r.room), || format!("{} stands there twice", r.room));
        checks.check(r.wall_direction_deg < 90, || {
            format!("{}: wall_direction_deg {}", r.room, r.wall_direction_deg)
        });

        let inside = r
            .outline
            .iter()
            .map(|o| area_of(&o.outer) + o.holes.iter().map(|h| area_of(h)).sum::<f64>());
        let inside: f64 = inside.sum();

        checks.check((inside - r.floor_m2).abs() <= 1e-6 * (1.0 + inside), || {
            format!("{}: floor_m2 is {}, and the outline holds {inside}", r.room, r.floor_m2)
        });
        if let Some(instances) = instances {
            check_instances_of(r, instances, &checks);
        }
    }

    let tree = layout.s3dis_area_dir(area);
    let list = tree.join(format!("Area_{area}_alignmentAngle.txt"));
    let Some(text) = report.read(Topic::Tables, &list, read_text) else { return };

    let checks = report.of(ROOMS, &list);
    let mut listed = BTreeSet::new();
    for line in text.lines().filter(|l| !l.starts_with('#')) {
        let known = line.split_once(' ').and_then(|(room, angle)| {
            let r = rooms.iter().find(|r| r.room == room)?;
            listed.insert(room.to_owned());
            (r.wall_direction_deg.to_string() == angle).then_some(())
        });
        checks.check(known.is_some(), || format!("{line:?} is not in rooms.json"));
    }

    let entries = std::fs::read_dir(&tree).into_iter().flatten().flatten();
    for folder in entries.filter(|e| e.path().is_dir()) {
        let name = folder.file_name().to_string_lossy().into_owned();
        checks.check(listed.contains(&name), || format!("the room {name} of the tree has no angle"));
    }
}

/// Checks that a room has the points of its instances, and that its outline lies in their boxes.
fn check_instances_of(room: &RoomRecord, instances: &[InstanceEntry], checks: &OfFile<'_>) {
    let of_room = instances.iter().filter(|instance| instance.room == room.room);
    let mut points = 0;
    let mut around = Aabb::EMPTY;
    for instance in of_room {
        points += instance.points;
        around = around.union(box_of(instance));
    }
    checks.check(points == room.points, || {
        format!("{}: {} points, and its instances have {points}", room.room, room.points)
    });

    let low = around.min.as_dvec3();
    let high = around.max.as_dvec3();
    let rings = room
        .outline
        .iter()
        .flat_map(|outline| outline.holes.iter().chain([&outline.outer]));
    let is_inside = |[x, y]: [f64; 2]| {
        let slack = 1e-6 * (1.0 + x.abs().max(y.abs()));
        (low.x - slack..=high.x + slack).contains(&x) && (low.y - slack..=high.y + slack).contains(&y)
    };
    checks.check(rings.flatten().all(|corner| is_inside(*corner)), || {
        format!("{}: its outline reaches beyond the boxes of its instances", room.room)
    });
}

/// Checks that each location sees its room, if it sees labelled surface.
///
/// # Errors
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub(crate) fn location_rooms(
    ctx: &Context,
    reference: &Reference<'_>,
    images: &[DatasetImage],
    cameras: &[(usize, Camera)],
) -> Result<()> {
    let Reference { layout, labels, mesh, report, .. } = *reference;
    let rooms = labels.rooms();
    let room_of_face = |face: u32| rooms.get(mesh.label_of_face[face as usize] as usize)?.as_deref();

    let mut seen = BTreeSet::new();
    let firsts: Vec<(&DatasetImage, &Camera)> = cameras
        .iter()
        .map(|(index, camera)| (&images[*index], camera))
        .filter(|(image, _)| seen.insert((&image.uuid, &image.room)))
        .collect();

    let check = |image: &DatasetImage, camera: &Camera| {
        let around = RoomsAround::of(reference.channels.scene, camera.pose.location, room_of_face);
        let Some(stands_in) = around.stands_in() else { return };
        let path = image.path(layout, Domain::Pose);
        report.check(around.rays_to(&&*image.room) > 0, (Topic::Poses, "rooms of locations"), &path, || {
            format!("sees nothing of {}: it stands in {stands_in}", image.room)
        });
    };
    for_each_in_order(
        ctx,
        &firsts,
        || (),
        |(), (image, camera)| {
            check(image, camera);
            Ok(())
        },
    )
}

/// Checks `splits.json` and the lists of panoramas: everything they name must be there, and everything there
/// must be named.
pub(crate) fn splits(layout: &Layout, manifest: &Manifest, images: &[DatasetImage], report: &Report) {
    let areas = &manifest.area_numbers;
    let path = layout.splits();

    let expected = folds(areas);
    if let Some(splits) = report.read(Topic::Tables, &path, read_splits) {
        let same = splits.len() == expected.len()
            && splits
                .iter()
                .zip(&expected)
                .all(|(s, f)| (s.fold, &s.train_areas, &s.test_areas) == (f.number, &f.train, &f.test));
        report.check(same, SPLITS, &path, || format!("its folds are not those of the areas {areas:?}"));
    }

    let is_listed =
        |i: &&DatasetImage| i.frame == Frame::Panorama && i.has(Domain::Rgb) && i.has(Domain::Depth);
    if !images.iter().any(|i| is_listed(&i)) {
        return;
    }

    let list = |path: &Path, areas: &[u32]| {
        let Some(text) = report.read(Topic::Tables, path, read_text) else { return };
        let checks = report.of(SPLITS, path);
        let pair =
            |i: &DatasetImage| format!("{} {}", i.relative_path(Domain::Rgb), i.relative_path(Domain::Depth));

        let mut left: BTreeSet<String> = images
            .iter()
            .filter(|i| is_listed(i) && areas.contains(&i.area))
            .map(pair)
            .collect();

        for (n, line) in (1..).zip(text.lines()) {
            checks.check(left.remove(line), || {
                let missing = line.split(' ').find(|name| !layout.root().join(name).is_file());
                match missing {
                    Some(name) => format!("line {n}: {name:?} is not there"),
                    None => {
                        format!("line {n}: {line:?} is no panorama of these areas, or stands there twice")
                    }
                }
            });
        }

        checks.check(left.is_empty(), || {
            let first = left.iter().next().cloned().unwrap_or_default();
            format!("{} panoramas are not listed, the first is {first:?}", left.len())
        });
    };

    list(&layout.list_of_all(), areas);
    for fold in &expected {
        list(&layout.list_of_fold(fold.number, true), &fold.train);
        list(&layout.list_of_fold(fold.number, false), &fold.test);
    }
}

/// Checks the statistics against counts from the files.
pub(crate) fn statistics(layout: &Layout, manifest: &Manifest, report: &Report) {
    // An unreadable taxonomy is reported with the labels.
    let Ok(taxonomy) = manifest.read_taxonomy(layout, |_| Ok(())) else { return };
    let taxonomy = Some(&taxonomy).filter(|_| manifest.is_labelled());
    let counted =
        Statistics::count(layout, &manifest.area_numbers, taxonomy, |path, _| report.check_size(path));
    let counted = match counted {
        Ok(counted) => counted,
        Err(e) => {
            report.fault(
                STATISTICS.0,
                STATISTICS.1,
                &layout.statistics_json(),
                format!("cannot be counted: {e}"),
            );
            return;
        }
    };

    let path = layout.statistics_json();
    if let (Some(found), Ok(expected)) =
        (report.read(Topic::Tables, &path, read_json::<Value>), serde_json::to_value(&counted))
    {
        let mut differences = Vec::new();
        differ(&found, &expected, "", &mut differences);
        report.check(differences.is_empty(), STATISTICS, &path, || {
            format!("not what is counted from the files: {}", first_of(&differences))
        });
    }

    let path = layout.statistics_md();
    if let Some(text) = report.read(Topic::Tables, &path, read_text) {
        let expected = counted.to_markdown();
        report.check(text == expected, STATISTICS, &path, || {
            let pair = text
                .lines()
                .zip(expected.lines())
                .find(|(a, b)| a != b)
                .unwrap_or_default();
            format!("not what is counted from the files: {:?} for {:?}", pair.0, pair.1)
        });
    }
}

/// Returns the first of some differences, and how many more there are.
pub(crate) fn first_of(differences: &[String]) -> String {
    let (first, more) = differences.split_at(differences.len().min(MOST_DIFFERENCES));
    let more = if more.is_empty() {
        String::new()
    } else {
        format!("; and {} more", more.len())
    };
    first.join("; ") + &more
}

/// Lists the places where two documents differ.
pub(crate) fn differ(found: &Value, expected: &Value, place: &str, out: &mut Vec<String>) {
    match (found, expected) {
        (Value::Object(a), Value::Object(b)) if a.keys().eq(b.keys()) => {
            a.iter()
                .zip(b.values())
                .for_each(|((key, a), b)| differ(a, b, &format!("{place}/{key}"), out));
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter()
                .zip(b)
                .enumerate()
                .for_each(|(i, (a, b))| differ(a, b, &format!("{place}/{i}"), out));
        }
        _ if found == expected => {}
        _ => out.push(format!("{place} is {found}, expected is {expected}")),
    }
}

/// The signed area within a closed ring.
fn area_of(ring: &[[f64; 2]]) -> f64 {
    // Relative to the first corner, so that numbers are small.
    let Some(&[x, y]) = ring.first() else { return 0.0 };
    ring.windows(2)
        .map(|side| {
            let [p, q] = [side[0], side[1]];
            0.5 * ((p[0] - x) * (q[1] - y) - (q[0] - x) * (p[1] - y))
        })
        .sum()
}
