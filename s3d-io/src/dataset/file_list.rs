//! `files.csv`: every file of a data set with its size and checksum.

use crate::error::{Error, Result};
use crate::fs::atomic::write_whole;
use crate::fs::checksum::{Checksum, ChecksumOfParts, checksum_of_file};
use crate::fs::open::{must_be_regular, open_file, read_file};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

/// The first line.
const HEADER: &str = "path,bytes,xxh3_128";

/// The longest line in bytes. A longer line is not one of these lists.
const LONGEST_LINE: u64 = 1 << 16;

/// A file of a data set.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct FileRecord {
    /// The path from the data set's folder, with `/` between names.
    pub path: String,
    /// The size.
    pub bytes: u64,
    /// The checksum of the content.
    pub xxh3_128: Checksum,
}

impl FileRecord {
    /// Returns the record of a file with the path `path` and this content, in a data set in `root`. The file
    /// itself is not read.
    ///
    /// # Errors
    /// [`Error::Format`] if the path does not lie below `root`, is not UTF-8, or cannot stand in a list.
    pub fn of_bytes(root: &Path, path: &Path, content: &[u8]) -> Result<Self> {
        Ok(Self { path: relative(root, path)?, bytes: content.len() as u64, xxh3_128: Checksum::of(content) })
    }

    /// Returns the record of a file that exists. The file is read.
    ///
    /// # Errors
    /// Like [`FileRecord::of_bytes`]; [`Error::Io`].
    pub fn of_file(root: &Path, path: &Path) -> Result<Self> {
        let relative = relative(root, path)?;
        let (bytes, xxh3_128) = checksum_of_file(path)?;
        Ok(Self { path: relative, bytes, xxh3_128 })
    }

    /// Returns the path of the file in a data set in `root`.
    pub fn path_in(&self, root: &Path) -> PathBuf {
        root.join(&self.path)
    }

    /// Checks that the file in the data set in `root` is a regular file of the recorded size. The file is not
    /// read.
    ///
    /// # Errors
    /// [`Error::Io`] if it does not exist; [`Error::Format`] if it differs.
    pub fn check_size(&self, root: &Path) -> Result<()> {
        let path = self.path_in(root);
        let found = regular_size(&path)?;
        if found == self.bytes {
            Ok(())
        } else {
            Err(self.other_size(&path, found))
        }
    }

    /// Checks that the file in the data set in `root` is the recorded one. The file is read, unless its size
    /// differs.
    ///
    /// # Errors
    /// Like [`FileRecord::check_size`].
    pub fn check(&self, root: &Path) -> Result<()> {
        self.check_size(root)?;
        let path = self.path_in(root);
        let found = checksum_of_file(&path)?;
        self.check_found(&path, found)
    }

    /// Checks like [`FileRecord::check`], with the bytes that were read from the file.
    ///
    /// # Errors
    /// [`Error::Format`] if it differs.
    pub fn check_bytes(&self, root: &Path, bytes: &[u8]) -> Result<()> {
        self.check_found(&self.path_in(root), (bytes.len() as u64, Checksum::of(bytes)))
    }

    /// Returns what [`FileRecord::check`] finds wrong with the file in the data set in `root`.
    pub fn fault(&self, root: &Path) -> Option<String> {
        self.check(root).err().map(|e| e.to_string())
    }

    /// Returns the content of the file in the data set in `root`, if it is the recorded one.
    ///
    /// # Errors
    /// Like [`FileRecord::check`].
    pub fn read(&self, root: &Path) -> Result<Vec<u8>> {
        self.check_size(root)?;
        let path = self.path_in(root);
        let bytes = read_file(&path)?;
        self.check_bytes(root, &bytes)?;
        Ok(bytes)
    }

    /// Opens the file in the data set in `root`, to read it piece by piece. See [`CheckedFile`].
    ///
    /// # Errors
    /// Like [`FileRecord::check_size`].
    pub fn open(&self, root: &Path) -> Result<CheckedFile> {
        self.check_size(root)?;
        let file = open_file(&self.path_in(root))?;
        Ok(CheckedFile { file, record: self.clone(), parts: ChecksumOfParts::default() })
    }

    fn check_found(&self, path: &Path, (bytes, sum): (u64, Checksum)) -> Result<()> {
        if bytes != self.bytes {
            return Err(self.other_size(path, bytes));
        }
        if sum == self.xxh3_128 {
            Ok(())
        } else {
            Err(Error::format(path, self.other_content(sum)))
        }
    }

    fn other_size(&self, path: &Path, found: u64) -> Error {
        Error::format(path, format!("is damaged: {found} bytes, and {} were written", self.bytes))
    }

    fn other_content(&self, found: Checksum) -> String {
        format!("is damaged: other content than was written (checksum {found}, not {})", self.xxh3_128)
    }

    /// Returns the line of the list, without the line feed.
    pub fn to_line(&self) -> String {
        format!("{},{},{}", self.path, self.bytes, self.xxh3_128)
    }
}

/// Returns the size of a regular file in bytes.
fn regular_size(path: &Path) -> Result<u64> {
    must_be_regular(path)?;
    Ok(std::fs::metadata(path).map_err(|e| Error::io(path, "read", e))?.len())
}

/// A recorded file that is read piece by piece. The read that finds the end fails if the file is not the
/// recorded one.
#[derive(Debug)]
pub struct CheckedFile {
    file: File,
    record: FileRecord,
    parts: ChecksumOfParts,
}

impl Read for CheckedFile {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        let n = self.file.read(out)?;
        self.parts.add(out.get(..n).unwrap_or_default());
        if n == 0 && !out.is_empty() {
            let (bytes, sum) = self.parts.finish();
            if (bytes, sum) != (self.record.bytes, self.record.xxh3_128) {
                return Err(io::Error::new(io::ErrorKind::InvalidData, self.record.other_content(sum)));
            }
        }
        Ok(n)
    }
}

/// Returns the path of `path` below `root`, in the form of the lists.
fn relative(root: &Path, path: &Path) -> Result<String> {
    let below = path.strip_prefix(root).ok().and_then(|p| {
        let names: Option<Vec<&str>> = p.iter().map(|name| name.to_str()).collect();
        names.map(|names| names.join("/"))
    });
    match below.as_deref().map(check_path) {
        Some(Ok(())) => Ok(below.unwrap_or_default()),
        Some(Err(why)) => Err(Error::format(path, why)),
        None => Err(Error::format(path, format!("is no file in {} with a name in UTF-8", root.display()))),
    }
}

/// Refuses a path that leads out of the folder, or that cannot stand in a line. The error is a sentence.
fn check_path(path: &str) -> std::result::Result<(), String> {
    let fault = |why: &str| Err(format!("{path:?} is no path of a file in the folder: {why}"));
    if path.is_empty() {
        return fault("it is empty");
    }
    if path.contains([',', '"', '\\', ':']) || path.chars().any(char::is_control) {
        return fault("it has a comma, a quote, a backslash, a colon or a control character in it");
    }
    if path.starts_with('/') {
        return fault("it starts at the root");
    }
    if path.split('/').any(|name| matches!(name, "" | "." | "..")) {
        return fault("a name in it is empty, . or ..");
    }
    Ok(())
}

/// Writes the list, sorted by path. Returns the list's own size and checksum.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if a path occurs twice, or leads out of the folder.
pub fn write_file_list(path: &Path, records: &[FileRecord]) -> Result<(u64, Checksum)> {
    let mut sorted: Vec<&FileRecord> = records.iter().collect();
    sorted.sort_by(|a, b| a.path.as_bytes().cmp(b.path.as_bytes()));
    for record in &sorted {
        check_path(&record.path).map_err(|why| Error::format(path, why))?;
    }
    if let Some([double, _]) = sorted.array_windows().find(|[a, b]| a.path == b.path) {
        return Err(Error::format(path, format!("{:?} would be in it twice", double.path)));
    }

    let text = list_text(sorted);
    write_whole(path, |w| w.write_all(text.as_bytes()))?;
    Ok((text.len() as u64, Checksum::of(text.as_bytes())))
}

/// Returns the text of a list of sorted records.
fn list_text<'a>(sorted: impl IntoIterator<Item = &'a FileRecord>) -> String {
    let mut text = String::from(HEADER);
    text.push('\n');
    for record in sorted {
        text += &record.to_line();
        text.push('\n');
    }
    text
}

/// Returns the checksum of the list that [`write_file_list`] writes for sorted records. A list that was read
/// has this checksum even if another program has changed its line feeds.
pub fn file_list_checksum(sorted: &[FileRecord]) -> Checksum {
    Checksum::of(list_text(sorted).as_bytes())
}

/// Reads a list that [`write_file_list`] wrote, and nothing else. Lines may also end with a carriage return
/// and a line feed.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line, if
/// - the header is another, or the last line has no line feed;
/// - a line is no path, size and checksum;
/// - a path leads out of the folder, or does not sort behind the one before;
/// - the sum of the sizes does not fit in 64 bits.
pub fn read_file_list(path: &Path) -> Result<Vec<FileRecord>> {
    parse_file_list(BufReader::new(open_file(path)?), path)
}

/// Reads like [`read_file_list`], from a reader of the list. Errors call the file `name`.
///
/// # Errors
/// Like [`read_file_list`].
pub fn parse_file_list(mut lines: impl BufRead, name: &Path) -> Result<Vec<FileRecord>> {
    let mut records: Vec<FileRecord> = Vec::new();
    let mut known: BTreeSet<String> = BTreeSet::new();
    let mut total = 0u64;

    let mut line = Vec::new();
    for number in 1u64.. {
        let fault = |message: String| Err(Error::line(name, number, message));
        line.clear();
        let read = Read::take(&mut lines, LONGEST_LINE)
            .read_until(b'\n', &mut line)
            .map_err(|e| Error::io(name, "read", e))?;
        if read == 0 {
            return if number == 1 {
                fault("is empty".to_owned())
            } else {
                Ok(records)
            };
        }

        let Some(text) = line.strip_suffix(b"\n") else {
            return fault("is cut off: it does not end with a line feed".to_owned());
        };
        let text = text.strip_suffix(b"\r").unwrap_or(text);
        let Ok(text) = std::str::from_utf8(text) else {
            return fault("is no text in UTF-8".to_owned());
        };

        if number == 1 {
            if text != HEADER {
                return fault(format!("should be {HEADER:?}"));
            }
            continue;
        }

        let record = match parse_line(text) {
            Ok(record) => record,
            Err(message) => return fault(message),
        };
        if records
            .last()
            .is_some_and(|last| last.path.as_bytes() >= record.path.as_bytes())
        {
            return fault(format!("{:?} does not sort behind the path before it", record.path));
        }
        // A file system that ignores case takes two such names for one.
        if !known.insert(record.path.to_lowercase()) {
            return fault(format!(
                "{:?} differs from an earlier path by upper and lower case alone",
                record.path
            ));
        }

        let Some(sum) = total.checked_add(record.bytes) else {
            return fault("with the files before it there are more bytes than 64 bits can count".to_owned());
        };
        total = sum;
        records.push(record);
    }
    Ok(records)
}

fn parse_line(text: &str) -> std::result::Result<FileRecord, String> {
    let mut fields = text.split(',');
    let (Some(path), Some(bytes), Some(sum), None) =
        (fields.next(), fields.next(), fields.next(), fields.next())
    else {
        return Err(format!("has {} fields instead of path, bytes and checksum", text.split(',').count()));
    };

    check_path(path)?;
    let size: Option<u64> = bytes.parse().ok().filter(|size: &u64| size.to_string() == bytes);
    let size = size.ok_or_else(|| format!("{bytes:?} is no number of bytes"))?;
    let xxh3_128 = sum
        .parse()
        .map_err(|e: crate::fs::checksum::BadChecksum| e.to_string())?;
    Ok(FileRecord { path: path.to_owned(), bytes: size, xxh3_128 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fs::atomic::{create_dir, write_bytes};

    fn record(path: &str, content: &[u8]) -> FileRecord {
        FileRecord { path: path.into(), bytes: content.len() as u64, xxh3_128: Checksum::of(content) }
    }

    #[test]
    fn lines_of_other_systems_are_the_same_list() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("files.csv");
        let records = [record("a/b.png", b"1"), record("c.json", b"22")];
        let (_, sum) = write_file_list(&path, &records).unwrap();
        let text = std::fs::read_to_string(&path).unwrap().replace('\n', "\r\n");
        write_bytes(&path, text.as_bytes()).unwrap();
        let back = read_file_list(&path).unwrap();
        assert_eq!(back, records);
        assert_eq!(file_list_checksum(&back), sum);
    }

    #[test]
    fn a_list_is_sorted_by_bytes_and_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("files.csv");
        let mut records =
            vec![record("b", b"1"), record("a/z.png", b""), record("a b.txt", b"22"), record("Z", b"")];
        let (bytes, sum) = write_file_list(&path, &records).unwrap();
        assert_eq!(checksum_of_file(&path).unwrap(), (bytes, sum));
        records.sort();
        assert_eq!(
            records.iter().map(|r| r.path.as_str()).collect::<Vec<_>>(),
            ["Z", "a b.txt", "a/z.png", "b"]
        );
        assert_eq!(read_file_list(&path).unwrap(), records);
        let text = std::fs::read_to_string(&path).unwrap();
        assert!(text.starts_with("path,bytes,xxh3_128\nZ,0,99aa06d3014798d86001c324468d497f\n"), "{text}");
        write_file_list(&path, &[]).unwrap();
        assert_eq!(read_file_list(&path).unwrap(), []);

        records.push(record("Z", b""));
        assert!(
            write_file_list(&path, &records)
                .unwrap_err()
                .to_string()
                .contains("\"Z\" would be in it twice")
        );
        assert!(write_file_list(&path, &[record("../x", b"")]).is_err());
    }

    #[test]
    fn records_are_of_files_below_the_folder_and_tell_what_is_wrong() {
        let dir = tempfile::tempdir().unwrap();
        let root = dir.path();
        create_dir(&root.join("a/b")).unwrap();
        let path = root.join("a/b/c.txt");
        write_bytes(&path, b"content").unwrap();
        let record = FileRecord::of_file(root, &path).unwrap();
        assert_eq!(record, FileRecord::of_bytes(root, &path, b"content").unwrap());
        assert_eq!((record.path.as_str(), record.path_in(root)), ("a/b/c.txt", path.clone()));
        assert_eq!((record.fault(root), record.read(root).unwrap()), (None, b"content".to_vec()));
        let pieces = || {
            let mut all = Vec::new();
            record
                .open(root)?
                .read_to_end(&mut all)
                .map_err(|e| Error::io(&path, "read", e))?;
            Ok(all)
        };
        assert_eq!(pieces().unwrap(), b"content");
        let told = |words: &str| {
            let all: [Result<()>; 3] = [record.check(root), record.read(root).map(drop), pieces().map(drop)];
            all.into_iter().all(|told| {
                let told = told.unwrap_err().to_string();
                told.contains("a/b/c.txt: ") && told.contains(words)
            })
        };

        write_bytes(&path, b"contend").unwrap();
        assert!(record.check_size(root).is_ok() && told("other content than was written"));
        write_bytes(&path, b"parcel").unwrap();
        assert!(record.check_size(root).is_err() && told("6 bytes, and 7 were written"));
        std::fs::remove_file(&path).unwrap();
        assert!(record.check_size(root).is_err() && told("cannot read"));
        create_dir(&path).unwrap();
        assert!(record.check_size(root).is_err() && told("is a folder"));

        for (root, path) in [("x", "y"), ("x", "x"), ("x", "x/../y"), ("x", "x/a,b")] {
            assert!(FileRecord::of_bytes(Path::new(root), Path::new(path), b"").is_err(), "{path}");
        }
    }

    #[test]
    fn every_fault_is_named_with_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("files.csv");
        let good = "a,0,99aa06d3014798d86001c324468d497f";
        for (text, words) in [
            (String::new(), "line 1: is empty"),
            ("path,bytes\n".into(), "line 1: should be"),
            (format!("{HEADER}\n{good}"), "line 2: is cut off"),
            (format!("{HEADER}\n{good}\n\n"), "line 3: has 1 fields"),
            (format!("{HEADER}\n{good},7\n"), "line 2: has 4 fields"),
            (format!("{HEADER}\n{good}\n{good}\n"), "line 3: \"a\" does not sort"),
            (format!("{HEADER}\n{}\n{good}\n", good.replace("a,", "A,")), "line 3: \"a\" differs"),
            (format!("{HEADER}\n{}\n", good.replace(",0,", ",-1,")), "line 2: \"-1\" is no number"),
            (format!("{HEADER}\n{}\n", good.replace(",0,", ",00,")), "line 2: \"00\" is no number"),
            (
                format!("{HEADER}\n{}\n", good.replace(",0,", ",99999999999999999999,")),
                "is no number of bytes",
            ),
            (
                format!(
                    "{HEADER}\n{}\nb{}\n",
                    good.replace(",0,", &format!(",{},", u64::MAX)),
                    &good[1..].replace(",0,", ",1,")
                ),
                "line 3: with the files before it",
            ),
            (format!("{HEADER}\n{}\n", good.replace("9", "x")), "line 2: \"xxaa"),
            (format!("{HEADER}\n../{good}\n"), "line 2: \"../a\" is no path"),
            (format!("{HEADER}\na/../../{good}\n"), "a name in it is empty, . or .."),
            (format!("{HEADER}\n/{good}\n"), "starts at the root"),
            (format!("{HEADER}\nC:/{good}\n"), "a colon"),
            (format!("{HEADER}\nb\\{good}\n"), "a backslash"),
            (format!("{HEADER}\nb\0{good}\n"), "a control character"),
            (format!("{HEADER}\n{}\n", "b".repeat(70_000)), "line 2: is cut off"),
        ] {
            write_bytes(&path, text.as_bytes()).unwrap();
            let message = read_file_list(&path).unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("files.csv"), "{text:?}: {message}");
        }

        write_bytes(&path, b"path,bytes,xxh3_128\n\xff,0,0\n").unwrap();
        assert!(
            read_file_list(&path)
                .unwrap_err()
                .to_string()
                .contains("line 2: is no text")
        );
        assert!(matches!(read_file_list(&dir.path().join("gone")), Err(Error::Io { .. })));
    }
}
