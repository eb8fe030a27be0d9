//! `s3d pack --to spatial-qa`: what VLM-3R's pipeline keeps of scenes and frames, and questions about rooms
//! with computed answers.
//!
//! Source: `VITA-Group/VLM-3R` at 6dd1264, `vlm_3r_data_process/README.md` (scene and frame metadata) and
//! `src/tasks/vsibench` (kinds of questions, after VSI-Bench).

mod distance;
mod questions;
mod scene;

use super::destination::Destination;
use super::multiview::View;
use super::source::{Source, millimetres};
use crate::context::Context;
use crate::error::{InputError, Result};
use crate::parallel::map_in_order;
use questions::{Question, ask};
use s3d_io::dataset::Domain;
use s3d_io::fs::{create_dir, write_bytes, write_json};
use s3d_io::image::{Compression, encode_gray16};
use scene::{Scene, Shown, Thing, scenes_of, shown};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;

/// Writes metadata, pictures and questions. Returns notes on how to use them.
pub(super) fn pack(ctx: &Context, source: &Source, destination: &Destination) -> Result<Vec<String>> {
    [Domain::Rgb, Domain::Depth, Domain::Semantic, Domain::Pose]
        .into_iter()
        .try_for_each(|domain| source.require(domain, "spatial-qa"))?;
    let Some(table) = source.data.labels()? else {
        let dataset = source.data.layout.root().to_owned();
        return Err(InputError::WithoutLabels { dataset, needs: "questions about rooms need" }.into());
    };

    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let (mut about_scenes, mut about_frames) = (Map::new(), Map::new());
    let mut questions: Vec<Question> = Vec::new();
    for &area in &source.areas {
        for scene in scenes_of(source, area, &table)? {
            for below in ["color", "depth"] {
                create_dir(&destination.path().join(below).join(&scene.id))?;
            }
            let numbered: Vec<(usize, &View<'_>)> = scene.views.iter().enumerate().collect();
            let shown = map_in_order(
                ctx,
                &numbered,
                || (),
                |(), (number, view)| {
                    let [color, depth] = ["color", "depth"]
                        .map(|below| destination.path().join(file_of(below, &scene.id, *number)));
                    source.copy(view.image, Domain::Rgb, &color)?;
                    let mm = millimetres(&source.depth(view.image)?, source.depth_units_per_m);
                    write_bytes(&depth, &encode_gray16(&mm, Compression::default()))?;
                    progress.add(1);
                    shown(source, view)
                },
            )?;
            about_scenes.insert(scene.id.clone(), about_scene(&scene));
            about_frames.insert(scene.id.clone(), about_frames_of(&scene, &shown));
            questions.extend(ask(&scene, &shown));
        }
    }
    for (id, question) in questions.iter_mut().enumerate() {
        question.id = id;
    }
    write_json(&destination.path().join("scene_metadata.json"), &about_scenes)?;
    write_json(&destination.path().join("frame_metadata.json"), &about_frames)?;
    write_json(&destination.path().join("qa.json"), &questions)?;
    Ok(vec![
        format!("{} questions about {} rooms; a scene is a room", questions.len(), about_scenes.len()),
        "views have lenses of their own: camera_intrinsics are in each frame, and those of a scene are its \
         first frame's"
            .to_owned(),
    ])
}

fn file_of(below: &str, scene: &str, number: usize) -> String {
    format!("{below}/{scene}/{number:06}.png")
}

fn about_scene(scene: &Scene<'_>) -> Value {
    let mut counts: BTreeMap<&str, u32> = BTreeMap::new();
    let mut boxes: BTreeMap<&str, Vec<Value>> = BTreeMap::new();
    let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
    for thing in &scene.things {
        *counts.entry(&thing.class).or_default() += 1;
        boxes.entry(&thing.class).or_default().push(about_thing(thing));
        for k in 0..3 {
            low[k] = low[k].min(thing.bbox[k]);
            high[k] = high[k].max(thing.bbox[3 + k]);
        }
    }
    let center = [0, 1, 2].map(|k| f64::from(low[k] + high[k]) / 2.0);
    json!({
        "video_path": null,
        "dataset": "s3d",
        "room_size": scene.size_m2,
        "room_center": center,
        "object_counts": counts,
        "object_bboxes": boxes,
    })
}

fn about_thing(thing: &Thing) -> Value {
    let [along, across] = thing.axes();
    let [x0, y0, z0, x1, y1, z1] = thing.bbox;
    json!({
        "centroid": thing.upright.center,
        "axesLengths": thing.upright.size,
        // An axis a row.
        "normalizedAxes": [along.x, along.y, 0.0, across.x, across.y, 0.0, 0.0, 0.0, 1.0],
        "min": [x0, y0, z0],
        "max": [x1, y1, z1],
        "instance_id": thing.index,
        "label": thing.label,
    })
}

fn about_frames_of(scene: &Scene<'_>, shown: &[BTreeMap<u32, Shown>]) -> Value {
    let intrinsics = |view: &View<'_>| {
        let [[fx, _, cx], [_, fy, cy], _] = view.k;
        json!({ "fx": fx, "fy": fy, "cx": cx, "cy": cy })
    };
    let frames = scene
        .views
        .iter()
        .zip(shown)
        .enumerate()
        .map(|(number, (view, shown))| {
            let boxes = scene.things.iter().filter_map(|thing| {
                let bounds = shown.get(&thing.index)?.bounds;
                Some(json!({ "instance_id": thing.index, "bbox_2d": bounds }))
            });
            json!({
                "frame_id": number,
                "file_path_color": file_of("color", &scene.id, number),
                "file_path_depth": file_of("depth", &scene.id, number),
                "camera_pose_camera_to_world": view.world_from_camera(),
                "camera_intrinsics": intrinsics(view),
                "bboxes_2d": boxes.collect::<Vec<Value>>(),
            })
        });
    let size = scene.views.first().map(|view| view.size);
    json!({
        "camera_intrinsics": scene.views.first().map(intrinsics),
        "img_width": size.map(|size| size.0),
        "img_height": size.map(|size| size.1),
        "frames": frames.collect::<Vec<Value>>(),
    })
}
