//! Objects of views, images that share surface and the graph of places, compared with the data set's files.

use crate::common;

use common::{export, files, list_files, value};
use s3d_dataset::{Context, DataSet, ExportOptions, PairsOptions, pairs};
use s3d_geom::glam::dvec2;
use s3d_geom::{Camera, Raster};
use s3d_io::dataset::{
    DatasetImage, Domain, Frame, ObjectsFile, PairColumns, read_objects, read_pairs, write_pairs,
};
use s3d_io::image::{decode_gray16, decode_rgb8};
use s3d_report::{ReportOptions, report};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const SIZE: u32 = 80;

fn options() -> ReportOptions {
    ReportOptions { pano_width: 64, thumbs: 24, mesh_faces: 1000, ..ReportOptions::default() }
}

/// A data set with objects and pairs.
fn data_set(folder: &Path) -> PathBuf {
    let out = folder.join("data set");
    let mut modalities = Domain::PUBLISHED.to_vec();
    modalities.push(Domain::Objects);
    let options = ExportOptions {
        views: 6,
        size: SIZE,
        pano_width: 160,
        points_per_m2: 5.0,
        modalities,
        ..ExportOptions::default()
    };
    export(folder, true)
        .options(options)
        .run(&out, &Context::default())
        .unwrap()
        .unwrap();
    pairs(&out, &PairsOptions::default(), &Context::default()).unwrap();
    out
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn place(value: &Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

/// What the report shows of a data set, with the data set's own images by their names in `pairs.npz`.
struct Shown {
    data: DataSet,
    index: Value,
    images: BTreeMap<String, DatasetImage>,
}

impl Shown {
    fn read(out: &Path, to: &Path) -> Self {
        let data = DataSet::open(out).unwrap();
        let images = data.images(1).into_iter().map(|image| (image.pair_name(), image));
        Self { images: images.collect(), index: value(to, "index"), data }
    }

    /// Returns the views with a picture, and their images.
    fn views(&self) -> impl Iterator<Item = (usize, &Value, &DatasetImage)> {
        let views = self.index["views"].as_array().unwrap().iter();
        views.filter(|view| !view["picture"].is_null()).map(|view| {
            let uuid = &self.index["locations"][place(&view["location"])]["uuid"];
            let is = |image: &&DatasetImage| {
                matches!(image.frame, Frame::View(frame) if view["frame"] == frame) && *uuid == image.uuid
            };
            (place(&view["picture"]), view, self.images.values().find(is).unwrap())
        })
    }

    /// Returns the image of a partner.
    fn partner(&self, partner: &Value) -> &DatasetImage {
        if let Some(picture) = partner.get("picture") {
            return self.views().find(|(number, ..)| *number == place(picture)).unwrap().2;
        }
        let uuid = &self.index["locations"][place(&partner["pano"])]["uuid"];
        let is = |image: &&DatasetImage| image.frame == Frame::Panorama && *uuid == image.uuid;
        self.images.values().find(is).unwrap()
    }

    fn camera(&self, image: &DatasetImage) -> (Camera, Raster<u16>) {
        let path = image.path(self.data.layout(), Domain::Depth);
        let depth = decode_gray16(&self.data.read(&path).unwrap(), &path).unwrap();
        let pose = self.data.pose(image).unwrap();
        (self.data.camera(image, &pose, [depth.width(), depth.height()]).unwrap(), depth)
    }
}

/// Twice the area inside rings, and the length of their parts by kind.
fn measured(outline: &Value) -> (f64, [f64; 3]) {
    let (mut twice, mut lengths) = (0.0, [0.0; 3]);
    for ring in outline.as_array().unwrap() {
        for part in ring.as_array().unwrap() {
            let numbers: Vec<f64> = part.as_array().unwrap().iter().map(number).collect();
            for [ax, ay, bx, by] in (1..numbers.len() - 3)
                .step_by(2)
                .map(|i| [0, 1, 2, 3].map(|k| numbers[i + k]))
            {
                twice += ax * by - bx * ay;
                lengths[numbers[0] as usize] += (ax - bx).hypot(ay - by);
            }
        }
    }
    (twice, lengths)
}

#[test]
fn objects_have_their_outlines_and_what_hides_them() {
    let dir = tempfile::tempdir().unwrap();
    let (out, to) = (data_set(dir.path()), dir.path().join("report"));
    let made = report(&out, &to, &options(), &Context::default()).unwrap();
    assert_eq!(made.faults, []);
    let shown = Shown::read(&out, &to);

    let (mut all, mut hidden, mut cut) = (0, 0, 0);
    for (picture, view, image) in shown.views() {
        let file = read_objects(&image.path(shown.data.layout(), Domain::Objects)).unwrap();
        let path = image.path(shown.data.layout(), Domain::Semantic);
        let label = decode_rgb8(&shown.data.read(&path).unwrap(), &path).unwrap();
        let objects = value(&to, &format!("objects_{}", picture / 12))[picture % 12].clone();
        let objects = objects.as_array().unwrap();
        assert_eq!((objects.len(), place(&view["objects"])), (file.objects.len(), file.objects.len()));
        assert!(objects.is_sorted_by_key(|object| u64::MAX - object["seen"].as_u64().unwrap()));

        for object in objects {
            let own = file
                .objects
                .iter()
                .find(|own| object["label"] == own.label_index)
                .unwrap();
            assert_eq!(
                (&object["seen"], &object["alone"]),
                (&own.visible_pixels.into(), &own.amodal_pixels.into())
            );
            let by: Vec<(u32, u64)> = serde_json::from_value(object["by"].clone()).unwrap();
            assert_eq!(
                by.iter().map(|(_, pixels)| pixels).sum::<u64>(),
                own.amodal_pixels - own.visible_pixels
            );
            assert!((number(&object["cut"]) - own.beyond.unwrap().truncation).abs() < 1e-4);

            // The outline goes around the mask: its lines differ from it by less than a pixel.
            let (twice, [seen_px, hidden_px, cut_px]) = measured(&object["outline"]);
            let length = seen_px + hidden_px + cut_px;
            let off = (0.5 * twice - own.amodal_pixels as f64).abs();
            assert!(off <= length + 12.0, "{}: {off} pixels of {}", own.label, own.amodal_pixels);
            // Nothing is dashed that nothing hides.
            assert!(own.occlusion > 0.0 || hidden_px == 0.0, "{}", own.label);

            // Beside the middle of the longest seen line are pixels of the instance.
            let parts = object["outline"]
                .as_array()
                .unwrap()
                .iter()
                .flat_map(|ring| ring.as_array().unwrap());
            for part in parts.filter(|part| part[0] == 0) {
                let n: Vec<f64> = part.as_array().unwrap().iter().map(number).collect();
                let [x, y] = [(n[1] + n[3]) / 2.0, (n[2] + n[4]) / 2.0];
                let near = |c: f64, d: i32| (c as i32 + d).clamp(0, SIZE as i32 - 1) as u32;
                let mut around = (-2..=2).flat_map(|dx| (-2..=2).map(move |dy| (dx, dy)));
                let [_, r, g, b] = own.label_index.to_be_bytes();
                assert!(
                    around.any(|(dx, dy)| label.at(near(x, dx), near(y, dy)) == [r, g, b]),
                    "{}",
                    own.label
                );
            }
            all += 1;
            hidden += usize::from(hidden_px > 0.0);
            cut += usize::from(cut_px > 0.0);
        }
    }
    assert!(all > 100 && hidden > 20 && cut > 20, "{all} objects, {hidden} hidden, {cut} cut off");
}

#[test]
fn partners_show_the_same_places_and_the_graph_joins_theirs() {
    let dir = tempfile::tempdir().unwrap();
    let (out, to) = (data_set(dir.path()), dir.path().join("report"));
    report(&out, &to, &options(), &Context::default()).unwrap();
    let shown = Shown::read(&out, &to);
    let columns = read_pairs(&shown.data.layout().pairs_npz(1)).unwrap();
    assert_eq!(shown.index["pairs"], serde_json::json!([1]));
    let row = |image: &DatasetImage| {
        columns
            .images
            .iter()
            .position(|name| *name == image.pair_name())
            .unwrap()
    };
    let overlap = |a: usize, b: usize| {
        let pairs = columns.start[a] as usize..columns.start[a + 1] as usize;
        let found = pairs.clone().find(|at| columns.other[*at] as usize == b);
        found.map(|at| (f64::from(columns.overlap[at]), at))
    };

    let (mut places, mut slits, mut panoramas) = (0, 0, 0);
    for (picture, _, image) in shown.views() {
        let partners = value(&to, &format!("pairs_{}", picture / 12))[picture % 12].clone();
        let partners = partners.as_array().unwrap();
        let best = (0..columns.images.len())
            .filter_map(|other| overlap(row(image), other))
            .count();
        assert!(!partners.is_empty() && partners.len() <= best.min(12), "{} of {best}", partners.len());
        let (camera, depth) = shown.camera(image);

        for partner in partners {
            let other = shown.partner(partner);
            let (mine, at) = overlap(row(image), row(other)).unwrap();
            let (theirs, _) = overlap(row(other), row(image)).unwrap();
            for (share, own) in [(0, mine), (1, theirs)] {
                assert!((number(&partner["shared"][share]) - own).abs() < 1e-3);
            }
            assert!((number(&partner["distance_m"]) - f64::from(columns.distance_m[at])).abs() < 1e-3);

            // A place has the depth of the view's pixel, and the depth that the other image has there.
            let (there, other_depth) = shown.camera(other);
            for point in partner["points"].as_array().unwrap() {
                let [x, y, u, v] = [0, 1, 2, 3].map(|i| number(&point[i]));
                assert_eq!([x.fract(), y.fract()], [0.5; 2], "middles of pixels");
                let metres =
                    |depth: &Raster<u16>, x: f64, y: f64| f64::from(depth.at(x as u32, y as u32)) / 512.0;
                let place = camera.pose.location + camera.direction(x, y) * metres(&depth, x, y);
                let (pixel, away) = there.project(place).unwrap();
                // Depth is rounded to a step of 2 mm.
                assert!(pixel.distance(dvec2(u, v)) < 0.3, "{pixel} and {u}, {v}");
                // The middle of its pixel may be past the edge of something nearer: then a pixel beside it
                // shows the place, unless it is seen through a slit.
                let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| [dx, dy].map(f64::from)));
                let inside = |c: f64, side: u32| c.clamp(0.0, f64::from(side) - 0.5);
                let mut seen = around
                    .map(|[dx, dy]| [inside(u + dx, there.width), inside(v + dy, there.height)])
                    .map(|[x, y]| metres(&other_depth, x, y));
                slits += usize::from(!seen.any(|seen| (seen - away).abs() < 0.1 * away + 0.1));
                places += 1;
            }
            panoramas += usize::from(partner.get("pano").is_some());
        }
    }
    assert!(places > 1000 && panoramas > 10, "{places} places, {panoramas} panoramas");
    assert!(100 * slits < places, "{slits} of {places} places are not seen");

    // The graph, from all pairs of images.
    let mut joined: BTreeMap<(String, String), (f64, usize)> = BTreeMap::new();
    let uuid = |name: &str| name.split('_').nth(1).unwrap().to_owned();
    for (a, name) in columns.images.iter().enumerate() {
        for (b, other) in columns.images.iter().enumerate().skip(a + 1) {
            if let Some((share, _)) = overlap(a, b)
                && uuid(name) != uuid(other)
            {
                let mut ends = [uuid(name), uuid(other)];
                ends.sort();
                let [from, to] = ends;
                let (most, count) = joined.entry((from, to)).or_default();
                *most = most.max(0.5 * (share + overlap(b, a).unwrap().0));
                *count += 1;
            }
        }
    }
    let graph = value(&to, "graph_1");
    let edges = graph["edges"].as_array().unwrap();
    assert_eq!((edges.len(), place(&graph["left_out"])), (joined.len(), 0));
    assert!(edges.is_sorted_by(|a, b| number(&a["share"]) >= number(&b["share"])));
    for edge in edges {
        let end = |i: usize| {
            let location = place(&edge["ends"][i]["location"]);
            shown.index["locations"][location]["uuid"].as_str().unwrap().to_owned()
        };
        let mut ends = [end(0), end(1)];
        ends.sort();
        let [from, to] = ends;
        let (share, count) = joined[&(from, to)];
        assert!((number(&edge["share"]) - share).abs() < 1e-3 && place(&edge["pairs"]) == count, "{edge}");
    }
}

#[test]
fn bytes_are_the_same_on_all_threads_and_wrong_files_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let out = data_set(dir.path());
    let on = |threads, name: &str| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let to = dir.path().join(name);
        pool.install(|| report(&out, &to, &options(), &Context::default()))
            .unwrap();
        files(&to)
    };
    assert!(on(1, "one") == on(3, "three"));

    let data = DataSet::open(&out).unwrap();
    let layout = data.layout();
    let images = data.images(1);
    let [a, b, c, d] = [0, 1, 2, 3].map(|i| {
        let views = images.iter().filter(|image| matches!(image.frame, Frame::View(_)));
        let image = views.clone().nth(i).unwrap();
        (image.path(layout, Domain::Objects), image.relative_path(Domain::Objects))
    });
    let change = |path: &Path, how: fn(&mut ObjectsFile)| {
        let mut file = read_objects(path).unwrap();
        how(&mut file);
        fs::write(path, file.to_json()).unwrap();
    };
    fs::write(&a.0, "{\"width\":80").unwrap();
    change(&b.0, |file| file.objects[0].amodal_mask.counts.push('0'));
    change(&c.0, |file| file.objects[0].label_index = 4_000_000);
    change(&d.0, |file| file.width = 81);
    let pairs = layout.pairs_npz(1);
    let columns = read_pairs(&pairs).unwrap();
    let bytes = fs::read(&pairs).unwrap();

    let strange = columns
        .images
        .iter()
        .map(|name| name.replace("data/", "date/"))
        .collect();
    let strange = PairColumns { images: strange, ..columns };
    for (name, wrong) in [("no archive", Some(b"PK".as_slice())), ("cut", bytes.get(..99)), ("strange", None)]
    {
        match wrong {
            Some(wrong) => fs::write(&pairs, wrong).unwrap(),
            None => drop(write_pairs(&pairs, &strange).unwrap()),
        }
        list_files(&out);
        let to = dir.path().join(name);
        let made = report(&out, &to, &options(), &Context::default()).unwrap();
        let mut told: Vec<&str> = made.faults.iter().map(|fault| fault.path.as_str()).collect();
        let mut expected = [&*a.1, &*b.1, &*c.1, &*d.1, "area_1/pairs.npz"];
        told.sort_unstable();
        expected.sort_unstable();
        assert_eq!(told, expected, "{name}");
        let index = value(&to, "index");
        assert!(index.get("pairs").is_none() && !to.join("data/graph_1.js").exists());
        let has = |view: &&Value| view.get("objects").is_some();
        assert_eq!(index["views"].as_array().unwrap().iter().filter(has).count(), made.views - 4);
    }

    // Without these files a report has nothing of them.
    let out = common::data_set(&dir.path().join("bare"), true);
    let to = dir.path().join("bare report");
    report(&out, &to, &options(), &Context::default()).unwrap();
    let index = value(&to, "index");
    assert!(
        index.get("pairs").is_none()
            && index["views"]
                .as_array()
                .unwrap()
                .iter()
                .all(|v| v.get("objects").is_none())
    );
    let names = files(&to).into_keys().map(|path| path.to_string_lossy().into_owned());
    assert!(
        !names
            .into_iter()
            .any(|name| ["objects_", "pairs_", "graph_"].iter().any(|kind| name.contains(kind)))
    );
}
