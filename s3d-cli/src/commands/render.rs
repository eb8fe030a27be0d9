//! `s3d render`: one view of a mesh, without any annotation.

use super::{on_threads, refuse_existing};
use crate::args::RenderArgs;
use crate::failure::{Failure, Outcome};
use crate::pipeline::modality::{Image, Look, Prints};
use s3d_geom::{Camera, Pose};
use s3d_io::{Compression, Content, Conventions, create_dir, encode_rgb8, write_bytes, write_json};
use s3d_render::{Hits, MipMaps, NO_FACE, Normals, Scene, cast, coverage};
use serde::Serialize;
use std::time::Instant;
use tracing::{info, warn};

/// Colours for faces: all but (255, 255, 255), which means that nothing is seen.
const FACES_IN_COLORS: usize = 0xff_ffff;

/// What `camera.json` tells: enough to put the images back into the world.
#[derive(Serialize)]
struct View {
    width: u32,
    height: u32,
    projection: &'static str,
    camera_location: [f64; 3],
    /// Row by row; a panorama has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    camera_k_matrix: Option<[[f64; 3]; 3]>,
    /// World → camera, OpenCV axes, 3 × 4.
    camera_rt_matrix: [[f64; 4]; 3],
    field_of_view_rads: f64,
}

pub(crate) fn run(args: RenderArgs) -> Outcome<()> {
    on_threads(args.threads, || render(&args))
}

fn render(args: &RenderArgs) -> Outcome<()> {
    let pose = Pose::level(args.at, args.yaw.to_radians()).turned(0.0, args.pitch.to_radians());
    let camera = if args.pano {
        let width = args.size.unwrap_or(4096);
        if width % 2 == 1 {
            return Err(Failure::Call(format!(
                "--size {width}: a panorama is half as high as wide, so even"
            )));
        }
        Camera::equirectangular(pose, width)
    } else {
        let size = args.size.unwrap_or(1080);
        Camera::perspective(pose, args.fov.to_radians(), size, size)
    };
    let images = [
        (Image::Rgb, "rgb.png"),
        (Image::Depth, "depth.png"),
        (Image::Normal, "normals.png"),
        (Image::GlobalXyz, "global_xyz.exr"),
    ];
    let names = images.iter().map(|(_, name)| *name).chain(["faces.png", "camera.json"]);
    names.into_iter().try_for_each(|name| refuse_existing(&args.output.join(name), args.overwrite))?;

    let file = s3d_io::read_mesh(&args.mesh.mesh, args.mesh.up())?;
    file.warnings.iter().for_each(|w| warn!("{w}"));
    let scene = Scene::new(&file.mesh);
    let textures = MipMaps::new(&file.mesh);
    let started = Instant::now();
    let hits = cast(&scene, &camera);
    let cast_seconds = started.elapsed().as_secs_f64();
    if coverage(&hits) == 0.0 {
        let b = file.mesh.aabb();
        warn!(
            "nothing is seen from {}: the mesh lies between {} and {} (Z-up metres)",
            args.at, b.min, b.max
        );
    }
    let look = Look {
        scene: &scene,
        textures: &textures,
        pictures: None,
        normals: if args.smooth_normals { Normals::Smooth } else { Normals::Flat },
        label_per_face: &[],
        pretty_per_face: &[],
        compression: args.compression,
        conventions: Conventions::default(),
    };
    create_dir(&args.output)?;
    let kinds = images.map(|(image, _)| image);
    look.encode(&kinds, &hits, &camera, &mut Prints::default(), |image, file| {
        let name = images.iter().find(|(other, _)| *other == image).map_or("image", |(_, name)| name);
        write_bytes(&args.output.join(name), &file).map(drop)
    })?;
    if file.mesh.faces().len() < FACES_IN_COLORS {
        write_bytes(&args.output.join("faces.png"), &face_image(&hits, args.compression))?;
    } else {
        warn!("no faces.png: {} faces are more than 24 bits can tell apart", file.mesh.faces().len());
    }
    let view = View {
        width: camera.width,
        height: camera.height,
        projection: if args.pano { "equirectangular" } else { "perspective" },
        camera_location: camera.pose.location.to_array(),
        camera_k_matrix: (!args.pano).then(|| camera.k_matrix()),
        camera_rt_matrix: camera.pose.rt_matrix(),
        field_of_view_rads: camera.fov_rad(),
    };
    write_json(&args.output.join("camera.json"), &view)?;
    info!(
        "{}: {} × {} pixels, {:.1} % of them see the mesh ({:.2} s to cast)",
        args.output.display(),
        camera.width,
        camera.height,
        100.0 * coverage(&hits),
        cast_seconds
    );
    Ok(())
}

/// Face indices as colours, R·65536 + G·256 + B; (255, 255, 255) where nothing is seen.
fn face_image(hits: &Hits, compression: Compression) -> Vec<u8> {
    let image = hits.face.map(|face| {
        let [_, r, g, b] = if face == NO_FACE { [255; 4] } else { face.to_be_bytes() };
        [r, g, b]
    });
    encode_rgb8(&image, Content::Labels, compression)
}
