//! `s3d pack --to concerto`: the rooms of [`pointcept`](super::pointcept), their views, and which point of
//! the room each pixel shows.
//!
//! Source: `Pointcept/Pointcept` at d74c646, `pointcept/datasets/preprocessing/concerto/s3dis/` and
//! `DefaultImagePointDataset` of `pointcept/datasets/defaults.py`.

mod near_points;

use super::destination::Destination;
use super::multiview::{View, depth_m, views_of};
use super::pointcept;
use super::source::Source;
use crate::context::Context;
use crate::error::{InputError, Result};
use crate::parallel::for_each_in_order;
use near_points::NearPoints;
use s3d_geom::glam::{DMat4, DVec3};
use s3d_io::cloud::NpyWriter;
use s3d_io::dataset::Domain;
use s3d_io::fs::{create_dir, write_json};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A pixel shows a point that is nearer than this to what it sees, metres.
const NEAR_M: f64 = 0.01;

/// The number of images of a sample.
const IMAGES_A_SAMPLE: usize = 4;

/// Where its loaders look for the package.
const ROOT: &str = "data/s3dis";

/// Writes a folder for each room, one for its images, and the lists of samples. Returns notes on how to use
/// them.
pub(super) fn pack(ctx: &Context, source: &Source, destination: &Destination) -> Result<Vec<String>> {
    [Domain::Rgb, Domain::Depth, Domain::Pose]
        .into_iter()
        .try_for_each(|domain| source.require(domain, "Concerto"))?;
    let views_of_area = |area: &u32| Ok((*area, views_of(source, *area)?));
    let views = source
        .areas
        .iter()
        .map(views_of_area)
        .collect::<Result<BTreeMap<_, _>>>()?;
    let splits = destination.path().join("splits");
    create_dir(&splits)?;

    let count = AtomicUsize::new(0);
    let areas = pointcept::pack_areas(ctx, source, destination, &|room| {
        let views = views[&room.area].iter().filter(|view| view.image.room == room.name);
        let mut by_camera: BTreeMap<&str, Vec<&View<'_>>> = BTreeMap::new();
        views.for_each(|view| by_camera.entry(&view.image.uuid).or_default().push(view));

        let points = NearPoints::new(room.points, NEAR_M);
        for (camera, views) in by_camera {
            let folder = destination.path().join("images").join(format!("Area_{}", room.area));
            write_camera(ctx, source, &folder.join(&room.name).join(camera), &views, &points)?;
            count.fetch_add(views.len(), Ordering::Relaxed);
        }
        Ok(())
    })?;
    if count.into_inner() == 0 {
        let what = "views in rooms with points".to_owned();
        let dataset = source.data.layout.root().to_owned();
        return Err(InputError::NothingToPack { dataset, what }.into());
    }
    for (area, rooms) in &areas {
        write_json(&splits.join(format!("Area_{area}.json")), &samples(source, *area, rooms, &views[area]))?;
    }

    let names: Vec<String> = areas.keys().map(|area| format!("Area_{area}")).collect();
    Ok(vec![
        format!(
            "DefaultImagePointDataset of Pointcept has the splits {}; its lists name files below {ROOT}, so \
             link the package there",
            names.join(", ")
        ),
        "a row of a correspondence is column, row, and the index of a point of the room within 1 cm"
            .to_owned(),
    ])
}

/// Writes the views of a camera, in the order of their numbers.
fn write_camera(
    ctx: &Context,
    source: &Source,
    folder: &Path,
    views: &[&View<'_>],
    points: &NearPoints<'_>,
) -> Result<()> {
    for below in ["color", "correspondence", "depth", "intrinsic", "pose"] {
        create_dir(&folder.join(below))?;
    }
    let numbered: Vec<(usize, &View<'_>)> = views.iter().copied().enumerate().collect();
    for_each_in_order(
        ctx,
        &numbered,
        || (),
        |(), (number, view)| {
            let stem = stem_of(source, view);
            source.copy(view.image, Domain::Rgb, &folder.join("color").join(format!("{stem}.png")))?;
            let depth = view.image.path(&source.data.layout, Domain::Depth);
            let name = depth.file_name().unwrap_or_default();
            source.copy(view.image, Domain::Depth, &folder.join("depth").join(name))?;

            let intrinsic = folder.join("intrinsic").join(format!("{number}.npy"));
            write_matrix(&intrinsic, view.k.as_flattened(), 3)?;
            let to_camera = view.camera_from_world.as_flattened();
            let rows = [to_camera, &[0.0, 0.0, 0.0, 1.0]].concat();
            write_matrix(&folder.join("pose").join(format!("{number}.npy")), &rows, 4)?;

            let rows = correspondences(source, view, points)?;
            let path = folder.join("correspondence").join(format!("{stem}.npy"));
            let mut array = NpyWriter::create(&path, "<i4", &[rows.len() as u64, 3])?;
            let bytes: Vec<u8> = rows.iter().flatten().flat_map(|n| n.to_le_bytes()).collect();
            array.put(&bytes)?;
            array.finish()?;
            Ok(())
        },
    )
}

/// Returns the pixels of a view that show a point: column, row and the point. What no pixel shows is one row
/// of −1, as the loader has it.
fn correspondences(source: &Source, view: &View<'_>, points: &NearPoints<'_>) -> Result<Vec<[i32; 3]>> {
    let [[fx, _, cx], [_, fy, cy], _] = view.k;
    let to_world = DMat4::from_cols_array_2d(&view.world_from_camera()).transpose();
    let depth = depth_m(source, view)?;
    let width = depth.width() as usize;
    let mut found = Vec::new();
    for (i, depth) in depth.pixels().iter().enumerate().filter(|(_, depth)| **depth > 0.0) {
        let [column, row] = [i % width, i / width];
        let [x, y] = [(column as f64 + 0.5 - cx) / fx, (row as f64 + 0.5 - cy) / fy];
        let place = to_world.transform_point3(f64::from(*depth) * DVec3::new(x, y, 1.0));
        if let Some(point) = points.nearest(place) {
            found.push([column as i32, row as i32, point as i32]);
        }
    }
    if found.is_empty() {
        found.push([-1; 3]);
    }
    Ok(found)
}

/// The samples of an area by name: a room, and some views of a camera in it.
fn samples(source: &Source, area: u32, rooms: &[String], views: &[View<'_>]) -> Map<String, Value> {
    let mut by_camera: BTreeMap<(&str, &str), Vec<&View<'_>>> = BTreeMap::new();
    for view in views.iter().filter(|view| rooms.contains(&view.image.room)) {
        let camera = (&*view.image.room, &*view.image.uuid);
        by_camera.entry(camera).or_default().push(view);
    }

    let mut samples = Map::new();
    for ((room, camera), views) in by_camera {
        let folder = format!("{ROOT}/images/Area_{area}/{room}/{camera}");
        for (number, views) in views.chunks(IMAGES_A_SAMPLE).enumerate() {
            let files = |below: &str, ending: &str| -> Vec<String> {
                let path = |view: &&View<'_>| format!("{folder}/{below}/{}.{ending}", stem_of(source, view));
                views.iter().map(path).collect()
            };
            let sample = json!({
                "pointclouds": format!("{ROOT}/Area_{area}/{room}"),
                "images": files("color", "png"),
                "correspondences": files("correspondence", "npy"),
            });
            samples.insert(format!("{room}_{camera}_{number}"), sample);
        }
    }
    samples
}

/// The name of the colours of a view, without its ending.
fn stem_of(source: &Source, view: &View<'_>) -> String {
    let path = view.image.path(&source.data.layout, Domain::Rgb);
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn write_matrix(path: &Path, values: &[f64], columns: u64) -> Result<()> {
    let rows = values.len() as u64 / columns;
    let mut array = NpyWriter::create(path, "<f8", &[rows, columns])?;
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    array.put(&bytes)?;
    array.finish()?;
    Ok(())
}
