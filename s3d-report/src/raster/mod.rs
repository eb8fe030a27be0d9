//! Images as arrays of pixels: reduced, and the direction in which there is most to see.

pub(crate) mod look;
pub(crate) mod reduce;
