//! Calls of other crates' decoders that panic on damaged files. exr, e57, laz and image panic on the files in
//! `tests/fixtures/fuzz`, which `tests/findings.rs` feeds to them again.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Returns the result of `f`, or `None` if it panicked.
pub(crate) fn guarded<T>(f: impl FnOnce() -> T) -> Option<T> {
    DEPTH.set(DEPTH.get() + 1);
    let result = catch_unwind(AssertUnwindSafe(f));
    DEPTH.set(DEPTH.get() - 1);
    result.ok()
}

/// Returns whether this crate would catch a panic of this thread now and turn it into an
/// [`Error`](crate::Error), because some readers call decoders that panic on damaged files. Panic hooks are
/// called all the same; they can ask this function and stay silent.
pub fn panic_is_caught() -> bool {
    DEPTH.get() > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_caught_and_known_to_be() {
        assert!(!panic_is_caught());
        assert_eq!(guarded(|| (panic_is_caught(), guarded(|| 7))), Some((true, Some(7))));
        let hollow: Vec<u32> = Vec::new();
        assert_eq!(guarded(|| hollow[0]), None);
        assert!(!panic_is_caught());
    }
}
