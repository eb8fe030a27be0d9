//! Checks the exported meshes against each other: one has colours, the other labels.

use super::labels::Labels;
use super::report::{Report, Topic};
use super::votes;
use crate::record::manifest::{Manifest, XyzLoss};
use crate::summary::Surface;
use s3d_geom::TriMesh;
use s3d_io::dataset::{InstanceEntry, Layout, read_source_faces};
use s3d_io::fs::read_file;
use s3d_io::mesh::{MeshFile, MeshLabels, SemanticObj, UpAxis, read_mesh};
use std::path::Path;

const MESH: (Topic, &str) = (Topic::Mesh, "meshes that differ");

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

/// Reads and checks both meshes of an area, and the votes for their labels, by `instances` if they can be
/// read.
pub(crate) fn read_and_check(
    layout: &Layout,
    area: u32,
    manifest: &Manifest,
    (labels, instances): (&Labels, Option<&[InstanceEntry]>),
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
    check_materials(&semantic.with_extension("mtl"), &labelled, labels, report);
    labelled.is_voted = votes::check(layout, area, manifest, &labelled, (labels, instances), report);

    check_unlabelled(layout, area, manifest, &labelled, report);
    check_glb(&layout.semantic_glb(area), manifest, &labelled, report);
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

/// Checks that `semantic.mtl` has the material of each label that faces have, in its colour.
fn check_materials(path: &Path, mesh: &LabelledMesh, labels: &Labels, report: &Report) {
    if !mesh.all_in_table {
        return;
    }
    let mut expected = Vec::new();
    let materials = SemanticObj::new(&mesh.file.mesh, &mesh.label_of_face, &labels.names);
    let written = materials.write_mtl(&mut expected);
    let Some(found) = report.read(Topic::Mesh, path, read_file) else { return };
    report.check(written.is_ok() && found == expected, MESH, path, || {
        "its materials are not the labels of semantic.obj in their colours".to_owned()
    });
}

/// Checks that `semantic.glb` has the faces of `rgb.obj` with their labels, in whatever order.
fn check_glb(path: &Path, manifest: &Manifest, mesh: &LabelledMesh, report: &Report) {
    if !manifest.options.semantic_glb || !mesh.all_in_table {
        return;
    }
    let Some(file) = report.read(Topic::Mesh, path, |path| read_mesh(path, UpAxis::Y)) else { return };
    let label = |face: usize| match &file.labels {
        Some(MeshLabels::Objects { objects, faces, .. }) => {
            objects.get(faces[face] as usize).map_or(0, |object| object.instance)
        }
        _ => 0,
    };
    let found = faces_with_labels(&file.mesh, label);
    let expected = faces_with_labels(&mesh.file.mesh, |face| mesh.label_of_face[face].into());
    report
        .check(found == expected, MESH, path, || "its faces or labels are not those of semantic.obj".into());
}

/// Returns the corners of each face as bits, with its label, in order.
fn faces_with_labels(mesh: &TriMesh, label: impl Fn(usize) -> i64) -> Vec<([[u32; 3]; 3], i64)> {
    let corners = |face: usize| {
        mesh.triangle(face as u32)
            .map(|p| (p + 0.0).to_array().map(f32::to_bits))
    };
    let mut faces: Vec<_> = (0..mesh.faces().len())
        .map(|face| (corners(face), label(face)))
        .collect();
    faces.sort_unstable();
    faces
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
