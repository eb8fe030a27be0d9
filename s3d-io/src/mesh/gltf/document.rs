//! Reads the parts of a glTF file: its JSON, its buffers and the bytes of its images.
//!
//! gltf's own import finds buffers and data URIs too. But it brings a second base64 decoder and decodes every
//! image, wanted or not. [`GltfDocument::resource`] does what is needed of it.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::{Error, Result};
use crate::fs::encoding::into_utf8;
use crate::fs::open::read_file;
use crate::fs::quote::quote;
use crate::mesh::gltf::container::{check_version, split_glb};
use crate::mesh::gltf::extensions::{MESHOPT, check_required};
use crate::mesh::gltf::tolerant::needed;
use crate::mesh::gltf::uri::{percent_decode, stays_inside};
use crate::mesh::gltf::words::{FeatureAttributes, NodeWords, schema_uri};
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json;
use s3d_geom::glam::DVec3;
use serde::Deserialize;
use std::collections::HashMap;
use std::fs;
use std::mem;
use std::path::{Path, PathBuf};

/// A glTF file with its buffers in memory.
#[derive(Debug)]
pub(crate) struct GltfDocument {
    path: PathBuf,
    /// The JSON. Its indices are not checked.
    pub(crate) json: gltf::Document,
    buffers: Vec<Vec<u8>>,
    /// Why views cannot be unpacked: a sentence that follows the name of the view.
    pub(crate) view_faults: HashMap<usize, String>,
    /// The nodes in `f64`, if any is far from its parent's origin. Otherwise empty.
    exact_nodes: Vec<ExactNode>,
    /// The names of the nodes, and what their authors added.
    words: Vec<NodeWords>,
    feature_attributes: FeatureAttributes,
}

/// The part of the JSON that is read before all of it.
#[derive(Deserialize)]
struct Head {
    #[serde(default)]
    asset: serde_json::Value,
    #[serde(default, rename = "extensionsRequired")]
    required: Vec<String>,
}

/// The position of a node, in `f64`.
#[derive(Debug, Default, Deserialize)]
struct ExactNode {
    #[serde(default)]
    translation: Option<[f64; 3]>,
    #[serde(default)]
    matrix: Option<[f64; 16]>,
}

/// Reads the nodes in `f64`, if any is so far from its parent's origin that `f32` loses digits of its
/// position. Otherwise returns none.
fn exact_nodes(root: &json::Root, text: &[u8]) -> Vec<ExactNode> {
    #[derive(Deserialize)]
    struct Nodes {
        nodes: Vec<ExactNode>,
    }
    if !root.nodes.iter().any(is_far) {
        return Vec::new();
    }
    serde_json::from_slice(text).map_or_else(|_| Vec::new(), |all: Nodes| all.nodes)
}

fn is_far(node: &json::Node) -> bool {
    let position = node.translation.or(node.matrix.map(|m| [m[12], m[13], m[14]]));
    position.is_some_and(|position| position.iter().any(|v| v.abs() > 1000.0))
}

impl GltfDocument {
    #[cfg(test)]
    pub(crate) fn open(path: &Path) -> Result<Self> {
        Self::read(read_file(path)?, path, false)
    }

    /// Reads a `.gltf` or `.glb` file, and its buffers, which lie beside `path`. The content tells which of
    /// the two it is. Files outside the folder of `path` are refused unless `outside_files`.
    pub(crate) fn read(bytes: Vec<u8>, path: &Path, outside_files: bool) -> Result<Self> {
        let mut bytes = into_utf8(bytes);
        let (text, blob) = if bytes.starts_with(b"glTF") {
            split_glb(path, &bytes)?
        } else {
            (&bytes[..], None)
        };

        let is_text = blob.is_none() && !bytes.starts_with(b"glTF");
        let head: Head = serde_json::from_slice(text).map_err(|e| invalid_json(path, is_text, &e))?;
        check_version(path, &head.asset)?;
        check_required(path, &head.required)?;
        let mut root = root_of(text).map_err(|e| invalid_json(path, is_text, &e))?;
        for accessor in &mut root.accessors {
            // A sparse part without changes is the same as none, which the gltf crate can read.
            accessor.sparse.take_if(|sparse| sparse.count.0 == 0);
        }

        let exact_nodes = exact_nodes(&root, text);
        let feature_attributes = FeatureAttributes::of_document(&root, text);
        let json = gltf::Document::from_json_without_validation(root);
        let words = NodeWords::of_document(text);
        let mut document = Self {
            path: path.to_owned(),
            json,
            buffers: Vec::new(),
            view_faults: HashMap::new(),
            exact_nodes,
            words,
            feature_attributes,
        };
        if !outside_files {
            document.refuse_outside_files()?;
        }

        // The binary chunk stays in the memory of the file, since it is most of the file.
        let blob = blob.map(|blob| {
            bytes.truncate(blob.end);
            bytes.drain(..blob.start);
            bytes
        });
        document.buffers = document.load_buffers(blob)?;
        document.unpack()?;
        Ok(document)
    }

    /// Changes the JSON and the buffers.
    pub(crate) fn edit(&mut self, change: impl FnOnce(&mut json::Root, &mut Vec<Vec<u8>>)) {
        let nothing = gltf::Document::from_json_without_validation(json::Root::default());
        let mut root = mem::replace(&mut self.json, nothing).into_json();
        change(&mut root, &mut self.buffers);
        self.json = gltf::Document::from_json_without_validation(root);
    }

    /// Returns the path of the file.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the JSON. Its indices are not checked; [`GltfDocument::get`] checks them.
    pub(crate) fn root(&self) -> &json::Root {
        self.json.as_json()
    }

    /// Returns the position of a node in its parent's frame, in `f64`. Returns `None` if
    /// [`GltfDocument::root`] is as exact.
    pub(crate) fn exact_place(&self, node: usize) -> Option<DVec3> {
        let node = self.exact_nodes.get(node)?;
        let of_matrix = node.matrix.map(|m| [m[12], m[13], m[14]]);
        of_matrix.or(node.translation).map(DVec3::from_array)
    }

    /// Returns what each node says of itself. There may be fewer of them than nodes.
    pub(crate) fn words(&self) -> &[NodeWords] {
        &self.words
    }

    /// Returns the attributes that hold feature ids.
    pub(crate) fn feature_attributes(&self) -> &FeatureAttributes {
        &self.feature_attributes
    }

    /// Returns the bytes of a buffer.
    pub(crate) fn buffer(&self, index: usize) -> Option<&[u8]> {
        self.buffers.get(index).map(Vec::as_slice)
    }

    /// Makes an error about this file.
    pub(crate) fn fail(&self, message: impl Into<String>) -> Error {
        Error::format(&self.path, message)
    }

    /// Returns the object at `index`. `who` and `what` are for the message: "mesh 3", "accessor".
    pub(crate) fn get<T>(&self, index: json::Index<T>, who: &str, what: &str) -> Result<&T>
    where
        json::Root: json::root::Get<T>,
    {
        self.root()
            .get(index)
            .ok_or_else(|| self.fail(format!("{who} points to {what} {index}, which is not there")))
    }

    /// Returns the bytes of a buffer view.
    pub(crate) fn view(&self, index: json::Index<json::buffer::View>, who: &str) -> Result<&[u8]> {
        let view = self.get(index, who, "buffer view")?;
        if let Some(why) = self.view_faults.get(&index.value()) {
            return Err(self.fail(format!("{who}: buffer view {index} {why}")));
        }
        self.get(view.buffer, &format!("buffer view {index}"), "buffer")?;
        let buffer = self.buffer(view.buffer.value()).unwrap_or_default();
        let start = view.byte_offset.map_or(0, |o| o.0);
        let range = usize::try_from(start).ok().zip(start.checked_add(view.byte_length.0));
        range
            .and_then(|(start, end)| buffer.get(start..usize::try_from(end).ok()?))
            .ok_or_else(|| {
                self.fail(format!(
                    "buffer view {index} takes {} bytes from {start}, but buffer {} has {}",
                    view.byte_length.0,
                    view.buffer,
                    buffer.len()
                ))
            })
    }

    /// Returns a name for an image, and its encoded bytes.
    ///
    /// # Errors
    /// The error of the bytes is a sentence that follows the image's name. A missing image does not stop the
    /// mesh.
    pub(crate) fn image(&self, image: usize) -> (String, std::result::Result<Vec<u8>, String>) {
        let Some(json) = self.root().images.get(image) else {
            return (format!("image {image}"), Err("is not there".into()));
        };
        let uri = json.uri.as_deref().filter(|uri| !uri.starts_with("data:"));
        let name = match (uri, &json.name) {
            (Some(uri), _) => percent_decode(uri).rsplit('/').next().unwrap_or_default().to_owned(),
            (None, Some(name)) => name.clone(),
            (None, None) => format!("image_{image}"),
        };

        let bytes = match (json.buffer_view, &json.uri) {
            (Some(view), _) => self
                .view(view, &format!("image {image}"))
                .map(<[u8]>::to_vec)
                .map_err(|e| e.to_string()),
            (None, Some(uri)) => self.resource(uri),
            (None, None) => Err("has neither a URI nor a buffer view".into()),
        };
        (name, bytes)
    }

    /// Reads all buffers. `blob` is the binary chunk of a `.glb`.
    fn load_buffers(&self, mut blob: Option<Vec<u8>>) -> Result<Vec<Vec<u8>>> {
        let mut buffers = Vec::new();
        for (i, json) in self.root().buffers.iter().enumerate() {
            let may_be_blob = i == 0 && json.uri.is_none();
            if is_fallback(json) {
                // Its views are unpacked from others.
                buffers.push(Vec::new());
                continue;
            }

            let bytes = match (&json.uri, blob.take_if(|_| may_be_blob)) {
                (Some(uri), _) => self.resource(uri).map_err(|why| {
                    let name = if uri.starts_with("data:") { "the data URI" } else { uri };
                    self.fail(format!("buffer {i}: {name} {why}"))
                })?,
                (None, Some(blob)) => blob,
                (None, _) => {
                    return Err(self.fail(format!("buffer {i} has neither a URI nor a chunk of a .glb")));
                }
            };

            if (bytes.len() as u64) < json.byte_length.0 {
                let is = bytes.len();
                let should = json.byte_length.0;
                return Err(
                    self.fail(format!("buffer {i} should have {should} bytes and has {is}; it is cut off"))
                );
            }
            buffers.push(bytes);
        }
        Ok(buffers)
    }

    /// Returns the path of the file that a URI names.
    fn beside(&self, uri: &str) -> PathBuf {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        // Some exporters do not escape URIs.
        let written = folder.join(uri);
        if fs::exists(&written).unwrap_or(false) {
            written
        } else {
            folder.join(percent_decode(uri).as_ref())
        }
    }

    /// Returns the files of its buffers, images and metadata, if they exist.
    pub(crate) fn companions(&self) -> Vec<PathBuf> {
        self.file_uris()
            .map(|uri| self.beside(uri))
            .filter(|path| path.is_file())
            .collect()
    }

    /// Returns the URIs of buffers, images and metadata that name files.
    fn file_uris(&self) -> impl Iterator<Item = &str> {
        let buffers = self.root().buffers.iter().filter_map(|b| b.uri.as_deref());
        let images = self.root().images.iter().filter_map(|i| i.uri.as_deref());
        let all = buffers.chain(images).chain(schema_uri(self.root()));
        all.filter(|uri| !uri.starts_with("data:") && !uri.contains("://"))
    }

    /// Refuses a document that names an existing file outside its folder. A link in the folder may lead
    /// anywhere, since only the owner of the folder makes one. A file that does not exist is only missing.
    fn refuse_outside_files(&self) -> Result<()> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        for uri in self.file_uris() {
            let path = self.beside(uri);
            let is_inside = path.strip_prefix(folder).is_ok_and(stays_inside);
            if !is_inside && path.exists() {
                return Err(self.fail(format!(
                    "names {}, which is outside its folder: put the file, or a link to it, into the folder \
                     and change the name, or allow such files with outside_files = true under [mesh] of a \
                     scene.toml",
                    quote(uri.as_bytes())
                )));
            }
        }
        Ok(())
    }

    /// Returns the bytes that a URI names: the data in it, or the file beside this one.
    pub(crate) fn resource(&self, uri: &str) -> std::result::Result<Vec<u8>, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (kind, data) = data.split_once(',').ok_or("has no data")?;
            if !kind.ends_with(";base64") {
                return Ok(percent_decode(data).into_owned().into_bytes());
            }
            let config = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
            return GeneralPurpose::new(&STANDARD, config)
                .decode(data)
                .map_err(|e| format!("is no base64: {e}"));
        }

        if uri.contains("://") {
            return Err("is on the network; only files beside the mesh are read".into());
        }

        let path = self.beside(uri);
        read_file(&path).map_err(|e| match e {
            Error::Io { source, .. } => {
                format!("cannot be read ({source}); it belongs at {}", path.display())
            }
            other => other.to_string(),
        })
    }
}

/// Returns whether a buffer only stands for data that meshopt compresses.
fn is_fallback(buffer: &json::Buffer) -> bool {
    let extensions = buffer.extensions.as_ref().map(|e| &e.others);
    MESHOPT.into_iter().any(|name| {
        let extension = extensions.and_then(|e| e.get(name));
        extension.and_then(|e| e.get("fallback")) == Some(&true.into())
    })
}

/// Reads the JSON. If the types of the gltf crate do not fit all of it, only the parts that are needed are
/// read.
fn root_of(text: &[u8]) -> std::result::Result<json::Root, serde_json::Error> {
    json::Root::from_slice(text).or_else(|first| {
        let document = serde_json::from_slice(text)?;
        // The parts are read from text again. gltf-json has compiled how its types are read from text; to
        // read them from a `Value`, all of that would be compiled once more.
        json::Root::from_slice(needed(document).to_string().as_bytes()).map_err(|second| {
            let known = without_place(&first);
            let fault = without_place(&second);
            // The first error has the place of the fault in the file, the second one in the rewritten text.
            if known == fault {
                first
            } else {
                serde::de::Error::custom(fault)
            }
        })
    })
}

/// Returns the message of an error without its place.
fn without_place(error: &serde_json::Error) -> String {
    let message = error.to_string();
    let place = format!(" at line {} column {}", error.line(), error.column());
    message.strip_suffix(&place).unwrap_or(&message).to_owned()
}

/// Makes the error for JSON that cannot be read, with its line if the file is text.
fn invalid_json(path: &Path, is_text: bool, e: &serde_json::Error) -> Error {
    if !is_text {
        return Error::format(path, format!("its JSON is no valid glTF 2.0: {e}"));
    }
    let message = format!("is no valid glTF 2.0: {e}");
    match e.line() {
        0 => Error::format(path, message),
        line => Error::line(path, line as u64, message),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(name: &str, bytes: &[u8]) -> Result<GltfDocument> {
        let dir = tempfile::tempdir().unwrap();
        fs::write(dir.path().join("two words.bin"), [1, 2, 3, 4]).unwrap();
        let path = dir.path().join(name);
        fs::write(&path, bytes).unwrap();
        GltfDocument::open(&path)
    }

    fn error(json: &str) -> String {
        open("a.gltf", json.as_bytes()).unwrap_err().to_string()
    }

    fn glb(version: u32, json: &str, bin: &[u8]) -> Vec<u8> {
        let mut out = b"glTF".to_vec();
        for word in [version, 0, json.len() as u32] {
            out.extend(word.to_le_bytes());
        }
        out.extend(b"JSON");
        out.extend(json.bytes());
        out.extend((bin.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bin);
        out
    }

    #[test]
    fn buffers_come_from_uris_files_and_the_chunk() {
        let json = r#"{"asset": {"version": "2.0"}, "buffers": [
            {"byteLength": 3, "uri": "data:application/octet-stream;base64,BQYH"},
            {"byteLength": 4, "uri": "two%20words.bin"}, {"byteLength": 1, "uri": "data:,%41"}]}"#;
        let document = open("a.gltf", json.as_bytes()).unwrap();
        assert_eq!(document.buffers, [vec![5, 6, 7], vec![1, 2, 3, 4], vec![65]]);
        let json = r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 2}]}"#;
        assert_eq!(open("a.glb", &glb(2, json, &[8, 9])).unwrap().buffers, [vec![8, 9]]);
    }

    #[test]
    fn views_stay_inside_their_buffer() {
        let json = r#"{"asset": {"version": "2.0"},
            "buffers": [{"byteLength": 3, "uri": "data:;base64,BQYH"}],
            "bufferViews": [{"buffer": 0, "byteOffset": 1, "byteLength": 2}, {"buffer": 0, "byteLength": 4},
            {"buffer": 0, "byteOffset": 18446744073709551615, "byteLength": 2},
            {"buffer": 7, "byteLength": 1}]}"#;
        let document = open("a.gltf", json.as_bytes()).unwrap();
        assert_eq!(document.view(json::Index::new(0), "x").unwrap(), [6, 7]);
        for (view, words) in [
            (1, "takes 4 bytes from 0, but buffer 0 has 3"),
            (2, "takes 2"),
            (3, "buffer 7"),
            (4, "buffer view 4"),
        ] {
            let message = document.view(json::Index::new(view), "x").unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }

    #[test]
    fn what_is_not_read_is_refused_by_name() {
        let required =
            |e: &str| error(&format!(r#"{{"asset": {{"version": "2.0"}}, "extensionsRequired": ["{e}"]}}"#));
        assert!(required("KHR_texture_basisu").contains("instead of KTX2"));
        assert!(required("XYZ_thing").contains("XYZ_thing, which is not read"));
        assert!(error(r#"{"asset": {"version": "1.0"}, "meshes": {}}"#).contains("is glTF 1.0"));
        assert!(
            error(r#"{"asset": {"version": "2.1", "minVersion": "2.1"}}"#).contains("reader of glTF `2.1`")
        );
        assert!(error("{}").contains("asset.version is missing"));
        assert!(error("{\n\"asset\": ]").contains("line 2"));
        let harmless = r#"{"asset": {"version": "2.0"}, "extensionsRequired": ["KHR_materials_unlit"]}"#;
        assert!(open("a.gltf", harmless.as_bytes()).is_ok());
    }

    #[test]
    fn files_outside_the_folder_are_refused_unless_allowed() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("scan");
        fs::create_dir_all(folder.join("parts")).unwrap();
        let secret = dir.path().join("secret");
        fs::write(&secret, [1, 2, 3, 4]).unwrap();
        fs::write(folder.join("own.bin"), [5, 6, 7, 8]).unwrap();

        let path = folder.join("a.gltf");
        let read = |kind: &str, uri: &str, outside_files| {
            let json = format!(
                r#"{{"asset": {{"version": "2.0"}}, "{kind}": [{{"byteLength": 4, "uri": "{uri}"}}]}}"#
            );
            GltfDocument::read(json.into_bytes(), &path, outside_files)
        };

        let absolute = secret.to_str().unwrap().replace('\\', "/");
        for uri in ["../secret", "%2e%2e/secret", "parts/../../secret", "./../secret", &absolute] {
            for kind in ["buffers", "images"] {
                let message = read(kind, uri, false).unwrap_err().to_string();
                for part in ["a.gltf", uri, "outside_files = true"] {
                    assert!(message.contains(part), "{message}");
                }
                assert!(read(kind, uri, true).is_ok());
            }
        }

        assert_eq!(read("buffers", "parts/../own.bin", false).unwrap().buffers, [[5, 6, 7, 8]]);
        // What does not exist is missing, as an image of another computer is.
        assert!(read("images", "../gone.png", false).is_ok());
        assert!(read("images", &format!("{absolute}-gone.png"), false).is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_the_folder_may_lead_out() {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("scan");
        fs::create_dir(&folder).unwrap();
        fs::write(dir.path().join("other"), [1, 2]).unwrap();
        std::os::unix::fs::symlink("../other", folder.join("link.bin")).unwrap();
        let json = r#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 2, "uri": "link.bin"}]}"#;
        let document = GltfDocument::read(json.into(), &folder.join("a.gltf"), false);
        assert_eq!(document.unwrap().buffers, [[1, 2]]);
    }

    fn buffer_error(b: &str) -> String {
        error(&format!(r#"{{"asset": {{"version": "2.0"}}, "buffers": [{{"byteLength": 9, {b}}}]}}"#))
    }

    #[test]
    fn broken_containers_are_refused() {
        let whole = glb(2, r#"{"asset": {"version": "2.0"}}"#, &[1, 2, 3]);
        for length in [4, 8, 15, 19, 30, whole.len() - 1] {
            let message = open("a.glb", &whole[..length]).unwrap_err().to_string();
            assert!(message.contains("cut off") || message.contains("JSON chunk"), "{length}: {message}");
        }
        assert!(
            open("a.glb", &glb(1, "{}", &[]))
                .unwrap_err()
                .to_string()
                .contains("glTF 1.0")
        );
        assert!(buffer_error(r#""uri": "gone.bin""#).contains("gone.bin cannot be read"));
        assert!(buffer_error(r#""uri": "https://a.b/c.bin""#).contains("on the network"));
        assert!(buffer_error(r#""uri": "data:;base64,!!""#).contains("no base64"));
        assert!(buffer_error(r#""uri": "two%20words.bin""#).contains("should have 9 bytes and has 4"));
        assert!(buffer_error(r#""name": "x""#).contains("neither"));
    }
}
