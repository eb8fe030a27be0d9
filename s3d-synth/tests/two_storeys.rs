//! A house of two storeys is complete, and is one building.

use crate::common;

use common::{Seen, directions};
use s3d_geom::glam::{DVec3, vec2};
use s3d_label::Class;
use s3d_synth::building::{Stairwell, Thing};
use s3d_synth::{Building, BuildingError};

fn house() -> Building {
    Building { texture_scale: 0.05, ..Building::two_storeys() }
}

#[test]
fn it_is_closed_and_labelled() {
    let seen = Seen::new(house().build().unwrap());
    seen.check_instances();
    seen.check_colors();
    seen.check_no_overlaps();
    for location in &seen.scene.locations {
        assert!(seen.clearance(location.position) > 0.4, "{location:?}");
        for d in directions(400) {
            let (face, _) = seen.first_hit(location.position, d).unwrap();
            let front = seen.scene.mesh.normal(face).as_dvec3().dot(d) < 0.0;
            assert!(front, "the back of {:?} from {location:?} along {d}", seen.instance_of(face));
        }
    }
}

#[test]
fn stairs_lead_from_one_floor_to_the_other() {
    let seen = Seen::new(house().build().unwrap());
    // Downwards from 1 m above a person's path, a ray meets floor, fifteen treads, and the floor above.
    let height = |y: f64, above: f64| {
        let (face, down) = seen.first_hit(DVec3::new(0.6, y, above), -DVec3::Z).unwrap();
        (above - down, seen.instance_of(face).class)
    };
    let mut z = 0.0;
    let mut risers = 0;
    for k in 0..=60 {
        let (next, class) = height(1.0 + 0.07 * f64::from(k), z + 1.0);
        assert!(next - z > -1e-4 && next - z < 0.179, "from {z} to {next}");
        risers += u32::from(next - z > 0.1);
        assert_eq!(class == Class::FLOOR, risers == 0 || risers == 16);
        // There is free space above the head.
        let up = seen
            .first_hit(DVec3::new(0.6, 1.0 + 0.07 * f64::from(k), next + 0.1), DVec3::Z)
            .unwrap();
        assert!(up.1 > 1.85, "{up:?} at {next}");
        z = next;
    }
    assert!(risers == 16 && (z - 2.85).abs() < 1e-3, "{risers} risers to {z}");
}

#[test]
fn what_is_impossible_is_told() {
    let mut building = house();
    building.rooms[3].stairwell =
        Some(Stairwell { low: vec2(0.0, 2.2), high: vec2(9.0, 5.0), depth_m: 0.15 });
    let message = |b: &Building| b.build().unwrap_err().to_string();
    assert_eq!(message(&building), "hallway_1: stairwell 0 leaves the room");
    let mut building = house();
    building.rooms[3].stairwell = Some(Stairwell { low: vec2(0.0, 2.2), high: vec2(1.0, 5.0), depth_m: 0.0 });
    assert!(matches!(building.build(), Err(BuildingError::Range(_))));
    let mut building = house();
    let stairs = Thing::Stairs { width_m: 1.0, steps: 0, tread_m: 0.3, riser_m: 0.2 };
    building.rooms[0].items[0] = s3d_synth::building::Item::standing([0.6, 1.2, 0.0], 0.0, stairs);
    assert!(message(&building).contains("the steps of stairs is 0"), "{}", message(&building));
}
