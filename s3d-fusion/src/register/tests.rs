use super::points::{Grid, Reach};
use super::*;
use s3d_geom::glam::{DQuat, DVec3, Vec3, Vec3Swizzles, dvec3, vec3};
use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_synth::scenes::{furnished_room, scan_like_rooms};

/// A number from −1 to 1 that depends on `n` alone.
fn noise(n: u64) -> f64 {
    let mut x = n.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D;
    x = (x ^ (x >> 31)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    (x >> 40) as f64 / f64::from(1u32 << 23) - 1.0
}

fn vector(n: u64) -> DVec3 {
    dvec3(noise(3 * n), noise(3 * n + 1), noise(3 * n + 2))
}

/// Nearly normal, with a standard deviation of 1.
fn normal(n: u64) -> f64 {
    (0..4).map(|i| noise(4 * n + i)).sum::<f64>() * 0.866
}

const CELL_M: f64 = 0.1;

fn options() -> RegisterOptions {
    RegisterOptions { cell_m: CELL_M, ..RegisterOptions::default() }
}

/// What a scanner at `place` measures with 3 mm of noise along its rays, and normals that are off by some
/// degrees. The scan's own frame is turned, and its origin is the scanner.
fn scan(mesh: &TriMesh, place: DVec3, seed: u64, sees: impl Fn(Vec3) -> bool) -> (ScanPoints, DAffine3) {
    let pose = DAffine3::from_rotation_translation(DQuat::from_rotation_z(seed as f64), place);
    let mut cloud = PointCloud::default();
    let sampler = SurfaceSampler::new(mesh, Density::PerM2(500.0), seed);
    sampler.sample(0..sampler.len(), &mut cloud);

    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for (i, (p, &face)) in cloud.positions.iter().zip(&cloud.faces).enumerate() {
        let n = mesh.normal(face).as_dvec3();
        let ray = p.as_dvec3() - place;
        if n.dot(ray) < 0.0 && ray.length() < 8.0 && sees(*p) {
            let number = seed * 1_000_000 + i as u64;
            let seen = p.as_dvec3() + 0.003 * normal(number) * ray.normalize();
            positions.push(pose.inverse().transform_point3(seen).as_vec3());
            let n = (n + 0.05 * vector(number)).normalize();
            normals.push(pose.inverse().transform_vector3(n).as_vec3());
        }
    }
    (ScanPoints::sampled(&positions, &normals, CELL_M), pose)
}

/// A pose off by up to 5 cm and 1°.
fn shaken(pose: &DAffine3, seed: u64) -> DAffine3 {
    let turn = DQuat::from_axis_angle(vector(seed).normalize(), noise(seed + 9) * 1f64.to_radians());
    let shift = (0.035 + 0.015 * noise(seed + 77)) * vector(seed + 5).normalize();
    DAffine3::from_rotation_translation(turn, shift + pose.translation) * DAffine3::from_mat3(pose.matrix3)
}

/// The distance and the angle between two poses.
fn error(a: &DAffine3, b: &DAffine3) -> (f64, f64) {
    let turn = DQuat::from_mat3(&(a.matrix3.transpose() * b.matrix3));
    (a.translation.distance(b.translation), turn.to_scaled_axis().length())
}

#[test]
fn shaken_poses_of_a_room_are_found_again() {
    let room = furnished_room(7);
    let places = [dvec3(2.2, 2.0, 1.5), dvec3(1.2, 2.2, 1.4), dvec3(3.4, 2.0, 1.6), dvec3(2.4, 2.8, 1.5)];
    let scanned: Vec<_> = (0..)
        .zip(places)
        .map(|(i, place)| scan(&room, place, i + 1, |_| true))
        .collect();
    let (scans, truth): (Vec<_>, Vec<_>) = scanned.into_iter().unzip();
    let poses: Vec<DAffine3> = (0..4)
        .map(|i| {
            if i == 0 {
                truth[0]
            } else {
                shaken(&truth[i], 40 + i as u64)
            }
        })
        .collect();
    assert!(poses.iter().zip(&truth).skip(1).all(|(p, t)| error(p, t).0 > 0.01));

    let refined = refine_poses(&scans, &poses, &options()).unwrap();
    assert!(refined.is_converged && refined.open.is_empty(), "{refined:?}");
    for (pose, truth) in refined.poses.iter().zip(&truth) {
        let (distance_m, angle_rad) = error(pose, truth);
        assert!(distance_m <= 0.002 && angle_rad <= 0.02f64.to_radians(), "{distance_m} {angle_rad}");
    }
    assert_eq!((refined.group, refined.pairs.len()), (vec![0; 4], 6));
    assert_eq!(refined.motions[0], Motion::default());
    assert!(
        refined
            .pairs
            .iter()
            .all(|p| p.after.median_m < 0.003 && p.before.median_m > p.after.median_m)
    );
}

#[test]
fn a_pair_that_is_off_is_told_with_its_motion() {
    let room = furnished_room(3);
    let (scans, mut poses): (Vec<_>, Vec<_>) = [dvec3(2.2, 2.0, 1.5), dvec3(2.6, 2.4, 1.4)]
        .into_iter()
        .zip(1..)
        .map(|(p, i)| scan(&room, p, i, |_| true))
        .unzip();
    let fits = pair_residuals(&scans, &poses, &options()).unwrap();
    assert!(fits[0].before.median_m < 0.003 && fits[0].motion.translation.length() < 0.001, "{fits:?}");

    let off = dvec3(0.03, -0.02, 0.01);
    poses[1].translation += off;
    let told = pair_residuals(&scans, &poses, &options()).unwrap();
    assert_eq!((told.len(), told[0].scans), (1, [0, 1]));
    assert!(told[0].before.median_m > 0.008 && told[0].before.p90_m >= 0.02, "{told:?}");
    assert!(told[0].after.median_m < 0.003 && told[0].motion.translation.distance(-off) < 0.001, "{told:?}");
    assert!(told[0].before.correspondences > 1000);
}

/// Floor, ceiling and two walls along X, without ends.
fn corridor(seed: u64) -> ScanPoints {
    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    for i in 0..20_000 {
        let number = seed * 100_000 + i;
        let [x, s] = [noise(7 * number + 1) as f32 * 3.0, noise(7 * number + 2) as f32];
        let (p, n) = match i % 4 {
            0 => (vec3(x, s, 0.0), Vec3::Z),
            1 => (vec3(x, s, 2.5), -Vec3::Z),
            2 => (vec3(x, -1.0, 1.25 * (s + 1.0)), Vec3::Y),
            _ => (vec3(x, 1.0, 1.25 * (s + 1.0)), -Vec3::Y),
        };
        positions.push(p + n * (0.003 * normal(number)) as f32);
        normals.push((n + 0.05 * vector(number).as_vec3()).normalize());
    }
    ScanPoints::sampled(&positions, &normals, CELL_M)
}

#[test]
fn the_slide_along_a_bare_corridor_is_left_alone() {
    // Two scans that slide together, and relative to each other.
    let scans = [corridor(1), corridor(2), corridor(3)];
    let off = [DVec3::ZERO, dvec3(0.04, 0.02, -0.015), dvec3(-0.03, -0.02, 0.01)];
    let poses = off.map(DAffine3::from_translation);
    let refined = refine_poses(&scans, &poses, &options()).unwrap();
    for (pose, off) in refined.poses.iter().zip(&off) {
        let moved = pose.translation - *off;
        assert!(moved.x.abs() < 0.0005, "{moved}");
        assert!(pose.translation.y.abs() < 0.001 && pose.translation.z.abs() < 0.001, "{pose:?}");
    }
    assert_eq!(refined.open.len(), 2, "{:?}", refined.open);
    for open in &refined.open {
        assert!(open.share < 0.01);
        assert!(open.motions.iter().any(|(_, m)| m.translation.x.abs() > 0.9));
        assert!(
            open.motions
                .iter()
                .all(|(scan, m)| *scan > 0 && m.translation.yz().length() < 0.1)
        );
    }

    // With a wall at the end, nothing is open.
    let with_end = scans.map(|mut scan| {
        for i in 0..500u64 {
            scan.positions
                .push(vec3(3.1, noise(i) as f32, 1.25 + 1.2 * noise(i + 999) as f32));
            scan.normals.push(-Vec3::X);
        }
        scan
    });
    let refined = refine_poses(&with_end, &poses, &options()).unwrap();
    assert!(refined.open.is_empty());
    assert!(refined.poses.iter().all(|pose| pose.translation.length() < 0.002), "{refined:?}");
}

#[test]
fn rooms_without_an_overlap_stay() {
    let rooms = scan_like_rooms(2, 20_000, 5);
    let middle = rooms.aabb().center().y;
    let (first, a) = scan(&rooms, dvec3(3.0, 2.5, 1.5), 1, |p| p.y < middle - 0.5);
    let (second, b) = scan(&rooms, dvec3(3.0, f64::from(middle) + 2.5, 1.5), 2, |p| p.y > middle + 0.5);
    let poses = [a, shaken(&b, 4)];
    let refined = refine_poses(&[first, second], &poses, &options()).unwrap();
    assert_eq!((refined.poses, refined.group), (poses.to_vec(), vec![0, 1]));
    assert!(refined.pairs.is_empty() && refined.is_converged);
}

#[test]
fn the_grid_finds_what_measuring_all_points_finds() {
    let points = corridor(4);
    let reach = Reach { along_m: 0.2, across_m: 0.15, cosine: 0.9, is_two_sided: false };
    let grid = Grid::new(&points, 0.25);
    for i in 0..300 {
        let p = dvec3(3.2 * noise(i), 1.2 * noise(i + 1000), 1.25 + 1.5 * noise(i + 2000));
        let n = [DVec3::Z, -DVec3::Z, DVec3::Y, -DVec3::Y][i as usize % 4];
        let mut best = (f64::INFINITY, None);
        for (j, (q, m)) in (0..).zip(points.positions.iter().zip(&points.normals)) {
            let (between, m) = (p - q.as_dvec3(), m.as_dvec3());
            let along = m.dot(between);
            let across = (between.length_squared() - along * along).max(0.0).sqrt();
            let fits = along.abs() <= reach.along_m && across <= reach.across_m && m.dot(n) >= reach.cosine;
            if fits && between.length_squared() < best.0 {
                best = (between.length_squared(), Some(j));
            }
        }
        assert_eq!(grid.nearest(p, n, &reach), best.1, "{p}");
    }
}

#[test]
fn bad_input_is_named() {
    let points = ScanPoints { positions: vec![Vec3::ZERO], normals: vec![Vec3::Z] };
    let scans = [points.clone(), points.clone()];
    let fails = |scans: &[ScanPoints], poses: &[DAffine3]| {
        refine_poses(scans, poses, &options()).unwrap_err().to_string()
    };
    let one = DAffine3::IDENTITY;
    assert!(fails(&scans, &[one]).contains("1 poses for 2 scans"));
    assert!(
        fails(&scans, &[one, DAffine3::from_scale(DVec3::splat(1000.0))]).contains("scan 1 is not rigid")
    );
    assert!(fails(&scans, &[one, DAffine3::from_translation(DVec3::NAN)]).contains("scan 1 is not rigid"));
    let bare = ScanPoints { normals: Vec::new(), ..points };
    assert!(fails(&[bare], &[one]).contains("1 points and 0 normals"));
    let wrong = RegisterOptions { cell_m: 0.0, ..options() };
    assert!(pair_residuals(&scans, &[one; 2], &wrong).is_err());
    assert!(refine_poses(&[], &[], &options()).unwrap().is_converged);

    let thin = ScanPoints::sampled(&[Vec3::NAN, Vec3::ZERO], &[Vec3::Z; 2], 0.05);
    assert_eq!(thin.positions, [Vec3::ZERO]);
}
