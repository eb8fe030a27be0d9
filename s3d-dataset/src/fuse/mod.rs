//! A raw scan becomes a mesh, and the scene file that an export takes.
//!
//! [`fuse`] reads depth pictures or laser scans (`images`), gathers them in a grid, in tiles if that does not
//! fit into the memory (`gather`), and simplifies the surface (`surface`). Finished tiles are kept until the
//! output is in its place, so the same call goes on after a kill (`kept_tiles`). A folder holds the mesh, a
//! scene file that names what else the scan brings (`scene_text`), and a record of what it was made from
//! (`kept`). Exports of a raw scan keep such a folder beside it.

mod fit;
mod gather;
mod images;
mod kept;
mod kept_tiles;
mod level;
mod options;
mod places;
mod scene_text;
mod surface;
mod tiles;

pub(crate) use kept::{fused_scene, scene_of_raw};
pub use options::FuseOptions;

use crate::context::Context;
use crate::error::{Error, Result, UsageError};
use crate::store::new_folder::FolderKind;
use crate::store::{NewFile, NewFolder};
use fit::fit;
use gather::Keeping;
use glam::DVec3;
use images::Images;
use kept::Record;
use s3d_io::fs::{write_bytes, write_json};
use s3d_io::mesh::{FaceColumn, MeshOut, write_glb_mesh, write_ply_mesh};
use std::path::{Path, PathBuf};
use surface::{Made, surface};

/// A folder with a fused mesh.
const FUSED: FolderKind =
    FolderKind { about: "fused.json", generator: "s3d fuse", noun: "the fused mesh", action: "write" };

/// What was fused.
#[derive(Clone, Debug, PartialEq)]
pub struct Fused {
    /// The number of depth pictures, or of laser scans.
    pub images: usize,
    /// The number of faces of the fused surface.
    pub fused_faces: usize,
    /// The number of faces of the mesh.
    pub faces: usize,
    /// The largest distance of the fused surface from the mesh, metres.
    pub max_error_m: f64,
    /// The number of holes that were closed.
    pub closed: usize,
}

/// Fuses the files and folders of a raw scan to a mesh.
///
/// `output` is a mesh (`.ply`, Z-up, or `.glb`), or else a folder, which gets `mesh.ply`, and a `scene.toml`
/// that an export takes: it names the scan's photographs and places too.
///
/// # Errors
/// [`Error::File`] and [`Error::Input`] for a raw scan that cannot be used. [`Error::Usage`] if `output`
/// exists and is not to be replaced. [`Error::Cancelled`]: what is finished of a scan in tiles stays beside
/// `output`, and the same call goes on with it.
pub fn fuse(
    inputs: &[PathBuf],
    output: &Path,
    options: &FuseOptions,
    overwrite: bool,
    ctx: &Context,
) -> Result<Fused> {
    let is = |ending: &str| {
        output
            .extension()
            .is_some_and(|found| found.eq_ignore_ascii_case(ending))
    };
    let is_glb = is("glb");
    if !is_glb && !is("ply") {
        if output.extension().is_some() && !output.is_dir() {
            let why = "a fused mesh is a .ply or a .glb; a name without an ending is a folder";
            return Err(UsageError::WrongEnding { path: output.to_owned(), why }.into());
        }
        return fuse_folder(inputs, output, options, overwrite, ctx);
    }

    NewFile::check_free(output, overwrite)?;
    let images = open(inputs, options, ctx)?;
    let file = NewFile::begin(ctx, output, overwrite)?;
    let keeping = Keeping { folder: &file.kept(), inputs };
    let made = surface(&images, options, &keeping, ctx)?;
    write(file.path(), &made, &images, is_glb)?;
    file.finish()?;
    Ok(made.told(ctx, output))
}

/// Opens a raw scan, and brings its laser scans onto each other if that was asked for.
fn open(inputs: &[PathBuf], options: &FuseOptions, ctx: &Context) -> Result<Images> {
    let mut images = Images::open(inputs, options, ctx)?;
    if let Some(motions) = fit(&images, options.refine_poses, ctx)? {
        images.move_scans(motions);
    }
    Ok(images)
}

/// Fuses a raw scan to a folder.
fn fuse_folder(
    inputs: &[PathBuf],
    output: &Path,
    options: &FuseOptions,
    overwrite: bool,
    ctx: &Context,
) -> Result<Fused> {
    let Some(first) = inputs.first() else { return Err(Error::unfit(output, "no raw scan is named")) };
    // What the files are now is what the mesh is made of.
    let record = Record::of(inputs, options)?;
    let folder = NewFolder::begin(ctx, output, first, FUSED, overwrite)?;
    let images = open(inputs, options, ctx)?;
    let keeping = Keeping { folder: &folder.kept(), inputs };
    let made = surface(&images, options, &keeping, ctx)?;

    write(&folder.path().join("mesh.ply"), &made, &images, false)?;
    let scene = scene_text::scene(&images, made.turn, output)?;
    if images.offset_m != DVec3::ZERO {
        // Where the readers of meshes look for it.
        let [x, y, z] = images.offset_m.to_array();
        write_bytes(&folder.path().join("offset.xyz"), format!("{x:?} {y:?} {z:?}\n").as_bytes())?;
    }
    for (name, list) in &scene.lists {
        write_bytes(&folder.path().join(name), list.as_bytes())?;
    }
    write_bytes(&folder.path().join("scene.toml"), scene.toml.as_bytes())?;
    write_json(&folder.path().join(FUSED.about), &record)?;
    folder.finish()?;
    Ok(made.told(ctx, output))
}

fn write(path: &Path, made: &Made, images: &Images, is_glb: bool) -> Result<()> {
    let closed = [FaceColumn { name: "closed", values: &made.closed }];
    let mut comments = vec!["fused from a raw scan by s3d fuse".to_owned()];
    comments.extend(images.offset_comment());
    let mesh = MeshOut {
        positions: &made.positions,
        faces: &made.faces,
        colors: &made.colors,
        columns: if made.closed.is_empty() { &[] } else { &closed },
        comments: &comments,
    };
    if is_glb {
        write_glb_mesh(path, &mesh)
    } else {
        write_ply_mesh(path, &mesh)
    }?;
    Ok(())
}
