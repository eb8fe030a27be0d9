//! The heights of a room's points, place by place.

use s3d_geom::FootprintBuilder;
use std::collections::BTreeMap;

/// The cells of a footprint along a side of a place. With cells of 5 cm, a place is 25 cm wide.
const CELLS: i64 = 5;

/// Two rooms meet at a place if this share of the lower one's height there is in both.
const MUCH: f32 = 0.2;

/// A floor without anything above it counts as this high, metres.
const LEAST_M: f32 = 0.1;

/// The lowest and highest point of a room in each square of a grid that has a point.
#[derive(Clone, Debug, Default)]
pub(crate) struct Columns(BTreeMap<[i64; 2], [f32; 2]>);

impl Columns {
    /// Returns the columns of the points that a footprint is drawn from.
    pub(crate) fn of(points: &FootprintBuilder) -> Self {
        let mut columns: BTreeMap<[i64; 2], [f32; 2]> = BTreeMap::new();
        for (cell, [low, high]) in points.columns() {
            let column = columns.entry(cell.map(|c| c.div_euclid(CELLS))).or_insert([low, high]);
            *column = [column[0].min(low), column[1].max(high)];
        }
        Self(columns)
    }

    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns the share of these columns at whose place and height `other` has one, too. A room above or
    /// below shares nothing.
    pub(crate) fn share_in(&self, other: &Self) -> f64 {
        let meets = |(place, column): &(&[i64; 2], &[f32; 2])| {
            other.0.get(*place).is_some_and(|other| meet(**column, *other))
        };
        self.0.iter().filter(meets).count() as f64 / self.len().max(1) as f64
    }
}

/// Whether two columns have much of the lower one's height in common.
fn meet(a: [f32; 2], b: [f32; 2]) -> bool {
    let height = |[low, high]: [f32; 2]| (high - low).max(LEAST_M);
    let common = (a[0] + height(a)).min(b[0] + height(b)) - a[0].max(b[0]);
    common > MUCH * height(a).min(height(b))
}
