//! Reads meshes in PLY files.
//!
//! [`PlyReader`] reads the numbers, [`PlyVertices`] and [`PlyFaces`] know their names, [`PlyLooks`] reads the
//! textures, and this module makes a mesh of them.

use crate::error::{Error, Result};
use crate::fs::quote::count;
use crate::mesh::file::{MeshFile, MeshOptions, UpAxis, checked_mesh};
use crate::mesh::labels::LabelElement;
use crate::mesh::origin::FileFrame;
use crate::mesh::ply::elements::PlyReader;
use crate::mesh::ply::faces::{PlyFaces, PlyTriangles};
use crate::mesh::ply::header::PlyHeader;
use crate::mesh::ply::labels::PlyLabels;
use crate::mesh::ply::looks::{PlyLooks, lay_textures, paint_faces};
use crate::mesh::ply::vertices::PlyVertices;
use s3d_geom::{MeshParts, NO_INDEX};
use std::io::Read;
use std::path::Path;

/// Reads a PLY file of `bytes` bytes (0: not known). Errors name the file by `path`. Vertices and faces keep
/// the file's order, and vertices their number.
///
/// # Errors
/// Like [`crate::mesh::read_mesh_with`].
pub(crate) fn read(
    file: impl Read,
    bytes: u64,
    path: &Path,
    up: UpAxis,
    options: &MeshOptions,
) -> Result<MeshFile> {
    let mut reader = PlyReader::new(file, bytes, path)?;
    let header = reader.header().clone();
    let vertex_count = rows_of(&header, "vertex");
    if rows_of(&header, "face") == 0 && rows_of(&header, "tristrips") == 0 {
        return Err(Error::format(path, no_faces(&header, vertex_count)));
    }
    if vertex_count >= u64::from(NO_INDEX) {
        return Err(Error::format(path, "has more vertices than 32 bits count; cut the scan into parts"));
    }

    let frame = FileFrame::new(options.origin, options.units.unwrap_or_default());
    let mut labels = PlyLabels::find(path, &header, options)?;
    let mut vertices = PlyVertices::default();
    let mut faces = PlyFaces::default();

    // The first of two elements with one name counts, as it does for the header.
    let mut done = [false; 3];
    while let Some(element) = reader.next_element()? {
        let known = ["vertex", "face", "tristrips"]
            .iter()
            .position(|name| element.name.eq_ignore_ascii_case(name));
        match known.filter(|k| done.get_mut(*k).is_some_and(|done| !std::mem::replace(done, true))) {
            Some(0) => {
                let labels = labels.as_mut().filter(|l| l.element == LabelElement::Vertex);
                vertices = PlyVertices::read(path, &mut reader, &element, (up, frame), labels)?;
            }
            Some(1) => {
                let labels = labels.as_mut().filter(|l| l.element == LabelElement::Face);
                // Strips are polygons without labels. They follow the faces, even if the file has them first.
                let strips = std::mem::take(&mut faces);
                faces = PlyFaces::read(path, &mut reader, &element, vertex_count, labels)?;
                faces.append_strips(strips);
            }
            Some(_) => faces.read_strips(path, &mut reader, &element, vertex_count)?,
            None => {}
        }
    }

    let mut warnings = Vec::new();
    if reader.has_more()? {
        warnings.push("the file goes on after its last element; the rest is not read".into());
    }

    let offset_m = vertices.bring_near(frame, faces.corners());
    let triangles = faces.triangles(&vertices.positions);
    tell_triangles(path, &triangles, &mut warnings)?;

    if faces.odd_uvs > 0 {
        let n = count(faces.odd_uvs, "face");
        warnings.push(format!("texture coordinates of {n} left out: not two numbers a corner"));
    }
    let looks = PlyLooks::load(path, &header, &mut warnings)?;
    let mut parts = MeshParts::default();
    lay_textures(&mut parts, &mut vertices, &mut faces, &triangles, &looks, &mut warnings);
    if parts.materials.is_empty() && vertices.colors.is_empty() {
        paint_faces(&mut parts, &faces.colors, &triangles, &mut warnings);
    }
    let PlyTriangles { faces: triangles, polygons, cut, .. } = triangles;
    if !vertices.normals.is_empty() {
        parts.face_normals = triangles.clone();
    }

    // Face labels belong to polygons until all checks are done.
    let labels = labels.and_then(|l| l.finish(&mut warnings));
    let parts = MeshParts {
        face_tags: polygons,
        positions: vertices.positions,
        faces: triangles,
        colors: vertices.colors,
        normals: vertices.normals,
        textures: looks.textures,
        ..parts
    };
    let mesh = checked_mesh(parts, frame, &mut warnings)
        .map_err(|source| Error::Mesh { path: path.to_owned(), source })?;

    Ok(MeshFile {
        polygons_triangulated: cut,
        offset_m,
        texture_files: looks.files,
        companions: looks.companions,
        warnings,
        labels,
        ..MeshFile::new(path, mesh)
    })
}

fn rows_of(header: &PlyHeader, element: &str) -> u64 {
    header.element(element).map_or(0, |(_, e)| e.count)
}

fn no_faces(header: &PlyHeader, vertices: u64) -> String {
    let others: Vec<&str> = header
        .elements
        .iter()
        .map(|e| e.name.as_str())
        .filter(|n| *n != "vertex")
        .collect();
    let others = if others.is_empty() {
        String::new()
    } else {
        format!(" and the elements {}", others.join(", "))
    };
    let n = count(vertices as usize, "vertex");
    format!(
        "has no face, only {n}{others}; a mesh is needed: mesh the points first, or give the file as \
         annotations"
    )
}

/// Warns of polygons that are left out.
///
/// # Errors
/// [`Error::Format`] if no triangle is left.
fn tell_triangles(path: &Path, triangles: &PlyTriangles, warnings: &mut Vec<String>) -> Result<()> {
    if triangles.faces.is_empty() {
        let reason = match &triangles.refused {
            Some((face, why, _)) => format!(", as face {face} (counted from 0): {why}"),
            None => String::new(),
        };
        return Err(Error::format(path, format!("has no face that can be used{reason}")));
    }
    if let Some((face, why, n)) = &triangles.refused {
        let n = count(*n, "polygon");
        warnings.push(format!("{n} left out: the first, face {face} counted from 0, {why}"));
    }
    if let Some(first) = triangles.short_first {
        let n = count(triangles.short, "face");
        warnings.push(format!("{n} with fewer than three corners left out, the first is face {first}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::texture::tests::two_pixels;
    use crate::mesh::labels::{LabelColumn, MeshLabels, NO_LABEL};
    use crate::mesh::read::read_mesh_with;
    use s3d_geom::FaceColor;
    use s3d_geom::glam::{Vec3, vec2, vec3};

    /// Reads a file of these elements and rows, Z-up, with images beside it.
    fn read_with(elements: &str, rows: &str, options: &MeshOptions) -> Result<MeshFile> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("two words.png"), two_pixels([1, 2, 3], [4, 5, 6])).unwrap();
        std::fs::write(dir.path().join("b.png"), two_pixels([7, 8, 9], [7, 8, 9])).unwrap();
        std::fs::write(dir.path().join("broken.png"), b"nothing").unwrap();
        let path = dir.path().join("a.ply");
        std::fs::write(&path, format!("ply\nformat ascii 1.0\n{elements}end_header\n{rows}")).unwrap();
        read_mesh_with(&path, UpAxis::Z, options)
    }

    fn read_ply(elements: &str, rows: &str) -> Result<MeshFile> {
        read_with(elements, rows, &MeshOptions::default())
    }

    const XYZ: &str = "property float x\nproperty float y\nproperty double z\n";
    const FACE: &str = "property list uchar int vertex_indices\n";
    const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

    fn square(vertex: &str, face: &str, faces: usize) -> String {
        format!("element vertex 4\n{XYZ}{vertex}element face {faces}\n{FACE}{face}")
    }

    #[test]
    fn elements_in_any_order_and_polygons_of_any_size() {
        // An L, concave at its fourth corner. It stands before its vertices and after an element of no
        // interest.
        let elements = format!(
            "element camera 1\nproperty float f\nproperty list int int l\nelement face 4\n\
             property float other\n\
             property list uint short Vertex_Index\nelement vertex 6\nproperty double q\n{XYZ}"
        );
        let rows = "0.5 2 1 1\n7 6 0 1 2 3 4 5\n7 3 0 1 2\n7 2 0 1\n7 6 0 3 1 2 0 3\n\
            9 0 0 0\n9 2 0 0\n9 2 1 0\n9 1 1 0\n9 1 2 0\n9 0 2 0\n";

        let file = read_ply(&elements, rows).unwrap();
        assert_eq!((file.mesh.faces().len(), file.polygons_triangulated), (5, 1));
        assert_eq!(file.mesh.total_area(), 3.0 + 1.0);
        assert!((0..5).all(|f| file.mesh.normal(f) == Vec3::Z));
        assert_eq!(file.mesh.faces()[4], [0, 1, 2]);
        assert!(file.warnings[0].starts_with("1 polygon left out: the first, face 3 counted from 0, "));
        assert_eq!(file.warnings[1], "1 face with fewer than three corners left out, the first is face 2");
        assert!(file.labels.is_none());
    }

    #[test]
    fn axes_turn_positions_and_normals() {
        let elements = square("property float nx\nproperty float ny\nproperty float nz\n", "", 2);
        let rows = "0 0 0 0 2 0\n0 0 1 0 2 0\n1 0 0 0 2 0\n1 0 1 0 0 0\n3 0 1 2\n3 1 3 2\n";
        let bytes = format!("ply\nformat ascii 1.0\n{elements}end_header\n{rows}");
        let file = read(bytes.as_bytes(), 0, Path::new("a.ply"), UpAxis::Y, &MeshOptions::default()).unwrap();
        assert_eq!(file.mesh.positions()[1], vec3(0.0, -1.0, 0.0));
        assert_eq!((file.mesh.normal(0), file.mesh.corner_normals(0)), (Vec3::Z, Some([Vec3::Z; 3])));
        // A normal without a length.
        assert_eq!(file.mesh.corner_normals(1), None);
        assert!(file.warnings[0].contains("1 face left out: not finite"), "{:?}", file.warnings);
    }

    fn two_colors(kind: &str, names: [&str; 3], values: [&str; 2]) -> [[u8; 3]; 2] {
        let properties: String = names.map(|n| format!("property {kind} {n}\n")).concat();
        let [a, b] = values;
        let rows = format!("0 0 0 {a}\n1 0 0 {b}\n1 1 0 {b}\n0 1 0 {b}\n4 0 1 2 3\n");
        let file = read_ply(&square(&properties, "", 1), &rows).unwrap();
        assert!(file.warnings.is_empty());
        [file.mesh.parts().colors[0], file.mesh.parts().colors[1]]
    }

    #[test]
    fn colours_of_every_type() {
        let red = ["red", "green", "blue"];
        assert_eq!(two_colors("uchar", red, ["255 128 0", "1 2 3"]), [[255, 128, 0], [1, 2, 3]]);
        assert_eq!(two_colors("float", red, ["1 0.5 0", "0 0 1.01"]), [[255, 128, 0], [0, 0, 255]]);
        assert_eq!(two_colors("double", red, ["255 128 0", "1 2 nan"]), [[255, 128, 0], [1, 2, 0]]);
        assert_eq!(two_colors("ushort", red, ["65535 257 0", "0 0 0"]), [[255, 1, 0], [0; 3]]);
        assert_eq!(two_colors("int", red, ["255 128 -1", "0 0 0"]), [[255, 128, 0], [0; 3]]);
        let diffuse = ["diffuse_red", "diffuse_green", "diffuse_blue"];
        assert_eq!(two_colors("uint8", diffuse, ["9 8 7", "1 2 3"]), [[9, 8, 7], [1, 2, 3]]);
        assert_eq!(two_colors("uint8", ["R", "G", "B"], ["9 8 7", "1 2 3"]), [[9, 8, 7], [1, 2, 3]]);

        let elements = square("", "property uchar red\nproperty uchar green\nproperty uchar blue\n", 1);
        let file = read_ply(&elements, &format!("{SQUARE}4 0 1 2 3 9 8 7\n")).unwrap();
        assert!(file.warnings.is_empty() && file.mesh.materials().len() == 1);
        assert!((0..2).all(|face| matches!(file.mesh.color_of(face), FaceColor::Flat([9, 8, 7]))));
    }

    #[test]
    fn textures_of_vertices_and_of_corners() {
        let uv_rows = "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 0.5\n0 1 0 0 1\n";
        for names in [["u", "v"], ["s", "t"], ["texture_u", "texture_v"]] {
            let uv: String = names.map(|n| format!("property float {n}\n")).concat();
            let elements = format!("comment TextureFile two words.png\n{}", square(&uv, "", 2));
            let file = read_ply(&elements, &format!("{uv_rows}3 0 1 2\n3 0 2 3\n")).unwrap();
            let FaceColor::Texture(0, texture, uvs) = file.mesh.color_of(1) else { panic!() };
            assert_eq!(
                (texture.name.as_str(), uvs),
                ("two words.png", [vec2(0., 0.), vec2(1., 0.5), vec2(0., 1.)])
            );
            assert_eq!(texture.image.pixels(), [[1, 2, 3], [4, 5, 6]]);
            assert_eq!(file.texture_files[0].as_ref().unwrap().extension, "png");
            assert!(file.companions.len() == 1 && file.companions[0].ends_with("two words.png"));
            assert!(file.warnings.is_empty());
        }

        // As MeshLab writes it: two images, and one list for each face. The coordinates of a polygon go with
        // its corners.
        let list = "property list uchar float texcoord\nproperty int texnumber\n";
        let comments = "comment TextureFile two words.png\ncomment TextureFile b.png\n";
        let rows = format!(
            "{SQUARE}4 0 1 2 3 8 0 0 0.5 0 0.5 0.5 0 0.5 1\n3 0 1 2 6 0 0 1 0 1 1 0\n\
             3 1 2 3 6 0 0 1 0 1 1 -1\n\
             3 2 3 0 6 0 0 1 0 1 1 2\n3 3 0 1 0 0\n3 3 1 0 5 0 0 0 0 0 1\n"
        );
        // Four different planes, so that no face repeats another.
        let file = read_ply(&format!("{comments}{}", square("", list, 6)), &rows).unwrap();

        let texture_of = |face| match file.mesh.color_of(face) {
            FaceColor::Texture(_, texture, uvs) => Some((texture.name.as_str(), uvs)),
            _ => None,
        };
        for face in 0..2 {
            let (name, uvs) = texture_of(face).unwrap();
            let corners = file.mesh.triangle(face).map(|p| p.truncate() * 0.5);
            assert_eq!((name, uvs), ("b.png", corners));
        }
        assert_eq!(texture_of(2), None, "{:?}", file.mesh.faces());
        let told = file.warnings.join("\n");
        assert!(told.contains("1 face without a texture: texnumber is beyond the 2 textures"), "{told}");
        assert!(told.contains("texture coordinates of 1 face left out: not two numbers a corner"), "{told}");
    }

    #[test]
    fn textures_that_are_missing_are_told() {
        let uv = square("property float s\nproperty float t\n", "", 1);
        let rows = "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 0.5\n0 1 0 0 1\n3 0 1 2\n";
        for (comment, words) in [
            ("", "texture coordinates are not used: no \"comment TextureFile NAME\""),
            ("comment TextureFile gone.png\n", "texture `gone.png` is not there; its faces"),
            ("comment texturefile C:\\scans\\b.png\n", "texture `C:\\scans\\b.png` is not there; "),
            (
                "comment TextureFile broken.png\n",
                "broken.png is no image; PNG, JPEG, WebP, BMP, TGA and TIFF are read; its faces",
            ),
        ] {
            let file = read_ply(&format!("{comment}{uv}"), rows).unwrap();
            assert!(file.warnings[0].contains(words), "{:?}", file.warnings);
            assert_eq!(file.mesh.textures().len(), usize::from(comment.contains('C')));
        }
        let elements = format!("comment TextureFile b.png\n{}", square("", "", 1));
        let file = read_ply(&elements, &format!("{SQUARE}3 0 1 2\n")).unwrap();
        assert_eq!(file.warnings, ["the header names a texture, but nothing has texture coordinates"]);
    }

    fn numbers(file: &MeshFile) -> (LabelElement, [Option<LabelColumn>; 2]) {
        match file.labels.clone() {
            Some(MeshLabels::Numbers { element, class, instance }) => (element, [class, instance]),
            other => panic!("{other:?}"),
        }
    }

    fn column(name: &str, values: &[i64]) -> Option<LabelColumn> {
        Some(LabelColumn { name: name.into(), values: values.to_vec() })
    }

    #[test]
    fn labels_of_faces_stay_with_their_faces() {
        // A quad, a face without area, a face with two corners, a face that repeats the first half of the
        // quad, and a triangle.
        let elements = format!(
            "element vertex 5\n{XYZ}element face 5\nproperty int material_id\nproperty short category_id\n\
             {FACE}property uint object_id\n"
        );
        let rows = format!(
            "{SQUARE}2 2 2\n1 10 4 0 1 2 3 100\n1 11 3 1 1 2 101\n1 12 2 0 1 102\n1 13 3 2 1 0 103\n\
             1 -1 3 0 1 4 4294967295\n"
        );
        let file = read_ply(&elements, &rows).unwrap();
        assert_eq!(file.mesh.faces(), [[0, 1, 2], [0, 2, 3], [0, 1, 4]]);
        let expected =
            [column("category_id", &[10, 10, -1]), column("object_id", &[100, 100, 4_294_967_295])];
        assert_eq!(numbers(&file), (LabelElement::Face, expected));
        assert!(file.mesh.parts().face_tags.is_empty());
    }

    fn named_columns(class: Option<&str>, instance: Option<&str>) -> MeshOptions {
        MeshOptions {
            class_column: class.map(str::to_owned),
            instance_column: instance.map(str::to_owned),
            ..MeshOptions::default()
        }
    }

    #[test]
    fn labels_of_vertices_and_columns_by_name() {
        let elements = square(
            "property ushort label\nproperty float scalar_Instance\nproperty uchar nyu\n",
            "property int part\n",
            2,
        );
        let rows = "0 0 0 3 1 7\n1 0 0 4 nan 7\n1 1 0 5 2 8\n0 1 0 6 3 9\n3 0 1 2 20\n3 0 2 3 21\n";
        let file = read_ply(&elements, rows).unwrap();
        let instance = column("scalar_Instance", &[1, NO_LABEL, 2, 3]);
        assert_eq!(
            numbers(&file),
            (LabelElement::Vertex, [column("label", &[3, 4, 5, 6]), instance.clone()])
        );

        let file = read_with(&elements, rows, &named_columns(Some("nyu"), None)).unwrap();
        assert_eq!(numbers(&file).1, [column("nyu", &[7, 7, 8, 9]), instance]);

        // The faces have that column, but no column of classes.
        let file = read_with(&elements, rows, &named_columns(None, Some("part"))).unwrap();
        assert_eq!(numbers(&file), (LabelElement::Face, [None, column("part", &[20, 21])]));

        // No element has both columns.
        let message = read_with(&elements, rows, &named_columns(Some("label"), Some("part")))
            .unwrap_err()
            .to_string();
        assert!(
            message.contains(
                "no column of labels \"label\", \"part\" among the properties of its faces or of its vertices"
            ) && message.contains("(face: part; vertex: x, y, z, label, scalar_Instance, nyu)"),
            "{message}"
        );
    }

    #[test]
    fn numbers_that_are_not_whole_are_no_labels_unless_asked_for() {
        let elements = square("property float label\n", "", 1);
        let rows = "0 0 0 3\n1 0 0 4\n1 1 0 0.5\n0 1 0 6\n3 0 1 2\n";
        let file = read_ply(&elements, rows).unwrap();
        assert_eq!(file.labels, None);
        assert_eq!(
            file.warnings,
            ["the property label is not taken as labels: not all its numbers are whole"]
        );

        let options = MeshOptions { class_column: Some("LABEL".into()), ..MeshOptions::default() };
        let message = read_with(&elements, rows, &options).unwrap_err().to_string();
        assert!(
            message.contains("line 13: vertex 2: the label label is 0.5, which is no whole number"),
            "{message}"
        );
    }

    #[test]
    fn strips_become_triangles() {
        let elements =
            format!("element vertex 4\n{XYZ}element tristrips 1\nproperty list int int vertex_indices\n");
        let file = read_ply(&elements, &format!("{SQUARE}9 0 1 3 2 -1 0 0 1 2\n")).unwrap();
        assert_eq!(file.mesh.faces(), [[0, 1, 3], [3, 1, 2], [1, 0, 2]]);

        // Strips before faces with labels, whose order stays.
        let elements = format!(
            "element tristrips 1\nproperty list int int vertex_indices\nelement vertex 4\n\
             {XYZ}element face 1\n{FACE}property int label\n"
        );
        let file = read_ply(&elements, &format!("3 1 2 3\n{SQUARE}3 0 1 2 9\n")).unwrap();
        assert_eq!(file.mesh.faces(), [[0, 1, 2], [1, 2, 3]]);
        assert_eq!(numbers(&file).1, [column("label", &[9, NO_LABEL]), None]);
    }

    fn read_face(row: &str) -> Result<MeshFile> {
        read_ply(&square("", "", 1), &format!("{SQUARE}{row}\n"))
    }

    #[test]
    fn faults_are_named_with_their_place() {
        for (outcome, words) in [
            (read_face("3 0 1 4"), "line 14: face 0: vertex 4 is not there; there are 4"),
            (read_face("3 0 1 -1"), "line 14: face 0: vertex -1 is not there"),
            (read_face("2 0 1"), "has no face that can be used"),
            (read_face("4 0 2 1 3"), "has no face that can be used, as face 0 (counted from 0): "),
            (read_face("3 0 0 1"), "no face with an area (1 faces"),
            (read_ply(&format!("element vertex 1\n{XYZ}"), "1 2 3\n"), "has no face, only 1 vertex; a mesh"),
            (
                read_ply(
                    &format!(
                        "element vertex 1\n{XYZ}element range_grid 1\n\
                         property list uchar int vertex_indices\n"
                    ),
                    "1 2 3\n1 0\n",
                ),
                "only 1 vertex and the elements range_grid; a mesh",
            ),
            (
                read_ply(
                    "element vertex 1\nproperty float x\nelement face 1\n\
                     property list uchar int vertex_indices\n",
                    "1\n3 0 0 0\n",
                ),
                "its vertices have no x, y and z",
            ),
            (read_ply(&format!("element face 1\n{FACE}"), "3 0 1 2\n"), "vertex 0 is not there; there are 0"),
            (
                read_ply(
                    &format!("element vertex 4\n{XYZ}element face 1\nproperty int a\n"),
                    &format!("{SQUARE}1\n"),
                ),
                "the element \"face\" has no list vertex_indices, only: a",
            ),
            (
                read_ply(&square("", "", 1), "0 0 0\n1 0 0\n1 inf 0\n0 1 0\n3 0 1 2\n"),
                "vertex 2 is not finite",
            ),
            (
                read_ply(&format!("element vertex 4294967295\n{XYZ}element face 1\n{FACE}"), ""),
                "more vertices than 32 bits count",
            ),
        ] {
            let message = outcome.map(|f| f.warnings).unwrap_err().to_string();
            assert!(message.contains(words), "{words}: {message}");
        }
        let file = read_ply(&square("", "", 1), &format!("{SQUARE}3 0 1 2\n3 0 2 3\n")).unwrap();
        assert_eq!(file.warnings, ["the file goes on after its last element; the rest is not read"]);
    }

    #[test]
    fn claims_are_not_believed() {
        // 4 billion faces are claimed and none is there. The reader notices as soon as the file ends.
        let elements = format!("element vertex 4\n{XYZ}element face 18446744073709551615\n{FACE}");
        let message = read_ply(&elements, SQUARE).unwrap_err().to_string();
        assert!(message.contains("claims 18446744073709551615 rows of the element \"face\""), "{message}");
    }
}
