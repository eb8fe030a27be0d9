//! The materials of surfaces.

use super::textures::Pattern;
use s3d_geom::{
    Wrap,
    glam::{Vec2, vec2},
};

/// How a surface looks before light falls on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Look {
    /// One colour, and what its material is called.
    Plain(&'static str, [u8; 3]),
    /// One colour that shines by itself, and what its material is called.
    Glow(&'static str, [u8; 3]),
    /// A pattern that repeats every so many metres.
    Tiled(Pattern),
    /// A picture, once over the whole surface.
    Fitted(Pattern),
}

/// Bare steel.
pub const STEEL: Look = Look::Plain("steel", [168, 172, 178]);
/// Black plastic.
pub const BLACK: Look = Look::Plain("black_plastic", [44, 45, 50]);
/// White lacquer.
pub const WHITE: Look = Look::Plain("white_lacquer", [246, 245, 240]);
/// The leaves of plants.
pub const LEAF: Look = Look::Plain("leaf", [74, 122, 58]);
/// The soil in pots.
pub const SOIL: Look = Look::Plain("soil", [74, 54, 42]);
/// The coffee in mugs.
pub const COFFEE: Look = Look::Plain("coffee", [70, 44, 30]);
/// Fired clay.
pub const CLAY: Look = Look::Plain("clay", [190, 104, 70]);
/// Red lacquer.
pub const RED: Look = Look::Plain("red_lacquer", [196, 40, 34]);
/// A teal glaze.
pub const TEAL: Look = Look::Plain("teal_glaze", [38, 128, 134]);
/// A yellow glaze.
pub const YELLOW: Look = Look::Plain("yellow_glaze", [232, 178, 52]);
/// White paper.
pub const PAPER: Look = Look::Plain("paper", [250, 248, 240]);
/// Bare concrete.
pub const CONCRETE: Look = Look::Tiled(Pattern::Concrete);
/// The shining side of a lamp.
pub const LAMP: Look = Look::Glow("lamp", [255, 252, 240]);
/// A lamp shade with the light behind it.
pub const SHADE: Look = Look::Glow("lamp_shade", [250, 226, 178]);
/// Oak.
pub const OAK: Look = Look::Tiled(Pattern::Oak);
/// Walnut.
pub const WALNUT: Look = Look::Tiled(Pattern::Walnut);
/// Blue fabric.
pub const BLUE_FABRIC: Look = Look::Tiled(Pattern::BlueFabric);
/// Grey fabric.
pub const GREY_FABRIC: Look = Look::Tiled(Pattern::GreyFabric);
/// Fabric of the colour of rust.
pub const RUST_FABRIC: Look = Look::Tiled(Pattern::RustFabric);
/// Cardboard.
pub const CARDBOARD: Look = Look::Tiled(Pattern::Cardboard);
/// The spines of books.
pub const BOOKS: Look = Look::Tiled(Pattern::Books);

impl Look {
    /// A name for materials and texture files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Look::Plain(name, _) | Look::Glow(name, _) => name,
            Look::Tiled(pattern) | Look::Fitted(pattern) => pattern.name(),
        }
    }

    /// Its colour, white if it has a pattern.
    pub(crate) fn color(self) -> [u8; 3] {
        match self {
            Look::Plain(_, color) | Look::Glow(_, color) => color,
            Look::Tiled(_) | Look::Fitted(_) => [255; 3],
        }
    }

    pub(crate) fn pattern(self) -> Option<Pattern> {
        match self {
            Look::Plain(..) | Look::Glow(..) => None,
            Look::Tiled(pattern) | Look::Fitted(pattern) => Some(pattern),
        }
    }

    /// Whether it has a direction that follows the piece.
    pub(crate) fn has_grain(self) -> bool {
        matches!(self, Look::Tiled(Pattern::Oak | Pattern::Walnut))
    }

    pub(crate) fn wrap(self) -> Wrap {
        if matches!(self, Look::Fitted(_)) {
            Wrap::Clamp
        } else {
            Wrap::Repeat
        }
    }

    /// Texture coordinates at the far corner of a surface of `size` metres.
    pub(crate) fn uv_scale(self, size: Vec2) -> Vec2 {
        match self {
            Look::Plain(..) | Look::Glow(..) => size,
            Look::Tiled(pattern) => {
                let [w, h] = pattern.tile_m();
                size / vec2(w, h)
            }
            Look::Fitted(_) => Vec2::ONE,
        }
    }

    /// The edge of the cells into which such a surface is cut, metres.
    pub(crate) fn cell_m(self) -> f32 {
        match self {
            Look::Plain(..) | Look::Glow(..) => 0.3,
            Look::Tiled(_) => 0.25,
            Look::Fitted(_) => 0.14,
        }
    }

    /// The step of brightness nearest to `lit`. Textures have few steps, because each step is an image of its
    /// own.
    pub(crate) fn level(self, lit: f32) -> u32 {
        match self {
            Look::Glow(..) => self.steps(),
            _ => (lit * self.steps() as f32).round().max(1.0) as u32,
        }
    }

    /// The brightness of a level.
    pub(crate) fn factor(self, level: u32) -> f32 {
        level as f32 / self.steps() as f32
    }

    fn steps(self) -> u32 {
        match self {
            Look::Plain(..) | Look::Glow(..) => 24,
            Look::Tiled(_) => 10,
            Look::Fitted(_) => 16,
        }
    }
}
