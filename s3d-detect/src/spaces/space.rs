//! A space to detect elements in: surfels and elements in its canonical frame.

use crate::area::{Area, Element};
use crate::spaces::frame::{Frame, canonical_frames};
use crate::spaces::merge::NO_SPACE;
use crate::spaces::rand_index::adjusted_rand_index;
use crate::spaces::{building_angle_deg, parse};
use crate::surfel::Surfel;
use crate::surfel::index::Index;
use glam::{Vec3, vec3};
use s3d_geom::Aabb;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;
use thiserror::Error;

/// The kind of spaces that an area is cut into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SpaceSource {
    /// The spaces that [`parse`] finds.
    #[default]
    Parsed,
    /// The annotated rooms.
    Rooms,
}

/// A word that names no source of spaces.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("spaces are parsed or rooms, and not {0:?}")]
pub struct UnknownSpaceSource(String);

impl FromStr for SpaceSource {
    type Err = UnknownSpaceSource;

    fn from_str(word: &str) -> Result<Self, Self::Err> {
        match word {
            "parsed" => Ok(Self::Parsed),
            "rooms" => Ok(Self::Rooms),
            other => Err(UnknownSpaceSource(other.to_owned())),
        }
    }
}

impl fmt::Display for SpaceSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Parsed => "parsed",
            Self::Rooms => "rooms",
        })
    }
}

/// Walls that are turned by less than this, in degrees, count as parallel to the axes.
const ALIGNED_DEG: f64 = 0.5;

/// A space in its canonical frame, in metres, with its least corner at the origin.
#[derive(Clone, Debug)]
pub struct Space {
    /// The number of its area.
    pub area: u32,
    /// Its number in the area.
    pub number: u32,
    /// Takes the axes of the building to its own.
    pub frame: Frame,
    /// The angle of the building to the axes of the world, in degrees.
    pub building_deg: f64,
    /// Its thinned points.
    pub index: Index,
    /// The annotated elements that lie in it.
    pub elements: Vec<Element>,
}

impl Space {
    /// Returns the room of most points in a box of this space, or in the whole space if the box has none.
    pub fn room_of(&self, b: &Aabb) -> u32 {
        let inside = most_frequent_room(self.index.within(&grown(b)));
        inside
            .or_else(|| most_frequent_room(self.index.surfels().iter()))
            .unwrap_or(0)
    }

    /// Takes a box of this space to the world. If the building is turned, it is the box around the turned
    /// box.
    pub fn to_world(&self, b: &Aabb) -> Aabb {
        spun_box(&self.frame.to_building(b), self.building_deg)
    }
}

/// Returns the room of most surfels; the lower number wins a tie.
fn most_frequent_room<'a>(surfels: impl Iterator<Item = &'a Surfel>) -> Option<u32> {
    let mut counts: BTreeMap<u32, usize> = BTreeMap::new();
    surfels.for_each(|s| *counts.entry(s.room).or_default() += 1);
    counts
        .into_iter()
        .reduce(|best, next| if next.1 > best.1 { next } else { best })
        .map(|(room, _)| room)
}

/// Grows a box by 2 cm, which is more than the noise of points.
fn grown(b: &Aabb) -> Aabb {
    Aabb { min: b.min - 0.02, max: b.max + 0.02 }
}

/// Returns the spaces of an area that hold points, and how well they agree with its rooms: the adjusted Rand
/// index over surfels. An element belongs to the space with most surfels in its box, or to no space if there
/// are none. With [`SpaceSource::Rooms`], surfels of a room that `area.rooms` lacks are in no space.
pub fn spaces_of(area: &Area, source: SpaceSource) -> (Vec<Space>, f64) {
    let angle = building_angle_deg(&area.surfels);
    let angle = if angle.abs() < ALIGNED_DEG { 0.0 } else { angle };

    // All that follows has the axes of the building.
    let mut surfels = area.surfels.clone();
    if angle != 0.0 {
        for s in &mut surfels {
            s.position = spun(s.position, -angle);
            s.normal = spun(s.normal, -angle);
            s.extent = spun_box(&s.extent, -angle);
        }
    }

    let rooms: Vec<u32> = surfels.iter().map(|s| s.room).collect();
    let (of_surfel, count) = match source {
        SpaceSource::Parsed => {
            let parsed = parse(&surfels);
            (parsed.of_surfel, parsed.count)
        }
        SpaceSource::Rooms => {
            let count = area.rooms.len() as u32;
            let named = rooms.iter().map(|&room| if room < count { room } else { NO_SPACE });
            (named.collect(), count)
        }
    };
    let agreement = adjusted_rand_index(&of_surfel, &rooms);

    let mut bounds = vec![Aabb::EMPTY; count as usize];
    let mut of_space: Vec<Vec<Surfel>> = vec![Vec::new(); count as usize];
    for (surfel, &space) in surfels.iter().zip(&of_surfel).filter(|(_, s)| **s != NO_SPACE) {
        bounds[space as usize] = bounds[space as usize].union(surfel.extent);
        of_space[space as usize].push(*surfel);
    }

    let kept: Vec<usize> = (0..bounds.len()).filter(|&i| !bounds[i].is_empty()).collect();
    let boxes: Vec<Aabb> = kept.iter().map(|&i| bounds[i]).collect();
    let frames = canonical_frames(&boxes);
    let mut spaces: Vec<Space> = kept
        .iter()
        .zip(frames)
        .map(|(&i, frame)| Space {
            area: area.number,
            number: i as u32,
            frame,
            building_deg: angle,
            index: in_frame(&of_space[i], &frame),
            elements: Vec::new(),
        })
        .collect();

    for element in &area.elements {
        let around = spun_box(&element.bbox, -angle);
        if let Some(space) = home(&around, &boxes, &spaces) {
            let bbox = spaces[space].frame.to_frame(&around);
            spaces[space].elements.push(Element { bbox, ..*element });
        }
    }
    (spaces, agreement)
}

fn in_frame(surfels: &[Surfel], frame: &Frame) -> Index {
    let moved = surfels.iter().map(|s| Surfel {
        position: frame.point(s.position),
        extent: frame.to_frame(&s.extent),
        normal: frame.direction(s.normal),
        ..*s
    });
    Index::new(moved.collect())
}

/// Returns the space with most surfels in a box, grown by 2 cm.
fn home(element: &Aabb, boxes: &[Aabb], spaces: &[Space]) -> Option<usize> {
    let grown = grown(element);
    let inside = |i: usize| {
        if boxes[i].max.cmplt(grown.min).any() || boxes[i].min.cmpgt(grown.max).any() {
            return 0;
        }
        spaces[i].index.within(&spaces[i].frame.to_frame(&grown)).count()
    };
    let counts = (0..spaces.len()).map(|i| (i, inside(i))).filter(|(_, n)| *n > 0);
    counts
        .reduce(|best, next| if next.1 > best.1 { next } else { best })
        .map(|(i, _)| i)
}

/// Turns a point about the Z axis.
fn spun(p: Vec3, degrees: f64) -> Vec3 {
    let sine = libm::sin(degrees.to_radians());
    let cosine = libm::cos(degrees.to_radians());
    let x = f64::from(p.x);
    let y = f64::from(p.y);
    vec3((cosine * x - sine * y) as f32, (sine * x + cosine * y) as f32, p.z)
}

/// Returns the box around a box that is turned about the Z axis.
fn spun_box(b: &Aabb, degrees: f64) -> Aabb {
    if degrees == 0.0 {
        return *b;
    }
    let corners = [(b.min.x, b.min.y), (b.max.x, b.min.y), (b.min.x, b.max.y), (b.max.x, b.max.y)];
    Aabb::from_points(
        corners
            .iter()
            .flat_map(|&(x, y)| [b.min.z, b.max.z].map(|z| spun(vec3(x, y, z), degrees))),
    )
}
