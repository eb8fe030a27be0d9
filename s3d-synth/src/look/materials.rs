//! What surfaces are made of.

use super::textures::Pattern;
use s3d_geom::{
    Wrap,
    glam::{Vec2, vec2},
};

/// How a surface looks before light falls on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Look {
    /// One colour.
    Plain(&'static str, [u8; 3]),
    /// One colour that shines by itself.
    Glow(&'static str, [u8; 3]),
    /// A pattern that repeats every so many metres.
    Tiled(Pattern),
    /// A picture, once over the whole surface.
    Fitted(Pattern),
}

pub(crate) const STEEL: Look = Look::Plain("steel", [168, 172, 178]);
pub(crate) const BLACK: Look = Look::Plain("black_plastic", [44, 45, 50]);
pub(crate) const WHITE: Look = Look::Plain("white_lacquer", [246, 245, 240]);
pub(crate) const LEAF: Look = Look::Plain("leaf", [74, 122, 58]);
pub(crate) const SOIL: Look = Look::Plain("soil", [74, 54, 42]);
pub(crate) const COFFEE: Look = Look::Plain("coffee", [70, 44, 30]);
pub(crate) const CLAY: Look = Look::Plain("clay", [190, 104, 70]);
pub(crate) const RED: Look = Look::Plain("red_lacquer", [196, 40, 34]);
pub(crate) const TEAL: Look = Look::Plain("teal_glaze", [38, 128, 134]);
pub(crate) const YELLOW: Look = Look::Plain("yellow_glaze", [232, 178, 52]);
pub(crate) const PAPER: Look = Look::Plain("paper", [250, 248, 240]);
pub(crate) const CONCRETE: Look = Look::Tiled(Pattern::Concrete);
pub(crate) const LAMP: Look = Look::Glow("lamp", [255, 252, 240]);
pub(crate) const SHADE: Look = Look::Glow("lamp_shade", [250, 226, 178]);
pub(crate) const OAK: Look = Look::Tiled(Pattern::Oak);
pub(crate) const WALNUT: Look = Look::Tiled(Pattern::Walnut);
pub(crate) const BLUE_FABRIC: Look = Look::Tiled(Pattern::BlueFabric);
pub(crate) const GREY_FABRIC: Look = Look::Tiled(Pattern::GreyFabric);
pub(crate) const RUST_FABRIC: Look = Look::Tiled(Pattern::RustFabric);
pub(crate) const CARDBOARD: Look = Look::Tiled(Pattern::Cardboard);
pub(crate) const BOOKS: Look = Look::Tiled(Pattern::Books);

impl Look {
    /// A name for materials and texture files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Look::Plain(name, _) | Look::Glow(name, _) => name,
            Look::Tiled(pattern) | Look::Fitted(pattern) => pattern.name(),
        }
    }

    /// Its colour where it has no pattern.
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
        if matches!(self, Look::Fitted(_)) { Wrap::Clamp } else { Wrap::Repeat }
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

    /// The step of brightness nearest to `lit`; textures come in few steps, as each is an image of its own.
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
