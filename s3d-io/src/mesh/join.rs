//! Joins meshes of several files into one.

use crate::error::{Error, Result};
use crate::mesh::file::{MeshFile, MeshOptions, MeshSource, UpAxis};
use crate::mesh::labels::{LabelColumn, LabelElement, MeshLabels, NO_LABEL};
use crate::mesh::origin::MeshOrigin;
use crate::mesh::read::read_mesh_with;
use s3d_geom::glam::DAffine3;
use s3d_geom::{NO_INDEX, TriMesh};
use std::path::{Path, PathBuf};

/// Reads the meshes of `paths` and joins them in this order: vertices, faces, materials and textures of the
/// first file, then of the second, and so on. Every texture stays separate, even if two have the same name.
/// If there are several files, each warning names its file.
///
/// A column that only some files have is filled up as [`s3d_geom::MeshParts::append`] describes. Vertex
/// labels become face labels if another file labels faces. Faces and vertices of a file without labels have
/// [`NO_LABEL`]. All files share the origin that is found for the first one, and the unit that it names.
///
/// # Errors
/// Like [`read_mesh_with`] for each file; [`Error::Format`] if `paths` is empty or the meshes have too many
/// vertices together.
pub fn read_meshes(paths: &[PathBuf], up: UpAxis) -> Result<MeshFile> {
    read_meshes_with(paths, up, &MeshOptions::default())
}

/// Reads like [`read_meshes`], with other options than the default.
///
/// # Errors
/// Like [`read_meshes`].
pub fn read_meshes_with(paths: &[PathBuf], up: UpAxis, options: &MeshOptions) -> Result<MeshFile> {
    let Some((first, others)) = paths.split_first() else {
        return Err(Error::format(Path::new(""), "a scene needs at least one mesh"));
    };

    let mut joined = read_mesh_with(first, up, options)?;
    if others.is_empty() {
        return Ok(joined);
    }

    // The other files share the origin and the unit of the first.
    name_warnings(&mut joined.warnings, first);
    let options = MeshOptions {
        origin: MeshOrigin::behind(joined.offset_m),
        units: options.units.or(joined.unit_said),
        ..options.clone()
    };

    let others = others.iter().map(|path| {
        let mut next = read_mesh_with(path, up, &options)?;
        name_warnings(&mut next.warnings, path);
        Ok(next)
    });
    MeshFile::joined(joined, others).map(|(joined, _)| joined)
}

impl MeshFile {
    /// Joins meshes of one frame in this order, as [`read_meshes`] joins files. Returns also where each face
    /// of the joined mesh was among the faces of all meshes, ascending: a face that repeats an earlier one is
    /// left out.
    ///
    /// # Errors
    /// The first error among `others`; [`Error::Format`] if the meshes have too many vertices together.
    pub fn joined(self, others: impl IntoIterator<Item = Result<Self>>) -> Result<(Self, Vec<u32>)> {
        let mut joined = self;
        for next in others {
            joined = join(joined, next?)?;
        }

        let faces = joined.mesh.faces().len() as u32;
        joined.mesh = joined.mesh.with_face_tags((0..faces).collect());
        let (mut joined, kept) = joined.tidy();
        joined.renumber_faces(&kept);
        Ok((joined, kept))
    }

    /// Picks the sources of faces after only the faces `kept`, ascending, have stayed.
    fn renumber_faces(&mut self, kept: &[u32]) {
        let source_faces = kept.iter().filter_map(|&face| self.source_faces.get(face as usize));
        self.source_faces = source_faces.copied().collect();
        for source in &mut self.sources {
            source.first_face = kept.partition_point(|&face| face < source.first_face) as u32;
        }
    }

    /// Returns the mesh after a transform, without its labels. Returns also which faces have stayed,
    /// ascending: one that is too thin may lose its area.
    ///
    /// # Errors
    /// [`Error::Format`] if no face has stayed, or a vertex is infinitely far.
    pub fn transformed(mut self, by: &DAffine3) -> Result<(Self, Vec<u32>)> {
        self.labels = None;
        let mut faces: Vec<u32> = (0..self.mesh.faces().len() as u32).collect();
        if *by != DAffine3::IDENTITY {
            let path = self
                .sources
                .first()
                .map(|source| source.path.clone())
                .unwrap_or_default();
            let tagged = self.mesh.with_face_tags(faces);
            let mut mesh = tagged
                .transformed(by)
                .map_err(|e| Error::format(&path, e.to_string()))?;
            faces = mesh.take_face_tags();
            self.mesh = mesh;
        }
        self.renumber_faces(&faces);
        Ok((self, faces))
    }

    /// Returns the mesh of some of its faces, ascending, without its labels. If these are not all, vertices
    /// that none of them uses are left out.
    ///
    /// # Errors
    /// [`Error::Format`] if there is no face.
    pub fn with_faces(mut self, faces: &[u32]) -> Result<Self> {
        self.labels = None;
        if faces.len() < self.mesh.faces().len() {
            let path = self
                .sources
                .first()
                .map(|source| source.path.clone())
                .unwrap_or_default();
            self.mesh = self
                .mesh
                .with_faces(faces)
                .map_err(|e| Error::format(&path, e.to_string()))?;
            self.renumber_faces(faces);
        }
        Ok(self)
    }
}

/// Appends the mesh `next` to `joined`.
fn join(joined: MeshFile, next: MeshFile) -> Result<MeshFile> {
    let together = sizes(&joined.mesh)
        .into_iter()
        .zip(sizes(&next.mesh))
        .map(|(a, b)| a + b);
    if together.max() >= Some(NO_INDEX as usize) {
        let path = next.sources.first().map_or(Path::new(""), |s| &s.path);
        let message = "makes more vertices or faces than 32 bits count, with the meshes before it; cut the \
                       scene in parts";
        return Err(Error::format(path, message));
    }

    let first_face = joined.mesh.faces().len() as u32;
    let labels = match (joined.labels, next.labels) {
        (None, None) => None,
        (a, b) if has_objects(&a) || has_objects(&b) => {
            Some(joined_objects((a, &joined.mesh), (b, &next.mesh)))
        }
        (a, b) => Some(joined_labels((a, &joined.mesh), (b, &next.mesh))),
    };
    let mut sources = joined.sources;
    sources.extend(
        next.sources
            .into_iter()
            .map(|s| MeshSource { path: s.path, first_face: first_face + s.first_face }),
    );

    Ok(MeshFile {
        unit_said: joined.unit_said,
        mesh: joined.mesh.join(next.mesh),
        texture_files: [joined.texture_files, next.texture_files].concat(),
        warnings: [joined.warnings, next.warnings].concat(),
        labels,
        source_faces: [joined.source_faces, next.source_faces].concat(),
        sources,
        companions: [joined.companions, next.companions].concat(),
        offset_m: joined.offset_m,
        polygons_triangulated: joined.polygons_triangulated + next.polygons_triangulated,
        repeated_faces: joined.repeated_faces + next.repeated_faces,
    })
}

/// The numbers of vertices, texture coordinates, normals and faces.
fn sizes(mesh: &TriMesh) -> [usize; 4] {
    let parts = mesh.parts();
    [mesh.positions().len(), parts.uvs.len(), parts.normals.len(), mesh.faces().len()]
}

type Labelled<'a> = (Option<MeshLabels>, &'a TriMesh);

fn has_objects(labels: &Option<MeshLabels>) -> bool {
    matches!(labels, Some(MeshLabels::Objects { .. }))
}

/// Joins the labels of two meshes, of which one at least has objects. Numbers of the other become objects
/// whose classes are these numbers, as words.
fn joined_objects(a: Labelled<'_>, b: Labelled<'_>) -> MeshLabels {
    let mut objects = Vec::new();
    let mut faces = Vec::new();
    let are_names = [&a, &b]
        .into_iter()
        .all(|(labels, _)| labels.as_ref().is_none_or(|labels| !labels.are_certain()));
    for (labels, mesh) in [a, b] {
        let first = objects.len() as u32;
        let end = faces.len() + mesh.faces().len();
        if let Some((found, of_face)) = labels.map(|labels| labels.into_objects(mesh)) {
            objects.extend(found);
            faces.extend(of_face.into_iter().map(|o| if o == NO_INDEX { o } else { first + o }));
        }
        // A mesh without labels.
        faces.resize(end, NO_INDEX);
    }
    MeshLabels::Objects { objects, faces, are_names }
}

/// Joins the labels of two meshes. They stay vertex labels if neither mesh labels its faces. Files have
/// numbers, never names.
fn joined_labels(a: Labelled<'_>, b: Labelled<'_>) -> MeshLabels {
    let element = if labels_faces(&a.0) || labels_faces(&b.0) {
        LabelElement::Face
    } else {
        LabelElement::Vertex
    };
    let a = LabelColumns::new(a, element);
    let b = LabelColumns::new(b, element);
    MeshLabels::Numbers {
        element,
        class: joined_column((a.class, a.rows), (b.class, b.rows)),
        instance: joined_column((a.instance, a.rows), (b.instance, b.rows)),
    }
}

fn labels_faces(labels: &Option<MeshLabels>) -> bool {
    labels.as_ref().is_some_and(|l| l.element() == LabelElement::Face)
}

/// The label columns of a mesh.
struct LabelColumns {
    /// The number of faces or vertices.
    rows: usize,
    class: Option<LabelColumn>,
    instance: Option<LabelColumn>,
}

impl LabelColumns {
    /// Takes the labels of a mesh as labels of its faces or vertices.
    fn new((labels, mesh): Labelled<'_>, element: LabelElement) -> Self {
        let (rows, labels) = match element {
            LabelElement::Face => (mesh.faces().len(), labels.map(|l| l.into_faces(mesh))),
            LabelElement::Vertex => (mesh.positions().len(), labels),
        };
        match labels {
            Some(MeshLabels::Numbers { class, instance, .. }) => Self { rows, class, instance },
            _ => Self { rows, class: None, instance: None },
        }
    }
}

/// Appends a column to another; each comes with its number of rows. A missing column counts as [`NO_LABEL`].
fn joined_column(
    (a, rows_a): (Option<LabelColumn>, usize),
    (b, rows_b): (Option<LabelColumn>, usize),
) -> Option<LabelColumn> {
    let name = a.as_ref().or(b.as_ref())?.name.clone();
    let mut values = a.map_or_else(|| vec![NO_LABEL; rows_a], |c| c.values);
    values.extend(b.map_or_else(|| vec![NO_LABEL; rows_b], |c| c.values));
    Some(LabelColumn { name, values })
}

/// Puts the file's name in front of its warnings.
fn name_warnings(warnings: &mut [String], path: &Path) {
    let shown = path.display().to_string();
    for warning in warnings {
        // Warnings about a library name a file already.
        if !warning.starts_with(&shown) {
            *warning = format!("{shown}: {warning}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::texture::tests::two_pixels;
    use s3d_geom::FaceColor;
    use std::fs;

    const HEAD: &str =
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

    /// A square whose two faces have classes and objects.
    fn labelled_faces() -> String {
        format!(
            "{HEAD}element face 2\nproperty list uchar int vertex_indices\nproperty int category_id\n\
             property int object_id\nend_header\n{SQUARE}3 0 1 2 4 40\n3 0 2 3 5 50\n"
        )
    }

    /// A square, two metres higher, whose vertices have classes.
    fn labelled_vertices() -> String {
        let square = SQUARE.replace(" 0\n", " 2 7\n").replacen(" 7", " 6", 1);
        format!(
            "{HEAD}property uchar label\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
             {square}4 0 1 2 3\n"
        )
    }

    fn values(column: &Option<LabelColumn>) -> (&str, Vec<i64>) {
        column.as_ref().map(|c| (c.name.as_str(), c.values.clone())).unwrap()
    }

    #[test]
    fn files_are_joined_in_order_with_their_textures_and_warnings() {
        let dir = tempfile::tempdir().unwrap();
        let mut paths = Vec::new();
        for (folder, z, color) in [("a", 0, [9, 8, 7]), ("b", 1, [1, 2, 3])] {
            let folder = dir.path().join(folder);
            fs::create_dir(&folder).unwrap();
            fs::write(folder.join("wall.png"), two_pixels(color, color)).unwrap();
            fs::write(folder.join("wall.mtl"), "newmtl wall\nmap_Kd wall.png\n").unwrap();
            // The third face repeats the first. The only face of the last file repeats it too.
            let obj = format!(
                "mtllib wall.mtl\nv 0 0 {z}\nv 1 0 {z}\nv 0 1 {z}\nv 1 1 {z}\nvt 0 0\nusemtl wall\n\
                 f 1/1 2/1 3/1\nf 2/1 4/1 3/1\nf 3/1 2/1 1/1\n"
            );
            paths.push(folder.join("mesh.obj"));
            fs::write(&paths[paths.len() - 1], obj).unwrap();
        }
        paths.push(dir.path().join("c.obj"));
        fs::write(&paths[2], "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\nf 1 2 4\n").unwrap();

        let file = read_meshes(&paths, UpAxis::Z).unwrap();
        assert_eq!(file.mesh.faces(), [[0, 1, 2], [1, 3, 2], [4, 5, 6], [5, 7, 6], [8, 9, 11]]);
        for (face, pixel) in [(0, [9, 8, 7]), (1, [9, 8, 7]), (2, [1, 2, 3]), (3, [1, 2, 3])] {
            let FaceColor::Texture(_, texture, _) = file.mesh.color_of(face) else { panic!() };
            assert_eq!((texture.name.as_str(), texture.image.pixels()[0]), ("wall.png", pixel));
        }
        assert!(matches!(file.mesh.color_of(4), FaceColor::Flat(_)));

        assert_eq!(file.texture_files.iter().flatten().count(), 2);
        assert_eq!((0..3).map(|s| file.faces_of(s)).collect::<Vec<_>>(), [0..2, 2..4, 4..5]);
        assert_eq!(file.repeated_faces, 3);
        for (warning, path) in file.warnings.iter().zip(&paths) {
            let words = format!("{}: 1 face left out: earlier faces", path.display());
            assert!(warning.starts_with(&words) || path.ends_with("c.obj"), "{warning}");
        }
        assert_eq!(file.warnings.len(), 3);
    }

    #[test]
    fn labels_of_faces_and_vertices_are_joined() {
        let dir = tempfile::tempdir().unwrap();
        let paths: Vec<PathBuf> = [
            ("faces.ply", labelled_faces()),
            ("vertices.ply", labelled_vertices()),
            ("none.obj", "v 0 0 9\nv 1 0 9\nv 1 1 9\nf 1 2 3\n".into()),
        ]
        .map(|(name, text)| {
            fs::write(dir.path().join(name), text).unwrap();
            dir.path().join(name)
        })
        .to_vec();

        let file = read_meshes(&paths, UpAxis::Z).unwrap();
        let Some(MeshLabels::Numbers { element: LabelElement::Face, class, instance }) = &file.labels else {
            panic!()
        };
        assert_eq!(values(class), ("category_id", vec![4, 5, 7, 7, NO_LABEL]));
        assert_eq!(values(instance), ("object_id", vec![40, 50, NO_LABEL, NO_LABEL, NO_LABEL]));
        assert!(file.warnings.is_empty(), "{:?}", file.warnings);

        // When a file is read a second time, all its faces repeat earlier ones.
        let twice = [paths[1].clone(), paths[2].clone(), paths[1].clone()];
        let file = read_meshes(&twice, UpAxis::Z).unwrap();
        let Some(MeshLabels::Numbers { element: LabelElement::Vertex, class, instance: None }) = &file.labels
        else {
            panic!("{:?}", file.labels)
        };
        let none = NO_LABEL;
        assert_eq!(values(class).1, [6, 7, 7, 7, none, none, none, 6, 7, 7, 7]);
        assert_eq!((0..3).map(|s| file.faces_of(s)).collect::<Vec<_>>(), [0..2, 2..3, 3..3]);

        // A face that is left out takes its label along.
        let file = read_meshes(&[paths[0].clone(), paths[2].clone(), paths[0].clone()], UpAxis::Z).unwrap();
        let Some(MeshLabels::Numbers { class, .. }) = &file.labels else { panic!() };
        assert_eq!((values(class).1, file.mesh.faces().len()), (vec![4, 5, none], 3));
    }

    #[test]
    fn one_file_is_as_read_mesh_reads_it_and_none_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.ply");
        fs::write(&path, labelled_faces().replace("3 0 2 3 5 50", "3 2 1 0 5 50")).unwrap();
        let file = read_meshes(std::slice::from_ref(&path), UpAxis::Z).unwrap();
        assert_eq!(file.warnings, ["1 face left out: earlier faces have the same corners"]);
        assert!(
            read_meshes(&[], UpAxis::Z)
                .unwrap_err()
                .to_string()
                .contains("at least one mesh")
        );
        let gone = dir.path().join("gone.obj");
        assert!(
            read_meshes(&[path, gone], UpAxis::Z)
                .unwrap_err()
                .to_string()
                .contains("gone.obj")
        );
    }
}
