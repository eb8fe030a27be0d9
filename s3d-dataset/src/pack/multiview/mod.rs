//! Packages for trainers of networks that see several views of a scene at once: pinhole views with depth,
//! poses and how much each sees of what another sees.

pub(super) mod dust3r;
pub(super) mod vggt;
pub(super) mod wai;

use crate::context::{Context, Progress};
use crate::error::Result;
use crate::pack::options::PackageKind;
use crate::pack::source::Source;
use crate::pairs::{PairsOptions, of_images};
use crate::parallel::map_in_order;
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, PairColumns, read_pairs};
use std::collections::BTreeMap;

/// The quality of JPEG files, of 100.
const QUALITY: u8 = 95;

/// The camera of a view.
pub(super) struct View<'a> {
    pub(super) image: &'a DatasetImage,
    /// Width and height in pixels.
    pub(super) size: (u32, u32),
    /// Focal lengths and principal point in pixels; the centre of the first pixel is (0.5, 0.5).
    pub(super) k: [[f64; 3]; 3],
    /// World → camera in OpenCV's axes.
    pub(super) camera_from_world: [[f64; 4]; 3],
}

impl View<'_> {
    /// Returns camera → world in OpenCV's axes, with the row (0, 0, 0, 1).
    pub(super) fn world_from_camera(&self) -> [[f64; 4]; 4] {
        let [x, y, z] = self.camera_from_world;
        let row = |i: usize| {
            let centre = -(x[i] * x[3] + y[i] * y[3] + z[i] * z[3]);
            [x[i], y[i], z[i], centre]
        };
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    /// Returns the camera matrix of loaders whose first pixel has its centre at (0, 0).
    fn k_from_pixel_centres(&self) -> [[f64; 3]; 3] {
        let mut k = self.k;
        k[0][2] -= 0.5;
        k[1][2] -= 0.5;
        k
    }
}

/// Fails if images lack what all these packages need.
fn require(source: &Source, kind: PackageKind) -> Result<()> {
    [Domain::Rgb, Domain::Depth, Domain::Pose]
        .into_iter()
        .try_for_each(|domain| source.require(domain, kind.title()))
}

/// Returns the views of an area.
pub(super) fn views_of(source: &Source, area: u32) -> Result<Vec<View<'_>>> {
    let of = |image| {
        let pose = source.data.pose(image)?;
        let (k, camera_from_world) = (pose.camera_k_matrix, pose.camera_rt_matrix);
        Ok(View { image, size: source.size(image)?, k, camera_from_world })
    };
    source.of_area(area).into_iter().map(of).collect()
}

/// Writes the files of views on all threads. Returns what `write` makes of each, in their order.
fn write_each<T: Send + Sync>(
    ctx: &Context,
    views: &[View<'_>],
    progress: &Progress<'_>,
    write: impl Fn(&View<'_>) -> Result<T> + Sync,
) -> Result<Vec<T>> {
    map_in_order(
        ctx,
        views,
        || (),
        |(), view| {
            let made = write(view)?;
            progress.add(1);
            Ok(made)
        },
    )
}

/// Returns the depth of a view in metres, 0 where it is missing or the view's photograph has no colour.
pub(super) fn depth_m(source: &Source, view: &View<'_>) -> Result<Raster<f32>> {
    let depth = known_depth(source, view)?;
    let units_per_m = source.depth_units_per_m;
    Ok(depth.map(|depth| depth.map_or(0.0, |units| (f64::from(units) / units_per_m) as f32)))
}

/// Returns the depth of a view in millimetres, rounded; 0 where it is missing, beyond 65.535 m, or the view's
/// photograph has no colour.
fn depth_mm(source: &Source, view: &View<'_>) -> Result<Raster<u16>> {
    let depth = known_depth(source, view)?;
    let mm_per_unit = 1000.0 / source.depth_units_per_m;
    Ok(depth.map(|depth| {
        let mm = depth.map_or(0.0, |units| (f64::from(units) * mm_per_unit).round());
        if mm > f64::from(u16::MAX) { 0 } else { mm as u16 }
    }))
}

/// Returns the depth of a view in the data set's units, `None` where there is none for a trainer.
fn known_depth(source: &Source, view: &View<'_>) -> Result<Raster<Option<u16>>> {
    let mut depth = source
        .depth(view.image)?
        .map(|units| (units != s3d_render::MISSING_DEPTH).then_some(units));
    if source
        .photograph(view.image)
        .is_some_and(|photograph| photograph.masked > 0.0)
    {
        let colors = source.rgb8(view.image, Domain::Rgb)?;
        for (depth, color) in depth.pixels_mut().iter_mut().zip(colors.pixels()) {
            if *color == [0; 3] {
                *depth = None;
            }
        }
    }
    Ok(depth)
}

/// The share of a view's points that another view sees, too: two views by their places in a list, and the
/// share. Both directions are there, sorted by the first view and then the other.
type Overlaps = Vec<(usize, usize, f32)>;

/// Returns the overlaps of the views of an area: from `pairs.npz` if the data set has it, or else from the
/// mesh, as `s3d pairs` finds them.
fn overlaps(ctx: &Context, source: &Source, area: u32, views: &[View<'_>]) -> Result<Overlaps> {
    let path = source.data.layout.pairs_npz(area);
    let pairs = if source.data.files.record(&path).is_ok() {
        read_pairs(source.data.files.checked(&path)?)?
    } else {
        ctx.info(format_args!("area {area}: {} is not there: finding its pairs", path.display()));
        let images: Vec<DatasetImage> = views.iter().map(|view| view.image.clone()).collect();
        of_images(ctx, &source.data, area, &images, &PairsOptions::default())?
    };

    let places: BTreeMap<String, usize> = views
        .iter()
        .enumerate()
        .map(|(i, view)| (view.image.pair_name(), i))
        .collect();
    let place: Vec<Option<usize>> = pairs.images.iter().map(|name| places.get(name).copied()).collect();
    if place.iter().flatten().count() < views.len() {
        let message = "some views of the area are not in it: make the pairs again";
        return Err(FileError::format(&path, message).into());
    }
    Ok(among(&pairs, &place))
}

/// Returns the pairs of images that have a place.
fn among(pairs: &PairColumns, place: &[Option<usize>]) -> Overlaps {
    let mut all = Overlaps::new();
    for (from, ends) in place.iter().zip(pairs.start.windows(2)) {
        let (Some(from), &[start, end]) = (from, ends) else { continue };
        for i in start as usize..end as usize {
            if let Some(to) = place[pairs.other[i] as usize] {
                all.push((*from, to, pairs.overlap[i]));
            }
        }
    }
    all.sort_by_key(|(from, to, _)| (*from, *to));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_keep_their_direction_among_the_views() {
        let pairs = PairColumns {
            images: ["data/a", "pano/b", "data/c"].map(String::from).to_vec(),
            start: vec![0, 2, 3, 5],
            other: vec![1, 2, 0, 0, 1],
            overlap: vec![0.1, 0.2, 0.3, 0.4, 0.5],
            ..PairColumns::default()
        };
        assert_eq!(among(&pairs, &[Some(1), None, Some(0)]), [(0, 1, 0.4), (1, 0, 0.2)]);
    }
}
