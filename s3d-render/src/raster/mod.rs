//! Which face each pixel sees: faces drawn from the rays' common origin, the nearest first, with the answer
//! of exact single rays.

pub(crate) mod batch;
pub(crate) mod canvas;
pub(crate) mod chunk;
pub(crate) mod clusters;
pub(crate) mod panorama;
pub(crate) mod panorama_batch;
pub(crate) mod panorama_grid;
pub(crate) mod pinhole;
pub(crate) mod visibility;
pub(crate) mod window;
