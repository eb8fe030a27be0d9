//! Doubts, similar patches and checks, on scenes whose instances are known.

use s3d_annotate::labelling::{Action, Event, FaceRuns, Room, RoomPart, State};
use s3d_annotate::review::{Check, CheckKind, Review, Surroundings};
use s3d_annotate::segments::{SegmentOptions, Segments, segment_faces};
use s3d_geom::glam::{Vec3, vec3};
use s3d_label::Class;
use s3d_synth::{AnnotatedScene, Building, BuildingOptions};
use std::collections::BTreeMap;

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
        let surroundings = Surroundings::new(&truth.mesh, &segments);
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

#[test]
fn explore() {
    for building in [demo(), house()] {
        let mut scene = Scene::new(&building);
        eprintln!(
            "{} faces {} instances {}",
            scene.truth.title,
            scene.truth.mesh.faces().len(),
            scene.truth.instances.len()
        );
        let t = std::time::Instant::now();
        Surroundings::new(&scene.truth.mesh, &scene.segments);
        eprintln!("surroundings {:?}", t.elapsed());
        let mut size = vec![0.0; scene.truth.instances.len()];
        for (f, i) in (0u32..).zip(&scene.truth.instance_of_face) {
            size[*i as usize] += scene.truth.mesh.area(f);
        }
        // Costs of the best nodes and of their parents.
        let (mut pure, mut whole, mut n, mut right, mut guessed) = (0, 0, 0, 0, 0);
        let mut skipped = vec![];
        let mut done = std::collections::BTreeSet::new();
        let mut worst = std::time::Duration::ZERO;
        loop {
            let t = std::time::Instant::now();
            let Some(doubt) = scene.review().next_doubt(&skipped) else { break };
            worst = worst.max(t.elapsed());
            if doubt.area_m2 < 0.05 {
                break;
            }
            let mut share: BTreeMap<u32, f64> = BTreeMap::new();
            let set: std::collections::BTreeSet<u32> =
                scene.segments.tree.segments_of(doubt.node).iter().copied().collect();
            for (f, i) in (0u32..).zip(&scene.truth.instance_of_face) {
                if set.contains(&scene.segments.segment_of_face[f as usize])
                    && scene.state.instance_of_face()[f as usize] == 0
                {
                    *share.entry(*i).or_default() += scene.truth.mesh.area(f);
                }
            }
            let total: f64 = share.values().sum();
            let (&best, &m2) = share.iter().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
            n += 1;
            let class = scene.truth.instances[best as usize].class.name();
            let ok = m2 > 0.95 * total;
            if ok {
                pure += 1;
                if m2 > 0.9 * size[best as usize] {
                    whole += 1;
                }
            }
            if let Some(g) = &doubt.guess {
                guessed += 1;
                if g.class == class {
                    right += 1;
                }
            }
            if !ok || n % 20 == 0 {
                eprintln!(
                    "  {n}: {:.2} m2 cost {:.3} pure {:.2} of {class} whole {:.2} guess {:?}",
                    doubt.area_m2,
                    scene.segments.tree.cost(doubt.node),
                    m2 / total,
                    m2 / size[best as usize],
                    doubt.guess.as_ref().map(|g| &g.class)
                );
            }
            if ok && done.insert(best) {
                scene.label(best as usize);
            } else {
                skipped.push(scene.segments.segment_of_face[doubt.face as usize]);
            }
        }
        eprintln!("doubts {n} pure {pure} whole {whole} guessed {guessed} right {right}; slowest {worst:?}");

        let mut scene = Scene::new(&building);
        let t = std::time::Instant::now();
        let checks = scene.review().checks();
        eprintln!("nothing labelled: {} checks {:?}", checks.len(), t.elapsed());
        scene.label_all();
        let t = std::time::Instant::now();
        let checks = scene.review().checks();
        eprintln!("checks {:?}", t.elapsed());
        for c in &checks {
            eprintln!("  {:?} {}", c.kind, c.text);
        }

        // Similar.
        let (mut hits, mut found, mut wanted) = (0, 0, 0);
        for i in 0..scene.truth.instances.len() {
            let class = scene.truth.instances[i].class;
            if ![Class::CHAIR, Class::TABLE, Class::BOOKCASE, Class::WINDOW].contains(&class) {
                continue;
            }
            let mut s = Scene {
                truth: scene.truth.clone(),
                segments: scene.segments.clone(),
                surroundings: scene.surroundings.clone(),
                state: State::of_mesh(&scene.truth.mesh),
            };
            let number = s.label(i);
            let patches = s.review().similar_patches(number);
            found += patches.len();
            hits += patches
                .iter()
                .filter(|p| {
                    s.truth.instances[s.truth.instance_of_face[p.face as usize] as usize].class == class
                })
                .count();
            wanted += s.truth.instances.iter().filter(|x| x.class == class).count() - 1;
        }
        eprintln!("similar: found {found} of {wanted}, right {hits}");
    }
}
