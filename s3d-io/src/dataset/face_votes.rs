//! The votes of the annotated points for each face: `votes.npz`.

use crate::cloud::npy::npz::{NpzReader, NpzWriter, bytes, numbers};
use crate::error::{Error, Result};
use crate::fs::atomic::AtomicFile;
use crate::fs::open::open_file;
use std::io::{self, Read, Seek};
use std::path::Path;

/// The arrays of `votes.npz`. Each has an entry for each face of `rgb.obj` and `semantic.obj`, in their
/// order.
///
/// ```
/// use s3d_io::dataset::{FaceVoteColumns, read_face_votes, write_face_votes};
///
/// # let folder = tempfile::tempdir().unwrap();
/// # let path = folder.path().join("votes.npz");
/// // Seven points voted for the first face, nobody for the second.
/// let votes = FaceVoteColumns {
///     label: vec![3, 0],
///     votes: vec![5, 0],
///     total: vec![7, 0],
///     runner_up: vec![1, 0],
///     runner_up_votes: vec![2, 0],
///     farthest_m: vec![0.004, 0.0],
/// };
/// write_face_votes(&path, &votes)?;
/// assert_eq!(read_face_votes(&path)?, votes);
/// # Ok::<(), s3d_io::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FaceVoteColumns {
    /// The label with the most votes, by its index in `semantic_labels.json`. For a face without votes it is
    /// 0, or the label that the face was filled with.
    pub label: Vec<u32>,
    /// The number of votes for `label`.
    pub votes: Vec<u32>,
    /// The number of all votes.
    pub total: Vec<u32>,
    /// The label with the second most votes, by its index; 0 if all votes were for one label.
    pub runner_up: Vec<u32>,
    /// The number of votes for `runner_up`.
    pub runner_up_votes: Vec<u32>,
    /// The distance of the farthest voter from the face, metres; 0 without votes.
    pub farthest_m: Vec<f32>,
}

impl FaceVoteColumns {
    fn counts(&self) -> [(&'static str, &Vec<u32>); 5] {
        [
            ("label", &self.label),
            ("votes", &self.votes),
            ("total", &self.total),
            ("runner_up", &self.runner_up),
            ("runner_up_votes", &self.runner_up_votes),
        ]
    }
}

/// Writes the archive, whole or not at all: arrays of type `<u4`, and `farthest_m` of type `<f4`. Returns its
/// size in bytes.
///
/// # Errors
/// [`Error::Io`].
///
/// # Panics
/// If the columns have different lengths.
pub fn write_face_votes(path: &Path, columns: &FaceVoteColumns) -> Result<u64> {
    let faces = columns.farthest_m.len();
    assert!(columns.counts().iter().all(|(_, column)| column.len() == faces), "columns of one length");
    let file = AtomicFile::create(path)?;
    write_archive(file, columns)
        .map_err(|e| Error::io(path, "write", e))?
        .commit()
}

fn write_archive(file: AtomicFile, columns: &FaceVoteColumns) -> io::Result<AtomicFile> {
    let faces = columns.farthest_m.len() as u64;
    let mut archive = NpzWriter::new(file);
    for (name, column) in columns.counts() {
        archive.array(name, "<u4", &[faces], bytes(column.iter().copied(), u32::to_le_bytes))?;
    }
    let farthest = bytes(columns.farthest_m.iter().copied(), f32::to_le_bytes);
    archive.array("farthest_m", "<f4", &[faces], farthest)?;
    archive.finish()
}

/// Reads an archive that [`write_face_votes`] wrote.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is not such an archive, is damaged, or its arrays have different
/// lengths.
pub fn read_face_votes(path: &Path) -> Result<FaceVoteColumns> {
    read_face_votes_from(open_file(path)?, path)
}

/// Reads like [`read_face_votes`], from a reader of the archive. Errors call the file `name`.
///
/// # Errors
/// Like [`read_face_votes`].
pub fn read_face_votes_from(reader: impl Read + Seek, name: &Path) -> Result<FaceVoteColumns> {
    let mut archive = NpzReader::new(reader, name)?;
    let mut column =
        |array: &str, kind: &str| archive.whole(array, |_| kind.to_owned(), |bytes| vec![bytes as u64 / 4]);
    let farthest_m = numbers(&column("farthest_m", "<f4")?, f32::from_le_bytes);
    let mut counts = |array: &str| Ok(numbers(&column(array, "<u4")?, u32::from_le_bytes));
    let columns = FaceVoteColumns {
        label: counts("label")?,
        votes: counts("votes")?,
        total: counts("total")?,
        runner_up: counts("runner_up")?,
        runner_up_votes: counts("runner_up_votes")?,
        farthest_m,
    };

    let faces = columns.farthest_m.len();
    match columns.counts().iter().find(|(_, column)| column.len() != faces) {
        None => Ok(columns),
        Some((array, column)) => Err(Error::format(
            name,
            format!("the array {array:?} has {} entries, and \"farthest_m\" {faces}", column.len()),
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn multiples(n: u32) -> Vec<u32> {
        (0..5).map(|i| i * n).collect::<Vec<_>>()
    }

    #[test]
    fn columns_come_back_and_damage_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("votes.npz");
        write_face_votes(&path, &FaceVoteColumns::default()).unwrap();
        assert_eq!(read_face_votes(&path).unwrap(), FaceVoteColumns::default());
        let columns = FaceVoteColumns {
            label: multiples(3),
            votes: multiples(7),
            total: multiples(1 << 20),
            runner_up: multiples(1),
            runner_up_votes: multiples(2),
            farthest_m: vec![0.0, 0.5, f32::MAX, 1e-9, 3.0],
        };
        assert_eq!(write_face_votes(&path, &columns).unwrap(), std::fs::metadata(&path).unwrap().len());
        assert_eq!(read_face_votes(&path).unwrap(), columns);

        let whole = std::fs::read(&path).unwrap();
        for cut in [0, 10, whole.len() / 2, whole.len() - 1] {
            std::fs::write(&path, &whole[..cut]).unwrap();
            let message = read_face_votes(&path).unwrap_err().to_string();
            assert!(message.contains("votes.npz"), "{message}");
        }

        let mut other = whole;
        let at = other.windows(4).position(|w| *w == (7u32 * 4).to_le_bytes()).unwrap();
        other[at] ^= 1;
        std::fs::write(&path, other).unwrap();
        assert!(read_face_votes(&path).unwrap_err().to_string().contains("is damaged"));
    }
}
