//! The tests of this crate as one program.

mod labelling;
mod review;
mod segments;
mod workbench;
