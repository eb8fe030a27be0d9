//! Wrong calls and bad input end with one clear message that names the file and the place, and with the right
//! exit code. Nothing is lost.

use crate::common;
use common::scan::Scan;
use common::{UUID_A, files, s3d, s3d_fails, s3d_ok, text, write_scan};
use std::fs;
use std::path::Path;

#[test]
fn wrong_calls_exit_with_2() {
    s3d_fails(&["export"], 2, &["SCENE.toml"]);
    s3d_fails(&["fly"], 2, &["fly"]);
    s3d_fails(&["export", "a.toml", "--size", "0"], 2, &["--size"]);
    s3d_fails(&["render", "a.obj", "--at", "1,2", "-o", "x"], 2, &["x,y,z"]);
    let scan = Scan::new();
    let out = scan.out();
    let mut args = scan.args(&out);
    args.extend(["--only", "0123"]);
    s3d_fails(&args, 2, &["0123"]);
    *args.last_mut().unwrap() = "01230123012301230123012301230123";
    s3d_fails(&args, 2, &["no scan location has this uuid"]);
    s3d_fails(&["render", "a.obj", "--at", "1,2,3", "--pano", "--size", "9", "-o", "x"], 2, &["even"]);
}

/// With too few open files allowed, an export fails anywhere, and another try may do better.
#[cfg(target_os = "linux")]
#[test]
fn too_many_open_files_are_temporary() {
    let mut temporary = 0;
    for most in 4..16 {
        let scan = Scan::new();
        let out = scan.out();
        let limited = format!("ulimit -n {most}; exec \"$0\" \"$@\"");
        let mut command = std::process::Command::new("sh");
        command
            .args(["-c", &limited, env!("CARGO_BIN_EXE_s3d")])
            .args(scan.args(&out));
        let output = command.output().unwrap();
        let log = String::from_utf8_lossy(&output.stderr);
        assert!(!log.contains("panicked"), "{log}");
        assert!(matches!(output.status.code(), Some(0 | 75)), "{most}: {}: {log}", output.status);
        temporary += u32::from(output.status.code() == Some(75));
    }
    assert!(temporary > 0);
}

/// A name in a message neither controls the terminal nor turns the line around.
#[test]
fn names_do_not_turn_the_log_around() {
    let name = "no\u{202e}such\u{2067}\u{61c}\u{1b}[31m.toml";
    let log = |format: &str| {
        let run = s3d(&["--log", format, "info", name]);
        assert_eq!(run.status.code(), Some(1));
        String::from_utf8(run.stderr).unwrap()
    };

    let said = log("text");
    assert!(said.contains(r"no\u{202e}such\u{2067}\u{61c}\x1b[31m.toml"), "{said}");
    let json = log("json");
    assert!(!json.contains(['\u{202e}', '\u{2067}', '\u{61c}', '\u{1b}']), "{json}");
    let mut lines = json
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    let named = |line: serde_json::Value| line["message"].as_str().is_some_and(|said| said.contains(name));
    assert!(lines.any(named), "{json}");
}

#[test]
fn a_missing_scene_is_named() {
    s3d_fails(&["export", "no/such/scene.toml"], 1, &["no/such/scene.toml"]);
    s3d_fails(&["info", "no/such/scene.toml"], 1, &["no/such/scene.toml"]);
    s3d_fails(&["render", "no/such.obj", "--at", "0,0,0", "-o", "x"], 1, &["no/such.obj"]);
    s3d_fails(&["sample", "no/such.obj", "-o", "x.ply"], 1, &["no/such.obj"]);
    for name in ["x.las", "x.npy", "x"] {
        s3d_fails(&["sample", "no/such.obj", "-o", name], 2, &[name, "ends with .ply"]);
    }
    for name in ["x.segs.json", "x.fsegs.json"] {
        s3d_fails(&["segments", "no/such.obj", "-o", name], 1, &["no/such.obj"]);
    }
    s3d_fails(&["segments", "no/such.obj", "-o", "x.json"], 2, &["x.json", "NAME.segs.json"]);
    s3d_fails(&["stats", "no/such"], 1, &["no/such"]);
}

#[test]
fn an_unknown_key_in_the_scene_is_named() {
    let scan = Scan::new();
    scan.replace("scene.toml", "up = \"y\"", "upp = \"y\"");
    scan.fails(&["scene.toml", "upp"]);
}

#[test]
fn a_wrong_axis_in_the_scene_is_named() {
    let scan = Scan::new();
    scan.replace("scene.toml", "up = \"y\"", "up = \"x\"");
    scan.fails(&["scene.toml", "x"]);
}

#[test]
fn two_scenes_of_one_area_are_refused() {
    let scan = Scan::new();
    let other = write_scan(&scan.dir.path().join("other"), 1);
    let out = scan.out();
    s3d_fails(&["export", text(&scan.scene), text(&other), "-o", text(&out)], 1, &["both area 1"]);
}

#[test]
fn an_index_out_of_range_is_named_with_its_line() {
    let scan = Scan::new();
    scan.replace("room.obj", "f 1/1 2/2 3/3 4/4", "f 1/1 2/2 3/3 999/4");
    scan.fails(&["room.obj", "line 11", "999"]);
}

#[test]
fn a_vertex_that_is_not_a_number_is_named_with_its_line() {
    for bad in ["nan", "inf", "1e999"] {
        let scan = Scan::new();
        scan.replace("room.obj", "v 4 0 -0", &format!("v {bad} 0 -0"));
        scan.fails(&["room.obj", "line 5"]);
    }
}

#[test]
fn an_empty_mesh_is_refused() {
    let scan = Scan::new();
    fs::write(scan.file("room.obj"), "").unwrap();
    scan.fails(&["room.obj", "face"]);
}

#[test]
fn a_mesh_of_zero_area_is_refused_and_single_faces_are_dropped_and_counted() {
    let scan = Scan::new();
    fs::write(scan.file("room.obj"), "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n").unwrap();
    scan.fails(&["room.obj", "area"]);
    let scan = Scan::new();
    let path = scan.file("room.obj");
    let obj = fs::read_to_string(&path).unwrap() + "f 1 1 2\n";
    fs::write(path, obj).unwrap();
    scan.warns(&["1 ", "zero area"]);
}

#[test]
fn a_missing_texture_is_a_warning() {
    let scan = Scan::new();
    scan.replace("room.mtl", "newmtl wall\n", "newmtl wall\nmap_Kd bricks.png\n");
    scan.warns(&["bricks.png"]);
}

#[test]
fn unknown_classes_and_rooms_are_named() {
    let scan = Scan::new();
    fs::rename(scan.annotation("table_1.txt"), scan.annotation("stairs_1.txt")).unwrap();
    scan.fails(&["stairs"]);
    let scan = Scan::new();
    fs::rename(scan.file("Area_1/office_1"), scan.file("Area_1/kitchen_1")).unwrap();
    scan.fails(&["kitchen"]);
}

#[test]
fn a_malformed_point_is_named_with_its_line() {
    for (line, bad) in
        [(3, "0.1 0.2 x 1 2 3"), (2, "0.1 0.2 0.3 1 2"), (1, "0.1 0.2 0.3 1 2 300"), (4, "nan 0 0 1 2 3")]
    {
        let scan = Scan::new();
        let path = scan.annotation("table_1.txt");
        let content = fs::read_to_string(&path).unwrap();
        let mut lines: Vec<&str> = content.lines().collect();
        lines[line - 1] = bad;
        fs::write(&path, lines.join("\n")).unwrap();
        let out = scan.out();
        s3d_fails(&scan.args(&out), 1, &["table_1.txt", &format!("line {line}")]);
    }
}

#[test]
fn bad_camera_tables_are_named_with_their_line() {
    let row = format!("{UUID_A},2.0,1.2,1.5,0,0,0,1\n");
    for (table, line, part) in [
        (format!("{row}{row}"), 2, UUID_A),
        (format!("{row}12,0,0,0,0,0,0,1\n"), 2, "uuid"),
        ("".to_owned(), 0, "cameras.csv"),
        (row.replace("1.2", "north"), 1, "north"),
        (row.replace("1.2", "nan"), 1, "cameras.csv"),
        (row.replace(",0,0,0,1", ",0,0,0,0"), 1, "quaternion"),
        (row.replace(",0,0,0,1", ",0,0,0"), 1, "cameras.csv"),
    ] {
        let scan = Scan::new();
        fs::write(scan.file("cameras.csv"), table).unwrap();
        let place = if line == 0 {
            String::new()
        } else {
            format!("line {line}")
        };
        scan.fails(&["cameras.csv", part, &place]);
    }
    let scan = Scan::new();
    fs::remove_file(scan.file("cameras.csv")).unwrap();
    scan.fails(&["cameras.csv"]);
}

#[test]
fn cameras_outside_or_inside_something_are_told_with_their_coverage() {
    let scan = Scan::new();
    fs::write(scan.file("cameras.csv"), format!("{UUID_A},50,50,1.5,0,0,0,1\n")).unwrap();
    let useless = ["in 0 % of all directions", "--allow coverage"];
    s3d_fails(&scan.args(&scan.out()), 1, &useless);
    let log = scan.exported();
    assert!(log.contains(UUID_A) && log.contains("(coverage 0 %)"), "{log}");
    let scan = Scan::new();
    fs::write(scan.file("cameras.csv"), format!("{UUID_A},2,-1,1.5,0,0,0,1\n")).unwrap();
    s3d_fails(&scan.args(&scan.out()), 1, &["are back sides", "--allow inside-out"]);
    let log = scan.exported();
    assert!(log.contains(UUID_A) && log.contains("back sides in"), "{log}");
    let scan = Scan::new();
    fs::write(scan.file("cameras.csv"), format!("{UUID_A},0.01,1,1.5,0,0,0,1\n")).unwrap();
    scan.warns(&[UUID_A, "10 mm"]);
}

#[test]
fn points_in_another_frame_are_told() {
    let scan = Scan::new();
    scan.replace("scene.toml", "up = \"y\"", "up = \"z\"");
    s3d_fails(&scan.args(&scan.out()), 1, &["share a frame", "--allow frame"]);
    assert!(scan.exported().contains("share a frame"));
    let info = s3d(&["info", text(&scan.scene)]);
    assert!(String::from_utf8_lossy(&info.stdout).contains("share a frame"));
}

#[test]
fn an_out_that_holds_something_is_refused_and_kept() {
    let scan = Scan::new();
    let out = scan.out();
    fs::create_dir(&out).unwrap();
    fs::write(out.join("thesis.tex"), "mine").unwrap();
    s3d_fails(&scan.args(&out), 2, &["thesis.tex", "--overwrite"]);
    assert_eq!(files(&out).len(), 1);
    let mut args = scan.args(&out);
    args.push("--overwrite");
    s3d_ok(&args);
    assert_eq!(fs::read_to_string(out.join("thesis.tex")).unwrap(), "mine");
}

#[test]
fn overwriting_replaces_the_earlier_data_set_and_nothing_else() {
    let scan = Scan::new();
    let out = scan.out();
    let mut args = scan.args(&out);
    args.push("--keep-all");
    s3d_ok(&args);
    fs::write(out.join("notes.txt"), "mine").unwrap();
    let more = files(&out).len();
    let mut args = scan.args(&out);
    s3d_fails(&args, 2, &["--overwrite"]);
    assert_eq!(files(&out).len(), more);
    args.push("--overwrite");
    s3d_ok(&args);
    let fresh = scan.dir.path().join("fresh");
    s3d_ok(&scan.args(&fresh));
    let mut left = files(&out);
    assert_eq!(left.remove(Path::new("notes.txt")), Some(b"mine".to_vec()));
    assert!(left == files(&fresh), "something of the earlier data set is left");
}

#[test]
fn bad_input_leaves_an_earlier_data_set_as_it_was() {
    let scan = Scan::new();
    let out = scan.out();
    s3d_ok(&scan.args(&out));
    let before = files(&out);
    scan.replace("room.obj", "f 1/1 2/2 3/3 4/4", "f 1/1 2/2 999/3 4/4");
    let mut args = scan.args(&out);
    args.push("--overwrite");
    s3d_fails(&args, 1, &["999"]);
    assert!(files(&out) == before);

    // An error deep in the annotations is found only after the new data set was begun.
    scan.replace("room.obj", "999", "3");
    fs::write(scan.annotation("wall_2.txt"), "1 2 3\n").unwrap();
    s3d_fails(&args, 1, &["wall_2.txt", "line 1"]);
    assert!(files(&out) == before);
}

#[test]
fn an_out_that_cannot_be_made_is_named() {
    let scan = Scan::new();
    let file = scan.dir.path().join("file");
    fs::write(&file, "").unwrap();
    s3d_fails(&scan.args(&file.join("out")), 1, &["file"]);
    s3d_fails(&scan.args(&file), 1, &["file"]);
    s3d_fails(&["sample", text(&scan.file("room.obj")), "-o", text(&file.join("c.ply"))], 1, &["c.ply"]);
}

#[test]
fn what_is_in_the_way_and_not_ours_is_refused_and_kept() {
    let scan = Scan::new();
    let out = scan.out();
    fs::create_dir_all(out.join("assets")).unwrap();
    fs::create_dir_all(out.join("area_7")).unwrap();
    fs::write(out.join("assets/logo.png"), "mine").unwrap();
    let mut args = scan.args(&out);
    args.push("--overwrite");
    // The first and the second data set leave the user's own files alone.
    for _ in 0..2 {
        s3d_ok(&args);
        assert!(out.join("area_7").is_dir());
        assert_eq!(fs::read(out.join("assets/logo.png")).unwrap(), b"mine");
    }
    let other = scan.dir.path().join("other");
    fs::create_dir_all(other.join("area_1")).unwrap();
    fs::write(other.join("area_1/notes.txt"), "mine").unwrap();
    let mut args = scan.args(&other);
    args.push("--overwrite");
    s3d_fails(&args, 2, &["area_1", "not written by s3d"]);
    assert_eq!(files(&other).len(), 1);
}

#[test]
fn a_data_set_is_not_written_over_its_own_input() {
    let scan = Scan::new();
    let annotations = scan.file("Area_1");
    let mut args = scan.args(&annotations);
    args.push("--overwrite");
    let before = files(&annotations);
    s3d_fails(&args, 2, &["its own input"]);
    assert!(files(&annotations) == before);

    // The folder of the scan may hold the data set too, unless files of both would have the same path.
    fs::create_dir(scan.file("s3dis")).unwrap();
    fs::rename(&annotations, scan.file("s3dis/Area_1")).unwrap();
    scan.replace("scene.toml", "path = \"Area_1\"", "path = \"s3dis/Area_1\"");
    let folder = scan.dir.path().join("scan");
    let before = files(&folder);
    let mut args = scan.args(&folder);
    args.push("--overwrite");
    s3d_fails(&args, 2, &["its own input"]);
    assert!(files(&folder) == before);
}

#[test]
fn the_demo_does_not_write_over_a_scan() {
    let scan = Scan::new();
    let before = files(scan.dir.path());
    s3d_fails(&["demo", "-o", text(scan.dir.path()), "--overwrite"], 2, &["not the built-in scene"]);
    assert!(files(scan.dir.path()) == before);
}

/// After an export that replaces another was killed at any moment, the next export finds one of the two
/// whole.
#[test]
fn a_killed_replacement_is_mended() {
    let scan = Scan::new();
    let out = scan.out();
    let args = scan.args(&out);
    s3d_ok(&args);
    let first = files(&out);
    let bad = |stage: &str| {
        let mut args = scan.args(&out);
        args.push("--overwrite");
        let wall = scan.annotation("wall_2.txt");
        let points = fs::read(&wall).unwrap();
        fs::write(&wall, "1 2 3\n").unwrap();
        s3d_fails(&args, 1, &["wall_2.txt"]);
        fs::write(&wall, points).unwrap();
        assert!(files(&out) == first, "killed {stage}: the earlier data set is not whole");
    };
    let put = |from: &str, to: &str| {
        fs::create_dir_all(out.join(to).parent().unwrap()).unwrap();
        fs::rename(out.join(from), out.join(to)).unwrap();
    };
    let everything = [
        "area_1",
        "assets",
        "s3dis",
        "splits",
        "splits.json",
        "statistics.md",
        "statistics.json",
        "conventions.json",
        "files.csv",
        "manifest.json",
    ];
    put("area_1", ".s3d-previous.part/area_1");
    bad("while it was set aside");
    for entry in everything {
        put(entry, &format!(".s3d-previous.part/{entry}"));
    }
    bad("when all was set aside but the last name");
    for entry in everything {
        put(entry, &format!(".s3d-previous/{entry}"));
    }
    let running = String::from_utf8(first[Path::new("manifest.json")].clone()).unwrap();
    fs::write(out.join("manifest.json"), running.replace("\"complete\"", "\"running\"")).unwrap();
    fs::create_dir_all(out.join("area_1/data")).unwrap();
    fs::write(out.join("area_1/data/half"), "").unwrap();
    s3d_fails(&["stats", text(&out)], 1, &["did not finish"]);
    bad("while the new one was written");
    fs::create_dir_all(out.join(".s3d-previous/area_1")).unwrap();
    bad("when the new one was complete");
    fs::create_dir_all(out.join(".s3d-trash/area_1")).unwrap();
    bad("while the earlier one was removed");
}

/// An export that failed for good blocks no other call.
#[test]
fn a_mended_input_is_exported_into_the_same_folder() {
    let scan = Scan::new();
    let (out, wall) = (scan.out(), scan.annotation("wall_2.txt"));
    let points = fs::read(&wall).unwrap();
    fs::write(&wall, "1 2 3\n").unwrap();
    s3d_fails(&scan.args(&out), 1, &["wall_2.txt"]);
    fs::write(&wall, points).unwrap();
    s3d_ok(&scan.args(&out));
    // The same call again is no mistake: all the files that it asks for exist.
    let log = s3d_ok(&scan.args(&out));
    assert!(log.contains("nothing to do"), "{log}");
    s3d_fails(&[&scan.args(&out)[..], &["--seed", "7"]].concat(), 2, &["--overwrite"]);
}

#[test]
fn a_density_without_end_is_refused() {
    let scan = Scan::new();
    let out = scan.out();
    s3d_fails(
        &["export", text(&scan.scene), "-o", text(&out), "--points-per-m2", "1e300"],
        1,
        &["points a m²", "lower --points-per-m2"],
    );
    assert!(!out.exists());
}

/// A file that may not grow stands in for a full disk.
#[test]
#[cfg(target_os = "linux")]
fn an_export_that_cannot_be_written_names_the_file_and_leaves_none_by_halves() {
    let scan = Scan::new();
    let out = scan.out();
    let run = std::process::Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_s3d")])
        .args(["export", text(&scan.scene), "-o", text(&out), "--size", "512", "--views", "3"])
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&run.stderr);
    assert_eq!(run.status.code(), Some(1), "{log}");
    assert!(log.contains("cannot write") && !log.contains("panicked"), "{log}");
    assert!(!files(&out).keys().any(|path| text(path).ends_with(".part")), "half a file is left");
}

/// If nobody reads the log, the work still goes on.
#[test]
#[cfg(target_os = "linux")]
fn a_log_that_cannot_be_written_ends_nothing() {
    let scan = Scan::new();
    let out = scan.out();
    let args = scan.args(&out);
    let status = std::process::Command::new("sh")
        .args(["-c", "exec \"$0\" \"$@\" 2> /dev/full", env!("CARGO_BIN_EXE_s3d")])
        .args(&args)
        .status()
        .unwrap();
    assert!(status.success());
    assert!(
        fs::read_to_string(out.join("manifest.json"))
            .unwrap()
            .contains("\"complete\"")
    );
}

/// A pipe or a device is not replaced by a file.
#[test]
#[cfg(unix)]
fn a_pipe_is_not_replaced() {
    let scan = Scan::new();
    let pipe = scan.dir.path().join("pipe.ply");
    assert!(
        std::process::Command::new("mkfifo")
            .arg(&pipe)
            .status()
            .unwrap()
            .success()
    );
    s3d_fails(&["sample", text(&scan.file("room.obj")), "-o", text(&pipe), "--overwrite"], 1, &["pipe"]);
    assert!(!fs::metadata(&pipe).unwrap().is_file());
}

#[test]
fn instances_that_no_image_shows_are_told() {
    let scan = Scan::new();
    // The same points as another instance, which loses every vote to the instance with the smaller index.
    fs::copy(scan.annotation("table_1.txt"), scan.annotation("table_2.txt")).unwrap();
    scan.warns(&["1 annotated instances win no face", "table_2.txt"]);
}

/// A device that is always full stands in for a disk: a failed write is an error that names the file, not a
/// panic.
#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told() {
    let scan = Scan::new();
    let info = std::process::Command::new("sh")
        .args(["-c", "exec \"$0\" info \"$1\" > /dev/full", env!("CARGO_BIN_EXE_s3d"), text(&scan.scene)])
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&info.stderr);
    assert_eq!(info.status.code(), Some(75), "somebody may make room: {log}");
    assert!(log.contains("standard output") && !log.contains("panicked"), "{log}");
    assert!(log.contains("; go on with: "), "{log}");
}

/// The input is another area of the data set in OUT, which the export would replace.
#[test]
fn an_earlier_data_set_that_is_the_input_is_not_overwritten() {
    let dir = tempfile::tempdir().unwrap();
    let small = ["--size", "32", "--pano-width", "64", "--views", "0", "--points-per-m2", "5"];
    let out = dir.path().join("out");
    let scene = write_scan(&dir.path().join("one"), 1);
    s3d_ok(&[&["export", text(&scene), "-o", text(&out)], &small[..]].concat());
    let before = files(&out);
    let scene = write_scan(&dir.path().join("seven"), 7);
    let toml = std::fs::read_to_string(&scene).unwrap();
    std::fs::write(&scene, toml.replace("room.obj", "../out/area_1/3d/rgb.obj")).unwrap();
    let call = [&["export", text(&scene), "-o", text(&out), "--overwrite"], &small[..]].concat();
    s3d_fails(&call, 2, &["over its own input", "area_1/3d/rgb.obj"]);
    assert!(files(&out) == before);
}

#[test]
fn calls_that_make_no_sense_exit_with_2() {
    for bad in [
        &["export"] as &[&str],
        &["export", "a.toml", "--pano-width", "4095"],
        &["export", "a.toml", "--modalities", "rgb,smell"],
        &["export", "a.toml", "--pool", "sea"],
        &["export", "a.toml", "--xyz", "double"],
        &["export", "a.toml", "--normal-axes", "left"],
        &["export", "a.toml", "--depth-units", "inch"],
        &["export", "a.toml", "--pad-labels", "0"],
        &["export", "a.toml", "--pad-labels", "65537"],
        &["export", "a.toml", "--profile", "sea"],
        &["xyz", "out", "--type", "none"],
        &["profile", "out"],
        &["compare", "out"],
        &["compare", "out", "other", "--overwrite"],
        &["report", "out", "--pano-width", "15"],
        &["report", "out", "--thumbs", "4096"],
        &["export", "a.toml", "--compression", "9"],
        &["export", "--only", "00112233445566778899aabbccddeeff", "a.toml"],
        &["export", "a.toml", "--points-per-m2", "nan"],
        &["render", "a.obj", "--at", "1,2", "-o", "x"],
        &["render", "a.obj", "--at", "1,2,3", "--fov", "180", "-o", "x"],
        &["render", "a.obj", "-o", "x"],
        &["render", "a.obj", "--at", "1,2,3", "--poses", "p", "-o", "x"],
        &["render", "a.obj", "--poses", "p", "--pano", "-o", "x"],
        &["render", "a.obj", "--poses", "p", "--k", "9,9,4", "-o", "x"],
        &["render", "a.obj", "--poses", "p", "--k", "9,0,4,4", "-o", "x"],
        &["render", "a.obj", "--at", "1,2,3", "--width", "64", "-o", "x"],
        &["render", "a.obj", "--at", "1,2,3", "--fov", "60", "--pano", "-o", "x"],
    ] {
        assert_eq!(s3d(bad).status.code(), Some(2), "{bad:?}");
    }
    // A number below zero is a number: what is wrong is the file.
    let below = ["render", "a.obj", "--at", "-1,2,3", "-o", "x"];
    assert_eq!(s3d(&below).status.code(), Some(1));
    let poses = ["render", "a.obj", "--poses", "p", "--k", "9,9,-4,4", "--width", "8", "-o", "x"];
    assert_eq!(s3d(&poses).status.code(), Some(1));
}
