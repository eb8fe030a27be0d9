//! Renders views of a mesh without annotations: one view, or the views of a list of cameras.

mod frame_names;
mod poses;
mod view;

pub use poses::{PosesOptions, RenderedPoses, render_poses};
pub use view::{RenderOptions, render};
