//! The transform from one mesh or cloud to another that shows some of the same building.

mod read;
mod report;

pub use report::AlignReport;
pub(crate) use report::rows;

use crate::context::Context;
use crate::error::{Error, Result, UsageError};
use crate::mesh_axes::MeshAxes;
use crate::store::NewFile;
use glam::{DAffine3, DVec3, Vec3};
use read::{Cloud, Read, Shape, has_ending, read};
use s3d_fusion::{AlignError, AlignOptions as SearchOptions, Aligned, SurfacePoints, align as search};
use s3d_geom::{PointCloud, TriMesh};
use s3d_io::cloud::ColoredPointWriter;
use s3d_io::mesh::{LengthUnit, MeshOut, UpAxis, write_ply_mesh, write_textured_glb};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The number of points that are written at a time.
const BLOCK: usize = 1 << 16;

/// How two meshes or clouds are aligned. With the feature `clap` it is a group of arguments of a command
/// line.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct AlignOptions {
    /// Turn the first one about all axes, instead of the upright one alone.
    #[cfg_attr(feature = "clap", arg(long))]
    pub tilted: bool,
    /// Find the scale of the first one too, by heights of rooms.
    #[cfg_attr(feature = "clap", arg(long))]
    pub scale: bool,
    /// Take the Nth of several answers, from 1.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub nth: Option<NonZeroUsize>,
    /// The axis of the first one that points up [default: y in glTF, guessed in other meshes, z in clouds]
    #[cfg_attr(feature = "clap", arg(long, value_name = "y|z",
        value_parser = crate::options::words::parsed::<UpAxis>))]
    pub up_a: Option<UpAxis>,
    /// The axis of the second one that points up.
    #[cfg_attr(feature = "clap", arg(long, value_name = "y|z",
        value_parser = crate::options::words::parsed::<UpAxis>))]
    pub up_b: Option<UpAxis>,
    /// The unit of the first one [default: metres in glTF and clouds; in other meshes what the file says, or
    /// else guessed from the height of rooms]
    #[cfg_attr(feature = "clap", arg(long, value_name = "m|cm|mm|ft|in",
        value_parser = crate::options::words::parsed::<LengthUnit>))]
    pub units_a: Option<LengthUnit>,
    /// The unit of the second one.
    #[cfg_attr(feature = "clap", arg(long, value_name = "m|cm|mm|ft|in",
        value_parser = crate::options::words::parsed::<LengthUnit>))]
    pub units_b: Option<LengthUnit>,
    /// Write the first one into the frame of the second: .ply, or for a mesh .glb with textures.
    #[cfg_attr(feature = "clap", arg(short, long, value_name = "moved.glb"))]
    pub output: Option<PathBuf>,
    /// Replace the file if it exists.
    #[cfg_attr(feature = "clap", arg(long, requires = "output"))]
    pub overwrite: bool,
}

/// Finds where the mesh or cloud in the file `a` lies in the frame of `b`. If there are several answers, the
/// report says so, and nothing is written to [`AlignOptions::output`] unless one is chosen.
///
/// # Errors
/// [`Error::File`] and [`Error::Input`] for files that cannot be read, have too little surface, or do not
/// fit. [`Error::Usage`] if the output exists and is not to be replaced, or has another ending than what is
/// written. [`Error::Cancelled`].
pub fn align(a: &Path, b: &Path, options: &AlignOptions, ctx: &Context) -> Result<AlignReport> {
    if let Some(output) = &options.output {
        if !has_ending(output, "ply") && !has_ending(output, "glb") {
            let why = "a mesh is written as PLY or GLB, and a cloud as PLY: give it a name that ends with \
                       .ply or .glb";
            return Err(UsageError::WrongEnding { path: output.clone(), why }.into());
        }
        NewFile::check_free(output, options.overwrite)?;
    }

    let [of_a, of_b] = [
        MeshAxes { up: options.up_a, units: options.units_a },
        MeshAxes { up: options.up_b, units: options.units_b },
    ];
    let [read_a, read_b] = [read(a, of_a, ctx)?, read(b, of_b, ctx)?];
    if let (Some(output), Shape::Cloud(_)) = (&options.output, &read_a.shape)
        && !has_ending(output, "ply")
    {
        let why = "the first one is a cloud, which is written as PLY: give it a name that ends with .ply";
        return Err(UsageError::WrongEnding { path: output.clone(), why }.into());
    }

    let started = Instant::now();
    let aligned = found(a, b, &read_a, &read_b, options)?;
    ctx.check()?;
    ctx.info(format_args!(
        "{:.0} and {:.0} m² compared in {:.1} s",
        read_a.points.area_m2(),
        read_b.points.area_m2(),
        started.elapsed().as_secs_f64()
    ));
    let report = AlignReport::new(aligned, options.nth);
    let Some(place) = report.place() else {
        let why = format!("there are {} answers", report.aligned.places.len());
        return Err(Error::unfit(a, why));
    };

    if let (Some(output), None) = (&options.output, &report.doubt) {
        // Positions are `f32`, so the offset of a far frame stays subtracted.
        let offset_m = read_b.offset_m;
        let near = DAffine3::from_translation(-offset_m) * place.b_from_a;
        let file = NewFile::begin(ctx, output, options.overwrite)?;
        match read_a.shape {
            Shape::Mesh(mesh) => {
                let near = near * DAffine3::from_translation(read_a.offset_m);
                let moved = mesh.transformed(&near).map_err(|e| Error::unfit(a, e.to_string()))?;
                write_mesh(&moved, file.path(), has_ending(output, "glb"), offset_m)?;
            }
            Shape::Cloud(cloud) => write_cloud(&cloud, &near, file.path(), offset_m, ctx)?,
        }
        file.finish()?;
        if offset_m != DVec3::ZERO {
            ctx.info(format_args!("{}: {:?} is subtracted", output.display(), offset_m.to_array()));
        }
    }
    Ok(report)
}

/// Finds where the level mesh `a` lies in the frame of the level mesh `b`.
pub(crate) fn align_meshes(a: &TriMesh, b: &TriMesh) -> std::result::Result<AlignReport, AlignError> {
    let [a, b] = [SurfacePoints::of_mesh(a)?, SurfacePoints::of_mesh(b)?];
    let how = SearchOptions { is_level: true, with_scale: false };
    search(&a, &b, &how).map(|aligned| AlignReport::new(aligned, None))
}

/// The places in the frames of the files.
fn found(a: &Path, b: &Path, of_a: &Read, of_b: &Read, options: &AlignOptions) -> Result<Aligned> {
    let how = SearchOptions { is_level: !options.tilted, with_scale: options.scale };
    let mut aligned = search(&of_a.points, &of_b.points, &how).map_err(|error| {
        let with = b.display();
        match error {
            AlignError::Units { .. } => {
                Error::unfit(a, format!("beside {with}, {error} (`units_a` and `units_b` say them)"))
            }
            _ => Error::unfit(a, format!("with {with}: {error}")),
        }
    })?;
    for place in &mut aligned.places {
        place.b_from_a = DAffine3::from_translation(of_b.offset_m)
            * place.b_from_a
            * DAffine3::from_translation(-of_a.offset_m);
    }
    Ok(aligned)
}

fn write_mesh(mesh: &TriMesh, path: &Path, is_glb: bool, offset_m: DVec3) -> Result<()> {
    if is_glb {
        return Ok(write_textured_glb(path, mesh).map(drop)?);
    }
    let mut comments = Vec::new();
    if offset_m != DVec3::ZERO {
        let [x, y, z] = offset_m.to_array();
        comments.push(format!("offset {x} {y} {z} was subtracted"));
    }
    let positions: &[Vec3] = mesh.positions();
    let colors = &mesh.parts().colors;
    let colors: &[[u8; 3]] = if colors.len() == positions.len() { colors } else { &[] };
    let out = MeshOut { positions, faces: mesh.faces(), colors, comments: &comments, ..MeshOut::default() };
    write_ply_mesh(path, &out)?;
    Ok(())
}

/// Reads a cloud again and writes all its points, moved by `moved`. A point without a colour is black.
fn write_cloud(cloud: &Cloud, moved: &DAffine3, path: &Path, offset_m: DVec3, ctx: &Context) -> Result<()> {
    let task = ctx.progress("writing", "points", cloud.count);
    let mut writer = ColoredPointWriter::create(path, cloud.count, offset_m)?;
    let mut block = PointCloud::default();
    let mut flush = |block: &mut PointCloud| -> Result<()> {
        writer.append(block)?;
        task.add(block.len() as u64);
        block.clear();
        Ok(())
    };
    cloud.each_point(ctx, &mut |point| {
        block.positions.push(moved.transform_point3(point.position_m).as_vec3());
        block.colors.push(point.color.unwrap_or_default());
        if block.len() == BLOCK {
            flush(&mut block)?;
        }
        Ok(())
    })?;
    flush(&mut block)?;
    writer.finish()?;
    Ok(())
}
