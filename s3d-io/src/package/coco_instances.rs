//! Writes COCO's instance annotations: a box and a mask for each thing in an image. `pycocotools` reads
//! these, but no panoptic annotations.

use crate::dataset::objects::RunLengths;
use crate::error::Result;
use crate::fs::atomic::write_whole;
use crate::package::coco::{CocoCategory, CocoImage, CocoSegment};
use s3d_geom::Raster;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// Makes the masks of the segments with `wanted` numbers, from a panoptic image (see
/// [`coco_panoptic`](crate::package::coco_panoptic)).
pub fn coco_masks(panoptic: &Raster<[u8; 3]>, wanted: impl Fn(u32) -> bool) -> BTreeMap<u32, RunLengths> {
    let width = panoptic.width();
    let height = panoptic.height();
    let mut stretches: BTreeMap<u32, Vec<Range<u64>>> = BTreeMap::new();
    let mut add = |id: u32, stretch: Range<u64>| {
        if id != 0 && !stretch.is_empty() && wanted(id) {
            stretches.entry(id).or_default().push(stretch);
        }
    };

    let mut at = 0;
    let mut start = 0;
    let mut current = 0;
    for x in 0..width {
        for y in 0..height {
            let [r, g, b] = panoptic.at(x, y);
            let id = u32::from_le_bytes([r, g, b, 0]);
            if id != current {
                add(current, start..at);
                start = at;
                current = id;
            }
            at += 1;
        }
    }
    add(current, start..at);

    let encode = |stretches: Vec<_>| RunLengths::encode([width, height], &stretches);
    stretches
        .into_iter()
        .map(|(id, stretches)| (id, encode(stretches)))
        .collect()
}

/// Writes an instance annotation file (`info`, `images`, `annotations`, `categories`). It has the segments
/// that have a mask in [`CocoImage::masks`], and the categories that are things. Returns its size in bytes.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_coco_instances(
    path: &Path,
    description: &str,
    images: &[CocoImage],
    categories: &[CocoCategory],
) -> Result<u64> {
    #[derive(Serialize)]
    struct Info<'a> {
        description: &'a str,
    }

    #[derive(Serialize)]
    struct Image<'a> {
        id: u32,
        file_name: &'a str,
        width: u32,
        height: u32,
    }

    #[derive(Serialize)]
    struct Annotation<'a> {
        id: u64,
        image_id: u32,
        category_id: u32,
        bbox: [u32; 4],
        area: u64,
        iscrowd: u8,
        segmentation: &'a RunLengths,
    }

    #[derive(Serialize)]
    struct File<'a> {
        info: Info<'a>,
        images: Vec<Image<'a>>,
        annotations: Vec<Annotation<'a>>,
        categories: Vec<&'a CocoCategory>,
    }

    let pairs = images.iter().flat_map(|image| {
        image
            .segments
            .iter()
            .filter_map(move |segment| Some((image.id, segment, image.masks.get(&segment.id)?)))
    });

    let file = File {
        info: Info { description },
        images: images
            .iter()
            .map(|i| Image { id: i.id, file_name: &i.file_name, width: i.width, height: i.height })
            .collect(),
        annotations: (1..)
            .zip(pairs)
            .map(|(id, (image_id, segment, segmentation))| {
                let CocoSegment { category_id, bbox, area, iscrowd, .. } = *segment;
                Annotation { id, image_id, category_id, bbox, area, iscrowd, segmentation }
            })
            .collect(),
        categories: categories.iter().filter(|category| category.isthing == 1).collect(),
    };

    write_whole(path, |out| {
        serde_json::to_writer(&mut *out, &file)?;
        out.write_all(b"\n")
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn masks_are_the_pixels_of_their_segments(
            ids in prop::collection::vec(0u32..4, 1..300),
            height in 1u32..40,
        ) {
            let width = (ids.len() as u32).div_ceil(height);
            let mut pixels: Vec<[u8; 3]> =
                ids.iter().map(|id| [*id as u8, 0, 7 * u8::from(*id > 0)]).collect();
            pixels.resize((width * height) as usize, [0; 3]);
            let image = Raster::from_vec(width, height, pixels);
            let id_of = |x, y| { let [r, g, b] = image.at(x, y); u32::from_le_bytes([r, g, b, 0]) };
            let three = 3 + (7 << 16);
            let masks = coco_masks(&image, |id| id != three);
            prop_assert!(!masks.contains_key(&0) && !masks.contains_key(&three));
            for (id, mask) in &masks {
                prop_assert_eq!(mask.size, [height, width]);
                let pixels: Vec<u64> = mask.decode().unwrap().into_iter().flatten().collect();
                let expected = (0..width).flat_map(|x| (0..height).map(move |y| (x, y)));
                let expected = (0u64..).zip(expected).filter(|(_, (x, y))| id_of(*x, *y) == *id);
                prop_assert!(pixels.into_iter().eq(expected.map(|(pixel, _)| pixel)));
            }
            let there = (0..width).any(|x| (0..height).any(|y| id_of(x, y) == 1 + (7 << 16)));
            prop_assert_eq!(masks.contains_key(&(1 + (7 << 16))), there);
        }
    }
}
