//! Labels for bare scans.

// No content of a file may make this crate panic.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic, clippy::string_slice))]

pub mod labelling;
pub mod segments;
