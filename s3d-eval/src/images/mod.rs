//! Evaluates images: classes and depth of panoramas, normals of views or panoramas.

mod confusion;
mod depth;
mod depth_metrics;
mod lanczos;
mod median;
mod normal;
mod normal_metrics;
mod panorama;
mod predictions;
mod read;
mod resample;
mod sem_pano;

pub use confusion::{ClassScores, Confusion};
pub use depth_metrics::{DEPTH_COLUMNS, DepthScores, hohonet_depth, unifuse_depth};
pub use lanczos::Lanczos;
pub use normal_metrics::{
    AngleSums, DSINE_LIMITS, dsine_angle, median_of_angles, omnidata_angle, omnidata_scores,
};
pub use panorama::{PANORAMA, PanoramaClasses};
pub use resample::{opencv_nearest, pillow_nearest};

pub(crate) use depth::depth;
pub(crate) use normal::normal;
pub(crate) use sem_pano::sem_pano;
