//! The types of rooms to generate, and a look at every face of a scene without a renderer.

#![allow(dead_code, unreachable_pub, reason = "each test takes what it needs")]

use s3d_geom::glam::{DVec2, DVec3, dvec2};
use s3d_geom::{Aabb, FaceColor, Wrap};
use s3d_label::{Class, Room, RoomType};
use s3d_synth::{AnnotatedScene, Instance};
use std::collections::BTreeMap;

/// The types of generated rooms.
pub const TYPES: [RoomType; 10] = [
    RoomType::OFFICE,
    RoomType::CONFERENCE_ROOM,
    RoomType::LOUNGE,
    RoomType::LOBBY,
    RoomType::OPENSPACE,
    RoomType::PANTRY,
    RoomType::COPY_ROOM,
    RoomType::STORAGE,
    // These need models.
    RoomType::AUDITORIUM,
    RoomType::WC,
];

/// The first types need no models.
pub const PLAIN_TYPES: usize = 8;

/// A scene and its triangles.
pub struct Seen {
    pub scene: AnnotatedScene,
    pub triangles: Vec<[DVec3; 3]>,
}

impl Seen {
    pub fn new(scene: AnnotatedScene) -> Self {
        let faces = 0..scene.mesh.faces().len() as u32;
        let triangles = faces.map(|f| scene.mesh.triangle(f).map(|p| p.as_dvec3())).collect();
        Self { scene, triangles }
    }

    pub fn faces(&self) -> std::ops::Range<u32> {
        0..self.scene.mesh.faces().len() as u32
    }

    pub fn instance_of(&self, face: u32) -> Instance {
        self.scene.instances[self.scene.instance_of_face[face as usize] as usize]
    }

    /// The boxes of the rooms, from their walls.
    pub fn rooms(&self) -> BTreeMap<Room, Aabb> {
        let mut rooms = BTreeMap::new();
        for face in self.faces().filter(|&f| self.instance_of(f).class == Class::WALL) {
            let room = rooms.entry(self.instance_of(face).room).or_insert(Aabb::EMPTY);
            *room = self.scene.mesh.triangle(face).into_iter().fold(*room, Aabb::with);
        }
        rooms
    }

    /// The first face that the ray from `o` along the unit vector `d` meets, and how far away.
    pub fn first_hit(&self, o: DVec3, d: DVec3) -> Option<(u32, f64)> {
        let hits = self
            .faces()
            .zip(&self.triangles)
            .filter_map(|(f, t)| meets(o, d, t).map(|t| (f, t)));
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// How far `p` is from the nearest face.
    pub fn clearance(&self, p: DVec3) -> f64 {
        self.triangles.iter().map(|t| distance(p, t)).fold(f64::MAX, f64::min)
    }

    /// Every instance must have faces and be numbered from 1 in its room. Every room must have floor, ceiling
    /// and four walls.
    pub fn check_instances(&self) {
        let s = &self.scene;
        let mut counts = vec![0; s.instances.len()];
        s.instance_of_face.iter().for_each(|&i| counts[i as usize] += 1);
        assert_eq!(s.instance_of_face.len(), s.mesh.faces().len());
        assert!(s.instance_of_face.is_sorted());
        assert!(counts.iter().all(|&n| n >= 12 || n > 0 && n % 2 == 0), "{counts:?}");
        let mut next = BTreeMap::new();
        for i in &s.instances {
            let number = next.entry((i.class, i.room)).or_insert(0);
            *number += 1;
            assert_eq!(i.number, *number, "{i:?}");
        }
        for room in s.instances.iter().map(|i| i.room) {
            for (class, n) in [(Class::FLOOR, 1), (Class::CEILING, 1), (Class::WALL, 4)] {
                assert_eq!(next[&(class, room)], n, "{class} in {room}");
            }
        }
    }

    /// All things must stay in their rooms; only windows and doors reach into the walls.
    pub fn check_things_stay_in_their_rooms(&self) {
        let rooms = self.rooms();
        for f in self.faces() {
            let instance = self.instance_of(f);
            let room = rooms[&self.instance_of(f).room];
            let deep = if matches!(instance.class, Class::WINDOW | Class::DOOR) {
                0.161
            } else {
                2e-3
            };
            let room = Aabb { min: room.min - deep, max: room.max + deep };
            for p in self.scene.mesh.triangle(f) {
                assert!(room.contains(p), "{instance:?} at {p}");
            }
        }
    }

    /// Every face must have a texture with coordinates in range, or a colour. Returns the number of faces
    /// with each.
    pub fn check_colors(&self) -> [usize; 2] {
        let mut textured = 0;
        let mut plain = 0;
        for f in self.faces() {
            match self.scene.mesh.color_of(f) {
                FaceColor::Texture(_, texture, uvs) => {
                    textured += 1;
                    for uv in uvs {
                        assert!(uv.min_element() >= -1e-5, "{}: {uv}", texture.name);
                        if texture.wrap == [Wrap::Clamp; 2] {
                            assert!(uv.max_element() <= 1.0 + 1e-5, "{}: {uv}", texture.name);
                        }
                    }
                }
                FaceColor::Flat(color) => {
                    plain += 1;
                    assert_ne!(color, [0; 3]);
                }
                FaceColor::Corners(_) => panic!("there are no vertex colours"),
            }
        }
        let textures = self.scene.mesh.textures();
        let names: std::collections::BTreeSet<_> = textures.iter().map(|t| &t.name).collect();
        assert_eq!(names.len(), textures.len(), "textures have names of their own");
        assert!(!textures.iter().any(|t| t.image.pixels().contains(&[0; 3])), "black means missing");
        [textured, plain]
    }

    /// No face may lie on another.
    pub fn check_no_overlaps(&self) {
        // Faces grouped by their plane, whichever side is up. Corners are given along the two axes in which
        // the plane is widest.
        let mut planes: BTreeMap<[i64; 4], Vec<(u32, [DVec2; 3])>> = BTreeMap::new();
        for f in self.faces() {
            let n = self.scene.mesh.normal(f).as_dvec3();
            let n = if n[n.abs().max_position()] < 0.0 { -n } else { n };
            let t = self.triangles[f as usize];
            let axis = n.abs().max_position();
            let flat = t.map(|p| dvec2(p[(axis + 1) % 3], p[(axis + 2) % 3]));
            let key = [n.x * 500.0, n.y * 500.0, n.z * 500.0, n.dot(t[0]) * 1000.0];
            planes
                .entry(key.map(|x| (x + 0.25).round() as i64))
                .or_default()
                .push((f, flat));
        }

        // Two triangles are apart if a line along an edge of one separates them, up to a step of the
        // builder's lattice.
        let apart = |a: &[DVec2; 3], b: &[DVec2; 3]| {
            (0..3).any(|i| {
                let edge = (a[(i + 1) % 3] - a[i]).normalize();
                let side = |p: DVec2| edge.perp_dot(p - a[i]);
                let inner = side(a[(i + 2) % 3]).signum();
                b.iter().all(|&p| side(p) * inner < 2e-4)
            })
        };

        let mut overlaps = BTreeMap::new();
        for list in planes.values_mut() {
            let left = |t: &[DVec2; 3]| t.iter().map(|p| p.x).fold(f64::MAX, f64::min);
            list.sort_by(|a, b| left(&a.1).total_cmp(&left(&b.1)));

            for (i, (f, a)) in list.iter().enumerate() {
                let right = a.iter().map(|p| p.x).fold(f64::MIN, f64::max);
                for (g, b) in list[i + 1..].iter().take_while(|(_, b)| left(b) < right) {
                    // Far from the origin, the plane's distance in the key is rough.
                    let n = self.scene.mesh.normal(*f).as_dvec3();
                    let first = self.triangles[*f as usize][0];
                    let level = self.triangles[*g as usize]
                        .iter()
                        .all(|p| n.dot(p - first).abs() < 2e-3);

                    // Parts of one thing may touch: the faces between them are hidden.
                    let opposite = n.dot(self.scene.mesh.normal(*g).as_dvec3()) < 0.0;
                    let of = &self.scene.instance_of_face;
                    let touches = opposite && of[*f as usize] == of[*g as usize];

                    if level && !touches && !apart(a, b) && !apart(b, a) {
                        let pair =
                            [self.instance_of(*f), self.instance_of(*g)].map(|i| (i.class, i.number, i.room));
                        overlaps
                            .entry(pair)
                            .or_insert([*f, *g].map(|face| self.scene.mesh.triangle(face)));
                    }
                }
            }
        }

        assert!(overlaps.is_empty(), "{overlaps:#?}");
    }
}

/// The distance along the unit vector `d` at which the ray from `o` meets a triangle.
fn meets(o: DVec3, d: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let e = b - a;
    let f = c - a;
    let s = o - a;
    let p = d.cross(f);
    let det = e.dot(p);
    let u = s.dot(p) / det;
    if !(-1e-9..=1.0 + 1e-9).contains(&u) {
        return None;
    }
    let q = s.cross(e);
    let v = d.dot(q) / det;
    let t = f.dot(q) / det;
    (v >= -1e-9 && u + v <= 1.0 + 1e-9 && t > 0.0).then_some(t)
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

/// `n` directions, spread evenly over the sphere.
pub fn directions(n: u32) -> impl Iterator<Item = DVec3> {
    (0..n).map(move |i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / f64::from(n);
        (DVec2::from_angle(2.399_963 * f64::from(i)) * (1.0 - z * z).sqrt()).extend(z)
    })
}
