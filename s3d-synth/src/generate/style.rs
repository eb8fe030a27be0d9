//! The finishes and materials of a building.

use crate::BuildingError;
use crate::look::*;

/// The finishes and materials to choose from. The `Default` is the style of the demo. No list may be empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Style {
    /// Colours of walls: red, green and blue, 0 to 255.
    pub walls: Vec<[f32; 3]>,
    /// Colours of the one wall with a paint of its own.
    pub accents: Vec<[f32; 3]>,
    /// Colours of skirtings.
    pub skirtings: Vec<[f32; 3]>,
    /// Floors.
    pub floors: Vec<FloorFinish>,
    /// Ceilings.
    pub ceilings: Vec<CeilingFinish>,
    /// Fabrics of seats.
    pub fabrics: Vec<Look>,
    /// Materials of tables and bookcases.
    pub woods: Vec<Look>,
    /// Materials of pots, mugs and bins.
    pub glazes: Vec<Look>,
    /// Materials of frames.
    pub frames: Vec<Look>,
    /// Pictures on walls.
    pub pictures: Vec<Pattern>,
    /// Pictures on boards.
    pub boards: Vec<Pattern>,
}

impl Default for Style {
    fn default() -> Self {
        Self {
            walls: vec![
                [228.0, 226.0, 214.0],
                [232.0, 228.0, 218.0],
                [236.0, 226.0, 206.0],
                [236.0, 232.0, 220.0],
            ],
            accents: vec![
                [158.0, 182.0, 172.0],
                [74.0, 100.0, 128.0],
                [206.0, 132.0, 96.0],
                [196.0, 176.0, 120.0],
            ],
            skirtings: vec![[196.0, 192.0, 182.0], [120.0, 84.0, 58.0], [108.0, 116.0, 120.0]],
            floors: vec![
                FloorFinish::CarpetTiles([112.0, 120.0, 132.0]),
                FloorFinish::CarpetTiles([128.0, 112.0, 98.0]),
                FloorFinish::PlanksAlongX(Wood::OAK),
                FloorFinish::PlanksAlongY(Wood::WALNUT),
                FloorFinish::Terrazzo,
            ],
            ceilings: vec![CeilingFinish::Tiles, CeilingFinish::Plaster, CeilingFinish::Boards],
            fabrics: vec![BLUE_FABRIC, GREY_FABRIC, RUST_FABRIC],
            woods: vec![OAK, WALNUT],
            glazes: vec![TEAL, CLAY, YELLOW, WHITE],
            frames: vec![STEEL, BLACK, WALNUT, OAK],
            pictures: vec![Pattern::Poster, Pattern::Landscape],
            boards: vec![Pattern::Whiteboard, Pattern::Plan, Pattern::Cork],
        }
    }
}

impl Style {
    pub(super) fn check(&self) -> Result<(), BuildingError> {
        let lists = [
            ("walls", self.walls.is_empty()),
            ("accents", self.accents.is_empty()),
            ("skirtings", self.skirtings.is_empty()),
            ("floors", self.floors.is_empty()),
            ("ceilings", self.ceilings.is_empty()),
            ("fabrics", self.fabrics.is_empty()),
            ("woods", self.woods.is_empty()),
            ("glazes", self.glazes.is_empty()),
            ("frames", self.frames.is_empty()),
            ("pictures", self.pictures.is_empty()),
            ("boards", self.boards.is_empty()),
        ];
        match lists.into_iter().find(|(_, is_empty)| *is_empty) {
            Some((what, _)) => Err(BuildingError::EmptyStyle { what }),
            None => Ok(()),
        }
    }
}
