//! `s3d eval`: results as text and JSON, and the messages for a wrong call or prediction.

use crate::common;
use common::{s3d, s3d_fails, s3d_ok, text, write_scan};
use serde_json::Value;
use std::fs;

#[test]
fn a_data_set_against_its_own_package_is_perfect_in_text_and_json() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let scene = write_scan(&at("scan"), 1);
    let (out, coco, file, none) = (at("out"), at("coco"), at("result.json"), at("none.json"));
    let list = coco.join("panoptic.json");
    let small = ["--views", "6", "--size", "48", "--pano-width", "96", "--points-per-m2", "20"];
    s3d_ok(&[&["export", text(&scene), "-o", text(&out)], &small[..]].concat());
    s3d_ok(&["pack", text(&out), "--to", "coco", "-o", text(&coco)]);

    let call = ["eval", "panoptic", "--truth", text(&out), "--pred", text(&list)];
    let said = s3d(&[&call[..], &["--json", text(&file)]].concat());
    let answer = String::from_utf8(said.stdout).unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
    assert!(answer.starts_with("# panoptic, version 1, as panopticapi\n"), "{answer}");
    let result: Value = serde_json::from_slice(&fs::read(&file).unwrap()).unwrap();
    let rows = result["tables"][0]["rows"].as_array().unwrap();
    let pq = rows.iter().flat_map(|row| row["scores"].as_array().unwrap().first());
    let defined: Vec<&Value> = pq
        .map(|score| &score["value"])
        .filter(|value| !value.is_null())
        .collect();
    assert!(defined.len() > 4 && defined.iter().all(|value| **value == 1.0), "{answer}");
    // The same result on standard output, and for any number of threads.
    let said = s3d(&[&call[..], &["--json", "-", "--threads", "1"]].concat());
    assert_eq!(serde_json::from_slice::<Value>(&said.stdout).unwrap(), result);

    // An existing file is kept: the call is refused before the evaluation starts.
    let there = fs::read(&file).unwrap();
    s3d_fails(&[&call[..], &["--json", text(&file)]].concat(), 2, &["result.json", "--overwrite"]);
    assert_eq!(fs::read(&file).unwrap(), there);

    s3d_fails(&[&call[..], &["--variant", "mine"]].concat(), 2, &["panoptic has no variant \"mine\""]);
    s3d_fails(&[&call[..], &["--areas", "5"]].concat(), 2, &["no area 5: it has 1"]);
    s3d_fails(&[&call[..], &["--stuff", "grass"]].concat(), 2, &["--stuff: \"grass\" is no class"]);
    let without = ["eval", "det", "--truth", text(&out), "--pred", text(&none)];
    s3d_fails(&without, 1, &["none.json"]);
    let twice = [&without[..], &["--classes", "sofa,sofa"]].concat();
    s3d_fails(&twice, 2, &["--classes: sofa is there twice"]);
    let without = ["eval", "sem3d", "--truth", text(&out), "--pred", text(&coco)];
    s3d_fails(&without, 1, &["office_1"]);
    s3d_fails(&["eval", "sem2d", "--truth", "a", "--pred", "b"], 2, &["inst-ap"]);
}
