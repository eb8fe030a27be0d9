//! `s3d demo`: the built-in scene, or generated areas to train on, written as ordinary input files and
//! exported like any others.

use super::on_threads;
use crate::args::Threads;
use crate::failure::{Failure, Outcome};
use crate::values::{even_width, parsed, positive};
use clap::{Args, value_parser};
use s3d_dataset::{Cancel, Context, Error, Export, ExportOptions, InputError, Result};
use s3d_io::Error as FileError;
use s3d_io::dataset::Layout;
use s3d_io::fs::create_dir;
use s3d_io::image::Compression;
use s3d_synth::{
    Building, BuildingError, BuildingOptions, ScanError, ScanOptions, SightOptions, is_area_scan,
    is_demo_scan,
};
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
    /// Instead of the built-in scene make the first N of six generated areas to train on, drawn from --seed:
    /// 264 rooms in three buildings (areas 1, 3, 6; 2, 4; 5), whose rooms and things are as frequent as in
    /// 2D-3D-S. Their files come to OUT/scan/area_K.
    #[arg(long, value_name = "N",
        value_parser = value_parser!(u32).range(1..=i64::from(BuildingOptions::AREAS)))]
    pub(crate) areas: Option<u32>,
    /// Make no images: meshes, points, labels and tables alone.
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
    /// Candidate views a scan location [default: 24, or 4 with --areas]
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(0..=100_000))]
    pub(crate) views: Option<u32>,
    /// Width and height of a view in pixels [default: 540, or 256 with --areas]
    #[arg(long, value_name = "PX", value_parser = value_parser!(u32).range(8..=16_384))]
    pub(crate) size: Option<u32>,
    /// Width of a panorama in pixels, even; it is half as high [default: 2048, or 1024 with --areas]
    #[arg(long, value_name = "PX", value_parser = even_width)]
    pub(crate) pano_width: Option<u32>,
    /// Everything random comes from it.
    #[arg(long, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Density of the point cloud [default: 2500, or 400 with --areas, where the scanner measures as many]
    #[arg(long, value_name = "N", value_parser = positive)]
    pub(crate) points_per_m2: Option<f64>,
    /// How much time the images' files may take: fast, balanced (about the size that libpng and OpenEXR make
    /// them) or small (slowest). The pixels are the same.
    #[arg(long, default_value_t, value_parser = parsed::<Compression>, value_name = "fast|balanced|small")]
    pub(crate) compression: Compression,
}

impl DemoArgs {
    fn export_options(&self) -> ExportOptions {
        let SizeArgs { views, size, pano_width, seed, points_per_m2, compression } = self.options;
        let (small_views, small_size, small_width, few) = if self.areas.is_some() {
            (4, 256, 1024, 400.0)
        } else {
            (24, 540, 2048, 2500.0)
        };
        let all = ExportOptions {
            views: views.unwrap_or(small_views),
            size: size.unwrap_or(small_size),
            pano_width: pano_width.unwrap_or(small_width),
            seed,
            points_per_m2: points_per_m2.unwrap_or(few),
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
    /// Its folder.
    folder: PathBuf,
    /// The number of a generated area; the built-in scene has none.
    area: Option<u32>,
}

impl Scene {
    /// What it is called in messages.
    fn name(&self) -> String {
        self.area
            .map_or("the built-in scene".to_owned(), |area| format!("the generated area {area}"))
    }

    /// Whether its folder may be written again.
    fn is_ours(&self) -> bool {
        if self.area.is_some() {
            is_area_scan(&self.folder)
        } else {
            is_demo_scan(&self.folder)
        }
    }

    fn write(&self, folder: &Path, options: &ExportOptions, cancel: &Cancel) -> Result<PathBuf> {
        let wrong = |e: BuildingError| InputError::Unfit { path: folder.to_owned(), why: e.to_string() };
        let (scene, scan) = match self.area {
            None => (Building::demo().build().map_err(wrong)?, ScanOptions::default()),
            Some(area) => {
                let building = BuildingOptions::area(area, options.seed).map_err(BuildingError::from);
                let building = building
                    .and_then(|options| Building::generate(&options))
                    .map_err(wrong)?;
                let sight = SightOptions::default();
                let seen = building.build().and_then(|scene| scene.seen(&sight)).map_err(wrong)?;
                let scan = ScanOptions {
                    points_per_m2: options.points_per_m2,
                    seed: ScanOptions::default().seed.wrapping_add(options.seed),
                    area,
                    sight: Some(sight),
                    ..ScanOptions::default()
                };
                (seen, scan)
            }
        };
        scene
            .write_scan(folder, &scan, || !cancel.is_cancelled())
            .map_err(|e| match e {
                ScanError::File(e) => e.into(),
                ScanError::Cancelled => Error::Cancelled,
                other => InputError::Unfit { path: folder.to_owned(), why: other.to_string() }.into(),
            })
    }
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

    let part = output.join(SCAN_PART);
    for scene in scenes {
        put(scene, &part, options, overwrite, context)?;
        info!("{} is in {}", scene.name(), scene.folder.display());
    }
    export.run(output, context)?;
    Ok(())
}

/// Writes the scene and gives it its place. One that is there already, of a demo that was stopped, may stay
/// if it is the same to the byte: somebody may have changed it since.
fn put(
    scene: &Scene,
    part: &Path,
    options: &ExportOptions,
    overwrite: bool,
    context: &Context,
) -> Outcome<()> {
    let (folder, cancel) = (&scene.folder, &context.cancel);
    context.check()?;
    remove(part)?;
    scene.write(part, options, cancel)?;
    if folder.exists() {
        if same(part, folder).map_err(|e| FileError::io(folder, "read", e))? {
            return Ok(remove(part)?);
        }
        remove(part)?;
        if !overwrite {
            return Err(Failure::Usage(format!(
                "{} is there and differs from {}: choose another folder, or replace it with --overwrite",
                folder.display(),
                scene.name()
            )));
        }
        // Whatever else is in it stays.
        scene.write(folder, options, cancel)?;
    } else {
        if let Some(parent) = folder.parent() {
            create_dir(parent)?;
        }
        fs::rename(part, folder).map_err(|e| FileError::io(folder, "move the scene to", e))?;
    }
    Ok(())
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
