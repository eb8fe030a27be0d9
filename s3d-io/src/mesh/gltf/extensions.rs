//! Decides about extensions of glTF: which are read, which change nothing that is read, and for which a file
//! is refused.
//!
//! A file may be read without an extension that it does not require. That does not help if the extension
//! holds the geometry. Such an object is refused by the name of the extension, whatever the file requires.

use crate::error::{Error, Result};
use crate::mesh::gltf::document::GltfDocument;
use serde_json::{Map, Value};
use std::path::Path;

/// The extensions that are read, or change nothing that is read. [`HARMLESS_FAMILIES`] has more.
const HARMLESS: &[&str] = &[
    // Read.
    #[cfg(feature = "draco")]
    DRACO,
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "EXT_texture_webp",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_node_visibility",
    "KHR_texture_transform",
    "MSFT_lod",
    // Anything that is not drawn, or not now: animation, physics, light, sound, the mouse.
    "AGI_articulations",
    "AGI_stk_metadata",
    "EXT_lights_ies",
    "EXT_lights_image_based",
    "KHR_animation_pointer",
    "KHR_implicit_shapes",
    "KHR_interactivity",
    "KHR_lights_punctual",
    "KHR_node_hoverability",
    "KHR_node_selectability",
    // Anything that describes the geometry without changing it.
    "CESIUM_primitive_outline",
    "EXT_instance_features",
    "EXT_mesh_features",
    "EXT_mesh_manifold",
    "EXT_mesh_primitive_edge_visibility",
    "EXT_structural_metadata",
    "FB_geometry_metadata",
    "FB_ngon_encoding",
    "GODOT_single_root",
];

/// The prefixes of extensions that change reflections and transparency, describe the file, or are about
/// sound, physics and avatars.
const HARMLESS_FAMILIES: [&str; 6] =
    ["KHR_materials_", "KHR_xmp", "KHR_audio_", "KHR_physics_", "OMI_physics_", "VRM"];

/// The extension that compresses primitives. A plain form may be beside it, which is read if it is there.
pub(crate) const DRACO: &str = "KHR_draco_mesh_compression";

/// The extensions that compress buffer views.
pub(crate) const MESHOPT: [&str; 2] = ["KHR_meshopt_compression", "EXT_meshopt_compression"];

/// The extensions that add, replace or move geometry, so an object that has one is not what it seems.
const GEOMETRY: [&str; 6] = [
    "CESIUM_RTC",
    "EXT_mesh_primitive_restart",
    "EXT_primitive_voxels",
    "MPEG_accessor_timed",
    "MPEG_mesh_linking",
    "NEEDLE_progressive",
];

/// What the user can do about an extension that is not read.
const WAYS_OUT: [(&str, &str); 6] = [
    (DRACO, "export without Draco compression, or run `gltf-transform copy in.glb out.glb`"),
    (
        "KHR_texture_basisu",
        "export PNG or JPEG textures instead of KTX2, or run `gltf-transform ktxdecompress in.glb out.glb`",
    ),
    ("EXT_texture_avif", "export PNG or JPEG textures, or run `gltf-transform png in.glb out.glb`"),
    ("CESIUM_RTC", "add its centre to the translation of the outermost nodes"),
    ("EXT_mesh_primitive_restart", "export lists of triangles, not strips"),
    ("NEEDLE_progressive", "export the full mesh: the file holds a coarse one"),
];

/// Returns whether the extension changes nothing that is read.
fn is_harmless(extension: &str) -> bool {
    HARMLESS.contains(&extension) || HARMLESS_FAMILIES.iter().any(|family| extension.starts_with(family))
}

/// Refuses a file that requires an extension which is not read.
pub(crate) fn check_required(path: &Path, required: &[String]) -> Result<()> {
    let Some(extension) = required.iter().find(|e| !is_harmless(e)) else { return Ok(()) };
    let way_out = way_out(extension);
    Err(Error::unsupported(path, format!("requires the extension {extension}, which is not read; {way_out}")))
}

/// Returns what the user can do about an extension that is not read.
pub(crate) fn way_out(extension: &str) -> &'static str {
    WAYS_OUT
        .iter()
        .find(|(name, _)| *name == extension)
        .map_or("export without it", |(_, way)| *way)
}

impl GltfDocument {
    /// Refuses an object whose geometry is changed by its extensions. `who` is for the message: "node 3".
    /// Adds unfamiliar extensions to `unknown`.
    pub(crate) fn check_extensions(
        &self,
        extensions: Option<&Map<String, Value>>,
        who: &str,
        unknown: &mut Vec<String>,
    ) -> Result<()> {
        for extension in extensions.into_iter().flat_map(Map::keys) {
            if GEOMETRY.contains(&extension.as_str()) {
                let way_out = way_out(extension);
                return Err(Error::unsupported(
                    self.path(),
                    format!(
                        "{who} has the extension {extension}, which changes its geometry and is not read; \
                         {way_out}"
                    ),
                ));
            }
            let is_known = is_harmless(extension) || extension == DRACO;
            if !is_known && !unknown.contains(extension) {
                unknown.push(extension.clone());
            }
        }
        Ok(())
    }
}
