//! The survey of an area, as data: labels of faces, rooms, scan locations and what they see, candidate views,
//! and labels of images that follow the picture.

pub(crate) mod annotated;
pub(crate) mod candidate;
pub(crate) mod columns;
pub(crate) mod labelled_area;
pub(crate) mod outlook;
pub(crate) mod refined_labels;
pub(crate) mod room_names;
pub(crate) mod rooms_around;
pub(crate) mod strays;
pub(crate) mod surface_boxes;
pub(crate) mod surface_seen;
