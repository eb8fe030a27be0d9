//! The meshes of the data set, `rgb.obj` and `semantic.obj`, with their materials. Own code: tobj reads only.
//!
//! Both files are **Y-up**, as published: (x, y, z) in them is (x, z, −y) of the Z-up world. Both hold the
//! faces in the mesh's own order, one line each, since consumers pair the two files face by face; `usemtl`
//! stands where the material changes. Numbers are written so that they are read back bit by bit. Source:
//! formats.md, "What is written".

#![expect(clippy::indexing_slicing, reason = "a writer: the indices are those that TriMesh::new checked")]

use crate::error::Result;
use crate::fs::atomic::{create_dir, write_bytes, write_whole};
use crate::fs::names::UniqueNames;
use crate::image::compression::Compression;
use crate::image::png::{Content, encode_rgb8};
use crate::mesh::obj::mtl::{WRAP_COMMENT, wrap_name};
use crate::mesh::obj::names::{clean_file_name, clean_material_name};
use s3d_geom::glam::{Vec2, Vec3};
use s3d_geom::{DEFAULT_COLOR, NO_INDEX, TriMesh, Wrap};
use s3d_label::pretty_color;
use std::borrow::Cow;
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

/// `rgb.obj`, `rgb.mtl` and the images in `rgb_textures`: a mesh with its textures, as text.
///
/// Positions, texture coordinates, normals and vertex colours are those of the mesh; what is not finite
/// (unused, so) is written as 0. Faces without a material get one called `default`. OBJ cannot say that a
/// texture is mirrored beyond its edge: it is repeated then, but for
/// [`read_mesh`](crate::mesh::read_mesh), which is told in a comment.
///
/// ```
/// use s3d_geom::glam::Vec3;
/// use s3d_geom::{MeshParts, TriMesh};
/// use s3d_io::mesh::RgbObj;
///
/// let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
/// let mesh = TriMesh::new(MeshParts { positions, faces: vec![[0, 1, 2]], ..MeshParts::default() })?;
/// let mut text = Vec::new();
/// RgbObj::new(&mesh, &[]).write_obj(&mut text)?;
/// assert!(text.ends_with(b"v 0 0 -1\nusemtl default\nf 1 2 3\n"));
/// # Ok::<_, Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct RgbObj<'a> {
    mesh: &'a TriMesh,
    given: &'a [TextureOut<'a>],
    texture_files: Vec<String>,
    materials: Vec<String>,
    default: String,
}

impl<'a> RgbObj<'a> {
    /// The files of `mesh`. `textures` holds the image files of [`TriMesh::textures`], one each; if it is
    /// empty, PNG files are made from the textures' pixels.
    ///
    /// # Panics
    /// If `textures` is neither empty nor as long as the mesh's.
    pub fn new(mesh: &'a TriMesh, textures: &'a [TextureOut<'a>]) -> Self {
        let (given, count) = (textures.len(), mesh.textures().len());
        assert!(given == 0 || given == count, "{given} image files for {count} textures");
        let mut files = UniqueNames::default();
        let texture_files = mesh
            .textures()
            .iter()
            .enumerate()
            .map(|(i, texture)| match textures.get(i) {
                Some(given) => files.add(&clean_file_name(given.name)),
                None => {
                    let stem = Path::new(&texture.name).file_stem();
                    let name = stem.map_or("texture".into(), |s| s.to_string_lossy());
                    files.add(&format!("{}.png", clean_file_name(&name)))
                }
            });
        let texture_files = texture_files.collect();
        let mut names = UniqueNames::default();
        let materials = mesh
            .materials()
            .iter()
            .map(|m| names.add(&clean_material_name(&m.name)))
            .collect();
        Self { mesh, given: textures, texture_files, materials, default: names.add("default") }
    }

    /// The textures: their file names in the folder `rgb_textures`, and the bytes of each, made when they are
    /// asked for.
    pub fn textures(&self) -> impl Iterator<Item = (&str, Cow<'_, [u8]>)> {
        self.texture_files
            .iter()
            .zip(self.mesh.textures())
            .enumerate()
            .map(|(i, (file, texture))| {
                let bytes = match self.given.get(i) {
                    Some(given) => Cow::Borrowed(given.bytes),
                    None => Cow::Owned(encode_rgb8(&texture.image, Content::Photo, Compression::default())),
                };
                (file.as_str(), bytes)
            })
    }

    /// Writes the content of `rgb.mtl`.
    ///
    /// # Errors
    /// Those of `w`.
    pub fn write_mtl(&self, w: &mut dyn Write) -> io::Result<()> {
        let clamped = clamped_textures(self.mesh);
        for (material, name) in self.mesh.materials().iter().zip(&self.materials) {
            let texture = material.texture.map(|t| MapOut {
                file: &self.texture_files[t as usize],
                clamped: clamped[t as usize],
                wrap: self.mesh.textures()[t as usize].wrap,
            });
            write_material(w, name, material.color, texture)?;
        }
        let all_have_one = (0..self.mesh.faces().len() as u32).all(|f| self.mesh.material_of(f).is_some());
        if all_have_one {
            Ok(())
        } else {
            write_material(w, &self.default, DEFAULT_COLOR, None)
        }
    }

    /// Writes the content of `rgb.obj`, which names `rgb.mtl` as its library.
    ///
    /// # Errors
    /// Those of `w`.
    pub fn write_obj(&self, w: &mut dyn Write) -> io::Result<()> {
        let parts = self.mesh.parts();
        writeln!(w, "# Y-up: x y z here are x z -y of the world (metres, Z up)\nmtllib rgb.mtl")?;
        write_positions(w, self.mesh)?;
        for uv in &parts.uvs {
            let [u, v] = finite2(*uv).to_array();
            writeln!(w, "vt {u} {v}")?;
        }
        for normal in &parts.normals {
            write_vector(w, "vn", *normal)?;
            w.write_all(b"\n")?;
        }
        let mut current = None;
        for (f, corners) in self.mesh.faces().iter().enumerate() {
            let material = self.mesh.material_of(f as u32);
            if current != Some(material) {
                current = Some(material);
                let name = material.map_or(&self.default, |m| &self.materials[m as usize]);
                writeln!(w, "usemtl {name}")?;
            }
            let column = |faces: &[[u32; 3]]| faces.get(f).copied().filter(|c| *c != [NO_INDEX; 3]);
            write_face(w, corners, column(&parts.face_uvs), column(&parts.face_normals))?;
        }
        Ok(())
    }
}

/// Writes the files of an [`RgbObj`] into the folder `dir`, which must be there, and returns their size in
/// bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// As [`RgbObj::new`].
pub fn write_rgb_obj(dir: &Path, mesh: &TriMesh, textures: &[TextureOut<'_>]) -> Result<u64> {
    let files = RgbObj::new(mesh, textures);
    let mut bytes = 0;
    if !mesh.textures().is_empty() {
        create_dir(&dir.join(TEXTURE_FOLDER))?;
    }
    for (file, contents) in files.textures() {
        bytes += write_bytes(&dir.join(TEXTURE_FOLDER).join(file), &contents)?;
    }
    bytes += write_whole(&dir.join("rgb.mtl"), |w| files.write_mtl(w))?;
    bytes += write_whole(&dir.join("rgb.obj"), |w| files.write_obj(w))?;
    Ok(bytes)
}

/// `semantic.obj` and `semantic.mtl`: a mesh whose materials are the labels of its faces.
#[derive(Clone, Copy, Debug)]
pub struct SemanticObj<'a> {
    mesh: &'a TriMesh,
    label_of_face: &'a [u32],
    names: &'a [String],
}

impl<'a> SemanticObj<'a> {
    /// The files of `mesh`. A face's material bears the name of its label: `names[label_of_face[face]]`. Each
    /// has the colour of [`pretty_color`].
    ///
    /// # Panics
    /// If `label_of_face` has not one entry a face, or one that is no index into `names`.
    pub fn new(mesh: &'a TriMesh, label_of_face: &'a [u32], names: &'a [String]) -> Self {
        let count = mesh.faces().len();
        assert_eq!(label_of_face.len(), count, "{count} faces need as many labels");
        for &label in label_of_face {
            assert!((label as usize) < names.len(), "label {label} of {}", names.len());
        }
        Self { mesh, label_of_face, names }
    }

    /// Writes the content of `semantic.mtl`: the labels that faces have.
    ///
    /// # Errors
    /// Those of `w`.
    pub fn write_mtl(&self, w: &mut dyn Write) -> io::Result<()> {
        let mut used = vec![false; self.names.len()];
        for &label in self.label_of_face {
            used[label as usize] = true;
        }
        let labels = (0u32..).zip(self.names).zip(&used).filter(|(_, used)| **used);
        labels
            .map(|(label, _)| label)
            .try_for_each(|(i, name)| write_material(w, name, pretty_color(i), None))
    }

    /// Writes the content of `semantic.obj`, which names `semantic.mtl` as its library.
    ///
    /// # Errors
    /// Those of `w`.
    pub fn write_obj(&self, w: &mut dyn Write) -> io::Result<()> {
        writeln!(w, "# Y-up: x y z here are x z -y of the world (metres, Z up); materials are labels")?;
        writeln!(w, "mtllib semantic.mtl")?;
        write_positions(w, self.mesh)?;
        let mut current = None;
        for (corners, &label) in self.mesh.faces().iter().zip(self.label_of_face) {
            if current != Some(label) {
                current = Some(label);
                writeln!(w, "usemtl {}", self.names[label as usize])?;
            }
            write_face(w, corners, None, None)?;
        }
        Ok(())
    }
}

/// Writes the files of a [`SemanticObj`] into the folder `dir`, which must be there, and returns their size
/// in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// As [`SemanticObj::new`].
pub fn write_semantic_obj(
    dir: &Path,
    mesh: &TriMesh,
    label_of_face: &[u32],
    names: &[String],
) -> Result<u64> {
    let files = SemanticObj::new(mesh, label_of_face, names);
    let mtl = write_whole(&dir.join("semantic.mtl"), |w| files.write_mtl(w))?;
    Ok(mtl + write_whole(&dir.join("semantic.obj"), |w| files.write_obj(w))?)
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
        let texture = mesh
            .material_of(f as u32)
            .and_then(|m| mesh.materials()[m as usize].texture);
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_geom::glam::{vec2, vec3};
    use s3d_geom::{Material, MeshParts, Raster, Texture};
    use std::path::PathBuf;

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

        let names: Vec<&str> = faces
            .iter()
            .map(|f| materials[f.material.unwrap()].name.as_str())
            .collect();
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
        let size: u64 = files
            .iter()
            .map(|f| std::fs::metadata(dir.path().join(f)).unwrap().len())
            .sum();
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
        let of_face: Vec<&str> = faces
            .iter()
            .map(|f| materials[f.material.unwrap()].name.as_str())
            .collect();
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
            let faces: Vec<[u32; 3]> =
                (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
            if let Ok(mesh) = TriMesh::from_faces(positions, faces) {
                let dir = tempfile::tempdir().unwrap();
                let labels = vec![0; mesh.faces().len()];
                write_semantic_obj(dir.path(), &mesh, &labels, &["wall_1_WC_1_1".into()]).unwrap();
                check_faces(&mesh, &read(&dir.path().join("semantic.obj")).0);
            }
        }
    }
}
