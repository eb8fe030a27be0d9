//! What readers of annotations do about a fault.

/// What to do about a faulty name or line. The published files have a few.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum OnFault {
    /// Stop with an error that names it.
    #[default]
    Stop,
    /// Leave it out, and keep count of it.
    Skip,
}
