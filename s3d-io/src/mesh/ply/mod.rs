//! PLY files, and the meshes in them.
//!
//! The reader is our own: ply-rs holds an element whole, where a file of any size is read here in little
//! memory (`a_cloud_of_one_instance_is_boxed_and_voxelised_in_little_memory`), with the columns of data sets
//! (`ply_files_of_other_libraries_with_the_columns_of_data_sets`).

pub(crate) mod batch;
pub(crate) mod elements;
mod faces;
pub(crate) mod header;
mod labels;
mod looks;
pub(crate) mod read;
mod rows;
mod source;
mod vertices;
