//! Tables, seats and shelves. The middle of a thing's foot is at the origin of the frame. The thing looks
//! along −y, with its back to a wall.

use super::builder::{Builder, Side};
use crate::look::*;
use s3d_geom::glam::{Vec3, vec3};
use s3d_label::Class;

use Side::{Back, Bottom, Front, Left, Right, Top};

/// A table: a top on four legs.
pub(super) fn table(b: &mut Builder, width: f32, depth: f32, height: f32, top: Look) {
    b.begin(Class::TABLE);
    let x = 0.5 * width;
    let y = 0.5 * depth;
    b.cuboid([-x, -y, height - 0.035], [x, y, height], top, &[]);
    for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        let cx = sx * (x - 0.06);
        let cy = sy * (y - 0.06);
        b.cuboid(
            [cx - 0.025, cy - 0.025, 0.0],
            [cx + 0.025, cy + 0.025, height - 0.035],
            STEEL,
            &[Top, Bottom],
        );
    }
}

/// A desk: a table with a panel at its back and a chest of drawers under its right end.
pub(super) fn desk(b: &mut Builder, width: f32, depth: f32) {
    table(b, width, depth, 0.74, OAK);
    let x = 0.5 * width;
    let y = 0.5 * depth;
    b.cuboid([-x + 0.1, y - 0.05, 0.3], [x - 0.1, y - 0.03, 0.7], WHITE, &[]);
    let left = x - 0.55;
    let right = x - 0.12;
    let front = -y + 0.1;
    let back = y - 0.14;
    b.cuboid([left, front, 0.05], [right, back, 0.62], WHITE, &[]);
    for drawer in 0..3 {
        let z = 0.16 + 0.18 * drawer as f32;
        b.cuboid([left + 0.14, front - 0.02, z], [right - 0.14, front, z + 0.02], STEEL, &[Back]);
    }
}

/// A round table on one foot.
pub(super) fn round_table(b: &mut Builder, radius: f32, height: f32, top: Look) {
    b.begin(Class::TABLE);
    b.stump([0.0, 0.0, height - 0.03], [radius; 2], 0.03, 32, top, &[]);
    b.stump([0.0, 0.0, 0.02], [0.035; 2], height - 0.05, 12, STEEL, &[Top, Bottom]);
    b.stump([0.0, 0.0, 0.0], [0.26, 0.22], 0.02, 24, STEEL, &[Bottom]);
}

/// An office chair on a star of five feet.
pub(super) fn office_chair(b: &mut Builder, fabric: Look) {
    b.begin(Class::CHAIR);
    for arm in 0..5 {
        b.place(vec3(0.0, 0.0, 0.0), 72.0 * arm as f32 + 18.0, |b| {
            b.cuboid([0.036, -0.025, 0.05], [0.31, 0.025, 0.09], BLACK, &[Left]);
            b.cuboid([0.26, -0.02, 0.0], [0.31, 0.02, 0.05], BLACK, &[Top, Bottom]);
        });
    }

    b.stump([0.0, 0.0, 0.06], [0.04, 0.03], 0.37, 12, BLACK, &[Top]);
    b.cuboid([-0.24, -0.24, 0.43], [0.24, 0.23, 0.51], fabric, &[]);
    tilted_back(b, 0.22, 0.22, [0.6, 1.08], 0.07, fabric);
    b.cuboid([-0.03, 0.215, 0.45], [0.03, 0.25, 0.62], BLACK, &[]);

    for side in [-1.0, 1.0] {
        let x0 = side * 0.29 - 0.025;
        let x1 = side * 0.29 + 0.025;
        b.cuboid([x0, -0.12, 0.66], [x1, 0.16, 0.69], BLACK, &[]);
        b.cuboid([x0 + 0.01, 0.0, 0.47], [x1 - 0.01, 0.04, 0.66], BLACK, &[Top, Bottom]);
        let (from, to) = if side < 0.0 {
            (x0 + 0.01, -0.2)
        } else {
            (0.2, x1 - 0.01)
        };
        b.cuboid([from, 0.0, 0.455], [to, 0.04, 0.47], BLACK, &[]);
    }
}

/// The back of a seat, `half_width` to either side, from z `span[0]` to `span[1]`, leaning backwards.
fn tilted_back(b: &mut Builder, half_width: f32, y: f32, span: [f32; 2], lean: f32, look: Look) {
    let [z0, z1] = span;
    let [a, c, d, e] = back_ring(y, z0, half_width);
    let [f, g, h, i] = back_ring(y + lean, z1, half_width);
    b.hexahedron([a, c, d, e, f, g, h, i], look, &[]);
}

fn back_ring(y: f32, z: f32, half_width: f32) -> [Vec3; 4] {
    let x = half_width;
    let t = 0.06;
    [vec3(-x, y, z), vec3(x, y, z), vec3(x, y + t, z), vec3(-x, y + t, z)]
}

/// A chair with four wooden legs.
pub(super) fn chair(b: &mut Builder, fabric: Look) {
    b.begin(Class::CHAIR);
    for (x, y) in [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)] {
        b.cuboid([x - 0.02, y - 0.02, 0.0], [x + 0.02, y + 0.02, 0.42], WALNUT, &[Top, Bottom]);
    }
    b.cuboid([-0.23, -0.24, 0.42], [0.23, 0.23, 0.48], fabric, &[]);
    for x in [-0.19, 0.19] {
        b.cuboid([x - 0.015, 0.205, 0.48], [x + 0.015, 0.23, 0.66], WALNUT, &[Bottom]);
    }
    tilted_back(b, 0.22, 0.195, [0.6, 0.94], 0.05, fabric);
}

/// A bar stool.
pub(super) fn stool(b: &mut Builder, seat: Look) {
    b.begin(Class::CHAIR);
    b.stump([0.0, 0.0, 0.0], [0.2, 0.17], 0.025, 20, STEEL, &[Bottom]);
    b.stump([0.0, 0.0, 0.025], [0.025; 2], 0.675, 10, STEEL, &[Top, Bottom]);
    b.stump([0.0, 0.0, 0.7], [0.17, 0.18], 0.06, 20, seat, &[]);
    b.stump([0.0, 0.0, 0.28], [0.13; 2], 0.02, 16, STEEL, &[]);
}

/// A sofa for `seats` people.
pub(super) fn sofa(b: &mut Builder, seats: u32, fabric: Look, cushion: Look) {
    b.begin(Class::SOFA);
    let half = 0.5 * 0.66 * seats as f32;
    for (x, y) in [(-half, -0.36), (half, -0.36), (half, 0.36), (-half, 0.36)] {
        b.cuboid([x - 0.03, y - 0.03, 0.0], [x + 0.03, y + 0.03, 0.1], WALNUT, &[Top, Bottom]);
    }

    b.cuboid([-half, -0.42, 0.1], [half, 0.24, 0.3], fabric, &[Left, Right, Back]);
    b.cuboid([-half, 0.24, 0.1], [half, 0.44, 0.82], fabric, &[Front, Left, Right]);

    // The part of the back's front above the base, and its ends above the arms.
    b.panel([[-half, 0.3], [half, 0.3], [half, 0.82], [-half, 0.82]].map(|[x, z]| vec3(x, 0.24, z)), fabric);

    for side in [-1.0, 1.0] {
        let (x0, x1) = if side < 0.0 {
            (-half - 0.16, -half)
        } else {
            (half, half + 0.16)
        };
        b.cuboid([x0, -0.42, 0.1], [x1, 0.44, 0.6], fabric, &[]);
        let x = side * half;
        let mut end = [[0.24, 0.6], [0.44, 0.6], [0.44, 0.82], [0.24, 0.82]].map(|[y, z]| vec3(x, y, z));
        if side < 0.0 {
            end.reverse();
        }
        b.panel(end, fabric);
    }

    for seat in 0..seats {
        let x = -half + 0.66 * seat as f32;
        b.cuboid([x + 0.015, -0.43, 0.305], [x + 0.645, 0.22, 0.44], fabric, &[Bottom]);
        let back: [Vec3; 8] = std::array::from_fn(|i| {
            let left = [0, 3].contains(&(i % 4));
            let front = i % 4 < 2;
            let low = i < 4;
            let lean = if low { 0.0 } else { 0.09 };
            vec3(
                if left { x + 0.03 } else { x + 0.63 },
                if front { 0.02 + lean } else { 0.13 + lean },
                if low { 0.445 } else { 0.86 },
            )
        });
        b.hexahedron(back, fabric, &[Bottom]);
    }

    // A cushion thrown into the corner.
    b.place(vec3(half - 0.28, -0.1, 0.445), 24.0, |b| {
        let x = 0.21;
        let y = 0.05;
        b.hexahedron(
            [
                sloped_corner(-x, -y, 0.0),
                sloped_corner(x, -y, 0.0),
                sloped_corner(x, y, 0.0),
                sloped_corner(-x, y, 0.0),
                sloped_corner(-x, -y, 0.36),
                sloped_corner(x, -y, 0.36),
                sloped_corner(x, y, 0.36),
                sloped_corner(-x, y, 0.36),
            ],
            cushion,
            &[Bottom],
        );
    });
}

fn sloped_corner(x: f32, y: f32, z: f32) -> Vec3 {
    vec3(x, y + 0.4 * z, z)
}

/// A bookcase with `shelves` rows of books, which `seed` chooses.
pub(super) fn bookcase(b: &mut Builder, width: f32, shelves: u32, wood: Look, seed: u32) {
    const ROW: f32 = 0.36;
    const BOARD: f32 = 0.025;
    const DEPTH: f32 = 0.3;

    b.begin(Class::BOOKCASE);
    let x = 0.5 * width;
    let y = 0.5 * DEPTH;

    let height = 0.08 + ROW * shelves as f32 + BOARD;
    b.cuboid([-x, -y, 0.0], [-x + BOARD, y, height], wood, &[Bottom]);
    b.cuboid([x - BOARD, -y, 0.0], [x, y, height], wood, &[Bottom]);
    let left = -x + BOARD;
    let right = x - BOARD;
    b.cuboid([left, y - 0.015, 0.08], [right, y, height], wood, &[Bottom, Left, Right]);
    b.cuboid([left, -y + 0.02, 0.0], [right, -y + 0.04, 0.08], wood, &[Bottom, Top, Left, Right]);

    for shelf in 0..=shelves {
        let z = 0.08 + ROW * shelf as f32;
        b.cuboid([left, -y, z], [right, y - 0.015, z + BOARD], wood, &[Left, Right, Back]);
        if shelf == shelves {
            break;
        }

        // Blocks of books of one height, with a gap somewhere.
        let mut from = left + 0.01;
        let mut block = 0;
        while from < right - 0.08 {
            let r = |k: u32| hash(shelf * 16 + block, k, seed);
            let to = (from + 0.12 + 0.26 * r(0)).min(right - 0.01);
            let top = z + BOARD + 0.2 + 0.1 * r(1);
            let front = -y + 0.03 + 0.04 * r(2);
            if r(3) > 0.16 {
                books(b, [from, to], [front, y - 0.02], [z + BOARD, top], r(4));
            } else {
                vase(b, [0.5 * (from + to), 0.0, z + BOARD], if r(4) > 0.5 { TEAL } else { CLAY });
            }
            from = to + if r(5) > 0.7 { 0.05 } else { 0.004 };
            block += 1;
        }
    }
}

/// A block of books with their spines in front. `start` chooses the spines.
pub(super) fn books(b: &mut Builder, x: [f32; 2], y: [f32; 2], z: [f32; 2], start: f32) {
    let paper = Look::Plain("pages", [226, 216, 194]);
    b.cuboid([x[0], y[0], z[0]], [x[1], y[1], z[1]], paper, &[Bottom, Front, Back]);
    let corners = [[x[0], z[0]], [x[1], z[0]], [x[1], z[1]], [x[0], z[1]]].map(|[x, z]| vec3(x, y[0], z));
    b.shifted_panel(corners, BOOKS, start);
}

fn vase(b: &mut Builder, foot: [f32; 3], look: Look) {
    let [x, y, z] = foot;
    b.stump(foot, [0.03, 0.055], 0.09, 12, look, &[Top, Bottom]);
    b.stump([x, y, z + 0.09], [0.055, 0.025], 0.09, 12, look, &[Bottom]);
}
