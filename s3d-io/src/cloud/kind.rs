//! Chooses the reader of a cloud: by the first bytes of the file, or else by its name.

use crate::cloud::annotations::AnnotationOptions;
use crate::cloud::table::cloud::Cloud;
use crate::cloud::table::wanted::Wanted;
use crate::error::{Error, Result};
use crate::fs::source::Source;
use std::io::Read;
use std::path::{Path, PathBuf};

/// The first bytes that are looked at.
const HEAD: u64 = 4096;

/// All kinds of files that are read, for messages.
const ALL: &str = "an S3DIS tree (a folder), .ply, .npy, .npz, .las, .laz, .e57, .pcd, text (.asc, .xyz, \
                   .txt, .csv, .pts, .ptx), SemanticKITTI's .label, a folder of Pointcept's arrays, or \
                   ScanNet's .aggregation.json";

/// Opens a cloud: a file, or a folder that holds one.
pub(crate) fn open_cloud<'a>(path: &Path, options: &'a AnnotationOptions) -> Result<Box<dyn Cloud + 'a>> {
    let what = std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?;
    let name = path
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();

    if what.is_dir() && is_kitti(path) {
        return Err(Error::unsupported(
            path,
            "is a sequence of SemanticKITTI, whose scans are in frames of their own: name one of them, as in \
             labels/000000.label",
        ));
    }
    if what.is_dir() || name.ends_with(".aggregation.json") {
        #[cfg(feature = "scannet")]
        return Ok(Box::new(crate::cloud::scannet::ScannetCloud::open(path)?));
        #[cfg(not(feature = "scannet"))]
        return Err(Error::not_built_in(path, "scannet"));
    }
    table(Source::file(path), options.into())
}

/// Opens a table of points in one file.
#[cfg_attr(
    not(any(
        feature = "ply",
        feature = "npy",
        feature = "las",
        feature = "e57",
        feature = "pcd",
        feature = "text",
        feature = "kitti"
    )),
    allow(unused_variables)
)]
pub(crate) fn table(source: Source, wanted: Wanted<'_>) -> Result<Box<dyn Cloud + '_>> {
    let head = head_of(&source)?;
    let path = source.name().to_owned();
    let ending = path
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();
    let kind = kind_of_content(&head).unwrap_or(match ending.as_str() {
        "laz" => "las",
        "asc" | "xyz" | "txt" | "csv" | "pts" | "ptx" => "text",
        "bin" | "label" => "kitti",
        other => other,
    });

    match kind {
        #[cfg(feature = "ply")]
        "ply" => Ok(Box::new(crate::cloud::ply::read::PlyCloud::new(source, wanted))),
        #[cfg(feature = "npy")]
        "npy" | "npz" => Ok(Box::new(crate::cloud::npy::read::NpyCloud::new(source, kind == "npz", wanted))),
        #[cfg(feature = "las")]
        "las" => Ok(Box::new(crate::cloud::las::read::LasCloud::new(source, wanted))),
        #[cfg(feature = "e57")]
        "e57" => Ok(Box::new(crate::cloud::e57::E57Cloud::new(source, wanted))),
        #[cfg(feature = "pcd")]
        "pcd" => Ok(Box::new(crate::cloud::pcd::read::PcdCloud::new(source, wanted))),
        #[cfg(feature = "text")]
        "text" => Ok(Box::new(crate::cloud::text::read::TextCloud::new(source, wanted))),
        #[cfg(feature = "text")]
        _ if is_unknown(kind) && crate::cloud::text::is_rows(&head) => {
            Ok(Box::new(crate::cloud::text::read::TextCloud::new(source, wanted)))
        }
        #[cfg(feature = "kitti")]
        "kitti" if let Some(options) = wanted.annotations() => {
            Ok(Box::new(crate::cloud::kitti::KittiCloud::open(&source, options)?))
        }
        _ => match feature_of(kind) {
            Some(feature) => Err(Error::not_built_in(&path, feature)),
            None => Err(unknown(&path, &head)),
        },
    }
}

/// The feature that reads clouds of this kind.
fn feature_of(kind: &str) -> Option<&'static str> {
    match kind {
        "npz" => Some("npy"),
        _ => ["ply", "npy", "las", "e57", "pcd", "text", "kitti"]
            .into_iter()
            .find(|feature| *feature == kind),
    }
}

#[cfg(feature = "text")]
fn is_unknown(kind: &str) -> bool {
    feature_of(kind).is_none()
}

/// The first bytes of a file.
fn head_of(source: &Source) -> Result<Vec<u8>> {
    let mut head = Vec::new();
    source
        .open()?
        .0
        .take(HEAD)
        .read_to_end(&mut head)
        .map_err(|e| Error::io(source.name(), "read", e))?;
    Ok(head)
}

/// The kind of cloud that begins with these bytes, if they tell.
pub(crate) fn kind_of_content(head: &[u8]) -> Option<&'static str> {
    let begins = [
        (&b"ply\n"[..], "ply"),
        (b"ply\r", "ply"),
        (b"\x93NUMPY", "npy"),
        (b"PK\x03\x04", "npz"),
        (b"LASF", "las"),
        (b"ASTM-E57", "e57"),
        (b"# .PCD", "pcd"),
    ];
    let magic = begins.iter().find(|(magic, _)| head.starts_with(magic));
    magic.map(|(_, kind)| *kind).or_else(|| {
        // A PCD without its comment. The columns of a text may be called anything, but not so.
        let line = head
            .split(|b| *b == b'\n')
            .map(<[u8]>::trim_ascii)
            .find(|line| !line.is_empty() && !line.starts_with(b"#"))?;
        let is_pcd = line.starts_with(b"VERSION ") || line.starts_with(b"FIELDS ");
        is_pcd.then_some("pcd")
    })
}

/// The error for a file of no known kind, which says what it is if its first bytes tell.
fn unknown(path: &Path, head: &[u8]) -> Error {
    let others = [
        (&b"\x89HDF"[..], "HDF5: MATLAB's files are read if they end in .mat"),
        (b"MATLAB 5.0", "a MAT-file before v7.3: save(…, '-v7.3') writes one that is read, as .mat"),
        (b"\x1f\x8b", "compressed by gzip: unpack it first"),
        (b"\x28\xb5\x2f\xfd", "compressed by zstd: unpack it first"),
        (b"PAR1", "Parquet: save its columns as .npy, .ply or text"),
        (b"DRACO", "points that Draco compressed: draco_decoder writes them as .ply"),
        (b"glTF", "a mesh, glTF: the labels of the scene's own mesh are taken with mesh = true"),
        (b"\x89PNG", "a picture"),
        (b"\xff\xd8\xff", "a picture"),
        (b"{", "JSON"),
    ];
    let what = others
        .iter()
        .find(|(magic, _)| head.starts_with(magic))
        .map_or_else(String::new, |(_, what)| format!(" (it is {what})"));
    Error::unsupported(path, format!("is no kind of annotations that is read{what}: {ALL}"))
}

/// The file that makes a folder one of Pointcept's.
const COORDINATES: &str = "coord.npy";

/// Opens the folders of Pointcept's arrays: `dir`, or those in it, in the order of their names. Returns none
/// if they are no such folders.
pub(crate) fn open_arrays<'a>(
    dir: &Path,
    options: &'a AnnotationOptions,
) -> Result<Vec<Box<dyn Cloud + 'a>>> {
    let mut folders = Vec::new();
    if dir.join(COORDINATES).is_file() {
        folders.push(dir.to_owned());
    } else {
        let entries = std::fs::read_dir(dir).map_err(|e| Error::io(dir, "read", e))?;
        let inner = entries.flatten().map(|entry| entry.path());
        folders.extend(inner.filter(|path| path.join(COORDINATES).is_file()));
        folders.sort();
    }
    clouds_of(folders, options)
}

#[cfg(feature = "npy")]
fn clouds_of(folders: Vec<PathBuf>, options: &AnnotationOptions) -> Result<Vec<Box<dyn Cloud + '_>>> {
    use crate::cloud::npy::folder::NpyFolder;
    // One of them tells what the numbers of all mean.
    let cloud = |(folder, is_first)| Box::new(NpyFolder::new(folder, is_first, options)) as Box<dyn Cloud>;
    let firsts = std::iter::once(true).chain(std::iter::repeat(false));
    Ok(folders.into_iter().zip(firsts).map(cloud).collect())
}

#[cfg(not(feature = "npy"))]
fn clouds_of(folders: Vec<PathBuf>, _: &AnnotationOptions) -> Result<Vec<Box<dyn Cloud + '_>>> {
    match folders.first() {
        Some(folder) => Err(Error::not_built_in(folder, "npy")),
        None => Ok(Vec::new()),
    }
}

/// Whether a folder is a sequence of SemanticKITTI.
pub(crate) fn is_kitti(dir: &Path) -> bool {
    dir.join("labels").is_dir() && dir.join("velodyne").is_dir()
}

/// Whether a folder is a scan of ScanNet rather than an S3DIS tree.
pub(crate) fn is_scannet(dir: &Path) -> bool {
    std::fs::read_dir(dir).is_ok_and(|entries| {
        entries
            .flatten()
            .any(|e| e.file_name().to_string_lossy().ends_with(".aggregation.json"))
    })
}
