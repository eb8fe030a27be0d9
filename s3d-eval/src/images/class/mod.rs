//! Classes of pixels: protocols `sem-pano`, `sem-view` and `sem-edge`.

mod classes;
mod confusion;
mod lanczos;
mod outline_metrics;
mod panorama;
mod sem_edge;
mod sem_pano;
mod sem_view;

pub use confusion::{ClassScores, Confusion, ViewScores};
pub use lanczos::Lanczos;
pub use outline_metrics::class_outlines;
pub use panorama::{PANORAMA, PanoramaClasses};

pub(crate) use sem_edge::sem_edge;
pub(crate) use sem_pano::sem_pano;
pub(crate) use sem_view::sem_view;
