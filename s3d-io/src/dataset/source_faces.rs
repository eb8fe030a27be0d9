//! Where each face of a data set's mesh comes from: `source_faces.npz`.

use crate::cloud::npy::npz::{NpzReader, NpzWriter, bytes, numbers};
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use crate::fs::open::open_file;
use std::io::{self, Read, Seek};
use std::path::Path;

/// The arrays of `source_faces.npz`. Readers leave faces out and cut polygons, so labels of the original
/// faces find the faces of the data set by these numbers.
///
/// ```
/// use s3d_io::dataset::{SourceFaces, read_source_faces, write_source_faces};
///
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("source_faces.npz");
/// // A quad became two faces, the face after it was left out.
/// let source = SourceFaces { files: vec!["scan.ply".into()], file: vec![0; 3], face: vec![0, 0, 2] };
/// write_source_faces(&path, &source)?;
/// assert_eq!(read_source_faces(&path)?, source);
/// # Ok::<(), s3d_io::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SourceFaces {
    /// The files of the mesh, named as in the manifest.
    pub files: Vec<String>,
    /// For each face of `rgb.obj`, in its order, the file that it comes from, as an index into `files`.
    pub file: Vec<u32>,
    /// Its number in this file, from 0: see [`MeshFile::source_faces`](crate::mesh::MeshFile::source_faces).
    pub face: Vec<u32>,
}

/// Writes the archive, whole or not at all: `files` of type `<U…`, `file` and `face` of type `<u4`. Returns
/// its size in bytes.
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If `file` and `face` have different lengths.
pub fn write_source_faces(path: &Path, source: &SourceFaces) -> Result<u64> {
    assert_eq!(source.file.len(), source.face.len(), "columns of one length");
    let file = AtomicFile::create(path)?;
    write_archive(file, source)
        .map_err(|e| Error::io(path, "write", e))?
        .commit()
}

fn write_archive(file: AtomicFile, source: &SourceFaces) -> io::Result<AtomicFile> {
    let mut archive = NpzWriter::new(file);
    archive.texts("files", &source.files)?;

    for (name, column) in [("file", &source.file), ("face", &source.face)] {
        let data = bytes(column.iter().copied(), u32::to_le_bytes);
        archive.array(name, "<u4", &[column.len() as u64], data)?;
    }
    archive.finish()
}

/// Reads an archive that [`write_source_faces`] wrote.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is not such an archive, is damaged, its columns have different
/// lengths, or a face comes from a file that it does not name.
pub fn read_source_faces(path: &Path) -> Result<SourceFaces> {
    read_source_faces_from(open_file(path)?, path)
}

/// Reads like [`read_source_faces`], from a reader of the archive. Errors call the file `name`.
///
/// # Errors
/// Like [`read_source_faces`].
pub fn read_source_faces_from(reader: impl Read + Seek, name: &Path) -> Result<SourceFaces> {
    let mut archive = NpzReader::new(reader, name)?;
    let mut column = |array: &str| {
        let data = archive.whole(array, |_| "<u4".to_owned(), |bytes| vec![bytes as u64 / 4]);
        data.map(|data| numbers(&data, u32::from_le_bytes))
    };
    let file = column("file")?;
    let face = column("face")?;
    if file.len() != face.len() {
        let message = format!("the array \"file\" has {} entries, and \"face\" {}", file.len(), face.len());
        return Err(Error::format(name, message));
    }

    let files = archive.texts("files")?;
    if let Some(most) = file.iter().max()
        && files.len() as u64 <= u64::from(*most)
    {
        let message = format!("a face comes from file {most}, counted from 0, and {} are named", files.len());
        return Err(Error::format(name, message));
    }
    Ok(SourceFaces { files, file, face })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_and_names_come_back_and_damage_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("source_faces.npz");
        let none = SourceFaces { files: vec![String::new()], ..SourceFaces::default() };
        let two = SourceFaces {
            files: vec!["Büro.ply".into(), "a/b/floor 2.obj".into()],
            file: vec![0, 0, 1],
            face: vec![7, 9, 0],
        };
        for source in [&none, &two] {
            assert_eq!(write_source_faces(&path, source).unwrap(), std::fs::metadata(&path).unwrap().len());
            assert_eq!(read_source_faces(&path).unwrap(), *source);
        }

        let whole = std::fs::read(&path).unwrap();
        for cut in [0, 10, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let message = read_source_faces(&path).unwrap_err().to_string();
            assert!(message.contains("source_faces.npz"), "{message}");
        }
        write_source_faces(&path, &SourceFaces { file: vec![0, 0, 2], ..two }).unwrap();
        assert!(
            read_source_faces(&path)
                .unwrap_err()
                .to_string()
                .contains("comes from file 2")
        );
    }
}
