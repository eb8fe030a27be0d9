//! Renders views of a mesh without annotations: one view, a view of each camera of a list, or a walk.

mod frame_names;
mod poses;
mod video;
mod view;

pub use poses::{PosesOptions, RenderedPoses, render_poses, render_walk};
pub use view::{RenderOptions, render};
