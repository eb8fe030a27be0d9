//! Boards, pictures, screens, plants, boxes. Frames are as in `furniture`. A thing that hangs has its origin
//! on the wall, at its foot.

use super::builder::{Builder, Side};
use super::furniture::*;
use super::models;
use crate::building::Thing;
use crate::look::*;
use s3d_geom::glam::{Vec2, Vec3, vec3};
use s3d_label::Class;

use Side::{Back, Bottom, Front, Left, Right, Top};

/// Builds a thing in the current frame.
pub(super) fn construct_thing(b: &mut Builder, thing: &Thing) {
    match *thing {
        Thing::Table { width_m, depth_m, height_m, top } => table(b, width_m, depth_m, height_m, top),
        Thing::Desk { width_m, depth_m } => desk(b, width_m, depth_m),
        Thing::RoundTable { radius_m, height_m, top } => round_table(b, radius_m, height_m, top),
        Thing::OfficeChair(fabric) => office_chair(b, fabric),
        Thing::Chair(fabric) => chair(b, fabric),
        Thing::Stool(seat) => stool(b, seat),
        Thing::Sofa { seats, fabric, cushion } => sofa(b, seats, fabric, cushion),
        Thing::Bookcase { width_m, shelves, wood, seed } => bookcase(b, width_m, shelves, wood, seed),
        Thing::Board { width_m, heights_m, picture, frame, tray_m } => {
            hanging(b, Class::BOARD, width_m, heights_m, picture, frame);
            if let Some(tray_m) = tray_m {
                pen_tray(b, tray_m, heights_m[0]);
            }
        }
        Thing::Picture { width_m, heights_m, picture, frame } => {
            hanging(b, Class::CLUTTER, width_m, heights_m, picture, frame);
        }
        Thing::WallScreen { width_m, heights_m } => wall_screen(b, width_m, heights_m),
        Thing::Monitor(picture) => monitor(b, picture),
        Thing::Keyboard => keyboard(b),
        Thing::Laptop => laptop(b),
        Thing::Mug(look) => mug(b, look),
        Thing::Papers => papers(b),
        Thing::DeskLamp => desk_lamp(b),
        Thing::FloorLamp => floor_lamp(b),
        Thing::Plant { height_m, pot } => plant(b, height_m, pot),
        Thing::Carton { size_m } => carton(b, size_m),
        Thing::Bin(look) => bin(b, look),
        Thing::Radiator { width_m } => radiator(b, width_m),
        Thing::Copier => copier(b),
        Thing::Extinguisher => extinguisher(b),
        Thing::Rug => rug(b),
        Thing::Stairs { width_m, steps, tread_m, riser_m } => stairs(b, width_m, steps, tread_m, riser_m),
        Thing::ModelTable { base, size_m, top } => models::table(b, base, size_m, top),
        Thing::Seat { base, size_m, has_arms, fabric } => models::seat(b, base, size_m, has_arms, fabric),
        Thing::Couch { seats, size_m, has_arms, fabric } => models::couch(b, seats, size_m, has_arms, fabric),
        Thing::Shelves { front, size_m, wood, seed } => models::shelves(b, front, size_m, wood, seed),
        Thing::PlainBoard { width_m, heights_m, picture } => {
            models::plain_board(b, width_m, heights_m, picture)
        }
        Thing::Toilet => models::toilet(b),
        Thing::Basin => models::basin(b),
        Thing::Partition { depth_m, height_m } => models::partition(b, depth_m, height_m),
        Thing::Column { width_m, depth_m, height_m } => column(b, width_m, depth_m, height_m),
    }
}

/// Something flat with `picture` on it, in a frame, 2 cm off a wall, between the heights `z`.
fn hanging(b: &mut Builder, class: Class, width: f32, z: [f32; 2], picture: Pattern, frame: Look) {
    const EDGE: f32 = 0.03;
    b.begin(class);
    let (x, [z0, z1]) = (0.5 * width, z);
    let front = -0.045;
    let back = -0.02;
    b.cuboid([-x, front, z0], [x, back, z0 + EDGE], frame, &[Top]);
    b.cuboid([-x, front, z1 - EDGE], [x, back, z1], frame, &[Bottom]);
    b.cuboid([-x, front, z0 + EDGE], [-x + EDGE, back, z1 - EDGE], frame, &[Top, Bottom, Right]);
    b.cuboid([x - EDGE, front, z0 + EDGE], [x, back, z1 - EDGE], frame, &[Top, Bottom, Left]);
    let x = x - EDGE;
    let z0 = z0 + EDGE;
    let z1 = z1 - EDGE;
    let at = |y: f32| [[-x, z0], [x, z0], [x, z1], [-x, z1]].map(|[x, z]| vec3(x, y, z));
    b.panel(at(front), Look::Fitted(picture));
    let mut behind = at(back);
    behind.swap(1, 3);
    b.panel(behind, frame);
}

/// The tray of a whiteboard whose lower edge is at `z`, with pens.
fn pen_tray(b: &mut Builder, width: f32, z: f32) {
    b.cuboid([-0.5 * width, -0.11, z - 0.02], [0.5 * width, -0.02, z - 0.005], STEEL, &[]);
    for (k, color) in [RED, TEAL, BLACK].into_iter().enumerate() {
        let x = -0.2 + 0.17 * k as f32;
        b.cuboid([x, -0.09, z - 0.005], [x + 0.13, -0.075, z + 0.01], color, &[Bottom]);
    }
}

/// A screen on a foot, on a table top.
fn monitor(b: &mut Builder, picture: Pattern) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.12, -0.02, 0.0], [0.12, 0.14, 0.012], BLACK, &[Bottom]);
    b.cuboid([-0.02, 0.05, 0.012], [0.02, 0.07, 0.2], BLACK, &[Bottom]);
    b.cuboid([-0.3, 0.015, 0.13], [0.3, 0.05, 0.49], BLACK, &[Front]);
    screen(b, 0.3, 0.015, [0.13, 0.49], picture);
}

/// The front of a screen: its picture within a rim.
fn screen(b: &mut Builder, half: f32, y: f32, z: [f32; 2], picture: Pattern) {
    const RIM: f32 = 0.012;
    let [z0, z1] = z;
    b.panel(rect_at(-half + RIM, half - RIM, z0 + RIM, z1 - RIM, y), Look::Fitted(picture));
    b.panel(rect_at(-half, half, z0, z0 + RIM, y), BLACK);
    b.panel(rect_at(-half, half, z1 - RIM, z1, y), BLACK);
    b.panel(rect_at(-half, -half + RIM, z0 + RIM, z1 - RIM, y), BLACK);
    b.panel(rect_at(half - RIM, half, z0 + RIM, z1 - RIM, y), BLACK);
}

fn rect_at(x0: f32, x1: f32, z0: f32, z1: f32, y: f32) -> [Vec3; 4] {
    [[x0, z0], [x1, z0], [x1, z1], [x0, z1]].map(|[x, z]| vec3(x, y, z))
}

/// A large screen on a wall, 3 cm off it.
fn wall_screen(b: &mut Builder, width: f32, z: [f32; 2]) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.5 * width, -0.08, z[0]], [0.5 * width, -0.03, z[1]], BLACK, &[Front]);
    screen(b, 0.5 * width, -0.08, z, Pattern::Chart);
}

fn keyboard(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.22, -0.075, 0.0], [0.22, 0.075, 0.018], BLACK, &[Bottom, Top]);
    let corners = [[-0.22, -0.075], [0.22, -0.075], [0.22, 0.075], [-0.22, 0.075]];
    b.panel(corners.map(|[x, y]| vec3(x, y, 0.018)), Look::Fitted(Pattern::Keyboard));
}

/// An open laptop.
fn laptop(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.17, -0.12, 0.0], [0.17, 0.12, 0.018], STEEL, &[Bottom, Top]);
    let keys = [[-0.17, -0.12], [0.17, -0.12], [0.17, 0.12], [-0.17, 0.12]];
    b.panel(keys.map(|[x, y]| vec3(x, y, 0.018)), Look::Fitted(Pattern::Keyboard));
    let x = 0.17;
    let y0 = 0.118;
    let y1 = 0.128;
    let z0 = 0.022;
    let z1 = 0.23;
    let corners = [
        leaning(-x, y0, z0),
        leaning(x, y0, z0),
        leaning(x, y1, z0),
        leaning(-x, y1, z0),
        leaning(-x, y0, z1),
        leaning(x, y0, z1),
        leaning(x, y1, z1),
        leaning(-x, y1, z1),
    ];
    b.hexahedron(corners, STEEL, &[Front]);
    b.panel([corners[0], corners[1], corners[5], corners[4]], Look::Fitted(Pattern::Editor));
}

fn leaning(x: f32, y: f32, z: f32) -> Vec3 {
    vec3(x, y + 0.28 * z, z)
}

fn mug(b: &mut Builder, look: Look) {
    b.begin(Class::CLUTTER);
    b.stump([0.0, 0.0, 0.0], [0.036, 0.042], 0.095, 14, look, &[Top, Bottom]);
    b.disc([0.0, 0.0, 0.095], 0.042, 14, COFFEE);
    b.cuboid([0.036, -0.008, 0.02], [0.07, 0.008, 0.08], look, &[Left]);
}

/// Sheets of paper, one a little askew.
fn papers(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.cuboid([-0.105, -0.15, 0.0], [0.105, 0.15, 0.012], PAPER, &[Bottom]);
    b.place(vec3(0.02, 0.01, 0.012), 14.0, |b| {
        b.cuboid([-0.1, -0.14, 0.0], [0.1, 0.14, 0.004], PAPER, &[Bottom]);
    });
}

/// A lamp for a desk: a foot, an arm and a cone.
fn desk_lamp(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.stump([0.0, 0.0, 0.0], [0.08, 0.075], 0.02, 20, RED, &[Bottom]);
    b.stump([0.0, 0.0, 0.02], [0.01; 2], 0.37, 8, STEEL, &[Top, Bottom]);
    b.cuboid([-0.01, -0.2, 0.38], [0.01, 0.02, 0.4], STEEL, &[]);
    b.stump([0.0, -0.2, 0.285], [0.085, 0.03], 0.1, 20, RED, &[]);
}

/// A lamp that stands on the floor.
fn floor_lamp(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.stump([0.0, 0.0, 0.0], [0.16, 0.15], 0.02, 24, BLACK, &[Bottom]);
    b.stump([0.0, 0.0, 0.02], [0.014; 2], 1.4, 8, BLACK, &[Bottom]);
    b.stump([0.0, 0.0, 1.36], [0.24, 0.15], 0.3, 24, SHADE, &[]);
}

/// A plant in a pot: leaves in all directions, the lower ones longer.
fn plant(b: &mut Builder, height: f32, pot: Look) {
    b.begin(Class::CLUTTER);
    b.stump([0.0, 0.0, 0.0], [0.13, 0.17], 0.3, 20, pot, &[Bottom]);
    b.stump([0.0, 0.0, 0.301], [0.15; 2], 0.006, 20, SOIL, &[Bottom]);
    b.stump([0.0, 0.0, 0.307], [0.016, 0.01], 0.45 * height, 8, WALNUT, &[Bottom]);
    for k in 0..26u32 {
        let rise = k as f32 / 25.0;
        let direction = Vec2::from_angle(2.4 * k as f32);
        let base = vec3(0.0, 0.0, 0.31 + (0.1 + 0.35 * rise) * height);
        let reach = (0.28 - 0.15 * rise) * (0.8 + 0.4 * hash(k, 0, 15));
        let up = (0.1 + 0.42 * rise) * height;
        b.leaf(base, base + (direction * reach).extend(up), 0.11 - 0.03 * rise, LEAF);
    }
}

/// A closed cardboard box.
fn carton(b: &mut Builder, size: [f32; 3]) {
    b.begin(Class::CLUTTER);
    let [x, y, z] = size;
    b.cuboid([-0.5 * x, -0.5 * y, 0.0], [0.5 * x, 0.5 * y, z], CARDBOARD, &[Bottom]);
}

fn bin(b: &mut Builder, look: Look) {
    b.begin(Class::CLUTTER);
    b.stump([0.0, 0.0, 0.0], [0.11, 0.14], 0.3, 20, look, &[Top, Bottom]);
    b.disc([0.0, 0.0, 0.3], 0.14, 20, SOIL);
}

/// A radiator under a window; its origin is on the wall.
fn radiator(b: &mut Builder, width: f32) {
    b.begin(Class::CLUTTER);
    let x = 0.5 * width;
    b.cuboid([-x, -0.09, 0.14], [x, -0.03, 0.66], WHITE, &[]);
    let ribs = (width / 0.1) as u32;
    for rib in 0..ribs {
        let left = -x + 0.03 + rib as f32 * (width - 0.06) / ribs as f32;
        b.cuboid([left, -0.105, 0.17], [left + 0.05, -0.09, 0.63], WHITE, &[Back]);
    }
}

/// A copier: a cabinet with trays, a lid and a panel.
fn copier(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    let grey = Look::Plain("copier_grey", [214, 216, 216]);
    b.cuboid([-0.32, -0.3, 0.04], [0.32, 0.3, 0.92], grey, &[]);
    for tray in 0..3 {
        let z = 0.12 + 0.2 * tray as f32;
        b.cuboid([-0.28, -0.315, z], [0.28, -0.3, z + 0.16], WHITE, &[Back]);
        b.cuboid([-0.08, -0.325, z + 0.1], [0.08, -0.315, z + 0.12], BLACK, &[Back]);
    }
    b.cuboid([-0.3, -0.24, 0.925], [0.24, 0.28, 1.04], BLACK, &[]);
    b.cuboid([0.25, -0.29, 0.925], [0.31, -0.02, 0.98], BLACK, &[Top]);
    let panel = [[0.25, -0.29], [0.31, -0.29], [0.31, -0.02], [0.25, -0.02]];
    b.panel(panel.map(|[x, y]| vec3(x, y, 0.98)), Look::Fitted(Pattern::Chart));
}

/// A fire extinguisher on the wall.
fn extinguisher(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    b.stump([0.0, -0.1, 0.62], [0.075; 2], 0.42, 18, RED, &[Top]);
    b.stump([0.0, -0.1, 1.04], [0.075, 0.03], 0.07, 18, RED, &[Bottom]);
    b.cuboid([-0.02, -0.14, 1.105], [0.02, -0.03, 1.16], BLACK, &[]);
    b.cuboid([-0.05, -0.025, 0.6], [0.05, -0.01, 1.14], WHITE, &[]);
}

/// A rug of 2.5 m × 2.1 m.
fn rug(b: &mut Builder) {
    b.begin(Class::CLUTTER);
    let edge = Look::Plain("rug_edge", [198, 184, 158]);
    b.cuboid([-1.25, -1.05, 0.0], [1.25, 1.05, 0.012], edge, &[Bottom, Top]);
    let corners = [[-1.25, -1.05], [1.25, -1.05], [1.25, 1.05], [-1.25, 1.05]];
    b.panel(corners.map(|[x, y]| vec3(x, y, 0.012)), Look::Fitted(Pattern::Rug));
}

/// Stairs: a block for each step, as high as its tread. Faces that the next block hides are left out.
fn stairs(b: &mut Builder, width: f32, steps: u32, tread: f32, riser: f32) {
    b.begin(Class::CLUTTER);
    let x = 0.5 * width;
    for step in 0..steps {
        let [y0, y1] = [step, step + 1].map(|n| n as f32 * tread);
        let [z0, z1] = [step, step + 1].map(|n| n as f32 * riser);
        let omit: &[Side] = if step + 1 == steps {
            &[Bottom, Front]
        } else {
            &[Bottom, Front, Back]
        };
        b.cuboid([-x, y0, 0.0], [x, y1, z1], CONCRETE, omit);
        b.panel([[-x, z0], [x, z0], [x, z1], [-x, z1]].map(|[x, z]| vec3(x, y0, z)), CONCRETE);
    }
}

/// A beam under a ceiling, between two points on the ceiling: `half` of its width to either side, `depth`
/// down.
pub(super) fn beam(b: &mut Builder, from: Vec3, to: Vec3, half: f32, depth: f32, look: Look) {
    b.begin(Class::BEAM);
    // The ends touch walls, and the top the ceiling.
    let side = (to - from).cross(Vec3::Z).normalize() * half;
    let down = Vec3::Z * depth;
    let ring = |z: Vec3| [from - side - z, from + side - z, to + side - z, to - side - z];
    let low = ring(down);
    let high = ring(Vec3::ZERO);
    b.hexahedron(
        [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]],
        look,
        &[Top, Front, Back],
    );
}

/// A column against a wall (the origin is on it), up to the ceiling.
fn column(b: &mut Builder, width: f32, depth: f32, height: f32) {
    b.begin(Class::COLUMN);
    b.cuboid([-0.5 * width, -depth, 0.0], [0.5 * width, 0.0, height], CONCRETE, &[Top, Bottom, Back]);
}
