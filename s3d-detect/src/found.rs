//! The elements that a trained model finds in an area.

use crate::area::CLASSES;
use crate::error::{Error, Result};
use crate::model::Model;
use crate::proposals::Prepared;
use crate::spaces::parsed_area::ParsedArea;
use rayon::prelude::*;
use s3d_dataset::Context;
use serde::{Deserialize, Serialize};

/// An element that was found, in the world frame. `s3d eval det` reads a JSON list of these.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundBox {
    /// The number of the area.
    pub area: u32,
    /// The room of most of its points.
    pub room: String,
    /// The name of its class.
    pub class: String,
    /// Its score in context.
    pub score: f64,
    /// The least corner in metres.
    pub min: [f32; 3],
    /// The largest corner in metres.
    pub max: [f32; 3],
}

/// Returns the elements that the first machines of a model find in an area: by space, then by class, the best
/// first.
///
/// # Errors
/// [`Error::Dataset`] if the call is cancelled; [`Error::UnnamedRoom`] if an area made by hand lacks the name
/// of a room with an element.
pub fn detect_area(model: &Model, area: &ParsedArea, ctx: &Context) -> Result<Vec<FoundBox>> {
    let progress = ctx.progress("detecting", "spaces", area.spaces.len() as u64);
    let found = area.spaces.par_iter().map(|space| {
        ctx.check()?;
        let prepared = Prepared::new(space);
        let proposals = model.proposer.propose(&prepared);
        let detections = model.detect(&prepared, &proposals).swap_remove(0);
        progress.add(1);

        let found = detections.iter().map(|d| {
            let room = space.room_of(&d.bbox);
            let Some(name) = area.rooms.get(room as usize) else {
                return Err(Error::UnnamedRoom { area: area.number, room, rooms: area.rooms.len() });
            };

            let bbox = space.to_world(&d.bbox);
            Ok(FoundBox {
                area: area.number,
                room: name.clone(),
                class: CLASSES[d.class].name().to_owned(),
                score: d.in_context,
                min: bbox.min.to_array(),
                max: bbox.max.to_array(),
            })
        });
        found.collect::<Result<Vec<_>>>()
    });
    Ok(found.collect::<Result<Vec<_>>>()?.concat())
}
