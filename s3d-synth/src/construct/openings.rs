//! What fills the openings of walls: windows and doors.

use super::builder::{Builder, Side};
use crate::look::{Look, OAK, Pattern, STEEL, WHITE};
use s3d_geom::glam::vec3;
use s3d_label::Class;

/// The four inner faces of an opening, `depth` metres into the wall.
fn reveal(b: &mut Builder, width: f32, [z0, z1]: [f32; 2], depth: f32, look: Look, sill: Look) {
    let [x0, x1, y0, y1] = [0.0, width, 0.0, depth];
    let front = |z| [vec3(x0, y0, z), vec3(x1, y0, z)];
    let back = |z| [vec3(x0, y1, z), vec3(x1, y1, z)];
    let ([a, b0], [c, d]) = (front(z0), back(z0));
    let ([e, f], [g, h]) = (front(z1), back(z1));
    b.panel([a, c, g, e], look);
    b.panel([d, b0, f, h], look);
    b.panel([a, b0, d, c], sill);
    b.panel([g, h, f, e], look);
}

/// A window `heights` above the floor: its pane behind the wall, its board before it. The frame is the
/// wall's, from the opening's left edge.
pub(crate) fn window(b: &mut Builder, width: f32, heights: [f32; 2]) {
    const DEPTH: f32 = 0.16;
    const BAR: f32 = 0.05;
    let [z0, z1] = heights;
    b.begin(Class::WINDOW);
    reveal(b, width, heights, DEPTH, WHITE, WHITE);
    let pane = [[0.0, z0], [width, z0], [width, z1], [0.0, z1]].map(|[x, z]| vec3(x, DEPTH, z));
    b.panel(pane, Look::Fitted(Pattern::Sky));
    let middle = 0.5 * (width - BAR);
    let (front, back) = (DEPTH - 0.05, DEPTH);
    use Side::{Back, Bottom, Left, Right, Top};
    b.cuboid([0.0, front, z0], [width, back, z0 + BAR], WHITE, &[Back, Left, Right, Bottom]);
    b.cuboid([0.0, front, z1 - BAR], [width, back, z1], WHITE, &[Back, Left, Right, Top]);
    let upright = |b: &mut Builder, x: f32, omit: Side| {
        b.cuboid([x, front, z0 + BAR], [x + BAR, back, z1 - BAR], WHITE, &[Back, Top, Bottom, omit]);
    };
    upright(b, 0.0, Left);
    upright(b, width - BAR, Right);
    upright(b, middle, Back);
    b.cuboid([middle + 0.015, front - 0.03, z0 + 0.5], [middle + 0.035, front, z0 + 0.62], STEEL, &[Back]);
    // The board below it stands out a little.
    b.cuboid([-0.04, -0.06, z0 - 0.03], [width + 0.04, 0.0, z0], WHITE, &[Back]);
}

/// The lining and the frame of a doorway `depth` metres deep; what follows belongs to the same door.
pub(crate) fn doorway(b: &mut Builder, width: f32, height: f32, depth: f32) {
    const TRIM: f32 = 0.06;
    use Side::{Back, Bottom};
    b.begin(Class::DOOR);
    reveal(b, width, [0.0, height], depth, WHITE, OAK);
    b.cuboid([-TRIM, -0.015, 0.0], [0.0, 0.0, height + TRIM], WHITE, &[Back, Bottom]);
    b.cuboid([width, -0.015, 0.0], [width + TRIM, 0.0, height + TRIM], WHITE, &[Back, Bottom]);
    b.cuboid([0.0, -0.015, height], [width, 0.0, height + TRIM], WHITE, &[Back, Side::Left, Side::Right]);
}

/// A door leaf along x from the hinge at the origin, 4 cm thick towards −y.
pub(crate) fn leaf(b: &mut Builder, width: f32, height: f32) {
    let (w, h) = (width - 0.02, height - 0.02);
    let wood = Look::Fitted(Pattern::Door);
    let edge = Look::Plain("door_edge", [186, 140, 96]);
    b.cuboid([0.0, -0.04, 0.01], [w, 0.0, h], edge, &[Side::Front, Side::Back]);
    b.panel([[0.0, 0.01], [w, 0.01], [w, h], [0.0, h]].map(|[x, z]| vec3(x, -0.04, z)), wood);
    b.panel([[w, 0.01], [0.0, 0.01], [0.0, h], [w, h]].map(|[x, z]| vec3(x, 0.0, z)), wood);
    handle(b, w - 0.08, -0.04);
    b.place(vec3(w - 0.08, 0.0, 0.0), 180.0, |b| handle(b, 0.0, 0.0));
}

/// A handle on a leaf whose front is at `y`.
pub(crate) fn handle(b: &mut Builder, x: f32, y: f32) {
    b.cuboid([x - 0.01, y - 0.05, 1.02], [x + 0.01, y, 1.04], STEEL, &[Side::Front, Side::Back]);
    b.cuboid([x - 0.12, y - 0.06, 1.015], [x + 0.01, y - 0.05, 1.045], STEEL, &[]);
}
