//! Questions about a room, whose answers are computed. What people could answer in two ways is not asked.

use super::scene::{Scene, Shown, Thing};
use s3d_geom::glam::DVec2;
use s3d_io::fs::Checksum;
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};

/// The most questions of a kind about a room.
const MOST: usize = 20;
/// Distances that are compared differ by more than this, and things are farther from each other, metres.
const DISTANCE_MARGIN_M: f64 = 0.15;
/// A number is farther than this from where it would be rounded otherwise.
const ROUNDING_MARGIN: f64 = 0.02;
/// A direction is farther than this from the next answer, degrees.
const ANGLE_MARGIN_DEG: f64 = 10.0;
/// Who stands at a thing and looks at another one has this much room between them, metres.
const LEAST_AWAY_M: f64 = 0.6;
/// A thing is recognised in a view if it has this share of its pixels.
const LEAST_SHARE: f64 = 0.005;

/// A question with its answer.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Question {
    pub(super) id: usize,
    scene_name: String,
    dataset: &'static str,
    question_type: &'static str,
    video_path: Option<String>,
    question: String,
    /// "A. chair" and so on; none if the answer is a number.
    options: Option<Vec<String>>,
    ground_truth: Value,
    /// The letter of the right option.
    mc_answer: Option<char>,
    /// The labels of the things that it is about.
    labels: Vec<String>,
}

/// Asks about a room. `shown` has what each of its views shows. Classes of which a thing is recognised in no
/// view are left out, and so are rooms without a view.
pub(super) fn ask(scene: &Scene<'_>, shown: &[BTreeMap<u32, Shown>]) -> Vec<Question> {
    if shown.is_empty() {
        return Vec::new();
    }
    let recognised: BTreeSet<u32> = shown.iter().flat_map(recognised).collect();
    let mut by_class: BTreeMap<&str, Vec<&Thing>> = BTreeMap::new();
    for thing in &scene.things {
        by_class.entry(&thing.class).or_default().push(thing);
    }
    by_class.retain(|_, things| things.iter().all(|thing| recognised.contains(&thing.index)));
    let asking = Asking { scene, by_class, shown };
    [
        asking.counts(),
        asking.sizes(),
        asking.room_size(),
        asking.distances(),
        asking.nearest(),
        asking.directions(),
        asking.appearance(),
    ]
    .concat()
}

struct Asking<'a> {
    scene: &'a Scene<'a>,
    by_class: BTreeMap<&'a str, Vec<&'a Thing>>,
    shown: &'a [BTreeMap<u32, Shown>],
}

impl Asking<'_> {
    /// The things that are the only ones of their class.
    fn unique(&self) -> Vec<&Thing> {
        let alone = self.by_class.values().filter(|things| things.len() == 1);
        alone.flatten().copied().collect()
    }

    fn question(&self, kind: &'static str, question: String, things: &[&Thing]) -> Question {
        Question {
            id: 0,
            scene_name: self.scene.id.clone(),
            dataset: "s3d",
            question_type: kind,
            video_path: None,
            question,
            options: None,
            ground_truth: Value::Null,
            mc_answer: None,
            labels: things.iter().map(|thing| thing.label.clone()).collect(),
        }
    }

    /// Adds options in an order that looks random.
    fn choose(&self, question: Question, mut options: Vec<String>, right: &str) -> Question {
        options.sort_by_cached_key(|option| sum(&[&self.scene.id, &question.question, option]));
        let letters = 'A'..='Z';
        let named = letters
            .clone()
            .zip(&options)
            .map(|(letter, option)| format!("{letter}. {option}"));
        Question {
            mc_answer: letters
                .zip(&options)
                .find(|(_, option)| *option == right)
                .map(|(letter, _)| letter),
            options: Some(named.collect()),
            ground_truth: json!(right),
            ..question
        }
    }

    fn counts(&self) -> Vec<Question> {
        let several = self.by_class.iter().filter(|(_, things)| things.len() > 1);
        let ask = several.map(|(class, things)| {
            let text = format!("Of the class {class}, how many are there in the room?");
            let question = self.question("object_counting", text, things);
            Question { ground_truth: json!(things.len()), ..question }
        });
        some(ask.collect())
    }

    fn sizes(&self) -> Vec<Question> {
        let mut all = Vec::new();
        for thing in self.unique() {
            let longest_cm = thing.upright.size.iter().copied().fold(0.0, f64::max) * 100.0;
            if let Some(rounded) = rounded(longest_cm, 0.2) {
                let text = format!(
                    "How long is the {} along its longest side (length, width or height), in centimetres?",
                    thing.class
                );
                let question = self.question("object_size_estimation", text, &[thing]);
                all.push(Question { ground_truth: json!(rounded as u64), ..question });
            }
        }
        some(all)
    }

    fn room_size(&self) -> Vec<Question> {
        let Some(tenths) = rounded(self.scene.size_m2 * 10.0, 0.1).filter(|tenths| *tenths > 0.0) else {
            return Vec::new();
        };
        let text = "How large is the floor of the room, in square metres?".to_owned();
        let question = self.question("room_size_estimation", text, &[]);
        vec![Question { ground_truth: json!(tenths / 10.0), ..question }]
    }

    fn distances(&self) -> Vec<Question> {
        let unique = self.unique();
        let mut all = Vec::new();
        for (i, a) in unique.iter().enumerate() {
            for b in &unique[i + 1..] {
                let distance_m = a.surface.distance_m(&b.surface);
                let tenths = rounded(distance_m * 10.0, 10.0 * ROUNDING_MARGIN);
                if let Some(tenths) = tenths.filter(|_| distance_m > DISTANCE_MARGIN_M) {
                    let text = format!(
                        "From surface to surface, how far is it between the {} and the {}, in metres?",
                        a.class, b.class
                    );
                    let question = self.question("object_abs_distance", text, &[a, b]);
                    all.push(Question { ground_truth: json!(tenths / 10.0), ..question });
                }
            }
        }
        some(all)
    }

    fn nearest(&self) -> Vec<Question> {
        let mut all = Vec::new();
        for to in self.unique() {
            // The nearest thing of each other class, and how far it is.
            let mut others: Vec<(f64, &str)> = Vec::new();
            for (class, things) in self.by_class.iter().filter(|(class, _)| **class != to.class) {
                let distances = things.iter().map(|thing| thing.surface.distance_m(&to.surface));
                others.push((distances.fold(f64::INFINITY, f64::min), class));
            }
            others.sort_by(|a, b| a.0.total_cmp(&b.0));

            let mut apart: Vec<(f64, &str)> = Vec::new();
            for (distance_m, class) in others {
                let least = apart.last().map_or(0.0, |(before, _)| *before) + DISTANCE_MARGIN_M;
                if distance_m > least && apart.len() < 4 {
                    apart.push((distance_m, class));
                } else if apart.is_empty() {
                    // Something touches it: what is nearest is no question.
                    break;
                }
            }
            let [(_, right), _, ..] = apart[..] else { continue };
            let kind = ["object_rel_distance_v3", "object_rel_distance_v2", "object_rel_distance_v1"]
                [apart.len() - 2];
            let mut names: Vec<String> = apart.iter().map(|(_, class)| (*class).to_owned()).collect();
            names.sort_unstable();
            let text = format!(
                "From surface to surface, which is nearest to the {}: {}? Of several of a class, the nearest \
                 counts.",
                to.class,
                names.join(", ")
            );
            all.push(self.choose(self.question(kind, text, &[to]), names, right));
        }
        some(all)
    }

    fn directions(&self) -> Vec<Question> {
        let unique = self.unique();
        let mut all = [Vec::new(), Vec::new(), Vec::new()];
        for at in &unique {
            for ahead in unique.iter().filter(|thing| thing.index != at.index) {
                let others = unique
                    .iter()
                    .filter(|of| of.index != at.index && of.index != ahead.index);
                for of in others {
                    let Some(angles) = angles(at, ahead, of) else { continue };
                    for (sectors, all) in SECTORS.iter().zip(&mut all) {
                        let Some(right) = sectors.answer(&angles) else { continue };
                        let text = format!(
                            "You stand at the {} and look at the {}. {} {}: {}?",
                            at.class, ahead.class, sectors.where_is, of.class, sectors.explains
                        );
                        let question = self.question(sectors.kind, text, &[at, ahead, of]);
                        let options = sectors.parts.iter().map(|(_, name)| (*name).to_owned());
                        let mut options: Vec<String> = options.collect();
                        options.sort_unstable();
                        options.dedup();
                        all.push(self.choose(question, options, right));
                    }
                }
            }
        }
        all.into_iter().flat_map(some).collect()
    }

    fn appearance(&self) -> Vec<Question> {
        let mut first: Vec<(usize, &str)> = Vec::new();
        for (class, things) in &self.by_class {
            let has = |label: &u32| things.iter().any(|thing| thing.index == *label);
            let at = self.shown.iter().position(|shown| shown.keys().any(has));
            let at = at.filter(|at| recognised(&self.shown[*at]).any(|label| has(&label)));
            first.extend(at.map(|at| (at, *class)));
        }
        first.sort_unstable();
        first.dedup_by_key(|(at, _)| *at);
        let [a, b, c, d, ..] = first[..] else { return Vec::new() };

        let order = [a, b, c, d].map(|(_, class)| class);
        let right = order.join(", ");
        // The right order, and three others.
        let swapped = [[1, 0, 2, 3], [0, 2, 1, 3], [3, 1, 2, 0]];
        let mut options = vec![right.clone()];
        options.extend(swapped.map(|places| places.map(|place| order[place]).join(", ")));
        let mut names = order.to_vec();
        names.sort_unstable();
        let text = format!(
            "In which order do the views show these classes for the first time: {}?",
            names.join(", ")
        );
        let things: Vec<&Thing> = order.iter().flat_map(|class| &self.by_class[class]).copied().collect();
        vec![self.choose(self.question("obj_appearance_order", text, &things), options, &right)]
    }
}

/// Parts of all directions, from straight ahead to the left, degrees.
struct Sectors {
    kind: &'static str,
    where_is: &'static str,
    explains: &'static str,
    /// Where each part ends, and its name.
    parts: &'static [(f64, &'static str)],
    /// Where the answer changes, as far as it does.
    borders: &'static [f64],
}

const SECTORS: [Sectors; 3] = [
    Sectors {
        kind: "object_rel_direction_v1",
        where_is: "Where is the",
        explains: "front-left, front-right, back-left or back-right",
        parts: &[(90.0, "front-left"), (180.0, "back-left"), (270.0, "back-right"), (360.0, "front-right")],
        borders: &[0.0, 90.0, 180.0, 270.0, 360.0],
    },
    Sectors {
        kind: "object_rel_direction_v2",
        where_is: "Where is the",
        explains: "left, right or back, where back means a turn of 135 degrees or more",
        parts: &[(135.0, "left"), (225.0, "back"), (360.0, "right")],
        borders: &[0.0, 135.0, 225.0, 360.0],
    },
    Sectors {
        kind: "object_rel_direction_v3",
        where_is: "On which side is the",
        explains: "left or right",
        parts: &[(180.0, "left"), (360.0, "right")],
        borders: &[0.0, 180.0, 360.0],
    },
];

impl Sectors {
    fn part(&self, angle: f64) -> &'static str {
        let found = self.parts.iter().find(|(end, _)| angle < *end);
        found.map_or(self.parts[self.parts.len() - 1].1, |(_, name)| name)
    }

    /// The part that the middle of a thing is in, the first angle, if its corners are there too.
    fn answer(&self, angles: &[f64]) -> Option<&'static str> {
        let middle = *angles.first()?;
        let name = self.part(middle);
        let is_clear = self
            .borders
            .iter()
            .all(|border| (middle - border).abs() >= ANGLE_MARGIN_DEG);
        (is_clear && angles.iter().all(|angle| self.part(*angle) == name)).then_some(name)
    }
}

/// The angles at which who stands at a thing and looks at another one sees the middle of a third one and the
/// corners of its box, from above, counter-clockwise from straight ahead: 0 to 360 degrees. `None` if one of
/// them is too near.
fn angles(at: &Thing, ahead: &Thing, of: &Thing) -> Option<Vec<f64>> {
    let stand = at.middle();
    let look = ahead.middle() - stand;
    let is_away = |thing: &Thing| {
        let points = thing.corners();
        thing.middle().distance(stand) >= LEAST_AWAY_M && points.iter().all(|p| p.distance(stand) >= 0.1)
    };
    let angle = |point: DVec2| look.angle_to(point - stand).to_degrees().rem_euclid(360.0);
    let points = std::iter::once(of.middle()).chain(of.corners());
    (is_away(ahead) && is_away(of)).then(|| points.map(angle).collect())
}

/// The labels that are recognised in a view.
fn recognised(shown: &BTreeMap<u32, Shown>) -> impl Iterator<Item = u32> + '_ {
    let total: u64 = shown.values().map(|shown| shown.pixels).sum();
    let is_large = move |shown: &Shown| shown.pixels as f64 >= LEAST_SHARE * total as f64;
    shown
        .iter()
        .filter(move |(_, shown)| is_large(shown))
        .map(|(label, _)| *label)
}

/// A number rounded, if it is farther than `margin` from where it would be rounded otherwise.
fn rounded(value: f64, margin: f64) -> Option<f64> {
    let rounded = value.round();
    ((value - rounded).abs() <= 0.5 - margin).then_some(rounded)
}

/// Some of the questions of a kind, in an order that looks random.
fn some(mut all: Vec<Question>) -> Vec<Question> {
    all.sort_by_cached_key(|question| sum(&[&question.scene_name, &question.question]));
    all.truncate(MOST);
    all
}

/// A sum that looks random.
fn sum(words: &[&str]) -> String {
    Checksum::of(words.join("\n").as_bytes()).to_string()
}
