//! `s3d pack --to vggt`: images, depth and annotation files of VGGT's training code.

use super::{View, depth_mm, require, views_of, write_each};
use crate::context::Context;
use crate::error::Result;
use crate::pack::destination::Destination;
use crate::pack::options::PackageKind;
use crate::pack::source::Source;
use s3d_io::dataset::Domain;
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{Compression, encode_gray16};
use s3d_io::package::{VggtImage, write_vggt_annotations};
use std::collections::BTreeMap;

/// The fewest images of a sequence that the loader takes, unless it is told another number.
const LEAST: usize = 24;

/// Writes the views of each room as a sequence. Returns notes on how to use them.
pub(in crate::pack) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
) -> Result<Vec<String>> {
    require(source, PackageKind::Vggt)?;
    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let mut sequences: BTreeMap<String, Vec<VggtImage>> = BTreeMap::new();
    for &area in &source.areas {
        let views = views_of(source, area)?;
        let folder = destination.path().join(format!("area_{area}"));
        for below in ["images", "depths"] {
            create_dir(&folder.join(below))?;
        }
        let images = write_each(ctx, &views, &progress, |view| {
            let image = image(view);
            source.copy(view.image, Domain::Rgb, &destination.path().join(&image.filepath))?;
            let depth = encode_gray16(&depth_mm(source, view)?, Compression::default());
            write_bytes(&destination.path().join(&image.depthpath), &depth)?;
            Ok(image)
        })?;
        for (view, image) in views.iter().zip(images) {
            let name = format!("area_{area}_{}", view.image.room);
            sequences.entry(name).or_default().push(image);
        }
    }

    let folder = destination.path().join("annotations").join("scannet");
    create_dir(&folder)?;
    for split in ["train", "test"] {
        write_vggt_annotations(&folder.join(format!("{split}.jgz")), &sequences)?;
    }
    let short = sequences.values().filter(|images| images.len() < LEAST).count();
    let mut notes = vec![
        "ScanNetDataset(SCANNET_DIR=FOLDER, SCANNET_ANNOTATION_DIR=FOLDER/annotations, …) of VGGT reads \
         it; a sequence is the views of a room, and train.jgz and test.jgz both have all of them"
            .to_owned(),
        "depth is in millimetres, 0 where missing; the centre of the first pixel is (0.5, 0.5)".to_owned(),
    ];
    if short > 0 {
        notes.push(format!(
            "{short} of {} sequences have fewer than {LEAST} images: min_num_images=1 keeps them",
            sequences.len()
        ));
    }
    Ok(notes)
}

/// Returns what the annotation file tells of a view.
fn image(view: &View<'_>) -> VggtImage {
    let (area, name) = (view.image.area, view.image.stem());
    VggtImage {
        filepath: format!("area_{area}/images/{name}.png"),
        depthpath: format!("area_{area}/depths/{name}.png"),
        extri: view.camera_from_world,
        intri: view.k,
    }
}
