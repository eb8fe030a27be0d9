//! Floor, ceiling and walls of a room.

use super::planes::{Plane, planes};
use super::scan::{OVERHEAD, Scan, for_samples};
use super::storey::{Fronts, Storey};
use s3d_geom::TriMesh;
use s3d_geom::glam::DVec3;
use std::collections::BTreeMap;

/// The least size of a plane of a floor or ceiling, m².
const LEAST_LEVEL_M2: f64 = 0.3;

/// The least size of a wall, m².
const LEAST_WALL_M2: f64 = 0.4;

/// The share of a surface that must be the outermost of its columns.
const OUTERMOST: f64 = 0.6;

/// A second floor in a room is no higher above the first than a step, metres, …
const STEP_M: f64 = 0.25;

/// … and no smaller than this, m².
const LEAST_STEP_M2: f64 = 1.0;

/// The length over which a wall reaches up to the ceiling without a gap, metres. Most columns are narrower.
const LEAST_LENGTH_M: f64 = 0.4;

/// The edge of the squares in which the extent of a wall is measured, metres.
const SQUARE_M: f64 = 0.1;

/// How far inside and outside of a wall the room is looked for, metres.
pub(super) const ASIDE_M: f64 = 0.2;

/// What faces of a room need.
pub(super) struct Place<'a> {
    pub(super) mesh: &'a TriMesh,
    pub(super) scan: &'a Scan,
    pub(super) storey: &'a Storey,
    /// For a hall, all storeys that it goes through as one.
    pub(super) hall: Option<&'a Storey>,
    pub(super) fronts: Fronts,
    /// The room of each cell, from 1, or 0.
    pub(super) room_of_cell: &'a [u32],
    /// The same, with the cells of the walls around a room.
    pub(super) rim_of_cell: &'a [u32],
    /// The same, with the cells up to 30 cm from a room.
    pub(super) near_of_cell: &'a [u32],
    /// The distance of each cell to the nearest one outside of rooms, in cells.
    pub(super) depth: &'a [f32],
    /// The number of the room.
    pub(super) room: u32,
}

impl Place<'_> {
    /// Returns the planes of the floor among some faces, the largest first.
    pub(super) fn floor(&self, faces: &[u32]) -> Vec<Plane> {
        let is_candidate = |face: &u32| {
            let facet = self.scan.facet(*face);
            let is_low = facet.middle.z < self.storey.floor_m + 0.6;
            is_low && facet.is_level() && self.fronts.look(facet.normal.z)
        };
        let mut found = self.level_planes(faces, is_candidate);
        found.sort_by(|a, b| b.area_m2.total_cmp(&a.area_m2));
        let Some(main_m) = found.first().map(|main| self.height(main)) else { return found };
        let mut is_first = true;
        found.retain(|plane| {
            let is_step = self.height(plane) < main_m + STEP_M && plane.area_m2 >= LEAST_STEP_M2;
            std::mem::take(&mut is_first) || (is_step && self.is_outermost(self.storey, plane, -1.0))
        });
        found
    }

    /// Returns the planes of the ceiling among some faces. Ceilings may have steps and slopes. The outermost
    /// surface is the ceiling: lamps and beams hang below it.
    ///
    /// A hall has one above its own storey, and may have another under a gallery.
    pub(super) fn ceiling(&self, faces: &[u32]) -> Vec<Plane> {
        let mut all = Vec::new();
        let mut low_m = self.storey.floor_m + 1.7;
        for storey in std::iter::once(self.storey).chain(self.hall) {
            let is_candidate = |face: &u32| {
                let facet = self.scan.facet(*face);
                let cell = self.scan.grid.cell(facet.middle.truncate());
                let is_high = facet.middle.z > low_m && facet.middle.z <= storey.high_m;
                is_high
                    && !storey.is_recess(cell)
                    && facet.normal.z.abs() >= OVERHEAD
                    && self.fronts.look(-facet.normal.z)
            };
            let mut found = self.level_planes(faces, is_candidate);
            found.retain(|plane| self.is_outermost(storey, plane, 1.0));
            all.extend(found);
            low_m = storey.high_m;
        }
        all
    }

    fn level_planes(&self, faces: &[u32], is_candidate: impl Fn(&u32) -> bool) -> Vec<Plane> {
        let candidates: Vec<u32> = faces.iter().copied().filter(is_candidate).collect();
        planes(&self.scan.facets, &candidates, LEAST_LEVEL_M2, self.fronts != Fronts::Mixed)
    }

    /// The mean height of a plane, metres.
    fn height(&self, plane: &Plane) -> f64 {
        let facets = plane.faces.iter().map(|face| self.scan.facet(*face));
        let sum: f64 = facets.map(|facet| facet.middle.z * facet.area_m2).sum();
        sum / plane.area_m2
    }

    /// Returns whether a plane is the highest (`side` 1) or lowest (−1) surface of most of its columns.
    fn is_outermost(&self, storey: &Storey, plane: &Plane, side: f64) -> bool {
        let reach_m = plane.tolerance_m + 0.005;
        let mut outermost_m2 = 0.0;
        for face in &plane.faces {
            let facet = self.scan.facet(*face);
            let cell = self.scan.grid.cell(facet.middle.truncate());
            let middle = self.scan.grid.middle(cell);
            let height = facet.height_at(middle);
            let is_beyond = self.scan.column(cell).iter().any(|sample| {
                let other = self.scan.facet(sample.face);
                let z = f64::from(sample.z);
                z >= storey.low_m
                    && z <= storey.high_m
                    && other.normal.z.abs() >= OVERHEAD
                    && self.fronts.look(-side * other.normal.z)
                    && side * (other.height_at(middle) - height) > reach_m
            });
            outermost_m2 += if is_beyond { 0.0 } else { facet.area_m2 };
        }
        outermost_m2 >= OUTERMOST * plane.area_m2
    }

    /// Returns the walls among some faces: upright planes at the rim of the room that reach up to its
    /// ceiling.
    pub(super) fn walls(&self, faces: &[u32]) -> Vec<Plane> {
        let candidates: Vec<u32> = faces.iter().copied().filter(|face| self.is_at_rim(*face)).collect();
        let has_sides = self.fronts != Fronts::Mixed;
        let mut found = planes(&self.scan.facets, &candidates, LEAST_WALL_M2, has_sides);
        let storeys = || std::iter::once(self.storey).chain(self.hall);
        found.retain(|plane| storeys().any(|storey| self.reaches_up(storey, plane)));
        found
    }

    /// Returns whether a face is upright, with the room on its front and none on its back.
    fn is_at_rim(&self, face: u32) -> bool {
        let facet = self.scan.facet(face);
        let cell = self.scan.grid.cell(facet.middle.truncate());
        if !facet.is_upright() || f64::from(self.depth[cell]) * self.scan.grid.step_m > ASIDE_M + 0.05 {
            return false;
        }
        let aside = facet.normal.truncate().normalize_or_zero() * ASIDE_M;
        let side = |sign: f64| {
            let at = |sign: f64| self.scan.grid.cell(facet.middle.truncate() + aside * sign);
            let front = at(sign);
            // A beam along a wall cuts a strip of floor off the room.
            let is_strip = self.near_of_cell[front] == self.room && self.storey.has_floor[front];
            let is_before = self.rim_of_cell[front] == self.room || is_strip;
            is_before && self.room_of_cell[at(-sign)] != self.room
        };
        match self.fronts {
            Fronts::Inside => side(1.0),
            Fronts::Outside => side(-1.0),
            Fronts::Mixed => side(1.0) || side(-1.0),
        }
    }

    /// Returns whether a wall reaches up to the ceiling over some of its length. Doors, cupboards and the
    /// sides of beams do not.
    fn reaches_up(&self, storey: &Storey, plane: &Plane) -> bool {
        let along = plane.normal.cross(DVec3::Z).normalize_or_zero();
        let low_of = |ceiling_m: f64| {
            let top = ceiling_m - SQUARE_M;
            (top, (top - 0.8).max(storey.floor_m + 1.8).min(top - 0.4))
        };
        let mut columns: BTreeMap<i64, Column> = BTreeMap::new();
        for face in &plane.faces {
            let corners = self.mesh.triangle(*face).map(|corner| corner.as_dvec3());
            for_samples(corners, self.scan.grid.step_m, |point| {
                let cell = self.scan.grid.cell(point.truncate());
                let (top, low) = low_of(f64::from(storey.ceiling_m[cell]));
                if point.z >= low && point.z < top {
                    let along_m = point.dot(along);
                    let column = columns.entry((along_m / SQUARE_M).floor() as i64).or_default();
                    column.squares |= 1 << (((point.z - low) / SQUARE_M) as u32).min(31);
                    column.all = column.all.max(((top - low) / SQUARE_M).round() as u32);
                    column.range_m = [column.range_m[0].min(along_m), column.range_m[1].max(along_m)];
                }
            });
        }

        let mut run: Option<(i64, f64)> = None;
        for (&place, column) in &columns {
            if f64::from(column.squares.count_ones()) < 0.5 * f64::from(column.all) {
                continue;
            }
            let start_m = match run {
                Some((last, start_m)) if place == last + 1 => start_m,
                _ => column.range_m[0],
            };
            if column.range_m[1] - start_m >= LEAST_LENGTH_M {
                return true;
            }
            run = Some((place, start_m));
        }
        false
    }
}

/// A strip of a wall from the height of a person to the ceiling.
struct Column {
    /// A bit for each square with a part of the wall.
    squares: u32,
    /// The number of squares.
    all: u32,
    /// The range of the samples along the wall, metres.
    range_m: [f64; 2],
}

impl Default for Column {
    fn default() -> Self {
        Self { squares: 0, all: 0, range_m: [f64::INFINITY, f64::NEG_INFINITY] }
    }
}
