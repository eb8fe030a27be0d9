//! Archives of numpy arrays, which are written beside a data set's tables.

use crate::cloud::npy::write::npy_header;
use crate::error::{Error, Result};
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// Returns the bytes of an array's values.
pub(super) fn bytes<T, const N: usize>(
    values: impl Iterator<Item = T>,
    to_le_bytes: impl Fn(T) -> [u8; N],
) -> Vec<u8> {
    values.flat_map(to_le_bytes).collect()
}

/// Writes an `.npz` file: an archive of `.npy` files, stored as they are.
pub(super) struct NpzWriter<W: Write + Seek> {
    zip: ZipWriter<W>,
}

impl<W: Write + Seek> NpzWriter<W> {
    pub(super) fn new(file: W) -> Self {
        Self { zip: ZipWriter::new(file) }
    }

    /// Completes the archive, and returns the writer.
    pub(super) fn finish(self) -> io::Result<W> {
        Ok(self.zip.finish()?)
    }

    /// Appends an array in memory. `kind` is a numpy type (`"<u4"`).
    pub(super) fn array(
        &mut self,
        name: &str,
        kind: &str,
        shape: &[u64],
        data: impl AsRef<[u8]>,
    ) -> io::Result<()> {
        let mut data = data.as_ref();
        self.stream(name, kind, shape, data.len() as u64, &mut data)
    }

    /// Starts an array of about `size` bytes. Beyond 4 GiB its header needs room for 64 bits.
    fn start(&mut self, name: &str, size: u64) -> io::Result<()> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .last_modified_time(DateTime::default())
            .large_file(size > 0xf000_0000);
        Ok(self.zip.start_file(format!("{name}.npy"), options)?)
    }

    /// Appends an array of `size` bytes from a reader.
    pub(super) fn stream(
        &mut self,
        name: &str,
        kind: &str,
        shape: &[u64],
        size: u64,
        data: &mut dyn io::Read,
    ) -> io::Result<()> {
        self.start(name, size)?;
        self.zip.write_all(&npy_header(kind, shape))?;
        let copied = io::copy(data, &mut self.zip)?;
        if copied != size {
            return Err(io::Error::other(format!("{copied} of {size} bytes of {name} are left")));
        }
        Ok(())
    }
}

/// Reads an `.npz` file.
pub(super) struct NpzReader<'a, R> {
    path: &'a Path,
    zip: ZipArchive<BufReader<R>>,
}

impl<'a, R: Read + Seek> NpzReader<'a, R> {
    pub(super) fn new(file: R, path: &'a Path) -> Result<Self> {
        let zip = ZipArchive::new(BufReader::with_capacity(1 << 18, file))
            .map_err(|e| Error::format(path, format!("no readable archive: {e}")))?;
        Ok(Self { path, zip })
    }

    /// Returns the header of an array, and a reader of its values. The archive's checksum is compared at the
    /// end of the values.
    pub(super) fn array(&mut self, name: &str) -> Result<(Vec<u8>, impl Read + '_)> {
        let path = self.path;
        let mut entry = self
            .zip
            .by_name(&format!("{name}.npy"))
            .map_err(|e| Error::format(path, format!("the array {name:?}: {e}")))?;
        let other = |_| Error::format(path, format!("{name:?} is no NPY array"));
        let mut start = [0; 8];
        let mut length = [0; 2];
        entry.read_exact(&mut start).map_err(other)?;
        entry.read_exact(&mut length).map_err(other)?;
        let mut text = vec![0; usize::from(u16::from_le_bytes(length))];
        entry.read_exact(&mut text).map_err(other)?;
        Ok(([&start[..], &length, &text].concat(), entry))
    }

    /// Returns the bytes of an array's values, after a check of its type and shape. Both are told from the
    /// number of bytes.
    pub(super) fn whole(
        &mut self,
        name: &str,
        kind: impl Fn(usize) -> String,
        shape: impl Fn(usize) -> Vec<u64>,
    ) -> Result<Vec<u8>> {
        let path = self.path;
        let (header, mut values) = self.array(name)?;
        let mut bytes = Vec::new();
        values.read_to_end(&mut bytes).map_err(|e| damaged(path, name, &e))?;
        check_header(path, name, &header, &kind(bytes.len()), &shape(bytes.len()))?;
        Ok(bytes)
    }
}

pub(super) fn damaged(path: &Path, name: &str, e: &std::io::Error) -> Error {
    Error::format(path, format!("the array {name:?} is damaged: {e}"))
}

impl<R: Read + Seek> NpzReader<'_, R> {
    /// Returns the texts of an array of type `<U…`.
    pub(super) fn texts(&mut self, name: &str) -> Result<Vec<String>> {
        let path = self.path;
        let (header, mut values) = self.array(name)?;
        let mut bytes = Vec::new();
        values.read_to_end(&mut bytes).map_err(|e| damaged(path, name, &e))?;

        // The type tells how many characters a text has at most.
        let head = String::from_utf8_lossy(&header).into_owned();
        let written = head.split_once("'<U").and_then(|(_, rest)| rest.split_once('\''));
        let length = written
            .and_then(|(length, _)| length.parse::<usize>().ok())
            .unwrap_or(0);
        let size = length.saturating_mul(4).max(4);
        let count = (bytes.len() / size) as u64;
        check_header(path, name, &header, &format!("<U{length}"), &[count])?;

        let texts = bytes.chunks_exact(size).map(|text| {
            let codes = text.as_chunks().0.iter().map(|code| u32::from_le_bytes(*code));
            let codes = codes.take_while(|code| *code != 0);
            codes
                .map(|code| char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER))
                .collect()
        });
        Ok(texts.collect())
    }
}

/// Refuses an array of another type or shape.
pub(super) fn check_header(path: &Path, name: &str, header: &[u8], kind: &str, shape: &[u64]) -> Result<()> {
    if header == npy_header(kind, shape) {
        return Ok(());
    }
    Err(Error::format(path, format!("the array {name:?} is not of type {kind} and shape {shape:?}")))
}

/// Returns the values in an array's bytes.
pub(super) fn numbers<T, const N: usize>(bytes: &[u8], from_le_bytes: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|b| from_le_bytes(*b)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_array_beyond_4_gib_has_a_header_of_64_bits() {
        for (size, is_large) in [(1 << 33, true), (1 << 20, false)] {
            let mut archive = NpzWriter::new(io::Cursor::new(Vec::new()));
            archive.start("point_index", size).unwrap();
            archive.zip.write_all(b"abc").unwrap();
            let bytes = archive.zip.finish().unwrap().into_inner();
            // In the local header, version 4.5 is needed, and the sizes are in an extra field of the kind 1.
            assert_eq!(bytes[..4], *b"PK\x03\x04");
            let extra = 30 + "point_index.npy".len();
            let sizes = if is_large { [0xff; 8] } else { [3, 0, 0, 0, 3, 0, 0, 0] };
            assert_eq!((bytes[4] == 45, &bytes[18..26]), (is_large, &sizes[..]));
            assert_eq!(bytes[extra..].starts_with(&[1, 0, 16, 0, 3, 0, 0, 0]), is_large);
            let mut zip = zip::ZipArchive::new(io::Cursor::new(bytes)).unwrap();
            let mut text = String::new();
            zip.by_name("point_index.npy")
                .unwrap()
                .read_to_string(&mut text)
                .unwrap();
            assert_eq!(text, "abc");
        }
    }
}
