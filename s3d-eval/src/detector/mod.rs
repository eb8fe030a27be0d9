//! The baseline detector of the 2D-3D-S paper.
//!
//! Points of an area are parsed into [spaces] such as rooms, without training; boxes that may hold an element
//! of twelve classes are [proposed](proposals), described by [features], scored by [linear machines](svm),
//! and scored again by what is [around them](context). [`Model`](model::Model) is all of it, trained;
//! [`cross_validate`](table::cross_validation::cross_validate) is the paper's table.
//!
//! ```no_run
//! use s3d_eval::Context;
//! use s3d_eval::detector::model::TrainOptions;
//! use s3d_eval::detector::space::SpaceSource;
//! use s3d_eval::detector::table::cross_validation::{cross_validate, read_areas};
//! use s3d_eval::detector::table::markdown;
//!
//! let (data, context) = (s3d_dataset::DataSet::open("dataset".as_ref())?, Context::default());
//! let areas = read_areas(&data, data.areas(), SpaceSource::Parsed, &context)?;
//! let table = cross_validate(&areas, &TrainOptions::default(), &context)?;
//! println!("{}", markdown(&[table]));
//! # Ok::<(), s3d_eval::Error>(())
//! ```
//!
//! What is the paper's and what is ours stands in each module, and in docs/detector.md.

pub mod area;
pub mod boxes;
pub mod context;
pub mod features;
pub mod learn;
pub mod model;
pub mod palette;
pub mod proposals;
pub mod space;
pub mod spaces;
pub mod surfel;
pub mod svm;
pub mod table;
