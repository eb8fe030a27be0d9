//! Doubts, similar patches and checks, on scenes whose instances are known.

use s3d_annotate::labelling::{Action, Event, FaceRuns, Room, RoomPart, State};
use s3d_annotate::review::{Check, CheckKind, Review, Surroundings};
use s3d_annotate::segments::{FaceIndex, SegmentOptions, Segments, segment_faces};
use s3d_geom::NearestFaces;
use s3d_geom::glam::Vec3;
use s3d_label::Class;
use s3d_synth::{AnnotatedScene, Building, BuildingOptions};
use std::collections::{BTreeMap, BTreeSet};

#[derive(Clone)]
struct Scene {
    truth: AnnotatedScene,
    segments: Segments,
    surroundings: Surroundings,
    state: State,
}

impl Scene {
    fn new(building: &Building) -> Self {
        let truth = building.build().unwrap();
        let segments = segment_faces(&truth.mesh, &SegmentOptions::default());
        let surroundings =
            Surroundings::new(&truth.mesh, &segments, FaceIndex::new(&truth.mesh, &segments).into());
        let state = State::of_mesh(&truth.mesh);
        Self { truth, segments, surroundings, state }
    }

    fn act(&mut self, action: Action) {
        let number = self.state.revision() + 1;
        self.state
            .apply(Event { version: 1, number, at_ms: None, action })
            .unwrap();
    }

    fn faces_of(&self, instance: usize) -> FaceRuns {
        let of_face = self.truth.instance_of_face.iter().zip(0u32..);
        of_face
            .filter(|(of, _)| **of as usize == instance)
            .map(|(_, face)| face)
            .collect()
    }

    /// Labels an instance of the truth, and returns its number.
    fn label(&mut self, instance: usize) -> u32 {
        let number = self.state.next_instance();
        let class = Some(self.truth.instances[instance].class.name().to_owned());
        self.act(Action::Paint { faces: self.faces_of(instance), instance: number, class });
        number
    }

    /// Labels all of the truth, and makes a room of the box of each floor. Instance `i` gets number `i + 1`.
    fn label_all(&mut self) {
        for instance in 0..self.truth.instances.len() {
            assert_eq!(self.label(instance), instance as u32 + 1);
            let is = self.truth.instances[instance];
            if is.class != Class::FLOOR {
                continue;
            }
            let corners = || {
                let faces = self.faces_of(instance);
                let corners: Vec<Vec3> =
                    faces.iter().flat_map(|face| self.truth.mesh.triangle(face)).collect();
                corners
            };
            let low = corners().into_iter().fold(Vec3::INFINITY, Vec3::min).as_dvec3();
            let high = corners().into_iter().fold(Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
            let outline = vec![[low.x, low.y], [high.x, low.y], [high.x, high.y], [low.x, high.y]];
            let parts = vec![RoomPart { outline, heights: [low.z, low.z + 2.6] }];
            let kind = Some(is.room.to_string().split('_').next().unwrap().to_owned());
            let room = self.state.next_room();
            self.act(Action::Room { room, is: Room { kind, name: None, parts } });
        }
    }

    fn review(&self) -> Review<'_> {
        let Self { truth, segments, surroundings, state } = self;
        Review { mesh: &truth.mesh, segments, surroundings, state }
    }
}

fn demo() -> Building {
    Building { texture_scale: 0.1, ..Building::demo() }
}

fn house() -> Building {
    let options = BuildingOptions { storeys: 2, texture_scale: 0.1, ..BuildingOptions::drawn(6, 42) };
    Building::generate(&options).unwrap()
}

/// Whether nothing lies between two places, up to 20 cm before the second: steps as long as the nearest face
/// is far.
fn is_free(nearest: &NearestFaces<'_>, from: [f64; 3], to: [f64; 3]) -> bool {
    let [mut from, to] = [from, to].map(|place| Vec3::from(place.map(|x| x as f32)));
    while from.distance(to) > 0.2 {
        let step_m = nearest.nearest(from).distance_m;
        if step_m < 0.005 {
            return false;
        }
        from += (to - from).normalize() * step_m.min(from.distance(to));
    }
    true
}

#[test]
fn doubts_lead_to_one_thing_after_the_other() {
    for building in [demo(), house()] {
        let mut scene = Scene::new(&building);
        let mesh = scene.truth.mesh.clone();
        let nearest = NearestFaces::new(&mesh);
        let [mut doubts, mut of_one_thing, mut in_sight, mut guesses, mut right] = [0.0; 5];
        let mut largest_m2 = f64::INFINITY;
        let mut skipped = Vec::new();
        while let Some(doubt) = scene.review().next_doubt(&skipped)
            && doubt.area_m2 > 0.05
        {
            let mut share: BTreeMap<u32, f64> = BTreeMap::new();
            let segments: BTreeSet<&u32> = scene.segments.tree.segments_of(doubt.node).iter().collect();
            for (face, segment) in (0u32..).zip(&scene.segments.segment_of_face) {
                if segments.contains(segment) && scene.state.instance_of_face()[face as usize] == 0 {
                    *share.entry(scene.truth.instance_of_face[face as usize]).or_default() += mesh.area(face);
                }
            }
            let all_m2: f64 = share.values().sum();
            assert!((all_m2 - doubt.area_m2).abs() < 1e-6);
            // Labelling makes patches smaller, and so does not bring larger ones.
            assert!(doubt.area_m2 <= largest_m2 + 1e-9);
            largest_m2 = doubt.area_m2;

            let (thing, most_m2) = share.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            doubts += 1.0;
            of_one_thing += f64::from(most_m2 > 0.95 * all_m2);
            in_sight += f64::from(is_free(&nearest, doubt.from, doubt.at));
            if let Some(guess) = doubt.guess {
                guesses += 1.0;
                right += f64::from(guess.class == scene.truth.instances[thing as usize].class.name());
            }
            // The thing is labelled; where the patch had a part of it alone, the patch is skipped.
            if scene.state.instance_of_face()[scene.faces_of(thing as usize).iter().next().unwrap() as usize]
                == 0
            {
                scene.label(thing as usize);
            } else {
                skipped.push(scene.segments.segment_of_face[doubt.face as usize]);
            }
        }
        let shares = [of_one_thing / doubts, in_sight / doubts, guesses / doubts, right / guesses];
        let title = &scene.truth.title;
        assert!(shares[0] > 0.9 && shares[1] > 0.9, "{title}: {shares:?}");
        assert!(shares[2] > 0.3 && shares[3] > 0.8, "{title}: {shares:?}");
        assert!(doubts < 1.2 * scene.truth.instances.len() as f64, "{title}: {doubts}");
    }
}

#[test]
fn more_of_a_thing_is_found() {
    for building in [demo(), house()] {
        let empty = Scene::new(&building);
        let of = |instance: usize| empty.truth.instances[instance].class;
        let [mut found, mut right, mut wanted] = [0.0; 3];
        for instance in 0..empty.truth.instances.len() {
            if ![Class::CHAIR, Class::TABLE, Class::BOOKCASE, Class::WINDOW].contains(&of(instance)) {
                continue;
            }
            let mut scene = empty.clone();
            let number = scene.label(instance);
            let mut taken = BTreeSet::new();
            for patch in scene.review().similar_patches(number) {
                let segments = scene.segments.tree.segments_of(patch.node);
                assert!(segments.contains(&scene.segments.segment_of_face[patch.face as usize]));
                assert!(segments.iter().all(|segment| taken.insert(*segment)), "patches are disjoint");
                found += 1.0;
                let thing = scene.truth.instance_of_face[patch.face as usize] as usize;
                right += f64::from(of(thing) == of(instance));
            }
            wanted += (0..empty.truth.instances.len())
                .filter(|other| of(*other) == of(instance))
                .count() as f64;
            wanted -= 1.0;
        }
        assert!(right > 0.85 * found && right > 0.5 * wanted, "{found} {right} {wanted}");
    }
}

fn kinds(checks: &[Check]) -> Vec<(CheckKind, Option<u32>)> {
    checks.iter().map(|check| (check.kind, check.instance)).collect()
}

#[test]
fn true_labels_raise_no_alarm_and_planted_mistakes_are_found() {
    for building in [demo(), house()] {
        let mut scene = Scene::new(&building);
        let checks = scene.review().checks();
        assert!(!checks.is_empty() && checks.iter().all(|check| check.kind == CheckKind::Unlabelled));

        scene.label_all();
        assert_eq!(kinds(&scene.review().checks()), [], "{}", scene.truth.title);

        let instances = scene.truth.instances.clone();
        let of = |class: Class| {
            let found: Vec<usize> = (0..instances.len()).filter(|i| instances[*i].class == class).collect();
            found
        };
        let number = |instance: usize| instance as u32 + 1;
        let mesh = scene.truth.mesh.clone();
        let nearest = NearestFaces::new(&mesh);
        let finds = |scene: &Scene, expected: &[(CheckKind, usize)], planted: &FaceRuns| {
            let checks = scene.review().checks();
            let expected: Vec<_> = expected.iter().map(|(kind, i)| (*kind, Some(number(*i)))).collect();
            assert_eq!(kinds(&checks), expected, "{checks:?}");
            for check in &checks {
                let at = Vec3::from(check.at.map(|x| x as f32));
                let face = nearest.nearest(at).face;
                assert!(planted.iter().any(|planted| planted == face), "{check:?} is elsewhere");
            }
        };

        // Two chairs of one room as one instance.
        let chairs = of(Class::CHAIR);
        let two = chairs
            .windows(2)
            .find(|two| instances[two[0]].room == instances[two[1]].room)
            .unwrap();
        let mut joined = scene.clone();
        joined.act(Action::Join { into: number(two[0]), instances: vec![number(two[1])] });
        let both = two
            .iter()
            .flat_map(|chair| scene.faces_of(*chair).iter().collect::<Vec<_>>())
            .collect();
        finds(&joined, &[(CheckKind::TwoPieces, two[0])], &both);

        // Chairs of two rooms as one instance.
        let far = chairs
            .iter()
            .find(|chair| instances[**chair].room != instances[two[0]].room)
            .unwrap();
        let mut joined = scene.clone();
        joined.act(Action::Join { into: number(two[0]), instances: vec![number(*far)] });
        let pair = [two[0], *far];
        let both = pair
            .iter()
            .flat_map(|chair| scene.faces_of(*chair).iter().collect::<Vec<_>>());
        let expected = [(CheckKind::TwoPieces, two[0]), (CheckKind::TwoRooms, two[0])];
        finds(&joined, &expected, &both.collect());

        // The top of a table as a part of the floor.
        let table = of(Class::TABLE)[0];
        let floor = of(Class::FLOOR)
            .into_iter()
            .find(|i| instances[*i].room == instances[table].room)
            .unwrap();
        let faces = scene.faces_of(table);
        let top = |face: &u32| mesh.triangle(*face)[0].z;
        let highest = faces.iter().map(|face| top(&face)).fold(f32::MIN, f32::max);
        let is_top = |face: &u32| mesh.normal(*face).z > 0.9 && top(face) > highest - 0.1;
        let top: FaceRuns = faces.iter().filter(is_top).collect();
        let mut wrong = scene.clone();
        wrong.act(Action::Paint { faces: top.clone(), instance: number(floor), class: None });
        let checks = wrong.review().checks();
        let above: Vec<&Check> = checks
            .iter()
            .filter(|check| check.kind == CheckKind::FloorAbove)
            .collect();
        assert_eq!((above.len(), above[0].instance), (1, Some(number(floor))), "{checks:?}");
        assert!(
            top.iter()
                .any(|face| face == nearest.nearest(Vec3::from(above[0].at.map(|x| x as f32))).face)
        );

        // A room whose type was forgotten.
        let mut untyped = scene.clone();
        let (&room, is) = scene.state.rooms().first_key_value().unwrap();
        untyped.act(Action::Room { room, is: Room { kind: None, ..is.clone() } });
        let checks = untyped.review().checks();
        assert_eq!(kinds(&checks), [(CheckKind::NoType, None)], "{checks:?}");
        assert!(checks[0].text.starts_with("room 1 has no type"));

        // A door that was forgotten.
        let door = of(Class::DOOR)[0];
        let mut forgotten = scene.clone();
        forgotten.act(Action::Erase { faces: scene.faces_of(door) });
        let checks = forgotten.review().checks();
        assert!(!checks.is_empty(), "a door is forgotten");
        for check in checks {
            assert_eq!((check.kind, check.instance), (CheckKind::Unlabelled, None), "{check:?}");
            let face = nearest.nearest(Vec3::from(check.at.map(|x| x as f32))).face;
            assert!(scene.faces_of(door).iter().any(|of_door| of_door == face), "{check:?}");
        }
    }
}

#[test]
fn reviews_do_not_depend_on_threads() {
    let scene = Scene::new(&demo());
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let Scene { truth, segments, state, .. } = &scene;
            let surroundings =
                &Surroundings::new(&truth.mesh, segments, FaceIndex::new(&truth.mesh, segments).into());
            let review = Review { mesh: &truth.mesh, segments, surroundings, state };
            (review.next_doubt(&[]), review.checks())
        })
    };
    assert_eq!(on(1), on(7));
}
