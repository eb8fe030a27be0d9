//! `s3d export`: scenes to a data set.

use super::on_threads;
use crate::args::ExportArgs;
use crate::failure::Outcome;
use crate::pipeline::plan::Plan;
use crate::pipeline::{Target, export, export_shard};
use s3d_io::Layout;
use std::path::{Path, PathBuf};

pub(crate) fn run(args: ExportArgs) -> Outcome<()> {
    let output = args.output.unwrap_or_else(|| default_output(&args.scenes[0]));
    let target = Target { layout: Layout::new(output), overwrite: args.overwrite, allowed: &[] };
    let options = args.options.canonical();
    let plan = args.plan.as_deref().map(Plan::open).transpose()?;
    on_threads(args.threads, || match args.shard {
        Some(shard) => export_shard(&args.scenes, &target, &options, shard, plan.as_ref()),
        None => export(&args.scenes, &target, &options, plan.as_ref()),
    })
}

/// The data set's folder if none is given: beside the scene file, named after it.
fn default_output(scene: &Path) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or("scene".as_ref()).to_owned();
    name.push("_2d3ds");
    scene.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_lies_beside_the_scene() {
        assert_eq!(default_output(Path::new("a/scan.toml")), Path::new("a/scan_2d3ds"));
        assert_eq!(default_output(Path::new("scene.toml")), Path::new("scene_2d3ds"));
    }
}
