//! The grounds of plans are read back by `s3d_report::files` and held against the mesh of the data set.

use crate::common;

use common::{data_set, pair, url_bytes, value};
use s3d_dataset::{Context, DataSet, Export, ExportOptions};
use s3d_geom::Raster;
use s3d_geom::glam::{DVec3, dvec3};
use s3d_io::image::decode_rgb8;
use s3d_render::{Scene, cast_ray};
use s3d_report::{ReportOptions, report};
use s3d_synth::{Building, ScanOptions};
use serde_json::Value;
use std::path::Path;

/// What a ray from above sees first of the faces that face upwards, below a height.
fn below(scene: &Scene<'_>, x: f64, y: f64, cut: f64) -> Option<f64> {
    let mut z = cut;
    loop {
        let hit = cast_ray(scene, dvec3(x, y, z), DVec3::NEG_Z)?;
        z -= hit.t;
        if scene.mesh().normal(hit.face).z > 0.0 {
            return Some(z);
        }
        z -= 1e-6;
    }
}

/// The image and the mask of a ground, of the size that its entry says.
fn images(to: &Path, number: usize, entry: &Value) -> (Raster<[u8; 3]>, Raster<[u8; 3]>) {
    let ground = value(to, &format!("ground_{number}"));
    let image = image::load_from_memory(&url_bytes(&ground["image"], "jpeg"))
        .unwrap()
        .into_rgb8();
    let image =
        Raster::from_vec(image.width(), image.height(), image.pixels().map(|pixel| pixel.0).collect());
    let mask = decode_rgb8(&url_bytes(&ground["mask"], "png"), "mask".as_ref()).unwrap();
    let size = pair(&entry["size"]);
    assert_eq!(size, [image.width(), image.height()]);
    assert_eq!(size, [mask.width(), mask.height()]);
    (image, mask)
}

/// A pixel whose centre is this near to where something ends may be on either side of it, metres: numbers of
/// an entry are rounded to half of that. With 8 mm, the centres of a whole row lie on the end of a floor.
const ROUNDING_M: f64 = 1e-4;

/// Holds a ground against rays from above, at every 7th pixel of every 7th row. The mask of a pixel is what a
/// ray through its centre sees, or where things end, what a ray beside it sees.
fn check_mask(data: &DataSet, entry: &Value, mask: &Raster<[u8; 3]>, low: f64) {
    let number = |key: &str| entry[key].as_f64().unwrap();
    let [west, north, pixel_m] = ["west", "north", "pixel_m"].map(number);
    let mesh = data.mesh(1).unwrap().unwrap().mesh;
    let scene = Scene::new(&mesh);
    let is_seen = |x: f64, y: f64| below(&scene, x, y, number("cut")).is_some_and(|z| z >= low);
    let [mut all, mut seen] = [0; 2];
    for j in (0..mask.height()).step_by(7) {
        for i in (0..mask.width()).step_by(7) {
            let x = west + (f64::from(i) + 0.5) * pixel_m;
            let y = north - (f64::from(j) + 0.5) * pixel_m;
            let is_white = mask.at(i, j) == [255; 3];
            let beside = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]];
            let is_right = is_seen(x, y) == is_white
                || beside
                    .iter()
                    .any(|[dx, dy]| is_seen(x + dx * ROUNDING_M, y + dy * ROUNDING_M) == is_white);
            assert!(is_right, "pixel ({i}, {j}) at {x}, {y} is white: {is_white}");
            all += 1;
            seen += u32::from(is_white);
        }
    }
    assert!(4 * seen > all && seen < all, "{seen} of {all}");
}

#[test]
fn the_ground_is_the_mesh_from_above() {
    let folder = tempfile::tempdir().unwrap();
    for labelled in [true, false] {
        let out = data_set(&folder.path().join(labelled.to_string()), labelled);
        let to = folder.path().join(format!("report {labelled}"));
        report(&out, &to, &ReportOptions::default(), &Context::default()).unwrap();
        let data = DataSet::open(&out).unwrap();
        let index = value(&to, "index");
        let grounds = index["grounds"].as_array().unwrap();
        assert_eq!(grounds.len(), 1);
        let entry = &grounds[0];
        assert_eq!(entry["area"], 1);
        let (image, mask) = images(&to, 0, entry);
        assert!(image.width().max(image.height()) == 2048, "as fine as it may be");

        let cut = entry["cut"].as_f64().unwrap();
        assert!((2.0..3.5).contains(&cut), "below the ceilings: {cut}");
        check_mask(&data, entry, &mask, f64::NEG_INFINITY);
        // There are many colours, and dark ones are few.
        let dark = image
            .pixels()
            .iter()
            .filter(|pixel| pixel.iter().all(|c| *c < 8))
            .count();
        assert!(dark < image.len() / 50, "{dark}");

        // The plan's rooms lie within it.
        let number = |key: &str| entry[key].as_f64().unwrap();
        let [west, north] = ["west", "north"].map(number);
        let size = pair(&entry["size"]).map(|side| f64::from(side) * number("pixel_m"));
        for room in index["rooms"].as_array().unwrap() {
            for point in room["outline"]
                .as_array()
                .unwrap()
                .iter()
                .flat_map(|ring| ring.as_array().unwrap())
            {
                let [x, y] = [0, 1].map(|k| point[k].as_f64().unwrap());
                assert!(x > west - 0.3 && x < west + size[0] + 0.3, "{x}");
                assert!(y < north + 0.3 && y > north - size[1] - 0.3, "{y}");
            }
        }
    }
}

#[test]
fn each_storey_has_its_ground() {
    let folder = tempfile::tempdir().unwrap();
    let scan = ScanOptions { points_per_m2: 60.0, ..ScanOptions::default() };
    let scene = Building { texture_scale: 0.2, ..Building::two_storeys() }
        .build()
        .unwrap()
        .write_scan(&folder.path().join("scan"), &scan, || true)
        .unwrap();
    let options =
        ExportOptions { views: 6, size: 80, pano_width: 160, points_per_m2: 5.0, ..ExportOptions::default() };
    let out = folder.path().join("house");
    Export::new([scene])
        .options(options)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    let to = folder.path().join("report");
    report(&out, &to, &ReportOptions::default(), &Context::default()).unwrap();

    let index = value(&to, "index");
    let grounds = index["grounds"].as_array().unwrap();
    assert_eq!(grounds.len(), 2, "{grounds:?}");
    let data = DataSet::open(&out).unwrap();
    let mut floors = Vec::new();
    for (number, entry) in grounds.iter().enumerate() {
        let floor = entry["floors"][0].as_f64().unwrap();
        let (_, mask) = images(&to, number, entry);
        let low = if number == 0 { f64::NEG_INFINITY } else { floor - 0.25 };
        check_mask(&data, entry, &mask, low);
        assert!(entry["cut"].as_f64().unwrap() < floor + 2.85, "{entry}");
        floors.push(floor);
    }
    assert!(floors[1] - floors[0] > 2.0, "{floors:?}");
}
