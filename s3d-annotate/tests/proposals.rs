//! Labels of others as proposals.

use proptest::prelude::*;
use s3d_annotate::labelling::{Action, FaceRuns, LabelFolder};
use s3d_annotate::outputs::{OutputFormat, OutputOptions, write_output};
use s3d_annotate::proposals::{Proposal, Target, read_proposals};
use s3d_annotate::segments::{SegmentOptions, segment_faces};
use s3d_dataset::{Context, Event, Result};
use s3d_detect::surfel::surfels_of;
use s3d_detect::{Area, CLASSES, Element, Model, ParsedArea, SpaceSource, TrainOptions};
use s3d_geom::glam::{DVec3, Vec3, vec3};
use s3d_geom::primitives::{cuboid, grid};
use s3d_geom::{Aabb, Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_io::cloud::NpyWriter;
use s3d_label::Taxonomy;
use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// A floor of 4 × 4 m, of 3,200 faces and 1,681 vertices, and two chests 5 cm above it, of 12 faces each.
fn room() -> TriMesh {
    let mut parts = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [40, 40]);
    parts.append(cuboid(vec3(0.55, 0.55, 0.05), vec3(1.05, 1.05, 0.5)));
    parts.append(cuboid(vec3(2.55, 2.55, 0.05), vec3(3.05, 3.05, 0.5)));
    TriMesh::new(parts).unwrap()
}

/// The floor is 1, and the chests are 7, with instances 4 and 9.
fn class_and_instance(face: usize) -> [i64; 2] {
    match face {
        0..3200 => [1, -1],
        3200..3212 => [7, 4],
        _ => [7, 9],
    }
}

fn read(path: &Path, mesh: &TriMesh) -> Result<Vec<Proposal>> {
    read_proposals(path, &Target::new(mesh, &Taxonomy::s3dis()), &Context::default())
}

fn message(path: &Path, mesh: &TriMesh) -> String {
    let message = read(path, mesh).unwrap_err().to_string();
    assert!(message.contains(path.file_name().unwrap().to_str().unwrap()), "{message}");
    message
}

/// The classes, faces and sources of proposals.
fn shown(found: &[Proposal]) -> Vec<String> {
    let line = |p: &Proposal| format!("{} {:?} {}", p.class, p.faces.runs(), p.source);
    found.iter().map(line).collect()
}

/// The proposals of the room without instances.
fn room_of(source: &str) -> [String; 3] {
    ["floor [0..3200]", "table [3200..3212]", "table [3212..3224]"].map(|line| format!("{line} {source}"))
}

fn text(numbers: impl Iterator<Item = i64>) -> String {
    numbers.fold(String::new(), |mut text, number| {
        writeln!(text, "{number}").unwrap();
        text
    })
}

fn npy(path: &Path, numbers: impl ExactSizeIterator<Item = i32>) {
    let shape = [numbers.len() as u64];
    let mut file = NpyWriter::create(path, "<i4", &shape).unwrap();
    for number in numbers {
        file.put(&number.to_le_bytes()).unwrap();
    }
    file.finish().unwrap();
}

#[test]
fn faces_of_a_class_that_touch_are_a_proposal() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let classes = (0..mesh.faces().len()).map(|face| class_and_instance(face)[0]);
    let path = dir.path().join("net.txt");
    fs::write(&path, text(classes)).unwrap();
    assert_eq!(shown(&read(&path, &mesh).unwrap()), room_of("net.txt"));

    let path = dir.path().join("net.npy");
    npy(&path, (0..mesh.faces().len()).map(|face| class_and_instance(face)[0] as i32));
    assert_eq!(shown(&read(&path, &mesh).unwrap()), room_of("net.npy"));
}

#[test]
fn vertices_decide_the_faces_around_them() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("net.txt");
    let chests = mesh
        .positions()
        .iter()
        .zip(0..)
        .map(|(_, v)| if v < 1681 { 255 } else { 7 });
    fs::write(&path, text(chests)).unwrap();
    let found = read(&path, &mesh).unwrap();
    assert_eq!(shown(&found), room_of("net.txt")[1..]);
}

/// An archive of arrays, stored as they are: NPZ as numpy writes it. The readers do not check the sum.
fn npz(path: &Path, arrays: &[(&str, Vec<i32>)]) {
    let crc = |bytes: &[u8]| {
        let mut crc = !0u32;
        for byte in bytes {
            crc ^= u32::from(*byte);
            (0..8).for_each(|_| crc = (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()));
        }
        !crc
    };
    let mut file = Vec::new();
    let mut directory = Vec::new();
    for (name, numbers) in arrays {
        let member = path.with_file_name("member.npy");
        npy(&member, numbers.iter().copied());
        let bytes = fs::read(&member).unwrap();
        let name = format!("{name}.npy");
        let size = (bytes.len() as u32).to_le_bytes();
        let mut common = vec![20, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        common.extend(crc(&bytes).to_le_bytes());
        common.extend([size, size].concat());
        common.extend((name.len() as u16).to_le_bytes());
        common.extend([0, 0]);

        directory.extend(b"PK\x01\x02\x14\x00");
        directory.extend(&common);
        directory.extend([0; 10]);
        directory.extend((file.len() as u32).to_le_bytes());
        directory.extend(name.as_bytes());
        file.extend(b"PK\x03\x04");
        file.extend(&common);
        file.extend(name.as_bytes());
        file.extend(&bytes);
    }
    let start = (file.len() as u32).to_le_bytes();
    let count = (arrays.len() as u16).to_le_bytes();
    let size = (directory.len() as u32).to_le_bytes();
    file.extend(&directory);
    file.extend(b"PK\x05\x06\0\0\0\0");
    file.extend([count, count].concat());
    file.extend([size, start].concat());
    file.extend([0, 0]);
    fs::write(path, file).unwrap();
}

#[test]
fn an_archive_may_number_instances() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("net.npz");
    let column = |place: usize| {
        let of_face = (0..mesh.faces().len()).map(|face| class_and_instance(face)[place] as i32);
        of_face.collect::<Vec<i32>>()
    };
    npz(&path, &[("label", column(0)), ("instance", column(1))]);
    let found = read(&path, &mesh).unwrap();
    let [floor, ..] = room_of("net.npz");
    let chests = ["table [3200..3212] net.npz, instance 4", "table [3212..3224] net.npz, instance 9"];
    assert_eq!(shown(&found), [&floor[..], chests[0], chests[1]]);

    // Only one array: it has classes, whatever its name.
    npz(&path, &[("arr_0", column(0))]);
    assert_eq!(read(&path, &mesh).unwrap().len(), 3);
    npz(&path, &[("arr_0", column(0)), ("arr_1", column(1))]);
    assert!(message(&path, &mesh).contains("call it class"));
    npz(&path, &[("label", column(0)), ("instance", vec![0; mesh.positions().len()])]);
    assert!(message(&path, &mesh).contains("do not fit"));
    npz(&path, &[("label", column(0)), ("classes", vec![0])]);
    assert!(message(&path, &mesh).contains("holds no texts"));
}

#[test]
fn names_beside_the_file_say_what_numbers_mean() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("net.txt");
    let classes = (0..mesh.faces().len()).map(|face| class_and_instance(face)[0] * 10);
    fs::write(&path, text(classes)).unwrap();
    let why = message(&path, &mesh);
    assert!(why.contains("face 3200") && why.contains("class 70") && why.contains("classes.json"), "{why}");

    let names = dir.path().join("classes.json");
    fs::write(&names, r#"{"10": null, "70": "bookcase"}"#).unwrap();
    let found = read(&path, &mesh).unwrap();
    assert_eq!(found.iter().map(|p| &p.class[..]).collect::<Vec<_>>(), ["bookcase"; 2]);
    // The file's own names come first.
    let own = dir.path().join("net.classes.json");
    fs::write(&own, r#"{"10": "cup", "70": "bookcase"}"#).unwrap();
    let why = read(&path, &mesh).unwrap_err().to_string();
    assert!(why.contains("net.classes.json") && why.contains("cup"), "{why}");
    let mut list = vec!["null"; 71];
    list[70] = "\"sofa\"";
    fs::write(&own, format!("[{}]", list.join(","))).unwrap();
    assert_eq!(read(&path, &mesh).unwrap()[1].class, "sofa");
    fs::write(&own, "[3]").unwrap();
    assert!(read(&path, &mesh).unwrap_err().to_string().contains("net.classes.json"));
}

#[test]
fn small_pieces_are_dropped_with_a_warning_and_nothing_left_is_an_error() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("net.txt");
    // Faces of 0.005 m².
    let classes = (0..mesh.faces().len()).map(|face| [-1, 8][usize::from(face == 7 || face > 3211)]);
    fs::write(&path, text(classes)).unwrap();
    let ctx = Context::default();
    let found = read_proposals(&path, &Target::new(&mesh, &Taxonomy::s3dis()), &ctx).unwrap();
    assert_eq!((shown(&found), ctx.warnings()), (vec!["chair [3212..3224] net.txt".to_owned()], 1));

    let none = (0..mesh.faces().len()).map(|face| [-1, 255, -100][face % 3]);
    fs::write(&path, text(none)).unwrap();
    assert!(message(&path, &mesh).contains("no class for any face"));
}

#[test]
fn lists_that_do_not_fit_are_told() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("net.txt");
    fs::write(&path, "1\n2\n3\n").unwrap();
    let why = message(&path, &mesh);
    assert!(why.contains("3 numbers") && why.contains("3224 faces"), "{why}");
    fs::write(&path, "1\n2\n\n3.5\n").unwrap();
    assert!(message(&path, &mesh).contains("line 4"));

    // As many vertices as faces: a strip around a hole.
    let corners = (0..6u8).map(|i| Vec3::new(f32::from(i % 3), f32::from(i / 3), f32::from(i % 2)));
    let faces = (0..6u32).map(|i| [i, (i + 1) % 6, (i + 2) % 6]);
    let even = TriMesh::from_faces(corners.collect(), faces.collect()).unwrap();
    assert_eq!(even.faces().len(), even.positions().len());
    fs::write(&path, "1\n1\n1\n1\n1\n1\n").unwrap();
    assert!(message(&path, &even).contains("about either"));
    assert!(message(&dir.path().join("gone.npy"), &mesh).contains("gone.npy"));
}

/// The points of the room, with a class and, if wanted, an instance each.
fn cloud(mesh: &TriMesh, points_per_m2: f64, with_instances: bool) -> String {
    cloud_at(mesh, points_per_m2, with_instances, 0.0)
}

/// The same points at another x, metres.
fn cloud_at(mesh: &TriMesh, points_per_m2: f64, with_instances: bool, x: f64) -> String {
    let sampler = SurfaceSampler::new(mesh, Density::PerM2(points_per_m2), 1);
    let mut points = PointCloud::default();
    sampler.sample(0..sampler.len(), &mut points);
    let mut ply = format!("ply\nformat ascii 1.0\nelement vertex {}\n", points.len() + 1);
    let instance = if with_instances { "property int instance\n" } else { "" };
    ply += "property double x\nproperty double y\nproperty double z\nproperty int label\n";
    writeln!(ply, "{instance}end_header").unwrap();
    for (place, face) in points.positions.iter().zip(&points.faces) {
        let [class, number] = class_and_instance(*face as usize);
        let number = if with_instances {
            number.max(0).to_string()
        } else {
            String::new()
        };
        // The output of a network is somewhat off the surface.
        writeln!(ply, "{} {} {} {class} {number}", f64::from(place.x) + x, place.y, place.z + 0.002).unwrap();
    }
    let last = if with_instances { "1 7 4" } else { "1 7" };
    writeln!(ply, "{} 2 {last}", 2.0 + x).unwrap();
    ply
}

#[test]
fn points_vote_for_faces() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("net.ply");
    // 20 points a face of the floor, and fewer points than faces.
    for (points_per_m2, with_instances) in [(4000.0, false), (4000.0, true), (150.0, true)] {
        fs::write(&path, cloud(&mesh, points_per_m2, with_instances)).unwrap();
        let heard = Arc::new(Mutex::new(Vec::new()));
        let list = Arc::clone(&heard);
        let ctx = Context::default().observed_by(move |event: &Event<'_>| {
            if let Event::Message { text, .. } = event {
                list.lock().unwrap().push((*text).to_owned());
            }
        });
        let found = read_proposals(&path, &Target::new(&mesh, &Taxonomy::s3dis()), &ctx).unwrap();
        // One point lies a metre above the floor.
        let heard = heard.lock().unwrap().join("; ");
        assert!(heard.contains("1 of its points are farther than 0.1 m"), "{heard}");
        assert!(!heard.contains(";"), "{heard}");

        if with_instances {
            let [floor, one, other] = room_of("net.ply, instance ");
            assert_eq!(shown(&found), [floor + "1", one + "2", other + "3"]);
        } else {
            assert_eq!(shown(&found), room_of("net.ply"));
        }
    }

    fs::write(&path, cloud(&mesh, 4000.0, false).replace(" 7 \n", " 70 \n")).unwrap();
    let why = message(&path, &mesh);
    assert!(
        why.contains("\"70\"") && why.contains("NAME.classes.json") && !why.contains("[annotations"),
        "{why}"
    );
}

#[test]
fn points_may_have_the_coordinates_of_the_scan() {
    let mesh = room();
    let taxonomy = Taxonomy::s3dis();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("net.ply");
    let target = Target { offset_m: DVec3::X * 450_000.0, ..Target::new(&mesh, &taxonomy) };
    for x in [450_000.0, 0.0] {
        fs::write(&path, cloud_at(&mesh, 4000.0, false, x)).unwrap();
        let found = read_proposals(&path, &target, &Context::default()).unwrap();
        assert_eq!(shown(&found), room_of("net.ply"));
    }
    fs::write(&path, cloud_at(&mesh, 4000.0, false, 90_000.0)).unwrap();
    assert!(read_proposals(&path, &target, &Context::default()).is_err());
}

#[test]
fn outputs_of_labels_are_proposals_again() {
    let mesh = room();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("room.labels");
    let mut labels = LabelFolder::open(&path, &mesh, &Taxonomy::s3dis()).unwrap();
    let parts = [(0..3200, "floor"), (3200..3212, "table"), (3212..3224, "table")];
    for ((faces, class), number) in parts.into_iter().zip(1..) {
        let faces = FaceRuns::of_range(faces);
        let paint = Action::Paint { faces, instance: number, class: Some(class.into()) };
        labels.add(u64::from(number) - 1, paint, None).unwrap();
    }
    labels.write_labels(&mesh).unwrap();

    let segments = segment_faces(&mesh, &SegmentOptions::default());
    let write = |format: OutputFormat| {
        let to = format.usual_place(&path);
        let options = OutputOptions::default();
        write_output(format, &labels, &mesh, &segments, &to, &options, &Context::default()).unwrap()
    };
    // The archive by itself has the names of its classes.
    let archive: Vec<_> = read(&path.join("labels.npz"), &mesh).unwrap();
    let archive = archive.iter().map(|p| (&p.class[..], p.faces.len()));
    assert!(archive.eq([("floor", 3200), ("table", 12), ("table", 12)]));
    for place in [
        path.clone(),
        write(OutputFormat::Ply),
        write(OutputFormat::ScanNet),
        write(OutputFormat::ScanNetPp).join("scans"),
    ] {
        let found = read(&place, &mesh).unwrap();
        let found: Vec<_> = found
            .iter()
            .map(|p| format!("{} {:?}", p.class, p.faces.runs()))
            .collect();
        assert_eq!(found, room_of("").map(|line| line.trim().to_owned()), "{place:?}");
    }
}

/// A floor of 4 × 3 m with a sofa, in colours.
fn furnished(sofa: Vec3) -> TriMesh {
    let mut parts = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 3.0, [40, 30]);
    let floor = parts.positions.len();
    parts.append(cuboid(sofa, sofa + vec3(1.6, 0.8, 0.7)));
    let colors =
        (0..parts.positions.len()).map(|v| [[180, 170, 160], [150, 40, 40]][usize::from(v >= floor)]);
    let colors = colors.collect();
    TriMesh::new(parts).unwrap().with_vertex_colors(colors)
}

#[test]
fn a_detector_proposes_what_it_finds() {
    let seen = furnished(vec3(1.0, 1.2, 0.0));
    let mut points = PointCloud::default();
    let sampler = SurfaceSampler::new(&seen, Density::PerM2(4000.0), 0);
    sampler.sample(0..sampler.len(), &mut points);
    let bbox = Aabb { min: vec3(1.0, 1.2, 0.0), max: vec3(2.6, 2.0, 0.7) };
    let class = CLASSES.iter().position(|class| class.name() == "sofa").unwrap();
    let area = Area {
        number: 1,
        surfels: surfels_of(&points, 0),
        rooms: vec!["office_1".to_owned()],
        elements: vec![Element { class, room: 0, bbox }],
    };
    let area = ParsedArea::new(area, SpaceSource::Parsed);
    let spaces: Vec<_> = area.spaces.iter().collect();
    let model = Model::train(&spaces, &TrainOptions::default(), &Context::default()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("sofas.json");
    model.save(&path).unwrap();

    let mesh = furnished(vec3(2.0, 0.5, 0.0));
    let found = read(&path, &mesh).unwrap();
    let sofas: Vec<_> = found.iter().filter(|proposal| proposal.class == "sofa").collect();
    let best = sofas.first().expect("a sofa");
    assert!(best.source.starts_with("sofas.json, instance"), "{}", best.source);
    let of_sofa = best.faces.iter().filter(|face| *face >= 2400).count();
    assert!(of_sofa >= 10 && 2 * of_sofa > best.faces.len() as usize, "{:?}", best.faces.runs());

    // The file of another version is refused, by name.
    let text = fs::read_to_string(&path).unwrap();
    let at = text.find("\"version\"").unwrap();
    let (head, rest) = text.split_at(at);
    fs::write(&path, format!("{head}{}", rest.replacen('2', "9", 1))).unwrap();
    assert!(message(&path, &mesh).contains("version 9"));
}

/// The first bytes of kinds of files.
static HEADS: [&[u8]; 4] = [b"", b"\x93NUMPY\x01\0", b"PK\x03\x04", b"ply\nformat ascii 1.0\n"];

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn no_file_is_a_panic(
        ending in prop::sample::select(&["txt", "npy", "npz", "ply", "json", "csv", "pcd", "label"][..]),
        head in prop::sample::select(&HEADS[..]),
        rest in prop_oneof![
            prop::collection::vec(any::<u8>(), 0..300),
            "[-0-9.\n eE]{0,200}".prop_map(String::into_bytes),
        ],
        names in prop_oneof![Just(String::new()), "[\\[\\]{}\",:0-9a-z]{0,40}"],
    ) {
        let mesh = TriMesh::new(cuboid(Vec3::ZERO, Vec3::ONE)).unwrap();
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("net").with_extension(ending);
        fs::write(&path, [head, &rest[..]].concat()).unwrap();
        if !names.is_empty() {
            fs::write(dir.path().join("classes.json"), names).unwrap();
        }
        let _ = read(&path, &mesh);
    }

    #[test]
    fn no_damage_of_an_array_is_a_panic(
        numbers in prop::collection::vec(-2..14i32, 12),
        damage in prop::collection::vec((0..400usize, any::<u8>()), 0..4),
        cut in 0..500usize,
        is_archive: bool,
    ) {
        let mesh = TriMesh::new(cuboid(Vec3::ZERO, Vec3::ONE)).unwrap();
        prop_assert_eq!(mesh.faces().len(), 12);
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("net.npz");
        if is_archive {
            npz(&path, &[("class", numbers.clone()), ("instance", numbers)]);
        } else {
            npy(&path, numbers.into_iter());
        }
        let mut bytes = fs::read(&path).unwrap();
        for (place, byte) in damage {
            if let Some(at) = bytes.get_mut(place) {
                *at = byte;
            }
        }
        bytes.truncate(cut.max(100));
        fs::write(&path, bytes).unwrap();
        let _ = read(&path, &mesh);
    }
}
