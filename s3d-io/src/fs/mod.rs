//! Files: written whole or not at all, synced to the disk, checked by their checksums; JSON.
//!
//! An [`AtomicFile`] takes its name only when it is complete; [`write_bytes`] and [`write_whole`] write one
//! in a single call. [`sync_data_set`] syncs a whole data set to the disk, and [`SyncAhead`] does so while it
//! is written. A [`Checksum`] is a 128-bit XXH3 hash. [`read_json`] and [`write_json`] name the file in their
//! errors, and `read_json` the line. All readers of this crate open files through [`open_file`] and
//! [`read_file`], which refuse pipes and devices, because those may never end. [`portable_file_name`] turns
//! any text into a file name.
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
#[cfg(all(feature = "json", feature = "write"))]
pub use json::write_json;
#[cfg(feature = "json")]
pub use json::{parse_json, read_json};
pub use names::{UniqueNames, portable_file_name};
pub use open::{open_file, read_file};
#[cfg(feature = "write")]
pub use sync::{SyncAhead, sync_data_set, sync_file};
