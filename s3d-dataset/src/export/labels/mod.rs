//! The labels of an area: points vote for faces, and the result is kept for the rest of the export.

pub(crate) mod annotate;
pub(crate) mod label_area;
pub(crate) mod overlap;
pub(crate) mod survey;
