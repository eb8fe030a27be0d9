//! What cannot be fused is refused in words.

use crate::common::lens;
use s3d_fusion::{Fusion, FusionError, FusionOptions, RangeImage, RangeKind, SensorNoise, Surface, Tile};
use s3d_geom::glam::{DVec3, Vec3};
use s3d_geom::{Pose, Raster};

fn pose() -> Pose {
    Pose::level(DVec3::ZERO, 0.0)
}

fn image(depth: Raster<f32>) -> Result<RangeImage, FusionError> {
    RangeImage::from_depth(pose(), lens(8, 6, 5.0), RangeKind::Depth, depth, SensorNoise::LASER)
}

#[test]
fn pictures() {
    let other = image(Raster::filled(6, 8, 1.0)).unwrap_err();
    assert!(other.to_string().contains("[8, 6]") && other.to_string().contains("[6, 8]"), "{other}");
    assert_eq!(image(Raster::filled(8, 6, f32::NAN)).unwrap_err(), FusionError::NothingMeasured);
    assert_eq!(image(Raster::filled(8, 6, 0.0)).unwrap_err(), FusionError::NothingMeasured);
    let millimetres = image(Raster::filled(8, 6, 2000.0)).unwrap_err();
    assert!(millimetres.to_string().contains("millimetres"), "{millimetres}");
    let mut depth = Raster::filled(8, 6, 2.0);
    depth.pixels_mut()[11] = -1.0;
    let negative = image(depth).unwrap_err();
    assert_eq!(negative, FusionError::NegativeRange { range_m: -1.0, column: 3, row: 1 });

    let good = image(Raster::filled(8, 6, 2.0)).unwrap();
    assert!(matches!(good.clone().with_colors(Raster::filled(8, 5, [1; 3])), Err(FusionError::Size { .. })));
    let silent = SensorNoise { constant_m: 0.0, per_m: 0.0, per_m2: 0.0 };
    let depth = Raster::filled(8, 6, 2.0);
    let refused = RangeImage::from_depth(pose(), lens(8, 6, 5.0), RangeKind::Depth, depth, silent);
    assert!(matches!(refused, Err(FusionError::Noise { .. })));

    // Far from the origin, cells of a centimetre cannot be counted.
    let far = Pose::level(DVec3::X * 1e6, 0.0);
    let depth = Raster::filled(8, 6, 2.0);
    let far =
        RangeImage::from_depth(far, lens(8, 6, 5.0), RangeKind::Depth, depth, SensorNoise::LASER).unwrap();
    let mut fusion = Fusion::new(FusionOptions::default()).unwrap();
    assert!(matches!(fusion.add(&far), Err(FusionError::TooFar { .. })));
    assert_eq!(fusion.mesh().unwrap_err(), FusionError::NoSurface);
}

#[test]
fn scans_and_rays() {
    let points = [Vec3::ONE; 7];
    let refused = RangeImage::from_scan(pose(), [4, 2], &points, &[], SensorNoise::LASER);
    assert!(matches!(refused, Err(FusionError::Size { .. })));
    let refused = RangeImage::from_points(pose(), &points, &[[0; 3]; 2], SensorNoise::LASER);
    assert_eq!(refused.unwrap_err(), FusionError::Count { what: "colours", found: 2, points: 7 });
    let refused = RangeImage::from_points(pose(), &[Vec3::NAN; 7], &[], SensorNoise::LASER);
    assert_eq!(refused.unwrap_err(), FusionError::NothingMeasured);
    let nowhere = Pose::level(DVec3::NAN, 0.0);
    let refused = RangeImage::from_points(nowhere, &points, &[], SensorNoise::LASER);
    assert!(matches!(refused, Err(FusionError::Pose(_))));
    // A point at the scanner's place, and a single point, are no scan but no panic either.
    assert!(RangeImage::from_points(pose(), &[Vec3::ZERO, Vec3::ONE], &[], SensorNoise::LASER).is_ok());

    let mut fusion = Fusion::new(FusionOptions::default()).unwrap();
    let refused = fusion.add_rays(&[Vec3::ZERO; 3], &points, &[], SensorNoise::LASER);
    assert_eq!(refused, Err(FusionError::Count { what: "origins", found: 3, points: 7 }));
    // Rays without a length or a number are left out.
    let origins = [Vec3::ZERO, Vec3::ONE, Vec3::NAN];
    fusion
        .add_rays(&origins, &[Vec3::NAN, Vec3::ONE, Vec3::ONE], &[], SensorNoise::LASER)
        .unwrap();
    assert_eq!(fusion.blocks(), 0);
}

#[test]
fn options_and_tiles() {
    for cell_m in [0.0, -1.0, f64::NAN, 2.0] {
        let refused = Fusion::new(FusionOptions { cell_m, ..FusionOptions::default() });
        assert!(matches!(refused, Err(FusionError::Option { .. })), "{cell_m}");
    }
    let tile = Tile { from: [0, 0, 0], to: [4, 0, 4] };
    assert!(matches!(Fusion::within(FusionOptions::default(), tile), Err(FusionError::Tile { .. })));
    let [a, b] = [0.01, 0.02].map(|cell_m| {
        Fusion::new(FusionOptions { cell_m, ..FusionOptions::default() })
            .unwrap()
            .surface()
    });
    assert_eq!(Surface::join(vec![a, b]), Err(FusionError::OtherCells { a_m: 0.01, b_m: 0.02 }));
    assert_eq!(Surface::join(vec![]), Err(FusionError::NoSurface));
}
