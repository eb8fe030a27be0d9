//! Point clouds in PLY files.

mod colored;
mod labelled;
pub(crate) mod read;
mod sample;
mod write;

pub use colored::{ColoredPointWriter, write_colored_points};
pub use labelled::{LabelledPoint, LabelledPoints};
pub use sample::read_point_sample;
pub use write::{PlyPointWriter, read_ply_point_count};
