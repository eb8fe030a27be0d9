//! Scenes whose images are known in closed form: depth, normals and coordinates of pixels.

use crate::room::{EYE, all_kinds, room_parts, view};
use s3d_geom::glam::{DVec3, Vec3, dvec2, dvec3, vec3};
use s3d_geom::{Camera, MeshParts, NO_INDEX, Pose, Raster, TriMesh};
use s3d_render::{
    Hits, MipMaps, Modalities, NO_FACE, Normals, Scene, Shading, TextureFilter, view_images_into,
};

fn room() -> TriMesh {
    TriMesh::new(room_parts()).unwrap()
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
