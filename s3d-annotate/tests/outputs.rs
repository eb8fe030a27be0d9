//! Outputs of labels, read back by the readers of `s3d-io`.

use s3d_annotate::labelling::{Action, FaceRuns, LabelFolder, Room as DrawnRoom};
use s3d_annotate::outputs::{OutputFormat, OutputOptions, write_output};
use s3d_annotate::segments::{SegmentOptions, Segments, segment_faces};
use s3d_dataset::Context;
use s3d_geom::glam::Vec3;
use s3d_geom::primitives::grid;
use s3d_geom::{NearestFaces, PointCloud, TriMesh};
use s3d_io::cloud::{AnnotatedMesh, AnnotationOptions, Annotations};
use s3d_io::mesh::{LabelColumn, LabelElement, MeshFile, MeshLabels, UpAxis, read_mesh};
use s3d_label::{Class, LabelId, Labeler, Room, Taxonomy};
use s3d_synth::{AnnotatedScene, Building};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fs;
use std::path::{Path, PathBuf};

/// The built-in scene with its truth as labels. Each test labels it anew.
struct Labelled {
    scene: AnnotatedScene,
    segments: Segments,
    labels: LabelFolder,
    folder: tempfile::TempDir,
}

impl Labelled {
    /// Labels the scene. The folder of labels has the name `name`.
    fn new(name: &str) -> Self {
        let scene = Building { texture_scale: 0.1, ..Building::demo() }.build().unwrap();
        let segments = segment_faces(&scene.mesh, &SegmentOptions::default());
        let memory = Path::new("/dev/shm");
        let folder = if memory.is_dir() {
            tempfile::tempdir_in(memory)
        } else {
            tempfile::tempdir()
        };
        let folder = folder.unwrap();
        let taxonomy = Taxonomy::s3dis();
        let mut labels = LabelFolder::open(&folder.path().join(name), &scene.mesh, &taxonomy).unwrap();

        let mut rooms: BTreeMap<Room, Vec<u32>> = BTreeMap::new();
        let mut instances: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (face, instance) in (0u32..).zip(&scene.instance_of_face) {
            instances.entry(*instance).or_default().push(face);
            rooms
                .entry(scene.instances[*instance as usize].room)
                .or_default()
                .push(face);
        }
        for (instance, faces) in instances {
            let class = Some(scene.instances[instance as usize].class.name().to_owned());
            act(&mut labels, Action::Paint { faces: runs(faces), instance: instance + 1, class });
        }
        for ((room, faces), number) in rooms.into_iter().zip(1..) {
            let kind = Some(room.room_type.name().to_owned());
            act(&mut labels, Action::Room { room: number, is: DrawnRoom { kind, ..DrawnRoom::default() } });
            act(&mut labels, Action::PaintRoom { faces: runs(faces), room: Some(number) });
        }
        Self { scene, segments, labels, folder }
    }

    fn write(&self, format: OutputFormat) -> PathBuf {
        let to = format.usual_place(self.labels.path());
        let options = OutputOptions::default();
        self.write_as(format, &to, &options, &Context::default()).unwrap()
    }

    fn write_as(
        &self,
        format: OutputFormat,
        to: &Path,
        options: &OutputOptions,
        ctx: &Context,
    ) -> s3d_dataset::Result<PathBuf> {
        write_output(format, &self.labels, &self.scene.mesh, &self.segments, to, options, ctx)
    }

    /// The class, the number and, if `by_room`, the room of each face. Numbers count per class, or per class
    /// and room, in the order of instances.
    fn truth(&self, by_room: bool) -> Vec<Found> {
        let mut counts: HashMap<(Class, Option<Room>), u32> = HashMap::new();
        let state = self.labels.state();
        let names = state.room_names();
        let taxonomy = Taxonomy::s3dis();
        let room = |face: usize| {
            let painted = state.painted_room_of_face()[face];
            by_room.then(|| taxonomy.room(&names[&painted]).unwrap())
        };
        let mut known: BTreeMap<u32, Found> = BTreeMap::new();
        for (number, class) in state.instances() {
            let Some(face) = state.instance_of_face().iter().position(|i| i == number) else { continue };
            let (class, room) = (taxonomy.class(class).unwrap(), room(face));
            let count = counts.entry((class, room)).or_default();
            *count += 1;
            known.insert(*number, (class, *count, room));
        }
        state.instance_of_face().iter().map(|i| known[i]).collect()
    }

    /// Whether each face shares no corner with another instance.
    fn is_inside(&self) -> Vec<bool> {
        let mesh = &self.scene.mesh;
        let mut at: HashMap<[u32; 3], BTreeSet<u32>> = HashMap::new();
        let corners = |face: u32| mesh.triangle(face).map(|p| (p + 0.0).to_array().map(f32::to_bits));
        for (face, instance) in (0u32..).zip(&self.scene.instance_of_face) {
            for corner in corners(face) {
                at.entry(corner).or_default().insert(*instance);
            }
        }
        (0..mesh.faces().len() as u32)
            .map(|face| corners(face).iter().all(|corner| at[corner].len() == 1))
            .collect()
    }

    /// Asserts that 99.9 % of the surface away from borders has its truth, and as many of the faces there
    /// that have a label: small ones may have no point. Most of the surface must be away from borders.
    fn assert_same(&self, found: &[Option<Found>], truth: &[Found]) {
        let mesh = &self.scene.mesh;
        let [mut inside_m2, mut same_m2, mut faces, mut same] = [0.0; 4];
        for (face, is_inside) in (0u32..).zip(self.is_inside()) {
            let is_same = found[face as usize] == Some(truth[face as usize]);
            if is_inside {
                inside_m2 += mesh.area(face);
                faces += f64::from(u8::from(found[face as usize].is_some()));
            }
            if is_inside && is_same {
                same_m2 += mesh.area(face);
                same += 1.0;
            }
        }
        let share = inside_m2 / mesh.total_area();
        assert!(share > 0.5 && faces > 1000.0, "{share} of the surface, {faces} faces");
        assert!(same_m2 >= 0.999 * inside_m2, "{same_m2} of {inside_m2} m²");
        assert!(same >= 0.999 * faces, "{same} of {faces} faces");
    }
}

type Found = (Class, u32, Option<Room>);

fn runs(faces: Vec<u32>) -> FaceRuns {
    faces.into_iter().collect()
}

fn act(labels: &mut LabelFolder, action: Action) {
    labels.add(labels.state().revision(), action, None).unwrap();
}

/// Reads annotations for a mesh, and lets their points vote for its faces, as an export does.
fn read_back(path: &Path, mesh: &TriMesh, options: &AnnotationOptions, by_room: bool) -> Vec<Option<Found>> {
    let file = MeshFile::in_memory("mesh", mesh.clone());
    let annotated = AnnotatedMesh { file: &file, up: UpAxis::Z, units: None, outside_files: false };
    let found = Annotations::open_for(&annotated, &[path.to_owned()], options).unwrap();
    assert_eq!(found.warnings, [""; 0]);

    let nearest = NearestFaces::new(mesh);
    let mut labeler = Labeler::new(&nearest);
    let mut all = vec![None];
    for room in &found.rooms {
        for instance in &room.instances {
            let label = LabelId(all.len() as u32);
            all.push(Some((instance.class, instance.number, by_room.then_some(room.room))));
            let mut points = PointCloud::default();
            instance.read(&mut points).unwrap();
            if instance.are_vertices() {
                labeler.add_vertices(&points.positions, label).unwrap();
            } else if points.faces.len() == points.len() {
                labeler.add_points_on_faces(&points.faces, label).unwrap();
            } else {
                labeler.add_points(&points.positions, label).unwrap();
            }
        }
    }
    let labels = labeler.finish();
    labels
        .label_of_face()
        .iter()
        .map(|label| all[label.0 as usize])
        .collect()
}

fn in_one_room() -> AnnotationOptions {
    let room = Some(Taxonomy::s3dis().room("office_1").unwrap());
    AnnotationOptions { room, ..AnnotationOptions::default() }
}

/// The files below a folder, with their bytes.
fn contents(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                all.insert(path.strip_prefix(dir).unwrap().to_owned(), fs::read(&path).unwrap());
            }
        }
    }
    all
}

#[test]
fn a_mesh_has_the_labels_of_every_face() {
    let labelled = Labelled::new("demo.labels");
    let path = labelled.write(OutputFormat::Ply);
    assert_eq!(path, labelled.folder.path().join("demo_labelled.ply"));

    // The numbers of S3DIS's loaders, and the permanent numbers.
    let file = read_mesh(&path, UpAxis::Z).unwrap();
    assert_eq!(file.mesh.positions(), labelled.scene.mesh.positions());
    assert_eq!(file.mesh.faces(), labelled.scene.mesh.faces());
    assert_eq!(file.mesh.parts().colors.len(), file.mesh.positions().len());
    let Some(MeshLabels::Numbers { element, class: Some(class), instance: Some(instance) }) = file.labels
    else {
        panic!("{:?}", file.warnings)
    };
    let of_face = labelled.scene.instance_of_face.iter();
    let number = |i: &u32| labelled.scene.instances[*i as usize].class.index() as i64;
    let numbers: Vec<i64> = of_face.clone().map(number).collect();
    assert_eq!((element, class), (LabelElement::Face, LabelColumn { name: "class".into(), values: numbers }));
    let numbers: Vec<i64> = of_face.map(|i| i64::from(*i) + 1).collect();
    assert_eq!(instance, LabelColumn { name: "instance".into(), values: numbers });

    let classes = Class::S3DIS
        .iter()
        .map(|class| (class.index().to_string(), Some(*class)));
    let options = AnnotationOptions { classes: classes.collect(), ..in_one_room() };
    let found = read_back(&path, &labelled.scene.mesh, &options, false);
    let truth: Vec<Option<Found>> = labelled.truth(false).into_iter().map(Some).collect();
    assert!(found == truth);

    let header = fs::read(&path).unwrap();
    let header = String::from_utf8_lossy(&header[..20_000]).into_owned();
    for line in ["comment class 8 chair\n", "comment room 1 ", "comment instance 1 ", "property int room\n"] {
        assert!(header.contains(line), "{line}");
    }
}

#[test]
fn faces_without_labels_are_minus_one() {
    let mut labelled = Labelled::new("demo.labels");
    act(&mut labelled.labels, Action::Erase { faces: FaceRuns::of_range(0..3) });
    act(&mut labelled.labels, Action::PaintRoom { faces: FaceRuns::of_range(0..2), room: None });
    let path = labelled.write(OutputFormat::Ply);
    let file = read_mesh(&path, UpAxis::Z).unwrap();
    let Some(MeshLabels::Numbers { class: Some(class), instance: Some(instance), .. }) = file.labels else {
        panic!("{:?}", file.warnings)
    };
    assert_eq!([&class.values[..3], &instance.values[..3]], [[-1; 3]; 2]);
    assert!(class.values[3] >= 0 && instance.values[3] > 0);
}

#[test]
fn a_scan_of_scannet_reads_back_with_the_same_objects() {
    let labelled = Labelled::new("scene0000_00.labels");
    let path = labelled.write(OutputFormat::ScanNet);
    let found = read_back(&path, &labelled.scene.mesh, &in_one_room(), false);
    labelled.assert_same(&found, &labelled.truth(false));

    // Every object is a union of segments, and no segment has two.
    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(path.join(name)).unwrap()).unwrap()
    };
    let segments = read("scene0000_00_vh_clean_2.0.010000.segs.json");
    let indices = segments["segIndices"].as_array().unwrap();
    assert_eq!(indices.len(), labelled.scene.mesh.positions().len());
    let used: BTreeSet<u64> = indices.iter().map(|index| index.as_u64().unwrap()).collect();
    let objects = read("scene0000_00.aggregation.json");
    let groups = objects["segGroups"].as_array().unwrap();
    let members = groups.iter().flat_map(|group| group["segments"].as_array().unwrap());
    let members: Vec<u64> = members.map(|segment| segment.as_u64().unwrap()).collect();
    let different: BTreeSet<u64> = members.iter().copied().collect();
    assert_eq!((different.len(), different.is_subset(&used)), (members.len(), true));
    assert!(
        groups
            .iter()
            .zip(0..)
            .all(|(group, n)| group["objectId"] == n && group["id"] == n)
    );
}

#[test]
fn a_scan_of_scannetpp_reads_back_with_the_same_objects() {
    let labelled = Labelled::new("0a5c013435.labels");
    let path = labelled.write(OutputFormat::ScanNetPp);
    let found = read_back(&path.join("scans"), &labelled.scene.mesh, &in_one_room(), false);
    labelled.assert_same(&found, &labelled.truth(false));

    let read = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(path.join("scans").join(name)).unwrap()).unwrap()
    };
    // The toolkit takes the segments of an object as vertices.
    let segments = read("segments.json");
    assert!(
        segments["segIndices"]
            .as_array()
            .unwrap()
            .iter()
            .zip(0..)
            .all(|(index, n)| *index == n)
    );
    let objects = read("segments_anno.json");
    for (group, number) in objects["segGroups"].as_array().unwrap().iter().zip(1..) {
        assert_eq!([&group["id"], &group["objectId"]], [number, number]);
        let bounds = &group["obb"];
        let side = |key: &str, axis: usize| bounds[key][axis].as_f64().unwrap();
        for axis in 0..3 {
            let [low, high] = [side("min", axis), side("max", axis)];
            assert!((side("axesLengths", axis) - (high - low)).abs() < 1e-4);
            assert!((side("centroid", axis) - (high + low) / 2.0).abs() < 1e-4);
        }
    }
}

#[test]
fn the_tree_of_s3dis_reads_back_with_the_same_instances_of_rooms() {
    let labelled = Labelled::new("demo.labels");
    let path = labelled.write(OutputFormat::S3dis);
    let found = read_back(&path.join("Area_1"), &labelled.scene.mesh, &AnnotationOptions::default(), true);
    labelled.assert_same(&found, &labelled.truth(true));

    // About 2,500 points a m².
    let rooms = fs::read_dir(path.join("Area_1"))
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let files = rooms.filter(|room| room.is_dir()).map(|room| {
        let name = room.file_name().unwrap().to_str().unwrap().to_owned();
        fs::read_to_string(room.join(name + ".txt")).unwrap()
    });
    let points: usize = files.map(|file| file.lines().count()).sum();
    let wanted = 2500.0 * labelled.scene.mesh.total_area();
    assert!((points as f64 / wanted - 1.0).abs() < 0.001, "{points} points, {wanted} wanted");
    assert!(path.join("Area_1/Area_1_alignmentAngle.txt").is_file());
}

#[test]
fn surface_without_label_or_room_is_left_out_of_the_tree_with_a_warning() {
    let mut labelled = Labelled::new("demo.labels");
    act(&mut labelled.labels, Action::Erase { faces: FaceRuns::of_range(0..100) });
    act(&mut labelled.labels, Action::RemoveRoom { room: 1 });
    let ctx = Context::default();
    let to = labelled.folder.path().join("tree");
    labelled
        .write_as(OutputFormat::S3dis, &to, &OutputOptions::default(), &ctx)
        .unwrap();
    assert_eq!(ctx.warnings(), 2);

    // Without any room there is no tree, and nothing is left of it.
    for room in labelled.labels.state().rooms().clone().into_keys() {
        act(&mut labelled.labels, Action::RemoveRoom { room });
    }
    let to = labelled.folder.path().join("none");
    let error = labelled
        .write_as(OutputFormat::S3dis, &to, &OutputOptions::default(), &ctx)
        .unwrap_err();
    assert!(error.to_string().contains("draw the rooms"), "{error}");
    assert!(!to.exists());
}

#[test]
fn nothing_labelled_and_another_mesh_are_told() {
    let mut labelled = Labelled::new("demo.labels");
    let faces = labelled.scene.mesh.faces().len() as u32;
    act(&mut labelled.labels, Action::Erase { faces: FaceRuns::of_range(0..faces) });
    let other = TriMesh::from_faces(
        labelled.scene.mesh.positions().to_vec(),
        labelled.scene.mesh.faces()[1..].to_vec(),
    )
    .unwrap();
    for format in OutputFormat::ALL {
        let to = format.usual_place(labelled.labels.path());
        let options = OutputOptions::default();
        let ctx = Context::default();
        let error = labelled.write_as(format, &to, &options, &ctx).unwrap_err();
        assert!(error.to_string().contains("label some surface first"), "{error}");
        let error = write_output(format, &labelled.labels, &other, &labelled.segments, &to, &options, &ctx);
        assert!(error.unwrap_err().to_string().contains("another mesh"));
        assert!(!to.exists());
    }
}

#[test]
fn an_output_is_replaced_on_demand_alone_and_has_the_same_bytes() {
    let labelled = Labelled::new("demo.labels");
    let ctx = Context::default();
    for format in OutputFormat::ALL {
        let to = labelled.folder.path().join("outputs").join(format!("{format}.ply"));
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        let once = OutputOptions { points_per_m2: 50.0, ..OutputOptions::default() };
        labelled.write_as(format, &to, &once, &ctx).unwrap();
        let before = contents(to.parent().unwrap());
        assert!(labelled.write_as(format, &to, &once, &ctx).is_err());

        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
        let again = OutputOptions { overwrite: true, ..once };
        pool.install(|| labelled.write_as(format, &to, &again, &ctx)).unwrap();
        assert!(contents(to.parent().unwrap()) == before, "{format}");
    }

    // A folder of something else is never replaced.
    let foreign = labelled.folder.path().join("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.txt"), "work").unwrap();
    let all = OutputOptions { overwrite: true, ..OutputOptions::default() };
    assert!(labelled.write_as(OutputFormat::ScanNet, &foreign, &all, &ctx).is_err());
    assert!(foreign.join("thesis.txt").exists());
}

#[test]
fn names_with_odd_characters_are_no_trouble() {
    let labelled = Labelled::new("Büro 3. Stock (neu) #2.labels");
    for (format, below) in
        [(OutputFormat::ScanNet, ""), (OutputFormat::ScanNetPp, "scans"), (OutputFormat::S3dis, "Area_1")]
    {
        let path = labelled.write(format);
        assert!(path.to_str().unwrap().contains("Büro 3. Stock (neu) #2"), "{path:?}");
        let is_tree = format == OutputFormat::S3dis;
        let options = if is_tree {
            AnnotationOptions::default()
        } else {
            in_one_room()
        };
        let found = read_back(&path.join(below), &labelled.scene.mesh, &options, is_tree);
        labelled.assert_same(&found, &labelled.truth(is_tree));
    }
    assert!(read_mesh(&labelled.write(OutputFormat::Ply), UpAxis::Z).is_ok());
}

#[test]
fn words_of_another_taxonomy_stay_in_the_output_and_lead_nowhere_else() {
    let mut labelled = Labelled::new("demo.labels");
    let path = labelled.labels.path().to_owned();
    let instance = labelled.labels.state().next_instance();
    let word = "../../stairs\n: up";
    let line = serde_json::json!({"v": 1, "n": labelled.labels.state().revision() + 1,
        "do": {"paint": {"faces": [0, 50], "instance": instance, "class": word}}});
    let log = labelled.labels.log().to_owned();
    drop(std::mem::replace(
        &mut labelled.labels,
        LabelFolder::open(&path.with_extension("other"), &labelled.scene.mesh, &Taxonomy::s3dis()).unwrap(),
    ));
    let mut text = fs::read_to_string(&log).unwrap();
    text += &format!("{line}\n");
    fs::write(&log, text).unwrap();
    labelled.labels = LabelFolder::open(&path, &labelled.scene.mesh, &Taxonomy::s3dis()).unwrap();

    let ply = labelled.write(OutputFormat::Ply);
    let Some(MeshLabels::Numbers { class: Some(class), .. }) = read_mesh(&ply, UpAxis::Z).unwrap().labels
    else {
        panic!()
    };
    assert_eq!(class.values[..50], [13; 50]);
    let tree = labelled.write(OutputFormat::S3dis);
    let files = contents(&tree);
    let odd: Vec<_> = files
        .keys()
        .filter(|path| path.to_str().unwrap().contains("stairs"))
        .collect();
    assert!(!odd.is_empty() && odd.iter().all(|path| path.starts_with("Area_1")), "{odd:?}");
    labelled.write(OutputFormat::ScanNet);
    labelled.write(OutputFormat::ScanNetPp);
}

/// A floor of 40 × 40 squares with an instance on each side and bare surface between them. A face of the
/// first is one of its own. All of it is one segment.
fn cut_floor(folder: &Path) -> (TriMesh, Segments, LabelFolder) {
    let mesh = TriMesh::new(grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Y * 4.0, [40, 40])).unwrap();
    let segments = segment_faces(&mesh, &SegmentOptions::default());
    assert_eq!(segments.tree.leaf_count(), 1);
    let mut labels = LabelFolder::open(&folder.join("floor.labels"), &mesh, &Taxonomy::s3dis()).unwrap();
    for (faces, class) in [(0..1000, "floor"), (2000..3200, "table"), (401..402, "chair")] {
        let instance = labels.state().next_instance();
        let faces = FaceRuns::of_range(faces);
        act(&mut labels, Action::Paint { faces, instance, class: Some(class.into()) });
    }
    (mesh, segments, labels)
}

#[test]
fn an_instance_may_end_within_a_segment_and_one_without_a_vertex_is_left_out() {
    let dir = tempfile::tempdir().unwrap();
    let (mesh, segments, labels) = cut_floor(dir.path());
    let options = OutputOptions::default();
    for (format, below) in [(OutputFormat::ScanNet, ""), (OutputFormat::ScanNetPp, "scans")] {
        let ctx = Context::default();
        let to = dir.path().join(format.name());
        write_output(format, &labels, &mesh, &segments, &to, &options, &ctx).unwrap();
        // A triangle within a floor has the smaller area at each corner.
        assert_eq!(ctx.warnings(), 1);

        let found = read_back(&to.join(below), &mesh, &in_one_room(), false);
        let of = |face: usize| found[face].map(|(class, number, _)| (class, number));
        // Faces along a cut may be on either side.
        assert!((0..900).all(|face| of(face) == Some((Class::FLOOR, 1))));
        assert!((1100..1900).all(|face| of(face).is_none()));
        assert!((2100..3200).all(|face| of(face) == Some((Class::TABLE, 1))));
    }

    // The points have it.
    let mut labels = labels;
    let office = DrawnRoom { kind: Some("office".into()), ..DrawnRoom::default() };
    act(&mut labels, Action::Room { room: 1, is: office });
    act(&mut labels, Action::PaintRoom { faces: FaceRuns::of_range(0..3200), room: Some(1) });
    let to = dir.path().join("tree");
    let ctx = Context::default();
    let sparse = OutputOptions { points_per_m2: 1.0, ..options };
    write_output(OutputFormat::S3dis, &labels, &mesh, &segments, &to, &sparse, &ctx).unwrap();
    let chair = fs::read_to_string(to.join("Area_1/office_1/Annotations/chair_1.txt")).unwrap();
    assert_eq!(chair.lines().count(), 1);

    for points_per_m2 in [0.0, -1.0, f64::NAN, 1e12] {
        let to = dir.path().join("none");
        let odd = OutputOptions { points_per_m2, ..options };
        let error = write_output(OutputFormat::S3dis, &labels, &mesh, &segments, &to, &odd, &ctx);
        assert!(error.unwrap_err().to_string().contains("density") && !to.exists());
    }
    let inside = labels.path().join("output");
    let error = write_output(OutputFormat::S3dis, &labels, &mesh, &segments, &inside, &options, &ctx);
    assert!(error.unwrap_err().to_string().contains("another place"));
    let wrong = dir.path().join("floor.obj");
    let error = write_output(OutputFormat::Ply, &labels, &mesh, &segments, &wrong, &options, &ctx);
    assert!(error.unwrap_err().to_string().contains(".ply"));
}

#[test]
fn words_of_formats_are_read_and_shown() {
    for format in OutputFormat::ALL {
        assert_eq!(format.to_string().parse(), Ok(format));
        assert_eq!(serde_json::to_value(format).unwrap(), format.name());
    }
    assert!(
        "obj"
            .parse::<OutputFormat>()
            .unwrap_err()
            .to_string()
            .contains("scannetpp")
    );
}
