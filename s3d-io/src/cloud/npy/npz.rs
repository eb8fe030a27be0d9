//! Archives of numpy arrays, which are written beside tables of a data set, and in folders of labels.

use crate::cloud::npy::write::npy_header;
use crate::error::{Error, Result};
use std::io::{self, BufReader, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipArchive, ZipWriter};

/// Returns the bytes of an array's values.
pub(crate) fn bytes<T, const N: usize>(
    values: impl Iterator<Item = T>,
    to_le_bytes: impl Fn(T) -> [u8; N],
) -> Vec<u8> {
    values.flat_map(to_le_bytes).collect()
}

/// Writes an `.npz` file: an archive of `.npy` files, stored as they are.
pub(crate) struct NpzWriter<W: Write + Seek> {
    // Fields are dropped in this order.
    ended: SetOnDrop,
    zip: ZipWriter<UntilEnd<W>>,
}

/// Says that an archive is not to be completed: its writer was dropped.
struct SetOnDrop(Arc<AtomicBool>);

impl Drop for SetOnDrop {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// A writer that takes everything and writes nothing once the archive has ended: it was dropped, or the
/// system has refused something. A `ZipWriter` that is dropped completes its archive, and prints to the log
/// if that fails, as it does on a full disk.
struct UntilEnd<W> {
    file: W,
    ended: Arc<AtomicBool>,
    /// Where the next byte belongs, and the end of the file. They go on after the archive has ended.
    at: u64,
    end: u64,
}

impl<W> UntilEnd<W> {
    /// Does `work` unless the archive has ended. Then `instead` is the answer.
    fn until_end<T>(&mut self, instead: T, work: impl FnOnce(&mut W) -> io::Result<T>) -> io::Result<T> {
        if self.ended.load(Ordering::Relaxed) {
            return Ok(instead);
        }
        let done = work(&mut self.file);
        if done.as_ref().is_err_and(|e| e.kind() != ErrorKind::Interrupted) {
            self.ended.store(true, Ordering::Relaxed);
        }
        done
    }
}

impl<W: Write> Write for UntilEnd<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.until_end(bytes.len(), |file| file.write(bytes))?;
        self.at += written as u64;
        self.end = self.end.max(self.at);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.until_end((), |file| file.flush())
    }
}

impl<W: Seek> Seek for UntilEnd<W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let at = match to {
            SeekFrom::Start(at) => at,
            SeekFrom::Current(by) => self.at.saturating_add_signed(by),
            SeekFrom::End(by) => self.end.saturating_add_signed(by),
        };
        self.at = self.until_end(at, |file| file.seek(to))?;
        Ok(self.at)
    }
}

impl<W: Write + Seek> NpzWriter<W> {
    pub(crate) fn new(file: W) -> Self {
        let ended = Arc::default();
        let zip = ZipWriter::new(UntilEnd { file, ended: Arc::clone(&ended), at: 0, end: 0 });
        Self { ended: SetOnDrop(ended), zip }
    }

    /// Completes the archive, and returns the writer.
    pub(crate) fn finish(self) -> io::Result<W> {
        let Self { ended, zip } = self;
        let file = zip.finish()?.file;
        drop(ended);
        Ok(file)
    }

    /// Appends an array in memory. `kind` is a numpy type (`"<u4"`).
    pub(crate) fn array(
        &mut self,
        name: &str,
        kind: &str,
        shape: &[u64],
        data: impl AsRef<[u8]>,
    ) -> io::Result<()> {
        let mut data = data.as_ref();
        self.stream(name, kind, shape, data.len() as u64, &mut data)
    }

    /// Appends an array of texts, of type `<U…`.
    pub(crate) fn texts(&mut self, name: &str, texts: &[impl AsRef<str>]) -> io::Result<()> {
        let longest = texts.iter().map(|text| text.as_ref().chars().count()).max();
        let length = longest.unwrap_or(0).max(1);
        let mut data = Vec::with_capacity(4 * length * texts.len());
        for text in texts {
            let end = data.len() + 4 * length;
            data.extend(text.as_ref().chars().flat_map(|c| u32::from(c).to_le_bytes()));
            data.resize(end, 0);
        }
        self.array(name, &format!("<U{length}"), &[texts.len() as u64], data)
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
    pub(crate) fn stream(
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
pub(crate) struct NpzReader<'a, R> {
    path: &'a Path,
    zip: ZipArchive<BufReader<R>>,
}

impl<'a, R: Read + Seek> NpzReader<'a, R> {
    pub(crate) fn new(file: R, path: &'a Path) -> Result<Self> {
        let zip = ZipArchive::new(BufReader::with_capacity(1 << 18, file))
            .map_err(|e| refused(path, e, |e| format!("no readable archive: {e}")))?;
        Ok(Self { path, zip })
    }

    /// Returns the header of an array, and a reader of its values. The archive's checksum is compared at the
    /// end of the values.
    pub(crate) fn array(&mut self, name: &str) -> Result<(Vec<u8>, impl Read + '_)> {
        let path = self.path;
        let mut entry = self
            .zip
            .by_name(&format!("{name}.npy"))
            .map_err(|e| refused(path, e, |e| format!("the array {name:?}: {e}")))?;
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
    pub(crate) fn whole(
        &mut self,
        name: &str,
        kind: impl Fn(usize) -> String,
        shape: impl Fn(usize) -> Vec<u64>,
    ) -> Result<Vec<u8>> {
        let path = self.path;
        let (header, mut values) = self.array(name)?;
        let mut bytes = Vec::new();
        values.read_to_end(&mut bytes).map_err(|e| damaged(path, name, e))?;
        check_header(path, name, &header, &kind(bytes.len()), &shape(bytes.len()))?;
        Ok(bytes)
    }
}

pub(crate) fn damaged(path: &Path, name: &str, e: io::Error) -> Error {
    refused(path, ZipError::Io(e), |e| format!("the array {name:?} is damaged: {e}"))
}

/// Returns an error of the system as it is, since it may pass. Any other is a fault of the file.
fn refused(path: &Path, error: ZipError, fault: impl FnOnce(&ZipError) -> String) -> Error {
    match error {
        ZipError::Io(e) if e.raw_os_error().is_some() => Error::io(path, "read", e),
        other => Error::format(path, fault(&other)),
    }
}

impl<R: Read + Seek> NpzReader<'_, R> {
    /// Returns the texts of an array of type `<U…`.
    pub(crate) fn texts(&mut self, name: &str) -> Result<Vec<String>> {
        let path = self.path;
        let (header, mut values) = self.array(name)?;
        let mut bytes = Vec::new();
        values.read_to_end(&mut bytes).map_err(|e| damaged(path, name, e))?;

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
pub(crate) fn check_header(path: &Path, name: &str, header: &[u8], kind: &str, shape: &[u64]) -> Result<()> {
    if header == npy_header(kind, shape) {
        return Ok(());
    }
    Err(Error::format(path, format!("the array {name:?} is not of type {kind} and shape {shape:?}")))
}

/// Returns the values in an array's bytes.
pub(crate) fn numbers<T, const N: usize>(bytes: &[u8], from_le_bytes: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|b| from_le_bytes(*b)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A disk with room for some bytes. It counts what is refused.
    struct Disk<'c> {
        bytes: io::Cursor<Vec<u8>>,
        room: u64,
        refused: &'c std::cell::Cell<u32>,
    }

    impl Write for Disk<'_> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.bytes.position() + bytes.len() as u64 > self.room {
                self.refused.set(self.refused.get() + 1);
                return Err(io::Error::from_raw_os_error(28));
            }
            self.bytes.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk<'_> {
        fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
            self.bytes.seek(to)
        }
    }

    /// Each later try to complete the archive would fail, and print to the log.
    #[test]
    fn a_full_disk_refuses_once() {
        for room in [0, 20, 100, 300, 400, 430] {
            let refused = std::cell::Cell::new(0);
            let disk = Disk { bytes: io::Cursor::default(), room, refused: &refused };
            let mut archive = NpzWriter::new(disk);
            let written = archive.array("a", "<u1", &[200], [7; 200]);
            let written = written.and_then(|()| archive.finish().map(drop));
            assert!(written.is_err(), "{room}");
            assert_eq!(refused.get(), 1, "{room}");
        }

        // One that is given up is not completed.
        let refused = std::cell::Cell::new(0);
        let disk = Disk { bytes: io::Cursor::default(), room: 300, refused: &refused };
        let mut archive = NpzWriter::new(disk);
        archive.array("a", "<u1", &[100], [7; 100]).unwrap();
        drop(archive);
        assert_eq!(refused.get(), 0);
    }

    #[test]
    fn errors_of_the_system_are_kept() {
        struct Broken;
        impl Read for Broken {
            fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
                Err(io::Error::from_raw_os_error(5))
            }
        }
        impl Seek for Broken {
            fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
                Ok(1000)
            }
        }
        let error = NpzReader::new(Broken, Path::new("a.npz")).err().unwrap();
        assert!(matches!(&error, Error::Io { source, .. } if source.raw_os_error() == Some(5)), "{error:?}");
    }

    #[test]
    fn an_array_beyond_4_gib_has_a_header_of_64_bits() {
        for (size, is_large) in [(1 << 33, true), (1 << 20, false)] {
            let mut archive = NpzWriter::new(io::Cursor::new(Vec::new()));
            archive.start("point_index", size).unwrap();
            archive.zip.write_all(b"abc").unwrap();
            let bytes = archive.finish().unwrap().into_inner();
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
