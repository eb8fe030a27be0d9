//! Evaluates images: classes, depth and normals of views and panoramas.

mod classes;
mod confusion;
mod depth;
mod depth_edge;
mod depth_files;
mod depth_metrics;
mod edge_metrics;
mod lanczos;
mod latitude;
mod marigold;
mod median;
mod normal;
mod normal_metrics;
mod outline_metrics;
mod panorama;
mod predictions;
mod read;
mod resample;
mod sem_edge;
mod sem_pano;
mod sem_view;

pub use confusion::{ClassScores, Confusion, ViewScores};
pub use depth_metrics::{DEPTH_COLUMNS, DepthScores, hohonet_depth, unifuse_depth};
pub use edge_metrics::{EdgeScores, depth_edges};
pub use lanczos::Lanczos;
pub use latitude::latitude_weights;
pub use marigold::{Alignment, MARIGOLD_COLUMNS, MarigoldScores, marigold_depth};
pub use normal_metrics::{
    AngleSums, DSINE_LIMITS, dsine_angle, median_of_angles, omnidata_angle, omnidata_scores,
};
pub use outline_metrics::class_outlines;
pub use panorama::{PANORAMA, PanoramaClasses};
pub use resample::{opencv_nearest, pillow_nearest};

pub(crate) use depth::depth;
pub(crate) use depth_edge::depth_edge;
pub(crate) use normal::normal;
pub(crate) use sem_edge::sem_edge;
pub(crate) use sem_pano::sem_pano;
pub(crate) use sem_view::sem_view;
