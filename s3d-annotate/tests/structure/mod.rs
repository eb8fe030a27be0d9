//! The structure of scenes whose instances and rooms are known, and of small made-up meshes.

mod measure;

use measure::Measured;
use s3d_synth::{Building, BuildingOptions};

/// Checks the structure of a building whose rooms are known.
fn check(building: &Building) {
    let measured = Measured::of(building);
    println!("{measured:#?}");
    measured.check();
}

fn coarse(building: Building) -> Building {
    Building { texture_scale: 0.05, ..building }
}

#[test]
fn the_built_in_scene() {
    check(&coarse(Building::demo()));
}

#[test]
fn a_house_with_stairs() {
    check(&coarse(Building::two_storeys()));
}

#[test]
fn generated_houses() {
    for (rooms, storeys, seed) in [(8, 1, 42), (8, 2, 7), (12, 2, 11), (6, 1, 3)] {
        let options = BuildingOptions { storeys, texture_scale: 0.05, ..BuildingOptions::drawn(rooms, seed) };
        check(&Building::generate(&options).unwrap());
    }
}

#[test]
fn generated_areas() {
    for (area, seed) in [(3, 7), (2, 1)] {
        let options = BuildingOptions::area(area, seed).unwrap();
        let options = BuildingOptions { texture_scale: 0.05, ..options };
        check(&Building::generate(&options).unwrap());
    }
}
