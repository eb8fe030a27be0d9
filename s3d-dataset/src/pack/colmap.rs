//! `s3d pack --to colmap`: a model of cameras, images and points for each area.

use super::area_points;
use super::destination::Destination;
use super::options::ColmapOptions;
use super::source::Source;
use crate::context::Context;
use crate::error::Result;
use crate::parallel::map_in_order;
use s3d_io::dataset::Domain;
use s3d_io::fs::create_dir;
use s3d_io::package::{ColmapImage, ColmapModel};

/// Writes the models of all areas. Returns notes on how to use them.
pub(super) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
    options: &ColmapOptions,
) -> Result<Vec<String>> {
    source.require(Domain::Rgb, "COLMAP")?;
    source.require(Domain::Pose, "COLMAP")?;
    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let mut notes = Vec::new();
    for &area in &source.areas {
        let images = source.of_area(area);
        let Some(first) = images.first() else {
            ctx.warn(format_args!("area {area} has no views: it is left out"));
            continue;
        };

        let folder = destination.path().join(format!("area_{area}"));
        let copies = folder.join("images");
        if options.copy_images {
            create_dir(&copies)?;
        }

        let models = map_in_order(
            ctx,
            &images,
            || (),
            |(), image| {
                let pose = source.data.pose(image)?;
                let (width, height) = source.size(image)?;
                let name = format!("{}_domain_rgb.png", image.stem());
                if options.copy_images {
                    source.copy(image, Domain::Rgb, &copies.join(&name))?;
                }
                progress.add(1);
                Ok(ColmapImage { name, width, height, k: pose.camera_k_matrix, rt: pose.camera_rt_matrix })
            },
        )?;

        let points = area_points(source, area, options.points)?;
        let model = ColmapModel::new(&models, &points);
        let dir = folder.join("sparse").join("0");
        if options.binary {
            model.write_binary(&dir)
        } else {
            model.write_text(&dir)
        }?;

        let images = if options.copy_images {
            format!("area_{area}/images")
        } else {
            let folder = source.data.layout.image_dir(area, first.frame, Domain::Rgb);
            let below = folder
                .strip_prefix(source.data.layout.root())
                .unwrap_or(&folder)
                .display()
                .to_string();
            format!("{below} of the data set")
        };
        notes.push(format!("the model area_{area}/sparse/0 is of the images in {images}"));
    }

    notes.push("panoramas are not in it; points have no tracks".into());
    Ok(notes)
}
