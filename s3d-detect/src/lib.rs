//! The baseline detector of the 2D-3D-S paper (Armeni et al. 2017): elements of twelve classes, found in the
//! points of an area.
//!
//! # From points to spaces
//!
//! [`Area::read`] reads the points of an area of a data set, thinned to [surfels](surfel) of 5 cm, and its
//! annotated elements. [`ParsedArea::new`] finds its [spaces], such as rooms and hallways, without training,
//! and turns each into a frame of its own. [`read_areas`] does both.
//!
//! # From spaces to a model
//!
//! [`Model::train`] learns three things from annotated spaces: the [windows](proposals) that may hold an
//! element; for each class a [linear machine](svm) that scores a box by its [features]; and how neighbours
//! change a score, the [context]. [`Model::save`] and [`Model::load`] keep a model in a file.
//!
//! # From a model to boxes
//!
//! [`detect_area`] returns the elements that a model finds in an area, as boxes in the world frame, in
//! metres. [`cross_validate`] trains and tests over the folds of the paper, scores with [`s3d_eval::boxes`],
//! and returns a [`table::Table`] in the form of the paper.
//!
//! The same data, options and seed give the same bytes for any number of threads. Each module says what
//! the paper has and what is chosen here; `docs/detector.md` of the repository has all of it, with figures.
//!
//! # Example
//!
//! A model learns from one room with a sofa, and finds the sofa of another.
//!
//! ```
//! use glam::{Vec3, vec3};
//! use s3d_detect::surfel::surfels_of;
//! use s3d_detect::{
//!     Area, CLASSES, Context, Element, Model, ParsedArea, SpaceSource, TrainOptions, boxes, detect_area,
//! };
//! use s3d_geom::{Aabb, PointCloud};
//! use s3d_label::Class;
//!
//! // Points every 2.5 cm on the surface of a box.
//! fn scan(cloud: &mut PointCloud, bbox: Aabb, color: [u8; 3]) {
//!     let last = (bbox.size() / 0.025).round().as_uvec3();
//!     for (x, y) in (0..=last.x).flat_map(|x| (0..=last.y).map(move |y| (x, y))) {
//!         let is_side = x == 0 || x == last.x || y == 0 || y == last.y;
//!         for z in (0..=last.z).filter(|&z| is_side || z == last.z) {
//!             cloud.positions.push(bbox.min + 0.025 * vec3(x as f32, y as f32, z as f32));
//!             cloud.colors.push(color);
//!         }
//!     }
//! }
//!
//! // A room of 4 × 3 m with a floor and a sofa of 1.6 × 0.8 × 0.7 m; `Area::read` reads a real one.
//! let class = CLASSES.iter().position(|c| *c == Class::SOFA).unwrap();
//! let room = |number: u32, corner: Vec3| {
//!     let bbox = Aabb { min: corner, max: corner + vec3(1.6, 0.8, 0.7) };
//!     let mut cloud = PointCloud::default();
//!     scan(&mut cloud, Aabb { min: Vec3::ZERO, max: vec3(4.0, 3.0, 0.0) }, [180, 170, 160]);
//!     scan(&mut cloud, bbox, [150, 40, 40]);
//!     let elements = vec![Element { class, room: 0, bbox }];
//!     let rooms = vec!["office_1".to_owned()];
//!     ParsedArea::new(Area { number, surfels: surfels_of(&cloud, 0), rooms, elements }, SpaceSource::Rooms)
//! };
//!
//! let context = Context::default();
//! let seen = room(1, vec3(1.0, 1.2, 0.0));
//! let unseen = room(2, vec3(2.0, 0.5, 0.0));
//! let spaces: Vec<_> = seen.spaces.iter().collect();
//! let model = Model::train(&spaces, &TrainOptions::default(), &context)?;
//! let found = detect_area(&model, &unseen, &context)?;
//!
//! let best = &found[0];
//! assert_eq!((best.class.as_str(), best.room.as_str()), ("sofa", "office_1"));
//! let bbox = Aabb { min: best.min.into(), max: best.max.into() };
//! assert!(boxes::iou(&bbox, &unseen.elements[0].bbox) > 0.5, "{bbox:?}");
//! # Ok::<(), s3d_detect::Error>(())
//! ```

// No content of a file may make this crate panic.
#![cfg_attr(not(test), deny(clippy::unwrap_used, clippy::panic, clippy::string_slice))]

pub mod boxes;
pub mod context;
pub mod features;
pub mod learn;
pub mod palette;
pub mod proposals;
pub mod spaces;
pub mod surfel;
pub mod svm;
pub mod table;

mod area;
mod error;
mod found;
mod model;

pub use area::{Area, CLASSES, Element, STRUCTURAL};
pub use error::{Error, Result};
pub use found::{FoundBox, detect_area};
pub use model::{Detection, Model, TrainOptions, recalled};
pub use s3d_dataset::Context;
pub use spaces::parsed_area::{ParsedArea, read_areas};
pub use spaces::space::{Space, SpaceSource, UnknownSpaceSource, spaces_of};
pub use table::cross_validation::cross_validate;

/// The README's example, compiled.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
