//! Merges the cells between dividers where no wall stands between them.

use super::dividers::{Divider, Dividers};
use crate::surfel::Surfel;
use s3d_geom::Aabb;

/// The space of surfels that belong to no space.
pub const NO_SPACE: u32 = u32::MAX;

/// The least number of surfels of a space: 2 m² of surface.
const LEAST_SURFELS: usize = 800;
/// The least length and width of a space, in metres.
const LEAST_M: f32 = 0.6;
/// The width of the columns that the face between two cells is cut into, in metres.
const COLUMN_M: f32 = 0.1;
/// How far a wall may lie beyond the edge of the gap, in metres.
const LAYER_M: f32 = 0.1;
/// A column has a wall if this many surfels stand in it on one side: it holds two columns of cells of 5 cm,
/// so that these are 1.6 m of height.
const WALL_SURFELS: u32 = 64;
/// Ceilings lie above this height over the floor, and doors end below it, in metres.
const OVERHEAD_M: f32 = 2.2;
/// Neighbours merge if this many columns between them are open, and this share of the columns that tell.
const OPEN_COLUMNS: usize = 4;
const OPEN_SHARE: f64 = 0.4;

/// One column of a face.
#[derive(Clone, Copy, Default)]
struct Column {
    /// The surfels of walls before and behind the divider.
    walls: [u32; 2],
    /// Whether the ceiling goes through.
    passes: bool,
}

/// Returns the space of each surfel, and the number of spaces. Spaces are numbered by their first cell: by y,
/// then by x.
pub fn merge_cells(surfels: &[Surfel], dividers: &Dividers) -> (Vec<u32>, u32) {
    let place = |axis: usize, x: f32| dividers.axes[axis].partition_point(|d| d.at <= x);
    let width = dividers.axes[0].len() + 1;
    let height = dividers.axes[1].len() + 1;
    let cell_of = |s: &Surfel| place(1, s.position.y) * width + place(0, s.position.x);
    let cells: Vec<usize> = surfels.iter().map(cell_of).collect();
    let mut counts = vec![0usize; width * height];
    cells.iter().for_each(|&c| counts[c] += 1);

    // Cells on both sides of an open face are one group.
    let mut groups = Groups::new(width * height);
    for axis in 0..2 {
        for (number, divider) in dividers.axes[axis].iter().enumerate() {
            for (across, columns) in faces(axis, divider, surfels, dividers).into_iter().enumerate() {
                let before = if axis == 0 {
                    across * width + number
                } else {
                    number * width + across
                };
                let after = before + if axis == 0 { 1 } else { width };
                if counts[before] > 0 && counts[after] > 0 && is_open(&columns) {
                    groups.join(before, after);
                }
            }
        }
    }

    let group_of_cell: Vec<usize> = (0..counts.len()).map(|cell| groups.of(cell)).collect();
    let mut found: Vec<(usize, Aabb)> = vec![(0, Aabb::EMPTY); counts.len()];
    for (surfel, &cell) in surfels.iter().zip(&cells) {
        let (size, bounds) = &mut found[group_of_cell[cell]];
        *size += 1;
        *bounds = bounds.with(surfel.position);
    }

    let (numbers, count) = number_spaces(&found);
    (cells.into_iter().map(|cell| numbers[group_of_cell[cell]]).collect(), count)
}

/// Whether a group of this size and box is large enough for a space.
fn is_space((size, b): &(usize, Aabb)) -> bool {
    *size >= LEAST_SURFELS && b.size().truncate().min_element() >= LEAST_M
}

/// Numbers the groups that are large enough for a space. A smaller group, such as the panes of a window, gets
/// the number of the space beside it. A group without surfels gets [`NO_SPACE`]. `groups` has the size and
/// the box of each.
fn number_spaces(groups: &[(usize, Aabb)]) -> (Vec<u32>, u32) {
    let mut numbers = vec![NO_SPACE; groups.len()];
    let mut count = 0;
    for (number, _) in numbers.iter_mut().zip(groups).filter(|(_, g)| is_space(g)) {
        *number = count;
        count += 1;
    }

    for (i, (_, b)) in groups.iter().enumerate().filter(|(_, g)| g.0 > 0 && !is_space(g)) {
        let spaces = (0..groups.len()).filter(|&j| is_space(&groups[j]));
        let nearest = spaces.map(|j| (gap(b, &groups[j].1), j)).reduce(|best, next| {
            let is_nearer = (next.0, groups[best.1].0) < (best.0, groups[next.1].0);
            if is_nearer { next } else { best }
        });
        if let Some((apart, j)) = nearest
            && apart <= LEAST_M
        {
            numbers[i] = numbers[j];
        }
    }
    (numbers, count)
}

fn gap(b: &Aabb, other: &Aabb) -> f32 {
    let apart = (b.min - other.max).max(other.min - b.max).truncate();
    apart.max_element().max(0.0)
}

/// Returns the columns of each face in the plane of a divider, in the order of the cuts across it.
fn faces(axis: usize, divider: &Divider, surfels: &[Surfel], dividers: &Dividers) -> Vec<Vec<Column>> {
    let cuts = &dividers.axes[1 - axis];
    let mut faces: Vec<(f32, Vec<Column>)> = Vec::new();
    let near = surfels
        .iter()
        .filter(|s| (s.position[axis] - divider.at).abs() <= 0.5 * divider.gap + LAYER_M);

    let least = near.clone().map(|s| s.position[1 - axis]).fold(f32::INFINITY, f32::min);
    let overhead = near.clone().map(|s| s.position.z).fold(f32::INFINITY, f32::min) + OVERHEAD_M;
    faces.push((least, Vec::new()));
    faces.extend(cuts.iter().map(|cut| (cut.at, Vec::new())));

    for s in near {
        let across = s.position[1 - axis];
        let (start, columns) = &mut faces[cuts.partition_point(|d| d.at <= across)];
        let place = ((across - *start).max(0.0) / COLUMN_M) as usize;
        if columns.len() <= place {
            columns.resize(place + 1, Column::default());
        }

        let beside = s.position[axis] - divider.at;
        if s.normal[axis].abs() > 0.7 {
            columns[place].walls[usize::from(beside > 0.0)] += 1;
        } else if s.normal.z.abs() > 0.7
            && s.position.z > overhead
            && beside.abs() < (0.4 * divider.gap).max(0.03)
        {
            columns[place].passes = true;
        }
    }
    faces.into_iter().map(|(_, columns)| columns).collect()
}

/// Whether the ceiling goes through in enough columns. It does above bookcases, and does not above doors.
fn is_open(columns: &[Column]) -> bool {
    let walls = columns
        .iter()
        .filter(|c| !c.passes && c.walls.into_iter().max() >= Some(WALL_SURFELS))
        .count();
    let open = columns.iter().filter(|c| c.passes).count();
    open >= OPEN_COLUMNS && open as f64 >= OPEN_SHARE * (open + walls) as f64
}

/// The transitive closure of mergers: a forest whose roots are the least members of their groups.
struct Groups(Vec<usize>);

impl Groups {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn of(&mut self, mut i: usize) -> usize {
        while self.0[i] != i {
            self.0[i] = self.0[self.0[i]];
            i = self.0[i];
        }
        i
    }

    fn join(&mut self, a: usize, b: usize) {
        let a = self.of(a);
        let b = self.of(b);
        self.0[a.max(b)] = a.min(b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spaces::dividers::find_dividers;
    use glam::{Vec3, vec3};

    #[test]
    fn connected_cells_are_one_group() {
        let mut groups = Groups::new(6);
        groups.join(4, 2);
        groups.join(5, 4);
        groups.join(1, 0);
        assert_eq!((0..6).map(|i| groups.of(i)).collect::<Vec<_>>(), [0, 0, 2, 3, 2, 2]);
    }

    fn group(size: usize, x: [f32; 2]) -> (usize, Aabb) {
        (size, Aabb { min: vec3(x[0], 0.0, 0.0), max: vec3(x[1], 3.0, 2.0) })
    }

    #[test]
    fn slivers_belong_to_the_space_beside_them() {
        let none = (0, Aabb::EMPTY);
        let groups = [
            none,
            group(900, [0.0, 4.0]),
            group(900, [4.25, 4.5]),
            group(9000, [4.75, 8.0]),
            group(900, [9.0, 9.1]),
        ];
        let (numbers, count) = number_spaces(&groups);
        // A sliver between two spaces belongs to the larger one, a sliver far from all belongs to none.
        assert_eq!((numbers, count), (vec![NO_SPACE, 0, 1, 1, NO_SPACE], 2));
    }

    fn middle_of(i: usize) -> f32 {
        0.025 + 0.05 * i as f32
    }

    /// Makes two rooms with floors and ceilings. A wall of 15 cm is between them, with a door of 0.9 m.
    fn two_rooms(wall: bool) -> Vec<Surfel> {
        let mut surfels = Vec::new();
        let mut add = |position: Vec3, normal: Vec3| {
            let extent = Aabb { min: position, max: position };
            surfels.push(Surfel { position, extent, normal, curvature: 0.0, color: Vec3::ZERO, room: 0 });
        };
        for (i, j) in (0..160).flat_map(|i| (0..80).map(move |j| (i, j))) {
            // The wall is x = 4 to 4.15; the door is y = 1 to 1.9.
            let [x, y] = [i, j].map(middle_of);
            let in_wall = wall && (4.0..4.15).contains(&x);
            let in_door = (1.0..1.9).contains(&y);
            if !in_wall || in_door {
                add(vec3(x, y, 0.0), Vec3::Z);
            }
            if !in_wall {
                add(vec3(x, y, 2.6), Vec3::Z);
            }
        }
        for (j, k) in (0..80).flat_map(|j| (0..52).map(move |k| (j, k))) {
            let [y, z] = [j, k].map(middle_of);
            if wall && (!(1.0..1.9).contains(&y) || z > 2.1) {
                add(vec3(3.995, y, z), Vec3::X);
                add(vec3(4.155, y, z), Vec3::X);
            }
        }
        surfels
    }

    #[test]
    fn a_wall_with_a_door_separates_rooms() {
        let dividers = find_dividers(&two_rooms(true));
        assert_eq!((dividers.axes[0].len(), dividers.axes[1].len()), (1, 0));
        assert!((dividers.axes[0][0].at - 4.075).abs() < 0.03, "{dividers:?}");
        let (of, count) = merge_cells(&two_rooms(true), &dividers);
        assert_eq!(count, 2);
        for (space, surfel) in of.iter().zip(two_rooms(true)) {
            assert_eq!(*space, u32::from(surfel.position.x >= dividers.axes[0][0].at));
        }
        // The same divider where there is no wall.
        assert_eq!(merge_cells(&two_rooms(false), &dividers).1, 1);
    }
}
