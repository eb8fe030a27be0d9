//! The structure of scenes whose instances and rooms are known, and of small made-up meshes.

mod measure;
mod scans;
mod shapes;

use measure::Measured;
use s3d_annotate::labelling::Room;
use s3d_annotate::structure::{Structure, find_structure};
use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::{Polygon, TriMesh};
use s3d_label::RoomType;
use s3d_synth::scenes::scan_like;
use s3d_synth::{Building, BuildingOptions, RoomOptions};
use scans::ScanGrid;
use shapes::{Shapes, two_rooms};

fn coarse(building: Building) -> Building {
    Building { texture_scale: 0.05, ..building }
}

#[test]
fn the_built_in_scene() {
    Measured::of(&coarse(Building::demo())).check();
}

#[test]
fn a_house_with_stairs_has_storeys_that_do_not_overlap() {
    let building = coarse(Building::two_storeys());
    Measured::of(&building).check();

    let rooms = find_structure(&building.build().unwrap().mesh).rooms;
    let heights: Vec<[f64; 2]> = rooms
        .iter()
        .flat_map(|room| &room.parts)
        .map(|part| part.heights)
        .collect();
    let lower = heights[..3].iter().map(|[_, top]| *top).fold(0.0, f64::max);
    assert!(heights[3..].iter().all(|[bottom, _]| *bottom >= lower), "{heights:?}");
}

#[test]
fn generated_houses() {
    for (rooms, storeys, seed) in [(8, 1, 42), (8, 2, 7), (12, 2, 11), (6, 1, 3)] {
        let options = BuildingOptions { storeys, texture_scale: 0.05, ..BuildingOptions::drawn(rooms, seed) };
        Measured::of(&Building::generate(&options).unwrap()).check();
    }
}

#[test]
fn generated_areas() {
    for (area, seed) in [(3, 7), (2, 1)] {
        let options = BuildingOptions::area(area, seed).unwrap();
        let options = BuildingOptions { texture_scale: 0.05, ..options };
        Measured::of(&Building::generate(&options).unwrap()).check();
    }
}

/// The number of floors, ceilings and walls.
fn counts(found: &Structure) -> [usize; 3] {
    ["floor", "ceiling", "wall"]
        .map(|class| found.surfaces.iter().filter(|surface| surface.class == class).count())
}

/// The areas of the rooms, m², ascending.
fn areas(found: &Structure) -> Vec<f64> {
    let area = |outline: &Vec<[f64; 2]>| {
        let outer = outline.iter().copied().map(Into::into).collect();
        Polygon { outer, holes: vec![] }.area()
    };
    let rooms = found.rooms.iter();
    let mut areas: Vec<f64> = rooms
        .map(|room| room.parts.iter().map(|part| area(&part.outline)).sum())
        .collect();
    areas.sort_by(f64::total_cmp);
    areas
}

#[test]
fn a_door_parts_two_rooms_with_and_without_a_lintel_and_a_ceiling() {
    for (top_m, has_ceiling, degrees) in
        [(2.1, true, 0.0), (2.1, true, 30.0), (2.6, true, 30.0), (2.1, false, 30.0), (2.6, false, 12.0)]
    {
        let found = find_structure(&two_rooms(0.9, top_m, has_ceiling).turned(degrees));
        let case = format!("{top_m} {has_ceiling} {degrees}: {found:#?}");
        let ceilings = if has_ceiling { 2 } else { 0 };
        assert_eq!(counts(&found), [2, ceilings, 8], "{case}");
        let areas = areas(&found);
        assert!((areas[0] - 12.0).abs() < 0.4 && (areas[1] - 16.0).abs() < 0.4, "{areas:?} {case}");
        assert!(found.rooms.iter().all(|room| room.parts[0].outline.len() <= 8), "{case}");
    }
}

#[test]
fn a_wide_opening_parts_nothing_with_and_without_a_beam() {
    for (top_m, degrees) in [(2.6, 0.0), (2.6, 30.0), (2.1, 0.0), (2.1, 30.0)] {
        let found = find_structure(&two_rooms(2.4, top_m, true).turned(degrees));
        assert_eq!(found.rooms.len(), 1, "{top_m} {degrees}: {found:#?}");
        assert_eq!(counts(&found)[..2], [1, 1]);
    }
}

#[test]
fn windings_of_any_direction_give_the_same_surfaces() {
    let mesh = two_rooms(0.9, 2.1, true).with_mixed_windings().turned(30.0);
    let found = find_structure(&mesh);
    assert_eq!((counts(&found), found.rooms.len()), ([2, 2, 8], 2), "{found:#?}");
    let area_m2: f64 = found.surfaces.iter().map(|surface| surface.area_m2).sum();
    assert!(area_m2 > 0.97 * mesh.total_area(), "{area_m2} of {}", mesh.total_area());

    let mut parts = two_rooms(0.9, 2.1, true).turned(30.0).into_parts();
    parts.faces.iter_mut().for_each(|face| face.swap(1, 2));
    assert_eq!(counts(&find_structure(&TriMesh::new(parts).unwrap())), [2, 2, 8]);
}

#[test]
fn a_ceiling_with_a_step_is_one_and_furniture_is_none() {
    let mut shapes = Shapes::default();
    shapes
        .walls([0.0, 0.0], [5.0, 4.0], [0.0, 2.8])
        .ceiling([0.0, 0.0], [3.0, 4.0], 2.8)
        .ceiling([3.0, 0.0], [5.0, 4.0], 2.4)
        .wall([3.0, 0.0], [3.0, 4.0], [2.4, 2.8])
        // A cupboard, a table, and a lamp below the ceiling.
        .cuboid([0.01, 1.0, 0.0], [0.5, 2.5, 2.1])
        .cuboid([2.0, 1.0, 0.7], [3.6, 2.0, 0.75])
        .cuboid([1.0, 3.0, 2.72], [1.6, 3.6, 2.78]);
    let structure = 2.0 * 20.0 + 18.0 * 2.8;
    for degrees in [0.0, 30.0] {
        let found = find_structure(&shapes.turned(degrees));
        assert_eq!((counts(&found), found.rooms.len()), ([1, 1, 4], 1), "{found:#?}");
        assert!((found.surfaces[1].area_m2 - 20.0).abs() < 0.01, "{found:#?}");
        let area_m2: f64 = found.surfaces.iter().map(|surface| surface.area_m2).sum();
        assert!((area_m2 - structure).abs() < 0.6, "{area_m2} of {structure}");
    }
}

#[test]
fn a_room_under_a_roof() {
    // Two slopes of 30° over walls of 2 m.
    let mut shapes = Shapes::default();
    let rise = 2.5 * 30f32.to_radians().tan();
    shapes
        .walls([0.0, 0.0], [5.0, 6.0], [0.0, 2.0])
        .roof(5.0, 6.0, 2.0, rise);
    let found = find_structure(&shapes.turned(20.0));
    assert_eq!((counts(&found), found.rooms.len()), ([1, 1, 4], 1), "{found:#?}");
    let slopes_m2 = 30.0 / 30f64.to_radians().cos();
    assert!((found.surfaces[1].area_m2 - slopes_m2).abs() < 0.1, "{found:#?}");
}

#[test]
fn a_corridor_around_a_core_is_a_room_of_several_parts() {
    let mut shapes = Shapes::default();
    shapes
        .walls([0.0, 0.0], [8.0, 8.0], [0.0, 2.5])
        .ceiling([0.0, 0.0], [8.0, 8.0], 2.5);
    for (from, to) in [
        ([2.0, 2.0], [2.0, 6.0]),
        ([2.0, 6.0], [6.0, 6.0]),
        ([6.0, 6.0], [6.0, 2.0]),
        ([6.0, 2.0], [2.0, 2.0]),
    ] {
        shapes.wall(from, to, [0.0, 2.5]);
    }
    let found = find_structure(&shapes.turned(0.0));
    // What is inside the core has a floor and a ceiling too.
    assert_eq!(found.rooms.len(), 2, "{found:#?}");
    assert!(found.rooms.iter().any(|room| room.parts.len() == 2));
    let areas = areas(&found);
    assert!((areas[1] - 48.0).abs() < 1.0, "{areas:?}");
    let walls = |room| {
        found
            .surfaces
            .iter()
            .filter(|s| s.class == "wall" && s.room == Some(room))
            .count()
    };
    assert_eq!(walls(0) + walls(1), 8);
}

/// Two rooms of 4 m × 5 m and 2.5 m high, in two storeys.
fn two_rooms_one_above_the_other() -> Shapes {
    let mut shapes = Shapes::default();
    shapes
        .walls([0.0, 0.0], [4.0, 5.0], [0.0, 2.5])
        .ceiling([0.0, 0.0], [4.0, 5.0], 2.5)
        .walls([0.0, 0.0], [4.0, 5.0], [2.8, 5.3])
        .ceiling([0.0, 0.0], [4.0, 5.0], 5.3);
    shapes
}

#[test]
fn a_hall_over_two_storeys_is_a_room_of_the_lower_one() {
    let mut shapes = two_rooms_one_above_the_other();
    shapes
        .walls([4.2, 0.0], [9.0, 5.0], [0.0, 5.3])
        .ceiling([4.2, 0.0], [9.0, 5.0], 5.3);
    let found = find_structure(&shapes.turned(30.0));
    assert_eq!(found.rooms.len(), 3, "{found:#?}");
    let bottom = |room: &Room| (10.0 * room.parts[0].heights[0]).round();
    // The mesh stands at 1.2 m.
    assert_eq!(found.rooms.iter().map(bottom).collect::<Vec<_>>(), [11.0, 11.0, 39.0]);
    assert_eq!(counts(&found), [3, 3, 12]);

    // What is proposed for the hall goes up to its ceiling.
    let is_hall = |room: &Room| room.parts[0].heights[0] < 1.2 && room.parts[0].heights[1] > 1.2 + 5.2;
    let hall = found.rooms.iter().position(is_hall);
    assert!(hall.is_some(), "{found:#?}");
    let area_m2 = |class: &str| -> f64 {
        let of_hall = found.surfaces.iter().filter(|s| s.room == hall && s.class == class);
        of_hall.map(|surface| surface.area_m2).sum()
    };
    assert!((area_m2("wall") - 2.0 * (4.8 + 5.0) * 5.3).abs() < 1.0, "{}", area_m2("wall"));
    assert!((area_m2("ceiling") - 4.8 * 5.0).abs() < 0.5, "{}", area_m2("ceiling"));
}

#[test]
fn a_lost_ceiling_makes_no_hall() {
    let mut shapes = two_rooms_one_above_the_other();
    shapes.walls([4.2, 0.0], [9.0, 5.0], [0.0, 2.5]);
    let found = find_structure(&shapes.turned(30.0));
    assert_eq!(counts(&found), [3, 2, 12], "{found:#?}");
    let lower = found.rooms.iter().filter(|room| room.parts[0].heights[0] < 1.2);
    assert!(lower.count() == 2 && found.rooms[..2].iter().all(|room| room.parts[0].heights[1] < 4.1));
}

#[test]
fn furniture_alone_has_no_structure() {
    let mut chair = Shapes::default();
    chair
        .cuboid([0.0, 0.0, 0.4], [0.45, 0.45, 0.45])
        .cuboid([0.0, 0.4, 0.45], [0.45, 0.45, 0.95])
        .cuboid([0.0, 0.0, 0.0], [0.05, 0.05, 0.4]);
    let mut table = Shapes::default();
    table
        .cuboid([0.0, 0.0, 0.7], [2.4, 1.2, 0.75])
        .cuboid([1.0, 0.5, 0.0], [1.2, 0.7, 0.7]);
    for shapes in [chair, table] {
        assert_eq!(find_structure(&shapes.turned(10.0)), Structure::default());
    }
}

#[test]
fn meshes_of_any_size_are_no_fault() {
    for size in [1e-30, 1e-3, 1e6, 1e30] {
        let corners = vec![Vec3::ZERO, Vec3::X * size, Vec3::Y * size, Vec3::Z * size];
        let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2], [0, 2, 3], [0, 1, 3]]).unwrap();
        assert_eq!(find_structure(&mesh).rooms, [], "{size}");
    }
}

#[test]
fn a_scan_with_noise() {
    let found = find_structure(&scan_like(30_000, 3));
    let rooms = found.rooms.len();
    assert_eq!(counts(&found), [rooms, rooms, 4 * rooms]);
    // Rooms are 6 m wide, and one beside the other.
    let length = areas(&found).iter().sum::<f64>() / 6.0;
    let size = scan_like(30_000, 3).aabb().max;
    assert!((length - f64::from(size.y)).abs() < 0.15 * rooms as f64, "{length} of {size}");
}

fn office() -> Building {
    let room = RoomOptions { size_m: [7.0, 5.0], windows: 2, ..RoomOptions::new(RoomType::OPENSPACE) };
    let options =
        BuildingOptions { rooms: vec![room], texture_scale: 0.05, seed: 5, ..BuildingOptions::default() };
    Building::generate(&options).unwrap()
}

#[test]
fn an_office_scanned_on_any_grid() {
    // Its planes lie on the grid, at a half and a quarter of its cells, and across it.
    for (offset, degrees) in [(Vec3::ZERO, 0.0), (vec3(0.25, 0.5, 0.0), 0.0), (vec3(0.0, 0.0, 0.25), 7.0)] {
        Measured::of_scan(&office(), ScanGrid { cell_m: 0.05, noise_m: 0.004, offset, degrees }).check_scan();
    }
}

#[test]
fn the_built_in_scene_scanned() {
    // Half a cell off the grid of the scan, the faces of a beam are the most broken.
    let grid = ScanGrid { cell_m: 0.06, noise_m: 0.004, offset: Vec3::splat(0.5), degrees: 0.0 };
    Measured::of_scan(&coarse(Building::demo()), grid).check_scan();
}
