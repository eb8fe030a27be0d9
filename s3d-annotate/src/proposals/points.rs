//! Points with labels, and everything else that is read as annotations: they vote for faces.

use super::names::ClassNames;
use super::{Key, Target};
use s3d_dataset::error::InputError;
use s3d_dataset::{Context, Result};
use s3d_geom::glam::DVec3;
use s3d_geom::{NearestFaces, PointCloud, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::cloud::{AnnotatedInstance, AnnotatedMesh, AnnotationOptions, Annotations};
use s3d_io::mesh::{MeshFile, UpAxis};
use s3d_label::{LabelId, Labeler, MAX_LABELS, fill_labels};
use std::path::Path;

/// A point that is farther from every face than this does not vote, metres.
const NEAR_M: f32 = 0.1;

/// Faces without a point take the label of labelled surface nearer than this, metres: the points of a network
/// are often fewer than the faces.
const FILL_M: f64 = 0.05;

/// Returns what each face belongs to.
///
/// # Errors
/// The errors of the reader of its kind, and for points that are not finite.
pub(super) fn keys(
    path: &Path,
    target: &Target<'_>,
    names: &ClassNames<'_>,
    ctx: &Context,
) -> Result<Vec<Option<Key>>> {
    let mesh = target.mesh;
    // Points may have the coordinates of the scan, or those of a data set of it.
    let opened = open(path, mesh, names, target.offset_m);
    let annotations = match opened {
        Err(_) if target.offset_m != DVec3::ZERO => open(path, mesh, names, DVec3::ZERO).or(opened),
        opened => opened,
    }?;
    // Advice about columns in a scene's file is of no use here.
    let warnings = annotations
        .warnings
        .iter()
        .filter(|warning| !warning.contains("in [annotations]"));
    warnings.for_each(|warning| ctx.warn(warning));
    let instances: Vec<&AnnotatedInstance> =
        annotations.rooms.iter().flat_map(|room| &room.instances).collect();
    if instances.len() >= MAX_LABELS {
        let why = format!("has {} instances: {} is the most", instances.len(), MAX_LABELS - 1);
        return Err(InputError::Unfit { path: path.to_owned(), why }.into());
    }

    // Points without numbers are one instance a class and room.
    let are_numbered = annotations.rooms.iter().any(|room| {
        let pairs = room.instances.iter().zip(room.instances.iter().skip(1));
        pairs.clone().any(|(a, b)| a.class == b.class)
    });
    let nearest_faces = NearestFaces::new(mesh);
    let mut labeler = Labeler::new(&nearest_faces);
    labeler.watch_strays(NEAR_M, false);
    let mut keys: Vec<Option<Key>> = vec![None];
    let mut far = 0;
    let mut know_faces = true;
    for (number, instance) in (1..).zip(instances) {
        ctx.check()?;
        keys.push(Some((instance.class, are_numbered.then_some(i64::from(number)))));
        let voted = vote(&mut labeler, instance, LabelId(number))?;
        far += voted.far;
        know_faces &= voted.know_faces;
    }
    if far > 0 {
        let shown = path.display();
        ctx.warn(format_args!(
            "{shown}: {far} of its points are farther than {NEAR_M} m from the mesh and do not count"
        ));
    }
    let mut labels = labeler.finish().into_label_of_face();
    if !know_faces {
        fill_labels(mesh, &mut labels, FILL_M);
    }
    let key = |label: &LabelId| keys.get(label.0 as usize).copied().flatten();
    Ok(labels.iter().map(key).collect())
}

/// Opens the annotations.
fn open(path: &Path, mesh: &TriMesh, names: &ClassNames<'_>, offset_m: DVec3) -> Result<Annotations> {
    // Points whose file names no room are in any one. The folders of a tree name theirs.
    let room = names.taxonomy.room_types().first().map(|kind| format!("{kind}_1"));
    let room = room
        .and_then(|room| names.taxonomy.room(&room).ok())
        .filter(|_| !is_tree(path));
    let options = AnnotationOptions {
        taxonomy: names.taxonomy.clone(),
        classes: names.classes.clone(),
        room,
        offset_m,
        mesh_bounds: Some(mesh.aabb()),
        ..AnnotationOptions::default()
    };
    let file = MeshFile::in_memory("the mesh", mesh.clone());
    let annotated = AnnotatedMesh { file: &file, up: UpAxis::Z, units: None, outside_files: false };
    let opened = Annotations::open_for(&annotated, &[path.to_owned()], &options);
    Ok(opened.map_err(|e| match e {
        // The reader speaks of a scene's file, which there is not.
        FileError::Format { path, message, .. } if message.contains("[annotations.classes]") => {
            let (what, _) = message.split_once(". Say what").unwrap_or((&message, ""));
            FileError::format(&path, format!("{what}: {}", names.advice()))
        }
        e => e,
    })?)
}

/// Whether a folder is a tree of S3DIS.
fn is_tree(path: &Path) -> bool {
    let rooms = std::fs::read_dir(path).into_iter().flatten().flatten();
    rooms.into_iter().any(|room| room.path().join("Annotations").is_dir())
}

/// What became of the points of an instance.
struct Voted {
    /// The number of points that are too far from the mesh.
    far: usize,
    /// Whether the points belong to faces or vertices of the mesh.
    know_faces: bool,
}

/// Lets the points of an instance vote.
fn vote(labeler: &mut Labeler<'_>, instance: &AnnotatedInstance, label: LabelId) -> Result<Voted> {
    let mut points = PointCloud::default();
    instance.read(&mut points)?;
    let has_faces = points.faces.len() == points.len();
    let voted = if instance.are_vertices() {
        labeler.add_vertices(&points.positions, label)
    } else if has_faces {
        labeler.add_points_on_faces(&points.faces, label)
    } else {
        labeler.add_points(&points.positions, label)
    };
    voted.map_err(|e| FileError::format(instance.path(), e.to_string()))?;
    Ok(Voted { far: labeler.take_strays().len(), know_faces: has_faces || instance.are_vertices() })
}
