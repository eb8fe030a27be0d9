//! Packages for trainers, each made from the files of a data set: what `s3d pack` does.

pub(crate) mod args;
mod coco;
mod colmap;
mod destination;
mod nerfstudio;
mod parquet;
mod source;
mod webdataset;

use crate::commands::refuse_existing;
use crate::failure::{Failure, Outcome};
use crate::pipeline::work::for_each_in_order;
use args::{Kind, PackArgs, Which};
use destination::{About, Destination, check_apart, parent_of, resolved};
use s3d_geom::PointCloud;
use s3d_io::{Error, create_dir};
use source::Source;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;
use tracing::{info, warn};

/// Points of an area's cloud in a package, if nothing else is said.
const POINTS: u32 = 100_000;

/// Makes the package that is asked for.
pub(crate) fn pack(args: &PackArgs) -> Outcome<()> {
    let started = Instant::now();
    args.options.check(args.to)?;
    let which = which_images(args)?;
    let source = Source::open(&args.dataset, &args.areas, which)?;
    let place = match &args.output {
        Some(place) => place.clone(),
        None => default_place(&args.dataset, args.to)?,
    };
    if args.to == Kind::Parquet {
        check_apart(&place, &args.dataset)?;
        refuse_existing(&place, args.overwrite)?;
        create_dir(&parent_of(&place))?;
        parquet::pack(&source, &place)?;
    } else {
        let destination = Destination::begin(&place, &args.dataset, args.overwrite)?;
        let notes = match args.to {
            Kind::Webdataset => webdataset::pack(&source, &destination, &args.options)?,
            Kind::Colmap => colmap::pack(&source, &destination, &args.options)?,
            Kind::Nerfstudio => nerfstudio::pack(&source, &destination, &args.options)?,
            _ => coco::pack(&source, &destination, &args.options)?,
        };
        notes.iter().for_each(|note| info!("{note}"));
        let about = About::new(args.to.to_string(), &source.areas, source.images.len(), notes);
        destination.finish(&about)?;
    }
    info!(
        "{}: {} images for {} in {:.1} s",
        place.display(),
        source.images.len(),
        args.to,
        started.elapsed().as_secs_f64()
    );
    Ok(())
}

/// The images that a package holds.
fn which_images(args: &PackArgs) -> Outcome<Which> {
    match (args.to, args.images) {
        (Kind::Colmap, Some(Which::Panoramas)) => Err(Failure::Call(
            "--images panoramas: COLMAP's cameras are pinholes, and panoramas are none: take --to nerfstudio"
                .into(),
        )),
        (Kind::Colmap, which) => {
            if which == Some(Which::All) {
                warn!("panoramas are left out: COLMAP's cameras are pinholes");
            }
            Ok(Which::Views)
        }
        (_, which) => Ok(which.unwrap_or(Which::All)),
    }
}

/// Where a package goes if nothing is said: beside the data set, named after it.
fn default_place(dataset: &Path, kind: Kind) -> Outcome<PathBuf> {
    // The name of "." is that of the folder it is.
    let named = match dataset.file_name() {
        Some(_) => dataset.to_owned(),
        None => resolved(dataset).map_err(|e| Error::io(dataset, "look for", e))?,
    };
    let mut name = named.file_name().unwrap_or("dataset".as_ref()).to_owned();
    if kind == Kind::Parquet {
        name.push("_images.parquet");
    } else {
        name.push(format!("_{kind}"));
    }
    Ok(named.with_file_name(name))
}

/// `work` on every item on all threads; the results in the order of the items.
fn map_in_order<T: Sync, S, R: Send + Sync>(
    items: &[T],
    state: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, &T) -> Outcome<R> + Sync,
) -> Outcome<Vec<R>> {
    let results: Vec<OnceLock<R>> = items.iter().map(|_| OnceLock::new()).collect();
    let jobs: Vec<(&T, &OnceLock<R>)> = items.iter().zip(&results).collect();
    for_each_in_order(&jobs, state, |state, (item, result)| {
        let _ = result.set(work(state, item)?);
        Ok(())
    })?;
    Ok(results.into_iter().map(|r| r.into_inner().expect("every item was done")).collect())
}

/// Some points of an area's cloud; none if none are asked for.
fn area_points(source: &Source, area: u32, most: Option<u32>) -> Outcome<PointCloud> {
    match most.unwrap_or(POINTS) {
        0 => Ok(PointCloud::default()),
        most => Ok(s3d_io::read_point_sample(&source.layout.point_cloud(area), most as usize)?),
    }
}

/// Copies a file of the data set.
fn copy(from: &Path, to: &Path) -> Outcome<()> {
    let bytes = fs::read(from).map_err(|e| Error::io(from, "read", e))?;
    Ok(s3d_io::write_bytes(to, &bytes).map(drop)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_lies_beside_the_data_set() {
        let place = |path: &str, kind| default_place(Path::new(path), kind).unwrap();
        assert_eq!(place("a/data", Kind::Colmap), Path::new("a/data_colmap"));
        assert_eq!(place("data/", Kind::Parquet), Path::new("data_images.parquet"));
        let here = std::env::current_dir().unwrap();
        let name = format!("{}_coco", here.file_name().unwrap().to_str().unwrap());
        assert_eq!(place(".", Kind::Coco), here.canonicalize().unwrap().with_file_name(name));
    }

    #[test]
    fn results_are_in_order() {
        let items: Vec<u32> = (0..500).collect();
        let squares = map_in_order(&items, || (), |(), i| Ok(i * i)).unwrap();
        assert!(squares.iter().enumerate().all(|(i, s)| *s as usize == i * i));
    }
}
