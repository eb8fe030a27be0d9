//! Renders the views of a list of cameras. The mesh is loaded once, and all threads share the cameras.

use super::frame_names::frame_names;
use super::view::{RenderOptions, channels, curvatures, face_image, faces_fit, images};
use crate::condition::Condition;
use crate::context::Context;
use crate::error::{Error, Overwriting, Result, UsageError};
use crate::export::input::photographs::camera_error;
use crate::export::modality::{Image, ImageBuffers};
use crate::mesh_axes::read_mesh;
use crate::parallel::for_each_in_order;
use crate::store::parent_of;
use crate::store::staging::Staging;
use crate::useful::{judge_of, poses_findings};
use glam::{DAffine3, DVec3};
use s3d_geom::{Aabb, Camera};
use s3d_io::Error as FileError;
use s3d_io::camera::{GivenIntrinsics, IntrinsicsError, PosedCamera, PosedCameras, read_posed_cameras};
use s3d_io::fs::{create_dir, read_json, write_bytes, write_json};
use s3d_io::mesh::{MeshOrigin, UpAxis};
use s3d_io::package::NerfstudioFrame;
use s3d_render::{Caster, Hits, MipMaps, NO_FACE, Scene};
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

/// The file that describes the images.
const CAMERAS: &str = "transforms.json";

const GENERATOR: &str = "s3d render";

/// The largest width or height of an image, pixels.
const MAX_SIDE: u32 = 32_768;

/// The options of [`render_poses`].
#[derive(Clone, Debug)]
pub struct PosesOptions {
    /// The options of a single view.
    pub render: RenderOptions,
    /// The axis of the list's frame that points up.
    pub poses_up: UpAxis,
    /// Size, focal lengths or angle of view. They replace the values of the list, or fill in missing ones.
    pub intrinsics: GivenIntrinsics,
    /// Conditions that need not be met. Only [`Condition::Coverage`] is used.
    pub allow: Vec<Condition>,
}

impl Default for PosesOptions {
    fn default() -> Self {
        let intrinsics = GivenIntrinsics::default();
        Self { render: RenderOptions::default(), poses_up: UpAxis::Z, intrinsics, allow: Vec::new() }
    }
}

/// The counts that [`render_poses`] returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct RenderedPoses {
    /// The number of cameras, each with an image of every kind.
    pub views: u64,
    /// The number of cameras that see nothing of the mesh.
    pub blind: u64,
    /// The number of entries that were left out because the list has no pose for them.
    pub untracked: u64,
}

/// `transforms.json` for nerfstudio, which ignores unknown keys.
#[derive(Serialize)]
struct Transforms<'a> {
    generator: &'static str,
    camera_model: &'static str,
    /// The offset that was subtracted from the coordinates of the mesh's file and of the cameras, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    world_offset_m: Option<[f64; 3]>,
    frames: Vec<ListedFrame<'a>>,
}

#[derive(Serialize)]
struct ListedFrame<'a> {
    /// The camera's name in the given list.
    name: &'a str,
    #[serde(flatten)]
    frame: NerfstudioFrame,
}

/// One view.
struct Frame<'a> {
    name: &'a str,
    /// The name of its files, without ending.
    stem: String,
    camera: Camera,
}

/// Renders what the cameras of a list see of a mesh. Writes `rgb/NAME.png`, `depth/NAME.png`,
/// `normal/NAME.png`, `global_xyz/NAME.exr` and `faces/NAME.png` into the folder `output`, and
/// `transforms.json` with every camera. [`read_posed_cameras`] describes the accepted lists. The folder
/// appears whole or not at all: a killed call starts again from the beginning.
///
/// # Errors
/// [`Error::Usage`] if the folder is not empty and may not be replaced, or the list lacks sizes or focal
/// lengths that the options do not give; [`Error::File`]; [`Error::Input`] if no camera sees anything;
/// [`Error::Cancelled`].
pub fn render_poses(
    mesh: &Path,
    poses: &Path,
    output: &Path,
    options: &PosesOptions,
    ctx: &Context,
) -> Result<RenderedPoses> {
    let parent = parent_of(output);
    let folder_name = Path::new(output.file_name().unwrap_or_default());
    let overwrite = options.render.overwrite;
    if !Staging::is_left(&parent, folder_name) {
        check_free(output, overwrite)?;
    }

    let world_from_poses = DAffine3::from_mat3(options.poses_up.rotation());
    let PosedCameras { cameras, untracked, .. } = read_posed_cameras(poses, &world_from_poses)?;
    let mut frames = frames(poses, &cameras, &options.intrinsics)?;
    tell_of_list(ctx, &cameras, untracked);

    let file = read_mesh(mesh, options.render.axes, MeshOrigin::Near, ctx)?;
    // Images are in the frame of the mesh, so cameras have its offset subtracted too.
    frames
        .iter_mut()
        .for_each(|frame| frame.camera.pose.location -= file.offset_m);
    let world_offset_m = (file.offset_m != DVec3::ZERO).then(|| file.offset_m.to_array());
    if let Some(offset_m) = world_offset_m {
        ctx.info(format_args!(
            "the mesh lies far from the origin: {offset_m:?} is subtracted from its coordinates and the \
             cameras', which {CAMERAS} tells"
        ));
    }

    create_dir(&parent)?;
    let staging = Staging::begin(ctx, &parent, folder_name)?;
    check_free(output, overwrite || staging.was_placing())?;
    let started = Instant::now();
    let blind = write_images(ctx, &file.mesh, &frames, staging.path(), &options.render)?;
    let seconds = started.elapsed().as_secs_f64();

    let places = frames.iter().map(|frame| frame.camera.pose.location.as_vec3());
    let places = Aabb::from_points(places);
    let count = frames.len() as u64;
    let findings = poses_findings(blind, count, &places, &file.mesh.aabb(), "up and poses_up");
    judge_of(("the views", "write them"), ctx, &findings, &options.allow)?;

    let is_panorama = frames.first().is_some_and(|frame| frame.camera.is_panorama());
    let transforms = Transforms {
        generator: GENERATOR,
        camera_model: if is_panorama { "EQUIRECTANGULAR" } else { "OPENCV" },
        world_offset_m,
        frames: frames
            .iter()
            .map(|frame| {
                let file = format!("rgb/{}.png", frame.stem);
                ListedFrame { name: frame.name, frame: NerfstudioFrame::new(file, &frame.camera) }
            })
            .collect(),
    };

    write_json(&staging.path().join(CAMERAS), &transforms)?;
    staging.place_folder(output, is_ours(output))?;
    ctx.info(format_args!("{}: {} views in {seconds:.1} s", output.display(), frames.len()));
    Ok(RenderedPoses { views: frames.len() as u64, blind, untracked: untracked as u64 })
}

/// The views of a list's cameras.
fn frames<'a>(poses: &Path, cameras: &'a [PosedCamera], given: &GivenIntrinsics) -> Result<Vec<Frame<'a>>> {
    let mut frames = Vec::with_capacity(cameras.len());
    for (posed, stem) in cameras.iter().zip(frame_names(cameras)) {
        let camera = posed.camera(given).map_err(|e| -> Error {
            let refused = camera_error(poses, posed, e.to_string());
            match e {
                IntrinsicsError::NoSize => UsageError::Missing {
                    what: refused.to_string(),
                    groups: vec![vec![("width", None), ("height", None)]],
                }
                .into(),
                IntrinsicsError::NoOptics => UsageError::Missing {
                    what: refused.to_string(),
                    groups: vec![vec![("fov", Some("DEGREES"))], vec![("k", Some("FX,FY,CX,CY"))]],
                }
                .into(),
                _ => refused,
            }
        })?;

        let w = camera.width;
        let h = camera.height;
        if w > MAX_SIDE || h > MAX_SIDE {
            let what = camera_error(poses, posed, format!("images of {w} × {h} pixels"));
            let range = format!("at most {MAX_SIDE} ({what})");
            return Err(UsageError::OutOfRange { option: "width", range }.into());
        }
        frames.push(Frame { name: &posed.name, stem, camera });
    }

    let panoramas = frames.iter().filter(|frame| frame.camera.is_panorama()).count();
    if panoramas > 0 && panoramas < frames.len() {
        let message = format!(
            "lists {panoramas} panoramas and {} other views: {CAMERAS} can hold one kind, so render them in \
             two calls",
            frames.len() - panoramas
        );
        return Err(FileError::format(poses, message).into());
    }

    Ok(frames)
}

/// Warns of entries that were left out and of lenses that are ignored.
fn tell_of_list(ctx: &Context, cameras: &[PosedCamera], untracked: usize) {
    if untracked > 0 {
        let all = cameras.len() + untracked;
        ctx.warn(format_args!("{untracked} of {all} poses are not known and left out"));
    }
    let distorted = cameras.iter().filter(|camera| camera.is_distorted()).count();
    if distorted > 0 {
        ctx.warn(format_args!(
            "{distorted} of {} cameras have a lens that bends: images are those of a pinhole with their \
             focal lengths and principal points, and fit undistorted pictures",
            cameras.len()
        ));
    }
}

/// Writes the images of all views into folders by kind. Returns the number of views that see nothing.
fn write_images(
    ctx: &Context,
    mesh: &s3d_geom::TriMesh,
    frames: &[Frame<'_>],
    folder: &Path,
    options: &RenderOptions,
) -> Result<u64> {
    let folder_of = |image: Image| folder.join(image.domain().folder());
    let path_of =
        |image: Image, stem: &str| folder_of(image).join(format!("{stem}.{}", image.domain().extension()));
    let faces = faces_fit(ctx, mesh.faces().len()).then(|| folder.join("faces"));
    let images = images(options)?;
    let folders: Vec<PathBuf> = images.iter().copied().map(folder_of).chain(faces.clone()).collect();
    folders.iter().try_for_each(|folder| create_dir(folder))?;

    let scene = Scene::new(mesh);
    let textures = MipMaps::new(mesh);
    let curvatures = curvatures(mesh, options);
    let channels = channels(&scene, &textures, &curvatures, options);
    let progress = ctx.progress("rendering", "views", frames.len() as u64);
    let blind = AtomicU64::new(0);
    let memory = || (Caster::new(&scene), Hits::default(), ImageBuffers::default());
    for_each_in_order(ctx, frames, memory, |(caster, hits, buffers), frame| {
        let Frame { stem, camera, name } = frame;
        caster.cast_into(camera, 1, hits);
        channels.encode(&images, hits, camera, buffers, |image, file| {
            write_bytes(&path_of(image, stem), &file).map(drop)
        })?;
        if let Some(faces) = &faces {
            write_bytes(&faces.join(format!("{stem}.png")), &face_image(hits, options.compression))?;
        }
        if hits.face.pixels().iter().all(|face| *face == NO_FACE) {
            blind.fetch_add(1, Ordering::Relaxed);
            ctx.debug(format_args!("{name:?} sees nothing of the mesh"));
        }
        progress.add(1);
        Ok(())
    })?;
    Ok(blind.into_inner())
}

/// Refuses a folder that holds anything, unless this command wrote it and may replace it.
fn check_free(output: &Path, overwrite: bool) -> Result<()> {
    let mut entries = match fs::read_dir(output) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        Err(e) => return Err(FileError::io(output, "use as the folder for the views", e).into()),
        Ok(entries) => entries,
    };
    let Some(first) = entries.next() else { return Ok(()) };
    let first = first.map_err(|e| FileError::io(output, "read", e))?.file_name();

    let folder = output.to_owned();
    let entry = first.display().to_string();
    match (is_ours(output), overwrite) {
        (true, true) => Ok(()),
        (true, false) => {
            let overwriting = Overwriting::Replaces("the views");
            Err(UsageError::Holds { folder, entry, overwriting }.into())
        }
        (false, _) => Err(UsageError::Foreign { folder, entry, generator: "s3d render" }.into()),
    }
}

/// Whether this command wrote a folder.
fn is_ours(folder: &Path) -> bool {
    #[derive(Deserialize)]
    struct Told {
        generator: String,
    }
    read_json::<Told>(&folder.join(CAMERAS)).is_ok_and(|told| told.generator == GENERATOR)
}
