//! Renders views of a mesh without annotations: one view, or a view of each camera of a list.

mod frame_names;
mod poses;
mod view;

pub use poses::{PosesOptions, RenderedPoses, render_poses};
pub use view::{RenderOptions, render};
