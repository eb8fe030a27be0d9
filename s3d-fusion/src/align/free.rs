//! Where a surface leaves room: above its floors, up to what is above them.
//!
//! No place of a scanner is needed. A floor was seen from above, so there is nothing between it and the
//! ceiling, and a wall of another scan that stands there contradicts.

use crate::register::ScanPoints;
use s3d_geom::glam::Vec3;
use std::collections::BTreeMap;

/// The edge of a column, metres.
pub(super) const COLUMN_M: f64 = 0.1;
/// What is nearer to a surface may be the surface itself, metres.
const MARGIN_M: f32 = 0.15;
/// Room below which a gap is none, metres: between floors and ceilings that are known to be such, and else.
/// A slab between storeys is no room.
const LEAST_ROOM_M: [f32; 2] = [0.5, 1.6];
/// The room above a floor that has nothing above it, metres.
const OPEN_ROOM_M: f32 = 1.0;
/// The least cosine of a floor's or a ceiling's normal with the upright axis.
const LEVEL: f32 = 0.9;

/// What a point of a column is.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Floor,
    Ceiling,
    Other,
}

/// The room above floors, column by column.
pub(super) struct FreeSpace {
    /// Heights between which a column is free, by its numbers along X and Y.
    columns: BTreeMap<[i32; 2], Vec<[f32; 2]>>,
}

impl FreeSpace {
    pub(super) fn new(points: &ScanPoints, has_sides: bool) -> Self {
        let mut heights: BTreeMap<[i32; 2], Vec<(f32, Kind)>> = BTreeMap::new();
        for (p, n) in points.positions.iter().zip(&points.normals) {
            let kind = match n.z {
                z if z.abs() < LEVEL => Kind::Other,
                z if z > 0.0 => Kind::Floor,
                _ => Kind::Ceiling,
            };
            heights.entry(column(*p)).or_default().push((p.z, kind));
        }

        let mut columns = BTreeMap::new();
        for at in heights.keys() {
            let free = free_heights(&around(&heights, *at), has_sides);
            if !free.is_empty() {
                columns.insert(*at, free);
            }
        }
        Self { columns }
    }

    /// Whether a point lies in free space.
    pub(super) fn contains(&self, p: Vec3) -> bool {
        let ranges = self.columns.get(&column(p));
        ranges.is_some_and(|ranges| ranges.iter().any(|[low, high]| (*low..=*high).contains(&p.z)))
    }

    /// The middles of the columns, with the heights between which they are free.
    pub(super) fn columns(&self) -> impl Iterator<Item = ([f32; 2], &[[f32; 2]])> {
        self.columns.iter().map(|(at, free)| {
            let middle = at.map(|i| ((f64::from(i) + 0.5) * COLUMN_M) as f32);
            (middle, free.as_slice())
        })
    }
}

fn column(p: Vec3) -> [i32; 2] {
    [p.x, p.y].map(|v| (f64::from(v) / COLUMN_M).floor() as i32)
}

/// The points of a column and of those around it, from the lowest.
fn around(heights: &BTreeMap<[i32; 2], Vec<(f32, Kind)>>, [x, y]: [i32; 2]) -> Vec<(f32, Kind)> {
    let mut all: Vec<(f32, Kind)> = Vec::new();
    for x in x.saturating_sub(1)..=x.saturating_add(1) {
        for y in y.saturating_sub(1)..=y.saturating_add(1) {
            all.extend(heights.get(&[x, y]).into_iter().flatten());
        }
    }
    all.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    all
}

fn free_heights(points: &[(f32, Kind)], has_sides: bool) -> Vec<[f32; 2]> {
    let least = LEAST_ROOM_M[usize::from(!has_sides)];
    let is_floor = |kind: Kind| kind == Kind::Floor || (!has_sides && kind == Kind::Ceiling);
    let is_ceiling = |kind: Kind| kind == Kind::Ceiling || (!has_sides && kind == Kind::Floor);
    let mut free = Vec::new();
    for pair in points.windows(2) {
        let [(low, below), (high, above)] = [pair[0], pair[1]];
        if high - low >= least && is_floor(below) && is_ceiling(above) {
            free.push([low + MARGIN_M, high - MARGIN_M]);
        }
    }
    if let Some(&(top, Kind::Floor)) = points.last().filter(|_| has_sides) {
        free.push([top + MARGIN_M, top + OPEN_ROOM_M]);
    }
    free
}
