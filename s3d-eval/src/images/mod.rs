//! Evaluates images: classes, depth and normals of views and panoramas.

mod class;
mod depth;
mod latitude;
mod normal;
mod predictions;
mod read;
mod resample;

pub use class::{ClassScores, Confusion, Lanczos, PANORAMA, PanoramaClasses, ViewScores, class_outlines};
pub use depth::{
    Alignment, DEPTH_COLUMNS, DepthScores, EdgeScores, MARIGOLD_COLUMNS, MarigoldScores, depth_edges,
    hohonet_depth, marigold_depth, unifuse_depth,
};
pub use latitude::latitude_weights;
pub use normal::{AngleSums, DSINE_LIMITS, dsine_angle, median_of_angles, omnidata_angle, omnidata_scores};
pub use resample::{opencv_nearest, pillow_nearest};

pub(crate) use class::{sem_edge, sem_pano, sem_view};
pub(crate) use depth::{depth, depth_edge};
pub(crate) use normal::normal;
