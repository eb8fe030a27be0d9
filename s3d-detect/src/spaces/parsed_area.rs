//! Areas, cut into the spaces to search.

use crate::area::{Area, Element};
use crate::error::Result;
use crate::spaces::space::{Space, SpaceSource, spaces_of};
use s3d_dataset::{Context, DataSet};

/// An area with its spaces.
#[derive(Clone, Debug)]
pub struct ParsedArea {
    /// Its number.
    pub number: u32,
    /// The names of its rooms.
    pub rooms: Vec<String>,
    /// Its spaces.
    pub spaces: Vec<Space>,
    /// Its annotated elements, in the world frame.
    pub elements: Vec<Element>,
    /// How well its spaces agree with its rooms: the adjusted Rand index.
    pub agreement: f64,
}

impl ParsedArea {
    /// Cuts an area into spaces.
    pub fn new(area: Area, source: SpaceSource) -> Self {
        let (spaces, agreement) = spaces_of(&area, source);
        Self { number: area.number, rooms: area.rooms, spaces, elements: area.elements, agreement }
    }
}

/// Reads areas one after the other, and cuts each into spaces.
///
/// # Errors
/// Fails like [`Area::read`].
pub fn read_areas(
    data: &DataSet,
    areas: &[u32],
    source: SpaceSource,
    ctx: &Context,
) -> Result<Vec<ParsedArea>> {
    let parsed = areas.iter().map(|&number| {
        let area = Area::read(data, number, ctx)?;
        Ok(ParsedArea::new(area, source))
    });
    parsed.collect()
}
