//! The tests of this folder, as one program.
