//! Labels that follow the picture, for views, panoramas and photographs: by an export, or added later.

use super::studio::{LISTED, Project, demo, photographs};
use crate::common::{files, s3d_fails, s3d_ok, text, write_scan};
use s3d_io::dataset::{Domain, Frame, Layout, dataset_images};
use s3d_io::image::{encode_gray8, read_numbers8, read_rgb8};
use std::fs;

const ALL: &str = "rgb,depth,normal,semantic,semantic_pretty,global_xyz,pose,semantic_refined,semantic_moved";

/// A project with labels, scan locations and photographs.
fn project() -> Project {
    let [tree, list] = ["Area_1", "cameras.csv"].map(|name| text(&demo().join(name)).to_owned());
    Project::with_photographs(&format!(
        "[annotations]\npath = {tree:?}\n[cameras]\npath = {list:?}\n{LISTED}"
    ))
}

#[test]
fn what_is_added_later_is_what_an_export_writes() {
    let project = project();
    let (at_once, _) = project.export("at_once", &["--modalities", ALL]);
    let (later, _) = project.export("later", &[]);
    let before = files(&later);
    s3d_ok(&["refine", text(&later), "--threads", "2"]);
    s3d_ok(&["verify", text(&later)]);

    // The same files, all but the list, whose manifest tells of the same modalities.
    let (once, after) = (files(&at_once), files(&later));
    assert!(once.keys().eq(after.keys()));
    for (path, bytes) in &once {
        assert_eq!(after.get(path), Some(bytes), "{}", path.display());
    }
    // What was there is as it was.
    let kept = before
        .iter()
        .filter(|(path, _)| !path.ends_with("manifest.json") && !path.ends_with("files.csv"));
    kept.for_each(|(path, bytes)| assert_eq!(after.get(path), Some(bytes), "{}", path.display()));

    // Views, panoramas and photographs have both images, and the mask says where labels differ.
    let layout = Layout::new(&later);
    let images = dataset_images(&layout, 1).unwrap();
    let taken: Vec<String> = photographs(&later).into_iter().map(|p| p.camera_uuid).collect();
    let mut moved_on_photographs = 0;
    for image in &images {
        let read = |domain| read_rgb8(&image.path(&layout, domain)).unwrap();
        let [semantic, refined] = [Domain::Semantic, Domain::SemanticRefined].map(read);
        let moved = read_numbers8(&image.path(&layout, Domain::SemanticMoved)).unwrap();
        let pairs = semantic.pixels().iter().zip(refined.pixels());
        assert!(
            pairs
                .map(|(a, b)| if a == b { 0 } else { 255 })
                .eq(moved.pixels().iter().copied())
        );
        if taken.contains(&image.uuid) {
            moved_on_photographs += moved.pixels().iter().filter(|value| **value > 0).count();
        }
    }
    assert!(images.iter().any(|image| image.frame == Frame::Panorama) && taken.len() == 4);
    assert!(moved_on_photographs > 0);

    // Not twice, unless asked for; then with the same bytes, for another number of threads too.
    s3d_fails(&["refine", text(&later)], 2, &["semantic_refined", "--overwrite"]);
    s3d_ok(&["refine", text(&later), "--overwrite", "--threads", "1"]);
    assert!(files(&later) == after);

    // `verify` tells of a changed pixel.
    let photograph = images.iter().find(|image| image.uuid == taken[0]).unwrap();
    let path = photograph.path(&layout, Domain::SemanticMoved);
    let mut mask = read_numbers8(&path).unwrap();
    mask.pixels_mut()[777] ^= 255;
    fs::write(&path, encode_gray8(&mask)).unwrap();
    s3d_fails(&["verify", text(&later)], 1, &[]);
}

#[test]
fn what_cannot_be_refined_stays_as_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scan(&dir.path().join("scan"), 1);
    let out = dir.path().join("out");
    let small = ["--size", "32", "--pano-width", "64", "--views", "1", "--points-per-m2", "20"];
    for (modalities, lacks) in
        [("semantic,pose", "no rgb"), ("rgb,pose", "no semantic"), ("rgb,semantic", "no pose")]
    {
        let export = ["export", text(&scene), "-o", text(&out), "--overwrite", "--modalities", modalities];
        s3d_ok(&[&export[..], &small].concat());
        let before = files(&out);
        s3d_fails(&["refine", text(&out)], 1, &[lacks, "manifest.json"]);
        assert!(files(&out) == before, "{modalities}");
    }
    s3d_fails(&["refine", text(dir.path())], 1, &["give the folder of a data set"]);
    s3d_fails(&["refine", text(&dir.path().join("none"))], 1, &["give the folder of a data set"]);
    s3d_fails(&["refine"], 2, &["OUT"]);
}
