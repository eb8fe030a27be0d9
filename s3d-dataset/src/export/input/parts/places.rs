//! Where a part lies: as its table says, or where it shows what the parts before it show.

use crate::align::align_meshes;
use crate::error::{Error, Result};
use glam::{DAffine3, DVec3};
use s3d_io::mesh::MeshFile;
use s3d_io::scene::{PartPlace, PartSource};

/// A part whose box is farther from the boxes of the parts before it, metres, is warned of.
const FAR_M: f32 = 1.0;

/// Where a part lies.
pub(super) struct Place {
    /// From where the part's mesh lies to where the area's mesh lies.
    pub(super) scene_from_part: DAffine3,
    /// How it was found, in a sentence.
    pub(super) note: Option<String>,
}

/// Returns where a part with this mesh lies. `earlier` is the mesh of the parts before it. `offsets_m` were
/// subtracted from the coordinates of the first part and of this one.
pub(super) fn place_of(
    source: &PartSource,
    file: &MeshFile,
    earlier: Option<&MeshFile>,
    offsets_m: [DVec3; 2],
) -> Result<Place> {
    let [from_scan, from_part] = offsets_m.map(DAffine3::from_translation);
    let near = |place: &DAffine3| from_scan.inverse() * *place * from_part;
    let earlier = match (&source.place, earlier) {
        (PartPlace::Given(place), _) => return Ok(Place { scene_from_part: near(place), note: None }),
        (PartPlace::Aligned, Some(earlier)) => earlier,
        (PartPlace::Aligned, None) => {
            return Err(Error::unfit(&source.path, "there is no part before it that it can be aligned to"));
        }
    };

    let report = align_meshes(&file.mesh, &earlier.mesh)
        .map_err(|error| Error::unfit(&source.path, format!("with the parts before it: {error}")))?;
    let (Some(place), None) = (report.place(), &report.doubt) else {
        let doubt = report.doubt.as_deref().unwrap_or("it was found nowhere");
        let why = format!(
            "with the parts before it: {doubt}; `s3d align` of the meshes prints the places: write the right \
             one as transform in place of align"
        );
        return Err(Error::unfit(&source.path, why));
    };
    let rows = crate::align::rows(&(from_scan * place.b_from_a * from_part.inverse()));
    let note = format!(
        "aligned: {:.0} % of it lie on the parts before it, {:.1} mm apart (the median); transform = {rows} \
         in place of align says the same sooner",
        100.0 * place.overlap[0],
        1000.0 * place.median_m
    );
    Ok(Place { scene_from_part: place.b_from_a, note: Some(note) })
}

/// A sentence about a part that lies far from the parts before it.
pub(super) fn gap_warning(part: &MeshFile, earlier: &MeshFile) -> Option<String> {
    let [a, b] = [part, earlier].map(|file| file.mesh.aabb());
    let gap_m = (a.min - b.max).max(b.min - a.max).max_element();
    let path = part.sources.first().map(|source| source.path.display().to_string());
    (gap_m > FAR_M).then(|| {
        format!(
            "{}: lies {gap_m:.1} m away from the parts before it: is its transform right?",
            path.unwrap_or_default()
        )
    })
}
