//! Objects as groups of segments. ScanNet++ has a segment for each vertex of its mesh (`segments.json`) and
//! groups of them (`segments_anno.json`). 3RScan has the groups (`semseg.v2.json`) and the object of each
//! vertex (`labels.instances.annotated.v2.ply`). Matterport3D has groups (`region0.semseg.json`) and a
//! segment for each face of the mesh of a region or house (`region0.fsegs.json`). Sources:
//! scannetpp/scannetpp, common/scene_release.py and semantic/prep; WaldJohannaU/3RScan, FAQ.md;
//! niessner/Matterport, data_organization.md.

use crate::cloud::label_files::numbers::faces_of_file;
use crate::cloud::label_files::{files_of, folder_of, name_of};
use crate::cloud::scannet::{SegmentGroup, SegmentGroups, Segments};
use crate::error::{Error, Result};
use crate::fs::json::read_json;
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis};
use crate::mesh::labels::{LabelColumn, LabelElement, LabelledObject, MeshLabels, NO_LABEL};
use crate::mesh::read::read_mesh_with;
use s3d_geom::{NO_INDEX, TriMesh};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Returns the groups of 3RScan whose objects the vertices of a mesh name, if they lie beside it.
pub(super) fn groups_of_objects_beside(mesh: &Path) -> Option<PathBuf> {
    let groups = folder_of(mesh).join("semseg.v2.json");
    groups.is_file().then_some(groups)
}

/// Reads the mesh that groups are about.
///
/// # Errors
/// [`Error::Format`] if its files are not beside the groups, or do not belong together.
pub(super) fn read(groups: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let dir = folder_of(groups);
    if let Some(stem) = stem_of_faces(groups) {
        return read_faces(groups, &stem, up, options);
    }
    let segments = dir.join("segments.json");
    if segments.is_file() {
        return read_segments(groups, &segments, up, options);
    }

    let labels = files_of(&dir)
        .into_iter()
        .find(|path| name_of(path).starts_with("labels.instances") && name_of(path).ends_with(".ply"));
    let labels = labels.ok_or_else(|| {
        Error::format(
            groups,
            "the file that tells what belongs to its objects is not beside it: segments.json, as in \
             ScanNet++, or labels.instances.annotated.v2.ply, as in 3RScan",
        )
    })?;
    let mut file = read_mesh_with(&labels, up, options)?;
    let columns = file.labels.as_ref().ok_or_else(|| no_objects(groups))?;
    file.labels = Some(named(columns, &file.mesh, groups)?);
    Ok(file)
}

/// Returns the start of the names of the files that belong to Matterport3D's groups: `region0`.
fn stem_of_faces(groups: &Path) -> Option<String> {
    let name = groups.file_name()?.to_str()?;
    name.strip_suffix(".semseg.json").map(str::to_owned)
}

/// Reads the mesh of Matterport3D. A face in several groups belongs to the smallest.
fn read_faces(groups: &Path, stem: &str, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let document: SegmentGroups = read_json(groups)?;
    let [segments, mesh] = ["fsegs.json", "ply"].map(|end| groups.with_file_name(format!("{stem}.{end}")));
    for path in [&segments, &mesh] {
        if !path.is_file() {
            let message = format!("a file that belongs to it is not beside it: {}", name_of(path));
            return Err(Error::format(groups, message));
        }
    }

    let segment_of_face = read_json::<Segments>(&segments)?.seg_indices;
    let options = MeshOptions { class_column: None, instance_column: None, ..options.clone() };
    let mut file = read_mesh_with(&mesh, up, &options)?;
    let faces = faces_of_file(&file);
    if !faces.contains(&segment_of_face.len()) {
        let n = segment_of_face.len();
        let message = format!(
            "has segments for {n} faces, {} has {}: they do not belong together",
            mesh.display(),
            faces.end()
        );
        return Err(Error::format(&segments, message));
    }

    let group_of_segment = smallest_groups(&document.seg_groups, &segment_of_face);
    let group_of_face = file.source_faces.iter().map(|face| {
        let segment = segment_of_face.get(*face as usize);
        let group = segment.and_then(|segment| group_of_segment.get(segment));
        group.map_or(NO_LABEL, |group| *group as i64)
    });
    let column = LabelColumn { name: "objectId".into(), values: group_of_face.collect() };
    let by_face = MeshLabels::Numbers { element: LabelElement::Face, class: None, instance: Some(column) };
    let group_of = |number: i64| document.seg_groups.get(usize::try_from(number).ok()?);
    file.labels = Some(named_by(&by_face, &file.mesh, groups, group_of)?);
    file.companions.push(segments);
    Ok(file)
}

/// Reads the mesh of ScanNet++. A vertex in several groups belongs to the smallest of them.
fn read_segments(groups: &Path, segments: &Path, up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let document: SegmentGroups = read_json(groups)?;
    let segment_of_vertex = read_json::<Segments>(segments)?.seg_indices;
    let dir = folder_of(groups);
    let meshes: Vec<PathBuf> = files_of(&dir)
        .into_iter()
        .filter(|p| name_of(p).ends_with(".ply"))
        .collect();
    let mesh = meshes
        .iter()
        .find(|path| name_of(path).contains("aligned"))
        .or(meshes.first());
    let mesh = mesh.ok_or_else(|| {
        Error::format(groups, "the mesh that it is about is not beside it: mesh_aligned_0.05.ply")
    })?;

    let mut file = read_mesh_with(mesh, up, options)?;
    let vertices = file.mesh.positions().len();
    if segment_of_vertex.len() != vertices {
        let n = segment_of_vertex.len();
        let message = format!(
            "has segments for {n} vertices, {} has {vertices}: they do not belong together",
            mesh.display()
        );
        return Err(Error::format(segments, message));
    }

    let group_of_segment = smallest_groups(&document.seg_groups, &segment_of_vertex);
    let group_of_vertex = segment_of_vertex
        .iter()
        .map(|segment| group_of_segment.get(segment).map_or(NO_LABEL, |group| *group as i64));
    let column = LabelColumn { name: "objectId".into(), values: group_of_vertex.collect() };
    let by_vertex =
        MeshLabels::Numbers { element: LabelElement::Vertex, class: None, instance: Some(column) };
    let group_of = |number: i64| document.seg_groups.get(usize::try_from(number).ok()?);
    file.labels = Some(named_by(&by_vertex, &file.mesh, groups, group_of)?);
    file.companions.push(segments.to_owned());
    Ok(file)
}

/// Returns the group of each segment: the smallest by its vertices or faces, or else the first, of those that
/// have it.
fn smallest_groups(groups: &[SegmentGroup], segment_of_each: &[i64]) -> HashMap<i64, usize> {
    let mut size_of_segment: HashMap<i64, u64> = HashMap::new();
    for segment in segment_of_each {
        *size_of_segment.entry(*segment).or_default() += 1;
    }

    let mut found: HashMap<i64, (u64, usize)> = HashMap::new();
    for (i, group) in groups.iter().enumerate() {
        let sizes = group.segments.iter().filter_map(|segment| size_of_segment.get(segment));
        let size = sizes.sum();
        for segment in &group.segments {
            let best = found.entry(*segment).or_insert((size, i));
            *best = (*best).min((size, i));
        }
    }
    found
        .into_iter()
        .map(|(segment, (_, group))| (segment, group))
        .collect()
}

/// Gives the objects of a mesh the words of their groups.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the groups are damaged, or the mesh has no objects.
pub(super) fn named(labels: &MeshLabels, mesh: &TriMesh, groups: &Path) -> Result<MeshLabels> {
    let document: SegmentGroups = read_json(groups)?;
    let by_number: HashMap<i64, &SegmentGroup> = document
        .seg_groups
        .iter()
        .filter_map(|group| Some((group.object()?, group)))
        .collect();
    named_by(labels, mesh, groups, |number| by_number.get(&number).copied())
}

/// Makes objects of a column of numbers, each of which stands for a group.
fn named_by<'g>(
    labels: &MeshLabels,
    mesh: &TriMesh,
    path: &Path,
    group_of: impl Fn(i64) -> Option<&'g SegmentGroup>,
) -> Result<MeshLabels> {
    let MeshLabels::Numbers { instance: Some(column), .. } = labels.clone().into_faces(mesh) else {
        return Err(no_objects(path));
    };

    let mut objects = Vec::new();
    let mut index: HashMap<i64, u32> = HashMap::new();
    let faces = column.values.iter().map(|&number| {
        *index.entry(number).or_insert_with(|| {
            let Some(group) = group_of(number).filter(|_| number != NO_LABEL) else { return NO_INDEX };
            let instance = group.object().unwrap_or(number);
            objects.push(LabelledObject { class: group.label.clone(), instance, room: None });
            objects.len() as u32 - 1
        })
    });
    let faces = faces.collect();
    Ok(MeshLabels::Objects { objects, faces, are_names: false })
}

fn no_objects(groups: &Path) -> Error {
    Error::format(groups, "its mesh has no column of objects, such as objectId")
}
