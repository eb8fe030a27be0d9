//! A sparse grid of blocks of voxels.
