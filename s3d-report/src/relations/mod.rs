//! How what the images show belongs together: the objects of an image and what hides them, images that see
//! the same surface, and the places that are joined by such images.

mod graph;
mod objects;
mod outline;
mod partners;

pub(crate) use graph::Graph;
pub(crate) use objects::{ObjectEntry, objects};
pub(crate) use partners::{Member, Pairs, Partner, Place, check};
