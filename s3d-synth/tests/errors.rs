//! An impossible building gives an error that names the place.

use s3d_geom::glam::{dvec3, vec2, vec3};
use s3d_synth::building::{Filling, Item, Opening, Thing, Wall};
use s3d_synth::look::OAK;
use s3d_synth::{Building, BuildingError};

/// The error from building the demo's building after a change.
fn error(change: impl FnOnce(&mut Building)) -> BuildingError {
    let mut building = Building { texture_scale: 0.02, ..Building::demo() };
    change(&mut building);
    building.build().unwrap_err()
}

fn message(change: impl FnOnce(&mut Building)) -> String {
    error(change).to_string()
}

#[test]
fn rooms() {
    assert_eq!(error(|b| b.rooms.clear()), BuildingError::NoRoom);
    assert_eq!(message(|b| b.rooms[1].room = b.rooms[0].room), "two rooms are called office_1");
    assert_eq!(message(|b| b.rooms[0].high.x = 6.0), "office_1 and conferenceRoom_1 overlap");
    assert!(message(|b| b.rooms[2].low.x = f32::NAN).starts_with("lounge_1: the smallest x is NaN"));
    assert!(message(|b| b.rooms[0].heights_m[1] = 1.9).contains("the height of the ceiling is 1.9"));
    assert!(message(|b| b.texture_scale = 0.0).contains("the scale of textures is 0"));
    // A storey above does not overlap.
    let mut building = Building { texture_scale: 0.02, ..Building::demo() };
    let mut above = building.rooms[0].clone();
    (above.room.number, above.floor_m) = (2, 3.0);
    building.rooms.push(above);
    let top = building.build().unwrap().mesh.aabb().max.z;
    assert!((top - 5.8).abs() < 1e-4, "{top}");
}

#[test]
fn openings_lamps_and_holes() {
    let outside = "office_1: the opening from -0.2 to 2.1 of its South wall is not within that wall";
    assert_eq!(message(|b| b.rooms[0].openings[0].span[0] = -0.2), outside);
    let overlap = message(|b| b.rooms[0].openings[1].span[0] = 2.0);
    assert_eq!(overlap, "office_1: two openings of its South wall overlap, from 2 to 4.6");
    // A slanted ceiling squeezes the wall above 2.1 m.
    let high = message(|b| b.rooms[2].openings[0].heights[1] = 2.2);
    assert!(high.starts_with("lounge_1: the opening from 3.9"), "{high}");
    let raised =
        Opening { wall: Wall::East, span: [1.0, 2.0], heights: [0.5, 2.1], filling: Filling::ShutDoor };
    assert!(matches!(
        error(|b| b.rooms[0].openings.push(raised)),
        BuildingError::OpeningOutside { wall: Wall::East, .. }
    ));
    assert_eq!(message(|b| b.rooms[0].lamps[1][0] = 9.0), "office_1: lamp 1 leaves the room");
    let hole = Some([vec2(1.0, 1.0), vec2(0.5, 2.0)]);
    assert_eq!(message(|b| b.rooms[0].ceiling_hole = hole), "office_1: ceiling hole 0 leaves the room");
}

#[test]
fn things() {
    let table = |width_m| Thing::Table { width_m, depth_m: 0.6, height_m: 0.7, top: OAK };
    let put = |thing| {
        move |b: &mut Building| b.rooms[0].items.insert(0, Item::standing([2.5, 2.0, 0.0], 0.0, thing))
    };
    assert!(message(put(table(0.0))).contains("office_1: the width or depth of a table is 0"));
    assert_eq!(message(put(table(6.0))), "office_1: item 0 leaves the room");
    assert!(message(put(table(f32::INFINITY))).contains("is inf"));
    let sofa = Thing::Sofa { seats: 0, fabric: OAK, cushion: OAK };
    assert!(message(put(sofa)).contains("the seats of a sofa is 0"));
    let nowhere = Item::standing([f32::NAN, 2.0, 0.0], 0.0, Thing::Keyboard);
    assert!(message(|b| b.rooms[0].items.push(nowhere)).contains("the place of a thing is NaN"));
}

#[test]
fn locations() {
    let moved = |b: &mut Building| b.locations[3].position = dvec3(5.9, 8.1, 4.0);
    assert!(matches!(error(moved), BuildingError::LocationOutside { position, .. } if position.z == 4.0));
    for uuid in ["", "0C5A7D1E93B84F62A1D7E0F4B2683C95", "0c5a7d1e93b84f62a1d7e0f4b2683c95"] {
        let named = error(|b| b.locations[1].uuid = uuid.to_owned());
        assert_eq!(named, BuildingError::Uuid { uuid: uuid.to_owned() });
    }
    assert!(matches!(error(|b| b.origin = vec3(f32::NAN, 0.0, 0.0)), BuildingError::Range(_)));
}

#[test]
fn names_of_looks_may_be_the_same() {
    use s3d_synth::look::Look;
    let bins = [Look::Plain("same", [200, 0, 0]), Look::Plain("same", [0, 0, 200])];
    let mut building = Building { texture_scale: 0.02, ..Building::demo() };
    building.rooms[0].items = bins
        .iter()
        .zip([1.0, 2.0])
        .map(|(&look, x)| Item::standing([x, 2.0, 0.0], 0.0, Thing::Bin(look)))
        .collect();
    let mesh = building.build().unwrap().mesh;
    let mut names: Vec<&str> = mesh.materials().iter().map(|m| m.name.as_str()).collect();
    let all = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all);
}
