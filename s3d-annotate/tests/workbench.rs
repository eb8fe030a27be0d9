//! Gestures on a workbench.

use s3d_annotate::labelling::{Error, FaceRuns, Fault, Room, RoomPart};
use s3d_annotate::segments::{SegmentOptions, segment_faces};
use s3d_annotate::workbench::{Gesture, Knife, Patch, Proposal, Proposals, Selection, Workbench};
use s3d_geom::glam::{Vec3, vec3};
use s3d_geom::primitives::{cuboid, grid};
use s3d_geom::{MeshParts, TriMesh};
use s3d_label::Taxonomy;
use tempfile::TempDir;

/// A wall of 4 × 3 m in faces of 10 cm, whose left half is white and whose right half is black, and a box of
/// 12 faces before it.
fn wall_and_box() -> TriMesh {
    let mut parts: MeshParts = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Z * 3.0, [40, 30]);
    parts.append(cuboid(vec3(1.0, -2.0, 0.0), vec3(2.0, -1.0, 0.8)));
    let mesh = TriMesh::new(parts).unwrap();
    let colors = mesh
        .positions()
        .iter()
        .map(|p| if p.x < 2.05 { [255; 3] } else { [0; 3] });
    let colors = colors.collect();
    mesh.with_vertex_colors(colors)
}

const WALL: u32 = 2400;

fn bench(mesh: TriMesh) -> (TempDir, Workbench) {
    let folder = tempfile::tempdir().unwrap();
    let options = SegmentOptions { color: 0.0, ..SegmentOptions::default() };
    let segments = segment_faces(&mesh, &options);
    let path = folder.path().join("scan.labels");
    let bench = Workbench::open(&path, mesh.into(), segments, &Taxonomy::s3dis()).unwrap();
    (folder, bench)
}

/// Performs a gesture on the labels as they are.
fn perform(bench: &mut Workbench, gesture: Gesture) -> Result<u64, Error> {
    let revision = bench.labels().state().revision();
    bench.perform(revision, &gesture, None).map(|change| change.revision)
}

fn patch(bench: &Workbench, face: u32) -> Patch {
    Patch { face, node: bench.segments().segment_of_face[face as usize] }
}

fn label(bench: &mut Workbench, patch: Patch, class: &str) {
    let what = Selection { patches: vec![patch], ..Selection::default() };
    perform(bench, Gesture::Label { what, class: class.into() }).unwrap();
}

fn instance(bench: &Workbench, face: u32) -> u32 {
    bench.labels().state().instance_of_face()[face as usize]
}

/// The middles of the faces of an instance lie in this box of x and z, and nothing else of the wall does.
fn assert_is_part(bench: &Workbench, number: u32, x: [f32; 2], z: [f32; 2]) {
    for face in 0..WALL {
        let middle = bench.mesh().triangle(face).iter().sum::<Vec3>() / 3.0;
        let is_in = (x[0]..x[1]).contains(&middle.x) && (z[0]..z[1]).contains(&middle.z);
        assert_eq!(instance(bench, face) == number, is_in, "face {face} at {middle}");
    }
}

#[test]
fn a_door_is_cut_out_of_a_wall_by_a_box_and_is_a_patch_then() {
    let (_folder, mut bench) = bench(wall_and_box());
    let at = patch(&bench, 0);
    assert_eq!(bench.patch(at).unwrap().len(), WALL);
    label(&mut bench, at, "wall");

    // The person clicks a little off the surface, and not quite in a plane.
    let corners = [vec3(1.0, 0.02, 0.0), vec3(2.0, -0.02, 0.0), vec3(2.0, 0.02, 2.0), vec3(1.0, -0.02, 2.0)];
    let by = Knife::Box { corners };
    perform(&mut bench, Gesture::Cut { at, by, class: Some("door".into()) }).unwrap();
    assert_is_part(&bench, 2, [1.0, 2.0], [0.0, 2.0]);
    assert_eq!(bench.labels().state().instances()[&2], "door");

    // Wall and door are patches of their own, in the same node of the tree.
    let door = (0..WALL).find(|face| instance(&bench, *face) == 2).unwrap();
    assert_eq!(bench.patch(Patch { face: door, node: at.node }).unwrap().len(), 400);
    assert_eq!(bench.patch(at).unwrap().len(), WALL - 400);
}

#[test]
fn a_line_cuts_off_what_is_right_of_it_from_wherever_one_looks() {
    for (eye, x) in [(vec3(2.0, -3.0, 1.5), [1.5, 4.0]), (vec3(2.0, 3.0, 1.5), [0.0, 1.5])] {
        let (_folder, mut bench) = bench(wall_and_box());
        let at = patch(&bench, 0);
        label(&mut bench, at, "wall");
        let by = Knife::Line { eye, from: vec3(1.5, 0.0, 0.5), to: vec3(1.5, 0.0, 2.5) };
        // The part keeps the class of the patch.
        perform(&mut bench, Gesture::Cut { at, by, class: None }).unwrap();
        assert_is_part(&bench, 2, x, [0.0, 3.0]);
        assert_eq!(bench.labels().state().instances()[&2], "wall");
    }
}

#[test]
fn a_colour_cuts_out_what_hangs_together_and_a_brush_what_it_saw_of_the_patch() {
    let (_folder, mut bench) = bench(wall_and_box());
    let black = Patch { face: WALL - 1, node: patch(&bench, 0).node };
    let by = Knife::Color { tolerance: 0.3 };
    // What it would take is told before, and changes nothing.
    let told = bench.cut(black, &by).unwrap();
    assert!(bench.labels().state().instances().is_empty());
    perform(&mut bench, Gesture::Cut { at: black, by, class: Some("board".into()) }).unwrap();
    assert_is_part(&bench, 1, [2.1, 4.0], [0.0, 3.0]);
    assert_eq!(bench.labels().state().faces_of(1), told);

    // Faces of the box and of the board are not of the patch.
    let by = Knife::Faces(FaceRuns::of_range(0..WALL + 12));
    let at = patch(&bench, 0);
    let white = bench.patch(at).unwrap().len();
    perform(&mut bench, Gesture::Cut { at, by, class: Some("wall".into()) }).unwrap();
    assert_eq!(bench.labels().state().size_of(2).0, white);
}

#[test]
fn strokes_add_erase_join_and_are_taken_back() {
    let (_folder, mut bench) = bench(wall_and_box());
    let of_box = |bench: &Workbench| {
        let mut node = patch(bench, WALL).node;
        while bench.segments().tree.segments_of(node).len() < 6 {
            node = bench.segments().tree.parent(node).unwrap();
        }
        Patch { face: WALL, node }
    };

    // A side of the box, and then the rest of it.
    let side = patch(&bench, WALL);
    label(&mut bench, side, "table");
    let rest = Patch { face: WALL + 11, node: of_box(&bench).node };
    let what = Selection { patches: vec![rest], faces: FaceRuns::of_range(0..2) };
    perform(&mut bench, Gesture::Add { what, instance: 1 }).unwrap();
    assert_eq!(bench.labels().state().size_of(1).0, 14);
    let what = Selection { faces: FaceRuns::of_range(0..2), ..Selection::default() };
    perform(&mut bench, Gesture::Erase { what }).unwrap();
    assert_eq!(bench.labels().state().size_of(1).0, 12);

    let wall = patch(&bench, 0);
    label(&mut bench, wall, "wall");
    perform(&mut bench, Gesture::Join { into: 1, instances: vec![2] }).unwrap();
    perform(&mut bench, Gesture::Class { instance: 1, class: "sofa".into() }).unwrap();
    assert_eq!(bench.labels().state().unlabelled().0, 0);
    for _ in 0..6 {
        perform(&mut bench, Gesture::Undo).unwrap();
    }
    assert_eq!(bench.labels().state().unlabelled().0, WALL + 12);
    assert!(perform(&mut bench, Gesture::Undo).is_err());
    perform(&mut bench, Gesture::Redo).unwrap();
    assert_eq!(bench.labels().state().size_of(1).0, 2);
}

#[test]
fn proposals_are_accepted_as_one_step_where_nothing_is_labelled() {
    let (_folder, mut bench) = bench(wall_and_box());
    let proposal = |class: &str, faces| Proposal {
        class: class.into(),
        faces: FaceRuns::of_range(faces),
        room: Some(0),
        source: "structure".into(),
    };
    let outline = vec![[0.0, -3.0], [4.0, -3.0], [4.0, 0.0], [0.0, 0.0]];
    let part = RoomPart { outline, heights: [-0.1, 3.0] };
    let room = Room { parts: vec![part], ..Room::default() };
    bench.propose(Proposals {
        // The second overlaps the first; the third has no face left.
        surfaces: vec![proposal("wall", 0..1000), proposal("window", 900..WALL), proposal("wall", 5..9)],
        rooms: vec![room],
    });
    let what = Selection { faces: FaceRuns::of_range(0..4), ..Selection::default() };
    perform(&mut bench, Gesture::Label { what, class: "clutter".into() }).unwrap();

    perform(&mut bench, Gesture::Accept { surfaces: vec![0, 1, 2], rooms: vec![0] }).unwrap();
    let state = bench.labels().state();
    assert_eq!([1, 2, 3].map(|number| state.size_of(number).0), [4, 996, WALL - 1000]);
    assert_eq!((state.instances().len(), state.rooms().len()), (3, 1));

    // One undo takes all of it back, and no more.
    perform(&mut bench, Gesture::Undo).unwrap();
    let state = bench.labels().state();
    assert_eq!((state.size_of(1).0, state.instances().len(), state.rooms().len()), (4, 1, 0));

    // Both sides of the box at once: an instance each.
    let patches = vec![patch(&bench, WALL), patch(&bench, WALL + 11)];
    perform(&mut bench, Gesture::LabelEach { patches, class: "chair".into() }).unwrap();
    assert_ne!(instance(&bench, WALL), instance(&bench, WALL + 11));
}

#[test]
fn what_does_not_fit_is_refused_and_changes_nothing() {
    let (_folder, mut bench) = bench(wall_and_box());
    let at = patch(&bench, 0);
    let faces = |range| Selection { faces: FaceRuns::of_range(range), ..Selection::default() };
    let of = |face, node| Selection { patches: vec![Patch { face, node }], ..Selection::default() };
    let line = |to: Vec3| Knife::Line { eye: Vec3::ZERO, from: Vec3::X, to };
    let corners = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::X * 3.0];
    let not_finite = [Vec3::ZERO, Vec3::X, Vec3::NAN, Vec3::Z];
    let box_node = patch(&bench, WALL).node;
    let chair = || Some("chair".to_owned());
    for gesture in [
        Gesture::Label { what: of(WALL + 12, 0), class: "chair".into() },
        Gesture::Label { what: of(u32::MAX, u32::MAX), class: "chair".into() },
        Gesture::Label { what: of(0, box_node), class: "chair".into() },
        Gesture::Label { what: faces(0..WALL + 13), class: "chair".into() },
        Gesture::Label { what: faces(0..0), class: "chair".into() },
        Gesture::Label { what: faces(0..9), class: "<b>throne</b>".into() },
        Gesture::LabelEach { patches: vec![], class: "chair".into() },
        Gesture::LabelEach { patches: vec![at], class: "throne".into() },
        Gesture::Cut { at, by: line(Vec3::X * 3.0), class: chair() },
        Gesture::Cut { at, by: line(Vec3::NAN), class: chair() },
        Gesture::Cut { at, by: Knife::Box { corners }, class: chair() },
        Gesture::Cut { at, by: Knife::Box { corners: not_finite }, class: chair() },
        // Nothing is labelled, so there is no class to keep.
        Gesture::Cut { at, by: Knife::Color { tolerance: 0.1 }, class: None },
        Gesture::Cut { at, by: Knife::Color { tolerance: f32::NAN }, class: chair() },
        Gesture::Accept { surfaces: vec![0], rooms: vec![] },
        Gesture::Accept { surfaces: vec![], rooms: vec![3] },
        Gesture::Accept { surfaces: vec![], rooms: vec![] },
        Gesture::Join { into: 1, instances: vec![2] },
        Gesture::SplitRoom { room: 1, line: [[0.0; 2], [1.0; 2]] },
        Gesture::Redo,
    ] {
        let refused = perform(&mut bench, gesture.clone());
        assert!(refused.is_err(), "{gesture:?}");
    }
    assert_eq!(bench.labels().state().revision(), 0);

    let stale = bench.perform(1, &Gesture::Erase { what: faces(0..1) }, None);
    assert!(matches!(stale, Err(Error::Stale { given: 1, now: 0 })));
    let none = perform(&mut bench, Gesture::Undo);
    assert!(matches!(none, Err(Error::Fault(Fault::Nothing { .. }))));
}
