//! All tests of the command line in one program. As two dozen programs, each would be compiled and linked
//! with all crates. `cargo test -p s3d-cli kill::` runs the tests of one file.

mod common;

mod align;
mod areas;
mod bad_input;
mod bad_names;
mod cameras;
#[path = "compare/main.rs"]
mod compare;
#[path = "damage/main.rs"]
mod damage;
mod determinism;
mod errors;
mod eval;
mod frames;
mod fuse;
mod kill;
mod label_folder;
mod large;
mod links;
mod lists;
mod pack;
#[path = "photographs/main.rs"]
mod photographs;
#[path = "pictures/main.rs"]
mod pictures;
mod point_colors;
mod poses;
mod read_back;
mod shards;
mod sources;
mod taxonomy;
mod unlabelled;
#[path = "verify/main.rs"]
mod verify;
mod watch;
