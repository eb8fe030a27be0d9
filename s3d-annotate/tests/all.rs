//! The tests of this crate as one program.

mod labelling;
mod masks;
mod outputs;
mod person;
mod proposals;
mod review;
mod segments;
#[cfg(feature = "server")]
mod server;
mod structure;
mod workbench;
