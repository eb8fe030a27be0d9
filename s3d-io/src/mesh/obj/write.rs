//! The meshes of the data set, `rgb.obj` and `semantic.obj`, with their materials.
//!
//! Both files are **Y-up**, as published: (x, y, z) in them is (x, z, −y) of the Z-up world. Both hold the
//! faces in the mesh's own order, one line each, since consumers pair the two files face by face; `usemtl`
//! stands where the material changes. Numbers are written so that they are read back bit by bit. Source:
//! formats.md, "World and meshes".

#![expect(clippy::indexing_slicing, reason = "a writer: the indices are those that TriMesh::new checked")]

use crate::error::Result;
use crate::fs::atomic::{create_dir, write_bytes, write_whole};
use crate::image::compression::Compression;
use crate::image::png::{Content, encode_rgb8};
use crate::image::pretty::pretty_color;
use crate::mesh::obj::mtl::{WRAP_COMMENT, wrap_name};
use s3d_geom::glam::{Vec2, Vec3};
use s3d_geom::{DEFAULT_COLOR, NO_INDEX, TriMesh, Wrap};
use std::collections::HashSet;
use std::io::{self, Write};
use std::path::Path;

/// The folder of the textures, beside `rgb.obj`.
const TEXTURE_FOLDER: &str = "rgb_textures";

/// A texture as the bytes of an image file, to be handed on as they are.
#[derive(Clone, Copy, Debug)]
pub struct TextureOut<'a> {
    /// Its file name with the ending ("wall.jpg"). It is cleaned and made unique.
    pub name: &'a str,
    /// The contents of the file.
    pub bytes: &'a [u8],
}

/// Writes `rgb.obj`, `rgb.mtl` and the folder `rgb_textures` into the folder `dir`, which must be there, and
/// returns the size of all files in bytes.
///
/// `textures` holds the image files of [`TriMesh::textures`], one each; if it is empty, PNG files are made
/// from the textures' pixels. Positions, texture coordinates, normals and vertex colours are those of the
/// mesh; what is not finite (unused, so) is written as 0. Faces without a material get one called `default`.
/// OBJ cannot say that a texture is mirrored beyond its edge: it is repeated then, but for
/// [`read_mesh`](crate::mesh::read_mesh), which is told in a comment.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// If `textures` is neither empty nor as long as the mesh's.
pub fn write_rgb_obj(dir: &Path, mesh: &TriMesh, textures: &[TextureOut<'_>]) -> Result<u64> {
    let count = mesh.textures().len();
    assert!(
        textures.is_empty() || textures.len() == count,
        "{} image files for {count} textures",
        textures.len()
    );
    let mut bytes = 0;

    let mut files = UniqueNames::default();
    let mut texture_files = Vec::with_capacity(count);
    if count > 0 {
        create_dir(&dir.join(TEXTURE_FOLDER))?;
    }
    for (i, texture) in mesh.textures().iter().enumerate() {
        let (file, contents) = match textures.get(i) {
            Some(given) => (files.add(&clean_file_name(given.name)), given.bytes),
            None => {
                let name =
                    Path::new(&texture.name).file_stem().map_or("texture".into(), |s| s.to_string_lossy());
                let png = encode_rgb8(&texture.image, Content::Photo, Compression::default());
                let file = files.add(&format!("{}.png", clean_file_name(&name)));
                bytes += write_bytes(&dir.join(TEXTURE_FOLDER).join(&file), &png)?;
                texture_files.push(file);
                continue;
            }
        };
        bytes += write_bytes(&dir.join(TEXTURE_FOLDER).join(&file), contents)?;
        texture_files.push(file);
    }

    let mut names = UniqueNames::default();
    let materials: Vec<String> =
        mesh.materials().iter().map(|m| names.add(&clean_material_name(&m.name))).collect();
    let default = names.add("default");
    let clamped = clamped_textures(mesh);
    bytes += write_whole(&dir.join("rgb.mtl"), |w| {
        for (material, name) in mesh.materials().iter().zip(&materials) {
            let texture = material.texture.map(|t| MapOut {
                file: &texture_files[t as usize],
                clamped: clamped[t as usize],
                wrap: mesh.textures()[t as usize].wrap,
            });
            write_material(w, name, material.color, texture)?;
        }
        let all_have_one = (0..mesh.faces().len() as u32).all(|f| mesh.material_of(f).is_some());
        if all_have_one { Ok(()) } else { write_material(w, &default, DEFAULT_COLOR, None) }
    })?;

    bytes += write_whole(&dir.join("rgb.obj"), |w| {
        let parts = mesh.parts();
        writeln!(w, "# Y-up: x y z here are x z -y of the world (metres, Z up)\nmtllib rgb.mtl")?;
        write_positions(w, mesh)?;
        for uv in &parts.uvs {
            let [u, v] = finite2(*uv).to_array();
            writeln!(w, "vt {u} {v}")?;
        }
        for normal in &parts.normals {
            write_vector(w, "vn", *normal)?;
            w.write_all(b"\n")?;
        }
        let mut current = None;
        for (f, corners) in mesh.faces().iter().enumerate() {
            let material = mesh.material_of(f as u32);
            if current != Some(material) {
                current = Some(material);
                writeln!(w, "usemtl {}", material.map_or(&default, |m| &materials[m as usize]))?;
            }
            let column = |faces: &[[u32; 3]]| faces.get(f).copied().filter(|c| *c != [NO_INDEX; 3]);
            write_face(w, corners, column(&parts.face_uvs), column(&parts.face_normals))?;
        }
        Ok(())
    })?;
    Ok(bytes)
}

/// Writes `semantic.obj` and `semantic.mtl` into the folder `dir`, which must be there, and returns the size
/// of both in bytes. A face's material bears the name of its label: `names[label_of_face[face]]`. Each has
/// the colour of [`pretty_color`].
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// If `label_of_face` has not one entry a face, or one that is no index into `names`.
pub fn write_semantic_obj(
    dir: &Path,
    mesh: &TriMesh,
    label_of_face: &[u32],
    names: &[String],
) -> Result<u64> {
    let count = mesh.faces().len();
    assert_eq!(label_of_face.len(), count, "{count} faces need as many labels");
    let mut used = vec![false; names.len()];
    for &label in label_of_face {
        assert!((label as usize) < names.len(), "label {label} of {}", names.len());
        used[label as usize] = true;
    }

    let mut bytes = write_whole(&dir.join("semantic.mtl"), |w| {
        let labels = (0u32..).zip(names).zip(&used).filter(|(_, used)| **used);
        labels
            .map(|(label, _)| label)
            .try_for_each(|(i, name)| write_material(w, name, pretty_color(i), None))
    })?;
    bytes += write_whole(&dir.join("semantic.obj"), |w| {
        writeln!(w, "# Y-up: x y z here are x z -y of the world (metres, Z up); materials are labels")?;
        writeln!(w, "mtllib semantic.mtl")?;
        write_positions(w, mesh)?;
        let mut current = None;
        for (corners, &label) in mesh.faces().iter().zip(label_of_face) {
            if current != Some(label) {
                current = Some(label);
                writeln!(w, "usemtl {}", names[label as usize])?;
            }
            write_face(w, corners, None, None)?;
        }
        Ok(())
    })?;
    Ok(bytes)
}

fn write_positions(w: &mut dyn Write, mesh: &TriMesh) -> io::Result<()> {
    let colors = &mesh.parts().colors;
    for (i, &position) in mesh.positions().iter().enumerate() {
        write_vector(w, "v", position)?;
        if let Some(color) = colors.get(i) {
            let [r, g, b] = color.map(unit);
            write!(w, " {r} {g} {b}")?;
        }
        w.write_all(b"\n")?;
    }
    Ok(())
}

/// A vector of the world, turned Y-up.
fn write_vector(w: &mut dyn Write, key: &str, v: Vec3) -> io::Result<()> {
    let v = if v.is_finite() { v } else { Vec3::ZERO };
    // `{}` of an f32 is the shortest text that is read as the same f32.
    write!(w, "{key} {} {} {}", v.x, v.z, -v.y)
}

fn finite2(v: Vec2) -> Vec2 {
    if v.is_finite() { v } else { Vec2::ZERO }
}

fn write_face(
    w: &mut dyn Write,
    corners: &[u32; 3],
    uvs: Option<[u32; 3]>,
    normals: Option<[u32; 3]>,
) -> io::Result<()> {
    w.write_all(b"f")?;
    for k in 0..3 {
        // OBJ counts from 1; 64 bits, since the index before the last of u32 may be there.
        let [v, uv, n] =
            [Some(corners[k]), uvs.map(|c| c[k]), normals.map(|c| c[k])].map(|i| i.map(|i| u64::from(i) + 1));
        match (v, uv, n) {
            (Some(v), None, None) => write!(w, " {v}")?,
            (Some(v), Some(uv), None) => write!(w, " {v}/{uv}")?,
            (Some(v), None, Some(n)) => write!(w, " {v}//{n}")?,
            (Some(v), Some(uv), Some(n)) => write!(w, " {v}/{uv}/{n}")?,
            (None, ..) => {}
        }
    }
    w.write_all(b"\n")
}

/// The texture of a material.
struct MapOut<'a> {
    file: &'a str,
    /// Whether its option says that it does not repeat.
    clamped: bool,
    wrap: [Wrap; 2],
}

fn write_material(
    w: &mut dyn Write,
    name: &str,
    color: [u8; 3],
    texture: Option<MapOut<'_>>,
) -> io::Result<()> {
    let [r, g, b] = color.map(unit);
    writeln!(w, "newmtl {name}\nKd {r} {g} {b}\nillum 1")?;
    if let Some(MapOut { file, clamped, wrap }) = texture {
        let said = if clamped { Wrap::Clamp } else { Wrap::Repeat };
        if wrap != [said; 2] {
            writeln!(w, "{WRAP_COMMENT} {} {}", wrap_name(wrap[0]), wrap_name(wrap[1]))?;
        }
        writeln!(w, "map_Kd {}{TEXTURE_FOLDER}/{file}", if clamped { "-clamp on " } else { "" })?;
    }
    w.write_all(b"\n")
}

fn unit(channel: u8) -> f32 {
    f32::from(channel) / 255.0
}

/// Which textures need the word that they do not repeat: few readers know it, so it is left out where no face
/// reaches beyond the edge.
fn clamped_textures(mesh: &TriMesh) -> Vec<bool> {
    let parts = mesh.parts();
    let mut clamped = vec![false; parts.textures.len()];
    for (f, corners) in parts.face_uvs.iter().enumerate().filter(|(_, c)| **c != [NO_INDEX; 3]) {
        let texture = mesh.material_of(f as u32).and_then(|m| mesh.materials()[m as usize].texture);
        if let Some(t) = texture.filter(|&t| parts.textures[t as usize].wrap == [Wrap::Clamp; 2]) {
            let inside = |&i: &u32| {
                let uv = parts.uvs[i as usize];
                uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all()
            };
            clamped[t as usize] |= !corners.iter().all(inside);
        }
    }
    clamped
}

/// The most characters of a cleaned name: file systems take 255 bytes, and a temporary file's name is longer.
const MAX_NAME: usize = 128;

/// A file name of ASCII letters, digits, `-`, `.` and `_`, not hidden, and without "rgb", which loaders
/// replace in paths. One that Windows keeps for a device (`con.png`) gets a `_` in front; a long one is cut
/// before its ending.
fn clean_file_name(name: &str) -> String {
    let safe = |c: char| if c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_') { c } else { '_' };
    let mut clean: String = name.chars().map(safe).collect();
    while let Some(at) = clean.to_ascii_lowercase().find("rgb") {
        clean.replace_range(at..at + 3, "color");
    }
    // Windows drops dots at the end.
    let clean = clean.trim_matches('.');
    if clean.is_empty() {
        return "texture".into();
    }
    let device = clean.split('.').next().unwrap_or_default().to_ascii_lowercase();
    let numbered = device.strip_prefix("com").or(device.strip_prefix("lpt"));
    let is_device = matches!(device.as_str(), "con" | "prn" | "aux" | "nul")
        || numbered.is_some_and(|n| n.len() == 1 && n.bytes().all(|b| b.is_ascii_digit()));
    let clean = if is_device { format!("_{clean}") } else { clean.to_owned() };
    let (stem, ending) =
        clean.split_at(clean.rfind('.').filter(|at| clean.len() - at <= 8).unwrap_or(clean.len()));
    let stem = stem.get(..MAX_NAME - ending.len()).unwrap_or(stem);
    format!("{stem}{ending}")
}

/// A material name without white space, which ends it in many readers.
fn clean_material_name(name: &str) -> String {
    let clean: String =
        name.chars().map(|c| if c.is_whitespace() || c.is_control() { '_' } else { c }).collect();
    if clean.is_empty() { "material".into() } else { clean }
}

/// Hands out names that differ in more than case.
#[derive(Default)]
struct UniqueNames(HashSet<String>);

impl UniqueNames {
    /// `name`, or with a number before its ending if it was there already.
    fn add(&mut self, name: &str) -> String {
        let dot = name.rfind('.');
        let (stem, ending) = dot.and_then(|dot| name.split_at_checked(dot)).unwrap_or((name, ""));
        let mut candidate = name.to_owned();
        let mut number = 2;
        while !self.0.insert(candidate.to_lowercase()) {
            candidate = format!("{stem}_{number}{ending}");
            number += 1;
        }
        candidate
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_geom::glam::{vec2, vec3};
    use s3d_geom::{Material, MeshParts, Raster, Texture};
    use std::path::PathBuf;

    #[test]
    fn names_of_files_stay_in_their_folder_and_work_everywhere() {
        for (name, clean) in [
            ("wall.png", "wall.png"),
            ("../../etc/passwd", "_.._etc_passwd"),
            ("..\\..\\x.png", "_.._x.png"),
            ("/etc/passwd", "_etc_passwd"),
            ("C:\\x.png", "C__x.png"),
            ("a\0b\n.png", "a_b_.png"),
            ("...", "texture"),
            ("", "texture"),
            (".hidden.jpg", "hidden.jpg"),
            ("dots...", "dots"),
            ("con.png", "_con.png"),
            ("COM7", "_COM7"),
            ("lpt1.tar.gz", "_lpt1.tar.gz"),
            ("console.png", "console.png"),
            ("com10.png", "com10.png"),
            ("Rgb.png", "color.png"),
        ] {
            assert_eq!(clean_file_name(name), clean, "{name:?}");
        }
        let long = clean_file_name(&format!("{}.png", "ä".repeat(500)));
        assert!(long.len() == MAX_NAME && long.ends_with("_.png"), "{long}");
        let mut names = UniqueNames::default();
        let unique = ["Wall.png", "wall.PNG", "WALL.png", "wall_2.png"].map(|name| names.add(name));
        assert_eq!(unique, ["Wall.png", "wall_2.PNG", "WALL_3.png", "wall_2_2.png"]);
    }

    /// What another reader finds in an OBJ file: per face its corners' positions, coordinates, normals,
    /// colours, in the world's axes again, and its material's name.
    #[derive(Debug, PartialEq)]
    struct Face {
        positions: [Vec3; 3],
        uvs: Option<[Vec2; 3]>,
        normals: Option<[Vec3; 3]>,
        colors: Option<[[u8; 3]; 3]>,
        material: Option<usize>,
    }

    fn read(path: &Path) -> (Vec<Face>, Vec<tobj::Material>) {
        let (models, materials) = tobj::load_obj(path, &tobj::LoadOptions::default()).unwrap();
        let world = |v: &[f32], i: u32| {
            let i = 3 * i as usize;
            vec3(v[i], -v[i + 2], v[i + 1])
        };
        let mut faces = Vec::new();
        for m in models.iter().map(|m| &m.mesh) {
            assert!(m.face_arities.is_empty(), "triangles only");
            let corners = |column: &[u32], f: usize| -> Option<[u32; 3]> {
                (!column.is_empty()).then(|| [column[3 * f], column[3 * f + 1], column[3 * f + 2]])
            };
            for f in 0..m.indices.len() / 3 {
                let v = corners(&m.indices, f).unwrap();
                let byte = |x: f32| (x * 255.0).round() as u8;
                faces.push(Face {
                    positions: v.map(|i| world(&m.positions, i)),
                    uvs: corners(&m.texcoord_indices, f).map(|c| {
                        c.map(|i| vec2(m.texcoords[2 * i as usize], m.texcoords[2 * i as usize + 1]))
                    }),
                    normals: corners(&m.normal_indices, f).map(|c| c.map(|i| world(&m.normals, i))),
                    colors: (!m.vertex_color.is_empty())
                        .then(|| v.map(|i| [0, 1, 2].map(|k| byte(m.vertex_color[3 * i as usize + k])))),
                    material: m.material_id,
                });
            }
        }
        (faces, materials.unwrap())
    }

    fn square() -> MeshParts {
        MeshParts {
            positions: vec![
                vec3(0.1, -0.0, 1e-7),
                vec3(1.0, 0.3, 1.5),
                vec3(1.0 / 3.0, 12345.678, -2.5),
                Vec3::Y,
            ],
            faces: vec![[0, 1, 2], [0, 2, 3], [3, 1, 0]],
            ..MeshParts::default()
        }
    }

    fn textured() -> MeshParts {
        let material = |name: &str, texture| Material { name: name.into(), color: [10, 200, 255], texture };
        let texture = |name: &str, value| Texture {
            name: name.into(),
            image: Raster::from_vec(2, 1, vec![[value; 3], [1, 2, 3]]),
            wrap: [Wrap::Repeat; 2],
        };
        MeshParts {
            uvs: vec![vec2(0.1, 0.9), vec2(1.25, -3.0), vec2(0.7, f32::NAN), vec2(0.5, 0.5)],
            face_uvs: vec![[0, 1, 3], [NO_INDEX; 3], [3, 0, 0]],
            normals: vec![Vec3::Z, vec3(0.6, -0.8, 0.0)],
            face_normals: vec![[0, 0, 1], [1, 0, 0], [NO_INDEX; 3]],
            materials: vec![
                material("wall paint", Some(1)),
                material("wall_paint", Some(0)),
                material("", None),
            ],
            face_materials: vec![1, 2, 0],
            textures: vec![texture("some/Scan.JPG", 50), texture("scan.png", 60)],
            ..square()
        }
    }

    fn check_faces(mesh: &TriMesh, faces: &[Face]) {
        let p = mesh.parts();
        assert_eq!(faces.len(), mesh.faces().len());
        for (f, face) in faces.iter().enumerate() {
            // Bit by bit, so that a corner at −0 counts too.
            let bits = |t: [Vec3; 3]| t.map(|v| v.to_array().map(f32::to_bits));
            assert_eq!(bits(face.positions), bits(mesh.triangle(f as u32)), "face {f}");
            // tobj takes the first entry of the file where a face names none, so only what is there is
            // compared here.
            if let Some(normals) = mesh.corner_normals(f as u32) {
                assert_eq!(face.normals.map(bits), Some(bits(normals)), "face {f}");
            }
            if let Some(corners) = p.face_uvs.get(f).filter(|c| **c != [NO_INDEX; 3]) {
                assert_eq!(face.uvs, Some(corners.map(|i| p.uvs[i as usize])), "face {f}");
            }
            let colors = (!p.colors.is_empty()).then(|| p.faces[f].map(|v| p.colors[v as usize]));
            assert_eq!(face.colors, colors, "face {f}");
        }
    }

    #[test]
    fn a_textured_mesh_comes_back_with_its_textures() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = TriMesh::new(textured()).unwrap();
        let bytes = write_rgb_obj(dir.path(), &mesh, &[]).unwrap();
        let (faces, materials) = read(&dir.path().join("rgb.obj"));
        check_faces(&mesh, &faces);
        let text = std::fs::read_to_string(dir.path().join("rgb.obj")).unwrap();
        let lines: Vec<&str> = text.lines().filter(|l| l.starts_with("f ")).collect();
        assert_eq!(lines, ["f 1/1/1 2/2/1 3/4/2", "f 1//2 3//1 4//1", "f 4/4 2/1 1/1"]);

        let names: Vec<&str> = faces.iter().map(|f| materials[f.material.unwrap()].name.as_str()).collect();
        assert_eq!(names, ["wall_paint_2", "material", "wall_paint"]);
        let all: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
        assert_eq!(all, ["wall_paint", "wall_paint_2", "material"]);
        let kd = materials[2].diffuse.unwrap().map(|x| (x * 255.0).round() as u8);
        assert_eq!(kd, [10, 200, 255]);
        // Both textures are called "scan" to a file system that ignores case.
        assert_eq!(materials[1].diffuse_texture.as_deref(), Some("rgb_textures/Scan.png"));
        assert_eq!(materials[0].diffuse_texture.as_deref(), Some("rgb_textures/scan_2.png"));
        for (i, file) in ["Scan.png", "scan_2.png"].iter().enumerate() {
            let image = crate::image::png::read_rgb8(&dir.path().join(TEXTURE_FOLDER).join(file)).unwrap();
            assert_eq!(image, mesh.textures()[i].image);
        }
        let files =
            ["rgb.obj", "rgb.mtl", "rgb_textures/Scan.png", "rgb_textures/scan_2.png"].map(PathBuf::from);
        let size: u64 = files.iter().map(|f| std::fs::metadata(dir.path().join(f)).unwrap().len()).sum();
        assert_eq!(bytes, size);
    }

    #[test]
    fn given_image_files_are_handed_on_as_they_are() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = TriMesh::new(textured()).unwrap();
        let given = [
            TextureOut { name: "../room rgb 1.jpg", bytes: b"not even an image" },
            TextureOut { name: "RgRGBb.jpg", bytes: b"second" },
        ];
        write_rgb_obj(dir.path(), &mesh, &given).unwrap();
        let mut names: Vec<_> = std::fs::read_dir(dir.path().join(TEXTURE_FOLDER))
            .unwrap()
            .map(|e| e.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        assert_eq!(names, ["Rgcolorb.jpg", "_room_color_1.jpg"]);
        let first = std::fs::read(dir.path().join(TEXTURE_FOLDER).join("_room_color_1.jpg")).unwrap();
        assert_eq!(first, b"not even an image");
    }

    #[test]
    fn vertex_colours_and_faces_without_material() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = TriMesh::new(MeshParts {
            colors: vec![[0, 1, 2], [255, 254, 253], [77, 128, 129], [9; 3]],
            ..square()
        })
        .unwrap();
        write_rgb_obj(dir.path(), &mesh, &[]).unwrap();
        let (faces, materials) = read(&dir.path().join("rgb.obj"));
        check_faces(&mesh, &faces);
        assert_eq!(materials[faces[0].material.unwrap()].name, "default");
        assert!(!dir.path().join(TEXTURE_FOLDER).exists());
    }

    #[test]
    fn clamping_is_said_only_where_it_shows() {
        let mut parts = textured();
        for t in &mut parts.textures {
            t.wrap = [Wrap::Clamp; 2];
        }
        let dir = tempfile::tempdir().unwrap();
        write_rgb_obj(dir.path(), &TriMesh::new(parts).unwrap(), &[]).unwrap();
        let mtl = std::fs::read_to_string(dir.path().join("rgb.mtl")).unwrap();
        // Face 0 (material 1, texture 0) reaches beyond the edge, face 2 does not.
        assert!(
            mtl.contains("map_Kd -clamp on rgb_textures/Scan.png\n")
                && mtl.contains("# s3d wrap clamp clamp\nmap_Kd rgb_textures/scan_2.png\n")
        );
    }

    #[test]
    fn our_reader_is_told_how_textures_go_on() {
        for wrap in [[Wrap::Clamp; 2], [Wrap::Mirror, Wrap::Clamp], [Wrap::Repeat; 2]] {
            let mut parts = textured();
            parts.textures.iter_mut().for_each(|t| t.wrap = wrap);
            let dir = tempfile::tempdir().unwrap();
            write_rgb_obj(dir.path(), &TriMesh::new(parts).unwrap(), &[]).unwrap();
            let mesh =
                crate::mesh::read::read_mesh(&dir.path().join("rgb.obj"), crate::mesh::file::UpAxis::Y)
                    .unwrap()
                    .mesh;
            assert!(
                !mesh.textures().is_empty() && mesh.textures().iter().all(|t| t.wrap == wrap),
                "{wrap:?}"
            );
            let mtl = std::fs::read_to_string(dir.path().join("rgb.mtl")).unwrap();
            assert_eq!(mtl.contains(WRAP_COMMENT), wrap != [Wrap::Repeat; 2]);
        }
    }

    #[test]
    fn labels_are_materials_in_the_order_of_faces() {
        let dir = tempfile::tempdir().unwrap();
        let mesh = TriMesh::new(square()).unwrap();
        let names = ["<UNK>_0_<UNK>_0_0", "chair_3_office_5_1", "beam_1_office_5_1", "wall_2_WC_1_1"]
            .map(String::from);
        write_semantic_obj(dir.path(), &mesh, &[3, 0, 1], &names).unwrap();
        let (faces, materials) = read(&dir.path().join("semantic.obj"));
        check_faces(&mesh, &faces);
        let of_face: Vec<&str> = faces.iter().map(|f| materials[f.material.unwrap()].name.as_str()).collect();
        assert_eq!(of_face, [&names[3], &names[0], &names[1]]);
        assert_eq!(materials.len(), 3);
        for material in &materials {
            let label = names.iter().position(|n| *n == material.name).unwrap() as u32;
            let color = material.diffuse.unwrap().map(|x| (x * 255.0).round() as u8);
            assert_eq!(color, pretty_color(label));
        }
        let text = std::fs::read_to_string(dir.path().join("semantic.obj")).unwrap();
        assert!(text.contains("\nv 0.1 0.0000001 0\n"), "{text}");
    }

    #[test]
    #[should_panic(expected = "label 4 of 1")]
    fn a_label_without_a_name_is_a_callers_mistake() {
        let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let _ = write_semantic_obj(Path::new("."), &mesh, &[4], &["a".into()]);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn positions_come_back_bit_by_bit(points in proptest::collection::vec(any::<[f32; 3]>(), 3..60)) {
            let positions: Vec<Vec3> = points.into_iter().map(Vec3::from).filter(|p| p.is_finite()).collect();
            let faces: Vec<[u32; 3]> = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            if let Ok(mesh) = TriMesh::from_faces(positions, faces) {
                let dir = tempfile::tempdir().unwrap();
                write_semantic_obj(dir.path(), &mesh, &vec![0; mesh.faces().len()], &["wall_1_WC_1_1".into()]).unwrap();
                check_faces(&mesh, &read(&dir.path().join("semantic.obj")).0);
            }
        }
    }
}
