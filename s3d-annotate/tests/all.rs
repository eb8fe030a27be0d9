//! The tests of this crate as one program.

mod labelling;
mod outputs;
mod proposals;
mod segments;
mod workbench;
mod structure;
