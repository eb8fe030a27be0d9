//! Scenes whose classes are not S3DIS's: the data sets made of them, and the errors for invalid taxonomies.

use crate::common;
use common::{files, s3d, s3d_fails, s3d_ok, text, write_scan};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

const SMALL: [&str; 10] = [
    "--size",
    "48",
    "--pano-width",
    "96",
    "--points-per-m2",
    "200",
    "--views",
    "6",
    "--allow",
    "colour,coverage,inside-out,up",
];

/// The annotators' names for the sides of the room and the table in it.
const OBJECTS: [&str; 7] = ["floor", "ceiling", "wall", "wall", "shower curtain", "couch", "bed"];

/// A room in ScanNet's form: a mesh, one segment for each quad, and objects. Returns the scene file.
fn write_scannet(dir: &Path, taxonomy: &str) -> PathBuf {
    write_scan(dir, 3);
    let folder = dir.join("scene0000_00");
    fs::create_dir(&folder).unwrap();
    let obj = fs::read_to_string(dir.join("room.obj")).unwrap();
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {0}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nelement face {1}\n\
         property list uchar int vertex_indices\nend_header\n",
        4 * OBJECTS.len(),
        OBJECTS.len()
    );
    for (i, vertex) in obj.lines().filter_map(|l| l.strip_prefix("v ")).enumerate() {
        // The OBJ is Y-up.
        let [x, y, z] =
            <[f64; 3]>::try_from(vertex.split(' ').map(|n| n.parse().unwrap()).collect::<Vec<_>>()).unwrap();
        ply += &format!("{x} {} {y} {} 128 {}\n", -z, 20 + 7 * i, 200 - 7 * i);
    }
    for i in 0..OBJECTS.len() {
        ply += &format!("4 {} {} {} {}\n", 4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 3);
    }
    fs::write(folder.join("scene0000_00_vh_clean_2.ply"), ply).unwrap();
    let segments: Vec<String> = (0..4 * OBJECTS.len()).map(|v| (v / 4).to_string()).collect();
    let segs = format!("{{\"sceneId\": \"scene0000_00\", \"segIndices\": [{}]}}", segments.join(", "));
    fs::write(folder.join("scene0000_00_vh_clean_2.0.010000.segs.json"), segs).unwrap();
    let group = |(i, name): (usize, &&str)| {
        format!("{{\"id\": {i}, \"objectId\": {i}, \"segments\": [{i}], \"label\": \"{name}\"}}")
    };
    let groups: Vec<String> = OBJECTS.iter().enumerate().map(group).collect();
    let aggregation =
        format!("{{\"sceneId\": \"scannet.scene0000_00\", \"segGroups\": [{}]}}", groups.join(", "));
    fs::write(folder.join("scene0000_00.aggregation.json"), aggregation).unwrap();
    let scene = dir.join("scannet.toml");
    let toml = format!(
        "area = 3\n{taxonomy}[mesh]\npath = \"scene0000_00/scene0000_00_vh_clean_2.ply\"\nup = \"z\"\n\
         [annotations]\n\
         path = \"scene0000_00\"\nroom = \"bedroom_1\"\n[cameras]\npath = \"cameras.csv\"\n"
    );
    fs::write(&scene, toml).unwrap();
    scene
}

fn export(scene: &Path, out: &Path, extra: &[&str]) -> String {
    let mut args = vec!["export", text(scene), "-o", text(out)];
    args.extend(SMALL);
    args.extend(extra);
    s3d_ok(&args)
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn names(list: &Value) -> Vec<&str> {
    list.as_array().unwrap().iter().map(|v| v.as_str().unwrap()).collect()
}

#[test]
fn a_scan_of_scannet_keeps_classes_that_s3dis_has_not() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scannet(&dir.path().join("scan"), "taxonomy = \"scannet20\"\n");
    let out = dir.path().join("out");
    export(&scene, &out, &["--profile", "pointcept", "--profile", "pointnet"]);

    // The benchmark has no class for the ceiling: its faces have no label.
    let expected = [
        "bed_1_bedroom_1_3",
        "floor_1_bedroom_1_3",
        "showerCurtain_1_bedroom_1_3",
        "sofa_1_bedroom_1_3",
        "wall_1_bedroom_1_3",
        "wall_2_bedroom_1_3",
    ];
    let labels = json(&out.join("assets/semantic_labels.json"));
    assert_eq!(names(&labels)[1..7], expected);
    let manifest = json(&out.join("manifest.json"));
    assert_eq!((&manifest["taxonomy"], &manifest["labels"]), (&"scannet20".into(), &7.into()));
    let taxonomy = json(&out.join("assets/taxonomy.json"));
    let classes = taxonomy["classes"].as_array().unwrap();
    assert_eq!(
        (classes.len(), &classes[15]["name"], &classes[15]["id"]),
        (20, &"showerCurtain".into(), &28.into())
    );
    assert!(
        fs::read_to_string(out.join("files.csv"))
            .unwrap()
            .contains("assets/taxonomy.json,")
    );
    let statistics = json(&out.join("statistics.json"));
    let of_area = &statistics["areas"][0];
    assert_eq!(of_area["instances_per_class"].as_object().unwrap().len(), 20);
    assert_eq!(
        (&of_area["instances_per_class"]["wall"], &of_area["rooms_per_type"]["bedroom"]["rooms"]),
        (&2.into(), &1.into())
    );
    let markdown = fs::read_to_string(out.join("statistics.md")).unwrap();
    let (own, as_s3dis) = markdown
        .split_once("## Instances by what they count as in S3DIS")
        .unwrap();
    assert!(own.contains("| showerCurtain | 1 | 1 |") && !own.contains("clutter"));
    let (clutter, walls) = (&of_area["as_s3dis"]["instances_per_class"]["clutter"], "| wall | 2 | 2 |");
    assert!(clutter.as_u64() > Some(1) && as_s3dis.contains(walls) && !as_s3dis.contains("showerCurtain"));
    assert!(
        as_s3dis.contains("| lounge |") && as_s3dis.contains(&format!("| clutter | {clutter} | {clutter} |"))
    );
    let votes = json(&out.join("area_3/3d/votes.json"));
    assert_eq!(
        (votes["classes"].as_array().unwrap().len(), &votes["classes"][0]["name"]),
        (20, &"wall".into())
    );
    assert!(
        out.join("s3dis/Area_3/bedroom_1/Annotations/showerCurtain_1.txt")
            .is_file()
    );
    // S3DIS's loaders have no bed and no curtain; both become clutter.
    let mut profile: Vec<PathBuf> = files(&out.join("profiles/pointcept/Area_3/bedroom_1/Annotations"))
        .into_keys()
        .collect();
    profile.sort();
    let of_s3dis =
        ["clutter_1.txt", "clutter_2.txt", "floor_1.txt", "sofa_1.txt", "wall_1.txt", "wall_2.txt"];
    assert_eq!(profile, of_s3dis.map(PathBuf::from));
    s3d_ok(&["verify", text(&out), "--full"]);

    // Packages use the taxonomy as well.
    let coco = dir.path().join("coco");
    s3d_ok(&["pack", text(&out), "--to", "coco", "-o", text(&coco)]);
    let panoptic = json(&coco.join("panoptic.json"));
    let categories = panoptic["categories"].as_array().unwrap();
    let stuff: Vec<&Value> = categories
        .iter()
        .filter(|c| c["isthing"] == 0)
        .map(|c| &c["name"])
        .collect();
    assert_eq!((categories.len(), stuff), (20, vec![&"wall".into(), &"floor".into()] as Vec<&Value>));
    assert_eq!(
        (&categories[15]["id"], &categories[15]["color"]),
        (&28.into(), &serde_json::json!([158, 218, 229]))
    );
    let mut category_of: BTreeMap<u64, u64> = BTreeMap::new();
    for segment in panoptic["annotations"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|a| a["segments_info"].as_array().unwrap())
    {
        category_of.insert(segment["id"].as_u64().unwrap(), segment["category_id"].as_u64().unwrap());
    }
    // Segments of things have their label's index as id; walls and floors have ids made from their classes.
    let of_labels = [(1, 4), (3, 28), (4, 6), (0xff_0001, 1), (0xff_0002, 2)];
    assert_eq!(category_of, BTreeMap::from(of_labels));
    let instances = json(&coco.join("instances.json"));
    let found = instances["annotations"].as_array().unwrap();
    assert!(
        found
            .iter()
            .all(|a| [4, 6, 28].contains(&a["category_id"].as_u64().unwrap()))
            && found.len() > 5
    );
    assert!(found.iter().all(|a| {
        a["segmentation"]["counts"]
            .as_str()
            .is_some_and(|counts| !counts.is_empty())
    }));
    assert_eq!(instances["categories"].as_array().unwrap().len(), 18);
    s3d_fails(
        &["pack", text(&out), "--to", "coco", "-o", text(&dir.path().join("x")), "--stuff", "board"],
        2,
        &["--stuff", "\"board\" is no class; the classes are wall floor cabinet bed"],
    );
    assert!(!dir.path().join("x").exists());
    let shards = dir.path().join("shards");
    s3d_ok(&[
        "pack",
        text(&out),
        "--to",
        "webdataset",
        "-o",
        text(&shards),
        "--prefix",
        "all",
        "--max-count",
        "9999",
    ]);
    let tar = fs::read(shards.join("all-000000.tar")).unwrap();
    let tar = String::from_utf8_lossy(&tar);
    assert!(tar.contains("__s3d__/taxonomy.json") && tar.contains("\"showerCurtain\""));
    let table = dir.path().join("images.parquet");
    s3d_ok(&["pack", text(&out), "--to", "parquet", "-o", text(&table)]);
    let table = fs::read(&table).unwrap();
    let has = |word: &str| table.windows(word.len()).any(|w| w == word.as_bytes());
    assert!(has("share_showerCurtain") && has("bedroom") && !has("share_clutter"));

    // Exported again as a published area, and in shards.
    let again = dir.path().join("again");
    export(&out.join("area_3"), &again, &[]);
    for name in ["assets/semantic_labels.json", "assets/taxonomy.json", "area_3/3d/semantic.obj"] {
        assert!(fs::read(out.join(name)).unwrap() == fs::read(again.join(name)).unwrap(), "{name}");
    }
    assert!(
        export(&scene, &out, &["--profile", "pointcept", "--profile", "pointnet"]).contains("nothing to do")
    );
    let merged = dir.path().join("merged");
    let plan = dir.path().join("plan");
    s3d_ok(&["plan", text(&scene), "-o", text(&plan), "--size", "48", "--views", "6"]);
    let parts = ["1/2", "2/2"].map(|shard| {
        let part = dir.path().join(format!("part_{}", &shard[..1]));
        export(
            &scene,
            &part,
            &["--profile", "pointcept", "--profile", "pointnet", "--shard", shard, "--plan", text(&plan)],
        );
        part
    });
    s3d_ok(&["merge", text(&parts[0]), text(&parts[1]), "-o", text(&merged)]);
    let (one, joined) = (files(&out), files(&merged));
    assert!(one.keys().eq(joined.keys()));
    let differs: Vec<_> = one
        .iter()
        .filter(|(path, bytes)| joined[*path] != **bytes)
        .map(|(path, _)| path)
        .collect();
    assert!(differs.is_empty(), "{differs:?}");

    // `verify` reports a taxonomy that changed after the export.
    let path = out.join("assets/taxonomy.json");
    fs::write(&path, fs::read_to_string(&path).unwrap().replace("scannet20", "scannet21")).unwrap();
    let verified = s3d(&["verify", text(&out)]);
    assert_eq!(verified.status.code(), Some(1));
    let told =
        String::from_utf8_lossy(&verified.stdout).into_owned() + &String::from_utf8_lossy(&verified.stderr);
    assert!(told.contains("taxonomy.json") && told.contains("scannet21"), "{told}");
    s3d_fails(
        &["pack", text(&out), "--to", "coco", "-o", text(&dir.path().join("x"))],
        1,
        &["taxonomy.json"],
    );
}

#[test]
fn images_of_classes_have_the_taxonomys_places_and_colours() {
    let dir = tempfile::tempdir().unwrap();
    let scene = write_scannet(&dir.path().join("scan"), "taxonomy = \"scannet20\"\n");
    let (out, plain) = (dir.path().join("out"), dir.path().join("plain"));
    export(&scene, &plain, &[]);
    let asked = ["--modalities", "rgb,depth,normal,semantic,semantic_pretty,semantic_class,global_xyz,pose"];
    export(&scene, &out, &asked);
    // The images of classes are made on demand alone, and change nothing else.
    let (with, without) = (files(&out), files(&plain));
    let is_new = |path: &Path| {
        path.to_string_lossy().contains("semantic_class") || path.to_string_lossy().contains("class_legend")
    };
    assert!(without.keys().all(|path| !is_new(path)));
    let tables = ["manifest.json", "files.csv"].map(PathBuf::from);
    let rest = with.keys().filter(|path| !is_new(path));
    assert!(rest.eq(without.keys()));
    let same = without
        .iter()
        .filter(|(path, _)| !tables.contains(path))
        .all(|(path, bytes)| with[path] == *bytes);
    assert!(same);

    let names = names(&json(&out.join("assets/semantic_labels.json")))
        .into_iter()
        .map(str::to_owned)
        .collect::<Vec<_>>();
    let taxonomy = s3d_label::Taxonomy::built_in("scannet20").unwrap();
    let mut images = 0;
    for (path, _) in with
        .iter()
        .filter(|(path, _)| path.to_string_lossy().ends_with("domain_semantic_class.png"))
    {
        let (places, palette) = s3d_io::image::read_palette8(&out.join(path)).unwrap();
        assert_eq!(
            (palette.len(), palette[0], palette[15], palette[255]),
            (256, [174, 199, 232], [158, 218, 229], [0; 3])
        );
        let labels = path.to_string_lossy().replace("semantic_class", "semantic");
        let labels = s3d_io::image::read_rgb8(&out.join(labels)).unwrap();
        for (place, [r, g, b]) in places.pixels().iter().zip(labels.pixels()) {
            let index = u32::from_be_bytes([0, *r, *g, *b]) as usize;
            let label = names.get(index).and_then(|name| taxonomy.parse_name(name).unwrap());
            assert_eq!(*place, label.map_or(255, |label| label.class.index() as u8));
        }
        images += 1;
    }
    assert!(images > 6, "{images}");
    let legend = fs::read_to_string(out.join("assets/class_legend.csv")).unwrap();
    assert!(legend.contains("\n15,28,showerCurtain,158,218,229,thing,clutter\n"), "{legend}");
    assert!(s3d_io::image::read_rgb8(&out.join("assets/class_legend.png")).is_ok());
    s3d_ok(&["verify", text(&out), "--full"]);
    // One wrong pixel, another palette, and a missing legend.
    let path = with
        .keys()
        .find(|path| path.to_string_lossy().ends_with("domain_semantic_class.png"))
        .unwrap();
    let (mut places, mut palette) = s3d_io::image::read_palette8(&out.join(path)).unwrap();
    let compression = s3d_io::image::Compression::Balanced;
    places.pixels_mut()[7] ^= 1;
    fs::write(out.join(path), s3d_io::image::encode_palette8(&places, &palette, compression)).unwrap();
    let told = |what: &str| {
        let verified = s3d(&["verify", text(&out)]);
        let told = String::from_utf8_lossy(&verified.stdout).into_owned()
            + &String::from_utf8_lossy(&verified.stderr);
        assert_eq!(verified.status.code(), Some(1));
        assert!(told.contains(what), "{told}");
    };
    told("are not the classes of the labels in the semantic image");
    places.pixels_mut()[7] ^= 1;
    palette[3] = [9, 9, 9];
    fs::write(out.join(path), s3d_io::image::encode_palette8(&places, &palette, compression)).unwrap();
    told("its palette has not the colours of scannet20");
    fs::write(out.join(path), &with[path]).unwrap();
    s3d_ok(&["verify", text(&out)]);
    fs::remove_file(out.join("assets/class_legend.csv")).unwrap();
    told("class_legend.csv");
}

#[test]
fn a_taxonomy_of_ones_own_in_a_file_or_in_the_scene() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    let mine = "name = \"hotel\"\nclutter = \"thingy\"\n[[classes]]\nname = \"wall\"\nid = 7\n\
                aliases = [\"ceiling\", \"floor\"]\n\
                [[classes]]\nname = \"bed\"\ncolor = [1, 2, 3]\n[[classes]]\nname = \"thingy\"\n\
                counts_as = \"bed\"\n\
                [[rooms]]\nname = \"suite\"\naliases = [\"bedroom\"]\n[aliases]\ncouch = \"\"\n";
    let scene = write_scannet(&scan, "taxonomy = \"mine.toml\"\n");
    let toml = fs::read_to_string(&scene)
        .unwrap()
        .replace("[cameras]", "unknown_as_clutter = true\n[cameras]");
    fs::write(&scene, &toml).unwrap();
    fs::write(scan.join("mine.toml"), mine).unwrap();
    let out = dir.path().join("out");
    let log = export(&scene, &out, &[]);
    assert!(log.contains("classes taken for thingy: \"shower curtain\""), "{log}");
    let labels = json(&out.join("assets/semantic_labels.json"));
    let expected = [
        "bed_1_suite_1_3",
        "thingy_1_suite_1_3",
        "wall_1_suite_1_3",
        "wall_2_suite_1_3",
        "wall_3_suite_1_3",
        "wall_4_suite_1_3",
    ];
    assert_eq!(names(&labels)[1..7], expected);
    s3d_ok(&["verify", text(&out)]);
    // The file belongs to the input: with a changed file the data set is another one.
    fs::write(scan.join("mine.toml"), mine.replace("[1, 2, 3]", "[3, 2, 1]")).unwrap();
    let mut args = vec!["export", text(&scene), "-o", text(&out)];
    args.extend(SMALL);
    s3d_fails(&args, 2, &["--overwrite"]);
    // The same taxonomy written in the scene file.
    let table: String = mine
        .replace("[[", "[[taxonomy.")
        .replace("[aliases]", "[taxonomy.aliases]");
    let inline = toml
        .replace("taxonomy = \"mine.toml\"\n", "")
        .replace("[mesh]", &format!("[taxonomy]\n{table}[mesh]"));
    fs::write(&scene, inline).unwrap();
    let here = dir.path().join("here");
    export(&scene, &here, &[]);
    for name in ["assets/taxonomy.json", "assets/semantic_labels.json", "statistics.json"] {
        assert!(fs::read(out.join(name)).unwrap() == fs::read(here.join(name)).unwrap(), "{name}");
    }
}

#[test]
fn faults_of_a_taxonomy_are_told_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let scan = dir.path().join("scan");
    let scene = write_scannet(&scan, "taxonomy = \"mine.toml\"\n");
    let toml = fs::read_to_string(&scene).unwrap();
    let out = dir.path().join("out");
    let class = |rest: &str| {
        format!("name = \"mine\"\n[[classes]]\nname = \"bed\"\n[[classes]]\nname = \"lamp\"\n{rest}")
    };
    for (content, parts) in [
        (class("[[classes]]\nname = \"bed\"\n"), ["mine.toml", "class 3: \"bed\" has the name of class 1"]),
        (class("aliases = [\"bed\"]\n"), ["mine.toml", "\"bed\" is a word for bed and for lamp"]),
        (
            class("[aliases]\ncot = \"bedd\"\n"),
            ["mine.toml", "the alias \"cot\" means \"bedd\", which is no class: there are bed lamp"],
        ),
        (
            class("counts_as = \"bed\"\n").replace("\"bed\"\n[", "\"bed\"\ncounts_as = \"lamp\"\n["),
            ["mine.toml", "bed counts as lamp counts as bed"],
        ),
        (class("counts_as = \"furniture\"\n"), ["mine.toml", "counts_as of \"lamp\" means \"furniture\""]),
        (class("colour = [1, 2, 3]\n"), ["mine.toml, line 6", "unknown field `colour`"]),
        (class("id = \"four\"\n"), ["mine.toml, line 6", "invalid type"]),
        (class("").replace("lamp", "night_lamp"), ["mine.toml", "class 2: \"night_lamp\" is no name"]),
        ("name = \"mine\"\nclasses = []\n".to_owned(), ["mine.toml", "has no classes"]),
    ] {
        fs::write(scan.join("mine.toml"), content).unwrap();
        s3d_fails(&["export", text(&scene), "-o", text(&out)], 1, &parts);
    }
    for (from, to, parts) in [
        ("mine.toml", "scannet", ["neither one of s3dis, nyu40, scannet20", "scannet is not there"]),
        ("\"mine.toml\"", "7", ["line 2", "the name of a taxonomy"]),
        ("mine.toml", "nyu40", ["", "no type of room"]),
        ("mine.toml", "s3dis", ["\"bedroom\" is no type of room", "office"]),
    ] {
        let mut toml = toml.replace(from, to);
        if to == "nyu40" {
            toml = toml.replace("bedroom_1", "ballroom_1");
        }
        fs::write(&scene, toml).unwrap();
        s3d_fails(&["export", text(&scene), "-o", text(&out)], 1, &parts);
    }
    // Words that the taxonomy does not know, first without a class that may stand in for them.
    fs::write(scan.join("mine.toml"), class("")).unwrap();
    let toml = toml.replace("bedroom_1", "office_1");
    fs::write(&scene, &toml).unwrap();
    let unknown = ["not among the 2 of mine", "\"couch\"", "= \"bed\""];
    s3d_fails(&["export", text(&scene), "-o", text(&out)], 1, &unknown);
    fs::write(&scene, toml.replace("[cameras]", "unknown_as_clutter = true\n[cameras]")).unwrap();
    s3d_fails(&["export", text(&scene), "-o", text(&out)], 1, &["unknown_as_clutter", "clutter = "]);
    assert!(!out.exists());
}
