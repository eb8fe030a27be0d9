//! Packages for trainers, each made from the files of a data set.

mod coco;
mod colmap;
mod concerto;
mod destination;
mod habitat;
mod huggingface;
mod multiview;
mod nerfstudio;
mod object_table;
mod options;
mod parquet;
mod pointcept;
mod scene_graph;
mod scenes;
mod source;
mod spatial_qa;
mod usd;
mod webdataset;

use crate::context::Context;
#[cfg(doc)]
use crate::error::Error;
use crate::error::Result;
use crate::record::data_set::DataSet;
use crate::store::new_file::NewFile;
use crate::store::new_folder::{beside, check_apart};
use crate::store::parent_of;
use destination::{About, Destination};
pub use options::{
    ClassList, CocoOptions, ColmapOptions, DepthFiles, HuggingfaceOptions, NerfstudioOptions,
    ObjectTableOptions, PackOptions, Package, PackageArguments, PackageKind, PackedImages, ParquetOptions,
    SceneGraphOptions, ShardPrefix, WebdatasetOptions,
};
use s3d_geom::PointCloud;
use s3d_io::fs::create_dir;
pub use scenes::{default_output, pack_scenes};
use source::Source;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The default number of points of an area's cloud in a package.
const POINTS: u32 = 100_000;

/// Makes a package of the data set in the folder `dataset`, which is not changed. Returns the place of the
/// package.
///
/// # Errors
/// [`Error::Usage`] if something is in the way; [`Error::Input`] if the data set lacks what the package
/// needs; [`Error::File`]; [`Error::Cancelled`]; [`Error::Temporary`]. A failed run leaves no partial
/// package.
pub fn pack(dataset: &Path, package: &Package, options: &PackOptions, ctx: &Context) -> Result<PathBuf> {
    let started = Instant::now();
    let kind = package.kind();
    let data = DataSet::open(dataset)?;
    let source = Source::of(ctx, data, &options.areas, package.images())?;
    let place = match &options.output {
        Some(place) => place.clone(),
        None => default_place(dataset, kind)?,
    };

    if matches!(kind, PackageKind::Parquet | PackageKind::Objects) {
        pack_table(ctx, &source, dataset, &place, kind, options.overwrite)?;
    } else {
        let destination = Destination::begin(ctx, &place, dataset, options.overwrite)?;
        fill(ctx, &source, &destination, package)?;
        destination.finish()?;
    }

    let seconds = started.elapsed().as_secs_f64();
    let what = match source.images.len() {
        0 if source.areas.len() == 1 => "an area".to_owned(),
        0 => format!("{} areas", source.areas.len()),
        images => format!("{images} images"),
    };
    ctx.info(format_args!("{}: {what} for {kind} in {seconds:.1} s", place.display()));
    Ok(place)
}

/// Writes the files of a package that is a folder.
fn fill(ctx: &Context, source: &Source, folder: &Destination, package: &Package) -> Result<()> {
    let mut notes = match package {
        Package::Webdataset(options) => webdataset::pack(ctx, source, folder, options),
        Package::Colmap(options) => colmap::pack(ctx, source, folder, options),
        Package::Nerfstudio(options) => nerfstudio::pack(ctx, source, folder, options),
        Package::Coco(options) => coco::pack(ctx, source, folder, options),
        Package::Huggingface(options) => huggingface::pack(ctx, source, folder, options),
        Package::Dust3r => multiview::dust3r::pack(ctx, source, folder),
        Package::Wai => multiview::wai::pack(ctx, source, folder),
        Package::Vggt => multiview::vggt::pack(ctx, source, folder),
        Package::Pointcept => pointcept::pack(ctx, source, folder),
        Package::SceneGraph(_) => scene_graph::pack(ctx, source, folder),
        Package::Habitat => habitat::pack(ctx, source, folder),
        Package::Usd => usd::pack(ctx, source, folder),
        Package::SpatialQa => spatial_qa::pack(ctx, source, folder),
        Package::Concerto => concerto::pack(ctx, source, folder),
        Package::Parquet(_) | Package::Objects(_) => unreachable!("a table is a file"),
    }?;
    notes.extend(source.frame_notes());
    notes.iter().for_each(|note| ctx.info(note));
    folder.describe(&About::new(package.kind().to_string(), &source.areas, source.images.len(), notes))
}

/// Writes a Parquet table of all images, or of their objects: a file instead of a folder.
fn pack_table(
    ctx: &Context,
    source: &Source,
    dataset: &Path,
    place: &Path,
    kind: PackageKind,
    overwrite: bool,
) -> Result<()> {
    check_apart(place, dataset)?;
    NewFile::check_free(place, overwrite)?;
    create_dir(&parent_of(place))?;
    let table = NewFile::begin(ctx, place, overwrite)?;
    match kind {
        PackageKind::Objects => object_table::pack(ctx, source, table.path()),
        _ => parquet::pack(ctx, source, table.path()),
    }?;
    table.finish()?;
    source.frame_notes().iter().for_each(|note| ctx.info(note));
    Ok(())
}

/// The default place of a package: beside the data set, named after it.
fn default_place(dataset: &Path, kind: PackageKind) -> Result<PathBuf> {
    match kind {
        PackageKind::Parquet => beside(dataset, "_images.parquet"),
        PackageKind::Objects => beside(dataset, "_objects.parquet"),
        kind => beside(dataset, &format!("_{kind}")),
    }
}

/// Some points of an area's cloud; none if `max` is 0.
fn area_points(source: &Source, area: u32, max: Option<u32>) -> Result<PointCloud> {
    match max.unwrap_or(POINTS) {
        0 => Ok(PointCloud::default()),
        max => source.points(area, max as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(path: &str, kind: PackageKind) -> PathBuf {
        default_place(Path::new(path), kind).unwrap()
    }

    #[test]
    fn the_default_lies_beside_the_data_set() {
        assert_eq!(place("a/data", PackageKind::Colmap), Path::new("a/data_colmap"));
        assert_eq!(place("data/", PackageKind::Parquet), Path::new("data_images.parquet"));
        let here = std::env::current_dir().unwrap();
        let name = format!("{}_coco", here.file_name().unwrap().to_str().unwrap());
        assert_eq!(place(".", PackageKind::Coco), here.canonicalize().unwrap().with_file_name(name));
    }
}
