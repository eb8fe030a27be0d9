//! Depth: protocols `depth` and `depth-edge`.

mod edge_metrics;
mod edge_protocol;
mod files;
mod marigold;
mod metrics;
mod protocol;

pub use edge_metrics::{EdgeScores, depth_edges};
pub use marigold::{Alignment, MARIGOLD_COLUMNS, MarigoldScores, marigold_depth};
pub use metrics::{DEPTH_COLUMNS, DepthScores, hohonet_depth, unifuse_depth};

pub(crate) use edge_protocol::depth_edge;
pub(crate) use protocol::depth;
