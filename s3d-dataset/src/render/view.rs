//! Renders one view of a mesh.

use crate::context::Context;
use crate::error::{Result, UsageError};
use crate::export::modality::{Channels, Image, ImageBuffers};
use crate::memory::check_memory;
use crate::mesh_axes::{MeshAxes, read_mesh};
#[cfg(feature = "clap")]
use crate::options::words;
use crate::store::refuse_existing;
use crate::store::staging::Staging;
use glam::DVec3;
use s3d_geom::{Camera, TriMesh};
use s3d_io::dataset::{Conventions, Domain};
use s3d_io::fs::{create_dir, write_bytes, write_json};
use s3d_io::image::{Compression, Content, encode_rgb8};
use s3d_io::mesh::MeshOrigin;
use s3d_render::{Hits, MipMaps, NO_FACE, Normals, Scene, cast, coverage, face_curvatures};
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

/// The number of colours for faces. (255, 255, 255) is not one: it means that nothing is seen.
const FACES_IN_COLORS: usize = 0xff_ffff;

/// The bytes that a pixel takes at most while images are made, one after the other, and encoded.
const PIXEL_BYTES: f64 = 32.0;

/// The content of `camera.json`, enough to place the images in the world.
#[derive(Serialize)]
struct View {
    width: u32,
    height: u32,
    projection: &'static str,
    camera_location: [f64; 3],
    /// Row by row; `None` for a panorama.
    #[serde(skip_serializing_if = "Option::is_none")]
    camera_k_matrix: Option<[[f64; 3]; 3]>,
    /// World → camera, OpenCV axes, 3 × 4.
    camera_rt_matrix: [[f64; 4]; 3],
    field_of_view_rads: f64,
    /// The offset that was subtracted from the coordinates of the mesh's file, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    world_offset_m: Option<[f64; 3]>,
}

/// The images of [`render()`] that are made unless others are asked for.
const USUAL: [Domain; 4] = [Domain::Rgb, Domain::Depth, Domain::Normal, Domain::GlobalXyz];

/// The options of [`render`]. With the feature `clap` it is a group of arguments of a command line.
#[derive(Clone, Debug)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct RenderOptions {
    /// What is known of the mesh's file.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub axes: MeshAxes,
    /// Interpolate the mesh's own normals where it has some, instead of using the normals of the faces.
    #[cfg_attr(feature = "clap", arg(long = "smooth-normals", action = clap::ArgAction::SetTrue,
        value_parser = words::smooth_normals()))]
    pub normals: Normals,
    /// Take N colour samples in a pixel where surfaces end or turn. All other images keep one sample.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=64)))]
    pub rgb_samples: u32,
    /// The images to write: any of `s3d export` that need no labels.
    #[cfg_attr(feature = "clap", arg(long, value_name = "LIST", value_delimiter = ',',
        default_values_t = USUAL, value_parser = words::parsed::<Domain>))]
    pub modalities: Vec<Domain>,
    /// Compression of the image files: fast, balanced (about as small as files by libpng and OpenEXR) or
    /// small (slowest). The pixels are the same.
    #[cfg_attr(feature = "clap", arg(long, value_name = "fast|balanced|small", default_value_t,
        value_parser = words::parsed::<Compression>))]
    pub compression: Compression,
    /// Replace existing images.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            axes: MeshAxes::default(),
            normals: Normals::Flat,
            rgb_samples: 1,
            modalities: USUAL.to_vec(),
            compression: Compression::default(),
            overwrite: false,
        }
    }
}

/// The images of a view that are asked for, in their own order, without the image of faces.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if one of them needs labels or is no image.
pub(super) fn images(options: &RenderOptions) -> Result<Vec<Image>> {
    let mut domains = options.modalities.clone();
    domains.sort();
    domains.dedup();
    let image_of = |domain: Domain| {
        let image = Image::of(domain).filter(|_| !domain.is_semantic());
        image.ok_or_else(|| {
            let why = format!("{domain} is no image of a mesh without labels");
            UsageError::InvalidValue { option: "modalities", value: domain.to_string(), why }.into()
        })
    };
    domains.into_iter().map(image_of).collect()
}

/// The inputs of these images.
pub(super) fn channels<'a>(
    scene: &'a Scene<'a>,
    textures: &'a MipMaps,
    curvature_of_face: &'a [[f32; 2]],
    options: &RenderOptions,
) -> Channels<'a> {
    Channels {
        scene,
        textures,
        pictures: None,
        normals: options.normals,
        rgb_samples: options.rgb_samples,
        label_of_face: &[],
        pretty_of_face: &[],
        class_of_face: &[],
        curvature_of_face,
        palette: &[],
        compression: options.compression,
        conventions: Conventions::default(),
    }
}

/// The curvatures of the faces, if they are asked for.
pub(super) fn curvatures(mesh: &TriMesh, options: &RenderOptions) -> Vec<[f32; 2]> {
    if options.modalities.contains(&Domain::PrincipalCurvature) {
        face_curvatures(mesh)
    } else {
        Vec::new()
    }
}

/// Whether every face has its own colour in an image of faces. Warns if not.
pub(super) fn faces_fit(ctx: &Context, faces: usize) -> bool {
    if faces >= FACES_IN_COLORS {
        ctx.warn(format_args!("no images of faces: {faces} faces are more than 24 bits can tell apart"));
    }
    faces < FACES_IN_COLORS
}

/// Renders what a camera sees of a mesh. Writes the images of [`RenderOptions::modalities`], `rgb.png`,
/// `depth.png`, `normals.png` and `global_xyz.exr` by default, and `faces.png` and `camera.json` into the
/// folder `output`.
/// Faces are indices as R·65536 + G·256 + B, or (255, 255, 255) where nothing is seen.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if one of the files exists and may not be replaced, or if a modality
/// needs labels;
/// [`Error::File`](crate::Error::File).
pub fn render(
    mesh: &Path,
    camera: &Camera,
    output: &Path,
    options: &RenderOptions,
    ctx: &Context,
) -> Result<()> {
    let images = images(options)?;
    let [width, height] = [camera.width, camera.height];
    let pixels = f64::from(width) * f64::from(height);
    check_memory(&format!("images of {width} × {height} pixels"), pixels * PIXEL_BYTES)?;
    // Several files make one result: all of them appear or none.
    let whole = Path::new("render");
    if !Staging::is_left(output, whole) {
        refuse_files(output, &images, options.overwrite)?;
    }

    let file = read_mesh(mesh, options.axes, MeshOrigin::Near, ctx)?;
    // Images are in the frame of the mesh, so the camera has its offset subtracted too.
    let mut camera = *camera;
    camera.pose.location -= file.offset_m;
    let camera = &camera;
    let world_offset_m = (file.offset_m != DVec3::ZERO).then(|| file.offset_m.to_array());
    if let Some(offset_m) = world_offset_m {
        ctx.info(format_args!(
            "the mesh lies far from the origin: {offset_m:?} is subtracted from its coordinates and the \
             camera's, which camera.json tells"
        ));
    }

    let scene = Scene::new(&file.mesh);
    let textures = MipMaps::new(&file.mesh);
    let started = Instant::now();
    let hits = cast(&scene, camera);
    let cast_seconds = started.elapsed().as_secs_f64();

    if coverage(&hits) == 0.0 {
        let b = file.mesh.aabb();
        ctx.warn(format_args!(
            "nothing is seen from {}: the mesh lies between {} and {} (Z-up metres)",
            camera.pose.location, b.min, b.max
        ));
    }

    let curvatures = curvatures(&file.mesh, options);
    let channels = channels(&scene, &textures, &curvatures, options);
    create_dir(output)?;
    let staging = Staging::begin(ctx, output, whole)?;
    refuse_files(output, &images, options.overwrite || staging.was_placing())?;
    let folder = staging.path();
    channels.encode(&images, &hits, camera, &mut ImageBuffers::default(), |image, file| {
        write_bytes(&folder.join(name_of(image)), &file).map(drop)
    })?;
    if faces_fit(ctx, file.mesh.faces().len()) {
        write_bytes(&folder.join("faces.png"), &face_image(&hits, options.compression))?;
    }

    let is_panorama = camera.is_panorama();
    let view = View {
        width: camera.width,
        height: camera.height,
        projection: if is_panorama { "equirectangular" } else { "perspective" },
        camera_location: camera.pose.location.to_array(),
        camera_k_matrix: (!is_panorama).then(|| camera.k_matrix()),
        camera_rt_matrix: camera.pose.rt_matrix(),
        field_of_view_rads: camera.fov_rad(),
        world_offset_m,
    };

    write_json(&folder.join("camera.json"), &view)?;
    staging.place_files(output)?;
    ctx.info(format_args!(
        "{}: {} × {} pixels, {:.1} % of them see the mesh ({:.2} s to cast)",
        output.display(),
        camera.width,
        camera.height,
        100.0 * coverage(&hits),
        cast_seconds
    ));
    Ok(())
}

/// The file name of an image.
fn name_of(image: Image) -> String {
    let domain = image.domain();
    format!("{}.{}", domain.suffix(), domain.extension())
}

/// Face indices as colours, R·65536 + G·256 + B; (255, 255, 255) where nothing is seen.
pub(super) fn face_image(hits: &Hits, compression: Compression) -> Vec<u8> {
    let image = hits.face.map(|face| {
        let [_, r, g, b] = if face == NO_FACE { [255; 4] } else { face.to_be_bytes() };
        [r, g, b]
    });
    encode_rgb8(&image, Content::Labels, compression)
}

/// Refuses a folder that holds a file of a view, unless it may be replaced.
fn refuse_files(output: &Path, images: &[Image], overwrite: bool) -> Result<()> {
    images
        .iter()
        .map(|image| name_of(*image))
        .chain(["faces.png", "camera.json"].map(str::to_owned))
        .try_for_each(|name| refuse_existing(&output.join(name), overwrite))
}
