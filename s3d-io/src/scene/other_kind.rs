//! Files that users give in place of a scene file.

use crate::mesh::MeshFormat;
use std::path::Path;

/// The explanation of a scene, for users who give something else.
pub(crate) const SCENE: &str = "a scene is a text file, scene.toml, that names the parts of a scan: `area = \
                                1`, `[mesh]` with `path = \"scan.obj\"`, `[annotations]` with a path, \
                                `[cameras]` with a path or `place = 2.0`, each on a line";

/// Returns what a file is that is given in place of a scene, by its extension; `None` if it may be a scene.
pub(crate) fn other_kind(path: &Path) -> Option<&'static str> {
    let of_mesh = MeshFormat::of(path).map(|_| "a mesh, not a scene");
    Some(match path.extension()?.to_string_lossy().to_ascii_lowercase().as_str() {
        "stl" | "fbx" | "dae" | "off" | "usd" | "usdz" => {
            "a mesh in a format that is not read (OBJ, glTF and PLY are), not a scene"
        }
        "ply" => "a mesh or a cloud, not a scene",
        "las" | "laz" | "e57" | "npy" | "npz" | "mat" | "pcd" | "pts" | "ptx" | "asc" | "xyz" | "label" => {
            "a cloud of points, not a scene"
        }
        "mtl" | "png" | "jpg" | "jpeg" => "a part of a mesh, not a scene",
        "csv" => "a table, not a scene",
        "json" => "JSON, not a scene",
        _ => return of_mesh,
    })
}
