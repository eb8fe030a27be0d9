//! Surface normals: protocol `normal`.

mod median;
mod metrics;
mod protocol;

pub use metrics::{AngleSums, DSINE_LIMITS, dsine_angle, median_of_angles, omnidata_angle, omnidata_scores};

pub(crate) use protocol::normal;
