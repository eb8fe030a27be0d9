//! numpy's arrays of numbers of any meaning: an NPY file, or a member of an NPZ archive.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::cloud::npy::header::{Elements, parse, read_text};
use crate::cloud::table::records::{Field, Kind, fill, rows_of_block};
use crate::cloud::table::rows::Value;
use crate::error::{Error, Result};
use crate::fs::open::open_file;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::{Path, PathBuf};
use zip::ZipArchive;
use zip::result::ZipError;

/// The most arrays in an archive.
const MOST_ARRAYS: usize = 1 << 16;

/// An array of integers, floats or Booleans, read piece by piece, so that arrays of any size need little
/// memory. Numbers come in the order of the file: the last index varies fastest, or the first if
/// [`NpyArray::is_column_major`].
///
/// ```
/// # let dir = tempfile::tempdir()?;
/// # let path = dir.path().join("labels.npy");
/// use s3d_io::cloud::{NpyArray, NpyWriter};
///
/// let mut file = NpyWriter::create(&path, "<i4", &[3])?;
/// file.put(&[8i32, 8, 2].map(i32::to_le_bytes).concat())?;
/// file.finish()?;
///
/// let mut array = NpyArray::open(&path)?;
/// let mut labels = Vec::new();
/// while array.read_integers(&mut labels)? > 0 {}
/// assert_eq!((array.shape(), &labels[..]), (&[3][..], &[8, 8, 2][..]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct NpyArray<R = BufReader<File>> {
    name: PathBuf,
    source: R,
    shape: Vec<u64>,
    is_column_major: bool,
    kind: Kind,
    big_endian: bool,
    count: u64,
    done: u64,
    block: Vec<u8>,
}

impl NpyArray {
    /// Opens an NPY file.
    ///
    /// # Errors
    /// The errors of [`NpyArray::new`].
    pub fn open(path: &Path) -> Result<Self> {
        Self::new(BufReader::new(open_file(path)?), path)
    }
}

impl<R: Read> NpyArray<R> {
    /// Reads the header of the NPY file in `source`. Errors call the file `name`.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if it is no NPY file; [`Error::Unsupported`] if the array does not
    /// hold numbers.
    pub fn new(mut source: R, name: &Path) -> Result<Self> {
        let header = parse(&read_text(name, &mut source)?).map_err(|why| why.of(name))?;
        let no_numbers = || {
            let message = "holds no numbers: save an array of integers, floats or Booleans";
            Error::unsupported(name, message)
        };
        let Elements::Plain(stored) = header.elements else { return Err(no_numbers()) };
        let kind = stored.kind.filter(|kind| !kind.is_text()).ok_or_else(no_numbers)?;

        let shape = header.shape;
        Ok(Self {
            name: name.to_owned(),
            source,
            is_column_major: header.is_column_major && shape.len() > 1,
            count: header.count,
            shape,
            kind,
            big_endian: stored.big_endian,
            done: 0,
            block: Vec::new(),
        })
    }

    /// The path of the file, or of the archive followed by the member's name.
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// The sides of the array; empty for a single number.
    pub fn shape(&self) -> &[u64] {
        &self.shape
    }

    /// Whether the first index varies fastest, as numpy stores a transposed array (`fortran_order`).
    pub fn is_column_major(&self) -> bool {
        self.is_column_major
    }

    /// Whether it holds floats.
    pub fn is_float(&self) -> bool {
        self.kind.is_float()
    }

    /// Appends the next numbers to `out`, up to a MiB of the file, and returns their number: 0 at the end.
    /// Booleans are 0 and 1.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the file ends before the array, or a number is beyond an `i64`;
    /// [`Error::Unsupported`] if the array holds floats.
    pub fn read_integers(&mut self, out: &mut Vec<i64>) -> Result<usize> {
        let n = self.next_block()?;
        macro_rules! put {
            ($t:ty) => {
                out.extend(
                    numbers(&self.block, self.big_endian, <$t>::from_le_bytes, <$t>::from_be_bytes)
                        .map(i64::from),
                )
            };
        }

        match self.kind {
            Kind::I8 => put!(i8),
            Kind::U8 => put!(u8),
            Kind::I16 => put!(i16),
            Kind::U16 => put!(u16),
            Kind::I32 => put!(i32),
            Kind::U32 => put!(u32),
            Kind::I64 => put!(i64),
            Kind::U64 => {
                let read = numbers(&self.block, self.big_endian, u64::from_le_bytes, u64::from_be_bytes);
                for number in read {
                    out.push(i64::try_from(number).map_err(|_| self.too_large())?);
                }
            }
            Kind::F16 | Kind::F32 | Kind::F64 | Kind::Bytes(_) | Kind::Utf32(_) => {
                let message = "holds floats where whole numbers are due: save array.astype(numpy.int64)";
                return Err(Error::unsupported(&self.name, message));
            }
        }
        Ok(n)
    }

    /// Appends the next numbers to `out`, up to a MiB of the file, and returns their number: 0 at the end.
    /// Integers become the nearest floats.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if the file ends before the array.
    pub fn read_floats(&mut self, out: &mut Vec<f64>) -> Result<usize> {
        let n = self.next_block()?;
        macro_rules! put {
            ($t:ty, $to_f64:expr) => {
                out.extend(
                    numbers(&self.block, self.big_endian, <$t>::from_le_bytes, <$t>::from_be_bytes)
                        .map($to_f64),
                )
            };
        }
        match self.kind {
            Kind::I8 => put!(i8, f64::from),
            Kind::U8 => put!(u8, f64::from),
            Kind::I16 => put!(i16, f64::from),
            Kind::U16 => put!(u16, f64::from),
            Kind::I32 => put!(i32, f64::from),
            Kind::U32 => put!(u32, f64::from),
            Kind::I64 => put!(i64, |number| number as f64),
            Kind::U64 => put!(u64, |number| number as f64),
            Kind::F16 => put!(half::f16, f64::from),
            Kind::F32 => put!(f32, f64::from),
            Kind::F64 | Kind::Bytes(_) | Kind::Utf32(_) => put!(f64, |number| number),
        }
        Ok(n)
    }

    fn too_large(&self) -> Error {
        Error::format(&self.name, format!("holds a number beyond {}", i64::MAX))
    }

    /// Reads the bytes of the next numbers, and returns the number of these.
    fn next_block(&mut self) -> Result<usize> {
        let size = self.kind.size();
        let n = rows_of_block(self.count, self.done, size).unwrap_or(0);
        self.block.resize(n.saturating_mul(size), 0);
        fill(&self.name, &mut self.source, &mut self.block, self.done, self.count, size)?;
        self.done = self.done.saturating_add(n as u64);
        Ok(n)
    }
}

/// Decodes the numbers of a block.
fn numbers<T, const N: usize>(
    block: &[u8],
    big_endian: bool,
    little: impl Fn([u8; N]) -> T,
    big: impl Fn([u8; N]) -> T,
) -> impl Iterator<Item = T> {
    let blocks = block.as_chunks::<N>().0.iter();
    blocks.map(move |bytes| if big_endian { big(*bytes) } else { little(*bytes) })
}

/// An NPZ archive, whose arrays are read one at a time.
#[derive(Debug)]
pub struct NpzArchive {
    path: PathBuf,
    zip: ZipArchive<BufReader<File>>,
    names: Vec<String>,
}

impl NpzArchive {
    /// Opens an archive.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] if it is no ZIP archive.
    pub fn open(path: &Path) -> Result<Self> {
        let zip = ZipArchive::new(BufReader::new(open_file(path)?)).map_err(|e| zipped(path, e))?;
        if zip.len() > MOST_ARRAYS {
            return Err(Error::format(path, format!("holds {} arrays", zip.len())));
        }
        let names = zip
            .file_names()
            .flatten()
            .filter_map(|name| name.strip_suffix(".npy").map(str::to_owned));
        let mut names: Vec<String> = names.collect();
        names.sort();
        Ok(Self { path: path.to_owned(), zip, names })
    }

    /// The names of its arrays, sorted.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Opens one of its arrays.
    ///
    /// # Errors
    /// [`Error::Format`] if the archive has no array of this name, and the errors of [`NpyArray::new`].
    pub fn array(&mut self, name: &str) -> Result<NpyArray<impl Read>> {
        let member = format!("{name}.npy");
        let path = self.path.join(&member);
        let file = self.zip.by_name(&member).map_err(|e| zipped(&self.path, e))?;
        NpyArray::new(file, &path)
    }

    /// Reads one of its arrays whose elements are texts, of numpy's types `U` and `S`: in the order of the
    /// file, whatever its shape.
    ///
    /// # Errors
    /// [`Error::Format`] if the archive has no array of this name, or it ends too early;
    /// [`Error::Unsupported`] if its elements are no texts.
    pub fn texts(&mut self, name: &str) -> Result<Vec<String>> {
        let member = format!("{name}.npy");
        let path = self.path.join(&member);
        let mut file = self.zip.by_name(&member).map_err(|e| zipped(&self.path, e))?;
        let header = parse(&read_text(&path, &mut file)?).map_err(|why| why.of(&path))?;
        let field = match header.elements {
            Elements::Plain(stored) => stored.kind.filter(|kind| kind.is_text()).map(|kind| Field {
                name: String::new(),
                at: 0,
                kind,
                big_endian: stored.big_endian,
            }),
            Elements::Structure(_) => None,
        };
        let field = field.ok_or_else(|| Error::unsupported(&path, "holds no texts"))?;

        let size = field.kind.size();
        let (mut texts, mut block, mut text) = (Vec::new(), Vec::new(), String::new());
        while let Some(n) = rows_of_block(header.count, texts.len() as u64, size) {
            block.resize(n.saturating_mul(size), 0);
            fill(&path, &mut file, &mut block, texts.len() as u64, header.count, size)?;
            texts.extend(
                block
                    .chunks_exact(size)
                    .map(|record| match field.value(record, &mut text) {
                        Value::Name(text) => text.to_owned(),
                        _ => String::new(),
                    }),
            );
        }
        Ok(texts)
    }
}

pub(super) fn zipped(path: &Path, error: ZipError) -> Error {
    match error {
        ZipError::Io(e) => Error::io(path, "read", e),
        e => Error::format(path, format!("is no NPZ that can be read: {e}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use zip::ZipWriter;
    use zip::write::SimpleFileOptions;

    fn npy(kind: &str, shape: &str, order: &str, data: &[u8]) -> Vec<u8> {
        let text = format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': {shape}, }}\n");
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(text.len()).unwrap().to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn integers(bytes: &[u8]) -> Result<Vec<i64>> {
        let mut out = Vec::new();
        let mut array = NpyArray::new(bytes, Path::new("a.npy"))?;
        while array.read_integers(&mut out)? > 0 {}
        Ok(out)
    }

    fn floats(bytes: &[u8]) -> Result<Vec<f64>> {
        let mut out = Vec::new();
        let mut array = NpyArray::new(bytes, Path::new("a.npy"))?;
        while array.read_floats(&mut out)? > 0 {}
        Ok(out)
    }

    #[test]
    fn numbers_of_every_type() {
        for (kind, data, whole) in [
            ("|b1", vec![0, 1], vec![0, 1]),
            ("|u1", vec![0, 255], vec![0, 255]),
            ("|i1", vec![0, 255], vec![0, -1]),
            ("<i2", vec![1, 0, 254, 255], vec![1, -2]),
            (">u2", vec![1, 0, 254, 255], vec![256, 0xfeff]),
            ("<i4", vec![1, 0, 0, 0, 255, 255, 255, 255], vec![1, -1]),
            ("<i8", [3i64, i64::MIN].map(i64::to_le_bytes).concat(), vec![3, i64::MIN]),
            (">u8", [3u64, 1 << 40].map(u64::to_be_bytes).concat(), vec![3, 1 << 40]),
        ] {
            let bytes = npy(kind, "(2,)", "False", &data);
            assert_eq!(integers(&bytes).unwrap(), whole, "{kind}");
            let expected: Vec<f64> = whole.iter().map(|number| *number as f64).collect();
            assert_eq!(floats(&bytes).unwrap(), expected, "{kind}");
        }

        for (kind, data) in [
            ("<f2", vec![0, 0x3c, 0, 0xc0]),
            (">f4", [1f32, -2.0].map(f32::to_be_bytes).concat()),
            ("<f8", [1f64, -2.0].map(f64::to_le_bytes).concat()),
        ] {
            let bytes = npy(kind, "(2,)", "False", &data);
            assert_eq!(floats(&bytes).unwrap(), [1.0, -2.0]);
            assert!(
                integers(&bytes)
                    .unwrap_err()
                    .to_string()
                    .contains("astype(numpy.int64)")
            );
        }

        let beyond = npy("<u8", "(1,)", "False", &u64::MAX.to_le_bytes());
        assert!(integers(&beyond).unwrap_err().to_string().contains("beyond"));
    }

    fn shape_and_order(shape: &str, order: &str) -> (Vec<u64>, bool) {
        let bytes = npy("|u1", shape, order, &[0; 24]);
        let array = NpyArray::new(&bytes[..], Path::new("a.npy")).unwrap();
        (array.shape().to_vec(), array.is_column_major())
    }

    #[test]
    fn shapes_and_orders_are_told() {
        assert_eq!(shape_and_order("(2, 3, 4)", "True"), (vec![2, 3, 4], true));
        assert_eq!(shape_and_order("(24,)", "True"), (vec![24], false));
        assert_eq!(shape_and_order("()", "False"), (vec![], false));
        assert_eq!(integers(&npy("|u1", "()", "False", &[7])).unwrap(), [7]);
        assert!(integers(&npy("|u1", "(0, 5)", "False", &[])).unwrap().is_empty());
    }

    #[test]
    fn a_long_array_comes_in_pieces_and_a_short_file_is_an_error() {
        let data: Vec<u8> = (0..3_000_000u32).flat_map(u32::to_le_bytes).collect();
        let bytes = npy("<u4", "(3000, 1000)", "False", &data);
        assert!(integers(&bytes).unwrap().into_iter().eq(0..3_000_000));
        let message = integers(&bytes[..bytes.len() - 1]).unwrap_err().to_string();
        assert!(message.contains("a.npy") && message.contains("cut short"), "{message}");
        for (kind, words) in [("<U3", "no numbers"), ("|O", "pickled Python objects"), ("<c8", "no numbers")]
        {
            let message = integers(&npy(kind, "(1,)", "False", &[0; 16])).unwrap_err().to_string();
            assert!(message.contains(words), "{kind}: {message}");
        }
    }

    #[test]
    fn texts_of_an_archive_are_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("room.npz");
        let utf32: Vec<u8> = "tür\0wand".chars().flat_map(|c| u32::from(c).to_le_bytes()).collect();
        let mut zip = ZipWriter::new(File::create(&path).unwrap());
        for (name, data) in [
            ("unicode.npy", npy("<U4", "(2,)", "False", &utf32)),
            ("bytes.npy", npy("|S4", "(2,)", "False", b"bed\0sofa")),
            ("short.npy", npy("|S4", "(9999999999,)", "False", b"bed\0sofa")),
            ("none.npy", npy("<U0", "(3,)", "False", b"")),
        ] {
            zip.start_file(name, SimpleFileOptions::default()).unwrap();
            zip.write_all(&data).unwrap();
        }
        zip.finish().unwrap();

        let mut archive = NpzArchive::open(&path).unwrap();
        assert_eq!(archive.texts("unicode").unwrap(), ["tür", "wand"]);
        assert_eq!(archive.texts("bytes").unwrap(), ["bed", "sofa"]);
        assert!(archive.texts("short").unwrap_err().to_string().contains("cut short"));
        assert!(archive.texts("none").unwrap().is_empty());
    }

    #[test]
    fn arrays_of_an_archive_have_names() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("room.npz");
        let mut zip = ZipWriter::new(File::create(&path).unwrap());
        for (name, data) in [("scores.npy", [1, 2]), ("classes.npy", [3, 4]), ("notes.txt", [0, 0])] {
            zip.start_file(name, SimpleFileOptions::default()).unwrap();
            zip.write_all(&npy("|u1", "(2,)", "False", &data)).unwrap();
        }
        zip.finish().unwrap();

        let mut archive = NpzArchive::open(&path).unwrap();
        assert_eq!(archive.names(), ["classes", "scores"]);
        let mut out = Vec::new();
        assert_eq!(archive.array("scores").unwrap().read_integers(&mut out).unwrap(), 2);
        assert_eq!(out, [1, 2]);

        assert!(
            archive
                .texts("scores")
                .unwrap_err()
                .to_string()
                .contains("holds no texts")
        );

        let message = archive.array("masks").err().unwrap().to_string();
        assert!(message.contains("room.npz"), "{message}");
        std::fs::write(&path, "no archive").unwrap();
        assert!(NpzArchive::open(&path).unwrap_err().to_string().contains("is no NPZ"));
    }
}
