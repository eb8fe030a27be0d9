//! Scores that look like a mistake in the files of the predictions have a note that says so.

use crate::points::{data_set, eval, integers, npy, npz, rooms};
use s3d_dataset::DataSet;
use s3d_eval::{Context, EvalOptions, Protocol, evaluate};
use s3d_io::dataset::{Domain, Frame};
use s3d_io::image::{read_gray16, read_rgb8};
use serde_json::json;
use std::fs;
use std::path::Path;

/// Returns the notes on predictions of points that have these arrays in each room.
fn notes(protocol: Protocol, arrays: impl Fn(&[i64]) -> Vec<(&'static str, Vec<u8>)>) -> Vec<String> {
    let dir = tempfile::tempdir().unwrap();
    for (room, (classes, _)) in rooms() {
        npz(&dir.path().join(format!("{room}.npz")), &arrays(&classes));
    }
    eval(protocol, dir.path(), &EvalOptions::default()).unwrap().notes
}

#[test]
fn points_without_predictions_or_of_one_class_are_noted() {
    let of = |number: i64| {
        move |classes: &[i64]| {
            let numbers = vec![number; classes.len()];
            vec![("instance", integers(&numbers)), ("semantic", integers(&vec![2; classes.len()]))]
        }
    };
    for (protocol, noun) in [(Protocol::InstCov, "instances"), (Protocol::Panoptic3d, "segments")] {
        let told = notes(protocol, of(0));
        assert!(told[0].starts_with("Doubtful: all ") && told[0].contains(noun), "{protocol}: {told:?}");
        assert!(told[0].contains("the class wall"), "{protocol}: {told:?}");
    }
    let told = notes(Protocol::InstCov, of(-1));
    assert_eq!(told, ["Doubtful: no instances are predicted, in any room."]);
    let told = notes(Protocol::InstAp, |classes| {
        let ids = vec![-1; classes.len()];
        vec![("instance", integers(&ids)), ("classes", integers(&[])), ("scores", integers(&[]))]
    });
    assert!(told[0].starts_with("Doubtful: no instances of 100 points or more"), "{told:?}");
    let told = notes(Protocol::Sem3d, |classes| vec![("semantic", integers(&vec![0; classes.len()]))]);
    assert!(told[0].contains("predicted points are of the class ceiling"), "{told:?}");
    let right = notes(Protocol::Sem3d, |classes| vec![("semantic", integers(classes))]);
    assert!(right.is_empty(), "{right:?}");
}

/// Returns the notes on boxes that are true ones, scaled and moved.
fn notes_on_boxes(folder: &Path, scale: f32, offset: f32) -> String {
    let data = DataSet::open(data_set()).unwrap();
    let mut list = Vec::new();
    for area in data.areas() {
        for i in data.instances(*area).unwrap() {
            let b = i.bbox.map(|c| scale * c + offset);
            list.push(json!({"area": area, "room": i.room, "class": i.class, "score": 0.5,
                "min": b[..3], "max": b[3..]}));
        }
    }
    let path = folder.join("boxes.json");
    fs::write(&path, json!(list).to_string()).unwrap();
    let options = EvalOptions::default();
    let evaluation = evaluate(Protocol::Det, data_set(), &path, &options, &Context::default()).unwrap();
    evaluation.notes.join("\n")
}

#[test]
fn boxes_in_another_unit_or_frame_are_noted() {
    let dir = tempfile::tempdir().unwrap();
    let same = notes_on_boxes(dir.path(), 1.0, 0.0);
    assert!(!same.contains("Doubtful"), "{same}");
    let far = notes_on_boxes(dir.path(), 1.0, 500.0);
    assert!(far.contains("Doubtful: no detected box touches a true one"), "{far}");
    let millimetres = notes_on_boxes(dir.path(), 1000.0, 0.0);
    assert!(millimetres.contains("Doubtful: the longest side of a detected box"), "{millimetres}");
}

/// Writes floats for each panorama: `of` gets the numbers of a pixel of the data set's image.
fn write_panoramas(data: &DataSet, dir: &Path, domain: Domain, of: impl Fn(&[f64]) -> Vec<f64>) {
    for area in data.areas() {
        for image in data
            .images(*area)
            .into_iter()
            .filter(|image| image.frame == Frame::Panorama)
        {
            let path = image.path(data.layout(), domain);
            let (size, pixels): ([u32; 2], Vec<Vec<f64>>) = if domain == Domain::Depth {
                let image = read_gray16(&path).unwrap();
                let pixels = image.pixels().iter().map(|value| vec![f64::from(*value)]).collect();
                ([image.height(), image.width()], pixels)
            } else {
                let image = read_rgb8(&path).unwrap();
                let pixels = image.pixels().iter().map(|rgb| rgb.map(f64::from).to_vec()).collect();
                ([image.height(), image.width()], pixels)
            };
            let numbers: Vec<f64> = pixels.iter().flat_map(|pixel| of(pixel)).collect();
            let channels = numbers.len() / pixels.len();
            let shape = [u64::from(size[0]), u64::from(size[1]), channels as u64];
            let bytes: Vec<u8> = numbers.iter().flat_map(|n| n.to_le_bytes()).collect();
            let name = path.with_extension("npy");
            fs::write(dir.join(name.file_name().unwrap()), npy("<f8", &shape, &bytes)).unwrap();
        }
    }
}

#[test]
fn depth_in_another_unit_and_turned_normals_are_noted() {
    let data = DataSet::open(data_set()).unwrap();
    let notes = |protocol: Protocol, domain: Domain, of: &dyn Fn(&[f64]) -> Vec<f64>| {
        let dir = tempfile::tempdir().unwrap();
        write_panoramas(&data, dir.path(), domain, of);
        eval(protocol, dir.path(), &EvalOptions::default())
            .unwrap()
            .notes
            .join("\n")
    };
    let metres = notes(Protocol::Depth, Domain::Depth, &|v| vec![v[0] / 512.0]);
    assert!(!metres.contains("Doubtful"), "{metres}");
    let raw = notes(Protocol::Depth, Domain::Depth, &|v| vec![v[0]]);
    assert!(raw.contains("Doubtful:") && raw.contains("in units of 1/512 m"), "{raw}");

    let normal = |v: &[f64], sign: f64| v.iter().map(|c| sign * (c - 127.5) / 127.5).collect();
    let same = notes(Protocol::Normal, Domain::Normal, &|v| normal(v, 1.0));
    assert!(!same.contains("Doubtful"), "{same}");
    let turned = notes(Protocol::Normal, Domain::Normal, &|v| normal(v, -1.0));
    assert!(turned.contains("Doubtful: the mean angle is 1"), "{turned}");
}
