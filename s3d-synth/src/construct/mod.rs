//! Makes annotated surfaces of a building, with the light in their looks.

mod builder;
mod furniture;
mod light;
mod models;
mod openings;
mod shell;
mod things;

use crate::building::{Building, BuildingError, ScanLocation};
use crate::scene::AnnotatedScene;
use builder::Builder;

impl Building {
    /// Builds the scene. The result is the same at every call, on every platform.
    ///
    /// The faces of a room come in this order: fillings of openings, lamps, items, floor, ceiling, walls. The
    /// images of floors, walls and ceilings hold the light of windows and lamps, and shade around things.
    ///
    /// # Errors
    /// [`BuildingError`] if something is impossible: a room without a size, an opening outside its wall,
    /// rooms or openings that overlap, a thing that is too small to be built or leaves its room, a location
    /// outside of all rooms, …
    pub fn build(&self) -> Result<AnnotatedScene, BuildingError> {
        self.check()?;
        let mut builder = Builder::new(self.texture_scale);
        for room in &self.rooms {
            room.construct(&mut builder)?;
        }
        let (mesh, instance_of_face, instances) = builder.finish(self.origin)?;
        let locations = self.locations.iter().map(|location| ScanLocation {
            position: location.position + self.origin.as_dvec3(),
            ..location.clone()
        });
        Ok(AnnotatedScene {
            mesh,
            instance_of_face,
            instances,
            locations: locations.collect(),
            title: self.title.clone(),
        })
    }
}
