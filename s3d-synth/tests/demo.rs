//! The demo's building: complete, closed, and the same at every call.

use crate::common;

use common::{Seen, directions};
use s3d_geom::glam::dvec3;
use s3d_label::Class;
use s3d_synth::Building;
use std::collections::BTreeSet;
use std::sync::LazyLock;

static SEEN: LazyLock<Seen> = LazyLock::new(|| Seen::new(Building::demo().build().unwrap()));

#[test]
fn names_are_those_of_the_data_set_and_every_instance_has_faces() {
    SEEN.check_instances();
    let used: BTreeSet<_> = SEEN.scene.instances.iter().map(|i| i.class).collect();
    assert_eq!(used, BTreeSet::from(Class::S3DIS));
    let rooms: BTreeSet<_> = SEEN.scene.instances.iter().map(|i| i.room.to_string()).collect();
    assert!(
        rooms
            .iter()
            .eq(["conferenceRoom_1", "hallway_1", "lounge_1", "office_1"]),
        "{rooms:?}"
    );
}

#[test]
fn its_size_is_a_small_scans() {
    let mesh = &SEEN.scene.mesh;
    let n = mesh.faces().len();
    assert!((20_000..60_000).contains(&n), "{n} faces");
    let aabb = mesh.aabb();
    assert!(aabb.min.x >= 10.0 - 0.2 && aabb.max.x <= 25.0, "{aabb:?}");
    assert!(aabb.min.y >= 5.0 - 0.2 && aabb.max.y <= 20.0, "{aabb:?}");
    assert!(aabb.min.z == 0.0 && aabb.max.z < 4.0, "{aabb:?}");
    let pixels: usize = mesh.textures().iter().map(|t| t.image.len()).sum();
    assert!(pixels < 8_000_000, "{pixels} pixels of texture");
}

/// These numbers determine the bytes of `s3d demo`.
#[test]
fn it_is_what_it_always_was() {
    let parts = SEEN.scene.mesh.parts();
    let mut digest = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |x: u64| digest = (digest ^ x).wrapping_mul(0x0100_0000_01b3).rotate_left(29);

    parts
        .positions
        .iter()
        .flat_map(|p| p.to_array())
        .for_each(|x| add(u64::from(x.to_bits())));
    parts
        .uvs
        .iter()
        .flat_map(|p| p.to_array())
        .for_each(|x| add(u64::from(x.to_bits())));

    for indices in [&parts.faces, &parts.face_uvs] {
        indices.iter().flatten().for_each(|&i| add(u64::from(i)));
    }
    parts.face_materials.iter().for_each(|&m| add(u64::from(m)));

    for texture in &parts.textures {
        texture.name.bytes().for_each(|b| add(u64::from(b)));
        texture.image.pixels().iter().flatten().for_each(|&c| add(u64::from(c)));
    }
    for material in &parts.materials {
        material
            .name
            .bytes()
            .chain(material.color)
            .for_each(|b| add(u64::from(b)));
    }

    SEEN.scene.instance_of_face.iter().for_each(|&i| add(u64::from(i)));
    assert_eq!(digest, 0x0525_cc88_e880_5f73, "{digest:#x}");
}

#[test]
fn faces_have_textures_with_coordinates_in_range_or_a_colour() {
    let [textured, plain] = SEEN.check_colors();
    assert!(textured > SEEN.faces().len() / 2 && plain > 1000, "{textured} {plain}");
}

#[test]
fn things_stay_in_their_rooms() {
    SEEN.check_things_stay_in_their_rooms();
}

#[test]
fn locations_stand_free_each_in_one_room() {
    let rooms = SEEN.rooms();
    assert_eq!(rooms.len(), 4);
    let mut taken = BTreeSet::new();
    for l in &SEEN.scene.locations {
        let inside: Vec<_> = rooms
            .iter()
            .filter(|(_, room)| room.contains(l.position.as_vec3()))
            .collect();
        assert_eq!(inside.len(), 1, "{}", l.position);
        taken.insert(*inside[0].0);
        let clearance = SEEN.clearance(l.position);
        assert!(clearance >= 0.3, "{clearance} of {l:?}");
    }
    assert_eq!(taken.len(), 4, "a location in every room");
}

#[test]
fn rooms_are_closed_but_for_the_planned_hole_and_show_their_fronts() {
    let tile = dvec3(9.25, 3.3, 2.9) + Building::demo().origin.as_dvec3();
    let mut through = 0;
    for l in &SEEN.scene.locations {
        for d in directions(500) {
            let Some((face, _)) = SEEN.first_hit(l.position, d) else {
                let out = l.position + d * ((tile.z - l.position.z) / d.z) - tile;
                assert!(d.z > 0.0 && out.abs().max_element() < 0.3, "{d} from {}", l.position);
                continue;
            };
            let front = SEEN.scene.mesh.normal(face).as_dvec3().dot(d) < 0.0;
            assert!(front, "the back of {:?} from {}", SEEN.instance_of(face), l.position);
        }
        through += u32::from(SEEN.first_hit(l.position, (tile - l.position).normalize()).is_none());
    }
    assert_eq!(through, 2, "both locations in the conference room see the missing tile");
}

#[test]
fn doors_let_one_see_from_room_to_room() {
    let rooms = SEEN.rooms();
    let mut seen = BTreeSet::new();
    for l in &SEEN.scene.locations {
        let own = *rooms
            .iter()
            .find(|(_, room)| room.contains(l.position.as_vec3()))
            .unwrap()
            .0;
        // Nearly level rays, which pass through doors.
        for d in directions(1500).filter(|d| d.z.abs() < 0.15) {
            if let Some((face, _)) = SEEN.first_hit(l.position, d) {
                let other = SEEN.instance_of(face);
                if other.room != own && other.class != Class::DOOR {
                    seen.insert((own.to_string(), other.room.to_string()));
                }
            }
        }
    }
    for other in ["office_1", "conferenceRoom_1"] {
        assert!(seen.contains(&("hallway_1".to_owned(), other.to_owned())), "{seen:?}");
    }
    assert!(seen.iter().any(|(from, _)| *from != "hallway_1"), "{seen:?}");
}

#[test]
fn no_two_faces_lie_on_one_another() {
    SEEN.check_no_overlaps();
}
