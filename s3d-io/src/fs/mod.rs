//! Files: written whole or not at all, brought to the disk, checked by their checksums; JSON.
//!
//! [`AtomicFile`] takes its name only when it is complete; [`write_bytes`] and [`write_whole`] write one in a
//! call. [`sync_data_set`] brings a whole data set to the disk and [`SyncAhead`] does so while it is written.
//! A [`Checksum`] is XXH3 of 128 bits. [`read_json`] and [`write_json`] name the file, and the line, in their
//! errors. [`open_file`] and [`read_file`] are what all readers of this crate open files with: they refuse
//! pipes and devices, which may never end. [`portable_file_name`] makes a file's name of any text.
//!
//! ```
//! use s3d_io::fs::{Checksum, checksum_of_file, write_bytes};
//!
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("list.txt");
//! write_bytes(&path, b"a wall\n")?;
//! assert_eq!(checksum_of_file(&path)?, (7, Checksum::of(b"a wall\n")));
//! # Ok::<(), s3d_io::Error>(())
//! ```

#[cfg(feature = "write")]
pub(crate) mod atomic;
#[cfg(feature = "dataset")]
pub(crate) mod checksum;
pub(crate) mod encoding;
#[cfg(feature = "json")]
pub(crate) mod json;
pub(crate) mod names;
pub(crate) mod open;
pub(crate) mod quote;
pub(crate) mod source;
#[cfg(feature = "write")]
mod sync;
pub(crate) mod text;

#[cfg(feature = "write")]
pub use atomic::{AtomicFile, create_dir, write_bytes, write_whole};
#[cfg(feature = "dataset")]
pub use checksum::{BadChecksum, Checksum, ChecksumOfParts, checksum_of_file};
#[cfg(feature = "json")]
pub use json::read_json;
#[cfg(all(feature = "json", feature = "write"))]
pub use json::write_json;
pub use names::{UniqueNames, portable_file_name};
pub use open::{open_file, read_file};
#[cfg(feature = "write")]
pub use sync::{SyncAhead, sync_data_set, sync_file};
