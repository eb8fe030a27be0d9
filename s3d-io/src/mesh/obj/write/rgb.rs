//! Writes the mesh with its textures.

#![expect(clippy::indexing_slicing, reason = "a writer: the indices are those that TriMesh::new checked")]

use super::statement::{
    MapOut, TEXTURE_FOLDER, Y_UP, write_face, write_material, write_positions, write_uv, write_vector,
};
use crate::error::Result;
use crate::fs::atomic::{create_dir, write_bytes, write_whole};
use crate::fs::names::UniqueNames;
use crate::image::compression::Compression;
use crate::image::png::{Content, encode_rgb8};
use crate::mesh::obj::names::{clean_file_name, clean_material_name};
use s3d_geom::glam::Vec2;
use s3d_geom::{DEFAULT_COLOR, NO_INDEX, TriMesh, Wrap};
use std::borrow::Cow;
use std::io::{self, Write};
use std::path::Path;

/// A texture as an image file, whose bytes are written unchanged.
#[derive(Clone, Copy, Debug)]
pub struct TextureOut<'a> {
    /// Its file name with the ending ("wall.jpg"). It is cleaned and made unique.
    pub name: &'a str,
    /// The bytes of the file.
    pub bytes: &'a [u8],
}

/// A mesh with its textures, as the files `rgb.obj`, `rgb.mtl` and the images in `rgb_textures`.
///
/// Positions, texture coordinates, normals and vertex colours come from the mesh. Unused values that are
/// not finite are written as 0. Faces without a material get one with the name `default`. OBJ cannot say that
/// a texture is mirrored beyond its edge. Other readers repeat it, and a comment tells our own,
/// [`read_mesh`](crate::mesh::read_mesh).
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
    /// Prepares the files of `mesh`. `textures` holds an image file for each of [`TriMesh::textures`]. If it
    /// is empty, PNG files are made from the pixels of the textures.
    ///
    /// # Panics
    /// If `textures` is neither empty nor as long as the textures of the mesh.
    pub fn new(mesh: &'a TriMesh, textures: &'a [TextureOut<'a>]) -> Self {
        let given = textures.len();
        let count = mesh.textures().len();
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
            })
            .collect();

        let mut names = UniqueNames::default();
        let materials = mesh
            .materials()
            .iter()
            .map(|m| names.add(&clean_material_name(&m.name)))
            .collect();
        Self { mesh, given: textures, texture_files, materials, default: names.add("default") }
    }

    /// Returns the file name of each texture in the folder `rgb_textures`, and its bytes. Bytes are made on
    /// demand.
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
    /// Returns the errors of `w`.
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
    /// Returns the errors of `w`.
    pub fn write_obj(&self, w: &mut dyn Write) -> io::Result<()> {
        let parts = self.mesh.parts();
        writeln!(w, "{Y_UP}\nmtllib rgb.mtl")?;
        write_positions(w, self.mesh)?;
        for &uv in &parts.uvs {
            write_uv(w, uv)?;
        }
        for &normal in &parts.normals {
            write_vector(w, "vn", normal)?;
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
            write_face(w, corners, corners_of(&parts.face_uvs, f), corners_of(&parts.face_normals, f))?;
        }
        Ok(())
    }
}

/// Returns the indices of a face in a column, if it has any.
fn corners_of(column: &[[u32; 3]], face: usize) -> Option<[u32; 3]> {
    column.get(face).copied().filter(|corners| *corners != [NO_INDEX; 3])
}

/// Returns which textures need the option `-clamp`. Few readers know it, so it is left out if no face reaches
/// beyond the edge of the texture.
fn clamped_textures(mesh: &TriMesh) -> Vec<bool> {
    let parts = mesh.parts();

    let mut clamped = vec![false; parts.textures.len()];
    for (f, corners) in parts.face_uvs.iter().enumerate().filter(|(_, c)| **c != [NO_INDEX; 3]) {
        let texture = mesh
            .material_of(f as u32)
            .and_then(|m| mesh.materials()[m as usize].texture);
        if let Some(t) = texture.filter(|&t| parts.textures[t as usize].wrap == [Wrap::Clamp; 2]) {
            clamped[t as usize] |= !corners.iter().all(|&i| {
                let uv = parts.uvs[i as usize];
                uv.cmpge(Vec2::ZERO).all() && uv.cmple(Vec2::ONE).all()
            });
        }
    }
    clamped
}

/// Writes the files of an [`RgbObj`] into the folder `dir`, which must exist. Returns their size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
///
/// # Panics
/// Like [`RgbObj::new`].
pub fn write_rgb_obj(dir: &Path, mesh: &TriMesh, textures: &[TextureOut<'_>]) -> Result<u64> {
    let files = RgbObj::new(mesh, textures);
    if !mesh.textures().is_empty() {
        create_dir(&dir.join(TEXTURE_FOLDER))?;
    }

    let mut bytes = 0;
    for (file, contents) in files.textures() {
        bytes += write_bytes(&dir.join(TEXTURE_FOLDER).join(file), &contents)?;
    }
    bytes += write_whole(&dir.join("rgb.mtl"), |w| files.write_mtl(w))?;
    bytes += write_whole(&dir.join("rgb.obj"), |w| files.write_obj(w))?;
    Ok(bytes)
}
