//! Places scan locations for a scan without any. With labels they stand on the floor of every room, spread
//! evenly, away from walls and things. Without labels they stand in the free space.

pub(crate) mod free_space;
mod walk;

pub(crate) use walk::MOST_RATE;
pub use walk::{WalkOptions, walk};

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

/// A tripod's height above the floor, metres. The paper leaves it to the scanner; Matterport's tripods have
/// this height.
const HEIGHT_M: f64 = 1.5;

/// The distance of a location from every surface, metres. The first that a place in its room allows is used.
const CLEARANCES_M: [f32; 4] = [0.5, 0.35, 0.2, 0.1];

/// The height above the floor that the tripod's foot may start at, metres. Anything lower is unevenness of
/// the floor.
const FOOT_M: f64 = 0.05;

/// A place that sees too little rules out the places this near to it, metres.
const BLIND_M: f64 = 0.25;

/// The cosine of 45°. A steeper floor is not used.
const LEVEL: f32 = 0.707;

/// The largest number of places that are examined in an area.
const MOST_PLACES: f64 = 4e6;

/// How scan locations are placed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Placement {
    /// The smallest distance between two locations of a room, metres.
    pub(crate) distance_m: f64,
    pub(crate) seed: u64,
}

/// How [`place_cameras`] chooses places.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaceOptions {
    /// The share of the visible surface that the locations see together, above 0 to 1. `None`: 0.95, unless
    /// `apart_m` is given. The visible surface is all that can be seen from any free place.
    pub see: Option<f64>,
    /// Used instead of `see`: the smallest distance between two locations that see each other, metres. Every
    /// free place is nearer than this to a location.
    pub apart_m: Option<f64>,
    /// The seed of everything random.
    pub seed: u64,
}

/// Places scan locations on a mesh without labels, as an export of the mesh alone does in its area 1.
/// Locations are 1.5 m above surfaces that face up, inside, where a tripod could stand. All look along +Y,
/// and the most useful comes first. The same mesh, options and seed give the same locations, for any number
/// of threads.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if numbers are out of range, or both are given.
/// [`Error::Input`](crate::Error::Input) if there is no such place, or hardly any surface is seen; the error
/// says what was found and what may be wrong. [`Error::Cancelled`](crate::Error::Cancelled).
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

/// The input of [`place_locations`].
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

/// Placed locations, and a sentence on each room without any.
pub(crate) type Placed = (Located, Vec<String>);

/// Places scan locations in the rooms of an area, 1.5 m above the floor, on a Poisson-disk pattern. Two
/// locations of a room are never nearer than the requested distance, and every free place is nearer than that
/// to a location.
///
/// A place is free if the way up from the floor is free, and 0.5 m around it, or less in narrower rooms. At
/// least half of all directions must end at the front of a surface, if that holds anywhere in the room. All
/// locations look along +Y. Returns the locations with their rooms, in the order of rooms, and a sentence on
/// each room without any.
///
/// A room's floor is its faces with a floor label. A room without such faces uses the floor outline of its
/// points, at the height of the lowest point.
pub(crate) fn place_locations(ground: &Ground<'_>, placement: Placement) -> Result<Placed> {
    let mut placed = Vec::new();
    let mut warnings = Vec::new();
    let mut floors = floor_faces(ground);
    let floor_m2: f64 = ground.rooms.iter().map(|r| r.footprint.area_m2).sum();

    // About a hundred places for each possible location, and at least one every 10 cm for small rooms.
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
            // The position makes the uuid differ from uuids in other buildings.
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

/// Returns the level faces with a floor label, by room.
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

/// Returns random places on faces, spread evenly.
fn on_faces(mesh: &TriMesh, faces: Vec<u32>, per_m2: f64, seed: u64) -> Vec<DVec3> {
    let sampler = SurfaceSampler::over_faces(mesh, faces, Density::PerM2(per_m2), seed);
    let mut cloud = PointCloud::default();
    sampler.sample(0..sampler.len(), &mut cloud);
    cloud.positions.iter().map(|p| p.as_dvec3()).collect()
}

/// Returns the places of a grid in the room's outline.
fn on_outline(room: &SurveyedRoom, per_m2: f64) -> Vec<DVec3> {
    let step = 1.0 / per_m2.sqrt();
    let min = room.bbox.min.as_dvec3();
    let size = room.bbox.size().as_dvec3();
    let [columns, rows] = [size.x, size.y].map(|length| (length / step).ceil().min(1e4) as u32);

    (0..columns)
        .flat_map(|i| (0..rows).map(move |j| (f64::from(i) + 0.5, f64::from(j) + 0.5)))
        .map(|(i, j)| dvec3(min.x + i * step, min.y + j * step, min.z))
        .filter(|p| room.footprint.contains(p.x, p.y))
        .collect()
}

/// Returns the free camera places above `feet`, with the widest clearance that leaves any.
fn free_places(scene: &Scene<'_>, nearest: &NearestFaces<'_>, feet: &[DVec3]) -> Vec<[f64; 3]> {
    let eyes: Vec<Vec3> = feet.iter().map(|p| (p + HEIGHT_M * DVec3::Z).as_vec3()).collect();
    let mut around = Vec::new();
    nearest.nearest_many(&eyes, &mut around);

    for clearance in CLEARANCES_M {
        let free: Vec<[f64; 3]> = feet
            .iter()
            .zip(&eyes)
            .zip(&around)
            .filter(|((foot, _), n)| n.distance_m >= clearance && has_headroom(scene, **foot))
            .map(|((_, eye), _)| eye.as_dvec3().to_array())
            .collect();
        if !free.is_empty() {
            return free;
        }
    }
    Vec::new()
}

/// Returns whether nothing is above a foot up to the height of a location.
fn has_headroom(scene: &Scene<'_>, foot: DVec3) -> bool {
    let up = (HEIGHT_M - FOOT_M) * DVec3::Z;
    cast_ray(scene, foot + FOOT_M * DVec3::Z, up).is_none_or(|hit| hit.t > 1.0)
}

/// Spreads locations over free places so that each sees the front of a surface in at least half of all
/// directions. The floor of a room may continue through a door, to where the scan ends. If no place fulfils
/// the condition, as in a scan without walls, it is dropped.
fn choose(scene: &Scene<'_>, free: Vec<[f64; 3]>, placement: Placement, name: &str) -> Vec<[f64; 3]> {
    let mut places = free.clone();
    // Each turn removes places.
    while !places.is_empty() {
        let chosen = spread(&places, placement, name);
        let mut blind = chosen.clone();
        blind.retain(|place| front_coverage(scene, *place) < LOW_COVERAGE);
        if blind.is_empty() {
            return chosen;
        }

        places.retain(|place| !blind.iter().any(|b| is_near(*place, *b)));
    }
    spread(&free, placement, name)
}

/// Returns the places of a Poisson-disk pattern.
fn spread(places: &[[f64; 3]], placement: Placement, name: &str) -> Vec<[f64; 3]> {
    let chosen = poisson_disk(places, placement.distance_m, placement.seed, name);
    chosen.into_iter().map(|i| places[i]).collect()
}

/// Returns the share of directions in which a camera at a place sees the front of a surface.
fn front_coverage(scene: &Scene<'_>, place: [f64; 3]) -> f64 {
    let pose = Pose::level(DVec3::from_array(place), 0.0);
    let outlook = Outlook::of(scene, &ScanLocation { uuid: String::new(), pose, line: 0 });
    outlook.coverage * (1.0 - outlook.back_sides)
}

fn is_near(a: [f64; 3], b: [f64; 3]) -> bool {
    DVec3::from_array(a).distance(DVec3::from_array(b)) < BLIND_M
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::survey::columns::Columns;
    use s3d_geom::{FootprintBuilder, FootprintOptions};
    use s3d_label::Label;

    /// A box-shaped room, 2.5 m high, with a table of 1 × 1 m in one corner.
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
            columns: Columns::default(),
        }];
        let scene = Scene::new(&mesh);
        let nearest = NearestFaces::new(&mesh);

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
