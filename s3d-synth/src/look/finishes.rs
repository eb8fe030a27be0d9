//! The finishes of walls, floors and ceilings: a colour for each place in metres.

use super::noise::{fractal, hash, mix, tint, value};
use super::textures::Wood;

type Color = [f32; 3];

/// What covers a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint {
    /// Above the skirting: red, green and blue, 0 to 255.
    pub color: [f32; 3],
    /// A band around the room, if any: from, to (metres above the floor) and its colour.
    pub band: Option<(f32, f32, [f32; 3])>,
    /// The lowest 9 cm.
    pub skirting: [f32; 3],
}

impl Paint {
    /// The colour `along` the wall and `up` from the floor.
    pub(crate) fn at(&self, along: f32, up: f32) -> Color {
        const SKIRTING_M: f32 = 0.09;
        let noise =
            9.0 * (fractal(along * 1.3, up * 1.3, 64, 81) - 0.5) + 5.0 * (hash_at(along, up, 40.0) - 0.5);
        if up < SKIRTING_M {
            return tint(self.skirting, if up > SKIRTING_M - 0.016 { 14.0 } else { 0.5 * noise });
        }
        // The skirting's shadow line.
        let shadow = if up < SKIRTING_M + 0.015 { -26.0 } else { 0.0 };
        match self.band {
            Some((from, to, color)) if up >= from && up < to => tint(color, noise),
            _ => tint(self.color, noise + shadow),
        }
    }
}

/// What covers a floor.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FloorFinish {
    /// Square carpet tiles of a colour (0 to 255) whose pile runs along and across in turn.
    CarpetTiles([f32; 3]),
    /// Planks along x.
    PlanksAlongX(Wood),
    /// Planks along y.
    PlanksAlongY(Wood),
    /// Stone tiles with a coloured one now and then.
    Terrazzo,
}

impl FloorFinish {
    /// The colour at (x, y) of the building.
    pub(crate) fn at(self, x: f32, y: f32) -> Color {
        match self {
            FloorFinish::CarpetTiles(color) => {
                let i = (x * 2.0).floor();
                let j = (y * 2.0).floor();
                let fx = x * 2.0 - i;
                let fy = y * 2.0 - j;
                let along = (i as i64 + j as i64) % 2 == 0;
                let ribs = value(
                    if along { x * 90.0 } else { x * 9.0 },
                    if along { y * 9.0 } else { y * 90.0 },
                    4096,
                    83,
                );
                let seam = if fx.min(fy) < 0.02 { -12.0 } else { 0.0 };
                let tile = 12.0 * (hash(i as u32, j as u32, 84) - 0.5) + if along { 5.0 } else { -5.0 };
                tint(color, tile + seam + 26.0 * (ribs - 0.5) + 14.0 * (hash_at(x, y, 100.0) - 0.5))
            }
            FloorFinish::PlanksAlongX(wood) => planks(&wood, x, y),
            FloorFinish::PlanksAlongY(wood) => planks(&wood, y, x),
            FloorFinish::Terrazzo => {
                let i = (x / 0.45).floor();
                let j = (y / 0.45).floor();
                let edge = (x / 0.45 - i).min(y / 0.45 - j);
                let chip = value(x * 45.0, y * 45.0, 4096, 85);
                let base = if hash(i as u32, j as u32, 86) > 0.88 {
                    [126.0, 146.0, 150.0]
                } else {
                    [190.0, 184.0, 172.0]
                };
                let color = if chip > 0.8 {
                    tint(base, -40.0)
                } else if chip < 0.16 {
                    tint(base, 26.0)
                } else {
                    base
                };
                tint(
                    color,
                    if edge < 0.025 {
                        -34.0
                    } else {
                        6.0 * (hash(i as u32, j as u32, 87) - 0.5)
                    },
                )
            }
        }
    }
}

/// Planks 14 cm wide and 1.6 m long, each of its own piece of wood.
fn planks(wood: &Wood, along: f32, across: f32) -> Color {
    let row = (across / 0.14).floor();
    let shift = 1.6 * hash(row as u32, 0, 88);
    let piece = ((along + shift) / 1.6).floor();
    let fa = (along + shift) / 1.6 - piece;
    let fc = across / 0.14 - row;
    let seam = if fc < 0.05 || fa < 0.006 { -34.0 } else { 0.0 };
    let own = hash(row as u32, piece as u32, 89);
    tint(wood.at(along + 7.0 * own, across + 0.37 * row, 91), seam + 34.0 * (own - 0.5))
}

/// What covers a ceiling.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum CeilingFinish {
    /// Mineral tiles of 0.6 m between rails, counted from the room's smallest corner.
    Tiles,
    /// White plaster.
    Plaster,
    /// Painted boards along x.
    Boards,
}

impl CeilingFinish {
    /// The colour at (x, y) metres from the room's smallest corner.
    pub(crate) fn at(self, x: f32, y: f32) -> Color {
        match self {
            CeilingFinish::Tiles => {
                let i = (x / 0.6).floor();
                let j = (y / 0.6).floor();
                let edge = {
                    let fx = x / 0.6 - i;
                    let fy = y / 0.6 - j;
                    fx.min(1.0 - fx).min(fy).min(1.0 - fy) * 0.6
                };
                let pore = if hash_at(x, y, 64.0) > 0.9 { -34.0 } else { 0.0 };
                match edge {
                    e if e < 0.014 => [250.0, 250.0, 250.0],
                    e if e < 0.028 => [192.0, 192.0, 190.0],
                    _ => tint([236.0, 235.0, 228.0], pore + 8.0 * (hash(i as u32, j as u32, 92) - 0.5)),
                }
            }
            CeilingFinish::Plaster => tint([242.0, 240.0, 233.0], 8.0 * (fractal(x, y, 64, 93) - 0.5)),
            CeilingFinish::Boards => {
                let row = (y / 0.12).floor();
                let groove = if y / 0.12 - row < 0.1 { -36.0 } else { 0.0 };
                let grain = value(x * 3.0, y * 130.0, 4096, 94);
                mix([240.0, 234.0, 220.0], [222.0, 210.0, 190.0], hash(row as u32, 0, 95) * 0.5 + grain * 0.3)
                    .map(|c| c + groove)
            }
        }
    }
}

fn hash_at(x: f32, y: f32, per_m: f32) -> f32 {
    hash((x * per_m) as u32, (y * per_m) as u32, 96)
}
