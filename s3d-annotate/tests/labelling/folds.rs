//! A state is what the actions in effect add up to, whatever was taken back in between.

use super::{act, faces, labels, paint};
use proptest::prelude::*;
use s3d_annotate::labelling::{Action, Event, FaceRuns, Fault, MAX_NUMBER, Room, RoomPart, State};
use std::collections::BTreeMap;

const FACES: u32 = 24;
const CLASSES: [&str; 3] = ["chair", "table", "wall"];

/// Areas that no binary fraction holds.
fn empty() -> State {
    State::new((0..FACES).map(|face| 0.1 + f64::from(face) / 7.0))
}

fn some_faces() -> impl Strategy<Value = FaceRuns> {
    prop::collection::vec(0..FACES, 0..9).prop_map(FaceRuns::from_iter)
}

fn square(at: f64) -> RoomPart {
    RoomPart { outline: vec![[at, 0.0], [at + 2.0, 0.0], [at + 2.0, 3.0], [at, 3.0]], heights: [0.0, 2.5] }
}

/// Any action, with numbers that may be new, old or unknown. The numbers of undo and redo are put in later.
fn any_action() -> impl Strategy<Value = Action> {
    let number = || 1u32..9;
    let class = || prop::sample::select(&CLASSES[..]).prop_map(str::to_owned);
    let numbers = || prop::collection::vec(1u32..9, 0..3);
    prop_oneof![
        6 => (some_faces(), number(), prop::option::of(class()))
            .prop_map(|(faces, instance, class)| Action::Paint { faces, instance, class }),
        2 => some_faces().prop_map(|faces| Action::Erase { faces }),
        2 => (number(), numbers()).prop_map(|(into, instances)| Action::Join { into, instances }),
        2 => (number(), some_faces(), number())
            .prop_map(|(instance, faces, new)| Action::Cut { instance, faces, new }),
        1 => (number(), class()).prop_map(|(instance, class)| Action::Class { instance, class }),
        2 => (number(), prop::option::of(Just("office".to_owned())), 0u8..4).prop_map(|(room, kind, at)| {
            Action::Room { room, is: Room { kind, name: None, parts: vec![square(f64::from(at))] } }
        }),
        1 => (number(), number(), 0.0f64..5.0).prop_map(|(room, new, x)| {
            Action::SplitRoom { room, new, line: [[x, 0.0], [x + 0.5, 1.0]] }
        }),
        1 => (number(), numbers()).prop_map(|(into, rooms)| Action::JoinRooms { into, rooms }),
        1 => number().prop_map(|room| Action::RemoveRoom { room }),
        2 => (some_faces(), prop::option::of(number()))
            .prop_map(|(faces, room)| Action::PaintRoom { faces, room }),
        2 => prop::collection::vec((some_faces(), class()), 0..4).prop_map(|all| Action::All {
            actions: all
                .into_iter()
                .map(|(faces, class)| Action::Paint { faces, instance: 0, class: Some(class) })
                .collect(),
        }),
        5 => Just(Action::Undo { of: 0 }),
        3 => Just(Action::Redo { of: 0 }),
    ]
}

/// New instances and rooms get numbers that nobody had, so that most actions fit.
fn with_free_numbers(state: &State, action: Action) -> Action {
    match action {
        Action::Paint { faces, class: Some(class), .. } => {
            Action::Paint { faces, instance: state.next_instance(), class: Some(class) }
        }
        Action::All { mut actions } => {
            for (action, free) in actions.iter_mut().zip(state.next_instance()..) {
                if let Action::Paint { instance, .. } = action {
                    *instance = free;
                }
            }
            Action::All { actions }
        }
        Action::Cut { instance, faces, .. } => Action::Cut { instance, faces, new: state.next_instance() },
        Action::SplitRoom { room, line, .. } => Action::SplitRoom { room, new: state.next_room(), line },
        Action::Room { room, is } if !state.rooms().contains_key(&room) => {
            Action::Room { room: state.next_room(), is }
        }
        Action::Undo { .. } => Action::Undo { of: state.next_undo().unwrap_or(0) },
        Action::Redo { .. } => Action::Redo { of: state.next_redo().unwrap_or(0) },
        other => other,
    }
}

/// The instances, and the rooms that were painted, written down in the plainest way.
#[derive(Debug, Default, PartialEq)]
struct Plain {
    instance: Vec<u32>,
    room: Vec<u32>,
    classes: BTreeMap<u32, String>,
}

impl Plain {
    fn of(actions: &[Action]) -> Self {
        let zeros = vec![0; FACES as usize];
        let mut plain = Self { instance: zeros.clone(), room: zeros, classes: BTreeMap::new() };
        actions.iter().for_each(|action| plain.act(action));
        plain
    }

    fn act(&mut self, action: &Action) {
        let give = |column: &mut Vec<u32>, from: u32, to: u32| {
            column.iter_mut().filter(|n| **n == from).for_each(|n| *n = to);
        };
        match action {
            Action::Paint { faces, instance, class } => {
                faces.iter().for_each(|f| self.instance[f as usize] = *instance);
                self.classes.extend(class.clone().map(|class| (*instance, class)));
            }
            Action::Erase { faces } => faces.iter().for_each(|f| self.instance[f as usize] = 0),
            Action::Join { into, instances } => {
                for instance in instances {
                    give(&mut self.instance, *instance, *into);
                    self.classes.remove(instance);
                }
            }
            Action::Cut { instance, faces, new } => {
                let of = faces.iter().filter(|f| self.instance[*f as usize] == *instance);
                for face in of.collect::<Vec<_>>() {
                    self.instance[face as usize] = *new;
                }
                self.classes.insert(*new, self.classes[instance].clone());
            }
            Action::Class { instance, class } => drop(self.classes.insert(*instance, class.clone())),
            Action::JoinRooms { into, rooms } => {
                rooms.iter().for_each(|room| give(&mut self.room, *room, *into));
            }
            Action::RemoveRoom { room } => give(&mut self.room, *room, 0),
            Action::PaintRoom { faces, room } => {
                faces.iter().for_each(|f| self.room[f as usize] = room.unwrap_or(0));
            }
            Action::Room { .. } | Action::SplitRoom { .. } => {}
            Action::All { actions } => actions.iter().for_each(|action| self.act(action)),
            Action::Undo { .. } | Action::Redo { .. } => panic!("they are not in effect"),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(512))]

    #[test]
    fn undone_actions_leave_no_trace(actions in prop::collection::vec(any_action(), 1..60)) {
        let mut state = empty();
        let mut log = Vec::new();
        let mut in_effect: Vec<Action> = Vec::new();
        let mut undone: Vec<Action> = Vec::new();
        for action in actions {
            let action = with_free_numbers(&state, action);
            let before = labels(&state);
            if act(&mut state, action.clone()).is_err() {
                prop_assert_eq!(labels(&state), before);
                continue;
            }
            log.push(action.clone());
            match action {
                Action::Undo { .. } => undone.push(in_effect.pop().unwrap()),
                Action::Redo { .. } => in_effect.push(undone.pop().unwrap()),
                action => {
                    undone.clear();
                    in_effect.push(action);
                }
            }
        }

        let mut replayed = empty();
        for action in &in_effect {
            act(&mut replayed, action.clone()).unwrap();
        }
        prop_assert_eq!(labels(&state), labels(&replayed));

        let plain = Plain::of(&in_effect);
        prop_assert_eq!(state.instance_of_face(), &plain.instance[..]);
        prop_assert_eq!(state.painted_room_of_face(), &plain.room[..]);
        prop_assert_eq!(state.instances(), &plain.classes);
        for number in 1..state.next_instance() {
            let has = (0..FACES).filter(|face| plain.instance[*face as usize] == number);
            let has: FaceRuns = has.collect();
            prop_assert_eq!(state.size_of(number).0, has.len());
            let area: f64 = has.iter().map(|face| 0.1 + f64::from(face) / 7.0).sum();
            prop_assert!((state.size_of(number).1 - area).abs() < 1e-9);
            prop_assert_eq!(state.faces_of(number), has);
        }

        // The log as text gives the same state, and all can be taken back.
        let mut again = empty();
        for (number, action) in (1..).zip(log) {
            let line = serde_json::to_string(&Event { version: 1, number, at_ms: Some(7), action }).unwrap();
            again.apply(serde_json::from_str(&line).unwrap()).unwrap();
        }
        prop_assert_eq!(labels(&again), labels(&state));
        while let Some(of) = state.next_undo() {
            act(&mut state, Action::Undo { of }).unwrap();
        }
        prop_assert_eq!(labels(&state), labels(&empty()));
    }

    #[test]
    fn strange_numbers_are_refused_and_never_panic(
        action in any_action(),
        number in prop::sample::select(&[0, 1, FACES, MAX_NUMBER, MAX_NUMBER + 1, u32::MAX][..]),
        run in (0..u32::MAX - 1, 1..u32::MAX),
    ) {
        let mut state = empty();
        act(&mut state, paint(&[1, 2], 1, "chair")).unwrap();
        let far = FaceRuns::of_range(run.0..run.0.saturating_add(run.1));
        let room = |at: f64| Room { parts: vec![square(at)], ..Room::default() };
        for action in [
            action,
            Action::Paint { faces: far.clone(), instance: 1, class: None },
            Action::Paint { faces: faces(&[3]), instance: number, class: Some("chair".into()) },
            Action::Erase { faces: far },
            Action::Cut { instance: 1, faces: faces(&[1]), new: number },
            Action::Room { room: number, is: room(f64::NAN) },
            Action::Room { room: number, is: room(f64::MAX) },
            Action::Room { room: number, is: room(1.0) },
            Action::SplitRoom { room: 1, new: number, line: [[0.0, f64::INFINITY], [1.0, 1.0]] },
            Action::JoinRooms { into: number, rooms: vec![number] },
        ] {
            let _ = act(&mut state, action);
        }
        while let Some(of) = state.next_undo() {
            act(&mut state, Action::Undo { of }).unwrap();
        }
        prop_assert_eq!(labels(&state), labels(&empty()));
    }
}

#[test]
fn numbers_are_permanent_and_a_redo_brings_the_same() {
    let mut state = empty();
    act(&mut state, paint(&[1, 2], 1, "chair")).unwrap();
    act(&mut state, paint(&[3], 2, "chair")).unwrap();
    act(&mut state, Action::Undo { of: 2 }).unwrap();
    assert_eq!((state.next_instance(), state.next_undo(), state.next_redo()), (3, Some(1), Some(2)));
    assert_eq!(act(&mut state, paint(&[4], 2, "table")), Err(Fault::InstanceNumber { number: 2, next: 3 }));

    act(&mut state, Action::Redo { of: 2 }).unwrap();
    assert_eq!(state.instance_of_face()[..5], [0, 1, 1, 2, 0]);
    act(&mut state, Action::Undo { of: 2 }).unwrap();
    act(&mut state, paint(&[4], 3, "table")).unwrap();
    // Something else was done since.
    assert_eq!(
        act(&mut state, Action::Redo { of: 2 }),
        Err(Fault::NotItsTurn { of: 2, what: "brought back", turn: None })
    );
    let names: Vec<_> = state.instance_names().into_iter().collect();
    assert_eq!(names, [(1, "chair_1".to_owned()), (3, "table_1".to_owned())]);
}

#[test]
fn faults_have_kinds() {
    let mut state = empty();
    act(&mut state, paint(&[1, 2], 1, "chair")).unwrap();
    let known = |faces: &[u32], instance| Action::Paint { faces: super::faces(faces), instance, class: None };
    let is = |action: Action| state.check(&action).unwrap_err();
    assert_eq!(is(known(&[3], 2)), Fault::UnknownInstance { number: 2 });
    assert_eq!(is(known(&[3, FACES], 1)), Fault::NoSuchFace { face: FACES, count: FACES });
    assert!(matches!(is(known(&[1], 1)), Fault::Nothing { .. }));
    assert!(matches!(is(known(&[], 1)), Fault::Nothing { .. }));
    assert!(matches!(is(Action::Erase { faces: faces(&[0, 3]) }), Fault::Nothing { .. }));
    assert!(matches!(is(Action::Join { into: 1, instances: vec![1] }), Fault::Nothing { .. }));
    assert!(matches!(
        is(Action::Cut { instance: 1, faces: faces(&[1, 2, 3]), new: 2 }),
        Fault::Nothing { .. }
    ));
    assert_eq!(is(Action::RemoveRoom { room: 1 }), Fault::UnknownRoom { number: 1 });
    assert_eq!(
        is(Action::Room {
            room: 1,
            is: Room { parts: vec![RoomPart { heights: [2.0, 1.0], ..square(0.0) }], ..Room::default() }
        }),
        Fault::RoomShape
    );
    let event = |version, number| Event { version, number, at_ms: None, action: Action::Undo { of: 1 } };
    assert_eq!(state.apply(event(2, 2)), Err(Fault::Version { version: 2 }));
    assert_eq!(state.apply(event(1, 3)), Err(Fault::Number { number: 3, revision: 1 }));
}
