//! `s3d demo`: the built-in scene, or generated areas to train on, written as ordinary input files and
//! exported like any others.

use super::on_threads;
use crate::args::Threads;
use crate::failure::{Failure, Outcome};
use crate::values::{even_width, parsed, positive};
use clap::{Args, value_parser};
use s3d_dataset::{Context, Error, Export, ExportOptions};
use s3d_io::dataset::Layout;
use s3d_io::image::Compression;
use s3d_synth::{
    AnnotatedScene, Building, BuildingError, BuildingOptions, ScanError, ScanOptions, SightOptions,
    is_area_scan, is_demo_scan,
};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use tracing::info;

/// The folder of the scene's own files in OUT.
const SCAN: &str = "scan";

/// The folder of the scene's own files while they are written.
const SCAN_PART: &str = ".s3d-scan.part";

#[derive(Debug, Args)]
pub(crate) struct DemoArgs {
    /// The folder to make. The scene's own files are in OUT/scan.
    #[arg(short, long, value_name = "OUT", default_value = "s3d-demo")]
    pub(crate) output: PathBuf,
    /// Make the first N of six generated areas to train on, instead of the built-in scene. They depend on
    /// --seed. All six have 264 rooms in three buildings (areas 1, 3, 6; 2, 4; 5); rooms and objects are as
    /// frequent as in 2D-3D-S. Their files are in OUT/scan/area_K.
    #[arg(long, value_name = "N",
        value_parser = value_parser!(u32).range(1..=i64::from(BuildingOptions::AREAS)))]
    pub(crate) areas: Option<u32>,
    /// Make no images, only meshes, points, labels and tables.
    #[arg(long, conflicts_with_all = ["views", "size", "pano_width"])]
    pub(crate) no_images: bool,
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
    /// The number of candidate views at each scan location [default: 24, or 4 with --areas]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..=100_000))]
    pub(crate) views: Option<u32>,
    /// Width and height of a view in pixels [default: 540, or 256 with --areas]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(8..=16_384))]
    pub(crate) size: Option<u32>,
    /// Width of a panorama in pixels, an even number; its height is half of that [default: 2048, or 1024 with
    /// --areas]
    #[arg(long, value_name = "PX", value_parser = even_width)]
    pub(crate) pano_width: Option<u32>,
    /// The source of everything random.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Points per m² of the point cloud and, with --areas, of the scan as well [default: 2500, or 400 with
    /// --areas]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub(crate) points_per_m2: Option<f64>,
    /// Compression of the image files: fast, balanced (about as small as files by libpng and OpenEXR) or
    /// small (slowest). The pixels are the same.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
}

impl DemoArgs {
    fn export_options(&self) -> ExportOptions {
        let SizeArgs { views, size, pano_width, seed, points_per_m2, compression } = self.options;
        let is_generated = self.areas.is_some();
        let all = ExportOptions {
            views: views.unwrap_or(if is_generated { 4 } else { 24 }),
            size: size.unwrap_or(if is_generated { 256 } else { 540 }),
            pano_width: pano_width.unwrap_or(if is_generated { 1024 } else { 2048 }),
            seed,
            points_per_m2: points_per_m2.unwrap_or(if is_generated { 400.0 } else { 2500.0 }),
            compression,
            ..ExportOptions::default()
        };
        if self.no_images {
            ExportOptions { views: 0, modalities: Vec::new(), ..all }
        } else {
            all
        }
    }
}

/// A scene that the demo writes.
struct Scene {
    folder: PathBuf,
    /// The number of a generated area; the built-in scene has none.
    area: Option<u32>,
}

impl Scene {
    /// The name of the scene in messages.
    fn name(&self) -> String {
        self.area
            .map_or("the built-in scene".to_owned(), |area| format!("the generated area {area}"))
    }

    /// Whether a demo made the folder, so that it may be written again.
    fn is_ours(&self) -> bool {
        if self.area.is_some() {
            is_area_scan(&self.folder)
        } else {
            is_demo_scan(&self.folder)
        }
    }

    /// Makes the scene, and says how it is scanned.
    fn make(&self, options: &ExportOptions) -> Result<(AnnotatedScene, ScanOptions), BuildingError> {
        match self.area {
            None => Ok((Building::demo().build()?, ScanOptions::default())),
            Some(area) => generated(area, options),
        }
    }
}

/// Generates an area, and returns its visible part with the options of its scan.
fn generated(area: u32, options: &ExportOptions) -> Result<(AnnotatedScene, ScanOptions), BuildingError> {
    let building = Building::generate(&BuildingOptions::area(area, options.seed)?)?;
    let sight = SightOptions::default();
    let seen = building.build()?.seen(&sight)?;
    let scan = ScanOptions {
        points_per_m2: options.points_per_m2,
        seed: ScanOptions::default().seed.wrapping_add(options.seed),
        area,
        sight: Some(sight),
        ..ScanOptions::default()
    };
    Ok((seen, scan))
}

pub(crate) fn run(args: DemoArgs) -> Outcome<()> {
    let options = args.export_options();
    let output = args.output;
    let scan = output.join(SCAN);
    let scenes: Vec<Scene> = match args.areas {
        None => vec![Scene { folder: scan, area: None }],
        Some(areas) => (1..=areas)
            .map(|area| Scene { folder: scan.join(format!("area_{area}")), area: Some(area) })
            .collect(),
    };
    let export = Export::new(scenes.iter().map(|scene| scene.folder.join("scene.toml")))
        .options(options.clone())
        .overwrite(args.overwrite)
        .allow(SCAN)
        .allow(SCAN_PART);

    on_threads(args.threads, |context| {
        Ok(make(&scenes, &export, &output, &options, args.overwrite, context))
    })??;

    let layout = Layout::new(output);
    let pano = layout.area_dir(1).join("pano");
    let tables = layout.statistics_md();
    if args.no_images {
        info!("look at {}", tables.display());
    } else {
        info!("look at {} and {}", pano.display(), tables.display());
    }
    Ok(())
}

/// Writes the scenes and exports them.
fn make(
    scenes: &[Scene],
    export: &Export,
    output: &Path,
    options: &ExportOptions,
    overwrite: bool,
    context: &Context,
) -> Outcome<()> {
    // Nothing is written before every folder is found fit.
    export.check_output(output, context)?;
    for scene in scenes {
        if scene.folder.exists() && !scene.is_ours() {
            return Err(Failure::Usage(format!(
                "{} is there and is not {}: choose another folder",
                scene.folder.display(),
                scene.name()
            )));
        }
    }

    for scene in scenes {
        context.check()?;
        let unfit = |e: &dyn Display| Failure::Input(format!("{}: {e}", scene.folder.display()));
        let (made, scan) = scene.make(options).map_err(|e| unfit(&e))?;
        made.put_scan(&scene.folder, &output.join(SCAN_PART), &scan, overwrite, || {
            !context.cancel.is_cancelled()
        })
        .map_err(|e| match e {
            ScanError::File(e) => e.into(),
            ScanError::Cancelled => Error::Cancelled.into(),
            ScanError::Differs(folder) => Failure::Usage(format!(
                "{} is there and differs from {}: choose another folder, or replace it with --overwrite",
                folder.display(),
                scene.name()
            )),
            other => unfit(&other),
        })?;
        info!("{} is in {}", scene.name(), scene.folder.display());
    }
    export.run(output, context)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Command;

    #[test]
    fn every_option_of_an_export_is_offered_or_left_at_its_default() {
        let left_out = [
            "place_cameras",
            "see",
            "pool",
            "lenient",
            "fill",
            "trim_strays",
            "entropy_stride",
            "modalities",
            "keep_all",
            "only",
            "normals",
            "rgb_samples",
            "semantic_glb",
            "xyz",
            "normal_axes",
            "depth_units",
            "pad_labels",
            "profiles",
            "allow",
        ];
        let demo = SizeArgs::augment_args(Command::new("demo"));
        let export = ExportOptions::augment_args(Command::new("export"));

        for offered in demo.get_arguments() {
            let of_export = export
                .get_arguments()
                .find(|argument| argument.get_id() == offered.get_id());
            let of_export = of_export.unwrap();
            assert_eq!(offered.get_long(), of_export.get_long());
            assert_eq!(offered.get_value_names(), of_export.get_value_names());
        }

        let offered = demo.get_arguments().map(|argument| argument.get_id().as_str());
        let mut known: Vec<&str> = left_out.into_iter().chain(offered).collect();
        known.sort_unstable();
        let mut options: Vec<&str> = export.get_arguments().map(|a| a.get_id().as_str()).collect();
        options.sort_unstable();
        assert_eq!(known, options);
    }
}
