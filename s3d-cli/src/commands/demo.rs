//! `s3d demo`: the built-in scene, written as ordinary input files and exported like any other.

use super::on_threads;
use crate::args::Threads;
use crate::failure::Outcome;
use crate::values::{even_width, parsed, positive};
use clap::{Args, value_parser};
use s3d_dataset::{Cancel, Error, Export, ExportOptions, Result};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::image::Compression;
use s3d_synth::{Building, ScanError, ScanOptions, is_demo_scan};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use tracing::info;

/// Folder of the scene's own files in OUT.
const SCAN: &str = "scan";

/// The same while they are written.
const SCAN_PART: &str = ".s3d-scan.part";

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// The folder to make; the scene's own files come to OUT/scan.
    #[arg(short, long, value_name = "OUT", default_value = "s3d-demo")]
    pub(crate) output: PathBuf,
    /// Replace an earlier data set in OUT.
    #[arg(long)]
    pub(crate) overwrite: bool,
    #[command(flatten)]
    pub(crate) options: SizeArgs,
    #[command(flatten)]
    pub(crate) threads: Threads,
}

/// The demo's options are the export's, at a reduced size.
#[derive(Clone, Debug, Args)]
pub(crate) struct SizeArgs {
    /// Candidate views a scan location.
    #[arg(long, value_name = "N", default_value_t = 24, value_parser = value_parser!(u32).range(0..=100_000))]
    pub(crate) views: u32,
    /// Width and height of a view in pixels.
    #[arg(long, value_name = "PX", default_value_t = 540,
        value_parser = value_parser!(u32).range(8..=16_384))]
    pub(crate) size: u32,
    /// Width of a panorama in pixels, even; it is half as high.
    #[arg(long, value_name = "PX", default_value_t = 2048, value_parser = even_width)]
    pub(crate) pano_width: u32,
    /// Everything random comes from it.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Density of the point cloud.
    #[arg(long, value_name = "N", default_value_t = 2500.0, value_parser = positive)]
    pub(crate) points_per_m2: f64,
    /// How much time the images' files may take: fast, balanced (about the size that libpng and OpenEXR make
    /// them) or small (slowest). The pixels are the same.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
}

pub(crate) fn run(args: DemoArgs) -> Outcome<()> {
    let SizeArgs { views, size, pano_width, seed, points_per_m2, compression } = args.options;
    let options = ExportOptions {
        views,
        size,
        pano_width,
        seed,
        points_per_m2,
        compression,
        ..ExportOptions::default()
    };
    let output = args.output;
    let scan = output.join(SCAN);
    let export = Export::new([scan.join("scene.toml")])
        .options(options)
        .overwrite(args.overwrite)
        .allow(SCAN)
        .allow(SCAN_PART);
    on_threads(args.threads, |context| {
        export.check_output(&output, context)?;
        if scan.exists() && !is_demo_scan(&scan) {
            return Err(Error::Usage(format!(
                "{} is there and is not the built-in scene: choose another folder",
                scan.display()
            )));
        }
        let part = output.join(SCAN_PART);
        remove(&part)?;
        write_scan(&part, &context.cancel)?;
        put(&part, &scan, args.overwrite, &context.cancel)?;
        info!("the built-in scene is in {}", scan.display());
        export.run(&output, context)?;
        let layout = Layout::new(output);
        let (pano, tables) = (layout.area_dir(1).join("pano"), layout.statistics_md());
        info!("look at {} and {}", pano.display(), tables.display());
        Ok(())
    })
}

fn write_scan(folder: &Path, cancel: &Cancel) -> Result<PathBuf> {
    let scene = Building::demo().build().map_err(|e| Error::Input(e.to_string()))?;
    scene.write_scan(folder, &ScanOptions::default(), || !cancel.is_cancelled()).map_err(|e| match e {
        ScanError::File(e) => e.into(),
        ScanError::Cancelled => Error::Cancelled,
        other => Error::Input(other.to_string()),
    })
}

/// Gives the scene its place. One that is there already, of a demo that was stopped, may stay if it is the
/// same to the byte: somebody may have changed it since.
fn put(part: &Path, scan: &Path, overwrite: bool, cancel: &Cancel) -> Result<()> {
    if scan.exists() {
        if same(part, scan).map_err(|e| FileError::io(scan, "read", e))? {
            return remove(part);
        }
        if !overwrite {
            remove(part)?;
            return Err(Error::Usage(format!(
                "{} is there and differs from the built-in scene: choose another folder, or replace it with \
                 --overwrite",
                scan.display()
            )));
        }
        // Whatever else is in it stays.
        remove(part)?;
        write_scan(scan, cancel)?;
        return Ok(());
    }
    Ok(fs::rename(part, scan).map_err(|e| FileError::io(scan, "move the scene to", e))?)
}

/// Whether every file and folder of `a` is in `b` with the same bytes.
fn same(a: &Path, b: &Path) -> io::Result<bool> {
    if !a.is_dir() {
        return Ok(b.is_file() && fs::read(a)? == fs::read(b)?);
    }
    for entry in fs::read_dir(a)? {
        let entry = entry?;
        if !same(&entry.path(), &b.join(entry.file_name()))? {
            return Ok(false);
        }
    }
    Ok(true)
}

fn remove(folder: &Path) -> Result<()> {
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(FileError::io(folder, "remove", e).into()),
        _ => Ok(()),
    }
}
