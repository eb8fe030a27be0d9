//! Data sets that are damaged, incomplete or not there, and names that mean to steer a terminal.

use super::common::{s3d, s3d_fails, s3d_ok, text};
use super::exports::{altered, copy, copy_to, file, whole};
use super::{compare, compare_with, count, entry};
use s3d_dataset::compare::CompareOptions;
use s3d_dataset::{Cancel, Context, Error};
use s3d_io::dataset::Domain;
use s3d_io::fs::write_bytes;
use std::fs;
use std::path::Path;

fn flip(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    write_bytes(path, &bytes).unwrap();
}

/// Everything that could not be compared, by path.
fn unread(json: &serde_json::Value) -> Vec<(String, String)> {
    let all = json["unread"].as_array().unwrap().iter();
    let word = |value: &serde_json::Value| value.as_str().unwrap().to_owned();
    all.map(|of| (word(&of["side"]) + ":" + &word(&of["path"]), word(&of["message"])))
        .collect()
}

#[test]
fn what_is_missing_or_damaged_is_named_and_the_rest_is_compared() {
    let depth = file(whole(), false, Domain::Depth);
    let depth = text(depth.strip_prefix(whole()).unwrap());
    // Gone or cut off: told without opening a file.
    for cut in [true, false] {
        let (_dir, out) = copy(whole());
        let bytes = fs::read(out.join(depth)).unwrap();
        fs::remove_file(out.join(depth)).unwrap();
        if cut {
            fs::write(out.join(depth), &bytes[1..]).unwrap();
        }
        let (answer, json, code) = compare(whole(), &out);
        let all = unread(&json);
        assert_eq!((code, all.len(), all[0].0.as_str()), (1, 1, &*format!("b:{depth}")), "{answer}");
        assert!(answer.contains(&format!("  B: {depth}: ")), "{answer}");
        assert!(answer.ends_with("not all of it is there\n"), "{answer}");
        assert_eq!(entry(&json["modalities"], "modality", "rgb")["same"], 12);
    }
    // A bit of a file to which both lists give the same checksum: told by whoever reads all.
    let (_dir, out) = copy(whole());
    flip(&out.join(depth));
    assert_eq!(compare(whole(), &out).2, 0);
    let (answer, json, code) = compare_with(&out, whole(), &["--full"]);
    let all = unread(&json);
    assert_eq!((code, all.len(), all[0].0.as_str()), (1, 1, &*format!("a:{depth}")), "{answer}");
    assert!(all[0].1.contains("other content than was written"), "{all:?}");

    // Files that are read since they differ, and are not what the list tells.
    let semantic = "area_1/3d/semantic.obj";
    let (_dir, out) = altered(whole(), |out| {
        for name in [semantic, "area_1/views.json", depth] {
            let bytes = [&fs::read(out.join(name)).unwrap()[..], b" \n"].concat();
            write_bytes(&out.join(name), &bytes).unwrap();
        }
    });
    assert_eq!(count(&compare(whole(), &out).1["unread"]), 0);
    for name in [semantic, "area_1/views.json", depth] {
        flip(&out.join(name));
    }
    let (answer, json, code) = compare(whole(), &out);
    let names: Vec<String> = unread(&json).into_iter().map(|(name, _)| name).collect();
    let expected = [semantic, depth, "area_1/views.json"].map(|name| format!("b:{name}"));
    let mut expected = expected.to_vec();
    expected.sort();
    assert_eq!((code, names), (1, expected), "{answer}");
    assert_eq!(json["areas"][0]["geometry"], "unread");
    assert_eq!(entry(&json["modalities"], "modality", "depth")["unread"], 1);
    assert_eq!(entry(&json["modalities"], "modality", "rgb")["same"], 12);
}

/// Files that are as the list has them, and hold what they should not.
#[test]
fn what_no_data_set_holds_is_named() {
    let semantic = file(whole(), false, Domain::Semantic);
    let semantic = text(semantic.strip_prefix(whole()).unwrap());
    let mesh = "area_1/3d/semantic.obj";
    let pose = file(whole(), true, Domain::Pose);
    let pose = text(pose.strip_prefix(whole()).unwrap());
    let (_dir, out) = altered(whole(), |out| {
        let image = s3d_io::image::read_rgb8(&out.join(semantic)).unwrap();
        let image = image.map(|p| if p == [13; 3] { p } else { [9, 9, 9] });
        let content = s3d_io::image::Content::Labels;
        let bytes = s3d_io::image::encode_rgb8(&image, content, s3d_io::image::Compression::Fast);
        write_bytes(&out.join(semantic), &bytes).unwrap();
        let text = fs::read_to_string(out.join(mesh))
            .unwrap()
            .replace("table_1", "throne_1");
        write_bytes(&out.join(mesh), text.as_bytes()).unwrap();
        write_bytes(&out.join(pose), b"{}").unwrap();
    });
    let (answer, json, code) = compare(whole(), &out);
    let all = unread(&json);
    let told = |name: &str, words: &str| {
        let found = all.iter().find(|(path, _)| *path == format!("b:{name}"));
        assert!(found.is_some_and(|(_, message)| message.contains(words)), "{name} {words}: {all:?}");
    };
    assert_eq!((code, all.len()), (1, 3), "{answer}");
    told(semantic, "a pixel has label 592137, and the data set has 8 labels");
    told(mesh, "\"throne_1_office_1_1\" is no label");
    told(pose, "missing field");
    assert_eq!(entry(&json["modalities"], "modality", "semantic")["unread"], 1);
}

#[test]
fn what_is_no_complete_data_set_is_an_error_that_names_it() {
    let (_dir, out) = copy(whole());
    let folder = out.parent().unwrap();
    let nothing = folder.join("nothing");
    s3d_fails(&["compare", text(&out), text(&nothing)], 2, &["nothing", "no data set is there"]);
    s3d_fails(&["compare", text(&nothing), text(&out)], 2, &["nothing", "no data set is there"]);
    s3d_fails(&["compare", text(&out)], 2, &["<B>"]);
    for name in ["manifest.json", "files.csv", "conventions.json"] {
        let (_dir, out) = copy(whole());
        let bytes = fs::read(out.join(name)).unwrap();
        write_bytes(&out.join(name), &bytes[..bytes.len() / 2]).unwrap();
        for call in [[text(whole()), text(&out)], [text(&out), text(whole())]] {
            s3d_fails(&[&["compare"][..], &call].concat(), 1, &[name]);
        }
    }
    let manifest = fs::read_to_string(out.join("manifest.json")).unwrap();
    let running = manifest.replace("\"complete\"", "\"running\"");
    write_bytes(&out.join("manifest.json"), running.as_bytes()).unwrap();
    s3d_fails(&["compare", text(whole()), text(&out)], 1, &["manifest.json", "did not finish"]);
}

#[test]
fn it_can_be_cancelled() {
    let cancel = Cancel::default();
    cancel.cancel();
    let ctx = Context::default().cancelled_by(cancel.clone());
    let compare = || s3d_dataset::compare(whole(), whole(), &CompareOptions::default(), &ctx);
    assert!(matches!(compare(), Err(Error::Cancelled)));
    cancel.reset();
    assert!(compare().unwrap().is_equal());
}

#[cfg(unix)]
#[test]
fn names_do_not_steer_a_terminal() {
    let (_dir, out) = copy_to(whole(), "a\u{1b}[31mred\u{202e}der\nequal: all");
    fs::remove_file(file(&out, false, Domain::Rgb)).unwrap();
    let said = s3d(&["compare", text(&out), text(whole())]);
    let (answer, log) = (String::from_utf8(said.stdout).unwrap(), String::from_utf8(said.stderr).unwrap());
    assert_eq!(said.status.code(), Some(1), "{answer}{log}");
    for text in [&answer, &log] {
        assert!(!text.contains('\u{1b}') && !text.contains('\u{202e}'), "{text:?}");
    }
    assert!(answer.contains("red\u{fffd}der\u{fffd}equal: all"), "{answer}");
    assert!(!answer.lines().any(|line| line.starts_with("equal")), "{answer}");
    s3d_ok(&["compare", text(whole()), text(whole()), "--json", "-"]);
}
