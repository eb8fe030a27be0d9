//! `s3d demo`: the built-in scene, written as ordinary input files and exported like any other.

use super::on_threads;
use crate::args::{DemoArgs, ExportOptions, FormatOptions};
use crate::failure::{Failure, Outcome};
use crate::pipeline::{Target, export, output};
use crate::stop;
use s3d_io::{Domain, Error, Layout};
use s3d_sample::Pool;
use s3d_synth::{Building, ScanError, ScanOptions, is_demo_scan};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use tracing::info;

/// Folder of the scene's own files in OUT.
const SCAN: &str = "scan";

/// The same while they are written.
const SCAN_PART: &str = ".s3d-scan.part";

pub(crate) fn run(args: DemoArgs) -> Outcome<()> {
    let layout = Layout::new(args.output.clone());
    output::check(&layout, args.overwrite, &[SCAN, SCAN_PART])?;
    let o = args.options;
    let options = ExportOptions {
        views: o.views,
        size: o.size,
        pano_width: o.pano_width,
        seed: o.seed,
        pool: Pool::Dataset,
        points_per_m2: o.points_per_m2,
        place_cameras: None,
        entropy_stride: 4,
        modalities: Domain::ALL.to_vec(),
        keep_all: false,
        only: Vec::new(),
        smooth_normals: false,
        lenient: false,
        compression: o.compression,
        format: FormatOptions::default(),
    };
    let scan = args.output.join(SCAN);
    if scan.exists() && !is_demo_scan(&scan) {
        return Err(Failure::Call(format!(
            "{} is there and is not the built-in scene: choose another folder",
            scan.display()
        )));
    }
    on_threads(args.threads, || {
        let part = args.output.join(SCAN_PART);
        remove(&part)?;
        let written = write_scan(&part)?;
        put(&part, &scan, args.overwrite)?;
        let scene = scan.join(written.file_name().unwrap_or_default());
        info!("the built-in scene is in {}", scan.display());
        let target = Target { layout: layout.clone(), overwrite: args.overwrite, allowed: &[SCAN] };
        export(&[scene], &target, &options, None)?;
        info!(
            "look at {} and {}",
            layout.area_dir(1).join("pano").display(),
            layout.statistics_md().display()
        );
        Ok(())
    })
}

fn write_scan(folder: &Path) -> Outcome<PathBuf> {
    let scene = Building::demo().build().map_err(|e| Failure::Input(e.to_string()))?;
    match scene.write_scan(folder, &ScanOptions::default(), || !stop::requested()) {
        Ok(scene) => Ok(scene),
        Err(ScanError::File(e)) => Err(e.into()),
        Err(e) => {
            stop::check()?;
            Err(Failure::Input(e.to_string()))
        }
    }
}

/// Gives the scene its place. One that is there already, of a demo that was stopped, may stay if it is the same to the
/// byte: somebody may have changed it since.
fn put(part: &Path, scan: &Path, overwrite: bool) -> Outcome<()> {
    if scan.exists() {
        if same(part, scan).map_err(|e| Error::io(scan, "read", e))? {
            return remove(part);
        }
        if !overwrite {
            remove(part)?;
            return Err(Failure::Call(format!(
                "{} is there and differs from the built-in scene: choose another folder, or replace it with --overwrite",
                scan.display()
            )));
        }
        // Whatever else is in it stays.
        remove(part)?;
        return write_scan(scan).map(drop);
    }
    Ok(fs::rename(part, scan).map_err(|e| Error::io(scan, "move the scene to", e))?)
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

fn remove(folder: &Path) -> Outcome<()> {
    match fs::remove_dir_all(folder) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(Error::io(folder, "remove", e).into()),
        _ => Ok(()),
    }
}
