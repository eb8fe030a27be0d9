//! Makes the world coordinates of a data set's images from depth and pose.

use crate::context::Context;
use crate::error::{Result, UsageError};
use crate::parallel::for_each_in_order;
use crate::record::data_set::{DataSet, Listed};
use crate::record::listing;
use crate::record::manifest::Manifest;
use crate::store::change::Change;
use crate::store::lock::Lock;
use half::f16;
use s3d_geom::{Camera, Raster};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DepthUnits, Domain, FileRecord, Frame, Layout, XyzType, read_pose};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{Compression, decode_gray16, encode_xyz_float, encode_xyz_half};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// How world coordinates are made from depth.
///
/// With the feature `clap` it is a group of arguments of a command line: comments of fields are help texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct XyzOptions {
    /// The stored numbers: half floats or 32-bit floats.
    #[cfg_attr(feature = "clap", arg(long = "type", default_value = "half", value_name = "half|float",
        value_parser = crate::options::words::stored_xyz))]
    pub xyz: XyzType,
    /// Replace existing coordinates, although they may be more exact.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
    /// Compression of the image files: fast, balanced or small.
    #[cfg_attr(feature = "clap", arg(long, default_value_t, value_name = "fast|balanced|small",
        value_parser = crate::options::words::parsed::<Compression>))]
    pub compression: Compression,
}

impl Default for XyzOptions {
    fn default() -> Self {
        Self { xyz: XyzType::Half, overwrite: false, compression: Compression::default() }
    }
}

/// Makes the world coordinates of a data set's images from depth and pose. They are off by at most half a
/// step of depth along the ray. Returns the number of images.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if coordinates exist and are not to be replaced.
/// [`Error::File`](crate::Error::File) if there is no data set, no image has both depth and pose, or one of
/// these is damaged. [`Error::Cancelled`](crate::Error::Cancelled) or
/// [`Error::Temporary`](crate::Error::Temporary). After an error the data set is as it was before. After a
/// kill it is too, or the same call completes the change.
pub fn xyz(root: impl Into<PathBuf>, options: &XyzOptions, ctx: &Context) -> Result<usize> {
    if options.xyz == XyzType::None {
        let range = "half or float".to_owned();
        return Err(UsageError::OutOfRange { option: "xyz", range }.into());
    }

    let layout = &Layout::new(root.into());
    Manifest::require(layout)?;
    let call = format!("xyz as {}, {}", options.xyz, options.compression);
    // The lock keeps others from replacing the data set.
    Lock::during(ctx, layout, |completed| {
        let data = DataSet::open_in(layout)?;
        let images = images(&data)?;
        if completed.as_ref() == Some(&call) {
            ctx.info(format_args!(
                "{}: what a killed process had begun is complete",
                layout.root().display()
            ));
            return Ok(images.len());
        }
        make(ctx, &data, &images, options, &call)
    })
}

/// The files of an image with depth and pose.
struct DepthImage {
    pose: PathBuf,
    depth: PathBuf,
    xyz: PathBuf,
    frame: Frame,
    is_photograph: bool,
}

/// Returns the images with depth and pose, by area.
fn images(data: &DataSet) -> Result<Vec<DepthImage>> {
    let mut images = Vec::new();
    for area in &data.manifest.area_numbers {
        let photographs = data.photographs(*area)?;
        for image in data.files.images(&data.layout, *area) {
            if image.has(Domain::Pose) && image.has(Domain::Depth) {
                let [pose, depth, xyz] = [Domain::Pose, Domain::Depth, Domain::GlobalXyz]
                    .map(|domain| image.path(&data.layout, domain));
                let is_photograph = photographs.iter().any(|p| p.camera_uuid == image.uuid);
                images.push(DepthImage { pose, depth, xyz, frame: image.frame, is_photograph });
            }
        }
    }
    Ok(images)
}

fn make(
    ctx: &Context,
    data: &DataSet,
    images: &[DepthImage],
    args: &XyzOptions,
    call: &str,
) -> Result<usize> {
    let layout = &data.layout;
    if images.is_empty() {
        return Err(FileError::format(layout.root(), "no image with both depth and pose: export them").into());
    }
    if let Some(there) = images.iter().find(|image| image.xyz.exists() && !args.overwrite) {
        return Err(UsageError::Exists {
            path: there.xyz.clone(),
            note: Some("what export writes is more exact"),
        }
        .into());
    }

    let needed: BTreeSet<&Path> = images.iter().flat_map(|image| [&*image.pose, &*image.depth]).collect();
    data.files.require(ctx, |path| needed.contains(path))?;

    let folders = |layout: &Layout| {
        let kinds = [Frame::Panorama, Frame::View(0)];
        let areas = data.manifest.area_numbers.iter();
        let pairs = areas.flat_map(|area| kinds.map(|kind| (*area, kind)));
        Vec::from_iter(pairs.map(|(area, kind)| layout.image_dir(area, kind, Domain::GlobalXyz)))
    };
    let change = Change::begin(layout, &folders(layout))?;
    let staged = change.staged();
    folders(staged).iter().try_for_each(|folder| create_dir(folder))?;

    let conventions = data.manifest.conventions();
    let progress = ctx.progress("coordinates", "images", images.len() as u64);
    let changed = Mutex::new(Vec::with_capacity(images.len() + 1));
    for_each_in_order(
        ctx,
        images,
        || (),
        |(), image| {
            let file = make_one(&data.files, image, conventions.depth_units, args.xyz, args.compression)?;
            let record = FileRecord::of_bytes(layout.root(), &image.xyz, &file)?;
            write_bytes(&record.path_in(staged.root()), &file)?;
            changed.lock().unwrap_or_else(PoisonError::into_inner).push(record);
            progress.add(1);
            Ok(())
        },
    )?;
    drop(progress);

    let mut changed = changed.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut manifest = Manifest::read(layout)?;
    manifest.xyz_from_depth(args.xyz, conventions.depth_units);
    manifest
        .conventions()
        .write(&staged.conventions(), &manifest.request().world_offsets())?;
    changed.push(FileRecord::of_file(staged.root(), &staged.conventions())?);
    listing::write_changed(data, &mut manifest, changed, |_| false, staged)?;
    change.commit(call, &[])?;

    ctx.info(format_args!(
        "{}: world coordinates of {} images from depth and pose",
        layout.root().display(),
        images.len()
    ));
    Ok(images.len())
}

/// Returns the file of an image's world coordinates.
fn make_one(
    files: &Listed,
    image: &DepthImage,
    units: DepthUnits,
    kind: XyzType,
    compression: Compression,
) -> Result<Vec<u8>> {
    let pose = read_pose(files.checked(&image.pose)?)?;
    let depth = decode_gray16(&files.read_bytes(&image.depth)?, &image.depth)?;

    let camera = if image.frame == Frame::Panorama {
        let (width, height) = (depth.width(), depth.height());
        if width != 2 * height {
            let size = format!("{width} × {height} pixels: a panorama is twice as wide as high");
            return Err(FileError::format(&image.depth, size).into());
        }
        Camera::equirectangular(pose.pose(), width)
    } else {
        let fov = pose.field_of_view_rads;
        if !(fov > 0.0 && fov < std::f64::consts::PI) {
            let message = format!("field_of_view_rads {fov} is no angle of view");
            return Err(FileError::format(&image.pose, message).into());
        }
        let camera = Camera::perspective(pose.pose(), fov, depth.width(), depth.height());
        // A photograph has focal lengths and a principal point of its own.
        if image.is_photograph {
            Camera::from_k_rt(pose.camera_k_matrix, camera.pose.rt_matrix(), depth.width(), depth.height())
                .map(|of_k| Camera { pose: camera.pose, ..of_k })
                .map_err(|e| FileError::format(&image.pose, e.to_string()))?
        } else {
            camera
        }
    };

    let points = points(&camera, &depth, units);
    Ok(match kind {
        XyzType::Float => encode_xyz_float(&points, compression),
        _ => encode_xyz_half(&points.map(|p| p.map(f16::from_f32)), compression),
    })
}

/// Returns location + direction × depth for each pixel, along the ray through its middle. Missing depth
/// gives 0.
pub(crate) fn points(camera: &Camera, depth: &Raster<u16>, units: DepthUnits) -> Raster<[f32; 3]> {
    let rays = camera.rays();
    let mut points = Raster::filled(depth.width(), depth.height(), [0.0; 3]);
    let mut pixels = depth.pixels().iter().zip(points.pixels_mut());
    for j in 0..depth.height() {
        for i in 0..depth.width() {
            let Some((depth, point)) = pixels.next() else { break };
            if let Some(metres) = units.metres(*depth) {
                *point = (camera.pose.location + rays.at(i, j) * metres).as_vec3().to_array();
            }
        }
    }
    points
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec3};
    use s3d_geom::Pose;

    #[test]
    fn points_project_back_to_their_pixels_at_their_depth() {
        let pose = Pose::level(dvec3(3.0, -2.0, 1.5), 0.4).turned(0.3, -0.2);
        for camera in [Camera::perspective(pose, 1.1, 8, 8), Camera::equirectangular(pose, 16)] {
            let mut depth = Raster::filled(camera.width, camera.height, 2000u16);
            depth.pixels_mut()[5] = u16::MAX;
            for (units, metres) in [(DepthUnits::Per512, 3.90625), (DepthUnits::Millimetres, 2.0)] {
                let points = points(&camera, &depth, units);
                for j in 0..camera.height {
                    for i in 0..camera.width {
                        let p = points.at(i, j);
                        if depth.at(i, j) == u16::MAX {
                            assert_eq!(p, [0.0; 3]);
                            continue;
                        }
                        let p = DVec3::from_array(p.map(f64::from));
                        let (pixel, depth) = camera.project(p).unwrap();
                        assert!((pixel.x - f64::from(i) - 0.5).abs() < 1e-4, "{pixel}");
                        assert!((pixel.y - f64::from(j) - 0.5).abs() < 1e-4, "{pixel}");
                        assert!((depth - metres).abs() < 1e-5);
                    }
                }
            }
        }
    }
}
