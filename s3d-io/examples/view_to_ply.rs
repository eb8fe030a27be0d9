//! Turns a view of a data set back into coloured, labelled points: to look at it in any viewer, or to see
//! that two views of a location lie over one another.
//!
//! ```text
//! cargo run --release -p s3d-io --example view_to_ply -- \
//!     out/area_1/data/rgb/camera_…_domain_rgb.png view.ply
//! ```
#![allow(clippy::print_stdout, clippy::print_stderr)]

use s3d_geom::{PointCloud, glam::Vec3};
use s3d_io::Result;
use s3d_io::cloud::PlyPointWriter;
use s3d_io::dataset::{Domain, ImageName};
use s3d_io::image::{read_rgb8, read_xyz};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The value of `semantic` where the ray hit nothing.
const NOTHING: u32 = 0x0d_0d_0d;

fn main() -> ExitCode {
    let arguments: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    let [image, output] = arguments.as_slice() else {
        eprintln!("usage: view_to_ply IMAGE.png OUTPUT.ply");
        return ExitCode::FAILURE;
    };
    let name = image.file_name().and_then(|n| n.to_str()).and_then(ImageName::parse);
    let folder = image.parent().and_then(Path::parent);
    let (Some(name), Some(folder)) = (name, folder) else {
        eprintln!("{}: not an image of a data set in its folder", image.display());
        return ExitCode::FAILURE;
    };
    match convert(folder, &name, output) {
        Ok(points) => {
            println!("{points} points");
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("{e}");
            ExitCode::FAILURE
        }
    }
}

/// `folder` is the one above the domains' folders: `area_1/data`.
fn convert(folder: &Path, name: &ImageName, output: &Path) -> Result<usize> {
    let path = |domain: Domain| {
        folder
            .join(domain.folder())
            .join(ImageName { domain, ..name.clone() }.to_string())
    };
    let colors = read_rgb8(&path(Domain::Rgb))?;
    let semantic = read_rgb8(&path(Domain::Semantic))?;
    let xyz = read_xyz(&path(Domain::GlobalXyz))?;

    let mut cloud = PointCloud::default();
    let mut labels = Vec::new();
    for ((&color, &[r, g, b]), &at) in colors.pixels().iter().zip(semantic.pixels()).zip(xyz.pixels()) {
        let label = u32::from_be_bytes([0, r, g, b]);
        if label != NOTHING {
            cloud.positions.push(Vec3::from_array(at));
            cloud.colors.push(color);
            labels.push(label);
        }
    }
    let mut writer = PlyPointWriter::create(output, cloud.len() as u64)?;
    writer.append(&cloud, &labels)?;
    writer.finish()?;
    Ok(cloud.len())
}
