use super::*;
use crate::error::Error;
use glam::Vec3;
use s3d_geom::{MeshParts, TriMesh};
use s3d_label::Room;
use s3d_render::cast_ray;
use s3d_synth::Building;
use std::collections::BTreeSet;

fn walked(mesh: &TriMesh, options: WalkOptions) -> Result<Vec<Pose>> {
    walk(&Scene::new(mesh), &options, &Context::default())
}

fn mesh_of(building: &Building) -> TriMesh {
    Building { texture_scale: 0.02, ..building.clone() }
        .build()
        .unwrap()
        .mesh
}

/// A closed room.
fn room(size: [f32; 3]) -> MeshParts {
    let mut parts = MeshParts::default();
    for side in [[0, 1, 3, 2], [6, 7, 5, 4], [4, 5, 1, 0], [5, 7, 3, 1], [7, 6, 2, 3], [6, 4, 0, 2]] {
        let first = parts.positions.len() as u32;
        let corner = |i: usize| Vec3::from([0, 1, 2].map(|axis| [0.0, size[axis]][i >> axis & 1]));
        parts.positions.extend(side.map(corner));
        parts
            .faces
            .extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    parts
}

fn mesh(parts: MeshParts) -> TriMesh {
    TriMesh::new(parts).unwrap()
}

/// Checks a walk: steady, smooth, and never near or behind a surface. Returns the rooms that it enters.
fn check(building: &Building, options: WalkOptions) -> (Vec<Pose>, BTreeSet<Room>) {
    let mesh = mesh_of(building);
    let scene = Scene::new(&mesh);
    let nearest = NearestFaces::new(&mesh);
    let poses = walk(&scene, &options, &Context::default()).unwrap();
    assert_eq!(poses.len(), options.frames);

    let step_m = options.speed_m_s / options.rate;
    let mut straight = 0;
    for pair in poses.windows(2) {
        let way = pair[1].location - pair[0].location;
        assert!(way.length() <= step_m + 1e-9, "{pair:?}");
        straight += usize::from(way.length() > 0.98 * step_m);
        let turn = pair[0].forward().angle_between(pair[1].forward()).to_degrees();
        assert!(turn * options.rate < 250.0, "{turn}° at {}", pair[0].location);
        assert!(cast_ray(&scene, pair[0].location, way).is_none_or(|hit| hit.t > 1.0));
    }
    // Poses are nearer to each other in bends alone.
    assert!(straight as f64 > 0.9 * poses.len() as f64, "{straight} of {}", poses.len());

    let mut rooms = BTreeSet::new();
    for pose in &poses {
        let at = pose.location;
        let clearance_m = nearest.nearest(at.as_vec3()).distance_m;
        assert!(clearance_m > 0.19, "{at}: {clearance_m} m");
        assert!(pose.up().angle_between(DVec3::Z) < 1e-9);
        // A foot of somebody at the edge of a stairwell may be over it.
        let is_above_floor = [[0.0, 0.0], [0.1, 0.0], [-0.1, 0.0], [0.0, 0.1], [0.0, -0.1]].map(|[x, y]| {
            let below = cast_ray(&scene, at + DVec3::new(x, y, 0.0), -DVec3::Z).unwrap();
            (below.t - options.height_m).abs() < 0.3
        });
        assert!(is_above_floor.contains(&true), "{at}");
        let of = building
            .rooms
            .iter()
            .filter(|room| room.contains(at - building.origin.as_dvec3()));
        rooms.extend(of.map(|room| room.room));
    }
    (poses, rooms)
}

#[test]
fn a_walk_goes_through_every_door() {
    let building = Building::demo();
    let (_, rooms) = check(&building, WalkOptions { frames: 2400, ..WalkOptions::default() });
    assert_eq!(rooms.len(), building.rooms.len(), "{rooms:?}");
}

#[test]
fn a_walk_climbs_stairs() {
    let building = Building::two_storeys();
    for height_m in [1.5, 1.1] {
        let options = WalkOptions { frames: 2000, rate: 10.0, height_m, seed: 4, ..WalkOptions::default() };
        let (poses, rooms) = check(&building, options);
        assert_eq!(rooms.len(), building.rooms.len(), "{height_m} m: {rooms:?}");
        let heights: Vec<f64> = poses
            .iter()
            .map(|pose| pose.location.z - building.origin.z as f64)
            .collect();
        let low = heights.iter().copied().fold(f64::MAX, f64::min);
        let high = heights.iter().copied().fold(f64::MIN, f64::max);
        assert!(low < height_m + 0.1 && high > height_m + 2.8, "{low} {high}");
    }
}

#[test]
fn it_looks_where_it_goes() {
    let poses = walked(&mesh(room([30.0, 2.0, 2.5])), WalkOptions::default()).unwrap();
    let ahead = poses
        .windows(2)
        .filter(|pair| {
            let way = pair[1].location - pair[0].location;
            way.angle_between(pair[0].forward()) < 0.1
        })
        .count();
    // It turns at the end of the corridor.
    assert!(ahead as f64 > 0.85 * poses.len() as f64, "{ahead}");
}

#[test]
fn the_same_seed_walks_the_same_way_for_any_number_of_threads() {
    let mesh = mesh_of(&Building::demo());
    let with = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = WalkOptions { frames: 300, seed, ..WalkOptions::default() };
        pool.install(|| walked(&mesh, options)).unwrap()
    };
    assert_eq!(with(1, 0), with(3, 0));
    assert_ne!(with(1, 0), with(1, 1));
}

#[test]
fn a_higher_camera_stays_where_it_has_room() {
    // A beam across the ceiling is no wall to a person of 1.5 m.
    let mut parts = room([12.0, 4.0, 3.2]);
    let first = parts.positions.len() as u32;
    parts
        .positions
        .extend([[5.0, 0., 3.2], [5.0, 4., 3.2], [5.0, 4., 2.1], [5.0, 0., 2.1]].map(Vec3::from));
    parts
        .faces
        .extend([[0, 1, 2], [0, 2, 3]].map(|face| face.map(|corner| first + corner)));
    let mesh = mesh(parts);
    let span = |height_m| {
        let options = WalkOptions { frames: 1500, height_m, ..WalkOptions::default() };
        let poses = walked(&mesh, options).unwrap();
        let xs = || poses.iter().map(|pose| pose.location.x);
        [xs().fold(f64::MAX, f64::min), xs().fold(f64::MIN, f64::max)]
    };
    let [low, high] = span(1.5);
    assert!(low < 4.0 && high > 6.0, "{low} {high}");
    let [low, high] = span(2.2);
    assert!(low > 5.0 && high > 9.0, "{low} {high}");
}

#[test]
fn where_nobody_can_walk_it_says_so() {
    let closet = mesh(room([0.9, 0.9, 2.5]));
    let error = walked(&closet, WalkOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no way of a metre"), "{error}");
    let low = mesh(room([5.0, 4.0, 1.2]));
    let error = walked(&low, WalkOptions::default()).unwrap_err().to_string();
    assert!(error.contains("no place") && error.contains("units"), "{error}");
    let error = walked(&mesh(room([5.0, 4.0, 2.5])), WalkOptions { height_m: 2.45, ..Default::default() });
    assert!(error.unwrap_err().to_string().contains("2.45 m above the floor"));
}

#[test]
fn numbers_out_of_range_are_refused() {
    let mesh = mesh(room([5.0, 4.0, 2.5]));
    let usual = WalkOptions::default();
    for (options, option) in [
        (WalkOptions { frames: 0, ..usual }, "trajectory"),
        (WalkOptions { frames: 2_000_000, ..usual }, "trajectory"),
        (WalkOptions { rate: 0.0, ..usual }, "rate"),
        (WalkOptions { rate: f64::NAN, ..usual }, "rate"),
        (WalkOptions { speed_m_s: f64::INFINITY, ..usual }, "speed"),
        (WalkOptions { speed_m_s: 1e9, ..usual }, "speed"),
        (WalkOptions { height_m: 0.0, ..usual }, "eye_height"),
    ] {
        let refused = walked(&mesh, options);
        assert!(matches!(&refused, Err(Error::Usage(e)) if e.to_string().contains(option)), "{refused:?}");
    }
}

#[test]
fn it_can_be_cancelled() {
    let mesh = mesh(room([5.0, 4.0, 2.5]));
    let context = Context::default();
    context.cancel.cancel();
    let walked = walk(&Scene::new(&mesh), &WalkOptions::default(), &context);
    assert!(matches!(walked, Err(Error::Cancelled)));
}
