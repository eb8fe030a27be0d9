//! `s3d pack --to parquet`: a table of all images and what their pixels show.

use super::source::Source;
use crate::context::Context;
use crate::error::Result;
use crate::parallel::map_in_order;
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame, ViewRecord};
use s3d_io::package::{ImageRow, SemanticRow, write_image_index};
use s3d_label::{LabelId, LabelTable, UNKNOWN_ROOM};
use s3d_render::MISSING_DEPTH;
use s3d_sample::entropy;
use std::collections::BTreeMap;
use std::path::Path;

/// The colour of pixels without a surface in a semantic image.
const MISSING: [u8; 3] = [13; 3];

/// Kept views, by scan location and frame number.
type Views = BTreeMap<(String, u32), ViewRecord>;

/// Writes the table to the file `place`.
pub(super) fn pack(ctx: &Context, source: &Source, place: &Path) -> Result<()> {
    let about = Rows::new(source)?;
    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let rows = map_in_order(
        ctx,
        &source.images,
        || about.no_counts(),
        |counts, image| {
            let row = about.row(image, counts)?;
            progress.add(1);
            Ok(row)
        },
    )?;

    write_image_index(place, source.data.taxonomy.classes(), &rows)?;
    Ok(())
}

/// What the rows of images are made of.
pub(super) struct Rows<'a> {
    source: &'a Source,
    views: BTreeMap<u32, Views>,
    table: Option<LabelTable>,
}

impl<'a> Rows<'a> {
    /// Reads the views and the labels of a data set.
    pub(super) fn new(source: &'a Source) -> Result<Self> {
        let mut views: BTreeMap<u32, Views> = BTreeMap::new();
        for &area in &source.areas {
            let kept = source.data.views(area)?.into_iter().filter_map(|v| {
                let number = v.frame_num?;
                Some(((v.camera_uuid.clone(), number), v))
            });
            views.insert(area, kept.collect());
        }
        Ok(Self { source, views, table: source.data.labels()? })
    }

    /// Returns a zero for each label.
    pub(super) fn no_counts(&self) -> Vec<u64> {
        vec![0; self.table.as_ref().map_or(0, LabelTable::len)]
    }

    /// Returns the row of an image. `counts` is from [`no_counts`](Self::no_counts), and is left as it was.
    pub(super) fn row(&self, image: &DatasetImage, counts: &mut [u64]) -> Result<ImageRow> {
        row(self.source, image, &self.views[&image.area], self.table.as_ref(), counts)
    }
}

/// The row of an image. `counts` has an entry for each label, all 0, and is left so.
fn row(
    source: &Source,
    image: &DatasetImage,
    views: &Views,
    table: Option<&LabelTable>,
    counts: &mut [u64],
) -> Result<ImageRow> {
    let path = |domain| image.path(&source.data.layout, domain);

    // Reading the data set accepts any word for a room's type. Only the words of the taxonomy and the one for
    // unknown rooms are valid here.
    let (room_type, room_number) = match source.data.taxonomy.room(&image.room) {
        Ok(room) => (room.room_type.name(), room.number),
        Err(_) if table.is_none() && image.room == UNKNOWN_ROOM => ("unknown", 1),
        Err(e) => {
            return Err(FileError::format(&path(image.domains[0]), format!("in the file's name: {e}")).into());
        }
    };

    let mut row = ImageRow {
        area: image.area,
        camera_uuid: image.uuid.clone(),
        room: image.room.clone(),
        room_type: room_type.to_owned(),
        room_number,
        files: Domain::ALL.map(|d| image.has(d).then(|| image.relative_path(d))),
        size: source.data.size_of(image)?.map(|(w, h)| [w, h]),
        photograph: source.photograph(image).map(|p| p.name.clone()),
        ..ImageRow::default()
    };

    let view = match image.frame {
        Frame::View(number) => {
            row.frame_num = Some(number);
            views.get(&(image.uuid.clone(), number))
        }
        Frame::Panorama => None,
    };

    if image.has(Domain::Pose) {
        let pose = source.data.pose(image)?;
        row.fov_rad = Some(pose.field_of_view_rads);
        row.location = Some(pose.camera_location);
        row.k = Some(flat(&pose.camera_k_matrix));
        row.rt = Some(flat(&pose.camera_rt_matrix));
        if row.frame_num.is_some() && row.photograph.is_none() {
            let (yaw, pitch) = pose.original().yaw_pitch_to(&pose.pose());
            row.yaw_pitch_rad = Some([yaw, pitch]);
        }
    }

    if let Some(view) = view {
        row.fov_rad = Some(view.fov_rad);
        row.yaw_pitch_rad = Some([view.yaw_rad, view.pitch_rad]);
        row.selection_entropy = Some(view.entropy);
    }

    if image.has(Domain::Depth) {
        let (coverage, depth_m) = depth_row(&source.depth(image)?, source.depth_units_per_m);
        row.coverage = Some(coverage);
        row.depth_m = depth_m;
    } else if image.has(Domain::Rgb) && !image.has(Domain::Semantic) {
        row.coverage = Some(share(&source.rgb8(image, Domain::Rgb)?, |p| *p != [0; 3]));
    }

    if let Some(table) = table
        && image.has(Domain::Semantic)
    {
        // Labels have no limit of distance, but depth is missing beyond 128 m.
        let semantic = source.rgb8(image, Domain::Semantic)?;
        row.coverage = Some(share(&semantic, |p| *p != MISSING));
        let known = semantic_row(&semantic, table, counts).map_err(|index| {
            let labels = source.data.layout.labels_json();
            let message =
                format!("a pixel has label {index}, but {} holds {} labels", labels.display(), table.len());
            FileError::format(&path(Domain::Semantic), message)
        })?;
        row.semantic = Some(known);
    }

    Ok(row)
}

/// The numbers of a matrix, row by row.
fn flat<const N: usize, const M: usize, const L: usize>(matrix: &[[f64; N]; M]) -> [f64; L] {
    let flat = matrix.as_flattened();
    std::array::from_fn(|i| flat[i])
}

fn share<T: Copy>(image: &Raster<T>, is: impl Fn(&T) -> bool) -> f64 {
    image.pixels().iter().filter(|p| is(p)).count() as f64 / image.len() as f64
}

/// The share of pixels with a depth, and the least, mean and greatest depth in metres.
fn depth_row(depth: &Raster<u16>, units_per_m: f64) -> (f64, Option<[f64; 3]>) {
    let mut min = u16::MAX;
    let mut max = 0;
    let mut sum = 0u64;
    let mut count = 0u64;
    for &v in depth.pixels().iter().filter(|v| **v != MISSING_DEPTH) {
        min = min.min(v);
        max = max.max(v);
        sum += u64::from(v);
        count += 1;
    }

    let depth_m = (count > 0).then(|| {
        [f64::from(min), sum as f64 / count as f64, f64::from(max)].map(|units| units / units_per_m)
    });
    (count as f64 / depth.len() as f64, depth_m)
}

/// Counts the labels of a semantic image. `counts` has an entry for each label, all 0, and is left so. The
/// error is a label that is not in the table.
fn semantic_row(
    semantic: &Raster<[u8; 3]>,
    table: &LabelTable,
    counts: &mut [u64],
) -> Result<SemanticRow, u32> {
    let mut seen: Vec<u32> = Vec::new();
    let mut unknown = None;

    for run in semantic.pixels().chunk_by(|a, b| a == b) {
        let [r, g, b] = run[0];
        let index = u32::from_be_bytes([0, r, g, b]);
        match counts.get_mut(index as usize) {
            _ if run[0] == MISSING => {}
            Some(count) => {
                if *count == 0 {
                    seen.push(index);
                }
                *count += run.len() as u64;
            }
            None => unknown = unknown.or(Some(index)),
        }
    }

    // Only the counts of this image's labels are read, and reset to 0.
    let mut histogram = vec![0u64; table.taxonomy().classes().len()];
    let mut unlabelled = 0;
    let mut instances = 0;
    for index in seen {
        let count = std::mem::take(&mut counts[index as usize]);
        match table.class_of(LabelId(index)) {
            Some(class) => {
                histogram[class.index()] += count;
                instances += 1;
            }
            None => unlabelled += count,
        }
    }

    if let Some(index) = unknown {
        return Err(index);
    }

    let share = |count: u64| count as f64 / semantic.len() as f64;
    let shares = histogram.iter().copied().map(share).collect();
    Ok(SemanticRow { shares, unlabelled: share(unlabelled), entropy: entropy(&histogram), instances })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_counted() {
        let names = ["<UNK>_0_<UNK>_0_0", "chair_1_office_1_1", "chair_2_office_1_1", "wall_1_office_1_1"];
        let table = LabelTable::from_names(&names.map(String::from)).unwrap();
        let mut counts = vec![0; table.len()];
        let [m, n, a, b, w] = [MISSING, [0; 3], [0, 0, 1], [0, 0, 2], [0, 0, 3]];
        let semantic = Raster::from_vec(4, 2, vec![m, n, a, a, b, w, w, a]);
        let row = semantic_row(&semantic, &table, &mut counts).unwrap();
        assert_eq!((row.shares[8], row.shares[2], row.unlabelled, row.instances), (0.5, 0.25, 0.125, 3));
        let mut histogram = [0; 13];
        (histogram[8], histogram[2]) = (4, 2);
        assert_eq!((row.entropy, share(&semantic, |p| *p != m)), (entropy(&histogram), 0.875));
        assert!(counts.iter().all(|c| *c == 0));
        let semantic = Raster::from_vec(2, 1, vec![a, [0, 0, 4]]);
        assert_eq!(semantic_row(&semantic, &table, &mut counts), Err(4));
        assert!(counts.iter().all(|c| *c == 0));
    }

    #[test]
    fn depths_are_in_metres() {
        let depth = Raster::from_vec(2, 2, vec![512, MISSING_DEPTH, 1024, 0]);
        assert_eq!(depth_row(&depth, 512.0), (0.75, Some([0.0, 1.0, 2.0])));
        assert_eq!(depth_row(&Raster::filled(2, 2, MISSING_DEPTH), 1000.0), (0.0, None));
    }
}
