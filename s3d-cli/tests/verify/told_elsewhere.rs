//! Changes with right checksums: another file, the mesh, or the manifest's own checksum tells of them.

use super::{copy, demo, first, flip, is_clean, tells, verify};
use crate::common::list_files;
use s3d_io::fs::{create_dir, write_bytes};
use serde_json::Value;
use std::fs::{self, File};
use std::io::Cursor;
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipArchive, ZipWriter};

/// Changes a JSON file of a data set.
fn change_json(out: &Path, file: &str, change: impl FnOnce(&mut Value)) {
    let path = out.join(file);
    let mut json: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    change(&mut json);
    write_bytes(&path, json.to_string().as_bytes()).unwrap();
}

/// Packs the members of an archive again, compressed as by numpy's `savez_compressed`.
fn packed_again(path: &Path) {
    let mut from = ZipArchive::new(File::open(path).unwrap()).unwrap();
    let mut to = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for at in 0..from.len() {
        let mut member = from.by_index(at).unwrap();
        to.start_file(member.name().unwrap(), options).unwrap();
        std::io::copy(&mut member, &mut to).unwrap();
    }
    write_bytes(path, to.finish().unwrap().get_ref()).unwrap();
}

/// Changes that come with right checksums: another file, or the mesh, tells what was there.
#[test]
fn what_another_file_tells_is_held_against_it() {
    let room = "area_1/3d/rooms.json";
    let angles = "s3dis/Area_1/Area_1_alignmentAngle.txt";
    let votes = "area_1/3d/votes.json";
    let boxes = "area_1/3d/pointcloud_boxes.json";
    type Change<'a> = Box<dyn Fn(&Path) + 'a>;
    let json = |file: &'static str, pointer: &'static str, value: Value| -> Change<'_> {
        Box::new(move |out| {
            change_json(out, file, |json| *json.pointer_mut(pointer).unwrap() = value.clone())
        })
    };
    let moved = |place: &str| format!("{place} is ");
    let planted: Vec<(&str, Vec<String>, Change<'_>)> = vec![
        (
            "conventions.json",
            vec![moved("/world/unit")],
            json("conventions.json", "/world/unit", "cm".into()),
        ),
        (
            "conventions.json",
            vec![moved("/panorama/center")],
            json("conventions.json", "/panorama/center", "north".into()),
        ),
        (votes, vec![moved("/total/points")], json(votes, "/total/points", 7.into())),
        (
            votes,
            vec![moved("/classes/0/faces_contested")],
            json(votes, "/classes/0/faces_contested", 3.into()),
        ),
        (
            votes,
            vec!["more far points than there are points".into()],
            json(votes, "/rooms/0/points_farther_than_5_cm", 99_999_999.into()),
        ),
        (room, vec!["points, and its instances have".into()], json(room, "/0/points", 7.into())),
        (
            room,
            vec!["its outline reaches beyond the boxes".into()],
            Box::new(|out| {
                change_json(out, room, |json| {
                    let rings = json[0]["outline"].as_array_mut().unwrap().iter_mut();
                    for corner in rings.flat_map(|ring| ring["outer"].as_array_mut().unwrap()) {
                        corner[0] = (corner[0].as_f64().unwrap() + 100.0).into();
                    }
                });
            }),
        ),
        (
            room,
            vec!["wall_direction_deg 17, its faces give".into()],
            Box::new(|out| {
                let mut name = String::new();
                change_json(out, room, |json| {
                    json[0]["wall_direction_deg"] = 17.into();
                    name = json[0]["room"].as_str().unwrap().to_owned();
                });
                let text = fs::read_to_string(out.join(angles)).unwrap();
                let lines = text.lines().map(|line| match line.split_once(' ') {
                    Some((room, _)) if room == name => format!("{room} 17\n"),
                    _ => format!("{line}\n"),
                });
                write_bytes(&out.join(angles), lines.collect::<String>().as_bytes()).unwrap();
            }),
        ),
        (boxes, vec!["where the points are".into()], json(boxes, "/3/bbox/0", (-1.0).into())),
        (boxes, vec!["where the points are".into()], json(boxes, "/3/points", 1.into())),
        (
            "area_1/3d/semantic.mtl",
            vec!["are not the labels of semantic.obj in their colours".into()],
            Box::new(|out| {
                let path = out.join("area_1/3d/semantic.mtl");
                let text = fs::read_to_string(&path).unwrap();
                write_bytes(&path, text.replacen("Kd 0", "Kd 1", 1).as_bytes()).unwrap();
            }),
        ),
        (
            "area_1/3d/pointcloud.ply",
            vec!["is not what the mesh and its labels give".into()],
            Box::new(|out| {
                // Red and blue of every point are exchanged.
                let path = out.join("area_1/3d/pointcloud.ply");
                let mut bytes = fs::read(&path).unwrap();
                let end = b"end_header\n";
                let header = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
                bytes[header..]
                    .chunks_exact_mut(23)
                    .for_each(|point| point.swap(12, 14));
                write_bytes(&path, &bytes).unwrap();
            }),
        ),
        (
            "area_2/3d/rgb.obj",
            vec!["belongs to no area and no table".into()],
            Box::new(|out| {
                create_dir(&out.join("area_2/3d")).unwrap();
                fs::copy(out.join("area_1/3d/rgb.obj"), out.join("area_2/3d/rgb.obj")).unwrap();
            }),
        ),
    ];

    for (file, words, change) in planted {
        let (_dir, out) = copy(demo());
        change(&out);
        list_files(&out);
        let (report, code) = verify(&out, &[]);
        assert_eq!(code, 1, "{file}");
        tells(&report, file, &words.iter().map(String::as_str).collect::<Vec<_>>());
    }
}

/// A full check also reads the forms of the points that quick ones only count.
#[test]
fn files_of_points_are_counted_and_in_full_compared() {
    let (_dir, out) = copy(demo());
    let gone = first(&out, "s3dis/Area_1", "Annotations/chair_1.txt");
    fs::remove_file(out.join(&gone)).unwrap();
    let more = gone.replace("chair_1.txt", "chair_99.txt");
    write_bytes(&out.join(&more), b"1.000 1.000 1.000 0 0 0\n").unwrap();
    list_files(&out);
    let (report, code) = verify(&out, &[]);
    assert_eq!(code, 1);
    tells(&report, &gone, &["missing"]);
    tells(&report, &more, &["the mesh has no points for it"]);

    let (_dir, out) = copy(demo());
    let wall = first(&out, "s3dis/Area_1", "Annotations/wall_1.txt");
    let text = fs::read_to_string(out.join(&wall)).unwrap();
    let (first_line, rest) = text.split_once('\n').unwrap();
    write_bytes(&out.join(&wall), format!("{rest}{first_line}\n").as_bytes()).unwrap();
    flip(&out, "area_1/3d/pointcloud.mat");
    list_files(&out);
    is_clean(&out, &[]);
    let (report, code) = verify(&out, &["--full"]);
    assert_eq!(code, 1);
    for file in [&*wall, "area_1/3d/pointcloud.mat"] {
        tells(&report, file, &["is not what the mesh and its labels give", "from byte"]);
    }
}

#[test]
fn the_manifest_vouches_for_itself_and_harmless_changes_do_not_alarm() {
    let (_dir, out) = copy(demo());
    let manifest = out.join("manifest.json");
    let whole = fs::read_to_string(&manifest).unwrap();
    let value: Value = serde_json::from_str(&whole).unwrap();

    // Other blanks, another order of keys, and other ends of lines are the same.
    write_bytes(&manifest, value.to_string().as_bytes()).unwrap();
    let list = fs::read_to_string(out.join("files.csv")).unwrap();
    write_bytes(&out.join("files.csv"), list.replace('\n', "\r\n").as_bytes()).unwrap();
    is_clean(&out, &[]);

    // No other file tells these.
    for pointer in ["/options/compression", "/areas/0/faces_left_out"] {
        let mut changed = value.clone();
        let field = changed.pointer_mut(pointer).unwrap();
        *field = if field.is_string() { "small".into() } else { 7.into() };
        write_bytes(&manifest, changed.to_string().as_bytes()).unwrap();
        let (report, code) = verify(&out, &[]);
        assert_eq!(code, 1);
        tells(&report, "manifest.json", &["was changed after it was written"]);
    }
}

#[test]
fn arrays_that_another_program_packed_again_do_not_alarm() {
    let (_dir, out) = copy(demo());
    for file in ["votes.npz", "source_faces.npz"] {
        let path = out.join("area_1/3d").join(file);
        let before = fs::read(&path).unwrap();
        packed_again(&path);
        assert!(before != fs::read(&path).unwrap(), "{file}");
    }
    list_files(&out);
    is_clean(&out, &["--full"]);
}
