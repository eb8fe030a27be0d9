//! How scan locations are placed where none are listed.

/// How scan locations are placed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Placing {
    /// No two of a room nearer to each other than this, metres.
    Apart(f64),
    /// As few as see this share of the surface that can be seen at all.
    Seeing(f64),
}

/// The share that is asked for where nothing is said.
pub(crate) const SHARE: f64 = 0.95;
