//! Evaluates predicted instances in the form of ScanNet's benchmark.

use crate::points::{assert_perfect, eval, npy, npz, options, rooms};
use s3d_eval::{EvalOptions, Folds, Protocol};
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// Writes perfect predictions: a list for each room, and the masks in one folder.
fn write_lists(dir: &Path) {
    fs::create_dir(dir.join("pred_mask")).unwrap();
    for (room, (classes, instances)) in rooms() {
        let mut list = String::new();
        for id in 1..=instances.iter().max().copied().unwrap() {
            let class = classes[instances.iter().position(|i| *i == id).unwrap()];
            let mask = format!("pred_mask/{room}_{id:03}.txt");
            let lines: String = instances.iter().map(|i| if *i == id { "1\n" } else { "0\n" }).collect();
            fs::write(dir.join(&mask), lines).unwrap();
            writeln!(list, "{mask} {class} 0.{id}").unwrap();
        }
        fs::write(dir.join(format!("{room}.txt")), list).unwrap();
    }
}

#[test]
fn a_data_set_is_a_perfect_prediction_in_the_form_of_scannet() {
    let dir = tempfile::tempdir().unwrap();
    write_lists(dir.path());
    let evaluation = eval(Protocol::InstAp, dir.path(), &EvalOptions::default()).unwrap();
    assert_perfect(&evaluation);
    assert_eq!(evaluation.score(&evaluation.tables[0].title, "mean", "AP"), Some(1.0));
    assert!(evaluation.notes.is_empty(), "{:?}", evaluation.notes);

    // A room in the folder of its area, with masks below it; and a room without instances.
    let room = rooms().into_keys().find(|room| room.starts_with("Area_5")).unwrap();
    let list = dir.path().join(format!("{room}.txt"));
    let in_area = dir.path().join("Area_5");
    fs::create_dir_all(in_area.join("pred_mask")).unwrap();
    for entry in fs::read_dir(dir.path().join("pred_mask")).unwrap() {
        let mask = entry.unwrap().path();
        fs::copy(&mask, in_area.join("pred_mask").join(mask.file_name().unwrap())).unwrap();
    }
    fs::rename(&list, in_area.join(format!("{}.txt", room.trim_start_matches("Area_5_")))).unwrap();
    let five = options(None, Folds::Areas(vec![5]));
    assert_perfect(&eval(Protocol::InstAp, dir.path(), &five).unwrap());
    let other = rooms().into_keys().rfind(|room| room.starts_with("Area_1")).unwrap();
    fs::write(dir.path().join(format!("{other}.txt")), "").unwrap();
    let one = eval(Protocol::InstAp, dir.path(), &options(None, Folds::Areas(vec![1]))).unwrap();
    assert!(one.score("area 1", "mean", "AP").unwrap() < 1.0);
}

/// Writes the same predictions as archives, with a mask a row.
fn write_archives(lists: &Path, dir: &Path) {
    for room in rooms().into_keys() {
        let mut arrays = [Vec::new(), Vec::new(), Vec::new()];
        let text = fs::read_to_string(lists.join(format!("{room}.txt"))).unwrap();
        for line in text.lines() {
            let words: Vec<&str> = line.split(' ').collect();
            let mask = fs::read_to_string(lists.join(words[0])).unwrap();
            arrays[0].extend(mask.lines().map(|line| u8::from(line != "0")));
            arrays[1].extend((words[1].parse::<f64>().unwrap() as i64).to_le_bytes());
            arrays[2].extend(words[2].parse::<f64>().unwrap().to_le_bytes());
        }
        let count = text.lines().count() as u64;
        let rows = arrays[0].len() as u64 / count;
        let arrays = [
            ("pred_masks", npy("|u1", &[count, rows], &arrays[0])),
            ("classes", npy("<i8", &[count], &arrays[1])),
            ("scores", npy("<f8", &[count], &arrays[2])),
        ];
        npz(&dir.join(format!("{room}.npz")), &arrays);
    }
}

#[test]
fn lists_give_the_digits_of_masks_in_an_archive() {
    let lists = tempfile::tempdir().unwrap();
    write_lists(lists.path());
    for (number, entry) in fs::read_dir(lists.path().join("pred_mask")).unwrap().enumerate() {
        // Some masks lose most of their points, and get those before the instance.
        let path = entry.unwrap().path();
        let mut text = fs::read_to_string(&path).unwrap();
        if number % 3 == 0 {
            text = text
                .replacen("0\n1\n", "-7\n-7\n", 1)
                .replacen("1\n1\n1\n", "1\n0\n0\n", 2000);
        }
        fs::write(path, text).unwrap();
    }
    let (room, _) = rooms().pop_first().unwrap();
    let list = lists.path().join(format!("{room}.txt"));
    let text = fs::read_to_string(&list).unwrap();
    fs::write(&list, text.replace(" 2 0.", " 12.0 0.")).unwrap();

    let archives = tempfile::tempdir().unwrap();
    write_archives(lists.path(), archives.path());
    let [of_lists, of_archives] = [&lists, &archives].map(|dir| {
        let evaluation = eval(Protocol::InstAp, dir.path(), &EvalOptions::default()).unwrap();
        serde_json::to_value(&evaluation).unwrap()
    });
    assert_eq!(of_lists, of_archives);
    let mean = &of_lists["tables"][0]["rows"][13]["scores"][0]["value"];
    assert!(mean.as_f64().unwrap() < 0.95, "{mean}");
}

#[test]
fn wrong_lists_are_refused_with_file_and_line() {
    let all = rooms();
    let (room, (classes, _)) = all.first_key_value().unwrap();
    let n = classes.len();
    let ones = "1\n".repeat(n);
    let short = "1\n".repeat(n - 1);
    let half = ones.replacen('1', "0.5", 1);
    let first = "pred_mask/a.txt 8 0.5\n\n";
    for (mask, line, words) in [
        (&ones, "pred_mask/b.txt 8", "line 3: has 2 words"),
        (&ones, "pred_mask/b.txt 13 0.5", "line 3: the label 13 is no class"),
        (&ones, "pred_mask/b.txt 1.5 0.5", "line 3: the label 1.5 is no class"),
        (&ones, "pred_mask/b.txt 8 high", "line 3: the confidence high is no number"),
        (&ones, "pred_mask/b.txt 8 nan", "line 3: the confidence nan is no number"),
        (&ones, "pred_mask/a.txt 8 0.5", "line 3: the mask pred_mask/a.txt is in a line above"),
        (&ones, "pred_mask/c.txt 8 0.5", "line 3: there is no file"),
        (&ones, "../b.txt 8 0.5", "line 3: the mask ../b.txt must be named from the list's folder"),
        (&ones, "/pred_mask/b.txt 8 0.5", "line 3: the mask /pred_mask/b.txt must be named from"),
        (&short, "pred_mask/b.txt 8 0.5", "lines, a line a point: Area_"),
        (&half, "pred_mask/b.txt 8 0.5", "b.txt, line 1: \"0.5\" is no integer"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        write_lists(dir.path());
        fs::write(dir.path().join("pred_mask/a.txt"), &ones).unwrap();
        fs::write(dir.path().join("pred_mask/b.txt"), mask).unwrap();
        fs::write(dir.path().join(format!("{room}.txt")), format!("{first}{line}\n")).unwrap();
        let message = eval(Protocol::InstAp, dir.path(), &EvalOptions::default())
            .unwrap_err()
            .to_string();
        assert!(message.contains(words), "{words}: {message}");
        let file = if words.starts_with("line 3") {
            room.as_str()
        } else {
            "b.txt"
        };
        assert!(message.contains(file), "{file}: {message}");
    }

    let dir = tempfile::tempdir().unwrap();
    write_lists(dir.path());
    npz(&dir.path().join(format!("{room}.npz")), &[]);
    let message = eval(Protocol::InstAp, dir.path(), &EvalOptions::default())
        .unwrap_err()
        .to_string();
    assert!(message.contains("second prediction of the room"), "{message}");
}
