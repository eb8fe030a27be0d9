use super::*;
use crate::error::Error;
use crate::survey::outlook::Outlook;
use glam::{Vec3, dvec3};
use s3d_geom::MeshParts;
use s3d_label::{Class, Room};
use s3d_synth::{AnnotatedScene, Building};
use std::collections::BTreeSet;

const SHARE: FreeSpaceOptions = FreeSpaceOptions { share: 0.95, distance_m: None, seed: 1 };

fn place(mesh: &TriMesh, options: FreeSpaceOptions) -> Result<FreeSpace> {
    let scene = Scene::new(mesh);
    let nearest = NearestFaces::new(mesh);
    place_in_free_space(&Context::default(), 1, &scene, &nearest, options)
}

fn positions(found: &FreeSpace) -> Vec<DVec3> {
    found.locations.iter().map(|l| l.pose.location).collect()
}

/// Surfaces of four corners, counter-clockwise seen from their front.
#[derive(Default)]
struct Quads(MeshParts);

impl Quads {
    fn add(&mut self, corners: [[f32; 3]; 4]) {
        let first = self.0.positions.len() as u32;
        self.0.positions.extend(corners.map(Vec3::from_array));
        self.0
            .faces
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }

    /// Adds sides of a box: down, up, −y, +x, +y, −x, with fronts outside, or inside for a room.
    fn sides(&mut self, low: [f32; 3], high: [f32; 3], sides: &[usize], is_room: bool) {
        let ends = [low, high];
        let all = [[2, 3, 1, 0], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]];
        for &side in sides {
            let mut corners = all[side].map(|i| [ends[i & 1][0], ends[i >> 1 & 1][1], ends[i >> 2][2]]);
            if is_room {
                corners.reverse();
            }
            self.add(corners);
        }
    }

    fn block(&mut self, low: [f32; 3], high: [f32; 3]) {
        self.sides(low, high, &[0, 1, 2, 3, 4, 5], false);
    }

    fn room(&mut self, low: [f32; 3], high: [f32; 3]) {
        self.sides(low, high, &[0, 1, 2, 3, 4, 5], true);
    }

    fn mesh(self) -> TriMesh {
        TriMesh::new(self.0).unwrap()
    }
}

/// Checks that every place is in a room, free, on a floor, and looks at fronts; that every room has one; and
/// that no uuid comes twice.
fn check(building: &Building, scene: &AnnotatedScene, found: &FreeSpace) {
    let rays = Scene::new(&scene.mesh);
    let nearest = NearestFaces::new(&scene.mesh);

    let mut rooms: BTreeSet<Room> = BTreeSet::new();
    let mut uuids = BTreeSet::new();
    for location in &found.locations {
        let at = location.pose.location;
        let inside: Vec<Room> = building
            .rooms
            .iter()
            .filter(|room| room.contains(at - building.origin.as_dvec3()))
            .map(|room| room.room)
            .collect();
        assert_eq!(inside.len(), 1, "{at} is in {inside:?}");
        rooms.insert(inside[0]);

        let clearance = nearest.nearest(at.as_vec3()).distance_m;
        assert!(clearance > 0.19, "{at}: {clearance} m");

        let below = cast_ray(&rays, at, -DVec3::Z).unwrap();
        let on = scene.instances[scene.instance_of_face[below.face as usize] as usize];
        let is_rug = on.class == Class::CLUTTER && below.t > 1.48;
        assert!((below.t - 1.5).abs() < 0.03, "{at}: {} m above {on:?}", below.t);
        assert!(on.class == Class::FLOOR || is_rug, "{at}: on {on:?}");

        let outlook = Outlook::of(&rays, location);
        assert!(outlook.coverage > 0.9 && outlook.back_sides < 0.1, "{at}: {outlook:?}");
        assert!(uuids.insert(&location.uuid));
    }

    assert_eq!(rooms.len(), building.rooms.len(), "{rooms:?}");
    let seen = found.seen;
    assert!(seen.visible_m2 <= seen.surface_m2 && seen.seen_m2.is_sorted_by(|a, b| a >= b));

    let floor = found.floor;
    let m2 = [floor.up_facing_m2, floor.headroom_m2, floor.walkable_m2, floor.inside_m2];
    assert!(m2.is_sorted_by(|a, b| a >= b) && floor.inside_m2 > 1.0, "{floor:?}");
}

fn built(building: &Building) -> AnnotatedScene {
    Building { texture_scale: 0.02, ..building.clone() }.build().unwrap()
}

#[test]
fn every_room_of_the_demo_gets_a_location() {
    let building = Building::demo();
    let scene = built(&building);
    let found = place(&scene.mesh, SHARE).unwrap();
    check(&building, &scene, &found);
    let seen = found.seen;
    assert!(seen.seen_m2[0] >= 0.95 * seen.visible_m2, "{seen:?}");
    assert!((8..=20).contains(&found.locations.len()), "{}", found.locations.len());
    assert!(found.warnings.is_empty(), "{:?}", found.warnings);
}

#[test]
fn both_storeys_and_every_room_get_a_location() {
    let building = Building::two_storeys();
    let scene = built(&building);
    for distance_m in [None, Some(2.5)] {
        let found = place(&scene.mesh, FreeSpaceOptions { distance_m, ..SHARE }).unwrap();
        check(&building, &scene, &found);
    }
}

/// Returns the heights of the lowest and the highest foot of the largest floor.
fn heights(building: &Building) -> [f64; 2] {
    let scene = built(building);
    let rays = Scene::new(&scene.mesh);
    let nearest = NearestFaces::new(&scene.mesh);
    let ground = Ground::find(&Context::default(), &rays, &nearest, Facing::Fronts).unwrap();
    ground.heights_of_largest()
}

#[test]
fn stairs_join_storeys() {
    let mut building = Building::two_storeys();
    let [low, high] = heights(&building);
    assert!(low < 0.01 && high > 2.84, "{low} {high}");

    // Without its stairs.
    building.rooms[0].items.remove(0);
    let [low, high] = heights(&building);
    assert!(high - low < 0.2, "{low} {high}");
}

fn message(mesh: &TriMesh) -> String {
    place(mesh, SHARE).map(|f| f.floor).unwrap_err().to_string()
}

#[test]
fn what_is_no_room_is_refused_with_what_was_found() {
    let mut plane = Quads::default();
    plane.add([[-5., -5., 0.], [5., -5., 0.], [5., 5., 0.], [-5., 5., 0.]]);
    let text = message(&plane.mesh());
    assert!(
        text.contains("100.00 m² face up, 100.00 m² of these are free")
            && text.contains("none of these is inside: rays from there end on a front side in 28 %"),
        "{text}"
    );

    let mut wall = Quads::default();
    wall.add([[0., 0., 0.], [4., 0., 0.], [4., 0., 3.], [0., 0., 3.]]);
    let text = message(&wall.mesh());
    assert!(text.contains(", 0.00 m² face up; "), "{text}");

    let mut cube = Quads::default();
    cube.block([0., 0., 0.], [2., 2., 2.]);
    let text = message(&cube.mesh());
    assert!(text.contains("2.00 × 2.00 × 2.00 m") && text.contains("either an object"), "{text}");
}

#[test]
fn a_room_that_is_inside_out_is_named_so() {
    let mut room = Quads::default();
    room.block([0., 0., 0.], [5., 4., 2.6]);
    let text = message(&room.mesh());
    assert!(text.contains("inside out") && text.contains("20.00 m² face up"), "{text}");
}

#[test]
fn units_that_are_wrong_are_asked_for() {
    // A room in millimetres, and one in kilometres.
    for size in [[5000., 4000., 2600.], [0.005, 0.004, 0.0026]] {
        let mut room = Quads::default();
        room.room([0.; 3], size);
        let text = message(&room.mesh());
        assert!(text.contains("`units` right"), "{text}");
    }
}

/// A room of 6 × 5 m with tempting furniture: a table, a bed, a wardrobe and a box.
fn furnished() -> TriMesh {
    let mut room = Quads::default();
    room.room([0., 0., 0.], [6., 5., 3.8]);
    room.block([0.6, 0.6, 0.7], [3.0, 2.2, 0.75]);
    room.block([4.0, 0., 0.], [6.0, 2.0, 0.45]);
    // In the corner, so two of its sides are walls.
    room.block([0., 4.2, 0.], [2.5, 5.0, 2.0]);
    room.block([5.3, 4.3, 0.], [6.0, 5.0, 0.4]);
    room.mesh()
}

#[test]
fn nobody_stands_on_furniture() {
    let mesh = furnished();
    for distance_m in [None, Some(0.6)] {
        let found = place(&mesh, FreeSpaceOptions { distance_m, ..SHARE }).unwrap();
        assert!(found.locations.len() >= if distance_m.is_some() { 8 } else { 1 });
        for at in positions(&found) {
            assert!((at.z - 1.5).abs() < 1e-5, "{at}");
        }
        let walkable = found.floor.walkable_m2;
        let all = found.floor.up_facing_m2;
        assert!((40.3..40.4).contains(&all) && (13.0..18.0).contains(&walkable), "{:?}", found.floor);
    }
}

/// A house with thick walls on stilts over a yard, with a flat roof. Everything that faces up, except its
/// floor, is outside, under it, or in its walls.
fn house(has_underside: bool) -> TriMesh {
    let mut house = Quads::default();
    house.room([0., 0., 0.], [8., 6., 2.7]);
    house.sides([-0.6, -0.6, -0.3], [8.6, 6.6, 3.0], &[1, 2, 3, 4, 5], false);
    if has_underside {
        house.sides([-0.6, -0.6, -0.3], [8.6, 6.6, 3.0], &[0], false);
    }
    // A surface in the wall that faces up, with free space above it.
    house.add([[-0.55, 0., 0.], [-0.05, 0., 0.], [-0.05, 6., 0.], [-0.55, 6., 0.]]);
    house.add([[-20., -20., -2.4], [28., -20., -2.4], [28., 26., -2.4], [-20., 26., -2.4]]);
    house.mesh()
}

#[test]
fn nobody_stands_outside_under_or_in_a_wall() {
    for has_underside in [false, true] {
        let mesh = house(has_underside);
        for distance_m in [None, Some(1.0)] {
            let options = FreeSpaceOptions { distance_m, share: 1.0, seed: 7 };
            // The yard is most of the surface, and nobody sees it.
            match place(&mesh, options) {
                Ok(found) => {
                    assert!(found.warnings[0].contains("of the surface"), "{:?}", found.warnings);
                    for at in positions(&found) {
                        let is_in =
                            at.cmpge(dvec3(0., 0., 1.49)).all() && at.cmple(dvec3(8., 6., 1.51)).all();
                        assert!(is_in, "{at}, {has_underside}");
                    }
                }
                Err(e) => panic!("{e}"),
            }
        }
    }
}

/// Under eaves there is a floor, a ceiling and a wall, and two walls in the corner of two wings. It is still
/// outside.
#[test]
fn nobody_stands_under_eaves() {
    let mut house = Quads::default();
    for (low, high) in [([0., 0., 0.], [8., 5., 2.6]), ([0., 5.4, 0.], [4., 10., 2.6])] {
        house.room(low, high);
        let out = |corner: [f32; 3], by: f32| [corner[0] + by, corner[1] + by, corner[2]];
        house.sides(out(low, -0.2), out(high, 0.2), &[2, 3, 4, 5], false);
    }
    house.block([-2.0, -2.0, -0.3], [10.0, 12.0, -0.01]);
    house.block([-2.0, -2.0, 2.65], [10.0, 12.0, 2.9]);
    let found = place(&house.mesh(), FreeSpaceOptions { share: 1.0, ..SHARE }).unwrap();
    let places = positions(&found);
    for at in &places {
        let is_in = at.x > 0. && at.y > 0. && (at.x < 8. && at.y < 5. || at.x < 4. && at.y < 10.);
        assert!(is_in, "{places:?}");
    }
    for room in [0.0..5.0, 5.4..10.0] {
        assert!(places.iter().any(|at| room.contains(&at.y)), "{places:?}");
    }
}

#[test]
fn a_yard_with_nothing_around_is_no_place_and_says_what_rays_meet() {
    // The same house without its room.
    let mut house = Quads::default();
    house.block([-0.6, -0.6, 0.], [8.6, 6.6, 3.0]);
    house.add([[-20., -20., 0.], [28., -20., 0.], [28., 26., 0.], [-20., 26., 0.]]);
    let text = message(&house.mesh());
    assert!(
        text.contains("none of these is inside") && text.contains("2208.00") || text.contains("face up"),
        "{text}"
    );
}

#[test]
fn rooms_behind_shut_doors_get_places_too() {
    let mut rooms = Quads::default();
    rooms.room([0.; 3], [9., 7., 2.7]);
    // The closet is 0.2 % of the surface, and is seen from nowhere else.
    rooms.room([9.2, 0., 0.], [10.2, 1.2, 2.2]);
    let found = place(&rooms.mesh(), SHARE).unwrap();
    let closet = positions(&found).into_iter().filter(|p| p.x > 9.2 && p.x < 10.2);
    assert_eq!(closet.count(), 1);
}

#[test]
fn a_mesh_of_any_measures_ends() {
    // A room with a needle that is longer than grids go, and one with a needle of 18 km.
    for (to, is_long) in [([3e7, 3e7, 1.2], true), ([13_000., 13_000., 1.2], false)] {
        let mut room = Quads::default();
        room.room([0.; 3], [5., 4., 2.6]);
        room.add([[1., 1., 1.2], [1.001, 1., 1.2], to, to.map(|c| c + 1e-3)]);
        let parts = TriMesh::new(room.0).unwrap();
        let found = place(&parts, SHARE);
        if is_long {
            let message = found.map(|f| f.floor).unwrap_err().to_string();
            assert!(message.contains("`units` right"));
        } else {
            assert!(!found.unwrap().locations.is_empty());
        }
    }
}

#[test]
fn a_room_without_a_ceiling_is_a_room() {
    let mut room = Quads::default();
    room.sides([0.; 3], [5., 4., 2.2], &[0, 2, 3, 4, 5], true);
    let found = place(&room.mesh(), SHARE).unwrap();
    assert!(!found.locations.is_empty());

    // A floor with two walls is not a room.
    let mut corner = Quads::default();
    corner.sides([0.; 3], [5., 4., 2.2], &[0, 2, 3], true);
    assert!(message(&corner.mesh()).contains("none of these is inside"));
}

#[test]
fn places_of_a_pattern_keep_apart_where_they_see_each_other_alone() {
    let building = Building::demo();
    let scene = built(&building);
    let found = place(&scene.mesh, FreeSpaceOptions { distance_m: Some(3.0), ..SHARE }).unwrap();
    check(&building, &scene, &found);

    let rays = Scene::new(&scene.mesh);
    let at = positions(&found);
    let nearest = NearestFaces::new(&scene.mesh);
    let narrow = at.iter().filter(|p| nearest.nearest(p.as_vec3()).distance_m < 0.49);
    // Almost every place here has room enough.
    assert!(narrow.count() <= 1);

    let mut through_walls = 0;
    for (i, a) in at.iter().enumerate() {
        for b in at[..i].iter().filter(|b| b.distance(*a) < 3.0) {
            assert!(!sees(&rays, *a, *b), "{a} {b}");
            through_walls += 1;
        }
    }
    assert!(through_walls > 0);
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let mesh = furnished();
    let with = |threads, distance_m| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool
            .install(|| place(&mesh, FreeSpaceOptions { distance_m, ..SHARE }))
            .unwrap();
        format!("{found:?}")
    };
    for distance_m in [None, Some(1.0)] {
        assert_eq!(with(1, distance_m), with(3, distance_m));
    }
    assert_ne!(with(1, None), with(1, Some(1.0)));
}

#[test]
fn it_can_be_cancelled() {
    let mesh = furnished();
    let scene = Scene::new(&mesh);
    let nearest = NearestFaces::new(&mesh);
    let context = Context::default();
    context.cancel.cancel();
    let found = place_in_free_space(&context, 1, &scene, &nearest, SHARE);
    assert!(matches!(found, Err(Error::Cancelled)));
}
