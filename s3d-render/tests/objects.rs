//! Objects of images, against single rays at each object alone, and in scenes whose answers are known.

use proptest::prelude::*;
use s3d_geom::glam::{DVec3, Vec3, dvec2, dvec3, vec3};
use s3d_geom::{Camera, Pose, TriMesh};
use s3d_render::{
    Caster, Hits, NO_FACE, NO_OBJECT, ObjectMeshes, ObjectScenes, PixelBox, Scene, SeenObject, SeenObjects,
    cast, cast_ray,
};
use s3d_synth::scenes::scan_like;

/// A rectangle across +Y at a distance, by its corners (x, z).
fn board(y: f32, low: [f32; 2], high: [f32; 2]) -> Vec<Vec3> {
    let corner = |x, z| vec3(x, y, z);
    let [a, b] = [corner(low[0], low[1]), corner(high[0], low[1])];
    let [c, d] = [corner(high[0], high[1]), corner(low[0], high[1])];
    vec![a, b, c, a, c, d]
}

/// A mesh of triangles, each by its corners.
fn mesh_of(corners: Vec<Vec3>) -> TriMesh {
    let faces = (0..corners.len() as u32 / 3).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]);
    TriMesh::from_faces(corners, faces.collect()).unwrap()
}

fn objects(mesh: &TriMesh, object_of_face: &[u32], camera: &Camera) -> Vec<SeenObject> {
    let meshes = ObjectMeshes::new(mesh, object_of_face);
    let scenes = ObjectScenes::new(&meshes);
    let hits = cast(&Scene::new(mesh), camera);
    SeenObjects::new(&scenes, object_of_face).find(&hits, camera)
}

/// A camera in the origin that looks along +Y: a pixel is a centimetre at a distance of a metre.
fn camera() -> Camera {
    Camera::pinhole(Pose::level(DVec3::ZERO, 0.0), dvec2(100.0, 100.0), dvec2(50.0, 50.0), 100, 100).unwrap()
}

#[test]
fn half_of_a_board_is_hidden_by_another() {
    // 20 × 40 pixels, whose right half is behind a board of no object and one of object 5.
    let mut corners = board(2.0, [-0.2, -0.4], [0.2, 0.4]);
    corners.extend(board(1.0, [0.0, -0.1], [0.3, 0.3]));
    corners.extend(board(1.0, [0.0, -0.3], [0.3, -0.1]));
    let found = objects(&mesh_of(corners), &[2, 2, 5, 5, NO_OBJECT, NO_OBJECT], &camera());

    let [far, near] = &found[..] else { panic!("{found:?}") };
    assert_eq!((far.object, far.visible_px, far.mask.len()), (2, 400, 800));
    assert_eq!(far.visible_box, PixelBox { x: 40, y: 30, width: 10, height: 40 });
    assert_eq!(far.mask_box, PixelBox { x: 40, y: 30, width: 20, height: 40 });
    assert_eq!(far.hidden_by, [(5, 300), (NO_OBJECT, 100)]);
    assert!((far.occlusion() - 0.5).abs() < 1e-12);
    assert_eq!(far.mask.stretches[0], 40 * 100 + 30..40 * 100 + 70);
    assert!((2.0..2.01).contains(&far.nearest_m) && far.median_m > far.nearest_m);

    assert_eq!((near.object, near.visible_px, near.mask.len()), (5, 1200, 1200));
    assert_eq!((near.occlusion(), near.hidden_by.len()), (0.0, 0));
    let beyond = near.beyond.unwrap();
    assert_eq!(beyond.truncation, 0.0);
    let [low, high] = beyond.bounds.unwrap();
    assert!(low.abs_diff_eq(dvec2(50.0, 20.0), 1e-5) && high.abs_diff_eq(dvec2(80.0, 60.0), 1e-5));
}

#[test]
fn what_the_border_cuts_off_is_a_share() {
    // A quarter of the board's width is beyond the right border.
    let found = objects(&mesh_of(board(1.0, [0.2, 0.0], [0.6, 0.1])), &[0, 0], &camera());
    let beyond = found[0].beyond.unwrap();
    assert!((beyond.truncation - 0.25).abs() < 0.01, "{beyond:?}");
    let [low, high] = beyond.bounds.unwrap();
    assert!(low.abs_diff_eq(dvec2(70.0, 40.0), 1e-4) && high.abs_diff_eq(dvec2(110.0, 50.0), 1e-4));
    assert_eq!(found[0].mask_box, PixelBox { x: 70, y: 40, width: 30, height: 10 });
    assert_eq!(found[0].occlusion(), 0.0);
}

#[test]
fn a_wall_that_goes_on_behind_the_camera_has_no_bounds() {
    let low = vec3(0.3, -2.0, -1.0);
    let wall =
        vec![low, vec3(0.3, 2.0, -1.0), vec3(0.3, 2.0, 1.0), low, vec3(0.3, 2.0, 1.0), vec3(0.3, -2.0, 1.0)];
    let beyond = objects(&mesh_of(wall), &[0, 0], &camera())[0].beyond.unwrap();
    assert_eq!(beyond.bounds, None);
    assert!((0.3..0.95).contains(&beyond.truncation), "{beyond:?}");
}

#[test]
fn a_box_goes_on_across_the_border_of_a_panorama() {
    // The border of a panorama is behind the camera.
    let pose = Pose::level(DVec3::ZERO, 0.0);
    let found = objects(
        &mesh_of(board(-2.0, [-0.5, -0.5], [0.5, 0.5])),
        &[0, 0],
        &Camera::equirectangular(pose, 400),
    );
    let bounds = found[0].visible_box;
    assert!(bounds.x > 350 && bounds.columns().end > 400, "{bounds:?}");
    assert!((28..=34).contains(&bounds.width), "{bounds:?}");
    assert_eq!((found[0].mask_box, found[0].beyond), (bounds, None));
    assert_eq!(found[0].mask.len(), found[0].visible_px);
}

/// The same by single rays at the whole mesh and at each object alone.
fn check(mesh: &TriMesh, object_of_face: &[u32], camera: &Camera) {
    let found = objects(mesh, object_of_face, camera);
    let hits = cast(&Scene::new(mesh), camera);
    let shown = |x, y| match hits.face.at(x, y) {
        NO_FACE => NO_OBJECT,
        face => object_of_face[face as usize],
    };

    let labelled = hits
        .face
        .pixels()
        .iter()
        .filter(|f| **f != NO_FACE && object_of_face[**f as usize] != NO_OBJECT);
    assert_eq!(found.iter().map(|object| object.visible_px).sum::<u64>(), labelled.count() as u64);
    assert!(found.iter().map(|object| object.object).is_sorted_by(|a, b| a < b));

    let rays = camera.rays();
    for object in &found {
        let faces = (0..mesh.faces().len()).filter(|face| object_of_face[*face] == object.object);
        let alone = mesh_of(faces.flat_map(|face| mesh.triangle(face as u32)).collect());
        let scene = Scene::new(&alone);
        let mut mask = Vec::new();
        let mut distances = Vec::new();
        let mut hidden = 0;
        for x in 0..camera.width {
            for y in 0..camera.height {
                let is_shown = shown(x, y) == object.object;
                if is_shown {
                    distances.push((f64::from(hits.depth.at(x, y)) * rays.at(x, y).length()) as f32);
                }
                if cast_ray(&scene, camera.pose.location, rays.at(x, y)).is_some() {
                    mask.push(u64::from(x * camera.height + y));
                    hidden += u64::from(!is_shown);
                }
            }
        }

        let pixels: Vec<u64> = object.mask.stretches.iter().cloned().flatten().collect();
        assert_eq!(pixels, mask, "the mask of {}", object.object);
        assert_eq!(object.visible_px + hidden, mask.len() as u64);
        assert_eq!(object.hidden_by.iter().map(|(_, pixels)| pixels).sum::<u64>(), hidden);
        distances.sort_by(f32::total_cmp);
        assert_eq!(object.nearest_m, distances[0]);
        assert_eq!(object.median_m, distances[(distances.len() - 1) / 2]);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]
    #[test]
    fn masks_are_those_of_single_rays(
        seed in 0u64..1000,
        eye in prop::array::uniform3(0.2f64..0.8),
        yaw in -3.2f64..3.2,
        pitch in -1.2f64..1.2,
    ) {
        let mesh = scan_like(6000, seed);
        let size = mesh.aabb().size().as_dvec3();
        let location = mesh.aabb().min.as_dvec3() + DVec3::from_array(eye) * size;
        // Pieces of a quarter of the scan each, and a few faces of no object.
        let middle = mesh.aabb().center();
        let object_of_face: Vec<u32> = (0..mesh.faces().len() as u32)
            .map(|face| {
                let at = mesh.triangle(face)[0];
                let quarter = 3 * u32::from(at.x > middle.x) + 7 * u32::from(at.z > middle.z);
                if face % 50 == 0 { NO_OBJECT } else { quarter }
            })
            .collect();

        let pose = Pose::level(location, yaw);
        check(&mesh, &object_of_face, &Camera::perspective(pose.turned(0.0, pitch), 1.2, 61, 47));
        check(&mesh, &object_of_face, &Camera::equirectangular(pose, 160));
    }
}

#[test]
fn a_part_of_an_image_is_cast_like_the_whole() {
    let mesh = scan_like(3000, 5);
    let scene = Scene::new(&mesh);
    let pose = Pose::level(dvec3(3.0, 2.5, 1.5), 0.3);
    for camera in [
        Camera::perspective(pose, 1.3, 203, 131),
        Camera::equirectangular(pose, 600),
        Camera::equirectangular(pose, 40),
    ] {
        let whole = cast(&scene, &camera);
        let part = PixelBox { x: camera.width / 3, y: 5, width: camera.width / 2, height: camera.height - 9 };
        let mut hits = Hits::default();
        Caster::new(&scene).cast_part_into(&camera, part, &mut hits);
        for (y, row) in part.rows().zip(0..) {
            for (x, column) in part.columns().zip(0..) {
                assert_eq!(hits.face.at(column, row), whole.face.at(x, y));
                let [a, b] = [hits.depth.at(column, row), whole.depth.at(x, y)].map(f32::to_bits);
                assert!(a.abs_diff(b) <= 1, "depths differ by more than a step of the last place");
            }
        }
    }
}
