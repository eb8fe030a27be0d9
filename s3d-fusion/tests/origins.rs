//! Where a scanner stood, by its points alone.

use s3d_fusion::{OriginError, find_origin};
use s3d_geom::glam::{DVec3, Vec3, dvec3};
use s3d_synth::device::{LaserScanner, ScanTarget};
use s3d_synth::{AnnotatedScene, Building, BuildingOptions};
use std::collections::BTreeSet;

/// The place of each scan location of a building, and the points of a scan there, in no order.
fn scans(building: Building) -> Vec<(DVec3, Vec<Vec3>)> {
    let scene: AnnotatedScene = Building { texture_scale: 0.1, ..building }.build().unwrap();
    let target = ScanTarget::new(&scene);
    let scanner = LaserScanner { columns: 720, rows: 300, ..LaserScanner::default() };
    let scan = |location| {
        let scan = target.laser_scan(location, &scanner, 0).unwrap();
        let [columns, rows] = scan.size();
        let all = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let mut points: Vec<Vec3> = all
            .filter_map(|(column, row)| scan.world_point(column, row))
            .map(|p| p.as_vec3())
            .collect();
        points.sort_by(|a, b| (a.x * 7919.0).fract().total_cmp(&(b.x * 7919.0).fract()));
        (scan.origin, points)
    };
    scene.locations.iter().map(scan).collect()
}

#[test]
fn each_scanner_is_found_by_its_points() {
    let house = Building::generate(&BuildingOptions { storeys: 2, ..BuildingOptions::drawn(4, 42) }).unwrap();
    for (origin, points) in scans(Building::demo()).into_iter().chain(scans(house)) {
        let found = find_origin(&points).unwrap();
        let off_m = (found.origin - origin).abs();
        assert!(off_m.cmplt(dvec3(0.01, 0.01, 0.05)).all(), "{off_m} m: {found:?}");
    }
}

#[test]
fn points_that_do_not_tell_it_are_refused() {
    let scans = scans(Building::demo());
    let refused = |points: &[Vec3]| {
        let error = find_origin(points).unwrap_err();
        assert!(matches!(error, OriginError::Uneven { .. }), "{error}");
        assert!(error.to_string().contains("of several scans"));
    };
    // Two scans together.
    let two: Vec<Vec3> = scans.iter().take(2).flat_map(|(_, points)| points.clone()).collect();
    refused(&two);
    // Thinned to a point a cube of 2 cm.
    let (_, points) = &scans[0];
    let mut taken = BTreeSet::new();
    let thinned: Vec<Vec3> = points
        .iter()
        .copied()
        .filter(|p| taken.insert((*p / 0.02).floor().as_ivec3().to_array()))
        .collect();
    refused(&thinned);
    // The half of a scan on one side of its scanner has its evenness, and its place.
    let half: Vec<Vec3> = points
        .iter()
        .copied()
        .filter(|p| f64::from(p.x) > scans[0].0.x)
        .collect();
    assert!(find_origin(&half).unwrap().origin.distance(scans[0].0) < 0.05);
    assert_eq!(find_origin(&points[..1000]), Err(OriginError::FewPoints { points: 1000 }));
}
