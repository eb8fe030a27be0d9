//! Reads the textures of a PLY mesh. Comments name the images, as MeshLab writes them:
//! `comment TextureFile wall.png`.

use crate::error::Result;
use crate::fs::quote::{count, quote};
use crate::image::find::find_image;
use crate::image::texture::{TextureFile, read_textures};
use crate::mesh::ply::faces::{PlyFaces, PlyTriangles};
use crate::mesh::ply::header::PlyHeader;
use crate::mesh::ply::vertices::PlyVertices;
use s3d_geom::{DEFAULT_COLOR, Material, MeshParts, NO_INDEX, Texture, Wrap};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The images that the header's comments name.
#[derive(Default)]
pub(crate) struct PlyLooks {
    /// The name in each comment, and its texture if the image could be read.
    by_comment: Vec<(String, Option<u32>)>,
    pub(crate) textures: Vec<Texture>,
    pub(crate) files: Vec<Option<TextureFile>>,
    /// The images that were read.
    pub(crate) companions: Vec<PathBuf>,
}

impl PlyLooks {
    /// Reads the images. A missing image is a warning.
    ///
    /// # Errors
    /// [`crate::Error::Unsupported`] for images that are too large.
    pub(crate) fn load(path: &Path, header: &PlyHeader, warnings: &mut Vec<String>) -> Result<Self> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let names = header.comments.iter().filter_map(|comment| texture_name(comment));

        let mut looks = Self::default();
        let mut wanted: Vec<PathBuf> = Vec::new();
        // For each comment the index of its image.
        let mut images: Vec<Option<usize>> = Vec::new();
        for name in names {
            match find_image(name, folder, folder) {
                Some((image, exact)) => {
                    if !exact {
                        let written = quote(name.as_bytes());
                        warnings.push(format!("texture {written} is not there; {} is used", image.display()));
                    }
                    images.push(Some(wanted.len()));
                    wanted.push(image);
                }
                None => {
                    let written = quote(name.as_bytes());
                    warnings.push(format!("texture {written} is not there; its faces are drawn without it"));
                    images.push(None);
                }
            }
            looks.by_comment.push((name.to_owned(), None));
        }

        for (index, (loaded, path)) in read_textures(&wanted)?.into_iter().zip(&wanted).enumerate() {
            match loaded {
                Ok(loaded) => {
                    let texture = looks.textures.len() as u32;
                    for ((_, slot), image) in looks.by_comment.iter_mut().zip(&images) {
                        if *image == Some(index) {
                            *slot = Some(texture);
                        }
                    }
                    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    looks
                        .textures
                        .push(Texture { name, image: loaded.image, wrap: [Wrap::Repeat; 2] });
                    looks.files.push(loaded.file);
                }
                Err(why) => {
                    warnings.push(format!("texture {} {why}; its faces are drawn without it", path.display()))
                }
            }
        }

        looks.companions = wanted;
        Ok(looks)
    }
}

/// Returns the name in a comment `TextureFile NAME`.
fn texture_name(comment: &str) -> Option<&str> {
    let (keyword, name) = comment.split_once(char::is_whitespace)?;
    keyword.eq_ignore_ascii_case("TextureFile").then(|| name.trim())
}

/// Gives the faces a material for each texture, and texture coordinates: of the corners, or else of the
/// vertices.
pub(crate) fn lay_textures(
    parts: &mut MeshParts,
    vertices: &mut PlyVertices,
    faces: &mut PlyFaces,
    triangles: &PlyTriangles,
    looks: &PlyLooks,
    warnings: &mut Vec<String>,
) {
    let uvs = faces.take_uvs(triangles);
    if looks.by_comment.is_empty() {
        if uvs.is_some() || !vertices.uvs.is_empty() {
            warnings.push(
                "texture coordinates are not used: no \"comment TextureFile NAME\" in the header names an \
                 image"
                    .into(),
            );
        }
        return;
    }

    parts.materials = looks
        .by_comment
        .iter()
        .map(|(name, texture)| Material { name: name.clone(), color: DEFAULT_COLOR, texture: *texture })
        .collect();
    parts.face_materials = faces.textures(triangles);

    let known = looks.by_comment.len() as u32;
    let mut unknown = 0;
    for material in parts.face_materials.iter_mut().filter(|m| **m >= known) {
        unknown += usize::from(*material != NO_INDEX);
        *material = NO_INDEX;
    }
    if unknown > 0 {
        let faces = count(unknown, "face");
        let textures = count(known as usize, "texture");
        warnings.push(format!("{faces} without a texture: texnumber is beyond the {textures} of the header"));
    }

    // Coordinates of corners win over coordinates of vertices.
    match uvs {
        Some((uvs, face_uvs)) => (parts.uvs, parts.face_uvs) = (uvs, face_uvs),
        None if !vertices.uvs.is_empty() => {
            parts.uvs = std::mem::take(&mut vertices.uvs);
            parts.face_uvs = triangles.faces.clone();
        }
        None => warnings.push("the header names a texture, but nothing has texture coordinates".into()),
    }
}

/// The most colours of faces that become materials. A mesh with more is not painted by object.
const MAX_FACE_COLORS: usize = 4096;

/// Gives each face a material of its colour. Faces are painted where a colour stands for an object or a
/// class, so that there are few. A mesh with many is left as it is, with a warning.
pub(crate) fn paint_faces(
    parts: &mut MeshParts,
    color_of_polygon: &[[u8; 3]],
    triangles: &PlyTriangles,
    warnings: &mut Vec<String>,
) {
    let mut index: HashMap<[u8; 3], u32> = HashMap::new();
    let mut materials = Vec::new();
    for &color in color_of_polygon {
        index.entry(color).or_insert_with(|| {
            let [r, g, b] = color;
            materials.push(Material { name: format!("color_{r:02x}{g:02x}{b:02x}"), color, texture: None });
            materials.len() as u32 - 1
        });
        if materials.len() > MAX_FACE_COLORS {
            warnings.push(format!(
                "colours of faces are not read: there are more than {MAX_FACE_COLORS} different ones; give \
                 colours to the vertices"
            ));
            return;
        }
    }

    if !materials.is_empty() {
        let colors = triangles
            .polygons
            .iter()
            .map(|&polygon| color_of_polygon.get(polygon as usize));
        let materials_of_faces = colors.map(|color| color.and_then(|c| index.get(c)).copied());
        parts.face_materials = materials_of_faces.map(|m| m.unwrap_or(NO_INDEX)).collect();
        parts.materials = materials;
    }
}
