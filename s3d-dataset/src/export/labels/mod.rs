//! Labels of an area: points vote for faces; what is known then is kept for the rest of the export.

pub(crate) mod annotate;
pub(crate) mod label_area;
pub(crate) mod overlap;
