//! Reads the base colours and textures of glTF materials, which is all that a data set keeps of them.

use crate::fs::quote::quote;
use crate::image::texture::{LoadedTexture, TextureFault, TextureFile, Together, decode_texture};
use crate::mesh::gltf::document::GltfDocument;
use crate::mesh::gltf::extensions::way_out;
use crate::mesh::gltf::words::index_of;
use gltf::json::validation::Checked;
use gltf::json::{self, Index, texture};
use rayon::prelude::*;
use s3d_geom::glam::{Vec2, vec2};
use s3d_geom::{DEFAULT_COLOR, Material, Raster, Texture, Wrap};
use std::collections::{BTreeMap, BTreeSet};

/// The materials and textures of a file.
#[derive(Debug, Default)]
pub(crate) struct GltfLooks {
    /// One for each material of the file.
    pub(crate) materials: Vec<Material>,
    /// The linear colour of each material of the file.
    pub(crate) linear_colors: Vec<[f32; 3]>,
    /// How the texture coordinates of each material of the file are mapped.
    pub(crate) mappings: Vec<UvMapping>,
    pub(crate) textures: Vec<Texture>,
    pub(crate) files: Vec<Option<TextureFile>>,
}

/// Maps a set of texture coordinates of the file to coordinates of a [`Texture`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UvMapping {
    /// The number of the set: the n of TEXCOORD_n.
    pub(crate) set: u32,
    offset: Vec2,
    rotation_rad: f32,
    scale: Vec2,
}

impl UvMapping {
    const PLAIN: Self = Self { set: 0, offset: Vec2::ZERO, rotation_rad: 0.0, scale: Vec2::ONE };

    /// Maps a coordinate of the file, whose v points down, to a coordinate of a [`Texture`], whose v points
    /// up. Source: the extension KHR_texture_transform, which scales, turns and moves.
    pub(crate) fn apply(&self, uv: Vec2) -> Vec2 {
        let (sin, cos) = libm::sincosf(self.rotation_rad);
        let s = uv * self.scale;
        let moved = vec2(cos * s.x + sin * s.y, cos * s.y - sin * s.x) + self.offset;
        vec2(moved.x, 1.0 - moved.y)
    }
}

/// Everything that makes a texture of ours: an image, how it repeats, and a factor for its colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct TextureKey {
    image: usize,
    wrap: [u8; 2],
    factor_bits: [u32; 3],
}

const WRAPS: [Wrap; 3] = [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp];

impl GltfLooks {
    /// Reads all materials, and decodes the images of the materials that are `used`, each image once.
    ///
    /// # Errors
    /// [`crate::Error::Format`] for images that are too large.
    pub(crate) fn load(
        document: &GltfDocument,
        used: &[bool],
        warnings: &mut Vec<String>,
    ) -> crate::error::Result<Self> {
        let mut looks = Self::default();
        let mut keys = Vec::new();

        for ((i, material), used) in document.root().materials.iter().enumerate().zip(used) {
            let (factor, info) = base_color(material);
            let name = material.name.clone().unwrap_or_else(|| format!("material_{i}"));
            looks.materials.push(Material {
                name: name.clone(),
                color: factor.map(srgb_from_linear),
                texture: None,
            });
            looks.linear_colors.push(factor);
            looks.mappings.push(info.map_or(UvMapping::PLAIN, mapping));
            let info = info.filter(|_| *used);
            keys.push(info.and_then(|info| match texture_key(document, info.index, factor) {
                Ok(key) => Some(key),
                Err(why) => {
                    let name = quote(name.as_bytes());
                    warnings.push(format!("material {name} is drawn in its colour: {why}"));
                    None
                }
            }));
        }

        let images = decoded_images(document, &keys, warnings)?;
        looks.add_textures(document, &keys, &images)?;
        Ok(looks)
    }

    /// Makes a texture of each key, and assigns it to its materials.
    fn add_textures(
        &mut self,
        document: &GltfDocument,
        keys: &[Option<TextureKey>],
        images: &BTreeMap<usize, DecodedImage>,
    ) -> crate::error::Result<()> {
        let mut known: BTreeMap<TextureKey, u32> = BTreeMap::new();
        let mut together = Together::default();

        for (material, key) in self.materials.iter_mut().zip(keys) {
            let Some(key) = key else { continue };
            let Some((name, Ok(loaded))) = images.get(&key.image) else { continue };
            if !known.contains_key(key) {
                together
                    .add(loaded.image.width(), loaded.image.height())
                    .map_err(|message| {
                        document.fail(format!("texture {} {message}", quote(name.as_bytes())))
                    })?;
            }

            let index = *known.entry(*key).or_insert_with(|| {
                let factor = key.factor_bits.map(f32::from_bits);
                let wrap = key
                    .wrap
                    .map(|w| WRAPS.get(usize::from(w)).copied().unwrap_or(Wrap::Repeat));
                let is_plain = factor == [1.0; 3];
                let image = if is_plain {
                    loaded.image.clone()
                } else {
                    multiplied(&loaded.image, factor)
                };
                self.textures.push(Texture { name: name.clone(), image, wrap });
                self.files.push(loaded.file.clone().filter(|_| is_plain));
                (self.textures.len() - 1) as u32
            });
            material.texture = Some(index);
        }
        Ok(())
    }
}

/// The name of an image, and the image.
type DecodedImage = (String, Result<LoadedTexture, TextureFault>);

/// Decodes the images of the keys in parallel. An image that cannot be decoded is a warning.
///
/// # Errors
/// [`crate::Error::Format`] for images that are too large.
fn decoded_images(
    document: &GltfDocument,
    keys: &[Option<TextureKey>],
    warnings: &mut Vec<String>,
) -> crate::error::Result<BTreeMap<usize, DecodedImage>> {
    let wanted: BTreeSet<usize> = keys.iter().flatten().map(|key| key.image).collect();
    let images: BTreeMap<usize, DecodedImage> = wanted
        .into_par_iter()
        .map(|image| {
            let (name, bytes) = document.image(image);
            (image, (name, bytes.map_err(TextureFault::Unreadable).and_then(decode_texture)))
        })
        .collect();

    for (name, image) in images.values() {
        let Err(why) = image else { continue };
        let name = quote(name.as_bytes());
        if let TextureFault::TooLarge(_) = why {
            return Err(document.fail(format!("texture {name} {why}")));
        }
        warnings.push(format!("texture {name} {why}; its materials are drawn in their colour"));
    }
    Ok(images)
}

/// Returns the linear base colour of a material and its texture. They come from its specular-glossiness
/// variant if it has one, as in other readers that know the extension.
fn base_color(material: &json::Material) -> ([f32; 3], Option<&texture::Info>) {
    let metallic = &material.pbr_metallic_roughness;
    let variant = material
        .extensions
        .as_ref()
        .and_then(|e| e.pbr_specular_glossiness.as_ref());
    let (factor, info) = match variant {
        Some(v) => (v.diffuse_factor.0, v.diffuse_texture.as_ref()),
        None => (metallic.base_color_factor.0, metallic.base_color_texture.as_ref()),
    };
    ([factor[0], factor[1], factor[2]].map(|f| f.clamp(0.0, 1.0)), info)
}

fn mapping(info: &texture::Info) -> UvMapping {
    let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
    transform.map_or(UvMapping { set: info.tex_coord, ..UvMapping::PLAIN }, |t| UvMapping {
        set: t.tex_coord.unwrap_or(info.tex_coord),
        offset: t.offset.0.into(),
        rotation_rad: t.rotation.0,
        scale: t.scale.0.into(),
    })
}

/// Finds the image of a texture, and how it repeats.
fn texture_key(
    document: &GltfDocument,
    index: Index<json::Texture>,
    factor: [f32; 3],
) -> Result<TextureKey, String> {
    let texture = document
        .root()
        .get(index)
        .ok_or_else(|| format!("texture {index} is not there"))?;
    let webp = texture
        .extensions
        .as_ref()
        .and_then(|e| e.others.get("EXT_texture_webp"));
    let webp = webp
        .and_then(|e| index_of(e.get("source")?))
        .map(|image| image as usize);
    let plain = Some(texture.source.value()).filter(|image| *image != u32::MAX as usize);
    let Some(image) = plain.or(webp) else {
        let only = texture.extensions.iter().flat_map(|e| e.others.keys()).next();
        let only = only.map_or_else(String::new, |name| {
            format!(", only one for the extension {name}; {}", way_out(name))
        });
        return Err(format!("texture {index} has no image that is read{only}"));
    };

    let sampler = match texture.sampler {
        Some(s) => Some(
            document
                .root()
                .get(s)
                .ok_or_else(|| format!("sampler {s} is not there"))?,
        ),
        None => None,
    };

    let wrap = sampler.map_or([0; 2], |s| [s.wrap_s, s.wrap_t].map(wrap_number));
    Ok(TextureKey { image, wrap, factor_bits: factor.map(f32::to_bits) })
}

/// Returns an index into [`WRAPS`]. Unknown modes repeat, as the format does by default.
fn wrap_number(mode: Checked<texture::WrappingMode>) -> u8 {
    match mode {
        Checked::Valid(texture::WrappingMode::MirroredRepeat) => 1,
        Checked::Valid(texture::WrappingMode::ClampToEdge) => 2,
        _ => 0,
    }
}

/// Multiplies the light of an image by `factor`: the colours are decoded for it and encoded again.
fn multiplied(image: &Raster<[u8; 3]>, factor: [f32; 3]) -> Raster<[u8; 3]> {
    let tables = factor
        .map(|f| std::array::from_fn::<u8, 256, _>(|b| srgb_from_linear(linear_from_srgb(b as u8) * f)));
    image.map(|rgb| {
        let [r, g, b] = rgb.map(usize::from);
        #[expect(clippy::indexing_slicing, reason = "a table has an entry for each byte")]
        [tables[0][r], tables[1][g], tables[2][b]]
    })
}

/// Encodes light from 0 to 1 as an sRGB byte. NaN is black. Source: IEC 61966-2-1.
pub(crate) fn srgb_from_linear(light: f32) -> u8 {
    let light = f64::from(light.clamp(0.0, 1.0));
    let encoded = if light <= 0.003_130_8 {
        12.92 * light
    } else {
        1.055 * libm::pow(light, 1.0 / 2.4) - 0.055
    };
    (encoded * 255.0).round() as u8
}

/// Decodes an sRGB byte to light from 0 to 1.
pub(crate) fn linear_from_srgb(byte: u8) -> f32 {
    let encoded = f64::from(byte) / 255.0;
    (if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        libm::pow((encoded + 0.055) / 1.055, 2.4)
    }) as f32
}

/// The linear colour of a material that the file does not describe: [`DEFAULT_COLOR`].
pub(crate) fn default_linear() -> [f32; 3] {
    DEFAULT_COLOR.map(linear_from_srgb)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_is_undone_for_every_byte() {
        for byte in 0..=255 {
            assert_eq!(srgb_from_linear(linear_from_srgb(byte)), byte);
        }
        assert_eq!(srgb_from_linear(0.5), 188);
        assert_eq!((srgb_from_linear(f32::NAN), srgb_from_linear(7.0)), (0, 255));
        assert_eq!(default_linear().map(srgb_from_linear), DEFAULT_COLOR);
    }

    #[test]
    fn factors_multiply_light() {
        let image = Raster::from_vec(1, 1, vec![[255, 188, 0]]);
        assert_eq!(multiplied(&image, [0.5, 1.0, 0.3]).into_vec(), [[188, 188, 0]]);
    }

    #[test]
    fn v_points_up_and_transforms_follow_the_extension() {
        assert_eq!(UvMapping::PLAIN.apply(vec2(0.25, 0.0)), vec2(0.25, 1.0));
        let m = UvMapping { offset: vec2(0.5, 0.25), scale: vec2(2.0, 4.0), ..UvMapping::PLAIN };
        assert_eq!(m.apply(vec2(0.1, 0.1)), vec2(0.7, 1.0 - 0.65));
        // A quarter turn. The matrix of the extension, with v down, takes u to −v and v to u.
        let m = UvMapping { rotation_rad: std::f32::consts::FRAC_PI_2, ..UvMapping::PLAIN };
        assert!(m.apply(vec2(1.0, 0.0)).abs_diff_eq(vec2(0.0, 2.0), 1e-6));
        assert!(m.apply(vec2(0.0, 1.0)).abs_diff_eq(vec2(1.0, 1.0), 1e-6));
    }
}
