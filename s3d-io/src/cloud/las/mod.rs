//! LAS and LAZ files.

mod bounded;
pub(crate) mod read;
