//! Tests of scene files, as they are read.

use crate::cloud::AnnotationOptions;
use crate::error::{Error, Result};
use crate::mesh::{LengthUnit, UpAxis};
use crate::scene::{CameraSource, SceneFile, read_scene};
use crate::scene::{PictureKind, PictureOptions, PictureSource, UnseenColor};
use s3d_geom::glam::{DAffine3, DVec3};
use s3d_label::Class;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

const GOOD: &str = "area = 2\n[mesh]\npath = \"a.obj\"\nup = \"z\"\n[annotations]\npath = \"Area_2\"\n\
                    [cameras]\npath = \"c.csv\"\n";

fn read(text: &str) -> Result<SceneFile> {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.obj"), "").unwrap();
    fs::write(dir.path().join("c.csv"), "").unwrap();
    fs::create_dir(dir.path().join("Area_2")).unwrap();
    fs::create_dir(dir.path().join("skybox")).unwrap();
    fs::create_dir(dir.path().join("raw")).unwrap();
    let path = dir.path().join("scene.toml");
    fs::write(&path, text).unwrap();
    let scene = read_scene(&path)?;
    if scene.published.is_some() {
        return Ok(scene);
    }
    let mesh = if scene.fuse.is_some() {
        "scene.fused/mesh.ply"
    } else {
        "a.obj"
    };
    assert_eq!(scene.mesh[0], dir.path().join(mesh));
    assert!(
        scene
            .annotations
            .first()
            .is_none_or(|path| *path == dir.path().join("Area_2"))
    );
    if let Some(CameraSource::Listed { path, .. }) = &scene.cameras {
        assert_eq!(*path, dir.path().join("c.csv"));
    }
    Ok(scene)
}

#[test]
fn paths_are_resolved_and_up_is_y_unless_said() {
    let scene = read(GOOD).unwrap();
    assert_eq!((scene.area, scene.up), (2, UpAxis::Z));
    assert_eq!(read(&GOOD.replace("up = \"z\"\n", "")).unwrap().up, UpAxis::Y);
    assert_eq!((scene.mesh_offset_m, scene.annotations_have_offset), (None, false));
    assert_eq!((scene.units, scene.outside_files), (None, false));
    assert!(
        read(&GOOD.replace("up = \"z\"\n", "outside_files = true\n"))
            .unwrap()
            .outside_files
    );
    let scaled = read(&GOOD.replace("up = \"z\"\n", "units = \"in\"\n")).unwrap();
    assert_eq!(scaled.units, Some(LengthUnit::Inch));
    assert!(read(&GOOD.replace("up = \"z\"\n", "units = \"km\"\n")).is_err());
    let moved = read(&GOOD.replace("up = \"z\"\n", "offset_m = [5e5, 0, 7]\n")).unwrap();
    assert_eq!(moved.mesh_offset_m, Some(DVec3::new(5e5, 0.0, 7.0)));
}

fn cameras(table: &str) -> Result<Option<CameraSource>> {
    read(&GOOD.replace("[cameras]\npath = \"c.csv\"\n", table)).map(|scene| scene.cameras)
}

fn frame_of(table: &str) -> DAffine3 {
    match cameras(&format!("[cameras]\npath = \"c.csv\"\n{table}")).unwrap() {
        Some(CameraSource::Listed { world_from_file, .. }) => world_from_file,
        other => panic!("{other:?}"),
    }
}

#[test]
fn cameras_are_listed_placed_or_not_said() {
    assert_eq!(cameras("").unwrap(), None);
    assert_eq!(cameras("[cameras]\nplace = 2\n").unwrap(), Some(CameraSource::Placed { distance_m: 2.0 }));
    assert_eq!(frame_of(""), DAffine3::IDENTITY);
    let p = DVec3::new(1.0, 2.0, 3.0);
    assert_eq!(frame_of("up = \"y\"\n").transform_point3(p), DVec3::new(1.0, -3.0, 2.0));
    let transform = "transform = [[2, 0, 0, 5], [0, 2, 0, 0], [0, 0, 2, 0], [0, 0, 0, 1]]\n";
    assert_eq!(frame_of(transform).transform_point3(p), DVec3::new(7.0, 4.0, 6.0));
    let both = format!("up = \"y\"\n{transform}");
    assert_eq!(frame_of(&both).transform_point3(p), DVec3::new(7.0, -6.0, 4.0));
    for (table, words) in [
        ("[cameras]\n", "needs a path, or place"),
        ("[cameras]\nplace = 0\n", "is no distance"),
        ("[cameras]\nplace = inf\n", "is no distance"),
        ("[cameras]\nplace = 2\npath = \"c.csv\"\n", "exclude each other"),
        ("[cameras]\nplace = 2\nup = \"y\"\n", "go with a path"),
        (
            "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,0],[0,-1,0,0],[0,0,1,0],[0,0,0,1]]\n",
            "no rotation",
        ),
        (
            "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,0],[0,2,0,0],[0,0,1,0],[0,0,0,1]]\n",
            "no rotation",
        ),
        (
            "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[1,0,0,1]]\n",
            "no rotation",
        ),
        (
            "[cameras]\npath = \"c.csv\"\ntransform = [[1,0,0,nan],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n",
            "no rotation",
        ),
        ("[cameras]\npath = \"gone.csv\"\n", "is not there"),
    ] {
        let message = cameras(table).unwrap_err().to_string();
        assert!(message.contains(words) && message.contains("scene.toml"), "{table}: {message}");
    }
}

fn pictures_of(rgb: &str) -> Option<PictureSource> {
    let plain = rgb.starts_with("rgb");
    let text = if plain {
        format!("{rgb}\n{GOOD}")
    } else {
        format!("{GOOD}{rgb}\n")
    };
    let mut pictures = read(&text).unwrap().pictures;
    if let Some(source) = &mut pictures {
        source.path = source.path.file_name().unwrap().into();
    }
    pictures
}

#[test]
fn colours_come_from_the_texture_or_from_pictures() {
    let world_from_file = DAffine3::IDENTITY;
    let source = |kind, path: &str, options| {
        let path = path.into();
        Some(PictureSource { kind, path, world_from_file, motions: None, options })
    };
    let options = PictureOptions::default();
    for texture in ["", "rgb = \"texture\"", "[rgb]\nsource = \"texture\""] {
        assert_eq!(pictures_of(texture), None);
    }
    assert_eq!(pictures_of("rgb = \"skybox\""), source(PictureKind::SkyBox, "skybox", options.clone()));
    let captures = pictures_of("[rgb]\nsource = \"captures\"\npath = \"raw\"\nparallax = false\nsize = 512");
    let small = PictureOptions { parallax: false, size: Some(512), ..options.clone() };
    assert_eq!(captures, source(PictureKind::Captures, "raw", small));
    let panorama =
        pictures_of("[rgb]\nsource = \"panorama\"\npath = \"raw\"\nyaw_deg = 90\nunseen = \"nearby\"");
    let turned = PictureOptions { yaw_deg: 90.0, unseen: UnseenColor::Nearby, ..options };
    assert_eq!(panorama, source(PictureKind::Panorama, "raw", turned));
    for (rgb, words) in [
        ("rgb = \"textures\"", "line 1: unknown variant `textures`, expected one of `texture`, `skybox`"),
        ("rgb = 3", "line 1: invalid type: integer `3`, expected \"texture\""),
        ("rgb = \"captures\"", "captures is not there; it should be a folder"),
        ("[rgb]\npath = \"raw\"", "missing field `source`"),
        ("[rgb]\nsource = \"skybox\"\nfolder = \"raw\"", "unknown field `folder`"),
        ("[rgb]\nsource = \"skybox\"\npath = \"gone\"", "rgb.path = \"gone\""),
        ("[rgb]\nsource = \"skybox\"\nyaw_deg = 1", "rgb.yaw_deg belongs to source = \"panorama\""),
        ("[rgb]\nsource = \"skybox\"\nsize = 16", "rgb.size = 16"),
        ("[rgb]\nsource = \"texture\"\npath = \"raw\"", "has no path"),
        ("[rgb]\nsource = \"panorama\"\npath = \"raw\"\nyaw_deg = nan", "rgb.yaw_deg = NaN"),
    ] {
        let text = if rgb.starts_with("rgb") {
            format!("{rgb}\n{GOOD}")
        } else {
            format!("{GOOD}{rgb}\n")
        };
        let message = read(&text).unwrap_err().to_string();
        assert!(message.contains(words), "{rgb}: {message}");
    }
}

#[test]
fn images_of_an_e57_file_are_found_where_it_is_named() {
    let dir = tempfile::tempdir().unwrap();
    for name in ["a.obj", "scan.E57", "other.e57", "c.csv"] {
        fs::write(dir.path().join(name), "").unwrap();
    }
    let path = dir.path().join("scene.toml");
    let rgb = |annotations: &str, cameras: &str, rgb: &str| {
        let mesh = "area = 1\n[mesh]\npath = \"a.obj\"\n";
        let text = format!("{mesh}[annotations]\npath = \"{annotations}\"\n[cameras]\n{cameras}\n{rgb}\n");
        fs::write(&path, text).unwrap();
        read_scene(&path).map(|scene| scene.pictures.unwrap())
    };
    let plain = "[rgb]\nsource = \"e57\"\nparallax = false\ngains = false";

    // The file of the locations goes first, and its frame is the pictures' frame.
    let found = rgb("other.e57", "path = \"scan.E57\"\nup = \"y\"", plain).unwrap();
    assert_eq!((found.kind, found.path), (PictureKind::E57, dir.path().join("scan.E57")));
    assert_eq!(found.world_from_file.transform_vector3(DVec3::Y), DVec3::Z);
    assert!(!found.options.parallax && !found.options.gains);
    let found = rgb("other.e57", "path = \"c.csv\"\nup = \"y\"", plain).unwrap();
    assert_eq!((found.path, found.world_from_file), (dir.path().join("other.e57"), DAffine3::IDENTITY));
    let named = "[rgb]\nsource = \"e57\"\npath = \"./scan.E57\"";
    let found = rgb("other.e57", "path = \"scan.E57\"\nup = \"y\"", named).unwrap();
    assert_eq!(found.world_from_file.transform_vector3(DVec3::Y), DVec3::Z);

    for (table, words) in [
        (plain, "needs a file: neither [cameras] nor [annotations] names an .e57"),
        ("[rgb]\nsource = \"e57\"\npath = \"gone.e57\"", "is not there; it should be a file"),
        ("[rgb]\nsource = \"e57\"\npath = \".\"", "is no file"),
        ("[rgb]\nsource = \"e57\"\nyaw_deg = 1", "rgb.yaw_deg belongs to source = \"panorama\""),
        ("[rgb]\nsource = \"skybox\"\ngains = true", "belongs to source = \"captures\" or \"e57\""),
    ] {
        let message = rgb("c.csv", "place = 2", table).unwrap_err().to_string();
        assert!(message.contains(words), "{table}: {message}");
    }
}

#[test]
fn clouds_and_how_they_are_read() {
    let scene = read(GOOD).unwrap();
    assert_eq!(scene.annotation_options, AnnotationOptions::default());
    let table = "paths = [\"Area_2\", \"c.csv\"]\nclass = \"classification\"\n\
                 instance = \"point_source_id\"\n\
                 room = \"office_1\"\nrooms = \"room\"\ncolumns = [\"x\", \"y\"]\n\
                 offset_m = [5e5, -1, 0.5]\n\
                 unknown_as_clutter = true\n[annotations.classes]\n\"2\" = \"floor\"\n7 = \"\"";
    let scene = read(&GOOD.replace("path = \"Area_2\"", table)).unwrap();
    assert!(scene.annotations[1].ends_with("c.csv"));
    let expected = AnnotationOptions {
        class_column: Some("classification".into()),
        instance_column: Some("point_source_id".into()),
        room: Some("office_1".parse().unwrap()),
        room_column: Some("room".into()),
        columns: vec!["x".into(), "y".into()],
        offset_m: DVec3::new(5e5, -1.0, 0.5),
        unknown_as_clutter: true,
        classes: BTreeMap::from([("2".into(), Some(Class::FLOOR)), ("7".into(), None)]),
        ..AnnotationOptions::default()
    };
    assert_eq!(scene.annotation_options, expected);
    assert!(scene.annotations_have_offset);
}

#[test]
fn published_areas_bring_their_own() {
    let text = "area = 5\n[published]\npath = \"Area_2\"\n";
    let scene = read(text).unwrap();
    assert!(scene.published.unwrap().ends_with("Area_2"));
    assert!(scene.mesh.is_empty() && scene.annotations.is_empty() && scene.cameras.is_none());
    let moved =
        format!("{text}transform = [[0,-1,0,7], [1,0,0,0], [0,0,1,0], [0,0,0,1]]\n[cameras]\nplace = 3\n");
    let scene = read(&moved).unwrap();
    assert_eq!(scene.world_from_published.transform_point3(DVec3::X), DVec3::new(7.0, 1.0, 0.0));
    assert_eq!(scene.cameras, Some(CameraSource::Placed { distance_m: 3.0 }));
    for (text, words) in [
        (format!("{text}[mesh]\npath = \"a.obj\"\n"), "leave out [mesh]"),
        (text.replace("Area_2", "Area_3"), "published.path = \"Area_3\""),
        (
            format!("{text}transform = [[2,0,0,0], [0,1,0,0], [0,0,1,0], [0,0,0,1]]\n"),
            "[published]: transform",
        ),
        ("area = 5\n[cameras]\nplace = 3\n".into(), "missing field `mesh`"),
    ] {
        let message = read(&text).unwrap_err().to_string();
        assert!(message.contains(words), "{text}: {message}");
    }
}

#[test]
fn meshes_come_in_several_files_and_with_labels() {
    let several = GOOD.replace("path = \"a.obj\"", "paths = [\"a.obj\", \"c.csv\"]");
    assert_eq!(read(&several).unwrap().mesh.len(), 2);
    assert!(
        read(&GOOD.replace("path = \"Area_2\"", "mesh = true"))
            .unwrap()
            .annotations
            .is_empty()
    );
    let unlabelled = read(&GOOD.replace("[annotations]\npath = \"Area_2\"\n", "")).unwrap();
    assert!(!unlabelled.is_labelled && read(GOOD).unwrap().is_labelled);
    for (from, to, words) in [
        ("path = \"a.obj\"", "paths = []", "mesh needs either path or paths"),
        ("path = \"a.obj\"", "", "mesh needs either path or paths"),
        ("path = \"a.obj\"", "paths = [\"a.obj\", \"gone.obj\"]", "mesh.paths = \"gone.obj\""),
        ("path = \"Area_2\"", "mesh = true\npath = \"Area_2\"", "annotations needs one of"),
        ("path = \"Area_2\"", "mesh = false", "annotations needs one of"),
    ] {
        let message = read(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(message.contains(words), "{to}: {message}");
    }
}

#[test]
fn a_file_of_another_kind_is_called_what_it_is() {
    let dir = tempfile::tempdir().unwrap();
    for (name, words) in [
        ("m.obj", "m.obj: is a mesh, not a scene"),
        ("M.GLB", "M.GLB: is a mesh, not a scene"),
        ("m.stl", "is a mesh in a format that is not read (OBJ, glTF and PLY are), not a scene"),
        ("scan.ply", "is a mesh or a cloud, not a scene"),
        ("scan.laz", "is a cloud of points, not a scene"),
        ("cameras.csv", "is a table, not a scene"),
        ("scan.parquet", "is no text: it holds zero bytes"),
    ] {
        let path = dir.path().join(name);
        fs::write(&path, b"# Blender\no Cube\n\0").unwrap();
        let message = read_scene(&path).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
        assert!(message.contains("scene.toml, that names"), "{message}");
    }

    for (name, is_explained) in [("points.txt", true), ("scene", true), ("scene.toml", false)] {
        let path = dir.path().join(name);
        fs::write(&path, "X Y Z\n1 2 3\n").unwrap();
        let message = read_scene(&path).unwrap_err().to_string();
        assert!(message.contains("line 1: "), "{message}");
        assert_eq!(message.contains("scene.toml, that names"), is_explained, "{message}");
    }
}

#[test]
fn a_scene_may_be_in_any_unicode() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.obj"), "").unwrap();
    let path = dir.path().join("scene.toml");
    let text = "area = 4\n[mesh]\npath = \"a.obj\"\n[annotations]\nmesh = true\n";
    for bytes in crate::fs::encoding::tests::encoded(text) {
        fs::write(&path, bytes).unwrap();
        assert_eq!(read_scene(&path).unwrap().area, 4);
    }
}

#[test]
fn every_fault_is_named() {
    for (from, to, words) in [
        ("area = 2", "area = 0", "line 1: "),
        ("area = 2", "area = \"2\"", "line 1: invalid type"),
        ("area = 2", "", "missing field `area`"),
        ("up = \"z\"", "up = \"x\"", "line 4: unknown variant `x`, expected `y` or `z`"),
        ("up = \"z\"", "upp = \"z\"", "line 4: unknown field `upp`, expected one of `path`"),
        ("area = 2", "area = 2\nareas = 3", "line 2: unknown field `areas`"),
        ("path = \"c.csv\"", "", "[cameras]: needs a path"),
        ("[cameras]", "[cameras", "line 7"),
        ("a.obj", "b.obj", "mesh.path = \"b.obj\""),
        ("a.obj", "Area_2", "is no file"),
        ("Area_2", "Area_9", "annotations.path = \"Area_9\""),
        ("path = \"Area_2\"", "", "one of path, paths"),
        ("path = \"Area_2\"", "paths = []", "one of path, paths"),
        ("path = \"Area_2\"", "path = \"Area_2\"\npaths = [\"c.csv\"]", "one of path, paths"),
        ("path = \"Area_2\"", "paths = [\"Area_2\", \"gone.las\"]", "annotations.paths = \"gone.las\""),
        ("\"Area_2\"", "\"Area_2\"\nroom = \"kitchen_1\"", "annotations.room: \"kitchen_1\""),
        ("\"Area_2\"", "\"Area_2\"\nroms = \"a\"", "line 7: unknown field `roms`"),
        (
            "\"Area_2\"",
            "\"Area_2\"\nclasses = { 2 = \"sky\" }",
            "annotations.classes.\"2\": \"sky\" is no class",
        ),
        ("\"Area_2\"", "\"Area_2\"\noffset_m = [1, inf, 0]", "not finite"),
        ("\"a.obj\"", "\"a.obj\"\noffset_m = [1, inf, 0]", "mesh.offset_m"),
        ("c.csv", "gone.csv", "cameras.path = \"gone.csv\""),
    ] {
        let message = read(&GOOD.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(message.contains(words) && message.contains("scene.toml"), "{to}: {message}");
    }
    assert!(matches!(read_scene(Path::new("gone.toml")), Err(Error::Io { .. })));
}

#[test]
fn a_mesh_is_fused_from_a_raw_scan() {
    let with = |keys: &str| read(&GOOD.replace("path = \"a.obj\"", keys));
    let scene = with("fuse = \"c.csv\"\ncell_m = 0.02\nclose_m = 0.3").unwrap();
    let fuse = scene.fuse.unwrap();
    assert!(fuse.inputs[0].ends_with("c.csv") && fuse.folder.ends_with("scene.fused"));
    assert_eq!((scene.mesh, scene.up), (vec![fuse.mesh()], UpAxis::Z));
    let lengths = [fuse.cell_m, fuse.close_m, fuse.max_error_m, fuse.range_m];
    assert_eq!(lengths, [Some(0.02), Some(0.3), None, None]);

    for (keys, words) in [
        ("fuse = []", "at least one path"),
        ("fuse = \"gone.e57\"", "mesh.fuse = \"gone.e57\""),
        ("fuse = \"c.csv\"\npath = \"a.obj\"", "leave out mesh.path"),
        ("fuse = \"c.csv\"\nunits = \"cm\"", "leave out mesh.units"),
        ("fuse = \"c.csv\"\ncell_m = 0", "mesh.cell_m = 0 must be metres"),
        ("path = \"a.obj\"\ncell_m = 0.01", "a key beside mesh.fuse"),
    ] {
        let message = with(keys).unwrap_err().to_string();
        assert!(message.contains(words) && message.contains("scene.toml"), "{keys}: {message}");
    }
}
