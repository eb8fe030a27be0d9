//! Annotations from a file of labels, for the faces of a scene's mesh.

use crate::cloud::annotations::{AnnotationOptions, Annotations};
use crate::cloud::frame_gap::{FrameGap, refusal};
use crate::cloud::label_files::transfer::{are_same_faces, labels_by_place, overlap};
use crate::cloud::label_files::{LabelFile, numbers, saved};
use crate::cloud::of_mesh::FaceLabels;
use crate::error::{Error, Result};
use crate::mesh::file::{LengthUnit, MeshFile, MeshOptions, UpAxis};
use crate::mesh::origin::MeshOrigin;

/// The mesh that annotations label, and how its file was read.
#[derive(Clone, Copy, Debug)]
pub struct AnnotatedMesh<'a> {
    /// The mesh.
    pub file: &'a MeshFile,
    /// The axis of its file that points up.
    pub up: UpAxis,
    /// The unit of its file. `None`: the unit that the file says, or metres.
    pub units: Option<LengthUnit>,
    /// Whether glTF files may name files outside their folder.
    pub outside_files: bool,
}

impl Annotations {
    /// Takes the labels of a file of labels for a scene's mesh. Without a mesh, the annotated points lie on
    /// the faces of the file's own mesh, Z-up, and know no face.
    ///
    /// # Errors
    /// The errors of the reader of its kind and [`Annotations::of_mesh`]; [`Error::Format`] if the two meshes
    /// lie far apart.
    pub(crate) fn of_label_file(
        file: &LabelFile,
        options: &AnnotationOptions,
        scene: Option<&AnnotatedMesh<'_>>,
    ) -> Result<Self> {
        let mut mesh_options = MeshOptions {
            class_column: options.class_column.clone(),
            instance_column: options.instance_column.clone(),
            origin: MeshOrigin::behind(options.offset_m),
            units: None,
            outside_files: scene.is_some_and(|scene| scene.outside_files),
        };
        let Some(scene) = scene else {
            let labelled = file.read(UpAxis::Z, &mesh_options)?;
            let labels = FaceLabels::of_mesh(&labelled, options)?;
            let mut found = labels.annotate(file.path(), &labelled.mesh, options, false)?;
            found.add_companions(&labelled, file);
            return Ok(found);
        };

        if let LabelFile::Numbers(list) = file {
            let labels = numbers::read(list, scene.file)?;
            let labels = FaceLabels::of_labels(scene.file, labels, options)?;
            return labels.annotate(list, &scene.file.mesh, options, true);
        }

        if let LabelFile::Saved(archive) = file {
            let (labels, warnings) = saved::read_for(archive, scene.file, options.room.is_none())?;
            let labels = FaceLabels::of_labels(scene.file, labels, options)?;
            let mut found = labels.annotate(archive, &scene.file.mesh, options, true)?;
            found.warnings.extend(warnings);
            return Ok(found);
        }

        mesh_options.units = scene.units.or(scene.file.unit_said);
        let labelled = in_frame_of(file, scene, &mesh_options)?;
        let bounds = labelled.mesh.aabb();
        let corners = [bounds.min, bounds.max].map(|p| p.as_dvec3() + options.offset_m);
        if let Some(gap) = FrameGap::between(corners, options.offset_m, scene.file.mesh.aabb()) {
            return Err(refusal(file.path(), &gap));
        }

        let mut found = if are_same_faces(&labelled.mesh, &scene.file.mesh) {
            Self::of_mesh(&labelled, options)?
        } else {
            let mut labels = FaceLabels::of_mesh(&labelled, options)?;
            labels.faces = labels_by_place(&labelled.mesh, &labels.faces, &scene.file.mesh);
            labels
                .annotate(file.path(), &scene.file.mesh, options, true)
                .map_err(|_| Error::format(file.path(), "labels no surface within 10 cm of the mesh"))?
        };
        found.add_companions(&labelled, file);
        // What is odd in the mesh of labels is told once, also if it is the scene's own.
        let told = labelled
            .warnings
            .iter()
            .filter(|warning| !scene.file.warnings.contains(warning));
        found.warnings.extend(told.cloned());
        Ok(found)
    }

    /// Adds the files that were read beside the file of labels.
    fn add_companions(&mut self, labelled: &MeshFile, file: &LabelFile) {
        let sources = labelled.sources.iter().map(|source| &source.path);
        self.companions.extend(sources.chain(&labelled.companions).cloned());
        self.companions.retain(|path| path != file.path());
    }
}

/// Reads the mesh of a file of labels in the frame of the scene's mesh. Its up axis is the one of the scene's
/// mesh file. If the boxes of the two have less than half in common, the other axis is tried: programs that
/// label a mesh may turn it.
fn in_frame_of(file: &LabelFile, scene: &AnnotatedMesh<'_>, options: &MeshOptions) -> Result<MeshFile> {
    let first = file.read(scene.up, options)?;
    let bounds = scene.file.mesh.aabb();
    let fit = overlap(first.mesh.aabb(), bounds);
    if fit > 0.5 {
        return Ok(first);
    }

    let other = match scene.up {
        UpAxis::Y => UpAxis::Z,
        UpAxis::Z => UpAxis::Y,
    };
    let turned = file.read(other, options)?;
    let fits_better = overlap(turned.mesh.aabb(), bounds) > fit + 0.1;
    Ok(if fits_better { turned } else { first })
}
