//! Files: opened, written whole or not at all, checked, and on the disk.

pub(crate) mod atomic;
pub(crate) mod checksum;
pub(crate) mod json;
pub(crate) mod open;
mod sync;

pub use atomic::{AtomicFile, create_dir, write_bytes, write_whole};
pub use checksum::{BadChecksum, Checksum, ChecksumOfParts, checksum_of_file};
pub use json::{read_json, write_json};
pub use sync::{SyncAhead, sync_data_set, sync_file};
