//! Photographs with poses, there and back. Our own renderer takes the photographs in the built-in scene, ray
//! by ray through lenses that bend. The views made of them must coincide with the views of the mesh.

mod masks;
mod panoramas;
mod recordings;
mod refined;
mod studio;

use crate::common;
use common::{files, s3d_fails, s3d_ok, text};
use s3d_geom::{Lens, PhotoLens, Pose, Raster};
use s3d_io::dataset::{Domain, Layout, dataset_images};
use s3d_io::image::{read_rgb8, read_xyz};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use studio::*;

#[test]
fn photographs_through_a_lens_that_bends_lie_on_the_mesh() {
    let project = Project::with_photographs(LISTED);
    let (out, log) = project.export("out", &[]);
    let records = photographs(&out);
    assert!(records.len() == 4 && log.contains("4 of 4 photographs are taken"), "{log}");
    let info = common::s3d(&["info", text(&project.at("scene.toml"))]);
    let told = String::from_utf8_lossy(&info.stdout).into_owned();
    assert!(told.contains("4 of 4 photographs are taken"), "{told}");
    for (i, record) in records.iter().enumerate() {
        assert_eq!(record.name, format!("images/{i}.png"));
        assert_eq!((record.width, record.height, record.room.as_str()), (SIZE[0], SIZE[1], "unknown_1"));
        let (agreement, chance) = (record.agreement.unwrap(), record.chance.unwrap());
        assert!(agreement > 0.6 && agreement > chance + 0.3, "{record:?}");
        assert!(record.seen > 0.9 && record.masked < 0.2, "{record:?}");
    }
    let off = registered(&out);
    assert!(off.len() > 40, "{off:?}");
    assert!(off[off.len() / 2] < 0.1 && off[off.len() - 1] < 0.3, "{off:?}");

    // With photographs, no locations are placed unless the user asks for them.
    let manifest: Value = serde_json::from_slice(&fs::read(out.join("manifest.json")).unwrap()).unwrap();
    let area = &manifest["areas"][0];
    assert_eq!([&area["frames"], &area["views"], &area["panoramas"], &area["locations"]], [4, 4, 0, 0]);
    let (both, _) = project.export("both", &["--place-cameras", "6"]);
    let manifest: Value = serde_json::from_slice(&fs::read(both.join("manifest.json")).unwrap()).unwrap();
    let area = &manifest["areas"][0];
    assert!(area["frames"] == 4 && area["panoramas"].as_u64() > Some(1) && area["views"].as_u64() > Some(6));
    // The views of the photographs stay the same.
    for record in &records {
        let of = |out: &Path| -> Vec<Vec<u8>> {
            let all = files(&out.join("area_1/data"));
            all.into_iter()
                .filter(|(p, _)| p.to_string_lossy().contains(&record.camera_uuid))
                .map(|f| f.1)
                .collect()
        };
        assert!(of(&out).len() == 5 && of(&out) == of(&both));
    }

    // The same measure finds a principal point that is one pixel off.
    let mut wrong = transforms(&poses());
    wrong["cx"] = json!(CENTER.x + 1.0);
    project.write("transforms.json", &wrong.to_string());
    let (out, _) = project.export("wrong", &["--modalities", "rgb,depth,pose"]);
    let off = registered(&out);
    assert!((0.8..2.0).contains(&off[off.len() / 2]), "{off:?}");
}

/// The same through a fisheye lens: poses from COLMAP's list, a smaller size, with labels and locations.
#[test]
fn a_fisheyes_photographs_of_a_colmap_model_become_smaller_views() {
    let scan = demo();
    let tree = text(&scan.join("Area_1")).to_owned();
    let list = text(&scan.join("cameras.csv")).to_owned();
    let rest = format!(
        "[annotations]\npath = {tree:?}\n[cameras]\npath = {list:?}\n\
         [frames]\npath = \"model\"\nimages = \"photos\"\nwidth = 240\nevery = 2\n"
    );
    let project = Project::new(&rest);
    let ([f, g], [x, y], [k1, k2, k3, k4]) = (FOCAL.to_array(), CENTER.to_array(), ANGULAR);
    let camera = format!("3 OPENCV_FISHEYE {} {} {f} {g} {x} {y} {k1} {k2} {k3} {k4}\n", SIZE[0], SIZE[1]);
    project.write("model/sparse/0/cameras.txt", &camera);
    let mut images = String::new();
    for (i, pose) in poses().iter().enumerate() {
        let m = pose.opencv_from_world();
        let (q, t) = (glam::DQuat::from_mat3(&m), -(m * pose.location));
        images +=
            &format!("{} {} {} {} {} {} {} {} 3 hall/{i}.jpg\n\n", i + 1, q.w, q.x, q.y, q.z, t.x, t.y, t.z);
        if i % 2 == 0 {
            // A listed name may lack its ending or its folder.
            write(
                &project.at(&format!("photos/{}{i}.jpg", if i == 0 { "hall/" } else { "" })),
                &take(pose, &fisheye()),
            );
        }
    }
    project.write("model/sparse/0/images.txt", &images);
    let (out, _) = project.export("out", &[]);
    let records = photographs(&out);
    let names: Vec<&str> = records.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(names, ["hall/0.jpg", "hall/2.jpg"]);
    for record in &records {
        assert_eq!((record.width, record.height), (240, 180));
        assert!(record.agreement.unwrap() > record.chance.unwrap() + 0.3, "{record:?}");
        assert!(!record.room.starts_with("unknown"), "{record:?}");
    }
    // Only views of photographs are compared; views of the mesh have another size and are in no list of
    // photographs.
    let layout = Layout::new(&out);
    let all = dataset_images(&layout, 1).unwrap();
    assert!(all.len() > 10 && all.iter().all(|image| image.domains.len() == Domain::PUBLISHED.len()));
    for image in all
        .iter()
        .filter(|image| !records.iter().any(|r| r.camera_uuid == image.uuid))
    {
        fs::remove_file(image.path(&layout, Domain::Pose)).unwrap();
        image
            .domains
            .iter()
            .for_each(|domain| drop(fs::remove_file(image.path(&layout, *domain))));
    }
    let off = registered(&out);
    assert!(off.len() > 10 && off[off.len() / 2] < 0.1 && off[off.len() - 1] < 0.3, "{off:?}");
}

/// A wrong pose or a transposed matrix shows in the report and gives a warning.
#[test]
fn poses_that_do_not_fit_show_in_their_agreement() {
    let project = Project::with_photographs(LISTED);
    let agreements = |poses: &[Pose], name: &str| {
        project.write("transforms.json", &transforms(poses).to_string());
        let (out, log) = project.export(name, &["--modalities", "rgb,pose", "--allow", "coverage"]);
        let records = photographs(&out);
        (records.iter().map(|r| r.agreement.unwrap_or(0.0)).collect::<Vec<_>>(), log)
    };
    let good = poses();
    let (of_good, log) = agreements(&good, "good");
    assert!(!log.contains("by chance"), "{log}");
    let turned = good.map(|pose| pose.turned(5f64.to_radians(), 0.0));
    let tilted = good.map(|pose| pose.turned(0.0, 5f64.to_radians()));
    let transposed = good.map(|pose| Pose { world_from_camera: pose.world_from_camera.transpose(), ..pose });
    for (wrong, name) in [(turned, "turned"), (tilted, "tilted"), (transposed, "transposed")] {
        let (of_wrong, log) = agreements(&wrong, name);
        for (good, wrong) in of_good.iter().zip(&of_wrong) {
            assert!(*good > wrong + 0.25, "{name}: {of_good:?} {of_wrong:?}");
        }
        if name == "transposed" {
            assert!(log.contains("photographs and mesh agree no more than by chance"), "{log}");
        }
    }
    let mut one = good;
    one[2] = transposed[2];
    let (_, log) = agreements(&one, "one");
    assert!(log.contains("1 of 4 photographs agree with the mesh no more than by chance"), "{log}");
    assert!(log.contains("images/2.png ("), "{log}");
}

/// The bytes are the same for any number of threads, in shards, with a plan, and after a stop.
#[test]
fn threads_shards_and_plans_change_no_byte() {
    let project = Project::with_photographs(&format!("[cameras]\nplace = 6.0\n{LISTED}"));
    let (one, _) = project.export("one", &["--threads", "1"]);
    let expected = files(&one);
    assert!(expected.contains_key(Path::new("area_1/frames.json")));
    let (three, _) = project.export("three", &["--threads", "3"]);
    assert!(files(&three) == expected, "threads change something");
    let (scene, shared, plan) = (project.at("scene.toml"), project.at("shared"), project.at("plan"));
    let small = ["--size", "32", "--views", "4"];
    s3d_ok(&[&["plan", text(&scene), "-o", text(&plan)][..], &small].concat());
    for number in ["1/3", "2/3", "3/3"] {
        let more = ["--shard", number, "--plan", text(&plan)];
        s3d_ok(&[&project.args(&scene, &shared)[..], &more].concat());
    }
    s3d_ok(&["merge", text(&shared), "-o", text(&shared)]);
    assert!(files(&shared) == expected, "shards change something");
    // Another photograph is another input.
    write(&project.at("images/1.png"), &Raster::filled(SIZE[0], SIZE[1], [90, 80, 70]));
    let args = project.args(&scene, &one);
    s3d_fails(&args, 2, &["images/: other bytes"]);
}

#[test]
fn what_is_wrong_with_photographs_is_said_before_anything_is_written() {
    let project = Project::with_photographs(LISTED);
    let good = transforms(&poses());
    let with = |change: &dyn Fn(&mut Value)| {
        let mut list = good.clone();
        change(&mut list);
        project.write("transforms.json", &list.to_string());
    };
    with(&|list| list["frames"][1]["file_path"] = json!("images/gone.png"));
    project.fails(&["transforms.json", "1 of 4 photographs are not there", "images/gone.png", "[frames]"]);
    with(&|list| list["w"] = json!(400));
    project.fails(&["images/0.png", "320 × 240 pixels", "its camera is for 400 × 240"]);
    with(&|list| {
        ["fl_x", "fl_y"]
            .iter()
            .for_each(|key| drop(list.as_object_mut().unwrap().remove(*key)));
    });
    project.fails(&[
        "images/0.png",
        "neither its focal lengths nor its angle of view are known",
        "camera_angle_x",
    ]);
    with(&|list| list["frames"][2] = list["frames"][0].clone());
    project.fails(&["\"images/0.png\": is listed twice"]);
    with(&|list| list["frames"][0]["transform_matrix"][0][3] = json!(4e5));
    // A single camera may be far off; if all are, they are in another frame.
    with(&|list| (0..4).for_each(|i| list["frames"][i]["transform_matrix"][0][3] = json!(4e5)));
    project.fails(&["lie", "[[1, 0, 0, "]);
    with(&|list| (0..4).for_each(|i| list["frames"][i]["transform_matrix"][2][3] = json!(60.0)));
    with(&|list| list["cx"] = json!(1000.0));
    project.fails(&["the principal point (1000, 117.5) lies outside of the photograph of 320 × 240"]);
    with(&|list| {
        ["w", "h"]
            .iter()
            .zip([240, 320])
            .for_each(|(key, side)| list[*key] = json!(side))
    });
    project.fails(&["images/0.png", "320 × 240 pixels, and its camera is for 240 × 320"]);
    with(&|list| {
        ["w", "h", "cx", "cy"]
            .iter()
            .zip([240, 320, 120, 160])
            .for_each(|(key, v)| list[*key] = json!(v));
    });
    turn(&project.at("images/0.png"), 6);
    project.fails(&["stored with 320 × 240 pixels", "EXIF orientation 6", "for 240 × 320: store it upright"]);
    with(&|_| ());
    // A turn by 180° keeps the size.
    turn(&project.at("images/1.png"), 3);
    let (_, log) = project.export("turned", &["--modalities", "pose"]);
    assert!(log.contains("2 photographs ask to be turned when they are shown"), "{log}");
    fs::write(project.at("images/3.png"), b"none").unwrap();
    project.fails(&["images/3.png", "no picture that can be read"]);
}

/// Gives a PNG file a chunk with this EXIF orientation.
fn turn(path: &Path, turn: u8) {
    let tiff =
        [b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0", &[turn, 0, 0, 0, 0, 0, 0][..]].concat();
    let chunk = [&b"eXIf"[..], &tiff].concat();
    let crc = !chunk.iter().fold(!0u32, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 * (crc & 1)))
    });
    let png = fs::read(path).unwrap();
    // The chunk follows the signature and the header.
    let (head, rest) = png.split_at(33);
    let length = (tiff.len() as u32).to_be_bytes();
    fs::write(path, [head, &length, &chunk, &crc.to_be_bytes(), rest].concat()).unwrap();
}

/// ScanNet's folders: unknown poses are left out and counted, and names have no endings.
#[test]
fn a_scannet_folder_is_taken_with_the_poses_that_it_knows() {
    let project = Project::new("[frames]\npath = \"scan\"\nmax = 2\n");
    let pinhole = PhotoLens::Straight(Lens::new(SIZE, FOCAL, CENTER, [0.0; 5]).unwrap());
    let k = [[FOCAL.x, 0.0, CENTER.x], [0.0, FOCAL.y, CENTER.y], [0.0, 0.0, 1.0]];
    let lines = |rows: &[&[f64]]| -> String {
        rows.iter()
            .map(|row| row.iter().map(f64::to_string).collect::<Vec<_>>().join(" ") + "\n")
            .collect()
    };
    project.write("scan/intrinsic/intrinsic_color.txt", &lines(&[&k[0], &k[1], &k[2]]));
    for (i, pose) in poses().iter().take(3).enumerate() {
        let rows = rows(pose, -1.0);
        project.write(&format!("scan/pose/{i}.txt"), &lines(&[&rows[0], &rows[1], &rows[2], &rows[3]]));
        write(&project.at(&format!("scan/color/{i}.png")), &take(pose, &pinhole));
    }
    project.write("scan/pose/7.txt", &"-inf -inf -inf -inf\n".repeat(4));
    let (out, log) = project.export("out", &[]);
    assert!(
        log.contains("1 of 4 photographs are left out") && log.contains("2 of 3 photographs are taken"),
        "{log}"
    );
    let names: Vec<String> = photographs(&out).into_iter().map(|r| r.name).collect();
    assert_eq!(names, ["0", "1"]);
    // The view of a pinhole's photograph equals the photograph, pixel by pixel.
    let (view, photo) =
        (read_rgb8(&first_of(&out, "0")).unwrap(), read_rgb8(&project.at("scan/color/0.png")).unwrap());
    assert!(
        view.pixels()
            .iter()
            .zip(photo.pixels())
            .all(|(a, b)| *a == b.map(|v| v.max(1)))
    );
    assert!(
        photographs(&out)
            .iter()
            .all(|r| r.masked == 0.0 && r.agreement.unwrap() > 0.6)
    );
}

/// The path of the colours of the photograph's view.
fn first_of(out: &Path, name: &str) -> PathBuf {
    let uuid = photographs(out)
        .into_iter()
        .find(|r| r.name == name)
        .unwrap()
        .camera_uuid;
    let folder = out.join("area_1/data/rgb");
    let names = files(&folder).into_keys();
    folder.join(names.into_iter().find(|p| p.to_string_lossy().contains(&uuid)).unwrap())
}

/// Polycam's folders: optimized cameras, Y-up, with the transform to the frame of the mesh.
#[test]
fn a_polycam_capture_lies_on_its_mesh() {
    let project = Project::new("[frames]\npath = \"capture\"\nmax = 1\n");
    let pinhole = PhotoLens::Straight(Lens::new(SIZE, FOCAL, CENTER, [0.0; 5]).unwrap());
    let pose = poses()[1];
    write(&project.at("capture/keyframes/corrected_images/77.png"), &take(&pose, &pinhole));
    // Z-up (x, y, z) is Y-up (x, z, −y). The frame of the capture lies 5 m beside the frame of the mesh.
    let rows = rows(&pose, 1.0);
    let y_up = [rows[0], rows[2], rows[1].map(|v| -v)];
    let mut camera =
        json!({"fx": FOCAL.x, "fy": FOCAL.y, "cx": CENTER.x, "cy": CENTER.y, "width": 320, "height": 240});
    for (i, j) in (0..3).flat_map(|i| (0..4).map(move |j| (i, j))) {
        camera[format!("t_{i}{j}")] = json!(y_up[i][j] - if (i, j) == (0, 3) { 5.0 } else { 0.0 });
    }
    project.write("capture/keyframes/corrected_cameras/77.json", &camera.to_string());
    let aligned = json!({"alignmentTransform": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]});
    project.write("capture/mesh_info.json", &aligned.to_string());
    let (out, _) = project.export("out", &[]);
    let records = photographs(&out);
    assert_eq!((records.len(), records[0].name.as_str()), (1, "77"));
    assert!(records[0].agreement.unwrap() > 0.6, "{records:?}");
}

/// Packages give photographs their own cameras, and mask the pixels of a view outside its photograph.
#[test]
fn packages_know_photographs_and_their_masks() {
    let project = Project::with_photographs(&format!("[cameras]\nplace = 6.0\n{LISTED}"));
    // With pincushion distortion the view reaches beyond the photograph.
    let mut list = transforms(&poses());
    (list["k1"], list["k2"]) = (json!(0.3), json!(0.0));
    project.write("transforms.json", &list.to_string());
    let (out, _) = project.export("out", &[]);
    let records = photographs(&out);
    assert!(records.iter().all(|r| r.masked > 0.02), "{records:?}");
    let pack = |kind: &str| {
        let place = project.at(kind);
        s3d_ok(&["pack", text(&out), "--to", kind, "-o", text(&place), "--images", "views"]);
        place
    };
    let nerfstudio = pack("nerfstudio").join("area_1");
    let packed: Value =
        serde_json::from_slice(&fs::read(nerfstudio.join("transforms.json")).unwrap()).unwrap();
    let frames = packed["frames"].as_array().unwrap();
    let mut own = 0;
    for frame in frames {
        let mask = nerfstudio.join(frame["mask_path"].as_str().unwrap());
        // The PNG header says 8 bits, gray.
        assert_eq!(fs::read(&mask).unwrap()[24..26], [8, 0]);
        let mask = s3d_io::camera::read_picture(&mask).unwrap();
        let zeros = mask.pixels().iter().filter(|p| **p == [0; 3]).count();
        let path = frame["file_path"].as_str().unwrap();
        match records.iter().find(|r| path.contains(&r.camera_uuid)) {
            Some(record) => {
                own += 1;
                let share = zeros as f64 / f64::from(record.width * record.height);
                assert!((share - record.masked).abs() < 1e-6);
                assert_eq!([&frame["fl_x"], &frame["fl_y"]], [FOCAL.x, FOCAL.y]);
                assert_eq!(
                    [&frame["cx"], &frame["cy"], &frame["w"]],
                    [&json!(CENTER.x), &json!(CENTER.y), &json!(320)]
                );
            }
            None => assert_eq!(zeros, 0),
        }
    }
    assert!(own == 4 && frames.len() > 8, "{own} of {}", frames.len());
    let cameras = fs::read_to_string(pack("colmap").join("area_1/sparse/0/cameras.txt")).unwrap();
    assert_eq!(cameras.matches("PINHOLE 320 240 210 212 163.25 117.5").count(), 4, "{cameras}");
    pack("webdataset");
    let table = project.at("images.parquet");
    s3d_ok(&["pack", text(&out), "--to", "parquet", "-o", text(&table)]);
    let bytes = fs::read(&table).unwrap();
    assert!(
        bytes
            .windows(14)
            .any(|w| w == b"images/3.png\0\0" || w.starts_with(b"images/3.png"))
    );
    // Coordinates that are made again use the photographs' own cameras; they differ by the steps of depth
    // alone.
    let layout = Layout::new(&out);
    let all = dataset_images(&layout, 1).unwrap();
    let of_photographs = all
        .iter()
        .filter(|image| records.iter().any(|r| r.camera_uuid == image.uuid));
    let paths: Vec<PathBuf> = of_photographs.map(|i| i.path(&layout, Domain::GlobalXyz)).collect();
    let world = || paths.iter().map(|path| read_xyz(path).unwrap()).collect::<Vec<_>>();
    let before = world();
    s3d_ok(&["xyz", text(&out), "--type", "half", "--overwrite"]);
    s3d_ok(&["verify", text(&out)]);
    for (a, b) in before.iter().zip(world()) {
        let off = a
            .pixels()
            .iter()
            .zip(b.pixels())
            .map(|(a, b)| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max));
        assert!(off.fold(0.0, f32::max) < 0.03);
    }
    assert_eq!(before.len(), 4);
    // In an export of the export, the photographs are no scan locations.
    let again = project.at("again");
    let small = [
        "--points-per-m2",
        "20",
        "--size",
        "32",
        "--pano-width",
        "64",
        "--views",
        "2",
        "--modalities",
        "pose",
    ];
    s3d_ok(&[&["export", text(&out.join("area_1")), "-o", text(&again)][..], &small].concat());
    let poses = files(&again.join("area_1/pano/pose"));
    assert!(!poses.is_empty());
    assert!(
        poses
            .keys()
            .all(|p| records.iter().all(|r| !p.to_string_lossy().contains(&r.camera_uuid)))
    );
}

/// In COCO's images, pixels of a view outside its photograph are void, whatever the mesh shows there.
#[test]
fn coco_is_void_outside_of_a_photograph() {
    let tree = text(&demo().join("Area_1")).to_owned();
    let project = Project::with_photographs(&format!("[annotations]\npath = {tree:?}\n{LISTED}"));
    let mut list = transforms(&poses());
    (list["k1"], list["k2"]) = (json!(0.3), json!(0.0));
    project.write("transforms.json", &list.to_string());
    let (out, _) = project.export("out", &[]);
    let place = project.at("coco");
    s3d_ok(&["pack", text(&out), "--to", "coco", "-o", text(&place), "--images", "views"]);
    let layout = Layout::new(&out);
    let all = dataset_images(&layout, 1).unwrap();
    assert_eq!(all.len(), 4);
    for image in all {
        let read = |domain| read_rgb8(&image.path(&layout, domain)).unwrap();
        let (color, label) = (read(Domain::Rgb), read(Domain::Semantic));
        let packed = files(&place)
            .into_keys()
            .find(|p| text(p).contains(&image.uuid))
            .unwrap();
        let panoptic = read_rgb8(&place.join(packed)).unwrap();
        let pixels = color.pixels().iter().zip(label.pixels()).zip(panoptic.pixels());
        let (mut outside, mut labelled) = (0, 0);
        for ((color, label), segment) in pixels {
            let has_label = *label != [0; 3] && *label != s3d_render::MISSING_INDEX;
            outside += usize::from(*color == [0; 3] && has_label);
            labelled += usize::from(*color != [0; 3] && has_label);
            assert_eq!(*segment != [0; 3], *color != [0; 3] && has_label, "{label:?} in {color:?}");
        }
        assert!(outside > color.len() / 50 && labelled > color.len() / 2, "{outside}, {labelled}");
    }
}

/// Colours with more samples at edges differ at edges alone. All else is the same, and `verify` accepts it.
#[test]
fn samples_at_edges_change_colours_alone() {
    let project = Project::new("[cameras]\nplace = 6.0\n");
    let export = |name: &str, more: &[&str]| {
        let all = [&["--modalities", "rgb,depth,normal,pose"][..], more].concat();
        files(&project.export(name, &all).0)
    };
    let one = export("one", &[]);
    assert!(export("same", &["--rgb-samples", "1"]) == one, "one sample is the default");
    let four = export("four", &["--rgb-samples", "4"]);
    let differs = |path: &PathBuf| one[path] != four[path];
    let is_rgb = |path: &Path| path.components().any(|part| part.as_os_str() == "rgb");
    let images: Vec<&PathBuf> = one
        .keys()
        .filter(|p| p.starts_with("area_1/data") || p.starts_with("area_1/pano"))
        .collect();
    let is_panorama = |path: &Path| is_rgb(path) && path.starts_with("area_1/pano");
    assert!(images.iter().filter(|p| is_panorama(p)).all(|p| differs(p)), "every panorama has edges");
    assert!(images.iter().filter(|p| !is_rgb(p)).all(|p| !differs(p)));
    assert!(String::from_utf8_lossy(&four[Path::new("manifest.json")]).contains("\"rgb_samples\": 4"));
    assert!(!String::from_utf8_lossy(&one[Path::new("manifest.json")]).contains("rgb_samples"));
    let scene = project.at("scene.toml");
    s3d_fails(&["export", text(&scene), "--rgb-samples", "0"], 2, &["--rgb-samples"]);
}
