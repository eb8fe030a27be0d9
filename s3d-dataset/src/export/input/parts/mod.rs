//! An area that is joined from parts, each a scene of its own that was scanned apart.

mod places;
mod rooms;
mod seams;

use crate::error::{Error, InputError, Result};
use crate::export::input::area::{AreaInput, PictureSet, RoomInput};
use crate::export::input::cameras::Cameras;
use crate::export::input::mesh::{MeshFrame, MeshSource, PartMesh};
use crate::export::input::numbering::number;
use crate::export::input::photographs::Photographs;
use crate::export::input::scene::{Opened, cameras_of, companions_of, files_of, open_annotations};
use crate::options::placing::Placing;
use glam::DAffine3;
use places::{gap_warning, place_of};
use rooms::{JoinedRooms, PartRooms, join_rooms};
use s3d_geom::NO_INDEX;
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::OnFault;
use s3d_io::mesh::MeshFile;
use s3d_io::scene::SceneFile;
use s3d_label::{Room, Taxonomy};
use seams::faces_beside;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl AreaInput {
    /// Opens an area of parts. `open` opens the scene of a part.
    pub(super) fn of_parts(
        scene: SceneFile,
        asked: Option<Placing>,
        opened: Opened,
        open: impl Fn(&Path) -> Result<Self>,
    ) -> Result<Self> {
        let mut joining: Option<Joining> = None;
        let mut parts = Vec::new();
        for source in &scene.parts {
            let mut part = open(&source.path)?;
            let file = part.take_mesh()?;
            let first_offset_m = parts
                .first()
                .map_or(part.frame.offset_m, |p: &Part| p.area.frame.offset_m);
            let offsets_m = [first_offset_m, part.frame.offset_m];

            let earlier = joining.as_ref().map(|joining| &joining.file);
            let place = place_of(source, &file, earlier, offsets_m)?;
            let (moved, faces_moved) = file.transformed(&place.scene_from_part)?;
            let faces = earlier.and_then(|earlier| faces_beside(&moved.mesh, &earlier.mesh));
            part.notes.extend(place.note);
            part.warnings
                .extend(earlier.and_then(|earlier| gap_warning(&moved, earlier)));
            if let Some(faces) = &faces {
                let (all, left) = (moved.mesh.faces().len(), faces.len());
                part.notes
                    .push(format!("{} of {all} faces lie on earlier parts and are left out", all - left));
            }

            let moved = match &faces {
                Some(faces) if faces.is_empty() => {
                    let why = "all of it lies on the parts before it: leave it out";
                    return Err(Error::unfit(&source.path, why));
                }
                Some(faces) => moved.with_faces(faces)?,
                None => moved,
            };
            let faces_kept = match &faces {
                Some(faces) => faces.iter().map(|face| faces_moved[*face as usize]).collect(),
                None => faces_moved,
            };
            parts.push(Part { area: part, scene_from_part: place.scene_from_part, faces, faces_kept });
            joining = Some(match joining.take() {
                None => Joining::new(moved)?,
                Some(joining) => joining.with(moved)?,
            });
        }
        let Some(joining) = joining else { return Err(Error::unfit(&scene.path, "has no part")) };
        if !scene.is_labelled {
            refuse_mixed(&parts)?;
        }
        join(scene, asked, opened, parts, joining)
    }
}

/// A part that was opened and placed.
struct Part {
    area: AreaInput,
    scene_from_part: DAffine3,
    /// The faces of the moved mesh that stay.
    faces: Option<Vec<u32>>,
    /// The same, as faces of the mesh before it was moved.
    faces_kept: Vec<u32>,
}

/// The mesh of the parts so far.
struct Joining {
    file: MeshFile,
    /// For each part the number in `file` of each face that it brought.
    numbers: Vec<Vec<u32>>,
}

impl Joining {
    fn new(first: MeshFile) -> Result<Self> {
        let count = first.mesh.faces().len() as u32;
        Ok(Self { file: first, numbers: vec![(0..count).collect()] })
    }

    fn with(self, next: MeshFile) -> Result<Self> {
        let (before, more) = (self.file.mesh.faces().len() as u32, next.mesh.faces().len() as u32);
        let (file, kept) = self.file.joined([Ok(next)])?;
        let mut new = vec![NO_INDEX; (before + more) as usize];
        (0..).zip(&kept).for_each(|(number, face)| new[*face as usize] = number);

        let mut numbers = self.numbers;
        numbers.push((before..before + more).collect());
        let renumber = |face: &mut u32| {
            if *face != NO_INDEX {
                *face = new[*face as usize];
            }
        };
        numbers.iter_mut().flatten().for_each(renumber);
        Ok(Self { file, numbers })
    }
}

/// Refuses parts with and without labels, and parts of different taxonomies.
fn refuse_mixed(parts: &[Part]) -> Result<()> {
    let path = |part: &Part| part.area.path.clone();
    let with = parts.iter().find(|part| part.area.is_labelled);
    let without = parts.iter().find(|part| !part.area.is_labelled);
    if let (Some(with), Some(without)) = (with, without) {
        return Err(InputError::MixedLabels { with: path(with), without: path(without) }.into());
    }
    for part in parts {
        let [first, taxonomy] = [&parts[0], part].map(|part| &part.area.taxonomy);
        if taxonomy != first {
            return Err(InputError::MixedTaxonomies {
                first: (path(&parts[0]), first.name().to_owned()),
                second: (path(part), taxonomy.name().to_owned()),
            }
            .into());
        }
    }
    Ok(())
}

/// Joins what the parts bring.
fn join(
    scene: SceneFile,
    asked: Option<Placing>,
    opened: Opened,
    mut parts: Vec<Part>,
    joining: Joining,
) -> Result<AreaInput> {
    let frame = MeshFrame { bounds: joining.file.mesh.aabb(), ..parts[0].area.frame };
    let mut notes: Vec<String> = Vec::new();
    for (number, part) in (1..).zip(&mut parts) {
        let name = part.area.path.display().to_string();
        notes.extend(part.area.notes.drain(..).map(|note| format!("{name}: {note}")));
        for record in &mut part.area.records {
            record.path = format!("{}:part {number}", record.path);
        }
    }

    let labels = join_labels(&scene, opened, &mut parts, &joining, &frame)?;
    notes.extend(labels.notes);

    let listed = cameras_of(&scene, asked, &frame)?;
    let mut pictures = Vec::new();
    let (cameras, cameras_path) = match listed {
        Some(listed) => listed,
        None => (join_cameras(&scene, &mut parts, &labels.new_rooms, &mut pictures)?, scene.path.clone()),
    };
    if pictures.is_empty() && parts.iter().any(|part| !part.area.pictures.is_empty()) {
        let why = "its scan locations are other places than the pictures of its parts were taken at: take \
                   the locations of the parts, or leave out rgb there";
        return Err(Error::unfit(&scene.path, why));
    }

    let mut photographs = Photographs::default();
    let mut files: BTreeSet<PathBuf> = BTreeSet::new();
    let mut sources = files_of(&scene);
    sources.extend(labels.companions);
    let mut warnings = labels.warnings;
    let is_labelled = scene.is_labelled || parts[0].area.is_labelled;
    let mut lenient = scene.annotation_options.on_fault == OnFault::Skip;
    let (mut annotations, mut records) = (scene.annotations, Vec::new());
    let mut meshes = Vec::new();
    for (number, part) in (1..).zip(parts) {
        let Part { area, scene_from_part, faces, .. } = part;
        photographs.append(area.photographs, &scene_from_part, scene.area, number);
        warnings.extend(area.warnings);
        files.extend(area.files);
        sources.extend(area.sources);
        annotations.extend(area.annotations);
        records.extend(area.records);
        lenient |= area.lenient;
        meshes.push(PartMesh { source: area.source, scene_from_part, faces });
    }
    files.extend(sources.iter().cloned());
    // Two parts may share a list of locations.
    let mut seen = BTreeSet::new();
    sources.retain(|path| seen.insert(path.clone()));

    Ok(AreaInput {
        number: scene.area,
        source: MeshSource::Parts(Box::new(meshes.remove(0)), meshes),
        frame,
        mesh_file: opened.keep_mesh.then(|| Arc::new(joining.file)),
        pictures,
        is_labelled,
        taxonomy: labels.taxonomy,
        rooms: labels.rooms,
        cameras,
        cameras_path,
        photographs,
        notes,
        warnings,
        lenient,
        files: files.into_iter().collect(),
        sources,
        annotations,
        found: None,
        records,
        path: scene.path,
    })
}

/// The labels of an area of parts.
struct Labels {
    taxonomy: Taxonomy,
    rooms: Vec<RoomInput>,
    /// For each part the rooms that have other names now.
    new_rooms: Vec<BTreeMap<Room, Room>>,
    notes: Vec<String>,
    warnings: Vec<String>,
    companions: Vec<PathBuf>,
}

/// Joins the labels of parts, or opens those of the whole area.
fn join_labels(
    scene: &SceneFile,
    opened: Opened,
    parts: &mut [Part],
    joining: &Joining,
    frame: &MeshFrame,
) -> Result<Labels> {
    let keep_names = parts
        .iter()
        .all(|part| matches!(part.area.source, MeshSource::Published(_)));
    let of_parts = parts
        .iter_mut()
        .zip(&joining.numbers)
        .map(|(part, numbers)| PartRooms {
            path: part.area.path.clone(),
            rooms: std::mem::take(&mut part.area.rooms),
            scene_from_part: part.scene_from_part,
            face_of_face: face_of_face(&part.faces_kept, numbers),
        })
        .collect();
    let JoinedRooms { rooms, new_rooms, notes } = join_rooms(scene.area, of_parts, keep_names)?;
    let taxonomy = parts[0].area.taxonomy.clone();
    let (warnings, companions) = (Vec::new(), Vec::new());
    let mut labels = Labels { taxonomy, rooms, new_rooms, notes, warnings, companions };
    if !scene.is_labelled {
        return Ok(labels);
    }

    labels.taxonomy = scene.taxonomy.clone();
    if opened.annotations {
        let mut annotations =
            frame.open_beside(|offset_m| open_annotations(scene, &joining.file, frame, offset_m))?;
        labels.warnings = std::mem::take(&mut annotations.warnings);
        labels.companions = companions_of(scene, &mut annotations);
        let of = scene.annotations.first().unwrap_or(&scene.path);
        labels.rooms = number(scene.area, annotations).map_err(|e| Error::unfit(of, e.to_string()))?;
    }
    Ok(labels)
}

/// For each face of a part's mesh its number in the mesh of the area, or [`NO_INDEX`]. `kept` are the faces
/// that stay, with their numbers.
fn face_of_face(kept: &[u32], numbers: &[u32]) -> Arc<[u32]> {
    let count = kept.last().map_or(0, |last| *last as usize + 1);
    let mut of_face = vec![NO_INDEX; count];
    for (face, number) in kept.iter().zip(numbers) {
        of_face[*face as usize] = *number;
    }
    of_face.into()
}

/// Joins the scan locations of parts, with the pictures that were taken there.
fn join_cameras(
    scene: &SceneFile,
    parts: &mut [Part],
    new_rooms: &[BTreeMap<Room, Room>],
    pictures: &mut Vec<PictureSet>,
) -> Result<Cameras> {
    let are_placed = |part: &Part| matches!(part.area.cameras, Cameras::Placed(_));
    let placed = parts.iter().find(|part| are_placed(part));
    let listed = parts.iter().find(|part| !are_placed(part));
    if let (Some(placed), Some(listed)) = (placed, listed) {
        let why = format!(
            "{} lists scan locations, and {} does not: give both a list, or name one here, under [cameras]",
            listed.area.path.display(),
            placed.area.path.display()
        );
        return Err(Error::unfit(&scene.path, why));
    }

    let (mut locations, mut rooms): (Vec<ScanLocation>, Vec<Option<Room>>) = Default::default();
    let mut part_of: BTreeMap<String, PathBuf> = BTreeMap::new();
    for (part, new_rooms) in parts.iter_mut().zip(new_rooms) {
        let area = &mut part.area;
        let (of_part, rooms_of_part) = match &mut area.cameras {
            Cameras::Placed(placing) => return Ok(Cameras::Placed(*placing)),
            Cameras::Listed(locations, rooms) => (std::mem::take(locations), std::mem::take(rooms)),
        };

        for location in &of_part {
            let uuid = &location.uuid;
            if let Some(other) = part_of.insert(uuid.to_ascii_lowercase(), area.path.clone()) {
                let why = format!("uuid {uuid} is also in {}", other.display());
                return Err(Error::unfit(&area.path, why));
            }
        }
        for mut set in area.pictures.drain(..) {
            set.locations = set.locations.start + locations.len()..set.locations.end + locations.len();
            set.scene_from_part = part.scene_from_part;
            pictures.push(set);
        }
        let moved =
            |l: ScanLocation| ScanLocation { pose: l.pose.moved(&part.scene_from_part), line: 0, ..l };
        locations.extend(of_part.into_iter().map(moved));
        let renamed = |room: Room| new_rooms.get(&room).copied().unwrap_or(room);
        // Labels of the whole area may have other rooms.
        let are_of_parts = !scene.is_labelled;
        rooms.extend(
            rooms_of_part
                .into_iter()
                .map(|room| room.filter(|_| are_of_parts).map(renamed)),
        );
    }
    Ok(Cameras::Listed(locations, rooms))
}
