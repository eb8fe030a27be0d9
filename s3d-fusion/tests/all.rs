//! The tests of this folder, as one program.

mod common;
mod surfaces;
