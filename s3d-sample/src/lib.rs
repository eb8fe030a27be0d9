//! The choice of camera views for a registered data set of an indoor scan, as 2D-3D-S (Armeni et al. 2017)
//! made it. Numbers in, numbers out: the crate knows no renderer, no labels and no files.
//!
//! # Draw
//!
//! [`draw_view`] draws the candidate [`View`]s of a scan location from a [`ViewDistribution`]. A scan without
//! scan locations gets some from [`poisson_disk`], which spreads points evenly.
//!
//! # Score
//!
//! A renderer counts the pixels of each class in a view. The score of the view is the [`entropy`] of these
//! counts.
//!
//! # Select
//!
//! [`select_pooled`] keeps the views with the higher scores. A [`Pool`] says which views compete with each
//! other, and a [`Selection`] how many stay. [`folds`] splits the areas for cross-validation.
//!
//! # One seed
//!
//! Every random number follows from one seed and the name of the thing it is drawn for. Neither threads nor
//! order change it.
//!
//! # Example
//!
//! ```
//! use s3d_sample::{Pool, PoolItem, Selection, ViewDistribution, draw_view, entropy, select_pooled};
//!
//! let seed = 42;
//! let camera = "8eb9955b866b4b5f74abb1071416c628";
//! let views: Vec<_> = (0..72).map(|i| draw_view(&ViewDistribution::default(), seed, camera, i)).collect();
//! assert!(views.iter().all(|view| (10.0..=75.0).contains(&view.fov_rad.to_degrees().round())));
//!
//! // Say that the wider views see more classes.
//! let items: Vec<_> = (0u32..72)
//!     .map(|view| {
//!         let classes = (views[view as usize].fov_rad * 10.0) as usize;
//!         let histogram: [u64; 13] = std::array::from_fn(|class| u64::from(class < classes) * 1000);
//!         PoolItem { area: 1, location: camera, view, score: entropy(&histogram) }
//!     })
//!     .collect();
//! let stays = select_pooled(&items, Pool::Location, &Selection::default(), seed);
//! assert_eq!(stays.iter().filter(|&&stays| stays).count(), 52);
//! ```

// Only a caller's mistake panics, and a section "Panics" names it. Loops take their indices from ranges and
// permutations of their own.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

mod entropy;
mod fold;
mod poisson_disk;
mod pool;
mod select;
mod stream;
mod view;

pub use entropy::entropy;
pub use fold::{Fold, folds};
pub use poisson_disk::{poisson_disk, poisson_disk_where};
pub use pool::{Pool, PoolItem, UnknownPool, select_pooled};
pub use select::{Selection, SelectionError, select};
pub use view::{CANDIDATES_PER_LOCATION, DistributionError, View, ViewDistribution, draw_view};

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
