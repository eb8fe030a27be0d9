//! Scenes whose images are known in closed form: depth, normals, coordinates and colours of pixels.

#[path = "../benches/common/mod.rs"]
mod common;

use s3d_geom::glam::{DVec3, Vec2, Vec3, dvec2, dvec3, vec2, vec3};
use s3d_geom::{Camera, Material, MeshParts, NO_INDEX, Pose, Raster, Texture, TriMesh, Wrap};
use s3d_render::{
    Hits, MipMaps, Modalities, NO_FACE, Normals, Scene, Shading, TextureFilter, view_images_into,
};

/// Returns a room of 4 × 4 × 3 m around (0, 0, 1.5). It has two faces a wall; the index of a face / 2 is 0
/// for the floor, 1 for the ceiling, and for the walls 2 at +Y, 3 at −Y, 4 at +X, 5 at −X. The faces are
/// wound to face inwards, and textured with (0, 0) to (1, 1) a wall.
fn room_parts() -> MeshParts {
    let corner = |x: f32, y: f32, z: f32| vec3(2.0 * x, 2.0 * y, 1.5 + 1.5 * z);
    let walls = [
        [corner(-1., -1., -1.), corner(1., -1., -1.), corner(1., 1., -1.), corner(-1., 1., -1.)],
        [corner(-1., 1., 1.), corner(1., 1., 1.), corner(1., -1., 1.), corner(-1., -1., 1.)],
        [corner(-1., 1., -1.), corner(1., 1., -1.), corner(1., 1., 1.), corner(-1., 1., 1.)],
        [corner(1., -1., -1.), corner(-1., -1., -1.), corner(-1., -1., 1.), corner(1., -1., 1.)],
        [corner(1., 1., -1.), corner(1., -1., -1.), corner(1., -1., 1.), corner(1., 1., 1.)],
        [corner(-1., -1., -1.), corner(-1., 1., -1.), corner(-1., 1., 1.), corner(-1., -1., 1.)],
    ];
    let quad = |w: u32| [[4 * w, 4 * w + 1, 4 * w + 2], [4 * w, 4 * w + 2, 4 * w + 3]];
    MeshParts {
        positions: walls.concat(),
        faces: (0..6).flat_map(quad).collect(),
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        face_uvs: (0..6).flat_map(|_| [[0, 1, 2], [0, 2, 3]]).collect(),
        ..MeshParts::default()
    }
}

fn textured(image: Raster<[u8; 3]>, wrap: Wrap) -> TriMesh {
    let parts = room_parts();
    let materials = vec![Material { name: "paper".into(), color: [9; 3], texture: Some(0) }];
    let textures = vec![Texture { name: "paper".into(), image, wrap: [wrap; 2] }];
    TriMesh::new(MeshParts { face_materials: vec![0; 12], materials, textures, ..parts }).unwrap()
}

fn room() -> TriMesh {
    TriMesh::new(room_parts()).unwrap()
}

const EYE: DVec3 = DVec3::new(0.25, -0.5, 1.5);

fn view(yaw: f64, pitch: f64) -> Camera {
    Camera::perspective(Pose::level(EYE, 0.0).turned(yaw, pitch), 90f64.to_radians(), 100, 80)
}

fn rgb(mesh: &TriMesh, camera: &Camera) -> Raster<[u8; 3]> {
    let scene = Scene::new(mesh);
    let hits = s3d_render::cast(&scene, camera);
    s3d_render::rgb_image(&scene, &MipMaps::new(mesh), &hits, camera)
}

#[test]
fn a_wall_ahead_has_one_depth_and_the_papers_normal() {
    let mesh = room();
    let camera = view(0.0, 0.0);
    let scene = Scene::new(&mesh);
    let hits = s3d_render::cast(&scene, &camera);
    let depth = s3d_render::depth_image(&hits);
    let normal = s3d_render::normal_image(&scene, &hits, &camera, Normals::Flat);
    let wall = |w: u32| move |f: u32| f / 2 == w;

    // The wall at +Y is 2.5 m ahead: z-depth does not depend on the pixel.
    for (k, &face) in hits.face.pixels().iter().enumerate().filter(|(_, f)| wall(2)(**f)) {
        assert_eq!(hits.depth.pixels()[k], 2.5, "{face}");
        assert_eq!(depth.pixels()[k], 1280);
        assert_eq!(normal.pixels()[k], [128, 128, 255]);
    }

    // The right and left walls face left and right. The floor faces up (green is down), and the ceiling down.
    for (w, expected) in [(4, [0, 128, 128]), (5, [255, 128, 128]), (0, [128, 0, 128]), (1, [128, 255, 128])]
    {
        let k = hits
            .face
            .pixels()
            .iter()
            .position(|&f| wall(w)(f))
            .expect("every wall but one is in sight");
        assert_eq!(normal.pixels()[k], expected, "wall {w}");
    }
    assert!(!hits.face.pixels().iter().any(|&f| wall(3)(f)), "what lies behind is not seen");

    // +X is to the right, +Z is up.
    assert!(wall(4)(hits.face.at(99, 40)) && wall(5)(hits.face.at(0, 40)));
    assert_eq!(s3d_render::coverage(&hits), 1.0);
}

#[test]
fn a_panorama_is_not_mirrored_and_holds_distances() {
    let mesh = room();
    let scene = Scene::new(&mesh);
    let camera = Camera::equirectangular(Pose::level(EYE, 0.0).turned(0.0, 0.3), 256);
    let hits = s3d_render::cast(&scene, &camera);
    let wall = |x: u32, y: u32| hits.face.at(x, y) / 2;
    assert_eq!([wall(128, 64), wall(192, 64), wall(64, 64), wall(0, 64), wall(255, 64)], [2, 4, 5, 3, 3]);
    assert_eq!([wall(10, 0), wall(200, 127)], [1, 0]);

    let normal = s3d_render::normal_image(&scene, &hits, &camera, Normals::Flat);
    // (R, G, B) = (X, −Z, Y) of the world, towards the camera.
    assert_eq!(normal.at(128, 64), [128, 128, 0]);
    assert_eq!(normal.at(192, 64), [0, 128, 128]);
    assert_eq!(normal.at(0, 127), [128, 0, 128]);

    for (x, y) in [(128, 64), (192, 60), (20, 3), (99, 111)] {
        let d = camera.rays().at(x, y);
        let t = [
            (2.0 - EYE.x) / d.x,
            (-2.0 - EYE.x) / d.x,
            (2.0 - EYE.y) / d.y,
            (-2.0 - EYE.y) / d.y,
            1.5 / d.z.abs(),
        ]
        .into_iter()
        .filter(|t| *t > 0.0)
        .fold(f64::MAX, f64::min);
        assert!((f64::from(hits.depth.at(x, y)) - t).abs() < 1e-6 * t);
    }
}

#[test]
fn coordinates_project_back_to_their_pixels() {
    let mesh = room();
    let scene = Scene::new(&mesh);
    for camera in [view(0.7, -0.3), Camera::equirectangular(Pose::level(EYE, 1.0), 128)] {
        let hits = s3d_render::cast(&scene, &camera);
        let xyz = s3d_render::xyz_image(&hits, &camera);
        let half = s3d_render::xyz_image_half(&hits, &camera);

        for y in 0..camera.height {
            for x in 0..camera.width {
                let p = Vec3::from(xyz.at(x, y)).as_dvec3();
                let (pixel, depth) = camera.project(p).unwrap();
                let off = (pixel.x - f64::from(x) - 0.5)
                    .abs()
                    .max((pixel.y - f64::from(y) - 0.5).abs());
                assert!(off < 1e-3, "{pixel} for ({x}, {y})");
                assert!((depth - f64::from(hits.depth.at(x, y))).abs() < 1e-5);
                // Each point is on a wall, to the rounding of f32; half floats add their own rounding.
                let wall = [2.0 - p.x.abs(), 2.0 - p.y.abs(), 1.5 - (p.z - 1.5).abs()];
                assert!(wall.iter().any(|w| w.abs() < 1e-6), "{p}");
                for k in 0..3 {
                    assert!(
                        (f64::from(half.at(x, y)[k].to_f32()) - p[k]).abs() <= p[k].abs() / 2048.0 + 1e-7
                    );
                }
            }
        }
    }
}

#[test]
fn what_is_missing_is_missing_everywhere() {
    // One wall, seen past its edge.
    let parts = room_parts();
    let mut mesh = MeshParts { faces: parts.faces[4..6].to_vec(), face_uvs: vec![], ..parts };
    mesh.colors = vec![[0; 3]; mesh.positions.len()];
    let mesh = TriMesh::new(mesh).unwrap();

    let scene = Scene::new(&mesh);
    let camera = view(0.9, 0.2);
    let hits = s3d_render::cast(&scene, &camera);
    let share = s3d_render::coverage(&hits);
    assert!(share > 0.05 && share < 0.95);

    let rgb = s3d_render::rgb_image(&scene, &MipMaps::new(&mesh), &hits, &camera);
    let depth = s3d_render::depth_image(&hits);
    let [flat, smooth] =
        [Normals::Flat, Normals::Smooth].map(|n| s3d_render::normal_image(&scene, &hits, &camera, n));
    let index = s3d_render::index_image(&hits, &[0, 0x01_02_03]);
    let pretty = s3d_render::color_per_face_image(&hits, &[[7, 8, 9], [0, 0, 1]]);
    let bytes = s3d_render::byte_per_face_image(&hits, &[7, 9], 255);
    let xyz = s3d_render::xyz_image(&hits, &camera);
    let half = s3d_render::xyz_image_half(&hits, &camera);

    for (k, &face) in hits.face.pixels().iter().enumerate() {
        let missing = face == NO_FACE;
        assert_eq!(hits.depth.pixels()[k].is_infinite(), missing);
        assert_eq!(
            rgb.pixels()[k],
            if missing { [0, 0, 0] } else { [1, 1, 1] },
            "black paint is nearly black"
        );
        assert_eq!(depth.pixels()[k] == 65_535, missing);
        assert_eq!(bytes.pixels()[k], if missing { 255 } else { [7, 9][face as usize] });
        assert_eq!(flat.pixels()[k] == [128; 3], missing);
        assert_eq!(smooth.pixels()[k], flat.pixels()[k], "without corner normals faces are flat");
        let expected = [[13, 13, 13], [0, 0, 0], [1, 2, 3]][face.wrapping_add(1) as usize];
        assert_eq!(index.pixels()[k], expected);
        assert_eq!(pretty.pixels()[k], [[0, 0, 0], [7, 8, 9], [0, 0, 1]][face.wrapping_add(1) as usize]);
        assert_eq!(xyz.pixels()[k] == [0.0; 3], missing);
        assert_eq!(half.pixels()[k].map(f32::from) == [0.0; 3], missing);
    }
}

#[test]
fn depth_is_rounded_half_up_and_saturates() {
    let depths = [0.0f32, 0.000_976_562_5, 0.000_976, 1.0, 127.998, 127.999_02, 128.5, 1e9, f32::INFINITY];
    let hits = Hits { face: Raster::filled(9, 1, 0), depth: Raster::from_vec(9, 1, depths.to_vec()) };
    let expected = [0, 1, 0, 512, 65_535, 65_535, 65_535, 65_535, 65_535];
    assert_eq!(s3d_render::depth_image(&hits).pixels(), expected);
    let hits = Hits { face: Raster::filled(1, 1, 0), depth: Raster::filled(1, 1, 127.996) };
    assert_eq!(s3d_render::depth_image(&hits).pixels(), [65_534]);
}

#[test]
fn depth_in_millimetres_is_rounded_half_up_and_saturates() {
    let depths = [0.0f32, 0.000_5, 0.000_49, 1.0, 1.062_5, 65.534, 65.535, 66.0, 1e9, f32::INFINITY];
    let hits = Hits { face: Raster::filled(10, 1, 0), depth: Raster::from_vec(10, 1, depths.to_vec()) };
    let mut image = Raster::filled(1, 1, 7);
    s3d_render::depth_image_mm_into(&hits, &mut image);
    let expected = [0, 1, 0, 1000, 1063, 65_534, 65_535, 65_535, 65_535, 65_535];
    assert_eq!(image.pixels(), expected);
}

#[test]
fn opencv_axes_turn_the_third_channel_of_views_and_nothing_of_panoramas() {
    use s3d_geom::NormalAxes;
    let mesh = TriMesh::new(room_parts()).unwrap();
    let scene = Scene::new(&mesh);
    let pose = Pose::level(dvec3(0.3, -0.2, 0.1), 0.7).turned(0.2, -0.3);
    let pinhole = Camera::pinhole(pose, dvec2(30.0, 34.0), dvec2(9.0, 21.0), 40, 30).unwrap();

    for camera in [Camera::perspective(pose, 1.2, 40, 30), pinhole, Camera::equirectangular(pose, 40)] {
        let hits = s3d_render::cast(&scene, &camera);
        for normals in [Normals::Flat, Normals::Smooth] {
            let [mut paper, mut opencv] = [0, 0].map(|_| Raster::filled(0, 0, [0u8; 3]));
            s3d_render::normal_image_into(&scene, &hits, &camera, normals, NormalAxes::Paper, &mut paper);
            s3d_render::normal_image_into(&scene, &hits, &camera, normals, NormalAxes::OpenCv, &mut opencv);
            assert_eq!(paper, s3d_render::normal_image(&scene, &hits, &camera, normals));
            if camera.height == 20 {
                assert_eq!(paper, opencv);
                continue;
            }

            let mut seen = 0;
            let mut towards = 0;
            for (p, o) in paper.pixels().iter().zip(opencv.pixels()) {
                assert_eq!(p[..2], o[..2]);
                if *p == [128; 3] {
                    assert_eq!(o, p, "missing stays missing");
                    continue;
                }
                seen += 1;
                towards += u32::from(p[2] > o[2]);
                assert!([255, 256].contains(&(u32::from(p[2]) + u32::from(o[2]))), "{p:?} {o:?}");
            }
            assert!(seen > 0 && 4 * towards > 3 * seen, "{towards} of {seen}");
        }
    }
}

#[test]
fn normals_face_the_camera_from_either_side() {
    let flipped: Vec<[u32; 3]> = room_parts().faces.iter().map(|&[a, b, c]| [a, c, b]).collect();
    let other = TriMesh::new(MeshParts { faces: flipped, ..room_parts() }).unwrap();
    for camera in [view(0.4, 0.1), Camera::equirectangular(Pose::level(EYE, 0.0), 64)] {
        let [one, two] = [&room(), &other].map(|mesh| {
            let scene = Scene::new(mesh);
            let hits = s3d_render::cast(&scene, &camera);
            s3d_render::normal_image(&scene, &hits, &camera, Normals::Flat)
        });
        assert_eq!(one, two);
    }
}

#[test]
fn vectors_of_normals_are_what_bytes_round() {
    let mesh = s3d_synth::scenes::scan_like(3000, 5);
    let scene = Scene::new(&mesh);
    let pose = Pose::level(dvec3(3.0, 2.5, 1.5), 0.7).turned(0.0, -0.3);
    for camera in [Camera::perspective(pose, 1.3, 97, 61), Camera::equirectangular(pose, 128)] {
        let hits = s3d_render::cast(&scene, &camera);
        for (normals, axes) in [
            (Normals::Flat, s3d_geom::NormalAxes::Paper),
            (Normals::Flat, s3d_geom::NormalAxes::OpenCv),
            (Normals::Smooth, s3d_geom::NormalAxes::Paper),
        ] {
            let mut bytes = Raster::filled(0, 0, [0; 3]);
            s3d_render::normal_image_into(&scene, &hits, &camera, normals, axes, &mut bytes);
            let vectors = s3d_render::normal_vectors(&scene, &hits, &camera, normals, axes);

            for ((byte, n), face) in bytes.pixels().iter().zip(vectors.pixels()).zip(hits.face.pixels()) {
                if *face == NO_FACE {
                    assert!(*byte == s3d_render::MISSING_NORMAL && n.iter().all(|n| n.is_nan()));
                    continue;
                }
                assert!((n.iter().map(|n| n * n).sum::<f32>() - 1.0).abs() < 1e-5);
                // The bounds are half a step, and the rounding of 32 bits.
                let far = |k: usize| (127.5 + 127.5 * f64::from(n[k]) - f64::from(byte[k])).abs();
                assert!((0..3).all(|k| far(k) < 0.5 + 1e-4), "{n:?} {byte:?}");
            }
        }
    }
}

#[test]
fn smooth_normals_are_interpolated_and_never_point_away() {
    // The wall at +Y bulges: its corner normals lean outwards; in the second case beyond what the camera can
    // see.
    for lean in [0.5, 2.0] {
        let mut parts = room_parts();
        parts.normals = vec![vec3(-lean, -1.0, 0.0).normalize(), vec3(lean, -1.0, 0.0).normalize()];
        parts.face_normals = vec![[NO_INDEX; 3]; 12];
        (parts.face_normals[4], parts.face_normals[5]) = ([0, 1, 1], [0, 1, 0]);

        let mesh = TriMesh::new(parts).unwrap();
        let scene = Scene::new(&mesh);
        let camera = view(0.0, 0.0);
        let hits = s3d_render::cast(&scene, &camera);
        let image = s3d_render::normal_image(&scene, &hits, &camera, Normals::Smooth);

        let mut reds = Vec::new();
        for y in 0..camera.height {
            for x in 0..camera.width {
                let channels = DVec3::from(image.at(x, y).map(f64::from)) / 127.5 - 1.0;
                let d = camera.pose.opencv_from_world() * camera.rays().at(x, y);
                let towards = channels.dot(dvec3(d.x, d.y, -d.z).normalize());
                assert!(towards < 0.01, "({x}, {y}): {towards}");
                if y == 40 && hits.face.at(x, y) / 2 == 2 {
                    reds.push(image.at(x, y)[0]);
                }
            }
        }

        assert!(reds.len() > 30 && reds[0] < 90 && reds[reds.len() - 1] > 160, "{reds:?}");
        assert!(lean > 1.0 || reds.is_sorted(), "{reds:?}");
    }
}

/// Returns a chart: red grows to the right, green upwards, and blue marks the lower left.
fn chart(size: u32) -> Raster<[u8; 3]> {
    let step = 256 / size;
    let pixel = |k: u32| {
        let x = k % size;
        let y = size - 1 - k / size;
        [(x * step) as u8, (y * step) as u8, if x < size / 4 && y < size / 4 { 200 } else { 20 }]
    };
    Raster::from_vec(size, size, (0..size * size).map(pixel).collect())
}

#[test]
fn a_magnified_texture_is_bilinear() {
    let mesh = textured(chart(16), Wrap::Clamp);
    let camera = Camera::perspective(Pose::level(EYE, 0.0), 60f64.to_radians(), 300, 200);
    let image = rgb(&mesh, &camera);
    let scene = Scene::new(&mesh);
    let hits = s3d_render::cast(&scene, &camera);
    let xyz = s3d_render::xyz_image(&hits, &camera);
    for (x, y) in [(150, 100), (3, 190), (299, 0), (0, 0), (77, 13), (200, 150)] {
        assert_eq!(hits.face.at(x, y) / 2, 2);
        let [px, _, pz] = xyz.at(x, y);
        let expected = mesh.textures()[0].sample(vec2((px + 2.0) / 4.0, pz / 3.0));
        for k in 0..3 {
            assert!((f32::from(image.at(x, y)[k]) - expected[k]).abs() < 0.51, "({x}, {y}): {expected:?}");
        }
    }
    // Red grows to the right, green upwards.
    assert!(image.at(250, 100)[0] > image.at(50, 100)[0] && image.at(150, 20)[1] > image.at(150, 180)[1]);
}

fn checker(size: u32) -> Raster<[u8; 3]> {
    let pixel = |k: u32| {
        if (k % size + k / size).is_multiple_of(2) {
            [255; 3]
        } else {
            [0; 3]
        }
    };
    Raster::from_vec(size, size, (0..size * size).map(pixel).collect())
}

#[test]
fn a_distant_checkerboard_is_grey() {
    for (size, wrap) in [(1024, Wrap::Repeat), (1023, Wrap::Mirror), (777, Wrap::Clamp)] {
        let mesh = textured(checker(size), wrap);
        // A pixel covers more than 16 texels.
        for camera in [
            Camera::perspective(Pose::level(EYE, 0.3), 75f64.to_radians(), 32, 32),
            Camera::equirectangular(Pose::level(EYE, 0.3), 64),
        ] {
            for pixel in rgb(&mesh, &camera).pixels() {
                assert!(pixel.iter().all(|c| (108..=148).contains(c)), "{pixel:?}");
            }
        }
    }
}

#[test]
fn a_floor_seen_at_an_angle_keeps_what_runs_along_it() {
    // The stripes run away from the camera and are 4 texels wide: at a grazing angle plain mip maps blur
    // them.
    let pixel = |k: u32| {
        if (k % 512 / 4).is_multiple_of(2) {
            [250; 3]
        } else {
            [10; 3]
        }
    };

    let mesh = textured(Raster::from_vec(512, 512, (0..512 * 512).map(pixel).collect()), Wrap::Clamp);
    let pose = Pose::level(dvec3(0.0, -1.9, 0.25), 0.0);
    let camera = Camera::perspective(pose, 50f64.to_radians(), 400, 400);
    let scene = Scene::new(&mesh);
    let hits = s3d_render::cast(&scene, &camera);
    let mip_maps = MipMaps::new(&mesh);

    let contrast = |max_taps: u32| {
        let filter = s3d_render::TextureFilter { max_taps };
        let image = s3d_render::rgb_image_with(&scene, &mip_maps, &hits, &camera, &filter);
        let row: Vec<u8> = (120..280)
            .filter(|&x| hits.face.at(x, 235) < 2)
            .map(|x| image.at(x, 235)[0])
            .collect();
        assert!(row.len() > 100);
        row.iter().max().unwrap() - row.iter().min().unwrap()
    };

    let sharp = contrast(8);
    let blurred = contrast(1);
    assert!(sharp > 150 && blurred < sharp / 2, "{sharp} {blurred}");
}

#[test]
fn colours_without_a_texture() {
    let mut parts = room_parts();
    parts.materials = vec![Material { name: "red".into(), color: [200, 10, 0], texture: None }];
    parts.face_materials = vec![0; 12];
    let flat = TriMesh::new(parts.clone()).unwrap();
    assert!(rgb(&flat, &view(0.2, 0.0)).pixels().iter().all(|p| *p == [200, 10, 0]));
    // The corners of each wall go from black at the bottom to white at the top.
    parts.colors = (0..24).map(|k| if k % 4 < 2 { [0; 3] } else { [255; 3] }).collect();
    let camera = view(0.0, 0.0);
    let image = rgb(&TriMesh::new(parts).unwrap(), &camera);
    for y in 20..60 {
        let z = 1.5 - 2.5 * (f64::from(y) + 0.5 - 40.0) / 50.0;
        let expected = z / 3.0 * 255.0;
        assert!((f64::from(image.at(50, y)[0]) - expected).abs() <= 0.51, "row {y}");
    }
}

#[test]
#[should_panic(expected = "hits of 100×80 pixels for a camera of 64×32")]
fn hits_of_another_camera_are_a_callers_mistake() {
    let mesh = room();
    let hits = s3d_render::cast(&Scene::new(&mesh), &view(0.0, 0.0));
    let _ = s3d_render::xyz_image(&hits, &Camera::equirectangular(Pose::level(EYE, 0.0), 64));
}

#[test]
#[should_panic(expected = "does not fit into 24 bits")]
fn an_index_beyond_24_bits_is_a_callers_mistake() {
    let mesh = room();
    let hits = s3d_render::cast(&Scene::new(&mesh), &view(0.0, 0.0));
    let _ = s3d_render::index_image(&hits, &[1 << 24; 12]);
}

/// Compares the fast image with the image of single pixels. Channels may differ by at most 1, except in a few
/// pixels where rounding decides how many samples are taken.
fn close(mesh: &TriMesh, camera: &Camera, max_taps: u32) {
    let scene = Scene::new(mesh);
    let mip_maps = MipMaps::new(mesh);
    let hits = s3d_render::cast(&scene, camera);
    let filter = s3d_render::TextureFilter { max_taps };
    let fast = s3d_render::rgb_image_with(&scene, &mip_maps, &hits, camera, &filter);
    let exact = s3d_render::rgb_image_pixel_by_pixel(&scene, &mip_maps, &hits, camera, &filter);

    let mut differ = 0;
    let mut samples_differ = 0;
    for (k, (f, e)) in fast.pixels().iter().zip(exact.pixels()).enumerate() {
        let most = (0..3).map(|c| f[c].abs_diff(e[c])).max().unwrap_or(0);
        assert!(most <= 20, "pixel {k} of {camera:?}: {f:?} for {e:?}");
        samples_differ += usize::from(most > 1);
        differ += usize::from(most > 0);
        assert_eq!(*f == [0; 3], hits.face.pixels()[k] == NO_FACE);
    }
    assert!(samples_differ <= 1 + fast.len() / 20_000, "{samples_differ} pixels of {camera:?}");

    // Single rays through the centres of pixels give the same colours.
    let mut rays_differ = 0;
    for (k, e) in exact.pixels().iter().enumerate().step_by(13) {
        let face = hits.face.pixels()[k];
        let width = camera.width as usize;
        if face == NO_FACE {
            continue;
        }
        let direction = camera.direction((k % width) as f64 + 0.5, (k / width) as f64 + 0.5);
        let color = s3d_render::rgb_of_ray(&scene, &mip_maps, camera, direction, face, &filter);
        rays_differ += usize::from((0..3).any(|c| color[c].abs_diff(e[c]) > 1));
    }
    assert!(rays_differ <= 1 + fast.len() / 20_000, "{rays_differ} rays of {camera:?}");

    // A colour is off by 0.1 at most, and so it is seldom rounded differently.
    assert!(differ * 10 <= fast.len(), "{differ} of {} pixels are rounded otherwise", fast.len());
}

fn all_kinds(location: DVec3) -> Vec<Camera> {
    let pose = Pose::level(location, 0.4);
    vec![
        Camera::perspective(pose.turned(0.3, 0.1), 75f64.to_radians(), 333, 250),
        Camera::perspective(pose.turned(2.0, -0.9), 40f64.to_radians(), 97, 61),
        Camera::perspective(pose.turned(-1.0, 0.3), 170f64.to_radians(), 200, 120),
        Camera::perspective(pose, 1.0, 3, 2),
        Camera::pinhole(pose, dvec2(200.0, 260.0), dvec2(90.0, 201.5), 240, 320).unwrap(),
        Camera::pinhole(pose.turned(1.0, 0.2), dvec2(90.0, 30.0), dvec2(-60.0, 31.0), 97, 61).unwrap(),
        Camera::equirectangular(pose, 500),
        Camera::equirectangular(pose, 38),
    ]
}

#[test]
fn rgb_is_what_single_pixels_give() {
    let noise = |size: u32| {
        let pixel = |k: u32| k.wrapping_mul(0x9E37_79B1).rotate_left(k % 23).to_le_bytes();
        Raster::from_vec(size, size, (0..size * size).map(|k| std::array::from_fn(|c| pixel(k)[c])).collect())
    };

    for (size, wrap) in [
        (512, Wrap::Repeat),
        (301, Wrap::Mirror),
        (64, Wrap::Clamp),
        (5, Wrap::Repeat),
        (2, Wrap::Mirror),
        (1, Wrap::Clamp),
    ] {
        // As it is; several times over each wall and off to one side; far out.
        for (scale, shift) in [(1.0, vec2(0.0, 0.0)), (3.7, vec2(-1.3, 0.6)), (0.9, vec2(1000.25, -77.5))] {
            let mut parts = textured(noise(size), wrap).into_parts();
            parts.uvs.iter_mut().for_each(|uv| *uv = *uv * scale + shift);
            let mesh = TriMesh::new(parts).unwrap();
            for camera in all_kinds(EYE) {
                close(&mesh, &camera, 8);
            }
            close(&mesh, &all_kinds(EYE)[0], 1);
            // The eye is nearly on the floor.
            close(&mesh, &all_kinds(dvec3(-1.5, 1.0, 0.004))[0], 8);
        }
    }
}

#[test]
fn colours_of_corners_are_what_single_pixels_give() {
    let mut parts = room_parts();
    parts.colors = (0..24u32)
        .map(|k| (k * 0x35_79_13).to_le_bytes())
        .map(|[r, g, b, _]| [r, g, b])
        .collect();
    let mesh = TriMesh::new(parts).unwrap();
    for camera in all_kinds(EYE) {
        close(&mesh, &camera, 8);
    }
}

#[test]
fn rgb_of_scans_is_what_single_pixels_give() {
    let mesh = s3d_synth::scenes::scan_like(20_000, 5);
    for camera in all_kinds(dvec3(3.0, 2.5, 1.5)) {
        close(&mesh, &camera, 8);
    }
    #[allow(clippy::print_stderr)]
    let Some((path, location)) = common::real_scan() else {
        eprintln!("skipped: no real scan beside the project");
        return;
    };
    let mesh = common::read_obj(&path);
    for camera in all_kinds(location) {
        close(&mesh, &camera, 8);
    }
}

/// Compares the other images with `s3d_io::formats`, one pixel at a time.
#[test]
fn images_are_what_single_pixels_give() {
    let mesh = s3d_synth::scenes::scan_like(20_000, 5);
    let scene = Scene::new(&mesh);
    let mip_maps = MipMaps::new(&mesh);
    let faces = mesh.faces().len() as u32;
    let index: Vec<u32> = (0..faces).map(|f| f * 631 % (1 << 24)).collect();
    let color: Vec<[u8; 3]> = (0..faces).map(|f| [f as u8, (f >> 8) as u8, 7]).collect();
    let mut all = s3d_render::ViewImages::default();
    let mut again = s3d_render::xyz_image_half(&s3d_render::cast(&scene, &view(0.0, 0.0)), &view(0.0, 0.0));

    for camera in all_kinds(dvec3(3.0, 2.5, 1.5)) {
        let hits = s3d_render::cast(&scene, &camera);
        let depth = s3d_render::depth_image(&hits);
        let normal = s3d_render::normal_image(&scene, &hits, &camera, Normals::Flat);
        let indices = s3d_render::index_image(&hits, &index);
        let colors = s3d_render::color_per_face_image(&hits, &color);
        let xyz = s3d_render::xyz_image(&hits, &camera);
        let half = s3d_render::xyz_image_half(&hits, &camera);

        let rays = camera.rays();
        for k in 0..hits.face.len() {
            let i = k as u32 % camera.width;
            let j = k as u32 / camera.width;
            let face = hits.face.pixels()[k];
            let t = f64::from(hits.depth.pixels()[k]);
            assert_eq!(depth.pixels()[k], (t * 512.0 + 0.5) as u16);
            let p = camera.pose.location + rays.at(i, j) * t;
            let p = if t.is_finite() {
                p.as_vec3().to_array()
            } else {
                [0.0; 3]
            };
            assert_eq!(xyz.pixels()[k], p, "({i}, {j})");
            assert_eq!(half.pixels()[k], p.map(half::f16::from_f32), "({i}, {j})");

            if face == NO_FACE {
                assert_eq!(
                    (normal.pixels()[k], indices.pixels()[k], colors.pixels()[k]),
                    ([128; 3], [13; 3], [0; 3])
                );
                continue;
            }

            let [a, b, c] = mesh.triangle(face).map(|p| p.as_dvec3());
            let n = (b - a).cross(c - a).normalize();
            let n = if n.dot(a - camera.pose.location) > 0.0 { -n } else { n };
            let n = (camera.normal_image_from_world() * n * 127.5 + (128.0 + 1e-9)).to_array();
            assert_eq!(normal.pixels()[k], n.map(|c| c as u8));
            let [_, r, g, b] = index[face as usize].to_be_bytes();
            assert_eq!((indices.pixels()[k], colors.pixels()[k]), ([r, g, b], color[face as usize]));
        }

        // The images are reused from the camera before.
        let shading = Shading {
            scene: &scene,
            mip_maps: &mip_maps,
            filter: TextureFilter::default(),
            normal_axes: s3d_geom::NormalAxes::Paper,
            index_of_face: &index,
            color_of_face: &color,
        };
        let faces = Modalities { faces: true, ..Modalities::default() };
        for wanted in [faces, Modalities::ALL] {
            view_images_into(&shading, &hits, &camera, wanted, &mut all);
            assert_eq!((&all.faces.normal, &all.faces.index, &all.faces.color), (&normal, &indices, &colors));
        }
        assert_eq!((&all.depth, &all.xyz), (&depth, &half));
        assert_eq!(all.rgb, s3d_render::rgb_image(&scene, &mip_maps, &hits, &camera));
        s3d_render::xyz_image_half_into(&hits, &camera, &mut again);
        assert_eq!(again, half);

        let mut other = depth.map(|_| 7);
        s3d_render::depth_image_into(&hits, &mut other);
        assert_eq!(other, depth);
    }
}

#[test]
fn an_image_that_is_used_again_is_as_a_new_one() {
    let mesh = textured(chart(64), Wrap::Clamp);
    let scene = Scene::new(&mesh);
    let mip_maps = MipMaps::new(&mesh);
    let filter = s3d_render::TextureFilter::default();
    let mut again = Raster::filled(5, 5, [9; 3]);
    for camera in all_kinds(EYE) {
        // The second time, the image of the unturned camera is overwritten.
        for camera in [camera, Camera { pose: camera.pose.turned(1.0, 0.0), ..camera }] {
            let hits = s3d_render::cast(&scene, &camera);
            s3d_render::rgb_image_into(&scene, &mip_maps, &hits, &camera, &filter, &mut again);
            assert_eq!(again, s3d_render::rgb_image(&scene, &mip_maps, &hits, &camera));
        }
    }
}
