//! Packages for trainers, each made from the files of a data set.

mod coco;
mod colmap;
mod destination;
mod nerfstudio;
mod options;
mod parquet;
mod source;
mod webdataset;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::store::new_file::NewFile;
use crate::store::new_folder::{beside, check_apart};
use crate::store::parent_of;
use destination::{About, Destination};
pub use options::{
    ClassList, DepthFiles, PackOptions, PackageKind, PackedImages, ShardPrefix, SpecificOptions,
};
use s3d_geom::PointCloud;
use s3d_io::fs::create_dir;
use source::Source;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Points of an area's cloud in a package, if nothing else is said.
const POINTS: u32 = 100_000;

/// Makes a package of the data set in the folder `dataset`, in which nothing is altered. Returns where it is.
///
/// # Errors
/// [`Error::Usage`] if options exclude each other or something is in the way; [`Error::Input`] if the data
/// set lacks what the package needs; [`Error::File`]; [`Error::Cancelled`]; [`Error::Temporary`]. No half of
/// a package is left behind.
pub fn pack(dataset: &Path, kind: PackageKind, options: &PackOptions, ctx: &Context) -> Result<PathBuf> {
    let started = Instant::now();
    options.specific.check(kind)?;
    let which = which_images(ctx, kind, options.images)?;
    let source = Source::open(ctx, dataset, &options.areas, which)?;
    let place = match &options.output {
        Some(place) => place.clone(),
        None => default_place(dataset, kind)?,
    };
    if kind == PackageKind::Parquet {
        check_apart(&place, dataset)?;
        NewFile::check_free(&place, options.overwrite)?;
        create_dir(&parent_of(&place))?;
        let table = NewFile::begin(ctx, &place, options.overwrite)?;
        parquet::pack(ctx, &source, table.path())?;
        table.finish()?;
        source.frame_notes().iter().for_each(|note| ctx.info(note));
    } else {
        let destination = Destination::begin(ctx, &place, dataset, options.overwrite)?;
        let mut notes = match kind {
            PackageKind::Webdataset => webdataset::pack(ctx, &source, &destination, &options.specific)?,
            PackageKind::Colmap => colmap::pack(ctx, &source, &destination, &options.specific)?,
            PackageKind::Nerfstudio => nerfstudio::pack(ctx, &source, &destination, &options.specific)?,
            _ => coco::pack(ctx, &source, &destination, &options.specific)?,
        };
        notes.extend(source.frame_notes());
        notes.iter().for_each(|note| ctx.info(note));
        let about = About::new(kind.to_string(), &source.areas, source.images.len(), notes);
        destination.finish(&about)?;
    }
    ctx.info(format_args!(
        "{}: {} images for {} in {:.1} s",
        place.display(),
        source.images.len(),
        kind,
        started.elapsed().as_secs_f64()
    ));
    Ok(place)
}

/// The images that a package holds.
fn which_images(ctx: &Context, kind: PackageKind, images: Option<PackedImages>) -> Result<PackedImages> {
    match (kind, images) {
        (PackageKind::Colmap, Some(PackedImages::Panoramas)) => Err(Error::Usage(
            "--images panoramas: COLMAP's cameras are pinholes, and panoramas are none: take --to nerfstudio"
                .into(),
        )),
        (PackageKind::Colmap, which) => {
            if which == Some(PackedImages::All) {
                ctx.warn(format_args!("panoramas are left out: COLMAP's cameras are pinholes"));
            }
            Ok(PackedImages::Views)
        }
        (_, which) => Ok(which.unwrap_or(PackedImages::All)),
    }
}

/// Where a package goes if nothing is said: beside the data set, named after it.
fn default_place(dataset: &Path, kind: PackageKind) -> Result<PathBuf> {
    match kind {
        PackageKind::Parquet => beside(dataset, "_images.parquet"),
        kind => beside(dataset, &format!("_{kind}")),
    }
}

/// Some points of an area's cloud; none if none are asked for.
fn area_points(source: &Source, area: u32, max: Option<u32>) -> Result<PointCloud> {
    match max.unwrap_or(POINTS) {
        0 => Ok(PointCloud::default()),
        max => source.points(area, max as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_lies_beside_the_data_set() {
        let place = |path: &str, kind| default_place(Path::new(path), kind).unwrap();
        assert_eq!(place("a/data", PackageKind::Colmap), Path::new("a/data_colmap"));
        assert_eq!(place("data/", PackageKind::Parquet), Path::new("data_images.parquet"));
        let here = std::env::current_dir().unwrap();
        let name = format!("{}_coco", here.file_name().unwrap().to_str().unwrap());
        assert_eq!(place(".", PackageKind::Coco), here.canonicalize().unwrap().with_file_name(name));
    }
}
