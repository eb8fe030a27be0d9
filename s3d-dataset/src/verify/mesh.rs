//! Checks the exported meshes against each other and against the votes: one mesh has colours, the other
//! labels.

use super::labels::Labels;
use super::report::{Report, Topic};
use crate::record::manifest::{Manifest, XyzLoss};
use crate::summary::Surface;
use s3d_geom::TriMesh;
use s3d_io::dataset::{Layout, read_face_votes};
use s3d_io::fs::read_json;
use s3d_io::mesh::{MeshFile, UpAxis, read_mesh};
use s3d_label::{LabelId, fill_labels};
use serde::Deserialize;
use std::collections::BTreeMap;
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
    let read = |path: &Path| {
        // The mesh names these files, and they are read with it.
        let with_it = path.with_extension("mtl");
        let textures = layout.mesh_dir(area).join("rgb_textures");
        let file = report.read(Topic::Mesh, path, |path| {
            report.check_sizes(|other| *other == *with_it || other.starts_with(&textures))?;
            read_mesh(path, UpAxis::Y)
        })?;
        for warning in &file.warnings {
            report.fault(Topic::Mesh, "what is wrong in a mesh", path, warning);
        }
        Some(file)
    };

    let semantic_file = if manifest.is_labelled() { read(&semantic) } else { None };
    let names = semantic_file.map(|file| (label_names(&file.mesh, labels, &semantic, report), file.mesh));

    let file = read(&colored)?;
    let faces = file.mesh.faces().len();
    let kind = manifest.conventions().xyz;

    if let Some(manifest) = manifest.area(area) {
        report.check(faces == manifest.faces, MESH, &colored, || {
            format!("{faces} faces, and the manifest tells of {}", manifest.faces)
        });
        let loss = XyzLoss::of(file.mesh.aabb(), kind);
        report.check(
            manifest.xyz == loss,
            (Topic::Manifest, "loss of coordinates"),
            &layout.manifest(),
            || {
                format!(
                    "area {area}: the loss of coordinates is {:?}, and that of its mesh {loss:?}",
                    manifest.xyz
                )
            },
        );
    }

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

    // The manifest's surface without votes and without a label.
    if let Some(told) = manifest.area(area).and_then(|entry| entry.unlabelled) {
        let LabelledMesh { file, label_of_face, is_voted, .. } = &labelled;
        let surface = |is_without: &dyn Fn(usize) -> bool| {
            let faces = (0..label_of_face.len()).filter(|face| is_without(*face));
            faces.fold((0, 0.0), |(n, m2), face| (n + 1, m2 + file.mesh.area(face as u32)))
        };
        for (what, told, (faces, m2)) in [
            ("votes", told.without_votes, surface(&|face| !is_voted[face])),
            ("a label", told.without_label, surface(&|face| label_of_face[face] == 0)),
        ] {
            let same = told.faces == faces && (told.m2 - m2).abs() <= 1e-6 * m2;
            report.check(same, MESH, &layout.manifest(), || {
                let Surface { faces: n, m2: area, .. } = told;
                format!("{n} faces of {area} m² without {what}, and the mesh has {faces} of {m2} m²")
            });
        }
    }

    Some(labelled)
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

/// Checks the labels of `semantic.obj` against the votes, and against the report on them: faces in all, by
/// room and by class. Labels of faces without votes must be those that filling gives. Returns whether each
/// face has votes.
fn check_votes(
    layout: &Layout,
    area: u32,
    mesh: &LabelledMesh,
    (labels, fill_m): (&Labels, Option<f64>),
    report: &Report,
) -> Vec<bool> {
    let LabelledMesh { file, label_of_face, .. } = mesh;
    let path = layout.votes_npz(area);
    // Labels by votes alone, 0 without votes.
    let mut voted = label_of_face.clone();

    // Data sets of earlier versions have no votes. A file that is listed but missing is reported with the
    // list of files.
    if path.exists()
        && let Some(votes) = report.read(Topic::Mesh, &path, read_face_votes)
    {
        let won = votes.label == *label_of_face;
        report.check(won, VOTES, &path, || "other labels won than semantic.obj has".to_owned());
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
        report.check(!won || odd == 0, VOTES, &path, || {
            format!("{odd} faces have other labels than votes and filling give them")
        });

        let sums = votes.votes.iter().zip(&votes.runner_up_votes).zip(&votes.total);
        let odd = sums.filter(|((first, second), total)| {
            first < second || u64::from(**first) + u64::from(**second) > u64::from(**total)
        });
        let odd = odd.count();
        report.check(odd == 0, VOTES, &path, || format!("{odd} faces have votes that do not add up"));
    }

    let is_voted = voted.iter().map(|label| *label != 0).collect();
    let path = layout.votes_json(area);
    let Some(votes) = report.read(Topic::Mesh, &path, read_json::<VotesRecord>) else { return is_voted };

    let mut per_label = vec![0u64; labels.len()];
    for label in voted {
        if let Some(count) = per_label.get_mut(label as usize) {
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

    let checks = report.of(VOTES, &path);
    let is = |what: &str, manifest: u64, found: u64| {
        checks.check(manifest == found, || format!("{manifest} faces {what}, and semantic.obj has {found}"));
    };
    is("in all", votes.faces, label_of_face.len() as u64);
    is("without votes", votes.faces_without_votes, others);
    is("with votes", votes.total.faces_voted, per_label.iter().sum::<u64>() - others);
    // A room of the same name in another area has no faces here.
    let mut manifest: BTreeMap<String, u64> = BTreeMap::new();
    votes
        .rooms
        .iter()
        .for_each(|r| *manifest.entry(r.name.clone()).or_default() += r.faces_voted);
    for room in rooms
        .keys()
        .chain(manifest.keys())
        .collect::<std::collections::BTreeSet<_>>()
    {
        let [told, found] = [&manifest, &rooms].map(|counts| counts.get(room).copied().unwrap_or(0));
        is(&format!("of {room}"), told, found);
    }

    for class in &votes.classes {
        is(
            &format!("of class {}", class.name),
            class.faces_voted,
            classes.get(&*class.name).copied().unwrap_or(0),
        );
    }

    is_voted
}
