//! Writes COCO's panoptic annotations: an image of segment numbers, and a list that describes the segments.

#![expect(
    clippy::indexing_slicing,
    reason = "a writer: it counts the rows and labels of images that were read, and checked, before"
)]

use crate::dataset::objects::RunLengths;
use crate::error::Result;
use crate::fs::atomic::write_whole;
use s3d_geom::Raster;
use s3d_label::{Class, LabelId, LabelTable, Taxonomy};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use thiserror::Error;

/// The colour of pixels in a semantic image that show no surface. Source: [`crate::formats`], "What is
/// written".
const MISSING: [u8; 3] = [13; 3];

/// The first number of segments that cover all of a class in an image. It is larger than any label index.
const FIRST_STUFF_ID: u32 = 0x00ff_0000;

/// A category. The fields are named as in the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CocoCategory {
    /// [`Taxonomy::id`]: for S3DIS 1 to 13, in the order of its classes.
    pub id: u32,
    /// The name of the class.
    pub name: &'static str,
    /// "structure" for parts of the building, "furniture", or "clutter". It follows the S3DIS class that the
    /// class counts as.
    pub supercategory: &'static str,
    /// 1 if each instance is a segment, 0 if all of the class in an image is one segment.
    pub isthing: u8,
    /// The colour of the class, for display.
    pub color: [u8; 3],
}

/// Returns the categories, one for each class. The instances of the classes in `stuff` are not told apart.
pub fn coco_categories(taxonomy: &Taxonomy, stuff: &[Class]) -> Vec<CocoCategory> {
    taxonomy
        .classes()
        .iter()
        .map(|&class| CocoCategory {
            id: taxonomy.id(class),
            name: class.name(),
            supercategory: supercategory(class),
            isthing: u8::from(!stuff.contains(&class)),
            color: taxonomy.color(class),
        })
        .collect()
}

fn supercategory(class: Class) -> &'static str {
    match class.s3dis() {
        Class::CEILING
        | Class::FLOOR
        | Class::WALL
        | Class::BEAM
        | Class::COLUMN
        | Class::WINDOW
        | Class::DOOR => "structure",
        Class::TABLE | Class::CHAIR | Class::SOFA | Class::BOOKCASE | Class::BOARD => "furniture",
        _ => "clutter",
    }
}

/// A segment of an image. The fields are named as in the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CocoSegment {
    /// Its number in the image. For an instance the index of its label, which is the same in all images of
    /// the data set; for stuff 16,711,680 plus the number of the category.
    pub id: u32,
    /// The category of its class: [`CocoCategory::id`].
    pub category_id: u32,
    /// How many pixels it has.
    pub area: u64,
    /// x, y, width and height of the box around its pixels.
    pub bbox: [u32; 4],
    /// Always 0.
    pub iscrowd: u8,
}

impl CocoSegment {
    /// Returns whether it covers all of a class in the image, rather than one instance.
    pub fn is_stuff(&self) -> bool {
        self.id >= FIRST_STUFF_ID
    }
}

/// A pixel whose label is beyond the table.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[error("pixel ({x}, {y}) has label {index}, but there are {labels} labels")]
pub struct UnknownLabelIndex {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// The label index of the pixel.
    pub index: u32,
    /// How many labels there are.
    pub labels: usize,
}

/// Makes the panoptic image of a semantic image, and its segments in the order of their numbers. A pixel
/// holds the number of its segment as R + 256·G + 65536·B, which is not the byte order of our semantic
/// images. It is 0 where nothing was seen, or a surface without a label.
///
/// # Errors
/// [`UnknownLabelIndex`].
pub fn coco_panoptic(
    semantic: &Raster<[u8; 3]>,
    table: &LabelTable,
    stuff: &[Class],
) -> std::result::Result<(Raster<[u8; 3]>, Vec<CocoSegment>), UnknownLabelIndex> {
    let width = semantic.width() as usize;
    let mut segments: BTreeMap<u32, Extent> = BTreeMap::new();
    let mut pixels = Vec::with_capacity(semantic.len());
    // The segment of each label. A label repeats from row to row.
    let mut known: BTreeMap<[u8; 3], Option<(u32, u32)>> = BTreeMap::from([(MISSING, None)]);

    for (y, row) in semantic.pixels().chunks(width.max(1)).enumerate() {
        let mut x = 0;
        for run in row.chunk_by(|a, b| a == b) {
            let label = run[0];
            let segment = match known.get(&label) {
                Some(segment) => *segment,
                None => {
                    let index = u32::from_be_bytes([0, label[0], label[1], label[2]]);
                    if index as usize >= table.len() {
                        let labels = table.len();
                        let x = x as u32;
                        let y = y as u32;
                        return Err(UnknownLabelIndex { x, y, index, labels });
                    }
                    let segment = table.class_of(LabelId(index)).map(|class| {
                        let category = table.taxonomy().id(class);
                        let whole = FIRST_STUFF_ID + category;
                        (if stuff.contains(&class) { whole } else { index }, category)
                    });
                    known.insert(label, segment);
                    segment
                }
            };

            if let Some((id, category)) = segment {
                let extent = segments.entry(id).or_insert_with(|| Extent::new(category));
                extent.add(x as u32, y as u32, run.len() as u32);
            }

            let [r, g, b, _] = segment.map_or(0, |s| s.0).to_le_bytes();
            pixels.resize(pixels.len() + run.len(), [r, g, b]);
            x += run.len();
        }
    }

    let image = Raster::from_vec(semantic.width(), semantic.height(), pixels);
    Ok((image, segments.into_iter().map(|(id, extent)| extent.segment(id)).collect()))
}

/// The pixels of a segment: how many, and the box around them.
struct Extent {
    category_id: u32,
    area: u64,
    x: (u32, u32),
    y: (u32, u32),
}

impl Extent {
    fn new(category_id: u32) -> Self {
        Self { category_id, area: 0, x: (u32::MAX, 0), y: (u32::MAX, 0) }
    }

    /// Adds `count` pixels of row `y`, from `x` on.
    fn add(&mut self, x: u32, y: u32, count: u32) {
        self.area += u64::from(count);
        self.x = (self.x.0.min(x), self.x.1.max(x + count));
        self.y = (self.y.0.min(y), self.y.1.max(y + 1));
    }

    fn segment(&self, id: u32) -> CocoSegment {
        let bbox = [self.x.0, self.y.0, self.x.1 - self.x.0, self.y.1 - self.y.0];
        CocoSegment { id, category_id: self.category_id, area: self.area, bbox, iscrowd: 0 }
    }
}

/// An image with its segments.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CocoImage {
    /// The number of the image in the data set.
    pub id: u32,
    /// The path of the image below the folder of images, and of the panoptic image below its folder. COCO
    /// gives both the same name.
    pub file_name: String,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// The segments of the image.
    pub segments: Vec<CocoSegment>,
    /// The masks of its instances, by segment number.
    pub masks: BTreeMap<u32, RunLengths>,
}

/// Writes a panoptic annotation file (`info`, `images`, `annotations`, `categories`) and returns its size in
/// bytes.
///
/// # Errors
/// [`crate::Error::Io`].
pub fn write_coco(
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
        image_id: u32,
        file_name: &'a str,
        segments_info: &'a [CocoSegment],
    }

    #[derive(Serialize)]
    struct File<'a> {
        info: Info<'a>,
        images: Vec<Image<'a>>,
        annotations: Vec<Annotation<'a>>,
        categories: &'a [CocoCategory],
    }

    let file = File {
        info: Info { description },
        images: images
            .iter()
            .map(|i| Image { id: i.id, file_name: &i.file_name, width: i.width, height: i.height })
            .collect(),
        annotations: images
            .iter()
            .map(|i| Annotation { image_id: i.id, file_name: &i.file_name, segments_info: &i.segments })
            .collect(),
        categories,
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

    fn table() -> LabelTable {
        let names = [
            "<UNK>_0_<UNK>_0_0",
            "ceiling_1_office_1_1",
            "chair_1_office_1_1",
            "chair_2_office_1_1",
            "wall_1_office_1_1",
            "wall_2_office_1_1",
        ];
        LabelTable::from_names(&names.map(String::from)).unwrap()
    }

    fn pixel(index: u32) -> [u8; 3] {
        let [_, r, g, b] = index.to_be_bytes();
        [r, g, b]
    }

    fn id_of([r, g, b]: [u8; 3]) -> u32 {
        u32::from(r) + 256 * u32::from(g) + 65_536 * u32::from(b)
    }

    fn segment(id: u32, category_id: u32, area: u64, bbox: [u32; 4]) -> CocoSegment {
        CocoSegment { id, category_id, area, bbox, iscrowd: 0 }
    }

    #[test]
    fn segments_cover_their_pixels() {
        let [m, w, v, c] = [MISSING, pixel(4), pixel(5), pixel(2)];
        let semantic = Raster::from_vec(4, 3, vec![m, w, w, v, c, [0; 3], w, c, m, m, c, c]);
        let (image, segments) = coco_panoptic(&semantic, &table(), &[Class::WALL]).unwrap();
        let wall = FIRST_STUFF_ID + 3;
        let ids: Vec<u32> = image.pixels().iter().map(|p| id_of(*p)).collect();
        assert_eq!(ids, [0, wall, wall, wall, 2, 0, wall, 2, 0, 0, 2, 2]);
        assert_eq!(segments, [segment(2, 9, 4, [0, 1, 4, 2]), segment(wall, 3, 4, [1, 0, 3, 2])]);
        // Each wall is a segment of its own.
        let (_, segments) = coco_panoptic(&semantic, &table(), &[]).unwrap();
        assert_eq!(segments.iter().map(|s| (s.id, s.area)).collect::<Vec<_>>(), [(2, 4), (4, 3), (5, 1)]);
    }

    #[test]
    fn a_label_beyond_the_table_is_told() {
        let semantic = Raster::from_vec(2, 2, vec![[0; 3], [0; 3], [0; 3], pixel(6)]);
        let e = coco_panoptic(&semantic, &table(), &[]).unwrap_err();
        assert_eq!(e.to_string(), "pixel (1, 1) has label 6, but there are 6 labels");
    }

    proptest! {
        #[test]
        fn areas_and_boxes_are_those_of_the_image(
            labels in prop::collection::vec(0u32..7, 1..200),
            width in 1usize..20,
        ) {
            let height = labels.len().div_ceil(width);
            let mut pixels: Vec<[u8; 3]> =
                labels.iter().map(|l| if *l == 6 { MISSING } else { pixel(*l) }).collect();
            pixels.resize(width * height, MISSING);
            let semantic = Raster::from_vec(width as u32, height as u32, pixels);
            let (image, segments) = coco_panoptic(&semantic, &table(), &[Class::WALL]).unwrap();
            let mut seen = 0;
            for s in &segments {
                let at: Vec<(u32, u32)> = (0..image.height())
                    .flat_map(|y| (0..image.width()).map(move |x| (x, y)))
                    .filter(|(x, y)| id_of(image.at(*x, *y)) == s.id)
                    .collect();

                let x0 = at.iter().map(|p| p.0).min().unwrap();
                let x1 = at.iter().map(|p| p.0).max().unwrap();
                let y0 = at.iter().map(|p| p.1).min().unwrap();
                let y1 = at.iter().map(|p| p.1).max().unwrap();
                prop_assert_eq!((s.area, s.bbox), (at.len() as u64, [x0, y0, x1 - x0 + 1, y1 - y0 + 1]));
                seen += s.area;
            }
            let void = image.pixels().iter().filter(|p| id_of(**p) == 0).count() as u64;
            prop_assert_eq!(seen + void, image.len() as u64);
            prop_assert!(segments.is_sorted_by_key(|s| s.id));
        }
    }

    #[test]
    fn the_file_has_cocos_keys() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("panoptic.json");
        let segment = CocoSegment { id: 2, category_id: 9, area: 4, bbox: [0, 1, 4, 2], iscrowd: 0 };
        let image = CocoImage {
            id: 1,
            file_name: "a.png".into(),
            width: 4,
            height: 3,
            segments: vec![segment],
            masks: BTreeMap::new(),
        };
        let categories = coco_categories(&Taxonomy::s3dis(), &[Class::WALL, Class::FLOOR]);
        write_coco(&path, "demo", &[image], &categories).unwrap();
        let json: serde_json::Value = crate::fs::json::read_json(&path).unwrap();
        assert_eq!(json["images"][0]["file_name"], json["annotations"][0]["file_name"]);
        assert_eq!(json["annotations"][0]["segments_info"][0]["bbox"], serde_json::json!([0, 1, 4, 2]));
        let things: Vec<u64> = json["categories"]
            .as_array()
            .unwrap()
            .iter()
            .map(|c| c["isthing"].as_u64().unwrap())
            .collect();
        assert_eq!(things, [1, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]);
        assert_eq!(
            (&json["categories"][8]["name"], &json["categories"][8]["id"]),
            (&"chair".into(), &9.into())
        );
        // The numbers of stuff belong to no label, and fit into three bytes.
        assert!(FIRST_STUFF_ID as usize > s3d_label::MAX_LABELS && FIRST_STUFF_ID + 13 < 1 << 24);
    }
}
