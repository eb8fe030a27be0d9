//! The tests of this crate as one program.

mod labelling;
mod segments;
mod structure;
