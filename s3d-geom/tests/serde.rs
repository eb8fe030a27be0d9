//! The vocabulary as JSON: values are read back to the bit, and invalid values are refused.

use proptest::prelude::*;
use s3d_geom::glam::{DMat3, DVec2, DVec3, Vec3, dvec2, vec3};
use s3d_geom::{
    Aabb, Camera, Density, Footprint, FootprintOptions, Lens, MeshReport, Nearest, NormalAxes, PointCloud,
    Polygon, Pose, Voxels,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

/// Equal texts mean equal bits.
fn comes_back<T: Serialize + DeserializeOwned + Debug>(value: &T) -> Result<(), TestCaseError> {
    let json = serde_json::to_string(value).unwrap();
    let back: T = serde_json::from_str(&json).map_err(|e| TestCaseError::fail(format!("{e}: {json}")))?;
    prop_assert_eq!(format!("{:?}", back), format!("{:?}", value));
    prop_assert_eq!(serde_json::to_string(&back).unwrap(), json);
    Ok(())
}

fn any_f64() -> impl Strategy<Value = f64> {
    any::<f64>().prop_filter("JSON has no other", |v| v.is_finite())
}

fn any_vec3() -> impl Strategy<Value = Vec3> {
    any::<[f32; 3]>()
        .prop_map(Vec3::from_array)
        .prop_filter("JSON has no other", |v| v.is_finite())
}

fn any_ring() -> impl Strategy<Value = Vec<DVec2>> {
    prop::collection::vec((any_f64(), any_f64()).prop_map(|(x, y)| dvec2(x, y)), 0..6)
}

fn pose_at(location: DVec3) -> Pose {
    Pose { location, ..Pose::level(DVec3::ZERO, 0.3) }
}

proptest! {
    #[test]
    fn boxes_and_points(points in prop::collection::vec(any_vec3(), 0..9), distance_m in any::<u16>()) {
        comes_back(&Aabb::from_points(points.iter().copied()))?;
        comes_back(&Voxels::from_points(&points))?;
        let colors = vec![[1, 2, 3]; points.len()];
        let faces = (0..points.len() as u32).collect();
        comes_back(&PointCloud { positions: points.clone(), colors, faces })?;
        let point = points.first().copied().unwrap_or_default();
        comes_back(&Nearest { face: 3, distance_m: f32::from(distance_m) * 0.1, point })?;
        comes_back(&PointCloud { positions: points, ..PointCloud::default() })?;
    }

    #[test]
    fn poses_and_cameras(
        numbers in prop::array::uniform12(any_f64()),
        fov_rad in 0.01..3.1f64,
        size in (1..9000u32, 1..9000u32),
    ) {
        let [x, y, z, columns @ ..] = numbers;
        let world_from_camera = DMat3::from_cols_array(&columns);
        let pose = Pose { location: DVec3::new(x, y, z), world_from_camera };
        comes_back(&pose)?;
        comes_back(&Camera::perspective(pose, fov_rad, size.0, size.1))?;
        comes_back(&Camera::equirectangular(pose, 2 * size.0))?;
        let middle = dvec2(f64::from(size.0), f64::from(size.1)) * 0.5;
        let focal = middle * dvec2(0.3, fov_rad);
        let center = dvec2(fov_rad, -7.5);
        comes_back(&Camera::pinhole(pose_at(pose.location), focal, center, size.0, size.1).unwrap())?;
        let lens = Lens::new(size.into(), middle * 1.7, middle, [0.11, -0.23, 0.0012, fov_rad * 1e-4, 0.05]);
        prop_assert!(lens.is_some());
        comes_back(&lens)?;
    }

    #[test]
    fn outlines(outer in any_ring(), holes in prop::collection::vec(any_ring(), 0..3), area_m2 in any_f64()) {
        let polygon = Polygon { outer, holes };
        comes_back(&polygon)?;
        comes_back(&Footprint { polygons: vec![polygon.clone(), polygon], area_m2 })?;
        comes_back(&FootprintOptions { cell_m: area_m2, alpha_m: 0.1 })?;
        comes_back(&(Density::PerM2(area_m2), Density::Total(7), MeshReport::default()))?;
    }
}

fn refusal<T: DeserializeOwned + Debug>(json: &str) -> String {
    serde_json::from_str::<T>(json).expect_err(json).to_string()
}

#[test]
fn texts_are_plain() {
    let bbox = Aabb::from_points([vec3(1.0, 2.0, 3.0), vec3(0.1, 2.5, 3.0)]);
    let json = r#"{"min":[0.1,2.0,3.0],"max":[1.0,2.5,3.0]}"#;
    assert_eq!(serde_json::to_string(&bbox).unwrap(), json);
    assert_eq!(serde_json::to_string(&Aabb::EMPTY).unwrap(), "null");
    assert_eq!(serde_json::to_string(&NormalAxes::OpenCv).unwrap(), r#""opencv""#);
    let camera = Camera::perspective(Pose::level(DVec3::ZERO, 0.0), 1.5, 4, 3);
    let json = serde_json::to_value(camera).unwrap();
    assert_eq!(json["projection"]["Perspective"]["fov_rad"], 1.5);
    assert_eq!((&json["width"], &json["pose"]["location"][2]), (&4.into(), &0.0.into()));
}

#[test]
fn what_cannot_be_is_refused() {
    let box_of = |min: &str, max: &str| refusal::<Aabb>(&format!(r#"{{"min":{min},"max":{max}}}"#));
    assert!(box_of("[0,0,2]", "[1,1,1]").contains("above its max"));
    assert!(box_of("[0,0,null]", "[1,1,1]").contains("null"));
    assert!(box_of("[0,0]", "[1,1,1]").contains("length 2"));

    let camera = |fov_rad: &str, width: u32| {
        let pose = serde_json::to_string(&Pose::level(DVec3::ZERO, 0.0)).unwrap();
        let projection = format!(r#"{{"Perspective":{{"fov_rad":{fov_rad}}}}}"#);
        format!(r#"{{"pose":{pose},"projection":{projection},"width":{width},"height":3}}"#)
    };
    assert!(serde_json::from_str::<Camera>(&camera("1.0", 4)).is_ok());
    assert!(refusal::<Camera>(&camera("3.2", 4)).contains("angle of view of 3.2"));
    assert!(refusal::<Camera>(&camera("0.0", 4)).contains("angle of view"));
    assert!(refusal::<Camera>(&camera("1.0", 0)).contains("0 × 3 pixels"));

    let pinhole = camera("1.0", 4).replace(
        r#"{"Perspective":{"fov_rad":1.0}}"#,
        r#"{"Pinhole":{"focal_px":[500.0,400.0],"center_px":[2.5,-1.0]}}"#,
    );
    assert!(serde_json::from_str::<Camera>(&pinhole).is_ok());
    assert!(refusal::<Camera>(&pinhole.replace("400.0", "0.0")).contains("focal lengths of 500 and 0 px"));

    let lens = r#"{"size":[0,480],"focal_px":[500,500],"center_px":[320,240],"distortion":[0,0,0,0,0]}"#;
    assert!(refusal::<Lens>(lens).contains("no direction is projected to the middle"));
    assert!(serde_json::from_str::<Lens>(&lens.replace("[0,480]", "[640,480]")).is_ok());

    let cloud = r#"{"positions":[[0,0,0],[1,1,1]],"colors":[[1,2,3]],"faces":[]}"#;
    assert!(refusal::<PointCloud>(cloud).contains("1 colours for 2 points"));

    let voxels = serde_json::to_value(Voxels::from_points(&[Vec3::ZERO, Vec3::ONE])).unwrap();
    let damaged = |change: fn(&mut serde_json::Value)| {
        let mut voxels = voxels.clone();
        change(&mut voxels);
        refusal::<Voxels>(&voxels.to_string())
    };
    assert!(damaged(|v| v["members"][0] = 2.into()).contains("not there"));
    assert!(damaged(|v| v["starts"][1] = 2.into()).contains("does not fit"));
    assert!(damaged(|v| v["starts"] = serde_json::json!([0, 2])).contains("does not fit"));
    assert!(damaged(|v| v["grid"]["bbox"] = serde_json::Value::Null).contains("empty box"));
}
