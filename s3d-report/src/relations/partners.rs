//! Images that see the same surface: the pairs of an area, the partners of its views, and the places that two
//! images show.

use crate::index::{Shown, rounded};
use s3d_geom::Camera;
use s3d_geom::glam::{DVec2, dvec2};
use s3d_io::Error as FileError;
use s3d_io::dataset::PairColumns;
use s3d_render::{Scene, correspondences};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// A view has at most so many partners at its own place, and at other places.
const MOST_PARTNERS: usize = 6;

/// Cameras that are nearer to each other stand at one place, in metres.
const SAME_PLACE_M: f32 = 0.01;

/// The most places that are shown in two images.
const MOST_PLACES: usize = 30;

/// Places are looked for in about so many columns of a view.
const COLUMNS: u32 = 64;

/// An image of an area.
#[derive(Clone, Copy)]
pub(crate) struct Member<'a> {
    pub(crate) shown: Shown,
    /// Where it was taken.
    pub(crate) place: Place,
    /// Its camera; `None` if it has no pose, or no picture in the report.
    pub(crate) camera: Option<&'a Camera>,
}

/// Where an image was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Place {
    /// At the scan location with this index.
    Location(usize),
    /// At the place of the photograph that is the picture with this number.
    Picture(usize),
}

/// An image that shares surface with a view.
#[derive(Serialize)]
pub(crate) struct Partner {
    #[serde(flatten)]
    image: Shown,
    /// The share of the view's points that this image sees, and the share of its points that the view sees.
    shared: [f64; 2],
    /// The median angle between the directions to both cameras.
    angle_deg: Option<f64>,
    distance_m: f64,
    turn_deg: f64,
    /// Places that both show: x and y in the view, then x and y in this image, in pixels of the data set.
    points: Vec<[f64; 4]>,
}

/// The pairs of an area, and its images.
pub(crate) struct Pairs<'a> {
    pub(super) columns: &'a PairColumns,
    /// The images in the order of the columns; `None` for an image that is not shown.
    pub(super) members: Vec<Option<Member<'a>>>,
    rows: BTreeMap<Shown, usize>,
}

/// A pair of images: its place in the columns, and the other image.
pub(super) struct Pair {
    pub(super) at: usize,
    pub(super) other: usize,
}

/// Fails if an image of the pairs is none of the area's images, which `is_known` tells.
pub(crate) fn check(
    path: &Path,
    columns: &PairColumns,
    is_known: impl Fn(&str) -> bool,
) -> Result<(), FileError> {
    match columns.images.iter().find(|name| !is_known(name)) {
        Some(name) => Err(FileError::format(path, format!("the area has no image {name}"))),
        None => Ok(()),
    }
}

impl<'a> Pairs<'a> {
    /// Takes the pairs of an area. `members` has its images that are shown, by their names in the columns.
    pub(crate) fn new(columns: &'a PairColumns, members: &BTreeMap<String, Member<'a>>) -> Self {
        let members: Vec<_> = columns.images.iter().map(|name| members.get(name).copied()).collect();
        let rows = members.iter().enumerate();
        let rows = rows
            .filter_map(|(row, member)| Some((member.as_ref()?.shown, row)))
            .collect();
        Self { columns, members, rows }
    }

    /// Returns the places of the pairs of an image.
    fn range(&self, row: usize) -> Range<usize> {
        let place = |row| self.columns.start.get(row).map_or(0, |start: &u64| *start as usize);
        place(row)..place(row + 1)
    }

    /// Returns the pairs of an image.
    pub(super) fn of(&self, row: usize) -> impl Iterator<Item = Pair> {
        let pairs = self.range(row);
        pairs.filter_map(|at| Some(Pair { at, other: *self.columns.other.get(at)? as usize }))
    }

    /// Returns the shares of both images of a pair that the other one sees.
    pub(super) fn shared(&self, row: usize, pair: &Pair) -> [f32; 2] {
        let overlap = |at: usize| self.columns.overlap.get(at).copied().filter(|share| share.is_finite());
        // A row is sorted by the other image.
        let back = self.range(pair.other);
        let others = self.columns.other.get(back.clone()).unwrap_or_default();
        let back = others
            .binary_search_by_key(&row, |other| *other as usize)
            .map(|i| back.start + i);
        [overlap(pair.at), back.ok().and_then(overlap)].map(Option::unwrap_or_default)
    }

    /// Returns the images that share most with a view: first those at its own place, then those at others,
    /// each with the highest mean of both shares first. `scene` is the area's mesh; without it they have no
    /// places.
    pub(crate) fn partners(&self, view: Shown, scene: Option<&Scene<'_>>) -> Vec<Partner> {
        let Some(&row) = self.rows.get(&view) else { return Vec::new() };
        let distance = |at: usize| self.columns.distance_m.get(at).copied().unwrap_or_default();
        let mut ranked: Vec<(bool, f32, Pair)> = self
            .of(row)
            .filter(|pair| matches!(self.members.get(pair.other), Some(Some(_))))
            .map(|pair| {
                let [here, there] = self.shared(row, &pair);
                (distance(pair.at) >= SAME_PLACE_M, here + there, pair)
            })
            .collect();
        // The first of equals is the one that comes first in the file.
        ranked.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));

        let mut taken = [0; 2];
        ranked.retain(|(is_elsewhere, ..)| {
            let [here, there] = &mut taken;
            let count = if *is_elsewhere { there } else { here };
            *count += 1;
            *count <= MOST_PARTNERS
        });
        ranked
            .iter()
            .filter_map(|(.., pair)| self.partner(row, pair, scene))
            .collect()
    }

    fn partner(&self, row: usize, pair: &Pair, scene: Option<&Scene<'_>>) -> Option<Partner> {
        let (view, other) = ((*self.members.get(row)?)?, (*self.members.get(pair.other)?)?);
        let PairColumns { angle_deg, distance_m, turn_deg, .. } = self.columns;
        let value = |column: &[f32]| column.get(pair.at).copied().filter(|v| v.is_finite()).map(f64::from);

        let cameras = view.camera.zip(other.camera);
        let points = scene.zip(cameras).map(|(scene, (a, b))| places(scene, a, b));
        Some(Partner {
            image: other.shown,
            shared: self.shared(row, pair).map(|share| rounded(share.into(), 3)),
            angle_deg: value(angle_deg).map(|angle| rounded(angle, 1)),
            distance_m: rounded(value(distance_m)?, 3),
            turn_deg: rounded(value(turn_deg)?, 1),
            points: points.unwrap_or_default(),
        })
    }
}

/// Returns places that a view and another image show, spread over the view. In the view they are middles of
/// pixels.
fn places(scene: &Scene<'_>, view: &Camera, other: &Camera) -> Vec<[f64; 4]> {
    // Every n-th pixel makes a smaller image, whose rays go through middles of the view's pixels.
    let step = (view.width / COLUMNS).max(1);
    let offset = f64::from(step / 2) + 0.5;
    let step_px = f64::from(step);
    let center = (view.center_px() - offset) / step_px + 0.5;
    let size = [view.width, view.height].map(|side| (side / step).max(1));
    let few = Camera::pinhole(view.pose, view.focal_px() / step_px, center, size[0], size[1]);
    let Ok(few) = few else { return Vec::new() };

    let found = correspondences(scene, [&few, other], MOST_PLACES);
    let places = found.iter().map(|place| {
        let [here, there] = place.pixels;
        let here: DVec2 = (here - 0.5) * step_px + dvec2(offset, offset);
        [here.x, here.y, there.x, there.y].map(|c| rounded(c, 2))
    });
    places.collect()
}
