//! Checks the exported meshes against each other and against the votes: one mesh has colours, the other
//! labels.

use super::labels::Labels;
use super::report::{OfFile, Report, Topic};
use crate::record::manifest::{Manifest, XyzLoss};
use crate::summary::Surface;
use s3d_geom::TriMesh;
use s3d_io::dataset::{Layout, read_face_votes, read_source_faces};
use s3d_io::fs::read_json;
use s3d_io::mesh::{MeshFile, UpAxis, read_mesh};
use s3d_label::{LabelId, fill_labels};
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

const MESH: (Topic, &str) = (Topic::Mesh, "meshes that differ");
const VOTES: (Topic, &str) = (Topic::Mesh, "faces and votes");

/// The index of a face whose label is not in the table.
pub(crate) const NOT_IN_TABLE: u32 = 0xff_fffe;

/// An area's mesh with the label of each face.
pub(crate) struct LabelledMesh {
    pub(crate) file: MeshFile,
    /// The index of the face's label in the label table, or [`NOT_IN_TABLE`].
    pub(crate) label_of_face: Vec<u32>,
    /// Whether no face has [`NOT_IN_TABLE`].
    pub(crate) all_in_table: bool,
    /// Whether each face has votes. Other faces have a label by filling, or none.
    pub(crate) is_voted: Vec<bool>,
}

/// Reads and checks both meshes of an area.
pub(crate) fn read_and_check(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    labels: &Labels,
    report: &Report,
) -> Option<LabelledMesh> {
    let colored = layout.rgb_obj(area);
    let semantic = layout.semantic_obj(area);
    let semantic_file = if manifest.is_labelled() {
        read(layout, area, &semantic, report)
    } else {
        None
    };
    let names = semantic_file.map(|file| (label_names(&file.mesh, labels, &semantic, report), file.mesh));

    let file = read(layout, area, &colored, report)?;
    let faces = file.mesh.faces().len();
    check_manifest(layout, area, manifest, &file, report);
    check_source_faces(&layout.source_faces_npz(area), faces, report);

    if !manifest.is_labelled() {
        let label_of_face = vec![0; faces];
        let is_voted = vec![false; faces];
        return Some(LabelledMesh { file, label_of_face, all_in_table: true, is_voted });
    }

    let (label_of_face, other) = names?;
    let same = report.check(faces == other.faces().len(), MESH, &semantic, || {
        format!("{} faces, and rgb.obj has {faces}", other.faces().len())
    });
    if !same {
        return None;
    }

    let differs = (0..faces as u32).find(|&f| file.mesh.triangle(f) != other.triangle(f));
    report.check(differs.is_none(), MESH, &semantic, || {
        let face = differs.unwrap_or_default();
        format!(
            "face {face} (from 0) is {:?}, and that of rgb.obj {:?}",
            other.triangle(face),
            file.mesh.triangle(face)
        )
    });

    drop(other);
    let all_in_table = !label_of_face.contains(&NOT_IN_TABLE);
    let mut labelled = LabelledMesh { file, label_of_face, all_in_table, is_voted: Vec::new() };
    labelled.is_voted = check_votes(layout, area, &labelled, (labels, manifest.options.fill), report);

    check_unlabelled(layout, area, manifest, &labelled, report);
    Some(labelled)
}

/// Reads a mesh, and the files that it names.
fn read(layout: &Layout, area: u32, path: &Path, report: &Report) -> Option<MeshFile> {
    let materials = path.with_extension("mtl");
    let textures = layout.mesh_dir(area).join("rgb_textures");
    let file = report.read(Topic::Mesh, path, |path| {
        report.check_sizes(|other| *other == *materials || other.starts_with(&textures))?;
        read_mesh(path, UpAxis::Y)
    })?;
    for warning in &file.warnings {
        report.fault(Topic::Mesh, "what is wrong in a mesh", path, warning);
    }
    Some(file)
}

/// Checks the number of faces and the loss of coordinates that the manifest tells.
fn check_manifest(layout: &Layout, area: u32, manifest: &Manifest, file: &MeshFile, report: &Report) {
    let Some(entry) = manifest.area(area) else { return };
    let faces = file.mesh.faces().len();
    report.check(faces == entry.faces, MESH, &layout.rgb_obj(area), || {
        format!("{faces} faces, and the manifest tells of {}", entry.faces)
    });

    let loss = XyzLoss::of(file.mesh.aabb(), manifest.conventions().xyz);
    let topic = (Topic::Manifest, "loss of coordinates");
    report.check(entry.xyz == loss, topic, &layout.manifest(), || {
        format!("area {area}: the loss of coordinates is {:?}, and that of its mesh {loss:?}", entry.xyz)
    });
}

/// Checks that each face comes from a face of the scan, in the scan's order. Data sets of earlier versions
/// and meshes that no file held have no such list.
fn check_source_faces(path: &Path, faces: usize, report: &Report) {
    if !path.exists() {
        return;
    }
    let Some(source) = report.read(Topic::Mesh, path, read_source_faces) else { return };
    let told = source.face.len();
    report.check(told == faces, MESH, path, || format!("{told} faces, and rgb.obj has {faces}"));
    let order = source.file.iter().zip(&source.face);
    report.check(order.is_sorted(), MESH, path, || "faces are not in the order of their files".to_owned());
}

/// Checks the surface without votes and without a label that the manifest tells.
fn check_unlabelled(layout: &Layout, area: u32, manifest: &Manifest, mesh: &LabelledMesh, report: &Report) {
    let Some(told) = manifest.area(area).and_then(|entry| entry.unlabelled) else { return };
    let without_votes = mesh.is_voted.iter().map(|is_voted| !is_voted);
    let without_label = mesh.label_of_face.iter().map(|label| *label == 0);
    for (what, told, (faces, m2)) in [
        ("votes", told.without_votes, surface(&mesh.file.mesh, without_votes)),
        ("a label", told.without_label, surface(&mesh.file.mesh, without_label)),
    ] {
        let same = told.faces == faces && (told.m2 - m2).abs() <= 1e-6 * m2;
        report.check(same, MESH, &layout.manifest(), || {
            let Surface { faces: n, m2: area, .. } = told;
            format!("{n} faces of {area} m² without {what}, and the mesh has {faces} of {m2} m²")
        });
    }
}

/// Counts the chosen faces, and sums their area in m².
fn surface(mesh: &TriMesh, is_chosen: impl Iterator<Item = bool>) -> (u64, f64) {
    let faces = (0..).zip(is_chosen).filter(|(_, is_chosen)| *is_chosen);
    faces.fold((0, 0.0), |(n, m2), (face, _)| (n + 1, m2 + mesh.area(face)))
}

/// The index of each face's label, found by the names of materials.
fn label_names(mesh: &TriMesh, labels: &Labels, path: &Path, report: &Report) -> Vec<u32> {
    let indices: Vec<u32> = mesh
        .materials()
        .iter()
        .map(|m| {
            let index = labels.index_of(&m.name);
            report.check(index.is_some(), MESH, path, || {
                format!("the material {:?} is no label of semantic_labels.json", m.name)
            });
            index.unwrap_or(NOT_IN_TABLE)
        })
        .collect();
    (0..mesh.faces().len() as u32)
        .map(|face| mesh.material_of(face).map_or(NOT_IN_TABLE, |m| indices[m as usize]))
        .collect()
}

#[derive(Deserialize)]
struct VoteRecord {
    name: String,
    faces_voted: u64,
}

#[derive(Deserialize)]
struct TotalRecord {
    faces_voted: u64,
}

#[derive(Deserialize)]
struct VotesRecord {
    faces: u64,
    faces_without_votes: u64,
    total: TotalRecord,
    rooms: Vec<VoteRecord>,
    classes: Vec<VoteRecord>,
}

/// Checks the labels of `semantic.obj` against the votes, and against the report on them. Returns whether
/// each face has votes.
fn check_votes(
    layout: &Layout,
    area: u32,
    mesh: &LabelledMesh,
    (labels, fill_m): (&Labels, Option<f64>),
    report: &Report,
) -> Vec<bool> {
    let voted = check_face_votes(&layout.votes_npz(area), mesh, fill_m, report);

    let path = layout.votes_json(area);
    if let Some(votes) = report.read(Topic::Mesh, &path, read_json::<VotesRecord>) {
        check_vote_report(&votes, &voted, labels, &report.of(VOTES, &path));
    }
    voted.into_iter().map(|label| label != 0).collect()
}

/// Checks the labels of `semantic.obj` against the votes of each face. Labels of faces without votes must be
/// the ones that filling gives. Returns the labels by votes alone, 0 without votes.
fn check_face_votes(path: &Path, mesh: &LabelledMesh, fill_m: Option<f64>, report: &Report) -> Vec<u32> {
    let LabelledMesh { file, label_of_face, .. } = mesh;
    let mut voted = label_of_face.clone();

    // Data sets of earlier versions have no votes. A file that is listed but missing is reported with the
    // list of files.
    if !path.exists() {
        return voted;
    }
    let Some(votes) = report.read(Topic::Mesh, path, read_face_votes) else { return voted };

    let won = votes.label == *label_of_face;
    report.check(won, VOTES, path, || "other labels won than semantic.obj has".to_owned());
    for (label, _) in voted.iter_mut().zip(&votes.total).filter(|(_, total)| **total == 0) {
        *label = 0;
    }

    let mut filled: Vec<LabelId> = voted.iter().map(|label| LabelId(*label)).collect();
    if let Some(within_m) = fill_m.filter(|_| won) {
        fill_labels(&file.mesh, &mut filled, within_m);
    }
    let odd = filled
        .iter()
        .zip(label_of_face)
        .filter(|(filled, label)| filled.0 != **label)
        .count();
    report.check(!won || odd == 0, VOTES, path, || {
        format!("{odd} faces have other labels than votes and filling give them")
    });

    let sums = votes.votes.iter().zip(&votes.runner_up_votes).zip(&votes.total);
    let odd = sums.filter(|((first, second), total)| {
        first < second || u64::from(**first) + u64::from(**second) > u64::from(**total)
    });
    let odd = odd.count();
    report.check(odd == 0, VOTES, path, || format!("{odd} faces have votes that do not add up"));
    voted
}

/// Checks the report on votes against the labels by votes: faces in all, by room and by class.
fn check_vote_report(votes: &VotesRecord, voted: &[u32], labels: &Labels, checks: &OfFile<'_>) {
    let mut per_label = vec![0u64; labels.len()];
    for label in voted {
        if let Some(count) = per_label.get_mut(*label as usize) {
            *count += 1;
        }
    }

    let mut rooms: BTreeMap<String, u64> = BTreeMap::new();
    let mut classes: BTreeMap<&str, u64> = labels.taxonomy.classes().iter().map(|c| (c.name(), 0)).collect();
    let mut others = 0;
    for (name, count) in labels.names.iter().zip(&per_label).filter(|(_, count)| **count > 0) {
        match labels.taxonomy.parse_name(name) {
            Ok(Some(label)) => {
                *rooms.entry(label.room.to_string()).or_default() += count;
                *classes.entry(label.class.name()).or_default() += count;
            }
            _ => others += count,
        }
    }

    let is = |what: &str, manifest: u64, found: u64| {
        checks.check(manifest == found, || format!("{manifest} faces {what}, and semantic.obj has {found}"));
    };
    is("in all", votes.faces, voted.len() as u64);
    is("without votes", votes.faces_without_votes, others);
    is("with votes", votes.total.faces_voted, per_label.iter().sum::<u64>() - others);

    // A room of the same name in another area has no faces here.
    let mut manifest: BTreeMap<String, u64> = BTreeMap::new();
    votes
        .rooms
        .iter()
        .for_each(|r| *manifest.entry(r.name.clone()).or_default() += r.faces_voted);
    for room in rooms.keys().chain(manifest.keys()).collect::<BTreeSet<_>>() {
        let [told, found] = [&manifest, &rooms].map(|counts| counts.get(room).copied().unwrap_or(0));
        is(&format!("of {room}"), told, found);
    }

    for class in &votes.classes {
        let found = classes.get(&*class.name).copied().unwrap_or(0);
        is(&format!("of class {}", class.name), class.faces_voted, found);
    }
}
