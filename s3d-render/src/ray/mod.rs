//! Single rays, exact: what a pixel sees is what its ray hits.

pub(crate) mod caster;
pub(crate) mod cone;
