//! Labels that are carried over to another mesh.

use super::{act, faces, paint, strip};
use s3d_annotate::labelling::{Action, Room, RoomPart, State, carry_over};

/// A strip of 6 m²: a floor, a chair on the third metre, nothing on the last one.
fn labelled() -> State {
    let mut state = State::of_mesh(&strip(6, 1, 0.0));
    act(&mut state, paint(&[0, 1, 2, 3, 6, 7, 8, 9], 4, "floor")).unwrap();
    act(&mut state, paint(&[4, 5], 9, "chair")).unwrap();
    let outline = vec![[0.0, 0.0], [6.0, 0.0], [6.0, 1.0], [0.0, 1.0]];
    let parts = vec![RoomPart { outline, heights: [0.0, 2.0] }];
    act(&mut state, Action::Room { room: 2, is: Room { parts, ..Room::default() } }).unwrap();
    act(&mut state, Action::PaintRoom { faces: faces(&[11]), room: Some(2) }).unwrap();
    state
}

#[test]
fn a_mesh_of_other_faces_has_the_same_labels() {
    // Finer faces, 3 cm away.
    let to = strip(6, 8, 0.03);
    let carried = carry_over(&strip(6, 1, 0.0), &labelled(), &to);
    let mut state = State::of_mesh(&to);
    for action in carried.actions {
        act(&mut state, action).unwrap();
    }
    for face in 0..96 {
        let expected = [4, 4, 9, 4, 4, 0][face as usize / 16];
        assert_eq!(state.instance_of_face()[face as usize], expected, "{face}");
    }
    assert_eq!(state.instances()[&9], "chair");
    assert_eq!(state.rooms(), labelled().rooms());
    let report = carried.report;
    assert!((report.carried_m2 - 5.0).abs() < 1e-6 && (report.unlabelled_m2 - 1.0).abs() < 1e-6);
    assert!(report.disputed.iter().all(|face| face / 16 == 5), "{report:?}");
    assert!(report.lost.is_empty());

    // The upper half of the last square was painted for the room; a face on the diagonal may be on either.
    let painted = state.painted_room_of_face();
    assert!(painted[..80].iter().all(|room| *room == 0) && painted[80..].contains(&2));
}

#[test]
fn what_is_far_or_coarse_is_told() {
    // Far from the old surface there is no label.
    let from = strip(6, 1, 0.0);
    let far = carry_over(&from, &labelled(), &strip(6, 1, 0.2));
    assert_eq!((far.report.carried_m2, far.report.lost), (0.0, vec![4, 9]));
    assert_eq!(far.actions.len(), 1);

    // One face over three metres: two thirds of it are floor.
    let corners = [[0.0, 0.0], [6.0, 0.0], [0.0, 1.0]].map(|[x, y]| s3d_geom::glam::vec3(x, y, 0.0));
    let coarse = s3d_geom::TriMesh::from_faces(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
    let found = carry_over(&from, &labelled(), &coarse).report;
    assert_eq!((found.lost, found.carried_m2), (vec![9], 3.0));
}

#[test]
fn small_faces_take_the_nearest_label() {
    // So many small faces that samples do not meet each of them.
    let to = strip(6, 3000, 0.001);
    let found = carry_over(&strip(6, 1, 0.0), &labelled(), &to).report;
    assert!((found.carried_m2 - 5.0).abs() < 1e-3, "{found:?}");
}
