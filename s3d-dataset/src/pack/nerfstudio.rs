//! `s3d pack --to nerfstudio`: for each area a `transforms.json`, a second one for its panoramas, and a point
//! cloud to start from.

use super::area_points;
use super::destination::{Destination, relative_path};
use super::options::{DepthFiles, NerfstudioOptions};
use super::source::{Source, millimetres};
use crate::context::{Context, Progress};
use crate::error::Result;
use crate::parallel::map_in_order;
use crate::store::new_folder::resolved;
use s3d_geom::Raster;
use s3d_io::Error as FileError;
use s3d_io::cloud::write_colored_points;
use s3d_io::dataset::{DatasetImage, Domain, Frame};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_io::image::{encode_gray8, encode_gray16};
use s3d_io::package::{NerfstudioCamera, NerfstudioFrame, write_nerfstudio};
use s3d_render::MISSING_DEPTH;
use std::path::{Path, PathBuf};

/// The point cloud of an area.
const PLY: &str = "points.ply";

/// The folder of masks.
const MASKS: &str = "masks";

/// Writes the folders of all areas. Returns notes on how to use them.
pub(super) fn pack(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
    options: &NerfstudioOptions,
) -> Result<Vec<String>> {
    source.require(Domain::Rgb, "nerfstudio")?;
    source.require(Domain::Pose, "nerfstudio")?;
    let depth = depth_files(source, options)?;

    let progress = ctx.progress("packing", "images", source.images.len() as u64);
    let mut notes = Vec::new();
    for &area in &source.areas {
        let images = source.of_area(area);
        if images.is_empty() {
            continue;
        }

        notes.extend(pack_area(ctx, source, destination, (area, images), depth, options, &progress)?);
    }

    match depth {
        DepthFiles::Millimetres => {
            notes.push("depth is in millimetres, 0 where missing: nerfstudio's default".into());
        }
        DepthFiles::Original => notes.push(format!(
            "nerfstudio needs depth-unit-scale-factor {} here; missing pixels seem to be {:.0} m away",
            1.0 / source.depth_units_per_m,
            f64::from(MISSING_DEPTH) / source.depth_units_per_m
        )),
        DepthFiles::None => {}
    }
    Ok(notes)
}

/// Writes the folder of an area. Returns notes on how to use it.
fn pack_area(
    ctx: &Context,
    source: &Source,
    destination: &Destination,
    (area, images): (u32, Vec<&DatasetImage>),
    depth: DepthFiles,
    options: &NerfstudioOptions,
    progress: &Progress<'_>,
) -> Result<Vec<String>> {
    let mut notes = Vec::new();
    let below = format!("area_{area}");
    let masks = images
        .iter()
        .any(|image| source.photograph(image).is_some_and(|p| p.masked > 0.0));
    let job = Job { masks, ..Job::new(source, destination, &below, depth, options)? };
    if masks {
        create_dir(&job.folder.join(MASKS))?;
        notes.push(format!(
            "{below}: {MASKS} are 0 where a view lies outside of its photograph; all its views have one"
        ));
    }

    let points = area_points(source, area, options.points)?;
    let ply = (!points.is_empty()).then_some(PLY);
    if ply.is_some() {
        write_colored_points(&job.folder.join(PLY), &points, &[])?;
    }

    let (panoramas, views): (Vec<_>, Vec<_>) =
        images.into_iter().partition(|image| image.frame == Frame::Panorama);
    for (images, camera, name) in [
        (views, NerfstudioCamera::Perspective, "transforms.json"),
        (panoramas, NerfstudioCamera::Equirectangular, "transforms_panoramas.json"),
    ] {
        if images.is_empty() {
            continue;
        }
        let frames = map_in_order(
            ctx,
            &images,
            || (),
            |(), image| {
                let frame = job.frame(image, camera)?;
                progress.add(1);
                Ok(frame)
            },
        )?;
        write_nerfstudio(&job.folder.join(name), camera, ply, &frames)?;
        notes.push(format!("the data of ns-train: {below}/{name}"));
    }
    Ok(notes)
}

/// The kind of depth files to write.
fn depth_files(source: &Source, options: &NerfstudioOptions) -> Result<DepthFiles> {
    match options.depth {
        Some(DepthFiles::None) => Ok(DepthFiles::None),
        Some(asked) => {
            source.require(Domain::Depth, "depth for nerfstudio")?;
            Ok(asked)
        }
        None if source.has(Domain::Depth) => Ok(DepthFiles::Millimetres),
        None => Ok(DepthFiles::None),
    }
}

/// The inputs for the frames of an area.
struct Job<'a> {
    source: &'a Source,
    /// The area's folder while it is being written.
    folder: PathBuf,
    /// The area's final folder, absolute.
    place: PathBuf,
    /// The data set's folder, absolute.
    root: PathBuf,
    depth: DepthFiles,
    /// Whether views have masks.
    masks: bool,
    options: &'a NerfstudioOptions,
}

impl<'a> Job<'a> {
    /// Creates the folders of an area.
    fn new(
        source: &'a Source,
        destination: &Destination,
        below: &str,
        depth: DepthFiles,
        options: &'a NerfstudioOptions,
    ) -> Result<Self> {
        let folder = destination.path().join(below);
        create_dir(&folder)?;
        if options.copy_images {
            create_dir(&folder.join("images"))?;
        }
        if depth == DepthFiles::Millimetres || depth == DepthFiles::Original && options.copy_images {
            create_dir(&folder.join("depths"))?;
        }

        let place = absolute(destination.place())?.join(below);
        let root = absolute(source.data.layout.root())?;
        Ok(Self { source, folder, place, root, depth, masks: false, options })
    }

    /// Writes the files of an image, and returns its frame.
    fn frame(&self, image: &DatasetImage, camera: NerfstudioCamera) -> Result<NerfstudioFrame> {
        let pose = self.source.data.pose(image)?;
        let size = self.source.size(image)?;
        let rgb = self.file(image, Domain::Rgb, "images")?;
        let mut frame = match camera {
            NerfstudioCamera::Perspective => NerfstudioFrame::perspective(rgb, &pose, size),
            NerfstudioCamera::Equirectangular => {
                let (width, height) = size;
                if width != 2 * height {
                    let message = format!("a panorama of {width} × {height}, not twice as wide as high");
                    return Err(FileError::format(
                        &image.path(&self.source.data.layout, Domain::Rgb),
                        message,
                    )
                    .into());
                }
                NerfstudioFrame::equirectangular(rgb, &pose, size)
            }
        };

        if self.masks && camera == NerfstudioCamera::Perspective {
            let name = format!("{MASKS}/{}_mask.png", image.stem());
            write_bytes(&self.folder.join(&name), &encode_gray8(&self.mask(image, size)?))?;
            frame.mask_path = Some(name);
        }

        frame.depth_file_path = match self.depth {
            DepthFiles::None => None,
            DepthFiles::Original => Some(self.file(image, Domain::Depth, "depths")?),
            DepthFiles::Millimetres => {
                let depth = self.source.depth(image)?;
                let file = encode_gray16(
                    &millimetres(&depth, self.source.depth_units_per_m),
                    self.options.compression,
                );
                let name = format!("depths/{}_depth.png", image.stem());
                write_bytes(&self.folder.join(&name), &file)?;
                Some(name)
            }
        };

        Ok(frame)
    }

    /// The mask of an image: 255 in a photograph's own pixels, and everywhere in other images.
    fn mask(&self, image: &DatasetImage, (width, height): (u32, u32)) -> Result<Raster<u8>> {
        if self.source.photograph(image).is_none() {
            return Ok(Raster::filled(width, height, 255));
        }
        let color = self.source.rgb8(image, Domain::Rgb)?;
        Ok(color.map(|color| if color == [0; 3] { 0 } else { 255 }))
    }

    /// The path of an image's file from the area's folder: the data set's file, or a copy in `copies`.
    fn file(&self, image: &DatasetImage, domain: Domain, copies: &str) -> Result<String> {
        if !self.options.copy_images {
            return Ok(relative_path(&self.place, &self.root.join(image.relative_path(domain))));
        }
        let name = format!("{copies}/{}_{domain}.png", image.stem());
        self.source.copy(image, domain, &self.folder.join(&name))?;
        Ok(name)
    }
}

fn absolute(path: &Path) -> Result<PathBuf, FileError> {
    resolved(path).map_err(|e| FileError::io(path, "look for", e))
}
