//! Files: opened, written whole or not at all, checked, and on the disk.

#[cfg(feature = "write")]
pub(crate) mod atomic;
#[cfg(feature = "dataset")]
pub(crate) mod checksum;
#[cfg(feature = "json")]
pub(crate) mod json;
pub(crate) mod open;
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
#[cfg(feature = "write")]
pub use sync::{SyncAhead, sync_data_set, sync_file};
