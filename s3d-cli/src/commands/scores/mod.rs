//! Results on a data set, and the baseline that makes some.

pub(crate) mod detect;
pub(crate) mod eval;
