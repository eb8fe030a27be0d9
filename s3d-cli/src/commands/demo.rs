//! `s3d demo`: the built-in scene, written as ordinary input files and exported like any other.

use super::on_threads;
use crate::args::{DemoArgs, ExportOptions, FormatOptions};
use crate::demo::{is_demo_scan, write_scan};
use crate::failure::{Failure, Outcome};
use crate::pipeline::{Target, export, output};
use s3d_io::{Domain, Layout};
use s3d_sample::Pool;
use tracing::info;

/// Folder of the scene's own files in OUT.
const SCAN: &str = "scan";

pub(crate) fn run(args: DemoArgs) -> Outcome<()> {
    let layout = Layout::new(args.output.clone());
    output::check(&layout, args.overwrite, &[])?;
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
        let scene = write_scan(&scan)?;
        info!("the built-in scene is in {}", scan.display());
        let target = Target { layout: layout.clone(), overwrite: args.overwrite, allowed: &[SCAN] };
        export(&[scene], &target, &options)?;
        info!(
            "look at {} and {}",
            layout.area_dir(1).join("pano").display(),
            layout.statistics_md().display()
        );
        Ok(())
    })
}
