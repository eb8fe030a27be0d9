//! Point clouds in PLY files.

mod labelled;
pub(crate) mod read;
mod sample;
mod write;

pub use labelled::{LabelledPoint, LabelledPoints};
pub use sample::{read_point_sample, write_colored_points};
pub use write::{PlyPointWriter, read_ply_point_count};
