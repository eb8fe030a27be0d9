//! The structure of a bare mesh: floors, ceilings and walls, and rooms with door lines.
//!
//! [`find_structure`] needs no labels, only metres and Z up. What it finds are proposals for a person to
//! accept. Nothing depends on axes but Z, so walls may run in any direction, and a scan may lack its
//! ceilings.
//!
//! The mesh is sampled into the columns of a grid over the plan. `storeys` finds the heights of floors, where
//! much free space begins. In each `storey`, a wall is what fills the height between doors and the ceiling:
//! that is so above doors too, and furniture does not reach there. `rooms` cuts the free space between walls
//! at narrow passages. `planes` finds the planes of each room, and `surfaces` takes those that bound it.
//! `outline` draws the room with few corners, on its walls. `rims` adds the faces of rounded corners, and
//! those that noise has turned.
//!
//! Doors, windows and boards in the plane of a wall are proposed as the wall, to be cut out. Columns and
//! beams are not proposed. `halls` are rooms of a storey that go on through those above it.

mod distance;
mod halls;
mod outline;
mod planes;
mod rims;
mod rooms;
mod scan;
mod storey;
mod storeys;
mod surfaces;

use crate::labelling::{FaceRuns, Room, RoomPart};
use crate::segments::smoothed;
use distance::{distances, spread};
use halls::Halls;
use planes::Plane;
use rims::{Sheet, rims};
use s3d_geom::TriMesh;
use scan::{Facet, Grid, Scan};
use serde::Serialize;
use storey::{Fronts, Storey};
use surfaces::Place;

/// A wall lies no farther outside of the free space of a room than this, metres.
const WALL_M: f64 = 0.3;

/// Rooms reach so far below their floor and above their ceiling, metres.
const BEYOND_M: f64 = 0.1;

/// The height of a room that has neither ceiling nor walls above a person's height, metres.
const USUAL_M: f64 = 2.5;

/// What bounds rooms, and the rooms.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Structure {
    /// Floors, ceilings and walls, room by room. No face is in two of them.
    pub surfaces: Vec<Surface>,
    /// The rooms, without types and names, storey by storey from below.
    pub rooms: Vec<Room>,
}

/// A surface that bounds a room: its floor, its ceiling, or one of its walls.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Surface {
    /// `floor`, `ceiling` or `wall`.
    pub class: &'static str,
    /// Its faces, at least one.
    pub faces: FaceRuns,
    /// The index of its room in [`Structure::rooms`].
    pub room: Option<usize>,
    /// Its area, m².
    pub area_m2: f64,
}

/// Finds the floors, ceilings, walls and rooms of a mesh. A mesh without rooms has none.
///
/// ```
/// use s3d_annotate::structure::find_structure;
/// use s3d_geom::{MeshParts, TriMesh, glam::{Vec3, vec3}, primitives::cuboid};
///
/// // The inside of a box of 4 × 3 × 2.6 m, with a chest in it.
/// let mut parts = cuboid(Vec3::ZERO, vec3(4.0, 3.0, 2.6));
/// parts.faces.iter_mut().for_each(|face| face.swap(1, 2));
/// parts.append(cuboid(vec3(1.0, 1.0, 0.0), vec3(1.8, 1.5, 0.6)));
/// let found = find_structure(&TriMesh::new(parts)?);
///
/// let classes: Vec<&str> = found.surfaces.iter().map(|surface| surface.class).collect();
/// assert_eq!(classes, ["floor", "ceiling", "wall", "wall", "wall", "wall"]);
/// assert_eq!(found.rooms.len(), 1);
/// assert_eq!(found.rooms[0].parts[0].outline.len(), 4);
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub fn find_structure(mesh: &TriMesh) -> Structure {
    let (borders, normals) = smoothed(mesh);
    let Some(scan) = Scan::new(mesh, &normals) else { return Structure::default() };
    let mut floors = storeys::floors(&scan);
    let fronts = Fronts::find(&scan, &mut floors);

    let mut found = Structure::default();
    let mut is_taken = vec![false; scan.facets.len()];
    let mut sheets = Vec::new();
    let mut ceiling_below_m = f64::NEG_INFINITY;
    for place in 0..floors.len() {
        let storey = Storey::new(&scan, &floors, place..place + 1, fronts);
        let finder =
            Finder { mesh, scan: &scan, storey: &storey, floors: &floors, place, fronts, ceiling_below_m };
        ceiling_below_m = finder.find(&mut is_taken, &mut found, &mut sheets);
    }
    add_rims(mesh, &scan, fronts, &borders, &sheets, &mut found.surfaces);
    found
}

/// Adds what the planes leave out between surfaces and within them. `borders` are the pairs of faces that
/// share an edge, `sheets` the planes of each surface.
fn add_rims(
    mesh: &TriMesh,
    scan: &Scan,
    fronts: Fronts,
    borders: &[[u32; 2]],
    sheets: &[Vec<Sheet>],
    surfaces: &mut [Surface],
) {
    let mut surface_of = vec![None; scan.facets.len()];
    for (number, surface) in (0u32..).zip(&*surfaces) {
        surface
            .faces
            .iter()
            .for_each(|face| surface_of[face as usize] = Some(number));
    }
    let mut more: Vec<Vec<u32>> = vec![Vec::new(); surfaces.len()];
    let has_sides = fronts != Fronts::Mixed;
    for (face, surface) in rims(mesh, &scan.facets, has_sides, borders, &surface_of, sheets) {
        more[surface as usize].push(face);
    }
    for (surface, more) in surfaces.iter_mut().zip(more) {
        surface.area_m2 += more.iter().map(|face| scan.facet(*face).area_m2).sum::<f64>();
        surface.faces = surface.faces.iter().chain(more).collect();
    }
}

/// Finds the structure of a storey.
struct Finder<'a> {
    mesh: &'a TriMesh,
    scan: &'a Scan,
    storey: &'a Storey,
    /// The heights of all floors, ascending, metres.
    floors: &'a [f64],
    /// The place of the storey among them.
    place: usize,
    fronts: Fronts,
    /// The highest ceiling of the storeys below, metres.
    ceiling_below_m: f64,
}

impl Finder<'_> {
    /// Adds the rooms and surfaces of the storey, with the planes of each surface, and returns its highest
    /// ceiling below the next storey, metres.
    fn find(&self, is_taken: &mut [bool], found: &mut Structure, sheets: &mut Vec<Vec<Sheet>>) -> f64 {
        let grid = &self.scan.grid;
        let (room_of_cell, count) = rooms::rooms(self.scan, self.storey);
        let [mut rim_of_cell, mut near_of_cell] = [room_of_cell.clone(), room_of_cell.clone()];
        spread(grid, &mut rim_of_cell, 2);
        spread(grid, &mut near_of_cell, (WALL_M / grid.step_m) as usize);
        let depth = distances(grid, |cell| room_of_cell[cell] == 0);
        let halls =
            Halls::find(self.scan, self.floors, self.place, self.storey, self.fronts, &room_of_cell, count);

        // The faces and the cells near each room. Above the storey, other rooms may be as near as a hall.
        let mut faces_of = vec![Vec::new(); count as usize + 1];
        for (face, facet) in (0u32..).zip(&self.scan.facets) {
            let z = facet.middle.z;
            if z >= self.storey.low_m && z <= halls.high_m().max(self.storey.high_m) {
                let is_above = z > self.storey.high_m;
                let near_of_cell = if is_above { &rim_of_cell } else { &near_of_cell };
                let room = self.room_of(facet, &rim_of_cell, near_of_cell);
                if !is_above || halls.of(room).is_some_and(|hall| z <= hall.high_m) {
                    faces_of[room as usize].push(face);
                }
            }
        }
        let mut cells_of = vec![Vec::new(); count as usize + 1];
        let mut outline_of_cell = filled_out(grid, &room_of_cell, &near_of_cell);
        spread(grid, &mut outline_of_cell, 1);
        for (cell, room) in outline_of_cell.iter().enumerate() {
            cells_of[*room as usize].push(cell);
        }

        let mut bounds = Vec::new();
        for room in 1..=count {
            let place = Place {
                mesh: self.mesh,
                scan: self.scan,
                storey: self.storey,
                hall: halls.of(room),
                fronts: self.fronts,
                room_of_cell: &room_of_cell,
                rim_of_cell: &rim_of_cell,
                near_of_cell: &near_of_cell,
                depth: &depth,
                room,
            };
            let faces = &faces_of[room as usize];
            let walls = place.walls(faces);
            let cells = &cells_of[room as usize];
            let outlines = outline::outlines(self.scan, cells, &walls);
            if outlines.is_empty() {
                continue;
            }
            bounds.push((
                found.rooms.len(),
                room,
                self.heights(halls.of(room).unwrap_or(self.storey), cells),
            ));
            let index = Some(found.rooms.len());
            let parts = outlines
                .into_iter()
                .map(|outline| RoomPart { outline, heights: [0.0; 2] });
            found.rooms.push(Room { parts: parts.collect(), ..Room::default() });

            let mut add = |class: &'static str, planes: &[Plane]| {
                let faces = planes.iter().flat_map(|plane| plane.faces.iter().copied());
                let faces: FaceRuns = faces
                    .filter(|face| !std::mem::replace(&mut is_taken[*face as usize], true))
                    .collect();
                if !faces.is_empty() {
                    let area_m2 = faces.iter().map(|face| self.scan.facet(face).area_m2).sum();
                    found.surfaces.push(Surface { class, faces, room: index, area_m2 });
                    sheets.push(planes.iter().map(Sheet::of).collect());
                }
            };
            add("floor", &place.floor(faces));
            add("ceiling", &place.ceiling(faces));
            walls.iter().for_each(|wall| add("wall", std::slice::from_ref(wall)));
        }

        // Storeys meet in the middle of the slab if it is thin.
        let is_hall = |room: u32| halls.of(room).is_some();
        let highest = bounds
            .iter()
            .filter(|(_, room, _)| !is_hall(*room))
            .fold(f64::NEG_INFINITY, |highest, (.., [_, top])| highest.max(*top));
        let low = self.storey.floor_m - BEYOND_M.min(0.5 * (self.storey.floor_m - self.ceiling_below_m));
        for (index, room, [bottom, top]) in bounds {
            let bottom = (bottom - BEYOND_M).min(self.storey.floor_m - BEYOND_M);
            let highest = if is_hall(room) { top } else { highest };
            let above = halls.of(room).unwrap_or(self.storey).above_m;
            let heights = [
                if self.ceiling_below_m.is_finite() {
                    bottom.max(low)
                } else {
                    bottom
                },
                (top + BEYOND_M).min(above - BEYOND_M.min(0.5 * (above - highest))),
            ];
            found.rooms[index]
                .parts
                .iter_mut()
                .for_each(|part| part.heights = heights);
        }
        highest
    }

    /// Returns the room that a face bounds, or 0: the one that its front looks into, or the one nearest to
    /// it. A wall may be a single sheet between two rooms.
    fn room_of(&self, facet: &Facet, rim_of_cell: &[u32], near_of_cell: &[u32]) -> u32 {
        let place = facet.middle.truncate();
        let near = near_of_cell[self.scan.grid.cell(place)];
        let side = match self.fronts {
            Fronts::Inside => 1.0,
            Fronts::Outside => -1.0,
            Fronts::Mixed => return near,
        };
        if !facet.is_upright() {
            return near;
        }
        let aside = facet.normal.truncate().normalize_or_zero() * (side * surfaces::ASIDE_M);
        let before = self.scan.grid.cell(place + aside);
        match (rim_of_cell[before], near_of_cell[before]) {
            (room, _) if room != 0 => room,
            // A beam along a wall cuts a strip of floor off the room.
            (_, room) if room != 0 && self.storey.has_floor[before] => room,
            _ => near,
        }
    }

    /// Returns the heights of the floor and of the highest ceiling of a room, metres.
    fn heights(&self, storey: &Storey, cells: &[usize]) -> [f64; 2] {
        let mut tops: Vec<f32> = cells
            .iter()
            .map(|cell| storey.ceiling_m[*cell])
            .filter(|top| top.is_finite())
            .collect();
        tops.sort_unstable_by(f32::total_cmp);
        // A few columns see through a hole.
        let top = tops.get(tops.len() * 99 / 100).map(|top| f64::from(*top));
        let floor_m = storey.floor_m;
        [floor_m, top.unwrap_or(floor_m + USUAL_M).min(storey.above_m)]
    }
}

/// Returns the room of each cell, with the narrow notches filled that columns and shelves leave: rooms grow
/// by the distance of walls and shrink again, a closing of mathematical morphology (Serra, "Image analysis
/// and mathematical morphology", 1982).
fn filled_out(grid: &Grid, room_of_cell: &[u32], near_of_cell: &[u32]) -> Vec<u32> {
    let is_border = |cell: usize| {
        let near = near_of_cell[cell];
        near == 0 || grid.beside(cell).any(|next| near_of_cell[next] != near)
    };
    let distance = distances(grid, is_border);
    let reach = (WALL_M / grid.step_m) as f32;
    let of = |cell: usize| match room_of_cell[cell] {
        0 if distance[cell] >= reach => near_of_cell[cell],
        room => room,
    };
    (0..room_of_cell.len()).map(of).collect()
}
