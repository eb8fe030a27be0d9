//! Scan locations for a scan that comes without: on the floor of every room, spread evenly, away from walls
//! and things; or, for a scan without labels, by the space that is free ([`free_space`]).

pub(crate) mod free_space;

use crate::context::Context;
use crate::error::{InputError, Result};
use crate::options::ExportOptions;
use crate::options::placing::SHARE;
use crate::survey::annotated::SurveyedRoom;
use crate::survey::outlook::{LOW_COVERAGE, Outlook};
use glam::{DVec3, Vec3, dvec3};
use s3d_geom::{Density, NearestFaces, PointCloud, Pose, SurfaceSampler, TriMesh};
use s3d_io::camera::{ScanLocation, uuid_from_name};
use s3d_label::{Class, LabelId, LabelTable, Room};
use s3d_render::{Scene, cast_ray};
use s3d_sample::poisson_disk;
use std::collections::BTreeMap;

/// A tripod's height above the floor, metres. The paper leaves it to the scanner; a tripod of Matterport's
/// stands so.
const HEIGHT_M: f64 = 1.5;

/// How far a location keeps from every surface, metres: the first that some place of its room allows.
const CLEARANCES_M: [f32; 4] = [0.5, 0.35, 0.2, 0.1];

/// Above the floor the tripod needs this much, metres: less is the floor's own unevenness.
const FOOT_M: f64 = 0.05;

/// Where one place sees too little, so do those this near, metres.
const BLIND_M: f64 = 0.25;

/// A floor that rises more steeply than this is none: the cosine of 45°.
const LEVEL: f32 = 0.707;

/// Most places that are looked at in an area.
const MOST_PLACES: f64 = 4e6;

/// How scan locations are placed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// No two of a room are nearer to each other, metres.
    pub(crate) distance_m: f64,
    pub(crate) seed: u64,
}

/// How [`place_cameras`] chooses places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceOptions {
    /// Of the surface that can be seen from anywhere, the share that the locations see together, above 0 to
    /// 1. `None`: 0.95, if `apart_m` is not given either.
    pub see: Option<f64>,
    /// Instead: no two locations that see each other are nearer than this, metres, and every free place is
    /// nearer than that to one.
    pub apart_m: Option<f64>,
    /// Everything random comes from it.
    pub seed: u64,
}

/// Places scan locations on a mesh without labels, as an export of the mesh alone does, in its area 1: 1.5 m
/// above surfaces that face up, inside, where a tripod could stand. All look along +Y; the most useful comes
/// first. The same for the same mesh, options and seed, for any number of threads.
///
/// # Errors [`Error::Usage`](crate::Error::Usage) for numbers out of range, or both given; [`Error::Input`](crate::Error::Input) if there is no such
/// place, or hardly any surface is seen, with what was found and what may be wrong; [`Error::Cancelled`](crate::Error::Cancelled).
pub fn place_cameras(scene: &Scene<'_>, options: &PlaceOptions, ctx: &Context) -> Result<Vec<ScanLocation>> {
    let PlaceOptions { see, apart_m: place_cameras, seed } = *options;
    ExportOptions { see, place_cameras, ..ExportOptions::default() }.canonical()?;
    let wanted =
        free_space::FreeSpaceOptions { share: see.unwrap_or(SHARE), distance_m: place_cameras, seed };
    let nearest = NearestFaces::new(scene.mesh());
    let placed = free_space::place_in_free_space(ctx, 1, scene, &nearest, wanted)?;
    ctx.warn_each(&placed.warnings);
    ctx.info(format_args!("{} scan locations placed: {}", placed.locations.len(), placed.seen));
    Ok(placed.locations)
}

/// What [`place_locations`] reads.
#[derive(Clone, Copy)]
pub(crate) struct Ground<'a> {
    pub(crate) area: u32,
    pub(crate) scene: &'a Scene<'a>,
    pub(crate) nearest: &'a NearestFaces<'a>,
    pub(crate) label_of_face: &'a [LabelId],
    pub(crate) table: &'a LabelTable,
    pub(crate) rooms: &'a [SurveyedRoom],
}

/// The scan locations of an area, each with its room.
pub(crate) type Located = Vec<(ScanLocation, Room)>;

/// Placed locations, and a sentence on each room that has none.
pub(crate) type Placed = (Located, Vec<String>);

/// Puts scan locations into the rooms of an area, 1.5 m above their floors, on a Poisson-disk pattern: no two
/// of a room are nearer than the distance asked for, and every place that is free is nearer than that to one.
/// The way up from the floor is free, and so are 0.5 m around, or less in rooms that are narrower; and half
/// of all directions or more end at the front of a surface, if that is so anywhere in the room. All look
/// along +Y. Returns the locations with their rooms, in the order of rooms, and a sentence on each room that
/// has none.
///
/// A room's floor is the faces labelled so; a room without any has the floor outline of its points instead,
/// at the height of the lowest.
pub(crate) fn place_locations(ground: &Ground<'_>, placement: Placement) -> Result<Placed> {
    let (mut placed, mut warnings) = (Vec::new(), Vec::new());
    let mut floors = floor_faces(ground);
    let floor_m2: f64 = ground.rooms.iter().map(|r| r.footprint.area_m2).sum();
    // A hundred or so places for each location that may be put, and as many as make 10 cm steps in small
    // rooms.
    let per_m2 = (100.0 / (placement.distance_m * placement.distance_m))
        .clamp(100.0, 10_000.0)
        .min(MOST_PLACES / floor_m2.max(1.0));
    for room in ground.rooms {
        let name = format!("{}_{}", room.room, ground.area);
        let feet = match floors.remove(&room.room) {
            Some(faces) => on_faces(ground.scene.mesh(), faces, per_m2, placement.seed),
            None => on_outline(room, per_m2),
        };
        let free = free_places(ground.scene, ground.nearest, &feet);
        if free.is_empty() {
            warnings.push(format!(
                "{name}: no place for a scan location, since none of its floor is free up to {HEIGHT_M} m \
                 with {} m around",
                CLEARANCES_M[CLEARANCES_M.len() - 1]
            ));
            continue;
        }
        for (number, [x, y, z]) in choose(ground.scene, free, placement, &name).into_iter().enumerate() {
            let pose = Pose::level(dvec3(x, y, z), 0.0);
            // Its place makes it another than that of any other building.
            let uuid = uuid_from_name(&format!("s3d place {name} {number} {} {x} {y} {z}", placement.seed));
            placed.push((ScanLocation { uuid, pose, line: 0 }, room.room));
        }
    }
    if placed.is_empty() {
        let why = format!("no place for a scan location in any room: {}", warnings.join("; "));
        return Err(InputError::UnfitArea { area: ground.area, why }.into());
    }
    Ok((placed, warnings))
}

/// The level faces labelled as floor, by room.
fn floor_faces(ground: &Ground<'_>) -> BTreeMap<Room, Vec<u32>> {
    let mut floors: BTreeMap<Room, Vec<u32>> = BTreeMap::new();
    for (face, label) in (0u32..).zip(ground.label_of_face) {
        if let Some(label) = ground.table.get(*label)
            && label.class.s3dis() == Class::FLOOR
            && ground.scene.mesh().normal(face).z.abs() > LEVEL
        {
            floors.entry(label.room).or_default().push(face);
        }
    }
    floors
}

/// Places on faces, spread at random.
fn on_faces(mesh: &TriMesh, faces: Vec<u32>, per_m2: f64, seed: u64) -> Vec<DVec3> {
    let sampler = SurfaceSampler::over_faces(mesh, faces, Density::PerM2(per_m2), seed);
    let mut cloud = PointCloud::default();
    sampler.sample(0..sampler.len(), &mut cloud);
    cloud.positions.iter().map(|p| p.as_dvec3()).collect()
}

/// Places on a grid in the room's outline.
fn on_outline(room: &SurveyedRoom, per_m2: f64) -> Vec<DVec3> {
    let step = 1.0 / per_m2.sqrt();
    let (min, size) = (room.bbox.min.as_dvec3(), room.bbox.size().as_dvec3());
    let along = |length: f64| (length / step).ceil().min(1e4) as u32;
    (0..along(size.x))
        .flat_map(|i| (0..along(size.y)).map(move |j| (f64::from(i) + 0.5, f64::from(j) + 0.5)))
        .map(|(i, j)| dvec3(min.x + i * step, min.y + j * step, min.z))
        .filter(|p| room.footprint.contains(p.x, p.y))
        .collect()
}

/// The places of cameras above `feet` that are free, with the widest clearance that leaves any.
fn free_places(scene: &Scene<'_>, nearest: &NearestFaces<'_>, feet: &[DVec3]) -> Vec<[f64; 3]> {
    let eyes: Vec<Vec3> = feet.iter().map(|p| (p + HEIGHT_M * DVec3::Z).as_vec3()).collect();
    let mut around = Vec::new();
    nearest.nearest_many(&eyes, &mut around);
    let is_open = |foot: DVec3| {
        let up = (HEIGHT_M - FOOT_M) * DVec3::Z;
        cast_ray(scene, foot + FOOT_M * DVec3::Z, up).is_none_or(|hit| hit.t > 1.0)
    };
    for clearance in CLEARANCES_M {
        let free: Vec<[f64; 3]> = feet
            .iter()
            .zip(&eyes)
            .zip(&around)
            .filter(|((foot, _), n)| n.distance_m >= clearance && is_open(**foot))
            .map(|((_, eye), _)| eye.as_dvec3().to_array())
            .collect();
        if !free.is_empty() {
            return free;
        }
    }
    Vec::new()
}

/// Spreads locations over free places so that each sees the front of a surface in half of all directions or
/// more: the floor of a room may go on through a door, to where the scan ends. If no place does, as in a scan
/// without walls, that is no condition.
fn choose(scene: &Scene<'_>, free: Vec<[f64; 3]>, placement: Placement, name: &str) -> Vec<[f64; 3]> {
    let spread = |places: &[[f64; 3]]| -> Vec<[f64; 3]> {
        let chosen = poisson_disk(places, placement.distance_m, placement.seed, name);
        chosen.into_iter().map(|i| places[i]).collect()
    };
    let mut places = free.clone();
    // Each turn takes places away.
    while !places.is_empty() {
        let chosen = spread(&places);
        let coverage = |p: &[f64; 3]| {
            let pose = Pose::level(DVec3::from_array(*p), 0.0);
            let outlook = Outlook::of(scene, &ScanLocation { uuid: String::new(), pose, line: 0 });
            outlook.coverage * (1.0 - outlook.back_sides)
        };
        let blind: Vec<[f64; 3]> = chosen.iter().copied().filter(|p| coverage(p) < LOW_COVERAGE).collect();
        if blind.is_empty() {
            return chosen;
        }
        let near =
            |a: &[f64; 3], b: &[f64; 3]| DVec3::from_array(*a).distance(DVec3::from_array(*b)) < BLIND_M;
        places.retain(|p| !blind.iter().any(|b| near(p, b)));
    }
    spread(&free)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::{FootprintBuilder, FootprintOptions};
    use s3d_label::Label;

    /// A box of a room with a table of 1 m in one corner: floor 4 × 3 m, 2.5 m high.
    fn room(width: f32, depth: f32) -> (TriMesh, Vec<Class>) {
        let mut positions = Vec::new();
        let mut faces = Vec::new();
        let mut classes = Vec::new();
        let mut quad = |corners: [[f32; 3]; 4], class: Class| {
            let first = positions.len() as u32;
            positions.extend(corners.map(Vec3::from_array));
            faces.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            classes.extend([class; 2]);
        };
        let (w, d, h) = (width, depth, 2.5);
        quad([[0., 0., 0.], [w, 0., 0.], [w, d, 0.], [0., d, 0.]], Class::FLOOR);
        quad([[0., 0., h], [0., d, h], [w, d, h], [w, 0., h]], Class::CEILING);
        quad([[0., 0., 0.], [0., 0., h], [w, 0., h], [w, 0., 0.]], Class::WALL);
        quad([[0., d, 0.], [w, d, 0.], [w, d, h], [0., d, h]], Class::WALL);
        quad([[0., 0., 0.], [0., d, 0.], [0., d, h], [0., 0., h]], Class::WALL);
        quad([[w, 0., 0.], [w, 0., h], [w, d, h], [w, d, 0.]], Class::WALL);
        quad([[0., 0., 0.7], [1., 0., 0.7], [1., 1., 0.7], [0., 1., 0.7]], Class::TABLE);
        (TriMesh::from_faces(positions, faces).unwrap(), classes)
    }

    fn place(width: f32, depth: f32, distance_m: f64, has_floor: bool) -> Result<Vec<DVec3>> {
        let (mesh, classes) = room(width, depth);
        let of: Room = "office_1".parse().unwrap();
        let label = |class| Label { class, instance: 1, room: of, area: 1 };
        let used = [Class::FLOOR, Class::CEILING, Class::WALL, Class::TABLE].map(label);
        let table = LabelTable::from_labels(used).unwrap();
        let label_of_face: Vec<LabelId> = classes
            .iter()
            .map(|&c| {
                if c == Class::FLOOR && !has_floor {
                    LabelId::NULL
                } else {
                    table.id_of(&label(c)).unwrap()
                }
            })
            .collect();
        let mut builder = FootprintBuilder::new(FootprintOptions::default());
        for i in 0..=100 {
            for j in 0..=100 {
                builder.add(Vec3::new(width * i as f32 / 100.0, depth * j as f32 / 100.0, 0.0));
            }
        }
        let rooms = [SurveyedRoom {
            room: of,
            points: 1,
            footprint: builder.finish(),
            bbox: mesh.aabb(),
            wall_direction_deg: 0,
        }];
        let (scene, nearest) = (Scene::new(&mesh), NearestFaces::new(&mesh));
        let ground = Ground {
            area: 1,
            scene: &scene,
            nearest: &nearest,
            label_of_face: &label_of_face,
            table: &table,
            rooms: &rooms,
        };
        let (placed, warnings) = place_locations(&ground, Placement { distance_m, seed: 3 })?;
        assert!(warnings.is_empty());
        let mut uuids: Vec<_> = placed.iter().map(|p| p.0.uuid.clone()).collect();
        uuids.sort();
        uuids.dedup();
        assert_eq!(uuids.len(), placed.len());
        Ok(placed.into_iter().map(|(l, _)| l.pose.location).collect())
    }

    #[test]
    fn locations_stand_free_above_the_floor_and_apart() {
        for has_floor in [true, false] {
            let at = place(4.0, 3.0, 0.8, has_floor).unwrap();
            assert!((8..=20).contains(&at.len()), "{}", at.len());
            for (i, p) in at.iter().enumerate() {
                assert!((p.z - 1.5).abs() < 1e-6);
                assert!(p.x >= 0.5 && p.x <= 3.5 && p.y >= 0.5 && p.y <= 2.5, "{p}");
                assert!(p.x > 1.0 || p.y > 1.0, "{p} is on the table");
                assert!(at[..i].iter().all(|q| q.distance(*p) >= 0.8));
            }
        }
    }

    #[test]
    fn nobody_is_put_where_the_scan_has_ended() {
        // The floor goes on for 3 m beyond the wall at x = 4, which has no other side.
        let (mesh, _) = room(4.0, 3.0);
        let mut parts = mesh.parts().clone();
        let first = parts.positions.len() as u32;
        parts
            .positions
            .extend([[4., 0., 0.], [7., 0., 0.], [7., 3., 0.], [4., 3., 0.]].map(Vec3::from_array));
        parts
            .faces
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        let mesh = TriMesh::new(parts).unwrap();
        let scene = Scene::new(&mesh);
        let places: Vec<[f64; 3]> = (0..60)
            .flat_map(|i| (0..20).map(move |j| [0.6 + 0.1 * f64::from(i), 0.6 + 0.09 * f64::from(j), 1.5]))
            .collect();
        let placement = Placement { distance_m: 1.0, seed: 1 };
        let chosen = choose(&scene, places.clone(), placement, "office_1_1");
        assert!(chosen.len() >= 4 && chosen.iter().all(|p| p[0] < 4.3), "{chosen:?}");
        let outside: Vec<[f64; 3]> = places.into_iter().filter(|p| p[0] > 5.0).collect();
        assert!(!choose(&scene, outside, placement, "office_1_1").is_empty());
    }

    #[test]
    fn a_narrow_room_gets_less_clearance_and_a_crawl_space_none() {
        let at = place(1.8, 0.8, 5.0, true).unwrap();
        assert_eq!(at.len(), 1);
        assert!(at[0].x > 1.0 && (0.35..=0.45).contains(&at[0].y));
        let message = place(1.1, 0.15, 1.0, true).unwrap_err().to_string();
        assert!(message.contains("office_1_1: no place"), "{message}");
    }
}
