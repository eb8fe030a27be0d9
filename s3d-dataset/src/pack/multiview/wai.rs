//! `s3d pack --to wai`: scenes in MapAnything's WAI format.

use super::{View, depth_m, overlaps, require, views_of, write_each};
use crate::context::Context;
use crate::error::Result;
use crate::pack::destination::Destination;
use crate::pack::options::PackageKind;
use crate::pack::source::Source;
use s3d_io::dataset::Domain;
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::encode_depth_float;
use s3d_io::package::{WaiFrame, write_wai_covisibility, write_wai_scene, write_wai_scene_list};

/// The splits for which MapAnything's ScanNet++ loader asks for a list of scenes.
const SPLITS: [&str; 3] = ["train", "val", "test"];

/// Writes a scene for each area, and lists of the scenes. Returns notes on how to use them.
pub(in crate::pack) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
) -> Result<Vec<String>> {
    require(source, PackageKind::Wai)?;
    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let mut scenes = Vec::new();
    for &area in &source.areas {
        let views = views_of(source, area)?;
        if views.is_empty() {
            ctx.warn(format_args!("area {area} has no views: it is left out"));
            continue;
        }

        let name = format!("area_{area}");
        let folder = destination.path().join(&name);
        let covisibility = folder.join("covisibility").join("v0");
        for below in [&folder.join("images"), &folder.join("rendered_depth"), &covisibility] {
            create_dir(below)?;
        }
        let frames = write_each(ctx, &views, &progress, |view| {
            let frame = frame(view);
            source.copy(view.image, Domain::Rgb, &folder.join(&frame.image))?;
            write_bytes(&folder.join(&frame.depth), &encode_depth_float(&depth_m(source, view)?))?;
            Ok(frame)
        })?;

        write_wai_covisibility(&covisibility, views.len(), &overlaps(ctx, source, area, &views)?)?;
        write_wai_scene(&folder.join("scene_meta.json"), &name, &frames)?;
        scenes.push(name);
    }

    for split in SPLITS {
        let folder = destination.path().join("metadata").join(split);
        create_dir(&folder)?;
        write_wai_scene_list(&folder.join(format!("scannetppv2_scene_list_{split}.npy")), &scenes)?;
    }
    Ok(vec![
        "ScanNetPPWAI(ROOT=FOLDER, dataset_metadata_dir=FOLDER/metadata, split=\"train\", …) of \
         MapAnything reads it; a scene is an area, and each split lists all scenes"
            .to_owned(),
        "rendered_depth is in metres, 0 where missing; the centre of the first pixel is (0, 0)".to_owned(),
    ])
}

/// Returns what `scene_meta.json` tells of a view.
fn frame(view: &View<'_>) -> WaiFrame {
    let name = view.image.stem();
    WaiFrame {
        image: format!("images/{name}.png"),
        depth: format!("rendered_depth/{name}.exr"),
        name,
        size: view.size,
        intrinsics: view.k_from_pixel_centres(),
        world_from_camera: view.world_from_camera(),
    }
}
