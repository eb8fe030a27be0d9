//! Compares the labels of faces: of the same faces, or, if the meshes differ, of surfaces at the same place.

use super::comparison::{AreaChanges, ChangedPatch, FaceChange, Geometry, LabelCounts, LabelPairs, Side};
use super::matching::SharedSurface;
use super::names::{Change, MISSING, NULL, Names};
use super::sides::Sides;
use crate::context::Context;
use crate::error::Result;
use s3d_geom::glam::DVec3;
use s3d_geom::{TriMesh, face_patches};
use s3d_io::Error as FileError;
use s3d_io::cloud::labels_by_place;
use s3d_io::mesh::{UpAxis, read_mesh};
use std::collections::HashMap;

/// The most patches that are reported for an area.
const MAX_PATCHES: usize = 300;

/// A mesh with the number of each face's label, as in [`Names`].
struct Labelled {
    mesh: TriMesh,
    label_of_face: Vec<u32>,
}

/// Compares the meshes of all areas, matches their instances, and adds the faces with other labels to
/// `pairs`.
pub(crate) fn compare(
    sides: &Sides,
    mut names: Option<&mut Names>,
    pairs: &mut LabelPairs,
    ctx: &Context,
) -> Result<Vec<AreaChanges>> {
    let areas = sides.areas();
    let progress = ctx.progress("comparing", "meshes", areas.len() as u64);
    let mut all = Vec::new();

    for area in areas {
        ctx.check()?;
        let [faces_a, faces_b] =
            [Side::A, Side::B].map(|side| sides.of(side).manifest.area(area).map(|entry| entry.faces as u64));
        let mut changes = AreaChanges {
            area,
            faces_a,
            faces_b,
            geometry: Geometry::OneSided,
            faces_changed: 0,
            m2_changed: 0.0,
            m2_only_a: 0.0,
            m2_only_b: 0.0,
            faces: Vec::new(),
            patches: Vec::new(),
        };

        if changes.faces_a.is_some() && changes.faces_b.is_some() {
            changes.geometry = of_area(sides, names.as_deref_mut(), area, &mut changes, pairs)?;
        }
        all.push(changes);
        progress.add(1);
    }

    Ok(all)
}

/// Compares the meshes of one area.
fn of_area(
    sides: &Sides,
    names: Option<&mut Names>,
    area: u32,
    changes: &mut AreaChanges,
    pairs: &mut LabelPairs,
) -> Result<Geometry> {
    let [a, b] = [Side::A, Side::B].map(|side| sides.of(side).layout().semantic_obj(area));
    let is_labelled = sides.both().iter().all(|(_, data)| data.taxonomy().is_some());
    if !is_labelled {
        let [a, b] = [Side::A, Side::B].map(|side| sides.of(side).layout().rgb_obj(area));
        return Ok(if sides.are_same(&a, &b) {
            Geometry::Same
        } else {
            Geometry::Unlabelled
        });
    }

    // The mesh names its materials, which are the labels. So equal files have equal labels.
    if sides.are_same(&a, &b) {
        return Ok(Geometry::Same);
    }

    let Some(names) = names else { return Ok(Geometry::Unread) };
    let read = |side| sides.keep(side, labelled_mesh(sides, side, names, area));
    let (a, b) = rayon::join(|| read(Side::A), || read(Side::B));
    let (Some(a), Some(b)) = (a?, b?) else { return Ok(Geometry::Unread) };

    let faces = a.mesh.faces().len();
    let is_same = faces == b.mesh.faces().len()
        && (0..faces as u32).all(|face| a.mesh.triangle(face) == b.mesh.triangle(face));
    let (geometry, labels_in_b) = if is_same {
        let shared = a.shared_surface(&b.label_of_face, Side::A);
        names.match_area(&shared, &shared);
        (Geometry::Same, b.label_of_face)
    } else {
        let (labels_in_b, labels_in_a) = rayon::join(|| b.labels_at(&a.mesh), || a.labels_at(&b.mesh));
        let on_a = a.shared_surface(&labels_in_b, Side::A);
        let on_b = b.shared_surface(&labels_in_a, Side::B);
        names.match_area(&on_a, &on_b);

        let alone = |of: &SharedSurface| -> f64 {
            let alone = of.iter().filter(|((a, b), _)| *a == MISSING || *b == MISSING);
            // A sum of nothing would be −0.
            0.0 + alone.map(|(_, m2)| m2).sum::<f64>()
        };
        changes.m2_only_a = alone(&on_a);
        changes.m2_only_b = alone(&on_b);
        (Geometry::Other, labels_in_b)
    };

    for (face, labels) in (0..).zip(a.label_of_face.iter().copied().zip(labels_in_b)) {
        let change = names.change(labels.0, labels.1);
        if change == Change::None || labels.1 == MISSING {
            continue;
        }
        let m2 = a.mesh.area(face);
        *pairs.entry(labels).or_default() += LabelCounts { faces: 1, m2, pixels: 0 };
        if change.is_true() {
            changes.faces_changed += 1;
            changes.m2_changed += m2;
            let a = names.index(Side::A, labels.0);
            let b = names.index(Side::B, labels.1);
            changes.faces.push(FaceChange { face, a, b });
        }
    }

    changes.patches = patches(&a.mesh, names, &changes.faces);
    Ok(geometry)
}

impl Labelled {
    /// The surface by label in A and in B. `others` are the labels of the other side at the faces.
    fn shared_surface(&self, others: &[u32], side: Side) -> SharedSurface {
        let mut shared = SharedSurface::new();
        let mut add = |labels: (u32, u32), m2: f64| *shared.entry(labels).or_default() += m2;
        let mut run = ((NULL, NULL), 0.0);
        for (face, (&own, &other)) in (0..).zip(self.label_of_face.iter().zip(others)) {
            let labels = if side == Side::A { (own, other) } else { (other, own) };
            if labels != run.0 {
                add(run.0, run.1);
                run = (labels, 0.0);
            }
            run.1 += self.mesh.area(face);
        }
        add(run.0, run.1);
        shared
    }

    /// The labels at the faces of another mesh: of the same face, in whatever order faces are, or else of
    /// the surface at its place. [`MISSING`] where there is none.
    fn labels_at(&self, mesh: &TriMesh) -> Vec<u32> {
        let mut of_corners: HashMap<[[u32; 3]; 3], u32> = HashMap::new();
        for (face, label) in (0..).zip(&self.label_of_face) {
            of_corners.entry(corners(&self.mesh, face)).or_insert(*label);
        }

        let faces = 0..mesh.faces().len() as u32;
        let mut labels: Vec<u32> = faces
            .map(|face| of_corners.get(&corners(mesh, face)).copied().unwrap_or(MISSING))
            .collect();
        if labels.contains(&MISSING) {
            let by_place = labels_by_place(&self.mesh, &self.label_of_face, mesh);
            for (label, at_place) in labels.iter_mut().zip(by_place).filter(|(label, _)| **label == MISSING) {
                *label = at_place;
            }
        }
        labels
    }
}

/// The corners of a face as bits. The smallest comes first, and their direction around the face stays.
fn corners(mesh: &TriMesh, face: u32) -> [[u32; 3]; 3] {
    // Adding 0 turns −0 into 0.
    let mut corners = mesh
        .triangle(face)
        .map(|corner| (corner + 0.0).to_array().map(f32::to_bits));
    let smallest = (0..3).min_by_key(|place| corners[*place]).unwrap_or(0);
    corners.rotate_left(smallest);
    corners
}

/// The largest patches of changed faces; patches with another class come first.
fn patches(mesh: &TriMesh, names: &Names, changes: &[FaceChange]) -> Vec<ChangedPatch> {
    let faces: Vec<(u32, (u32, u32))> = changes.iter().map(|of| (of.face, (of.a, of.b))).collect();

    let mut patches: Vec<ChangedPatch> = face_patches(mesh, &faces)
        .into_iter()
        .filter_map(|places| patch(mesh, changes, &places))
        .collect();
    patches.sort_by(|x, y| {
        let [x_same, y_same] = [x, y].map(|of| names.have_same_class(of.a, of.b));
        x_same.cmp(&y_same).then(y.m2.total_cmp(&x.m2))
    });

    patches.truncate(MAX_PATCHES);
    patches
}

/// Joins the changes at some places of the list to a patch. The label of the face nearest to the middle of
/// the area speaks for all of it.
fn patch(mesh: &TriMesh, changes: &[FaceChange], places: &[usize]) -> Option<ChangedPatch> {
    let of_patch: Vec<FaceChange> = places.iter().filter_map(|place| changes.get(*place)).copied().collect();
    let m2: f64 = of_patch.iter().map(|of| mesh.area(of.face)).sum();
    let middle = of_patch
        .iter()
        .map(|of| mesh.area(of.face) * center(mesh, of.face))
        .sum::<DVec3>()
        / m2;

    let nearest = of_patch.iter().min_by(|x, y| {
        let [x, y] = [x, y].map(|of| center(mesh, of.face).distance_squared(middle));
        x.total_cmp(&y)
    });
    let FaceChange { face, a, b } = *nearest?;
    let faces = of_patch.len() as u64;
    Some(ChangedPatch { a, b, faces, m2, center: center(mesh, face).to_array() })
}

/// The centre of a face's corners.
fn center(mesh: &TriMesh, face: u32) -> DVec3 {
    let corners = mesh.triangle(face).map(|corner| corner.as_dvec3());
    corners.iter().sum::<DVec3>() / 3.0
}

/// Reads `semantic.obj`, and numbers the labels of its faces.
fn labelled_mesh(sides: &Sides, side: Side, names: &Names, area: u32) -> Result<Labelled> {
    let data = sides.of(side);
    let path = data.layout.semantic_obj(area);
    data.files.checked(&path.with_extension("mtl"))?;
    let mesh = read_mesh(data.files.checked(&path)?, UpAxis::Y)?.mesh;
    let mut numbers = Vec::new();
    for material in mesh.materials() {
        let Some(number) = names.number(side, &material.name) else {
            let message = format!("the material {:?} is no label of semantic_labels.json", material.name);
            return Err(FileError::format(&path, message).into());
        };
        numbers.push(number);
    }

    let label_of_face = (0..mesh.faces().len() as u32)
        .map(|face| {
            mesh.material_of(face)
                .map_or(NULL, |material| numbers[material as usize])
        })
        .collect();
    Ok(Labelled { mesh, label_of_face })
}
