//! Renders the views of many cameras: of a list, or of a walk through the mesh. The mesh is loaded once, and
//! all threads share the cameras.

use super::frame_names::frame_names;
use super::video;
use super::view::{RenderOptions, channels, curvatures, face_image, faces_fit, images};
use crate::condition::Condition;
use crate::context::Context;
use crate::error::{Error, InputError, Overwriting, Result, UsageError};
use crate::export::input::photographs::camera_error;
use crate::export::modality::ImageBuffers;
use crate::mesh_axes::read_mesh;
use crate::parallel::for_each_in_order;
use crate::place::{WalkOptions, walk};
use crate::store::parent_of;
use crate::store::staging::Staging;
use crate::useful::{judge_of, poses_findings};
use glam::{DAffine3, DVec3};
use s3d_geom::{Aabb, Camera};
use s3d_io::Error as FileError;
use s3d_io::camera::{
    GivenIntrinsics, IntrinsicsError, Optics, PosedCamera, PosedCameras, read_posed_cameras,
};
use s3d_io::dataset::Domain;
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

/// The horizontal angle of view of a walk, degrees.
const FOV_DEG: f64 = 75.0;

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
    /// The images a second of a video of the colour images, `rgb.mp4`. It is made by ffmpeg, which must be
    /// installed. `None`: no video.
    pub video_rate: Option<f64>,
}

impl Default for PosesOptions {
    fn default() -> Self {
        let intrinsics = GivenIntrinsics::default();
        Self {
            render: RenderOptions::default(),
            poses_up: UpAxis::Z,
            intrinsics,
            allow: Vec::new(),
            video_rate: None,
        }
    }
}

/// The counts that [`render_poses`] and [`render_walk`] return.
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
    check_output(output, options)?;
    let world_from_poses = DAffine3::from_mat3(options.poses_up.rotation());
    let PosedCameras { cameras, untracked, .. } = read_posed_cameras(poses, &world_from_poses)?;
    let mut frames = frames(poses, &cameras, &options.intrinsics)?;
    tell_of_list(ctx, &cameras, untracked);

    let file = read_mesh(mesh, options.render.axes, MeshOrigin::Near, ctx)?;
    // Images are in the frame of the mesh, so cameras have its offset subtracted too.
    frames
        .iter_mut()
        .for_each(|frame| frame.camera.pose.location -= file.offset_m);
    let scene = Scene::new(&file.mesh);
    let rendered = write_views(output, &scene, file.offset_m, &frames, options, ctx)?;
    Ok(RenderedPoses { untracked: untracked as u64, ..rendered })
}

/// Renders the views of somebody who walks through a mesh (see [`walk`](crate::walk)), as [`render_poses`]
/// does those of a list. Images are named by their number, `000000` first. Sizes that the options do not give
/// are 1080 pixels, or those of a panorama 4096 × 2048; the angle of view is 75°.
///
/// # Errors
/// [`Error::Usage`] if the folder is not empty and may not be replaced, or a number is out of range;
/// [`Error::File`]; [`Error::Input`] if there is no way of a metre; [`Error::Cancelled`].
pub fn render_walk(
    mesh: &Path,
    way: &WalkOptions,
    output: &Path,
    options: &PosesOptions,
    ctx: &Context,
) -> Result<RenderedPoses> {
    check_output(output, options)?;
    let file = read_mesh(mesh, options.render.axes, MeshOrigin::Near, ctx)?;
    let scene = Scene::new(&file.mesh);
    let poses = walk(&scene, way, ctx).map_err(|e| match e {
        Error::Input(InputError::Unfit { why, .. }) => InputError::Unfit { path: mesh.into(), why }.into(),
        other => other,
    })?;
    let cameras: Vec<PosedCamera> = (0..)
        .zip(poses)
        .map(|(number, pose)| PosedCamera::new(format!("{number:06}"), pose))
        .collect();

    let GivenIntrinsics { width, height, optics } = options.intrinsics;
    let is_panorama = optics == Some(Optics::Equirectangular);
    let width = width.unwrap_or(if is_panorama { 4096 } else { 1080 });
    let given = GivenIntrinsics {
        width: Some(width),
        height: height.or(Some(if is_panorama { width / 2 } else { width })),
        optics: optics.or(Some(Optics::AngleOfView { fov_rad: FOV_DEG.to_radians() })),
    };
    let frames = frames(mesh, &cameras, &given)?;
    write_views(output, &scene, file.offset_m, &frames, options, ctx)
}

/// Checks before anything is read that the result can be written.
fn check_output(output: &Path, options: &PosesOptions) -> Result<()> {
    if let Some(rate) = options.video_rate {
        video::check(rate, &options.render.modalities)?;
    }
    let folder_name = Path::new(output.file_name().unwrap_or_default());
    if Staging::is_left(&parent_of(output), folder_name) {
        return Ok(());
    }
    check_free(output, options.render.overwrite)
}

/// Writes the folder of all views. `offset_m` was subtracted from the mesh and the cameras.
fn write_views(
    output: &Path,
    scene: &Scene<'_>,
    offset_m: DVec3,
    frames: &[Frame<'_>],
    options: &PosesOptions,
    ctx: &Context,
) -> Result<RenderedPoses> {
    let parent = parent_of(output);
    let folder_name = Path::new(output.file_name().unwrap_or_default());
    let world_offset_m = (offset_m != DVec3::ZERO).then(|| offset_m.to_array());
    if let Some(offset_m) = world_offset_m {
        ctx.info(format_args!(
            "the mesh lies far from the origin: {offset_m:?} is subtracted from its coordinates and the \
             cameras', which {CAMERAS} tells"
        ));
    }

    create_dir(&parent)?;
    let staging = Staging::begin(ctx, &parent, folder_name)?;
    check_free(output, options.render.overwrite || staging.was_placing())?;
    let started = Instant::now();
    let blind = write_images(ctx, scene, frames, staging.path(), &options.render)?;
    let seconds = started.elapsed().as_secs_f64();

    let places = frames.iter().map(|frame| frame.camera.pose.location.as_vec3());
    let places = Aabb::from_points(places);
    let count = frames.len() as u64;
    let findings = poses_findings(blind, count, &places, &scene.mesh().aabb(), "up and poses_up");
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
    if let Some(rate) = options.video_rate {
        let pictures = frames
            .iter()
            .map(|frame| path_of(staging.path(), Domain::Rgb, &frame.stem));
        video::write(ctx, pictures, rate, staging.path())?;
    }
    staging.place_folder(output, is_ours(output))?;
    ctx.info(format_args!("{}: {} views in {seconds:.1} s", output.display(), frames.len()));
    Ok(RenderedPoses { views: frames.len() as u64, blind, untracked: 0 })
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
    scene: &Scene<'_>,
    frames: &[Frame<'_>],
    folder: &Path,
    options: &RenderOptions,
) -> Result<u64> {
    let mesh = scene.mesh();
    let faces = faces_fit(ctx, mesh.faces().len()).then(|| folder.join("faces"));
    let images = images(options)?;
    let of_images = images.iter().map(|image| folder.join(image.domain().folder()));
    let folders: Vec<PathBuf> = of_images.chain(faces.clone()).collect();
    folders.iter().try_for_each(|folder| create_dir(folder))?;

    let textures = MipMaps::new(mesh);
    let curvatures = curvatures(mesh, options);
    let channels = channels(scene, &textures, &curvatures, options);
    let progress = ctx.progress("rendering", "views", frames.len() as u64);
    let blind = AtomicU64::new(0);
    let memory = || (Caster::new(scene), Hits::default(), ImageBuffers::default());
    for_each_in_order(ctx, frames, memory, |(caster, hits, buffers), frame| {
        let Frame { stem, camera, name } = frame;
        caster.cast_into(camera, 1, hits);
        channels.encode(&images, hits, camera, buffers, |image, file| {
            write_bytes(&path_of(folder, image.domain(), stem), &file).map(drop)
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

/// The file of an image in a folder of views.
fn path_of(folder: &Path, domain: Domain, stem: &str) -> PathBuf {
    folder
        .join(domain.folder())
        .join(format!("{stem}.{}", domain.extension()))
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
