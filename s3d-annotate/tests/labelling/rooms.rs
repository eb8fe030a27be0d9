//! Rooms on the plan.

use super::{act, faces, strip};
use s3d_annotate::labelling::{Action, Fault, Room, RoomPart, State};

fn part(x: [f64; 2], y: [f64; 2], heights: [f64; 2]) -> RoomPart {
    RoomPart { outline: vec![[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]], heights }
}

fn room(parts: Vec<RoomPart>) -> Room {
    Room { kind: Some("office".into()), name: None, parts }
}

#[test]
fn a_room_is_split_by_a_line_and_joined_again() {
    let mesh = strip(6, 1, 0.0);
    let mut state = State::of_mesh(&mesh);
    let all = room(vec![part([0.0, 6.0], [0.0, 1.0], [0.0, 2.5])]);
    act(&mut state, Action::Room { room: 1, is: all.clone() }).unwrap();
    assert_eq!(state.room_of_face(&mesh), [1; 12]);

    // Up along x = 4: what is left of the line stays.
    let line = [[4.0, 0.0], [4.0, 1.0]];
    act(&mut state, Action::SplitRoom { room: 1, new: 2, line }).unwrap();
    assert_eq!(state.room_of_face(&mesh), [1, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2]);
    assert_eq!(state.room_names().into_values().collect::<Vec<_>>(), ["office_1", "office_2"]);
    let outside = Action::SplitRoom { room: 1, new: 3, line };
    assert!(matches!(state.check(&outside), Err(Fault::Nothing { .. })));
    let point = Action::SplitRoom { room: 1, new: 3, line: [[1.0, 1.0]; 2] };
    assert_eq!(state.check(&point), Err(Fault::Line));

    act(&mut state, Action::PaintRoom { faces: faces(&[0, 1]), room: Some(2) }).unwrap();
    assert_eq!(state.room_of_face(&mesh)[..4], [2, 2, 1, 1]);
    act(&mut state, Action::JoinRooms { into: 1, rooms: vec![2] }).unwrap();
    assert_eq!(state.room_of_face(&mesh), [1; 12]);
    assert_eq!(state.rooms()[&1].parts.len(), 2);
    for of in [4, 3, 2] {
        act(&mut state, Action::Undo { of }).unwrap();
    }
    assert_eq!(state.rooms()[&1], all);
    // The number 2 was given.
    assert_eq!(state.next_room(), 3);
}

#[test]
fn a_room_that_is_not_convex_keeps_its_area_when_it_is_split() {
    // A U whose two arms are right of the line.
    let outline =
        vec![[0.0, 0.0], [4.0, 0.0], [4.0, 1.0], [1.0, 1.0], [1.0, 2.0], [4.0, 2.0], [4.0, 3.0], [0.0, 3.0]];
    let mut state = State::of_mesh(&strip(4, 3, 0.0));
    let is = room(vec![RoomPart { outline, heights: [-1.0, 1.0] }]);
    act(&mut state, Action::Room { room: 1, is }).unwrap();
    act(&mut state, Action::SplitRoom { room: 1, new: 2, line: [[2.0, 0.0], [2.0, 1.0]] }).unwrap();
    let area = |room: u32| -> f64 {
        let corners = &state.rooms()[&room].parts[0].outline;
        let edges = corners.iter().zip(corners.iter().cycle().skip(1));
        (edges.map(|([a, b], [c, d])| a * d - b * c).sum::<f64>() / 2.0).abs()
    };
    assert_eq!((area(1), area(2)), (5.0, 4.0));
}

#[test]
fn storeys_are_told_apart_and_walls_belong_to_the_nearest_room() {
    let mut state = State::of_mesh(&strip(2, 1, 0.0));
    for (number, heights) in [(1, [0.0, 2.6]), (2, [3.0, 5.6])] {
        let is = room(vec![part([0.0, 2.0], [0.0, 1.0], heights)]);
        act(&mut state, Action::Room { room: number, is }).unwrap();
    }
    for (z, expected) in [(0.0, 1), (-0.2, 1), (2.7, 1), (2.85, 2), (3.0, 2), (5.7, 2), (6.0, 0), (-0.3, 0)] {
        assert_eq!(state.room_of_face(&strip(2, 1, z)), [expected; 4], "{z}");
    }
}
