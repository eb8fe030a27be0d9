//! Buildings.

pub(crate) mod demo;
