//! Compares the metrics of images with the reference programs: `reference/images/README.md`.

use s3d_eval::images::{
    Alignment, AngleSums, Confusion, Lanczos, PANORAMA, PanoramaClasses, class_outlines, depth_edges,
    dsine_angle, hohonet_depth, marigold_depth, median_of_angles, omnidata_angle, omnidata_scores,
    opencv_nearest, pillow_nearest, unifuse_depth,
};
use s3d_geom::Raster;
use serde_json::Value;

fn expected() -> Value {
    serde_json::from_str(include_str!("reference/images/expected.json")).unwrap()
}

/// The same as `mix` in reference/images/inputs.py.
fn mix(seed: u64, i: u64) -> u64 {
    const MASK: u64 = 0xFFFF_FFFF;
    let mut x = (i.wrapping_mul(0x9E37_79B1).wrapping_add(seed * 0x85EB_CA77)) & MASK;
    x ^= x >> 15;
    x = (x * 0x2C1B_3C6D) & MASK;
    x ^= x >> 12;
    x = (x * 0x297A_2D39) & MASK;
    x ^ (x >> 15)
}

fn checksum(values: impl IntoIterator<Item = u64>) -> u64 {
    let weighted = values
        .into_iter()
        .zip(0u64..)
        .map(|(v, i)| v.wrapping_mul((i * 0x9E37_79B1) & 0xFFFF_FFFF));
    weighted.fold(0, u64::wrapping_add)
}

fn raster<T>(width: u32, height: u32, pixel: impl Fn(u64, u64, u64) -> T) -> Raster<T> {
    let [w, h] = [width, height].map(u64::from);
    Raster::from_vec(width, height, (0..w * h).map(|i| pixel(i % w, i / w, i)).collect())
}

fn rgb(width: u32, height: u32, seed: u64) -> Raster<[u8; 3]> {
    raster(width, height, |x, y, i| {
        let noise = [0, 1, 2].map(|c| mix(seed + 100 + c, i));
        match mix(seed, (y / 24) * 997 + x / 24) % 4 {
            0 => [0; 3],
            1 => noise.map(|n| (n % 3) as u8),
            2 => [255; 3],
            _ => noise.map(|n| (n % 256) as u8),
        }
    })
}

/// HoHoNet's numbers of the classes with labels: all but beam and column.
const CLASSES: [u8; 11] = [1, 2, 3, 4, 5, 7, 8, 9, 10, 11, 12];

fn semantic(name: &str, width: u32, height: u32, seed: u64) -> Raster<[u8; 3]> {
    raster(width, height, |x, y, _| {
        let index = mix(seed + 7, (y / 5) * 991 + x / 7) % 13;
        if name == "void" || index == 12 {
            [13; 3]
        } else {
            [0, 0, index as u8]
        }
    })
}

const PANORAMAS: [(&str, u32, u32, u64); 6] = [
    ("a", 2048, 1024, 1),
    ("b", 1024, 512, 2),
    ("c", 1000, 500, 3),
    ("d", 4096, 2048, 4),
    ("f", 1360, 680, 6),
    ("void", 1024, 512, 5),
];

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Asserts that numbers are equal to a relative 1e-12, or both below 1e-12.
#[track_caller]
fn same(ours: &[f64], theirs: &[f64], what: &str) {
    near(ours, theirs, 1e-12, what);
}

#[track_caller]
fn near(ours: &[f64], theirs: &[f64], tolerance: f64, what: &str) {
    assert_eq!(ours.len(), theirs.len(), "{what}");
    for (a, b) in ours.iter().zip(theirs) {
        assert!((a - b).abs() <= tolerance * b.abs() + 1e-12, "{what}: {ours:?}, the reference {theirs:?}");
    }
}

#[test]
fn the_libraries_take_the_same_pixels() {
    let expected = &expected()["resampling"];
    for (library, places) in [
        ("pillow", pillow_nearest as fn(u32, u32) -> Vec<u32>),
        ("skimage", pillow_nearest),
        ("opencv", opencv_nearest),
    ] {
        for (axis, sum) in expected[library].as_object().unwrap() {
            let (from, to) = axis.split_once(' ').unwrap();
            let places = places(from.parse().unwrap(), to.parse().unwrap());
            assert_eq!(
                checksum(places.into_iter().map(u64::from)),
                sum.as_u64().unwrap(),
                "{library}, {axis}"
            );
        }
    }
}

#[test]
fn pillow_gives_the_same_after_lanczos() {
    for (name, width, height, seed) in PANORAMAS.into_iter().filter(|(_, width, ..)| *width <= 2048) {
        let image = rgb(width, height, seed);
        let lanczos = Lanczos::new([width, height], PANORAMA);
        for channel in 0..3 {
            let ours = lanczos.channel(&image, channel);
            let theirs = expected()["resampling"]["lanczos"][name][channel].as_u64().unwrap();
            assert_eq!(checksum(ours.iter().map(|v| u64::from(*v))), theirs, "{name}, {channel}");
            for at in (0..ours.len()).step_by(7919) {
                assert_eq!(
                    lanczos.pixel(&image, channel, at % 1024, at / 1024),
                    ours[at],
                    "{name}, pixel {at}"
                );
            }
        }
    }
}

#[test]
fn hohonet_gives_the_same_for_classes_of_panoramas() {
    for (fold, names) in [("1_valid", &["a", "b", "void"][..]), ("2_valid", &["c", "d"]), ("3_valid", &["f"])]
    {
        let mut all = Confusion::new(13);
        for (name, width, height, seed) in PANORAMAS.into_iter().filter(|(name, ..)| names.contains(name)) {
            let class = |index: u16| CLASSES.get(usize::from(index).checked_sub(1)?).copied();
            let truth =
                PanoramaClasses::new(&rgb(width, height, seed), &semantic(name, width, height, seed), class);
            let prediction: Vec<u8> = (0..1024 * 512).map(|i| (mix(seed + 50, i) % 13) as u8).collect();
            all.add(&truth.compare(&prediction, 13).unwrap());
            assert_eq!(truth.classes.iter().all(Option::is_none), name == "void");
        }

        let expected = &expected()["sem-pano"][fold];
        let scores = all.scores();
        let of_there = |values: &[f64]| CLASSES.map(|class| values[usize::from(class)]);
        same(&of_there(&scores.iou), &numbers(&expected["iou"]), fold);
        same(&of_there(&scores.accuracy), &numbers(&expected["accuracy"]), fold);
        same(&[scores.mean_iou, scores.mean_accuracy], &numbers(&expected["mean"]), fold);
        assert!(scores.iou[0].is_nan() && scores.accuracy[6].is_nan(), "no pixel is beam or column");
        let matrix: u64 = expected["cm"]
            .as_array()
            .unwrap()
            .iter()
            .map(|row| numbers(row).iter().sum::<f64>() as u64)
            .sum();
        assert!(matrix < all.pixels(), "what was taken for beam or column counts nowhere");
    }
}

fn depth(width: u32, height: u32, seed: u64) -> Vec<u16> {
    let value = |i: u64| match mix(seed + 1, i) % 16 {
        0 => u16::MAX,
        1 => 0,
        _ => (mix(seed, i) % 7000) as u16,
    };
    (0..u64::from(width) * u64::from(height)).map(value).collect()
}

fn predicted_depth(truth: &[u16], seed: u64) -> Vec<f64> {
    let predicted = |(truth, i): (&u16, u64)| {
        let h = mix(seed + 2, i);
        let metres = f64::from(*truth) / 512.0;
        match h / 1024 % 16 {
            0 => metres * 1.25,
            1 => 0.0,
            2 => 12.5,
            _ => metres * (0.7 + (h % 1024) as f64 / 1024.0 * 0.6),
        }
    };
    truth.iter().zip(0..).map(predicted).collect()
}

fn metres(units: &[u16]) -> Vec<f64> {
    units
        .iter()
        .map(|&v| if v == u16::MAX { 0.0 } else { f64::from(v) / 512.0 })
        .collect()
}

/// The scripts average the shares of pixels within the limits of δ in 32 bits.
#[track_caller]
fn same_depth(ours: &[f64], theirs: &Value, what: &str) {
    let theirs = numbers(theirs);
    let (errors, within) = ours.split_at(ours.len() - 3);
    let (their_errors, their_within) = theirs.split_at(theirs.len() - 3);
    same(errors, their_errors, what);
    near(within, their_within, 1e-7, what);
}

#[test]
fn both_scripts_give_the_same_depth_scores() {
    let expected = &expected()["depth"];
    let cases = [
        ("mixed", depth(4096, 1, 11)),
        ("one", vec![2048]),
        ("beyond", vec![6000; 64]),
        ("even", depth(1000, 1, 12)),
        ("odd", depth(999, 1, 13)),
    ];
    for (seed, (name, units)) in (0..).zip(cases) {
        let truth = metres(&units);
        let prediction = predicted_depth(&units, seed);
        let without_sq_rel = |scores: [f64; 9]| [&scores[..2], &scores[3..]].concat();
        let ours = without_sq_rel(hohonet_depth(&truth, &prediction).values);
        same_depth(&ours, &expected[name]["hohonet"], name);
        // The script itself computes in 32 bits.
        near(&ours, &numbers(&expected[name]["hohonet in 32 bits"]), 1e-6, name);
        let ours = unifuse_depth(&truth, &prediction, false);
        assert_eq!(ours.pixels == 0, name == "beyond");
        if ours.pixels > 0 {
            same_depth(&ours.values, &expected[name]["unifuse"], name);
            let scaled = unifuse_depth(&truth, &prediction, true);
            same_depth(&scaled.values, &expected[name]["unifuse, median"], name);
            assert!(name == "one" || ours.replaced > 0);
        }
    }
}

#[test]
fn both_scripts_give_the_same_depth_scores_of_files() {
    let whole = depth(4096, 2048, 21);
    let sampled = |places: fn(u32, u32) -> Vec<u32>| {
        let columns = places(4096, 1024);
        let rows = places(2048, 512);
        let at = |row: u32, column: u32| whole[row as usize * 4096 + column as usize];
        rows.iter()
            .flat_map(|&row| columns.iter().map(move |&c| at(row, c)))
            .collect::<Vec<u16>>()
    };
    let prediction = predicted_depth(&depth(1024, 512, 22), 23);
    let scores = hohonet_depth(&metres(&sampled(pillow_nearest)), &prediction).values;
    let expected = &expected()["depth"]["file"];
    same_depth(&[&scores[..2], &scores[3..]].concat(), &expected["hohonet"], "hohonet");
    let scores = unifuse_depth(&metres(&sampled(opencv_nearest)), &prediction, false);
    same_depth(&scores.values, &expected["unifuse"], "unifuse");
}

/// Predictions of each alignment: depth, disparity, metres.
const ALIGNMENTS: [(&str, Alignment); 3] = [
    ("marigold", Alignment::Depth),
    ("marigold-disparity", Alignment::Disparity),
    ("marigold-metric", Alignment::Metric),
];

/// The same as `affine_view`, `disparity_view` and `metric_view` in reference/images/inputs.py.
fn view(truth: &[u16], seed: u64, alignment: Alignment) -> Vec<f64> {
    let quantized = |value: f64| (value * 1024.0).floor() / 1024.0;
    if alignment == Alignment::Metric {
        return predicted_depth(truth, seed).into_iter().map(quantized).collect();
    }
    let predicted = |(truth, i): (&u16, u64)| {
        let h = mix(seed + 2, i);
        let spread = 0.8 + (h % 1024) as f64 / 1024.0 * 0.4;
        let metres = f64::from(*truth) / 512.0;
        quantized(match (alignment, h / 1024 % 16) {
            (Alignment::Depth, 1) => 2.0,
            (Alignment::Depth, _) => metres * spread * 0.25 - 3.0,
            (_, 1) => 0.0,
            (_, 2) => -2.0,
            _ => 40.0 / (metres + 0.25) * spread + 3.0,
        })
    };
    truth.iter().zip(0..).map(predicted).collect()
}

#[test]
fn marigold_gives_the_same_scores_of_views() {
    let expected = &expected()["views"];
    let cases = [
        ("mixed", depth(64, 48, 51), 52, None),
        ("odd", depth(37, 27, 53), 54, None),
        ("one", vec![0, 700, 65535, 6000], 55, None),
        ("flat", depth(20, 10, 56), 57, Some(3.0)),
        ("far", depth(20, 10, 56), 57, Some(-3.0)),
    ];
    for (name, units, seed, flat) in cases {
        let truth = metres(&units);
        for (variant, alignment) in ALIGNMENTS {
            let prediction = match flat {
                Some(value) => vec![value; truth.len()],
                None => view(&units, seed, alignment),
            };
            let ours = marigold_depth(&truth, &prediction, alignment);
            let theirs = numbers(&expected[variant][name]);
            let is_metric = alignment == Alignment::Metric;
            let theirs_in_64_bits = if is_metric {
                numbers(&expected["marigold-metric in 64 bits"][name])
            } else {
                theirs.clone()
            };
            let what = format!("{variant}, {name}");

            // The script averages the shares of δ in 32 bits, in which chance brings a pixel within a limit.
            let [within, errors] = [[5, 6, 7].as_slice(), &[0, 1, 2, 3, 4, 8, 9]]
                .map(|at| at.iter().map(|&at| (ours.values[at], theirs_in_64_bits[at])).unzip());
            let (ours_of, theirs_of): (Vec<f64>, Vec<f64>) = errors;
            near(&ours_of, &theirs_of, 1e-11, &what);
            let (ours_of, theirs_of): (Vec<f64>, Vec<f64>) = within;
            near(&ours_of, &theirs_of, 1e-7, &what);
            near(&ours.values, &theirs, 1e-3, &what);

            assert_eq!(ours.is_aligned, is_metric || flat.is_none() && name != "one", "{what}");
        }
    }

    let none = marigold_depth(&[0.0, 10.0], &[1.0, f64::NAN], Alignment::Depth);
    assert!(none.pixels == 0 && none.values[0].is_nan());
}

#[test]
fn an_alignment_does_not_depend_on_the_unit() {
    let units = depth(64, 48, 51);
    let truth = metres(&units);
    let prediction = view(&units, 52, Alignment::Depth);
    let scores = |scale: f64, shift: f64| {
        let moved: Vec<f64> = prediction.iter().map(|p| p * scale + shift).collect();
        marigold_depth(&truth, &moved, Alignment::Depth).values
    };
    let plain = scores(1.0, 0.0);
    near(&scores(-3e-9, 1e-8), &plain, 1e-9, "small");
    // Far from 0, where the squares of predictions would lose all digits.
    near(&scores(1.0, 1e9), &plain, 1e-3, "far");
    near(&scores(1e200, 0.0), &plain, 1e-9, "large");
}

#[test]
fn depth_pro_gives_the_same_boundaries() {
    let expected = &expected()["depth-edge"];
    for (name, width, height, seed) in [("boxes", 64, 48, 71), ("narrow", 9, 31, 74)] {
        let [mut truth, mut prediction] = [Vec::new(), Vec::new()];
        let at = |x: u64, y: u64| {
            let block = mix(seed, (y / 6) * 31 + x / 5) % 40;
            let units = 1000 + block * 23 + mix(seed + 1, y * width + x) % 60;
            (block, if block == 0 { 65535 } else { units })
        };
        for i in 0..width * height {
            let [x, y] = [i % width, i / width];
            let (block, units) = at(x, y);
            let from = if y % 7 == 0 { (x + width - 1) % width } else { x };
            let moved = at(from, y).1 as f64 * 0.7 + (mix(seed + 2, i) % 50) as f64;
            truth.push(if units == 65535 { 0.0 } else { units as f64 / 512.0 });
            prediction.push(if block == 7 { -1.0 } else { moved });
        }
        let ours = depth_edges(&truth, &prediction, width as usize);
        same(&ours.values, &numbers(&expected[name]), name);
        let itself = depth_edges(&truth, &truth, width as usize);
        assert_eq!(itself.is_complete, name == "boxes");
        assert_eq!((itself.values[0] - 1.0).abs() < 1e-12, name == "boxes", "{itself:?}");
    }
    let flat = depth_edges(&[700.0 / 512.0; 72], &[2.0; 72], 9);
    same(&flat.values, &numbers(&expected["flat"]), "flat");
}

#[test]
fn davis_gives_the_same_boundaries_of_classes() {
    let expected = &expected()["sem-edge"];
    let blocks = |width: u64, height: u64, seed: u64, shift: u64| {
        let block = move |x: u64, y: u64| match mix(seed, (y / 13) * 37 + x / 17) % 7 {
            6 => None,
            class => Some(class as u8),
        };
        let pixels = (0..width * height).map(move |i| {
            let [x, y] = [i % width, i / width];
            let guess = if mix(seed + 1, i).is_multiple_of(97) {
                (mix(seed + 2, i) % 8) as u8
            } else {
                block(x + shift, y + shift).unwrap_or(4)
            };
            let truth = block(x, y);
            (truth, truth.map(|_| guess))
        });
        (pixels.unzip(), [width as u32, height as u32])
    };
    let plain = |guess: u8| ((vec![Some(3); 108], vec![Some(guess); 108]), [12, 9]);
    for (name, ((truth, guess), size)) in [
        ("near", blocks(160, 120, 81, 1)),
        ("far", blocks(160, 120, 84, 4)),
        ("narrow", blocks(19, 70, 87, 1)),
        ("large", blocks(420, 300, 90, 3)),
        ("whole", plain(3)),
        ("other", plain(1)),
    ] {
        let ours = class_outlines(&truth, &guess, size);
        assert_eq!(ours.len(), expected[name].as_object().unwrap().len(), "{name}");
        for (class, [f, precision, recall]) in ours {
            let theirs = expected[name][class.to_string()].as_f64().unwrap();
            same(&[f], &[theirs], name);
            assert!(f <= precision.max(recall) && f >= precision.min(recall));
        }
        let itself = class_outlines(&truth, &truth, size);
        assert!(itself.iter().all(|(_, scores)| *scores == [1.0; 3]));
    }
}

#[test]
fn cmx_gives_the_same_for_classes_of_views() {
    let mut all = Confusion::new(13);
    for seed in [61, 64, 67] {
        for i in 0..5000 {
            let truth = match mix(seed, i) % 14 {
                5 | 9 | 13 => continue,
                class => class,
            };
            let guess = match mix(seed + 1, i) % 13 {
                _ if !mix(seed + 2, i).is_multiple_of(3) => truth,
                9 => 3,
                class => class,
            };
            all.count(truth as usize, guess as usize);
        }
    }

    let expected = &expected()["sem-view"];
    let scores = all.view_scores();
    assert_eq!(all.pixels(), expected["pixels"].as_u64().unwrap());
    same(&[scores.mean_iou, scores.mean_accuracy], &numbers(&expected["mean"]), "mean");
    same(&[scores.weighted_iou, scores.pixel_accuracy], &numbers(&expected["overall"]), "overall");
    for (class, (ours, theirs)) in scores.iou.iter().zip(expected["iou"].as_array().unwrap()).enumerate() {
        match theirs.as_f64() {
            Some(theirs) => same(&[*ours], &[theirs], "class"),
            None => assert!(ours.is_nan() && class == 9),
        }
    }
    assert!(scores.iou[5] == 0.0 && scores.accuracy[5].is_nan());
    let none = Confusion::new(2).view_scores();
    assert!(none.mean_iou.is_nan() && none.weighted_iou.is_nan() && none.pixel_accuracy.is_nan());
}

/// Makes true and predicted vectors of evaluated pixels.
fn normals(n: u64, seed: u64) -> Vec<[[f64; 3]; 2]> {
    let vector = |seed: u64, i: u64| [0, 1, 2].map(|c| (mix(seed + c, i) % 2001) as f64 / 1000.0 - 1.0);
    (0..n)
        .filter(|&i| mix(seed + 20, i) % 16 != 3)
        .map(|i| {
            let truth = vector(seed, i);
            let shift = vector(seed + 10, i);
            let prediction = match mix(seed + 20, i) % 16 {
                0 => truth,
                1 => truth.map(|c| -c),
                2 => [0.0; 3],
                _ => [0, 1, 2].map(|c| truth[c] + 0.4 * shift[c]),
            };
            [truth, prediction]
        })
        .collect()
}

#[test]
fn both_scripts_give_the_same_angles() {
    let expected = &expected()["normal"];
    let images = [(4000, 31), (1, 40), (2501, 33)].map(|(n, seed)| normals(n, seed));
    let angles = |image: &[[[f64; 3]; 2]], angle: fn([f64; 3], [f64; 3]) -> f64| -> Vec<f64> {
        image
            .iter()
            .map(|&[truth, prediction]| angle(truth, prediction))
            .collect()
    };

    let mut sums = AngleSums::default();
    images
        .iter()
        .for_each(|image| sums.add(&AngleSums::of(&angles(image, dsine_angle))));
    let mut all: Vec<f64> = images.iter().flat_map(|image| angles(image, dsine_angle)).collect();
    let ([mean, rmse], below) = sums.mean_rmse_below();
    let ours = [&[mean, median_of_angles(&mut all).unwrap(), rmse][..], &below].concat();
    let theirs = numbers(&expected["dsine"]);
    // For equal and opposite vectors, the last bit of the cosine decides between 0° and a millionth. It
    // depends on the instructions that PyTorch is built with.
    near(&[ours[0], ours[2]], &[theirs[0], theirs[2]], 1e-9, "dsine");
    same(&[&ours[1..2], &ours[3..]].concat(), &[&theirs[1..2], &theirs[3..]].concat(), "dsine");
    // The script itself computes in 32 bits, where equal vectors are up to 0.03° apart.
    near(&ours, &numbers(&expected["dsine in 32 bits"]), 1e-4, "dsine in 32 bits");

    for (image, theirs) in images.iter().zip(expected["omnidata"].as_array().unwrap()) {
        let ours = omnidata_scores(&mut angles(image, omnidata_angle)).unwrap();
        same(&ours, &numbers(theirs), "omnidata");
    }
    assert_eq!((omnidata_scores(&mut []), median_of_angles(&mut [])), (None, None));
}
