//! `s3d render --poses`: the cameras of any list give the same images as an export with these cameras.
//! `s3d render --trajectory`: a walk is a list of cameras.

use crate::common;
use common::scan::Scan;
use common::{files, s3d_fails, s3d_ok, text};
use s3d_dataset::render::PosesOptions;
use s3d_dataset::{Cancel, Context, Error, Event, render_poses};
use s3d_geom::glam::{DAffine3, DQuat, dvec2, dvec3};
use s3d_geom::{Camera, Pose};
use s3d_io::camera::{GivenIntrinsics, PosedCamera, read_posed_cameras};
use s3d_io::image::{read_gray16, read_rgb8};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

fn render(mesh: &Path, poses: &Path, out: &Path, more: &[&str]) -> String {
    let args = ["render", text(mesh), "--poses", text(poses), "-o", text(out)];
    s3d_ok(&[&args, more].concat())
}

/// All files but the list of cameras.
fn images(out: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = files(out);
    assert!(all.remove(Path::new("transforms.json")).is_some());
    all
}

fn posed(list: &Path) -> Vec<PosedCamera> {
    read_posed_cameras(list, &DAffine3::IDENTITY).unwrap().cameras
}

/// Packages show the same as their export: every pixel of every view, from each form of its cameras.
#[test]
fn packed_cameras_show_what_the_export_shows() {
    let scan = Scan::new();
    let (mesh, out) = (scan.file("room.obj"), scan.out());
    let options =
        ["--size", "60", "--pano-width", "64", "--views", "4", "--points-per-m2", "50", "--keep-all"];
    s3d_ok(&[&["export", text(&scan.scene), "-o", text(&out)], &options[..]].concat());
    let at = |name: &str| scan.dir.path().join(name);
    s3d_ok(&["pack", text(&out), "--to", "nerfstudio", "-o", text(&at("ns")), "--images", "all"]);
    s3d_ok(&["pack", text(&out), "--to", "colmap", "-o", text(&at("text"))]);
    s3d_ok(&["pack", text(&out), "--to", "colmap", "-o", text(&at("binary")), "--binary"]);
    for (list, kind, count) in [
        ("ns/area_1", "data", 8),
        ("ns/area_1/transforms_panoramas.json", "pano", 2),
        ("text/area_1", "data", 8),
        ("binary/area_1", "data", 8),
    ] {
        let views = at(&format!("views of {}", list.replace('/', "_")));
        render(&mesh, &at(list), &views, &[]);
        let depths = fs::read_dir(views.join("depth")).unwrap();
        let names: Vec<String> = depths.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        assert_eq!(names.len(), count, "{list}");
        let (mut pixels, mut differ) = (0, 0);
        for name in names {
            let stem = name.strip_suffix("_domain_rgb.png").unwrap();
            let exported = |domain: &str, suffix: &str| {
                out.join(format!("area_1/{kind}/{domain}/{stem}_domain_{suffix}.png"))
            };
            let depth = [exported("depth", "depth"), views.join("depth").join(&name)];
            let [a, b] = depth.map(|path| read_gray16(&path).unwrap());
            assert_eq!((a.width(), a.height()), (b.width(), b.height()));
            pixels += a.len();
            differ += a.pixels().iter().zip(b.pixels()).filter(|(a, b)| a != b).count();
            for (domain, suffix) in [("rgb", "rgb"), ("normal", "normals")] {
                let both = [exported(domain, suffix), views.join(domain).join(&name)];
                let [a, b] = both.map(|path| read_rgb8(&path).unwrap());
                let other = a.pixels().iter().zip(b.pixels()).filter(|(a, b)| a != b).count();
                assert!(other * 500 <= a.len(), "{list}: {other} pixels of {domain} of {stem} differ");
            }
        }
        // Angles and quaternions round a pose, so a depth close to the middle of two steps may change.
        assert!(differ * 5000 <= pixels, "{list}: {differ} of {pixels} depths differ");
    }
}

/// The same two cameras in every form; the output is such a form as well.
#[test]
fn every_form_gives_the_same_images() {
    let scan = Scan::new();
    let mesh = scan.file("room.obj");
    let poses = [
        Pose::level(dvec3(2.0, 1.2, 1.5), 0.4).turned(0.0, -0.2),
        Pose::level(dvec3(3.0, 0.8, 1.4), 2.0).turned(0.0, 0.1),
    ];
    let camera = |pose| Camera::pinhole(pose, dvec2(50.0, 55.0), dvec2(20.5, 25.0), 64, 40).unwrap();
    let (mut tum, mut csv, mut frames) = (String::new(), String::from("name,x,y,z,yaw,pitch\n"), Vec::new());
    fs::create_dir_all(scan.file("scannet/pose")).unwrap();
    fs::create_dir(scan.file("scannet/intrinsic")).unwrap();
    for (i, (pose, [yaw, pitch])) in poses.iter().zip([[0.4f64, -0.2f64], [2.0, 0.1]]).enumerate() {
        let (p, m) = (pose.location, pose.opencv_from_world().transpose());
        let q = DQuat::from_mat3(&m);
        tum += &format!("{i} {} {} {} {} {} {} {}\n", p.x, p.y, p.z, q.x, q.y, q.z, q.w);
        csv += &format!("{i},{},{},{},{},{}\n", p.x, p.y, p.z, yaw.to_degrees(), pitch.to_degrees());
        let row = |k: usize, s: f64| [m.x_axis[k], s * m.y_axis[k], s * m.z_axis[k], p[k]];
        let rows = |s| [row(0, s), row(1, s), row(2, s), [0.0, 0.0, 0.0, 1.0]];
        let lines = rows(1.0).map(|row| row.map(|v| v.to_string()).join(" ")).join("\n");
        fs::write(scan.file(&format!("scannet/pose/{i}.txt")), lines).unwrap();
        frames.push(
            serde_json::json!({"file_path": format!("images/{i}.png"), "transform_matrix": rows(-1.0)}),
        );
    }
    let k = camera(poses[0])
        .k_matrix()
        .map(|row| row.map(|v| v.to_string()).join(" "))
        .join("\n");
    scan.write("scannet/intrinsic/intrinsic_color.txt", k);
    scan.write("scannet/pose/2.txt", "-inf -inf -inf -inf\n".repeat(4));
    let shared = serde_json::json!({
        "w": 64, "h": 40, "fl_x": 50, "fl_y": 55, "cx": 20.5, "cy": 25, "frames": frames,
    });
    scan.write("transforms.json", shared.to_string());
    scan.write("trajectory.txt", tum);
    scan.write("table.csv", csv);

    let first = scan.file("from transforms");
    render(&mesh, &scan.file("transforms.json"), &first, &[]);
    let expected = images(&first);
    let names: Vec<String> = expected.keys().map(|path| path.display().to_string()).collect();
    let all = ["depth/0.png", "faces/0.png", "global_xyz/0.exr", "normal/0.png", "rgb/0.png"];
    assert!(all.iter().all(|name| names.contains(&(*name).to_owned())) && names.len() == 10, "{names:?}");
    let size = ["--width", "64", "--height", "40"];
    let k = [&size[..], &["--k", "50,55,20.5,25"]].concat();
    for (list, given) in [("scannet", &size[..]), ("trajectory.txt", &k), ("table.csv", &k)] {
        let out = scan.file(&format!("from {list}"));
        let log = render(&mesh, &scan.file(list), &out, given);
        let found = images(&out);
        assert!(found.keys().eq(expected.keys()), "{list}");
        for (path, bytes) in &found {
            assert!(*bytes == expected[path], "{list}: {} differs", path.display());
        }
        assert_eq!(log.contains("1 of 3 poses are not known"), list == "scannet", "{log}");
    }

    // The output is a list of the same cameras.
    let written = posed(&first);
    for (posed, pose) in written.iter().zip(poses) {
        let read = posed.camera(&GivenIntrinsics::default()).unwrap();
        assert_eq!(read.k_matrix(), camera(pose).k_matrix());
        assert!(read.pose.world_from_camera.abs_diff_eq(pose.world_from_camera, 1e-12));
        assert!(posed.picture.as_ref().unwrap().path.is_file());
    }
    let again = scan.file("again");
    render(&mesh, &first, &again, &["--threads", "1"]);
    assert!(images(&again) == expected);

    // A pixel's point lies where its depth says, at the file's K and pose.
    let depth = read_gray16(&first.join("depth/1.png")).unwrap();
    let read = written[1].camera(&GivenIntrinsics::default()).unwrap();
    let point = read.pose.location + read.direction(7.5, 33.5) * f64::from(depth.at(7, 33)) / 512.0;
    let walls = [point.x, 4.0 - point.x, point.y, 3.0 - point.y, point.z, 2.5 - point.z];
    assert!(walls.into_iter().fold(f64::MAX, f64::min).abs() < 0.01, "{point} is on no wall");
}

#[test]
fn one_view_is_what_a_list_of_one_shows() {
    let scan = Scan::new();
    let (mesh, one, many) = (scan.file("room.obj"), scan.file("one"), scan.file("many"));
    let view = ["--yaw", "20", "--pitch", "-10", "--fov", "60", "--size", "48"];
    s3d_ok(&[&["render", text(&mesh), "--at", "2,1.2,1.5", "-o", text(&one)], &view[..]].concat());
    scan.write("one.csv", "name,x,y,z,yaw,pitch,width,height,fov\nv,2,1.2,1.5,20,-10,48,48,60\n");
    render(&mesh, &scan.file("one.csv"), &many, &[]);
    let (one, many) = (files(&one), images(&many));
    for (a, b) in [
        ("rgb.png", "rgb/v.png"),
        ("depth.png", "depth/v.png"),
        ("normals.png", "normal/v.png"),
        ("global_xyz.exr", "global_xyz/v.exr"),
        ("faces.png", "faces/v.png"),
    ] {
        assert!(one[Path::new(a)] == many[Path::new(b)], "{a}");
    }
}

#[test]
fn far_from_the_origin_cameras_move_with_the_mesh() {
    let (home, scan) = (Scan::new(), Scan::new());
    // The file is Y-up.
    let obj = fs::read_to_string(scan.file("room.obj")).unwrap();
    let moved: Vec<String> = obj
        .lines()
        .map(|line| match line.strip_prefix("v ") {
            Some(xyz) => {
                let v: Vec<f64> = xyz.split(' ').map(|v| v.parse().unwrap()).collect();
                format!("v {} {} {}", v[0] + 500_000.0, v[1] + 300.0, v[2] - 5_400_000.0)
            }
            None => line.to_owned(),
        })
        .collect();
    scan.write("room.obj", moved.join("\n"));
    home.write("list.csv", "name,x,y,z,look_x,look_y,look_z\na,2,1.25,1.5,0.5,2.5,0.75\n");
    let far = "name,x,y,z,look_x,look_y,look_z\na,500002,5400001.25,301.5,500000.5,5400002.5,300.75\n";
    scan.write("list.csv", far);
    let size = ["--width", "50", "--height", "40", "--fov", "80"];
    let view = |scan: &Scan, list: &str, out: &str, more: &[&str]| {
        let out = scan.file(out);
        let log = render(&scan.file("room.obj"), &scan.file(list), &out, more);
        (images(&out), log)
    };
    let ((near, _), (found, log)) =
        (view(&home, "list.csv", "v", &size), view(&scan, "list.csv", "v", &size));
    assert!(log.contains("far from the origin"), "{log}");
    // The offset moves the box's corner to the origin, or near it: coordinates differ, depths do not.
    for path in ["depth/a.png", "normal/a.png", "faces/a.png"].map(Path::new) {
        assert!(near[path] == found[path], "{}", path.display());
    }
    // The written list is in the frame of the file again.
    let back = posed(&scan.file("v"))[0].pose.location;
    assert!(back.abs_diff_eq(dvec3(500_002.0, 5_400_001.25, 301.5), 1e-6), "{back}");
    let (again, _) = view(&scan, "v", "again", &[]);
    assert!(again == found);
}

#[test]
fn a_list_in_another_frame_is_turned_or_refused() {
    let scan = Scan::new();
    let (mesh, out) = (scan.file("room.obj"), scan.out());
    // The matrix has the axes of the mesh's file: y is up. The camera looks along −z of the file, +y of the
    // world.
    let rows = "[[1,0,0,2],[0,1,0,1.5],[0,0,1,-1.2],[0,0,0,1]]";
    let keys = r#""w": 40, "h": 30, "fl_x": 30"#;
    let frame = |name: &str| format!(r#"{{"file_path": "{name}", "transform_matrix": {rows}}}"#);
    scan.write("y.json", format!(r#"{{{keys}, "frames": [{}]}}"#, frame("a")));
    let list = scan.file("y.json");
    let fails = |more: &[&str], code, parts: &[&str]| {
        let args = ["render", text(&mesh), "--poses", text(&list), "-o", text(&out)];
        s3d_fails(&[&args, more].concat(), code, parts);
        assert!(!out.exists(), "something was written");
    };
    let boxes = ["no camera sees anything", "[2, 1.5, -1.2]", "[0, 0, 0]", "[4, 3, 2.5]", "poses_up"];
    fails(&[], 1, &boxes);
    fails(&[], 1, &["--allow coverage"]);
    let log = render(&mesh, &list, &out, &["--allow", "coverage"]);
    assert!(log.contains("no camera sees anything"), "{log}");
    render(&mesh, &list, &out, &["--poses-up", "y", "--overwrite"]);
    let depth = read_gray16(&out.join("depth/a.png")).unwrap();
    assert_eq!(depth.at(20, 15), 922, "the wall at y = 3: 1.8 m");
    assert_eq!(posed(&out)[0].pose.location, dvec3(2.0, 1.2, 1.5));
    // If only some of them see nothing, that is a warning.
    let level = "name,x,y,z,yaw,width,height,fov\na,2,1.2,1.5,0,40,30,70\nb,-9,1.2,1.5,90,40,30,70\n";
    scan.write("some.csv", level);
    let log = render(&mesh, &scan.file("some.csv"), &out, &["--overwrite"]);
    assert!(log.contains("1 of 2 cameras see nothing"), "{log}");
}

#[test]
fn what_a_list_lacks_is_asked_for_by_option() {
    let scan = Scan::new();
    let (mesh, out) = (scan.file("room.obj"), scan.out());
    let fails = |list: &str, more: &[&str], code, parts: &[&str]| {
        let list = scan.file(list);
        let args = ["render", text(&mesh), "--poses", text(&list), "-o", text(&out)];
        s3d_fails(&[&args, more].concat(), code, parts);
        assert!(!out.exists(), "something was written");
    };
    scan.write("t.txt", "# t\n7 2 1.2 1.5 -0.7071 0 0 0.7071\n");
    let place = "t.txt, line 2: \"7\": ";
    fails("t.txt", &[], 2, &[place, "--width and --height"]);
    fails("t.txt", &["--width", "64"], 2, &[place, "--width and --height"]);
    fails("t.txt", &["--width", "64", "--height", "48"], 2, &[place, "--fov DEGREES, or --k FX,FY,CX,CY"]);
    fails("gone.csv", &[], 1, &["gone.csv"]);
    scan.write(
        "scaled.json",
        r#"{"w": 9, "h": 9, "fl_x": 9, "frames": [{"file_path": "a.png",
        "transform_matrix": [[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]}]}"#,
    );
    fails("scaled.json", &[], 1, &["scaled.json", "frames[0], \"a.png\"", "2 long instead of 1"]);
    scan.write("two.json", r#"{"w": 8, "h": 4, "fl_x": 9, "frames": [
        {"file_path": "a.png", "transform_matrix": [[1,0,0,2],[0,0,-1,1],[0,1,0,1]]},
        {"file_path": "b.png", "camera_model": "EQUIRECTANGULAR", "transform_matrix": [[1,0,0,2],[0,0,-1,1],[0,1,0,1]]}]}"#);
    fails("two.json", &[], 1, &["two.json", "1 panoramas and 1 other views"]);
    fails("two.json", &["--width", "32768"], 1, &["1 panoramas"]);
    scan.write("large.csv", "name,x,y,z,yaw,width,height,fov\na,2,1,1,0,40000,30,70\n");
    fails("large.csv", &[], 2, &["large.csv, line 2", "40000 × 30 pixels", "--width"]);
    // A lens that bends gives a warning.
    scan.write(
        "lens.json",
        r#"{"w": 40, "h": 30, "fl_x": 30, "k1": 0.1, "frames": [{"file_path": "a.png",
        "transform_matrix": [[1,0,0,2],[0,0,-1,1],[0,1,0,1]]}]}"#,
    );
    let log = render(&mesh, &scan.file("lens.json"), &out, &["--width", "20"]);
    assert!(log.contains("1 of 1 cameras have a lens that bends"), "{log}");
    let depth = read_gray16(&out.join("depth/a.png")).unwrap();
    assert_eq!((depth.width(), depth.height()), (20, 15), "scaled");
}

#[test]
fn only_views_of_ours_are_replaced() {
    let scan = Scan::new();
    let (mesh, list, out) = (scan.file("room.obj"), scan.file("cameras.csv"), scan.out());
    let size = ["--width", "40", "--height", "30", "--fov", "70"];
    let args = ["render", text(&mesh), "--poses", text(&list), "-o", text(&out)];
    render(&mesh, &list, &out, &size);
    let first = files(&out);
    s3d_fails(&[&args, &size[..]].concat(), 2, &["already holds", "--overwrite"]);
    let narrow = ["--width", "40", "--height", "30", "--fov", "20", "--overwrite"];
    render(&mesh, &list, &out, &narrow);
    assert!(files(&out).keys().eq(first.keys()) && files(&out) != first);
    fs::write(out.join("transforms.json"), "{\"frames\": []}").unwrap();
    let before = files(&out);
    s3d_fails(&[&args, &narrow[..]].concat(), 2, &["was not written by s3d render"]);
    assert!(files(&out) == before);
}

/// A caller cancels between two views: nothing is left, and the same call then makes all of it.
#[test]
fn it_tells_how_far_it_is_and_ends_when_asked() {
    let scan = Scan::new();
    let rows: String = (0..40)
        .map(|i| format!("v{i},2,1.2,1.5,{},64,48,70\n", 9 * i))
        .collect();
    scan.write("list.csv", format!("name,x,y,z,yaw,width,height,fov\n{rows}"));
    let (mesh, list, out) = (scan.file("room.obj"), scan.file("list.csv"), scan.out());
    let cancel = Cancel::default();
    let (theirs, told) = (cancel.clone(), Arc::new(Mutex::new((0, 0))));
    let seen = Arc::clone(&told);
    let ctx = Context::default()
        .cancelled_by(cancel.clone())
        .observed_by(move |event: &Event<'_>| {
            if let Event::TaskAdvanced { task, done } = event {
                let mut told = seen.lock().unwrap();
                *told = (task.total, told.1.max(*done));
                if *done == 7 {
                    theirs.cancel();
                }
            }
        });
    let call = || render_poses(&mesh, &list, &out, &PosesOptions::default(), &ctx);
    assert!(matches!(call(), Err(Error::Cancelled)));
    let (total, done) = *told.lock().unwrap();
    assert!(total == 40 && (7..40).contains(&done), "{done} of {total}");
    assert!(!out.exists() && fs::read_dir(scan.dir.path()).unwrap().count() == 1, "something is left");
    cancel.reset();
    let made = call();
    // The seventh view had asked.
    assert!(matches!(made, Err(Error::Cancelled)));
    let made = render_poses(&mesh, &list, &out, &PosesOptions::default(), &Context::default()).unwrap();
    assert_eq!((made.views, made.blind, made.untracked), (40, 0, 0));
    assert_eq!(images(&out).len(), 5 * 40);
}

#[test]
fn a_walk_is_a_list_that_shows_the_same() {
    let scan = Scan::new();
    let (mesh, walk, again) = (scan.file("room.obj"), scan.out(), scan.dir.path().join("again"));
    let walked = |out: &Path, more: &[&str]| {
        let args = ["render", text(&mesh), "--trajectory", "3", "--rate", "5", "-o", text(out)];
        s3d_ok(&[&args, more].concat())
    };
    walked(&walk, &["--width", "40", "--height", "30", "--threads", "1"]);
    let first = images(&walk);
    assert_eq!(first.len(), 5 * 15);
    assert!(
        first.contains_key(Path::new("rgb/000000.png")) && first.contains_key(Path::new("depth/000014.png"))
    );

    // A metre a second, with nothing nearer than a person's width.
    let poses: Vec<Pose> = posed(&walk).iter().map(|camera| camera.pose).collect();
    for pair in poses.windows(2) {
        let step_m = pair[0].location.distance(pair[1].location);
        assert!(step_m < 0.2 + 1e-9 && (pair[0].location.z - 1.5).abs() < 1e-3, "{pair:?}");
        assert!((0.19..3.81).contains(&pair[0].location.x) && (0.19..2.81).contains(&pair[0].location.y));
    }

    // Its list renders to the same images, and another seed walks elsewhere.
    render(&mesh, &walk, &again, &[]);
    assert!(images(&again) == first);
    walked(&again, &["--width", "40", "--height", "30", "--seed", "3", "--overwrite"]);
    assert!(images(&again) != first);

    walked(&again, &["--pano", "--width", "64", "--overwrite"]);
    let depth = read_gray16(&again.join("depth/000003.png")).unwrap();
    assert_eq!((depth.width(), depth.height()), (64, 32));
}

#[test]
fn a_walk_or_a_video_that_cannot_be_is_refused_before_anything_is_made() {
    let scan = Scan::new();
    let (mesh, out) = (scan.file("room.obj"), scan.out());
    let fails = |more: &[&str], code, parts: &[&str]| {
        let args = ["render", text(&mesh), "-o", text(&out)];
        s3d_fails(&[&args, more].concat(), code, parts);
        assert!(!out.exists(), "something was written");
    };
    fails(&["--trajectory", "0"], 2, &["--trajectory", "above 0"]);
    fails(&["--trajectory", "1e9"], 2, &["--trajectory: must be 1 to 1000000 images, at the rate"]);
    fails(&["--trajectory", "5", "--at", "1,1,1"], 2, &["cannot be used with"]);
    fails(&["--at", "1,1,1", "--speed", "2"], 2, &["cannot be used with"]);
    fails(&["--poses", "cameras.csv", "--eye-height", "1"], 2, &["cannot be used with"]);
    fails(&["--at", "1,1,1", "--video"], 2, &["cannot be used with"]);
    fails(&["--trajectory", "5", "--eye-height", "9"], 2, &["--eye-height: must be 0.3 to 2.5 metres"]);
    fails(&["--trajectory", "5", "--eye-height", "2.45"], 1, &["room.obj", "no way of a metre", "2.45"]);
    fails(&["--trajectory", "5", "--video", "--modalities", "depth"], 2, &["--modalities depth", "rgb"]);

    let mut without = std::process::Command::new(env!("CARGO_BIN_EXE_s3d"));
    without.args(["render", text(&mesh), "--trajectory", "5", "--video", "-o", text(&out)]);
    let ended = without.env("PATH", scan.dir.path()).output().unwrap();
    let said = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.code() == Some(1) && said.contains("ffmpeg: does not start"), "{said}");
    assert!(!out.exists());
}
