use crate::mesh::gltf::read::tests::Fixture;
use crate::mesh::{MeshFile, MeshLabels};

/// The text property `class` of the table that most tests read.
const TEXT: &str = r#""class": {"type": "STRING"}"#;

impl Fixture {
    /// Adds three triangles beside each other, without indices.
    fn three_triangles(&mut self) -> usize {
        let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let all: Vec<[f32; 3]> = (0..3)
            .flat_map(|n| corners.map(|[x, y, z]| [x + 2.0 * n as f32, y, z]))
            .collect();
        self.floats(&all)
    }

    /// Adds a feature id for each of the nine vertices.
    fn ids(&mut self, ids: [u8; 9]) -> usize {
        self.accessor(ids.to_vec(), "SCALAR", 5121, 9)
    }

    /// Adds texts with 32-bit offsets. Returns where they are.
    fn texts(&mut self, words: &[&str]) -> String {
        self.texts_with(words, "UINT32", |offset| offset.to_le_bytes().to_vec())
    }

    fn texts_with(&mut self, words: &[&str], kind: &str, bytes: impl Fn(u32) -> Vec<u8>) -> String {
        let values = self.view(words.concat().into_bytes());
        let mut offsets = bytes(0);
        let mut end = 0;
        for word in words {
            end += word.len() as u32;
            offsets.extend(bytes(end));
        }
        let offsets = self.view(offsets);
        format!(r#"{{"values": {values}, "stringOffsets": {offsets}, "stringOffsetType": "{kind}"}}"#)
    }
}

/// Makes the JSON of a mesh with one node and one table of the class `thing`.
fn scene(properties: &str, table: &str, primitives: &[String]) -> String {
    scene_of(
        &schema(properties, ""),
        &[format!(r#"{{"class": "thing", {table}}}"#)],
        primitives,
        "{\"mesh\": 0}",
    )
}

fn schema(properties: &str, enums: &str) -> String {
    format!(
        r#""schema": {{"id": "s", "classes": {{"thing": {{"properties": {{{properties}}}}}}},
        "enums": {{{enums}}}}}"#
    )
}

fn scene_of(schema: &str, tables: &[String], primitives: &[String], nodes: &str) -> String {
    format!(
        r#""extensionsUsed": ["EXT_mesh_features", "EXT_structural_metadata"],
        "extensions": {{"EXT_structural_metadata": {{{schema}, "propertyTables": [{}]}}}},
        "meshes": [{{"primitives": [{}]}}], "nodes": [{nodes}]"#,
        tables.join(","),
        primitives.join(",")
    )
}

/// Makes a primitive whose ids are in the attribute 0.
fn primitive(positions: usize, ids: usize, more: &str) -> String {
    let set = format!(r#"{{"featureCount": 3, "attribute": 0, "propertyTable": 0{more}}}"#);
    primitive_of(positions, &format!(r#", "_FEATURE_ID_0": {ids}"#), &set)
}

fn primitive_of(positions: usize, attributes: &str, sets: &str) -> String {
    format!(
        r#"{{"attributes": {{"POSITION": {positions}{attributes}}},
        "extensions": {{"EXT_mesh_features": {{"featureIds": [{sets}]}}}}}}"#
    )
}

/// Returns the class and number of each face, such as `chair 3`, or `-` for none.
fn labels(file: &MeshFile) -> String {
    let Some(MeshLabels::Objects { objects, faces, are_names }) = &file.labels else {
        assert_eq!(file.labels, None);
        return "none".into();
    };
    assert!(!are_names);
    let label = |face: &u32| {
        let object = objects.get(*face as usize);
        object.map_or("-".into(), |object| format!("{} {}", object.class, object.instance))
    };
    faces.iter().map(label).collect::<Vec<_>>().join(", ")
}

fn told(file: &MeshFile) -> String {
    file.warnings.join("\n")
}

#[test]
fn ids_of_vertices_have_any_type() {
    let ids = [2u8, 2, 2, 0, 0, 0, 1, 1, 1];
    let wide = |f: fn(u8) -> Vec<u8>| ids.iter().flat_map(|id| f(*id)).collect::<Vec<u8>>();
    for (component, bytes) in [
        (5120, wide(|id| vec![id])),
        (5121, wide(|id| vec![id])),
        (5122, wide(|id| i16::from(id).to_le_bytes().to_vec())),
        (5123, wide(|id| u16::from(id).to_le_bytes().to_vec())),
        (5125, wide(|id| u32::from(id).to_le_bytes().to_vec())),
        (5126, wide(|id| f32::from(id).to_le_bytes().to_vec())),
    ] {
        let mut f = Fixture::default();
        let p = f.three_triangles();
        let ids = f.accessor(bytes, "SCALAR", component, 9);
        let class = f.texts(&["chair", "table", "office wall"]);
        let file = f.read(&scene(
            TEXT,
            &format!(r#""count": 3, "properties": {{"class": {class}}}"#),
            &[primitive(p, ids, "")],
        ));
        let file = file.unwrap();
        assert_eq!(labels(&file), "office wall 2, chair 0, table 1", "{component}");
        assert!(file.warnings.is_empty(), "{:?}", file.warnings);
    }
}

#[test]
fn offsets_of_texts_have_any_type() {
    for (kind, bytes) in [
        ("UINT8", (|n| vec![n as u8]) as fn(u32) -> Vec<u8>),
        ("UINT16", |n| (n as u16).to_le_bytes().to_vec()),
        ("UINT32", |n| n.to_le_bytes().to_vec()),
        ("UINT64", |n| u64::from(n).to_le_bytes().to_vec()),
    ] {
        let mut f = Fixture::default();
        let p = f.three_triangles();
        let ids = f.ids([0, 0, 0, 1, 1, 1, 2, 2, 2]);
        // A text may be empty, and have any letters.
        let class = f.texts_with(&["Stühle", "", " door "], kind, bytes);
        let file = f.read(&scene(
            TEXT,
            &format!(r#""count": 3, "properties": {{"class": {class}}}"#),
            &[primitive(p, ids, "")],
        ));
        assert_eq!(labels(&file.unwrap()), "Stühle 0, -, door 2", "{kind}");
    }
}

#[test]
fn primitives_share_the_objects_of_a_table() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    // The second face has two corners of one feature, and the third corners of three.
    let first = f.ids([1, 1, 1, 2, 0, 0, 2, 1, 0]);
    let second = f.ids([1, 1, 1, 7, 7, 7, 9, 9, 9]);
    let class = f.texts(&["chair", "table", "wall"]);
    let rest = scene(
        TEXT,
        &format!(r#""count": 3, "properties": {{"class": {class}}}"#),
        &[primitive(p, first, ""), primitive(p, second, r#", "nullFeatureId": 7"#)],
    );
    let file = f.read(&rest).unwrap();
    assert_eq!(labels(&file), "table 1, chair 0, wall 2, table 1, -, -");
    let Some(MeshLabels::Objects { objects, .. }) = &file.labels else { panic!() };
    assert_eq!(objects.len(), 3);
    assert_eq!(
        file.warnings,
        ["3 vertices of features that are not in their property table (EXT_mesh_features)"]
    );

    // Any number and any byte may be another: the file is read or refused.
    f.read_with_every_number_changed(&rest);
    for at in 0..f.data.len() {
        for byte in [0, 0x7f, 0x80, 0xff] {
            let was = std::mem::replace(&mut f.data[at], byte);
            let _ = f.read(&rest);
            f.data[at] = was;
        }
    }
}

#[test]
fn an_enum_names_classes() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0, 0, 0, 1, 1, 1, 2, 2, 2]);
    let small = f.view(vec![255, 0, 4]);
    let large = f.view(vec![255, 255, 0, 0, 4, 0]);
    let property =
        r#""kind": {"type": "ENUM", "enumType": "kinds", "semantic": "CLASS", "noData": "unknown""#;
    for (kind, view, first) in [(r#""valueType": "INT8","#, small, "-1"), ("", large, "65535")] {
        let kinds = format!(
            r#""kinds": {{{kind} "values": [{{"name": "chair", "value": {first}}},
            {{"name": "unknown", "value": 0}}, {{"name": "table", "value": 4}}]}}"#
        );
        for (default, expected) in
            [("}", "chair 0, -, table 2"), (r#", "default": "clutter"}"#, "chair 0, clutter 1, table 2")]
        {
            let table = format!(
                r#"{{"class": "thing", "count": 3, "properties": {{"kind": {{"values": {view}}}}}}}"#
            );
            let schema = schema(&format!("{property}{default}"), &kinds);
            let rest = scene_of(&schema, &[table], &[primitive(p, ids, "")], r#"{"mesh": 0}"#);
            assert_eq!(labels(&f.read(&rest).unwrap()), expected);
        }
    }
}

#[test]
fn a_property_numbers_objects() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0, 0, 0, 1, 1, 1, 2, 2, 2]);
    let class = f.texts(&["chair", "chair", "lamp"]);
    let number = f.view([12i16, 12, -1].into_iter().flat_map(i16::to_le_bytes).collect());
    let table = format!(
        r#""count": 3, "properties": {{"class": {class}, "id": {class},
        "instance_id": {{"values": {number}}}}}"#
    );
    let properties = |more: &str| {
        format!(
            r#"{TEXT}, "id": {{"type": "STRING"}},
            "instance_id": {{"type": "SCALAR", "componentType": "INT16"{more}}}"#
        )
    };
    let read = |more: &str| {
        labels(
            &f.read(&scene(&properties(more), &table, &[primitive(p, ids, "")]))
                .unwrap(),
        )
    };
    // A feature without a number follows all others.
    assert_eq!(read(""), "chair 12, chair 12, lamp 15");
    assert_eq!(read(r#", "noData": 12"#), "chair 0, chair 1, lamp 2");
    assert_eq!(read(r#", "normalized": true"#), "chair 0, chair 1, lamp 2");
}

#[test]
fn features_without_a_class_are_no_labels() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0; 9]);
    let component = f.texts(&["Wall"]);
    let properties = r#""component": {"type": "STRING"}, "class": {"type": "STRING", "array": true},
        "label": {"type": "SCALAR", "componentType": "UINT8"}"#;
    let table = format!(r#""count": 1, "properties": {{"component": {component}, "label": {component}}}"#);
    let file = f.read(&scene(properties, &table, &[primitive(p, ids, "")])).unwrap();
    assert_eq!(labels(&file), "none");
    let told = told(&file);
    for words in [
        "EXT_mesh_features",
        "is called category, class,",
        "there are `class`, `component`, `label` (EXT_str",
    ] {
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn the_first_set_with_classes_counts() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0, 0, 0, 1, 1, 1, 0, 0, 0]);
    let others = f.ids([1; 9]);
    let class = f.texts(&["chair", "table"]);
    let tables = [
        r#"{"class": "thing", "count": 2}"#.to_owned(),
        format!(r#"{{"class": "thing", "count": 2, "properties": {{"class": {class}}}}}"#),
        format!(r#"{{"class": "thing", "count": 2, "properties": {{"class": {class}}}}}"#),
    ];
    let set = |attribute: &str, table: usize| {
        format!(r#"{{"featureCount": 2{attribute}, "propertyTable": {table}}}"#)
    };
    let texture = r#", "texture": {"index": 0, "channels": [0]}"#;
    let attributes = format!(r#", "_FEATURE_ID_0": {others}, "_FEATURE_ID_1": {ids}"#);
    let sets = [
        r#"{"featureCount": 2}"#.to_owned(),
        set(r#", "attribute": 0"#, 0),
        set(texture, 2),
        set(r#", "attribute": 1"#, 1),
        set(r#", "attribute": 0"#, 2),
    ];
    let primitives = [
        primitive_of(p, &attributes, &sets.join(",")),
        primitive_of(p, &attributes, &set(r#", "attribute": 0"#, 2)),
        primitive_of(p, "", &set(texture, 2)),
        format!(r#"{{"attributes": {{"POSITION": {p}}}}}"#),
    ];
    let file = f
        .read(&scene_of(&schema(TEXT, ""), &tables, &primitives, r#"{"mesh": 0}"#))
        .unwrap();
    // The numbers of the second table go on where those of the first end.
    let expected = "chair 0, table 1, chair 0, table 3, table 3, table 3, -, -, -, -, -, -";
    assert_eq!(labels(&file), expected);
    assert_eq!(
        file.warnings,
        ["1 primitive with features in textures alone, which are not read (EXT_mesh_features)"]
    );
}

#[test]
fn without_an_attribute_each_vertex_is_a_feature() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let class = f.texts(&["a", "b", "c", "d", "e", "f", "g", "h", "i"]);
    let set = r#"{"featureCount": 9, "propertyTable": 0, "nullFeatureId": 6}"#;
    let table = format!(r#""count": 9, "properties": {{"class": {class}}}"#);
    let file = f.read(&scene(TEXT, &table, &[primitive_of(p, "", set)])).unwrap();
    assert_eq!(labels(&file), "a 0, d 3, -");
}

#[test]
fn the_schema_may_lie_elsewhere() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0; 9]);
    let class = f.texts(&["chair"]);
    let table = [format!(r#"{{"class": "thing", "count": 1, "properties": {{"class": {class}}}}}"#)];
    for (uri, expected, words) in [
        (
            "data:,%7B'classes':%7B'thing':%7B'properties':%7B'class':%7B'type':'STRING'%7D%7D%7D%7D%7D",
            "chair 0",
            "",
        ),
        ("gone.json", "none", "the schema `gone.json` cannot be read"),
        ("data:,x", "none", "is no valid JSON"),
    ] {
        let schema = format!(r#""schemaUri": "{}""#, uri.replace('\'', "%22"));
        let rest = scene_of(&schema, &table, &[primitive(p, ids, "")], r#"{"mesh": 0}"#);
        let file = f.read(&rest).unwrap();
        assert!(labels(&file).starts_with(expected) && told(&file).contains(words), "{}", told(&file));
    }
}

#[test]
fn features_come_before_nodes() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0, 0, 0, 1, 1, 1, 9, 9, 9]);
    let class = f.texts(&["door", "window"]);
    let table = [format!(r#"{{"class": "thing", "count": 2, "properties": {{"class": {class}}}}}"#)];
    let primitives = [primitive(p, ids, r#", "nullFeatureId": 9"#)];
    for (node, expected) in [
        (r#"{"mesh": 0, "name": "Chair.001"}"#, "door 0, window 1, -"),
        (r#"{"mesh": 0, "name": "chair|8"}"#, "door 9, window 10, chair 8"),
        (r#"{"mesh": 0, "extras": {"class": "chair"}}"#, "door 0, window 1, chair 2"),
    ] {
        let file = f.read(&scene_of(&schema(TEXT, ""), &table, &primitives, node)).unwrap();
        assert_eq!(labels(&file), expected);
    }
}

/// Checks that a file with damage is read without labels.
fn check_damage(f: &Fixture, rest: &str, words: &str) {
    let file = f.read(rest).unwrap();
    assert_eq!(labels(&file), "none", "{words}");
    let told = told(&file);
    assert!(told.starts_with("features of faces (EXT_mesh_features) are no labels: "), "{told}");
    assert!(told.contains(words), "{words}: {told}");
}

#[test]
fn damaged_tables_cost_the_labels_alone() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0, 0, 0, 1, 1, 1, 0, 0, 0]);
    let texts = f.view(b"chair\xff".to_vec());
    let text = |offsets: &str| {
        let text =
            format!(r#"{{"values": {texts}, "stringOffsetType": "UINT8", "stringOffsets": {offsets}}}"#);
        format!(r#"{{"class": "thing", "name": "rooms", "count": 2, "properties": {{"class": {text}}}}}"#)
    };
    let [good, back, long, bytes] =
        [[0, 5, 5], [0, 5, 3], [0, 5, 7], [0, 5, 6]].map(|offsets| f.view(offsets.to_vec()).to_string());
    let fits = text(&good);

    let named = "EXT_structural_metadata, property table 0 `rooms`, property `class`: ";
    let id = format!(r#"}}, "id": {{"values": {good}}}}}}}"#);
    let number = r#""class": {"type": "STRING"}, "id": {"type": "SCALAR", "componentType": "UINT32"}"#;
    for (properties, table, words) in [
        (TEXT, text(&back), &*format!("{named}the text of row 1 goes from byte 5 to 3, but there are 6")),
        (TEXT, text(&long), "the text of row 1 goes from byte 5 to 7, but"),
        (TEXT, text(&bytes), "row 1 is `\u{fffd}`, which is no UTF-8"),
        (TEXT, fits.replace("UINT8", "UINT16"), "stringOffsets are 3 numbers of 2 bytes"),
        (TEXT, fits.replace("UINT8", "FLOAT32"), "offsets of the type `FLOAT32`"),
        (TEXT, text("999"), "points to buffer view 999"),
        (TEXT, fits.replace("stringOffsets", "x"), "names no buffer view for its stringOffsets"),
        (TEXT, fits.replace("thing", "x"), "is of the class `x`, which the schema does"),
        (TEXT, fits.replace(r#""count": 2,"#, ""), "table 0 `rooms` has no count"),
        (TEXT, fits.replace(": 2,", ": 999999999999,"), "1000000000000 numbers of 1 bytes"),
        (
            number,
            fits.replace("}}}", &id),
            "property `id`: its values are 2 numbers of 4 bytes, but there are 3",
        ),
    ] {
        let rest = scene_of(&schema(properties, ""), &[table], &[primitive(p, ids, "")], r#"{"mesh": 0}"#);
        check_damage(&f, &rest, words);
    }

    for (enums, words) in [
        ("", "the schema has no enum `kinds`"),
        (r#""kinds": {"valueType": "x"}"#, "enum `kinds` is of the type `x`"),
        (r#""kinds": {"valueType": "UINT8"}"#, "the enum has no value 99, as row 0 has"),
    ] {
        let schema = schema(r#""class": {"type": "ENUM", "enumType": "kinds"}"#, enums);
        let rest = scene_of(&schema, std::slice::from_ref(&fits), &[primitive(p, ids, "")], r#"{"mesh": 0}"#);
        check_damage(&f, &rest, words);
    }
}

#[test]
fn damaged_ids_cost_the_labels_alone() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0, 0, 0, 1, 1, 1, 0, 0, 0]);
    let short = f.accessor(vec![0; 8], "SCALAR", 5121, 8);
    let beyond = f.accessors.len();
    let empty = beyond + 1;
    for more in [r#""bufferView": 0, "byteOffset": 999"#, r#""byteOffset": 0"#] {
        let accessor = format!(r#"{{"componentType": 5121, "type": "SCALAR", "count": 9, {more}}}"#);
        f.accessors.push(accessor);
    }
    let class = f.texts(&["chair", "table"]);
    let table = format!(r#""count": 2, "properties": {{"class": {class}}}"#);

    let of = |ids: usize| primitive(p, ids, "");
    let packed = r#""extensions": {"KHR_draco_mesh_compression": {}, "#;
    for (primitive, words) in [
        (of(ids).replace("_ID_0", "_ID_1"), "names _FEATURE_ID_0, which the primitive does not have"),
        (of(ids).replace("\"attribute\": 0", "\"attribute\": -1"), "names -1 as an attribute"),
        (of(ids).replace("Table\": 0", "Table\": 5"), "has no property table 5"),
        (of(short), "mesh 0, primitive 0, EXT_mesh_features has 8 of _FEATURE_ID_0 for 9 vertices"),
        (of(p), "has 3 numbers an id"),
        (of(beyond), "takes 9 elements of 1 bytes"),
        (of(empty), "has no data for _FEATURE_ID_0"),
        (
            of(empty).replace(r#""extensions": {"#, packed),
            "_FEATURE_ID_0 in KHR_draco_mesh_compression alone",
        ),
        (of(99), "accessor 99"),
    ] {
        check_damage(&f, &scene(TEXT, &table, &[primitive]), words);
    }
}

#[test]
fn classes_that_are_no_features_are_told() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let plain = [format!(r#"{{"attributes": {{"POSITION": {p}}}}}"#)];
    let rest = scene_of(&schema(TEXT, ""), &[], &plain, r#"{"mesh": 0}"#);
    let textures = rest.replace(r#""propertyTables": []"#, r#""propertyTextures": [{"class": "thing"}]"#);
    let file = f.read(&textures).unwrap();
    assert_eq!(file.warnings, ["classes in property textures of EXT_structural_metadata are not read"]);

    let table = r#"{"class": "thing", "count": 1}"#.to_owned();
    let node = r#"{"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}},
        "EXT_instance_features": {"featureIds": [{"featureCount": 1, "propertyTable": 0}]}}}"#;
    let file = f.read(&scene_of(&schema(TEXT, ""), &[table], &plain, node)).unwrap();
    assert_eq!(file.warnings, ["classes of instances (EXT_instance_features) are not read"]);

    let features = [primitive_of(p, "", r#"{"featureCount": 9}"#)];
    let file = f
        .read(&scene_of(&schema(TEXT, ""), &[], &features, r#"{"mesh": 0}"#))
        .unwrap();
    assert_eq!(
        file.warnings,
        ["features of faces (EXT_mesh_features) are no labels: they have no property table"]
    );
}

/// Files with odd JSON elsewhere are read by another way, which keeps the metadata.
#[test]
fn features_of_odd_files_are_read() {
    let mut f = Fixture::default();
    let p = f.three_triangles();
    let ids = f.ids([0, 0, 0, 1, 1, 1, 0, 0, 0]);
    let class = f.texts(&["chair", "table"]);
    let table = format!(r#""count": 2.0, "properties": {{"class": {class}}}"#);
    let primitive = primitive(p, ids, "").replace(": 0", ": 0.0");
    let rest = scene(TEXT, &table, &[primitive]);
    let rest =
        format!(r#"{rest}, "animations": [{{"channels": [{{"sampler": 0, "target": {{"path": "x"}}}}]}}]"#);
    assert_eq!(labels(&f.read(&rest).unwrap()), "chair 0, table 1, chair 0");
}
