//! Windows and doors in the openings of walls.

use super::builder::{Builder, Side};
use crate::building::LeafModel;
use crate::look::{BLACK, Look, OAK, Pattern, STEEL, WHITE};
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

/// Adds a window at `heights` above the floor, with its pane behind the wall and its board in front. The
/// frame is on the wall, and begins at the opening's left edge.
pub(crate) fn window(b: &mut Builder, width: f32, heights: [f32; 2]) {
    const DEPTH: f32 = 0.16;
    const BAR: f32 = 0.05;

    let [z0, z1] = heights;
    b.begin(Class::WINDOW);
    reveal(b, width, heights, DEPTH, WHITE, WHITE);
    let pane = [[0.0, z0], [width, z0], [width, z1], [0.0, z1]].map(|[x, z]| vec3(x, DEPTH, z));
    b.panel(pane, Look::Fitted(Pattern::Sky));

    let middle = 0.5 * (width - BAR);
    let front = DEPTH - 0.05;
    let back = DEPTH;

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

/// Adds the lining and the frame of a doorway `depth` metres deep. Surfaces added next belong to the same
/// door.
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
    let w = width - 0.02;
    let h = height - 0.02;
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

/// A window whose pane, `depth` behind the wall, is divided into `panes` beside and above one another.
pub(crate) fn glazing(b: &mut Builder, width: f32, [z0, z1]: [f32; 2], panes: [u32; 2], depth: f32) {
    const BAR: f32 = 0.045;
    use Side::{Back, Bottom, Left, Right, Top};
    b.begin(Class::WINDOW);
    reveal(b, width, [z0, z1], depth, WHITE, WHITE);

    let front = depth - 0.05;
    let columns = panes[0];
    let rows = panes[1];
    let pane = [(width - BAR) / columns as f32 - BAR, (z1 - z0 - BAR) / rows as f32 - BAR];
    let x_of = |k: u32| k as f32 * (pane[0] + BAR);
    let z_of = |k: u32| z0 + k as f32 * (pane[1] + BAR);

    for k in 0..=columns {
        let omit = [Back, Top, Bottom, if k == 0 { Left } else { Right }];
        let omit = if k == 0 || k == columns { &omit[..] } else { &omit[..3] };
        b.cuboid([x_of(k), front, z0], [x_of(k) + BAR, depth, z1], WHITE, omit);
    }

    for i in 0..columns {
        let x0 = x_of(i) + BAR;
        let x1 = x_of(i + 1);
        for k in 0..=rows {
            let omit = [Back, Left, Right, if k == 0 { Bottom } else { Top }];
            let omit = if k == 0 || k == rows { &omit[..] } else { &omit[..3] };
            b.cuboid([x0, front, z_of(k)], [x1, depth, z_of(k) + BAR], WHITE, omit);
        }

        for k in 0..rows {
            let low = z_of(k) + BAR;
            let high = z_of(k + 1);
            let corners = [[x0, low], [x1, low], [x1, high], [x0, high]];
            b.panel(corners.map(|[x, z]| vec3(x, depth - 0.02, z)), Look::Fitted(Pattern::Sky));
        }
    }
}

/// Adds a door leaf of a model, placed like [`leaf`] and 4 cm thick. A shut one is seen only from the front.
pub(crate) fn model_leaf(
    b: &mut Builder,
    model: LeafModel,
    [width, height]: [f32; 2],
    wood: Look,
    shut: bool,
) {
    let (w, h) = if shut {
        (width, height)
    } else {
        (width - 0.02, height - 0.02)
    };

    let low = if shut { 0.0 } else { 0.01 };
    let all = [Side::Left, Side::Right, Side::Top, Side::Bottom, Side::Back];
    b.cuboid([0.0, -0.04, low], [w, 0.0, h], wood, if shut { &all } else { &[] });

    let sides = if shut { 1 } else { 2 };
    for side in 0..sides {
        let (origin, yaw) = if side == 0 {
            (vec3(0.0, -0.04, 0.0), 0.0)
        } else {
            (vec3(w, 0.0, 0.0), 180.0)
        };

        let hang = if side == 0 { w - 0.08 } else { 0.15 };
        b.place(origin, yaw, |b| {
            let mut raised = |z: [f32; 2], out: f32, look: Look| {
                b.cuboid([0.17, -out, z[0]], [w - 0.17, 0.0, z[1]], look, &[Side::Back]);
            };

            match model {
                LeafModel::Flush => {}
                LeafModel::Panelled => {
                    raised([0.2, 0.9], 0.018, wood);
                    raised([1.1, h - 0.15], 0.018, wood);
                }
                LeafModel::Glazed => {
                    raised([0.25, h - 0.2], 0.004, Look::Plain("dark_glass", [92, 112, 120]));
                    raised([0.06, 0.16], 0.006, BLACK);
                }
            }
            handle(b, hang, 0.0);
        });
    }
}
