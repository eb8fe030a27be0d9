//! Wide registers.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod blend;
pub(crate) mod lanes;
pub(crate) mod registers;
