//! The built-in scene: three furnished rooms and a hallway, textured and annotated, to try everything on without a scan.
//!
//! It is built by rule and always the same. It holds what a scan holds: textures with light and shade in them, windows as
//! opaque surfaces, doors that stand open, a slanted ceiling, and a place that was not captured (a tile of the conference
//! room's ceiling).

use crate::building::demo;
use crate::construct::builder::Builder;
use s3d_geom::{
    TriMesh,
    glam::{DVec3, Vec3, dvec3},
};

/// Where the building's own origin lies in the world, metres.
const OFFSET: Vec3 = Vec3::new(10.0, 5.0, 0.0);

/// A scene with its annotation and its scan locations.
pub struct DemoScene {
    /// Its surface with textures, metres, Z-up.
    pub mesh: TriMesh,
    /// Per face: index into `instances`, or `None` where nothing is annotated.
    pub face_instances: Vec<Option<u32>>,
    /// The annotated objects, room by room.
    pub instances: Vec<DemoInstance>,
    /// Where the scanner stood.
    pub locations: Vec<DemoLocation>,
}

/// An annotated object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DemoInstance {
    /// One of the 13 classes.
    pub class: &'static str,
    /// Counts the objects of a class in a room, from 1.
    pub number: u32,
    /// Type and number of its room: "office_1".
    pub room: &'static str,
}

/// A place from which the scene was captured.
#[derive(Clone, Debug, PartialEq)]
pub struct DemoLocation {
    /// 32 lower-case hexadecimal digits.
    pub uuid: String,
    /// World metres.
    pub position: DVec3,
    /// Heading of the level camera, 0 along +Y, growing to the left.
    pub yaw_rad: f64,
}

/// Builds the scene: the same at every call.
pub fn demo_scene() -> DemoScene {
    let mut builder = Builder::new();
    demo::build(&mut builder);
    let (mesh, face_instances, instances) = builder.finish(OFFSET);
    let locations = LOCATIONS.iter().map(|&(uuid, [x, y, z], yaw_deg)| DemoLocation {
        uuid: uuid.to_owned(),
        position: dvec3(x, y, z) + OFFSET.as_dvec3(),
        yaw_rad: yaw_deg.to_radians(),
    });
    DemoScene { mesh, face_instances, instances, locations: locations.collect() }
}

/// Scan locations: building coordinates and heading in degrees.
const LOCATIONS: [(&str, [f64; 3], f64); 6] = [
    // Office, towards its desks and the whiteboard.
    ("0c5a7d1e93b84f62a1d7e0f4b2683c95", [4.15, 2.75, 1.5], 86.0),
    // Conference room: from the door, and from the far corner.
    ("2f91c04b7ae64d38b5160d9a83ce7f24", [6.9, 3.35, 1.52], -118.0),
    ("5b3e8a76d0f1492c8e47a92b6c1d05f3", [12.0, 1.1, 1.48], 62.5),
    // Lounge.
    ("7d20f6b91c354ea89a03c8e571b4d26e", [5.9, 8.1, 1.55], -64.0),
    // Hallway, between the doors, and at its far end.
    ("93e6b1d45f7c40a2bd98127f0e3ac56b", [5.65, 5.5, 1.5], 90.0),
    ("c48d2a0f6b9143e7952fe1b07d83a6c1", [11.2, 5.45, 1.46], 81.0),
];

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::{
        Aabb, FaceColor,
        glam::{DVec2, Vec2, dvec2},
    };
    use std::collections::{BTreeMap, BTreeSet};
    use std::sync::LazyLock;

    static SCENE: LazyLock<DemoScene> = LazyLock::new(demo_scene);

    const CLASSES: [&str; 13] = [
        "ceiling", "floor", "wall", "beam", "column", "window", "door", "table", "chair", "sofa", "bookcase",
        "board", "clutter",
    ];

    static TRIANGLES: LazyLock<Vec<[DVec3; 3]>> =
        LazyLock::new(|| faces().map(|f| SCENE.mesh.triangle(f).map(|p| p.as_dvec3())).collect());

    fn faces() -> std::ops::Range<u32> {
        0..SCENE.mesh.faces().len() as u32
    }

    fn instance_of(face: u32) -> &'static DemoInstance {
        &SCENE.instances[SCENE.face_instances[face as usize].unwrap() as usize]
    }

    /// The boxes of the rooms, from their walls.
    fn rooms() -> BTreeMap<&'static str, Aabb> {
        let mut rooms = BTreeMap::new();
        for face in faces().filter(|&f| instance_of(f).class == "wall") {
            let room = rooms.entry(instance_of(face).room).or_insert(Aabb::EMPTY);
            *room = SCENE.mesh.triangle(face).into_iter().fold(*room, Aabb::with);
        }
        rooms
    }

    /// Distance along the unit vector `d` at which the ray from `o` meets a triangle.
    fn meets(o: DVec3, d: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<f64> {
        let (e, f, s) = (b - a, c - a, o - a);
        let p = d.cross(f);
        let det = e.dot(p);
        let u = s.dot(p) / det;
        if !(-1e-9..=1.0 + 1e-9).contains(&u) {
            return None;
        }
        let q = s.cross(e);
        let (v, t) = (d.dot(q) / det, f.dot(q) / det);
        (v >= -1e-9 && u + v <= 1.0 + 1e-9 && t > 0.0).then_some(t)
    }

    fn first_hit(o: DVec3, d: DVec3) -> Option<(u32, f64)> {
        let hits = faces().zip(&*TRIANGLES).filter_map(|(f, t)| meets(o, d, t).map(|t| (f, t)));
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn distance(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> f64 {
        let n = (b - a).cross(c - a).normalize();
        let foot = p - n * n.dot(p - a);
        let left = |x: DVec3, y: DVec3| n.dot((y - x).cross(foot - x)) >= 0.0;
        if left(a, b) && left(b, c) && left(c, a) {
            return p.distance(foot);
        }
        let edge = |x: DVec3, y: DVec3| {
            let t = ((p - x).dot(y - x) / (y - x).length_squared()).clamp(0.0, 1.0);
            p.distance(x + (y - x) * t)
        };
        edge(a, b).min(edge(b, c)).min(edge(c, a))
    }

    /// `n` directions all around, evenly.
    fn directions(n: u32) -> impl Iterator<Item = DVec3> {
        (0..n).map(move |i| {
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
            (DVec2::from_angle(2.399_963 * f64::from(i)) * (1.0 - z * z).sqrt()).extend(z)
        })
    }

    #[test]
    fn names_are_those_of_the_data_set_and_every_instance_has_faces() {
        let s = &*SCENE;
        let mut counts = vec![0; s.instances.len()];
        s.face_instances.iter().for_each(|i| counts[i.unwrap() as usize] += 1);
        assert_eq!(s.face_instances.len(), s.mesh.faces().len());
        assert!(counts.iter().all(|&n| n >= 12 || n > 0 && n % 2 == 0), "{counts:?}");

        let used: BTreeSet<_> = s.instances.iter().map(|i| i.class).collect();
        assert_eq!(used, BTreeSet::from(CLASSES));
        let rooms: BTreeSet<_> = s.instances.iter().map(|i| i.room).collect();
        assert_eq!(rooms, BTreeSet::from(["conferenceRoom_1", "hallway_1", "lounge_1", "office_1"]));
        let mut next = BTreeMap::new();
        for i in &s.instances {
            let number = next.entry((i.class, i.room)).or_insert(0);
            *number += 1;
            assert_eq!(i.number, *number, "{i:?}");
        }
        for room in rooms {
            for (class, n) in [("floor", 1), ("ceiling", 1), ("wall", 4)] {
                assert_eq!(next[&(class, room)], n, "{class} in {room}");
            }
        }
    }

    #[test]
    fn its_size_is_a_small_scans() {
        let n = SCENE.mesh.faces().len();
        assert!((20_000..60_000).contains(&n), "{n} faces");
        let aabb = SCENE.mesh.aabb();
        assert!(aabb.min.x >= 10.0 - 0.2 && aabb.max.x <= 25.0, "{aabb:?}");
        assert!(aabb.min.y >= 5.0 - 0.2 && aabb.max.y <= 20.0, "{aabb:?}");
        assert!(aabb.min.z == 0.0 && aabb.max.z < 4.0, "{aabb:?}");
        let pixels: usize = SCENE.mesh.textures().iter().map(|t| t.image.len()).sum();
        assert!(pixels < 8_000_000, "{pixels} pixels of texture");
    }

    #[test]
    fn it_is_the_same_at_every_call() {
        let again = demo_scene();
        let (a, b) = (SCENE.mesh.parts(), again.mesh.parts());
        assert_eq!((&a.positions, &a.faces, &a.uvs), (&b.positions, &b.faces, &b.uvs));
        assert_eq!((&a.materials, &a.face_materials), (&b.materials, &b.face_materials));
        assert_eq!(a.textures, b.textures);
        assert_eq!((&SCENE.instances, &SCENE.locations), (&again.instances, &again.locations));
        assert_eq!(SCENE.face_instances, again.face_instances);
    }

    #[test]
    fn faces_have_textures_with_coordinates_in_range_or_a_colour() {
        let (mut textured, mut plain) = (0, 0);
        for f in faces() {
            match SCENE.mesh.color_of(f) {
                FaceColor::Texture(_, texture, uvs) => {
                    textured += 1;
                    for uv in uvs {
                        let range = uv.cmpge(Vec2::splat(-1e-5)).all() && uv.max_element() < 6.0;
                        assert!(range, "{}: {uv}", texture.name);
                        if texture.wrap == [s3d_geom::Wrap::Clamp; 2] {
                            assert!(uv.max_element() <= 1.0 + 1e-5, "{}: {uv}", texture.name);
                        }
                    }
                }
                FaceColor::Flat(color) => {
                    plain += 1;
                    assert_ne!(color, [0; 3]);
                }
                FaceColor::Corners(_) => panic!("the scene has no vertex colours"),
            }
        }
        assert!(textured > faces().len() / 2 && plain > 1000, "{textured} {plain}");
        let names: BTreeSet<_> = SCENE.mesh.textures().iter().map(|t| &t.name).collect();
        assert_eq!(names.len(), SCENE.mesh.textures().len(), "textures have names of their own");
        let black = |t: &s3d_geom::Texture| t.image.pixels().contains(&[0; 3]);
        assert!(!SCENE.mesh.textures().iter().any(black), "black means missing");
    }

    #[test]
    fn things_stay_in_their_rooms() {
        let rooms = rooms();
        for f in faces() {
            let (instance, room) = (instance_of(f), rooms[instance_of(f).room]);
            // Windows and doors reach into the walls.
            let deep = if matches!(instance.class, "window" | "door") { 0.161 } else { 1e-4 };
            let room = Aabb { min: room.min - deep, max: room.max + deep };
            for p in SCENE.mesh.triangle(f) {
                assert!(room.contains(p), "{instance:?} at {}", p - OFFSET);
            }
        }
    }

    #[test]
    fn locations_stand_free_each_in_one_room() {
        let rooms = rooms();
        assert_eq!(rooms.len(), 4);
        let mut taken = BTreeSet::new();
        for l in &SCENE.locations {
            assert!(l.uuid.len() == 32 && l.uuid.bytes().all(|c| matches!(c, b'0'..=b'9' | b'a'..=b'f')));
            let inside: Vec<_> =
                rooms.iter().filter(|(_, room)| room.contains(l.position.as_vec3())).collect();
            assert_eq!(inside.len(), 1, "{}", l.position);
            taken.insert(*inside[0].0);
            let clearance = TRIANGLES.iter().map(|t| distance(l.position, t)).fold(f64::MAX, f64::min);
            assert!(clearance >= 0.3, "{} of {:?}", clearance, l);
        }
        assert_eq!(taken.len(), 4, "a location in every room");
        let uuids: BTreeSet<_> = SCENE.locations.iter().map(|l| &l.uuid).collect();
        assert_eq!(uuids.len(), SCENE.locations.len());
    }

    #[test]
    fn rooms_are_closed_but_for_the_planned_hole_and_show_their_fronts() {
        let tile = dvec3(9.25, 3.3, 2.9) + OFFSET.as_dvec3();
        let mut through = 0;
        for l in &SCENE.locations {
            for d in directions(500) {
                let Some((face, _)) = first_hit(l.position, d) else {
                    let out = l.position + d * ((tile.z - l.position.z) / d.z) - tile;
                    assert!(d.z > 0.0 && out.abs().max_element() < 0.3, "{d} from {}", l.position);
                    continue;
                };
                let front = SCENE.mesh.normal(face).as_dvec3().dot(d) < 0.0;
                assert!(front, "the back of {:?} from {}", instance_of(face), l.position);
            }
            through += u32::from(first_hit(l.position, (tile - l.position).normalize()).is_none());
        }
        assert_eq!(through, 2, "both locations in the conference room see the missing tile");
    }

    #[test]
    fn doors_let_one_see_from_room_to_room() {
        let rooms = rooms();
        let mut seen = BTreeSet::new();
        for l in &SCENE.locations {
            let own = rooms.iter().find(|(_, room)| room.contains(l.position.as_vec3())).unwrap().0;
            // Between knee and head, where doors are.
            for d in directions(1500).filter(|d| d.z.abs() < 0.15) {
                if let Some((face, _)) = first_hit(l.position, d) {
                    let other = instance_of(face).room;
                    if other != *own && instance_of(face).class != "door" {
                        seen.insert((*own, other));
                    }
                }
            }
        }
        for other in ["office_1", "conferenceRoom_1"] {
            assert!(seen.contains(&("hallway_1", other)), "{seen:?}");
        }
        assert!(seen.iter().any(|(from, _)| *from != "hallway_1"), "{seen:?}");
    }

    #[test]
    fn no_two_faces_lie_on_one_another() {
        // Faces by their plane, either side up; corners in the two axes in which the plane is widest.
        let mut planes: BTreeMap<[i64; 4], Vec<(u32, [DVec2; 3])>> = BTreeMap::new();
        for f in faces() {
            let n = SCENE.mesh.normal(f).as_dvec3();
            let n = if n[n.abs().max_position()] < 0.0 { -n } else { n };
            let t = TRIANGLES[f as usize];
            let axis = n.abs().max_position();
            let flat = t.map(|p| dvec2(p[(axis + 1) % 3], p[(axis + 2) % 3]));
            let key = [n.x * 500.0, n.y * 500.0, n.z * 500.0, n.dot(t[0]) * 1000.0];
            planes.entry(key.map(|x| (x + 0.25).round() as i64)).or_default().push((f, flat));
        }
        // Apart by a line along an edge of one of them, but for a tenth of a millimetre.
        let apart = |a: &[DVec2; 3], b: &[DVec2; 3]| {
            (0..3).any(|i| {
                let edge = (a[(i + 1) % 3] - a[i]).normalize();
                let side = |p: DVec2| edge.perp_dot(p - a[i]);
                let inner = side(a[(i + 2) % 3]).signum();
                b.iter().all(|&p| side(p) * inner < 1e-4)
            })
        };
        let mut overlaps = BTreeMap::new();
        for list in planes.values_mut() {
            let left = |t: &[DVec2; 3]| t.iter().map(|p| p.x).fold(f64::MAX, f64::min);
            list.sort_by(|a, b| left(&a.1).total_cmp(&left(&b.1)));
            for (i, (f, a)) in list.iter().enumerate() {
                let right = a.iter().map(|p| p.x).fold(f64::MIN, f64::max);
                for (g, b) in list[i + 1..].iter().take_while(|(_, b)| left(b) < right) {
                    if !apart(a, b) && !apart(b, a) {
                        let pair = [instance_of(*f), instance_of(*g)].map(|i| (i.class, i.number, i.room));
                        overlaps.entry(pair).or_insert(SCENE.mesh.triangle(*f)[0] - OFFSET);
                    }
                }
            }
        }
        assert!(overlaps.is_empty(), "{overlaps:#?}");
    }
}
