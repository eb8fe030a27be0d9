//! LAS and LAZ files, 1.0 to 1.4. Source: "LAS Specification 1.4 - R15", ASPRS.

mod bounded;
mod claims;
mod dimensions;
pub(crate) mod read;
mod write;

pub use write::write_las_points;

/// Returns the bytes of a number that stands `at` bytes into a record, if the record reaches so far.
fn number_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}
