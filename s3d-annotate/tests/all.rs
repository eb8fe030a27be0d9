//! The tests of this crate as one program.

mod labelling;
mod masks;
mod outputs;
mod person;
mod person_oracle;
#[expect(dead_code, reason = "the bench has more scenes")]
mod person_scenes;
mod person_sitting;
mod proposals;
mod review;
mod segments;
#[cfg(feature = "server")]
mod server;
mod structure;
mod workbench;
