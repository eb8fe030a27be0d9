//! Rays, cast exactly: a pixel sees the face that its ray hits.

pub(crate) mod caster;
pub(crate) mod cone;
pub(crate) mod inside;
pub(crate) mod wide;
