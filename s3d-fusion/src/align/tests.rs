use super::*;
use s3d_geom::glam::{DQuat, DVec3, Vec3, dvec3, vec3};
use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_synth::Building;

/// A number from −1 to 1 that depends on `n` alone.
fn chance(n: u64) -> f64 {
    let mut x = n.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D;
    x = (x ^ (x >> 31)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    (x >> 40) as f64 / f64::from(1u32 << 23) - 1.0
}

/// Nearly normal, with a standard deviation of 1.
fn normal(n: u64) -> f64 {
    (0..4).map(|i| chance(4 * n + i)).sum::<f64>() * 0.866
}

/// Points on a part of a mesh with 5 mm of noise, and the directions that they were seen from, after `pose`.
fn part(mesh: &TriMesh, pose: &DAffine3, seed: u64, keep: impl Fn(Vec3) -> bool) -> (Vec<Vec3>, Vec<Vec3>) {
    let mut cloud = PointCloud::default();
    let sampler = SurfaceSampler::new(mesh, Density::PerM2(600.0), seed);
    sampler.sample(0..sampler.len(), &mut cloud);
    let (mut positions, mut sides) = (Vec::new(), Vec::new());
    for (i, (p, &face)) in (0..).zip(cloud.positions.iter().zip(&cloud.faces)) {
        if keep(*p) {
            let n = mesh.normal(face).as_dvec3();
            let off = 0.005 * normal(seed * 10_000_000 + i);
            positions.push(pose.transform_point3(p.as_dvec3() + off * n).as_vec3());
            sides.push(pose.transform_vector3(n).as_vec3());
        }
    }
    (positions, sides)
}

fn surface(mesh: &TriMesh, pose: &DAffine3, seed: u64, keep: impl Fn(Vec3) -> bool) -> SurfacePoints {
    let (positions, sides) = part(mesh, pose, seed, keep);
    SurfacePoints::of_points(&positions, &sides).unwrap()
}

fn somewhere(yaw: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_z(yaw), dvec3(31.0, -18.0, 4.0))
}

fn built(building: Building) -> TriMesh {
    Building { texture_scale: 0.05, ..building }.build().unwrap().mesh
}

/// How far the middle of `a` is from where it should be, metres, and the angle, degrees.
fn error(a: &SurfacePoints, found: &Alignment, truth: &DAffine3) -> (f64, f64) {
    let off = found.b_from_a.transform_point3(a.middle) - truth.transform_point3(a.middle);
    let turn = DQuat::from_mat3(&(found.b_from_a.matrix3 / found.scale * truth.matrix3.transpose()));
    (off.length(), turn.to_scaled_axis().length().to_degrees())
}

fn assert_found(a: &SurfacePoints, b: &SurfacePoints, options: &AlignOptions, truth: &DAffine3) -> Aligned {
    let aligned = align(a, b, options).unwrap();
    assert_eq!(aligned.doubt(), None, "{aligned:?}");
    let (distance_m, angle_deg) = error(a, &aligned.places[0], truth);
    assert!(distance_m < 0.005 && angle_deg < 0.05, "{distance_m} m, {angle_deg}°: {aligned:?}");
    aligned
}

#[test]
fn parts_of_buildings_are_found() {
    let office = built(Building::demo());
    let middle = office.aabb().center();
    let pose = somewhere(2.3);
    let a = surface(&office, &pose, 1, |p| p.x < middle.x + 0.6 && p.x > middle.x - 6.0 && p.y < middle.y);
    let b = surface(&office, &DAffine3::IDENTITY, 2, |p| {
        p.x > middle.x - 1.2 && p.x < middle.x + 6.0 && p.y < middle.y
    });
    let aligned = assert_found(&a, &b, &AlignOptions::default(), &pose.inverse());
    let best = &aligned.places[0];
    assert!(best.overlap.iter().all(|share| (0.1..0.5).contains(share)), "{best:?}");
    assert!(best.median_m < 0.004 && best.rms_m < 0.01 && best.scale == 1.0, "{best:?}");

    let house = built(Building::two_storeys());
    let middle = house.aabb().center();
    let pose = somewhere(-0.7);
    let a = surface(&house, &pose, 3, |p| p.y < middle.y + 0.4);
    let b = surface(&house, &DAffine3::IDENTITY, 4, |p| p.y > middle.y - 1.2);
    assert_found(&a, &b, &AlignOptions::default(), &pose.inverse());
}

/// A box-like room fits both ways but for its furniture, and parts of it show some of that each.
#[test]
fn parts_of_a_room_are_never_turned_around() {
    for seed in [1, 3, 5, 9] {
        let room = s3d_synth::scenes::furnished_room(seed);
        let bounds = room.aabb();
        let at = |share: f32| bounds.min + (bounds.max - bounds.min) * share;
        let pose = somewhere(seed as f64);
        let a = surface(&room, &pose, 1, |p| p.x < at(0.8).x);
        let b = surface(&room, &DAffine3::IDENTITY, 2, |p| p.x > at(0.2).x);
        let aligned = align(&a, &b, &AlignOptions::default()).unwrap();
        let is_right = |place: &Alignment| {
            let (distance_m, angle_deg) = error(&a, place, &pose.inverse());
            distance_m < 0.005 && angle_deg < 0.05
        };
        assert!(aligned.doubt().is_some() || is_right(&aligned.places[0]), "{seed}: {aligned:?}");
    }
}

#[test]
fn clouds_without_sides_are_found() {
    let house = built(Building::two_storeys());
    let middle = house.aabb().center();
    let pose = somewhere(1.1);
    let cloud = |pose: &DAffine3, seed, keep: &dyn Fn(Vec3) -> bool| {
        SurfacePoints::of_points(&part(&house, pose, seed, keep).0, &[]).unwrap()
    };
    let a = cloud(&pose, 5, &|p| p.y < middle.y + 1.5 && p.z < 2.8);
    let b = cloud(&DAffine3::IDENTITY, 6, &|p| p.y > middle.y - 1.5 && p.z < 2.8);
    assert_found(&a, &b, &AlignOptions::default(), &pose.inverse());
}

#[test]
fn parts_of_different_buildings_are_refused() {
    let office = built(Building::demo());
    let house = built(Building::two_storeys());
    let middle = office.aabb().center();
    let a =
        surface(&office, &somewhere(0.4), 1, |p| p.x < middle.x && p.x > middle.x - 6.0 && p.y < middle.y);
    let b = surface(&house, &DAffine3::IDENTITY, 2, |p| p.z < 2.8);
    let found = align(&a, &b, &AlignOptions::default());
    assert!(found.as_ref().map_or(true, |aligned| aligned.doubt().is_some()), "{found:?}");
}

#[test]
fn tilted_and_grown_surfaces_are_found() {
    let room = s3d_synth::scenes::furnished_room(3);
    let tilt = DQuat::from_euler(s3d_geom::glam::EulerRot::XYZ, 0.8, -1.1, 0.5);
    let pose = DAffine3::from_rotation_translation(tilt, dvec3(5.0, 6.0, -7.0));
    let a = surface(&room, &pose, 1, |p| p.x < 3.4);
    let b = surface(&room, &DAffine3::IDENTITY, 2, |_| true);
    let options = AlignOptions { is_level: false, with_scale: false };
    assert_found(&a, &b, &options, &pose.inverse());

    // A tenth of its size.
    let small = DAffine3::from_scale(DVec3::splat(0.1)) * somewhere(0.3);
    let whole = part(&room, &somewhere(0.3), 3, |p| p.x < 3.4);
    let positions: Vec<Vec3> = whole.0.iter().map(|p| *p * 0.1).collect();
    let a = SurfacePoints::of_points(&positions, &whole.1).unwrap();
    let options = AlignOptions { is_level: true, with_scale: true };
    let aligned = align(&a, &b, &options).unwrap();
    let best = &aligned.places[0];
    assert!((best.scale - 10.0).abs() < 0.02, "{aligned:?}");
    let off = best.b_from_a.transform_point3(a.middle) - small.inverse().transform_point3(a.middle);
    assert!(aligned.doubt().is_none() && off.length() < 0.01, "{off} {aligned:?}");
}

/// The inside of a box, without its ends if it is a corridor.
fn inside(size: Vec3, has_ends: bool) -> TriMesh {
    let corner = |i: usize| vec3((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * size;
    let mut faces = vec![[0, 1, 3], [0, 3, 2], [4, 7, 5], [4, 6, 7]];
    faces.extend([[0, 5, 1], [0, 4, 5], [2, 3, 7], [2, 7, 6]]);
    if has_ends {
        faces.extend([[0, 2, 6], [0, 6, 4], [1, 7, 3], [1, 5, 7]]);
    }
    let mesh = TriMesh::from_faces((0..8).map(corner).collect(), faces).unwrap();
    assert!(mesh.normal(0).z > 0.9 && mesh.normal(2).z < -0.9);
    mesh
}

#[test]
fn what_fits_twice_is_told() {
    let corridor = inside(vec3(8.0, 2.0, 2.5), false);
    let [a, b] = [
        surface(&corridor, &somewhere(0.2), 1, |_| true),
        surface(&corridor, &DAffine3::IDENTITY, 2, |_| true),
    ];
    let aligned = align(&a, &b, &AlignOptions::default()).unwrap();
    assert_eq!(aligned.doubt(), Some(Doubt::Open), "{aligned:?}");
    let (_, motion) = &aligned.places[0].open[0].motions[0];
    assert!(motion.translation.x.abs() > 0.9 && motion.translation.y.abs() < 0.1, "{motion:?}");

    let room = inside(vec3(5.0, 3.0, 2.5), true);
    let [a, b] =
        [surface(&room, &somewhere(0.2), 1, |_| true), surface(&room, &DAffine3::IDENTITY, 2, |_| true)];
    let aligned = align(&a, &b, &AlignOptions::default()).unwrap();
    assert!(matches!(aligned.doubt(), Some(Doubt::Rival { share }) if share > 0.9), "{aligned:?}");
    let turns = [0, 1].map(|i| DQuat::from_mat3(&aligned.places[i].b_from_a.matrix3));
    assert!((turns[0].angle_between(turns[1]) - std::f64::consts::PI).abs() < 0.01);
}

#[test]
fn threads_change_nothing_and_a_surface_fits_itself() {
    let room = s3d_synth::scenes::furnished_room(9);
    let found = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let surface = SurfacePoints::of_mesh(&room).unwrap();
            align(&surface, &surface, &AlignOptions::default()).unwrap()
        })
    };
    let aligned = found(1);
    assert_eq!(aligned, found(3));
    assert_eq!(aligned.doubt(), None);
    assert!(aligned.places[0].b_from_a.abs_diff_eq(DAffine3::IDENTITY, 1e-9), "{aligned:?}");
}

#[test]
fn bad_input_is_named() {
    assert_eq!(SurfacePoints::of_points(&[], &[]), Err(AlignError::Thin { points: 0, surface: 0 }));
    let line: Vec<Vec3> = (0..5000).map(|i| vec3(i as f32 * 0.01, 0.0, 0.0)).collect();
    assert_eq!(SurfacePoints::of_points(&line, &[]), Err(AlignError::Thin { points: 5000, surface: 0 }));
    let broken = [Vec3::NAN; 1000];
    assert!(SurfacePoints::of_points(&broken, &[]).is_err());

    let room = inside(vec3(5.0, 3.0, 2.5), true);
    let a = surface(&room, &DAffine3::IDENTITY, 1, |_| true);
    let large = room.positions().iter().map(|p| *p * 1000.0).collect();
    let large = TriMesh::from_faces(large, room.faces().to_vec()).unwrap();
    let b = SurfacePoints::of_mesh(&large).unwrap();
    let error = align(&a, &b, &AlignOptions::default()).unwrap_err();
    assert!(error.to_string().contains("times as large"), "{error}");

    let wall = inside(vec3(5.0, 3.0, 2.5), true).into_parts();
    let wall = TriMesh::from_faces(wall.positions, vec![[0, 5, 1], [0, 4, 5]]).unwrap();
    let wall = SurfacePoints::of_mesh(&wall).unwrap();
    let scale = AlignOptions { with_scale: true, ..AlignOptions::default() };
    assert_eq!(align(&wall, &a, &scale), Err(AlignError::NoHeights));
    let found = align(&wall, &a, &AlignOptions::default());
    assert!(found.map_or(true, |aligned| aligned.doubt().is_some()), "a wall fits many places");
}
