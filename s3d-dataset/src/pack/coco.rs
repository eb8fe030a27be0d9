//! `s3d pack --to coco`: panoptic annotations.

use super::destination::Destination;
use super::options::CocoOptions;
use super::source::Source;
use crate::context::Context;
use crate::error::{InputError, Result};
use crate::parallel::map_in_order;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{Content, encode_rgb8};
use s3d_io::package::{
    CocoImage, coco_categories, coco_masks, coco_panoptic, write_coco, write_coco_instances,
};
use s3d_label::{Class, Taxonomy};
use s3d_render::MISSING_INDEX;
use std::path::Path;

/// The folder of panoptic images.
const FOLDER: &str = "panoptic";
/// The file on the panoptic images.
const FILE: &str = "panoptic.json";
/// The file of boxes and masks of things.
const INSTANCES: &str = "instances.json";
const ABOUT: &str = "2D-3D-Semantic data set, exported by s3d";

/// Writes panoptic images and annotations. Returns notes on how to use them.
pub(super) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
    options: &CocoOptions,
) -> Result<Vec<String>> {
    let Some(table) = source.data.labels()? else {
        let dataset = source.data.layout.root().to_owned();
        return Err(InputError::WithoutLabels { dataset, needs: "COCO needs" }.into());
    };
    source.require(Domain::Rgb, "COCO")?;
    source.require(Domain::Semantic, "COCO")?;

    let taxonomy = table.taxonomy();
    let stuff = stuff(options, taxonomy)?;
    let compression = options.compression;

    // Panoptic images have the same names as the RGB images.
    let folder = destination.path().join(FOLDER);
    for image in &source.images {
        let below = image.relative_path(Domain::Rgb);
        Path::new(&below)
            .parent()
            .map_or(Ok(()), |parent| create_dir(&folder.join(parent)))?;
    }

    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let numbered: Vec<(u32, &DatasetImage)> = (1..).zip(&source.images).collect();
    let images = map_in_order(
        ctx,
        &numbered,
        || (),
        |(), (id, image)| {
            let path = image.path(&source.data.layout, Domain::Semantic);
            let mut semantic = source.rgb8(image, Domain::Semantic)?;
            // Pixels outside of the photograph teach nothing.
            if source.photograph(image).is_some_and(|p| p.masked > 0.0) {
                let color = source.rgb8(image, Domain::Rgb)?;
                let pairs = semantic.pixels_mut().iter_mut().zip(color.pixels());
                pairs
                    .filter(|(_, color)| **color == [0; 3])
                    .for_each(|(label, _)| *label = MISSING_INDEX);
            }

            let (panoptic, segments) = coco_panoptic(&semantic, &table, &stuff).map_err(|e| {
                FileError::format(&path, format!("{e} in {}", source.data.layout.labels_json().display()))
            })?;
            let file_name = image.relative_path(Domain::Rgb);
            write_bytes(&folder.join(&file_name), &encode_rgb8(&panoptic, Content::Labels, compression))?;

            progress.add(1);
            let is_thing = |id: u32| segments.iter().any(|s| s.id == id && !s.is_stuff());
            let masks = coco_masks(&panoptic, is_thing);
            let width = semantic.width();
            let height = semantic.height();
            Ok(CocoImage { id: *id, file_name, width, height, segments, masks })
        },
    )?;

    let categories = coco_categories(taxonomy, &stuff);
    write_coco(&destination.path().join(FILE), ABOUT, &images, &categories)?;
    write_coco_instances(&destination.path().join(INSTANCES), ABOUT, &images, &categories)?;

    Ok(vec![
        format!(
            "images are below the data set's folder, and their panoptic images, of the same names, below \
             {FOLDER}"
        ),
        "a segment's id is its label's index, or 16711680 + category of a class that is stuff; 0 is void"
            .into(),
        format!("{INSTANCES} has boxes and masks of the same things, as pycocotools reads them"),
    ])
}

/// The stuff classes, whose instances in an image form one segment.
pub(super) fn stuff(options: &CocoOptions, taxonomy: &Taxonomy) -> Result<Vec<Class>> {
    match &options.stuff {
        Some(list) => list.classes(taxonomy),
        None => Ok(taxonomy
            .classes()
            .iter()
            .copied()
            .filter(|class| taxonomy.is_stuff(*class))
            .collect()),
    }
}
