//! What a building looks like to a scanner: an annotated mesh.

use crate::BuildingError;
use crate::building::{Building, ScanLocation};
use crate::construct::builder::Builder;
use s3d_geom::TriMesh;
use s3d_label::{Class, Room};

/// A textured mesh with its annotation and its scan locations: what [`Building::build`] makes.
///
/// ```
/// use s3d_label::Class;
/// use s3d_synth::Building;
///
/// let building = Building { texture_scale: 0.1, ..Building::demo() };
/// let scene = building.build()?;
/// // Every face is one of an instance.
/// assert_eq!(scene.instance_of_face.len(), scene.mesh.faces().len());
/// let first = &scene.instances[scene.instance_of_face[0] as usize];
/// assert_eq!((first.class, first.number, first.room.to_string()), (Class::WINDOW, 1, "office_1".into()));
/// assert_eq!(scene.locations.len(), 6);
/// # Ok::<(), s3d_synth::BuildingError>(())
/// ```
#[derive(Clone, Debug)]
pub struct AnnotatedScene {
    /// Its surface with textures: world metres, Z-up. Room by room; fronts are on the side from which they
    /// are seen.
    pub mesh: TriMesh,
    /// Index into `instances` by face of the mesh.
    pub instance_of_face: Vec<u32>,
    /// The annotated objects, room by room. Each has faces, which follow one another.
    pub instances: Vec<Instance>,
    /// Where the scanner stood, in world coordinates.
    pub locations: Vec<ScanLocation>,
    /// The building's title.
    pub title: String,
}

/// An annotated object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instance {
    /// What it is.
    pub class: Class,
    /// Counts the objects of a class in a room, from 1.
    pub number: u32,
    /// Where it is.
    pub room: Room,
}

impl Building {
    /// Builds the scene: the same at every call, on every platform.
    ///
    /// A room's faces come in this order: what fills its openings, its lamps, its items, floor, ceiling,
    /// walls. The images of floors, walls and ceilings hold the light of windows and lamps, and shade where
    /// something stands.
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
