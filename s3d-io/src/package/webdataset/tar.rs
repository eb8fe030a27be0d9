//! Writes tar archives (POSIX ustar) of plain files, which is all that training data needs.
//!
//! The tar crate would save a dozen lines. The sizes of entries, by which shards are planned, and extended
//! headers would stay ours, since it writes long names in GNU's way. The bytes of shards would change too
//! (`the_tar_crate_writes_other_bytes`). The tests use it as a reader.

#![expect(clippy::indexing_slicing, reason = "a writer: the fields of a header of 512 bytes")]

use crate::error::Result;
use crate::fs::atomic::AtomicFile;
use std::path::Path;

/// Headers and contents are padded to a multiple of this.
const BLOCK: u64 = 512;

/// An archive ends with two empty blocks.
const END: u64 = 2 * BLOCK;

/// The first size that does not fit the header's eleven octal digits.
const MAX_OCTAL: u64 = 1 << 33;

/// Writes a tar archive of plain files, whole or not at all. The bytes depend only on the files: owner 0,
/// mode 644, time 0.
///
/// The header holds names of up to 100 bytes, or up to 256 if they can be split at a `/`. For longer names,
/// and for sizes of 8 GiB or more, an extended header (POSIX pax) comes before it, which tar programs and
/// Python's `tarfile` read.
#[derive(Debug)]
pub struct TarWriter {
    file: AtomicFile,
}

impl TarWriter {
    /// Starts the archive `path`.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn create(path: &Path) -> Result<Self> {
        Ok(Self { file: AtomicFile::create(path)? })
    }

    /// Appends the file `name` (folders with `/`, no leading one) that holds `bytes`.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    ///
    /// # Panics
    /// If `name` is empty, holds a NUL or begins with `/`.
    pub fn append(&mut self, name: &str, bytes: &[u8]) -> Result<()> {
        assert!(
            !name.is_empty() && !name.contains('\0') && !name.starts_with('/'),
            "a file's name: {name:?}"
        );
        let size = bytes.len() as u64;
        let records = pax_records(name, size);
        if !records.is_empty() {
            self.file.put(&header("pax", records.len() as u64, b'x'))?;
            self.fill(records.as_bytes())?;
        }
        self.file.put(&header(name, size, b'0'))?;
        self.fill(bytes)
    }

    /// Writes bytes and pads their last block.
    fn fill(&mut self, bytes: &[u8]) -> Result<()> {
        self.file.put(bytes)?;
        let rest = bytes.len() as u64 % BLOCK;
        if rest == 0 {
            Ok(())
        } else {
            self.file.put(&[0; BLOCK as usize][rest as usize..])
        }
    }

    /// Ends the archive and gives it its name. Returns its size in bytes.
    ///
    /// # Errors
    /// [`crate::Error::Io`].
    pub fn finish(mut self) -> Result<u64> {
        self.file.put(&[0; END as usize])?;
        self.file.commit()
    }

    /// The bytes of an archive without files.
    pub const EMPTY_BYTES: u64 = END;

    /// Returns how many bytes a file of this name and size takes in an archive.
    pub fn entry_bytes(name: &str, size: u64) -> u64 {
        let records = pax_records(name, size).len() as u64;
        let extended = if records == 0 {
            0
        } else {
            BLOCK + records.next_multiple_of(BLOCK)
        };
        extended + BLOCK + size.next_multiple_of(BLOCK)
    }
}

/// Returns the extended header of a file, "LENGTH key=value
/// " for each value that does not fit the header. Empty if all fit.
fn pax_records(name: &str, size: u64) -> String {
    let mut records = String::new();
    let mut push = |key: &str, value: &str| {
        let rest = key.len() + value.len() + 3;
        // The length counts its own digits too.
        let mut length = rest + 1;
        while length != rest + length.to_string().len() {
            length = rest + length.to_string().len();
        }
        records.push_str(&format!("{length} {key}={value}\n"));
    };
    if split_name(name).is_none() {
        push("path", name);
    }
    if size >= MAX_OCTAL {
        push("size", &size.to_string());
    }
    records
}

/// Splits a name for the two fields of the header: up to 155 bytes of folders, and up to 100 bytes after a
/// `/`. Returns `None` if it does not fit.
fn split_name(name: &str) -> Option<(&str, &str)> {
    if name.len() <= 100 {
        return Some(("", name));
    }
    let mut slashes = name
        .match_indices('/')
        .filter_map(|(at, _)| Some((name.get(..at)?, name.get(at + 1..)?)));
    slashes.find(|(folders, rest)| folders.len() <= 155 && (1..=100).contains(&rest.len()))
}

/// Makes the header of a file, or of an extended header (`kind` b'x').
fn header(name: &str, size: u64, kind: u8) -> [u8; BLOCK as usize] {
    let mut block = [0; BLOCK as usize];
    let mut put = |at: usize, bytes: &[u8]| block[at..at + bytes.len()].copy_from_slice(bytes);

    // A name that does not fit is in the extended header. Its beginning stands here, for programs that do not
    // read those.
    let beginning = name
        .split_at_checked(name.floor_char_boundary(100))
        .map_or("", |(beginning, _)| beginning);
    let (folders, rest) = split_name(name).unwrap_or(("", beginning));
    put(0, rest.as_bytes());
    put(100, b"0000644\0");
    put(108, b"0000000\0");
    put(116, b"0000000\0");
    put(124, format!("{:011o}\0", size % MAX_OCTAL).as_bytes());
    put(136, b"00000000000\0");
    put(148, b"        ");
    put(156, &[kind]);
    put(257, b"ustar\x0000");
    put(329, b"0000000\0");
    put(337, b"0000000\0");
    put(345, folders.as_bytes());

    let sum: u32 = block.iter().map(|b| u32::from(*b)).sum();
    block[148..156].copy_from_slice(format!("{sum:06o}\0 ").as_bytes());
    block
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    /// Returns names and contents, as the tar crate reads them.
    fn read(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
        let mut archive = tar::Archive::new(bytes);
        let files = archive.entries().unwrap().map(|entry| {
            let mut entry = entry.unwrap();
            let header = entry.header();
            assert_eq!(
                (header.mtime().unwrap(), header.mode().unwrap(), header.uid().unwrap()),
                (0, 0o644, 0)
            );
            let name = String::from_utf8(entry.path_bytes().into_owned()).unwrap();
            let mut data = Vec::new();
            entry.read_to_end(&mut data).unwrap();
            (name, data)
        });
        files.collect()
    }

    fn theirs(name: &str) -> std::io::Result<[u8; 512]> {
        let mut header = tar::Header::new_ustar();
        header.set_path(name)?;
        header.set_mode(0o644);
        header.set_uid(0);
        header.set_gid(0);
        header.set_size(5);
        header.set_mtime(0);
        header.set_entry_type(tar::EntryType::Regular);
        header.set_device_major(0)?;
        header.set_device_minor(0)?;
        header.set_cksum();
        std::io::Result::Ok(*header.as_bytes())
    }

    #[test]
    fn the_tar_crate_writes_other_bytes() {
        let ours = header("a", 5, b'0');
        let other = theirs("a").unwrap();
        let differ: Vec<usize> = (0..512).filter(|&at| ours[at] != other[at]).collect();
        assert!(differ.iter().all(|at| (148..156).contains(at)) && !differ.is_empty(), "{differ:?}");
        let deep = format!("a/{}/{}", "b".repeat(60), "c".repeat(90));
        assert_eq!(&header(&format!("a/b/{}", "c".repeat(97)), 5, b'0')[345..348], b"a\0\0");
        assert_eq!(&theirs(&format!("a/b/{}", "c".repeat(97))).unwrap()[345..349], b"a/b\0");
        assert_eq!(header(&deep, 5, b'0')[345..500], theirs(&deep).unwrap()[345..500]);
        assert!(theirs(&"x".repeat(101)).is_err());
    }

    #[test]
    fn files_of_any_size_and_name_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.tar");
        let names = [
            "a".to_owned(),
            "x".repeat(100),
            "x".repeat(101),
            format!("{}/{}", "f".repeat(155), "n".repeat(100)),
            format!("{}/{}", "f".repeat(156), "n".repeat(100)),
            format!("area_1/{}", "y".repeat(98)),
            "ä".repeat(60),
        ];
        let mut writer = TarWriter::create(&path).unwrap();
        let mut expected = Vec::new();
        let mut bytes = TarWriter::EMPTY_BYTES;
        for (i, name) in names.iter().enumerate() {
            for size in [0, 1, 511, 512, 513] {
                let data: Vec<u8> = (0..size).map(|k| (k + i) as u8).collect();
                writer.append(name, &data).unwrap();
                bytes += TarWriter::entry_bytes(name, size as u64);
                expected.push((name.clone(), data));
            }
        }
        assert_eq!(writer.finish().unwrap(), bytes);
        let archive = std::fs::read(&path).unwrap();
        assert_eq!(archive.len() as u64, bytes);
        assert_eq!(read(&archive), expected);
    }

    #[test]
    fn lengths_of_extended_headers_count_themselves() {
        for length in 150..1100 {
            let name = "x".repeat(length);
            let records = pax_records(&name, 0);
            assert_eq!(records.split(' ').next().unwrap().parse(), Ok(records.len()));
        }
        assert_eq!(pax_records("a", MAX_OCTAL), "19 size=8589934592\n");
        assert_eq!(pax_records("a", MAX_OCTAL - 1), "");
    }

    #[test]
    #[should_panic(expected = "a file's name")]
    fn an_absolute_name_is_a_mistake() {
        let dir = tempfile::tempdir().unwrap();
        let _ = TarWriter::create(&dir.path().join("a.tar"))
            .unwrap()
            .append("/etc/x", b"");
    }
}
