//! A building as a scanner sees it: an annotated mesh.

use crate::building::ScanLocation;
use s3d_geom::TriMesh;
use s3d_label::{Class, Room};

/// A textured mesh with its annotation and its scan locations, made by
/// [`Building::build`](crate::Building::build).
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
    /// The surface with textures: world metres, Z-up, room by room. Fronts are on the side from which they
    /// are seen.
    pub mesh: TriMesh,
    /// Index into `instances` by face of the mesh.
    pub instance_of_face: Vec<u32>,
    /// The annotated objects, room by room. Each has at least one face, and its faces follow one another.
    pub instances: Vec<Instance>,
    /// The places where the scanner stood, in world coordinates.
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
