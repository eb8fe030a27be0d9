//! Writes COCO's instance annotations: a box and a mask for each thing in an image. `pycocotools` reads
//! these, but no panoptic annotations.

use crate::error::Result;
use crate::fs::atomic::write_whole;
use crate::package::coco::{CocoCategory, CocoImage, CocoSegment};
use s3d_geom::Raster;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The pixels of a segment as COCO's compressed run lengths. The fields are named as in the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CocoMask {
    /// The height and width of the image.
    pub size: [u32; 2],
    /// How many pixels lie outside the segment, then how many inside, and so on, column by column; encoded as
    /// text.
    pub counts: String,
}

/// Makes the masks of the segments with `wanted` numbers, from a panoptic image (see
/// [`coco_panoptic`](crate::package::coco_panoptic)).
pub fn coco_masks(panoptic: &Raster<[u8; 3]>, wanted: impl Fn(u32) -> bool) -> BTreeMap<u32, CocoMask> {
    let width = panoptic.width();
    let height = panoptic.height();
    // For each segment its runs so far, and the end of the last run inside it.
    let mut runs: BTreeMap<u32, (Vec<u32>, u32)> = BTreeMap::new();
    let mut add = |id: u32, start: u32, end: u32| {
        if id != 0 && start < end && wanted(id) {
            let (counts, last) = runs.entry(id).or_default();
            counts.extend([start - *last, end - start]);
            *last = end;
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
                add(current, start, at);
                start = at;
                current = id;
            }
            at += 1;
        }
    }
    add(current, start, at);

    runs.into_iter()
        .map(|(id, (mut counts, end))| {
            if end < at {
                counts.push(at - end);
            }
            (id, CocoMask { size: [height, width], counts: text_of(&counts) })
        })
        .collect()
}

/// Encodes run lengths as text. Each length from the fourth on is replaced by its difference from the length
/// two before. A number is split into groups of five bits, the lowest first. A sixth bit says that another
/// group follows, and adding 48 makes the group a letter. The last group carries the sign.
fn text_of(counts: &[u32]) -> String {
    let mut text = String::new();
    let earlier = [None; 3].into_iter().chain(counts.iter().skip(1).map(Some));
    for (count, before) in counts.iter().zip(earlier) {
        let mut rest = i64::from(*count) - before.map_or(0, |before| i64::from(*before));
        loop {
            let group = (rest & 31) as u8;
            rest >>= 5;
            let is_last = rest == if group & 16 == 0 { 0 } else { -1 };
            text.push(char::from(48 + group + if is_last { 0 } else { 32 }));
            if is_last {
                break;
            }
        }
    }
    text
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
        segmentation: &'a CocoMask,
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

    /// Decodes the run lengths of a text.
    fn counts_of(text: &str) -> Vec<u32> {
        let mut counts: Vec<i64> = Vec::new();
        let mut value = 0i64;
        let mut shift = 0;
        for letter in text.bytes().map(|b| b - 48) {
            value |= i64::from(letter & 31) << shift;
            shift += 5;
            if letter & 32 == 0 {
                if letter & 16 != 0 {
                    value |= -1 << shift;
                }
                let before = counts.len().checked_sub(2).filter(|i| *i > 0).map_or(0, |i| counts[i]);
                counts.push(value + before);
                value = 0;
                shift = 0;
            }
        }
        counts.into_iter().map(|count| u32::try_from(count).unwrap()).collect()
    }

    #[test]
    fn text_is_that_of_pycocotools() {
        assert_eq!(text_of(&[1, 3, 2]), "132");
        assert_eq!(text_of(&[200, 3, 5, 90, 1, 17, 500]), "X635g2LgMc?");
        assert_eq!(text_of(&[5050, 1, 4949]), "jm41ej4");
    }

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
                let counts = counts_of(&mask.counts);
                let set = (0..).zip(&counts).flat_map(|(i, n)| vec![i % 2 == 1; *n as usize]);
                let expected = (0..width).flat_map(|x| (0..height).map(move |y| (x, y)));
                prop_assert!(set.eq(expected.map(|(x, y)| id_of(x, y) == *id)));
            }
            let there = (0..width).any(|x| (0..height).any(|y| id_of(x, y) == 1 + (7 << 16)));
            prop_assert_eq!(masks.contains_key(&(1 + (7 << 16))), there);
        }
    }
}
