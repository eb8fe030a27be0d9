//! Furniture of several models, whose measures differ between buildings. Frames are as in `furniture`.

use super::builder::{Builder, Side};
use super::furniture::books;
use crate::building::{SeatBase, ShelfFront, TableBase};
use crate::look::*;
use s3d_geom::glam::{Vec3, vec3};
use s3d_label::Class;

use Side::{Back, Bottom, Front, Left, Right, Top};

/// The four corners (−x, −y) to (x, y), `inset` from them.
fn corners(x: f32, y: f32, inset: f32) -> [[f32; 2]; 4] {
    let x = x - inset;
    let y = y - inset;
    [[-x, -y], [x, -y], [x, y], [-x, y]]
}

/// A square post without its ends, `half` to each side.
fn post(b: &mut Builder, [x, y]: [f32; 2], half: f32, [z0, z1]: [f32; 2], look: Look) {
    b.cuboid([x - half, y - half, z0], [x + half, y + half, z1], look, &[Top, Bottom]);
}

/// A table of a model.
pub(super) fn table(b: &mut Builder, base: TableBase, [width, depth, height]: [f32; 3], top: Look) {
    const TOP_M: f32 = 0.035;

    b.begin(Class::TABLE);
    let x = 0.5 * width;
    let y = 0.5 * depth;

    let under = height - TOP_M;
    b.cuboid([-x, -y, under], [x, y, height], top, &[]);

    match base {
        TableBase::Legs => {
            for at in corners(x, y, 0.06) {
                post(b, at, 0.025, [0.0, under], STEEL);
            }
            for side in [-1.0, 1.0] {
                let y0 = side * (y - 0.06) - 0.01;
                b.cuboid([-x + 0.085, y0, under - 0.06], [x - 0.085, y0 + 0.02, under - 0.001], STEEL, &[]);
            }
        }
        TableBase::Trestles => {
            for side in [-1.0, 1.0] {
                let middle = side * (x - 0.22);
                b.cuboid(
                    [middle - 0.03, -y + 0.05, under - 0.05],
                    [middle + 0.03, y - 0.05, under],
                    top,
                    &[Top],
                );
                for lean in [-1.0, 1.0] {
                    for end in [-1.0, 1.0] {
                        let y0 = end * (y - 0.1) - 0.02;
                        let foot = middle + lean * 0.16;
                        // The heads of the two legs of a side stand beside one another.
                        let [a, c, d, e] = foot_ring(foot, 0.0, y0);
                        let [f, g, h, i] = foot_ring(middle + lean * 0.021, under - 0.05, y0);
                        b.hexahedron([a, c, d, e, f, g, h, i], top, &[Top, Bottom]);
                    }
                }
            }
        }
        TableBase::Panels => {
            for side in [-1.0, 1.0] {
                let x0 = side * (x - 0.04);
                b.cuboid([x0 - 0.015, -y + 0.03, 0.0], [x0 + 0.015, y - 0.03, under], top, &[Top, Bottom]);
            }
            b.cuboid([-x + 0.055, y - 0.1, 0.2], [x - 0.055, y - 0.08, under], top, &[Top, Left, Right]);
        }
        TableBase::Pedestal => {
            let plate = 0.36 * width.min(depth);
            b.cuboid([-plate, -plate, 0.0], [plate, plate, 0.03], STEEL, &[Bottom]);
            post(b, [0.0; 2], 0.05, [0.03, under], STEEL);
            for x0 in [-1.0, 1.0] {
                let (from, to) = if x0 < 0.0 { (-0.7 * x, -0.05) } else { (0.05, 0.7 * x) };
                b.cuboid([from, -0.03, under - 0.04], [to, 0.03, under - 0.002], STEEL, &[]);
            }
        }
    }
}

fn foot_ring(x: f32, z: f32, y0: f32) -> [Vec3; 4] {
    let x0 = x - 0.02;
    let x1 = x + 0.02;
    [vec3(x0, y0, z), vec3(x1, y0, z), vec3(x1, y0 + 0.04, z), vec3(x0, y0 + 0.04, z)]
}

/// A chair of a model: width and height of the seat, and height of the back.
pub(super) fn seat(
    b: &mut Builder,
    base: SeatBase,
    [width, seat, back]: [f32; 3],
    has_arms: bool,
    fabric: Look,
) {
    b.begin(Class::CHAIR);
    let x = 0.5 * width;
    let y = 0.5 * (width.max(0.4));
    let pad = seat - 0.07;

    match base {
        SeatBase::Legs => {
            for at in corners(x, y, 0.03) {
                post(b, at, 0.02, [0.0, pad], WALNUT);
            }
        }
        SeatBase::Star => {
            for arm in 0..5 {
                b.place(Vec3::ZERO, 72.0 * arm as f32 + 18.0, |b| {
                    b.cuboid([0.041, -0.025, 0.05], [0.3, 0.025, 0.09], BLACK, &[Left]);
                    b.cuboid([0.255, -0.02, 0.0], [0.3, 0.02, 0.05], BLACK, &[Top, Bottom]);
                });
            }
            b.stump([0.0, 0.0, 0.06], [0.04, 0.03], pad - 0.06, 10, BLACK, &[Top]);
        }
        SeatBase::Sled => {
            for side in [-1.0, 1.0] {
                let x0 = side * (x - 0.015);
                b.cuboid([x0 - 0.012, -y + 0.024, 0.0], [x0 + 0.012, y, 0.024], STEEL, &[Bottom, Front]);
                post(b, [x0, -y + 0.012], 0.012, [0.0, pad], STEEL);
            }
            b.cuboid([-x + 0.027, y - 0.024, 0.0], [x - 0.027, y, 0.024], STEEL, &[Bottom, Left, Right]);
        }
        SeatBase::Block => {
            b.cuboid([-x + 0.02, -y + 0.03, 0.0], [x - 0.02, y - 0.01, pad], fabric, &[Top, Bottom]);
        }
    }

    b.cuboid([-x, -y, pad], [x, y, seat], fabric, &[]);

    // The back leans by a twelfth of its height. Only on block seats there is no gap below it.
    let from = if base == SeatBase::Block {
        seat + 0.002
    } else {
        seat + 0.1
    };
    let thick = if base == SeatBase::Block { 0.12 } else { 0.05 };
    let lean = (back - from) / 12.0;
    let ring =
        |y: f32, z: f32| [vec3(-x, y, z), vec3(x, y, z), vec3(x, y + thick, z), vec3(-x, y + thick, z)];
    let ([a, c, d, e], [f, g, h, i]) = (ring(y - thick, from), ring(y - thick + lean, back));
    b.hexahedron([a, c, d, e, f, g, h, i], fabric, &[]);

    if base != SeatBase::Block {
        for side in [-1.0, 1.0] {
            post(b, [side * 0.6 * x, y - 0.02], 0.014, [seat, from], STEEL);
        }
    }

    if has_arms {
        let top = seat + 0.22;
        for side in [-1.0, 1.0] {
            let (x0, x1) = if side < 0.0 {
                (-x - 0.05, -x - 0.005)
            } else {
                (x + 0.005, x + 0.05)
            };
            if base == SeatBase::Block {
                b.cuboid([x0, -y, 0.02], [x1, y, top], fabric, &[]);
            } else {
                b.cuboid([x0, -y + 0.06, top - 0.03], [x1, y - 0.06, top], BLACK, &[]);
                post(b, [0.5 * (x0 + x1), -0.05], 0.014, [pad, top - 0.03], BLACK);
            }
        }
    }
}

/// A sofa of a model: width of a seat, depth of the whole, height of the back.
pub(super) fn couch(
    b: &mut Builder,
    seats: u32,
    [seat, depth, height]: [f32; 3],
    has_arms: bool,
    fabric: Look,
) {
    b.begin(Class::SOFA);
    let x = 0.5 * seat * seats as f32;
    let y = 0.5 * depth;
    let back = 0.2 * depth;
    for at in corners(x, y, 0.06) {
        post(b, at, 0.025, [0.0, 0.12], BLACK);
    }

    b.cuboid([-x, -y, 0.12], [x, y - back, 0.28], fabric, &[Back]);
    b.cuboid([-x, y - back, 0.12], [x, y, height], fabric, &[]);

    for k in 0..seats {
        let from = -x + seat * k as f32;
        b.cuboid(
            [from + 0.012, -y - 0.01, 0.284],
            [from + seat - 0.012, y - back - 0.004, 0.43],
            fabric,
            &[Bottom],
        );
    }

    if has_arms {
        for side in [-1.0, 1.0] {
            let (x0, x1) = if side < 0.0 {
                (-x - 0.14, -x - 0.002)
            } else {
                (x + 0.002, x + 0.14)
            };
            b.cuboid([x0, -y, 0.04], [x1, y, 0.6_f32.min(height - 0.02)], fabric, &[]);
        }
    }
}

/// A bookcase of a model.
pub(super) fn shelves(
    b: &mut Builder,
    front: ShelfFront,
    [width, depth, height]: [f32; 3],
    wood: Look,
    seed: u32,
) {
    const BOARD: f32 = 0.022;
    const PLINTH: f32 = 0.06;

    b.begin(Class::BOOKCASE);
    let x = 0.5 * width;
    let y = 0.5 * depth;

    for side in [-1.0, 1.0] {
        let (x0, x1) = if side < 0.0 { (-x, -x + BOARD) } else { (x - BOARD, x) };
        b.cuboid([x0, -y, 0.0], [x1, y, height], wood, &[Bottom]);
    }

    let left = -x + BOARD;
    let right = x - BOARD;
    b.cuboid([left, y - 0.012, PLINTH], [right, y, height - BOARD], wood, &[Bottom, Top, Left, Right]);
    b.cuboid([left, -y + 0.03, 0.0], [right, -y + 0.05, PLINTH], wood, &[Bottom, Top, Left, Right]);

    let inner = height - PLINTH - BOARD;
    let rows = ((inner / 0.36).round() as u32).max(1);
    let pitch = inner / rows as f32;

    for row in 0..=rows {
        let z = PLINTH + pitch * row as f32;
        b.cuboid(
            [left, -y + 0.025, z],
            [right, if row == rows { y } else { y - 0.012 }, z + BOARD],
            wood,
            &[Left, Right],
        );
    }

    let hidden = match front {
        ShelfFront::Open => 0,
        ShelfFront::HalfDoors => rows.div_ceil(2),
        ShelfFront::Doors => rows,
    };

    if hidden > 0 {
        let z0 = PLINTH + 0.004;
        let z1 = PLINTH + pitch * hidden as f32 - 0.002;
        let doors = ((width / 0.55).ceil() as u32).max(1);
        let leaf = (right - left) / doors as f32;
        for k in 0..doors {
            let from = left + leaf * k as f32;
            b.cuboid([from + 0.003, -y + 0.002, z0], [from + leaf - 0.003, -y + 0.02, z1], wood, &[]);
            let at = if k % 2 == 0 { from + leaf - 0.05 } else { from + 0.03 };
            let middle = 0.5 * (z0 + z1);
            b.cuboid([at, -y - 0.014, middle - 0.06], [at + 0.02, -y + 0.002, middle + 0.06], STEEL, &[Back]);
        }
    }

    for row in hidden..rows {
        let z = PLINTH + pitch * row as f32 + BOARD;
        let mut from = left + 0.01;
        for block in 0.. {
            let r = |k: u32| hash(row * 16 + block, k, seed);
            let to = (from + 0.14 + 0.3 * r(0)).min(right - 0.01);
            if to - from < 0.06 {
                break;
            }
            if r(3) > 0.2 {
                let top = z + (pitch - BOARD - 0.02) * (0.65 + 0.35 * r(1));
                books(b, [from, to], [-y + 0.04 + 0.03 * r(2), y - 0.02], [z, top], r(4));
            }
            from = to + 0.006;
        }
    }
}

/// A board without a frame, 2.5 cm thick and 1 cm off the wall.
pub(super) fn plain_board(b: &mut Builder, width: f32, [z0, z1]: [f32; 2], picture: Pattern) {
    b.begin(Class::BOARD);
    let x = 0.5 * width;
    b.cuboid([-x, -0.035, z0], [x, -0.01, z1], WHITE, &[Front]);
    b.panel([[-x, z0], [x, z0], [x, z1], [-x, z1]].map(|[x, z]| vec3(x, -0.035, z)), Look::Fitted(picture));
}

/// A toilet at a wall: a bowl, its lid and its cistern.
pub(super) fn toilet(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.2, -0.18, 0.36], [0.2, -0.01, 0.8], WHITE, &[]);
    b.cuboid([-0.12, -0.55, 0.0], [0.12, -0.02, 0.28], WHITE, &[Bottom]);
    b.stump([0.0, -0.44, 0.281], [0.14, 0.19], 0.12, 16, WHITE, &[]);
}

/// A wash-basin on a wall, with its tap, and a mirror above.
pub(super) fn basin(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.28, -0.45, 0.74], [0.28, -0.01, 0.86], WHITE, &[]);
    b.cuboid([-0.06, -0.3, 0.2], [0.06, -0.01, 0.738], WHITE, &[]);
    b.cuboid([-0.015, -0.16, 0.86], [0.015, -0.08, 1.0], STEEL, &[Bottom]);
    b.cuboid([-0.25, -0.03, 1.1], [0.25, -0.01, 1.7], Look::Plain("mirror", [176, 190, 196]), &[]);
}

/// A thin screen that stands out of a wall, 12 cm above the floor on two feet.
pub(super) fn partition(b: &mut Builder, depth: f32, height: f32) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.015, -depth, 0.12], [0.015, -0.005, height], WHITE, &[]);
    for y in [-depth + 0.06, -0.12] {
        b.cuboid([-0.012, y - 0.02, 0.0], [0.012, y + 0.02, 0.12], STEEL, &[Top, Bottom]);
    }
}
