//! Names in the input that are paths, names of devices, or differ in case alone: no content of a file makes
//! the program write outside OUT.

use crate::common;
use common::scan::{Scan, listing, png_that_claims};
use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

/// A glTF box of one triangle whose names are paths to other folders.
fn gltf_with_names(names: &[&str]) -> String {
    use std::fmt::Write as _;
    let (mut materials, mut textures, mut images, mut primitives) =
        <(String, String, String, String)>::default();
    // A PNG file of two pixels.
    let png =
        "iVBORw0KGgoAAAANSUhEUgAAAAIAAAABCAIAAAB7QOjdAAAAD0lEQVR4nGPgYmBgYGAAAABeAA1Tm0cOAAAAAElFTkSuQmCC";
    for (i, name) in names.iter().enumerate() {
        let name = name.replace('\\', "\\\\").replace('\0', "\\u0000").replace('\n', "\\n");
        let comma = if i == 0 { "" } else { "," };
        let _ = write!(
            materials,
            "{comma}{{\"name\":\"{name}\",\
             \"pbrMetallicRoughness\":{{\"baseColorTexture\":{{\"index\":{i}}}}}}}"
        );
        let _ = write!(textures, "{comma}{{\"source\":{i}}}");
        let _ = write!(images, "{comma}{{\"name\":\"{name}\",\"uri\":\"data:image/png;base64,{png}\"}}");
        let _ = write!(
            primitives,
            "{comma}{{\"attributes\":{{\"POSITION\":{i},\"TEXCOORD_0\":{i}}},\"material\":{i}}}"
        );
    }
    // The positions serve as texture coordinates; their values do not matter.
    let primitives = primitives.replace(",\"TEXCOORD_0\"", ",\"_IGNORED\"");
    let accessors =
        vec!["{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}"; names.len()]
            .join(",");
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{primitives}]}}],\"materials\":[{materials}],\
         \"textures\":[{textures}],\
         \"images\":[{images}],\"accessors\":[{accessors}],\"bufferViews\":[{{\"buffer\":0,\
         \"byteLength\":36}}],\
         \"buffers\":[{{\"byteLength\":36,\"uri\":\"data:;base64,\
         AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAAAAAIC/\"}}]}}"
    )
}

/// Exports, which must succeed. All new files must lie in OUT, under names that every system accepts.
fn exports_only_into_out(scan: &Scan) -> BTreeMap<PathBuf, (String, u64)> {
    let before = listing(scan.dir.path());
    scan.exported();
    let out = scan.out();
    let (inside, outside): (BTreeMap<_, _>, BTreeMap<_, _>) = listing(scan.dir.path())
        .into_iter()
        .partition(|(path, _)| path.starts_with(&out));
    assert_eq!(outside, before, "something outside of OUT changed");
    let mut in_lower_case = std::collections::BTreeSet::new();
    for path in inside.keys() {
        let name = path.file_name().unwrap().to_str().unwrap();
        let fits = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        let is_device =
            ["con", "nul", "aux", "prn"].contains(&name.to_lowercase().split('.').next().unwrap());
        assert!(name.chars().all(fits) && !name.ends_with('.') && !is_device, "{name}");
        assert!(in_lower_case.insert(path.to_str().unwrap().to_lowercase()), "{name} twice but for case");
    }
    inside
}

#[test]
fn names_in_a_mesh_lead_nowhere() {
    let scan = Scan::new();
    let long = "n".repeat(3000);
    let names = [
        "../../evil",
        "/evil",
        "..\\\\..\\\\evil",
        "C:\\\\evil",
        "a\0b",
        "a\nb",
        "CON",
        "nul",
        "Wall",
        "wall",
        "WALL",
        ".",
        "..",
        "",
        ".hidden",
        "rgb",
        long.as_str(),
    ];
    scan.write("m.gltf", gltf_with_names(&names));
    scan.use_mesh("m.gltf");
    exports_only_into_out(&scan);
    // Images of an OBJ file may lie in other folders; their copies must not.
    let scan = Scan::new();
    let png = {
        let mut png = png_that_claims(1, 1);
        png[24] = 8;
        png
    };
    for name in ["secret.png", "scan/Wall.png", "scan/wall.png"] {
        fs::write(scan.dir.path().join(name), &png).unwrap();
    }
    scan.replace("room.mtl", "newmtl floor\n", "newmtl floor\nmap_Kd ../secret.png\n");
    scan.replace("room.mtl", "newmtl wall\n", "newmtl wall\nmap_Kd Wall.png\n");
    scan.replace("room.mtl", "newmtl table\n", "newmtl table\nmap_Kd wall.png\n");
    exports_only_into_out(&scan);
    // A file that is no image is never copied.
    let scan = Scan::new();
    fs::write(scan.dir.path().join("secret"), "a password").unwrap();
    scan.replace("room.mtl", "newmtl floor\n", "newmtl floor\nmap_Kd ../secret\n");
    for (path, _) in exports_only_into_out(&scan) {
        assert!(!fs::read(&path).is_ok_and(|bytes| bytes.windows(10).any(|w| w == b"a password")));
    }
}

#[test]
fn gltf_takes_files_outside_its_folder_only_if_the_scene_says_so() {
    let scan = Scan::new();
    let corners = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0];
    let bytes: Vec<u8> = corners.iter().flat_map(|number| number.to_le_bytes()).collect();
    fs::write(scan.dir.path().join("other.bin"), &bytes).unwrap();
    let inside = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAAAAAIC/";
    scan.write("m.gltf", gltf_with_names(&["wall"]).replace(inside, "../other.bin"));
    scan.use_mesh("m.gltf");
    scan.refused(&["m.gltf", "`../other.bin`", "outside_files = true under [mesh]"]);
    scan.replace("scene.toml", "[mesh]\n", "[mesh]\noutside_files = true\n");
    exports_only_into_out(&scan);
}

#[test]
fn names_in_lists_and_annotations_lead_nowhere() {
    // A scan location is named by a hash of its picture's name.
    let scan = Scan::new();
    scan.write(
        "images.txt",
        "1 1 0 0 0 -2 -1.2 -1.5 1 ../../../evil.jpg\n\n2 1 0 0 0 -1 -1 -1.5 1 /etc/passwd\n\n",
    );
    scan.use_cameras("images.txt");
    exports_only_into_out(&scan);
    for uuid in ["../../evil", "/etc/passwd", "a\\\\b", "..", "", "a b", &"5".repeat(300)] {
        let scan = Scan::new();
        fs::create_dir(scan.file("poses")).unwrap();
        scan.write(
            "poses/pose.json",
            format!(
                "{{\"camera_uuid\":\"{uuid}\",\"camera_original_rotation\":[1.57,0,0],\"camera_location\":[2,\
                 1.2,1.5],\
                 \"room\":\"../../x_1_1\"}}"
            ),
        );
        scan.use_cameras("poses");
        scan.refused(&["pose.json", "camera_uuid"]);
        let scan = Scan::new();
        scan.write("cameras.csv", format!("\"{uuid}\",2,1.2,1.5,0,0,0,1\n"));
        match uuid {
            "" => scan.refused(&["cameras.csv, line 1", "no name"]),
            // Any other name becomes a hash.
            _ => drop(exports_only_into_out(&scan)),
        }
    }
    // Uuids that differ in case alone would share files on a system that ignores case.
    let scan = Scan::new();
    fs::create_dir(scan.file("poses")).unwrap();
    for (name, uuid) in [("a", "ABCDEF"), ("b", "abcdef")] {
        scan.write(
            &format!("poses/{name}.json"),
            format!(
                "{{\"camera_uuid\":\"{uuid}\",\"camera_original_rotation\":[1.57,0,0],\"camera_location\":[2,\
                 1.2,1.5]}}"
            ),
        );
    }
    scan.use_cameras("poses");
    scan.refused(&["b.json", "abcdef differs from ABCDEF of another file in case only"]);
    // Room types and classes in annotations must be known words, and their indices numbers.
    for room in ["../../evil_1", "office_../1", "office_1/..", "CON_1"] {
        let scan = Scan::new();
        scan.use_annotations("a.ply");
        scan.replace("scene.toml", "[cameras]", &format!("room = \"{room}\"\n[cameras]"));
        scan.write("a.ply", "");
        scan.refused(&["scene.toml", "room"]);
    }
    let scan = Scan::new();
    fs::create_dir_all(scan.file("Area_1/x\\..\\evil_1/Annotations")).unwrap();
    scan.refused(&["evil_1"]);
    let scan = Scan::new();
    scan.write("Area_1/office_1/Annotations/x\\evil_1.txt", "1 2 3 4 5 6\n");
    scan.refused(&["evil_1.txt"]);
}
